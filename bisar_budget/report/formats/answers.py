"""Write the answers of the commands solve and sensitivity as text and as JSON: `solve/1` and `sensitivity/1`."""

import math
import re
from collections.abc import Iterator, Sequence

from bisar_budget.design.compare import Comparison, PartState
from bisar_budget.design.sensitivity import MIN_SHOWN_CHANGE_FRACTION, Relaxed, Sensitivity, Slope
from bisar_budget.design.solve import Crossing, Imaged, Solution, State
from bisar_budget.faults import printable
from bisar_budget.findings.requirement import REQUIREMENT_NAMES
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
    """Write `solve/1` or `sensitivity/1`, depending on the answers. Values are in SI; a missing value is null."""
    command = "sensitivity" if isinstance(answers[0], Sensitivity) else "solve"
    missions = [
        {"file": answer.file, "name": answer.name, **outside_item(answer), **_document(answer)} for answer in answers
    ]
    return document_text(f"bisar-budget/{command}/1", {"missions": missions})


def _document(answer: Answer) -> dict[str, object]:
    if isinstance(answer, Sensitivity):
        return _ranked(answer)
    return _solved(answer) if isinstance(answer, Solution) else _compared(answer)


def as_text(answers: Sequence[Answer], style: Style) -> str:
    """Write each answer as text for a terminal: crossings, a table of parts, or a table of slopes."""
    return "\n\n".join("\n".join(_lines(answer, style)) for answer in answers) + "\n"


def _lines(answer: Answer, style: Style) -> Iterator[str]:
    if isinstance(answer, Sensitivity):
        return _lines_of_numbers(answer, style)
    return _lines_of_crossings(answer, style) if isinstance(answer, Solution) else _lines_of_parts(answer, style)


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
    """JSON item about the row that was verified in an image. The verdict has the form of `verify --format json`."""
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

    It has the same keys as an item of `_solved`. Keys that do not apply are null.
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
    return {**state._asdict(), "reason": state.reason or None, "waived_by": list(state.waived_by)}


def _lines_of_parts(comparison: Comparison, style: Style) -> Iterator[str]:
    """Yield the lines of a comparison: verdict, table of catalogue parts with their utilization, and footnotes."""
    count, total = len(comparison.complying), len(comparison.parts)
    subject = f"row {printable(comparison.row)} complies" if comparison.row else "the mission complies"
    verdict = f"{subject} with {count} of {total} parts" if count else f"{subject} with none of {total} parts"
    if standings := [state.standing for state in comparison.parts if state.standing.status == "waived"]:
        waivers = tuple(dict.fromkeys(waiver for standing in standings for waiver in standing.waived_by))
        verdict += f", {waived_count(len(standings), waivers)}"
    remark = f"; {comparison.model} model{', neither fails nor warns' if comparison.target == 'warn' else ''}"
    yield from title_lines(
        comparison, f"{printable(comparison.key)}: {verdict}", _SGR[comparison.status], style, remark=remark
    )
    is_mixed = len({state.kind for state in comparison.parts}) > 1
    rows = [["part", *(["kind"] if is_mixed else []), "status", "use", ""]]
    for state in comparison.parts:
        standing = state.standing
        row = printable(state.reason) if state.reason else standing.row or _undecided(standing.requirement)
        row += f" ({waiver_names(standing.waived_by)})" if standing.waived_by else ""
        marks = f"{' *' if state.is_given else ''}{' -' if state.silent_on else ''}"
        kind = [state.kind] if is_mixed else []
        rows.append([f"{state.id}{marks}", *kind, STATUS[standing.status].text, use_words(standing.utilization), row])
    yield from table(rows, style.table_width)
    yield ""
    if any(state.is_given for state in comparison.parts):
        stays = "; the part of the other kind is kept" if comparison.kept else ""
        yield from wrapped(f"*  named by the file{stays}", "   ")
    if any(state.silent_on for state in comparison.parts):
        yield from wrapped("-  lacks figures that other parts have: these errors are not declared", "   ")
    yield from wrapped(
        "Parts that comply come first, smallest margin first; then those that do not, nearest miss first.", "  "
    )
    if comparison.overridden:
        yield from wrapped(f"Stated by the file itself, with every part: {', '.join(comparison.overridden)}.", "  ")
    if comparison.imaged is not None:
        yield from wrapped(f"Imaged: {_shown(comparison.imaged)}.", "  ")


def _lines_of_crossings(solution: Solution, style: Style) -> Iterator[str]:
    verdict = f"{_key_words(solution)}: {_range_words(solution)}"
    yield from title_lines(solution, verdict, _SGR[solution.status], style)
    for name, text in _facts(solution):
        yield from wrapped(f"{name:<12} {text}", " " * 13)


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
    """Text with the verdict from an image on the binding row, or with the reason why there is no verdict."""
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
    """Text for a mission state in which no row decides; it names the requirement that cannot be judged, if any."""
    return "no row decides" if requirement is None else f"{REQUIREMENT_NAMES[requirement]} cannot be judged"


def _state_words(state: State) -> str:
    """Text about the mission at one value of the key: its status, the deciding row and the row's utilization."""
    word = STATUS[state.status].text
    word += f" ({waiver_names(state.waived_by)})" if state.waived_by else ""
    if state.reason:
        return f"{word}, {printable(state.reason)}"
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


def _ranked(sensitivity: Sensitivity) -> dict[str, object]:
    return {
        "model": sensitivity.model,
        "status": sensitivity.status,
        "worst_row": sensitivity.worst_row,
        "binding_requirement": sensitivity.requirement,
        "utilization": sensitivity.utilization,
        "row": sensitivity.row,
        "row_utilization": sensitivity.row_utilization,
        "numbers": [_slope(slope) | {"to_limit": sensitivity.to_limit(slope)} for slope in sensitivity.slopes],
        "without_effect": list(sensitivity.unchanging),
        "skipped": [skipped._asdict() for skipped in sensitivity.skipped],
        "relaxed": [_relaxed(relaxed) for relaxed in sensitivity.relaxed] if sensitivity.is_balanced else None,
    }


def _slope(slope: Slope) -> dict[str, object]:
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


def _relaxed(relaxed: Relaxed) -> dict[str, object]:
    def platform(change: tuple[str, float, float] | None) -> dict[str, object] | None:
        return None if change is None else dict(zip(("row", "before", "after"), change, strict=True))

    return {
        "key": relaxed.key,
        "share_transmitter": {"before": relaxed.shares_before[0], "after": relaxed.shares_after[0]},
        "share_receiver": {"before": relaxed.shares_before[1], "after": relaxed.shares_after[1]},
        "transmitter": platform(relaxed.transmitter),
        "receiver": platform(relaxed.receiver),
    }


def _lines_of_numbers(sensitivity: Sensitivity, style: Style) -> Iterator[str]:
    """Yield the lines of a sensitivity analysis. The number with the smallest change to the limit is first."""
    status = STATUS[sensitivity.status]
    requirement = BINDING_WORDS.get(sensitivity.requirement, sensitivity.requirement.replace("_", " "))
    text = f"worst utilization {percent(sensitivity.utilization)}: {printable(sensitivity.worst_row)} ({requirement})"
    row_text = []
    if sensitivity.row is not None and sensitivity.row_utilization is not None:
        row_text = [f"row {printable(sensitivity.row)}: {percent(sensitivity.row_utilization)}"]
    remark = f": {status.text}, {sensitivity.model} model"
    yield from title_lines(sensitivity, text, status.sgr, style, more=row_text, remark=remark)
    yield from _table(sensitivity, style)
    yield from _notes(sensitivity)
    if sensitivity.is_balanced:
        yield ""
        yield from _balance(sensitivity, style)


def _table(sensitivity: Sensitivity, style: Style) -> Iterator[str]:
    shown = sensitivity.shown
    if not shown:
        yield "No number of the file changes the utilization."
        return
    row_head = [] if sensitivity.row is None else ["of the row"]
    rows = [["key", "value", "to limit", "per", "worst", *row_head, ""]]
    for slope in shown:
        row_cell = [] if slope.row_change is None else [_points(slope.row_change)]
        mixed = next((row for row in (slope.row_above, slope.row_below) if row != sensitivity.worst_row), "")
        note = f"({printable(mixed)})" if slope.is_mixed else ""
        rows.append(
            [
                printable(slope.key),
                printable(slope.given),
                to_limit(sensitivity, slope),
                slope.per_text,
                _points(slope.change),
                *row_cell,
                note,
            ]
        )
    yield from table(rows, style.table_width)
    yield ""
    yield from wrapped(
        "to limit: change of this number alone that brings the utilization to 100 %, extrapolated from its slope "
        "here; smallest first. worst: change of the utilization in percentage points when the number grows by the "
        "step under per; a negative value becomes more negative.",
        "  ",
    )


def to_limit(sensitivity: Sensitivity, slope: Slope) -> str:
    """Text with the change in a number of the mission file that uses up the margin.

    The change is in percent, degrees or dB, or a factor if the number changes tenfold or more. It is a hyphen if no
    change does so.
    """
    change = sensitivity.to_limit(slope)
    if change is None:
        return "-"
    if slope.is_proportional:
        ratio = change / slope.value
        return f"{100 * ratio:+.3g} %" if -0.99 < ratio < 9 else f"x {float(f'{1 + ratio:.3g}'):g}"
    return f"{change:+.3g} dB" if slope.per_text.endswith("dB") else f"{math.degrees(change):+.3g} deg"


def _points(change: float) -> str:
    return f"{100 * change:+.3g}" if change else "0"


def _notes(sensitivity: Sensitivity) -> Iterator[str]:
    shown = sensitivity.shown
    if any(slope.is_mixed for slope in shown):
        yield from wrapped(
            "In parentheses: the worst row on the other side of the value. The change combines the slopes of both.",
            "  ",
        )
    if negligible := len(sensitivity.slopes) - len(shown):
        yield f"Effect below a ten-thousandth of it: {counted(negligible, 'number')} (JSON lists them)."
    if sensitivity.unchanging:
        yield f"Without effect: {counted(len(sensitivity.unchanging), 'number')} (JSON lists them)."
    if sensitivity.skipped:
        kinds = ", ".join(
            dict.fromkeys(re.split("[:;]", skipped.reason)[0].removeprefix("is ") for skipped in sensitivity.skipped)
        )
        yield from wrapped(f"Left out: {len(sensitivity.skipped)} keys ({kinds}).", "  ")


def _balance(sensitivity: Sensitivity, style: Style) -> Iterator[str]:
    moving_errors = [error for error in sensitivity.relaxed if error.moves_shares]
    if not moving_errors:
        yield "Shares are balanced; doubling an error does not change them."
        return
    yield from wrapped("Shares are balanced. Cost of doubling an error for the other errors:", "  ")
    yield ""
    rows = [["doubled", "shares t/r", "transmitter", "receiver", ""]]
    for error in moving_errors:
        shares = [
            "/".join(f"{100 * share:.3g}" for share in platform_shares)
            for platform_shares in (error.shares_before, error.shares_after)
        ]
        rows.append(
            [
                printable(error.key),
                " -> ".join(shares),
                _change_words(error.transmitter),
                _change_words(error.receiver),
                "",
            ]
        )
    yield from table(rows, style.table_width)
    yield ""
    yield from wrapped(
        "For each platform the worst utilization of its other errors, before and after; shares in percent.", "  "
    )
    if unmoved := len(sensitivity.relaxed) - len(moving_errors):
        yield f"Doubling does not change the shares for {counted(unmoved, 'other error')}."


def _change_words(change: tuple[str, float, float] | None) -> str:
    if change is None:
        return "-"
    _, before, after = change
    return (
        percent(before)
        if abs(after - before) <= MIN_SHOWN_CHANGE_FRACTION * before
        else f"{percent(before)} -> {percent(after)}"
    )
