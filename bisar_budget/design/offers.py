"""A supplier's offer against a sheet of specifications: each figure, and the mission with the offer as a whole."""

from datetime import date
from typing import NamedTuple

from bisar_budget.budget.check import check_mission
from bisar_budget.design.specified import specified_number
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.specification import Specification, SpecificationSheet
from bisar_budget.findings.status import exit_code
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.model import AllocationRules, MetricSplits, Mission
from bisar_budget.mission.quantities import QuestionError, tree_of

_CURVES = ("frequency", "phase_noise", "power_law", "allan_deviation", "bandwidth", "spurs")


class OfferedFigure(NamedTuple):
    """The figure of an offer for a specification: None where its file is silent. `text` is that as the file has it.

    `is_inside` is None where the two cannot be compared, or nothing is ordered; `remark` then says why.
    """

    key: str
    value: float | None
    text: str
    ordered: str
    is_inside: bool | None
    remark: str = ""


class Offer(NamedTuple):
    """An offer: the file of a mission that has its figures, and how that mission stands as a whole.

    `notes` say what else of the mission differs from the one of the sheet.
    """

    file: str
    status: str
    figures: tuple[OfferedFigure, ...]
    requirements: tuple[JudgedRequirement, ...]
    notes: tuple[str, ...] = ()

    @property
    def complies(self) -> bool:
        """Whether the mission meets every requirement with the offer, whatever single figures are."""
        return exit_code({self.status}, strict=False) == 0


def offer(sheet: SpecificationSheet, mission: Mission, today: date) -> Offer:
    """Hold the mission of an offer to a sheet.

    A figure is inside where it is no larger than what is ordered, of three axes the largest one, those of parts that
    the offer names too. A level shifts a spectrum: of another spectrum it says nothing. Specifications and
    waivers in the offer's own file do not count.
    """
    asked = None if sheet.findings is None else sheet.findings.mission
    figures = tuple(_figure(one, sheet, mission, asked) for one in sheet.specifications)
    found = check_mission(mission._replace(specifications={}, waivers=()), today)
    notes = () if asked is None else tuple(_differences(asked, mission))
    return Offer(mission.file, found.status, figures, found.requirements, notes)


def _figure(one: Specification, sheet: SpecificationSheet, mission: Mission, asked: Mission | None) -> OfferedFigure:
    try:
        number = specified_number(mission, tree_of(mission), one.key)
        value, text = number.value, "" if number.value is None else number.text(number.value)
    except QuestionError:
        value, text = None, ""
    if sheet.broken:
        return OfferedFigure(one.key, value, text, one.text, None, "nothing is ordered")
    parts = parts_of(one.key)
    if asked is not None and parts[-1] in ("level", "spectrum_level"):
        if _spectrum(mission, parts) != _spectrum(asked, parts):
            return OfferedFigure(one.key, value, text, one.text, None, "another spectrum")
        value, text = (0.0, "0 dB") if value is None else (value, text)
    return OfferedFigure(one.key, value, text, one.text, one.holds(value))


def _spectrum(mission: Mission, parts: tuple[str, ...]) -> object:
    """The spectrum that a level shifts, without the level."""
    platform = getattr(mission.platforms, parts[1])
    if parts[-1] == "level":
        return [getattr(platform.oscillator, name, None) for name in _CURVES]
    return platform.motion_error.vibration.spectrum


def _rules(mission: Mission) -> AllocationRules:
    """The rules of the allocation, whatever is specified, with balanced shares as a sheet takes them: as equal."""
    split = mission.allocation.split
    if isinstance(split, MetricSplits) and split.quadratic_phase_error == "balanced":
        split = split._replace(quadratic_phase_error="equal")
    return mission.allocation._replace(split="equal" if split == "balanced" else split, specify={})


def _differences(asked: Mission, offered: Mission) -> list[str]:
    """Sections in which the mission of an offer is another one than that of the sheet."""
    sections = ("radar", "collection", "scene", "requirements")
    found = [name for name in sections if getattr(asked, name) != getattr(offered, name)]
    found += ["allocation"] if _rules(asked) != _rules(offered) else []
    for name in ("transmitter", "receiver"):
        one, other = getattr(asked.platforms, name), getattr(offered.platforms, name)
        found += [f"the place of the {name}"] if one.state != other.state else []
        found += [f"the frame of the {name}'s errors"] if one.motion_error.frame != other.motion_error.frame else []
    return found
