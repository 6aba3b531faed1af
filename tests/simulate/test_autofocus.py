"""Autofocus against phase errors put on apertures by direct sums, in every kind of scene it may meet."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.simulator.autofocus import (
    aperture_band,
    map_drift,
    phase_gradient_autofocus,
)
from bisar_budget.simulator.image_formation import taylor_window
from bisar_budget.simulator.phase_history import cell_centres
from tests.conftest import examples


def options_id(options) -> str:
    return " ".join(f"{key}={getattr(value, '__name__', value)}" for key, value in options.items())


class Scene(NamedTuple):
    """Image, and the truth: bins of the aperture, phase over them, place in -1…1."""

    image: np.ndarray
    band: np.ndarray
    phase: np.ndarray
    place: np.ndarray


def scene(
    phase=lambda u: 0 * u,
    size=(256, 256),
    points: int = 60,
    ratio_db: float | None = 30.0,
    fill: float = 0.5,
    window=None,
    rows=None,
    carrier: float = 0.0,
    seed: int = 1,
) -> Scene:
    """Points anywhere between samples in white clutter, each a plane wave over the aperture.

    `ratio_db` is the power at the peak of an error-free point over the mean power of the clutter in the image,
    both through the same aperture; None leaves the clutter out.
    """
    rng = np.random.default_rng(seed)
    nx, ny = size
    count = round(ny * fill / 2) * 2
    weights = np.ones(count) if window is None else window(count)
    bins = np.arange(count) - count // 2
    aperture = np.zeros((nx, count), dtype=complex)
    for row in rng.choice(np.arange(nx) if rows is None else rows, points):
        wave = np.exp(2j * math.pi * (rng.random() - bins * rng.uniform(0.1, 0.9)))
        aperture[row] += weights * wave / weights.sum()
    if ratio_db is not None:
        noise = rng.normal(size=aperture.shape) + 1j * rng.normal(size=aperture.shape)
        aperture += noise * weights * math.sqrt(10 ** (-ratio_db / 10) / 2 / np.sum(weights**2))
    place = cell_centres(2.0, count)
    band = (bins + round(carrier * ny)) % ny
    spectrum = np.zeros(size, dtype=complex)
    spectrum[:, band] = aperture * np.exp(1j * phase(place))
    return Scene(np.fft.ifft(spectrum, axis=1) * ny, band, phase(place), place)


def textured(phase, seed: int = 2) -> Scene:
    """No points: clutter whose mean power differs by 26 dB between patches of 16 by 8 cells."""
    rng = np.random.default_rng(seed)
    strength = np.where(rng.random((32, 32)) < 0.2, 1.0, 0.05).repeat(16, axis=0).repeat(8, axis=1)
    reflectivity = strength * (rng.normal(size=strength.shape) + 1j * rng.normal(size=strength.shape))
    count = reflectivity.shape[1]
    place = cell_centres(2.0, count)
    band = (np.arange(count) - count // 2) % (2 * count)
    spectrum = np.zeros((strength.shape[0], 2 * count), dtype=complex)
    spectrum[:, band] = np.fft.fftshift(np.fft.fft(reflectivity, axis=1), axes=1) * np.exp(1j * phase(place))
    return Scene(np.fft.ifft(spectrum, axis=1), band, phase(place), place)


def rms(place, phase) -> float:
    """Of what is left without constant and linear part. [rad]"""
    left = phase - np.polyval(np.polyfit(place, phase, 1), place)
    return float(np.sqrt(np.mean(left**2)))


def residual(s: Scene, focused) -> float:
    return rms(s.place, s.phase - focused.phase[s.band])


def quadratic(u):
    return 4.6 * u**2


def smooth(seed: int, size: float = 2.0):
    """Random phase of up to six turns over the aperture."""
    rng = np.random.default_rng(seed)
    terms = [(size * rng.normal() / (1 + n / 4), math.pi / 2 * n) for n in range(2, 12)]
    return lambda u: sum(a * np.cos(w * (u + 1)) for a, w in terms)


class TestPhaseGradient:
    def test_converges_on_a_large_scene(self) -> None:
        """The point: 4.6 rad at the aperture's edge, 30 dB, below 0.1 rad rms; 1.37 before."""
        s = scene(quadratic, size=(1024, 1024), points=200)
        focused = phase_gradient_autofocus(s.image)
        assert rms(s.place, s.phase) > 1.3
        # 64 lines, ±12 cells of clutter: √(24 / (2 · 64 · 1000)) = 0.014.
        assert residual(s, focused) < 0.03
        want = np.zeros(1024)
        want[s.band] = focused.phase[s.band]
        by_hand = np.fft.ifft(np.fft.fft(s.image, axis=1) * np.exp(-1j * want), axis=1)
        assert np.abs(focused.image - by_hand).max() < 1e-12

    @pytest.mark.parametrize(
        "options",
        [
            {"fill": 1.0},
            {"window": taylor_window},
            {"window": taylor_window, "fill": 1.0},
            {"carrier": 0.4},
            {"carrier": -0.5},
            {"points": 1000},
            # Where two of so few fall into one window, 0.1 to 0.3 rad stay (seeds 1, 2, 5, 7); here none do.
            {"points": 12, "rows": [100, 101, 102], "size": (256, 1024), "seed": 3},
            {"ratio_db": 20.0},
            {"ratio_db": None},
            {"size": (301, 271), "fill": 0.7},
            {"size": (64, 512)},
        ],
        ids=options_id,
    )
    @pytest.mark.parametrize(
        "phase", [quadratic, lambda u: -quadratic(u), lambda u: 6 * u**3], ids=["quadratic", "negative", "cubic"]
    )
    def test_scenes(self, options, phase) -> None:
        s = scene(phase, **options)
        assert residual(s, phase_gradient_autofocus(s.image)) < 0.1

    @pytest.mark.parametrize(
        "phase",
        [smooth(3), smooth(4), smooth(5), lambda u: 1.5 * np.cos(20 * u), lambda u: 30 * u**2, lambda u: 60 * u**2],
        ids=["random 3", "random 4", "random 5", "sinusoid", "30 rad", "60 rad"],
    )
    def test_shapes(self, phase) -> None:
        s = scene(phase, size=(512, 1024), points=200)
        assert residual(s, phase_gradient_autofocus(s.image)) < 0.1

    @given(seed=st.integers(0, 2**32 - 1), size=st.floats(0.1, 1.5))
    @examples(12, default=4)
    def test_random_phases_in_random_scenes(self, seed: int, size: float) -> None:
        s = scene(smooth(seed, size), seed=seed)
        assert residual(s, phase_gradient_autofocus(s.image)) < 0.1

    @pytest.mark.parametrize("points", [1, 2, 3, 5])
    def test_few_points(self, points: int) -> None:
        """√(24 / (2 · points · 1000)) is 0.11 rad for one point: the clutter in its window, nothing else."""
        for seed in (1, 2, 3):
            s = scene(quadratic, points=points, seed=seed)
            bound = math.sqrt(24 / (2 * points * 1000))
            assert residual(s, phase_gradient_autofocus(s.image)) < 1.6 * bound

    @pytest.mark.parametrize("fill", [0.5, 1.0])
    @pytest.mark.parametrize("phase", [quadratic, lambda u: 3 * u**3], ids=["quadratic", "cubic"])
    def test_one_point_and_nothing_else(self, phase, fill: float) -> None:
        """Its own far sidelobes pass for clutter; what they hide lies in the last 3 % of the aperture."""
        s = scene(phase, points=1, ratio_db=None, fill=fill)
        focused = phase_gradient_autofocus(s.image)
        assert residual(s, focused) < 0.15

    def test_one_range_line(self) -> None:
        s = scene(quadratic, size=(1, 1024), points=2, ratio_db=40.0, seed=2)  # 160 samples apart
        assert residual(s, phase_gradient_autofocus(s.image)) < 0.1

    @pytest.mark.parametrize("seed", range(4))
    @pytest.mark.parametrize("window", [None, taylor_window])
    def test_clutter_alone_gives_no_phase(self, seed: int, window) -> None:
        s = scene(quadratic, points=0, seed=seed, window=window)
        focused = phase_gradient_autofocus(s.image)
        assert not focused.phase.any()
        assert np.array_equal(focused.image, s.image)

    def test_a_sharp_image_stays_sharp(self) -> None:
        s = scene(points=60)
        focused = phase_gradient_autofocus(s.image)
        assert rms(s.place, focused.phase[s.band]) < 0.03

    def test_focusing_twice_changes_nothing_more(self) -> None:
        s = scene(quadratic)
        once = phase_gradient_autofocus(s.image)
        twice = phase_gradient_autofocus(once.image)
        assert rms(s.place, twice.phase[s.band]) < 0.02

    def test_scale_does_not_matter(self) -> None:
        s = scene(quadratic)
        want = phase_gradient_autofocus(s.image).phase
        for scale in (1e-12, -3j, 1e9):
            assert phase_gradient_autofocus(scale * s.image).phase == pytest.approx(want, abs=1e-6)

    def test_the_input_is_left_alone(self) -> None:
        s = scene(quadratic)
        before = s.image.copy()
        phase_gradient_autofocus(s.image)
        assert np.array_equal(s.image, before)


def of(quadratic_rad: float, cubic_rad: float):
    return lambda u: quadratic_rad * u**2 + cubic_rad * u**3


class TestMapDrift:
    @given(q=st.floats(-12, 12), c=st.floats(-6, 6))
    @examples(10, default=4)
    def test_points(self, q: float, c: float) -> None:
        s = scene(of(q, c))
        assert residual(s, map_drift(s.image, 3)) < 0.03
        s = scene(of(q, 0))
        assert residual(s, map_drift(s.image)) < 0.03

    @given(q=st.floats(-12, 12), c=st.floats(-6, 6))
    @examples(4)
    def test_textured_clutter(self, q: float, c: float) -> None:
        """Speckle of the sub-apertures is independent: the patches' edges alone tell, less precisely."""
        s = textured(of(q, c))
        assert residual(s, map_drift(s.image, 3)) < 0.15
        s = textured(of(q, 0))
        assert residual(s, map_drift(s.image)) < 0.1

    @pytest.mark.parametrize(
        "options",
        [{"fill": 1.0}, {"window": taylor_window}, {"carrier": 0.5}, {"points": 1, "ratio_db": None}],
        ids=options_id,
    )
    def test_apertures(self, options) -> None:
        s = scene(of(-7, 4), **options)
        assert residual(s, map_drift(s.image, 3)) < 0.03

    def test_two_sub_apertures_do_not_see_a_cubic(self) -> None:
        s = scene(of(0, 5))
        focused = map_drift(s.image)
        # u³ less its straight line 3u/5 has √(1/7 - 9/75) of its edge value, all of which stays.
        assert residual(s, focused) == pytest.approx(5 * math.sqrt(1 / 7 - 9 / 75), rel=0.01)

    @pytest.mark.parametrize("sub_apertures", [2, 3])
    def test_homogeneous_clutter_gives_no_phase(self, sub_apertures: int) -> None:
        s = scene(quadratic, points=0)
        focused = map_drift(s.image, sub_apertures)
        assert not focused.phase.any()
        assert np.abs(focused.image - s.image).max() < 1e-12

    def test_phase_gradient_agrees(self) -> None:
        s = scene(of(5, -3), points=200)
        difference = map_drift(s.image, 3).phase - phase_gradient_autofocus(s.image).phase
        # Neighbours in the windows of phase gradient autofocus, two points per line of 128 cells.
        assert rms(s.place, difference[s.band]) < 0.08

    @pytest.mark.parametrize("sub_apertures", [0, 1, 4])
    def test_other_numbers_of_sub_apertures(self, sub_apertures: int) -> None:
        with pytest.raises(ValueError, match=f"2 or 3 sub-apertures .got {sub_apertures}"):
            map_drift(scene().image, sub_apertures)


@pytest.mark.parametrize("algorithm", [phase_gradient_autofocus, map_drift])
class TestInput:
    def test_a_zero_image(self, algorithm) -> None:
        focused = algorithm(np.zeros((32, 64), dtype=complex))
        assert not focused.phase.any()
        assert not focused.image.any()

    @pytest.mark.parametrize("bad", [math.nan, math.inf, complex(0, math.nan)])
    def test_not_a_number(self, algorithm, bad) -> None:
        image = scene().image.copy()
        image[3, 5] = bad
        with pytest.raises(ValueError, match="1 are NaN or infinite"):
            algorithm(image)

    @pytest.mark.parametrize("shape", [(64,), (4, 8), (0, 64), (2, 3, 64)])
    def test_shapes(self, algorithm, shape) -> None:
        with pytest.raises(ValueError, match="at least 1 x 16"):
            algorithm(np.zeros(shape, dtype=complex))


class TestApertureBand:
    @given(start=st.integers(0, 99), count=st.integers(10, 90))
    def test_wherever_it_lies(self, start: int, count: int) -> None:
        want = (start + np.arange(count)) % 100
        spectrum = np.zeros((3, 100), dtype=complex)
        spectrum[:, want] = 1
        assert np.array_equal(aperture_band(spectrum), want)

    def test_a_full_band_is_centred(self) -> None:
        assert aperture_band(np.ones((2, 16)))[0] == 8
