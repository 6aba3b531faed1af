"""What solving a mission for a key found, as frozen data. Values in SI and radians; factors are plain numbers."""

from collections.abc import Mapping
from typing import NamedTuple

from bisar_budget.faults import SetValue
from bisar_budget.findings.images import Verdict
from bisar_budget.findings.requirement import Override


class State(NamedTuple):
    """How the mission stands at one value.

    `row` has the highest utilization of the rows that decide, `requirement` is what sets its allowable; None where
    nothing is judged. `reason` says why there is no mission at this value; empty where there is one. Resolutions are
    peak to first null on the ground. [m]
    """

    value: float
    complies: bool
    status: str
    row: str | None = None
    requirement: str | None = None
    utilization: float | None = None
    range_resolution_m: float | None = None
    cross_range_resolution_m: float | None = None
    reason: str = ""


class Crossing(NamedTuple):
    """A border of compliance: the last value that complies and the first beyond it that does not.

    `inside` and `outside` are 1e-6 of the value apart, `is_upper` is whether values below comply. `is_verified` is
    whether `check` of the mission with each of the two, as text, says so.
    """

    inside: State
    outside: State
    is_upper: bool
    is_verified: bool


class Imaged(NamedTuple):
    """What the image says of the row that binds at a solution.

    `at` is the solution as text; `verdict` is None where a row has no image. `reason` says why there is no verdict,
    or what it rests on; empty where there is nothing to say.
    """

    row: str
    at: str
    verdict: Verdict | None
    reason: str

    @property
    def is_optimistic(self) -> bool:
        """Whether the image, with autofocus or without, shows more than the limit promises."""
        return self.verdict is not None and "optimistic" in (self.verdict.verdict, self.verdict.verdict_autofocus)


class Solution(NamedTuple):
    """The crossings of one mission in a range, in rising order.

    `key` is what was solved for, `unit` that of its values, `is_scale` whether they are factors of all numbers
    below the key. `low` and `high` are the ends of the range, `is_circle` whether they are one direction. `nearest`
    is the nearest miss where nothing complies, or where everything does the value with the least left. `given` is
    the value of the file. `texts` has every value as the file would have it. `is_constant` is whether the number
    changes no utilization that decides. `skipped` counts the places of the range at which there is no mission.
    `imaged` is what images say at the best crossing, if any were formed. `overrides` is what from outside the file
    bears on it.
    """

    file: str
    name: str
    key: str
    unit: str
    is_scale: bool
    target: str
    row: str | None
    model: str
    low: float
    high: float
    is_circle: bool
    given: State | None
    crossings: tuple[Crossing, ...]
    nearest: State
    is_constant: bool
    skipped: int
    texts: Mapping[float, str]
    changes: tuple[SetValue, ...] = ()
    imaged: Imaged | None = None
    overrides: tuple[Override, ...] = ()

    @property
    def value(self) -> float | None:
        """Largest value at which compliance ends or begins; None if it does so nowhere."""
        return max((crossing.inside.value for crossing in self.crossings), default=None)

    @property
    def best(self) -> Crossing | None:
        """The crossing of that value."""
        return max(self.crossings, key=lambda crossing: crossing.inside.value, default=None)

    @property
    def is_monotonic(self) -> bool:
        """Whether compliance changes once at most."""
        return len(self.crossings) <= 1

    @property
    def status(self) -> str:
        """`crossing`, or `all` or `none` of the range complies."""
        if self.crossings:
            return "crossing"
        return "all" if self.nearest.complies else "none"
