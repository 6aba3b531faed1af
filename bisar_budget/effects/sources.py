"""List of the signed errors that a mission can have, for one case or many. Random errors are in `random_errors`.

A check lists all errors, including the errors that the file does not declare, because a designer wants to know their
allowable sizes. A sweep lists only the declared errors, and the errors whose rows are requested.
"""

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from bisar_budget import evaluators, phrases
from bisar_budget.arrays import Floats, PerCase
from bisar_budget.constants import SPEED_OF_LIGHT_MPS, VECTOR_ROUNDING_FRACTION
from bisar_budget.effects.combined import squared
from bisar_budget.effects.effect import (
    NOWHERE,
    PLATFORMS,
    ErrorSource,
    Subject,
    override_notes,
    subject,
)
from bisar_budget.error_kinds.clock_kinds import FREQUENCY_KIND, OSCILLATOR_KIND, TIME_KIND, TIMING_KIND
from bisar_budget.error_kinds.kind import AS_STATED
from bisar_budget.error_kinds.path_kinds import POSITION_KIND, STATE_KINDS, TERRAIN_KIND, TIME_TAG_KIND, StateKind
from bisar_budget.error_kinds.random_kinds import OTHER_KIND
from bisar_budget.error_kinds.registry import MotionKind, kind_of
from bisar_budget.faults import KeyPath, MotionKindError
from bisar_budget.geometry import FRAME_AXES, BistaticGeometry, PlatformState, VectorArrays, Vectors, dot
from bisar_budget.image_plane import nodes_for
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.ranges.exact_ranges import Effect, ExactRanges, FullEffect

if TYPE_CHECKING:
    from bisar_budget.mission.covariance import Covariance

QUADRATIC_PHASE = "quadratic_phase_error"  # key of a stated phase
_BETWEEN_NODES = np.linspace(-1.0, 1.0, 65)  # slow times over half the aperture at which a stated motion is checked
_UNRESOLVED_FRACTION = 1e-3  # of a motion; the effects of the rest are as small a part of those of the motion
AnyEffect = TypeVar("AnyEffect", Effect, FullEffect)
AnyVector = TypeVar("AnyVector", VectorArrays, Vectors)
_UNIT_VECTORS: tuple[Vectors, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_PUBLISHED_UNIT = Effect(constant=0.0, linear=0.0, qpe=1.0, cubic=0.0)  # effect of a pure phase error
_FULL_UNIT = FullEffect(east=0.0, north=0.0, qpe=1.0, cubic=0.0)


def exact_ranges(
    mission: Mission, geometry: BistaticGeometry, count: int | None = None, cases: int = 1
) -> ExactRanges:
    """Exact ranges from the platforms of a mission's cases to the scene centres.

    `count` is the number of nodes over the aperture. If it is None, as many nodes are used as the paths of the
    platforms need. `cases` is the number of cases.
    """
    T, is_heard = mission.collection.aperture_time, mission.has_direct_path
    count = count or int(nodes_for(geometry, T, has_direct_path=is_heard))
    return ExactRanges.of(geometry.both, mission.radar, T, count, cases, has_direct_path=is_heard)


def distribution_of(mission: Mission, source: ErrorSource) -> str:
    """Name of the distribution of a declared error: `normal`, `uniform` or `bound`.

    If the size of the error (`ErrorSize.distribution`) does not determine the distribution, the file states it for
    the motion error of the platform, or for the motion error that both platforms share.
    """
    distribution = source.kind.size(source.subject.axis).distribution
    if distribution != AS_STATED:
        return distribution
    error = mission.common_motion_error
    if source.owner in PLATFORMS:
        error = getattr(mission.platforms, source.owner).motion_error
    assert error is not None
    return error.distribution_of(source.kind.name)


def _bias(biases: Mapping[str, PerCase | None], key: str) -> PerCase:
    """Bias of an error, 0 if the file states none."""
    bias = biases.get(key)
    return 0.0 if bias is None else bias


# The evaluators accept and return numbers, or arrays of cases.
_published_motion: Callable[..., tuple[tuple[PerCase, ...], ...]] = evaluators.published_motion


class _Flown(NamedTuple):
    """Effect of one unit of a motion error, and the motions it causes, if at least one platform is in free fall.

    `full` is the effect per unit of a small error in the full model. `shifts` [m/unit] are the position errors of
    both platforms over the aperture, three components (nodes, cases) each. `rates` [m/s/unit] are the velocities of
    these position errors at mid-aperture. They are given for a position error in the frame `ric`; for any other error
    `rates` is None.
    """

    full: FullEffect
    shifts: tuple[VectorArrays, VectorArrays]
    rates: tuple[Vectors, Vectors] | None


class ErrorListing:
    """List of the signed errors of a mission's cases, along the axes in which the file states them.

    `DeclaredErrors` describes the parameters.
    """

    def __init__(
        self, mission: Mission, geometry: BistaticGeometry, exact: ExactRanges, shown: Container[str] | None = None
    ) -> None:
        self.mission, self.geometry, self.exact, self.shown = mission, geometry, exact, shown
        self.factor = mission.allocation.coverage_factor
        self._full_legs: dict[tuple[int, int], list[FullEffect]] = {}

    def listed(self) -> Iterator[ErrorSource]:
        """Yield the signed errors in a fixed order.

        The errors of each platform's position, velocity and acceleration come first. Then follow the errors of the
        clocks, the errors that both platforms share, and the errors of time tags. Last are the errors of registered
        kinds, the error of the terrain, and the quadratic phases that the file states directly.
        """
        for platform_index, name in enumerate(PLATFORMS):
            for kind in STATE_KINDS:
                yield from self._of_motion(platform_index, name, kind)
        yield from self._of_clock()
        yield from self._of_both_platforms()
        yield from self._of_time_tags()
        yield from self._of_registered_kinds()
        yield from self._of_terrain()
        yield from self._stated_elsewhere()

    def _is_listed(self, row_subject: Subject, declared: object) -> bool:
        return declared is not None or self.shown is None or row_subject.id in self.shown

    @cached_property
    def _published(self) -> list[tuple[tuple[PerCase, ...], ...]]:
        wavelength, T = self.mission.radar.wavelength, self.mission.collection.aperture_time
        return [
            _published_motion(*path.position, *path.velocity, path.slant_range, wavelength, T)
            for path in self.geometry.both
        ]

    def published_legs(self, platform_index: int, kind: StateKind) -> list[Effect]:
        """Effects of a unit error of one platform along each of x, y and z in the published model.

        They follow from Tables I and II of Rigling & Moses.

        `kind` is the kind of the error: position, velocity or acceleration.
        """
        first = 3 * kind.order
        return [Effect._make(row) for row in self._published[platform_index][first : first + 3]]

    def full_legs(self, platform_index: int, kind: StateKind) -> list[FullEffect]:
        """Effects of a unit error of one platform along each of x, y and z in the full model.

        `kind` is the kind of the error: position, velocity or acceleration. The motion errors are the polynomials of
        equation (22) in Rigling & Moses. For a platform in free fall, `_flown` gives the effects.
        """
        if (platform_index, kind.order) not in self._full_legs:
            along = np.stack([self.exact.along(platform_index, axis) for axis in _UNIT_VECTORS])
            effects = self.exact.effect(along * self.exact.powers[kind.order])
            self._full_legs[platform_index, kind.order] = _of_each(effects)
        return self._full_legs[platform_index, kind.order]

    @cached_property
    def _motions(self) -> list[Any]:
        """Motion of each platform in free fall due to unit errors of its state, (3, 3, 3, nodes, cases). [m/unit]

        The first three axes are the kind of the error (position, velocity, acceleration), its direction (x, y, z),
        and the component of the motion. The list has None for a platform that is not in free fall.
        """
        exact = self.exact
        return [
            path.fall and path.fall.motions(path, exact.half, exact.sampling.places) for path in self.geometry.both
        ]

    def _falls(self, platforms: Iterable[int]) -> bool:
        """Whether any of the platforms with the given indices is in free fall."""
        return any(self._motions[platform_index] is not None for platform_index in platforms)

    def _flown(self, kind: StateKind, errors: Sequence[Mapping[int, Vectors]], frame: str) -> list[_Flown]:
        """Effects of motion errors, and the motions they cause, where at least one platform is in free fall.

        Parameters
        ----------
        kind : StateKind
            Kind of the errors.
        errors : sequence of mapping of int to Vectors
            For each error, its direction on each platform that has it, by the index of the platform.
        frame : str
            Frame in which the file states the errors.
        """
        shifts, rates = [dict[int, VectorArrays]() for _ in errors], [dict[int, Vectors]() for _ in errors]
        moved = np.zeros((len(errors), *self.exact.times.shape))
        for index, directions in enumerate(errors):
            for platform_index, direction in directions.items():
                path = self.geometry.both[platform_index]
                shift = kind.moved(path, self.exact.times, direction, frame, self._motions[platform_index])
                rates[index][platform_index] = kind.rate(path, direction, frame)
                shifts[index][platform_index] = shift
                moved[index] += self.exact.along(platform_index, shift)
        has_rates = kind.order == 0 and frame == "ric"
        return [
            _Flown(full, _of_both_platforms(shift), _of_both_platforms(rate) if has_rates else None)
            for full, shift, rate in zip(_of_each(self.exact.effect(moved)), shifts, rates, strict=True)
        ]

    def _of_motion(self, platform_index: int, name: str, kind: StateKind) -> Iterator[ErrorSource]:
        error: MotionError = getattr(self.mission.platforms, name).motion_error
        values, biases = error.stated(kind.name), error.bias_of(kind.name) or NOWHERE
        scene_rows = _scene_axes(name, kind)
        if not any(self._is_listed(row_subject, values) for row_subject, *_ in scene_rows):
            return
        in_scene = error.frame == "scene"
        published = self.published_legs(platform_index, kind)
        axes = self.geometry.both[platform_index].frame(error.frame)
        covariance = error.covariance if kind.has_covariance else None
        key = "covariance" if covariance is not None else error.key_of(kind.name)
        path: KeyPath = (*kind.section(name)[:-1], key)
        notes, evidence = override_notes(name, error.overridden, kind.name), error.evidence(kind.name)
        # Where the file states an error along other axes, its scene axes are listed only if all rows are.
        listed_axes = [
            axis
            for axis, (row_subject, *_) in enumerate(scene_rows)
            if self.shown is None or row_subject.id in self.shown or (in_scene and values is not None)
        ]
        falls = self._falls([platform_index])
        flown: list[_Flown] = []
        if falls:
            flown = self._flown(kind, [{platform_index: _UNIT_VECTORS[axis]} for axis in listed_axes], "scene")
        for index, axis in enumerate(listed_axes):
            row_subject, row_path, equation, no_limit = scene_rows[axis]
            on_axis: PerCase | None = None
            if values is not None:
                if in_scene:
                    on_axis = values[axis] * self.factor
                elif covariance is None:
                    on_axis = self.factor * _along_scene_axis(values, axes, axis, error.distribution_of(kind.name))
                else:
                    on_axis = self.factor * _along_covariance(
                        covariance, kind.name, [frame_axis[axis] for frame_axis in axes]
                    )
            if covariance is not None:
                row_path = (*path, *covariance.path(kind.name, axis))
            yield ErrorSource(
                subject=row_subject,
                unit=kind.unit,
                declared=on_axis,
                path=row_path if in_scene and values is not None and key != "sensor" else path,
                effect=published[axis],
                full=flown[index].full if falls else self.full_legs(platform_index, kind)[axis],
                direction=_UNIT_VECTORS[axis],
                equation=equation,
                no_limit=no_limit,
                evidence=evidence,
                is_independent=in_scene,
                notes=notes,
                shifts=flown[index].shifts if falls else None,
                bias=biases[axis] if in_scene else sum(b * way[axis] for b, way in zip(biases, axes, strict=True)),
            )
        if in_scene or values is None:
            return
        if falls:
            flown = self._flown(kind, [{platform_index: direction} for direction in axes], error.frame)
        for index, (axis_name, direction) in enumerate(zip(FRAME_AXES[error.frame], axes, strict=True)):
            yield ErrorSource(
                subject=subject(name, kind.name, axis_name, error.frame),
                unit=kind.unit,
                declared=values[index] * self.factor,
                path=(*path, *((index,) if covariance is None else covariance.path(kind.name, index))),
                effect=_along(published, direction),
                full=flown[index].full if falls else _along(self.full_legs(platform_index, kind), direction),
                direction=direction,
                equation=_equation(kind, None),
                no_limit=_no_limit(kind, _axis_of(error.frame, axis_name)),
                evidence=evidence,
                notes=notes,
                shifts=flown[index].shifts if falls else None,
                rates=flown[index].rates if falls else None,
                bias=biases[index],
            )

    def _of_clock(self) -> Iterator[ErrorSource]:
        """Yield the errors of the clocks: terms of the clock error, errors that remain after a setting, and aging.

        With a direct path, the terms of the clock error have no effect in the full model.
        """
        sync, is_heard = self.mission.synchronization, not self.mission.has_direct_path
        is_set = sync is not None and sync.is_holdover
        for power, term in enumerate(TIMING_KIND.sizes):
            timing, row_subject = self.mission.timing_error, subject("clock", TIMING_KIND.name, term)
            value = getattr(timing, term)
            if self._is_listed(row_subject, value) and not (is_set and power < 2):  # `_of_setting` lists these
                no_limit = (
                    phrases.note("no-quadratic-term-of-clock", term=term)
                    if is_heard
                    else phrases.note("clock-is-heard")
                )
                terms = TIMING_KIND.clock_size(term).terms()
                error = self._of_terms(row_subject, value, terms, no_limit, is_heard=is_heard)
                yield error._replace(bias=_bias(timing.bias, term))
        yield from self._of_setting()
        for name in PLATFORMS:
            yield from self._of_aging(name)

    def _of_terms(
        self,
        row_subject: Subject,
        value: PerCase | None,
        terms: tuple[PerCase, ...],
        no_limit: Note,
        evidence: str | None = None,
        is_heard: bool = True,
    ) -> ErrorSource:
        """Create a clock error, one unit of which is the time error t̃₀ + t̃₁τ + t̃₂τ² + t̃₃τ³.

        `terms` are the coefficients t̃₀ … t̃₃. `value` is the declared size without the coverage factor; None if the
        file declares no size. `is_heard` tells whether the error appears in the radar data. If it does not, it has no
        effect in the full model. The published model always includes it.
        """
        clock = terms if is_heard else (0.0,) * 4
        wavelength, T = self.mission.radar.wavelength, self.mission.collection.aperture_time
        rows = evaluators.published_clock(SPEED_OF_LIGHT_MPS, wavelength, T)
        of_terms = (
            [term * per_term for per_term in row] for term, row in zip(terms, rows, strict=True) if np.any(term)
        )
        kind, size = row_subject.source_kind, row_subject.source_kind.size(row_subject.axis)
        return ErrorSource(
            subject=row_subject,
            unit=size.unit,
            declared=None if value is None else value * self.factor,
            path=kind.path(row_subject.owner, row_subject.axis),
            effect=Effect._make(map(sum, zip((0.0,) * 4, *of_terms, strict=True))),
            full=self.exact.effect(self.exact.clock_course(clock)),
            direction=NOWHERE,
            equation=size.equation,
            no_limit=no_limit,
            evidence=evidence,
            clock=clock,
        )

    def _of_setting(self) -> Iterator[ErrorSource]:
        """Yield the errors of time and frequency that remain after the clocks are set.

        If the clocks run free after the setting (`holdover`), the errors are listed even if the file does not declare
        them.
        """
        sync = self.mission.synchronization
        if sync is None:
            return
        age = sync.age if sync.is_holdover and sync.age is not None else 0.0
        for kind, value in ((TIME_KIND, sync.time_error), (FREQUENCY_KIND, sync.frequency_error)):
            row_subject, size = subject("clock", kind.name), kind.clock_size()
            if value is not None or (sync.is_holdover and self._is_listed(row_subject, value)):
                terms = self._delay_of_the_echo if size.order and sync.is_direct_path else size.terms(age)
                no_limit = phrases.note("no-quadratic-term-of-setting", kind=kind.name)
                yield self._of_terms(row_subject, value, terms, no_limit, evidence=sync.source)

    @property
    def _delay_of_the_echo(self) -> tuple[PerCase, ...]:
        """Delay of the echo after the direct signal, as coefficients of a cubic polynomial in slow time. [s, s/s, …]

        A clock with a frequency error measures this delay with a proportional error.
        """
        exact = self.exact
        seconds = (sum(exact.ranges) - exact.baselines) / SPEED_OF_LIGHT_MPS
        powers = np.vander(exact.sampling.places, 4, increasing=True)
        return tuple(
            coefficient / exact.half**power
            for power, coefficient in enumerate(np.linalg.lstsq(powers, seconds, rcond=None)[0])
        )

    def _of_aging(self, name: str) -> Iterator[ErrorSource]:
        """Yield the error due to a frequency drift D [1/s] of an oscillator: a time error of D·(H + τ)²/2. [s]

        H is the time from the setting of the clocks to mid-aperture. If H is not known, only the quadratic term is
        known, and the location is not judged. A synchronization link removes all of the drift.
        """
        oscillator, sync = getattr(self.mission.platforms, name).oscillator, self.mission.synchronization
        if oscillator is None:
            return
        row_subject, value = subject(name, OSCILLATOR_KIND.name, "aging"), oscillator.aging
        is_set, age = sync is not None and sync.is_holdover, 0.0 if sync is None or sync.age is None else sync.age
        if value is None and not (is_set and self._is_listed(row_subject, value)):
            return
        terms = OSCILLATOR_KIND.clock_size("aging").terms(age)
        if not is_set:
            terms = (0.0, 0.0, terms[2] * (sync is None), 0.0)
        no_limit = (
            phrases.note("aging-is-followed")
            if sync is not None
            else phrases.note("no-quadratic-term-of-clock", term="quadratic")
        )
        yield self._of_terms(
            row_subject,
            value,
            terms,
            no_limit,
            evidence=dict(oscillator.of_parts).get("aging", oscillator.source),
        )

    def _of_both_platforms(self) -> Iterator[ErrorSource]:
        """Yield the errors that both platforms share.

        An error along an axis of the scene, such as a bias of one GNSS service, moves both measured paths by the same
        vector. An error along an axis of another frame moves each path along the axis of its own frame. The range
        error is linear in the errors, and so are Table I of Rigling & Moses and the full model. The common effect is
        therefore the sum of the effects of both platforms, with their signs.
        """
        error = self.mission.common_motion_error
        if error is None:
            return
        in_scene, names = error.frame == "scene", FRAME_AXES[error.frame]
        frames = [path.frame(error.frame) for path in self.geometry.both]
        falls = self._falls((0, 1))
        for kind in STATE_KINDS:
            values, biases = error.stated(kind.name), error.bias_of(kind.name) or NOWHERE
            for axis, name in enumerate(names):
                row_subject = subject("mission", kind.name, name, error.frame)
                if not self._is_listed(row_subject, values):
                    continue
                ways = [frame[axis] for frame in frames]
                published_legs = [self.published_legs(platform_index, kind) for platform_index in (0, 1)]
                published = self._of_both(published_legs, axis, None if in_scene else ways)
                flown: _Flown | None = None
                if falls:
                    (flown,) = self._flown(kind, [dict(enumerate(ways))], error.frame)
                    full = flown.full
                else:
                    full_legs = [self.full_legs(platform_index, kind) for platform_index in (0, 1)]
                    full = self._of_both(full_legs, axis, None if in_scene else ways)
                    if kind.order == 0 and name in ("x", "y"):
                        # A horizontal shift of both platforms is a shift of the scene: x̂ is the error itself, and β̃ₙ
                        # and ½s̈·x̂ cancel. The rest of a sum of rounded numbers would give a limit where none exists.
                        full = full._replace(qpe=0.0 * full.qpe, cubic=0.0 * full.cubic)
                no_limit = phrases.note("no-quadratic-term-of-position")
                if kind.defocusing_vectors:
                    _, vectors = kind.defocusing_vectors
                    no_limit = phrases.note(
                        "no-common-component", cause=vectors, axis=name if in_scene else _axis_of(error.frame, name)
                    )
                yield ErrorSource(
                    subject=row_subject,
                    unit=kind.unit,
                    declared=None if values is None else values[axis] * self.factor,
                    path=kind.path("mission", index=axis),
                    effect=published,
                    full=full,
                    direction=ways[0],
                    equation=f"{_equation(kind, axis if in_scene else None)}, both platforms",
                    no_limit=no_limit,
                    evidence=error.source,
                    notes=(phrases.note("held-to-the-total", owners="both platforms"),),
                    of_receiver=None if in_scene else ways[1],
                    shifts=flown and flown.shifts,
                    rates=flown and flown.rates,
                    bias=biases[axis],
                )

    @staticmethod
    def _of_both(legs: Sequence[Sequence[AnyEffect]], axis: int, ways: Sequence[Vectors] | None) -> AnyEffect:
        """Effect of a unit error that both platforms share, from the effects for each platform along x, y and z.

        `legs` has the three effects of each platform. `axis` is the index of the scene axis along which the error
        acts. If `ways` is given, it has the direction of the error for each platform, and `axis` is not used.
        """
        if ways is None:
            return _sum([effects[axis] for effects in legs])
        return _sum([_along(effects, way) for effects, way in zip(legs, ways, strict=True)])

    def _of_time_tags(self) -> Iterator[ErrorSource]:
        """Yield the errors of navigation time relative to radar time, for each platform and for both in common.

        With a time-tag error δt, the position is measured too late by δt. The position error is then p(τ + δt) −
        p(τ), where p is the path. For a small δt it is v(τ)·δt, where v is the velocity. For a larger δt, exact
        ranges use the path itself.
        """
        for platform_index, name in enumerate(PLATFORMS):
            error: MotionError = getattr(self.mission.platforms, name).motion_error
            if error.time_tag is not None:
                tag = self._of_time_tag(name, (platform_index,), error.time_tag, error.source)
                yield tag._replace(bias=_bias(error.bias, TIME_TAG_KIND.name))
        common = self.mission.common_motion_error
        if common is not None and common.time_tag is not None:
            note = phrases.note("held-to-the-total", owners="both platforms")
            tag = self._of_time_tag("mission", (0, 1), common.time_tag, common.source, note)
            yield tag._replace(bias=_bias(common.bias, TIME_TAG_KIND.name))

    def _of_time_tag(
        self,
        owner: str,
        platform_indices: Sequence[int],
        value: PerCase,
        source: str | None,
        *notes: Note,
    ) -> ErrorSource:
        kind = TIME_TAG_KIND
        ways = [kind.moved(path, self.exact.times) for path in self.geometry.both]
        moved = np.sum(
            [self.exact.along(platform_index, ways[platform_index]) for platform_index in platform_indices], axis=0
        )
        effects = [
            _along(self.published_legs(platform_index, state), vector)
            for platform_index in platform_indices
            for state, vector in zip(STATE_KINDS, self.geometry.both[platform_index].rates, strict=False)
        ]
        return ErrorSource(
            subject=subject(owner, kind.name),
            unit=kind.unit,
            declared=value * self.factor,
            path=kind.path(owner),
            effect=_sum(effects),
            full=self.exact.effect(moved),
            direction=ways[platform_indices[0]],
            equation=kind.size().equation,
            no_limit=phrases.note("no-quadratic-term-of-time-tag"),
            evidence=source,
            notes=notes,
            of_receiver=ways[1] if len(platform_indices) > 1 else None,
        )

    def _of_registered_kinds(self) -> Iterator[ErrorSource]:
        """Yield the errors of registered kinds, with the effects of the motion that each kind defines.

        A registered kind is a kind of motion error that another package adds. The published model projects the motion
        on the line of sight at mid-aperture, and uses the Legendre orders of the projection.
        """
        exact = self.exact
        for platform_index, name in enumerate(PLATFORMS):
            error: MotionError = getattr(self.mission.platforms, name).motion_error
            path = self.geometry.both[platform_index]
            for key, value in error.registered.items():
                kind = kind_of(key)
                assert isinstance(kind, MotionKind)
                x, y, z = self._resolved(kind, path)
                along_look = -dot(path.look, (x, y, z))
                orders = np.einsum("fn,nc->fc", exact.fit, along_look)
                orders = np.where(
                    np.abs(orders) > VECTOR_ROUNDING_FRACTION * np.abs(along_look).max(axis=0), orders, 0
                )
                yield ErrorSource(
                    subject=subject(name, key),
                    unit=kind.unit,
                    declared=value * self.factor,
                    path=kind.path(name),
                    effect=Effect(orders[0], orders[1] / exact.half, exact.k * orders[2], exact.k * orders[3]),
                    full=exact.effect(exact.along(platform_index, (x, y, z))),
                    direction=NOWHERE,
                    equation=kind.equation,
                    no_limit=phrases.note("no-quadratic-term-of-registered", kind=key),
                    evidence=error.source,
                    shifts=((x, y, z), (x, y, z)),
                )

    def _resolved(self, kind: MotionKind, path: PlatformState) -> Floats:
        """Motion over the aperture due to one unit of a registered kind of error, (3, nodes, cases). [m/unit]

        Raises
        ------
        MotionKindError
            The motion cannot be used, or it changes too fast for the nodes.
        """
        exact, places = self.exact, self.exact.sampling.places
        moved = np.array(kind.moved(path, exact.times))
        between = np.broadcast_to(_BETWEEN_NODES[:, None] * exact.half, (_BETWEEN_NODES.size, exact.times.shape[1]))
        truth = np.array(kind.moved(path, between))
        to_orders = np.linalg.inv(np.polynomial.legendre.legvander(places, places.size - 1))
        through = np.polynomial.legendre.legvander(_BETWEEN_NODES, places.size - 1) @ to_orders
        strays = np.abs(np.einsum("tn,anc->atc", through, moved) - truth).max()
        if strays > _UNRESOLVED_FRACTION * np.abs(truth).max():
            raise MotionKindError(
                f"{kind.origin}: its motion changes faster than {places.size} nodes of the aperture resolve; "
                "accepted: a smooth motion"
            )
        return moved

    def _of_terrain(self) -> Iterator[ErrorSource]:
        """Yield the error of a scene that is higher than the processor assumes, if the file states such an error.

        Its effect is the same as if both platforms were measured too high by the same amount.
        """
        height = self.mission.scene.height_error
        if height is None:
            return
        kind = TERRAIN_KIND
        legs = [self.published_legs(platform_index, POSITION_KIND) for platform_index in (0, 1)]
        full_legs = [self.full_legs(platform_index, POSITION_KIND) for platform_index in (0, 1)]
        yield ErrorSource(
            subject=subject("mission", kind.name),
            unit=kind.unit,
            declared=height,
            path=kind.path("mission"),
            effect=self._of_both(legs, 2, None),
            full=self._of_both(full_legs, 2, None),
            direction=kind.moved(self.geometry.transmitter, self.exact.times),
            equation=kind.size().equation,
            no_limit=phrases.note("no-quadratic-term-of-height"),
            notes=(phrases.note("held-to-the-total", owners="no platform"),),
        )

    def _stated_elsewhere(self) -> Iterator[ErrorSource]:
        for index, stated in enumerate(self.mission.other_errors):
            if stated.quadratic_phase_error is None:
                continue
            yield ErrorSource(
                subject=subject("mission", OTHER_KIND.name, stated.name),
                unit=OTHER_KIND.unit,
                declared=stated.quadratic_phase_error,
                path=OTHER_KIND.path("mission", index=index),
                effect=_PUBLISHED_UNIT,
                full=_FULL_UNIT,
                direction=NOWHERE,
                equation=OTHER_KIND.size().equation,
                no_limit=NOTHING,
                evidence=stated.source,
                notes=(phrases.note("held-to-the-total", owners="no platform"),),
                bias=_bias(stated.bias, QUADRATIC_PHASE),
            )


@cache
def _scene_axes(name: str, kind: StateKind) -> tuple[tuple[Subject, KeyPath, str, Note], ...]:
    """Constant properties of the rows for errors of one platform and kind along the scene axes x, y and z.

    Returns, for each axis, the subject, the key path, the name of the equation, and a note on why an error along this
    axis may have no limit.
    """
    return tuple(
        (
            subject(name, kind.name, letter),
            kind.path(name, index=axis),
            _equation(kind, axis),
            _no_limit(kind, letter),
        )
        for axis, letter in enumerate("xyz")
    )


def _along_scene_axis(
    declared: Sequence[PerCase], axes: tuple[Vectors, Vectors, Vectors], axis: int, distribution: str
) -> PerCase:
    """Combined size, along one axis of the scene, of three errors that are stated along the axes of another frame.

    `declared` are the three errors. `axes` are unit vectors of the frame in scene coordinates, and `axis` is the
    index of the scene axis. The three errors are independent: the squares of one-sigma values add, and the magnitudes
    of bounds add. If the signed values were only rotated, they could cancel. The rotation therefore determines only
    the sign of the result.
    """
    a, b, c = (value * direction[axis] for value, direction in zip(declared, axes, strict=True))
    size = np.sqrt(a * a + b * b + c * c) if distribution == "normal" else np.abs(a) + np.abs(b) + np.abs(c)
    return np.copysign(size, a + b + c)


def _along_covariance(covariance: "Covariance", kind: str, direction: Sequence[PerCase]) -> PerCase:
    """Sigma √(dᵀCd) of the position error [m] or velocity error [m/s] along a unit direction d.

    C is the covariance of the three errors. `direction` has the components of d along the axes of the frame in which
    C is stated. `kind` is `position` or `velocity`.
    """
    parts = [sigma * along for sigma, along in zip(covariance.of(kind), direction, strict=True)]
    return np.sqrt(squared(covariance.block(kind), parts))


def _along(effects: Sequence[AnyEffect], direction: Vectors) -> AnyEffect:
    """Effect of a unit error along a direction, as a linear combination of the effects along the three scene axes."""
    terms = [[part * way for part, way in zip(parts, direction, strict=True)] for parts in zip(*effects, strict=True)]
    return type(effects[0])(*map(_total, terms))


def _of_both_platforms(vectors: Mapping[int, AnyVector]) -> tuple[AnyVector, AnyVector]:
    """Convert a mapping of platform index to vector to a pair of vectors, transmitter first.

    If a platform is missing in the mapping, its place in the pair is filled with the vector of the other platform.
    This placeholder is not used.
    """
    first = next(iter(vectors.values()))
    return vectors.get(0, first), vectors.get(1, first)


def _of_each(effects: FullEffect) -> list[FullEffect]:
    """Split the effects of several errors into one effect for each error.

    The fields of `effects` are (errors, cases). The fields of each resulting effect are (cases,).
    """
    return [FullEffect._make(row) for row in zip(*map(np.asarray, effects), strict=True)]


def _sum(effects: Sequence[AnyEffect]) -> AnyEffect:
    return type(effects[0])(*map(_total, zip(*effects, strict=True)))


def _total(terms: Sequence[PerCase]) -> PerCase:
    """Sum of terms; 0 if the terms cancel except for rounding errors.

    A limit computed from a sum that is only rounding error would be meaningless.
    """
    total = sum(terms)
    return np.where(np.abs(total) > VECTOR_ROUNDING_FRACTION * sum(np.abs(term) for term in terms), total, 0.0)


def _equation(kind: StateKind, axis: int | None) -> str:
    table = kind.size().equation
    if kind.order == 0:
        return table if axis is None else f"{table} row {2 + 3 * axis}"
    first = 3 * kind.order - 2
    return f"{table} rows {first}-{first + 2}" if axis is None else f"{table} row {first + axis}"


def _axis_of(frame: str, axis: str) -> str:
    return f"the {frame} frame's {axis} axis"


def _no_limit(kind: StateKind, axis: str) -> Note:
    """Return a note explaining why the quadratic phase may set no limit to an error of one kind along one axis.

    `axis` is the name of the axis in the note.
    """
    if not kind.defocusing_vectors:
        return phrases.note("no-quadratic-term-of-position")
    vector, _ = kind.defocusing_vectors
    return phrases.note("no-component", cause=vector, axis=axis)
