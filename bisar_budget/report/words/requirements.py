"""Words of every format about requirements: whether each is met and by what, and how often it is in draws."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from bisar_budget import phrases
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.monte_carlo import MonteCarlo, Requirement
from bisar_budget.findings.requirement import DecidingShare, DeclaredKinds, JudgedRequirement
from bisar_budget.findings.row import SPECIFICATION, Row
from bisar_budget.findings.status import BROKEN, STATUS
from bisar_budget.report.words.sentences import (
    counted,
    requirement_limit,
    requirement_size,
    use_words,
    waiver_names,
    wrapped,
)
from bisar_budget.units import format_quantity

COLUMNS = ("requirement", "allowed", "reached", "use", "status", "decided by")


class RequirementLine(NamedTuple):
    """One line of the table of requirements, in words.

    `decided_by` is the row that decides; where nothing could be judged, why. `remark` says which share `use` is of,
    with its own two numbers, what autofocus gains, and which waiver stands.
    """

    requirement: JudgedRequirement
    name: str
    allowed: str
    reached: str
    use: str
    status: str
    decided_by: str
    remark: str


def requirement_id(one: JudgedRequirement) -> str:
    """Name of a line of the table among rows, such as `requirement.islr`."""
    return f"requirement.{one.key}"


def requirement_lines(mission: MissionFindings) -> Iterator[RequirementLine]:
    """Write the table of requirements, in the order of the contract."""
    for one in mission.requirements:
        is_open = one.is_unjudged
        remark = ", ".join([*use_remarks(one), *(waiver.words for waiver in one.waivers)])
        yield RequirementLine(
            requirement=one,
            name=one.name,
            allowed=requirement_limit(one.value, one),
            reached=requirement_size(one.reached, one),
            use=use_words(None if one.value is None or is_open else one.utilization),
            status=one.status,
            decided_by=(one.reason if is_open and one.reason else one.row) or ("" if remark else "-"),
            remark=remark,
        )


def use_remarks(one: JudgedRequirement) -> Iterator[str]:
    """Say what the use is of, where that is not reached over allowed: another row, a share, more by autofocus."""
    if one.is_unjudged or one.value is None:
        return
    if one.use_row not in (None, one.row):
        yield f"most used by {one.use_row}"
    said = [] if one.share is None else [share_words(one, one.share)]
    if one.autofocus_gain is not None and one.autofocus_gain > 1:
        has_no_gain = one.share is not None and one.share.owner in _SHARES
        said.insert(0 if has_no_gain else len(said), f"autofocus gain {one.autofocus_gain:.3g}")
    yield from said


_OF_OWNER = "'s share"
# Shares that no platform and no clock has.
_SHARES = {"autofocus": "pull-in of autofocus", "scene": "at the scene's edge", "band": "over the band"}


def share_words(one: JudgedRequirement, share: DecidingShare) -> str:
    """Say whose share decides, with its own two numbers: `receiver's share: 24.4 of 31.5 deg`."""
    reached, allowed = requirement_size(share.reached, one), requirement_limit(share.allowed, one)
    number, _, unit = reached.rpartition(" ")
    if number and allowed.endswith(f" {unit}"):  # the unit stands once
        reached = number
    return f"{_SHARES.get(share.owner, share.owner + _OF_OWNER)}: {reached} of {allowed}"


def share_columns(one: JudgedRequirement) -> dict[str, str | float | None]:
    """Whose share decides, its own two numbers, and the gain of autofocus, by the names of columns and properties."""
    share = one.share
    return {
        "share_owner": None if share is None else share.owner,
        "share_allowed": None if share is None else share.allowed,
        "share_reached": None if share is None else share.reached,
        "autofocus_gain": one.autofocus_gain,
    }


def confidence_words(mission: MissionFindings) -> str:
    """Say behind the status of a mission with which confidence its requirements are met; nothing where one is not."""
    status = STATUS[mission.status]
    return f" {mission.confidence}" if status.is_held and not status.fails else ""


_HAS_CONFIDENCE = ("quadratic_phase_error", "cubic_phase_error", "location_error")  # levels are of mean powers


def requirement_finding(one: JudgedRequirement, mission: MissionFindings) -> str:
    """Say in a sentence how a requirement stands; where it is met, with which confidence."""
    text = one.name
    if one.value is not None:
        text += f" of {requirement_limit(one.value, one)}{' (default)' if one.is_default else ''}"
    text += f": {STATUS[one.status].words}"
    if STATUS[one.status].is_held and not STATUS[one.status].fails and one.key in _HAS_CONFIDENCE:
        text += f" {mission.confidence}"
    if one.reached is not None:
        text += f", {requirement_size(one.reached, one)} reached"
    if one.row is not None and not one.is_unjudged:
        text += f", decided by {one.row}"
    text += "".join(f", {remark}" for remark in use_remarks(one))
    return "; ".join([text, *filter(None, [one.reason]), *(waiver.words for waiver in one.waivers)])


def verdict(mission: MissionFindings, *, is_brief: bool = False) -> str:
    """Say whether every requirement was judged and is met; else how many are not. `is_brief` leaves verbs out."""
    if mission.is_empty:
        return "the file declares no error" + ("" if is_brief else ", so nothing is judged; the allowables follow")
    statuses = [one.status for one in mission.requirements]
    specified = [row.status for row in mission.rows if row.metric == SPECIFICATION]
    counts = (
        (statuses.count("fail"), "requirement", ("is", "are"), "not met"),
        (statuses.count("not_evaluated"), "requirement", ("cannot", "cannot"), "be judged"),
        (len(unjudged_effects(mission)), "effect", ("is", "are"), "judged by no requirement"),
        (specified.count("fail"), "specification", ("is", "are"), "exceeded"),
        (specified.count("not_evaluated"), "specification", ("has", "have"), "no declared error"),
    )
    said, named = [], ""
    for count, what, verbs, outcome in counts:
        if count:
            subject = str(count) if what == named else f"{count} {what}{'' if count == 1 else 's'}"
            verb = "" if is_brief and verbs[0] == "is" else f"{verbs[count > 1]} "
            said.append(f"{subject} {verb}{outcome}")
            named = what
    waived = _waived(mission, is_brief=is_brief)
    if said:
        return ", ".join([*said, *waived])
    broken = [row for row in mission.rows if row.status in BROKEN]
    if broken:
        fails = f"{len(broken)} row{' fails' if len(broken) == 1 else 's fail'} or cannot be judged"
        return ", ".join([fails, *waived])
    if mission.is_unverified:
        return "images were asked for, and none gave a verdict"
    return _met(mission, waived)


def _waived(mission: MissionFindings, *, is_brief: bool) -> list[str]:
    """Say how many requirements are waived, else how many rows, and by which waivers; nothing where none is."""
    counts = [sum(one.status == "waived" for one in each) for each in (mission.requirements, mission.rows)]
    count, what = (counts[0], "requirement") if counts[0] else (counts[1], "row")
    if not count:
        return []
    verb = "" if is_brief else " is" if count == 1 else " are"
    return [f"{counted(count, what)}{verb} waived, not met ({waiver_names([one.id for one in mission.waived_by])})"]


def _met(mission: MissionFindings, waived: Sequence[str]) -> str:
    """Say that nothing is broken that is not waived, and what bears on that."""
    text = ", ".join(waived) or f"every requirement is judged and met {mission.confidence}"
    if "warn" in mission.statuses:
        return f"{text}, with warnings"
    return f"{text}, with autofocus" if mission.status == "pass_with_autofocus" else text


class UnjudgedEffect(NamedTuple):
    """An effect that no requirement takes: what is said of it, with the line to add, and the rows that make it up."""

    text: str
    rows: tuple[Row, ...]


def unjudged_effects(mission: MissionFindings) -> list[UnjudgedEffect]:
    """List the effects of declared errors that no requirement takes, above what is negligible."""
    found: dict[str, tuple[str, list[Row]]] = {}
    for row in mission.rows:
        if row.status not in BROKEN or row.reason is None:
            continue
        for note in (row.reason, *(value for value in row.reason.values if isinstance(value, phrases.Note))):
            if note.code == "effect-is-not-judged":
                kind, _, total, lines = note.values[:4]
                said = phrases.effect_is_not_judged(str(kind), float(str(total)), float(str(total)), _texts(lines))
                found.setdefault(str(kind), (said, []))[1].append(row)
    return [UnjudgedEffect(said, tuple(rows)) for said, rows in found.values()]


def _texts(values: object) -> list[str]:
    return [str(value) for value in values] if isinstance(values, list | tuple) else []


def is_said_with_the_table(row: Row) -> bool:
    """Whether the table of requirements, and what stands below it, says why a row is not evaluated."""
    return row.status == "not_evaluated" and row.reason is not None and row.reason.code == "effect-is-not-judged"


def unseen(mission: MissionFindings) -> list[JudgedRequirement]:
    """Requirements that are broken or waived while no row that judges them is: rows alone would not show it."""
    statuses = {row.id: row.status for row in mission.rows}
    return [
        one
        for one in mission.requirements
        if one.status in (*BROKEN, "waived") and not any(statuses.get(row) == one.status for row in one.rows)
    ]


def declared_words(kinds: DeclaredKinds) -> str:
    """Say how many kinds of error are declared, which are not, and which have no source or are shifted off it."""
    text = f"Declared {len(kinds.declared)} of {kinds.in_all} kinds of error"
    if kinds.missing:
        text += f"; not declared: {', '.join(kind_names(kinds.missing))}"
    if kinds.without_source:
        text += f"; without source: {len(kinds.without_source)}"
    if kinds.shifted:
        text += f"; off the data sheet: {', '.join(shifted_names(kinds))}"
    return f"{text}."


def shifted_names(kinds: DeclaredKinds) -> list[str]:
    """Name the kinds of error that a level shifts off their source, each with its level."""
    return [f"{''.join(kind_names([one.kind]))} {one.level}" for one in kinds.shifted]


def kind_names(kinds: Sequence[str]) -> list[str]:
    """Write kinds of error for reading, those that both platforms have once."""
    owners: dict[str, list[str]] = {}
    for kind in kinds:
        owner, _, what = kind.rpartition(".")
        owners.setdefault(what, []).append(owner)
    names = []
    for what, of in owners.items():
        owner = "both" if len(of) > 1 else of[0]
        names.append(f"{what} ({owner})" if owner else what)
    return names


_WIDTH = 33  # of the ids


def probabilities(drawn: MonteCarlo) -> list[str]:
    """Table of how often each requirement holds, beside what needs no draws, then doubts and notes."""
    lines = [
        f"Monte Carlo: {drawn.draws:,} draws, seed {drawn.seed}, {drawn.model} model; "
        f"intervals of {100 * drawn.confidence:.0f} % by Wilson",
        "",
    ]
    if drawn.probability is None or drawn.probability_low is None or drawn.probability_high is None:
        return [*lines, "  no declared error has a requirement to hold"]
    lines.append(_cells("requirement", "limit", "sum", "rss", "sigma"))
    for requirement in drawn.requirements:
        lines += _requirement(requirement)
    if len(drawn.requirements) > 1:
        lines += ["all at once", f"  {held(drawn.probability, drawn.probability_low, drawn.probability_high)}"]
    texts = [f"warning: {one.id}: {text}" for one in drawn.requirements for text in one.warnings]
    texts += [f"note: {text}" for text in drawn.notes]
    return [*lines, *[line for text in texts for line in wrapped(f"  {text}", "    ")]]


def _requirement(one: Requirement) -> Iterator[str]:
    limit = format_quantity(one.limit, one.unit, 3, "down")
    yield _cells(one.id, limit, *(_size(size, one.unit) for size in (one.sum, one.rss, one.sigma)))
    decimals = _decimals(one.probability_low, one.probability_high)
    yield (
        f"  {held(one.probability, one.probability_low, one.probability_high)}, "
        f"normal with sigma {format_quantity(one.sigma_rss, one.unit)}: {_percent(one.probability_normal, decimals)}"
    )


def _size(size: float | None, unit: str) -> str:
    return "no image" if size is None else format_quantity(size, unit)


def _cells(name: str, *cells: str) -> str:
    return f"{name:<{_WIDTH}}" + "".join(f"{cell:>11}" for cell in cells)


def held(probability: float, low: float, high: float) -> str:
    """Probability and its interval, to the digits that the interval leaves."""
    decimals = _decimals(low, high)
    ends = f"{_percent(low, decimals)} to {_percent(high, decimals)}".replace(" % to", " to")
    return f"holds in {_percent(probability, decimals)} ({ends})"


def _decimals(low: float, high: float) -> int:
    return max(0, min(9, 1 - math.floor(math.log10(100 * (high - low)))))


def _percent(probability: float, decimals: int) -> str:
    """Percent with so many decimals; what rounds to all or none without."""
    text = f"{100 * probability:.{decimals}f}"
    return f"{float(text):.0f} %" if float(text) in (0.0, 100.0) else f"{text} %"
