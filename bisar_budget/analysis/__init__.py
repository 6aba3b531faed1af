"""One mission analysed: its errors and what they do, its budgets divided, the edge of its scene."""

# What other rooms may use.
__all__ = [
    "allocation",
    "analysis",
    "scene",
    "spread",
    "together",
    "vibration_limits",
]
