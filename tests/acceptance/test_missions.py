"""Mission files found by folder: what a good, a bad and an example mission give through the command line."""

import json
import re
from pathlib import Path

import jsonschema
import pytest
import yaml

from bisar_budget.mission.model import mission_schema
from tests.conftest import ROOT, mission_file

HERE = Path(__file__).parent
GOOD = sorted((HERE / "good").glob("*.yaml"))
BAD = sorted((HERE / "bad").glob("*.yaml"))
EXAMPLES = sorted((ROOT / "specs" / "missions").glob("*.yaml"))


def name(path: Path) -> str:
    return path.stem


def header(path: Path, key: str) -> list[str]:
    return re.findall(rf"(?m)^# {key}: (.*)$", path.read_text(encoding="utf-8"))


def check(run, path: Path):
    result = run("check", path, "--format", "json", "--date", "2026-11-21")
    return result, json.loads(result.stdout)["missions"][0]


def test_the_folders_are_not_empty() -> None:
    assert len(BAD) >= 40
    assert len(GOOD) >= 5
    assert len(EXAMPLES) >= 5


@pytest.mark.parametrize("path", GOOD, ids=name)
def test_good(run, path: Path) -> None:
    result, mission = check(run, path)
    (status,) = header(path, "status")
    assert mission["status"] == status
    assert result.exit_code == (1 if status in ("fail", "not_evaluated") else 0)
    assert result.stderr == ""


@pytest.mark.parametrize("path", BAD, ids=name)
def test_bad(run, path: Path) -> None:
    """Every fault at its line and column, exit 2, no traceback, and a complete document."""
    result, mission = check(run, path)
    assert result.exit_code == 2
    assert "Traceback" not in result.output
    assert mission["status"] == "error"
    got = [
        f"{error['line'] or '-'}:{error['column'] or '-'} "
        + (f"{error['key']}: " if error["key"] else "")
        + error["message"]
        for error in mission["errors"]
    ]
    (faults,) = header(path, "faults")
    assert " | ".join(got) == faults
    assert len(result.stderr.splitlines()) == len(got)
    for line in result.stderr.splitlines():
        assert line.startswith(str(path))


@pytest.mark.parametrize("path", BAD, ids=name)
def test_bad_faults_point_at_the_culprit(path: Path) -> None:
    """The place named holds the key or the value: an independent look at what the header claims."""
    lines = path.read_text(encoding="utf-8").splitlines()
    for fault in header(path, "faults")[0].split(" | "):
        match = re.match(r"(\d+):(\d+) (?:([\w.\[\] -]+): )?", fault)
        if match is None or "YAML" in fault or "missing" in fault or "lacks" in fault or "has a key" in fault:
            continue
        line, column, key = int(match[1]), int(match[2]), match[3]
        last = re.sub(r"\[\d+\]", "", key.split(".")[-1])
        assert column <= len(lines[line - 1]) + 1
        above = 8 if "covariance" in key else 3  # a matrix has its key above its first row
        nearby = "\n".join(lines[max(0, line - above) : line])
        assert last in nearby, fault


# What examples warn of: the noise of a short log decides how its path is curved; a velocity sigma of single fixes.
WARNINGS = {
    "sentinel1_aircraft_log": ("the noise of the log leaves the acceleration of its path uncertain",),
    "uav_pair_l_band": ("sigmas of 20 mm and 7 mm/s contradict each other",),
}


@pytest.mark.parametrize("path", EXAMPLES, ids=name)
def test_example_gives_what_its_comments_say(run, path: Path) -> None:
    result, mission = check(run, path)
    expectations = header(path, "expect")
    assert len(expectations) >= 2
    rows = {row["id"]: row for row in mission["rows"]}
    for expectation in expectations:
        subject, status, *figure = expectation.split()
        if subject == "mission":
            assert mission["status"] == status
            assert result.exit_code == (1 if status in ("fail", "not_evaluated") else 0)
            continue
        assert rows[subject]["status"] == status
        if figure:
            assert 100 * rows[subject]["utilization"] == pytest.approx(float(figure[0]), rel=5e-3)
    assert result.stderr == ""
    said = [warning["message"] for warning in mission["warnings"]]
    assert len(said) == len(WARNINGS.get(path.stem, ()))
    assert all(words in text for words, text in zip(WARNINGS.get(path.stem, ()), said, strict=True))


def test_section_v_numbers(run) -> None:
    """4.63 rad = 1.47 pi at 10 GHz, from Table II row 4 by hand; 2.95 is the least N_pull."""
    _, mission = check(run, ROOT / "specs/missions/rigling_moses_section_v.yaml")
    row = next(row for row in mission["rows"] if row["id"] == "transmitter.acceleration.x")
    assert row["qpe_published_rad"] == pytest.approx(4.63, abs=0.005)
    assert "n_pull 2.95" in row["reason"]


@pytest.mark.parametrize(("n_pull", "status", "use"), [(2.94, "fail", 1.002), (3, "pass_with_autofocus", 0.982)])
def test_section_v_around_its_least_n_pull(run, tmp_path, n_pull, status, use) -> None:
    text = (ROOT / "specs/missions/rigling_moses_section_v_autofocus.yaml").read_text(encoding="utf-8")
    path = tmp_path / "m.yaml"
    path.write_text(text.replace("n_pull: 4", f"n_pull: {n_pull}"), encoding="utf-8")
    _, mission = check(run, path)
    row = next(row for row in mission["rows"] if row["id"] == "transmitter.acceleration.x")
    assert row["status"] == status
    assert row["utilization"] == pytest.approx(use, abs=1e-3)


# What the findings of the examples with sensors and clocks say of other values than theirs, and free-running sensors.
FIXES = "rate: 5 Hz }\n"
IN_FLIGHT = f"{FIXES}        method: filtered\n"
VARIANTS = (
    ("uav_free_running", "attitude: 0.015 deg", "attitude: 0.02 deg", "receiver.quadratic_phase_error", "fail"),
    ("uav_free_running", "imu:\n", "imu:\n        accelerometer_bias: 1.1 mg\n", "receiver.quadratic_phase_error",
     "fail"),
    ("uav_free_running", "sigma: 0.5 mm", "sigma: 6 mm", "receiver.islr", "fail"),
    ("uav_stim300", "time: 2.48 s", "time: 5.8 s", "receiver.quadratic_phase_error", "warn"),
    ("uav_stim300", "time: 2.48 s", "time: 5.9 s", "receiver.quadratic_phase_error", "fail"),
    ("uav_stim300", "sensor: stim300", "sensor: adis16460", "receiver.islr", "pass"),
    ("uav_stim300", "sensor: stim300", "sensor: mti-g", "receiver.islr", "pass"),
    ("uav_stim300", "x5-rtk, rate: 5 Hz", "x5-standalone, rate: 5 Hz, correlation_time: 100 s",
     "mission.location_error", "fail"),
    ("uav_stim300", "x5-rtk, rate: 5 Hz", "x5-standalone, rate: 5 Hz, correlation_time: 100 s",
     "receiver.quadratic_phase_error", "pass"),
    ("uav_stim300", FIXES, IN_FLIGHT, "receiver.islr", "fail"),
    ("uav_quick_look", "method: filtered", "method: smoothed", "receiver.islr", "pass"),
    ("uav_quick_look", "method: filtered", "method: smoothed", "receiver.quadratic_phase_error", "pass"),
    ("uav_quick_look", "rate: 5 Hz", "rate: 200 Hz", "receiver.islr", "fail"),
    ("uav_quick_look", IN_FLIGHT, f"{IN_FLIGHT}        outages: [{{ from: -1.24 s, to: 1.24 s }}]\n",
     "receiver.islr", "pass"),
    ("uav_quick_look", IN_FLIGHT, f"{IN_FLIGHT}        outages: [{{ from: -1.24 s, to: 1.24 s }}]\n",
     "receiver.quadratic_phase_error", "pass"),
    ("standard_rate_turn", "heading: 0.05 deg", "heading: 5 deg", "receiver.quadratic_phase_error", "pass"),
    ("standard_rate_turn", "heading: 0.05 deg", "method: filtered", "receiver.quadratic_phase_error", "fail"),
    ("ocxo_free_running", "time: 2.48 s", "time: 0.55 s", "receiver.quadratic_phase_error", "warn"),
    ("ocxo_free_running", "time: 2.48 s", "time: 0.7 s", "receiver.quadratic_phase_error", "fail"),
    ("ocxo_free_running", "allocation:", "autofocus: {n_pull: 2}\nallocation:", "receiver.quadratic_phase_error",
     "warn"),  # what autofocus would bring to pass rests on the noise below the mask
    ("ocxo_free_running", "allocation:", "autofocus: {n_pull: 2}\nallocation:", "receiver.islr", "fail"),
    ("tandem_x_synchronized", "200 ms", "500 ms", "receiver.islr", "warn"),
    ("tandem_x_synchronized", "200 ms", "1 s", "receiver.islr", "fail"),
    ("tandem_x_synchronized", "200 ms", "1 s", "receiver.quadratic_phase_error", "pass"),
    ("ocxo_direct_path", "error: 3 deg", "error: 3.5 deg", "receiver.islr", "warn"),
    ("ocxo_direct_path", "error: 3 deg", "error: 5 deg", "receiver.islr", "fail"),
    ("ocxo_direct_path", "position: 10 cm", "position: 100 m", "mission.location_error", "pass"),
    ("tandem_x_synchronized", "error: 1 deg", "error: 3.5 deg", "timing.islr", "warn"),
)  # fmt: skip


@pytest.mark.parametrize(("stem", "here", "there", "row", "status"), VARIANTS)
def test_findings_about_sensors_and_clocks(run, tmp_path, stem, here, there, row, status) -> None:
    text = mission_file(stem).read_text(encoding="utf-8")
    assert here in text
    path = tmp_path / "m.yaml"
    path.write_text(text.replace(here, there), encoding="utf-8")
    _, mission = check(run, path)
    (found,) = [one for one in mission["rows"] if one["id"] == row]
    assert found["status"] == status


class _Core(yaml.SafeLoader):
    """YAML 1.2's numbers, as editors read them; dates stay text."""


_Core.yaml_implicit_resolvers = {
    first: [
        (tag, pattern)
        for tag, pattern in resolvers
        if tag not in ("tag:yaml.org,2002:timestamp", "tag:yaml.org,2002:bool")
    ]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}


SCHEMA_SEES = (
    "unknown_key_near", "unknown_key_far", "unknown_nested_key", "missing_section", "missing_key", "two_components",
    "section_is_text", "share_of_nobody", "split_misspelt", "combine_unknown", "covariance",
    "common_motion_error", "frame_unknown", "waiver_without_reason",
    "schema_version", "no_schema_version", "pulses_fraction", "scalar_position", "bare_angle",
)  # fmt: skip


class TestSchema:
    validator = jsonschema.Draft7Validator(mission_schema())

    def test_is_a_draft_7_schema(self) -> None:
        jsonschema.Draft7Validator.check_schema(mission_schema())
        assert "$defs" not in json.dumps(mission_schema())
        assert "prefixItems" not in json.dumps(mission_schema())

    @pytest.mark.parametrize("path", [*GOOD, *EXAMPLES], ids=name)
    def test_accepts_what_the_tool_accepts(self, path: Path) -> None:
        self.validator.validate(yaml.load(path.read_text(encoding="utf-8"), Loader=_Core))

    @pytest.mark.parametrize("stem", SCHEMA_SEES)
    def test_refuses_what_a_schema_can_see(self, stem: str) -> None:
        document = yaml.load((HERE / "bad" / f"{stem}.yaml").read_text(encoding="utf-8"), Loader=_Core)
        assert list(self.validator.iter_errors(document))
