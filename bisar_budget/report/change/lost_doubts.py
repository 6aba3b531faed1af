"""Find doubts about paths that a change removes although the declared errors stay the same.

A path is in doubt if its source may have a larger error than the file declares: because of the accuracy that the
source states, the age and interpolation of an orbit, or the noise of a log. Newer orbital elements or a better log
resolve a doubt. A changed key that only suppresses the doubt does not resolve it, and neither does a source with the
same name that now states a smaller error.
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
    """A doubt that the change removed: the key that removed it, and texts for before and after."""

    key: str
    before: str
    after: str


def lost_doubts(before: Mission, after: Mission) -> Iterator[LostDoubt]:
    """Yield the doubts about the earlier paths that are gone, although the later errors do not cover them."""
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
    """Yield the changed keys that suppress a doubt about a path, each with a text about its new value.

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
    """Whether the source of a path has the same name as before. Format, folder and file ending are ignored.

    A selection within the file, such as its object or track, is compared only if both versions state it.
    """
    return _files(old) == _files(new) and all(
        plain(was) == plain(now) for was, now in zip(_chosen(old), _chosen(new), strict=True) if was and now
    )


def _files(platform: Platform) -> tuple[str, ...]:
    """Normalized names of the file of a path and of its accuracy file; an empty tuple if the path has no file."""
    path = platform.path
    return () if path is None else (plain_file(path.file), plain_file(path.accuracy and path.accuracy[0]))


def _chosen(platform: Platform) -> list[str]:
    """Values of the keys that select data within a path file, such as `track`; an empty text for a missing key."""
    choices = [getattr(getattr(platform, platform.way), choice, None) for choice in _CHOICES]
    return ["" if choice is None else str(choice) for choice in choices]


def _key(platform: Platform) -> str:
    """Key, within the section of a platform, that states its path: kind and format, such as `orbit.tle`."""
    stated = getattr(platform, platform.way)
    form = next(key for key in stated._fields if key not in _NOT_OF_FORM and getattr(stated, key) is not None)
    return f"{platform.way}.{form}"


def _is_sourced_anew(doubt: InputDoubt, old: Platform, new: Platform) -> bool:
    """Whether the declared error now names evidence that it did not name before."""
    named = plain(new.motion_error.evidence(doubt.kind))
    error = old.motion_error
    return named not in ("", plain(error.source), plain(error.evidence(doubt.kind)))


def _changed(was: FlownPath, now: FlownPath) -> Iterator[str]:
    """Yield the names of the path file and of the accuracy file if their contents changed."""
    if now.file is not None and was.sha256 != now.sha256:
        yield now.file
    if now.accuracy is not None and was.accuracy is not None and was.accuracy[1] != now.accuracy[1]:
        yield now.accuracy[0]
