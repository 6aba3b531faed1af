"""What sensors and clocks do in many cases: the arrays beside `effects.random_errors` and `effects.clocks`."""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from bisar_budget import evaluators
from bisar_budget.arrays.varied import groups_alike
from bisar_budget.constants import STANDARD_GRAVITY
from bisar_budget.effects import random_errors as scalar
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.oscillators import noise_of
from bisar_budget.effects.spectra import link_parts, parts, synchronized_parts
from bisar_budget.effects.subject import Subject, subject
from bisar_budget.effects.tones import gauss_markov
from bisar_budget.geometry import BistaticGeometry, Vectors, dot
from bisar_budget.mission.instruments import GaussMarkov, Oscillator, Synchronization
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError
from bisar_budget.ranges.exact_ranges import ExactRanges, Floats


class ManyEffects(NamedTuple):
    """What a unit of an error does in each case; as `RandomEffect`."""

    quadratic: Any
    cubic: Any
    spread: Any


class ManyRandomErrors(NamedTuple):
    """One error of a sensor or a clock in many cases; as `RandomError`."""

    subject: Subject
    unit: str
    declared: Any  # None: not stated
    published: ManyEffects
    full: ManyEffects

    def effect(self, model: str) -> ManyEffects:
        """What a unit does by a model."""
        return self.full if model == "full" else self.published


def many_random_errors(mission: Mission, geometries: BistaticGeometry, cases: int) -> list[ManyRandomErrors]:
    """List the errors of sensors and clocks that a mission names, in the order of `random_errors`."""
    found: list[ManyRandomErrors] = []
    sights = geometries.sights(has_direct_path=mission.has_direct_path)
    if any(getattr(mission.platforms, name).motion_error.imu for name in PLATFORMS):
        T = mission.collection.aperture_time
        exact = ExactRanges.of(
            geometries.both, mission.radar.wavelength, T, scalar.NODES, cases, has_direct_path=mission.has_direct_path
        )
        for place in (0, 1):
            found += _of_imu(mission, place, geometries, sights[place], exact)
    for place in (0, 1):
        found += _of_position(mission, place, geometries, sights[place])
    if mission.synchronization or any(getattr(mission.platforms, name).oscillator for name in PLATFORMS):
        found += _clock_noise(mission, cases)
    return found


# ---------------------------------------------------------------------- inertial sensors
def _of_imu(
    mission: Mission, place: int, geometries: BistaticGeometry, sight: Vectors, exact: ExactRanges
) -> Iterator[ManyRandomErrors]:
    name, path = PLATFORMS[place], geometries.both[place]
    error: MotionError = getattr(mission.platforms, name).motion_error
    if error.imu is None:
        return
    axes, factor = path.frame(error.frame), mission.allocation.coverage_factor
    wavelength, T = mission.radar.wavelength, mission.collection.aperture_time
    for index, (kind, unit) in enumerate(scalar.IMU_UNITS.items()):
        values = getattr(error.imu, kind)
        largest = None if values is None else _largest(values)
        is_by_gravity = kind in scalar.BY_GRAVITY
        directions = [
            _scaled((axis[1], -axis[0], 0.0) if is_by_gravity else axis, part)
            for axis, part in zip(axes, _parts(values, largest), strict=True)
        ]
        along, heard = (_length([dot(one, way) for way in directions]) for one in (path.look, sight))
        row, other = (
            evaluators.inertial_phases(one, one, STANDARD_GRAVITY, wavelength, T)[index] for one in (along, heard)
        )
        quadratic, cubic = _over_aperture(exact, place, kind, directions)
        yield ManyRandomErrors(
            subject(name, "imu", kind),
            unit,
            None if largest is None else largest * factor,
            ManyEffects(row[0], row[1], row[2] / factor),
            ManyEffects(quadratic, cubic, other[2] / factor),
        )


def _largest(values: Sequence[Any]) -> Any:
    return np.maximum(np.maximum(values[0], values[1]), values[2])


def _parts(values: Sequence[Any] | None, largest: Any) -> Sequence[Any]:
    """Of each axis, over the largest; 1 where there is none."""
    if values is None:
        return (1.0, 1.0, 1.0)
    return [np.where(largest > 0, value / np.where(largest > 0, largest, 1.0), 1.0) for value in values]


def _scaled(vector: Vectors, factor: Any) -> Vectors:
    return (vector[0] * factor, vector[1] * factor, vector[2] * factor)


def _length(parts: Sequence[Any]) -> Any:
    return np.sqrt(sum(part * part for part in parts))


def _over_aperture(exact: ExactRanges, place: int, kind: str, directions: Sequence[Vectors]) -> tuple[Floats, Floats]:
    """Sigma of quadratic and of cubic phase of a unit over the exact paths [rad]; as `_over_aperture`.

    A covariance over the aperture is that over an aperture of 2 s, times a power of half the aperture time.
    """
    of_unit = np.array(scalar.covariance_at_nodes(kind, 1.0))
    power = scalar.GROWS[kind]
    sigmas = np.sqrt(np.diagonal(of_unit))[:, None] * exact.half ** (power / 2)
    scale = STANDARD_GRAVITY if kind in scalar.BY_GRAVITY else 1.0
    found = []
    for weights in exact.phase_weights:
        square, size = np.zeros(exact.half.shape), np.zeros(exact.half.shape)
        for direction in directions:
            along = weights * exact.along(place, direction)
            square += (along * (of_unit @ along)).sum(axis=0) * exact.half**power
            size += np.abs(along * sigmas).sum(axis=0) ** 2
        found.append(np.where(square > scalar.CANCELS * size, scale * np.sqrt(np.maximum(square, 0.0)), 0.0))
    return found[0], found[1]


# ---------------------------------------------------------------------- position noise
def _of_position(
    mission: Mission, place: int, geometries: BistaticGeometry, sight: Vectors
) -> Iterator[ManyRandomErrors]:
    name, path = PLATFORMS[place], geometries.both[place]
    error: MotionError = getattr(mission.platforms, name).motion_error
    if not error.random:
        return
    k, factor = 2 * math.pi / mission.radar.wavelength, mission.allocation.coverage_factor
    axes = path.frame(error.frame)
    process: GaussMarkov
    for process in error.random:
        largest = _largest(process.sigma)
        moved = [_scaled(axis, size) for axis, size in zip(axes, _parts(process.sigma, largest), strict=True)]
        found = gauss_markov(mission.collection.aperture_time, process.correlation_time)
        published, full = (
            _effects(found, k * _length([dot(by, one) for one in moved]), factor) for by in (path.look, sight)
        )
        yield ManyRandomErrors(subject(name, "random", process.name), "m", largest * factor, published, full)


def _effects(found: Sequence[Any], along: Any, factor: Any) -> ManyEffects:
    quadratic, cubic, left = (along * np.sqrt(part) for part in found)
    return ManyEffects(quadratic, cubic, left / factor)


# ---------------------------------------------------------------------- clocks
def _clock_noise(mission: Mission, cases: int) -> Iterator[ManyRandomErrors]:
    sync, factor = mission.synchronization, mission.allocation.coverage_factor
    T: Floats = np.broadcast_to(np.asarray(mission.collection.aperture_time, dtype=float), (cases,))
    for name in PLATFORMS:
        oscillator: Oscillator | None = getattr(mission.platforms, name).oscillator
        if oscillator is None:
            continue
        interval = None if sync is None else sync.interval
        found = np.zeros((3, cases))
        if sync is None or not sync.is_direct_path:
            for (alike, each), places in groups_alike((oscillator, interval), cases):
                found[:, places] = _parts_of(alike, each, T[places])
        quadratic, cubic, spread = np.sqrt(found) * mission.radar.center_frequency
        effect = ManyEffects(quadratic * factor, cubic * factor, spread)
        yield ManyRandomErrors(subject(name, "oscillator"), "dB", 1.0, effect, effect)
    if sync is not None:
        yield _of_link(sync, T, factor)


def _parts_of(oscillator: Oscillator, interval: float | None, aperture_time: Floats) -> Floats:
    """Parts of the phase of an oscillator at 1 Hz, or of what exchanged pulses leave of it: they grow as f₀²."""
    times, place = np.unique(aperture_time, return_inverse=True)
    spectra: dict[Any, list[int]] = {}
    for index, T in enumerate(times.tolist()):  # an Allan deviation may be fitted otherwise over another aperture
        spectra.setdefault(noise_of(oscillator, 1.0, T).pieces, []).append(index)
    found = np.zeros((3, times.size))
    for pieces, some in spectra.items():
        of_them = times[some]
        found[:, some] = parts(pieces, of_them) if interval is None else synchronized_parts(pieces, of_them, interval)
    return found[:, place]


def _of_link(sync: Synchronization, aperture_time: Floats, factor: Any) -> ManyRandomErrors:
    found = np.zeros((3, aperture_time.size))
    if sync.interval is None:  # from pulse to pulse: all of it spreads
        found[2] = 1.0
    else:
        for interval, places in groups_alike(sync.interval, aperture_time.size):
            times, place = np.unique(aperture_time[places], return_inverse=True)
            found[:, places] = np.array(link_parts(times, interval))[:, place]
    quadratic, cubic, spread = np.sqrt(found)
    effect = ManyEffects(quadratic, cubic, spread / factor)
    return ManyRandomErrors(subject("clock", "synchronization"), "rad", sync.error * factor, effect, effect)
