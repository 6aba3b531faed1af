"""Bistatic geometry at the aperture midpoint: look vectors, angles, ground gradients, frames.

Frame: scene centre at the origin, ground plane z = 0, x east, y north, z up. SI units, radians.
Vectors are plain tuples, so that a check needs no array library.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest

from bisar_budget.constants import MIN_GRADIENT_ANGLE_DEG, MIN_GROUND_GRADIENT, ROUNDING

Vector = tuple[float, float, float]
GroundVector = tuple[float, float]

_DIRECTED = 1e-300  # m/s; of what is smaller too few digits are left for a direction
STRAIGHT: Vector = (0.0, 0.0, 0.0)  # acceleration of a platform whose path does not curve
Axes = tuple[Vector, Vector, Vector]

STILL = 1e-6  # m/s; slower than this no platform flies an aperture
FRAME_AXES = {
    "scene": ("x", "y", "z"),
    "track": ("along", "cross", "up"),
    "look": ("line_of_sight", "cross", "up"),
    "ric": ("radial", "in_track", "cross_track"),
}


class UndefinedFrameError(ValueError):
    """A frame that this platform does not have: a still one has no track, one overhead no cross direction.

    Without the scene's latitude and longitude nothing is known of the Earth's centre, and no platform has `ric`.
    """


def dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a: Vector) -> float:
    """Length."""
    return math.hypot(*a)


def unit(a: Vector) -> Vector:
    """Direction of a vector that is not zero."""
    length = norm(a)
    return (a[0] / length, a[1] / length, a[2] / length)


def without_rounding(a: Vector) -> Vector:
    """Set components to zero that are rounding beside the vector's length: cos 90° is 6e-17."""
    floor = ROUNDING * norm(a)
    x, y, z = (component if abs(component) > floor else 0.0 for component in a)
    return (x, y, z)


def _minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@dataclass(frozen=True, kw_only=True)
class PlatformState:
    """The path of one platform over the aperture, a polynomial of slow time.

    Position [m] and velocity [m/s] at the midpoint, acceleration [m/s²], and in `bends` the coefficients of τ³, τ⁴, …
    [m/s³], [m/s⁴], …. `radial` are the axes of its `ric` frame, where the Earth's centre is known.
    """

    position: Vector
    velocity: Vector
    acceleration: Vector = STRAIGHT
    bends: tuple[Vector, ...] = ()
    radial: Axes | None = None

    @property
    def is_still(self) -> bool:
        """Whether it stays where it is."""
        return self.travelled(1.0) < STILL

    @property
    def is_straight(self) -> bool:
        """Whether the velocity is constant."""
        return self.acceleration == STRAIGHT and not self.bends

    def at(self, tau: float) -> tuple[Vector, Vector]:
        """Position and velocity at a slow time from the midpoint. [m], [m/s]"""
        p, v, a = self.position, self.velocity, self.acceleration
        half = tau * tau / 2
        x, y, z = p[0] + v[0] * tau + a[0] * half, p[1] + v[1] * tau + a[1] * half, p[2] + v[2] * tau + a[2] * half
        u, v_y, w = v[0] + a[0] * tau, v[1] + a[1] * tau, v[2] + a[2] * tau
        for power, (a_x, a_y, a_z) in enumerate(self.bends, 3):
            moved, faster = tau**power, power * tau ** (power - 1)
            x, y, z = x + a_x * moved, y + a_y * moved, z + a_z * moved
            u, v_y, w = u + a_x * faster, v_y + a_y * faster, w + a_z * faster
        return (x, y, z), (u, v_y, w)

    @cached_property
    def slant_range(self) -> float:
        """Distance to the scene centre. [m]"""
        return norm(self.position)

    @cached_property
    def look(self) -> Vector:
        """Unit vector u from the scene centre to the platform. [-]"""
        return unit(self.position)

    @cached_property
    def look_rate(self) -> Vector:
        """Rate of u: v⊥/R with v⊥ = v − u(u·v). [1/s]"""
        u, v, R = self.look, self.velocity, self.slant_range
        radial = dot(u, v)
        return (
            (v[0] - u[0] * radial) / R,
            (v[1] - u[1] * radial) / R,
            (v[2] - u[2] * radial) / R,
        )

    def travelled(self, duration_s: float) -> float:
        """Bound of the way it makes from the midpoint in a time. [m]"""
        way = norm(self.velocity) * duration_s + norm(self.acceleration) * duration_s**2 / 2
        return way + sum(norm(bend) * duration_s**power for power, bend in enumerate(self.bends, 3))

    @property
    def azimuth(self) -> float:
        """From east, counter-clockwise, φ of (6). [rad]"""
        return math.atan2(self.position[1], self.position[0])

    @property
    def elevation(self) -> float:
        """Above the ground plane as seen from the scene centre, θ of (6). [rad]"""
        return math.atan2(self.position[2], math.hypot(self.position[0], self.position[1]))

    @property
    def squint(self) -> float | None:
        """Angle of the line of sight from broadside, positive looking forward; None when still. [rad]"""
        speed = norm(self.velocity)
        if speed == 0:
            return None
        sine = -dot(self.look, self.velocity) / speed
        return math.asin(max(-1.0, min(1.0, sine))) if abs(sine) > ROUNDING else 0.0

    def frame(self, name: str) -> Axes:
        """Axes of a frame as unit vectors of the scene, right-handed, in the order of `FRAME_AXES`.

        `track`: along the velocity; cross is horizontal, to the left; up completes it (vertical in level
        flight). `look`: line of sight from the scene centre to the platform; cross is horizontal; up
        completes it. `ric`: away from the Earth's centre; in-track and cross-track are those of the orbit, whose
        plane holds the velocity against the stars; cross-track is its normal.

        Raises
        ------
        UndefinedFrameError
            Track frame of a still platform, a first axis that is vertical, or no Earth's centre.
        """
        if name == "ric":
            if self.radial is None:
                raise UndefinedFrameError("the ric frame needs the scene's latitude, longitude and height")
            return self.radial
        if name == "scene":
            return ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        first = self.velocity if name == "track" else self.position
        if norm(first) < _DIRECTED:
            raise UndefinedFrameError("a still platform has no track frame")
        first = unit(first)
        horizontal = cross((0.0, 0.0, 1.0), first)
        if norm(horizontal) < ROUNDING:
            raise UndefinedFrameError(f"the first axis of its {name} frame is vertical, so cross has no direction")
        second = unit(horizontal)
        return (without_rounding(first), without_rounding(second), without_rounding(cross(first, second)))


def state_from_angles(
    *,
    slant_range: float,
    azimuth: float,
    elevation: float,
    speed: float,
    motion_azimuth: float,
    climb: float,
    acceleration: Vector = STRAIGHT,
) -> PlatformState:
    """Position and velocity from range and angles; `speed` is over ground, `climb` its vertical part."""
    position = (
        slant_range * math.cos(azimuth) * math.cos(elevation),
        slant_range * math.sin(azimuth) * math.cos(elevation),
        slant_range * math.sin(elevation),
    )
    velocity = (speed * math.cos(motion_azimuth), speed * math.sin(motion_azimuth), climb)
    return PlatformState(
        position=without_rounding(position), velocity=without_rounding(velocity), acceleration=acceleration
    )


@dataclass(frozen=True, kw_only=True)
class BistaticGeometry:
    """Both platforms together, and what range and Doppler say about the ground."""

    transmitter: PlatformState
    receiver: PlatformState

    @cached_property
    def apart(self) -> PlatformState:
        """The transmitter as the receiver has it: its position is the baseline."""
        (p, v, a), (q, w, b) = (
            (state.position, state.velocity, state.acceleration) for state in (self.transmitter, self.receiver)
        )
        bends = tuple(
            _minus(*both) for both in zip_longest(self.transmitter.bends, self.receiver.bends, fillvalue=STRAIGHT)
        )
        return PlatformState(position=_minus(p, q), velocity=_minus(v, w), acceleration=_minus(a, b), bends=bends)

    def sights(self, *, has_direct_path: bool) -> tuple[Vector, Vector]:
        """What a metre of the transmitter's motion, and of the receiver's, takes from the range at mid-aperture. [-]

        The lines of sight u_t, u_r; where the direct path is the clock u_t − b, u_r + b, b to the transmitter.
        """
        t, r = self.transmitter.look, self.receiver.look
        if not has_direct_path:
            return t, r
        b = self.apart.look
        return _minus(t, b), _minus(r, (-b[0], -b[1], -b[2]))

    @cached_property
    def range_gradient(self) -> GroundVector:
        """Sum s of the look vectors on the ground, (2,): range changes by −s·x. [-]"""
        t, r = self.transmitter.look, self.receiver.look
        return (t[0] + r[0], t[1] + r[1])

    @cached_property
    def doppler_gradient(self) -> GroundVector:
        """Rate of s on the ground, (2,). [1/s]"""
        t, r = self.transmitter.look_rate, self.receiver.look_rate
        return (t[0] + r[0], t[1] + r[1])

    @property
    def look_azimuth(self) -> float:
        """Bistatic look direction φ_b of (11), by atan2. [rad]"""
        return math.atan2(self.range_gradient[1], self.range_gradient[0])

    @property
    def bistatic_angle(self) -> float:
        """Angle between the look vectors. [rad]"""
        t, r = self.transmitter.look, self.receiver.look
        return math.atan2(norm(cross(t, r)), dot(t, r))

    @property
    def gradient_angle(self) -> float:
        """Angle between the lines of range and Doppler gradient on the ground, 0 to π/2. [rad]"""
        return angle_between_lines(self.range_gradient, self.doppler_gradient)

    def range_resolution(self, bandwidth_hz: float, speed_of_light: float) -> float:
        """Peak to first null along φ_b on the ground, c/(B|s|). [m]"""
        return speed_of_light / (bandwidth_hz * math.hypot(*self.range_gradient))

    def cross_range_resolution(self, wavelength_m: float, aperture_time_s: float) -> float:
        """Peak to first null across φ_b on the ground, along a line of constant range: λ/(T|ṡ⊥|). [m]"""
        across = math.hypot(*self.doppler_gradient) * math.sin(self.gradient_angle)
        return wavelength_m / (aperture_time_s * across)

    def degeneracy(self) -> str:
        """Say why no ground image can be formed; empty where one can.

        Refused are |s| on the ground below 0.02 (forward scatter, or both platforms overhead) and range
        and Doppler gradients within 1° of parallel (motion along the look direction only).
        """
        length = math.hypot(*self.range_gradient)
        if length < MIN_GROUND_GRADIENT:
            return (
                f"range does not change over the ground: the look vectors cancel to {length:.2g} there, at least "
                f"{MIN_GROUND_GRADIENT} is needed (bistatic angle {math.degrees(self.bistatic_angle):.1f} deg)"
            )
        turning = sum(norm(p.velocity) / p.slant_range for p in (self.transmitter, self.receiver))
        if math.hypot(*self.doppler_gradient) <= 1e-9 * turning:
            return "Doppler does not change over the ground: neither line of sight turns during the aperture"
        degrees = math.degrees(self.gradient_angle)
        if degrees < MIN_GRADIENT_ANGLE_DEG:
            return (
                f"range and Doppler gradients on the ground are {degrees:.2g} deg from parallel, at least "
                f"{MIN_GRADIENT_ANGLE_DEG:g} deg is needed: no image plane"
            )
        return ""


def angle_between_lines(a: GroundVector, b: GroundVector) -> float:
    """Angle between two directions of the plane without regard to sign, 0 to π/2; 0 if one is zero. [rad]"""
    return math.atan2(abs(a[0] * b[1] - a[1] * b[0]), abs(a[0] * b[0] + a[1] * b[1]))
