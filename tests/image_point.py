"""Where the image of a point peaks, for any band and aperture: a reference from exact ranges and direct sums.

Nothing here comes from the package. ρ(τ; x) is the recorded less the expected range sum of the ground point x:
recorded on the true paths, expected on the measured ones. The phase over the band and the aperture is 2πfρ/c. To
second order in that phase the image is brightest where the phase has the least variance, a constant phase being free.
For a band of width B about f₀, evenly filled, that is the least over x of

    V(x) = Var_τ(ρ) + b²·⟨ρ²⟩,   b² = B²/(12 f₀²),

since ⟨(f/f₀)²⟩ = 1 + b² and ⟨f/f₀⟩ = 1. `least_variance_point` follows that minimum from no error on; `peak` looks
for the brightest point of the image itself, which knows no expansion.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

Floats = NDArray[np.float64]
Path = Callable[[Floats], Floats]  # slow times (n,) [s] to positions or position errors (n, 3) [m]

SPEED_OF_LIGHT = 299_792_458.0  # m/s
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)  # over -1 … 1; a full circle is right to rounding
_MEAN = _WEIGHTS / 2
_BAND_NODES, _BAND_WEIGHTS = np.polynomial.legendre.leggauss(24)
_LEGENDRE = np.array([np.polynomial.legendre.Legendre.basis(order)(_NODES) for order in range(4)])


def no_error(times: Floats) -> Floats:
    """The error of a path that is known."""
    return np.zeros((len(times), 3))


def _squares(vectors: Floats) -> Floats:
    return np.einsum("ni,ni->n", vectors, vectors)


Vector = tuple[float, float, float]


def flight(position: Vector, velocity: Vector, acceleration: Vector = (0.0, 0.0, 0.0)) -> Path:
    """A path of constant acceleration, or an error that is constant and grows. [m, m/s, m/s²]"""
    return lambda times: (
        np.add.outer(0 * times, position) + np.outer(times, velocity) + np.outer(times**2 / 2, acceleration)
    )


def circle(radius: float, height: float, rate: float, azimuth: float) -> Path:
    """A level circle about the scene centre. [m, m, rad/s, rad at mid-aperture]"""

    def path(times: Floats) -> Floats:
        angle = azimuth + rate * times
        return np.stack((radius * np.cos(angle), radius * np.sin(angle), height + 0 * times), axis=1)

    return path


@dataclass(frozen=True)
class Response:
    """The point of least variance, and what is left there.

    East, north [m]; the P₂ phase and the cubic phase at the aperture edge, signed like ρ; the quadratic phase that
    loses as much of the peak as all of it but the cubic and what lies beyond; the root mean square beyond the cubic
    [rad]; and the peak by direct sum [dB].
    """

    point: Floats
    quadratic_rad: float
    equal_loss_rad: float
    cubic_rad: float
    rest_rad: float
    peak_db: float


@dataclass(frozen=True)
class Collection:
    """A band [Hz], an aperture [s], the true paths, and the errors of the measured ones."""

    center_frequency: float
    bandwidth: float
    aperture_time: float
    paths: tuple[Path, Path]
    errors: tuple[Path, Path]

    @property
    def wavenumber(self) -> float:
        """2π over the wavelength of the band's centre. [rad/m]"""
        return 2 * math.pi * self.center_frequency / SPEED_OF_LIGHT

    @cached_property
    def _at_nodes(self) -> list[tuple[Floats, Floats]]:
        """True path and error of each platform at the nodes, (64, 3). [m]"""
        times = self.aperture_time / 2 * _NODES
        return [(path(times), error(times)) for path, error in zip(self.paths, self.errors, strict=True)]

    def left(self, point: Floats, size: float) -> Floats:
        """Range that errors of a size leave at a ground point, (64,). [m]"""
        left, (east, north) = np.zeros(_NODES.size), point
        for true, error in self._at_nodes:
            shift = size * error - (east, north, 0.0)
            moved = true + shift
            lengths = np.sqrt(_squares(true)) + np.sqrt(_squares(moved))
            left -= (shift * (true + moved)).sum(axis=1) / lengths  # |a| − |b| without their rounding
        return left

    def _slopes(self, point: Floats, size: float) -> Floats:
        east, north = point
        measured = [true + size * error - (east, north, 0.0) for true, error in self._at_nodes]
        return sum(m[:, :2] / np.sqrt(_squares(m))[:, None] for m in measured)

    def _variance(self, a: Floats, b: Floats) -> Floats:
        """Covariance over aperture and band of two ranges (64, …), relative to f₀. [m²]"""
        b2 = (self.bandwidth / self.center_frequency) ** 2 / 12
        mean_a, mean_b = _MEAN @ a, _MEAN @ b
        products = np.einsum("n,ni,nj->ij", _MEAN, a.reshape(64, -1), b.reshape(64, -1))
        return (1 + b2) * products - np.outer(mean_a, mean_b)

    def least_variance_point(self, steps: int = 8) -> Response:
        """Follow the least of V from no error on, by Gauss and Newton."""
        point = np.zeros(2)
        for step in range(1, steps + 1):
            for _ in range(50):
                left, slopes = self.left(point, step / steps), self._slopes(point, step / steps)
                move = np.linalg.solve(self._variance(slopes, slopes), self._variance(slopes, left)[:, 0])
                point = point - move
                if np.abs(move).max() < 1e-9:
                    break
        left = self.left(point, 1.0)
        parts = (2 * np.arange(4) + 1) * (_LEGENDRE * _MEAN @ left)
        quadratic, cubic = 1.5 * self.wavenumber * parts[2], 2.5 * self.wavenumber * parts[3]
        rest = self.wavenumber * math.sqrt(_MEAN @ (left - parts @ _LEGENDRE) ** 2)
        phase = self.wavenumber**2 * self._variance(left, left).item() - 4 / 175 * cubic**2 - rest**2
        return Response(point, quadratic, math.sqrt(max(45 / 4 * phase, 0.0)), cubic, rest, self.level(point))

    def level(self, point: Floats, size: float = 1.0) -> float:
        """The image at a ground point, of a perfect point that is 0 dB, by quadrature over band and aperture."""
        left = self.left(point, size)
        frequency = self.center_frequency + self.bandwidth / 2 * _BAND_NODES
        phase = np.exp(2j * math.pi / SPEED_OF_LIGHT * np.outer(frequency, left))
        return 20 * math.log10(abs(_BAND_WEIGHTS / 2 @ phase @ _MEAN))

    def peak(self, near: Floats, cell_m: float = 0.1) -> tuple[Floats, float]:
        """The brightest point of the image near a point [m], and its level [dB]: Nelder and Mead's simplex search."""
        corners = near + cell_m * np.array(((0, 0), (1, 0), (0, 1)))
        options = {"xatol": 1e-6, "fatol": 1e-12, "maxiter": 4000, "initial_simplex": corners}
        found = minimize(lambda point: -self.level(point), near, method="Nelder-Mead", options=options)
        return found.x, -float(found.fun)
