"""Form images with each error set exactly at its limit, and measure whether the limit is true."""

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext
from fnmatch import fnmatchcase
from functools import partial

import numpy as np

from bisar_budget.analysis.vibration_limits import tone_limits
from bisar_budget.budget.aggregates import Aggregates
from bisar_budget.budget.judged_rows import Judging
from bisar_budget.effects.declared import QUADRATIC
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.vibration import SLOWEST, lines_of
from bisar_budget.faults import printable
from bisar_budget.findings.images import Verdict, VerifiedMission
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.verify import duration, phase_cases
from bisar_budget.verify import vibration_cases as vibration
from bisar_budget.verify.location_case import location
from bisar_budget.verify.study import Study
from bisar_budget.workers import MapBlocks, Progress, unseen, worker_pool

__all__ = ["Study", "rows_to_verify", "seconds_to_verify", "verify_mission"]

Case = Callable[[], Verdict]


def verify_mission(
    mission: Mission,
    only: str = "*",
    jobs: int = 1,
    progress: Progress = unseen,
    mapped: MapBlocks | None = None,
) -> VerifiedMission:
    """Verify every limit of a mission whose row id matches a glob.

    Parameters
    ----------
    mission : Mission
        As loaded.
    only : str
        Glob of row ids.
    jobs : int
        Processes; the verdicts do not depend on it.
    progress : callable
        Told, after each row, how many are done, and how many there are.
    mapped : callable, optional
        Has others form the images instead of processes here.

    Returns
    -------
    VerifiedMission
        Rows with a limit, in the order of `check`, and both platforms' vibration together.
    """
    mission = mission._replace(places={})  # the parser's marks cannot go to another process, and nobody asks here
    known = cases(Study(mission))
    wanted = [row_id for row_id in known if fnmatchcase(row_id, only)]
    jobs = min(jobs, len(wanted))
    with worker_pool(jobs, "spawn") if jobs > 1 and mapped is None else nullcontext() as pool:
        found: Iterable[tuple[str, Verdict]]
        if mapped is not None:
            found = mapped(_verify_row, mission, wanted, f"{{}} of {printable(mission.name)}".format)
        elif pool is not None:
            found = zip(wanted, pool.map(partial(_verify_row, mission), wanted), strict=True)
        else:
            found = ((row_id, known[row_id]()) for row_id in wanted)
        rows = {}
        for row_id, verdict in found:
            rows[row_id] = verdict
            progress(len(rows), len(wanted))
    return VerifiedMission(
        file=mission.file,
        name=mission.name,
        rows=tuple(rows[row_id] for row_id in wanted),
        conditions=", ".join(_conditions(mission)),
        changes=mission.changes,
    )


def rows_to_verify(mission: Mission, only: str = "*") -> list[str]:
    """Ids of the rows that `verify_mission` would verify."""
    return [row_id for row_id in cases(Study(mission)) if fnmatchcase(row_id, only)]


def seconds_to_verify(mission: Mission, only: str = "*", jobs: int = 1) -> float:
    """About how long `verify_mission` will take; 0 where it is far below a minute. [s]"""
    mission = mission._replace(places={})
    wanted = rows_to_verify(mission, only)
    return duration.seconds_to_verify(mission, cases, wanted) / max(1, min(jobs, len(wanted)))


def cases(study: Study) -> dict[str, Case]:
    """Row ids in the order of `check`, with the call that verifies each."""
    return dict(_cases(study))


def _warns_of_the_total(study: Study) -> bool:
    """Whether each error stands alone, and all together exceed the total: only then the row exists."""
    aggregates = Aggregates(Judging(1, study.mission.allocation.warn_above), study.analysis)
    rows = (row for model in study.models for row in aggregates.rows(model.name))
    with np.errstate(all="ignore"):
        return any(row.judged.subject == subject("mission", QUADRATIC) and np.all(row.is_there) for row in rows)


def _verify_row(mission: Mission, row_id: str) -> Verdict:
    return cases(Study(mission))[row_id]()


def _conditions(mission: Mission) -> Iterator[str]:
    """Say of what images the verdicts are, and which keys of the file have no part in them."""
    settings = mission.simulation or Simulation()
    yield f"one point, exact ranges, {settings.window} window"
    yield "no noise" if settings.noise is None else "no noise (simulation.noise is for `simulate`)"
    given = mission.collection.pulses
    yield "pulses as needed" + (f" (the {given} of collection.pulses must not alias)" if given else "")


def _order(one: Subject) -> tuple[int, int]:
    """Sort key of a platform's vibrations, in the order of `check`: lines, lines together, noise."""
    return (("sinusoidal", "sinusoidal.sum", "wideband").index(one.axis), one.entry or 0)


def _of_tones_by_islr(study: Study) -> Iterator[tuple[Subject, Case]]:
    """Lines of vibration where ISLR holds their power."""
    from bisar_budget.verify.random_cases import verify_spread_tone

    metric, limits = tone_limits(study.mission, study.allocation)
    for name, limit in limits.items() if metric == "islr" else ():
        T, size = study.collection.aperture_time, limit.by(study.model)
        cycles = [line.frequency * T for line in lines_of(study.mission, name)] or [vibration.UNDECLARED_CYCLES]
        for index, turns in enumerate(cycles):
            if turns >= SLOWEST:
                one = subject(name, "vibration", "sinusoidal", entry=index)
                blank = Verdict(id=one.id, model=study.model, boundary_error=size, unit="m")
                yield one, partial(verify_spread_tone, study, blank, name, size, turns)


def _of_instruments(study: Study) -> Iterator[tuple[str, Case]]:
    """Sensors and clocks that have a limit, and what all noise spreads together."""
    from bisar_budget.budget.random_rows import RandomRows
    from bisar_budget.effects.oscillators import spurs_of
    from bisar_budget.verify.random_cases import (
        limits_of,
        verify_islr,
        verify_pslr,
        verify_random,
        verify_spread_tone,
        verify_spur,
    )

    for error in study.analysis.random:
        if limits_of(study, error):
            yield error.id, partial(verify_random, study, error)
    metric, limits = tone_limits(study.mission, study.allocation)
    for spur in spurs_of(study.mission):
        limit = limits.get(spur.name)
        if limit is None:
            continue
        row_id, size = subject(spur.name, "oscillator", "spur", entry=spur.entry).id, limit.by(study.model)
        if metric == "pslr":
            yield row_id, partial(verify_spur, study, spur, row_id, size)
        else:
            level = 20 * math.log10(math.pi * size / study.collection.wavelength)
            blank = Verdict(id=row_id, model=study.model, boundary_error=level, unit="dB")
            cycles = spur.frequency * study.collection.aperture_time
            yield row_id, partial(verify_spread_tone, study, blank, spur.name, size, cycles)
    if study.mission.requirements.pslr is not None:
        yield "mission.pslr", partial(verify_pslr, study)
    if study.mission.requirements.islr is not None:
        rows = RandomRows(Judging(1, study.mission.allocation.warn_above), study.analysis)
        with np.errstate(all="ignore"):
            found = [row.judged.subject for row in rows.islr_rows(study.models[-1].name) if row.is_there[0]]
        for of_owner in found:
            yield of_owner.id, partial(verify_islr, study, of_owner)


def _cases(study: Study) -> Iterator[tuple[str, Case]]:
    mission, allocation = study.mission, study.allocation
    for source in study.sources:
        if not source.is_motion:
            yield source.id, partial(phase_cases.other, study, source)
        elif study.allowed(source)[0] is not None:
            yield source.id, partial(phase_cases.quadratic, study, source)
    slow: dict[Subject, Case] = {}
    for name in PLATFORMS:
        for index, line in enumerate(lines_of(mission, name)):
            if line.frequency * study.collection.aperture_time < SLOWEST:
                one = subject(name, "vibration", "sinusoidal", entry=index)
                slow[one] = partial(phase_cases.slow_vibration, study, one.id, name, line)
    swaying = slow | dict(_of_tones_by_islr(study)) | dict(vibration.cases(mission, allocation, study.collection))
    for owner in (*PLATFORMS, "mission"):
        for one in sorted((one for one in swaying if one.owner == owner), key=_order):
            yield one.id, swaying[one]
    yield from _of_instruments(study)
    requirements = mission.requirements
    if mission.allocation.combine == "each":
        if _warns_of_the_total(study):
            row_id = subject("mission", QUADRATIC).id
            yield row_id, partial(phase_cases.total, study, row_id, "mission")
    else:
        owners = ["transmitter", "receiver", "mission"]
        if allocation.qpe.clock is not None:
            owners.insert(2, "clock")
        for owner in owners:
            row_id = subject(owner, QUADRATIC).id
            yield row_id, partial(phase_cases.total, study, row_id, owner)
    if requirements.cubic_phase_error is not None:
        yield "mission.cubic_phase_error", partial(phase_cases.cubic, study, requirements.cubic_phase_error)
    if requirements.location_error is not None:
        yield "mission.location_error", partial(location, study, requirements.location_error)
    if allocation.n_pull is not None:
        yield "mission.autofocus_pull_in", partial(phase_cases.pull_in, study, allocation.n_pull)
    if mission.scene.radius is not None and study.model != "published":
        yield "mission.spatial_variance", partial(phase_cases.edge, study)
