"""The report for a terminal: the geometry, the table with the worst row first, the reasons, one summary line."""

import math
import re
from collections.abc import Iterator, Sequence
from functools import cache

from bisar_budget.budget.findings import MissionFindings, Row, UnusableMission, worst, worst_first
from bisar_budget.errors import printable
from bisar_budget.geometry import PlatformState
from bisar_budget.report import Piece, Style
from bisar_budget.report.layout import WIDTH, wrapped, wrapped_counts
from bisar_budget.units import format_quantity

WORDS = {
    "error": "ERROR",
    "fail": "FAIL",
    "not_evaluated": "NOT EVAL",
    "warn": "WARN",
    "pass_with_autofocus": "pass AF",
    "pass": "pass",
    "waived": "waived",
    "info": "info",
    "not_declared": "not decl",
}
_ANSI = {
    "error": "1;31",
    "fail": "1;31",
    "not_evaluated": "35",
    "warn": "33",
    "pass_with_autofocus": "32",
    "pass": "32",
    "waived": "36",
    "info": "0",
    "not_declared": "2",
}
_MODELS = {
    "published": "published (Rigling & Moses, Tables I and II)",
    "full": "full (every first-order term, displacement included)",
    "strictest": "strictest (the stricter of published and full for each row)",
}
_EXPLAINED = ("fail", "not_evaluated", "warn", "waived", "pass_with_autofocus")


def piece(mission: MissionFindings | UnusableMission, style: Style) -> str:
    """Write the part of one mission, at most 80 columns where the file's own names allow it."""
    return "\n".join(_unusable(mission, style) if isinstance(mission, UnusableMission) else _mission(mission, style))


def joined(pieces: Sequence[Piece], version: str, style: Style) -> str:
    """Write the report for reading."""
    text = ("\n" if style.verbosity < 0 else "\n\n").join(piece.text for piece in pieces)
    if len(pieces) > 1:
        text += "\n\n" + _overall([piece.status for piece in pieces], style)
    return text + "\n"


def _unusable(mission: UnusableMission, style: Style) -> list[str]:
    count = len(mission.faults)
    summary = f"{WORDS['error']} {printable(mission.file)}: cannot be used, {count} fault{'s' if count != 1 else ''}"
    if style.verbosity < 0:
        return [_lead(summary, "error", style)]
    places = [f"  {fault.line or '-'}:{fault.column or '-'}  {fault}" for fault in mission.faults]
    first, *rest = wrapped_counts(summary)
    return [*(line for place in places for line in wrapped(place, "       ")), _lead(first, "error", style), *rest]


def _mission(mission: MissionFindings, style: Style) -> list[str]:
    if style.verbosity < 0:
        count = len(mission.warnings)
        warned = f"; {count} warning{'s' if count != 1 else ''} about the file" if count else ""
        return [_lead(_summary(mission) + warned, mission.status, style)]
    lines = [*wrapped(mission.name, "  "), ""]
    lines += [line for key, text in head(mission) for line in wrapped(f"{key:<12} {text}", " " * 13)]
    rows = worst_first(mission.rows)
    lines += ["", _cells("status", "row", "declared", "allowable", "use", "from")]
    lines += [line for row in rows for line in _row(row, style)]
    explained = [row for row in rows if row.status in _EXPLAINED or style.verbosity > 0]
    details = [line for row in explained for line in _details(row, mission, style)]
    lines += ["", *details] if details else []
    lines += [line for text in _asides(mission, style) for line in wrapped(text, "  ")]
    if mission.monte_carlo is not None:
        from bisar_budget.report.monte_carlo import probabilities

        lines += ["", *probabilities(mission.monte_carlo)]
    if mission.verdicts is not None:
        from bisar_budget.report.verification import evidence

        lines += ["", "Images with each error at its limit", "", *evidence(mission.verdicts, style)]
    first, *rest = wrapped_counts(_summary(mission))
    return [*lines, "", _lead(first, mission.status, style), *rest]


def head(mission: MissionFindings) -> Iterator[tuple[str, str]]:
    """Say in a few lines what was checked: geometry, resolution, budget, model."""
    geometry, allocation = mission.geometry, mission.allocation
    yield "Transmitter", _platform(geometry.transmitter)
    yield "Receiver", _platform(geometry.receiver)
    yield (
        "Geometry",
        f"bistatic angle {_degrees(geometry.bistatic_angle)}, look azimuth {_degrees(geometry.look_azimuth)}, "
        f"wavelength {format_quantity(mission.wavelength, 'm', 4)}",
    )
    yield (
        "Resolution",
        f"{format_quantity(mission.resolution.range, 'm')} range, "
        f"{format_quantity(mission.resolution.cross_range, 'm')} cross range (peak to null, on ground)",
    )
    split = allocation.qpe
    shares = f"transmitter {split.transmitter:.3g}, receiver {split.receiver:.3g}"
    shares += f", clock {split.clock:.3g}" if split.clock is not None else ""
    shares += f", reserve {split.reserve:.3g}" if split.reserve else ""
    gain = f"; autofocus allows {allocation.autofocus_gain:.3g} times that" if allocation.n_pull else ""
    yield "QPE budget", f"{format_quantity(allocation.qpe_total, 'rad')}: {shares}{gain}"
    rule = {"each": "each error alone", "sum": "worst-case sum", "rss": "root-sum-square"}[mission.combine]
    yield "Model", f"{_MODELS[mission.model]}, {rule}"
    if mission.scene is not None and not mission.scene.degeneracy:
        radius = format_quantity(mission.scene.radius, "m")
        yield (
            "Scene",
            f"radius {radius}; one autofocus correction of the declared errors serves {mission.scene.served}",
        )
    if mission.coverage_factor != 1:
        yield "Coverage", f"navigation and clock: declared is {mission.coverage_factor:g} times the file's value"


def _platform(state: PlatformState) -> str:
    squint = "still" if state.squint is None else f"squint {_degrees(state.squint)}"
    return (
        f"{format_quantity(state.slant_range, 'm', 4)} away, azimuth {_degrees(state.azimuth)}, "
        f"elevation {_degrees(state.elevation)}, {squint}"
    )


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.1f}°".replace("-0.0°", "0.0°")


def _row(row: Row, style: Style) -> list[str]:
    row_id, status, limit, unit, declared = row.id, row.status, row.allowable, row.unit, row.declared
    size = "-" if declared is None else format_quantity(declared, unit)
    use = "-"
    if limit is None:
        is_open = status == "not_evaluated" or status == "info" or row.metric == "pslr" or row.metric == "islr"
        allowable = "-" if is_open else "no limit"
    else:
        # Rounded down, so that an allowable copied from the page into a file passes.
        allowable = format_quantity(limit, unit, 3, "down")
        if row.utilization is not None and status != "not_evaluated":
            use = percent(row.utilization)
    reference = _short_reference(row.equation)
    lines = [_cells(WORDS[status], row_id, size, allowable, use, reference)]
    if len(row_id) > 34 or len(lines[0]) > WIDTH:
        numbers = _cells("", "", size, allowable, use, reference)
        lines = [f"{WORDS[status]:<8} {row_id}", numbers if len(numbers) <= WIDTH else numbers.lstrip().rjust(WIDTH)]
    if style.color:
        lines[0] = _word(status, style, 8) + lines[0][8:]
    if row.requirement_id and status not in _EXPLAINED and style.verbosity < 1:
        lines.append(f"{'':<8} [{row.requirement_id}]")  # the others have it with their reason
    return lines


@cache
def _short_reference(equation: str) -> str:
    """Shorten `Table II row 4` to `II.4`, `Section V, …` to `V`, the full model's to `full`; others to nothing."""
    if equation in ("full model", "first principles"):
        return "full"
    match = re.match(r"Table (I+)(?: rows? ([\d-]+))?|Section (V?I*)|(\(\d+\))", equation)
    if match is None:
        return ""
    table, row, section, number = match.groups()
    return f"{table}.{row}" if row and row.isdigit() else table or section or number


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


def _cells(status: str, row: str, declared: str, allowable: str, use: str, reference: str) -> str:
    # A blank of its own between cells: a wide one shifts the rest, it does not touch its neighbour.
    return f"{status:<8} {row:<34} {declared:>11} {allowable:>11} {use:>7} {reference}".rstrip()


def _details(row: Row, mission: MissionFindings, style: Style) -> list[str]:
    file = printable(mission.file)
    place = f"{file}:{row.line}" if row.line is not None else file
    own_id = f" [{row.requirement_id}]" if row.requirement_id else ""
    head = f"{WORDS[row.status]} {row.id}{own_id} ({place})"
    texts = [row.reason] if row.reason else []
    texts += row.notes
    if style.verbosity > 0:
        texts.append(f"from {row.equation}")
        if row.displacement_m is not None:
            x, y = row.displacement_m
            texts.append(f"moves the image by {format_quantity(x, 'm')} east, {format_quantity(y, 'm')} north")
        if row.evidence:
            texts.append(f"evidence: {row.evidence}")
    lines = [*wrapped(head, "  "), *(line for text in texts for line in wrapped(f"  {text}", "  "))]
    return [_lead(lines[0], row.status, style), *lines[1:]]


def _asides(mission: MissionFindings, style: Style) -> Iterator[str]:
    for warning in mission.warnings:
        place = f"{printable(mission.file)}:{warning.line}: " if warning.line is not None else ""
        yield f"warning: {place}{printable(warning.message)}"
    yield from (f"note: {note}" for note in mission.notes)
    if style.verbosity > 0:
        return  # each row has its notes
    qualified: dict[str, list[str]] = {}
    for row in mission.rows:
        if row.declared and row.status not in _EXPLAINED:
            for note in row.notes:
                qualified.setdefault(note, []).append(row.id)
    yield from (f"note: {', '.join(ids)}: {note}" for note, ids in qualified.items())


def _summary(mission: MissionFindings) -> str:
    counts = ", ".join(f"{count} {WORDS[status]}" for status, count in mission.summary.items())
    return f"{WORDS[mission.status]} {printable(mission.file)}: {counts}"


def _overall(statuses: Sequence[str], style: Style) -> str:
    counts = ", ".join(f"{statuses.count(status)} {WORDS[status]}" for status in WORDS if status in statuses)
    return f"{_word(worst(statuses), style)} {len(statuses)} missions: {counts}"


def _lead(line: str, status: str, style: Style) -> str:
    """Colour the status that a line begins with."""
    return _word(status, style) + line.removeprefix(WORDS[status])


def _word(status: str, style: Style, width: int = 0) -> str:
    word = f"{WORDS[status]:<{width}}"
    return f"\x1b[{_ANSI[status]}m{word}\x1b[0m" if style.color else word
