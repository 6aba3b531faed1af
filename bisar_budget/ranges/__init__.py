"""Exact ranges of errors of any size, in many cases at once: the displaced point, and the range error left there."""

# What other rooms may use.
__all__ = ["exact_ranges", "limit_search", "point_paths", "resolution"]
