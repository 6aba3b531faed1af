"""What `requirements.declare` asks the file to declare: what is missing cannot be shown to comply."""

from collections.abc import Iterator, Sequence

from bisar_budget import phrases
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.subject import Subject
from bisar_budget.findings.row import Row
from bisar_budget.mission.model import Mission


def missing_declarations(mission: Mission) -> Iterator[tuple[str, str, str]]:
    """Say what is asked for and missing: owner and kind of its rows, and its key in the file.

    A covariance declares position and velocity. The clock is declared by any term of its error. An error that is
    common to both platforms says nothing of their own.
    """
    for kind in mission.requirements.declare:
        if kind == "timing":
            if all(term is None for term in mission.timing_error):
                yield "clock", kind, "timing_error"
            continue
        for name in PLATFORMS:
            if getattr(mission.platforms, name).motion_error.stated(kind) is None:
                yield name, kind, f"platforms.{name}.motion_error.{kind}"


def with_required(rows: Sequence[Row], mission: Mission) -> list[Row]:
    """Turn rows of errors that the file should declare and does not from `not_declared` into `not_evaluated`."""
    missing = list(missing_declarations(mission))
    if not missing:
        return list(rows)
    return [_required(row, missing) for row in rows]


def _required(row: Row, missing: Sequence[tuple[str, str, str]]) -> Row:
    if row.status == "not_declared":
        for one in missing:
            if is_asked_for(row.subject, one):
                return row._replace(status="not_evaluated", reason=phrases.not_declared_as_required(one[2]))
    return row


def is_asked_for(what: Subject, missing: tuple[str, str, str]) -> bool:
    """Whether a row is about what is asked for and missing."""
    owner, kind, _ = missing
    return what.owner == owner and (what.kind == kind or owner == "clock")
