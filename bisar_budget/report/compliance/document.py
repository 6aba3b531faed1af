"""A report as data: chapters with blocks of text, tables and pictures, independent of the output language.

The modules `html` and `markdown` write a document. Its texts are plain, and each module escapes them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from bisar_budget.findings.status import STATUS
from bisar_budget.report.explain.notation import WorkedEquation


# ---------------------------------------------------------------------- text of a line
@dataclass(frozen=True, slots=True)
class Name:
    """An id or a path, which may break if it is long. `target` is the anchor of its link."""

    text: str
    target: str = ""


@dataclass(frozen=True, slots=True)
class Styled:
    """Text with a class of the style sheet. If it fills a cell, the cell has the class.

    Markdown puts text of the classes `own-id` and `origin` in brackets.
    """

    style: str
    text: "Text"


@dataclass(frozen=True, slots=True)
class Badge:
    """The word of a status, or of the verdict of an image, with its mark and colour."""

    status: str

    @property
    def words(self) -> str:
        """The word that a page shows for the status or the verdict."""
        return STATUS[self.status].words if self.status in STATUS else self.status


@dataclass(frozen=True, slots=True)
class Use:
    """A bar of a utilization with a mark at the limit; without a utilization it is empty."""

    fraction: float | None
    status: str


@dataclass(frozen=True, slots=True)
class Bar:
    """A bar of a fraction of the whole, in the colour of its owner."""

    fraction: float
    owner: str


@dataclass(frozen=True, slots=True)
class Swatch:
    """Colour key of an owner's share in a `Stack`. Markdown has no stack and shows a bar."""

    owner: str
    fraction: float


@dataclass(frozen=True, slots=True)
class Code:
    """Text for the reader to type, such as a command."""

    text: str


Text = str | Name | Styled | Badge | Use | Bar | Swatch | Code | tuple["Text", ...]
Line = Sequence[Text]


def listed(names: Sequence[str]) -> Text:
    """Names with commas between them."""
    texts: list[Text] = []
    for name in names:
        texts += [", ", Name(name)] if texts else [Name(name)]
    return tuple(texts)


# ---------------------------------------------------------------------- blocks
@dataclass(frozen=True, slots=True)
class Paragraph:
    """Sentences. A paragraph that ends with a colon introduces the table below it.

    `style` is a class of the style sheet: classes that begin with `verdict` mark verdicts, `command` marks a command
    to copy.
    """

    text: Text
    style: str = ""


@dataclass(frozen=True, slots=True)
class Facts:
    """Pairs of a name and a value. A pair without a name has the name of the pair before it."""

    pairs: Sequence[tuple[Text, Text]]
    style: str = "facts"


@dataclass(frozen=True, slots=True)
class Items:
    """A list, with the paragraphs of each item; numbered if the order matters."""

    items: Sequence[Sequence[Text]]
    style: str = "remarks"
    is_numbered: bool = False


@dataclass(frozen=True, slots=True)
class Head:
    """The head of a table column. Its style is `number` (aligned to the right), `id` or empty."""

    text: Text
    style: str = ""


def heads(*heads: Head | str) -> list[Head]:
    """Heads of columns. A plain text is the head of a column of text."""
    return [Head(head) if isinstance(head, str) else head for head in heads]


def numbers(*heads: str) -> list[Head]:
    """Heads of columns of numbers."""
    return [Head(head, "number") for head in heads]


@dataclass(frozen=True, slots=True)
class TextTable:
    """A table of text, whose first cell in each row is the name of the row.

    `label` is the accessible name of the scrolling region around the table. A narrow table has no label.
    """

    label: str
    caption: Text
    heads: Sequence[Head]
    rows: Sequence[Sequence[Text]]
    style: str = ""


@dataclass(frozen=True, slots=True)
class Stack:
    """A bar of the whole budget, divided into shares: owner, fraction and words of each. Markdown leaves it out."""

    label: str
    shares: Sequence[tuple[str, float, str]]


@dataclass(frozen=True, slots=True)
class Figure:
    """A drawing: `name` of its file, `anchor` of its mission, title, accessible label and SVG.

    `is_told` is whether the text beside the drawing describes it.
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
    """A small image: `name` of its file, title, caption, PNG, width and height on a page. [px]"""

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
    """A general formula that belongs to no row: both sides, by their names in the catalogue."""

    left: str
    right: str


@dataclass(frozen=True, slots=True)
class Steps:
    """Steps of a derivation, or other formulas with their titles."""

    label: str
    steps: Sequence[tuple[str, Sequence[WorkedEquation | str | Equality]]]
    style: str = "step"


@dataclass(frozen=True, slots=True)
class Group:
    """Blocks that a page lays out together, below an optional heading."""

    style: str
    blocks: Sequence["Block"]
    heading: Text = ""


@dataclass(frozen=True, slots=True)
class Chapter:
    """Blocks below a heading. `short` is its title in the contents, `anchor` the target of links to it."""

    title: Text
    blocks: Sequence["Block"]
    anchor: str = ""
    level: int = 3
    short: str = ""
    style: str = ""
    is_article: bool = False
    is_listed: bool = True  # whether the contents list the chapter


Block = Paragraph | Facts | Items | TextTable | Stack | Figure | Images | Steps | Group | Chapter


@dataclass(frozen=True, slots=True)
class Margins:
    """Texts in the margins of a mission's printed pages: name, document, and digest or path of the file."""

    anchor: str
    name: str
    document: str
    file: str


@dataclass(frozen=True, slots=True)
class Compliance:
    """A report. `subject` is the name of the mission or the number of missions, `title` the kind of report."""

    version: str
    subject: str
    facts: Facts
    margins: Sequence[Margins]
    chapters: Sequence[Chapter]
    title: str = "Compliance report"


def blocks_of(block: Compliance | Block) -> Iterator[Block]:
    """All blocks within a report or a block, in order, nested blocks included."""
    inner: Sequence[Block] = ()
    if isinstance(block, Compliance):
        inner = block.chapters
    elif isinstance(block, Chapter | Group):
        inner = block.blocks
    for child in inner:
        yield child
        yield from blocks_of(child)
