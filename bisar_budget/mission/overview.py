"""A mission at a glance, as a notebook shows it: radar, aperture, where the platforms are and how they move."""

import math
from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING

from bisar_budget import notebook
from bisar_budget.faults import changes_words
from bisar_budget.geometry import PlatformState
from bisar_budget.units import format_quantity

if TYPE_CHECKING:
    from bisar_budget.mission.model import Mission


def overview(mission: "Mission") -> str:
    """HTML of a mission."""
    geometry, rules = mission.geometry, mission.allocation
    rows = [
        ("center frequency", format_quantity(mission.radar.center_frequency, "Hz", 4)),
        ("bandwidth", format_quantity(mission.radar.bandwidth, "Hz", 4)),
        ("aperture time", format_quantity(mission.collection.aperture_time, "s", 4)),
        *_platform("transmitter", geometry.transmitter),
        *_platform("receiver", geometry.receiver),
        ("bistatic angle", f"{math.degrees(geometry.bistatic_angle):.3g}°"),
        ("rules", f"{mission.gating_model} model, combine: {rules.combine}"),
    ]
    file = f'<p class="muted">{escape(" ".join((mission.file, changes_words(mission.changes))))}</p>'
    title = f"<p><strong>{escape(mission.name)}</strong></p>"
    return notebook.page(title, notebook.table(("", ""), rows), file)


def _platform(name: str, state: PlatformState) -> Iterator[tuple[str, str]]:
    speed = math.hypot(*state.velocity)
    moves = "stands still" if state.is_still else f"moves at {format_quantity(speed, 'm/s', 4)}"
    said = f"{format_quantity(state.slant_range, 'm', 4)} away, {math.degrees(state.elevation):.1f}° high, {moves}"
    yield name, said
