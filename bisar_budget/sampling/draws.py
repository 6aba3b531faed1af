"""Draws of independent errors: their joint effects, compared with requirements, in pieces that join exactly.

The full model is linear in small errors: a draw is then a sum of standard variables times effects. If a sample of
draws shows that exact ranges differ, every draw goes through exact ranges.

Draws come in chunks of a fixed size. The random numbers of a chunk depend only on the seed, the name of the variable
and the number of the chunk, so that any process can draw it. A piece gives counts, and sums of squares that join
without rounding. The result is the same for any order of the pieces and any processes. Memory does not grow with the
number of draws.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import SPEED_OF_LIGHT, UTILIZATION_TOLERANCE
from bisar_budget.effects.effect import ErrorSource
from bisar_budget.faults import printable
from bisar_budget.geometry import PlatformState
from bisar_budget.memory import is_spacious
from bisar_budget.ranges.exact_ranges import STILL, ExactRanges, Floats, Found, followed

if TYPE_CHECKING:
    from bisar_budget.workers import MapBlocks

# Draws in memory at the same time, equal for every number of draws: results depend on the seed alone. All sums are a
# few megabytes and stay in a cache.
BLOCK_DRAWS = 1 << 15
CHUNK_DRAWS = 1 << 22  # in one stream; they take about a second
EXACT_PIECE_DRAWS = 1 << 18  # through exact ranges, in about a second too; a divisor of a chunk
_DERIVATIVE_OF_UNIT = {"m": 0, "m/s": 1, "m/s^2": 2}
_TRIAL_DRAWS = 512  # decide whether exact ranges are needed
_LIMIT_FRACTION = 0.01  # largest difference between the linear model and exact ranges, as a fraction of a limit
_FIRST_CHILD_CODE = 256  # beyond all bytes of a name
_MIN_COMPILED_DRAWS = 1 << 30  # normal numbers from which Numba saves more seconds than it takes


class Variable(NamedTuple):
    """A standard variable, with mean 0 and variance 1, and its effects.

    Attributes
    ----------
    id, owner, distribution : str
        Name, owner and distribution: `normal`, `uniform` or `bound`.
    of : str
        The error, or the covariance, to which the variable belongs.
    sources : tuple
        Errors that the variable makes, each with its size [unit]; empty for noise, which has effects only.
    effects : (4,)
        Quadratic and cubic phase at the aperture edge [rad], displacement east and north [m].
    """

    id: str
    of: str
    owner: str
    distribution: str
    sources: tuple[tuple[ErrorSource, float], ...]
    effects: tuple[float, float, float, float]


class HeldSum(NamedTuple):
    """A requirement before the draws: a limit for the sum of the errors of its owners, in one or two effects.

    `columns` are indices of effects: one phase, or east and north. The limit of a quadratic phase includes the gain
    of autofocus, which does not correct the hidden phase.
    """

    id: str
    unit: str
    limit: float
    owners: tuple[str, ...]
    columns: tuple[int, ...]
    gain: float = 1.0


class DrawsPiece(NamedTuple):
    """Draws from `start` to before `stop`, all of one chunk."""

    start: int
    stop: int


class Drawing(NamedTuple):
    """All data for draws, so that another process can draw pieces.

    `name` is the name of the mission, `is_exact` whether every draw goes through exact ranges, and `chunk` the number
    of draws in one stream.
    """

    name: str
    variables: tuple[Variable, ...]
    judged: tuple[HeldSum, ...]
    exact: ExactRanges
    paths: tuple[PlatformState, PlatformState]
    draws: int
    seed: int
    is_exact: bool
    chunk: int

    def pieces(self) -> Iterator[DrawsPiece]:
        """The pieces of the draws, always the same; none without requirements."""
        size = min(EXACT_PIECE_DRAWS, self.chunk) if self.is_exact else self.chunk
        for start in range(0, self.draws if self.judged else 0, size):
            yield DrawsPiece(start, min(start + size, self.draws))


class Tally(NamedTuple):
    """Counts and sums of squares of one piece.

    Attributes
    ----------
    holds : (requirements,)
        Number of draws that keep each requirement.
    imaged : (requirements,)
        Number of draws with an image.
    squares : (requirements,)
        Sum of squares over draws with an image.
    all_hold : int
        Number of draws that keep all requirements.
    """

    holds: tuple[int, ...]
    imaged: tuple[int, ...]
    squares: tuple[float, ...]
    all_hold: int


def drawing_of(
    analysis: Analysis, variables: Sequence[Variable], judged: Sequence[HeldSum], draws: int, seed: int
) -> Drawing:
    """Prepare draws of all variables; a sample decides whether they need exact ranges."""
    context = (analysis.mission.name, tuple(variables), tuple(judged), analysis.exact, analysis.geometry.both)
    drawing = Drawing(*context, draws, seed, False, CHUNK_DRAWS)
    is_exact = bool(variables and judged) and _needs_exact_ranges(drawing)

    def counts(variable: Variable) -> bool:
        """Whether a variable affects a requirement. Leaving one out changes no draw: each has its own stream."""
        if is_exact and variable.sources:
            return any(size for _, size in variable.sources)
        return any(variable.effects[column] for requirement in judged for column in requirement.columns)

    return drawing._replace(variables=tuple(filter(counts, variables)), is_exact=is_exact)


def joined(tallies: Iterable[Tally], count: int) -> tuple[list[int], list[float], int]:
    """Join the tallies of pieces, in any order: integers, and fractions that do not round.

    Returns the number of draws that keep each of `count` requirements, the mean square over draws with an image, and
    the number of draws that keep all requirements.
    """
    holds, imaged, all_hold = [0] * count, [0] * count, 0
    squares = [Fraction()] * count
    for tally in tallies:
        all_hold += tally.all_hold
        for index in range(count):
            holds[index] += tally.holds[index]
            imaged[index] += tally.imaged[index]
            squares[index] += Fraction(tally.squares[index])
    means = [float(square / number) if number else math.nan for square, number in zip(squares, imaged, strict=True)]
    return holds, means, all_hold


Share = Callable[[Drawing], Iterable[tuple[DrawsPiece, Tally]]]  # returns every piece once, in any order


def in_turn(drawing: Drawing) -> Iterator[tuple[DrawsPiece, Tally]]:
    """Draw all pieces here, one after the other."""
    drawer = Drawer(drawing)
    for piece in drawing.pieces():
        yield piece, drawer.tally(piece)


def shared_out(drawing: Drawing, mapped: "MapBlocks") -> Iterator[tuple[DrawsPiece, Tally]]:
    """Draw the pieces on workers; yields each when it is done, in any order."""
    mission_words = f"of {printable(drawing.name)}"

    def about(piece: DrawsPiece) -> str:
        """A piece in messages."""
        return f"draws {piece.start} to {piece.stop - 1} {mission_words}"

    return mapped(tally_of, drawing, drawing.pieces(), about)


def tally_of(drawing: Drawing, piece: DrawsPiece) -> Tally:
    """Draw a piece in another process, without earlier pieces."""
    return Drawer(drawing).tally(piece)


class Sums:
    """Sums of the effects of one block of draws: the quadratic phase by owner, all further effects for the mission.

    `adds` allows `square`, and `keeps_motion` allows `exact_square`.

    Attributes
    ----------
    phases, totals : dict
        Quadratic phase by owner, and all further effects by column, (draws,).
    motion : dict
        Position, velocity and acceleration errors of both platforms by owner, (2, 3, 3, draws).
    tags : dict
        Time tag errors of both platforms by owner, (2, draws).
    clock : dict
        Coefficients of the clock by owner, (4, draws).
    effects_only : dict
        Effects of errors without a motion by owner: quadratic and cubic phase, displacement east and north,
        (4, draws).
    """

    def __init__(self, drawing: Drawing, size: int, *, adds: bool, keeps_motion: bool) -> None:
        self.exact, self.size, self.keeps_motion, self.paths = drawing.exact, size, keeps_motion, drawing.paths
        columns = {column for requirement in drawing.judged for column in requirement.columns}
        self.phases = {variable.owner: np.zeros(size) for variable in drawing.variables} if adds else {}
        self.totals = {column: np.zeros(size) for column in sorted(columns - {0})} if adds else {}
        self.motion: dict[str, Floats] = {}
        self.tags: dict[str, Floats] = {}
        self.clock: dict[str, Floats] = {}
        self.effects_only: dict[str, Floats] = {}
        self._exact: dict[tuple[str, ...], Found] = {}
        self._scaled = np.empty(size)
        self._square = np.empty(size)

    def clear(self) -> None:
        """Begin another block."""
        by_owner = (self.motion, self.tags, self.clock, self.effects_only)
        every: list[Mapping[Any, Floats]] = [self.phases, self.totals, *by_owner]
        for arrays in every:
            for array in arrays.values():
                array.fill(0.0)
        self._exact.clear()

    def add(self, variable: Variable, values: Floats) -> None:
        """Add one variable's draws, (draws,)."""
        if self.phases:
            for column, target in {0: self.phases[variable.owner], **self.totals}.items():
                if variable.effects[column]:
                    np.multiply(values, variable.effects[column], out=self._scaled)
                    target += self._scaled
        if self.keeps_motion:
            for source, size in variable.sources:
                self._add_motion(variable.owner, source, size, values)
            if not variable.sources:
                self._add_effects(variable.owner, variable.effects, values)

    def _add_motion(self, owner: str, source: ErrorSource, size: float, values: Floats) -> None:
        if source.is_time_tag:
            tags = self._array_of(self.tags, owner, (2,))
            for platform in source.platforms:
                tags[platform] += size * values
        elif source.is_position:
            motion = self._array_of(self.motion, owner, (2, 3, 3))
            for platform in source.platforms:
                for axis, component in enumerate(source.direction_of(platform)):
                    if component:
                        motion[platform, _DERIVATIVE_OF_UNIT[source.unit], axis] += size * component * values
        elif source.clock is not None:
            self._array_of(self.clock, owner, (4,))[:] += np.multiply.outer(size * np.array(source.clock), values)
        else:
            self._add_effects(owner, (size, 0.0, 0.0, 0.0), values)

    def _add_effects(self, owner: str, effects: tuple[float, ...], values: Floats) -> None:
        self._array_of(self.effects_only, owner, (4,))[:] += np.multiply.outer(effects, values)

    def _array_of(self, arrays: dict[str, Floats], owner: str, shape: tuple[int, ...]) -> Floats:
        if owner not in arrays:
            arrays[owner] = np.zeros((*shape, self.size))
        return arrays[owner]

    def square(self, judged: HeldSum) -> Floats:
        """Square of the effect of a requirement, (draws,). The next call overwrites the array."""
        square = self._square
        if judged.columns == (0,):
            square.fill(0.0)
            for owner, phase in self.phases.items():
                if owner in judged.owners:
                    square += phase
            square *= square
            return square
        first, *further_columns = judged.columns
        np.multiply(self.totals[first], self.totals[first], out=square)
        for column in further_columns:
            np.multiply(self.totals[column], self.totals[column], out=self._scaled)
            square += self._scaled
        return square

    def exact_square(self, judged: HeldSum) -> Floats:
        """Square of the effect of a requirement by exact ranges, (draws,); NaN for a draw without an image."""
        owners = judged.owners
        if owners not in self._exact:
            self._exact[owners] = self._by_exact_ranges(owners)
        exact, effects = self._exact[owners], _sum(self.effects_only, owners, np.zeros((4, 1)))
        by_ranges = (exact.quadratic, exact.cubic, exact.east, exact.north)
        square = np.asarray(sum((by_ranges[column] + effects[column]) ** 2 for column in judged.columns))
        return square + (judged.gain * exact.hidden) ** 2 if judged.columns == (0,) else square

    def _by_exact_ranges(self, owners: tuple[str, ...]) -> Found:
        times = self.exact.times[:, 0]
        powers = times[:, None] ** np.arange(3) / (1, 1, 2)  # of (22)
        clock_powers = SPEED_OF_LIGHT * times[:, None] ** np.arange(4)
        motion = _sum(self.motion, owners, np.broadcast_to(0.0, (2, 3, 3, self.size)))
        tags = _sum(self.tags, owners, np.broadcast_to(0.0, (2, self.size)))
        clock = _sum(self.clock, owners, np.broadcast_to(0.0, (4, self.size)))
        shifts: list[Any] = [powers @ errors.swapaxes(0, 1) if errors.any() else STILL for errors in motion]
        for platform, tag in enumerate(tags):
            if tag.any():
                late_shifts = self.paths[platform].later(times[:, None], tag)
                shifts[platform] = [shift + late for shift, late in zip(shifts[platform], late_shifts, strict=True)]
        return followed(self.exact, clock_powers @ clock, shifts, np.zeros(self.size, dtype=int))


def _sum(arrays: Mapping[str, Floats], owners: Sequence[str], zero: Floats) -> Floats:
    """Sum of the arrays of several owners; `zero` if no owner has an array."""
    present = [arrays[owner] for owner in owners if owner in arrays]
    return sum(present[1:], present[0]) if present else zero


class Drawer:
    """Draws pieces. A piece that follows the last piece of the same chunk continues its streams."""

    def __init__(self, drawing: Drawing) -> None:
        self._drawing = drawing
        self._chunk, self._position = -1, 0
        self._streams: list[_Stream] = []
        normal = sum(variable.distribution == "normal" for variable in drawing.variables)
        self._fill_normal = _compiled() if drawing.draws * normal >= _MIN_COMPILED_DRAWS else _fill_normal
        self._buffer = np.empty(BLOCK_DRAWS)

    def tally(self, piece: DrawsPiece) -> Tally:
        """Draw a piece and count."""
        drawing = self._drawing
        self._go_to(piece.start)
        count = len(drawing.judged)
        holds, imaged, squares, all_hold = [0] * count, [0] * count, [0.0] * count, 0
        sums: Sums | None = None
        for start in range(piece.start, piece.stop, BLOCK_DRAWS):
            size = min(BLOCK_DRAWS, piece.stop - start)
            if sums is None or sums.size != size:
                sums = None  # frees the memory of the last block
                sums = Sums(drawing, size, adds=not drawing.is_exact, keeps_motion=drawing.is_exact)
            self._draw(sums)
            holds_all = np.ones(size, dtype=bool)
            for index, requirement in enumerate(drawing.judged):
                square = sums.exact_square(requirement) if drawing.is_exact else sums.square(requirement)
                # A draw without an image keeps no requirement: its square is not a number.
                is_held = square <= (requirement.limit * (1 + UTILIZATION_TOLERANCE)) ** 2
                holds[index] += int(np.count_nonzero(is_held))
                if drawing.is_exact:
                    square = square[np.isfinite(square)]
                imaged[index] += square.size
                squares[index] += float(square.sum())
                holds_all &= is_held
            all_hold += int(np.count_nonzero(holds_all))
        return Tally(tuple(holds), tuple(imaged), tuple(squares), all_hold)

    def _go_to(self, start: int) -> None:
        """Set the streams of a chunk to a draw."""
        chunk = start // self._drawing.chunk
        if chunk != self._chunk or start < self._position:
            self._chunk, self._position = chunk, chunk * self._drawing.chunk
            self._streams = [
                _Stream(variable, self._drawing.seed, chunk, self._fill_normal)
                for variable in self._drawing.variables
            ]
        for stream in self._streams:
            stream.skip(start - self._position, self._buffer)
        self._position = start

    def _draw(self, sums: Sums) -> None:
        sums.clear()
        values = self._buffer[: sums.size]
        for variable, stream in zip(self._drawing.variables, self._streams, strict=True):
            stream.fill(values)
            sums.add(variable, values)
        self._position += sums.size


def _needs_exact_ranges(drawing: Drawing) -> bool:
    """Whether exact ranges differ from the linear model in a sample of draws, by more than a fraction of a limit.

    The linear model has no hidden phase: if band and turn hide more than that fraction, draws need exact ranges.
    """
    sums = Sums(drawing, _TRIAL_DRAWS, adds=True, keeps_motion=True)
    values = np.empty(_TRIAL_DRAWS)
    for variable in drawing.variables:
        _Stream(variable, drawing.seed).fill(values)
        sums.add(variable, values)
    for requirement in drawing.judged:
        linear, exact = np.sqrt(sums.square(requirement)), np.sqrt(sums.exact_square(requirement))
        if not np.all(np.abs(exact - linear) <= _LIMIT_FRACTION * requirement.limit):
            return True
    return False


def _fill_normal(generator: np.random.Generator, out: Floats) -> None:
    generator.standard_normal(out=out)


@cache
def _compiled() -> Callable[[np.random.Generator, Floats], None]:
    """Filling by compiled code, if Numba is installed, has memory and can keep the compiled code."""
    if not is_spacious():
        return _fill_normal
    try:
        from numba import njit

        compiled: Callable[[np.random.Generator, Floats], None] = njit(cache=True, nogil=True)(_fill_each)
    except (ImportError, RuntimeError):  # not installed, or without a folder for compiled code
        return _fill_normal
    return compiled


def _fill_each(generator: np.random.Generator, out: Floats) -> None:
    """Fill with normal draws, compiled by Numba: equal to NumPy's to the last bit, in two thirds of the time."""
    for index in range(out.size):
        out[index] = generator.standard_normal()


class _Stream:
    """Draws of a variable in a chunk. Each variable has its own stream, so that a new error changes no stream.

    The seed and the name seed the stream of the first chunk. The streams of further chunks are its children. The code
    of a child is no byte of a name, so that it differs from the stream of a variable with a longer name.
    """

    def __init__(
        self,
        variable: Variable,
        seed: int,
        chunk: int = 0,
        fill_normal: Callable[[np.random.Generator, Floats], None] = _fill_normal,
    ) -> None:
        child = (_FIRST_CHILD_CODE + chunk,) if chunk else ()
        self._bits = np.random.PCG64(np.random.SeedSequence([seed, *variable.id.encode()], spawn_key=child))
        self._generator = np.random.Generator(self._bits)
        self._distribution, self._fill_normal = variable.distribution, fill_normal

    def fill(self, out: Floats) -> None:
        """Draw into an array (draws,)."""
        if self._distribution == "normal":
            self._fill_normal(self._generator, out)
            return
        self._generator.random(out=out)
        out -= 0.5
        if self._distribution == "uniform":
            out *= math.sqrt(12)
        else:  # a bound, of either sign with equal probability
            np.copysign(1.0, out, out=out)

    def skip(self, count: int, buffer: Floats) -> None:
        """Skip draws. A normal draw takes a random count of random numbers, and any further draw takes one."""
        if self._distribution != "normal":
            self._bits.advance(count)
            return
        for start in range(0, count, buffer.size):
            self.fill(buffer[: count - start])


# ---------------------------------------------------------------------- eigenvectors
_MAX_JACOBI_ROUNDS = 30  # convergence is quadratic; a 6 x 6 matrix takes about five


def eigensystem(matrix: Sequence[Sequence[float]]) -> tuple[list[float], list[list[float]]]:
    """Eigenvalues of a symmetric matrix (n, n) and, as columns, its unit eigenvectors, in no order.

    By Jacobi's rotations. For equal eigenvalues LAPACK has different vectors, and a seed would give different draws.
    """
    n = len(matrix)
    a = [list(row) for row in matrix]
    v = [[float(i == j) for j in range(n)] for i in range(n)]
    # A smaller element moves an eigenvalue by less than rounding.
    negligible = 1e-17 * max((abs(x) for row in a for x in row), default=0.0)
    for _ in range(_MAX_JACOBI_ROUNDS):
        is_done = True
        for p in range(n - 1):
            for q in range(p + 1, n):
                if abs(a[p][q]) <= negligible:
                    continue
                is_done = False
                theta = (a[q][q] - a[p][p]) / (2 * a[p][q])
                t = math.copysign(1.0, theta) / (abs(theta) + math.hypot(theta, 1.0))
                cosine = 1 / math.hypot(t, 1.0)
                _rotate(a, v, p, q, cosine, t * cosine)
        if is_done:
            break
    return [a[i][i] for i in range(n)], v


def _rotate(a: list[list[float]], v: list[list[float]], p: int, q: int, c: float, s: float) -> None:
    """Turn the plane of p and q so that a[p][q] vanishes; `v` collects the turns."""
    for row in (*a, *v):
        row[p], row[q] = c * row[p] - s * row[q], s * row[p] + c * row[q]
    upper, lower = a[p], a[q]
    a[p] = [c * x - s * y for x, y in zip(upper, lower, strict=True)]
    a[q] = [s * x + c * y for x, y in zip(upper, lower, strict=True)]
    a[p][q] = a[q][p] = 0.0
