"""Comparison of two versions of a mission."""
