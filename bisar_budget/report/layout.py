"""Lines of text for a terminal."""

WIDTH = 80


def wrapped(text: str, indent: str) -> list[str]:
    """Break at spaces before 80 columns; a word that is longer stays whole, so that a path can be copied."""
    if len(text) <= WIDTH:
        return [text]
    first, *words = text.split(" ")
    lines, line = [], first
    for word in words:
        if len(line) + 1 + len(word) > WIDTH and line.strip():
            lines.append(line)
            line = indent + word
        else:
            line += f" {word}"
    return [*lines, line]
