"""The command: exit codes, streams, files, formats. Everything a script or a CI job relies on."""

import json
import os
import re
import subprocess
import sys

import pytest
import yaml

from bisar_budget import __version__
from tests.conftest import COMPLIES, ROOT, mission_text

FAILING = {"platforms__transmitter__motion_error__velocity": "5 m/s"}


@pytest.fixture
def good(tmp_path):
    path = tmp_path / "good.yaml"
    path.write_text(mission_text(**COMPLIES))
    return path


@pytest.fixture
def failing(tmp_path):
    path = tmp_path / "failing.yaml"
    path.write_text(mission_text(**FAILING))
    return path


@pytest.fixture
def broken(tmp_path):
    path = tmp_path / "broken.yaml"
    path.write_text(mission_text().replace("10 GHz", "-10 GHz"))
    return path


@pytest.mark.parametrize("format_name", ["text", "json", "csv"])
class TestExitCodes:
    def test_0_when_all_is_met(self, run, good, format_name) -> None:
        assert run("check", good, "--format", format_name).exit_code == 0

    def test_1_when_a_requirement_is_broken(self, run, failing, format_name) -> None:
        assert run("check", failing, "--format", format_name).exit_code == 1

    def test_2_when_a_file_is_unusable_and_2_wins(self, run, good, failing, broken, format_name) -> None:
        assert run("check", broken, "--format", format_name).exit_code == 2
        assert run("check", good, failing, broken, "--format", format_name).exit_code == 2

    def test_exit_zero_forgives_a_broken_requirement_only(self, run, failing, broken, format_name) -> None:
        assert run("check", failing, "--exit-zero", "--format", format_name).exit_code == 0
        assert run("check", broken, "--exit-zero", "--format", format_name).exit_code == 2


def test_strict_fails_on_warnings_and_what_is_not_judged_fails_without_it(run, tmp_path) -> None:
    warning = tmp_path / "warning.yaml"
    warning.write_text(mission_text(timing_error__quadratic=6e-13))
    unjudged = tmp_path / "unjudged.yaml"
    vibration = {"vibration": {"wideband": {"rms": 5e-4}}}  # 0.1 rad of phase: above negligible, and no ISLR
    unjudged.write_text(mission_text(platforms__receiver__motion_error=vibration))
    for path, code in ((warning, 0), (unjudged, 1)):
        assert run("check", path).exit_code == code
        assert run("check", path, "--strict").exit_code == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ["check"],
        ["check", "--format", "yaml", "x"],
        ["check", "--nonsense", "x"],
        ["check", "x", "--date", "tomorrow"],
        ["check", "x", "--model", "exact"],
        ["check", "x", "--report", "out.docx"],
        ["nonsense"],
        ["derive", "--check", "--write"],
    ],
)
def test_wrong_usage_is_2_and_helps(run, arguments) -> None:
    result = run(*arguments)
    assert result.exit_code == 2
    assert "Error" in result.stderr
    assert "Traceback" not in result.output


def test_a_crash_is_3_never_1(run, good, monkeypatch) -> None:
    def crash(*args):
        raise ZeroDivisionError("boom")

    monkeypatch.setattr("bisar_budget.budget.check.check_missions", crash)
    result = run("check", good)
    assert result.exit_code == 3
    assert "fault of the tool" in result.stderr
    assert "Traceback" not in result.output


def test_faults_go_to_standard_error_with_file_line_and_column(run, broken) -> None:
    result = run("check", broken, "--format", "json")
    assert result.stderr == f"{broken}:4:21: radar.center_frequency: must be greater than 0 Hz (got -10 GHz)\n"
    (mission,) = json.loads(result.stdout)["missions"]
    assert mission["status"] == "error"
    assert mission["errors"][0]["line"] == 4


def test_an_unusable_file_stands_in_every_format(run, good, broken) -> None:
    text = run("check", good, broken).stdout
    assert "must be greater than 0 Hz" in text
    assert "cannot be used, 1 fault" in text
    csv_text = run("check", good, broken, "--format", "csv").stdout
    assert "error" in csv_text
    assert "must be greater than 0 Hz" in csv_text


def test_standard_input(run) -> None:
    result = run("check", "-", "--format", "json", input=mission_text(**COMPLIES))
    assert result.exit_code == 0
    assert json.loads(result.stdout)["missions"][0]["file"] == "-"


def test_globs_are_expanded_and_files_named_once(run, good, failing) -> None:
    pattern = good.parent / "*.yaml"
    result = run("check", pattern, good, "--format", "json")
    files = [mission["file"] for mission in json.loads(result.stdout)["missions"]]
    assert files == sorted([str(failing), str(good)])


def test_a_glob_without_a_match_is_an_error(run, tmp_path) -> None:
    result = run("check", tmp_path / "*.yml")
    assert result.exit_code == 2
    assert "no file matches the pattern" in result.stderr


def test_output_file_is_written_whole_and_keeps_the_exit_code(run, failing, tmp_path) -> None:
    target = tmp_path / "new" / "report.json"
    result = run("check", failing, "--format", "json", "-o", target)
    assert (result.exit_code, result.stdout) == (1, "")
    assert json.loads(target.read_text())["status"] == "fail"
    assert [path.name for path in target.parent.iterdir()] == ["report.json"]


def test_output_that_cannot_be_written_is_2(run, good, tmp_path) -> None:
    for target in (tmp_path, good / "below.json"):
        result = run("check", good, "-o", target)
        assert result.exit_code == 2
        assert "cannot write" in result.stderr
    assert good.read_text() == mission_text(**COMPLIES)


def test_reports_by_suffix_beside_the_text(run, failing, tmp_path) -> None:
    result = run("check", failing, "--report", tmp_path / "a.json", "--report", tmp_path / "b.csv")
    assert result.exit_code == 1
    assert "FAIL" in result.stdout
    assert json.loads((tmp_path / "a.json").read_text())["status"] == "fail"
    assert (tmp_path / "b.csv").read_text().startswith("file,mission,id,status")


class TestDate:
    WAIVED = {**FAILING, "waivers": [{"id": "transmitter.*", "until": "2030-01-01", "reason": "x"}]}

    @pytest.fixture
    def waived(self, tmp_path):
        path = tmp_path / "waived.yaml"
        path.write_text(mission_text(**self.WAIVED))
        return path

    @pytest.mark.parametrize(("day", "code"), [("2030-01-01", 0), ("2030-01-02", 1)])
    def test_option(self, run, waived, day, code) -> None:
        assert run("check", waived, "--date", day).exit_code == code

    @pytest.mark.parametrize(("epoch", "code"), [("1893455999", 0), ("1893542400", 1)])
    def test_source_date_epoch_is_utc(self, run, waived, epoch, code) -> None:
        """1893455999 is 2029-12-31T23:59:59Z; 1893542400 is 2030-01-02T00:00:00Z."""
        assert run("check", waived, env={"SOURCE_DATE_EPOCH": epoch}).exit_code == code

    def test_option_wins(self, run, waived) -> None:
        assert run("check", waived, "--date", "2029-01-01", env={"SOURCE_DATE_EPOCH": "1893542400"}).exit_code == 0

    @pytest.mark.parametrize("epoch", ["soon", "9" * 30])
    def test_nonsense_epoch_is_said(self, run, waived, epoch) -> None:
        result = run("check", waived, env={"SOURCE_DATE_EPOCH": epoch})
        assert result.exit_code == 2
        assert "SOURCE_DATE_EPOCH" in result.stderr


class TestColor:
    def test_plain_in_a_pipe(self, run, failing) -> None:
        assert "\x1b" not in run("check", failing).stdout

    def test_always_and_never(self, run, failing) -> None:
        assert "\x1b[1;31mFAIL" in run("check", failing, "--color", "always", color=True).stdout
        assert "\x1b" not in run("check", failing, "--color", "never").stdout

    @pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
    @pytest.mark.parametrize(
        ("environment", "colored"), [({}, True), ({"NO_COLOR": "1"}, False), ({"TERM": "dumb"}, False)]
    )
    def test_on_a_terminal(self, failing, environment, colored) -> None:
        import pty

        leader, follower = pty.openpty()
        env = {k: v for k, v in os.environ.items() if k != "NO_COLOR"} | {"TERM": "xterm"} | environment
        subprocess.run(
            [sys.executable, "-m", "bisar_budget", "check", str(failing)],
            stdout=follower,
            stderr=follower,
            env=env,
            check=False,
        )
        os.close(follower)
        output = b""
        while True:
            try:
                part = os.read(leader, 65536)
            except OSError:
                break
            if not part:
                break
            output += part
        os.close(leader)
        assert (b"\x1b[" in output) == colored
        assert b"FAIL" in output


def test_a_reader_that_goes_away_does_not_change_the_exit_code(failing) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "bisar_budget", "check", str(failing), "-v"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    process.stdout.close()
    errors = process.stderr.read()
    process.stderr.close()
    assert process.wait() == 1
    assert errors == b""


def test_output_survives_a_terminal_without_the_characters(failing) -> None:
    env = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(
        [sys.executable, "-m", "bisar_budget", "check", str(failing)], capture_output=True, env=env, check=False
    )
    assert done.returncode == 1
    assert b"Traceback" not in done.stderr


class TestInit:
    def test_writes_a_mission_that_passes(self, run, tmp_path) -> None:
        path = tmp_path / "m.yaml"
        assert run("init", path, "--name", 'Quotes " and: colons').exit_code == 0
        assert yaml.safe_load(path.read_text())["name"] == 'Quotes " and: colons'
        assert path.read_text().startswith("# yaml-language-server: $schema=")
        result = run("check", path, "--strict")
        assert result.exit_code == 0, result.output
        assert "warning" not in result.stdout
        assert yaml.safe_load(path.read_text())["allocation"]["combine"] == "rss"

    def test_does_not_replace_without_force(self, run, good) -> None:
        result = run("init", good)
        assert result.exit_code == 2
        assert good.read_text() == mission_text(**COMPLIES)
        assert run("init", good, "--force").exit_code == 0
        assert good.read_text() != mission_text(**COMPLIES)

    def test_standard_output(self, run) -> None:
        assert "schema_version: 1" in run("init", "-").stdout

    def test_its_commented_lines_are_valid_too(self, run, tmp_path) -> None:
        """Uncomment each optional block: what the starter suggests must load."""
        text = run("init", "-").stdout
        text, count = re.subn(r"(?m)^(\s*)# (\s*(?:- \{)?[a-z_]+: .*)$", r"\1\2", text)
        assert count == 26
        path = tmp_path / "m.yaml"
        path.write_text(text)
        result = run("check", path, "--format", "json")
        assert result.exit_code == 1, result.output  # it asks for more than it declares
        (mission,) = json.loads(result.stdout)["missions"]
        stands = {one["key"]: one["status"] for one in mission["requirements"]}
        assert stands.pop("quadratic_phase_error") == "pass_with_autofocus"
        assert stands.pop("location_error") == "pass"
        assert stands.pop("declare") == "not_evaluated"
        assert set(stands.values()) <= {"pass", "warn"}

    def test_the_other_ways_to_state_a_path_are_those_of_a_mission(self, run, tmp_path) -> None:
        """It did not mention orbits, logs and places. Files are asked for: all keys are known."""
        text = run("init", "-").stdout
        (instant,) = re.findall(r"# center_time: (\S+)", text)
        (place,) = re.findall(r"WGS-84\): (\{.*\})", text)
        ways = [yaml.safe_load(way) for way in re.findall(r"(?m)^ +#   or (.*)$", text)]
        said = [{"satellite.tle cannot be read"}, {"flight.csv cannot be read"}, set()]
        assert len(ways) == len(said)
        for way, faults in zip(ways, said, strict=True):
            tree = yaml.safe_load(text)
            tree["collection"]["center_time"] = instant
            tree["scene"] = yaml.safe_load(place)
            tree["platforms"]["receiver"] = way
            (tmp_path / "m.yaml").write_text(yaml.safe_dump(tree))
            result = run("check", tmp_path / "m.yaml")
            assert result.exit_code == (2 if faults else 0), result.output
            assert all(fault in result.stderr for fault in faults)


def test_schema_is_printed(run, tmp_path) -> None:
    assert json.loads(run("schema").stdout)["$schema"].startswith("http://json-schema.org/draft-07")
    run("schema", "-o", tmp_path / "s.json")
    assert json.loads((tmp_path / "s.json").read_text())["title"]


def test_version(run) -> None:
    assert __version__ in run("--version").stdout


@pytest.mark.parametrize("command", [[], ["check"], ["derive"], ["diff"], ["init"], ["schema"]])
def test_help_fits_the_terminal(run, command) -> None:
    result = run(*command, "--help", terminal_width=80)
    assert result.exit_code == 0
    assert max(map(len, result.stdout.splitlines())) <= 80


class TestDerive:
    @pytest.mark.parametrize("format_name", ["text", "latex", "markdown", "mathml"])
    @pytest.mark.parametrize("table", ["I", "II", "vibration", "equations"])
    def test_every_table_in_every_format(self, run, table, format_name) -> None:
        result = run("derive", "--table", table, "--format", format_name)
        assert result.exit_code == 0
        assert result.stdout.strip()

    def test_text_of_table_ii_row_1(self, run) -> None:
        line = next(line for line in run("derive", "--table", "II").stdout.splitlines() if line.startswith("1 "))
        assert "π*T^2*|v_xt*ṽ_xt|/(2*R_t*λ)" in line
        assert "R_t*λ/(4*T^2*|v_xt|)" in line

    def test_latex_of_table_ii_row_1(self, run) -> None:
        text = run("derive", "--table", "II", "--format", "latex").stdout
        assert r"\frac{\pi T^{2} \left\lvert v_{xt} \tilde{v}_{xt} \right\rvert}{2 R_{t} \lambda}" in text

    def test_markdown_has_no_macro_that_github_refuses(self, run) -> None:
        for table in ("all", "full"):
            text = run("derive", "--format", "markdown", "--table", table).stdout
            assert r"\mathop{\mathrm{" in text
            assert "operatorname" not in text

    def test_mathml_is_well_formed(self, run) -> None:
        from xml.etree import ElementTree

        text = run("derive", "--format", "mathml").stdout
        root = ElementTree.fromstring(f"<div>{text}</div>")
        assert len(root.findall(".//{http://www.w3.org/1998/Math/MathML}math")) > 80

    def test_one_equation_and_what_its_print_gets_wrong(self, run) -> None:
        for format_name in ("text", "latex", "markdown", "mathml"):
            text = run("derive", "--equation", "16", "--format", format_name).stdout
            assert "(16)" in text
            assert "1/(N_x·N_y) is lost" in text
            assert "(15) Phase" not in text

    @pytest.mark.parametrize("other", [("--table", "II"), ("--check",), ("--write",)])
    def test_one_equation_goes_with_nothing_else(self, run, other) -> None:
        result = run("derive", "--equation", "16", *other)
        assert result.exit_code == 2
        assert "--equation" in result.stderr

    def test_mathml_of_a_double_sum_has_both_indices(self, run) -> None:
        assert run("derive", "--equation", "4", "--format", "mathml").stdout.count("<munderover>") == 2

    def test_check_fails_on_a_changed_file_and_shows_where(self, run, tmp_path, monkeypatch) -> None:
        """What the derivation gives is taken from the committed files here: `test_emit` holds them to it."""
        from bisar_budget.theory import emit

        generated = {}
        slips = (("0.25*shared_1", "0.26*shared_1"), ("{4", "{5"))
        for path, (old, new) in zip(emit.GENERATED, slips, strict=True):
            changed = tmp_path / path.name
            text = path.read_text(encoding="utf-8")
            assert old in text
            changed.write_text(text.replace(old, new), encoding="utf-8")
            generated[changed] = lambda text=text: text
        monkeypatch.setattr(emit, "GENERATED", generated)
        result = run("derive", "--check")
        assert result.exit_code == 1
        assert "0.26*shared_1" in result.stdout
        assert "frac{5" in result.stdout
        assert run("derive", "--write").exit_code == 0
        assert run("derive", "--check").exit_code == 0


def test_module_runs_like_the_command() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "bisar_budget", "--version"], capture_output=True, text=True, cwd=ROOT, check=True
    )
    assert __version__ in done.stdout


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("bisar-budget che", "plain,check"),
        ("bisar-budget check --form", "plain,--format"),
        ("bisar-budget check --format sar", "plain,sarif"),
        ("bisar-budget check missions/", "file,missions/"),
        ("bisar-budget check --report out/", "file,out/"),
        ("bisar-budget simulate miss", "file,miss"),
    ],
)
def test_shells_complete_commands_options_and_files(words: str, offered: str) -> None:
    environment = os.environ | {
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split()) - 1),
        "_BISAR_BUDGET_COMPLETE": "bash_complete",
    }
    program = "import sys; sys.argv = ['bisar-budget']; from bisar_budget.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env=environment, check=False
    )
    assert done.stdout.split() == [offered], done.stderr


def test_quiet_counts_the_warnings_about_a_file(run, tmp_path) -> None:
    """They gate nothing, but a line that says pass does not hide them."""
    file = tmp_path / "silent.yaml"
    file.write_text(mission_text())
    result = run("check", "-q", file)
    assert result.exit_code == 1
    assert result.stdout.splitlines()[0].endswith("; 1 warning about the file")


def test_quiet_does_not_shorten_a_report_beside_it(run, failing, tmp_path) -> None:
    report = tmp_path / "report.txt"
    run("check", "-q", failing, "--report", report)
    assert "allowable" in report.read_text(encoding="utf-8")


def test_a_name_that_is_empty_is_refused(run) -> None:
    result = run("check", "")
    assert result.exit_code == 2
    assert "the name of a file is empty" in result.stderr
