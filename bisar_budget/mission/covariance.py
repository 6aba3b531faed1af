"""Position-velocity covariance of a platform's motion error: readers of its two forms in a mission file, and checks.

A mission file states either a 6 x 6 covariance matrix, or sigmas with their correlations. Both are stored as sigmas
and a correlation matrix. A correlation matrix has no units, so a single tolerance suits positions and velocities.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, NamedTuple

import numpy as np

from bisar_budget import units
from bisar_budget.error_kinds.path_kinds import MEASURED_KINDS
from bisar_budget.faults import KeyPath, Problem
from bisar_budget.geometry import FRAME_AXES, Vector
from bisar_budget.json_types import Definitions, JsonObject
from bisar_budget.mission.readers import (
    INVALID,
    Invalid,
    Key,
    Quantity,
    Reader,
    Report,
    Section,
    Triple,
    are_valid,
    either,
    read_part,
)

MOTION_KINDS = tuple(kind.name for kind in MEASURED_KINDS)
MATRIX_SIZE = 6

# Files have rounded matrices. With six decimals, each correlation is wrong by up to 5e-7. With five correlations in
# each row, an eigenvalue is then wrong by up to 2.5e-6 (Weyl's inequality).
_ELEMENT_TOLERANCE_FRACTION = 1e-6
EIGENVALUE_TOLERANCE_FRACTION = 2.5e-6

_AXIS = {name: index for names in FRAME_AXES.values() for index, name in enumerate(names)}
_Matrix = tuple[tuple[float, ...], ...]


class Covariance(NamedTuple):
    """Covariance of position and velocity error along the axes of their frame.

    `sigmas` (6,) are the 1-sigma errors of position [m] and velocity [m/s]. `correlation` (6, 6) has a diagonal of 1
    and is positive semi-definite to six decimals. `is_matrix` is True if the file states the 6 x 6 matrix. `pairs`
    are the names of the correlated pairs as written in the file, such as `position.x-velocity.x`.
    """

    sigmas: tuple[float, ...]
    correlation: _Matrix
    is_matrix: bool
    pairs: tuple[str, ...] = ()

    def of(self, kind: str) -> Vector:
        """1-sigma errors along the axes of the frame; `kind` is "position" [m] or "velocity" [m/s]."""
        first = 3 * MOTION_KINDS.index(kind)
        a, b, c = self.sigmas[first : first + 3]
        return (a, b, c)

    def block(self, kind: str) -> list[tuple[float, ...]]:
        """Correlation matrix (3, 3) of the errors along the three axes; `kind` is "position" or "velocity"."""
        first = 3 * MOTION_KINDS.index(kind)
        return [row[first : first + 3] for row in self.correlation[first : first + 3]]

    def path(self, kind: str, axis: int) -> KeyPath:
        """Key path of the 1-sigma error along an axis, relative to `covariance` in the file.

        If the file states the 6 x 6 matrix, this is the path of the variance.
        """
        index = 3 * MOTION_KINDS.index(kind) + axis
        return (index, index) if self.is_matrix else (kind, axis)

    def has_correlations(self) -> bool:
        """Whether any two of the six errors are correlated."""
        return any(rho for i, row in enumerate(self.correlation) for rho in row[:i])


def _problems(correlation: _Matrix) -> Iterator[Problem]:
    """Yield a problem if a correlation matrix is not positive semi-definite."""
    smallest = float(np.linalg.eigvalsh(correlation)[0])
    if smallest <= -EIGENVALUE_TOLERANCE_FRACTION:
        yield Problem(
            f"is not positive semi-definite: the correlation matrix has the eigenvalue {smallest:.3g}",
            "no error has such a covariance",
            "Too few digits? Correlations of nearly dependent errors take six decimals",
        )


def _rows(
    value: object, readers: Sequence[Sequence[Reader[float]]], path: KeyPath, report: Report, otherwise: str
) -> list[tuple[float, ...]] | Invalid:
    """Read a 6 x 6 matrix with a separate reader for each element, and return its six rows.

    If the matrix is invalid, reports the faults and returns `INVALID`. `otherwise` describes the other form of value
    that the key accepts; it is part of the error message about a wrong shape.
    """
    if not isinstance(value, list) or len(value) != MATRIX_SIZE:
        given = f", {len(value)} given" if isinstance(value, list) else ""
        accepted = f"accepted: x, y, z of position, then of velocity, or {otherwise}"
        report(path, Problem(f"must be 6 rows of 6 numbers{given}", accepted))
        return INVALID
    broken = [index for index, row in enumerate(value) if not isinstance(row, list) or len(row) != MATRIX_SIZE]
    for index in broken:
        given = f", {len(value[index])} given" if isinstance(value[index], list) else ""
        report((*path, index), Problem(f"must be a row of 6 numbers{given}"))
    if broken:
        return INVALID
    rows = [
        tuple(
            [
                read_part(reader, item, (*path, i, j), report)
                for j, (item, reader) in enumerate(zip(row, of_row, strict=True))
            ]
        )
        for i, (row, of_row) in enumerate(zip(value, readers, strict=True))
    ]
    valid_rows = [row for row in rows if are_valid(row)]
    return valid_rows if len(valid_rows) == MATRIX_SIZE else INVALID


def _report_all(faults: Sequence[Problem], path: KeyPath, report: Report) -> bool:
    """Report all faults of the value at `path`; returns True if there are any."""
    for fault in faults:
        report(path, fault)
    return bool(faults)


def _asymmetries(rows: Sequence[Sequence[float]], scales: Sequence[float]) -> Iterator[Problem]:
    """Yield a problem for each element of a 6 x 6 matrix that differs from the element mirrored at the diagonal.

    The tolerance is a fraction of the product of two `scales`: the scales of the element's row and column.
    """
    for i in range(MATRIX_SIZE):
        for j in range(i):
            if abs(rows[i][j] - rows[j][i]) > _ELEMENT_TOLERANCE_FRACTION * scales[i] * scales[j]:
                yield Problem(f"is not symmetric: row {j + 1}, column {i + 1} is {rows[j][i]:.7g}", at=(i, j))


def _symmetric(rows: Sequence[Sequence[float]]) -> _Matrix:
    """Make an exact correlation matrix from a rounded one: symmetric, within ±1, and with a diagonal of 1.

    Each element is replaced by the mean of itself and its mirror element.
    """
    return tuple(
        tuple(1.0 if i == j else max(-1.0, min(1.0, (rows[i][j] + rows[j][i]) / 2)) for j in range(MATRIX_SIZE))
        for i in range(MATRIX_SIZE)
    )


_BLOCKS = [
    Quantity(dimension, ge=-1e18, le=1e18)
    for dimension in (units.POSITION_VARIANCE, units.POSITION_VELOCITY, units.VELOCITY_VARIANCE)
]
_ELEMENTS = [[_BLOCKS[(i > 2) + (j > 2)] for j in range(MATRIX_SIZE)] for i in range(MATRIX_SIZE)]


class _MatrixReader(Reader[Covariance]):
    """The 6 x 6 matrix: m², m²/s and m²/s², position before velocity, each in the order of the frame's axes.

    The class reads such a matrix from a mission file. It is the joint covariance of the position error and the
    velocity error.
    """

    def read(self, value: object, path: KeyPath, report: Report) -> Covariance | Invalid:
        """Read the elements of a covariance matrix, and check that the matrix is a valid covariance."""
        rows = _rows(value, _ELEMENTS, path, report, "a mapping with position, velocity and correlation")
        if rows is INVALID:
            return INVALID
        faults = [Problem("is a negative variance", at=(i, i)) for i in range(MATRIX_SIZE) if rows[i][i] < 0]
        if not faults:
            sigmas = [math.sqrt(rows[i][i]) for i in range(MATRIX_SIZE)]
            faults += [*_asymmetries(rows, sigmas), *_excesses(rows, sigmas)]
        if not faults:
            ratios = [
                [x / (a * b) if a and b else 0.0 for x, b in zip(row, sigmas, strict=True)]
                for row, a in zip(rows, sigmas, strict=True)
            ]
            correlation = _symmetric(ratios)
            faults = list(_problems(correlation))
        return (
            INVALID if _report_all(faults, path, report) else Covariance(tuple(sigmas), correlation, is_matrix=True)
        )

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an array of six rows with six elements each."""
        return _matrix_schema([[element.schema(definitions) for element in row] for row in _ELEMENTS])


def _excesses(rows: Sequence[Sequence[float]], sigmas: Sequence[float]) -> Iterator[Problem]:
    """Yield a problem for each covariance whose absolute value exceeds the product of its two sigmas."""
    for i in range(MATRIX_SIZE):
        for j in range(i):
            most = sigmas[i] * sigmas[j]
            if abs(rows[i][j]) > most * (1 + _ELEMENT_TOLERANCE_FRACTION):
                problem = (
                    f"makes a correlation of {rows[i][j] / most:.4g}, beyond ±1"
                    if most
                    else "is a covariance with an error whose variance is 0"
                )
                accepted = f"accepted: -{most:.4g} to {most:.4g}" if most else "accepted: 0"
                yield Problem(problem, accepted, at=(i, j))


def _matrix_schema(elements: Sequence[Sequence[JsonObject]]) -> JsonObject:
    def six(items: Sequence[JsonObject]) -> JsonObject:
        return {"type": "array", "items": items, "minItems": MATRIX_SIZE, "maxItems": MATRIX_SIZE}

    return six([six(row) for row in elements])


class _Correlations(NamedTuple):
    matrix: _Matrix
    pairs: tuple[str, ...] = ()


class _CorrelationReader(Reader[_Correlations]):
    """Correlations of named pairs of errors, zero for other pairs; or the 6 x 6 matrix with a diagonal of 1.

    The class reads either of these two forms from a mission file.
    """

    _NUMBER = Quantity(units.RATIO, ge=-1, le=1)

    def read(self, value: object, path: KeyPath, report: Report) -> _Correlations | Invalid:
        """Read a correlation matrix or the correlations of pairs, and check that it is positive semi-definite."""
        read = self._pairs(value, path, report) if isinstance(value, dict) else self._matrix(value, path, report)
        if read is INVALID:
            return INVALID
        faults = list(_problems(read.matrix))
        return INVALID if _report_all(faults, path, report) else read

    def _matrix(self, value: object, path: KeyPath, report: Report) -> _Correlations | Invalid:
        readers = [[self._NUMBER] * MATRIX_SIZE] * MATRIX_SIZE
        rows = _rows(value, readers, path, report, "pairs such as position.x-velocity.x: 0.3")
        if rows is INVALID:
            return INVALID
        faults = [
            Problem("an error's correlation with itself is 1", at=(i, i))
            for i in range(MATRIX_SIZE)
            if rows[i][i] != 1
        ]
        faults += _asymmetries(rows, [1.0] * MATRIX_SIZE)
        return INVALID if _report_all(faults, path, report) else _Correlations(_symmetric(rows))

    def _pairs(self, value: dict[str, object], path: KeyPath, report: Report) -> _Correlations | Invalid:
        rows = [[float(i == j) for j in range(MATRIX_SIZE)] for i in range(MATRIX_SIZE)]
        named: dict[frozenset[int | None], str] = {}
        is_valid = True
        for key, text in value.items():
            number = read_part(self._NUMBER, text, (*path, key), report)
            indices = [error_index(name.strip()) for name in key.split("-")]
            first, second = indices if len(indices) == 2 else (None, None)
            pair = frozenset((first, second))
            if first is None or second is None:
                accepted = "accepted: two errors joined by -, such as position.x-velocity.x"
                report((*path, key), Problem("is not a known key", accepted, is_of_key=True))
            elif first == second:
                report((*path, key), Problem("an error's correlation with itself is 1", hint="Remove it"))
            elif pair in named:
                report((*path, key), Problem(f"is the pair {named[pair]} again", "accepted: each once"))
            elif number is not INVALID:
                named[pair] = key
                rows[first][second] = rows[second][first] = number
                continue
            is_valid = False
        return _Correlations(tuple(map(tuple, rows)), tuple(named.values())) if is_valid else INVALID

    def below(self, part: str) -> Reader[object] | None:
        """Reader of the value at a key such as `position.x-velocity.x`; None if the key is not a pair of errors."""
        return self._NUMBER if "-" in part else None

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an object with pairs as keys, or an array of six rows with six elements each."""
        number = self._NUMBER.schema(definitions)
        name = rf"(?:{'|'.join(MOTION_KINDS)})\.(?:{'|'.join(_AXIS)})"
        pairs = {
            "type": "object",
            "patternProperties": {rf"^\s*{name}\s*-\s*{name}\s*$": number},
            "additionalProperties": False,
        }
        return {"anyOf": [pairs, _matrix_schema([[number] * MATRIX_SIZE] * MATRIX_SIZE)]}


def error_index(name: str) -> int | None:
    """Index, 0 to 5, of an error such as `velocity.along` in the 6 x 6 matrix; None if there is no such error."""
    kind, _, axis = name.partition(".")
    return 3 * MOTION_KINDS.index(kind) + _AXIS[axis] if kind in MOTION_KINDS and axis in _AXIS else None


class Sigmas(NamedTuple):
    """One sigma of position and velocity error along the frame's axes, and their correlations."""

    position: Annotated[
        Vector, Key(Triple(Quantity(units.LENGTH, ge=0, le=1e9), or_scalar=True), "One sigma at the midpoint.")
    ]
    velocity: Annotated[
        Vector, Key(Triple(Quantity(units.SPEED, ge=0, le=1e6), or_scalar=True), "One sigma of the constant part.")
    ]
    correlation: Annotated[
        _Correlations,
        Key(
            _CorrelationReader(),
            "Correlations of pairs, such as position.x-velocity.x: 0.3, or a 6 x 6 matrix; omitted: none.",
        ),
    ] = _Correlations(_symmetric([[0.0] * MATRIX_SIZE] * MATRIX_SIZE))


class _SigmasReader(Section[Sigmas | Covariance]):
    def read(self, value: object, path: KeyPath, report: Report) -> Covariance | Invalid:
        """Read a section with sigmas and correlations, and return it as a `Covariance`."""
        sigmas_section = super().read(value, path, report)
        if not isinstance(sigmas_section, Sigmas):
            return INVALID
        sigmas = (*sigmas_section.position, *sigmas_section.velocity)
        return Covariance(
            sigmas, sigmas_section.correlation.matrix, is_matrix=False, pairs=sigmas_section.correlation.pairs
        )


COVARIANCE = either(dict, _SigmasReader(Sigmas), _MatrixReader())


def misplaced_axes(covariance: Covariance, frame: str) -> Iterator[Problem]:
    """Yield a problem for each correlated pair that names an axis which `frame` does not have.

    The paths of the problems are relative to `motion_error`.
    """
    for pair in covariance.pairs:
        for name in pair.split("-"):
            axis = name.strip().partition(".")[2]
            if axis not in FRAME_AXES[frame]:
                yield Problem(
                    "is not a known key",
                    f"accepted in the {frame} frame: {', '.join(FRAME_AXES[frame])}",
                    at=("covariance", "correlation", pair),
                    is_of_key=True,
                )
                break
