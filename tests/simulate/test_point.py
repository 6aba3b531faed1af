"""Section V and VI of the paper reproduced: smear along the line of (29), and autofocus that takes it back."""

import json
import math

import numpy as np
import pytest

from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.simulate.autofocus import phase_gradient_autofocus
from bisar_budget.simulate.phase_history import cell_centres
from bisar_budget.simulate.point import SimulationError, simulate_point
from tests.conftest import ROOT, mission_text

SECTION_V = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"


@pytest.fixture(scope="module")
def section_v():
    return simulate_point(load_mission(str(SECTION_V)))


def direction_of_smear(image, spacing: float) -> float:
    """Axis of the region above -6 dB of the peak, from its second moments. [rad], modulo π"""
    n = image.shape[0]
    padded = np.zeros((8 * n, 8 * n), dtype=complex)  # eight times finer, by the spectrum
    start = 4 * n - n // 2
    padded[start : start + n, start : start + n] = np.fft.fftshift(np.fft.fft2(image))
    power = np.abs(np.fft.ifft2(np.fft.ifftshift(padded))) ** 2
    bright = np.argwhere(power > power.max() / 4).astype(float)
    bright -= bright.mean(axis=0)
    values, vectors = np.linalg.eigh(bright.T @ bright)
    x, y = vectors[:, np.argmax(values)] * spacing
    return math.atan2(y, x) % math.pi


class TestSectionV:
    def test_figure_3_is_the_quadratic_of_table_ii(self, section_v) -> None:
        """ã_x τ²/2 along the line of sight: 0.005/2 · 0.981 · 9 m at the edge, 22 mm."""
        assert section_v.range_error.min() == pytest.approx(-0.005 / 2 * 30.414 / 31.0 * 9, rel=2e-3)
        assert abs(section_v.effect.quadratic) == pytest.approx(4.63, abs=0.005)

    def test_figure_4_points_lie_on_one_line_across_the_look_direction(self, section_v) -> None:
        first, middle, last = section_v.points
        assert np.hypot(*middle) < 1e-3
        line = math.atan2(*(last - first)[::-1]) % math.pi
        across = (section_v.look_azimuth + math.pi / 2) % math.pi  # (31)
        assert math.degrees(abs(line - across)) < 5

    def test_figure_5_smears_along_the_line_of_the_points(self, section_v) -> None:
        first, _, last = section_v.points
        line = math.atan2(*(last - first)[::-1]) % math.pi
        smear = direction_of_smear(section_v.in_scene, section_v.spacing)
        assert math.degrees(abs(smear - line)) < 1

    def test_figure_6_smears_in_cross_range(self, section_v) -> None:
        smear = direction_of_smear(section_v.rotated, section_v.spacing)
        assert math.degrees(abs(smear - math.pi / 2)) < 5

    def test_figure_6_is_figure_5_turned(self, section_v) -> None:
        turned = direction_of_smear(section_v.rotated, section_v.spacing) + section_v.look_azimuth
        scene = direction_of_smear(section_v.in_scene, section_v.spacing)
        assert math.degrees(abs((turned - scene + math.pi / 2) % math.pi - math.pi / 2)) < 2

    def test_figure_7_is_the_error_free_image_again(self, section_v) -> None:
        clean, focused = section_v.clean_response, section_v.focused_response
        assert 20 * math.log10(focused.peak / clean.peak) == pytest.approx(0, abs=0.2)
        assert focused.irw_m / clean.irw_m == pytest.approx(1, abs=0.05)

    def test_before_autofocus_it_is_not(self, section_v) -> None:
        clean, smeared = section_v.clean_response, section_v.response
        assert 20 * math.log10(smeared.peak / clean.peak) < -5
        assert smeared.irw_m / clean.irw_m > 1.5


class TestAutofocus:
    def scene(self, phase, noise_db: float | None = None, size: int = 256):
        """Points in a square scene, blurred by a phase over an aperture that fills half of the band."""
        rng = np.random.default_rng(5)
        image = np.zeros((size, size), dtype=complex)
        image[rng.integers(0, size, 60), rng.integers(size // 4, 3 * size // 4, 60)] = np.exp(
            2j * math.pi * rng.random(60)
        )
        if noise_db is not None:
            level = 10 ** (noise_db / 20)
            image += level * (rng.normal(size=image.shape) + 1j * rng.normal(size=image.shape)) / math.sqrt(2)
        place = np.fft.fftshift(np.fft.fftfreq(size)) * 4  # ±1 over half of the band
        band = np.abs(place) <= 1
        spectrum = np.fft.fft(image, axis=1) * np.fft.ifftshift(band * np.exp(1j * phase(place)))
        return np.fft.ifft(spectrum, axis=1), np.fft.ifftshift(band), np.fft.ifftshift(phase(place))

    @pytest.mark.parametrize("noise_db", [None, -30.0])
    @pytest.mark.parametrize(
        "phase",
        [lambda x: 4.6 * x**2, lambda x: -4.6 * x**2, lambda x: 3 * x**3, lambda x: 1.5 * np.cos(7 * x)],
        ids=["quadratic", "negative", "cubic", "sinusoidal"],
    )
    def test_the_residual_is_small(self, phase, noise_db) -> None:
        image, band, true = self.scene(phase, noise_db)
        focused = phase_gradient_autofocus(image)
        residual = np.fft.fftshift(true - focused.phase)[np.fft.fftshift(band)]
        place = cell_centres(2.0, residual.size)
        residual = residual - np.polynomial.polynomial.polyval(
            place, np.polynomial.polynomial.polyfit(place, residual, 1)
        )
        assert np.sqrt(np.mean(residual**2)) < 0.1

    def test_a_sharp_image_is_left_alone(self) -> None:
        image, _, _ = self.scene(lambda x: 0 * x)
        focused = phase_gradient_autofocus(image)
        assert np.sqrt(np.mean(focused.phase**2)) < 0.05


class TestRefusals:
    def test_too_few_pulses_alias(self) -> None:
        with pytest.raises(SimulationError, match="aliases below"):
            simulate_point(parse_mission(mission_text(collection__pulses=16)))

    def test_map_drift_refocuses_the_paper_s_example_too(self) -> None:
        images = simulate_point(load_mission(str(SECTION_V)))
        mission = load_mission(str(SECTION_V))
        drift = simulate_point(mission._replace(autofocus=mission.autofocus._replace(algorithm="map_drift")))
        assert not np.array_equal(drift.focused, images.focused)
        loss = 20 * math.log10(drift.focused_response.peak / drift.clean_response.peak)
        assert loss == pytest.approx(0, abs=0.2)
        assert drift.focused_response.irw_m / drift.clean_response.irw_m == pytest.approx(1, abs=0.05)

    def test_memory_limit(self) -> None:
        smeared = {"platforms__transmitter__motion_error__acceleration": [0.02, 0, 0]}
        with pytest.raises(SimulationError, match="memory_limit is 1 MB"):
            simulate_point(parse_mission(mission_text(simulation={"memory_limit": "1 MB"}, **smeared)))

    def test_a_patch_too_close_to_a_platform(self) -> None:
        mission = load_mission(str(ROOT / "specs" / "missions" / "sentinel1_fixed_receiver.yaml"))
        with pytest.raises(SimulationError, match="range cells"):
            simulate_point(mission)


def test_autofocus_never_beats_the_error_free_image() -> None:
    """Close to a platform the image carries a chirp; taken for a phase error it gave 0.6 dB more than there is."""
    images = simulate_point(load_mission(str(ROOT / "specs" / "missions" / "one_stationary_spotlight.yaml")))
    assert images.focused_response.peak <= images.clean_response.peak * 1.001


def test_window_lowers_the_sidelobes() -> None:
    images = simulate_point(parse_mission(mission_text(simulation={"window": "taylor"})))
    assert images.clean_response.pslr_db == pytest.approx(-35, abs=0.7)


class TestCommand:
    def test_summary_plot_and_archive(self, run, tmp_path) -> None:
        result = run("simulate", SECTION_V, "--plot", tmp_path / "v.png", "-o", tmp_path / "v.npz")
        assert result.exit_code == 0, result.output
        assert "quadratic 4.63 rad" in result.stdout
        assert (tmp_path / "v.png").read_bytes().startswith(b"\x89PNG")
        with np.load(tmp_path / "v.npz") as archive:
            assert archive["rotated"].shape == archive["focused"].shape

    def test_wrong_suffix_and_unusable_mission_are_2(self, run, tmp_path) -> None:
        assert run("simulate", SECTION_V, "--plot", tmp_path / "v.docx").exit_code == 2
        assert run("simulate", tmp_path / "none.yaml").exit_code == 2
        assert run("simulate", ROOT / "specs" / "missions" / "uav_pair_l_band.yaml").exit_code == 2

    def test_unwritable_target_is_2(self, run, tmp_path) -> None:
        result = run("simulate", SECTION_V, "-o", tmp_path / "no" / "v.npz")
        assert result.exit_code == 2
        assert "cannot write" in result.stderr
        assert json.dumps(result.stdout) == '""'


class TestVibration:
    """2 mm at 21.3 Hz, λ = 3 cm: a phase of 0.419 rad, of which J₀ leaves 20·log₁₀ J₀ = -0.386 dB at the peak."""

    CYCLES = 128  # an integer of cycles on 256 pulses would be seen at one phase only

    def mission(self, **changes):
        vibration = {"sinusoidal": [{"amplitude": "2 mm", "frequency": self.CYCLES / 6}]}
        error = {"platforms__transmitter__motion_error": {"vibration": vibration}}
        return parse_mission(mission_text(**error, **changes))

    def test_a_fast_one_is_sampled_twice_over(self) -> None:
        images = simulate_point(self.mission())
        loss = 20 * math.log10(images.response.peak / images.clean_response.peak)
        assert loss == pytest.approx(-0.386, abs=0.02)

    @pytest.mark.parametrize(("pulses", "aliases"), [(256, True), (257, False)])
    def test_pulses_that_alias_it_are_refused(self, pulses: int, aliases: bool) -> None:
        mission = self.mission(collection={"aperture_time": "6 s", "pulses": pulses})
        if aliases:
            with pytest.raises(SimulationError, match="aliases up to 256 pulses"):
                simulate_point(mission)
        else:
            simulate_point(mission)

    def test_one_that_takes_a_million_pulses_is_refused(self) -> None:
        vibration = {"sinusoidal": [{"amplitude": "2 mm", "frequency": "1 MHz"}]}
        error = {"platforms__transmitter__motion_error": {"vibration": vibration}}
        with pytest.raises(SimulationError, match="at most 32768 are simulated"):
            simulate_point(parse_mission(mission_text(**error)))
