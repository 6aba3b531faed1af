"""How a row comes to its status: from the line of the mission file through the equations to the verdict."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from unicodedata import combining

from bisar_budget.budget.allocation import Allocation
from bisar_budget.budget.findings import MissionFindings, Row
from bisar_budget.budget.sources import MOTION_UNITS, ErrorSource, error_sources, image_plane
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.errors import KeyPath, printable
from bisar_budget.geometry import FRAME_AXES, PlatformState
from bisar_budget.mission.model import Mission
from bisar_budget.report import formulas
from bisar_budget.report.formulas import filled, number
from bisar_budget.report.text_table import WORDS, percent
from bisar_budget.units import format_quantity

_RATES = ("m", "m/s", "m/s²", "m/s³")  # units of the range error's coefficients
_RULES = {"each": "the largest", "sum": "the sum", "rss": "the root-sum-square"}


def explain(mission: Mission, found: MissionFindings, row_id: str) -> str:
    """Write the chain of equations of one row of a mission, with the numbers put in.

    Parameters
    ----------
    mission : Mission
        As loaded.
    found : MissionFindings
        What the check of it found.
    row_id : str
        Id of one of its rows.
    """
    row = next(row for row in found.rows if row.id == row_id)
    own_id = f" [{printable(row.requirement_id)}]" if row.requirement_id else ""
    lines = [f"{WORDS[row.status]} {printable(row.id)}{own_id} of {printable(mission.name)}", ""]
    sources = {source.id: source for source in error_sources(mission, found.geometry)}
    source = sources.get(row.id)
    if source is not None:
        lines += _declaration(mission, source)
        lines += _effect(mission, found, source, sources)
        lines += _budget(found.allocation, source.owner, source.effect.qpe, row)
    elif ".vibration." in row.id:
        lines += _vibration(mission, found.allocation, row)
    elif row.id.endswith(".quadratic_phase_error") or row.id == "mission.autofocus_pull_in":
        lines += _phase_aggregate(found, row, sources.values())
    elif row.id == "mission.cubic_phase_error":
        lines += _cubic_aggregate(found, row, sources.values())
    elif row.id == "mission.location_error":
        lines += _location_aggregate(mission, found, row, sources.values())
    lines += _verdict(row)
    return "\n".join(lines) + "\n"


def _step(title: str, *equations: str) -> Iterator[str]:
    yield title
    yield from (f"    {equation}" for equation in equations)


def _equation(symbol: str, formula: str, values: Mapping[str, float], result: float, unit: str) -> tuple[str, str]:
    """Write the formula, and under it the same with numbers; their equals signs stand above each other."""
    margin = " " * sum(not combining(letter) for letter in symbol)
    return f"{symbol} = {formula}", f"{margin} = {filled(formula, values)} = {_with_unit(result, unit)}"


def _with_unit(value: float, unit: str) -> str:
    return f"{value + 0.0:.6g} {unit.replace('^2', '²')}".rstrip()  # + 0.0 takes the sign from a zero


def _declaration(mission: Mission, source: ErrorSource) -> Iterator[str]:
    """From the file to `declared`: where it stands, frame, coverage factor."""
    if source.declared is None:
        yield _missing(mission, source.path)
        return
    yield from _step(f"Declared in {_place(mission, source.path)}", _as_written(mission, source.path))
    if source.evidence:
        yield from _step("Evidence", printable(source.evidence))
    platform, kind, axis = (*source.id.split(".", 2), "")[:3]
    k = mission.allocation.coverage_factor
    if kind in MOTION_UNITS and platform in ("transmitter", "receiver"):
        error = getattr(mission.platforms, platform).motion_error
        stated = getattr(error, kind)
        if error.frame != "scene" and axis in formulas.AXES:
            yield from _turned(mission, source, axis)
            return
        own = stated[FRAME_AXES[error.frame].index(axis)]
    elif source.owner == "clock":
        own = getattr(mission.timing_error, kind)
    else:
        return  # an error of nobody's: no coverage factor
    equation = _equation("declared", "k*|value|", {"k": k, "value": own}, abs(source.declared), source.unit)
    yield from _step("Coverage factor allocation.coverage_factor", *equation)


def _turned(mission: Mission, source: ErrorSource, axis: str) -> Iterator[str]:
    """Errors of another frame along one axis of the scene."""
    platform, kind, _ = source.id.split(".")
    error = getattr(mission.platforms, platform).motion_error
    axes = getattr(mission.platforms, platform).state.frame(error.frame)
    k = mission.allocation.coverage_factor
    parts = [
        f"{number(k * value)}*{number(direction[formulas.AXES.index(axis)])}"
        for value, direction in zip(getattr(error, kind), axes, strict=True)
    ]
    if error.distribution == "normal":
        text = "sqrt(" + " + ".join(f"({part})^2" for part in parts) + ")"
        how = "one-sigma values turn like a covariance"
    else:
        text = " + ".join(f"|{part}|" for part in parts)
        how = "bounds add as magnitudes"
    title = f"Along {axis} from the {error.frame} frame ({', '.join(FRAME_AXES[error.frame])}): {how}"
    yield from _step(title, f"declared = {text} = {_with_unit(abs(source.declared or 0.0), source.unit)}")


def _effect(
    mission: Mission, found: MissionFindings, source: ErrorSource, sources: Mapping[str, ErrorSource]
) -> Iterator[str]:
    """From `declared` to the quadratic phase error; for one unit where nothing is declared."""
    size = 1.0 if source.declared is None else abs(source.declared)
    each = " of one unit" if source.declared is None else ""
    qpe = abs(source.effect.qpe) * size
    platform, kind, axis = (*source.id.split(".", 2), "")[:3]
    if source.owner == "mission":
        yield from _step("Quadratic phase error, as declared", f"QPE = {size:.6g} rad")
    elif source.owner == "clock":
        yield from _clock_effect(mission, source, size, each)
    elif axis in formulas.AXES:
        state = getattr(found.geometry, platform)
        values = _motion_values(mission, state, platform, kind, axis, size)
        coefficients = (source.effect.constant, source.effect.linear)
        for order, formula in formulas.motion_coefficients(kind, axis, platform).items():
            result = coefficients[order] * size if order < 2 else _coefficient(mission, source, order) * size
            yield from _step(
                f"Table I row {2 + 3 * formulas.AXES.index(axis) + list(MOTION_UNITS).index(kind)}{each}",
                *_equation(f"β̃_{order}", formula, values, result, _RATES[order]),
            )
        phase = formulas.motion_phase(kind, axis, platform)
        if phase is not None:
            yield from _step(f"{source.equation}{each}", *_equation("QPE", phase, values, qpe, "rad"))
    else:
        yield from _projected_effect(mission, found, source, sources, size, each)
    if source.declared is not None and source.owner != "mission":
        yield from _displacement(found, source)


def _coefficient(mission: Mission, source: ErrorSource, order: int) -> float:
    """β̃₂ or β̃₃ of one unit, from its phase at the aperture edge (2π/λ)·β·(T/2)ⁿ."""
    phase = source.effect.qpe if order == 2 else source.effect.cubic
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


def _clock_effect(mission: Mission, source: ErrorSource, size: float, each: str) -> Iterator[str]:
    order = ("constant", "linear", "quadratic", "cubic").index(source.id.split(".")[1])
    values = {
        "c": SPEED_OF_LIGHT,
        "T": mission.collection.aperture_time,
        "f_0": mission.radar.center_frequency,
        f"t̃_{order}": size,
    }
    result = SPEED_OF_LIGHT * size
    equation = _equation(f"β̃_{order}", formulas.clock_coefficient(order), values, result, _RATES[order])
    yield from _step(f"Table I row 1{each}", *equation)
    if order == 2:
        qpe = abs(source.effect.qpe) * size
        yield from _step(f"{source.equation}{each}", *_equation("QPE", formulas.CLOCK_PHASE, values, qpe, "rad"))


def _projected_effect(
    mission: Mission,
    found: MissionFindings,
    source: ErrorSource,
    sources: Mapping[str, ErrorSource],
    size: float,
    each: str,
) -> Iterator[str]:
    """Along an axis of another frame: the projection of the effects along the axes of the scene."""
    platform, kind, axis = source.id.split(".")
    state: PlatformState = getattr(found.geometry, platform)
    frame = getattr(mission.platforms, platform).motion_error.frame
    direction = state.frame(frame)[FRAME_AXES[frame].index(axis)]
    along = [sources[f"{platform}.{kind}.{letter}"].effect.qpe for letter in formulas.AXES]
    terms = " + ".join(f"{number(q)}*{number(d)}" for q, d in zip(along, direction, strict=True))
    unit = f"rad per {source.unit}"
    yield from _step(
        f"{source.equation}, {unit.replace('^2', '²')} along x, y, z times the {axis} axis",
        f"QPE/unit = |{terms}| = {_with_unit(abs(source.effect.qpe), unit)}",
    )
    values = {"QPE/unit": abs(source.effect.qpe), "declared": size}
    qpe = abs(source.effect.qpe) * size
    yield from _step(f"Quadratic phase error{each}", *_equation("QPE", "QPE/unit*declared", values, qpe, "rad"))


def _displacement(found: MissionFindings, source: ErrorSource) -> Iterator[str]:
    plane = image_plane(found.geometry)
    if plane.degeneracy or source.declared is None:
        return
    moved = plane.displacement(source.effect, source.declared)
    if moved is None or moved == (0.0, 0.0):
        return
    values = {
        "β̃_0": source.effect.constant * source.declared,
        "β̃_1": source.effect.linear * source.declared,
        "det Q": plane.determinant,
    }
    lines: list[str] = []
    for symbol, (first, second), result in zip(("x̃", "ỹ"), plane.adjugate, moved, strict=True):
        entries = {"adj_0": first, "adj_1": second}
        lines += _equation(symbol, "(adj_0*β̃_0 + adj_1*β̃_1)/(det Q)", values | entries, result, "m")
    yield from _step("(25), (30): the image moves east, north by", *lines)


def _budget(allocation: Allocation, owner: str, qpe_per_unit: float, row: Row) -> Iterator[str]:
    limit = allocation.qpe_limit(owner) * allocation.autofocus_gain
    yield from _limit(allocation, owner, limit)
    if row.allowable is None:
        yield from _step("Allowable: no limit", printable(row.reason or "this effect has none"))
        return
    values = {"limit": limit, "QPE/unit": abs(qpe_per_unit)}
    yield from _step("Allowable", *_equation("allowable", "limit/(QPE/unit)", values, row.allowable, row.unit))


def _limit(allocation: Allocation, owner: str, limit: float) -> Iterator[str]:
    """Budget times share times gain."""
    total, share, gain = allocation.qpe_total, allocation.qpe.of(owner), allocation.autofocus_gain
    whose = {
        "clock": "the receiver’s share" if allocation.qpe.clock is None else "the clock’s share",
        "mission": "all of it: it belongs to no platform",
    }
    yield from _autofocus_gain(allocation)
    values = {"total": total, "share": share, "gain": gain}
    title = f"Budget requirements.quadratic_phase_error, {whose.get(owner, f'the {owner}’s share')}"
    yield from _step(title, *_equation("limit", "total*share*gain", values, limit, "rad"))


def _autofocus_gain(allocation: Allocation) -> Iterator[str]:
    if allocation.n_pull is None:
        yield from _step("No autofocus (autofocus.n_pull): gain = 1")
        return
    values = {"N_pull": allocation.n_pull, "q": allocation.qpe_total}
    raw = math.pi * allocation.n_pull / allocation.qpe_total
    equation = _equation("gain", formulas.AUTOFOCUS_GAIN, values, raw, "")
    yield from _step("Autofocus, Section VI" + (", never below 1" if raw < 1 else ""), *equation)


def _vibration(mission: Mission, allocation: Allocation, row: Row) -> Iterator[str]:
    platform = row.id.split(".")[0]
    is_sinusoid = row.metric == "pslr"
    key = "sinusoidal" if is_sinusoid else "wideband"
    path: KeyPath = ("platforms", platform, "motion_error", "vibration", key)
    if row.declared is None:
        yield _missing(mission, path)
    else:
        path = (*path, int(row.id.rsplit(".", 1)[1]), "amplitude") if is_sinusoid else (*path, "rms")
        yield from _step(f"Declared in {_place(mission, path)}", _as_written(mission, path))
    if row.evidence:
        yield from _step("Evidence", printable(row.evidence))
    requirement = mission.requirements.pslr if is_sinusoid else mission.requirements.islr
    if requirement is None or row.allowable is None:
        return
    name = row.metric.upper()
    ratio = 10 ** (requirement / 10)
    yield from _step(
        f"requirements.{row.metric} as a power ratio",
        *_equation(name, "10^(dB/10)", {"dB": requirement}, ratio, ""),
    )
    split = allocation.pslr if is_sinusoid else allocation.islr
    values = {name: ratio, "λ": mission.radar.wavelength, "s": split.of(platform)}
    equation = _equation("allowable", formulas.VIBRATION[row.metric], values, row.allowable, "m")
    yield from _step(f"{row.equation}, s is the {platform}’s share of power", *equation)


def _phase_aggregate(found: MissionFindings, row: Row, sources: Iterable[ErrorSource]) -> Iterator[str]:
    owner = {"timing": "clock"}.get(row.id.split(".")[0], row.id.split(".")[0])
    members = [
        source
        for source in sources
        if source.declared is not None
        and source.is_independent
        and (owner == "mission" or found.allocation.qpe.includes(source.owner, owner))
    ]
    rule = "sum" if row.id == "mission.autofocus_pull_in" else found.combine
    yield from _combined("QPE", rule, [(source.id, abs(source.qpe or 0.0)) for source in members], row)
    if row.id == "mission.autofocus_pull_in":
        values = {"N_pull": found.allocation.n_pull or 0.0}
        equation = _equation("allowable", "π*N_pull", values, row.allowable or 0.0, "rad")
        yield from _step("What autofocus corrects, Section VI", *equation)
    else:
        yield from _limit(found.allocation, owner, row.allowable or 0.0)


def _cubic_aggregate(found: MissionFindings, row: Row, sources: Iterable[ErrorSource]) -> Iterator[str]:
    members = [
        (source.id, abs(source.cubic or 0.0))
        for source in sources
        if source.declared is not None
        and source.owner != "mission"
        and (source.is_independent or found.combine == "each")
    ]
    yield from _combined("cubic phase", found.combine, members, row)
    if row.allowable is not None:
        yield from _step("Allowable", f"requirements.cubic_phase_error = {row.allowable:.6g} rad")


def _location_aggregate(
    mission: Mission, found: MissionFindings, row: Row, sources: Iterable[ErrorSource]
) -> Iterator[str]:
    plane = image_plane(found.geometry)
    members = []
    for source in sources:
        if source.declared is None or source.owner == "mission":
            continue
        moved = plane.displacement(source.effect, source.declared)
        if moved is not None and (source.is_independent or found.combine == "each"):
            members.append((source.id, math.hypot(*moved)))
    rule = "the longest sum over all signs of the vectors" if found.combine == "sum" else _RULES[found.combine]
    yield from _step(f"Displacements by (25), {rule}", *_listed(members, "m"))
    if row.declared is not None:
        yield f"    combined = {row.declared:.6g} m"
    if row.allowable is not None:
        place = _place(mission, ("requirements", "location_error"))
        yield from _step("Allowable", f"requirements.location_error = {row.allowable:.6g} m, {place}")


def _combined(symbol: str, rule: str, members: Sequence[tuple[str, float]], row: Row) -> Iterator[str]:
    yield from _step(f"{symbol} of the declared errors, {_RULES[rule]}", *_listed(members, "rad"))
    if row.declared is None or not members:
        return
    sizes = [number(size) for _, size in members if size] or ["0"]
    if rule == "sum":
        text = " + ".join(sizes)
    elif rule == "rss":
        text = "sqrt(" + " + ".join(f"{size}^2" for size in sizes) + ")"
    else:
        text = f"max(0, {', '.join(sizes)})"
    yield f"    combined = {text} = {row.declared:.6g} rad"


def _listed(members: Sequence[tuple[str, float]], unit: str) -> list[str]:
    width = max((len(name) for name, _ in members), default=0)
    return [f"{printable(name):<{width}}  {size:.6g} {unit}" for name, size in members if size] or ["none"]


def _verdict(row: Row) -> Iterator[str]:
    if row.declared is not None and row.allowable is not None and row.utilization is not None:
        values = {"declared": row.declared, "allowable": row.allowable}
        symbol, equation = _equation("utilization", "declared/allowable", values, row.utilization, "")
        yield from _step("Utilization", symbol, f"{equation} = {percent(row.utilization)}")
    yield ""
    texts = [text for text in (row.reason, *row.notes) if text]
    declared = "" if row.declared is None else f", declared {format_quantity(row.declared, row.unit)}"
    allowable = "" if row.allowable is None else f", allowable {format_quantity(row.allowable, row.unit, 3, 'down')}"
    yield f"{WORDS[row.status]}{declared}{allowable}"
    yield from (f"    {printable(text)}" for text in texts)


def _place(mission: Mission, path: KeyPath) -> str:
    place = mission.line(path)
    file = printable(mission.file)
    return file if place is None else f"{file}:{place.region.line}:{place.region.column}"


def _missing(mission: Mission, path: KeyPath) -> str:
    return f"Not declared: no {_dotted(path)} (the nearest key is at {_place(mission, path)})"


def _as_written(mission: Mission, path: KeyPath) -> str:
    """Key and text of the value, or of the nearest one above it that stands in the file."""
    while path and path not in mission.places:
        path = path[:-1]
    written = getattr(mission.places.get(path), "value", None)
    return f"{_dotted(path)}: {printable(written)}" if written is not None else _dotted(path)


def _dotted(path: KeyPath) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")
