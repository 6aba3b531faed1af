"""Derivation of the limits from the geometry, by SymPy. Nothing outside this package imports SymPy."""

__all__ = ["emit", "emit_catalogue", "render"]  # what other rooms may use
