"""Monte Carlo: errors are drawn from their distributions, to count how often requirements are met. Needs NumPy."""

# What other rooms may use.
__all__ = ["draws", "probability"]
