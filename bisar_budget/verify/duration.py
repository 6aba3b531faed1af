"""How long the images of a mission will take, said before they are formed: their size, times what a small one took.

What one pixel and pulse take depends on the machine, on what else runs on it, and on whether kernels are compiled. So
it is measured, on an image of the mission itself, where the size leaves any doubt.
"""

import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from bisar_budget.mission.model import Mission
from bisar_budget.simulate.collection import CELLS, RANGE_CELLS, Chip, Errors, PointCollection, pulses_for
from bisar_budget.verify.aperture_reading import read_aperture
from bisar_budget.verify.study import Study

_LONG = 60.0  # s; far below it nothing is measured
_SLOWEST = 1.0  # s that the smallest image takes on a slow and busy machine
_BESIDE = 1.25  # images at a limit and on both sides of it, over those at it


class _NotFormedError(ValueError):
    """An image whose size is known, which is all that was asked."""


class _Sizes(PointCollection):
    """A collection that notes the size of every image it is asked for, and forms none."""

    def __init__(self, mission: Mission, study: Study) -> None:
        super().__init__(mission, study.geometry)
        self.asked: list[
            float
        ] = []  # pixels times pulses of two images and their reading, over those of the smallest

    def pair(
        self, errors: Errors, place: tuple[float, float], cells: int = CELLS, range_cells: int = RANGE_CELLS
    ) -> tuple[Chip, Chip]:
        """Note two images."""
        self._require_room(cells, range_cells)
        self.asked.append(cells * range_cells * pulses_for(cells) / (CELLS * RANGE_CELLS * pulses_for(CELLS)))
        raise _NotFormedError("its size is known")

    def chip(self, centre: tuple[float, float], errors: Errors, *, cells: int = CELLS, **_: object) -> Chip:
        """Note one of two images of a single line."""
        self._require_room(cells, 0)
        self.asked.append(cells * pulses_for(cells) / (CELLS * RANGE_CELLS * pulses_for(CELLS)))
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
        known[row_id]()
    units = _BESIDE * sum(max(1.0, size) for size in sizes.asked)
    return units * _smallest_pair(PointCollection(mission, study.geometry)) if units * _SLOWEST > _LONG else 0.0


def _smallest_pair(collection: PointCollection) -> float:
    """Time that two of the smallest images of a collection and their reading take. [s]"""
    centre, errors = (0.0, 0.0), Errors()
    try:
        collection.chip(centre, errors, cells=2)  # compiled, imported
        begun = time.perf_counter()
        chips = collection.pair(errors, centre)
        read_aperture(collection, errors, centre, *chips)
    except (ValueError, np.linalg.LinAlgError):
        return 0.0  # where there is none of these, there is hardly any image
    return time.perf_counter() - begun
