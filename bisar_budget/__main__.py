"""`python -m bisar_budget` is the `bisar-budget` command."""

from bisar_budget.cli import main

main()
