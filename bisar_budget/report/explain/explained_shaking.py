"""How a vibration by its spectrum, and an oscillator's acceleration, come to their phases."""

import math
from collections.abc import Iterator

import numpy as np

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.vibration_limits import tone_limits
from bisar_budget.budget.random_rows import no_effect
from bisar_budget.constants import SPEED_OF_LIGHT, STANDARD_GRAVITY
from bisar_budget.effects.oscillator_acceleration import accelerated_tones, felt, flies_a_turn, pieces_by_acceleration
from bisar_budget.effects.random_effect import RandomError
from bisar_budget.effects.spectra import tone
from bisar_budget.effects.vibration import SLOWEST, counted, displacement_rms, pieces_of_vibration, power_of
from bisar_budget.faults import printable
from bisar_budget.findings.row import Row
from bisar_budget.geometry import PlatformState
from bisar_budget.mission.model import Mission
from bisar_budget.mission.vibrations import FeltVibration, Spectrum, Vibration
from bisar_budget.report.explain.explained_error import place
from bisar_budget.report.explain.notation import Step, Sum, equation, number, step, with_unit

_PER_UNIT = "rad per s²/m"


def explained_shaking(mission: Mission, error: RandomError) -> Iterator[Step]:
    """From the points of a spectrum to the phases of the row."""
    if error.subject.kind == "vibration":
        yield from _spectrum(mission, error)
    else:
        yield from _acceleration(mission, error)


def _stated(vibration: Vibration | FeltVibration, spectrum: Spectrum) -> Iterator[Step]:
    """The spectrum of acceleration, or of displacement, as pieces, with its level."""
    what, unit = ("acceleration", "g²/Hz") if spectrum.is_accelerated else ("displacement", "m²/Hz")
    scale = STANDARD_GRAVITY**2 if spectrum.is_accelerated else 1.0
    points = [f"{f:.6g} Hz: {density / scale:.6g} {unit}" for f, density in spectrum.points]
    yield from step(f"One-sided spectrum of {what}, straight over logarithms, nothing beside its points", *points)
    if vibration.spectrum_level:
        power = float(power_of(vibration))
        lines = equation("p", "10^(L/10)", {"L": vibration.spectrum_level}, power, "")
        yield from step("Shifted by spectrum_level, a factor of power", *lines)


def _spectrum(mission: Mission, error: RandomError) -> Iterator[Step]:
    from bisar_budget.report.explain.explained_random import integrals

    name = error.owner
    vibration: Vibration = getattr(mission.platforms, name).motion_error.vibration
    spectrum = vibration.spectrum
    if spectrum is None:
        return
    yield from _stated(vibration, spectrum)
    rms = displacement_rms(spectrum, float(power_of(vibration)))
    yield from step(
        "Root mean square of the displacement, S_x = S_a/(2πf)^4, all frequencies",
        f"x = {with_unit(rms, 'm')}",
        *equation(
            "φ",
            "2*π*x/λ",
            {"x": rms, "λ": mission.radar.wavelength},
            2 * math.pi * rms / mission.radar.wavelength,
            "rad",
        ),
    )
    along = float(counted(mission, name, 1.0, "islr"))
    if along != 1:
        yield from step(f"Of it {number(along)} lies in the range less the direct path")
    pieces = pieces_of_vibration(mission, name)
    yield from step(
        "One-sided spectrum of phase along the line of sight, one way, S = S_x·(2π/λ)² [rad²/Hz]",
        *(f"{one.low:.6g} Hz to {one.high:.6g} Hz: {one.density:.6g} * f^-{one.slope:.6g}" for one in pieces),
    )
    if not error.published.spread and not error.published.quadratic:
        yield Step(no_effect(mission, error))
        return
    yield from integrals(pieces, mission, None)


def _acceleration(mission: Mission, error: RandomError) -> Iterator[Step]:
    """Random vibration of an oscillator, its slow tones, and the turn of its platform."""
    from bisar_budget.report.explain.explained_random import integrals

    name, f_0, sync = error.owner, mission.radar.center_frequency, mission.synchronization
    one = felt(mission, name)
    if one is None or not any(error.published[:3]):
        yield Step(no_effect(mission, error))
        return
    yield from step("Fractional frequency y = Γ·a, with Γ and the acceleration as they point at their worst")
    pieces = pieces_by_acceleration(mission, name)
    if pieces and one.vibration.spectrum is not None:
        yield from _stated(one.vibration, one.vibration.spectrum)
        yield from step(
            f"One-sided spectrum of phase at {f_0:.6g} Hz by a unit of Γ, S = (f_0/f)²·S_a [rad²/Hz]",
            *(
                f"{piece.low:.6g} Hz to {piece.high:.6g} Hz: {piece.density:.6g} * f^-{piece.slope:.6g}"
                for piece in pieces
            ),
        )
        yield from integrals(pieces, mission, sync, _PER_UNIT)
    for line in accelerated_tones(mission):
        cycles = line.frequency * mission.collection.aperture_time
        if line.name == name and cycles < SLOWEST:
            quadratic, cubic = (float(part) * line.per_unit for part in tone(math.pi * cycles)[:2])
            yield from step(
                f"Vibration at {line.frequency:.6g} Hz, {cycles:.3g} cycles per aperture, in its worst phase",
                f"QPE/unit = {with_unit(abs(quadratic), _PER_UNIT)}",
                f"cubic/unit = {with_unit(abs(cubic), _PER_UNIT)}",
            )
    if flies_a_turn(mission, name):
        state: PlatformState = getattr(mission.platforms, name).state
        acceleration = float(np.linalg.norm(state.acceleration))
        yield from step(
            "Turn: the range error is c·Γ·(v(τ) − v(0)); the acceleration at mid-aperture is a frequency, which "
            "displaces, and its change bends. Of three axes the root-sum-square is the most that a Γ does",
            *equation("drift/unit", "c*a", {"c": SPEED_OF_LIGHT, "a": acceleration}, SPEED_OF_LIGHT * acceleration,
                      "m/s per s²/m"),
        )  # fmt: skip
    yield from step(
        "Together, by a unit of Γ: independent parts add as squares",
        *(
            f"{symbol} = {with_unit(value, _PER_UNIT)}"
            for symbol, value in zip(("QPE/unit", "cubic/unit"), error.published[:2], strict=True)
        ),
        f"left/unit = {with_unit(error.published.spread * mission.allocation.coverage_factor, _PER_UNIT)}",
    )


def explained_tone(mission: Mission, allocation: Allocation, row: Row) -> Iterator[Step]:
    """From a vibration of an oscillator to its paired echoes, and to the sensitivity that the share allows."""
    name, entry = row.owner, row.subject.entry or 0
    one = next(one for one in accelerated_tones(mission) if (one.name, one.entry) == (name, entry))
    felt_one, f_0 = felt(mission, name), mission.radar.center_frequency
    is_own = felt_one is not None and felt_one.is_own
    section = ("oscillator",) if is_own else ("motion_error",)
    path = ("platforms", name, *section, "vibration", "sinusoidal", entry, "amplitude")
    a = float(one.acceleration)
    gamma = ("platforms", name, "oscillator", "acceleration_sensitivity")
    yield from step(f"Γ, declared in {place(mission, gamma)}", f"Γ = {with_unit(one.sensitivity, 's^2/m')}")
    if row.evidence:
        yield from step("Evidence", printable(row.evidence))
    yield from step(
        f"Acceleration of the vibration, declared in {place(mission, path)}", f"a = {with_unit(a, 'm/s^2')}"
    )
    values, formula = {"f_0": f_0, "Γ": one.sensitivity, "a": a, "f": one.frequency}, "f_0*Γ*a/f"
    title = "Derived: peak phase of the tone, a quarter of a turn from the motion itself"
    if one.left != 1:
        values, formula = {**values, "left": one.left}, f"{formula}*left"
        title += ", times what the synchronization leaves of it"
    yield from step(title, *equation("φ", formula, values, one.phase, "rad"))
    if one.phase:
        level = 20 * math.log10(one.phase / 2)
        yield from step("Its echoes", *equation("l", "20*log(φ/2)/log(10)", {"φ": one.phase}, level, "dB"))
    limits = tone_limits(mission, allocation)[1].get(name)
    if limits is None or row.allowable is None:
        yield from step("Allowable: no limit", printable(row.reason or "no requirement limits this error"))
        return
    limit = float(limits.by(row.model or "published"))
    phase = 2 * math.pi * limit / mission.radar.wavelength
    by_power = "" if row.metric == "pslr" else ", √2 times the rms value that ISLR allows"
    lines = equation("φ_max", "2*π*A/λ", {"A": limit, "λ": mission.radar.wavelength}, phase, "rad")
    yield from step(f"Phase of a vibration at the limit of {name}.vibration.sinusoidal{by_power}", *lines)
    if one.phase:
        values = {"Γ": one.sensitivity, "φ_max": phase, "φ": one.phase}
        yield from step("Allowable", *equation("allowable", "Γ*φ_max/φ", values, row.allowable, row.unit))
    else:
        yield from step("Allowable", Sum(f"allowable = {with_unit(row.allowable, row.unit)}"))
