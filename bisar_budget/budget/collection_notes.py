"""What a collection's geometry does to what a report says of it."""

from collections.abc import Iterator

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.geometry import STRAIGHT, norm

_TURNING_RAD = 0.1  # half the turn of a line of sight; the quartic term is 1 % of the quadratic there
COARSE_CELL_RAD = 1.0  # of phase between points a range cell apart; beyond, a response spreads over cells
_ABSORBED_RAD = 6.1  # of the same, where the image shows half; measured, uniform window, 8 to 300 MHz


def collection_notes(analysis: Analysis) -> Iterator[str]:
    """Say where the published model leaves the collection, and where an image shows less than the full one."""
    mission = analysis.mission
    for name, state in (("transmitter", analysis.geometry.transmitter), ("receiver", analysis.geometry.receiver)):
        if state.acceleration != STRAIGHT:
            yield f"the {name}'s path curves: the published model takes it for straight, the full model does not"
        turn = norm(state.look_rate) * mission.collection.aperture_time / 2
        if turn > _TURNING_RAD:
            yield (
                f"the {name}'s line of sight turns by ±{turn:.2g} rad: the published model takes the phase for a "
                "quadratic, the full model does not"
            )
    if mission.has_direct_path:
        yield (
            "the direct path is the clock: the full model takes ranges less the distance of the platforms, and "
            "timing errors have no effect; values of the published model are those without it"
        )
    cell = phase_across_a_cell(analysis)
    if cell > COARSE_CELL_RAD:
        shown = 100 / (1 + (cell / _ABSORBED_RAD) ** 2)
        yield (
            f"points a range cell apart differ by {cell:.3g} rad of quadratic phase: a defocused response spreads "
            f"over range cells instead. An image shows about {shown:.2g} % of the phase: the limits are conservative"
        )


def phase_across_a_cell(analysis: Analysis) -> float:
    """Quadratic phase between points of the ground a range cell c/B apart. [rad]"""
    (by_constant, _), _ = analysis.exact.phases_per_term
    return abs(by_constant) * SPEED_OF_LIGHT / analysis.mission.radar.bandwidth
