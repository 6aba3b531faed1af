"""`bisar-budget diff`: what a change uses up, against another file or a git revision."""

import json
import os
import subprocess
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.findings.row import Row
from bisar_budget.report.change.comparison import Change, Gate, compare
from tests.conftest import findings, mission_text, row

LIMIT = findings().allocation.qpe_limit("mission")
RMS = "platforms__receiver__motion_error__vibration__wideband__rms"
BASE = {"timing_error__quadratic": 3e-13, "other_errors": [{"name": "a", "quadratic_phase_error": 0.1}]}


@cache
def of_use(use: float | None) -> Row | None:
    """The row of one phase error, given as a part of its limit."""
    errors = [] if use is None else [{"name": "a", "quadratic_phase_error": use * LIMIT}]
    found = findings(other_errors=errors)
    return next((r for r in found.rows if r.id == "other.a"), None)


def change(before: float | None, after: float | None) -> Change:
    """A change of one declared phase error, given as parts of its limit."""
    return Change("other.a", of_use(before), of_use(after))


class TestErosion:
    @pytest.mark.parametrize(
        ("before", "after", "erosion"),
        [
            (0.5, 0.6, 0.2),  # a fifth of the half that was left
            (0.5, 0.5, 0),
            (0.5, 0.25, -0.5),
            (0, 0.3, 0.3),
            (None, 0.3, 0.3),
            (0.3, None, -0.3 / 0.7),
            (0.9, 1.0, 1),
            (0.9, 1.1, 2),
            (1.0, 1.5, 0.5),  # nothing was left: growth
            (2.0, 3.0, 0.5),
            (2.0, 1.0, -0.5),
        ],
    )
    def test_is_the_part_of_what_was_left(self, before, after, erosion) -> None:
        assert change(before, after).erosion == pytest.approx(erosion, abs=1e-9)

    @given(st.floats(0, 0.99), st.floats(0, 3), st.floats(0, 3))
    def test_more_use_is_more_erosion(self, before: float, one: float, other: float) -> None:
        smaller, larger = sorted((one, other))
        assert change(before, smaller).erosion <= change(before, larger).erosion

    def test_newly_failing(self) -> None:
        assert change(0.9, 1.1).is_newly_failing
        assert change(None, 1.1).is_newly_failing
        assert not change(1.2, 1.1).is_newly_failing
        assert not change(0.5, 0.9).is_newly_failing

    def test_gate_on_both_sides_of_what_is_tolerated(self) -> None:
        assert not change(0.5, 0.55).breaks(0.1)
        assert change(0.5, 0.551).breaks(0.1)
        assert change(0.99, 1.01).breaks(1.0)  # newly failing, whatever is tolerated
        assert not change(0.5, 0.4).breaks(0.0)

    def test_a_row_that_judges_nothing_breaks_nothing(self) -> None:
        found = [
            findings(allocation__combine="sum", other_errors=[{"name": "a", "quadratic_phase_error": size}])
            for size in (0.1, 0.7)
        ]
        (single,) = [c for c in compare(*found).changes if c.id == "other.a"]
        assert single.erosion > 0.5
        assert not single.breaks(0.1)


class TestCompare:
    def test_the_worst_is_first_and_the_rest_is_counted(self) -> None:
        before = findings(**BASE)
        after = findings(**{**BASE, "timing_error__quadratic": 1e-12, "timing_error__constant": 1e-9})
        result = compare(before, after)
        assert result.changes[0].id == "timing.quadratic"
        assert result.changes[0].is_newly_failing
        assert {c.id for c in result.changes} == {"timing.quadratic", "timing.constant", "mission.location_error"}
        assert result.unchanged + len(result.changes) == len(after.rows)

    def test_what_nothing_judges_any_more_is_newly_failing(self) -> None:
        """A requirement that lost what judges it, and a row that is not evaluated any more, passed every gate."""
        needs = {"requirements": {"islr": "-20 dB"}}
        noise = {"platforms__receiver__motion_error__vibration": {"wideband": {"rms": "1 um"}}}
        result = compare(findings(**BASE, **needs, **noise), findings(**BASE, **needs))
        (lost,) = [one for one in result.requirements if one.key == "islr"]
        assert (lost.before, lost.after, lost.is_newly_failing) == ("pass", "not_evaluated", True)
        assert "mission.islr" in [one.id for one in result.refusals(Gate(1.0)) if not one.is_allowed]
        back = compare(result.after, result.before)
        assert not any(one.is_newly_failing for one in back.requirements)
        assert not back.refusals(Gate(1.0))
        unasked = compare(findings(**BASE, **needs, **noise), findings(**BASE, **{RMS: "1 mm"}))
        assert [c.id for c in unasked.changes if c.is_newly_failing] == ["receiver.vibration.wideband"]

    def test_a_moved_line_is_no_change(self) -> None:
        from bisar_budget.budget.check import check_mission
        from bisar_budget.mission.load import parse_mission
        from tests.conftest import TODAY

        text = mission_text(**BASE)
        moved = [check_mission(parse_mission(t, "m.yaml"), TODAY) for t in (text, "# comment\n" + text)]
        assert compare(*moved).changes == ()

    def test_rows_that_come_and_go(self) -> None:
        result = compare(findings(**BASE), findings(timing_error__quadratic=3e-13))
        (gone,) = result.changes
        assert (gone.id, gone.after) == ("other.a", None)
        assert gone.erosion < 0

    def test_a_new_limit_erodes_every_row_it_holds(self) -> None:
        """Half the budget for the same errors: use doubles."""
        result = compare(findings(**BASE), findings(**BASE, requirements__quadratic_phase_error=LIMIT / 2))
        by_id = {c.id: c for c in result.changes}
        first, second = by_id["other.a"].use
        assert second == pytest.approx(2 * first)


class TestInputs:
    @staticmethod
    def moved(before: dict, after: dict) -> dict[str, tuple[str | None, str | None]]:
        change = compare(findings(**before), findings(**after))
        return {move.name: (move.before, move.after) for move in change.inputs}

    def test_keys_that_changed_came_and_went(self) -> None:
        before = {**BASE, "radar__bandwidth": "300 MHz"}
        after = {"radar__bandwidth": "600 MHz", "timing_error__quadratic": 3e-13, "scene__radius": "250 m"}
        assert self.moved(before, after) == {
            "radar.bandwidth": ("300 MHz", "600 MHz"),
            "other_errors[0].name": ("a", None),
            "other_errors[0].quadratic_phase_error": ("0.1 rad", None),
            "scene.radius": (None, "250 m"),
        }

    def test_the_same_value_in_other_words_is_no_change(self) -> None:
        assert self.moved({"radar__bandwidth": "300 MHz"}, {"radar__bandwidth": "0.3 GHz"}) == {}

    def test_a_vector_is_one_value(self) -> None:
        error = "platforms__receiver__motion_error__velocity"
        moved = self.moved({error: "5 mm/s"}, {error: ["5 mm/s", 0, "1 mm/s"]})
        assert moved == {error.replace("__", "."): ("5 mm/s", "[5 mm/s, 0, 1 mm/s]")}


class TestGeometry:
    def test_resolution_and_angles(self) -> None:
        """Twice the bandwidth halves the range cell; no angle moves."""
        (move,) = compare(findings(), findings(radar__bandwidth="600 MHz")).geometry
        assert (move.name, move.unit) == ("range resolution", "m")
        assert move.after == pytest.approx(move.before / 2)
        turned = compare(findings(), findings(platforms__receiver__velocity=[-40, 0, 0])).geometry
        names = [move.name for move in turned]
        assert names == ["receiver squint", "angle between range and Doppler gradients", "cross-range resolution"]


class TestSmallMoves:
    @pytest.mark.parametrize(
        ("before", "after", "is_small"),
        [(0.5, 0.504, True), (0.5, 0.506, False), (0.99, 0.995, False), (0.5, None, False), (0.0, 0.001, False)],
    )
    def test_below_one_percent_of_value_and_of_what_was_left(self, before, after, is_small) -> None:
        assert change(before, after).is_small == is_small

    def test_are_hidden_and_counted_unless_all_are_asked_for(self, run, tmp_path) -> None:
        old, new = tmp_path / "old.yaml", tmp_path / "new.yaml"
        old.write_text(mission_text(**BASE))
        new.write_text(mission_text(**{**BASE, "timing_error__quadratic": 3.01e-13}))
        for name in ("text", "markdown"):
            short, long = (run("diff", old, new, "--format", name, *more).stdout for more in ((), ("--all",)))
            assert "1 row changed (1 by less than 1 %, shown with --all)" in " ".join(short.split())
            assert ("timing.quadratic" in short, "timing.quadratic" in long) == (False, True)
            assert "by less than" not in long
        refused = run("diff", old, new, "--fail-on-erosion", "0").stdout
        assert "timing.quadratic" in refused

    def test_json_has_every_row(self, run, tmp_path) -> None:
        old, new = tmp_path / "old.yaml", tmp_path / "new.yaml"
        old.write_text(mission_text(**BASE))
        new.write_text(mission_text(**{**BASE, "timing_error__quadratic": 3.01e-13}))
        (mission,) = json.loads(run("diff", old, new, "--format", "json").stdout)["missions"]
        assert [row["id"] for row in mission["rows"]] == ["timing.quadratic"]
        assert mission["inputs"] == [{"key": "timing_error.quadratic", "before": "3.0e-13", "after": "3.01e-13"}]
        assert mission["geometry"] == []


@pytest.fixture
def repository(tmp_path):
    """A repository with a mission that has since become worse."""
    mission = tmp_path / "missions" / "m.yaml"
    mission.parent.mkdir()
    mission.write_text(mission_text(**BASE))
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "-c", "user.name=t", "-c", "user.email=t@example.org", "commit", "-q", "-m", "x")
    mission.write_text(mission_text(**{**BASE, "timing_error__quadratic": 1e-12}))
    return mission


def git(folder, *arguments: str) -> None:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("GIT_")} | {
        "GIT_CONFIG_GLOBAL": os.devnull
    }
    subprocess.run(["git", *arguments], cwd=folder, check=True, capture_output=True, env=environment)


class TestCommand:
    def test_two_files(self, run, tmp_path) -> None:
        old, new = tmp_path / "old.yaml", tmp_path / "new.yaml"
        old.write_text(mission_text(**BASE))
        new.write_text(mission_text(**{**BASE, "timing_error__quadratic": 4e-13}))
        result = run("diff", old, new)
        assert result.exit_code == 0
        (line,) = [line for line in result.stdout.splitlines() if line.startswith("timing.quadratic")]
        use = [row(findings(timing_error__quadratic=q), "timing.quadratic").utilization for q in (3e-13, 4e-13)]
        assert f"{100 * use[0]:.3g} %" in line
        assert f"{100 * (use[1] - use[0]) / (1 - use[0]):.3g} %" in line
        assert run("diff", old, new, "--fail-on-erosion", "50%").exit_code == 0
        assert run("diff", old, new, "--fail-on-erosion", "10%").exit_code == 1
        back = ("diff", new, old, "--fail-on-erosion", "0")  # smaller, and no source says why
        assert run(*back).exit_code == 1
        assert run(*back, "--allow", "timing.quadratic").exit_code == 0

    def test_against_a_revision(self, run, repository) -> None:
        result = run("diff", repository, "--base", "HEAD", "--fail-on-erosion", "100%")
        assert result.exit_code == 1
        assert "pass -> FAIL" in result.stdout
        assert "1 newly failing" in result.stdout

    @pytest.mark.parametrize("name", ["a\nb.yaml", "\n.yaml", "a\nb/m.yaml"])
    def test_a_name_with_a_line_end_is_found(self, run, repository, name, monkeypatch) -> None:
        """It was new in each comparison, so that no gate looked at it."""
        monkeypatch.chdir(repository.parent)
        mission = repository.parent / name
        mission.parent.mkdir(exist_ok=True)
        mission.write_text(mission_text(**BASE))
        git(repository.parent, "add", ".")
        git(repository.parent, "-c", "user.name=t", "-c", "user.email=t@example.org", "commit", "-q", "-m", "x")
        gate = ("--base", "HEAD", "--fail-on-erosion", "10%")
        assert run("diff", name, *gate).exit_code == 0
        assert "new, there is nothing" not in run("diff", name, *gate).stdout
        mission.write_text(mission_text(**{**BASE, "timing_error__quadratic": 1e-12}))
        for pattern in (name, "**/*.yaml"):
            done = run("diff", pattern, *gate)
            assert done.exit_code == 1
            assert "pass -> FAIL" in done.stdout
        mission.unlink()
        gone = run("diff", "**/*.yaml", *gate)
        assert gone.exit_code == 1
        assert "the mission file is gone" in gone.stdout

    def test_from_another_folder(self, run, repository, monkeypatch) -> None:
        monkeypatch.chdir(repository.parent)
        assert run("diff", "m.yaml", "--base", "HEAD").exit_code == 0

    def test_json(self, run, repository) -> None:
        document = json.loads(run("diff", repository, "--base", "HEAD", "--format", "json").stdout)
        assert document["format"] == "bisar-budget/diff/1"
        (mission,) = document["missions"]
        assert mission["after"]["status"] == "fail"
        first = mission["rows"][0]
        assert first["id"] == "timing.quadratic"
        assert first["is_newly_failing"] is True
        assert first["before"]["margin"] > 0 > first["after"]["margin"]

    def test_markdown_is_a_table(self, run, tmp_path) -> None:
        name = "a|b`<c>"
        for file, size in (("old.yaml", 0.1), ("new.yaml", 0.2)):
            text = mission_text(other_errors=[{"name": name, "quadratic_phase_error": size}])
            (tmp_path / file).write_text(text)
        text = run("diff", tmp_path / "old.yaml", tmp_path / "new.yaml", "--format", "markdown").stdout
        assert r"- other_errors\[0\].quadratic_phase_error: 0.1 rad → 0.2 rad" in text.splitlines()
        rows = [line for line in text.splitlines() if line.startswith("|")]
        assert len(rows) == 3
        assert {line.count("|") for line in rows} == {8}
        assert "0.1 rad → 0.2 rad" in rows[2]

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (["--base", "nowhere"], "no revision nowhere"),
            (["--base", "--output=x"], "no revision --output=x"),
            (["--base", ""], "no revision"),
            ([], "give two mission files"),
            (["--base", "HEAD", "--fail-on-erosion", "ten"], "must be 0% to 100%"),
            (["--base", "HEAD", "--fail-on-erosion", "10"], "must be 0% to 100%"),
            (["--base", "HEAD", "--fail-on-erosion", "-1%"], "must be 0% to 100%"),
        ],
    )
    def test_wrong_usage_is_2(self, run, repository, arguments, message) -> None:
        result = run("diff", repository, *arguments)
        assert result.exit_code == 2
        assert message in result.stderr
        assert result.stdout == ""

    def test_a_file_that_the_revision_does_not_have_is_new(self, run, repository) -> None:
        new = repository.with_name("new.yaml")
        new.write_text(mission_text())
        result = run("diff", new, "--base", "HEAD", "--fail-on-erosion", "0")
        assert result.exit_code == 0
        assert "missions/new.yaml: new, there is nothing to compare it with" in " ".join(result.stdout.split())

    def test_no_repository(self, run, tmp_path) -> None:
        (tmp_path / "m.yaml").write_text(mission_text())
        result = run("diff", tmp_path / "m.yaml", "--base", "HEAD", env={"GIT_CEILING_DIRECTORIES": str(tmp_path)})
        assert result.exit_code == 2
        assert "not in a git repository" in result.stderr

    def test_no_git(self, run, repository) -> None:
        result = run("diff", repository, "--base", "HEAD", env={"PATH": ""})
        assert result.exit_code == 2
        assert "git cannot be run" in result.stderr

    def test_unusable_files_name_their_faults(self, run, repository) -> None:
        repository.write_text("nonsense: 1\n")
        result = run("diff", repository, "--base", "HEAD")
        assert result.exit_code == 2
        assert f"{repository}:1:1: nonsense" in result.stderr
        git(repository.parent, "-c", "user.name=t", "-c", "user.email=t@e", "commit", "-qam", "broken")
        repository.write_text(mission_text())
        result = run("diff", repository, "--base", "HEAD")
        assert result.exit_code == 2
        assert f"HEAD:{repository}:1:1: nonsense" in result.stderr
        assert run("diff", repository, repository.with_name("none.yaml")).exit_code == 2
