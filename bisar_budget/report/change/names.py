"""Normalize names of sources, parts and files, so that different spellings in two versions compare equal."""

import os
import re
import unicodedata

_BETWEEN_DIGITS = re.compile(r"(?<=\d)[\W_]+(?=\d)")
_NO_LETTER = re.compile(r"[\W_]+")


def plain(name: str | None) -> str:
    """Reduce a name to lower-case letters and digits without accents; None gives an empty string.

    Blanks or punctuation between two digits become a point, so that revision 1.1 differs from revision 11.
    """
    letters = "".join(one for one in unicodedata.normalize("NFKD", name or "") if not unicodedata.combining(one))
    visible = "".join(one for one in letters.casefold() if unicodedata.category(one) != "Cf")
    return ".".join(_NO_LETTER.sub("", run) for run in _BETWEEN_DIGITS.split(visible))


def plain_file(name: str | None) -> str:
    """Reduce a file name as in `plain`, without folder and suffix, so that a moved copy keeps its name."""
    return plain(os.path.splitext(os.path.basename(name or ""))[0])
