"""Kinds of error: one object for each kind of error that a mission can have, and for each kind of sum of errors.

The object of a kind has the properties of the kind that commands need, so that no command compares names of kinds.
Where a subpackage computes something different for each kind, such as the steps of an explanation or a random time
series, it has one table of functions by kind. A test checks that the table is complete.

A package adds a kind with `register`, or with an entry point in the group `bisar_budget.kinds`. Entry points are read
only when a mission file or an option uses an unknown kind, because reading them takes longer than a check.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from bisar_budget import units
from bisar_budget.faults import MotionKindError, printable

if TYPE_CHECKING:
    from bisar_budget.arrays import Floats
    from bisar_budget.geometry import PlatformState

_Entry = TypeVar("_Entry")
ENTRY_POINT_GROUP = "bisar_budget.kinds"
_MAX_CHARACTERS = 300  # of the message of an exception of another package
# Words of row ids, and of groups of rows, that are no kinds: owners, sections and axes.
_TAKEN_OWNERS = ("transmitter", "receiver", "mission", "clock", "common", "scene")
_TAKEN_AXES = ("x", "y", "z", "along", "cross", "up", "line_of_sight", "radial", "in_track", "cross_track")
_TAKEN_NAMES = frozenset((*_TAKEN_OWNERS, *_TAKEN_AXES, "covariance"))
_OWNER_WORDS = {"clock": "timing"}  # owners that have another name in row ids


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorKind:
    """A kind of error, or of a sum of errors.

    Attributes
    ----------
    name : str
        Name of the kind in row ids, in the mission file, and in the key `requirements.declare` of this file.
    id_form : str
        Form of the row ids, with the fields `{owner}`, `{kind}`, `{axis}` and `{entry}`. Empty parts are left out.
        The owner is the part of the system that has the error, such as a platform. The owner `clock` is written
        `timing`.
    common_id_form : str
        Form of the row ids of an error that both platforms share; empty if the kind has no such error.
    is_computed : bool
        Whether the tool computes the declared size of a row, so that a size of zero is a result.
    only_warns : bool
        Whether the row warns and never fails.
    is_by_rule : bool
        Whether the row combines errors by the rule `allocation.combine`.
    is_vibration : bool
        Whether the row judges a vibration.
    spectrum_axis : str, optional
        Axis of the row about a declared spectrum, whose levels in decibels are relative to that spectrum; None if the
        kind has no such row.
    """

    name: str
    id_form: str = "{owner}.{kind}.{axis}.{entry}"
    common_id_form: str = ""
    is_computed: bool = False
    spectrum_axis: str | None = None
    only_warns: bool = False
    is_by_rule: bool = False
    is_vibration: bool = False

    def row_id(self, owner: str, axis: str = "", entry: int | None = None) -> str:
        """Id of the row of an error of this kind, in the form that the contract defines."""
        form = self.common_id_form if self.common_id_form and owner == "mission" else self.id_form
        names = {
            "owner": _OWNER_WORDS.get(owner, owner),
            "kind": self.name,
            "axis": axis,
            "entry": "" if entry is None else str(entry),
        }
        return ".".join(filter(None, (part.format_map(names) for part in form.split("."))))

    @property
    def has_numbers(self) -> bool:
        """Whether a row id contains the index of the error in a list of the file."""
        return "{entry}" in self.id_form

    def find_in(self, table: Mapping[str, _Entry], axis: str = "") -> _Entry:
        """Entry of a table by kind: the entry `KIND.AXIS` if the table has one, else the entry `KIND`.

        Raises `KeyError` if the table has neither.
        """
        name = f"{self.name}.{axis}"
        return table[name] if name in table else table[self.name]


@dataclass(frozen=True, kw_only=True, eq=False)
class SourceKind(ErrorKind):
    """A kind of error source.

    Attributes
    ----------
    moves : str
        What the error affects: the path of a `platform`, a `clock`, the delay in the `air`, or the `image` itself if
        the file states only the effect of the error.
    is_covered : bool
        Whether the coverage factor multiplies the declared size.
    flown_as : str
        Field of the simulator's `PathError` that takes the size of the error; empty if the error has no such field.
    drawn_as : str
        Quantity that is drawn over time for a random error: the `motion` of platforms, or the `delay` or `phase` of
        the echoes. Empty if nothing is drawn.
    is_random : bool
        Whether the error is random: it has a sigma and no sign.
    is_correlated : bool
        Whether the error is correlated noise of a position.
    has_names : bool
        Whether a file may state several errors of the kind, each with a name.
    is_of_log : bool
        Whether the error is the noise of a log of a flight, whose file is the source of the error.
    owes_source : bool
        Whether reports list a declared error of the kind if the file states no source for it.
    is_largest_of_axes : bool
        Whether the declared size is described as the largest of three axes.
    direction : str
        Name of the direction of the error, if its ids have no axis for it.
    """

    moves: str
    is_covered: bool = True
    flown_as: str = ""
    drawn_as: str = ""
    is_random: bool = False
    is_correlated: bool = False
    has_names: bool = False
    is_of_log: bool = False
    owes_source: bool = True
    is_largest_of_axes: bool = False
    direction: str = ""

    @property
    def is_shared(self) -> bool:
        """Whether the paths of both platforms can share the error."""
        return self.moves == "platform" and bool(self.common_id_form)

    @property
    def has_covariance(self) -> bool:
        """Whether the file can state this error by a covariance."""
        return False


@dataclass(frozen=True, kw_only=True, eq=False)
class StateKind(SourceKind):
    """A kind of error of a platform's state at mid-aperture: position, velocity or acceleration.

    `order` is the power of slow time to which the position error is proportional. `unit` is the unit of the error.
    """

    moves: str = "platform"
    common_id_form: str = "common.{kind}.{axis}"
    order: int
    unit: str

    @property
    def has_covariance(self) -> bool:
        """Whether the file can state this error by a covariance, which is so for position and velocity errors."""
        return self.order < 2


Motion = Callable[["PlatformState", "Floats"], "Floats"]


@dataclass(frozen=True, kw_only=True, eq=False, init=False)
class MotionKind(SourceKind):
    """A kind of error that is described completely by the motion error of the antenna's phase centre.

    A mission file states its size for each platform as `platforms.NAME.motion_error.registered.KIND`. The row id is
    `NAME.KIND`. The error is judged, explained, simulated, verified and drawn like the built-in kinds of error.

    Attributes
    ----------
    name : str
        Name of the kind, made of lower-case letters, digits and underscores. It begins with a letter.
    dimension : units.Dimension
        Dimension of the size, one of `bisar_budget.units`.
    description : str
        What the error is, in one sentence; for messages, the JSON Schema and the explanation.
    motion : callable
        Function `motion(path, times)` that returns the measured minus the true position of the antenna's phase centre
        for an error of one unit: east, north and up, (3, ...) for times (...). [m/unit] `path` is the true path, a
        `PlatformState`; `path.place(times)` are its positions relative to the scene centre. [m] `times` are slow
        times from mid-aperture. [s] The motion error must be proportional to the size of the error, and smooth: a
        motion that the nodes of the aperture do not resolve, such as a vibration, is refused.
    equation : str
        Source of the motion, such as an equation of a paper; for reports.

    Raises
    ------
    ValueError
        The name does not begin with a lower-case letter, or has characters other than those, digits and underscores,
        or it is a word that has another meaning in row ids, such as `receiver` or `covariance`.
    """

    dimension: units.Dimension
    description: str
    motion: Motion
    equation: str

    def __init__(
        self, *, name: str, dimension: units.Dimension, description: str, motion: Motion, equation: str = "full model"
    ) -> None:
        """Make a kind of error of a platform. All other attributes of `SourceKind` follow from the motion."""
        if not re.fullmatch("[a-z][a-z0-9_]*", name):
            raise ValueError(f"{name!r} is no name of a kind; accepted: small letters, digits, underscores")
        if name in _TAKEN_NAMES:
            raise ValueError(f"{name!r} is no name of a kind: it has another meaning in the ids of rows")
        super().__init__(name=name, moves="platform")
        attributes = {"dimension": dimension, "description": description, "motion": motion, "equation": equation}
        for attribute, value in attributes.items():
            object.__setattr__(self, attribute, value)

    @property
    def unit(self) -> str:
        """Unit of the size in SI."""
        return self.dimension.si

    def moved(self, path: "PlatformState", times: "Floats") -> "Floats":
        """Motion error per unit at slow times (...), east, north and up, (3, ...). [m/unit]

        Raises
        ------
        MotionKindError
            The function of the package raises an exception or changes the times, or the motion has another shape, or
            numbers that are not real or not finite.
        """
        given = times.view()
        given.flags.writeable = False
        try:
            motion = np.array(self.motion(path, given))
        except MemoryError:
            raise
        except Exception as error:  # whatever somebody's function raises, it is no fault of this package
            raise MotionKindError(f"{self.origin}: its motion raises {_words_of(error)}") from error
        if motion.dtype.kind not in "biuf":
            raise MotionKindError(f"{self.origin}: its motion has the type {motion.dtype}; accepted: real numbers")
        if motion.shape != (3, *times.shape):
            raise MotionKindError(
                f"{self.origin}: its motion has the shape {motion.shape}; accepted: {(3, *times.shape)}"
            )
        if not np.isfinite(motion).all():
            raise MotionKindError(f"{self.origin}: its motion has numbers that are not finite")
        return motion.astype(float)

    @property
    def origin(self) -> str:
        """Words for the kind, with the distribution that provides it, if an entry point does."""
        distribution = _DISTRIBUTIONS.get(self.name)
        return f"registered kind {self.name}" + (f" of the distribution {distribution}" if distribution else "")


@dataclass(frozen=True, kw_only=True, eq=False)
class SumKind(ErrorKind):
    """A kind of row that is computed from other rows: a sum of errors, or an effect of all errors on the image.

    Attributes
    ----------
    is_sum : bool
        Whether the row sums the effects of errors.
    is_phase : bool
        Whether the row has a phase in radians.
    is_level : bool
        Whether the row has the power of sidelobes in decibels.
    """

    is_sum: bool = False
    is_phase: bool = False
    is_level: bool = False


_KINDS: dict[str, ErrorKind] = {}
_DISTRIBUTIONS: dict[str, str] = {}  # names of distributions whose entry points provide a kind, by name of the kind
_ENTRY_POINT_FAULTS: list[str] = []  # sentences about entry points that give no kind


def _words_of(error: BaseException) -> str:
    """Name and message of an exception that the code of another package raised."""
    return printable(f"{type(error).__name__}: {error}"[:_MAX_CHARACTERS])


def register(kind: MotionKind) -> None:
    """Register a kind of error, so that every command accepts it.

    Raises
    ------
    TypeError
        The object is not a `MotionKind`; only the motion describes a kind completely.
    ValueError
        Another kind with the same name is registered.
    """
    if not isinstance(kind, MotionKind):
        raise TypeError(f"{kind!r} is no bisar_budget.MotionKind")
    _add(kind)


def _add(kind: ErrorKind) -> None:
    if _KINDS.setdefault(kind.name, kind) is not kind:
        raise ValueError(f"a kind of error named {kind.name!r} is registered already")


POSITION_KIND = StateKind(name="position", order=0, unit="m")
VELOCITY_KIND = StateKind(name="velocity", order=1, unit="m/s")
ACCELERATION_KIND = StateKind(name="acceleration", order=2, unit="m/s^2")
STATE_KINDS = (POSITION_KIND, VELOCITY_KIND, ACCELERATION_KIND)  # by order
MEASURED_KINDS = (POSITION_KIND, VELOCITY_KIND)  # which sources of paths and covariances state
SPREAD_POWER = SumKind(name="islr", is_sum=True, is_level=True)

for _kind in (
    *STATE_KINDS,
    SourceKind(name="time_tag", moves="platform", flown_as="time_tag", common_id_form="common.{kind}"),
    SourceKind(
        name="terrain", moves="platform", flown_as="height", is_covered=False, owes_source=False, direction="height"
    ),
    SourceKind(
        name="vibration",
        moves="platform",
        drawn_as="phase",
        is_random=True,
        is_vibration=True,
        spectrum_axis="spectrum",
    ),
    SourceKind(name="imu", moves="platform", drawn_as="motion", is_random=True, is_largest_of_axes=True),
    SourceKind(name="navigation", moves="platform", drawn_as="motion", is_random=True, is_computed=True),
    SourceKind(name="lever_arm", moves="platform", drawn_as="motion", is_random=True),
    SourceKind(
        name="random",
        moves="platform",
        drawn_as="motion",
        common_id_form="common.{kind}.{axis}",
        is_random=True,
        is_correlated=True,
        has_names=True,
        is_largest_of_axes=True,
    ),
    SourceKind(
        name="trajectory",
        moves="platform",
        drawn_as="motion",
        is_random=True,
        is_correlated=True,
        is_of_log=True,
        is_largest_of_axes=True,
    ),
    SourceKind(name="timing", moves="clock", id_form="{kind}.{axis}", owes_source=False),
    SourceKind(name="time", moves="clock", owes_source=False),
    SourceKind(name="frequency", moves="clock", owes_source=False),
    SourceKind(name="synchronization", moves="clock", drawn_as="phase", is_random=True),
    SourceKind(
        name="oscillator", moves="clock", drawn_as="phase", is_random=True, is_computed=True, spectrum_axis=""
    ),
    SourceKind(
        name="propagation",
        moves="air",
        drawn_as="delay",
        id_form="{kind}.{owner}.{axis}",
        common_id_form="{kind}.{axis}",
        is_random=True,
    ),
    SourceKind(name="other", moves="image", id_form="{kind}.{axis}", is_covered=False, has_names=True),
    SumKind(name="quadratic_phase_error", is_sum=True, is_phase=True, is_by_rule=True),
    SumKind(name="cubic_phase_error", is_sum=True, is_phase=True, is_by_rule=True),
    SumKind(name="location_error", is_sum=True, is_by_rule=True),
    SumKind(name="pslr", is_sum=True, is_level=True),
    SPREAD_POWER,
    SumKind(name="autofocus_pull_in", is_sum=True, only_warns=True),
    SumKind(name="spatial_variance", is_phase=True, is_computed=True, is_by_rule=True),
    SumKind(name="dispersion", id_form="propagation.{kind}", is_phase=True, is_computed=True, is_by_rule=True),
    SumKind(name="declare"),
    SumKind(name="specification", id_form="{kind}.{axis}"),
):
    _add(_kind)


@cache
def _read_entry_points() -> None:
    """Register the kinds of error that installed packages provide as entry points; done once.

    An entry point that gives no kind becomes a fault, and does not end commands that do not need its kind. If two
    distributions provide kinds with the same name, none of them is registered.
    """
    from importlib.metadata import entry_points

    provided: dict[str, dict[str, MotionKind]] = {}  # by name of the kind and of the distribution
    for entry_point in entry_points(group=ENTRY_POINT_GROUP):
        distribution = entry_point.dist.name if entry_point.dist else entry_point.value
        words = f"The entry point {entry_point.name} of the distribution {distribution} gives no kind of error"
        try:
            loaded = entry_point.load()
        except Exception as error:  # whatever the module of another package raises
            _ENTRY_POINT_FAULTS.append(f"{words}: {_words_of(error)}")
            continue
        if isinstance(loaded, MotionKind):
            provided.setdefault(loaded.name, {})[distribution] = loaded
        else:
            _ENTRY_POINT_FAULTS.append(
                f"{words}: it is no bisar_budget.MotionKind, but of the type {type(loaded).__name__}"
            )
    for name, by_distribution in provided.items():
        distributions = " and ".join(by_distribution)
        if len(by_distribution) > 1:
            _ENTRY_POINT_FAULTS.append(f"The distributions {distributions} provide kinds of error named {name!r}")
        elif _KINDS.setdefault(name, kind := by_distribution[distributions]) is kind:
            _DISTRIBUTIONS[name] = distributions
        else:
            _ENTRY_POINT_FAULTS.append(
                f"The distribution {distributions} provides a kind of error named {name!r}, but another has that name"
            )


def entry_point_faults() -> tuple[str, ...]:
    """Sentences about entry points of installed packages that give no kind of error."""
    _read_entry_points()
    return tuple(_ENTRY_POINT_FAULTS)


def kind_of(name: str) -> ErrorKind:
    """Return the kind with the given name.

    Raises
    ------
    KeyError
        No kind has the name, in this package or in an installed one.
    """
    if name not in _KINDS:
        _read_entry_points()
    return _KINDS[name]


def kinds() -> tuple[ErrorKind, ...]:
    """All kinds registered so far, in the order of registration. Entry points are not read."""
    return tuple(_KINDS.values())


def names_of_named_kinds() -> frozenset[str]:
    """Names of the kinds of which a file may state several errors, each with a name of its own."""
    return frozenset(kind.name for kind in kinds() if isinstance(kind, SourceKind) and kind.has_names)


def motion_kind(name: object) -> MotionKind | None:
    """Return the kind of error that a package registered under the given name; None if there is none."""
    if name not in _KINDS:
        _read_entry_points()
    kind = _KINDS.get(name) if isinstance(name, str) else None
    return kind if isinstance(kind, MotionKind) else None


def registered_names() -> tuple[str, ...]:
    """Names of the kinds that packages have registered so far. Entry points are not read."""
    return tuple(name for name, kind in _KINDS.items() if isinstance(kind, MotionKind))


def motion_kinds() -> dict[str, MotionKind]:
    """All kinds of error that packages registered or provide as entry points, by name."""
    _read_entry_points()
    return {name: kind for name, kind in _KINDS.items() if isinstance(kind, MotionKind)}
