"""Analysis of one mission: its errors and their effects, the division of its budgets, and the edge of its scene."""

# Names that other packages may import.
__all__ = [
    "allocation",
    "analysis",
    "peak_loss",
    "scene",
    "spread",
    "together",
    "tone_displacement",
    "totals",
    "variables",
    "vibration_limits",
]
