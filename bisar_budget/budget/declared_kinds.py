"""Kinds of error that a mission can declare: which it does, which not, and which without a source."""

from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.findings.requirement import DeclaredKinds
from bisar_budget.geometry import norm
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import Platform

MOTION = ("position", "velocity", "acceleration")


def declared_kinds(mission: Mission) -> DeclaredKinds:
    """List the kinds of a mission, by owner; a still platform owes its position alone of the errors of its path."""
    declared, missing, without_source = list[str](), list[str](), list[str]()
    for name in PLATFORMS:
        platform: Platform = getattr(mission.platforms, name)
        error = platform.motion_error
        is_still = norm(platform.state.velocity) == 0 and platform.acceleration is None
        stated = {kind: error.stated(kind) is not None for kind in (MOTION[:1] if is_still else MOTION)}
        vibration = error.vibration
        stated["vibration"] = bool(vibration.sinusoidal or vibration.wideband)
        if not is_still:
            stated["imu"] = error.imu is not None
        stated["random"] = bool(error.random)
        sources = {kind: error.evidence(kind) for kind in MOTION}
        sources["vibration"] = error.source
        sources["imu"] = None if error.imu is None else error.imu.source or error.source
        own = [process.source for process in error.random]
        sources["random"] = error.evidence("random") or (own[0] if own and all(own) else None)
        if not mission.has_direct_path:
            stated["oscillator"] = platform.oscillator is not None
            sources["oscillator"] = None if platform.oscillator is None else platform.oscillator.source
        for kind, is_stated in stated.items():
            (declared if is_stated else missing).append(f"{name}.{kind}")
            if is_stated and not sources[kind]:
                without_source.append(f"{name}.{kind}")
    if not mission.has_direct_path:
        has_clock = any(term is not None for term in mission.timing_error)
        (declared if has_clock else missing).append("timing")
    return DeclaredKinds(tuple(declared), tuple(missing), tuple(without_source))
