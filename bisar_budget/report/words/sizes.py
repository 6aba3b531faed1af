"""Quantities in the units of the mission file: a declared one as the file has it, and what is allowed beside it."""

from bisar_budget.faults import Place
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import Row
from bisar_budget.units import format_in, given_unit

_PHASE_UNIT = "deg"  # of the phase requirement that a file does not state
_OF_PHASES = ("quadratic_phase_error", "cubic_phase_error", "spatial_variance")  # rows that add phases up


def row_size(value: float, row: Row, mission: MissionFindings, rounding: str = "nearest") -> str:
    """Write a number of a row: in the unit of its value in the file, of phases together in that of their requirement.

    Without a unit there, with a prefix that keeps it readable.
    """
    given = _given(row.line, row.unit)
    if not given and row.unit == "rad" and row.subject.kind in _OF_PHASES:
        given = phase_unit(mission)
    return format_in(value, row.unit, given, 3, rounding)


def row_limit(value: float, row: Row, mission: MissionFindings) -> str:
    """Write an allowable of a row, rounded down, so that copied from the page into a file it passes."""
    return row_size(value, row, mission, "down")


def phase_unit(mission: MissionFindings) -> str:
    """Unit of the quadratic phase requirement."""
    lines = (one.line for one in mission.requirements if one.key == "quadratic_phase_error")
    return _given(next(lines, None), "rad") or _PHASE_UNIT


def phase_limit(value: float, mission: MissionFindings) -> str:
    """Write a phase that is allowed, rounded down, in the unit of the quadratic phase requirement. [rad]"""
    return format_in(value, "rad", phase_unit(mission), 3, "down")


def requirement_size(value: float | None, one: JudgedRequirement, rounding: str = "nearest") -> str:
    """Write a number of a requirement in the unit that the file states it in; a dash where there is none."""
    if value is None:
        return "-"
    given = _given(one.line, one.unit) or (_PHASE_UNIT if one.unit == "rad" else "")
    return format_in(value, one.unit, given, 3, rounding)


def _given(line: int | None, unit: str) -> str:
    return given_unit(line.text, unit) if isinstance(line, Place) else ""
