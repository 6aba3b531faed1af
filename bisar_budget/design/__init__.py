"""Design questions of one mission: which values of a key comply, and where that changes."""

# What other rooms may use.
__all__ = ["cases", "quantities", "solution", "solve", "sweep", "swept"]
