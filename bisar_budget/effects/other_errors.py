"""Errors from elsewhere that the file states by what they do to the image: a cubic phase, a displacement.

Neither has a sign, and a displacement no direction: each way it has half of its square. A quadratic phase, which has
a sign, is listed in `sources`, and power that is spread in `analysis.spread`.
"""

import math
from collections.abc import Iterator

import numpy as np

from bisar_budget.effects.effect import subject
from bisar_budget.effects.random_effect import RandomEffect, RandomError
from bisar_budget.mission.model import Mission

# Effect of a unit, whichever model: of 1 rad, and of 1 m.
_CUBIC = RandomEffect(0.0, 1.0, 0.0, 0.0, 0.0, np.diag([0.0, 1.0, 0.0, 0.0])[..., None])
_PLACE = RandomEffect(0.0, 0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5), np.diag([0.0, 0.0, 0.5, 0.5])[..., None])
_EFFECTS = {"cubic_phase_error": ("rad", _CUBIC), "location_error": ("m", _PLACE)}


def stated_effects(mission: Mission) -> Iterator[RandomError]:
    """Cubic phases and displacements from elsewhere, those that the file states."""
    for index, other in enumerate(mission.other_errors):
        for key, (unit, effect) in _EFFECTS.items():
            size = getattr(other, key)
            if size is not None:
                what = subject("mission", "other", f"{other.name}.{key}", entry=index)
                yield RandomError(
                    what, unit, np.abs(size), ("other_errors", index, key), effect, effect, spreads=False
                )
