"""Errors drawn from their distributions, and how often the requirements hold. Needs NumPy."""

__all__ = ["probability"]  # what other rooms may use
