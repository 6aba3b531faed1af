"""Limits where a narrow band hides most of what defocuses: images of passive radar lose what exact ranges say."""

import numpy as np
import pytest

from bisar_budget.mission.load import parse_mission
from bisar_budget.verifier.limits import verify_mission
from tests.conftest import mission_text
from tests.image_point import Collection, flight, no_error

DVB_T = {"radar": {"center_frequency": 602e6, "bandwidth": 7.61e6}, "collection": {"aperture_time": 60}}
PASSIVE = {
    "transmitter": {"position": [-18e3, 9e3, 420], "velocity": [0, 0, 0]},
    "receiver": {
        "position": [-2e3, -7e3, 2500], "velocity": [-65, 8, 0], "motion_error": {"velocity": [0, 0.05, 0]},
    },
}  # fmt: skip
FORWARD = {
    "transmitter": {
        "position": [-18e3, 0, 420], "velocity": [0, 0, 0], "motion_error": {"position": [1, 0, 0]},
    },
    "receiver": {"position": [3e3, 200, 2000], "velocity": [5, 25, 0]},
}  # fmt: skip


@pytest.mark.parametrize(
    ("platforms", "row_id", "limit"),
    [
        # An independent search for the image point by exact ranges: 5 cm/s have an equal-loss phase of 0.957 rad,
        # and 1 m one of 0.153 rad; the limit is that of π/8.
        (PASSIVE, "receiver.velocity.y", 0.0205),
        (FORWARD, "transmitter.position.x", 2.56),
    ],
)
def test_images_at_a_limit_lose_as_much_as_the_budget(platforms: dict, row_id: str, limit: float) -> None:
    """The phase alone would call both limits more than three times too strict."""
    mission = parse_mission(mission_text(**DVB_T, platforms=platforms, allocation__model="full"))
    (row,) = verify_mission(mission, row_id).rows
    assert row.boundary_error == pytest.approx(limit, rel=5e-3)
    assert row.verdict == "confirmed", row
    assert row.equal_loss_qpe_rad == pytest.approx(row.budget_rad, rel=1e-3)
    assert row.measured_equal_loss_qpe_rad == pytest.approx(row.budget_rad, rel=5e-3)
    assert row.measured_qpe_rad < row.budget_rad / 3
    assert row.measured_inside_rad < row.measured_equal_loss_qpe_rad < row.measured_beyond_rad


def test_a_displacement_is_read_where_direct_sums_have_the_peak() -> None:
    """At 12 m, where the image has lost 2 dB. Over a minute the aperture resolves range finer than the band does.

    Pixels of the band's cells of 32 m put it 1.9 m beside, and called the limit optimistic.
    """
    text = mission_text(**DVB_T, platforms=PASSIVE, allocation__model="full", requirements__location_error=12)
    (row,) = verify_mission(parse_mission(text), "mission.location_error").rows
    paths = flight((-18e3, 9e3, 420), (0, 0, 0)), flight((-2e3, -7e3, 2500), (-65, 8, 0))
    unit = Collection(602e6, 7.61e6, 60.0, paths, (no_error, flight((0, 0, 0), (0, 0.05, 0))))
    size = 0.05 * 12 / np.hypot(*unit.least_variance_point().point)
    limit = Collection(602e6, 7.61e6, 60.0, paths, (no_error, flight((0, 0, 0), (0, size, 0))))
    peak, level = limit.peak(limit.least_variance_point().point, 1.0)
    assert level == pytest.approx(-1.8, abs=0.2)
    assert row.verdict == "confirmed"
    assert row.measured_displacement_m == pytest.approx(peak, abs=0.03)
