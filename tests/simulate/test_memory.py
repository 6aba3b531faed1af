"""Memory and time of images are known before they are formed, and held, by compiled kernels as by NumPy."""

import itertools
import re
import time
import tracemalloc

import numpy as np
import pytest

from bisar_budget.faults import SetValue
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.simulator import far_field, image_formation
from bisar_budget.simulator.far_field import far_field_filter
from bisar_budget.simulator.image_formation import backprojection, is_compiled, kernel_within, matched_filter
from bisar_budget.simulator.point import SimulationError, simulate_point
from bisar_budget.verifier.limits import rows_to_verify, seconds_to_verify, verify_mission
from tests.conftest import ROOT, mission_text
from tests.simulate.conftest import collection

SECTION_V = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"
needs_numba = pytest.mark.skipif(not is_compiled(), reason="needs Numba")


def traced(task) -> float:
    tracemalloc.start()
    try:
        task()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def far_apart(cells: float) -> np.ndarray:
    """Pixels so many range cells of 1 m apart, as short apertures have them."""
    rng = np.random.default_rng(3)
    return np.c_[rng.uniform(-cells / 2, cells / 2, (200, 2)), np.zeros(200)]


class TestFarApart:
    """Pixels 10⁶ cells apart took a gigabyte for one pulse, and twenty times as long as NumPy."""

    @pytest.fixture
    def history(self):
        return collection(pulses=16).record([1, 2, 0])

    @needs_numba
    def test_memory_does_not_grow_with_the_distance(self, history) -> None:
        points = far_apart(1e6)
        backprojection(history, points[:2], "cubic")
        assert traced(lambda: backprojection(history, points, "cubic")) < 30e6

    @needs_numba
    def test_what_lies_between_them_is_refined_where_it_pays(self) -> None:
        """It took twenty times as long as NumPy; 2000 pixels pay for the cells between them, 200 do not."""
        from bisar_budget.simulator import compiled

        history = collection(pulses=64, frequencies=256).record([1, 2, 0])
        near, far = np.tile(far_apart(1e3), (10, 1)), np.tile(far_apart(1e5), (10, 1))
        assert compiled.backproject(history, near) is not None
        assert compiled.backproject(history, near[:200]) is None
        assert compiled.backproject(history, far) is None

    @needs_numba
    def test_it_is_the_matched_filter(self, history) -> None:
        """To -120 dB of the strongest echo, whatever the spline: pixels are read by a kernel of eight taps."""
        points = far_apart(1e6)
        assert np.abs(backprojection(history, points, "cubic") - matched_filter(history, points)).max() < 1e-6

    @needs_numba
    def test_a_lattice_whose_disc_is_too_large_is_read_at_each_pixel(self) -> None:
        """A line of equal range is thousands of metres long and a cell deep: only a disc around it is large."""
        c = collection(pulses=8)
        history = c.record([1, 2, 0])
        along = np.array([-np.sin(c.geometry.look_azimuth), np.cos(c.geometry.look_azimuth), 0.0])
        points = np.linspace(-400, 400, 200)[:, None] * along
        exact = matched_filter(history, points)
        assert np.abs(backprojection(history, points, "cubic") - exact).max() < 1e-5 * np.abs(exact).max()

    @needs_numba
    def test_long_profiles_are_formed_a_few_at_a_time(self) -> None:
        """65 536 samples of a pulse, of which a small patch needs a hundred: all pulses at once took gigabytes."""
        c = collection(pulses=64, frequencies=16384)
        history, points = c.record([1, 2, 0]), np.zeros((4, 3))
        backprojection(history, points)
        peak = traced(lambda: backprojection(history, points))
        assert peak < 40e6
        all_at_once = 64 * image_formation.profile_length(history, 2) * image_formation.PROFILE_BYTES
        assert all_at_once > 90e6  # what it would have been


class TestFarField:
    """A patch whose cells are kilometres wide ended in a failed allocation of finufft, exit 3."""

    @pytest.fixture
    def history(self):
        return collection(pulses=24, frequencies=32, aperture_time=6e-5).record([1, 2, 0])

    def test_a_long_patch_is_the_sum_as_printed(self, history) -> None:
        pytest.importorskip("finufft")
        look = collection().geometry.look_azimuth
        grid = image_formation.ground_grid((0.0, 0.0), look, (40.0, 2e6), (24, 24))
        peak = traced(lambda: far_field_filter(history, grid, "nufft"))
        direct = far_field_filter(history, grid, "direct")
        assert np.abs(far_field_filter(history, grid) - direct).max() < 1e-6 * np.abs(direct).max()
        assert peak < 30e6

    def test_points_too_far_apart_are_summed_as_printed(self, history, monkeypatch) -> None:
        pytest.importorskip("finufft")
        points = far_apart(1e6)
        monkeypatch.setattr(far_field, "_MAX_GRID_SAMPLES", 1)
        assert np.array_equal(far_field_filter(history, points), far_field_filter(history, points, "direct"))


class TestLimit:
    @pytest.mark.parametrize("former", ["backprojection", "polar_format", "matched_filter", "far_field"])
    @pytest.mark.parametrize("aperture", [3e-6, 1e-5])
    def test_short_apertures_hold_it_or_are_refused(self, former, aperture) -> None:
        """They took 12.7 GB under 500 MB, and 7.3 GB under 20 MB."""
        text = mission_text(collection__aperture_time=aperture, simulation={"memory_limit": "20 MB"})

        def form() -> None:
            with pytest.raises(SimulationError, match=r"simulation\.memory_limit is 20 MB: raise it"):
                simulate_point(parse_mission(text), image_former=former)

        form()  # imports
        assert traced(form) < 5e6

    def test_the_command_refuses_with_2(self, run, tmp_path) -> None:
        path = tmp_path / "m.yaml"
        path.write_text(mission_text(collection__aperture_time=1e-5, simulation={"memory_limit": "20 MB"}))
        result = run("simulate", path)
        assert result.exit_code == 2
        assert "simulation.memory_limit is 20 MB: raise it" in result.stderr

    @needs_numba
    def test_compiled_code_counts(self) -> None:
        """It takes 60 MB to load."""
        assert kernel_within(100e6) == "numpy"
        assert kernel_within(500e6) == "cubic"

    def test_data_of_a_chip_count(self) -> None:
        """Its range profiles were taken to be short, however far its pixels are from each other."""
        mission = load_mission(str(SECTION_V))
        limited = mission._replace(
            simulation=(parse_mission(mission_text(simulation={"memory_limit": "20 MB"}))).simulation
        )
        (row,) = verify_mission(limited, "transmitter.acceleration.x").rows
        assert row.verdict == "not_evaluated"
        assert re.search(r"pulses of 64 frequencies needs about [\d.]+ MB, .*memory_limit is 20 MB", row.reason)


class TestTime:
    """Nobody was told that a simulation takes hours."""

    def test_it_is_foreseen_before_it_begins(self, monkeypatch) -> None:
        """A few pulses are recorded and imaged by the clock, here one that counts how often it is asked."""

        class BegunError(Exception):
            pass

        def foreseen(pulses: int) -> float:
            clock, said = itertools.count(), []

            def told(seconds: float) -> None:
                said.append(seconds)
                raise BegunError

            with monkeypatch.context() as patched:
                patched.setattr(time, "perf_counter", lambda: float(next(clock)))
                mission = load_mission(str(SECTION_V), None, [SetValue("collection.pulses", str(pulses))])
                with pytest.raises(BegunError):
                    simulate_point(mission, foreseen=told, progress=lambda *_: pytest.fail("it has begun"))
            return said[0]

        # Two times of an image and of its record, with errors and without, and one of the scene's.
        assert foreseen(4096) == pytest.approx(2 * foreseen(2048))
        assert foreseen(4096) > 2 * 4096 / 64

    def test_a_short_verification_is_not_measured(self) -> None:
        assert seconds_to_verify(load_mission(str(SECTION_V))) == 0.0

    def test_a_long_one_grows_with_its_rows(self, monkeypatch) -> None:
        """Measured are images of two sizes; the rest is counted."""
        monkeypatch.setattr("bisar_budget.verifier.limits._SLOWEST_IMAGE_S", 1e3)
        monkeypatch.setattr("bisar_budget.verifier.limits._seconds", lambda study, cells: 10.0)
        mission = load_mission(str(SECTION_V))
        rows = rows_to_verify(mission)
        whole = seconds_to_verify(mission)
        assert whole >= 10.0 * len(rows)
        assert seconds_to_verify(mission, jobs=2) == pytest.approx(whole / 2)
        assert 10.0 <= seconds_to_verify(mission, rows[0]) < whole / 2

    def test_a_larger_image_takes_what_a_larger_one_took(self, monkeypatch) -> None:
        """A small image takes more for its size than a large one: 97 s were foreseen as 216 s."""
        monkeypatch.setattr("bisar_budget.verifier.limits._SLOWEST_IMAGE_S", 1e3)
        mission, seconds = load_mission(str(SECTION_V)), {}
        for large in (10.0, 320.0):
            took = {48: 10.0, 8 * 48: large}
            monkeypatch.setattr("bisar_budget.verifier.limits._seconds", lambda study, cells, took=took: took[cells])
            seconds[large] = seconds_to_verify(mission)
        assert seconds[10.0] < seconds[320.0]

    def test_the_smallest_pair_is_measured(self, monkeypatch) -> None:
        monkeypatch.setattr("bisar_budget.verifier.limits._SLOWEST_IMAGE_S", 1e3)
        assert 0 < seconds_to_verify(load_mission(str(SECTION_V)), "timing.quadratic") < 60

    @pytest.mark.parametrize("command", ["verify", "simulate"])
    def test_the_command_says_so_and_what_to_change(self, run, monkeypatch, command) -> None:
        monkeypatch.setattr("bisar_budget.questions.progress.MIN_ANNOUNCED_S", 1e-9)
        monkeypatch.setattr("bisar_budget.verifier.limits._SLOWEST_IMAGE_S", 1e3)
        result = run(command, SECTION_V, *(["--only", "timing.quadratic"] if command == "verify" else []))
        (line,) = [line for line in result.stderr.splitlines() if line.startswith("Forming the images of ")]
        assert re.search(r"will take about [\d.]+ (s|minutes); ", line)
        assert ("--only" if command == "verify" else "collection.pulses") in line
        assert "Forming" not in result.stdout

    def test_a_short_one_is_silent(self, run) -> None:
        assert run("verify", SECTION_V, "--only", "timing.quadratic").stderr == ""
