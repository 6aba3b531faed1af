"""Every key of the mission file as a path, from the readers themselves: to find the one that somebody meant."""

from collections.abc import Iterator, Sequence
from difflib import SequenceMatcher, get_close_matches
from functools import cache

from bisar_budget.mission.readers import Late, ListOf, OneOf, Reader, Section, did_you_mean

_FARTHEST = 200  # characters of what is looked for
_MOST = 4  # paths that a hint names; of a key that stands in more sections it says nothing
_NEAR = 0.8  # of a misspelt key and one of its section, where another section has the key as it is


@cache
def all_keys() -> tuple[str, ...]:
    """Paths of all keys, without the numbers of lists: `other_errors.name`."""
    from bisar_budget.mission.model import MISSION

    return tuple(dict.fromkeys(_below(MISSION, "")))


def _below(reader: Reader, path: str) -> Iterator[str]:
    if isinstance(reader, Late):
        yield from _below(reader.load(), path)
    elif isinstance(reader, OneOf):
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
    parts = path.replace("[", ".").replace("]", "").split(".")
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
    return [part for part in path.replace("[", ".").replace("]", "").split(".") if not part.isdigit()]


def _keys_of(section: Sequence[str]) -> list[str]:
    path = ".".join(section)
    return [known.rpartition(".")[2] for known in all_keys() if known.rpartition(".")[0] == path]


def _split(names: list[str]) -> tuple[str, str]:
    """The longest beginning of a path that there is, and the rest of the path."""
    known = all_keys()
    count = next((count for count in range(len(names), 0, -1) if ".".join(names[:count]) in known), 0)
    return ".".join(names[:count]), ".".join(names[count:])


def _spelt_right(parts: list[str]) -> str:
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
