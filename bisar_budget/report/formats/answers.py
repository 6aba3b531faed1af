"""Answers of solve and sensitivity, as text for reading and as JSON: `solve/1` and `sensitivity/1`."""

import math
import re
from collections.abc import Iterator, Sequence
from typing import Any

from bisar_budget.design.compare import Comparison, PartState
from bisar_budget.design.sensitivity import LITTLE, Relaxed, Sensitivity, Slope
from bisar_budget.design.solve import Crossing, Imaged, Solution, State
from bisar_budget.faults import printable
from bisar_budget.findings.requirement import NAMES
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report.formats.json_document import document_text, outside_item, verdict_item
from bisar_budget.report.words.heading import title_lines
from bisar_budget.report.words.sentences import (
    BINDING_WORDS,
    counted,
    percent,
    table,
    use_words,
    waived_count,
    waiver_names,
    wrapped,
)
from bisar_budget.units import format_quantity

_SGR = {"crossing": "32", "all": "32", "some": "32", "waived": STATUS["waived"].sgr, "none": "1;31"}

Answer = Solution | Comparison | Sensitivity


def as_json(answers: Sequence[Answer], style: Style) -> str:
    """Write the contract of the command that was asked; values in SI, null where there is none."""
    command = "sensitivity" if isinstance(answers[0], Sensitivity) else "solve"
    missions = [{"file": one.file, "name": one.name, **outside_item(one), **_document(one)} for one in answers]
    return document_text(f"bisar-budget/{command}/1", {"missions": missions})


def _document(found: Answer) -> dict[str, Any]:
    if isinstance(found, Sensitivity):
        return _ranked(found)
    return _solved(found) if isinstance(found, Solution) else _compared(found)


def as_text(answers: Sequence[Answer], style: Style) -> str:
    """Write each answer as lines for a person: crossings, a table of parts, or a table of numbers."""
    return "\n\n".join("\n".join(_lines(one, style)) for one in answers) + "\n"


def _lines(found: Answer, style: Style) -> Iterator[str]:
    if isinstance(found, Sensitivity):
        return _lines_of_numbers(found, style)
    return _lines_of_crossings(found, style) if isinstance(found, Solution) else _lines_of_parts(found, style)


def _solved(solution: Solution) -> dict[str, Any]:
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


def _imaged(found: Imaged | None) -> dict[str, Any] | None:
    """Write what images say; the verdict is that of `verify --format json`."""
    if found is None:
        return None
    return {
        "row": found.row,
        "at": found.at,
        "verdict": "not_evaluated" if found.verdict is None else found.verdict.verdict,
        "verdict_autofocus": None if found.verdict is None else found.verdict.verdict_autofocus,
        "reason": found.reason or None,
        "image": None if found.verdict is None else verdict_item(found.verdict),
    }


def _compared(found: Comparison) -> dict[str, Any]:
    """The same keys for parts of the catalogue: there is no value, and no border."""
    best = next(iter(found.complying), None)
    return {
        "key": found.key,
        "scale": False,
        "unit": None,
        "target": found.target,
        "row": found.row,
        "model": found.model,
        "between": None,
        "status": found.status,
        "value": None,
        "text": None if best is None else best.id,
        "binding_row": None if best is None else best.standing.row,
        "binding_requirement": None if best is None else best.standing.requirement,
        "is_monotonic": None,
        "is_constant": None,
        "given": None,
        "crossings": [],
        "nearest": None,
        "places_without_mission": sum(part.standing.status == "error" for part in found.parts),
        "places_waived": sum(part.standing.status == "waived" for part in found.parts),
        "waived_by": list(dict.fromkeys(waiver for part in found.parts for waiver in part.standing.waived_by)),
        "parts": [_part(part) for part in found.parts],
        "verified": _imaged(found.imaged),
    }


def _part(part: PartState) -> dict[str, Any]:
    return {
        "id": part.id,
        "name": part.name,
        "kind": part.kind,
        "file": part.file,
        "is_given": part.is_given,
        **part.standing._asdict(),
        "waived_by": list(part.standing.waived_by),
        "figures": list(part.figures),
        "silent_on": list(part.silent_on),
        "own_row": part.own_row,
        "own_utilization": part.own_utilization,
        "reason": part.reason or None,
    }


def _crossing(crossing: Crossing) -> dict[str, Any]:
    return {
        "value": crossing.inside.value,
        "complies": "below" if crossing.is_upper else "above",
        "is_verified": crossing.is_verified,
        "inside": _state(crossing.inside),
        "outside": _state(crossing.outside),
    }


def _state(state: State) -> dict[str, Any]:
    return {**state._asdict(), "reason": state.reason or None, "waived_by": list(state.waived_by)}


def _lines_of_parts(found: Comparison, style: Style) -> Iterator[str]:
    """Say which parts comply, and how near the others are."""
    count, total = len(found.complying), len(found.parts)
    what = f"row {printable(found.row)} complies" if found.row else "the mission complies"
    said = f"{what} with {count} of {total} parts" if count else f"{what} with none of {total} parts"
    if waived := [part.standing for part in found.parts if part.standing.status == "waived"]:
        ids = tuple(dict.fromkeys(waiver for one in waived for waiver in one.waived_by))
        said += f", {waived_count(len(waived), ids)}"
    remark = f"; {found.model} model{', neither fails nor warns' if found.target == 'warn' else ''}"
    yield from title_lines(found, f"{printable(found.key)}: {said}", _SGR[found.status], style, remark=remark)
    is_mixed = len({part.kind for part in found.parts}) > 1
    rows = [["part", *(["kind"] if is_mixed else []), "status", "use", ""]]
    for part in found.parts:
        stands = part.standing
        row = printable(part.reason) if part.reason else stands.row or _undecided(stands.requirement)
        row += f" ({waiver_names(stands.waived_by)})" if stands.waived_by else ""
        marks = f"{' *' if part.is_given else ''}{' -' if part.silent_on else ''}"
        kind = [part.kind] if is_mixed else []
        rows.append([f"{part.id}{marks}", *kind, STATUS[stands.status].text, use_words(stands.utilization), row])
    yield from table(rows)
    yield ""
    if any(part.is_given for part in found.parts):
        stays = "; of several each stays while parts of the other kind change" if found.kept else ""
        yield from wrapped(f"*  named by the file{stays}", "   ")
    if any(part.silent_on for part in found.parts):
        yield from wrapped("-  says nothing of figures that others have: these errors are not declared", "   ")
    yield from wrapped("What complies has the smallest margin first, what does not the nearest miss.", "  ")
    if found.overridden:
        yield from wrapped(f"Stated by the file itself, with every part: {', '.join(found.overridden)}.", "  ")
    if found.imaged is not None:
        yield from wrapped(f"Imaged: {_shown(found.imaged)}.", "  ")


def _lines_of_crossings(solution: Solution, style: Style) -> Iterator[str]:
    said = f"{_subject(solution)}: {_answer(solution)}"
    yield from title_lines(solution, said, _SGR[solution.status], style)
    for name, text in _facts(solution):
        yield from wrapped(f"{name:<12} {text}", " " * 13)


def _subject(solution: Solution) -> str:
    return f"errors of {printable(solution.key)}" if solution.is_scale else printable(solution.key)


def _said(solution: Solution, value: float) -> str:
    return f"factor {solution.texts[value]}" if solution.is_scale else solution.texts[value]


def _answer(solution: Solution) -> str:
    if solution.status == "all":
        return "every value of the range complies"
    if solution.status in ("waived", "none"):
        waived = f", {waived_count(solution.waived, solution.waived_by)}" if solution.waived else ""
        return f"no value of the range complies{waived}"
    return f"complies {', '.join(_intervals(solution))}"


def _intervals(solution: Solution) -> Iterator[str]:
    """Say which parts of the range comply."""
    start = ""
    for crossing in solution.crossings:
        value = _said(solution, crossing.inside.value)
        if not crossing.is_upper:
            start = f"from {value}"
        else:
            yield f"{start} to {value}" if start else f"up to {value}"
            start = ""
    if start:
        yield start


def _facts(solution: Solution) -> Iterator[tuple[str, str]]:
    if solution.given is not None:
        given = solution.given
        yield "Mission", f"{_said(solution, given.value)}: {_stands(given)}"
    what = f"row {printable(solution.row)}" if solution.row else "the mission"
    strict = "complies without a warning" if solution.target == "warn" else "complies"
    low, high = (_said(solution, value) for value in (solution.low, solution.high))
    yield "Searched", f"{low} to {high}, for where {what} {strict}; {solution.model} model"
    if len(solution.crossings) > 2 or (len(solution.crossings) == 2 and not solution.crossings[1].is_upper):
        yield "Monotonic", f"no: compliance changes {len(solution.crossings)} times"
    elif len(solution.crossings) == 2:
        yield "Bounded", "from below and from above"
    if solution.skipped:
        yield "No mission", f"at {solution.skipped} of the places looked at; they do not comply"
    if solution.waived:
        waivers = waiver_names(solution.waived_by)
        yield "Waived", f"at {solution.waived} of the places looked at, where it does not comply ({waivers})"
    for crossing in solution.crossings:
        yield "Inside", f"{_said(solution, crossing.inside.value)}: {_stands(crossing.inside)}{_resolves(crossing)}"
        yield "Outside", f"{_said(solution, crossing.outside.value)}: {_stands(crossing.outside)}"
        if crossing.is_verified:
            yield "Checked", "both, as they are written here"
        else:
            yield "Not checked", "compliance changes again within the digits written here"
    if solution.imaged is not None:
        yield "Imaged", _shown(solution.imaged)
    if solution.is_constant and not solution.crossings:
        yield (
            "No effect",
            f"{printable(solution.key)} changes nothing that decides: the use is the same at every value",
        )
    if not solution.crossings:
        is_miss = not solution.nearest.complies
        nearest = solution.nearest
        if is_miss and nearest.status == "not_evaluated":
            yield "Not judged", f"where nothing fails, such as {_said(solution, nearest.value)}: {_stands(nearest)}"
            return
        yield "Nearest" if is_miss else "Least left", f"{_said(solution, nearest.value)}: {_stands(nearest)}"


def _shown(found: Imaged) -> str:
    """Say what images show of the row that binds."""
    said = f"{printable(found.row)} at {printable(found.at)}"
    one = found.verdict
    if one is None:
        return f"{said}: no verdict, {found.reason}"
    words = [one.verdict.replace("_", " ")]
    _, measured = one.judged_phases_rad
    if measured is not None and one.budget_rad is not None:
        shows = f"the image shows {measured:.3g} rad{one.of_equal_loss}"
        words.append(f"its limit is {one.budget_rad:.3g} rad, {shows}")
    elif one.measured_db is not None and one.requirement_db is not None:
        words.append(f"{one.requirement_db:.4g} dB is required, the image shows {one.measured_db:.4g} dB")
    if one.verdict_autofocus is not None:
        words.append(f"after autofocus {one.verdict_autofocus.replace('_', ' ')}")
    if found.reason:
        words.append(printable(found.reason))
    return f"{said}: {', '.join(words)}"


def _undecided(requirement: str | None) -> str:
    """Say what is wrong where no row decides: a requirement that cannot be judged."""
    return "no row decides" if requirement is None else f"{NAMES[requirement]} cannot be judged"


def _stands(state: State) -> str:
    """Say how the mission stands at a value."""
    word = STATUS[state.status].text
    word += f" ({waiver_names(state.waived_by)})" if state.waived_by else ""
    if state.reason:
        return f"{word}, {printable(state.reason)}"
    if state.row is None:
        return f"{word}, {_undecided(state.requirement)}"
    use = "" if state.utilization is None else f" uses {percent(state.utilization)}"
    requirement = (state.requirement or "").replace("_", " ")
    return f"{word}, {printable(state.row)}{use} ({requirement})"


def _resolves(crossing: Crossing) -> str:
    state = crossing.inside
    if state.range_resolution_m is None or state.cross_range_resolution_m is None:
        return ""
    sizes = (format_quantity(size, "m") for size in (state.range_resolution_m, state.cross_range_resolution_m))
    return "; resolution {} range, {} cross range".format(*sizes)


def _ranked(found: Sensitivity) -> dict[str, Any]:
    return {
        "model": found.model,
        "status": found.status,
        "worst_row": found.worst_row,
        "binding_requirement": found.requirement,
        "utilization": found.utilization,
        "row": found.row,
        "row_utilization": found.row_utilization,
        "numbers": [_slope(slope) | {"to_limit": found.to_limit(slope)} for slope in found.slopes],
        "without_effect": list(found.unchanging),
        "skipped": [skipped._asdict() for skipped in found.skipped],
        "relaxed": [_relaxed(relaxed) for relaxed in found.relaxed] if found.is_balanced else None,
    }


def _slope(slope: Slope) -> dict[str, Any]:
    return {
        "key": slope.key,
        "text": slope.text,
        "value": slope.value,
        "unit": slope.unit,
        "per": slope.per_text,
        "per_value": slope.per,
        "step": slope.step,
        "difference": slope.difference,
        "utilization_change": slope.change,
        "row_change": slope.row_change,
        "worst_row_below": slope.row_below,
        "worst_row_above": slope.row_above,
        "is_mixed": slope.is_mixed,
        "part": slope.part or None,
    }


def _relaxed(relaxed: Relaxed) -> dict[str, Any]:
    def platform(others: tuple[str, float, float] | None) -> dict[str, Any] | None:
        return None if others is None else dict(zip(("row", "before", "after"), others, strict=True))

    return {
        "key": relaxed.key,
        "share_transmitter": {"before": relaxed.shares_before[0], "after": relaxed.shares_after[0]},
        "share_receiver": {"before": relaxed.shares_before[1], "after": relaxed.shares_after[1]},
        "transmitter": platform(relaxed.transmitter),
        "receiver": platform(relaxed.receiver),
    }


def _lines_of_numbers(found: Sensitivity, style: Style) -> Iterator[str]:
    """The numbers that change something; first that which has to change least to use up the margin."""
    status = STATUS[found.status]
    requirement = BINDING_WORDS.get(found.requirement, found.requirement.replace("_", " "))
    said = f"worst utilization {percent(found.utilization)}: {printable(found.worst_row)} ({requirement})"
    row = []
    if found.row is not None and found.row_utilization is not None:
        row = [f"row {printable(found.row)}: {percent(found.row_utilization)}"]
    remark = f": {status.text}, {found.model} model"
    yield from title_lines(found, said, status.sgr, style, more=row, remark=remark)
    yield from _table(found)
    yield from _notes(found)
    if found.is_balanced:
        yield ""
        yield from _balance(found)


def _table(found: Sensitivity) -> Iterator[str]:
    shown = found.shown
    if not shown:
        yield "No number of the file changes it."
        return
    of_row = [] if found.row is None else ["of the row"]
    rows = [["key", "value", "to limit", "per", "worst", *of_row, ""]]
    for slope in shown:
        in_row = [] if slope.row_change is None else [_points(slope.row_change)]
        mixed = next((row for row in (slope.row_above, slope.row_below) if row != found.worst_row), "")
        note = f"({printable(mixed)})" if slope.is_mixed else ""
        rows.append(
            [
                printable(slope.key),
                printable(slope.given),
                to_limit(found, slope),
                slope.per_text,
                _points(slope.change),
                *in_row,
                note,
            ]
        )
    yield from table(rows)
    yield ""
    yield from wrapped(
        "to limit: what a number has to change by, alone, until the utilization is 100 %, if that goes on as it goes "
        "here; the least stands first. worst: change of the utilization in percentage points, if a number grows by "
        "what stands under per; a negative number grows away from 0.",
        "  ",
    )


def to_limit(found: Sensitivity, slope: Slope) -> str:
    """Write the change that uses up the margin: in percent, from tenfold on as a factor, or in degrees or decibel."""
    change = found.to_limit(slope)
    if change is None:
        return "-"
    if slope.is_proportional:
        part = change / slope.value
        return f"{100 * part:+.3g} %" if -0.99 < part < 9 else f"x {float(f'{1 + part:.3g}'):g}"
    return f"{change:+.3g} dB" if slope.per_text.endswith("dB") else f"{math.degrees(change):+.3g} deg"


def _points(change: float) -> str:
    return f"{100 * change:+.3g}" if change else "0"


def _notes(found: Sensitivity) -> Iterator[str]:
    shown = found.shown
    if any(slope.is_mixed for slope in shown):
        yield from wrapped(
            "In parentheses: the row that is the worst beside the value. The change is made of the slopes of both.",
            "  ",
        )
    if little := len(found.slopes) - len(shown):
        yield f"Less than a ten-thousandth of it: {counted(little, 'number')} (JSON lists them)."
    if found.unchanging:
        yield f"Without effect: {counted(len(found.unchanging), 'number')} (JSON lists them)."
    if found.skipped:
        kinds = ", ".join(dict.fromkeys(re.split("[:;]", one.reason)[0].removeprefix("is ") for one in found.skipped))
        yield from wrapped(f"Left out: {len(found.skipped)} keys ({kinds}).", "  ")


def _balance(found: Sensitivity) -> Iterator[str]:
    moving = [one for one in found.relaxed if one.moves_shares]
    if not moving:
        yield "Shares are balanced; no error that is doubled would move them."
        return
    yield from wrapped("Shares are balanced. What an error that is doubled costs the others:", "  ")
    yield ""
    rows = [["doubled", "shares t/r", "transmitter", "receiver", ""]]
    for one in moving:
        shares = ["/".join(f"{100 * share:.3g}" for share in both) for both in (one.shares_before, one.shares_after)]
        rows.append([printable(one.key), " -> ".join(shares), _then(one.transmitter), _then(one.receiver), ""])
    yield from table(rows)
    yield ""
    yield from wrapped(
        "Of each platform the worst utilization of what is not doubled, before and after; shares in percent.", "  "
    )
    if still := len(found.relaxed) - len(moving):
        yield f"Doubling moves no share of {counted(still, 'other')}."


def _then(others: tuple[str, float, float] | None) -> str:
    if others is None:
        return "-"
    _, before, after = others
    return percent(before) if abs(after - before) <= LITTLE * before else f"{percent(before)} -> {percent(after)}"
