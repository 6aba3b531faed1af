"""Distribution of sweeps and Monte Carlo draws to other machines, and storage of the finished parts of a sweep.

A Dask scheduler passes the work to its workers. The finished parts of a sweep are stored in a folder.
"""

# What other rooms may use.
__all__ = ["parts_folder", "scheduler"]
