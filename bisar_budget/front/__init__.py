"""Functions of `import bisar_budget as bb`: questions about a mission, and answers that notebooks display."""

# What other rooms may use.
__all__ = ["checks", "imaging", "missions", "progress", "questions", "results", "sweeps"]
