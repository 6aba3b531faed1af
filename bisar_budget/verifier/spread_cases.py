"""Verdicts on the limits of what echoes and spreads: vibration, sensors and clocks.

A sigma speaks of many flights. Whole time series go through exact ranges for it, and images of some of them say
whether a response shows the phase that exact ranges find. What spreads is measured in images of as many draws as it
takes to say whether a limit is true: lines across range, each the transform of the aperture under its window. Their
mainlobe is what lies within the first nulls of the error-free response, their sidelobes are all the rest of one
repeat interval, so that by Parseval only the mainlobe has to be transformed. Energies are means over the draws.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from bisar_budget.analysis.spread import declared_powers, islr_db, islr_of, mainlobe_energy, spread_limit, tones
from bisar_budget.analysis.vibration_limits import echo_phase, highest_echo, tone_limits, vibration_limits
from bisar_budget.budget.random_rows import HELD, ISLR, held_effect, limits_for, sizes_at
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.air_delays import CONTENT, correlation_time_of, seen_course
from bisar_budget.effects.declared import CUBIC, LOCATION
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.navigation_errors import CORRELATED, process_of
from bisar_budget.effects.oscillator_acceleration import accelerated_tones
from bisar_budget.effects.oscillator_tones import spurs_of
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.effects.vibration import SLOWEST, Line, lines_of, near_lines, sight_of, unit_of_line, worst_phases
from bisar_budget.findings.images import Verdict
from bisar_budget.image_plane import nodes
from bisar_budget.mission.model import Simulation
from bisar_budget.phrases import Note
from bisar_budget.ranges.exact_ranges import FINE, Found, aperture_nodes
from bisar_budget.simulator.collection import CELLS, PointCollection
from bisar_budget.simulator.impulse_response import upsampled
from bisar_budget.simulator.phase_history import (
    SMOOTH_ORDER,
    Course,
    Errors,
    Floats,
    PathError,
    PathSinusoid,
    cell_centres,
    direct_path_error,
)
from bisar_budget.simulator.realisations import (
    MOVING,
    clock_seconds,
    delay_courses,
    electrons_at_1_hz,
    fast_steps,
    fastest_shake,
    group_delays,
    phase_courses,
    position_courses,
    slowest_shake,
    zenith_delays,
)
from bisar_budget.verifier import reasons
from bisar_budget.verifier.phase_cases import TOLERANCE, compare
from bisar_budget.verifier.study import Study

TOLERANCE_DB = 0.5
UNDECLARED_CYCLES = 10  # of a vibration per aperture, where the file gives no frequency

_FINE_CUT = 8  # interpolation of a cut before its peak is read
_SEEN_WALK = 0.3  # range cells, from which a smear is said
_COMMON_RUNS = 32

_DRAWS, _CLOCK_DRAWS = 4000, 1000  # know a sigma to 1.1 %, and to 2.2 %
_SYNCHRONIZED_DRAWS = 400  # whose fast tones are drawn too, because they are folded
_TURNS = 100  # of a tone per aperture, beyond which it has no quadratic phase to speak of
_OCTAVES = 16  # times the lowest frequency of a vibration, beyond which it adds less than 3 % to a phase
_PER_TURN, _MOST_MOMENTS = 8, 1 << 17  # steps of a turn of a fast tone, and in all
_SURE_SIGMA = 3.0  # standard errors of a sigma
_IMAGES = 6
_FINE = 513  # moments of a time series in an image
_AT_ONCE = 250  # draws in memory
_ORDER = 3  # up to which a phase moves and defocuses; the rest spreads

_MOMENTS = 1024  # of an aperture whose spread power is measured; the mask holds two of so many cells of white noise
_FIRST, _MOST = 64, 8192  # draws
_AT_MOST = 256  # of them in memory
_NORMAL_95 = 1.96  # standard errors on either side of a mean
_SURE = 3.3  # of them within one verdict, 99.9 %: another seed must not draw another verdict
_KNOWN_DB = 0.25  # half of an interval at most: one that is drawn too early may lie anywhere
_FOLLOWED = (*MOVING, "propagation")  # kinds whose histories go through exact ranges as they are
_NODES = 32  # of the mainlobe's integral
_STEPS = 64  # in a cell, by which the first null is sought: the response is 0 there, and so is what a step holds
_TINY = 1e-300

Case = Callable[[], Verdict]


# ---------------------------------------------------------------------- vibration
def vibration_cases(study: Study) -> Iterator[tuple[Subject, Case]]:
    """Give the subject of each vibration limit, one platform alone and both together, and the call that verifies it.

    What comes out for the published limits at equal shares: a sinusoid of one platform makes echoes 9 dB inside the
    requirement, both in phase 3 dB inside; noise-like vibration of both, independent, exceeds the requirement by
    0.44 dB with a uniform window. By the full model's limits both in phase fill it, and so does noise.
    """
    mission, T = study.mission, study.collection.aperture_time
    pslr, islr = mission.requirements.pslr, mission.requirements.islr
    tone, rms = (
        {name: limit.by(study.model) for name, limit in limits.items()}
        for limits in (tone_limits(mission, study.allocation)[1], vibration_limits(mission, study.allocation, "islr"))
    )
    lines = {name: lines_of(mission, name) for name in PLATFORMS}

    def blank(
        of: Subject, limits: Mapping[str, float], requirement_db: float | None, per_metre: float = 1.0
    ) -> Verdict:
        # Both together: the larger of two limits stands for the row.
        unit = unit_of_line(mission, of.owner, of.entry or 0) if of.axis == "sinusoidal" and len(limits) == 1 else "m"
        return study.blank(of.id, max(limits.values()) * per_metre, unit, requirement_db=requirement_db)

    for name in PLATFORMS:
        for index, (_, frequency, per_metre) in enumerate(lines[name] or [Line(0.0, None)]):
            cycles = UNDECLARED_CYCLES if frequency is None else frequency * T
            if cycles < SLOWEST or not tone:
                continue  # a phase, which `phase_cases` looks at; or nothing holds it
            one, alone = subject(name, "vibration", "sinusoidal", entry=index), {name: tone[name]}
            unseen = blank(one, alone, pslr, per_metre)
            if pslr is not None:
                yield one, partial(_sinusoidal, study, unseen, alone, frequency)
            else:
                yield one, partial(_spread_tone, study, unseen, name, tone[name], cycles)
        if pslr is not None:
            for index, members in enumerate(near_lines([line.frequency * T for line in lines[name]])):
                one = subject(name, "vibration", "sinusoidal.sum", entry=index)
                near = [lines[name][member] for member in members]
                yield one, partial(_near, study, blank(one, {name: tone[name]}, pslr), name, tone[name], near)
        if islr is not None:
            one, alone = subject(name, "vibration", "wideband"), {name: rms[name]}
            yield one, partial(_wideband, study, blank(one, alone, islr), alone)
    if pslr is not None:
        frequency = next((line.frequency for name in PLATFORMS for line in lines[name]), None)
        both = subject("mission", "vibration", "sinusoidal")
        yield both, partial(_sinusoidal, study, blank(both, tone, pslr), tone, frequency)
    if islr is not None:
        both = subject("mission", "vibration", "wideband")
        yield both, partial(_wideband, study, blank(both, rms, islr), rms)


def _sinusoidal(study: Study, blank: Verdict, limits: Mapping[str, float], declared: float | None) -> Verdict:
    """Measure the paired echo on the difference from the error-free image, which its sidelobes would bury."""
    frequency = UNDECLARED_CYCLES / study.collection.aperture_time if declared is None else declared
    sinusoids = {name: (PathSinusoid(amplitude=size, frequency=frequency),) for name, size in limits.items()}
    who = "one platform alone" if len(limits) == 1 else "both platforms in phase"
    return echo(study, blank, sinusoids, who, is_assumed=declared is None)


def _near(study: Study, blank: Verdict, name: str, limit: float, lines: Sequence[Line]) -> Verdict:
    """Lines near each other, in their declared ratio and their worst phases, scaled to their limit together."""
    cycles = [line.frequency * study.collection.aperture_time for line in lines]
    worst = worst_phases([line.amplitude for line in lines], cycles)
    if not worst.amplitude:
        return blank._replace(reason=reasons.lines_without_amplitude())
    scale = limit / worst.amplitude
    sinusoids = tuple(
        PathSinusoid(scale * line.amplitude, line.frequency, 0.0 if np.sinc(worst.cycles - n) >= 0 else math.pi)
        for line, n in zip(lines, cycles, strict=True)
    )
    return echo(study, blank, {name: sinusoids}, "one platform's lines in their worst phases")


def echo(
    study: Study,
    blank: Verdict,
    sinusoids: Mapping[str, tuple[PathSinusoid, ...]],
    who: str,
    *,
    is_assumed: bool = False,
) -> Verdict:
    """Measure the paired echoes of sinusoids against the requirement of a verdict that is yet blank."""
    collection = study.collection
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
    peaks = [float(np.abs(upsampled(cut, _FINE_CUT)).max()) for cut in (echo, clean)]
    level = 20 * math.log10(peaks[0] / peaks[1])
    return blank._replace(
        measured_db=level,
        verdict=compare(level - (blank.requirement_db or 0.0), TOLERANCE_DB),
        reason=reasons.echoes_measured(who, cycles, walk if walk > _SEEN_WALK else None, is_assumed),
    )


def _wideband(study: Study, blank: Verdict, limits: Mapping[str, float]) -> Verdict:
    """Measure the ISLR that white vibration adds, over all of the repeat interval, on as many draws as it takes."""
    collection, seed = study.collection, (study.mission.simulation or Simulation()).seed
    slow_time = cell_centres(collection.aperture_time, _MOMENTS)
    clean = collection.flight(Errors(), slow_time).paths
    errors = Errors()
    for name, rms in limits.items():
        errors = errors.of(name, PathError(wideband_rms=rms))

    def phases(rng: np.random.Generator, draws: int, *, is_common: bool) -> Floats:
        found = np.empty((draws, slow_time.size))
        for one in found:
            flown = collection.flight(errors, slow_time, rng).paths
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
        mainlobe = Mainlobe(collection.window(_MOMENTS))
        common = phases(np.random.default_rng([seed, 1]), _COMMON_RUNS, is_common=True)
        rest_on = reasons.power_of_both_platforms(mainlobe.added_db(float(mainlobe.lost(common).mean())))
    draw = partial(phases, np.random.default_rng(seed), is_common=False)
    return measured_power(collection, blank, draw, rest_on)


def measured_power(
    collection: PointCollection, blank: Verdict, draw: Callable[[int], Floats], rest_on: Note
) -> Verdict:
    """Verdict on the ISLR that phases add, (draws, _MOMENTS), against the requirement of one that is yet blank."""
    required = blank.requirement_db or 0.0
    found = added_islr(collection.window(_MOMENTS), draw, required)
    verdict, interval = found.verdict(required), (found.low, found.high)
    drawn = reasons.draws_decide if verdict != "not_evaluated" else reasons.draws_do_not_decide
    return blank._replace(
        measured_db=found.level,
        measured_db_error=found.error,
        measured_db_interval=interval,
        verdict=verdict,
        reason=rest_on.then(drawn(found.draws, *interval)),
    )


# ---------------------------------------------------------------------- sensors and clocks
def limits_of(study: Study, error: RandomError) -> dict[str, float]:
    """Size at which each requirement that an error touches is reached, autofocus left out; empty: none limits it."""
    model = _model(study, error)
    effect = held_effect(study.mission, error.effect(model), error.coverage(study.mission))
    sizes = map(float, sizes_at(effect, limits_for(study.mission, study.allocation, error.owner, model)))
    return {name: size for name, size in zip(HELD, sizes, strict=True) if math.isfinite(size)}


def _model(study: Study, error: RandomError) -> str:
    """The gating model by which an error does more."""
    return max((one.name for one in study.models), key=lambda name: max(error.effect(name)[:2]))


def tone_cases(study: Study) -> Iterator[tuple[Subject, Case]]:
    """Give the subject of each oscillator's tone that has a limit, and the call that verifies it.

    In an image it is the motion of its platform that makes the same phase.
    """
    mission, wavelength = study.mission, study.collection.wavelength
    metric, limits = tone_limits(mission, study.allocation)
    needed = mission.requirements.pslr if metric == "pslr" else None
    sizes = {name: limit.by(study.model) for name, limit in limits.items()}

    def case(of: Subject, stated: float, unit: str, frequency: float) -> tuple[Subject, Case]:
        blank, size = study.blank(of.id, stated, unit, requirement_db=needed), sizes[of.owner]
        if metric == "islr":
            return of, partial(_spread_tone, study, blank, of.owner, size, frequency * study.collection.aperture_time)
        return of, partial(echo, study, blank, {of.owner: (PathSinusoid(size, frequency),)}, "the tone alone")

    for spur in spurs_of(mission):
        if spur.name in sizes:
            yield case(spur.subject, 20 * math.log10(math.pi * sizes[spur.name] / wavelength), "dB", spur.frequency)
    for tone in accelerated_tones(mission):
        is_fast = tone.frequency * study.collection.aperture_time >= SLOWEST
        if tone.name in sizes and is_fast and tone.per_unit:
            sensitivity = 2 * math.pi / wavelength * sizes[tone.name] / tone.per_unit
            yield case(tone.subject, sensitivity, "s^2/m", tone.frequency)


def _spread_tone(study: Study, blank: Verdict, owner: str, amplitude: float, cycles: float) -> Verdict:
    """A tone where ISLR holds it, at its limit: a motion [m] of so many cycles per aperture."""
    phase = 2 * math.pi * amplitude / study.collection.wavelength
    return _power(study, blank, [], owner, echoes=[(phase / math.sqrt(2), cycles)])


def verify_pslr(study: Study) -> Verdict:
    """The tones that make the highest echo, in their worst phases, scaled together to what is required."""
    required = study.mission.requirements.pslr or 0.0
    row_id = subject("mission", "pslr").id
    blank = study.blank(row_id, required, "dB", requirement_db=required)
    found = tones(study.mission)
    highest = highest_echo(found)
    if highest is None or not highest.phase:
        return blank._replace(reason=reasons.no_tone_declared())
    scale = echo_phase(10 ** (required / 20)) / highest.phase * study.collection.wavelength / (2 * math.pi)
    sinusoids: dict[str, tuple[PathSinusoid, ...]] = {}
    for one in [one for one, is_in in zip(found, highest.is_of, strict=True) if is_in]:
        turned = 0.0 if np.sinc(highest.cycles - one.cycles) >= 0 else math.pi
        turned += 0.0 if one.in_quadrature is None else math.pi / 2
        tone = PathSinusoid(scale * one.phase, one.cycles / study.collection.aperture_time, turned)
        sinusoids[one.subject.owner] = (*sinusoids.get(one.subject.owner, ()), tone)
    return echo(study, blank, sinusoids, "the tones together in their worst phases")


def verify_random(study: Study, error: RandomError) -> Verdict:
    """Limit of one figure: the smallest of what its requirements allow, autofocus left out."""
    sizes = limits_of(study, error)
    binding = min(sizes, key=lambda name: sizes[name])
    size = sizes[binding]
    at_limit = error._replace(declared=size)
    blank = study.blank(error.id, 20 * math.log10(size) if error.unit == "dB" else size, error.unit)
    if binding == ISLR:
        is_taken = study.mission.requirements.cubic_phase_error is not None
        return _power(study, blank, [at_limit], error.owner, order=_ORDER if is_taken else _ORDER - 1)
    if binding == LOCATION:
        return _place(study, blank, at_limit, _stream(study, error.id))
    return _phase(study, blank, at_limit, binding, _stream(study, error.id))


def _phase(study: Study, blank: Verdict, error: RandomError, binding: str, rng: np.random.Generator) -> Verdict:
    """Sigma of quadratic or cubic phase at the limit, coverage factor included, against the budget."""
    is_cubic = binding == CUBIC
    required = study.mission.requirements.cubic_phase_error
    budget = (required or 0.0) if is_cubic else study.allocation.qpe_limit(error.owner)
    factor = study.mission.allocation.coverage_factor
    sigma, draws = _sigma(study, error, rng, is_cubic)
    predicted = factor * sigma
    drawn, seen = [], []
    try:
        for errors in _series(study, error, rng):
            images = study.images(errors)
            effect, reading = images.effect, study.read(images)
            drawn.append(effect.cubic if is_cubic else effect.quadratic)
            seen.append(reading.cubic if is_cubic else reading.quadratic)
    except ValueError as fault:
        return blank._replace(budget_rad=budget, reason=reasons.no_image_of_a_time_series(str(fault)))
    # How much of a phase images show: readings over exact ranges, the large ones counting more.
    shown = float(np.dot(drawn, seen) / np.dot(drawn, drawn))
    measured = predicted * shown
    tolerance = TOLERANCE + _SURE_SIGMA / math.sqrt(2 * draws)
    verdict = blank._replace(
        budget_rad=budget,
        verdict=compare(measured / budget - 1, tolerance),
        reason=reasons.sigma_of_time_series(draws, factor, _IMAGES, "cubic phase" if is_cubic else ""),
    )
    if is_cubic:
        return verdict._replace(measured_cubic_rad=measured, predicted_cubic_rad=predicted)
    return verdict._replace(measured_qpe_rad=measured, predicted_qpe_rad=predicted)


def _place(study: Study, blank: Verdict, error: RandomError, rng: np.random.Generator) -> Verdict:
    """Sigma of the displacement at the limit, coverage factor included, against the requirement."""
    required = study.mission.requirements.location_error or 0.0
    factor, draws = study.mission.allocation.coverage_factor, _DRAWS
    if error.subject.kind in _FOLLOWED:
        found = _drawn_effects(study, error, rng)
    else:
        fit, draws = _fits(study, error, rng)
        if error.subject.kind == "synchronization":  # a constant phase moves nothing
            fit[0] = 0.0
        half = study.collection.aperture_time / 2
        phases = np.polynomial.legendre.legval(aperture_nodes(study.collection.aperture_time) / half, fit)
        metres = np.asarray(phases * study.collection.wavelength / (2 * math.pi), float)
        found = study.exact_effects({"clock": metres})
    east, north = (factor * math.sqrt(np.nanmean(np.square(one))) for one in (found.east, found.north))
    drawn, seen = list[float](), list[float]()
    try:
        for errors in _series(study, error, rng):
            images = study.images(errors)
            shift = study.shift(images, study.read(images))
            drawn += images.effect.displacement
            seen += images.effect.moved(shift.displacement)
    except ValueError as fault:
        return blank._replace(reason=reasons.no_image_of_a_time_series(str(fault)))
    shown = float(np.dot(drawn, seen) / np.dot(drawn, drawn))
    tolerance = TOLERANCE + _SURE_SIGMA / math.sqrt(2 * draws)
    return blank._replace(
        displacement_m=(east, north),
        measured_displacement_m=(east * shown, north * shown),
        verdict=compare(math.hypot(east, north) * shown / required - 1, tolerance),
        reason=reasons.sigma_of_time_series(draws, factor, _IMAGES, "displacement"),
    )


def _stream(study: Study, row_id: str) -> np.random.Generator:
    """Draws of a row, its own whatever else is verified."""
    return np.random.default_rng([(study.mission.simulation or Simulation()).seed, *row_id.encode()])


def _sigma(study: Study, error: RandomError, rng: np.random.Generator, is_cubic: bool) -> tuple[float, int]:
    """Standard deviation of a phase over many time series, and their number. [rad]"""
    if error.subject.kind in _FOLLOWED:
        found = _drawn_effects(study, error, rng)
        return float(np.nanstd(found.cubic if is_cubic else found.quadratic)), _DRAWS
    fit, draws = _fits(study, error, rng)
    return float(np.std(2.5 * fit[3] if is_cubic else 1.5 * fit[2])), draws


def _drawn_effects(study: Study, error: RandomError, rng: np.random.Generator) -> Found:
    """Effects of many histories of a sensor or the air, by exact ranges, (draws,)."""
    moments = aperture_nodes(study.collection.aperture_time)
    if error.subject.kind in CORRELATED:  # not smooth between the nodes, as what is integrated is
        return study.exact_effects(_smooth_noise(study, error, rng))
    if error.subject.kind != "propagation":
        return study.exact_effects(position_courses(study.mission, error, moments, _DRAWS, rng))
    group = group_delays(study.mission, error, moments, _delays_at_nodes(study, error, rng))
    mean = (group @ nodes(FINE).fit[0])[:, None]
    return study.exact_effects({"clock": seen_course(group, mean, error.subject.axis)})


def _left_at_the_point(study: Study, error: RandomError, times: Floats, group: Floats) -> Floats:
    """Range error that group delays (draws, times) leave where they move a point to. [m]"""
    half, geometry = study.collection.aperture_time / 2, study.geometry
    mean = group.mean(axis=1, keepdims=True)
    seen = seen_course(group, mean, error.subject.axis)
    at_nodes = seen @ _smooth_at_nodes(2 * half, times).T
    found = study.exact_effects({"clock": at_nodes})
    for path in geometry.both:
        position = np.stack(np.broadcast_arrays(*path.place(times)))
        sight = position / np.linalg.norm(position, axis=0)
        seen = seen + np.multiply.outer(found.east, sight[0]) + np.multiply.outer(found.north, sight[1])
    return np.asarray(seen)


def _fits(study: Study, error: RandomError, rng: np.random.Generator) -> tuple[Floats, int]:
    """Legendre coefficients of time series of a clock's phase, (4, draws) [rad], and the number of draws."""
    mission, T = study.mission, study.collection.aperture_time
    draws, highest, count = _CLOCK_DRAWS, _TURNS / T, 257
    if mission.synchronization is not None and mission.synchronization.interval is not None:
        draws = _SYNCHRONIZED_DRAWS
    if fastest_shake(mission, error):  # which may begin far beyond what else has a quadratic phase
        draws, highest = _SYNCHRONIZED_DRAWS, max(highest, _OCTAVES * slowest_shake(mission, error))
        highest = min(highest, fastest_shake(mission, error))
        count = 1 + fast_steps(min(_MOST_MOMENTS, max(count - 1, math.ceil(_PER_TURN * highest * T))))
    times, found = _moments(study, count), list[Floats]()
    together = max(1, _AT_ONCE * _FINE // count)
    for first in range(0, draws, together):
        some = min(together, draws - first)
        phases = phase_courses(mission, error, times, some, rng, highest)
        found.append(np.asarray(np.polynomial.legendre.legfit(2 * times / T, phases.T, _ORDER), float))
    return np.concatenate(found, axis=1), draws


def _delays_at_nodes(study: Study, error: RandomError, rng: np.random.Generator) -> Floats:
    """Delays at the zenith at the nodes of exact ranges in sigmas of what is declared, (draws, nodes)."""
    T, correlation_time = study.collection.aperture_time, correlation_time_of(study.mission, error.owner)
    if correlation_time is None:
        return zenith_delays(study.mission, error, aperture_nodes(T), _DRAWS, rng)
    times = _moments(study, _FINE)
    smooth = _smooth_at_nodes(T, times).T * math.sqrt(_power_of_samples(times, correlation_time))
    drawn = [zenith_delays(study.mission, error, times, _AT_ONCE, rng) @ smooth for _ in range(_DRAWS // _AT_ONCE)]
    return np.concatenate(drawn)


def _smooth_noise(study: Study, error: RandomError, rng: np.random.Generator) -> dict[str, Floats]:
    """Correlated noise at the nodes of exact ranges, (draws, nodes, 3) each, without what they cannot tell. [m]"""
    T, time = study.collection.aperture_time, process_of(study.mission, error).correlation_time
    times = _moments(study, _FINE)
    at_nodes = _smooth_at_nodes(T, times)
    drawn = [
        {name: at_nodes @ one for name, one in position_courses(study.mission, error, times, _AT_ONCE, rng).items()}
        for _ in range(_DRAWS // _AT_ONCE)
    ]
    scale = math.sqrt(_power_of_samples(times, time))
    return {name: np.concatenate([one[name] for one in drawn]) * scale for name in drawn[0]}


def _smooth_at_nodes(aperture_time: float, times: Floats) -> Floats:
    """Takes courses at times to the nodes of exact ranges, (nodes, times), by what is smooth of them.

    At the nodes alone noise of a short correlation time would pass for a larger phase.
    """
    legendre = np.polynomial.legendre
    fit = np.linalg.pinv(legendre.legvander(2 * times / aperture_time, SMOOTH_ORDER))
    return np.asarray(legendre.legvander(2 * aperture_nodes(aperture_time) / aperture_time, SMOOTH_ORDER) @ fit)


def _power_of_samples(times: Floats, correlation_time: float) -> float:
    """Power of correlated noise at low frequencies over that of its samples.

    Samples a step Δ apart have more than the noise: Δ·coth(Δ/2τ_c), not 2τ_c.
    """
    step = float(times[1] - times[0])
    return 2 * correlation_time / step * math.tanh(step / (2 * correlation_time))


def _moments(study: Study, count: int) -> Floats:
    half = study.collection.aperture_time / 2
    moments: Floats = np.linspace(-half, half, count)
    return moments


def _series(study: Study, error: RandomError, rng: np.random.Generator) -> list[Errors]:
    """A few time series as errors of an image, up to the cubic phase: what is left spreads, and would hide it."""
    times = _moments(study, _FINE)
    if error.subject.kind in MOVING:
        found = [Errors()] * _IMAGES
        for name, courses in position_courses(study.mission, error, times, _IMAGES, rng).items():
            smooth = (PathError(course=Course(times, one).smooth(_ORDER)) for one in courses)
            found = [one.of(name, error_of_path) for one, error_of_path in zip(found, smooth, strict=True)]
        return found
    if error.subject.kind == "propagation":
        at_zenith = zenith_delays(study.mission, error, times, _IMAGES, rng)
        if correlation_time_of(study.mission, error.owner) is not None:
            at_zenith = Course(times, at_zenith.T).smooth(_ORDER).values.T
        groups = group_delays(study.mission, error, times, at_zenith)
        if error.subject.axis == CONTENT:
            return [Errors(electrons=electrons_at_1_hz(study.mission, times, one)) for one in groups]
        return [Errors(clock_course=Course(times, one / SPEED_OF_LIGHT)) for one in groups]
    phases = phase_courses(study.mission, error, times, _IMAGES, rng)
    delays = [clock_seconds(one, study.collection.wavelength) for one in phases]
    return [Errors(clock_course=Course(times, one).smooth(_ORDER)) for one in delays]


# ---------------------------------------------------------------------- what spreads
def verify_islr(study: Study, of: Subject) -> Verdict:
    """Everything that spreads, scaled together to the limit of a row's owner."""
    mission, model = study.mission, study.models[-1].name
    limit = spread_limit(mission, study.allocation, of.owner, model) or 0.0
    level = islr_db(limit**2, model, mainlobe_energy(mission))
    blank = study.blank(of.id, level, "dB")
    powers = declared_powers(study.analysis, of.owner, model)
    total = math.fsum(one.variance for one in powers)
    if not total:
        return blank._replace(reason=reasons.no_spread_declared())
    scale = limit / math.sqrt(total)
    # A direct path cancels some.
    rms = {one.row_id: scale * math.sqrt(one.variance) for one in powers if one.variance}
    members = [
        error._replace(declared=scale * (error.declared or 0.0)) for error in study.analysis.random if error.id in rms
    ]
    cubic = rms.pop(subject("mission", CUBIC).id, 0.0)
    cycles = {one.subject.id: one.cycles for one in tones(mission)}
    echoes = [(rms[row_id], turns) for row_id, turns in cycles.items() if row_id in rms]
    known = {error.id for error in members} | cycles.keys()
    white = math.sqrt(math.fsum(size**2 for row_id, size in rms.items() if row_id not in known))
    return _power(study, blank, members, of.owner, white, echoes, cubic)


def _power(
    study: Study,
    blank: Verdict,
    members: Sequence[RandomError],
    owner: str,
    white: float = 0.0,
    echoes: Sequence[tuple[float, float]] = (),
    cubic: float = 0.0,
    order: int = _ORDER,
) -> Verdict:
    """ISLR that time series at a limit add to an image, against what an owner may add to it.

    Beside the errors of sensors and clocks there may be white noise, tones, each with its cycles per aperture, and a
    cubic phase; of each the rms over the aperture [rad]. Phases up to an order are taken out of the time series.
    """
    mission, collection = study.mission, study.collection
    rng = _stream(study, blank.id)
    # Each moment stands for a step: what is faster is noise from step to step.
    times = cell_centres(collection.aperture_time, _MOMENTS)
    place = 2 * times / collection.aperture_time
    legendre = np.polynomial.legendre.legvander(place, _ORDER)
    fitted = legendre[:, : order + 1] @ np.linalg.pinv(legendre[:, : order + 1])

    def left(draws: int) -> Floats:
        """Phases without what moves and defocuses the response."""
        phases = white * rng.standard_normal((draws, times.size))
        for error in members:
            if error.subject.kind in MOVING:
                for name, moved in position_courses(mission, error, times, draws, rng).items():
                    phases += 2 * math.pi / collection.wavelength * moved @ np.array(sight_of(mission, name))
            elif error.subject.kind == "propagation":
                group = delay_courses(mission, error, times, draws, rng)
                phases += 2 * math.pi / collection.wavelength * _left_at_the_point(study, error, times, group)
            else:
                phases += phase_courses(mission, error, times, draws, rng)
        phases = phases - phases @ fitted
        for rms, cycles in echoes:
            turned = 2 * math.pi * rng.random((draws, 1))
            phases += math.sqrt(2) * rms * np.cos(math.pi * cycles * place + turned)
        if cubic:  # of P₃, whose mean square over the aperture is a seventh
            phases += math.sqrt(7) * cubic * rng.standard_normal((draws, 1)) * legendre[:, 3]
        return phases

    allowed = spread_limit(mission, study.allocation, owner, "full") or 0.0  # what an image may show
    required = float(islr_of(mission, allowed**2)) if allowed else 0.0
    return measured_power(collection, blank._replace(requirement_db=required), left, reasons.power_of_time_series())


# ---------------------------------------------------------------------- ISLR that noise adds
@dataclass(frozen=True, slots=True)
class AddedIslr:
    """ISLR that noise adds, the ends of its interval at 95 %, and of how many draws it is the mean. [dB]"""

    level: float
    low: float
    high: float
    draws: int

    @property
    def error(self) -> float:
        """Standard error. [dB]"""
        return (self.high - self.low) / (2 * _NORMAL_95)

    def verdict(self, required_db: float) -> str:
        """Verdict on a limit that was to add an ISLR; `not_evaluated` where the mean may have another one.

        After all draws, on the border of what is confirmed and what is conservative, it is `conservative`: no limit
        there adds too much.
        """
        excess, doubt = self.level - required_db, _SURE * self.error
        low, high = excess - doubt, excess + doubt
        if low > TOLERANCE_DB:
            return "optimistic"
        if high < -TOLERANCE_DB:
            return "conservative"
        if low >= -TOLERANCE_DB and high <= TOLERANCE_DB:
            return "confirmed"
        return "conservative" if self.draws >= _MOST and high < 0 else "not_evaluated"


class Mainlobe:
    """The part of an error-free response that lies within its first nulls.

    Parameters
    ----------
    weights : (moments,) ndarray
        Window over the aperture, at the centres of equal cells.
    """

    def __init__(self, weights: Floats) -> None:
        place = cell_centres(1.0, weights.size)
        response = np.abs(np.fft.rfft(weights, weights.size * _STEPS))
        null = int(np.argmax(np.diff(response) > 0)) / _STEPS
        nodes, self._steps = np.polynomial.legendre.leggauss(_NODES)
        waves = np.exp(-2j * math.pi * np.outer(place, null * nodes))
        self._waves = waves * weights[:, None] / weights.size
        self._clean = self._waves.sum(axis=0).real
        self._steps = self._steps * null / np.mean(weights**2)
        self.energy = float(self._clean**2 @ self._steps)

    def lost(self, phases: Floats) -> Floats:
        """Energy that phases (draws, moments) take out of it, over all energy of an image, (draws,)."""
        # exp(jφ) - 1 without rounding: a limit of -100 dB is an energy of 1e-10.
        change = (-2 * np.sin(phases / 2) ** 2 + 1j * np.sin(phases)) @ self._waves
        found: Floats = -(2 * self._clean * change.real + np.abs(change) ** 2) @ self._steps
        return found

    def added_db(self, lost: float) -> float:
        """ISLR that goes with a mean energy lost. [dB]"""
        left = max(self.energy - lost, _TINY)
        return 10 * math.log10(max(lost, _TINY) / (self.energy * left))


def added_islr(weights: Floats, draw: Callable[[int], Floats], required_db: float) -> AddedIslr:
    """Draw phases until their interval has one verdict against what is required, or there are too many.

    Parameters
    ----------
    weights : (moments,) ndarray
        Window over the aperture.
    draw : callable
        Gives so many phases, (draws, moments). [rad]
    required_db : float
        ISLR that may be added.
    """
    mainlobe = Mainlobe(weights)
    lost: Floats = np.empty(0)
    while True:
        count = min(_AT_MOST, max(_FIRST, lost.size))
        lost = np.concatenate((lost, mainlobe.lost(draw(count))))
        if lost.size < _FIRST or lost.size & (lost.size - 1):  # each look is at twice as many as the one before
            continue
        mean, error = float(lost.mean()), float(lost.std(ddof=1)) / math.sqrt(lost.size)
        level, low, high = (mainlobe.added_db(mean + sign * _NORMAL_95 * error) for sign in (0, -1, 1))
        found = AddedIslr(level, low, high, lost.size)
        is_known = found.high - found.low <= 2 * _KNOWN_DB
        if lost.size >= _MOST or (is_known and found.verdict(required_db) != "not_evaluated"):
            return found
