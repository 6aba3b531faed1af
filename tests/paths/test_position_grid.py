"""The grid on which a log writes its fixes: found where it rounds, and nowhere else."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.paths.earth import earth_fixed_places
from bisar_budget.paths.position_grid import cartesian_grid, decimal_step, geodetic_grid
from tests.conftest import examples

TIMES = np.arange(200) / 10
DEGREE, MINUTE = math.pi / 180, math.pi / 10_800


def wandering(seed: int, size: float) -> np.ndarray:
    """A random walk: nothing that a polynomial follows."""
    return size * np.cumsum(np.random.default_rng(seed).normal(size=TIMES.size))


@examples(60)
@given(decimals=st.integers(0, 7), seed=st.integers(0, 2**32 - 1), offset=st.floats(-1e4, 1e4))
def test_the_decimals_of_metres_are_found(decimals: int, seed: int, offset: float) -> None:
    written = np.round(offset + wandering(seed, 30 * 10.0**-decimals), decimals)
    assert decimal_step(TIMES, written, (1.0,)) == pytest.approx(10.0**-decimals)


@examples(60)
@given(decimals=st.integers(3, 9), seed=st.integers(0, 2**32 - 1), is_minutes=st.booleans())
def test_the_decimals_of_degrees_and_minutes_are_found(decimals: int, seed: int, is_minutes: bool) -> None:
    unit = MINUTE if is_minutes else DEGREE
    written = np.round(48.1 * DEGREE / unit + wandering(seed, 30 * 10.0**-decimals), decimals)
    degrees = written // 60 + written % 60 / 60 if is_minutes else written  # as NMEA does
    units = (DEGREE, MINUTE, MINUTE / 60)
    assert decimal_step(TIMES, np.radians(degrees), units) == pytest.approx(unit * 10.0**-decimals, rel=1e-6)


def test_zeros_at_the_end_of_a_cell_are_no_finer_grid() -> None:
    """A file writes six decimals of what was rounded to one."""
    written = np.array([float(f"{one:.6f}") for one in np.round(3000 + wandering(1, 3.0), 1)])
    assert decimal_step(TIMES, written, (1.0,)) == pytest.approx(0.1)


@pytest.mark.parametrize(
    "exact",
    [
        np.full(TIMES.size, 3000.0),
        6.0 * TIMES,
        3000 + 0.5 * TIMES + 0.125 * TIMES**2,
        3000 + 50 * np.sin(0.1 * TIMES),
        3000 + np.random.default_rng(0).normal(0, 0.01, TIMES.size),
    ],
    ids=["at rest", "round speed", "climb", "full precision", "noise of full precision"],
)
def test_a_path_of_exact_numbers_has_no_grid(exact: np.ndarray) -> None:
    assert decimal_step(TIMES, exact, (1.0,)) < 1e-9


def test_a_slow_axis_has_its_grid() -> None:
    """3 cm/s of climb in steps of 0.1 m: a stair."""
    assert decimal_step(TIMES, np.round(3000 + 0.03 * TIMES, 1), (1.0,)) == pytest.approx(0.1)


def test_few_fixes_tell_nothing() -> None:
    assert decimal_step(TIMES[:11], np.round(wandering(0, 3.0)[:11], 1), (1.0,)) == 0.0


def test_steps_of_degrees_are_metres_north_and_east() -> None:
    """Radii of curvature of WGS-84 at 48°: 6371 km along the meridian, 6390 km across it, 3 km up."""
    at = math.radians(48)
    latitude = np.radians(np.round(48 + wandering(3, 1e-4), 5))
    longitude = np.radians(np.round(11 + wandering(4, 1e-4), 5))
    grid = np.array(geodetic_grid(TIMES, latitude, longitude, np.full(TIMES.size, 3000.0)))
    a, e2 = 6378137.0, 6.69437999014e-3
    root = 1 - e2 * math.sin(at) ** 2
    expected = [a * (1 - e2) / root**1.5 + 3000, (a / math.sqrt(root) + 3000) * math.cos(at), 0.0]
    assert np.linalg.norm(grid, axis=1) == pytest.approx(np.radians(1e-5) * np.array(expected), rel=1e-3)
    up = earth_fixed_places(np.array([at]), np.array([math.radians(11)]), np.array([3000.0]))[0]
    assert np.abs(grid @ up / np.linalg.norm(up)).max() < 0.01 * np.linalg.norm(grid, axis=1).max()


def test_axes_of_a_cartesian_log_have_their_own() -> None:
    places = np.stack([np.round(wandering(1, 3.0), 1), np.round(wandering(2, 3.0), 2), 0 * TIMES], axis=1)
    assert np.array(cartesian_grid(TIMES, places)) == pytest.approx(np.diag([0.1, 0.01, 0.0]))
