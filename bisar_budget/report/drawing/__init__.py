"""Drawings of missions (SVG) and of images."""
