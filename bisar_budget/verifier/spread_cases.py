"""Verdicts on the limits of vibration and of random errors of sensors, clocks and the atmosphere.

The standard deviation (sigma) of an effect describes many flights. It is measured from random time series of the
error, whose effects are computed from exact ranges. For a few of the series, images are used to check whether the
phase of a response agrees with exact ranges.

The power that errors spread over the image (ISLR) is measured in as many random images as the verdict needs. Each
image is a cut across range: the Fourier transform of the phasor over the aperture, weighted by its window. Because
the aperture is sampled, the image repeats. The mainlobe is between the first nulls of the error-free response, and
the sidelobes fill the remainder of one repeat interval. By Parseval's theorem, only the mainlobe has to be
transformed. Energies are means over the draws.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from bisar_budget import phrases
from bisar_budget.analysis.spread import declared_powers, islr_db, islr_of, mainlobe_energy, spread_limit, tones
from bisar_budget.analysis.vibration_limits import echo_phase, highest_echo, tone_limits, vibration_limits
from bisar_budget.budget.random_rows import ISLR, RANDOM_REQUIREMENTS, held_effect, limits_for, sizes_at
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.effects.air_delays import CONTENT, correlation_time_of, seen_course
from bisar_budget.effects.declared import CUBIC, LOCATION
from bisar_budget.effects.effect import PLATFORMS, Subject, subject
from bisar_budget.effects.navigation_errors import process_of
from bisar_budget.effects.oscillator_acceleration import accelerated_tones
from bisar_budget.effects.oscillator_tones import spurs_of
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.effects.vibration import (
    SLOWEST_ECHO_CYCLES,
    Line,
    lines_of,
    near_lines,
    sight_of,
    unit_of_line,
    worst_phases,
)
from bisar_budget.findings.images import Verdict
from bisar_budget.image_plane import nodes
from bisar_budget.mission.model import Simulation
from bisar_budget.phrases import Note
from bisar_budget.ranges.exact_ranges import FINE_NODE_COUNT, ImagePoints, aperture_nodes
from bisar_budget.simulator.collection import CUT_CELLS, PointCollection
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
from bisar_budget.verifier.phase_cases import TOLERANCE_FRACTION, compare
from bisar_budget.verifier.study import Study

TOLERANCE_DB = 0.5
UNDECLARED_CYCLES = 10  # cycles per aperture of a vibration whose frequency the file does not state

_ECHO_UPSAMPLING_FACTOR = 8  # interpolation factor of a cut, before its peak is measured
_MIN_WALK_CELLS = 0.3  # range cells of smear from which a reason mentions it
_COMMON_DRAWS = 32  # draws of a vibration that both platforms share

_SIGMA_DRAWS, _CLOCK_DRAWS = 4000, 1000  # draws for a sigma to 1.1 % and to 2.2 %
_SYNCHRONIZED_DRAWS = 400  # draws that include fast tones, because synchronization folds them
_MAX_TONE_CYCLES = 100  # cycles per aperture; faster tones have a negligible quadratic phase
_SHAKE_FREQUENCY_FACTOR = 16  # times the lowest frequency of a vibration; faster parts add < 3 % to a phase
_STEPS_PER_CYCLE, _MAX_TONE_STEPS = 8, 1 << 17  # time steps per cycle of a fast tone, and most steps in all
_MARGIN_SIGMA = 3.0  # standard errors of a sigma that the tolerance includes
_IMAGE_DRAWS = 6  # number of time series for which images are formed
_SERIES_SAMPLES = 513  # samples of a time series in an image
_DELAY_BLOCK_DRAWS = 250  # draws in memory at once
_CUBIC_ORDER = 3  # highest order that displaces or defocuses; higher orders spread

_ISLR_SAMPLES = (
    1024  # samples of an aperture whose spread power is measured; of as many cells of noise, two are mainlobe
)
_FIRST_ISLR_DRAWS, _MAX_ISLR_DRAWS = 64, 8192
_BLOCK_ISLR_DRAWS = 256  # draws in memory at once
_INTERVAL_95_SIGMA = 1.96  # standard errors on either side of a mean
_DECISION_SIGMA = 3.3  # standard errors within one verdict, 99.9 %: another seed must not give another verdict
_MAX_HALF_INTERVAL_DB = 0.25  # of a decided verdict: a wider interval, of few draws, may be off
_MAINLOBE_NODES = 32  # of the mainlobe's integral
_STEPS_PER_CELL = 64  # of the search for the first null, where the response and thus the energy of a step is 0
_MIN_ENERGY_FRACTION = 1e-300  # keeps logarithms finite

Case = Callable[[], Verdict]


# ---------------------------------------------------------------------- vibration
def vibration_cases(study: Study) -> Iterator[tuple[Subject, Case]]:
    """For each limit on vibration (echoes or noise), yield the subject of its row and a function to verify it.

    There are limits for each platform alone, and for both platforms together. Vibrations with less than one cycle per
    aperture are verified in `phase_cases`.

    With the published limits and equal shares of both platforms, the echoes of a sinusoidal vibration of one platform
    are 9 dB below the requirement. If both platforms vibrate in phase, the echoes are 3 dB below the requirement.
    Independent noise-like vibration of both platforms exceeds the requirement by 0.44 dB with a uniform window. With
    the limits of the full model, sinusoidal vibration of both platforms in phase meets the requirement exactly, and
    so does noise-like vibration of both platforms.
    """
    mission, T = study.mission, study.collection.aperture_time
    pslr, islr = mission.requirements.pslr, mission.requirements.islr
    tone, rms = (
        {name: limit.by(study.model) for name, limit in limits.items()}
        for limits in (tone_limits(mission, study.allocation)[1], vibration_limits(mission, study.allocation, "islr"))
    )
    lines = {name: lines_of(mission, name) for name in PLATFORMS}

    def blank(
        row_subject: Subject, limits: Mapping[str, float], requirement_db: float | None, per_metre: float = 1.0
    ) -> Verdict:
        # The row of both platforms together has the larger of two limits.
        unit = (
            unit_of_line(mission, row_subject.owner, row_subject.entry or 0)
            if row_subject.axis == "sinusoidal" and len(limits) == 1
            else "m"
        )
        return study.blank(row_subject.id, max(limits.values()) * per_metre, unit, requirement_db=requirement_db)

    for name in PLATFORMS:
        for index, (_, frequency, per_metre) in enumerate(lines[name] or [Line(0.0, None)]):
            cycles = UNDECLARED_CYCLES if frequency is None else frequency * T
            if cycles < SLOWEST_ECHO_CYCLES or not tone:
                continue  # verified as a phase in `phase_cases`, or limited by no requirement
            vibration, alone = subject(name, "vibration", "sinusoidal", entry=index), {name: tone[name]}
            unseen = blank(vibration, alone, pslr, float(per_metre))
            if pslr is not None:
                yield vibration, partial(_sinusoidal, study, unseen, alone, frequency)
            else:
                yield vibration, partial(_spread_tone, study, unseen, name, tone[name], cycles)
        if pslr is not None:
            for index, members in enumerate(near_lines([line.frequency * T for line in lines[name]])):
                vibration = subject(name, "vibration", "sinusoidal.sum", entry=index)
                near = [lines[name][member] for member in members]
                yield (
                    vibration,
                    partial(_near, study, blank(vibration, {name: tone[name]}, pslr), name, tone[name], near),
                )
        if islr is not None:
            vibration, alone = subject(name, "vibration", "wideband"), {name: rms[name]}
            yield vibration, partial(_wideband, study, blank(vibration, alone, islr), alone)
    if pslr is not None:
        frequency = next((line.frequency for name in PLATFORMS for line in lines[name]), None)
        both_platforms = subject("mission", "vibration", "sinusoidal")
        yield both_platforms, partial(_sinusoidal, study, blank(both_platforms, tone, pslr), tone, frequency)
    if islr is not None:
        both_platforms = subject("mission", "vibration", "wideband")
        yield both_platforms, partial(_wideband, study, blank(both_platforms, rms, islr), rms)


def _sinusoidal(study: Study, blank: Verdict, limits: Mapping[str, float], declared: float | None) -> Verdict:
    """Verdict on a sinusoidal vibration at its limit: compare its paired echo with the requirement.

    The error-free image is subtracted before the echo is measured, because its sidelobes would mask the echo.
    `limits` maps platforms to their amplitudes [m] at the limit. `declared` [Hz] is the declared frequency. If it is
    None, the vibration has 10 cycles per aperture.
    """
    frequency = UNDECLARED_CYCLES / study.collection.aperture_time if declared is None else declared
    sinusoids = {name: (PathSinusoid(amplitude=size, frequency=frequency),) for name, size in limits.items()}
    who = "one platform alone" if len(limits) == 1 else "both platforms in phase"
    return echo(study, blank, sinusoids, who, is_assumed=declared is None)


def _near(study: Study, blank: Verdict, name: str, limit: float, lines: Sequence[Line]) -> Verdict:
    """Verdict on a group of vibration tones with neighbouring frequencies at their common limit.

    The amplitudes are scaled by a common factor, so that their declared ratios are kept. The starting phases of the
    tones are chosen to give the highest echo. `name` is the platform. `limit` [m] is the amplitude of a single tone
    with the same echo.
    """
    cycles = [line.frequency * study.collection.aperture_time for line in lines]
    worst = worst_phases([line.amplitude for line in lines], cycles)
    if not worst.amplitude:
        return blank._replace(reason=phrases.note("lines-without-amplitude"))
    scale = limit / worst.amplitude
    sinusoids = tuple(
        PathSinusoid(
            float(scale * line.amplitude), line.frequency, 0.0 if np.sinc(worst.cycles - n) >= 0 else math.pi
        )
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
    """Verdict on sinusoidal platform motions: compare their paired echoes with the requirement in `blank`.

    `sinusoids` maps platforms to their motions. `who` describes the motions in the reason for the verdict.
    `is_assumed` is true if their frequency is an assumption because the mission file does not state it.
    """
    collection = study.collection
    cycles_of_all = [
        sinusoid.frequency * collection.aperture_time
        for platform_sinusoids in sinusoids.values()
        for sinusoid in platform_sinusoids
    ]
    slowest, cycles = min(cycles_of_all), max(cycles_of_all)
    if slowest < 3:
        return blank._replace(reason=phrases.note("echoes-on-the-peak", cycles=slowest))
    cells = 2 * math.ceil(min(cycles, 1e6)) + CUT_CELLS
    errors = Errors()
    for name, platform_sinusoids in sinusoids.items():
        errors = errors.of(name, PathError(sinusoids=platform_sinusoids))
    try:
        clean = collection.chip((0.0, 0.0), Errors(), cells=cells).cut
        echo = collection.chip((0.0, 0.0), errors, cells=cells).cut - clean
    except ValueError as error:
        return blank._replace(reason=phrases.note("no-image-of-a-vibration", cycles=cycles, why=str(error)))
    # An echo keeps its range, while a scatterer at its position would walk by one wavelength per cycle.
    walk = cycles * collection.radar.bandwidth / collection.radar.center_frequency
    peaks = [float(np.abs(upsampled(cut, _ECHO_UPSAMPLING_FACTOR)).max()) for cut in (echo, clean)]
    level = 20 * math.log10(peaks[0] / peaks[1])
    return blank._replace(
        measured_db=level,
        verdict=compare(level - (blank.requirement_db or 0.0), TOLERANCE_DB),
        reason=phrases.echoes_measured(who, cycles, walk if walk > _MIN_WALK_CELLS else None, is_assumed),
    )


def _wideband(study: Study, blank: Verdict, limits: Mapping[str, float]) -> Verdict:
    """Verdict on a noise-like vibration at its limit: compare the ISLR added by white noise with the requirement.

    The ISLR is measured over one repeat interval of the image, with as many draws as the verdict needs. `limits` maps
    platforms to their rms displacements [m] at the limit.
    """
    collection, seed = study.collection, (study.mission.simulation or Simulation()).seed
    slow_time = cell_centres(collection.aperture_time, _ISLR_SAMPLES)
    clean = collection.flight(Errors(), slow_time).paths
    errors = Errors()
    for name, rms in limits.items():
        errors = errors.of(name, PathError(wideband_rms=rms))

    def phases(rng: np.random.Generator, draws: int, *, is_common: bool) -> Floats:
        phase_draws = np.empty((draws, slow_time.size))
        for phase in phase_draws:
            flown = collection.flight(errors, slow_time, rng).paths
            shifts = [
                np.linalg.norm(flown_path.measured, axis=1) - np.linalg.norm(clean_path.measured, axis=1)
                for flown_path, clean_path in zip(flown, clean, strict=True)
            ]
            if collection.has_direct_path:  # subtract the direct path, separately for the motion of each platform
                shifts[0] -= SPEED_OF_LIGHT_MPS * direct_path_error((flown[0], clean[1]))
                shifts[1] -= SPEED_OF_LIGHT_MPS * direct_path_error((clean[0], flown[1]))
            if is_common:  # the second platform has the first one's motion, scaled to its own limit
                first, second = limits.values()
                shifts[1] = shifts[0] * second / first
            phase[:] = 2 * math.pi / collection.wavelength * (shifts[0] + shifts[1])
        return phase_draws

    basis = phrases.note("power-of-one-platform")
    if len(limits) == 2:
        mainlobe = Mainlobe(collection.window(_ISLR_SAMPLES))
        common = phases(np.random.default_rng([seed, 1]), _COMMON_DRAWS, is_common=True)
        basis = phrases.note(
            "power-of-both-platforms", common_db=mainlobe.added_db(float(mainlobe.lost(common).mean()))
        )
    draw = partial(phases, np.random.default_rng(seed), is_common=False)
    return measured_power(collection, blank, draw, basis)


def measured_power(
    collection: PointCollection, blank: Verdict, draw: Callable[[int], Floats], basis: Note
) -> Verdict:
    """Verdict on random phases: compare the ISLR that they add with the requirement in `blank`.

    `draw` takes a number of draws and returns random phases [rad] over the aperture, (draws, _ISLR_SAMPLES). `basis`
    is the beginning of the reason for the verdict.
    """
    required = blank.requirement_db or 0.0
    added = added_islr(collection.window(_ISLR_SAMPLES), draw, required)
    verdict, draws, low, high = added.verdict(required), added.draws, added.low, added.high
    if verdict == "not_evaluated":
        drawn = phrases.note("draws-do-not-decide", draws=draws, low=low, high=high)
    else:
        drawn = phrases.note("draws-decide", draws=draws, low=low, high=high)
    return blank._replace(
        measured_db=added.level,
        measured_db_error=added.error,
        measured_db_interval=(low, high),
        verdict=verdict,
        reason=basis.then(drawn),
    )


# ---------------------------------------------------------------------- sensors and clocks
def limits_of(study: Study, error: RandomError) -> dict[str, float]:
    """Sizes at which a random error reaches its limits without autofocus, in the unit of the error.

    The keys are the names of the limiting requirements. The result is empty if no requirement limits the error.
    """
    model = _model(study, error)
    effect = held_effect(study.mission, error.effect(model), error.coverage(study.mission))
    sizes = map(float, sizes_at(effect, limits_for(study.mission, study.allocation, error.owner, model)))
    return {name: size for name, size in zip(RANDOM_REQUIREMENTS, sizes, strict=True) if math.isfinite(size)}


def _model(study: Study, error: RandomError) -> str:
    """Name of the model that gives the larger phase (quadratic or cubic) for a random error.

    Only models that decide the mission's status are compared.
    """
    return max((model.name for model in study.models), key=lambda name: max(error.effect(name)[:2]))


def tone_cases(study: Study) -> Iterator[tuple[Subject, Case]]:
    """For each oscillator tone with a limit, yield the subject of its row and a function that verifies the limit.

    In images the tone is represented by a platform motion that causes the same phase.
    """
    mission, wavelength = study.mission, study.collection.wavelength
    metric, limits = tone_limits(mission, study.allocation)
    required_pslr = mission.requirements.pslr if metric == "pslr" else None
    sizes = {name: limit.by(study.model) for name, limit in limits.items()}

    def case(row_subject: Subject, limit: float, unit: str, frequency: float) -> tuple[Subject, Case]:
        blank, size = study.blank(row_subject.id, limit, unit, requirement_db=required_pslr), sizes[row_subject.owner]
        if metric == "islr":
            return row_subject, partial(
                _spread_tone, study, blank, row_subject.owner, size, frequency * study.collection.aperture_time
            )
        return row_subject, partial(
            echo, study, blank, {row_subject.owner: (PathSinusoid(size, frequency),)}, "the tone alone"
        )

    for spur in spurs_of(mission):
        if spur.name in sizes:
            yield case(spur.subject, 20 * math.log10(math.pi * sizes[spur.name] / wavelength), "dB", spur.frequency)
    for tone in accelerated_tones(mission):
        is_fast = tone.frequency * study.collection.aperture_time >= SLOWEST_ECHO_CYCLES
        if tone.name in sizes and is_fast and tone.per_unit:
            sensitivity = 2 * math.pi / wavelength * sizes[tone.name] / tone.per_unit
            yield case(tone.subject, sensitivity, "s^2/m", float(tone.frequency))


def _spread_tone(study: Study, blank: Verdict, owner: str, amplitude: float, cycles: float) -> Verdict:
    """Verdict on a tone at the limit that is set by the ISLR requirement.

    The tone is represented by a motion of the platform `owner` with the amplitude `amplitude` [m] and `cycles` cycles
    per aperture.
    """
    phase = 2 * math.pi * amplitude / study.collection.wavelength
    return _power(study, blank, [], owner, echoes=[(phase / math.sqrt(2), cycles)])


def verify_pslr(study: Study) -> Verdict:
    """Verdict on the PSLR requirement: measure the highest echo that declared tones produce together.

    The starting phases of the tones are chosen to give the highest echo. The tones are scaled by a common factor, so
    that their predicted echo has exactly the required PSLR.
    """
    required = study.mission.requirements.pslr or 0.0
    row_id = subject("mission", "pslr").id
    blank = study.blank(row_id, required, "dB", requirement_db=required)
    declared_tones = tones(study.mission)
    highest = highest_echo(declared_tones)
    if highest is None or not highest.phase:
        return blank._replace(reason=phrases.note("no-tone-declared"))
    scale = echo_phase(10 ** (required / 20)) / highest.phase * study.collection.wavelength / (2 * math.pi)
    sinusoids: dict[str, tuple[PathSinusoid, ...]] = {}
    for member in [tone for tone, is_in in zip(declared_tones, highest.is_of, strict=True) if is_in]:
        phase = 0.0 if np.sinc(highest.cycles - member.cycles) >= 0 else math.pi
        phase += 0.0 if member.in_quadrature is None else math.pi / 2
        tone = PathSinusoid(scale * member.phase, member.cycles / study.collection.aperture_time, phase)
        sinusoids[member.subject.owner] = (*sinusoids.get(member.subject.owner, ()), tone)
    return echo(study, blank, sinusoids, "the tones together in their worst phases")


def verify_random(study: Study, error: RandomError) -> Verdict:
    """Verdict on the limit of a random error.

    The limit is the smallest size at which the error reaches any requirement. It does not include the autofocus gain.
    """
    sizes = limits_of(study, error)
    binding = min(sizes, key=lambda name: sizes[name])
    size = sizes[binding]
    at_limit = error._replace(declared=size)
    blank = study.blank(error.id, 20 * math.log10(size) if error.unit == "dB" else size, error.unit)
    if binding == ISLR:
        is_taken = study.mission.requirements.cubic_phase_error is not None
        return _power(study, blank, [at_limit], error.owner, order=_CUBIC_ORDER if is_taken else _CUBIC_ORDER - 1)
    if binding == LOCATION:
        return _place(study, blank, at_limit, _stream(study, error.id))
    return _phase(study, blank, at_limit, binding, _stream(study, error.id))


def _phase(study: Study, blank: Verdict, error: RandomError, binding: str, rng: np.random.Generator) -> Verdict:
    """Verdict on the quadratic or cubic phase of a random error at its limit.

    The standard deviation of the phase, multiplied by the coverage factor, is compared with the budget. `binding` is
    the requirement that sets the limit.
    """
    is_cubic = binding == CUBIC
    required = study.mission.requirements.cubic_phase_error
    budget = (required or 0.0) if is_cubic else study.allocation.qpe_limit(error.owner)
    factor = study.mission.allocation.coverage_factor
    sigma, draws = _sigma(study, error, rng, is_cubic)
    predicted = factor * sigma
    exact_phases, image_phases = [], []
    try:
        for errors in _series(study, error, rng):
            images = study.images(errors)
            effect, reading = images.effect, study.read(images)
            exact_phases.append(effect.cubic if is_cubic else effect.quadratic)
            image_phases.append(reading.cubic if is_cubic else reading.quadratic)
    except ValueError as fault:
        return blank._replace(budget_rad=budget, reason=phrases.note("no-image-of-a-time-series", why=str(fault)))
    # Ratio of phases in images to phases from exact ranges; large phases have more weight.
    image_ratio = float(np.dot(exact_phases, image_phases) / np.dot(exact_phases, exact_phases))
    measured = predicted * image_ratio
    tolerance = TOLERANCE_FRACTION + _MARGIN_SIGMA / math.sqrt(2 * draws)
    verdict = blank._replace(
        budget_rad=budget,
        verdict=compare(measured / budget - 1, tolerance),
        reason=phrases.sigma_of_time_series(draws, factor, _IMAGE_DRAWS, "cubic phase" if is_cubic else ""),
    )
    if is_cubic:
        return verdict._replace(measured_cubic_rad=measured, predicted_cubic_rad=predicted)
    return verdict._replace(measured_qpe_rad=measured, predicted_qpe_rad=predicted)


def _place(study: Study, blank: Verdict, error: RandomError, rng: np.random.Generator) -> Verdict:
    """Verdict on the displacement due to a random error at the limit that is set by the location requirement.

    The standard deviation of the displacement, multiplied by the coverage factor, is compared with the requirement.
    """
    required = study.mission.requirements.location_error or 0.0
    factor, draws = study.mission.allocation.coverage_factor, _SIGMA_DRAWS
    if error.kind.drawn_as in _EFFECTS_OF_DRAWS:
        effects = _EFFECTS_OF_DRAWS[error.kind.drawn_as](study, error, rng)
    else:
        fit, draws = _fits(study, error, rng)
        if error.unit == "rad":  # an error of the phase alone, which displaces no point if it is constant
            fit[0] = 0.0
        half = study.collection.aperture_time / 2
        phases = np.polynomial.legendre.legval(aperture_nodes(study.collection.aperture_time) / half, fit)
        metres = np.asarray(phases * study.collection.wavelength / (2 * math.pi), float)
        effects = study.exact_effects({"clock": metres})
    east, north = (
        factor * math.sqrt(np.nanmean(np.square(component))) for component in (effects.east, effects.north)
    )
    exact_displacements, image_displacements = list[float](), list[float]()
    try:
        for errors in _series(study, error, rng):
            images = study.images(errors)
            shift = study.shift(images, study.read(images))
            exact_displacements += images.effect.displacement
            image_displacements += images.effect.moved(shift.displacement)
    except ValueError as fault:
        return blank._replace(reason=phrases.note("no-image-of-a-time-series", why=str(fault)))
    image_ratio = float(
        np.dot(exact_displacements, image_displacements) / np.dot(exact_displacements, exact_displacements)
    )
    tolerance = TOLERANCE_FRACTION + _MARGIN_SIGMA / math.sqrt(2 * draws)
    return blank._replace(
        displacement_m=(east, north),
        measured_displacement_m=(east * image_ratio, north * image_ratio),
        verdict=compare(math.hypot(east, north) * image_ratio / required - 1, tolerance),
        reason=phrases.sigma_of_time_series(draws, factor, _IMAGE_DRAWS, "displacement"),
    )


def _stream(study: Study, row_id: str) -> np.random.Generator:
    """Random number generator for a row, seeded with the mission's seed and the id of the row."""
    return np.random.default_rng([(study.mission.simulation or Simulation()).seed, *row_id.encode()])


def _sigma(study: Study, error: RandomError, rng: np.random.Generator, is_cubic: bool) -> tuple[float, int]:
    """Standard deviation of the quadratic or cubic phase over many time series [rad], and the number of series.

    Time series for which no ground point has the recorded range history are left out.
    """
    if error.kind.drawn_as in _EFFECTS_OF_DRAWS:
        effects = _EFFECTS_OF_DRAWS[error.kind.drawn_as](study, error, rng)
        return float(np.nanstd(effects.cubic if is_cubic else effects.quadratic)), _SIGMA_DRAWS
    fit, draws = _fits(study, error, rng)
    return float(np.std(2.5 * fit[3] if is_cubic else 1.5 * fit[2])), draws


def _effects_of_motion(study: Study, error: RandomError, rng: np.random.Generator) -> ImagePoints:
    """Draw many platform motions due to a random error, and compute their effects from exact ranges.

    The fields of the result are (draws,).
    """
    if error.kind.is_correlated or error.navigation is not None:  # not smooth between the nodes
        return study.exact_effects(_smooth_noise(study, error, rng))
    moments = aperture_nodes(study.collection.aperture_time)
    return study.exact_effects(position_courses(study.mission, error, moments, _SIGMA_DRAWS, rng))


def _effects_of_delays(study: Study, error: RandomError, rng: np.random.Generator) -> ImagePoints:
    """Draw many atmospheric delays due to a random error, and compute their effects from exact ranges.

    The fields of the result are (draws,).
    """
    moments = aperture_nodes(study.collection.aperture_time)
    group = group_delays(study.mission, error, moments, _delays_at_nodes(study, error, rng))
    mean = (group @ nodes(FINE_NODE_COUNT).fit[0])[:, None]
    return study.exact_effects({"clock": seen_course(group, mean, error.subject.axis)})


# Functions for errors whose time series go directly through exact ranges, by what is drawn of the kind of error.
_EFFECTS_OF_DRAWS: Mapping[str, Callable[[Study, RandomError, np.random.Generator], ImagePoints]] = {
    "motion": _effects_of_motion,
    "delay": _effects_of_delays,
}


def _remaining_range_error(study: Study, error: RandomError, times: Floats, group: Floats) -> Floats:
    """Range error over the aperture that atmospheric delays leave at the displaced image point. [m]

    The result is (draws, times). `group` (draws, times) [m] holds the group delays. `times` [s] are slow times.
    """
    half, geometry = study.collection.aperture_time / 2, study.geometry
    mean = group.mean(axis=1, keepdims=True)
    range_error = seen_course(group, mean, error.subject.axis)
    at_nodes = range_error @ _smooth_at_nodes(2 * half, times).T
    effects = study.exact_effects({"clock": at_nodes})
    for path in geometry.both:
        position = np.stack(np.broadcast_arrays(*path.place(times)))
        sight = position / np.linalg.norm(position, axis=0)
        range_error = (
            range_error + np.multiply.outer(effects.east, sight[0]) + np.multiply.outer(effects.north, sight[1])
        )
    return np.asarray(range_error)


def _fits(study: Study, error: RandomError, rng: np.random.Generator) -> tuple[Floats, int]:
    """Draw phases of an oscillator or of the synchronisation link over time, and fit polynomials to them.

    Returns the Legendre coefficients up to the cubic order over the aperture, (4, draws) [rad], and the number of
    draws.
    """
    mission, T = study.mission, study.collection.aperture_time
    draws, highest, count = _CLOCK_DRAWS, _MAX_TONE_CYCLES / T, 257
    if mission.synchronization is not None and mission.synchronization.interval is not None:
        draws = _SYNCHRONIZED_DRAWS
    if fastest_shake(mission, error):  # vibration may begin above the frequencies that otherwise matter
        draws, highest = _SYNCHRONIZED_DRAWS, max(highest, _SHAKE_FREQUENCY_FACTOR * slowest_shake(mission, error))
        highest = min(highest, fastest_shake(mission, error))
        count = 1 + fast_steps(min(_MAX_TONE_STEPS, max(count - 1, math.ceil(_STEPS_PER_CYCLE * highest * T))))
    times, coefficients = _moments(study, count), list[Floats]()
    block_draws = max(1, _DELAY_BLOCK_DRAWS * _SERIES_SAMPLES // count)
    for start in range(0, draws, block_draws):
        draw_count = min(block_draws, draws - start)
        phases = phase_courses(mission, error, times, draw_count, rng, highest)
        coefficients.append(np.asarray(np.polynomial.legendre.legfit(2 * times / T, phases.T, _CUBIC_ORDER), float))
    return np.concatenate(coefficients, axis=1), draws


def _delays_at_nodes(study: Study, error: RandomError, rng: np.random.Generator) -> Floats:
    """Draw zenith delays at the slow times for which exact ranges are computed, (draws, nodes).

    The delays are in units of the declared standard deviation. The times are the nodes of a quadrature. For delays
    that are correlated over time, the result is their smooth part; see `_smooth_at_nodes`.
    """
    T, correlation_time = study.collection.aperture_time, correlation_time_of(study.mission, error.owner)
    if correlation_time is None:
        return zenith_delays(study.mission, error, aperture_nodes(T), _SIGMA_DRAWS, rng)
    times = _moments(study, _SERIES_SAMPLES)
    smooth = _smooth_at_nodes(T, times).T * math.sqrt(_power_of_samples(times, float(correlation_time)))
    drawn = [
        zenith_delays(study.mission, error, times, _DELAY_BLOCK_DRAWS, rng) @ smooth
        for _ in range(_SIGMA_DRAWS // _DELAY_BLOCK_DRAWS)
    ]
    return np.concatenate(drawn)


def _smooth_noise(study: Study, error: RandomError, rng: np.random.Generator) -> dict[str, Floats]:
    """Draw position noise, and return its smooth part at the slow times for which exact ranges are computed. [m]

    The keys of the result are the names of the platforms. Each array is (draws, nodes, 3); the nodes are these slow
    times. `_smooth_at_nodes` defines the smooth part.
    """
    T = study.collection.aperture_time
    times = _moments(study, _SERIES_SAMPLES)
    at_nodes = _smooth_at_nodes(T, times)
    blocks = [
        {
            name: at_nodes @ course
            for name, course in position_courses(study.mission, error, times, _DELAY_BLOCK_DRAWS, rng).items()
        }
        for _ in range(_SIGMA_DRAWS // _DELAY_BLOCK_DRAWS)
    ]
    scale = 1.0
    if error.kind.is_correlated:
        scale = math.sqrt(_power_of_samples(times, process_of(study.mission, error).correlation_time))
    return {name: np.concatenate([block[name] for block in blocks]) * scale for name in blocks[0]}


def _smooth_at_nodes(aperture_time: float, times: Floats) -> Floats:
    """Matrix (nodes, times) that converts values at slow times `times` [s] to their smooth part at the nodes.

    The nodes are the slow times for which exact ranges are computed. The smooth part is a least-squares fit of
    Legendre polynomials up to the order `SMOOTH_ORDER`. Without this fit, the phase of noise with a short correlation
    time would be overestimated, because the nodes are far apart.
    """
    legendre = np.polynomial.legendre
    fit = np.linalg.pinv(legendre.legvander(2 * times / aperture_time, SMOOTH_ORDER))
    return np.asarray(legendre.legvander(2 * aperture_nodes(aperture_time) / aperture_time, SMOOTH_ORDER) @ fit)


def _power_of_samples(times: Floats, correlation_time: float) -> float:
    """Ratio of the power density of correlated noise to the power density of its samples, at low frequencies.

    Samples at time steps Δ have more power at low frequencies than the noise itself: their power density is
    Δ·coth(Δ/2τ_c) instead of 2τ_c, where τ_c [s] is the correlation time.
    """
    step = float(times[1] - times[0])
    return 2 * correlation_time / step * math.tanh(step / (2 * correlation_time))


def _moments(study: Study, count: int) -> Floats:
    half = study.collection.aperture_time / 2
    moments: Floats = np.linspace(-half, half, count)
    return moments


def _series(study: Study, error: RandomError, rng: np.random.Generator) -> list[Errors]:
    """Draw a few time series of a random error, and convert them to errors that the simulator applies to images.

    Only the Legendre orders 0 to 3 are kept, because higher orders spread power and would mask the response.
    """
    return _IMAGE_ERRORS[error.kind.drawn_as](study, error, _moments(study, _SERIES_SAMPLES), rng)


def _errors_of_motion(study: Study, error: RandomError, times: Floats, rng: np.random.Generator) -> list[Errors]:
    errors_of_images = [Errors()] * _IMAGE_DRAWS
    for name, courses in position_courses(study.mission, error, times, _IMAGE_DRAWS, rng).items():
        smooth = (PathError(course=Course(times, course).smooth(_CUBIC_ORDER)) for course in courses)
        errors_of_images = [
            errors.of(name, path_error) for errors, path_error in zip(errors_of_images, smooth, strict=True)
        ]
    return errors_of_images


def _errors_of_delays(study: Study, error: RandomError, times: Floats, rng: np.random.Generator) -> list[Errors]:
    at_zenith = zenith_delays(study.mission, error, times, _IMAGE_DRAWS, rng)
    if correlation_time_of(study.mission, error.owner) is not None:
        at_zenith = Course(times, at_zenith.T).smooth(_CUBIC_ORDER).values.T
    groups = group_delays(study.mission, error, times, at_zenith)
    if error.subject.axis == CONTENT:
        return [Errors(electrons=electrons_at_1_hz(study.mission, times, course)) for course in groups]
    return [Errors(clock_course=Course(times, course / SPEED_OF_LIGHT_MPS)) for course in groups]


def _errors_of_phases(study: Study, error: RandomError, times: Floats, rng: np.random.Generator) -> list[Errors]:
    phases = phase_courses(study.mission, error, times, _IMAGE_DRAWS, rng)
    delays = [clock_seconds(course, study.collection.wavelength) for course in phases]
    return [Errors(clock_course=Course(times, course).smooth(_CUBIC_ORDER)) for course in delays]


# Functions that draw errors of images, by what is drawn of the kind of error.
_IMAGE_ERRORS: Mapping[str, Callable[[Study, RandomError, Floats, np.random.Generator], list[Errors]]] = {
    "motion": _errors_of_motion,
    "delay": _errors_of_delays,
    "phase": _errors_of_phases,
}


# ---------------------------------------------------------------------- what spreads
def verify_islr(study: Study, row_subject: Subject) -> Verdict:
    """Verdict on the ISLR limit of an owner, such as a platform, for all declared errors of the owner.

    Only errors that spread power are included. They are scaled by a common factor until their power equals the limit.
    `row_subject` is the subject of the row, which names the owner.
    """
    mission, model = study.mission, study.models[-1].name
    limit = spread_limit(mission, study.allocation, row_subject.owner, model) or 0.0
    level = islr_db(limit**2, model, mainlobe_energy(mission))
    blank = study.blank(row_subject.id, level, "dB")
    powers = declared_powers(study.analysis, row_subject.owner, model)
    total = math.fsum(power.variance for power in powers)
    if not total:
        return blank._replace(reason=phrases.note("no-spread-declared"))
    scale = limit / math.sqrt(total)
    # A direct path cancels part of the power.
    rms = {power.row_id: scale * math.sqrt(power.variance) for power in powers if power.variance}
    members = [
        error._replace(declared=scale * (error.declared or 0.0)) for error in study.analysis.random if error.id in rms
    ]
    cubic = rms.pop(subject("mission", CUBIC).id, 0.0)
    cycles = {tone.subject.id: tone.cycles for tone in tones(mission)}
    echoes = [(rms[row_id], turns) for row_id, turns in cycles.items() if row_id in rms]
    shown_ids = {error.id for error in members} | cycles.keys()
    white = math.sqrt(math.fsum(size**2 for row_id, size in rms.items() if row_id not in shown_ids))
    return _power(study, blank, members, row_subject.owner, white, echoes, cubic)


def _power(
    study: Study,
    blank: Verdict,
    members: Sequence[RandomError],
    owner: str,
    white: float = 0.0,
    echoes: Sequence[tuple[float, float]] = (),
    cubic: float = 0.0,
    order: int = _CUBIC_ORDER,
) -> Verdict:
    """Verdict on errors at a limit: compare the ISLR that they add to an image with the ISLR allotted to `owner`.

    `members` holds random errors, which are drawn as time series. `white` [rad] is the rms phase of additional white
    noise. Legendre orders up to `order` are removed from the time series and from the noise. `echoes` holds tones,
    each given by its rms phase [rad] and its number of cycles per aperture; their starting phases are random. `cubic`
    [rad] is the rms value of a random cubic phase over the aperture.
    """
    mission, collection = study.mission, study.collection
    rng = _stream(study, blank.id)
    # Each sample represents one time step; faster phases appear as independent noise from step to step.
    times = cell_centres(collection.aperture_time, _ISLR_SAMPLES)
    scaled_time = 2 * times / collection.aperture_time
    legendre = np.polynomial.legendre.legvander(scaled_time, _CUBIC_ORDER)
    fitted = legendre[:, : order + 1] @ np.linalg.pinv(legendre[:, : order + 1])

    def draw_phases(draws: int) -> Floats:
        """Draw the phases of all errors over the aperture, (draws, _ISLR_SAMPLES). [rad]

        The Legendre orders that displace or defocus the response are removed from random errors and white noise.
        """
        phases = white * rng.standard_normal((draws, times.size))
        for error in members:
            for phases_of_error in _PHASES_AT_MOMENTS[error.kind.drawn_as](study, error, times, draws, rng):
                phases += phases_of_error
        phases = phases - phases @ fitted
        for rms, cycles in echoes:
            starts = 2 * math.pi * rng.random((draws, 1))
            phases += math.sqrt(2) * rms * np.cos(math.pi * cycles * scaled_time + starts)
        if cubic:  # P₃ has a mean square of 1/7 over the aperture
            phases += math.sqrt(7) * cubic * rng.standard_normal((draws, 1)) * legendre[:, 3]
        return phases

    allowed = spread_limit(mission, study.allocation, owner, "full") or 0.0  # rms phase of the owner's limit
    required = float(islr_of(mission, allowed**2)) if allowed else 0.0
    return measured_power(
        collection, blank._replace(requirement_db=required), draw_phases, phrases.note("power-of-time-series")
    )


def _phases_of_motion(
    study: Study, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> Iterator[Floats]:
    """Draw the motion of each platform, and yield the phase due to the motion along the line of sight. [rad]

    Each array is (draws, times).
    """
    for name, courses in position_courses(study.mission, error, times, draws, rng).items():
        yield 2 * math.pi / study.collection.wavelength * courses @ np.array(sight_of(study.mission, name))


def _phases_of_delays(
    study: Study, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> Iterator[Floats]:
    """Draw atmospheric delays, and yield the phase that they leave at the displaced image point. [rad]

    A single array of shape (draws, times) is yielded.
    """
    group = delay_courses(study.mission, error, times, draws, rng)
    yield 2 * math.pi / study.collection.wavelength * _remaining_range_error(study, error, times, group)


def _phases_of_clock(
    study: Study, error: RandomError, times: Floats, draws: int, rng: np.random.Generator
) -> Iterator[Floats]:
    """Yield random phases of an oscillator or of the synchronisation link, as a single array (draws, times). [rad]"""
    yield phase_courses(study.mission, error, times, draws, rng)


# Functions that draw phases over the aperture, by what is drawn of the kind of error.
_PHASES_AT_MOMENTS: Mapping[
    str, Callable[[Study, RandomError, Floats, int, np.random.Generator], Iterator[Floats]]
] = {"motion": _phases_of_motion, "delay": _phases_of_delays, "phase": _phases_of_clock}


# ---------------------------------------------------------------------- ISLR that noise adds
@dataclass(frozen=True, slots=True)
class AddedIslr:
    """ISLR that noise adds [dB], its 95 % confidence interval [dB], and the number of draws.

    `level` is the ISLR, and `low` and `high` are the ends of the interval.
    """

    level: float
    low: float
    high: float
    draws: int

    @property
    def error(self) -> float:
        """Standard error of the measured ISLR. [dB]"""
        return (self.high - self.low) / (2 * _INTERVAL_95_SIGMA)

    def verdict(self, required_db: float) -> str:
        """Verdict on a noise limit: compare the ISLR that noise at the limit adds with the required ISLR.

        The verdict is `not_evaluated` if more draws could change it. If even the maximum number of draws cannot
        decide between `confirmed` and `conservative`, the verdict is `conservative`, because in either case the added
        ISLR is not too high.
        """
        excess, doubt = self.level - required_db, _DECISION_SIGMA * self.error
        low, high = excess - doubt, excess + doubt
        if low > TOLERANCE_DB:
            return "optimistic"
        if high < -TOLERANCE_DB:
            return "conservative"
        if low >= -TOLERANCE_DB and high <= TOLERANCE_DB:
            return "confirmed"
        return "conservative" if self.draws >= _MAX_ISLR_DRAWS and high < 0 else "not_evaluated"


class Mainlobe:
    """Mainlobe of an error-free response, between the first nulls of the response.

    Parameters
    ----------
    weights : (moments,) ndarray
        Window weights over the aperture, at the centres of equal cells.
    """

    def __init__(self, weights: Floats) -> None:
        positions = cell_centres(1.0, weights.size)
        response = np.abs(np.fft.rfft(weights, weights.size * _STEPS_PER_CELL))
        null = int(np.argmax(np.diff(response) > 0)) / _STEPS_PER_CELL
        nodes, self._steps = np.polynomial.legendre.leggauss(_MAINLOBE_NODES)
        waves = np.exp(-2j * math.pi * np.outer(positions, null * nodes))
        self._waves = waves * weights[:, None] / weights.size
        self._clean = self._waves.sum(axis=0).real
        self._steps = self._steps * null / np.mean(weights**2)
        self.energy = float(self._clean**2 @ self._steps)

    def lost(self, phases: Floats) -> Floats:
        """Energy that phase errors remove from the mainlobe, as a fraction of the energy of the image, (draws,).

        `phases` (draws, moments) [rad] holds the phase errors at the centres of the cells of the window.
        """
        # exp(jφ) - 1 without rounding: a limit of -100 dB is an energy of 1e-10.
        change = (-2 * np.sin(phases / 2) ** 2 + 1j * np.sin(phases)) @ self._waves
        energy_loss: Floats = -(2 * self._clean * change.real + np.abs(change) ** 2) @ self._steps
        return energy_loss

    def added_db(self, lost: float) -> float:
        """Increase of the ISLR if a fraction `lost` of the image energy moves from mainlobe to sidelobes. [dB]"""
        remaining_energy = max(self.energy - lost, _MIN_ENERGY_FRACTION)
        return 10 * math.log10(max(lost, _MIN_ENERGY_FRACTION) / (self.energy * remaining_energy))


def added_islr(weights: Floats, draw: Callable[[int], Floats], required_db: float) -> AddedIslr:
    """Measure the ISLR that random phases add, with as many draws as the verdict needs.

    Drawing stops when the confidence interval is narrow and within the range of a single verdict, or when the maximum
    number of draws is reached.

    Parameters
    ----------
    weights : (moments,) ndarray
        Window weights over the aperture.
    draw : callable
        Function that takes a number of draws and returns random phases, (draws, moments). [rad]
    required_db : float
        Largest ISLR that may be added. [dB]
    """
    mainlobe = Mainlobe(weights)
    lost: Floats = np.empty(0)
    while True:
        count = min(_BLOCK_ISLR_DRAWS, max(_FIRST_ISLR_DRAWS, lost.size))
        lost = np.concatenate((lost, mainlobe.lost(draw(count))))
        if lost.size < _FIRST_ISLR_DRAWS or lost.size & (lost.size - 1):  # evaluate only after each doubling
            continue
        mean, error = float(lost.mean()), float(lost.std(ddof=1)) / math.sqrt(lost.size)
        level, low, high = (mainlobe.added_db(mean + sign * _INTERVAL_95_SIGMA * error) for sign in (0, -1, 1))
        added = AddedIslr(level, low, high, lost.size)
        is_narrow = added.high - added.low <= 2 * _MAX_HALF_INTERVAL_DB
        if lost.size >= _MAX_ISLR_DRAWS or (is_narrow and added.verdict(required_db) != "not_evaluated"):
            return added
