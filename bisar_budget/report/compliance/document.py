"""A report that people read, as data: sections with blocks of text, tables and pictures, the same in all languages.

`html` and `markdown` write it. Text is plain everywhere, and each of them escapes it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from bisar_budget.findings.status import STATUS
from bisar_budget.report.explain.notation import WorkedEquation


# ---------------------------------------------------------------------- parts of a line
@dataclass(frozen=True, slots=True)
class Name:
    """An id or a path, which may break where it is long; `target` is the anchor that it leads to."""

    text: str
    target: str = ""


@dataclass(frozen=True, slots=True)
class Styled:
    """Text with a class of the style sheet, which is that of the whole cell where it fills one.

    Markdown puts what has the class `own-id` or `origin` in brackets.
    """

    style: str
    text: "Text"


@dataclass(frozen=True, slots=True)
class Badge:
    """The word of a status, or of the verdict of an image, with its mark and colour."""

    status: str

    @property
    def words(self) -> str:
        """Its word on a page."""
        return STATUS[self.status].words if self.status in STATUS else self.status


@dataclass(frozen=True, slots=True)
class Use:
    """A bar of a utilization with a mark at the limit; nothing where there is none."""

    part: float | None
    status: str


@dataclass(frozen=True, slots=True)
class Bar:
    """A bar of a part of the whole, in the colour of its owner."""

    part: float
    owner: str


@dataclass(frozen=True, slots=True)
class Swatch:
    """The key to an owner's part of a `Stack`; Markdown has no stack, and a bar in its stead."""

    owner: str
    part: float


@dataclass(frozen=True, slots=True)
class Code:
    """Words to type."""

    text: str


Text = str | Name | Styled | Badge | Use | Bar | Swatch | Code | tuple["Text", ...]
Line = Sequence[Text]


def listed(names: Sequence[str]) -> Text:
    """Names with commas between them."""
    parts: list[Text] = []
    for name in names:
        parts += [", ", Name(name)] if parts else [Name(name)]
    return tuple(parts)


# ---------------------------------------------------------------------- blocks
@dataclass(frozen=True, slots=True)
class Paragraph:
    """Sentences; one that ends with a colon introduces the table below it.

    `style`: a class of the style sheet. What begins with `verdict` is what a reader looks for, `command` is to copy.
    """

    text: Text
    style: str = ""


@dataclass(frozen=True, slots=True)
class Facts:
    """Pairs of a name and what it is; one without a name is another of the name before it."""

    pairs: Sequence[tuple[Text, Text]]
    style: str = "facts"


@dataclass(frozen=True, slots=True)
class Items:
    """A list, of an item's paragraphs each; numbered where the order counts."""

    items: Sequence[Sequence[Text]]
    style: str = "remarks"
    is_numbered: bool = False


@dataclass(frozen=True, slots=True)
class Head:
    """The head of a column of a table, and `number` (to the right) or `id`."""

    text: Text
    style: str = ""


def heads(*heads: Head | str) -> list[Head]:
    """Heads of columns; below one that is only text stands text."""
    return [Head(head) if isinstance(head, str) else head for head in heads]


def numbers(*heads: str) -> list[Head]:
    """Heads of columns of numbers."""
    return [Head(head, "number") for head in heads]


@dataclass(frozen=True, slots=True)
class TextTable:
    """Cells below the heads of their columns, the first of each row its name.

    `label` is its name among the parts of a page that scroll; a table without one is narrow.
    """

    label: str
    caption: Text
    heads: Sequence[Head]
    rows: Sequence[Sequence[Text]]
    style: str = ""


@dataclass(frozen=True, slots=True)
class Stack:
    """A bar of the whole: owners with their parts and what these are in words. A page shows it, Markdown does not."""

    label: str
    parts: Sequence[tuple[str, float, str]]


@dataclass(frozen=True, slots=True)
class Figure:
    """A drawing: `name` of its file, `anchor` of its mission, its title, the SVG.

    `is_told`: the text beside it says what it shows.
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
    """A small image: `name` of its file, what it shows, the PNG, its size on a page. [px]"""

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
    """A formula that no single row has: its sides, by their names in the catalogue."""

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
    """Blocks that a page lays out together, below a heading if there is one."""

    style: str
    blocks: Sequence["Block"]
    heading: Text = ""


@dataclass(frozen=True, slots=True)
class Chapter:
    """Blocks below a heading; `short` is its title in the contents, `anchor` empty where nothing leads to it."""

    title: Text
    blocks: Sequence["Block"]
    anchor: str = ""
    level: int = 3
    short: str = ""
    style: str = ""
    is_article: bool = False
    is_listed: bool = True  # in the contents


Block = Paragraph | Facts | Items | TextTable | Stack | Figure | Images | Steps | Group | Chapter


@dataclass(frozen=True, slots=True)
class Margins:
    """Words in the margins of a mission's printed pages: its name, its document, the bytes of its file."""

    anchor: str
    name: str
    document: str
    file: str


@dataclass(frozen=True, slots=True)
class Compliance:
    """A whole report; `subject` is the mission, or how many, `title` what the report is."""

    version: str
    subject: str
    facts: Facts
    margins: Sequence[Margins]
    chapters: Sequence[Chapter]
    title: str = "Compliance report"


def blocks_of(block: Compliance | Block) -> Iterator[Block]:
    """All blocks inside one, in their order, those inside others too."""
    inner: Sequence[Block] = ()
    if isinstance(block, Compliance):
        inner = block.chapters
    elif isinstance(block, Chapter | Group):
        inner = block.blocks
    for one in inner:
        yield one
        yield from blocks_of(one)
