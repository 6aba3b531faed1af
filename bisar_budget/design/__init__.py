"""Design questions of one mission: which values of a key comply, where that changes, what each number does."""

# What other rooms may use.
__all__ = [
    "cases",
    "compare",
    "imaged",
    "quantities",
    "sensitivity",
    "solve",
    "sweep",
    "table",
]
