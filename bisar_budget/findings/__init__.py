"""Findings of a check, as frozen data: statuses, rows, missions and verdicts of images."""

# Modules that other rooms may use.
__all__ = ["images", "mission", "monte_carlo", "requirement", "row", "specification", "status", "trade"]
