"""How long a question takes, said while it is answered: each of its values is a whole check."""

from collections.abc import Callable, Iterator, Sequence
from time import perf_counter
from typing import NamedTuple, TypeVar

Item = TypeVar("Item")
_WARM = 1  # of the values: the first one imports what it needs


class Watch(NamedTuple):
    """Who waits: `foreseen` takes how long all values will take [s] and their number, `done` how many are done."""

    foreseen: Callable[[float, int], None]
    done: Callable[[int], None]


def watched(items: Sequence[Item], watch: Watch | None) -> Iterator[Item]:
    """Give the items; when two are done, say how long all will take, and then of each that it is done."""
    began = 0.0
    for count, item in enumerate(items):
        if watch is not None:
            if count == _WARM:
                began = perf_counter()
            elif count == _WARM + 1:
                watch.foreseen((perf_counter() - began) * len(items), len(items))
                watch.done(count)
            elif count > _WARM + 1:
                watch.done(1)
        yield item
