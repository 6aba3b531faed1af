"""Motion-measurement error budgets for bistatic SAR, after Rigling & Moses."""

__version__ = "0.1.0"
