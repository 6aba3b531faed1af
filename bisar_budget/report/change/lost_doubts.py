"""Find the doubts that a change removes without settling them, and without declaring larger errors.

There is a doubt about the path of a platform if the error of its source may be larger than the declared error. The
reason may be the accuracy that the source states, the age and interpolation of an orbit, or the noise of a log. Newer
orbital elements or a better log settle a doubt. A doubt is not settled by a changed key that only suppresses it, or
by a source with the same name that now states a smaller error.
"""

from collections.abc import Iterator
from typing import NamedTuple

from bisar_budget.budget.doubts import InputDoubt, input_doubts
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import FLOWN_SECTIONS, SMOOTHED, FlownPath, Platform
from bisar_budget.report.change.names import plain, plain_file
from bisar_budget.units import format_quantity

_CHOICES = ("object", "talker", "track", "instance")  # keys that name a source within a file
_NOT_OF_FORM = ("object", "planned")  # keys of an orbit other than the format of its source


class LostDoubt(NamedTuple):
    """A doubt about the path of a platform, removed by a change that does not settle it.

    `key` is the key of the mission file that removed the doubt. `before` and `after` are texts about both versions.
    """

    key: str
    before: str
    after: str


def lost_doubts(before: Mission, after: Mission) -> Iterator[LostDoubt]:
    """Yield the doubts that a change removed, although the errors declared after the change do not cover them."""
    doubts = {_name(doubt) for doubt in input_doubts(before)}
    if not doubts:
        return
    kept = {_name(doubt) for doubt in input_doubts(after)}
    for owner in dict.fromkeys(owner for owner, *_ in sorted(doubts)):
        old, new = (getattr(mission.platforms, owner) for mission in (before, after))
        flown = {owner: new._replace(path=old.path)}
        for doubt in input_doubts(after._replace(platforms=after.platforms._replace(**flown))):
            name = _name(doubt)
            if doubt.owner != owner or name not in doubts or name in kept:
                continue
            for key, now in _takes(doubt, old, new):
                yield LostDoubt(f"platforms.{owner}.{key}", _words(doubt), now)


def _name(doubt: InputDoubt) -> tuple[str, str, bool, bool]:
    return doubt.owner, doubt.kind, doubt.is_stated, doubt.is_of_log


def _words(doubt: InputDoubt) -> str:
    name = "path" if doubt.is_phase else doubt.kind
    return f"{name} in doubt by {format_quantity(doubt.doubt, doubt.unit)}"


def _takes(doubt: InputDoubt, old: Platform, new: Platform) -> Iterator[tuple[str, str]]:
    """Yield the changed keys of the mission file that suppress a doubt about a path, with texts about the new values.

    Nothing is yielded if the path has a new or better source.
    """
    was, now = old.path, new.path
    if was is None:
        return
    if now is None or new.way not in FLOWN_SECTIONS:
        yield old.way, "path stated without a source"
    elif now.is_planned and not was.is_planned and not doubt.is_stated:
        yield "orbit.planned", "true"
    elif doubt.is_of_log and now.log_noise is not None and now.log_noise.processed == SMOOTHED:
        yield "trajectory.processed", SMOOTHED
    elif doubt.is_stated and was.accuracy is not None and now.accuracy is None:
        yield "trajectory.accuracy", "none"
    elif doubt.is_stated and _is_same_source(old, new) and not _is_sourced_anew(doubt, old, new):
        for file in _changed(was, now):
            yield _key(old), f"content of {file} states less of itself"


def _is_same_source(old: Platform, new: Platform) -> bool:
    """Whether the source of a path has the same name as before the change.

    The format, folder and suffix of the file are ignored. Keys that select data within the file, such as an object or
    a track, are compared only if both versions have them.
    """
    return _files(old) == _files(new) and all(
        plain(was) == plain(now) for was, now in zip(_chosen(old), _chosen(new), strict=True) if was and now
    )


def _files(platform: Platform) -> tuple[str, ...]:
    """Normalized names of the path file of a platform and of its accuracy file; empty if there is no path file."""
    path = platform.path
    return () if path is None else (plain_file(path.file), plain_file(path.accuracy and path.accuracy[0]))


def _chosen(platform: Platform) -> list[str]:
    """Values of the keys that select data within a path file, such as `track`; an empty string for a missing key."""
    choices = [getattr(getattr(platform, platform.way), choice, None) for choice in _CHOICES]
    return ["" if choice is None else str(choice) for choice in choices]


def _key(platform: Platform) -> str:
    """Key, within the section of a platform, that states its path: kind and format, such as `orbit.tle`."""
    stated = getattr(platform, platform.way)
    form = next(key for key in stated._fields if key not in _NOT_OF_FORM and getattr(stated, key) is not None)
    return f"{platform.way}.{form}"


def _is_sourced_anew(doubt: InputDoubt, old: Platform, new: Platform) -> bool:
    """Whether the evidence for the declared error is new, that is, not named in the earlier version."""
    named = plain(new.motion_error.evidence(doubt.kind))
    error = old.motion_error
    return named not in ("", plain(error.source), plain(error.evidence(doubt.kind)))


def _changed(was: FlownPath, now: FlownPath) -> Iterator[str]:
    """Yield the names of the path file and of the accuracy file if their contents changed."""
    if now.file is not None and was.sha256 != now.sha256:
        yield now.file
    if now.accuracy is not None and was.accuracy is not None and was.accuracy[1] != now.accuracy[1]:
        yield now.accuracy[0]
