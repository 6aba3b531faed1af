"""The errors that are specified: which keys name one, in which units sizes are ordered, which parts keep to them."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from bisar_budget import units
from bisar_budget.constants import FASTEST_FLIGHT
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.oscillators import noise_of
from bisar_budget.effects.spectra import PowerLawPiece, density
from bisar_budget.geometry import norm
from bisar_budget.mission.changes import ACCEPTED_ERRORS, is_error, parts_of
from bisar_budget.mission.instruments import Oscillator
from bisar_budget.mission.load import folder_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.parts import Entry, OscillatorPart, PartError, entries, folders
from bisar_budget.mission.platforms import Platform
from bisar_budget.mission.quantities import Number, QuestionError, as_number, number_of
from bisar_budget.ranges.exact_ranges import Floats
from bisar_budget.units import Dimension, format_quantity, parse_quantity

DIGITS = 2  # of a number that is ordered
_SILENT_DB = -400.0  # a level of nothing
# Units in which the sizes are ordered, where the file has none: the first in which the number is at least 1.
_ORDERED_IN: Mapping[Dimension, tuple[str, ...]] = {
    units.LENGTH: ("m", "mm", "um"),
    units.SPEED: ("m/s", "mm/s", "um/s"),
    units.ACCELERATION: ("mg", "ug"),
    units.ANGLE: ("deg", "mrad", "urad"),
    units.ANGULAR_RATE: ("deg/s", "deg/h"),
    units.TIME: ("s", "ms", "us", "ns", "ps"),
    units.VELOCITY_RANDOM_WALK: ("m/s/sqrt(h)", "ug/sqrt(Hz)"),
    units.ANGLE_RANDOM_WALK: ("deg/sqrt(h)",),
}
# A size so small that effects are proportional to it, from which the search begins.
_TINY: Mapping[Dimension, float] = {
    units.LENGTH: 1e-4,
    units.SPEED: 1e-6,
    units.ACCELERATION: 1e-8,
    units.ANGULAR_RATE: 1e-10,
    units.ANGLE: 1e-7,
    units.TIME: 1e-14,
    units.ELECTRON_CONTENT: 1e12,
    units.POWER_RATIO: 1e-3,
    units.PHASE_NOISE: 1e-10,
    units.TONE: 1e-9,
}
_LEAST = 1e-18
_CURVES = ("phase_noise", "power_law", "allan_deviation", "spurs")  # that a level shifts
_OFFSETS = (1.0, 10.0, 100.0, 1e3)  # at which the phase noise of an ordered level is said [Hz]
_PER_DECADE = 20  # offsets at which spectra are compared
_SLOW = 0.1  # cycles per aperture, from which on phase noise is seen
_SAME = 1 + 1e-9


class Specified(NamedTuple):
    """An error that is specified: its number in the file, and its weight."""

    number: Number
    weight: float

    @property
    def key(self) -> str:
        """Path of the number in the mission file."""
        return self.number.key

    @property
    def nothing(self) -> float:
        """The size that stands for no error."""
        return float(10 ** (_SILENT_DB / 20)) if self.number.is_level else 0.0

    @property
    def largest(self) -> float:
        """The largest size that a mission file may state."""
        bound = min(self.number.reader.bounds[2:])
        return float(10 ** (bound / 20)) if self.number.is_level else bound * (1 - 1e-9)

    @property
    def tiny(self) -> float:
        """A size so small that effects are proportional to it."""
        return _TINY.get(self.number.dimension, _LEAST)

    def numbers(self, sizes: Floats) -> Floats:
        """Numbers of the file for sizes: themselves, or levels of amplitudes."""
        if not self.number.is_level:
            return sizes
        with np.errstate(divide="ignore"):
            found: Floats = np.maximum(20 * np.log10(sizes), _SILENT_DB)
        return found

    def text(self, size: float) -> str:
        """A size as the file would have it, in SI."""
        return f"{float(self.numbers(np.array(size)))!r} {self.number.dimension.si}".rstrip()

    def unit_of(self, value: float) -> str:
        """Unit in which a number is ordered: that of the file, else the one that suits it."""
        dimension = self.number.dimension
        if self.number.value is not None or dimension not in _ORDERED_IN:
            return self.number.unit
        among = _ORDERED_IN[dimension]
        return next((one for one in among if abs(value) >= np.divide(*dimension.scales[one])), among[-1])

    def said(self, value: float) -> str:
        """The number with four digits, in the unit that it is ordered in."""
        unit = self.unit_of(value)
        factor, divisor = self.number.dimension.scales[unit]
        return f"{value / factor * divisor:.4g} {unit}".rstrip()

    def ordered(self, value: float) -> tuple[float, str]:
        """The number rounded down to two digits in the unit that it is ordered in: in SI, and as the file has it."""
        unit = self.unit_of(value)
        factor, divisor = self.number.dimension.scales[unit]
        number = value / factor * divisor
        power = 10.0 ** (math.floor(math.log10(abs(number))) - DIGITS + 1) if number else 1.0
        number = float(f"{math.floor(number / power * (1 + 1e-12)) * power:.{DIGITS}g}")
        text = f"{number:.12g} {unit}".rstrip()
        return parse_quantity(text, self.number.dimension), text


def specified_errors(mission: Mission, tree: dict[str, object], keys: Mapping[str, float] | None) -> list[Specified]:
    """Errors to specify: those of the keys, else those that the mission names, else the usual ones.

    Raises
    ------
    QuestionError
        A key names no error; there is none to specify.
    """
    asked = keys or mission.allocation.specify or dict.fromkeys(usual_keys(mission), 1.0)
    if not asked:
        raise QuestionError(
            "nothing to specify: every error of the mission comes from a part, a covariance or a path; "
            "name one with --for KEY"
        )
    found = [Specified(_number(mission, tree, key), weight) for key, weight in asked.items()]
    if pair := multiplied(list(asked)):
        raise QuestionError(f"{pair[0]} multiplies {pair[1]}: only both together are limited; accepted: one of them")
    for one, other in ((a, b) for a in found for b in found if a is not b):
        if parts_of(other.key)[: len(parts_of(one.key))] == parts_of(one.key):
            raise QuestionError(f"{other.key}: is specified twice, by {one.key} too; accepted: each error once")
    return found


def usual_keys(mission: Mission) -> Iterator[str]:
    """Keys of position, velocity, acceleration and clocks that come from no part and no covariance."""
    for name in PLATFORMS:
        platform = getattr(mission.platforms, name)
        error = platform.motion_error
        kinds = ("position",) if platform.state.is_still else ("position", "velocity", "acceleration")
        for kind in kinds:
            is_fixed = error.covariance is not None and kind != "acceleration"
            if not is_fixed and kind not in dict(error.of_parts):
                yield f"platforms.{name}.motion_error.{kind}"
    oscillators = [name for name in PLATFORMS if getattr(mission.platforms, name).oscillator is not None]
    for name in oscillators:
        if getattr(mission.platforms, name).oscillator.sensor is None:
            yield f"platforms.{name}.oscillator.level"
    if not oscillators and not mission.has_direct_path:
        yield "timing_error.quadratic"


def _number(mission: Mission, tree: dict[str, object], key: str) -> Number:
    parts = parts_of(key)
    if not is_error(key):
        raise QuestionError(f"{key}: is no error that can be specified; {ACCEPTED_ERRORS}")
    number = specified_number(mission, tree, key)
    error = getattr(mission.platforms, parts[1]).motion_error if parts[0] == "platforms" else None
    if error is not None and error.covariance is not None and parts[3] in ("position", "velocity"):
        raise QuestionError(f"{key}: the file has a covariance of {parts[1]}, which is fixed; {ACCEPTED_ERRORS}")
    return number


def specified_number(mission: Mission, tree: dict[str, object], key: str) -> Number:
    """The number of a key with what the file has today: of three axes the largest, else the figure of a part."""
    number = number_of(tree, key, is_for_each=True)
    if number.value is not None:
        return number
    taken = next((one.value for one in mission.taken if one.key == key), None)
    of_each = [as_number(key, number.reader, one) for one in (taken if isinstance(taken, list) else [taken])]
    return max(of_each, key=lambda one: abs(one.value or 0.0))


def multiplied(keys: Sequence[str]) -> tuple[str, str] | None:
    """Two of the keys that multiply each other: only their product is limited, and either could be anything."""
    for key in keys:
        *section, name = parts_of(key)
        if name not in ("level", "spectrum_level"):
            continue
        for other in keys:
            within = parts_of(other)[: len(section)] == tuple(section) and other != key
            if within and (name == "spectrum_level" or parts_of(other)[len(section)] in _CURVES):
                return key, other
    return None


# ---------------------------------------------------------------- parts that keep to what is ordered
def catalogue(mission: Mission) -> list[Entry]:
    """Parts that the file of a mission may name: those that come with the tool, and those of its project."""
    try:
        return list(entries(folders(folder_of(mission.file))))
    except PartError:  # a folder of the project has a file that is no part; `sensors` says which
        return []


def suitable_parts(mission: Mission, one: Specified, most: float, among: Sequence[Entry]) -> Iterator[str]:
    """Ids of the parts that keep to a specification, whose ordered number is `most`; the mission states its error.

    A sensor does with a figure of the same name that is no larger in any axis. An oscillator does whose phase noise
    is nowhere above the spectrum that is ordered, at the same frequency; one that says nothing of some offsets not.
    A satellite is offered sensors that serve in orbit alone: receivers for the ground and the air stop at 515 m/s or
    18 km by export rules, and inertial sensors feel nothing in free fall.
    """
    *above, section, figure = parts_of(one.key)
    if section == "oscillator" and figure == "level":
        yield from _quiet_oscillators(mission, above[-1], most, among)
    kind = {"motion_error": "gnss", "imu": "imu"}.get(section)
    is_satellite = above[:1] == ["platforms"] and _is_satellite(getattr(mission.platforms, above[1]))
    for entry in among:
        serves = not is_satellite or getattr(entry.part, "in_orbit", None)
        value = getattr(entry.part, figure, None) if entry.part.kind == kind and serves else None
        if value is not None and np.abs(value).max() <= most:
            yield entry.id


def _is_satellite(platform: Platform) -> bool:
    return platform.orbit is not None or bool(norm(platform.state.velocity) > FASTEST_FLIGHT)


def _quiet_oscillators(mission: Mission, name: str, level: float, among: Sequence[Entry]) -> Iterator[str]:
    carrier, pieces = _spectrum(mission, name)
    aperture = mission.collection.aperture_time
    last = max(piece.high for piece in pieces)
    first = min([_SLOW / aperture, *(piece.low for piece in pieces if piece.low)])
    offsets = np.geomspace(first, last * (1 - 1e-9), 1 + math.ceil(_PER_DECADE * math.log10(last / first)))
    most = density(pieces, offsets) * 10 ** (level / 10) * _SAME
    for entry in among:
        part = entry.part
        if not isinstance(part, OscillatorPart):
            continue
        alone = Oscillator(part.frequency, part.phase_noise, part.allan_deviation, part.power_law)
        noise = density(noise_of(alone, carrier, aperture).pieces, offsets)
        if np.all((noise > 0) & (noise <= most)):
            yield entry.id


def ordered_noise(mission: Mission, one: Specified, level: float) -> str:
    """The phase noise that a level of an oscillator asks for, where the file states it by its points; else empty."""
    _, name, *below = parts_of(one.key)
    if below != ["oscillator", "level"]:
        return ""
    carrier, pieces = _spectrum(mission, name)
    found = zip(_OFFSETS, density(pieces, np.array(_OFFSETS)).tolist(), strict=True)
    points = [
        f"{10 * math.log10(size / 2) + level:.1f} dBc/Hz at {offset:g} Hz" for offset, size in found if size > 0
    ]
    return f"{', '.join(points)} from {format_quantity(carrier, 'Hz', 4)}" if points else ""


def _spectrum(mission: Mission, name: str) -> tuple[float, Sequence[PowerLawPiece]]:
    """Frequency of a platform's oscillator, else of the radar, and the spectrum of its phase there at 0 dB."""
    oscillator = getattr(mission.platforms, name).oscillator
    carrier = oscillator.frequency or mission.radar.center_frequency
    return carrier, noise_of(oscillator.noise_alone, carrier, mission.collection.aperture_time).pieces
