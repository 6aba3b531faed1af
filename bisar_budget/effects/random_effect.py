"""Effects of random errors on the image, for one unit (1 sigma) of each error in each case.

A random error has a sigma and no sign. Its range error over the aperture is expanded in Legendre polynomials. Orders
0 and 1 displace the image; orders 2 and higher defocus it. The published model uses the line of sight at mid-aperture
(`theory.random_errors`) and computes the displacement with the inverse of the matrix Q, equation (25) of Rigling &
Moses. The full model includes the turn of the line of sight, a direct path from transmitter to receiver, and the
phase that the displacement adds.

The numbers in a mission may be arrays (cases,). The geometry then has the same cases.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from bisar_budget.arrays import Floats, Indices, PerCase, PerCaseFlag
from bisar_budget.constants import VECTOR_ROUNDING_FRACTION
from bisar_budget.effects.declared import CUBIC, LOCATION, QUADRATIC, ImagePlane, published_planes
from bisar_budget.effects.effect import Subject, plain
from bisar_budget.effects.error_quantiles import allowable_size, judged_size, normal_length_ratio, quantile_factor
from bisar_budget.effects.range_processes import (
    RangeEffects,
    effect_weights,
    effects_of_courses,
    effects_of_gauss_markov,
    effects_of_process,
)
from bisar_budget.effects.sources import exact_ranges
from bisar_budget.effects.spectra import Parts
from bisar_budget.error_kinds.kind import SourceKind
from bisar_budget.faults import KeyPath
from bisar_budget.geometry import BistaticGeometry, PlatformState
from bisar_budget.image_plane import LEGENDRE_LEADING, nodes_for
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import MotionError
from bisar_budget.phrases import NOTHING, Note
from bisar_budget.ranges.exact_ranges import QUADRATIC_OF_VARIANCE, ExactRanges

if TYPE_CHECKING:
    from bisar_budget.effects.aided_navigation import NavigationErrors
    from bisar_budget.effects.oscillators import Noise

# Numbers of nodes at which random errors are sampled. Fewer nodes distinguish too few orders of a process. More nodes
# cost seconds. The largest number is enough for a path of nine circles. The smallest number gives every effect to
# 1e-3 on a race track of 70 pieces.
FEWEST_EFFECT_NODES, MOST_EFFECT_NODES = 16, 64
_CANCELLED_SQUARE_FRACTION = VECTOR_ROUNDING_FRACTION * 1e-2  # of the size; a smaller square is rounding


# Indices of effects in the order of `range_processes.effect_weights`.
QUADRATIC_INDEX, PLACE_INDICES, HIDDEN_INDICES = 0, (2, 3), (4, 5, 6, 7)

Value = TypeVar("Value")  # a number, an array (cases,), or a tuple of them


class RandomEffect(NamedTuple):
    """Effect of one unit of a random error on the image: sigmas of phases and displacement, and their covariance.

    `quadratic` and `cubic` [rad/unit] are the phases at the aperture edge. `spread` [rad/unit] is the rms phase
    beyond the cubic. It represents a mean power, so it never includes the coverage factor. `east` and `north`
    [m/unit] are the sigmas of the displacement. They are NaN if the displacement is unknown, as for a free
    oscillator.

    `covariance` (8, 8, ...) is the covariance of quadratic phase, cubic phase, displacement east and north, and the
    four parts of the hidden phase, in the products of their units and in the order of `effect_weights`. It is None in
    the published model, which has only the sigmas.

    `hidden` [rad/unit] represents the part of the range error that remains for any displacement of the image; this
    part is mainly constant and linear in time. The hidden phase is the quadratic phase that lowers the peak as much
    as this part does. Autofocus cannot correct it, see `ranges.exact_ranges`. Its square is the sum of the variances
    of its four parts. If a line of sight turns by more than a radian, the square also contains the power beyond the
    cubic order, which is not in `covariance`.

    `rest` [rad/unit] is the rms phase beyond the cubic for an error that is not noise, such as a bias. It is the
    value at one sigma, without the coverage factor. It spreads power, as does the phase beyond the cubic due to any
    motion error.
    """

    quadratic: Any
    cubic: Any
    spread: Any
    east: Any
    north: Any
    covariance: Floats | None = None
    hidden: Any = 0.0
    rest: Any = 0.0

    def judged(self, gain: PerCase) -> PerCase:
        """Phase per unit of error, for comparison with a limit that includes the autofocus gain. [rad/unit]

        `gain` is the autofocus gain. The limit is raised for the hidden phase too, although autofocus does not
        correct it. The hidden phase is therefore multiplied by the gain. See `Declared.judged`.
        """
        phase: PerCase = np.hypot(self.quadratic, gain * self.hidden)
        return phase

    @property
    def displacement(self) -> PerCase:
        """Rms length of the displacement; NaN if the displacement is unknown. [m/unit]"""
        length: PerCase = np.hypot(self.east, self.north)
        return length

    def of(self, case: int) -> "RandomEffect":
        """Return the effect in the case with the given index, as plain numbers.

        The covariance is (8, 8), or None if the effect has no covariance.
        """
        covariance = self.covariance
        if covariance is not None:
            covariance = covariance[..., case if covariance.shape[-1] > 1 else 0]
        quadratic, cubic, spread, east, north = (plain(size, case) for size in self[:5])
        hidden, beyond_cubic = plain(self.hidden, case), plain(self.rest, case)
        return RandomEffect(quadratic, cubic, spread, east, north, covariance, hidden, beyond_cubic)

    def times(self, factor: PerCase) -> "RandomEffect":
        """Multiply the phases and the displacement by a coverage factor, and their covariance by its square.

        `spread` and `rest` do not change.
        """
        return RandomEffect(
            self.quadratic * factor,
            self.cubic * factor,
            self.spread,
            self.east * factor,
            self.north * factor,
            None if self.covariance is None else self.covariance * factor**2,
            self.hidden * factor,
            self.rest,
        )


class Moves(NamedTuple):
    """Motion of a platform due to one unit (1 sigma) of a random error.

    `place` is the index of the platform. `ways` (ways, 3, nodes or 1, cases) [m/unit] are vectors along which the
    platform moves. `courses` (courses, nodes, cases or 1) are variations over the aperture, at the nodes of
    `SensorCases.exact`.

    Each pair of a vector v from `ways` and a variation s from `courses` has its own independent random number x of
    variance 1. The motion is the sum of x·v·s over all pairs. If an error has several `Moves`, pairs with the same
    indices have the same random number in each of them.
    """

    place: int
    ways: Floats
    courses: Floats


class BiasEffects(NamedTuple):
    """Bias of an error, and the signed effects of one unit of it in both models.

    The effects of the full model have the order of `range_processes.effect_weights`, (8, ...), and those of the
    published model are its first four. They are phases [rad/unit] and displacements [m/unit].
    """

    bias: PerCase
    published: Floats
    full: Floats

    def of(self, case: int) -> "BiasEffects":
        """Return the bias and its effects in the case with the given index."""
        published, full = (
            effects[..., case if effects.shape[-1] > 1 else 0] for effects in (self.published, self.full)
        )
        return BiasEffects(plain(self.bias, case), published[:, None], full[:, None])

    def signed(self, model: str) -> Floats:
        """Effects of the bias in a model, in the order of `published` or `full`: phases [rad], displacements [m]."""
        return np.asarray(self.bias * (self.full if model == "full" else self.published))

    def sizes(self, model: str, gain: PerCase) -> tuple[Floats, Floats, Floats]:
        """Magnitudes of judged phase, cubic phase and displacement due to the bias; see `Declared.judged`."""
        effects = self.signed(model)
        judged = np.sqrt(effects[0] ** 2 + gain**2 * np.square(effects[4:]).sum(axis=0))
        return judged, np.abs(effects[1]), np.hypot(effects[2], effects[3])


class RandomError(NamedTuple):
    """Random error of a sensor, a clock or the air: its subject, its declared size and the effect of one unit.

    `declared` is the declared size, coverage factor included; None if the file declares no size. For an error along
    several axes it is the largest size of all axes, and the sizes of all axes are proportional to it. For an
    oscillator the size is a factor on the amplitude of its noise, and the declared size is 1. The unit is
    nevertheless `dB`, because the row shows this factor in decibels. `noise` is the spectrum of an oscillator; it is
    None if the numbers are arrays over cases, and for errors of any other kind. `noise_in_case` computes the spectrum
    from the mission of one case and the name of the platform. `navigation` is the covariance of an aided navigation,
    and None for errors of any other kind. `spreads` is true for noise, and false for an error whose variation over
    the aperture has only a few orders.

    `biased` is the bias of the error with its effects, and None if the file states no bias.

    `counted_in` is the id of another row that already includes the effect of this error. This error is then left out
    of sums. `moves` is the motion of platforms due to one unit, used for the edge of a scene. It is empty for clocks
    and the air. `continued` is the effect of the spectrum that is assumed below the first point of an oscillator's
    mask. It is None if the mask begins at a sufficiently low frequency. `is_in_doubt` marks the cases in which the
    spectrum used for an oscillator may differ from its actual spectrum.
    """

    subject: Subject
    unit: str
    declared: Any
    path: KeyPath
    published: RandomEffect
    full: RandomEffect
    noise: "Noise | None" = None
    spreads: bool = True
    counted_in: str = ""
    moves: tuple[Moves, ...] = ()
    continued: RandomEffect | None = None
    is_in_doubt: PerCaseFlag = False
    noise_in_case: "Callable[[Mission, str], Noise] | None" = None
    navigation: "NavigationErrors | None" = None
    biased: BiasEffects | None = None

    @property
    def id(self) -> str:
        """Id of the error's row."""
        return self.subject.id

    @property
    def owner(self) -> str:
        """Owner of the budget share to which the error belongs: transmitter, receiver, clock or mission."""
        return self.subject.owner

    @property
    def kind(self) -> SourceKind:
        """Kind of the error, which holds the properties that all errors of the kind share."""
        return self.subject.source_kind

    @property
    def equation(self) -> str:
        """Name of the equation or method from which the effect of the error follows, for reports."""
        return self.kind.size(self.subject.axis).equation

    @property
    def is_covered(self) -> bool:
        """Whether the declared size or its effect includes the coverage factor.

        It is false only for an error of the kind `other`, for which the file states an effect that the user has
        determined.
        """
        return self.kind.is_covered

    def coverage(self, mission: Mission) -> PerCase:
        """Coverage factor included in the effect of the declared size; 1 if `is_covered` is false."""
        return mission.allocation.coverage_factor if self.is_covered else 1.0

    @property
    def extrapolated(self) -> Note:
        """Note on how an oscillator's noise continues beyond the stated points; empty if `noise` is None."""
        return NOTHING if self.noise is None else self.noise.extrapolated

    @property
    def displaces_unknown(self) -> PerCaseFlag:
        """Mark the cases in which the declared error displaces the image by an unknown amount.

        The result is False if the file declares no size.
        """
        return False if self.declared is None else (self.declared > 0) & np.isnan(self.full.displacement)

    def effect(self, model: str) -> RandomEffect:
        """Effect of one unit of the error in the model with the given name, `full` or `published`."""
        return self.full if model == "full" else self.published

    def judged(self, model: str, confidence_of: Callable[[str], float | None], gain: PerCase) -> RandomEffect:
        """Effect of the declared error as the requirements judge it, with its bias; see `judged_effect`.

        The displacement of a biased error has no direction, and is given to the east. The rms phases beyond the cubic
        and the covariance are those of one unit.
        """
        effect = self.judged_effect(model, confidence_of, gain)
        if self.biased is None:
            return effect._replace(
                quadratic=effect.quadratic * self.declared,
                hidden=effect.hidden * self.declared,
                cubic=effect.cubic * self.declared,
                east=effect.east * self.declared,
                north=effect.north * self.declared,
            )
        phase, edge, length = (
            judged_size(self.distribution, sigma * self.declared, bias, confidence_of(key))
            for key, sigma, bias in zip(
                (QUADRATIC, CUBIC, LOCATION), self._sigmas(model, gain), self.biased.sizes(model, gain), strict=True
            )
        )
        return effect._replace(quadratic=phase, hidden=0.0, cubic=edge, east=length, north=0.0 * length)

    def _sigmas(self, model: str, gain: PerCase) -> tuple[PerCase, PerCase, PerCase]:
        """Sigmas of judged phase, cubic phase and length of the displacement due to one unit of the error."""
        effect = self.effect(model)
        return effect.judged(gain), effect.cubic, effect.displacement

    def uses(
        self,
        model: str,
        limits: Sequence[PerCase | None],
        confidence_of: Callable[[str], float | None],
        gain: PerCase,
    ) -> tuple[Floats, list[PerCase]]:
        """Utilization of limits by an error with a bias, and the sizes of its random part that use them up.

        `limits` are the limits of quadratic phase with the gain of autofocus, cubic phase, and displacement; None
        means no limit. The random part of the displacement is taken along the bias, which is exact for a constant
        delay and large for a changing one. Returns the largest utilization, and a size for each limit.
        """
        assert self.biased is not None
        judged = self.judged(model, confidence_of, gain)
        uses: Floats = np.zeros(np.shape(judged.quadratic))
        sizes: list[PerCase] = []
        values = (judged.quadratic, judged.cubic, judged.displacement)
        rows = zip(
            limits,
            values,
            self._sigmas(model, gain),
            self.biased.sizes(model, gain),
            (QUADRATIC, CUBIC, LOCATION),
            strict=True,
        )
        for limit, value, sigma, bias, key in rows:
            if limit is None:
                sizes.append(math.inf)
                continue
            uses = np.maximum(uses, value / limit)
            most = allowable_size(self.distribution, limit, bias, confidence_of(key))
            with np.errstate(all="ignore"):
                sizes.append(np.where(np.asarray(sigma) > 0, most / sigma, np.where(bias > limit, 0.0, math.inf)))
        return uses, sizes

    @property
    def distribution(self) -> str:
        """Distribution of the random part: normal, or a bound for an effect that the file states."""
        return "normal" if self.is_covered else "bound"

    def judged_effect(self, model: str, confidence_of: Callable[[str], float | None], gain: PerCase) -> RandomEffect:
        """Effect of one unit of the error as the requirements judge it: each phase and displacement at its quantile.

        Without a confidence it is the effect at one sigma. `confidence_of` gives the confidence of a requirement, and
        `gain` is the autofocus gain, which enters the proportion of quadratic and hidden phase. The covariance is
        that of one sigma.
        """
        effect = self.effect(model)
        quadratic, cubic, location = map(confidence_of, (QUADRATIC, CUBIC, LOCATION))
        if not self.is_covered or not any((quadratic, cubic, location)):
            return effect
        of_phase = self._quantile_ratio(effect, (QUADRATIC_INDEX, *HIDDEN_INDICES), quadratic, gain)
        of_displacement = self._quantile_ratio(effect, PLACE_INDICES, location)
        return effect._replace(
            quadratic=effect.quadratic * of_phase,
            hidden=effect.hidden * of_phase,
            cubic=effect.cubic * quantile_factor("normal", cubic),
            east=effect.east * of_displacement,
            north=effect.north * of_displacement,
        )

    @staticmethod
    def _quantile_ratio(
        effect: RandomEffect, indices: Sequence[int], confidence: float | None, gain: PerCase = 1.0
    ) -> PerCase:
        """Quantile of the length of several effects together, divided by the rms length; 1 without a confidence."""
        if confidence is None:
            return 1.0
        if effect.covariance is None:  # the published model has sigmas only
            sigmas = (effect.east, effect.north) if len(indices) == 2 else (effect.quadratic,)
            variances = np.array(np.broadcast_arrays(*(np.atleast_1d(sigma) ** 2 for sigma in sigmas)))
            covariance = variances[:, None] * np.eye(len(sigmas))[..., None]
        else:
            weights = np.ones((len(indices), np.size(gain)))
            weights[1:] *= gain if len(indices) > 2 else 1.0
            covariance = effect.covariance.reshape(*effect.covariance.shape[:2], -1)[np.ix_(indices, indices)]
            covariance = covariance * weights[:, None] * weights
        return normal_length_ratio(covariance, confidence)


class SensorCases:
    """Geometry and exact ranges of many cases, from which the effects of random errors are computed.

    The last axis of each array is the axis of cases.
    """

    def __init__(self, mission: Mission, geometry: BistaticGeometry, cases: int) -> None:
        self.mission, self.geometry, self.cases = mission, geometry, cases
        self.sights = geometry.sights(has_direct_path=mission.has_direct_path)
        self.factor = mission.allocation.coverage_factor
        self.aperture_time = np.broadcast_to(np.asarray(mission.collection.aperture_time), (cases,))

    @property
    def has_edge(self) -> bool:
        """Whether the mission states a scene radius, so that effects at the edge of the scene are needed."""
        return self.mission.scene.radius is not None

    def vector(self, values: Sequence[PerCase]) -> Floats:
        """Convert three components, each a number or (cases,), to one array (3, cases)."""
        numbers = np.empty((3, self.cases))
        for row, value in zip(numbers, values, strict=True):
            row[:] = value
        return numbers

    def error(self, name: str) -> MotionError:
        """Motion error that the mission declares for the platform with the given name."""
        motion_error: MotionError = getattr(self.mission.platforms, name).motion_error
        return motion_error

    def axes(self, name: str, frame: str = "") -> Floats:
        """Axes of a frame at the platform `name`, as unit vectors in scene coordinates, (axes, 3, cases).

        `frame` is the name of the frame. If it is empty, the frame of the platform's motion error in the file is
        used.
        """
        path: PlatformState = getattr(self.geometry, name)
        return np.array([self.vector(axis) for axis in path.frame(frame or self.error(name).frame)])

    def along(self, name: str, directions: Floats) -> Floats:
        """Root-sum-square of the projections of vectors on a platform's line of sight at mid-aperture, (cases,).

        `name` is the name of the platform. `directions` are the vectors, (axes, 3, cases). The result has their unit.
        """
        look = self.vector(getattr(self.geometry, name).look)
        return np.asarray(np.sqrt(np.square((directions * look).sum(axis=1)).sum(axis=0)))

    @cached_property
    def exact(self) -> ExactRanges:
        """Exact ranges of the cases, at enough nodes to resolve the paths and the random errors."""
        count = nodes_for(self.geometry, self.aperture_time, has_direct_path=self.mission.has_direct_path)
        count = min(MOST_EFFECT_NODES, max(FEWEST_EFFECT_NODES, int(np.max(count))))
        return exact_ranges(self.mission, self.geometry, count, self.cases)

    @cached_property
    def weights(self) -> Floats:
        """Effects on the image per metre of range error at each node, (8, nodes, cases); see `effect_weights`."""
        return effect_weights(self.exact)

    @cached_property
    def plane(self) -> ImagePlane:
        """Matrix Q⁻¹ of Rigling & Moses, which maps constant and linear range errors to displacements."""
        return published_planes(self.geometry)[0]

    def of_courses(self, courses: Floats, at_mid_aperture: Floats) -> tuple["RandomEffect", "RandomEffect"]:
        """Effects, in both models, of independent range errors with a known variation over the aperture.

        The size of each range error is random, with a sigma of one unit.

        Parameters
        ----------
        courses : (errors, nodes, cases)
            Range errors along the turning line of sight, as the data contain them. [m/unit]
        at_mid_aperture : (errors, nodes, cases)
            Range errors along the fixed line of sight at mid-aperture, for the published model. [m/unit]

        Returns
        -------
        published, full : RandomEffect
            Effect of all errors together in the published and in the full model.
        """
        k, orders = self.exact.k, np.einsum("fn,enc->fec", self.exact.fit, at_mid_aperture)
        orders = np.where(
            np.abs(orders) > VECTOR_ROUNDING_FRACTION * np.abs(at_mid_aperture).max(axis=1), orders, 0.0
        )
        quadratic, cubic = np.sqrt(np.square(orders[2:]).sum(axis=1))
        # The constant and linear order of one error are fully correlated, unlike those of noise: add with signs.
        (a, b), (c, d) = self.plane.adjugate
        scale = 1 / np.where(self.plane.is_singular, math.nan, self.plane.determinant)
        constant, linear = orders[0], orders[1] / self.exact.half
        moved = [np.sqrt(np.square((u * constant + v * linear) * scale).sum(axis=0)) for u, v in ((a, b), (c, d))]
        published = RandomEffect(k * quadratic, k * cubic, 0.0 * k, *moved)
        effects = effects_of_courses(self.exact, self.weights, courses)
        (qpe, edge, east, north, hidden), covariance = sigmas(effects.covariance, effects.sizes)
        beyond_cubic, is_turned = k * np.sqrt(effects.left), self.exact.is_turned
        # If a line of sight turns widely, orders lose their meaning: count all beyond the cubic as hidden phase.
        hidden = np.hypot(hidden, np.where(is_turned, QUADRATIC_OF_VARIANCE * beyond_cubic, 0.0))
        beyond_cubic = np.where(is_turned, 0.0, beyond_cubic) / self.factor
        return published, RandomEffect(qpe, edge, 0.0 * k, east, north, covariance, hidden, beyond_cubic)

    def of_gauss_markov(
        self, courses: Floats, correlation_time: PerCase, *, is_phase_advanced: bool = False
    ) -> RandomEffect:
        """Effect, in the full model, of independent range errors that change as Gauss–Markov processes of variance 1.

        Parameters
        ----------
        courses : (errors, nodes, cases)
            Range error per unit of each process along the turning line of sight, as the data contain it. [m/unit]
        correlation_time : float or (cases,)
            Correlation time of the processes. [s]
        is_phase_advanced : bool
            Whether the phase error has the opposite sign of the group delay, see `effects_of_gauss_markov`.
        """
        ratio = self.exact.half / correlation_time
        return self._of_noise(
            effects_of_gauss_markov(self.exact, self.weights, courses, ratio, is_phase_advanced=is_phase_advanced)
        )

    def of_process(self, covariance: Floats, beyond: PerCase) -> RandomEffect:
        """Effect, in the full model, of a random range error with a given covariance over the aperture.

        `covariance` (nodes, nodes, cases) [m²] is the covariance of the range error between the nodes. `beyond`
        (cases,) [m²] is its mean square in the orders that the nodes cannot distinguish. See `effects_of_process`.
        """
        return self._of_noise(effects_of_process(self.exact, self.weights, covariance, beyond))

    def _of_noise(self, effects: RangeEffects) -> RandomEffect:
        (quadratic, cubic, east, north, hidden), covariance = sigmas(effects.covariance, effects.sizes)
        # The declared size includes the coverage factor, which does not apply to the spread, a mean power.
        spread = self.exact.k * np.sqrt(np.maximum(effects.left, 0.0)) / self.factor
        return RandomEffect(quadratic, cubic, spread, east, north, covariance, hidden)

    def of_motion(self, platform_index: int, moved: Floats) -> tuple["RandomEffect", "RandomEffect"]:
        """Effects, in the published and in the full model, of independent random position errors of a platform.

        `moved` (errors, 3, nodes, cases) [m/unit] are the position errors at the nodes over the aperture.
        """
        look = self.vector(self.geometry.both[platform_index].look)
        return self.of_courses(self.range_errors(platform_index, moved), -np.einsum("ac,eanc->enc", look, moved))

    def range_errors(self, platform_index: int, moved: Floats) -> Floats:
        """Range errors over the aperture due to small position errors of a platform, (errors, nodes, cases). [m]

        `moved` (errors, 3, nodes or 1, cases) [m] are the position errors.
        """
        x, y, z = np.moveaxis(moved, 1, 0)
        return self.exact.along(platform_index, (x, y, z))

    def moved(self, constant: PerCase, linear: PerCase, both: PerCase = 0.0) -> tuple[PerCase, PerCase]:
        """Sigmas of the displacement east and north due to a random range error, in the published model. [m]

        They follow from equation (25) of Rigling & Moses.

        `constant` and `linear` [m²] are the mean squares of the constant and the linear part of the range error at
        the aperture edge. `both` [m²] is the mean product of the two parts. The sigmas are NaN where the matrix Q is
        singular.
        """
        half = self.aperture_time / 2
        slope, product = linear / half**2, 2 * both / half
        scale = np.abs(1 / np.where(self.plane.is_singular, math.nan, self.plane.determinant))
        east, north = (
            np.sqrt(np.maximum(a**2 * constant + a * b * product + b**2 * slope, 0.0)) * scale
            for a, b in self.plane.adjugate
        )
        return east, north

    @cached_property
    def orders(self) -> Floats:
        """Legendre polynomials of order 0 to 3 at the nodes over the aperture, (nodes, 4), scaled as in `orders_at`.

        The leading term of each polynomial has the size 1 at the aperture edge.
        """
        return orders_at(self.exact.sampling.places)

    def of_orders(self, covariance: Floats, along: PerCase = 1.0) -> tuple[Sequence[Floats], Floats]:
        """Sigmas and covariance of the effects of random errors, from the covariance of their Legendre orders 0 to 3.

        The result has the form described in the function `sigmas`. Each error is a random combination of the
        polynomials in `orders`. `covariance` (4, 4, ...) [m²] is the covariance of the four coefficients; it is the
        same for all errors, and the errors are independent of each other. `along` (errors, nodes, cases) is the
        change of the range per metre of each error. Orders above 3 are not included. They defocus and displace the
        image only to second order in the angle by which the line of sight turns.
        """
        covariance_of_cases = covariance if covariance.ndim == 3 else covariance[..., None]
        covariance_of_cases = np.broadcast_to(covariance_of_cases, (*covariance_of_cases.shape[:2], self.cases))
        orders = self.orders
        seen = np.broadcast_to(along, (np.shape(along)[0] if np.ndim(along) else 1, len(orders), self.cases))
        effects = np.einsum("fnc,anc,no->afoc", self.weights, seen, orders)
        total = np.asarray(np.einsum("afoc,opc,agpc->fgc", effects, covariance_of_cases, effects))
        return sigmas(total, np.einsum("ffc->fc", total))

    def courses(self, covariance: Floats) -> Floats:
        """Variations over the aperture that represent a random error with a given covariance.

        The random error is the sum of the variations, each multiplied by an independent random number of variance 1.
        `covariance` (4, 4, ...) is the covariance of the coefficients with which the error combines the polynomials
        in `orders`. The result is (4, nodes, ...), in the square root of the unit of `covariance`.
        """
        of_orders = factor(np.moveaxis(covariance.reshape(4, 4, -1), 2, 0))
        return np.asarray(np.einsum("no,cof->fnc", self.orders, of_orders))

    def of_parts(self, noise: Parts, along: PerCase = 1.0) -> tuple["RandomEffect", "RandomEffect"]:
        """Effects, in both models, of noise with given mean squares of its Legendre parts over the aperture.

        `noise` [m²] are the mean squares. `along` (nodes, cases) is the range error in the data per metre of the
        noise. Orders 0 to 3 displace and defocus the image, and the part beyond them spreads power. The result is
        accurate to 5 % and 0.5 dB for a line of sight that turns by up to 1 rad. Over a full circle it has the same
        accuracy, with two exceptions: for noise as steep as f⁻⁴ the spread is wrong by 1 dB, and the location error
        of free clocks is wrong by 8 % (`tests/effects/test_long_noise.py`).
        """
        k = 2 * math.pi / np.asarray(self.mission.radar.wavelength)
        quadratic, cubic, spread = (k * np.sqrt(mean_square) for mean_square in noise[:3])
        published = RandomEffect(quadratic, cubic, spread, *self.moved(noise.constant, noise.linear))
        along = along + np.zeros_like(self.exact.times)
        (quadratic, cubic, east, north, hidden), covariance = self.of_orders(noise.covariance, along[None])
        spread = spread * np.sqrt(self.exact.fit[0] @ np.square(along))
        return published, RandomEffect(quadratic, cubic, spread, east, north, covariance, hidden)

    def alike(self, value: Value) -> Iterator[tuple[Value, Indices]]:
        """Group the cases for which all arrays in `value` have the same numbers.

        Yields, for each group, a copy of `value` with plain numbers in place of arrays, and the indices of its cases.
        """
        arrays = list(_arrays_in(value))
        if not arrays:
            yield value, np.arange(self.cases)
            return
        rows, group = np.unique(np.stack(arrays, axis=1), axis=0, return_inverse=True)
        for group_index, row in enumerate(rows.tolist()):
            yield _with_numbers(value, iter(row)), np.flatnonzero(group.ravel() == group_index)


def orders_at(slow_times: Floats) -> Floats:
    """Legendre polynomials of order 0 to 3 at slow times, (times, 4), scaled as the orders in `Parts`.

    `slow_times` (times,) are in units of half the aperture time. Each polynomial is scaled so that its leading term
    has the size 1 at the aperture edge.
    """
    return np.asarray(np.polynomial.legendre.legvander(slow_times, LEGENDRE_LEADING.size - 1) / LEGENDRE_LEADING)


def _arrays_in(value: object) -> Iterator[Floats]:
    if isinstance(value, tuple):
        for value_part in value:
            yield from _arrays_in(value_part)
    elif isinstance(value, np.ndarray):
        yield value


def _with_numbers(value: Any, numbers: Iterator[float]) -> Any:
    """Copy a value or a nested tuple of values, and replace each array in it by the next number of `numbers`."""
    if isinstance(value, tuple):
        values = [_with_numbers(value_part, numbers) for value_part in value]
        return value._make(values) if hasattr(value, "_make") else tuple(values)
    return next(numbers) if isinstance(value, np.ndarray) else value


def parts_of_largest(values: Floats) -> tuple[Floats, Floats]:
    """Largest value over all axes, (cases,), and the ratio of the value on each axis to it, (axes, cases).

    `values` (axes, cases) are not negative. The ratio is 1 where the largest value is 0.
    """
    largest = values.max(axis=0)
    return largest, np.divide(values, largest, out=np.ones_like(values), where=largest > 0)


def sigmas(covariance: Floats, sizes: Floats) -> tuple[Sequence[Floats], Floats]:
    """Sigmas of the effects of random errors, and their covariance (8, 8, cases) without rounding errors.

    `covariance` (8, 8, cases) is the covariance of all effects, in the order of `SensorCases.weights`. The result has
    five sigmas: quadratic phase, cubic phase, displacement east, displacement north, and hidden phase. The hidden
    phase is the root-sum-square of its four parts.

    If terms cancel exactly, a variance is only rounding error. It is then small compared with the squared magnitude
    in `sizes` (8, cases). Such a variance is set to 0, because a limit computed from it would be meaningless.
    """
    squares = np.einsum("ffc->fc", covariance)
    is_real = squares > _CANCELLED_SQUARE_FRACTION * sizes
    squares = np.where(is_real, squares, 0.0)
    hidden = np.sqrt(squares[4:].sum(axis=0))
    return [*np.sqrt(squares[:4]), hidden], np.where(is_real & is_real[:, None], covariance, 0.0)


def factor(covariance: Floats) -> Floats:
    """Factor F of a covariance matrix C, with FFᵀ = C, (..., n, n).

    The covariance may be singular, and its rows may have different units.
    """
    sizes = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))[..., None]
    units = np.where(sizes > 0, sizes, 1.0)
    squares, ways = np.linalg.eigh(covariance / (units * np.swapaxes(units, -1, -2)))
    return np.asarray(units * ways * np.sqrt(np.maximum(squares, 0.0))[..., None, :])
