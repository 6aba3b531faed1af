"""Reasons and notes are data: every finding has the code of its sentence, and all sentences stand in one place."""

import json
import pickle

import pytest

from bisar_budget import phrases
from bisar_budget.budget.check import check_mission
from bisar_budget.findings.mission import Report
from bisar_budget.mission.load import load_mission
from bisar_budget.phrases import CODES, Note
from bisar_budget.report import Style, render
from tests.conftest import ROOT, TODAY

MISSIONS = [
    *sorted((ROOT / "specs" / "missions").glob("*.yaml")),
    *sorted((ROOT / "tests" / "acceptance" / "good").glob("*.yaml")),
]


@pytest.mark.parametrize("model", ["published", "full", "strictest"])
@pytest.mark.parametrize("path", MISSIONS, ids=lambda path: path.stem)
def test_every_sentence_of_a_finding_has_its_code(path, model: str) -> None:
    found = check_mission(load_mission(str(path), model), TODAY)
    for row in found.rows:
        for note in (*([row.reason] if row.reason else []), *row.notes):
            assert note.code in CODES, (row.id, note)
    assert {note.code for note in found.notes} <= CODES.keys()
    for written, row in zip(
        json.loads(render("json", Report("1", (found,)), Style()))["missions"][0]["rows"], found.rows, strict=True
    ):
        assert written["reason_code"] == (row.reason.code if row.reason else None)
        assert written["note_codes"] == [note.code for note in row.notes]
        assert len(written["notes"]) == len(written["note_codes"])


def test_a_note_is_its_words_with_what_they_are_made_of() -> None:
    note = phrases.quadratic_phase_over(1.2345, 0.7854, "Table I row 2")
    assert note == "QPE 1.23 rad, 0.785 rad allowed (Table I row 2)"
    assert (note.code, note.values) == ("quadratic-phase-over", (1.2345, 0.7854, "Table I row 2"))
    more = note.then("", phrases.passes_from(2.0))
    assert more == f"{note}; passes with autofocus from n_pull 2"
    assert more.code == note.code
    assert more.values[-1].code == "passes-from"
    assert phrases.NOTHING.then(more) is phrases.NOTHING
    assert not phrases.NOTHING


def test_a_note_comes_back_from_another_process() -> None:
    note = pickle.loads(pickle.dumps(phrases.passes_from(2.0)))
    assert isinstance(note, Note)
    assert (note, note.code, note.values) == ("passes with autofocus from n_pull 2", "passes-from", (2.0,))
