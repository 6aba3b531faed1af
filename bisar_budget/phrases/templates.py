"""Templates of sentences, filled with quantities in SI units.

A field of a template, `{name:format}`, names a quantity and its format:

- a unit (`{length:m}`, `{level:dB}`): three digits with a readable prefix; `{length:m 2}`: two digits;
  `{level:dB down}`: rounded down; `{phase:rad}`: three digits without a prefix, for comparison with π/4;
- `{size:size m}`: a magnitude, which may be infinite; `{limit:limit m}`: a limit, rounded down;
- `{acceleration:m/s^2 as g}`: in another unit of the same dimension;
- `{share:percent}`: a fraction in percent with three digits; `{share:percent .0f}`: in a format of Python;
- `{time:min}`: seconds in minutes; `{cycles:cycles}`: three digits rounded down, without a unit;
- `{rows:count row}`: a count with its noun;
- `{ids:list}`, `{keys:and}`, `{keys:or}`: several items joined; `{names:and platforms.*.oscillator}`: the same,
  with each item in place of the `*` of a pattern;
- a format of Python (`{factor:g}`).

A unit may be a field itself: `{size:size {unit}}`.
"""

import math
import string
from collections.abc import Callable, Iterable, Mapping
from typing import SupportsFloat

from bisar_budget.units import format_in, format_limit, format_quantity

_UNITS = ("m", "s", "Hz", "dB", "m/s", "m/s^2")  # of quantities with a readable prefix


def _number(value: object) -> float:
    if not isinstance(value, SupportsFloat):
        raise TypeError(f"no number: {value!r}")
    return float(value)


def _items(value: object) -> list[str]:
    if not isinstance(value, Iterable):
        raise TypeError(f"no items: {value!r}")
    return [str(item) for item in value]


def size_words(size: float, unit: str) -> str:
    """Text with a magnitude and its unit. A length gets an SI prefix; other quantities, such as phases, do not."""
    if not math.isfinite(size):
        return "without a value (no ground point has this range history)"
    return format_quantity(size, unit) if unit == "m" else f"{abs(size):.3g} {unit}"


def over_words(size: float, limit: float, unit: str) -> str:
    """Text with a magnitude and its limit, for example `1.2 rad, 0.785 rad allowed`."""
    return f"{size_words(size, unit)}, {format_limit(limit, unit)} allowed"


def level_words(level_db: float, rounding: str = "nearest") -> str:
    """Text with the level `level_db` in dB, with three digits."""
    return format_quantity(level_db, "dB", 3, rounding)


def cycles_words(cycles: float) -> str:
    """Text with a number of cycles, rounded down to three digits, so that a number below a limit stays below it."""
    return format_quantity(cycles, "", 3, "down")


def in_brackets(text: str, remark: str) -> str:
    """Append a remark in brackets to a text. If the remark is empty, the text is returned unchanged."""
    return f"{text} ({remark})" if remark else text


def _quantity(value: object, unit: str, options: str) -> str:
    given = options.removeprefix("as ")
    if given != options:
        return format_in(_number(value), unit, given)
    words = options.split()
    digits = next((int(word) for word in words if word.isdecimal()), 3)
    return format_quantity(_number(value), unit, digits, "down" if "down" in words else "nearest")


def _percent(value: object, options: str) -> str:
    return f"{100 * _number(value):{options or '.3g'}} %"


def _joined(separator: str) -> Callable[[object, str], str]:
    def written(value: object, pattern: str) -> str:
        items = _items(value)
        return separator.join([pattern.replace("*", item) for item in items] if pattern else items)

    return written


def _count(value: object, noun: str) -> str:
    return f"{value} {noun}{'' if value == 1 else 's'}"


_QUANTITY_FORMATS: Mapping[str, Callable[[object, str], str]] = {
    "rad": lambda value, _: f"{_number(value):.3g} rad",
    "size": lambda value, unit: size_words(_number(value), unit),
    "limit": lambda value, unit: format_limit(_number(value), unit),
    "percent": _percent,
    "min": lambda value, _: f"{_number(value) / 60:g} min",
    "cycles": lambda value, _: cycles_words(_number(value)),
    "count": _count,
    "list": _joined(", "),
    "and": _joined(" and "),
    "or": _joined(" or "),
}


class _Filler(string.Formatter):
    """Formatter that fills the fields of a template. A field without a value raises `KeyError`."""

    def format_field(self, value: object, format_spec: str) -> str:
        """Write a quantity in the format that is specified by its field in the template."""
        name, _, options = format_spec.partition(" ")
        if name in _QUANTITY_FORMATS:
            return _QUANTITY_FORMATS[name](value, options)
        return _quantity(value, name, options) if name in _UNITS else format(value, format_spec)


_FILLER = _Filler()


def fill(template: str, quantities: Mapping[str, object]) -> str:
    """Fill each field of a template with the quantity of the same name.

    Raises
    ------
    KeyError
        No quantity is given for a field of the template.
    TypeError
        A quantity is not a number, or not a sequence, although its format requires it.
    """
    return _FILLER.vformat(template, (), quantities)


def fields(template: str) -> set[str]:
    """Names of all fields of a template, including fields inside the format specification of another field."""
    names = set[str]()
    for _, name, format_spec, _ in _FILLER.parse(template):
        if name is not None:
            names |= {name} | fields(format_spec or "")
    return names
