"""Output of the `verify` command: verdicts from images that are formed with errors at the limits of a mission."""

import math
from collections.abc import Iterator, Sequence

from bisar_budget.findings.images import Verdict, VerifiedMission
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.answers import Records
from bisar_budget.report.answers.check_content import outside_item, verdict_item
from bisar_budget.report.answers.shared_blocks import mission_chapter, mission_document, opening
from bisar_budget.units import format_limit, format_quantity

_VERDICT_WORDS = {
    "optimistic": "optimistic",
    "confirmed": "confirmed",
    "conservative": "conservative",
    "not_evaluated": "not evaluated",
}
_OTHER_MODEL_HEADS = {"published": "full", "full": "II", "strictest": "other"}


# ---------------------------------------------------------------- for programs
def content(answers: Sequence[VerifiedMission]) -> dict[str, object]:
    """Content of the JSON document `verify/1`, with an item for each mission."""
    items = [
        {
            "file": mission.file,
            "name": mission.name,
            "status": mission.status,
            **outside_item(mission),
            "conditions": mission.conditions,
            "rows": [verdict_item(row) for row in mission.rows],
        }
        for mission in answers
    ]
    return {"missions": items}


def records(answers: Sequence[VerifiedMission]) -> Records:
    """Table of the answers: one record for each limit, with the keys of a row in the JSON document `verify/1`."""
    lines = [
        {"file": answer.file, "name": answer.name, **verdict_item(row)} for answer in answers for row in answer.rows
    ]
    return Records(("file", "name", *Verdict._fields), lines)


# ---------------------------------------------------------------- for people
def document(answers: Sequence[VerifiedMission], style: Style) -> doc.AnswerDocument:
    """Text of each answer: limit, budget, predicted and measured value of each row, and the verdict on it."""
    chapters = [mission_chapter(answer, number, _blocks(answer)) for number, answer in enumerate(answers, 1)]
    return mission_document("Images at the limits", answers, chapters)


def _blocks(mission: VerifiedMission) -> Iterator[doc.Block]:
    verdicts = [row.verdict for row in mission.rows]
    counts = ", ".join(
        f"{verdicts.count(verdict)} {word}" for verdict, word in _VERDICT_WORDS.items() if verdict in verdicts
    )
    refuted = sum(row.verdict_autofocus == "optimistic" for row in mission.rows)
    counts += f"; {refuted} optimistic with autofocus" if refuted else ""  # these rows decide the exit code too
    yield opening(mission, counts or "no row has a limit here", mission.status)
    if mission.conditions:
        yield doc.Paragraph(f"Images: {mission.conditions}.")
    yield from evidence(mission.rows)


def evidence(rows: Sequence[Verdict]) -> Iterator[doc.Block]:
    """Yield the table of verdicts, a second table of verdicts with autofocus, and remarks on both.

    For a phase, the column `budget` has the allowed phase, which the error at the limit causes according to the
    gating model (the model that decides the verdict on the row). The next column has the phase that the same error
    causes according to the other model.
    """
    other_head = next((_OTHER_MODEL_HEADS[row.model] for row in rows), "full")
    heads = doc.heads("row", *doc.numbers("limit", "budget", other_head, "exact", "image"), "verdict")
    yield doc.TextTable("Verdicts", "Verdicts of the images at the limits", heads, [_cells(row) for row in rows])
    refocused: list[doc.Line] = [
        [doc.Name(row.id), *refocused_cells(row), doc.Badge(row.verdict_autofocus)]
        for row in rows
        if row.verdict_autofocus
    ]
    if refocused:
        yield doc.Paragraph("At the limit with autofocus, refocused:")
        heads = doc.heads("row", *doc.numbers("limit", "budget", "residual", "loss"), "verdict")
        yield doc.TextTable("Verdicts with autofocus", "Verdicts at the limits with autofocus", heads, refocused)
    if remarks := [*geometry_remarks(rows), *reasons_of(rows)]:
        yield doc.Items([[remark] for remark in remarks])


def reasons_of(rows: Sequence[Verdict]) -> list[str]:
    """List the reasons of the verdicts. Each reason is listed once, after the ids of the rows to which it applies."""
    ids: dict[str, list[str]] = {}
    for row in rows:
        for variant, reason in (("", row.reason), (", with autofocus", row.reason_autofocus)):
            if reason:
                ids.setdefault(reason, []).append(f"{row.id}{variant}")
    return [f"{', '.join(row_ids)}: {reason}" for reason, row_ids in ids.items()]


def geometry_remarks(rows: Sequence[Verdict]) -> Iterator[str]:
    """Yield the remarks below the table of verdicts.

    They state the kind of phase in the table, the largest distance between the measured and the predicted
    displacement, and the largest angle between the measured and the predicted smear. The displacement is predicted by
    the model that decides the verdict, and the smear by equation (31) of Rigling & Moses.
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


def _cells(row: Verdict) -> doc.Line:
    budget, published, full, exact, image = numbers(row)
    other_model = {"published": full, "full": published, "strictest": _phase(_smaller(row))}[row.model]
    return [doc.Name(row.id), limit(row), budget, other_model, exact, image, doc.Badge(row.verdict)]


def _smaller(row: Verdict) -> float | None:
    phases = [phase for phase in (row.published_qpe_rad, _by_full(row)) if phase is not None]
    return min(phases, default=None)


def limit(row: Verdict) -> str:
    """Text with the size of the error in the image: the limit of the row."""
    return format_limit(row.boundary_error, row.unit)


def numbers(row: Verdict) -> tuple[str, str, str, str, str]:
    """Five table cells with the numbers of a verdict, with phases in rad.

    The cells are the budget, three predictions (from Table II of Rigling & Moses, from the full model, and from exact
    ranges), and the measured value.
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
    """Quadratic phase according to the full model, for comparison with the budget; None if not available. [rad]

    If the peak loss was measured in the image, the result is the quadratic phase that causes the same peak loss.
    """
    if row.full_qpe_rad is None or row.measured_equal_loss_qpe_rad is None:
        return row.full_qpe_rad
    return row.equal_loss_qpe_rad


def _budget(row: Verdict) -> str:
    return "-" if row.budget_rad is None else format_limit(row.budget_rad, "rad").removesuffix(" rad")


def refocused_cells(row: Verdict) -> tuple[str, str, str, str]:
    """Four table cells about the image after autofocus: limit, budget, residual phase and peak loss."""
    return (
        "-" if row.boundary_autofocus is None else format_limit(row.boundary_autofocus, row.unit),
        _budget(row),
        _phase(row.measured_residual_qpe_rad),
        _decibel(row.refocused_loss_db),
    )


def _phase(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}" if value < 10 else f"{value:.4g}"


def _decibel(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f} dB" if abs(value) >= 1 else f"{value:.2f} dB"
