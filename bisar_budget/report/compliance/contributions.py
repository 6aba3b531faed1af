"""Where the phase and the displacement of an image come from: each declared error, the largest first."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from bisar_budget.effects.effect import MOTION_UNITS, ErrorSource, Subject
from bisar_budget.effects.random_errors import RandomError
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.report.compliance import document as doc
from bisar_budget.report.compliance.matrix import Page
from bisar_budget.report.words.sentences import percent, phase_unit
from bisar_budget.units import format_in, format_quantity

_TOP = 8  # of a summary


@dataclass(frozen=True, slots=True)
class Contribution:
    """Effect of one declared error; `part` is its size as a part of the largest, `more` what the annex says too."""

    id: str
    subject: Subject
    size: str
    part: float
    more: tuple[str, ...] = ()

    @property
    def owner(self) -> str:
        """Whose error it is: a platform's, both platforms', the clock's, the mission's."""
        is_common = self.subject.kind in MOTION_UNITS and self.subject.owner == "mission"
        return "both platforms" if is_common else self.subject.owner

    @property
    def axis(self) -> str:
        """Axis or term of the error."""
        return "height" if self.subject.kind == "terrain" else self.subject[3].replace("_", " ")


def phases(page: Page) -> list[Contribution]:
    """Quadratic phase errors as the file states them, with their part of the sum, and by both models.

    An error that no image has comes before all others, and the others are no part of a sum with it.
    """
    by_model: dict[str, dict[str, float]] = {}
    for model in ("published", "full"):
        of_all = page.analysis.together(model).phases
        by_model[model] = {one.row_id: abs(float(one.qpe_rad[0])) for one in of_all}
    subjects = {row.id: row.subject for row in page.found.rows}
    gating = [name for name in by_model if page.found.model in (name, "strictest")]
    sizes = {row_id: max(by_model[name][row_id] for name in gating) for row_id in by_model["full"]}
    total, largest = math.fsum(sizes.values()), max(sizes.values(), default=0.0)
    result = []
    for row_id in sorted((row_id for row_id in sizes if sizes[row_id]), key=lambda row_id: -sizes[row_id]):
        qpe = sizes[row_id]
        part = 1.0 if qpe == largest else qpe / largest
        of_sum = percent(qpe / total) if math.isfinite(total) else "–"
        models = (_phase(of_all[row_id], page.found) for of_all in by_model.values())
        result.append(Contribution(row_id, subjects[row_id], _phase(qpe, page.found), part, (of_sum, *models)))
    return result


def _phase(value: float, found: MissionFindings) -> str:
    return format_in(value, "rad", phase_unit(found)) if math.isfinite(value) else "no image"


def moves(page: Page) -> list[Contribution]:
    """Displacements of the image by errors as the file states them."""
    rows = {row.id: row.displacement_m for row in page.found.rows}
    stated: list[ErrorSource | RandomError] = [*page.analysis.stated]
    stated += [one for one in page.analysis.random if one.declared is not None]
    known = [(source, rows.get(source.id)) for source in stated]
    moving = [(source, math.hypot(*by)) for source, by in known if by is not None and any(by)]
    moving.sort(key=lambda one: -one[1])
    largest = max((size for _, size in moving), default=1.0)
    return [Contribution(one.id, one.subject, format_quantity(size, "m"), size / largest) for one, size in moving]


def largest_contributions(page: Page) -> Iterator[doc.Block]:
    """Tables of the errors with the largest phases and with the largest displacements."""
    found = (phases(page), moves(page))
    tables = [
        _largest(page, found[0], "phase", "QPE", "Quadratic phase error of each declared error, before autofocus"),
        _largest(page, found[1], "displacement", "Displacement", "Displacement of the image by each declared error"),
    ]
    if any(found):
        yield doc.Group("pair", [table for table, errors in zip(tables, found, strict=True) if errors])
    if not found[0]:
        yield doc.Paragraph("No declared error of motion, clock or another kind has a quadratic phase.")
    if not found[1]:
        yield doc.Paragraph("No declared error displaces the image.")


def _largest(page: Page, found: Sequence[Contribution], about: str, head: str, caption: str) -> doc.TextTable:
    of_sum = doc.numbers("Of the sum") if any(one.more for one in found) else []
    size = doc.Head(head, "number")
    columns = doc.heads("Owner", "Kind", "Axis or term", size, "Relative to the largest", *of_sum)
    lines: list[doc.Line] = [
        (one.owner, one.subject.kind, one.axis, one.size, doc.Bar(one.part, one.owner), *one.more[:1])
        for one in found[:_TOP]
    ]
    caption += f": the {_TOP} largest of {len(found)}" if len(found) > _TOP else ""
    return doc.TextTable(f"Contributions to the {about} of {page.name}", caption, columns, lines, "contributions")


def all_contributions(page: Page) -> Iterator[doc.Block]:
    """Tables of all errors that have a phase, and of all that displace the image."""
    models = ("Gating model", "Of the sum", "Published", "Full")
    for found, about, heads, caption in (
        (
            phases(page), "contributions to the phase", models,
            "Quadratic phase error of every declared error by the model that gates, the published and the full one, "
            "before autofocus; what has none is left out",
        ),
        (
            moves(page), "displacements", ("Displacement",),
            "Displacement of the image by every declared error",
        ),
    ):  # fmt: skip
        if found:
            columns = doc.heads(doc.Head("Id", "id"), *doc.numbers(*heads))
            lines: list[doc.Line] = [(doc.Name(one.id), one.size, *one.more) for one in found]
            yield doc.TextTable(f"All {about} of {page.name}", caption, columns, lines, "contributions")
