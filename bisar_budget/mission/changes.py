"""Paths of keys: the values that options put at them, and the key that somebody meant.

`--set KEY=VALUE` is for a question that is asked once. The value is put into the tree that was read, before anybody
asks what it means: every check works as for a file. `KEY=null` takes the key out. The keys of the file are those of
the readers.
"""

from collections.abc import Iterator, Sequence
from difflib import SequenceMatcher, get_close_matches
from functools import cache
from typing import Any

import yaml

from bisar_budget.faults import Changed, InvalidValueError, KeyPath, Problem, SetNumber, SetValue, shown
from bisar_budget.mission.model import MISSION
from bisar_budget.mission.readers import INVALID, ListOf, OneOf, Reader, Section, did_you_mean, is_place
from bisar_budget.mission.tree import MAX_BYTES, NULLS, Tree

_ACCEPTED = "accepted: KEY=VALUE, such as radar.bandwidth=150MHz"
_MAX_KEY = 500  # characters; a path of the schema has a tenth
_OF_DOTTED = (("requirement_ids",), ("specifications",), ("allocation", "specify"))  # by ids of rows, or whole paths


def read_changes(texts: Sequence[str]) -> tuple[SetValue, ...]:
    """Read `KEY=VALUE` of each option.

    Raises
    ------
    InvalidValueError
        One has no key or no `=`, or two have the same key.
    """
    changes: dict[tuple[str, ...], SetValue] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        key = key.strip()
        if not equals or not key:
            raise InvalidValueError(f"{shown(text)!r} is not KEY=VALUE", _ACCEPTED)
        if len(key) > _MAX_KEY or len(value) > MAX_BYTES:
            raise InvalidValueError(f"{shown(text)!r} is too long", _ACCEPTED)
        parts = parts_of(key)
        if "" in parts:
            raise InvalidValueError(f"{shown(key)!r} is no path of keys", _ACCEPTED)
        if parts in changes:
            raise InvalidValueError(f"{shown(key)} is set twice", "accepted: each key once")
        changes[parts] = SetValue(key, value.strip())
    return tuple(changes.values())


def parts_of(key: str) -> tuple[str, ...]:
    """Split a path of keys: `other_errors[0].name` and `other_errors.0.name` have the parts other_errors, 0, name."""
    return tuple(key.replace("[", ".").replace("]", "").split("."))


def apply_changes(tree: Tree, changes: Sequence[SetValue]) -> None:
    """Put each value into the tree, in place of what stands there or beside it; what is wrong is a fault of the tree.

    Raises
    ------
    UnusableError
        Nothing after it is worth reading; the fault is in the tree.
    """
    for change in changes:
        if takes_out(change):
            _take_out(tree, change)
        else:
            _apply(tree, change)


def takes_out(change: SetValue) -> bool:
    """Whether an option takes a key out: its value is the null of YAML, as `--set requirements.islr=null` has it."""
    return not isinstance(change, SetNumber) and change.text in NULLS and change.text != ""


def _take_out(tree: Tree, change: SetValue) -> None:
    """Take a key out of the tree. One that the file does not have is left out already, if there is such a key."""
    parts = parts_of(change.key)
    container: Any = tree.root
    path: KeyPath = ()
    while True:
        name, rest = next_name(container, parts, is_of_ids=path in _OF_DOTTED)
        is_entry = isinstance(container, list)
        if name is None or (is_entry and (not rest or int(name) >= len(container))) or container is INVALID:
            break
        if not is_entry and name not in container:
            break
        path = (*path, name)
        if not rest:
            del container[name]
            _forget(tree, path)
            tree.changes[path] = change
            return
        container, parts = container[name], rest
    if container is INVALID:
        return  # the file's own fault says what is wrong
    here = tuple(parts_of(change.key))
    if isinstance(container, list):
        tree.changes[here] = change
        accepted = "accepted: null for a key, or the list without the entry"
        tree.fault(None, here, "is an entry of a list, which null does not take out", accepted=accepted)
    elif ".".join(part for part in here if not is_place(part)) not in all_keys():
        tree.changes[here] = change
        tree.fault(None, here, "is not in the file, and null takes nothing out", hint=nearest_keys(change.key))


def _apply(tree: Tree, change: SetValue) -> None:
    """Go down to the value, making the sections that are not there."""
    parts = parts_of(change.key)
    container: Any = tree.root
    path: KeyPath = ()
    first_new: KeyPath | None = None
    while True:
        name, rest = next_name(container, parts, is_of_ids=path in _OF_DOTTED)
        if name is None:
            tree.changes[path] = change
            is_list = isinstance(container, list)
            entries = f"{len(container)} entr{'y' if len(container) == 1 else 'ies'}" if is_list else ""
            problem = f"has {entries}, and none has this number" if is_list else "has no keys"
            accepted = f"accepted: 0 to {len(container)}, where the last adds one" if is_list else ""
            given = "" if is_list else shown(str(container))
            tree.fault(None, path, problem, given=parts[0] if is_list else given, accepted=accepted)
            return
        path = (*path, name)
        is_there = name in container if isinstance(container, dict) else int(name) < len(container)
        if not is_there and first_new is None:
            first_new = path
        if not rest:
            break
        if not is_there:
            _put(container, name, {})
        container, parts = container[name], rest
        if container is INVALID:
            return  # the file's own fault says what is wrong
    tree.changes[first_new or path] = change
    value = _value(tree, change, path)
    _forget(tree, path)
    tree.values[first_new or path] = Changed()
    _put(container, name, value)


def next_name(
    container: Any, parts: tuple[str, ...], is_of_ids: bool = False
) -> tuple[str | int | None, tuple[str, ...]]:
    """Find the key or number that a path goes on with, and the parts behind it; None if there can be none."""
    if isinstance(container, list):
        is_entry = is_place(parts[0]) and int(parts[0]) <= len(container)
        return (int(parts[0]) if is_entry else None), parts[1:]
    if not isinstance(container, dict):
        return None, ()
    if is_of_ids:
        return ".".join(parts), ()
    for length in range(len(parts), 1, -1):  # a key that has dots itself
        if (name := ".".join(parts[:length])) in container:
            return name, parts[length:]
    return parts[0], parts[1:]


def _put(container: Any, name: str | int, value: Any) -> None:
    if isinstance(container, list) and name == len(container):
        container.append(value)
    else:
        container[name] = value


def _value(tree: Tree, change: SetValue, path: KeyPath) -> Any:
    """Read the text of the value as the file's own would be; its faults name the option. A number is as it is."""
    if isinstance(change, SetNumber):
        return change.value
    try:
        _forget(tree, path)
        value = tree.document(change.text, path, "one value")
        if value is INVALID and path not in tree.values:
            tree.fault(None, path, "has no value", hint="Give it one; null takes the key out")
        return value
    except yaml.MarkedYAMLError as error:
        said = ", ".join(filter(None, (error.context, error.problem)))
        tree.fault(None, path, f"is not valid YAML: {said}", given=shown(change.text))
    except yaml.reader.ReaderError as error:
        tree.fault(None, path, f"is not text: {error.reason}")
    except UnicodeEncodeError:  # an argument of other bytes, which Python keeps as surrogates
        tree.fault(None, path, "is not text: its bytes are not UTF-8", given=shown(change.text))
    return INVALID


def _forget(tree: Tree, path: KeyPath) -> None:
    """Forget where the file had what stood at a path: nothing may point there."""
    for places in (tree.keys, tree.values):
        for other in [other for other in places if other[: len(path)] == path]:
            del places[other]


# ---------------------------------------------------------------------- the key that somebody meant
_FARTHEST = 200  # characters of what is looked for
_MOST = 4  # paths that a hint names; of a key that stands in more sections it says nothing
_NEAR = 0.8  # of a misspelt key and one of its section, where another section has the key as it is


@cache
def all_keys() -> tuple[str, ...]:
    """Paths of all keys, without the numbers of lists: `other_errors.name`."""
    return tuple(dict.fromkeys(_below(MISSION, "")))


def _below(reader: Reader, path: str) -> Iterator[str]:
    if isinstance(reader, OneOf):
        for form in reader.forms:
            yield from _below(form, path)
    elif isinstance(reader, ListOf):
        yield from _below(reader.section, path)
    elif isinstance(reader, Section):
        for name, key in reader.keys.items():
            here = f"{path}.{name}" if path else name
            yield here
            yield from _below(key.reader, here)


def nearest_keys(path: str) -> str:
    """Hint at the path that somebody meant, or at where its key belongs; empty if there is neither.

    A key that is misspelt is looked for among the keys of its own section alone, a path without its first sections
    among those that end like it.
    """
    path = path[:_FARTHEST]
    parts = parts_of(path)
    meant = _spelt_right(parts)
    if meant and meant != ".".join(parts):  # else one form of a section has the key, and the file another form
        return f"Did you mean {meant!r}?"
    section, missing = _split(_names(path))
    begun = f"{section}." if section else ""
    whole = [known for known in all_keys() if known.startswith(begun) and known.endswith(f".{missing}")]
    if not (whole or section):  # a path that begins with no section says nothing of where its last key belongs
        whole = [known for known in all_keys() if known.rpartition(".")[2] == missing.rpartition(".")[2]]
    if 0 < len(whole) <= _MOST:
        nearest_first = sorted(whole, key=lambda known: -SequenceMatcher(None, path, known).ratio())
        return f"Did you mean {' or '.join(map(repr, nearest_first))}?"
    if section or _is_known((_names(path) or [""])[-1]):
        return section_hint(path, "")
    return did_you_mean(path, all_keys())


def section_hint(path: str, near: str) -> str:
    """Hint at the sections that have the unknown key at the end of a path; `near` is the hint at one spelt alike.

    A key that is nearly one of its own section, or stands nowhere, has the hint `near`. Of several sections those
    that share most of the path are named, of too many none.
    """
    *above, name = _names(path[:_FARTHEST]) or [""]
    found = [known.split(".")[:-1] for known in all_keys() if known.rpartition(".")[2] == name]
    if not found or above in found or get_close_matches(name, _keys_of(above), 1, _NEAR):
        return near
    shared = [_shared(section, above) for section in found]
    nearest = [section for section, length in zip(found, shared, strict=True) if length == max(shared)]
    if len(nearest) > _MOST:
        return ""
    *first, last = [repr(".".join(section)) if section else "the file itself" for section in nearest]
    return f"{name!r} is a key of {', '.join(first)}{' and ' * bool(first)}{last}"


def _is_known(name: str) -> bool:
    """Whether any section has a key."""
    return any(known.rpartition(".")[2] == name for known in all_keys())


def _names(path: str) -> list[str]:
    """Keys of a path, without the numbers of lists."""
    return [part for part in parts_of(path) if not part.isdigit()]


def _keys_of(section: Sequence[str]) -> list[str]:
    path = ".".join(section)
    return [known.rpartition(".")[2] for known in all_keys() if known.rpartition(".")[0] == path]


def _split(names: list[str]) -> tuple[str, str]:
    """The longest beginning of a path that there is, and the rest of the path."""
    known = all_keys()
    count = next((count for count in range(len(names), 0, -1) if ".".join(names[:count]) in known), 0)
    return ".".join(names[:count]), ".".join(names[count:])


def _spelt_right(parts: Sequence[str]) -> str:
    """The path with each unknown key as the nearest of its section; empty if there is none near."""
    meant: list[str] = []
    section: list[str] = []
    for part in parts:
        if part.isdigit():
            meant.append(part)
            continue
        keys = _keys_of(section)
        near = [part] if part in keys else get_close_matches(part, keys, 1, _NEAR if _is_known(part) else 0.6)
        if not near:
            return ""
        meant += near
        section += near
    return ".".join(meant)


def _shared(one: list[str], other: list[str]) -> int:
    """Number of keys with which two paths begin alike."""
    return next((at for at, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))


# ---------------------------------------------------------------------- keys of errors
_ERRORS = (
    *("motion_error", "common_motion_error", "timing_error", "propagation", "other_errors"),
    *("oscillator", "synchronization"),
)
_NO_SIZES = ("age", "arm", "averaging", "bandwidth", "correlation_time", "frequency", "interval")
ACCEPTED_ERRORS = (
    "accepted: a key of an error with one number, such as platforms.receiver.motion_error.velocity, "
    "platforms.receiver.motion_error.imu.gyro_bias, platforms.receiver.oscillator.level, timing_error.quadratic"
)


def is_error(key: str) -> bool:
    """Whether a key stands where a mission file states errors, and is none of their other numbers."""
    parts = parts_of(key)
    return any(part in _ERRORS for part in parts[:3]) and parts[-1] not in _NO_SIZES


def name_of_error(key: str) -> str:
    """The key of an error as rows name it: `receiver.velocity` for `platforms.receiver.motion_error.velocity`."""
    return ".".join(part for part in parts_of(key) if part not in ("platforms", "motion_error"))


def report_specified(tree: Tree) -> None:
    """Say of `allocation.specify` which of its keys are no errors."""
    given = tree.root["allocation"]["specify"]
    for place, key in enumerate(given):
        path = ("allocation", "specify", key if isinstance(given, dict) else place)
        if ".".join(_names(key)) not in all_keys():
            near = nearest_keys(key)
            tree.report(path, Problem("names no key of a mission file", ACCEPTED_ERRORS, near, is_of_key=True))
        elif not is_error(key):
            tree.report(path, Problem("names no error that can be specified", ACCEPTED_ERRORS, is_of_key=True))
