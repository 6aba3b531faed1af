"""`bisar-budget derive`: the tables of Rigling & Moses, derived from the geometry, and files generated from them."""

import sys

import click

from bisar_budget.cli.options import format_option
from bisar_budget.cli.streams import BROKEN_EXIT_CODE, complain, deliver, write_file


@click.command()
@click.option(
    "--table",
    type=click.Choice(["all", "equations", "I", "II", "vibration", "full", "random"]),
    default="all",
    show_default=True,
    help="What to derive.",
)
@click.option(
    "--equation",
    "number",
    type=click.IntRange(1, 31),
    metavar="N",
    help="One equation of the paper, 1 to 31, in place of a table.",
)
@format_option(("text", "latex", "markdown", "mathml"), "How to write it.")
@click.option("--check", "check_only", is_flag=True, help="Fail if a generated file differs from the derivation.")
@click.option("--write", is_flag=True, help="Rewrite the generated files: evaluators and formulas.")
def derive(table: str, number: int | None, format_name: str, check_only: bool, write: bool) -> None:
    """Derive the paper's tables from the geometry and print them.

    Rigling & Moses, equations (1) to (31) with their errata, Tables I and II, vibration limits; and
    the full model. Equation and table numbers are those of the paper.
    """
    if check_only and write:
        raise click.UsageError("--check and --write cannot be combined.")
    if number is not None and (table != "all" or check_only or write):
        raise click.UsageError("--equation goes with --format alone.")
    if check_only or write:
        _generated(write)
        return
    from bisar_budget.theory import render

    text = render.derivation(table, format_name) if number is None else render.numbered(number, format_name)
    deliver(text, None, format_name)


def _generated(write: bool) -> None:
    import difflib

    from bisar_budget.theory import emit

    derived_with = f"(SymPy {emit.SYMPY_VERSION})"
    is_current = True
    for path, module in emit.GENERATED.items():
        name, today = path.name, module()
        if write:
            write_file(str(path), today)
            deliver(f"Wrote {name} {derived_with}.\n")
            continue
        committed = path.read_text(encoding="utf-8")
        if committed == today:
            deliver(f"{name} is what the derivation gives {derived_with}.\n")
            continue
        is_current = False
        pair = (committed.splitlines(), today.splitlines())
        deliver("\n".join(difflib.unified_diff(*pair, "committed", "derived", lineterm="", n=1)) + "\n")
        differs = f"{name} differs from the derivation {derived_with}"
        complain(f"{differs}; `bisar-budget derive --write` rewrites it.")
    if not is_current:
        sys.exit(BROKEN_EXIT_CODE)
