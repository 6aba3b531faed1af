"""Answers to design questions: values with which a mission complies, effects of its numbers, and specifications."""

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
