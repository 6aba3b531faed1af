"""A collection as a file states it, in the terms of a mission: scene, band, aperture, both paths, and errors.

Slow time counts when a pulse is at the scene point. A pulse leaves the transmitter R_t/c before that and reaches the
receiver R_r/c after it; each place of a path is that of its platform at its own time. The range sum of a mission at
a slow time is then that of the pulse.
"""

import math
from typing import TYPE_CHECKING, NamedTuple

from bisar_budget.geometry import PlatformState, Vector, cross, dot, norm, unit
from bisar_budget.paths.earth import Geodetic
from bisar_budget.paths.flight import least_squares, path_of, powers_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

FEWEST = 5  # pulses in an aperture that a path is fitted to
LONGEST = 1e6  # s, of an aperture, and to its middle
FARTHEST = 1e9  # m, of a platform; a mission takes no more
_HIGHEST = 4  # order of a path that a mission states: up to the snap
_UNSEEN = 1e-3  # of a wavelength: 0.4° of phase, a hundredth of the usual budget of 45°
_ROUNDING_M = 1e-7  # a term that moves the path by less at the end of the aperture is rounding
_BETTER = 0.9  # of the residual; an order that leaves more fits noise


class NoPathError(ValueError):
    """Places that give no path."""


class Track(NamedTuple):
    """A path fitted to places: its order, and how far it is from them, at most and root mean square. [m]"""

    state: PlatformState
    order: int
    farthest: float = 0.0
    rms: float = 0.0
    samples: int = 0


class DeclaredMotionError(NamedTuple):
    """Errors of the measured path of one platform, one sigma, along the axes of a frame of the mission.

    `sigmas` (6,) of position [m] and velocity [m/s], None where a kind is not declared; `correlation` (6, 6).
    `acceleration` [m/s²] is in the same frame. `distribution` is that of the mission file.
    """

    frame: str
    position: Vector | None
    velocity: Vector | None
    correlation: tuple[tuple[float, ...], ...] = ()
    acceleration: Vector | None = None
    distribution: str = "normal"

    @property
    def is_isotropic(self) -> bool:
        """Whether it is the same along every direction."""
        return not self.correlation and all(
            kind is None or max(kind) - min(kind) <= 1e-9 * max(kind) for kind in (self.position, self.velocity)
        )


class ReferenceGeometry(NamedTuple):
    """Both slant ranges [m] and the bistatic angle [rad] at the file's reference vector, at a slow time. [s]"""

    slow_time: float
    transmitter_range: float
    receiver_range: float
    bistatic_angle: float


class Imported(NamedTuple):
    """A collection as a file has it.

    `is_monostatic`: transmitter and receiver are one platform, whose errors are the same on both ways; `common` says
    then that they are those of both. `remarks` are for the reader of the mission file; each is one fact. `unused` is
    that of vectors that are not used, empty where there are none.
    """

    file: str
    format: str
    xml_sha256: str
    channel: str
    name: str
    scene: Geodetic
    center_frequency: float
    bandwidth: float
    aperture_time: float
    center_time: str | None
    transmitter: Track
    receiver: Track
    is_monostatic: bool
    reference: ReferenceGeometry | None
    transmitter_error: DeclaredMotionError | None = None
    receiver_error: DeclaredMotionError | None = None
    common_error: DeclaredMotionError | None = None
    timing_constant: float | None = None
    timing_linear: float | None = None
    errors_at: str = ""
    remarks: tuple[str, ...] = ()
    unused: str = ""


def reference_of(transmitter: PlatformState, receiver: PlatformState, slow_time: float) -> ReferenceGeometry:
    """Ranges and bistatic angle at a slow time."""
    t, r = transmitter.at(slow_time)[0], receiver.at(slow_time)[0]
    angle = math.atan2(norm(cross(unit(t), unit(r))), dot(unit(t), unit(r)))
    return ReferenceGeometry(slow_time, norm(t), norm(r), angle)


def fitted(times: "Floats", places: "Floats", aperture_time_s: float, wavelength_m: float) -> Track:
    """Path through places within the aperture by least squares, of the lowest order that a phase does not see.

    The order rises until no place is farther than a thousandth of the wavelength away, to the fourth at most: a
    mission states position, velocity, acceleration, jerk and snap. Where that is not reached, the lowest order is
    kept that no higher one betters clearly: what is left is noise of the places, or motion that is faster.

    Parameters
    ----------
    times : (n,) ndarray
        Slow time; what is outside the aperture is not used. [s]
    places : (n, 3) ndarray
        In the scene's axes. [m]

    Raises
    ------
    NoPathError
        Fewer than five places within the aperture, or places or an aperture beyond what a mission takes.
    """
    import numpy as np

    if not 0 < aperture_time_s <= LONGEST:
        raise NoPathError(f"an aperture of {aperture_time_s:g} s is none; accepted: up to {LONGEST:g} s")
    half = aperture_time_s / 2
    inside = np.abs(times) <= half * (1 + 1e-9)
    count = int(inside.sum())
    if count < FEWEST:
        raise NoPathError(
            f"{count} pulses are in the aperture of {aperture_time_s:g} s, at least {FEWEST} are needed"
        )
    if not float(np.abs(places[inside]).max()) <= FARTHEST:
        raise NoPathError(f"a platform is farther than {FARTHEST:g} m from the scene point, or nowhere")
    at, wanted = times[inside] / half, places[inside]
    middle = wanted.mean(axis=0)  # what is large is taken away, so that rounding is that of what is small
    found = []
    for order in range(1, min(_HIGHEST, count - 2) + 1):
        coefficients, left = least_squares(at, wanted - middle, order)
        away = np.linalg.norm(left, axis=1)
        found.append((coefficients, float(away.max()), float(np.sqrt(np.mean(away**2)))))
        if found[-1][1] <= _UNSEEN * wavelength_m:
            break
    best = found[-1]
    if best[1] > _UNSEEN * wavelength_m:
        best = next(one for one in found if one[2] * _BETTER <= best[2])
    coefficients, farthest, rms = best
    order = len(coefficients) - 1
    powers = powers_of(coefficients, half)
    powers[1:][np.abs(powers[1:]) * half ** np.arange(1, order + 1)[:, None] < _ROUNDING_M] = 0.0
    powers[0] += middle
    powers[0][np.abs(powers[0]) < _ROUNDING_M] = 0.0
    return Track(path_of(powers), order, farthest, rms, count)
