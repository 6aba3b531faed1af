"""Words of every format about a row: how much of its limit it uses, what sets the limit, why it stands as it does."""

import math

from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import DECLARE, Row
from bisar_budget.report.words.sizes import row_limit, row_size

# What can set an allowable, in words; of a requirement the terminal has room for the first.
BINDING_WORDS = {
    "quadratic_phase_error": "quadratic phase error",
    "cubic_phase_error": "cubic phase error",
    "location_error": "location error",
    "islr": "ISLR",
    "end_of_image": "end of the image",
}


def matters(row: Row) -> bool:
    """Whether a row is declared or limits something; along other axes than the file's, only if it does not pass."""
    if row.status in ("info", "pass"):
        is_some = row.declared is not None if row.unit == "dB" else bool(row.declared)  # 0 dB is a noise as it is
        return row.is_independent and (row.status == "pass" or is_some)
    return row.status != "not_declared"


def binding_words(row: Row) -> str:
    """Say which other requirement than the one the row is about sets its allowable; nothing if it is that one."""
    return "" if row.binding_requirement == row.metric else BINDING_WORDS.get(row.binding_requirement or "", "")


def percent(ratio: float) -> str:
    """Write a ratio in percent; near 100 % with the digits that tell which side it is on."""
    value = 100 * ratio
    if value == 0:
        return "0 %"
    if value >= 99999.5:
        return ">1e5 %"
    if value < 0.01:
        return "<0.01 %"
    if value < 0.1:
        return f"{value:.2g} %"  # as wide as the column
    if value < 99:
        return f"{value:.3g} %"
    side = 0 if abs(value - 100) < 1e-7 else math.copysign(1, value - 100)
    for digits in range(max(3, len(f"{value:.0f}")), 13):
        text = f"{value:.{digits}g}"
        shown = float(text) - 100
        if (shown > 0) == (side > 0) and (shown < 0) == (side < 0):
            return f"{text} %"
    return f"{value} %"


def measure(row: Row, mission: MissionFindings) -> str:
    """Say what is declared, what is allowed and how much of it is used."""
    if row.metric == DECLARE:
        return "everything asked for is declared" if row.status == "pass" else "not everything asked for is declared"
    declared = "not declared" if row.declared is None else f"declared {row_size(row.declared, row, mission)}"
    if row.allowable is None:
        return declared
    text = f"{declared}, allowable {row_limit(row.allowable, row, mission)}"
    if binding := binding_words(row):
        text += f" (limited by the {binding})"
    return text if row.utilization is None else f"{text}, {percent(row.utilization)} of it used"


def cause(row: Row) -> str:
    """Say why the status is what it is, with the notes; may be empty."""
    return "; ".join([row.reason, *row.notes] if row.reason else row.notes)


def finding(row: Row, mission: MissionFindings) -> str:
    """Say both, and which requirement of the project it concerns."""
    why = cause(row)
    own_id = f" [{row.requirement_id}]" if row.requirement_id else ""
    return f"{row.id}{own_id}: {measure(row, mission)}{f'. {sentence(why)}' if why else ''}"


def sentence(text: str) -> str:
    """Begin with a capital letter; what begins with the name of a row or a file keeps its letters."""
    first = text.partition(" ")[0].rstrip(",:;")
    return text[:1].upper() + text[1:] if first.replace("-", "").isalpha() else text


def dashed(text: str) -> str:
    """Write the dash of what has no value as a page does."""
    return "–" if text == "-" else text
