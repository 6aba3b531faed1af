"""How a sensor, a clock or the air comes to its phases: figures, line of sight, spectra and integrals."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.spread import Tone, declared_powers, mainlobe_energy, spread_phase, tones
from bisar_budget.analysis.vibration_limits import (
    LARGEST_ECHO,
    Echo,
    bessel,
    highest_echo,
    quadratures,
    tone_limits,
)
from bisar_budget.budget.random_rows import held_effect, no_effect
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.declared import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.effect import subject
from bisar_budget.effects.navigation_errors import TILTS, arm_at, body_axes, process_of, specific_force
from bisar_budget.effects.oscillators import spurs_of
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
from bisar_budget.faults import printable
from bisar_budget.findings.row import Row
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.instruments import Synchronization
from bisar_budget.mission.model import Mission
from bisar_budget.report.explain.explained_air import delay_on_a_leg, effect_from_elsewhere
from bisar_budget.report.explain.explained_error import combined, limit_steps, place, smallest_size, stated
from bisar_budget.report.explain.notation import (
    Step,
    Sum,
    WorkedEquation,
    equation,
    inertial_phases,
    number,
    step,
    with_unit,
)

_SYMBOLS = {
    "accelerometer_bias": "b",
    "accelerometer_scale_factor": "κ",
    "attitude": "ψ",
    "gyro_bias": "ε",
    "velocity_random_walk": "N",
    "angle_random_walk": "N_g",
}
_PARTS = ("QPE", "cubic", "left")
_WHAT = ("quadratic phase at the aperture edge", "cubic phase there", "what is left after the cubic, rms")


def explained_random(analysis: Analysis, allocation: Allocation, error: RandomError, row: Row) -> Iterator[Step]:
    """From the line of the file to the allowable."""
    mission, kind = analysis.mission, error.subject.kind
    model = row.model or "published"
    yield from _declared(mission, error, row)
    if kind == "imu":
        yield from _imu(analysis, _without_arm(analysis, error))
        yield from _with_arm(analysis, error)
    elif kind == "lever_arm":
        yield from _lever_arm(analysis, error)
    elif kind == "random":
        yield from _position(analysis, error)
    elif kind == "vibration" or error.subject.axis == "acceleration":
        from bisar_budget.report.explain.explained_shaking import explained_shaking

        yield from explained_shaking(mission, error)
    elif kind == "oscillator":
        yield from _oscillator(mission, error)
    elif kind == "propagation":
        yield from delay_on_a_leg(analysis, error)
    elif kind == "other":
        yield from effect_from_elsewhere()
    else:
        yield from _link(mission, error)
    if model == "full":
        yield from _by_exact_ranges(mission, error)
    yield from _moved(error, model)
    yield from _phases(mission, error, model)
    yield from _allowable(mission, allocation, error, row, model)


def _declared(mission: Mission, error: RandomError, row: Row) -> Iterator[Step]:
    yield from stated(mission, error.path, error.declared, row.evidence)
    if error.declared is None:
        return
    k = mission.allocation.coverage_factor
    if error.unit != "dB" and error.is_covered:
        lines = equation("declared", "k*|value|", {"k": k, "value": error.declared / k}, error.declared, error.unit)
        of_axes = "; of three axes the largest value" if error.subject.kind in ("imu", "random") else ""
        yield from step(f"Coverage factor allocation.coverage_factor{of_axes}", *lines)


def _imu(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """The formulas of an inertial sensor with the line of sight at mid-aperture."""
    mission, kind = analysis.mission, error.subject.axis
    symbol = _SYMBOLS[kind]
    formulas = inertial_phases(symbol)
    unit = error.published
    wavelength, T = mission.radar.wavelength, mission.collection.aperture_time
    # The part along the line of sight is what the published effect has of it.
    values = {symbol: 1.0, "T": T, "λ": wavelength}
    which = next(index for index, formula in enumerate(formulas) if formula)
    along = (unit.quadratic, unit.cubic)[which] / (_of_one(kind, which, wavelength, T))
    part = next(one for one in ("f_u", "f_s", "u") if one in formulas[which])
    values[part] = along
    if part == "u":
        name = "the line of sight, u"
    else:
        state: PlatformState = getattr(mission.platforms, error.owner).state
        east, north, up = (with_unit(one + 0.0, "m/s^2") for one in specific_force(mission, state))
        yield from step("Specific force f = a − g, which accelerometers measure", f"f = [{east}, {north}, {up}]")
        name = (
            "what a tilt turns of it into the line of sight, f_u = |u × f|"
            if part == "f_u"
            else "what scale factors have of it along the line of sight, f_s"
        )
    yield from step(f"Through {name}, at mid-aperture; of three values the root-sum-square of what each has")
    for index, formula in enumerate(formulas):
        if formula:
            k = mission.allocation.coverage_factor if index == 2 else 1.0  # a mean power has no coverage factor
            result = unit[index] * k
            yield from step(
                f"Derived: {_WHAT[index]}, of one unit", *equation(_PARTS[index], formula, values, result, "rad")
            )


def _without_arm(analysis: Analysis, error: RandomError) -> RandomError:
    """The same figure of an inertial sensor of which no arm swings."""
    mission = analysis.mission
    platform = getattr(mission.platforms, error.owner)
    bare = platform._replace(motion_error=platform.motion_error._replace(lever_arm=None))
    platforms = mission.platforms._replace(**{error.owner: bare})
    found = random_errors(mission._replace(platforms=platforms))
    return next(one for one in found if one.id == error.id)


def _with_arm(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """What a tilt does through the lever arm too."""
    lever = getattr(analysis.mission.platforms, error.owner).motion_error.lever_arm
    if lever is None or lever.arm is None or error.subject.axis not in TILTS:
        return
    yield from _arm(analysis, error)
    unit = _per_unit("rad", error)
    yield from step(
        "Published model: both together, the line of sight held",
        *(
            f"{part}/unit = {with_unit(value, unit)}"
            for part, value in zip(_PARTS, error.published[:3], strict=True)
            if value
        ),
    )


_GROWS = {"attitude": "ψ", "gyro_bias": "ε·τ", "angle_random_walk": "N_g·W(τ)"}


def _arm(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    """The arm at mid-aperture, and how far a tilt swings it along the line of sight."""
    mission = analysis.mission
    platform = getattr(mission.platforms, error.owner)
    state, motion = platform.state, platform.motion_error
    figure = error.subject.axis
    arm = arm_at(state, motion.lever_arm.arm, np.zeros(1))[:, 0]
    tilt = _GROWS[figure]
    yield from step(
        f"The arm l at mid-aperture along the axes of the scene; a tilt swings it by {tilt} × R(τ)·l as it turns",
        f"l = [{', '.join(with_unit(float(part) + 0.0, 'm') for part in arm)}]",
    )
    axes, look = np.array(state.frame(motion.frame)), np.array(state.look)
    sizes = _shares_of_largest(getattr(motion.imu, figure, None))
    seen = [float(look @ np.cross(axis, arm)) * size + 0.0 for axis, size in zip(axes, sizes, strict=True)]
    values = dict(zip(("l_1", "l_2", "l_3"), seen, strict=True))
    total = math.sqrt(math.fsum(one * one for one in seen))
    lines = equation("l_u", "sqrt(l_1^2 + l_2^2 + l_3^2)", values, total, "m per rad")
    yield from step(
        "Along the line of sight, u·(ψ × l) about each axis, and of all at their sizes over the largest", *lines
    )


def _shares_of_largest(values: Sequence[float] | None) -> Sequence[float]:
    largest = max(values) if values is not None else 0.0
    return [one / largest for one in values] if values is not None and largest else (1.0, 1.0, 1.0)


def _lever_arm(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    if error.subject.axis == "attitude":
        yield from _arm(analysis, error)
    else:
        platform = getattr(analysis.mission.platforms, error.owner)
        axes, look = body_axes(platform.state, np.zeros(1))[:, :, 0], np.array(platform.state.look)
        sizes = _shares_of_largest(platform.motion_error.lever_arm.uncertainty)
        seen = [float(look @ axis) * size + 0.0 for axis, size in zip(axes, sizes, strict=True)]
        values = dict(zip(("u_along", "u_cross", "u_up"), seen, strict=True))
        total = math.sqrt(math.fsum(one * one for one in seen))
        lines = equation("u_l", "sqrt(u_along^2 + u_cross^2 + u_up^2)", values, total, "")
        title = (
            "R(τ)·δl along the line of sight at mid-aperture: of each axis of the body, at its size over the largest"
        )
        yield from step(title, *lines)
    rate = (
        "Tables I and II: a position error that turns with the body; its quadratic and cubic part over the aperture"
    )
    unit = _per_unit("rad", error)
    yield from step(
        rate,
        *(
            f"{part}/unit = {with_unit(value, unit)}"
            for part, value in zip(_PARTS[:2], error.published[:2], strict=True)
        ),
    )


def _by_exact_ranges(mission: Mission, error: RandomError) -> Iterator[Step]:
    """What the full model makes of a unit, where that differs."""
    unit, full = error.published, error.full
    if full[:3] == unit[:3]:
        return
    # What is left turns with the line of sight of mid-aperture; only a direct path changes it.
    count = 3 if full.spread != unit.spread else 2
    factors = (1.0, 1.0, _covered(mission, error))
    lines = [
        f"{part}/unit = {with_unit(value * factor, _per_unit('rad', error))}"
        for part, value, factor in zip(_PARTS[:count], full[:count], factors, strict=False)
        if value
    ]
    yield from step(
        "Full model: the same over exact ranges, the line of sight turning, displacement of the image included",
        *lines,
    )


def _moved(error: RandomError, model: str) -> Iterator[Step]:
    """The displacement by a unit."""
    effect = error.effect(model)
    if not effect.displacement > 0:
        return
    values, unit = {"east/unit": effect.east, "north/unit": effect.north}, _per_unit("m", error)
    by = "(25)" if model == "published" else "exact ranges"
    title = f"Orders 0 and 1 displace the image, by {by}; rms length"
    yield from step(
        title if error.is_covered else "In whatever direction: half of its square east, half of it north",
        *(f"{symbol} = {with_unit(value, unit)}" for symbol, value in values.items()),
        *equation("moved/unit", "sqrt((east/unit)^2 + (north/unit)^2)", values, effect.displacement, unit),
    )


def _per_unit(unit: str, error: RandomError) -> str:
    """The unit of what a unit of an error does; one of an oscillator is its noise as declared."""
    return unit if error.unit == "dB" else f"{unit} per {'unit' if error.unit == '1' else error.unit}"


def _of_one(kind: str, which: int, wavelength: float, T: float) -> float:
    """Effect of one unit along a whole line of sight."""
    from bisar_budget import evaluators

    row = evaluators.inertial_phases(1.0, 1.0, 1.0, wavelength, T)[list(_SYMBOLS).index(kind)]
    return row[which]


def _position(analysis: Analysis, error: RandomError) -> Iterator[Step]:
    mission, effect = analysis.mission, error.published
    process = process_of(mission, error)
    T, tau = mission.collection.aperture_time, process.correlation_time
    yield from step(
        "Half the aperture over the correlation time",
        *equation("a", "T/(2*τ_c)", {"T": T, "τ_c": tau}, T / (2 * tau), ""),
    )
    found = gauss_markov(T, tau)
    words = ("quadratic", "cubic", "left after the cubic", "constant", "linear")
    yield from step(
        "Mean squares of a process of variance 1 with the spectrum 4·τ_c/(1 + (2πf·τ_c)²)",
        *(f"{word} = {number(value)}" for word, value in zip(words, found, strict=False)),
    )
    k = 2 * math.pi / mission.radar.wavelength
    values = {"λ": mission.radar.wavelength, "u": effect.quadratic / (k * math.sqrt(found.quadratic)),
              "q": found.quadratic}  # fmt: skip
    lines = equation("QPE/unit", "2*π*u*sqrt(q)/λ", values, effect.quadratic, "rad per m")
    yield from step("Along the line of sight at mid-aperture, u; of three values the root-sum-square of each", *lines)


def _oscillator(mission: Mission, error: RandomError) -> Iterator[Step]:
    oscillator = getattr(mission.platforms, error.owner).oscillator
    sync = mission.synchronization
    pieces = () if error.noise is None else error.noise.pieces
    spectrum = "S = f_0²·S_y(f)/f²" if oscillator.phase_noise is None else "S = 2·L(f)·(f_0/f_osc)²"
    yield from step(
        f"One-sided spectrum of phase at {mission.radar.center_frequency:.6g} Hz, {spectrum} [rad²/Hz]",
        *(
            f"{piece.low:.6g} Hz to {piece.high:.6g} Hz: {piece.density:.6g} * f^-{piece.slope:.6g}"
            for piece in pieces
        ),
    )
    if not error.published.quadratic:
        yield Step(no_effect(mission, error))
        return
    yield from integrals(pieces, mission, sync)
    if sync is not None and sync.is_holdover:
        yield from _setting(pieces, mission, sync)
    k = mission.allocation.coverage_factor
    if k != 1:
        yield from step(f"Phases times the coverage factor {number(k)}; what is left is a mean power and has none")


def _setting(pieces: Sequence[PowerLawPiece], mission: Mission, sync: Synchronization) -> Iterator[Step]:
    """What has come since a clock was set: orders 0 and 1 of its range error, at the radar's centre frequency."""
    T, age, averaging = (
        np.array([one or 0.0]) for one in (mission.collection.aperture_time, sync.age, sync.averaging)
    )
    found = set_parts(pieces, T, age, averaging)
    per_phase = mission.radar.wavelength / (2 * math.pi)
    c_0, c_1 = per_phase * math.sqrt(found.constant[0]), per_phase * math.sqrt(found.linear[0]) * 2 / float(T[0])
    known = float(found.constant_linear[0] / math.sqrt(found.constant[0] * found.linear[0])) if c_0 else 0.0
    yield from step(
        "Orders 0 and 1 of a tone that are left of a clock set by a line: ∫ S·(λ/2π)²·A_m·A_n* df of each pair",
        "A₀ = j₀(πfT) − e^(−2πifH)·[j₀(πft_c) + H·(6i/t_c)·j₁(πft_c)]",
        "A₁ = (6i/T)·j₁(πfT) − e^(−2πifH)·(6i/t_c)·j₁(πft_c)",
        f"H = {with_unit(float(age[0]), 's')}",
        f"t_c = {with_unit(float(averaging[0]), 's')}",
        f"σ(c₀) = {with_unit(c_0, 'm')}",
        f"σ(c₁) = {with_unit(c_1, 'm/s')}",
        f"correlation = {number(known)}",
    )


def integrals(
    pieces: Sequence[PowerLawPiece], mission: Mission, sync: Synchronization | None, unit: str = "rad"
) -> Iterator[Step]:
    """The parts that each piece of a spectrum adds to the mean squares."""
    T, interval = mission.collection.aperture_time, None if sync is None else sync.interval
    if sync is not None and sync.is_direct_path:
        geometry, delay = mission.geometry, mission.geometry.echo_delay
        ways = [float(path.slant_range) for path in (*geometry.both, geometry.apart)]
        each, density = [heard_parts((piece,), T, delay) for piece in pieces], "S_left"
        values = dict(zip(("R_t", "R_r", "b"), ways, strict=True)) | {"c": SPEED_OF_LIGHT}
        yield from step(
            "Heard over the baseline b, and a delay Δt later by the echo: S_left = S·4·sin²(πf·Δt)",
            *equation("delay", "(R_t + R_r - b)/c", values, delay, "s"),
        )
    elif interval is None:
        each, density = [parts((piece,), T) for piece in pieces], "S"
    else:
        each, density = [synchronized_parts((piece,), T, interval) for piece in pieces], "S_left"
        yield from step(
            f"Exchanges each T_s = {interval:.6g} s, straight lines between: "
            "S_left = S·(1 − sinc²(f·T_s))² + sinc⁴(f·T_s)·Σ S(|f + m/T_s|), m ≠ 0"
        )
    k = 1.0 if unit != "rad" else mission.allocation.coverage_factor  # else it is in what is declared
    for index, (symbol, transfer) in enumerate(
        (
            ("QPE/unit", "[7.5·j₂(πfT)]²"),
            ("cubic/unit", "[17.5·j₃(πfT)]²"),
            ("left/unit", "[1 − Σ(2n+1)·jₙ(πfT)²], n to 3"),
        )
    ):
        terms = [one[index] for one in each]
        factor = k if index < 2 else 1.0
        total = factor * math.sqrt(math.fsum(terms))
        text = " + ".join(number(term) for term in terms)
        text = f"sqrt({text})" if factor == 1 else f"{number(factor)}*sqrt({text})"
        yield from step(
            f"∫ {density}·{transfer} df of each piece", Sum(f"{symbol} = {text} = {with_unit(total, unit)}")
        )


def _link(mission: Mission, error: RandomError) -> Iterator[Step]:
    sync = mission.synchronization
    if sync is None or sync.interval is None:
        yield from step("Another error for each pulse: all of it spreads, none of it is a quadratic phase")
        return
    yield from step(
        "Errors of each exchange, joined by straight lines: S = 2·σ²·T_s·sinc(f·T_s)⁴, two thirds of σ² in all",
        f"T_s = {with_unit(sync.interval, 's')}",
    )
    effect = error.published
    k = mission.allocation.coverage_factor
    lines = [f"{part}/unit = {with_unit(value * (k if part == 'left' else 1.0), 'rad per rad')}"
             for part, value in zip(_PARTS, effect[:3], strict=True)]  # fmt: skip
    yield from step("Integrated with the squares of 7.5·j₂(πfT), of 17.5·j₃(πfT), and 1 − Σ(2n+1)·jₙ²(πfT)", *lines)


def _phases(mission: Mission, error: RandomError, model: str) -> Iterator[Step]:
    if error.declared is None:
        return
    other = "full" if model == "published" else "published"
    is_same = error.published[:5] == error.full[:5]
    is_left_same = error.published.spread == error.full.spread
    for name in (model,) if is_same else (model, other):
        effect, k = error.effect(name), _covered(mission, error)
        mark = "_full" if name == "full" and not is_same else ""
        lines: list[WorkedEquation] = []
        for symbol, per_unit in zip(_PARTS, effect[:3], strict=True):
            if not per_unit or (symbol == "left" and is_left_same and name != model):
                continue
            result = per_unit * error.declared
            values, formula = {f"{symbol}/unit": per_unit, "declared": error.declared}, f"{symbol}/unit*declared"
            if symbol == "left" and k != 1:  # a mean power has no coverage factor
                values |= {"left/unit": per_unit * k, "k": k}
                formula += "/k"
            marked = symbol if symbol == "left" and is_left_same else f"{symbol}{mark}"
            lines += equation(marked, formula, values, result, "rad")
            if symbol == "QPE" and is_same:
                lines += equation("QPE_full", "QPE", {"QPE": result}, result, "rad")
        by = "both models" if is_same else f"the {name} model{'' if name == model else ', for comparison'}"
        if effect.displacement > 0:
            values = {"moved/unit": effect.displacement, "declared": error.declared}
            result = effect.displacement * error.declared
            lines += equation(f"moved{mark}", "moved/unit*declared", values, result, "m")
        if lines:
            yield from step(f"Of what is declared, by {by}", *lines)


def _covered(mission: Mission, error: RandomError) -> float:
    """Coverage factor within what is declared; that of an oscillator is in its phases."""
    return 1.0 if error.unit == "dB" else float(error.coverage(mission))


def _allowable(mission: Mission, allocation: Allocation, error: RandomError, row: Row, model: str) -> Iterator[Step]:
    effect = error.effect(model)
    held = held_effect(mission, effect, error.coverage(mission))
    limit = allocation.qpe_limit(error.owner) * allocation.autofocus_gain
    if error.is_covered:  # an effect from elsewhere has no quadratic phase here
        yield from limit_steps(allocation, error.owner, limit)
    sizes: dict[str, float] = {}
    required = mission.requirements
    if effect.quadratic:
        sizes["by_QPE"] = limit / effect.quadratic
        values = {"limit": limit, "QPE/unit": effect.quadratic}
        lines = equation("by_QPE", "limit/(QPE/unit)", values, sizes["by_QPE"], _unit(error))
        yield from step(f"Allowable by the {QUADRATIC.replace('_', ' ').removesuffix(' error')}", *lines)
    if effect.cubic and required.cubic_phase_error is not None:
        sizes["by_cubic"] = required.cubic_phase_error / effect.cubic
        values = {"limit": required.cubic_phase_error, "cubic/unit": effect.cubic}
        lines = equation("by_cubic", "limit/(cubic/unit)", values, sizes["by_cubic"], _unit(error))
        yield from step(f"Allowable by requirements.{CUBIC}, without share and gain", *lines)
    if held.spread and required.islr is not None:
        spread = "left/unit"
        if held.spread != effect.spread:
            spread = "spread/unit"
            yield from _with_cubic(mission, error, effect, held)
        power, share = 10 ** (required.islr / 10), allocation.islr.of(error.owner)
        energy = mainlobe_energy(mission)
        rule, values = _allowed_variance(model, power, energy)
        rms = spread_phase(power, model, energy) * math.sqrt(share)
        lines = equation("rms", f"sqrt({rule})*sqrt(s)", {**values, "s": share}, rms, "rad")
        yield from step(
            f"Phase that may be left, requirements.islr {required.islr:g} dB, share s of its power", *lines
        )
        sizes["by_ISLR"] = rms / held.spread
        k = _covered(mission, error)
        values = {"rms": rms, spread: held.spread * k, "k": k}
        formula = f"rms/({spread})" if k == 1 else f"k*rms/({spread})"
        lines = equation("by_ISLR", formula, values, sizes["by_ISLR"], _unit(error))
        yield from step("Allowable by requirements.islr", *lines)
    if effect.displacement > 0 and required.location_error is not None:
        sizes["by_location"] = required.location_error / effect.displacement
        values = {"limit": required.location_error, "moved/unit": effect.displacement}
        lines = equation("by_location", "limit/(moved/unit)", values, sizes["by_location"], _unit(error))
        yield from step(f"Allowable by requirements.{LOCATION}, without share and gain", *lines)
    yield from smallest_size(row, sizes)


def _with_cubic(mission: Mission, error: RandomError, effect: RandomEffect, held: RandomEffect) -> Iterator[Step]:
    """Add the power of the cubic phase to what is left, where no requirement of its own takes it."""
    k, factor = _covered(mission, error), float(error.coverage(mission))
    values = {"cubic/unit": effect.cubic, "left/unit": effect.spread * k, "k": factor}
    # What is left is shown of one sigma, the cubic phase with the factor of what is declared or without it.
    formula = "4*(cubic/unit)^2/175" if k == factor else "4*(cubic/unit/k)^2/175"
    formula = f"sqrt((left/unit)^2 + {formula})" if effect.spread else f"sqrt({formula})"
    lines = equation(
        "spread/unit", formula, values, held.spread * k, f"rad{f' per {_unit(error)}' * bool(_unit(error))}"
    )
    title = "No requirements.cubic_phase_error: ISLR holds the power of the cubic phase too, without coverage factor"
    yield from step(title, *lines)


def _unit(error: RandomError) -> str:
    return "" if error.unit == "dB" else error.unit


def _allowed_variance(model: str, power: float, energy: float) -> tuple[str, dict[str, float]]:
    """Formula of the variance that an ISLR allows by a model, and its values."""
    if model == "published":
        return "ISLR", {"ISLR": power}
    return "log(E*ISLR + 1)", {"ISLR": power, "E": energy}


def _level(model: str, variance: str) -> str:
    """Formula of the ISLR of a variance by a model. [dB]"""
    ratio = variance if model == "published" else f"(e^{variance} - 1)/E"
    return f"10*log({ratio})/log(10)"


def explained_islr(analysis: Analysis, allocation: Allocation, row: Row) -> Iterator[Step]:
    """Powers of everything that spreads, together."""
    mission, model, owner = analysis.mission, row.model or "published", row.owner
    members = {one.row_id: one.variance for one in declared_powers(analysis, owner, model)}
    total, energy = math.fsum(members.values()), mainlobe_energy(mission)
    known: dict[str, float] = {}
    rule = "the published rule takes the variance for it"
    if model != "published":
        known = {"e": math.e, "E": energy}
        rule = "a phase of variance v leaves e^-v of the response, of which a share E lies within its first nulls"
    if row.declared is None:
        yield from step("Nothing that spreads is declared")
    else:
        yield from _tones_and_cubic(analysis, allocation, owner, model, members)
        width = max(len(name) for name in members)
        listed = [f"{printable(name):<{width}}  {power:.6g} rad²" for name, power in members.items()]
        terms = " + ".join(number(power) for power in members.values())
        title = "Squares of the rms phases that spread: independent, so they add"
        yield from step(title, *listed, Sum(f"v = {terms} = {with_unit(total, 'rad²')}"))
        lines = equation("declared", _level(model, "v"), {"v": total, **known}, row.declared, "dB")
        yield from step(f"As ISLR: {rule}", *lines)
    if row.allowable is None:
        return
    power, share = 10 ** ((mission.requirements.islr or 0.0) / 10), allocation.islr.of(owner)
    formula, values = _allowed_variance(model, power, energy)
    limit = spread_phase(power, model, energy) ** 2 * share
    lines = equation("v_max", f"{formula}*s", {**values, "s": share}, limit, "rad²")
    yield from step("Variance that requirements.islr allows, share s of the power", *lines)
    lines = equation("allowable", _level(model, "v_max"), {"v_max": limit, **known}, row.allowable, "dB")
    yield from step("As ISLR", *lines)
    if row.utilization is not None:
        values = {"v": total, "v_max": limit}
        lines = equation("utilization", "sqrt(v/v_max)", values, row.utilization, "")
        yield from step("Utilization, of amplitudes", *lines)


def _tones_and_cubic(
    analysis: Analysis, allocation: Allocation, owner: str, model: str, members: Mapping[str, float]
) -> Iterator[Step]:
    """Powers of what is no noise: tones and the cubic phase, where no requirement of their own takes them."""
    powers = [
        Sum(f"{one.subject.id} = {number(one.phase)}^2/2 = {with_unit(members[one.subject.id], 'rad²')}")
        for one in tones(analysis.mission)
        if one.subject.id in members
    ]
    if powers:
        yield from step("No requirements.pslr: a tone spreads half the square of its peak phase", *powers)
    cubic_row = subject("mission", CUBIC).id
    if cubic_row not in members:
        return
    together = analysis.together("full" if model == "full" else "published")
    cubic = float(together.cubic_without_coverage(allocation.islr, owner)[0])
    parts = together.phase_parts(together.cubics_without_coverage(allocation.islr, owner), together.rule_of_all)
    title = "Cubic phase of the declared errors, without coverage factor"
    yield from combined(title, together.rule_of_all, parts, cubic, symbol="φ_3")
    lines = equation("v_3", "4*φ_3^2/175", {"φ_3": cubic}, members[cubic_row], "rad²")
    yield from step("No requirements.cubic_phase_error: its mean square after the fit of a line spreads", *lines)


def explained_pslr(mission: Mission, row: Row) -> Iterator[Step]:
    """From all tones to the highest echo that they make in the worst of their phases."""
    found = tones(mission)
    echo = highest_echo(found)
    if echo is None:
        yield from step("No tone is declared: no vibration from one cycle per aperture on, no spur")
    else:
        width = max(len(one.subject.id) for one in found)
        listed = [f"{one.subject.id:<{width}}  {one.phase:.6g} rad, {one.cycles:.6g} cells" for one in found]
        yield from step("Tones: peak phase, and distance of their echoes from the response", *listed)
        together = [one for one, is_in in zip(found, echo.is_of, strict=True) if is_in]
        pairs = {together[other].subject.id: together[one] for one, other in quadratures(together)}
        apart = {one.subject.id for one in pairs.values()}
        terms = " + ".join(
            f"{_with_its_pair(one, pairs.get(one.subject.id))}*{number(abs(np.sinc(echo.cycles - one.cycles)))}"
            for one in together
            if one.subject.id not in apart
        )
        title = (
            f"Highest echo: at x = {number(echo.cycles)} cells, of {', '.join(one.subject.id for one in together)}"
        )
        if pairs:
            title += "; motion and oscillator are a quarter of a turn apart, so that squares of the two add"
        if len(together) - len(pairs) > 1:
            title += ", each φ·|sinc(x − f·T)| in the worst phases, sinc(x) = sin(πx)/(πx)"
        yield from step(title, Sum(f"φ = {terms} = {with_unit(echo.phase, 'rad')}"))
        yield from _echo_level(echo)
        if row.declared is not None:
            lines = equation("declared", "20*log(l)/log(10)", {"l": echo.level}, row.declared, "dB")
            yield from step("As a level", *lines)
    if row.allowable is None:
        return
    lines = equation("allowable", "required", {"required": row.allowable}, row.allowable, "dB")
    yield from step(f"requirements.pslr, all of it, {place(mission, ('requirements', 'pslr'))}", *lines)
    yield from _use_of_amplitudes(row)


def _with_its_pair(one: Tone, other: Tone | None) -> str:
    """Peak phase of a tone, or with that of one a quarter of a turn away."""
    return number(one.phase) if other is None else f"sqrt({number(one.phase)}^2 + {number(other.phase)}^2)"


def _echo_level(echo: Echo) -> Iterator[Step]:
    if echo.phase > LARGEST_ECHO:
        lines = equation("l", "φ/2", {"φ": echo.phase}, echo.level, "")
        yield from step(f"Amplitude over that of the response; above {LARGEST_ECHO:g} rad half the phase", *lines)
        return
    j0, j1 = bessel(echo.phase)
    yield from step(
        "Amplitude over that of the response, J₁(φ)/J₀(φ)",
        *equation("J_0", "", {}, j0, ""),
        *equation("J_1", "", {}, j1, ""),
        *equation("l", "J_1/J_0", {"J_0": j0, "J_1": j1}, echo.level, ""),
    )


def _use_of_amplitudes(row: Row) -> Iterator[Step]:
    if row.utilization is None or row.declared is None or row.allowable is None:
        return
    values = {"declared": row.declared, "allowable": row.allowable}
    lines = equation("utilization", "10^((declared - allowable)/20)", values, row.utilization, "")
    yield from step("Utilization, of amplitudes", *lines)


def explained_spur(mission: Mission, allocation: Allocation, row: Row) -> Iterator[Step]:
    """From the tone of an oscillator to its paired echoes, and to what the platform's share allows."""
    oscillator = getattr(mission.platforms, row.owner).oscillator
    path = ("platforms", row.owner, "oscillator", "spurs")
    entry = row.subject.entry or 0
    frequency, level = oscillator.spurs[entry]
    yield from step(f"Declared in {place(mission, path)}", f"{frequency:.6g} Hz: {level:.6g} dBc")
    f_0 = mission.radar.center_frequency
    values, formula = {"L": level, "f_0": f_0, "f_osc": oscillator.frequency or f_0}, "L + 20*log(f_0/f_osc)/log(10)"
    left = next(one.left for one in spurs_of(mission) if (one.name, one.entry) == (row.owner, entry))
    title = "At the centre frequency; an echo has the amplitude of the sideband"
    if left != 1:
        values, formula = {**values, "left": left}, f"{formula} + 20*log(left)/log(10)"
        title += ", times what the synchronization leaves of it"
    yield from step(title, *equation("declared", formula, values, row.declared or 0.0, "dB"))
    limits = tone_limits(mission, allocation)[1].get(row.owner)
    if limits is None or row.allowable is None:
        yield from step("Allowable: no limit", printable(row.reason or "no requirement limits this error"))
        return
    values = {"A": limits.by(row.model or "published"), "λ": mission.radar.wavelength}
    lines = equation("φ", "2*π*A/λ", values, 2 * math.pi * values["A"] / values["λ"], "rad")
    by_power = "" if row.metric == "pslr" else ", √2 times the rms value that ISLR allows"
    yield from step(f"Phase of a vibration at the limit of {row.owner}.vibration.sinusoidal{by_power}", *lines)
    phase = {"φ": 2 * math.pi * values["A"] / values["λ"]}
    yield from step("Its echoes", *equation("allowable", "20*log(φ/2)/log(10)", phase, row.allowable, "dB"))
    yield from _use_of_amplitudes(row)
