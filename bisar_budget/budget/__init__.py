"""From an analysis to findings: each error and their sums held to what is allowed, waivers, many files."""

# What other rooms may use.
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
