"""Radar formats in and out: CPHD, CRSD and SICD become missions, simulated phase histories become CPHD."""

# What other rooms may use.
__all__ = ["document", "exporting", "importing", "mission_text"]
