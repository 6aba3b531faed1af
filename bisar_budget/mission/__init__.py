"""Mission files: the keys with their types and meanings (`model`), and the functions that read a file (`load`)."""

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
