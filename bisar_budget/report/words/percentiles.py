"""Texts about how sure a verdict is: the confidence of a requirement, and percentiles."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.report.words.sentences import confidence_asked, requirement_limit, requirement_size

PERCENTILE_KEYS = ("50", "68", "90", "95", "99.7")  # in percent, keys of the percentiles of a requirement


def with_confidence(limit: str, requirement: JudgedRequirement | None) -> str:
    """Write a limit that follows from a requirement, with the confidence of the requirement, if it has one."""
    confidence = "" if requirement is None else confidence_asked(requirement)
    return f"{limit} ({confidence})" if confidence else limit


def limit_asked(requirement: JudgedRequirement) -> str:
    """Limit of a requirement with its confidence, if it has one, such as `5 m (95 %)`."""
    return with_confidence(requirement_limit(requirement.value, requirement), requirement)


class PercentileLine(NamedTuple):
    """One line of the table of percentiles.

    `sizes` are the sizes that the quantity `name` does not exceed, one for each of `PERCENTILE_KEYS`.
    `is_limited` tells whether the requirement limits this quantity, and not only one component of it.
    """

    requirement: JudgedRequirement
    name: str
    sizes: tuple[str, ...]
    is_limited: bool = True


def percentile_lines(mission: MissionFindings) -> Iterator[PercentileLine]:
    """Yield the lines of the table of percentiles, in the order of the requirements.

    The lines of a location error are the length of the displacement, and its components along range and azimuth.
    """
    for requirement in mission.requirements:
        is_location = requirement.percentiles_range is not None
        name = f"{requirement.name} (circle)" if is_location else requirement.name
        columns = (
            (name, requirement.percentiles),
            ("  along range", requirement.percentiles_range),
            ("  along azimuth", requirement.percentiles_azimuth),
        )
        for index, (quantity, percentiles) in enumerate(columns):
            if percentiles is not None:
                yield PercentileLine(requirement, quantity, _sizes(percentiles, requirement), not index)


def _sizes(percentiles: Mapping[str, float], requirement: JudgedRequirement) -> tuple[str, ...]:
    return tuple(requirement_size(percentiles[name], requirement) for name in PERCENTILE_KEYS)


def has_percentiles(mission: MissionFindings) -> bool:
    """Whether any requirement of a mission has percentiles."""
    return any(requirement.percentiles is not None for requirement in mission.requirements)


def percentile_words(mission: MissionFindings) -> str:
    """Sentence that explains the percentiles of a mission."""
    text = "Sizes that the effect of all declared errors, drawn together, does not exceed"
    if any(requirement.percentiles_range is not None for requirement in mission.requirements):
        text += f"; for the circle they are CE{PERCENTILE_KEYS[0]} to CE{PERCENTILE_KEYS[-1]}"
    return f"{text}."


_PERCENTILE_PREFIXES = ("percentile", "percentile_range", "percentile_azimuth")
PERCENTILE_COLUMNS = (
    "confidence_required",
    "probability",
    *(f"{prefix}_{name}" for prefix in _PERCENTILE_PREFIXES for name in PERCENTILE_KEYS),
)


def percentile_columns(requirement: JudgedRequirement) -> dict[str, float | None]:
    """Values of the output columns about the distribution of the limited quantity, by column name, in SI units.

    They are the confidence asked for, the share of collections that keep the limit, and the percentiles.
    """
    of_quantities = (requirement.percentiles, requirement.percentiles_range, requirement.percentiles_azimuth)
    sizes = [
        None if percentiles is None else percentiles[name]
        for percentiles in of_quantities
        for name in PERCENTILE_KEYS
    ]
    return dict(zip(PERCENTILE_COLUMNS, (requirement.confidence, requirement.probability, *sizes), strict=True))
