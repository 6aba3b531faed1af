"""Run the `bisar-budget` command by `python -m bisar_budget`."""

from bisar_budget.cli import main

main()
