"""Drawings of missions as SVG, and drawings of images."""
