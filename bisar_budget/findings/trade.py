"""Contents of a plot of a sweep, as arrays: one axis for each key that varies."""

from collections.abc import Mapping
from datetime import date
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.arrays import NumbersOrWords
from bisar_budget.findings.status import RANK

Floats = NDArray[np.float64]


class Axis(NamedTuple):
    """A key that varies.

    `values` (n,) rise, in `unit`; one `unit` is `scale` in SI. For a key with words, `values` are the indices of
    `words`, from 0. `own` is the mission's own value, None without a value or if the value is not in `words`.
    """

    key: str
    unit: str
    values: Floats
    is_log: bool = False
    words: tuple[str, ...] = ()
    scale: float = 1.0
    own: float | None = None

    @property
    def label(self) -> str:
        """Name and unit of the key."""
        return f"{self.key} [{self.unit}]" if self.unit else self.key

    @property
    def edges(self) -> Floats:
        """Ends of the cells around the values, half way to the next: (n + 1,)."""
        values = np.log(self.values) if self.is_log else self.values
        middle = (values[1:] + values[:-1]) / 2
        edges = np.concatenate(([2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]))
        return np.exp(edges) if self.is_log else edges


class Trade(NamedTuple):
    """A sweep over one or two keys: arrays with one axis for each, in the order of `axes`.

    `column` names the column that a heat map shows, `heading` is its name and unit; both are empty if the map shows
    the status. `fixed` are the keys with a single value.
    """

    axes: tuple[Axis, ...]
    values: Mapping[str, NumbersOrWords]
    fixed: tuple[str, ...] = ()
    column: str = ""
    heading: str = ""

    @property
    def statuses(self) -> list[str]:
        """Statuses that occur, worst first."""
        return sorted(set(self.values["status"].ravel().tolist()), key=RANK.__getitem__)


class TradeStudy(NamedTuple):
    """A sweep that a report of the mission shows.

    `asked` is the text after each option. `rows` are the utilizations, over the single key that varies, of the rows
    that are the worst at any value. The sweep has `cases`: `complying` of them meet every requirement, `waived` are
    waived, by `waived_by`, `unevaluated` have no complete evaluation or no declared error, and `missing` give no
    usable mission. `model` is the model that an option put in place of the mission's own model, `day` the date on
    which waivers were judged.
    """

    asked: tuple[str, ...]
    trade: Trade
    rows: Mapping[str, NumbersOrWords]
    cases: int
    complying: int
    waived: int
    waived_by: tuple[str, ...]
    unevaluated: int
    missing: int
    day: date
    model: str | None = None
