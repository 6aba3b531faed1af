"""What solving for a number found: text for reading, JSON `bisar-budget/solve/1`."""

import json
from collections.abc import Iterator, Sequence
from typing import Any

from bisar_budget.design.solution import Crossing, Solution, State
from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.status import STATUS
from bisar_budget.report import Style
from bisar_budget.report.words.layout import wrapped
from bisar_budget.report.words.sentences import percent
from bisar_budget.units import format_quantity

FORMAT = "bisar-budget/solve/1"
_SGR = {"crossing": "32", "all": "32", "none": "1;31"}


def as_json(version: str, solutions: Sequence[Solution]) -> str:
    """Write the contract; values in SI, null where there is none."""
    document = {"format": FORMAT, "version": version, "missions": [_mission(solution) for solution in solutions]}
    return json.dumps(document, indent=2, allow_nan=False) + "\n"


def _mission(solution: Solution) -> dict[str, Any]:
    best = solution.best
    return {
        "file": solution.file,
        "name": solution.name,
        "set": [change._asdict() for change in solution.changes],
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
    return {**state._asdict(), "reason": state.reason or None}


def as_text(solutions: Sequence[Solution], style: Style) -> str:
    """Write what complies, what binds on both sides of every crossing, and what was checked."""
    return "\n\n".join("\n".join(_lines(solution, style)) for solution in solutions) + "\n"


def _lines(solution: Solution, style: Style) -> Iterator[str]:
    changed = f" {changes_words(solution.changes)}" if solution.changes else ""
    first, *rest = wrapped(f"{_subject(solution)}: {_answer(solution)}", "  ")
    yield f"\x1b[{_SGR[solution.status]}m{first}\x1b[0m" if style.color else first
    yield from rest
    yield from wrapped(f"{printable(solution.file)}{changed}, {printable(solution.name)}", "  ")
    yield ""
    for name, text in _facts(solution):
        yield from wrapped(f"{name:<12} {text}", " " * 13)


def _subject(solution: Solution) -> str:
    return f"errors of {printable(solution.key)}" if solution.is_scale else printable(solution.key)


def _said(solution: Solution, value: float) -> str:
    return f"factor {solution.texts[value]}" if solution.is_scale else solution.texts[value]


def _answer(solution: Solution) -> str:
    if solution.status == "all":
        return "every value of the range complies"
    if solution.status == "none":
        return "no value of the range complies"
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
    strict = "does neither fail nor warn" if solution.target == "warn" else "does not fail"
    low, high = (_said(solution, value) for value in (solution.low, solution.high))
    yield "Searched", f"{low} to {high}, for where {what} {strict}; {solution.model} model"
    if len(solution.crossings) > 2 or (len(solution.crossings) == 2 and not solution.crossings[1].is_upper):
        yield "Monotonic", f"no: compliance changes {len(solution.crossings)} times"
    elif len(solution.crossings) == 2:
        yield "Bounded", "from below and from above"
    if solution.skipped:
        yield "No mission", f"at {solution.skipped} of the places looked at; they do not comply"
    for crossing in solution.crossings:
        yield "Inside", f"{_said(solution, crossing.inside.value)}: {_stands(crossing.inside)}{_resolves(crossing)}"
        yield "Outside", f"{_said(solution, crossing.outside.value)}: {_stands(crossing.outside)}"
        if crossing.is_verified:
            yield "Checked", "both, as they are written here"
        else:
            yield "Not checked", "compliance changes again within the digits written here"
    if solution.is_constant and not solution.crossings:
        yield (
            "No effect",
            f"{printable(solution.key)} changes nothing that decides: the use is the same at every value",
        )
    if not solution.crossings:
        is_miss = solution.status == "none"
        nearest = solution.nearest
        yield "Nearest" if is_miss else "Least left", f"{_said(solution, nearest.value)}: {_stands(nearest)}"


def _stands(state: State) -> str:
    """Say how the mission stands at a value."""
    word = STATUS[state.status].text
    if state.reason:
        return f"{word}, {printable(state.reason)}"
    if state.row is None:
        return f"{word}, no row decides"
    use = "" if state.utilization is None else f" uses {percent(state.utilization)}"
    requirement = (state.requirement or "").replace("_", " ")
    return f"{word}, {printable(state.row)}{use} ({requirement})"


def _resolves(crossing: Crossing) -> str:
    state = crossing.inside
    if state.range_resolution_m is None or state.cross_range_resolution_m is None:
        return ""
    sizes = (format_quantity(size, "m") for size in (state.range_resolution_m, state.cross_range_resolution_m))
    return "; resolution {} range, {} cross range".format(*sizes)
