"""The matrix H, which measures how well the aperture and the band distinguish ground points.

If x is the vector between two ground points, their ranges differ by g(τ)·x. Here g is the sum of both lines of sight,
projected on the ground. The variance of the phase difference over aperture and band is k²·xᵀHx, with k = 2πf₀/c and

    H = Cov_τ(g) + b²⟨g gᵀ⟩,    b² = B²/(12 f₀²),

for an evenly filled band of width B about f₀. ⟨ ⟩ is the mean over the aperture. If H is singular, the points of a
line cannot be distinguished, and the collection has no image plane. H is half the second derivative of V, the
variance that the image point minimises (see `ranges.exact_ranges`). The matrix was derived for this program; it is
not in the paper by Rigling & Moses.
"""

import math
from dataclasses import dataclass
from functools import cache, cached_property, reduce
from typing import Protocol

import numpy as np

from bisar_budget.arrays import Booleans, Floats, Indices, PerCase
from bisar_budget.constants import MIN_GRADIENT_ANGLE_DEG
from bisar_budget.geometry import BistaticGeometry

# Length of a platform's path in half an aperture, divided by its slant range, and the number of nodes that suffices
# up to it. The relative error of a phase is less than 1e-6 up to a ratio of 0.5, and less than 1e-4 beyond.
NODES_BY_PATH = ((0.1, 6), (0.5, 10), (1.0, 16), (2.0, 32), (math.inf, 64))
FEWEST_PATH_NODES = NODES_BY_PATH[0][1]
FINEST_NODES = 128  # nodes that resolve phases up to some 100 rad
SIGHT_POLYNOMIAL_COUNT = 16  # polynomials that fit a line of sight over a full circle to 1e-6
# Paths in pieces may turn faster than their length suggests. With 1.5 nodes per piece, the relative error of a phase
# is less than 1e-4.
_NODES_PER_PIECE, _PIECE_NODES = 1.5, np.array((16, 32, 64, 128, 256))
# Smallest part of the determinant of H that comes from the mean range gradient and the mean Doppler gradient. With
# less, the sign of the area between these gradients does not tell whether a point is beyond a fold.
MIN_OWN_AREA_FRACTION = 0.5
MIN_SINE = math.sin(math.radians(MIN_GRADIENT_ANGLE_DEG))
MIN_TURN_FRACTION = 1e-9  # of the turns of both lines of sight; if their sum turns by less, it does not turn


class Band(Protocol):
    """Frequency band of a radar. [Hz]"""

    @property
    def center_frequency(self) -> PerCase:
        """Centre of the band. [Hz]"""

    @property
    def bandwidth(self) -> PerCase:
        """Width of the band, which is evenly filled. [Hz]"""


@dataclass(frozen=True, eq=False)
class Sampling:
    """Slow times at which a range history is sampled, and the weights that fit Legendre polynomials to it.

    Attributes
    ----------
    places : (samples,)
        Slow times from −1 to 1, in units of half the aperture time.
    fit : (4, samples)
        Weights whose products with a history give its mean (the P₀ part), and the values of its P₁ part, quadratic
        part and cubic part at the aperture edge. The quadratic part is 3/2 times the coefficient of P₂, and the cubic
        part is 5/2 times the coefficient of P₃.
    """

    places: Floats
    fit: Floats

    @cached_property
    def centred(self) -> Floats:
        """Matrix (samples + 1, samples) that maps a history to the deviations from its mean, followed by the mean."""
        return np.concatenate((np.eye(self.places.size) - self.fit[0], self.fit[:1]))

    @cached_property
    def polynomials(self) -> Floats:
        """Legendre polynomials P₀ to P₃ at the samples (samples, 4), each divided by its leading coefficient."""
        return np.asarray(np.polynomial.legendre.legvander(self.places, 3) / LEGENDRE_LEADING)

    @cached_property
    def to_ends(self) -> Floats:
        """Weights (2, samples) that extrapolate a smooth history from the samples to both ends of the aperture."""
        return self._weights_at(np.array((-1.0, 1.0)))

    @cached_property
    def to_finest(self) -> Floats:
        """Weights (FINEST_NODES, samples) that interpolate a smooth history from the samples to the finest nodes.

        The finest nodes are the slow times of `nodes(FINEST_NODES)`.
        """
        return self._weights_at(nodes(FINEST_NODES).places)

    def _weights_at(self, slow_times: Floats) -> Floats:
        """Weights (times, samples) that interpolate a smooth history from the samples to slow times from −1 to 1."""
        degree = min(self.places.size, SIGHT_POLYNOMIAL_COUNT) - 1
        polynomials = np.polynomial.legendre.legvander(self.places, degree)
        return np.asarray(np.polynomial.legendre.legvander(slow_times, degree) @ np.linalg.pinv(polynomials))


LEGENDRE_LEADING = np.array((1.0, 1.0, 1.5, 2.5))  # coefficient of xⁿ in the Legendre polynomial Pₙ


@cache
def nodes(count: int) -> Sampling:
    """Sampling at the nodes of Gauss-Legendre quadrature.

    The weights `fit` compute the Legendre coefficient of order n of a history ρ as (2n + 1)/2 ∫ρPₙ over −1 … 1.
    """
    slow_times, weights = np.polynomial.legendre.leggauss(count)
    orders = np.polynomial.legendre.legvander(slow_times, 3)
    return Sampling(slow_times, ((np.arange(4) + 0.5) * LEGENDRE_LEADING)[:, None] * orders.T * weights)


def nodes_for(
    geometry: BistaticGeometry, aperture_time_s: PerCase, *, has_direct_path: bool = False
) -> int | Indices:
    """Number of quadrature nodes over the aperture that each case needs for the lines of sight of both platforms.

    If the receiver uses the direct path as its clock, the number is also sufficient for the direct path.
    """
    half = aperture_time_s / 2
    turning = (*geometry.both, *((geometry.apart,) if has_direct_path else ()))
    way = reduce(np.maximum, [path.travelled(half) / path.slant_range for path in turning])
    limits, counts = zip(*NODES_BY_PATH, strict=True)
    count = np.array(counts)[np.searchsorted(limits, way)]
    pieces = max((path.curve.count for path in turning if path.curve is not None), default=0)
    if pieces:
        least = np.searchsorted(_PIECE_NODES[:-1], _NODES_PER_PIECE * pieces)
        count = np.maximum(count, _PIECE_NODES[least])
    return count if np.ndim(way) else int(count)


def band_variance(radar: Band) -> PerCase:
    """Variance of frequency over an evenly filled band, divided by the square of the centre frequency: b²."""
    return (radar.bandwidth / radar.center_frequency) ** 2 / 12


@dataclass(frozen=True, eq=False)
class GroundMatrix:
    """The matrix H of a collection without range errors, as defined in the module docstring.

    H is half the second derivative, over the ground, of the variance V that the image point minimises.

    Attributes
    ----------
    slopes : (2, nodes, cases)
        Change of the range error at each node per metre of displacement to the east, and to the north. [m/m]
    fit : (4, nodes)
        Weights of `Sampling.fit`.
    band : (cases,)
        b² of the band.
    range_gradient : (2, cases)
        Gradient of the range on the ground, east and north, averaged over the aperture. [m/m]
    covariance : (2, 2, cases)
        Covariance of this gradient over the aperture.
    projection : (2, nodes, cases)
        Weights that give ⟨g, ρ⟩ from the range errors ρ at the nodes. ⟨ , ⟩ is the scalar product with ⟨ρ, ρ⟩ = V.
    xx, xy, yy : (cases,)
        Elements of H = ⟨g, gᵀ⟩.
    """

    slopes: Floats
    fit: Floats
    band: Floats
    range_gradient: Floats
    covariance: Floats
    projection: Floats
    xx: Floats
    xy: Floats
    yy: Floats

    @classmethod
    def of(cls, slopes: Floats, fit: Floats, band: Floats) -> "GroundMatrix":
        """Compute H from `slopes`, the change of the range error at each node per metre to the east and to the north.

        `slopes` has the shape (2, nodes, cases). `fit` and `band` are fields of this class.
        """
        weights, gradient = fit[0][:, None], fit[0] @ slopes
        apart = slopes - gradient[:, None]
        weighted = weights * apart
        covariance = np.einsum("anc,bnc->abc", weighted, apart)
        x, y = gradient
        u, v = along = band * gradient
        weighted *= 1 + band
        weighted += weights * along[:, None]
        xx, xy, yy = ((1 + band) * covariance[entry] for entry in ((0, 0), (0, 1), (1, 1)))
        return cls(slopes, fit, band, gradient, covariance, weighted, xx + u * x, xy + u * y, yy + v * y)

    @cached_property
    def determinant(self) -> Floats:
        """Determinant of the matrix H: square of the area that the east and north components of the gradient span."""
        return np.asarray(self.xx * self.yy - self.xy * self.xy)

    @property
    def least(self) -> Floats:
        """Smaller eigenvalue of the matrix H: increase of V per square metre in the direction of worst resolution."""
        half, apart = (self.xx + self.yy) / 2, np.hypot((self.xx - self.yy) / 2, self.xy)
        return np.asarray(self.determinant / (half + apart))

    @property
    def place_weights(self) -> tuple[Floats, Floats]:
        """Displacement of the image point per metre of range error at each node. [m/m]

        It is −H⁻¹⟨g, ·⟩, with the matrix H and the range gradient g of the module docstring. Returns the
        displacements east and north, (nodes, cases) each.
        """
        (x, y), determinant = self.projection, self.determinant
        with np.errstate(all="ignore"):
            return (self.xy * y - self.yy * x) / determinant, (self.xy * x - self.xx * y) / determinant

    @property
    def sine(self) -> Floats:
        """Sine of the angle θ between the two ground directions in which bandwidth and aperture provide resolution.

        The aperture provides resolution because the line of sight turns. The outer product of the mean gradient with
        itself and the covariance of the gradient over the aperture are both scaled to unit trace. Their sum has the
        eigenvalues 1 ± cos θ and thus the condition number cot²(θ/2). For a short aperture θ is the angle between the
        range gradient and the Doppler gradient.
        """
        x, y = self.range_gradient
        square = x * x + y * y
        (xx, xy), (_, yy) = self.covariance
        with np.errstate(all="ignore"):
            is_seen = square > 0
            trace, square = xx + yy, np.where(is_seen, square, 1.0)
            a, b, c = xx / trace + x * x / square, xy / trace + x * y / square, yy / trace + y * y / square
            return np.asarray(np.sqrt(np.maximum(a * c - b * b, 0.0)) * np.where(is_seen, 1.0, 2.0))

    @property
    def turning(self) -> Floats:
        """Linear change of the range gradient across its mean direction, from mid-aperture to an aperture edge. [m/m]

        This is the value, at the aperture edge, of the linear (P₁) part of the gradient's component across the mean
        gradient. It is computed from the variance of this component over the aperture.
        """
        x, y = self.range_gradient
        along = self.xx * x * x + 2 * self.xy * x * y + self.yy * y * y
        with np.errstate(all="ignore"):
            return np.asarray(np.sqrt(np.maximum(3 * self.determinant * (x * x + y * y) / along, 0.0)))

    @cached_property
    def orientation(self) -> Floats:
        """Signed area of the parallelogram that the mean range and Doppler gradients span.

        The function `orientation` computes the area.
        """
        return orientation(self.slopes, self.fit, self.band, self.determinant)

    def turned_from(self, centre: "GroundMatrix", case: Indices) -> Floats:
        """Area that the range gradient spans over the aperture, relative to the area at the scene centre.

        The ratio is negative for points beyond a fold, where the image is mirrored. It is computed by the function
        `turn`. `case` contains the index of the case to which each point belongs.
        """
        return turn(self.determinant, self.orientation, centre, case)


def orientation(slopes: Floats, fit: Floats, band: Floats, determinant: Floats) -> Floats:
    """Signed area of the parallelogram that the mean range gradient and the mean Doppler gradient span.

    The result is set to 0 if these two mean gradients contribute only a small part of the determinant of H. The
    resolution then comes mostly from variations of the gradient over the aperture. The first three parameters are
    fields of `GroundMatrix`, and the last is the determinant of H.
    """
    (x, y), (by_x, by_y) = fit[0] @ slopes, fit[1] @ slopes
    area = x * by_y - y * by_x
    determinant_of_both = band * (1 + band) / 3 * area * area
    return np.where(determinant_of_both >= MIN_OWN_AREA_FRACTION * determinant, area, 0.0)


def turn(determinant: Floats, orientation: Floats, centre: GroundMatrix, case: Indices) -> Floats:
    """Area that the range gradient spans over the aperture, relative to the area at the scene centre.

    The area is the square root of `determinant`, the determinant of the matrix H in the module docstring.
    `orientation` is the result of the function `orientation`, whose sign shows on which side of a fold a point lies.
    `centre` is the matrix at the scene centres, and `case` contains the index of the case to which each point
    belongs. The ratio is negative if the sign of `orientation` is opposite to the sign at the scene centre. The point
    then lies beyond a fold, where the image is mirrored.
    """
    at_centre, orientation_at_centre = centre.determinant, centre.orientation
    if at_centre.size > 1:
        at_centre, orientation_at_centre = at_centre[case], orientation_at_centre[case]
    area = np.sqrt(np.maximum(determinant, 0.0) / at_centre)
    return np.where(orientation_at_centre * orientation < 0, -area, area)


def spans_ground(
    geometry: BistaticGeometry, radar: Band, aperture_time_s: PerCase, cases: int = 1
) -> tuple[Booleans, Floats]:
    """Evaluate the two criteria for the existence of an image plane; each result has the shape (cases,).

    The first criterion is whether the sum of the lines of sight turns within the aperture. The second is
    `GroundMatrix.sine`, the sine of the angle between the two ground directions in which bandwidth and aperture
    provide resolution. There is no image plane if the sum does not turn, or if this angle is less than a degree. Both
    criteria refer to the whole aperture. A full circle therefore has an image plane, and so has an aperture in which
    the range and Doppler gradients are parallel only momentarily.
    """
    half = np.array(np.broadcast_to(np.asarray(aperture_time_s, dtype=float) / 2, (cases,)))
    sampling = nodes(int(np.max(nodes_for(geometry, 2 * half), initial=FEWEST_PATH_NODES)))
    slow_times, fit = sampling.places, sampling.fit
    slopes, turning = np.zeros((2, slow_times.size, cases)), np.zeros(cases)
    for path in geometry.both:
        x, y, z = path.place(slow_times[:, None] * half)
        distance = np.sqrt(x * x + y * y + z * z)
        slopes[0] += x / distance
        slopes[1] += y / distance
        turning = turning + path.travelled(half) / path.slant_range
    matrix = GroundMatrix.of(slopes, fit, band_variance(radar) * np.ones(cases))
    spread = np.ptp(slopes, axis=1).sum(axis=0)
    return spread > MIN_TURN_FRACTION * turning, matrix.sine


def degeneracy(geometry: BistaticGeometry, radar: Band, aperture_time_s: float) -> str:
    """Reason why a collection has no image plane; empty if there is an image plane."""
    turns, sine = spans_ground(geometry, radar, aperture_time_s)
    if not turns[0]:
        return "both look vectors have a sum that never turns, so that Doppler does not change over the ground"
    if sine[0] >= MIN_SINE:
        return ""
    degrees = math.degrees(math.asin(sine[0]))
    return (
        f"range and Doppler gradients on the ground are {degrees:.2g} deg from parallel over the aperture, at least "
        f"{MIN_GRADIENT_ANGLE_DEG:g} deg is needed: no image plane"
    )
