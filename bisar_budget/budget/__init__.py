"""From an analysis to findings: limits on each error and on sums of errors, waivers, checks of many files."""

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
