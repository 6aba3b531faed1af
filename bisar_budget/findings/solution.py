"""Findings of `solve`: borders of compliance for a number, and the verdicts with parts of the catalogue."""

from collections.abc import Mapping
from typing import NamedTuple

from bisar_budget.faults import SetValue
from bisar_budget.findings.images import Verdict
from bisar_budget.findings.requirement import Override


class State(NamedTuple):
    """Verdict of the mission at one value of the number.

    `row` has the highest utilization of the rows that decide; `requirement` sets its allowable. Both are None if no
    row is judged. `reason` explains why the mission is invalid at this value; it is empty if the mission is valid.
    `waived_by` are the ids of the waivers of a waived state, which does not comply. `doubts` are the codes of the
    warnings that question the mission. Resolutions [m] are from peak to first null on the ground.
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
    waived_by: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


class Crossing(NamedTuple):
    """A border of compliance: the last value that complies, and the next value, which does not comply.

    `inside` is the state that complies, and `outside` is the state that does not. The relative difference of the two
    values is at most 1e-6. `is_upper` tells whether the values below the border comply. `is_verified` tells whether
    the border is confirmed by checks of the mission with both values as they would be written in the mission file.
    """

    inside: State
    outside: State
    is_upper: bool
    is_verified: bool


class Imaged(NamedTuple):
    """Comparison of a simulated image with the limit of the binding row at a solution.

    `at` is the solution as text. `verdict` is None if no image can show the limit of the row. `reason` tells why
    there is no verdict, or what the verdict is based on; it may be empty.
    """

    row: str
    at: str
    verdict: Verdict | None
    reason: str

    @property
    def is_optimistic(self) -> bool:
        """Whether the limit is optimistic: the image at the limit shows a larger error than the limit allows.

        Images with and without autofocus are considered.
        """
        return self.verdict is not None and "optimistic" in (self.verdict.verdict, self.verdict.verdict_autofocus)


class Solution(NamedTuple):
    """Result of `solve`: the crossings of one mission in a range, in ascending order.

    Attributes
    ----------
    key, unit : str
        Key of the number, and unit of its values.
    is_scale : bool
        Whether the values are factors that multiply all errors below the key.
    low, high : float
        Ends of the range.
    is_circle : bool
        Whether the two ends of the range are the same direction, so that the range is a full circle.
    given : State, optional
        State at the value in the mission file.
    nearest : State
        The state with the smallest excess if no value complies; the state with the smallest margin if all comply.
    is_constant : bool
        Whether the number has no effect on the utilization that decides the verdict.
    skipped, waived : int
        Number of samples at which the mission is invalid, and number of samples at which it is waived.
    waived_by : tuple of str
        Ids of the waivers that apply to the waived samples.
    texts : mapping of float to str
        Every value of the solution, as it would be written in the mission file.
    imaged : Imaged, optional
        Verdict from simulated images at the best crossing, if images were formed.
    overrides : tuple of Override
        Influences on the verdict that are not in the mission file, such as command-line options.
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
    waived: int = 0
    waived_by: tuple[str, ...] = ()

    @property
    def value(self) -> float | None:
        """Largest value at which compliance ends or begins; None if there is no such value."""
        return max((crossing.inside.value for crossing in self.crossings), default=None)

    @property
    def best(self) -> Crossing | None:
        """The crossing with the largest value; None if there are no crossings."""
        return max(self.crossings, key=lambda crossing: crossing.inside.value, default=None)

    @property
    def is_monotonic(self) -> bool:
        """Whether compliance changes at most once in the searched range."""
        return len(self.crossings) <= 1

    @property
    def status(self) -> str:
        """Compliance of the values in the range: `crossing`, `all`, `none` or `waived`.

        `crossing` means that compliance changes in the range, and `all` that every value complies. If no value
        complies, the result is `waived` if some values are waived, and `none` otherwise.
        """
        if self.crossings:
            return "crossing"
        return "all" if self.nearest.complies else "waived" if self.waived else "none"


class Standing(NamedTuple):
    """Verdict on a mission: whether it complies, its status, and the binding row.

    `requirement` is the requirement that sets the allowable of the binding row `row`, and `waived_by` are the ids of
    the waivers that apply.
    """

    complies: bool
    status: str
    row: str | None = None
    requirement: str | None = None
    utilization: float | None = None
    waived_by: tuple[str, ...] = ()


class PartState(NamedTuple):
    """Verdict on the mission with one part of the catalogue.

    Attributes
    ----------
    id, name, kind, file : str
        Name in the catalogue, full name, kind, and file of the part.
    is_given : bool
        Whether the mission file names this part.
    figures : tuple of str
        Figures that the mission takes from the part. A figure that the mission file states itself is not taken.
    standing : Standing
        Verdict on the mission.
    own_row, own_utilization : str, float, optional
        Row with the highest utilization among the rows that depend only on `figures`, and its utilization.
    reason : str
        Reason why the mission does not comply, if no row is the cause; otherwise empty.
    silent_on : tuple of str
        Figures that other parts of the same kind state but this part does not. They remain undeclared.
    """

    id: str
    name: str
    kind: str
    file: str
    is_given: bool
    figures: tuple[str, ...]
    standing: Standing
    own_row: str | None = None
    own_utilization: float | None = None
    reason: str = ""
    silent_on: tuple[str, ...] = ()

    @property
    def complies(self) -> bool:
        """Whether the mission meets its requirements if it has this part."""
        return self.standing.complies


class Comparison(NamedTuple):
    """Comparison of parts of the catalogue for one key of one mission.

    `parts` lists the complying parts in ascending order of margin, followed by all other parts in ascending order of
    excess. `kinds` are the compared kinds of parts, and `kept` are the parts of other kinds, which remain in the
    mission. `overridden` are figures of parts that the mission file overrides. `imaged` is the verdict from simulated
    images of the mission with the first complying part, if images were formed. `overrides` are settings outside the
    mission file that influence the verdict.
    """

    file: str
    name: str
    key: str
    target: str
    row: str | None
    model: str
    kinds: tuple[str, ...]
    kept: tuple[str, ...]
    overridden: tuple[str, ...]
    parts: tuple[PartState, ...]
    changes: tuple[SetValue, ...] = ()
    imaged: Imaged | None = None
    overrides: tuple[Override, ...] = ()

    @property
    def complying(self) -> tuple[PartState, ...]:
        """Parts with which the mission complies."""
        return tuple(state for state in self.parts if state.complies)

    @property
    def status(self) -> str:
        """Which parts comply: `all`, `some` or `none`; `waived` if no part complies but some parts are waived."""
        count = len(self.complying)
        if count:
            return "all" if count == len(self.parts) else "some"
        return "waived" if any(state.standing.status == "waived" for state in self.parts) else "none"
