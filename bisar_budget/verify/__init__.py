"""Images with errors exactly at their limits, and verdicts on the limits. Needs NumPy."""

__all__ = ["evidence", "limits"]  # what other rooms may use
