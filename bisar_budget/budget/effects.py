"""What one unit of an error does to the range history and the image, by the published and the full model.

Effects are those of Rigling & Moses (Tables I and II), and of the full model, which lets the line of sight turn and
counts what the displacement of the image adds.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

from bisar_budget import evaluators
from bisar_budget.constants import MIN_GRADIENT_ANGLE_DEG, ROUNDING
from bisar_budget.errors import KeyPath
from bisar_budget.geometry import BistaticGeometry, GroundVector, PlatformState, Vector, angle_between_lines
from bisar_budget.mission.model import Mission

PLATFORMS = ("transmitter", "receiver")
MOTION_UNITS = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}
CLOCK_UNITS = {"constant": "s", "linear": "s/s", "quadratic": "1/s", "cubic": "1/s^2"}
NOWHERE: Vector = (0.0, 0.0, 0.0)  # direction of what is no motion


class Effect(NamedTuple):
    """What one unit of an error does, signed like the range error.

    Constant [m/unit] and linear [(m/s)/unit] term of the range error; quadratic and cubic phase at the
    aperture edge [rad/unit]. The full model's phases hold what the displacement of the image adds.
    """

    constant: float
    linear: float
    qpe: float
    cubic: float


class ErrorSource(NamedTuple):
    """One error: who owns it, how large it is declared, what one unit of it does.

    `owner` is transmitter, receiver, clock or mission (nobody's). `declared` is signed and includes the
    coverage factor; None where the file is silent. `is_independent` marks the errors as the file states
    them: sums and root-sum-squares run over these alone, so that an error stated along the track is not
    counted again by its components along the scene's axes. `direction` is a unit vector of the scene, zero for
    what is no motion; of the mission's own it is that of both platforms.
    """

    id: str
    owner: str
    unit: str
    declared: float | None
    path: KeyPath
    effect: Effect
    full: Effect
    direction: Vector
    equation: str
    no_limit: str
    evidence: str | None = None
    is_independent: bool = True
    notes: tuple[str, ...] = ()

    @property
    def is_motion(self) -> bool:
        """Whether it moves platforms, or the clock: what only is a phase displaces nothing."""
        return self.unit != "rad"

    @property
    def is_position(self) -> bool:
        """Whether it is an error of a platform's measured path, or of both."""
        return self.direction != NOWHERE

    def moves(self, platform: str) -> bool:
        """Whether it is an error of a platform's position; one of the mission's own is of both."""
        return self.owner in (platform, "mission")

    def by(self, model: str) -> Effect:
        """Effect of one unit by a model; by `strictest` that of the larger quadratic phase."""
        if model == "published":
            return self.effect
        is_full = model == "full" or abs(self.full.qpe) >= abs(self.effect.qpe)
        return self.full if is_full else self.effect

    def equation_by(self, model: str) -> str:
        """Where the effect by a model comes from."""
        return "full model" if self.is_motion and self.by(model) is self.full else self.equation

    def qpe(self, model: str) -> float:
        """Quadratic phase error of the declared error by a model, signed; 0 if none is declared. [rad]"""
        return self.by(model).qpe * (self.declared or 0.0)

    def cubic(self, model: str) -> float:
        """Cubic phase of the declared error at the aperture edge, signed; by `strictest` the larger. [rad]"""
        declared = self.declared or 0.0
        if model == "strictest":
            return max(self.full.cubic * declared, self.effect.cubic * declared, key=abs)
        return self.by(model).cubic * declared


class ImagePlane(NamedTuple):
    """Q⁻¹: takes constant and linear range error to the displacement of the image."""

    adjugate: tuple[tuple[float, ...], ...]
    determinant: float
    degeneracy: str

    @property
    def inverse(self) -> list[list[float]]:
        """(2, 2) [m/m, m/(m/s)], where it is not degenerate."""
        return [[element / self.determinant for element in row] for row in self.adjugate]

    def displacement(self, effect: Effect, declared: float) -> GroundVector | None:
        """Displacement on the ground, (2,), by (25) with the Q of a model; None where it has no inverse. [m]"""
        if self.degeneracy:
            return None
        scale = declared / self.determinant
        (a, b), (c, d) = self.adjugate
        # Adding 0.0 turns -0.0, which reads as a claim about a sign, into 0.0.
        return (
            (a * effect.constant + b * effect.linear) * scale + 0.0,
            (c * effect.constant + d * effect.linear) * scale + 0.0,
        )


class FullGround(NamedTuple):
    """What constant and linear terms do in the full model: Q⁻¹, and the phases that the displacement adds.

    `looks` are the line of sight of each platform and its derivatives, (5, 3) [1/sⁿ]; `quadratic` and `cubic`
    the phases added per unit of the constant [rad/m] and of the linear term [rad/(m/s)].
    """

    looks: tuple[tuple[tuple[float, ...], ...], ...]
    plane: ImagePlane
    quadratic: tuple[float, float]
    cubic: tuple[float, float]

    def effective(self, rows: Iterable[tuple[float, ...]]) -> list[Effect]:
        """Effects of errors, what the displacement of the image adds included.

        Each row: constant and linear term, quadratic and cubic phase of the range error by itself.
        """
        (by_constant, by_linear), (cubic_by_constant, cubic_by_linear) = self.quadratic, self.cubic
        effects = []
        for constant, linear, own, own_cubic in rows:
            qpe = own + (by_constant * constant + by_linear * linear)
            cubic = own_cubic + (cubic_by_constant * constant + cubic_by_linear * linear)
            # What is left of terms that cancel exactly is rounding, and would make a limit out of nothing.
            if abs(qpe) <= ROUNDING * abs(own):
                qpe = 0.0
            if abs(cubic) <= ROUNDING * abs(own_cubic):
                cubic = 0.0
            effects.append(Effect._make((constant, linear, qpe, cubic)))
        return effects

    @property
    def range_gradient(self) -> float:
        """Length of the range gradient on the ground. [m/m]"""
        (_, b), (_, d) = self.plane.adjugate
        return math.hypot(b, d)

    @property
    def gradient_sine(self) -> float:
        """Sine of the angle from range to Doppler gradient on the ground, signed. [-]"""
        (a, _), (c, _) = self.plane.adjugate
        return self.plane.determinant / (self.range_gradient * math.hypot(a, c))

    def quadratic_phases(self, rows: Iterable[tuple[float, ...]]) -> list[float]:
        """Those of `effective` alone, for a point of the scene among many. [rad/unit]"""
        by_constant, by_linear = self.quadratic
        return [
            qpe if abs(qpe := own + (by_constant * constant + by_linear * linear)) > ROUNDING * abs(own) else 0.0
            for constant, linear, own, _ in rows
        ]

    def moved(self, effect: Effect) -> float:
        """Quadratic phase that the displacement of the image adds, within that of the effect. [rad/unit]"""
        return self.quadratic[0] * effect.constant + self.quadratic[1] * effect.linear


def _look_series(state: PlatformState) -> tuple[tuple[float, ...], ...]:
    return evaluators.look_series(*state.position, *state.velocity, *state.acceleration, state.slant_range)


def full_ground(mission: Mission, geometry: BistaticGeometry) -> FullGround:
    """Invert the true Q, whose inverse exists wherever a mission is accepted."""
    looks = tuple(_look_series(state) for state in (geometry.transmitter, geometry.receiver))
    sums = [t[axis] + r[axis] for t, r in zip(*looks, strict=True) for axis in (0, 1)]
    first, second, (determinant,), quadratic, cubic = evaluators.full_ground(
        *(*sums, mission.radar.wavelength, mission.collection.aperture_time)
    )

    def per_term(per_metre: tuple[float, ...]) -> tuple[float, float]:
        east, north = per_metre
        constant, linear = (east * a + north * b for a, b in zip(first, second, strict=True))
        return (constant / determinant, linear / determinant)

    return FullGround(looks, ImagePlane((first, second), determinant, ""), per_term(quadratic), per_term(cubic))


def image_plane(geometry: BistaticGeometry) -> ImagePlane:
    """Invert Q with the range held constant, (19) and (30).

    That Q can be singular where the true gradients are not: its second row is v/R, theirs v⊥/R.
    """
    ground = []
    for platform in (geometry.transmitter, geometry.receiver):
        ground += [*platform.position[:2], *platform.velocity[:2], platform.slant_range]
    first, second, (determinant,) = evaluators.published_ground_inverse(*ground)
    # (30): the first column holds (-rate_y, rate_x), the second (s_y, -s_x).
    range_gradient, doppler_gradient = (-second[1], first[1]), (second[0], -first[0])
    degrees = math.degrees(angle_between_lines(range_gradient, doppler_gradient))
    degeneracy = ""
    if degrees < MIN_GRADIENT_ANGLE_DEG:
        degeneracy = (
            f"(25) has no displacement here: with the range held constant, range and Doppler gradients are "
            f"{degrees:.2g} deg from parallel"
        )
    return ImagePlane((first, second), determinant, degeneracy)
