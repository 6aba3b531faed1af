"""Errors that `requirements.declare` asks the file to declare: what is missing cannot be shown to comply."""

from collections.abc import Callable, Container, Iterator, Mapping
from typing import NamedTuple

from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.subject import Subject, subject
from bisar_budget.findings.requirement import DeclaredKinds
from bisar_budget.findings.row import DECLARE
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import Platform

DECLARATIONS = subject("mission", DECLARE)  # the row of all that is asked for


class Missing(NamedTuple):
    """An error that the file should declare and does not: owner and kind of its rows, and its key in the file."""

    owner: str
    kind: str
    key: str


# What declares a kind of error, and where it stands below a platform. A zero declares; an empty section does not.
_DECLARES: Mapping[str, tuple[str, Callable[[Platform], bool]]] = {
    "position": ("motion_error.position", lambda one: one.motion_error.stated("position") is not None),
    "velocity": ("motion_error.velocity", lambda one: one.motion_error.stated("velocity") is not None),
    "acceleration": ("motion_error.acceleration", lambda one: one.motion_error.acceleration is not None),
    "covariance": ("motion_error.covariance", lambda one: one.motion_error.covariance is not None),
    "vibration": ("motion_error.vibration", lambda one: one.motion_error.vibration.is_stated),
    "imu": ("motion_error.imu", lambda one: one.motion_error.imu is not None and one.motion_error.imu.is_stated),
    "random": ("motion_error.random", lambda one: bool(one.motion_error.random)),
    "oscillator": ("oscillator", lambda one: one.oscillator is not None),
}


def declared_kinds(mission: Mission) -> DeclaredKinds:
    """List the kinds of error that a mission owes or declares, by owner: which it declares, and which lack a source.

    A covariance is position and velocity. With a direct path as clock there are no timing errors and no oscillators.
    """
    declared, missing, without_source = list[str](), list[str](), list[str]()
    still = still_platforms(mission)
    for name in PLATFORMS:
        platform: Platform = getattr(mission.platforms, name)
        for kind, (_, declares) in _DECLARES.items():
            if kind == "covariance" or (kind == "oscillator" and mission.has_direct_path):
                continue
            is_declared = declares(platform)
            if is_declared:
                declared.append(f"{name}.{kind}")
                if not _has_source(platform, kind):
                    without_source.append(f"{name}.{kind}")
            elif name not in still or kind in ("position", "oscillator"):
                missing.append(f"{name}.{kind}")
    if not mission.has_direct_path:
        has_clock = any(term is not None for term in mission.timing_error)
        (declared if has_clock else missing).append("timing")
    common, link, others = mission.common_motion_error, mission.synchronization, mission.other_errors
    if mission.scene.height_error is not None:
        declared.append("terrain")
    for kind, is_declared, has_source in (  # nobody owes these
        ("common", common is not None, common is not None and common.source),
        ("synchronization", link is not None, link is not None and link.source),
        ("other", bool(others), all(one.source for one in others)),
    ):
        if is_declared:
            declared.append(kind)
            without_source += [] if has_source else [kind]
    return DeclaredKinds(tuple(declared), tuple(missing), tuple(without_source))


def _has_source(platform: Platform, kind: str) -> bool:
    error = platform.motion_error
    if kind == "oscillator":
        return platform.oscillator is not None and bool(platform.oscillator.source)
    if kind == "imu":
        stated = {} if error.imu is None else error.imu._asdict()
        source = stated.pop("source", None)
        return bool(source) or all(error.evidence(key) for key, figure in stated.items() if figure is not None)
    if kind == "random":
        return bool(error.evidence("random")) or all(process.source for process in error.random)
    return bool(error.source if kind == "vibration" else error.evidence(kind))


def still_platforms(mission: Mission) -> list[str]:
    """Names of the platforms that do not move in the frame of the scene."""
    return [name for name in PLATFORMS if getattr(mission.platforms, name).state.is_still]


def missing_declarations(mission: Mission, still: Container[str] | None = None) -> list[Missing]:
    """List what `requirements.declare` asks for and the file does not declare: all of it, each once.

    A covariance declares position and velocity. The clock is declared by any term of its error, a vibration by lines
    or noise, an inertial sensor by any of its figures. A platform that does not move owes its position only, and an
    oscillator where it is asked for by the platform's name. An error that is common to both platforms says nothing
    of their own.

    Parameters
    ----------
    mission : Mission
        As loaded.
    still : container of str, optional
        Names of the platforms that do not move; omitted: by their paths.
    """
    if not mission.requirements.declare:
        return []
    if still is None:
        still = still_platforms(mission)
    return list(dict.fromkeys(_missing(mission, still)))


def _missing(mission: Mission, still: Container[str]) -> Iterator[Missing]:
    for asked in mission.requirements.declare:
        owner, dot, kind = asked.rpartition(".")
        if kind == "timing":
            if all(term is None for term in mission.timing_error):
                yield Missing("clock", kind, "timing_error")
            continue
        key, declares = _DECLARES[kind]
        for name in (owner,) if dot else PLATFORMS:
            owes = name not in still or kind == "position" or (kind == "oscillator" and bool(dot))
            if owes and not declares(getattr(mission.platforms, name)):
                yield Missing(name, kind, f"platforms.{name}.{key}")


def is_asked_for(what: Subject, missing: Missing) -> bool:
    """Whether a row is about what is asked for and missing."""
    return what.owner == missing.owner and (what.kind == missing.kind or missing.owner == "clock")
