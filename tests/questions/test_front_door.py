"""`import bisar_budget as bb`: answers are those of the commands, values go in as people have them."""

import csv
import io
import json
import math
import re
import subprocess
import sys
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tqdm

import bisar_budget as bb
from bisar_budget.questions import asked as engine
from bisar_budget.questions import progress, results
from bisar_budget.questions.missions import Spaced
from bisar_budget.questions.passes import angle_of
from bisar_budget.questions.table import Table
from docs._ext.blocks import blocks
from tests.conftest import COMPLIES, ROOT, UAV_FREE_RUNNING, mission_text
from tests.questions.user_script import report

MISSIONS = ROOT / "specs" / "missions"
SECTION_V, TANDEM_X = (MISSIONS / f"{name}.yaml" for name in ("rigling_moses_section_v", "tandem_x"))
TIME = "collection.aperture_time"
AZIMUTH = "platforms.receiver.azimuth"
DAY = "2026-11-21"


@pytest.fixture(scope="module")
def mission() -> bb.Mission:
    return bb.load(SECTION_V)


def printed(run: Any, *arguments: object) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(run(*arguments, "--format", "json").stdout)
    return document


# ---------------------------------------------------------------------- a check
@pytest.mark.parametrize("path", sorted(MISSIONS.glob("*.yaml")), ids=lambda path: path.stem)
def test_a_check_is_what_the_command_writes(run: Any, path: Path) -> None:
    written = json.loads(run("check", path, "--format", "json").stdout)
    assert bb.check(bb.load(str(path))).to_dict() == written


@pytest.mark.parametrize("model", ["published", "full", "strictest"])
def test_a_model_and_a_day_are_what_the_options_are(run: Any, model: str) -> None:
    found = bb.check(bb.load(TANDEM_X), model=model, date=DAY).to_dict()
    written = printed(run, "check", TANDEM_X, "--model", model, "--date", DAY)
    ours, theirs = found["missions"][0], written["missions"][0]
    for one in (ours, theirs):
        one["overrides"] = [{**override, "origin": ""} for override in one["overrides"]]  # the caller, a command line
    assert found == written


def test_rows_and_requirements_by_name(mission: bb.Mission) -> None:
    result = bb.check(mission)
    assert (result.status, result.exit_code) == ("fail", 1)
    # Table II: 2q R λ / (2π |y| (T/2)²) of the paper's Section V.
    assert result["receiver.velocity.y"].allowable == pytest.approx(0.0417, rel=1e-3)
    assert result.requirements["quadratic_phase_error"].status == "fail"
    assert len(result) == len(list(result)) == len(result.findings.rows)
    with pytest.raises(
        KeyError, match=r"receiver\.velocity\.q: no row has this id.*Did you mean 'receiver\.velocity"
    ):
        result["receiver.velocity.q"]
    assert bb.check(bb.load(TANDEM_X)).exit_code == 0


def test_reports_have_the_format_of_their_suffix(mission: bb.Mission, run: Any, tmp_path: Path) -> None:
    result = bb.check(mission, date=DAY)
    for suffix in ("html", "md", "json", "csv", "xml", "sarif", "txt"):
        result.report(tmp_path / f"r.{suffix}")
        assert (tmp_path / f"r.{suffix}").stat().st_size > 200
    assert "</html>" in (tmp_path / "r.html").read_text()
    assert list((tmp_path / "r.assets").glob("*.svg"))
    with pytest.raises(ValueError, match=r"r\.docx: the suffix must be one of \.txt, \.json"):
        result.report(tmp_path / "r.docx")
    assert not (tmp_path / "r.docx").exists()


def test_a_file_that_cannot_be_used_says_what_the_command_says(run: Any, tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(mission_text(radar__bandwidth="3 GHzz", radar__carrier="1 GHz"))
    with pytest.raises(bb.MissionError) as caught:
        bb.load(path)
    assert str(caught.value).splitlines() == run("check", path).stderr.strip().splitlines()
    first = caught.value.faults[0]
    assert (first.key, first.line is not None, first.column is not None) == ("radar.bandwidth", True, True)
    assert first.message == "has the unknown unit 'GHzz'"
    assert first.file == str(path)
    with pytest.raises(bb.MissionError):
        bb.loads("schema_version: 1\n")


# ---------------------------------------------------------------------- values
@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        (TIME, "8 s", "8 s"),
        (TIME, 8, "8 s"),
        (TIME, 8.0, "8 s"),
        (TIME, np.float64(8), "8 s"),
        ("radar.center_frequency", 9.6e9, "9.6 GHz"),
        ("platforms.transmitter.motion_error.velocity", [0.001, 0.002, 0.003], "[1 mm/s, 2 mm/s, 3 mm/s]"),
        ("platforms.transmitter.motion_error.velocity", np.array([0.001, 0.002, 0.003]), "[1 mm/s, 2 mm/s, 3 mm/s]"),
        ("platforms.transmitter.motion_error.velocity", ["1 mm/s", 0.002, "3 mm/s"], "[1 mm/s, 2 mm/s, 3 mm/s]"),
        ("requirements.quadratic_phase_error", 0.5, "0.5 rad"),
        ("requirements.islr", -20, "-20 dB"),
        ("allocation.combine", "rss", "rss"),
        ("autofocus.n_pull", 2, "2"),
        ("name", "another", "another"),
    ],
)
def test_a_value_goes_in_as_text_number_or_list(run: Any, key: str, value: object, text: str) -> None:
    """What `--set` makes of the text."""
    changed = bb.load(SECTION_V).replace({key: value})
    ours = bb.check(changed).to_dict()["missions"][0]
    theirs = printed(run, "check", SECTION_V, "--set", f"{key}={text}")["missions"][0]
    for one in (ours, theirs):
        del one["set"], one["overrides"], one["warnings"]  # which have the text
    assert ours == theirs


def test_a_mission_is_replaced_and_stays(mission: bb.Mission) -> None:
    longer = mission.replace({TIME: "8 s"}).replace({TIME: "9 s", "platforms.receiver.azimuth": 0.6})
    assert (longer.collection.aperture_time, mission.collection.aperture_time) == (9.0, 6.0)
    assert [one.origin for one in bb.check(longer).findings.overrides] == ["the caller"] * 3
    with pytest.raises(bb.MissionError, match="aperture_tim"):
        mission.replace({"collection.aperture_tim": "8 s"})
    with pytest.raises(TypeError, match="object is no value of a mission"):
        mission.replace({TIME: object()})


class OfAstropy:
    """A quantity as astropy's `Quantity` does it: `to_value` of a unit."""

    unit = "ms"

    def __init__(self, seconds: Any) -> None:
        self.seconds = seconds

    def to_value(self, unit: object) -> Any:
        return {"s": self.seconds, "ms": 1000 * self.seconds}[str(unit)]


class OfPint:
    """A quantity as pint does it: a magnitude, `to` another unit."""

    def __init__(self, magnitude: Any, units: str) -> None:
        self.magnitude, self.units = magnitude, units

    def to(self, unit: str) -> "OfPint":
        assert (self.units, unit) == ("mm/s", "m/s")
        return OfPint(self.magnitude / 1000, unit)


def test_quantities_of_other_packages_go_in_by_what_they_do(mission: bb.Mission) -> None:
    assert mission.replace({TIME: OfAstropy(8.0)}).collection.aperture_time == 8.0
    error = mission.replace({"platforms.receiver.motion_error.velocity": OfPint(5.0, "mm/s")})
    assert error.platforms.receiver.motion_error.velocity == (0.005,) * 3
    swept = bb.sweep(mission, {TIME: OfAstropy(np.array([1.0, 2.0]))})
    assert swept[TIME].tolist() == [1.0, 2.0]
    assert bb.linspace(OfAstropy(1.0), OfAstropy(2.0), 3) == Spaced("1000.0 ms", "2000.0 ms", 3)


def test_real_quantities_of_astropy_and_pint(mission: bb.Mission) -> None:
    units = pytest.importorskip("astropy.units")
    assert mission.replace({TIME: 8000 * units.ms}).collection.aperture_time == 8.0
    assert bb.sweep(mission, {TIME: [1, 2] * units.s})[TIME].tolist() == [1.0, 2.0]


# ---------------------------------------------------------------------- sweeps
def table(text: str) -> dict[str, list[str]]:
    rows = list(csv.reader(io.StringIO("".join(line for line in text.splitlines(True) if line[0] != "#"))))
    return {name.partition(" [")[0]: list(column) for name, *column in zip(*rows, strict=True)}


@pytest.mark.parametrize(
    ("values", "texts"),
    [
        ({TIME: ("1 s", "5 s", 101)}, [f"{TIME}=1:5 s:101"]),
        ({TIME: ("500 ms", "5000 ms", 7)}, [f"{TIME}=500:5000 ms:7"]),
        ({TIME: ("1 s", "5 s", 5), "platforms.receiver.azimuth": ("0 deg", "90 deg", 4)},
         [f"{TIME}=1:5 s:5", "platforms.receiver.azimuth=0:90 deg:4"]),
        ({TIME: ["1 s", "2 s"], "allocation.combine": ["each", "rss"]},
         [f"{TIME}=1,2 s", "allocation.combine=each,rss"]),
        ({TIME: np.array([1.0, 2.5])}, [f"{TIME}=1,2.5 s"]),
        ({TIME: "1:5 s:9"}, [f"{TIME}=1:5 s:9"]),
    ],
)  # fmt: skip
def test_a_sweep_is_the_commands_to_the_last_bit(
    run: Any, mission: bb.Mission, values: dict[str, Any], texts: list[str]
) -> None:
    asked = {key: bb.linspace(*given) if isinstance(given, tuple) else given for key, given in values.items()}
    column = "receiver.velocity.y.allowable"
    ours = bb.sweep(mission, asked, columns=[column])
    theirs = table(run("sweep", SECTION_V, *(f"--vary={one}" for one in texts), "--column", column).stdout)
    assert list(ours.columns) == list(theirs)
    for name, cells in theirs.items():
        found = ours[name].tolist()
        assert [one if isinstance(one, str) else "" if one != one else repr(one) for one in found] == cells


def test_equal_ratios(mission: bb.Mission) -> None:
    assert bb.sweep(mission, {TIME: bb.geomspace("1 s", "4 s", 3)})[TIME].tolist() == [1.0, 2.0, 4.0]


def test_what_cannot_be_swept_is_said_at_once(mission: bb.Mission) -> None:
    with pytest.raises(bb.QuestionError, match="aperture_tim"):
        bb.sweep(mission, {"collection.aperture_tim": bb.linspace("1 s", "5 s", 3)})
    with pytest.raises(bb.QuestionError, match="the range is reversed"):
        bb.sweep(mission, {TIME: bb.linspace("5 s", "1 s", 3)})
    with pytest.raises(bb.QuestionError, match=r"no row has this id"):
        bb.sweep(mission, {TIME: bb.linspace("1 s", "5 s", 3)}, columns=["receiver.q.allowable"])
    swept = bb.sweep(mission, {TIME: [1.0, 2.0]})
    with pytest.raises(KeyError, match="no such column; accepted: "):
        swept["utilisation"]


def test_a_sweep_as_dataset_and_frame(mission: bb.Mission) -> None:
    swept = bb.sweep(mission, {TIME: bb.linspace("1 s", "5 s", 5), "radar.center_frequency": ["9 GHz", "10 GHz"]})
    data = swept.to_xarray()
    assert dict(data.sizes) == {TIME: 5, "radar.center_frequency": 2}
    assert data.utilization.attrs["units"] == "1"
    assert data[TIME].attrs["units"] == "s"
    assert data.utilization.values.ravel().tolist() == swept["utilization"].tolist()
    again = swept.to_xarray()  # parts are kept
    assert again.equals(data)


@pytest.mark.parametrize("chunks", [{}, {TIME: 3}, "auto"])
def test_a_dataset_of_dask_is_checked_when_it_computes(
    mission: bb.Mission, monkeypatch: pytest.MonkeyPatch, chunks: Any
) -> None:
    """To the last bit what is checked at once, in the sweep's own parts."""
    pytest.importorskip("dask")
    monkeypatch.setattr(engine, "_PART_CASES", 16)
    values = {TIME: bb.linspace("1 s", "5 s", 11), "radar.center_frequency": ["9 GHz", "10 GHz", "11 GHz"]}
    swept = bb.sweep(mission, values, columns=["receiver.velocity.y.allowable"])
    checked: list[int] = []
    part = Table.part
    monkeypatch.setattr(Table, "part", lambda self, *block: checked.append(block[0]) or part(self, *block))
    lazy = swept.to_xarray(chunks=chunks)
    assert not checked
    now = bb.sweep(mission, values, columns=["receiver.velocity.y.allowable"]).to_xarray()
    assert sorted(checked) == [0, 16, 32]
    assert lazy.compute().identical(now)
    assert sorted(checked) == [0, 0, 16, 16, 32, 32]
    paired = bb.sweep(mission, {TIME: [1.0, 2.0], AZIMUTH: ["20 deg", "40 deg"]}, paired=True)
    checked.clear()
    lazy = paired.to_xarray(chunks=chunks if chunks == "auto" else {})
    assert not checked  # the coordinates too are those that were given
    assert lazy.compute().identical(paired.to_xarray())


def test_without_dask(mission: bb.Mission, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "dask", None)
    with pytest.raises(ImportError, match="chunks need Dask: pip install dask"):
        bb.sweep(mission, {TIME: [1.0, 2.0]}).to_xarray(chunks={})


def test_a_frame_needs_pandas_or_polars(mission: bb.Mission, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(results, "find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r"a data frame needs pandas or polars: pip install pandas$"):
        bb.check(mission).to_dataframe()
    with pytest.raises(ImportError, match=r"a data frame needs polars: pip install polars$"):
        bb.check(mission).to_dataframe("polars")


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_rows_as_a_frame(mission: bb.Mission, library: str) -> None:
    pytest.importorskip(library)
    result = bb.check(mission)
    frame = result.to_dataframe(library)
    assert frame["id"].to_list() == list(result)
    place = frame["id"].to_list().index("receiver.velocity.y")
    assert frame["allowable"].to_list()[place] == result["receiver.velocity.y"].allowable
    swept = bb.sweep(mission, {TIME: bb.linspace("1 s", "5 s", 5)}).to_dataframe(library)
    assert swept[TIME].to_list() == [1, 2, 3, 4, 5]


# ---------------------------------------------------------------------- other questions
def test_answers_are_those_of_the_commands(run: Any, mission: bb.Mission) -> None:
    solved = bb.solve(mission, TIME, between=("0.2 s", "20 s"))
    assert solved.to_dict() == printed(run, "solve", SECTION_V, "--for", TIME, "--between", "0.2 s..20 s")
    # QPE grows with T²: 6 s times the root of π/8 over the 4.634 rad of Section V.
    assert solved.value == pytest.approx(1.748, abs=1e-3)
    assert bb.sensitivity(mission).to_dict() == printed(run, "sensitivity", SECTION_V)
    uav = bb.load(UAV_FREE_RUNNING)
    assert bb.allocate(uav).to_dict() == printed(run, "allocate", UAV_FREE_RUNNING)
    keys = ["platforms.receiver.motion_error.velocity"]
    assert bb.allocate(uav, keys, reserve=0.1).to_dict() == printed(
        run, "allocate", UAV_FREE_RUNNING, "--for", *keys, "--reserve", 10
    )
    drawn = bb.monte_carlo(bb.load(TANDEM_X), 5000).to_dict()
    assert drawn == printed(run, "check", TANDEM_X, "--monte-carlo", 5000)["missions"][0]["monte_carlo"]


def test_verdicts_of_images_and_an_image(run: Any, mission: bb.Mission) -> None:
    found = bb.verify(mission, "receiver.velocity.y", jobs=1)
    assert found.to_dict() == printed(run, "verify", SECTION_V, "--only", "receiver.velocity.y", "--jobs", 1)
    image = bb.simulate(mission)
    assert image.image.ndim == 2
    assert np.iscomplexobj(image.image)
    assert image.images.responses


def test_passes(run: Any) -> None:
    path = MISSIONS / "sentinel1_elements_besancon.yaml"
    found = bb.passes(path, "2021-03-19", days=2, date=DAY)
    written = printed(run, "passes", path, "--from", "2021-03-19", "--days", 2, "--date", DAY)
    ours = found.to_dict()
    for one in (ours, written):
        one["overrides"] = []
    assert ours == written
    assert [one.status for one in found] == [one["status"] for one in written["passes"]]
    asked = bb.passes(bb.load(path), date(2021, 3, 19), days=2, min_elevation=0.6)
    assert len(asked) < len(found)


# ---------------------------------------------------------------------- shown
@pytest.fixture(scope="module")
def answers(mission: bb.Mission) -> dict[str, Any]:
    return {
        "check": bb.check(mission),
        "sweep": bb.sweep(mission, {TIME: bb.linspace("1 s", "5 s", 21)}),
        "map": bb.sweep(mission, {TIME: bb.linspace("1 s", "5 s", 6), AZIMUTH: ["20 deg", "40 deg"]}),
        "table": bb.sweep(
            mission,
            {TIME: [1.0, 2.0], AZIMUTH: ["20 deg", "40 deg"], "radar.bandwidth": [1e8, 3e8]},
        ),
        "mission": mission,
        "solve": bb.solve(mission, TIME),
        "parts": bb.solve(bb.load(UAV_FREE_RUNNING), "platforms.receiver.motion_error.sensor"),
        "sensitivity": bb.sensitivity(mission),
        "allocate": bb.allocate(bb.load(UAV_FREE_RUNNING)),
        "monte_carlo": bb.monte_carlo(bb.load(TANDEM_X), 1000),
        "verify": bb.verify(mission, "receiver.velocity.y", jobs=1),
        "simulate": bb.simulate(mission),
        "passes": bb.passes(MISSIONS / "sentinel1_elements_besancon.yaml", "2021-03-19", days=1, date=DAY),
    }  # fmt: skip


def test_every_answer_prints_in_one_line_and_shows_itself(answers: dict[str, Any]) -> None:
    for name, answer in answers.items():
        assert "\n" not in repr(answer), name
        assert len(repr(answer)) < 200, name
        shown = answer._repr_html_()
        assert shown.count("<table") + shown.count("<dl") + shown.count("<svg") + shown.count("<img") >= 1, name
        assert shown.count("<div") == shown.count("</div>"), name
        assert "prefers-color-scheme" in shown or "currentColor" in shown or "<img" in shown, name


def test_rows_and_requirements_print_in_one_line(answers: dict[str, Any]) -> None:
    found = answers["check"]
    assert repr(found["receiver.velocity.y"]) == "<receiver.velocity.y: - of 0.0417101 m/s, not_declared>"
    assert repr(found.requirements["quadratic_phase_error"]).startswith("<quadratic_phase_error: ")


def test_the_surface_as_it_was_agreed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each line of it, on a satellite and a roof; the examples of the reference run when the docs are built."""
    (tmp_path / "mission.yaml").write_bytes(bb.load(MISSIONS / "sentinel1_elements_besancon.yaml").data)
    (tmp_path / "paths").symlink_to(MISSIONS / "paths")
    monkeypatch.chdir(tmp_path)
    mission = bb.load("mission.yaml")
    longer = mission.replace({"collection.aperture_time": "0.8 s"})
    assert longer.collection.aperture_time == 0.8
    result = bb.check(mission)
    assert (result.status in {"pass", "warn"}, result.exit_code) == (True, 0)
    assert result["receiver.velocity.y"].allowable > 0
    assert result.requirements["location_error"].status in {"pass", "warn"}
    assert result.to_dict()["format"] == "bisar-budget/check/1"
    assert len(result.to_dataframe()) == len(result)
    result.report("r.html")
    assert (tmp_path / "r.html").exists()
    table = bb.sweep(mission, {"collection.aperture_time": bb.linspace("0.2 s", "0.8 s", 5)})
    assert table.to_xarray().sizes["collection.aperture_time"] == len(table.to_dataframe()) == 5
    table.plot()
    assert bb.solve(mission, "collection.aperture_time", between=("0.2 s", "20 s")).value > 0.2
    assert bb.allocate(mission.replace({"allocation.combine": "rss"})).complies
    assert bb.sensitivity(mission).slopes
    assert len(bb.passes(mission, "2021-03-19", days=7)) > 10
    assert bb.monte_carlo(mission, 20000).probability > 0.9
    assert bb.verify(mission, "receiver.velocity.y").rows
    simulated = bb.simulate(mission)
    assert simulated.image.ndim == 2
    simulated.plot()
    simulated.plot(paper=True)


@pytest.mark.parametrize(("seconds", "is_shown"), [(0.9, False), (1.1, True)])
def test_work_that_takes_longer_than_a_second_has_a_bar(
    monkeypatch: pytest.MonkeyPatch, seconds: float, is_shown: bool
) -> None:
    monkeypatch.setattr(errors := io.StringIO(), "isatty", lambda: True)
    monkeypatch.setattr("sys.stderr", errors)
    times = iter((100.0, 100.0 + seconds))
    monkeypatch.setattr(progress, "monotonic", lambda: next(times))
    with progress.watched("Working") as told:
        told(1, 2)
    assert ("Working" in errors.getvalue()) == is_shown


def test_bars_of_the_caller_keep_their_lock_and_their_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """tqdm has both for all bars of a process: those of long work here took them away."""
    errors = io.StringIO()
    monkeypatch.setattr(errors, "isatty", lambda: True)
    monkeypatch.setattr("sys.stderr", errors)
    monkeypatch.setattr(progress, "_MIN_SHOWN_S", 0.0)
    known = (tqdm.tqdm.monitor_interval, tqdm.tqdm.get_lock())
    with progress.watched("Working") as told:
        told(1, 2)
        told(2, 2)
    assert "Working: 100%" in errors.getvalue()
    assert (tqdm.tqdm.monitor_interval, tqdm.tqdm.get_lock()) == known
    assert tqdm.tqdm.monitor_interval > 0


def test_a_users_script_runs() -> None:
    """It is also what mypy holds the types of the surface to, in strict mode."""
    said = report(str(SECTION_V)).splitlines()
    assert said[0].startswith("fail 1 transmitter.acceleration.x fail 0.039")
    assert "10 cases" in said[1]
    assert report(str(ROOT / "tests" / "acceptance" / "bad" / "bare_angle.yaml")).startswith(
        "17: platforms.receiver.azimuth"
    )


def test_every_name_has_an_example_in_the_reference() -> None:
    page = (ROOT / "docs" / "reference" / "python.md").read_text(encoding="utf-8")
    examples = "".join(text for language, text in blocks(page) if language in ("pycon", "python"))
    named = {name for name in bb.__all__ if name[0].islower()} | {"MissionError", "QuestionError"}
    assert {name for name in named if f"bb.{name}" not in examples} == set()


def test_a_report_has_what_was_asked_besides(tmp_path: Path) -> None:
    """Draws, a study and verdicts of images, as `check` writes them with the options of these names."""
    values = {TIME: ["1 s", "2 s"]}
    found = bb.check(bb.load(TANDEM_X), date=DAY, monte_carlo=1000, seed=3, sweep=values)
    assert found.findings.monte_carlo is not None
    assert found.findings.monte_carlo.draws == 1000
    found.report(tmp_path / "r.html")
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert "1,000 draws" in page
    assert "Trade study" in page
    with pytest.raises(bb.QuestionError, match="has one value"):
        bb.check(bb.load(TANDEM_X), sweep={TIME: ["1 s"]})
    several = {
        TIME: ["1 s", "2 s"],
        "radar.bandwidth": ["90 MHz", "100 MHz"],
        "radar.center_frequency": ["9 GHz", "9.5 GHz"],
    }
    with pytest.raises(bb.QuestionError, match="draws one key or two, and there are 3"):
        bb.check(bb.load(TANDEM_X), sweep=several)


def test_a_report_of_a_result_has_the_sheet_of_specifications(tmp_path: Path) -> None:
    specified = bb.load(TANDEM_X).replace({"allocation.specify": "{platforms.receiver.motion_error.velocity: 1}"})
    bb.check(specified).report(tmp_path / "r.html")
    assert "Specifications" in (tmp_path / "r.html").read_text(encoding="utf-8")


def test_cases_of_a_file(run: Any, tmp_path: Path, mission: bb.Mission) -> None:
    """As `sweep --cases`; what cannot be read has a line for each fault."""
    cases, written = tmp_path / "cases.csv", tmp_path / "t.csv"
    cases.write_text(f"{TIME} [s],{AZIMUTH} [deg]\n1,20\n2.5,40\n")
    assert run("sweep", SECTION_V, "--cases", cases, "-o", written, "--date", DAY).exit_code == 0
    found = bb.sweep(mission, cases, date=DAY)
    assert found["status"].tolist() == table(written.read_text())["status"]
    cases.write_text(f"{TIME} [s]\nx\n")
    with pytest.raises(bb.QuestionError, match=r"cases\.csv:2:1: "):
        bb.sweep(mission, cases)
    with pytest.raises(bb.QuestionError, match="cannot be read"):
        bb.sweep(mission, tmp_path / "none.csv")


def test_an_offer_is_held_to_specifications() -> None:
    asked = bb.load(UAV_FREE_RUNNING)
    found = bb.allocate(asked, offer=asked)
    assert found.offer is not None
    assert found.offer.file == str(UAV_FREE_RUNNING)
    assert found.to_dict()["missions"][0]["offer"]["status"] == found.offer.status


def test_images_of_no_row_are_a_question_that_cannot_be_asked(mission: bb.Mission) -> None:
    with pytest.raises(bb.QuestionError, match="no row with a limit matches"):
        bb.verify(mission, "receiver.nothing")


def test_a_name_of_the_file_is_text_in_a_notebook() -> None:
    named = bb.loads(mission_text(name="<script>alert(1)</script>", **COMPLIES))
    for answer in (named, bb.check(named), bb.solve(named, TIME)):
        assert "<script" not in answer._repr_html_()


def test_plots_are_saved(answers: dict[str, Any], tmp_path: Path) -> None:
    for name in ("sweep", "map", "sensitivity", "simulate", "passes"):
        drawn = answers[name].plot()
        assert "\n" not in repr(drawn)
        for suffix, begins in ((".svg", b"<"), (".png", b"\x89PNG"), (".pdf", b"%PDF")):
            drawn.save(tmp_path / f"{name}{suffix}")
            assert (tmp_path / f"{name}{suffix}").read_bytes().startswith(begins)
    with pytest.raises(ValueError, match=r"the suffix must be one of \.svg, \.png, \.pdf"):
        answers["sweep"].plot().save(tmp_path / "x.gif")
    with pytest.raises(bb.QuestionError):
        answers["table"].plot()


def test_attributes_are_those_of_what_was_found(answers: dict[str, Any]) -> None:
    assert answers["solve"].status == "crossing"
    assert "crossings" in dir(answers["solve"])
    with pytest.raises(AttributeError):
        answers["solve"].valu  # noqa: B018


# ---------------------------------------------------------------------- the package alone
def test_the_package_alone_imports_nothing() -> None:
    code = "import sys, bisar_budget; print(sorted({'numpy', 'yaml', 'click', 'sympy'} & set(sys.modules)))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert found.stdout.strip() == "[]"


def test_its_names_are_listed_and_others_are_none() -> None:
    assert {*bb.__all__} <= {*dir(bb)}
    with pytest.raises(AttributeError, match="has no attribute 'chek'"):
        bb.chek  # noqa: B018


def test_a_day_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    from bisar_budget.questions.outside import day_of

    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86399")
    assert day_of(None) == date(1970, 1, 1)
    assert day_of("2026-01-02") == day_of(date(2026, 1, 2)) == date(2026, 1, 2)
    with pytest.raises(ValueError, match="tomorrow"):
        day_of("tomorrow")


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda m: bb.sweep(m, {}), "no key varies"),
        (lambda m: bb.sweep(m, {}, paired=True), "no key varies"),
        (
            lambda m: bb.sweep(m, {TIME: [1.0]}, model="other"),
            "--model other: accepted: published",
        ),
        (lambda m: bb.solve(m, TIME, target="pass"), "--target pass: accepted: fail or warn"),
        (lambda m: bb.solve(m, TIME, model="other"), "--model other: "),
        (lambda m: bb.allocate(m, reserve=1.0), "reserve 1.0: accepted: a part from 0 to less than 1"),
        (lambda m: bb.allocate(m, reserve=-0.1), "reserve -0.1: "),
        (lambda m: bb.allocate(m, reserve="20 %"), "reserve '20 %': "),
        (lambda m: bb.allocate(m, {"timing_error.linear": 0.0}), "--for timing_error.linear: has the weight 0.0"),
        (lambda m: bb.passes(m, min_elevation="90 deg"), "--min-elevation 90 deg: must be less than 90 deg"),
        (lambda m: bb.passes(m, min_elevation="-1 deg"), "--min-elevation -1 deg: must be at least 0 deg"),
        (lambda m: bb.passes(m, squint="-90 deg"), "--squint -90 deg: must be greater than -90 deg"),
        (lambda m: bb.passes(m, squint="steep"), "--squint steep: must be an angle"),
        (lambda m: bb.passes(m, model="other"), "--model other: "),
    ],
)
def test_python_refuses_what_the_command_refuses(ask: Callable[[bb.Mission], object], said: str) -> None:
    """An empty sweep and an unknown model were errors of indexing; the others were answered."""
    with pytest.raises(bb.QuestionError, match=re.escape(said)):
        ask(bb.load(TANDEM_X))


def test_python_takes_what_is_within_by_a_little() -> None:
    mission = bb.load(TANDEM_X)
    for reserve in (0.0, 0.99):
        assert bb.allocate(mission, "timing_error.linear", reserve=reserve).found.reserve == reserve
    assert bb.allocate(mission, {"timing_error.linear": np.int64(1)}).found.specifications
    assert angle_of("--min-elevation", "0 deg", 0.0) == 0
    assert math.degrees(angle_of("--min-elevation", "89.9 deg", 0.0)) == pytest.approx(89.9)
    assert math.degrees(angle_of("--squint", "-89.9 deg", -90.0)) == pytest.approx(-89.9)


def test_a_day_that_is_none_is_refused_by_its_words() -> None:
    with pytest.raises(ValueError, match=re.escape("no day (got '31.12.2026'); accepted: 2026-12-31")):
        bb.check(bb.load(TANDEM_X), date="31.12.2026")


def test_one_key_to_specify_and_one_column_are_words() -> None:
    """Their letters were taken for keys."""
    mission = bb.load(TANDEM_X)
    (one,) = bb.allocate(mission, "timing_error.linear").found.specifications
    assert one.key == "timing_error.linear"
    column = "receiver.velocity.x.allowable"
    assert column in bb.sweep(mission, {TIME: [1.0]}, columns=column).columns
