"""Notes on a collection that follow from its geometry."""

from collections.abc import Iterator

from bisar_budget import phrases
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.geometry import norm
from bisar_budget.phrases import Note

_TURNING_RAD = 0.1  # half the turn of a line of sight; the quartic term is 1 % of the quadratic there
COARSE_CELL_RAD = 1.0  # of phase between points a range cell apart; beyond, a response spreads over cells
_ABSORBED_RAD = 6.1  # of the same, where the image shows half; measured, uniform window, 8 to 300 MHz


def collection_notes(analysis: Analysis) -> Iterator[Note]:
    """Say where the published model leaves the collection, and where an image shows less than the full one."""
    mission = analysis.mission
    for name, state in (("transmitter", analysis.geometry.transmitter), ("receiver", analysis.geometry.receiver)):
        if not state.is_straight:
            yield phrases.path_curves(name)
        turn = norm(state.look_rate) * mission.collection.aperture_time / 2
        if turn > _TURNING_RAD:
            yield phrases.sight_turns(name, turn)
    if mission.has_direct_path:
        yield phrases.direct_path_is_the_clock()
    cell = phase_across_a_cell(analysis)
    if cell > COARSE_CELL_RAD:
        yield phrases.range_cells_are_coarse(cell, 100 / (1 + (cell / _ABSORBED_RAD) ** 2))


def phase_across_a_cell(analysis: Analysis) -> float:
    """Quadratic phase between points of the ground a range cell c/B apart. [rad]"""
    (by_constant, _), _ = analysis.exact.phases_per_term
    return float(abs(by_constant[0])) * SPEED_OF_LIGHT / analysis.mission.radar.bandwidth
