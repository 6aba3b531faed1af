"""Design questions of one mission: which values of a key comply, where that changes, what each number does."""

# What other rooms may use.
__all__ = [
    "cases",
    "compare",
    "compared",
    "imaged",
    "quantities",
    "sensitivity",
    "slopes",
    "solution",
    "solve",
    "sweep",
    "swept",
]
