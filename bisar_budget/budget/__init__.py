"""From an analysis to findings: each error and their sums held to what is allowed, waivers, many files."""

__all__ = [
    "aggregates",
    "check",
    "collection_notes",
    "error_rows",
    "fleet",
    "pull_in",
    "verdicts",
]  # what other rooms may use
