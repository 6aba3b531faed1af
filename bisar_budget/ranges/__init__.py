"""Image points and range errors of many cases at once, computed without a series expansion in the error."""

# Modules that other packages may import.
__all__ = ["exact_ranges", "limit_search", "point_paths", "resolution"]
