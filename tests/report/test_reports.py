"""The formats: the JSON contract to the letter, CSV for a spreadsheet, text within 80 columns."""

import csv
import io
import json
import math
import re
from pathlib import Path

import pytest

from bisar_budget.faults import Fault
from bisar_budget.findings.mission import Report, UnusableMission
from bisar_budget.findings.row import worst_first
from bisar_budget.report import Style, render
from bisar_budget.report.words.sentences import percent, spreadsheet_text
from tests.conftest import ROOT, TEXT_FORMATS, UAV_FREE_RUNNING, findings

ROW_KEYS = [
    "id", "metric", "unit", "declared", "allowable", "allowable_published", "allowable_full", "qpe_published_rad",
    "qpe_full_rad", "displacement_m", "utilization", "margin", "status", "line", "reason", "notes",
]  # fmt: skip

FULL = {
    "autofocus__n_pull": 2,
    "requirements": {"pslr": -30, "islr": -20, "location_error": 5, "cubic_phase_error": 0.4},
    "timing_error": {"constant": 1e-9, "quadratic": 1e-14},
    "platforms__transmitter__motion_error": {
        "position": 1,
        "velocity": ["5 mm/s", "0.1 m/s", 0],
        "vibration": {"sinusoidal": [{"amplitude": 1e-5, "frequency": 9}]},
        "source": "data sheet",
    },
    "platforms__receiver__motion_error__velocity": "0.5 m/s",
    "other_errors": [{"name": "troposphere", "quadratic_phase_error": "5 deg"}],
}
FAULT = Fault(line=3, column=7, key="radar.bandwidth", problem="is missing")


def report(*missions) -> Report:
    return Report(version="1.2.3", missions=missions or (findings(**FULL),))


def as_json(*missions):
    return json.loads(render("json", report(*missions), Style()))


class TestJson:
    def test_top(self) -> None:
        document = as_json()
        assert document["format"] == "bisar-budget/check/1"
        assert document["version"] == "1.2.3"
        assert document["status"] == "fail"

    def test_mission_keys(self) -> None:
        (mission,) = as_json()["missions"]
        assert {"file", "name", "status", "model", "geometry", "budget", "rows"} <= mission.keys()
        assert mission["model"] == "published"

    def test_geometry(self) -> None:
        geometry = as_json()["missions"][0]["geometry"]
        assert geometry["wavelength_m"] == pytest.approx(0.0299792458)
        u_t, u_r = (30 / math.hypot(30, 6), 0, 6 / math.hypot(30, 6)), [x / math.sqrt(76) for x in (6, 6, 2)]
        angle = math.acos(sum(a * b for a, b in zip(u_t, u_r, strict=True)))
        assert geometry["bistatic_angle_rad"] == pytest.approx(angle)
        assert geometry["look_azimuth_rad"] == pytest.approx(math.atan2(u_r[1], u_t[0] + u_r[0]))
        for name in ("transmitter", "receiver"):
            assert geometry[name].keys() == {"slant_range_m", "azimuth_rad", "elevation_rad", "squint_rad"}
            assert geometry[name]["squint_rad"] == 0

    def test_a_still_platform_has_squint_null(self) -> None:
        platforms = {
            "transmitter": {"position": [30e3, 0, 6e3], "velocity": [0, 150, 0]},
            "receiver": {"slant_range": 2e3, "azimuth": 0.5, "elevation": 0.1, "speed": 0},
        }
        geometry = as_json(findings(platforms=platforms))["missions"][0]["geometry"]
        assert geometry["receiver"]["squint_rad"] is None

    def test_budget(self) -> None:
        budget = as_json()["missions"][0]["budget"]
        assert budget["qpe_rad"]["total"] == pytest.approx(math.pi / 4)
        assert budget["qpe_rad"]["transmitter"] == budget["qpe_rad"]["receiver"] == pytest.approx(math.pi / 8)
        assert budget["autofocus_gain"] == pytest.approx(8)
        assert budget["pslr_share"] == budget["islr_share"] == {"transmitter": 0.5, "receiver": 0.5}

    def test_row_keys_and_types(self) -> None:
        number = (int, float)
        for row in as_json()["missions"][0]["rows"]:
            assert list(row)[: len(ROW_KEYS)] == ROW_KEYS
            for key in (
                "declared", "allowable", "allowable_published", "allowable_full", "utilization", "margin",
                "qpe_published_rad", "qpe_full_rad",
            ):  # fmt: skip
                assert row[key] is None or isinstance(row[key], number)
            assert row["displacement_m"] is None or len(row["displacement_m"]) == 2
            assert isinstance(row["notes"], list)
            assert row["reason"] is None or row["reason"]

    def test_full_columns_are_filled_for_errors_with_a_phase(self) -> None:
        rows = {row["id"]: row for row in as_json()["missions"][0]["rows"]}
        assert rows["receiver.velocity.y"]["allowable_full"] > 0
        line = rows["transmitter.vibration.sinusoidal.0"]
        ratio = line["allowable_full"] / line["allowable_published"]
        assert line["published_margin_db"] == pytest.approx(20 * math.log10(ratio))

    def test_no_number_that_json_does_not_have(self) -> None:
        text = render("json", report(), Style())
        json.loads(text, parse_constant=lambda name: pytest.fail(name))

    def test_unusable_mission(self) -> None:
        document = as_json(UnusableMission(file="a.yaml", faults=(FAULT,)), findings())
        assert document["status"] == "error"
        bad, good = document["missions"]
        assert (bad["status"], bad["errors"][0]["key"], bad["errors"][0]["line"]) == ("error", "radar.bandwidth", 3)
        assert good["status"] == "not_evaluated"  # it declares nothing


class TestCsv:
    def rows(self, *missions):
        return list(csv.DictReader(io.StringIO(render("csv", report(*missions), Style()))))

    def test_a_line_per_row_with_the_numbers_of_the_json(self) -> None:
        rows = [row for row in self.rows() if row["kind"] == "row"]
        contract = as_json()["missions"][0]["rows"]
        assert [row["id"] for row in rows] == [row["id"] for row in contract]
        for row, want in zip(rows, contract, strict=True):
            for key in ("declared", "allowable", "utilization", "margin"):
                assert row[key] == ("" if want[key] is None else repr(float(want[key])))

    def test_a_line_per_requirement_with_the_numbers_of_the_json(self) -> None:
        rows = [row for row in self.rows() if row["kind"] == "requirement"]
        contract = as_json()["missions"][0]["requirements"]
        assert [row["id"] for row in rows] == [f"requirement.{one['key']}" for one in contract]
        for row, want in zip(rows, contract, strict=True):
            assert (row["status"], row["decided_by"]) == (want["status"], want["row"] or "")
            share = want["share"] or {"owner": "", "allowed": None, "reached": None}
            assert row["share_owner"] == share["owner"]
            for column, value in (
                ("declared", want["reached"]),
                ("allowable", want["value"]),
                ("share_allowed", share["allowed"]),
                ("share_reached", share["reached"]),
                ("autofocus_gain", want["autofocus_gain"]),
            ):
                assert row[column] == ("" if value is None else repr(float(value)))

    @pytest.mark.parametrize("sign", ["=", "+", "-", "@", "\uff1d", "\uff0b", "\uff0d", "\uff20", " =", "   @"])
    def test_text_that_looks_like_a_formula_is_text(self, sign: str) -> None:
        """Full-width signs and blanks before a sign are read over by some programs."""
        rows = self.rows(findings(name=f"{sign}HYPERLINK(1)"))
        assert rows[0]["mission"] == f"'{sign}HYPERLINK(1)"

    @pytest.mark.parametrize("text", ["-", "-6 dB", "+3.5e-7 m/s", "a=b", "1 - 2"])
    def test_text_that_runs_nothing_stays_as_it_is(self, text: str) -> None:
        assert spreadsheet_text(text) == text

    def test_a_size_with_a_call_behind_it_is_no_size(self) -> None:
        assert spreadsheet_text("-2+3+cmd|' /C calc'!A0") == "'-2+3+cmd|' /C calc'!A0"

    def test_quotes_commas_and_line_ends(self) -> None:
        assert self.rows(findings(name='a "b", c'))[0]["mission"] == 'a "b", c'

    def test_faults(self) -> None:
        (row,) = self.rows(UnusableMission(file="a.yaml", faults=(FAULT,)))
        assert (row["status"], row["line"], row["id"]) == ("error", "3", "radar.bandwidth")


class TestText:
    @pytest.mark.parametrize("verbosity", [-1, 0, 1])
    def test_80_columns(self, verbosity: int) -> None:
        for line in render("text", report(), Style(verbosity=verbosity)).splitlines():
            assert len(line) <= 80, line

    def test_worst_row_first(self) -> None:
        rows = worst_first(findings(**FULL).rows)
        assert rows[0].status == "fail"
        assert rows[-1].status == "not_declared"
        fails = [row.utilization for row in rows if row.status == "fail"]
        assert fails == sorted(fails, reverse=True)

    def test_says_what_breaks_by_how_much_and_from_which_row(self) -> None:
        text = render("text", report(), Style())
        assert text.splitlines()[1] == "base; published model, each error alone"
        (line,) = [line for line in text.splitlines() if line.startswith("FAIL     receiver.velocity.x")]
        assert " 0.5 m/s " in line
        assert line.endswith("location")
        assert "moves the image by 32.7 m, 5 m allowed (equation (25))" in text
        assert "Resolution" in text
        text = render("text", report(findings(platforms__receiver__motion_error__velocity="0.5 m/s")), Style())
        (line,) = [line for line in text.splitlines() if line.startswith("FAIL     receiver.velocity.x")]
        assert line.endswith("II.1")
        assert "(Table II row 1)" in text

    def test_verdict_is_the_first_line_and_says_how_errors_are_combined(self) -> None:
        first, second, *_ = render("text", report(), Style()).splitlines()
        assert first == "FAIL mission.yaml: 2 requirements are not met, 1 cannot be judged"
        assert second == "base; published model, each error alone"
        together = render("text", report(findings(**FULL, allocation={"combine": "rss"})), Style())
        assert "each error alone" not in together

    def test_verdict_of_an_unusable_file_is_the_first_line(self) -> None:
        text = render("text", report(UnusableMission(file="b.yaml", faults=(FAULT,))), Style())
        assert text.splitlines()[0] == "ERROR b.yaml: cannot be used, 1 fault"

    def test_quiet_is_one_line_per_mission(self) -> None:
        assert len(render("text", report(), Style(verbosity=-1)).splitlines()) == 1

    def test_verbose_shows_the_evidence(self) -> None:
        assert "evidence: data sheet" in render("text", report(), Style(verbosity=1))

    def test_several_missions_have_an_overall_line(self) -> None:
        text = render("text", report(findings(), UnusableMission(file="b.yaml", faults=(FAULT,))), Style())
        assert text.splitlines()[-1] == "ERROR 2 missions: 1 ERROR, 1 NOT EVAL"

    def test_long_names_keep_their_numbers(self) -> None:
        name = "a name that is much longer than the column has room for"
        text = render("text", report(findings(other_errors=[{"name": name, "quadratic_phase_error": 0.1}])), Style())
        index = next(i for i, line in enumerate(text.splitlines()) if re.match(rf"pass +other\.{name}", line))
        assert "0.1 rad" in text.splitlines()[index + 1]


@pytest.mark.parametrize(
    ("ratio", "text"),
    [
        (0.0, "0 %"), (0.236, "23.6 %"), (1.0, "100 %"), (11.78, "1178 %"), (1.00004, "100.004 %"),
        (0.99999, "99.999 %"), (1e-9, "<0.01 %"), (1e7, ">1e5 %"), (0.9996, "99.96 %"), (1 + 1e-12, "100 %"),
    ],
)  # fmt: skip
def test_percent_near_100_shows_the_side_it_is_on(ratio: float, text: str) -> None:
    assert percent(ratio) == text


def test_every_format_ends_with_one_newline() -> None:
    for name in TEXT_FORMATS:
        text = render(name, report(), Style())
        assert text.endswith("\n")
        assert not text.endswith("\n\n")


def test_notes_that_decide_nothing_stand_in_the_verbose_text_only() -> None:
    """A pass needs no footnote: what qualifies it is in -v, --explain and the JSON."""
    found = findings(**FULL, collection={"aperture_time": 60, "pulses": 900})
    noted = found._replace(rows=tuple(row._replace(remarks=("holds by a hair",)) for row in found.rows))
    short, long = (render("text", Report("1", (noted,)), Style(verbosity=verbosity)) for verbosity in (0, 1))
    assert "note: " not in short
    assert "by a hair" not in short
    assert "note: not used by this check: collection.pulses" in " ".join(long.split())
    assert long.count("holds by a hair") == len(noted.rows)


def test_a_reason_that_rows_share_stands_once() -> None:
    found = findings(**FULL)
    rows = tuple(
        row._replace(status="warn", reason="a reason of them all") if row.declared else row for row in found.rows
    )
    text = render("text", Report("1", (found._replace(rows=rows),)), Style())
    assert text.count("a reason of them all") == 1
    (paragraph,) = re.findall(r"(?ms)^WARN [^\n]* \(.*?\n  a reason", text)
    assert all(row.id in paragraph for row in rows if row.declared)


def test_rows_that_limit_nothing_are_a_count_and_all_shows_them(run) -> None:
    mission = "specs/missions/drones_same_gnss.yaml"
    short, long = run("check", mission).stdout, run("check", mission, "--all").stdout
    hidden = ["timing.linear", "receiver.acceleration.x", "receiver.velocity.x"]  # the last restates along other axes
    assert "Not shown (--all): 17 not declared, 6 without effect" in " ".join(short.split())
    assert "Not shown" not in long
    assert [row_id in short for row_id in hidden] == [False] * 3
    assert [row_id in long for row_id in hidden] == [True] * 3


def test_one_row_that_is_not_shown_is_said_of_one() -> None:
    """It read "1 that limit nothing"."""
    found = findings(**FULL)
    declared = [row for row in found.rows if row.declared]
    silent = declared[0]._replace(status="info", utilization=None, allowable=None, metric="islr", declared=0.0)
    text = render("text", Report("1", (found._replace(rows=(*declared[1:], silent)),)), Style())
    said = re.findall(r"\d+ (?:without effect|with less use)", " ".join(text.split()))
    assert "1 without effect" in said


def test_an_oscillator_as_declared_is_0_db_and_stands_in_the_table(run) -> None:
    """The largest error of a mission was counted among those that limit nothing: declared is 0, of a level."""
    text = run("check", "specs/missions/ocxo_free_running.yaml", "--all").stdout
    assert re.search(r"(?m)^info     receiver\.oscillator +as declared +-15\.1 dB", text)
    assert "without effect" not in text


def test_what_a_mask_is_extrapolated_by_stands_in_a_report(run) -> None:
    text = run("check", "specs/missions/ocxo_free_running.yaml", "--format", "markdown").stdout
    assert "Oscillator of the receiver: The mask begins at 1 Hz; below, it continues as f^(\u22123)" in text


def test_a_cubic_phase_without_requirement_is_not_called_none(run, tmp_path) -> None:
    """By the published model a gyro's bias has nothing but a cubic phase; the line of sight was said to miss it."""
    mission = tmp_path / "m.yaml"
    text = UAV_FREE_RUNNING.read_text(encoding="utf-8")
    mission.write_text(re.sub(r"(?m)^ +islr:.*\n", "", text), encoding="utf-8")
    text = run("check", mission, "--model", "published", "--format", "json").stdout
    (row,) = [row for row in json.loads(text)["missions"][0]["rows"] if row["id"] == "receiver.imu.gyro_bias"]
    assert row["allowable"] is None
    assert row["reason"] == "no requirement limits its cubic phase and displacement"


def test_a_file_that_declares_nothing_shows_its_allowables() -> None:
    text = render("text", Report("1", (findings(),)), Style())
    assert "not decl receiver.acceleration.x" in text
    assert "Not shown" not in text


def test_no_example_prints_more_than_45_lines(run, monkeypatch) -> None:
    """By their names: the path of a checkout takes as many lines as it is long."""
    monkeypatch.chdir(ROOT / "specs" / "missions")
    examples = sorted(Path().glob("*.yaml"))
    assert len(examples) > 5
    lengths = {path.name: len(run("check", path).stdout.splitlines()) for path in examples}
    assert {name: length for name, length in lengths.items() if length > 45} == {}


def test_a_row_says_which_requirement_binds_it() -> None:
    found = findings(**FULL)
    bound = dict(
        zip(("receiver.velocity.x", "receiver.velocity.y"), ("location_error", "cubic_phase_error"), strict=True)
    )
    rows = tuple(row._replace(binding_requirement=bound.get(row.id, "quadratic_phase_error")) for row in found.rows)
    text = render("text", Report("1", (found._replace(rows=rows),)), Style(all_rows=True))
    lines = [line.split() for line in text.splitlines() if re.match(r"\w.* receiver\.velocity\.[xy]  ", line)]
    ends = {next(word for word in line if word.startswith("receiver.")): line[-1] for line in lines}
    assert (ends["receiver.velocity.x"], ends["receiver.velocity.y"]) == ("location", "cubic")
    assert "by: requirement that sets the allowable" in text


def test_gradients_below_30_degrees_are_said_in_the_verdict() -> None:
    """Displacements grow as the inverse sine of the angle between range and Doppler gradients."""
    wide, narrow = (
        findings(),
        findings(platforms__receiver__velocity=[-40, -40, 0], platforms__transmitter__velocity=[-150, 5, 0]),
    )
    for found in (wide, narrow):
        degrees = math.degrees(found.geometry.gradient_angle)
        text = render("text", Report("1", (found,)), Style())
        assert f"gradients {degrees:.1f}° apart" in " ".join(text.split())
        verdict = " ".join(text.split("\n\n")[0].split())
        sentence = f"displacements are {1 / math.sin(math.radians(degrees)):.2g} times those at right angles"
        assert (sentence in verdict) == (degrees < 30)
    assert math.degrees(wide.geometry.gradient_angle) > 30 > math.degrees(narrow.geometry.gradient_angle)


def test_cells_of_the_table_do_not_touch(run) -> None:
    """An allowable of twelve characters beside a dash read as a negative number; one of percent ran into metres."""
    text = run("check", "specs/missions/drones_same_gnss.yaml", "--all").stdout
    assert " - 7.89e-11 s/s " in text
    assert not re.search(
        r" -\d|m\d+\.\d+ %", text[text.index("status") : text.index("FAIL mission.location_error (")]
    )
