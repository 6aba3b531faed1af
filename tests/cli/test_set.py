"""`--set KEY=VALUE`: every report of the run says that it is not about the mission of the file."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import ROOT, TEXT_FORMATS

MISSION = str(ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml")
SET = "collection.aperture_time=1.2s"


@pytest.mark.parametrize("name", TEXT_FORMATS)
def test_every_format_says_what_was_set(run, name: str) -> None:
    text = run("check", MISSION, "--set", SET, "--format", name).output.replace("\\", "")
    assert "1.2s" in text
    assert "1.2s" not in run("check", MISSION, "--format", name).output


def test_the_first_line_says_it(run) -> None:
    for more in ([], ["-q"]):
        done = run("check", MISSION, "--set", SET, *more)
        first = " ".join(done.output.split())
        assert first.startswith(f"pass {MISSION} --set {SET}: every requirement is judged and met")
        assert done.exit_code == 0


def test_json_has_it(run) -> None:
    (mission,) = json.loads(run("check", MISSION, "--set", SET, "--format", "json").output)["missions"]
    assert mission["set"] == [{"key": "collection.aperture_time", "text": "1.2s"}]
    (mission,) = json.loads(run("check", MISSION, "--format", "json").output)["missions"]
    assert mission["set"] == []


def test_a_compliance_report_has_it_in_its_verdict_and_its_inputs(run, tmp_path: Path) -> None:
    report = tmp_path / "r.md"
    run("check", MISSION, "--set", SET, "--report", str(report), "--detail", "full")
    text = report.read_text(encoding="utf-8").replace("&#45;", "-")
    assert "with values set by options" in text
    assert "- aperture time: 1.2 s (--set)" in text
    assert "| --set | collection.aperture_time=1.2s | command line |" in text


def test_it_applies_to_each_of_several_missions(run) -> None:
    other = str(ROOT / "specs" / "missions" / "tandem_x.yaml")
    done = run("check", "-q", MISSION, other, "--set", "radar.bandwidth=100MHz", "--format", "json")
    found = json.loads(done.output)["missions"]
    assert [mission["set"][0]["text"] for mission in found] == ["100MHz"] * 2


def test_a_wrong_value_is_a_fault_of_the_mission(run) -> None:
    done = run("check", MISSION, "--set", "radar.bandwidth=3 m", "--format", "json")
    (mission,) = json.loads(done.stdout)["missions"]
    (error,) = mission["errors"]
    assert done.exit_code == 2
    assert (error["line"], error["key"], error["option"]) == (None, "radar.bandwidth", "--set radar.bandwidth")
    assert f"{MISSION}: --set radar.bandwidth: must be a frequency" in done.stderr


def test_what_is_no_key_and_value_is_wrong_usage(run) -> None:
    done = run("check", MISSION, "--set", "radar.bandwidth")
    assert done.exit_code == 2
    assert "--set: 'radar.bandwidth' is not KEY=VALUE; accepted: KEY=VALUE, such as" in done.stderr


@pytest.mark.parametrize(
    "command",
    [
        ["check", "--explain", "transmitter.acceleration.x"],
        ["verify", "--only", "transmitter.acceleration.x", "--jobs", "1"],
        ["verify", "--only", "transmitter.acceleration.x", "--jobs", "1", "--format", "json"],
        ["simulate"],
    ],
)
def test_the_other_commands_take_and_say_it(run, command: list[str]) -> None:
    name, *options = command
    assert "1.2s" in run(name, MISSION, "--set", SET, *options).output


def test_the_archive_of_images_has_it(run, tmp_path: Path) -> None:
    file = tmp_path / "v.npz"
    for texts, expected in (((SET, "radar.bandwidth=200 MHz"), [SET, "radar.bandwidth=200 MHz"]), ((), [])):
        options = [option for text in texts for option in ("--set", text)]
        assert run("simulate", MISSION, "-o", file, *options).exit_code == 0
        with np.load(file) as archive:  # without pickles
            assert archive["set"].tolist() == expected


class TestDiff:
    """A mission against itself with other values: what a change would do, before anybody makes it."""

    def test_it_compares_the_file_with_itself_changed(self, run) -> None:
        done = run("diff", MISSION, "--set", SET, "--set", "radar.bandwidth=150 MHz")
        assert done.exit_code == 0
        said = " ".join(done.stdout.split())
        assert said.startswith("9 rows changed, 19 unchanged, 0 newly failing ")
        assert f"{MISSION} -> {MISSION} --set {SET} --set 'radar.bandwidth=150 MHz', " in said
        assert "collection.aperture_time: 6 s -> 1.2s" in said
        assert "radar.bandwidth: 300 MHz -> 150 MHz" in said
        assert "transmitter.acceleration.x 1178 % 47.1 % -96 % FAIL -> pass" in said

    def test_one_element_of_a_list_and_keys_that_the_file_does_not_have(self, run) -> None:
        texts = (
            "platforms.transmitter.motion_error.acceleration.0=1mm/s^2",
            "platforms.receiver.motion_error.velocity=1mm/s",
            "platforms.receiver.motion_error.acceleration=2mm/s^2",
        )
        options = [option for text in texts for option in ("--set", text)]
        document = json.loads(run("diff", MISSION, *options, "--format", "json").stdout)
        (mission,) = document["missions"]
        assert mission["before"]["set"] == []
        assert [change["text"] for change in mission["after"]["set"]] == ["1mm/s^2", "1mm/s", "2mm/s^2"]
        inputs = {one["key"]: (one["before"], one["after"]) for one in mission["inputs"]}
        key = "platforms.transmitter.motion_error.acceleration"
        assert inputs[key] == ("[0.005 m/s^2, 0, 0]", "[1mm/s^2, 0, 0]")
        assert inputs["platforms.receiver.motion_error.velocity"] == (None, "1mm/s")
        assert inputs["platforms.receiver.motion_error.acceleration"] == (None, "2mm/s^2")
        assert len(inputs) == 3

    def test_each_of_several_missions_and_the_gate(self, run) -> None:
        other = str(ROOT / "specs" / "missions" / "tandem_x.yaml")
        done = run("diff", MISSION, other, "--set", "collection.aperture_time=7s", "--fail-on-erosion", "10%")
        assert done.exit_code == 1
        said = " ".join(done.stdout.split())
        assert said.count("--set collection.aperture_time=7s") == 2
        assert "Refused timing.quadratic_phase_error: fails now" in said
        text = run("diff", MISSION, "--set", SET, "--format", "markdown").stdout.replace("\\", "")
        assert f"{MISSION} --set {SET}" in text.replace("&#45;", "-")

    @pytest.mark.parametrize(
        ("options", "said"),
        [
            (["--set", SET, "--base", "HEAD"], "--base and --set each say what a mission is compared with"),
            ([], "or mission files and --base REV or --set KEY=VALUE."),
            (["--set", "radar.bandwith=3 MHz"], "--set radar.bandwith: is not a known key"),
            (["--set", "radar.bandwidth"], "is not KEY=VALUE"),
        ],
    )
    def test_what_is_wrong_usage(self, run, options: list[str], said: str) -> None:
        done = run("diff", MISSION, *options)
        assert done.exit_code == 2
        assert said in " ".join(done.stderr.split())
        assert not done.stdout
