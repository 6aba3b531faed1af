"""Figures of data sheets in a mission file, and the parts of the catalogue."""

import html
import math
import os
from pathlib import Path

import pytest

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.budget.check import check_mission
from bisar_budget.constants import STANDARD_GRAVITY_MPS2
from bisar_budget.faults import MissionError
from bisar_budget.findings.mission import Report
from bisar_budget.mission.instruments import PowerLaw
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.parts import FIGURES, PartError, catalogue, entries, evidence, folders, read_entry
from bisar_budget.report import Style, render
from bisar_budget.resources import resource
from bisar_budget.units import (
    ANGLE_RANDOM_WALK,
    ANGULAR_RATE,
    PHASE_NOISE,
    VELOCITY_RANDOM_WALK,
    format_quantity,
    parse_quantity,
)
from tests.conftest import TODAY

MISSION = """schema_version: 1
name: Instruments
radar: {center_frequency: 9.65 GHz, bandwidth: 150 MHz}
collection: {aperture_time: 6 s}
platforms:
  transmitter: {position: [30 km, 4 km, 9 km], velocity: [0 m/s, 180 m/s, 0 m/s]}
  receiver:
    position: [1 km, 1.5 km, 1 km]
    velocity: [30 m/s, -10 m/s, 0 m/s]
"""
INDENT = "    "


def receiver(text: str) -> str:
    return MISSION + "".join(f"{INDENT}{line}\n" for line in text.splitlines())


def faults(text: str) -> str:
    with pytest.raises(MissionError) as caught:
        parse_mission(text)
    return "\n".join(f"{fault.line}:{fault.column}: {fault}" for fault in caught.value.faults)


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("0.5 deg/h", ANGULAR_RATE, math.radians(0.5) / 3600),
        ("1 deg/s", ANGULAR_RATE, math.radians(1)),
        ("0.06 m/s/sqrt(h)", VELOCITY_RANDOM_WALK, 0.001),
        ("0.06 m/s/√h", VELOCITY_RANDOM_WALK, 0.001),
        ("1 ug/sqrt(Hz)", VELOCITY_RANDOM_WALK, 9.80665e-6),
        ("1 m/s^2/√Hz", VELOCITY_RANDOM_WALK, 1.0),
        ("0.15 deg/sqrt(h)", ANGLE_RANDOM_WALK, math.radians(0.15) / 60),
        ("0.0025 deg/s/sqrt(Hz)", ANGLE_RANDOM_WALK, math.radians(0.15) / 60),
        ("9 deg/h/sqrt(Hz)", ANGLE_RANDOM_WALK, math.radians(0.15) / 60),
        ("-95 dBc/Hz", PHASE_NOISE, -95.0),
    ],
)
def test_units_of_data_sheets(text: str, dimension, value: float) -> None:
    """1 m/s/√h is 1/60 m/s/√s, 1 deg/√h is π/180/60 rad/√s, 1 µg/√Hz is 9.80665e-6 m/s/√s."""
    assert parse_quantity(text, dimension) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("unit", "dimension"),
    [("rad/s", ANGULAR_RATE), ("m/s/sqrt(s)", VELOCITY_RANDOM_WALK), ("rad/sqrt(s)", ANGLE_RANDOM_WALK)],
)
def test_what_is_printed_is_read_back(unit: str, dimension) -> None:
    printed = format_quantity(1.2345e-5, unit, 8)
    assert parse_quantity(printed, dimension) == pytest.approx(1.2345e-5, rel=1e-7)


@pytest.mark.parametrize(
    ("level", "shown"), [(-23.0211, "-23.1 dB"), (-20.0, "-20 dB"), (6.456, "6.45 dB"), (-0.051, "-0.051 dB")]
)
def test_a_level_is_rounded_to_the_stricter_side(level: float, shown: str) -> None:
    assert format_quantity(level, "dB", 3, "down") == shown


def test_figures_are_read() -> None:
    error = parse_mission(
        receiver(
            "motion_error:\n"
            "  imu: {accelerometer_bias: 50 ug, gyro_bias: [0.5 deg/h, 0.5 deg/h, 1 deg/h]}\n"
            "  random: [{name: GNSS, sigma: 1 cm, correlation_time: 1.5 s}]\n"
        )
    ).platforms.receiver.motion_error
    assert error.imu is not None
    assert error.imu.accelerometer_bias == pytest.approx([50e-6 * STANDARD_GRAVITY_MPS2] * 3)
    assert error.imu.gyro_bias[2] == pytest.approx(2 * error.imu.gyro_bias[0])
    assert error.imu.attitude is None
    assert error.random[0].sigma == (0.01, 0.01, 0.01)


def test_a_mask_is_sorted_by_frequency() -> None:
    text = "oscillator: {frequency: 10 MHz, phase_noise: {1 kHz: -150 dBc/Hz, 1 Hz: -95 dBc/Hz}}"
    oscillator = parse_mission(receiver(text)).platforms.receiver.oscillator
    assert oscillator is not None
    assert oscillator.phase_noise == ((1.0, -95.0), (1000.0, -150.0))


@pytest.mark.parametrize("is_sorted", [True, False])
def test_a_mask_that_does_not_rise_is_said_to_be_sorted(is_sorted: bool) -> None:
    points = ["1 Hz: -95 dBc/Hz", "1 kHz: -150 dBc/Hz"]
    mask = ", ".join(points if is_sorted else reversed(points))
    text = receiver(f"oscillator: {{frequency: 10 MHz, phase_noise: {{{mask}}}}}")
    noise = next(one.noise for one in Analysis(parse_mission(text)).random if one.subject.kind == "oscillator")
    assert ["not in rising order" in str(note) for note in noise.notes] == [True] * (not is_sorted)


def test_a_mask_that_ends_below_its_bandwidth_says_so() -> None:
    mask = "phase_noise: {1 Hz: -95 dBc/Hz, 1 kHz: -150 dBc/Hz}"
    for bandwidth, is_said in (("1 kHz", False), ("1.001 kHz", True)):
        text = receiver(f"oscillator: {{frequency: 10 MHz, {mask}, bandwidth: {bandwidth}}}")
        noise = next(one.noise for one in Analysis(parse_mission(text)).random if one.subject.kind == "oscillator")
        assert ["none is stated" in str(note) for note in noise.notes] == [True] * is_said


@pytest.mark.parametrize(
    ("text", "culprit", "said"),
    [
        (
            "motion_error: {imu: {accelerometer_bias: 0.5 deg/h}}",
            "0.5 deg/h",
            "imu.accelerometer_bias: must be an acceleration, but 'deg/h' makes it an angular rate",
        ),
        ("motion_error: {imu: {gyro_bias: 0.5}}", "0.5", "has no unit (got 0.5)"),
        ("motion_error: {imu: {gyro_bias: -1 deg/h}}", "-1 deg", "must be at least"),
        (
            "motion_error: {random: [{name: GNSS, sigma: 1 cm, correlation_time: 0 s}]}",
            "0 s}",
            "correlation_time: must be greater than 0 s",
        ),
        (
            "motion_error: {random: [{name: a, sigma: 1 cm, correlation_time: 1 s}, "
            "{name: a, sigma: 1 cm, correlation_time: 2 s}]}",
            "a, sigma: 1 cm, correlation_time: 2 s",
            "random[1].name: is the name of an earlier error",
        ),
        (
            "oscillator: {frequency: 10 MHz, phase_noise: {1 Hz: -95 dBc/Hz, 10 Hz: 105 dBc/Hz}}",
            "105 dBc",
            "must be at most 60 dBc/Hz",
        ),
        (
            "oscillator: {frequency: 10 MHz, phase_noise: {1 Hz: -150 dBc/Hz, 10 Hz: 50 dBc/Hz}}",
            "{1 Hz",
            "rises by 200 dB a decade between 1 Hz and 10 Hz; accepted: a rise of at most 20",
        ),
        (
            "oscillator: {frequency: 10 MHz, phase_noise: {1 Hz: -95 dBc/Hz, 1.0 Hz: -95 dBc/Hz}}",
            "-95 dBc/Hz}",
            "is in the list twice",
        ),
        ("oscillator: {frequency: 10 MHz}", "{frequency", "oscillator: says nothing of its noise"),
        ("oscillator: {phase_noise: {1 Hz: -95 dBc/Hz, 9 Hz: -99 dBc/Hz}}", "oscillator", "frequency: is missing"),
        ("oscillator: {power_law: {h3: 1e-20}}", "h3", "h3: is not a known key; accepted: h-2, h-1, h0, h1, h2"),
        (
            "oscillator: {power_law: {h0: 1e-20}, allan_deviation: {1 s: 1e-12}}",
            "{h0",
            "power_law: stands beside allan_deviation",
        ),
        ("motion_error: {sensor: stim30}", "stim30", "is no part of the catalogue"),
        ("motion_error: {sensor: stim30}", "stim30", "Did you mean 'stim300'?"),
        ("motion_error: {sensor: sit5358}", "sit5358", "is an oscillator (got sit5358); accepted: parts of"),
        ("oscillator: {sensor: stim300}", "stim300", "is an imu"),
        ("motion_error: {sensor: [stim300, hg1700]}", "hg1700", "sensor[1]: is a second imu"),
        ("motion_error: {sensor: [stim300, stim300]}", "stim300]", "is in the list twice"),
        ("motion_error: {sensor: mosaic-x5-rtk, frame: track}", "mosaic", "is stated east, north, up"),
        ("motion_error: {sensor: mosaic-x5-rtk, distribution: uniform}", "mosaic", "is stated as one sigma"),
        ("motion_error: {sensor: mosaic-x5-rtk, velocity: 1 cm/s, distribution: bound}", "mosaic", "one sigma"),
        ("motion_error: {sensor: nowhere/mine.yaml}", "nowhere", "cannot be read: No such file or directory"),
    ],
)  # fmt: skip
def test_bad_figures_are_one_fault_each(text: str, culprit: str, said: str) -> None:
    found = faults(receiver(text))
    assert said in found
    assert found.count("\n") == 0
    assert found.startswith(f"10:{len(INDENT) + text.index(culprit) + 1}: ")


def test_exchanged_pulses_have_an_interval() -> None:
    assert "interval: is missing" in faults(MISSION + "synchronization: {error: 1 deg}\n")
    assert (
        parse_mission(MISSION + "synchronization: {error: 1 deg, method: direct_path}\n").synchronization is not None
    )


def _name(part: str) -> str:
    return read_entry(str(resource("specs", "sensors") / f"{part}.yaml")).part.name


class TestCatalogue:
    def test_every_part_can_be_used_and_has_its_sources(self) -> None:
        known = list(entries(folders("")))
        assert len(known) >= 25
        assert {one.part.kind for one in known} == set(FIGURES)
        for one in known:
            assert one.figures, one.id
            for figure in one.figures:
                assert len(evidence(one.part, figure)) > len(one.part.name) + 10, one.id
            key = "oscillator" if one.part.kind == "oscillator" else "motion_error"
            text = receiver(f"{key}: {{sensor: {one.id}}}")
            platform = parse_mission(text).platforms.receiver
            if one.part.kind == "imu":
                assert platform.motion_error.imu is not None
            elif one.part.kind == "gnss":
                assert platform.motion_error.position == one.part.position
            else:
                assert platform.oscillator.source == evidence(
                    one.part, next(f for f in one.figures if f != "frequency")
                )

    def test_names_and_words_are_plain(self) -> None:
        for one in entries(folders("")):
            text = Path(one.file).read_text(encoding="utf-8")
            assert "grade" not in text.lower(), one.id
            assert one.id == one.id.lower()

    def test_keys_of_the_file_override_single_figures(self) -> None:
        error = parse_mission(
            receiver(
                "motion_error:\n  sensor: [stim300, mosaic-x5-rtk]\n  velocity: 1 cm/s\n  imu: {gyro_bias: 2 deg/h}\n"
            )
        ).platforms.receiver.motion_error
        part = read_entry(str(resource("specs", "sensors") / "stim300.yaml")).part
        assert error.imu.gyro_bias[0] == pytest.approx(math.radians(2) / 3600)
        assert error.imu.angle_random_walk == part.angle_random_walk
        assert error.velocity == (0.01, 0.01, 0.01)
        assert error.position == pytest.approx((0.006, 0.006, 0.01))
        assert error.evidence("angle_random_walk") == evidence(part, "angle_random_walk")
        assert error.evidence("gyro_bias") is None

    def test_figures_of_a_part_have_its_evidence_and_the_line_of_its_key(self) -> None:
        """Position and velocity of a GNSS part had none, and pointed at a key that the file does not have."""
        text = receiver("motion_error: {sensor: [stim300, mosaic-x5-rtk], velocity: 1 cm/s, source: survey 3}")
        mission = parse_mission(text)
        sources = {one.id: one for one in Analysis(mission).sources}
        part = read_entry(str(resource("specs", "sensors") / "mosaic-x5-rtk.yaml")).part
        position, velocity = sources["receiver.position.x"], sources["receiver.velocity.x"]
        assert position.evidence == evidence(part, "position")
        assert position.path == ("platforms", "receiver", "motion_error", "sensor")
        assert velocity.evidence == "survey 3"
        assert velocity.path[:4] == ("platforms", "receiver", "motion_error", "velocity")

    def test_a_noise_of_the_file_replaces_that_of_the_part(self) -> None:
        text = "oscillator: {sensor: sit5358, power_law: {h0: 1e-24}}"
        oscillator = parse_mission(receiver(text)).platforms.receiver.oscillator
        assert oscillator.phase_noise is None
        assert oscillator.power_law == PowerLaw(white=1e-24)

    def test_what_the_file_overrides_is_shown_beside_what_the_part_says(self) -> None:
        """A report showed the file's value alone, as if the part had none."""
        text = receiver(
            "motion_error:\n  sensor: [stim300, mosaic-x5-dgnss]\n  velocity: 1 cm/s\n  imu: {gyro_bias: 2 deg/h}\n"
        )
        found = check_mission(parse_mission(text), TODAY)
        at, gnss, imu = "platforms.receiver.motion_error", "Septentrio mosaic-X5, DGNSS", _name("stim300")
        of_velocity = f"{at}.velocity replaces 0.03 m/s of {gnss}"
        of_gyro = f"{at}.imu.gyro_bias replaces 0.5 deg/h of {imu}"
        noted = {row.id: row.remarks for row in found.rows if any("replaces" in one for one in row.remarks)}
        assert noted.keys() == {*(f"receiver.velocity.{axis}" for axis in "xyz"), "receiver.imu.gyro_bias"}
        assert all((of_velocity in noted[one]) == (one != "receiver.imu.gyro_bias") for one in noted)
        assert of_gyro in noted["receiver.imu.gyro_bias"]
        assert {of_velocity, of_gyro} <= set(found.notes)
        for name in ("html", "markdown", "json"):
            said = html.unescape(render(name, Report("", (found,)), Style())).replace("\\", "").replace("<wbr>", "")
            assert "replaces 0.03 m/s of" in said, name
            assert "replaces 0.5 deg/h of" in said, name

    def test_without_a_key_beside_it_a_part_is_overridden_by_nothing(self) -> None:
        found = check_mission(parse_mission(receiver("motion_error: {sensor: [stim300, mosaic-x5-rtk]}")), TODAY)
        assert not [note for note in found.notes if "replaces" in note]

    def test_a_covariance_says_what_it_replaces_of_a_part_and_leaves_the_rest(self, tmp_path) -> None:
        """It used to drop the position and the velocity of a GNSS receiver without a word."""
        file = tmp_path / "gnss.yaml"
        file.write_text(
            "kind: gnss\nname: Ours\nsource: test 7\nposition: 2 cm\nvelocity: [1 cm/s, 1 cm/s, 2 cm/s]\n"
            "random: [{name: multipath, sigma: 1 mm, correlation_time: 30 s}]\n"
        )
        covariance = "covariance: {position: 1 mm, velocity: 1 mm/s}"
        mission = parse_mission(receiver(f"motion_error: {{sensor: {file}, {covariance}}}"))
        error = mission.platforms.receiver.motion_error
        assert (error.position, error.velocity) == (None, None)
        assert [one.name for one in error.random] == ["multipath"]
        found = check_mission(mission, TODAY)
        key = "platforms.receiver.motion_error.covariance"
        said = {
            "position": f"{key} replaces 2 cm of Ours",
            "velocity": f"{key} replaces [1 cm/s, 1 cm/s, 2 cm/s] of Ours",
        }
        for kind, words in said.items():
            assert all(words in row.remarks for row in found.rows if row.id.startswith(f"receiver.{kind}."))
            assert words in found.notes
        (random,) = (row for row in found.rows if row.id == "receiver.random.multipath")
        assert random.evidence == "Ours: test 7"
        assert random.remarks == ()

    @pytest.mark.parametrize("distribution", ["normal", "uniform", "bound"])
    def test_a_distribution_is_that_of_the_files_own_figures(self, distribution: str) -> None:
        """One sigma of a part is no bound; figures of an IMU are one sigma whatever stands beside them."""
        own = f"position: 1 cm, velocity: 1 cm/s, distribution: {distribution}"
        error = parse_mission(
            receiver(f"motion_error: {{sensor: [stim300, mosaic-x5-rtk], {own}}}")
        ).platforms.receiver
        assert error.motion_error.distribution == distribution

    def test_random_errors_of_the_file_replace_those_of_a_part(self, tmp_path) -> None:
        file = tmp_path / "gnss.yaml"
        part = "{name: multipath, sigma: 1 mm, correlation_time: 30 s}"
        file.write_text(f"kind: gnss\nname: Ours\nsource: test 7\nrandom: [{part}]\n")
        own = "random: [{name: noise, sigma: 2 mm, correlation_time: 1 s}]"
        found = check_mission(parse_mission(receiver(f"motion_error: {{sensor: {file}, {own}}}")), TODAY)
        (row,) = (row for row in found.rows if row.subject.kind == "random")
        assert row.id == "receiver.random.noise"
        (said,) = row.remarks
        assert "motion_error.random replaces [name: multipath, sigma: 1 mm" in said

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("sensor: sit5358, frequency: 100 MHz", "the phase noise of {} is stated at its own frequency, 10 MHz"),
            ("sensor: sit5358, frequency: 1 MHz, spurs: {50 Hz: -90 dBc}", "is stated at its own frequency, 10 MHz"),
            ("sensor: sit5358, frequency: 10 MHz", ""),
            ("sensor: sit5358, frequency: 10000 kHz, spurs: {50 Hz: -90 dBc}", ""),
            ("sensor: sit5358, frequency: 100 MHz, phase_noise: {1 Hz: -80 dBc/Hz, 9 Hz: -90 dBc/Hz}", ""),
            ("sensor: sit5358, frequency: 100 MHz, power_law: {h0: 1e-24}", ""),
            ("sensor: wenzel-5mhz, frequency: 10 MHz, spurs: {50 Hz: -90 dBc}", ""),
        ],
    )
    def test_a_frequency_does_not_relabel_the_mask_of_a_part(self, text: str, said: str) -> None:
        """`frequency: 100 MHz` beside a mask at 10 MHz made the oscillator 20 dB better than it is."""
        text = f"oscillator: {{{text}}}"
        if not said:
            assert parse_mission(receiver(text)).platforms.receiver.oscillator is not None
            return
        (found,) = faults(receiver(text)).splitlines()
        assert found.startswith(f"10:{len(INDENT) + text.index('frequency:') + 12}: ")
        assert said.format(_name("sit5358")) in found
        assert "accepted: no frequency, or phase_noise beside it" in found

    def test_what_is_replaced_of_an_oscillator_is_said(self) -> None:
        text = "oscillator: {sensor: wenzel-5mhz, frequency: 10 MHz, spurs: {50 Hz: -90 dBc}}"
        found = check_mission(parse_mission(receiver(text)), TODAY)
        said = f"platforms.receiver.oscillator.frequency replaces 5 MHz of {_name('wenzel-5mhz')}"
        for row_id in ("receiver.oscillator", "receiver.oscillator.spur.0"):
            assert [said in row.remarks for row in found.rows if row.id == row_id] == [True]
        text = "oscillator: {sensor: wenzel-5mhz, allan_deviation: {1 s: 1e-12}}"
        found = check_mission(parse_mission(receiver(text)), TODAY)
        (noise,) = (note for note in found.notes if "replaces" in note)
        assert "oscillator.allan_deviation replaces power_law h-1: 1.268e-26" in noise

    @pytest.mark.parametrize(
        ("noise", "said"),
        [
            ("phase_noise: {1 Hz: -110 dBc/Hz, 10 Hz: -125 dBc/Hz}", True),
            ("frequency: 5 MHz, phase_noise: {1 Hz: -110 dBc/Hz, 10 Hz: -125 dBc/Hz}", False),
            ("allan_deviation: {1 s: 1e-12}", False),
        ],
    )
    def test_the_frequency_at_which_a_mask_beside_a_part_holds_is_said(self, noise: str, said: bool) -> None:
        """The file's mask was taken at the frequency of the part, and nothing said so."""
        found = check_mission(parse_mission(receiver(f"oscillator: {{sensor: wenzel-5mhz, {noise}}}")), TODAY)
        warned = f"states no frequency, and is assumed at 5 MHz, that of {_name('wenzel-5mhz')}"
        sentences = [*(one.message for one in found.warnings), *(str(one.reason) for one in found.rows)]
        assert any(warned in sentence for sentence in sentences) is said

    def test_a_frequency_replaces_nothing_where_noise_is_the_same_at_any(self) -> None:
        text = "oscillator: {sensor: wenzel-5mhz, frequency: 10 MHz}"
        found = check_mission(parse_mission(receiver(text)), TODAY)
        assert not [note for note in found.notes if "replaces" in note]

    def test_own_parts_stand_in_a_folder_of_the_project_or_anywhere(self, tmp_path, monkeypatch) -> None:
        monkeypatch.chdir(tmp_path)
        own = 'kind: imu\nname: Ours\naccelerometer_bias: 1 mg\nsource: "test report 7"\n'
        (tmp_path / "parts").mkdir()
        (tmp_path / "parts" / "ours.yaml").write_text(own)
        (tmp_path / "parts" / "stim300.yaml").write_text(own.replace("Ours", "Our STIM300"))
        (tmp_path / "pyproject.toml").write_text('[tool.bisar-budget]\nsensors = ["parts"]\n')
        (tmp_path / "sub").mkdir()
        for name, bias in (("ours", 1e-3), ("stim300", 1e-3), ("../parts/ours.yaml", 1e-3), ("hg1700", 1e-3)):
            file = tmp_path / "sub" / "mission.yaml"
            file.write_text(receiver(f"motion_error: {{sensor: {name}}}"))
            error = load_mission(str(file)).platforms.receiver.motion_error
            assert error.imu.accelerometer_bias[0] == pytest.approx(bias * STANDARD_GRAVITY_MPS2)
        assert "ours" in catalogue(folders(""))

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("kind: imu\nname: x\naccelerometer_bias: 1 mg\n", "source: is missing"),
            ("kind: imu\nname: x\ngyro_bias: 1 deg/s\nsource: {attitude: b}\n", "says nothing of gyro_bias"),
            ("kind: car\nname: x\nsource: y\n", "kind: must be one of imu, gnss, oscillator"),
            ("name: x\n", "kind: must be one of"),
            ("- a\n", "is not a mapping"),
            ("kind: imu\nname: x\nsource: y\naccelerometer_bias: 1 deg\n", "4:21: accelerometer_bias: must be"),
            ("kind: oscillator\nname: x\nsource: y\nfrequency: 10 MHz\n", "says nothing of its noise"),
            ("a: &a b\n", "kind: must be one of"),
            ("kind: imu\nname: x\nsource: y\n", "states no figure; accepted: one of accelerometer_bias"),
            ("kind: gnss\nname: x\nsource: y\nrandom: []\n", "states no figure; accepted: one of position"),
            ("kind: imu\nname: x\nsource: y\ngyro_bias: 0\nattitude: [0, 0, 0]\n", "that is not zero"),
            ("kind: oscillator\nname: x\nsource: y\npower_law: {h0: 0}\n", "that is not zero"),
        ],
    )  # fmt: skip
    def test_a_part_that_cannot_be_used_says_where(self, tmp_path, text: str, said: str) -> None:
        file = tmp_path / "part.yaml"
        file.write_text(text)
        with pytest.raises(PartError, match=r"part\.yaml") as caught:
            read_entry(str(file))
        assert said in str(caught.value)

    def test_a_pipe_is_no_part(self, tmp_path) -> None:
        """It would be waited for without end."""
        os.mkfifo(tmp_path / "part.yaml")
        with pytest.raises(PartError, match="no regular file"):
            read_entry(str(tmp_path / "part.yaml"))
