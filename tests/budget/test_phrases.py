"""Reasons and notes are data: every finding has the code of its sentence, and all sentences stand in one place."""

import ast
import json
import math
import pickle
import re
from collections.abc import Iterator

import pytest

from bisar_budget import phrases
from bisar_budget.findings.images import Verdict, VerifiedMission
from bisar_budget.findings.mission import Report
from bisar_budget.mission.load import load_mission
from bisar_budget.phrases import CODES, SENTENCE_TABLES, Note
from bisar_budget.phrases.notes import COMPOSED
from bisar_budget.phrases.templates import fields, fill
from bisar_budget.report import Style, render
from bisar_budget.report.answers import written
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
    for item, row in zip(mission["rows"], found.rows, strict=True):
        assert item["reason_code"] == (row.reason.code if row.reason else None)
        assert item["note_codes"] == [note.code for note in row.notes]
        assert len(item["notes"]) == len(item["note_codes"])


@pytest.mark.parametrize("name", ["rigling_moses_section_v_autofocus", "tandem_x"])
def test_every_sentence_of_a_verdict_has_its_code(name: str) -> None:
    path = ROOT / "specs" / "missions" / f"{name}.yaml"
    verified = verify_mission(load_mission(str(path)), "mission.*")
    assert verified.rows
    (mission,) = json.loads(written("verify", "json", [verified], Style()))["missions"]
    for verdict, item in zip(verified.rows, mission["rows"], strict=True):
        codes = [None if reason is None else reason.code for reason in (verdict.reason, verdict.reason_autofocus)]
        assert [item["reason_code"], item["reason_autofocus_code"]] == codes
        assert set(codes) <= CODES.keys() | {None}


def test_no_two_sentences_have_one_code() -> None:
    codes = [code for table in SENTENCE_TABLES for code in table] + [*COMPOSED]
    assert len(codes) == len(set(codes)) == len(CODES) > 190


class TestTemplates:
    """A call of `note` names a code of the table, and its quantities are the fields of the template."""

    @staticmethod
    def calls() -> Iterator[tuple[str, ast.Call]]:
        for path in sorted((ROOT / "bisar_budget").rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Call) and ast.unparse(node.func) == "phrases.note":
                    yield f"{path.name}:{node.lineno}", node

    def test_every_call_has_the_fields_of_its_template(self) -> None:
        for place, call in self.calls():
            (code,) = (argument.value for argument in call.args if isinstance(argument, ast.Constant))
            given = {keyword.arg for keyword in call.keywords}
            assert given == fields(phrases.TEMPLATES[code]), (place, code)

    @pytest.mark.parametrize("unit", ["m", "m/s^2", "s^2/m", "dB", "rad", "1/s^2"])
    def test_every_template_can_be_filled(self, unit: str) -> None:
        """A format that takes a unit takes any: the unit of a sensitivity to acceleration was none of the known."""
        items = re.compile(r"{(\w+):(?:list|and|or)\b")
        for code, template in phrases.TEMPLATES.items():
            quantities: dict[str, object] = dict.fromkeys(fields(template), 1.5)
            quantities |= {key: ["a", "b"] for key in items.findall(template)} | {"unit": unit}
            note = phrases.note(code, **quantities)
            assert note.code == code
            assert "{" not in note

    def test_every_template_is_used(self) -> None:
        used = {argument.value for _, call in self.calls() for argument in call.args}
        assert phrases.TEMPLATES.keys() == used

    def test_a_field_without_a_quantity_raises(self) -> None:
        for code, template in phrases.TEMPLATES.items():
            for name in fields(template):
                quantities = dict.fromkeys(fields(template) - {name}, 1.0)
                with pytest.raises((KeyError, TypeError)):
                    phrases.note(code, **quantities)
        with pytest.raises(KeyError):
            phrases.note("no-such-sentence")

    @pytest.mark.parametrize(
        ("template", "quantities", "text"),
        [
            (
                "{phase:rad}, {limit:limit rad} allowed",
                {"phase": 0.12345, "limit": 0.78539},
                "0.123 rad, 0.785 rad allowed",
            ),
            ("{length:m} and {length:m 2}", {"length": 12345.0}, "12.3 km and 12 km"),
            ("{size:size {unit}}", {"size": -2.0, "unit": "rad"}, "2 rad"),
            ("{size:size m}", {"size": math.inf}, "without a value (no ground point has this range history)"),
            ("{limit:limit {unit}}", {"limit": 1.2399e-3, "unit": "s^2/m"}, "0.0121 /g"),
            ("{level:dB}, {level:dB down}", {"level": -18.456}, "-18.5 dB, -18.5 dB"),
            ("{share:percent}, {share:percent .0f}", {"share": 0.1234}, "12.3 %, 12 %"),
            ("{a:m/s^2 as g}", {"a": 9.80665}, "1 g"),
            ("{time:min}", {"time": 600.0}, "10 min"),
            ("{cycles:cycles}", {"cycles": 2.9999}, "2.99"),
            ("{rows:count row}", {"rows": 1}, "1 row"),
            ("{rows:count row}", {"rows": 3}, "3 rows"),
            ("{keys:list}; {keys:and}; {keys:or}", {"keys": ["a", "b"]}, "a, b; a and b; a or b"),
            (
                "{names:and platforms.*.oscillator}",
                {"names": ("t", "r")},
                "platforms.t.oscillator and platforms.r.oscillator",
            ),
            ("{factor:.3g} of {name}", {"factor": 1.23456, "name": "x"}, "1.23 of x"),
        ],
    )
    def test_quantities(self, template: str, quantities: dict[str, object], text: str) -> None:
        assert fill(template, quantities) == text
        assert fields(template) == quantities.keys()

    @pytest.mark.parametrize(("template", "value"), [("{x:m}", "a"), ("{x:limit m}", None), ("{x:list}", 1.0)])
    def test_a_quantity_of_the_wrong_kind_raises(self, template: str, value: object) -> None:
        with pytest.raises(TypeError):
            fill(template, {"x": value})


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
    more = note.then("", phrases.note("passes-from", n_pull=2.0))
    assert more == f"{note}; passes with autofocus from n_pull 2"
    assert more.code == note.code
    assert more.values[-1].code == "passes-from"
    assert phrases.NOTHING.then(more) is phrases.NOTHING
    assert not phrases.NOTHING


def test_a_note_comes_back_from_another_process() -> None:
    note = pickle.loads(pickle.dumps(phrases.note("passes-from", n_pull=2.0)))
    assert isinstance(note, Note)
    assert (note, note.code, note.values) == ("passes with autofocus from n_pull 2", "passes-from", (2.0,))


def test_a_note_includes_another_by_code_and_values_whatever_its_words() -> None:
    first, second = (
        phrases.note("no-power-law-fits", key="platforms.receiver.oscillator", misfit=0.4),
        phrases.nothing_judges("islr"),
    )
    both = second.then(first, phrases.note("no-gain"))
    assert all(both.includes(note) for note in (first, second, phrases.note("no-gain")))
    assert not both.includes(phrases.note("no-power-law-fits", key="platforms.transmitter.oscillator", misfit=0.4))
    assert not both.includes(phrases.nothing_judges("pslr"))
    assert not Note(str(first)).includes(first)
    assert phrases.NOTHING.then(first).includes(first) is False
