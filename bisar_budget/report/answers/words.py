"""Parts that the documents of all answers share: the opening, the chapter of a mission, and the whole document."""

from collections.abc import Iterable, Sequence

from bisar_budget import __version__
from bisar_budget.faults import printable
from bisar_budget.report import document as doc
from bisar_budget.report.words.heading import AboutMission, file_words, other_overrides


def opening(
    mission: AboutMission, verdict: str, status: str, terms: str = "", more: Sequence[str] = ()
) -> doc.Opening:
    """Make the opening of an answer about a mission; `status` gives the colour of the verdict."""
    name = printable(mission.name)
    return doc.Opening(verdict, status, file_words(mission), name, terms, other_overrides(mission), more)


def mission_chapter(mission: AboutMission, number: int, blocks: Iterable[doc.Block]) -> doc.Chapter:
    """Make the chapter of the mission with the given number; the first mission has the number 1."""
    return doc.Chapter(printable(mission.name), list(blocks), f"mission-{number}", level=2, is_article=True)


def mission_document(
    title: str, missions: Sequence[AboutMission], chapters: Sequence[doc.Chapter]
) -> doc.AnswerDocument:
    """Make the document of an answer, which has one chapter for each mission. `title` is the kind of answer."""
    names = [printable(mission.name) for mission in missions]
    margins = [
        doc.Margins(chapter.anchor, name, "", printable(mission.file))
        for chapter, name, mission in zip(chapters, names, missions, strict=True)
    ]
    subject = names[0] if len(names) == 1 else f"{len(names)} missions"
    facts = doc.Facts([("Tool", f"bisar-budget {__version__}")])
    return doc.AnswerDocument(__version__, subject, facts, margins, chapters, title=title)
