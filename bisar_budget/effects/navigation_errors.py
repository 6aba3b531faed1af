"""Errors of navigation at random: figures of inertial sensors, and noise of a position.

Biases of an inertial sensor are one error over the aperture, noise is another at every moment; both count from
mid-aperture on: position and velocity there are what aiding leaves, and the mission declares them.
"""

import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np

from bisar_budget import evaluators
from bisar_budget.effects.effect import PLATFORMS, subject
from bisar_budget.effects.random_effect import (
    NODES,
    RandomEffect,
    RandomError,
    SensorCases,
    of_cases,
    parts_of_largest,
    sigmas,
)
from bisar_budget.effects.spectra import Floats, gauss_markov
from bisar_budget.geometry import PlatformState, Vector
from bisar_budget.mission.instruments import IMU_KINDS, GaussMarkov
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError

_IMU_UNITS = dict(zip(IMU_KINDS, ("m/s^2", "1", "rad", "rad/s", "m/s/sqrt(s)", "rad/sqrt(s)"), strict=True))
NOISE = ("velocity_random_walk", "angle_random_walk")  # figures of an inertial sensor that spread
_TILTS = ("attitude", "gyro_bias", "angle_random_walk")
# The covariance of a position error over the aperture grows as this power of the aperture time.
_GROWS = {
    "accelerometer_bias": 4,
    "accelerometer_scale_factor": 4,
    "attitude": 4,
    "gyro_bias": 6,
    "velocity_random_walk": 3,
    "angle_random_walk": 5,
}


# ---------------------------------------------------------------------- inertial sensors
def process_of(mission: Mission, error: RandomError) -> GaussMarkov:
    """Process of an error that is correlated noise of a position."""
    motion: MotionError = getattr(mission.platforms, error.owner).motion_error
    return next(one for one in motion.random if one.name == error.subject.axis)


def specific_force(mission: Mission, state: PlatformState) -> Vector:
    """Specific force of a platform, f = a − g, which accelerometers measure, in the axes of the scene. [m/s²]

    Where it falls freely that is nothing. On the Earth g has what its rotation adds (`earth.free_fall`).
    """
    from bisar_budget.paths.earth import free_fall  # 8 ms, and most missions name no sensor

    x, y, z = state.acceleration
    u, v, w = free_fall(state.position, state.velocity, mission.scene.axes)
    return (x - u, y - v, z - w)


def acceleration_errors(kind: str, axes: Floats, force: Floats) -> Floats:
    """Acceleration error by a unit of a figure about, or along, each axis, (axes, 3, ...), of those axes.

    A tilt turns what accelerometers measure, the specific force (3, ...); a scale factor is a part of it. What is an
    acceleration is one. [m/s²/unit]
    """
    if kind in _TILTS:
        return np.asarray(np.cross(axes, force, axisa=1, axisb=0, axisc=1))
    if kind == "accelerometer_scale_factor":
        return np.asarray(axes * (axes * force).sum(axis=1, keepdims=True))
    return axes


def inertial_errors(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Figures of a platform's inertial sensor, declared or not; none where it has no sensor."""
    error = seen.error(name)
    if error.imu is None:
        return
    axes = seen.axes(name)
    force = seen.vector(specific_force(seen.mission, getattr(seen.geometry, name)))
    for index, (kind, unit) in enumerate(_IMU_UNITS.items()):
        values, key = getattr(error.imu, kind), error.key_of(kind)
        directions, declared = acceleration_errors(kind, axes, force), None
        if values is not None:
            declared, sizes = parts_of_largest(seen.vector(values))
            directions = directions * sizes[:, None]
        along, along_heard = seen.along(name, directions)
        row = heard = _at_mid_aperture(seen.mission, index, along)
        if along_heard is not along:
            heard = _at_mid_aperture(seen.mission, index, along_heard)
        (quadratic, cubic, east, north), covariance = _over_aperture(seen, PLATFORMS.index(name), kind, directions)
        yield RandomError(
            subject=subject(name, "imu", kind),
            unit=unit,
            declared=None if declared is None else declared * seen.factor,
            path=("platforms", name, "motion_error", *(("imu", kind) if key == kind else (key,))),
            published=RandomEffect(row[0], row[1], row[2] / seen.factor, *_moved_by_imu(seen, kind, along)),
            full=RandomEffect(quadratic, cubic, heard[2] / seen.factor, east, north, covariance),
            spreads=kind in NOISE,
        )


def _at_mid_aperture(mission: Mission, index: int, along: Any) -> tuple[Any, ...]:
    """Quadratic and cubic phase of a unit, and what is left, along so much of the line of sight. [rad]"""
    wavelength, T = mission.radar.wavelength, mission.collection.aperture_time
    return evaluators.inertial_phases(along, along, along, wavelength, T)[index]


def _moved_by_imu(seen: SensorCases, kind: str, along: Floats) -> list[Any]:
    """Sigmas of the displacement by a unit along so much of the line of sight of mid-aperture. [m]"""
    fit = seen.exact.fit[:2]
    constant, linear = np.diagonal(fit @ _covariance_at_nodes(kind) @ fit.T)
    scale = along**2 * seen.exact.half ** _GROWS[kind]
    return seen.moved(constant * scale, linear * scale)


def _over_aperture(seen: SensorCases, place: int, kind: str, directions: Floats) -> tuple[Floats, Floats]:
    """Sigmas by a unit over the exact paths: of quadratic and cubic phase [rad], of displacement east and north. [m]

    And their covariance, (4, 4, cases). That over the aperture is that over an aperture of 2 s, times a power of half
    the aperture time.
    """
    x, y, z = np.moveaxis(directions, 1, 0)[:, :, None]
    moved = seen.weights[:, None] * seen.exact.along(place, (x, y, z))  # (4, axes, nodes, cases)
    of_unit, scale = _covariance_at_nodes(kind), seen.exact.half ** _GROWS[kind]
    covariance = np.einsum("fanc,ganc->fgc", moved, of_unit @ moved)
    sizes = np.square((np.abs(moved) * np.sqrt(np.diagonal(of_unit))[:, None]).sum(axis=2)).sum(axis=1)
    return sigmas(covariance * scale, sizes * scale)


@cache
def _covariance_at_nodes(kind: str) -> Floats:
    """Covariance of the position error of a unit acceleration, or its noise, at the nodes of 2 s. [m²/unit²]

    The error is zero at mid-aperture.
    """
    times = evaluators.LEGENDRE_FITS[NODES][0]
    if not kind.endswith("random_walk"):
        order = 3 if kind == "gyro_bias" else 2
        history = np.array(times) ** order / math.factorial(order)
        return np.multiply.outer(history, history)
    walk = _velocity_walk if kind == "velocity_random_walk" else _angle_walk
    return np.array([[walk(*sorted((abs(s), abs(t)))) if s * t > 0 else 0.0 for t in times] for s in times])


def _velocity_walk(early: float, late: float) -> float:
    """White acceleration of density 1, twice integrated from zero: ∫(early − w)(late − w) dw."""
    return early**2 * (3 * late - early) / 6


def _angle_walk(early: float, late: float) -> float:
    """White rate of a tilt of density 1, three times integrated: ∫(early − w)²(late − w)²/4 dw."""
    lag = late - early
    return (early**5 / 5 + lag * early**4 / 2 + lag**2 * early**3 / 3) / 4


# ---------------------------------------------------------------------- position noise
def position_noise(seen: SensorCases, name: str) -> Iterator[RandomError]:
    """Correlated noise of a platform's position."""
    error = seen.error(name)
    if not error.random:
        return
    k, axes, key = 2 * math.pi / seen.mission.radar.wavelength, seen.axes(name), error.key_of("random")
    for index, process in enumerate(error.random):
        largest, sizes = parts_of_largest(seen.vector(process.sigma))
        directions = axes * sizes[:, None]
        found = gauss_markov(seen.aperture_time, process.correlation_time)
        along, along_heard = seen.along(name, directions)
        seen_along = seen.exact.along(PLATFORMS.index(name), tuple(np.moveaxis(directions, 1, 0)[:, :, None]))
        covariance = seen.of_orders(of_cases(found.covariance, seen.cases), seen_along)
        quadratic, cubic, left = (np.sqrt(one) for one in found[:3])
        (own, own_cubic, east, north), covariance = sigmas(covariance, np.einsum("ffc->fc", covariance))
        yield RandomError(
            subject=subject(name, "random", process.name),
            unit="m",
            declared=largest * seen.factor,
            path=("platforms", name, "motion_error", *((key, index, "sigma") if key == "random" else (key,))),
            published=RandomEffect(
                k * along * quadratic,
                k * along * cubic,
                k * along * left / seen.factor,
                *seen.moved(found.constant * along**2, found.linear * along**2),
            ),
            full=RandomEffect(own, own_cubic, k * along_heard * left / seen.factor, east, north, covariance),
        )
