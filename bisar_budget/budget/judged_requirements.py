"""Whether every requirement was judged: the rows that judge each, the effects that none takes, what must be declared.

Exit 0 means that every requirement was judged and is met. Each effect of each declared error is judged once: the
quadratic phase by its requirement; the cubic by its own, else by ISLR; what spreads by ISLR; a tone by PSLR, else by
ISLR; a displacement by the location. An effect that no requirement takes is negligible while all of it stays below a
tenth of the quadratic requirement and below 0.08 rad. Above, the rows that make it up are `not_evaluated`.

Every number is an array over the cases, (n,): a check is one case.
"""

from collections.abc import Callable, Container, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.budget.judged_rows import BOUND, Codes
from bisar_budget.effects.declared import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.findings.requirement import DeclaredKinds
from bisar_budget.findings.row import DECLARE
from bisar_budget.findings.status import BROKEN, RANK, STATUS
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import Platform
from bisar_budget.ranges.exact_ranges import Floats, Truths

KEYS = (QUADRATIC, CUBIC, LOCATION, "pslr", "islr", "declare")
UNITS = {QUADRATIC: "rad", CUBIC: "rad", LOCATION: "m", "pslr": "dB", "islr": "dB", "declare": ""}
ALIKE = 1e-9  # of a utilization: what is nearer is the same, but for rounding
TENTH, SMALL_RAD = 0.1, 0.08  # of the quadratic requirement; and of any image
# Of the largest part: a row with less does not make an effect up, if all that have less are negligible.
MAKES_UP = 0.1

# Requirements that take an effect, in the order in which one is suggested.
TAKEN_BY = {"cubic": (CUBIC, "islr"), "spread": ("islr",), "tone": ("pslr", "islr")}

_NONE = np.int8(len(STATUS))  # of a row that judges nothing
IS_JUDGED = np.array([one.is_judged for one in STATUS.values()])


class UntakenEffect(NamedTuple):
    """An effect that no requirement takes: where it is negligible, and the rows that make it up where it is not.

    Its total, each error's part by row id, and in `least` the smallest part of a row that makes it up. [rad]
    """

    kind: str  # cubic, spread or tone
    total: Floats
    is_negligible: Truths
    makers: Mapping[str, Truths]
    least: Floats
    parts: Mapping[str, Floats]


class RequirementState(NamedTuple):
    """How a requirement stands: its status, the place of the row that decides or -1, and the places that judge it.

    `utilization` is that of the requirement by the deciding row. `is_unjudged` is where it cannot be judged, be that
    waived or not.
    """

    key: str
    status: Codes
    decider: NDArray[np.intp]
    utilization: Floats
    judges: Truths  # (rows, n)
    is_unjudged: Truths


def first_highest(uses: Floats) -> NDArray[np.intp]:
    """Place of the row that uses most, (cases,); of rows that use as much of it, but for rounding, the first."""
    return np.asarray(is_as_high(uses, uses.max(axis=0)).argmax(axis=0))


def is_as_high(uses: Any, others: Any) -> Truths:
    """Whether utilizations are as high as others, but for rounding."""
    with np.errstate(invalid="ignore"):  # one that is endless is as high as itself
        return np.asarray((uses >= others - ALIKE * np.abs(others)) | (uses == others))


def required_keys(mission: Mission) -> tuple[str, ...]:
    """Keys of the requirements that a mission has, the default of the quadratic phase included."""
    needs = mission.requirements
    return tuple(key for key in KEYS if (needs.declare if key == "declare" else getattr(needs, key) is not None))


def requirement_states(
    mission: Mission,
    codes: Codes,
    utilization: Floats,
    judges: Codes,
    quadratic_use: Floats,
    waived: Mapping[str, Any],
    *,
    before: Codes,
    has_noise: Any,
    is_misplaced: Any,
) -> list[RequirementState]:
    """Say how every requirement stands.

    Parameters
    ----------
    mission : Mission
        Some of its numbers may be arrays (n,).
    codes : (rows, n)
        Statuses of the judged rows, of those that are waived `waived`.
    utilization : (rows, n)
        Theirs; not a number where there is none.
    judges : (rows, n)
        Place in KEYS of the requirement that each is held to, -1: none.
    quadratic_use : (rows, n)
        Quadratic phase of each over what that may be, whatever sets its allowable; not a number where it has none.
    waived : mapping of str to bool
        Keys of the requirements that a valid waiver names.
    before : (rows, n)
        Statuses of the rows before waivers.
    has_noise : (n,) bool
        Whether something that spreads, or a tone that ISLR holds, is declared: without it ISLR is not judged.
    is_misplaced : (n,) bool
        Whether a declared error displaces the image by an amount that no row holds.
    """
    uses, found = np.nan_to_num(utilization, nan=0.0, posinf=np.inf), []
    is_open = before == RANK["not_evaluated"]
    for key in required_keys(mission):
        mine = IS_JUDGED[codes] & (judges == KEYS.index(key))
        levels, used = np.where(mine, codes, _NONE), uses
        if key == QUADRATIC:  # a row that another requirement binds is held to this one too
            is_other = IS_JUDGED[codes] & ~mine & ~np.isnan(quadratic_use)
            by_autofocus = np.where(codes == RANK["pass_with_autofocus"], codes, RANK["pass"])
            broken = np.where(
                codes == RANK["waived"], codes, RANK["fail"]
            )  # a waiver of the row covers all it breaks
            breaks = np.nan_to_num(quadratic_use) > BOUND
            levels = np.where(is_other, np.where(breaks, broken, by_autofocus), levels)
            used = np.where(is_other, quadratic_use, uses)
            mine = mine | is_other
        else:  # autofocus corrects a quadratic phase alone
            levels = np.where(levels == RANK["pass_with_autofocus"], RANK["pass"], levels)
        worst = levels.min(axis=0)
        # What passes by itself may come nearer to breaking the requirement than what autofocus brings to pass.
        is_met = (worst == RANK["pass_with_autofocus"]) & (levels == RANK["pass"])
        # Of what is waived the first is what has a number that breaks the requirement.
        shown = np.where((codes == RANK["waived"]) & is_open, -0.5, used)
        decider = first_highest(np.where((levels == worst) | is_met, shown, -1.0))
        utilization, is_unknown = (np.take_along_axis(one, decider[None], axis=0)[0] for one in (used, is_open))
        is_unjudged = ~mine.any(axis=0)
        decider = np.where(is_unjudged, -1, decider)
        if key == "islr":
            is_unjudged = is_unjudged | ~np.asarray(has_noise)
        if key == LOCATION:
            is_unjudged = is_unjudged | np.asarray(is_misplaced)
        status = np.where(is_unjudged & (worst != RANK["fail"]), RANK["not_evaluated"], worst)
        is_unknown = (is_unknown & (worst == RANK["waived"])) | (status == RANK["not_evaluated"])
        if waived.get(key):
            status = np.where(np.isin(status, [RANK[name] for name in BROKEN]), RANK["waived"], status)
        found.append(RequirementState(key, status.astype(np.int8), decider, utilization, mine, is_unknown))
    return found


# ---------------------------------------------------------------------- what must be declared
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
    "time_tag": ("motion_error.time_tag", lambda one: one.motion_error.time_tag is not None),
    "lever_arm": ("motion_error.lever_arm", lambda one: one.motion_error.lever_arm is not None),
}
_NOBODY_OWES = ("time_tag", "lever_arm")  # unless `declare` asks for them


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
            elif kind not in _NOBODY_OWES and (name not in still or kind in ("position", "oscillator")):
                missing.append(f"{name}.{kind}")
    if not mission.has_direct_path:
        (declared if _states_clock(mission) else missing).append("timing")
    common, link, others = mission.common_motion_error, mission.synchronization, mission.other_errors
    legs = [] if mission.propagation is None else [mission.propagation.leg(name) for name in PLATFORMS]
    if mission.scene.height_error is not None:
        declared.append("terrain")
    for kind, is_declared, has_source in (  # nobody owes these
        ("common", common is not None, common is not None and common.source),
        ("synchronization", link is not None, link is not None and link.source),
        ("propagation", bool(legs), all(leg.source for leg in legs if leg is not None)),
        ("other", bool(others), all(one.source for one in others)),
    ):
        if is_declared:
            declared.append(kind)
            without_source += [] if has_source else [kind]
    return DeclaredKinds(tuple(declared), tuple(missing), tuple(without_source))


def _states_clock(mission: Mission) -> bool:
    """Whether the file says what the clock is wrong by: any of its terms, or what setting it left."""
    sync = mission.synchronization
    setting = () if sync is None else (sync.time_error, sync.frequency_error)
    return any(term is not None for term in (*mission.timing_error, *setting))


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
    if kind == "lever_arm":
        return bool(error.lever_arm is not None and error.lever_arm.source) or bool(error.source)
    return bool(error.source if kind in ("vibration", "time_tag") else error.evidence(kind))


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
            if not _states_clock(mission):
                sync = mission.synchronization
                is_set = sync is not None and sync.is_holdover
                yield Missing("clock", kind, "synchronization.time_error" if is_set else "timing_error")
            continue
        key, declares = _DECLARES[kind]
        for name in (owner,) if dot else PLATFORMS:
            owes = name not in still or kind == "position" or (kind == "oscillator" and bool(dot))
            if owes and not declares(getattr(mission.platforms, name)):
                yield Missing(name, kind, f"platforms.{name}.{key}")


def is_asked_for(what: Subject, missing: Missing) -> bool:
    """Whether a row is about what is asked for and missing."""
    return what.owner == missing.owner and (what.kind == missing.kind or missing.owner == "clock")
