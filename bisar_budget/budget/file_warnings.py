"""Decides which warnings about a mission file are given. The sentences of the warnings are in `phrases`.

Most warnings do not change the verdict. A warning that casts doubt on the checked mission sets the status to at least
`warn`; `mission_doubts` decides on these. Each function yields a sentence and the key to which it refers.
`file_warnings` finds the line of the key in the file.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from bisar_budget import phrases
from bisar_budget.analysis.allocation import ROOM, caps, rounded_down
from bisar_budget.analysis.analysis import Case
from bisar_budget.budget.doubted_noise import noise_doubts
from bisar_budget.budget.doubts import missing_settings
from bisar_budget.budget.fit_noise import MAX_UNSAID_CHANGE_FRACTION, allowable_noise
from bisar_budget.budget.judged_requirements import required_keys
from bisar_budget.budget.mission_doubts import (
    MISSION_DOUBTS,
    does_not_fall,
    flies_straight,
    has_calm_oscillator,
    has_doubtful_path,
    has_idle_arm,
    missing_phase_rad,
)
from bisar_budget.budget.navigation_warnings import navigation_warnings
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.error_kinds.clock_kinds import OSCILLATOR_KIND
from bisar_budget.error_kinds.random_kinds import LEVER_ARM_KIND
from bisar_budget.faults import KeyPath, changes_words
from bisar_budget.findings.mission import FileWarning
from bisar_budget.findings.row import Row
from bisar_budget.geometry import norm, plain_vector
from bisar_budget.mission.model import Mission, id_of_requirement
from bisar_budget.mission.platforms import Platform
from bisar_budget.mission.readers import did_you_mean
from bisar_budget.phrases import Note
from bisar_budget.ranges.resolution import Resolution


class _Warned(NamedTuple):
    """A warning about a mission file: its sentence, and the key of the file to which it refers.

    The key is None if the warning refers to the whole file.
    """

    key: KeyPath | None
    message: Note
    is_of_options: bool = False


def file_warnings(
    case: Case, rows: Sequence[Row], waivers: Sequence[tuple[KeyPath, Note]]
) -> tuple[FileWarning, ...]:
    """Collect all warnings about the file of a mission.

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
        *paths_in_doubt(mission),
        *_doubtful_paths(mission),
        *_noisy_fits(mission),
        *_of_instruments(case),
        *(_Warned(*warning) for warning in navigation_warnings(case)),
        *_of_idle_entries(mission),
        *_of_doubted_noise(mission, rows),
        *_of_autofocus(mission, case.resolution),
        *_nothing_declared(rows),
    )
    return tuple(
        FileWarning(
            None if warning.key is None else mission.line(warning.key),
            warning.message,
            is_doubt=warning.message.code in MISSION_DOUBTS,
            is_of_options=warning.is_of_options,
        )
        for warning in warnings
    )


# ---------------------------------------------------------------------- what is checked
def _of_the_whole(mission: Mission, rows: Sequence[Row]) -> Iterator[_Warned]:
    if mission.changes:
        yield _Warned(
            None, phrases.note("another-mission", changes=changes_words(mission.changes)), is_of_options=True
        )
    yield from _of_own_ids(mission, rows)
    if mission.earth_orientation is not None and all(platform.orbit is None for platform in mission.platforms):
        yield _Warned(("earth_orientation",), phrases.note("no-orbit-to-turn"))
    if mission.gating_model != mission.allocation.model:
        yield _Warned(("synchronization", "method"), phrases.note("full-model-gates", model=mission.allocation.model))


def _of_own_ids(mission: Mission, rows: Sequence[Row]) -> Iterator[_Warned]:
    """Yield warnings about ids in the mission file that refer to nothing.

    These are row ids in `requirement_ids` for which there is no row or requirement, and ids in `requirement_texts`
    that `requirement_ids` does not contain.
    """
    if mission.requirement_ids:
        ids = [row.id for row in rows] + [id_of_requirement(key) for key in required_keys(mission)]
        unique_ids = set(ids)
        for row_id in mission.requirement_ids:
            if row_id not in unique_ids:
                note = phrases.note("id-of-no-row", row_id=row_id, nearest=_nearest(row_id, ids))
                yield _Warned(("requirement_ids", row_id), note)
    own_ids = tuple(own_id for ids in mission.requirement_ids.values() for own_id in ids)
    for own_id in mission.requirement_texts:
        if own_id not in own_ids:
            note = phrases.note("text-of-no-id", own_id=own_id, nearest=_nearest(own_id, own_ids))
            yield _Warned(("requirement_texts", own_id), note)


def _nearest(name: str, ids: Sequence[str]) -> str:
    """Make a hint with the most similar known id; empty if no id is similar.

    The hint is appended to a sentence about an unknown id.
    """
    hint = did_you_mean(name, tuple(ids))
    return hint and f". {hint}"


def _nothing_declared(rows: Sequence[Row]) -> Iterator[_Warned]:
    if all(row.status == "not_declared" or row.is_of_declare for row in rows):
        yield _Warned(None, phrases.note("nothing-declared"))


# ---------------------------------------------------------------------- how platforms fly
def _doubtful_paths(mission: Mission) -> Iterator[_Warned]:
    """Yield warnings about paths that may be inaccurate, unless a row already reports the doubt."""
    for name, state in zip(PLATFORMS, mission.geometry.both, strict=True):
        platform: Platform = getattr(mission.platforms, name)
        if platform.path is not None and has_doubtful_path(mission, name, state):
            for doubt in platform.path.doubts:
                note = phrases.note("path-is-doubtful", platform=name, doubt=doubt)
                yield _Warned(("platforms", name, platform.way), note)


def _noisy_fits(mission: Mission) -> Iterator[_Warned]:
    """Yield a warning for each log whose noise noticeably changes the allowables.

    The noise acts on the allowables through the smooth path that is fitted to the log.
    """
    for name in PLATFORMS:
        noise = allowable_noise(mission, name)
        if noise is not None and noise.change > MAX_UNSAID_CHANGE_FRACTION:
            note = phrases.fit_changes_allowables(name, noise.acceleration, noise.change, noise.row_id)
            yield _Warned(("platforms", name, "trajectory"), note)


def paths_in_doubt(mission: Mission) -> Iterator[_Warned]:
    """Yield warnings about platforms that move like a satellite, but not in free fall.

    The warning gives the acceleration of free fall.
    """
    axes = mission.scene.axes
    for name, state in zip(PLATFORMS, mission.geometry.both, strict=True):
        is_straight = flies_straight(mission, name, state)
        if not (is_straight or does_not_fall(mission, name, state)):
            continue
        from bisar_budget.paths.earth import free_fall  # these imports take 8 ms; most missions do not need them
        from bisar_budget.paths.free_fall import departure_of

        platform: Platform = getattr(mission.platforms, name)
        acceleration = free_fall(plain_vector(state.position), plain_vector(state.velocity), axes)
        key: str = "speed" if platform.velocity is None else "velocity"
        if is_straight:
            speed = float(norm(state.velocity))
            sentence = phrases.satellite_flies_straight(name, speed, acceleration, axes is not None)
        else:
            height, departure = (float(number) for number in departure_of(state, axes))
            phase = float(missing_phase_rad(mission, name, state))
            sentence = phrases.satellite_does_not_fall(name, height, departure, phase, acceleration, axes is not None)
            if platform.is_of_the_earth:
                key = platform.way
            elif platform.acceleration is not None:
                key = "acceleration"
        yield _Warned(("platforms", name, key), sentence)


# ---------------------------------------------------------------------- how errors are stated
def _of_instruments(case: Case) -> Iterator[_Warned]:
    """Yield warnings about synchronisation and about errors that are stated twice.

    The warnings about synchronisation concern clocks that exchange pulses less than once per aperture, and clock
    errors that the file does not give.
    """
    mission, sync = case.mission, case.mission.synchronization
    T = mission.collection.aperture_time
    if sync is not None and not sync.is_direct_path and (sync.interval or 0.0) > T:
        yield _Warned(("synchronization", "interval"), phrases.note("exchanges-are-rare", aperture_time=T))
    if mission.requirements.location_error is not None and (missing := missing_settings(mission)):
        yield _Warned(("synchronization",), phrases.note("setting-is-perfect", missing=missing))
    for error in case.random:
        declared = error.subject.axis == "accelerometer_bias" and error.declared is not None
        if declared and getattr(mission.platforms, error.owner).motion_error.acceleration is not None:
            yield _Warned(error.path, phrases.note("stated-twice", platform=error.owner))


def _of_idle_entries(mission: Mission) -> Iterator[_Warned]:
    """Yield warnings about lever arms that nothing rotates, and about oscillators that nothing accelerates."""
    paths = dict(zip(PLATFORMS, mission.geometry.both, strict=True))
    for name, path in paths.items():
        if has_idle_arm(mission, name, path):
            arm = (*LEVER_ARM_KIND.section(name), "arm")
            yield _Warned(arm, phrases.note("nothing-swings-the-arm", platform=name))
    for name, path in paths.items():
        if has_calm_oscillator(mission, name, path):
            key = OSCILLATOR_KIND.path(name, "acceleration")
            yield _Warned(key, phrases.note("nothing-shakes-the-oscillator", platform=name))


def _of_doubted_noise(mission: Mission, rows: Sequence[Row]) -> Iterator[_Warned]:
    """Yield warnings about doubtful oscillator noise that no row mentions because no requirement depends on it."""
    for name in PLATFORMS:
        for key, sentence in noise_doubts(mission, name):
            if not any(row.reason is not None and row.reason.includes(sentence) for row in rows):
                yield _Warned(("platforms", name, "oscillator", key), sentence)


def _unused_correlations(mission: Mission) -> Iterator[_Warned]:
    """Yield warnings about error correlations that have no effect because `combine: each` forms no sums."""
    for name in PLATFORMS if mission.allocation.combine == "each" else ():
        covariance = getattr(mission.platforms, name).motion_error.covariance
        if covariance is not None and covariance.has_correlations():
            yield _Warned(
                ("platforms", name, "motion_error", "covariance"),
                phrases.note("correlations-not-used", platform=name),
            )


# ---------------------------------------------------------------------- autofocus
def _of_autofocus(mission: Mission, resolution: Resolution) -> Iterator[_Warned]:
    """Yield warnings about an `autofocus.n_pull` that exceeds the bound set by range walk or by the scene size."""
    n_pull, algorithm, radius = mission.autofocus.n_pull, mission.autofocus.algorithm, mission.scene.radius
    if n_pull is None:
        return
    key, limit = ("autofocus", "n_pull"), caps(mission)
    if n_pull > limit.walk:
        cells = n_pull / limit.walk / 2
        yield _Warned(
            key, phrases.note("walks-over-range-cells", n_pull=n_pull, cells=cells, cap=rounded_down(limit.walk))
        )
    if radius is not None and limit.scene is not None and n_pull > limit.scene:
        smear, largest_n_pull = 4 * n_pull * float(resolution.cross_range), rounded_down(limit.scene)
        yield _Warned(
            key,
            phrases.note(
                "smears-beyond-the-scene",
                n_pull=n_pull,
                smear=smear,
                algorithm=algorithm,
                room=ROOM[algorithm],
                radius=radius,
                largest_n_pull=largest_n_pull,
            ),
        )
