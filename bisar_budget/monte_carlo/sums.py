"""Effects of the errors of a block of draws together: sums, or exact ranges of the paths that they make."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.effect import CLOCK_UNITS, PLATFORMS, ErrorSource
from bisar_budget.monte_carlo.variables import Floats, HeldSum, Variable
from bisar_budget.ranges.exact_ranges import STILL, ExactRanges, Found, followed

_ORDER = {"m": 0, "m/s": 1, "m/s^2": 2}
_CLOCK = {unit: power for power, unit in enumerate(CLOCK_UNITS.values())}


class Sums:
    """Effects of one block of draws, added up: the quadratic phase by owner, all else for the mission.

    By owner, if kept: `motion` is position, velocity and acceleration error of both platforms, (2, 3, 3, draws),
    `clock` its coefficients (4, draws), `phase_alone` what is stated as a phase, quadratic and cubic (2, draws).

    Parameters
    ----------
    exact : ExactRanges
        Of the mission.
    variables, judged : sequences of Variable, HeldSum
        What will be added, and what will be asked for.
    size : int
        Draws.
    adds, keeps_motion : bool
        Whether `square`, and whether `exact_square` will be asked for.
    """

    def __init__(
        self,
        exact: ExactRanges,
        variables: Sequence[Variable],
        judged: Sequence[HeldSum],
        size: int,
        *,
        adds: bool,
        keeps_motion: bool,
    ) -> None:
        self.exact, self.size, self.keeps_motion = exact, size, keeps_motion
        wanted = {column for one in judged for column in one.columns}
        self.phases = {variable.owner: np.zeros(size) for variable in variables} if adds else {}
        self.totals = {column: np.zeros(size) for column in sorted(wanted - {0})} if adds else {}
        self.motion: dict[str, Floats] = {}
        self.clock: dict[str, Floats] = {}
        self.phase_alone: dict[str, Floats] = {}
        self._exact: dict[tuple[str, ...], Found] = {}
        self._scaled = np.empty(size)
        self._square = np.empty(size)

    def clear(self) -> None:
        """Begin another block."""
        every: list[Mapping[Any, Floats]] = [self.phases, self.totals, self.motion, self.clock, self.phase_alone]
        for one in (one for kept in every for one in kept.values()):
            one.fill(0.0)
        self._exact.clear()

    def add(self, variable: Variable, drawn: Floats) -> None:
        """Add one variable's draws, (draws,)."""
        if self.phases:
            for target, column in ((self.phases[variable.owner], 0), *((t, c) for c, t in self.totals.items())):
                if variable.effects[column]:
                    np.multiply(drawn, variable.effects[column], out=self._scaled)
                    target += self._scaled
        if self.keeps_motion:
            for source, size in variable.parts:
                self._add_motion(variable.owner, source, size, drawn)
            if not variable.parts:
                self._add_phases(variable.owner, variable.effects[:2], drawn)

    def _add_motion(self, owner: str, source: ErrorSource, size: float, drawn: Floats) -> None:
        if source.is_position:
            motion = self._kept(self.motion, owner, (2, 3, 3))
            for platform, name in enumerate(PLATFORMS):
                if source.moves(name):
                    for axis, component in enumerate(source.direction):
                        if component:
                            motion[platform, _ORDER[source.unit], axis] += size * component * drawn
        elif source.owner == "clock":
            self._kept(self.clock, owner, (4,))[_CLOCK[source.unit]] += size * drawn
        else:
            self._add_phases(owner, (size, 0.0), drawn)

    def _add_phases(self, owner: str, phases: tuple[float, ...], drawn: Floats) -> None:
        self._kept(self.phase_alone, owner, (2,))[:] += np.multiply.outer(phases, drawn)

    def _kept(self, where: dict[str, Floats], owner: str, shape: tuple[int, ...]) -> Floats:
        if owner not in where:
            where[owner] = np.zeros((*shape, self.size))
        return where[owner]

    def square(self, judged: HeldSum) -> Floats:
        """Square of what a requirement is about, (draws,); it stands until the next is asked for."""
        square = self._square
        if judged.columns == (0,):
            square.fill(0.0)
            for owner, phase in self.phases.items():
                if owner in judged.owners:
                    square += phase
            square *= square
            return square
        first, *others = judged.columns
        np.multiply(self.totals[first], self.totals[first], out=square)
        for column in others:
            np.multiply(self.totals[column], self.totals[column], out=self._scaled)
            square += self._scaled
        return square

    def exact_square(self, judged: HeldSum) -> Floats:
        """The same by exact ranges; not a number for a draw without an image."""
        owners = judged.owners
        if owners not in self._exact:
            self._exact[owners] = self._by_exact_ranges(owners)
        found = self._exact[owners]
        quadratic, cubic = _sum(self.phase_alone, owners, np.zeros((2, 1)))
        if judged.columns == (0,):
            square: Floats = (found.quadratic + quadratic) ** 2
        elif judged.columns == (1,):
            square = (found.cubic + cubic) ** 2
        else:
            square = found.east**2 + found.north**2
        return square

    def _by_exact_ranges(self, owners: tuple[str, ...]) -> Found:
        times = self.exact.times[:, 0]
        powers = np.stack((np.ones_like(times), times, times**2 / 2), axis=-1)  # of (22)
        clock_powers = SPEED_OF_LIGHT * times[:, None] ** np.arange(4)
        motion = _sum(self.motion, owners, np.broadcast_to(0.0, (2, 3, 3, self.size)))
        clock = _sum({} if self.exact.has_direct_path else self.clock, owners, np.broadcast_to(0.0, (4, self.size)))
        shifts = [powers @ one.swapaxes(0, 1) if one.any() else STILL for one in motion]
        return followed(self.exact, clock_powers @ clock, shifts, np.zeros(self.size, dtype=int))


def _sum(parts: Mapping[str, Floats], owners: Sequence[str], nothing: Floats) -> Floats:
    """Sum of the parts of several owners; `nothing` where none has any."""
    found = [parts[owner] for owner in owners if owner in parts]
    return sum(found[1:], found[0]) if found else nothing
