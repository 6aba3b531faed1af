"""Kinds of error that a mission can declare, and the kinds that `requirements.declare` obliges it to declare.

A kind of error is declared if the file gives any value for it, including zero. An empty section does not declare a
kind. Some errors need two entries of the file to have any effect. If the file gives only one of the two entries, the
kind is not declared. Examples are a lever arm without an attitude error that rotates it, and an oscillator with an
acceleration sensitivity but without an acceleration.
"""

from collections.abc import Callable, Container, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bisar_budget.arrays import Booleans, PerCase, PerCaseFlag
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.oscillator_acceleration import is_unshaken
from bisar_budget.error_kinds.clock_kinds import TIMING_KIND
from bisar_budget.error_kinds.kind import SourceKind
from bisar_budget.error_kinds.random_kinds import INERTIAL_FIGURES, NAVIGATION_KIND
from bisar_budget.error_kinds.registry import kind_of, registered_names
from bisar_budget.findings.requirement import DeclaredKinds, ShiftedFigure
from bisar_budget.findings.row import DECLARE
from bisar_budget.geometry import BistaticGeometry, PlatformState, norm
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import Platform
from bisar_budget.mission.propagation import LEAST_ELEVATION_DEG, least_elevation_deg
from bisar_budget.mission.quantities import value_at

DECLARATIONS = subject("mission", DECLARE)  # the row of all required declarations
_TILTING_FIGURES = [figure for figure in INERTIAL_FIGURES.values() if figure.tilts]


class Missing(NamedTuple):
    """A required error that the file does not declare.

    `owner` is a platform, the clock or the mission, `kind` is the kind of error, and `key` is the key to add to the
    file. Some errors need two entries in the file to have any effect. If the file gives only one of them, `lacks`
    describes the missing entry.
    """

    owner: str
    kind: str
    key: str
    lacks: str = ""


# ---------------------------------------------------------------------- half of a cause
def swings_nothing(platform: Platform) -> PerCaseFlag:
    """Whether a platform has a nonzero lever arm, but no attitude error that would rotate it.

    The result is a Boolean or an array (cases,).
    """
    lever, imu = platform.motion_error.lever_arm, platform.motion_error.imu
    if lever is None or lever.arm is None:
        return False
    if platform.motion_error.navigation is not None:
        return False
    if imu is not None and any(getattr(imu, figure.key) is not None for figure in _TILTING_FIGURES):
        return False
    return np.asarray(norm(lever.arm)) > 0


def _lacks_an_attitude(mission: Mission, name: str) -> str:
    """Describe the attitude errors that are missing although the file gives a lever arm; empty if nothing is missing.

    A lever arm has an effect only if an attitude error rotates it. If the file gives the arm, an attitude error is
    therefore required too. A stated uncertainty of the arm does not replace the attitude error.
    """
    if not np.any(swings_nothing(getattr(mission.platforms, name))):
        return ""
    return "imu.attitude, gyro_bias or angle_random_walk, which swings the arm"


def _lacks_half_of_a_vibration(mission: Mission, name: str) -> str:
    """Describe which entry of an oscillator is missing: its acceleration sensitivity or its vibration.

    Vibration and acceleration sensitivity have an effect only together. The text is empty if both or neither are
    given.
    """
    platform: Platform = getattr(mission.platforms, name)
    if platform.oscillator is not None and platform.oscillator.acceleration_sensitivity is None:
        is_shaken = np.any(_vibrates(platform))
        return "oscillator.acceleration_sensitivity, by which vibration acts on it" if is_shaken else ""
    if not np.any(is_unshaken(mission, name)):
        return ""
    return (
        "oscillator.vibration, and no sinusoidal or spectrum of motion_error.vibration, on which "
        "acceleration_sensitivity acts"
    )


def _vibrates(platform: Platform) -> PerCaseFlag:
    """Whether the platform states a vibration that is not zero, as a Boolean or an array (cases,)."""
    vibration = platform.motion_error.vibration
    if vibration.spectrum is not None:
        return True
    sizes = [tone.amplitude for tone in vibration.sinusoidal]
    sizes += [] if vibration.wideband is None else [vibration.wideband.rms]
    lengths = [norm(size) if isinstance(size, tuple) else size for size in sizes]
    return np.asarray(np.any([*np.broadcast_arrays(False, *lengths)], axis=0))


# ---------------------------------------------------------------------- the table of kinds
def _whole(mission: Mission, name: str) -> str:
    """Return an empty string, which means that no entry is missing.

    This kind of error needs only a single entry, and the file has it.
    """
    return ""


# Words of `requirements.declare` that are no kinds of error, with the path of their section.
_SECTIONS_OF_OTHER_WORDS = {
    "covariance": "platforms.{owner}.motion_error.covariance",
    "common": "common_motion_error",
}


def _key(word: str, owner: str) -> str:
    """Path of the key or section of the mission file that states a kind of error.

    `word` names the kind in `requirements.declare`.
    """
    if word in _SECTIONS_OF_OTHER_WORDS:
        return _SECTIONS_OF_OTHER_WORDS[word].format(owner=owner)
    kind = kind_of(word)
    assert isinstance(kind, SourceKind)
    return ".".join(map(str, kind.section(owner)))


def _states(mission: Mission, key: str) -> bool:
    """Whether a mission states a value, or a list or section that is not empty, at the path `key`."""
    value = value_at(mission, key)
    return value is not None and (not isinstance(value, tuple) or bool(value)) and getattr(value, "is_stated", True)


@dataclass(frozen=True)
class _OfPlatform:
    """A kind of error that each platform can have, and functions that examine a mission file for this kind.

    `lacks` returns the name of a missing key without which the stated error has no effect. The name is empty if
    nothing is missing. If `needs_both` is true, the kind does not count as declared while such a key is missing.

    If `is_owed` is false, a file need not declare the kind, and the kind counts as missing only if the file states a
    part of it. For a platform that does not move, only kinds with a true `is_owed_still` are required. If `is_listed`
    is false, an error of this kind counts as an error of different kinds, for example a covariance as position and
    velocity. If `is_clock` is true, the kind is not needed with a direct path. If `is_in_navigation` is true, the
    kind is part of an aided navigation, and a file with an aided navigation need not declare it separately.
    """

    has_source: Callable[[Platform], bool]
    lacks: Callable[[Mission, str], str] = _whole
    needs_both: bool = False
    is_owed: bool = True
    is_owed_still: bool = False
    is_listed: bool = True
    is_clock: bool = False
    is_in_navigation: bool = False


def _is_sourced(figure: str) -> Callable[[Platform], bool]:
    return lambda platform: bool(platform.motion_error.evidence(figure))


def _has_own_source(platform: Platform) -> bool:
    return bool(platform.motion_error.source)


def _has_source_of_imu(platform: Platform) -> bool:
    error = platform.motion_error
    stated = {} if error.imu is None else error.imu._asdict()
    source = stated.pop("source", None)
    return bool(source) or all(error.evidence(key) for key, figure in stated.items() if figure is not None)


def _has_source_of_random(platform: Platform) -> bool:
    error = platform.motion_error
    return bool(error.evidence("random")) or all(process.source for process in error.random)


def _has_source_of_navigation(platform: Platform) -> bool:
    navigation = platform.motion_error.navigation
    return navigation is not None and all(map(navigation.evidence, navigation.figures))


def _has_source_of_lever_arm(platform: Platform) -> bool:
    lever = platform.motion_error.lever_arm
    return bool(lever is not None and lever.source) or bool(platform.motion_error.source)


_KINDS_OF_PLATFORMS: Mapping[str, _OfPlatform] = {
    "position": _OfPlatform(_is_sourced("position"), is_owed_still=True),
    "velocity": _OfPlatform(_is_sourced("velocity")),
    "acceleration": _OfPlatform(_is_sourced("acceleration")),
    "covariance": _OfPlatform(_is_sourced("covariance"), is_listed=False),
    "vibration": _OfPlatform(_has_own_source),
    "imu": _OfPlatform(_has_source_of_imu, is_in_navigation=True),
    "random": _OfPlatform(_has_source_of_random, is_in_navigation=True),
    "navigation": _OfPlatform(_has_source_of_navigation, is_owed=False),
    "oscillator": _OfPlatform(
        lambda platform: platform.oscillator is not None and bool(platform.oscillator.source),
        _lacks_half_of_a_vibration,
        is_owed_still=True,
        is_clock=True,
    ),
    "time_tag": _OfPlatform(_has_own_source, is_owed=False),
    "lever_arm": _OfPlatform(_has_source_of_lever_arm, _lacks_an_attitude, needs_both=True, is_owed=False),
}
_REGISTERED = _OfPlatform(_has_own_source, is_owed=False)  # no file is obliged to declare a registered kind


def _of_platforms() -> Mapping[str, _OfPlatform]:
    """Return the kinds of error that a platform can have, by name, including kinds that other packages registered."""
    return {**_KINDS_OF_PLATFORMS, **dict.fromkeys(registered_names(), _REGISTERED)}


@dataclass(frozen=True)
class _OfMission:
    """A kind of error that belongs to no single platform, and functions that examine a mission file for this kind.

    Such errors are errors of the clocks and of the atmosphere, errors that both platforms have in common, and errors
    with other causes.
    """

    owner: str
    has_source: Callable[[Mission], bool] = lambda mission: True
    missing: Callable[[Mission], list[str]] | None = None  # keys that the file should have; None: the kind's own key
    is_owed: Callable[[Mission], bool] = lambda mission: False
    has_halves: bool = False  # the file may state a part of the kind
    is_stated: Callable[[Mission], bool] | None = None  # None: the file has the kind's own key


def _states_clock(mission: Mission) -> bool:
    """Whether the file states a clock error: a term of the timing error, or an error left by synchronisation."""
    sync = mission.synchronization
    setting = () if sync is None else (sync.time_error, sync.frequency_error)
    terms = map(mission.timing_error.stated, TIMING_KIND.sizes)
    return any(term is not None for term in (*terms, *setting))


def _key_of_clock(mission: Mission) -> list[str]:
    sync = mission.synchronization
    return ["synchronization.time_error" if sync is not None and sync.is_holdover else "timing_error"]


def _runs_two_clocks(mission: Mission) -> bool:
    """Whether the receiver has a clock of its own, so that the errors of both oscillators matter.

    With a direct path they do not matter, because the receiver then uses the transmitter's signal as its clock.
    """
    return not mission.has_direct_path


def _lacking_of_setting(mission: Mission) -> list[str]:
    """List the keys of `synchronization` that the file lacks.

    If the whole section is missing, the list contains `synchronization`. Clocks in holdover need both the time error
    and the frequency error that remain after synchronisation.
    """
    sync = mission.synchronization
    if sync is None:
        return ["synchronization"]
    halves = ("time_error", "frequency_error") if sync.is_holdover else ()
    return [f"synchronization.{key}" for key in halves if getattr(sync, key) is None]


def _legs_without_delay(mission: Mission) -> list[str]:
    """List the keys of atmospheric delays that the file lacks.

    If the section `propagation` is missing, it is the only key in the list. Otherwise the list has the keys of the
    legs of the path for which the file gives no delay. A leg needs a delay only if its elevation is high enough for a
    zenith delay to apply.
    """
    if mission.propagation is None:
        return ["propagation"]
    T, lacking = mission.collection.aperture_time, []
    for name, path in zip(PLATFORMS, mission.geometry.both, strict=True):
        is_high = np.any(_is_high(path, T))
        if mission.propagation.leg(name) is None and is_high:
            lacking.append(f"propagation.{name}")
    return lacking


def _is_high(path: PlatformState, aperture_time_s: PerCase) -> Booleans:
    """Whether a zenith delay applies to the leg of a platform, as a Boolean or an array (cases,)."""
    return np.asarray(least_elevation_deg(path, aperture_time_s) >= LEAST_ELEVATION_DEG)


def _has_source_of_air(mission: Mission) -> bool:
    legs = [] if mission.propagation is None else [mission.propagation.leg(name) for name in PLATFORMS]
    return all(leg.source for leg in legs if leg is not None)


_CLOCK_KIND = "timing"
_KINDS_OF_MISSION: Mapping[str, _OfMission] = {
    _CLOCK_KIND: _OfMission("clock", missing=_key_of_clock, is_owed=_runs_two_clocks, is_stated=_states_clock),
    "terrain": _OfMission("mission"),
    "common": _OfMission(
        "mission",
        lambda mission: mission.common_motion_error is not None and bool(mission.common_motion_error.source),
    ),
    "synchronization": _OfMission(
        "clock",
        lambda mission: mission.synchronization is not None and bool(mission.synchronization.source),
        _lacking_of_setting,
        _runs_two_clocks,
        has_halves=True,
    ),
    "propagation": _OfMission(
        "mission", _has_source_of_air, _legs_without_delay, lambda mission: True, has_halves=True
    ),
    "other": _OfMission("mission", lambda mission: all(other.source for other in mission.other_errors)),
}


def _is_stated_of_mission(mission: Mission, kind: str) -> bool:
    """Whether the file states a kind of error that belongs to no single platform."""
    of_mission = _KINDS_OF_MISSION[kind]
    if of_mission.is_stated is not None:
        return of_mission.is_stated(mission)
    return _states(mission, _key(kind, of_mission.owner))


# ---------------------------------------------------------------------- declarations of a mission
def declared_kinds(mission: Mission) -> DeclaredKinds:
    """List the kinds of error that a mission declares, fails to declare, or declares without stating a source.

    A covariance counts as position and velocity. If a direct path serves as the clock, timing errors and oscillators
    are not listed. The result also lists the spectra that the file shifts by a number of decibels.
    """
    declared, missing, without_source = list[str](), list[str](), list[str]()
    still = still_platforms(mission)
    for name in PLATFORMS:
        platform: Platform = getattr(mission.platforms, name)
        for kind, of_platform in _of_platforms().items():
            if not of_platform.is_listed or (of_platform.is_clock and mission.has_direct_path):
                continue
            if of_platform.is_in_navigation and platform.motion_error.navigation is not None:
                continue
            is_stated = _states(mission, _key(kind, name))
            if is_stated and not (of_platform.needs_both and of_platform.lacks(mission, name)):
                declared.append(f"{name}.{kind}")
                if not of_platform.has_source(platform):
                    without_source.append(f"{name}.{kind}")
            elif is_stated or (of_platform.is_owed and (name not in still or of_platform.is_owed_still)):
                missing.append(f"{name}.{kind}")
    for kind, of_mission in _KINDS_OF_MISSION.items():
        if _is_stated_of_mission(mission, kind):
            declared.append(kind)
            if not of_mission.has_source(mission):
                without_source.append(kind)
        elif of_mission.is_owed(mission):
            missing.append(kind)
    shifted, required = tuple(shifted_figures(mission)), mission.requirements.declare
    return DeclaredKinds(tuple(declared), tuple(missing), tuple(without_source), shifted, required)


def shifted_figures(mission: Mission) -> Iterator[ShiftedFigure]:
    """Yield each phase-noise or vibration spectrum that the file raises or lowers by a number of decibels."""
    for name in PLATFORMS:
        platform: Platform = getattr(mission.platforms, name)
        oscillator, vibration = platform.oscillator, platform.motion_error.vibration
        source, levels = platform.motion_error.source, list[tuple[str, str, float | None, str | None]]()
        levels.append(("vibration", "motion_error.vibration.spectrum_level", vibration.spectrum_level, source))
        if platform.motion_error.navigation is not None:
            navigation = platform.motion_error.navigation
            levels.append(("navigation", "motion_error.navigation.level", navigation.level, navigation.source))
        if oscillator is not None:
            felt = None if oscillator.vibration is None else oscillator.vibration.spectrum_level
            levels.append(("oscillator", "oscillator.level", oscillator.level, oscillator.source))
            # `oscillator.source` is not the source of the vibration that the oscillator feels.
            levels.append(("oscillator", "oscillator.vibration.spectrum_level", felt, None))
        for kind, key, level, its_source in levels:
            if level:
                yield ShiftedFigure(f"{name}.{kind}", f"platforms.{name}.{key}", level, its_source)


def still_platforms(mission: Mission) -> list[str]:
    """List the names of the platforms that do not move in the frame of the scene."""
    return [name for name in PLATFORMS if getattr(mission.platforms, name).state.is_still]


# ---------------------------------------------------------------------- required declarations
def missing_declarations(mission: Mission, still: Container[str] | None = None) -> list[Missing]:
    """List the errors that `requirements.declare` requires but the file does not declare, without duplicates.

    A kind of error counts as declared if the file has one of the following entries:

    - position and velocity: their own values or a covariance;
    - the clock: any term of its error;
    - a vibration: lines or noise;
    - an inertial sensor: any of its figures;
    - the atmosphere: the delays of each leg.

    For a platform that does not move, only the position is required. The oscillator is required too if an entry of
    `requirements.declare` names the platform. An error that both platforms have in common does not count as a
    declaration for either platform alone.

    Parameters
    ----------
    mission : Mission
        Mission as loaded from its file.
    still : container of str, optional
        Names of the platforms that do not move. If omitted, they are derived from the paths.
    """
    if not mission.requirements.declare:
        return []
    if still is None:
        still = still_platforms(mission)
    return list(dict.fromkeys(_missing(mission, still)))


def groups_alike(mission: Mission, geometry: BistaticGeometry, cases: int) -> Iterator[Booleans]:
    """Yield masks (cases,) of groups of cases that lack the same required errors.

    In all cases of a group, the same platforms move, the same platforms vibrate, and the same entries have no effect.
    Nearly always, there is only one group.
    """
    flags: list[PerCaseFlag] = []
    for name, path in zip(PLATFORMS, geometry.both, strict=True):
        platform: Platform = getattr(mission.platforms, name)
        flags += [path.is_still, swings_nothing(platform), is_unshaken(mission, name), _vibrates(platform)]
        flags.append(_is_high(path, mission.collection.aperture_time))
    of_cases = np.array([np.broadcast_to(flag, (cases,)) for flag in flags])
    for alike in np.unique(of_cases, axis=1).T:
        yield np.asarray((of_cases == alike[:, None]).all(axis=0))


def _missing(mission: Mission, still: Container[str]) -> Iterator[Missing]:
    for asked in mission.requirements.declare:
        owner, dot, kind = asked.rpartition(".")
        of_mission = _KINDS_OF_MISSION.get(kind)
        if of_mission is not None:
            if of_mission.has_halves or not _is_stated_of_mission(mission, kind):
                own_key = [_key(kind, of_mission.owner)]
                keys = own_key if of_mission.missing is None else of_mission.missing(mission)
                yield from (Missing(of_mission.owner, kind, key) for key in keys)
            continue
        of_platform = _of_platforms()[kind]
        for name in (owner,) if dot else PLATFORMS:
            # A still platform owes an oscillator only if the requirement names the platform.
            is_owed_still = of_platform.is_owed_still and (bool(dot) or not of_platform.is_clock)
            if name in still and not is_owed_still:
                continue
            key = _key(kind, name)
            is_in_navigation = of_platform.is_in_navigation and _states(mission, _key(NAVIGATION_KIND.name, name))
            if not (is_in_navigation or _states(mission, key)):
                yield Missing(name, kind, key)
            elif lacks := of_platform.lacks(mission, name):
                yield Missing(name, kind, key, lacks)


def is_asked_for(row_subject: Subject, missing: Missing) -> bool:
    """Whether a row belongs to `missing`, a required error that the file does not declare."""
    is_clocks = missing.kind == _CLOCK_KIND  # all rows of the clock belong to it
    return row_subject.owner == missing.owner and (is_clocks or row_subject.kind == missing.kind)
