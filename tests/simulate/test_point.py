"""Section V and VI of the paper reproduced: smear along the line of (29), and autofocus that takes it back."""

import json
import math
import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest

from bisar_budget.effects.effect import gradients_of
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Simulation
from bisar_budget.simulator import point as point_module
from bisar_budget.simulator.autofocus import phase_gradient_autofocus
from bisar_budget.simulator.collection import PointCollection, RangeLines
from bisar_budget.simulator.image_formation import matched_filter
from bisar_budget.simulator.impulse_response import line_at, upsampled
from bisar_budget.simulator.phase_history import cell_centres
from bisar_budget.simulator.point import SimulationError, declared_errors, simulate_point
from bisar_budget.simulator.targets import parse_targets
from tests import families
from tests.conftest import ROOT, mission_text
from tests.simulate.conftest import images_of, only_rotated_images

pytestmark = pytest.mark.extras
SECTION_V = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"


def example(name: str) -> str:
    return (SECTION_V.parent / f"{name}.yaml").read_text(encoding="utf-8")


@pytest.fixture
def section_v():
    return images_of(example("rigling_moses_section_v"))


def direction_of_smear(image, spacing: tuple[float, float]) -> float:
    """Axis of the region above -6 dB of the peak, from its second moments. [rad], modulo π"""
    n, m = image.shape
    padded = np.zeros((8 * n, 8 * m), dtype=complex)  # eight times finer, by the spectrum
    padded[4 * n - n // 2 :, 4 * m - m // 2 :][:n, :m] = np.fft.fftshift(np.fft.fft2(image))
    power = np.abs(np.fft.ifft2(np.fft.ifftshift(padded))) ** 2
    bright = np.argwhere(power > power.max() / 4) * np.array(spacing)
    bright -= bright.mean(axis=0)
    values, vectors = np.linalg.eigh(bright.T @ bright)
    x, y = vectors[:, np.argmax(values)]
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

    def test_figure_4_says_by_which_gradients_it_has_its_points(self, section_v) -> None:
        assert section_v.points_by == gradients_of("published")
        assert gradients_of("full") == gradients_of("strictest") != gradients_of("published")

    def test_figure_5_smears_along_the_line_of_the_points(self, section_v) -> None:
        first, _, last = section_v.points
        line = math.atan2(*(last - first)[::-1]) % math.pi
        smear = direction_of_smear(section_v.in_scene, section_v.scene_spacing)
        assert math.degrees(abs(smear - line)) < 1

    def test_figure_6_smears_in_cross_range(self, section_v) -> None:
        smear = direction_of_smear(section_v.rotated, section_v.spacing)
        assert math.degrees(abs(smear - math.pi / 2)) < 5

    def test_figure_6_is_figure_5_turned(self, section_v) -> None:
        turned = direction_of_smear(section_v.rotated, section_v.spacing) + section_v.look_azimuth
        scene = direction_of_smear(section_v.in_scene, section_v.scene_spacing)
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


RADAR = SimpleNamespace(center_frequency=10e9, bandwidth=100e6)


class TestRefusals:
    def test_a_point_below_both_platforms_has_no_image_plane(self) -> None:
        """The range does not change over the ground there: it was divided by first."""
        above = np.array([[0.0, 0.0, 1e3]] * 3)
        with pytest.raises(ValueError, match="no image plane"):
            RangeLines(above, above).cells((0.0, 0.0), RADAR)

    def test_too_few_pulses_alias(self) -> None:
        with pytest.raises(SimulationError, match="aliases below"):
            simulate_point(parse_mission(mission_text(collection__pulses=16)))

    def test_map_drift_refocuses_the_paper_s_example_too(self, section_v) -> None:
        by_drift = example("rigling_moses_section_v") + "autofocus: { algorithm: map_drift }\n"
        drift = images_of(by_drift, rotated_only=True)
        assert not np.array_equal(drift.focused, section_v.focused)
        loss = 20 * math.log10(drift.focused_response.peak / drift.clean_response.peak)
        assert loss == pytest.approx(0, abs=0.2)
        assert drift.focused_response.irw_m / drift.clean_response.irw_m == pytest.approx(1, abs=0.05)

    def test_memory_limit(self) -> None:
        smeared = {"platforms__transmitter__motion_error__acceleration": [0.02, 0, 0]}
        with pytest.raises(SimulationError, match="memory_limit is 1 MB"):
            simulate_point(parse_mission(mission_text(simulation={"memory_limit": "1 MB"}, **smeared)))

    def test_memory_limit_holds_for_the_phase_history_too(self) -> None:
        """65 536 pulses of 109 frequencies, 7 million samples, for images that take 4 MB."""
        changes = {"collection__pulses": 65536, "simulation": {"memory_limit": "100 MB"}}
        with pytest.raises(
            SimulationError,
            match=r"65536 pulses of \d+ frequencies need about 607.6 MB, .*: raise it, or lower collection.pulses",
        ):
            simulate_point(parse_mission(mission_text(**changes)))

    def test_memory_is_estimated_and_the_estimate_holds(self, satellite, monkeypatch) -> None:
        """Peak of what is allocated, traced, in an image large enough that imports do not count."""
        _, _, peak = satellite
        assert peak < 77e6
        monkeypatch.setattr(point_module, "_MIN_PULSES", FEW)
        tracemalloc.start()
        try:
            with pytest.raises(SimulationError, match=r"need about 76\.97 MB"):
                simulate_point(parse_mission(mission_text(**SATELLITES, simulation={"memory_limit": "70 MB"})))
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert peak < 20e6  # nothing is formed before it is known


class TestLinesOfEqualRangeThatBend:
    """They were refused where they bend through range cells; the patch follows them."""

    def test_a_patch_close_to_a_fixed_receiver(self) -> None:
        images = images_of(example("sentinel1_fixed_receiver"), rotated_only=True)
        assert images.clean_response.pslr_db == pytest.approx(-13.26, abs=0.1)

    def test_an_l_band_satellite_with_an_aircraft_12_km_away_and_a_clock_error(self) -> None:
        platforms = {
            "transmitter": {"position": [300e3, 50e3, 620e3], "velocity": [500, 7400, 0]},
            "receiver": {"position": [9e3, 6e3, 5e3], "velocity": [-60, 90, 0]},
        }
        changes = {
            "platforms": platforms,
            "radar": {"center_frequency": "1.27 GHz", "bandwidth": "80 MHz"},
            "collection": {"aperture_time": "2 s"},
            "timing_error": {"constant": "40 ns"},
        }
        images = images_of(mission_text(**changes), rotated_only=True)
        assert np.hypot(*images.effect.displacement) > 5  # 12 m of path
        peak = np.unravel_index(np.argmax(np.abs(images.rotated)), images.rotated.shape)
        assert np.abs(np.array(peak) - np.array(images.rotated.shape) / 2).max() <= 1  # the patch went along
        assert images.response.peak == pytest.approx(images.clean_response.peak, rel=0.01)

    def test_a_geostationary_transmitter_with_a_drone(self) -> None:
        platforms = {
            "transmitter": {"position": [20e6, 10e6, 28e6], "velocity": [0.5, 1.5, 0.2]},
            "receiver": {"position": [300, 200, 120], "velocity": [-6, 10, 0], "motion_error": {"position": 0.1}},
        }
        radar = {"center_frequency": "11.7 GHz", "bandwidth": "36 MHz"}
        changes = {"platforms": platforms, "radar": radar, "collection": {"aperture_time": "4 s"}}
        images = images_of(mission_text(**changes), rotated_only=True)
        assert images.clean_response.pslr_db == pytest.approx(-13.26, abs=0.1)

    @pytest.mark.parametrize(("family", "seed"), [("drones", 1), ("geostationary_drone", 2), ("jets", 3)])
    def test_a_line_between_pixels_is_as_sums_over_the_aperture_have_it(self, family: str, seed: int) -> None:
        """A transform of whole lines spoils a peak by what is at their ends, and by what is out of focus there."""
        mission = parse_mission(families.mission_text(family, seed))
        images = images_of(families.mission_text(family, seed), rotated_only=True)
        middle, finer = images.rotated.shape[0] // 2, 16
        collection = PointCollection(mission, mission.geometry)
        errors = declared_errors(mission)
        slow_time = cell_centres(mission.collection.aperture_time, 512)
        measured = collection.flight(errors.smooth(), slow_time).as_measured()
        place = images.effect.displacement
        history = collection.record(measured, np.array([[*place, 0.0]]), np.ones(1, complex), slow_time, 256)
        spacing = images.spacing[0], images.spacing[1] / finer
        line = collection.range_lines(errors).grid(place, spacing, (2, finer * images.rotated.shape[1]))[1]
        direct = np.abs(matched_filter(history, line[None]))[0]
        here = np.abs(upsampled(line_at(images.error_free, middle), finer))
        assert here[100:-100] == pytest.approx(direct[100:-100], abs=2e-3)
        clean = images.clean_response
        assert clean.peak == pytest.approx(1.0, abs=1e-5)
        assert clean.peak_m == pytest.approx(0.0, abs=1e-3 * images.spacing[1])
        away = np.abs(np.arange(direct.size) - direct.size // 2) * spacing[1] > clean.mask_m
        assert clean.pslr_db == pytest.approx(20 * math.log10(direct[away].max()), abs=0.02)

    @pytest.mark.parametrize(
        ("family", "seed", "turns_back"), [("geostationary_drone", 0, False), ("jets", 22, True)]
    )
    def test_columns_that_run_together_are_not_read_between_lines(
        self, family: str, seed: int, turns_back: bool
    ) -> None:
        """Lines of equal range and of equal Doppler lie 1.5° and 6° apart: peaks of 1 were read as 1.01 and 1.09.

        Doppler of jets 22 turns back: straight pixels that sample the whole support read its peak as 1.
        """
        images = images_of(families.mission_text(family, seed), rotated_only=True)
        assert images.clean_response.peak == pytest.approx(1.0, abs=1e-6)
        assert abs(images.misread_db) < 1e-3 if turns_back else images.misread_db > 0.05
        for image, response in ((images.rotated, images.response), (images.focused, images.focused_response)):
            assert response.peak >= np.abs(image).max() * (1 - 1e-6)

    @pytest.mark.parametrize("more", ["3, 0", "clutter -20 dB"])
    def test_what_stands_beside_a_target_leaves_its_rows(self, more: str) -> None:
        """The errors of geostationary_drone 25 are in focus four lines away: a neighbour took 5 dB of their peak."""
        mission = parse_mission(families.mission_text("geostationary_drone", 25))
        with only_rotated_images():
            alone, beside = (
                simulate_point(mission, targets=parse_targets(text)).responses[0]
                for text in ("0, 0", f"0, 0; {more}")
            )
        losses = [one.smeared.peak / one.clean.peak for one in (alone, beside)]
        assert losses[1] == pytest.approx(losses[0], rel=0.15)

    def test_targets_beside_each_other_are_read_where_doppler_turns_back(self) -> None:
        """It turns back within the aperture of drones 43: of a target 5 m beside the centre 0.01 was read."""
        mission = parse_mission(families.mission_text("drones", 43))
        with only_rotated_images():
            images = simulate_point(mission, targets=parse_targets("0, 2; 0, -2"))
        for response in images.responses:
            assert response.clean is not None
            assert response.clean.peak == pytest.approx(1.0, abs=1e-3)

    @pytest.mark.parametrize(("height", "is_there"), [(0.51, True), (0.49, False)])
    def test_a_target_that_is_not_in_its_rows_is_not_measured(self, height: float, is_there: bool) -> None:
        response = height * np.outer(np.sinc(np.arange(-24, 24) / 3), np.sinc(np.arange(-48, 48) / 3)).astype(complex)
        (cut,) = point_module._cuts([response], [24.0], slice(None), 1.0, 1.0)
        assert (cut is not None) == is_there

    @pytest.mark.parametrize(("family", "seed"), [("drones", 1), ("jets", 3)])
    def test_clutter_has_its_level_in_narrow_patches(self, family: str, seed: int) -> None:
        """Laid within a patch of 2 range cells alone it was 3 dB too weak."""
        mission = parse_mission(families.mission_text(family, seed))
        powers = []
        for random in range(8):
            again = mission._replace(simulation=Simulation(seed=random))
            scene = parse_targets("0, 0, -200 dB; clutter 0 dB")
            with only_rotated_images():
                powers.append(np.mean(np.abs(simulate_point(again, targets=scene).error_free) ** 2))
        assert 10 * math.log10(np.mean(powers)) == pytest.approx(0.0, abs=1.2)

    def test_pixels_near_a_platform_are_as_fine_as_its_aperture_bends_wavefronts(self) -> None:
        """drones 1 is in focus over 0.9 m of a range cell of 22 m: an aperture of 28° at 100 m, in X-band."""
        mission = parse_mission(families.mission_text("drones", 1))
        lines = PointCollection(mission, mission.geometry).range_lines(declared_errors(mission))
        nominal, sampled = (of((0.0, 0.0), mission.radar) for of in (lines.cells, lines.sampled))
        slopes = []
        step = 1e-3 * (lines.grid((0.0, 0.0), (nominal[0] / 100, nominal[1]), (3, 2))[2, 1, :2])
        for tau in np.linspace(-0.5, 0.5, 101) * mission.collection.aperture_time:
            sums = [
                sum(math.dist((*at, 0.0), state.at(tau)[0]) for state in mission.geometry.both)
                for at in (-step, step)
            ]
            slopes.append((sums[1] - sums[0]) / (2 * 1e-3 * nominal[0] / 100) / mission.radar.wavelength)
        spectrum = 1 / nominal[0] + np.ptp(slopes)  # cycles a metre across the lines
        assert 0.4 < spectrum * sampled[0] / 3 < 0.6  # of what so many pixels can hold
        assert nominal[0] / sampled[0] > 10

    def test_errors_that_leave_no_point_are_said(self) -> None:
        with pytest.raises(SimulationError, match="no ground point"):
            simulate_point(parse_mission(mission_text(timing_error={"constant": "-1 ms"})))


def test_window_lowers_the_sidelobes() -> None:
    images = images_of(mission_text(simulation={"window": "taylor"}), rotated_only=True)
    assert images.clean_response.pslr_db == pytest.approx(-35, abs=0.7)


# Fine in range, coarse across: a square patch of square pixels would have 45 times as many.
SATELLITES = {
    "platforms": {
        "transmitter": {"slant_range": 8e5, "azimuth": 0, "elevation": 0.8, "speed": 7500, "motion_azimuth": 1.6},
        "receiver": {"slant_range": 8e5, "azimuth": 0.01, "elevation": 0.8, "speed": 7500, "motion_azimuth": 1.6},
    },
    "radar": {"center_frequency": "9.6 GHz", "bandwidth": "600 MHz"},
    "collection": {"aperture_time": "0.1 s"},
}  # fmt: skip


# Pulses enough for so short an aperture. Within so little memory NumPy forms the images, and takes its time for each
# pulse; with fewer of them more of what is estimated are the images themselves.
FEW = 64


@pytest.fixture(scope="module")
def satellite():
    """Images of two satellites, what progress told on the way, and the peak of memory. [B]"""
    told: list[tuple[int, int]] = []
    mission = parse_mission(mission_text(**SATELLITES, simulation={"memory_limit": "80 MB"}))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(point_module, "_MIN_PULSES", FEW)
        tracemalloc.start()
        try:
            images = simulate_point(mission, lambda *step: told.append(step))
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
    return images, told, peak


def test_patches_are_no_larger_than_the_response_and_progress_tells_all_of_the_work(satellite) -> None:
    images, told, _ = satellite
    in_range, cross_range = images.spacing
    assert cross_range > 20 * in_range
    assert max(images.rotated.shape) < 120  # 32 cells and a margin, three samples each
    assert images.clean_response.pslr_db == pytest.approx(-13.3, abs=0.1)
    peak = np.unravel_index(np.argmax(np.abs(images.in_scene)), images.in_scene.shape)
    assert np.abs(images.in_scene[peak]) == pytest.approx(np.abs(images.error_free).max(), rel=0.01)
    assert len(told) > 3  # a bar that moves
    done = [done for done, _ in told]
    assert done == sorted(done)
    assert {work for _, work in told} == {done[-1]}


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

    @pytest.mark.parametrize(("name", "fails"), [("uav_pair_l_band", True), ("rigling_moses_section_v", False)])
    def test_an_autofocus_that_fails_is_said_to(self, run, monkeypatch, name: str, fails: bool) -> None:
        """Beyond its pull-in and over ±0.3 rad of turn the UAV pair's response stays smeared."""
        images = images_of(example(name), rotated_only=True)
        monkeypatch.setattr(point_module, "simulate_point", lambda *_, **__: images)
        said = run("simulate", SECTION_V.with_name(f"{name}.yaml")).stdout
        assert ("autofocus does not restore the response" in said) == fails

    @pytest.mark.parametrize(
        ("family", "seed", "more", "is_doubtful"),
        [
            ("satellite_fixed", 7, [], True),
            ("satellite_fixed", 7, ["--targets", "0, 0, -6 dB"], True),
            ("drones", 1, [], False),
            ("drones", 1, ["--targets", "0, 0, -6 dB"], False),
        ],
    )
    def test_a_response_that_pixels_do_not_sample_is_said_to(
        self, run, tmp_path, family: str, seed: int, more: list[str], is_doubtful: bool
    ) -> None:
        """Doppler turns along the line of equal range, three pixels beside the point: a peak of 1 is read as 1.09."""
        (mission := tmp_path / "mission.yaml").write_text(families.mission_text(family, seed), encoding="utf-8")
        said = run("simulate", mission, *more).stdout
        assert ("the error-free response is read 0.8 dB" in said) == is_doubtful
        assert ("are in doubt" in said) == is_doubtful

    def test_unwritable_target_is_2(self, run, tmp_path, section_v, monkeypatch) -> None:
        monkeypatch.setattr(point_module, "simulate_point", lambda *_, **__: section_v)
        (taken := tmp_path / "taken").write_text("a file, no folder")
        result = run("simulate", SECTION_V, "-o", taken / "v.npz")
        assert result.exit_code == 2
        assert "cannot write" in result.stderr
        assert json.dumps(result.stdout) == '""'


class TestVibration:
    """2 mm, λ = 3 cm: a phase of 0.419 rad, of which J₀ leaves 20·log₁₀ J₀ = -0.386 dB at the peak."""

    CYCLES = 128  # an integer of cycles on 256 pulses would be seen at one phase only

    def text(self, cycles: float = CYCLES, **changes) -> str:
        vibration = {"sinusoidal": [{"amplitude": "2 mm", "frequency": cycles / 6}]}
        return mission_text(platforms__transmitter__motion_error={"vibration": vibration}, **changes)

    def test_a_fast_one_is_sampled_twice_over(self, monkeypatch) -> None:
        """Its echoes lie beyond the patch, which 256 pulses would do for: they would see one cycle of 257."""
        monkeypatch.setattr(point_module, "_MARGIN_CELLS", 8)
        images = images_of(self.text(257), rotated_only=True)
        loss = 20 * math.log10(images.response.peak / images.clean_response.peak)
        assert loss == pytest.approx(-0.386, abs=0.02)

    @pytest.mark.parametrize(("pulses", "aliases"), [(256, True), (257, False)])
    def test_pulses_that_alias_it_are_refused(self, pulses: int, aliases: bool) -> None:
        text = self.text(collection={"aperture_time": "6 s", "pulses": pulses})
        if aliases:
            with pytest.raises(SimulationError, match="aliases up to 256 pulses"):
                images_of(text, rotated_only=True)
        else:
            images_of(text, rotated_only=True)

    def test_one_that_takes_a_million_pulses_is_refused(self) -> None:
        with pytest.raises(SimulationError, match="at most 32768 are simulated"):
            images_of(self.text(6e6))
