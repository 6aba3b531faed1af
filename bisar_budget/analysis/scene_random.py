"""Quadratic phases of random errors at any ground point of a scene.

The random errors are errors of sensors, clocks and air, and slow vibrations. Each error is a sum of independent
parts. The variation of a part over the aperture is known, while its size is random. A part is, for example, the bias
along one axis, or one Legendre order of the noise along one axis. During a collection, a part has the same size for
all ground points of the scene. The phases that a random error causes at two ground points therefore differ by the
root-sum-square of the differences of its parts. Subtracting the root-sum-squares at the two points would
underestimate this difference.

- An error that moves a platform is projected on the line of sight from each ground point.
- A clock error moves no platform. The constant and the linear term of its range error displace the image, and this
  displacement depends on the ground point. The phase at a ground point is therefore the phase at the centre plus a
  phase due to these two terms. The two terms are computed from the displacement at the centre. If the mission file
  does not determine a term, for example for a free-running oscillator, the term is left out, and the report contains
  a note on this.
- A zenith delay is the same for the whole scene, but the elevation of a platform depends on the ground point. A delay
  that changes within the aperture consists of as many independent parts as its correlation requires.
- A slow vibration has an unknown phase. Its cosine and its sine are two parts of the same size. The effect in the
  worst phase is the root-sum-square of the effects of these two parts. The axes may vibrate with any phase relative
  to each other, so their effects add. A vibration stated along the line of sight moves the platform along the line of
  sight to the scene centre.

If the mission file states only the effect of an error, the error has this effect at every ground point.

These relations are derived here. `tests/simulate/test_random_at_scene_edge.py` checks them against exact ranges.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from bisar_budget.arrays import Floats, Indices
from bisar_budget.constants import VECTOR_ROUNDING_FRACTION
from bisar_budget.effects.air_delays import (
    group_at_nodes,
    legs_of,
    metres_per_unit,
    seen_course,
    zenith_courses,
)
from bisar_budget.effects.declared import QUADRATIC, DeclaredErrors
from bisar_budget.effects.effect import PLATFORMS, Subject
from bisar_budget.effects.error_quantiles import quantile_factor
from bisar_budget.effects.random_effect import (
    FEWEST_EFFECT_NODES,
    MOST_EFFECT_NODES,
    Moves,
    RandomError,
    SensorCases,
    factor,
)
from bisar_budget.effects.vibration import slow_moves
from bisar_budget.geometry import VectorArrays
from bisar_budget.image_plane import nodes
from bisar_budget.ranges.exact_ranges import ExactRanges


class RandomPhases:
    """Quadratic phases of declared random errors and slow vibrations at arbitrary ground points, for many cases.

    A random error is a sum of independent parts. A place is a ground point in one of the cases.

    Attributes
    ----------
    subjects : list of Subject
        Subject of each error, with the id and the owner of its row.
    centre : (parts, cases)
        Quadratic phases at the scene centre due to the parts of all errors. [rad]
    """

    def __init__(self, errors: DeclaredErrors, random: Sequence[RandomError]) -> None:
        pairs = [*_at_random(errors, random), *_vibrating(errors)]
        self.subjects = [subject for subject, _ in pairs]
        self._errors = [error for _, error in pairs]
        of_each = [error.there(errors.exact, errors.each) for error in self._errors]
        self.centre = np.concatenate([np.zeros((0, errors.cases)), *of_each])
        groups = [error.groups for error in self._errors]
        sizes = np.repeat([len(phases) // count for phases, count in zip(of_each, groups, strict=True)], groups)
        self._first_rows, self._groups = (np.cumsum([0, *counts])[:-1].astype(int) for counts in (sizes, groups))

    def there(self, there: ExactRanges, of: Indices) -> Floats:
        """Quadratic phase at each ground point due to each part of each error, (parts, places). [rad]

        The argument `there` gives the exact ranges at the ground points (places). `of` holds the index of the case
        for each ground point.
        """
        return np.concatenate([np.zeros((0, of.size)), *(error.there(there, of) for error in self._errors)])

    def of_errors(self, phases: Floats) -> Floats:
        """Combine the phases of the parts of each error to a single phase for each error. [rad]

        `phases` is (parts, ...), and the result is (errors, ...).
        """
        if not self._errors:
            return phases
        of_groups = np.sqrt(np.add.reduceat(np.square(phases), self._first_rows, axis=0))
        return np.asarray(np.add.reduceat(of_groups, self._groups, axis=0))


# ---------------------------------------------------------------------- one error at places
class _Moving(NamedTuple):
    """Random error of the motion of one or both platforms.

    `moves` are the motions due to one unit of the error, and `size` is the size of the error in this unit. `groups`
    is the number of groups into which the parts of the error are divided. The phases within a group are combined by
    root-sum-square, and the results of all groups are added.
    """

    moves: Sequence[Moves]
    size: Floats
    groups: int = 1

    def there(self, there: ExactRanges, of: Indices) -> Floats:
        """Quadratic phase at each ground point due to each part of the error, (parts, places). [rad]

        A part is a motion along a single direction with a single variation over the aperture. `there` gives the exact
        ranges at the ground points (places). `of` holds the index of the case for each ground point.
        """
        weights, (total, seen) = there.phase_weights[0], np.zeros((2, 1, 1, 1))
        for motion in self.moves:
            ways, courses = _of(motion.ways, of), _of(motion.courses, of)
            along = weights * there.along(motion.place, (ways[:, 0], ways[:, 1], ways[:, 2]))
            total = total + np.einsum("anp,mnp->amp", along, courses)
            seen = seen + np.einsum("anp,mnp->amp", np.abs(along), np.abs(courses))
        # Where terms cancel exactly, the remainder is a rounding error.
        phase = np.where(np.abs(total) > VECTOR_ROUNDING_FRACTION * seen, total, 0.0) * _of(self.size, of)
        return np.asarray(phase.reshape(-1, of.size))


class _Clock(NamedTuple):
    """Clock error, divided into independent parts.

    `quadratic` [rad] is the quadratic phase at the scene centre due to each part. `constant` [m] and `linear` [m/s]
    are the constant and the linear term of the range error due to each part. These three arrays are (parts, cases).
    `at_centre` (2, cases) [rad] is the quadratic phase at the centre due to a constant term of 1 m, and due to a
    linear term of 1 m/s.
    """

    quadratic: Floats
    constant: Floats
    linear: Floats
    at_centre: Floats
    groups: int = 1

    @classmethod
    def of(cls, exact: ExactRanges, covariance: Floats, size: Floats) -> "_Clock":
        """Create a clock error from its declared size and the covariance of its effects at the scene centre.

        `covariance` (8, 8, cases) is the covariance in `RandomEffect` for one unit of the error. Its first four
        effects are quadratic phase, cubic phase, displacement east, and displacement north. `size` (cases,) is in the
        unit of the error.
        """
        joint = covariance.reshape(8, 8, -1)[np.ix_((0, 2, 3), (0, 2, 3))]
        quadratic, east, north = np.moveaxis(factor(np.moveaxis(joint, 2, 0)), 0, 2) * size
        (a, b), (c, d) = _terms(exact.place_weights, exact)  # displacement by one unit of each term
        with np.errstate(all="ignore"):
            scale = 1 / (a * d - b * c)
        constant, linear = (d * east - b * north) * scale, (a * north - c * east) * scale
        return cls(quadratic, constant, linear, _terms(exact.phase_weights, exact)[0])

    def there(self, there: ExactRanges, of: Indices) -> Floats:
        """Quadratic phase at each ground point due to each part of the clock error, (parts, places). [rad]

        `there` gives the exact ranges at the ground points (places). `of` holds the index of the case for each ground
        point.
        """
        by_constant, by_linear = _terms(there.phase_weights, there)[0] - self.at_centre[:, of]
        quadratic, constant, linear = (term[:, of] for term in self[:3])
        return np.asarray(quadratic + by_constant * constant + by_linear * linear)


def _terms(weights: Iterable[Floats], exact: ExactRanges) -> Floats:
    """Effects of a constant range error of 1 m, and of a linear range error of 1 m/s, (effects, 2, cases).

    `weights` has an array (nodes, cases) for each effect. The array gives the effect per metre of range error at each
    node.
    """
    return np.array([[row.sum(axis=0), (row * exact.times).sum(axis=0)] for row in weights])


class _Delay(NamedTuple):
    """Error of the propagation delay in air, on the path between the scene and one or both platforms.

    `delay` is the kind of delay, and `metres` [m] is its size at the zenith. `middles` [m] are the positions of the
    platforms at mid-aperture relative to the scene centre. `courses` (courses, nodes, cases) are independent
    variations over the aperture. If each is multiplied by an independent random number of variance 1, their sum is a
    zenith delay of variance 1.
    """

    platform_indices: tuple[int, ...]
    delay: str
    middles: Sequence[VectorArrays]
    metres: Floats
    courses: Floats
    groups: int = 1

    def there(self, there: ExactRanges, of: Indices) -> Floats:
        """Quadratic phase at each ground point due to each variation in `courses`, (courses, places). [rad]

        `there` gives the exact ranges at the ground points (places). `of` holds the index of the case for each ground
        point.
        """
        along = np.zeros(())
        for platform_index, middle in zip(self.platform_indices, self.middles, strict=True):
            x, y, z = (component[of] for component in middle)
            along = along + group_at_nodes(self.delay, there.tracks[platform_index], (x, y, z), self.metres[of])
        group = along * _of(self.courses, of)
        mean = np.einsum("n,mnp->mp", there.fit[0], group)[:, None]
        return np.asarray(np.einsum("np,mnp->mp", there.phase_weights[0], seen_course(group, mean, self.delay)))


# ---------------------------------------------------------------------- those of a mission
def _at_random(
    errors: DeclaredErrors, random: Sequence[RandomError]
) -> Iterator[tuple[Subject, _Moving | _Clock | _Delay]]:
    for error in random:
        subject, moves = error.subject, error.kind.moves
        if error.declared is None or error.counted_in:
            continue
        factor = quantile_factor("normal", errors.confidence(QUADRATIC)) if error.is_covered else 1.0
        size = errors.array(error.declared) * factor
        if error.moves:
            yield subject, _Moving(_at_nodes_of(errors, error.moves), size)
        elif moves == "clock":
            assert error.full.covariance is not None, "the full model has one"
            yield subject, _Clock.of(errors.exact, error.full.covariance, size)
        elif moves == "air":
            legs = tuple(map(PLATFORMS.index, legs_of(subject.owner)))
            middles = [errors.exact.positions[leg] for leg in legs]
            count = min(MOST_EFFECT_NODES, max(FEWEST_EFFECT_NODES, errors.exact.fit.shape[1]))
            between = _between(count, errors.exact.fit.shape[1])
            courses = zenith_courses(errors.mission, subject.owner, 2 * errors.exact.half, count)
            courses = np.einsum("nm,fmc->fnc", between, courses)
            yield (
                subject,
                _Delay(legs, subject.axis, middles, size * metres_per_unit(errors.mission, subject.axis), courses),
            )


def _vibrating(errors: DeclaredErrors) -> Iterator[tuple[Subject, _Moving]]:
    for subject, moves in slow_moves(SensorCases(errors.mission, errors.geometries, errors.cases)):
        yield subject, _Moving(_at_nodes_of(errors, [moves]), errors.array(1.0), len(moves.ways))


def _at_nodes_of(errors: DeclaredErrors, moves: Sequence[Moves]) -> list[Moves]:
    """Interpolate motions of platforms from the aperture nodes of `moves` to the nodes used for declared errors."""
    resampled = []
    for motion in moves:
        between = _between(motion.courses.shape[1], errors.exact.fit.shape[1])
        ways = motion.ways if motion.ways.shape[2] == 1 else np.einsum("nm,axmc->axnc", between, motion.ways)
        resampled.append(Moves(motion.place, ways, np.einsum("nm,fmc->fnc", between, motion.courses)))
    return resampled


@cache
def _between(sensed: int, count: int) -> Floats:
    """Matrix (count, sensed) that interpolates values from `sensed` to `count` quadrature nodes of the aperture.

    The interpolation uses the Legendre polynomials up to the highest order that both sets of nodes can represent.
    """
    node_times, weights = np.polynomial.legendre.leggauss(sensed)
    order = np.arange(min(sensed, count))
    fit = (order + 0.5)[:, None] * np.polynomial.legendre.legvander(node_times, order[-1]).T * weights
    return np.asarray(np.polynomial.legendre.legvander(nodes(count).places, order[-1]) @ fit)


def _of(array: Floats, cases: Indices) -> Floats:
    """Select cases along the last axis of an array (…, cases).

    A last axis of length 1 is shared by all cases and is not changed.
    """
    return array if array.shape[-1] == 1 else array.take(cases, axis=-1)
