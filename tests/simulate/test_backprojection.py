"""Backprojection, in NumPy and compiled, against the matched filter (4), which approximates nothing."""

import importlib.util
import math
import os
import subprocess
import sys
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.geometry import BistaticGeometry
from bisar_budget.simulator.image_formation import backprojection, ground_grid, matched_filter
from bisar_budget.simulator.phase_history import PhaseHistory
from tests.conftest import ROOT, examples
from tests.simulate.conftest import Collection, collection, platform

NUMBA = importlib.util.find_spec("numba") is not None
pytestmark = pytest.mark.extras
needs_numba = pytest.mark.skipif(not NUMBA, reason="the compiled kernels need Numba, extra fast")
# Error promised, relative to the strongest scatterer. One pulse at the edge of the band has for the cubic spline
# (1/(2M - 1))⁴ with M = 16 samples a cell (-119 dB). A band filled evenly has a third of that, and pulses average it.
PROMISED = {"numpy": -118, "cubic": -119}
KERNELS = ["numpy", pytest.param("cubic", marks=needs_numba)]
SCATTERERS, AMPLITUDES = np.array([[3.0, -2, 0], [-6, 5, 0], [0, 0, 4]]), (1, 0.5j, -0.7)


def near(**options) -> Collection:
    """A receiver at 1.5 km, squinted by 28°."""
    geometry = BistaticGeometry(
        transmitter=platform(31e3, 6e3, 0.0, 150.0, 0.5), receiver=platform(1.5e3, 500, 0.7, 60.0, 0.5)
    )
    return Collection(geometry, **options)


def error_db(c: Collection, kernel: str, at=(1.0, 2.0), size=(8.0, 12.0), shape=(24, 41)) -> float:
    history = c.record(np.array([*at, 0.0]) + SCATTERERS, AMPLITUDES)
    points = ground_grid(at, c.geometry.look_azimuth, size, shape)
    return difference_db(history, points, kernel)


def difference_db(history: PhaseHistory, points, kernel: str) -> float:
    difference = backprojection(history, points, kernel) - matched_filter(history, points)
    return 20 * math.log10(np.abs(difference).max())


@pytest.mark.parametrize("kernel", KERNELS)
class TestAgainstTheMatchedFilter:
    @pytest.mark.parametrize("pulses", [1, 2, 63])
    @pytest.mark.parametrize("frequencies", [1, 37, 96])
    def test_any_number_of_pulses_and_frequencies(self, kernel, pulses, frequencies) -> None:
        assert error_db(collection(20, pulses=pulses, frequencies=frequencies), kernel) < PROMISED[kernel]

    @pytest.mark.parametrize("shape", [(1, 1), (1, 96), (96, 1), (33, 2), (5, 65)])
    def test_any_shape(self, kernel, shape) -> None:
        assert error_db(collection(pulses=32), kernel, shape=shape) < PROMISED[kernel]

    @pytest.mark.parametrize("squint", [-60, 50])
    def test_squinted(self, kernel, squint) -> None:
        assert error_db(collection(squint, pulses=64), kernel) < PROMISED[kernel]

    def test_receiver_nearby(self, kernel) -> None:
        assert error_db(near(pulses=64), kernel, size=(4.0, 8.0)) < PROMISED[kernel]

    def test_a_tenth_of_a_metre_of_resolution(self, kernel) -> None:
        assert error_db(near(pulses=64, frequencies=256, bandwidth=3e9), kernel) < PROMISED[kernel]

    def test_bistatic_angle_of_150_degrees(self, kernel) -> None:
        geometry = BistaticGeometry(
            transmitter=platform(31e3, 6e3, 0.0, 150.0, 0.3),
            receiver=platform(8.5e3, 2e3, math.radians(150), 60.0, -0.2),
        )
        assert error_db(Collection(geometry, pulses=64), kernel) < PROMISED[kernel]

    def test_curved_paths(self, kernel) -> None:
        """Turns of 0.3 g and a climb: 13 m off the straight line at the ends."""
        c = near(pulses=64)
        turning = BistaticGeometry(
            transmitter=replace(c.geometry.transmitter, acceleration=(2.0, -1.0, 1.0)),
            receiver=replace(c.geometry.receiver, acceleration=(-1.5, 2.5, 0.5)),
        )
        assert error_db(Collection(turning, pulses=64), kernel, size=(4.0, 8.0)) < PROMISED[kernel]

    def test_far_from_the_scene_centre_no_phase_is_lost(self, kernel) -> None:
        """Four kilometres are 10⁵ wavelengths, where single precision knows hundredths of one; profiles repeat."""
        assert error_db(collection(30, pulses=64), kernel, at=(3000.0, -2500.0)) < PROMISED[kernel]

    def test_coarse_pixels_leave_the_expansion(self, kernel) -> None:
        assert error_db(near(pulses=16), kernel, size=(300.0, 400.0), shape=(9, 40)) < PROMISED[kernel]

    def test_pixels_anywhere(self, kernel) -> None:
        history = collection(pulses=64).record(SCATTERERS, AMPLITUDES)
        points = np.random.default_rng(1).normal(0.0, 8.0, (3, 5, 7, 3))
        assert backprojection(history, points, kernel).shape == (3, 5, 7)
        assert difference_db(history, points, kernel) < PROMISED[kernel]

    def test_few_pixels_far_apart(self, kernel) -> None:
        """What lies between their ranges is not refined: compiled, each is read by the kernel itself."""
        history = collection(30, pulses=48).record(SCATTERERS, AMPLITUDES)
        points = np.concatenate((SCATTERERS, np.random.default_rng(2).uniform(-3e3, 3e3, (20, 3))))
        assert difference_db(history, points, kernel) < PROMISED[kernel]

    def test_one_point_and_none(self, kernel) -> None:
        history = collection(pulses=16).record([1.0, 2.0, 0.0], [3 - 4j])
        assert backprojection(history, np.array([1.0, 2.0, 0.0]), kernel) == pytest.approx(3 - 4j, rel=1e-3)
        assert backprojection(history, np.empty((0, 3)), kernel).shape == (0,)
        assert backprojection(history, np.empty((4, 0, 3)), kernel).shape == (4, 0)

    def test_a_lost_sample_shows(self, kernel) -> None:
        history = collection(pulses=16).record(SCATTERERS, AMPLITUDES)
        history.samples[3, 5] = np.nan
        grid = ground_grid((0, 0), 0.0, (4, 4), (4, 40))
        with np.errstate(invalid="ignore"):
            assert np.isnan(backprojection(history, grid, kernel)).all()

    @pytest.mark.parametrize("value", [math.nan, math.inf])
    def test_positions_that_are_no_numbers_are_refused(self, kernel, value) -> None:
        history = collection(pulses=16).record(SCATTERERS, AMPLITUDES)
        with pytest.raises(ValueError, match="points"):
            backprojection(history, np.array([[0.0, value, 0.0]]), kernel)
        history.receiver[3, 1] = value
        with pytest.raises(ValueError, match="receiver"):
            backprojection(history, np.zeros((1, 3)), kernel)


@needs_numba
@given(
    at=st.tuples(st.floats(-2e3, 2e3), st.floats(-2e3, 2e3)),
    turn=st.floats(-4, 4),
    spacing=st.floats(0.01, 2),
    shape=st.tuples(st.integers(1, 40), st.integers(1, 70)),
    squint=st.floats(-60, 60),
)
@examples(25)
def test_compiled_and_numpy_form_the_same_image(at, turn, spacing, shape, squint) -> None:
    history = collection(squint, pulses=8, frequencies=33).record(np.array([*at, 0.0]) + SCATTERERS, AMPLITUDES)
    points = ground_grid(at, turn, (spacing * shape[0], spacing * shape[1]), shape)
    want = backprojection(history, points, "numpy")
    assert np.abs(backprojection(history, points, "cubic") - want).max() < 10 ** (PROMISED["cubic"] / 20) + 1e-6


@needs_numba
@given(
    seed=st.integers(0, 2**32 - 1),
    shape=st.tuples(st.integers(1, 4), st.integers(1, 200)),
    length=st.floats(0, 3e3),
    bend=st.floats(-0.5, 0.5),
    is_on_a_pixel=st.booleans(),
)
@examples(50)
def test_no_pixel_is_outside_the_bounds_of_its_ranges(seed, shape, length, bend, is_on_a_pixel) -> None:
    """Profiles are refined between them. Bent lines, their pixels moved at random, some of them at a platform."""
    from bisar_budget.simulator.compiled import _boxes, _reach

    rng = np.random.default_rng(seed)
    place, line = np.linspace(-0.5, 0.5, shape[1]), np.arange(shape[0])[:, None]
    lines = np.stack(np.broadcast_arrays(length * place, line + bend * length * place**2, 0 * place), axis=-1)
    lines = lines + rng.normal(size=lines.shape) * 10.0 ** rng.uniform(-6, 2)
    platforms = rng.normal(size=(2, 6, 3)) * 10.0 ** rng.uniform(0, 5)
    if is_on_a_pixel:
        platforms[0, 2] = lines[-1, shape[1] // 2]
    nearest, farthest = _reach(*platforms, *_boxes(lines))
    legs = [np.linalg.norm(lines.reshape(-1, 1, 3) - platform, axis=-1) for platform in platforms]
    sums = legs[0] + legs[1]
    rounding = 1e-12 * (1 + sums.max())
    assert (nearest <= sums.min(axis=0) + rounding).all()
    assert (farthest >= sums.max(axis=0) - rounding).all()


@needs_numba
def test_a_pixel_on_a_platform_is_its_own_range() -> None:
    """No expansion holds there; the exact range is 0 on one leg."""
    c = collection(pulses=16)
    history = c.record([0.0, 0.0, 0.0])
    where = history.transmitter[5]
    line = where + np.arange(40)[:, None] * np.array([0.0, 0.1, 0.0])
    assert difference_db(history, line, "cubic") < PROMISED["cubic"]


@needs_numba
def test_threads_form_the_same_images(tmp_path: Path) -> None:
    """Three of them, in a process of their own: where tests share the cores, each process has one."""
    code = """
import sys
import numba, numpy as np
from bisar_budget.simulator.image_formation import backprojection
from tests.simulate.test_backprojection import many_tiles
assert numba.get_num_threads() == int(sys.argv[1])
np.save(sys.argv[2], [backprojection(*given, "cubic") for given in many_tiles()])
"""
    images = []
    for threads in ("1", "3"):
        line = [sys.executable, "-c", code, threads, str(tmp_path / f"{threads}.npy")]
        subprocess.run(line, cwd=ROOT, check=True, env={**os.environ, "NUMBA_NUM_THREADS": threads})
        images.append((tmp_path / f"{threads}.npy").read_bytes())
    assert images[0] == images[1]


def many_tiles() -> list[tuple[PhaseHistory, np.ndarray]]:
    """A history with a grid, whose lines are straight, and with the same number of pixels anywhere."""
    history = collection(pulses=32).record(SCATTERERS, AMPLITUDES)
    grid = ground_grid((0, 0), 0.3, (40, 40), (200, 200))
    return [(history, grid), (history, grid + np.random.default_rng(1).normal(size=grid.shape) * [1, 1, 0])]


def test_memory_beyond_the_inputs_stays_small() -> None:
    """A picture of 1024² pixels is 17 MB itself; the bound of the memory limit is 500 MB."""
    c = collection(pulses=4, frequencies=512)
    history = c.record(SCATTERERS, AMPLITUDES)
    points = ground_grid((0, 0), 0.3, (256, 256), (1024, 1024))
    backprojection(history, points[:2, :64])  # compiled, imported
    tracemalloc.start()
    backprojection(history, points)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 150e6


def test_without_numba_numpy_does_the_same() -> None:
    code = """
import sys
sys.modules["numba"] = None
import numpy as np
from bisar_budget.simulator.image_formation import backprojection, matched_filter
from tests.simulate.conftest import collection
history = collection(pulses=8).record([1, 2, 0])
points = np.array([[1.0, 2, 0], [0, 0, 0]])
assert np.allclose(backprojection(history, points), matched_filter(history, points), atol=1e-6)
try:
    backprojection(history, points, "cubic")
except ImportError as error:
    assert "pip install finufft numba" in str(error), error
else:
    raise AssertionError("no error")
"""
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


class TestManyFrequencies:
    """Even frequencies are split into coarse and fine ones; uneven ones are summed as they stand."""

    def test_the_matched_filter_is_the_sum_of_4_either_way(self) -> None:
        c = near(pulses=5, frequencies=23)
        history = c.record([[3.0, -2, 0]], [1])
        points = ground_grid((1.0, 2.0), 0.3, (8.0, 12.0), (6, 7))
        bent = replace(history, frequency=history.frequency * (1 + 1e-3 * np.linspace(0, 1, 23) ** 2))
        for one in (history, bent):
            want = np.zeros(points.shape[:2], dtype=complex)
            for k, (t, r) in enumerate(zip(one.transmitter, one.receiver, strict=True)):
                away = np.linalg.norm(points - t, axis=-1) + np.linalg.norm(points - r, axis=-1)
                away -= np.linalg.norm(t) + np.linalg.norm(r)
                for i, f in enumerate(one.frequency):
                    want += one.samples[k, i] * np.exp(2j * math.pi * f * away / 299792458.0)
            assert np.abs(matched_filter(one, points) - want / one.samples.size).max() < 1e-9

    @pytest.mark.parametrize("frequencies", [7, 16, 23])
    def test_echoes_of_many_are_those_of_each(self, frequencies: int) -> None:
        c = near(pulses=6, frequencies=frequencies)
        rng = np.random.default_rng(4)
        places = np.c_[rng.uniform(-40, 40, (30, 2)), np.zeros(30)]
        amplitudes = rng.normal(size=30) + 1j * rng.normal(size=30)
        each = sum(c.record([place], [a]).samples for place, a in zip(places, amplitudes, strict=True))
        assert np.abs(c.record(places, amplitudes).samples - each).max() < 1e-8
