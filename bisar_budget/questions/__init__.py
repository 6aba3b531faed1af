"""The functions of `import bisar_budget as bb`, one module for each question, and the results that they return.

A question has one signature, which the package exports and the command line calls. The other modules of the room are
the searches behind the answers.
"""

# What other rooms may use.
__all__ = [
    "allocate",
    "checks",
    "drawn_errors",
    "missions",
    "outside",
    "passes",
    "progress",
    "results",
    "sensitivity",
    "simulate",
    "solve",
    "sweep",
    "verify",
]
