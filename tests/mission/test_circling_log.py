"""A drone that circles, by the log of its flight: everything flies the same pieces.

The reference knows the true circle alone; it takes nothing from the package.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bisar_budget as bb
from bisar_budget.budget.check import check_mission
from bisar_budget.effects.sources import ErrorListing, exact_ranges
from bisar_budget.error_kinds.path_kinds import POSITION_KIND
from bisar_budget.image_plane import nodes_for
from bisar_budget.mission.model import Mission
from bisar_budget.simulator.phase_history import PathError, path
from tests.conftest import TODAY, row
from tests.image_point import Collection, circle, flight, no_error
from tests.paths.test_pieces import HEIGHT, RADIUS, RATE, TURN_S, fixes, race_track

TRUE = circle(RADIUS, HEIGHT, RATE, 0.0)
MAST = (600.0, 500.0, 60.0)  # m
FARTHER = np.array([0.0, -10_000.0, 0.0])  # m
MISSION = """schema_version: 1
name: circling drone
radar: {{ center_frequency: 435 MHz, bandwidth: 100 MHz }}
collection: {{ aperture_time: {aperture_s} s }}
platforms:
  transmitter: {{ position: [600 m, 500 m, 60 m], velocity: [0 m/s, 0 m/s, 0 m/s] }}
  receiver:
    trajectory: {{ file: log.csv, processed: smoothed }}
    motion_error: {{ {error} }}
requirements: {{ location_error: 6 cm }}
"""
SHIFTED = "position: [10 cm, 0 cm, 0 cm]"


def logged(folder: Path, aperture_s: float, error: str = SHIFTED, flown: Any = TRUE, rate: float = 2.0) -> Mission:
    """A mission whose receiver flies a clean log, to 0.1 µm."""
    times = fixes(aperture_s, rate)
    lines = [f"{t:.6f},{x:.7f},{y:.7f},{z:.7f}" for t, (x, y, z) in zip(times, flown(times), strict=True)]
    (folder / "log.csv").write_text("\n".join(["time [s],east [m],north [m],up [m]", *lines, ""]))
    (folder / "m.yaml").write_text(MISSION.format(aperture_s=aperture_s, error=error))
    return bb.load(folder / "m.yaml")


def location(mission: Mission) -> float:
    """Location error that a check reaches. [m]"""
    return float(row(check_mission(mission, TODAY), "mission.location_error").declared)


@pytest.mark.parametrize("aperture_s", [100.0, TURN_S, 2 * TURN_S])
def test_a_check_flies_the_true_circle(aperture_s: float, tmp_path: Path) -> None:
    """A location error of 6 cm is exceeded, by as much as the reference says of the formula."""
    mission = logged(tmp_path, aperture_s)
    truth = Collection(
        435e6, 100e6, aperture_s, (flight(MAST, (0, 0, 0)), TRUE), (no_error, flight((0.1, 0, 0), (0, 0, 0)))
    )
    assert mission.platforms.receiver.path.pieces > 1
    assert location(mission) == pytest.approx(np.hypot(*truth.least_variance_point().point), rel=1e-4)


def test_verify_confirms_it(tmp_path: Path) -> None:
    """An image by every pulse along the pieces, over 2.5 rad of the circle."""
    mission = logged(tmp_path, 100.0)
    document = bb.verify(mission, "mission.location_error").to_dict()
    (seen,) = document.get("rows") or document["missions"][0]["rows"]
    assert seen["verdict"] == "confirmed"
    assert np.subtract(seen["measured_displacement_m"], seen["displacement_full_m"]) == pytest.approx(
        [0, 0], abs=1e-3
    )


def test_simulate_flies_the_true_circle_and_what_a_late_navigation_has_of_it(tmp_path: Path) -> None:
    state = logged(tmp_path, TURN_S).geometry.receiver
    times = np.linspace(-TURN_S / 2, TURN_S / 2, 999)
    flown = path(state, times, PathError(time_tag=0.3))
    assert flown.actual == pytest.approx(TRUE(times), abs=1e-3)
    inside = np.abs(times + 0.3) < TURN_S / 2
    assert flown.measured[inside] == pytest.approx(TRUE(times + 0.3)[inside], abs=1e-3)


def test_a_sweep_is_the_check_of_each_case(tmp_path: Path) -> None:
    mission = logged(tmp_path, TURN_S)
    values = np.array([20e6, 100e6])
    swept = bb.sweep(mission, {"radar.bandwidth": values}, columns=["mission.location_error.declared"], date=TODAY)
    expected = [location(mission.replace({"radar.bandwidth": f"{value} Hz"})) for value in values]
    assert np.ravel(swept["mission.location_error.declared"]) == pytest.approx(expected, rel=1e-6)


def test_a_race_track_has_a_node_for_each_of_its_turns(tmp_path: Path) -> None:
    """Far off, its way is short beside the range: numbers are those of four times as many nodes."""
    mission = logged(tmp_path, 300.0, flown=lambda times: race_track(times) + FARTHER, rate=10.0)
    geometry = mission.geometry
    count = nodes_for(geometry, 300.0)
    assert count >= 1.5 * mission.platforms.receiver.path.pieces
    own, fine = (
        np.array(
            [[e.qpe, e.east, e.north] for e in ErrorListing(mission, geometry, exact).full_legs(1, POSITION_KIND)],
            float,
        )
        for exact in (exact_ranges(mission, geometry, nodes) for nodes in (count, 4 * count))
    )
    assert (np.abs(own - fine).max(axis=0) < 1e-5 * np.abs(fine).max(axis=0)).all()
