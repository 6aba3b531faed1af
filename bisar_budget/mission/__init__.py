"""The mission file: what it may say (`model`), how it is read (`load`), its JSON Schema (`schema`)."""

# What other rooms may use.
__all__ = [
    "bounds",
    "changes",
    "covariance",
    "instruments",
    "keys",
    "later",
    "load",
    "model",
    "named",
    "parts",
    "platforms",
    "readers",
    "revision",
    "schema",
    "symmetric",
    "tree",
]
