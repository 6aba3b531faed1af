"""The path of a platform from a file, and its conversion to the function of slow time that a budget uses.

All commands take a path as one polynomial over the aperture, or as several polynomials, each over a piece of the
aperture. An orbit gives a position at any time, and its polynomial interpolates such positions. A log gives measured
fixes. A polynomial or a spline smooths the fixes by least squares; a spline has as many pieces as the log needs. For
every path, from an orbit or a log, the distance from the positions in the file is also returned.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import NDArray

from bisar_budget.geometry import STRAIGHT, PlatformState, Vector
from bisar_budget.paths.accuracy import Matrix, PathNoise, StatedAccuracy, as_matrix
from bisar_budget.paths.earth import Floats
from bisar_budget.paths.instant import DAY_S, Instant, gps_week
from bisar_budget.paths.splines import SPLINE_ORDER, SplineFit
from bisar_budget.paths.splines import basis as spline_basis

_CHEBYSHEV_NODES = 15  # through which the polynomial of an orbit goes
_MIN_WINDOW_S = 10.0  # in a shorter window, the rounding of positions, 1e-9 m, would become an acceleration
_MAX_INTERPOLATION_ERROR_M = (
    5e-3  # a larger distance from the polynomial means that the path is not smooth; files round positions to 1 mm
)
_ROUNDING_M = 1e-7  # a coefficient that moves the path by less counts as rounding
_INTERVAL_ROUNDING_FACTOR = 1 + 1e-6  # margin on intervals between rounded times
_MAX_FIX_GAP_RATIO = 5  # of a gap between fixes to the median interval
_LISTED_TRACK_COUNT = 3  # in an error


@dataclass(frozen=True)
class SmoothingSettings:
    """Parameters of the path that is fitted to the fixes of a log.

    A stretch is a time span around mid-aperture whose fixes are fitted.

    Attributes
    ----------
    min_fixes : int
        Smallest number of fixes to which a path can be fitted.
    noise_fixes : int
        Number of fixes that is sufficient to separate noise from motion. The shortest stretch contains the aperture
        and at least this number of fixes.
    max_order : int
        Largest order of the polynomial if the whole path is a single polynomial.
    max_pieces : int
        Largest number of pieces of a spline.
    tried_coefficients, tried_ratio : int
        Limits of the search for a better spline. Splines with more pieces are tried, even if they do not improve the
        path, up to a number of coefficients: `tried_coefficients`, which is sufficient for 40 full circles, or
        `tried_ratio` times the number of coefficients of the best path so far, whichever is larger.
    clean_rms_m : float
        A path gets no further pieces if the root mean square of its residuals is below this value. [m]
    white_sigmas : float
        The residuals count as white noise if the mean product of neighbouring residuals is at most this number of
        standard deviations of this mean.
    min_samples : int
        Smallest number of times over the aperture at which the error of a path is sampled.
    samples_per_piece : int
        Smallest number of times in each piece at which the error of a path is sampled.
    mode_fraction : float
        Modes of a `PathNoise` that are smaller than this fraction of the largest mode are discarded as rounding
        errors.
    stretch_ratio, widest_ratio : float
        Stretches of increasing duration are fitted. `stretch_ratio` is the ratio of the durations of successive
        stretches, and `widest_ratio` is the ratio of the longest to the shortest duration.
    max_fitted_fixes : int
        Largest number of fixes in a stretch.
    negligible_noise_m : float
        If the error of the path due to noise is below this value [m], longer stretches are not tried. Such an error
        is negligible at any carrier frequency.
    chance_factor : float
        The squared difference between two fits is attributed to noise up to this factor times the value that noise
        alone would cause on average.
    hopeless_ratio : float
        Longer stretches are not tried if the squared predicted error is more than this ratio times its smallest value
        so far.
    residual_ratio : float
        The fit of a longer stretch is rejected if the residual in the aperture grows by more than this ratio, because
        the fit then does not follow the path.
    stray_ratio, min_stray_m : float
        A warning names a fix whose residual is larger than the sum of two terms: `stray_ratio` times the median
        residual, and `min_stray_m` [m]. Among thousands of fixes, noise alone causes ratios of up to 4.
    """

    min_fixes: int = 5
    noise_fixes: int = 9
    max_order: int = 8
    max_pieces: int = 256
    tried_coefficients: int = 128
    tried_ratio: int = 4
    clean_rms_m: float = 1e-5
    white_sigmas: float = 2.0
    min_samples: int = 65
    samples_per_piece: int = 4
    mode_fraction: float = 1e-9
    stretch_ratio: float = 1.5
    widest_ratio: float = 64.0
    max_fitted_fixes: int = 20_000
    negligible_noise_m: float = 1e-6
    chance_factor: float = 2.0
    hopeless_ratio: float = 9.0
    residual_ratio: float = 1.1
    stray_ratio: float = 8.0
    min_stray_m: float = 1e-3


_SMOOTHING = SmoothingSettings()


NO_MATRIX: Matrix = ((0.0,) * 3,) * 3


class PathFileError(Exception):
    """No path can be read from a file.

    The message names the file, and its line, byte or record.

    `accepted` describes an accepted file, and `hint` a remedy. `key` is the key of the mission file that contradicts
    the file; it is empty if the file itself is wrong. If the file does not cover the requested time, `spans` are the
    times that it covers.
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


def hold_to_bytes(data: bytes, max_bytes: int, name: str) -> None:
    """Raise `PathFileError` if a log has more than `max_bytes` bytes."""
    if len(data) > max_bytes:
        raise PathFileError(f"{name}: has {len(data) / 1e6:.0f} MB, at most {max_bytes / 1e6:.0f} MB are read")


class PathDoubt(NamedTuple):
    """Uncertainty of a path at an instant: its `size` [m], and its cause in `words`.

    The size is the largest distance between the path and the true path.
    """

    size: float
    words: str


NO_DOUBT = PathDoubt(0.0, "")


@dataclass(frozen=True)
class Orbit:
    """Path of a satellite, which is known at every instant of a span.

    Attributes
    ----------
    place : callable
        Function that returns the Earth-fixed coordinates at an instant. [m]
    words : str
        Description of the orbit for reports.
    span : tuple of Instant, optional
        First and last instant of the ephemeris; None for mean elements.
    epoch : Instant, optional
        Epoch of the mean elements; None for an ephemeris.
    doubts : callable
        Function that returns warnings about an unusually large uncertainty at an instant.
    doubt : callable
        Function that returns the uncertainty of the orbit at an instant as a `PathDoubt`, whose size is in m.
    remedy : str
        Advice on how to reduce the uncertainty.
    is_turned : bool
        Whether the file states the orbit in axes that are not fixed to the Earth.
    turning_doubt, turning_doubts : callable
        The parts of `doubt` and `doubts` that are due to the uncertain orientation of the Earth.
    stated : callable
        Function that returns the accuracy that the file states for an instant, along Earth-fixed axes; None if it
        states no accuracy.
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
        """Return the orbit as a plan that the satellite follows exactly.

        The only uncertainty that remains is due to the orientation of the Earth. The age of the elements and the
        error of the interpolation are disregarded.
        """
        words = f"{self.words}, flown as planned: its age and its interpolation do not count"
        return replace(self, words=words, doubt=self.turning_doubt, doubts=self.turning_doubts)

    def largest_doubt_m(self, instant: Instant) -> float:
        """Largest distance of the true path from the orbit at an instant. [m]

        It is the uncertainty `doubt`, or the stated accuracy if it is larger.
        """
        stated = self.stated(instant)
        return max(self.doubt(instant).size, 0.0 if stated is None else stated.position_m)


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Unusable records of a log.

    `before` (m,) is the number of usable records that precede each of the m unusable records. `faults` are messages
    about the unusable records.
    """

    before: NDArray[np.int64]
    faults: Sequence[str]


@dataclass(frozen=True, eq=False)
class Log:
    """Fixes of a flight: times and positions from a log, and the accuracy that the log states.

    Attributes
    ----------
    times : (n,)
        Times of the fixes since `start`, in ascending order. Without `start`, times are on the clock of the log. [s]
    places : (n, 3)
        Positions of the fixes, Earth-fixed or in the scene's axes. [m]
    is_earth_fixed : bool
        Whether the positions are Earth-fixed.
    words : str
        Description of the log for reports.
    start : Instant, optional
        Origin of `times`, in UTC.
    sigmas : (n, 3), optional
        1-sigma errors east, north, up that the log states; NaN for a fix without stated errors. [m]
    typical_sigmas : (n,), optional
        1-sigma error along each axis that is typical of a fix with the stated quality [m]; NaN for a fix without a
        stated quality.
    quality_words : callable
        Function that takes the index of a fix, and returns a description of its quality, such as "GGA quality 1,
        autonomous".
    clock : str
        "day" if times are counted from midnight UTC, "week" if they are counted from the start of a GPS week.
    left_out : LeftOut, optional
        Records that cannot be used and are not among the fixes.
    tracks : tuple of Log
        Logs of all tracks, if the file has several tracks and the mission file does not choose one. The fixes then
        belong to the first track.
    grid : (3, 3)
        Displacement vectors due to one rounding step of each coordinate in the log, in the axes of the positions [m].
        A zero vector means that no rounding was found.
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
    """A path that consists of polynomials, and its distance from the positions in its file.

    Attributes
    ----------
    state : PlatformState
        The path.
    order : int
        Order of the polynomials.
    farthest, rms : float
        Largest and root-mean-square distance of the path from the positions in the file. [m]
    samples : int
        Number of fixes of a log to which the path is fitted; 0 for an orbit, which is interpolated.
    doubts : tuple of str
        Warnings about the path.
    stretch : float
        Length of the time span around mid-aperture whose fixes are fitted. [s]
    missed : float
        Root-mean-square distance of a fix of the log from a path that is fitted without this fix. [m]
    residual : (3, 3)
        Covariance of the residuals of the fixes in the aperture. [m²]
    correlation_time : float
        Correlation time of the Gauss-Markov process that has the same correlation as the residuals. [s]
    acceleration_noise : (3, 3)
        Covariance of the error of the acceleration [m²/s⁴]. The error is caused by noise of the fixes, and by motion
        that is smeared if fixes beyond the shortest time span are fitted. For a single polynomial, it is the error at
        mid-aperture. For several pieces, it is the acceleration of the parabola that is fitted to the position error
        over the aperture.
    path_noise : PathNoise, optional
        Error of the path over the aperture due to the causes described under `acceleration_noise`.
    pieces : int
        Number of polynomials. Neighbouring polynomials meet with equal position and velocity.
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


def interpolated(
    positions_at: Callable[[Floats], Floats], aperture_time_s: float, widest_s: float = math.inf
) -> Fitted:
    """Polynomial path that interpolates an orbit: it goes through positions at Chebyshev points around the aperture.

    Parameters
    ----------
    positions_at : callable
        Function that takes slow times (n,) [s], and returns positions (n, 3) in the axes of the scene [m].
    aperture_time_s : float
        Length of the aperture. [s]
    widest_s : float
        Length of the time span around mid-aperture in which positions are known. [s]
    """
    half = min(max(aperture_time_s, _MIN_WINDOW_S), widest_s) / 2
    nodes = chebyshev.chebpts1(_CHEBYSHEV_NODES)
    basis = chebyshev.chebvander(nodes, _CHEBYSHEV_NODES - 1)
    series: Floats = np.asarray(np.linalg.solve(basis, positions_at(half * nodes)), dtype=float)
    series[np.abs(series) <= _ROUNDING_M] = 0.0  # in high powers of time, the rounding would be magnified
    state = path_of(powers_of(series, half, chebyshev.cheb2poly))
    times = aperture_time_s / 2 * np.cos(math.pi * np.arange(_CHEBYSHEV_NODES + 1) / _CHEBYSHEV_NODES)
    distances = np.linalg.norm(np.stack(state.place(times), axis=1) - positions_at(times), axis=1)
    farthest, rms = float(distances.max()), math.sqrt(float(np.mean(distances**2)))
    doubts: tuple[str, ...] = ()
    if farthest > _MAX_INTERPOLATION_ERROR_M:
        doubts = (f"the polynomial that is flown is up to {farthest:.3g} m from the path",)
    return Fitted(state, len(state.bends) + 2, farthest, rms, doubts=doubts)


def stretch_around(times: Floats, aperture_time_s: float) -> float:
    """Length of the shortest time span around mid-aperture whose fixes can be smoothed. [s]

    This is the length of the aperture. If the aperture has fewer than nine fixes, the time span is extended until it
    contains nine, because a log at 1 Hz, for example, has only three fixes in 3 s.
    """
    distances = np.sort(np.abs(times))[: _SMOOTHING.noise_fixes]
    return max(aperture_time_s, 2 * float(distances.max(initial=0.0)))


@dataclass(frozen=True, eq=False)
class _SmoothFit:
    """Least-squares path through the fixes of a stretch: a Legendre series or a spline.

    A stretch is a time span around mid-aperture.

    Attributes
    ----------
    half_s : float
        Half the length of the stretch. [s]
    times : (n,)
        Slow times of the fixes. [s]
    series : (coefficients, 3)
        Coefficients of the path. [m]
    residuals : (n, 3)
        Positions of the fixes minus the path. [m]
    independent : float
        Effective number of fixes: the number of independent fixes that would carry as much information as the actual
        fixes, whose errors are correlated.
    root : (coefficients, coefficients)
        Matrix whose product with its transpose is the covariance of the coefficients for white noise of variance 1.
    spline : SplineFit, optional
        The spline; None for a Legendre series.
    """

    half_s: float
    times: Floats
    series: Floats
    residuals: Floats
    independent: float
    root: Floats
    spline: SplineFit | None = None

    @classmethod
    def of_spline(cls, half_s: float, times: Floats, spline: SplineFit, independent: float) -> "_SmoothFit":
        return cls(half_s, times, spline.series, spline.residuals, independent, spline.root, spline)

    @property
    def order(self) -> int:
        return len(self.series) - 1 if self.spline is None else SPLINE_ORDER

    @property
    def pieces(self) -> int:
        return 1 if self.spline is None else len(self.spline.edges) - 1

    @property
    def covariance(self) -> Floats:
        """Covariance of the coefficients if the noise of the fixes has the variance 1.

        Correlated fixes count as fewer fixes, which enlarges the covariance.
        """
        return np.asarray(self.root @ self.root.T * (len(self.residuals) / self.independent))

    @property
    def variances(self) -> Floats:
        """Noise variance of a fix along each axis (3,), estimated from the residuals. [m²]"""
        variances: Floats = (self.residuals**2).sum(axis=0) / max(len(self.residuals) - len(self.series), 1)
        return variances

    @property
    def common_motion(self) -> tuple[float, float]:
        """Mean scalar product of successive residuals, and the standard deviation of this mean. [m²]

        The mean shows whether the residuals still contain motion: its expectation is zero if the noise of the fixes
        is white. The fit itself biases the mean towards negative values; the result is corrected for this bias.
        """
        products = (self.residuals[1:] * self.residuals[:-1]).sum(axis=1)
        mean, square = float(products.mean()), float(np.mean(np.sum(self.residuals**2, axis=1)))
        taken = len(self.series) / len(self.residuals) * (square - mean)
        return mean + taken, math.sqrt(float(np.mean(products**2)) / len(products))

    @property
    def rms(self) -> float:
        """Root mean square of the residuals. [m]"""
        return math.sqrt(float(np.mean(np.sum(self.residuals**2, axis=1))))

    def basis(self, times: Floats) -> Floats:
        """Matrix (m, coefficients) that converts the coefficients of the path to positions at slow times (m,) [s]."""
        if self.spline is not None:
            return spline_basis(times, self.spline.edges)
        return np.asarray(legendre.legvander(times / self.half_s, self.order))

    def places(self, times: Floats) -> Floats:
        """Positions (m, 3) on the path [m] at slow times (m,) [s]."""
        positions: Floats = self.basis(times) @ self.series
        return positions if self.spline is None else positions + self.spline.center

    def leverage(self, times: Floats) -> Floats:
        """Ratio of the variance of the path, at slow times (m,) [s], to the variance of a fix."""
        return np.asarray(np.sum((self.basis(times) @ self.root) ** 2, axis=1))

    def state(self) -> PlatformState:
        """The path as a `PlatformState`, a function of slow time."""
        return path_of(powers_of(self.series, self.half_s)) if self.spline is None else self.spline.state()

    def sample_times(self, aperture_time_s: float) -> Floats:
        """Slow times over an aperture at which the error of the path is sampled. [s]"""
        count = max(_SMOOTHING.min_samples, _SMOOTHING.samples_per_piece * self.pieces + 1)
        return np.asarray(aperture_time_s / 2 * np.linspace(-1, 1, count))

    def noise(self, times: Floats, left_out: Floats) -> float:
        """Mean square of the path error due to noise of the fixes, over slow times (m,). [m²]

        `left_out` (m, m) is a projection matrix. It selects the part of the error that is excluded, for example the
        straight line that fits the error best.
        """
        basis = self.basis(times)
        basis = basis - left_out @ basis
        return float(np.einsum("mi,ij,mj->", basis, self.covariance, basis) / times.size * self.variances.sum())

    def acceleration_noise(self, aperture_time_s: float) -> Floats:
        """Covariance (3, 3) of the error of the acceleration due to noise of the fixes. [m²/s⁴]

        For a polynomial, this is the error at mid-aperture. For a spline, whose pieces have different errors, it is
        the acceleration of the parabola that is fitted to the position error over the aperture.
        """
        if self.spline is None:
            bends = np.array([legendre.legval(0.0, legendre.legder(series, 2)) for series in np.eye(self.order + 1)])
            scale_s = self.half_s
        else:
            sample_times, scale_s = self.sample_times(aperture_time_s), aperture_time_s / 2
            parabola = np.linalg.pinv(legendre.legvander(sample_times / scale_s, 2))[2]
            bends = 3 * parabola @ self.basis(sample_times)  # P₂ has the second derivative 3
        variance = float(bends @ self.covariance @ bends) / scale_s**4
        return np.diag(variance * self.variances)

    def path_noise(self, aperture_time_s: float, excess: float) -> PathNoise:
        """Error of the path over the aperture due to noise of the fixes.

        `excess` is a factor on the variance of this error; it is the error ratio that `_widened` returns.
        """
        sample_times, half_s = self.sample_times(aperture_time_s), aperture_time_s / 2
        through = np.linalg.pinv(legendre.legvander(sample_times / half_s, _SMOOTHING.max_order)) @ self.basis(
            sample_times
        )
        shapes, sizes, _ = np.linalg.svd(through @ self.root, full_matrices=False)
        shapes = (
            shapes[:, sizes > _SMOOTHING.mode_fraction * sizes[0]]
            * sizes[sizes > _SMOOTHING.mode_fraction * sizes[0]]
        )
        sigmas = np.sqrt(excess * len(self.residuals) / self.independent * self.variances)
        modes = []
        for shape in shapes.T:
            powers = np.array(legendre.leg2poly(shape)) / half_s ** np.arange(len(shape))
            modes += [
                tuple(_vector(sigma * power * axis) for power in powers)
                for sigma, axis in zip(sigmas, np.eye(3), strict=True)
            ]
        return PathNoise(tuple(modes))


def _information(residuals: Floats, coefficients: int, independent: float) -> float:
    """Information criterion of a fit with residuals (n, 3) [m]. A smaller value is better.

    Each axis has its own noise variance, and the same number of coefficients. The criterion is corrected for
    overfitting as in AICc (Hurvich & Tsai 1989), because a path with many coefficients fits a small number of fixes
    too well by chance. `independent` is the effective number of fixes: the number of independent fixes that would
    carry as much information as the actual, correlated fixes.
    """
    count, squares = len(residuals), (residuals**2).mean(axis=0) + _ROUNDING_M**2
    cost = 3 * coefficients * math.log(independent) * count / (count - coefficients - 1)
    return float(independent * np.log(squares).sum()) + cost


def _fit(times: Floats, log_positions: Floats, half_s: float, *, may_have_pieces: bool) -> _SmoothFit:
    """Fit the path with the smallest Bayesian information criterion (Schwarz 1978) to the fixes of a stretch.

    The path is a polynomial. If `may_have_pieces` is set, a spline is also tried, and is used if its criterion is
    smaller. `half_s` [s] is half the length of the stretch.
    """
    inside = np.abs(times) <= half_s * (1 + 1e-9)
    times_inside, positions, count = times[inside], log_positions[inside], int(inside.sum())
    normalised_times = times_inside / half_s
    max_order = min(_SMOOTHING.max_order, (count - 1) // 2)
    fits = [least_squares(normalised_times, positions, order) for order in range(2, max_order + 1)]
    independent = _independent(fits[-1][1])
    series, residuals = min(fits, key=lambda fit: _information(fit[1], len(fit[0]), independent))
    triangle = np.linalg.qr(legendre.legvander(normalised_times, len(series) - 1))[1]
    fit = _SmoothFit(half_s, times_inside, series, residuals, independent, np.linalg.inv(triangle))
    return _in_pieces(fit, positions) if may_have_pieces else fit


def _in_pieces(fit: _SmoothFit, positions: Floats) -> _SmoothFit:
    """Replace a polynomial by a spline if this improves the information criterion.

    The spline is fitted to the same fixes, which have the positions `positions` (n, 3) [m]. The criterion is computed
    by `_information`. As long as neighbouring residuals are correlated, pieces of the spline are halved (see
    `splines`).
    """
    best = newest = fit
    edges: Floats | None = np.array([-fit.half_s, fit.half_s])
    while edges is not None and best.rms > _SMOOTHING.clean_rms_m:
        motion, motion_sigma = newest.common_motion
        if motion <= _SMOOTHING.white_sigmas * motion_sigma:
            break
        coefficients = len(edges) - 1 + SPLINE_ORDER
        tried_coefficients = max(_SMOOTHING.tried_coefficients, _SMOOTHING.tried_ratio * len(best.series))
        max_coefficients = min(tried_coefficients, _SMOOTHING.max_pieces + SPLINE_ORDER, len(positions) // 2)
        if coefficients > max_coefficients:
            break
        spline = SplineFit.of(fit.times, positions, edges)
        independent = _independent(spline.residuals)
        newest = _SmoothFit.of_spline(fit.half_s, fit.times, spline, independent)
        gain = _information(best.residuals, len(best.series), independent) - _information(
            newest.residuals, coefficients, independent
        )
        falls = newest.common_motion[0] * coefficients**2 <= best.common_motion[0] * len(best.series) ** 2
        if gain > 0 and falls:
            best = newest
        edges = spline.halved(fit.times)
    return best


def _widened(
    narrowest: _SmoothFit, times: Floats, positions: Floats, aperture_time_s: float, widest_s: float
) -> tuple[_SmoothFit, float]:
    """Find the stretch whose fit has the smallest predicted error over the aperture.

    A stretch is a time span around mid-aperture. Returns its fit, and the error ratio: the squared predicted error
    divided by the squared error due to noise.

    A longer stretch averages the noise over more fixes: the acceleration of a parabola through n fixes of noise σ
    over the time T has an error of σ√(720/(n·T⁴)). But a longer stretch may smear the motion of the platform. The
    smear is unknown, and is estimated from the distance between the path and the paths of shorter stretches. The
    expected square of this distance is the square of the smear plus the squared noise that the longer stretch avoids.
    The excess over that noise counts as smear (rule of Goldenshluger & Lepski 2011; Lepski 1991).

    Only the part of the error that is not linear in slow time is minimised, because only this part defocuses the
    image. In addition, the error of the whole path and the residual in the aperture must not grow.
    """
    sample_times, has_pieces = narrowest.sample_times(aperture_time_s), narrowest.spline is not None
    straight = np.linalg.qr(np.vander(sample_times, 2))[0]
    line_projection, no_projection = straight @ straight.T, np.zeros((sample_times.size, sample_times.size))
    projections = (line_projection, no_projection)  # that leave the error beyond a straight line, and the whole error
    max_half_s = min(
        widest_s / 2, max(abs(float(times[0])), abs(float(times[-1]))), _SMOOTHING.widest_ratio * narrowest.half_s
    )
    if has_pieces:  # a wider stretch reduces the noise only at the ends of the aperture
        max_half_s = min(max_half_s, _SMOOTHING.stretch_ratio * narrowest.half_s)
    half_s = narrowest.half_s
    candidates = [(narrowest, [narrowest.noise(sample_times, projection) for projection in projections])]
    best, least_error = narrowest, candidates[0][1][0]
    residual = _residual_within(narrowest, aperture_time_s)
    while least_error > _SMOOTHING.negligible_noise_m**2 and half_s < max_half_s * (1 - 1e-9):
        half_s = min(half_s * _SMOOTHING.stretch_ratio, max_half_s)
        if np.searchsorted(times, half_s, "right") - np.searchsorted(times, -half_s) > _SMOOTHING.max_fitted_fixes:
            break
        fit = _fit(times, positions, half_s, may_have_pieces=has_pieces)
        noises = [fit.noise(sample_times, projection) for projection in projections]
        smears = [0.0, 0.0]
        for candidate, candidate_noises in candidates:
            differences = fit.places(sample_times) - candidate.places(sample_times)
            for index, projection in enumerate(projections):
                square = float(np.mean(np.sum((differences - projection @ differences) ** 2, axis=1)))
                chance = _SMOOTHING.chance_factor * max(candidate_noises[index] - noises[index], 0.0)
                smears[index] = max(smears[index], square - chance)
        candidates.append((fit, noises))
        errors = [noise + smear for noise, smear in zip(noises, smears, strict=True)]
        grows = _residual_within(fit, aperture_time_s) > _SMOOTHING.residual_ratio**2 * residual
        if grows or errors[0] > _SMOOTHING.hopeless_ratio * least_error:
            break
        if errors[0] < least_error and errors[1] <= candidates[0][1][1]:
            best, least_error = fit, errors[0]
    noise = best.noise(sample_times, line_projection)
    return best, least_error / noise if noise > 0 else 1.0


def _residual_within(fit: _SmoothFit, aperture_time_s: float) -> float:
    """Mean square of the residuals of the fixes in the aperture. [m²]

    If the aperture has too few fixes, the residuals of all fixes of the stretch are used.
    """
    inside = np.abs(fit.times) <= aperture_time_s / 2 * (1 + 1e-9)
    residuals = fit.residuals[inside] if inside.sum() >= _SMOOTHING.noise_fixes else fit.residuals
    count, coefficients = len(fit.residuals), len(fit.series)
    return float(np.mean(np.sum(residuals**2, axis=1))) * count / max(count - coefficients, 1)


def smoothed(times: Floats, positions: Floats, aperture_time_s: float, widest_s: float = 0.0) -> Fitted:
    """Fit a path to the fixes of a log around the aperture by least squares.

    The path is a polynomial of the order with the smallest Bayesian information criterion (Schwarz 1978). The order
    is at most 8, and at most half the number of fixes. If the residuals of a single polynomial still contain motion,
    the path is a spline, whose number of pieces is chosen by the same criterion (see `splines`). Motion that is too
    fast for the path counts as noise of the log, or as vibration. Fixes with correlated residuals count as fewer
    fixes, so that a slow error of the log, which looks like motion, is not fitted.

    The stretch is the time span whose fixes are used. It is the shortest possible span around the aperture, or a
    longer span if the predicted error of the path is then smaller (see `_widened`). This matters because noise of the
    log causes an apparent acceleration of the path, which makes allowables wrong.

    `Fitted.missed` is computed by leaving out, one at a time, the fixes in the aperture and the fixes directly before
    and after it (Allen 1974). `missed` contains the noise, the motion that the polynomial does not follow, and the
    motion between two fixes, which a log with a low rate does not show. If the path has more noise than a fix, for
    example in a gap of the log, `missed` is multiplied by the ratio of the two.

    Parameters
    ----------
    times : (n,) ndarray
        Slow times, in ascending order; fixes outside the stretch are not used. [s]
    positions : (n, 3) ndarray
        Positions of the fixes in the axes of the scene. [m]
    aperture_time_s : float
        Length of the aperture. [s]
    widest_s : float
        Length of the longest time span around mid-aperture whose fixes may be used. If omitted, the shortest
        stretch is used. [s]

    Raises
    ------
    PathFileError
        There are fewer than five fixes around the aperture.

    Notes
    -----
    The distance of a fix from a path fitted without this fix is r/(1 - h), where r is the residual and h the leverage
    of the fix (Belsley, Kuh & Welsch 1980, 2.1).
    """
    half = stretch_around(times, aperture_time_s) / 2
    count = int((np.abs(times) <= half * (1 + 1e-9)).sum())
    if count < _SMOOTHING.min_fixes:
        raise PathFileError(
            f"has {count} fixes around the aperture of {aperture_time_s:g} s, at least {_SMOOTHING.min_fixes} are "
            "needed; keep more of the log"
        )
    fit, excess = _widened(
        _fit(times, positions, half, may_have_pieces=True), times, positions, aperture_time_s, widest_s
    )
    times_used, residuals, count = fit.times, fit.residuals, len(fit.times)
    rms = math.sqrt(float((residuals**2).sum()) / max(count - len(fit.series), 1))
    distances = np.linalg.norm(residuals, axis=1)
    farthest, median_distance = float(distances.max()), float(np.median(distances))
    doubts: tuple[str, ...] = ()
    if farthest > _SMOOTHING.stray_ratio * median_distance + _SMOOTHING.min_stray_m:
        stray_time = float(times_used[distances.argmax()])
        doubts = (
            f"a fix of the log, {stray_time:+.4g} s from mid-aperture, is {farthest:.3g} m from the smooth path; "
            f"half of the fixes are within {median_distance:.2g} m",
        )
    first = max(int(np.searchsorted(times_used, -aperture_time_s / 2)) - 1, 0)
    near_aperture = slice(first, int(np.searchsorted(times_used, aperture_time_s / 2, "right")) + 1)
    leverage = np.minimum(fit.leverage(times_used), 1 - 1e-9)  # influence of a fix on the path there
    missed = float(np.sqrt(np.mean((distances / (1 - leverage))[near_aperture] ** 2)))
    # In a gap the path may have more noise than at the fixes around the gap.
    leverage_between = fit.leverage(fit.sample_times(aperture_time_s))
    missed *= max(1.0, math.sqrt(float(leverage_between.max())))
    near_residuals = residuals[near_aperture]
    residual = near_residuals.T @ near_residuals / len(near_residuals) * (count / max(count - len(fit.series), 1))
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
        float(times_used[-1] - times_used[0]) / max(count - 1, 1) * count / fit.independent / 2,
        as_matrix(excess * fit.acceleration_noise(aperture_time_s)),
        fit.path_noise(aperture_time_s, excess),
        fit.pieces,
    )


def around_aperture(times: Floats, aperture_time_s: float) -> slice:
    """Slice that selects the fixes in the aperture, the last fix before it, and the first fix after it.

    `times` are the slow times of the fixes (n,) [s]. The accuracy of a log is the largest sigma of the selected
    fixes, because the mean sigma would be smaller than the error of the log at some times in the aperture.
    """
    half = aperture_time_s / 2
    first = max(int(np.searchsorted(times, -half, "right")) - 1, 0)
    return slice(first, int(np.searchsorted(times, half, "left")) + 1)


def slow_times(
    log: Log, center: Instant | None, center_seconds: float | None, aperture_time_s: float, name: str
) -> Floats:
    """Slow times of the fixes of a log, which has to cover the aperture.

    Parameters
    ----------
    log : Log
        The log. Fixes before and after the aperture are kept.
    center : Instant or None
        Middle of the aperture, for a log in UTC; ignored for any other log.
    center_seconds : float or None
        Middle of the aperture on the clock of a log that is not in UTC; None means 0 s. [s]
    aperture_time_s : float
        Length of the aperture. [s]
    name : str
        Name of the file in messages.

    Returns
    -------
    (n,) ndarray
        Slow times, relative to the middle of the aperture. [s]

    Raises
    ------
    PathFileError
        The log begins or ends more than one median interval inside the aperture, has a gap in the aperture, or does
        not use the clock in which the middle is given. A gap is longer than five median intervals. The median
        interval is computed for the fixes in the aperture and for the whole log, and the smaller value is used.
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

    def time_text(slow: float) -> str:
        return start.after(slow + middle).as_text() if start is not None else f"{slow + middle:.12g} s"

    slow, half = times - middle, aperture_time_s / 2

    def cause(index: int) -> str:
        """Message about an unusable record directly before the fix with the index `index`, or an empty string."""
        if log.left_out is None or index not in log.left_out.before:
            return ""
        return f"; {log.left_out.faults[int((log.left_out.before == index).argmax())]}"

    # The intervals across both ends of the aperture are checked too.
    near_times = slow[around_aperture(slow, aperture_time_s)]
    steps = np.diff(near_times)
    # If a gap spans the whole aperture, it is the only interval there, so the median of the whole log is needed too.
    usual_step = min(float(np.median(steps)), float(np.median(np.diff(slow)))) if steps.size else 0.0
    longest_step = usual_step * _INTERVAL_ROUNDING_FACTOR
    if slow[0] > -half + longest_step or slow[-1] < half - longest_step:
        is_own_clock = start is None and center_seconds is None
        raise PathFileError(
            f"{name}: covers {time_text(float(slow[0]))} to {time_text(float(slow[-1]))}, "
            f"the aperture needs {time_text(-half)} to {time_text(half)}"
            + cause(0 if slow[0] > -half + longest_step else len(slow)),
            hint="trajectory.center says which time of the log is the middle of the aperture" if is_own_clock else "",
        )
    if steps.size and steps.max() > _MAX_FIX_GAP_RATIO * longest_step:
        gap = int(steps.argmax())
        raise PathFileError(
            f"{name}: has a gap of {steps[gap]:.4g} s after {time_text(float(near_times[gap]))}, in the aperture; "
            f"{usual_step:.4g} s is usual, at most {_MAX_FIX_GAP_RATIO * usual_step:.4g} s are bridged"
            + cause(int(np.searchsorted(slow, near_times[gap], "right")))
        )
    return slow


def _hold_to_clock(log: Log, center: Instant | None, center_seconds: float | None, name: str) -> None:
    """Refuse a log whose times are times of day without a date, or seconds of an unknown GPS week.

    Such a log is accepted if `center_seconds` gives the middle of the aperture on the clock of the log.
    """
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
    """Add a date to a log that has only times of day.

    The date is chosen so that the log is as close as possible to `center`, the middle of the aperture. The log
    is returned unchanged if `center` is None, if the log has dates, or if its times are not times of day.
    """
    if log.clock != "day" or log.start is not None or center is None:
        return log
    middle_time = float(log.times[len(log.times) // 2])
    midnight = Instant(center.day + round((center.seconds - middle_time) / DAY_S), 0.0)
    words = f"{log.words}, date by collection.center_time: {midnight.as_text()[:10]}"
    return replace(log, start=midnight, words=words)


def track_around(
    log: Log, center: Instant | None, center_seconds: float | None, aperture_time_s: float, name: str
) -> Log:
    """Track that covers the aperture, from a log of several tracks; any other log is returned unchanged.

    The parameters are the same as in `slow_times`.

    Raises
    ------
    PathFileError
        No track covers the aperture, or several tracks cover it.
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
        ellipsis = "; …" * (len(covering) > _LISTED_TRACK_COUNT)
        listed = "; ".join(track.words for track in covering[:_LISTED_TRACK_COUNT]) + ellipsis
        raise PathFileError(
            f"{name}: has {len(covering)} tracks that cover the aperture: {listed}",
            "accepted: trajectory.track: the name or the number of one",
        )
    raise PathFileError(
        f"{name}: has {len(log.tracks)} tracks, and none covers the aperture; "
        + "; ".join(fault.removeprefix(f"{name}: ") for fault in faults[:_LISTED_TRACK_COUNT])
        + "; …" * (len(faults) > _LISTED_TRACK_COUNT)
    )


def hold_to_usable_records(log: Log, times: Floats, stretch_s: float) -> None:
    """Refuse a log with an unusable record in the time span whose fixes are used.

    Parameters
    ----------
    log : Log
        The log. An unusable record has no time. It counts as inside the time span if the interval between the usable
        fixes before and after it overlaps the time span.
    times : (n,) ndarray
        Slow times of the log. [s]
    stretch_s : float
        Length of the time span around the middle of the aperture. [s]

    Raises
    ------
    PathFileError
        There is an unusable record in the time span. The message names the first one.
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
    """Length of the longest time span around the middle of the aperture in which a log is complete. [s]

    The span ends before the nearest unusable record or gap. A gap is longer than five times the median interval
    between fixes. If the nearest record or gap is outside the shortest time span that can be smoothed, the log is
    usable, except for the fixes beyond the record or gap.

    Parameters
    ----------
    log : Log
        The log. An unusable record has no time, and may lie anywhere between the usable fixes around it.
    times : (n,) ndarray
        Slow times of the log. [s]
    aperture_time_s : float
        Length of the aperture. [s]
    """
    steps = np.diff(times)
    is_gap = (
        steps > _MAX_FIX_GAP_RATIO * _INTERVAL_ROUNDING_FACTOR * float(np.median(steps))
        if steps.size
        else np.zeros(0, dtype=bool)
    )
    earlier, later = times[:-1][is_gap], times[1:][is_gap]
    if log.left_out is not None:
        edges = np.concatenate([[-np.inf], times, [np.inf]])
        earlier = np.concatenate([earlier, edges[log.left_out.before]])
        later = np.concatenate([later, edges[log.left_out.before + 1]])
    # A fix at the edge of a gap is left out too, so that rounding cannot put it inside.
    reach = np.maximum(earlier, -later) / _INTERVAL_ROUNDING_FACTOR
    return max(stretch_around(times, aperture_time_s), 2 * float(reach.min(initial=np.inf)))


def _independent(residuals: Floats) -> float:
    """Number of independent samples that contain as much information as n correlated residuals (n, 3).

    The number is n for white noise. Otherwise, n is divided by the sum of the autocorrelation up to its first zero.
    The autocorrelation is averaged over the three axes.
    """
    count = len(residuals)
    spectrum = np.abs(np.fft.rfft(residuals, 2 * count, axis=0)) ** 2
    correlation = np.fft.irfft(spectrum, axis=0)[:count]
    correlation = (correlation / np.maximum(correlation[0], _ROUNDING_M**2)).mean(axis=1)
    ends = int(np.argmax(correlation <= 0)) or count
    return max(2.0, count / float(1 + 2 * correlation[1:ends].sum()))


# ---------------------------------------------------------------------- polynomials of slow time
def least_squares(normalised_times: Floats, positions: Floats, order: int) -> tuple[Floats, Floats]:
    """Fit a Legendre series of the given order to positions by least squares.

    Parameters
    ----------
    normalised_times : (n,) ndarray
        Times of the positions, scaled to -1 … 1.
    positions : (n, 3) ndarray
        Positions to fit. [m]
    order : int
        Order of the series.

    Returns
    -------
    (order + 1, 3) ndarray, (n, 3) ndarray
        Coefficients, and residuals, which are the positions minus the series. [m]
    """
    basis = legendre.legvander(normalised_times, order)
    coefficients: Floats = np.asarray(np.linalg.lstsq(basis, positions, rcond=None)[0], dtype=float)
    return coefficients, positions - basis @ coefficients


def powers_of(
    coefficients: Floats, half_s: float, convert: Callable[[Floats], NDArray[np.floating]] = legendre.leg2poly
) -> Floats:
    """Convert the coefficients of a series over -`half_s` … `half_s` to coefficients of τ⁰, τ¹, … [m, m/s, …]

    Both the argument and the result have the shape (order + 1, 3). `convert` converts the coefficients of a series
    over -1 … 1 to coefficients of powers, for one component at a time; by default, the series is a Legendre series.
    """
    powers = np.zeros_like(coefficients)
    for axis in range(3):
        polynomial = convert(coefficients[:, axis])  # without the highest powers if they are zero
        powers[: len(polynomial), axis] = polynomial
    return powers / half_s ** np.arange(len(powers))[:, None]


def _vector(values: Floats) -> Vector:
    x, y, z = values.tolist()
    return (x, y, z)


def path_of(powers: Iterable[Iterable[float]]) -> PlatformState:
    """Path that is a polynomial of slow time with the given coefficients of τ⁰, τ¹, … (at least two).

    If the coefficients of the highest powers are zero, they are left out.
    """
    vectors: list[Vector] = [(float(x), float(y), float(z)) for x, y, z in powers]
    position, velocity, (x, y, z), *bends = vectors if len(vectors) > 2 else [*vectors, STRAIGHT]
    while bends and bends[-1] == STRAIGHT:
        bends.pop()
    return PlatformState(position=position, velocity=velocity, acceleration=(2 * x, 2 * y, 2 * z), bends=tuple(bends))


# ---------------------------------------------------------------------- positions between the samples of a table
class Sample(NamedTuple):
    """A sample of an orbit: time in a time system without leap seconds, position [m] and velocity [m/s]."""

    time: Instant
    place: Vector
    velocity: Vector


def interpolate(samples: Sequence[Sample], time: Instant, count: int, is_hermite: bool) -> Vector:
    """Position at a time, interpolated from the `count` samples around it. [m]

    For all times between two neighbouring samples, the same `count` samples are used. The path has no jumps at the
    samples: the polynomials before and after a sample both go through it, whether `count` is even or odd.
    """
    after = bisect_right(samples, time, key=lambda sample: sample.time)
    first = min(max(after - (count + 1) // 2, 0), len(samples) - count)
    near = samples[first : first + count]
    return _through(near, [sample.time.since(time) for sample in near], is_hermite)


def _through(samples: Sequence[Sample], times: Sequence[float], is_hermite: bool) -> Vector:
    """Position at time 0 on a polynomial through samples: Lagrange's, or Hermite's if velocities are used too. [m]

    `times` [s] are the times of the samples relative to the requested time. If the computation overflows, the result
    is NaN.

    Sources: Abramowitz & Stegun, equations 25.2.1 and 25.2.2; Burden & Faires, Numerical Analysis, theorem 3.9.
    """
    terms: list[list[float]] = [[], [], []]
    for j, sample in enumerate(samples):
        differences = [times[j] - time for n, time in enumerate(times) if n != j]
        basis = math.prod(-time / (times[j] - time) for n, time in enumerate(times) if n != j)
        if is_hermite:
            square = basis * basis
            slope = math.fsum(1 / time for time in differences)
            position_weight, velocity_weight = (1 + 2 * times[j] * slope) * square, -times[j] * square
        else:
            position_weight, velocity_weight = basis, 0.0
        for axis in range(3):
            terms[axis].append(position_weight * sample.place[axis])
            if velocity_weight:
                terms[axis].append(velocity_weight * sample.velocity[axis])
    try:
        x, y, z = (math.fsum(axis) for axis in terms)
    except (OverflowError, ValueError):  # some samples are so close to each other that a quotient overflows
        return (math.nan, math.nan, math.nan)
    return (x, y, z)
