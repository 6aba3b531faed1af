"""Random delays in the air: after correction, each leg is longer than the processor assumes.

The delay of a leg is the zenith delay times a factor. The factor depends on the elevation of the platform above the
scene. The elevation changes over the aperture, and so does the delay. Orders 0 and 1 of the delay displace the image;
orders 2 and higher defocus it.

The troposphere delays all frequencies by the same amount. Free electrons cause the group delay g = 40.3·TEC/f² [m],
where TEC is the electron content along the leg [1/m²], and advance the phase at the centre frequency by the same
amount. In the image, the constant part of the range error is that of the group delay, +ḡ, where ḡ is the mean of g
over the aperture. All other parts follow from the phase, −g. The displacement is Q⁻¹[ḡ, −g₁], where g₁ is the linear
part of g. The phases are those of −g together with the phases that the displacement adds. Derived here.

With a correlation time the zenith delay changes within the aperture (`range_processes`). The published model computes
the effects of such a process for the line of sight at mid-aperture. The full model follows the turn of the leg.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from bisar_budget.arrays import Floats, PerCase
from bisar_budget.constants import EARTH_RADIUS_M
from bisar_budget.effects.combined import combined
from bisar_budget.effects.effect import PLATFORMS, subject
from bisar_budget.effects.random_effect import RandomEffect, RandomError, SensorCases, factor
from bisar_budget.effects.range_processes import departure_at_nodes
from bisar_budget.effects.spectra import gauss_markov
from bisar_budget.geometry import BistaticGeometry, PlatformState, Vectors, norm
from bisar_budget.mission.model import Mission
from bisar_budget.mission.propagation import (
    AIR_TOP_M,
    DELAYS,
    LEAST_ELEVATION_DEG,
    elevation_deg,
    height_of,
)

ELECTRON_DELAY_M3_PER_S2 = 40.308  # m³/s², e²/(8π²ε₀mₑ) (CODATA 2018); times content/f² it is the group delay
TROPOSPHERE_HEIGHT_M = 7e3  # m, height of a thin shell in place of a spherical troposphere
IONOSPHERE_HEIGHT_M = 350e3  # m, height of the shell of free electrons, unless the platform is lower
DELAY, CONTENT = DELAYS
DELAY_UNITS = dict(zip(DELAYS, ("m", "1/m^2"), strict=True))


def obliquity(position: Vectors, shell: PerCase) -> PerCase:
    """Ratio of the path length of a leg in a thin shell of the air to the path length at the zenith.

    It is exact for a spherical Earth.

    Parameters
    ----------
    position : Vectors
        Position of the platform relative to the scene: east, north and up, each (…). [m]
    shell : float or (…)
        Height of the shell. Height 0 gives a flat Earth: 1/sin of the elevation. [m]
    """
    x, y, _ = position
    level = np.square(np.hypot(x, y) / norm(position))  # cos² of the elevation
    return 1 / np.sqrt(1 - level / np.square(1 + np.asarray(shell) / EARTH_RADIUS_M))


def leg_factor(delay: str, position: Vectors, middle: Vectors) -> PerCase:
    """Ratio of the delay on a platform's leg to the delay at the zenith, for positions (…) of the platform.

    `middle` is the platform's position at mid-aperture. For a platform below `AIR_TOP_M`, the neutral air is treated
    as on a flat Earth, and the ratio for free electrons is 0, because all of them are above the leg. The ratio for
    the neutral air is also 0 at an elevation below `LEAST_ELEVATION_DEG`, because a mission file must not state a
    delay there.
    """
    height = np.asarray(height_of(middle))
    is_above = height >= AIR_TOP_M
    if delay == DELAY:
        is_low = elevation_deg(middle) < LEAST_ELEVATION_DEG
        with np.errstate(divide="ignore"):
            return np.where(is_low, 0.0, obliquity(position, np.where(is_above, TROPOSPHERE_HEIGHT_M, 0.0)))
    return np.where(is_above, obliquity(position, np.minimum(IONOSPHERE_HEIGHT_M, np.maximum(height, 0.0))), 0.0)


def metres_per_unit(mission: Mission, delay: str) -> PerCase:
    """Group delay at the zenith per unit of a declared delay, at the centre frequency. [m/unit]"""
    return 1.0 if delay == DELAY else ELECTRON_DELAY_M3_PER_S2 / np.square(mission.radar.center_frequency)


def group_delay(mission: Mission, path: PlatformState, delay: str, times: PerCase) -> PerCase:
    """Group delay of a platform's leg at the slow times `times` [s], per unit of a declared delay. [m/unit]"""
    return metres_per_unit(mission, delay) * leg_factor(delay, path.place(times), path.position)


def seen_course(group: Floats, mean: Floats, delay: str) -> Floats:
    """Range error in the image that a group delay causes. [m]

    `group` is the group delay over the aperture, and `mean` is its constant part. [m] A tropospheric delay is itself
    the range error. For free electrons, only the constant part has the sign of the group delay; everything else has
    the opposite sign, as the phase is advanced.
    """
    return group if delay == DELAY else 2 * mean - group


def group_at_nodes(delay: str, track: Vectors, middle: Vectors, scale: PerCase) -> Floats:
    """Group delay of a leg at the nodes per unit of a constant zenith delay, (nodes, cases). [m/unit]

    Parameters
    ----------
    delay : str
        One of `DELAYS`.
    track : Vectors
        Positions of the platform at the nodes, (nodes, cases), relative to a point of the scene. [m]
    middle : Vectors
        Position of the platform at mid-aperture, relative to the scene centre. [m]
    scale : (cases,)
        Result of `metres_per_unit`. [m/unit]
    """
    return np.asarray(scale * leg_factor(delay, track, middle) + np.zeros_like(track[0]))


def dispersion_per_unit(mission: Mission, path: PlatformState) -> PerCase:
    """Quadratic phase at the edges of the band per unit of electron content at the zenith. [rad/unit]

    The phase due to the electrons is 2πK/(c·f) with K = g·f₀², where g is the group delay [m]. At the edges of the
    band, f − f₀ = ±B/2, its term of second order in f − f₀ is (2π/λ)·g·(B/2f₀)².
    """
    radar = mission.radar
    g = metres_per_unit(mission, CONTENT) * leg_factor(CONTENT, path.position, path.position)
    return 2 * math.pi / np.asarray(radar.wavelength) * g * (radar.bandwidth / radar.center_frequency / 2) ** 2


def dispersed_legs(mission: Mission, geometry: BistaticGeometry) -> dict[str, PerCase]:
    """Quadratic phase at the edges of the band due to the declared electron content of each leg. [rad]

    The result maps the name of a platform to the phase of its leg. The phases include the coverage factor. Legs
    without a declared content are left out.
    """
    propagation, factor = mission.propagation, mission.allocation.coverage_factor
    phases: dict[str, PerCase] = {}
    for name, path in zip(PLATFORMS, geometry.both, strict=True):
        content = None if propagation is None else propagation.content(name)
        if content is not None:
            phases[name] = content * factor * dispersion_per_unit(mission, path)
    return phases


def dispersed(mission: Mission, geometry: BistaticGeometry) -> PerCase:
    """Quadratic phase at the edges of the band due to the electron content of both legs. [rad]

    If the file states one content for both legs, the phases add. Otherwise the contents are independent, and the
    mission's rule combines the phases.
    """
    legs = list(dispersed_legs(mission, geometry).values())
    is_one_air = mission.propagation is not None and mission.propagation.is_one_air
    return combined(np.broadcast_arrays(*legs), "sum" if is_one_air else mission.allocation.combine)


def legs_of(owner: str) -> tuple[str, ...]:
    """Platforms whose legs a delay of the given owner affects. A delay of the mission affects both legs."""
    return PLATFORMS if owner == "mission" else (owner,)


def delay_errors(seen: SensorCases) -> Iterator[RandomError]:
    """Yield the delays of the air, declared or not; nothing if the file states nothing about the air.

    A delay that the file states once for the whole mission is one random number. It delays both legs, each by the
    factor of its own elevation, and the effects on both legs add with their signs before they are squared. Each leg
    then also has a row of its own. That row only informs: its effect is already part of the row of the mission.
    """
    propagation = seen.mission.propagation
    if propagation is None:
        return
    by_leg = {
        (name, delay): _groups_of_leg(seen, name, delay)
        for name in PLATFORMS
        if propagation.leg(name) is not None
        for delay in DELAYS
    }
    for name, delay in by_leg:
        counted = subject("mission", "propagation", delay).id if propagation.is_one_air else ""
        yield _delay_error(seen, name, delay, [by_leg[name, delay]], counted)
    for delay in DELAYS if propagation.is_one_air else ():
        yield _delay_error(seen, "mission", delay, [by_leg[name, delay] for name in PLATFORMS])


def _groups_of_leg(seen: SensorCases, name: str, delay: str) -> tuple[Floats, Floats]:
    """Group delay of a leg at the nodes per unit of a zenith delay, for the turning and for the fixed leg. [m/unit]

    Both results are (nodes, cases). The first follows the leg over the aperture. The second has the value at
    mid-aperture at all nodes.
    """
    exact, middle = seen.exact, getattr(seen.geometry, name).position
    scale = metres_per_unit(seen.mission, delay)
    moving = group_at_nodes(delay, exact.tracks[PLATFORMS.index(name)], middle, scale)
    return moving, np.broadcast_to(scale * leg_factor(delay, middle, middle), exact.times.shape)


def _delay_error(
    seen: SensorCases, owner: str, delay: str, groups: Sequence[tuple[Floats, Floats]], counted_in: str = ""
) -> RandomError:
    """Create the error of a delay of one leg, or of a delay that both legs share.

    `groups` has the results of `_groups_of_leg` for these legs. `counted_in` is the id of the row that already
    includes the effect; empty if there is none.
    """
    propagation = seen.mission.propagation
    name = legs_of(owner)[0]
    leg = None if propagation is None else propagation.leg(name)
    value = None if leg is None else getattr(leg, delay)
    moving, at_mid_aperture = (np.asarray(sum(of_legs)) for of_legs in zip(*groups, strict=True))
    correlation_time = correlation_time_of(seen.mission, owner)
    if correlation_time is None:
        course = seen_course(moving, seen.exact.fit[0] @ moving, delay)
        published, full = seen.of_courses(course[None], at_mid_aperture[None])
    else:
        published, full = _changing(seen, delay, moving, at_mid_aperture[0], correlation_time)
    return RandomError(
        subject=subject(owner, "propagation", delay),
        unit=DELAY_UNITS[delay],
        declared=None if value is None else value * seen.factor,
        path=("propagation", delay) if propagation is None else propagation.path(name, delay),
        published=published,
        full=full,
        spreads=correlation_time is not None,
        counted_in=counted_in,
    )


def correlation_time_of(mission: Mission, owner: str) -> PerCase | None:
    """Correlation time of the delay of one leg, or of a delay that both legs share. [s]

    None if the delay is constant.
    """
    leg = None if mission.propagation is None else mission.propagation.leg(legs_of(owner)[0])
    return None if leg is None else leg.correlation_time


def _changing(
    seen: SensorCases, delay: str, group: Floats, at_mid_aperture: Floats, correlation_time: PerCase
) -> tuple[RandomEffect, RandomEffect]:
    """Effects, in both models, of one unit of a delay that changes within the aperture.

    `group` is the group delay of the leg as it turns, for the full model. `at_mid_aperture` is the group delay at
    mid-aperture, for the published model. [m/unit]
    """
    k, half = seen.exact.k, seen.exact.half
    along = gauss_markov(2 * half, np.broadcast_to(correlation_time, half.shape)).times(np.square(at_mid_aperture))
    quadratic, cubic, spread = (k * np.sqrt(power) for power in along[:3])
    # The declared size includes the coverage factor, which does not apply to the spread, a mean power.
    published = RandomEffect(quadratic, cubic, spread / seen.factor, *seen.moved(along.constant, along.linear))
    full = seen.of_gauss_markov(group[None], correlation_time, is_phase_advanced=delay == CONTENT)
    return published, full


def changing_air(
    mission: Mission, geometry: BistaticGeometry, cases: int, correlation_time: float
) -> list[RandomError]:
    """List the declared delays that are constant within the aperture, as if they had a given correlation time [s].

    A delay that both legs share is one error in the list. `geometry` is the geometry of the cases.
    """
    propagation = mission.propagation
    staying = [name for name in PLATFORMS if correlation_time_of(mission, name) is None]
    if propagation is None or not staying:
        return []
    changed = mission._replace(propagation=propagation._replace(correlation_time=correlation_time))
    owners = ("mission",) if propagation.is_one_air else staying
    return [
        error
        for error in delay_errors(SensorCases(changed, geometry, cases))
        if error.declared is not None and error.owner in owners
    ]


def zenith_courses(mission: Mission, owner: str, aperture_time: Floats, count: int) -> Floats:
    """Independent components of the zenith delay at `count` nodes, (courses, nodes, cases).

    The sum of the components, each times an independent random number of variance 1, is a delay of variance 1. A
    delay without a correlation time has one component, which is constant.
    """
    correlation_time = correlation_time_of(mission, owner)
    if correlation_time is None:
        return np.ones((1, count, 1))
    ratios, ratio_index = np.unique(aperture_time / (2 * correlation_time), return_inverse=True)
    between = 1 + departure_at_nodes(count, ratios)
    courses = np.swapaxes(factor(np.moveaxis(between, 2, 0)), 1, 2)  # (ratios, courses, nodes)
    return np.moveaxis(courses, 0, 2)[..., ratio_index.ravel()]
