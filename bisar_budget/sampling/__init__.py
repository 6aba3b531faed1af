"""Errors drawn from their distributions, and how often the requirements hold. Needs NumPy."""

# What other rooms may use.
__all__ = ["draws", "probability"]
