"""Import of missions from CPHD, CRSD and SICD files, and export of simulated phase histories as CPHD."""

# What other rooms may use.
__all__ = [
    "collected",
    "containers",
    "exporting",
    "importing",
]
