"""Doubts about paths that a change removes although the declared errors stay.

A path is in doubt by the accuracy that its source states, by the age and the interpolation of an orbit, and by the
noise of a log. Newer elements and better logs end a doubt rightly. Doubts that end by a key of the mission file, or
because a source of the same name states less about its accuracy, are lost.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

from bisar_budget.budget.doubts import RESIDUAL, InputDoubt, input_doubts
from bisar_budget.effects.effect import MOTION_UNITS
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import SMOOTHED, FlownPath, Platform
from bisar_budget.units import format_quantity

_CHOICE_KEYS = ("object", "talker", "track", "instance")  # keys that select a source within a file
_EXTRA_KEYS = (*_CHOICE_KEYS, "planned")  # keys of an orbit that do not name its form


class LostDoubt(NamedTuple):
    """A doubt that only the earlier mission has: the key that removed it, and words before and after."""

    key: str
    before: str
    after: str


def lost_doubts(before: Mission, after: Mission) -> Iterator[LostDoubt]:
    """Doubts of the earlier paths that are gone although the later declared errors do not cover them."""
    doubts = {_name(doubt) for doubt in input_doubts(before)}
    if not doubts:
        return
    later_doubts = {_name(doubt) for doubt in input_doubts(after)}
    for owner in dict.fromkeys(owner for owner, *_ in sorted(doubts)):
        old, new = (getattr(mission.platforms, owner) for mission in (before, after))
        platforms = {owner: new._replace(path=old.path)}
        for doubt in input_doubts(after._replace(platforms=after.platforms._replace(**platforms))):
            name = _name(doubt)
            if doubt.owner != owner or name not in doubts or name in later_doubts:
                continue
            for key, new_text in _removing_keys(doubt, old, new):
                yield LostDoubt(f"platforms.{owner}.{key}", _words(doubt), new_text)


def _name(doubt: InputDoubt) -> tuple[str, str, bool, bool]:
    return doubt.owner, doubt.kind, doubt.is_stated, doubt.is_of_log


def _words(doubt: InputDoubt) -> str:
    is_phase = doubt.kind == RESIDUAL
    size = format_quantity(doubt.doubt, "rad" if is_phase else MOTION_UNITS[doubt.kind])
    return f"{'path' if is_phase else doubt.kind} in doubt by {size}"


def _removing_keys(doubt: InputDoubt, old: Platform, new: Platform) -> Iterator[tuple[str, str]]:
    """Keys that remove a doubt, with words for the later value; no key if the source is another or a better one."""
    old_path, new_path = old.path, new.path
    if old_path is None:
        return
    if new_path is None or new.way not in ("orbit", "trajectory"):
        yield old.way, "path stated without a source"
    elif new_path.is_planned and not old_path.is_planned and not doubt.is_stated:
        yield "orbit.planned", "true"
    elif doubt.is_of_log and new_path.log_noise is not None and new_path.log_noise.processed == SMOOTHED:
        yield "trajectory.processed", SMOOTHED
    elif doubt.is_stated and old_path.accuracy is not None and new_path.accuracy is None:
        yield "trajectory.accuracy", "none"
    elif doubt.is_stated and _source(old) == _source(new) and not _is_sourced_anew(doubt, old, new):
        for file in _changed(old_path, new_path):
            yield _key(old), f"content of {file} states less of itself"


def _source(platform: Platform) -> tuple[Any, ...]:
    """Names of the files and selections that define a path."""
    section, path = getattr(platform, platform.way), platform.path
    names = () if path is None else (path.file, path.accuracy and path.accuracy[0])
    return (_key(platform), *names, *(getattr(section, choice, None) for choice in _CHOICE_KEYS))


def _key(platform: Platform) -> str:
    """Key of the mission file that names the file of a path."""
    section = getattr(platform, platform.way)
    form = next(key for key in section._fields if key not in _EXTRA_KEYS and getattr(section, key) is not None)
    return f"{platform.way}.{form}"


def _is_sourced_anew(doubt: InputDoubt, old: Platform, new: Platform) -> bool:
    """Whether the declared error names another source than before."""
    evidence = new.motion_error.evidence(doubt.kind)
    return bool(evidence) and evidence != old.motion_error.evidence(doubt.kind)


def _changed(old_path: FlownPath, new_path: FlownPath) -> Iterator[str]:
    """Files whose contents changed."""
    if old_path.file is not None and old_path.sha256 != new_path.sha256:
        yield old_path.file
    if old_path.accuracy is not None and old_path.accuracy != new_path.accuracy:
        yield old_path.accuracy[0]
