"""`check --sweep`: the report has the cases of `sweep`, drawn where they are, and nothing that its page forbids."""

import csv
import json
import re
import shlex
from datetime import date
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from bisar_budget.findings.mission import MissionFindings
from bisar_budget.questions.checks import with_studies
from bisar_budget.report.drawing.trades import level_lines
from tests.conftest import ROOT
from tests.drawing import Drawing
from tests.page import read_page

SECTION_V = "specs/missions/rigling_moses_section_v.yaml"
SPOTLIGHT = "specs/missions/one_stationary_spotlight.yaml"
UAV = "tests/missions/uav_free_running.yaml"
TIME, AZIMUTH = "collection.aperture_time", "platforms.receiver.azimuth"
SENSOR = "platforms.receiver.motion_error.sensor.0"


@pytest.fixture(autouse=True)
def _in_the_checkout(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


def reported(
    run, tmp_path: Path, mission: str, *sweeps: str, suffix: str = ".html", more: tuple[str, ...] = ()
) -> str:
    """The report of a check with a sweep."""
    file = tmp_path / f"r{suffix}"
    asked = [part for text in sweeps for part in ("--sweep", text)]
    found = run("check", mission, "--report", str(file), *asked, *more, "--exit-zero")
    assert found.exit_code == 0, found.output
    return file.read_text(encoding="utf-8")


def drawing(run, tmp_path: Path, mission: str, *sweeps: str) -> Drawing:
    """The drawing beside a Markdown report."""
    reported(run, tmp_path, mission, *sweeps, suffix=".md")
    return Drawing((tmp_path / "r.assets" / "1-study.svg").read_bytes())


def test_the_section_says_what_was_asked_and_what_was_found(run, tmp_path: Path) -> None:
    """By hand: the utilization is 11.78 (T / 6 s)²; it warns above 80 %, from 1.563 s, and fails above 1.748 s."""
    page = read_page(reported(run, tmp_path, SECTION_V, f"{TIME}=1:2s:11"))
    (section,) = [one for one in page.all("section") if one.attributes.get("id") == "m1-study"]
    said = section.text
    assert f"Which values of {TIME}, 11 values from 1 s to 2 s, comply?" in said
    assert "11 cases: 8 comply (72.7 %), 3 break a requirement." in said
    rows = [[cell.text for cell in row.all("th", "td")] for row in section.all("tr")][1:]
    assert [row[:3] for row in rows] == [
        ["1 s to 1.5 s", "pass", "transmitter.acceleration.x" + "quadratic phase error"],
        ["1.6 s to 1.7 s", "warning", "transmitter.acceleration.x" + "quadratic phase error"],
        ["1.8 s to 2 s", "fail", "transmitter.acceleration.x" + "quadratic phase error"],
    ]
    assert rows[0][3] == "32.7 % to 73.6 %"
    assert rows[2][3] == "106 % to 131 %"
    assert any(link.attributes.get("href") == "#m1-study" for link in page.all("a"))
    assert f"--sweep{TIME}=1:2s:11command line" in page.text.replace("\n", "")


@pytest.mark.parametrize(
    ("mission", "sweeps", "more"),
    [
        (SECTION_V, (f"{TIME}=1:6s:11",), ("--set", "radar.bandwidth=150 MHz")),
        (SPOTLIGHT, (f"{AZIMUTH}=0:180deg:13", f"{TIME}=1:3s:5"), ("--model", "full")),
        (UAV, (f"{SENSOR}=stim300,mti-g",), ()),
    ],
)
def test_its_command_gives_the_same_cases(run, tmp_path: Path, mission, sweeps, more) -> None:
    text = reported(run, tmp_path, mission, *sweeps, more=more)
    section = next(one for one in read_page(text).all("section") if one.attributes.get("id") == "m1-study")
    (command,) = [one.text for one in section.all("code")]
    words = shlex.split(command)
    assert words[0] == "bisar-budget"
    words = [str(tmp_path / word) if word.startswith("study.") else word for word in words[1:]]
    assert run(*words).exit_code == 0
    lines = (tmp_path / "study.csv").read_text(encoding="utf-8").splitlines()
    cases = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    complying = sum(case["status"] not in ("fail", "not_evaluated", "error") for case in cases)
    assert f"{len(cases)} cases: {complying} comply" in section.text
    for row in {case["worst_row"] for case in cases} - {""}:
        assert row in section.text


def test_curves_are_where_their_numbers_are(run, tmp_path: Path) -> None:
    """The curve crosses the limit at 1.748 s, within the curvature of steps of 0.05 s."""
    svg = drawing(run, tmp_path, SECTION_V, f"{TIME}=1:2s:21")
    curve = svg.line("row0")
    (left, limit), (right, same) = svg.line("limit")
    assert limit == same
    assert (curve[0][0], curve[-1][0]) == (left, right)
    (below, above) = next((a, b) for a, b in pairwise(curve) if a[1] >= limit > b[1])
    x = below[0] + (below[1] - limit) / (below[1] - above[1]) * (above[0] - below[0])
    assert 1 + (x - left) / (right - left) == pytest.approx(1.7481, abs=1e-3)
    # The status changes half way between the last value that complies and the next.
    (fail,) = svg.boxes("is-fail")
    assert 1 + (fail[0] - left) / (right - left) == pytest.approx(1.725, abs=1e-3)
    assert fail[2] == right


def test_a_map_has_each_case_in_its_place(run, tmp_path: Path) -> None:
    """The share of a status in the area is that in the cases, those at the rim with half of their cell."""
    svg = drawing(run, tmp_path, SPOTLIGHT, f"{AZIMUTH}=0:180deg:13", f"{TIME}=1:3s:5")
    table = tmp_path / "t.csv"
    run("sweep", SPOTLIGHT, "--vary", f"{AZIMUTH}=0:180deg:13", "--vary", f"{TIME}=1:3s:5", "-o", str(table))
    lines = [line for line in table.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    status = np.array([case["status"] for case in csv.DictReader(lines)]).reshape(13, 5)
    weights = np.outer([0.5, *[1] * 11, 0.5], [0.5, 1, 1, 1, 0.5]) / 48
    frame = svg.line("frame")
    area = (max(x for x, _ in frame) - min(x for x, _ in frame)) * (
        max(y for _, y in frame) - min(y for _, y in frame)
    )
    assert len(np.unique(status)) > 2
    for name in np.unique(status):
        drawn = sum((right - left) * (bottom - top) for left, top, right, bottom in svg.boxes(f"is-{name}"))
        assert drawn / area == pytest.approx(weights[status == name].sum(), rel=1e-3), name
    # More aperture time is further up, and fails.
    assert min(box[1] for box in svg.boxes("is-fail")) < min(box[1] for box in svg.boxes("is-pass"))


def test_words_have_bars(run, tmp_path: Path) -> None:
    mission = tmp_path / "m.yaml"  # without the location, which nothing judges beside errors of sensors
    text = (ROOT / UAV).read_text(encoding="utf-8")
    mission.write_text(re.sub(r"(?m)^ +location_error:.*\n", "", text), encoding="utf-8")
    svg = drawing(run, tmp_path, str(mission), f"{SENSOR}=stim300,adis16405,adis16488")
    texts = svg.texts
    assert [text for text in texts if re.fullmatch("stim300|adis.*", text)] == ["stim300", "adis16405", "adis16488"]
    limit = svg.lines("limit")[0][0][0]
    ends = {name: svg.boxes(f"bar is-{name}")[0][2] for name in ("pass", "warn", "fail")}
    assert ends["pass"] < ends["warn"] < limit < ends["fail"]
    assert {"131 %", "this mission"} <= set(texts)


class TestLines:
    """Where a grid of numbers is 0."""

    def test_a_circle(self) -> None:
        """Linear between points: wrong by an eighth of the square of a step at most, times a curvature of 2."""
        x, y = np.linspace(-1.5, 1.5, 61), np.linspace(-1.4, 1.6, 61)
        found = level_lines(x[:, None] ** 2 + y[None, :] ** 2 - 1, x, y)
        radii = [np.hypot(*point) for line in found for point in line]
        assert radii == pytest.approx([1.0] * len(radii), abs=0.05**2 / 4)
        length = sum(np.hypot(u - x, v - y) for (x, y), (u, v) in found)
        assert length == pytest.approx(2 * np.pi, rel=1e-2)

    @pytest.mark.parametrize(("middle", "joined"), [(3.0, True), (0.2, False)])
    def test_a_saddle(self, middle: float, joined: bool) -> None:
        """High corners at 0, 0 and 1, 1 hang together if the mean of all is above 0."""
        levels = np.array([[middle, -1.0], [-1.0, middle]])
        lines = level_lines(levels, np.array([0.0, 1]), np.array([0.0, 1]))
        assert len(lines) == 2
        # Lines cut off the corners that stand alone: (1, 0) and (0, 1), or (0, 0) and (1, 1).
        sums = sorted(round((x + u) / 2 + (y + v) / 2, 6) for (x, y), (u, v) in lines)
        assert (sums == [1.0, 1.0]) == joined

    def test_no_line_where_there_is_no_number(self) -> None:
        levels = np.array([[1.0, 1.0, 1.0], [-1.0, np.nan, -1.0], [-1.0, -1.0, -1.0]])
        assert level_lines(levels, np.arange(3.0), np.arange(3.0)) == []


def test_the_page_loads_nothing_and_has_the_same_bytes(run, tmp_path: Path) -> None:
    sweeps = (f"{AZIMUTH}=0:180deg:13", f"{TIME}=1:3s:5")
    first = reported(run, tmp_path, SPOTLIGHT, *sweeps)
    assert first == reported(run, tmp_path, SPOTLIGHT, *sweeps)
    without = reported(run, tmp_path, SPOTLIGHT)
    policy = re.compile(r"<meta http-equiv=\"Content-Security-Policy\"[^>]*>")
    assert policy.findall(first) == policy.findall(without) != []
    assert "m1-study" not in without
    page = read_page(first)
    assert not list(page.all("script", "link", "iframe", "object"))
    ids = [one.attributes["id"] for one in page.all() if "id" in one.attributes]
    assert len(ids) == len(set(ids))
    assert not re.search(r"(?:src|href)=\"(?!#|data:)", first)


def test_markdown_and_json(run, tmp_path: Path) -> None:
    text = reported(
        run, tmp_path, SECTION_V, f"{TIME}=1:2s:11", suffix=".md", more=("--report", str(tmp_path / "r.json"))
    )
    assert "### Trade study" in text
    assert "![Trade study: collection.aperture" in text.replace("\\_", "_")
    assert "](r.assets/1-study.svg)" in text
    assert (tmp_path / "r.assets" / "1-study.svg").is_file()
    (mission,) = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))["missions"]
    assert mission["sweep"] == {
        "vary": [f"{TIME}=1:2s:11"],
        "cases": 11,
        "comply": 8,
        "waived": 0,
        "waived_by": [],
        "not_evaluated": 0,
        "without_mission": 0,
    }
    assert "sweep" not in json.loads(run("check", SECTION_V, "--format", "json").stdout)["missions"][0]
    whole = run("check", SECTION_V, "--format", "markdown", "--sweep", f"{TIME}=1:2s:11").stdout
    assert "11 cases: 8 comply" in whole
    assert "| 1 s to 1.5 s | pass |" in whole
    assert "study.svg)" not in whole  # nothing can stand beside it


def test_what_is_not_evaluated_does_not_comply(run, tmp_path: Path) -> None:
    """A mission that declares nothing breaks nothing, and nobody looked: that is no compliance."""
    mission = tmp_path / "m.yaml"
    text = (ROOT / SECTION_V).read_text(encoding="utf-8")
    mission.write_text(re.sub(r"(?m)^ +motion_error:.*\n(?: {6,}.*\n)*", "", text), encoding="utf-8")
    page = reported(run, tmp_path, str(mission), f"{TIME}=1:2s:11")
    assert "11 cases: 0 comply (0 %), 11 not evaluated." in read_page(page).text
    swept = run("sweep", str(mission), "--vary", f"{TIME}=1:2s:11", "-o", str(tmp_path / "t.csv"))
    assert "11 cases, 0 comply (0 %), 11 not evaluated\n" in swept.stderr


def test_several_missions_have_one_each(run, tmp_path: Path) -> None:
    broken = tmp_path / "broken.yaml"
    broken.write_text("schema_version: 1\n", encoding="utf-8")
    file = tmp_path / "r.html"
    found = run("check", SECTION_V, SPOTLIGHT, str(broken), "--report", str(file), "--sweep", f"{TIME}=1,2,3s")
    assert found.exit_code == 2
    sections = [one.attributes.get("id") for one in read_page(file.read_text(encoding="utf-8")).all("section")]
    assert {"m1-study", "m2-study"} <= set(sections)
    assert "m3-study" not in sections


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ("--sweep", f"{TIME}=1,2s"),
            "shown in a compliance report; accepted: --report FILE.html or FILE.md",
        ),
        (("--sweep", f"{TIME}=1,2s", "--format", "json"), "--sweep is shown in a compliance report"),
        (
            ("--sweep", f"{TIME}=1,2s", "--explain", "x"),
            "with --format, --report, --monte-carlo, --guard, --scheduler or --sweep",
        ),
        (("--sweep", f"{TIME}=1s", "R"), "has one value; accepted: several. --set puts in one"),
        (("--sweep", f"{TIME}", "R"), f"--sweep {TIME}: does not say which values"),
        (("--sweep", f"{TIME}=2:1s:3", "R"), f"--sweep {TIME}=2:1s:3: the range is reversed"),
        (("--sweep", f"{TIME}=1:2km:3", "R"), "must be a time, but 'km' makes it a length"),
        (("--sweep", "collection.aperture_tim=1,2s", "R"), "Did you mean 'collection.aperture_time'?"),
        (
            ("--sweep", f"{TIME}=1:2s:300", "--sweep", f"{AZIMUTH}=0:9deg:300", "R"),
            "90000 cases; accepted: up to 40000",
        ),
        (("--sweep", f"{TIME}=1,2s", "--sweep", f"{TIME}=3,4s", "R"), f"--sweep {TIME}: varies twice"),
        (("--sweep", "a=1", "--sweep", "b=1", "--sweep", "c=1", "R"), "draws one key or two, and there are 3"),
        (("--sweep", "allocation.model=full,published", "--model", "full", "R"), "--model stands in for it"),
    ],
)
def test_what_cannot_be_asked(run, tmp_path: Path, arguments: tuple[str, ...], said: str) -> None:
    """And nothing is written."""
    written = ("--report", str(tmp_path / "r.html")) if "R" in arguments else ()
    found = run("check", SECTION_V, *(word for word in arguments if word != "R"), *written)
    assert found.exit_code == 2
    assert said in " ".join(found.stderr.split())
    assert not list(tmp_path.iterdir())


def test_a_check_without_a_sweep_has_none() -> None:
    """What is asked for of nothing is nothing."""
    assert with_studies([], [f"{TIME}=1,2s"], None, date(2026, 1, 1)) == []
    assert MissionFindings._field_defaults["study"] is None
