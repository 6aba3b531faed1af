"""Loss of the image peak due to all declared errors, for many cases at once.

An error of motion or of a clock displaces the image of a point to the image point, and leaves a range error ρ over
the aperture there. The peak then keeps the fraction |⟨exp(ikρf/f₀)⟩|² of its power, where ⟨ ⟩ is the mean over
aperture and band, f₀ is the centre frequency, and k is the wavenumber at f₀. The mean over the aperture is computed
as a sum over its nodes. With a random error whose phase has the variance σ², the peak keeps the fraction exp(-σ²) of
its power. The same holds for a tone of unknown phase. The losses of independent errors, in decibels, are added,
because the variances of their phases add (to second order).

These relations are not from Rigling & Moses; they are derived here. `tests/theory/test_image_point.py` checks them
against images formed by direct sums.
"""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from bisar_budget.analysis.spread import CUBIC_POWER, SpreadPhase, Tone
from bisar_budget.analysis.together import BIAS_SUFFIX, Together
from bisar_budget.arrays import Floats, PerCase
from bisar_budget.effects.combined import combined
from bisar_budget.effects.declared import Declared, DeclaredErrors
from bisar_budget.effects.effect import ErrorSource
from bisar_budget.image_plane import FINEST_NODES, SIGHT_POLYNOMIAL_COUNT, nodes
from bisar_budget.ranges.exact_ranges import QUADRATIC_OF_VARIANCE, ExactRanges

_DB_OF_VARIANCE = 10 / math.log(10)


@np.errstate(invalid="ignore")
def peak_loss_db(
    errors: DeclaredErrors, together: Together, spreads: Iterable[SpreadPhase], tones: Iterable[Tone]
) -> Floats:
    """Loss of the image peak due to all declared errors, (cases,). [dB]

    The losses due to single errors are combined according to `allocation.combine`. Under `rss` the decibels are
    added. Under `sum` the square roots of the decibels are added, and the result is squared. Under `each` the largest
    loss is taken. The loss is NaN where an error leaves no image, or where no error is declared.

    Parameters
    ----------
    errors : DeclaredErrors
        Errors of motion and clocks.
    together : Together
        Combination of all declared errors in the full model.
    spreads : iterable of SpreadPhase
        Phase errors that spread energy, in the full model: noise, and parts of phases beyond the cubic order.
    tones : iterable of Tone
        Tones that make paired echoes.
    """
    losses = _losses_of_motion(errors, together)
    of_motion = {error.subject.id + suffix for error in together.motion for suffix in ("", BIAS_SUFFIX)}
    variances: dict[str, Floats] = {}
    for phase in (*together.phases, *together.biases):
        if phase.row_id not in of_motion:
            cubic = 0.0 if phase.cubic_rad is None else np.where(errors.exact.is_turned, 0.0, phase.cubic_rad)
            variance = (phase.judged(1.0) / QUADRATIC_OF_VARIANCE) ** 2 + CUBIC_POWER * cubic**2
            variances[phase.row_id] = errors.array(variance)
    for spread in spreads:
        if spread.row_id not in of_motion:
            variances[spread.row_id] = variances.get(spread.row_id, 0.0) + np.nan_to_num(
                errors.array(spread.variance)
            )
    losses += [_DB_OF_VARIANCE * variance for variance in variances.values()]
    losses += [errors.array(_DB_OF_VARIANCE * np.where(t.is_there, t.phase**2 / 2, 0.0)) for t in tones]
    if not losses:
        return errors.array(math.nan)
    return np.square(errors.array(combined([np.sqrt(loss) for loss in losses], together.rule)))


def _losses_of_motion(errors: DeclaredErrors, together: Together) -> list[Floats]:
    """List the peak loss due to each motion or clock error, (cases,), taken for the worse sign of the error. [dB]

    Under root-sum-square the six correlated errors of a covariance are replaced by six independent errors that
    together have the same covariance.
    """
    motion = together.motion
    if not motion:
        return []
    does = [errors.does("full", error) for error in motion]
    remaining = _range_errors_left(errors, motion, does, [error.declared for error in motion])
    index_by_id = {error.subject.id: index for index, error in enumerate(motion)}
    losses = dict(zip(index_by_id, peak_losses(errors.exact, remaining).max(axis=1), strict=True))
    for group in together.groups if together.rule == "rss" else ():
        if index_by_id.keys() >= set(group.ids):
            independent = together.independent(group, remaining[[index_by_id[row_id] for row_id in group.ids], 0])
            losses |= dict(zip(group.ids, peak_losses(errors.exact, independent), strict=True))
    return [*losses.values(), *_losses_of_biases(errors, motion)]


def _losses_of_biases(errors: DeclaredErrors, motion: Sequence[ErrorSource]) -> list[Floats]:
    """List the peak loss due to the bias of each motion or clock error that has one, (cases,). [dB]

    The mean loss due to a bias and a random part is the sum of their losses.
    """
    biased = [error for error in motion if np.any(error.bias)]
    if not biased:
        return []
    does = [errors.of_bias("full", error) for error in biased]
    remaining = _range_errors_left(errors, biased, does, [error.bias for error in biased])
    return list(peak_losses(errors.exact, remaining[:, 0]))


def _range_errors_left(
    errors: DeclaredErrors, motion: Sequence[ErrorSource], does: Sequence[Declared], sizes: Sequence[PerCase | None]
) -> Floats:
    """Range errors over the aperture that remain at the image point of each error. [m]

    The result is (errors, signs, nodes, cases). The image point is the ground point to which an error displaces the
    image. The errors have the given sizes, and `does` are their effects. The first of the two signs is that of the
    size."""
    east, north = np.moveaxis(np.array([(effect.displacement, effect.opposite) for effect in does]), 2, 0)
    size = np.array([errors.array(size) for size in sizes])
    lanes = errors.lanes(*motion, signs=(1.0, -1.0))
    remaining = errors.exact.left_over(
        lanes, np.repeat(size[:, None], 2, axis=1).ravel(), (east.ravel(), north.ravel())
    )
    return np.moveaxis(remaining.reshape(len(remaining), len(motion), 2, errors.cases), 0, 2)


def peak_losses(exact: ExactRanges, remaining: Floats) -> Floats:
    """Losses of the image peak due to range errors over the aperture, (..., cases). [dB]

    `remaining` (..., nodes, cases) [m] are the range errors at the aperture's nodes that remain at the image point.
    """
    sampling = exact.sampling
    if (
        sampling.places.size <= SIGHT_POLYNOMIAL_COUNT
    ):  # a few nodes resolve a smooth range error, but not the turns of its phase
        remaining, sampling = sampling.to_finest @ remaining, nodes(FINEST_NODES)
    phase, relative_band = exact.k * remaining, np.sqrt(12 * exact.band)
    of_band = np.sinc(phase * relative_band / (2 * math.pi))  # the mean over the band, in closed form
    amplitude = np.abs(np.einsum("n,...nc->...c", sampling.fit[0], np.exp(1j * phase) * of_band))
    return np.asarray(np.maximum(-20 * np.log10(amplitude), 0.0))  # a loss below rounding is 0
