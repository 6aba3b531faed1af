"""Effects of the declared errors according to both models, and the allowable sizes of the errors, for many cases.

A case is one collection; a check of a mission has a single case. The published model, Tables I and II and equation
(25) of Rigling & Moses, is linear. The full model holds for errors of any size. Its effects are taken as proportional
to the error if the second order provably does not matter, and are otherwise computed from exact ranges. An error may
have either sign, and a bound on its size covers both signs. Phases and allowables are therefore given for the worse
sign.

Errors are stored in blocks, whose arrays are (errors, cases). With a single case, all errors form one block. With
thousands of cases, each error is a block of its own, so that the arrays in use fit into a processor's cache.
"""

import math
import weakref
from collections.abc import Callable, Container, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget import evaluators, phrases
from bisar_budget.arrays import Booleans, Floats, Indices, PerCase, PerCaseFlag
from bisar_budget.constants import MIN_GRADIENT_ANGLE_DEG, MIN_GROUND_GRADIENT_RATIO
from bisar_budget.effects.effect import PLATFORMS, ErrorSource, plain
from bisar_budget.effects.error_quantiles import allowable_size, judged_size
from bisar_budget.effects.sources import ErrorListing, distribution_of
from bisar_budget.error_kinds.path_kinds import STATE_KINDS
from bisar_budget.geometry import BistaticGeometry, GroundVector, Vectors, angle_between_lines, norm
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.ranges import point_paths
from bisar_budget.ranges.exact_ranges import (
    QUADRATIC_OF_VARIANCE,
    Effect,
    ExactEffect,
    ExactRanges,
    FullEffect,
    Lanes,
    TimeTags,
)
from bisar_budget.ranges.limit_search import LimitSearches, find_first_sizes
from bisar_budget.ranges.point_paths import ROWS, PointPaths, tries_several_sizes

QUADRATIC, CUBIC, LOCATION = "quadratic_phase_error", "cubic_phase_error", "location_error"
LIMITING_REQUIREMENTS = (QUADRATIC, CUBIC, LOCATION)  # requirements that limit an error
END_OF_IMAGE = "end_of_image"  # not a requirement: for a larger error, no ground point has the range history
MODELS = ("published", "full")
OTHER_MODEL = {"published": "full", "full": "published"}

# Largest motion of a platform by a navigation error within the aperture, as a fraction of the slant range. A larger
# error would not be a navigation error.
FARTHEST_RANGE_FRACTION = 0.1
SECOND_ORDER_FRACTION = 0.004  # of a phase, displacement or limit, which the second order may add; the aim is 1 %
FLOOR_RAD, FLOOR_M = 1e-3, 2e-5  # amounts that the second order may always add

_LANES_AT_ONCE_COUNT = 1 << 13  # lanes in a block
_FLOORS = (FLOOR_RAD, FLOOR_RAD, FLOOR_M)


class Declared(NamedTuple):
    """Phases and displacements that errors of given sizes cause, as arrays over cases or as numbers for one case.

    `qpe` and `cubic` [rad] are the quadratic and cubic phase at the aperture edge for the worse sign of the error.
    They have the sign of the first-order phase of the declared error. `rest` [rad] is the rms phase beyond the cubic
    order for the worse sign.

    `displacement` [m] is the displacement east and north for the declared sign of the error. `opposite` [m] is the
    displacement for the opposite sign. For a pure phase error, and in the published model if the matrix Q of equation
    (25) in Rigling & Moses has no inverse, both are NaN, or None if the fields are plain numbers. A displacement is
    also NaN if no ground point has the range history that the error with this sign causes. The phases are then
    infinite.

    `hidden` [rad] represents the part of the range error that remains for any displacement of the image, because of
    the finite bandwidth and the turn of the line of sight. This hidden phase is the quadratic phase that lowers the
    peak as much as the remaining range error does. Autofocus does not correct it.
    """

    qpe: Any
    cubic: Any
    displacement: Any
    opposite: Any
    hidden: Any = 0.0
    rest: Any = 0.0

    def judged(self, gain: PerCase) -> PerCase:
        """Phase to compare with a limit that has been raised by the gain of autofocus. [rad]

        Autofocus corrects the quadratic phase φ₂, but not the hidden phase φₕ. The limit is nevertheless raised for
        both, by the factor `gain`. To compensate for this, the hidden phase is multiplied by the same factor. The
        result is √(φ₂² + (gain·φₕ)²).
        """
        phase: PerCase = np.hypot(self.qpe, gain * self.hidden)
        return phase

    @property
    def equal_loss(self) -> PerCase:
        """Quadratic phase that lowers the peak as much as the quadratic and the hidden phase together. [rad]"""
        phase: PerCase = np.hypot(self.qpe, self.hidden)
        return phase

    @property
    def farthest(self) -> Any:
        """Displacement, east and north, for the sign of the error that moves the image farther. [m]

        If the opposite sign moves the image farther than the declared sign, the displacement for the opposite sign is
        returned, with its direction reversed. The result is NaN if the displacement for either sign is NaN, and None
        if either is None.
        """
        if self.displacement is None or self.opposite is None:
            return None
        (x, y), (u, v) = self.displacement, self.opposite
        is_ahead, is_gone = np.hypot(x, y) >= np.hypot(u, v), np.isnan(x) | np.isnan(u)
        east, north = (np.where(is_ahead, a, -b) for a, b in ((x, u), (y, v)))
        return np.where(is_gone, math.nan, east), np.where(is_gone, math.nan, north)

    def of(self, errors: int | Indices | slice) -> "Declared":
        """Select the effects of the errors with the given indices."""
        (x, y), (u, v) = self.displacement, self.opposite
        phases = self.qpe[errors], self.cubic[errors]
        return Declared(
            *phases, (x[errors], y[errors]), (u[errors], v[errors]), self.hidden[errors], self.rest[errors]
        )

    def in_one_case(self, case: int = 0) -> "Declared":
        """Return the effects in the case with the given index, as plain numbers."""
        moved, opposite = point(self.displacement, case), point(self.opposite, case)
        qpe, cubic, hidden, beyond_cubic = (
            plain(phase, case) for phase in (self.qpe, self.cubic, self.hidden, self.rest)
        )
        return Declared(qpe, cubic, moved, opposite, hidden, beyond_cubic)


def point(displacement: tuple[PerCase, PerCase], case: int = 0) -> GroundVector | None:
    """Displacement of the image in one case, east and north, as plain numbers; None if it is NaN. [m]"""
    east, north = (plain(component, case) for component in displacement)
    return None if math.isnan(east) else (east, north)


class Allowed(NamedTuple):
    """Allowable sizes of errors according to one model, (errors, cases); NaN where no size reaches a limit.

    An allowable is the largest declared size, with the bias kept, of which the judged size keeps the limits.

    `smallest` is the allowable for all requirements. `quadratic` is the allowable for the limit of the quadratic
    phase alone. It equals `smallest` unless it was searched for separately (see `ErrorBlock.allowed`).

    `binding` is the index in `LIMITING_REQUIREMENTS` of the requirement that sets the smallest size. If larger errors
    leave no image, `binding` is the length of `LIMITING_REQUIREMENTS`. It is -1 where no size reaches a limit.

    `uses` are utilizations that do not follow from `smallest`, because an error has a bias; otherwise None.
    """

    smallest: Floats
    quadratic: Floats
    binding: NDArray[np.int8]
    uses: Floats | None = None


class ImagePlane(NamedTuple):
    """Inverse of the matrix Q of Rigling & Moses for each case, as adjugate and determinant.

    Q⁻¹ maps the constant [m] and the linear part [m/s] of a range error to the displacement of the image [m].
    `is_singular` marks the cases in which Q has no usable inverse.
    """

    adjugate: tuple[tuple[PerCase, ...], tuple[PerCase, ...]]
    determinant: PerCase
    is_singular: PerCaseFlag = False

    def displacement(self, effect: Effect, size: PerCase) -> tuple[PerCase, PerCase]:
        """Displacement of the image on the ground, east and north, by equation (25) of Rigling & Moses. [m]

        `effect` is the effect of one unit of an error, and `size` is the size of the error in this unit. The result
        is NaN where Q has no usable inverse.
        """
        (a, b), (c, d) = self.adjugate
        scale = size / np.where(self.is_singular, math.nan, self.determinant)
        # Adding 0.0 turns -0.0 into 0.0, so that no minus sign is printed.
        return (
            (a * effect.constant + b * effect.linear) * scale + 0.0,
            (c * effect.constant + d * effect.linear) * scale + 0.0,
        )


# The evaluators take and give numbers, or arrays of cases.
_published_ground_inverse: Callable[..., tuple[tuple[PerCase, ...], ...]] = evaluators.published_ground_inverse


def published_planes(geometry: BistaticGeometry) -> tuple[ImagePlane, PerCase]:
    """Invert the matrix Q of the published model, given by equations (19) and (30) of Rigling & Moses.

    Returns the inverse, and the angle [deg] between the range and the Doppler gradient of Q.

    The published Q takes the slant ranges R as constant: its second row is v/R, with the velocity v. The true second
    row is v⊥/R, with the component v⊥ of v perpendicular to the line of sight. Q can therefore be singular where the
    true gradients are not parallel. Q contains only the look vectors at mid-aperture. Where they almost cancel on the
    ground, Q has no usable inverse either.
    """
    ground: list[PerCase] = []
    for path in geometry.both:
        ground += [*path.position[:2], *path.velocity[:2], path.slant_range]
    first, second, (determinant,) = _published_ground_inverse(*ground)
    # (30): the first column holds (-rate_y, rate_x), the second (s_y, -s_x).
    degrees = np.degrees(angle_between_lines((-second[1], first[1]), (second[0], -first[0])))
    is_short = np.hypot(second[0], second[1]) < MIN_GROUND_GRADIENT_RATIO
    return ImagePlane((first, second), determinant, is_short | (degrees < MIN_GRADIENT_ANGLE_DEG)), degrees


class OwnPlane(NamedTuple):
    """Counterpart of `ImagePlane` for the full model, whose effects already contain the displacement of the image."""

    is_singular: PerCaseFlag = False

    def displacement(self, effect: FullEffect, size: PerCase) -> tuple[PerCase, PerCase]:
        """Displacement of the image on the ground, east and north, due to an error of the given size. [m]

        `effect` is the effect of one unit of the error.
        """
        return effect.east * size + 0.0, effect.north * size + 0.0


class ErrorBlock:
    """A block of errors with their effects in all cases, in arrays (errors, cases).

    Attributes
    ----------
    sources : sequence of ErrorSource
        Errors of the block, in the order of the first axis of the arrays.
    declared : (errors, cases)
        Declared sizes with their signs, including the coverage factor; NaN where the file declares no size.
    effects : mapping of str to Effect
        Effects of one unit of each error, by the name of the model. In the full model they are first-order effects.
    """

    def __init__(self, table: "DeclaredErrors", sources: Sequence[ErrorSource]) -> None:
        # A strong reference to the table would form a cycle, and the arrays of a sweep would wait for the collector.
        self.table: DeclaredErrors = weakref.proxy(table)
        self.exact, self.sources, self.cases = table.exact, sources, table.cases
        shape = (len(sources), self.cases)
        self.declared, self.bias = np.full(shape, math.nan), np.zeros(shape)
        self.edge = np.empty(shape)  # position error at the aperture's edge by a unit [m]
        published, full = np.empty((4, *shape)), np.empty((4, *shape))
        for index, source in enumerate(sources):
            if source.declared is not None:
                self.declared[index], self.bias[index] = source.declared, source.bias
            self.edge[index] = table.edge_of(source)
            for column, numbers in enumerate(zip(source.effect, source.full, strict=True)):
                published[column, index], full[column, index] = numbers
        self.effects: dict[str, Any] = {"published": Effect(*published), "full": FullEffect(*full)}
        self.is_motion = np.array([[source.is_motion] for source in sources])
        self.distributions = [distribution_of(table.mission, source) for source in sources]
        self.is_biased = bool(self.bias.any())
        self.moves = [index for index, source in enumerate(sources) if source.displaces]
        self._per_unit: dict[str, Floats] = {}
        self._judged_sizes: dict[float | None, Floats] = {}
        self._follows: PointPaths | None = None

    # ---------------------------------------------------------------- sizes that requirements judge
    def judged_sizes(self, requirement: str) -> Floats:
        """Sizes of the errors that a requirement judges, (errors, cases); see `error_quantiles`.

        They have the signs of the declared sizes. Without a bias and a confidence, they are the declared sizes.
        """
        confidence = self.table.confidence(requirement)
        if confidence is None and not self.is_biased:
            return self.declared
        if confidence not in self._judged_sizes:
            sizes = self._by_error(judged_size, np.nan_to_num(self.declared), confidence)
            sizes = np.copysign(sizes, np.where(self.declared == 0, self.bias, self.declared))
            self._judged_sizes[confidence] = np.where(np.isnan(self.declared), math.nan, sizes)
        return self._judged_sizes[confidence]

    def _by_error(
        self, of: Callable[[str, PerCase, PerCase, float | None], PerCase], sizes: Floats, confidence: float | None
    ) -> Floats:
        """Apply a function of `error_quantiles` to the sizes (errors, cases), with each error's distribution."""
        rows = zip(self.distributions, sizes, self.bias, strict=True)
        return np.array([of(distribution, size, bias, confidence) for distribution, size, bias in rows])

    def uses(self, reaching: Sequence[Floats | None]) -> Floats:
        """Largest utilization of each error over the requirements, (errors, cases).

        `reaching` has the sizes at which the errors reach the limit of each of `LIMITING_REQUIREMENTS`, or None. A
        utilization is the judged size, divided by the size that reaches the limit; 0 where no size reaches it.
        """
        uses = np.where(np.isnan(self.declared), math.nan, 0.0)
        for requirement, reached in zip(LIMITING_REQUIREMENTS, reaching, strict=True):
            if reached is not None:
                with np.errstate(all="ignore"):
                    use = np.abs(self.judged_sizes(requirement)) / np.where(np.isnan(reached), math.inf, reached)
                uses = np.maximum(uses, use)
        return uses

    # ---------------------------------------------------------------- small errors
    def per_unit(self, model: str) -> Floats:
        """Magnitudes of the first-order effects per unit of each error, (3, errors, cases).

        The effects are the phase [rad] that is compared with the limit (see `Declared.judged`), the cubic phase [rad]
        and the displacement [m]. An unknown displacement counts as 0.
        """
        if model not in self._per_unit:
            effect = self.effects[model]
            moved = np.hypot(*self.table.planes[model].displacement(effect, 1.0))
            moved = np.where(self.is_motion & ~np.isnan(moved), moved, 0.0)
            hidden = self.hidden_per_unit[0] if model == "full" else 0.0
            judged = np.hypot(effect.qpe, self.table.gain * hidden)
            self._per_unit[model] = np.array([judged, np.abs(effect.cubic), moved])
        return self._per_unit[model]

    @cached_property
    def hidden_per_unit(self) -> Floats:
        """First-order hidden phase and rms phase beyond the cubic order per unit of each error. [rad/unit]

        The array is (2, errors, cases). Both phases are 0 for errors that do not displace the image. `Declared`
        defines the hidden phase, which autofocus does not correct.
        """
        phases = np.zeros((2, *self.declared.shape))
        if self.moves:
            remaining = self.left_per_unit(self.moves)
            phases[:, self.moves] = self.exact.unresolved(remaining)
        return phases

    def left_per_unit(self, indices: Sequence[int]) -> Floats:
        """Range error that remains over the aperture if the image is at its first-order position. [m/unit]

        The result has the values at the nodes, (errors, nodes, cases). `indices` are the indices of the errors in the
        block.
        """
        full = self.effects["full"]
        if self.cases == 1:
            lanes = self.paths.lanes.of(self._lane[indices, 0])
            range_error = self.exact.range_error(lanes).T[..., None]
        else:
            sources = [self.sources[index] for index in indices]
            range_error = np.stack([self.exact.range_error(self.table.lanes(source)) for source in sources])
        return self.exact.left_of_small(range_error, (full.east[indices], full.north[indices]))

    def adds(self, size: Floats) -> Floats:
        """Upper bounds of the second-order effects of errors with the given sizes, (3, errors, cases).

        The effects are the phase [rad] that is compared with the limit (see `Declared.judged`), the cubic phase [rad]
        and the displacement [m].
        """
        strays = self._strays(size)
        return self.table.per_metre * self._grows(size, strays) + self.table.per_stray * strays

    def _strays(self, size: Floats) -> Floats:
        """Upper bound of the distance between the image point and its first-order position, (errors, cases). [m]

        `size` are the sizes of the errors. An error that moves a platform by r̃ within the aperture changes the
        direction to the ground by r̃/R, where R is the range. If this change varies over the aperture in the same way
        as the remaining range error ρ, the minimum of the phase variance V is displaced from the first-order image
        point. The distance is at most H⁻¹⟨r̃/R, ρ⟩. `exact_ranges` defines V, H and ⟨ ⟩.
        """
        full, exact, bent = self.effects["full"], self.exact, self._bent(size)
        hidden, beyond_cubic = self.hidden_per_unit
        remaining_rad = np.sqrt(4 / 45 * (full.qpe**2 + hidden**2) + 4 / 175 * full.cubic**2 + beyond_cubic**2)
        turns = (np.abs(size) * self.edge + bent) / exact.nearest_node
        remaining_m = np.abs(size) * remaining_rad / exact.k + bent
        return np.asarray(turns * remaining_m * (1 + exact.band) / exact.matrix.least)

    def _bent(self, size: Floats) -> PerCase:
        """Upper bound of the part of a platform's motion that is not proportional to the error's size. [m]

        Only a time tag error has such a part, because it displaces the platform along a path that may be curved. The
        bound, (errors, cases), is the distance that `DeclaredErrors.bent` returns, doubled if the direct path
        synchronizes the clocks. The result is the number 0 if the block has no time tag error.
        """
        tags = [index for index, source in enumerate(self.sources) if source.is_time_tag]
        if not tags:
            return 0.0
        bends = np.zeros(size.shape)
        for index in tags:
            bends[index] = self.table.bent(self.sources[index], size[index]) * (1 + self.exact.has_direct_path)
        return bends

    def _grows(self, size: Floats, strays: Floats) -> Floats:
        """Upper bound of the second-order part of the range error, (errors, cases). [m]

        `strays` [m] is the upper bound from `_strays`.

        Let r̃ be the motion of a platform, x̂ the displacement of the image, and P⊥ the projection across the line of
        sight. The second-order term of the range error, summed over both platforms, is −Σ|P⊥(r̃ − x̂)|²/2R. Its
        magnitude is at most |r̃ − x̂|²/R, where R is the range of the nearer platform.

        With a direct path, much of the first-order range error of a distant platform cancels. The second-order term
        of the ranges is therefore bounded separately for each platform, with the platform's own range. The
        second-order term of the distance D between the platforms, |P⊥r̃|²/2D, has the opposite sign. The magnitude of
        the sum is therefore at most the magnitude of the larger term.
        """
        exact, bent = self.exact, self._bent(size)
        shift, moved = size * self.edge + bent, size * self.per_unit("full")[2] + strays
        reach = shift + moved
        square = reach * reach
        growth = square / exact.nearest_node
        if exact.has_direct_path:
            nearest, apart = [ranges.min(axis=0) for ranges in exact.ranges], exact.baselines.min(axis=0)
            for index, source in enumerate(self.sources):
                if source.owner in PLATFORMS:
                    platform = PLATFORMS.index(source.owner)
                    of_ranges = square[index] / nearest[platform] + moved[index] ** 2 / nearest[1 - platform]
                    growth[index] = np.maximum(of_ranges, shift[index] ** 2 / apart) / 2
        return np.asarray(growth + bent)

    def is_large(self, size: Floats) -> Booleans:
        """Mark the errors of the given sizes whose effects may not be proportional to their size, (errors, cases).

        An error is marked if an upper bound from `adds` exceeds both a small fixed amount and the fraction
        `SECOND_ORDER_FRACTION` of the first-order effect. Errors that do not displace the image are never marked.
        """
        size = np.abs(size)
        large = np.zeros(size.shape, dtype=bool)
        for added, per_unit, floor in zip(self.adds(size), self.per_unit("full"), _FLOORS, strict=True):
            large |= added > np.maximum(floor, SECOND_ORDER_FRACTION * per_unit * size)
        return large & (size > 0) & self._is_moving

    @cached_property
    def is_declared_large(self) -> Booleans:
        """Mark the declared errors whose effects may not be proportional to their size, (errors, cases).

        The size is the one that the requirement on the quadratic phase judges.
        """
        return self.is_large(self.judged_sizes(QUADRATIC))

    @cached_property
    def _is_moving(self) -> Booleans:
        moving = np.zeros((len(self.sources), 1), dtype=bool)
        moving[self.moves] = True
        return moving

    # ---------------------------------------------------------------- errors of any size
    def does(self, model: str, size: Floats) -> Declared:
        """Effects of errors of the given sizes (errors, cases) according to a model; NaN where the size is NaN.

        In the full model the effects of large errors are computed from exact ranges.
        """
        effect = self.effects[model]
        qpe, cubic = effect.qpe * size + 0.0, effect.cubic * size + 0.0
        moved = self.table.planes[model].displacement(effect, size)
        east, north = (np.where(self.is_motion, component, math.nan) for component in moved)
        hidden = beyond_cubic = np.zeros(size.shape)
        if model == "full":
            hidden, beyond_cubic = self.hidden_per_unit * np.abs(size)
        effects = Declared(qpe, cubic, (east, north), (0.0 - east, 0.0 - north), hidden, beyond_cubic)
        if model == "full":
            is_large = self.is_large(size)
            if is_large.any():
                self._exactly(effects, size, is_large)
        return effects

    def _exactly(self, effects: Declared, size: Floats, is_large: Booleans) -> None:
        """Replace the effects of the errors marked in `is_large` by the results from exact ranges, in place."""
        sizes = size[is_large]
        points = self.followed(is_large, np.abs(sizes))
        ahead, back = (np.where(sizes > 0, *pair) for pair in (points, points[::-1]))
        # Without a ground point the phases are infinite, and there is no displacement.
        is_gone = np.isnan(ahead[point_paths.SIZE]) | np.isnan(back[point_paths.SIZE])
        phases = (effects.qpe, effects.cubic, effects.rest)
        rows = (point_paths.QUADRATIC, point_paths.CUBIC, point_paths.REST)
        for kept, row in zip(phases, rows, strict=True):
            largest = np.copysign(np.maximum(np.abs(ahead[row]), np.abs(back[row])), kept[is_large])
            kept[is_large] = np.where(is_gone, math.inf, largest)
        # The sign with the larger judged phase need not be the sign with the larger quadratic phase.
        gain = np.broadcast_to(self.table.gain, size.shape)[is_large]
        judged = np.maximum(
            *(np.hypot(each[point_paths.QUADRATIC], gain * each[point_paths.HIDDEN]) for each in (ahead, back))
        )
        with np.errstate(invalid="ignore"):
            hidden = np.sqrt(np.maximum(judged**2 - effects.qpe[is_large] ** 2, 0.0)) / gain
        effects.hidden[is_large] = np.where(is_gone, 0.0, hidden)
        for (east, north), each in ((effects.displacement, ahead), (effects.opposite, back)):
            east[is_large], north[is_large] = each[point_paths.EAST], each[point_paths.NORTH]

    def followed(self, errors: Booleans, sizes: Floats) -> Floats:
        """Effects of the n errors marked in `errors`, for each sign, computed from exact ranges.

        `sizes` (n,) are the magnitudes of the errors.

        Returns an array (2, rows, n). The first axis is the sign of the errors, positive first. `point_paths.ROWS`
        lists the rows. Values are NaN where no ground point has the range history that the error causes.
        """
        lanes = np.concatenate(self._lanes_of(errors))
        both = np.tile(sizes, 2)
        self.paths.follow_to(lanes, both)
        return self.paths.known(lanes, both).reshape(len(ROWS), 2, -1).swapaxes(0, 1)

    @cached_property
    def _lane(self) -> Indices:
        """Index of the lane of each error with positive sign, (errors, cases).

        A lane is one error with one sign in one case. The lanes of an error with negative sign directly follow its
        lanes with positive sign.
        """
        first_lane = np.zeros((len(self.sources), 1), dtype=int)
        first_lane[self.moves, 0] = 2 * self.cases * np.arange(len(self.moves))
        return first_lane + np.arange(self.cases)

    def _lanes_of(self, errors: Booleans) -> tuple[Indices, Indices]:
        lanes = self._lane[errors]
        return lanes, lanes + self.cases

    @property
    def paths(self) -> PointPaths:
        """Paths of the image point as an error grows, for the errors of the block that displace the image.

        For each error, the paths for the positive sign come first, followed by the paths for the negative sign.
        """
        if self._follows is None:
            table, full = self.table, self.effects["full"]
            lanes = table.lanes(*(self.sources[index] for index in self.moves), signs=(1.0, -1.0))
            of_moving = FullEffect._make(column[self.moves] for column in full)
            moved = np.array(table.planes["full"].displacement(of_moving, 1.0))  # (2, moving, cases)
            per_unit = np.stack((moved, -moved), axis=2).reshape(2, -1)
            self._follows = PointPaths(self.exact, lanes, per_unit, is_alike=table.is_complete)
        return self._follows

    def forget(self) -> None:
        """Release the paths of the image point, which use much memory."""
        self._follows = None

    @cached_property
    def quadratic_by_sign(self) -> Floats:
        """Exact quadratic phases of the declared errors for each sign, positive first, (2, errors, cases). [rad]

        The errors have the sizes that the requirement on the quadratic phase judges.

        Values are NaN for errors whose first-order effect is accurate enough, and where the error with this sign
        leaves no image.
        """
        phases = np.full((2, *self.declared.shape), math.nan)
        is_large = self.is_declared_large
        if is_large.any():
            points = self.followed(is_large, np.abs(self.judged_sizes(QUADRATIC)[is_large]))
            phases[:, is_large] = points[:, point_paths.QUADRATIC]
        return phases

    # ---------------------------------------------------------------- allowable sizes
    @cached_property
    def farthest(self) -> Floats:
        """Size of each error at which the search for its allowable stops, in the unit of the error, (errors, cases).

        At this size the motion of a platform reaches `FARTHEST_RANGE_FRACTION` of its slant range. A larger error
        would not be a navigation error. A clock error of this size leaves no image. The size is infinite for an error
        that does not displace the image.
        """
        slant = [path.slant_range for path in self.table.geometries.both]
        size = np.full(self.declared.shape, math.inf)
        for index in self.moves:
            source = self.sources[index]
            reached = [slant[platform] for platform in source.platforms]
            if reached:
                nearer = np.minimum(reached[0], reached[-1]) if len(reached) > 1 else reached[0]
                size[index] = FARTHEST_RANGE_FRACTION * nearer / self.edge[index]
            else:
                # A clock error moves no platform. No range sum is shorter than the distance between the platforms,
                # which is at least the range sum less twice the nearer range. At this size no image is left.
                course = self.exact.clock_course(source.clock or ())
                size[index] = 2 * np.minimum(slant[0], slant[1]) / np.abs(course).max(axis=0)
        return size

    def allowed(self, model: str, limits: Sequence[PerCase | None], *, is_complete: bool) -> Allowed:
        """Allowable sizes of the errors according to a model; the parameters are those of `reaching`."""
        confidences = [self.table.confidence(requirement) for requirement in LIMITING_REQUIREMENTS]
        if not self.is_biased and not any(confidences):
            return self.reaching(model, limits, is_complete=is_complete)
        stated = {confidence for limit, confidence in zip(limits, confidences, strict=True) if limit is not None}
        if not self.is_biased and len(stated) == 1:
            reached, (level,) = self.reaching(model, limits, is_complete=is_complete), stated
            smallest, quadratic = (
                self._by_error(allowable_size, sizes, level) for sizes in (reached.smallest, reached.quadratic)
            )
            return Allowed(smallest, quadratic, reached.binding)
        shape = self.declared.shape
        sizes, ends = np.full((len(limits), *shape), math.nan), np.zeros((len(limits), *shape), dtype=bool)
        reaching: list[Floats | None] = [None] * len(limits)
        for index, (limit, confidence) in enumerate(zip(limits, confidences, strict=True)):
            if limit is not None:
                alone = [limit if other_index == index else None for other_index in range(len(limits))]
                reached = self.reaching(model, alone, is_complete=is_complete)
                reaching[index] = reached.smallest
                sizes[index] = self._by_error(allowable_size, reached.smallest, confidence)
                ends[index] = reached.binding == len(LIMITING_REQUIREMENTS)
        has_limit = ~np.isnan(sizes).all(axis=0)
        first = np.where(np.isnan(sizes), math.inf, sizes).argmin(axis=0)
        smallest, is_end = (np.take_along_axis(values, first[None], axis=0)[0] for values in (sizes, ends))
        binding = np.where(is_end, len(LIMITING_REQUIREMENTS), np.where(has_limit, first, -1)).astype(np.int8)
        uses = self.uses(reaching) if self.is_biased else None
        return Allowed(smallest, sizes[0] if is_complete else smallest, binding, uses)

    def reaching(self, model: str, limits: Sequence[PerCase | None], *, is_complete: bool) -> Allowed:
        """Sizes, of either sign, at which the effects of the errors reach limits, according to a model.

        Parameters
        ----------
        model : str
            `published` or `full`.
        limits : three of (errors, cases) or (cases,) or None
            Limits of quadratic phase [rad], cubic phase [rad] and displacement [m]; None means no limit.
        is_complete : bool
            Whether to search separately for the allowable that follows from the limit of the quadratic phase alone.
            If false, `quadratic` of the result equals `smallest`.
        """
        limit = np.array([self._limit(requirement, sizes) for requirement, sizes in enumerate(limits)])
        per_unit = self.per_unit(model)
        with np.errstate(all="ignore"):
            small = np.where((per_unit > 0) & ~np.isnan(limit), limit / per_unit, math.inf)
        required = [requirement for requirement, sizes in enumerate(limits) if sizes is not None]
        smallest_by_requirement = (
            self._searched(limit, small, required, is_complete=is_complete)
            if model == "full" and self.moves
            else small
        )
        smallest = smallest_by_requirement.min(axis=0)
        binding = np.where(np.isfinite(smallest), smallest_by_requirement.argmin(axis=0), -1).astype(np.int8)
        if model == "full":
            binding = np.where(self.ends_image(smallest), len(LIMITING_REQUIREMENTS), binding)
        smallest, quadratic = (
            np.where(np.isfinite(sizes), sizes, math.nan) for sizes in (smallest, smallest_by_requirement[0])
        )
        return Allowed(smallest, quadratic if is_complete else smallest, binding)

    def ends_image(self, size: Floats) -> Booleans:
        """Mark the errors that leave no image if they are larger than the given allowable size, (errors, cases).

        `size` (errors, cases) must come from an earlier search. Nothing is marked before the first search.
        """
        ends_there = np.zeros(size.shape, dtype=bool)
        if self._follows is not None:
            sizes = size[self.moves]
            ends = self._follows.end.reshape(len(self.moves), 2, -1)
            ends_there[self.moves] = (ends == sizes[:, None]).any(axis=1) & np.isfinite(sizes)
        return ends_there

    def _limit(self, requirement: int, limit: PerCase | None) -> Floats:
        """Limit of the requirement with the given index for each error, (errors, cases); NaN where there is no limit.

        For a pure phase error only the quadratic phase has a limit.
        """
        limit = math.nan if limit is None else limit
        limits = np.broadcast_to(limit, self.declared.shape)
        return limits if requirement == 0 else np.where(self.is_motion, limits, math.nan)

    def _searched(self, limit: Floats, small: Floats, required: Sequence[int], *, is_complete: bool) -> Floats:
        """Smallest sizes, of either sign, at which errors reach each of their limits, (3, errors, cases).

        `limit` has the limits of the three requirements, and `small` the sizes that follow from the first-order
        effects, both (3, errors, cases). `required` are the indices of the requirements that have a limit. The result
        is infinite where the search finds no size that reaches the limit.

        The search ends at the size from `farthest`, or at the declared size if that is larger. It also ends at the
        allowable that an earlier limit has already set; if `is_complete`, this does not apply to the limit of the
        quadratic phase. The limit that is most likely to bind is searched first.
        """
        most = np.fmax(self.farthest, np.abs(self.declared))
        smallest = np.full(small.shape, math.inf)
        searches = list[LimitSearches]()
        # If there are few searches, they run together.
        is_together = tries_several_sizes(2 * len(required) * self.declared.size, self.table.is_complete)
        for turn in np.array(required)[np.argsort(small[required], axis=0, kind="stable")]:
            of, first = (np.take_along_axis(sizes, turn[None], axis=0)[0] for sizes in (limit, small))
            is_alone = (turn == 0) & is_complete
            upto = np.minimum(most, np.where(is_alone, math.inf, smallest.min(axis=0)))
            with np.errstate(all="ignore"):
                adds = np.take_along_axis(self.adds(np.minimum(first, upto)), turn[None], axis=0)[0]
                is_searched = self._is_moving & (adds > SECOND_ORDER_FRACTION * of)
            at_once = np.where((first <= upto) & ~is_searched, first, math.inf)
            np.put_along_axis(smallest, turn[None], at_once[None], axis=0)
            if not is_searched.any():
                continue
            gain = np.broadcast_to(self.table.gain, is_searched.shape)[is_searched]
            numbers = (
                of[is_searched],
                gain,
                first[is_searched],
                upto[is_searched],
                np.flatnonzero(is_searched),
                is_alone[is_searched],
            )
            for lane in self._lanes_of(is_searched):
                searches.append(LimitSearches(lane, turn[is_searched], *numbers))
                if not is_together:
                    find_first_sizes(self.paths, searches.pop(), smallest.reshape(3, -1))
        if searches:
            find_first_sizes(self.paths, LimitSearches.joined(searches), smallest.reshape(3, -1))
        return smallest


def _less(shift: Vectors, velocity: Vectors, tag_s: Floats) -> Vectors:
    """Displacement of a platform that a time tag error causes, minus its first-order part `tag_s`·velocity. [m]"""
    (x, y, z), (u, v, w) = shift, velocity
    return (x - tag_s * u, y - tag_s * v, z - tag_s * w)


class DeclaredErrors:
    """Errors of a mission in many cases, with their effects and allowable sizes.

    All cases need the same number of nodes.

    Parameters
    ----------
    mission : Mission
        The mission. Some of its numbers may be arrays (cases,).
    cases : int
        Number of cases.
    geometries : BistaticGeometry
        Geometry of the cases.
    exact : ExactRanges
        Exact ranges of the cases.
    shown : container of str, optional
        Ids of the rows to list in addition to the declared errors. By default every row is listed.
    gain : float or (cases,)
        Factor by which autofocus raises the limit of quadratic phases. It does not apply to hidden phases, which
        autofocus does not correct.
    is_complete : bool
        Whether to compute all numbers of each row, with the same algorithm for any number of cases.

    Attributes
    ----------
    listed : list of ErrorSource
        All listed errors.
    stated : list of ErrorSource
        The declared errors along the axes in which the file states them.
    """

    def __init__(
        self,
        mission: Mission,
        cases: int,
        geometries: BistaticGeometry,
        exact: ExactRanges,
        shown: Container[str] | None = None,
        *,
        gain: PerCase = 1.0,
        is_complete: bool = False,
    ) -> None:
        self.mission, self.cases, self.geometries, self.exact = mission, cases, geometries, exact
        self.gain, self.is_complete = gain, is_complete
        self.has_direct_path = mission.has_direct_path
        self.each = np.arange(cases)
        published, self.published_angle_deg = published_planes(geometries)
        self.planes: dict[str, Any] = {"published": published, "full": OwnPlane()}
        half = exact.half
        self.edge = [kind.course(half) for kind in STATE_KINDS]
        quadratic, cubic, hidden, moved = exact.most_per_metre
        self.per_metre = np.array((quadratic + self.gain * hidden, cubic, moved))[:, None]
        quadratic, cubic = exact.k * np.hypot(*(np.abs(gradient[2:]) for gradient in exact.gradient))
        hidden = QUADRATIC_OF_VARIANCE * exact.k * np.sqrt(exact.matrix.least)
        self.per_stray = np.array((quadratic + self.gain * hidden, cubic, np.ones(cases)))[:, None]
        self.listed = list(ErrorListing(mission, geometries, exact, shown).listed())
        self.stated = [error for error in self.listed if error.declared is not None and error.is_independent]
        size = max(1, _LANES_AT_ONCE_COUNT // (2 * cases))
        starts = range(0, len(self.listed), size)
        self.blocks = [ErrorBlock(self, self.listed[start : start + size]) for start in starts]
        self._place = {error.id: divmod(place, size) for place, error in enumerate(self.listed)}
        self._does: dict[tuple[str, int], Declared] = {}
        self._judged: dict[tuple[str, int], Declared] = {}
        self._farthest: dict[tuple[str, int], tuple[Floats, Floats]] = {}

    def array(self, value: PerCase | PerCaseFlag | None) -> Floats:
        """Return a value as an array of numbers, one per case, (cases,); None becomes NaN."""
        return np.full(self.cases, value, dtype=float)

    def lanes(self, *errors: ErrorSource, signs: Sequence[float] = (1.0,)) -> Lanes:
        """Arrange one unit of each error, with each of the given signs, in lanes.

        A lane is one error with one sign in one case. The lanes are ordered by error, then by sign, then by case.
        """
        orders = [self._order(error) for error in errors]
        courses = np.array([self._course(error, order) for error, order in zip(errors, orders, strict=True)])
        at_nodes = np.moveaxis(courses[:, None] * np.array(signs)[:, None, None], 2, 0)
        order, moves, directions = (
            self._of_lanes(values, len(signs)) for values in (np.array(orders)[:, None], *_motions(errors))
        )
        case, tags = np.tile(self.each, len(errors) * len(signs)), None
        if any(error.is_time_tag for error in errors):
            is_tag = np.repeat([error.is_time_tag for error in errors], self.cases * len(signs))
            tags = TimeTags(self.geometries.both, self.exact.times, np.where(is_tag, case, -1))
        return Lanes(case, at_nodes.reshape(len(at_nodes), -1), moves, directions, order, tags)

    def _of_lanes(self, values: Any, signs: int) -> Any:
        """Arrange values (..., errors, cases) in lanes, (..., lanes), with a copy of each value for each sign.

        `signs` is the number of signs. If there is only a single error in a single case, the value is the same for
        all lanes, and the result is (..., 1).
        """
        *more, errors, cases = values.shape
        if errors == cases == 1:
            return values[..., 0]
        return np.broadcast_to(values[..., None, :], (*more, errors, signs, self.cases)).reshape(*more, -1)

    def edge_of(self, error: ErrorSource) -> PerCase:
        """Largest position error of a platform within the aperture per unit of an error. [m/unit]

        Errors of position, velocity and acceleration are evaluated at the aperture edge. A time tag error, or a
        motion that is given at the nodes over the aperture, is evaluated at all nodes, and the largest value is
        taken. If the error moves both platforms, the result is the larger value of the two. It is 0 for an error that
        moves no platform.
        """
        if not error.is_time_tag and error.shifts is None:
            return 0.0 if error.kind.order is None else self.edge[error.kind.order]
        farthest: Floats = np.max([norm(error.way_of(platform)).max(axis=0) for platform in error.platforms], axis=0)
        return farthest

    def bent(self, error: ErrorSource, size: Floats) -> Floats:
        """Largest higher-order part of the position error due to a time tag error, (cases,). [m]

        The higher-order part is the position error minus its first-order part, which is `size`, the size of the
        error, times the velocity. Its largest length over the aperture and over both signs of the error is taken. If
        the error belongs to both platforms, the largest lengths of both are added.
        """
        times, bend = self.exact.times, np.zeros(self.cases)
        for platform in error.platforms:
            path, straight = self.geometries.both[platform], error.direction_of(platform)
            bend += np.max(
                [np.asarray(norm(_less(path.later(times, tag), straight, tag))) for tag in (size, -size)],
                axis=(0, 1),
            )
        return bend

    def _order(self, error: ErrorSource) -> int:
        """Exponent of slow time in the position error due to an error, such as 1 for a velocity error.

        It is -1 for an error that moves no platform. It is 0 for a time tag error and for a motion that is given at
        the nodes over the aperture, because their directions already contain the variation over the aperture.
        """
        if not error.platforms:
            return -1
        return error.kind.order or 0 if error.shifts is None else 0

    def _course(self, error: ErrorSource, order: int) -> Floats:
        """Position error per unit of an error along the error's direction, at the nodes of the aperture. [m/unit]

        The result is (nodes, cases). For a time tag error, or a motion that is given at the nodes, it is 1, because
        the direction contains the motion. For an error that moves no platform the result is the range error.
        """
        exact = self.exact
        if order >= 0:
            return exact.powers[order]
        if error.clock is not None:
            return exact.clock_course(error.clock)
        # A pure phase error: a quadratic that displaces nothing.
        return np.asarray(((exact.times / exact.half) ** 2 - 1 / 3) / exact.k)

    def block_of(self, error: ErrorSource) -> tuple[ErrorBlock, int]:
        """Return the block that contains an error, and the error's index in the block."""
        block, index = self._place[error.id]
        return self.blocks[block], index

    def judged_size(self, error: ErrorSource, requirement: str) -> Floats:
        """Size of a declared error that a requirement judges, (cases,), in the unit of the error."""
        block, index = self.block_of(error)
        return np.asarray(block.judged_sizes(requirement)[index])

    def at_rms(self, model: str, error: ErrorSource) -> Declared | None:
        """Effects of the root mean square of a declared error, without the coverage factor, in arrays (cases,).

        The result is None if neither a bias nor a confidence makes it differ from the effects of the declared size.
        """
        block, index = self.block_of(error)
        if not block.is_biased and not any(map(self.confidence, LIMITING_REQUIREMENTS)):
            return None
        factor = self.mission.allocation.coverage_factor if error.is_covered else 1.0
        return block.does(model, np.hypot(block.declared / factor, block.bias)).of(index)

    def of_bias(self, model: str, error: ErrorSource) -> Declared:
        """Effects of the bias of a declared error alone according to a model, in arrays (cases,)."""
        block, index = self.block_of(error)
        return block.does(model, block.bias).of(index)

    def confidence(self, requirement: str) -> float | None:
        """Probability with which a requirement has to be kept; None if the file states no confidence for it."""
        return self.mission.requirements.confidence_of(requirement)

    def judged(self, model: str, error: ErrorSource) -> Declared:
        """Effects of an error at the sizes that requirements judge, according to a model, in arrays (cases,)."""
        block, index = self._place[error.id]
        return self.judged_of_block(model, block).of(index)

    def judged_of_block(self, model: str, block: int) -> Declared:
        """Effects of the errors of a block at the sizes that requirements judge, (errors, cases).

        Each effect is that of the size which its requirement judges. Without a bias and a confidence, it is the
        effect of the declared size.
        """
        key = (model, block)
        if key not in self._judged:
            errors, does = self.blocks[block], self.of_block(model, block)
            if errors.is_biased or any(map(self.confidence, LIMITING_REQUIREMENTS)):
                quadratic, cubic, location = (
                    errors.does(model, errors.judged_sizes(requirement)) for requirement in LIMITING_REQUIREMENTS
                )
                does = Declared(
                    quadratic.qpe,
                    cubic.cubic,
                    location.displacement,
                    location.opposite,
                    quadratic.hidden,
                    does.rest,
                )
            self._judged[key] = does
        return self._judged[key]

    def does(self, model: str, error: ErrorSource) -> Declared:
        """Phases and displacements that a declared error causes according to a model, in arrays (cases,)."""
        block, index = self._place[error.id]
        return self.of_block(model, block).of(index)

    def of_block(self, model: str, block: int) -> Declared:
        """Phases and displacements that the declared errors of a block cause according to a model, (errors, cases).

        `block` is the index of the block. The results are kept for later calls.
        """
        key = (model, block)
        if key not in self._does:
            self._does[key] = self.blocks[block].does(model, self.blocks[block].declared)
        return self._does[key]

    def farthest(self, model: str, error: ErrorSource) -> tuple[Floats, Floats]:
        """Displacement of the image by an error, east and north, for the sign that moves it farther. [m]

        The error has the size that the requirement on the location judges.

        Each component is (cases,). See `Declared.farthest`. The displacement is computed for all errors of a block at
        once.
        """
        block, index = self._place[error.id]
        key = (model, block)
        if key not in self._farthest:
            self._farthest[key] = self.judged_of_block(model, block).farthest
        east, north = self._farthest[key]
        return east[index], north[index]

    def is_large(self, error: ErrorSource) -> Booleans:
        """Mark the cases in which the effects of a declared error may not be proportional to its size."""
        block, index = self.block_of(error)
        return np.asarray(block.is_declared_large[index])

    def quadratic_by_sign(self, error: ErrorSource) -> Floats:
        """Exact quadratic phases of a declared error for each sign, positive first, (2, cases). [rad]

        Values are NaN where the first-order effect is accurate enough, or where the error with this sign leaves no
        image.
        """
        block, index = self.block_of(error)
        return block.quadratic_by_sign[:, index]

    def doubts(self, model: str, is_over: PerCaseFlag) -> PerCaseFlag:
        """Mark the cases in which the model that does not decide the verdict makes a result doubtful.

        `model` is the name of this model, and `is_over` marks the cases in which an effect according to it exceeds a
        limit. With a direct path the published model makes no result doubtful, because it does not include the direct
        path.
        """
        return False if model == "published" and self.has_direct_path else is_over

    def degeneracy(self, model: str, case: int = 0) -> Note:
        """Return a note explaining why a model gives no displacement of the image in a case.

        The note is empty if the model gives a displacement.
        """
        if model == "full" or not plain(self.planes[model].is_singular, case):
            return NOTHING
        degrees = plain(self.published_angle_deg, case)
        if degrees < MIN_GRADIENT_ANGLE_DEG:
            return phrases.note("no-displacement", degrees=degrees)
        return phrases.note("no-displacement-across", gradient=plain(np.hypot(*self.geometries.range_gradient), case))


def _motions(errors: Sequence[ErrorSource]) -> tuple[Floats, Floats]:
    """Platforms that each error moves, and the directions of the motion, in the form that `Lanes` uses.

    Returns two arrays. The first is (2, errors, 1), with 1 for a platform that the error moves and 0 for any other.
    The second has the directions, (2, 3, nodes, errors, cases). If no direction varies over the nodes or over the
    cases, the corresponding axis has length 1.
    """
    ways = [
        (platform, index, error.way_of(platform))
        for index, error in enumerate(errors)
        for platform in error.platforms
    ]
    arrays = [component for _, _, way in ways for component in way if isinstance(component, np.ndarray)]
    shapes = [(1, *array.shape)[-2:] for array in arrays if array.ndim]
    count, cases = (max(lengths) for lengths in zip((1, 1), *shapes, strict=True))
    moves, directions = np.zeros((2, len(errors), 1)), np.zeros((2, 3, count, len(errors), cases))
    for platform, index, way in ways:
        moves[platform, index] = 1.0
        for axis, component in enumerate(way):
            directions[platform, axis, :, index] = component
    return moves, directions


class Model:
    """The published or the full model, evaluated for one error at a time in a single case.

    Its methods take and return plain numbers. A missing value is None.
    """

    def __init__(self, errors: DeclaredErrors, name: str) -> None:
        self.errors, self.exact, self.name = errors, errors.exact, name
        self.is_published = name == "published"
        self.is_blind = self.is_published and errors.has_direct_path  # it does not include the direct path
        self.plane, self.degeneracy = errors.planes[name], errors.degeneracy(name)

    def effect(self, source: ErrorSource) -> Effect | FullEffect:
        """Effect of one unit of an error according to this model; the full model gives the first-order effect."""
        return source.effect if self.is_published else source.full

    def displacement(self, effect: Effect | FullEffect, size: float) -> GroundVector | None:
        """Displacement of the image on the ground, east and north, from the first-order effect of an error. [m]

        `effect` is the effect of one unit, and `size` is the size of the error in this unit. In the published model
        the displacement follows from equation (25) of Rigling & Moses. It is None if the matrix Q of this model has
        no usable inverse.
        """
        return point(self.plane.displacement(effect, size))

    def equation(self, source: ErrorSource) -> str:
        """Name of the equation, table or model from which the effect of an error follows."""
        return source.equation if self.is_published or not source.is_motion else "full model"

    def no_limit(self, source: ErrorSource) -> Note:
        """Return a note explaining why an error of any size stays within the limit of the quadratic phase."""
        if self.is_published or not source.is_heard:
            return source.no_limit
        return phrases.note("no-size-reaches-the-limit") if source.is_motion else phrases.note("no-quadratic-phase")

    def does(self, source: ErrorSource, size: float) -> Declared:
        """Phases and displacements that an error of the given size causes; `size` is in the unit of the error."""
        block, index = self.errors.block_of(source)
        sizes = np.full(block.declared.shape, math.nan)
        sizes[index] = size
        return block.does(self.name, sizes).of(index).in_one_case()

    def allowed(self, source: ErrorSource, limits: Sequence[float | None]) -> tuple[float | None, str | None]:
        """Smallest size, of either sign, at which an error reaches a limit, and the requirement that sets this size.

        The requirement is an entry of `LIMITING_REQUIREMENTS`, or `END_OF_IMAGE` if a larger error leaves no image.
        Both results are None if no size reaches a limit. `limits` are the limits of quadratic phase [rad], cubic
        phase [rad] and displacement [m]; None means no limit.
        """
        block, index = self.errors.block_of(source)
        limits_of_block: list[PerCase | None] = []
        for limit in limits:
            of_all = np.full(block.declared.shape, math.nan)
            of_all[index] = math.nan if limit is None else limit
            limits_of_block.append(None if limit is None else of_all)
        allowed_of_block = block.reaching(self.name, limits_of_block, is_complete=False)
        size, binding = plain(allowed_of_block.smallest[index]), int(allowed_of_block.binding[index, 0])
        return (None, None) if math.isnan(size) else (size, (*LIMITING_REQUIREMENTS, END_OF_IMAGE)[binding])

    def allowable(self, source: ErrorSource, requirement: str, limit: float) -> float | None:
        """Smallest size, of either sign, at which an error reaches the limit of a requirement.

        The result is None if no size reaches the limit.
        """
        return self.allowed(source, [limit if name == requirement else None for name in LIMITING_REQUIREMENTS])[0]

    def small(self, source: ErrorSource, requirement: str, limit: float) -> float:
        """Size at which an error would reach a limit if its effects were proportional to its size.

        The size is infinite if the error has no effect on the limited quantity.
        """
        block, index = self.errors.block_of(source)
        per_unit = float(block.per_unit(self.name)[LIMITING_REQUIREMENTS.index(requirement), index, 0])
        return limit / per_unit if per_unit else math.inf

    def hidden_per_unit(self, source: ErrorSource) -> float:
        """First-order hidden phase per unit of an error; 0 in the published model. [rad/unit]

        `Declared` defines the hidden phase, which autofocus does not correct.
        """
        block, index = self.errors.block_of(source)
        return 0.0 if self.is_published else float(block.hidden_per_unit[0, index, 0])

    def ends_image(self, source: ErrorSource, size: float) -> bool:
        """Whether an error that is larger than the given allowable size leaves no image.

        `size` must be the result of an earlier search. The result is always false in the published model.
        """
        block, index = self.errors.block_of(source)
        return not self.is_published and bool(block.ends_image(np.full(block.declared.shape, size))[index, 0])

    def is_linear_at(self, source: ErrorSource, requirement: str, limit: float) -> bool:
        """Whether the effects of an error are proportional to its size up to the size at which it reaches a limit.

        The result is always true in the published model.
        """
        block, index = self.errors.block_of(source)
        requirement_index = LIMITING_REQUIREMENTS.index(requirement)
        per_unit = block.per_unit(self.name)[requirement_index]
        with np.errstate(all="ignore"):
            first = np.minimum(np.where(per_unit > 0, limit / per_unit, math.inf), block.farthest)
            adds = block.adds(first)[requirement_index]
        return self.is_published or not source.displaces or bool(adds[index, 0] <= SECOND_ORDER_FRACTION * limit)

    # ---------------------------------------------------------------- by exact ranges
    def is_small(self, source: ErrorSource, size: float) -> bool:
        """Whether second-order bounds show that an error of the given size has effects proportional to its size."""
        block, index = self.errors.block_of(source)
        return not block.is_large(np.full(block.declared.shape, size))[index, 0]

    def at(self, source: ErrorSource, size: float) -> ExactEffect | None:
        """Phases and displacement due to an error of the signed size `size`; None if the error leaves no image.

        They are computed from exact ranges.
        """
        block, index = self.errors.block_of(source)
        is_asked = np.zeros(block.declared.shape, dtype=bool)
        is_asked[index] = True
        points = block.followed(is_asked, np.array([abs(size)]))[0 if size > 0 else 1]
        _, east, north, *phases, _ = points[:, 0].tolist()
        return None if math.isnan(east) else ExactEffect((east, north), *phases)

    def largest_range_error(self, source: ErrorSource) -> float:
        """Largest magnitude over the aperture of the first-order range error at the scene centre. [m/unit]"""
        return float(np.abs(self.exact.range_error(self.errors.lanes(source))).max())

    def left_over(self, source: ErrorSource, size: float, point: GroundVector) -> Sequence[float]:
        """Range error over the aperture that remains if an error of the given size moves the image to a ground point.

        `point` [m] is this ground point, east and north of the scene centre. Returns the range error [m] at each
        node, (nodes,).
        """
        remaining = self.exact.left_over(self.errors.lanes(source), np.array([size]), point)
        range_error: list[float] = remaining[:, 0].tolist()
        return range_error

    def left_over_small(self, source: ErrorSource, size: float) -> Sequence[float]:
        """First-order range error over the aperture that remains at the point to which an error moves the image. [m]

        `size` is the size of the error in its unit. Returns the range error at each node, (nodes,).
        """
        east, north = self.displacement(source.full, size) or (0.0, 0.0)
        by_east, by_north = self.exact.slopes
        remaining = size * self.exact.range_error(self.errors.lanes(source)) + east * by_east + north * by_north
        range_error: list[float] = remaining[:, 0].tolist()
        return range_error
