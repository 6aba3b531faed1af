"""Random draws of independent errors, and counts of the draws that meet each requirement.

For small errors the full model is linear: the effect of a draw is the sum of the effects of standardized random
variables, each multiplied by its drawn value. A sample of draws is also computed from exact ranges. If the two
results differ by more than 1 % of a limit, all draws are computed from exact ranges.

Draws are divided into chunks of a fixed size. The random numbers of a chunk depend only on the seed, on the name of
the variable and on the number of the chunk, so any process can generate them. A chunk is divided into one or more
pieces. The result of a piece is a set of counts and sums of squared errors. The results of all pieces are added
without rounding, so the total does not depend on which processes computed the pieces, or in which order. Memory does
not grow with the number of draws.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.variables import CONSTANT, FIRST_HIDDEN_INDEX, ToneMotion, Variable
from bisar_budget.arrays import Floats
from bisar_budget.constants import SPEED_OF_LIGHT_MPS, UTILIZATION_TOLERANCE_FRACTION
from bisar_budget.effects.effect import ErrorSource
from bisar_budget.faults import printable
from bisar_budget.geometry import PlatformState
from bisar_budget.memory import is_spacious
from bisar_budget.ranges.exact_ranges import NO_SHIFTS, ExactRanges, ImagePoints, followed

if TYPE_CHECKING:
    from bisar_budget.workers import MapBlocks

# Number of draws that are in memory at once. It does not depend on the total number, so that results depend on the
# seed alone. The sums of a block take a few megabytes and stay in the cache of a processor.
BLOCK_DRAWS = 1 << 15
CHUNK_DRAWS = 1 << 22  # draws of one random stream, which take about a second
EXACT_PIECE_DRAWS = 1 << 18  # draws of a piece with exact ranges; divides a chunk, and takes about as long
_LINEARITY_DRAWS = 512  # size of the sample that decides whether exact ranges are needed
_LINEARITY_TOLERANCE_FRACTION = 0.01  # accepted error of the linear model, as a fraction of a limit
_AFTER_BYTES = 256
# Fraction of the rms phase that is judged; a smaller hidden phase raises the rms by at most two parts in 10⁴.
_MIN_HIDDEN_FRACTION = 0.02
# The quadrature over the aperture with n nodes is exact up to the order 2n − 1. The weights of the effects use up the
# first orders, and beyond the order πfT the Legendre components of a tone decrease quickly.
_ORDERS_BESIDE_TONE_COUNT = 7
_MIN_COMPILED_DRAWS = 1 << 30  # for fewer normal draws, compiling takes more time than Numba saves


class HeldSum(NamedTuple):
    """A requirement to be compared with draws: its limit, and the errors and effects that are summed for it.

    `owners` are the owners of the summed errors, such as `receiver` or `clock`. `columns` are the indices of the
    summed effects in `Variable.effects`. `limit` is in `unit`. The limit of a quadratic phase error includes the
    `gain` of autofocus. Autofocus does not correct the hidden phase, which is the part of the phase that the
    bandwidth and the turn of the line of sight do not resolve. Before it is compared with this limit, the hidden
    phase is therefore multiplied by `gain`. `hides` states whether sums of first-order effects include the hidden
    phase, see `with_hidden`.
    """

    id: str
    unit: str
    limit: float
    owners: tuple[str, ...]
    columns: tuple[int, ...]  # of the effects: one phase, or east and north
    gain: float = 1.0
    hides: bool = False

    def covariance(self, variables: Iterable[Variable]) -> Floats:
        """Covariance of the effects whose squares are summed, including parts of the hidden phase times `gain`.

        `variables` are the variables of the mission. The result is (effects, effects), in the square of `unit`.
        """
        members = [variable for variable in variables if variable.owner in self.owners]
        hidden = range(FIRST_HIDDEN_INDEX, len(members[0].effects) if self.hides and members else FIRST_HIDDEN_INDEX)
        scales = {**dict.fromkeys(self.columns, 1.0), **dict.fromkeys(hidden, self.gain)}
        return np.array([
            [scales[a] * scales[b] * math.fsum(member.covariance(a, b) for member in members) for b in scales]
            for a in scales
        ])  # fmt: skip

    def is_affected_by(self, variable: Variable) -> bool:
        """Whether a variable has any of the effects that are summed, whoever its owner is."""
        return any(map(variable.affects, self.columns)) or (self.hides and variable.hides)

    def with_hidden(self, variables: Sequence[Variable]) -> "HeldSum":
        """Include the hidden phase if it matters: if it exceeds a fraction of the rms of the judged phase."""
        if self.columns != (0,):
            return self
        including = self._replace(hides=True)
        squares = np.diagonal(including.covariance(variables))
        is_hidden = squares[1:].sum() > _MIN_HIDDEN_FRACTION**2 * squares.sum()
        return including if is_hidden else self


class DrawsPiece(NamedTuple):
    """A piece of the draws: the draws `start` to `stop` - 1, which are all in the same chunk."""

    start: int
    stop: int


class Drawing(NamedTuple):
    """All data that a process needs to compute pieces of the draws of a mission.

    `name` is the name of the mission. `is_exact` states whether all draws are computed from exact ranges. `chunk` is
    the number of draws in a chunk; in each chunk, each variable has its own random stream.
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
        """Yield the pieces into which the draws are divided. The division is always the same for the same data.

        No piece is yielded if there is no requirement with which draws can be compared.
        """
        size = min(EXACT_PIECE_DRAWS, self.chunk) if self.is_exact else self.chunk
        for start in range(0, self.draws if self.judged else 0, size):
            yield DrawsPiece(start, min(start + size, self.draws))


class Tally(NamedTuple):
    """Counts of draws and sums of squared errors in one piece of the draws.

    For each requirement, `holds` is the number of draws that meet it, `imaged` is the number of draws with which an
    image can be formed, and `squares` is the sum of the squared errors of these draws. `all_hold` is the number of
    draws that meet all requirements.
    """

    holds: tuple[int, ...]
    imaged: tuple[int, ...]
    squares: tuple[float, ...]
    all_hold: int


def drawing_of(
    analysis: Analysis, variables: Sequence[Variable], judged: Sequence[HeldSum], draws: int, seed: int
) -> Drawing:
    """Prepare the draws of a mission. A sample of draws decides whether all draws need exact ranges.

    Variables that do not affect any requirement are left out.
    """
    setting = (analysis.mission.name, tuple(variables), tuple(judged), analysis.exact, analysis.geometry.both)
    drawing = Drawing(*setting, draws, seed, False, CHUNK_DRAWS)
    is_exact = bool(variables and judged) and _needs_exact_ranges(drawing)

    def counts(variable: Variable) -> bool:
        """Whether a variable affects any requirement.

        A variable without an effect can be left out, because every variable has its own random stream.
        """
        if is_exact and variable.parts:
            return any(size for _, size in variable.parts)
        return any(requirement.is_affected_by(variable) for requirement in judged)

    return drawing._replace(variables=tuple(filter(counts, variables)), is_exact=is_exact)


def joined(tallies: Iterable[Tally], count: int) -> tuple[list[int], list[float], int]:
    """Combine the tallies of all pieces, in any order; `count` is the number of requirements.

    Returns three values: for each requirement the number of draws that meet it; for each requirement the mean squared
    error of the draws with an image, or NaN if no draw has an image; and the number of draws that meet all
    requirements. Squared errors are added as fractions, without rounding.
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


Share = Callable[[Drawing], Iterable[tuple[DrawsPiece, Tally]]]  # gives every piece once, in any order


def in_turn(drawing: Drawing) -> Iterator[tuple[DrawsPiece, Tally]]:
    """Draw all pieces in this process, one after the other, and yield each piece with its tally."""
    drawer = Drawer(drawing)
    for piece in drawing.pieces():
        yield piece, drawer.tally(piece)


def shared_out(drawing: Drawing, mapped: "MapBlocks") -> Iterator[tuple[DrawsPiece, Tally]]:
    """Let other workers draw the pieces, and yield each piece with its tally as soon as it is finished.

    The pieces come in any order. `mapped` is the function that distributes them to the workers.
    """
    of = f"of {printable(drawing.name)}"
    return mapped(tally_of, drawing, drawing.pieces(), lambda piece: f"draws {piece.start} to {piece.stop - 1} {of}")


def tally_of(drawing: Drawing, piece: DrawsPiece) -> Tally:
    """Draw the errors of one piece, and count the draws that meet the requirements.

    The result does not depend on pieces that this process drew before.
    """
    return Drawer(drawing).tally(piece)


class Sums:
    """Summed errors of one block of draws.

    If `adds` is true, the effects of the errors are summed: the quadratic phase for each owner, and each further
    effect over the whole mission. `square` can then be called. If `keeps_motion` is true, the errors themselves are
    summed for each owner, as input for exact ranges. `exact_square` can then be called.

    For exact ranges there are the following arrays for each owner. `motion` (2, 3, 3, draws) holds position, velocity
    and acceleration errors of both platforms, `tags` (2, draws) time tag errors of both platforms, and `clock` (4,
    draws) clock coefficients. `registered` holds errors of registered kinds (see `error_kinds`), each with its sizes
    (draws,). `waves` holds the slow vibrations, each with the cosine and the sine of its phase in each draw, (2,
    draws). `alone` (effects, draws) is for errors and tones of which only the effects are known, in the order of
    `Variable.effects`.

    `hidden` (parts, draws) are the first-order parts of the hidden phase for each owner. It is empty unless a
    requirement includes the hidden phase.
    """

    def __init__(self, drawing: Drawing, size: int, *, adds: bool, keeps_motion: bool) -> None:
        self.exact, self.size, self.keeps_motion, self.paths = drawing.exact, size, keeps_motion, drawing.paths
        columns = {column for requirement in drawing.judged for column in requirement.columns}
        self.phases = {variable.owner: np.zeros(size) for variable in drawing.variables} if adds else {}
        self.totals = {column: np.zeros(size) for column in sorted(columns - {0})} if adds else {}
        self.effect_count = max((len(variable.effects) for variable in drawing.variables), default=FIRST_HIDDEN_INDEX)
        hides = any(requirement.hides for requirement in drawing.judged)
        shape = (self.effect_count - FIRST_HIDDEN_INDEX, size)
        self.hidden = {variable.owner: np.zeros(shape) for variable in drawing.variables} if hides else {}
        self.motion: dict[str, Floats] = {}
        self.tags: dict[str, Floats] = {}
        self.clock: dict[str, Floats] = {}
        self.alone: dict[str, Floats] = {}
        self.registered: dict[str, list[tuple[ErrorSource, Floats]]] = {}
        self.waves: dict[str, list[tuple[ToneMotion, Floats]]] = {}
        self._exact: dict[tuple[str, ...], ImagePoints] = {}
        self._scaled = np.empty(size)
        self._square = np.empty(size)

    def clear(self) -> None:
        """Set all sums to zero before the next block of draws."""
        by_name = (self.motion, self.tags, self.clock, self.alone)
        added = (self.phases, self.totals, self.hidden)
        for kept in (*(each.values() for each in added), *(each.values() for each in by_name)):
            for sums in kept:
                sums.fill(0.0)
        self.registered.clear()
        self.waves.clear()
        self._exact.clear()

    def add(self, variable: Variable, drawn: Floats) -> None:
        """Add the errors and effects of one variable. `drawn` holds its values, (draws,)."""
        if variable.is_tone:
            self._add_tone(variable, np.array((np.cos(drawn), np.sin(drawn))))
            return
        self._add_to_sums(variable.owner, variable.effects, drawn)
        if self.keeps_motion:
            for source, size in variable.parts:
                self._add_motion(variable.owner, source, size, drawn)
            if not variable.parts:
                self._add_effects(variable.owner, variable.effects, drawn)

    def _add_tone(self, variable: Variable, turned: Floats) -> None:
        """Add a tone. `turned` (2, draws) are the cosine and the sine of its phase in each draw."""
        effects = (variable.effects, variable.quadrature)
        for wave, drawn in zip(effects, turned, strict=True):
            self._add_to_sums(variable.owner, wave, drawn)
        if self.keeps_motion and variable.motion is not None and self._resolves(variable.motion):
            self.waves.setdefault(variable.owner, []).append((variable.motion, turned))
        elif self.keeps_motion:
            for wave, drawn in zip(effects, turned, strict=True):
                self._add_effects(variable.owner, wave, drawn)

    def _resolves(self, motion: ToneMotion) -> bool:
        """Whether the nodes over the aperture are close enough for the effects of a sinusoidal motion."""
        angle = 2 * math.pi * motion.frequency * float(self.exact.half[0])
        return 2 * len(self.exact.times) - 1 >= angle + _ORDERS_BESIDE_TONE_COUNT

    def _add_to_sums(self, owner: str, effects: tuple[float, ...], drawn: Floats) -> None:
        targets = [(total, column) for column, total in self.totals.items()]
        if self.phases:
            targets.insert(0, (self.phases[owner], 0))
        if self.hidden:
            targets += [(phase, FIRST_HIDDEN_INDEX + index) for index, phase in enumerate(self.hidden[owner])]
        for target, column in targets:
            if effects[column]:
                np.multiply(drawn, effects[column], out=self._scaled)
                target += self._scaled

    def _add_motion(self, owner: str, source: ErrorSource, size: float, drawn: Floats) -> None:
        if source.is_time_tag:
            tags = self._kept(self.tags, owner, (2,))
            for platform in source.platforms:
                tags[platform] += size * drawn
        elif source.is_registered:
            self.registered.setdefault(owner, []).append((source, size * drawn))
        elif source.is_position:
            motion = self._kept(self.motion, owner, (2, 3, 3))
            for platform in source.platforms:
                for order, vector in enumerate(source.state_of(platform)):
                    for axis, component in enumerate(vector):
                        if component:
                            motion[platform, order, axis] += size * component * drawn
        elif source.clock is not None:
            self._kept(self.clock, owner, (4,))[:] += np.multiply.outer(size * np.array(source.clock), drawn)
        else:
            self._add_effects(owner, (size, *[0.0] * (self.effect_count - 1)), drawn)

    def _add_effects(self, owner: str, effects: tuple[float, ...], drawn: Floats) -> None:
        self._kept(self.alone, owner, (self.effect_count,))[:] += np.multiply.outer(effects, drawn)

    def _kept(self, where: dict[str, Floats], owner: str, shape: tuple[int, ...]) -> Floats:
        if owner not in where:
            where[owner] = np.zeros((*shape, self.size))
        return where[owner]

    def square(self, judged: HeldSum) -> Floats:
        """Square of the error that a requirement limits, computed by the linear model, (draws,).

        The unit is the square of the unit of the requirement. The next call overwrites the returned array.
        """
        square = self._square
        if judged.columns == (0,):
            square.fill(0.0)
            for owner, phase in self.phases.items():
                if owner in judged.owners:
                    square += phase
            square *= square
            if judged.hides:
                hidden = _sum(self.hidden, judged.owners, np.zeros((0, self.size)))
                square += judged.gain**2 * np.square(hidden).sum(axis=0)
            return square
        first, *more_columns = judged.columns
        np.multiply(self.totals[first], self.totals[first], out=square)
        for column in more_columns:
            np.multiply(self.totals[column], self.totals[column], out=self._scaled)
            square += self._scaled
        return square

    def exact_square(self, judged: HeldSum) -> Floats:
        """Square of the error that a requirement limits, computed from exact ranges, (draws,).

        The unit is the square of the unit of the requirement. The value is NaN for draws without an image.
        """
        owners = judged.owners
        if owners not in self._exact:
            self._exact[owners] = self._by_exact_ranges(owners)
        points, alone = self._exact[owners], _sum(self.alone, owners, np.zeros((self.effect_count, 1)))
        by_ranges = (points.quadratic, points.cubic, points.east, points.north)
        square = np.asarray(sum((by_ranges[column] + alone[column]) ** 2 for column in judged.columns))
        if judged.columns != (0,):
            return square
        hidden, alone = points.hidden, alone[FIRST_HIDDEN_INDEX:]
        if judged.hides and alone.any():
            # Exact ranges give the length of the vector of hidden phases, and first-order effects its direction.
            moving = _sum(self.hidden, owners, alone) - alone
            length = np.sqrt(np.square(moving).sum(axis=0))
            ratio = np.divide(hidden, length, out=np.zeros_like(hidden), where=length > 0)
            hidden = np.sqrt(np.square(ratio * moving + alone).sum(axis=0) + np.where(length > 0, 0.0, hidden**2))
        return square + (judged.gain * hidden) ** 2

    def _by_exact_ranges(self, owners: tuple[str, ...]) -> ImagePoints:
        times = self.exact.times[:, 0]
        powers = times[:, None] ** np.arange(3) / (1, 1, 2)  # of (22)
        clock_powers = SPEED_OF_LIGHT_MPS * times[:, None] ** np.arange(4)
        motion = _sum(self.motion, owners, np.broadcast_to(0.0, (2, 3, 3, self.size)))
        tags = _sum(self.tags, owners, np.broadcast_to(0.0, (2, self.size)))
        clock = _sum(self.clock, owners, np.broadcast_to(0.0, (4, self.size)))
        shifts: list[Floats | Sequence[Floats]] = [
            powers @ shift.swapaxes(0, 1) if shift.any() else NO_SHIFTS for shift in motion
        ]
        for platform, path in enumerate(self.paths):
            if path.fall is not None and motion[platform].any():
                of_units = path.fall.motions(path, self.exact.half, self.exact.sampling.places)[..., 0]
                shifts[platform] = list(np.einsum("kacq,kad->cqd", of_units, motion[platform]))
        for platform, tag in enumerate(tags):
            if tag.any():
                late = self.paths[platform].later(times[:, None], tag)
                shifts[platform] = [
                    shift + late_shift for shift, late_shift in zip(shifts[platform], late, strict=True)
                ]
        for source, sizes in (pair for owner in owners for pair in self.registered.get(owner, ())):
            for platform in source.platforms:
                moved = [component * sizes for component in source.way_of(platform)]
                shifts[platform] = [
                    shift + of_source for shift, of_source in zip(shifts[platform], moved, strict=True)
                ]
        range_error = clock_powers @ clock
        for vibration, turned in (pair for owner in owners for pair in self.waves.get(owner, ())):
            angle = 2 * math.pi * vibration.frequency * times
            course = vibration.size * (np.array((np.cos(angle), -np.sin(angle))).T @ turned)
            if vibration.platform_index is None:
                range_error = range_error + course
            else:
                shifts[vibration.platform_index] = [
                    shift + component * course
                    for shift, component in zip(shifts[vibration.platform_index], vibration.way, strict=True)
                ]
        return followed(self.exact, range_error, shifts, np.zeros(self.size, dtype=int))


def _sum(by_owner: Mapping[str, Floats], owners: Sequence[str], nothing: Floats) -> Floats:
    """Add the arrays of several owners. `by_owner` maps each owner to its array.

    Returns `nothing` if `by_owner` contains none of the owners.
    """
    of_owners = [by_owner[owner] for owner in owners if owner in by_owner]
    return sum(of_owners[1:], of_owners[0]) if of_owners else nothing


class Drawer:
    """Object that computes pieces of the draws, and keeps the state of the random streams between two pieces.

    The random streams are continued if the next piece follows after the previous piece in the same chunk.
    """

    def __init__(self, drawing: Drawing) -> None:
        self._drawing = drawing
        self._chunk, self._at = -1, 0
        self._streams: list[_Stream] = []
        normal = sum(variable.distribution == "normal" for variable in drawing.variables)
        self._fill_normal = _compiled() if drawing.draws * normal >= _MIN_COMPILED_DRAWS else _fill_normal
        self._buffer = np.empty(BLOCK_DRAWS)

    def tally(self, piece: DrawsPiece) -> Tally:
        """Draw the errors of a piece, and count the draws that meet the requirements."""
        drawing = self._drawing
        self._go_to(piece.start)
        count = len(drawing.judged)
        holds, imaged, squares, all_hold = [0] * count, [0] * count, [0.0] * count, 0
        sums: Sums | None = None
        for start in range(piece.start, piece.stop, BLOCK_DRAWS):
            size = min(BLOCK_DRAWS, piece.stop - start)
            if sums is None or sums.size != size:
                sums = None  # frees the memory of the previous sums first
                sums = Sums(drawing, size, adds=not drawing.is_exact, keeps_motion=drawing.is_exact)
            self._draw(sums)
            together = np.ones(size, dtype=bool)
            for index, requirement in enumerate(drawing.judged):
                square = sums.exact_square(requirement) if drawing.is_exact else sums.square(requirement)
                # The square of a draw without an image is NaN, so such a draw does not meet the requirement.
                holds_in_draw = square <= (requirement.limit * (1 + UTILIZATION_TOLERANCE_FRACTION)) ** 2
                holds[index] += int(np.count_nonzero(holds_in_draw))
                if drawing.is_exact:
                    square = square[np.isfinite(square)]
                imaged[index] += square.size
                squares[index] += float(square.sum())
                together &= holds_in_draw
            all_hold += int(np.count_nonzero(together))
        return Tally(tuple(holds), tuple(imaged), tuple(squares), all_hold)

    def _go_to(self, start: int) -> None:
        """Move the random streams to the draw with the number `start`.

        If the streams are in another chunk, or already past `start`, they restart at the beginning of the chunk that
        contains `start`.
        """
        chunk = start // self._drawing.chunk
        if chunk != self._chunk or start < self._at:
            self._chunk, self._at = chunk, chunk * self._drawing.chunk
            self._streams = [
                _Stream(variable, self._drawing.seed, chunk, self._fill_normal)
                for variable in self._drawing.variables
            ]
        for stream in self._streams:
            stream.skip(start - self._at, self._buffer)
        self._at = start

    def _draw(self, sums: Sums) -> None:
        sums.clear()
        drawn = self._buffer[: sums.size]
        for variable, stream in zip(self._drawing.variables, self._streams, strict=True):
            stream.fill(drawn)
            sums.add(variable, drawn)
        self._at += sums.size


def _needs_exact_ranges(drawing: Drawing) -> bool:
    """Whether exact ranges and the linear model differ by more than 1 % of a limit in any draw of a sample.

    Both include the hidden phase, which the bandwidth and the turn of the line of sight do not resolve.
    """
    judged = [requirement._replace(hides=requirement.columns == (0,)) for requirement in drawing.judged]
    drawing = drawing._replace(judged=tuple(judged))
    sums = Sums(drawing, _LINEARITY_DRAWS, adds=True, keeps_motion=True)
    drawn = np.empty(_LINEARITY_DRAWS)
    for variable in drawing.variables:
        _Stream(variable, drawing.seed).fill(drawn)
        sums.add(variable, drawn)
    for requirement in drawing.judged:
        linear, exact = np.sqrt(sums.square(requirement)), np.sqrt(sums.exact_square(requirement))
        if not np.all(np.abs(exact - linear) <= _LINEARITY_TOLERANCE_FRACTION * requirement.limit):
            return True
    return False


def _fill_normal(generator: np.random.Generator, out: Floats) -> None:
    generator.standard_normal(out=out)


@cache
def _compiled() -> Callable[[np.random.Generator, Floats], None]:
    """Choose the function that fills an array with normal draws: compiled by Numba if possible, or from NumPy.

    Numba is not used if it is not installed, if there is little memory, or if it cannot store compiled code.
    """
    if not is_spacious():
        return _fill_normal
    try:
        from numba import njit

        fill: Callable[[np.random.Generator, Floats], None] = njit(cache=True, nogil=True)(_fill_each)
    except (ImportError, RuntimeError):  # not installed, or nowhere to keep what it compiles
        return _fill_normal
    return fill


def _fill_each(generator: np.random.Generator, out: Floats) -> None:
    """Fill an array with normal draws, in a loop that Numba compiles.

    The draws are bit-identical to the draws of NumPy. The loop takes two thirds of the time that NumPy needs.
    """
    for index in range(out.size):
        out[index] = generator.standard_normal()


class _Stream:
    """Random stream of one variable in one chunk.

    Each variable has its own stream, so that an additional error in the file does not change the draws of existing
    errors. The stream of the first chunk is seeded with the seed of the drawing and the bytes of the variable's id.
    Later chunks use child streams with an additional key. This key is larger than any byte, so that a child stream
    never equals the stream of a variable with a longer id.
    """

    def __init__(
        self,
        variable: Variable,
        seed: int,
        chunk: int = 0,
        fill_normal: Callable[[np.random.Generator, Floats], None] = _fill_normal,
    ) -> None:
        child = (_AFTER_BYTES + chunk,) if chunk else ()
        self._bits = np.random.PCG64(np.random.SeedSequence([seed, *variable.id.encode()], spawn_key=child))
        self._generator = np.random.Generator(self._bits)
        self._distribution, self._fill_normal = variable.distribution, fill_normal

    def fill(self, out: Floats) -> None:
        """Fill an array (draws,) with the next draws of the variable."""
        if self._distribution == "normal":
            self._fill_normal(self._generator, out)
            return
        if self._distribution == CONSTANT:
            out.fill(1.0)
            return
        self._generator.random(out=out)
        if self._distribution == "tone":  # a phase
            out *= 2 * math.pi
            return
        out -= 0.5
        if self._distribution == "uniform":
            out *= math.sqrt(12)
        else:  # a bound: full size, with either sign equally often
            np.copysign(1.0, out, out=out)

    def skip(self, count: int, buffer: Floats) -> None:
        """Skip `count` draws of the stream.

        A normal draw uses a varying number of random numbers, so normal draws are made and discarded. A draw from any
        other distribution uses exactly one random number.
        """
        if self._distribution != "normal":
            self._bits.advance(count)
            return
        for start in range(0, count, buffer.size):
            self.fill(buffer[: count - start])
