"""The mission file: what it may say (`model`), and how it is read (`load`)."""

# What other rooms may use.
__all__ = [
    "changes",
    "covariance",
    "edited",
    "instruments",
    "load",
    "model",
    "parts",
    "paths",
    "platforms",
    "propagation",
    "quantities",
    "readers",
    "revision",
    "stacked",
    "tree",
    "vibrations",
]
