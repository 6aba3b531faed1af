"""Texts for the heading of a report: mission, geometry, budget, model, paths, settings from outside the file."""

import math
from collections.abc import Iterator, Sequence
from typing import Protocol

from bisar_budget import phrases
from bisar_budget.constants import ONE_PEAK_DB
from bisar_budget.faults import SetValue, changes_words, printable
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import Override
from bisar_budget.geometry import BistaticGeometry, PlatformState
from bisar_budget.mission.model import Document
from bisar_budget.mission.platforms import FlownPath
from bisar_budget.report.words.sentences import TEXT_WIDTH, phase_limit, sentence, wrapped
from bisar_budget.units import format_quantity

_MODEL_WORDS = {"published": "published model", "full": "full model", "strictest": "stricter of both models"}
_COMBINATION_WORDS = {"each": "each error alone", "sum": "worst-case sum", "rss": "root-sum-square"}
_MODELS_AT_LENGTH = {
    "published": "published (Rigling & Moses, Tables I and II)",
    "full": "full (exact ranges, displacement included)",
    "strictest": "strictest (the stricter of published and full for each row)",
}
_LEAST_LOSS_DB = 0.01  # a smaller loss is written as "below"
_NARROW_ANGLE_DEG = 30.0  # angle between range and Doppler gradients below which the verdict warns of displacements


class AboutMission(Protocol):
    """Facts about a mission for the heading of a report, which may be about a check or another study."""

    @property
    def file(self) -> str:
        """Path of the mission file."""

    @property
    def name(self) -> str:
        """Name of the mission."""

    @property
    def changes(self) -> tuple[SetValue, ...]:
        """Values from command-line options that replace values of the mission file."""

    @property
    def overrides(self) -> tuple[Override, ...]:
        """Settings from outside the mission file that affect its result."""


def rule_words(mission: MissionFindings) -> str:
    """Text that names the model and the combination rule that are used to evaluate a mission."""
    return f"{_MODEL_WORDS[mission.model]}, {_COMBINATION_WORDS[mission.combine]}"


def overrides_words(mission: AboutMission, *, with_changes: bool = True) -> str:
    """Text about the settings from outside the file that affect the verdict; empty if there are no such settings.

    If `with_changes` is false, values from `--set` are left out.
    """
    return "; ".join(_overrides(mission, with_changes=with_changes))


def _overrides(mission: AboutMission, *, with_changes: bool) -> list[str]:
    return [
        f"{override.name} {printable(override.value)} ({override.origin})"
        for override in mission.overrides
        if with_changes or override.name != "--set"
    ]


def other_overrides(mission: AboutMission) -> list[str]:
    """List of texts about the settings from outside the mission file, one for each setting.

    Values from the option `--set` are left out.
    """
    return _overrides(mission, with_changes=False)


def wrapped_overrides(overrides: Sequence[str]) -> list[str]:
    """Lines with overrides: all on one line, or each on its own line if they do not fit."""
    line = f"Overrides: {'; '.join(overrides)}"
    if len(line) <= TEXT_WIDTH or len(overrides) < 2:
        return wrapped(line, "  ") if overrides else []
    return ["Overrides:", *(line for override in overrides for line in wrapped(f"  {override}", "    "))]


def file_words(mission: AboutMission) -> str:
    """Text with the path of a mission file and with the options that changed its values, if any."""
    return (
        f"{printable(mission.file)} {changes_words(mission.changes)}" if mission.changes else printable(mission.file)
    )


def document_words(document: Document) -> str:
    """Text with the number and issue of a document; empty if the file gives neither."""
    return ", ".join(filter(None, (document.number, document.issue and f"issue {document.issue}")))


def narrow_gradients(geometry: BistaticGeometry) -> str:
    """Warning that a small angle between range and Doppler gradients enlarges displacements.

    It is empty for angles of 30 degrees or more.
    """
    angle = float(geometry.gradient_angle)
    if math.degrees(angle) >= _NARROW_ANGLE_DEG:
        return ""
    return (
        f"Range and Doppler gradients are only {_degrees(angle)} apart: displacements are {1 / math.sin(angle):.2g} "
        "times those at right angles."
    )


def doubtful_model(mission: MissionFindings) -> str:
    """Sentence about why the published model may be invalid for this mission; empty if the model is valid."""
    doubt = mission.model_doubt
    return f"{sentence(doubt)}." if doubt else ""


def head(mission: MissionFindings) -> Iterator[tuple[str, str]]:
    """Yield the name and text of each line about platforms, geometry, resolution, budget, model and scene."""
    geometry, allocation = mission.geometry, mission.allocation
    is_first = True  # the first squint comes with its explanation
    for name, state in (("Transmitter", geometry.transmitter), ("Receiver", geometry.receiver)):
        yield name, _platform(state, is_first)
        is_first = is_first and state.squint is None
    if mission.place:
        yield "Place", mission.place
    for name, path in mission.paths:
        yield "Path", f"{name}: {path_words(path)}"
    yield (
        "Geometry",
        f"bistatic angle {_degrees(float(geometry.bistatic_angle))}, "
        f"look azimuth {_degrees(float(geometry.look_azimuth))}, "
        f"range and Doppler gradients {_degrees(float(geometry.gradient_angle))} apart, "
        f"wavelength {format_quantity(mission.wavelength, 'm', 4)}",
    )
    yield (
        "Resolution",
        f"{format_quantity(float(mission.resolution.range), 'm')} range, "
        f"{format_quantity(float(mission.resolution.cross_range), 'm')} cross range (peak to null, on ground); "
        f"{format_quantity(float(mission.resolution.range_half_power), 'm')} and "
        f"{format_quantity(float(mission.resolution.cross_range_half_power), 'm')} wide at half power",
    )
    if mission.peak_loss_db is not None:
        before = "" if allocation.n_pull is None else ", before autofocus"
        yield "Peak loss", f"{_peak_loss(mission.peak_loss_db)}{before}"
    split = allocation.qpe
    shares = f"transmitter {split.transmitter:.3g}, receiver {split.receiver:.3g}"
    shares += f", clock {split.clock:.3g}" if split.clock is not None else ""
    shares += f", reserve {split.reserve:.3g}" if split.reserve else ""
    gain = ""
    if allocation.n_pull is not None:
        gain = (
            f"; autofocus corrects up to {multiple_of_pi(allocation.n_pull)} rad: limits × "
            f"{allocation.autofocus_gain:.3g}"
        )
    yield "Budget", f"quadratic phase error (QPE) {phase_limit(allocation.qpe_total, mission)}: {shares}{gain}"
    yield "Model", f"{_MODELS_AT_LENGTH[mission.model]}, {_COMBINATION_WORDS[mission.combine]}"
    if mission.scene is not None and not mission.scene.degeneracy:
        radius = format_quantity(mission.scene.radius, "m")
        yield (
            "Scene",
            f"radius {radius}; autofocus correction valid {mission.scene.served}",
        )
    if mission.coverage_factor != 1:
        yield "Coverage", f"navigation and clock: declared is {mission.coverage_factor:g} times the file's value"


def _peak_loss(loss_db: float) -> str:
    if loss_db > ONE_PEAK_DB:
        return str(phrases.note("image-may-have-several-peaks", loss_db=loss_db))
    return (
        f"{f'{loss_db:.2g}' if loss_db >= _LEAST_LOSS_DB else f'below {_LEAST_LOSS_DB:g}'} dB by the declared errors"
    )


def path_words(path: FlownPath) -> str:
    """Text about a platform path: its source, the fitted polynomials, and their deviation from the fixes or orbit."""
    text = path.source if path.file is None else f"{path.file}: {path.source}"
    if path.age is not None:
        direction = "old" if path.age >= 0 else "ahead"
        text += f", {format_quantity(abs(path.age) / 86400, '')} days {direction}"
    if path.order is None or path.farthest is None or path.rms is None:
        return text
    is_one = path.pieces is None or path.pieces == 1
    text += f"; {'polynomial' if is_one else f'{path.pieces} polynomials'} of order {path.order}"
    if path.samples:
        rms, farthest = (format_quantity(size, "m") for size in (path.rms, path.farthest))
        over = "" if path.stretch is None else f" over {format_quantity(path.stretch, 's')}"
        return f"{text} fitted to {path.samples} fixes{over}, residual {rms} rms and at most {farthest}"
    return f"{text}, at most {format_quantity(path.farthest, 'm')} from the orbit"


def multiple_of_pi(factor: float) -> str:
    """Write a multiple of π: 2 as `2π`, 1 as `π`."""
    return "π" if factor == 1 else f"{factor:g}π"


def _platform(state: PlatformState, explains_squint: bool) -> str:
    squint = "still"
    if state.squint is not None:
        squint = f"squint {_degrees(state.squint)}" + (" off broadside" if explains_squint else "")
    return (
        f"{format_quantity(float(state.slant_range), 'm', 4)} away, azimuth {_degrees(float(state.azimuth))}, "
        f"elevation {_degrees(float(state.elevation))}, {squint}"
    )


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.1f}°".replace("-0.0°", "0.0°")
