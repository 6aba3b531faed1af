"""How far long work is: a bar of tqdm in a notebook or a terminal, where it is installed; nothing elsewhere."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from time import monotonic
from typing import Any

from bisar_budget.design.table import Part
from bisar_budget.workers import Progress

_MOMENT = 1.0  # s; what is done before has no bar


def _is_seen() -> bool:
    """Whether somebody watches: a notebook, or a terminal."""
    if "ipykernel" in sys.modules:
        return True
    return sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def watched(label: str) -> Iterator[Progress]:
    """Give what takes how far long work is: (done, total)."""
    began = monotonic()
    bars: list[Any] = []

    def progress(done: int, total: int) -> None:
        if not bars:
            if not _is_seen() or monotonic() - began < _MOMENT or find_spec("tqdm") is None:
                return
            from tqdm.auto import tqdm

            bars.append(tqdm(total=total, desc=label, leave=False))
        bars[0].total = total
        bars[0].update(done - bars[0].n)

    try:
        yield progress
    finally:
        for bar in bars:
            bar.close()


def watched_parts(parts: Iterator[Part], count: int) -> Iterator[Part]:
    """Hand on the parts of a sweep of so many cases."""
    with watched("Checking cases") as progress:
        for part in parts:
            yield part
            progress(part.stop, count)
