"""Sweeps and draws on other machines: parts of a sweep in a folder, and the scheduler whose workers do them."""

# What other rooms may use.
__all__ = ["parts_folder", "scheduler"]
