"""Verdicts on the vibration limits: one platform alone, and both together.

What comes out for the published limits at equal shares: a sinusoid of one platform makes echoes 9 dB inside the
requirement, both in phase 3 dB inside; noise-like vibration of both, independent, exceeds the requirement by 0.44 dB
with a uniform window. By the full model's limits both in phase fill it, and so does noise.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.vibration_limits import vibration_limits
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.vibration import SLOWEST, Line, lines_of, near_lines, worst_phases
from bisar_budget.findings.images import Verdict
from bisar_budget.mission.model import Mission
from bisar_budget.phrases import Note
from bisar_budget.simulate.collection import CELLS, Errors, PointCollection
from bisar_budget.simulate.impulse_response import upsampled
from bisar_budget.simulate.phase_history import Floats, PathError, PathSinusoid, cell_centres, direct_path_error
from bisar_budget.verify import reasons
from bisar_budget.verify.noise_image import TOLERANCE_DB, Mainlobe, added_islr

MOMENTS = 1024  # of an aperture whose spread power is measured; the mask holds two of so many cells of white noise
_FINE = 8  # interpolation of a cut before its peak is read
_SEEN_WALK = 0.3  # range cells, from which a smear is said
_COMMON_RUNS = 32
UNDECLARED_CYCLES = 10  # of a vibration per aperture, where the file gives no frequency

Case = Callable[[], Verdict]


def cases(mission: Mission, allocation: Allocation, collection: PointCollection) -> Iterator[tuple[Subject, Case]]:
    """Give the subject of each vibration limit and the call that verifies it.

    Parameters
    ----------
    mission : Mission
        Gives the requirements, and the frequencies that are looked at.
    allocation : Allocation
        Shares of power.
    collection : PointCollection
        Forms the images.
    """
    pslr, islr = mission.requirements.pslr, mission.requirements.islr
    model, T = mission.gating_model, collection.aperture_time
    amplitude, rms = (
        {name: limit.by(model) for name, limit in vibration_limits(mission, allocation, metric).items()}
        for metric in ("pslr", "islr")
    )
    seed = mission.simulation.seed if mission.simulation else 1
    lines = {name: lines_of(mission, name) for name in PLATFORMS}
    for name in PLATFORMS:
        if pslr is not None:
            echo = partial(_sinusoidal, collection, model, pslr, {name: amplitude[name]})
            for index, frequency in enumerate([line.frequency for line in lines[name]] or [None]):
                if frequency is not None and frequency * T < SLOWEST:
                    continue  # a phase, which `phase_cases` looks at
                one = subject(name, "vibration", "sinusoidal", entry=index)
                yield one, partial(echo, one.id, frequency)
            for index, members in enumerate(near_lines([line.frequency * T for line in lines[name]])):
                one = subject(name, "vibration", "sinusoidal.sum", entry=index)
                near = [lines[name][member] for member in members]
                yield one, partial(_near, collection, model, pslr, {name: amplitude[name]}, one.id, near)
        if islr is not None:
            one = subject(name, "vibration", "wideband")
            yield one, partial(_wideband, collection, model, islr, {name: rms[name]}, one.id, seed)
    if pslr is not None:
        frequency = next((line.frequency for name in PLATFORMS for line in lines[name]), None)
        both = subject("mission", "vibration", "sinusoidal")
        yield both, partial(_sinusoidal, collection, model, pslr, amplitude, both.id, frequency)
    if islr is not None:
        both = subject("mission", "vibration", "wideband")
        yield both, partial(_wideband, collection, model, islr, rms, both.id, seed)


def _blank(row_id: str, model: str, limits: dict[str, float], requirement_db: float) -> Verdict:
    # Both together: the larger of two limits stands for the row.
    return Verdict(
        id=row_id, model=model, boundary_error=max(limits.values()), unit="m", requirement_db=requirement_db
    )


def _sinusoidal(
    collection: PointCollection,
    model: str,
    requirement_db: float,
    limits: dict[str, float],
    row_id: str,
    declared: float | None,
) -> Verdict:
    """Measure the paired echo on the difference from the error-free image, which its sidelobes would bury."""
    frequency = UNDECLARED_CYCLES / collection.aperture_time if declared is None else declared
    sinusoids = {name: (PathSinusoid(amplitude=size, frequency=frequency),) for name, size in limits.items()}
    who = "one platform alone" if len(limits) == 1 else "both platforms in phase"
    blank = _blank(row_id, model, limits, requirement_db)
    return echo(collection, blank, sinusoids, who, is_assumed=declared is None)


def _near(
    collection: PointCollection,
    model: str,
    requirement_db: float,
    limits: dict[str, float],
    row_id: str,
    lines: Sequence[Line],
) -> Verdict:
    """Lines near each other, in their declared ratio and their worst phases, scaled to their limit together."""
    blank = _blank(row_id, model, limits, requirement_db)
    (name,) = limits
    cycles = [line.frequency * collection.aperture_time for line in lines]
    worst = worst_phases([line.amplitude for line in lines], cycles)
    if not worst.amplitude:
        return blank._replace(reason=reasons.lines_without_amplitude())
    scale = limits[name] / worst.amplitude
    sinusoids = tuple(
        PathSinusoid(scale * line.amplitude, line.frequency, 0.0 if np.sinc(worst.cycles - n) >= 0 else math.pi)
        for line, n in zip(lines, cycles, strict=True)
    )
    return echo(collection, blank, {name: sinusoids}, "one platform's lines in their worst phases")


def echo(
    collection: PointCollection,
    blank: Verdict,
    sinusoids: Mapping[str, tuple[PathSinusoid, ...]],
    who: str,
    *,
    is_assumed: bool = False,
) -> Verdict:
    """Measure the paired echoes of sinusoids against the requirement of a verdict that is yet blank."""
    every = [sinusoid.frequency * collection.aperture_time for those in sinusoids.values() for sinusoid in those]
    slowest, cycles = min(every), max(every)
    if slowest < 3:
        return blank._replace(reason=reasons.echoes_on_the_peak(slowest))
    cells = 2 * math.ceil(min(cycles, 1e6)) + CELLS
    errors = Errors()
    for name, those in sinusoids.items():
        errors = errors.of(name, PathError(sinusoids=those))
    try:
        clean = collection.chip((0.0, 0.0), Errors(), cells=cells).cut
        echo = collection.chip((0.0, 0.0), errors, cells=cells).cut - clean
    except ValueError as error:
        return blank._replace(reason=reasons.no_image_of_a_vibration(cycles, str(error)))
    # An echo keeps its range while a scatterer at its place would walk by one wavelength per cycle.
    walk = cycles * collection.radar.bandwidth / collection.radar.center_frequency
    peaks = [float(np.abs(upsampled(cut, _FINE)).max()) for cut in (echo, clean)]
    level = 20 * math.log10(peaks[0] / peaks[1])
    return blank._replace(
        measured_db=level,
        verdict=_compare(level - (blank.requirement_db or 0.0)),
        reason=reasons.echoes_measured(who, cycles, walk if walk > _SEEN_WALK else None, is_assumed),
    )


def _wideband(
    collection: PointCollection,
    model: str,
    requirement_db: float,
    limits: dict[str, float],
    row_id: str,
    seed: int,
) -> Verdict:
    """Measure the ISLR that white vibration adds, over all of the repeat interval, on as many draws as it takes."""
    weights, slow_time = collection.window(MOMENTS), cell_centres(collection.aperture_time, MOMENTS)
    clean = collection.paths(Errors(), slow_time)
    errors = Errors()
    for name, rms in limits.items():
        errors = errors.of(name, PathError(wideband_rms=rms))

    def phases(rng: np.random.Generator, draws: int, *, is_common: bool) -> Floats:
        found = np.empty((draws, slow_time.size))
        for one in found:
            flown = collection.paths(errors, slow_time, rng)
            shifts = [
                np.linalg.norm(now.measured, axis=1) - np.linalg.norm(before.measured, axis=1)
                for now, before in zip(flown, clean, strict=True)
            ]
            if collection.has_direct_path:  # of each platform alone
                shifts[0] -= SPEED_OF_LIGHT * direct_path_error((flown[0], clean[1]))
                shifts[1] -= SPEED_OF_LIGHT * direct_path_error((clean[0], flown[1]))
            if is_common:  # the second platform makes the first one's motion, at its own limit
                first, second = limits.values()
                shifts[1] = shifts[0] * second / first
            one[:] = 2 * math.pi / collection.wavelength * (shifts[0] + shifts[1])
        return found

    rest_on = reasons.power_of_one_platform()
    if len(limits) == 2:
        mainlobe = Mainlobe(weights)
        common = phases(np.random.default_rng([seed, 1]), _COMMON_RUNS, is_common=True)
        rest_on = reasons.power_of_both_platforms(mainlobe.added_db(float(mainlobe.lost(common).mean())))
    draw = partial(phases, np.random.default_rng(seed), is_common=False)
    return measured_power(collection, _blank(row_id, model, limits, requirement_db), draw, rest_on)


def measured_power(
    collection: PointCollection, blank: Verdict, draw: Callable[[int], Floats], rest_on: Note
) -> Verdict:
    """Verdict on the ISLR that phases add, (draws, MOMENTS), against the requirement of one that is yet blank."""
    required = blank.requirement_db or 0.0
    found = added_islr(collection.window(MOMENTS), draw, required)
    verdict, interval = found.verdict(required), (found.low, found.high)
    drawn = reasons.draws_decide if verdict != "not_evaluated" else reasons.draws_do_not_decide
    return blank._replace(
        measured_db=found.level,
        measured_db_error=found.error,
        measured_db_interval=interval,
        verdict=verdict,
        reason=rest_on.then(drawn(found.draws, *interval)),
    )


def _compare(excess_db: float) -> str:
    if abs(excess_db) <= TOLERANCE_DB:
        return "confirmed"
    return "optimistic" if excess_db > 0 else "conservative"
