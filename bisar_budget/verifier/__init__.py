"""Verify limits with simulated images that contain errors exactly at their limits. Needs NumPy."""

# What other rooms may use.
__all__ = [
    "limits",
]
