"""Bounds of autofocus beside its algorithm: range walk, and the room that the smear needs.

A phase of π·N at the aperture edge walks λN/2 in range, N·B/2f₀ cells, and smears a point over 4N cross-range cells.
Measured on images of points (`tests/simulate/test_pull_in_caps.py`): one-dimensional autofocus works up to half a
cell of walk and beyond, but half a cell costs 0.6 dB that no phase takes out, a whole one 1.3 dB. What makes it give
out is the patch, whatever walk and bandwidth: phase gradient needs three times the smear, map drift one and a half;
with less they leave the image smeared at a hundredth of a cell of walk as at a third of one.
"""

import math
from typing import NamedTuple

from bisar_budget import phrases
from bisar_budget.analysis.allocation import range_walk_cap
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import Note
from bisar_budget.units import format_quantity

ROOM = {"pga": 3.0, "map_drift": 1.5}  # patch over smear


class Caps(NamedTuple):
    """Largest N_pull by range walk, f₀/B, and by the scene's size; None where the file gives none.

    No gain goes beyond that of range walk; beyond that of the scene a warning stands.
    """

    walk: float
    scene: float | None = None


def caps(mission: Mission) -> Caps:
    """Bounds on N_pull that no autofocus of a mission goes beyond."""
    walk = range_walk_cap(mission)
    if mission.scene.radius is None:
        return Caps(walk)
    cell = mission.geometry.cross_range_resolution(mission.radar.wavelength, mission.collection.aperture_time)
    return Caps(walk, 2 * mission.scene.radius / (4 * cell * ROOM[mission.autofocus.algorithm]))


def needed_sentence(n_pull: float, caps: Caps) -> Note:
    """Say from which N_pull an error would pass, or that none can correct it.

    Parameters
    ----------
    n_pull : float
        Smallest N_pull with which the error passes.
    caps : Caps
        What `caps` says of the mission.
    """
    if caps.scene is not None and caps.scene < min(n_pull, caps.walk):
        allowed = f"the scene's size allows {rounded_down(caps.scene)}"
    elif n_pull > caps.walk:
        allowed = f"range walk allows {rounded_down(caps.walk)}"
    else:
        return phrases.passes_from(math.ceil(n_pull * 100 * (1 - 1e-12)) / 100)
    return phrases.beyond_autofocus(_up(n_pull), allowed)


def _up(number: float) -> str:
    """Three digits, rounded up; whole from a hundred on, with a space between thousands."""
    if number >= 100:
        return f"{math.ceil(number * (1 - 1e-12)):,}".replace(",", " ")
    step = 10.0 ** (math.floor(math.log10(number)) - 2)
    return f"{math.ceil(number / step * (1 - 1e-12)) * step:.3g}"


def rounded_down(number: float) -> str:
    """Three digits, rounded down; whole from a hundred on, with a space between thousands."""
    if number >= 100:
        return f"{math.floor(number * (1 + 1e-12)):,}".replace(",", " ")
    return format_quantity(number, "", 3, "down")
