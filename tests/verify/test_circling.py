"""Images of a drone on a circle: pixels sample what the whole aperture resolves, and show where the image peaks."""

import math
from pathlib import Path

import pytest

from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.model import Mission
from bisar_budget.simulator.point import simulate_point
from bisar_budget.verifier.limits import verify_mission
from tests.simulate.conftest import only_rotated_images

RATE = 0.025  # rad/s
ROUND_S = 2 * math.pi / RATE


def circling(folder: Path, aperture_s: float, model: str = "full") -> Mission:
    """P band, a mast, and a drone on a circle of 1 km at 500 m whose position is 10 cm off in x."""
    fixes = (f"{t},{1e3 * math.cos(RATE * t):.9f},{1e3 * math.sin(RATE * t):.9f},500" for t in range(-130, 131))
    (folder / "circle.csv").write_text("\n".join(("time [s],east [m],north [m],up [m]", *fixes)))
    (folder / "circle.yaml").write_text(
        f"""
schema_version: 1
name: circling drone
radar: {{center_frequency: 435 MHz, bandwidth: 100 MHz}}
collection: {{aperture_time: {aperture_s} s}}
platforms:
  transmitter: {{position: [600 m, 500 m, 60 m], velocity: [0, 0, 0]}}
  receiver:
    trajectory: {{file: circle.csv, center: 0 s}}
    motion_error: {{position: [10 cm, 0, 0]}}
requirements: {{location_error: 6 cm}}
allocation: {{model: {model}}}
"""
    )
    return load_mission(folder / "circle.yaml")


@pytest.mark.parametrize("aperture_s", [100.0, 150.0, ROUND_S])
def test_the_image_peaks_where_exact_ranges_have_it(tmp_path: Path, aperture_s: float) -> None:
    """Pixels by the gradients of mid-aperture put it up to 17 mm off, and the limit was called optimistic."""
    (row,) = verify_mission(circling(tmp_path, aperture_s), "mission.location_error").rows
    assert row.verdict == "confirmed", row
    assert math.hypot(*row.displacement_m) == pytest.approx(0.06, abs=1e-6)
    assert math.dist(row.displacement_m, row.measured_displacement_m) < 1e-5


def test_a_displacement_by_gradients_of_mid_aperture_is_optimistic(tmp_path: Path) -> None:
    """By (25) the image moves by some half of what it does."""
    (row,) = verify_mission(circling(tmp_path, 100.0, "published"), "mission.location_error").rows
    assert row.verdict == "optimistic"
    assert math.hypot(*row.measured_displacement_m) > 1.3 * 0.06


def test_images_measure_the_phase_of_equal_loss_and_the_quadratic_one(tmp_path: Path) -> None:
    """Doppler turns back within 3.75 rad: two moments look alike along a line, which showed 0.035 rad for 0.085."""
    (row,) = verify_mission(circling(tmp_path, 150.0), "receiver.position.x").rows
    assert row.verdict == "confirmed"
    assert row.measured_equal_loss_qpe_rad == pytest.approx(row.equal_loss_qpe_rad, rel=0.01)
    assert row.measured_qpe_rad == pytest.approx(
        row.predicted_qpe_rad, abs=0.02
    )  # as far as a measured phase is known


def test_a_full_circle_is_imaged_as_wide_as_it_resolves(tmp_path: Path) -> None:
    mission = circling(tmp_path, ROUND_S)
    with only_rotated_images():
        images = simulate_point(mission)
    resolution = Case(Analysis(mission)).resolution
    assert images.clean_response.irw_m == pytest.approx(resolution.cross_range_half_power, rel=5e-3)
    assert images.clean_response.peak == pytest.approx(1.0, abs=1e-3)
    assert images.effect.displacement[0] == pytest.approx(0.0994, abs=1e-4)
