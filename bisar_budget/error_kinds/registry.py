"""Registry of the kinds of error in this package, of the kinds of sums of errors, and of kinds from other packages.

A package adds a kind with `register`, or with an entry point in the group `bisar_budget.kinds`. Entry points are read
only when a mission file or an option uses an unknown kind, because reading them takes longer than a check.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from bisar_budget import units
from bisar_budget.error_kinds.clock_kinds import (
    FREQUENCY_KIND,
    OSCILLATOR_KIND,
    SYNCHRONIZATION_KIND,
    TIME_KIND,
    TIMING_KIND,
)
from bisar_budget.error_kinds.kind import AS_STATED, ErrorKind, ErrorSize, SourceKind, SumKind
from bisar_budget.error_kinds.path_kinds import NO_DIRECTION, STATE_KINDS, TERRAIN_KIND, TIME_TAG_KIND, PathKind
from bisar_budget.error_kinds.random_kinds import (
    IMU_KIND,
    LEVER_ARM_KIND,
    NAVIGATION_KIND,
    OTHER_KIND,
    PROPAGATION_KIND,
    RANDOM_KIND,
    TRAJECTORY_KIND,
    VIBRATION_KIND,
)
from bisar_budget.faults import MotionKindError, printable

if TYPE_CHECKING:
    from bisar_budget.arrays import Floats
    from bisar_budget.geometry import PlatformState, VectorArrays, Vectors

ENTRY_POINT_GROUP = "bisar_budget.kinds"
_MAX_CHARACTERS = 300  # of the message of an exception of another package
# Words of row ids, and of groups of rows, that are no kinds: owners, sections and axes.
_TAKEN_OWNERS = ("transmitter", "receiver", "mission", "clock", "common", "scene")
_TAKEN_AXES = ("x", "y", "z", "along", "cross", "up", "line_of_sight", "radial", "in_track", "cross_track")
_TAKEN_NAMES = frozenset((*_TAKEN_OWNERS, *_TAKEN_AXES, "covariance"))


Motion = Callable[["PlatformState", "Floats"], "Floats"]


@dataclass(frozen=True, kw_only=True, eq=False, init=False)
class MotionKind(PathKind):
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
        Description of the error in one sentence, used in messages, in the JSON Schema and in explanations.
    motion : callable
        Function `motion(path, times)` that returns the measured minus the true position [m/unit] of the antenna's
        phase centre for an error of one unit: east, north and up, (3, ...) for times (...). `path` is the true path,
        a `PlatformState`; `path.place(times)` [m] are its positions relative to the scene centre. `times` [s] are
        slow times from mid-aperture. The motion error must be proportional to the size of the error, and smooth. A
        motion that changes too fast for the nodes over the aperture, such as a vibration, is refused.
    equation : str
        Source of the motion, such as an equation of a paper; it is shown in reports.

    Raises
    ------
    ValueError
        The name does not begin with a lower-case letter, has characters other than lower-case letters, digits and
        underscores, or has another meaning in row ids, such as `receiver` or `covariance`.
    """

    dimension: units.Dimension
    motion: Motion
    equation: str

    def __init__(
        self, *, name: str, dimension: units.Dimension, description: str, motion: Motion, equation: str = "full model"
    ) -> None:
        """Create a kind of error of a platform. All other attributes of `SourceKind` follow from the motion."""
        if not re.fullmatch("[a-z][a-z0-9_]*", name):
            raise ValueError(f"{name!r} is no name of a kind; accepted: small letters, digits, underscores")
        if name in _TAKEN_NAMES:
            raise ValueError(f"{name!r} is no name of a kind: it has another meaning in the ids of rows")
        super().__init__(
            name=name,
            description=description,
            key_form="platforms.{owner}.motion_error.registered.{kind}",
            sizes={"": ErrorSize(dimension=dimension, distribution=AS_STATED, equation=equation)},
            flown_as="course",
            is_registered=True,
        )
        for attribute, value in {"dimension": dimension, "motion": motion, "equation": equation}.items():
            object.__setattr__(self, attribute, value)

    def moved(self, path: "PlatformState", times: "Floats", direction: "Vectors" = NO_DIRECTION) -> "VectorArrays":
        """Motion error per unit at slow times (...), east, north and up, (...) each. [m/unit]

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
        x, y, z = motion.astype(float)
        return x, y, z

    @property
    def origin(self) -> str:
        """Description of the kind for messages, with the installed package whose entry point provides it, if any."""
        distribution = _DISTRIBUTIONS.get(self.name)
        return f"registered kind {self.name}" + (f" of the distribution {distribution}" if distribution else "")


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
        The object is not a `MotionKind`; only kinds that are described completely by a motion can be registered.
    ValueError
        Another kind with the same name is already registered.
    """
    if not isinstance(kind, MotionKind):
        raise TypeError(f"{kind!r} is no bisar_budget.MotionKind")
    _add(kind)


def _add(kind: ErrorKind) -> None:
    if _KINDS.setdefault(kind.name, kind) is not kind:
        raise ValueError(f"a kind of error named {kind.name!r} is registered already")


SPREAD_POWER = SumKind(name="islr", is_sum=True, is_level=True)

for _kind in (
    *STATE_KINDS,
    TIME_TAG_KIND,
    TERRAIN_KIND,
    VIBRATION_KIND,
    IMU_KIND,
    NAVIGATION_KIND,
    LEVER_ARM_KIND,
    RANDOM_KIND,
    TRAJECTORY_KIND,
    TIMING_KIND,
    TIME_KIND,
    FREQUENCY_KIND,
    SYNCHRONIZATION_KIND,
    OSCILLATOR_KIND,
    PROPAGATION_KIND,
    OTHER_KIND,
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

    An entry point that does not provide a kind is recorded as a fault, and does not stop commands that do not need
    its kind. If two distributions provide kinds with the same name, neither kind is registered.
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
    """Messages about entry points of installed packages that do not provide a valid kind of error."""
    _read_entry_points()
    return tuple(_ENTRY_POINT_FAULTS)


def kind_of(name: str) -> ErrorKind:
    """Return the kind with the given name.

    Raises
    ------
    KeyError
        There is no kind with this name, either in this package or in an installed package.
    """
    if name not in _KINDS:
        _read_entry_points()
    return _KINDS[name]


def kinds() -> tuple[ErrorKind, ...]:
    """All kinds registered so far, in the order of registration. Entry points are not read."""
    return tuple(_KINDS.values())


def names_of_named_kinds() -> frozenset[str]:
    """Names of the kinds that allow several errors in a file, each with a name of its own."""
    return frozenset(kind.name for kind in kinds() if isinstance(kind, SourceKind) and kind.has_names)


def motion_kind(name: object) -> MotionKind | None:
    """Return the kind of error that a package registered under the given name; None if there is no such kind."""
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
