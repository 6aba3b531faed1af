"""Exact ranges of errors of any size, in many cases at once: where they take a point, and what is left there."""

# What other rooms may use.
__all__ = ["exact_ranges", "limit_search", "point_paths", "resolution"]
