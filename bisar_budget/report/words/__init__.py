"""Texts that all formats share, and functions that lay out and escape text."""
