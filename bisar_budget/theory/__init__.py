"""Derivation of the limits from the geometry, by SymPy. Nothing outside this package imports SymPy."""
