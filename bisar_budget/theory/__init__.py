"""Derivation of the limits from the geometry, by SymPy. Nothing outside this package imports SymPy."""

# What other rooms may use.
__all__ = ["emit", "render"]
