"""Words above findings: of which mission they are, what was checked and how, what from outside bears on it."""

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
from bisar_budget.report import Style
from bisar_budget.report.words.sentences import WIDTH, phase_limit, sentence, wrapped
from bisar_budget.units import format_quantity

_MODELS = {"published": "published model", "full": "full model", "strictest": "stricter of both models"}
_RULES = {"each": "each error alone", "sum": "worst-case sum", "rss": "root-sum-square"}
_MODELS_AT_LENGTH = {
    "published": "published (Rigling & Moses, Tables I and II)",
    "full": "full (exact ranges, displacement included)",
    "strictest": "strictest (the stricter of published and full for each row)",
}
_LEAST_LOSS_DB = 0.01  # less is not told apart
_NARROW_DEG = 30.0  # between range and Doppler gradients; below it the verdict says what that does


class AboutMission(Protocol):
    """Findings about a mission, by a check or another study."""

    @property
    def file(self) -> str:
        """Its file."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def changes(self) -> tuple[SetValue, ...]:
        """Values that options put in place of the file's."""

    @property
    def overrides(self) -> tuple[Override, ...]:
        """Settings from outside the file that bear on the mission."""


def rule_words(mission: MissionFindings) -> str:
    """Say by which model, and by which rule, a mission is judged."""
    return f"{_MODELS[mission.model]}, {_RULES[mission.combine]}"


def overrides_words(found: AboutMission, *, with_changes: bool = True) -> str:
    """Say what bears on the verdict besides the errors; empty if nothing does. `--set` may be said elsewhere."""
    return "; ".join(_overrides(found, with_changes=with_changes))


def _overrides(found: AboutMission, *, with_changes: bool) -> list[str]:
    return [
        f"{one.name} {printable(one.value)} ({one.origin})"
        for one in found.overrides
        if with_changes or one.name != "--set"
    ]


def overrides_lines(found: AboutMission) -> list[str]:
    """The same for a terminal, beside `--set`: in one line, else each in its own; no line if there is nothing."""
    said = _overrides(found, with_changes=False)
    line = f"Overrides: {'; '.join(said)}"
    if len(line) <= WIDTH or len(said) < 2:
        return wrapped(line, "  ") if said else []
    return ["Overrides:", *(part for one in said for part in wrapped(f"  {one}", "    "))]


def file_words(found: AboutMission) -> str:
    """File of a mission, with the options that changed what it says."""
    return f"{printable(found.file)} {changes_words(found.changes)}" if found.changes else printable(found.file)


def title_lines(
    found: AboutMission, said: str, sgr: str, style: Style, *, more: Sequence[str] = (), remark: str = ""
) -> Iterator[str]:
    """An answer in a sentence, coloured on a terminal, more about it, and of which mission it is."""
    first, *rest = wrapped(said, "  ")
    yield style.coloured(first, sgr)
    yield from rest
    for text in (*more, f"{file_words(found)}, {printable(found.name)}{remark}"):
        yield from wrapped(text, "  ")
    yield from overrides_lines(found)
    yield ""


def document_words(document: Document) -> str:
    """Number and issue of a document; empty where the file gives neither."""
    return ", ".join(filter(None, (document.number, document.issue and f"issue {document.issue}")))


def narrow_gradients(geometry: BistaticGeometry) -> str:
    """Say what range and Doppler gradients close to parallel do to displacements; nothing from 30 degrees on."""
    angle = geometry.gradient_angle
    if math.degrees(angle) >= _NARROW_DEG:
        return ""
    return (
        f"Range and Doppler gradients are only {_degrees(angle)} apart: displacements are {1 / math.sin(angle):.2g} "
        "times those at right angles."
    )


def doubtful_model(mission: MissionFindings) -> str:
    """Say where the published model judges and does not hold, as a sentence; nothing if it does hold."""
    said = mission.model_doubt
    return f"{sentence(said)}." if said else ""


def head(mission: MissionFindings) -> Iterator[tuple[str, str]]:
    """Say in a few lines what was checked: geometry, resolution, budget, model."""
    geometry, allocation = mission.geometry, mission.allocation
    is_first = True  # the first squint says what one is
    for name, state in (("Transmitter", geometry.transmitter), ("Receiver", geometry.receiver)):
        yield name, _platform(state, is_first)
        is_first = is_first and state.squint is None
    if mission.place:
        yield "Place", mission.place
    for name, path in mission.paths:
        yield "Path", f"{name}: {path_words(path)}"
    yield (
        "Geometry",
        f"bistatic angle {_degrees(geometry.bistatic_angle)}, look azimuth {_degrees(geometry.look_azimuth)}, "
        f"range and Doppler gradients {_degrees(geometry.gradient_angle)} apart, "
        f"wavelength {format_quantity(mission.wavelength, 'm', 4)}",
    )
    yield (
        "Resolution",
        f"{format_quantity(mission.resolution.range, 'm')} range, "
        f"{format_quantity(mission.resolution.cross_range, 'm')} cross range (peak to null, on ground); "
        f"{format_quantity(mission.resolution.range_half_power, 'm')} and "
        f"{format_quantity(mission.resolution.cross_range_half_power, 'm')} wide at half power",
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
            f"; autofocus pulls in (corrects) up to {multiple_of_pi(allocation.n_pull)} rad: limits times "
            f"{allocation.autofocus_gain:.3g}"
        )
    yield "Budget", f"quadratic phase error (QPE) {phase_limit(allocation.qpe_total, mission)}: {shares}{gain}"
    yield "Model", f"{_MODELS_AT_LENGTH[mission.model]}, {_RULES[mission.combine]}"
    if mission.scene is not None and not mission.scene.degeneracy:
        radius = format_quantity(mission.scene.radius, "m")
        yield (
            "Scene",
            f"radius {radius}; one autofocus correction of the declared errors serves {mission.scene.served}",
        )
    if mission.coverage_factor != 1:
        yield "Coverage", f"navigation and clock: declared is {mission.coverage_factor:g} times the file's value"


def _peak_loss(loss_db: float) -> str:
    if loss_db > ONE_PEAK_DB:
        return str(phrases.image_has_no_one_peak(loss_db))
    return (
        f"{f'{loss_db:.2g}' if loss_db >= _LEAST_LOSS_DB else f'below {_LEAST_LOSS_DB:g}'} dB by the declared errors"
    )


def path_words(path: FlownPath) -> str:
    """Say where a path comes from, and how far the polynomials that stand for it are from what the file has."""
    said = path.source if path.file is None else f"{path.file}: {path.source}"
    if path.age is not None:
        when = "old" if path.age >= 0 else "ahead"
        said += f", {format_quantity(abs(path.age) / 86400, '')} days {when}"
    if path.order is None or path.farthest is None or path.rms is None:
        return said
    is_one = path.pieces is None or path.pieces == 1
    said += f"; flown as {'a polynomial' if is_one else f'{path.pieces} polynomials'} of order {path.order}"
    if path.samples:
        rms, farthest = (format_quantity(one, "m") for one in (path.rms, path.farthest))
        within = "" if path.stretch is None else f" in {format_quantity(path.stretch, 's')}"
        return f"{said} through {path.samples} places{within}, {rms} rms and at most {farthest} from them"
    return f"{said}, at most {format_quantity(path.farthest, 'm')} from it"


def multiple_of_pi(factor: float) -> str:
    """Write 2 as 2π, 1 as π."""
    return "π" if factor == 1 else f"{factor:g}π"


def _platform(state: PlatformState, explains_squint: bool) -> str:
    squint = "still"
    if state.squint is not None:
        squint = f"squint {_degrees(state.squint)}" + (" off broadside" if explains_squint else "")
    return (
        f"{format_quantity(state.slant_range, 'm', 4)} away, azimuth {_degrees(state.azimuth)}, "
        f"elevation {_degrees(state.elevation)}, {squint}"
    )


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.1f}°".replace("-0.0°", "0.0°")
