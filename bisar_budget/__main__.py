"""Entry point of `python -m bisar_budget`, which runs the `bisar-budget` command."""

from bisar_budget.cli import main

main()
