"""The first half of an explanation: one error, from its line in the mission file to what it does to the image."""

import math
from collections.abc import Iterator, Mapping, Sequence

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.effects.effect import MOTION_UNITS, PLATFORMS, ErrorSource, Subject, subject
from bisar_budget.faults import KeyPath, printable
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.geometry import FRAME_AXES, PlatformState
from bisar_budget.mission.model import Mission
from bisar_budget.report.explain import formulas
from bisar_budget.report.explain.explained_full import RATES, for_comparison, full_chain
from bisar_budget.report.explain.formulas import Step, Sum, WorkedEquation, equation, number, step, with_unit


def declaration(mission: Mission, source: ErrorSource) -> Iterator[Step]:
    """From the file to `declared`: where it stands, frame, coverage factor."""
    if source.declared is None:
        yield Step(missing(mission, source.path))
        return
    yield from step(f"Declared in {place(mission, source.path)}", as_written(mission, source.path))
    if source.evidence:
        yield from step("Evidence", printable(source.evidence))
    platform, kind, axis = source.owner, source.subject.kind, source.subject.axis
    k = mission.allocation.coverage_factor
    if platform in PLATFORMS:
        error = getattr(mission.platforms, platform).motion_error
        stated = error.stated(kind)
        if error.frame != "scene" and axis in formulas.AXES:
            yield from _turned(mission, source, axis)
            return
        if error.covariance is not None and error.covariance.is_matrix and kind != "acceleration":
            yield from step("One sigma is the root of the variance")
        own = stated[FRAME_AXES[error.frame].index(axis)]
    elif source.is_common:
        own = getattr(mission.common_motion_error, kind)[formulas.AXES.index(axis)]
    elif source.owner == "clock":
        own = getattr(mission.timing_error, axis)
    else:
        return  # an error of nobody's: no coverage factor
    lines = equation("declared", "k*|value|", {"k": k, "value": own}, abs(source.declared), source.unit)
    yield from step("Coverage factor allocation.coverage_factor", *lines)


def _turned(mission: Mission, source: ErrorSource, axis: str) -> Iterator[Step]:
    """Errors of another frame along one axis of the scene."""
    platform, kind = source.owner, source.subject.kind
    error = getattr(mission.platforms, platform).motion_error
    axes = getattr(mission.platforms, platform).state.frame(error.frame)
    covariance = error.covariance if kind != "acceleration" else None
    k = mission.allocation.coverage_factor
    parts = [
        f"{number(k * value)}*{number(direction[formulas.AXES.index(axis)])}"
        for value, direction in zip(error.stated(kind), axes, strict=True)
    ]
    if covariance is not None:
        text = _quadratic_form(parts, covariance.block(kind))
        how = "a covariance turns as AᵀCA"
    elif error.distribution == "normal":
        text = "sqrt(" + " + ".join(f"({part})^2" for part in parts) + ")"
        how = "one-sigma values turn like a covariance"
    else:
        text = " + ".join(f"|{part}|" for part in parts)
        how = "bounds add as magnitudes"
    title = f"Along {axis} from the {error.frame} frame ({', '.join(FRAME_AXES[error.frame])}): {how}"
    size = Sum(f"declared = {text} = {with_unit(abs(source.declared or 0.0), source.unit)}")
    sign = ("from here on with the sign of the parts’ sum",) if (source.declared or 0.0) < 0 else ()
    yield from step(title, size, *sign)


def _quadratic_form(parts: Sequence[str], correlation: Sequence[Sequence[float]]) -> str:
    """Root of Σ ρᵢⱼ pᵢ pⱼ, written out."""
    terms = [f"({part})^2" for part in parts]
    terms += [
        f"2*{number(rho)}*{parts[i]}*{parts[j]}"
        for i, row in enumerate(correlation)
        for j, rho in enumerate(row[:i])
        if rho
    ]
    return "sqrt(" + " + ".join(terms) + ")"


def effect(analysis: Analysis, found: MissionFindings, source: ErrorSource, model: str | None) -> Iterator[Step]:
    """From `declared` to the quadratic phase error; for one unit where nothing is declared."""
    mission = analysis.mission
    sources = {one.subject: one for one in analysis.sources}
    size = 1.0 if source.declared is None else abs(source.declared)
    each = " of one unit" if source.declared is None else ""
    signed = math.copysign(size, source.declared or 1.0)
    qpe = abs(source.effect.qpe) * size
    platform, kind, axis = source.owner, source.subject.kind, source.subject.axis
    gates_by_full = model == "full"
    if gates_by_full and source.is_motion and source.owner != "mission":
        unaware = ", which does not know the direct path" if mission.has_direct_path else ""
        yield from step(f"The published model, for comparison{unaware}; what gates, the full model, comes after it")
    if not source.is_motion:
        yield from step("Quadratic phase error, as declared", f"QPE = {size:.6g} rad")
    elif source.is_common:
        yield from _common_effect(mission, found, source, sources, signed, each)
    elif source.owner == "mission":
        yield from step("Published model: a height error moves the image, no quadratic term")
    elif source.owner == "clock":
        yield from _clock_effect(mission, source, signed, each)
    elif axis in formulas.AXES:
        state = getattr(found.geometry, platform)
        values = _motion_values(mission, state, platform, kind, axis, signed)
        for order, formula in formulas.motion_coefficients(kind, axis, platform).items():
            result = signed * _coefficient(mission, source, order)
            title = f"{_table_i(kind, axis)}{each}"
            yield from step(title, *equation(f"β̃_{order}", formula, values, result, RATES[order]))
        phase = formulas.motion_phase(kind, axis, platform)
        if phase is not None:
            yield from step(f"{source.equation}{each}", *equation("QPE", phase, values, qpe, "rad"))
    else:
        yield from _projected_effect(mission, found, source, sources, size, each)
    if not source.is_motion:
        return
    if gates_by_full:
        yield from full_chain(analysis, source, signed, each)
    else:
        yield from for_comparison(analysis, source, signed, each)
        yield from _displacement(analysis, source)


def _coefficient(mission: Mission, source: ErrorSource, order: int) -> float:
    """β̃ of one unit; β̃₂ and β̃₃ from their phases at the aperture edge, (2π/λ)·β·(T/2)ⁿ."""
    if order < 2:
        return float(source.effect[order])
    phase: float = source.effect.qpe if order == 2 else source.effect.cubic
    return phase * mission.radar.wavelength / (2 * math.pi * (mission.collection.aperture_time / 2) ** order)


def _motion_values(
    mission: Mission, state: PlatformState, platform: str, kind: str, axis: str, size: float
) -> dict[str, float]:
    index, s = formulas.AXES.index(axis), platform[0]
    return {
        "T": mission.collection.aperture_time,
        "λ": mission.radar.wavelength,
        f"R_{s}": state.slant_range,
        f"{axis}_{s}": state.position[index],
        f"v_{axis}{s}": state.velocity[index],
        formulas.motion_symbol(kind, axis, platform): size,
    }


def _clock_effect(mission: Mission, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    order = ("constant", "linear", "quadratic", "cubic").index(source.subject.axis)
    values = {
        "c": SPEED_OF_LIGHT,
        "T": mission.collection.aperture_time,
        "f_0": mission.radar.center_frequency,
        f"t̃_{order}": size,
    }
    result = SPEED_OF_LIGHT * size
    lines = equation(f"β̃_{order}", formulas.clock_coefficient(order), values, result, RATES[order])
    yield from step(f"Table I row 1{each}", *lines)
    if order == 2:
        qpe = abs(source.effect.qpe * size)
        yield from step(f"{source.equation}{each}", *equation("QPE", formulas.CLOCK_PHASE, values, qpe, "rad"))


def _table_i(kind: str, axis: str) -> str:
    return f"Table I row {2 + 3 * formulas.AXES.index(axis) + list(MOTION_UNITS).index(kind)}"


def _common_effect(
    mission: Mission,
    found: MissionFindings,
    source: ErrorSource,
    sources: Mapping[Subject, ErrorSource],
    size: float,
    each: str,
) -> Iterator[Step]:
    """The effects of both platforms, added with their signs."""
    _, _, kind, axis, *_ = source.subject
    values = {}
    for platform in PLATFORMS:
        leg, phase = sources[subject(platform, kind, axis)], f"φ_{platform[0]}"
        values[phase] = leg.effect.qpe * size
        known = _motion_values(mission, getattr(found.geometry, platform), platform, kind, axis, size)
        for order, formula in formulas.motion_coefficients(kind, axis, platform).items():
            known[f"β̃_{order}"] = result = size * _coefficient(mission, leg, order)
            title = f"{_table_i(kind, axis)}, {platform}{each}"
            yield from step(title, *equation(f"β̃_{order}", formula, known, result, RATES[order]))
        if kind != "position":
            title = f"Its phase at the aperture edge, {platform}"
            yield from step(title, *equation(phase, formulas.EDGE_PHASE, known, values[phase], "rad"))
    if kind == "position":
        yield from step(f"Table I: a position error moves the image, no quadratic term{each}")
        return
    qpe = abs(source.effect.qpe * size)
    yield from step(f"{source.equation}{each}, signed", *equation("QPE", "|φ_t + φ_r|", values, qpe, "rad"))


def _projected_effect(
    mission: Mission,
    found: MissionFindings,
    source: ErrorSource,
    sources: Mapping[Subject, ErrorSource],
    size: float,
    each: str,
) -> Iterator[Step]:
    """Along an axis of another frame: the projection of the effects along the axes of the scene."""
    _, platform, kind, axis, frame, _ = source.subject
    state: PlatformState = getattr(found.geometry, platform)
    direction = state.frame(frame)[FRAME_AXES[frame].index(axis)]
    along = [sources[subject(platform, kind, letter)].effect.qpe for letter in formulas.AXES]
    terms = " + ".join(f"{number(q)}*{number(d)}" for q, d in zip(along, direction, strict=True))
    unit = f"rad per {source.unit}"
    yield from step(
        f"{source.equation}, {unit.replace('^2', '²')} along x, y, z times the {axis} axis",
        Sum(f"QPE/unit = |{terms}| = {with_unit(abs(source.effect.qpe), unit)}"),
    )
    values = {"QPE/unit": abs(source.effect.qpe), "declared": size}
    qpe = abs(source.effect.qpe) * size
    yield from step(f"Quadratic phase error{each}", *equation("QPE", "QPE/unit*declared", values, qpe, "rad"))


def _displacement(analysis: Analysis, source: ErrorSource) -> Iterator[Step]:
    """Where (25) puts the image."""
    published, by_table = analysis.published, source.effect
    if published.degeneracy or source.declared is None:
        return
    moved = published.displacement(by_table, source.declared)
    if moved is None or moved == (0.0, 0.0):
        return
    values = {
        "β̃_0": by_table.constant * source.declared,
        "β̃_1": by_table.linear * source.declared,
        "det Q": published.plane.determinant,
    }
    lines: list[WorkedEquation] = []
    for symbol, (first, second), result in zip(("x̃", "ỹ"), published.plane.adjugate, moved, strict=True):
        entries = {"adj_0": first, "adj_1": second}
        lines += equation(symbol, "(adj_0*β̃_0 + adj_1*β̃_1)/(det Q)", values | entries, result, "m")
    yield from step("(25), (30): the image moves east, north by", *lines)


def place(mission: Mission, path: KeyPath) -> str:
    """File, line and column of a value, else of the nearest key above it."""
    line = mission.line(path)
    file = printable(mission.file)
    return file if line is None else f"{file}:{line.region.line}:{line.region.column}"


def missing(mission: Mission, path: KeyPath) -> str:
    """Say that the file is silent."""
    return f"Not declared: no {dotted(path)} (the nearest key is at {place(mission, path)})"


def as_written(mission: Mission, path: KeyPath) -> str:
    """Key and text of the value, or of the nearest one above it that stands in the file."""
    while path and path not in mission.places:
        path = path[:-1]
    written = getattr(mission.places.get(path), "value", None)
    return f"{dotted(path)}: {printable(written)}" if written is not None else dotted(path)


def dotted(path: KeyPath) -> str:
    """Path of keys as it is written in messages."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")
