"""What the declared errors of many cases do, by both models: the arrays beside `sources` and `models`."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bisar_budget import evaluators
from bisar_budget.constants import MIN_GRADIENT_ANGLE_DEG, ROUNDING, SPEED_OF_LIGHT
from bisar_budget.effects import models
from bisar_budget.effects.collections import Geometries, angle_between_lines, axes_of
from bisar_budget.effects.combined import squared
from bisar_budget.effects.effect import CLOCK_UNITS, MOTION_UNITS, PLATFORMS
from bisar_budget.effects.models import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.subject import MOTION, Subject, subject
from bisar_budget.geometry import FRAME_AXES
from bisar_budget.mission.model import Mission
from bisar_budget.ranges.exact_ranges import Effects, ExactRanges, Floats, Lanes, Places, Truths, Vectors, joined
from bisar_budget.ranges.point_paths import Held, PointPaths

if TYPE_CHECKING:
    from bisar_budget.mission.covariance import Covariance

SAFE = 1 + 1e-6  # nearer to a border of what forms an image, a case is checked by itself
_AXES: tuple[Vectors, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_NOWHERE: Vectors = (0.0, 0.0, 0.0)


class ManyErrors(NamedTuple):
    """One error of many cases; `moves` are the places of the platforms that it moves.

    One that `is_shown_again` stands along axes that the file does not state it in, and counts nowhere.
    """

    subject: Subject
    unit: str
    declared: Any  # None: not stated
    effect: Effects
    full: Effects
    moves: tuple[int, ...]
    direction: Vectors
    is_shown_again: bool = False

    @property
    def is_covered(self) -> bool:
        """Whether the coverage factor is in what is declared."""
        return self.subject.kind in (*MOTION, "timing")

    @property
    def is_motion(self) -> bool:
        """Whether it moves platforms, or the clock."""
        return self.unit != "rad"


class Does(NamedTuple):
    """What a declared error does in each case, as `models.Declared`; displacements are NaN where there is none."""

    qpe: Floats
    cubic: Floats
    displacement: tuple[Floats, Floats]
    opposite: tuple[Floats, Floats]

    @property
    def farthest(self) -> tuple[Floats, Floats]:
        """Displacement by the sign that moves farther, turned to the declared one's side. [m]"""
        (x, y), (u, v) = self.displacement, self.opposite
        is_ahead = np.hypot(x, y) >= np.hypot(u, v)
        return np.where(is_ahead, x, -u), np.where(is_ahead, y, -v)


class DeclaredErrors:
    """The errors of cases that need the same number of nodes: what they are, and what each does.

    `listed` are those that are declared, and those whose allowable is asked; `stated` the declared ones.
    `is_left_out` grows by the cases in which something is not certain.
    """

    def __init__(
        self, mission: Mission, cases: int, nodes: int, geometries: Geometries, shown: Mapping[str, Subject]
    ) -> None:
        self.mission, self.cases, self.geometries, self.shown = mission, cases, geometries, shown
        self.is_left_out = np.zeros(cases, dtype=bool)
        self.each = np.arange(cases)
        wavelength, T = mission.radar.wavelength, mission.collection.aperture_time
        self.has_direct_path = mission.has_direct_path
        self.exact = ExactRanges.of(
            geometries.both, wavelength, T, nodes, cases, has_direct_path=self.has_direct_path
        )
        self.plane = self._published_plane()
        self._limits_of_size()
        self.listed = list(self._errors())
        self.stated = [error for error in self.listed if error.declared is not None and not error.is_shown_again]
        self._known: dict[tuple[str, str], Does] = {}
        self._quadratics: dict[str, Floats] = {}
        self._paths: dict[str, PointPaths] = {}

    def array(self, value: Any) -> Floats:
        """One number for each case."""
        found: Floats = np.array(np.broadcast_to(np.asarray(value, dtype=float), (self.cases,)))
        return found

    def _published_plane(self) -> tuple[Any, Any, Any]:
        ground: list[Any] = []
        for path in (self.geometries.transmitter, self.geometries.receiver):
            ground += [*path.position[:2], *path.velocity[:2], path.slant_range]
        first, second, (determinant,) = evaluators.published_ground_inverse(*ground)
        angle = angle_between_lines((-second[1], first[1]), (second[0], -first[0]))
        is_degenerate = np.degrees(angle) < MIN_GRADIENT_ANGLE_DEG * SAFE
        if self.mission.gating_model != "full":
            self.is_left_out |= is_degenerate
        return first, second, np.where(is_degenerate, math.inf, determinant)  # no displacement that casts a doubt

    def _errors(self) -> Iterator[ManyErrors]:
        """Every error that is declared, or whose allowable is asked."""
        mission, T = self.mission, self.mission.collection.aperture_time
        wavelength, factor = mission.radar.wavelength, mission.allocation.coverage_factor
        legs: dict[tuple[int, str], tuple[list[Effects], list[Effects]]] = {}
        up: list[tuple[Effects, Effects]] = []
        paths = (self.geometries.transmitter, self.geometries.receiver)
        for place, (name, path) in enumerate(zip(PLATFORMS, paths, strict=True)):
            rows = evaluators.published_motion(*path.position, *path.velocity, path.slant_range, wavelength, T)
            error = getattr(mission.platforms, name).motion_error
            axes = axes_of(mission, name, path)
            for index, (kind, unit) in enumerate(MOTION_UNITS.items()):
                covariance = error.covariance if kind != "acceleration" else None
                values = error.stated(kind)
                own = [subject(name, kind, letter) for letter in "xyz"]
                asked = [one.id in self.shown for one in own]
                common = mission.common_motion_error is not None and (
                    getattr(mission.common_motion_error, kind) is not None
                    or any(subject("mission", kind, letter).id in self.shown for letter in "xyz")
                )
                is_terrain = kind == "position" and mission.scene.height_error is not None
                if values is None and not any(asked) and not common and not is_terrain:
                    continue
                published = [Effects._make(row) for row in rows[3 * index : 3 * index + 3]]
                powers = self.exact.powers[unit]
                full = [self.exact.effect(self.exact.along(place, axis) * powers) for axis in _AXES]
                legs[place, kind] = (published, full)
                if is_terrain:
                    up.append((published[2], full[2]))
                if error.frame == "scene":
                    for axis in range(3):
                        if values is not None or asked[axis]:
                            declared = None if values is None else values[axis] * factor
                            yield ManyErrors(
                                own[axis], unit, declared, published[axis], full[axis], (place,), _AXES[axis]
                            )
                    continue
                for axis in range(3):
                    if asked[axis]:
                        on_axis = None
                        if covariance is not None:
                            along = [direction[axis] for direction in axes]
                            on_axis = factor * _along_covariance(covariance, kind, along)
                        elif values is not None:
                            on_axis = factor * _along_scene_axis(values, axes, axis, error.distribution)
                        yield ManyErrors(
                            own[axis],
                            unit,
                            on_axis,
                            published[axis],
                            full[axis],
                            (place,),
                            _AXES[axis],
                            is_shown_again=True,
                        )
                if values is None:
                    continue
                for axis_name, direction, value in zip(FRAME_AXES[error.frame], axes, values, strict=True):
                    yield ManyErrors(
                        subject(name, kind, axis_name, error.frame),
                        unit,
                        value * factor,
                        _along(published, direction),
                        _along(full, direction),
                        (place,),
                        direction,
                    )
        yield from self._of_clock(factor)
        if mission.common_motion_error is not None:
            yield from self._common(legs, factor)
        if mission.scene.height_error is not None:
            published_up, full_up = (
                Effects._make(map(sum, zip(*both, strict=True))) for both in zip(*up, strict=True)
            )
            what = subject("mission", "terrain")
            yield ManyErrors(what, "m", mission.scene.height_error, published_up, full_up, (0, 1), _AXES[2])
        one = Effects(0.0, 0.0, 1.0, 0.0)
        for other in mission.other_errors:
            what = subject("mission", "other", other.name)
            yield ManyErrors(what, "rad", other.quadratic_phase_error, one, one, (), _NOWHERE)

    def _of_clock(self, factor: Any) -> Iterator[ManyErrors]:
        rows = evaluators.published_clock(
            SPEED_OF_LIGHT, self.mission.radar.wavelength, self.mission.collection.aperture_time
        )
        for power, (term, unit) in enumerate(CLOCK_UNITS.items()):
            value, what = getattr(self.mission.timing_error, term), subject("clock", "timing", term)
            if value is not None or what.id in self.shown:
                declared = None if value is None else value * factor
                full = self.exact.effect(self._clock_course(unit))
                yield ManyErrors(what, unit, declared, Effects._make(rows[power]), full, (), _NOWHERE)

    def _common(
        self, legs: Mapping[tuple[int, str], tuple[list[Effects], list[Effects]]], factor: Any
    ) -> Iterator[ManyErrors]:
        for kind, unit in MOTION_UNITS.items():
            values = getattr(self.mission.common_motion_error, kind)
            for axis, letter in enumerate("xyz"):
                what = subject("mission", kind, letter)
                if values is None and what.id not in self.shown:
                    continue
                published, full = (
                    _sum([legs[place, kind][of_model][axis] for place in (0, 1)]) for of_model in (0, 1)
                )
                if kind == "position" and letter != "z":  # a shift of the scene
                    full = full._replace(qpe=0.0, cubic=0.0)
                declared = None if values is None else values[axis] * factor
                yield ManyErrors(what, unit, declared, published, full, (0, 1), _AXES[axis])

    # ---------------------------------------------------------------- what they do
    def _limits_of_size(self) -> None:
        """Bounds of what the second order adds, as `FullModel` has them."""
        exact = self.exact
        half = exact.half
        (a, b), (c, d) = ([element / exact.determinant for element in row] for row in exact.adjugate)
        (q_0, q_1), (c_0, c_1) = exact.phases_per_term
        self.edge = {"m": 1.0, "m/s": half, "m/s^2": half**2 / 2}
        self.per_metre = {
            LOCATION: np.hypot(a, c) + 1.5 / half * np.hypot(b, d),
            QUADRATIC: 2.5 * exact.k + np.abs(q_0) + 1.5 / half * np.abs(q_1),
            CUBIC: 4 * exact.k + np.abs(c_0) + 1.5 / half * np.abs(c_1),
        }

    def adds(self, error: ManyErrors, size: Any, requirement: str) -> Any:
        """Bound of what the second order adds to a phase [rad] or a displacement [m]; see `FullModel`."""
        own, moved = size * self.edge.get(error.unit, 0.0), size * self.per_unit("full", error, LOCATION)
        if self.has_direct_path and error.subject.owner in PLATFORMS:
            return self.per_metre[requirement] * self._adds_heard(error.moves[0], own, moved)
        return self.per_metre[requirement] * (own + moved) * (own + moved) / self.exact.nearest_node

    def _adds_heard(self, platform: int, own: Any, moved: Any) -> Any:
        """The same of the ranges less the direct path; see `FullModel`. [m]"""
        nearest = [ranges.min(axis=0) for ranges in self.exact.ranges]
        of_ranges = (own + moved) ** 2 / nearest[platform] + moved**2 / nearest[1 - platform]
        return np.maximum(of_ranges, own**2 / self.exact.baselines.min(axis=0)) / 2

    def per_unit(self, model: str, error: ManyErrors, requirement: str) -> Any:
        """What a small unit of an error does: magnitude of a phase [rad], or displacement [m]."""
        effect = error.full if model == "full" else error.effect
        if requirement == QUADRATIC:
            return np.abs(effect.qpe)
        if requirement == CUBIC:
            return np.abs(effect.cubic)
        return np.hypot(*self._displacement(model, error, 1.0))

    def _displacement(self, model: str, error: ManyErrors, size: Any) -> tuple[Any, Any]:
        if model == "full":
            return self.exact.displacement(error.full, size)
        (a, b), (c, d), determinant = self.plane
        effect, scale = error.effect, size / determinant
        return ((a * effect.constant + b * effect.linear) * scale, (c * effect.constant + d * effect.linear) * scale)

    def does(self, model: str, error: ManyErrors) -> Does:
        """What a declared error does by a model; cases in which that is not certain are left out."""
        key = (model, error.subject.id)
        if key not in self._known:
            self._known[key] = self._does(model, error)
        return self._known[key]

    def _does(self, model: str, error: ManyErrors) -> Does:
        size, effect = self.array(error.declared), error.full if model == "full" else error.effect
        qpe, cubic = self.array(effect.qpe * size), self.array(effect.cubic * size)
        if not error.is_motion:
            none = np.full(self.cases, math.nan)
            return Does(qpe, cubic, (none, none), (none, none))
        east, north = (self.array(part) for part in self._displacement(model, error, size))
        if model == "published":
            east, north = (np.where(np.isinf(self.plane[2]), math.nan, part) for part in (east, north))
        found = Does(qpe, cubic, (east, north), (-east, -north))
        if model == "published":
            return found
        some = np.flatnonzero(self.is_large(error))
        if some.size:
            self._exactly(error, found, size[some], some)
        return found

    def is_large(self, error: ManyErrors) -> Truths:
        """In which cases effects of a declared error are not proportional to its size; as `is_small`, negated."""
        size, found = np.abs(self.array(error.declared)), np.zeros(self.cases, dtype=bool)
        for requirement, floor in (
            (QUADRATIC, models.FLOOR_RAD),
            (CUBIC, models.FLOOR_RAD),
            (LOCATION, models.FLOOR_M),
        ):
            of_it = self.per_unit("full", error, requirement) * size
            found |= self.adds(error, size, requirement) > np.maximum(floor, models.SHARE * of_it)
        return np.asarray(found & (size != 0))

    def quadratic_by_sign(self, error: ManyErrors) -> Floats:
        """Quadratic phases of a declared error of each sign, positive first, where it is large, (2, cases). [rad]

        Not a number where it leaves no image.
        """
        self.does("full", error)
        return self._quadratics[error.subject.id]

    def _exactly(self, error: ManyErrors, found: Does, size: Floats, some: Places) -> None:
        """Put what exact ranges say into the cases that are too large for a first order."""
        paths, lanes, sizes = (
            self._paths_of(error),
            np.concatenate((some, some + self.cases)),
            np.tile(np.abs(size), 2),
        )
        paths.to(lanes, sizes)
        by_sign = paths.known(lanes, sizes).reshape(6, 2, -1).swapaxes(0, 1)
        quadratics = self._quadratics.setdefault(error.subject.id, np.full((2, self.cases), math.nan))
        quadratics[:, some] = by_sign[0][3], by_sign[1][3]
        ahead, back = np.where(size > 0, by_sign, by_sign[::-1])
        is_gone = np.isnan(ahead[0]) | np.isnan(back[0])  # no ground point: phases are infinite, none moves
        for kept, row in ((found.qpe, 3), (found.cubic, 4)):
            largest = np.copysign(np.maximum(np.abs(ahead[row]), np.abs(back[row])), kept[some])
            kept[some] = np.where(is_gone, math.inf, largest)
        for place, one in ((found.displacement, ahead), (found.opposite, back)):
            place[0][some], place[1][some] = np.where(is_gone, math.nan, one[1:3])

    def _paths_of(self, error: ManyErrors) -> PointPaths:
        """The ways of the point by an error, which all that asks for them shares: positive sign first."""
        name = error.subject.id
        if name not in self._paths:
            lanes = joined([self.lanes(error, sign) for sign in (1.0, -1.0)])
            both = [self.exact.displacement(error.full, sign) for sign in (1.0, -1.0)]
            per_unit = np.array([[self.array(part) for part in one] for one in both])
            self._paths[name] = PointPaths(self.exact, lanes, np.concatenate(per_unit, axis=1))
        return self._paths[name]

    def lanes(self, error: ManyErrors, sign: float = 1.0) -> Lanes:
        """A unit of an error, with a sign, in each case."""
        if not error.moves:
            return Lanes(self.each, sign * self._clock_course(error.unit))
        moves = (float(0 in error.moves), float(1 in error.moves))
        return Lanes(self.each, sign * self.exact.powers[error.unit], moves, error.direction, error.unit)

    def _clock_course(self, unit: str) -> Floats:
        """Range error of a unit of a clock error at the nodes; nothing where the direct path is the clock."""
        power = list(CLOCK_UNITS.values()).index(unit)
        metres: Floats = SPEED_OF_LIGHT * self.exact.times**power
        return metres * 0.0 if self.has_direct_path else metres

    def doubts(self, model: str, is_over: Any) -> Any:
        """Where a model that does not gate casts a doubt; the published one does not know a direct path."""
        return False if model == "published" and self.has_direct_path else is_over

    def is_heard_out(self, error: ManyErrors) -> bool:
        """Whether an error is one of a clock that the direct path stands in for."""
        return self.has_direct_path and error.is_motion and not error.moves

    def forget(self, error: ManyErrors) -> None:
        """Let go of the ways by an error that nobody will ask for again: they are large."""
        self._paths.pop(error.subject.id, None)

    def first_reaching(
        self, error: ManyErrors, requirement: str, limit: Floats, first: Floats, farthest: Floats, some: Places
    ) -> Floats:
        """Smallest size, of either sign, at which an error of some cases reaches a limit; infinite: none does.

        `limit`, what the search looks at `first`, and the `farthest` size are (cases,); found are (some,).
        """
        signed = {QUADRATIC: error.full.qpe, CUBIC: error.full.cubic}.get(requirement)
        slope = self.array(self.per_unit("full", error, LOCATION) if signed is None else signed)[some]
        held = Held(models.HELD[requirement], limit[some], slope)
        both = (some, some + self.cases)
        return self._paths_of(error).either_reaching(both, held, first[some], farthest[some])

    def ends_image(self, error: ManyErrors, size: Floats) -> Truths:
        """Whether allowables, as found, are where the image ends; as `FullModel.ends_image`."""
        paths = self._paths.get(error.subject.id)
        if paths is None:
            return np.zeros(self.cases, dtype=bool)
        return np.asarray((paths.end.reshape(2, -1) == size).any(axis=0))

    def farthest(self, error: ManyErrors) -> Any:
        """Size beyond which an error is none of navigation; infinite: it has no effect whatever its size."""
        if self.is_heard_out(error):
            return math.inf
        slant = [path.slant_range for path in (self.geometries.transmitter, self.geometries.receiver)]
        if not error.moves:
            return models.FARTHEST * np.minimum(*slant) / np.abs(self._clock_course(error.unit)).max(axis=0)
        reached = [slant[place] for place in error.moves]
        return models.FARTHEST * (np.minimum(*reached) if len(reached) > 1 else reached[0]) / self.edge[error.unit]


def _along_scene_axis(
    declared: Sequence[Any], axes: tuple[Vectors, Vectors, Vectors], axis: int, distribution: str
) -> Any:
    """Size along one axis of the scene of errors along those of another frame; as `sources` has it."""
    parts = [value * direction[axis] for value, direction in zip(declared, axes, strict=True)]
    if distribution == "normal":
        size = np.sqrt(parts[0] ** 2 + parts[1] ** 2 + parts[2] ** 2)
    else:
        size = np.abs(parts[0]) + np.abs(parts[1]) + np.abs(parts[2])
    return np.copysign(size, parts[0] + parts[1] + parts[2])


def _along_covariance(covariance: "Covariance", kind: str, direction: Sequence[Any]) -> Any:
    """Sigma of position or velocity error along a direction given in the frame's axes; as `Covariance.along`."""
    parts = [sigma * along for sigma, along in zip(covariance.of(kind), direction, strict=True)]
    return np.sqrt(squared(covariance.block(kind), parts))


def _along(effects: Sequence[Effects], direction: Vectors) -> Effects:
    """Effect of a unit error along a direction, without what rounding leaves."""
    found = []
    for parts in zip(*effects, strict=True):
        terms = [part * way for part, way in zip(parts, direction, strict=True)]
        total = terms[0] + terms[1] + terms[2]
        seen = np.abs(terms[0]) + np.abs(terms[1]) + np.abs(terms[2])
        found.append(np.where(np.abs(total) > ROUNDING * seen, total, 0.0))
    return Effects._make(found)


def _sum(effects: Sequence[Effects]) -> Effects:
    found = []
    for a, b in zip(*effects, strict=True):
        found.append(np.where(np.abs(a + b) > ROUNDING * (np.abs(a) + np.abs(b)), a + b, 0.0))
    return Effects._make(found)
