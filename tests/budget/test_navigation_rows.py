"""Rows of lever arms, time tags and common errors: what is held, what counts, what is said, drawn and flown."""

import math

import pytest

from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.mission.load import parse_mission
from bisar_budget.questions.varied import scaled
from bisar_budget.sampling.probability import monte_carlo
from bisar_budget.simulator.point import declared_errors
from tests.conftest import findings, mission_text, row

ERROR = "platforms__receiver__motion_error"
TURN = {"platforms__receiver__acceleration": ["-2 m/s^2", "1 m/s^2", 0]}
IMU = {"attitude": ["0.2 mrad", "0.2 mrad", "2 mrad"], "source": "sheet"}
ARM = {"arm": ["2 m", "1 m", "-0.5 m"], "uncertainty": "5 mm", "source": "survey"}
NEEDS = {
    "requirements": {"location_error": "2 m", "cubic_phase_error": "22.5 deg", "quadratic_phase_error": "45 deg"},
}
NOISE = {"name": "GNSS", "sigma": "1 cm", "correlation_time": "2 s"}


def of(**changes: object):
    return findings(**{**TURN, **NEEDS, "allocation__model": "full", **changes})


class TestLeverArm:
    def test_rows_stand_only_where_the_file_has_the_key(self) -> None:
        def ids(**changes: object) -> list[str]:
            return [one.id for one in of(**changes).rows if ".lever_arm." in one.id]

        assert ids(**{ERROR: {"imu": IMU}}) == []
        assert ids(**{ERROR: {"lever_arm": {"uncertainty": "5 mm"}}}) == ["receiver.lever_arm.uncertainty"]
        both = ["receiver.lever_arm.attitude", "receiver.lever_arm.uncertainty"]
        assert ids(**{ERROR: {"imu": IMU, "lever_arm": ARM}}) == both

    def test_what_the_rows_say(self) -> None:
        found = of(**{ERROR: {"imu": IMU, "lever_arm": ARM}, "allocation__coverage_factor": 2})
        part, arm = row(found, "receiver.lever_arm.attitude"), row(found, "receiver.lever_arm.uncertainty")
        assert (part.unit, part.declared, part.evidence) == ("rad", 4e-3, "sheet")
        assert (arm.unit, arm.declared, arm.evidence) == ("m", 1e-2, "survey")
        assert arm.binding_requirement in ("location_error", "quadratic_phase_error")
        assert part.allowable is not None
        assert part.status == "info"
        lines = mission_text(**{**TURN, **NEEDS, ERROR: {"imu": IMU, "lever_arm": ARM}}).splitlines()
        assert "5 mm" in lines[arm.line - 1]

    def test_the_coverage_factor_multiplies_no_power(self) -> None:
        """What angle noise spreads beside an arm grew with it, 6 dB at a factor of 2."""
        walk = {ERROR: {"imu": {"angle_random_walk": "2 deg/sqrt(h)"}, "lever_arm": {"arm": ["2 m", 0, 0]}}}
        once, twice = (
            row(of(**walk, allocation__coverage_factor=factor), "receiver.imu.angle_random_walk") for factor in (1, 2)
        )
        assert once.islr_db == pytest.approx(twice.islr_db, abs=1e-9)
        assert twice.qpe_full_rad == pytest.approx(2 * once.qpe_full_rad)

    @pytest.mark.parametrize("combine", ["each", "sum", "rss"])
    def test_what_attitude_does_counts_once(self, combine: str) -> None:
        """By `each` the row of the whole is judged, and the part of the arm is not."""
        found = of(**{ERROR: {"imu": IMU, "lever_arm": ARM}, "allocation__combine": combine})
        whole, part = row(found, "receiver.imu.attitude"), row(found, "receiver.lever_arm.attitude")
        arm = row(found, "receiver.lever_arm.uncertainty")
        assert part.status == "info"
        assert "receiver.imu.attitude" in part.reason
        assert (whole.status == "info") == (combine != "each")
        lengths = [math.hypot(*one.displacement_m) for one in (whole, arm)]
        expected = {"each": max(lengths), "sum": sum(lengths), "rss": math.hypot(*lengths)}[combine]
        assert row(found, "mission.location_error").declared == pytest.approx(expected, rel=1e-9)

    def test_the_location_holds_the_arm_that_swings(self) -> None:
        """Level flight, attitude: without the arm hardly anything is displaced, with 20 m of it 2 mrad are 4 cm."""
        level = {"platforms__receiver__acceleration": [0, 0, 0]}
        bare = of(**level, **{ERROR: {"imu": {"attitude": "2 mrad"}}})
        with_arm = of(**level, **{ERROR: {"imu": {"attitude": "2 mrad"}, "lever_arm": {"arm": [0, 0, "20 m"]}}})
        lengths = [math.hypot(*row(one, "receiver.imu.attitude").displacement_m) for one in (bare, with_arm)]
        assert lengths[1] > lengths[0] + 0.01
        assert row(with_arm, "receiver.imu.attitude").allowable < row(bare, "receiver.imu.attitude").allowable * 1.001

    def test_an_arm_that_nothing_swings_is_a_warning(self) -> None:
        found = of(**{ERROR: {"lever_arm": {"arm": ["2 m", 0, 0]}}})
        assert "attitude errors swing it" in " ".join(one.message for one in found.warnings)
        assert row(found, "receiver.lever_arm.attitude").status == "not_declared"
        assert row(found, "receiver.lever_arm.attitude").allowable is not None
        for quiet in ({"lever_arm": {"uncertainty": "1 mm"}}, {"imu": IMU, "lever_arm": ARM}):
            found = of(**{ERROR: quiet})
            assert "swing" not in " ".join(one.message for one in found.warnings)

    def test_it_spreads_nothing(self) -> None:
        """An ISLR without anything that spreads is not judged."""
        found = of(**{ERROR: {"lever_arm": ARM}, "requirements__islr": "-20 dB"})
        assert next(one for one in found.requirements if one.key == "islr").status == "not_evaluated"

    def test_kinds(self) -> None:
        silent, stated = of(), of(**{ERROR: {"lever_arm": {"uncertainty": "5 mm"}, "time_tag": "1 ms"}})
        for kind in ("receiver.lever_arm", "receiver.time_tag"):
            assert kind not in silent.kinds.declared + silent.kinds.missing
            assert kind in stated.kinds.declared
            assert kind in stated.kinds.without_source
        assert stated.kinds.missing == silent.kinds.missing

    def test_it_may_be_asked_for(self) -> None:
        found = of(requirements__declare=["receiver.lever_arm", "receiver.time_tag"])
        assert row(found, "mission.declare").status == "not_evaluated"
        found = of(
            **{
                "requirements__declare": ["receiver.lever_arm", "receiver.time_tag"],
                ERROR: {"lever_arm": {"uncertainty": 0}, "time_tag": 0},
            }
        )
        assert row(found, "mission.declare").status == "pass"


class TestTimeTag:
    def test_what_the_row_says(self) -> None:
        found = of(**{ERROR: {"time_tag": "-1 ms", "source": "ICD"}, "allocation__coverage_factor": 3})
        one = row(found, "receiver.time_tag")
        assert (one.unit, one.declared, one.evidence) == ("s", 3e-3, "ICD")
        ahead = row(of(**{ERROR: {"time_tag": "1 ms"}, "allocation__coverage_factor": 3}), "receiver.time_tag")
        # The other sign goes the other way, but for a thousandth of second order.
        assert one.displacement_m == pytest.approx([-x for x in ahead.displacement_m], rel=5e-3)
        assert row(found, "mission.location_error").declared == pytest.approx(math.hypot(*one.displacement_m))

    def test_a_still_platform_has_no_limit(self) -> None:
        found = findings(**NEEDS, platforms__receiver__velocity=[0, 0, 0], **{ERROR: {"time_tag": "1 ms"}})
        one = row(found, "receiver.time_tag")
        assert one.allowable is None
        assert one.displacement_m == (0.0, 0.0)

    @pytest.mark.parametrize("distribution", ["normal", "uniform", "bound"])
    def test_it_is_drawn_by_its_distribution(self, distribution: str) -> None:
        error = {"time_tag": "1 ms", "distribution": distribution}
        mission = parse_mission(mission_text(**{**TURN, **NEEDS, ERROR: error}))
        found = monte_carlo(Analysis(mission), 20_000, 3)
        (location,) = (one for one in found.requirements if one.id == "mission.location_error")
        one = row(of(**{ERROR: error}), "receiver.time_tag")
        length = math.hypot(*one.displacement_m)
        assert location.sigma == pytest.approx(length / (math.sqrt(3) if distribution == "uniform" else 1), rel=0.02)

    def test_draws_of_a_large_one_go_through_exact_ranges(self) -> None:
        text = {**TURN, **NEEDS, ERROR: {"time_tag": "2 s", "distribution": "bound"}}
        found = monte_carlo(Analysis(parse_mission(mission_text(**text))), 200, 3)
        assert found.is_exact
        (location,) = (one for one in found.requirements if one.id == "mission.location_error")
        analysis = Analysis(parse_mission(mission_text(**text)))
        (source,) = analysis.stated
        does = Case(analysis).does(analysis.full, source)
        lengths = sorted(math.hypot(*one) for one in (does.displacement, does.opposite))
        assert lengths[0] <= location.sigma <= lengths[1]

    def test_scaling_multiplies_it_and_no_arm(self) -> None:
        error = {"time_tag": "1 ms", "imu": IMU, "lever_arm": ARM, "random": [NOISE]}
        mission = parse_mission(mission_text(**{ERROR: error}))
        found = scaled(mission, f"platforms.receiver.{ERROR.split('__')[-1]}", 3.0).platforms.receiver.motion_error
        assert found.time_tag == pytest.approx(3e-3)
        assert found.lever_arm.arm == (2.0, 1.0, -0.5)
        assert found.lever_arm.uncertainty == pytest.approx((15e-3,) * 3)
        assert found.random[0].correlation_time == 2.0


class TestCommon:
    def test_rows_of_a_frame_name_its_axes(self) -> None:
        found = of(
            common_motion_error={"frame": "track", "velocity": "1 mm/s", "time_tag": "1 ms", "random": [NOISE]}
        )
        ids = [one.id for one in found.rows if one.id.startswith("common.")]
        kinds = ("position", "velocity", "acceleration")
        listed = [f"common.{kind}.{axis}" for kind in kinds for axis in ("along", "cross", "up")]
        assert ids == [*listed, "common.time_tag", "common.random.GNSS"]
        for row_id in ids:
            one = row(found, row_id)
            assert "both platforms" in " ".join(one.notes)
            assert one.allowable is not None

    def test_they_count_for_the_mission_alone(self) -> None:
        common = {"time_tag": "1 ms", "random": [NOISE]}
        found = of(common_motion_error=common, allocation__combine="rss")
        assert row(found, "receiver.quadratic_phase_error").declared is None
        parts = [row(found, row_id) for row_id in ("common.time_tag", "common.random.GNSS")]
        total = math.hypot(*(one.equal_loss_qpe_rad for one in parts))
        assert row(found, "mission.quadratic_phase_error").declared == pytest.approx(total)
        assert row(found, "mission.location_error").declared == pytest.approx(
            math.hypot(*(math.hypot(*one.displacement_m) for one in parts))
        )

    def test_noise_of_both_is_more_than_that_of_each(self) -> None:
        """Lines of sight of the demo are 45° apart: powers of independent noise add less than those of one noise."""
        own = {f"platforms__{name}__motion_error": {"random": [NOISE]} for name in ("transmitter", "receiver")}
        apart, together = of(**own), of(common_motion_error={"random": [NOISE]})
        each = [row(apart, f"{name}.random.GNSS").qpe_published_rad for name in ("transmitter", "receiver")]
        common = row(together, "common.random.GNSS").qpe_published_rad
        mission = parse_mission(mission_text(**TURN))
        angle = mission.geometry.bistatic_angle
        # |u_t + u_r|² = 2 + 2·cos of the angle between them
        assert common == pytest.approx(each[0] * math.sqrt(2 + 2 * math.cos(angle)), rel=1e-9)
        assert each[0] == pytest.approx(each[1])


def test_all_of_it_is_flown() -> None:
    error = {"time_tag": "-2 ms", "imu": IMU, "lever_arm": ARM}
    common = {"frame": "track", "position": "3 m", "time_tag": "1 ms", "random": [NOISE]}
    flown = declared_errors(
        parse_mission(
            mission_text(**{**TURN, ERROR: error, "common_motion_error": common}, allocation__coverage_factor=2)
        )
    )
    assert flown.receiver.time_tag == pytest.approx(-2e-3)  # 2·(1 − 2) ms
    assert flown.transmitter.time_tag == pytest.approx(2e-3)
    assert math.hypot(*flown.transmitter.position) == pytest.approx(6 * math.sqrt(3))
    assert flown.transmitter.course is not None  # the noise of both
    # And it does not fly the attitude through the arm twice.
    alone = declared_errors(
        parse_mission(mission_text(**{**TURN, ERROR: {"imu": IMU, "lever_arm": {"arm": [0, 0, 0]}}}))
    )
    swung = declared_errors(
        parse_mission(mission_text(**{**TURN, ERROR: {"imu": IMU, "lever_arm": {"arm": ["2 m", "1 m", "-0.5 m"]}}}))
    )
    middle = len(swung.receiver.course.times) // 2
    moved = swung.receiver.course.values[middle] - alone.receiver.course.values[middle]
    # At mid-aperture the specific force has moved nothing yet: ψ × l of a few sigmas.
    assert 1e-5 < math.hypot(*moved) < 5 * 2e-3 * math.hypot(2, 1, 0.5)


@pytest.mark.parametrize("model", ["published", "full"])
def test_formulas_and_numbers_are_explained(run, tmp_path, model: str) -> None:
    """From the line of the file to the allowable, which is that of the row."""
    error = {"time_tag": "1 ms", "imu": {**IMU, "angle_random_walk": "0.01 deg/sqrt(h)"}, "lever_arm": ARM}
    common = {"frame": "look", "velocity": "1 mm/s", "time_tag": "1 ms", "random": [NOISE]}
    file = tmp_path / "m.yaml"
    file.write_text(mission_text(**{**TURN, **NEEDS, ERROR: error, "common_motion_error": common}))
    said = {
        "receiver.time_tag": ("v = [", "p(τ + δt) − p(τ)"),
        "common.time_tag": ("of the transmitter", "of the receiver"),
        "common.velocity.line_of_sight": ("φ_t/unit", "φ_r/unit"),
        "receiver.imu.attitude": ("f_u", "R(τ)·l", "l_u"),
        "receiver.imu.angle_random_walk": ("N_g·W(τ)",),
        "receiver.lever_arm.attitude": ("l_u = sqrt(", "part of receiver.imu.attitude"),
        "receiver.lever_arm.uncertainty": ("u_l = sqrt(",),
        "common.random.GNSS": ("τ_c", "common_motion_error.random"),
    }
    for row_id, words in said.items():
        done = run("check", str(file), "--model", model, "--explain", row_id)
        text = " ".join(done.stdout.split())
        for word in (*words, "allowable ="):
            assert word in text, (row_id, word)
