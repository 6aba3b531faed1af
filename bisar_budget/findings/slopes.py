"""Findings of `sensitivity`: the effects of the numbers of a mission on its utilization."""

import math
from typing import NamedTuple

from bisar_budget.faults import SetValue
from bisar_budget.findings.requirement import Override

MIN_SHOWN_CHANGE_FRACTION = 1e-4  # of a utilization; a smaller change is not shown
COMPARED_CHANGE_FRACTION = 0.01  # change of every number for which effects are compared
_MAX_LOG_RATIO = math.log(1e6)  # a number that would have to change by a larger ratio has no practical effect


class Skipped(NamedTuple):
    """A number for which no slope is computed: its key, its text in the file, and the reason."""

    key: str
    text: str
    reason: str


class Slope(NamedTuple):
    """Slope of the utilization with respect to one number of the file.

    Attributes
    ----------
    key, text : str
        Key of the number, and its value as written in the file.
    value, unit : float, str
        Value of the number, and the unit of this value. For a covariance the value is 1, the factor by which its
        sigmas are multiplied.
    per, per_text : float, str
        Increase of the number that causes `change`. `per` is in SI and has the sign of the value; `per_text` is the
        same increase as text, such as `1 dB`.
    step : float
        Step by which the number is changed, in SI. A central difference spans two steps.
    difference : str
        Kind of difference: `central`, or `forward` or `backward` over two steps if the mission is invalid on one
        side.
    change, row_change : float
        Change of the worst utilization, and change of the utilization of the requested row. `row_change` is None if
        no row is requested.
    row_below, row_above : str
        Rows with the worst utilization at the two ends of the difference: where the number is smaller, and where it
        is larger. For a number that is changed by a fraction of itself, smaller and larger refer to its magnitude.
    is_mixed : bool
        Whether the row that is worst at the value in the file is no longer the worst row at an end of the difference.
        The change then mixes the slopes of two rows.
    part : str
        Part of the catalogue from which the number is taken; empty if the file states the number itself.
    measure : float
        The increase `per` as a dimensionless ratio, so that numbers of all kinds can be compared. Usually the
        reference is the value of the number itself. For a direction the reference is one radian, for a level in
        decibels the corresponding power, and for a latitude or longitude the smaller slant range.
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
        """Value as written in the file, followed by the catalogue part from which it is taken, if any."""
        return f"{self.text} ({self.part})" if self.part else self.text

    @property
    def effect(self) -> float:
        """Change of the utilization of the requested row, or of the worst utilization if no row is requested."""
        return self.change if self.row_change is None else self.row_change

    @property
    def even_effect(self) -> float:
        """Effect of an increase by 1 %, to compare numbers of different kinds.

        The increase is 1 % in terms of the dimensionless ratio `measure`.
        """
        return self.effect * COMPARED_CHANGE_FRACTION / self.measure

    @property
    def is_proportional(self) -> bool:
        """Whether the increase `per` is 1 % of the value of the number."""
        return self.per_text == "1 %"


class Relaxed(NamedTuple):
    """Effect of doubling one error of a mission on the other errors, after the budget shares are balanced again.

    `shares_before` and `shares_after` are the budget shares of transmitter and receiver before and after the
    doubling. `transmitter` and `receiver` each contain the worst row of the platform after the doubling, and the
    worst utilization of the platform before and after the doubling. The rows of the doubled error, and rows that are
    not judged, are left out. The field of a platform is None if no row of the platform remains.
    """

    key: str
    shares_before: tuple[float, float]
    shares_after: tuple[float, float]
    transmitter: tuple[str, float, float] | None
    receiver: tuple[str, float, float] | None

    @property
    def moves_shares(self) -> bool:
        """Whether doubling the error changes the shares."""
        return abs(self.shares_after[0] - self.shares_before[0]) > MIN_SHOWN_CHANGE_FRACTION


class Sensitivity(NamedTuple):
    """Effects of the numbers of one mission on its utilization, with the largest effect first.

    `worst_row` has the worst utilization of all judged rows that can fail; `requirement` sets its allowable. `row` is
    the requested row, or None. If a row is requested, the numbers are sorted by their effects on it. `unchanging` are
    keys of numbers without any effect. `relaxed` is empty if shares are not balanced. `overrides` are influences on
    the result from outside the mission file.
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
        """Utilization of the requested row, or the worst utilization if no row is requested."""
        return self.utilization if self.row_utilization is None else self.row_utilization

    def to_limit(self, slope: Slope) -> float | None:
        """Change of one number, with its sign and in the unit of the number, at which the utilization would be 1.

        The utilization is extrapolated as a power of the number, or as an exponential function of a level in decibels
        or of an angle. This is exact for numbers that follow such a law, for example the aperture time or an error.
        Returns None if the number would change by more than a factor of a million, or an angle by more than half a
        turn.
        """
        if not slope.effect or self.asked <= 0:
            return None
        change = -math.log(self.asked) * self.asked / slope.effect  # in `per`s, of the logarithm of the utilization
        if slope.is_proportional:
            power = COMPARED_CHANGE_FRACTION * change
            return slope.value * math.expm1(power) if abs(power) <= _MAX_LOG_RATIO else None
        is_near = (
            abs(change * slope.per) <= math.pi
            if slope.unit == "rad"
            else abs(change * slope.measure) <= _MAX_LOG_RATIO
        )
        return change * slope.per if is_near else None

    @property
    def shown(self) -> tuple[Slope, ...]:
        """Numbers with an effect of at least `MIN_SHOWN_CHANGE_FRACTION` of the utilization."""
        return tuple(
            slope for slope in self.slopes if abs(slope.even_effect) >= MIN_SHOWN_CHANGE_FRACTION * self.asked
        )
