"""Overview of several missions: each requirement of each mission, and the smallest margin of each requirement."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import REQUIREMENT_NAMES, JudgedRequirement
from bisar_budget.findings.status import STATUS
from bisar_budget.report import document as doc
from bisar_budget.report.words.requirements import requirement_lines
from bisar_budget.report.words.sentences import dashed, sentence, use_words, waiver_names

_MAX_NAMED_MISSION_COUNT = 3  # of a requirement that is not evaluated


class OverviewEntry(NamedTuple):
    """A mission in the overview: its name, the anchor of its chapter, its file, status and findings.

    If the mission file is unusable, `findings` is None, and `faults` is a text with the number of faults.
    """

    name: str
    anchor: str
    file: str
    status: str
    findings: MissionFindings | None = None
    faults: str = ""

    def requirement(self, key: str) -> JudgedRequirement | None:
        """The judged requirement with the key `key`; None if the mission does not have this requirement."""
        requirements = () if self.findings is None else self.findings.requirements
        return next((requirement for requirement in requirements if requirement.key == key), None)


def overview(entries: Sequence[OverviewEntry]) -> doc.Chapter:
    """Return the overview chapter, the first chapter of a report on several missions."""
    stated = [key for key in REQUIREMENT_NAMES if any(entry.requirement(key) for entry in entries)]
    columns = doc.heads("Mission", "Status", *(sentence(REQUIREMENT_NAMES[key]) for key in stated))
    caption = (
        f"{len(entries)} missions, in the order given: use and status of each requirement. Use is reached over "
        "allowed. A name leads to the summary of its mission."
    )
    lines = [_line(entry, stated) for entry in entries]
    blocks: list[doc.Block] = [doc.TextTable("Requirements and missions", caption, columns, lines, "overview")]
    if margins := list(_margins(entries, stated)):
        columns = doc.heads("Requirement", *doc.numbers("Largest use", "Reached", "Limit"), "Mission", "Decided by")
        caption = "Smallest margin of each requirement over all missions"
        blocks.append(doc.TextTable("Smallest margins", caption, columns, margins, "margins"))
    return doc.Chapter("Overview of the missions", blocks, "summary", level=2)


def _line(entry: OverviewEntry, keys: Sequence[str]) -> doc.Line:
    """Table line of a mission, with a cell for each requirement in `keys`."""
    name: list[doc.Text] = [doc.Name(entry.name, entry.anchor), doc.Styled("own-id", doc.Name(entry.file))]
    status: list[doc.Text] = [doc.Badge(entry.status)]
    if entry.findings is None:
        status.append(f" {entry.faults}")
    elif entry.findings.waived_by:
        status.append(f" {waiver_names([waiver.id for waiver in entry.findings.waived_by])}")
    return tuple(name), tuple(status), *(_cell(entry.requirement(key)) for key in keys)


def _cell(requirement: JudgedRequirement | None) -> doc.Text:
    """Table cell with the utilization and status of a requirement; a dash if the mission does not have it."""
    if requirement is None:
        return "–"
    use = use_words(_use(requirement))
    return (doc.Badge(requirement.status),) if use == "-" else (f"{use} ", doc.Badge(requirement.status))


def _use(requirement: JudgedRequirement) -> float | None:
    """Utilization of a requirement; None if it was not judged."""
    return None if requirement.value is None or requirement.is_unjudged else requirement.utilization


def _margins(entries: Sequence[OverviewEntry], keys: Sequence[str]) -> Iterator[doc.Line]:
    """Yield a line for each requirement: its largest utilization, and the mission and row with this utilization.

    Further lines name the requirements that could not be judged for some missions, and list these missions.
    """
    for key in keys:
        judged = [
            (use, entry, line)
            for entry in entries
            for line in (() if entry.findings is None else requirement_lines(entry.findings))
            if line.requirement.key == key and (use := _use(line.requirement)) is not None
        ]
        if not judged:
            continue
        use, entry, line = max(judged, key=lambda margin: margin[0])
        row = line.requirement.use_row or line.requirement.row
        mission = doc.Name(entry.name, entry.anchor)
        decided: doc.Text = doc.Styled("id", doc.Name(row)) if row else "–"
        yield sentence(line.name), use_words(use), dashed(line.reached), dashed(line.allowed), mission, decided
    for key in keys:
        unjudged = [entry for entry in entries if _is_unjudged(entry.requirement(key))]
        if unjudged:
            name = sentence(REQUIREMENT_NAMES[key])
            yield name, STATUS["not_evaluated"].words, "–", "–", _missions(unjudged), "–"


def _is_unjudged(requirement: JudgedRequirement | None) -> bool:
    return requirement is not None and requirement.status == "not_evaluated" and _use(requirement) is None


def _missions(entries: Sequence[OverviewEntry]) -> doc.Text:
    """Links to the chapters of missions, or their number if there are many."""
    if len(entries) > _MAX_NAMED_MISSION_COUNT:
        return f"{len(entries)} missions"
    names = [(", " if number else "", doc.Name(entry.name, entry.anchor)) for number, entry in enumerate(entries)]
    return tuple(names)
