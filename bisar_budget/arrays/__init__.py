"""Many cases of one mission at once, on NumPy arrays: the numbers that `check_mission` finds one by one."""

# What other rooms may use.
__all__ = ["held", "judged", "varied"]
