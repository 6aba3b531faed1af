"""Judgement of an analysed mission: budget rows for single errors and for sums of errors, requirements, and waivers.

Many mission files can be checked together.
"""

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
