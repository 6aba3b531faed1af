"""Findings of a check and of all other computations, as frozen data that reports show."""

# Modules that other rooms may use.
__all__ = [
    "case_table",
    "guard",
    "images",
    "mission",
    "monte_carlo",
    "offer",
    "requirement",
    "row",
    "satellite_passes",
    "slopes",
    "solution",
    "specification",
    "status",
    "trade",
]
