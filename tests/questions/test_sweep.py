"""A sweep has the numbers of `check`, case by case, whether its numbers are put into the mission or read with it."""

import math
import re
from datetime import date
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given
from hypothesis import strategies as st

from bisar_budget.budget.check import check_mission
from bisar_budget.faults import MissionError, SetValue
from bisar_budget.findings.case_table import Cases
from bisar_budget.findings.row import Row
from bisar_budget.mission.changes import apply_changes
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import flies_on_earth
from bisar_budget.mission.quantities import QuestionError, number_of, tree_of
from bisar_budget.mission.tree import read_tree
from bisar_budget.questions.asked import Asked
from bisar_budget.questions.cases import grid as cases_of
from bisar_budget.questions.cases import sample
from bisar_budget.questions.table import breaking
from bisar_budget.ranges.limit_search import LIMIT_FRACTION
from tests.conftest import ROOT, UAV_FREE_RUNNING, examples, mission_file, mission_text, row
from tests.families import FAMILIES
from tests.families import mission_text as of_family
from tests.fuzz import case
from tests.standing import standing

MISSIONS = ROOT / "specs" / "missions"
DAY = date(2026, 1, 1)
# Two ways to one number differ by the rounding of sums of some hundred terms.
NEAR = 1e-9


def grid(mission, **axes) -> Cases:
    """Cases of a mission; dots of keys are written as two underscores."""
    tree = read_tree(mission.data, mission.file)
    apply_changes(tree, mission.changes)
    numbers = tuple(number_of(tree.root, key.replace("__", ".")) for key in axes)
    return Cases(numbers, tuple(np.asarray(values, dtype=float) for values in axes.values()), is_grid=True)


def swept(mission, cases, columns=(), model=None, jobs=1):
    """Every column of a sweep, whole."""
    found = Asked(mission, cases, columns=columns, model=model, today=DAY).checked(jobs)
    parts = list(found.parts)
    assert [part.start for part in parts] == [0, *(part.stop for part in parts[:-1])]
    assert parts[-1].stop == found.count == cases.count
    return {one.name: np.concatenate([part.values[one.name] for part in parts]) for one in found.columns}


def is_searched(worst: Row) -> bool:
    """Whether a limit comes from a search along exact ranges."""
    return worst.model == "full" and worst.allowable_full is not None


def assert_as_checked(mission, cases, whole, columns=(), model=None, near=NEAR) -> None:
    """Compare each case with `check_mission` of a mission that has its values.

    `near` is the tolerance of a utilization whose limit comes from a search along exact ranges; of any other `NEAR`.
    """
    for place in range(cases.count):
        values = {key: float(one[0]) for key, one in cases.values(place, place + 1).items()}
        changes = [
            SetValue(number.key, f"{values[number.key]!r} {number.dimension.si}".rstrip()) for number in cases.varied
        ]
        got = {name: column[place] for name, column in whole.items()}
        try:
            case = parse_mission(mission.data, mission.file, model, changes=(*mission.changes, *changes))
            found = check_mission(case, DAY)
        except MissionError as error:
            assert got["status"] == "error", values
            assert got["reason"].endswith(error.faults[0].problem.partition(" (")[0]) or got["reason"]
            assert math.isnan(got["utilization"])
            continue
        assert got["status"] == found.status, values
        assert got["reason"] == ""
        stands = standing(found, None, breaking("fail"))
        assert got["worst_row"] == (stands.row or ""), values
        use = math.nan if stands.utilization is None else stands.utilization
        tolerance = near if stands.row and is_searched(row(found, stands.row)) else NEAR
        assert got["utilization"] == pytest.approx(use, rel=tolerance, nan_ok=True), values
        assert got["binding_requirement"] == (stands.requirement or "")
        assert got["waived_by"] == "; ".join(stands.waived_by)
        codes = [warning.message.code for warning in found.warnings if warning.is_doubt]
        assert {*got["doubts"].split("; ")} - {""} == {*codes}, values
        assert got["range_resolution"] == pytest.approx(found.resolution.range, rel=NEAR)
        assert got["cross_range_resolution"] == pytest.approx(found.resolution.cross_range, rel=NEAR)
        assert got["bistatic_angle"] == pytest.approx(found.geometry.bistatic_angle, rel=NEAR)
        rows = {row.id: row for row in found.rows}
        for name in columns:
            row_id, _, field = name.rpartition(".")
            want = getattr(rows[row_id], field) if row_id in rows else ("not_declared" if field == "status" else None)
            if field == "status":
                assert got[name] == want, (values, name)
            else:
                want = math.nan if want is None else want
                # ISLR holds cubic phases: exact ranges know them to 4e-10 rad, the smallest that counts is 1e-3.
                holds_cubic = ".islr." in name and case.requirements.cubic_phase_error is None
                within = 1e-6 if holds_cubic else NEAR
                # Between centre and rim two phases differ: of some radians, whose rounding is left.
                floor = 1e-14 if name == "mission.spatial_variance.declared" else 0.0
                assert got[name] == pytest.approx(want, rel=within, abs=floor, nan_ok=True), (values, name)


COLUMNS = (
    "receiver.acceleration.x.allowable",
    "transmitter.velocity.y.allowable",
    "mission.cubic_phase_error.declared",
    "mission.location_error.status",
    "mission.location_error.margin",
    "timing.quadratic.utilization",
    "receiver.vibration.wideband.allowable",
)
_FACTORS = st.lists(st.floats(0.3, 3.0), min_size=2, max_size=2)
_KEYS = {
    "collection__aperture_time": _FACTORS,
    "radar__center_frequency": _FACTORS,
    "platforms__transmitter__motion_error__acceleration": _FACTORS,
    "platforms__receiver__motion_error__position": _FACTORS,
    "platforms__receiver__slant_range": _FACTORS,
    "platforms__receiver__azimuth": _FACTORS,
    "platforms__transmitter__position__2": _FACTORS,
    "timing_error__quadratic": _FACTORS,
    "requirements__quadratic_phase_error": _FACTORS,
    "allocation__coverage_factor": st.lists(st.floats(1.0, 3.0), min_size=2, max_size=2),  # at least 1
    "scene__radius": _FACTORS,
}
MASK = """
{frequency: 10 MHz, phase_noise: {1 Hz: -95 dBc/Hz, 10 Hz: -125 dBc/Hz, 1 kHz: -150 dBc/Hz}, spurs: {60 Hz: -90 dBc}}
"""
COVARIANCE = """
{covariance: {position: [1 m, 1 m, 2 m], velocity: 5 mm/s,
 correlation: {position.x-velocity.x: 0.6, position.x-position.z: -0.3}}}
"""
_RULES = {
    "allocation.combine": ("each", "sum", "rss"),
    "allocation.split": ("equal", "balanced"),
    "allocation.model": ("published", "full", "strictest"),
    "autofocus.n_pull": ("1", "3"),
    "requirements.cubic_phase_error": ("0.2 rad",),
    "requirements.location_error": ("0.5 m", "20 m"),
    "common_motion_error.position": ("2 m",),
    "scene.height_error": ("3 m",),
    "scene.radius": ("100 m", "3 km"),
    "timing_error.quadratic": ("1e-12 /s",),
    "requirements.islr": ("-25 dB",),
    "requirements.pslr": ("-30 dB",),
    "requirements.declare": ("[position, imu]", "[receiver.oscillator, timing]"),
    "waivers": ("[{id: 'mission.*', until: 2030-01-01, reason: tried}]",),
    "platforms.transmitter.motion_error.vibration": (
        "{wideband: {rms: 50 um}}",
        "{sinusoidal: [{amplitude: 100 um, frequency: 20 Hz}, {amplitude: 1 um, frequency: 0.1 Hz}]}",
    ),
    "platforms.receiver.motion_error.vibration": ("{sinusoidal: [{amplitude: 3 um, frequency: 20.5 Hz}]}",),
    "platforms.transmitter.motion_error.imu": ("{attitude: 0.01 deg, velocity_random_walk: 0.05 m/s/sqrt(h)}",),
    "platforms.receiver.motion_error.random": ("[{name: GNSS, sigma: [1 mm, 2 mm, 0], correlation_time: 2 s}]",),
    "platforms.receiver.motion_error": (COVARIANCE,),
    "platforms.receiver.oscillator": (MASK, "{allan_deviation: {1 s: 3e-12, 10 s: 2e-12, 100 s: 4e-12}}"),
    "propagation": (
        "{zenith_delay: 5 cm, zenith_electron_content: 2 TECU}",
        "{transmitter: {zenith_delay: 1 m, zenith_electron_content: 50 TECU}}",
    ),
    "other_errors": (
        "[{name: a, cubic_phase_error: 3 deg, islr: -35 dB}, {name: b, location_error: 2 m}]",
        "[{name: a, quadratic_phase_error: 3 deg, location_error: 1 cm}]",
    ),
    "synchronization": ("{error: 1 deg, interval: 0.3 s}", "{error: 1 deg, method: direct_path}"),
}


@examples(12, default=5, phases=[Phase.explicit, Phase.reuse, Phase.generate])  # a case takes long
@given(data=st.data(), family=st.sampled_from(FAMILIES), seed=st.integers(0, 300))
def test_every_case_is_that_of_check(data, family, seed) -> None:
    """Random missions, rules and keys: arrays, exact ranges among them, and what they leave to `check`."""
    chosen = data.draw(st.lists(st.sampled_from(sorted(_RULES)), unique=True, max_size=5), label="rules")
    changes = [SetValue(key, data.draw(st.sampled_from(_RULES[key]), label=key)) for key in chosen]
    try:
        mission = parse_mission(of_family(family, seed), "m.yaml", changes=changes)
    except MissionError:
        return
    axes = {}
    for key in data.draw(st.lists(st.sampled_from(sorted(_KEYS)), unique=True, min_size=1, max_size=2), label="keys"):
        try:
            (number,) = grid(mission, **{key: [1.0]}).varied
        except QuestionError:
            continue
        if number.value:
            axes[key] = [number.value * factor for factor in data.draw(_KEYS[key], label=key)]
    if not axes:
        return
    cases = grid(mission, **axes)
    whole = swept(mission, cases)
    # A search for a limit ends within this fraction of the limit; what else is searched decides where within it.
    assert_as_checked(mission, cases, whole, near=LIMIT_FRACTION)


def test_where_an_image_ends_is_found_to_rounding() -> None:
    """Half a cycle is hidden behind a fold at 1.4533 s; at 2.9066 s a phase reaches its limit shortly before one.

    Searches for an end agree to rounding; a search for a phase ends within `LIMIT_FRACTION` of the limit.
    """
    noise = SetValue("platforms.receiver.motion_error.random", _RULES["platforms.receiver.motion_error.random"][0])
    mission = parse_mission(of_family("satellite_fixed", 21), "m.yaml", changes=[noise])
    for aperture_time, near in ((1.4533, NEAR), (2.9066, LIMIT_FRACTION)):
        cases = grid(mission, collection__aperture_time=[aperture_time])
        assert_as_checked(mission, cases, swept(mission, cases), near=near)


EXAMPLES = [
    "rigling_moses_section_v.yaml",
    "rigling_moses_section_v_autofocus.yaml",
    "sentinel1_fixed_receiver.yaml",
    "tandem_l.yaml",
    "uav_pair_l_band.yaml",
    "one_stationary_spotlight.yaml",
]
# Sensors; clocks that run free, are synchronised or replaced by the direct path; covariances; an orbit and a log.
INSTRUMENTS = [
    "uav_stim300",
    "uav_free_running",
    "ocxo_free_running",
    "tandem_x_synchronized",
    "ocxo_direct_path",
    "drones_same_gnss",
    "sentinel1_aircraft_log",
]


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_are_held_whole(name) -> None:
    """No case of an example that the published model gates is left to the slow way, and columns are those of rows."""
    mission = load_mission(str(MISSIONS / name))
    T = mission.collection.aperture_time
    cases = grid(mission, collection__aperture_time=[0.5 * T, T, 2 * T], radar__bandwidth=[20e6, 100e6])
    whole = swept(mission, cases, COLUMNS)
    assert_as_checked(mission, cases, whole, COLUMNS)


@pytest.mark.parametrize("name", INSTRUMENTS)
def test_sensors_and_clocks_are_held(name) -> None:
    """Every row of what the mission names, and the rows that count it."""
    mission = load_mission(str(mission_file(name)))
    T, f = mission.collection.aperture_time, mission.radar.center_frequency
    axes = {"radar__center_frequency": [0.9 * f, f], "allocation__coverage_factor": [1.0, 2.0]}
    if not flies_on_earth(mission):
        axes["collection__aperture_time"] = [0.3 * T, 1.7 * T]
    cases = grid(mission, **axes)
    kinds = ("imu", "random", "navigation", "oscillator", "synchronization", "islr")
    rows = [row.id for row in check_mission(mission, DAY).rows if row.subject.kind in kinds]
    fields = ("declared", "allowable", "margin", "utilization", "status", "qpe_published_rad", "cubic_rad")
    columns = [f"{row}.{field}" for row in rows for field in fields]
    whole = swept(mission, cases, columns)
    assert_as_checked(mission, cases, whole, columns)


@pytest.mark.parametrize("model", ["full", "strictest"])
@pytest.mark.parametrize("name", [*EXAMPLES, "tandem_x.yaml"])
def test_searches_of_the_full_model_are_held(name, model) -> None:
    """Limits that only a search along exact ranges finds are those of `check`; few searches take too many steps."""
    mission = load_mission(str(MISSIONS / name))
    T = mission.collection.aperture_time
    azimuth = mission.platforms.receiver.azimuth
    axes = {"collection__aperture_time": [0.4 * T, 1.1 * T, 2 * T]}
    if azimuth is None:
        axes["radar__bandwidth"] = [20e6, 100e6]
    else:
        axes["platforms__receiver__azimuth"] = [azimuth - 0.4, azimuth, azimuth + 0.9]
    cases = grid(mission, **axes)
    whole = swept(mission, cases, model=model)
    # Of few lanes several sizes are looked at in each step, of many one: a search ends within 1e-5 of its limit.
    assert_as_checked(mission, cases, whole, model=model, near=1e-5)


@pytest.mark.parametrize("model", ["full", "strictest"])
def test_a_whole_check_searches_in_another_order(model) -> None:
    """Columns of errors that nobody declared ask for a whole check: requirements in their order, each to its end."""
    mission = load_mission(str(MISSIONS / "rigling_moses_section_v.yaml"))
    cases = grid(mission, collection__aperture_time=[1.0, 6.0], platforms__receiver__azimuth=[0.5, 2.5])
    columns = ["receiver.position.z.allowable", "timing.cubic.allowable", "transmitter.velocity.y.allowable"]
    whole = swept(mission, cases, columns, model=model)
    assert_as_checked(mission, cases, whole, columns, model=model)


EDGE = [f"mission.spatial_variance.{field}" for field in ("declared", "allowable", "margin", "status")]


@pytest.mark.parametrize(("rule", "model"), [("each", "published"), ("rss", "full"), ("sum", "strictest")])
def test_edges_of_scenes_are_held(rule, model) -> None:
    """Errors that grow with the radius in proportion, others that do not, and an edge without an image."""
    rules = {"allocation.combine": rule, "allocation.model": model, "scene.radius": "500 m"}
    text = (MISSIONS / "rigling_moses_section_v.yaml").read_bytes()
    mission = parse_mission(text, "m.yaml", changes=[SetValue(*one) for one in rules.items()])
    axes = {"scene__radius": [300.0, 2e3, 30e3], "platforms__transmitter__motion_error__acceleration__0": [5e-3, 0.3]}
    cases = grid(mission, **axes)
    whole = swept(mission, cases, EDGE)
    of_edge = ["pass", "pass", "pass", "warn" if model == "published" else "fail", "not_evaluated", "not_evaluated"]
    assert list(whole["mission.spatial_variance.status"]) == of_edge
    assert_as_checked(mission, cases, whole, EDGE)


WANDERING = """
    acceleration: [6 m/s^2, 10 m/s^2, 0 m/s^2]
    oscillator: {power_law: {h0: 1e-22, h-2: 1e-26}, acceleration_sensitivity: 1e-9 /g}
    motion_error:
      acceleration: 1 mm/s^2
      imu: {accelerometer_bias: 5 mm/s^2, angle_random_walk: 0.2 deg/sqrt(h), attitude: [1 mrad, 1 mrad, 0 rad]}
      lever_arm: {arm: [2 m, 1 m, 3 m], uncertainty: 2 cm}
      random: [{name: gnss, sigma: 5 cm, correlation_time: 20 s}]
      vibration:
        sinusoidal: [{amplitude: [1 mm, 0 mm, 2 mm], frequency: 0.2 Hz}]
        spectrum: {0.1 Hz: 1e-6 m^2/Hz, 3 Hz: 1e-8 m^2/Hz}
"""
AT_RANDOM = """
schema_version: 1
name: Errors at random
radar: {center_frequency: 9.6 GHz, bandwidth: 200 MHz}
collection: {aperture_time: 4 s}
platforms:
  transmitter: {position: [20 km, -6 km, 5 km], velocity: [20 m/s, 140 m/s, 0 m/s]}
  receiver:
    position: [5 km, 7 km, 2 km]
    velocity: [-50 m/s, 30 m/s, 0 m/s]WANDERING
scene: {radius: 600 m}
propagation: {zenith_delay: 30 cm}
synchronization:
  {method: holdover, age: 60 s, averaging: 10 s, time_error: 0 s, frequency_error: 0}
"""


@pytest.mark.parametrize("rule", ["each", "sum", "rss"])
def test_errors_at_random_are_held_at_the_edges_of_scenes(rule) -> None:
    """Sensors, noise, arms, delays, clocks and vibrations that are slow in some of the cases."""
    text = AT_RANDOM.replace("WANDERING", WANDERING)
    mission = parse_mission(text, "m.yaml", changes=[SetValue("allocation.combine", rule)])
    cases = grid(
        mission,
        collection__aperture_time=[2.0, 4.0, 9.0],
        platforms__receiver__motion_error__imu__attitude__0=[1e-4, 2e-3],
        platforms__receiver__motion_error__random__0__correlation_time=[5.0, 500.0],
    )
    whole = swept(mission, cases, EDGE)
    assert len(set(whole["mission.spatial_variance.declared"])) > 3
    assert_as_checked(mission, cases, whole, EDGE)


@pytest.mark.parametrize("rule", ["each", "sum", "rss"])
@pytest.mark.parametrize("needs", [{}, {"requirements": {"location_error": "5 mm"}}])
def test_vibrations_may_be_slow(needs, rule) -> None:
    """Below one cycle per aperture a vibration is a phase that counts with the others, and moves the image."""
    text = mission_text(timing_error__quadratic="1e-12 /s", **needs).replace(
        "  receiver:",
        "  receiver:\n    motion_error: {vibration: {sinusoidal: [{amplitude: 20 um, frequency: 2 Hz}]}}",
        1,
    )
    mission = parse_mission(
        text, "m.yaml", changes=[SetValue("allocation.combine", rule), SetValue("autofocus.n_pull", "1")]
    )
    cases = grid(mission, collection__aperture_time=[0.3, 0.49, 0.51, 3.0], radar__center_frequency=[3e9, 10e9])
    columns = ["mission.cubic_phase_error.declared", "mission.autofocus_pull_in.declared"]
    whole = swept(mission, cases, columns)
    assert_as_checked(mission, cases, whole, columns)


def test_a_fold_binds_by_what_it_hides() -> None:
    """A transmitter of 30 m of doubt along the line of sight; behind the fold at 10.8 m the hidden phase grows."""
    mission = parse_mission(of_family("aircraft", 3), "m.yaml", "full")
    T = mission.collection.aperture_time
    cases = grid(mission, collection__aperture_time=[0.9 * T, T, 1.1 * T])
    whole = swept(mission, cases, model="full")
    assert list(whole["binding_requirement"]) == ["quadratic_phase_error"] * 3
    assert_as_checked(mission, cases, whole, model="full", near=LIMIT_FRACTION)


def test_the_end_of_the_image_binds() -> None:
    """A common height error of 250 m, of which no ground point has the range history from 19.7 m on."""
    text = of_family("drones", 42)
    alone = text.replace("velocity: [0.1016, 0.005091, -1], acceleration: 0.0009484, ", "")
    assert alone != text
    mission = parse_mission(alone.replace("2.533]", "250]"), "m.yaml", "full")
    T = mission.collection.aperture_time
    cases = grid(mission, collection__aperture_time=[0.9 * T, T, 1.1 * T])
    whole = swept(mission, cases, model="full")
    assert list(whole["binding_requirement"]) == ["end_of_image"] * 3
    assert_as_checked(mission, cases, whole, model="full", near=LIMIT_FRACTION)


def test_what_decides_more_than_itself_is_read_and_judged_together() -> None:
    """A path that the Earth decides is found anew for every aperture; where no row decides, a requirement breaks."""
    mission = load_mission(str(MISSIONS / "sentinel1_elements_besancon.yaml"))
    cases = grid(mission, collection__aperture_time=[1.0, 1.5])
    for needs in ((), (SetValue("requirements.pslr", "-30 dB"),)):
        unmet = load_mission(mission.file, changes=needs)
        whole = swept(unmet, cases)
        assert_as_checked(unmet, cases, whole)
    assert list(whole["binding_requirement"]) == ["pslr"] * 2


@pytest.mark.parametrize(
    ("name", "axes"),
    [
        ("sentinel1_aircraft_log", {"collection__aperture_time": [0.2, 1.0, 6.0, 900.0]}),  # longer than the log
        ("astra_drone", {"scene__latitude": [0.5, 0.8], "platforms__receiver__altitude": [50.0, 2000.0]}),
    ],
)
def test_paths_that_are_found_anew_are_stacked(name, axes) -> None:
    """Orders of fits differ, and so do words of doubt; some cases are below the horizon, or beyond a log."""
    mission = load_mission(str(MISSIONS / f"{name}.yaml"))
    cases = grid(mission, **axes)
    whole = swept(mission, cases)
    assert "error" in whole["status"]
    assert_as_checked(mission, cases, whole)


_LINK = "{error: 1 deg, interval: 0.3 s}"
_FIGURES: dict[str, Any] = {
    "synchronization": {"error": "1 deg", "interval": "0.3 s"},
    "requirements": {"islr": "-25 dB", "pslr": "-30 dB", "quadratic_phase_error": "45 deg"},
    "allocation": {"split": {"transmitter": 0.3, "receiver": 0.5, "clock": 0.2}, "combine": "rss"},
}


@pytest.mark.parametrize(("rule", "model"), [("each", "published"), ("rss", "full"), ("sum", "strictest")])
def test_errors_that_leave_no_image_are_held(rule, model) -> None:
    """Nothing is where range and Doppler gradients have become parallel: phases without end, no place to move to."""
    changes = {
        "allocation.combine": rule,
        "allocation.model": model,
        "requirements.cubic_phase_error": "0.2 rad",
        "requirements.location_error": "20 m",
        "autofocus.n_pull": "2",
        "scene.radius": "100 m",
    }
    text = (MISSIONS / "rigling_moses_section_v.yaml").read_bytes()
    mission = parse_mission(text, "m.yaml", changes=[SetValue(*one) for one in changes.items()])
    cases = grid(mission, platforms__receiver__motion_error__velocity=[0.01, 100.0, 900.0])
    sums = ("cubic_phase_error", "location_error", "autofocus_pull_in", "spatial_variance", "quadratic_phase_error")
    columns = [
        f"mission.{one}.{field}"
        for one in sums
        for field in ("status", "declared")
        if rule != "each" or one != sums[-1]
    ]
    whole = swept(mission, cases, columns)
    assert whole["mission.spatial_variance.status"][2] == "not_evaluated"
    assert_as_checked(mission, cases, whole, columns)


@pytest.mark.parametrize("rule", ["each", "sum"])
def test_a_slow_vibration_alone(rule) -> None:
    """What it is counted in is declared only in the cases in which it is slow."""
    vibration = "{sinusoidal: [{amplitude: 2 mm, frequency: 2 Hz}]}"
    changes = {
        "platforms.receiver.motion_error.vibration": vibration,
        "requirements.cubic_phase_error": "0.2 rad",
        "autofocus.n_pull": "1",
        "allocation.combine": rule,
    }
    mission = parse_mission(mission_text(), "m.yaml", changes=[SetValue(*one) for one in changes.items()])
    cases = grid(mission, collection__aperture_time=[0.2, 0.4, 0.6])
    columns = ["mission.cubic_phase_error.status", "mission.autofocus_pull_in.status"]
    whole = swept(mission, cases, columns)
    assert [one == "not_declared" for one in whole[columns[0]]] == [False, False, True]
    assert_as_checked(mission, cases, whole, columns)


_LINES = {
    "platforms.transmitter.motion_error.vibration": (
        "{sinusoidal: [{amplitude: 20 um, frequency: 6 Hz}, {amplitude: [10 um, 5 um, 1 um], frequency: 6.3 Hz}]}"
    ),
    "platforms.receiver.motion_error.vibration": (
        "{sinusoidal: [{amplitude: 30 um, frequency: 6.1 Hz}, {amplitude: 0 m, frequency: 20 Hz}], "
        "wideband: {rms: [10 um, 20 um, 30 um]}}"
    ),
}
_OF_LINES = [
    f"{row_id}.{field}"
    for row_id in (
        "transmitter.vibration.sinusoidal.0",
        "transmitter.vibration.sinusoidal.sum.0",
        "receiver.vibration.sinusoidal.0",
        "receiver.vibration.sinusoidal.sum.0",
        "receiver.vibration.wideband",
        "mission.pslr",
        "mission.islr",
    )
    for field in ("status", "declared", "allowable", "utilization", "qpe_published_rad", "cubic_rad")
]


@pytest.mark.parametrize("model", ["published", "full", "strictest"])
@pytest.mark.parametrize("requirements", ["pslr: -30 dB, islr: -20 dB", "islr: -25 dB, cubic_phase_error: 5 deg", ""])
@pytest.mark.parametrize(
    "axes",
    [
        # Slow, beside the mainlobe, and near the lines of either platform or of none.
        {
            "platforms__receiver__motion_error__vibration__sinusoidal__0__frequency": [
                0.1,
                0.3,
                0.7,
                5.9,
                6.1,
                19.8,
                40,
            ]
        },
        # Lines are near each other over a short aperture, apart over a long one, and slow over a very short one.
        {"collection__aperture_time": [0.1, 0.16, 0.3, 2.0, 9.0, 15.0]},
        {"platforms__transmitter__motion_error__vibration__sinusoidal__1__amplitude__0": [0.0, 1e-5, 1e-3]},
    ],
    ids=["frequency", "aperture", "amplitude"],
)
def test_lines_that_are_near_each_other_in_some_cases(axes, requirements, model) -> None:
    """All that vibrates is in the arrays: no case is checked by itself."""
    changes = {**_LINES, "allocation.model": model, "platforms.receiver.oscillator": MASK}
    for one in filter(None, requirements.split(", ")):
        key, value = one.split(": ")
        changes[f"requirements.{key}"] = value
    mission = parse_mission(mission_text(), "m.yaml", changes=[SetValue(*one) for one in changes.items()])
    rows = {one.id for one in check_mission(mission, DAY).rows}  # a sweep knows the names of these
    columns = [one for one in _OF_LINES if one.rpartition(".")[0] in rows]
    cases = grid(mission, **axes)
    whole = swept(mission, cases, columns)
    assert_as_checked(mission, cases, whole, columns)


@pytest.mark.parametrize(
    "axes",
    [
        {"platforms__receiver__oscillator__phase_noise__10 Hz": [-130.0, -110.0, -90.0]},  # a rise is no oscillator
        {"platforms__receiver__oscillator__spurs__60 Hz": [-120.0, -60.0]},
        {"platforms__receiver__oscillator__bandwidth": [50.0, 2e3], "synchronization__interval": [0.1, 1.0]},
        {"synchronization__error": [1e-3, 0.1], "requirements__islr": [-40.0, -20.0]},
        {"platforms__transmitter__motion_error__imu__attitude": [1e-5, 1e-3]},
        {"platforms__transmitter__motion_error__imu__gyro_bias": [0.0, 1e-5]},  # a figure that the file leaves out
        {"platforms__receiver__motion_error__covariance__velocity": [1e-4, 1e-2]},
        {"platforms__receiver__motion_error__covariance__correlation__position.x-velocity.x": [-0.9, 0.9, 0.99]},
        {"allocation__split__receiver": [0.4, 0.5, 0.6], "allocation__split__clock": [0.1, 0.2]},
    ],
    ids=lambda axes: next(iter(axes)).rpartition("__")[2],
)
def test_figures_of_sensors_clocks_and_covariances_vary(axes) -> None:
    changes = {
        "platforms.receiver.oscillator": MASK,
        "platforms.receiver.motion_error": COVARIANCE,
        "platforms.transmitter.motion_error": "{frame: track, imu: {attitude: 0.01 deg}}",
    }
    mission = parse_mission(mission_text(**_FIGURES), "m.yaml", changes=[SetValue(*one) for one in changes.items()])
    cases = grid(mission, **axes)
    columns = ["receiver.oscillator.allowable", "mission.quadratic_phase_error.declared", "receiver.islr.margin"]
    whole = swept(mission, cases, columns)
    assert_as_checked(mission, cases, whole, columns)


def test_an_oscillator_without_noise_may_be_synchronized() -> None:
    """A power law of zeros has no spectrum; `check` ended in a traceback."""
    changes = {"platforms.receiver.oscillator": "{power_law: {h0: 0}}", "synchronization": _LINK}
    mission = parse_mission(mission_text(), "m.yaml", changes=[SetValue(*one) for one in changes.items()])
    (row,) = (row for row in check_mission(mission, DAY).rows if row.id == "receiver.oscillator")
    assert (row.qpe_full_rad, row.utilization) == (0, 0)
    cases = grid(mission, collection__aperture_time=[1.0, 3.0])
    whole = swept(mission, cases)
    assert_as_checked(mission, cases, whole)


def test_cases_that_are_no_mission_are_rows_that_say_why() -> None:
    """Range and Doppler gradients nearly parallel, a place below the ground, a band below 0 Hz."""
    mission = load_mission(str(MISSIONS / "rigling_moses_section_v.yaml"))
    cases = grid(
        mission,
        radar__bandwidth=[100e6, 21e9],
        platforms__transmitter__position__2=[6000.0, -1.0],
        platforms__receiver__azimuth=[math.radians(179.9), 0.7],
    )
    whole = swept(mission, cases)
    assert_as_checked(mission, cases, whole)
    assert list(whole["status"]).count("error") >= 6
    assert any("below the ground" in reason for reason in whole["reason"])
    assert any("twice the centre frequency" in reason for reason in whole["reason"])


def test_a_fixed_platform_that_moves_has_no_direction() -> None:
    """Speed 0 is a mission; any other speed lacks `motion_azimuth`, as `check` says."""
    text = (MISSIONS / "rigling_moses_section_v.yaml").read_bytes()
    mission = parse_mission(
        re.sub(rb"(receiver:.*?speed:) .*?\n +motion_azimuth: .*?\n", rb"\1 0 m/s\n", text, flags=re.S), "m.yaml"
    )
    cases = grid(mission, platforms__receiver__speed=[0.0, 2.0])
    whole = swept(mission, cases)
    assert_as_checked(mission, cases, whole)
    assert "lacks motion_azimuth" in whole["reason"][1]


@pytest.mark.parametrize("rule", ["each", "rss"])
def test_autofocus_counts_up_to_range_walk(rule) -> None:
    """f₀/B varies from 10 to 100 and n_pull from below to above it."""
    text = mission_text(timing_error__quadratic="2e-12 /s", autofocus__n_pull=2, allocation__combine=rule)
    mission = parse_mission(text, "m.yaml")
    cases = grid(mission, radar__bandwidth=[100e6, 300e6, 1e9], autofocus__n_pull=[1.0, 9.99, 10.0, 33.4, 1e4])
    columns = ["timing.quadratic.allowable", "mission.autofocus_pull_in.allowable", "timing.quadratic.status"]
    whole = swept(mission, cases, columns)
    assert_as_checked(mission, cases, whole, columns)
    counts = np.minimum(whole["autofocus.n_pull"], 10e9 / whole["radar.bandwidth"])
    assert whole["mission.autofocus_pull_in.allowable"] == pytest.approx(math.pi * counts)


def test_both_sides_of_the_limit() -> None:
    """An error set a part in 10⁸ below its allowable passes (with a warning: it is near), one above fails."""
    mission = parse_mission(mission_text(timing_error__quadratic="1e-12 /s"), "m.yaml")
    allowable = next(row.allowable for row in check_mission(mission, DAY).rows if row.id == "timing.quadratic")
    cases = grid(mission, timing_error__quadratic=[allowable * (1 - 1e-8), allowable, allowable * (1 + 1e-8)])
    whole = swept(mission, cases, ["timing.quadratic.status"])
    assert list(whole["timing.quadratic.status"]) == ["warn", "warn", "fail"]


def test_a_waiver_holds_until_its_day() -> None:
    text = mission_text(timing_error__quadratic="1e-9 /s")
    column = ["timing.quadratic.status"]
    for until, status in (("2026-01-01", "waived"), ("2025-12-31", "fail")):  # judged on the first of January
        waivers = f"waivers:\n  - {{id: 'timing.*', until: {until}, reason: known}}\n"
        mission = parse_mission(text + waivers, "m.yaml")
        cases = grid(mission, collection__aperture_time=[1.0, 4.0])
        whole = swept(mission, cases, column)
        assert list(whole[column[0]]) == [status] * 2
        assert_as_checked(mission, cases, whole, column)


def test_an_error_without_an_image_makes_no_sum_of_what_spreads() -> None:
    """Its endless cubic phase was no power of the sum, and yet made a row of the platform's vibration alone."""
    wideband = {"wideband": {"rms": "1 mm"}}
    error = {"position": "40 km", "acceleration": [0, "1 mm/s^2", 0], "vibration": wideband}
    changes = {"allocation": {"model": "strictest"}, "requirements": {"islr": "-20 dB"}}
    mission = parse_mission(mission_text(platforms__transmitter__motion_error=error, **changes), "m.yaml")
    found = check_mission(mission, DAY)
    assert row(found, "transmitter.islr").model == "published"  # by the full one there is no image, and no row
    cases = grid(mission, collection__aperture_time=[5.0, 6.0])
    columns = ["transmitter.islr.utilization", "mission.islr.utilization"]
    whole = swept(mission, cases, columns)
    assert_as_checked(mission, cases, whole, columns)


def test_what_must_be_declared_and_is_not() -> None:
    changes = [SetValue("requirements.declare", "[acceleration]")]
    mission = parse_mission(mission_text(timing_error__quadratic="1e-13 /s"), "m.yaml", changes=changes)
    cases = grid(mission, collection__aperture_time=[1.0, 4.0])
    column = ["receiver.acceleration.x.status"]
    whole = swept(mission, cases, column)
    assert list(whole["status"]) == list(whole[column[0]]) == ["not_evaluated"] * 2
    assert_as_checked(mission, cases, whole, column)


@pytest.mark.parametrize("asked", ["[imu, receiver.oscillator]", "[timing]", "[transmitter.velocity]"])
@pytest.mark.parametrize("waived", [None, "mission.declare", "transmitter.*"])
def test_what_must_be_declared_and_has_no_row_is_said_in_every_case(asked, waived) -> None:
    """A kind that nobody declares has no row of its own; a waiver of the whole covers the rows that there are."""
    changes = [SetValue("requirements.declare", asked)]
    waivers = [{"id": waived, "until": "2999-01-01", "reason": "known"}] if waived else []
    text = mission_text(timing_error__quadratic="1e-13 /s", waivers=waivers)
    mission = parse_mission(text, "m.yaml", changes=changes)
    cases = grid(mission, collection__aperture_time=[1.0, 4.0])
    column = ["transmitter.velocity.y.status", "mission.declare.status"]
    whole = swept(mission, cases, column)
    broken = "waived" if waived == "mission.declare" else "not_evaluated"
    assert list(whole["status"]) == ["pass" if asked == "[timing]" else broken] * 2
    assert_as_checked(mission, cases, whole, column)


def test_a_frequency_that_would_relabel_the_mask_of_a_part_is_an_error_of_each_case() -> None:
    text = mission_text(platforms__receiver__oscillator={"sensor": "sit5358", "frequency": "10 MHz"})
    mission = parse_mission(text, "m.yaml")
    cases = grid(mission, platforms__receiver__oscillator__frequency=[5e6, 10e6, 100e6])
    whole = swept(mission, cases)
    assert [status == "error" for status in whole["status"]] == [True, False, True]
    assert "is stated at its own frequency, 10 MHz" in whole["reason"][0]
    assert_as_checked(mission, cases, whole)


def test_a_platform_that_stands_still_in_some_cases_owes_less_in_them() -> None:
    receiver = {
        "position": ["6 km", "6 km", "2 km"],
        "velocity": [0, "1 m/s", 0],
        "motion_error": {"position": "1 cm"},
    }
    text = mission_text(
        platforms__receiver=receiver,
        platforms__transmitter__motion_error={"velocity": "1 mm/s"},
        requirements__declare=["velocity"],
    )
    mission = parse_mission(text, "m.yaml")
    cases = grid(mission, platforms__receiver__velocity__1=[0.0, 1.0, 5.0])
    column = ["mission.declare.status", "receiver.velocity.x.status"]
    whole = swept(mission, cases, column)
    assert list(whole[column[0]]) == ["pass", "not_evaluated", "not_evaluated"]
    assert_as_checked(mission, cases, whole, column)


@pytest.mark.parametrize("key", ["amplitude", "frequency"])
def test_figures_of_a_vibration_vary(key) -> None:
    """From slow to fast, and on both sides of the limit of echoes."""
    mission = load_mission(str(MISSIONS / "one_stationary_spotlight.yaml"))
    path = f"platforms__receiver__motion_error__vibration__sinusoidal__1__{key}"
    cases = grid(mission, **{path: {"amplitude": [1e-6, 2e-5, 1e-3], "frequency": [0.2, 0.5, 2.0, 15.0]}[key]})
    column = ["receiver.vibration.sinusoidal.1.status"]
    whole = swept(mission, cases, column)
    assert len(set(whole[column[0]])) > (key == "amplitude")
    assert_as_checked(mission, cases, whole, column)


def test_processes_find_the_same(monkeypatch) -> None:
    """Many cases are shared out, and come back in their order."""
    monkeypatch.setattr("bisar_budget.questions.asked._MIN_SHARED_PART_COUNT", 2)
    mission = load_mission(str(MISSIONS / "rigling_moses_section_v.yaml"))
    cases = grid(mission, collection__aperture_time=np.linspace(1, 9, 200))
    column = ["receiver.acceleration.x.allowable_full"]
    alone = swept(mission, cases, column)
    shared = swept(mission, cases, column, jobs=2)
    for name, column in alone.items():
        assert np.array_equal(column, shared[name], equal_nan=column.dtype != object)


@pytest.mark.parametrize(
    ("column", "says"),
    [
        ("receiver.acceleration.x.size", "'size' is no field of a row; accepted: status, declared"),
        ("reciever.acceleration.x.allowable", "--all` lists them. Did you mean 'receiver.acceleration.x'"),
        ("nothing", "'nothing' is no field"),
    ],
)
def test_columns_that_are_not_there(column, says) -> None:
    mission = load_mission(str(MISSIONS / "rigling_moses_section_v.yaml"))
    with pytest.raises(QuestionError, match="--column") as error:
        Asked(mission, grid(mission, collection__aperture_time=[1.0]), columns=[column], today=DAY)
    assert says in str(error.value)


def test_a_point_that_is_followed_in_many_steps_is_held() -> None:
    """A search that met more than 24 points was left to a check of its own."""
    mission = parse_mission(case(14899).data, "m.yaml")
    cases = grid(mission, platforms__transmitter__motion_error__position__1=[-67161.18843750001])
    whole = swept(mission, cases)
    assert_as_checked(mission, cases, whole)


def test_a_column_that_is_named_twice_is_there_once() -> None:
    """A Parquet file had it twice, which its readers refuse."""
    mission = load_mission(str(MISSIONS / "rigling_moses_section_v.yaml"))
    names = ["transmitter.acceleration.x.margin", "timing.linear.margin", "transmitter.acceleration.x.margin"]
    found = Asked(mission, grid(mission, collection__aperture_time=[1.0]), columns=names, today=DAY).checked()
    assert [one.name for one in found.columns if one.name.endswith("margin")] == names[:2]


def test_a_key_that_makes_no_mission_whatever_its_value_is_refused() -> None:
    """A map of 16 471 errors came of an azimuth beside a position."""
    mission = load_mission(str(MISSIONS / "uav_pair_l_band.yaml"))
    cases = grid(mission, platforms__receiver__azimuth=np.linspace(0, 6, 7))
    with pytest.raises(QuestionError, match=r"no value of it makes a mission: .* mixes position with azimuth"):
        Asked(mission, cases, today=DAY)


def test_a_fixed_platform_has_no_direction_to_fly_in() -> None:
    """A speed that varies needs `motion_azimuth`: arrays flew the roof of an example along x."""
    mission = load_mission(str(MISSIONS / "one_stationary_spotlight.yaml"))
    cases = grid(mission, platforms__receiver__speed=[0.0, 30.0])
    whole = swept(mission, cases)
    assert list(whole["status"])[1] == "error"
    assert "motion_azimuth" in whole["reason"][1]
    assert_as_checked(mission, cases, whole)


class TestWords:
    """Keys that have words: the cases of each word are those of the file with it."""

    @staticmethod
    def as_checked(name: str, texts: list[str], columns: tuple[str, ...] = (), jobs: int = 1) -> tuple[Any, int]:
        """Every case of a sweep held to a check of the mission that has its words and numbers."""
        mission = load_mission(str(mission_file(name)))
        cases = cases_of(tree_of(mission), texts)
        whole = swept(mission, cases, columns, jobs=jobs)
        for place in range(cases.count):
            values = {key: one[0] for key, one in cases.values(place, place + 1).items()}
            changes = [
                SetValue(
                    one.key, values[one.key] if one.unit == "" else f"{float(values[one.key])!r} {one.dimension.si}"
                )
                for one in cases.varied
            ]
            try:
                case = parse_mission(mission.data, mission.file, changes=changes)
            except MissionError as error:
                assert whole["status"][place] == "error"
                assert whole["reason"][place] == f"{error.faults[0].key}: {error.faults[0].problem}"
                continue
            found = check_mission(case, DAY)
            stands = standing(found, None, breaking("fail"))
            assert (whole["status"][place], whole["worst_row"][place]) == (found.status, stands.row or ""), values
            assert whole["utilization"][place] == pytest.approx(stands.utilization, rel=NEAR)
            assert whole["reason"][place] == ""
            rows = {row.id: row for row in found.rows}
            for name in columns:
                row_id, _, field = name.rpartition(".")
                want = getattr(rows[row_id], field) if row_id in rows else None
                assert whole[name][place] == pytest.approx(math.nan if want is None else want, rel=NEAR, nan_ok=True)
        return whole

    def test_models_and_rules_are_held_by_arrays(self) -> None:
        texts = ["allocation.model=published,full,strictest", "allocation.combine=each,rss"]
        texts.append("collection.aperture_time=0.5:3s:6")
        whole = self.as_checked("one_stationary_spotlight", texts)
        assert len(set(zip(whole["status"], whole["worst_row"], strict=True))) > 2

    def test_parts_of_the_catalogue(self) -> None:
        """A row that only one part has is a column without a value for the other."""
        texts = ["platforms.receiver.motion_error.sensor.0=stim300,adis16405", "collection.aperture_time=1,3s"]
        mission = load_mission(str(UAV_FREE_RUNNING))
        known = {row.id for row in check_mission(mission, DAY).rows}
        columns = tuple(f"{row}.utilization" for row in sorted(known) if ".imu" in row or "random" in row)
        assert columns
        self.as_checked("uav_free_running", texts, columns)

    def test_a_row_of_one_word_alone_is_a_column(self) -> None:
        """Without a part the mission has no row of inertial sensors."""
        mission = load_mission(str(MISSIONS / "rigling_moses_section_v.yaml"))
        key = "platforms.receiver.motion_error.sensor"
        cases = cases_of(tree_of(mission), [f"{key}=stim300,mosaic-x5-rtk"])
        asked = Asked(mission, cases, columns=["receiver.imu.accelerometer_bias.utilization"], today=DAY)
        (part,) = asked.checked().parts
        use = part.values["receiver.imu.accelerometer_bias.utilization"]
        assert np.isfinite(use).tolist() == [True, False]

    def test_words_and_numbers_in_a_sample(self) -> None:
        mission = load_mission(str(MISSIONS / "one_stationary_spotlight.yaml"))
        texts = ["collection.aperture_time=0.5:3s", "allocation.model=published,full"]
        cases = sample(tree_of(mission), texts, "latin:20:1")
        whole = swept(mission, cases)
        for model in ("published", "full"):
            some = whole["allocation.model"] == model
            number = tuple(one for one in cases.varied if one.unit)
            alone = swept(mission, Cases(number, (cases.columns[0][some],)), model=model)
            assert alone["utilization"].tolist() == whole["utilization"][some].tolist()

    def test_processes_find_the_same(self, monkeypatch) -> None:
        monkeypatch.setattr("bisar_budget.questions.asked._MIN_SHARED_PART_COUNT", 2)
        texts = ["platforms.receiver.motion_error.sensor.0=stim300,imx5", "collection.aperture_time=1:3s:75"]
        mission = load_mission(str(UAV_FREE_RUNNING))
        cases = cases_of(tree_of(mission), texts)
        column = ["receiver.imu.attitude.islr_db"]  # which arrays do not hold
        alone, shared = swept(mission, cases, column), swept(mission, cases, column, jobs=2)
        for name, values in alone.items():
            np.testing.assert_array_equal(values, shared[name])

    def test_words_that_make_a_mission_with_some_numbers(self) -> None:
        """A band of more than twice its centre is none, by whatever model."""
        texts = ["allocation.model=published,full", "radar.bandwidth=0.3,21GHz"]
        whole = self.as_checked("rigling_moses_section_v", texts)
        assert (whole["status"] == "error").tolist() == [False, True, False, True]

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("motion_error.sensor=stim30", "sensor=stim30: is no part of the catalogue.*'stim300'"),
            ("motion_error.sensor=[stim300", r"sensor=\[stim300: is not valid YAML"),
            ("orbit.tle=[a, b],[c, d]", "tle: no value of it makes a mission: .* mixes orbit"),
            ("motion_error.frame=track,ric", "frame=ric: the ric frame needs the scene's latitude"),
            (
                "trajectory.file=tandem_x.yaml,tandem_l.yaml",
                "file: no value of it makes a mission: .* mixes trajectory",
            ),
            ("trajectory.file=a.csv,b.csv", "file=a.csv: a.csv cannot be read"),
        ],
    )
    def test_what_no_number_can_mend_is_said_at_once(self, text: str, said: str) -> None:
        mission = load_mission(str(MISSIONS / "rigling_moses_section_v.yaml"))
        with pytest.raises(QuestionError, match=said):
            Asked(mission, cases_of(tree_of(mission), [f"platforms.receiver.{text}"]), today=DAY)

    def test_a_word_that_lacks_another_key_says_which(self) -> None:
        mission = load_mission(str(MISSIONS / "rigling_moses_section_v.yaml"))
        with pytest.raises(QuestionError, match=r"method=linear: synchronization\.\w+ is missing"):
            Asked(mission, cases_of(tree_of(mission), ["synchronization.method=linear"]), today=DAY)

    def test_a_model_of_the_command_leaves_none_to_compare(self) -> None:
        mission = load_mission(str(MISSIONS / "rigling_moses_section_v.yaml"))
        cases = cases_of(tree_of(mission), ["allocation.model=full"])
        with pytest.raises(QuestionError, match="--model stands in for it"):
            Asked(mission, cases, model="full", today=DAY)


def test_the_sigma_beside_a_bias_and_the_limit_beside_a_confidence_vary() -> None:
    position, location = "platforms.transmitter.motion_error.position", "requirements.location_error"
    given = parse_mission(
        mission_text(
            allocation={"combine": "rss", "model": "full"},
            platforms__transmitter__motion_error__position={"sigma": "50 cm", "bias": ["0 m", "0 m", "40 cm"]},
            platforms__receiver__motion_error__position="1 m",
            requirements__location_error={"limit": "20 m", "confidence": "95 %"},
        ),
        "m.yaml",
    )
    cases = cases_of(tree_of(given), [f"{position}=10 cm,3 m", f"{location}=5 m,20 m"])
    assert [one.key for one in cases.varied] == [f"{position}.sigma", f"{location}.limit"]
    uses = swept(given, cases)["utilization"]
    assert len(set(uses)) == 4
    for use, (sigma, limit) in zip(uses, [(a, b) for a in ("10 cm", "3 m") for b in ("5 m", "20 m")], strict=True):
        changes = [SetValue(f"{position}.sigma", sigma), SetValue(f"{location}.limit", limit)]
        findings = check_mission(parse_mission(given.data, "m.yaml", changes=changes), DAY)
        assert use == pytest.approx(max(one.utilization or 0.0 for one in findings.requirements), rel=NEAR)


def test_a_confidence_varies_beside_a_limit_alone() -> None:
    key = "requirements.location_error.confidence"
    rules = {"combine": "rss", "model": "full"}
    errors = {"platforms__receiver__motion_error__position": "1 m"}
    given = parse_mission(mission_text(requirements__location_error="20 m", allocation=rules, **errors), "m.yaml")
    column = "mission.location_error.utilization"
    low, high = swept(given, cases_of(tree_of(given), [f"{key}=80 %,99 %"]), [column])[column]
    assert low < high
