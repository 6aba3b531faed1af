"""Random atmospheric delays on the paths from the platforms to the scene, as they remain after correction.

A leg is the path between a platform and the scene. Its delay is the zenith delay times a factor, which depends on the
elevation of the platform above the scene. The elevation changes over the aperture, and so does the delay. The
constant and linear parts of the delay displace the image; parts of higher order defocus it.

The troposphere delays all frequencies by the same amount. Free electrons cause the group delay g = 40.3·TEC/f² [m],
where TEC is the electron content along the leg [1/m²], and advance the phase at the centre frequency by the same
amount. In the image, the constant part of the range error is therefore +ḡ, the mean of the group delay over the
aperture. All other parts follow from the phase, −g. The displacement is Q⁻¹[ḡ, −g₁], where Q is the matrix of
equation (19) of Rigling & Moses and g₁ is the linear part of g. The phases are the sum of the phases due to −g and
the phases that the displacement adds. These relations are derived here, not taken from a publication.

A delay with a correlation time changes within the aperture as a random process (`range_processes`). The published
model computes the effects of the process for the line of sight at mid-aperture. In the full model the line of sight
turns over the aperture.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from bisar_budget.arrays import Floats, PerCase
from bisar_budget.constants import EARTH_RADIUS_M
from bisar_budget.effects.combined import combined
from bisar_budget.effects.effect import PLATFORMS, subject
from bisar_budget.effects.random_effect import BiasEffects, RandomEffect, RandomError, SensorCases, factor
from bisar_budget.effects.range_processes import departure_at_nodes
from bisar_budget.effects.spectra import gauss_markov
from bisar_budget.error_kinds.random_kinds import PROPAGATION_KIND
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


def obliquity(position: Vectors, shell: PerCase) -> PerCase:
    """Ratio of the length of a slant path through a thin atmospheric shell to the length of a vertical path.

    The slant path is a leg, which is the path between a platform and the scene. The ratio is exact for a spherical
    Earth.

    Parameters
    ----------
    position : Vectors
        Position of the platform relative to the scene: east, north and up, each of shape (…). [m]
    shell : float or (…)
        Height of the shell [m]. For height 0 the ratio is 1/sin(elevation), as on a flat Earth.
    """
    x, y, _ = position
    level = np.square(np.hypot(x, y) / norm(position))  # cos² of the elevation
    return 1 / np.sqrt(1 - level / np.square(1 + np.asarray(shell) / EARTH_RADIUS_M))


def leg_factor(delay: str, position: Vectors, middle: Vectors) -> PerCase:
    """Ratio of the delay on a platform's leg to the delay at the zenith, (…).

    `delay` is an entry of `DELAYS`. `position` is the platform's position, with components (…), and `middle` is its
    position at mid-aperture.

    For a platform below `AIR_TOP_M`, the neutral air is treated as on a flat Earth. The ratio for free electrons is
    then 0, because all of them are above the leg. At an elevation below `LEAST_ELEVATION_DEG`, the ratio for the
    neutral air is also 0, because a mission file must not state a delay there.
    """
    height = np.asarray(height_of(middle))
    is_above = height >= AIR_TOP_M
    if delay == DELAY:
        is_low = elevation_deg(middle) < LEAST_ELEVATION_DEG
        with np.errstate(divide="ignore"):
            return np.where(is_low, 0.0, obliquity(position, np.where(is_above, TROPOSPHERE_HEIGHT_M, 0.0)))
    return np.where(is_above, obliquity(position, np.minimum(IONOSPHERE_HEIGHT_M, np.maximum(height, 0.0))), 0.0)


def metres_per_unit(mission: Mission, delay: str) -> PerCase:
    """Group delay at the centre frequency per declared unit of a zenith delay or zenith electron content. [m/unit]"""
    return 1.0 if delay == DELAY else ELECTRON_DELAY_M3_PER_S2 / np.square(mission.radar.center_frequency)


def group_delay(mission: Mission, path: PlatformState, delay: str, times: PerCase) -> PerCase:
    """Group delay of a platform's leg at the slow times `times` [s], per declared unit of a zenith delay. [m/unit]"""
    return metres_per_unit(mission, delay) * leg_factor(delay, path.place(times), path.position)


def seen_course(group: Floats, mean: Floats, delay: str) -> Floats:
    """Range error over the aperture that a group delay causes in the image. [m]

    `group` [m] is the group delay over the aperture, and `mean` [m] is its mean. The range error of a tropospheric
    delay is the group delay itself. Free electrons advance the phase, so their range error has the sign of the group
    delay only in its constant part, and the opposite sign in all other parts.
    """
    return group if delay == DELAY else 2 * mean - group


def group_at_nodes(delay: str, track: Vectors, middle: Vectors, scale: PerCase) -> Floats:
    """Group delay of a leg per unit of a constant zenith delay, at the nodes over the aperture. [m/unit]

    The result is (nodes, cases).

    Parameters
    ----------
    delay : str
        An entry of `DELAYS`.
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

    The result maps the name of a platform to the phase of its leg. The phases include the coverage factor. A leg
    without a declared content is left out. The magnitude of a bias is added.
    """
    propagation, factor = mission.propagation, mission.allocation.coverage_factor
    phases: dict[str, PerCase] = {}
    for name, path in zip(PLATFORMS, geometry.both, strict=True):
        content = None if propagation is None else propagation.content(name)
        leg = None if propagation is None else propagation.leg(name)
        if content is not None and leg is not None:
            bias = leg.bias.get(CONTENT)
            phases[name] = (content * factor + (0.0 if bias is None else np.abs(bias))) * dispersion_per_unit(
                mission, path
            )
    return phases


def dispersed(mission: Mission, geometry: BistaticGeometry) -> PerCase:
    """Quadratic phase at the edges of the band due to the electron content of both legs. [rad]

    If the file states one content for both legs, the phases add. Otherwise the contents are independent, and the
    phases are combined according to the rule `allocation.combine` of the mission.
    """
    legs = list(dispersed_legs(mission, geometry).values())
    is_one_air = mission.propagation is not None and mission.propagation.is_one_air
    return combined(np.broadcast_arrays(*legs), "sum" if is_one_air else mission.allocation.combine)


def legs_of(owner: str) -> tuple[str, ...]:
    """Names of the platforms on whose legs a delay acts: both if `owner` is `mission`, otherwise `owner` alone."""
    return PLATFORMS if owner == "mission" else (owner,)


def delay_errors(seen: SensorCases) -> Iterator[RandomError]:
    """Yield the errors due to atmospheric delays, declared or not; yields nothing if the file has no `propagation`.

    A delay that the file states for both legs together is a single random number. On each leg it is multiplied by the
    factor for the elevation of this leg. The effects on both legs add with their signs before they are squared. The
    sum is in a row of the mission. Each leg also has a row of its own, which is only informative, because its effect
    is already part of the row of the mission.
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
        counted = subject("mission", PROPAGATION_KIND.name, delay).id if propagation.is_one_air else ""
        yield _delay_error(seen, name, delay, [by_leg[name, delay]], counted)
    for delay in DELAYS if propagation.is_one_air else ():
        yield _delay_error(seen, "mission", delay, [by_leg[name, delay] for name in PLATFORMS])


def _groups_of_leg(seen: SensorCases, name: str, delay: str) -> tuple[Floats, Floats]:
    """Group delay of a leg per unit of a zenith delay, for the turning leg and for the leg at mid-aperture. [m/unit]

    Returns two arrays (nodes, cases), with values at the nodes over the aperture. The first follows the elevation of
    the leg. The second has the value at mid-aperture at all nodes.
    """
    exact, middle = seen.exact, getattr(seen.geometry, name).position
    scale = metres_per_unit(seen.mission, delay)
    moving = group_at_nodes(delay, exact.tracks[PLATFORMS.index(name)], middle, scale)
    return moving, np.broadcast_to(scale * leg_factor(delay, middle, middle), exact.times.shape)


def _delay_error(
    seen: SensorCases, owner: str, delay: str, groups: Sequence[tuple[Floats, Floats]], counted_in: str = ""
) -> RandomError:
    """Create the error due to a delay of one leg, or to a delay that both legs share.

    `groups` contains the result of `_groups_of_leg` for each of these legs. `counted_in` is the id of the row that
    already includes the effect; it is empty if no row does.
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
    bias = None if leg is None else leg.bias.get(delay)
    biased = None if bias is None else _biased(seen, bias, delay, moving, at_mid_aperture)
    return RandomError(
        subject=subject(owner, PROPAGATION_KIND.name, delay),
        unit=PROPAGATION_KIND.size(delay).unit,
        declared=None if value is None else value * seen.factor,
        path=PROPAGATION_KIND.path("mission", delay) if propagation is None else propagation.path(name, delay),
        published=published,
        full=full,
        spreads=correlation_time is not None,
        counted_in=counted_in,
        biased=biased,
    )


def _biased(seen: SensorCases, bias: PerCase, delay: str, moving: Floats, at_mid_aperture: Floats) -> BiasEffects:
    """Effects of the bias of a delay, which is constant over the aperture.

    `moving` and `at_mid_aperture` (nodes, cases) [m/unit] are the group delays of a unit, see `_groups_of_leg`.
    """
    exact = seen.exact
    course = seen_course(moving, exact.fit[0] @ moving, delay)
    full = (seen.weights * course).sum(axis=1)
    constant, linear, quadratic, cubic = exact.fit @ at_mid_aperture
    (a, b), (c, d) = seen.plane.adjugate
    scale = 1 / np.where(seen.plane.is_singular, math.nan, seen.plane.determinant)
    displacement = [(u * constant + v * linear / exact.half) * scale for u, v in ((a, b), (c, d))]
    return BiasEffects(bias, np.array([exact.k * quadratic, exact.k * cubic, *displacement]), full)


def correlation_time_of(mission: Mission, owner: str) -> PerCase | None:
    """Correlation time of the delay of one leg, or of a delay that both legs share. [s]

    It is None if the delay is constant, or if the file states no delay.
    """
    leg = None if mission.propagation is None else mission.propagation.leg(legs_of(owner)[0])
    return None if leg is None else leg.correlation_time


def _changing(
    seen: SensorCases, delay: str, group: Floats, at_mid_aperture: Floats, correlation_time: PerCase
) -> tuple[RandomEffect, RandomEffect]:
    """Effects of one unit of a delay that changes within the aperture, according to the published and the full model.

    `group` (nodes, cases) [m/unit] is the group delay along the turning leg, for the full model. `at_mid_aperture`
    (cases,) [m/unit] is the group delay at mid-aperture, for the published model.
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
    """List the errors due to declared constant delays, computed as if the delays had the given correlation time [s].

    Only delays without a correlation time of their own are listed. If both legs share a delay, the list contains a
    single error for it. `geometry` is the geometry of the cases, and `cases` is their number.
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
    """Independent components of a unit zenith delay over the aperture at `count` nodes, (courses, nodes, cases).

    If each component is multiplied by an independent random number of variance 1, the sum is a delay of variance 1. A
    delay without a correlation time has a single component, which is constant.
    """
    correlation_time = correlation_time_of(mission, owner)
    if correlation_time is None:
        return np.ones((1, count, 1))
    ratios, ratio_index = np.unique(aperture_time / (2 * correlation_time), return_inverse=True)
    between = 1 + departure_at_nodes(count, ratios)
    courses = np.swapaxes(factor(np.moveaxis(between, 2, 0)), 1, 2)  # (ratios, courses, nodes)
    return np.moveaxis(courses, 0, 2)[..., ratio_index.ravel()]
