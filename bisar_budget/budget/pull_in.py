"""What bounds autofocus beside its algorithm: range walk, and the room that the smear needs.

A phase of π·N at the aperture edge walks λN/2 in range, N·B/2f₀ cells, and smears a point over 4N cross-range cells.
Measured on images of points (`tests/simulate/test_pull_in_caps.py`): one-dimensional autofocus works up to half a
cell of walk and beyond, but half a cell costs 0.6 dB that no phase takes out, a whole one 1.3 dB. What makes it give
out is the patch, whatever walk and bandwidth: phase gradient needs three times the smear, map drift one and a half;
with less they leave the image smeared at a hundredth of a cell of walk as at a third of one.
"""

from collections.abc import Iterator

from bisar_budget.budget.findings import FileWarning, Resolution
from bisar_budget.mission.model import Mission
from bisar_budget.units import format_quantity

WALK_CELLS = 0.5
ROOM = {"pga": 3.0, "map_drift": 1.5}  # patch over smear


def pull_in_caps(mission: Mission, resolution: Resolution) -> Iterator[FileWarning]:
    """Warn where `autofocus.n_pull` asks for more than range walk or the scene's size leaves."""
    n_pull, algorithm = mission.autofocus.n_pull, mission.autofocus.algorithm
    if n_pull is None:
        return
    line = mission.line(("autofocus", "n_pull"))
    ratio = mission.radar.center_frequency / mission.radar.bandwidth
    if n_pull > ratio * 2 * WALK_CELLS:
        yield FileWarning(
            line=line,
            message=(
                f"autofocus.n_pull: an error of {n_pull:g}π rad walks over {n_pull / ratio / 2:.3g} range cells, and "
                f"correction along one dimension costs over 0.6 dB; half a cell is n_pull {ratio:.4g}, f0/B"
            ),
        )
    radius = mission.scene.radius
    smear = 4 * n_pull * resolution.cross_range
    if radius is not None and ROOM[algorithm] * smear > 2 * radius:
        largest = 2 * radius / (4 * resolution.cross_range * ROOM[algorithm])
        yield FileWarning(
            line=line,
            message=(
                f"autofocus.n_pull: an error of {n_pull:g}π rad smears a point over {format_quantity(smear, 'm')}, "
                f"and {algorithm} needs {ROOM[algorithm]:g} times that; a scene of "
                f"{format_quantity(2 * radius, 'm')} across holds n_pull {largest:.3g}"
            ),
        )
