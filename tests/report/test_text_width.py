"""Text for a terminal stays within 80 columns, whatever a mission is called and whatever its ids are."""

import pytest

from bisar_budget.budget.check import check_mission
from bisar_budget.findings.images import Verdict, VerifiedMission
from bisar_budget.mission.load import load_mission
from bisar_budget.report import Style
from bisar_budget.report.answers import written
from bisar_budget.report.explain.explanation import explain
from bisar_budget.report.words.sentences import TEXT_WIDTH, table
from tests.conftest import ROOT, TODAY, findings, mission_text

NAME = "A mission whose name alone is longer than a line of a terminal was ever meant to be, with aircraft"
LONG = "SYSTEM-NAVIGATION-REQUIREMENT-012-REVISION-3"
ODD = {
    "name": NAME,
    "platforms__receiver__motion_error": {
        "frame": "look",
        "velocity": ["12.3456 mm/s", "-0.1 m/s", 0],
        "acceleration": ["1 mm/s^2", "1e-9 m/s^2", "3 m/s^2"],
        "position": "3 m",
        "vibration": {"sinusoidal": [{"amplitude": "10 um", "frequency": 9 + n} for n in range(12)]},
        "source": "a data sheet with a long title that says very little about the error, revision C, page 123",
    },
    "timing_error": {"constant": 1e-9, "linear": 1e-13, "quadratic": 1e-12, "cubic": 1e-15},
    "other_errors": [
        {"name": "troposphere-and-ionosphere-of-the-worst-case", "quadratic_phase_error": 0.3, "source": NAME}
    ],
    "requirements": {"location_error": 5, "cubic_phase_error": 0.2, "pslr": -30, "islr": -20},
    "requirement_ids": {"receiver.velocity.line_of_sight": LONG, "mission.location_error": LONG},
    "waivers": [{"id": "receiver.acceleration.*", "until": "2030-01-01", "reason": NAME}],
    "autofocus": {"n_pull": 2},
}
MODELS = ("published", "full", "strictest")


def too_long(text: str) -> list[str]:
    """Lines beyond 80 columns that could have been broken: a path or an id stays whole, with the status before it."""
    starts = ("ERROR ", "FAIL ", "NOT EVAL ", "WARN ", "pass AF ", "pass ")
    lines = [next((line.removeprefix(s) for s in starts if line.startswith(s)), line) for line in text.splitlines()]
    return [line for line in lines if len(line) > TEXT_WIDTH and " " in line.strip()]


@pytest.fixture
def odd(tmp_path):
    folder = tmp_path / "a-folder-of-missions-that-somebody-named-with-care" / "and-another-one"
    folder.mkdir(parents=True)
    paths = []
    for model in MODELS:
        for combine in ("each", "sum"):
            path = folder / f"mission-{model}-{combine}.yaml"
            path.write_text(mission_text(**ODD, allocation={"model": model, "combine": combine}), encoding="utf-8")
            paths.append(path)
    return paths


MISSIONS = sorted((ROOT / "specs" / "missions").glob("*.yaml"))


@pytest.mark.parametrize("options", [(), ("-v",), ("--model", "full"), ("--model", "strictest", "-v")], ids=str)
def test_check(run, odd, options) -> None:
    for path in [*MISSIONS, *odd]:
        assert too_long(run("check", path, *options).stdout) == []


def test_explain(run, odd) -> None:
    """Every row of the odd ones; all rows of the examples are explained where each is repeated by hand."""
    for path in [*MISSIONS, *odd]:
        mission = load_mission(str(path))
        found = check_mission(mission, TODAY)
        explained = found.rows if path in odd else found.rows[:1]
        texts = {row.id: explain(mission, found, row.id) for row in explained}
        assert {row_id: too_long(text) for row_id, text in texts.items()} == {key: [] for key in texts}
        row_id = found.rows[0].id
        shown = run("check", path, "--explain", row_id).stdout
        assert shown.partition("Overrides: ")[0] == texts[row_id]
        assert too_long(shown) == []


def test_diff(run, odd) -> None:
    for before in odd:
        for after in odd:
            assert too_long(run("diff", before, after, "--fail-on-erosion", "1%").stdout) == []


def test_verdicts() -> None:
    """Every kind of row with its widest numbers, with and without autofocus."""
    ids = [*(row.id for row in findings(**ODD).rows), "mission.vibration.sinusoidal"]
    wide = {
        "boundary_error": 1.234e-15, "boundary_autofocus": 1.234e-15, "budget_rad": 12.345, "full_qpe_rad": 12.345,
        "predicted_qpe_rad": 123.456, "measured_qpe_rad": 123.456, "measured_residual_qpe_rad": 12.345,
        "refocused_loss_db": -12.3, "reason": NAME, "reason_autofocus": NAME,
    }  # fmt: skip
    rows = [
        Verdict(id=row_id, model="full", unit="1/s^2", verdict="conservative", verdict_autofocus="optimistic", **wide)
        for row_id in ids
    ]
    level = {"boundary_error": 123.4e-6, "requirement_db": -30.5, "measured_db": -39.12}
    rows += [row._replace(unit="m", **level) for row in rows]
    verified = VerifiedMission(file="a-folder/" + "x" * 60 + ".yaml", name=NAME, rows=tuple(rows), conditions=NAME)
    for color in (False, True):
        text = str(written("verify", "text", [verified], Style(color=color)))
        assert too_long(text.replace("\x1b[33m", "").replace("\x1b[1;31m", "").replace("\x1b[0m", "")) == []
    assert "\x1b[1;31moptimistic" in text


def test_a_name_too_long_for_its_line_stands_above_its_numbers() -> None:
    lines = table([("row", "limit", "verdict"), ("short", "1 m", "yes"), ("long" * 20, "22 m", "no")])
    assert lines == ["row   limit verdict", "short   1 m yes", "long" * 20, "       22 m no"]


@pytest.mark.parametrize("options", [(), ("--all",)], ids=str)
def test_a_row_stays_on_its_line_where_100_columns_are_there(run, monkeypatch, options) -> None:
    """Status and id of a row stood on a line of their own, and the numbers on the next, in every example."""
    monkeypatch.setenv("COLUMNS", "100")
    for path in MISSIONS:
        lines = run("check", path, *options).stdout.splitlines()
        assert max(map(len, lines)) <= 100
        begin, end = (next(n for n, line in enumerate(lines) if line.startswith(s)) for s in ("status ", "use: "))
        assert [line for line in lines[begin:end] if len(line.split()) <= 3] == [], path


def test_columns_of_a_table_are_80_to_100(run, monkeypatch) -> None:
    texts = {}
    for columns in ("40", "80", "100", "200"):
        monkeypatch.setenv("COLUMNS", columns)
        texts[columns] = run("check", ROOT / "specs" / "missions" / "holdover_roof_receiver.yaml").stdout
    assert texts["40"] == texts["80"]
    assert texts["100"] == texts["200"]
    assert "transmitter.quadratic_phase_error\n" in texts["80"]
    assert "transmitter.quadratic_phase_error\n" not in texts["100"]
