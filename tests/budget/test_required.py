"""What a mission file must declare, by `requirements.declare`; the document that it names."""

import itertools
import json
import re
from datetime import timedelta

import pytest

from bisar_budget.budget.declarations import Missing, missing_declarations
from bisar_budget.faults import MissionError
from bisar_budget.findings.mission import Report
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import DECLARABLE, OF_MISSION, OF_PLATFORMS, Document
from bisar_budget.report import Style, render
from tests.conftest import TEXT_FORMATS, TODAY, findings, mission_text, row

ALL = {"position": "1 cm", "velocity": "0.1 mm/s", "acceleration": "1 ug"}
ERROR = "platforms__{}__motion_error"
PLATFORMS = ("transmitter", "receiver")
# What declares each kind besides: a zero does.
ZERO = {
    "position": {"position": 0},
    "velocity": {"velocity": 0},
    "acceleration": {"acceleration": 0},
    "covariance": {"covariance": {"position": "1 cm", "velocity": "0.1 mm/s"}},
    "imu": {"imu": {"gyro_bias": 0}},
    "random": {"random": [{"name": "GNSS", "sigma": 0, "correlation_time": "1 s"}]},
    "vibration": {"vibration": {"wideband": {"rms": 0}}},
    "time_tag": {"time_tag": 0},
    "lever_arm": {"lever_arm": {"uncertainty": 0}},
    "navigation": {
        "navigation": {
            "imu": dict.fromkeys(("accelerometer_bias", "gyro_bias", "velocity_random_walk", "angle_random_walk"), 0),
            "gnss": {"position": "1 cm", "rate": "5 Hz"},
        }
    },
}
OTHERS = (
    "imu",
    "random",
    "vibration",
    "time_tag",
    "lever_arm",
)  # kinds that are no position, velocity or acceleration
OF_MISSION_ZERO = {
    "scene": {"height_error": 0},
    "synchronization": {"interval": "1 s", "error": 0},
    "propagation": {"zenith_delay": 0},
    "common_motion_error": {"position": 0},
    "other_errors": [{"name": "antenna", "location_error": 0}],
}
OSCILLATOR = {"power_law": {"h0": 0}}
STILL = {"position": ["6 km", "6 km", "2 km"], "velocity": [0, 0, 0]}


def declared(**changes):
    """Every error of motion and of the clock declared, then changed."""
    tree = {ERROR.format(name): dict(ALL) for name in PLATFORMS} | {"timing_error": {"constant": "1 ns"}}
    return tree | changes


def not_evaluated(found) -> dict[str, str]:
    """Rows of errors; the row of all that is asked for says the same of the file."""
    of_errors = {r.id: r.reason for r in found.rows if r.status == "not_evaluated" and r.id != "mission.declare"}
    rows = [r for r in found.rows if r.id == "mission.declare"]
    assert [r.status for r in rows] == (["not_evaluated" if of_errors else "pass"] if rows else [])
    return of_errors


def missing(**changes) -> list[Missing]:
    return missing_declarations(parse_mission(mission_text(**changes), "mission.yaml"))


def test_a_file_that_declares_all_that_is_asked_for_is_judged() -> None:
    asked = ["position", "velocity", "acceleration", "timing"]
    found = findings(requirements__declare=asked, **declared())
    assert not_evaluated(found) == {}
    assert found.status == "pass"
    assert row(found, "mission.declare").reason is None


def test_without_the_key_nothing_is_asked_for() -> None:
    assert missing() == missing(requirements__declare=[]) == []
    assert "mission.declare" not in {one.id for one in findings(requirements__declare=[]).rows}


@pytest.mark.parametrize("combine", ["each", "sum", "rss"])
@pytest.mark.parametrize(("name", "kind"), list(itertools.product(PLATFORMS, ALL)))
def test_what_is_missing_is_not_evaluated_and_named(name: str, kind: str, combine: str) -> None:
    without = {key: value for key, value in ALL.items() if key != kind}
    changes = declared(**{ERROR.format(name): without})
    reason = f"the file has no platforms.{name}.motion_error.{kind}, which requirements.declare asks for"
    found = findings(requirements__declare=[kind], allocation__combine=combine, **changes)
    assert not_evaluated(found) == {f"{name}.{kind}.{axis}": reason for axis in "xyz"}
    assert row(found, "mission.declare").reason == reason
    assert found.status == "not_evaluated"
    assert all(row(found, f"{name}.{kind}.{axis}").declared is None for axis in "xyz")
    others = [other for other in (*ALL, "timing") if other != kind]
    assert not_evaluated(findings(requirements__declare=others, allocation__combine=combine, **changes)) == {}


@pytest.mark.parametrize("name", PLATFORMS)
@pytest.mark.parametrize("kind", OF_PLATFORMS)
def test_each_kind_is_asked_for_of_both_platforms_or_of_one_and_a_zero_declares_it(name: str, kind: str) -> None:
    """Sensors, oscillators, vibration and covariances could not be asked for; their rows stand only if declared."""
    key = "oscillator" if kind == "oscillator" else f"motion_error.{kind}"
    both = [Missing(one, kind, f"platforms.{one}.{key}") for one in PLATFORMS]
    own = both[PLATFORMS.index(name)]
    assert missing(requirements__declare=[kind]) == both
    assert missing(requirements__declare=[f"{name}.{kind}"]) == [own]
    assert sorted(missing(requirements__declare=[f"{name}.{kind}", kind])) == sorted(both)
    path = f"platforms__{name}__{'oscillator' if kind == 'oscillator' else 'motion_error'}"
    changes = {path: OSCILLATOR if kind == "oscillator" else ZERO[kind]}
    assert missing(requirements__declare=[f"{name}.{kind}"], **changes) == []
    assert missing(requirements__declare=[kind], **changes) == [one for one in both if one != own]
    found = findings(requirements__declare=[f"{name}.{kind}"], requirements__pslr="-30 dB")
    assert found.status == row(found, "mission.declare").status == "not_evaluated"
    assert f"platforms.{name}.{key}" in row(found, "mission.declare").reason
    found = findings(requirements__declare=[f"{name}.{kind}"], **changes)
    assert row(found, "mission.declare").status == "pass"


def test_an_empty_section_declares_nothing() -> None:
    empty = {"imu": {"source": "nothing known"}, "random": [], "vibration": {"sinusoidal": []}}
    asked = [f"receiver.{kind}" for kind in empty]
    found = missing(requirements__declare=asked, platforms__receiver__motion_error=empty)
    assert [one.kind for one in found] == ["imu", "random", "vibration"]


def test_lines_declare_vibration_as_noise_does() -> None:
    lines = {"vibration": {"sinusoidal": [{"amplitude": "1 um", "frequency": "15 Hz"}]}}
    assert missing(requirements__declare=["receiver.vibration"], platforms__receiver__motion_error=lines) == []


def test_the_clock_is_declared_by_any_term() -> None:
    asked = {"requirements__declare": ["timing"]}
    ids = {f"timing.{term}" for term in ("constant", "linear", "quadratic", "cubic")}
    without = not_evaluated(findings(**asked, **declared(timing_error={})))
    assert without == dict.fromkeys(ids, "the file has no timing_error, which requirements.declare asks for")
    for term in ("constant", "linear", "quadratic", "cubic"):
        assert not_evaluated(findings(**asked, **declared(timing_error={term: 0}))) == {}


@pytest.mark.parametrize(
    "word", ["receiver.timing", "clock.timing", "mission.position", "receiver.", "receiver.imus"]
)
def test_the_clock_is_of_no_platform_and_other_words_are_none(word: str) -> None:
    with pytest.raises(MissionError) as caught:
        parse_mission(mission_text(requirements__declare=[word]), "mission.yaml")
    (fault,) = caught.value.faults
    assert (fault.key, fault.problem) == ("requirements.declare[0]", "is not a known choice")


def test_an_error_in_another_frame_and_a_covariance_declare_too() -> None:
    receiver = {"frame": "track", "covariance": {"position": "1 cm", "velocity": "0.1 mm/s"}}
    found = findings(
        requirements__declare=["position", "velocity"],
        **declared(**{ERROR.format("transmitter"): {"frame": "look", **ALL}, ERROR.format("receiver"): receiver}),
    )
    assert not_evaluated(found) == {}
    found = findings(requirements__declare=["acceleration"], **declared(**{ERROR.format("receiver"): receiver}))
    assert set(not_evaluated(found)) == {f"receiver.acceleration.{axis}" for axis in "xyz"}


def test_a_part_declares_what_it_states() -> None:
    error = {ERROR.format("receiver"): {"sensor": ["stim300", "mosaic-x5-rtk"]}}
    asked = [f"receiver.{kind}" for kind in ("position", "velocity", "imu", "acceleration")]
    assert [one.kind for one in missing(requirements__declare=asked, **error)] == ["acceleration"]


def test_a_common_error_says_nothing_of_the_platforms_own() -> None:
    found = findings(requirements__declare=["position"], common_motion_error={"position": "1 m"})
    assert len(not_evaluated(found)) == 6


@pytest.mark.parametrize(
    "receiver",
    [STILL, {"slant_range": "9 km", "azimuth": "45 deg", "elevation": "13 deg", "speed": 0}],
    ids=["velocity", "speed"],
)
def test_a_platform_that_does_not_move_owes_its_position_only(receiver: dict) -> None:
    of_transmitter = {
        "motion_error": ALL | {key: value for kind in OTHERS for key, value in ZERO[kind].items()},
        "oscillator": OSCILLATOR,
    }
    changes = {f"platforms__transmitter__{key}": value for key, value in of_transmitter.items()}
    asked = [kind for kind in DECLARABLE if kind not in ("covariance", "navigation")]
    changes |= {"requirements__declare": asked, "timing_error": {"linear": 0}, **OF_MISSION_ZERO}
    found = missing(platforms__receiver=receiver, **changes)
    assert found == [Missing("receiver", "position", "platforms.receiver.motion_error.position")]
    assert missing(platforms__receiver=receiver | {"motion_error": {"position": "1 cm"}}, **changes) == []
    moving = STILL | {"velocity": [0, "1 mm/s", 0], "motion_error": {"position": "1 cm"}}
    of_receiver = {*asked} - {"position", *OF_MISSION}
    assert {one.kind for one in missing(platforms__receiver=moving, **changes)} == of_receiver


def test_a_platform_that_starts_from_rest_moves() -> None:
    receiver = STILL | {"acceleration": ["1 m/s^2", 0, 0]}
    assert missing(requirements__declare=["receiver.velocity"], platforms__receiver=receiver)


def test_the_oscillator_of_a_still_platform_is_owed_where_it_is_asked_for_by_name() -> None:
    """A fixed receiver has a clock of its own, though no motion."""
    (one,) = missing(requirements__declare=["receiver.oscillator"], platforms__receiver=STILL)
    assert one == Missing("receiver", "oscillator", "platforms.receiver.oscillator")
    assert missing(requirements__declare=["receiver.imu", "receiver.velocity"], platforms__receiver=STILL) == []


@pytest.mark.parametrize(
    ("waived", "until", "status"),
    [
        ("mission.declare", TODAY, "waived"),
        ("mission.*", TODAY, "waived"),
        ("mission.declare", TODAY - timedelta(1), "not_evaluated"),
        ("receiver.acceleration.*", TODAY, "not_evaluated"),
        ("mission.islr", TODAY, "not_evaluated"),
    ],
)
def test_a_waiver_of_the_declarations_covers_what_is_missing(waived: str, until, status: str) -> None:
    waivers = [{"id": waived, "until": str(until), "reason": "not yet measured"}]
    asked = ["acceleration", "receiver.imu"]
    changes = declared(**{ERROR.format("receiver"): {"position": "1 cm"}})
    found = findings(requirements__declare=asked, waivers=waivers, **changes)
    assert found.status == status
    statuses = {one.status for one in found.rows if one.is_of_declare}
    assert statuses == ({"waived"} if status == "waived" else statuses)
    assert row(found, "mission.declare").status == status


def test_what_is_waived_is_no_compliance_where_nothing_is_declared() -> None:
    waivers = [{"id": "mission.declare", "until": str(TODAY), "reason": "not yet measured"}]
    found = findings(requirements__declare=["velocity"], waivers=waivers)
    assert found.is_empty
    assert found.status == "not_evaluated"


def test_the_projects_own_id_of_the_requirement_is_carried() -> None:
    found = findings(requirements__declare=["velocity"], requirement_ids={"mission.declare": "SYS-7"})
    assert row(found, "mission.declare").requirement_id == "SYS-7"
    assert not [one for one in found.warnings if "SYS-7" in one.message or "mission.declare" in one.message]


@pytest.mark.parametrize("format_name", sorted(set(TEXT_FORMATS) - {"requirements", "sdoc"}))  # which have no rows
def test_every_format_says_what_is_missing(format_name: str) -> None:
    found = findings(
        requirements__declare=["velocity", "receiver.imu"], **declared(**{ERROR.format("receiver"): {"position": 1}})
    )
    text = render(format_name, Report(version="0", missions=(found,)), Style())
    plain = re.sub(r"<wbr/?>|\\", "", text)  # marks where a line may break, and escaped points
    said = re.sub(r"\s+", " ", plain)
    assert "which requirements.declare asks for" in said
    assert "no platforms.receiver.motion_error.velocity and no platforms.receiver.motion_error.imu" in said
    assert "receiver.velocity.x" in plain
    assert "mission.declare" in plain


def test_the_document_is_carried_into_findings_and_json() -> None:
    document = {"number": "DOC-7", "issue": 3, "author": "A. Nobody"}
    found = findings(document=document)
    assert found.document == Document(number="DOC-7", issue="3", author="A. Nobody")
    (mission,) = json.loads(render("json", Report(version="0", missions=(found,)), Style()))["missions"]
    assert mission["document"] == {"number": "DOC-7", "issue": "3", "author": "A. Nobody"}
    (mission,) = json.loads(render("json", Report(version="0", missions=(findings(),)), Style()))["missions"]
    assert mission["document"] == {"number": None, "issue": None, "author": None}
