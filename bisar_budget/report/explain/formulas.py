"""The formulas behind a row as text, and the same with the numbers put in.

Each text is, letter for letter, the cell that `bisar-budget derive` prints for it (a test compares them);
SymPy itself stays out of a check.
"""

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple
from unicodedata import combining

AXES = "xyz"
# Table I: coefficients of the range error; {a} is the axis, {s} the platform's subscript.
_COEFFICIENTS = {
    "position": {0: "-p\u0303_{a}{s}*{a}_{s}/R_{s}", 1: "-p\u0303_{a}{s}*v_{a}{s}/R_{s}"},
    "velocity": {1: "-ṽ_{a}{s}*{a}_{s}/R_{s}", 2: "-v_{a}{s}*ṽ_{a}{s}/R_{s}"},
    "acceleration": {2: "-ã_{a}{s}*{a}_{s}/(2*R_{s})", 3: "-ã_{a}{s}*v_{a}{s}/(2*R_{s})"},
}
# Table II: quadratic phase error at the aperture edge.
_PHASES = {
    "velocity": "π*T^2*|v_{a}{s}*ṽ_{a}{s}|/(2*R_{s}*λ)",
    "acceleration": "π*T^2*|ã_{a}{s}*{a}_{s}|/(4*R_{s}*λ)",
}
_LETTERS = {"position": "p\u0303", "velocity": "ṽ", "acceleration": "ã"}
EDGE_PHASE = "π*T^2*β̃_2/(2*λ)"
CLOCK_PHASE = "π*T^2*f_0*|t̃_2|/2"
VIBRATION = {"pslr": "sqrt(PSLR)*λ*sqrt(s)/(2*π)", "islr": "sqrt(ISLR)*λ*sqrt(s)/(2*π)"}
# From first principles; of a sinusoid φ is the phase of the echoes that both platforms may make.
FULL_VIBRATION = {"pslr": "a*λ*φ/(2*π)", "islr": "λ*sqrt(s)*sqrt(log(ISLR + 1))/(2*π)"}
AMPLITUDE_SHARE = "sqrt(s_k)/(sqrt(s_t) + sqrt(s_r))"
# Inertial sensors: quadratic phase, cubic phase and what is left, of one unit.
INERTIAL = {
    "accelerometer_bias": ("π*T^2*b*u/(4*λ)", "", ""),
    "attitude": ("π*T^2*g*ψ*u_h/(4*λ)", "", ""),
    "gyro_bias": ("", "π*T^3*ε*g*u_h/(24*λ)", ""),
    "velocity_random_walk": (
        "sqrt(70)*π*N*T^(3/2)*u/(28*λ)",
        "sqrt(770)*π*N*T^(3/2)*u/(132*λ)",
        "sqrt(770)*π*N*T^(3/2)*u/(1155*λ)",
    ),
    "angle_random_walk": (
        "sqrt(164010)*π*N_g*T^(5/2)*g*u_h/(7392*λ)",
        "5*sqrt(3003)*π*N_g*T^(5/2)*g*u_h/(5148*λ)",
        "sqrt(15015)*π*N_g*T^(5/2)*g*u_h/(45045*λ)",
    ),
}
AUTOFOCUS_GAIN = "π*N_pull/q"
SMEAR = ("sin(φ̄_r)*cos(θ̄_r) + sin(φ̄_t)*cos(θ̄_t)", "-cos(φ̄_r)*cos(θ̄_r) - cos(φ̄_t)*cos(θ̄_t)")
LOOK_AZIMUTH = "atan2(sin(φ̄_r)*cos(θ̄_r) + sin(φ̄_t)*cos(θ̄_t), cos(φ̄_r)*cos(θ̄_r) + cos(φ̄_t)*cos(θ̄_t))"
DETERMINANT = "-(-v_xt/R_t - v_xr/R_r)*(-y_t/R_t - y_r/R_r) + (-v_yt/R_t - v_yr/R_r)*(-x_t/R_t - x_r/R_r)"


def motion_symbol(kind: str, axis: str, platform: str) -> str:
    """Symbol of one motion error, such as `ã_xt`."""
    return f"{_LETTERS[kind]}_{axis}{platform[0]}"


def motion_coefficients(kind: str, axis: str, platform: str) -> dict[int, str]:
    """Cells of Table I for one motion error, by order in slow time."""
    return {order: text.format(a=axis, s=platform[0]) for order, text in _COEFFICIENTS[kind].items()}


def motion_phase(kind: str, axis: str, platform: str) -> str | None:
    """Cell of Table II; None for a position error, which has none."""
    text = _PHASES.get(kind)
    return None if text is None else text.format(a=axis, s=platform[0])


def clock_coefficient(order: int) -> str:
    """Cell of the first row of Table I."""
    return f"c*t̃_{order}"


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
