"""Errors of sensors and clocks: what one unit of a figure does to quadratic phase, cubic phase and ISLR, 1 sigma.

Biases of an inertial sensor are one error over the aperture, noise is another at every moment; both have a sigma and
no sign. They contribute from the quadratic order on: the constant and linear part of a position is what aiding
leaves, and the mission declares it. To the published model the line of sight is that of mid-aperture
(`theory.random_errors`); the full model lets it turn, knows a direct path, and counts what the displacement of the
image adds.
"""

import math
from collections.abc import Iterator, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from bisar_budget import evaluators, phrases
from bisar_budget.constants import ROUNDING, STANDARD_GRAVITY
from bisar_budget.effects.effect import PLATFORMS, override_notes
from bisar_budget.effects.sources import exact_ranges
from bisar_budget.effects.subject import Subject, subject
from bisar_budget.effects.tones import Parts, gauss_markov
from bisar_budget.effects.vibration import sight_of
from bisar_budget.faults import KeyPath
from bisar_budget.geometry import BistaticGeometry, PlatformState, Vector, dot
from bisar_budget.mission.instruments import IMU_KINDS, GaussMarkov, Imu
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.ranges.exact_ranges import ExactRanges

IMU_UNITS = dict(zip(IMU_KINDS, ("m/s^2", "rad", "rad/s", "m/s/sqrt(s)", "rad/sqrt(s)"), strict=True))
BY_GRAVITY = ("attitude", "gyro_bias", "angle_random_walk")
NODES = 16  # a walk has a covariance with an edge, which fewer nodes miss by a percent
# The covariance of a position error over the aperture grows as this power of the aperture time.
GROWS = {"accelerometer_bias": 4, "attitude": 4, "gyro_bias": 6, "velocity_random_walk": 3, "angle_random_walk": 5}
CANCELS = ROUNDING * 1e-2  # of a square: below it, its root is rounding


class RandomEffect(NamedTuple):
    """What a unit of an error does: quadratic and cubic phase at the aperture edge, rms of what spreads. [rad/unit]

    `spread` is what is left of the phase after the cubic; it is a mean power, and no coverage factor is in it.
    `covariance` is that of quadratic and cubic phase. [rad²/unit²]
    """

    quadratic: float
    cubic: float
    spread: float
    covariance: float = 0.0


class RandomError(NamedTuple):
    """One error of a sensor or a clock: what it is, how large it is declared, what one unit of it does.

    `declared` is the largest of the axes, coverage factor included, and all axes grow with it; None where the file is
    silent. The unit of an oscillator is `dB`: its noise as a factor of amplitude, declared 1. `extrapolated` says how
    its noise goes on beyond what the file states.
    """

    subject: Subject
    unit: str
    declared: float | None
    path: KeyPath
    published: RandomEffect
    full: RandomEffect
    equation: str
    evidence: str | None
    no_limit: Note = phrases.nothing_spreads()
    notes: tuple[Note, ...] = ()
    extrapolated: Note = NOTHING
    warning: Note = NOTHING

    @property
    def id(self) -> str:
        """That of its row."""
        return self.subject.id

    @property
    def owner(self) -> str:
        """Whose share it counts against: transmitter, receiver or clock."""
        return self.subject.owner

    def effect(self, model: str) -> RandomEffect:
        """What a unit does by a model."""
        return self.full if model == "full" else self.published


def random_errors(mission: Mission, geometry: BistaticGeometry) -> list[RandomError]:
    """List the errors of sensors and clocks that a mission names, in a fixed order; nothing for most.

    Of a platform with an inertial sensor every figure is listed, declared or not.
    """
    found: list[RandomError] = []
    states = (geometry.transmitter, geometry.receiver)
    if any(getattr(mission.platforms, name).motion_error.imu for name in PLATFORMS):
        exact = exact_ranges(mission, geometry, NODES)
        for name, state in zip(PLATFORMS, states, strict=True):
            found += _of_imu(mission, name, state, exact)
    for name, state in zip(PLATFORMS, states, strict=True):
        found += _of_position(mission, name, state)
    if mission.synchronization or any(getattr(mission.platforms, name).oscillator for name in PLATFORMS):
        from bisar_budget.effects.clocks import clock_noise

        found += clock_noise(mission)
    return found


def _of_imu(mission: Mission, name: str, state: PlatformState, exact: ExactRanges) -> Iterator[RandomError]:
    error: MotionError = getattr(mission.platforms, name).motion_error
    imu: Imu | None = error.imu
    if imu is None:
        return
    axes, sight = state.frame(error.frame), sight_of(mission, name)
    factor = mission.allocation.coverage_factor
    for index, (kind, unit) in enumerate(IMU_UNITS.items()):
        values: Vector | None = getattr(imu, kind)
        largest = None if values is None else max(values)
        parts = tuple(value / largest for value in values) if values and largest else (1.0, 1.0, 1.0)
        directions = [
            _scaled(_leak(axis) if kind in BY_GRAVITY else axis, p) for axis, p in zip(axes, parts, strict=True)
        ]
        along = math.hypot(*(dot(state.look, direction) for direction in directions))
        row, heard = (
            evaluators.inertial_phases(
                part, part, STANDARD_GRAVITY, mission.radar.wavelength, mission.collection.aperture_time
            )[index]
            for part in (along, math.hypot(*(dot(sight, direction) for direction in directions)))
        )
        published = RandomEffect(row[0], row[1], row[2] / factor)
        quadratic, cubic, covariance = _over_aperture(exact, name, kind, directions)
        key = error.key_of(kind)
        yield RandomError(
            subject=subject(name, "imu", kind),
            unit=unit,
            declared=None if largest is None else largest * factor,
            path=("platforms", name, "motion_error", *(("imu", kind) if key == kind else (key,))),
            published=published,
            full=RandomEffect(quadratic, cubic, heard[2] / factor, covariance),
            equation="inertial sensor",
            evidence=(imu.source if key == kind else None) or error.evidence(kind),
            no_limit=phrases.across_the_line_of_sight(),
            notes=override_notes(name, error.overridden, kind),
        )


def _leak(axis: Vector) -> Vector:
    """Where gravity leaks by a tilt about an axis: axis × up."""
    return (axis[1], -axis[0], 0.0)


def _scaled(vector: Vector, factor: float) -> Vector:
    return (vector[0] * factor, vector[1] * factor, vector[2] * factor)


def _over_aperture(
    exact: ExactRanges, name: str, kind: str, directions: Sequence[Vector]
) -> tuple[float, float, float]:
    """Sigma of quadratic and of cubic phase of a unit over the exact paths [rad], and their covariance. [rad²]"""
    by_node = np.array(covariance_at_nodes(kind, float(exact.half[0])))
    sigmas = np.sqrt(np.diagonal(by_node))
    scale = STANDARD_GRAVITY if kind in BY_GRAVITY else 1.0
    squares, sizes = np.zeros((2, 2)), np.zeros(2)  # of both phases and their product
    for direction in directions:
        along = np.array([weights * exact.along(PLATFORMS.index(name), direction) for weights in exact.phase_weights])
        weights = along[..., 0]  # (2, nodes)
        squares += weights @ by_node @ weights.T
        sizes += np.abs(weights * sigmas).sum(axis=1) ** 2
    # What is left of terms that cancel exactly is rounding, and would make a limit out of nothing.
    quadratic, cubic = (
        scale * math.sqrt(square) if square > CANCELS * size else 0.0
        for square, size in zip(np.diagonal(squares).tolist(), sizes.tolist(), strict=True)
    )
    return quadratic, cubic, scale**2 * float(squares[0, 1]) if quadratic and cubic else 0.0


@cache
def covariance_at_nodes(kind: str, half: float) -> tuple[tuple[float, ...], ...]:
    """Covariance of the position error of a unit at the nodes, without gravity: zero at mid-aperture. [m²/unit²]"""
    times = [node * half for node in evaluators.LEGENDRE_FITS[NODES][0]]
    if kind in ("accelerometer_bias", "attitude", "gyro_bias"):
        order = 3 if kind == "gyro_bias" else 2
        history = [tau**order / math.factorial(order) for tau in times]
        return tuple(tuple(a * b for b in history) for a in history)
    walk = _velocity_walk if kind == "velocity_random_walk" else _angle_walk
    return tuple(tuple(walk(*sorted((abs(s), abs(t)))) if s * t > 0 else 0.0 for t in times) for s in times)


def _velocity_walk(early: float, late: float) -> float:
    """White acceleration of density 1, twice integrated from zero: ∫(early − w)(late − w) dw."""
    return early**2 * (3 * late - early) / 6


def _angle_walk(early: float, late: float) -> float:
    """White rate of a tilt of density 1, three times integrated: ∫(early − w)²(late − w)²/4 dw."""
    lag = late - early
    return (early**5 / 5 + lag * early**4 / 2 + lag**2 * early**3 / 3) / 4


def _of_position(mission: Mission, name: str, state: PlatformState) -> Iterator[RandomError]:
    error: MotionError = getattr(mission.platforms, name).motion_error
    if not error.random:
        return
    k, factor = 2 * math.pi / mission.radar.wavelength, mission.allocation.coverage_factor
    axes, sight = state.frame(error.frame), sight_of(mission, name)
    key = error.key_of("random")
    process: GaussMarkov
    for index, process in enumerate(error.random):
        largest = max(process.sigma)
        sizes = [sigma / largest if largest else 1.0 for sigma in process.sigma]
        parts = gauss_markov(mission.collection.aperture_time, process.correlation_time)
        moved = [_scaled(axis, size) for axis, size in zip(axes, sizes, strict=True)]
        published, full = (
            _correlated(parts, k * math.hypot(*(dot(by, one) for one in moved)), factor) for by in (state.look, sight)
        )
        own: KeyPath = (key, index, "sigma") if key == "random" else (key,)
        yield RandomError(
            subject=subject(name, "random", process.name),
            unit="m",
            declared=largest * factor,
            path=("platforms", name, "motion_error", *own),
            published=published,
            full=full,
            equation="Gauss-Markov",
            evidence=process.source or error.evidence("random"),
            no_limit=phrases.across_the_line_of_sight(),
            notes=override_notes(name, error.overridden, "random"),
        )


def _correlated(parts: Parts, along: float, factor: float) -> RandomEffect:
    """Sigmas of a metre of a process, by what it changes of the phase. [rad/m]"""
    quadratic, cubic, left = (along * math.sqrt(part) for part in parts)
    return RandomEffect(quadratic, cubic, left / factor)
