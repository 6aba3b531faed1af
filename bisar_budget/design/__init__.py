"""Answers to design questions: which values comply, how numbers of a mission affect it, and what to specify."""

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
    "varied",
]
