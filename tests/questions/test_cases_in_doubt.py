"""A case of a sweep has the status and the doubts of a check with the same values, whatever raises the status."""

from collections.abc import Mapping, Sequence
from datetime import date

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bisar_budget as bb
from bisar_budget.budget.check import check_mission, check_missions
from bisar_budget.budget.mission_doubts import MISSION_DOUBTS
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.findings.case_table import Cases
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import tree_of
from bisar_budget.questions.asked import Asked
from bisar_budget.questions.cases import grid
from tests.conftest import ROOT, mission_text

DAY = date(2026, 1, 1)
TRANSMITTER, RECEIVER = "platforms.transmitter", "platforms.receiver"
# Errors so small that no row is worse than a warning about the mission.
CALM = {
    "platforms__transmitter__motion_error": {"position": "1 mm", "source": "assumed"},
    "platforms__receiver__motion_error": {"position": "1 mm", "source": "assumed"},
    "timing_error": {"constant": "1 ns"},
    "requirements__location_error": "100 m",
}
HIGH = {"position": ["351.4 km", 0, "501.5 km"], "velocity": [0, "7.6 km/s", 0]}
LEVEL = {
    **HIGH,
    "acceleration": [0, 0, 0],
    "motion_error": {"position": ["0 m", "500 m", "0 m"], "source": "assumed"},
}
LOOSE = {"location_error": "100 km", "quadratic_phase_error": "6 rad"}
OCXO = {"phase_noise": {"1 Hz": "-120 dBc/Hz", "1 kHz": "-160 dBc/Hz"}, "frequency": "10 MHz"}
ARM = {"position": "1 mm", "source": "assumed", "lever_arm": {"arm": ["2 m", "0 m", "0 m"]}}

AIDED = {
    "navigation": {
        "imu": {"sensor": "stim300", "accelerometer_scale_factor": "100 ppm"},
        "gnss": {"sensor": "mosaic-x5-rtk", "rate": "5 Hz"},
    },
    "source": "assumed",
}


def mission_of(**changes: object) -> Mission:
    return bb.loads(mission_text(**{**CALM, **changes}))


def fed(**oscillator: object) -> dict[str, object]:
    """Both platforms with an oscillator, and pulses that they exchange; the receiver's has more figures."""
    return {
        "platforms__transmitter__oscillator": OCXO,
        "platforms__receiver__oscillator": {**OCXO, **oscillator},
        "synchronization": {"interval": "10 ms", "error": "1 deg"},
        "requirements__islr": "-10 dB",
    }


# Elements that are half a day old at its mid-aperture, and errors larger than those of elements of twelve days.
BESANCON = load_mission(str(ROOT / "specs/missions/sentinel1_elements_besancon.yaml")).replace(
    {f"{TRANSMITTER}.motion_error.position": "30 km", "requirements.location_error": "100 km"}
)

# Each mission, with values that bring the doubt about and values that do not.
TABLE: Mapping[str, tuple[Mission, Sequence[str], str]] = {
    "height": (mission_of(), [f"{TRANSMITTER}.position.2=6,50,99,101,120,500km"], "satellite-flies-straight"),
    "speed": (mission_of(), [f"{TRANSMITTER}.velocity.1=150,2999,3001,7600m/s"], "satellite-flies-straight"),
    "slow and high": (
        mission_of(platforms__transmitter__position=["30 km", 0, "150 km"]),
        [f"{TRANSMITTER}.velocity.1=20,99,101,150m/s"],
        "satellite-flies-straight",
    ),
    "errors of a path that does not fall": (
        mission_of(platforms__transmitter=LEVEL, requirements=LOOSE),
        [f"{TRANSMITTER}.motion_error.position.1=0,1,500,5000m"],
        "satellite-does-not-fall",
    ),
    "aperture of a path that does not fall": (
        mission_of(platforms__transmitter=LEVEL, requirements=LOOSE),
        ["collection.aperture_time=0.01,0.1,1,6,12s"],
        "satellite-does-not-fall",
    ),
    "acceleration of a path that may fall": (
        mission_of(platforms__transmitter=LEVEL, requirements=LOOSE),
        [f"{TRANSMITTER}.acceleration.2=-8.4,-8,-4,0m/s^2", f"{TRANSMITTER}.acceleration.0=-0.4,0m/s^2"],
        "satellite-does-not-fall",
    ),
    "lever arm": (
        mission_of(platforms__receiver__motion_error=ARM),
        [f"{RECEIVER}.motion_error.lever_arm.arm.0=0,2m"],
        "nothing-swings-the-arm",
    ),
    "lever arm that is asked for": (
        mission_of(platforms__receiver__motion_error=ARM, requirements__declare=["receiver.lever_arm"]),
        [f"{RECEIVER}.motion_error.lever_arm.arm.0=0,2m"],
        "nothing-swings-the-arm",
    ),
    "sensitivity": (
        mission_of(**fed(acceleration_sensitivity="1e-9 /g")),
        [f"{RECEIVER}.oscillator.acceleration_sensitivity=0,1e-10,1e-9/g"],
        "nothing-shakes-the-oscillator",
    ),
    "sensitivity that is asked for": (
        mission_of(**fed(acceleration_sensitivity="1e-9 /g"), requirements__declare=["receiver.oscillator"]),
        [f"{RECEIVER}.oscillator.acceleration_sensitivity=0,1e-9/g"],
        "nothing-shakes-the-oscillator",
    ),
    "sensitivity that the file does not state": (
        mission_of(**fed()),
        [f"{RECEIVER}.oscillator.acceleration_sensitivity=0,1e-10,1e-9/g"],
        "nothing-shakes-the-oscillator",
    ),
    "turn that shakes an oscillator": (
        mission_of(**fed(acceleration_sensitivity="1e-9 /g"), platforms__receiver__acceleration=[0, "1 m/s^2", 0]),
        [f"{RECEIVER}.acceleration.1=0,1e-7,1m/s^2"],
        "nothing-shakes-the-oscillator",
    ),
    "scale factor of an aided navigation": (
        mission_of(platforms__receiver__motion_error=AIDED, platforms__receiver__acceleration=[0, "1 m/s^2", 0]),
        [
            f"{RECEIVER}.motion_error.navigation.imu.accelerometer_scale_factor=0,10,1000ppm",
            f"{RECEIVER}.acceleration.1=0,1m/s^2",
        ],
        "scale-factor-in-a-turn",
    ),
    "age of elements": (
        BESANCON,
        ["collection.center_time=2021-03-20T17:24:02Z,2021-04-01T17:24:02Z"],
        "path-is-doubtful",
    ),
    "errors of old elements": (
        BESANCON.replace({"collection.center_time": "2021-04-01T17:24:02Z"}),
        [f"{TRANSMITTER}.motion_error.position=1,20,26.2,26.3,40km"],
        "path-is-doubtful",
    ),
}


def findings_of(mission: Mission, cases: Cases, place: int) -> MissionFindings | None:
    """The check of the mission of a case; None if it makes no mission."""
    values = {key: column[0] for key, column in cases.values(place, place + 1).items()}
    changes = []
    for number in cases.varied:
        value = values[number.key]
        is_number = not isinstance(value, str)
        text = f"{float(value)!r} {number.dimension.si}".rstrip() if is_number else value
        changes.append(SetValue(number.key, text))
    try:
        return check_mission(parse_mission(mission.data, mission.file, changes=(*mission.changes, *changes)), DAY)
    except MissionError:
        return None


def doubts_of(findings: MissionFindings) -> set[str]:
    return {warning.message.code for warning in findings.warnings if warning.is_doubt}


def assert_alike(mission: Mission, cases: Cases) -> list[MissionFindings]:
    """Compare status and doubts of each case with those of `check`; return the findings of these checks."""
    parts = list(Asked(mission, cases, today=DAY).checked().parts)
    statuses, doubts = (np.concatenate([part.values[name] for part in parts]) for name in ("status", "doubts"))
    checked = []
    for place in range(cases.count):
        findings = findings_of(mission, cases, place)
        if findings is None:
            assert statuses[place] == "error"
            continue
        checked.append(findings)
        values = cases.values(place, place + 1)
        assert statuses[place] == findings.status, values
        assert {*doubts[place].split("; ")} - {""} == doubts_of(findings), values
    return checked


@pytest.mark.parametrize("name", TABLE)
def test_a_case_in_doubt_has_the_status_of_its_check(name: str) -> None:
    mission, texts, code = TABLE[name]
    checked = assert_alike(mission, grid(tree_of(mission), texts))
    in_doubt = [code in doubts_of(findings) for findings in checked]
    assert any(in_doubt)
    assert not all(in_doubt)


def test_every_doubt_of_the_check_is_in_the_table() -> None:
    assert {code for *_, code in TABLE.values()} == MISSION_DOUBTS.keys()


def test_missions_checked_together_have_the_doubts_of_each_alone() -> None:
    missions = [mission for mission, _, _ in TABLE.values()]
    for index, findings in check_missions(missions, DAY):
        alone = check_mission(missions[index], DAY)
        assert (findings.status, doubts_of(findings)) == (alone.status, doubts_of(alone))


@settings(max_examples=20, deadline=None)
@given(
    height_km=st.lists(st.floats(5, 800), min_size=2, max_size=4, unique=True),
    speed=st.lists(st.floats(0.1, 8e3), min_size=2, max_size=4, unique=True),
    error_m=st.floats(0, 1e4),
    is_stated=st.booleans(),
)
def test_any_height_and_speed(height_km: list[float], speed: list[float], error_m: float, is_stated: bool) -> None:
    platform = {
        **HIGH,
        **({"acceleration": [0, 0, 0]} if is_stated else {}),
        "motion_error": {"position": f"{error_m!r} m", "source": "assumed"},
    }
    mission = mission_of(platforms__transmitter=platform, requirements=LOOSE)
    texts = [
        f"{TRANSMITTER}.position.2={','.join(map(repr, height_km))}km",
        f"{TRANSMITTER}.velocity.1={','.join(map(repr, speed))}m/s",
    ]
    assert_alike(mission, grid(tree_of(mission), texts))


def test_a_warning_about_the_mission_keeps_a_strict_target_from_complying() -> None:
    """Compliance with the target `warn` ends where the path becomes a satellite's."""
    mission = mission_of(platforms__transmitter__position=["30 km", 0, "60 km"])
    solution = bb.solve(mission, f"{TRANSMITTER}.position.2", between=("50 km", "200 km"), target="warn", date=DAY)
    (crossing,) = solution.crossings
    assert crossing.inside.value == pytest.approx(100e3, rel=1e-3)
    assert crossing.outside.status == "warn"


@pytest.mark.parametrize("name", TABLE)
def test_solve_states_the_status_of_the_file(name: str) -> None:
    mission, (text, *_), _ = TABLE[name]
    key = text.partition("=")[0]
    try:
        given_state = bb.solve(mission, key, between=None, date=DAY).given
    except bb.QuestionError:  # the file states no number, or nothing decides
        return
    assert given_state is None or given_state.status == check_mission(mission, DAY).status
