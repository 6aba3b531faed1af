"""A sweep on other machines: its chunks as parts in a folder, and the scheduler whose workers check them."""

# What other rooms may use.
__all__ = ["parts_folder", "scheduler"]
