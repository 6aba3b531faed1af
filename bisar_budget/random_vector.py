"""The distribution of the length of a random vector: a mean plus independent random contributions.

A contribution is normal, uniform, of either sign (a bound) or a tone of unknown phase. The vector is the displacement
of an image (two dimensions), or a phase error and its hidden parts (one or more). Nothing is drawn: lengths and
probabilities are the same in every run.

The characteristic function of the vector is real but for the mean, and a product of simple factors: Gaussian, sinc,
cosine and J₀. In one dimension its Fourier series, and in two dimensions the Fourier-Bessel series of its mean over
all directions, give the probability. Normal contributions alone have methods of their own. With more dimensions, or
if the series converge too slowly, the probability is integrated exactly over the contribution with the largest
effect, and over the others with a rank-1 lattice (Cools, Kuo & Nuyens, SIAM J. Sci. Comput. 28, 2006). For high
confidences, the points of the lattice are moved outwards, and weighted accordingly.
"""

import math
from collections.abc import Callable, Sequence
from functools import cache, partial
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from bisar_budget.arrays import Complexes, Floats
from bisar_budget.constants import VECTOR_ROUNDING_FRACTION

_SMALL_CONTRIBUTION_FRACTION = 1e-4  # of the longest contribution; a shorter one is taken for a normal one
_RANK_ROUNDING_FRACTION = 1e-13  # of the largest singular value; directions with less have no width
_ATOM_ROUNDING_PROBABILITY = 1e-12
_SUPPORT_SIGMA = 7.7  # the probability that a normal vector is longer is less than 1e-12 in two dimensions
_SERIES_END_FRACTION = 1e-10  # a series ends at terms below this
_LAST_SERIES_END_FRACTION = 3e-8  # a series with as many terms as are allowed is used if its last are below this
_WINDOW_ORDER, _WINDOW_EXPONENT = 8, 36.0  # the last terms of a series are reduced, against overshoot at edges
_LINE_SERIES_TERMS = (32, 128, 512, 2048, 8192)
_PLANE_SERIES_TERMS = (16, 32, 64, 128, 256, 400)
_LATTICE_POINTS = 2**15
_CURVE_POINTS = 2**12  # of the lattice in one dimension
_COARSE_STRIDE_POINTS = 16  # the first approximation has fewer points by this factor
_COUNT_POINTS = 2**17  # of the lattice if no contribution is integrated exactly
_MAX_BOUND_COUNT = 16  # of bounds of which all signs are tried
_MAX_MIXTURE_BOUND_COUNT = 12  # beside a single contribution of another kind
_MAX_LATTICE_BOUND_COUNT = 8
_MAX_CONFIDENCE_PROBABILITY = 1.0 - 1e-8  # at which the points of the lattice are laid out
_FAR_TAIL_PROBABILITY, _FAR_TAIL_POINTS = 0.9995, 2**16  # for higher confidences the lattice has more points
_TAIL_PROBABILITY = 0.93  # for higher confidences the points of the lattice are moved outwards
_QUADRATURE_NODES, _QUADRATURE_END_SIGMA = 48, 8.5
_TILTED_CELLS = 256
_SMOOTH_FRACTION = 0.01  # of the longest tone; least length of a contribution that is integrated exactly
_STRETCHED_COUNT, _STRETCHED_VARIANCE_RATIO = 4, 2.5
_LATTICE_EXACT_COUNT = 8  # of dimensions; with more, moments of the lattice are corrected
_MAX_SOLVER_STEPS = 100
_COARSE_TOLERANCE_FRACTION = 1e-3
_SERIES_TOLERANCE_FRACTION = 2e-6
_EXACT_TOLERANCE_FRACTION = 1e-11
_BESSEL_TABLE_END_RAD, _BESSEL_STEPS_PER_RAD = 32, 64
# Found component by component for 2¹⁴ points, least mean square error with product weights 0.25·0.93ʲ (Cools, Kuo &
# Nuyens), and for 2¹⁷ points in the first ten.
# fmt: off
_LATTICE_GENERATOR = (
    1, 27923, 15321, 20807, 91029, 90835, 15835, 29673, 90157, 117445, 12455, 5887, 16221, 10455, 5737, 8549, 10589,
    11231, 14759, 13805, 525, 1501, 6867, 4401, 8633, 647, 14495, 8767, 13861, 4139, 8613, 7405, 1909, 381, 7035,
    7091, 16039, 4933, 15589, 4535,
)
# fmt: on

Probability = Callable[[Floats], Floats]
"""The probability that the length is at most each of the limits (limits,)."""


class RandomVector(NamedTuple):
    """A mean plus independent random contributions, all in the unit of the vector, which has `m` components.

    The vector is mean + Σ z·normal + Σ u·uniform + Σ e·bound + Σ (cos ψ·tone[0] + sin ψ·tone[1]) with z standard
    normal, u uniform from −1 to 1, e either −1 or 1, and ψ uniform on the circle.

    Attributes
    ----------
    mean : (m,)
        Mean of the vector.
    normal : (contributions, m)
        One standard deviation of each normal contribution.
    uniform : (contributions, m)
        Largest value of each uniform contribution.
    bound : (contributions, m)
        Value of each contribution of unknown sign.
    tone : (contributions, 2, m)
        Value of each tone at phase 0, and at a quarter of its period.
    """

    mean: Floats
    normal: Floats
    uniform: Floats
    bound: Floats
    tone: Floats

    @classmethod
    def of_covariance(cls, covariance: Floats) -> "RandomVector":
        """Make a normal vector with the mean 0 from its covariance (m, m)."""
        squares, ways = np.linalg.eigh(covariance)
        nothing = np.zeros((0, len(covariance)))
        normal = (ways * np.sqrt(np.maximum(squares, 0.0))).T
        return cls(nothing.sum(axis=0), normal, nothing, nothing, np.zeros((0, 2, len(covariance))))

    @property
    def is_finite(self) -> bool:
        """Whether all contributions are finite; otherwise the length has no distribution."""
        return all(bool(np.isfinite(vectors).all()) for vectors in self)

    def along(self, way: Floats) -> "RandomVector":
        """Component of the vector along a unit vector (m,), as a random vector of one component."""
        return RandomVector(*(vectors @ way[:, None] for vectors in self))

    def probability(self, limit: float) -> float:
        """Probability that the length of the vector is at most a limit, in the unit of the vector."""
        if limit < 0.0:
            return 0.0
        scale = _scale(self)
        if scale == 0.0:
            return 1.0
        reduced = _reduced(self, scale)
        if not reduced.contributions:
            return float(limit >= math.hypot(*self.mean.tolist()))
        limits = np.array([min(limit / scale, 1e9)])
        return float(min(max(_distribution(reduced, reduced.rough_probability(limits[0]))(limits)[0], 0.0), 1.0))

    def quantiles(self, confidences: Sequence[float]) -> list[float]:
        """Shortest lengths that the vector does not exceed with each confidence, in its unit.

        Confidences are from 0.5 to 0.999999.
        """
        scale = _scale(self)
        if scale == 0.0:
            return [0.0 for _ in confidences]
        if len(self.mean) == 1 and not (self.uniform.any() or self.bound.any() or self.tone.any()):
            mean, sigma = abs(self.mean.item()) / scale, math.hypot(*(self.normal / scale).ravel().tolist())
            return [scale * _folded_normal_quantile(mean, sigma, confidence) for confidence in confidences]
        reduced = _reduced(self, scale)
        return [scale * length for length in _quantiles(reduced, np.asarray(confidences, dtype=float))]


class _Reduced(NamedTuple):
    """A random vector in as few dimensions as it needs, with at most as many normal contributions.

    Its largest component is about 1. Contributions are sorted by length, the longest first. Both vectors of a tone
    are perpendicular, and the first is the longer. Shapes as in `RandomVector`.
    """

    mean: Floats
    normal: Floats
    uniform: Floats
    bound: Floats
    tone: Floats

    @property
    def contributions(self) -> int:
        """Number of random contributions."""
        return len(self.normal) + len(self.uniform) + len(self.bound) + len(self.tone)

    @property
    def covariance(self) -> Floats:
        """Covariance of the vector, (m, m)."""
        tones = _squares(self.tone.reshape(-1, len(self.mean)))
        return _squares(self.normal) + _squares(self.uniform) / 3.0 + _squares(self.bound) + tones / 2.0

    @property
    def support(self) -> float:
        """Length that the vector exceeds with a probability of less than 1e-12."""
        bounded = sum(float(_lengths(rows).sum()) for rows in (self.mean[None], self.uniform, self.bound))
        tones = float(_lengths(self.tone[:, 0]).sum())
        normal = _SUPPORT_SIGMA * float(_lengths(self.normal).max(initial=0.0))
        return (bounded + tones + normal) * (1.0 + 1e-9)

    def rough_quantile(self, confidences: Floats) -> Floats:
        """Lengths that the vector does not exceed, about: of a scaled chi-square (Wilson & Hilferty 1931)."""
        mean_square, spread = self._spread()
        scores = np.array([NormalDist().inv_cdf(confidence) for confidence in confidences.tolist()])
        roots = np.maximum(1.0 - spread**2 + spread * scores, 0.1)
        return np.minimum(np.sqrt(mean_square * roots**3), self.support)

    def rough_probability(self, limit: float) -> float:
        """Probability that the length is at most a limit, about."""
        mean_square, spread = self._spread()
        score = ((limit * limit / mean_square) ** (1.0 / 3.0) - 1.0 + spread**2) / spread
        return min(NormalDist().cdf(score), _MAX_CONFIDENCE_PROBABILITY)

    def _spread(self) -> tuple[float, float]:
        covariance = self.covariance
        mean_square = float(np.trace(covariance) + self.mean @ self.mean)
        variance = 2.0 * float(np.sum(covariance**2)) + 4.0 * float(self.mean @ covariance @ self.mean)
        return mean_square, max(math.sqrt(variance / 9.0) / mean_square, 1e-12)


def _squares(rows: Floats) -> Floats:
    """Sum of the outer products of each row with itself, (m, m)."""
    return np.asarray(rows.T @ rows)


def _lengths(rows: Floats) -> Floats:
    """Length of each row, (rows,)."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", rows, rows)))


def _scale(vector: RandomVector) -> float:
    """Largest component of all contributions, in the unit of the vector."""
    return max(float(np.abs(values).max(initial=0.0)) for values in vector)


def _reduced(vector: RandomVector, scale: float) -> _Reduced:
    """Reduce a vector to the dimensions and contributions that it needs, divided by a scale."""
    width = len(vector.mean)
    mean = vector.mean / scale
    rows = [_nonzero(values / scale) for values in (vector.normal, vector.uniform, vector.bound)]
    tones = vector.tone.reshape(-1, 2, width) / scale
    tones = tones[np.abs(tones).max(axis=(1, 2), initial=0.0) > 0.0]
    if width > 1:
        _, sizes, axes = np.linalg.svd(np.vstack((mean[None], *rows, tones.reshape(-1, width))), full_matrices=False)
        rank = max(int(np.count_nonzero(sizes > _RANK_ROUNDING_FRACTION * sizes[0])), 1)
        if rank < width:
            to_rank = axes[:rank].T
            mean, tones, rows = mean @ to_rank, tones @ to_rank, [values @ to_rank for values in rows]
    if len(tones):
        _, sizes, axes = np.linalg.svd(tones, full_matrices=False)
        tones = np.zeros_like(tones)
        tones[:, : sizes.shape[1]] = sizes[:, :, None] * axes
    normal, uniform, bound = rows
    covariance: Floats = _squares(normal)
    if len(normal) or len(uniform) or len(tones):
        longest = max(float(_lengths(values).max(initial=0.0)) for values in (normal, uniform, bound, tones[:, 0]))
        shortest = _SMALL_CONTRIBUTION_FRACTION * longest
        uniform, short_uniform = _by_length(uniform, uniform, shortest)
        bound, short_bound = _by_length(bound, bound, shortest)
        tones, short_tone = _by_length(tones, tones[:, 0], shortest)
        covariance = covariance + _squares(short_uniform) / 3.0 + _squares(short_bound)
        covariance += _squares(short_tone.reshape(-1, len(mean))) / 2.0
    reduced = _Reduced(mean, _principal(covariance), uniform, bound, tones)
    return reduced if reduced.contributions > len(bound) else _with_few_bounds(reduced, _MAX_BOUND_COUNT)


def _nonzero(rows: Floats) -> Floats:
    """Rows that are not zero."""
    return np.asarray(rows[np.abs(rows).max(axis=1, initial=0.0) > 0.0])


def _by_length(values: Floats, rows: Floats, shortest: float) -> tuple[Floats, Floats]:
    """Sort contributions by the length of a row of each, and separate the short ones."""
    lengths = _lengths(rows)
    order = np.argsort(-lengths, kind="stable")
    count = int(np.count_nonzero(lengths >= shortest))
    return values[order[:count]], values[order[count:]]


def _principal(covariance: Floats) -> Floats:
    """Perpendicular vectors, the longest first, that have a covariance."""
    if len(covariance) == 1:
        sigma = math.sqrt(covariance[0, 0])
        return np.array([[sigma]]) if sigma else np.empty((0, 1))
    variances, axes = np.linalg.eigh(covariance)
    is_wide = variances > _RANK_ROUNDING_FRACTION * max(variances[-1], 0.0)
    return np.asarray((np.sqrt(variances[is_wide]) * axes[:, is_wide]).T[::-1])


def _quantiles(vector: _Reduced, confidences: Floats) -> list[float]:
    """Lengths that the vector does not exceed with each confidence."""
    if vector.contributions == 0:
        return [math.hypot(*vector.mean.tolist()) for _ in confidences]
    if vector.contributions == len(vector.bound):
        lengths = np.sort(_lengths(_signed(vector)))
        ranks = np.ceil((confidences - _ATOM_ROUNDING_PROBABILITY) * len(lengths)).astype(int) - 1
        return [float(length) for length in lengths[np.maximum(ranks, 0)]]
    if vector.contributions == 1 and len(vector.mean) == 1 and not vector.mean.any() and len(vector.uniform):
        half_width = abs(float(vector.uniform[0, 0]))
        return [half_width * confidence for confidence in confidences.tolist()]
    guesses = vector.rough_quantile(confidences)
    if _is_normal(vector, 2) and len(vector.normal) == 2 and _is_isotropic(vector):
        sigma = float(_lengths(vector.normal)[0])
        return [sigma * math.sqrt(-2.0 * math.log1p(-confidence)) for confidence in confidences.tolist()]
    quantiles = np.empty(len(confidences))
    is_lattice, tolerance = _needs_lattice(vector), _tolerance(vector)
    is_tail = (confidences > _TAIL_PROBABILITY) & is_lattice
    for chosen in (np.flatnonzero(~is_tail), *np.flatnonzero(is_tail)[:, None]):
        if len(chosen):
            confidence, lengths = float(confidences[chosen[0]]), guesses[chosen]
            if is_lattice:
                coarse = _lattice(vector, confidence, _COARSE_STRIDE_POINTS)
                lengths = _solve(coarse, confidences[chosen], lengths, _COARSE_TOLERANCE_FRACTION)
            quantiles[chosen] = _solve(_distribution(vector, confidence), confidences[chosen], lengths, tolerance)
    return [float(length) for length in quantiles]


def _tolerance(vector: _Reduced) -> float:
    return _EXACT_TOLERANCE_FRACTION if _is_enumerated(vector) else _SERIES_TOLERANCE_FRACTION


def _is_enumerated(vector: _Reduced) -> bool:
    """Whether the probability is the mean of exact probabilities over the signs of bounds."""
    return vector.contributions - len(vector.bound) == 1 and len(vector.bound) <= _MAX_MIXTURE_BOUND_COUNT


def _is_normal(vector: _Reduced, width: int) -> bool:
    return vector.contributions == len(vector.normal) and len(vector.mean) == width


def _is_isotropic(vector: _Reduced) -> bool:
    first, second = _lengths(vector.normal).tolist()
    return not vector.mean.any() and first - second <= 1e-14 * first


def _needs_lattice(vector: _Reduced) -> bool:
    """Whether the probability is integrated over a lattice, with points that depend on the confidence."""
    if _is_enumerated(vector) or _is_normal(vector, 1) or _is_normal(vector, 2):
        return False
    if len(vector.mean) == 2:
        return _plane_terms(vector) == 0
    return len(vector.mean) > 2 and _square_terms(vector) == 0


def _distribution(vector: _Reduced, confidence: float) -> Probability:
    """Probability of the length of the vector, for limits that it does not exceed with about a confidence."""
    if _is_normal(vector, 2) and len(vector.normal) == 2:
        return _plane_normal(vector)
    if vector.contributions == len(vector.bound):
        lengths = _lengths(_signed(vector))
        return _counted(lengths * (1.0 - _ATOM_ROUNDING_PROBABILITY), np.full(len(lengths), 1.0 / len(lengths)))
    if len(vector.mean) == 1 and not _is_enumerated(vector):
        return _line_series(vector)
    if _square_terms(vector):
        return _square_series(vector, _square_terms(vector))
    if len(vector.mean) == 2 and not _is_enumerated(vector):
        terms = _plane_terms(vector)
        if terms:
            return _plane_series(vector, terms)
    return _lattice(vector, confidence)


def _folded_normal_quantile(mean: float, sigma: float, confidence: float) -> float:
    """Length that a normal number does not exceed, by Newton's method within a bracket."""
    if sigma <= _RANK_ROUNDING_FRACTION * mean:
        return mean
    if mean == 0.0:
        return sigma * _half_normal_score(confidence)
    ratio, root_half = mean / sigma, math.sqrt(0.5)
    low, high = ratio, ratio + _half_normal_score(confidence)
    score = max(ratio + NormalDist().inv_cdf(confidence), _half_normal_score(confidence))
    low = 0.0
    for _ in range(_MAX_SOLVER_STEPS):
        excess = 0.5 * (math.erfc((score - ratio) * root_half) + math.erfc((score + ratio) * root_half))
        excess -= 1.0 - confidence
        if excess > 0.0:
            low = score
        else:
            high = score
        density = math.exp(-0.5 * (score - ratio) ** 2) + math.exp(-0.5 * (score + ratio) ** 2)
        step = excess * math.sqrt(2.0 * math.pi) / density if density else math.inf
        following = score + step if low < score + step < high else 0.5 * (low + high)
        if abs(following - score) <= 1e-13 * min(score, 1.0) + 1e-15 * score:
            return sigma * following
        score = following
    return sigma * score


@cache
def _half_normal_score(confidence: float) -> float:
    """Length that a standard normal number does not exceed."""
    return -NormalDist().inv_cdf(0.5 * (1.0 - confidence))


def _solve(probability: Probability, confidences: Floats, guesses: Floats, tolerance: float) -> Floats:
    """Lengths with given probabilities: by the secant through a bracket, in the logarithm of the excess.

    An end of the bracket that remains is weighted after Anderson & Björck (BIT 13, 1973).

    `tolerance` is the relative tolerance of the length, and of the probability that it is exceeded.
    """
    count = len(guesses)
    low, high, trial, lengths = np.zeros(count), np.full(count, np.inf), guesses.copy(), guesses.copy()
    excess_low, excess_high, was_below = np.full(count, np.inf), np.full(count, -np.inf), np.full(count, -1)
    slopes, pending = np.maximum(-2.0 * np.log1p(-confidences), 1.0), np.arange(count)  # exact for Rayleigh's law
    for step in range(_MAX_SOLVER_STEPS):
        tried = trial[pending]
        excess = np.log(np.maximum(1.0 - probability(tried), 1e-300) / (1.0 - confidences[pending]))
        is_below = excess > 0.0
        below, above = pending[is_below], pending[~is_below]
        # An end that remains twice counts less, so that the secant does not keep it for ever.
        with np.errstate(invalid="ignore", divide="ignore"):
            decrease = 1.0 - excess / np.where(is_below, excess_low[pending], excess_high[pending])
        decrease = np.where(decrease > 0.0, decrease, 0.5)
        decrease = np.where(is_below == was_below[pending], decrease, 1.0)
        excess_high[below] *= decrease[is_below]
        excess_low[above] *= decrease[~is_below]
        low[below], excess_low[below] = tried[is_below], excess[is_below]
        high[above], excess_high[above] = tried[~is_below], excess[~is_below]
        was_below[pending] = is_below
        is_exact = np.abs(excess) <= tolerance
        is_done = is_exact | (high[pending] * (1.0 - tolerance) <= low[pending])
        lengths[pending] = np.where(is_exact, tried, np.minimum(high[pending], 1e300))
        steps = np.exp(np.minimum(np.maximum(1.3 * 2.0**step * excess / slopes[pending], -0.7), 0.7))
        pending, steps = pending[~is_done], steps[~is_done]
        if not len(pending):
            break
        ends = low[pending], high[pending], excess_low[pending], excess_high[pending]
        trial[pending] = _next_trial(*ends, trial[pending] * steps, step)
    return lengths


def _next_trial(
    low: Floats, high: Floats, excess_low: Floats, excess_high: Floats, outer: Floats, step: int
) -> Floats:
    """Next lengths: `outer` while no bracket exists, otherwise on the secant, or half way if it is flat or steep."""
    is_bracket = np.isfinite(high) & ((low > 0.0) | (step > 20))
    fall = excess_low - excess_high
    is_secant = (fall > 0.0) & (fall < 100.0) & (step % 8 != 7)
    share = np.where(is_secant, excess_low, 0.5) / np.where(is_secant, fall, 1.0)
    width = np.where(is_bracket, high, low) - low
    return np.where(is_bracket, low + np.minimum(np.maximum(share, 1e-5), 1.0 - 1e-5) * width, outer)


def _plane_normal(vector: _Reduced) -> Probability:
    """Probability of the length of a normal vector in the plane, by quadrature over its shorter axis."""
    (long_sigma, short_sigma) = _lengths(vector.normal).tolist()
    long_mean, short_mean = (vector.normal @ vector.mean / np.array((long_sigma, short_sigma))).tolist()
    nodes, weights = _sine_nodes()

    is_centred = long_mean == 0.0 and short_mean == 0.0
    if is_centred:  # the other half of each integral is the same
        nodes, weights = nodes[nodes > 0.0], 2.0 * weights[nodes > 0.0]

    def probability(limits: Floats) -> Floats:
        low = np.maximum((-limits - short_mean) / short_sigma, -_QUADRATURE_END_SIGMA)
        high = np.minimum((limits - short_mean) / short_sigma, _QUADRATURE_END_SIGMA)
        half = np.maximum(0.5 * (high - low), 0.0)[:, None]
        scores = 0.5 * (low + high)[:, None] + half * nodes
        across = short_mean + short_sigma * scores
        reach = np.sqrt(np.maximum(limits[:, None] ** 2 - across**2, 0.0)) / long_sigma
        offset = long_mean / long_sigma
        beyond = 2.0 * _normal_beyond(reach) if is_centred else _normal_outside(-reach - offset, reach - offset)
        density = np.exp(-0.5 * scores**2) * weights * half / math.sqrt(2.0 * math.pi)
        return np.asarray(np.einsum("ij,ij->i", density, 1.0 - beyond))

    return probability


@cache
def _sine_nodes() -> tuple[Floats, Floats]:
    """Nodes and weights from −1 to 1 for functions with square roots at both ends."""
    nodes, weights = np.polynomial.legendre.leggauss(_QUADRATURE_NODES)
    angles = 0.5 * math.pi * nodes
    return np.sin(angles), 0.5 * math.pi * weights * np.cos(angles)


def _normal_beyond(scores: Floats) -> Floats:
    """Probability that a standard normal number is larger, with a relative error below 2e-7."""
    if scores.size <= 2048:
        erfc, root_half = math.erfc, math.sqrt(0.5)
        return np.array([0.5 * erfc(root_half * score) for score in scores.ravel().tolist()]).reshape(scores.shape)
    # Press et al., Numerical Recipes, 2nd ed., section 6.2 (erfcc).
    size = np.abs(scores) * math.sqrt(0.5)
    t = 1.0 / (1.0 + 0.5 * size)
    exponent = np.full_like(t, 0.17087277)
    for coefficient in (-0.82215223, 1.48851587, -1.13520398, 0.27886807, -0.18628806, 0.09678418, 0.37409196):
        exponent *= t
        exponent += coefficient
    exponent = (exponent * t + 1.00002368) * t - 1.26551223 - np.minimum(size * size, 700.0)
    beyond = 0.5 * t * np.exp(exponent)
    return np.where(scores < 0.0, 1.0 - beyond, beyond)


def _characteristic(vector: _Reduced, waves: Floats) -> Floats:
    """Real part of the characteristic function at wave vectors (waves, m), in radians per unit of the vector."""
    values = np.cos(waves @ vector.mean) if vector.mean.any() else np.ones(len(waves))
    if len(vector.normal):
        values = values * np.exp(-0.5 * np.square(waves @ vector.normal.T).sum(axis=1))
    for row in vector.uniform:
        values *= np.sinc(waves @ (row / math.pi))
    for row in vector.bound:
        values *= np.cos(waves @ row)
    for tone in vector.tone:
        values *= _bessel(0, _lengths(waves @ tone.T))
    return np.asarray(values)


def _envelope(vector: _Reduced, waves: Floats) -> Floats:
    """Upper bound of the absolute value of the characteristic function at wave vectors (waves, m)."""
    values = np.exp(-0.5 * np.square(waves @ vector.normal.T).sum(axis=1))
    for row in vector.uniform:
        values /= np.maximum(np.abs(waves @ row), 1.0)
    for tone in vector.tone:
        values /= np.sqrt(np.maximum(0.5 * math.pi * _lengths(waves @ tone.T), 1.0))
    return np.asarray(values)


def _window(values: Floats, is_converged: bool) -> Floats:
    """Terms of a series, reduced to nearly 0 at its end if it has not converged."""
    terms = len(values)
    orders = (np.arange(terms) + 0.5) / terms
    return values if is_converged else np.asarray(values * np.exp(-_WINDOW_EXPONENT * orders**_WINDOW_ORDER))


def _line_series(vector: _Reduced) -> Probability:
    """Probability of the absolute value of a number, by the Fourier series of its density over its support."""
    support = vector.support
    envelopes = _envelope(vector, np.array(_LINE_SERIES_TERMS)[:, None] * (math.pi / support))
    is_converged = envelopes / np.array(_LINE_SERIES_TERMS) < _SERIES_END_FRACTION
    terms = _LINE_SERIES_TERMS[int(np.argmax(is_converged)) if is_converged.any() else -1]
    orders = np.arange(1.0, terms + 1)
    waves: Floats = orders * (math.pi / support)
    factors = _window(_characteristic(vector, waves[:, None]), bool(is_converged.any())) * (2.0 / math.pi) / orders

    def probability(limits: Floats) -> Floats:
        inside = np.minimum(limits, support)
        return np.where(limits < support, inside / support + np.sin(np.outer(inside, waves)) @ factors, 1.0)

    return probability


def _square_support(vector: _Reduced) -> float:
    """Squared length that a normal vector exceeds with a probability of less than 1e-12."""
    lengths = _lengths(vector.normal)
    root = math.hypot(*vector.mean.tolist()) + math.hypot(*lengths.tolist()) + _SUPPORT_SIGMA * float(lengths[0])
    return root * root


def _square_terms(vector: _Reduced) -> int:
    """Number of terms of the Fourier series of the squared length that suffices, or 0 if none or not normal alone."""
    if len(vector.mean) < 3 or vector.contributions > len(vector.normal):
        return 0
    orders = np.array(_LINE_SERIES_TERMS)
    values = np.abs(_square_characteristic(vector, orders * (math.pi / _square_support(vector))))
    return _terms_of(values / orders, _LINE_SERIES_TERMS)


def _terms_of(sizes: Floats, terms: tuple[int, ...]) -> int:
    """First number of terms that suffices, from the sizes of the last term of each, or 0 if none does."""
    is_converged = sizes < _SERIES_END_FRACTION
    if is_converged.any():
        return terms[int(np.argmax(is_converged))]
    return terms[-1] if sizes[-1] < _LAST_SERIES_END_FRACTION else 0


def _square_characteristic(vector: _Reduced, waves: Floats) -> Complexes:
    """Characteristic function of the squared length of a normal vector: noncentral chi-squares (Imhof 1961)."""
    variances = np.einsum("ij,ij->i", vector.normal, vector.normal)
    squares = (vector.normal @ vector.mean) ** 2 / variances
    constant = max(float(vector.mean @ vector.mean) - float(squares.sum()), 0.0)
    exponents, product = 1j * constant * waves, np.ones(len(waves), dtype=complex)
    for variance, square in zip(variances.tolist(), squares.tolist(), strict=True):
        factor = 1.0 - 2j * variance * waves
        product *= np.sqrt(factor)
        exponents = exponents + 1j * square * waves / factor
    return np.asarray(np.exp(exponents) / product)


def _square_series(vector: _Reduced, terms: int) -> Probability:
    """Probability of the length of a normal vector, by the Fourier series of the density of its square."""
    support = _square_support(vector)
    orders = np.arange(1.0, terms + 1)
    waves = np.asarray(orders * (math.pi / support))
    # The density is continued evenly to negative squares, so that its series has cosines alone.
    values = np.asarray(_square_characteristic(vector, waves).real)
    factors = _window(values, terms < _LINE_SERIES_TERMS[-1]) * (2.0 / math.pi) / orders

    def probability(limits: Floats) -> Floats:
        inside = np.minimum(limits**2, support)
        values = inside / support + np.sin(np.outer(inside, waves)) @ factors
        return np.where(limits**2 < support, values, 1.0)

    return probability


def _plane_terms(vector: _Reduced) -> int:
    """Number of terms of the Fourier-Bessel series that suffices, or 0 if it converges too slowly."""
    support, sizes = vector.support, []
    for terms in _PLANE_SERIES_TERMS:
        angles = (np.arange(4 * terms) + 0.5) * (math.pi / (4 * terms))
        waves = np.stack((np.cos(angles), np.sin(angles)), axis=1) * (math.pi * terms / support)
        sizes.append(float(_envelope(vector, waves).mean()) * 2.5 / math.sqrt(math.pi * terms))
        if sizes[-1] < _SERIES_END_FRACTION:
            return terms
    return _terms_of(np.array(sizes), _PLANE_SERIES_TERMS)


def _plane_series(vector: _Reduced, terms: int) -> Probability:
    """Probability of the length of a vector in the plane, by the Fourier-Bessel series of its density.

    The coefficients of the density, averaged over all directions, are the mean characteristic functions on circles.
    """
    support = vector.support
    zeros, slopes = _bessel_zeros()
    zeros, slopes = zeros[:terms], slopes[:terms]
    means = np.empty(terms)
    first = 0
    while first < terms:
        last = min(max(2 * first, 8), terms)
        count = math.ceil(0.55 * zeros[last - 1]) + 16
        angles = np.arange(count) * (math.pi / count)
        directions = np.stack((np.cos(angles), np.sin(angles)), axis=1)
        waves = (zeros[first:last, None, None] / support) * directions
        means[first:last] = _characteristic(vector, waves.reshape(-1, 2)).reshape(-1, count).mean(axis=1)
        first = last
    factors = _window(means, terms < _PLANE_SERIES_TERMS[-1]) * 2.0 / (zeros * slopes**2)

    def probability(limits: Floats) -> Floats:
        inside = np.minimum(limits / support, 1.0)
        return np.where(limits < support, inside * (_bessel(1, np.outer(inside, zeros)) @ factors), 1.0)

    return probability


@cache
def _bessel_zeros() -> tuple[Floats, Floats]:
    """Zeros of J₀, and the values of J₁ there."""
    zeros = np.asarray((np.arange(_PLANE_SERIES_TERMS[-1]) + 0.75) * math.pi, dtype=np.float64)
    for _ in range(6):
        zeros = zeros + _bessel(0, zeros) / _bessel(1, zeros)
    return zeros, _bessel(1, zeros)


@cache
def _bessel_table() -> tuple[Floats, Floats]:
    """J₀ and J₁ up to `_BESSEL_TABLE_END_RAD`, by Bessel's integral, for which the mean over angles is exact here."""
    arguments = np.arange(_BESSEL_TABLE_END_RAD * _BESSEL_STEPS_PER_RAD + 2) / _BESSEL_STEPS_PER_RAD
    angles = (np.arange(64) + 0.5) * (math.pi / 64)
    phases = arguments[:, None] * np.sin(angles)
    return np.cos(phases).mean(axis=1), np.cos(angles - phases).mean(axis=1)


def _bessel(order: int, arguments: Floats) -> Floats:
    """J₀ or J₁ of numbers from 0, with an error below 1e-9: by a table and cubics, or by Hankel's expansion."""
    is_far = arguments >= _BESSEL_TABLE_END_RAD
    if not is_far.any():
        return _bessel_near(order, arguments)
    values = np.empty_like(arguments)
    values[~is_far] = _bessel_near(order, arguments[~is_far])
    values[is_far] = _bessel_far(order, arguments[is_far])
    return values


def _bessel_near(order: int, arguments: Floats) -> Floats:
    """J₀ or J₁ within the table: by Hermite's cubic, because J₀' = −J₁ and J₁' = J₀ − J₁/x."""
    j_0, j_1 = _bessel_table()
    position = arguments * _BESSEL_STEPS_PER_RAD
    index = position.astype(np.intp)
    x = position - index
    values, slopes = (j_0, -j_1) if order == 0 else (j_1, _bessel_slopes())
    first, second = values[index], values[index + 1]
    first_slope, second_slope = slopes[index] / _BESSEL_STEPS_PER_RAD, slopes[index + 1] / _BESSEL_STEPS_PER_RAD
    rise = second - first
    cubic = (first_slope + second_slope - 2.0 * rise) * x + 3.0 * rise - 2.0 * first_slope - second_slope
    return np.asarray((cubic * x + first_slope) * x + first)


@cache
def _bessel_slopes() -> Floats:
    """Derivative of J₁ in the table."""
    j_0, j_1 = _bessel_table()
    arguments = np.arange(len(j_1)) / _BESSEL_STEPS_PER_RAD
    return np.concatenate(([0.5], j_0[1:] - j_1[1:] / arguments[1:]))


def _bessel_far(order: int, arguments: Floats) -> Floats:
    """J₀ or J₁ beyond the table, by Hankel's expansion (Abramowitz & Stegun 9.2.5)."""
    inverse, square = 1.0 / (8.0 * arguments), 4.0 * order * order
    term, cosines, sines = np.ones_like(arguments), np.ones_like(arguments), np.zeros_like(arguments)
    for k in range(1, 7):
        term = term * ((square - (2 * k - 1) ** 2) / k) * inverse
        if k % 2:
            sines += (-1) ** (k // 2) * term
        else:
            cosines += (-1) ** (k // 2) * term
    phases = arguments - (0.5 * order + 0.25) * math.pi
    return np.sqrt(2.0 / (math.pi * arguments)) * (cosines * np.cos(phases) - sines * np.sin(phases))


def _signed(vector: _Reduced) -> Floats:
    """Mean of the vector plus its bounds with all combinations of signs, (combinations, m)."""
    values = vector.mean[None]
    for row in vector.bound:
        values = np.concatenate((values - row, values + row))
    return values


class _Integrated(NamedTuple):
    """The contribution that is integrated exactly: its vector, (m,), and the probability beyond both ends."""

    row: Floats
    beyond: Callable[[Floats, Floats], Floats]


def _normal_outside(low: Floats, high: Floats) -> Floats:
    return _normal_beyond(high) + _normal_beyond(-low)


def _uniform_outside(low: Floats, high: Floats) -> Floats:
    return np.asarray(1.0 - 0.5 * (np.clip(high, -1.0, 1.0) - np.clip(low, -1.0, 1.0)))


def _tone_outside(low: Floats, high: Floats) -> Floats:
    return np.asarray(1.0 - (np.arcsin(np.clip(high, -1.0, 1.0)) - np.arcsin(np.clip(low, -1.0, 1.0))) / math.pi)


def _without_longest(vector: _Reduced, confidence: float) -> tuple[_Integrated | None, _Reduced]:
    """Take the contribution with the largest effect that can be integrated exactly from a vector.

    For high confidences that is a normal contribution, unless a uniform contribution is longer than its quantile.
    """
    normal = _along_longest(vector)
    score = max(NormalDist().inv_cdf(min(confidence, 1.0 - 1e-12)) if confidence else 0.0, math.sqrt(3.0))
    effects = [_effects(vector.mean, normal), _effects(vector.mean, vector.uniform / score)]
    first, second = (float(values.max(initial=0.0)) for values in effects)
    # Beside a long tone, a short contribution does not make the probability smooth.
    longest = max(float(_lengths(rows).max(initial=0.0)) for rows in (normal, vector.uniform))
    if longest < _SMOOTH_FRACTION * float(_lengths(vector.tone[:, 0]).max(initial=0.0)):
        first = second = 0.0
    if first and first >= second:
        index = int(np.argmax(effects[0]))
        return _Integrated(normal[index], _normal_outside), vector._replace(normal=np.delete(normal, index, axis=0))
    if second:
        index = int(np.argmax(effects[1]))
        uniform = np.delete(vector.uniform, index, axis=0)
        return _Integrated(vector.uniform[index], _uniform_outside), vector._replace(uniform=uniform)
    is_linear = _lengths(vector.tone[:, 1]) <= VECTOR_ROUNDING_FRACTION * _lengths(vector.tone[:, 0])
    if is_linear.any():
        index = int(np.argmax(is_linear))
        tone = np.delete(vector.tone, index, axis=0)
        return _Integrated(vector.tone[index, 0], _tone_outside), vector._replace(tone=tone)
    return None, vector


def _effects(mean: Floats, rows: Floats) -> Floats:
    """Standard deviation of the squared length due to each row alone, as if it were normal."""
    return np.asarray(np.sqrt(2.0 * np.einsum("ij,ij->i", rows, rows) ** 2 + 4.0 * (rows @ mean) ** 2))


def _along_longest(vector: _Reduced) -> Floats:
    """Normal contributions with the same covariance, of which only the first changes the vector in one direction.

    The direction is that of the mean, or, if the mean is short, that in which the vector varies most.
    """
    if len(vector.normal) < 2:
        return vector.normal
    variances, axes = np.linalg.eigh(vector.covariance)
    axis = axes[:, -1]
    if 2.0 * float(vector.mean @ vector.covariance @ vector.mean) > variances[-1] ** 2:
        axis = vector.mean / math.hypot(*vector.mean.tolist())
    components = vector.normal @ axis
    variance = float(components @ components)
    if variance <= _RANK_ROUNDING_FRACTION * float(vector.normal[0] @ vector.normal[0]):
        return vector.normal
    first = components @ vector.normal / math.sqrt(variance)
    remainder = _principal(_squares(vector.normal) - np.outer(first, first))[: len(vector.normal) - 1]
    return np.concatenate((first[None], remainder))


def _lattice(vector: _Reduced, confidence: float, stride: int = 1) -> Probability:
    """Probability of the length, integrated over the longest contribution, and over a lattice of the others.

    The lattice has 1/`stride` of the usual number of points.
    """
    most = _MAX_MIXTURE_BOUND_COUNT if _is_enumerated(vector) else _MAX_LATTICE_BOUND_COUNT
    longest, sampled = _without_longest(_with_few_bounds(vector, most), confidence)
    signed = _signed(sampled)
    dimensions = len(sampled.normal) + len(sampled.uniform) + len(sampled.tone)
    centres, weights = signed, np.full(len(signed), 1.0 / len(signed))
    if dimensions:
        is_tail = confidence > _TAIL_PROBABILITY and longest is not None
        tilt = _tilt(vector, confidence) if is_tail else None
        points = (_CURVE_POINTS if dimensions == 1 else _LATTICE_POINTS) if longest else _COUNT_POINTS
        points = _FAR_TAIL_POINTS if tilt and confidence > _FAR_TAIL_PROBABILITY else points
        points //= stride
        centres, weights = _sampled(sampled, points, tilt)
        centres += np.tile(
            np.repeat(signed, _COARSE_STRIDE_POINTS // stride, axis=0),
            (points * stride // len(signed) // _COARSE_STRIDE_POINTS, 1),
        )
        if dimensions > _LATTICE_EXACT_COUNT and tilt is None:
            weights = _calibrated(sampled, centres, weights)
    if longest is None:
        return _counted(_lengths(centres), weights)
    length = math.hypot(*longest.row.tolist())
    along = centres @ (longest.row / length)
    across = centres - np.outer(along, longest.row / length)
    across_square = np.einsum("ij,ij->i", across, across) if len(vector.mean) > 1 else np.zeros(len(along))

    def probability(limits: Floats) -> Floats:
        outside = []
        for limit in limits.tolist():
            reach = np.sqrt(np.maximum(limit * limit - across_square, 0.0))
            beyond = longest.beyond((-reach - along) / length, (reach - along) / length)
            outside.append(float(weights @ beyond))
        return 1.0 - np.array(outside)

    return probability


def _calibrated(vector: _Reduced, centres: Floats, weights: Floats) -> Floats:
    """Change weights slightly so that means, variances and the fourth moment of the length are exact.

    The result is the same as with these as control variates of each probability.
    """
    covariance, mean = vector.covariance, vector.mean
    deviations = centres - mean
    squares = deviations**2
    lengths = squares.sum(axis=1)
    features = np.column_stack((np.ones(len(weights)), deviations, squares, lengths**2))
    expected = np.concatenate(([1.0], np.zeros(len(mean)), np.diag(covariance), [_fourth_moment(vector)]))
    weighted = features * weights[:, None]
    gram = weighted.T @ features
    multipliers = np.linalg.lstsq(gram, expected - weighted.sum(axis=0), rcond=1e-10)[0]
    return np.asarray(weights + weighted @ multipliers)


def _fourth_moment(vector: _Reduced) -> float:
    """Mean of the fourth power of the length without the mean."""
    covariance = vector.covariance
    normal = 2.0 * float(np.sum(covariance**2)) + float(np.trace(covariance)) ** 2
    uniform, bound, first, second = (
        np.einsum("ij,ij->i", rows, rows)
        for rows in (vector.uniform, vector.bound, vector.tone[:, 0], vector.tone[:, 1])
    )
    tone = 3.0 * (first**2 + second**2) + 2.0 * first * second - 2.0 * (first + second) ** 2
    tone = tone - 4.0 * (first**2 + second**2)
    return normal - float((uniform**2).sum()) * 2.0 / 15.0 - 2.0 * float((bound**2).sum()) + float(tone.sum()) / 8.0


def _counted(lengths: Floats, weights: Floats) -> Probability:
    """Probability of the length as the weight of the points that are not longer."""
    order = np.argsort(lengths)
    lengths = lengths[order]
    beyond = np.append(np.cumsum(weights[order][::-1])[::-1], 0.0)
    return lambda limits: np.asarray(1.0 - beyond[np.searchsorted(lengths, limits, side="right")])


def _with_few_bounds(vector: _Reduced, count: int) -> _Reduced:
    """Replace all bounds but the longest by normal contributions with their variances."""
    if len(vector.bound) <= count:
        return vector
    long_first = vector.bound[np.argsort(-_lengths(vector.bound), kind="stable")]
    covariance = _squares(vector.normal) + _squares(long_first[count:])
    return vector._replace(normal=_principal(covariance), bound=long_first[:count])


class _Tilt(NamedTuple):
    """Factor exp(t·(y·mean + |y|²/2)), with which deviations y from the mean are sampled in the tail."""

    exponent: float
    mean: Floats
    least_variance: float  # of each normal contribution, relative to its own

    def of_deviations(self, rows: Floats) -> Floats:
        """Logarithm of the factor for deviations (rows, m)."""
        return np.asarray(self.exponent * (rows @ self.mean + 0.5 * np.einsum("ij,ij->i", rows, rows)))


def _tilt(vector: _Reduced, confidence: float) -> _Tilt:
    """Tilt with which a normal vector of the same covariance has the required length on average."""
    variances, axes = np.linalg.eigh(vector.covariance)
    means = (vector.mean @ axes).tolist()
    terms = [(value, mean * mean) for value, mean in zip(variances.tolist(), means, strict=True)]
    length = float(vector.rough_quantile(np.array([confidence]))[0])
    low, high = 0.0, 1.0 / max(variances)
    for _ in range(40):
        middle = 0.5 * (low + high)
        square = sum(value / (1.0 - middle * value) + mean / (1.0 - middle * value) ** 2 for value, mean in terms)
        low, high = (middle, high) if square < length * length else (low, middle)
    # Few normal contributions beside long uniform ones go farther than the normal vector of the same covariance.
    is_stretched = confidence > _FAR_TAIL_PROBABILITY and len(vector.normal) <= _STRETCHED_COUNT
    return _Tilt(low, vector.mean, _STRETCHED_VARIANCE_RATIO if is_stretched else 1.0)


def _sampled(vector: _Reduced, points: int, tilt: _Tilt | None) -> tuple[Floats, Floats]:
    """Sums of normal, uniform and tone contributions at the points of a lattice, (points, m), and their weights.

    With a tilt, long sums are more frequent than their probability, and their weights are smaller.
    """
    weights, sums = np.full(points, 1.0 / points), np.zeros((points, len(vector.mean)))
    samplers: list[tuple[float, Callable[[int], tuple[Floats, Floats | None]]]] = []
    for row in vector.normal:
        samplers.append((float(row @ row), partial(_normal_samples, row, points, tilt)))
    for row in vector.uniform:
        samplers.append((float(row @ row) / 3.0, partial(_uniform_samples, row, points, tilt)))
    for tone in vector.tone:
        samplers.append((float(tone[0] @ tone[0]), partial(_tone_samples, tone, points, tilt)))
    # The first coordinates of a lattice are the most even.
    for column, (_, sampler) in enumerate(sorted(samplers, key=lambda item: -item[0])):
        deviations, factors = sampler(min(column, len(_LATTICE_GENERATOR) - 1))
        sums += deviations
        if factors is not None:
            weights *= factors
    return sums, weights


def _normal_samples(row: Floats, points: int, tilt: _Tilt | None, column: int) -> tuple[Floats, Floats | None]:
    scores = _lattice_scores(points, column)
    if tilt is None:
        return np.outer(scores, row), None
    variance = 1.0 / (1.0 - tilt.exponent * float(row @ row))
    spread = math.sqrt(max(variance, tilt.least_variance))
    tilted = variance * tilt.exponent * float(row @ tilt.mean) + spread * scores
    return np.outer(tilted, row), spread * np.exp(0.5 * (scores**2 - tilted**2))


def _uniform_samples(row: Floats, points: int, tilt: _Tilt | None, column: int) -> tuple[Floats, Floats | None]:
    distances = np.abs(2.0 * _lattice_turns(points, column) - 1.0)
    if tilt is None:
        return np.outer(2.0 * distances - 1.0, row), None
    edges = np.linspace(-1.0, 1.0, _TILTED_CELLS + 1)
    values, factors = _tilted(edges, tilt.of_deviations(np.outer(edges, row)), distances)
    return np.outer(values, row), factors


def _tone_samples(tone: Floats, points: int, tilt: _Tilt | None, column: int) -> tuple[Floats, Floats | None]:
    phases, factors = 2.0 * math.pi * _lattice_turns(points, column), None
    if tilt is not None:
        edges = np.linspace(0.0, 2.0 * math.pi, _TILTED_CELLS + 1)
        deviations = np.stack((np.cos(edges), np.sin(edges)), axis=1) @ tone
        phases, factors = _tilted(edges, tilt.of_deviations(deviations), phases / (2.0 * math.pi))
    return np.stack((np.cos(phases), np.sin(phases)), axis=1) @ tone, factors


def _tilted(edges: Floats, exponents: Floats, shares: Floats) -> tuple[Floats, Floats]:
    """Values at which a distribution of constant density in cells reaches shares, and their weights."""
    densities = np.exp(exponents - exponents.max())
    densities = 0.5 * (densities[1:] + densities[:-1])
    densities /= densities.mean()
    cumulated = np.concatenate(([0.0], np.cumsum(densities))) / len(densities)
    cells = np.clip(np.searchsorted(cumulated, shares, side="right") - 1, 0, len(densities) - 1)
    position = (shares - cumulated[cells]) * len(densities) / densities[cells]
    return edges[cells] + position * (edges[1] - edges[0]), 1.0 / densities[cells]


@cache
def _lattice_turns(points: int, column: int) -> Floats:
    """One coordinate of the points of a lattice, from 0 to 1, (points,)."""
    return ((np.arange(points) * _LATTICE_GENERATOR[column]) % points + 0.5) / points


@cache
def _lattice_scores(points: int, column: int) -> Floats:
    """One coordinate of the points of a lattice as a standard normal number, (points,)."""
    distances = np.abs(2.0 * _lattice_turns(points, column) - 1.0)
    return _scores(points)[np.rint(0.5 * (distances * points - 1.0)).astype(np.intp)]


@cache
def _scores(points: int) -> Floats:
    """Standard normal numbers that divide the distribution into equal probabilities."""
    inverse = NormalDist().inv_cdf
    return np.array([inverse((2 * index + 1) / points) for index in range(points // 2)])
