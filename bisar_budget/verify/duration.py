"""How long the images of a mission will take, said before they are formed, from what a small and a larger one took.

What one pixel and pulse take depends on the machine, on what else runs on it, and on whether kernels are compiled. So
it is measured, on images of the mission itself, where the size leaves any doubt.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

import numpy as np

from bisar_budget.mission.model import Mission
from bisar_budget.simulate.collection import CELLS, RANGE_CELLS, Chip, Errors, PointCollection, pulses_for
from bisar_budget.simulate.phase_history import Floats
from bisar_budget.verify.study import Study

_LONG = 60.0  # s; far below it nothing is measured
_SLOWEST = 1.0  # s that the smallest image takes on a slow and busy machine
_LARGER = 8  # times the cells of the smallest image: 32 times its pixels and pulses
_BESIDE = 1.25  # images at a limit and on both sides of it, over those at it


class _NotFormedError(ValueError):
    """An image whose size is known, which is all that was asked."""


class _Sizes(PointCollection):
    """A collection that notes the size of every image it is asked for, and forms none."""

    def __init__(self, mission: Mission, study: Study) -> None:
        super().__init__(mission, study.geometry)
        self.asked: list[float] = []  # sizes, see `_size`

    def pair(
        self, errors: Errors, place: tuple[float, float], cells: int = CELLS, range_cells: int = RANGE_CELLS
    ) -> tuple[Chip, Chip]:
        """Note two images."""
        self._require_room(cells, range_cells)
        self.asked.append(_size(cells, range_cells))
        raise _NotFormedError("its size is known")

    def window(self, count: int) -> Floats:
        """Draw no noise: that takes seconds, however large the images."""
        raise _NotFormedError(f"{count} weights are not needed")

    def chip(self, centre: tuple[float, float], errors: Errors, *, cells: int = CELLS, **_: object) -> Chip:
        """Note one of two images of a single line."""
        self._require_room(cells, 0)
        self.asked.append(_size(cells, 1))
        raise _NotFormedError("its size is known")


def seconds_to_verify(
    mission: Mission, cases: Callable[[Study], Mapping[str, Callable[[], object]]], wanted: Sequence[str]
) -> float:
    """About how long one process takes to verify some rows; 0 where it is far below a minute. [s]

    Parameters
    ----------
    mission : Mission
        As loaded.
    cases : callable
        Calls that verify the rows of a study, by id.
    wanted : sequence of str
        Ids of the rows.
    """
    study = Study(mission)
    study.collection = sizes = _Sizes(mission, study)
    known = cases(study)
    for row_id in wanted:
        with suppress(_NotFormedError):
            known[row_id]()
    asked = [max(1.0, size) for size in sizes.asked]
    if _BESIDE * sum(asked) * _SLOWEST <= _LONG:
        return 0.0
    study = Study(mission)
    try:
        study.collection.chip((0.0, 0.0), Errors(), cells=2)  # compiled, imported
        smallest = _seconds(study, CELLS)
    except (ValueError, np.linalg.LinAlgError):
        return 0.0  # where there is none of these, there is hardly any image
    try:
        grows = max(0.0, _seconds(study, _LARGER * CELLS) - smallest) / (_size(_LARGER * CELLS, RANGE_CELLS) - 1)
    except (ValueError, np.linalg.LinAlgError):
        grows = smallest  # no room for a larger one
    return _BESIDE * sum(smallest + grows * (size - 1) for size in asked)


def _size(cells: int, range_cells: int) -> float:
    """Pixels times pulses of an image, over those of the smallest."""
    return cells * range_cells * pulses_for(cells) / (CELLS * RANGE_CELLS * pulses_for(CELLS))


def _seconds(study: Study, cells: int) -> float:
    """Time that two images of no error and their reading take. [s]"""
    errors, begun = Errors(), time.perf_counter()
    effect = study.collection.effect(errors)
    study.read(errors, effect, *study.collection.pair(errors, effect.displacement, cells))
    return time.perf_counter() - begun
