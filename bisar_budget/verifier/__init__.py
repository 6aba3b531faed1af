"""Forms images with errors exactly at their limits, and gives verdicts on the limits. Needs NumPy."""

# What other rooms may use.
__all__ = [
    "limits",
]
