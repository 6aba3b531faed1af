"""A requirement is not judged on half of its causes: clocks without oscillators, arms that nothing swings."""

from typing import Any

import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.declarations import declared_kinds, missing_declarations
from bisar_budget.budget.judged_mission import judged_mission
from bisar_budget.budget.judged_rows import statuses
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import OF_MISSION, OF_PLATFORMS
from bisar_budget.sampling.probability import monte_carlo
from tests.conftest import TODAY, findings, mission_text, row

ERROR = {"position": "10 cm", "velocity": "2 mm/s", "acceleration": "10 ug"}
CLOCK = {"power_law": {"h0": 1.0e-30}}
HOLDOVER = {
    "method": "holdover",
    "age": "600 s",
    "averaging": "10 s",
    "time_error": "1 ns",
    "frequency_error": "1e-13",
}
NEEDS = {"cubic_phase_error": "45 deg", "location_error": "2 m", "islr": "-20 dB"}
SENSITIVE = {"power_law": {"h0": 1.0e-27}, "acceleration_sensitivity": "1e-6 /g"}
BOTH = ("transmitter", "receiver")


def declared(**changes: Any) -> dict[str, Any]:
    """A mission with errors of both platforms, then changed."""
    return {f"platforms__{name}__motion_error": ERROR for name in BOTH} | {"requirements": NEEDS} | changes


def with_clocks(*names: str) -> dict[str, Any]:
    return {f"platforms__{name}__oscillator": CLOCK for name in names}


def requirement(found: MissionFindings, key: str) -> JudgedRequirement:
    (one,) = [one for one in found.requirements if one.key == key]
    return one


# ---------------------------------------------------------------------- clocks in holdover
@pytest.mark.parametrize("combine", ["each", "sum", "rss"])
@pytest.mark.parametrize("stated", [(), ("transmitter",), ("receiver",)])
def test_a_holdover_without_one_of_its_oscillators_leaves_the_location_open(
    stated: tuple[str, ...], combine: str
) -> None:
    """It passed, with a warning: one clock of two was judged, or none."""
    found = findings(**declared(synchronization=HOLDOVER, allocation__combine=combine, **with_clocks(*stated)))
    location = requirement(found, "location_error")
    assert found.status == location.status == row(found, "mission.location_error").status == "not_evaluated"
    lacking = [f"platforms.{name}.oscillator" for name in BOTH if name not in stated]
    assert location.reason is not None
    assert location.reason.endswith(f"add {' and '.join(lacking)}")


def test_with_both_oscillators_the_location_is_judged() -> None:
    found = findings(**declared(synchronization=HOLDOVER, **with_clocks(*BOTH)))
    assert requirement(found, "location_error").status == "pass"


@pytest.mark.parametrize("stated", [(), ("transmitter",), ("receiver",)], ids=str)
def test_without_a_location_requirement_the_noise_rests_on_both_clocks(stated: tuple[str, ...]) -> None:
    """Their phase noise blurs the image: a warning beside a pass stood for it."""
    needs = {key: value for key, value in NEEDS.items() if key != "location_error"}
    found = findings(**declared(synchronization=HOLDOVER, requirements=needs, **with_clocks(*stated)))
    phase = requirement(found, "quadratic_phase_error")
    assert found.status == phase.status == "not_evaluated"
    lacking = [f"platforms.{name}.oscillator" for name in BOTH if name not in stated]
    assert phase.reason is not None
    assert phase.reason.endswith(f"add {' and '.join(lacking)}")


def test_a_location_of_unknown_drift_is_not_drawn() -> None:
    mission = parse_mission(mission_text(**declared(synchronization=HOLDOVER, **with_clocks("transmitter"))))
    drawn = monte_carlo(Analysis(mission), 100, 1)
    assert "mission.location_error" not in {one.id for one in drawn.requirements}
    assert any("platforms.receiver.oscillator" in note for note in drawn.notes)


def test_a_location_that_fails_on_half_of_its_causes_stays_broken() -> None:
    found = findings(**declared(synchronization=HOLDOVER, requirements=NEEDS | {"location_error": "1 mm"}))
    assert requirement(found, "location_error").status == "fail"


# ---------------------------------------------------------------------- clocks that exchange pulses
EXCHANGED = {"method": "linear", "interval": "10 s", "error": "1 deg"}


@pytest.mark.parametrize(("stated", "status"), [("transmitter", "not_evaluated"), ("receiver", "not_evaluated")])
def test_between_pulses_the_noise_rests_on_both_clocks(stated: str, status: str) -> None:
    """The other clock may be the worse one; the file passed with a warning about the interval."""
    found = findings(**declared(synchronization=EXCHANGED, requirements={}, **with_clocks(stated)))
    phase = requirement(found, "quadratic_phase_error")
    assert found.status == phase.status == status
    (other,) = set(BOTH) - {stated}
    assert phase.reason is not None
    assert phase.reason.endswith(f"add platforms.{other}.oscillator")


@pytest.mark.parametrize("stated", [BOTH, ()], ids=str)
def test_with_both_oscillators_or_with_none_the_pulses_alone_are_judged(stated: tuple[str, ...]) -> None:
    """Without any the file lists the oscillators among the kinds that it does not declare."""
    found = findings(**declared(synchronization=EXCHANGED, requirements={}, **with_clocks(*stated)))
    assert requirement(found, "quadratic_phase_error").status == "pass"
    assert ("receiver.oscillator" in found.kinds.missing) is not bool(stated)


@pytest.mark.parametrize(("figures", "missing"), [(("time_error",), "frequency_error"), ((), "time_error")])
def test_a_location_says_that_clocks_are_taken_to_be_set_right(figures: tuple[str, ...], missing: str) -> None:
    setting = {key: value for key, value in HOLDOVER.items() if key in (*figures, "method", "age", "averaging")}
    found = findings(**declared(synchronization=setting, **with_clocks(*BOTH)))
    (warning,) = [one for one in found.warnings if one.message.code == "setting-is-perfect"]
    assert f"synchronization.{missing}" in warning.message
    sound = findings(**declared(synchronization=HOLDOVER, **with_clocks(*BOTH)))
    assert not [one for one in sound.warnings if one.message.code == "setting-is-perfect"]


# ---------------------------------------------------------------------- a lever arm
def arm(imu: dict[str, Any] | None = None, **lever: Any) -> dict[str, Any]:
    error: dict[str, Any] = {**ERROR, "lever_arm": {"arm": ["5 m"] * 3, **lever}}
    return {"platforms__receiver__motion_error": error | ({} if imu is None else {"imu": imu})}


@pytest.mark.parametrize("imu", [None, {"accelerometer_bias": "1 ug"}])
@pytest.mark.parametrize("lever", [{}, {"uncertainty": 0}, {"uncertainty": "0.001 um"}, {"uncertainty": "5 mm"}])
def test_an_arm_that_nothing_swings_declares_no_lever_arm(imu: dict[str, Any] | None, lever: dict[str, Any]) -> None:
    asked = {"requirements": NEEDS | {"declare": ["receiver.lever_arm"]}}
    found = findings(**declared(**asked, **arm(imu, **lever)))
    assert requirement(found, "declare").status == "not_evaluated"
    assert "imu.attitude" in str(row(found, "mission.declare").reason)
    assert "receiver.lever_arm" in found.kinds.missing


@pytest.mark.parametrize(("imu", "status"), [(None, "warn"), ({"attitude": "0.001 deg"}, "pass")])
def test_an_arm_that_nothing_swings_is_a_doubt(imu: dict[str, Any] | None, status: str) -> None:
    """Deleting `imu` took the failing row of a long arm away, and `--strict` passed."""
    changes = declared(requirements={}, **arm(imu))
    assert findings(**changes).status == status
    judged = judged_mission(Analysis(parse_mission(mission_text(**changes))), TODAY)
    assert statuses(judged.status).tolist() == [status]


@pytest.mark.parametrize(
    ("imu", "lever"),
    [
        ({"attitude": "0.01 deg"}, {}),
        ({"gyro_bias": 0}, {}),
        ({"angle_random_walk": "0.01 deg/sqrt(h)"}, {}),
        ({"attitude": "0.01 deg"}, {"uncertainty": "1 mm"}),
        (None, {"arm": [0, 0, 0], "uncertainty": "1 mm"}),
        (None, {"arm": [0, 0, 0]}),
    ],
)
def test_an_arm_that_swings_or_has_no_length_does(imu: dict[str, Any] | None, lever: dict[str, Any]) -> None:
    asked = {"requirements": NEEDS | {"declare": ["receiver.lever_arm"]}}
    found = findings(**declared(**asked, **arm(imu, **lever)))
    assert requirement(found, "declare").status == "pass"
    assert "receiver.lever_arm" in found.kinds.declared


# ---------------------------------------------------------------------- a sensitivity that nothing acts on
def test_a_sensitivity_that_nothing_shakes_is_said_and_warns() -> None:
    found = findings(**declared(platforms__receiver__oscillator=SENSITIVE, timing_error={"constant": 0, "linear": 0}))
    (warning,) = [one for one in found.warnings if one.message.code == "nothing-shakes-the-oscillator"]
    assert "acceleration_sensitivity has no effect" in warning.message
    assert found.status == "warn"


def test_a_sweep_warns_of_it_as_a_check_does() -> None:
    changes = declared(platforms__receiver__oscillator=SENSITIVE, timing_error={"constant": 0, "linear": 0})
    judged = judged_mission(Analysis(parse_mission(mission_text(**changes))), TODAY)
    assert statuses(judged.status).tolist() == ["warn"]


@pytest.mark.parametrize("asked", ["oscillator", "receiver.oscillator"])
def test_where_the_oscillator_must_be_declared_that_is_half_of_it(asked: str) -> None:
    oscillators = {"platforms__receiver__oscillator": SENSITIVE, "platforms__transmitter__oscillator": CLOCK}
    changes = declared(**oscillators, timing_error={"constant": 0, "linear": 0})
    needs = NEEDS | {"declare": [asked], "pslr": "-20 dB"}
    found = findings(**changes | {"requirements": needs})
    assert requirement(found, "declare").status == found.status == "not_evaluated"
    assert "acceleration_sensitivity" in str(row(found, "mission.declare").reason)
    shaken = SENSITIVE | {"vibration": {"sinusoidal": [{"amplitude": "0 g", "frequency": "50 Hz"}]}}
    for oscillator in (shaken, SENSITIVE | {"acceleration_sensitivity": 0}):
        sound = findings(**changes | {"requirements": needs, "platforms__receiver__oscillator": oscillator})
        assert requirement(sound, "declare").status == "pass"


TURNS = {f"platforms__receiver__{key}": value for key, value in (("acceleration", ["1e-9 m/s^2", 0, 0]),)}


def test_an_acceleration_that_an_oscillator_does_not_feel_shakes_nothing() -> None:
    """A path that bends by 1e-9 m/s² counted as a turn, and the oscillator as declared."""
    changes = declared(platforms__receiver__oscillator=SENSITIVE, timing_error={"constant": 0, "linear": 0}, **TURNS)
    assert findings(**changes).status == "warn"
    felt = {"platforms__receiver__acceleration": ["1 m/s^2", 0, 0]}
    assert not [one for one in findings(**changes | felt).warnings if "judges nothing" in one.message]


@pytest.mark.parametrize(
    ("sensitivity", "status"), [({}, "not_evaluated"), ({"acceleration_sensitivity": "1e-10 /g"}, "pass")]
)
def test_an_oscillator_that_vibrates_needs_its_sensitivity(sensitivity: dict[str, Any], status: str) -> None:
    """Where `declare` asks for the oscillator: vibration acts on it, by nobody knows how much."""
    tone = {"sinusoidal": [{"amplitude": "0.01 um", "frequency": "50 Hz"}]}
    changes = declared(platforms__receiver__oscillator=CLOCK | sensitivity, timing_error={"constant": 0, "linear": 0})
    changes |= {"platforms__receiver__motion_error": ERROR | {"vibration": tone}}
    needs = NEEDS | {"declare": ["receiver.oscillator"], "pslr": "-20 dB"}
    found = findings(**changes | {"requirements": needs})
    assert requirement(found, "declare").status == status
    assert ("acceleration_sensitivity" in str(row(found, "mission.declare").reason)) is (status != "pass")


# ---------------------------------------------------------------------- the kinds of error
def kinds(**changes: Any) -> Any:
    return declared_kinds(parse_mission(mission_text(**changes)))


def test_the_air_and_the_synchronization_are_listed_where_nothing_is_said_of_them() -> None:
    assert {"propagation", "synchronization"} <= {*kinds().missing}


def test_where_the_direct_path_is_the_clock_nothing_has_to_be_synchronized() -> None:
    found = kinds(synchronization={"method": "direct_path", "error": "1 deg"})
    assert "synchronization" in found.declared
    assert "propagation" in found.missing


@pytest.mark.parametrize("common", [{}, {"source": "datum"}, {"frame": "track"}])
def test_axes_and_a_source_alone_are_no_common_error(common: dict[str, Any]) -> None:
    assert "common" not in kinds(common_motion_error=common).declared
    assert "common" in kinds(common_motion_error=common | {"position": 0}).declared


OF_ALL: dict[str, Any] = {
    "timing": {"timing_error": {"constant": 0}},
    "synchronization": {"synchronization": HOLDOVER},
    "propagation": {"propagation": {"zenith_delay": 0}},
    "common": {"common_motion_error": {"position": 0}},
    "other": {"other_errors": [{"name": "antenna", "location_error": 0}]},
    "terrain": {"scene": {"height_error": 0}},
}


@pytest.mark.parametrize("kind", OF_MISSION)
def test_each_kind_of_the_mission_can_be_asked_for_and_a_zero_declares_it(kind: str) -> None:
    def missing(**changes: Any) -> list[str]:
        text = mission_text(requirements__declare=[kind], **changes)
        return [one.kind for one in missing_declarations(parse_mission(text))]

    assert missing() == [kind]
    assert missing(**OF_ALL[kind]) == []
    found = findings(**declared(requirements=NEEDS | {"declare": [kind]}))
    assert requirement(found, "declare").status == "not_evaluated"


def test_the_air_is_asked_for_on_each_leg_of_which_a_file_may_state_a_delay() -> None:
    def missing(**changes: Any) -> list[str]:
        text = mission_text(requirements__declare=["propagation"], **changes)
        return [one.key for one in missing_declarations(parse_mission(text))]

    alone = {"propagation": {"transmitter": {"zenith_delay": "1 cm"}}}
    assert missing(**alone) == ["propagation.receiver"]
    low = {"platforms__receiver__position": ["6 km", "6 km", "100 m"]}  # at 0.7 deg
    assert missing(**alone, **low) == []


def test_every_word_of_declare_has_its_kind() -> None:
    words = {*OF_MISSION, *(f"receiver.{kind}" for kind in OF_PLATFORMS)}
    for word in words:
        assert missing_declarations(parse_mission(mission_text(requirements__declare=[word])))
