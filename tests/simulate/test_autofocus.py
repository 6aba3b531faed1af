"""Autofocus against phase errors put on apertures by direct sums, in every kind of scene it may meet."""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.simulator.autofocus import (
    aperture_band,
    autofocus_in_scene_axes,
    map_drift,
    phase_gradient_autofocus,
    rotated,
    scene_axes,
)
from bisar_budget.simulator.image_formation import backprojection, ground_grid, taylor_window
from bisar_budget.simulator.impulse_response import upsampled
from bisar_budget.simulator.phase_history import cell_centres
from tests.conftest import examples
from tests.simulate.conftest import Collection, collection


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


def plane_waves(grid, look_azimuth: float, points, amplitudes, spacing: float, phase):
    """Image of points on any grid from a tapered band, 0.45 of the sampling, square in the rotated frame."""
    count = 57  # 0.45 of 128
    frequency = (np.arange(count) - count // 2) / 128 / spacing
    turn = taylor_window(count) * np.exp(1j * phase(cell_centres(2.0, count)))
    axes = np.array(
        [[math.cos(look_azimuth), math.sin(look_azimuth)], [-math.sin(look_azimuth), math.cos(look_azimuth)]]
    )
    pixels = grid[..., :2].reshape(-1, 2) @ axes.T
    targets = np.asarray(points) @ axes.T
    along, across = (
        np.exp(2j * math.pi * np.outer(pixels[:, axis], frequency))
        @ (shape[:, None] * np.exp(-2j * math.pi * np.outer(frequency, targets[:, axis])))
        for axis, shape in enumerate((taylor_window(count), turn))
    )
    return ((along * across) @ amplitudes).reshape(grid.shape[:2]) / count**2


def peak(image) -> float:
    return float(np.abs(upsampled(upsampled(image, 4).T, 4)).max())


class TestSceneAxes:
    SIDE, SPACING = 128, 0.5

    @classmethod
    @cache
    def images(cls, look_azimuth: float) -> list[np.ndarray]:
        """In the scene's axes and in the rotated ones; and there without a phase error."""
        rng = np.random.default_rng(8)
        points = rng.uniform(-16, 16, (8, 2))
        amplitudes = np.exp(2j * math.pi * rng.random(8))
        size, shape = (cls.SIDE * cls.SPACING,) * 2, (cls.SIDE,) * 2
        found = [
            plane_waves(ground_grid((0, 0), azimuth, size, shape), look_azimuth, points, amplitudes, cls.SPACING, f)
            for azimuth, f in ((0.0, quadratic), (look_azimuth, quadratic), (look_azimuth, lambda u: 0 * u))
        ]
        for one in found:
            one.setflags(write=False)
        return found

    @pytest.mark.parametrize("look_azimuth", [0.0, 0.3, math.pi / 4, 1.1, 2.5, -2.0, math.pi, -math.pi / 2])
    def test_rotation_is_the_image_formed_there(self, look_azimuth: float) -> None:
        """Exact but for what leaves the image at its border: -40 dB of the peak within the middle half."""
        in_scene, formed, _ = self.images(look_azimuth)
        turned = rotated(in_scene, look_azimuth)
        middle = turned.shape[0] // 2
        got = turned[middle - 32 : middle + 32, middle - 32 : middle + 32]
        assert np.abs(got - formed[32:96, 32:96]).max() < 0.01 * np.abs(formed).max()
        back = scene_axes(turned, look_azimuth, self.SIDE)
        assert back[32:96, 32:96] == pytest.approx(in_scene[32:96, 32:96], abs=1e-3)

    @pytest.mark.parametrize("look_azimuth", [0.3, math.pi / 4, 1.1, 2.5, -2.0])
    @pytest.mark.parametrize("algorithm", [phase_gradient_autofocus, map_drift])
    def test_same_phase_and_peak_as_the_image_formed_there(self, look_azimuth: float, algorithm) -> None:
        in_scene, formed, clean = self.images(look_azimuth)
        got, want = autofocus_in_scene_axes(in_scene, look_azimuth, algorithm), algorithm(formed)
        frequency = np.fft.fftfreq(got.phase.size)
        inside = np.abs(frequency) < 0.45 / 2 * 0.97
        there = np.interp(frequency[inside], np.fft.fftfreq(self.SIDE), want.phase, period=1.0)
        assert rms(frequency[inside], got.phase[inside] - there) < 0.05
        assert 20 * math.log10(peak(got.image) / peak(want.image)) == pytest.approx(0, abs=0.2)
        assert 20 * math.log10(peak(got.image) / peak(clean)) == pytest.approx(0, abs=0.2)

    def test_refusals(self) -> None:
        with pytest.raises(ValueError, match=r"square image \(got shape \(16, 32\)\)"):
            autofocus_in_scene_axes(np.ones((16, 32), dtype=complex), 0.3)
        with pytest.raises(ValueError, match="finite angle"):
            autofocus_in_scene_axes(np.ones((32, 32), dtype=complex), math.nan)


def test_section_vi_on_backprojected_images() -> None:
    """Points in a backprojected image with the carrier taken out, focused in (x, y) as in (x′, y′)."""
    c: Collection = collection(pulses=160, frequencies=96)
    points = np.array([[4.0, -7.0, 0.0], [-9.0, 5.0, 0.0], [6.0, 10.0, 0.0]])
    history = c.record(points, [1, 1j, -1])
    history.samples[:] *= np.exp(1j * quadratic(cell_centres(2.0, 160)))[:, None]
    look, size, shape = c.geometry.look_azimuth, (48.0, 48.0), (192, 192)

    def image(azimuth: float):
        grid = ground_grid((0.0, 0.0), azimuth, size, shape)
        total = np.zeros(shape)
        for state in (c.geometry.transmitter, c.geometry.receiver):
            total += np.linalg.norm(grid - np.asarray(state.position), axis=-1)
        return backprojection(history, grid) * np.exp(-2j * math.pi / c.wavelength * total)

    here, there = autofocus_in_scene_axes(image(0.0), look), phase_gradient_autofocus(image(look))
    assert 20 * math.log10(peak(here.image) / peak(there.image)) == pytest.approx(0, abs=0.2)
    assert 20 * math.log10(peak(here.image)) == pytest.approx(0, abs=0.3)
    assert peak(image(look)) < 0.7
