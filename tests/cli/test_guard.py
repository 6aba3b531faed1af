"""`check --guard` on the command line."""

import json

import pytest

from tests.conftest import ROOT

MISSION = str(ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml")
OTHER = str(ROOT / "specs" / "missions" / "tandem_x.yaml")
KEY = "platforms.receiver.motion_error.velocity"
SET = ("--set", f"{KEY}=5 mm/s ± 20 %")


def test_json_has_the_probabilities_and_the_figures(run) -> None:
    done = run("check", MISSION, *SET, "--guard", "--format", "json")
    (mission,) = json.loads(done.stdout)["missions"]
    assert mission["guard"]["figures"] == [{"key": KEY, "relative_uncertainty": pytest.approx(0.2)}]
    for requirement in mission["guard"]["requirements"]:
        assert list(requirement) == ["key", "use", "use_uncertainty", "false_acceptance", "false_rejection"]
    without = run("check", MISSION, *SET, "--format", "json")
    (plain,) = json.loads(without.stdout)["missions"]
    assert "guard" not in plain
    del mission["guard"]
    assert mission == plain
    assert done.exit_code == without.exit_code


def test_several_missions_and_reports(run, tmp_path) -> None:
    report = tmp_path / "report.html"
    done = run("check", MISSION, OTHER, "--guard", "--format", "json", "--report", str(report))
    assert [mission["guard"] for mission in json.loads(done.stdout)["missions"]] == [
        {"requirements": [], "figures": []}
    ] * 2
    assert report.read_text(encoding="utf-8").count("no figure states an uncertainty") == 2


def test_the_text_has_it_and_unusable_files_do_not_matter(run, tmp_path) -> None:
    (tmp_path / "bad.yaml").write_text("schema_version: 1\n", encoding="utf-8")
    done = run("check", MISSION, str(tmp_path / "bad.yaml"), *SET, "--guard")
    assert done.exit_code == 2
    assert "Guard: " in done.stdout


def test_it_is_not_for_an_explanation(run) -> None:
    done = run("check", MISSION, "--guard", "--explain", "receiver.velocity.x")
    assert done.exit_code == 2
    assert "--guard" in done.stderr
