"""Paths whose own doubt exceeds the declared position error: that error is not the whole truth.

A path by an orbit or a log says how far the truth may be from it: by the age of its elements, the interpolation of
its ephemeris, the residual of its smoothed log. A position error that is smaller cannot be that of this path.
"""

from typing import Any, NamedTuple

from bisar_budget import phrases
from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.subject import Subject
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import FlownPath, MotionError, Platform
from bisar_budget.phrases import Note

LEAST_M = 1e-3  # of a doubt; what is less is no story beside any declared error, zero included


class InputDoubt(NamedTuple):
    """A platform whose path is in doubt by more than the file declares.

    `doubt` is how far the truth may be from the path [m], `declared` the root-sum-square of the position errors that
    the file declares, without the coverage factor, 0 where it declares none [m]. `note` says both.
    """

    owner: str
    doubt: float
    declared: float
    note: Note


def input_doubts(mission: Mission) -> list[InputDoubt]:
    """Platforms whose paths are in doubt by more than the file declares."""
    found = []
    for name in PLATFORMS:
        platform: Platform = getattr(mission.platforms, name)
        path, declared = platform.path, declared_position_error(platform.motion_error)
        if path is not None and path.doubt_m > least_doubt(path, declared):
            key = f"platforms.{name}.motion_error.position"
            note = phrases.input_in_doubt(path.doubt_m, path.doubt_of, declared, key)
            found.append(InputDoubt(name, path.doubt_m, declared or 0.0, note))
    return found


def declared_position_error(error: MotionError) -> Any:
    """Root-sum-square of the position errors of a platform, or None: constant ones, and random ones of GNSS. [m]

    Numbers of the mission may be arrays (cases,), and so may be the result.
    """
    stated = error.stated("position")
    sizes = [*(stated or ()), *(sigma for one in error.random for sigma in one.sigma)]
    return sum(size**2 for size in sizes) ** 0.5 if sizes else None


def least_doubt(path: FlownPath, declared: Any) -> Any:
    """Doubt of a path that a declared position error allows, or None; shaped as that error. [m]"""
    if declared is None:
        return LEAST_M if path.is_doubted else path.doubt_m
    return declared + (LEAST_M - declared) * (declared < LEAST_M)


def is_in_doubt(what: Subject, owner: str, mission: Mission) -> bool:
    """Whether a row is of a position error of a platform, along the axes that the file states it in."""
    error: MotionError = getattr(mission.platforms, owner).motion_error
    frame = "scene" if error.stated("position") is None else error.frame
    return what.owner == owner and what.kind == "position" and what.frame == frame
