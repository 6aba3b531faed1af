"""What changing each number of a mission does to its utilizations, as frozen data. Values in SI and radians."""

import math
from typing import NamedTuple

from bisar_budget.design.stated import Skipped
from bisar_budget.faults import SetValue
from bisar_budget.findings.requirement import Override

LITTLE = 1e-4  # of a utilization: less of a change is not shown
EVEN = 0.01  # part of every number for which effects are compared
_FURTHEST = math.log(1e6)  # times: a number that would have to change by more decides nothing


class Slope(NamedTuple):
    """What one number of the file does.

    `text` is its value as the file has it, `value` the same in `unit`; of a covariance the factor 1 on its sigmas.
    `per_text` says how much more of it `change` is for, `per` the same in SI, signed like the value, and `measure`
    the same by one measure for all numbers: a part of the number, of a radian, of a power, of a range. `change` is
    that of the worst utilization, `row_change` that of the row that was asked for; None where there is none. Both are
    differences over values `step` to either side, or, where there is no mission on one side, over two steps on the
    other (`difference`: central, forward, backward). `row_below` and `row_above` have the worst utilization at the
    smaller and the larger end of the difference, in magnitude; `is_mixed` is whether the row that has it at the value
    itself uses less at an end: the change is then made of the slopes of two rows. `part` is the part of the catalogue
    that the number is taken from; empty if the file states it.
    """

    key: str
    text: str
    value: float
    unit: str
    per: float
    per_text: str
    step: float
    difference: str
    change: float
    row_change: float | None
    row_below: str
    row_above: str
    is_mixed: bool
    part: str = ""
    measure: float = 0.01

    @property
    def given(self) -> str:
        """Its value as the file has it, and the part that it is from."""
        return f"{self.text} ({self.part})" if self.part else self.text

    @property
    def effect(self) -> float:
        """Change of what was asked for: the row, else the worst utilization."""
        return self.change if self.row_change is None else self.row_change

    @property
    def even_effect(self) -> float:
        """Effect of the same small part of every number: of itself, of a radian, of a power, of a range."""
        return self.effect * EVEN / self.measure

    @property
    def is_proportional(self) -> bool:
        """Whether it changes by parts of itself."""
        return self.per_text == "1 %"


class Relaxed(NamedTuple):
    """What doubling one declared error costs the others where shares are balanced.

    `shares_before` and `shares_after` are those of transmitter and receiver. `transmitter` and `receiver` have, of
    each, the worst utilization of the judged rows that are not of this error, before and after, and the row that has
    it after; None where there is none.
    """

    key: str
    shares_before: tuple[float, float]
    shares_after: tuple[float, float]
    transmitter: tuple[str, float, float] | None
    receiver: tuple[str, float, float] | None

    @property
    def moves_shares(self) -> bool:
        """Whether it takes from anybody."""
        return abs(self.shares_after[0] - self.shares_before[0]) > LITTLE


class Sensitivity(NamedTuple):
    """Numbers of one mission by what they do, the largest effect first.

    `worst_row` has the worst utilization of all rows that are judged and can fail, `requirement` sets its allowable.
    `row` is the one that was asked for, whose effects order the numbers; None without one. `unchanging` are keys of
    numbers that change neither. `relaxed` is empty where shares are not balanced. `overrides` is what
    from outside the file bears on it.
    """

    file: str
    name: str
    model: str
    status: str
    worst_row: str
    requirement: str
    utilization: float
    row: str | None
    row_utilization: float | None
    slopes: tuple[Slope, ...]
    unchanging: tuple[str, ...]
    skipped: tuple[Skipped, ...]
    is_balanced: bool = False
    relaxed: tuple[Relaxed, ...] = ()
    changes: tuple[SetValue, ...] = ()
    overrides: tuple[Override, ...] = ()

    @property
    def asked(self) -> float:
        """Utilization of what was asked for: the row, else the worst."""
        return self.utilization if self.row_utilization is None else self.row_utilization

    def to_limit(self, slope: Slope) -> float | None:
        """Change of a number, by itself, that uses up the margin: the utilization is 1 there; signed, in its unit.

        The utilization goes on as it goes here: with a power of the number, or exponentially with a level or an
        angle. Exact where it does, as of the aperture time or of an error; None beyond a millionfold or half a turn.
        """
        if not slope.effect or self.asked <= 0:
            return None
        change = -math.log(self.asked) * self.asked / slope.effect  # in `per`s, of the logarithm of the utilization
        if slope.is_proportional:
            power = EVEN * change
            return slope.value * math.expm1(power) if abs(power) <= _FURTHEST else None
        is_near = (
            abs(change * slope.per) <= math.pi if slope.unit == "rad" else abs(change * slope.measure) <= _FURTHEST
        )
        return change * slope.per if is_near else None

    @property
    def shown(self) -> tuple[Slope, ...]:
        """Numbers that a reader wants to see: they change it by a ten-thousandth of itself, or more."""
        return tuple(slope for slope in self.slopes if abs(slope.even_effect) >= LITTLE * self.asked)
