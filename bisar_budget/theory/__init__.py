"""Derivation of the limits from the geometry, with SymPy. No other package imports SymPy."""

# What other rooms may use.
__all__ = ["emit", "render"]
