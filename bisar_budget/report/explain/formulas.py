"""The formulas behind a row, by what a row asks for, and the same with the numbers put in.

Their texts are the derivation's, from the generated catalogue; SymPy itself stays out of a check.
"""

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple
from unicodedata import combining

from bisar_budget.catalogue import TEXTS

AXES = "xyz"
_LETTERS = {"position": "p\u0303", "velocity": "ṽ", "acceleration": "ã"}
EDGE_PHASE = TEXTS["edge phase"]
CLOCK_PHASE = TEXTS["Table II t̃_2 0"]
VIBRATION = {"pslr": TEXTS["Vibration A 1"], "islr": TEXTS["Vibration σ 1"]}
# From first principles; of a sinusoid φ is the phase of the echoes that both platforms may make.
FULL_VIBRATION = {"pslr": TEXTS["echoes"], "islr": TEXTS["noise"]}
AUTOFOCUS_GAIN = TEXTS["autofocus gain"]
SMEAR = (TEXTS["smear east"], TEXTS["smear north"])
LOOK_AZIMUTH = TEXTS["look azimuth"]
DETERMINANT = TEXTS["determinant"]


def motion_symbol(kind: str, axis: str, platform: str) -> str:
    """Symbol of one motion error, such as `ã_xt`."""
    return f"{_LETTERS[kind]}_{axis}{platform[0]}"


def motion_coefficients(kind: str, axis: str, platform: str) -> dict[int, str]:
    """Cells of Table I for one motion error, by order in slow time."""
    names = {order: f"Table I {motion_symbol(kind, axis, platform)} {order}" for order in range(4)}
    return {order: TEXTS[name] for order, name in names.items() if name in TEXTS}


def motion_phase(kind: str, axis: str, platform: str) -> str | None:
    """Cell of Table II; None for a position error, which has none."""
    return TEXTS.get(f"Table II {motion_symbol(kind, axis, platform)} 0")


def clock_coefficient(order: int) -> str:
    """Cell of the first row of Table I."""
    return TEXTS[f"Table I t̃ {order}"]


def inertial_phases(symbol: str) -> tuple[str, ...]:
    """Quadratic phase, cubic phase and what is left of one unit of a figure of an inertial sensor; empty: none."""
    return tuple(TEXTS.get(f"Inertial sensors {symbol} {part}", "") for part in range(3))


def amplitude_share(platform: str) -> str:
    """Part of a platform in an amplitude that both make."""
    return TEXTS[f"amplitude share {platform[0]}"]


class WorkedEquation(NamedTuple):
    """A formula as text, and what it gives for values of its symbols; an empty formula: the result is known."""

    symbol: str
    formula: str
    values: Mapping[str, float]
    result: float
    unit: str

    @property
    def lines(self) -> tuple[str, ...]:
        """The formula, and under it the same with numbers; their equals signs stand above each other."""
        if not self.formula:
            return (f"{self.symbol} = {with_unit(self.result, self.unit)}",)
        margin = " " * sum(not combining(letter) for letter in self.symbol)
        numbers = filled(self.formula, self.values)
        return f"{self.symbol} = {self.formula}", f"{margin} = {numbers} = {with_unit(self.result, self.unit)}"


class Sum(str):
    """Text that is a sum with its numbers, and nothing of the user's own."""

    __slots__ = ()


class Step(NamedTuple):
    """One step of an explanation: what it is or where it stands, and the equations or texts under it."""

    title: str
    parts: tuple[WorkedEquation | str, ...] = ()

    @property
    def lines(self) -> Iterator[str]:
        """The title, what belongs to it indented."""
        yield self.title
        for part in self.parts:
            yield from (f"    {line}" for line in (part.lines if isinstance(part, WorkedEquation) else (part,)))


def step(title: str, *parts: WorkedEquation | str) -> Iterator[Step]:
    """One step of an explanation, to be yielded from."""
    yield Step(title, parts)


def equation(
    symbol: str, formula: str, values: Mapping[str, float], result: float, unit: str
) -> tuple[WorkedEquation]:
    """Make the one part of a step."""
    return (WorkedEquation(symbol, formula, values, result, unit),)


def filled(formula: str, values: Mapping[str, float]) -> str:
    """Put numbers for the symbols, six digits each; negative ones in brackets."""
    names = sorted(values, key=len, reverse=True)
    # A symbol ends where no letter, digit or accent follows: v_x is not the start of v_xt.
    pattern = re.compile(r"(?<![\w\u0300-\u036f])(?:" + "|".join(map(re.escape, names)) + r")(?![\w\u0300-\u036f])")
    return pattern.sub(lambda match: number(values[match[0]]), formula)


def number(value: float) -> str:
    """Six digits, so that a reader can repeat the sum."""
    text = six_digits(value)
    return f"({text})" if text.startswith("-") else text


def six_digits(value: float) -> str:
    """Six digits; a zero has no sign."""
    return f"{value + 0.0:.6g}"


def with_unit(value: float, unit: str) -> str:
    """Six digits and the unit."""
    return f"{six_digits(value)} {unit.replace('^2', '²')}".rstrip()
