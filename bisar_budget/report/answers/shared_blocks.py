"""Parts of documents that all answers have in common: opening, chapter of a mission, table of requirements."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import zip_longest

from bisar_budget import __version__
from bisar_budget.faults import printable
from bisar_budget.findings.guard import Guard
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import REQUIREMENT_NAMES
from bisar_budget.findings.status import STATUS
from bisar_budget.report import document as doc
from bisar_budget.report.words.heading import AboutMission, file_words, other_overrides
from bisar_budget.report.words.percentiles import PERCENTILE_KEYS, percentile_lines, percentile_words
from bisar_budget.report.words.requirements import RequirementLine, requirement_lines
from bisar_budget.report.words.sentences import own_id, sentence
from bisar_budget.report.words.wrong_verdicts import guard_sentences, risk_words, uncertain_use, verdict_words


def opening(
    mission: AboutMission, verdict: str, status: str, terms: str = "", more: Sequence[str] = ()
) -> doc.Opening:
    """Make the opening of an answer about a mission; `status` determines the colour of the verdict."""
    name = printable(mission.name)
    return doc.Opening(verdict, status, file_words(mission), name, terms, other_overrides(mission), more)


def mission_chapter(mission: AboutMission, number: int, blocks: Iterable[doc.Block]) -> doc.Chapter:
    """Make the chapter about a mission; `number` is 1 for the first mission."""
    return doc.Chapter(printable(mission.name), list(blocks), f"mission-{number}", level=2, is_article=True)


def mission_document(
    title: str, missions: Sequence[AboutMission], chapters: Sequence[doc.Chapter]
) -> doc.AnswerDocument:
    """Make the document of an answer, with one chapter for each mission, followed by chapters about the run.

    `title` states the kind of answer, such as `Passes`.
    """
    names = [printable(mission.name) for mission in missions]
    files = [printable(mission.file) for mission in missions]
    margins = [
        doc.Margins(chapter.anchor, name, "", file)
        for chapter, name, file in zip_longest(chapters, names, files, fillvalue="")
        if isinstance(chapter, doc.Chapter)
    ]
    subject = names[0] if len(names) == 1 else f"{len(names)} missions"
    facts = doc.Facts([("Tool", f"bisar-budget {__version__}")])
    return doc.AnswerDocument(__version__, subject, facts, margins, chapters, title=title)


def requirement_table(findings: MissionFindings, *, has_texts: bool = False) -> doc.TextTable:
    """Make the table of requirements of a mission.

    If `has_texts`, the ids and texts of the project are below each requirement instead of beside its name.
    """
    decided = doc.Head("decided by", is_sentence=True)
    status = doc.Head("status", width=max(len(status.text) for status in STATUS.values()))
    heads = doc.heads("requirement", *doc.numbers("allowed", "reached", "use"), status, decided)
    lines = list(requirement_lines(findings))
    below = [[*filter(None, (own_id(line.requirement).strip(), *line.texts))] for line in lines]
    rows: list[doc.Line] = [
        [
            line.name if has_texts else f"{line.name}{own_id(line.requirement)}",
            line.allowed,
            line.reached,
            line.use,
            doc.Badge(line.status),
            _decided_by(line),
        ]
        for line in lines
    ]
    caption = "Requirements and their verdicts"
    return doc.TextTable("Requirements", caption, heads, rows, below=below if has_texts else ())


def guard_blocks(guard: Guard | None) -> Iterator[doc.Block]:
    """Yield the table with the probabilities that the verdicts are wrong.

    Sentences below it are about requirements without such a probability. There is nothing to show if `guard` is None,
    because the probabilities were not asked for.
    """
    if guard is None:
        return
    quantified = [requirement for requirement in guard.requirements if requirement.probability is not None]
    if quantified:
        heads = doc.heads("requirement", *doc.numbers("use", "probability that the verdict is wrong"), "verdict")
        lines: list[doc.Line] = [
            [
                sentence(REQUIREMENT_NAMES[requirement.key]),
                uncertain_use(requirement),
                risk_words(requirement),
                verdict_words(requirement),
            ]
            for requirement in quantified
        ]
        caption = "Probability that a verdict is wrong, from the stated uncertainties of figures"
        yield doc.TextTable("Guard", caption, heads, lines)
    unknown = [requirement for requirement in guard.requirements if requirement.probability is None]
    if unknown or not quantified:
        yield doc.Items([[text] for text in guard_sentences(replace(guard, requirements=tuple(unknown)))])


def percentile_blocks(findings: MissionFindings) -> Iterator[doc.Block]:
    """Yield the table of percentiles of a mission for a terminal, and its explanation, if there are any."""
    lines = list(percentile_lines(findings))
    if not lines:
        return
    heads = doc.heads("not exceeded in", *doc.numbers(*(f"{name} %" for name in PERCENTILE_KEYS)))
    rows = [[line.name, *line.sizes] for line in lines]
    table = doc.TextTable("Percentiles", "Percentiles of the limited quantities", heads, rows)
    yield doc.Close([table, doc.Items([[percentile_words(findings)]])])


def _decided_by(line: RequirementLine) -> doc.Text:
    if not line.remark:
        return doc.Name(line.decided_by)
    return (doc.Name(line.decided_by), ", " if line.decided_by else "", line.remark)
