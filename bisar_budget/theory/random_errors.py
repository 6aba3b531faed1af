"""Random errors over one aperture: quadratic phase, cubic phase and ISLR due to noise of sensors and clocks.

An error x over the aperture is expanded in Legendre polynomials Pₙ(2τ/T). Orders 0 and 1 displace the response. The
quadratic phase at the aperture edge is 3/2 times the coefficient of order 2, and the cubic phase is 5/2 times the
coefficient of order 3. All higher orders spread energy over the image. A tone of frequency f and amplitude 1 has the
coefficient (2n + 1)·jₙ(πfT) in order n, so a spectrum is integrated with the square of this factor. A range error x
causes the one-way phase k·x with k = 2π/λ. All formulas are derived here; the paper does not treat random errors.

Spectra are one-sided. Values are for one sigma. Errors of different axes and platforms are independent.
"""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

from sympy import (
    Expr,
    I,
    Integer,
    Poly,
    Rational,
    Symbol,
    cos,
    exp,
    expand,
    expand_complex,
    factorial,
    gamma,
    integrate,
    legendre,
    pi,
    simplify,
    sin,
    sqrt,
)

from bisar_budget.theory.published import Equation, FormulaTable, TableRow, one_way_phase
from bisar_budget.theory.symbols import T, center_frequency, positive, real

ORDER_COUNT = 4  # Legendre orders 0 to 3; higher orders spread energy over the image
LEADING_RATIONALS = (
    1,
    1,
    Rational(3, 2),
    Rational(5, 2),
)  # coefficient of xⁿ in Pₙ: the order's value at the aperture edge
SERIES_TERMS = 9  # terms of a series about zero; the relative error is below 1e-8 for arguments below 0.5

along = positive("u")  # length of the line of sight; with a size for each axis, the root of Σ(u·σ)²
# Specific force f that acts along the line of sight u: for a unit tilt |u × f|, and for a unit scale factor of each
# axis its excess.
turned, scaled = positive("f_u"), positive("f_s")
ratio = positive("a")  # T/(2τ_c): half the aperture over the correlation time
decay = positive("d")  # exp(−2a)
angle = positive("x")  # πfT
cosine, sine = real("cosine"), real("sine")
inverse = tuple(positive(f"inverse_{n}") for n in range(0, 2 * ORDER_COUNT + 1, 2))  # x⁻⁰, x⁻² … x⁻⁸
step = positive("y")  # 2πf·T_s

_x, _m, _M, _w = real("xi"), positive("m"), positive("M"), positive("w")


class Moments(NamedTuple):
    """Mean squares of the quadratic, cubic and remaining parts of an error over an aperture.

    `quadratic` and `cubic` are the mean squares of the quadratic and the cubic part at the aperture edge. `left` is
    the mean square of the remainder beyond the cubic part, averaged over the aperture.
    """

    quadratic: Expr
    cubic: Expr
    left: Expr

    def times(self, factor: Expr) -> "Moments":
        """Multiply all moments by a factor."""
        return Moments(*(expand(factor * moment) for moment in self))


class PlaceMoments(NamedTuple):
    """Moments of the constant and linear parts of an error (Legendre orders 0 and 1), which displace the response.

    `constant` and `linear` are the mean squares of the two parts. `constant_quadratic` and `linear_cubic` are the
    mean products of the constant and quadratic parts, and of the linear and cubic parts. All parts are taken at the
    aperture edge. For processes that are symmetric in time, even and odd orders are uncorrelated.
    """

    constant: Expr
    linear: Expr
    constant_quadratic: Expr
    linear_cubic: Expr


_PLACE_ORDERS = ((0, 0), (1, 1), (0, 2), (1, 3))  # pairs of orders of the fields of `PlaceMoments`


def moments(coefficients: tuple[Expr, ...], mean_square: Expr) -> Moments:
    """Compute the moments of an error from the mean squares of its Legendre coefficients.

    `coefficients` holds the mean squares of the coefficients of P₀ … P₃. `mean_square` is the mean square of the
    whole error, averaged over the aperture.
    """
    orders = [square / (2 * n + 1) for n, square in enumerate(coefficients)]
    return Moments(
        LEADING_RATIONALS[2] ** 2 * coefficients[2],
        LEADING_RATIONALS[3] ** 2 * coefficients[3],
        expand(mean_square - sum(orders)),
    )


# ---------------------------------------------------------------------- inertial sensors
def _from_middle(response: Callable[[Expr], Expr]) -> Callable[[Expr, Expr], Expr]:
    """Covariance function of an error that is driven by white noise and starts from zero at mid-aperture.

    The arguments of the covariance function are two times m ≤ M after mid-aperture. `response` returns the error as a
    function of the time since a unit impulse of the noise. The noise before mid-aperture is independent of the noise
    after it.
    """

    def covariance(m: Expr, M: Expr) -> Expr:
        return expand(integrate(expand(response(m - _w) * response(M - _w)), (_w, 0, m)))

    return covariance


@cache
def walk(order: int) -> Moments:
    """Moments of white noise of unit density, integrated `order` times from mid-aperture, for an aperture T = 1."""
    covariance = _from_middle(lambda t: t ** (order - 1) / factorial(order - 1))
    squares = []
    for n in range(ORDER_COUNT):
        earlier = integrate(expand(legendre(n, _m) * covariance(_m, _M)), (_m, 0, _M))
        one_side = 2 * integrate(expand(legendre(n, _M) * earlier), (_M, 0, 1))
        squares.append(Rational(2 * n + 1, 2) ** 2 * 2 * one_side)
    mean_square = integrate(covariance(_M, _M), (_M, 0, 1))
    return moments(tuple(squares), mean_square).times(Rational(1, 2) ** (2 * order - 1))  # scaled from T/2 to T


def constant(order: int) -> Moments:
    """Moments of the function τⁿ/n! with n = `order`, for an aperture T = 1.

    This is the position error due to a constant acceleration (n = 2) or to a constant rate of acceleration (n = 3).
    """
    history = (_x / 2) ** order / factorial(order)
    squares = tuple(
        (Rational(2 * n + 1, 2) * integrate(expand(history * legendre(n, _x)), (_x, -1, 1))) ** 2
        for n in range(ORDER_COUNT)
    )
    return moments(squares, integrate(history**2, (_x, -1, 1)) / 2)


class SensorFigure(NamedTuple):
    """Figure of an inertial sensor's data sheet: symbol, name, explanation, and moments of the phase that it causes.

    The moments are the mean squares of the phase for one unit of the figure.
    """

    symbol: Symbol
    name: str
    says: str
    phase: Moments


@cache
def inertial() -> tuple[SensorFigure, ...]:
    """Figures of an inertial sensor's data sheet, in the order of the mission file.

    The moments of each figure are mean squares of the phase over one aperture. [rad²/unit²]
    """
    k = one_way_phase(Integer(1))

    def figure(symbol: str, name: str, says: str, of_range: Moments, size: Expr, power: Expr) -> SensorFigure:
        return SensorFigure(positive(symbol), name, says, of_range.times((k * size) ** 2 * T ** (2 * power)))

    return (
        figure("b", "accelerometer bias", "an acceleration error", constant(2), along, Integer(2)),
        figure(
            "kappa", "accelerometer scale factor", "an acceleration κ·f on each axis", constant(2), scaled, Integer(2)
        ),
        figure("psi", "attitude", "specific force is turned: an acceleration ψ × f", constant(2), turned, Integer(2)),
        figure("epsilon", "gyro bias", "attitude drifts: a jerk ε × f", constant(3), turned, Integer(3)),
        figure("N", "velocity random walk", "white acceleration", walk(2), along, Rational(3, 2)),
        figure("N_g", "angle random walk", "attitude walks from mid-aperture", walk(3), turned, Rational(5, 2)),
    )


# ---------------------------------------------------------------------- Gauss-Markov
def _with_exponential(polynomial: Poly, rate: Expr) -> Expr:
    """Antiderivative of polynomial·exp(rate·x), divided by exp(rate·x), by repeated integration by parts."""
    total, sign = Integer(0), 1
    for order in range(polynomial.degree() + 1):
        total += sign * polynomial.as_expr() / rate ** (order + 1)
        polynomial, sign = polynomial.diff(), -sign
    return total


def _gauss_markov_coefficients(m: int, n: int) -> Expr:
    """Mean product of the coefficients of Pₘ and Pₙ for a Gauss-Markov process of variance 1.

    m and n must be both even or both odd.
    """
    first, second = (Poly(legendre(order, _x), _x) for order in (m, n))
    # ∫ Pₙ(t)·exp(−a(s − t)) dt from −1 to s is q(s) − q(−1)·exp(−a(s + 1)). The factor r is the same for Pₘ and −a,
    # and integrates the second term.
    q, r = _with_exponential(second, ratio), _with_exponential(first, -ratio)
    product = integrate(expand(first.as_expr() * q), (_x, -1, 1))
    product -= q.subs(_x, -1) * (r.subs(_x, 1) * decay - r.subs(_x, -1))
    return expand(Rational((2 * m + 1) * (2 * n + 1), 4) * 2 * product)


@cache
def gauss_markov() -> Moments:
    """Moments of a stationary Gauss-Markov process with variance 1 and correlation exp(−|t|/τ_c).

    They are expressed in terms of the symbols `ratio` for T/(2τ_c) and `decay` for exp(−T/τ_c).
    """
    return moments(tuple(_gauss_markov_coefficients(n, n) for n in range(ORDER_COUNT)), Integer(1))


@cache
def gauss_markov_place() -> PlaceMoments:
    """Moments of the constant and linear parts of the process of `gauss_markov`, in terms of `ratio` and `decay`."""
    return PlaceMoments(*(LEADING_RATIONALS[n] * _gauss_markov_coefficients(m, n) for m, n in _PLACE_ORDERS))


@cache
def gauss_markov_slow() -> tuple[Expr, ...]:
    """Power series in `ratio` of the moments of `gauss_markov` and `gauss_markov_place`.

    They are used if the correlation time is much longer than the aperture, where the terms of the exact expressions
    nearly cancel.
    """
    exact = (*gauss_markov(), *gauss_markov_place())
    return tuple(_series(moment.subs(decay, exp(-2 * ratio)), ratio) for moment in exact)


def _series(expression: Expr, variable: Symbol) -> Expr:
    """Series about zero of a sum whose terms are powers of a variable times exponentials, sines or cosines.

    The terms of the sum cancel at zero. The functions are replaced by Taylor polynomials, which are exact up to their
    order. SymPy can expand the resulting sums of powers quickly.
    """
    powers = range(4 * ORDER_COUNT + 2 * SERIES_TERMS)
    taylor = {
        exp(-2 * variable): sum((-2 * variable) ** n / factorial(n) for n in powers),
        sin(variable): sum(Integer(-1) ** (n // 2) * variable**n / factorial(n) for n in powers if n % 2),
        cos(variable): sum(Integer(-1) ** (n // 2) * variable**n / factorial(n) for n in powers if n % 2 == 0),
    }
    # No term is divided by a higher power of the variable.
    exact = Poly(expand(expand(expression).subs(taylor) * variable ** (2 * ORDER_COUNT)), variable)
    terms = [(power - 2 * ORDER_COUNT, coefficient) for (power,), coefficient in exact.terms()]
    first = min(power for power, _ in terms)
    return sum(coefficient * variable**power for power, coefficient in terms if power < first + SERIES_TERMS)


# ---------------------------------------------------------------------- spectra
def spherical_bessel(n: int) -> Expr:
    """Spherical Bessel function jₙ(x), computed as the integral ½∫ Pₙ(t)·cos(xt − nπ/2) dt over −1 … 1.

    A tone of amplitude 1 has the amplitude (2n + 1)·jₙ(x) in Legendre order n, with x = πfT.
    """
    tone = sin(angle * _x) if n % 2 else cos(angle * _x)
    sign = (1, 1, -1, -1)[n % 4]
    return expand(sign * integrate(expand(legendre(n, _x) * tone), (_x, -1, 1)) / 2)


@cache
def tone() -> Moments:
    """Quadratic and cubic phase of a phase tone of amplitude 1, and the share of its power beyond the cubic part.

    In contrast to other `Moments`, the two phases are amplitudes at the aperture edge and not mean squares.
    """
    amplitudes = [spherical_bessel(n) for n in range(ORDER_COUNT)]
    remaining_share = 1 - sum((2 * n + 1) * amplitude**2 for n, amplitude in enumerate(amplitudes))
    return Moments(
        LEADING_RATIONALS[2] * 5 * amplitudes[2], LEADING_RATIONALS[3] * 7 * amplitudes[3], remaining_share
    )


def tone_place() -> tuple[Expr, Expr]:
    """Amplitudes, at the aperture edge, of the constant and the linear part of a tone of amplitude 1."""
    return spherical_bessel(0), 3 * spherical_bessel(1)


@cache
def tone_in_terms() -> tuple[Expr, ...]:
    """Expressions of `tone` and `tone_place` with symbols for the sine and the cosine of `angle` = πfT."""
    return tuple(expression.subs({sin(angle): sine, cos(angle): cosine}) for expression in (*tone(), *tone_place()))


def tone_slow() -> tuple[Expr, ...]:
    """Power series of `tone` and `tone_place` in `angle` = πfT, for tones that are slow relative to the aperture."""
    return tuple(_series(expression, angle) for expression in (*tone(), *tone_place()))


def tone_fast() -> tuple[Expr, ...]:
    """Mean squares and mean products of the parts of a fast tone, as in `Moments` and `PlaceMoments`.

    Products of sines and cosines are averaged over a cycle. The results are expressed in terms of `inverse`, the
    symbols for the even inverse powers of `angle`. The part of order n is shifted in phase by n quarters of a cycle,
    so orders n and n + 2 have opposite signs.
    """
    quadratic, cubic, left, constant, linear = tone_in_terms()
    mean = {sine**2: Rational(1, 2), cosine**2: Rational(1, 2), sine * cosine: Integer(0)}
    products = (quadratic**2, cubic**2, left, constant**2, linear**2, -constant * quadratic, -linear * cubic)
    averaged = (Poly(expand(expand(product).subs(mean)), 1 / angle) for product in products)
    return tuple(sum(c * inverse[n // 2] for (n,), c in polynomial.terms()) for polynomial in averaged)


def power_law_integral(n: int, slope: int) -> Expr:
    """Integral ∫ jₙ(πfT)²·f^(−slope) df from 0 to infinity, divided by T^(slope − 1).

    Source: Weber and Schafheitlin, DLMF 10.22.57.
    """
    mu, power = n + Rational(1, 2), slope + 1
    bessel = (
        gamma(power)
        * gamma(mu + Rational(1 - power, 2))
        / (2**power * gamma(Rational(1 + power, 2)) ** 2 * gamma(mu + Rational(1 + power, 2)))
    )
    return simplify(pi / 2 * bessel * pi ** (slope - 1))


@cache
def power_law(order: int) -> tuple[Expr, ...]:
    """Mean squares of the quadratic or cubic phase at the aperture edge, for power-law phase spectra. [s^(n−1)]

    The phase spectra are f⁻ⁿ with n = 0 … 4. `order` is 2 for the quadratic phase and 3 for the cubic phase.
    """
    return tuple(
        (LEADING_RATIONALS[order] * (2 * order + 1)) ** 2 * power_law_integral(order, slope) * T ** (slope - 1)
        for slope in range(5)
    )


def passed() -> Expr:
    """Amplitude of a tone after sampling and linear interpolation, relative to its original amplitude: sinc²(f·T_s).

    It is the Fourier transform of the triangular interpolation kernel.
    """
    fraction = positive("nu")
    return simplify(2 * integrate((1 - fraction) * cos(step * fraction), (fraction, 0, 1)))


def interpolated() -> Expr:
    """Fraction of a tone's power that remains after subtracting the straight lines between its samples.

    The fraction is a function of y = 2πf·T_s, where f is the frequency of the tone and T_s the sampling interval. It
    is (1 − sinc²)² at the frequency of the tone, and sinc⁴ at each frequency to which the tone is folded.
    """
    fraction = positive("nu")
    error = exp(I * step * fraction) - (1 - fraction) - fraction * exp(I * step)
    conjugate_line = (1 - fraction) + fraction * exp(-I * step)
    square = expand_complex(expand(error * (exp(-I * step * fraction) - conjugate_line)))
    return simplify(integrate(expand(square), (fraction, 0, 1)).rewrite(cos))


def interpolated_noise() -> Expr:
    """Mean square over time of straight lines that connect independent samples of variance 1."""
    fraction = positive("nu")
    return integrate((1 - fraction) ** 2 + fraction**2, (fraction, 0, 1))


# ---------------------------------------------------------------------- vibration
sensitivity = positive("Gamma")  # of an oscillator, y = Γ·a [s²/m]
_acceleration, _frequency, _time = positive("a"), positive("f"), real("t")


def vibrating_oscillator() -> Expr:
    """Peak of the phase error ∫2πf₀·y dt of an oscillator that is subjected to the acceleration a·cos(2πft). [rad]

    y is the relative frequency error of the oscillator, and f₀ is the centre frequency of the radar.
    """
    y = sensitivity * _acceleration * cos(2 * pi * _frequency * _time)
    phase = integrate(2 * pi * center_frequency * y, _time)
    return simplify(phase / sin(2 * pi * _frequency * _time))


def vibrating_path() -> Expr:
    """Amplitude of the displacement due to an acceleration a·cos(2πft), apart from uniform motion. [m]"""
    wave = cos(2 * pi * _frequency * _time)
    return simplify(-integrate(integrate(_acceleration * wave, _time), _time) / wave)


def of_spectrum(amplitude: Expr) -> Expr:
    """Power spectrum of a phase or another effect, due to accelerations with the power spectrum S_a.

    `amplitude` is the amplitude of the effect that a sinusoidal acceleration causes. It must be proportional to the
    amplitude of the acceleration.
    """
    return amplitude.subs(_acceleration, 1) ** 2 * positive("S_a")


# ---------------------------------------------------------------------- for a reader
@cache
def table() -> FormulaTable:
    """Table of the phases at the aperture edge that each data-sheet figure of an inertial sensor causes."""
    rows = tuple(
        TableRow(
            number=None,
            error=figure.symbol,
            label=figure.symbol,
            cells=tuple(simplify(sqrt(square)) * figure.symbol for square in figure.phase),
            note=f"{figure.name}: {figure.says}",
        )
        for figure in inertial()
    )
    return FormulaTable(
        number="Inertial sensors",
        title="Phase by one figure of a platform's inertial sensor, one sigma",
        columns=("Quadratic phase [rad]", "Cubic phase [rad]", "Left after the cubic, rms [rad]"),
        rows=rows,
        notes=(
            "Derived here. u is the length of the line of sight, 1. Attitude and gyros turn the specific force "
            "f = a − g, of which f_u = |u × f| then lies along the line of sight: g·cos(elevation) in level flight, "
            "nothing in free fall. A scale factor has f_s = √Σ(uᵢfᵢ)² of it, i over the sensor's axes. Walks start "
            "at mid-aperture.",
            "A spectrum of phase S is integrated with the squares of φ₂ and φ₃ of a tone, and with the share left.",
        ),
    )


def equations() -> tuple[Equation, ...]:
    """Equations of random errors, in the order of this module.

    They give the phases of a tone, the mean squares for power-law spectra, the errors that remain after interpolation
    between synchronisations, and the effects of vibration.
    """
    quadratic, cubic, left = tone()
    names = (("quadratic", "phi_2", quadratic), ("cubic", "phi_3", cubic))
    laws = (
        Equation("", f"Mean square of the quadratic phase, spectrum f^-{slope}", positive(f"c_{slope}"), value)
        for slope, value in enumerate(power_law(2))
    )
    return (
        *(Equation("", f"Amplitude of the {order_name} phase of a tone, x = πfT", real(name), simplify(value))
          for order_name, name, value in names),
        Equation("", "Share of a tone's power left after the cubic", real("L"), left),
        *laws,
        Equation("", "Amplitude that straight lines between samples pass, y = 2πfT_s", real("H"), passed()),
        Equation("", "Share of a tone's power that they leave, at all frequencies", real("L_s"), interpolated()),
        Equation("", "Mean square of noise of the link with straight lines between, of σ² each time",
                 positive("sigma_L") ** 2, interpolated_noise() * positive("sigma") ** 2),
        Equation("", "Amplitude of a motion whose acceleration is a·cos(2πft)", positive("A"), vibrating_path()),
        Equation("", "Spectrum of displacement", positive("S_x"), of_spectrum(vibrating_path())),
        Equation("", "Peak phase of an oscillator so accelerated, a quarter of a turn away", positive("phi"),
                 vibrating_oscillator()),
        Equation("", "Spectrum of an oscillator's phase", positive("S"), of_spectrum(vibrating_oscillator())),
    )  # fmt: skip
