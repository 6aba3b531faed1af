"""Modules of the report formats. `bisar_budget.report` finds the module of a format by its name."""
