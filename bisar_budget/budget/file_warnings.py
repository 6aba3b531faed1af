"""Warnings about a mission file: their sentences, and the finders that decide when to give each.

The name of a sentence's function is its code, as in `phrases`. Most warnings change no verdict. A warning that doubts
the checked mission sets the status to `warn` at least. A finder gives a sentence and the key that it is about; the
line of the key is looked up here, once.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from bisar_budget import phrases
from bisar_budget.analysis.allocation import ROOM, caps, rounded_down
from bisar_budget.analysis.analysis import Case
from bisar_budget.budget.declarations import swings_nothing
from bisar_budget.budget.doubted_noise import noise_doubts
from bisar_budget.budget.doubts import input_doubts, missing_settings
from bisar_budget.budget.fit_noise import MAX_UNSAID_CHANGE_FRACTION, allowable_noise
from bisar_budget.constants import MAX_FLIGHT_SPEED_MPS
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.oscillator_acceleration import is_unshaken
from bisar_budget.faults import KeyPath, changes_words
from bisar_budget.findings.mission import FileWarning
from bisar_budget.findings.row import Row
from bisar_budget.geometry import norm, plain_vector
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import Platform
from bisar_budget.phrases import Note, phrase
from bisar_budget.ranges.resolution import Resolution
from bisar_budget.units import format_quantity

_SENSITIVITY = "acceleration_sensitivity"


class _Warned(NamedTuple):
    """A sentence and the key of the file that it is about; None: the sentence is about the whole file."""

    key: KeyPath | None
    message: Note
    is_doubt: bool = False
    is_of_options: bool = False


def file_warnings(
    case: Case, rows: Sequence[Row], waivers: Sequence[tuple[KeyPath, Note]]
) -> tuple[FileWarning, ...]:
    """All warnings about the file of a mission.

    Parameters
    ----------
    case : Case
        The judged case.
    rows : sequence of Row
        Judged rows of the case.
    waivers : sequence of (key, sentence)
        Warnings about waivers.
    """
    mission = case.mission
    warnings = (
        *_of_the_whole(mission, rows),
        *(_Warned(*warning) for warning in waivers),
        *_unused_correlations(mission),
        *straight_orbits(mission),
        *_doubtful_paths(mission),
        *_noisy_fits(mission),
        *_of_instruments(case),
        *_of_lever_arms(mission),
        *_of_calm_oscillators(mission),
        *_of_doubted_noise(mission, rows),
        *_of_autofocus(mission, case.resolution),
        *_nothing_declared(rows),
    )
    return tuple(
        FileWarning(None if warning.key is None else mission.line(warning.key), *warning[1:]) for warning in warnings
    )


# ---------------------------------------------------------------------- what is checked
def _of_the_whole(mission: Mission, rows: Sequence[Row]) -> Iterator[_Warned]:
    if mission.changes:
        yield _Warned(None, another_mission(changes_words(mission.changes)), is_of_options=True)
    row_ids = {row.id for row in rows} if mission.requirement_ids else set()
    for row_id in mission.requirement_ids:
        if row_id not in row_ids:
            yield _Warned(("requirement_ids", row_id), id_of_no_row(row_id))
    if mission.earth_orientation is not None and all(platform.orbit is None for platform in mission.platforms):
        yield _Warned(("earth_orientation",), no_orbit_to_turn())
    if mission.gating_model != mission.allocation.model:
        yield _Warned(("synchronization", "method"), full_model_gates(mission.allocation.model))


def _nothing_declared(rows: Sequence[Row]) -> Iterator[_Warned]:
    if all(row.status == "not_declared" or row.is_of_declare for row in rows):
        yield _Warned(None, nothing_declared())


@phrase
def another_mission(changes: str) -> str:
    """Said of a mission that options changed."""
    return f"the mission checked is not that of the file: {changes}"


@phrase
def id_of_no_row(row_id: str) -> str:
    """Said of a key of `requirement_ids`."""
    return f"requirement_ids: no row has the id {row_id}"


@phrase
def no_orbit_to_turn() -> str:
    """Said of figures of the Earth's rotation that nothing uses."""
    return "earth_orientation: not used, since no platform has an orbit"


@phrase
def full_model_gates(model: str) -> str:
    """Said of a mission with a direct path, which asks for another model."""
    return f"allocation.model {model}: the published model ignores the direct path; the full model decides"


@phrase
def nothing_declared() -> str:
    """Said of a mission that states no error."""
    return "no error is declared: nothing was judged"


# ---------------------------------------------------------------------- how platforms fly
def _doubtful_paths(mission: Mission) -> Iterator[_Warned]:
    """Warn of paths in doubt that no row reports; a position doubt is separate from the residual of a log."""
    owners = {doubt.owner for doubt in input_doubts(mission) if not doubt.is_stated}
    for name in PLATFORMS:
        platform: Platform = getattr(mission.platforms, name)
        path = platform.path
        if path is not None and (name not in owners or path.samples):
            yield from (
                _Warned(("platforms", name, platform.way), path_is_doubtful(name, doubt), is_doubt=True)
                for doubt in path.doubts
            )


def _noisy_fits(mission: Mission) -> Iterator[_Warned]:
    """Warn of logs whose noise changes the allowables, through the path that is fitted to the log."""
    for name in PLATFORMS:
        noise = allowable_noise(mission, name)
        if noise is not None and noise.change > MAX_UNSAID_CHANGE_FRACTION:
            note = fit_changes_allowables(name, noise.acceleration, noise.change, noise.row_id)
            yield _Warned(("platforms", name, "trajectory"), note)


@phrase
def fit_changes_allowables(platform: str, acceleration: float, change: float, row_id: str) -> str:
    """Said of a log whose noise is an error of the path's acceleration. [m/s²]"""
    size = format_quantity(acceleration, "m/s^2")
    by = f"by up to {100 * change:.2g} %" if change < 1 else "by a factor of two and more"
    return (
        f"platforms.{platform}: the noise of the log leaves the acceleration of its path uncertain by {size} (1"
        f" sigma, along the line of sight), which changes allowables {by} ({row_id}): a longer or a more accurate log"
        " reduces it"
    )


@phrase
def path_is_doubtful(platform: str, doubt: str) -> str:
    """Said of a path by an orbit or a log."""
    return f"platforms.{platform}: {doubt}"


def straight_orbits(mission: Mission) -> Iterator[_Warned]:
    """Warn of each platform as fast as a satellite without `acceleration`; give the acceleration of its orbit.

    Over an aperture T the missing acceleration a moves the true path by aT²/8 against the straight path: 25 m in 5 s.
    A file that states an acceleration has made the choice, also with zero.
    """
    for name in PLATFORMS:
        platform: Platform = getattr(mission.platforms, name)
        speed, axes = float(norm(platform.state.velocity)), mission.scene.axes
        if speed <= MAX_FLIGHT_SPEED_MPS or platform.acceleration is not None or platform.is_of_the_earth:
            continue
        key = ("platforms", name, "speed" if platform.velocity is None else "velocity")
        from bisar_budget.paths.earth import free_fall  # takes 8 ms; most missions do not need it

        acceleration = free_fall(plain_vector(platform.state.position), plain_vector(platform.state.velocity), axes)
        yield _Warned(key, satellite_flies_straight(name, speed, acceleration, axes is not None), is_doubt=True)


@phrase
def satellite_flies_straight(platform: str, speed: float, acceleration: Sequence[float], has_axes: bool) -> str:
    """Said of a satellite's path without the acceleration of its orbit. [m/s, m/s²]"""
    components = ", ".join(f"{component + 0.0:.3f} m/s^2" for component in acceleration)
    if has_axes:
        how = "(gravity of a flattened Earth, less what its rotation adds)"
    else:
        how = (
            "(towards the Earth's centre; the Earth's rotation changes it by up to 1.1 m/s^2, which needs the "
            "latitude)"
        )
    return (
        f"platforms.{platform}: {speed / 1e3:.3g} km/s is the speed of a satellite, but the path is straight. "
        f"A circular orbit has acceleration: [{components}] {how}"
    )


# ---------------------------------------------------------------------- how errors are stated
def _of_instruments(case: Case) -> Iterator[_Warned]:
    """Warn of the ways in which sensors and clocks are stated, and of errors that are stated twice."""
    mission, sync = case.mission, case.mission.synchronization
    T = mission.collection.aperture_time
    if sync is not None and not sync.is_direct_path and (sync.interval or 0.0) > T:
        yield _Warned(("synchronization", "interval"), exchanges_are_rare(T))
    if mission.requirements.location_error is not None and (missing := missing_settings(mission)):
        yield _Warned(("synchronization",), phrases.setting_is_perfect(missing))
    for error in case.random:
        declared = error.subject.axis == "accelerometer_bias" and error.declared is not None
        if declared and getattr(mission.platforms, error.owner).motion_error.acceleration is not None:
            yield _Warned(error.path, stated_twice(error.owner))


def _of_lever_arms(mission: Mission) -> Iterator[_Warned]:
    """Warn of lever arms without an attitude error in the file that swings them."""
    for name in PLATFORMS:
        if swings_nothing(getattr(mission.platforms, name)):
            key = ("platforms", name, "motion_error", "lever_arm", "arm")
            yield _Warned(key, nothing_swings_the_arm(name), is_doubt=True)


@phrase
def nothing_swings_the_arm(platform: str) -> str:
    """Said of a lever arm without attitude errors."""
    return (
        f"platforms.{platform}.motion_error.lever_arm.arm: attitude errors swing it, but imu states none: "
        "add imu.attitude, gyro_bias or angle_random_walk"
    )


def calm_oscillators(mission: Mission) -> list[str]:
    """Platforms whose oscillators have a stated sensitivity to acceleration, but neither vibration nor turn."""
    return [
        name
        for name in PLATFORMS
        if ("platforms", name, "oscillator", _SENSITIVITY) in mission.places and is_unshaken(mission, name)
    ]


def _of_calm_oscillators(mission: Mission) -> Iterator[_Warned]:
    """Warn of stated sensitivities to acceleration of oscillators that neither vibrate nor turn."""
    for name in calm_oscillators(mission):
        key = ("platforms", name, "oscillator", _SENSITIVITY)
        yield _Warned(key, nothing_shakes_the_oscillator(name), is_doubt=True)


@phrase
def nothing_shakes_the_oscillator(platform: str) -> str:
    """Said of a sensitivity to acceleration without vibration."""
    return (
        f"platforms.{platform}.oscillator.acceleration_sensitivity has no effect: vibration and turns act on it, "
        "but the file has none: add oscillator.vibration, or sinusoidal or spectrum to motion_error.vibration"
    )


def _of_doubted_noise(mission: Mission, rows: Sequence[Row]) -> Iterator[_Warned]:
    """Warn of oscillators with doubted noise that no row reports: no requirement depends on the noise."""
    for name in PLATFORMS:
        for key, sentence in noise_doubts(mission, name):
            if not any(row.reason is not None and row.reason.includes(sentence) for row in rows):
                yield _Warned(("platforms", name, "oscillator", key), sentence)


def _unused_correlations(mission: Mission) -> Iterator[_Warned]:
    """Warn of correlations that no row and no aggregate uses."""
    for name in PLATFORMS if mission.allocation.combine == "each" else ():
        covariance = getattr(mission.platforms, name).motion_error.covariance
        if covariance is not None and covariance.has_correlations():
            yield _Warned(("platforms", name, "motion_error", "covariance"), correlations_not_used(name))


@phrase
def stated_twice(platform: str) -> str:
    """Said of a platform with an acceleration error and an accelerometer bias."""
    return f"platforms.{platform}.motion_error: acceleration and the accelerometer bias are both stated; they add"


@phrase
def correlations_not_used(platform: str) -> str:
    """Said of a covariance where each error is judged alone."""
    return (
        f"platforms.{platform}.motion_error.covariance: correlations are not used where each error is judged alone; "
        "combine: rss uses them"
    )


@phrase
def exchanges_are_rare(aperture_time: float) -> str:
    """Said of clocks that are synchronised less than once in an aperture. [s]"""
    return (
        f"synchronization.interval: pulses are exchanged less than once in an aperture of {aperture_time:g} s; "
        "interpolation between them may make the phase worse than without synchronisation"
    )


# ---------------------------------------------------------------------- autofocus
def _of_autofocus(mission: Mission, resolution: Resolution) -> Iterator[_Warned]:
    """Warn of an `autofocus.n_pull` above the limit that range walk or the size of the scene sets."""
    n_pull, algorithm, radius = mission.autofocus.n_pull, mission.autofocus.algorithm, mission.scene.radius
    if n_pull is None:
        return
    key, limit = ("autofocus", "n_pull"), caps(mission)
    if n_pull > limit.walk:
        cells = n_pull / limit.walk / 2
        yield _Warned(key, walks_over_range_cells(n_pull, cells, rounded_down(limit.walk)))
    if radius is not None and limit.scene is not None and n_pull > limit.scene:
        smear, largest_n_pull = 4 * n_pull * float(resolution.cross_range), rounded_down(limit.scene)
        yield _Warned(key, smears_beyond_the_scene(n_pull, smear, algorithm, ROOM[algorithm], radius, largest_n_pull))


@phrase
def walks_over_range_cells(n_pull: float, cells: float, cap: str) -> str:
    """Said of a pull-in range that range walk does not leave; `cap` is the `n_pull` of half a cell, rounded down."""
    return (
        f"autofocus.n_pull: {n_pull:g} is limited to {cap}, f0/B, where the range walk is half a cell; an error of "
        f"{n_pull:g}π rad walks {cells:.3g} cells, which a one-dimensional correction does not remove"
    )


@phrase
def smears_beyond_the_scene(
    n_pull: float, smear: float, algorithm: str, room: float, radius: float, largest_n_pull: str
) -> str:
    """Said of a pull-in range that the scene's size does not leave. [m]"""
    return (
        f"autofocus.n_pull: an error of {n_pull:g}π rad smears a point over {format_quantity(smear, 'm')}; "
        f"{algorithm} needs {room:g} times that. A scene of {format_quantity(2 * radius, 'm')} across holds "
        f"n_pull {largest_n_pull}"
    )


# ---------------------------------------------------------------------- waivers
@phrase
def waiver_matches_nothing(row_id: str) -> str:
    """Said of a waiver."""
    return f"waiver {row_id}: matches no row"


@phrase
def waiver_matches_everything(row_id: str) -> str:
    """Said of a waiver."""
    return f"waiver {row_id}: names every row and would hide any new failure"


@phrase
def waiver_not_used(row_id: str) -> str:
    """Said of a waiver."""
    return f"waiver {row_id}: not used: no row that it names fails"


# ---------------------------------------------------------------------- images
@phrase
def limit_is_optimistic(row_id: str, shown: str) -> str:
    """Said of a limit of no row of the check that an image refutes."""
    return f"{row_id}: optimistic limit: {shown}"
