"""What each number does: against derivatives of the emitted formulas, and by hand."""

import cmath
import json
import math
import re
from collections.abc import Callable
from contextlib import nullcontext
from datetime import date
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

import bisar_budget as bb
from bisar_budget import evaluators
from bisar_budget.budget.check import check_mission
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.faults import SetValue
from bisar_budget.findings.slopes import Sensitivity, Slope
from bisar_budget.mission.changes import read_changes
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import names_parts
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.questions import sensitivity as asking
from bisar_budget.questions.progress import watched_checks
from bisar_budget.report.drawing import tornado
from tests.conftest import ROOT, UAV_FREE_RUNNING, mission_file, mission_text
from tests.drawing import Drawing

MISSIONS = ROOT / "specs" / "missions"
SECTION_V = str(MISSIONS / "rigling_moses_section_v.yaml")
DAY = date(2026, 1, 1)
# Central differences over 1 %: a power law of exponent p is wrong by (p - 1)(p - 2)/6 of 1e-4, 1e-4 for p = -1,
# 2e-4 for p = 4; of a sum of powers that cancel in part, a few times that of the sum.
TRUNCATION = 3e-4


def ask(*texts: str, file: str = SECTION_V, **more: object) -> Sensitivity:
    mission = load_mission(file, changes=read_changes(texts))
    return bb.sensitivity(mission, date=DAY, **more).found  # type: ignore[arg-type]


def slopes(found: Sensitivity) -> dict[str, Slope]:
    return {slope.key: slope for slope in found.slopes}


def allowable(row_id: str) -> float:
    """Limit of a row of Section V, as a check says it; with it a use can be declared."""
    (found,) = [row.allowable for row in check_mission(load_mission(SECTION_V), DAY).rows if row.id == row_id]
    assert found is not None
    return found


def utilization(values: dict[str, complex], declared: float, kind: int, axis: int) -> complex:
    """QPE by Table II over π/8; the evaluator is plain arithmetic and takes complex numbers."""
    x, y, z = (values[f"platforms.transmitter.position.{index}"] for index in range(3))
    v = [values[f"platforms.transmitter.velocity.{index}"] for index in range(3)]
    slant_range = cmath.sqrt(x * x + y * y + z * z)
    wavelength = SPEED_OF_LIGHT_MPS / values["radar.center_frequency"]
    rows = evaluators.published_motion(x, y, z, *v, slant_range, wavelength, values["collection.aperture_time"])
    phase = declared * rows[3 * kind + axis][2]
    limit = values["requirements.quadratic_phase_error"] / 2
    return (phase if phase.real > 0 else -phase) / limit


@pytest.mark.parametrize(
    ("kind", "axis", "declared"),
    [("velocity", 0, 0.2), ("velocity", 1, 0.05), ("acceleration", 0, 0.005), ("acceleration", 2, 0.01)],
)
def test_slopes_are_derivatives_of_the_emitted_formulas(kind: str, axis: int, declared: float) -> None:
    """Complex step: exact to rounding, without a difference."""
    error = [0.0, 0.0, 0.0]
    error[axis] = declared
    said = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}[kind]
    mission = mission_text(
        platforms__transmitter__position=["30 km", "4 km", "6 km"],
        platforms__transmitter__velocity=["20 m/s", "150 m/s", "-5 m/s"],
        platforms__transmitter__motion_error={kind: [f"{part} {said}" for part in error]},
        requirements__quadratic_phase_error="45 deg",
    )
    found = bb.sensitivity(parse_mission(mission, "m.yaml"), date=DAY).found
    assert found.worst_row == f"transmitter.{kind}.{'xyz'[axis]}"
    values: dict[str, complex] = {
        "radar.center_frequency": 10e9,
        "collection.aperture_time": 6,
        "requirements.quadratic_phase_error": math.pi / 4,
        **{f"platforms.transmitter.position.{index}": one for index, one in enumerate((30e3, 4e3, 6e3))},
        **{f"platforms.transmitter.velocity.{index}": one for index, one in enumerate((20, 150, -5))},
    }
    number = ("position", "velocity", "acceleration").index(kind)
    at = utilization(values, declared, number, axis)
    assert found.utilization == pytest.approx(at.real, rel=1e-12)
    by_key = slopes(found)
    compared = 0
    for key, value in values.items():
        step = 1e-30 * abs(value)
        derivative = utilization({**values, key: value + 1j * step}, declared, number, axis).imag / step
        expected = 0.01 * value.real * derivative if isinstance(value, complex) else 0.01 * value * derivative
        if key in by_key:
            assert by_key[key].change == pytest.approx(expected, rel=TRUNCATION, abs=1e-5 * found.utilization), key
            compared += 1
        else:
            assert key in found.unchanging
            assert abs(expected) <= 1e-9 * found.utilization
    assert compared >= 5
    assert by_key[f"platforms.transmitter.motion_error.{kind}.{axis}"].change == pytest.approx(
        0.01 * found.utilization, rel=1e-9
    )


def test_a_direction_counts_per_degree() -> None:
    """Section V's receiver: QPE of an acceleration along x is that of its cosines, cos θ cos φ."""
    found = ask("platforms.receiver.motion_error.acceleration=[1 m/s^2, 0, 0]")
    receiver = load_mission(SECTION_V).platforms.receiver
    assert found.worst_row == "receiver.acceleration.x"
    azimuth, elevation = receiver.azimuth, receiver.elevation
    assert azimuth is not None
    assert elevation is not None
    by_key = slopes(found)
    # Central differences over 0.25 degrees: sin(h)/h is 3e-6 below 1.
    for key, slope in (("azimuth", -math.tan(azimuth)), ("elevation", -math.tan(elevation))):
        one = by_key[f"platforms.receiver.{key}"]
        assert one.per_text == "1 deg"
        assert one.change == pytest.approx(found.utilization * slope * math.radians(1), rel=4e-6)


@pytest.mark.parametrize(
    ("name", "is_small"), [("astra_drone", True), ("sentinel1_elements_besancon", False), ("drones_same_gnss", True)]
)
def test_exact_ranges_leave_no_noise_in_a_slope(name: str, is_small: bool) -> None:
    """A limit enters inversely, an error and the coverage factor in proportion: allowables are right to 1e-5."""
    found = ask(file=str(MISSIONS / f"{name}.yaml"))
    by_key = slopes(found)
    held = by_key[f"requirements.{found.requirement}"]
    assert held.change == pytest.approx(
        -0.01 * found.utilization, rel=1e-3 if name != "sentinel1_elements_besancon" else 0.02
    )
    if "allocation.coverage_factor" in by_key:
        assert by_key["allocation.coverage_factor"].change == pytest.approx(0.01 * found.utilization, rel=1e-3)


def test_the_largest_effect_stands_first_and_of_a_row_if_asked() -> None:
    file = str(MISSIONS / "uav_pair_l_band.yaml")
    for row in (None, "receiver.acceleration.y"):
        found = ask(file=file, row=row)
        effects = [abs(slope.even_effect) for slope in found.slopes]
        assert effects == sorted(effects, reverse=True)
        assert all((slope.row_change is None) == (row is None) for slope in found.slopes)
    assert found.row_utilization == next(
        row.utilization for row in check_mission(load_mission(file), DAY).rows if row.id == found.row
    )


def test_where_the_worst_row_changes_within_the_step_it_is_said() -> None:
    """Two errors at the same use: more of one makes it the worst, less of it leaves the other."""
    texts = (
        f"platforms.receiver.motion_error.velocity=[{0.5 * allowable('receiver.velocity.x')!r} m/s, 0, 0]",
        f"platforms.transmitter.motion_error.velocity=[0, {0.5001 * allowable('transmitter.velocity.y')!r} m/s, 0]",
        "platforms.transmitter.motion_error.acceleration=0",
    )
    by_key = slopes(ask(*texts))
    mixed = by_key["platforms.transmitter.motion_error.velocity.1"]
    assert mixed.is_mixed
    assert (mixed.row_below, mixed.row_above) == ("receiver.velocity.x", "transmitter.velocity.y")
    assert mixed.change == pytest.approx((0.5001 * 1.01 - 0.5) / 2, rel=1e-6)
    assert not by_key["requirements.quadratic_phase_error"].is_mixed


def test_a_share_takes_from_the_others() -> None:
    """They sum to 1; 1 % more for one leaves 1 - 1.01 s of 1 - s to each of the others."""
    file = str(UAV_FREE_RUNNING)
    found = ask(file=file)
    by_key = slopes(found)
    assert found.worst_row == "receiver.quadratic_phase_error"
    own = (1 / 0.99 - 1 / 1.01) / 2  # of 0.7, which is the receiver's
    assert by_key["allocation.split.receiver"].change == pytest.approx(-own * found.utilization, rel=1e-9)
    others = (1 / (1 - 0.003 / 0.7) - 1 / (1 + 0.003 / 0.7)) / 2  # of the transmitter's 0.3
    assert by_key["allocation.split.transmitter"].change == pytest.approx(others * found.utilization, rel=1e-9)


def test_levels_count_per_decibel() -> None:
    """A mask raised by 1 dB at a point raises the noise there by 26 % in power; all points together by 1 dB."""
    oscillator = {"frequency": "10 GHz", "phase_noise": {"1 Hz": "-30 dBc/Hz", "100 Hz": "-60 dBc/Hz"}}
    text = mission_text(
        platforms__receiver__oscillator=oscillator,
        requirements__islr="-20 dB",
        allocation__model="full",
    )
    found = bb.sensitivity(parse_mission(text, "m.yaml"), date=DAY).found
    by_key = slopes(found)
    masks = [by_key[f"platforms.receiver.oscillator.phase_noise.{at}"] for at in ("1 Hz", "100 Hz")]
    assert {one.per_text for one in masks} == {"1 dB"}
    # Powers and amplitudes alike: use goes with 10^(dB/20) or 10^(dB/10); 0.25 dB is bent by 5e-4 at most.
    total = sum(one.change for one in masks) / found.utilization
    assert min(abs(total - math.log(10) / part) for part in (20, 10)) <= 1e-3 * total


def test_numbers_are_ranked_by_the_change_that_uses_up_the_margin() -> None:
    """A decibel was ranked beside 1 %: of power it is 23 times as much, so a mask stood above the aperture time."""
    found = ask(file=str(MISSIONS / "ocxo_free_running.yaml"))
    keys = [slope.key for slope in found.slopes]
    level, time = "platforms.receiver.oscillator.phase_noise.1 Hz", "collection.aperture_time"
    by_key = slopes(found)
    assert by_key[level].change > 10 * by_key[time].change
    assert keys.index(time) < keys.index(level)
    assert by_key[level].measure == pytest.approx(math.log(10) / 10)


@pytest.mark.parametrize(
    "key",
    [
        "collection.aperture_time",
        "radar.center_frequency",
        "platforms.transmitter.motion_error.acceleration.0",
    ],
)
def test_the_change_that_uses_up_the_margin_is_where_the_limit_is(key: str) -> None:
    """Section V goes with powers of its numbers: at the value that is said the utilization is 1."""
    found = ask()
    (slope,) = [one for one in found.slopes if one.key == key]
    change = found.to_limit(slope)
    assert change is not None
    at_limit = ask(f"{key}={slope.value + change!r} {slope.unit}")
    # The power is a difference over 1 %, wrong by TRUNCATION, and taken over a factor of twelve.
    assert at_limit.utilization == pytest.approx(1, rel=TRUNCATION * math.log(found.utilization) * 2)


def test_a_covariance_counts_by_its_sigmas() -> None:
    by_key = slopes(ask(file=str(MISSIONS / "drones_same_gnss.yaml")))
    assert by_key["platforms.transmitter.motion_error.covariance"].text == "its sigmas"


class TestParts:
    """Figures of parts of the catalogue are numbers like those of the file."""

    @pytest.mark.parametrize(
        "name",
        [
            *("uav_stim300", "uav_free_running", "ocxo_free_running", "ocxo_direct_path", "tandem_x_synchronized"),
            "sentinel1_fixed_receiver",
        ],
    )
    def test_a_file_that_states_them_is_the_same_mission(self, name: str) -> None:
        mission = load_mission(str(mission_file(name)))
        taken = mission.taken
        assert bool(taken) == names_parts(mission)
        changes = [SetValue(one.key, json.dumps(one.value)) for one in taken]
        stated = parse_mission(mission.data, mission.file, changes=changes)
        assert not stated.taken
        was, now = (check_mission(one, DAY) for one in (mission, stated))
        assert [(row.id, row.declared, row.allowable, row.status) for row in was.rows] == [
            (row.id, row.declared, row.allowable, row.status) for row in now.rows
        ]

    def test_a_slope_is_that_of_parts_with_other_figures(self, tmp_path: Path) -> None:
        """Two parts whose files differ by 1 % to both sides of the catalogue's."""
        text = UAV_FREE_RUNNING.read_text(encoding="utf-8")
        part = (ROOT / "specs" / "sensors" / "stim300.yaml").read_text(encoding="utf-8")
        uses = []
        for factor in (0.99, 1.01):
            walk = f"velocity_random_walk: {0.024 * factor} m/s/sqrt(h)"
            changed = part.replace("velocity_random_walk: 0.024 m/s/sqrt(h)", walk)
            assert changed != part
            (tmp_path / "own.yaml").write_text(changed, encoding="utf-8")
            file = tmp_path / "m.yaml"
            file.write_text(text.replace("[stim300,", "[own.yaml,"), encoding="utf-8")
            found = check_mission(load_mission(str(file)), DAY)
            uses.append(
                max(row.utilization or 0.0 for row in found.rows if row.id == "receiver.quadratic_phase_error")
            )
        slope = slopes(ask(file=str(UAV_FREE_RUNNING)))["platforms.receiver.motion_error.imu.velocity_random_walk"]
        assert slope.change == pytest.approx((uses[1] - uses[0]) / 2, rel=1e-6)
        assert (slope.part, slope.text, slope.per_text) == ("stim300", "0.024 m/s/sqrt(h)", "1 %")

    def test_what_the_file_states_itself_is_of_no_part(self) -> None:
        found = slopes(ask(file=str(UAV_FREE_RUNNING)))
        assert found["platforms.receiver.motion_error.imu.attitude"].part == ""
        key = "platforms.receiver.motion_error.velocity"
        assert found[key].part == "mosaic-x5-rtk"
        assert slopes(ask(f"{key}=2 cm/s", file=str(UAV_FREE_RUNNING)))[key].part == ""

    def test_every_point_of_a_mask_counts_per_decibel(self) -> None:
        found = slopes(ask(file=str(MISSIONS / "ocxo_free_running.yaml")))
        point = found["platforms.receiver.oscillator.phase_noise.1 Hz"]
        assert (point.part, point.per_text) == ("ettus-gpsdo-ocxo", "1 dB")
        assert point.change > 0

    def test_the_table_and_json_name_the_part(self, run: Callable) -> None:
        file = str(UAV_FREE_RUNNING)
        assert "0.03 m/s (mosaic-x5-rtk)" in run("sensitivity", file).stdout
        (mission,) = json.loads(run("sensitivity", file, "--format", "json").stdout)["missions"]
        parts = {number["key"]: number["part"] for number in mission["numbers"]}
        assert parts["platforms.receiver.motion_error.velocity"] == "mosaic-x5-rtk"
        assert parts["collection.aperture_time"] is None
        assert mission["set"] == []  # nobody set the figures


class TestProgress:
    """What takes long is seen to go on, by who watches."""

    def test_all_numbers_are_told(self, monkeypatch: pytest.MonkeyPatch) -> None:
        told: list[tuple[int, int]] = []
        watched = nullcontext(lambda done, total: told.append((done, total)))
        monkeypatch.setattr(asking, "watched_checks", lambda name: watched)
        found = ask()
        assert told == sorted(told)
        assert told[-1] == (told[0][1],) * 2
        assert told[-1][0] >= 2 * (len(found.slopes) + len(found.unchanging))

    @pytest.mark.parametrize(("is_watched", "moment"), [(True, 0.0), (True, 60.0), (False, 0.0)])
    def test_a_bar_is_for_a_terminal_and_for_what_takes_long(
        self, is_watched: bool, moment: float, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        errors = StringIO()
        monkeypatch.setattr(errors, "isatty", lambda: is_watched)
        monkeypatch.setattr("sys.stderr", errors)
        monkeypatch.setattr("bisar_budget.questions.progress._MIN_SHOWN_S", moment)
        with watched_checks("Section V") as progress:
            for done in range(1, 4):
                progress(done, 3)
        assert ("Checking values" in errors.getvalue()) == (is_watched and moment == 0)
        assert ("100%" in errors.getvalue()) == (is_watched and moment == 0)


def test_what_is_no_number_is_listed() -> None:
    found = ask("allocation.combine=each", "platforms.transmitter.motion_error.acceleration=[5 mm/s^2, 0, 0]")
    skipped = {one.key: one.reason for one in found.skipped}
    assert skipped["schema_version"] == "is a whole number"
    assert skipped["allocation.combine"] == "is a choice"
    assert skipped["platforms.transmitter.motion_error.acceleration.1"] == "is 0: there is no part of it"
    assert not {slope.key for slope in found.slopes} & skipped.keys()
    assert "radar.bandwidth" in found.unchanging


def test_at_the_end_of_what_is_accepted_the_difference_is_one_sided() -> None:
    """A requirement of a full turn: there is no more of it."""
    found = ask("requirements.quadratic_phase_error=360 deg")
    one = slopes(found)["requirements.quadratic_phase_error"]
    assert one.difference == "backward"
    # Second order: of an inverse power the error is that of its third derivative, 2 h^2.
    assert one.change == pytest.approx(-0.01 * found.utilization, rel=3e-4)


def test_balanced_shares_say_what_an_error_costs_the_others() -> None:
    """Of two errors of equal weight, doubling one takes the other's share from 1/2 to 1/3: 3/2 of its use."""
    texts = (
        "allocation.split=balanced",
        "platforms.transmitter.motion_error.acceleration=0",
        *(
            f"platforms.{name}.motion_error.velocity=[0, {0.4 * allowable(f'{name}.velocity.y')!r} m/s, 0]"
            for name in ("transmitter", "receiver")
        ),
    )
    found = ask(*texts)
    assert found.is_balanced
    first, second = found.relaxed
    assert first.key == "platforms.transmitter.motion_error.velocity"
    assert first.shares_before == pytest.approx((0.5, 0.5))
    assert first.shares_after == pytest.approx((2 / 3, 1 / 3))
    assert first.receiver == ("receiver.velocity.y", pytest.approx(0.4), pytest.approx(0.6))
    assert first.transmitter is None or first.transmitter[1:] == (0, 0)
    assert second.transmitter == ("transmitter.velocity.y", pytest.approx(0.4), pytest.approx(0.6))


def test_the_table_of_shares_is_shown_for_balanced_missions_alone(run: Callable) -> None:
    file = str(MISSIONS / "drones_same_gnss.yaml")
    balanced = run("sensitivity", file, "--set", "allocation.split=balanced")
    assert "Shares are balanced. Cost of doubling an error for the other errors:" in balanced.stdout
    assert "66.2/33.8" in balanced.stdout
    assert "balanced" not in run("sensitivity", file).stdout


def test_text(run: Callable) -> None:
    done = run("sensitivity", SECTION_V)
    assert done.exit_code == 0
    first, second, *_ = done.stdout.splitlines()
    assert first == "worst utilization 1178 %: transmitter.acceleration.x (quadratic phase error)"
    assert second.startswith(SECTION_V)
    assert max(map(len, done.stdout.splitlines())) <= 80 or len(SECTION_V) > 60
    said = [line.split() for line in done.stdout.splitlines()]
    assert ["collection.aperture_time", "6", "s", "-70.9", "%", "1", "%", "+23.6"] in said
    assert ["requirements.quadratic_phase_error", "45", "deg", "x", "11.8", "1", "%", "-11.8"] in said
    assert "Left out: 8 keys (a whole number, 0, a choice)." in done.stdout


def test_json(run: Callable) -> None:
    document = json.loads(
        run("sensitivity", SECTION_V, "--format", "json", "--row", "transmitter.acceleration.x").stdout
    )
    assert document["format"] == "bisar-budget/sensitivity/1"
    (mission,) = document["missions"]
    assert mission["worst_row"] == mission["row"] == "transmitter.acceleration.x"
    first = mission["numbers"][0]
    assert (first["key"], first["unit"], first["per"], first["value"]) == ("collection.aperture_time", "s", "1 %", 6)
    assert first["row_change"] == first["utilization_change"]
    assert first["to_limit"] == pytest.approx(6 * (mission["utilization"] ** -0.5 - 1), rel=1e-9)
    # QPE goes with the square of T.
    assert first["utilization_change"] == pytest.approx(0.02 * mission["utilization"], rel=1e-9)
    assert mission["relaxed"] is None


@pytest.mark.parametrize("suffix", ["svg", "png"])
def test_a_plot_is_a_file_of_its_kind_and_the_same_each_time(run: Callable, tmp_path: Path, suffix: str) -> None:
    files = [tmp_path / f"{name}.{suffix}" for name in "ab"]
    for file in files:
        assert run("sensitivity", SECTION_V, "--plot", file).exit_code == 0
    first, second = (file.read_bytes() for file in files)
    assert first == second
    assert first.startswith(b"\x89PNG" if suffix == "png" else b"<svg")


def test_the_bars_are_the_slopes() -> None:
    """A larger number to the side of its slope, strong; a smaller one to the other, pale; in percentage points."""
    found = ask()
    drawing = Drawing(tornado.tornado(found))
    labels = drawing.texts[3:]
    assert labels[:2] == ["aperture time = 6 s ± 1 %", "collection.aperture_time"]
    numbers = {text: drawing.place(text)[0] for text in labels if re.fullmatch(r"−?[\d.]+", text)}
    values = [float(text.replace("−", "-")) for text in numbers]
    scale, zero = np.polyfit(values, list(numbers.values()), 1)
    for style, part in (("", 1), (" pale", -1)):
        changes = [100 * part * slope.change for slope in found.shown]
        for tone, side in (("worse", 1), ("better", -1)):
            want = [change for change in changes if (change > 0) == (side > 0)]
            bars = [drawing.box(path) for path in drawing.paths(tone + style)]
            bars = bars if style else bars[:-1]  # the last one is in the legend
            ends = [right if side > 0 else left for left, _, right, _ in bars]
            assert [(end - zero) / scale for end in ends] == pytest.approx(want, abs=0.01 / scale)
            starts = [left if side > 0 else right for left, _, right, _ in bars]
            assert starts == pytest.approx([zero] * len(starts), abs=0.01)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--row", "transmitter.aceleration.x"], "--all` lists them. Did you mean 'transmitter.acceleration.x'?"),
        (["--row", "receiver.velocity.x"], "is not declared: nothing is judged there"),
        (["--plot", "a.gif"], "a.gif: the suffix must be one of .svg, .png, .pdf"),
        (["--plot", "a.svg", str(MISSIONS / "tandem_x.yaml")], "--plot draws one mission."),
        (["--set", "radar.bandwith=1GHz"], "is not a known key"),
    ],
)
def test_what_cannot_be_asked_is_wrong_usage(run: Callable, arguments: list[str], said: str) -> None:
    done = run("sensitivity", SECTION_V, *arguments)
    assert done.exit_code == 2
    assert said in done.stderr
    assert not done.stdout


def test_a_mission_without_errors_has_nothing_to_follow(run: Callable, tmp_path: Path) -> None:
    file = tmp_path / "m.yaml"
    file.write_text(mission_text(), encoding="utf-8")
    done = run("sensitivity", str(file))
    assert done.exit_code == 2
    assert "declares no error: nothing decides whether it complies" in done.stderr
    with pytest.raises(QuestionError, match="declares no error"):
        bb.sensitivity(load_mission(str(file)), date=DAY)


def test_options_stay_with_the_mission_and_are_said(run: Callable) -> None:
    done = run("sensitivity", SECTION_V, "--set", "collection.aperture_time=1.2s")
    assert "--set collection.aperture_time=1.2s" in " ".join(done.stdout.split())
    mission = load_mission(SECTION_V, changes=[SetValue("collection.aperture_time", "1.2s")])
    assert bb.sensitivity(mission, date=DAY).utilization == pytest.approx(11.781 / 25, rel=1e-4)
