"""The functions of `import bisar_budget as bb`, with one module for each question, and the results of the functions.

Each question is a single function, which the package exports and the command line calls. The other modules of this
package contain the searches that find the answers.
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
