"""Draws of independent errors in blocks: sums of their effects, held to requirements.

The one module of the budget that loads NumPy; `check` without `--monte-carlo` does not come here.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.budget.effects import PLATFORMS, ErrorSource, FullGround
from bisar_budget.budget.validity import FLOOR_RAD, SHARE
from bisar_budget.constants import UTILIZATION_TOLERANCE
from bisar_budget.geometry import BistaticGeometry
from bisar_budget.mission.model import Mission

Floats = NDArray[np.float64]

# Draws held at once, the same for every number of draws: results depend on the seed alone. All that is summed are
# a few megabytes and stay in a cache.
BLOCK = 1 << 15
_ORDER = {"m": 0, "m/s": 1, "m/s^2": 2}


class Variable(NamedTuple):
    """One standard variable, mean 0 and variance 1, and what it does.

    `parts` are the errors it makes, and how much of each [unit]. Effects: quadratic and cubic phase at the aperture
    edge [rad], displacement east and north [m].
    """

    id: str
    owner: str
    distribution: str
    parts: tuple[tuple[ErrorSource, float], ...]
    effects: tuple[float, float, float, float]


class Judged(NamedTuple):
    """A requirement before the draws: the sum of whose errors, in which effects, is held to which limit."""

    id: str
    unit: str
    limit: float
    owners: tuple[str, ...]
    columns: tuple[int, ...]  # of the effects: one phase, or east and north

    def holds(self, square: Floats) -> NDArray[np.bool_]:
        """Whether sums whose squares are given are within the limit."""
        held: NDArray[np.bool_] = square <= (self.limit * (1 + UTILIZATION_TOLERANCE)) ** 2
        return held


class Counted(NamedTuple):
    """What a number of draws gives.

    For each requirement the draws in which it held and the mean square; the draws in which all held; and, of the
    first block, the share beyond first order and, with the second order added, the share in which the total
    quadratic phase held (None where nothing is drawn).
    """

    holds: list[int]
    mean_squares: list[float]
    all_hold: int
    beyond_first_order: float
    holds_with_second_order: float | None


def count(
    mission: Mission,
    geometry: BistaticGeometry,
    ground: FullGround,
    variables: Sequence[Variable],
    judged: Sequence[Judged],
    draws: int,
    seed: int,
) -> Counted:
    """Draw every variable and count. Time grows with the number of draws, memory does not."""
    streams = [_stream(variable, seed) for variable in variables]
    holds, squares, all_hold = [0] * len(judged), [0.0] * len(judged), 0
    beyond, with_second = 0.0, None
    for start in range(0, draws, BLOCK):
        size = min(BLOCK, draws - start)
        is_first = start == 0
        sums = _Sums(variables, judged, size, keeps_all=is_first)
        for variable, stream in zip(variables, streams, strict=True):
            sums.add(variable, stream(size))
        together = np.ones(size, dtype=bool)
        for index, one in enumerate(judged):
            square = sums.square(one)
            held = one.holds(square)
            holds[index] += int(np.count_nonzero(held))
            squares[index] += float(square.sum())
            together &= held
        all_hold += int(np.count_nonzero(together))
        if is_first and variables:
            first = sums.phase()
            second = _second_order(mission, geometry, ground, sums.motion, sums.totals[2], sums.totals[3])
            beyond = float(np.mean(np.abs(second) > np.maximum(FLOOR_RAD, SHARE * np.abs(first))))
            total = next(one for one in judged if one.id == "mission.quadratic_phase_error")
            with_second = float(np.mean(total.holds((first + second) ** 2)))
    return Counted(holds, [square / draws for square in squares], all_hold, beyond, with_second)


def _stream(variable: Variable, seed: int) -> Callable[[int], Floats]:
    """Endless draws of a variable. Each has a stream of its own, so that another error in the file changes none."""
    generator = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *variable.id.encode()])))
    if variable.distribution == "normal":
        return generator.standard_normal
    if variable.distribution == "uniform":
        return lambda size: (generator.random(size) - 0.5) * math.sqrt(12)
    return lambda size: np.where(generator.random(size) < 0.5, -1.0, 1.0)


class _Sums:
    """Effects of one block of draws, added up: the quadratic phase by owner, all else for the mission.

    `motion` are position, velocity and acceleration error of both platforms, (2, 3, 3, draws), if kept.
    """

    def __init__(
        self, variables: Sequence[Variable], judged: Sequence[Judged], size: int, *, keeps_all: bool
    ) -> None:
        wanted = {column for one in judged for column in one.columns} | ({2, 3} if keeps_all else set())
        self.phases = {variable.owner: np.zeros(size) for variable in variables}
        self.totals = {column: np.zeros(size) for column in sorted(wanted - {0})}
        self.motion: Floats = np.zeros((2, 3, 3, size if keeps_all else 0))
        self._scaled = np.empty(size)

    def add(self, variable: Variable, drawn: Floats) -> None:
        """Add one variable's draws."""
        for target, column in ((self.phases[variable.owner], 0), *((t, c) for c, t in self.totals.items())):
            if variable.effects[column]:
                np.multiply(drawn, variable.effects[column], out=self._scaled)
                target += self._scaled
        if not self.motion.size:
            return
        for source, size in variable.parts:
            if source.unit not in _ORDER:
                continue  # the clock, or a phase
            for platform, name in enumerate(PLATFORMS):
                if source.moves(name):
                    for axis, component in enumerate(source.direction):
                        if component:
                            self.motion[platform, _ORDER[source.unit], axis] += size * component * drawn

    def phase(self, owners: Sequence[str] | None = None) -> Floats:
        """Quadratic phase of the errors of some owners, else of all, (draws,). [rad]"""
        total: Floats = np.zeros_like(self._scaled)
        for owner, phase in self.phases.items():
            if owners is None or owner in owners:
                total += phase
        return total

    def square(self, judged: Judged) -> Floats:
        """Square of what a requirement is about, (draws,)."""
        if judged.columns == (0,):
            phase = self.phase(judged.owners)
            phase *= phase
            return phase
        square: Floats = np.zeros_like(self._scaled)
        for column in judged.columns:
            square += self.totals[column] ** 2
        return square


def _second_order(
    mission: Mission, geometry: BistaticGeometry, ground: FullGround, motion: Floats, east: Floats, north: Floats
) -> Floats:
    """Quadratic phase that −Σ|P⊥(r̃_k − x̂)|²/2R_k adds at the displaced point, (draws,); see `validity`. [rad]"""
    T = mission.collection.aperture_time
    moved = (east, north, 0.0)
    states = (geometry.transmitter, geometry.receiver)

    def range_error(tau: float) -> Floats:
        total: Floats = np.zeros_like(east)
        for state, (position, velocity, acceleration) in zip(states, motion, strict=True):
            at = state.at(tau)[0]
            R = math.hypot(*at)
            along: Floats = np.zeros_like(total)
            for axis in range(3):
                off = position[axis] + velocity[axis] * tau + acceleration[axis] * (tau**2 / 2) - moved[axis]
                along += off * (at[axis] / R)
                total -= off**2 / (2 * R)
            total += along**2 / (2 * R)
        return total

    before, middle, after = range_error(-T / 2), range_error(0.0), range_error(T / 2)
    quadratic = 2 * math.pi / mission.radar.wavelength * ((before + after) / 2 - middle)
    phase: Floats = quadratic + ground.quadratic[0] * middle + ground.quadratic[1] * ((after - before) / T)
    return phase
