"""Where a platform flies, other than by its position and velocity: an orbit, or a log of a flight."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, NamedTuple

from bisar_budget import units
from bisar_budget.faults import InvalidValueError, Problem
from bisar_budget.mission import later
from bisar_budget.mission.readers import (
    INVALID,
    Choice,
    Key,
    OneOf,
    Quantity,
    Reader,
    Reference,
    Report,
    Section,
    Whole,
)

_FILE = Reference()
_ORBIT_WAYS = ("tle", "omm", "oem")


class _Lines(Reader):
    """The two lines of an element set."""

    is_word = True
    what = "[line 1, line 2]"

    def read(self, value: Any, path: tuple[Any, ...], report: Report) -> Any:
        """Read both."""
        if not isinstance(value, list) or len(value) != 2 or not all(isinstance(line, str) for line in value):
            report(path, Problem("must be the name of a file, or the two lines of an element set"))
            return INVALID
        return tuple(value)

    def schema(self, definitions: dict[str, Any]) -> dict[str, Any]:
        """Array of two lines."""
        return {"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 2}


class OrbitSource(NamedTuple):
    """An orbit; the mission needs the scene's latitude, longitude and height, and `collection.center_time`."""

    tle: Annotated[
        str | tuple[str, str] | None,
        Key(
            OneOf(lambda value: _Lines() if isinstance(value, list) else _FILE, (_FILE, _Lines())),
            "File of two-line elements, or the two lines; SGP4.",
        ),
    ] = None
    omm: Annotated[str | None, Key(_FILE, "Orbit mean-elements message, XML, JSON or CSV; SGP4.")] = None
    oem: Annotated[str | None, Key(_FILE, "Orbit ephemeris message, text or XML; interpolated as it says.")] = None
    object: Annotated[str | None, Key(Reference(), "Name or catalogue number, where a file has several.")] = None

    @staticmethod
    def problems(values: Mapping[str, Any]) -> Iterator[Problem]:
        """Hold it to one source."""
        given = [way for way in _ORBIT_WAYS if values.get(way) is not None]
        if len(given) != 1 and values.keys() >= set(_ORBIT_WAYS):
            said = f"mixes {' with '.join(given)}" if given else "is empty"
            yield Problem(said, f"accepted: one of {', '.join(_ORBIT_WAYS)}")


class _Instant(Reader):
    """An instant of UTC."""

    is_word = True
    what = "2026-06-01T05:20:31.250Z and the like"

    def leaf(self, value: Any) -> Any:
        """Read 2026-06-01T05:20:31.250Z."""
        from bisar_budget.paths.instant import parse_instant

        found = parse_instant(value) if isinstance(value, str) else None
        if found is None:
            raise InvalidValueError("must be an instant of UTC", f"accepted: {self.what}")
        return found

    def schema(self, definitions: dict[str, Any]) -> dict[str, Any]:
        """Date and time."""
        return {"type": "string", "format": "date-time"}


FORMATS = ("csv", "sbet")


class TrajectorySource(NamedTuple):
    """A log of a flight."""

    file: Annotated[str, Key(_FILE, "Beside the mission file.")]
    format: Annotated[
        str | None, Key(Choice(*FORMATS, refused=later.FORMATS), "Omitted: by the name's ending; .out is sbet.")
    ] = None
    week: Annotated[int | None, Key(Whole(0, 9999), "GPS week in which an SBET begins, not rolled over.")] = None
    center: Annotated[
        float | None,
        Key(
            Quantity(units.TIME, ge=-1e11, le=1e11),
            "Time of the log that is the middle of the aperture; omitted: collection.center_time, or 0 s.",
        ),
    ] = None
    accuracy: Annotated[
        str | None, Key(_FILE, "SBET accuracy file (smrmsg): fills position and velocity of motion_error.")
    ] = None


ORBIT, TRAJECTORY, INSTANT = Section(OrbitSource), Section(TrajectorySource), _Instant()
