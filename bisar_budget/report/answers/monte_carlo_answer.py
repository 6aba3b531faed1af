"""The answer of a Monte Carlo analysis: how often randomly drawn errors meet each requirement."""

from collections.abc import Iterator, Sequence

from bisar_budget import __version__
from bisar_budget.findings.monte_carlo import MonteCarlo, Requirement
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.answers import Records
from bisar_budget.report.answers.check_content import monte_carlo_item
from bisar_budget.report.words.requirements import probability_words
from bisar_budget.report.words.sentences import sentence
from bisar_budget.units import format_quantity


def content(answers: Sequence[MonteCarlo]) -> dict[str, object]:
    """Content of the JSON document, in the form that `check --monte-carlo` uses for a mission."""
    (drawn,) = answers
    return monte_carlo_item(drawn)


def records(answers: Sequence[MonteCarlo]) -> Records:
    """Table of the answer: one line for each requirement, in SI units."""
    (drawn,) = answers
    return Records(Requirement._fields, [requirement._asdict() for requirement in drawn.requirements])


def document(answers: Sequence[MonteCarlo], style: Style) -> doc.AnswerDocument:
    """Text of the answer: the probability of meeting each requirement, and the combined errors for comparison."""
    (drawn,) = answers
    chapter = doc.Chapter("Monte Carlo", list(draws(drawn)), "draws", level=2)
    facts = doc.Facts([("Tool", f"bisar-budget {__version__}")])
    return doc.AnswerDocument(
        __version__, "Monte Carlo", facts, [doc.Margins("draws", "", "", "")], [chapter], "Draws"
    )


def draws(drawn: MonteCarlo, name: str = "") -> Iterator[doc.Block]:
    """Yield the table with the results of a Monte Carlo analysis, and remarks on it.

    The table has the probability of meeting each requirement, and the combined errors for comparison. `name` is the
    name of the mission for the label of the table.
    """
    lines: list[doc.Line] = []
    for requirement in drawn.requirements:
        sizes = (
            "–" if size is None else format_quantity(size, requirement.unit)
            for size in (requirement.sum, requirement.rss, requirement.sigma)
        )
        probability = probability_words(
            requirement.probability, requirement.probability_low, requirement.probability_high
        )
        limit = format_quantity(requirement.limit, requirement.unit, 3, "down")
        lines.append((doc.Name(requirement.id), limit, *sizes, probability))
    if drawn.probability is not None and len(drawn.requirements) > 1:
        ends = (drawn.probability_low or 0.0, drawn.probability_high or 1.0)
        lines.append((doc.Name("all at once"), *("–",) * 4, probability_words(drawn.probability, *ends)))
    if lines:
        yield doc.TextTable(
            f"Monte Carlo of {name}" if name else "Monte Carlo",
            f"Probability that each requirement holds: {drawn.draws:,} draws, seed {drawn.seed}, {drawn.model} "
            f"model; intervals of {100 * drawn.confidence:.0f} %. For comparison: worst-case sum, root-sum-square, "
            "standard deviation.",
            doc.heads(doc.Head("requirement", "id"), *doc.numbers("limit", "sum", "rss", "sigma"), "over the draws"),
            lines,
        )
    remarks = [f"{requirement.id}: {text}" for requirement in drawn.requirements for text in requirement.warnings]
    remarks += drawn.notes
    if drawn.probability is None:
        remarks.append("no requirement limits a declared error")
    if remarks:
        yield doc.Items([[f"{sentence(text)}."] for text in remarks])
