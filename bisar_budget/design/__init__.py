"""Design questions of one mission: which values comply, what each number does, which sizes hold together."""

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
