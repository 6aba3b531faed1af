"""Sweeps and Monte Carlo draws on other machines: storage of finished parts, and a scheduler with workers."""

# What other rooms may use.
__all__ = ["parts_folder", "scheduler"]
