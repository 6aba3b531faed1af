"""Draws of independent errors in blocks: what they do together, held to requirements.

The full model is linear in small errors: a draw then is a sum of standard variables times effects. Where a sample of
draws shows that exact ranges differ, every draw goes through exact ranges. The one module of the budget that, with
`exact_arrays`, loads NumPy; `check` without `--monte-carlo` does not come here.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import SPEED_OF_LIGHT, UTILIZATION_TOLERANCE
from bisar_budget.effects.effect import CLOCK_UNITS, PLATFORMS, ErrorSource
from bisar_budget.effects.exact_arrays import ExactEffects, direct_path_clock, exact_effects

Floats = NDArray[np.float64]

# Draws held at once, the same for every number of draws: results depend on the seed alone. All that is summed are
# a few megabytes and stay in a cache.
BLOCK = 1 << 15
_SAMPLE = 512  # draws that decide whether exact ranges are needed
_DIFFERENT = 0.01  # of a limit
_ORDER = {"m": 0, "m/s": 1, "m/s^2": 2}
_CLOCK = {unit: power for power, unit in enumerate(CLOCK_UNITS.values())}


class Variable(NamedTuple):
    """One standard variable, mean 0 and variance 1, and what it does.

    `of` is the error, or the covariance, that it belongs to. `parts` are the errors it makes, and how much of each
    [unit]; none where it is noise, which is phases alone. Effects: quadratic and cubic phase at the aperture edge
    [rad], displacement east and north [m].
    """

    id: str
    of: str
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

    For each requirement the draws in which it held and the mean square, over draws that have an image; the draws in
    which all held. `is_exact` says that every draw went through exact ranges.
    """

    holds: list[int]
    mean_squares: list[float]
    all_hold: int
    is_exact: bool


def count(
    analysis: Analysis, variables: Sequence[Variable], judged: Sequence[Judged], draws: int, seed: int
) -> Counted:
    """Draw every variable and count. Time grows with the number of draws, memory does not."""
    streams = [_stream(variable, seed) for variable in variables]
    holds, squares, imaged, all_hold = [0] * len(judged), [0.0] * len(judged), [0] * len(judged), 0
    is_exact = _needs_exact_ranges(analysis, variables, judged, seed)
    for start in range(0, draws, BLOCK):
        size = min(BLOCK, draws - start)
        sums = _Sums(variables, judged, size, keeps_motion=is_exact)
        for variable, stream in zip(variables, streams, strict=True):
            sums.add(variable, stream(size))
        together = np.ones(size, dtype=bool)
        for index, one in enumerate(judged):
            square = sums.exact_square(analysis, one) if is_exact else sums.square(one)
            held = one.holds(square)  # what has no image holds nothing: it is not a number
            holds[index] += int(np.count_nonzero(held))
            has_image = np.isfinite(square)
            imaged[index] += int(np.count_nonzero(has_image))
            squares[index] += float(square[has_image].sum())
            together &= held
        all_hold += int(np.count_nonzero(together))
    means = [square / number if number else math.nan for square, number in zip(squares, imaged, strict=True)]
    return Counted(holds, means, all_hold, is_exact)


def _needs_exact_ranges(
    analysis: Analysis, variables: Sequence[Variable], judged: Sequence[Judged], seed: int
) -> bool:
    """Whether exact ranges differ from the linear model in a sample of draws, by more than a part of a limit."""
    if not variables or not judged:
        return False
    sums = _Sums(variables, judged, _SAMPLE, keeps_motion=True)
    for variable in variables:
        sums.add(variable, _stream(variable, seed)(_SAMPLE))
    for one in judged:
        linear, exact = np.sqrt(sums.square(one)), np.sqrt(sums.exact_square(analysis, one))
        if not np.all(np.abs(exact - linear) <= _DIFFERENT * one.limit):
            return True
    return False


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

    By owner, if kept: `motion` is position, velocity and acceleration error of both platforms, (2, 3, 3, draws),
    `clock` its coefficients (4, draws), `phase_alone` what is stated as a phase, quadratic and cubic (2, draws).
    """

    def __init__(
        self, variables: Sequence[Variable], judged: Sequence[Judged], size: int, *, keeps_motion: bool
    ) -> None:
        wanted = {column for one in judged for column in one.columns}
        self.size = size
        self.phases = {variable.owner: np.zeros(size) for variable in variables}
        self.totals = {column: np.zeros(size) for column in sorted(wanted - {0})}
        self.keeps_motion = keeps_motion
        self.motion: dict[str, Floats] = {}
        self.clock: dict[str, Floats] = {}
        self.phase_alone: dict[str, Floats] = {}
        self._exact: dict[tuple[str, ...], ExactEffects] = {}
        self._scaled = np.empty(size)

    def add(self, variable: Variable, drawn: Floats) -> None:
        """Add one variable's draws."""
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
            motion = self.motion.setdefault(owner, np.zeros((2, 3, 3, self.size)))
            for platform, name in enumerate(PLATFORMS):
                if source.moves(name):
                    for axis, component in enumerate(source.direction):
                        if component:
                            motion[platform, _ORDER[source.unit], axis] += size * component * drawn
        elif source.owner == "clock":
            self.clock.setdefault(owner, np.zeros((4, self.size)))[_CLOCK[source.unit]] += size * drawn
        else:
            self._add_phases(owner, (size, 0.0), drawn)

    def _add_phases(self, owner: str, phases: tuple[float, ...], drawn: Floats) -> None:
        self.phase_alone.setdefault(owner, np.zeros((2, self.size)))[:] += np.multiply.outer(phases, drawn)

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

    def exact_square(self, analysis: Analysis, judged: Judged) -> Floats:
        """The same by exact ranges; not a number for a draw without an image."""
        owners = tuple(judged.owners)
        if owners not in self._exact:
            self._exact[owners] = self._by_exact_ranges(analysis, owners)
        found = self._exact[owners]
        quadratic, cubic = _sum(self.phase_alone, owners, np.zeros((2, 1)))
        if judged.columns == (0,):
            square: Floats = (found.quadratic + quadratic) ** 2
        elif judged.columns == (1,):
            square = (found.cubic + cubic) ** 2
        else:
            square = np.sum(found.displacement**2, axis=-1)
        return square

    def _by_exact_ranges(self, analysis: Analysis, owners: tuple[str, ...]) -> ExactEffects:
        exact = analysis.exact
        times = np.array(exact.times)
        powers = np.stack((np.ones_like(times), times, times**2 / 2))  # of (22)
        motion = _sum(self.motion, owners, np.zeros((2, 3, 3, 1)))
        clock = _sum(self.clock, owners, np.zeros((4, 1)))
        clock_range = SPEED_OF_LIGHT * np.einsum("pd,pn->dn", clock, times ** np.arange(4)[:, None])
        actual = (np.array(exact.tracks[PLATFORMS[0]]), np.array(exact.tracks[PLATFORMS[1]]))
        transmitter, receiver = (
            track + np.einsum("kad,kn->dna", motion[platform], powers) for platform, track in enumerate(actual)
        )
        if exact.has_direct_path:
            clock_range = direct_path_clock(transmitter, receiver, *actual)
        found = exact_effects(transmitter, receiver, *actual, clock_range, exact.wavelength)
        if found.quadratic.size == self.size:
            return found
        return ExactEffects(  # no such owner has an error: every draw is alike
            np.broadcast_to(found.displacement, (self.size, 2)),
            np.broadcast_to(found.quadratic, (self.size,)),
            np.broadcast_to(found.cubic, (self.size,)),
            np.broadcast_to(found.found, (self.size,)),
        )


def _sum(parts: Mapping[str, Floats], owners: Sequence[str], nothing: Floats) -> Floats:
    """What several owners have, added up."""
    total = nothing
    for owner in owners:
        if owner in parts:
            total = total + parts[owner]
    return total
