"""Range errors that change within the aperture as Gauss–Markov processes, seen along lines of sight that turn.

They are delays of the zenith, and noise of a position along one axis; below both are called delays.

A delay z(τ) at the zenith has variance 1 and correlation exp(−|t|/τ_c). A leg makes the range error m(τ)·z(τ) of it,
of one air both legs their sum. Each effect on the image, a phase or a displacement, is an integral of weight times
range error; so its variance is a double integral of the correlation. The correlation is 1 + (exp(−|t|/τ_c) − 1): the
first is a delay that stays, the second departs from that, and vanishes for a long correlation time without rounding.

What is left of the range error beyond order 3, where the image is, spreads. It has the parts beyond order 3 of the
delay itself, and of what the displacement of the image adds along a line of sight that turns. Derived here; against
time series in `tests/effects/test_changing_air.py` and `tests/effects/test_long_noise.py`.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from bisar_budget.image_plane import LEADING
from bisar_budget.ranges.exact_ranges import ExactRanges, Floats

_ORDERS = 4  # Legendre orders 0 to 3, which displace and defocus
_OCTAVES = 44  # of lags below an aperture: half of it over the shortest correlation time that a file can state
_NODES_PER_OCTAVE = 20  # follow the correlation within an octave of lags to 1e-10
_POWER = 1 / (2 * np.arange(_ORDERS) + 1)  # mean square of Pₙ over the aperture


class ChangingEffects(NamedTuple):
    """Effects of a unit: covariance (8, 8, cases) of what `SensorCases.weights` weigh, and mean square left. [m²]

    `sizes` (8, cases) are squares of sums of magnitudes, against which a rest of cancelling terms is rounding.
    """

    covariance: Floats
    sizes: Floats
    left: Floats


def changing_effects(exact: ExactRanges, delay: Floats, ratio: Floats, *, is_phase_advanced: bool) -> ChangingEffects:
    """Effects of a delay of unit variance at the zenith that changes as a Gauss–Markov process.

    Parameters
    ----------
    exact : ExactRanges
        At nodes of Gauss and Legendre.
    delay : (nodes, cases)
        Group delay of the leg, or of both legs, per unit at the zenith. [m/unit]
    ratio : (cases,)
        Half the aperture time over the correlation time.
    is_phase_advanced : bool
        Whether the phase has the other sign than the group, as free electrons make it: then the mean of the group
        counts, and everything else with the other sign.
    """
    delay = delay + np.zeros_like(exact.times)
    weights = np.array((*exact.phase_weights, *exact.place_weights, *exact.hidden_weights))  # (8, nodes, cases)
    mean: Floats = exact.fit[0]
    sign = 1.0
    if is_phase_advanced:
        sign = -1.0
        weights = 2 * weights.sum(axis=1, keepdims=True) * mean[:, None] - weights
    coefficients = exact.fit / LEADING[:, None]
    places = np.polynomial.legendre.legvander(exact.sampling.places, _ORDERS - 1)
    bends = exact.slopes - np.einsum("no,om,amc->anc", places, coefficients, exact.slopes)
    # Integrals of the delay at the zenith: effects, Legendre parts, and the product with each slope's bend.
    of_bends = mean[:, None] * bends
    of_orders = np.broadcast_to(coefficients[..., None], (_ORDERS, *delay.shape))
    integrals = np.concatenate((weights, of_orders, of_bends)) * delay
    staying = integrals.sum(axis=1)
    departing = _departing(integrals, ratio)
    covariance = np.einsum("fc,gc->fgc", staying[:8], staying[:8]) + departing[:8, :8]
    sizes = np.square(np.abs(integrals[:8]).sum(axis=1))
    left = _left(delay, np.asarray(places, float), bends, mean, staying, departing, sign)
    return ChangingEffects(covariance, sizes, left)


def _left(
    delay: Floats, places: Floats, bends: Floats, mean: Floats, staying: Floats, departing: Floats, sign: float
) -> Floats:
    """Mean square of the range error beyond order 3, where the image is. [m²/unit²]

    The departure of the correlation is 0 at no lag: of its power beyond order 3 only the parts up to it are known,
    with the other sign.
    """
    east_north, orders, products = slice(2, 4), slice(8, 12), slice(12, 14)
    own = delay - places @ staying[orders]
    rest = sign * own + np.einsum("anc,ac->nc", bends, staying[east_north])
    of_bends = np.einsum("n,anc,bnc->abc", mean, bends, bends)
    found = mean @ np.square(rest)
    found = found - np.einsum("o,ooc->c", _POWER, departing[orders, orders])
    found = found + 2 * sign * np.einsum("aac->c", departing[products, east_north])
    found = found + np.einsum("abc,abc->c", of_bends, departing[east_north, east_north])
    return np.asarray(np.maximum(found, 0.0))


def _departing(integrals: Floats, ratio: Floats) -> Floats:
    """Covariance (f, f, cases) of integrals (f, nodes, cases) with the correlation exp(−|t|/τ_c) − 1."""
    ratios, place = np.unique(np.broadcast_to(ratio, integrals.shape[-1:]), return_inverse=True)
    between = departure_at_nodes(integrals.shape[1], ratios)[..., place.ravel()]
    return np.asarray(np.einsum("fnc,nmc,gmc->fgc", integrals, between, integrals, optimize=True))


def departure_at_nodes(count: int, ratios: Floats) -> Floats:
    """The correlation exp(−|t|/τ_c) − 1 between nodes, by as many Legendre orders as they tell apart.

    It has a bend at lag 0, which nodes would miss. Smooth weights see no higher orders than these.

    Parameters
    ----------
    count : int
        Nodes of Gauss and Legendre.
    ratios : (cases,)
        Half the aperture time over the correlation time.

    Returns
    -------
    (count, count, cases) ndarray
    """
    lags, products = _lagged(count)
    correlation = np.expm1(-np.multiply.outer(ratios, lags))
    of_orders = (correlation @ products.reshape(lags.size, -1)).reshape(-1, count, count)
    nodes = np.polynomial.legendre.leggauss(count)[0]
    of_nodes = np.polynomial.legendre.legvander(nodes, count - 1) * (np.arange(count) + 0.5)
    return np.asarray(np.einsum("nk,ckl,ml->nmc", of_nodes, of_orders, of_nodes, optimize=True))


@cache
def _lagged(count: int) -> tuple[Floats, Floats]:
    """Lags u over 0 … 2, in half apertures, and ∫P_m(s)·P_n(s + u) ds of both signs of the lag, weighted for a sum.

    Lags are denser towards 0, octave by octave: correlation times of any length are followed.
    """
    x, w = np.polynomial.legendre.leggauss(_NODES_PER_OCTAVE)
    edges = np.concatenate(([0.0], 2.0 ** np.arange(1 - _OCTAVES, 2)))
    width = np.diff(edges)
    lags = (edges[:-1, None] + width[:, None] * (x + 1) / 2).ravel()
    weights = (width[:, None] / 2 * w).ravel()
    places, of_places = np.polynomial.legendre.leggauss(count)  # exact for products of two orders
    half = 1 - lags[:, None] / 2
    early = -1 + half * (places + 1)
    values = np.polynomial.legendre.legvander(early, count - 1)
    late = np.polynomial.legendre.legvander(early + lags[:, None], count - 1)
    products = np.einsum("ls,lsm,lsn->lmn", half * of_places, values, late, optimize=True)
    products = products + np.swapaxes(products, 1, 2)
    return lags, products * weights[:, None, None]
