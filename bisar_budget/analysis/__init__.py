"""One mission analysed: its errors and what they do, its budgets divided, the edge of its scene."""

__all__ = ["allocation", "analysis", "scene", "together", "vibration_limits"]  # what other rooms may use
