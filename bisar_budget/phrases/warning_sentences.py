"""Warnings about a mission file."""

from collections.abc import Sequence

from bisar_budget.phrases.notes import composed
from bisar_budget.units import format_quantity

WARNING_SENTENCES: dict[str, str] = {
    "another-mission": "the mission checked is not that of the file: {changes}",
    "id-of-no-row": "requirement_ids: no row or requirement has the id {row_id}{nearest}",
    "text-of-no-id": "requirement_texts: requirement_ids does not have the id {own_id}{nearest}",
    "no-orbit-to-turn": "earth_orientation: not used, since no platform has an orbit",
    "full-model-gates": (
        "allocation.model {model}: the published model ignores the direct path; the full model decides"
    ),
    "nothing-declared": "no error is declared: nothing was judged",
    "path-is-doubtful": "platforms.{platform}: {doubt}",
    "nothing-swings-the-arm": (
        "platforms.{platform}.motion_error.lever_arm.arm: attitude errors swing it, but imu states none: add "
        "imu.attitude, gyro_bias or angle_random_walk"
    ),
    "nothing-shakes-the-oscillator": (
        "platforms.{platform}.oscillator.acceleration_sensitivity has no effect: vibration and turns act on it, but "
        "the file has none: add oscillator.vibration, or sinusoidal or spectrum to motion_error.vibration"
    ),
    "stated-twice": (
        "platforms.{platform}.motion_error: acceleration and the accelerometer bias are both stated; they add"
    ),
    "correlations-not-used": (
        "platforms.{platform}.motion_error.covariance: correlations are not used where each error is judged alone; "
        "combine: rss uses them"
    ),
    "exchanges-are-rare": (
        "synchronization.interval: pulses are exchanged less than once in an aperture of {aperture_time:g} s; "
        "interpolation between them may make the phase worse than without synchronisation"
    ),
    "walks-over-range-cells": (
        "autofocus.n_pull: {n_pull:g} is limited to {cap}, f0/B, where the range walk is half a cell; an error of "
        "{n_pull:g}π rad walks {cells:.3g} cells, which a one-dimensional correction does not remove"
    ),
    "smears-beyond-the-scene": (
        "autofocus.n_pull: an error of {n_pull:g}π rad smears a point over {smear:m}; {algorithm} needs {room:g} "
        "times that. A scene with a radius of {radius:m} holds n_pull {largest_n_pull}"
    ),
    "waiver-matches-nothing": "waiver {row_id}: matches no row",
    "waiver-matches-everything": "waiver {row_id}: names every row and would hide any new failure",
    "waiver-not-used": "waiver {row_id}: not used: no row that it names fails",
    "limit-is-optimistic": "{row_id}: optimistic limit: {shown}",
}


@composed
def fit_changes_allowables(platform: str, acceleration: float, change: float, row_id: str) -> str:
    """Sentence for a flight log whose noise makes the acceleration of the path uncertain.

    `acceleration` is the 1-sigma uncertainty of the acceleration [m/s²]. This uncertainty changes the allowable of
    row `row_id` the most, by the fraction `change`.
    """
    size = format_quantity(acceleration, "m/s^2")
    by = f"by up to {100 * change:.2g} %" if change < 1 else "by a factor of two and more"
    return (
        f"platforms.{platform}: the noise of the log leaves the acceleration of its path uncertain by {size} (1"
        f" sigma, along the line of sight), which changes allowables {by} ({row_id}): a longer or a more accurate log"
        " reduces it"
    )


@composed
def satellite_flies_straight(platform: str, speed: float, acceleration: Sequence[float], has_axes: bool) -> str:
    """Sentence for a straight path with the speed of a satellite.

    `speed` is in m/s. `acceleration` has the components of the acceleration that the path would have on a circular
    orbit [m/s²].
    """
    return (
        f"platforms.{platform}: {speed / 1e3:.3g} km/s is the speed of a satellite, but the path is straight. "
        f"A circular orbit has {_of_free_fall(acceleration, has_axes)}"
    )


@composed
def satellite_does_not_fall(
    platform: str, height: float, departure: float, phase: float, acceleration: Sequence[float], has_axes: bool
) -> str:
    """Sentence for a path that is as high as a satellite's, but not in free fall.

    `height` is in m. `departure` is the difference from the acceleration of free fall, as a fraction of gravity.
    `phase` [rad] is the largest quadratic phase that the declared errors may cause in addition because of the
    dynamics of an orbit. `acceleration` has the components of the acceleration of free fall [m/s²].
    """
    missing = "" if has_axes else " If the acceleration is Earth-fixed, add scene.latitude, longitude and height."
    return (
        f"platforms.{platform}: a path {height / 1e3:.0f} km high is a satellite's, but its acceleration differs "
        f"from that of free fall by {100 * departure:.3g} % of gravity, and 5 % is accepted. Its errors are judged "
        f"without the dynamics of an orbit, which may add a QPE of up to {phase:.2g} rad, and "
        f"velocity errors in ric are rates of Earth-fixed vectors.{missing} Free fall has "
        f"{_of_free_fall(acceleration, has_axes)}"
    )


def _of_free_fall(acceleration: Sequence[float], has_axes: bool) -> str:
    """Text with the acceleration of free fall as a line for the mission file, and with a remark on this value.

    The remark states the effects that the value includes.
    """
    components = ", ".join(f"{component + 0.0:.3f} m/s^2" for component in acceleration)
    if has_axes:
        how = "(gravity of a flattened Earth, less what its rotation adds)"
    else:
        how = (
            "(towards the Earth's centre; the Earth's rotation changes it by up to 1.1 m/s^2, which needs the "
            "latitude)"
        )
    return f"acceleration: [{components}] {how}"
