"""Random errors over an aperture: constants in closed form, and integrals done by others.

mpmath integrates, and its Bessel functions are independent of ours. Printed constants are those of the phase's power
law as trade studies of bistatic SAR state it.
"""

import math

import mpmath
import numpy as np
import pytest
from sympy import lambdify

from bisar_budget import evaluators
from bisar_budget.constants import STANDARD_GRAVITY_MPS2
from bisar_budget.effects.spectra import (
    PowerLawPiece,
    gauss_markov,
    held,
    link_parts,
    parts,
    synchronized_parts,
    tone,
)
from bisar_budget.report.explain import notation
from bisar_budget.theory import random_errors, render

T = 5.0


def bessel(n: int, x: float) -> mpmath.mpf:
    return mpmath.sqrt(mpmath.pi / (2 * x)) * mpmath.besselj(n + mpmath.mpf(1) / 2, x)


def spherical(x: np.ndarray) -> list[np.ndarray]:
    """j₀ … j₃ by their recurrence; below 0.3, where it cancels, by the first terms of their series."""
    j = [np.sin(x) / x, np.sin(x) / x**2 - np.cos(x) / x]
    for n in (1, 2):
        j.append((2 * n + 1) / x * j[n] - j[n - 1])
    for n, product in ((2, 15), (3, 105)):
        series = x**n / product * (1 - x**2 / (4 * n + 6) + x**4 / (8 * (2 * n + 3) * (2 * n + 5)))
        j[n] = np.where(x < 0.3, series, j[n])
    return j


@pytest.mark.parametrize("angle", [0.01, 0.1, 0.49, 0.5, 0.51, 1, 3, 10, 100])
def test_parts_of_a_tone_are_spherical_bessel_functions(angle: float) -> None:
    """On both sides of the series' end, to the 1e-8 that it leaves out."""
    quadratic, cubic, left, constant, linear = tone(angle)
    assert constant == pytest.approx(float(bessel(0, angle)), rel=2e-8, abs=1e-15)
    assert linear == pytest.approx(float(3 * bessel(1, angle)), rel=2e-8, abs=1e-15)
    assert quadratic == pytest.approx(float(7.5 * bessel(2, angle)), rel=2e-8)
    assert cubic == pytest.approx(float(17.5 * bessel(3, angle)), rel=2e-8)
    rest = mpmath.nsum(lambda n: (2 * n + 1) * bessel(int(n), angle) ** 2, [4, int(angle) + 60])
    assert left == pytest.approx(float(rest), rel=1e-7, abs=1e-15)


def test_a_power_law_has_the_constants_of_the_closed_form() -> None:
    """45/8, 75/16, 15π²/28, 25π²/32 and 5π⁴/28."""
    printed = (45 / 8, 75 / 16, 15 * math.pi**2 / 28, 25 * math.pi**2 / 32, 5 * math.pi**4 / 28)
    quadratic, cubic = evaluators.power_law_parts(1.0)
    assert quadratic == pytest.approx(printed, rel=1e-15)
    x = np.concatenate([np.geomspace(1e-8, 1, 40_000), np.linspace(1, 60 * math.pi, 2_000_000)])
    j_2, j_3 = spherical(x)[2:4]
    for constants, j, leading in ((quadratic, j_2, 7.5), (cubic, j_3, 17.5)):
        for slope, constant in enumerate(constants):
            whole = np.trapezoid(x**-slope * j**2, x) + (60 * math.pi) ** (-slope - 1) / (2 * (slope + 1))
            assert constant == pytest.approx(leading**2 * whole * math.pi ** (slope - 1), rel=2e-5)


@pytest.mark.parametrize("slope", range(5))
def test_the_numeric_integral_is_the_closed_form(slope: int) -> None:
    """To 1e-4, as far as the band lets it: white noise loses its part beyond 1 MHz, below 1e-6."""
    found = parts([PowerLawPiece(0.0, 1e6, 1.0, float(slope))], T)
    quadratic, cubic = evaluators.power_law_parts(T)
    assert found.quadratic == pytest.approx(quadratic[slope], rel=1e-4)
    assert found.cubic == pytest.approx(cubic[slope], rel=1e-4)


@pytest.mark.parametrize(("low", "high", "slope"), [(0.02, 0.3, 2.5), (0.3, 7.0, 1.0), (0.5, 900.0, 0.0)])
def test_a_piece_of_a_mask_is_integrated_to_1e_4(low: float, high: float, slope: float) -> None:
    found = parts([PowerLawPiece(low, high, 2.0, slope)], T)
    middle = min(high, 5.0)
    f = np.concatenate([np.geomspace(low, middle, 20_000), np.linspace(middle, high, 2_000_000)])
    x = math.pi * f * T
    j = spherical(x)
    density = 2 * f**-slope
    expected = [
        np.trapezoid(density * weight, f)
        for weight in (
            *((7.5 * j[2]) ** 2, (17.5 * j[3]) ** 2, 1 - sum((2 * n + 1) * j[n] ** 2 for n in range(4))),
            *(j[0] ** 2, (3 * j[1]) ** 2, -7.5 * j[0] * j[2], -52.5 * j[1] * j[3]),
        )
    ]
    assert found[:7] == pytest.approx(expected, rel=1e-4)
    assert not any(found[7:])  # of noise that no setting ties to the aperture


def test_many_aperture_times_at_once_are_each_alone() -> None:
    """Pieces from zero on, of each slope and ended below, within and beyond the panels; synchronised or not."""
    times = np.array([0.01, 0.5, 5.0, 300.0])
    pieces = [
        PowerLawPiece(0.0, 0.3, 1.0, 4.0),
        PowerLawPiece(0.3, 40.0, 2.0, 2.5),
        PowerLawPiece(40.0, 1e3, 1.0, 0.0),
    ]
    for integrate in (
        lambda T: parts(pieces, T),
        lambda T: synchronized_parts(pieces, T, 0.1),
        lambda T: link_parts(T, 0.1),
        lambda T: gauss_markov(T, 2.0),
    ):
        alone = np.array([integrate(float(T))[:7] for T in times]).T
        assert np.array(integrate(times)[:7]) == pytest.approx(alone, rel=1e-12)


def test_check_values_of_three_pairs_of_oscillators() -> None:
    """9.65 GHz, 5 s, one-sided a₄ … a₀ in dB: QPE 1.280, 0.424, 0.074 rad; ISLR by the cut at 1/T."""
    for own, levels, qpe, islr in (
        (10e6, (-95, -90, -200, -130, -155), 1.280, -13.2),
        (100e6, (None, -73, None, -104, -181), 0.424, -19.3),
        (10e6, (-120, -114, None, -134, -166), 0.074, -37.7),
    ):
        scale = (9.65e9 / own) ** 2
        pieces = [
            PowerLawPiece(0.0, 1e3, scale * 10 ** (level / 10), 4.0 - n)
            for n, level in enumerate(levels)
            if level is not None
        ]
        assert math.sqrt(2 * parts(pieces, T).quadratic) == pytest.approx(qpe, abs=5e-4)
        cut = 2 * sum(piece.integral(1 / T, 1e3) for piece in pieces)
        assert 10 * math.log10(cut) == pytest.approx(islr, abs=0.05)


def test_an_oscillator_leaves_what_is_beyond_the_cubic_and_no_more_than_the_cut() -> None:
    """1 - Σ(2n + 1)jₙ² is near 0 below two cycles per aperture, where the simple cut at one counts all."""
    found = parts([PowerLawPiece(0.0, 1e3, 1.0, 3.0)], T)
    assert found.left < PowerLawPiece(0.0, 1e3, 1.0, 3.0).integral(1 / T, 1e3)


def test_walks_have_the_moments_of_their_covariance() -> None:
    """√(5/224) of a velocity walk, 0.02739 of an angle walk; 0.020 rms is left after the quadratic."""
    k = 2 * math.pi  # a wavelength of 1 m
    rows = evaluators.inertial_phases(1.0, STANDARD_GRAVITY_MPS2, 1.0, 1.0, 1.0)
    velocity, angle = rows[4], rows[5]
    assert velocity[0] == pytest.approx(math.sqrt(5 / 224) * k, rel=1e-12)
    assert velocity[0] / k == pytest.approx(0.1494, abs=5e-5)
    assert angle[0] == pytest.approx(0.02739 * k * STANDARD_GRAVITY_MPS2, rel=2e-4)
    after_quadratic = math.hypot(velocity[2], velocity[1] * 2 / 5 / math.sqrt(7))
    assert after_quadratic / k == pytest.approx(0.020, abs=5e-4)
    assert velocity[1] * 2 / 5 / math.sqrt(7) > 0.7 * after_quadratic, "most of it is cubic"


def test_biases_are_the_taylor_terms() -> None:
    """k·b·T²/8, k·f_s·κ·T²/8, k·f_u·ψ·T²/8 and k·f_u·ε·T³/48, for T = 6 s and a wavelength of 3 cm."""
    k = 2 * math.pi / 0.03
    bias, scale, attitude, drift, *_ = evaluators.inertial_phases(1.0, 5.9, 2.3, 0.03, 6.0)
    assert bias == pytest.approx((k * 36 / 8, 0, 0))
    assert scale == pytest.approx((k * 2.3 * 36 / 8, 0, 0))
    assert attitude == pytest.approx((k * 5.9 * 36 / 8, 0, 0))
    assert drift == pytest.approx((0, k * 5.9 * 216 / 48, 0))


def test_figures_of_real_units_at_3_cm_and_6_s() -> None:
    """HG9900 0.23 rad by bias and 0.11 by velocity random walk, HG1700 9.2 and 0.15, STIM300 0.46 and 0.46."""
    rows = evaluators.inertial_phases(1.0, STANDARD_GRAVITY_MPS2, 1.0, 0.03, 6.0)
    for bias_ug, walk, expected in (
        (25, 0.0143, (0.23, 0.11)),
        (1000, 0.0198, (9.2, 0.15)),
        (50, 0.06, (0.46, 0.46)),
    ):
        assert bias_ug * 1e-6 * STANDARD_GRAVITY_MPS2 * rows[0][0] == pytest.approx(expected[0], rel=0.02)
        assert walk / 60 * rows[4][0] == pytest.approx(expected[1], rel=0.03)


@pytest.mark.parametrize("ratio", [0.01, 0.4, 0.499, 0.501, 2.0, 10.0, 300.0])
def test_a_gauss_markov_process_has_the_moments_of_its_covariance(ratio: float) -> None:
    """∫∫ Pₙ(s)Pₙ(t)exp(-a|s - t|), by a rule of its own; on both sides of the series' end."""
    found = gauss_markov(2 * ratio, 1.0)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    edges = np.concatenate([[0.0], np.geomspace(1e-3 / max(1, ratio), 2, 30)])  # of the lag, finer than it decays
    width, start = np.diff(edges)[:, None], edges[:-1, None]
    lag, by_lag = (start + width * (nodes + 1) / 2).ravel(), (width * weights / 2).ravel()
    early = -1 + np.outer(2 - lag, (nodes + 1) / 2)  # from -1 to 1 - lag
    squares = []
    for n in range(4):
        legendre = np.polynomial.legendre.Legendre.basis(n)
        together = (legendre(early) * legendre(early + lag[:, None])) @ weights * (2 - lag) / 2
        squares.append(((2 * n + 1) / 2) ** 2 * 2 * float(by_lag @ (np.exp(-ratio * lag) * together)))
    assert found.quadratic == pytest.approx(9 / 4 * squares[2], rel=1e-6)
    assert found.cubic == pytest.approx(25 / 4 * squares[3], rel=1e-6)
    assert found.left == pytest.approx(1 - sum(s / (2 * n + 1) for n, s in enumerate(squares)), rel=1e-5, abs=1e-12)


def test_check_value_of_gnss_noise() -> None:
    """6 s, 1 cm, 1.5 s: quadratic 11.28 mm, left after the cubic 4.88 mm."""
    found = gauss_markov(6.0, 1.5)
    assert 10 * math.sqrt(found.quadratic) == pytest.approx(11.28, abs=0.005)
    assert 10 * math.sqrt(found.left) == pytest.approx(4.88, abs=0.005)


@pytest.mark.parametrize("step", [0.3, 1.0, 5.0, 40.0])
def test_synchronisation_leaves_the_error_of_linear_interpolation(step: float) -> None:
    """The part of a tone that straight lines miss, by samples and by frequency: its own, and where it is folded."""
    part = (np.arange(20_000) + 0.5) / 20_000
    missed = np.mean(np.abs(np.exp(1j * step * part) - (1 - part) - part * np.exp(1j * step)) ** 2)
    y = random_errors.step
    assert float(random_errors.interpolated().subs(y, step)) == pytest.approx(missed, rel=1e-6)
    assert float(random_errors.passed().subs(y, step)) == pytest.approx(math.sqrt(held(step)), rel=1e-12)
    folded = sum(held(step + 2 * math.pi * m) for m in range(-4000, 4001) if m)
    assert (1 - math.sqrt(held(step))) ** 2 + folded == pytest.approx(missed, rel=1e-6)


def test_synchronisation_takes_slow_errors_and_adds_fast_ones() -> None:
    """x⁴/120 of slow tones; 5/3 of fast ones, which are folded."""
    y = random_errors.step
    assert float(random_errors.interpolated().subs(y, 0.05)) == pytest.approx(0.05**4 / 120, rel=1e-3)
    fast = lambdify(y, random_errors.interpolated())(np.linspace(1e3, 1e3 + 2 * math.pi, 30)[:-1])
    assert np.mean(fast) == pytest.approx(5 / 3, rel=1e-3)


def test_noise_of_the_link_is_two_thirds_of_each_exchange() -> None:
    """∫ 2σ²T_s·sinc⁴ df = ⅔σ²; a link faster than the aperture has no quadratic phase left."""
    interval = 0.1
    found = link_parts(6.0, interval)
    orders = found.quadratic * 4 / 9 / 5 + found.cubic * 4 / 25 / 7  # what they are of the mean square
    displaced = 2 * interval / (2 * 6.0) * (1 + 1 / 1)  # P₀ and P₁ of white noise: 2σ²T_s/2T each
    assert found.left + orders + displaced == pytest.approx(2 / 3, rel=2e-3)
    assert math.sqrt(found.quadratic) == pytest.approx(math.sqrt(11.25 * interval / 6.0), rel=0.02)


def test_what_is_explained_is_what_is_derived() -> None:
    printed = render.derivation("random", "text")
    found = [cell for symbol in ("b", "κ", "ψ", "ε", "N", "N_g") for cell in notation.inertial_phases(symbol) if cell]
    assert len(found) == 10
    assert all(cell in printed for cell in found)


def test_moments_are_exact_fractions() -> None:
    assert [str(part) for part in random_errors.walk(2)] == ["5/224", "35/3168", "1/6930"]
    assert [str(part) for part in random_errors.walk(3)] == ["355/473088", "175/247104", "1/540540"]
