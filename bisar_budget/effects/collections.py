"""Paths and geometry of many collections at once: the arrays beside `geometry`.

Every number is an array (cases,), or a float that all cases share.
"""

from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import zip_longest
from typing import Any

import numpy as np

from bisar_budget.constants import ROUNDING
from bisar_budget.geometry import FRAME_AXES, STILL
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import Platform
from bisar_budget.ranges.exact_ranges import NODES, Vectors, dot, norm

_STRAIGHT: Vectors = (0.0, 0.0, 0.0)


def cross(a: Vectors, b: Vectors) -> Vectors:
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _over(a: Vectors, length: Any) -> Vectors:
    return (a[0] / length, a[1] / length, a[2] / length)


def _minus(a: Vectors, b: Vectors) -> Vectors:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _without_rounding(a: Vectors) -> Vectors:
    floor = ROUNDING * norm(a)
    x, y, z = (np.where(np.abs(component) > floor, component, 0.0) for component in a)
    return (x, y, z)


@dataclass(frozen=True)
class Paths:
    """Paths of one platform in many cases; as `PlatformState`."""

    position: Vectors
    velocity: Vectors
    acceleration: Vectors = _STRAIGHT
    bends: tuple[Vectors, ...] = ()

    @cached_property
    def slant_range(self) -> Any:
        """Distance to the scene centre. [m]"""
        return norm(self.position)

    @cached_property
    def look(self) -> Vectors:
        """Unit vector from the scene centre to the platform. [-]"""
        return _over(self.position, self.slant_range)

    @cached_property
    def look_rate(self) -> Vectors:
        """Rate of that: v⊥/R. [1/s]"""
        u, v, R = self.look, self.velocity, self.slant_range
        radial = dot(u, v)
        return ((v[0] - u[0] * radial) / R, (v[1] - u[1] * radial) / R, (v[2] - u[2] * radial) / R)

    def travelled(self, duration_s: Any) -> Any:
        """Bound of the way it makes from the midpoint in a time. [m]"""
        way = norm(self.velocity) * duration_s + norm(self.acceleration) * duration_s**2 / 2
        return way + sum(norm(bend) * duration_s**power for power, bend in enumerate(self.bends, 3))

    @property
    def is_still(self) -> Any:
        """Whether it stays where it is."""
        return self.travelled(1.0) < STILL

    def sinks(self, duration_s: Any) -> Any:
        """Bound of how much lower than at the midpoint it is within a time. [m]"""
        way = np.abs(self.velocity[2]) * duration_s + np.abs(self.acceleration[2]) * duration_s**2 / 2
        return way + sum(np.abs(bend[2]) * duration_s**power for power, bend in enumerate(self.bends, 3))

    def frame(self, name: str) -> tuple[Vectors, Vectors, Vectors]:
        """Axes of a frame; not a number where a platform does not have it. `ric` needs the Earth."""
        if name == "scene":
            return ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        along = self.velocity if name == "track" else self.position
        with np.errstate(all="ignore"):
            first = _over(along, norm(along))
            horizontal = cross((0.0, 0.0, 1.0), first)
            second = _over(horizontal, norm(horizontal))
        return (_without_rounding(first), _without_rounding(second), _without_rounding(cross(first, second)))

    def has_frame(self, name: str) -> Any:
        """Whether a platform has it, with room to spare for rounding."""
        if name not in FRAME_AXES or name in ("scene", "ric"):
            return True
        along = self.velocity if name == "track" else self.position
        length = norm(along)
        with np.errstate(all="ignore"):
            return (length > 1e-299) & (norm(cross((0.0, 0.0, 1.0), along)) > 2 * ROUNDING * length)


def paths_of(platform: Platform) -> Paths:
    """Paths of a platform some of whose numbers are arrays; of one that the Earth decides, its path as found."""
    if platform.path is not None:
        state = platform.path.state
        return Paths(state.position, state.velocity, state.acceleration, state.bends)
    acceleration = platform.acceleration or _STRAIGHT
    bends: tuple[Vectors, ...] = ()
    if platform.jerk is not None or platform.snap is not None:
        (a, b, c), (x, y, z) = platform.jerk or _STRAIGHT, platform.snap or _STRAIGHT
        bends = ((a / 6, b / 6, c / 6), (x / 24, y / 24, z / 24))
    if platform.position is not None and platform.velocity is not None:
        return Paths(platform.position, platform.velocity, acceleration, bends)
    slant_range, azimuth, elevation, speed, heading, climb = (
        0.0 if number is None else number
        for number in (
            platform.slant_range,
            platform.azimuth,
            platform.elevation,
            platform.speed,
            platform.motion_azimuth,
            platform.climb,
        )
    )
    position = (
        slant_range * np.cos(azimuth) * np.cos(elevation),
        slant_range * np.sin(azimuth) * np.cos(elevation),
        slant_range * np.sin(elevation),
    )
    velocity = (speed * np.cos(heading), speed * np.sin(heading), climb)
    return Paths(_without_rounding(position), _without_rounding(velocity), acceleration, bends)


def axes_of(mission: Mission, name: str, path: Paths) -> tuple[Vectors, Vectors, Vectors]:
    """Axes of the frame of a platform's errors."""
    platform: Platform = getattr(mission.platforms, name)
    frame = platform.motion_error.frame
    return platform.state.frame("ric") if frame == "ric" else path.frame(frame)


@dataclass(frozen=True)
class Geometries:
    """Both platforms in many cases; as `BistaticGeometry`."""

    transmitter: Paths
    receiver: Paths

    @property
    def both(self) -> tuple[Paths, Paths]:
        """Paths of transmitter and receiver."""
        return self.transmitter, self.receiver

    @cached_property
    def apart(self) -> Paths:
        """The transmitter as the receiver has it: its position is the baseline."""
        t, r = self.both
        bends = tuple(_minus(*pair) for pair in zip_longest(t.bends, r.bends, fillvalue=_STRAIGHT))
        return Paths(
            _minus(t.position, r.position),
            _minus(t.velocity, r.velocity),
            _minus(t.acceleration, r.acceleration),
            bends,
        )

    def sights(self, *, has_direct_path: bool) -> tuple[Vectors, Vectors]:
        """What a metre of each platform's motion takes from the range at mid-aperture; as `sights`. [-]"""
        t, r = self.transmitter.look, self.receiver.look
        if not has_direct_path:
            return t, r
        b = self.apart.look
        return _minus(t, b), _minus(r, (-b[0], -b[1], -b[2]))

    @cached_property
    def range_gradient(self) -> tuple[Any, Any]:
        """Sum of the look vectors on the ground. [-]"""
        t, r = self.transmitter.look, self.receiver.look
        return (t[0] + r[0], t[1] + r[1])

    @cached_property
    def doppler_gradient(self) -> tuple[Any, Any]:
        """Rate of that. [1/s]"""
        t, r = self.transmitter.look_rate, self.receiver.look_rate
        return (t[0] + r[0], t[1] + r[1])

    @cached_property
    def gradient_angle(self) -> Any:
        """Angle between the lines of range and Doppler gradient on the ground. [rad]"""
        return angle_between_lines(self.range_gradient, self.doppler_gradient)

    @property
    def bistatic_angle(self) -> Any:
        """Angle between the look vectors. [rad]"""
        t, r = self.transmitter.look, self.receiver.look
        return np.arctan2(norm(cross(t, r)), dot(t, r))

    def range_resolution(self, bandwidth: Any, speed_of_light: float) -> Any:
        """Peak to first null along the bistatic look direction on the ground. [m]"""
        return speed_of_light / (bandwidth * np.hypot(*self.range_gradient))

    def cross_range_resolution(self, wavelength: Any, aperture_time: Any) -> Any:
        """Peak to first null across it, along a line of constant range. [m]"""
        return wavelength / (aperture_time * np.hypot(*self.doppler_gradient) * np.sin(self.gradient_angle))

    def nodes(self, aperture_time: Any, *, has_direct_path: bool = False) -> Any:
        """Number of nodes that each case needs, as `nodes_for` has it."""
        half = aperture_time / 2
        turning = (*self.both, *((self.apart,) if has_direct_path else ()))
        way = reduce(np.maximum, [path.travelled(half) / path.slant_range for path in turning])
        limits = [limit for limit, _ in NODES]
        counts = np.array([count for _, count in NODES])
        return counts[np.searchsorted(limits, way, side="left")]


def angle_between_lines(a: tuple[Any, Any], b: tuple[Any, Any]) -> Any:
    """Angle between two directions of the plane without regard to sign. [rad]"""
    return np.arctan2(np.abs(a[0] * b[1] - a[1] * b[0]), np.abs(a[0] * b[0] + a[1] * b[1]))
