"""Every key of the mission file as a path, from the readers themselves: to find the one that somebody meant."""

from collections.abc import Iterator
from difflib import SequenceMatcher
from functools import cache

from bisar_budget.mission.readers import Late, ListOf, OneOf, Reader, Section, did_you_mean

_FARTHEST = 200  # characters of what is looked for


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


def nearest_keys(key: str) -> str:
    """Hint at the paths that end like a key, else at the nearest; empty if none is near."""
    last = key.rpartition(".")[2]
    same = [known for known in all_keys() if known.rpartition(".")[2] == last]
    if 0 < len(same) <= 4:
        nearest_first = sorted(same, key=lambda known: -SequenceMatcher(None, key[:_FARTHEST], known).ratio())
        return f"Did you mean {' or '.join(map(repr, nearest_first))}?"
    return did_you_mean(key[:_FARTHEST], all_keys())
