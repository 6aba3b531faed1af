"""Design questions about one mission: complying values, effects of numbers, and sizes of errors to order."""

# What other rooms may use.
__all__ = [
    "allocate",
    "cases",
    "compare",
    "imaged",
    "offers",
    "passes",
    "sensitivity",
    "solve",
    "sweep",
    "table",
]
