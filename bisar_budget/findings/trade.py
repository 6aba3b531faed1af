"""Contents of a plot of a sweep, as arrays: one axis for each key that varies."""

from collections.abc import Mapping
from datetime import date
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.findings.status import RANK

Floats = NDArray[np.float64]


class Axis(NamedTuple):
    """A key that varies.

    `values` (n,) rise, in `unit`, of which one is `scale` in SI; of a key with words they are the places of `words`,
    from 0. `own` is the value of the mission itself, None where it has none, or none of the words.
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
        """Name and unit."""
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

    `column` is what a heat map shows, `heading` its name and unit; empty where the status is shown. `fixed` are the
    keys with a single value.
    """

    axes: tuple[Axis, ...]
    values: Mapping[str, NDArray[Any]]
    fixed: tuple[str, ...] = ()
    column: str = ""
    heading: str = ""

    @property
    def statuses(self) -> list[str]:
        """Statuses that occur, worst first."""
        return sorted(set(self.values["status"].ravel().tolist()), key=RANK.__getitem__)


class TradeStudy(NamedTuple):
    """A sweep that a report of the mission shows.

    `asked` is what stood behind each option; `rows` are the utilizations of the rows that are the worst anywhere,
    over the one key that varies. Of `cases` `complying` meet every requirement, `waived` are waived, by `waived_by`;
    of `unevaluated` something could not be evaluated or nothing is declared, and `missing` are no mission. `model`
    is the one that an option put in place of the mission's own, `day` that on which waivers were judged.
    """

    asked: tuple[str, ...]
    trade: Trade
    rows: Mapping[str, NDArray[Any]]
    cases: int
    complying: int
    waived: int
    waived_by: tuple[str, ...]
    unevaluated: int
    missing: int
    day: date
    model: str | None = None
