"""Errors that both platforms have in common. Expected numbers are Tables I and II by hand."""

import math

import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.effects.combined import correlated_errors, likely_error
from bisar_budget.mission.load import parse_mission
from tests import reference
from tests.conftest import findings, mission_text, row

T, WAVELENGTH = 6.0, 299_792_458.0 / 10e9
R_T = math.hypot(30e3, 6e3)
R_R = math.sqrt(2 * 6e3**2 + 2e3**2)


def ids(**changes) -> list[str]:
    return [r.id for r in findings(**changes).rows if r.id.startswith("common.")]


def test_rows_stand_in_the_table_only_if_the_file_has_the_key() -> None:
    assert ids() == []
    every = [f"common.{kind}.{axis}" for kind in ("position", "velocity", "acceleration") for axis in "xyz"]
    assert ids(common_motion_error={"position": "1 m"}) == every
    found = findings(common_motion_error={"position": "1 m"})
    assert row(found, "common.position.x").declared == 1
    assert row(found, "common.velocity.x").status == "not_declared"


def test_the_published_effect_is_the_signed_sum_of_both_legs() -> None:
    """Table II: velocity y of a transmitter at 150 m/s and a receiver at 40 m/s along it add."""
    found = findings(common_motion_error={"velocity": "1 mm/s", "acceleration": "10 um/s^2"})
    speed = math.pi * T**2 / (2 * WAVELENGTH) * (150 / R_T + 40 / R_R)
    assert row(found, "common.velocity.y").qpe_published_rad == pytest.approx(1e-3 * speed)
    assert row(found, "common.velocity.y").allowable_published == pytest.approx(math.pi / 4 / speed)
    assert row(found, "common.velocity.x").qpe_published_rad == pytest.approx(
        1e-3 * math.pi * T**2 / (2 * WAVELENGTH) * 40 / R_R
    )
    bend = math.pi * T**2 / (4 * WAVELENGTH) * (30e3 / R_T + 6e3 / R_R)
    assert row(found, "common.acceleration.x").qpe_published_rad == pytest.approx(1e-5 * bend)


def test_with_both_platforms_in_one_place_it_is_the_two_way_rule() -> None:
    platforms = {
        name: {"position": ["20 km", 0, "6 km"], "velocity": [0, "100 m/s", 0]}
        for name in ("transmitter", "receiver")
    }
    found = findings(platforms=platforms, common_motion_error={"velocity": "1 mm/s"})
    for axis in "xyz":
        one = row(found, f"receiver.velocity.{axis}")
        both = row(found, f"common.velocity.{axis}")
        # Along x and z exact ranges bind by their second order, which of a common error is another one.
        if axis == "y":
            assert both.allowable_full == pytest.approx(one.allowable_full)
    # The platform has half of the total: the common error, twice as strong, has all of it.
    assert row(found, "common.velocity.y").qpe_published_rad == pytest.approx(
        2 * math.pi * T**2 * 100 * 1e-3 / (2 * WAVELENGTH * math.hypot(20e3, 6e3))
    )


def test_legs_that_cancel_leave_no_limit() -> None:
    """Platforms mirrored in the north-south line: accelerations along x cancel, but for what looks turn by."""
    platforms = {
        "transmitter": {"position": ["17 km", "9 km", "5 km"], "velocity": [0, "100 m/s", 0]},
        "receiver": {"position": ["-17 km", "9 km", "5 km"], "velocity": ["60 m/s", "80 m/s", 0]},
    }
    found = findings(platforms=platforms, common_motion_error={"acceleration": "1 ug"})
    one = row(found, "common.acceleration.x")
    assert one.allowable is None
    assert one.qpe_published_rad == 0
    assert "cancel" in one.reason
    # What is left, of platforms that do not fly as mirror images, is that of the reference's exact ranges.
    mission = parse_mission(mission_text(platforms=platforms, common_motion_error={"acceleration": "1 ug"}))
    (error,) = [one for one in reference.errors_of(mission) if one.id == "common.acceleration.x"]
    ahead, back = reference.at_declared(mission, [error._replace(declared=1e4 * one.declared)]).qpe[:, 0]
    assert one.qpe_full_rad == pytest.approx((ahead - back) / 2e4, rel=1e-3)
    assert one.qpe_full_rad != 0


def test_it_is_held_to_the_total_and_counts_for_the_mission_alone() -> None:
    text = {"common_motion_error": {"velocity": [0, "1 mm/s", 0]}, "allocation__combine": "rss"}
    found = findings(**text, platforms__receiver__motion_error={"velocity": [0, "3 mm/s", 0]})
    own = row(found, "receiver.velocity.y").qpe_published_rad
    common = row(found, "common.velocity.y").qpe_published_rad
    assert row(found, "receiver.quadratic_phase_error").declared == pytest.approx(own)
    assert row(found, "mission.quadratic_phase_error").declared == pytest.approx(math.hypot(own, common))
    assert "both platforms" in row(found, "common.velocity.y").notes[0]
    worst = findings(
        **{**text, "allocation__combine": "sum"}, platforms__receiver__motion_error={"velocity": "3 mm/s"}
    )
    assert (
        row(worst, "mission.quadratic_phase_error").declared > row(worst, "receiver.quadratic_phase_error").declared
    )


def test_coverage_factor_evidence_and_line() -> None:
    changes = {"common_motion_error": {"position": ["1 m", "-2 m", 0], "source": "ICD"}}
    found = findings(**changes, allocation__coverage_factor=3)
    assert row(found, "common.position.y").declared == 6
    assert row(found, "common.position.x").evidence == "ICD"
    lines = mission_text(**changes).splitlines()
    assert "-2 m" in lines[row(found, "common.position.y").line - 1]
    assert row(found, "mission.location_error").declared == pytest.approx(6)


def test_likely_error_has_one_sigma_of_phase_at_a_distance_of_one_sigma() -> None:
    """Cg/√(gᵀCg): g·e is the standard deviation, and eᵀC⁻¹e is 1, which no other such error goes below."""
    np = pytest.importorskip("numpy")
    covariance = {"position": "0.5 m", "velocity": "5 mm/s", "correlation": {"velocity.x-velocity.y": -0.8}}
    mission = parse_mission(
        mission_text(platforms__receiver__motion_error={"covariance": covariance}, allocation__coverage_factor=2)
    )
    (group,) = correlated_errors(mission)
    sources = {source.id: source for source in Analysis(mission).sources}
    members = [sources[row_id] for row_id in group.ids]
    error = np.array(likely_error(group, members))
    sizes = np.array([source.declared for source in members])
    c = np.outer(sizes, sizes) * np.array(group.correlation)
    g = np.array([source.full.qpe for source in members])
    assert g @ error == pytest.approx(math.sqrt(g @ c @ g))
    assert error @ np.linalg.solve(c, error) == pytest.approx(1)
