"""Output of the `solve` command: the values at which compliance begins or ends, or a comparison of parts."""

from collections.abc import Iterator, Sequence

from bisar_budget.faults import printable
from bisar_budget.findings.requirement import REQUIREMENT_NAMES
from bisar_budget.findings.solution import Comparison, Crossing, Imaged, PartState, Solution, State
from bisar_budget.findings.status import STATUS
from bisar_budget.json_types import JsonDocument
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.answers import Records
from bisar_budget.report.answers.check_content import outside_item, verdict_item
from bisar_budget.report.answers.shared_blocks import mission_chapter, mission_document, opening
from bisar_budget.report.words.sentences import percent, use_words, waived_count, waiver_names
from bisar_budget.units import format_quantity

_STATUS_OF_SOLUTION = {
    "crossing": "pass",
    "all": "pass",
    "some": "pass",
    "waived": "waived",
    "none": "fail",
}  # for the colour

Answer = Solution | Comparison


# ---------------------------------------------------------------- for programs
def content(answers: Sequence[Answer]) -> dict[str, object]:
    """Content of the JSON document `solve/1`, in SI units; a missing value is null."""
    return {"missions": [_item(answer) for answer in answers]}


def _item(answer: Answer) -> dict[str, object]:
    item = _solved(answer) if isinstance(answer, Solution) else _compared(answer)
    return {"file": answer.file, "name": answer.name, **outside_item(answer), **item}


_OF_STATE = ("status", "row", "requirement", "utilization", "reason")


def records(answers: Sequence[Answer]) -> Records:
    """Table of the answers: one line for each crossing, or one line for each part of a catalogue.

    A crossing is a value at which the compliance of the mission begins or ends. If a search finds no crossing, its
    line has no value. The columns with `inside` in their names are about the last value that complies, and the
    columns with `outside` are about the next value, which does not comply.
    """
    if any(isinstance(answer, Comparison) for answer in answers):
        return Records(_PART_COLUMNS, [line for answer in answers for line in _part_lines(_item(answer))])
    return Records(_CROSSING_COLUMNS, [line for answer in answers for line in _crossing_lines(_item(answer))])


_OF_ANSWER = ("file", "name", "key", "unit", "target", "model", "status")
_CROSSING_COLUMNS = (
    *_OF_ANSWER, "value", "complies", "is_verified",
    *(f"{side}_{name}" for side in ("inside", "outside") for name in ("value", *_OF_STATE)),
)  # fmt: skip
_PART_COLUMNS = (
    *(name for name in _OF_ANSWER if name not in ("unit", "status")), "part", "part_name", "kind", "is_given",
    *_OF_STATE, "own_row", "own_utilization", "waived_by",
)  # fmt: skip


def _crossing_lines(item: JsonDocument) -> Iterator[dict[str, object]]:
    answer = {name: item[name] for name in _OF_ANSWER}
    for crossing in item["crossings"]:
        sides = {
            f"{side}_{name}": crossing[side][name] for side in ("inside", "outside") for name in ("value", *_OF_STATE)
        }
        yield {**answer, **{name: crossing[name] for name in ("value", "complies", "is_verified")}, **sides}
    if not item["crossings"]:
        yield answer


def _part_lines(item: JsonDocument) -> Iterator[dict[str, object]]:
    answer = {name: item[name] for name in _OF_ANSWER if name not in ("unit", "status")}
    for part in item["parts"]:
        line = {name: part[name] for name in (*_OF_STATE, "kind", "is_given", "own_row", "own_utilization")}
        names = {"part": part["id"], "part_name": part["name"], "waived_by": "; ".join(part["waived_by"]) or None}
        yield {**answer, **names, **line}


def _solved(solution: Solution) -> dict[str, object]:
    best = solution.best
    return {
        "key": solution.key,
        "scale": solution.is_scale,
        "unit": solution.unit,
        "target": solution.target,
        "row": solution.row,
        "model": solution.model,
        "between": [solution.low, solution.high],
        "status": solution.status,
        "value": solution.value,
        "text": None if best is None else solution.texts[best.inside.value],
        "binding_row": None if best is None else best.outside.row,
        "binding_requirement": None if best is None else best.outside.requirement,
        "is_monotonic": solution.is_monotonic,
        "is_constant": solution.is_constant,
        "given": None if solution.given is None else _state(solution.given),
        "crossings": [_crossing(crossing) for crossing in solution.crossings],
        "nearest": _state(solution.nearest),
        "places_without_mission": solution.skipped,
        "places_waived": solution.waived,
        "waived_by": list(solution.waived_by),
        "parts": None,
        "verified": _imaged(solution.imaged),
    }


def _imaged(imaged: Imaged | None) -> dict[str, object] | None:
    """JSON item about the row that was verified in an image; its verdict has the form of `verify --format json`."""
    if imaged is None:
        return None
    return {
        "row": imaged.row,
        "at": imaged.at,
        "verdict": "not_evaluated" if imaged.verdict is None else imaged.verdict.verdict,
        "verdict_autofocus": None if imaged.verdict is None else imaged.verdict.verdict_autofocus,
        "reason": imaged.reason or None,
        "image": None if imaged.verdict is None else verdict_item(imaged.verdict),
    }


def _compared(comparison: Comparison) -> dict[str, object]:
    """JSON item about a comparison of catalogue parts.

    The item has the same keys as the result of `_solved`. Values that do not apply are null.
    """
    best = next(iter(comparison.complying), None)
    return {
        "key": comparison.key,
        "scale": False,
        "unit": None,
        "target": comparison.target,
        "row": comparison.row,
        "model": comparison.model,
        "between": None,
        "status": comparison.status,
        "value": None,
        "text": None if best is None else best.id,
        "binding_row": None if best is None else best.standing.row,
        "binding_requirement": None if best is None else best.standing.requirement,
        "is_monotonic": None,
        "is_constant": None,
        "given": None,
        "crossings": [],
        "nearest": None,
        "places_without_mission": sum(state.standing.status == "error" for state in comparison.parts),
        "places_waived": sum(state.standing.status == "waived" for state in comparison.parts),
        "waived_by": list(dict.fromkeys(waiver for state in comparison.parts for waiver in state.standing.waived_by)),
        "parts": [_part_state(state) for state in comparison.parts],
        "verified": _imaged(comparison.imaged),
    }


def _part_state(state: PartState) -> dict[str, object]:
    return {
        "id": state.id,
        "name": state.name,
        "kind": state.kind,
        "file": state.file,
        "is_given": state.is_given,
        **state.standing._asdict(),
        "waived_by": list(state.standing.waived_by),
        "figures": list(state.figures),
        "silent_on": list(state.silent_on),
        "own_row": state.own_row,
        "own_utilization": state.own_utilization,
        "reason": state.reason or None,
    }


def _crossing(crossing: Crossing) -> dict[str, object]:
    return {
        "value": crossing.inside.value,
        "complies": "below" if crossing.is_upper else "above",
        "is_verified": crossing.is_verified,
        "inside": _state(crossing.inside),
        "outside": _state(crossing.outside),
    }


def _state(state: State) -> dict[str, object]:
    return {
        **state._asdict(),
        "reason": state.reason or None,
        "waived_by": list(state.waived_by),
        "doubts": list(state.doubts),
    }


# ---------------------------------------------------------------- for people
def document(answers: Sequence[Answer], style: Style) -> doc.AnswerDocument:
    """Text of each answer: the crossings at which compliance begins or ends, or a table of catalogue parts."""
    chapters = [
        mission_chapter(
            answer, number, _crossing_blocks(answer) if isinstance(answer, Solution) else _part_blocks(answer)
        )
        for number, answer in enumerate(answers, 1)
    ]
    return mission_document("Design value", answers, chapters)


def _part_blocks(comparison: Comparison) -> Iterator[doc.Block]:
    """Yield the blocks of a comparison: verdict, table of catalogue parts with their utilization, and remarks."""
    count, total = len(comparison.complying), len(comparison.parts)
    subject = f"row {printable(comparison.row)} complies" if comparison.row else "the mission complies"
    verdict = f"{subject} with {count} of {total} parts" if count else f"{subject} with none of {total} parts"
    if standings := [state.standing for state in comparison.parts if state.standing.status == "waived"]:
        waivers = tuple(dict.fromkeys(waiver for standing in standings for waiver in standing.waived_by))
        verdict += f", {waived_count(len(standings), waivers)}"
    terms = f"{comparison.model} model{', neither fails nor warns' if comparison.target == 'warn' else ''}"
    status = _STATUS_OF_SOLUTION[comparison.status]
    yield opening(comparison, f"{printable(comparison.key)}: {verdict}", status, terms)
    is_mixed = len({state.kind for state in comparison.parts}) > 1
    heads = doc.heads("part", *(["kind"] if is_mixed else []), "status", *doc.numbers("use"), "decided by")
    rows: list[doc.Line] = []
    for state in comparison.parts:
        standing = state.standing
        row = printable(state.reason) if state.reason else standing.row or _undecided(standing.requirement)
        row += f" ({waiver_names(standing.waived_by)})" if standing.waived_by else ""
        marks = f"{' *' if state.is_given else ''}{' -' if state.silent_on else ''}"
        kind = [state.kind] if is_mixed else []
        rows.append([f"{state.id}{marks}", *kind, doc.Badge(standing.status), use_words(standing.utilization), row])
    yield doc.TextTable("Parts", "Parts of the catalogue", heads, rows)
    yield doc.Items([[text] for text in _part_remarks(comparison)])


def _part_remarks(comparison: Comparison) -> Iterator[str]:
    if any(state.is_given for state in comparison.parts):
        stays = "; the part of the other kind is kept" if comparison.kept else ""
        yield f"*  named by the file{stays}"
    if any(state.silent_on for state in comparison.parts):
        yield "-  lacks figures that other parts have: these errors are not declared"
    yield "Parts that comply come first, smallest margin first; then those that do not, nearest miss first."
    if comparison.overridden:
        yield f"Stated by the file itself, with every part: {', '.join(comparison.overridden)}."
    if comparison.imaged is not None:
        yield f"Imaged: {_shown(comparison.imaged)}."


def _crossing_blocks(solution: Solution) -> Iterator[doc.Block]:
    verdict = f"{_key_words(solution)}: {_range_words(solution)}"
    yield opening(solution, verdict, _STATUS_OF_SOLUTION[solution.status])
    yield doc.Facts(list(_facts(solution)))


def _key_words(solution: Solution) -> str:
    return f"errors of {printable(solution.key)}" if solution.is_scale else printable(solution.key)


def _value_text(solution: Solution, value: float) -> str:
    return f"factor {solution.texts[value]}" if solution.is_scale else solution.texts[value]


def _range_words(solution: Solution) -> str:
    if solution.status == "all":
        return "every value of the range complies"
    if solution.status in ("waived", "none"):
        waived = f", {waived_count(solution.waived, solution.waived_by)}" if solution.waived else ""
        return f"no value of the range complies{waived}"
    return f"complies {', '.join(_intervals(solution))}"


def _intervals(solution: Solution) -> Iterator[str]:
    """Yield a text for each interval of values with which the mission complies, such as "up to 3 m"."""
    start = ""
    for crossing in solution.crossings:
        value = _value_text(solution, crossing.inside.value)
        if not crossing.is_upper:
            start = f"from {value}"
        else:
            yield f"{start} to {value}" if start else f"up to {value}"
            start = ""
    if start:
        yield start


def _facts(solution: Solution) -> Iterator[tuple[str, str]]:
    if solution.given is not None:
        state = solution.given
        yield "Mission", f"{_value_text(solution, state.value)}: {_state_words(state)}"
    subject = f"row {printable(solution.row)}" if solution.row else "the mission"
    strict = "complies without a warning" if solution.target == "warn" else "complies"
    low, high = (_value_text(solution, value) for value in (solution.low, solution.high))
    yield "Searched", f"{low} to {high}, for where {subject} {strict}; {solution.model} model"
    if len(solution.crossings) > 2 or (len(solution.crossings) == 2 and not solution.crossings[1].is_upper):
        yield "Monotonic", f"no: compliance changes {len(solution.crossings)} times"
    elif len(solution.crossings) == 2:
        yield "Bounded", "from below and from above"
    if solution.skipped:
        yield "No mission", f"at {solution.skipped} of the values tried; they do not comply"
    if solution.waived:
        waivers = waiver_names(solution.waived_by)
        yield "Waived", f"at {solution.waived} of the values tried, where it does not comply ({waivers})"
    for crossing in solution.crossings:
        inside, outside = crossing.inside, crossing.outside
        yield "Inside", f"{_value_text(solution, inside.value)}: {_state_words(inside)}{_resolution(crossing)}"
        yield "Outside", f"{_value_text(solution, outside.value)}: {_state_words(outside)}"
        if crossing.is_verified:
            yield "Checked", "both values as written here"
        else:
            yield "Not checked", "compliance changes again within the digits written here"
    if solution.imaged is not None:
        yield "Imaged", _shown(solution.imaged)
    if solution.is_constant and not solution.crossings:
        yield (
            "No effect",
            f"{printable(solution.key)} does not change the deciding row: the use is the same at every value",
        )
    if not solution.crossings:
        is_miss = not solution.nearest.complies
        nearest = solution.nearest
        if is_miss and nearest.status == "not_evaluated":
            yield (
                "Not judged",
                f"where nothing fails, such as {_value_text(solution, nearest.value)}: {_state_words(nearest)}",
            )
            return
        yield (
            "Nearest" if is_miss else "Least margin",
            f"{_value_text(solution, nearest.value)}: {_state_words(nearest)}",
        )


def _shown(imaged: Imaged) -> str:
    """Text with the verdict that an image gives on the binding row, or with the reason why there is no verdict."""
    row = f"{printable(imaged.row)} at {printable(imaged.at)}"
    verdict = imaged.verdict
    if verdict is None:
        return f"{row}: no verdict, {imaged.reason}"
    words = [verdict.verdict.replace("_", " ")]
    _, measured = verdict.judged_phases_rad
    if measured is not None and verdict.budget_rad is not None:
        shows = f"the image shows {measured:.3g} rad{verdict.of_equal_loss}"
        words.append(f"its limit is {verdict.budget_rad:.3g} rad, {shows}")
    elif verdict.measured_db is not None and verdict.requirement_db is not None:
        words.append(f"{verdict.requirement_db:.4g} dB is required, the image shows {verdict.measured_db:.4g} dB")
    if verdict.verdict_autofocus is not None:
        words.append(f"after autofocus {verdict.verdict_autofocus.replace('_', ' ')}")
    if imaged.reason:
        words.append(printable(imaged.reason))
    return f"{row}: {', '.join(words)}"


def _undecided(requirement: str | None) -> str:
    """Text for a value without a deciding row; it names the requirement that cannot be judged, if there is one."""
    return "no row decides" if requirement is None else f"{REQUIREMENT_NAMES[requirement]} cannot be judged"


def _state_words(state: State) -> str:
    """Text about the mission at one value of the varied key: status, and deciding row with its utilization."""
    word = STATUS[state.status].text
    word += f" ({waiver_names(state.waived_by)})" if state.waived_by else ""
    if state.reason:
        return f"{word}, {printable(state.reason)}"
    if state.row is None and state.doubts and state.requirement is None:
        return f"{word}, {', '.join(state.doubts)}"
    if state.row is None:
        return f"{word}, {_undecided(state.requirement)}"
    use = "" if state.utilization is None else f" uses {percent(state.utilization)}"
    requirement = (state.requirement or "").replace("_", " ")
    return f"{word}, {printable(state.row)}{use} ({requirement})"


def _resolution(crossing: Crossing) -> str:
    state = crossing.inside
    if state.range_resolution_m is None or state.cross_range_resolution_m is None:
        return ""
    sizes = (format_quantity(size, "m") for size in (state.range_resolution_m, state.cross_range_resolution_m))
    return "; resolution {} range, {} cross range".format(*sizes)
