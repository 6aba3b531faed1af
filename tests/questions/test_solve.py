"""Solving a mission for one of its numbers: by hand, from both sides of every crossing, and where there is none."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from itertools import pairwise

import pytest

import bisar_budget as bb
from bisar_budget.analysis import scene
from bisar_budget.budget.check import check_mission
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.faults import SetValue
from bisar_budget.findings.solution import Solution, State
from bisar_budget.mission.changes import read_changes
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.quantities import QuestionError, number_of, range_of
from bisar_budget.questions import solve as solving
from bisar_budget.questions.table import breaking
from bisar_budget.questions.varied import scaled
from tests.conftest import ROOT, mission_file, mission_text
from tests.standing import standing

MISSIONS = ROOT / "specs" / "missions"
SECTION_V = str(MISSIONS / "rigling_moses_section_v.yaml")
DAY = date(2026, 1, 1)
# Section V: Table II row 4, QPE = pi a x T^2 / (4 R lambda), held to pi/8.
R = math.hypot(30414, 6000)
X = 30414
WAVELENGTH = SPEED_OF_LIGHT_MPS / 10e9


def solve(key: str, *texts: str, file: str = SECTION_V, **more: object) -> Solution:
    mission = load_mission(file, changes=read_changes(texts))
    return bb.solve(mission, key, date=DAY, **more).found  # type: ignore[arg-type]


def test_aperture_time_by_hand() -> None:
    found = solve("collection.aperture_time")
    assert found.value == pytest.approx(math.sqrt(R * WAVELENGTH / (2 * 0.005 * X)), rel=1e-6)
    (crossing,) = found.crossings
    assert crossing.is_upper
    assert crossing.is_verified
    for side in (crossing.inside, crossing.outside):
        assert (side.row, side.requirement) == ("transmitter.acceleration.x", "quadratic_phase_error")
        assert side.utilization == pytest.approx(1, abs=3e-6)
    assert found.unit == "s"
    assert (found.low, found.high) == pytest.approx((0.6, 60))
    assert found.given is not None
    assert found.given.status == "fail"


def test_acceleration_and_its_factor_by_hand() -> None:
    largest = R * WAVELENGTH / (2 * X * 6**2)
    key = "platforms.transmitter.motion_error.acceleration"
    assert solve(f"{key}.0", between="1..1000 um/s^2").value == pytest.approx(largest, rel=1e-6)
    for scaled_key in (key, "platforms.transmitter.motion_error"):
        factor = solve(scaled_key, scale=True, between="0.01..1").value
        assert factor == pytest.approx(largest / 0.005, rel=1e-6)


def test_center_frequency_by_hand() -> None:
    """The phase goes with the frequency: it may be smaller by what the row uses too much."""
    used = math.pi * 0.005 * X * 36 / (4 * R * WAVELENGTH) / (math.pi / 8)
    found = solve("radar.center_frequency", between="0.2 GHz..10 GHz")
    assert found.value == pytest.approx(10e9 / used, rel=1e-6)
    assert found.texts[found.value].endswith(" GHz")


def test_a_budget_is_solved_from_above() -> None:
    """What has to be granted: compliance begins at the crossing, and the value is the first that complies."""
    used = math.pi * 0.005 * X * 36 / (4 * R * WAVELENGTH)
    found = solve("requirements.quadratic_phase_error", "collection.aperture_time=2s")
    (crossing,) = found.crossings
    assert not crossing.is_upper
    assert found.value == pytest.approx(2 * used / 9, rel=1e-6)


def test_the_target_may_be_not_to_warn() -> None:
    """A pass becomes a warning at 80 % of the limit, so T is smaller by the root of it."""
    warned, failed = (solve("collection.aperture_time", target=target).value for target in ("warn", "fail"))
    assert warned is not None
    assert failed is not None
    assert warned / failed == pytest.approx(math.sqrt(0.8), rel=2e-6)


# By default every third example: most of the time goes into checks of this one property.
@pytest.mark.parametrize(
    "file",
    [
        pytest.param(file, marks=pytest.mark.thorough if number % 3 else (), id=file.stem)
        for number, file in enumerate(sorted(MISSIONS.glob("*.yaml")))
    ],
)
def test_check_passes_just_inside_and_fails_just_outside(file, monkeypatch) -> None:
    """Of the gate itself, with the values as they are written: aperture time, and the errors of a platform."""
    monkeypatch.setattr(solving, "SOLVE_SETTINGS", replace(solving.SOLVE_SETTINGS, range_samples=5))
    found = solve("collection.aperture_time", file=str(file))
    asked = [(found, lambda text: load_mission(str(file), changes=[SetValue(found.key, text)]))]
    mission = load_mission(str(file))
    key = "platforms.receiver.motion_error"
    try:
        of_errors = solve(key, file=str(file), scale=True)
    except QuestionError as error:
        assert "states no error there" in str(error)
    else:
        asked.append((of_errors, lambda text: scaled(mission, key, float(text))))
    for solution, at in asked:
        for crossing in solution.crossings:
            low, high = sorted((crossing.inside.value, crossing.outside.value))
            assert high - low <= 1e-6 * high
            assert crossing.is_verified
            for side in (crossing.inside, crossing.outside):
                status = check_mission(at(solution.texts[side.value]), DAY).status
                assert (status not in ("fail", "not_evaluated")) == side.complies
                assert status == side.status
        assert solution.crossings or solution.nearest.complies == (solution.status == "all")


def test_azimuth_is_looked_at_all_around_and_is_not_monotonic() -> None:
    """The transmitter is due east and flies north: north and south of the line of sight are mirror images."""
    file = str(MISSIONS / "one_stationary_spotlight.yaml")
    found = solve("platforms.receiver.azimuth", "collection.aperture_time=1.8s", file=file)
    assert found.is_circle
    assert not found.is_monotonic
    assert [crossing.is_upper for crossing in found.crossings] == [True, False, True, False]
    first, second, third, fourth = (crossing.inside.value for crossing in found.crossings)
    assert first + fourth == pytest.approx(2 * math.pi, rel=1e-6)
    assert second + third == pytest.approx(2 * math.pi, rel=1e-6)
    assert all(crossing.is_verified for crossing in found.crossings)
    assert all("location" in (crossing.outside.requirement or "") for crossing in found.crossings)


def test_where_there_is_no_mission_is_a_border_too() -> None:
    found = solve("platforms.receiver.azimuth", "collection.aperture_time=1.5s")
    assert found.skipped
    assert all(crossing.outside.status == "error" for crossing in found.crossings)
    assert "at least 1 deg is needed: no image plane" in found.crossings[0].outside.reason


def test_a_pair_of_crossings_between_two_places_is_found() -> None:
    """Places are 0.0625 apart; between two of them the utilization crosses its limit, and 0.004 on again."""

    def dips(value: float) -> State:
        utilization = 0.998 + abs(value - 0.53)
        return State(value, utilization <= 1, "", utilization=utilization)

    def bumps(value: float) -> State:
        utilization = 1.002 - abs(value - 0.53)
        return State(value, utilization <= 1, "", utilization=utilization)

    places = [index / 16 for index in range(17)]
    for evaluate in (dips, bumps):
        states = [evaluate(place) for place in places]
        assert len({state.complies for state in states}) == 1
        ((low, high, here),) = solving._turns(states)
        known: dict[float, State] = {}
        while isinstance(found := solving._turn(low, high, here, 4, known), set):
            known |= {value: evaluate(value) for value in found}
        assert found is not None
        scanned = sorted([*states, found], key=lambda state: state.value)
        assert sum(one.complies != other.complies for one, other in pairwise(scanned)) == 2


@pytest.mark.parametrize(
    ("name", "key", "more"),
    [
        ("rigling_moses_section_v", "collection.aperture_time", {}),
        ("rigling_moses_section_v", "collection.aperture_time", {"target": "warn", "model": "strictest"}),
        ("rigling_moses_section_v_autofocus", "autofocus.n_pull", {"target": "warn"}),
        (
            "rigling_moses_section_v",
            "platforms.transmitter.motion_error.acceleration.0",
            {"row": "transmitter.acceleration.x"},
        ),
        ("uav_free_running", "collection.aperture_time", {"row": "receiver.quadratic_phase_error", "target": "warn"}),
        ("uav_stim300", "collection.aperture_time", {"row": "receiver.quadratic_phase_error", "target": "warn"}),
        ("drones_same_gnss", "radar.bandwidth", {}),
        ("one_stationary_spotlight", "platforms.receiver.azimuth", {}),
    ],
)
def test_what_is_said_of_a_value_is_what_check_says(name: str, key: str, more: dict[str, str]) -> None:
    """Both sides of every crossing, the nearest and the file's own value, each as a file would have it."""
    file = str(mission_file(name))
    found = solve(key, file=file, **more)
    states = [found.nearest, *(state for one in found.crossings for state in (one.inside, one.outside))]
    for state in states:
        mission = load_mission(file, more.get("model"), [SetValue(key, found.texts[state.value])])
        stands = standing(check_mission(mission, DAY), more.get("row"), breaking(more.get("target", "fail")))
        assert (state.complies, state.status, state.row, state.requirement) == stands[:4]
        assert state.utilization == pytest.approx(stands.utilization, rel=1e-6)


def test_how_far_one_correction_serves_is_not_searched(monkeypatch) -> None:
    """It decides nothing, and took twenty times as long as the rest of a check: solving took half a minute."""
    text = mission_text(
        scene__radius="300 m",
        platforms__receiver__motion_error={"velocity": ["5 mm/s", 0, 0]},
        allocation__model="full",
    )
    mission = parse_mission(text, "m.yaml")
    monkeypatch.setattr(scene.Corrections, "_served", lambda *_: pytest.fail("it is searched"))
    assert bb.solve(mission, "platforms.receiver.motion_error.velocity.0", date=DAY).crossings


def test_scaling_multiplies_what_an_error_is_sized_by() -> None:
    """Amplitudes, sigmas and clock terms; neither frequencies, correlation times nor correlations."""
    error = {
        "position": "2 m",
        "velocity": ["1 mm/s", "0 m/s", "2 mm/s"],
        "vibration": {"sinusoidal": [{"amplitude": "1 mm", "frequency": "20 Hz"}], "wideband": {"rms": "1 um"}},
        "imu": {"gyro_bias": "3 deg/h"},
        "random": [{"name": "gnss", "sigma": "5 mm", "correlation_time": "60 s"}],
    }
    mission = parse_mission(mission_text(platforms__receiver__motion_error=error, timing_error={"linear": "1 ppb"}))
    found = scaled(mission, "platforms.receiver.motion_error", 3.0).platforms.receiver.motion_error
    assert found.position == pytest.approx((6, 6, 6))
    assert found.velocity == pytest.approx((0.003, 0, 0.006))
    assert found.vibration.sinusoidal[0] == pytest.approx((0.003, 20))
    assert found.vibration.wideband == pytest.approx((3e-6,))
    assert found.imu.gyro_bias == pytest.approx((math.radians(9) / 3600,) * 3)
    assert (found.random[0].sigma, found.random[0].correlation_time) == (pytest.approx((0.015,) * 3), 60)
    assert scaled(mission, "timing_error", 3.0).timing_error.linear == pytest.approx(3e-9)
    with pytest.raises(QuestionError, match="holds no errors that --scale could multiply; accepted: platforms"):
        scaled(mission, "radar", 2.0)
    with pytest.raises(QuestionError, match="states no error there"):
        scaled(mission, "platforms.transmitter.motion_error", 2.0)


def test_scaling_takes_a_covariance_and_parts_of_the_catalogue() -> None:
    compared = set()
    for name in ("drones_same_gnss", "uav_free_running"):
        mission = load_mission(str(mission_file(name)))
        twice = scaled(mission, "platforms.receiver.motion_error", 2.0)
        rows = {row.id: row for row in check_mission(mission, DAY).rows}
        for row in check_mission(twice, DAY).rows:
            if row.declared and row.id.startswith(("receiver.position", "receiver.velocity", "receiver.imu")):
                assert row.declared == pytest.approx(2 * rows[row.id].declared), row.id
                compared.add(row.id)
    assert {"receiver.position.x", "receiver.velocity.x"} <= compared
    assert any(".imu." in row_id for row_id in compared)


def test_a_row_alone() -> None:
    assert solve("collection.aperture_time", row="transmitter.acceleration.z").status == "all"
    with pytest.raises(QuestionError, match=r"--row transmitter\.aceleration\.x: .* Did you mean 'transmitter\.acc"):
        solve("collection.aperture_time", row="transmitter.aceleration.x")
    with pytest.raises(QuestionError, match="is not declared: nothing is judged there"):
        solve("collection.aperture_time", row="receiver.velocity.x")


def test_an_error_that_the_file_does_not_declare() -> None:
    """Table II row 1: what the table of the check allows."""
    mission = load_mission(SECTION_V)
    allowed = {row.id: row.allowable for row in check_mission(mission, DAY).rows}["receiver.velocity.x"]
    key = "platforms.receiver.motion_error.velocity"
    found = solve(key, between="1..100 mm/s", row="receiver.velocity.x")
    assert found.value == pytest.approx(allowed, rel=1e-6)
    assert found.given is None


def test_a_point_of_a_mask_is_a_number_too() -> None:
    """Keys with a dot and a blank; a level of noise complies from below."""
    oscillator = {"frequency": "10 GHz", "phase_noise": {"0.5 Hz": "-30 dBc/Hz", "100 Hz": "-60 dBc/Hz"}}
    text = mission_text(platforms__receiver__oscillator=oscillator, requirements__islr="-20 dB")
    key = "platforms.receiver.oscillator.phase_noise.0.5 Hz"
    found = bb.solve(parse_mission(text, "m.yaml"), key, between="-90..-20 dBc/Hz", row="receiver.islr", date=DAY)
    (crossing,) = found.crossings
    assert crossing.is_upper
    assert crossing.is_verified
    assert found.texts[crossing.inside.value].endswith(" dBc/Hz")


def test_nothing_complies(run: Callable) -> None:
    done = run("solve", SECTION_V, "--for", "collection.aperture_time", "--between", "3..5 s")
    assert done.exit_code == 1
    assert done.stdout.startswith("collection.aperture_time: no value of the range complies\n")
    assert "Nearest      3 s: FAIL, transmitter.acceleration.x uses 295 %" in done.stdout


@pytest.mark.parametrize(("velocity", "is_broken"), [("1 um/s", False), ("20 mm/s", False), ("10 m/s", True)])
def test_what_cannot_be_judged_is_no_near_miss(run: Callable, tmp_path, velocity: str, is_broken: bool) -> None:
    """A mission that no aperture time makes judged was said to be near where it fails by the least."""
    file = tmp_path / "m.yaml"
    error = {"velocity": velocity, "vibration": {"wideband": {"rms": "1 mm"}}}
    file.write_text(mission_text(platforms__receiver__motion_error=error), encoding="utf-8")
    done = run("solve", file, "--for", "collection.aperture_time", "--between", "1..9 s")
    assert done.exit_code == 1
    assert ("Nearest " in done.stdout) == is_broken
    assert ("Not judged" in done.stdout) == (not is_broken)


def test_everything_complies(run: Callable) -> None:
    done = run("solve", SECTION_V, "--for", "collection.aperture_time", "--between", "1 s..1.2 s")
    assert done.exit_code == 0
    assert done.stdout.startswith("collection.aperture_time: every value of the range complies\n")
    assert "Least margin 1.2 s: pass, transmitter.acceleration.x uses 47.1 %" in done.stdout


def test_a_number_that_changes_nothing_is_said_to(run: Callable) -> None:
    done = run("solve", SECTION_V, "--for", "radar.bandwidth")
    assert "No effect    radar.bandwidth does not change the deciding row" in done.stdout
    assert "No effect" not in run("solve", SECTION_V, "--for", "collection.aperture_time").stdout


def test_a_signed_error_is_bounded_from_both_sides() -> None:
    key = "platforms.transmitter.motion_error.acceleration.0"
    low, high = solve(key, between="-5..5 mm/s^2").crossings
    assert (low.is_upper, high.is_upper) == (False, True)
    assert -low.inside.value == pytest.approx(high.inside.value, rel=1e-6)
    assert high.inside.value == pytest.approx(R * WAVELENGTH / (2 * X * 6**2), rel=1e-6)


def test_json(run: Callable) -> None:
    options = ("--for", "collection.aperture_time", "--format", "json")
    done = run("solve", SECTION_V, *options, "--set", "radar.bandwidth=150MHz")
    document = json.loads(done.stdout)
    assert document["format"] == "bisar-budget/solve/1"
    (mission,) = document["missions"]
    assert (mission["file"], mission["key"], mission["unit"]) == (SECTION_V, "collection.aperture_time", "s")
    assert mission["binding_row"] == "transmitter.acceleration.x"
    assert mission["set"] == [{"key": "radar.bandwidth", "text": "150MHz"}]
    (crossing,) = mission["crossings"]
    assert crossing["value"] == mission["value"] == crossing["inside"]["value"]
    assert crossing["complies"] == "below"
    # The text is what `--set` takes.
    assert run("check", SECTION_V, "--set", f"{mission['key']}={mission['text']}").exit_code == 0
    (mission,) = json.loads(run("solve", SECTION_V, *options, "--between", "3..5 s").stdout)["missions"]
    assert (mission["value"], mission["crossings"], mission["status"]) == (None, [], "none")


def test_several_missions_are_solved_for_one_key(run: Callable) -> None:
    other = str(MISSIONS / "tandem_x.yaml")
    options = ["--set", "allocation.model=published", "--for", "collection.aperture_time", "--between", "3 s..5 s"]
    done = run("solve", SECTION_V, other, *options)
    assert done.exit_code == 1
    assert "no value of the range complies" in done.stdout
    assert "complies up to 3.94259" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--for", "aperture_time"], "is not a known key; accepted: schema_version"),
        (["--for", "aperture_time"], "Did you mean 'collection.aperture_time'?"),
        (["--for", "radar.bandwith"], "accepted: center_frequency, bandwidth. Did you mean 'radar.bandwidth'?"),
        (["--for", "collection"], "is a section; accepted: one of its keys, aperture_time"),
        (
            ["--for", "platforms.transmitter.position"],
            "has three components; accepted: platforms.transmitter.position.0",
        ),
        (["--for", "name"], "is no number with a unit"),
        (["--for", "other_errors.2.name"], "the list has 0 entries, and none has the number 2"),
        (["--for", "platforms.receiver.motion_error.velocity"], "has no value in the file; say where to look"),
        (["--for", "platforms.transmitter.velocity.0"], "is 0 in the file; say where to look"),
        (["--for", "platforms.receiver.position.0", "--between", "1..2 km"], "the list has 0 entries"),
        (["--for", "collection.aperture_time", "--between", "3"], "is no range; accepted: A..B, such as 3s..12s"),
        (["--for", "collection.aperture_time", "--between", "5..3 s"], "--between 5..3 s: is reversed"),
        (["--for", "collection.aperture_time", "--between", "3..3 s"], "--between 3..3 s: is empty"),
        (["--for", "collection.aperture_time", "--between", "3 m..5 m"], "'3 m' must be a time, but 'm' makes it"),
        (["--for", "collection.aperture_time", "--between", "0..4 s"], "'0 s' must be greater than 0 s"),
        (["--for", "platforms.receiver.azimuth", "--between", "0..180"], "'180' has no unit"),
        (["--for", "platforms.transmitter.latitude"], "no value of the range makes a mission"),
        (["--for", "radar", "--scale"], "holds no errors that --scale could multiply"),
        (["--for", "platforms.receiver.motion_error", "--scale"], "states no error there"),
    ],
)
def test_what_cannot_be_asked_is_wrong_usage(run: Callable, arguments: list[str], said: str) -> None:
    done = run("solve", SECTION_V, *arguments)
    assert done.exit_code == 2
    assert done.stderr.startswith(f"Error: {SECTION_V}: ")
    assert said in done.stderr
    assert not done.stdout


def test_a_mission_without_errors_has_nothing_to_solve(run: Callable, tmp_path) -> None:
    file = tmp_path / "m.yaml"
    file.write_text(mission_text(), encoding="utf-8")
    done = run("solve", str(file), "--for", "collection.aperture_time")
    assert done.exit_code == 2
    assert "declares no error: nothing decides whether it complies" in done.stderr


def test_a_scale_factor_of_accelerometers_is_an_error_that_scales() -> None:
    """It is a ratio, and was kept as if it were a setting."""
    error = {"imu": {"accelerometer_scale_factor": "300 ppm", "attitude": "0.01 deg"}}
    mission = parse_mission(mission_text(platforms__receiver__motion_error=error))
    imu = scaled(mission, "platforms.receiver.motion_error.imu", 2.0).platforms.receiver.motion_error.imu
    assert imu.accelerometer_scale_factor == pytest.approx((6e-4,) * 3)


@pytest.mark.parametrize("between", ["1e-12..2e-9/g", "1e-12..2e-9 /g", "1e-12/g..2e-9/g", "1e-12 1/g..2e-9 1/g"])
def test_a_range_of_a_unit_per_g(between: str) -> None:
    """The exponent of a number is no part of its unit."""
    number = number_of({}, "platforms.receiver.oscillator.acceleration_sensitivity")
    asked = range_of(number, between)
    assert asked.low == pytest.approx(1e-12 / 9.80665, rel=1e-12)
    assert asked.high == pytest.approx(2e-9 / 9.80665, rel=1e-12)
    assert number.said_like(between).unit in ("/g", "1/g")


def test_beside_a_bias_the_sigma_is_searched_for() -> None:
    """The key of such a figure means its sigma; the bias and the confidence stay as they are."""
    position, location = "platforms.transmitter.motion_error.position", "requirements.location_error"
    given = parse_mission(
        mission_text(
            allocation={"combine": "rss", "model": "full"},
            platforms__transmitter__motion_error__position={"sigma": "50 cm", "bias": ["0 m", "0 m", "4 m"]},
            platforms__receiver__motion_error__position="1 m",
            requirements__location_error={"limit": "20 m", "confidence": "95 %"},
        ),
        "m.yaml",
    )
    for key, named, between in (
        (position, f"{position}.sigma", "1 cm..1 km"),
        (location, f"{location}.limit", "10 cm..20 m"),
    ):
        found, same = (
            bb.solve(given, one, between=between, row="mission.location_error", date=DAY).found
            for one in (key, named)
        )
        assert isinstance(found, Solution)
        assert found == same
        assert found.key == named
        (crossing,) = found.crossings
        assert crossing.is_verified
        changes = [SetValue(named, f"{crossing.outside.value!r} m")]
        rows = check_mission(parse_mission(given.data, "m.yaml", changes=changes), DAY).rows
        (row,) = (row for row in rows if row.id == "mission.location_error")
        assert row.utilization == pytest.approx(1, abs=1e-5)
        assert row.status == "fail"
