"""Results of a sweep in the form in which they are plotted: arrays with one axis for each varied key."""

from collections.abc import Mapping
from datetime import date
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.arrays import NumbersOrWords
from bisar_budget.findings.status import RANK

Floats = NDArray[np.float64]


class Axis(NamedTuple):
    """One varied key of a plot.

    `values` (n,) are in `unit` and in ascending order; `scale` is the SI value of one `unit`. For a key whose values
    are names, `words` are these names, and `values` are their indices from 0. `own` is the value of the key in the
    mission itself; None if the mission has no value, or if its name is not in `words`.
    """

    key: str
    unit: str
    values: Floats
    is_log: bool = False
    words: tuple[str, ...] = ()
    scale: float = 1.0
    own: float | None = None

    @property
    def edges(self) -> Floats:
        """Edges of the cells around the values in a plot, (n + 1,).

        They are the midpoints between neighbouring values, or between their logarithms if `is_log`.
        """
        values = np.log(self.values) if self.is_log else self.values
        middle = (values[1:] + values[:-1]) / 2
        edges = np.concatenate(([2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]))
        return np.exp(edges) if self.is_log else edges


class Trade(NamedTuple):
    """Results of a sweep over one or two keys: arrays with one axis for each key, in the order of `axes`.

    `column` is the column that a heat map shows, and `heading` is its name and unit; both are empty if the map shows
    the status. `fixed` are the keys that have a single value.
    """

    axes: tuple[Axis, ...]
    values: Mapping[str, NumbersOrWords]
    fixed: tuple[str, ...] = ()
    column: str = ""
    heading: str = ""

    @property
    def statuses(self) -> list[str]:
        """Statuses that occur in the sweep, from worst to best."""
        return sorted(set(self.values["status"].ravel().tolist()), key=RANK.__getitem__)


class TradeStudy(NamedTuple):
    """A sweep that the report of a mission shows.

    `asked` are the values of the options `--vary`. If a single key varies, `rows` has the utilization, as a function
    of the key, of each row that is the worst for at least one value. `cases` is the number of all cases. Of these,
    `complying` cases meet every requirement, `waived` cases are waived by the waivers `waived_by`, `unevaluated`
    cases could not be evaluated completely or declare no error, and `missing` cases give no usable mission. `model`
    is the model that an option put in place of the mission's own model. `day` is the date on which waivers were
    judged.
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
