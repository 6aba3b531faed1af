"""Derivation of the limits from the geometry, with SymPy. No other package imports SymPy."""

# Modules that other packages may import.
__all__ = ["emit", "render"]
