"""An answer as data: chapters with blocks of text, tables and pictures, independent of the output format.

The modules of `renderers/` write a document for a terminal, as Markdown, as HTML and as a workbook. The texts of a
document are plain text, which each renderer escapes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import compress

from bisar_budget.findings.status import STATUS
from bisar_budget.report.explain.notation import WorkedEquation
from bisar_budget.report.words.sentences import sentence


# ---------------------------------------------------------------------- text of a line
@dataclass(frozen=True, slots=True)
class Name:
    """An id or a file path. If it is long, it may be broken across lines.

    `target` is the anchor of the place to which the text links.
    """

    text: str
    target: str = ""


@dataclass(frozen=True, slots=True)
class Styled:
    """Text with a class of the style sheet. If the text is a whole table cell, the cell also gets the class.

    In Markdown, text of the classes `own-id` and `origin` is written in brackets, and text of the class `own-text` is
    written after a colon.
    """

    style: str
    text: "Text"


@dataclass(frozen=True, slots=True)
class Badge:
    """The status of a row, or the verdict from its image, shown as a word with a mark and a colour."""

    status: str

    @property
    def words(self) -> str:
        """Word that is displayed for the status or the verdict."""
        return STATUS[self.status].words if self.status in STATUS else self.status


@dataclass(frozen=True, slots=True)
class Use:
    """A bar that shows a utilization, with a mark at the limit; the bar is empty if there is no utilization."""

    fraction: float | None
    status: str


@dataclass(frozen=True, slots=True)
class Bar:
    """A bar that shows a fraction of the whole, in the colour of a platform or the clock."""

    fraction: float
    owner: str


@dataclass(frozen=True, slots=True)
class Swatch:
    """Colour key for the share of a platform or of the clock in a `Stack`.

    Markdown output contains neither colours nor the `Stack`. It shows a bar for `fraction` in place of the key.
    """

    owner: str
    fraction: float


@dataclass(frozen=True, slots=True)
class Code:
    """Text to be typed by the reader, such as a command."""

    text: str


Text = str | Name | Styled | Badge | Use | Bar | Swatch | Code | tuple["Text", ...]
Line = Sequence[Text]


def listed(names: Sequence[str]) -> Text:
    """Join names with commas."""
    texts: list[Text] = []
    for name in names:
        texts += [", ", Name(name)] if texts else [Name(name)]
    return tuple(texts)


# ---------------------------------------------------------------------- blocks
@dataclass(frozen=True, slots=True)
class Paragraph:
    """A paragraph of sentences. If it ends with a colon, it introduces the table below it.

    `style` is a class of the style sheet. Classes whose names begin with `verdict` are for verdicts, and the class
    `command` is for a command that the reader may copy.
    """

    text: Text
    style: str = ""


@dataclass(frozen=True, slots=True)
class Facts:
    """A list of names with values. A value without a name belongs to the previous name."""

    pairs: Sequence[tuple[Text, Text]]
    style: str = "facts"


@dataclass(frozen=True, slots=True)
class Items:
    """A list of items, each with one or more paragraphs. The items are numbered if their order matters."""

    items: Sequence[Sequence[Text]]
    style: str = "remarks"
    is_numbered: bool = False


TERMINAL, PAGE = "terminal", "page"  # media; a column or a block for neither is for both


@dataclass(frozen=True, slots=True)
class Head:
    """The head of a table column. Its style is `number` (right-aligned), `id` or empty for text.

    `unit` is the unit of the numbers below it. If `medium` is `TERMINAL` or `PAGE`, only that medium has the column.
    `width` is the smallest width of the column on a terminal. If `is_sentence`, a text that is
    too long for the column is written below its row on a terminal.
    """

    text: Text
    style: str = ""
    unit: str = ""
    medium: str = ""
    width: int = 0
    is_sentence: bool = False


def page_head(head: Head) -> Text:
    """Text of a column head on a page, with the unit. It begins with a capital letter, unless it is a key."""
    text = sentence(head.text) if isinstance(head.text, str) else head.text
    return (text, f" [{head.unit}]") if head.unit else text


def page_cell(text: Text) -> Text:
    """Text of a table cell on a page, in which a missing value is shown as a dash instead of a hyphen."""
    return "–" if text == "-" else text


def heads(*heads: Head | str) -> list[Head]:
    """Make a list of column heads; a plain string becomes the head of a text column."""
    return [Head(head) if isinstance(head, str) else head for head in heads]


def numbers(*heads: str, medium: str = "") -> list[Head]:
    """Make the heads of number columns. The columns appear only in `medium`, or in both media if it is empty."""
    return [Head(head, "number", medium=medium) for head in heads]


@dataclass(frozen=True, slots=True)
class Opening:
    """The beginning of an answer: its verdict, its mission, and settings from outside the mission file.

    `status` is a key of `STATUS`, and determines the colour of the verdict. `more` are further texts about the
    verdict. `file` is a text with the path of the mission file, and with the options that changed its values. `terms`
    states the conditions of the verdict, such as the model. `overrides` are further settings from outside the file.
    On a page, the name of the mission is the title of the chapter.
    """

    verdict: str
    status: str
    file: str
    name: str
    terms: str = ""
    overrides: Sequence[str] = ()
    more: Sequence[str] = ()

    def page_blocks(self) -> "Iterator[Block]":
        """Yield the blocks that replace the opening on a page: the verdict, followed by named values."""
        yield Paragraph(self.verdict, f"verdict {self.status}")
        for text in self.more:
            yield Paragraph(text)
        pairs: list[tuple[Text, Text]] = [("File", Name(self.file))]
        pairs += [("Terms", self.terms)] if self.terms else []
        pairs += [("Overrides" if not number else "", text) for number, text in enumerate(self.overrides)]
        yield Facts(pairs)


@dataclass(frozen=True, slots=True)
class Only:
    """Blocks that appear in only one medium, `TERMINAL` or `PAGE`."""

    medium: str
    blocks: Sequence["Block"]


@dataclass(frozen=True, slots=True)
class Lead:
    """A line for a terminal that begins with a status.

    `breaks` states the positions at which a long line may be broken: all blanks (the default), blanks
    after the characters in `breaks`, or no position if `breaks` is empty.
    """

    status: str
    text: str
    breaks: str = " "


@dataclass(frozen=True, slots=True)
class Overrides:
    """Settings from outside the file, written for a terminal, on one line if they fit."""

    texts: Sequence[str]


@dataclass(frozen=True, slots=True)
class Close:
    """Blocks for a terminal, without empty lines between them."""

    blocks: Sequence["Block"]


@dataclass(frozen=True, slots=True)
class TextTable:
    """A table of text. The first cell of each row is the name of the row.

    `label` is the accessible name of the scrolling region around the table. A narrow table has no label. `below` has
    the texts that a terminal shows below each row.
    """

    label: str
    caption: Text
    heads: Sequence[Head]
    rows: Sequence[Sequence[Text]]
    style: str = ""
    below: Sequence[Sequence[str]] = ()

    def on(self, medium: str) -> "TextTable":
        """Return the table with only the columns for `medium`."""
        shown = [head.medium in ("", medium) for head in self.heads]
        if all(shown):
            return self
        rows = [[*compress(row, shown)] for row in self.rows]
        return replace(self, heads=[*compress(self.heads, shown)], rows=rows)


@dataclass(frozen=True, slots=True)
class Stack:
    """A bar of the whole budget, divided into shares.

    Each share is given by its platform (or the clock), its fraction and a text. In Markdown, the bar is left out.
    """

    label: str
    shares: Sequence[tuple[str, float, str]]


@dataclass(frozen=True, slots=True)
class Figure:
    """A drawing: `name` of its file, `anchor` of its mission, a title, an accessible label, and SVG text.

    `is_told` is True if the surrounding text describes the drawing.
    """

    name: str
    anchor: str
    title: Text
    label: str
    svg: str
    style: str = ""
    is_told: bool = True


@dataclass(frozen=True, slots=True)
class ShownImage:
    """A small image: `name` of its file, title, caption, PNG data, and its width and height on a page [px]."""

    name: str
    title: str
    caption: str
    png: bytes
    size: tuple[int, int]


@dataclass(frozen=True, slots=True)
class Images:
    """Small images side by side."""

    images: Sequence[ShownImage]


@dataclass(frozen=True, slots=True)
class Equality:
    """An equation between two formulas of the catalogue, which are given by their names.

    The equation is general: it does not belong to a particular row.
    """

    left: str
    right: str


@dataclass(frozen=True, slots=True)
class Steps:
    """The steps of a derivation, or other formulas with titles above them."""

    label: str
    steps: Sequence[tuple[str, Sequence[WorkedEquation | str | Equality]]]
    style: str = "step"


@dataclass(frozen=True, slots=True)
class Group:
    """Blocks that are placed together on a page, below an optional heading."""

    style: str
    blocks: Sequence["Block"]
    heading: Text = ""


@dataclass(frozen=True, slots=True)
class Chapter:
    """A chapter: blocks below a heading.

    `short` is the title in the table of contents, and `anchor` is the target of links to the chapter.
    """

    title: Text
    blocks: Sequence["Block"]
    anchor: str = ""
    level: int = 3
    short: str = ""
    style: str = ""
    is_article: bool = False
    is_listed: bool = True  # whether the contents list the chapter


OfMedium = Only | Lead | Overrides | Close  # blocks of one medium
Block = Opening | OfMedium | Paragraph | Facts | Items | TextTable | Stack | Figure | Images | Steps | Group | Chapter


@dataclass(frozen=True, slots=True)
class Margins:
    """Texts for the page margins when a mission is printed.

    They are the name of the mission, the identification of the document, and the digest or path of the mission file.
    """

    anchor: str
    name: str
    document: str
    file: str


@dataclass(frozen=True, slots=True)
class AnswerDocument:
    """A whole answer as a document.

    `subject` is the name of the mission or the number of missions, and `title` states the kind of answer.
    """

    version: str
    subject: str
    facts: Facts
    margins: Sequence[Margins]
    chapters: Sequence[Chapter]
    title: str = "Compliance report"


def blocks_of(block: AnswerDocument | Block) -> Iterator[Block]:
    """Yield all blocks of a document or of a block in order, including nested blocks."""
    inner: Sequence[Block] = ()
    if isinstance(block, AnswerDocument):
        inner = block.chapters
    elif isinstance(block, Chapter | Group | Only | Close):
        inner = block.blocks
    for child in inner:
        yield child
        yield from blocks_of(child)
