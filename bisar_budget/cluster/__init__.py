"""Sweeps and draws on other machines: a folder for parts of a sweep, and the scheduler whose workers compute them."""

# What other rooms may use.
__all__ = ["parts_folder", "scheduler"]
