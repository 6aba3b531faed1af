"""Changes of single keys of a mission with the option `--set KEY=VALUE`, and hints for unknown keys.

`--set KEY=VALUE` changes a value for one run only. The value is put into the tree of the parsed file before the tree
is interpreted, so it is checked in the same way as a value in the file. `KEY=null` removes the key. The known keys
are defined by the readers of the mission (`readers`).
"""

from collections.abc import Iterator, Sequence
from difflib import SequenceMatcher, get_close_matches
from functools import cache

import yaml

from bisar_budget.error_kinds.registry import motion_kinds
from bisar_budget.faults import Changed, InvalidValueError, KeyPath, Problem, SetNumber, SetValue, shown
from bisar_budget.mission.model import MISSION
from bisar_budget.mission.readers import (
    INVALID,
    ListOf,
    OneOf,
    Paired,
    Reader,
    RegisteredSizes,
    Section,
    did_you_mean,
    is_index,
)
from bisar_budget.mission.tree import MAX_BYTES, NULLS, Content, Tree

_ACCEPTED_CHANGE = "accepted: KEY=VALUE, such as radar.bandwidth=150MHz"
_MAX_KEY_CHARACTERS = 500  # ten times the longest path of the schema
# Sections whose keys have dots: ids of rows, or whole paths.
_WITH_DOTTED_KEYS = (("requirement_ids",), ("requirement_texts",), ("specifications",), ("allocation", "specify"))


def read_changes(texts: Sequence[str]) -> tuple[SetValue, ...]:
    """Split the string `KEY=VALUE` of each option `--set` into its key and its value.

    Raises
    ------
    InvalidValueError
        An option has no key or no `=`, or two options have the same key.
    """
    changes: dict[tuple[str, ...], SetValue] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        key = key.strip()
        if not equals or not key:
            raise InvalidValueError(f"{shown(text)!r} is not KEY=VALUE", _ACCEPTED_CHANGE)
        if len(key) > _MAX_KEY_CHARACTERS or len(value) > MAX_BYTES:
            raise InvalidValueError(f"{shown(text)!r} is too long", _ACCEPTED_CHANGE)
        steps = parts_of(key)
        if "" in steps:
            raise InvalidValueError(f"{shown(key)!r} is no path of keys", _ACCEPTED_CHANGE)
        if steps in changes:
            raise InvalidValueError(f"{shown(key)} is set twice", "accepted: each key once")
        changes[steps] = SetValue(key, value.strip())
    return tuple(changes.values())


def parts_of(key: str) -> tuple[str, ...]:
    """Split the path of a key into its keys and list indices.

    Both `other_errors[0].name` and `other_errors.0.name` give `("other_errors", "0", "name")`.
    """
    return tuple(key.replace("[", ".").replace("]", "").split("."))


def apply_changes(tree: Tree, changes: Sequence[SetValue]) -> None:
    """Put the value of each option `--set` into the tree of a mission file, and report invalid values as faults.

    The value replaces the value in the file, or is added if the file has no such value. A null removes the key.

    Raises
    ------
    UnusableError
        The tree has too many faults, or a fault after which it cannot be read further. The fault is stored in the
        tree.
    """
    for change in changes:
        if takes_out(change):
            _take_out(tree, change)
        else:
            _apply(tree, change)


def takes_out(change: SetValue) -> bool:
    """Whether an option removes a key by setting it to a YAML null, as in `--set requirements.islr=null`."""
    return not isinstance(change, SetNumber) and change.text in NULLS and change.text != ""


def _take_out(tree: Tree, change: SetValue) -> None:
    """Remove the key that an option sets to null from the tree.

    If a known key is missing from the file, there is nothing to remove, which is not a fault. An unknown key is a
    fault, and so is an entry of a list, because null cannot remove it.
    """
    steps = parts_of(change.key)
    container: Content = tree.root
    path: KeyPath = ()
    while True:
        pair = pair_at(container, path, steps[0])
        if pair is not None and steps[0] == pair.name_of_number:
            container = _spread(tree, path, container, pair)
        name, remaining = next_name(container, steps, has_dotted_keys=path in _WITH_DOTTED_KEYS)
        is_entry = isinstance(container, list)
        if name is None or (is_entry and (not remaining or int(name) >= len(container))) or container is INVALID:
            break
        if not is_entry and name not in container:
            break
        path = (*path, name)
        if not remaining:
            del container[name]
            _forget(tree, path)
            tree.changes[path] = change
            return
        container, steps = container[name], remaining
    if container is INVALID:
        return  # the tree has a fault for the invalid value
    here = tuple(parts_of(change.key))
    if isinstance(container, list):
        tree.changes[here] = change
        accepted = "accepted: null for a key, or the list without the entry"
        tree.fault(None, here, "is an entry of a list, which null does not take out", accepted=accepted)
    elif ".".join(step for step in here if not is_index(step)) not in all_keys():
        tree.changes[here] = change
        tree.fault(None, here, "is not in the file, and null takes nothing out", hint=nearest_keys(change.key))


def _apply(tree: Tree, change: SetValue) -> None:
    """Put the value of an option into the tree at the path of its key; missing sections on the path are added."""
    steps = parts_of(change.key)
    container: Content = tree.root
    path: KeyPath = ()
    first_new: KeyPath | None = None
    while True:
        if (pair := pair_at(container, path, steps[0])) is not None:
            container = _spread(tree, path, container, pair)
        name, remaining = next_name(container, steps, has_dotted_keys=path in _WITH_DOTTED_KEYS)
        if name is None:
            tree.changes[path] = change
            is_list = isinstance(container, list)
            entries = f"{len(container)} entr{'y' if len(container) == 1 else 'ies'}" if is_list else ""
            problem = f"has {entries}, and none has this number" if is_list else "has no keys"
            accepted = f"accepted: 0 to {len(container)}, where the last adds one" if is_list else ""
            shown_value = "" if is_list else shown(str(container))
            tree.fault(None, path, problem, given=steps[0] if is_list else shown_value, accepted=accepted)
            return
        path = (*path, name)
        is_there = name in container if isinstance(container, dict) else int(name) < len(container)
        if not is_there and first_new is None:
            first_new = path
        if not remaining:
            break
        if not is_there:
            _put(container, name, {})
        container, steps = container[name], remaining
        if container is INVALID:
            return  # the tree has a fault for the invalid value
    tree.changes[first_new or path] = change
    value = _value(tree, change, path)
    _forget(tree, path)
    tree.values[first_new or path] = Changed()
    _put(container, name, value)


def pair_at(content: Content, path: Sequence[str | int], step: str) -> Paired | None:
    """Reader of the number at `path`, if `step` is a key of its form as a section, such as `confidence`.

    The result is None if `content` is no number alone, so that it already has keys.
    """
    if not isinstance(content, str | list) or (isinstance(content, list) and is_index(step)):
        return None
    readers = _readers_at(MISSION, path)
    return next((reader for reader in readers if isinstance(reader, Paired) and step in reader.pair.keys), None)


def _readers_at(reader: Reader[object], path: Sequence[str | int]) -> Iterator[Reader[object]]:
    """Yield the reader at a path below `reader`; several if a section on the path has several forms."""
    if not path:
        yield reader
        return
    for form in reader.forms if isinstance(reader, OneOf) else (reader,):
        if (below := form.below(str(path[0]))) is not None:
            yield from _readers_at(below, path[1:])


def _spread(tree: Tree, path: KeyPath, content: Content, pair: Paired) -> Content:
    """Write a number alone as a section, so that an option can put a second value beside it.

    The positions in the file move with the number, so that a fault in it is still found there. `content` is the
    number, and `pair` is the reader of the section. Returns the section.
    """
    section = pair.as_section(content)
    container = tree.root
    for name in path[:-1]:
        container = container[name]
    container[path[-1]] = section
    number_path = (*path, pair.name_of_number)
    for below in [below for below in tree.values if below[: len(path)] == path]:
        tree.values[*number_path, *below[len(path) :]] = tree.values[below]
    return section


def next_name(
    container: Content, steps: tuple[str, ...], has_dotted_keys: bool = False
) -> tuple[str | int | None, tuple[str, ...]]:
    """Split the steps of a path into the first key or index, which belongs to `container`, and the remaining steps.

    The first key or index is None if the container cannot have it. A key may itself contain dots. If
    `has_dotted_keys`, all steps together are a single key, joined by dots.
    """
    if isinstance(container, list):
        is_entry = is_index(steps[0]) and int(steps[0]) <= len(container)
        return (int(steps[0]) if is_entry else None), steps[1:]
    if not isinstance(container, dict):
        return None, ()
    if has_dotted_keys:
        return ".".join(steps), ()
    for length in range(len(steps), 1, -1):  # a key that has dots itself
        if (name := ".".join(steps[:length])) in container:
            return name, steps[length:]
    return steps[0], steps[1:]


def _put(container: Content, name: str | int, value: object) -> None:
    """Set a value at a key of a mapping or at an index of a list; an index equal to the length appends the value."""
    if isinstance(container, list) and name == len(container):
        container.append(value)
    else:
        container[name] = value


def _value(tree: Tree, change: SetValue, path: KeyPath) -> Content:
    """Parse the value that an option sets in the same way as a value in the file.

    A value that comes from a sweep is already a number, and is returned unchanged.

    Faults are added to the tree and name the option. Returns `INVALID` for a string that cannot be parsed.
    """
    if isinstance(change, SetNumber):
        return change.value
    try:
        _forget(tree, path)
        value = tree.document(change.text, path, "one value")
        if value is INVALID and path not in tree.values:
            tree.fault(None, path, "has no value", hint="Give it one; null takes the key out")
        return value
    except yaml.MarkedYAMLError as error:
        reason = ", ".join(filter(None, (error.context, error.problem)))
        tree.fault(None, path, f"is not valid YAML: {reason}", given=shown(change.text))
    except yaml.reader.ReaderError as error:
        tree.fault(None, path, f"is not text: {error.reason}")
    except UnicodeEncodeError:  # Python keeps the bytes of an argument that is not UTF-8 as surrogates
        tree.fault(None, path, "is not text: its bytes are not UTF-8", given=shown(change.text))
    return INVALID


def _forget(tree: Tree, path: KeyPath) -> None:
    """Delete the file positions of a replaced value and of all values inside it, so that no fault refers to them."""
    for events in (tree.keys, tree.values):
        for key_path in [key_path for key_path in events if key_path[: len(path)] == path]:
            del events[key_path]


# ---------------------------------------------------------------------- hints for unknown keys
_MAX_PATH_CHARACTERS = 200  # of an unknown path; only these are compared with known paths
_MAX_HINT_PATH_COUNT = 4  # in a hint; a key that occurs in more sections gets no hint
# Smallest similarity at which an unknown key counts as a misspelt key of its section. A key that exists in another
# section needs the first ratio, and any other key the second ratio.
_KNOWN_KEY_SIMILARITY_RATIO, _UNKNOWN_KEY_SIMILARITY_RATIO = 0.8, 0.6


@cache
def all_keys() -> tuple[str, ...]:
    """Paths of all keys that a mission file may have, without indices of lists, such as `other_errors.name`."""
    return tuple(dict.fromkeys(_below(MISSION, "")))


def _below(reader: Reader[object], path: str) -> Iterator[str]:
    """Yield the paths of all keys below `path`, the path of a value that `reader` reads."""
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
    elif isinstance(reader, RegisteredSizes):
        yield from (f"{path}.{name}" for name in motion_kinds())


def nearest_keys(path: str) -> str:
    """Hint for the path of an unknown key: the most similar known path, or the sections that have its last key.

    A misspelt key is compared only with the keys of its own section. A path that lacks its first sections is compared
    with the known paths that end in the same way. The hint is empty if neither comparison gives a known path.
    """
    path = path[:_MAX_PATH_CHARACTERS]
    steps = parts_of(path)
    meant = _spelt_right(steps)
    if meant and meant != ".".join(steps):  # they are equal if the key belongs to another form of the section
        return f"Did you mean {meant!r}?"
    section, missing = _split(_names(path))
    prefix = f"{section}." if section else ""
    candidates = [key for key in all_keys() if key.startswith(prefix) and key.endswith(f".{missing}")]
    if not (candidates or section):  # without a known section, any section may have the last key
        candidates = [key for key in all_keys() if key.rpartition(".")[2] == missing.rpartition(".")[2]]
    if 0 < len(candidates) <= _MAX_HINT_PATH_COUNT:
        nearest_first = sorted(candidates, key=lambda candidate: -SequenceMatcher(None, path, candidate).ratio())
        return f"Did you mean {' or '.join(map(repr, nearest_first))}?"
    if section or _is_key((_names(path) or [""])[-1]):
        return section_hint(path, "")
    return did_you_mean(path, all_keys())


def section_hint(path: str, near: str) -> str:
    """Hint for the path of an unknown key: the sections in which its last key is known, or else the hint `near`.

    `near` is a hint that names a similar key. It is returned if the last key resembles a key of its own section, or
    if no section has this key. Otherwise the hint names the sections whose paths share the most leading keys with
    this path. The hint is empty if there are more than `_MAX_HINT_PATH_COUNT` such sections.
    """
    *above, name = _names(path[:_MAX_PATH_CHARACTERS]) or [""]
    sections = [key.split(".")[:-1] for key in all_keys() if key.rpartition(".")[2] == name]
    if not sections or above in sections or get_close_matches(name, _keys_of(above), 1, _KNOWN_KEY_SIMILARITY_RATIO):
        return near
    shared = [_shared(section, above) for section in sections]
    nearest = [section for section, length in zip(sections, shared, strict=True) if length == max(shared)]
    if len(nearest) > _MAX_HINT_PATH_COUNT:
        return ""
    *first, last = [repr(".".join(section)) if section else "the file itself" for section in nearest]
    return f"{name!r} is a key of {', '.join(first)}{' and ' * bool(first)}{last}"


def _is_key(name: str) -> bool:
    """Whether any section of the mission file has a key of this name."""
    return any(key.rpartition(".")[2] == name for key in all_keys())


def _names(path: str) -> list[str]:
    """Split a path into its keys, leaving out the indices of lists."""
    return [step for step in parts_of(path) if not step.isdigit()]


def _keys_of(section: Sequence[str]) -> list[str]:
    """Names of the keys directly in a section; `section` lists the keys on the path of the section."""
    path = ".".join(section)
    return [key.rpartition(".")[2] for key in all_keys() if key.rpartition(".")[0] == path]


def _split(names: list[str]) -> tuple[str, str]:
    """Split a path into its longest leading part that is a known path, and the rest; either may be empty.

    `names` are the keys of the path. In both results, the keys are joined by dots.
    """
    paths = all_keys()
    count = next((count for count in range(len(names), 0, -1) if ".".join(names[:count]) in paths), 0)
    return ".".join(names[:count]), ".".join(names[count:])


def _spelt_right(steps: Sequence[str]) -> str:
    """Replace each unknown key of a path by the most similar key of its section, and return the path.

    Returns an empty string if an unknown key has no similar key.
    """
    meant: list[str] = []
    section: list[str] = []
    for step in steps:
        if step.isdigit():
            meant.append(step)
            continue
        keys = _keys_of(section)
        smallest_ratio = _KNOWN_KEY_SIMILARITY_RATIO if _is_key(step) else _UNKNOWN_KEY_SIMILARITY_RATIO
        near = [step] if step in keys else get_close_matches(step, keys, 1, smallest_ratio)
        if not near:
            return ""
        meant += near
        section += near
    return ".".join(meant)


def _shared(names: list[str], other_names: list[str]) -> int:
    """Number of leading keys that two paths have in common."""
    return next(
        (at for at, (a, b) in enumerate(zip(names, other_names, strict=False)) if a != b),
        min(len(names), len(other_names)),
    )


# ---------------------------------------------------------------------- keys of errors
_ERROR_KEYS = (
    *("motion_error", "common_motion_error", "timing_error", "propagation", "other_errors"),
    *("oscillator", "synchronization"),
)
_NO_SIZES = (
    "after",
    "age",
    "arm",
    "averaging",
    "bandwidth",
    "before",
    "bias",
    "correlation_time",
    "frequency",
    "from",
    "interval",
    "rate",
    "to",
)
ACCEPTED_ERRORS = (
    "accepted: a key of an error with one number, such as platforms.receiver.motion_error.velocity, "
    "platforms.receiver.motion_error.imu.gyro_bias, platforms.receiver.oscillator.level, timing_error.quadratic"
)


def is_error(key: str) -> bool:
    """Whether a key states the size of an error, such as `timing_error.quadratic`.

    In the sections that declare errors, every key states a size, except for keys such as intervals and frequencies.
    """
    steps = parts_of(key)
    is_bias = any(step == "bias" for step in steps)
    return any(step in _ERROR_KEYS for step in steps[:3]) and steps[-1] not in _NO_SIZES and not is_bias


def name_of_error(key: str) -> str:
    """Name of an error in row ids, such as `receiver.velocity` for `platforms.receiver.motion_error.velocity`."""
    return ".".join(step for step in parts_of(key) if step not in ("platforms", "motion_error", "registered"))


def report_specified(tree: Tree) -> None:
    """Add a fault to the tree for each entry of `allocation.specify` that is not the key of an error."""
    specify = tree.root["allocation"]["specify"]
    for index, key in enumerate(specify):
        path = ("allocation", "specify", key if isinstance(specify, dict) else index)
        if ".".join(_names(key)) not in all_keys():
            near = nearest_keys(key)
            tree.report(path, Problem("names no key of a mission file", ACCEPTED_ERRORS, near, is_of_key=True))
        elif not is_error(key):
            tree.report(path, Problem("names no error that can be specified", ACCEPTED_ERRORS, is_of_key=True))
