"""The description that a file of cases carries: mission, hash, tool, and what each column holds, in which unit."""

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from bisar_budget.design.cases import Cases, in_unit
from bisar_budget.design.quantities import Number
from bisar_budget.design.table import Column, Part, Swept, Values
from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.requirement import Override
from bisar_budget.mission.model import Mission

FORMAT = "bisar-budget/sweep/1"


class Described:
    """A sweep as a table: keys that vary stand in the unit that they were asked for in, all else in SI."""

    def __init__(
        self, swept: Swept, cases: Cases, mission: Mission, version: str, overrides: Sequence[Override] = ()
    ) -> None:
        self.swept, self.cases = swept, cases
        self.numbers = {one.key: one for one in cases.varied if isinstance(one, Number)}
        changed = changes_words(mission.changes)
        self.facts = {
            "format": FORMAT,
            "mission": printable(swept.mission_name),
            "mission_sha256": swept.mission_sha256,
            **({"set": changed} if changed else {}),
            **({"overrides": _said(overrides)} if overrides else {}),
            "model": "varies" if "allocation.model" in swept.varied else mission.gating_model,
            "source": f"bisar-budget {version}",
        }

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Columns in their order."""
        return tuple(
            column._replace(unit=self.numbers[column.name].unit) if column.name in self.numbers else column
            for column in self.swept.columns
        )

    def values(self, part: Part) -> Mapping[str, Values]:
        """Values of a part by the name of their column."""
        return {name: self.said(name, values) for name, values in part.values.items()}

    def said(self, name: str, values: Values) -> Values:
        """Values of a column, of one that varies in its unit."""
        if name not in self.numbers:
            return values
        return in_unit(self.numbers[name], np.asarray(values, float))


def _said(overrides: Sequence[Override]) -> str:
    """The overrides from outside the file that bear on statuses, in a line."""
    return "; ".join(printable(f"{one.name} {one.value} ({one.origin})") for one in overrides)
