"""Mission files: their keys with types and meanings (`model`), and the reader of such files (`load`)."""

# What other rooms may use.
__all__ = [
    "changes",
    "covariance",
    "edited",
    "inputs",
    "instruments",
    "load",
    "model",
    "navigation",
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
    "work_tree",
]
