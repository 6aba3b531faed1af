"""Kinds of error: one object for each kind of error that a mission can have, and for each sum of errors.

The object of a kind has the facts about it that commands need. Commands ask the object, and none compares names of
kinds. Where a room computes something else for each kind, such as the steps of an explanation or a random time
series, it has one table of functions by kind, and a test holds that the table is complete.

A package adds a kind by `register`, or by an entry point of the group `bisar_budget.kinds`. Entry points are read
when a mission file or an option uses a kind that is not known yet, because reading them takes longer than a check.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, TypeVar

from bisar_budget import units

if TYPE_CHECKING:
    from bisar_budget.arrays import Floats
    from bisar_budget.geometry import PlatformState

_Entry = TypeVar("_Entry")
ENTRY_POINT_GROUP = "bisar_budget.kinds"
_OWNER_WORDS = {"clock": "timing"}  # owners that ids name otherwise


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorKind:
    """A kind of error, or of a sum of errors.

    Attributes
    ----------
    name : str
        Word for the kind in row ids, in the file, and in `requirements.declare`.
    id_form : str
        Form of the row ids, with the fields `{owner}`, `{kind}`, `{axis}` and `{entry}`. Empty parts are left out.
        The owner `clock` is written `timing`.
    common_id_form : str
        Form of the row ids of an error that both platforms share; empty if the kind has no such error.
    """

    name: str
    id_form: str = "{owner}.{kind}.{axis}.{entry}"
    common_id_form: str = ""

    def row_id(self, owner: str, axis: str = "", entry: int | None = None) -> str:
        """Id of the row of an error of this kind. The contract defines it."""
        form = self.common_id_form if self.common_id_form and owner == "mission" else self.id_form
        names = {
            "owner": _OWNER_WORDS.get(owner, owner),
            "kind": self.name,
            "axis": axis,
            "entry": "" if entry is None else str(entry),
        }
        return ".".join(filter(None, (part.format_map(names) for part in form.split("."))))

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
        What the error makes wrong: the path of a `platform`, a `clock`, the delay in the `air`, or the `image` itself
        if the file states only the effect of the error.
    is_covered : bool
        Whether the coverage factor multiplies the declared size.
    flown_as : str
        Field of the simulator's `PathError` that has the size of the error; empty if its motion is flown otherwise.
    drawn_as : str
        What is drawn of a random error over time: the `motion` of platforms, or the `delay` or `phase` of the echoes.
        Empty if nothing is drawn.
    is_random : bool
        Whether the error is random: it has a sigma and no sign.
    is_correlated : bool
        Whether the error is correlated noise of a position.
    has_names : bool
        Whether a file may state several errors of the kind, each with a name.
    """

    moves: str
    is_covered: bool = True
    flown_as: str = ""
    drawn_as: str = ""
    is_random: bool = False
    is_correlated: bool = False
    has_names: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class StateKind(SourceKind):
    """A kind of error of a platform's state at mid-aperture: position, velocity or acceleration.

    `order` is the power of slow time with which the position error grows; `unit` is the unit of the error.
    """

    moves: str = "platform"
    common_id_form: str = "common.{kind}.{axis}"
    order: int
    unit: str


Motion = Callable[["PlatformState", "Floats"], "Floats"]


@dataclass(frozen=True, kw_only=True, eq=False)
class MotionKind(SourceKind):
    """A kind of error that is described completely by the motion of the phase centre which it causes.

    A mission file states its size for each platform as `platforms.NAME.motion_error.registered.KIND`. The row id is
    `NAME.KIND`. The error is judged, explained, simulated, verified and drawn like the errors that this package has.

    Attributes
    ----------
    name : str
        Name of the kind: small letters, digits and underscores.
    dimension : units.Dimension
        Dimension of the size, one of `bisar_budget.units`.
    description : str
        What the error is, in one sentence; for messages, the JSON Schema and the explanation.
    motion : callable
        `motion(path, times)`: measured minus true position of the antenna's phase centre for an error of one unit,
        (3, *times.shape): east, north, up. [m/unit] `path` is the true path, a `PlatformState`; `path.place(times)`
        are its positions relative to the scene centre. [m] `times` are slow times from mid-aperture. [s] The motion
        has to be proportional to the size of the error. It may vary by up to the twelfth power of time.
    equation : str
        Where the motion comes from, such as an equation of a paper; for reports.

    Raises
    ------
    ValueError
        The name is not made of small letters, digits and underscores.
    """

    moves: str = "platform"
    dimension: units.Dimension
    description: str
    motion: Motion
    equation: str = "full model"

    def __post_init__(self) -> None:
        """Check the name."""
        if not re.fullmatch("[a-z][a-z0-9_]*", self.name):
            raise ValueError(f"{self.name!r} is no name of a kind; accepted: small letters, digits, underscores")

    @property
    def unit(self) -> str:
        """Unit of the size in SI."""
        return self.dimension.si


@dataclass(frozen=True, kw_only=True, eq=False)
class SumKind(ErrorKind):
    """A kind of row that other rows make: a sum of errors, or an effect of all of them on the image.

    Attributes
    ----------
    is_sum : bool
        Whether the row sums the effects of errors.
    is_phase : bool
        Whether the row has a phase in radians.
    is_level : bool
        Whether the row has the power of sidelobes in decibels.
    only_warns : bool
        Whether the row warns and never fails.
    """

    is_sum: bool = False
    is_phase: bool = False
    is_level: bool = False
    only_warns: bool = False


_KINDS: dict[str, ErrorKind] = {}


def register(kind: ErrorKind) -> None:
    """Add a kind of error to those that every command knows.

    Raises
    ------
    ValueError
        Another kind has the name.
    """
    if _KINDS.setdefault(kind.name, kind) is not kind:
        raise ValueError(f"a kind of error named {kind.name!r} is registered already")


POSITION_KIND = StateKind(name="position", order=0, unit="m")
VELOCITY_KIND = StateKind(name="velocity", order=1, unit="m/s")
ACCELERATION_KIND = StateKind(name="acceleration", order=2, unit="m/s^2")
STATE_KINDS = (POSITION_KIND, VELOCITY_KIND, ACCELERATION_KIND)  # by order

for _kind in (
    *STATE_KINDS,
    SourceKind(name="time_tag", moves="platform", flown_as="time_tag", common_id_form="common.{kind}"),
    SourceKind(name="terrain", moves="platform", flown_as="height", is_covered=False),
    SourceKind(name="vibration", moves="platform", drawn_as="phase", is_random=True),
    SourceKind(name="imu", moves="platform", drawn_as="motion", is_random=True),
    SourceKind(name="lever_arm", moves="platform", drawn_as="motion", is_random=True),
    SourceKind(
        name="random",
        moves="platform",
        drawn_as="motion",
        common_id_form="common.{kind}.{axis}",
        is_random=True,
        is_correlated=True,
        has_names=True,
    ),
    SourceKind(name="trajectory", moves="platform", drawn_as="motion", is_random=True, is_correlated=True),
    SourceKind(name="timing", moves="clock", id_form="{kind}.{axis}"),
    SourceKind(name="time", moves="clock"),
    SourceKind(name="frequency", moves="clock"),
    SourceKind(name="synchronization", moves="clock", drawn_as="phase", is_random=True),
    SourceKind(name="oscillator", moves="clock", drawn_as="phase", is_random=True),
    SourceKind(
        name="propagation",
        moves="air",
        drawn_as="delay",
        id_form="{kind}.{owner}.{axis}",
        common_id_form="{kind}.{axis}",
        is_random=True,
    ),
    SourceKind(name="other", moves="image", id_form="{kind}.{axis}", is_covered=False, has_names=True),
    SumKind(name="quadratic_phase_error", is_sum=True, is_phase=True),
    SumKind(name="cubic_phase_error", is_sum=True, is_phase=True),
    SumKind(name="location_error", is_sum=True),
    SumKind(name="pslr", is_sum=True, is_level=True),
    SumKind(name="islr", is_sum=True, is_level=True),
    SumKind(name="autofocus_pull_in", is_sum=True, only_warns=True),
    SumKind(name="spatial_variance", is_phase=True),
    SumKind(name="dispersion", id_form="propagation.{kind}", is_phase=True),
    SumKind(name="declare"),
    SumKind(name="specification", id_form="{kind}.{axis}"),
):
    register(_kind)


@cache
def _read_entry_points() -> None:
    """Register the kinds of the installed packages that have entry points."""
    from importlib.metadata import entry_points

    for entry_point in entry_points(group=ENTRY_POINT_GROUP):
        loaded = entry_point.load()
        if isinstance(loaded, ErrorKind) and _KINDS.get(loaded.name) is not loaded:
            register(loaded)


def kind_of(name: str) -> ErrorKind:
    """Kind with a name; raises `KeyError` if there is none."""
    if name not in _KINDS:
        _read_entry_points()
    return _KINDS[name]


def kinds() -> tuple[ErrorKind, ...]:
    """All kinds that are known, in the order in which they were registered."""
    return tuple(_KINDS.values())


def motion_kind(name: object) -> MotionKind | None:
    """Kind of error with a name that a package registered; None if there is none."""
    if name not in _KINDS:
        _read_entry_points()
    kind = _KINDS.get(name) if isinstance(name, str) else None
    return kind if isinstance(kind, MotionKind) else None


def registered_names() -> tuple[str, ...]:
    """Names of the kinds that packages have registered so far. Entry points are not read."""
    return tuple(name for name, kind in _KINDS.items() if isinstance(kind, MotionKind))


def motion_kinds() -> dict[str, MotionKind]:
    """Kinds of error that packages registered, by name."""
    _read_entry_points()
    return {name: kind for name, kind in _KINDS.items() if isinstance(kind, MotionKind)}
