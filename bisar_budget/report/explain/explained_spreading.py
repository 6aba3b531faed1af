"""Explanation steps for tones with their paired echoes and displacements, and for phase noise that spreads power."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.spread import (
    Tone,
    declared_powers,
    mainlobe_energy,
    spread_limit,
    spread_phase,
    stated_powers,
    tones,
)
from bisar_budget.analysis.tone_displacement import TonePart
from bisar_budget.analysis.vibration_limits import (
    MAX_ECHO_PHASE_RAD,
    Echo,
    VibrationLimits,
    bessel,
    highest_echo,
    quadratures,
    tone_limits,
)
from bisar_budget.constants import VECTOR_ROUNDING_FRACTION
from bisar_budget.effects.declared import CUBIC
from bisar_budget.effects.effect import subject
from bisar_budget.effects.oscillator_acceleration import accelerated_tones, felt
from bisar_budget.effects.oscillator_tones import LeftTone, spurs_of
from bisar_budget.effects.vibration import ECHO_CYCLES, cubic_part, quadratic_part
from bisar_budget.error_kinds.clock_kinds import OSCILLATOR_KIND
from bisar_budget.error_kinds.random_kinds import OTHER_KIND, VIBRATION_KIND
from bisar_budget.error_kinds.registry import SPREAD_POWER
from bisar_budget.faults import printable
from bisar_budget.findings.row import Row
from bisar_budget.geometry import GroundVector
from bisar_budget.mission.model import Mission
from bisar_budget.report.explain.explained_error import combined, limit_steps, location, no_limit, stated
from bisar_budget.report.explain.notation import Step, Sum, WorkedEquation, number, step, with_unit


def allowed_variance(model: str, power: float, energy: float) -> tuple[str, dict[str, float]]:
    """Formula for the phase variance [rad²] that a required ISLR allows, and the values of its symbols.

    The formula depends on `model`. `power` is the required ISLR as a power ratio. `energy` is the energy of the
    impulse response within its first nulls, as a fraction of its total energy.
    """
    if model == "published":
        return "ISLR", {"ISLR": power}
    return "log(E*ISLR + 1)", {"ISLR": power, "E": energy}


def _level(model: str, variance: str) -> str:
    """Formula, according to `model`, for the ISLR [dB] due to a phase variance with the symbol `variance`."""
    ratio = variance if model == "published" else f"(e^{variance} - 1)/E"
    return f"10*log({ratio})/log(10)"


def explained_islr(analysis: Analysis, allocation: Allocation, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for the ISLR due to all errors, and for its allowable.

    The ISLR follows from the sum of all phase variances that spread power.
    """
    mission, model, owner = analysis.mission, row.model or "published", row.owner
    members = {each.row_id: each.variance for each in declared_powers(analysis, owner, model)}
    total, energy = math.fsum(members.values()), mainlobe_energy(mission)
    constants: dict[str, float] = {}
    rule = "the published rule takes the variance for it"
    if model != "published":
        constants = {"e": math.e, "E": energy}
        rule = "a phase of variance v leaves e^-v of the response, of which a share E lies within its first nulls"
    if row.declared is None:
        yield step("Nothing that spreads is declared")
    else:
        yield from _tones_and_cubic(analysis, allocation, owner, model, members)
        width = max(len(name) for name in members)
        lines = [f"{printable(name):<{width}}  {power:.6g} rad²" for name, power in members.items()]
        terms = " + ".join(number(power) for power in members.values())
        title = "Squares of the rms phases that spread: independent, so they add"
        yield step(title, *lines, Sum(f"v = {terms} = {with_unit(total, 'rad²')}"))
        worked = WorkedEquation("declared", _level(model, "v"), {"v": total, **constants}, row.declared, "dB")
        yield step(f"As ISLR: {rule}", worked)
    if row.allowable is None:
        return
    power, share = 10 ** ((mission.requirements.islr or 0.0) / 10), allocation.islr.of(owner)
    formula, values = allowed_variance(model, power, energy)
    limit = spread_phase(power, model, energy) ** 2 * share
    worked = WorkedEquation("v_max", f"{formula}*s", {**values, "s": share}, limit, "rad²")
    yield step("Variance that requirements.islr allows, share s of the power", worked)
    worked = WorkedEquation("allowable", _level(model, "v_max"), {"v_max": limit, **constants}, row.allowable, "dB")
    yield step("As ISLR", worked)
    if row.utilization is not None:
        values = {"v": total, "v_max": limit}
        worked = WorkedEquation("utilization", "sqrt(v/v_max)", values, row.utilization, "")
        yield step("Utilization, of amplitudes", worked)


def _tones_and_cubic(
    analysis: Analysis, allocation: Allocation, owner: str, model: str, members: Mapping[str, float]
) -> Iterator[Step]:
    """Yield the explanation steps for the power that is spread by tones and by the cubic phase.

    Tones are left out if the mission has a requirement on PSLR. The cubic phase is left out if the mission has a
    requirement on the cubic phase.
    """
    powers = [
        Sum(f"{tone.subject.id} = {number(tone.phase)}^2/2 = {with_unit(members[tone.subject.id], 'rad²')}")
        for tone in tones(analysis.mission)
        if tone.subject.id in members
    ]
    if powers:
        yield step("No requirements.pslr: a tone spreads half the square of its peak phase", *powers)
    cubic_row = subject("mission", CUBIC).id
    if cubic_row not in members:
        return
    together = analysis.together("full" if model == "full" else "published")
    cubic = float(together.cubic_without_coverage(allocation.islr, owner)[0])
    sizes_by_name = together.phase_parts(
        together.cubics_without_coverage(allocation.islr, owner), together.rule_of_all
    )
    title = "Cubic phase of the declared errors, without coverage factor"
    yield from combined(title, together.rule_of_all, sizes_by_name, cubic, symbol="φ_3")
    worked = WorkedEquation("v_3", "4*φ_3^2/175", {"φ_3": cubic}, members[cubic_row], "rad²")
    yield step("No requirements.cubic_phase_error: its mean square after the fit of a line spreads", worked)


def explained_pslr(mission: Mission, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for the highest paired echo that all tones cause together.

    The tones are assumed to have their worst relative phases.
    """
    all_tones = tones(mission)
    echo = highest_echo(all_tones)
    if echo is None:
        yield step("No tone is declared: no vibration from one cycle per aperture on, no spur")
    else:
        width = max(len(tone.subject.id) for tone in all_tones)
        lines = [f"{tone.subject.id:<{width}}  {tone.phase:.6g} rad, {tone.cycles:.6g} cells" for tone in all_tones]
        yield step("Tones: peak phase, and distance of their echoes from the response", *lines)
        echo_tones = [tone for tone, is_in in zip(all_tones, echo.is_of, strict=True) if is_in]
        pairs = {echo_tones[second].subject.id: echo_tones[first] for first, second in quadratures(echo_tones)}
        paired = list(pairs.values())
        terms = " + ".join(
            f"{_with_its_pair(tone, pairs.get(tone.subject.id))}*{number(abs(np.sinc(echo.cycles - tone.cycles)))}"
            for tone in echo_tones
            if tone not in paired
        )
        ids = ", ".join(tone.subject.id for tone in echo_tones)
        title = f"Highest echo: at x = {number(echo.cycles)} cells, of {ids}"
        if pairs:
            title += "; motion and oscillator are a quarter of a turn apart, so that squares of the two add"
        if len(echo_tones) - len(pairs) > 1:
            title += ", each φ·|sinc(x − f·T)| in the worst phases, sinc(x) = sin(πx)/(πx)"
        yield step(title, Sum(f"φ = {terms} = {with_unit(echo.phase, 'rad')}"))
        yield from _echo_level(echo)
        if row.declared is not None:
            worked = WorkedEquation("declared", "20*log(l)/log(10)", {"l": echo.level}, row.declared, "dB")
            yield step("As a level", worked)
    if row.allowable is None:
        return
    worked = WorkedEquation("allowable", "required", {"required": row.allowable}, row.allowable, "dB")
    yield step(f"requirements.pslr, all of it, {location(mission, ('requirements', 'pslr'))}", worked)
    yield from use_of_amplitudes(row)


def _with_its_pair(tone: Tone, pair_tone: Tone | None) -> str:
    """Text with the peak phase of a tone, or with the root-sum-square of the peak phases of two tones.

    `pair_tone` is the second tone, 90 degrees out of phase with the first tone, or None if there is only one tone.
    """
    return number(tone.phase) if pair_tone is None else f"sqrt({number(tone.phase)}^2 + {number(pair_tone.phase)}^2)"


def _echo_level(echo: Echo) -> Iterator[Step]:
    if echo.phase > MAX_ECHO_PHASE_RAD:
        worked = WorkedEquation("l", "φ/2", {"φ": echo.phase}, echo.level, "")
        yield step(f"Amplitude over that of the response; above {MAX_ECHO_PHASE_RAD:g} rad half the phase", worked)
        return
    j0, j1 = map(float, bessel(echo.phase))
    yield step(
        "Amplitude over that of the response, J₁(φ)/J₀(φ)",
        WorkedEquation("J_0", "", {}, j0, ""),
        WorkedEquation("J_1", "", {}, j1, ""),
        WorkedEquation("l", "J_1/J_0", {"J_0": j0, "J_1": j1}, echo.level, ""),
    )


def use_of_amplitudes(row: Row) -> Iterator[Step]:
    """Yield the explanation step for the utilization of a row with values in dB, which is a ratio of amplitudes.

    Nothing is yielded for a row without a utilization.
    """
    if row.utilization is None or row.declared is None or row.allowable is None:
        return
    values = {"declared": row.declared, "allowable": row.allowable}
    worked = WorkedEquation("utilization", "10^((declared - allowable)/20)", values, row.utilization, "")
    yield step("Utilization, of amplitudes", worked)


def moved_by_tone(parts: Sequence[TonePart], model: str, moved: GroundVector) -> Iterator[Step]:
    """Yield the explanation steps that derive the displacement of the image by a tone.

    The displacement follows from the polynomial orders 0 to 3 of the range error. Each item of `parts` is the part of
    the tone along one axis or at one folded frequency. There is a step for each part. `moved` [m] is the total
    displacement, east and north.
    """
    source = "(25)" if model == "published" else "exact ranges"
    for index, tone_part in enumerate(parts):
        if (tone_part.displacement[:, 0] < 1e-3 * np.abs(moved)).all():
            continue
        axis = f"_{index + 1}" if len(parts) > 1 else ""
        c, worked = tone_part.orders[:, 0].tolist(), list[WorkedEquation]()
        for name, metre_effects, size in zip(
            ("east", "north"), tone_part.per_metre[..., 0].T, tone_part.displacement[:, 0], strict=True
        ):
            p = np.where(
                np.abs(metre_effects) > VECTOR_ROUNDING_FRACTION * np.abs(metre_effects).max(), metre_effects, 0.0
            ).tolist()
            values = {f"{symbol}{n}": order[n] for symbol, order in (("c_", c), ("p_", p)) for n in range(4)}
            formula = (
                "sqrt((c_0*p_0 - c_2*p_2)^2 + (c_1*p_1 - c_3*p_3)^2)"
                if any(p[2:])
                else "sqrt((c_0*p_0)^2 + (c_1*p_1)^2)"
            )
            worked.append(WorkedEquation(f"{name}{axis}", formula, values, float(size), "m"))
        yield step(
            "Orders of the tone at the aperture edge, c_0 = A·j₀(x), c_1 = 3·A·j₁(x), x = π·f·T, and what a metre of "
            f"each displaces by {source}, p: east and north each in its worst phase",
            *worked,
        )
    if len(parts) > 1:
        axis_displacements = np.array([tone_part.displacement[:, 0] for tone_part in parts]).T
        sums = (
            Sum(f"{name} = {' + '.join(map(number, sizes))} = {with_unit(total, 'm')}")
            for name, sizes, total in zip(("east", "north"), axis_displacements, moved, strict=True)
        )
        yield step("Each may be in any phase: displacements add", *sums)


def explained_spur(mission: Mission, allocation: Allocation, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for a spur of an oscillator.

    They show the level of the paired echoes of the spur, and the level that the platform's share of the requirement
    allows.
    """
    oscillator = getattr(mission.platforms, row.owner).oscillator
    path = OSCILLATOR_KIND.path(row.owner, row.subject.axis)
    entry = row.subject.entry or 0
    frequency, level = oscillator.spurs[entry]
    yield step(f"Declared in {location(mission, path)}", f"{frequency:.6g} Hz: {level:.6g} dBc")
    f_0 = mission.radar.center_frequency
    values, formula = {"L": level, "f_0": f_0, "f_osc": oscillator.frequency or f_0}, "L + 20*log(f_0/f_osc)/log(10)"
    spur = next(each for each in spurs_of(mission) if (each.name, each.entry) == (row.owner, entry))
    remaining = spur.echo
    title = "At the centre frequency; an echo has the amplitude of the sideband"
    if remaining != 1:
        values, formula = {**values, "left": remaining}, f"{formula} + 20*log(left)/log(10)"
        title += ", times what the synchronization leaves of it"
    yield step(title, WorkedEquation("declared", formula, values, row.declared or 0.0, "dB"))
    limits, sizes = tone_limits(mission, allocation)[1].get(row.owner), dict[str, float]()
    if row.allowable is None:
        yield no_limit(row)
        return
    yield from _worst_phases(spur.left, float(spur.free), mission)
    yield from near_phases(mission, allocation, row, row.qpe_full_rad or 0.0, sizes)
    if limits is not None:
        phase, at_limit = _phase_at_limit(mission, row, limits, "φ")
        yield at_limit
        sizes["by_echoes"] = 20 * math.log10(phase / 2)
        worked = WorkedEquation("by_echoes", "20*log(φ/2)/log(10)", {"φ": phase}, sizes["by_echoes"], "dB")
        yield step("Its echoes", worked)
    yield smallest_of(row, sizes)


def _phase_at_limit(mission: Mission, row: Row, limits: VibrationLimits, symbol: str) -> tuple[float, Step]:
    """Peak phase [rad] of a vibration at its limit, and the explanation step that computes it.

    The limit applies to vibrations of the platform to which `row` belongs.
    """
    values = {"A": float(limits.by(row.model or "published")), "λ": mission.radar.wavelength}
    phase = 2 * math.pi * values["A"] / values["λ"]
    by_power = "" if row.metric == "pslr" else ", √2 times the rms value that ISLR allows"
    title = f"Phase of a vibration at the limit of {row.owner}.vibration.sinusoidal{by_power}"
    return phase, step(title, WorkedEquation(symbol, "2*π*A/λ", values, phase, "rad"))


def explained_tone(mission: Mission, allocation: Allocation, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for the effect of a vibration on an oscillator.

    They show the paired echoes and the allowable acceleration sensitivity.
    """
    name, entry = row.owner, row.subject.entry or 0
    tone = next(tone for tone in accelerated_tones(mission) if (tone.name, tone.entry) == (name, entry))
    felt_vibration, f_0 = felt(mission, name), mission.radar.center_frequency
    has_own_vibration = felt_vibration is not None and felt_vibration.is_own
    path = VIBRATION_KIND.path(name, "sinusoidal", entry)
    if has_own_vibration:
        path = (*OSCILLATOR_KIND.section(name), *path[3:])
    a = float(tone.acceleration)
    gamma = OSCILLATOR_KIND.path(name, row.subject.axis)
    yield step(f"Γ, declared in {location(mission, gamma)}", f"Γ = {with_unit(float(tone.sensitivity), 's^2/m')}")
    if row.evidence:
        yield step("Evidence", printable(row.evidence))
    yield step(
        f"Acceleration of the vibration, declared in {location(mission, path)}", f"a = {with_unit(a, 'm/s^2')}"
    )
    values: dict[str, float] = {"f_0": f_0, "Γ": float(tone.sensitivity), "a": float(a), "f": float(tone.frequency)}
    formula = "f_0*Γ*a/f"
    title = "Derived: peak phase of the tone, a quarter of a turn from the motion itself"
    if tone.echo != 1:
        values, formula = {**values, "left": float(tone.echo)}, f"{formula}*left"
        title += ", times what the synchronization leaves of it"
    yield step(title, WorkedEquation("φ", formula, values, float(tone.phase), "rad"))
    if tone.phase:
        level = 20 * math.log10(tone.phase / 2)
        yield step("Its echoes", WorkedEquation("l", "20*log(φ/2)/log(10)", {"φ": float(tone.phase)}, level, "dB"))
    limits, sizes = tone_limits(mission, allocation)[1].get(name), dict[str, float]()
    if row.allowable is None:
        yield no_limit(row)
        return
    yield from _worst_phases(tone.left, float(tone.free * tone.sensitivity), mission)
    yield from near_phases(mission, allocation, row, row.qpe_full_rad or 0.0, sizes)
    if limits is not None:
        phase, at_limit = _phase_at_limit(mission, row, limits, "φ_max")
        yield at_limit
        if not tone.phase:
            yield step("Allowable", Sum(f"allowable = {with_unit(row.allowable, row.unit)}"))
            return
        values = {"Γ": float(tone.sensitivity), "φ_max": phase, "φ": float(tone.phase)}
        sizes["by_echoes"] = values["Γ"] * phase / values["φ"]
        yield step("Its echoes", WorkedEquation("by_echoes", "Γ*φ_max/φ", values, sizes["by_echoes"], row.unit))
    yield smallest_of(row, sizes)


def _worst_phases(tone: LeftTone, free: float, mission: Mission) -> Iterator[Step]:
    """Yield the explanation steps for the largest quadratic and cubic phase of a slow tone.

    A tone is slow if it has less than three cycles per aperture. `free` [rad] is the peak phase of the tone without
    synchronization.
    """
    T = mission.collection.aperture_time
    near = [
        (free * float(share), float(frequency) * T)
        for frequency, share in zip(tone.frequencies, tone.echoes(T), strict=True)
        if frequency * T < ECHO_CYCLES and free * share
    ]
    if not near:
        return
    quadratic = "Quadratic phase in the worst phase, 7.5·j₂(πn)·φ of n cycles per aperture"
    for title, symbols, order_part in (
        (quadratic, ("QPE", "QPE_full"), quadratic_part),
        ("Cubic phase likewise, 17.5·j₃(πn)·φ", ("cubic",), cubic_part),
    ):
        terms = " + ".join(f"{number(phase)}*{number(float(order_part(cycles)))}" for phase, cycles in near)
        total = with_unit(math.fsum(phase * float(order_part(cycles)) for phase, cycles in near), "rad")
        yield step(title, *(Sum(f"{symbol} = {terms} = {total}") for symbol in symbols))


def near_phases(
    mission: Mission, allocation: Allocation, row: Row, judged: float, sizes: dict[str, float]
) -> Iterator[Step]:
    """Yield the explanation steps for the size of a slow tone that the limits on its phases allow.

    The limits apply to the quadratic and to the cubic phase. Nothing is yielded for a tone of three cycles per
    aperture or more. `judged` is the quadratic phase [rad]. The allowed size is added to `sizes` under the key
    `by_phases`.
    """
    limit, allowed = allocation.qpe_allowed(row.owner), mission.requirements.cubic_phase_error
    if not judged and not row.cubic_rad:
        return
    yield from limit_steps(allocation, row.owner, limit)
    worked = [WorkedEquation("use_QPE", "judged/limit", {"judged": judged, "limit": limit}, judged / limit, "")]
    use, symbol = judged / limit, "use_QPE"
    if allowed is not None and row.cubic_rad is not None:
        values = {"cubic": row.cubic_rad, "limit": allowed}
        worked.append(WorkedEquation("use_cubic", "cubic/limit", values, row.cubic_rad / allowed, ""))
        use, symbol = max((use, symbol), (row.cubic_rad / allowed, "use_cubic"))
    yield step("Below three cycles per aperture its phases are held too, in the worst phase", *worked)
    values, formula = {"declared": row.declared or 0.0, symbol: use}, f"declared/{symbol}"
    size = values["declared"] / use
    if row.unit == "dB":
        formula, size = f"declared - 20*log({symbol})/log(10)", values["declared"] - 20 * math.log10(use)
    sizes["by_phases"] = size
    yield step("Size that uses all of it", WorkedEquation("by_phases", formula, values, size, row.unit))


def smallest_of(row: Row, sizes: Mapping[str, float]) -> Step:
    """Return the explanation step for the allowable of a tone, which is the smallest of `sizes`.

    The keys of `sizes` are the symbols in the explanation, such as `by_echoes`.
    """
    formula = f"min({', '.join(sizes)})" if len(sizes) > 1 else next(iter(sizes))
    return step("Allowable", WorkedEquation("allowable", formula, sizes, row.allowable or 0.0, row.unit))


def explained_power(mission: Mission, allocation: Allocation, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for an error whose size is stated as an ISLR.

    They show the RMS phase error that causes the same ISLR, and the limit on this phase.
    """
    index, model = row.subject.entry or 0, row.model or "full"
    power = next(each for each in stated_powers(mission) if each.subject == row.subject)
    yield from stated(mission, OTHER_KIND.path("mission", SPREAD_POWER.name, index), row.declared, row.evidence)
    yield effect_from_elsewhere()
    ratio, energy = 10 ** (power.islr / 10), mainlobe_energy(mission)
    rms = float(power.rms(model, energy))
    values = {"ISLR": ratio} if model == "published" else {"ISLR": ratio, "E": energy}
    formula = "sqrt(ISLR)" if model == "published" else "sqrt(log(1 + ISLR*E))"
    yield step("Rms phase that spreads as much", WorkedEquation("rms", formula, values, rms, "rad"))
    if mission.requirements.islr is None or row.allowable is None:
        yield no_limit(row)
        return
    allowed = float(spread_limit(mission, allocation, "mission", model))
    worked = WorkedEquation("allowable", "required", {"required": row.allowable}, row.allowable, "dB")
    yield step("requirements.islr, all of it: it belongs to no platform", worked)
    if row.utilization is not None:
        worked = WorkedEquation("utilization", "rms/limit", {"rms": rms, "limit": allowed}, row.utilization, "")
        yield step(f"Utilization, of rms phases; the limit is {with_unit(allowed, 'rad')}", worked)


def effect_from_elsewhere() -> Step:
    """Return the explanation step for an error of which the file declares only the effect on the image."""
    return step("Stated by its effect on the image, whatever makes it; it has no coverage factor")
