"""Verdicts on the limits of sensors and clocks: many time series at the limit, and images of a few of them.

A sigma speaks of many flights. Whole time series go through exact ranges for it, and images of some of them say
whether a response shows the phase that exact ranges find. What spreads is measured as for vibration, in images of as
many time series as a verdict takes, see `noise_image`.
"""

import math
from collections.abc import Sequence

import numpy as np

from bisar_budget.analysis.spread import declared_powers, islr_db, mainlobe_energy, shown_islr_db, spread_limit, tones
from bisar_budget.analysis.vibration_limits import echo_phase, highest_echo
from bisar_budget.budget.random_rows import HELD, ISLR, held_effect, limits_for, sizes_at
from bisar_budget.effects.declared import CUBIC
from bisar_budget.effects.effect import Subject, subject
from bisar_budget.effects.oscillators import Spur
from bisar_budget.effects.random_errors import RandomError, process_of
from bisar_budget.effects.vibration import sight_of
from bisar_budget.findings.images import Verdict
from bisar_budget.mission.model import Simulation
from bisar_budget.ranges.exact_ranges import aperture_nodes
from bisar_budget.simulate.collection import Errors
from bisar_budget.simulate.phase_history import SMOOTH, Course, Floats, PathError, PathSinusoid, cell_centres
from bisar_budget.simulate.realisations import clock_seconds, phase_courses, position_courses
from bisar_budget.verify import reasons
from bisar_budget.verify.phase_cases import TOLERANCE, compare
from bisar_budget.verify.study import Study
from bisar_budget.verify.vibration_cases import MOMENTS, echo, measured_power

_DRAWS, _CLOCK_DRAWS = 4000, 1000  # know a sigma to 1.1 %, and to 2.2 %
_SYNCHRONIZED_DRAWS = 400  # whose fast tones are drawn too, because they are folded
_TURNS = 100  # of a tone per aperture, beyond which it has no quadratic phase to speak of
_SURE = 3.0  # standard errors of a sigma
_IMAGES = 6
_FINE = 513  # moments of a time series in an image
_AT_ONCE = 250  # draws in memory
_ORDER = 3  # up to which a phase moves and defocuses; the rest spreads


def limits_of(study: Study, error: RandomError) -> dict[str, float]:
    """Size at which each requirement that an error touches is reached, autofocus left out; empty: none limits it."""
    model = _model(study, error)
    effect = held_effect(study.mission, error.effect(model))
    sizes = map(float, sizes_at(effect, limits_for(study.mission, study.allocation, error.owner, model)))
    return {name: size for name, size in zip(HELD, sizes, strict=True) if math.isfinite(size)}


def _model(study: Study, error: RandomError) -> str:
    """The gating model by which an error does more."""
    return max((one.name for one in study.models), key=lambda name: max(error.effect(name)[:2]))


def verify_spur(study: Study, spur: Spur, row_id: str, amplitude: float) -> Verdict:
    """A tone at its limit: the motion of the platform that makes the same phase. [m]"""
    level = 20 * math.log10(math.pi * amplitude / study.collection.wavelength)
    blank = Verdict(
        id=row_id,
        model=study.model,
        boundary_error=level,
        unit="dB",
        requirement_db=study.mission.requirements.pslr,
    )
    sinusoids = {spur.name: (PathSinusoid(amplitude, spur.frequency),)}
    return echo(study.collection, blank, sinusoids, "the tone alone")


def verify_spread_tone(study: Study, blank: Verdict, owner: str, amplitude: float, cycles: float) -> Verdict:
    """A tone where ISLR holds it, at its limit: a motion [m] of so many cycles per aperture."""
    phase = 2 * math.pi * amplitude / study.collection.wavelength
    return _power(study, blank, [], owner, echoes=[(phase / math.sqrt(2), cycles)])


def verify_pslr(study: Study) -> Verdict:
    """The tones that make the highest echo, in their worst phases, scaled together to what is required."""
    required = study.mission.requirements.pslr or 0.0
    row_id = subject("mission", "pslr").id
    blank = Verdict(id=row_id, model=study.model, boundary_error=required, unit="dB", requirement_db=required)
    found = tones(study.mission)
    highest = highest_echo(found)
    if highest is None or not highest.phase:
        return blank._replace(reason=reasons.no_tone_declared())
    scale = echo_phase(10 ** (required / 20)) / highest.phase * study.collection.wavelength / (2 * math.pi)
    sinusoids: dict[str, tuple[PathSinusoid, ...]] = {}
    for one in [one for one, is_in in zip(found, highest.is_of, strict=True) if is_in]:
        turned = 0.0 if np.sinc(highest.cycles - one.cycles) >= 0 else math.pi
        tone = PathSinusoid(scale * one.phase, one.cycles / study.collection.aperture_time, turned)
        sinusoids[one.subject.owner] = (*sinusoids.get(one.subject.owner, ()), tone)
    return echo(study.collection, blank, sinusoids, "the tones together in their worst phases")


def verify_random(study: Study, error: RandomError) -> Verdict:
    """Limit of one figure: the smallest of what quadratic phase, cubic phase and ISLR allow, autofocus left out."""
    sizes = limits_of(study, error)
    binding = min(sizes, key=lambda name: sizes[name])
    size = sizes[binding]
    at_limit = error._replace(declared=size)
    blank = Verdict(
        id=error.id,
        model=study.model,
        boundary_error=20 * math.log10(size) if error.unit == "dB" else size,
        unit=error.unit,
    )
    if binding == ISLR:
        is_taken = study.mission.requirements.cubic_phase_error is not None
        return _power(study, blank, [at_limit], error.owner, order=_ORDER if is_taken else _ORDER - 1)
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
            effect = study.collection.effect(errors)
            reading = study.read(errors, effect, *study.chips(errors, effect))
            drawn.append(effect.cubic if is_cubic else effect.quadratic)
            seen.append(reading.cubic if is_cubic else reading.quadratic)
    except (ValueError, np.linalg.LinAlgError) as fault:
        return blank._replace(budget_rad=budget, reason=reasons.no_image_of_a_time_series(str(fault)))
    # How much of a phase images show: readings over exact ranges, the large ones counting more.
    shown = float(np.dot(drawn, seen) / np.dot(drawn, drawn))
    measured = predicted * shown
    tolerance = TOLERANCE + _SURE / math.sqrt(2 * draws)
    verdict = blank._replace(
        budget_rad=budget,
        verdict=compare(measured / budget - 1, tolerance),
        reason=reasons.sigma_of_time_series(draws, factor, _IMAGES, is_cubic),
    )
    if is_cubic:
        return verdict._replace(measured_cubic_rad=measured, predicted_cubic_rad=predicted)
    return verdict._replace(measured_qpe_rad=measured, predicted_qpe_rad=predicted)


def _stream(study: Study, row_id: str) -> np.random.Generator:
    """Draws of a row, its own whatever else is verified."""
    return np.random.default_rng([(study.mission.simulation or Simulation()).seed, *row_id.encode()])


def _sigma(study: Study, error: RandomError, rng: np.random.Generator, is_cubic: bool) -> tuple[float, int]:
    """Standard deviation of a phase over many time series, and their number. [rad]"""
    mission, nodes = study.mission, aperture_nodes(study.collection.aperture_time)
    if error.subject.kind in ("imu", "random"):
        is_walk = error.subject.kind == "imu"  # smooth between the nodes; correlated noise may not be
        courses = (
            position_courses(mission, error, nodes, _DRAWS, rng) if is_walk else _smooth_noise(study, error, rng)
        )
        found = study.exact_phases(error.owner, courses)
        return float(np.nanstd(found[1] if is_cubic else found[0])), _DRAWS
    times = _moments(study, 257)
    draws = _CLOCK_DRAWS if mission.synchronization is None else _SYNCHRONIZED_DRAWS
    phases = phase_courses(mission, error, times, draws, rng, _TURNS / study.collection.aperture_time)
    fit = np.polynomial.legendre.legfit(2 * times / study.collection.aperture_time, phases.T, _ORDER)
    return float(np.std(2.5 * fit[3] if is_cubic else 1.5 * fit[2])), draws


def _smooth_noise(study: Study, error: RandomError, rng: np.random.Generator) -> Floats:
    """Correlated noise at the nodes of exact ranges, (draws, nodes, 3), without what they cannot tell. [m]

    At the nodes alone noise of a short correlation time would pass for a larger phase.
    """
    T, time = study.collection.aperture_time, process_of(study.mission, error).correlation_time
    times = _moments(study, _FINE)
    legendre = np.polynomial.legendre
    fit = np.linalg.pinv(legendre.legvander(2 * times / T, SMOOTH))
    at_nodes = legendre.legvander(2 * aperture_nodes(T) / T, SMOOTH) @ fit
    drawn = (position_courses(study.mission, error, times, _AT_ONCE, rng) for _ in range(_DRAWS // _AT_ONCE))
    found = np.concatenate([at_nodes @ one for one in drawn])
    # Samples a step Δ apart have more power at low frequencies than the noise: Δ·coth(Δ/2τ_c), not 2τ_c.
    step = float(times[1] - times[0])
    power = 2 * time / step * math.tanh(step / (2 * time))
    courses: Floats = found * math.sqrt(power)
    return courses


def _moments(study: Study, count: int) -> Floats:
    half = study.collection.aperture_time / 2
    moments: Floats = np.linspace(-half, half, count)
    return moments


def _series(study: Study, error: RandomError, rng: np.random.Generator) -> list[Errors]:
    """A few time series as errors of an image, up to the cubic phase: what is left spreads, and would hide it."""
    times = _moments(study, _FINE)
    if error.subject.kind in ("imu", "random"):
        courses = position_courses(study.mission, error, times, _IMAGES, rng)
        return [Errors().of(error.owner, PathError(course=Course(times, one).smooth(_ORDER))) for one in courses]
    phases = phase_courses(study.mission, error, times, _IMAGES, rng)
    delays = [clock_seconds(one, study.collection.wavelength) for one in phases]
    return [Errors(clock_course=Course(times, one).smooth(_ORDER)) for one in delays]


# ---------------------------------------------------------------------- what spreads
def verify_islr(study: Study, of: Subject) -> Verdict:
    """Everything that spreads, scaled together to the limit of a row's owner."""
    mission, model = study.mission, study.models[-1].name
    limit = spread_limit(mission, study.allocation, of.owner, model) or 0.0
    level = islr_db(limit**2, model, mainlobe_energy(mission))
    blank = Verdict(id=of.id, model=study.model, boundary_error=level, unit="dB")
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
    times = cell_centres(collection.aperture_time, MOMENTS)
    place = 2 * times / collection.aperture_time
    legendre = np.polynomial.legendre.legvander(place, _ORDER)
    fitted = legendre[:, : order + 1] @ np.linalg.pinv(legendre[:, : order + 1])

    def left(draws: int) -> Floats:
        """Phases without what moves and defocuses the response."""
        phases = white * rng.standard_normal((draws, times.size))
        for error in members:
            if error.subject.kind in ("imu", "random"):
                moved = position_courses(mission, error, times, draws, rng)
                phases += 2 * math.pi / collection.wavelength * moved @ np.array(sight_of(mission, error.owner))
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
    required = shown_islr_db(mission, allowed**2) or 0.0
    return measured_power(collection, blank._replace(requirement_db=required), left, reasons.power_of_time_series())
