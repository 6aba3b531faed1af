"""Bistatic geometry at the aperture midpoint: look vectors, angles, gradients on the ground, and frames.

The scene centre is the origin, and the ground is the plane z = 0; x is east, y north and z up. SI units, radians.
Vectors are tuples of components, which are numbers for one case or arrays (cases,) for many. Functions of plain
numbers return plain floats, because calculations with them are ten times as fast as with NumPy scalars.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest
from typing import Any, Protocol, overload

import numpy as np
from numpy.typing import NDArray

from bisar_budget.arrays import Floats, Indices, PerCase, PerCaseFlag, absolute
from bisar_budget.constants import SPEED_OF_LIGHT_MPS, VECTOR_ROUNDING_FRACTION

Vector = tuple[float, float, float]
Vectors = tuple[PerCase, PerCase, PerCase]
VectorArrays = tuple[Floats, Floats, Floats]
GroundVector = tuple[float, float]

_MIN_DIRECTED_SPEED_MPS = 1e-300  # a smaller velocity has too few significant digits for a direction
STRAIGHT: Vector = (0.0, 0.0, 0.0)  # acceleration of a platform with a straight path
Axes = tuple[Vectors, Vectors, Vectors]

STILL_SPEED_MPS = 1e-6  # a slower platform does not move
_LOOKS_PER_PIECE = 8  # samples per piece of a path, from which its length and its lowest point are found
_MIN_LOOK_COUNT = 32  # samples on each side of the midpoint
FRAME_AXES = {
    "scene": ("x", "y", "z"),
    "track": ("along", "cross", "up"),
    "look": ("line_of_sight", "cross", "up"),
    "ric": ("radial", "in_track", "cross_track"),
}


class UndefinedFrameError(ValueError):
    """The requested frame does not exist for a platform.

    The frame `track` does not exist for a platform at rest. The frame `look` does not exist for a platform directly
    above the scene centre, because it has no cross direction there. The frame `ric` does not exist if the latitude
    and longitude of the scene are unknown, because the position of the Earth's centre is then unknown as well.
    """


_ARRAY = np.ndarray


# With the functions of NumPy alone, a state from angles takes three times as long, and last digits of results change.
def _either(of_numbers: Callable[..., PerCase], of_arrays: Callable[..., PerCase]) -> Callable[..., PerCase]:
    """Combine a function for numbers and a function for arrays into one function that accepts both."""

    def function(*values: PerCase) -> PerCase:
        return of_arrays(*values) if _ARRAY in map(type, values) else of_numbers(*values)

    return function


_hypot = _either(math.hypot, np.hypot)
_cos = _either(math.cos, np.cos)
_sin = _either(math.sin, np.sin)
_arctan2 = _either(math.atan2, np.arctan2)
_above = _either(
    lambda floor, part: 0.0 if abs(part) <= floor else part,
    lambda floor, part: np.where(np.abs(part) <= floor, 0.0, part),
)


@overload
def dot(a: Vector, b: Vector) -> float: ...
@overload
def dot(a: VectorArrays, b: Vectors) -> Floats: ...
@overload
def dot(a: Vectors, b: VectorArrays) -> Floats: ...
@overload
def dot(a: Vectors, b: Vectors) -> PerCase: ...
def dot(a: Vectors, b: Vectors) -> PerCase:
    """Scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@overload
def cross(a: Vector, b: Vector) -> Vector: ...
@overload
def cross(a: Vectors, b: Vectors) -> Vectors: ...
def cross(a: Vectors, b: Vectors) -> Vectors:
    """Vector product of two vectors."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@overload
def norm(a: Vector) -> float: ...
@overload
def norm(a: VectorArrays) -> Floats: ...
@overload
def norm(a: Vectors) -> PerCase: ...
def norm(a: Vectors) -> PerCase:
    """Length of a vector."""
    return math.hypot(*a) if _ARRAY not in map(type, a) else np.sqrt(dot(a, a))


@overload
def unit(a: Vector) -> Vector: ...
@overload
def unit(a: Vectors) -> Vectors: ...
def unit(a: Vectors) -> Vectors:
    """Unit vector in the direction of a vector, which must not be zero."""
    length = norm(a)
    return (a[0] / length, a[1] / length, a[2] / length)


@overload
def without_rounding(a: Vector) -> Vector: ...
@overload
def without_rounding(a: Vectors) -> Vectors: ...
def without_rounding(a: Vectors) -> Vectors:
    """Replace components that are only rounding errors, such as 6e-17 for cos 90°, by zero.

    A component counts as a rounding error if it is tiny relative to the length of the vector.
    """
    floor = VECTOR_ROUNDING_FRACTION * norm(a)
    return (_above(floor, a[0]), _above(floor, a[1]), _above(floor, a[2]))


def plain_vector(a: Vectors) -> Vector:
    """Convert a vector for a single case to a tuple of three floats."""
    x, y, z = a
    return (float(x), float(y), float(z))


def _of_cases(values: Floats, asked: PerCase) -> PerCase:
    """Return `values` (cases,), or a float if there is a single case and the argument `asked` is a number.

    `asked` is the argument for which the values were computed.
    """
    return values if np.ndim(asked) or values.size > 1 else values.item()


def _minus(a: Vectors, b: Vectors) -> Vectors:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _number_of_cases(number: PerCase, cases: Indices) -> PerCase:
    """Select elements of an array by case indices; a number that is the same for all cases is returned unchanged."""
    return number[cases] if isinstance(number, np.ndarray) and number.size > 1 else number


def _vector_of_cases(vector: Vectors, cases: Indices) -> Vectors:
    x, y, z = (_number_of_cases(component, cases) for component in vector)
    return (x, y, z)


class CurvedPath(Protocol):
    """A platform path that is not a single polynomial of slow time."""

    @property
    def count(self) -> int:
        """Number of pieces of the path."""

    def at(self, tau: PerCase) -> tuple[Vectors, Vectors]:
        """Position [m] and velocity [m/s] at slow times from the midpoint."""

    def of(self, cases: Indices) -> "CurvedPath":
        """Select the paths of some cases by their indices."""


class Fall(Protocol):
    """Propagation of the state errors of a platform in free fall; implemented by `paths.free_fall.FreeFall`."""

    @property
    def share(self) -> PerCase:
        """1 in cases with a platform in free fall, 0 in all other cases."""

    def motions(self, path: "PlatformState", half: NDArray[np.float64], places: NDArray[np.float64]) -> Any:
        """Motion over the aperture due to unit errors of the state at mid-aperture, (3, 3, 3, nodes, cases). [m]

        The first index is the kind of error (position, velocity, acceleration), the second its axis, and the third
        the component of the motion. `half` is half the aperture time [s], and `places` are the slow times of the
        nodes in units of `half`.
        """

    def rate_against_stars(self, position: Vectors) -> Vectors:
        """Velocity error in the axes of the scene due to a position error that is constant in inertial space. [m/s]

        `position` [m] is the position error, east, north and up.
        """

    def orbit_rate(self, path: "PlatformState") -> Vectors:
        """Angular rate vector of the orbit, in the axes of the scene. [rad/s]"""

    @property
    def centre(self) -> Vectors:
        """Position of the Earth's centre, in the axes of the scene. [m]"""

    @property
    def rotation(self) -> Vectors:
        """Angular rate vector of the scene axes with respect to inertial space. [rad/s]"""

    def of(self, cases: Any) -> "Fall":
        """Select the dynamics for some cases by their indices."""


@dataclass(frozen=True)
class Pieces:
    """Piecewise polynomial path; each polynomial applies to an interval (piece) of slow time.

    The first and the last polynomial also apply beyond the ends of the path. Each polynomial counts time from the
    middle of its piece. Times from the midpoint of a long aperture can be hundreds of seconds, and high powers of
    such times would lose digits. Numbers may be arrays (cases,).

    Attributes
    ----------
    starts : tuple
        Slow times at which the pieces begin, in ascending order. The first piece has no start. [s]
    middles : tuple
        Slow time of the middle of each piece, from which its polynomial counts time. [s]
    powers : tuple
        For each piece, the coefficients of the powers 0, 1, … of time. [m], [m/s], …
    """

    starts: tuple[PerCase, ...]
    middles: tuple[PerCase, ...]
    powers: tuple[tuple[Vectors, ...], ...]

    @property
    def count(self) -> int:
        """Number of pieces of the path."""
        return len(self.middles)

    @cached_property
    def _arrays(self) -> tuple[Floats, Floats, Floats]:
        """The attributes as arrays: starts (pieces - 1, …), middles (pieces, …), powers (pieces, …, order + 1, 3).

        Here … is the axis of the cases, which is absent if there is only a single case.
        """
        numbers = [x for powers in self.powers for vector in powers for x in vector]
        every = np.array(np.broadcast_arrays(*self.starts, *self.middles, *numbers), dtype=float)
        starts, middles, powers = np.split(every, (len(self.starts), len(self.starts) + self.count))
        powers = powers.reshape(self.count, -1, 3, *every.shape[1:])
        return starts, middles, powers if every.ndim == 1 else np.moveaxis(powers, -1, 1)

    def at(self, tau: PerCase) -> tuple[Vectors, Vectors]:
        """Position [m] and velocity [m/s] at slow times from the midpoint."""
        starts, middles, powers = self._arrays
        times = np.asarray(tau, dtype=float)
        if middles.ndim == 1:
            piece: Indices | tuple[Indices, Indices] = np.searchsorted(starts, times, "right")
        else:
            times = np.broadcast_to(times, np.broadcast_shapes(times.shape, middles.shape[1:]))
            begun = times >= starts.reshape(len(starts), *(1,) * (times.ndim - 1), middles.shape[1])
            piece = begun.sum(axis=0), np.arange(middles.shape[1])
        since, of_piece = (times - middles[piece])[..., None], powers[piece]
        position, rate = of_piece[..., -1, :], np.zeros((*times.shape, 3))
        for power in range(of_piece.shape[-2] - 2, -1, -1):
            rate = rate * since + position
            position = position * since + of_piece[..., power, :]
        (x, y, z), (u, v, w) = (np.moveaxis(vector, -1, 0) for vector in (position, rate))
        if np.ndim(x):
            return (x, y, z), (u, v, w)
        return (float(x), float(y), float(z)), (float(u), float(v), float(w))

    def of(self, cases: Indices) -> "Pieces":
        """Select the paths of some cases by their indices; numbers that are the same for all cases are unchanged."""
        starts, middles = (
            tuple(_number_of_cases(number, cases) for number in numbers) for numbers in (self.starts, self.middles)
        )
        return Pieces(
            starts,
            middles,
            tuple(tuple(_vector_of_cases(vector, cases) for vector in powers) for powers in self.powers),
        )


@dataclass(frozen=True)
class _Apart:
    """Difference of two paths, at least one of which is piecewise."""

    path: "PlatformState"
    other: "PlatformState"

    @property
    def count(self) -> int:
        return sum(path.curve.count for path in (self.path, self.other) if path.curve is not None)

    def at(self, tau: PerCase) -> tuple[Vectors, Vectors]:
        (position, rate), (from_place, from_rate) = self.path.at(tau), self.other.at(tau)
        return _minus(position, from_place), _minus(rate, from_rate)

    def of(self, cases: Indices) -> "_Apart":
        return _Apart(self.path.of(cases), self.other.of(cases))


@dataclass(frozen=True, kw_only=True)
class PlatformState:
    """Path of one platform over the aperture as a function of slow time, for one case or many.

    The position [m], the velocity [m/s] and the acceleration [m/s²] at the midpoint, and the coefficients `bends` of
    τ³ [m/s³], τ⁴ [m/s⁴], … define a polynomial of slow time τ. Without a `curve` the polynomial is the full path;
    with a `curve` it is the path near the midpoint. `radial` contains the axes of the platform's `ric` frame if the
    position of the Earth's centre is known. `fall` describes how errors of a platform in free fall propagate; it is
    None for any other platform.
    """

    position: Vectors
    velocity: Vectors
    acceleration: Vectors = STRAIGHT
    bends: tuple[Vectors, ...] = ()
    radial: Axes | None = None
    curve: CurvedPath | None = None
    fall: Fall | None = None

    @property
    def is_still(self) -> PerCaseFlag:
        """Whether the platform is at rest. A platform with a piecewise path counts as moving."""
        return self.curve is None and self.travelled(1.0) < STILL_SPEED_MPS

    @property
    def is_straight(self) -> bool:
        """Whether the velocity is constant; only for a platform with a single case."""
        return self.acceleration == STRAIGHT and self.is_quadratic

    @property
    def is_quadratic(self) -> bool:
        """Whether the acceleration is constant."""
        return not self.bends and self.curve is None

    @property
    def rates(self) -> tuple[Vectors, ...]:
        """Derivatives of the position at the midpoint: velocity, acceleration, jerk, … [m/s], [m/s²], …"""
        faster = ((bend, math.factorial(power)) for power, bend in enumerate(self.bends, 3))
        return (self.velocity, self.acceleration, *((b[0] * n, b[1] * n, b[2] * n) for b, n in faster))

    @overload
    def place(self, tau: Floats) -> VectorArrays: ...
    @overload
    def place(self, tau: PerCase) -> Vectors: ...
    def place(self, tau: PerCase) -> Vectors:
        """Position at slow times from the midpoint. [m]"""
        if self.curve is not None:
            return self.curve.at(tau)[0]
        p, v, a = self.position, self.velocity, self.acceleration
        half = tau * tau / 2
        x, y, z = p[0] + v[0] * tau + a[0] * half, p[1] + v[1] * tau + a[1] * half, p[2] + v[2] * tau + a[2] * half
        for power, bend in enumerate(self.bends, 3):
            moved = tau**power
            x, y, z = x + bend[0] * moved, y + bend[1] * moved, z + bend[2] * moved
        return (x, y, z)

    @overload
    def at(self, tau: Floats) -> tuple[VectorArrays, VectorArrays]: ...
    @overload
    def at(self, tau: PerCase) -> tuple[Vectors, Vectors]: ...
    def at(self, tau: PerCase) -> tuple[Vectors, Vectors]:
        """Position [m] and velocity [m/s] at slow times from the midpoint."""
        if self.curve is not None:
            return self.curve.at(tau)
        v, a = self.velocity, self.acceleration
        x, y, z = v[0] + a[0] * tau, v[1] + a[1] * tau, v[2] + a[2] * tau
        for power, bend in enumerate(self.bends, 3):
            faster = power * tau ** (power - 1)
            x, y, z = x + bend[0] * faster, y + bend[1] * faster, z + bend[2] * faster
        return self.place(tau), (x, y, z)

    def later(self, tau: PerCase, delay_s: PerCase) -> Vectors:
        """Displacement of the platform from slow times `tau` to `tau + delay_s`. [m]"""
        return _minus(self.place(tau + delay_s), self.place(tau))

    def of(self, cases: Indices) -> "PlatformState":
        """Select the paths of some cases by their indices; numbers that are the same for all cases are unchanged."""
        return PlatformState(
            position=_vector_of_cases(self.position, cases),
            velocity=_vector_of_cases(self.velocity, cases),
            acceleration=_vector_of_cases(self.acceleration, cases),
            bends=tuple(_vector_of_cases(bend, cases) for bend in self.bends),
            curve=self.curve and self.curve.of(cases),
            fall=self.fall and self.fall.of(cases),
        )

    @cached_property
    def slant_range(self) -> PerCase:
        """Distance to the scene centre. [m]"""
        return norm(self.position)

    @cached_property
    def look(self) -> Vectors:
        """Unit vector u from the scene centre to the platform. [-]"""
        (x, y, z), R = self.position, self.slant_range
        return (x / R, y / R, z / R)

    @cached_property
    def look_rate(self) -> Vectors:
        """Rate of change of the unit vector u: v⊥/R with v⊥ = v − u(u·v). [1/s]"""
        u, v, R = self.look, self.velocity, self.slant_range
        radial = dot(u, v)
        return (
            (v[0] - u[0] * radial) / R,
            (v[1] - u[1] * radial) / R,
            (v[2] - u[2] * radial) / R,
        )

    def travelled(self, duration_s: PerCase) -> PerCase:
        """Upper bound of the distance that the platform travels in `duration_s` before or after the midpoint. [m]"""
        if self.curve is not None:
            x, y, z = (np.diff(component, axis=0) for component in self._looks(duration_s))
            steps = norm((x, y, z))
            before, after = np.split(steps, 2)
            return _of_cases(np.maximum(before.sum(axis=0), after.sum(axis=0)), duration_s)
        way = norm(self.velocity) * duration_s + norm(self.acceleration) * duration_s**2 / 2
        return way + sum((norm(bend) * duration_s**power for power, bend in enumerate(self.bends, 3)), 0.0)

    def sinks(self, duration_s: PerCase) -> PerCase:
        """Upper bound of the descent of the platform below its height at the midpoint. [m]

        The bound applies to slow times from `-duration_s` to `duration_s`.
        """
        if self.curve is not None:
            return _of_cases(self.position[2] - self._looks(duration_s)[2].min(axis=0), duration_s)
        way = absolute(self.velocity[2]) * duration_s + absolute(self.acceleration[2]) * duration_s**2 / 2
        return way + sum((absolute(bend[2]) * duration_s**power for power, bend in enumerate(self.bends, 3)), 0.0)

    def _looks(self, duration_s: PerCase) -> VectorArrays:
        """Positions at evenly spaced times from `-duration_s` to `duration_s`. [m]

        Each of the three components has the shape (samples, cases).
        """
        count = _MIN_LOOK_COUNT if self.curve is None else max(_MIN_LOOK_COUNT, _LOOKS_PER_PIECE * self.curve.count)
        return self.place(np.linspace(-1.0, 1.0, 2 * count + 1)[:, None] * duration_s)

    def less(self, other: "PlatformState") -> "PlatformState":
        """Path relative to another platform: the difference of both positions at each time. It has no `ric` frame."""
        return PlatformState(
            position=_minus(self.position, other.position),
            velocity=_minus(self.velocity, other.velocity),
            acceleration=_minus(self.acceleration, other.acceleration),
            bends=tuple(_minus(*pair) for pair in zip_longest(self.bends, other.bends, fillvalue=STRAIGHT)),
            curve=None if self.curve is None and other.curve is None else _Apart(self, other),
        )

    @property
    def azimuth(self) -> PerCase:
        """Azimuth φ of equation (6) in Rigling & Moses, counter-clockwise from east. [rad]"""
        return _arctan2(self.position[1], self.position[0])

    @property
    def elevation(self) -> PerCase:
        """Elevation θ of equation (6) in Rigling & Moses: angle above the ground plane at the scene centre. [rad]"""
        return _arctan2(self.position[2], _hypot(self.position[0], self.position[1]))

    @property
    def squint(self) -> float | None:
        """Squint: angle of the line of sight from broadside, positive forward; only for a single case. [rad]

        None for a platform at rest.
        """
        speed = float(norm(self.velocity))
        if speed == 0:
            return None
        sine = -float(dot(self.look, self.velocity)) / speed
        return math.asin(max(-1.0, min(1.0, sine))) if abs(sine) > VECTOR_ROUNDING_FRACTION else 0.0

    def has_frame(self, name: str, margin: float = 1.0) -> PerCaseFlag:
        """Whether the frame `name` exists for the platform.

        A frame does not exist if the horizontal part of its first axis is so small that it counts as a rounding
        error. `margin` is a factor on the smallest length that this part may have.
        """
        if name in ("scene", "ric"):
            return name == "scene" or self.radial is not None
        first = self._first_axis(name)
        length = norm(first)
        return (length >= _MIN_DIRECTED_SPEED_MPS) & (
            _hypot(first[0], first[1]) >= margin * VECTOR_ROUNDING_FRACTION * length
        )

    def _first_axis(self, name: str) -> Vectors:
        return self.velocity if name == "track" else self.position

    def frame(self, name: str) -> Axes:
        """Unit vectors of a right-handed frame, given in the axes of the scene, in the order of `FRAME_AXES`.

        In `track`, the first axis is along the velocity, cross is horizontal and to the left, and up, which is
        vertical in level flight, completes the frame. In `look`, the first axis is the line of sight from the scene
        centre to the platform, cross is horizontal, and up completes the frame. In `ric`, the first axis points away
        from the Earth's centre. The plane of the orbit contains the inertial velocity; in-track lies in this plane,
        and cross-track is its normal.

        If there are many cases, the axes are NaN for the cases in which the frame does not exist.

        Raises
        ------
        UndefinedFrameError
            The frame does not exist: the platform is at rest (`track`), the first axis is vertical (`track` and
            `look`), or the position of the Earth's centre is unknown (`ric`).
        """
        has_it = self.has_frame(name)
        if not isinstance(has_it, np.ndarray) and not has_it:
            raise UndefinedFrameError(self._why_no_frame(name))
        if name == "ric" and self.radial is not None:
            return self.radial
        if name == "scene":
            return ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        with np.errstate(all="ignore"):
            first = unit(self._first_axis(name))
            second = unit(cross((0.0, 0.0, 1.0), first))
        return (without_rounding(first), without_rounding(second), without_rounding(cross(first, second)))

    def _why_no_frame(self, name: str) -> str:
        if name == "ric":
            return "the ric frame needs the scene's latitude, longitude and height"
        if norm(self._first_axis(name)) < _MIN_DIRECTED_SPEED_MPS:
            return "a still platform has no track frame"
        return f"the first axis of its {name} frame is vertical, so cross has no direction"


def state_from_angles(
    *,
    slant_range: PerCase,
    azimuth: PerCase,
    elevation: PerCase,
    speed: PerCase,
    motion_azimuth: PerCase,
    climb: PerCase,
    acceleration: Vectors = STRAIGHT,
    bends: tuple[Vectors, ...] = (),
) -> PlatformState:
    """Path of a platform from range, angles and speed at the midpoint.

    `speed` is the speed over ground, and `climb` is the vertical component of the velocity.
    """
    position = (
        slant_range * _cos(azimuth) * _cos(elevation),
        slant_range * _sin(azimuth) * _cos(elevation),
        slant_range * _sin(elevation),
    )
    velocity = (speed * _cos(motion_azimuth), speed * _sin(motion_azimuth), climb)
    return PlatformState(
        position=without_rounding(position),
        velocity=without_rounding(velocity),
        acceleration=acceleration,
        bends=bends,
    )


@dataclass(frozen=True, kw_only=True)
class BistaticGeometry:
    """Paths of both platforms, and the gradients of range and Doppler on the ground; for one case or many."""

    transmitter: PlatformState
    receiver: PlatformState

    @property
    def both(self) -> tuple[PlatformState, PlatformState]:
        """Paths of transmitter and receiver."""
        return self.transmitter, self.receiver

    @cached_property
    def apart(self) -> PlatformState:
        """Path of the transmitter relative to the receiver; its position is the baseline."""
        return self.transmitter.less(self.receiver)

    @property
    def echo_delay(self) -> PerCase:
        """Delay of the scene centre's echo relative to the direct path, at mid-aperture. [s]"""
        t, r = self.both
        return (t.slant_range + r.slant_range - self.apart.slant_range) / SPEED_OF_LIGHT_MPS

    def at(self, tau: PerCase) -> "BistaticGeometry":
        """Geometry at slow times [s]; the platforms have straight paths through their positions at these times."""
        transmitter, receiver = (
            PlatformState(position=p, velocity=v) for p, v in (path.at(tau) for path in self.both)
        )
        return BistaticGeometry(transmitter=transmitter, receiver=receiver)

    def sights(self, *, has_direct_path: bool) -> tuple[Vectors, Vectors]:
        """Decrease of the bistatic range at mid-aperture per metre of motion of each platform, transmitter first. [-]

        These are the lines of sight u_t and u_r. If the receiver uses the direct path as its clock, the result is
        u_t − b and u_r + b, where b is the unit vector from receiver to transmitter.
        """
        t, r = self.transmitter.look, self.receiver.look
        if not has_direct_path:
            return t, r
        b = self.apart.look
        return _minus(t, b), _minus(r, (-b[0], -b[1], -b[2]))

    @cached_property
    def range_gradient(self) -> tuple[PerCase, PerCase]:
        """Horizontal components of s, the sum of the look vectors. [-]

        The range to a ground point x is shorter by s·x than the range to the scene centre.
        """
        t, r = self.transmitter.look, self.receiver.look
        return (t[0] + r[0], t[1] + r[1])

    @cached_property
    def doppler_gradient(self) -> tuple[PerCase, PerCase]:
        """Rate of change ṡ of the range gradient s over slow time. [1/s]"""
        t, r = self.transmitter.look_rate, self.receiver.look_rate
        return (t[0] + r[0], t[1] + r[1])

    @property
    def look_azimuth(self) -> PerCase:
        """Bistatic look direction φ_b of equation (11) in Rigling & Moses, computed with atan2. [rad]"""
        return _arctan2(self.range_gradient[1], self.range_gradient[0])

    @property
    def bistatic_angle(self) -> PerCase:
        """Angle between the look vectors. [rad]"""
        t, r = self.transmitter.look, self.receiver.look
        return _arctan2(norm(cross(t, r)), dot(t, r))

    @cached_property
    def gradient_angle(self) -> PerCase:
        """Acute angle between the range gradient and the Doppler gradient on the ground, 0 to π/2. [rad]"""
        return angle_between_lines(self.range_gradient, self.doppler_gradient)

    def range_resolution(self, bandwidth_hz: PerCase, speed_of_light: float) -> PerCase:
        """Range resolution along φ_b on the ground, from peak to first null: c/(B|s|). [m]"""
        return speed_of_light / (bandwidth_hz * _hypot(*self.range_gradient))

    def cross_range_resolution(self, wavelength_m: PerCase, aperture_time_s: PerCase) -> PerCase:
        """Cross-range resolution on the ground: λ/(T|ṡ⊥|). [m]

        It is the distance from peak to first null along a line of constant range.
        """
        across = _hypot(*self.doppler_gradient) * _sin(self.gradient_angle)
        return wavelength_m / (aperture_time_s * across)


def angle_between_lines(a: tuple[PerCase, PerCase], b: tuple[PerCase, PerCase]) -> PerCase:
    """Angle between two lines in the plane, from 0 to π/2; 0 if one of the direction vectors is zero. [rad]"""
    return _arctan2(absolute(a[0] * b[1] - a[1] * b[0]), absolute(a[0] * b[0] + a[1] * b[1]))
