"""Turns an analysis into findings: limits on single errors and on sums of errors, waivers, checks of many files."""

# Modules that other rooms may use.
__all__ = [
    "aggregates",
    "check",
    "declarations",
    "doubts",
    "judged_mission",
    "judged_requirements",
    "judged_rows",
    "random_rows",
    "requirement_table",
    "verdicts",
    "waivers",
]
