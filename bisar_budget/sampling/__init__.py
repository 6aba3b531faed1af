"""Monte Carlo: draw errors from their distributions and count how often requirements are met. Needs NumPy."""

# What other rooms may use.
__all__ = ["draws", "probability"]
