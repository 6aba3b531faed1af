"""Units that are recognised but not accepted: inches, mils, unit names in words, and unlisted prefixes.

They are used in messages, which convert the quantity to an accepted unit, or suggest the intended spelling. A message
never suggests a unit that changes the size of the quantity. The module is imported only after a unit was refused.
"""

import math
import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from bisar_budget.constants import STANDARD_GRAVITY_MPS2
from bisar_budget.units import DIMENSIONS, Dimension, format_quantity, normal_unit

_SAME_FACTOR = 1e-9  # relative difference of two spellings of one unit
_MIN_TYPO_CHARACTERS = 3  # a shorter unit is similar to too many units
_MIN_PLURAL_CHARACTERS = 4  # shortest plural that is recognised, such as mils or days


class UnitValue(NamedTuple):
    """Conversion factor from a unit to SI, and the exponents of metre, second and radian in the unit."""

    factor: float
    powers: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def times(self, other: "UnitValue", exponent: float = 1.0) -> "UnitValue":
        """Multiply this unit by another unit that is raised to the power `exponent`."""
        a, b = self.powers, other.powers
        powers = (a[0] + exponent * b[0], a[1] + exponent * b[1], a[2] + exponent * b[2])
        return UnitValue(self.factor * other.factor**exponent, powers)


_LENGTH_EXPONENTS, _TIME_EXPONENTS, _ANGLE_EXPONENTS, _NUMBER_EXPONENTS = (
    (1.0, 0.0, 0.0),
    (0.0, 1.0, 0.0),
    (0.0, 0.0, 1.0),
    (0.0, 0.0, 0.0),
)
_SPEED_EXPONENTS, _ACCELERATION_EXPONENTS, _FREQUENCY_EXPONENTS, _TURN_RATE_EXPONENTS = (
    (1.0, -1.0, 0.0),
    (1.0, -2.0, 0.0),
    (0.0, -1.0, 0.0),
    (0.0, -1.0, 1.0),
)
_DEGREE_RAD = math.pi / 180
_SI_PREFIXES = {"T": 1e12, "G": 1e9, "M": 1e6, "k": 1e3, "h": 1e2, "d": 1e-1, "c": 1e-2, "m": 1e-3, "u": 1e-6}
_SI_PREFIXES |= {"n": 1e-9, "p": 1e-12, "f": 1e-15}
# Each unit with its prefixes in use. International inch, foot, yard and mile of 1959; the remaining units are from
# the SI brochure, 9th edition, tables 8 and 3, and from ISO 80000-3.
_ATOMS: Mapping[str, tuple[float, tuple[float, float, float], str]] = {
    "1": (1.0, _NUMBER_EXPONENTS, ""),
    "%": (1e-2, _NUMBER_EXPONENTS, ""),
    "ppm": (1e-6, _NUMBER_EXPONENTS, ""),
    "ppb": (1e-9, _NUMBER_EXPONENTS, ""),
    "m": (1.0, _LENGTH_EXPONENTS, "khdcmunpf"),
    "in": (0.0254, _LENGTH_EXPONENTS, ""),
    "mil": (2.54e-5, _LENGTH_EXPONENTS, ""),
    "ft": (0.3048, _LENGTH_EXPONENTS, "k"),
    "yd": (0.9144, _LENGTH_EXPONENTS, ""),
    "mi": (1609.344, _LENGTH_EXPONENTS, ""),
    "nmi": (1852.0, _LENGTH_EXPONENTS, ""),
    "NM": (1852.0, _LENGTH_EXPONENTS, ""),
    "micron": (1e-6, _LENGTH_EXPONENTS, ""),
    "s": (1.0, _TIME_EXPONENTS, "cdmunpf"),
    "min": (60.0, _TIME_EXPONENTS, ""),
    "h": (3600.0, _TIME_EXPONENTS, ""),
    "hr": (3600.0, _TIME_EXPONENTS, ""),
    "day": (86400.0, _TIME_EXPONENTS, ""),
    "week": (604800.0, _TIME_EXPONENTS, ""),
    "month": (30 * 86400.0, _TIME_EXPONENTS, ""),
    "year": (365.25 * 86400.0, _TIME_EXPONENTS, ""),
    "Hz": (1.0, _FREQUENCY_EXPONENTS, "TGMkhdcmun"),
    "rad": (1.0, _ANGLE_EXPONENTS, "cmunpf"),
    "deg": (_DEGREE_RAD, _ANGLE_EXPONENTS, "mun"),
    "\N{DEGREE SIGN}": (_DEGREE_RAD, _ANGLE_EXPONENTS, "mun"),
    "arcmin": (_DEGREE_RAD / 60, _ANGLE_EXPONENTS, ""),
    "arcsec": (_DEGREE_RAD / 3600, _ANGLE_EXPONENTS, "mu"),
    "mas": (_DEGREE_RAD / 3600e3, _ANGLE_EXPONENTS, ""),
    "gon": (math.pi / 200, _ANGLE_EXPONENTS, "m"),
    "rev": (2 * math.pi, _ANGLE_EXPONENTS, ""),
    "turn": (2 * math.pi, _ANGLE_EXPONENTS, ""),
    "rpm": (2 * math.pi / 60, _TURN_RATE_EXPONENTS, ""),
    "dps": (_DEGREE_RAD, _TURN_RATE_EXPONENTS, "mu"),
    "dph": (_DEGREE_RAD / 3600, _TURN_RATE_EXPONENTS, "m"),
    "mph": (0.44704, _SPEED_EXPONENTS, ""),
    "kph": (1 / 3.6, _SPEED_EXPONENTS, ""),
    "kmh": (1 / 3.6, _SPEED_EXPONENTS, ""),
    "mps": (1.0, _SPEED_EXPONENTS, "kcm"),
    "fps": (0.3048, _SPEED_EXPONENTS, ""),
    "kn": (1852 / 3600, _SPEED_EXPONENTS, ""),
    "kt": (1852 / 3600, _SPEED_EXPONENTS, ""),
    "g": (STANDARD_GRAVITY_MPS2, _ACCELERATION_EXPONENTS, "mun"),
    "Gal": (1e-2, _ACCELERATION_EXPONENTS, "mu"),
    "TECU": (1e16, (-2.0, 0.0, 0.0), ""),
}
# Words in small letters and in the singular; a word may have a prefix.
_UNIT_WORDS = {
    "arcminute": "arcmin",
    "arcsecond": "arcsec",
    "asec": "arcsec",
    "degree": "deg",
    "feet": "ft",
    "foot": "ft",
    "gal": "Gal",
    "gee": "g",
    "hertz": "Hz",
    "hour": "h",
    "inch": "in",
    "inches": "in",
    "hr": "h",
    "knot": "kn",
    "kt": "kn",
    "meter": "m",
    "metre": "m",
    "mile": "mi",
    "minute": "min",
    "percent": "%",
    "radian": "rad",
    "revolution": "rev",
    "sec": "s",
    "second": "s",
    "yard": "yd",
}
_WORD_PREFIXES = {"tera": 1e12, "giga": 1e9, "mega": 1e6, "kilo": 1e3, "centi": 1e-2, "milli": 1e-3, "micro": 1e-6}
_WORD_PREFIXES |= {"nano": 1e-9, "pico": 1e-12}
_UNIT_TOKEN = re.compile(r"\s*(sqrt\(|[()/*\u00b7]|\^-?\d(?:\.\d)?|[A-Za-z\u00b0%-]+|1)", re.ASCII)
# Levels against a reference other than a carrier, by their units in small letters.
_OTHER_LEVELS = {
    "dbm": "a power",
    "dbw": "a power",
    "dbm/hz": "a power in each hertz",
    "dbw/hz": "a power in each hertz",
    "dbv": "a voltage",
    "dbsm": "a radar cross section",
}


# 47°15'04.3", 47d15m, 47:15:04, with or without a letter such as N at the end.
_SEXAGESIMAL = re.compile(
    r"([+-]?)(\d{1,3})\s*(?:\u00b0|\u00ba|d|deg|:)\s*(\d{1,2}(?:\.\d*)?)\s*(?:['\u2032\u2019m:]|min)?"
    r"\s*(?:(\d{1,2}(?:\.\d*)?)\s*(?:[\"\u2033\u201ds]|''|sec)?)?\s*([NSEW]?)",
    re.ASCII,
)


def about_unit(digits: str, written: str, dimension: Dimension) -> tuple[str, str]:
    """Problem and hint for the error message about a number with an unknown unit.

    `digits` is the number and `written` the unit, both as written in the file.
    """
    unit = normal_unit(written)
    sexagesimal = _SEXAGESIMAL.fullmatch(digits + written) if dimension.si == "rad" else None
    if sexagesimal is not None:
        sign, degrees, minutes, seconds, side = sexagesimal.groups()
        if float(minutes) < 60 and float(seconds or 0) < 60:
            angle_deg = int(degrees) + float(minutes) / 60 + float(seconds or 0) / 3600
            minus = "-" if (sign == "-") != (side in ("S", "W") and side != "") else ""
            return "is in degrees, minutes and seconds", f"Write {minus}{angle_deg:.11g} deg"
    problem = f"has the unknown unit {written!r}"
    if other_level := _OTHER_LEVELS.get(unit.lower()):
        is_noise = unit.lower().endswith("/hz") and dimension.si == "dBc/Hz"
        hint = f"Subtract the carrier's power in {unit[:-3]}" if is_noise else ""
        return f"must be {dimension.name}, but {written!r} makes it {other_level}", hint
    if dimension.si == "rad" and unit.lower().removesuffix("s") == "mil":
        return problem, "A mil is 1/6400 of a turn, a milliradian, or a thousandth of an inch: write mrad"
    if dimension.si == "rad" and unit.lower() == "as":
        return problem, "Did you mean 'arcsec'?"
    value = value_of_unit(unit)
    if value is None:
        meant = _respelt(unit, dimension)
        return problem, f"Did you mean {meant!r}?" if meant else ""
    if value.powers == _powers_of(dimension):
        if meant := _of_same_size(value, dimension):
            return problem, f"Did you mean {meant!r}?"
        return problem, _converted(digits, written, value.factor, dimension)
    other_dimension = next((candidate for candidate in DIMENSIONS if _powers_of(candidate) == value.powers), None)
    if other_dimension is None or "Hz" in unit:  # a density that is not of the field's dimension
        return problem, ""
    conversion = _converted(digits, written, value.factor, other_dimension)
    return problem, f"{conversion}, {other_dimension.name}" if conversion else ""


def is_of(written: str, dimension: Dimension) -> bool:
    """Whether a unit belongs to a dimension; the unit may be accepted or only recognised."""
    value = value_of_unit(normal_unit(written))
    return value is not None and value.powers == _powers_of(dimension)


def value_of_unit(unit: str) -> UnitValue | None:
    """Value of a unit that is a product, quotient, power or square root of known units; None if it is unknown."""
    tokens: list[str] = []
    end = 0
    while end < len(unit):
        match = _UNIT_TOKEN.match(unit, end)
        if match is None:
            return None
        tokens.append(match[1])
        end = match.end()
    try:
        value = _product(tokens)
    except (IndexError, OverflowError, ZeroDivisionError):
        return None
    return None if tokens or value is None or not math.isfinite(value.factor) or not value.factor else value


def _product(tokens: list[str]) -> UnitValue | None:
    """Parse a product of units, up to a closing bracket or the end of the tokens, and return its value.

    The parsed tokens are removed from `tokens`; the closing bracket is not removed. The result is None if a unit is
    unknown.
    """
    value = UnitValue(1.0)
    sign = 1.0
    if tokens[0] == "/":
        sign = -1.0
        tokens.pop(0)
    while True:
        factor = _power(tokens)
        if factor is None:
            return None
        value = value.times(factor, sign)
        if not tokens or tokens[0] == ")":
            return value
        sign = -1.0 if tokens[0] == "/" else 1.0
        if tokens[0] in ("/", "*", "\u00b7"):
            tokens.pop(0)


def _power(tokens: list[str]) -> UnitValue | None:
    token = tokens.pop(0)
    if token in ("(", "sqrt("):
        value = _product(tokens)
        if tokens.pop(0) != ")":
            return None
        exponent = 0.5 if token == "sqrt(" else 1.0
    else:
        value, exponent = _atom(token), 1.0
    if tokens and tokens[0].startswith("^"):
        exponent *= float(tokens.pop(0)[1:])
    return None if value is None else UnitValue(1.0).times(value, exponent)


def _atom(name: str) -> UnitValue | None:
    """Value of a single unit, given as a symbol or as a word, with or without a prefix; None if it is unknown."""
    for prefix, factor in {"": 1.0, **_SI_PREFIXES}.items():
        of_name = _ATOMS.get(name.removeprefix(prefix)) if name.startswith(prefix) else None
        if of_name is not None and (not prefix or prefix in of_name[2]):
            return UnitValue(factor * of_name[0], of_name[1])
    word = name.lower()
    for prefix, factor in {"": 1.0, **_WORD_PREFIXES}.items():
        bare_word = word.removeprefix(prefix).lstrip("-") if word.startswith(prefix) else ""
        unit_name = _UNIT_WORDS.get(bare_word) or _UNIT_WORDS.get(bare_word.removesuffix("s"))
        if unit_name is not None:
            return UnitValue(factor * _ATOMS[unit_name][0], _ATOMS[unit_name][1])
    is_plural = len(name) >= _MIN_PLURAL_CHARACTERS and name.endswith("s") and name[:-1] in _ATOMS
    return UnitValue(*_ATOMS[name[:-1]][:2]) if is_plural else None


def _powers_of(dimension: Dimension) -> tuple[float, float, float] | None:
    """Exponents of metre, second and radian in the SI unit of a dimension; None for decibels and bytes."""
    value = value_of_unit(dimension.si or "1")
    return None if value is None else value.powers


def _of_same_size(value: UnitValue, dimension: Dimension) -> str:
    """Unit of a dimension that has the same size as the unit `value`; empty if there is no such unit."""
    return next((unit for unit, factor in dimension.units.items() if unit and _is_equal(factor, value.factor)), "")


def _is_equal(a: float, b: float) -> bool:
    return math.isclose(a, b, rel_tol=_SAME_FACTOR)


def _converted(digits: str, written: str, factor: float, dimension: Dimension) -> str:
    """Text that converts a number to an accepted unit, such as "10 in is 0.254 m"; empty if it overflows."""
    value = float(digits) * factor
    return f"{digits} {written} is {format_quantity(value, dimension.si, 9)}" if math.isfinite(value) else ""


def _respelt(unit: str, dimension: Dimension) -> str:
    """Unit of a dimension that differs from `unit` only in upper and lower case, or by a single typing error.

    The result is empty if there is no such unit, or if two units of different size are equally similar to `unit`.
    """
    candidates = dict(_conceivable(dimension))
    spellings = {unit.lower(), normal_unit(unit.lower().replace("hz", "Hz")).lower()}
    folded = [spelling for spelling in candidates if spelling.lower() in spellings and len(spelling) > 1]
    if not _is_one_size([candidates[spelling] for spelling in folded]):
        folded = [spelling for spelling in folded if spelling in dimension.units]
        is_unsure = len(folded) > 1 or folded[0][0] != unit[0]  # Mhz is not millihertz, and Nm is ambiguous
        folded = [] if is_unsure else folded
    is_level = _powers_of(dimension) is None  # without a letter of dBc, the unit is a power ratio
    slips = [spelling for spelling in candidates if _is_one_slip(unit, spelling)]
    if not _is_one_size([candidates[spelling] for spelling in (*folded, *slips)]):
        return ""
    offered = [*folded, *(slips if len(unit) >= _MIN_TYPO_CHARACTERS and not is_level else ())]
    return next((spelling for spelling in offered if spelling in dimension.units), "")


def _is_one_size(factors: list[float]) -> bool:
    return all(_is_equal(factor, factors[0]) for factor in factors)


def _conceivable(dimension: Dimension) -> Iterator[tuple[str, float]]:
    """Yield the units of a dimension with their factors, including units with prefixes that are not accepted.

    The user may have meant such a unit. A misspelt unit must therefore not be corrected to a unit of another size.
    """
    powers = _powers_of(dimension)
    for unit, factor in dimension.units.items():
        if not unit:
            continue
        yield unit, factor
        if powers is None:
            continue
        for bare in {unit, unit[1:]}:
            for prefixed in (bare, *(prefix + bare for prefix in _SI_PREFIXES)):
                value = value_of_unit(prefixed) if prefixed not in dimension.units else None
                if value is not None and value.powers == powers:
                    yield prefixed, value.factor


def _is_one_slip(a: str, b: str) -> bool:
    """Whether two strings differ by at most one extra, missing or wrong letter, or by two transposed letters."""
    if a == b or abs(len(a) - len(b)) > 1:
        return a == b
    start = next((n for n, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))
    tail_a, tail_b = a[start:], b[start:]
    is_exchanged = tail_a[:2] == tail_b[1::-1] and tail_a[2:] == tail_b[2:] and len(tail_a) > 1
    return tail_a[1:] == tail_b or tail_a == tail_b[1:] or tail_a[1:] == tail_b[1:] or is_exchanged
