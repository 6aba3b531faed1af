"""Effect of one unit of an error on the range history and the image, by both models; its subject and its name.

Effects are those of Rigling & Moses (Tables I and II), and of the full model, which lets the line of sight turn and
counts what the displacement of the image adds (`ranges.exact_ranges`).
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bisar_budget import evaluators, phrases
from bisar_budget.faults import KeyPath
from bisar_budget.geometry import BistaticGeometry, GroundVector, PlatformState, Vector
from bisar_budget.phrases import Note
from bisar_budget.ranges.exact_ranges import Effect, FullEffect

if TYPE_CHECKING:
    from bisar_budget.mission.instruments import Overridden

MOTION = ("position", "velocity", "acceleration")  # kinds of error that a platform's measured path can have


class Subject(NamedTuple):
    """The thing that a row or an error is about. `subject` makes it, with its id; nobody reads an id to find out.

    `owner` is the one whose share it counts against: transmitter, receiver, clock, or mission for what is nobody's.
    `kind` is position, velocity, acceleration, time_tag, vibration, timing, propagation, dispersion, terrain, other,
    specification, or the name of a sum. `axis` is the axis of `frame`, the term of the clock, the figure of a sensor
    or the air, the name of another error, the key that is specified, the sort of a vibration, and `entry` the place
    of one in the file.
    """

    id: str
    owner: str
    kind: str
    axis: str = ""
    frame: str = "scene"
    entry: int | None = None


@cache
def subject(owner: str, kind: str, axis: str = "", frame: str = "scene", entry: int | None = None) -> Subject:
    """Name an error or a sum as the contract does."""
    if kind in ("timing", "other", "specification"):  # of one owner each
        parts = [kind, axis]
    elif kind == "propagation":  # of one air over both legs, or of one leg
        parts = [kind, "" if owner == "mission" else owner, axis]
    elif kind == "dispersion":
        parts = ["propagation", kind]
    elif owner == "clock":
        parts = ["timing", kind]
    elif owner == "mission" and kind in (*MOTION, "time_tag", "random"):
        parts = ["common", kind, axis]
    else:
        parts = [owner, kind, axis, "" if entry is None else str(entry)]
    return Subject(".".join(filter(None, parts)), owner, kind, axis, frame, entry)


PLATFORMS = ("transmitter", "receiver")
MOTION_UNITS = dict(zip(MOTION, ("m", "m/s", "m/s^2"), strict=True))
CLOCK_UNITS = {"constant": "s", "linear": "s/s", "quadratic": "1/s", "cubic": "1/s^2"}  # t̃₀ … t̃₃ of (1)
NOWHERE: Vector = (0.0, 0.0, 0.0)  # direction of what is no motion


def override_notes(platform: str, overridden: Sequence["Overridden"], *figures: str) -> tuple[Note, ...]:
    """Say which figures of parts the file replaces, of these or of all."""
    return tuple(
        phrases.overrides_a_part(f"platforms.{platform}.{figure.key}", figure.text, figure.part)
        for figure in overridden
        if not figures or figure.figure in figures
    )


def plain(column: Any, case: int = 0) -> float:
    """The number of a case, by its place; one that all cases have is that of each."""
    if not isinstance(column, np.ndarray):
        return float(column)
    return float(column.item(case if column.size > 1 else 0))


def _plain_way(component: Any) -> Any:
    """A component of a direction in one case; of one that turns all nodes."""
    return component if np.ndim(component) > 1 else plain(component)


class ErrorSource(NamedTuple):
    """One error: what it is, how large it is declared, what one unit of it does; in one case, or in many as arrays.

    `declared` is signed and includes the
    coverage factor; None where the file is silent. `is_independent` marks the errors as the file states
    them: sums and root-sum-squares run over these alone, so that an error stated along the track is not
    counted again by its components along the scene's axes. `direction` is a unit vector of the scene, zero for
    what is no motion; of the mission's own it is that of both platforms, unless the receiver has another one. That of
    a time tag is the velocity at the nodes of the aperture, (nodes, cases), along which a small one moves. [m/s]
    `clock` are t̃₀ … t̃₃ of a unit of an error of the clock, zeros where nothing of it is heard; None for any other
    error.
    """

    subject: Subject
    unit: str
    declared: Any
    path: KeyPath
    effect: Effect
    full: FullEffect
    direction: Any
    equation: str
    no_limit: Note
    evidence: str | None = None
    is_independent: bool = True
    notes: tuple[Note, ...] = ()
    clock: tuple[Any, ...] | None = None
    of_receiver: Any = None

    @property
    def id(self) -> str:
        """That of its row."""
        return self.subject.id

    def in_one_case(self) -> "ErrorSource":
        """The same with plain numbers in the place of arrays of one case."""
        effect, full = Effect._make(map(plain, self.effect)), FullEffect._make(map(plain, self.full))
        declared = None if self.declared is None else plain(self.declared)
        clock = self.clock and tuple(map(plain, self.clock))
        direction, of_receiver = (way and tuple(map(_plain_way, way)) for way in (self.direction, self.of_receiver))
        return self._replace(
            declared=declared, effect=effect, full=full, direction=direction, of_receiver=of_receiver, clock=clock
        )

    def direction_of(self, platform_index: int) -> Any:
        """Direction in which it moves a platform."""
        return self.of_receiver if platform_index == 1 and self.of_receiver is not None else self.direction

    @property
    def owner(self) -> str:
        """Whose share it counts against: transmitter, receiver, clock or mission."""
        return self.subject.owner

    @property
    def is_motion(self) -> bool:
        """Whether it moves platforms, or the clock: what only is a phase displaces nothing."""
        return self.unit != "rad"

    @property
    def is_time_tag(self) -> bool:
        """Whether it takes a path for what it is later: not proportional to its size where the path turns."""
        return self.subject.kind == "time_tag"

    @property
    def is_covered(self) -> bool:
        """Whether the coverage factor is in what is declared: not of the terrain, and not of what only is a phase."""
        return self.subject.kind in (*MOTION, "time_tag") or self.clock is not None

    @property
    def is_heard(self) -> bool:
        """Whether data have it: of a clock, whether what synchronises it leaves any."""
        return self.clock is None or any(map(np.any, self.clock))

    @property
    def displaces(self) -> bool:
        """Whether it moves platforms, or a clock that is listened to."""
        return self.is_motion and self.is_heard

    @property
    def is_position(self) -> bool:
        """Whether it is an error of a platform's measured path, or of both."""
        return self.is_motion and self.clock is None

    @property
    def platforms(self) -> tuple[int, ...]:
        """Places of the platforms whose position it is an error of; one of the mission's own is of both."""
        owners = (self.owner,) if self.owner in PLATFORMS else PLATFORMS
        return tuple(map(PLATFORMS.index, owners)) if self.is_position else ()

    @property
    def is_common(self) -> bool:
        """Whether it is one error of the paths of both platforms."""
        return self.owner == "mission" and self.subject.kind in (*MOTION, "time_tag")


# ---------------------------------------------------------------------- pieces of a range error, (26) to (29)
PRINTED, TRUE = "v/R as printed, ranges held", "v⊥/R, lines of sight as they turn"


class LinePiece(NamedTuple):
    """A piece of the range error: centre τ_i from mid-aperture [s], value (27) [m] and slope (28) [m/s] there."""

    time: float
    value: float
    slope: float


def gradients_of(model: str) -> str:
    """Say by which gradients of range and Doppler a model has Q_i: what is printed, or what is true."""
    return PRINTED if model == "published" else TRUE


def indicated_point(
    geometry: BistaticGeometry, piece: LinePiece, model: str, seen_from: GroundVector = (0.0, 0.0)
) -> GroundVector:
    """Ground point that a piece of range error indicates, (29), relative to the scatterer. [m]

    Parameters
    ----------
    geometry : BistaticGeometry
        Of the whole aperture.
    piece : LinePiece
        Of the range error; what the scatterer itself has is no part of it.
    model : str
        `published`: Q_i of (30) as printed, platforms where they are at τ_i, speeds over ranges held constant. Any
        other: the gradients that the lines of sight have at τ_i.
    seen_from : (2,)
        Where the scatterer lies. [m]

    Returns
    -------
    (2,)
        East and north.

    Raises
    ------
    ZeroDivisionError
        Range and Doppler gradients are parallel at τ_i.
    """
    east, north = seen_from
    state_numbers, look, rate = [], [0.0, 0.0], [0.0, 0.0]
    for state in (geometry.transmitter, geometry.receiver):
        (x, y, z), velocity = state.at(piece.time)
        then = PlatformState(position=(x - east, y - north, z), velocity=velocity)
        slant_range = math.dist(state.position, (east, north, 0.0))
        state_numbers += [x - east, y - north, *velocity[:2], slant_range]
        for axis in range(2):
            look[axis] += then.look[axis]
            rate[axis] += then.look_rate[axis]
    if model == "published":
        (a, b), (c, d), (determinant,) = evaluators.published_ground_inverse(*state_numbers)
    else:
        (a, b), (c, d), (determinant,) = evaluators.full_ground_inverse(*look, *rate)
    return (
        (a * piece.value + b * piece.slope) / determinant,
        (c * piece.value + d * piece.slope) / determinant,
    )
