"""Explanation steps for random errors: phases due to inertial sensors, clocks, atmospheric delays and vibrations."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from bisar_budget import evaluators
from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.spread import mainlobe_energy, spread_phase
from bisar_budget.budget.random_rows import held_effect, no_effect
from bisar_budget.constants import EARTH_RADIUS_M, SPEED_OF_LIGHT_MPS, STANDARD_GRAVITY_MPS2
from bisar_budget.effects.air_delays import (
    CONTENT,
    DELAY,
    ELECTRON_DELAY_M3_PER_S2,
    IONOSPHERE_HEIGHT_M,
    TROPOSPHERE_HEIGHT_M,
    correlation_time_of,
    group_delay,
    leg_factor,
    legs_of,
    metres_per_unit,
)
from bisar_budget.effects.declared import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.effect import PLATFORMS, plain
from bisar_budget.effects.navigation_errors import (
    arm_at,
    body_axes,
    process_of,
    specific_force,
)
from bisar_budget.effects.oscillator_acceleration import (
    accelerated_tones,
    felt,
    flies_a_turn,
    lacks_a_spectrum,
    pieces_by_acceleration,
)
from bisar_budget.effects.oscillator_tones import LeftTone, spurs_of
from bisar_budget.effects.random_effect import RandomEffect, RandomError
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.effects.spectra import (
    PowerLawPiece,
    gauss_markov,
    heard_parts,
    parts,
    set_parts,
    synchronized_parts,
)
from bisar_budget.effects.vibration import (
    SLOWEST_ECHO_CYCLES,
    counted,
    displacement_rms,
    pieces_of_vibration,
    power_of,
)
from bisar_budget.error_kinds.random_kinds import INERTIAL_FIGURES
from bisar_budget.findings.row import Row
from bisar_budget.geometry import PlatformState, plain_vector
from bisar_budget.mission.instruments import Synchronization
from bisar_budget.mission.model import Mission
from bisar_budget.mission.propagation import AIR_TOP_M, height_of
from bisar_budget.mission.vibrations import FeltVibration, Spectrum, Vibration
from bisar_budget.report.explain.explained_confidence import BiasedEffect, quantile_step
from bisar_budget.report.explain.explained_error import limit_steps, smallest_size, stated
from bisar_budget.report.explain.explained_navigation import navigation_steps
from bisar_budget.report.explain.explained_spreading import allowed_variance, effect_from_elsewhere
from bisar_budget.report.explain.notation import (
    Step,
    Sum,
    WorkedEquation,
    inertial_phases,
    number,
    step,
    with_unit,
)

_PHASE_SYMBOLS = ("QPE", "cubic", "left")
_PER_SENSITIVITY = "rad per s²/m"
_MOMENT_FRACTIONS = (-1.0, -0.5, 0.0, 0.5, 1.0)  # of half an aperture
_PHASE_WORDS = ("quadratic phase at the aperture edge", "cubic phase there", "residual after the cubic, rms")


def explained_random(analysis: Analysis, allocation: Allocation, error: RandomError, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for a random error, from its line in the mission file to its allowable."""
    mission, model = analysis.mission, row.model or "published"
    yield from _declared(mission, error, row)
    if error.navigation is not None:
        yield from navigation_steps(analysis, error, row.binding_requirement)
    yield from error.subject.facts.find_in(RANDOM_STEPS, error.subject.axis)(analysis, error)
    if model == "full":
        yield from _by_exact_ranges(mission, error)
    yield from _displacement(error, model)
    yield from _phases(mission, error, model)
    yield from _allowable(mission, allocation, error, row, model)


def _declared(mission: Mission, error: RandomError, row: Row) -> Iterator[Step]:
    yield from stated(mission, error.path, error.declared, row.evidence)
    if error.declared is None:
        return
    if error.biased is not None:
        yield step("Known and constant, with its sign", f"bias = {with_unit(plain(error.biased.bias), error.unit)}")
    if error.unit == "s^2/m":
        yield step(f"Per g is per {STANDARD_GRAVITY_MPS2:g} m/s²: 1 /g = {1 / STANDARD_GRAVITY_MPS2:.6g} s²/m")
    k = mission.allocation.coverage_factor
    if error.unit != "dB" and error.is_covered:
        worked = WorkedEquation(
            "declared", "k*|value|", {"k": k, "value": error.declared / k}, error.declared, error.unit
        )
        axes_words = "; of three axes the largest value" if error.kind.is_largest_of_axes else ""
        yield step(f"Coverage factor allocation.coverage_factor{axes_words}", worked)


def _inertial(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """Yield the explanation steps for an error of an inertial sensor.

    They show its effect first without and then with the lever arm of the platform.
    """
    yield from _without_lever(analysis, _without_arm(analysis, error))
    yield from _with_arm(analysis, error)


def _without_lever(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """Yield the explanation steps of the published model for an error of an inertial sensor without a lever arm.

    This model assumes that the line of sight does not change during the aperture.
    """
    mission, figure = analysis.mission, error.subject.axis
    symbol = INERTIAL_FIGURES[figure].symbol
    formulas = inertial_phases(symbol)
    unit = error.published
    wavelength, T = mission.radar.wavelength, mission.collection.aperture_time
    # The component along the line of sight follows from the published effect.
    values = {symbol: 1.0, "T": T, "λ": wavelength}
    order = next(index for index, formula in enumerate(formulas) if formula)
    along = (unit.quadratic, unit.cubic)[order] / (_unit_effect(figure, order, wavelength, T))
    component = next(name for name in ("f_u", "f_s", "u") if name in formulas[order])
    values[component] = along
    if component == "u":
        name = "the line of sight, u"
    else:
        state: PlatformState = getattr(mission.platforms, error.owner).state
        east, north, up = (with_unit(float(force) + 0.0, "m/s^2") for force in specific_force(mission, state))
        yield step("Specific force f = a − g, which accelerometers measure", f"f = [{east}, {north}, {up}]")
        name = (
            "specific force that a tilt turns into the line of sight, f_u = |u × f|"
            if component == "f_u"
            else "error of the specific force by scale factors along the line of sight, f_s"
        )
    yield step(f"Through {name}, at mid-aperture; for three values the root-sum-square of their components")
    for index, formula in enumerate(formulas):
        if formula:
            k = mission.allocation.coverage_factor if index == 2 else 1.0  # a mean power has no coverage factor
            result = float((unit.quadratic, unit.cubic, unit.spread)[index]) * k
            yield step(
                f"Derived: {_PHASE_WORDS[index]}, of one unit",
                WorkedEquation(_PHASE_SYMBOLS[index], formula, values, result, "rad"),
            )


def _without_arm(analysis: Analysis, error: RandomError) -> RandomError:
    """Return an error of an inertial sensor as it would be if its platform had no lever arm."""
    mission = analysis.mission
    platform = getattr(mission.platforms, error.owner)
    bare = platform._replace(motion_error=platform.motion_error._replace(lever_arm=None))
    platforms = mission.platforms._replace(**{error.owner: bare})
    errors = random_errors(mission._replace(platforms=platforms))
    return next(each for each in errors if each.id == error.id)


def _with_arm(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """Yield the explanation steps for a tilt error that also moves the antenna through a lever arm."""
    lever = getattr(analysis.mission.platforms, error.owner).motion_error.lever_arm
    if lever is None or lever.arm is None or not INERTIAL_FIGURES[error.subject.axis].tilts:
        return
    yield from _arm(analysis, error)
    unit = _per_unit("rad", error)
    yield step(
        "Published model: both together, the line of sight held",
        *(
            f"{symbol}/unit = {with_unit(value, unit)}"
            for symbol, value in zip(_PHASE_SYMBOLS, error.published[:3], strict=True)
            if value
        ),
    )


def _arm(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """Yield the explanation steps for a lever arm.

    They show the arm at mid-aperture, and the motion along the line of sight that one radian of tilt causes.
    """
    mission = analysis.mission
    platform = getattr(mission.platforms, error.owner)
    state, motion = platform.state, platform.motion_error
    figure = error.subject.axis
    arm = arm_at(state, motion.lever_arm.arm, np.zeros(1))[:, 0]
    tilt = INERTIAL_FIGURES[figure].tilt_formula
    yield step(
        f"The arm l at mid-aperture along the axes of the scene; a tilt swings it by {tilt} × R(τ)·l as it turns",
        f"l = [{', '.join(with_unit(float(coordinate) + 0.0, 'm') for coordinate in arm)}]",
    )
    axes, look = np.array(state.frame(motion.frame)), np.array(state.look)
    sizes = _shares_of_largest(getattr(motion.imu, figure, None))
    seen = [float(look @ np.cross(axis, arm)) * size + 0.0 for axis, size in zip(axes, sizes, strict=True)]
    values = dict(zip(("l_1", "l_2", "l_3"), seen, strict=True))
    total = math.sqrt(math.fsum(component * component for component in seen))
    worked = WorkedEquation("l_u", "sqrt(l_1^2 + l_2^2 + l_3^2)", values, total, "m per rad")
    yield step(
        "Along the line of sight, u·(ψ × l) about each axis; root-sum-square with sizes relative to the largest",
        worked,
    )


def _shares_of_largest(values: Sequence[float] | None) -> Sequence[float]:
    largest = max(values) if values is not None else 0.0
    return [value / largest for value in values] if values is not None and largest else (1.0, 1.0, 1.0)


def _lever_arm(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    if error.subject.axis == "attitude":
        yield from _arm(analysis, error)
    else:
        platform = getattr(analysis.mission.platforms, error.owner)
        axes, look = body_axes(platform.state, np.zeros(1))[:, :, 0], np.array(platform.state.look)
        sizes = _shares_of_largest(platform.motion_error.lever_arm.uncertainty)
        seen = [float(look @ axis) * size + 0.0 for axis, size in zip(axes, sizes, strict=True)]
        values = dict(zip(("u_along", "u_cross", "u_up"), seen, strict=True))
        total = math.sqrt(math.fsum(component * component for component in seen))
        worked = WorkedEquation("u_l", "sqrt(u_along^2 + u_cross^2 + u_up^2)", values, total, "")
        title = (
            "R(τ)·δl along the line of sight at mid-aperture, for each axis of the body, relative to the largest size"
        )
        yield step(title, worked)
    yield step(
        "Tables I and II: a position error that turns with the body; its quadratic and cubic part over the aperture",
        *_by_unit(error.published[:2], _per_unit("rad", error)),
    )


def _by_unit(values: Sequence[float], unit: str) -> list[str]:
    """Write one line of text for each effect of one unit of an error.

    `values` are the quadratic phase, the cubic phase and the residual beyond the cubic, in `unit`. The last value, or
    the last two values, may be missing.
    """
    return [
        f"{symbol}/unit = {with_unit(value, unit)}" for symbol, value in zip(_PHASE_SYMBOLS, values, strict=False)
    ]


def _by_exact_ranges(mission: Mission, error: RandomError) -> Iterator[Step]:
    """Yield the explanation step with the effects of one unit of an error according to the full model.

    Nothing is yielded if the published model gives the same effects.
    """
    unit, full = error.published, error.full
    if full[:3] == unit[:3]:
        return
    count = 3 if full.spread != unit.spread else 2
    factors, phases = (1.0, 1.0, _covered(mission, error)), (full.quadratic, full.cubic, full.spread)
    lines = [
        f"{symbol}/unit = {with_unit(value * factor, _per_unit('rad', error))}"
        for symbol, value, factor in zip(_PHASE_SYMBOLS[:count], phases, factors, strict=False)
        if value
    ]
    yield step(
        "Full model: the same over exact ranges, the line of sight turning, displacement of the image included",
        *lines,
    )


def _displacement(error: RandomError, model: str) -> Iterator[Step]:
    """Yield the explanation step for the displacement of the image by one unit of the error."""
    effect = error.effect(model)
    if not effect.displacement > 0:
        return
    values, unit = {"east/unit": effect.east, "north/unit": effect.north}, _per_unit("m", error)
    source = "(25)" if model == "published" else "exact ranges"
    title = f"Orders 0 and 1 displace the image, by {source}; rms length"
    yield step(
        title if error.is_covered else "In any direction: half of its square east, half of it north",
        *(f"{symbol} = {with_unit(value, unit)}" for symbol, value in values.items()),
        WorkedEquation(
            "moved/unit", "sqrt((east/unit)^2 + (north/unit)^2)", values, plain(effect.displacement), unit
        ),
    )


def _per_unit(unit: str, error: RandomError) -> str:
    """Unit of the effect of one unit of an error, such as `rad per m/s`.

    For an error stated in dB, `unit` is returned unchanged.
    """
    return unit if error.unit == "dB" else f"{unit} per {'unit' if error.unit == '1' else error.unit}"


def _unit_effect(figure: str, order: int, wavelength: float, T: float) -> float:
    """Phase caused by one unit of an inertial sensor error along the line of sight. [rad]

    `figure` is the key of the sensor error. `order` selects the quadratic phase (0), the cubic phase (1) or the
    residual beyond the cubic (2).
    """
    row = evaluators.inertial_phases(1.0, 1.0, 1.0, wavelength, T)[list(INERTIAL_FIGURES).index(figure)]
    return row[order]


def _position(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    mission = analysis.mission
    yield from _gauss_markov(
        mission,
        error,
        process_of(mission, error).correlation_time,
        "u",
        "Along the line of sight at mid-aperture, u; root-sum-square of three values",
    )


def _changing_delay(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """Yield the explanation steps for a zenith delay that changes during the aperture as a random process.

    Nothing is yielded if the delay is constant over the aperture.
    """
    correlation_time = correlation_time_of(analysis.mission, error.owner)
    if correlation_time is not None and error.published.quadratic:
        yield from _gauss_markov(
            analysis.mission,
            error,
            float(correlation_time),
            "m",
            "Along the path through the air at mid-aperture, m per zenith unit; for one air summed over both legs",
        )


def _gauss_markov(
    mission: Mission, error: RandomError, correlation_time: float, along: str, title: str
) -> Iterator[Step]:
    """Yield the explanation steps for a Gauss-Markov process: its mean squares, and its quadratic phase per unit.

    The phase is computed with the published model. `along` is the symbol of the component along the line of sight,
    or, for a delay, of the component along the signal path through the air. `title` is the title of the last step.
    """
    T, quadratic = mission.collection.aperture_time, error.published.quadratic
    yield step(
        "Half the aperture over the correlation time",
        WorkedEquation("a", "T/(2*τ_c)", {"T": T, "τ_c": correlation_time}, T / (2 * correlation_time), ""),
    )
    mean_squares = gauss_markov(T, correlation_time)
    words = ("quadratic", "cubic", "residual after the cubic", "constant", "linear")
    yield step(
        "Mean squares of a process of variance 1 with the spectrum 4·τ_c/(1 + (2πf·τ_c)²)",
        *(f"{word} = {number(float(value))}" for word, value in zip(words, mean_squares, strict=False)),
    )
    k = 2 * math.pi / mission.radar.wavelength
    values = {"λ": mission.radar.wavelength, along: quadratic / (k * math.sqrt(mean_squares.quadratic)),
              "q": mean_squares.quadratic}  # fmt: skip
    worked = WorkedEquation("QPE/unit", f"2*π*{along}*sqrt(q)/λ", values, quadratic, _per_unit("rad", error))
    yield step(title, worked)


def _oscillator(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    mission = analysis.mission
    oscillator = getattr(mission.platforms, error.owner).oscillator
    sync = mission.synchronization
    pieces = () if error.noise is None else error.noise.pieces
    spectrum = "S = f_0²·S_y(f)/f²" if oscillator.phase_noise is None else "S = 2·L(f)·(f_0/f_osc)²"
    yield step(
        f"One-sided spectrum of phase at {mission.radar.center_frequency:.6g} Hz, {spectrum} [rad²/Hz]",
        *_pieces_text(pieces),
    )
    if not error.published.quadratic:
        yield step(no_effect(mission, error))
        return
    yield from _integrals(pieces, mission, sync)
    for spur in spurs_of(mission):
        if spur.name == error.owner and spur.left.is_folded:
            yield from _slow("Spur", spur.frequency, spur.left, float(spur.free), mission, "rad")
    if sync is not None and sync.is_holdover:
        yield from _setting(pieces, mission, sync)
    k = mission.allocation.coverage_factor
    if k != 1:
        yield step(f"Phases times the coverage factor {number(k)}; the residual is a mean power and has none")


def _slow(
    kind: str, frequency: float, remaining: LeftTone, free: float, mission: Mission, unit: str
) -> Iterator[Step]:
    """Yield the explanation step for the quadratic and cubic phase of a tone below one cycle per aperture.

    If the synchronization of the clocks folds (aliases) the tone, the step uses the folded frequencies that are below
    one cycle per aperture. Both phases are combined with the phases due to noise, as a sum of squares. `free` is the
    peak phase without synchronization, in `unit`.
    """
    T = mission.collection.aperture_time
    slow = [
        f"{slow_frequency:.6g} Hz, {slow_frequency * T:.3g} cycles per aperture: "
        f"{number(float(share))} of the amplitude"
        for slow_frequency, share in zip(remaining.frequencies, remaining.shares, strict=True)
        if slow_frequency * T < SLOWEST_ECHO_CYCLES and share > 0
    ]
    if slow:
        phase_squares = remaining.slow_parts(T)
        quadratic, cubic = (
            free * math.sqrt(float(square)) for square in (phase_squares.quadratic, phase_squares.cubic)
        )
        fold_words = "folded by straight lines" if remaining.is_folded else f"{frequency * T:.3g} cycles per aperture"
        shown = slow if remaining.is_folded else ()
        title = f"{kind} at {frequency:.6g} Hz, {fold_words}, in its worst phase"
        yield step(title, *shown, *_by_unit((quadratic, cubic), unit))


def _pieces_text(pieces: Sequence[PowerLawPiece]) -> list[str]:
    return [
        f"{piece.low:.6g} Hz to {piece.high:.6g} Hz: {piece.density:.6g} * {_power_of_f(-piece.slope)}"
        for piece in pieces
    ]


def _power_of_f(exponent: float) -> str:
    """Text for a power of the frequency f, such as `f^2`.

    A negative exponent is put in brackets, so that its sign is not read as a subtraction.
    """
    exponent = exponent or 0.0  # white noise has the power −0.0
    return f"f^{exponent:.6g}" if exponent >= 0 else f"f^(\u2212{-exponent:.6g})"


def _setting(pieces: Sequence[PowerLawPiece], mission: Mission, sync: Synchronization) -> Iterator[Step]:
    """Yield the explanation step for the drift of a clock since it was last set.

    The step shows the standard deviation of the constant range error [m] and of the linear range error [m/s], and the
    correlation of both errors.
    """
    T, age, averaging = (
        np.array([value or 0.0]) for value in (mission.collection.aperture_time, sync.age, sync.averaging)
    )
    orders = set_parts(pieces, T, age, averaging)
    per_phase = mission.radar.wavelength / (2 * math.pi)
    c_0, c_1 = (
        per_phase * math.sqrt(plain(orders.constant)),
        per_phase * math.sqrt(plain(orders.linear)) * 2 / float(T[0]),
    )
    correlation = (
        plain(orders.constant_linear) / math.sqrt(plain(orders.constant) * plain(orders.linear)) if c_0 else 0.0
    )
    yield step(
        "Orders 0 and 1 of a tone that are left of a clock set by a line: ∫ S·(λ/2π)²·A_m·A_n* df of each pair",
        "A₀ = j₀(πfT) − e^(−2πifH)·[j₀(πft_c) + H·(6i/t_c)·j₁(πft_c)]",
        "A₁ = (6i/T)·j₁(πfT) − e^(−2πifH)·(6i/t_c)·j₁(πft_c)",
        f"H = {with_unit(float(age[0]), 's')}",
        f"t_c = {with_unit(float(averaging[0]), 's')}",
        f"σ(c₀) = {with_unit(c_0, 'm')}",
        f"σ(c₁) = {with_unit(c_1, 'm/s')}",
        f"correlation = {number(correlation)}",
    )


def _integrals(
    pieces: Sequence[PowerLawPiece], mission: Mission, sync: Synchronization | None, unit: str = "rad"
) -> Iterator[Step]:
    """Yield the explanation steps that integrate each piece of a spectrum.

    The integrals give the quadratic phase, the cubic phase and the residual.
    """
    T, interval = mission.collection.aperture_time, None if sync is None else sync.interval
    if sync is not None and sync.is_direct_path:
        geometry, delay = mission.geometry, mission.geometry.echo_delay
        ways = [float(path.slant_range) for path in (*geometry.both, geometry.apart)]
        piece_parts, density = [heard_parts((piece,), T, delay) for piece in pieces], "S_left"
        values = dict(zip(("R_t", "R_r", "b"), ways, strict=True)) | {"c": SPEED_OF_LIGHT_MPS}
        yield step(
            "Heard over the baseline b, and a delay Δt later by the echo: S_left = S·4·sin²(πf·Δt)",
            WorkedEquation("delay", "(R_t + R_r - b)/c", values, float(delay), "s"),
        )
    elif interval is None:
        piece_parts, density = [parts((piece,), T) for piece in pieces], "S"
    else:
        piece_parts, density = [synchronized_parts((piece,), T, interval) for piece in pieces], "S_left"
        yield step(
            f"Exchanges each T_s = {interval:.6g} s, straight lines between: "
            "S_left = S·(1 − sinc²(f·T_s))² + sinc⁴(f·T_s)·Σ S(|f + m/T_s|), m ≠ 0"
        )
    k = 1.0 if unit != "rad" else mission.allocation.coverage_factor  # the declared value contains it for other units
    for index, (symbol, transfer) in enumerate(
        (
            ("QPE/unit", "[7.5·j₂(πfT)]²"),
            ("cubic/unit", "[17.5·j₃(πfT)]²"),
            ("left/unit", "[1 − Σ(2n+1)·jₙ(πfT)²], n to 3"),
        )
    ):
        terms = [mean_squares[index] for mean_squares in piece_parts]
        factor = k if index < 2 else 1.0
        total = factor * math.sqrt(math.fsum(terms))
        text = " + ".join(number(float(term)) for term in terms)
        text = f"sqrt({text})" if factor == 1 else f"{number(factor)}*sqrt({text})"
        yield step(f"∫ {density}·{transfer} df of each piece", Sum(f"{symbol} = {text} = {with_unit(total, unit)}"))


def _link(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    mission, sync = analysis.mission, analysis.mission.synchronization
    if sync is None or sync.interval is None:
        yield step("Independent from pulse to pulse: all of it adds to the ISLR, no quadratic phase")
        return
    yield step(
        "Errors of the exchanges, interpolated linearly: S = 2·σ²·T_s·sinc(f·T_s)⁴, in total two thirds of σ²",
        f"T_s = {with_unit(sync.interval, 's')}",
    )
    effect = error.published
    lines = _by_unit((*effect[:2], effect.spread * mission.allocation.coverage_factor), "rad per rad")
    yield step("Integrated with the squares of 7.5·j₂(πfT), of 17.5·j₃(πfT), and 1 − Σ(2n+1)·jₙ²(πfT)", *lines)


def _spectrum_steps(vibration: Vibration | FeltVibration, spectrum: Spectrum) -> Iterator[Step]:
    """Yield the explanation steps for a spectrum of acceleration or displacement: its points and its shift in dB."""
    quantity, unit = ("acceleration", "g²/Hz") if spectrum.is_accelerated else ("displacement", "m²/Hz")
    scale = STANDARD_GRAVITY_MPS2**2 if spectrum.is_accelerated else 1.0
    points = [f"{f:.6g} Hz: {density / scale:.6g} {unit}" for f, density in spectrum.points]
    yield step(f"One-sided spectrum of {quantity}, straight over logarithms, zero outside its points", *points)
    if vibration.spectrum_level:
        power = float(power_of(vibration))
        worked = WorkedEquation("p", "10^(L/10)", {"L": vibration.spectrum_level}, power, "")
        yield step("Shifted by spectrum_level, a factor of power", worked)


def _spectrum(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    mission, name = analysis.mission, error.owner
    vibration: Vibration = getattr(mission.platforms, name).motion_error.vibration
    spectrum = vibration.spectrum
    if spectrum is None:
        return
    yield from _spectrum_steps(vibration, spectrum)
    rms = displacement_rms(spectrum, float(power_of(vibration)))
    yield step(
        "Root mean square of the displacement, S_x = S_a/(2πf)^4, all frequencies",
        f"x = {with_unit(rms, 'm')}",
        WorkedEquation(
            "φ",
            "2*π*x/λ",
            {"x": rms, "λ": mission.radar.wavelength},
            2 * math.pi * rms / mission.radar.wavelength,
            "rad",
        ),
    )
    along = float(counted(mission, name, 1.0, "islr"))
    if along != 1:
        yield step(f"Fraction in the range less the direct path: {number(along)}")
    pieces = pieces_of_vibration(mission, name)
    yield step(
        "One-sided spectrum of phase along the line of sight, one way, S = S_x·(2π/λ)² [rad²/Hz]",
        *_pieces_text(pieces),
    )
    if not error.published.spread and not error.published.quadratic:
        yield step(no_effect(mission, error))
        return
    yield from _integrals(pieces, mission, None)


def _acceleration(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """Yield the explanation steps for the error of an oscillator under acceleration.

    The acceleration comes from random vibration, slow tones or the turn of a platform.
    """
    mission, name = analysis.mission, error.owner
    f_0, sync = mission.radar.center_frequency, mission.synchronization
    felt_vibration = felt(mission, name)
    if felt_vibration is None or not any(error.published[:3]):
        if not lacks_a_spectrum(mission, name):
            yield step(no_effect(mission, error))
        return
    yield step("Fractional frequency y = Γ·a, with Γ and the acceleration as they point at their worst")
    pieces = pieces_by_acceleration(mission, name)
    if pieces and felt_vibration.vibration.spectrum is not None:
        yield from _spectrum_steps(felt_vibration.vibration, felt_vibration.vibration.spectrum)
        yield step(
            f"One-sided spectrum of phase at {f_0:.6g} Hz by a unit of Γ, S = (f_0/f)²·S_a [rad²/Hz]",
            *_pieces_text(pieces),
        )
        yield from _integrals(pieces, mission, sync, _PER_SENSITIVITY)
    for line in accelerated_tones(mission):
        if line.name == name:
            yield from _slow(
                "Vibration", float(line.frequency), line.left, float(line.free), mission, _PER_SENSITIVITY
            )
    if np.any(flies_a_turn(mission, name)):
        state: PlatformState = getattr(mission.platforms, name).state
        acceleration = float(np.linalg.norm(plain_vector(state.acceleration)))
        values = {"c": SPEED_OF_LIGHT_MPS, "a": acceleration}
        yield step(
            "Turn: the range error is c·Γ·(v(τ) − v(0)); the acceleration at mid-aperture is a frequency, which "
            "displaces, and its change bends. Of three axes the root-sum-square is the most that a Γ does",
            WorkedEquation("drift/unit", "c*a", values, SPEED_OF_LIGHT_MPS * acceleration, "m/s per s²/m"),
        )
    spread_per_unit = error.published.spread * mission.allocation.coverage_factor
    yield step(
        "Together, by a unit of Γ: independent parts add as squares",
        *_by_unit((*error.published[:2], spread_per_unit), _PER_SENSITIVITY),
    )


def _delays(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """Yield the explanation steps for an atmospheric delay.

    They show the delay for each platform whose signal it affects, and its change over the aperture.
    """
    for name in legs_of(error.owner):
        yield from _delay_on_a_leg(analysis, error, name)
    if error.owner not in PLATFORMS:
        yield step("One air over both legs: their range errors add, with their signs, before anything is squared")
    yield from _changing_delay(analysis, error)


def _delay_on_a_leg(analysis: Analysis, error: RandomError, name: str) -> Iterator[Step]:
    """Yield the explanation steps that derive the delay for platform `name` from one unit of zenith delay.

    The delay of the signal is shown at several times during the aperture.
    """
    mission, delay = analysis.mission, error.subject.axis
    path: PlatformState = getattr(analysis.geometry, name)
    (x, y, z), height = plain_vector(path.position), float(height_of(path.position))
    if delay == CONTENT and height < AIR_TOP_M:
        yield step(f"The {name} flies at {height:.6g} m, below the ionosphere: no electrons on its leg")
        return
    values = {"R": float(path.slant_range), "z": z}
    if height < AIR_TOP_M:
        title, formula = "Within the air, over a flat Earth: 1 over the sine of the elevation", "R/z"
    else:
        shell = TROPOSPHERE_HEIGHT_M if delay == DELAY else min(IONOSPHERE_HEIGHT_M, height)
        values = {"p": (x * x + y * y) ** 0.5, "R": float(path.slant_range), "h": shell, "R_E": EARTH_RADIUS_M}
        title = "Above the air, through a spherical shell at height h; p is the distance along the ground's plane"
        formula = "1/sqrt(1 - (p/R)^2/(1 + h/R_E)^2)"
    factor = float(leg_factor(delay, path.position, path.position))
    yield step(f"{title}; at mid-aperture", WorkedEquation("m", formula, values, factor, ""))
    scale = float(metres_per_unit(mission, delay))
    if delay == CONTENT:
        values = {"m": factor, "f_0": mission.radar.center_frequency}
        worked = WorkedEquation("g", f"{ELECTRON_DELAY_M3_PER_S2:g}*m/f_0^2", values, factor * scale, "m per 1/m^2")
        yield step("Group delay by a unit; the phase at the centre frequency is advanced by as much", worked)
    half = mission.collection.aperture_time / 2
    times = [half * moment for moment in _MOMENT_FRACTIONS]
    yield step(
        f"Delay on the leg of the {name} by a unit as the elevation changes over the aperture",
        *(
            f"{time:+.6g} s: {with_unit(float(group_delay(mission, path, delay, time)), _per_unit('m', error))}"
            for time in times
        ),
    )
    if delay == CONTENT:
        yield step(
            "Range error in the image: its constant part is that of the group, ḡ; its slope and what bends are those "
            "of the phase, which has the other sign: 2·ḡ − g"
        )


def _from_elsewhere(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """Yield the explanation step for an error of which the file states only the effect on the image."""
    yield effect_from_elsewhere()


def _nothing_more(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """Yield no step: `navigation_steps` explains an aided navigation."""
    yield from ()


RANDOM_STEPS: Mapping[str, Callable[[Analysis, RandomError], Iterator[Step]]] = {
    "imu": _inertial,
    "lever_arm": _lever_arm,
    "random": _position,
    "trajectory": _position,
    "vibration": _spectrum,
    "oscillator": _oscillator,
    "oscillator.acceleration": _acceleration,
    "propagation": _delays,
    "synchronization": _link,
    "navigation": _nothing_more,
    "other": _from_elsewhere,
}


def _phases(mission: Mission, error: RandomError, model: str) -> Iterator[Step]:
    if error.declared is None:
        return
    other_model = "full" if model == "published" else "published"
    is_equal = error.published[:5] == error.full[:5] and not error.full.hidden
    is_spread_equal = error.published.spread == error.full.spread
    for name in (model,) if is_equal else (model, other_model):
        effect, k = error.effect(name), _covered(mission, error)
        mark = "_full" if name == "full" and not is_equal else ""
        lines: list[WorkedEquation] = []
        for symbol, per_unit in zip(_PHASE_SYMBOLS, effect[:3], strict=True):
            if not per_unit or (symbol == "left" and is_spread_equal and name != model):
                continue
            result = per_unit * error.declared
            values, formula = {f"{symbol}/unit": per_unit, "declared": error.declared}, f"{symbol}/unit*declared"
            if symbol == "left" and k != 1:  # a mean power has no coverage factor
                values |= {"left/unit": per_unit * k, "k": k}
                formula += "/k"
            marked = symbol if symbol == "left" and is_spread_equal else f"{symbol}{mark}"
            lines.append(WorkedEquation(marked, formula, values, result, "rad"))
            if symbol == "QPE" and is_equal:
                lines.append(WorkedEquation("QPE_full", "QPE", {"QPE": result}, result, "rad"))
        if effect.hidden:
            hidden, qpe = effect.hidden * error.declared, effect.quadratic * error.declared
            values = {"hidden/unit": effect.hidden, "declared": error.declared}
            lines.append(WorkedEquation("hidden", "hidden/unit*declared", values, hidden, "rad"))
            values = {"QPE": qpe, "hidden": hidden}
            lines.append(
                WorkedEquation("equal_full", "sqrt(QPE^2 + hidden^2)", values, math.hypot(qpe, hidden), "rad")
            )
        model_words = "both models" if is_equal else f"the {name} model{'' if name == model else ', for comparison'}"
        if effect.displacement > 0:
            values = {"moved/unit": effect.displacement, "declared": error.declared}
            result = effect.displacement * error.declared
            lines.append(WorkedEquation(f"moved{mark}", "moved/unit*declared", values, result, "m"))
        if lines:
            yield step(f"For the declared size, by {model_words}", *lines)


def _covered(mission: Mission, error: RandomError) -> float:
    """Coverage factor that is included in the declared value of an error.

    For an error in dB, such as the noise of an oscillator, the result is 1, because the phases of such an error
    already include the coverage factor.
    """
    return 1.0 if error.unit == "dB" else float(error.coverage(mission))


def _allowable(mission: Mission, allocation: Allocation, error: RandomError, row: Row, model: str) -> Iterator[Step]:
    if row.reason is not None and row.reason.code == "wideband-has-no-spectrum":
        yield step("Allowable: not known", row.reason)
        return
    effect, confidence_of = error.effect(model), mission.requirements.confidence_of
    judged = error.judged_effect(model, confidence_of, allocation.autofocus_gain)._replace(covariance=None).of(0)
    limited = held_effect(mission, effect, error.coverage(mission), allocation.autofocus_gain, judged)
    limit = allocation.qpe_allowed(error.owner)
    if error.is_covered:  # an error stated by its effect on the image has no quadratic phase
        yield from limit_steps(allocation, error.owner, limit)
    sizes: dict[str, float] = {}
    required = mission.requirements

    def with_bias(requirement: str, symbol: str, allowed: float) -> Iterator[Step]:
        """Yield the steps for an error with a bias, which changes the size at the limit and the quantile."""
        biased = BiasedEffect.of(mission, error, model, requirement, allocation.autofocus_gain)
        if biased.is_felt:
            yield from biased.judged_steps(symbol)
            yield from biased.allowable_steps(allowed, symbol, _unit(error))
            if (size := biased.allowable(allowed)) is not None:
                sizes[f"by_{biased.symbol}"] = size

    has_bias = error.biased is not None and error.declared is not None

    def by(name: str, symbol: str, allowed: float, per_unit: float, title: str) -> Step:
        sizes[name] = allowed / per_unit
        values = {"limit": allowed, symbol: per_unit}
        return step(title, WorkedEquation(name, f"limit/({symbol})", values, sizes[name], _unit(error)))

    symbol, rms_phase = "QPE/unit", plain(effect.judged(allocation.autofocus_gain))
    if effect.hidden:
        symbol, gain = "judged/unit", allocation.autofocus_gain
        values = {"QPE/unit": effect.quadratic, "hidden/unit": effect.hidden, "gain": gain}
        worked = WorkedEquation(
            symbol, "sqrt((QPE/unit)^2 + (gain*hidden/unit)^2)", values, rms_phase, f"rad{_per(error)}"
        )
        yield step("With the hidden phase, which autofocus does not correct", worked)
    if has_bias:
        yield from with_bias(QUADRATIC, symbol, limit)
    elif limited.quadratic:
        if (confidence := error.is_covered and confidence_of(QUADRATIC)) and rms_phase:
            unit = f"rad{_per(error)}"
            yield quantile_step("quantile/unit", symbol, rms_phase, plain(limited.quadratic), unit, confidence)
            symbol = "quantile/unit"
        yield by("by_QPE", symbol, limit, limited.quadratic, "Allowable by the quadratic phase")
    if has_bias and required.cubic_phase_error is not None:
        yield from with_bias(CUBIC, "cubic/unit", required.cubic_phase_error)
    elif effect.cubic and required.cubic_phase_error is not None:
        title = f"Allowable by requirements.{CUBIC}, without share and gain"
        symbol = "cubic/unit"
        if confidence := error.is_covered and confidence_of(CUBIC):
            unit = f"rad{_per(error)}"
            yield quantile_step("quantile/unit", symbol, plain(effect.cubic), plain(judged.cubic), unit, confidence)
            symbol = "quantile/unit"
        yield by("by_cubic", symbol, required.cubic_phase_error, plain(judged.cubic), title)
    if limited.spread and required.islr is not None:
        spread = "left/unit"
        if limited.spread != effect.spread:
            spread = "spread/unit"
            yield from _with_cubic(mission, error, effect, limited)
        power, share = 10 ** (required.islr / 10), allocation.islr.of(error.owner)
        energy = mainlobe_energy(mission)
        rule, values = allowed_variance(model, power, energy)
        rms = _allowed_rms(mission, allocation, error, model, required.islr)
        worked = WorkedEquation("rms", f"sqrt({rule})*sqrt(s)", {**values, "s": share}, rms, "rad")
        yield step(f"Residual phase allowed, requirements.islr {required.islr:g} dB, share s of its power", worked)
        sizes["by_ISLR"] = rms / limited.spread
        k = _covered(mission, error)
        values = {"rms": rms, spread: limited.spread * k, "k": k}
        formula = f"rms/({spread})" if k == 1 else f"k*rms/({spread})"
        worked = WorkedEquation("by_ISLR", formula, values, sizes["by_ISLR"], _unit(error))
        yield step("Allowable by requirements.islr", worked)
    if has_bias and required.location_error is not None:
        yield from with_bias(LOCATION, "moved/unit", required.location_error)
    elif effect.displacement > 0 and required.location_error is not None:
        title = f"Allowable by requirements.{LOCATION}, without share and gain"
        symbol, rms_move, moved = "moved/unit", plain(effect.displacement), plain(judged.displacement)
        if confidence := error.is_covered and confidence_of(LOCATION):
            yield quantile_step("quantile/unit", symbol, rms_move, moved, f"m{_per(error)}", confidence)
            symbol = "quantile/unit"
        yield by("by_location", symbol, required.location_error, moved, title)
    yield from smallest_size(row, sizes)


def _allowed_rms(mission: Mission, allocation: Allocation, error: RandomError, model: str, islr: float) -> float:
    """Residual rms phase that an error may cause under a required ISLR, by its share of the power. [rad]"""
    share = allocation.islr.of(error.owner)
    return float(spread_phase(10 ** (islr / 10), model, mainlobe_energy(mission)) * math.sqrt(share))


def biased_random_use(analysis: Analysis, error: RandomError, row: Row) -> Step:
    """Return the explanation step for the utilization of a random error with a bias, from its judged effects."""
    mission, allocation, model = analysis.mission, analysis.allocation, row.model or "published"
    required, terms = mission.requirements, list[str]()
    limits = (allocation.qpe_allowed(error.owner), required.cubic_phase_error, required.location_error)
    for requirement, limit in zip((QUADRATIC, CUBIC, LOCATION), limits, strict=True):
        if limit is not None:
            biased = BiasedEffect.of(mission, error, model, requirement, allocation.autofocus_gain)
            if biased.is_felt:
                terms.append(f"{number(biased.judged)}/{number(limit)}")
    limited = held_effect(mission, error.effect(model), error.coverage(mission))
    if limited.spread and required.islr is not None:  # a power without the bias
        by_islr = _allowed_rms(mission, allocation, error, model, required.islr) / limited.spread
        terms.append(f"{number(plain(error.declared))}/{number(by_islr)}")
    text = f"max({', '.join(terms)})" if len(terms) > 1 else "".join(terms) or "0"
    line = Sum(f"utilization = {text} = {number(row.utilization or 0.0)}")
    return step("Utilization, the largest judged effect / limit", line)


def _with_cubic(mission: Mission, error: RandomError, effect: RandomEffect, limited: RandomEffect) -> Iterator[Step]:
    """Yield the explanation step that adds the power of the cubic phase to the power of the phase beyond it.

    The step is needed if the mission has no requirement on the cubic phase, so that the ISLR limits both phases.
    """
    k, factor = _covered(mission, error), float(error.coverage(mission))
    values = {"cubic/unit": effect.cubic, "left/unit": effect.spread * k, "k": factor}
    # The residual is per sigma; the cubic phase contains the coverage factor unless the declared value does.
    formula = "4*(cubic/unit)^2/175" if k == factor else "4*(cubic/unit/k)^2/175"
    formula = f"sqrt((left/unit)^2 + {formula})" if effect.spread else f"sqrt({formula})"
    worked = WorkedEquation(
        "spread/unit", formula, values, limited.spread * k, f"rad{f' per {_unit(error)}' * bool(_unit(error))}"
    )
    title = "No requirements.cubic_phase_error: ISLR holds the power of the cubic phase too, without coverage factor"
    yield step(title, worked)


def _unit(error: RandomError) -> str:
    return "" if error.unit == "dB" else error.unit


def _per(error: RandomError) -> str:
    """End of the unit of an effect of one unit of an error; empty for a level in dB."""
    return f" per {error.unit}" if _unit(error) else ""
