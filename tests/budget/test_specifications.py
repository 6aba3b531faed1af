"""`specifications` of a mission file: what is declared, held to what was ordered."""

from datetime import date

import numpy as np
import pytest
import yaml

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.check import check_mission, check_missions
from bisar_budget.budget.judged_mission import judged_mission
from bisar_budget.faults import MissionError
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.row import Row
from bisar_budget.findings.status import RANK
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.quantities import with_number
from tests.conftest import TODAY, mission_text

RSS = {"allocation__combine": "rss", "allocation__model": "full"}
VELOCITY = "platforms.receiver.motion_error.velocity"
LEVEL = "platforms.receiver.oscillator.level"
MASK = "{frequency: 10 MHz, phase_noise: {1 Hz: -110 dBc/Hz, 1 kHz: -150 dBc/Hz}, level: LEVEL}"


def text(specifications: str, **changes: object) -> str:
    read = {key: yaml.safe_load(value) if isinstance(value, str) else value for key, value in changes.items()}
    return f"{mission_text(**RSS, **read)}\nspecifications: {specifications}\n"


def found(specifications: str, today: date = TODAY, **changes: object) -> MissionFindings:
    return check_mission(parse_mission(text(specifications, **changes)), today)


def row_of(findings: MissionFindings, name: str) -> Row:
    (row,) = [row for row in findings.rows if row.id == f"specification.{name}"]
    return row


@pytest.mark.parametrize(
    ("declared", "status"),
    [("4.999999 mm/s", "pass"), ("5 mm/s", "pass"), ("5.000001 mm/s", "fail"), ("[-6 mm/s, 0 m/s, 0 m/s]", "fail")],
)
def test_all_of_it_may_be_used_and_no_more(declared: str, status: str) -> None:
    """The largest of three axes counts, whatever its sign."""
    changes = {"platforms__receiver__motion_error": f"{{velocity: {declared}}}"}
    row = row_of(found(f"{{{VELOCITY}: 5 mm/s}}", **changes), "receiver.velocity")
    assert row.status == status
    assert row.allowable == 0.005
    assert row.utilization == pytest.approx((row.declared or 0.0) / 0.005)


def test_a_coverage_factor_is_none_of_a_suppliers() -> None:
    changes = {"platforms__receiver__motion_error": "{velocity: 5 mm/s}", "allocation__coverage_factor": 3}
    row = row_of(found(f"{{{VELOCITY}: 5 mm/s}}", **changes), "receiver.velocity")
    assert (row.status, row.declared) == ("pass", 0.005)


def test_more_than_is_specified_fails_a_mission_that_bears_it() -> None:
    asked = {"platforms__receiver__motion_error": "{velocity: 5 mm/s}"}
    findings = found(f"{{{VELOCITY}: 4.9 mm/s}}", **asked)
    assert all(one.status == "pass" for one in findings.requirements)
    assert findings.status == "fail"


def test_what_is_specified_and_not_declared_is_not_evaluated() -> None:
    findings = found(f"{{{VELOCITY}: 5 mm/s}}", platforms__receiver__motion_error="{position: 1 m}")
    assert row_of(findings, "receiver.velocity").status == "not_evaluated"
    assert findings.status == "not_evaluated"


@pytest.mark.parametrize(("level", "status"), [("-1 dB", "pass"), ("2 dB", "pass"), ("2.01 dB", "fail")])
def test_levels_are_compared_in_decibel(level: str, status: str) -> None:
    row = row_of(
        found(f"{{{LEVEL}: 2 dB}}", platforms__receiver__oscillator=MASK.replace("LEVEL", level)),
        "receiver.oscillator.level",
    )
    assert row.status == status
    assert row.utilization == pytest.approx(10 ** ((float(level.split()[0]) - 2) / 20))


@pytest.mark.parametrize(
    ("figure", "name", "size", "status"),
    [
        ("{power_law: {h-1: 1e-24}}", "power_law.h-1", "1e-24", "pass"),
        ("{power_law: {h-1: 1e-24}}", "power_law.h-1", "9.9e-25", "fail"),
        (MASK.replace("LEVEL", "0 dB"), "phase_noise.1 Hz", "-110 dBc/Hz", "pass"),
        (MASK.replace("LEVEL", "0 dB"), "phase_noise.1 Hz", "-110.1 dBc/Hz", "fail"),
    ],
)
def test_points_of_a_spectrum_are_held_too(figure: str, name: str, size: str, status: str) -> None:
    """They are keys that `allocate` takes, and writes."""
    key = f"platforms.receiver.oscillator.{name}"
    findings = found(f"{{{key}: {size}}}", platforms__receiver__oscillator=figure)
    assert row_of(findings, f"receiver.oscillator.{name}").status == status


def test_a_spectrum_without_a_level_has_0_db() -> None:
    mask = MASK.replace(", level: LEVEL", "")
    assert (
        row_of(
            found(f"{{{LEVEL}: 0 dB}}", platforms__receiver__oscillator=mask), "receiver.oscillator.level"
        ).declared
        == 0
    )
    findings = found(f"{{{LEVEL}: 0 dB}}")
    assert row_of(findings, "receiver.oscillator.level").status == "not_evaluated"


def test_figures_of_parts_and_covariances_are_declared() -> None:
    """Gyro bias of the STIM300: 0.5 deg/h by its data sheet."""
    key = "platforms.receiver.motion_error.imu.gyro_bias"
    findings = found(f"{{{key}: 0.49 deg/h}}", platforms__receiver__motion_error="{sensor: stim300}")
    assert row_of(findings, "receiver.imu.gyro_bias").status == "fail"
    covariance = "{covariance: {position: [1 m, 2 m, 1 m], velocity: [1 mm/s, 3 mm/s, 1 mm/s]}}"
    findings = found(f"{{{VELOCITY}: 3 mm/s}}", platforms__receiver__motion_error=covariance)
    row = row_of(findings, "receiver.velocity")
    assert (row.status, row.declared) == ("pass", 0.003)


def test_a_waiver_covers_it_by_its_id() -> None:
    waived = "[{id: specification.receiver.velocity, until: 2030-01-01, reason: ECR-4}]"
    findings = found(
        f"{{{VELOCITY}: 1 mm/s}}", platforms__receiver__motion_error="{velocity: 5 mm/s}", waivers=waived
    )
    assert row_of(findings, "receiver.velocity").status == "waived"
    assert findings.status == "waived"


def test_many_cases_at_once_are_those_of_each() -> None:
    """In arrays, and of many files together."""
    mission = parse_mission(text(f"{{{VELOCITY}: 5 mm/s}}", platforms__receiver__motion_error="{velocity: 1 mm/s}"))
    many = with_number(mission, VELOCITY, np.array([0.004, 0.006]))
    (row,) = [row for row in judged_mission(Analysis(many, 2), TODAY).rows if row.subject.kind == "specification"]
    assert row.status.tolist() == [RANK["pass"], RANK["fail"]]
    sizes = ("1 mm/s", "9 mm/s", "5 mm/s")
    each = [
        parse_mission(text(f"{{{VELOCITY}: {size}}}", platforms__receiver__motion_error="{velocity: 5 mm/s}"))
        for size in sizes
    ]
    together = {place: row_of(one, "receiver.velocity").status for place, one in check_missions(each, TODAY)}
    assert together == {0: "fail", 1: "pass", 2: "pass"}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("{platforms.receiver.motion_error.velcity: 1 mm/s}", "'velcity' is not a known key"),
        ("{collection.aperture_time: 1 s}", "names no error that can be specified"),
        (f"{{{VELOCITY}: 3 m}}", "must be a speed"),
        (f"{{{VELOCITY}: 0 m/s}}", "must be greater than 0"),
        (f"{{{VELOCITY}: -1 m/s}}", "must be greater than 0"),
        (f"{{{VELOCITY}: [1 m/s, 1 m/s, 1 m/s]}}", "must be one size"),
        (f"{{{VELOCITY}: }}", "has no value"),
        ("[1 m/s]", "must be a mapping"),
        ("{platforms.receiver.motion_error.imu: 1 m}", "is a section"),
        ("{platforms.receiver.motion_error.random.3.sigma: 1 mm}", "none has the number 3"),
    ],
)
def test_what_is_no_specification_is_a_fault_with_its_place(given: str, said: str) -> None:
    with pytest.raises(MissionError) as caught:
        parse_mission(text(given))
    (fault,) = caught.value.faults
    assert said in fault.problem
    assert fault.key.startswith("specifications")
    assert fault.line is not None
