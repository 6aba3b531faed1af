"""Image points and range errors by exact ranges: no expansion in the size of an error, and many cases at once."""

# What other rooms may use.
__all__ = ["exact_ranges", "limit_search", "point_paths", "resolution"]
