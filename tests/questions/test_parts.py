"""Comparing parts of the catalogue for a mission, and images of what solving found."""

import json
import math
from collections.abc import Callable
from datetime import date
from pathlib import Path

import pytest

import bisar_budget as bb
from bisar_budget.budget.check import check_mission
from bisar_budget.faults import SetValue
from bisar_budget.findings.images import Verdict
from bisar_budget.findings.solution import Comparison
from bisar_budget.mission.changes import read_changes
from bisar_budget.mission.load import load_mission
from bisar_budget.mission.parts import entries, folders
from bisar_budget.mission.quantities import QuestionError
from bisar_budget.verifier import spread_cases
from tests.conftest import ROOT, UAV_FREE_RUNNING, mission_text

MISSIONS = ROOT / "specs" / "missions"
SECTION_V = str(MISSIONS / "rigling_moses_section_v.yaml")
UAV = str(UAV_FREE_RUNNING)
OCXO = str(MISSIONS / "ocxo_free_running.yaml")
SENSOR, OSCILLATOR = "platforms.receiver.motion_error.sensor", "platforms.receiver.oscillator.sensor"
DAY = date(2026, 1, 1)


def ask(key: str, *texts: str, file: str, **more: object) -> Comparison:
    mission = load_mission(file, changes=read_changes(texts))
    return bb.solve(mission, key, date=DAY, **more).found  # type: ignore[arg-type]


def of_kind(*kinds: str) -> set[str]:
    return {entry.id for entry in entries(folders("")) if entry.part.kind in kinds}


def test_every_part_of_the_right_kinds_is_compared() -> None:
    assert {part.id for part in ask(SENSOR, file=UAV).parts} == of_kind("imu", "gnss")
    assert {part.id for part in ask(OSCILLATOR, file=OCXO).parts} == of_kind("oscillator")
    # An IMU alone: a GNSS in its place would leave its errors undeclared.
    assert {part.id for part in ask(SENSOR, f"{SENSOR}=stim300", file=UAV).parts} == of_kind("imu")
    # None at all: each part alone.
    alone = ask(SENSOR, file=SECTION_V, row="receiver.position.x")
    assert {part.id for part in alone.parts} == of_kind("imu", "gnss")


@pytest.mark.parametrize(("key", "file"), [(SENSOR, UAV), (OSCILLATOR, OCXO)])
def test_each_stands_as_a_check_with_it_says(key: str, file: str) -> None:
    found = ask(key, file=file)
    for part in found.parts:
        value = part.id
        if key == SENSOR:
            value = f"[{part.id}, mosaic-x5-rtk]" if part.kind == "imu" else f"[stim300, {part.id}]"
        checked = check_mission(load_mission(file, changes=[SetValue(key, value)]), DAY)
        assert part.standing.status == checked.status
        assert part.complies == (checked.status not in ("fail", "not_evaluated"))
        row = next(row for row in checked.rows if row.id == part.standing.row)
        assert part.standing.utilization == pytest.approx(row.utilization, rel=1e-9)
        judged = [row for row in checked.rows if row.status not in ("info", "not_declared", "waived")]
        if not part.complies:
            judged = [row for row in judged if row.status in ("fail", "not_evaluated")]
        assert row.utilization == pytest.approx(max(row.utilization or 0 for row in judged), rel=1e-9)


def test_the_smallest_margin_and_the_nearest_miss_stand_first() -> None:
    found = ask(OSCILLATOR, file=OCXO)
    flags = [part.complies for part in found.parts]
    assert flags == sorted(flags, reverse=True)
    uses = [part.standing.utilization or 0 for part in found.parts]
    count = len(found.complying)
    assert 0 < count < len(uses)
    assert uses[:count] == sorted(uses[:count], reverse=True)
    assert uses[count:] == sorted(uses[count:])
    assert uses[0] <= 1 < uses[count]
    # What uses the same stands by its own rows.
    clock = "timing_error={constant: 1 ns, linear: 1e-12}"
    found = ask(OSCILLATOR, "requirements.location_error=2 m", clock, file=OCXO)
    tied = [part.own_utilization for part in found.complying if part.standing.row == "mission.location_error"]
    assert len(tied) > 2
    assert tied == sorted(tied, reverse=True)


def test_the_part_of_the_file_is_marked_and_its_figures_are_said() -> None:
    found = ask(SENSOR, file=UAV)
    assert {part.id for part in found.parts if part.is_given} == {"stim300", "mosaic-x5-rtk"}
    assert found.kept == ("stim300", "mosaic-x5-rtk")
    assert found.overridden == ("attitude",)
    by_id = {part.id: part for part in found.parts}
    assert by_id["zed-x20p-rtk"].figures == ("position",)
    assert by_id["zed-x20p-rtk"].silent_on == ("velocity",)
    assert by_id["stim300"].silent_on == ("accelerometer_scale_factor",)
    assert by_id["stim300-r9"].silent_on == ()


def test_a_unit_without_a_scale_factor_is_whole_in_an_aided_navigation() -> None:
    """The scale factor only widens the prior of a bias: a mark at 12 of 15 units said nothing."""
    key = "platforms.receiver.motion_error.navigation.imu.sensor"
    found = ask(key, file=str(MISSIONS / "uav_stim300.yaml"))
    assert {part.silent_on for part in found.parts} == {()}
    assert {"stim300", "stim300-r9"} <= {part.id for part in found.complying}


def test_figures_with_a_source_each_are_said(tmp_path: Path) -> None:
    """The frequency of an oscillator was left out: its source is not the one of the noise."""
    (tmp_path / "own.yaml").write_text(
        "kind: oscillator\nname: Own\nsource: {frequency: plate, phase_noise: sheet}\nfrequency: 10 MHz\n"
        "phase_noise: {1 Hz: -95 dBc/Hz, 10 Hz: -125 dBc/Hz}\n",
        encoding="utf-8",
    )
    (tmp_path / "m.yaml").write_text(Path(OCXO).read_text(encoding="utf-8"), encoding="utf-8")
    found = ask(OSCILLATOR, f"{OSCILLATOR}=own.yaml", file=str(tmp_path / "m.yaml"))
    (own,) = (part for part in found.parts if part.is_given)
    assert own.figures == ("frequency", "phase_noise")


def test_a_frequency_alone_is_no_part() -> None:
    """The mask is the file's own: every part would show it at another frequency."""
    mask = "phase_noise: {1 Hz: -95 dBc/Hz, 10 Hz: -125 dBc/Hz, 1 kHz: -150 dBc/Hz}"
    own = f"platforms.receiver.oscillator={{sensor: gps-3500, {mask}, aging: 1e-10 /day}}"
    with pytest.raises(QuestionError, match="no more than a frequency would be taken of a part"):
        ask(OSCILLATOR, own, file=OCXO)


def test_a_figure_that_the_file_states_is_of_no_part(tmp_path: Path) -> None:
    """It was said to be the given part's, and all others to be silent on it."""
    (tmp_path / "own.yaml").write_text(
        "kind: oscillator\nname: Own\nsource: sheet\nfrequency: 10 MHz\nacceleration_sensitivity: 1e-9 /g\n"
        "phase_noise: {1 Hz: -95 dBc/Hz, 10 Hz: -125 dBc/Hz}\n",
        encoding="utf-8",
    )
    text = (MISSIONS / "uav_vibrating_ocxo.yaml").read_text(encoding="utf-8")
    (tmp_path / "m.yaml").write_text(text, encoding="utf-8")  # its receiver states the figure
    found = ask(OSCILLATOR, f"{OSCILLATOR}=own.yaml", file=str(tmp_path / "m.yaml"))
    assert found.overridden == ("acceleration_sensitivity",)
    assert {figure for part in found.parts for figure in (*part.figures, *part.silent_on)} == {
        "frequency", "phase_noise", "power_law", "allan_deviation",
    }  # fmt: skip


def test_a_form_of_noise_that_the_file_does_not_state_is_not_said_to_be_stated(tmp_path: Path) -> None:
    """All forms of the parts were: the file's one form stands in place of whichever form a part has."""
    (tmp_path / "own.yaml").write_text(
        "kind: oscillator\nname: Own\nsource: sheet\nfrequency: 10 MHz\nacceleration_sensitivity: 1e-9 /g\n"
        "phase_noise: {1 Hz: -95 dBc/Hz, 10 Hz: -125 dBc/Hz}\n",
        encoding="utf-8",
    )
    (tmp_path / "m.yaml").write_text(Path(OCXO).read_text(encoding="utf-8"), encoding="utf-8")
    noise = "platforms.receiver.oscillator.power_law={h0: 1e-24}"
    found = ask(OSCILLATOR, f"{OSCILLATOR}=own.yaml", noise, file=str(tmp_path / "m.yaml"))
    assert found.overridden == ("power_law",)
    # Nothing or a frequency could be taken of the others: they are no answer.
    assert [part.id for part in found.parts if part.standing.status != "error"] == ["own.yaml"]
    reasons = {part.figures: part.reason.partition(" would")[0] for part in found.parts if part.id != "own.yaml"}
    assert reasons == {(): "nothing", ("frequency",): "no more than its frequency"}


def test_parts_of_the_projects_own_folders_and_files_are_compared(tmp_path: Path, run: Callable) -> None:
    """A folder that the settings name, and a file that the mission names; its velocity error is the mission's."""
    (tmp_path / "pyproject.toml").write_text('[tool.bisar-budget]\nsensors = ["own"]\n', encoding="utf-8")
    (tmp_path / "own").mkdir()
    part = "kind: gnss\nname: {name}\nsource: made up\nvelocity: {velocity}\n"
    (tmp_path / "own" / "good.yaml").write_text(part.format(name="Good", velocity="10 mm/s"), encoding="utf-8")
    (tmp_path / "own" / "bad.yaml").write_text(part.format(name="Bad", velocity="10 m/s"), encoding="utf-8")
    (tmp_path / "here.yaml").write_text(part.format(name="Here", velocity="20 mm/s"), encoding="utf-8")
    file = tmp_path / "m.yaml"
    file.write_text(mission_text(platforms__receiver__motion_error={"sensor": "here.yaml"}), encoding="utf-8")
    found = {part.id: part for part in ask(SENSOR, file=str(file)).parts}
    assert {"good", "bad", "here.yaml"} <= found.keys()
    assert found["here.yaml"].is_given
    assert found["good"].complies
    assert found["here.yaml"].standing.utilization == pytest.approx(2 * found["good"].standing.utilization)
    assert found["bad"].standing.utilization == pytest.approx(1000 * found["good"].standing.utilization)
    (tmp_path / "own" / "bad.yaml").write_text("kind: gnss\n", encoding="utf-8")
    done = run("solve", str(file), "--for", SENSOR)
    assert done.exit_code == 2
    assert "bad.yaml" in done.stderr
    assert "name: is missing" in done.stderr


def test_no_part_is_good_enough(run: Callable) -> None:
    """The transmitter alone breaks the requirement."""
    file = str(MISSIONS / "rigling_moses_section_v.yaml")
    done = run("solve", file, "--for", SENSOR)
    assert done.exit_code == 1
    assert done.stdout.startswith(f"{SENSOR}: the mission complies with none of ")
    # Its own row does comply with some.
    done = run("solve", file, "--for", SENSOR, "--row", "receiver.velocity.x")
    assert done.exit_code == 0
    assert "row receiver.velocity.x complies with" in " ".join(done.stdout.split())
    assert "receiver.velocity.x is not declared with it" in " ".join(done.stdout.split())


def test_text_and_json(run: Callable) -> None:
    done = run("solve", OCXO, "--for", OSCILLATOR)
    assert done.exit_code == 0
    lines = done.stdout.splitlines()
    assert lines[0] == f"{OSCILLATOR}: the mission complies with 6 of 17 parts"
    assert any(line.startswith("ettus-gpsdo-ocxo *") and "FAIL" in line for line in lines)
    (mission,) = json.loads(run("solve", OCXO, "--for", OSCILLATOR, "--format", "json").stdout)["missions"]
    assert (mission["status"], mission["value"], mission["crossings"]) == ("some", None, [])
    first = mission["parts"][0]
    assert mission["text"] == first["id"]
    assert mission["binding_row"] == first["row"]
    assert first["complies"]
    # The text is what `--set` takes.
    assert run("check", OCXO, "--set", f"{OSCILLATOR}={first['id']}").exit_code == 0
    numeric = json.loads(run("solve", SECTION_V, "--for", "collection.aperture_time", "--format", "json").stdout)
    assert mission.keys() == numeric["missions"][0].keys()
    assert numeric["missions"][0]["parts"] is None


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([UAV, "--for", SENSOR, "--between", "1..2"], f"--between: {SENSOR} names parts of the catalogue"),
        ([UAV, "--for", SENSOR, "--scale"], f"--scale: {SENSOR} names parts of the catalogue"),
        ([UAV, "--for", "platforms.relay.oscillator.sensor"], "'relay' is not a known key"),
        ([UAV, "--for", SENSOR, "--row", "receiver.velocity.q"], "no row has this id; `bisar-budget check"),
        ([UAV, "--for", SENSOR, "--set", f"{SENSOR}=stim30"], "is no part of the catalogue"),
        ([OCXO, "--for", OSCILLATOR, "--set", "radar.bandwidth=1 m"], "must be a frequency"),
    ],
)
def test_what_cannot_be_asked_is_wrong_usage(run: Callable, arguments: list[str], said: str) -> None:
    done = run("solve", *arguments)
    assert done.exit_code == 2
    assert said in " ".join(done.stderr.split())
    assert not done.stdout


def test_where_the_file_states_all_nothing_of_a_part_would_be_taken() -> None:
    own = "{frequency: 10 MHz, allan_deviation: {1 s: 1e-11}}"
    with pytest.raises(QuestionError, match="the file states every figure itself"):
        ask(OSCILLATOR, f"platforms.receiver.oscillator={own}", file=OCXO)
    with pytest.raises(QuestionError, match="is a section; accepted: one of its keys"):
        ask("platforms.receiver.motion_error", file=UAV)


# Images of the solution


def test_the_solution_is_imaged(run: Callable) -> None:
    """The bound row's limit is its share of the phase, and so much the image has."""
    options = ("--for", "collection.aperture_time", "--verify")
    done = run("solve", SECTION_V, *options)
    assert done.exit_code == 0
    assert "transmitter.acceleration.x at 1.7480574 s: confirmed, its limit is 0.393 rad" in " ".join(
        done.stdout.split()
    )
    (mission,) = json.loads(run("solve", SECTION_V, *options, "--format", "json").stdout)["missions"]
    verified = mission["verified"]
    assert (verified["row"], verified["at"], verified["verdict"]) == (
        mission["binding_row"],
        mission["text"],
        "confirmed",
    )
    assert verified["image"]["budget_rad"] == pytest.approx(math.pi / 8)
    # Half a pixel of a fit: verify confirms within 5 %.
    assert verified["image"]["measured_qpe_rad"] == pytest.approx(math.pi / 8, rel=0.05)
    (mission,) = json.loads(run("solve", SECTION_V, *options[:2], "--format", "json").stdout)["missions"]
    assert mission["verified"] is None


def test_a_factor_and_a_part_are_imaged(run: Callable, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spread_cases, "_MAX_ISLR_DRAWS", 512)  # draws; what is asked is that there is an image
    done = run(
        "solve",
        SECTION_V,
        "--for",
        "platforms.transmitter.motion_error",
        "--scale",
        "--between",
        "0.01..1",
        "--verify",
    )
    assert "transmitter.acceleration.x at factor 0.08488" in " ".join(done.stdout.split())
    assert "confirmed" in done.stdout
    done = run("solve", OCXO, "--for", OSCILLATOR, "--verify")
    assert "Imaged: receiver.islr at wenzel-100mhz: " in " ".join(done.stdout.split())


def test_where_nothing_complies_nothing_is_imaged(run: Callable) -> None:
    options = ("--for", "collection.aperture_time", "--between", "3..5 s", "--verify", "--format", "json")
    done = run("solve", SECTION_V, *options)
    assert done.exit_code == 1
    assert json.loads(done.stdout)["missions"][0]["verified"] is None


def test_a_limit_that_the_image_refutes_exits_with_1(run: Callable, monkeypatch: pytest.MonkeyPatch) -> None:
    from bisar_budget.questions import imaged

    def refuted(mission: object, only: str, progress: object) -> object:
        row = Verdict(id=only, model="published", boundary_error=1.0, unit="m/s^2", verdict="optimistic")
        return type("Verified", (), {"rows": (row,)})

    monkeypatch.setattr(imaged, "verify_mission", refuted)
    done = run("solve", SECTION_V, "--for", "collection.aperture_time", "--verify")
    assert done.exit_code == 1
    assert "transmitter.acceleration.x at 1.7480574 s: optimistic" in " ".join(done.stdout.split())


def test_a_row_without_an_image_says_so(run: Callable, monkeypatch: pytest.MonkeyPatch) -> None:
    from bisar_budget.questions import imaged

    monkeypatch.setattr(imaged, "rows_to_verify", lambda mission, only: [])
    done = run("solve", SECTION_V, "--for", "collection.aperture_time", "--verify")
    assert done.exit_code == 0
    assert "no verdict, its limit is not one that an image could show" in " ".join(done.stdout.split())
