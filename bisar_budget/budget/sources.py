"""Every error a mission can have, with what one unit of it does to the range history and the image.

The list is complete: an error that the file does not declare is in it too, because a designer comes for its
allowable. Effects are those of the published model (Rigling & Moses, Tables I and II) and of the full one, which
lets the line of sight turn and counts what the displacement of the image adds.
"""

import math
from collections.abc import Iterable, Iterator
from functools import cache
from itertools import chain
from typing import NamedTuple

from bisar_budget import evaluators
from bisar_budget.constants import MIN_GRADIENT_ANGLE_DEG, ROUNDING, SPEED_OF_LIGHT
from bisar_budget.errors import KeyPath
from bisar_budget.geometry import (
    FRAME_AXES,
    BistaticGeometry,
    GroundVector,
    PlatformState,
    Vector,
    angle_between_lines,
)
from bisar_budget.mission.model import Mission, MotionError

PLATFORMS = ("transmitter", "receiver")
MOTION_UNITS = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}
_AXES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_NOWHERE: Vector = (0.0, 0.0, 0.0)
CLOCK_UNITS = {"constant": "s", "linear": "s/s", "quadratic": "1/s", "cubic": "1/s^2"}


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
        return self.direction != _NOWHERE

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


def error_sources(
    mission: Mission, geometry: BistaticGeometry, ground: FullGround | None = None
) -> list[ErrorSource]:
    """List every position, velocity, acceleration, clock and other error, declared or not, in a fixed order."""
    sources: list[ErrorSource] = []
    ground = ground or full_ground(mission, geometry)
    states = (geometry.transmitter, geometry.receiver)
    for name, state, look in zip(PLATFORMS, states, ground.looks, strict=True):
        sources += _motion(mission, name, state, look, ground)
    sources += _clock(mission, ground)
    if mission.common_motion_error is not None:
        from bisar_budget.budget.common import common_sources  # most missions do without

        sources += common_sources(mission, sources)
    sources += _terrain(mission, sources)
    sources += _other(mission)
    return sources


def _motion(
    mission: Mission, name: str, state: PlatformState, look: tuple[tuple[float, ...], ...], ground: FullGround
) -> Iterator[ErrorSource]:
    wavelength, T = mission.radar.wavelength, mission.collection.aperture_time
    rows = evaluators.published_motion(*state.position, *state.velocity, state.slant_range, wavelength, T)
    full_effects = ground.effective(evaluators.full_motion(*(*chain.from_iterable(look), wavelength, T)))
    error: MotionError = getattr(mission.platforms, name).motion_error
    factor = mission.allocation.coverage_factor
    in_scene = error.frame == "scene"
    axes = state.frame(error.frame)
    for kind_index, (kind, unit) in enumerate(MOTION_UNITS.items()):
        of_kind = slice(3 * kind_index, 3 * kind_index + 3)
        effects, full = list(map(Effect._make, rows[of_kind])), full_effects[of_kind]
        covariance = error.covariance if kind != "acceleration" else None
        values: Vector | None = getattr(error, kind) if covariance is None else covariance.of(kind)
        declared = None if values is None else tuple([value * factor for value in values])
        path: KeyPath = ("platforms", name, "motion_error", kind if covariance is None else "covariance")
        for axis, (row_id, own_path, equation, no_limit) in enumerate(_scene_axes(name, kind)):
            on_axis = None
            if declared is not None:
                if in_scene:
                    on_axis = declared[axis]
                elif covariance is None:
                    on_axis = _along_scene_axis(declared, axes, axis, error.distribution)
                else:
                    on_axis = factor * covariance.along(kind, [direction[axis] for direction in axes])
            if covariance is not None:
                own_path = (*path, *covariance.path(kind, axis))
            yield ErrorSource._make(  # twice as quick as by keyword, and there are 18 in every mission
                (
                    row_id,
                    name,
                    unit,
                    on_axis,
                    own_path if in_scene and declared is not None else path,
                    effects[axis],
                    full[axis],
                    _AXES[axis],
                    equation,
                    no_limit,
                    error.source,
                    in_scene,
                    (),
                )
            )
        if in_scene or declared is None:
            continue
        for index, (axis_name, direction) in enumerate(zip(FRAME_AXES[error.frame], axes, strict=True)):
            yield ErrorSource(
                id=f"{name}.{kind}.{axis_name}",
                owner=name,
                unit=unit,
                declared=declared[index],
                path=(*path, *((index,) if covariance is None else covariance.path(kind, index))),
                effect=_along(effects, direction),
                full=_along(full, direction),
                direction=direction,
                equation=_equation(kind, None),
                no_limit=_no_limit(kind, f"the {error.frame} frame's {axis_name} axis"),
                evidence=error.source,
            )


@cache
def _scene_axes(name: str, kind: str) -> tuple[tuple[str, KeyPath, str, str], ...]:
    """Row id, path in the file, equation and reason for no limit, along each axis of the scene."""
    return tuple(
        (
            f"{name}.{kind}.{letter}",
            ("platforms", name, "motion_error", kind, axis),
            _equation(kind, axis),
            _no_limit(kind, letter),
        )
        for axis, letter in enumerate("xyz")
    )


def _along_scene_axis(
    declared: tuple[float, ...], axes: tuple[Vector, Vector, Vector], axis: int, distribution: str
) -> float:
    """Size along one axis of the scene of errors stated along the axes of another frame.

    The three are independent, so one-sigma values add as squares and bounds add as magnitudes: a signed
    rotation would let them cancel. The sign is that of the signed rotation.
    """
    parts = [value * direction[axis] for value, direction in zip(declared, axes, strict=True)]
    size = math.hypot(*parts) if distribution == "normal" else sum(abs(part) for part in parts)
    return math.copysign(size, sum(parts))


def _along(effects: list[Effect], direction: Vector) -> Effect:
    """Effect of a unit error along a direction: the projection of the three scene effects."""
    u, v, w = direction
    # What is left of terms that cancel exactly is rounding, and would make a limit out of nothing.
    return Effect._make(
        [
            term if abs(term := a * u + b * v + c * w) > ROUNDING * (abs(a * u) + abs(b * v) + abs(c * w)) else 0.0
            for a, b, c in zip(*effects, strict=True)
        ]
    )


def _equation(kind: str, axis: int | None) -> str:
    if kind == "position":
        return "Table I" if axis is None else f"Table I row {2 + 3 * axis}"
    first = 1 if kind == "velocity" else 4
    return f"Table II rows {first}-{first + 2}" if axis is None else f"Table II row {first + axis}"


def _no_limit(kind: str, axis: str) -> str:
    """Say why an error has no QPE limit, for the case that it has none."""
    if kind == "position":
        return "no quadratic term: a position error moves the image (Table I)"
    cause = "velocity" if kind == "velocity" else "line of sight"
    return f"no quadratic term: the platform's {cause} has no component along {axis}"


def _clock(mission: Mission, ground: FullGround) -> Iterator[ErrorSource]:
    rows = evaluators.published_clock(SPEED_OF_LIGHT, mission.radar.wavelength, mission.collection.aperture_time)
    for (term, unit), row, full in zip(CLOCK_UNITS.items(), rows, ground.effective(rows), strict=True):
        value: float | None = getattr(mission.timing_error, term)
        yield ErrorSource(
            id=f"timing.{term}",
            owner="clock",
            unit=unit,
            declared=None if value is None else value * mission.allocation.coverage_factor,
            path=("timing_error", term),
            effect=Effect._make(row),
            full=full,
            direction=_NOWHERE,
            equation="Table I row 1, step of Table II" if term == "quadratic" else "Table I row 1",
            no_limit=f"no quadratic term: the clock's {term} term has another order (Table I row 1)",
        )


def _terrain(mission: Mission, sources: list[ErrorSource]) -> Iterator[ErrorSource]:
    """A scene that is higher than the processor takes it for: both platforms measured too high by as much."""
    height = mission.scene.height_error
    if height is None:
        return
    up = [source for source in sources if source.id in ("transmitter.position.z", "receiver.position.z")]
    yield ErrorSource(
        id="mission.terrain",
        owner="mission",
        unit="m",
        declared=height,
        path=("scene", "height_error"),
        effect=Effect._make(map(sum, zip(*(source.effect for source in up), strict=True))),
        full=Effect._make(map(sum, zip(*(source.full for source in up), strict=True))),
        direction=_AXES[2],
        equation="full model",
        no_limit="no quadratic term: to the published model a height error moves the image",
        notes=("held to the total budget: it belongs to no platform",),
    )


def _other(mission: Mission) -> Iterator[ErrorSource]:
    for index, other in enumerate(mission.other_errors):
        yield ErrorSource(
            id=f"other.{other.name}",
            owner="mission",
            unit="rad",
            declared=other.quadratic_phase_error,
            path=("other_errors", index, "quadratic_phase_error"),
            effect=Effect(constant=0.0, linear=0.0, qpe=1.0, cubic=0.0),
            full=Effect(constant=0.0, linear=0.0, qpe=1.0, cubic=0.0),
            direction=_NOWHERE,
            equation="as declared",
            no_limit="",
            evidence=other.source,
            notes=("held to the total budget: it belongs to no platform",),
        )
