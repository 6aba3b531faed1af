"""The front door of `import bisar_budget as bb`: questions of a mission, and answers that show themselves."""

# What other rooms may use.
__all__ = ["checks", "imaging", "missions", "progress", "questions", "results", "sweeps"]
