"""The mission file: its keys and their meaning (`model`), and the reading of a file (`load`)."""

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
