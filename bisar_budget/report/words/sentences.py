"""What a row says, in a sentence: for formats that have room for one line of text."""

from bisar_budget.findings.row import Row
from bisar_budget.report.formats.text_table import binding_words, percent
from bisar_budget.units import format_quantity


def measure(row: Row) -> str:
    """Say what is declared, what is allowed and how much of it is used."""
    declared = "not declared" if row.declared is None else f"declared {format_quantity(row.declared, row.unit)}"
    if row.allowable is None:
        return declared
    text = f"{declared}, allowable {format_quantity(row.allowable, row.unit, 3, 'down')}"
    if binding := binding_words(row):
        text += f" (limited by the {binding})"
    return text if row.utilization is None else f"{text}, {percent(row.utilization)} of it used"


def cause(row: Row) -> str:
    """Say why the status is what it is, with the notes; may be empty."""
    return "; ".join([row.reason, *row.notes] if row.reason else row.notes)


def finding(row: Row) -> str:
    """Say both, and which requirement of the project it concerns."""
    why = cause(row)
    own_id = f" [{row.requirement_id}]" if row.requirement_id else ""
    return f"{row.id}{own_id}: {measure(row)}{f'. {why}' if why else ''}"
