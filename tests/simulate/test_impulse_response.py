"""Measures of point responses against quadrature, the literature, and perseo-quality."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.simulator.image_formation import taylor_window
from bisar_budget.simulator.impulse_response import (
    impulse_response,
    line_at,
    row_of_peak,
    upsampled,
)
from bisar_budget.simulator.phase_history import cell_centres
from tests.conftest import examples

APERTURE = 256  # samples
OVERSAMPLING = 8  # of a cut
CHIP, CHIP_BAND = 96, 38  # pixels and aperture samples of a chip: 2.5 pixels per cell, 38 cells


def response(quadratic: float = 0.0, window=None):
    """Cut of an aperture with a quadratic phase at its edge; spacing in resolution cells."""
    place = cell_centres(2.0, APERTURE)
    padded = np.zeros(APERTURE * OVERSAMPLING, dtype=complex)
    padded[:APERTURE] = np.exp(1j * quadratic * place**2) * (1.0 if window is None else window) / APERTURE
    return np.fft.fftshift(np.fft.fft(padded)), 1 / OVERSAMPLING


def by_quadrature(quadratic: float, window, null: float) -> tuple[float, float]:
    """PSLR and ISLR outside a null [dB]: the aperture's integral at points that include the null itself.

    The energy is that of the periodic response of the sampled aperture, which Parseval gives.
    """
    place = cell_centres(2.0, APERTURE)
    aperture = np.exp(1j * quadratic * place**2) * window / APERTURE

    def power(cells):
        return np.abs(np.exp(1j * math.pi * np.outer(cells, place)) @ aperture) ** 2

    nodes, weights = np.polynomial.legendre.leggauss(48)
    mainlobe = null * float(weights @ power(null * nodes))
    sidelobe = float(power(np.linspace(null, null + 12, 6001)).max())
    energy = APERTURE * float(np.sum(np.abs(aperture) ** 2))
    return 10 * math.log10(sidelobe / power([0.0])[0]), 10 * math.log10((energy - mainlobe) / mainlobe)


def first_null(window) -> float:
    """In cells, by bisection of the real error-free response."""
    place = cell_centres(2.0, APERTURE)
    low, high = 0.5, 3.0
    cells = np.linspace(low, high, 26)
    value = [float(np.cos(math.pi * c * place) @ window) for c in cells]
    first = next(i for i in range(25) if value[i + 1] < 0)
    low, high = cells[first], cells[first + 1]
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if np.cos(math.pi * middle * place) @ window > 0 else (low, middle)
    return low


class TestOneCut:
    @pytest.mark.parametrize(
        ("quadratic", "width", "loss", "pslr", "islr"),
        [
            (0, 1, 0, -13.26, -9.68),
            (math.pi / 8, 1.003, -0.06, -12.94, -9.38),
            (math.pi / 4, 1.013, -0.24, -12.04, -8.57),
            (math.pi / 2, 1.061, -0.97, -9.04, -6.23),
            (math.pi, 2.97, -4.04, -2.18, -1.53),
        ],
    )
    def test_uniform_aperture_with_quadratic_phase(self, quadratic, width, loss, pslr, islr) -> None:
        """By Gauss quadrature of the continuous aperture, outside this project; energy out to infinity.

        The tolerances are half of the last digit given, plus the sampling's. At π two equal peaks have formed
        and half power is where they end.
        """
        clean_cut, spacing = response()
        clean = impulse_response(clean_cut, spacing)
        got = impulse_response(response(quadratic)[0], spacing, mask_m=clean.mask_m)
        assert got.irw_m / clean.irw_m == pytest.approx(width, abs=0.006 if quadratic == math.pi else 0.001)
        assert 20 * math.log10(got.peak / clean.peak) == pytest.approx(loss, abs=0.006)
        assert got.pslr_db == pytest.approx(pslr, abs=0.01)
        assert got.islr_db == pytest.approx(islr, abs=0.01)

    @pytest.mark.parametrize(
        ("quadratic", "pslr"), [(math.pi / 8, -28.90), (math.pi / 4, -22.79), (math.pi / 2, -16.46)]
    )
    def test_taylor_shoulder_at_the_exact_null(self, quadratic: float, pslr: float) -> None:
        """The highest sidelobe is the shoulder at the mask's edge: 0.25 dB for 1 % of the mask."""
        window = taylor_window(APERTURE)
        clean_cut, spacing = response(0.0, window)
        mask = impulse_response(clean_cut, spacing).mask_m
        got = impulse_response(response(quadratic, window)[0], spacing, mask_m=mask)
        assert got.pslr_db == pytest.approx(pslr, abs=0.02)

    @given(quadratic=st.floats(-math.pi, math.pi), tapered=st.booleans())
    @examples(12, default=6)
    def test_quadrature_says_the_same(self, quadratic: float, tapered: bool) -> None:
        window = taylor_window(APERTURE) if tapered else np.ones(APERTURE)
        null = first_null(window)
        cut, spacing = response(quadratic, window)
        got = impulse_response(cut, spacing, mask_m=null)
        if abs(got.peak_m) > 0.02:  # beyond 2.6 rad the uniform response splits, and its peak leaves the middle
            return
        pslr, islr = by_quadrature(quadratic, window, null)
        top = abs(upsampled(cut, 32)).max()
        middle = abs(cut[cut.size // 2])
        # The mask's place is good to 0.001 cells, worth 0.02 dB on a shoulder's slope.
        assert got.pslr_db + 20 * math.log10(top / middle) == pytest.approx(pslr, abs=0.02)
        assert got.islr_db == pytest.approx(islr, abs=0.02)

    def test_null_search_finds_the_exact_null(self) -> None:
        for window in (np.ones(APERTURE), taylor_window(APERTURE)):
            cut, spacing = response(0.0, window)
            # A parabola through three samples 1/256 of a cell apart.
            assert impulse_response(cut, spacing).mask_m == pytest.approx(first_null(window), abs=2e-4)

    def test_raised_cosine(self) -> None:
        """Harris 1978, Table I, Hann (α = 2): highest sidelobe -32 dB (31.47 exactly), 3 dB width 1.44 bins."""
        cut, spacing = response(0.0, 1 + np.cos(math.pi * cell_centres(2.0, APERTURE)))
        got = impulse_response(cut, spacing)
        assert got.pslr_db == pytest.approx(-31.47, abs=0.01)
        assert got.irw_m == pytest.approx(1.44, abs=0.005)
        assert got.mask_m == pytest.approx(2.0, abs=1e-3)

    def test_hamming(self) -> None:
        """Harris 1978, Table I: -43 dB (0.54, 0.46), 3 dB width 1.30 bins."""
        cut, spacing = response(0.0, 0.54 + 0.46 * np.cos(math.pi * cell_centres(2.0, APERTURE)))
        got = impulse_response(cut, spacing)
        assert got.pslr_db == pytest.approx(-43, abs=0.5)
        assert got.irw_m == pytest.approx(1.30, abs=0.005)

    @given(shift=st.floats(-3, 3))
    @examples(20, default=6)
    def test_a_shift_moves_only_the_peak(self, shift: float) -> None:
        cut, spacing = response(1.0)
        frequency = np.fft.fftfreq(cut.size, spacing)
        moved = np.fft.ifft(np.fft.fft(cut) * np.exp(-2j * math.pi * frequency * shift))
        still, got = impulse_response(cut, spacing, mask_m=1.0), impulse_response(moved, spacing, mask_m=1.0)
        assert got.peak_m == pytest.approx(shift, abs=1e-3)
        assert got.pslr_db == pytest.approx(still.pslr_db, abs=0.01)
        assert got.islr_db == pytest.approx(still.islr_db, abs=0.01)
        assert got.peak == pytest.approx(still.peak, rel=1e-5)

    def test_reach_leaves_far_sidelobes_out(self) -> None:
        cut, spacing = response()
        whole = impulse_response(cut, spacing)
        near = impulse_response(cut, spacing, reach_m=10 * whole.irw_m)
        # ∫ sinc² beyond a is 1/(π² a), both sides; of the mainlobe's 0.9028.
        beyond = 1 / (math.pi**2 * 10 * whole.irw_m) / 0.90282
        assert 10 ** (whole.islr_db / 10) - 10 ** (near.islr_db / 10) == pytest.approx(beyond, rel=0.03)
        with pytest.raises(ValueError, match="cut ends within 200 m"):
            impulse_response(cut, spacing, reach_m=200.0)

    @pytest.mark.parametrize("bad", [math.nan, math.inf])
    def test_no_numbers_no_measures(self, bad: float) -> None:
        cut, spacing = response()
        cut[7] = bad
        with pytest.raises(ValueError, match="NaN or infinity"):
            impulse_response(cut, spacing)

    def test_an_empty_cut(self) -> None:
        with pytest.raises(ValueError, match="all zero"):
            impulse_response(np.zeros(64, dtype=complex), 1.0)

    @pytest.mark.parametrize("at", [0, 1, -1, -2])
    def test_a_peak_at_the_edge(self, at: int) -> None:
        cut, spacing = response()
        with pytest.raises(ValueError, match=r"edge of the cut|at its edge"):
            impulse_response(np.roll(cut, cut.size // 2 + at), spacing)


def chip(place=(0.0, 0.0), quadratic: float = 0.0, windows=(None, None), carrier=(0, 0), skew: float = 0.0):
    """Response from its aperture, direct sum: pixels of 0.4 cells, peak off the middle by pixels.

    `skew` shears the aperture, by cells of cross-range frequency per range frequency.
    """
    bins = np.arange(CHIP_BAND) - (CHIP_BAND - 1) / 2
    edge = 2 * bins / CHIP_BAND
    weights = [np.ones(CHIP_BAND) if w is None else w for w in windows]
    aperture = np.outer(weights[0], weights[1] * np.exp(1j * quadratic * edge**2)) / CHIP_BAND**2
    pixel = np.arange(CHIP) - CHIP // 2
    angle = 2j * math.pi / CHIP
    along = np.exp(angle * np.outer(pixel - place[0], bins + carrier[0]))
    image = np.zeros((CHIP, CHIP), dtype=complex)
    for k, b in enumerate(bins):
        across = np.exp(angle * np.outer(pixel - place[1], bins + carrier[1] + skew * b))
        image += np.outer(along[:, k], across @ aperture[k])
    return image, 0.4 * CHIP_BAND / CHIP / 0.4


class TestChip:
    @pytest.mark.parametrize("place", [(0.5, 0.2), (-0.45, -7.4), (3.3, 0.5), (-30.5, 41.4)])
    def test_a_line_goes_through_a_peak_between_lines_of_pixels(self, place) -> None:
        """Half a pixel beside the peak a line of pixels is sinc(0.2), 0.58 dB, too low: `simulate` measured that."""
        image, _ = chip(place, skew=0.5)
        row = row_of_peak(image)
        line = line_at(image, row)
        assert row == pytest.approx(CHIP // 2 + place[0], abs=5e-3)
        assert np.abs(upsampled(line, 32)).max() == pytest.approx(1.0, abs=2e-3)  # a chip does not repeat
        start = CHIP // 2 + round(place[1]) - 12
        row = row_of_peak(image, (slice(None), slice(start, start + 25)))
        assert row == pytest.approx(CHIP // 2 + place[0], abs=5e-3)
        part = line_at(image[:, start : start + 25], row)
        assert part == pytest.approx(line[start : start + 25], abs=5e-3)


@pytest.mark.extras
class TestAgainstPerseo:
    """perseo-quality 1.1 counts sidelobes to 5 (PSLR) and 10 (ISLR) half-power widths, outside the nulls it finds.

    It takes samples as they are, hence an image interpolated beforehand; whole pixels at the mask's edges and its
    width interpolated in dB leave some hundredths of a dB.
    """

    @pytest.mark.parametrize("quadratic", [0.0, math.pi / 4, math.pi / 2])
    @pytest.mark.filterwarnings("ignore")
    def test_like_with_like(self, quadratic: float) -> None:
        irf = pytest.importorskip(
            "perseo_quality.point_targets_analysis.core.irf", reason="a yardstick with heavy dependencies, optional"
        )
        processing = pytest.importorskip("perseo_quality.core.signal_processing")
        masking = pytest.importorskip("perseo_quality.core.generic_dataclasses")
        image, spacing = chip((0.0, 0.0), quadratic)
        fine = upsampled(upsampled(image, 32).T, 32).T  # its mask ends at whole pixels, each 0.05 dB of ISLR
        row, column = np.unravel_index(np.argmax(np.abs(fine)), fine.shape)
        pixels = (
            processing.evaluate_irf_resolution(fine[:, column]),
            processing.evaluate_irf_resolution(fine[row]),
        )
        ours = impulse_response(image[CHIP // 2], spacing)
        assert pixels[1] * spacing / 32 == pytest.approx(ours.irw_m, rel=2e-3)
        mask = masking.MaskingMethod.PEAK
        _, pslr, _ = irf.compute_pslr_2d(fine, pixels, mask)
        _, islr, _ = irf.compute_islr_2d(fine, pixels, mask)
        near, far = (impulse_response(image[CHIP // 2], spacing, reach_m=n * ours.irw_m) for n in (5, 10))
        assert near.pslr_db == pytest.approx(pslr, abs=0.02)
        assert far.islr_db == pytest.approx(islr, abs=0.05)

    @pytest.mark.filterwarnings("ignore")
    def test_uniform_aperture(self) -> None:
        """-13.26 and -10.21 dB on a sinc, where the whole cut has -9.68 dB."""
        irf = pytest.importorskip(
            "perseo_quality.point_targets_analysis.core.irf", reason="a yardstick with heavy dependencies, optional"
        )
        peak = pytest.importorskip("perseo_quality.core.generic_dataclasses").MaskingMethod.PEAK
        place = np.arange(-480, 481) / 40
        width = 0.88589 * 40, 0.88589 * 40
        sinc = np.outer(np.sinc(place), np.sinc(place)).astype(complex)
        _, pslr, _ = irf.compute_pslr_2d(sinc, width, peak)
        _, islr, _ = irf.compute_islr_2d(sinc, width, peak)
        cut, spacing = response()
        near, far = (impulse_response(cut, spacing, reach_m=n * 0.88589) for n in (5, 10))
        assert (pslr, islr) == pytest.approx((-13.26, -10.21), abs=0.02)
        assert (near.pslr_db, far.islr_db) == pytest.approx((pslr, islr), abs=0.02)
