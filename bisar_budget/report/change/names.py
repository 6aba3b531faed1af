"""Names of sources, parts and files as two versions of a mission write them, without what only looks different."""

import os
import re
import unicodedata

_BETWEEN_DIGITS = re.compile(r"(?<=\d)[\W_]+(?=\d)")
_NO_LETTER = re.compile(r"[\W_]+")


def plain(name: str | None) -> str:
    """Letters and digits of a name, alike where blanks, case, accents or punctuation differ; empty for none.

    What stands between digits stays, as a point: revision 1.1 is not revision 11.
    """
    letters = "".join(one for one in unicodedata.normalize("NFKD", name or "") if not unicodedata.combining(one))
    visible = "".join(one for one in letters.casefold() if unicodedata.category(one) != "Cf")
    return ".".join(_NO_LETTER.sub("", run) for run in _BETWEEN_DIGITS.split(visible))


def plain_file(name: str | None) -> str:
    """The same of a file, without its folder and its ending: a copy elsewhere is no other source."""
    return plain(os.path.splitext(os.path.basename(name or ""))[0])
