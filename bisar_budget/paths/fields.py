"""Texts, times and numbers in files of orbits."""

import math
import re

from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.instant import Instant, parse_instant

LARGEST_BYTES = 32_000_000  # a day of an ephemeris at 1 Hz has 26 MB as XML
EARLIEST, LATEST = 36112, 124593  # modified Julian days of 1957-10-01 and 2200-01-01, for which there are orbits
_NUMBER = re.compile(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?\s*", re.ASCII)


def hold_to_size(size: int, name: str, part: str = "objects") -> None:
    """Refuse a file that is too large, and say what to keep of it."""
    if size > LARGEST_BYTES:
        raise PathFileError(f"{name}: is larger than {LARGEST_BYTES // 1_000_000} MB; keep the {part} needed")


def decoded(data: bytes, name: str) -> str:
    """The text of a file, which is UTF-8."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise PathFileError(f"{name}:{line}: is not a text in UTF-8 (byte {data[error.start]:#04x})") from None


def epoch_in(text: str) -> Instant | None:
    """Instant from a calendar date, or a year and its day: CCSDS 301.0-B, ASCII time codes A and B."""
    text = text.strip()
    match = re.fullmatch(r"(\d{4})-(\d{3})(T.*)", text, re.ASCII)
    if match is None:
        return parse_instant(text, needs_zone=False)
    first = parse_instant(f"{match[1]}-01-01{match[3]}", needs_zone=False)
    if first is None or not 1 <= int(match[2]) <= days_of_year(int(match[1])):
        return None
    return Instant(first.day + int(match[2]) - 1, first.seconds)


def number_in(text: object) -> float | None:
    """A finite number from a text or a number; None otherwise."""
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        return None
    if isinstance(text, str):
        if not _NUMBER.fullmatch(text):
            return None
        text = text.replace("D", "e").replace("d", "e")  # as Fortran writes exponents
    try:
        value = float(text)
    except OverflowError:
        return None
    return value if math.isfinite(value) else None


def days_of_year(year: int) -> int:
    """365, or 366 in a leap year."""
    return 366 if year % 4 == 0 and (year % 100 != 0 or year % 400 == 0) else 365
