"""Verdicts: what images at the boundary must say, on both sides of it."""

import math
import re
from datetime import date
from functools import cache

import numpy as np
import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.findings.images import Verdict
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.simulator import collection as collection_module
from bisar_budget.simulator.image_formation import backprojection
from bisar_budget.simulator.phase_history import NoGroundPointError
from bisar_budget.verifier.limits import rows_to_verify, verify_mission
from bisar_budget.verifier.study import Study
from tests import families
from tests.conftest import ROOT, mission_text
from tests.responses import shown_db

SECTION_V = ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"


@cache
def verified_section_v() -> dict[str, Verdict]:
    """Every row of the paper's example that has an image, by its id: verified once, by one process."""
    return {row.id: row for row in verify_mission(load_mission(str(SECTION_V))).rows}


def verdicts(only: str = "*", **changes):
    return {row.id: row for row in verify_mission(parse_mission(mission_text(**changes)), only).rows}


@pytest.mark.parametrize("path", sorted(SECTION_V.parent.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_row_with_a_limit_has_a_verdict_or_a_reason(path) -> None:
    mission = load_mission(str(path))
    limited = [row.id for row in check_mission(mission, date(2026, 1, 1)).rows if row.allowable is not None]
    assert [row_id for row_id in rows_to_verify(mission) if not row_id.startswith("mission.vibration")] == limited


def test_the_scenes_edge_has_a_reason() -> None:
    """Its row has a limit, and no image of one point shows a difference between two."""
    mission = parse_mission(mission_text(scene={"radius": "250 m"}, allocation={"model": "full"}))
    limited = [row.id for row in check_mission(mission, date(2026, 1, 1)).rows if row.allowable is not None]
    assert rows_to_verify(mission) == limited
    (row,) = verify_mission(mission, "mission.spatial_variance").rows
    assert (row.verdict, row.budget_rad) == ("not_evaluated", pytest.approx(math.pi / 4))
    assert "two points" in row.reason


def test_acceleration_and_clock_limits_of_section_v() -> None:
    rows = verified_section_v()
    assert set(rows) == {
        "transmitter.velocity.y", "transmitter.acceleration.x", "transmitter.acceleration.z",
        "receiver.velocity.x", "receiver.velocity.y",
        "receiver.acceleration.x", "receiver.acceleration.y", "receiver.acceleration.z", "timing.quadratic",
    }  # fmt: skip
    for row in rows.values():
        assert row.measured_qpe_rad == pytest.approx(row.predicted_qpe_rad, rel=0.01)
        assert row.measured_inside_rad == pytest.approx(0.9 * row.measured_qpe_rad, rel=0.01)
        assert row.measured_beyond_rad == pytest.approx(1.1 * row.measured_qpe_rad, rel=0.01)


def test_acceleration_limits_are_true_and_the_receivers_velocity_limit_is_not() -> None:
    """At broadside the displacement adds 6 % for the receiver along y, and takes as much along x."""
    rows = verified_section_v()
    assert rows["receiver.acceleration.x"].verdict == "confirmed"
    assert rows["receiver.velocity.y"].verdict == "optimistic"
    assert rows["receiver.velocity.x"].verdict == "conservative"
    assert rows["receiver.velocity.y"].measured_qpe_rad / (math.pi / 8) == pytest.approx(1.06, abs=0.01)


def test_a_response_at_the_limit_is_hardly_wider() -> None:
    """π/8: 0.3 % wider, 0.06 dB down, PSLR -12.94 dB, from the table of the impulse response."""
    row = verdicts("timing.quadratic")["timing.quadratic"]
    assert row.irw_ratio == pytest.approx(1.003, abs=0.001)
    assert row.peak_loss_db == pytest.approx(0.06, abs=0.005)
    assert row.pslr_db == pytest.approx(-12.94, abs=0.05)


def test_at_a_squint_the_published_velocity_limits_are_untrue() -> None:
    """30°, receiver along y: brute force found 2.11 rad where four limits promise 1.571, so 1.34 times the budget."""
    from tests.simulate.conftest import collection

    geometry = collection(30).geometry
    platforms = {
        name: {
            "position": list(getattr(geometry, name).position),
            "velocity": list(getattr(geometry, name).velocity),
        }
        for name in ("transmitter", "receiver")
    }
    row = verdicts("receiver.velocity.y", platforms=platforms)["receiver.velocity.y"]
    assert row.verdict == "optimistic"
    assert row.measured_qpe_rad / row.budget_rad == pytest.approx(2.11 / 1.571, rel=0.03)


def test_a_response_close_to_the_receiver_is_cut_along_its_ellipse() -> None:
    """1.5 km away a straight cut of 560 m leaves the range cell of 3.5 m and measured twice the phase."""
    mission = load_mission(str(ROOT / "specs" / "missions" / "sentinel1_fixed_receiver.yaml"))
    rows = {row.id: row for row in verify_mission(mission).rows}
    # (25) has a height move the image by 5 m where exact ranges and the image show 34 m.
    height = rows.pop("receiver.position.z")
    assert (height.verdict, math.hypot(*height.measured_displacement_m)) == ("optimistic", pytest.approx(34, abs=0.1))
    for row in rows.values():
        assert row.verdict == "confirmed", row.id


@pytest.mark.parametrize("cycles", [4.3, 10])
def test_paired_echo_of_one_platform_at_the_published_limit(cycles: float) -> None:
    """A phase of peak √(PSLR/2) makes echoes of half that: PSLR/8, 9 dB inside the requirement."""
    vibration = {"sinusoidal": [{"amplitude": 1e-6, "frequency": cycles / 6}]}
    row_id = "receiver.vibration.sinusoidal.0"
    rows = verdicts(row_id, requirements__pslr=-30, platforms__receiver__motion_error={"vibration": vibration})
    assert rows[row_id].measured_db == pytest.approx(-30 - 10 * math.log10(8), abs=0.4)
    assert rows[row_id].verdict == "conservative"


def test_an_echo_beyond_f0_over_b_cells_smears_in_range() -> None:
    """It keeps its range where a scatterer would walk: the mean of sinc over 37.2·B/f₀ = 1.12 cells, -1.5 dB."""
    vibration = {"sinusoidal": [{"amplitude": 1e-6, "frequency": 37.2 / 6}]}
    row_id = "receiver.vibration.sinusoidal.0"
    row = verdicts(row_id, requirements__pslr=-30, platforms__receiver__motion_error={"vibration": vibration})[row_id]
    walk = np.linspace(-0.5, 0.5, 1001) * 37.2 * 0.03
    loss = 20 * math.log10(float(np.mean(np.sinc(walk))))
    assert row.measured_db == pytest.approx(-39.03 + loss, abs=0.3)
    assert "smeared over 1.1 range cells" in row.reason


def test_wideband_power_of_one_platform_at_the_published_limit() -> None:
    """A phase variance of ISLR/2 spreads that power: 3 dB inside, for one platform of two; 0.44 less in an image."""
    row = verdicts("*.wideband", requirements__islr=-20)["transmitter.vibration.wideband"]
    assert row.measured_db == pytest.approx(shown_db(0.01 / 2), abs=0.01 + 4 * row.measured_db_error)
    assert row.measured_db_error < 0.15
    assert row.verdict == "conservative"


def test_both_platforms_in_phase_leave_3_db() -> None:
    """Amplitudes of √(PSLR/2)·λ/(2π) each add to a phase of 2·√(PSLR/2), echoes of √(PSLR/2)."""
    row = verdicts("mission.vibration.sinusoidal", requirements__pslr=-30)["mission.vibration.sinusoidal"]
    assert row.measured_db == pytest.approx(-33.01, abs=0.3)
    assert row.verdict == "conservative"


def test_both_platforms_of_independent_noise_fill_the_requirement_and_the_same_motion_exceeds_it() -> None:
    row = verdicts("mission.vibration.wideband", requirements__islr=-20)["mission.vibration.wideband"]
    assert row.verdict == "confirmed"
    assert row.measured_db == pytest.approx(shown_db(0.01), abs=0.01 + 4 * row.measured_db_error)
    common = float(re.search(r"the same motion of both adds (-[\d.]+) dB", row.reason)[1])
    assert common == pytest.approx(shown_db(0.02), abs=0.3)  # 3 dB more


def test_one_platform_that_owns_all_of_the_power_fills_the_requirement() -> None:
    """One platform that owns nearly all of the power meets the requirement itself."""
    split = {"islr": {"transmitter": 0.99, "receiver": 0.01}}
    row = verdicts("transmitter.*.wideband", requirements__islr=-20, allocation__split=split)
    assert row["transmitter.vibration.wideband"].verdict == "confirmed"


@pytest.mark.parametrize("frequency", [0.3, 100.0])
def test_vibrations_that_no_cut_shows_are_not_evaluated(frequency: float) -> None:
    vibration = {"sinusoidal": [{"amplitude": 1e-6, "frequency": frequency}]}
    row_id = "receiver.vibration.sinusoidal.0"
    row = verdicts(row_id, requirements__pslr=-30, platforms__receiver__motion_error={"vibration": vibration})[row_id]
    assert (row.verdict, row.measured_db) == ("not_evaluated", None)
    assert "cycles per aperture" in row.reason


def test_errors_along_a_frame_of_their_own_are_put_in_along_it() -> None:
    error = {"frame": "look", "acceleration": [1e-4, 0, 0]}
    row = verdicts("receiver.acceleration.*", platforms__receiver__motion_error=error)
    sight = row["receiver.acceleration.line_of_sight"]
    assert sight.verdict == "confirmed"
    assert sight.boundary_error < row["receiver.acceleration.x"].boundary_error


def test_an_error_that_moves_the_image_far_is_judged_where_its_second_order_is_small() -> None:
    """A satellite's velocity limit moves the image by 400 m, 2 km from the receiver, whose ellipses turn by 11°.

    Read along the scene's y' instead of along the ellipse at the displaced point, 0.319 rad looked like 0.270.
    """
    platforms = {
        "transmitter": {
            "slant_range": "600 km",
            "azimuth": 0,
            "elevation": 0.9,
            "speed": 7500,
            "motion_azimuth": 1.2,
        },
        "receiver": {"slant_range": "2 km", "azimuth": 0.6, "elevation": 0.1, "speed": 0},
    }
    changes = {"platforms": platforms, "collection__aperture_time": 0.5}
    moved = verdicts("transmitter.velocity.x", **changes)["transmitter.velocity.x"]
    assert math.hypot(*moved.displacement_m) == pytest.approx(400, rel=0.01)
    assert moved.measured_qpe_rad == pytest.approx(moved.predicted_qpe_rad, rel=0.01)


def test_a_published_limit_beyond_first_order_is_imaged_and_optimistic() -> None:
    """29 m/s of velocity error at a platform of 45 m/s bend the geometry itself: image and ranges must agree."""
    transmitter = {
        "slant_range": "12 km",
        "azimuth": "210 deg",
        "elevation": "20 deg",
        "speed": 45,
        "motion_azimuth": "300 deg",
        "climb": 1,
        "motion_error": {"frame": "look", "velocity": [0, 0, 0.01]},
    }
    row = verdicts(
        "transmitter.velocity.up",
        platforms={"transmitter": transmitter, "receiver": {"position": [-4000, 2000, 1200], "velocity": [3, 1, 0]}},
        radar={"center_frequency": "5.3 GHz", "bandwidth": "120 MHz"},
        collection={"aperture_time": "2.5 s"},
    )["transmitter.velocity.up"]
    assert row.verdict == "optimistic"
    assert row.measured_qpe_rad > 1.05 * row.budget_rad
    assert row.measured_qpe_rad == pytest.approx(row.predicted_qpe_rad, rel=0.01)


def test_a_published_limit_that_leaves_no_ground_point_is_optimistic() -> None:
    """The table allows 20 m/s at a satellite over a fixed receiver; by exact ranges the point has no image then."""
    mission = parse_mission(families.mission_text("satellite_fixed", 3))
    (row,) = verify_mission(mission, "transmitter.velocity.z").rows
    assert mission.allocation.model == "published"
    assert row.verdict == "optimistic"
    assert row.measured_qpe_rad is None
    assert "no ground point has the recorded range history" in row.reason
    study = Study(mission)
    source = next(s for s in study.sources if s.id == row.id)
    for size in (row.boundary_error, -row.boundary_error):
        with pytest.raises(NoGroundPointError):
            study.effect([(source, size)])


ERRORS = {
    "platforms__receiver__motion_error": {"position": [0.5, 0.2, 0], "acceleration": ["0.2 mm/s^2", 0, 0]},
    "platforms__transmitter__motion_error": {"velocity": [0, "-5 mm/s", 0]},
}


class TestTogether:
    """Declared errors scaled together to a limit of the whole mission."""

    def test_location(self) -> None:
        row = verdicts("mission.location_error", requirements__location_error=2, **ERRORS)["mission.location_error"]
        assert row.verdict == "confirmed"
        assert math.hypot(*row.displacement_published_m) == pytest.approx(2.0)
        assert row.measured_displacement_m == pytest.approx(row.displacement_m, abs=0.02)  # 4 % of a cell

    @staticmethod
    def location(model: str, position: list[float], requirement: float = 2) -> Verdict:
        """Climbing and squinted: (25) says more than twice what the image moves by, the full model what it does."""
        platforms = {
            "transmitter": {
                "position": [12e3, -3e3, 5e3], "velocity": [30, 120, 25], "motion_error": {"position": position},
            },
            "receiver": {"position": [-2e3, 9e3, 2e3], "velocity": [50, 0, -4]},
        }  # fmt: skip
        changes = {"platforms": platforms, "collection": {"aperture_time": 3}, "allocation": {"model": model}}
        row_id = "mission.location_error"
        return verdicts(row_id, requirements__location_error=requirement, **changes)[row_id]

    def test_location_by_the_full_model_where_25_is_metres_off(self) -> None:
        row = self.location("full", [1, 1, 1])
        assert row.verdict == "confirmed"
        assert "the full model and the image" in row.reason

    def test_location_that_goes_elsewhere_is_optimistic_although_it_is_shorter(self) -> None:
        """2 m to the north by (25); 1.3 m to the north-east in the image."""
        row = self.location("published", [1, 1, 1])
        assert math.hypot(*row.measured_displacement_m) < 1.5
        assert row.verdict == "optimistic"
        assert "(25) does not predict the displacement" in row.reason

    def test_location_that_only_is_shorter_is_conservative_and_says_that_the_number_is_wrong(self) -> None:
        row = self.location("published", [0, 0, 1])
        assert math.hypot(*row.displacement_published_m) == pytest.approx(2)
        assert math.hypot(*row.measured_displacement_m) < 1
        assert row.verdict == "conservative"
        assert "(25) does not predict the displacement" in row.reason

    def test_location_of_errors_that_hide_each_other_is_not_confirmed(self) -> None:
        """Together 0.3 m by (25) and 25 cm off, less than half a pixel; each alone three metres, and metres off."""
        row = self.location("published", [1, 1, 1], 0.3)
        assert math.dist(row.displacement_full_m, row.measured_displacement_m) < 1e-3
        assert "(25) and the image differ by " in row.reason
        assert "transmitter.position.y alone: -2.334 m east, 2.143 m north by (25), -744.2 mm east" in row.reason
        assert row.verdict != "confirmed"

    def test_location_of_errors_that_defocus_is_read(self) -> None:
        """Ten radians leave no one peak; the linear part of the phase over the aperture still says where it is."""
        rows = verdicts("mission.location_error", requirements__location_error=15, allocation__model="full", **ERRORS)
        row = rows["mission.location_error"]
        assert row.predicted_qpe_rad > 3
        assert row.verdict == "confirmed"
        assert row.measured_displacement_m == pytest.approx(row.displacement_m, abs=0.02)

    def test_location_without_errors_says_so(self) -> None:
        row = verdicts("mission.location_error", requirements__location_error=2)["mission.location_error"]
        assert (row.verdict, row.measured_displacement_m) == ("not_evaluated", None)
        assert "no error that moves the image is declared" in row.reason

    def test_cubic_of_errors_of_both_platforms(self) -> None:
        """At broadside the cubic phases of Table I are true, also together; `test_verdict_borders` has squints."""
        errors = {
            "platforms__receiver__motion_error": {"acceleration": ["0.2 mm/s^2", "-0.2 mm/s^2", 0]},
            "platforms__transmitter__motion_error": {"acceleration": [0, "1 mm/s^2", 0]},
        }
        row = verdicts("mission.cubic_phase_error", requirements__cubic_phase_error=0.1, **errors)
        cubic = row["mission.cubic_phase_error"]
        assert cubic.measured_cubic_rad == pytest.approx(0.1, rel=0.001)
        assert cubic.predicted_cubic_rad == pytest.approx(0.1, rel=0.001)
        assert cubic.verdict == "confirmed"

    def test_cubic_without_errors_says_so(self) -> None:
        row = verdicts("mission.cubic_phase_error", requirements__cubic_phase_error=0.1)
        assert "no error with a motion is declared" in row["mission.cubic_phase_error"].reason

    def test_location_of_errors_that_move_nothing_says_so(self) -> None:
        error = {"platforms__receiver__motion_error": {"acceleration": [1e-6, 0, 0]}}
        row = verdicts("mission.location_error", requirements__location_error=2, **error)["mission.location_error"]
        assert "by (25) the declared errors do not displace" in row.reason

    def test_worst_case_sums_reach_their_budgets(self) -> None:
        rows = verdicts("*.quadratic_phase_error", allocation__combine="sum", **ERRORS)
        assert {row.id for row in rows.values()} >= {
            "transmitter.quadratic_phase_error",
            "receiver.quadratic_phase_error",
            "mission.quadratic_phase_error",
        }
        for row in rows.values():
            assert row.measured_qpe_rad == pytest.approx(row.predicted_qpe_rad, rel=0.01)

    def test_root_sum_squares_are_no_image(self) -> None:
        rows = verdicts("mission.quadratic_phase_error", allocation__combine="rss", **ERRORS)
        assert "many flights" in rows["mission.quadratic_phase_error"].reason


def test_an_image_close_to_a_platform_is_read_on_the_measured_paths() -> None:
    """A platform within 500 m of a long-wave cut: along nominal paths the patch said 20 to 33 rad."""
    platforms = {
        "transmitter": {"position": ["500 km", "20 km", "600 km"], "velocity": [200, 7500, 10]},
        "receiver": {"position": [300, -400, 60], "velocity": [0, 0, 0]},
    }
    radar = {"center_frequency": "1.2575 GHz", "bandwidth": "80 MHz"}
    changes = {"platforms": platforms, "radar": radar, "collection": {"aperture_time": 8}}
    seen = 0
    for row in verdicts("*.velocity.*", **changes, allocation__model="full").values():
        assert row.verdict == "confirmed", row.id
        assert row.measured_qpe_rad == pytest.approx(row.predicted_qpe_rad, rel=0.01)
        seen += 1
    assert seen >= 3


class TestAutofocus:
    @pytest.mark.parametrize("algorithm", ["pga", "map_drift"])
    def test_every_limit_with_autofocus_refocuses_inside_the_plain_budget(self, algorithm: str) -> None:
        rows = verdicts("receiver.acceleration.*", autofocus={"algorithm": algorithm, "n_pull": 4})
        assert len(rows) == 3
        for row in rows.values():
            assert row.boundary_autofocus == pytest.approx(16 * row.boundary_error)
            assert row.measured_residual_qpe_rad < 0.1
            assert row.verdict_autofocus == "confirmed"
            assert abs(row.refocused_loss_db) < 0.1

    def test_without_autofocus_there_is_no_verdict_on_it(self) -> None:
        row = verdicts("receiver.acceleration.x")["receiver.acceleration.x"]
        assert (row.boundary_autofocus, row.verdict_autofocus) == (None, None)

    def test_an_error_that_moves_the_image_far_refocuses_where_it_went(self) -> None:
        path = SECTION_V.with_name("rigling_moses_section_v_autofocus.yaml")
        (row,) = verify_mission(load_mission(str(path)), "receiver.velocity.y").rows
        assert row.verdict == "optimistic"
        assert row.boundary_autofocus == pytest.approx(16 * row.boundary_error)
        assert row.verdict_autofocus == "confirmed"

    def test_an_error_of_metres_a_hundred_metres_away_is_refocused(self) -> None:
        """On nominal paths the fit said 56 rad were left of a refocused image, the peak said none."""
        platforms = {
            "transmitter": {"position": [80, -60, 40], "velocity": [3, 6, 0.5]},
            "receiver": {"position": [50, 90, 30], "velocity": [-4, 3, 0]},
        }
        rows = verdicts(
            "*.velocity.*",
            platforms=platforms,
            radar={"center_frequency": "94 GHz", "bandwidth": "1 GHz"},
            collection={"aperture_time": 1},
            allocation__model="full",
            autofocus={"n_pull": 3},
        )
        assert rows
        for row in rows.values():
            assert (row.verdict, row.verdict_autofocus) == ("confirmed", "confirmed"), row.id

    def test_a_smear_of_80_cells_has_the_room_that_autofocus_needs(self) -> None:
        """In a patch of 1.6 smears phase gradient autofocus left 3.7 rad, and the limit was called optimistic."""
        verdict = verdicts("mission.autofocus_pull_in", autofocus={"n_pull": 20})["mission.autofocus_pull_in"]
        assert verdict.verdict_autofocus == "confirmed"
        assert verdict.measured_residual_qpe_rad < 0.1
        assert verdict.refocused_loss_db < 0.3

    @pytest.mark.parametrize(("n_pull", "counts"), [(8, 8), (14, 10)])
    def test_range_walk_bounds_the_pull_in(self, n_pull: float, counts: float) -> None:
        """1 GHz at 10 GHz: half a cell of walk at n_pull 10, and no more counts."""
        row = verdicts(
            "mission.autofocus_pull_in", radar__bandwidth="1 GHz", autofocus={"algorithm": "pga", "n_pull": n_pull}
        )["mission.autofocus_pull_in"]
        assert row.verdict == "confirmed"
        assert row.boundary_autofocus == pytest.approx(math.pi * counts)
        assert "up to n_pull 10, f0/B" in row.reason

    @pytest.mark.parametrize(("n_pull", "gain"), [(8, 32), (14, 40)])
    def test_a_limit_is_scaled_by_the_gain_that_counts(self, n_pull: float, gain: float) -> None:
        """A clock bends no geometry: its limit with autofocus is the gain times that without."""
        (row,) = verdicts(
            "timing.quadratic", radar__bandwidth="1 GHz", autofocus={"algorithm": "pga", "n_pull": n_pull}
        ).values()
        assert row.boundary_autofocus / row.boundary_error == pytest.approx(gain)


def test_verdicts_do_not_depend_on_the_number_of_processes() -> None:
    mission = load_mission(str(SECTION_V))
    seen: list[tuple[int, int]] = []
    both = verify_mission(mission, "receiver.*", 2, lambda *step: seen.append(step))
    alone = verified_section_v()
    for row in both.rows:  # what is rounded depends on where arrays lie in memory: 1 ulp, seen without Numba
        numbers = {name: value for name, value in row._asdict().items() if isinstance(value, float)}
        assert numbers == pytest.approx({name: getattr(alone[row.id], name) for name in numbers}, rel=1e-12)
        assert (row.verdict, row.reason) == (alone[row.id].verdict, alone[row.id].reason)
    assert [row.id for row in both.rows] == [row_id for row_id in alone if row_id.startswith("receiver.")]
    assert seen == [(done, len(both.rows)) for done in range(1, len(both.rows) + 1)]


@pytest.mark.extras
def test_compiled_and_numpy_images_give_the_same_verdicts(monkeypatch) -> None:
    pytest.importorskip("numba", reason="the extra `fast` is not installed")
    mission = load_mission(str(SECTION_V.with_name("rigling_moses_section_v_autofocus.yaml")))
    fast = verify_mission(mission, "receiver.*.y").rows  # position, velocity, acceleration
    assert len(fast) >= 2

    def by_numpy(history, points, *_: object, **__: object):
        return backprojection(history, points, "numpy")

    monkeypatch.setattr(collection_module, "backprojection", by_numpy)
    plain = verify_mission(mission, "receiver.*.y").rows
    assert [(row.verdict, row.verdict_autofocus) for row in fast] == [
        (row.verdict, row.verdict_autofocus) for row in plain
    ]
    for a, b in zip(fast, plain, strict=True):
        assert a.measured_qpe_rad == pytest.approx(b.measured_qpe_rad, abs=1e-4)  # images are 118 dB apart
        assert a.measured_displacement_m == pytest.approx(b.measured_displacement_m, abs=1e-4)
