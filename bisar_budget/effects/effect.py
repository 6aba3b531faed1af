"""Owner, kind and axis of an error (`Subject`), and the effect of one unit of the error in both models.

The published effects follow Rigling & Moses (Tables I and II). The full model includes the turn of the line of sight
and the phase that the displacement of the image adds (`ranges.exact_ranges`).
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bisar_budget import evaluators, phrases
from bisar_budget.arrays import PerCase, PerCaseFlag
from bisar_budget.error_kinds.kind import ErrorKind, SourceKind
from bisar_budget.error_kinds.path_kinds import STATE_KINDS
from bisar_budget.error_kinds.registry import kind_of
from bisar_budget.faults import KeyPath
from bisar_budget.geometry import (
    BistaticGeometry,
    GroundVector,
    PlatformState,
    Vector,
    VectorArrays,
    Vectors,
    plain_vector,
)
from bisar_budget.phrases import Note
from bisar_budget.ranges.exact_ranges import Effect, FullEffect

if TYPE_CHECKING:
    from bisar_budget.mission.instruments import Overridden

MOTION = tuple(kind.name for kind in STATE_KINDS)


class Subject(NamedTuple):
    """Subject of a row or an error: owner, kind and axis.

    The function `subject` creates a subject together with its id. Code reads the fields and never parses an id.
    `owner` is the part of the system whose share of the budget the error uses: `transmitter`, `receiver` or `clock`.
    It is `mission` if the error belongs to no part of the system. `kind` is the name of a kind in `error_kinds`: a
    kind of error, such as position, velocity, acceleration, time_tag, vibration, timing, propagation, terrain or
    other, or a kind of sum, such as dispersion or specification.

    The meaning of `axis` depends on the kind. It is an axis of `frame` for a motion error, the term of the clock for
    a timing error, the name of the declared value for an error of a sensor or of the atmosphere, the type for a
    vibration, the name in the file for an error of the kind `other`, and the key of the error for a specification.
    `entry` is the index of the error if the file states it in a list.
    """

    id: str
    owner: str
    kind: str
    axis: str = ""
    frame: str = "scene"
    entry: int | None = None

    @property
    def facts(self) -> ErrorKind:
        """The `ErrorKind` of the subject, with the properties that commands need."""
        return kind_of(self.kind)

    @property
    def source_kind(self) -> SourceKind:
        """The `SourceKind` of the subject, which must belong to an error and not to a sum."""
        facts = self.facts
        assert isinstance(facts, SourceKind), "the subject is that of a sum"
        return facts


@cache
def subject(owner: str, kind: str, axis: str = "", frame: str = "scene", entry: int | None = None) -> Subject:
    """Create the subject of an error or a sum, together with the id of its row."""
    return Subject(kind_of(kind).row_id(owner, axis, entry), owner, kind, axis, frame, entry)


PLATFORMS = ("transmitter", "receiver")
_PLATFORMS_OF = {name: (index,) for index, name in enumerate(PLATFORMS)}  # indices by owner of an error
NOWHERE: Vector = (0.0, 0.0, 0.0)  # direction of an error that is no motion


def override_notes(platform: str, overridden: Sequence["Overridden"], *figures: str) -> tuple[Note, ...]:
    """Notes on values of a catalogue part that the mission file overrides, one note for each value.

    `figures` are the keys of the values to include. By default, all values in `overridden` are included.
    """
    return tuple(
        phrases.note("overrides-a-part", key=f"platforms.{platform}.{figure.key}", text=figure.text, part=figure.part)
        for figure in overridden
        if not figures or figure.figure in figures
    )


def plain(column: PerCase | PerCaseFlag, case: int = 0) -> float:
    """Return the value for the case with the given index, as a float.

    A single number, or an array with a single entry, holds for every case.
    """
    if not isinstance(column, np.ndarray):
        return float(column)
    return float(column.item(case if column.size > 1 else 0))


def _plain_way(component: PerCase, case: int) -> PerCase:
    """Convert a component of a direction to a float, for the case with the given index.

    A component that varies over the aperture, (nodes, cases), becomes an array (nodes, 1).
    """
    if np.ndim(component) < 2:
        return plain(component, case)
    return np.asarray(component)[..., [case]] if np.shape(component)[-1] > 1 else component


def _plain_ways(direction: Vectors, case: int = 0) -> Vectors:
    x, y, z = direction
    return (_plain_way(x, case), _plain_way(y, case), _plain_way(z, case))


def _vector_in(vector: Vectors, case: int) -> Vector:
    x, y, z = vector
    return (plain(x, case), plain(y, case), plain(z, case))


def _shift_in(shift: VectorArrays, case: int) -> VectorArrays:
    """Select one case of the motion of a platform at the nodes; each component becomes (nodes, 1)."""
    x, y, z = (component[..., [case]] if component.shape[-1] > 1 else component for component in shift)
    return (x, y, z)


class ErrorSource(NamedTuple):
    """One error: its subject, its declared size, and the effect of one unit.

    Numbers are plain, or arrays over cases. `declared` is signed and includes the coverage factor. It is None if the
    file declares no size. `is_independent` is true for an error along an axis in which the file states it. Sums and
    root-sum-squares include only such errors. An error stated along the track is therefore not counted a second time
    through its components along the scene's axes.

    `bias` is the known, constant part of the error, signed, in the unit of the error. It adds to the part of size
    `declared`, which has either sign. The coverage factor does not apply to it.

    `direction` is a vector in the axes of the scene: the unit vector along which the error moves the platform, or
    zero if the error moves no platform. For a time tag error it is the velocity [m/s] at the nodes of the aperture,
    (nodes, cases), because a small time tag error moves the platform along its velocity. If the error is declared for
    the mission, and not for a single platform, `direction` applies to both platforms, unless `of_receiver` gives the
    receiver a direction of its own.

    `clock` has the coefficients t̃₀ … t̃₃ of one unit of a clock error. They are zero if synchronization removes the
    error. `clock` is None for any other error.

    `shifts` [m/unit] are the motions of both platforms over the aperture per unit of the error, (nodes, cases) for
    each axis. They are set for a registered kind of error. They are also set if a platform is in free fall, where the
    motion follows the dynamics of the orbit. Otherwise they are None.

    `rates` [(m/s)/unit] are velocities at mid-aperture per unit of a position error in the frame `ric`, if a platform
    is in free fall. Such an error has no velocity in inertial space, and therefore has a velocity in the axes of the
    scene, which rotate with the Earth. `rates` is None for all other errors.
    """

    subject: Subject
    unit: str
    declared: Any
    path: KeyPath
    effect: Effect
    full: FullEffect
    direction: Vectors
    equation: str
    no_limit: Note
    evidence: str | None = None
    is_independent: bool = True
    notes: tuple[Note, ...] = ()
    clock: tuple[PerCase, ...] | None = None
    of_receiver: Vectors | None = None
    shifts: tuple[VectorArrays, VectorArrays] | None = None
    rates: tuple[Vectors, Vectors] | None = None
    bias: PerCase = 0.0

    @property
    def id(self) -> str:
        """Id of the error's row."""
        return self.subject.id

    def in_one_case(self, case: int = 0) -> "ErrorSource":
        """Return the error for the case with the given index, with plain numbers in place of arrays over cases."""

        def number(value: PerCase) -> float:
            return plain(value, case)

        declared = None if self.declared is None else number(self.declared)
        of_receiver = None if self.of_receiver is None else _plain_ways(self.of_receiver, case)
        shifts, rates = self.shifts, self.rates
        return self._replace(
            declared=declared,
            effect=Effect._make(map(number, self.effect)),
            full=FullEffect._make(map(number, self.full)),
            direction=_plain_ways(self.direction, case),
            of_receiver=of_receiver,
            clock=self.clock and tuple(map(number, self.clock)),
            bias=number(self.bias),
            shifts=shifts and (_shift_in(shifts[0], case), _shift_in(shifts[1], case)),
            rates=rates and (_vector_in(rates[0], case), _vector_in(rates[1], case)),
        )

    def direction_of(self, platform_index: int) -> Vectors:
        """Direction in which the error moves the platform with the given index; its velocity for a time tag error."""
        return self.of_receiver if platform_index == 1 and self.of_receiver is not None else self.direction

    def way_of(self, platform_index: int) -> Any:
        """Motion of the platform with the given index per unit of the error, at the nodes of the aperture.

        The motion comes from `shifts`. If `shifts` is not set, the result is the direction of the error.
        """
        return self.direction_of(platform_index) if self.shifts is None else self.shifts[platform_index]

    def state_of(self, platform_index: int) -> tuple[Vectors, Vectors, Vectors]:
        """Position, velocity and acceleration error of a platform at mid-aperture per unit of the error.

        The three vectors are in m, m/s and m/s² per unit.
        """
        vectors: list[Vectors] = [NOWHERE, NOWHERE, NOWHERE]
        if self.rates is not None:
            vectors[1] = self.rates[platform_index]
        if self.kind.order is not None:
            vectors[self.kind.order] = self.direction_of(platform_index)
        return vectors[0], vectors[1], vectors[2]

    @property
    def owner(self) -> str:
        """Owner of the share that the error uses: transmitter, receiver, clock or mission."""
        return self.subject.owner

    @property
    def is_motion(self) -> bool:
        """Whether the error moves platforms or shifts the clock. It is false for a pure phase error."""
        return self.kind.moves != "image"

    @property
    def is_time_tag(self) -> bool:
        """Whether the error is a time tag error, which shifts the path of a platform in time.

        On a turning path the effect of such an error is not proportional to its size.
        """
        return self.kind.shifts_time

    @property
    def is_registered(self) -> bool:
        """Whether another package registered the kind of the error; the motion of the error is then in `shifts`."""
        return self.kind.is_registered

    @property
    def kind(self) -> SourceKind:
        """The `SourceKind` of the error, with the properties that commands need."""
        return self.subject.source_kind

    @property
    def is_covered(self) -> bool:
        """Whether the declared size includes the coverage factor.

        The result is false for terrain and for a pure phase error.
        """
        return self.kind.is_covered

    @property
    def is_heard(self) -> bool:
        """Whether the error appears in the radar data.

        The result is false for a clock error that the synchronization removes completely.
        """
        return self.clock is None or any(map(np.any, self.clock))

    @property
    def displaces(self) -> bool:
        """Whether the error can displace the image: a motion error, or a clock error that the data contain."""
        return self.is_motion and self.is_heard

    @property
    def is_position(self) -> bool:
        """Whether the error acts as a position error of one platform or of both platforms."""
        return self.is_motion and self.clock is None

    @property
    def platforms(self) -> tuple[int, ...]:
        """Indices of the platforms whose positions the error affects: 0 for the transmitter, 1 for the receiver.

        An error that is declared for the mission as a whole, and not for a single platform, affects the positions of
        both platforms. The result is empty for an error that moves no platform.
        """
        return _PLATFORMS_OF.get(self.owner, (0, 1)) if self.is_position else ()

    @property
    def is_common(self) -> bool:
        """Whether the paths of both platforms share the error."""
        return self.owner == "mission" and bool(self.kind.common_id_form)


# ---------------------------------------------------------------------- pieces of a range error, (26) to (29)
PRINTED, TRUE = "v/R as printed, ranges held", "v⊥/R, lines of sight as they turn"


class LinePiece(NamedTuple):
    """Piece of a range error over the aperture, approximated by a straight line.

    `time` [s] is the centre τ_i of the piece, counted from mid-aperture. According to equations (27) and (28) of
    Rigling & Moses, `value` [m] is the range error of the line at this time, and `slope` [m/s] is its rate.
    """

    time: float
    value: float
    slope: float


def gradients_of(model: str) -> str:
    """Short description of the gradients in a model's matrix Q_i: as in Rigling & Moses, or true gradients."""
    return PRINTED if model == "published" else TRUE


def indicated_point(
    geometry: BistaticGeometry, piece: LinePiece, model: str, seen_from: GroundVector = (0.0, 0.0)
) -> GroundVector:
    """Ground point, relative to the scatterer, that a piece of range error indicates. [m]

    It follows from equation (29) of Rigling & Moses.

    Parameters
    ----------
    geometry : BistaticGeometry
        Geometry of the whole aperture.
    piece : LinePiece
        Piece of the range error, without the range history of the scatterer itself.
    model : str
        For `published`, Q_i is taken from equation (30) as printed, with the platforms at their positions at τ_i and
        the slant ranges at mid-aperture. For any other name, the true range and Doppler gradients at τ_i are used.
    seen_from : (2,)
        Position of the scatterer, east and north. [m]

    Returns
    -------
    (2,)
        Position of the indicated point, east and north. [m]

    Raises
    ------
    ZeroDivisionError
        Range and Doppler gradients are parallel at τ_i, the centre of the piece.
    """
    east, north = seen_from
    state_numbers, look, rate = [], [0.0, 0.0], [0.0, 0.0]
    for state in (geometry.transmitter, geometry.receiver):
        position, velocity = map(plain_vector, state.at(piece.time))
        x, y, z = position
        then = PlatformState(position=(x - east, y - north, z), velocity=velocity)
        slant_range = math.dist(state.position, (east, north, 0.0))
        state_numbers += [x - east, y - north, *velocity[:2], slant_range]
        for axis in range(2):
            look[axis] += float(then.look[axis])
            rate[axis] += float(then.look_rate[axis])
    if model == "published":
        (a, b), (c, d), (determinant,) = evaluators.published_ground_inverse(*state_numbers)
    else:
        (a, b), (c, d), (determinant,) = evaluators.full_ground_inverse(*look, *rate)
    return (
        (a * piece.value + b * piece.slope) / determinant,
        (c * piece.value + d * piece.slope) / determinant,
    )
