"""The far-field filter against its own sum and the exact one; the polar format against the Dirichlet kernel (16)."""

import importlib.util
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.geometry import BistaticGeometry, PlatformState
from bisar_budget.simulator.far_field import far_field_filter, polar_format
from bisar_budget.simulator.image_formation import backprojection, ground_grid, matched_filter
from bisar_budget.simulator.phase_history import PathError, look_sum
from tests.conftest import examples
from tests.simulate.conftest import Collection, collection, measured_phase

pytestmark = pytest.mark.extras
needs_finufft = pytest.mark.skipif(
    importlib.util.find_spec("finufft") is None, reason="the NUFFT needs finufft, extra fast"
)


@pytest.fixture
def plane_waves() -> Collection:
    """A hundred thousand kilometres away: ranges over a hundred metres bend by 10⁻⁴ m, (5) is exact."""
    state = PlatformState(position=(9e7, 0, 2e7), velocity=(0, 2e5, 0))
    other = PlatformState(position=(8e7, 3e7, 3e7), velocity=(-1e5, 2e5, 0))
    return Collection(BistaticGeometry(transmitter=state, receiver=other), pulses=64, frequencies=48, bandwidth=30e6)


class TestFarFieldFilter:
    @needs_finufft
    @pytest.mark.parametrize("height", [0.0, 7.0, None])
    def test_nufft_is_the_sum(self, height) -> None:
        c = collection(30, pulses=48, frequencies=40)
        history = c.record([[1.0, -1.3, 0], [4, 2, 1]], [1, 0.5j])
        points = ground_grid((1500.0, -900.0), 0.3, (30, 20), (23, 14))
        points[..., 2] = points[..., 0] * 0.1 if height is None else height
        want = far_field_filter(history, points, "direct")
        assert np.abs(far_field_filter(history, points, "nufft") - want).max() < 1e-6  # -120 dB of amplitude 1

    def test_the_sum_is_7_at_one_pixel(self) -> None:
        """By hand, with the frequencies (8)."""
        c = collection(20, pulses=3, frequencies=2)
        history = c.record([2.0, 1.0, 0.0])
        x, y, z = 3.0, -4.0, 0.5
        total = 0j
        for k in range(3):
            angles = []
            for p in (history.transmitter[k], history.receiver[k]):
                angles.append((math.atan2(p[1], p[0]), math.asin(p[2] / math.hypot(*p))))
            for i, f in enumerate(history.frequency):
                fx = f / 2 * sum(math.cos(a) * math.cos(e) for a, e in angles)
                fy = f / 2 * sum(math.sin(a) * math.cos(e) for a, e in angles)
                fz = f / 2 * sum(math.sin(e) for _, e in angles)
                turn = -4 * math.pi / SPEED_OF_LIGHT_MPS * (x * fx + y * fy + z * fz)
                total += history.samples[k, i] * complex(math.cos(turn), math.sin(turn))
        assert far_field_filter(history, np.array([x, y, z])) == pytest.approx(total / 6, abs=1e-6)

    @given(x=st.floats(-3, 3), y=st.floats(-3, 3), squint=st.floats(-60, 60))
    @examples(12)
    def test_near_the_scene_centre_it_is_the_matched_filter(self, x, y, squint) -> None:
        """What (5) drops is at most |x|²/2R on each leg; that phase bounds the difference."""
        c = collection(squint, pulses=16, frequencies=8)
        history = c.record([0.0, 0.0, 0.0])
        point = np.array([x, y, 0.0])
        dropped = (x * x + y * y) / 2 * (1 / 30.9e3 + 1 / 8.4e3)  # ranges at the ends of the aperture or above
        bound = 2 * math.pi * 10.15e9 / SPEED_OF_LIGHT_MPS * dropped
        assert abs(far_field_filter(history, point) - matched_filter(history, point)) <= bound + 1e-6

    def test_far_from_the_scene_centre_it_defocuses_by_itself(self, broadside: Collection) -> None:
        """Without any error: 0.3 to 0.9 rad at 250 m, by independent brute force; and as plane waves predict."""
        history = broadside.record([0.0, 0.0, 0.0])
        plane = look_sum(history.transmitter, history.receiver)[:, :2]
        place = broadside.slow_time / (broadside.aperture_time / 2)
        largest = 0.0
        for azimuth in (0.0, 1.0, 2.5, 4.0):
            at = 250 * np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
            exact = sum(
                np.linalg.norm(p - at, axis=1) - np.linalg.norm(p, axis=1)
                for p in (history.transmitter, history.receiver)
            )
            # Where plane waves with its constant and linear range put it, and what quadratic term is left there.
            recorded, slopes = (np.polynomial.polynomial.polyfit(place, v, 4) for v in (exact, plane))
            shown = np.linalg.solve(-slopes[:2], recorded[:2])
            predicted = 2 * math.pi / broadside.wavelength * (recorded[2] + slopes[2] @ shown)
            spacing = broadside.cross_range_resolution / 2.5
            line = ground_grid(tuple(shown), broadside.geometry.look_azimuth, (1.0, spacing * 96), (1, 96))[0]
            cut = far_field_filter(broadside.record(at), line)
            clean = far_field_filter(_plane_record(broadside, plane, shown), line)
            measured = measured_phase(broadside, cut, clean, spacing)
            assert measured == pytest.approx(predicted, rel=0.05, abs=0.01)
            largest = max(largest, abs(measured))
        assert 0.3 < largest < 0.9

    def test_points_that_are_no_numbers_are_refused(self, broadside: Collection) -> None:
        with pytest.raises(ValueError, match="points"):
            far_field_filter(broadside.record([0, 0, 0]), np.array([math.nan, 0, 0]))

    def test_no_points(self, broadside: Collection) -> None:
        assert far_field_filter(broadside.record([0, 0, 0]), np.empty((0, 3))).shape == (0,)


def _plane_record(c: Collection, plane, shown):
    """Phase history for which (5) is exact."""
    history = c.record([0.0, 0.0, 0.0])
    history.samples[:] = np.exp(2j * math.pi / SPEED_OF_LIGHT_MPS * np.outer(plane @ shown, history.frequency))
    return history


class TestPolarFormat:
    def test_error_free_point_is_the_dirichlet_response_16(self, plane_waves: Collection) -> None:
        """Phase and all; print has +j for the phase and forgets 1/(Nx Ny)."""
        size, shape, amplitude = (80.0, 45.0), (96, 108), 0.6 - 0.8j
        look = plane_waves.geometry.look_azimuth
        x_m, y_m = 9.3, -5.1
        at = [x_m * math.cos(look) - y_m * math.sin(look), x_m * math.sin(look) + y_m * math.cos(look), 0.0]
        image, fx, fy = polar_format(plane_waves.record(at, [amplitude]), look, size, shape)
        assert fx.size > 10
        assert fy.size > 20
        want = amplitude
        for extent, count, place, f, axis in ((size[0], shape[0], x_m, fx, 0), (size[1], shape[1], y_m, fy, 1)):
            away = (np.arange(count) - count // 2) * extent / count - place
            step = f[1] - f[0]  # Bx/Nx
            with np.errstate(invalid="ignore"):
                ratio = np.sin(2 * math.pi * away * step * f.size / SPEED_OF_LIGHT_MPS) / np.sin(
                    2 * math.pi * away * step / SPEED_OF_LIGHT_MPS
                )
            dirichlet = np.where(np.isnan(ratio), f.size, ratio) / f.size
            phase = np.exp(-2j * math.pi / SPEED_OF_LIGHT_MPS * away * (2 * f[0] + step * (f.size - 1)))
            want = want * np.expand_dims(dirichlet * phase, 1 - axis)
        # The point's own ranges bend by 11²/R, 1.4 µm: 3e-4 rad. Interpolation of twelve taps adds less than that.
        assert np.abs(image - want).max() < 6e-4

    @pytest.mark.parametrize("squint", [0, 30, -50])
    def test_near_the_scene_centre_it_is_the_matched_filter(self, squint: int) -> None:
        """The same peak; around it a response as much wider as the corners that are trimmed.

        Stretching sin(πx)/(πx) by ε changes it by at most 1.22 ε, the largest |cos πx - sin(πx)/(πx)|.
        """
        c = collection(squint, pulses=192, frequencies=64)
        look = c.geometry.look_azimuth
        history = c.record([1.2, -0.6, 0.0])
        size, shape = (48.0, 48.0), (160, 160)
        image, fx, fy = polar_format(history, look, size, shape)
        middle = np.abs(image[72:88, 72:88])
        want = np.abs(matched_filter(history, ground_grid((0, 0), look, size, shape)[72:88, 72:88]))
        peak = np.argmax(want)
        assert np.argmax(middle) == peak
        assert middle.flat[peak] == pytest.approx(want.flat[peak], abs=0.02)
        widths = (
            c.geometry.range_resolution(c.bandwidth, SPEED_OF_LIGHT_MPS) * fx.size * (fx[1] - fx[0]),
            c.cross_range_resolution * fy.size * (fy[1] - fy[0]),
        )
        trimmed = sum(1 - 2 * width / SPEED_OF_LIGHT_MPS for width in widths)
        assert 0 < trimmed < 0.2
        assert np.abs(middle - want).max() < 1.22 * trimmed + 0.01

    def test_a_patch_elsewhere_is_the_same_image(self, broadside: Collection) -> None:
        """Centred 6 and 4 pixels away, the same pixels; interpolation differs by what it leaves."""
        history, look = broadside.record([1.2, -0.6, 0.0]), broadside.geometry.look_azimuth
        size, shape = (48.0, 48.0), (160, 160)
        at = (
            6 * 0.3 * math.cos(look) - 4 * 0.3 * math.sin(look),
            6 * 0.3 * math.sin(look) + 4 * 0.3 * math.cos(look),
        )
        here = polar_format(history, look, size, shape)
        there = polar_format(history, look, size, shape, at)
        assert np.abs(here.image[60:100, 60:100] - there.image[54:94, 56:96]).max() < 1e-4

    @pytest.mark.parametrize("squint", [0, 30, 45])
    def test_the_rectangle_trims_the_aperture(self, squint: int) -> None:
        """The same curvature over less aperture: 3 to 5 % of quadratic phase, a size that makes steps fine."""
        c = collection(squint)
        look, n = c.geometry.look_azimuth, 192
        size = (60.0, c.cross_range_resolution / 2.5 * n)
        error = PathError(acceleration=tuple(1e-3 * u for u in c.geometry.receiver.look))
        measured = []
        for form in (
            lambda history: backprojection(history, ground_grid((0, 0), look, size, (160, n))[80]),
            lambda history: polar_format(history, look, size, (160, n)).image[80],
        ):
            cuts = [form(c.record([0, 0, 0], receiver=e)) for e in (error, PathError())]
            measured.append(measured_phase(c, *cuts, size[1] / n))
        assert measured[1] == pytest.approx(measured[0], rel=0.02)
        fine = polar_format(c.record([0, 0, 0]), look, (60.0, 400.0), (160, 1200)).frequency_y
        kept = 2 * np.ptp(fine) / SPEED_OF_LIGHT_MPS * c.cross_range_resolution
        assert 0.945 < kept**2 < 0.98  # also the half pulse that is missing at either end

    def test_what_it_refuses(self, broadside: Collection) -> None:
        history, look = broadside.record([0, 0, 0]), broadside.geometry.look_azimuth
        wide = collection(bandwidth=3e9).record([0, 0, 0])
        squinted = collection(60, aperture_time=60.0, bandwidth=3e6)
        with pytest.raises(ValueError, match="coarser than the resolution"):
            polar_format(history, look, (200.0, 200.0), (64, 512))
        with pytest.raises(ValueError, match="x′"):
            polar_format(history, look + math.pi, (40.0, 40.0), (200, 200))
        with pytest.raises(ValueError, match="turns off x′"):
            polar_format(wide, look + 0.5, (40.0, 40.0), (2000, 400))
        with pytest.raises(ValueError, match="12 pulses"):
            polar_format(collection(pulses=5).record([0, 0, 0]), look, (40.0, 40.0), (200, 200))
        with pytest.raises(ValueError, match="12 frequencies"):
            polar_format(collection(frequencies=5).record([0, 0, 0]), look, (40.0, 40.0), (200, 200))
        with pytest.raises(ValueError, match="squint"):
            polar_format(squinted.record([0, 0, 0]), squinted.geometry.look_azimuth, (40.0, 40.0), (400, 400))
