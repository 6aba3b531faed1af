"""Explanation steps of an aided navigation: its parameters, its errors, and the sensitivity of its effects.

The errors are shown at mid-aperture. The sensitivity is the change of the effects with each parameter and with the
aperture time.
"""

import math
from collections.abc import Iterator

import numpy as np

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.effects.aided_navigation import aided_navigation
from bisar_budget.effects.declared import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.navigation_errors import body_axes, specific_force
from bisar_budget.effects.random_effect import RandomEffect, RandomError, SensorCases
from bisar_budget.findings.row import NavigationState
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.model import Mission
from bisar_budget.mission.navigation import Navigation
from bisar_budget.mission.quantities import with_number
from bisar_budget.navigation.error_state import ACCELEROMETER_BIAS, TILT, moved_by_tilt
from bisar_budget.report.explain.notation import Step, WorkedEquation, step, with_unit
from bisar_budget.units import format_quantity

_FIGURE_FACTOR = 1.01  # by which each figure is changed to find its derivative
_LEAST_EXPONENT_RATIO = 0.005  # of a figure that is listed
_APERTURE_FACTORS = (0.25, 0.5, 1.0, 2.0, 4.0)
_FIGURE_UNITS = {
    "accelerometer_bias": "m/s^2",
    "accelerometer_scale_factor": "",
    "gyro_bias": "rad/s",
    "velocity_random_walk": "m/s/sqrt(s)",
    "angle_random_walk": "rad/sqrt(s)",
    "position": "m",
    "velocity": "m/s",
}
_STATE_UNITS = ("m", "m/s", "rad", "rad", "rad/s", "m/s^2")
_STATE_WORDS = ("position", "velocity", "tilt (roll and pitch)", "heading", "gyro bias", "accelerometer bias")
# What a requirement limits: its name, and the part of an effect.
_EFFECTS_BY_REQUIREMENT = {
    QUADRATIC: ("quadratic phase", "quadratic"),
    CUBIC: ("cubic phase", "cubic"),
    "islr": ("spread", "spread"),
    LOCATION: ("displacement", "displacement"),
}


def navigation_steps(analysis: Analysis, error: RandomError, binding: str | None) -> Iterator[Step]:
    """Yield the explanation steps of an aided navigation.

    `binding` is the requirement that limits the row of the navigation; None if no requirement limits this row.
    """
    mission = analysis.mission
    navigation: Navigation = getattr(mission.platforms, error.owner).motion_error.navigation
    yield step("Figures, 1 sigma; one for each axis, or three", *_figures(navigation))
    yield step(_method(mission, navigation))
    yield step(
        "Joint covariance Cov(δp(τ_i), δp(τ_j)) of the position error over the aperture: a Kalman filter gives P and "
        "the propagation Ψ of its error from fix to fix; later fixes reveal the part P·λ of it, with Cov(λ) = Λ",
        "Cov = P_i·Ψ(j, i)ᵀ·(1 − Λ_j·P_j)" if navigation.is_smoothed else "Cov = P_i·Ψ(j, i)ᵀ",
    )
    assert error.navigation is not None
    state = NavigationState(*error.navigation.at_middle)
    yield step(
        "Errors at mid-aperture; root-sum-square of their axes",
        *(
            f"{words} = {with_unit(value, unit)}"
            for words, value, unit in zip(_STATE_WORDS, state, _STATE_UNITS, strict=True)
        ),
    )
    yield from _correlation(analysis, error)
    yield from _derivatives(mission, navigation, error, binding or QUADRATIC)
    yield from _growth(mission, error)


def _figures(navigation: Navigation) -> Iterator[str]:
    """Yield a line of text for each parameter of an aided navigation, such as the gyro bias or the fix rate."""
    for key, value in navigation.figures.items():
        unit = _FIGURE_UNITS[key.rpartition(".")[2]]
        sizes = dict.fromkeys(with_unit(float(size), unit) for size in value)
        yield f"{key} = {', '.join(sizes)}"
    yield f"gnss.rate = {with_unit(navigation.gnss.rate, 'Hz')}"
    if navigation.gnss.correlation_time is None:
        yield "gnss.correlation_time: not stated, a new error at each fix"
    else:
        yield f"gnss.correlation_time = {format_quantity(navigation.gnss.correlation_time, 's')}"
    yield f"heading = {with_unit(navigation.heading, 'rad')} at the start"


def _method(mission: Mission, navigation: Navigation) -> str:
    """Text about the method, smoothing or filtering, and about the time span of the fixes that it uses."""
    half = mission.collection.aperture_time / 2
    start, end = (
        format_quantity(-half - navigation.before, "s", 4),
        format_quantity(half + float(navigation.after_s), "s", 4),
    )
    outages = [f"{outage.start:g} s to {outage.end:g} s" for outage in navigation.outages]
    words = "Smoothed: fixes after a moment count too" if navigation.is_smoothed else "Output of a filter in flight"
    return f"{words}; fixes from {start} to {end}" + (f", without those of {', '.join(outages)}" if outages else "")


def _correlation(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """Yield the step with the correlation of tilt and accelerometer bias at mid-aperture.

    Both errors cause an apparent acceleration along the line of sight. The fixes observe only the sum of the two
    accelerations.
    """
    mission = analysis.mission
    assert error.navigation is not None
    P = error.navigation.covariance.at_middle[..., 0]
    path: PlatformState = getattr(mission.platforms, error.owner).state
    look = np.array(path.look, float)
    force = np.array(specific_force(mission, path), float)
    by_tilt = look @ moved_by_tilt(force)
    by_bias = look @ body_axes(path, np.zeros(1))[:, :, 0].T
    tilt, bias = by_tilt @ P[TILT, TILT] @ by_tilt, by_bias @ P[ACCELEROMETER_BIAS, ACCELEROMETER_BIAS] @ by_bias
    both = by_tilt @ P[TILT, ACCELEROMETER_BIAS] @ by_bias
    if not tilt * bias > 0:
        return
    T, k = mission.collection.aperture_time, 2 * math.pi / mission.radar.wavelength
    values = {"a_tilt": math.sqrt(tilt), "a_bias": math.sqrt(bias)}
    apart, together = math.sqrt(tilt + bias), math.sqrt(max(float(tilt + bias + 2 * both), 0.0))
    yield step(
        "A tilt and an accelerometer bias both accelerate the navigation along the line of sight; the fixes see only "
        "their sum, so that the two are correlated and their sigmas must not be added",
        *(f"{name} = {with_unit(value, 'm/s^2')}" for name, value in values.items()),
        f"correlation = {both / math.sqrt(tilt * bias):.4f}",
        WorkedEquation("apart", "sqrt(a_tilt^2 + a_bias^2)", values, apart, "m/s^2"),
        f"their sum = {with_unit(together, 'm/s^2')}",
    )
    values = {"π": math.pi, "apart": apart, "T": T, "λ": mission.radar.wavelength}
    yield step(
        "As if the two were independent and constant over the aperture; the covariance gives less",
        WorkedEquation("QPE_apart", "π*apart*T^2/(4*λ)", values, k * apart * T**2 / 8, "rad"),
    )


def _derivatives(mission: Mission, navigation: Navigation, error: RandomError, binding: str) -> Iterator[Step]:
    """Yield the step with the change of the limited effect per percent of change in each parameter, largest first."""
    words, effect_name = _EFFECTS_BY_REQUIREMENT.get(binding, _EFFECTS_BY_REQUIREMENT[QUADRATIC])
    figures, varied = list(navigation.figures), mission
    for row, figure in enumerate(figures, 1):
        factors = np.where(np.arange(len(figures) + 1) == row, _FIGURE_FACTOR, 1.0)
        for axis, size in enumerate(navigation.figures[figure]):
            key = f"platforms.{error.owner}.motion_error.navigation.{figure}.{axis}"
            varied = with_number(varied, key, factors * size)
    effects = _effects(varied, error.owner, len(figures) + 1)
    sizes = np.asarray(getattr(effects, effect_name))
    if not sizes[0] > 0:
        return
    exponents = np.log(sizes[1:] / sizes[0]) / math.log(_FIGURE_FACTOR)
    ordered = sorted(zip(exponents, figures, strict=True), key=lambda pair: -abs(pair[0]))
    lines = [
        f"{key}: {exponent:+.2f} % per percent" for exponent, key in ordered if abs(exponent) >= _LEAST_EXPONENT_RATIO
    ]
    yield step(f"Change of the {words} by each figure, the largest first", *lines)


def _growth(mission: Mission, error: RandomError) -> Iterator[Step]:
    """Yield the step that shows how the effects grow with the aperture time.

    There is no step if a platform path was read from a file, because such a path ends with the aperture.
    """
    if any(path.curve is not None for path in mission.geometry.both):
        return
    times = np.array(_APERTURE_FACTORS) * mission.collection.aperture_time
    effects = _effects(with_number(mission, "collection.aperture_time", times), error.owner, times.size)
    lines = [
        f"T = {time:.4g} s: QPE {math.degrees(quadratic):.3g}°, cubic {math.degrees(cubic):.3g}°, "
        f"rest {math.degrees(spread):.3g}° rms"
        for time, quadratic, cubic, spread in zip(
            times, effects.quadratic, effects.cubic, effects.spread, strict=True
        )
    ]
    yield step("The same navigation over other apertures: short ones grow with T, long ones saturate", *lines)


def _effects(mission: Mission, name: str, cases: int) -> RandomEffect:
    """Effects of a platform's aided navigation in each case, according to the full model, for coverage factor 1."""
    mission = mission._replace(allocation=mission.allocation._replace(coverage_factor=1.0))
    (error,) = aided_navigation(SensorCases(mission, mission.geometry, cases), name)
    return error.full
