"""Comparison of a supplier's offer with a sheet of specifications: each offered figure, and the whole mission."""

from datetime import date

from bisar_budget.budget.check import check_mission
from bisar_budget.findings.offer import Offer, OfferedFigure
from bisar_budget.findings.specification import Specification, SpecificationSheet
from bisar_budget.mission.changes import parts_of
from bisar_budget.mission.model import AllocationRules, MetricSplits, Mission
from bisar_budget.mission.quantities import QuestionError, tree_of
from bisar_budget.questions.specified import specified_number

_OSCILLATOR_KEYS = ("frequency", "phase_noise", "power_law", "allan_deviation", "bandwidth", "spurs")


def compared_offer(sheet: SpecificationSheet, mission: Mission, today: date) -> Offer:
    """Compare the mission of an offer with a sheet of specifications.

    A figure meets its specification if it is no larger than the specified size. If a figure has values for three
    axes, the largest of them counts. Figures of parts that the offer names are compared in the same way. A level in
    decibels shifts a spectrum, so levels of different spectra cannot be compared. Specifications and waivers in the
    file of the offer are ignored.
    """
    sheet_mission = None if sheet.findings is None else sheet.findings.mission
    figures = tuple(_figure(each, sheet, mission, sheet_mission) for each in sheet.specifications)
    findings = check_mission(mission._replace(specifications={}, waivers=()), today)
    notes = () if sheet_mission is None else tuple(_differences(sheet_mission, mission))
    return Offer(mission.file, findings.status, figures, findings.requirements, notes)


def _figure(
    specification: Specification, sheet: SpecificationSheet, mission: Mission, sheet_mission: Mission | None
) -> OfferedFigure:
    """Compare the figure of an offer with one specification of the sheet."""
    try:
        number = specified_number(mission, tree_of(mission), specification.key)
        value, text = number.value, "" if number.value is None else number.text(number.value)
    except QuestionError:
        value, text = None, ""
    if sheet.broken:
        return OfferedFigure(specification.key, value, text, specification.text, None, "nothing is ordered")
    parts = parts_of(specification.key)
    if sheet_mission is not None and parts[-1] in ("level", "spectrum_level"):
        if _spectrum(mission, parts) != _spectrum(sheet_mission, parts):
            return OfferedFigure(specification.key, value, text, specification.text, None, "another spectrum")
        value, text = (0.0, "0 dB") if value is None else (value, text)
    return OfferedFigure(specification.key, value, text, specification.text, specification.holds(value))


def _spectrum(mission: Mission, parts: tuple[str, ...]) -> object:
    """Find the noise or vibration spectrum that a level in decibels shifts; the result is the unshifted spectrum.

    `parts` are the components of the key of the level. The result can be tested for equality with another spectrum.
    """
    platform = getattr(mission.platforms, parts[1])
    if parts[-1] == "level":
        return [getattr(platform.oscillator, name, None) for name in _OSCILLATOR_KEYS]
    return platform.motion_error.vibration.spectrum


def _rules(mission: Mission) -> AllocationRules:
    """Return the allocation rules of a mission in the form that a specification sheet uses.

    In this form `specify` is empty, and balanced shares are replaced by equal shares.
    """
    split = mission.allocation.split
    if isinstance(split, MetricSplits) and split.quadratic_phase_error == "balanced":
        split = split._replace(quadratic_phase_error="equal")
    return mission.allocation._replace(split="equal" if split == "balanced" else split, specify={})


def _differences(sheet_mission: Mission, offered: Mission) -> list[str]:
    """Names of the sections in which the mission of an offer differs from the mission of the sheet."""
    sections = ("radar", "collection", "scene", "requirements")
    names_of_sections = [name for name in sections if getattr(sheet_mission, name) != getattr(offered, name)]
    names_of_sections += ["allocation"] if _rules(sheet_mission) != _rules(offered) else []
    for name in ("transmitter", "receiver"):
        sheet_platform, offered_platform = getattr(sheet_mission.platforms, name), getattr(offered.platforms, name)
        names_of_sections += [f"the place of the {name}"] if sheet_platform.state != offered_platform.state else []
        names_of_sections += (
            [f"the frame of the {name}'s errors"]
            if sheet_platform.motion_error.frame != offered_platform.motion_error.frame
            else []
        )
    return names_of_sections
