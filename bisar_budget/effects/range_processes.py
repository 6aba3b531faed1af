"""Random range errors along turning lines of sight, and their effects on the image.

A range error has one of two forms. It is either a known variation over the aperture times a random size, as for a
bias, or a random process that changes within the aperture, such as position noise, a random walk, or an atmospheric
delay. Each effect on the image, a phase or a displacement, is an integral of a weight times the range error. The
variance of the effect is therefore a double integral of the covariance of the range error.

A process is decomposed into as many Legendre orders as the nodes over the aperture can distinguish. The weights are
smooth and contain no higher orders, so the higher orders of a process only spread power. The decomposed orders above
the cubic spread power as well. If the line of sight turns, the displacement of the image adds further parts beyond
the cubic.

A Gauss–Markov process has variance 1 and correlation exp(−|t|/τ_c) = 1 + (exp(−|t|/τ_c) − 1). The first term is the
correlation of a constant error. The second term is called the departure. It is computed separately, so that it goes
to zero without rounding error for a long correlation time.

This method is derived here, not taken from a publication. It is checked with time series in
`tests/effects/test_changing_air.py`, and with random draws and direct sums in `tests/effects/test_long_noise.py`.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from bisar_budget.arrays import Floats, PerCase
from bisar_budget.image_plane import LEGENDRE_LEADING
from bisar_budget.ranges.exact_ranges import ExactRanges

_ORDER_COUNT = 4  # Legendre orders 0 to 3, which displace and defocus
_LAG_OCTAVE_COUNT = 44  # octaves of lag, enough for the shortest correlation time that a file can state
_NODES_PER_OCTAVE = 20  # resolve the correlation within an octave of lags to 1e-10


class RangeEffects(NamedTuple):
    """Second moments of the effects of random range errors on the image.

    `covariance` (8, 8, cases) is the covariance of the effects, in the order of `effect_weights`. `left` (cases,)
    [m²] is the mean square of the range error beyond the cubic.

    `sizes` (8, cases) are the squares that the effects would have if the terms of their sums did not cancel. A
    variance that is very small compared with its value in `sizes` is only rounding error.
    """

    covariance: Floats
    sizes: Floats
    left: Floats


def effect_weights(exact: ExactRanges) -> Floats:
    """Effects on the image per metre of range error at each node, (8, nodes, cases).

    The eight effects are quadratic and cubic phase [rad/m], displacement east and north [m/m], and four parts of the
    hidden phase [rad/m], which `declared.Declared` defines.
    """
    return np.array((*exact.phase_weights, *exact.place_weights, *exact.hidden_weights))


def effects_of_courses(exact: ExactRanges, weights: Floats, courses: Floats) -> RangeEffects:
    """Effects of independent range errors, each a known variation over the aperture times a random size.

    `weights` is the result of `effect_weights`. `courses` (errors, nodes, cases) [m] are the range errors at 1 sigma.
    """
    weighted = weights[:, None] * courses
    effects = weighted.sum(axis=2)
    sizes = np.square(np.abs(weighted).sum(axis=2)).sum(axis=1)
    remaining = exact.left_of_small(courses, (effects[2], effects[3]))
    _, beyond = exact.mean_squares(remaining, exact.fit @ remaining)
    return RangeEffects(np.einsum("fec,gec->fgc", effects, effects), sizes, beyond.sum(axis=0))


def effects_of_process(exact: ExactRanges, weights: Floats, covariance: Floats, beyond: PerCase) -> RangeEffects:
    """Effects of a range error that is a random process with a given covariance.

    Parameters
    ----------
    exact : ExactRanges
        Exact ranges at Gauss–Legendre nodes.
    weights : (8, nodes, cases)
        Result of `effect_weights`.
    covariance : (nodes, nodes, cases)
        Covariance of the range error between the nodes, in the Legendre orders that the nodes can distinguish. [m²]
    beyond : (cases,)
        Mean square of the range error in higher orders, which only spread power. [m²]
    """
    orders = np.polynomial.legendre.legvander(exact.sampling.places, _ORDER_COUNT - 1) / LEGENDRE_LEADING
    higher = np.eye(len(orders)) - orders @ exact.fit  # leaves the part beyond the cubic
    bends = np.einsum("nm,amc->anc", higher, exact.slopes)
    weighted_bends = exact.mean * bends
    integrals = np.concatenate((weights, weighted_bends))
    products = np.einsum("fmc,gmc->fgc", np.einsum("fnc,nmc->fmc", integrals, covariance), integrals)
    of_bends = np.einsum("anc,bnc->abc", bends, weighted_bends)
    power = np.einsum("nm,nmc->c", exact.mean * higher, covariance)
    moved = 2 * (products[8, 2] + products[9, 3]) + np.einsum("abc,abc->c", of_bends, products[2:4, 2:4])
    spread = np.sqrt(np.maximum(np.einsum("nnc->nc", covariance), 0.0))
    sizes = np.square((np.abs(weights) * spread).sum(axis=1))
    return RangeEffects(products[:8, :8], sizes, power + moved + beyond)


def effects_of_gauss_markov(
    exact: ExactRanges, weights: Floats, courses: Floats, ratio: Floats, *, is_phase_advanced: bool
) -> RangeEffects:
    """Effects of range errors that are independent Gauss–Markov processes of variance 1.

    Parameters
    ----------
    exact, weights
        As for `effects_of_process`.
    courses : (errors, nodes, cases)
        Range error per unit of each process. For an atmospheric delay it is the group delay, as a length. [m]
    ratio : (cases,)
        Half the aperture time divided by the correlation time.
    is_phase_advanced : bool
        Whether the phase error has the opposite sign of the group delay, as for free electrons. If so, the range
        error in the image is the mean of the group delay over the aperture, minus the deviation of the group delay
        from this mean.
    """
    ratios, ratio_index = np.unique(np.broadcast_to(ratio, exact.half.shape), return_inverse=True)
    departure = departure_at_nodes(len(exact.times), ratios)[..., ratio_index.ravel()]
    courses = courses + np.zeros_like(exact.times)
    covariance = np.einsum("enc,emc->nmc", courses, courses) * departure
    # The departure is 0 at lag 0, so its power in the higher orders is minus its power in the resolved orders.
    power, mean = exact.fit[0] @ np.square(courses).sum(axis=0), exact.fit[0]
    beyond = -power * np.einsum("n,nnc->c", mean, departure)
    if is_phase_advanced:
        constant = np.einsum("n,nmc->mc", mean, covariance)
        covariance = covariance - 2 * (constant[None] + constant[:, None]) + 4 * (mean @ constant)
        courses = 2 * (mean @ courses)[:, None] - courses
    staying = effects_of_courses(exact, weights, courses)
    departing = effects_of_process(exact, weights, covariance, beyond)
    total = staying.covariance + departing.covariance
    return RangeEffects(total, staying.sizes, np.maximum(staying.left + departing.left, 0.0))


def departure_at_nodes(count: int, ratios: Floats) -> Floats:
    """Departure exp(−|t|/τ_c) − 1 for each pair of nodes, in the Legendre orders that the nodes can distinguish.

    The departure has a kink at lag 0, which its values at the nodes would not resolve. Therefore it is first
    integrated against Legendre polynomials. Higher orders are not needed, because the smooth weights do not contain
    them.

    Parameters
    ----------
    count : int
        Number of Gauss–Legendre nodes.
    ratios : (cases,)
        Half the aperture time divided by the correlation time.

    Returns
    -------
    (count, count, cases) ndarray
        The departure for each pair of nodes.
    """
    lags, products = _lagged(count)
    correlation = np.expm1(-np.multiply.outer(ratios, lags))
    of_orders = (correlation @ products.reshape(lags.size, -1)).reshape(-1, count, count)
    nodes = np.polynomial.legendre.leggauss(count)[0]
    of_nodes = np.polynomial.legendre.legvander(nodes, count - 1) * (np.arange(count) + 0.5)
    return np.asarray(np.einsum("nk,ckl,ml->nmc", of_nodes, of_orders, of_nodes, optimize=True))


@cache
def _lagged(count: int) -> tuple[Floats, Floats]:
    """Lags u from 0 to 2, (lags,), and weighted integrals of products of Legendre polynomials, (lags, count, count).

    The lags are in units of half the aperture time. The integrals are ∫P_m(s)·P_n(s + u) ds, summed over both signs
    of the lag. They are multiplied by the quadrature weight of the lag. Each octave of lags has the same number of
    lags. The lags therefore become denser towards 0, and resolve correlation times of any length.
    """
    x, w = np.polynomial.legendre.leggauss(_NODES_PER_OCTAVE)
    edges = np.concatenate(([0.0], 2.0 ** np.arange(1 - _LAG_OCTAVE_COUNT, 2)))
    width = np.diff(edges)
    lags = (edges[:-1, None] + width[:, None] * (x + 1) / 2).ravel()
    weights = (width[:, None] / 2 * w).ravel()
    abscissas, weights_of_abscissas = np.polynomial.legendre.leggauss(count)  # exact for products of two orders
    half = 1 - lags[:, None] / 2
    early = -1 + half * (abscissas + 1)
    values = np.polynomial.legendre.legvander(early, count - 1)
    late = np.polynomial.legendre.legvander(early + lags[:, None], count - 1)
    products = np.einsum("ls,lsm,lsn->lmn", half * weights_of_abscissas, values, late, optimize=True)
    products = products + np.swapaxes(products, 1, 2)
    return lags, products * weights[:, None, None]
