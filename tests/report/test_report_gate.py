"""Reports for pull requests and requirements tools: JUnit, SARIF, GitHub's commands, needs.json."""

import json
import re
import sys
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from markdown_it import MarkdownIt

from bisar_budget.budget.check import check_mission
from bisar_budget.cli.check import check
from bisar_budget.faults import Fault
from bisar_budget.findings.mission import Report, UnusableMission
from bisar_budget.mission.load import parse_mission
from bisar_budget.report import FORMATS, Style, format_of, render
from bisar_budget.report.formats.annotations import step_summary
from bisar_budget.report.words import sentences
from tests.conftest import COMPLIES, ROOT, TEXT_FORMATS, TODAY, findings, mission_text
from tests.page import read_page

GATE = ("junit", "sarif", "github", "needs")
HOSTILE = "<script>|`x`]]>%0A::error::\"q\" 'a' -- ünï 漢 \u200f a,b;c {{7*7}} [[copy('id')]] <<x>> .. raw:: html"
STATUSES = {
    "timing_error__quadratic": 6e-13,  # 86 % of its share: a warning
    "platforms__transmitter__motion_error": {
        "velocity": [0, "5 m/s", 0],
        "vibration": {"wideband": {"rms": 5e-4}},  # 0.1 rad and no islr: not evaluated
        "source": HOSTILE,
    },
    "platforms__receiver__motion_error": {"acceleration": ["1 m/s^2", 0, 0], "position": 1},
    "other_errors": [{"name": HOSTILE, "quadratic_phase_error": "50 deg"}],
    "requirement_ids": {"transmitter.velocity.y": "SYS-NAV-012", "nobody": "X"},
    "waivers": [{"id": "receiver.*", "until": "2030-01-01", "reason": f"ECR-17 {HOSTILE}"}],
    "name": HOSTILE,
}
FAULTS = (Fault(3, 7, "radar.bandwidth", HOSTILE), Fault(None, None, "", "cannot be read"))
UNUSABLE = UnusableMission(file="bad dir/b%ü.yaml", faults=FAULTS)


def report(*missions) -> Report:
    return Report(version="1.2.3", missions=missions or (findings(**STATUSES), findings(), UNUSABLE))


def junit(*missions):
    return ElementTree.fromstring(render("junit", report(*missions), Style()))


def sarif(*missions):
    (run,) = json.loads(render("sarif", report(*missions), Style()))["runs"]
    return run


def needs(*missions):
    document = json.loads(render("needs", report(*missions), Style()))
    return document["versions"][document["current_version"]]["needs"]


def test_the_command_knows_every_format() -> None:
    (choice,) = [p.type.choices for p in check.params if p.name == "format_name"]
    assert list(choice) == list(FORMATS)
    assert {one.name for one in FORMATS.values() if one.suffixes} == set(FORMATS) - {"github"}


@pytest.mark.parametrize(
    ("name", "format_name"),
    [
        ("a.xml", "junit"), ("a.SARIF", "sarif"), ("a.sarif.json", "sarif"), ("needs.json", "needs"),
        ("docs/needs.json", "needs"), ("x.needs.json", "needs"), ("myneeds.json", "json"), ("a.json", "json"),
        ("a.b.txt", "text"), ("a", None), ("sarif", None), ("a.docx", None), ("a.json/b", None),
    ],
)  # fmt: skip
def test_format_from_the_end_of_a_name(name: str, format_name: str | None) -> None:
    assert format_of(name) == format_name


class TestJunit:
    # Element to allowed children and attributes, after Jenkins' junit-10; `properties` within a case is the
    # one addition, as pytest writes it and GitLab, Jenkins, StrictDoc and sphinx-test-reports read it.
    SHAPE = {
        "testsuites": ({"testsuite"}, {"name", "time", "tests", "failures", "errors"}),
        "testsuite": (
            {"properties", "testcase", "system-out", "system-err"},
            {"name", "tests", "failures", "errors", "time", "skipped"},
        ),
        "testcase": (
            {"properties", "skipped", "error", "failure", "system-out", "system-err"},
            {"name", "time", "classname"},
        ),
        "properties": ({"property"}, set()),
        "property": (set(), {"name", "value"}),
        "failure": (set(), {"type", "message"}),
        "error": (set(), {"type", "message"}),
        "skipped": (set(), {"type", "message"}),
        "system-out": (set(), set()),
    }

    def test_shape(self) -> None:
        for element in junit().iter():
            children, attributes = self.SHAPE[element.tag]
            assert {child.tag for child in element} <= children
            assert element.keys() == [] or set(element.keys()) <= attributes
            if element.tag in ("testsuite", "testcase"):
                assert element.get("name")
                assert element.get("time") == "0"

    def test_counts_are_those_of_the_cases(self) -> None:
        root = junit()
        assert len(root) == 3
        for suite in root:
            cases = suite.findall("testcase")
            assert int(suite.get("tests")) == len(cases)
            for counter, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
                assert int(suite.get(counter)) == sum(case.find(tag) is not None for case in cases)
        for counter in ("tests", "failures", "errors"):
            assert int(root.get(counter)) == sum(int(suite.get(counter)) for suite in root)

    def test_each_status_in_the_words_of_the_format(self) -> None:
        found = findings(**STATUSES)
        suite = junit(found)[0]
        cases = {case.get("name"): case for case in suite.findall("testcase")}
        rows = {sentences.printable(row.id): row for row in found.rows}
        rows |= {f"requirement.{one.key}": one for one in found.requirements}
        assert cases.keys() == rows.keys()
        seen = {row.status for row in found.rows}
        assert {"fail", "warn", "pass", "waived", "info", "not_evaluated", "not_declared"} <= seen
        for name, case in cases.items():
            outcome = {child.tag for child in case} - {"properties"}
            expected = {
                "fail": {"failure"},
                "not_evaluated": {"failure"},
                "warn": {"system-out"},
                "pass_with_autofocus": {"system-out"},
                "pass": set(),
            }
            assert outcome == expected.get(rows[name].status, {"skipped"}), name

    def test_properties_are_the_row(self) -> None:
        found = findings(**STATUSES)
        (row,) = [row for row in found.rows if row.id == "transmitter.velocity.y"]
        (case,) = [case for case in junit(found)[0].iter("testcase") if case.get("name") == row.id]
        got = {p.get("name"): p.get("value") for p in case.iter("property")}
        assert got["requirement_id"] == "SYS-NAV-012"
        assert got["metric"] == "quadratic_phase_error"
        assert got["equation"] == "Table II row 2"
        assert int(got["line"]) == row.line
        for key in ("declared", "allowable", "utilization", "margin"):
            assert float(got[key]) == getattr(row, key)
        assert got["evidence"] == sentences.printable(HOSTILE)
        assert "n_pull" in case.find("failure").get("message")

    def test_an_unusable_mission_is_a_case_with_an_error(self) -> None:
        suite = junit(UNUSABLE)[0]
        (case,) = suite.findall("testcase")
        error = case.find("error")
        assert "2 faults" in error.get("message")
        assert "radar.bandwidth" in error.text
        assert "cannot be read" in error.text

    def test_cases_are_grouped_by_the_path_of_the_mission(self) -> None:
        found = findings()._replace(file="missions/x.1/a.b.yaml")
        assert junit(found)[0].find("testcase").get("classname") == "missions.x_1.a_b"


class TestSarif:
    def test_envelope(self) -> None:
        document = json.loads(render("sarif", report(), Style()))
        assert document["version"] == "2.1.0"
        assert document["$schema"].endswith("sarif-schema-2.1.0.json")
        run = sarif()
        assert run["columnKind"] == "unicodeCodePoints"
        assert run["tool"]["driver"]["version"] == "1.2.3"

    def test_what_code_scanning_requires(self) -> None:
        """The properties that GitHub's documentation of SARIF support calls required."""
        run = sarif()
        rules = run["tool"]["driver"]["rules"]
        assert len({rule["id"] for rule in rules}) == len(rules)
        for rule in rules:
            assert rule["shortDescription"]["text"]
            assert rule["fullDescription"]["text"]
            assert rule["help"]["text"]
            assert rule["defaultConfiguration"]["level"] in ("note", "warning", "error")
        assert run["results"]
        for result in run["results"]:
            assert rules[result["ruleIndex"]]["id"] == result["ruleId"]
            assert result["message"]["text"]
            assert result["level"] in ("note", "warning", "error")
            assert result["partialFingerprints"]["primaryLocationLineHash"]
            (location,) = result["locations"]
            physical = location["physicalLocation"]
            assert physical["region"]["startLine"] >= 1
            place = physical["artifactLocation"]
            assert run["artifacts"][place["index"]]["location"]["uri"] == place["uri"]

    # Property of each object of the standard (section) to those it may have; its schema allows no other.
    OBJECTS = {
        "run": {"tool", "columnKind", "invocations", "artifacts", "results"},  # 3.14
        "driver": {"name", "version", "rules", "notifications"},  # 3.19
        "invocations": {"executionSuccessful", "toolExecutionNotifications"},  # 3.20
        "artifacts": {"location", "mimeType"},  # 3.24
        "results": {
            "ruleId", "ruleIndex", "level", "message", "locations", "partialFingerprints", "suppressions",
            "properties",
        },  # 3.27
        "locations": {"physicalLocation", "logicalLocations"},  # 3.28
        "physicalLocation": {"artifactLocation", "region"},  # 3.29
        "artifactLocation": {"uri", "uriBaseId", "index"},  # 3.4
        "region": {"startLine", "startColumn", "endLine", "endColumn"},  # 3.30
        "logicalLocations": {"fullyQualifiedName", "kind"},  # 3.33
        "suppressions": {"kind", "status", "justification", "location", "properties"},  # 3.35
        "rules": {
            "id", "name", "shortDescription", "fullDescription", "help", "defaultConfiguration", "properties",
        },  # 3.49
        "toolExecutionNotifications": {"descriptor", "level", "message", "locations"},  # 3.58
        "message": {"text"},  # 3.11
    }  # fmt: skip

    def test_only_properties_of_the_standard(self) -> None:
        seen = set()

        def walk(value, name: str) -> None:
            for item in value if isinstance(value, list) else [value]:
                if isinstance(item, dict):
                    if name in self.OBJECTS:
                        seen.add(name)
                        assert item.keys() <= self.OBJECTS[name], name
                    for key, inner in item.items():
                        if key != "properties":
                            walk(inner, key)

        run = sarif()
        walk(run, "run")
        assert seen == self.OBJECTS.keys()
        for result in run["results"]:
            for value in result["partialFingerprints"].values():
                assert isinstance(value, str)

    def test_a_file_named_twice_is_one_artifact(self) -> None:
        twice = (findings(**STATUSES), findings(**STATUSES))
        assert len(sarif(*twice)["artifacts"]) == 1

    def test_levels(self) -> None:
        found = findings(**STATUSES)
        status = {sentences.printable(row.id): row.status for row in found.rows}
        levels = {"fail": "error", "waived": "error", "not_evaluated": "error", "warn": "warning"}
        results = [r for r in sarif(found)["results"] if r["ruleId"] != "mission_file"]
        assert len(results) == sum(s in levels for s in status.values())
        for result in results:
            name = result["locations"][0]["logicalLocations"][0]["fullyQualifiedName"]
            assert result["level"] == levels[status[name]]

    def test_a_waiver_is_a_suppression_in_the_source(self) -> None:
        (result,) = [r for r in sarif(findings(**STATUSES))["results"] if "suppressions" in r]
        (suppression,) = result["suppressions"]
        assert suppression["kind"] == "inSource"
        assert suppression["justification"] == sentences.printable(f"ECR-17 {HOSTILE}")
        lines = mission_text(**STATUSES).splitlines()
        assert "receiver.*" in lines[suppression["location"]["physicalLocation"]["region"]["startLine"] - 1]

    def test_an_unusable_mission_is_a_notification(self) -> None:
        run = sarif(UNUSABLE)
        (invocation,) = run["invocations"]
        assert invocation["executionSuccessful"] is False
        first, second = invocation["toolExecutionNotifications"]
        region = first["locations"][0]["physicalLocation"]["region"]
        assert region == {"startLine": 3, "startColumn": 7}
        assert "cannot be read" in second["message"]["text"]
        assert first["level"] == "error"
        assert sarif(findings())["invocations"][0]["executionSuccessful"] is True

    def test_the_region_is_the_value_to_the_character(self) -> None:
        # Characters outside the basic plane stand before the value: columns count characters.
        text = mission_text() + (
            'other_errors: [{ name: "🛰ü", quadratic_phase_error: 50 deg }]\n'
            "timing_error:\n  quadratic:    6.0e-13   # a clock\n"
        )
        text = text.replace(
            "    - 150 m/s\n    - 0\n", '    - 150 m/s\n    - 0\n    motion_error: {velocity: [0, "5 m/s" , 0]}\n'
        )
        found = check_mission(parse_mission(text, "m.yaml"), TODAY)
        lines = text.splitlines()
        marked = {}
        for result in sarif(found)["results"]:
            region = result["locations"][0]["physicalLocation"]["region"]
            name = result["locations"][0]["logicalLocations"][0]["fullyQualifiedName"]
            if "endColumn" in region:
                assert region["startLine"] == region["endLine"]
                marked[name] = lines[region["startLine"] - 1][region["startColumn"] - 1 : region["endColumn"] - 1]
        assert marked == {
            "transmitter.velocity.y": '"5 m/s"',
            "other.🛰ü": "50 deg",
            "timing.quadratic": "6.0e-13",
        }

    def test_fingerprints_stay_when_lines_move_and_differ_within_a_run(self) -> None:
        def prints(text: str) -> list[str]:
            found = check_mission(parse_mission(text, "m.yaml"), TODAY)
            return [r["partialFingerprints"]["primaryLocationLineHash"] for r in sarif(found)["results"]]

        text = mission_text(**STATUSES)
        assert prints(text) == prints("# a comment\n\n\n" + text)
        assert len(set(prints(text))) == len(prints(text))

    def test_uris_are_relative_and_encoded(self) -> None:
        (artifact,) = sarif(UNUSABLE)["artifacts"]
        assert artifact["location"] == {"uri": "bad%20dir/b%25%C3%BC.yaml", "uriBaseId": "%SRCROOT%"}

    def test_files_outside_the_repository_are_absolute(self, tmp_path: Path) -> None:
        inside, outside = tmp_path / "repo" / "a b.yaml", tmp_path / "c.yaml"
        missions = (findings()._replace(file=str(inside)), findings()._replace(file=str(outside)))
        style = Style(root=str(tmp_path / "repo"))
        (run,) = json.loads(render("sarif", report(*missions), style))["runs"]
        first, second = [artifact["location"] for artifact in run["artifacts"]]
        assert first == {"uri": "a%20b.yaml", "uriBaseId": "%SRCROOT%"}
        assert second["uri"].startswith("file:///")
        assert unquote(second["uri"]).endswith("c.yaml")
        assert "uriBaseId" not in second


def run_command(line: str) -> tuple[str, dict[str, str], str]:
    """Read a workflow command as the runner does: split first, unescape after."""
    match = re.fullmatch(r"::([a-z]+) (.*?)::(.*)", line)
    assert match is not None, line
    unescaped = {"%3A": ":", "%2C": ",", "%0D": "\r", "%0A": "\n", "%25": "%"}

    def data(text: str, codes: tuple[str, ...]) -> str:
        return re.sub("|".join(codes), lambda found: unescaped[found[0]], text)

    properties = {}
    for pair in match[2].split(","):
        key, _, value = pair.partition("=")
        properties[key] = data(value, ("%3A", "%2C", "%0D", "%0A", "%25"))
    return match[1], properties, data(match[3], ("%0D", "%0A", "%25"))


class TestGithub:
    def commands(self, *missions):
        return [run_command(line) for line in render("github", report(*missions), Style()).splitlines()]

    def test_levels_files_and_places(self) -> None:
        found = findings(**STATUSES)
        rows = {f"{row.id}": row for row in found.rows}
        commands = self.commands(found)
        levels = {"fail": "error", "warn": "warning", "not_evaluated": "error", "waived": "notice"}
        titles = {}
        for command, properties, message in commands:
            titles[properties["title"].partition(" ")[2]] = (command, properties)
            assert properties["file"] == "mission.yaml"
            assert message
        for row in rows.values():
            if row.status in levels:
                key = row.id if row.status != "not_evaluated" else f"EVAL {row.id}"
                command, properties = titles[sentences.printable(key)]
                assert command == levels[row.status]
                assert int(properties["line"]) == row.line
                assert int(properties["col"]) >= 1

    def test_the_worst_come_first(self) -> None:
        order = [command for command, _, _ in self.commands()]
        assert order == sorted(order, key=("error", "warning", "notice").index)
        assert order[0] == "error"
        assert order[-1] == "notice"

    def test_faults_of_an_unusable_file(self) -> None:
        (_, first, message), (_, second, _) = self.commands(UNUSABLE)
        assert (first["file"], first["line"], first["col"]) == (UNUSABLE.file, "3", "7")
        assert sentences.printable(HOSTILE) in message
        assert "line" not in second

    def test_nothing_to_say_is_no_command(self) -> None:
        passing = findings(timing_error__constant=0)
        assert render("github", report(passing), Style()) == "bisar-budget: 1 mission, no findings\n"

    def test_standard_input_is_no_place_in_the_repository(self) -> None:
        for _, properties, message in self.commands(findings(**STATUSES)._replace(file="-")):
            assert properties.keys() == {"title"}
            assert message

    def test_columns_are_left_out_over_several_lines(self) -> None:
        """GitHub takes a column within one line only."""
        text = mission_text().replace("6 s", "6 s", 1) + 'timing_error: {quadratic: "1e-6\n  1/s"}\n'
        found = check_mission(parse_mission(text, "m.yaml"), TODAY)
        (_, properties, _), *_ = self.commands(found)
        assert int(properties["endLine"]) == int(properties["line"]) + 1
        assert "col" not in properties

    def test_summary_is_a_table(self) -> None:
        text = step_summary(report(), Style())
        header, rule, *rows = [line for line in text.splitlines() if line.startswith("|")]
        assert [len(re.split(r"(?<!\\)\|", line)) for line in (header, rule, *rows)] == [6] * 5
        assert "2355" not in header
        assert "ERROR" in rows[2]
        assert "<" not in text
        assert "`" not in text


class TestStepSummary:
    @pytest.fixture
    def mission(self, tmp_path):
        path = tmp_path / "m.yaml"
        path.write_text(mission_text(platforms__transmitter__motion_error__velocity="5 m/s"))
        return path

    def test_is_appended(self, run, mission, tmp_path) -> None:
        summary = tmp_path / "summary.md"
        summary.write_text("before\n")
        for _ in range(2):
            assert (
                run("check", mission, "--format", "github", env={"GITHUB_STEP_SUMMARY": str(summary)}).exit_code == 1
            )
        text = summary.read_text()
        assert text.startswith("before\n### bisar-budget: FAIL")
        assert text.count("###") == 2

    def test_that_cannot_be_written_changes_no_exit_code(self, run, mission, tmp_path) -> None:
        result = run("check", mission, "--format", "github", env={"GITHUB_STEP_SUMMARY": str(tmp_path)})
        assert result.exit_code == 1
        assert "cannot write the step summary" in result.stderr
        assert result.stdout.startswith("::error ")

    def test_other_formats_leave_it_alone(self, run, mission, tmp_path) -> None:
        summary = tmp_path / "summary.md"
        run("check", mission, env={"GITHUB_STEP_SUMMARY": str(summary)})
        assert not summary.exists()

    def test_files_are_named_from_the_checkout(self, run, mission, tmp_path, monkeypatch) -> None:
        (tmp_path / "elsewhere").mkdir()
        monkeypatch.chdir(tmp_path / "elsewhere")
        result = run("check", "../m.yaml", "--format", "github", env={"GITHUB_WORKSPACE": str(tmp_path)})
        assert "file=m.yaml," in result.stdout


class TestNeeds:
    def test_envelope(self) -> None:
        document = json.loads(render("needs", report(), Style()))
        version = document["versions"][document["current_version"]]
        assert document["project"] == "bisar-budget"
        assert version["needs_amount"] == len(version["needs"])
        assert "created" not in document  # the same in every run

    def test_a_need_per_row_with_the_requirement_as_link(self) -> None:
        found = findings(**STATUSES)
        all_needs = needs(found)
        assert [need["status"] for need in all_needs.values()] == [
            *(one.status for one in found.requirements),
            *(row.status for row in found.rows),
        ]
        (linked,) = [need for need in all_needs.values() if need["links"]]
        assert linked["links"] == ["SYS-NAV-012"]
        assert linked["title"].startswith("transmitter.velocity.y of ")

    def test_ids_are_unique_and_fit_the_default_pattern(self) -> None:
        names = ["a.b", "a-b", "漢"]
        found = findings(other_errors=[{"name": name, "quadratic_phase_error": 0.1} for name in names])
        all_needs = needs(found, found._replace(file="MISSION.yml"))
        assert len(all_needs) == 2 * (len(found.rows) + len(found.requirements))
        for key, need in all_needs.items():
            assert need["id"] == key
            assert re.fullmatch("[A-Z0-9_]{5,}", key)

    def test_content_is_plain_to_sphinx(self) -> None:
        (need,) = [
            need
            for need in needs(findings(**STATUSES)).values()
            if "script" in need["title"] and need["status"] == "fail" and "OTHER" in need["id"]
        ]
        assert "[[" not in need["title"]
        assert "<<" not in need["title"]
        assert not re.search(r"(?<!\\)[`*|<>:]", need["content"])


# Whatever a mission file or a file name can hold.
ANY_TEXT = st.text(st.characters(), min_size=1, max_size=40)


@given(ANY_TEXT)
def test_xml_of_any_text_parses_to_it(text: str) -> None:
    for markup in (f'<a b="{sentences.xml_text(text)}"/>', f"<a>{sentences.xml_text(text)}</a>"):
        element = ElementTree.fromstring(markup.encode())
        assert (element.get("b") or element.text or "") == sentences.printable(text)


@given(ANY_TEXT, ANY_TEXT)
def test_a_command_of_any_text_stays_one_command(title: str, message: str) -> None:
    line = f"::error title={sentences.command_property(title)},x=1::{sentences.command_text(message)}"
    assert len(line.splitlines()) == 1
    assert run_command(line) == (
        "error",
        {"title": sentences.printable(title), "x": "1"},
        sentences.printable(message),
    )


@given(ANY_TEXT)
def test_markdown_of_any_text_has_no_markup_and_stays_in_its_cell(text: str) -> None:
    escaped = sentences.markdown_text(text)
    shown = sentences.printable(text)
    markdown = MarkdownIt("commonmark").enable(["table", "strikethrough"])
    assert not re.search(
        r"://|www\.|@\w|[<>$]|&(?!#\d+;)\w+;", escaped, re.ASCII
    )  # GitHub's own: links, mentions, formulas
    for source, tags in (
        (
            f"| a | b |\n| --- | --- |\n| {escaped} | x |",
            ["table", "thead", "tr", "th", "th", "tbody", "tr", "td", "td"],
        ),
        (f"- {escaped}\n- x", ["ul", "li", "li"]),
        (escaped, ["p"]),
        (f"{escaped}{escaped}", ["p"]),
    ):
        page = read_page(markdown.render(source).replace(" />", ">"))
        assert [element.tag for element in page.all()] == tags, source
        last = list(page.all())[-1 if tags == ["p"] else -2]
        # Spaces at the ends of a line or a cell are nobody's.
        assert last.text.strip() in (shown.strip(), (shown + shown).strip())


@pytest.mark.parametrize("format_name", TEXT_FORMATS)
class TestEveryFormat:
    def test_is_the_same_twice_and_prints_no_control(self, format_name: str) -> None:
        text = render(format_name, report(), Style())
        assert text == render(format_name, report(), Style())
        assert not re.search("[\x00-\x09\x0b-\x1f\x7f\u202a-\u202e]", text)

    def test_carries_the_requirement_id(self, format_name: str) -> None:
        assert "SYS-NAV-012" in render(format_name, report(), Style())

    def test_a_key_with_an_escape_sequence_does_nothing_to_a_terminal(self, format_name: str) -> None:
        found = findings(requirement_ids={"\x1b[31mnobody": "X"})
        assert "\x1b" not in render(format_name, report(found), Style())

    @pytest.mark.skipif(sys.platform == "win32", reason="file names are Unicode there")
    def test_a_file_name_that_is_no_text(self, run, tmp_path, monkeypatch, format_name: str) -> None:
        name = b"m\xff\n::error::x.yaml"
        monkeypatch.chdir(tmp_path)
        with open(name, "wb") as file:
            file.write(mission_text(**COMPLIES).encode())
        result = run("check", name.decode("utf-8", "surrogateescape"), "--format", format_name, "-o", "out")
        assert result.exit_code == 0, result.output
        lines = Path("out").read_bytes().splitlines()
        assert not any(line.startswith(b"::error::x") for line in lines)

    def test_the_exit_code_does_not_depend_on_it(self, run, tmp_path, format_name: str) -> None:
        good, bad, broken = (tmp_path / name for name in ("good.yaml", "bad.yaml", "broken.yaml"))
        good.write_text(mission_text(**COMPLIES))
        bad.write_text(mission_text(**STATUSES), encoding="utf-8")
        broken.write_text("nonsense: [")
        for files, code in (([good], 0), ([good, bad], 1), ([good, bad, broken], 2)):
            assert run("check", *files, "--format", format_name).exit_code == code
        assert run("check", bad, "--exit-zero", "--format", format_name).exit_code == 0


def test_a_passing_row_shows_its_requirement_in_the_text() -> None:
    found = findings(requirement_ids={"receiver.velocity.x": "SYS-1"}, platforms__receiver__motion_error__velocity=0)
    text = render("text", report(found), Style())
    assert "SYS-1" in text


def test_several_reports_in_one_run(run, tmp_path) -> None:
    names = ["a.xml", "a.sarif", "needs.json", "a.json", "a.csv", "a.txt"]
    mission = tmp_path / "m.yaml"
    mission.write_text(mission_text(**STATUSES), encoding="utf-8")
    options = [part for name in names for part in ("--report", tmp_path / name)]
    assert run("check", mission, *options, "--format", "github").exit_code == 1
    ElementTree.parse(tmp_path / "a.xml")
    assert json.loads((tmp_path / "a.sarif").read_text())["version"] == "2.1.0"
    assert "current_version" in json.loads((tmp_path / "needs.json").read_text())
    assert json.loads((tmp_path / "a.json").read_text())["format"] == "bisar-budget/check/1"


def test_json_and_csv_have_the_line_as_a_plain_number() -> None:
    """A row's line also knows its column; nothing of that may show."""
    found = findings(**STATUSES)
    (mission,) = json.loads(render("json", report(found), Style()))["missions"]
    assert all(row["line"] is None or type(row["line"]) is int for row in mission["rows"])
    assert yaml.safe_load(repr(found.rows[0].line)) == found.rows[0].line
    assert (ROOT / "bisar_budget").is_dir()


@pytest.mark.parametrize("name", ["junit", "sarif", "github", "needs"])
def test_a_requirement_that_binds_in_place_of_the_phase_is_named(name: str) -> None:
    """A row of a phase may fail by location: who reads the annotation alone must know which."""
    found = findings(platforms__receiver__motion_error__velocity="0.5 m/s", requirements__location_error=5)
    (row,) = [row for row in found.rows if row.id == "receiver.velocity.z"]
    assert (row.status, row.binding_requirement) == ("fail", "location_error")
    text = render(name, report(found), Style())
    assert "limited by the location error" in text
    free = findings(platforms__receiver__motion_error__velocity="0.5 m/s")
    assert "limited by" not in render(name, report(free), Style())
    if name in ("junit", "sarif"):
        assert '"binding_requirement"' in text


def test_the_step_summary_says_that_errors_are_judged_alone() -> None:
    alone, together = (findings(timing_error__quadratic=1e-14, allocation__combine=rule) for rule in ("each", "rss"))
    text = step_summary(report(alone, together), Style())
    assert text.count("each error alone") == 1
