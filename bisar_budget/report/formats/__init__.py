"""A module for each format; `bisar_budget.report` finds it by name."""
