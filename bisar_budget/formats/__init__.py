"""Radar formats in and out: CPHD, CRSD and SICD become missions, simulated phase histories become CPHD."""

# What other rooms may use.
__all__ = [
    "collected",
    "containers",
    "exporting",
    "importing",
]
