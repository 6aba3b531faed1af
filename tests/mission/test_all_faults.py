"""All faults of a mission file at once: none hides another, whichever of them is found first."""

import itertools
from collections.abc import Callable
from pathlib import Path

import pytest

from bisar_budget.faults import Fault, MissionError
from bisar_budget.mission.load import load_mission, parse_mission
from tests.conftest import mission_text

HEAD = "schema_version: 1\nname: Faults\n"
# What is wrong by itself: a line of the file, where the culprit stands in it, its key, and what is said of it.
SECTIONS = {
    "unit": (
        "radar: {center_frequency: 10 GHz, bandwidth: 300 m}",
        "300 m",
        "radar.bandwidth",
        "must be a frequency",
    ),
    "key": ("timing_eror: {constant: 1 ns}", "timing_eror", "timing_eror", "is not a known key"),
    "date": (
        "waivers: [{id: a, until: 2027-02-30, reason: x}]",
        "2027-02-30",
        "waivers[0].until",
        "must be a calendar date",
    ),
    "word": ("requirements: {declare: [imus]}", "imus", "requirements.declare[0]", "is not a known choice"),
    "half": (
        "earth_orientation: {polar_motion_x: 0.1 arcsec}",
        "{polar",
        "earth_orientation",
        "lacks ut1_minus_utc",
    ),
}
PLATFORM = {
    "part": ("motion_error: {sensor: stim30}", "stim30", "motion_error.sensor", "is no part of the catalogue"),
    "kind": ("motion_error: {sensor: sit5358}", "sit5358", "motion_error.sensor", "is an oscillator"),
    "parts": ("motion_error: {sensor: [stim300, x]}", "x]", "motion_error.sensor[1]", "is no part of the catalogue"),
    "clock": ("oscillator: {sensor: wenzel}", "wenzel", "oscillator.sensor", "is no part of the catalogue"),
    "mask": (
        "oscillator: {sensor: sit5358, frequency: 5 MHz}",
        "5 MHz",
        "oscillator.frequency",
        "the phase noise of SiTime SiT5358 MEMS TCXO is stated at its own frequency, 10 MHz",
    ),
}  # fmt: skip
RADAR = "radar: {center_frequency: 10 GHz, bandwidth: 300 MHz}"


def written(sections: list[str], transmitter: list[str], receiver: list[str]) -> tuple[str, list[tuple]]:
    """A file with these faults, and what has to be said: line, column, key and problem of each."""
    text, said = HEAD, []

    def add(line: str, fault: tuple[str, str, str, str], prefix: str, indent: int) -> None:
        nonlocal text
        text += " " * indent + line + "\n"
        _, culprit, key, problem = fault
        place = (text.count("\n"), indent + line.index(culprit) + 1)
        said.append((*place, prefix + key, problem))

    for name in sections:
        add(SECTIONS[name][0], SECTIONS[name], "", 0)
    if "unit" not in sections:
        text += RADAR + "\n"
    text += "collection: {aperture_time: 6 s}\nplatforms:\n"
    places = {"transmitter": "[30 km, 0, 6 km]", "receiver": "[6 km, 6 km, 2 km]"}
    for name, faults in (("transmitter", transmitter), ("receiver", receiver)):
        text += f"  {name}:\n    position: {places[name]}\n    velocity: [0, 150 m/s, 0]\n"
        for one in faults:
            add(PLATFORM[one][0], PLATFORM[one], f"platforms.{name}.", 4)
    return text, said


def faults_of(text: str, load: Callable[[str], object] = parse_mission) -> tuple[Fault, ...]:
    with pytest.raises(MissionError) as caught:
        load(text)
    return caught.value.faults


def assert_said(faults: tuple[Fault, ...], said: list[tuple]) -> None:
    found = [(fault.line, fault.column, fault.key) for fault in faults]
    assert found == [one[:3] for one in said]
    assert all(fault.problem.startswith(problem) for fault, (*_, problem) in zip(faults, said, strict=True))


@pytest.mark.parametrize("motion", ["part", "kind", "parts"])
@pytest.mark.parametrize("clock", ["clock", "mask"])
@pytest.mark.parametrize("count", [0, 1, 2, len(SECTIONS)])
def test_parts_and_everything_else_are_said_in_one_run(motion: str, clock: str, count: int) -> None:
    """A wrong unit anywhere hid every unknown part; each has its own line and column."""
    for sections in itertools.combinations(SECTIONS, count):
        text, said = written(list(sections), [motion], [motion, clock])
        assert_said(faults_of(text), said)


@pytest.mark.parametrize(
    ("section", "keys"),
    [
        ("motion_error: {sensor: stim30, position: 1 s}", ["sensor", "position"]),
        ("motion_error: {sensor: stim30, positon: 1 m}", ["sensor", "positon"]),
        ("motion_error: {position: 1 s, velocity: 1 m, sensor: stim30}", ["position", "velocity", "sensor"]),
        ("motion_error: {sensor: [stim30, x], time_tag: 1 m}", ["sensor[0]", "sensor[1]", "time_tag"]),
        ("motion_error: {sensor: mosaic-x5-rtk, frame: track, imu: {gyro_bias: 1}}", ["gyro_bias"]),
        ("motion_error: {sensor: mosaic-x5-rtk, frame: trak}", ["frame"]),
        ("motion_error: {sensor: mosaic-x5-rtk, frame: track, x: 1}", ["sensor", "x"]),
        ("motion_error: {sensor: 5, position: 1 s}", ["sensor", "position"]),
        (
            "motion_error: {navigation: {imu: {sensor: stim30}, gnss: {sensor: x, rate: 0 Hz}}}",
            ["sensor", "sensor", "rate"],
        ),
        ("motion_error: {position: 1 s, navigation: {imu: {sensor: mosaic-x5-rtk}}}", ["position", "gnss", "sensor"]),
        ("oscillator: {sensor: sit5358, frequency: 5 m}", ["frequency"]),
        ("oscillator: {sensor: sit5358, frequency: 5 MHz, phase_noise: {1 Hz: 3}}", ["phase_noise"]),
        ("oscillator: {sensor: sit5358, frequency: 5 MHz, bandwith: 1 kHz}", ["frequency", "bandwith"]),
        ("oscillator: {sensor: stim300, spurs: {50 Hz: 10 dBc}}", ["sensor", "50 Hz"]),
    ],
)
def test_within_a_section_a_part_is_looked_at_too_and_nothing_is_said_that_follows(
    section: str, keys: list[str]
) -> None:
    """What a wrong key beside it decides is not guessed: a mask is relabelled only if the frequency can be read."""
    text, _ = written([], [], [])
    assert [fault.key.rpartition(".")[2] for fault in faults_of(f"{text}    {section}\n")] == keys


def test_both_platforms_and_both_kinds_of_file_are_looked_at(tmp_path: Path) -> None:
    """A log that is not there hid unknown parts, and was itself hidden by a wrong unit."""
    platforms = {
        "platforms__transmitter": {
            "orbit": {"tle": "no.tle"},
            "motion_error": {"sensor": "stim30"},
        },
        "platforms__receiver": {
            "trajectory": {"file": "no.csv", "accuracy": "no.out"},
            "oscillator": {"sensor": "wenzel"},
        },
    }
    keys = [
        "platforms.transmitter.orbit.tle",
        "platforms.transmitter.motion_error.sensor",
        "platforms.receiver.trajectory.file",
        "platforms.receiver.trajectory.accuracy",
        "platforms.receiver.oscillator.sensor",
    ]
    file = tmp_path / "m.yaml"
    file.write_text(mission_text(**platforms, radar__bandwidth="300 m"))
    assert [fault.key for fault in faults_of(str(file), load_mission)] == ["radar.bandwidth", *keys]
    scene = {"latitude": "48 deg", "longitude": "11 deg", "height": "600 m"}
    whole = {"scene": scene, "collection__center_time": "2026-06-01T05:20:31Z"}
    file.write_text(mission_text(**platforms, **whole))
    without_accuracy = [key for key in keys if not key.endswith("accuracy")]  # of a log that is not there
    assert [fault.key for fault in faults_of(str(file), load_mission)] == without_accuracy


def test_a_part_says_all_that_is_wrong_with_its_file(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("kind: imu\nname: x\nsource: y\ngyro_bias: 1 m\nattitud: 1 deg\n")
    file = tmp_path / "m.yaml"
    file.write_text(mission_text(platforms__receiver__motion_error={"sensor": "own.yaml"}))
    faults = faults_of(str(file), load_mission)
    assert [fault.key for fault in faults] == ["platforms.receiver.motion_error.sensor"] * 2
    assert "own.yaml:4:12: gyro_bias: must be an angular rate" in faults[0].problem
    assert "own.yaml:5:1: attitud: is not a known key" in faults[1].problem


@pytest.mark.parametrize(
    ("platform", "said"),
    [
        ({"position": ["6 km", 0, "-2 km"], "velocity": [0, "5 m", 0]}, ["below the ground", "must be a speed"]),
        ({"position": ["6 km", 0, "2 km"], "velocity": [0, "5 m", 0], "azimuth": 0}, ["must be a speed", "mixes"]),
        ({"slant_range": "6 s", "azimuth": 0}, ["lacks elevation, speed, motion_azimuth", "must be a length"]),
        ({"slant_range": "6 km", "azimuth": 0, "elevation": "9 deg", "speed": "0 m"}, ["must be a speed"]),
        (
            {"orbit": {"tle": "a", "objct": "b"}, "speed": "3 m/s"},
            ["cannot be read", "is not a known key", "mixes orbit with speed"],
        ),
    ],
)
def test_a_wrong_value_of_a_path_hides_nothing_of_the_rest(platform: dict[str, object], said: list[str]) -> None:
    faults = faults_of(mission_text(platforms__receiver=platform))
    assert len(faults) == len(said)
    assert all(one in fault.problem for fault, one in zip(faults, said, strict=True))
