"""Lines of text for a terminal."""

from collections.abc import Sequence

WIDTH = 80


def wrapped(text: str, indent: str) -> list[str]:
    """Break at spaces before 80 columns; a word that is longer stays whole, so that a path can be copied."""
    lines = []
    while len(text) > WIDTH:
        margin = len(text) - len(text.lstrip(" "))
        space = text.rfind(" ", margin, WIDTH + 1)
        if space < 0:
            space = text.find(" ", max(margin, WIDTH + 1))
        if space < 0:
            break
        lines.append(text[:space])
        text = indent + text[space + 1 :]
    return [*lines, text]


def wrapped_counts(text: str) -> list[str]:
    """Break `file: 1 FAIL, 2 pass` before 80 columns, after a colon or comma."""
    joined = text.replace(" ", "\u00a0").replace(",\u00a0", ", ").replace(":\u00a0", ": ").replace(";\u00a0", "; ")
    return [line.replace("\u00a0", " ") for line in wrapped(joined, "  ")]


def table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Align rows of cells, the header first: names to the left, numbers to the right, the last column to the left.

    A name that would take its line beyond 80 columns gets a line of its own, above its numbers.
    """
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    room = WIDTH - sum(widths[1:]) - len(widths) + 1
    first = max((len(row[0]) for row in rows if len(row[0]) <= room), default=0)
    lines = []
    for name, *cells in rows:
        numbers = " ".join(cell.rjust(width) for cell, width in zip(cells[:-1], widths[1:-1], strict=True))
        rest = f"{numbers} {cells[-1]}".rstrip()
        lines += [f"{name:<{first}} {rest}"] if len(name) <= first else [name, f"{'':<{first}} {rest}"]
    return lines
