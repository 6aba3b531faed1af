"""Verdicts of the images on the limits: text for reading, JSON `bisar-budget/verify/1`."""

import math
from collections.abc import Iterator, Sequence

from bisar_budget.faults import printable
from bisar_budget.findings.images import Verdict, VerifiedMission
from bisar_budget.report import Style
from bisar_budget.report.formats.json_document import document_text, outside_item, verdict_item
from bisar_budget.report.words.heading import file_words, overrides_lines
from bisar_budget.report.words.sentences import table, wrapped, wrapped_counts
from bisar_budget.units import format_limit, format_quantity

WORDS = {
    "optimistic": "optimistic",
    "confirmed": "confirmed",
    "conservative": "conservative",
    "not_evaluated": "not eval",
}
_OTHER = {"published": "full", "full": "II", "strictest": "other"}
_ANSI = {"optimistic": "1;31", "confirmed": "32", "conservative": "33", "not_evaluated": "35"}


def as_json(missions: Sequence[VerifiedMission], style: Style) -> str:
    """Write the contract."""
    found = [
        {
            "file": mission.file,
            "name": mission.name,
            "status": mission.status,
            **outside_item(mission),
            "conditions": mission.conditions,
            "rows": [verdict_item(row) for row in mission.rows],
        }
        for mission in missions
    ]
    return document_text("bisar-budget/verify/1", {"missions": found})


def as_text(missions: Sequence[VerifiedMission], style: Style) -> str:
    """Write a table per mission: the limit, its budget, what exact ranges predict and the image shows."""
    blocks = [_mission(mission, style) for mission in missions]
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _mission(mission: VerifiedMission, style: Style) -> list[str]:
    found = [row.verdict for row in mission.rows]
    counts = ", ".join(f"{found.count(verdict)} {word}" for verdict, word in WORDS.items() if verdict in found)
    refuted = sum(row.verdict_autofocus == "optimistic" for row in mission.rows)
    counts += f"; {refuted} optimistic with autofocus" if refuted else ""  # they decide the exit code too
    summary = f"{file_words(mission)}: {counts or 'no row has a limit here'}"
    conditions = wrapped(f"Images: {mission.conditions}.", "  ") if mission.conditions else []
    return [
        *wrapped(printable(mission.name), "  "),
        *overrides_lines(mission),
        "",
        *conditions,
        "",
        *evidence(mission.rows, style),
        "",
        *wrapped_counts(summary),
    ]


def evidence(rows: Sequence[Verdict], style: Style) -> list[str]:
    """Table of the verdicts, with autofocus a second one, and what there is to say about them.

    Of a phase the model that gates says the budget; beside it stands what the other one says.
    """
    other = next((_OTHER[row.model] for row in rows), "full")
    lines = table([("row", "limit", "budget", other, "exact", "image", "verdict"), *map(_cells, rows)])
    refocused = [(printable(row.id), *refocused_cells(row)) for row in rows if row.verdict_autofocus]
    if refocused:
        lines += ["", "At the limit with autofocus, refocused:", ""]
        lines += table([("row", "limit", "budget", "residual", "loss", "verdict"), *refocused])
    lines = [_coloured(line, style) for line in lines]
    asides = [line for text in (*geometry_remarks(rows), *reasons_of(rows)) for line in wrapped(f"  {text}", "    ")]
    return [*lines, "", *asides] if asides else lines


def reasons_of(rows: Sequence[Verdict]) -> list[str]:
    """Reasons of verdicts, each once, behind the rows that it is of."""
    ids: dict[str, list[str]] = {}
    for row in rows:
        for which, reason in (("", row.reason), (", with autofocus", row.reason_autofocus)):
            if reason:
                ids.setdefault(reason, []).append(f"{row.id}{which}")
    return [f"{', '.join(of_reason)}: {reason}" for reason, of_reason in ids.items()]


def geometry_remarks(rows: Sequence[Verdict]) -> Iterator[str]:
    """Say what phases are shown, and how far displacement and smear are from the gating model's and from (31)."""
    hidden = [row for row in rows if row.of_equal_loss]
    if hidden:
        least = min(hidden, key=lambda row: (row.measured_qpe_rad or 0.0) / (row.measured_equal_loss_qpe_rad or 1.0))
        yield (
            "exact, image: the quadratic phase of equal loss, which the budget holds; least quadratic part "
            f"{_phase(least.measured_qpe_rad)} of {_phase(least.measured_equal_loss_qpe_rad)} rad, {least.id}"
        )
    by_25 = [row for row in rows if row.model == "published"]
    by_full = [row for row in rows if row.model != "published"]
    for rule, members, field in (
        ("(25)", by_25, "displacement_published_m"),
        ("the full model", by_full, "displacement_full_m"),
    ):
        apart = [
            (math.dist(row.measured_displacement_m, said), row.id)
            for row in members
            if row.measured_displacement_m and (said := getattr(row, field)) is not None
        ]
        if apart:
            distance, row_id = max(apart)
            within = format_quantity(distance, "m", 2)
            yield f"displacement of the images: within {within} of {rule}, farthest {row_id}"
    turned = [
        (abs((measured - line + math.pi / 2) % math.pi - math.pi / 2), row.id)
        for row in rows
        if (measured := row.measured_smear_azimuth_rad) is not None
        and (line := row.smear_azimuth_published_rad) is not None
    ]
    if turned:
        angle, row_id = max(turned)
        yield f"smear of the images: within {math.degrees(angle):.2g} deg of (31), farthest {row_id}"


def _cells(row: Verdict) -> tuple[str, ...]:
    budget, published, full, exact, image = numbers(row)
    other = {"published": full, "full": published, "strictest": _phase(_smaller(row))}[row.model]
    return printable(row.id), limit(row), budget, other, exact, image, WORDS[row.verdict]


def _smaller(row: Verdict) -> float | None:
    phases = [phase for phase in (row.published_qpe_rad, _by_full(row)) if phase is not None]
    return min(phases, default=None)


def limit(row: Verdict) -> str:
    """The error that the image was formed with."""
    return format_limit(row.boundary_error, row.unit)


def numbers(row: Verdict) -> tuple[str, str, str, str, str]:
    """Budget, what Table II, the full model and exact ranges predict, what the image shows; phases in rad."""
    if row.requirement_db is not None:
        return f"{row.requirement_db:.4g} dB", "-", "-", "-", _decibel(row.measured_db)
    if row.budget_rad is None and row.measured_displacement_m is not None:  # held to the location
        moves = (row.displacement_m, row.measured_displacement_m)
        exact, image = ("-" if move is None else format_quantity(math.hypot(*move), "m") for move in moves)
        return limit(row) if row.id == "mission.location_error" else "-", "-", "-", exact, image
    exact, image = map(_phase, row.judged_phases_rad)
    if row.measured_cubic_rad is not None:
        return _budget(row), "-", "-", exact, image
    return _budget(row), _phase(row.published_qpe_rad), _phase(_by_full(row)), exact, image


def _by_full(row: Verdict) -> float | None:
    """Quadratic phase of equal loss by the full model, which is what it holds to the budget. [rad]"""
    if row.full_qpe_rad is None or row.measured_equal_loss_qpe_rad is None:
        return row.full_qpe_rad
    return row.equal_loss_qpe_rad


def _budget(row: Verdict) -> str:
    return "-" if row.budget_rad is None else format_limit(row.budget_rad, "rad").removesuffix(" rad")


def refocused_cells(row: Verdict) -> tuple[str, str, str, str, str]:
    """Limit with autofocus, budget, residual phase, loss of the refocused peak, verdict."""
    return (
        "-" if row.boundary_autofocus is None else format_limit(row.boundary_autofocus, row.unit),
        _budget(row),
        _phase(row.measured_residual_qpe_rad),
        _decibel(row.refocused_loss_db),
        WORDS[row.verdict_autofocus or "not_evaluated"],
    )


def _phase(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}" if value < 10 else f"{value:.4g}"


def _decibel(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f} dB" if abs(value) >= 1 else f"{value:.2f} dB"


def _coloured(line: str, style: Style) -> str:
    """Colour the verdict that ends a line."""
    for verdict, word in WORDS.items():
        if line.endswith(f" {word}"):
            return line.removesuffix(word) + style.coloured(word, _ANSI[verdict])
    return line
