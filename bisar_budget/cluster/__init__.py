"""Sweeps and Monte Carlo draws on other machines: a scheduler with workers, and a folder with finished parts."""

# What other rooms may use.
__all__ = ["parts_folder", "scheduler"]
