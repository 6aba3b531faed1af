"""One mission analysed: its errors and what they do, its budgets divided, the edge of its scene."""

# What other rooms may use.
__all__ = [
    "allocation",
    "analysis",
    "scene",
    "spread",
    "together",
    "tone_displacement",
    "vibration_limits",
]
