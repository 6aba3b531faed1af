"""Words of a printed document with their boxes on the page, as `pdftotext` reads them."""

import re
import subprocess
from collections.abc import Iterator, Sequence
from html import unescape
from pathlib import Path
from typing import NamedTuple

POINTS_PER_MM = 72 / 25.4
_WORD = re.compile(r'<word xMin="([-\d.]+)" yMin="([-\d.]+)" xMax="([-\d.]+)" yMax="([-\d.]+)">(.*?)</word>')
_PAGE = re.compile(r'<page width="([\d.]+)" height="([\d.]+)">(.*?)</page>', re.DOTALL)


class Word(NamedTuple):
    """A word, with the left, upper, right and lower edge of its box [pt]."""

    left: float
    top: float
    right: float
    bottom: float
    text: str

    def is_part_of(self, other: "Word") -> bool:
        """Whether this is a second impression of the other word or of a part of it, as halos of drawings are."""
        return (
            self.text in other.text
            and other.left - 1 < self.left
            and other.top - 1 < self.top
            and self.right < other.right + 1
            and self.bottom < other.bottom + 1
        )


class PrintedPage(NamedTuple):
    """The size of a page [pt] and its words."""

    width: float
    height: float
    words: Sequence[Word]

    @property
    def text(self) -> str:
        return " ".join(word.text for word in self.words)

    def overprinted(self, across: float = 1.0, along: float = 2.0) -> Iterator[tuple[str, str]]:
        """Pairs of words whose boxes overlap by more than these widths and heights [pt].

        A box has the height of its line, which may be more than that of its letters.
        """
        words = sorted(self.words)
        for index, word in enumerate(words):
            for other in words[index + 1 :]:
                if other.left >= word.right - across:
                    break
                width = min(word.right, other.right) - other.left
                height = min(word.bottom, other.bottom) - max(word.top, other.top)
                if width > across and height > along and not (other.is_part_of(word) or word.is_part_of(other)):
                    yield word.text, other.text

    def beyond(self, margin_mm: float) -> list[str]:
        """Words that reach into the left or right margin of the page, or beyond its upper or lower edge."""
        margin = margin_mm * POINTS_PER_MM
        return [
            word.text
            for word in self.words
            if word.left < margin - 1
            or word.right > self.width - margin + 1
            or word.top < 0
            or word.bottom > self.height
        ]


def printed_pages(pdf: Path) -> list[PrintedPage]:
    """Read the pages of a PDF."""
    command = ["pdftotext", "-bbox-layout", str(pdf), "-"]
    text = subprocess.run(command, capture_output=True, check=True, text=True).stdout
    return [
        PrintedPage(
            float(width),
            float(height),
            [Word(*map(float, edges), unescape(word)) for *edges, word in _WORD.findall(content)],
        )
        for width, height, content in _PAGE.findall(text)
    ]
