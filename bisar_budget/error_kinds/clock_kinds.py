"""Kinds of clock error: terms of the clock error, errors that remain after a setting, oscillators, and their link.

A clock error is a time error t̃₀ + t̃₁τ + t̃₂τ² + t̃₃τ³ over the slow time τ. (1)
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bisar_budget import units
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.error_kinds.kind import RELATIVE_LEVEL, ErrorSize, SourceKind

if TYPE_CHECKING:
    from bisar_budget.arrays import Floats, PerCase


def clock_range_error(terms: "Sequence[PerCase]", times: "Floats") -> "Floats":
    """Range error at slow times [s] due to a clock error with the coefficients t̃₀ … t̃₃ in `terms`. [m]"""
    seconds = np.zeros_like(times)
    for term in reversed(terms):
        seconds = seconds * times + term
    return SPEED_OF_LIGHT_MPS * seconds


@dataclass(frozen=True, kw_only=True, eq=False)
class ClockSize(ErrorSize):
    """A size of a clock error: a time error, a rate of change of the time error, or a change of higher order.

    Attributes
    ----------
    order : int
        Order of the change in time: 0 for a time error, 1 for an error of frequency.
    symbol : str
        Symbol of the size in formulas, for an error with which a clock was set. It is empty for a term of the clock
        error itself.
    formulas : tuple of str
        Formulas of the terms t̃₀, t̃₁ and t̃₂ of an error with which a clock was set, as functions of the time H
        since the setting.
    direct_title : str
        Title of the terms in an explanation if the receiver uses a direct path; empty if the title stays the same.
    """

    order: int
    symbol: str = ""
    formulas: tuple[str, ...] = ()
    direct_title: str = ""

    def terms(self, age: "PerCase" = 0.0) -> "tuple[PerCase, ...]":
        """Coefficients t̃₀ … t̃₃, about mid-aperture, of a clock error of one unit.

        `age` [s] is the time H from the setting of the clock to mid-aperture. At the slow time τ, an error of the
        setting has grown to (H + τ)ⁿ/n!, with n = `order`.
        """
        if not self.symbol:
            return tuple(float(power == self.order) for power in range(4))
        terms: list[PerCase] = [0.0] * 4
        for power in range(self.order + 1):
            older = self.order - power
            terms[power] = (age**older if older else 1.0) / (math.factorial(older) * math.factorial(power))
        return tuple(terms)


@dataclass(frozen=True, kw_only=True, eq=False)
class ClockKind(SourceKind):
    """A kind of error of a clock."""

    moves: str = "clock"

    def clock_size(self, axis: str = "") -> ClockSize:
        """Size of the term of a clock error that `axis` names; raises `TypeError` for random phases."""
        size = self.size(axis)
        if not isinstance(size, ClockSize):
            raise TypeError(f"{self.name}.{axis} is no term of a clock error")
        return size


_FIRST_ROW = "Table I row 1"


def _term(order: int, dimension: units.Dimension, unit_text: str = "") -> ClockSize:
    equation = f"{_FIRST_ROW}, step of Table II" if order == 2 else _FIRST_ROW
    return ClockSize(order=order, dimension=dimension, key="{axis}", equation=equation, unit_text=unit_text)


TIMING_KIND = ClockKind(
    name="timing",
    description="Clock error between the platforms: one term of its polynomial of time.",
    id_form="{kind}.{axis}",
    key_form="timing_error",
    owes_source=False,
    sizes={
        "constant": _term(0, units.TIME),
        "linear": _term(1, units.RATIO, "s/s"),
        "quadratic": _term(2, units.RATE),
        "cubic": _term(3, units.RATE_SQUARED),
    },
)
TIME_KIND = ClockKind(
    name="time",
    description="Time error between the clocks after setting, 1 sigma; direct_path: the difference of the channels' "
    "delays.",
    key_form="synchronization.time_error",
    owes_source=False,
    sizes={"": ClockSize(order=0, dimension=units.TIME, equation=_FIRST_ROW, symbol="x", formulas=("x",))},
)
FREQUENCY_KIND = ClockKind(
    name="frequency",
    description="Error of the fractional frequency after setting, 1 sigma.",
    key_form="synchronization.frequency_error",
    owes_source=False,
    sizes={
        "": ClockSize(
            order=1,
            dimension=units.RATIO,
            unit_text="s/s",
            equation=_FIRST_ROW,
            symbol="y",
            formulas=("y*H", "y"),
            direct_title="Terms of the time y·Δt(τ) by which a wrong clock measures the echo behind the direct path "
            "wrong",
        )
    },
)
OSCILLATOR_KIND = ClockKind(
    name="oscillator",
    description="Error of an oscillator: its phase noise, spurs, aging and sensitivity to acceleration.",
    key_form="platforms.{owner}.oscillator",
    drawn_as="phase",
    is_random=True,
    is_computed=True,
    spectrum_axis="",
    sizes={
        "": ErrorSize(dimension=units.POWER_RATIO, key="level", distribution=RELATIVE_LEVEL, equation="phase noise"),
        "aging": ClockSize(
            order=2,
            dimension=units.AGING,
            key="aging",
            equation=_FIRST_ROW,
            symbol="D",
            formulas=("D*H^2/2", "D*H", "D/2"),
        ),
        "acceleration": ErrorSize(
            dimension=units.ACCELERATION_SENSITIVITY,
            key="acceleration_sensitivity",
            equation="acceleration sensitivity",
        ),
        "spur": ErrorSize(
            dimension=units.TONE, key="spurs", distribution=RELATIVE_LEVEL, equation="Section V, sinusoidal"
        ),
    },
)
SYNCHRONIZATION_KIND = ClockKind(
    name="synchronization",
    description="Phase error of each exchange of pulses that synchronises the oscillators.",
    key_form="synchronization",
    drawn_as="phase",
    is_random=True,
    sizes={"": ErrorSize(dimension=units.ANGLE, key="error", equation="synchronisation")},
)
