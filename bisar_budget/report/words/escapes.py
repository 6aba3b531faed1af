"""Text of the user's own, made harmless in each language that a report is written in.

Every function first takes out what is not printable (controls, line ends, marks that turn the reading
direction, halves of characters from file names that are not UTF-8), then what the language would read as its own.
"""

import os
import re
from urllib.parse import quote

from bisar_budget.faults import printable

_XML = {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&apos;"}
_XML_SPECIAL = re.compile("[&<>\"']")
# What means something in GitHub's Markdown or in the HTML within it, and only where it does: a report is also read
# as it is. Within a word an underscore is one, and brackets, escaped, need nothing of the ( and ! beside them.
_MARKDOWN_SPECIAL = re.compile(
    r"[\\`*\[\]<>|$~]"
    r"|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9])"
    r"|&(?=#|\w+;)|@(?=\w)|#(?=\w)|:(?=//|(?:[\w+-]*[A-Z+-][\w+-]*|100|1234):)|(?<=www)\."
    r"|^[-+#=](?=[-+#= ]|$)|^ ",
    re.IGNORECASE | re.ASCII,
)
_MARKDOWN_NUMBER = re.compile(r"^(\d{1,9})([.)])(?=\s|$)", re.ASCII)  # of a list


def xml_text(text: str) -> str:
    """Escape for XML, elements and attributes alike; characters that XML does not have cannot occur."""
    text = printable(text)
    return _XML_SPECIAL.sub(lambda match: _XML[match[0]], text) if _XML_SPECIAL.search(text) else text


def _markdown_escape(match: re.Match[str]) -> str:
    """A backslash can be read past; what it cannot tame everywhere becomes a character reference."""
    special = match[0]
    return f"\\{special}" if special in r"\*_[]~" else f"&#{ord(special)};"


def markdown_text(text: str) -> str:
    """Escape for Markdown, also in a table or at the start of a line."""
    escaped = _MARKDOWN_SPECIAL.sub(_markdown_escape, printable(text))
    return _MARKDOWN_NUMBER.sub(lambda match: f"{match[1]}&#{ord(match[2])};", escaped)


def command_text(text: str) -> str:
    """Escape the message of a workflow command of GitHub's runner."""
    return printable(text).replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def command_property(text: str) -> str:
    """Escape a property of a workflow command, which also ends at a colon or a comma."""
    return command_text(text).replace(":", "%3A").replace(",", "%2C")


def rst_text(text: str) -> str:
    """Escape for one line of reStructuredText: any punctuation can mean something there."""
    return re.sub(r"([!-/:-@\[-`{-~])", r"\\\1", printable(text))


def need_text(text: str) -> str:
    """Keep a field of a need from being run: Sphinx-Needs calls `[[function()]]` and looks up `<<variant>>`."""
    return printable(text).replace("[[", "[ [").replace("<<", "< <")


def uri(path: str) -> str:
    """Percent-encode a path with forward slashes; an absolute one becomes a `file` URI."""
    encoded = quote(os.fsencode(path), safe="/")
    return f"file:///{encoded.lstrip('/')}" if os.path.isabs(path) else encoded


def spreadsheet_text(value: str | None) -> str | None:
    """Keep text of the user's own from being run: a spreadsheet takes what starts like a formula for one."""
    value = printable(value) if value else value
    return f"'{value}" if value and value != "-" and value[0] in "=+-@" else value
