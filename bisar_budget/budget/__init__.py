"""From an analysis to findings: each error and their sums held to what is allowed, waivers, many files."""

# What other rooms may use.
__all__ = [
    "aggregates",
    "check",
    "collection_notes",
    "error_rows",
    "fleet",
    "input_doubt",
    "judged_rows",
    "orbit",
    "overrides",
    "pull_in",
    "random_rows",
    "required",
    "requirement_states",
    "requirement_table",
    "scene_row",
    "verdicts",
    "vibration_rows",
    "waivers",
]
