"""Images against the direct sum, the Dirichlet response, exact ranges, and responses known analytically."""

import math

import numpy as np
import pytest

from bisar_budget.simulator.image_formation import backprojection, ground_grid, matched_filter, taylor_window
from bisar_budget.simulator.impulse_response import impulse_response, upsampled
from bisar_budget.simulator.phase_history import (
    PathError,
    PathSinusoid,
    cell_centres,
    exact_effect,
    path,
    phase_history,
)
from tests.simulate.conftest import Collection, collection

pytestmark = pytest.mark.extras


def cut_through(c: Collection, history, centre, count: int = 96, oversampling: float = 2.5):
    """Image along y′ through a ground point, and its spacing."""
    spacing = c.cross_range_resolution / oversampling
    line = ground_grid(centre, c.geometry.look_azimuth, (1.0, spacing * count), (1, count))[0]
    return backprojection(history, line), spacing


class TestPhaseHistory:
    def test_a_scatterer_at_the_scene_centre_has_no_phase(self, broadside: Collection) -> None:
        assert np.allclose(broadside.record([0, 0, 0]).samples, 1.0)

    def test_phase_of_1_and_2_at_one_sample(self, broadside: Collection) -> None:
        """By hand for one pulse and frequency: −2πf(d_t + d_r − d̂_t − d̂_r)/c."""
        error = PathError(position=(0.3, -0.1, 0.2))
        history = broadside.record([5.0, -7.0, 1.0], [2j], transmitter=error)
        state, other = broadside.geometry.transmitter, broadside.geometry.receiver
        tau = broadside.slow_time[17]
        t = [p + v * tau for p, v in zip(state.position, state.velocity, strict=True)]
        r = [p + v * tau for p, v in zip(other.position, other.velocity, strict=True)]
        measured = [a + b for a, b in zip(t, error.position, strict=True)]
        target, origin = (5.0, -7.0, 1.0), (0.0, 0.0, 0.0)
        distance = math.dist(t, target) + math.dist(r, target) - math.dist(measured, origin) - math.dist(r, origin)
        want = 2j * np.exp(-2j * math.pi * history.frequency[40] * distance / 299_792_458.0)
        assert history.samples[17, 40] == pytest.approx(want, abs=1e-6)  # 10⁻¹² of 40 km, in 200 cycles a metre

    def test_clock_error_is_a_range(self, broadside: Collection) -> None:
        transmitter, receiver = broadside.paths()
        options = {
            "slow_time": broadside.slow_time,
            "frequency": np.array([10e9]),
            "transmitter": transmitter,
            "receiver": receiver,
        }
        history = phase_history(np.zeros((1, 3)), np.ones(1), clock_error=1e-11, **options)
        assert np.allclose(history.samples, np.exp(-2j * math.pi * 0.1))

    def test_noise_has_its_power_and_needs_a_generator(self, broadside: Collection) -> None:
        transmitter, receiver = broadside.paths()
        options = {
            "slow_time": broadside.slow_time,
            "frequency": 10e9 + cell_centres(3e8, 64),
            "transmitter": transmitter,
            "receiver": receiver,
            "noise_power": 0.04,
        }
        noisy = phase_history(np.zeros((1, 3)), np.zeros(1), rng=np.random.default_rng(1), **options)
        # 16384 samples: the variance of the estimate is 1/16384 of the power squared.
        assert np.mean(np.abs(noisy.samples) ** 2) == pytest.approx(0.04, rel=4 / 128)
        with pytest.raises(ValueError, match="generator"):
            phase_history(np.zeros((1, 3)), np.zeros(1), **options)

    def test_vibration_is_along_the_line_of_sight(self, broadside: Collection) -> None:
        state = broadside.geometry.receiver
        error = PathError(sinusoids=(PathSinusoid(amplitude=1e-3, frequency=2.0, phase=0.4),))
        flown = path(state, broadside.slow_time, error)
        along = np.linalg.norm(flown.measured, axis=1) - np.linalg.norm(flown.actual, axis=1)
        assert np.allclose(along, 1e-3 * np.sin(2 * math.pi * 2.0 * broadside.slow_time + 0.4), atol=1e-9)

    def test_wideband_vibration_needs_a_generator(self, broadside: Collection) -> None:
        with pytest.raises(ValueError, match="generator"):
            path(broadside.geometry.receiver, broadside.slow_time, PathError(wideband_rms=1e-3))

    @pytest.mark.parametrize("pulses", [255, 256])
    @pytest.mark.parametrize("band", [None, (0.0, 100.0), (3.0, 8.0), (20.0, 21.4)])
    def test_wideband_vibration_has_its_rms_within_its_band(self, band, pulses: int) -> None:
        """Frequencies are 1/6 Hz apart, up to 21.3 Hz; 200 draws know a variance to 1 % at the least."""
        c = collection(pulses=pulses)
        rng = np.random.default_rng(5)
        error = PathError(wideband_rms=1e-3, wideband_band=band)
        power = np.zeros(pulses // 2 + 1)
        for _ in range(200):
            flown = path(c.geometry.receiver, c.slow_time, error, rng)
            along = np.linalg.norm(flown.measured, axis=1) - np.linalg.norm(flown.actual, axis=1)
            spectrum = np.abs(np.fft.fft(along)[: power.size]) ** 2
            power += spectrum * np.where(np.arange(power.size) % (pulses / 2) == 0, 1, 2) / (200 * pulses**2)
        assert math.sqrt(power.sum()) == pytest.approx(1e-3, rel=0.05)
        frequency = np.arange(power.size) / 6
        low, high = band or (0.0, 100.0)
        outside = power[(frequency < low) | (frequency > high)]
        assert outside.sum() < 1e-9 * power.sum()

    def test_a_band_between_the_frequencies_of_the_pulses_is_refused(self, broadside: Collection) -> None:
        error = PathError(wideband_rms=1e-3, wideband_band=(50.0, 60.0))
        with pytest.raises(ValueError, match="holds no frequency of the pulses"):
            path(broadside.geometry.receiver, broadside.slow_time, error, np.random.default_rng(1))

    def test_cells_stand_for_the_whole_interval(self) -> None:
        assert cell_centres(6.0, 4) == pytest.approx([-2.25, -0.75, 0.75, 2.25])


class TestImageFormation:
    def test_a_point_has_its_amplitude_at_its_place(self, broadside: Collection) -> None:
        history = broadside.record([12.0, -9.0, 0.0], [3 - 4j])
        assert matched_filter(history, np.array([12.0, -9.0, 0.0])) == pytest.approx(3 - 4j)

    def test_backprojection_is_the_direct_sum_to_120_db(self, broadside: Collection) -> None:
        history = broadside.record([[3, -2, 0], [-6, 5, 0], [0, 0, 4]], [1, 0.5j, -0.7])
        points = ground_grid((1.0, 2.0), broadside.geometry.look_azimuth, (20, 20), (20, 20))
        exact, fast = matched_filter(history, points), backprojection(history, points)
        assert 20 * math.log10(np.abs(fast - exact).max()) < -120  # the strongest point is 1

    def test_odd_numbers_of_pulses_and_frequencies(self) -> None:
        c = collection(20, pulses=63, frequencies=37)
        history = c.record([1, 2, 0])
        points = ground_grid((1.0, 2.0), 0.3, (4, 4), (5, 7))
        assert np.allclose(backprojection(history, points), matched_filter(history, points), atol=1e-6)

    def test_error_free_point_is_the_dirichlet_response_16(self) -> None:
        """Platforms far away and slow make (16)'s plane waves exact: a hundred thousand kilometres, 2 MHz cells."""
        c = collection(pulses=64, frequencies=32)
        far = Collection(
            type(c.geometry)(
                transmitter=type(c.geometry.transmitter)(position=(9e7, 0, 2e7), velocity=(0, 2e5, 0)),
                receiver=type(c.geometry.transmitter)(position=(9e7, 0, 2e7), velocity=(0, 2e5, 0)),
            ),
            pulses=64,
            frequencies=32,
            bandwidth=30e6,
        )
        resolution = far.cross_range_resolution
        steps = np.linspace(-5.3, 5.3, 41)
        points = np.stack((0 * steps, steps * resolution, 0 * steps), axis=-1)
        image = matched_filter(far.record([0, 0, 0]), points)
        with np.errstate(invalid="ignore", divide="ignore"):
            dirichlet = np.abs(np.sin(np.pi * steps) / (64 * np.sin(np.pi * steps / 64)))
        dirichlet[np.isnan(dirichlet)] = 1.0
        assert np.abs(image) == pytest.approx(dirichlet, abs=2e-3)

    def test_range_resolution_is_where_the_geometry_says(self, broadside: Collection) -> None:
        first_null = broadside.geometry.range_resolution(broadside.bandwidth, 299_792_458.0)
        look = broadside.geometry.look_azimuth
        point = first_null * np.array([math.cos(look), math.sin(look), 0.0])
        assert abs(matched_filter(broadside.record([0, 0, 0]), point)) < 0.01

    def test_cross_range_resolution_is_where_the_geometry_says(self) -> None:
        for squint in (0, 40):
            c = collection(squint)
            s = c.geometry.range_gradient
            across = np.array([-s[1], s[0], 0.0]) / math.hypot(*s)
            assert abs(matched_filter(c.record([0, 0, 0]), c.cross_range_resolution * across)) < 0.03

    def test_grid_is_turned_about_its_centre(self) -> None:
        grid = ground_grid((10.0, 20.0), math.pi / 2, (4.0, 2.0), (4, 2))
        assert grid.shape == (4, 2, 3)
        assert grid[2, 1] == pytest.approx([10, 20, 0])
        assert grid[3, 1] == pytest.approx([10, 21, 0])  # x′ points north
        assert grid[2, 0] == pytest.approx([11, 20, 0])  # y′ points west


def response(phase, window=None, count: int = 256, extent: int = 8):
    """Cut of an aperture with a phase, oversampled; spacing in resolution cells."""
    place = cell_centres(2.0, count)
    aperture = np.exp(1j * phase(place)) * (1.0 if window is None else window)
    padded = np.zeros(count * extent, dtype=complex)
    padded[:count] = aperture / count
    return np.fft.fftshift(np.fft.fft(padded)), 1 / extent


TABLE = [
    # QPE, uniform: width, peak, PSLR, ISLR; Taylor -35 dB n̄ 5: the same. Fixed mask, width and peak relative.
    (0, (1, 0, -13.26, -9.68), (1, 0, -35.2, -27.4)),
    # The tapered PSLR sits on the edge of the mask, 0.25 dB for 1 % of it: direct quadrature at the null.
    (math.pi / 8, (1.003, -0.06, -12.94, -9.38), (1.005, -0.03, -28.90, -26.6)),
    (math.pi / 4, (1.013, -0.24, -12.04, -8.58), (1.019, -0.14, -22.79, -24.6)),
    (math.pi / 2, (1.061, -0.97, -9.04, -6.27), (1.082, -0.53, -16.46, -20.16)),
]


class TestImpulseResponse:
    """Values computed outside this project, to the digits given; a uniform aperture's are the textbook ones."""

    @pytest.mark.parametrize(("qpe", "uniform", "taylor"), TABLE)
    def test_effect_of_a_quadratic_phase(self, qpe, uniform, taylor) -> None:
        for window, want in ((None, uniform), (taylor_window(256), taylor)):
            clean_cut, spacing = response(lambda place: 0 * place, window)
            clean = impulse_response(clean_cut, spacing)
            cut, _ = response(lambda place: qpe * place**2, window)
            got = impulse_response(cut, spacing, mask_m=clean.mask_m)
            width, peak, pslr, islr = want
            assert got.irw_m / clean.irw_m == pytest.approx(width, abs=0.002)
            assert 20 * math.log10(got.peak / clean.peak) == pytest.approx(peak, abs=0.01)
            assert got.pslr_db == pytest.approx(pslr, abs=0.1)
            assert got.islr_db == pytest.approx(islr, abs=0.1)

    def test_width_of_a_uniform_aperture(self) -> None:
        cut, spacing = response(lambda place: 0 * place)
        assert impulse_response(cut, spacing).irw_m == pytest.approx(0.8859, abs=5e-4)

    def test_a_null_search_hides_the_error_under_a_window(self) -> None:
        cut, spacing = response(lambda place: math.pi / 2 * place**2, taylor_window(256))
        clean, _ = response(lambda place: 0 * place, taylor_window(256))
        mask = impulse_response(clean, spacing).mask_m
        assert impulse_response(cut, spacing).pslr_db < -30
        assert impulse_response(cut, spacing, mask_m=mask).pslr_db > -17

    def test_peak_position_to_a_hundredth_of_a_cell(self) -> None:
        for shift in (-1.37, 0.0, 2.21):
            cut, spacing = response(lambda place, s=shift: -math.pi * s * place)
            # A phase ramp of πs over ±1 moves the response by s cells; the FFT's sign makes it run backwards.
            assert impulse_response(cut, spacing).peak_m == pytest.approx(-shift, abs=0.01)

    @pytest.mark.parametrize("carrier", [0.0, 0.3, 0.5, -0.4])
    def test_upsampling_follows_the_carrier(self, carrier: float) -> None:
        cut, _ = response(lambda place: 0 * place, extent=3)
        n = np.arange(cut.size)
        moved = cut * np.exp(2j * math.pi * carrier * n)
        assert np.abs(upsampled(moved, 4)) == pytest.approx(np.abs(upsampled(cut, 4)), abs=2e-3)
        assert upsampled(moved, 4)[::4] == pytest.approx(moved, abs=1e-9)

    def test_a_peak_at_the_edge_is_refused(self) -> None:
        cut, spacing = response(lambda place: 0 * place)
        with pytest.raises(ValueError, match="cut"):
            impulse_response(np.roll(cut, cut.size // 2), spacing)

    @pytest.mark.parametrize(("sidelobe_db", "nbar"), [(-25, 4), (-35, 5), (-45, 8)])
    def test_taylor_window_reaches_its_sidelobes(self, sidelobe_db: float, nbar: int) -> None:
        cut, spacing = response(lambda place: 0 * place, taylor_window(256, sidelobe_db, nbar))
        assert impulse_response(cut, spacing).pslr_db == pytest.approx(sidelobe_db, abs=0.5)


class TestExactEffect:
    def effect(self, c: Collection, **errors: PathError):
        return exact_effect(c.slow_time, *c.paths(**errors), 0.0, c, c.aperture_time)

    def test_no_error_has_no_effect(self, broadside: Collection) -> None:
        effect = self.effect(broadside)
        assert effect.displacement == pytest.approx((0, 0), abs=1e-9)
        assert effect.quadratic == pytest.approx(0, abs=1e-6)

    def test_acceleration_is_table_ii_row_4(self, broadside: Collection) -> None:
        state, size = broadside.geometry.transmitter, 1e-3
        effect = self.effect(broadside, transmitter=PathError(acceleration=(size, 0, 0)))
        want = math.pi * size * state.position[0] * 36 / (4 * broadside.wavelength * state.slant_range)
        assert effect.quadratic == pytest.approx(-want, rel=2e-3)  # signed: a growing range error is negative

    def test_clock_quadratic(self, broadside: Collection) -> None:
        clock = 1e-13 * broadside.slow_time**2
        transmitter, receiver = broadside.paths()
        effect = exact_effect(broadside.slow_time, transmitter, receiver, clock, broadside, 6.0)
        assert effect.quadratic == pytest.approx(math.pi * 10e9 * 1e-13 * 36 / 2, rel=1e-4)

    def test_height_error_of_both_platforms_is_a_height_of_the_scene(self, broadside: Collection) -> None:
        """Platforms measured h too high see the scene h too high: |r| = |r̂ - h|, a scatterer up there."""
        up = PathError(position=(0.0, 0.0, 10.0))
        effect = self.effect(broadside, transmitter=up, receiver=up)
        history = broadside.record([0, 0, 10.0])
        there = backprojection(history, np.array([*effect.displacement, 0.0]))
        assert abs(there) > 0.99


def test_displaced_points_peak_where_exact_ranges_say(broadside: Collection) -> None:
    error = PathError(velocity=(0.02, 0.01, 0.0), position=(1.0, -2.0, 0.5))
    effect = exact_effect(broadside.slow_time, *broadside.paths(receiver=error), 0.0, broadside, 6.0)
    grid = ground_grid(effect.displacement, broadside.geometry.look_azimuth, (2.0, 2.0), (21, 21))
    image = np.abs(backprojection(broadside.record([0, 0, 0], receiver=error), grid))
    peak = np.unravel_index(np.argmax(image), image.shape)
    assert max(abs(peak[0] - 10), abs(peak[1] - 10)) <= 1  # within a pixel of 0.1 m
