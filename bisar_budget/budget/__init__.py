"""From an analysis to findings: each error and their sums held to what is allowed, waivers, many files."""

# What other rooms may use.
__all__ = [
    "aggregates",
    "check",
    "collection_notes",
    "fleet",
    "input_doubt",
    "judged_mission",
    "judged_rows",
    "overrides",
    "pull_in",
    "random_rows",
    "required",
    "requirement_states",
    "requirement_table",
    "verdicts",
]
