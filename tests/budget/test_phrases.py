"""Reasons and notes are data: every finding has the code of its sentence, and all sentences stand in one place."""

import json
import pickle

import pytest

from bisar_budget import phrases
from bisar_budget.budget import file_warnings
from bisar_budget.findings.images import Verdict, VerifiedMission
from bisar_budget.findings.mission import Report
from bisar_budget.mission.load import load_mission
from bisar_budget.phrases import CODES, Note
from bisar_budget.report import Style, render
from bisar_budget.report.formats import verification
from bisar_budget.verifier import reasons
from bisar_budget.verifier.limits import verify_mission
from tests.conftest import ROOT, by_turns, findings, found_in, name_of

MISSIONS = [
    *sorted((ROOT / "specs" / "missions").glob("*.yaml")),
    *sorted((ROOT / "tests" / "acceptance" / "good").glob("*.yaml")),
]


@pytest.mark.parametrize(("path", "model"), by_turns(MISSIONS, ("published", "full", "strictest")), ids=name_of)
def test_every_sentence_of_a_finding_has_its_code(path, model: str) -> None:
    found = found_in(path, model)
    for row in found.rows:
        for note in (*([row.reason] if row.reason else []), *row.notes):
            assert note.code in CODES, (row.id, note)
    assert {note.code for note in found.notes} <= CODES.keys()
    (mission,) = json.loads(render("json", Report("1", (found,)), Style()))["missions"]
    assert mission["note_codes"] == [note.code for note in found.notes]
    assert [one["code"] for one in mission["warnings"]] == [warning.message.code for warning in found.warnings]
    assert {one["code"] for one in mission["warnings"]} <= CODES.keys()
    for written, row in zip(mission["rows"], found.rows, strict=True):
        assert written["reason_code"] == (row.reason.code if row.reason else None)
        assert written["note_codes"] == [note.code for note in row.notes]
        assert len(written["notes"]) == len(written["note_codes"])


@pytest.mark.parametrize("name", ["rigling_moses_section_v_autofocus", "tandem_x"])
def test_every_sentence_of_a_verdict_has_its_code(name: str) -> None:
    path = ROOT / "specs" / "missions" / f"{name}.yaml"
    verified = verify_mission(load_mission(str(path)), "mission.*")
    assert verified.rows
    (mission,) = json.loads(verification.as_json([verified], Style()))["missions"]
    for verdict, written in zip(verified.rows, mission["rows"], strict=True):
        codes = [None if reason is None else reason.code for reason in (verdict.reason, verdict.reason_autofocus)]
        assert [written["reason_code"], written["reason_autofocus_code"]] == codes
        assert set(codes) <= CODES.keys() | {None}


def test_no_two_sentences_have_one_code() -> None:
    sentences = [
        name
        for module in (phrases, file_warnings, reasons)
        for name, one in vars(module).items()
        if getattr(one, "__wrapped__", None) is not None and one.__module__ == module.__name__
    ]
    assert len(sentences) > 130
    assert sorted(CODES) == sorted(name.replace("_", "-") for name in sentences)


def test_warnings_that_take_a_particular_mission() -> None:
    """Each as its function says it, with what it is made of."""
    (warning,) = findings(
        platforms__transmitter={"position": ["700 km", 0, "500 km"], "velocity": [0, "7.6 km/s", 0]},
        platforms__receiver__motion_error={"position": "1 mm"},
    ).warnings
    assert warning.message.code == "satellite-flies-straight"
    assert warning.message.values[:2] == ("transmitter", 7600)
    verified = VerifiedMission("m.yaml", "m", (Verdict("other.e", "full", 1.0, "rad"),))
    assert verified.doubt == "nothing was verified: 1 row with a limit, and no image gave a verdict on any"
    assert (verified.doubt.code, verified.doubt.values) == ("nothing-verified", (1,))


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


def test_a_note_includes_another_by_code_and_values_whatever_its_words() -> None:
    first, second = phrases.no_power_law_fits("platforms.receiver.oscillator", 0.4), phrases.nothing_judges("islr")
    both = second.then(first, phrases.no_gain())
    assert all(both.includes(note) for note in (first, second, phrases.no_gain()))
    assert not both.includes(phrases.no_power_law_fits("platforms.transmitter.oscillator", 0.4))
    assert not both.includes(phrases.nothing_judges("pslr"))
    assert not Note(str(first)).includes(first)
    assert phrases.NOTHING.then(first).includes(first) is False
