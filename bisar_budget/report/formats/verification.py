"""Write the verdicts from images at the limits as text and as JSON `bisar-budget/verify/1`."""

import math
from collections.abc import Iterator, Sequence

from bisar_budget.faults import printable
from bisar_budget.findings.images import Verdict, VerifiedMission
from bisar_budget.report import Style
from bisar_budget.report.formats.json_document import document_text, outside_item, verdict_item
from bisar_budget.report.words.heading import file_words, overrides_lines
from bisar_budget.report.words.sentences import table, wrapped, wrapped_counts
from bisar_budget.units import format_limit, format_quantity

_VERDICT_WORDS = {
    "optimistic": "optimistic",
    "confirmed": "confirmed",
    "conservative": "conservative",
    "not_evaluated": "not eval",
}
_OTHER_MODEL_HEADS = {"published": "full", "full": "II", "strictest": "other"}
_ANSI = {"optimistic": "1;31", "confirmed": "32", "conservative": "33", "not_evaluated": "35"}


def as_json(missions: Sequence[VerifiedMission], style: Style) -> str:
    """Write the verdicts as the JSON document `verify/1`, with an item for each mission."""
    items = [
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
    return document_text("bisar-budget/verify/1", {"missions": items})


def as_text(missions: Sequence[VerifiedMission], style: Style) -> str:
    """Write a table for each mission, with limit, budget, predicted and measured value, and verdict of each row."""
    blocks = [_mission(mission, style) for mission in missions]
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _mission(mission: VerifiedMission, style: Style) -> list[str]:
    verdicts = [row.verdict for row in mission.rows]
    counts = ", ".join(
        f"{verdicts.count(verdict)} {word}" for verdict, word in _VERDICT_WORDS.items() if verdict in verdicts
    )
    refuted = sum(row.verdict_autofocus == "optimistic" for row in mission.rows)
    counts += f"; {refuted} optimistic with autofocus" if refuted else ""  # these rows decide the exit code too
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
    """Make the table of verdicts, a second table of verdicts with autofocus, and remarks below them.

    For a phase, the column `budget` is by the gating model, and the next column has the value by the other model.
    """
    other_head = next((_OTHER_MODEL_HEADS[row.model] for row in rows), "full")
    heads = ("row", "limit", "budget", other_head, "exact", "image", "verdict")
    lines = table([heads, *map(_cells, rows)], style.table_width)
    refocused = [(printable(row.id), *refocused_cells(row)) for row in rows if row.verdict_autofocus]
    if refocused:
        lines += ["", "At the limit with autofocus, refocused:", ""]
        heads_refocused = ("row", "limit", "budget", "residual", "loss", "verdict")
        lines += table([heads_refocused, *refocused], style.table_width)
    lines = [_coloured(line, style) for line in lines]
    remarks = [line for text in (*geometry_remarks(rows), *reasons_of(rows)) for line in wrapped(f"  {text}", "    ")]
    return [*lines, "", *remarks] if remarks else lines


def reasons_of(rows: Sequence[Verdict]) -> list[str]:
    """List the reasons of the verdicts. Each reason is written once, after the ids of its rows."""
    ids: dict[str, list[str]] = {}
    for row in rows:
        for variant, reason in (("", row.reason), (", with autofocus", row.reason_autofocus)):
            if reason:
                ids.setdefault(reason, []).append(f"{row.id}{variant}")
    return [f"{', '.join(row_ids)}: {reason}" for reason, row_ids in ids.items()]


def geometry_remarks(rows: Sequence[Verdict]) -> Iterator[str]:
    """Yield remarks for below the table of verdicts.

    They give the kind of phase in the table, the largest distance between the measured displacement and the
    prediction by the gating model, and the largest angle between the measured smear and the prediction by (31).
    """
    hidden = [row for row in rows if row.of_equal_loss]
    if hidden:
        least = min(hidden, key=lambda row: (row.measured_qpe_rad or 0.0) / (row.measured_equal_loss_qpe_rad or 1.0))
        yield (
            "exact, image: quadratic phase of equal peak loss, which the budget limits; smallest quadratic part "
            f"{_phase(least.measured_qpe_rad)} of {_phase(least.measured_equal_loss_qpe_rad)} rad, {least.id}"
        )
    published_rows = [row for row in rows if row.model == "published"]
    full_rows = [row for row in rows if row.model != "published"]
    for rule, rule_rows, field in (
        ("(25)", published_rows, "displacement_published_m"),
        ("the full model", full_rows, "displacement_full_m"),
    ):
        distances = [
            (math.dist(row.measured_displacement_m, predicted_m), row.id)
            for row in rule_rows
            if row.measured_displacement_m and (predicted_m := getattr(row, field)) is not None
        ]
        if distances:
            distance, row_id = max(distances)
            within = format_quantity(distance, "m", 2)
            yield f"displacement of the images: within {within} of {rule}, farthest {row_id}"
    angles = [
        (abs((measured - predicted + math.pi / 2) % math.pi - math.pi / 2), row.id)
        for row in rows
        if (measured := row.measured_smear_azimuth_rad) is not None
        and (predicted := row.smear_azimuth_published_rad) is not None
    ]
    if angles:
        angle, row_id = max(angles)
        yield f"smear of the images: within {math.degrees(angle):.2g} deg of (31), farthest {row_id}"


def _cells(row: Verdict) -> tuple[str, ...]:
    budget, published, full, exact, image = numbers(row)
    other_model = {"published": full, "full": published, "strictest": _phase(_smaller(row))}[row.model]
    return printable(row.id), limit(row), budget, other_model, exact, image, _VERDICT_WORDS[row.verdict]


def _smaller(row: Verdict) -> float | None:
    phases = [phase for phase in (row.published_qpe_rad, _by_full(row)) if phase is not None]
    return min(phases, default=None)


def limit(row: Verdict) -> str:
    """Text with the size of the error, at its limit, for which the image was formed."""
    return format_limit(row.boundary_error, row.unit)


def numbers(row: Verdict) -> tuple[str, str, str, str, str]:
    """Five table cells with the numbers of a verdict. Phases are in rad.

    They are the budget, the predictions by Table II, the full model and exact ranges, and the measurement.
    """
    if row.requirement_db is not None:
        return f"{row.requirement_db:.4g} dB", "-", "-", "-", _decibel(row.measured_db)
    if row.budget_rad is None and row.measured_displacement_m is not None:  # the row has a limit of the displacement
        moves = (row.displacement_m, row.measured_displacement_m)
        exact, image = ("-" if move is None else format_quantity(math.hypot(*move), "m") for move in moves)
        return limit(row) if row.id == "mission.location_error" else "-", "-", "-", exact, image
    exact, image = map(_phase, row.judged_phases_rad)
    if row.measured_cubic_rad is not None:
        return _budget(row), "-", "-", exact, image
    return _budget(row), _phase(row.published_qpe_rad), _phase(_by_full(row)), exact, image


def _by_full(row: Verdict) -> float | None:
    """Quadratic phase by the full model, to compare with the budget; None if there is none. [rad]

    If the peak loss was measured in the image, it is the quadratic phase of equal peak loss.
    """
    if row.full_qpe_rad is None or row.measured_equal_loss_qpe_rad is None:
        return row.full_qpe_rad
    return row.equal_loss_qpe_rad


def _budget(row: Verdict) -> str:
    return "-" if row.budget_rad is None else format_limit(row.budget_rad, "rad").removesuffix(" rad")


def refocused_cells(row: Verdict) -> tuple[str, str, str, str, str]:
    """Five table cells about the image after autofocus: limit, budget, residual phase, peak loss, and verdict."""
    return (
        "-" if row.boundary_autofocus is None else format_limit(row.boundary_autofocus, row.unit),
        _budget(row),
        _phase(row.measured_residual_qpe_rad),
        _decibel(row.refocused_loss_db),
        _VERDICT_WORDS[row.verdict_autofocus or "not_evaluated"],
    )


def _phase(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}" if value < 10 else f"{value:.4g}"


def _decibel(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f} dB" if abs(value) >= 1 else f"{value:.2f} dB"


def _coloured(line: str, style: Style) -> str:
    """Colour the verdict at the end of a line."""
    for verdict, word in _VERDICT_WORDS.items():
        if line.endswith(f" {word}"):
            return line.removesuffix(word) + style.coloured(word, _ANSI[verdict])
    return line
