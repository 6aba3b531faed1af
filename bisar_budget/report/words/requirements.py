"""Texts about requirements that all report formats use: status, deciding row, probability by Monte Carlo."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from bisar_budget import phrases
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.monte_carlo import MonteCarlo, Requirement
from bisar_budget.findings.requirement import DecidingShare, DeclaredKinds, JudgedRequirement
from bisar_budget.findings.row import SPECIFICATION, Row
from bisar_budget.findings.status import BROKEN, STATUS
from bisar_budget.mission.model import id_of_requirement
from bisar_budget.phrases import Note
from bisar_budget.report.words.percentiles import limit_asked
from bisar_budget.report.words.sentences import (
    counted,
    own_id,
    requirement_limit,
    requirement_size,
    use_words,
    waiver_names,
    wrapped,
)
from bisar_budget.units import format_quantity


class RequirementLine(NamedTuple):
    """One line of the table of requirements, as strings.

    `decided_by` is the deciding row, or the reason why the requirement could not be judged. `remark` names the share
    of the requirement to which the utilization `use` refers, such as the share of a platform, and gives the reached
    and the allowed value of this share. It also gives the autofocus gain and the waivers. `texts` are the wordings
    of the requirements whose ids the mission file assigns to this requirement.
    """

    requirement: JudgedRequirement
    name: str
    allowed: str
    reached: str
    use: str
    status: str
    decided_by: str
    remark: str
    texts: tuple[str, ...] = ()


def requirement_id(requirement: JudgedRequirement) -> str:
    """Id of a requirement, such as `requirement.islr`, for lists that also contain rows."""
    return id_of_requirement(requirement.key)


def requirement_lines(mission: MissionFindings) -> Iterator[RequirementLine]:
    """Yield the lines of the table of requirements, in the same order as in the JSON document."""
    for requirement in mission.requirements:
        is_open = requirement.is_unjudged
        remark = ", ".join([*use_remarks(requirement), *(waiver.words for waiver in requirement.waivers)])
        yield RequirementLine(
            requirement=requirement,
            name=requirement.name,
            allowed=limit_asked(requirement),
            reached=requirement_size(requirement.reached, requirement),
            use=use_words(None if requirement.value is None or is_open else requirement.utilization),
            status=requirement.status,
            decided_by=(requirement.reason if is_open and requirement.reason else requirement.row)
            or ("" if remark else "-"),
            remark=remark,
            texts=tuple(mission.texts_of(requirement)),
        )


def use_remarks(requirement: JudgedRequirement) -> Iterator[str]:
    """Yield remarks that explain the utilization of a requirement.

    There are remarks if the utilization differs from the ratio of the reached to the allowed value. They name the row
    with the largest utilization, the deciding share, and the autofocus gain.
    """
    if requirement.is_unjudged or requirement.value is None:
        return
    if requirement.use_row not in (None, requirement.row):
        yield f"most used by {requirement.use_row}"
    remarks = [] if requirement.share is None else [share_words(requirement, requirement.share)]
    if requirement.autofocus_gain is not None and requirement.autofocus_gain > 1:
        has_no_gain = requirement.share is not None and requirement.share.owner in _SHARE_NAMES
        remarks.insert(0 if has_no_gain else len(remarks), f"autofocus gain {requirement.autofocus_gain:.3g}")
    yield from remarks


_SHARE_SUFFIX = "'s share"
# Shares without a platform or a clock as owner.
_SHARE_NAMES = {"autofocus": "autofocus pull-in", "scene": "at the scene's edge", "band": "over the band"}


def share_words(requirement: JudgedRequirement, share: DecidingShare) -> str:
    """Text about the share that decides a requirement, such as `receiver's share: 24.4 of 31.5 deg`."""
    reached, allowed = requirement_size(share.reached, requirement), requirement_limit(share.allowed, requirement)
    number, _, unit = reached.rpartition(" ")
    if number and allowed.endswith(f" {unit}"):  # the unit is written once
        reached = number
    return f"{_SHARE_NAMES.get(share.owner, share.owner + _SHARE_SUFFIX)}: {reached} of {allowed}"


def share_columns(requirement: JudgedRequirement) -> dict[str, str | float | None]:
    """Values of the output columns about the share that decides a requirement, and about autofocus, by column name.

    Three columns describe the share: its owner, its allowed value and its reached value. They are None if no share
    decides the requirement. The last column is the autofocus gain of the requirement.
    """
    share = requirement.share
    return {
        "share_owner": None if share is None else share.owner,
        "share_allowed": None if share is None else share.allowed,
        "share_reached": None if share is None else share.reached,
        "autofocus_gain": requirement.autofocus_gain,
    }


def confidence_words(mission: MissionFindings) -> str:
    """Text with the confidence at which a mission meets its requirements. It begins with a space.

    The text is empty if a requirement is not met.
    """
    status = STATUS[mission.status]
    return f" {mission.confidence}{collections_words(mission)}" if status.is_held and not status.fails else ""


def collections_words(mission: MissionFindings) -> str:
    """Text after the confidence with the fraction of collections that keep each limit; it begins with a comma.

    It is that of the requirement that the fewest collections keep. The text is empty if every requirement on a phase
    or the location states a confidence of its own, or if all collections keep all of them.
    """
    kept = [each.probability for each in mission.requirements if each.confidence is None]
    least = min((probability for probability in kept if probability is not None), default=1.0)
    return f", {share_of_collections(least)} of collections" if least < 1 else ""


def share_of_collections(probability: float) -> str:
    """Probability in percent, rounded down, so that no limit is said to be kept more often than it is."""
    if probability >= _NEARLY_ALL_PROBABILITY:
        return "more than 99.99 %"
    return f"{math.floor(1000 * probability + 1e-9) / 10:g} %"


_NEARLY_ALL_PROBABILITY = 0.9999
_HAS_CONFIDENCE = ("quadratic_phase_error", "cubic_phase_error", "location_error")  # levels are mean powers


def requirement_finding(requirement: JudgedRequirement, mission: MissionFindings) -> str:
    """Sentence with the status, values and remarks of a requirement.

    If a requirement without a stated confidence is met, the sentence also gives the confidence that follows from the
    declared sizes.
    """
    text = f"{requirement.name}{own_id(requirement)}"
    if requirement.value is not None:
        text += f" of {limit_asked(requirement)}{' (default)' if requirement.is_default else ''}"
    status = STATUS[requirement.status]
    text += f": {status.words}"
    if status.is_held and not status.fails and requirement.key in _HAS_CONFIDENCE and not requirement.confidence:
        text += f" {_confidence_of(requirement, mission)}"
    if requirement.reached is not None:
        text += f", {requirement_size(requirement.reached, requirement)} reached"
    if requirement.row is not None and not requirement.is_unjudged:
        text += f", decided by {requirement.row}"
    text += "".join(f", {remark}" for remark in use_remarks(requirement))
    return "; ".join([text, *filter(None, [requirement.reason]), *(waiver.words for waiver in requirement.waivers)])


def _confidence_of(requirement: JudgedRequirement, mission: MissionFindings) -> str:
    """Confidence, in words, at which a mission meets a requirement for which the file states no confidence."""
    of_sizes: object = mission.confidence
    if mission.confidence.code == "stated-confidence":  # other requirements state a confidence
        of_sizes = mission.confidence.values[-1]
    if requirement.probability is None or requirement.probability == 1:
        return str(of_sizes)
    return f"{of_sizes}, {share_of_collections(requirement.probability)} of collections"


def verdict(mission: MissionFindings, *, is_brief: bool = False) -> str:
    """Sentence with the verdict on a whole mission.

    It states that all requirements are met, or how many are broken or cannot be judged. If `is_brief` is true, verbs
    such as "is" are left out.
    """
    if mission.is_empty:
        return "the file declares no error" + ("" if is_brief else ", so nothing is judged; the allowables follow")
    statuses = [requirement.status for requirement in mission.requirements]
    specified = [row.status for row in mission.rows if row.metric == SPECIFICATION]
    counts = (
        (statuses.count("fail"), "requirement", ("is", "are"), "not met"),
        (statuses.count("not_evaluated"), "requirement", ("cannot", "cannot"), "be judged"),
        (len(unjudged_effects(mission)), "effect", ("is", "are"), "judged by no requirement"),
        (specified.count("fail"), "specification", ("is", "are"), "exceeded"),
        (specified.count("not_evaluated"), "specification", ("has", "have"), "no declared error"),
    )
    clauses, last_noun = [], ""
    for count, noun, verbs, outcome in counts:
        if count:
            subject = str(count) if noun == last_noun else f"{count} {noun}{'' if count == 1 else 's'}"
            verb = "" if is_brief and verbs[0] == "is" else f"{verbs[count > 1]} "
            clauses.append(f"{subject} {verb}{outcome}")
            last_noun = noun
    waived = _waived(mission, is_brief=is_brief)
    if clauses:
        return ", ".join([*clauses, *waived])
    broken = [row for row in mission.rows if row.status in BROKEN]
    if broken:
        fails = f"{len(broken)} row{' fails' if len(broken) == 1 else 's fail'} or cannot be judged"
        return ", ".join([fails, *waived])
    if mission.is_unverified:
        return "images were asked for, and none gave a verdict"
    return _met(mission, waived)


def _waived(mission: MissionFindings, *, is_brief: bool) -> list[str]:
    """Return a list with a text about waivers, or an empty list if nothing is waived.

    The text gives the number of waived requirements and the ids of the waivers. If no requirement is waived, it gives
    the number of waived rows instead.
    """
    counts = [sum(item.status == "waived" for item in judged) for judged in (mission.requirements, mission.rows)]
    count, noun = (counts[0], "requirement") if counts[0] else (counts[1], "row")
    if not count:
        return []
    verb = "" if is_brief else " is" if count == 1 else " are"
    return [
        f"{counted(count, noun)}{verb} waived, not met ({waiver_names([waiver.id for waiver in mission.waived_by])})"
    ]


def _met(mission: MissionFindings, waived: Sequence[str]) -> str:
    """Verdict on a mission that breaks no requirement. Waivers, warnings or autofocus are mentioned."""
    text = (
        ", ".join(waived) or f"every requirement is judged and met {mission.confidence}{collections_words(mission)}"
    )
    if "warn" in mission.statuses:
        return f"{text}, with warnings"
    return f"{text}, with autofocus" if mission.status == "pass_with_autofocus" else text


class UnjudgedEffect(NamedTuple):
    """An effect of errors that is not limited by any requirement.

    `text` names the effect, and the line that would have to be added to the mission file to limit it. `rows` are the
    rows of the errors that have this effect.
    """

    text: str
    rows: tuple[Row, ...]


def unjudged_effects(mission: MissionFindings) -> list[UnjudgedEffect]:
    """Effects of declared errors that are not negligible but are not limited by any requirement."""
    effects: dict[str, tuple[str, list[Row]]] = {}
    for row in mission.rows:
        if row.status not in BROKEN or row.reason is None:
            continue
        for note in (row.reason, *(value for value in row.reason.values if isinstance(value, phrases.Note))):
            if note.code == "effect-is-not-judged":
                name, _, total, lines = note.values[:4]
                text = phrases.effect_is_not_judged(str(name), float(str(total)), float(str(total)), _texts(lines))
                effects.setdefault(str(name), (text, []))[1].append(row)
    return [UnjudgedEffect(text, tuple(rows)) for text, rows in effects.values()]


def _texts(values: object) -> list[str]:
    return [str(value) for value in values] if isinstance(values, list | tuple) else []


def is_explained_in_table(row: Row) -> bool:
    """Whether the lines below the table of requirements already explain why a row is not evaluated."""
    return row.status == "not_evaluated" and row.reason is not None and row.reason.code == "effect-is-not-judged"


def unseen(mission: MissionFindings) -> list[JudgedRequirement]:
    """Return the broken or waived requirements that are not visible in the rows.

    No row of such a requirement has the same status as the requirement.
    """
    statuses = {row.id: row.status for row in mission.rows}
    return [
        requirement
        for requirement in mission.requirements
        if requirement.status in (*BROKEN, "waived")
        and not any(statuses.get(row) == requirement.status for row in requirement.rows)
    ]


def shown_ids(row: Row, mission: MissionFindings) -> list[str]:
    """Project ids of the broken or waived requirements that a row represents because it has the same status.

    Formats that list only findings do not list these requirements separately; see `unseen`.
    """
    ids = [
        own_id
        for requirement in mission.requirements
        if requirement.status in (*BROKEN, "waived")
        and requirement.status == row.status
        and row.id in requirement.rows
        for own_id in requirement.requirement_ids
    ]
    return list(dict.fromkeys(ids))


def declared_words(kinds: DeclaredKinds) -> str:
    """Sentence with the number of kinds of error that are declared.

    It also names the kinds that are missing, the kinds without a source, and the kinds whose data-sheet spectra the
    file shifts by a number of decibels.
    """
    text = f"Declared {len(kinds.declared)} of {kinds.in_all} kinds of error"
    if kinds.missing:
        text += f"; not declared: {', '.join(kind_names(kinds.missing))}"
    if kinds.without_source:
        text += f"; without source: {len(kinds.without_source)}"
    if kinds.shifted:
        text += f"; off the data sheet: {', '.join(shifted_names(kinds))}"
    return f"{text}."


def shifted_names(kinds: DeclaredKinds) -> list[str]:
    """Texts for the kinds of error whose data-sheet spectra the file shifts by a number of decibels.

    Each text names the kind and the shift.
    """
    return [f"{''.join(kind_names([error.kind]))} {error.level}" for error in kinds.shifted]


def kind_names(kinds: Sequence[str]) -> list[str]:
    """Names of kinds of error for output. A kind that occurs for both platforms is written once."""
    owners: dict[str, list[str]] = {}
    for kind in kinds:
        owner, _, error = kind.rpartition(".")
        owners.setdefault(error, []).append(owner)
    names = []
    for error, owners_of_error in owners.items():
        owner = "both" if len(owners_of_error) > 1 else owners_of_error[0]
        names.append(f"{error} ({owner})" if owner else error)
    return names


_NAME_WIDTH = 33  # characters


def probabilities(drawn: MonteCarlo) -> list[str]:
    """Return the lines of the table of Monte Carlo results, followed by warnings and notes.

    The table contains the probability that each requirement is met. For comparison, it also contains combined errors
    that are computed without random draws.
    """
    lines = [
        f"Monte Carlo: {drawn.draws:,} draws, seed {drawn.seed}, {drawn.model} model; "
        f"intervals of {100 * drawn.confidence:.0f} % by Wilson",
        *(line for text in drawn.notes if _is_not_drawn(text) for line in wrapped(f"  note: {text}", "    ")),
        "",
    ]
    if drawn.probability is None or drawn.probability_low is None or drawn.probability_high is None:
        return [*lines, "  no requirement limits a declared error"]
    lines.append(_cells("requirement", "limit", "sum", "rss", "sigma"))
    for requirement in drawn.requirements:
        lines += _requirement(requirement)
    if len(drawn.requirements) > 1:
        words = probability_words(drawn.probability, drawn.probability_low, drawn.probability_high)
        lines += ["all at once", f"  {words}"]
    texts = [f"warning: {judged.id}: {text}" for judged in drawn.requirements for text in judged.warnings]
    texts += [f"note: {text}" for text in drawn.notes if not _is_not_drawn(text)]
    return [*lines, *[line for text in texts for line in wrapped(f"  {text}", "    ")]]


def _is_not_drawn(note: Note) -> bool:
    """Whether a note names errors that are left out of the random draws. Such notes are written above the table."""
    return note.code in ("vibration-is-not-drawn", "stated-power-is-not-drawn")


def _requirement(requirement: Requirement) -> Iterator[str]:
    limit = format_quantity(requirement.limit, requirement.unit, 3, "down")
    sizes = (requirement.sum, requirement.rss, requirement.sigma)
    yield _cells(requirement.id, limit, *(_size(size, requirement.unit) for size in sizes))
    low, high = requirement.probability_low, requirement.probability_high
    probability_normal = _percent(requirement.probability_normal, _decimals(low, high))
    yield (
        f"  {probability_words(requirement.probability, low, high)}, "
        f"normal with sigma {format_quantity(requirement.sigma_rss, requirement.unit)}: {probability_normal}"
    )


def _size(size: float | None, unit: str) -> str:
    return "no image" if size is None else format_quantity(size, unit)


def _cells(name: str, *cells: str) -> str:
    return f"{name:<{_NAME_WIDTH}}" + "".join(f"{cell:>11}" for cell in cells)


def probability_words(probability: float, low: float, high: float) -> str:
    """Write a probability and its interval, with as many digits as the width of the interval justifies."""
    decimals = _decimals(low, high)
    ends = f"{_percent(low, decimals)} to {_percent(high, decimals)}".replace(" % to", " to")
    return f"holds in {_percent(probability, decimals)} ({ends})"


def _decimals(low: float, high: float) -> int:
    return max(0, min(9, 1 - math.floor(math.log10(100 * (high - low)))))


def _percent(probability: float, decimals: int) -> str:
    """Write a probability in percent with `decimals` decimals. 0 % and 100 % are written without decimals."""
    text = f"{100 * probability:.{decimals}f}"
    return f"{float(text):.0f} %" if float(text) in (0.0, 100.0) else f"{text} %"
