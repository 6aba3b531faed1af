"""Errors to specify: their keys, the units of their specified sizes, and the parts that meet a specification."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from bisar_budget import units
from bisar_budget.arrays import Floats
from bisar_budget.constants import MAX_FLIGHT_SPEED_MPS
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.oscillators import noise_of
from bisar_budget.effects.spectra import PowerLawPiece, density
from bisar_budget.error_kinds.clock_kinds import OSCILLATOR_KIND, TIMING_KIND
from bisar_budget.error_kinds.path_kinds import STATE_KINDS
from bisar_budget.error_kinds.random_kinds import NAVIGATION_KIND
from bisar_budget.geometry import norm
from bisar_budget.mission.changes import ACCEPTED_ERRORS, is_error, parts_of
from bisar_budget.mission.covariance import MOTION_KINDS
from bisar_budget.mission.instruments import Oscillator
from bisar_budget.mission.load import folder_of
from bisar_budget.mission.model import Mission
from bisar_budget.mission.parts import Entry, OscillatorPart, PartError, entries, folders
from bisar_budget.mission.platforms import Platform
from bisar_budget.mission.quantities import Number, QuestionError, as_number, number_of
from bisar_budget.mission.readers import SIZE_FIELD
from bisar_budget.units import Dimension, format_quantity, parse_quantity

ORDERED_DIGITS = 2  # number of significant digits of an ordered number
_SILENT_DB = -400.0  # level without an error
# Units of ordered sizes, if the file states no number: the first in which the number is at least 1.
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
# First sizes of the search, in SI: small enough that effects are proportional to them.
_TINY_BY_DIMENSION: Mapping[Dimension, float] = {
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
_TINY_SIZE = 1e-18
_LEVELLED_FORMS = ("phase_noise", "power_law", "allan_deviation", "spurs")  # forms of noise that a level shifts
_OFFSETS_HZ = (1.0, 10.0, 100.0, 1e3)  # offsets in the remark about the phase noise of an ordered level
_OFFSETS_PER_DECADE = 20  # number of offsets at which spectra are compared
_LEAST_CYCLES = 0.1  # per aperture; slower phase noise has no effect
_DENSITY_ROUNDING_FACTOR = 1 + 1e-9


class Specified(NamedTuple):
    """An error for which a specification is wanted: its number in the mission file, and its weight.

    The weight determines how much of the limits the error may use, compared with the other errors.
    """

    number: Number
    weight: float

    @property
    def key(self) -> str:
        """Key of the number in the mission file, as a path such as `platforms.receiver.oscillator.level`."""
        return self.number.key

    @property
    def steps(self) -> tuple[str, ...]:
        """Keys on the path of the error; its size alone and the sigma beside a bias have the same."""
        steps = parts_of(self.key)
        return steps[:-1] if steps[-1] == SIZE_FIELD else steps

    @property
    def nothing(self) -> float:
        """Size that represents the absence of the error: 0, or the amplitude of a level of -400 dB."""
        return float(10 ** (_SILENT_DB / 20)) if self.number.is_level else 0.0

    @property
    def largest(self) -> float:
        """Largest size of the error that a mission file may state."""
        bound = min(self.number.reader.bounds[2:])
        return float(10 ** (bound / 20)) if self.number.is_level else bound * (1 - 1e-9)

    @property
    def tiny(self) -> float:
        """Size of the error in SI, chosen so small that all effects of the error are proportional to its size."""
        return _TINY_BY_DIMENSION.get(self.number.dimension, _TINY_SIZE)

    def numbers(self, sizes: Floats) -> Floats:
        """Convert sizes to numbers of the mission file; for a level, amplitudes are converted to decibels."""
        if not self.number.is_level:
            return sizes
        with np.errstate(divide="ignore"):
            levels: Floats = np.maximum(20 * np.log10(sizes), _SILENT_DB)
        return levels

    def text(self, size: float) -> str:
        """Write a size as text for a mission file, in the SI unit, or in dB if the size is a level."""
        return f"{float(self.numbers(np.array(size)))!r} {self.number.dimension.si}".rstrip()

    def unit_of(self, value: float) -> str:
        """Choose the unit of a specified number: the unit used in the file, or else a unit that suits its size."""
        dimension = self.number.dimension
        if self.number.value is not None or dimension not in _ORDERED_IN:
            return self.number.unit
        candidates = _ORDERED_IN[dimension]
        return next((unit for unit in candidates if abs(value) >= np.divide(*dimension.scales[unit])), candidates[-1])

    def said(self, value: float) -> str:
        """Write a number as text with four digits, in the unit in which it is specified."""
        unit = self.unit_of(value)
        factor, divisor = self.number.dimension.scales[unit]
        return f"{value / factor * divisor:.4g} {unit}".rstrip()

    def ordered(self, value: float) -> tuple[float, str]:
        """Round a number down to two digits in the unit in which it is specified.

        Returns the rounded number in SI, and its text as in a mission file.
        """
        unit = self.unit_of(value)
        factor, divisor = self.number.dimension.scales[unit]
        number = value / factor * divisor
        power = 10.0 ** (math.floor(math.log10(abs(number))) - ORDERED_DIGITS + 1) if number else 1.0
        number = float(f"{math.floor(number / power * (1 + 1e-12)) * power:.{ORDERED_DIGITS}g}")
        text = f"{number:.12g} {unit}".rstrip()
        return parse_quantity(text, self.number.dimension), text


def specified_errors(mission: Mission, tree: dict[str, object], keys: Mapping[str, float] | None) -> list[Specified]:
    """Find the errors to specify, with their weights.

    The errors are taken from `keys` if it is given, otherwise from `allocation.specify` of the mission. If neither is
    given, they are the errors that are specified by default; see `usual_keys`.

    Raises
    ------
    QuestionError
        A key names no error, or there is no error to specify.
    """
    weights = keys or mission.allocation.specify or dict.fromkeys(usual_keys(mission), 1.0)
    if not weights:
        raise QuestionError(
            "nothing to specify: every error of the mission comes from a part, a covariance or a path, or is a bias; "
            "name one with --for KEY"
        )
    errors = [Specified(_number(mission, tree, key), weight) for key, weight in weights.items()]
    if pair := multiplied(list(weights)):
        raise QuestionError(f"{pair[0]} multiplies {pair[1]}: only both together are limited; accepted: one of them")
    for error, inner in ((a, b) for a in errors for b in errors if a is not b):
        if parts_of(inner.key)[: len(parts_of(error.key))] == parts_of(error.key):
            raise QuestionError(f"{inner.key}: is specified twice, by {error.key} too; accepted: each error once")
    return errors


def usual_keys(mission: Mission) -> Iterator[str]:
    """Yield the keys that are specified by default: position, velocity, acceleration and clock errors.

    Errors that a part or a covariance determines are left out. So is a bias without a random part, because it is
    known and constant; beside a bias, the random part is specified. An aided navigation determines the errors of
    velocity and acceleration; its level is specified instead.
    """
    for name in PLATFORMS:
        platform = getattr(mission.platforms, name)
        error = platform.motion_error
        is_aided = error.navigation is not None
        for state in STATE_KINDS[:1] if platform.state.is_still or is_aided else STATE_KINDS:
            is_fixed = error.covariance is not None and state.has_covariance
            is_bias = error.bias_of(state.name) is not None and not np.any(error.stated(state.name))
            if not is_fixed and not is_bias and state.name not in dict(error.of_parts):
                yield ".".join(map(str, state.section(name)))
        if is_aided and not error.navigation.part_sources:
            yield ".".join(map(str, NAVIGATION_KIND.path(name)))
    oscillators = [name for name in PLATFORMS if getattr(mission.platforms, name).oscillator is not None]
    for name in oscillators:
        if getattr(mission.platforms, name).oscillator.sensor is None:
            yield _level_of_oscillator(name)
    clock = mission.timing_error
    is_bias = clock.bias.get("quadratic") is not None and not clock.quadratic
    if not oscillators and not mission.has_direct_path and not is_bias:
        yield ".".join(map(str, TIMING_KIND.path("clock", "quadratic")))


def _level_of_oscillator(name: str) -> str:
    """Key of the level of the noise of a platform's oscillator."""
    return ".".join(map(str, OSCILLATOR_KIND.path(name)))


def _number(mission: Mission, tree: dict[str, object], key: str) -> Number:
    """Find the number that a key names; raises `QuestionError` if the error at this key cannot be specified."""
    parts = parts_of(key)
    if not is_error(key):
        raise QuestionError(f"{key}: is no error that can be specified; {ACCEPTED_ERRORS}")
    number = specified_number(mission, tree, key)
    error = getattr(mission.platforms, parts[1]).motion_error if parts[0] == "platforms" else None
    if error is not None and error.covariance is not None and parts[3] in MOTION_KINDS:
        raise QuestionError(f"{key}: the file has a covariance of {parts[1]}, which is fixed; {ACCEPTED_ERRORS}")
    return number


def specified_number(mission: Mission, tree: dict[str, object], key: str) -> Number:
    """Find the number that a key names, with its value from the mission file or from a catalogue part named there.

    If the value has three components, one for each axis, the component of largest magnitude is taken.
    """
    number = number_of(tree, key, is_for_each=True)
    if number.value is not None:
        return number
    taken = next((figure.value for figure in mission.taken if figure.key == key), None)
    texts = taken if isinstance(taken, list) else [taken]
    components = [as_number(number.key, number.reader, text) for text in texts]
    return max(components, key=lambda component: abs(component.value or 0.0))


def multiplied(keys: Sequence[str]) -> tuple[str, str] | None:
    """Find two keys whose values have an effect only as a product, so that requirements limit only this product.

    The first key is a level [dB], and the second key is an error that the level scales. Returns None if there are no
    such keys.
    """
    for key in keys:
        *section, name = parts_of(key)
        if name not in ("level", "spectrum_level"):
            continue
        for second_key in keys:
            within = parts_of(second_key)[: len(section)] == tuple(section) and second_key != key
            if within and (name == "spectrum_level" or parts_of(second_key)[len(section)] in _LEVELLED_FORMS):
                return key, second_key
    return None


# ---------------------------------------------------------------- parts that meet a specification
def catalogue(mission: Mission) -> list[Entry]:
    """List the parts that a mission file may name: the parts of this package and of the mission's project.

    The list is empty if a file of the project is not a valid part.
    """
    try:
        return list(entries(folders(folder_of(mission.file))))
    except PartError:  # a folder of the project has a file that is no part; `sensors` says which
        return []


def suitable_parts(mission: Mission, specified: Specified, most: float, candidates: Sequence[Entry]) -> Iterator[str]:
    """Yield the ids of the catalogue parts that meet a specification whose largest permitted value is `most`.

    `mission` must state the error. A sensor meets the specification if its own value of the specified error is at
    most `most` on every axis. An oscillator meets it if its phase noise, converted to the same frequency, is nowhere
    above the specified spectrum; an oscillator whose noise is unknown at some offset frequencies does not meet it.
    For a satellite only sensors that work in orbit are listed: export rules disable receivers for ground and air use
    above 515 m/s or 18 km, and inertial sensors measure nothing in free fall.
    """
    *above, section, figure = specified.steps
    for name in PLATFORMS:
        if specified.key == _level_of_oscillator(name):
            yield from _quiet_oscillators(mission, name, most, candidates)
    kind = {"motion_error": "gnss", "gnss": "gnss", "imu": "imu"}.get(section)
    is_satellite = above[:1] == ["platforms"] and _is_satellite(getattr(mission.platforms, above[1]))
    for entry in candidates:
        serves = not is_satellite or getattr(entry.part, "in_orbit", None)
        value = getattr(entry.part, figure, None) if entry.part.kind == kind and serves else None
        if value is not None and np.abs(value).max() <= most:
            yield entry.id


def _is_satellite(platform: Platform) -> bool:
    """Whether a platform has an orbit, or is faster than any aircraft."""
    return platform.orbit is not None or bool(norm(platform.state.velocity) > MAX_FLIGHT_SPEED_MPS)


def _quiet_oscillators(mission: Mission, name: str, level: float, candidates: Sequence[Entry]) -> Iterator[str]:
    """Yield the ids of the oscillators that meet a specified level of phase noise [dB].

    `name` is the name of the platform. The phase noise of each listed oscillator is nowhere above the spectrum of the
    platform's own oscillator, shifted by `level`.
    """
    carrier, pieces = _spectrum(mission, name)
    aperture = mission.collection.aperture_time
    last = max(piece.high for piece in pieces)
    first = min([_LEAST_CYCLES / aperture, *(piece.low for piece in pieces if piece.low)])
    offsets = np.geomspace(first, last * (1 - 1e-9), 1 + math.ceil(_OFFSETS_PER_DECADE * math.log10(last / first)))
    most = density(pieces, offsets) * 10 ** (level / 10) * _DENSITY_ROUNDING_FACTOR
    for entry in candidates:
        part = entry.part
        if not isinstance(part, OscillatorPart):
            continue
        alone = Oscillator(part.frequency, part.phase_noise, part.allan_deviation, part.power_law)
        noise = density(noise_of(alone, carrier, aperture).pieces, offsets)
        if np.all((noise > 0) & (noise <= most)):
            yield entry.id


def ordered_noise(mission: Mission, specified: Specified, level: float) -> str:
    """Write the phase noise of an oscillator at a specified level [dB] as text.

    The result is empty if the specified error is not the level of an oscillator.
    """
    name = parts_of(specified.key)[1]
    if specified.key != _level_of_oscillator(name):
        return ""
    carrier, pieces = _spectrum(mission, name)
    levels = zip(_OFFSETS_HZ, density(pieces, np.array(_OFFSETS_HZ)).tolist(), strict=True)
    points = [
        f"{10 * math.log10(size / 2) + level:.1f} dBc/Hz at {offset:g} Hz" for offset, size in levels if size > 0
    ]
    return f"{', '.join(points)} from {format_quantity(carrier, 'Hz', 4)}" if points else ""


def _spectrum(mission: Mission, name: str) -> tuple[float, Sequence[PowerLawPiece]]:
    """Find the phase noise spectrum of a platform's oscillator, and the frequency to which it refers [Hz].

    This frequency is stated for the oscillator in the file; if it is not, the centre frequency of the radar is used.
    The spectrum applies at a level of 0 dB.
    """
    oscillator = getattr(mission.platforms, name).oscillator
    carrier = oscillator.frequency or mission.radar.center_frequency
    return carrier, noise_of(oscillator.noise_alone, carrier, mission.collection.aperture_time).pieces
