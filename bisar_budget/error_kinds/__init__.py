"""Kinds of error: one object for each kind of error that a mission can have, and for each kind of sum of errors."""

__all__ = ["clock_kinds", "kind", "path_kinds", "random_kinds", "registry"]
