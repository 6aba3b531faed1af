"""Functions of the Python interface, `import bisar_budget as bb`, and the results that they return."""

# What other rooms may use.
__all__ = ["checks", "imaging", "missions", "progress", "questions", "results", "sweeps"]
