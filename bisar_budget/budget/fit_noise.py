"""Changes of the allowables due to noise in the position log to which a platform's path is fitted.

The allowable of a position or velocity error depends on how the line of sight to the platform rotates. A path fitted
to a noisy log has an error at each time of the aperture, and therefore each allowable has an error too. The error of
the fit is a sum of independent modes along each axis. Each mode is added to the path with plus and minus one sigma,
and the resulting changes of an allowable are combined as a root-sum-square.
"""

from dataclasses import dataclass, replace

import numpy as np

from bisar_budget.arrays import Floats
from bisar_budget.effects.effect import PLATFORMS, subject
from bisar_budget.effects.sources import ErrorListing, exact_ranges
from bisar_budget.error_kinds.path_kinds import POSITION_KIND, VELOCITY_KIND
from bisar_budget.geometry import PlatformState
from bisar_budget.image_plane import nodes_for
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import Platform

MAX_UNSAID_CHANGE_FRACTION = 0.05  # largest change of an allowable without a warning
_DECISIVE_EFFECT_FRACTION = (
    0.1  # of the largest effect per unit of a kind; errors with smaller effects do not decide a verdict
)


@dataclass(frozen=True)
class AllowableNoise:
    """Allowable that is most affected by the noise of the log to which a platform's path is fitted.

    `acceleration` [m/s²] is the standard deviation of the error of the path's acceleration, along the line of sight
    at mid-aperture. `change` is the standard deviation of the relative change of the allowable. `row_id` is the id of
    the row with the allowable.
    """

    acceleration: float
    change: float
    row_id: str


def allowable_noise(mission: Mission, name: str) -> AllowableNoise | None:
    """Find the allowable that changes most due to the noise of the log to which a platform's path is fitted.

    The allowables of the position and velocity errors of both platforms are examined. The result is None if the path
    is not fitted to a log.
    """
    platform: Platform = getattr(mission.platforms, name)
    path = platform.path
    if path is None or path.path_noise is None or path.acceleration_noise is None:
        return None
    look = np.array(path.state.look)
    sigma = float(np.sqrt(max(look @ np.array(path.acceleration_noise) @ look, 0.0)))
    if not sigma > 0:
        return None
    modes = np.array(path.path_noise.modes)  # (modes, orders, 3)
    sides = np.concatenate([np.zeros_like(modes[:1]), modes, -modes])
    position, velocity, half_acceleration, *bends = (tuple(power.T) for power in sides.swapaxes(0, 1))
    error = PlatformState(
        position=position,
        velocity=velocity,
        acceleration=tuple(2 * part for part in half_acceleration),
        bends=tuple(bends),
    )
    shifted = platform._replace(path=path._replace(state=path.state.less(error)))
    cases = mission._replace(platforms=mission.platforms._replace(**{name: shifted}))
    geometry = cases.geometry
    count = nodes_for(geometry, mission.collection.aperture_time, has_direct_path=mission.has_direct_path)
    exact = exact_ranges(cases, geometry, int(np.max(count)), cases=len(sides))
    listing = ErrorListing(cases, geometry, exact)
    worst = AllowableNoise(sigma, 0.0, "")
    for kind in (POSITION_KIND, VELOCITY_KIND):
        units = np.array(
            [
                [np.broadcast_to(effect.qpe, (len(sides),)) for effect in listing.full_legs(place, kind)]
                for place in range(len(PLATFORMS))
            ]
        )  # (platforms, axes, sides)
        changes = _changes(np.abs(units))
        place, axis = np.unravel_index(int(changes.argmax()), changes.shape)
        if changes[place, axis] > worst.change:
            row_id = subject(PLATFORMS[place], kind.name, "xyz"[axis]).id
            worst = replace(worst, change=float(changes[place, axis]), row_id=row_id)
    return worst


def _changes(units: Floats) -> Floats:
    """Standard deviation of the relative change of each allowable due to the error of a fitted path.

    The result is (platforms, axes). `units` (platforms, axes, sides) holds the quadratic phase per unit of each
    error, computed for several paths. The paths along the axis `sides` are the fitted path itself, then the path plus
    each mode of the fit error, then the path minus each mode.
    """
    here = units[..., 0]
    with np.errstate(all="ignore"):
        first, second = np.split(np.abs(here[..., None] / units[..., 1:] - 1), 2, axis=-1)
        changes = np.sqrt(np.square(np.maximum(first, second)).sum(axis=-1))
    return np.where(
        here > _DECISIVE_EFFECT_FRACTION * here.max(), np.nan_to_num(changes, nan=0.0, posinf=np.inf), 0.0
    )
