"""A platform's path as a file knows it, and the function of slow time that a budget flies.

Exact ranges, images and every other command take a path as a polynomial over the aperture, or as several in pieces.
An orbit gives a place at any time: its polynomial interpolates. A log gives measured places: one polynomial smooths
them by least squares, or a spline of as many pieces as the log needs. Both say how far the path is from what the file
has.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import NDArray

from bisar_budget.geometry import STRAIGHT, PlatformState, Vector
from bisar_budget.paths.accuracy import Matrix, PathNoise, StatedAccuracy, as_matrix
from bisar_budget.paths.earth import Floats
from bisar_budget.paths.instant import DAY, Instant, gps_week
from bisar_budget.paths.splines import ORDER, SplineFit
from bisar_budget.paths.splines import basis as spline_basis

_NODES = 15  # Chebyshev points of an interpolation, so many coefficients
_LEAST_WINDOW = 10.0  # s; in a shorter one rounding of an Earth-fixed place, 1e-9 m, is an acceleration
_LOOKS = 65  # at the aperture, for what is between places
_UNSEEN_M = 1e-7  # a coefficient that moves the path by less is rounding
_ROUGH_M = 5e-3  # a path that is farther from its polynomial is not smooth; messages have places to 1 mm
_TRIFLE_M = 1e-3
_STRAY = 8  # times the usual residual; noise of thousands of places reaches 4
_HIGHEST = 8  # order of a smoothed path of one piece
_CLEAN_M = 1e-5  # root mean square that a path leaves of a log: what is less is no reason for more pieces
_WHITE = 2.0  # times its standard deviation: so far what neighbouring residuals have in common is chance
_MOST_PIECES = 256
_TRIED = 128  # coefficients at least, before no number of pieces is better: enough for 40 full circles
_TRIED_RATIO = 4  # or so many times those of the best path
_LOOKS_PER_PIECE = 4
_SAME = 1e-9  # of the largest mode of the noise: what is less is rounding
_FEWEST = 5  # places of a log that give a path
_ENOUGH = 9  # of them that say what is noise; of a log that has fewer in the aperture, places beside it help
_GROWTH = 1.5  # of a stretch to the next wider one
_WIDEST_RATIO = 64.0  # of a stretch over the narrowest
_MOST_FITTED = 20_000  # places
_SETTLED_M = 1e-6  # of the fit's own noise in the path: less decides nothing, at any carrier
_CHANCE = 2.0  # times the variance that two fits are apart by chance
_HOPELESS = 9.0  # times the least predicted error (squares), from which on no wider stretch is tried
_RESIDUAL_GROWTH = 1.1  # of the residual in the aperture, from which on a wider fit does not follow the path
_WIDEST_GAP = 5  # usual intervals between samples
_LISTED = 3  # tracks that an error names
_ROUNDED = 1 + 1e-6  # of an interval whose ends are rounded


NO_MATRIX: Matrix = ((0.0,) * 3,) * 3


class PathFileError(Exception):
    """A file that gives no path. The message names the file, and its line, byte or record.

    `accepted` says what a file would have instead, `hint` what may be done. `key` is the one beside that of the file
    which the file contradicts; empty: the file itself is wrong. `spans` are the times for which the file has places,
    where it has none for those that were asked for.
    """

    def __init__(
        self,
        message: str,
        accepted: str = "",
        hint: str = "",
        key: str = "",
        spans: Sequence[tuple[Instant, Instant]] = (),
    ) -> None:
        super().__init__(message)
        self.accepted, self.hint, self.key, self.spans = accepted, hint, key, spans


def hold_to_bytes(data: bytes, most: int, name: str) -> None:
    """Refuse a log of more bytes than are read; raises `PathFileError`."""
    if len(data) > most:
        raise PathFileError(f"{name}: has {len(data) / 1e6:.0f} MB, at most {most / 1e6:.0f} MB are read")


class PathDoubt(NamedTuple):
    """How far the truth may be from a path, by what is known of its own source [m], and what that is."""

    size: float
    words: str


NO_DOUBT = PathDoubt(0.0, "")


@dataclass(frozen=True)
class Orbit:
    """A path that is known at any instant of a span.

    `place` takes an instant and gives Earth-fixed coordinates [m]. `words` says what it is, for reports; `epoch` is
    that of the elements. `doubt` says at an instant how far the truth may be; `doubts` are warnings of it, where it
    is more than usual, and `remedy` is what makes it less. An orbit that `is_turned` comes from axes of the stars.
    `turning_doubt` and `turning_doubts` are the part of both that the Earth's orientation has, not the orbit.
    `stated` is the accuracy that its file states at an instant, along the axes of the Earth.
    """

    place: Callable[[Instant], Vector]
    words: str
    span: tuple[Instant, Instant] | None = None
    epoch: Instant | None = None
    doubts: Callable[[Instant], Sequence[str]] = lambda _: ()
    doubt: Callable[[Instant], PathDoubt] = lambda _: NO_DOUBT
    remedy: str = ""
    is_turned: bool = False
    turning_doubt: Callable[[Instant], PathDoubt] = lambda _: NO_DOUBT
    turning_doubts: Callable[[Instant], Sequence[str]] = lambda _: ()
    stated: Callable[[Instant], StatedAccuracy | None] = lambda _: None

    def as_planned(self) -> "Orbit":
        """The orbit as the plan, which is flown as it stands: neither its age nor its interpolation is in doubt."""
        words = f"{self.words}, flown as planned: its age and its interpolation do not count"
        return replace(self, words=words, doubt=self.turning_doubt, doubts=self.turning_doubts)

    def largest_doubt_m(self, instant: Instant) -> float:
        """How far the truth may be at an instant, by what its file states of itself or by anything else. [m]"""
        stated = self.stated(instant)
        return max(self.doubt(instant).size, 0.0 if stated is None else stated.position_m)


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Records of a log that cannot be used: how many usable ones come before each (m,), and messages that say why."""

    before: NDArray[np.int64]
    faults: Sequence[str]


@dataclass(frozen=True, eq=False)
class Log:
    """Measured places (n, 3) [m] at rising times (n,) [s], Earth-fixed or in the scene's axes.

    Times count from `start`; without one they are those of the log itself: from a midnight of UTC where `clock` is
    "day", from the begin of a GPS week where it is "week". `words` says what the log is, for reports. `left_out` are
    records that are not among the places. A file of several tracks, of which no key chooses one, has the log of each
    in `tracks`; the log itself is then that of the first.
    `sigmas` (n, 3) are one-sigma errors east, north, up, where the log states them; NaN at fixes without [m].
    `typical_sigmas` (n,) are those that a fix of the stated quality usually has, on each axis; NaN where the log
    says no quality [m]. `quality_words` names the quality of the fix of an index: "GGA quality 1, autonomous".
    `grid` is one step of each coordinate that the log writes, in the axes of the places [m].
    """

    times: Floats
    places: Floats
    is_earth_fixed: bool
    words: str
    start: Instant | None = None
    sigmas: Floats | None = None
    typical_sigmas: Floats | None = None
    quality_words: Callable[[int], str] = lambda _: ""
    clock: str = ""
    left_out: LeftOut | None = None
    tracks: tuple["Log", ...] = ()
    grid: Matrix = NO_MATRIX


@dataclass(frozen=True)
class Fitted:
    """A path by polynomials, their order, and how far it is from the file's places, at most and root mean square [m].

    `pieces` is the number of the polynomials: more than one, and they meet with one place and one velocity.
    `samples` is how many of a log's places they smooth, over `stretch` [s]; none of an orbit, which is interpolated.
    `missed` is how far the path goes by a place of the log that it does not know, root mean square [m]. `doubts` are
    warnings.
    `residual` (3, 3) is the covariance of what the path leaves of the fixes in the aperture [m²], and
    `correlation_time` that of a Gauss-Markov process which is correlated as they are [s]. `acceleration_noise` (3, 3)
    is the covariance of the fit's own error of the acceleration [m²/s⁴], with what a wider stretch may have smeared:
    of one polynomial at mid-aperture, of pieces that of the parabola through their error. `path_noise` is that error
    over the aperture.
    """

    state: PlatformState
    order: int
    farthest: float
    rms: float
    samples: int = 0
    doubts: tuple[str, ...] = ()
    stretch: float = 0.0
    missed: float = 0.0
    residual: Matrix = NO_MATRIX
    correlation_time: float = 0.0
    acceleration_noise: Matrix = NO_MATRIX
    path_noise: PathNoise | None = None
    pieces: int = 1


def interpolated(places: Callable[[Floats], Floats], aperture_time_s: float, widest_s: float = math.inf) -> Fitted:
    """Path through places of the scene at Chebyshev points around the aperture.

    Parameters
    ----------
    places : callable
        From slow times (n,) [s] to places (n, 3) in the scene's axes [m].
    aperture_time_s : float
        What the path is needed for.
    widest_s : float
        Longest time around the middle in which there are places.
    """
    half = min(max(aperture_time_s, _LEAST_WINDOW), widest_s) / 2
    nodes = chebyshev.chebpts1(_NODES)
    basis = chebyshev.chebvander(nodes, _NODES - 1)
    series: Floats = np.asarray(np.linalg.solve(basis, places(half * nodes)), dtype=float)
    series[np.abs(series) <= _UNSEEN_M] = 0.0  # what is below rounding would be divided by high powers of the window
    state = path_of(powers_of(series, half, chebyshev.cheb2poly))
    times = aperture_time_s / 2 * np.cos(math.pi * np.arange(_NODES + 1) / _NODES)
    apart = np.linalg.norm(np.stack(state.place(times), axis=1) - places(times), axis=1)
    farthest, rms = float(apart.max()), math.sqrt(float(np.mean(apart**2)))
    doubts: tuple[str, ...] = ()
    if farthest > _ROUGH_M:
        doubts = (f"the polynomial that is flown is up to {farthest:.3g} m from the path",)
    return Fitted(state, len(state.bends) + 2, farthest, rms, doubts=doubts)


def stretch_around(times: Floats, aperture_time_s: float) -> float:
    """Shortest time around the middle of an aperture whose places of a log are smoothed. [s]

    It is the aperture, or as much longer as holds nine places: a log at 1 Hz has three in 3 s.
    """
    apart = np.sort(np.abs(times))[:_ENOUGH]
    return max(aperture_time_s, 2 * float(apart.max(initial=0.0)))


@dataclass(frozen=True, eq=False)
class _SmoothFit:
    """A path through the fixes of a stretch: slow times (n,) [s], and what it leaves of them (n, 3) [m].

    It is a Legendre series, or a spline. `independent` is how many independent fixes they are worth. `root`
    (coefficients, coefficients) times its transpose is the covariance of the coefficients, over the variance of white
    fixes.
    """

    half_s: float
    times: Floats
    series: Floats
    left: Floats
    independent: float
    root: Floats
    spline: SplineFit | None = None

    @classmethod
    def of_spline(cls, half_s: float, times: Floats, spline: SplineFit, independent: float) -> "_SmoothFit":
        return cls(half_s, times, spline.series, spline.left, independent, spline.root, spline)

    @property
    def order(self) -> int:
        return len(self.series) - 1 if self.spline is None else ORDER

    @property
    def pieces(self) -> int:
        return 1 if self.spline is None else len(self.spline.edges) - 1

    @property
    def covariance(self) -> Floats:
        """Covariance of the coefficients, over the variance of a fix; correlated fixes count as fewer."""
        return np.asarray(self.root @ self.root.T * (len(self.left) / self.independent))

    @property
    def variances(self) -> Floats:
        """Variance of a fix on each axis, (3,). [m²]"""
        found: Floats = (self.left**2).sum(axis=0) / max(len(self.left) - len(self.series), 1)
        return found

    @property
    def in_common(self) -> tuple[float, float]:
        """Mean product of a residual and the next one, which white noise has none of, and its standard deviation.

        Of white noise each coefficient takes a part that neighbours have in common; it is given back.
        """
        products = (self.left[1:] * self.left[:-1]).sum(axis=1)
        mean, square = float(products.mean()), float(np.mean(np.sum(self.left**2, axis=1)))
        taken = len(self.series) / len(self.left) * (square - mean)
        return mean + taken, math.sqrt(float(np.mean(products**2)) / len(products))

    @property
    def rms(self) -> float:
        """Root mean square of what it leaves. [m]"""
        return math.sqrt(float(np.mean(np.sum(self.left**2, axis=1))))

    def basis(self, times: Floats) -> Floats:
        """Matrix (m, coefficients) from coefficients to places at slow times (m,) [s]."""
        if self.spline is not None:
            return spline_basis(times, self.spline.edges)
        return np.asarray(legendre.legvander(times / self.half_s, self.order))

    def places(self, times: Floats) -> Floats:
        """Places at slow times [s], (m, 3). [m]"""
        found: Floats = self.basis(times) @ self.series
        return found if self.spline is None else found + self.spline.middle

    def leverage(self, times: Floats) -> Floats:
        """Variance that the fit has at slow times (m,) [s], over that of a fix."""
        return np.asarray(np.sum((self.basis(times) @ self.root) ** 2, axis=1))

    def state(self) -> PlatformState:
        """The path that it is."""
        return path_of(powers_of(self.series, self.half_s)) if self.spline is None else self.spline.state()

    def looks(self, aperture_time_s: float) -> Floats:
        """Slow times over an aperture, close enough for the error of the path. [s]"""
        count = max(_LOOKS, _LOOKS_PER_PIECE * self.pieces + 1)
        return np.asarray(aperture_time_s / 2 * np.linspace(-1, 1, count))

    def noise(self, times: Floats, left_out: Floats) -> float:
        """Mean square of the fit's own error over times (m,), of which a projection (m, m) is left out. [m²]"""
        basis = self.basis(times)
        basis = basis - left_out @ basis
        return float(np.einsum("mi,ij,mj->", basis, self.covariance, basis) / times.size * self.variances.sum())

    def acceleration_noise(self, aperture_time_s: float) -> Floats:
        """Covariance of the error of the acceleration, (3, 3). [m²/s⁴]

        A polynomial's error has it at mid-aperture. Each piece of a spline has an error of its own, of which the
        bend over the whole aperture counts: that of the parabola through the error.
        """
        if self.spline is None:
            bends = np.array([legendre.legval(0.0, legendre.legder(one, 2)) for one in np.eye(self.order + 1)])
            scale_s = self.half_s
        else:
            looks, scale_s = self.looks(aperture_time_s), aperture_time_s / 2
            parabola = np.linalg.pinv(legendre.legvander(looks / scale_s, 2))[2]
            bends = 3 * parabola @ self.basis(looks)  # P₂ has the second derivative 3
        variance = float(bends @ self.covariance @ bends) / scale_s**4
        return np.diag(variance * self.variances)

    def path_noise(self, aperture_time_s: float, excess: float) -> PathNoise:
        """The error of the path over the aperture, its variance times a factor."""
        looks, half_s = self.looks(aperture_time_s), aperture_time_s / 2
        through = np.linalg.pinv(legendre.legvander(looks / half_s, _HIGHEST)) @ self.basis(looks)
        ways, sizes, _ = np.linalg.svd(through @ self.root, full_matrices=False)
        ways = ways[:, sizes > _SAME * sizes[0]] * sizes[sizes > _SAME * sizes[0]]
        sigmas = np.sqrt(excess * len(self.left) / self.independent * self.variances)
        modes = []
        for way in ways.T:
            powers = np.array(legendre.leg2poly(way)) / half_s ** np.arange(len(way))
            modes += [
                tuple(_vector(sigma * power * axis) for power in powers)
                for sigma, axis in zip(sigmas, np.eye(3), strict=True)
            ]
        return PathNoise(tuple(modes))


def _information(fit_left: Floats, coefficients: int, independent: float) -> float:
    """Information criterion of a fit by what it leaves (n, 3) [m]: the less, the better.

    Each axis has its own noise, and as many coefficients. The last factor is that of AICc (Hurvich & Tsai 1989): a
    few samples are fitted too well by chance.
    """
    count, squares = len(fit_left), (fit_left**2).mean(axis=0) + _UNSEEN_M**2
    cost = 3 * coefficients * math.log(independent) * count / (count - coefficients - 1)
    return float(independent * np.log(squares).sum()) + cost


def _fit(times: Floats, places: Floats, half_s: float, *, may_have_pieces: bool) -> _SmoothFit:
    """The path of the least Bayesian information criterion (Schwarz 1978) through the fixes of a stretch."""
    inside = np.abs(times) <= half_s * (1 + 1e-9)
    used, wanted, count = times[inside], places[inside], int(inside.sum())
    at = used / half_s
    fits = [least_squares(at, wanted, order) for order in range(2, min(_HIGHEST, (count - 1) // 2) + 1)]
    independent = _independent(fits[-1][1])
    series, left = min(fits, key=lambda fit: _information(fit[1], len(fit[0]), independent))
    triangle = np.linalg.qr(legendre.legvander(at, len(series) - 1))[1]
    fit = _SmoothFit(half_s, used, series, left, independent, np.linalg.inv(triangle))
    return _in_pieces(fit, wanted) if may_have_pieces else fit


def _in_pieces(fit: _SmoothFit, places: Floats) -> _SmoothFit:
    """The polynomial itself, or a spline through its fixes (n, 3) [m] where that has less information left.

    Pieces are halved, see `splines`, as long as residuals have something in common.
    """
    best = last = fit
    edges: Floats | None = np.array([-fit.half_s, fit.half_s])
    while edges is not None and best.rms > _CLEAN_M and last.in_common[0] > _WHITE * last.in_common[1]:
        coefficients = len(edges) - 1 + ORDER
        most = min(max(_TRIED, _TRIED_RATIO * len(best.series)), _MOST_PIECES + ORDER, len(places) // 2)
        if coefficients > most:
            break
        spline = SplineFit.of(fit.times, places, edges)
        independent = _independent(spline.left)
        last = _SmoothFit.of_spline(fit.half_s, fit.times, spline, independent)
        gain = _information(best.left, len(best.series), independent) - _information(
            last.left, coefficients, independent
        )
        falls = last.in_common[0] * coefficients**2 <= best.in_common[0] * len(best.series) ** 2
        if gain > 0 and falls:
            best = last
        edges = spline.halved(fit.times)
    return best


def _widened(
    narrowest: _SmoothFit, times: Floats, places: Floats, aperture_time_s: float, widest_s: float
) -> tuple[_SmoothFit, float]:
    """The fit of the stretch whose path over the aperture has the smallest predicted error; that over its noise.

    A longer stretch averages more noise: the acceleration of a parabola has an error of σ√(720/(n·T⁴)). It may smear
    what the platform did, and nobody knows that. What is known is how far the path is from those of narrower
    stretches: the square of that has the expectation of the smear and of the noise that the wider fit does without.
    What exceeds that noise is counted as smear (Goldenshluger & Lepski 2011, whose rule this is; Lepski 1991). The
    error that counts is that beyond a straight line, which defocuses; the whole path must not become worse, and the
    residual in the aperture must not grow.
    """
    looks, has_pieces = narrowest.looks(aperture_time_s), narrowest.spline is not None
    straight = np.linalg.qr(np.vander(looks, 2))[0]
    projection, nothing = straight @ straight.T, np.zeros((looks.size, looks.size))
    kept = (projection, nothing)  # what is left out of the error that counts, and of the whole
    reach_s = min(widest_s / 2, max(abs(float(times[0])), abs(float(times[-1]))), _WIDEST_RATIO * narrowest.half_s)
    if has_pieces:  # noise of distant fixes does not reach the aperture: only its ends gain
        reach_s = min(reach_s, _GROWTH * narrowest.half_s)
    candidates, half_s = [(narrowest, [narrowest.noise(looks, one) for one in kept])], narrowest.half_s
    best, least = narrowest, candidates[0][1][0]
    residual = _residual_within(narrowest, aperture_time_s)
    while least > _SETTLED_M**2 and half_s < reach_s * (1 - 1e-9):
        half_s = min(half_s * _GROWTH, reach_s)
        if np.searchsorted(times, half_s, "right") - np.searchsorted(times, -half_s) > _MOST_FITTED:
            break
        fit = _fit(times, places, half_s, may_have_pieces=has_pieces)
        noises = [fit.noise(looks, one) for one in kept]
        smears = [0.0, 0.0]
        for other, of_other in candidates:
            apart = fit.places(looks) - other.places(looks)
            for place, left_out in enumerate(kept):
                square = float(np.mean(np.sum((apart - left_out @ apart) ** 2, axis=1)))
                smears[place] = max(smears[place], square - _CHANCE * max(of_other[place] - noises[place], 0.0))
        candidates.append((fit, noises))
        errors = [noise + smear for noise, smear in zip(noises, smears, strict=True)]
        grows = _residual_within(fit, aperture_time_s) > _RESIDUAL_GROWTH**2 * residual
        if grows or errors[0] > _HOPELESS * least:
            break
        if errors[0] < least and errors[1] <= candidates[0][1][1]:
            best, least = fit, errors[0]
    own = best.noise(looks, projection)
    return best, least / own if own > 0 else 1.0


def _residual_within(fit: _SmoothFit, aperture_time_s: float) -> float:
    """Mean square of what a fit leaves of the fixes in the aperture, or of all where it has few. [m²]"""
    inside = np.abs(fit.times) <= aperture_time_s / 2 * (1 + 1e-9)
    left = fit.left[inside] if inside.sum() >= _ENOUGH else fit.left
    count, coefficients = len(fit.left), len(fit.series)
    return float(np.mean(np.sum(left**2, axis=1))) * count / max(count - coefficients, 1)


def smoothed(times: Floats, places: Floats, aperture_time_s: float, widest_s: float = 0.0) -> Fitted:
    """Path that fits the places of a log around the aperture by least squares.

    The order is that of the least Bayesian information criterion (Schwarz 1978), to 8 at most and to half the
    samples. Where one polynomial leaves motion, the path is a spline of as many pieces as the same criterion asks
    for, see `splines`. What a platform does faster is in the log's noise, or is vibration. Samples with correlated
    residuals count as fewer. A slow error of the log, which looks like motion, is then not fitted as if it were white
    noise.

    The stretch is that around the aperture, or as much longer as makes the predicted error of the path least, see
    `_widened`: noise of the log is an acceleration of the path, by which allowables are wrong.

    `missed` leaves out each place in the aperture, and the ones next to it, in turn (Allen 1974): that is noise, what
    the polynomial does not follow, and what the platform did between two places, of which a log that is slow for its
    motion says nothing. Where the fit makes more of noise than a place has, as in a gap, it is that much more.

    Parameters
    ----------
    times : (n,) ndarray
        Slow time, rising; what is outside the stretch is not used. [s]
    places : (n, 3) ndarray
        In the scene's axes. [m]
    aperture_time_s : float
        Length of the aperture.
    widest_s : float
        Longest time around the middle whose places may be smoothed; omitted: the shortest stretch that is needed.

    Raises
    ------
    PathFileError
        Fewer than five places in all.

    Notes
    -----
    A residual r of a place of the leverage h is r/(1 - h) of the fit without it (Belsley, Kuh & Welsch 1980, 2.1).
    """
    half = stretch_around(times, aperture_time_s) / 2
    count = int((np.abs(times) <= half * (1 + 1e-9)).sum())
    if count < _FEWEST:
        raise PathFileError(
            f"has {count} places around the aperture of {aperture_time_s:g} s, at least {_FEWEST} are needed; keep"
            " more of the log"
        )
    fit, excess = _widened(_fit(times, places, half, may_have_pieces=True), times, places, aperture_time_s, widest_s)
    used, left, count = fit.times, fit.left, len(fit.times)
    rms = math.sqrt(float((left**2).sum()) / max(count - len(fit.series), 1))
    apart = np.linalg.norm(left, axis=1)
    farthest, usual = float(apart.max()), float(np.median(apart))
    doubts: tuple[str, ...] = ()
    if farthest > _STRAY * usual + _TRIFLE_M:
        when = float(used[apart.argmax()])
        doubts = (
            f"a place of the log, {when:+.4g} s from mid-aperture, is {farthest:.3g} m from the smooth path; half of "
            f"the places are within {usual:.2g} m",
        )
    first = max(int(np.searchsorted(used, -aperture_time_s / 2)) - 1, 0)
    near = slice(first, int(np.searchsorted(used, aperture_time_s / 2, "right")) + 1)
    own = np.minimum(fit.leverage(used), 1 - 1e-9)  # at a place: its own part in the fit
    missed = float(np.sqrt(np.mean((apart / (1 - own))[near] ** 2)))
    # Noise of places beside a gap may be more in it.
    widest = fit.leverage(fit.looks(aperture_time_s))
    missed *= max(1.0, math.sqrt(float(widest.max())))
    of_aperture = left[near]
    residual = of_aperture.T @ of_aperture / len(of_aperture) * (count / max(count - len(fit.series), 1))
    return Fitted(
        fit.state(),
        fit.order,
        farthest,
        rms,
        count,
        doubts,
        2 * fit.half_s,
        missed,
        as_matrix(residual),
        float(used[-1] - used[0]) / max(count - 1, 1) * count / fit.independent / 2,
        as_matrix(excess * fit.acceleration_noise(aperture_time_s)),
        fit.path_noise(aperture_time_s, excess),
        fit.pieces,
    )


def around_aperture(times: Floats, aperture_time_s: float) -> slice:
    """Which places are in the aperture or next to it, of slow times (n,) [s].

    The largest sigma of them counts: a mean would declare less error than the log has at some time of the aperture.
    """
    half = aperture_time_s / 2
    first = max(int(np.searchsorted(times, -half, "right")) - 1, 0)
    return slice(first, int(np.searchsorted(times, half, "left")) + 1)


def slow_times(
    log: Log, center: Instant | None, center_seconds: float | None, aperture_time_s: float, name: str
) -> Floats:
    """Slow time of each sample of a log that has what the aperture needs.

    Parameters
    ----------
    log : Log
        Any samples before and behind the aperture are kept.
    center : Instant or None
        Middle of the aperture, for a log in UTC; not looked at for another.
    center_seconds : float or None
        Middle of the aperture on the clock of a log that is not in UTC; None is 0 s. [s]
    aperture_time_s : float
        Length of the aperture. [s]
    name : str
        The file in messages.

    Returns
    -------
    (n,) ndarray
        0 is the middle of the aperture. [s]

    Raises
    ------
    PathFileError
        The log does not cover the aperture, give or take one sample, or has a gap in it of more than five usual
        intervals: medians, in the aperture or of the log. Or the middle is on a clock that the log does not have.
    """
    times, start = log.times, log.start
    _hold_to_clock(log, center, center_seconds, name)
    if start is not None:
        if center_seconds is not None:
            raise PathFileError(
                f"{name}: is in UTC, and has no time {center_seconds:.12g} s; give the middle of the aperture in UTC"
            )
        if center is None:
            raise PathFileError(f"{name}: is in UTC; give the middle of the aperture in UTC")
    middle = center.since(start) if center is not None and start is not None else center_seconds or 0.0

    def said(slow: float) -> str:
        return start.after(slow + middle).as_text() if start is not None else f"{slow + middle:.12g} s"

    slow, half = times - middle, aperture_time_s / 2

    def cause(place: int) -> str:
        """Why there is no sample before that of a place, where there are records that cannot be used."""
        if log.left_out is None or place not in log.left_out.before:
            return ""
        return f"; {log.left_out.faults[int((log.left_out.before == place).argmax())]}"

    # The interval before the aperture and the one behind it lead into it.
    inside = slow[around_aperture(slow, aperture_time_s)]
    steps = np.diff(inside)
    # A gap as long as the aperture is the only step in it.
    usual = min(float(np.median(steps)), float(np.median(np.diff(slow)))) if steps.size else 0.0
    spare = usual * _ROUNDED
    if slow[0] > -half + spare or slow[-1] < half - spare:
        is_own_clock = start is None and center_seconds is None
        raise PathFileError(
            f"{name}: covers {said(float(slow[0]))} to {said(float(slow[-1]))}, "
            f"the aperture needs {said(-half)} to {said(half)}" + cause(0 if slow[0] > -half + spare else len(slow)),
            hint="trajectory.center says which time of the log is the middle of the aperture" if is_own_clock else "",
        )
    if steps.size and steps.max() > _WIDEST_GAP * spare:
        at = int(steps.argmax())
        raise PathFileError(
            f"{name}: has a gap of {steps[at]:.4g} s after {said(float(inside[at]))}, in the aperture; "
            f"{usual:.4g} s is usual, at most {_WIDEST_GAP * usual:.4g} s are bridged"
            + cause(int(np.searchsorted(slow, inside[at], "right")))
        )
    return slow


def _hold_to_clock(log: Log, center: Instant | None, center_seconds: float | None, name: str) -> None:
    """Refuse a middle of the aperture on a clock from which a log without a date, or a week, has no way."""
    if log.start is not None or center_seconds is not None:
        return
    if log.clock == "day":
        raise PathFileError(
            f"{name}: has times of day and no date",
            "accepted: collection.center_time, of which the nearest midnight dates the log",
            "Sentences RMC or ZDA beside the fixes give the date, too",
        )
    if log.clock == "week":
        week = "2421 and the like" if center is None else f"{gps_week(center)}, the week of collection.center_time"
        raise PathFileError(
            f"{name}: counts seconds of a GPS week, {log.times[0]:.12g} s to {log.times[-1]:.12g} s, and"
            " trajectory.week does not say of which one",
            f"accepted: trajectory.week: {week}",
        )


def dated(log: Log, center: Instant | None) -> Log:
    """A log of times of day with the date that puts it nearest to the middle of the aperture; others as they are."""
    if log.clock != "day" or log.start is not None or center is None:
        return log
    middle = float(log.times[len(log.times) // 2])
    midnight = Instant(center.day + round((center.seconds - middle) / DAY), 0.0)
    words = f"{log.words}, date by collection.center_time: {midnight.as_text()[:10]}"
    return replace(log, start=midnight, words=words)


def track_around(
    log: Log, center: Instant | None, center_seconds: float | None, aperture_time_s: float, name: str
) -> Log:
    """The log itself, or of several tracks the one that covers the aperture; all else is as in `slow_times`.

    Raises
    ------
    PathFileError
        None or several of the tracks do.
    """
    if not log.tracks:
        return log
    covering, faults = [], []
    for track in log.tracks:
        try:
            slow_times(track, center, center_seconds, aperture_time_s, name)
        except PathFileError as fault:
            faults.append(str(fault))
        else:
            covering.append(track)
    if len(covering) == 1:
        return covering[0]
    if covering:
        listed = "; ".join(track.words for track in covering[:_LISTED]) + "; …" * (len(covering) > _LISTED)
        raise PathFileError(
            f"{name}: has {len(covering)} tracks that cover the aperture: {listed}",
            "accepted: trajectory.track: the name or the number of one",
        )
    raise PathFileError(
        f"{name}: has {len(log.tracks)} tracks, and none covers the aperture; "
        + "; ".join(fault.removeprefix(f"{name}: ") for fault in faults[:_LISTED])
        + "; …" * (len(faults) > _LISTED)
    )


def hold_to_usable_records(log: Log, times: Floats, stretch_s: float) -> None:
    """Refuse a log of which a record that cannot be used lies within the stretch that is fitted.

    Parameters
    ----------
    log : Log
        Its records that are left out lie between usable ones of which one is in the stretch.
    times : (n,) ndarray
        Slow times of the log. [s]
    stretch_s : float
        Time around the middle of the aperture whose places are used. [s]

    Raises
    ------
    PathFileError
        Names the first such record.
    """
    if log.left_out is None:
        return
    half = stretch_s / 2 * (1 + 1e-9)
    edges = np.concatenate([[-np.inf], times, [np.inf]])
    earlier, later = edges[log.left_out.before], edges[log.left_out.before + 1]
    is_inside = (earlier <= half) & (later >= -half)
    if is_inside.any():
        raise PathFileError(
            f"{log.left_out.faults[int(is_inside.argmax())]}; the record lies within the {stretch_s:.4g} s around"
            " mid-aperture that are used"
        )


def widest_stretch(log: Log, times: Floats, aperture_time_s: float) -> float:
    """Longest time around the middle of an aperture within which a log has all its fixes. [s]

    It ends before a record that cannot be used, and before a gap of more than five usual intervals: neither refuses a
    log outside the stretch that it needs, and nothing is known of the path in them.

    Parameters
    ----------
    log : Log
        Its records that are left out lie between usable ones.
    times : (n,) ndarray
        Slow times of the log. [s]
    aperture_time_s : float
        Length of the aperture. [s]
    """
    steps = np.diff(times)
    is_gap = steps > _WIDEST_GAP * _ROUNDED * float(np.median(steps)) if steps.size else np.zeros(0, dtype=bool)
    earlier, later = times[:-1][is_gap], times[1:][is_gap]
    if log.left_out is not None:
        edges = np.concatenate([[-np.inf], times, [np.inf]])
        earlier = np.concatenate([earlier, edges[log.left_out.before]])
        later = np.concatenate([later, edges[log.left_out.before + 1]])
    # A fix at the edge of what is lost is left out too: rounding must not put it inside.
    reach = np.maximum(earlier, -later) / _ROUNDED
    return max(stretch_around(times, aperture_time_s), 2 * float(reach.min(initial=np.inf)))


def _independent(left: Floats) -> float:
    """How many independent samples residuals (n, 3) are worth: n over the sum of their correlation to its first zero.

    White noise is worth all its samples. Each axis counts alike.
    """
    count = len(left)
    spectrum = np.abs(np.fft.rfft(left, 2 * count, axis=0)) ** 2
    correlation = np.fft.irfft(spectrum, axis=0)[:count]
    correlation = (correlation / np.maximum(correlation[0], _UNSEEN_M**2)).mean(axis=1)
    ends = int(np.argmax(correlation <= 0)) or count
    return max(2.0, count / float(1 + 2 * correlation[1:ends].sum()))


# ---------------------------------------------------------------------- polynomials of slow time
def least_squares(at: Floats, places: Floats, order: int) -> tuple[Floats, Floats]:
    """Legendre series of an order through places, and what it leaves of them.

    Parameters
    ----------
    at : (n,) ndarray
        Where the places are, -1 … 1.
    places : (n, 3) ndarray
        [m]

    Returns
    -------
    (order + 1, 3) ndarray, (n, 3) ndarray
        Coefficients, and places less the series. [m]
    """
    basis = legendre.legvander(at, order)
    coefficients: Floats = np.asarray(np.linalg.lstsq(basis, places, rcond=None)[0], dtype=float)
    return coefficients, places - basis @ coefficients


def powers_of(coefficients: Floats, half_s: float, convert: Callable[..., Any] = legendre.leg2poly) -> Floats:
    """Coefficients (order + 1, 3) of τ⁰, τ¹, … of a series over -`half_s` … `half_s`. [m], [m/s], …

    `convert` turns coefficients of the series into those of powers; omitted: of a Legendre series.
    """
    powers = np.zeros_like(coefficients)
    for axis in range(3):
        found = convert(coefficients[:, axis])  # without the highest that are zero
        powers[: len(found), axis] = found
    return powers / half_s ** np.arange(len(powers))[:, None]


def _vector(values: Floats) -> Vector:
    x, y, z = values.tolist()
    return (x, y, z)


def path_of(powers: Iterable[Iterable[float]]) -> PlatformState:
    """A path from its coefficients of τ⁰, τ¹, …, at least two; the highest bends that are zero are left out."""
    vectors: list[Vector] = [(float(x), float(y), float(z)) for x, y, z in powers]
    position, velocity, (x, y, z), *bends = vectors if len(vectors) > 2 else [*vectors, STRAIGHT]
    while bends and bends[-1] == STRAIGHT:
        bends.pop()
    return PlatformState(position=position, velocity=velocity, acceleration=(2 * x, 2 * y, 2 * z), bends=tuple(bends))


# ---------------------------------------------------------------------- places between those of a table
class Sample(NamedTuple):
    """A time of days without leap seconds, and position and velocity. [m], [m/s]"""

    time: Instant
    place: Vector
    velocity: Vector


def interpolate(samples: Sequence[Sample], time: Instant, count: int, is_hermite: bool) -> Vector:
    """Place at a time, from the samples around it. [m]

    The samples are the same throughout an interval between two of them. Neighbouring intervals, where the count is
    even or not, share the sample between them: the path has no jumps.
    """
    after = bisect_right(samples, time, key=lambda one: one.time)
    first = min(max(after - (count + 1) // 2, 0), len(samples) - count)
    near = samples[first : first + count]
    return _through(near, [one.time.since(time) for one in near], is_hermite)


def _through(near: Sequence[Sample], times: Sequence[float], is_hermite: bool) -> Vector:
    """Value at time 0 of the polynomial of Lagrange through places, or that of Hermite through velocities too.

    Sources: Abramowitz & Stegun, equations 25.2.1 and 25.2.2; Burden & Faires, Numerical Analysis, theorem 3.9.
    """
    terms: list[list[float]] = [[], [], []]
    for j, sample in enumerate(near):
        others = [times[j] - one for n, one in enumerate(times) if n != j]
        basis = math.prod(-one / (times[j] - one) for n, one in enumerate(times) if n != j)
        if is_hermite:
            square = basis * basis
            slope = math.fsum(1 / one for one in others)
            of_place, of_velocity = (1 + 2 * times[j] * slope) * square, -times[j] * square
        else:
            of_place, of_velocity = basis, 0.0
        for axis in range(3):
            terms[axis].append(of_place * sample.place[axis])
            if of_velocity:
                terms[axis].append(of_velocity * sample.velocity[axis])
    try:
        x, y, z = (math.fsum(axis) for axis in terms)
    except (OverflowError, ValueError):  # samples that are much nearer to each other than others
        return (math.nan, math.nan, math.nan)
    return (x, y, z)
