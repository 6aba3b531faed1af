"""How delays in the air come to range errors, and what errors from elsewhere state."""

from collections.abc import Iterator

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.spread import mainlobe_energy, spread_limit, stated_powers
from bisar_budget.constants import EARTH_RADIUS
from bisar_budget.effects.air_delays import (
    CONTENT,
    DELAY,
    ELECTRONS,
    IONOSPHERE,
    TROPOSPHERE,
    group_delay,
    leg_factor,
    metres_per_unit,
)
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.findings.row import Row
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.model import Mission
from bisar_budget.mission.propagation import ABOVE_THE_AIR, height_of
from bisar_budget.report.explain.explained_error import stated
from bisar_budget.report.explain.notation import Step, equation, number, step, with_unit

_MOMENTS = (-1.0, -0.5, 0.0, 0.5, 1.0)  # of half an aperture


def delay_on_a_leg(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """From the delay of the zenith to that of the leg over the aperture, of a unit."""
    mission, delay = analysis.mission, error.subject.axis
    path: PlatformState = getattr(analysis.geometry, error.owner)
    (x, y, z), height = path.position, float(height_of(path.position))
    if delay == CONTENT and height < ABOVE_THE_AIR:
        yield from step(f"The {error.owner} flies at {height:.6g} m, below the ionosphere: no electrons on its leg")
        return
    values = {"R": path.slant_range, "z": z}
    if height < ABOVE_THE_AIR:
        title, formula = "Within the air, over a flat Earth: 1 over the sine of the elevation", "R/z"
    else:
        shell = TROPOSPHERE if delay == DELAY else min(IONOSPHERE, height)
        values = {"p": (x * x + y * y) ** 0.5, "R": path.slant_range, "h": shell, "R_E": EARTH_RADIUS}
        title = "Above the air, through a spherical shell at height h; p is the distance along the ground's plane"
        formula = "1/sqrt(1 - (p/R)^2/(1 + h/R_E)^2)"
    factor = float(leg_factor(delay, path.position, path.position))
    yield from step(f"{title}; at mid-aperture", *equation("m", formula, values, factor, ""))
    scale = float(metres_per_unit(mission, delay))
    if delay == CONTENT:
        values = {"m": factor, "f_0": mission.radar.center_frequency}
        lines = equation("g", f"{ELECTRONS:g}*m/f_0^2", values, factor * scale, "m per 1/m^2")
        yield from step("Group delay by a unit; the phase at the centre frequency is advanced by as much", *lines)
    half = mission.collection.aperture_time / 2
    times = [half * moment for moment in _MOMENTS]
    yield from step(
        "Delay by a unit as the elevation changes over the aperture",
        *(
            f"{time:+.6g} s: {number(float(group_delay(mission, path, delay, time)))} {_per_unit(error)}"
            for time in times
        ),
    )
    if delay == CONTENT:
        yield from step(
            "Range error in the image: its constant part is that of the group, ḡ; its slope and what bends are those "
            "of the phase, which has the other sign: 2·ḡ − g"
        )


def _per_unit(error: RandomError) -> str:
    return "m per m" if error.unit == "m" else "m per 1/m²"


def effect_from_elsewhere() -> Iterator[Step]:
    """What is stated as an effect."""
    yield from step("Stated by its effect on the image, whatever makes it; it has no coverage factor")


def explained_power(mission: Mission, allocation: Allocation, row: Row) -> Iterator[Step]:
    """From a stated ISLR to the phase that spreads as much, and to what is required."""
    index, model = row.subject.entry or 0, row.model or "full"
    power = next(one for one in stated_powers(mission) if one.subject == row.subject)
    yield from stated(mission, ("other_errors", index, "islr"), row.declared, row.evidence)
    yield from effect_from_elsewhere()
    ratio, energy = 10 ** (power.islr / 10), mainlobe_energy(mission)
    rms = float(power.rms(model, energy))
    values = {"ISLR": ratio} if model == "published" else {"ISLR": ratio, "E": energy}
    formula = "sqrt(ISLR)" if model == "published" else "sqrt(log(1 + ISLR*E))"
    yield from step("Rms phase that spreads as much", *equation("rms", formula, values, rms, "rad"))
    if mission.requirements.islr is None or row.allowable is None:
        yield from step("Allowable: no limit", row.reason or "no requirement limits this error")
        return
    allowed = float(spread_limit(mission, allocation, "mission", model))
    lines = equation("allowable", "required", {"required": row.allowable}, row.allowable, "dB")
    yield from step("requirements.islr, all of it: it belongs to no platform", *lines)
    if row.utilization is not None:
        lines = equation("utilization", "rms/limit", {"rms": rms, "limit": allowed}, row.utilization, "")
        yield from step(f"Utilization, of rms phases; the limit is {with_unit(allowed, 'rad')}", *lines)
