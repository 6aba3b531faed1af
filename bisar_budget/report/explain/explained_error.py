"""The first half of an explanation: one error, from its line in the file to its phase, displacement and share."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import ROUNDING, SPEED_OF_LIGHT
from bisar_budget.effects.declared import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.effect import CLOCK_UNITS, MOTION_UNITS, PLATFORMS, ErrorSource, subject
from bisar_budget.faults import KeyPath, printable
from bisar_budget.findings.row import Row
from bisar_budget.geometry import FRAME_AXES, GroundVector, PlatformState
from bisar_budget.image_plane import LEADING
from bisar_budget.mission.model import Mission
from bisar_budget.ranges.exact_ranges import ExactRanges
from bisar_budget.report.explain import notation
from bisar_budget.report.explain.notation import Step, Sum, WorkedEquation, number, step, with_unit
from bisar_budget.report.words.sentences import dotted


def declaration(mission: Mission, source: ErrorSource) -> Iterator[Step]:
    """From the file to `declared`: where it stands, frame, coverage factor."""
    yield from stated(mission, source.path, source.declared, source.evidence)
    if source.declared is None:
        return
    platform, kind, axis = source.owner, source.subject.kind, source.subject.axis
    k = mission.allocation.coverage_factor
    if source.clock is not None:
        own = source.declared / k
    elif source.is_time_tag:
        owner = mission.common_motion_error if source.is_common else getattr(mission.platforms, platform).motion_error
        own = getattr(owner, kind)
    elif platform in PLATFORMS:
        error = getattr(mission.platforms, platform).motion_error
        values = error.stated(kind)
        if error.frame != "scene" and axis in notation.AXES:
            yield from _turned(mission, source, axis)
            return
        if error.covariance is not None and error.covariance.is_matrix and kind != "acceleration":
            yield step("One sigma is the root of the variance")
        own = values[FRAME_AXES[error.frame].index(axis)]
    elif source.is_common:
        own = getattr(mission.common_motion_error, kind)[FRAME_AXES[source.subject.frame].index(axis)]
    else:
        return  # an error of nobody's: no coverage factor
    worked = WorkedEquation("declared", "k*|value|", {"k": k, "value": own}, abs(source.declared), source.unit)
    yield step("Coverage factor allocation.coverage_factor", worked)


def _turned(mission: Mission, source: ErrorSource, axis: str) -> Iterator[Step]:
    """Errors of another frame along one axis of the scene."""
    platform, kind = source.owner, source.subject.kind
    error = getattr(mission.platforms, platform).motion_error
    axes = getattr(mission.platforms, platform).state.frame(error.frame)
    covariance = error.covariance if kind != "acceleration" else None
    k = mission.allocation.coverage_factor
    parts = [
        f"{number(k * value)}*{number(direction[notation.AXES.index(axis)])}"
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
    yield step(title, size, *sign)


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


def effect(analysis: Analysis, source: ErrorSource, model: str | None) -> Iterator[Step]:
    """From `declared` to the quadratic phase error; for one unit where nothing is declared."""
    size = 1.0 if source.declared is None else abs(source.declared)
    each = " of one unit" if source.declared is None else ""
    signed = math.copysign(size, source.declared or 1.0)
    qpe = abs(source.effect.qpe) * size
    platform, kind, axis = source.owner, source.subject.kind, source.subject.axis
    gates_by_full = model == "full"
    if gates_by_full and source.is_motion and (source.owner != "mission" or source.is_time_tag):
        unaware = ", which does not know the direct path" if analysis.mission.has_direct_path else ""
        yield step(f"The published model, for comparison{unaware}; what gates, the full model, comes after it")
    if not source.is_motion:
        yield step("Quadratic phase error, as declared", f"QPE = {size:.6g} rad")
    elif source.is_time_tag:
        yield from _time_tag_effect(analysis, source, size, each)
    elif source.is_common and source.subject.frame != "scene":
        yield from _common_projected_effect(analysis, source, size, each)
    elif source.is_common:
        yield from _common_effect(analysis, source, signed, each)
    elif source.owner == "mission":
        yield step("Published model: a height error moves the image, no quadratic term")
    elif source.clock is not None:
        yield from _clock_effect(analysis.mission, source, signed, each)
    elif axis in notation.AXES:
        values = _motion_values(analysis, platform, kind, axis, signed)
        for order, formula in notation.motion_coefficients(kind, axis, platform).items():
            result = signed * _coefficient(analysis.mission, source, order)
            title = f"{_table_i(kind, axis)}{each}"
            yield step(title, WorkedEquation(f"β̃_{order}", formula, values, result, RATES[order]))
        phase = notation.motion_phase(kind, axis, platform)
        if phase is not None:
            yield step(f"{source.equation}{each}", WorkedEquation("QPE", phase, values, qpe, "rad"))
    else:
        yield from _projected_effect(analysis, source, size, each)
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


def _motion_values(analysis: Analysis, platform: str, kind: str, axis: str, size: float) -> dict[str, float]:
    state: PlatformState = getattr(analysis.geometry, platform)
    index, s = notation.AXES.index(axis), platform[0]
    return {
        "T": analysis.mission.collection.aperture_time,
        "λ": analysis.mission.radar.wavelength,
        f"R_{s}": state.slant_range,
        f"{axis}_{s}": state.position[index],
        f"v_{axis}{s}": state.velocity[index],
        notation.motion_symbol(kind, axis, platform): size,
    }


# Terms of the clock by what setting left, time and frequency, and by aging since then: symbol, and t̃₀, t̃₁, t̃₂.
_OF_SETTING = {
    "time": ("x", ("x",)),
    "frequency": ("y", ("y*H", "y")),
    "oscillator": ("D", ("D*H^2/2", "D*H", "D/2")),
}
_TERM_UNITS = tuple(CLOCK_UNITS.values())


def _clock_effect(mission: Mission, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    kind, sync = source.subject.kind, mission.synchronization
    values = {
        "c": SPEED_OF_LIGHT,
        "T": mission.collection.aperture_time,
        "f_0": mission.radar.center_frequency,
    }
    if kind == "timing":
        order = tuple(CLOCK_UNITS).index(source.subject.axis)
        terms = {order: size}
    else:
        terms = {order: size * term for order, term in enumerate(source.clock or ()) if term}
        title = "Terms of the clock error t̃ at mid-aperture"
        lines: list[str | WorkedEquation] = []
        if kind == "frequency" and mission.has_direct_path:
            title = "Terms of the time y·Δt(τ) by which a wrong clock measures the echo behind the direct path wrong"
            lines = [f"t̃_{order} = {with_unit(term, _TERM_UNITS[order])}" for order, term in terms.items()]
        else:
            age = 0.0 if sync is None or sync.age is None else sync.age
            if age:
                title += f", H = {with_unit(age, 's')} after the clocks were set"
            symbol, formulas = _OF_SETTING[kind]
            for order, term in terms.items():
                lines.append(
                    WorkedEquation(f"t̃_{order}", formulas[order], {symbol: size, "H": age}, term, _TERM_UNITS[order])
                )
        yield step(f"{title}{each}", *lines)
    for order, term in terms.items():
        known, result = {**values, f"t̃_{order}": term}, SPEED_OF_LIGHT * term
        formula = notation.clock_coefficient(order)
        yield step(f"Table I row 1{each}", WorkedEquation(f"β̃_{order}", formula, known, result, RATES[order]))
        if order == 2:
            qpe = abs(source.effect.qpe * size)
            title = "Table I row 1, step of Table II"
            yield step(f"{title}{each}", WorkedEquation("QPE", notation.CLOCK_PHASE, known, qpe, "rad"))


def _table_i(kind: str, axis: str) -> str:
    return f"Table I row {2 + 3 * notation.AXES.index(axis) + list(MOTION_UNITS).index(kind)}"


def _source_of(analysis: Analysis, platform: str, kind: str, axis: str) -> ErrorSource:
    wanted = subject(platform, kind, axis)
    return next(one for one in analysis.sources if one.subject == wanted)


def _common_effect(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """The effects of both platforms, added with their signs."""
    _, _, kind, axis, *_ = source.subject
    values = {}
    for platform in PLATFORMS:
        leg, phase = _source_of(analysis, platform, kind, axis), f"φ_{platform[0]}"
        values[phase] = leg.effect.qpe * size
        known = _motion_values(analysis, platform, kind, axis, size)
        for order, formula in notation.motion_coefficients(kind, axis, platform).items():
            known[f"β̃_{order}"] = result = size * _coefficient(analysis.mission, leg, order)
            title = f"{_table_i(kind, axis)}, {platform}{each}"
            yield step(title, WorkedEquation(f"β̃_{order}", formula, known, result, RATES[order]))
        if kind != "position":
            title = f"Its phase at the aperture edge, {platform}"
            yield step(title, WorkedEquation(phase, notation.EDGE_PHASE, known, values[phase], "rad"))
    if kind == "position":
        yield step(f"Table I: a position error moves the image, no quadratic term{each}")
        return
    qpe = abs(source.effect.qpe * size)
    yield step(f"{source.equation}{each}, signed", WorkedEquation("QPE", "|φ_t + φ_r|", values, qpe, "rad"))


def _time_tag_effect(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """Velocity times the time tag, and by its rates what the published model has of it."""
    for name in (PLATFORMS[place] for place in source.platforms):
        state: PlatformState = getattr(analysis.geometry, name)
        values = {"δt": size}
        lines: list[str | WorkedEquation | Sum] = []
        for symbol, vector, unit in (("v", state.velocity, "m/s"), ("a", state.acceleration, "m/s^2")):
            parts = ", ".join(with_unit(part + 0.0, unit) for part in vector)
            lines.append(f"{symbol} = [{parts}] of the {name}")
            speed = math.sqrt(math.fsum(part * part for part in vector))
            if speed:
                per = {"v": "m", "a": "m/s"}[symbol]
                lines.append(
                    WorkedEquation(f"|{symbol}|*δt", f"{symbol}*δt", {symbol: speed, **values}, speed * size, per)
                )
        yield step(f"p(τ + δt) − p(τ): a position error v·δt at mid-aperture, a velocity error a·δt{each}", *lines)
    unit = f"rad per {source.unit}"
    yield step(
        f"{source.equation}: Table II times v, a and the jerk, added",
        f"QPE/unit = {with_unit(source.effect.qpe, unit)}",
    )
    yield _times_declared(source, size, each)


def _times_declared(source: ErrorSource, size: float, each: str) -> Step:
    """The effect of one unit times what is declared."""
    values = {"QPE/unit": abs(source.effect.qpe), "declared": size}
    qpe = abs(source.effect.qpe) * size
    return step(f"Quadratic phase error{each}", WorkedEquation("QPE", "QPE/unit*declared", values, qpe, "rad"))


def _projected(analysis: Analysis, source: ErrorSource, platform: str) -> tuple[str, float]:
    """Effects along the axes of the scene, projected on the axis of the error: the sum written out, and its value."""
    _, _, kind, axis, frame, _ = source.subject
    state: PlatformState = getattr(analysis.geometry, platform)
    direction = state.frame(frame)[FRAME_AXES[frame].index(axis)]
    effects = [_source_of(analysis, platform, kind, letter).effect.qpe for letter in notation.AXES]
    pairs = list(zip(effects, direction, strict=True))
    return " + ".join(f"{number(q)}*{number(d)}" for q, d in pairs), math.fsum(q * d for q, d in pairs)


def _common_projected_effect(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """The same components in each platform's own axes: projections of both, added with their signs."""
    axis, frame = source.subject.axis, source.subject.frame
    unit, values = f"rad per {source.unit}", dict[str, float]()
    for platform in PLATFORMS:
        terms, leg = _projected(analysis, source, platform)
        symbol = f"φ_{platform[0]}/unit"
        values[symbol] = leg
        yield step(
            f"{source.equation.removesuffix(', both platforms')}, {unit.replace('^2', '²')} along x, y, z of the "
            f"{platform}, times the {axis} axis of its {frame} frame",
            Sum(f"{symbol} = {terms} = {with_unit(leg, unit)}"),
        )
    values["declared"] = size
    qpe = abs(source.effect.qpe) * size
    worked = WorkedEquation("QPE", "|φ_t/unit + φ_r/unit|*declared", values, qpe, "rad")
    yield step(f"{source.equation}{each}, signed", worked)


def _projected_effect(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """Along an axis of another frame: the projection of the effects along the axes of the scene."""
    terms, _ = _projected(analysis, source, source.owner)
    unit = f"rad per {source.unit}"
    yield step(
        f"{source.equation}, {unit.replace('^2', '²')} along x, y, z times the {source.subject.axis} axis",
        Sum(f"QPE/unit = |{terms}| = {with_unit(abs(source.effect.qpe), unit)}"),
    )
    yield _times_declared(source, size, each)


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
        lines.append(WorkedEquation(symbol, "(adj_0*β̃_0 + adj_1*β̃_1)/(det Q)", values | entries, result, "m"))
    yield step("(25), (30): the image moves east, north by", *lines)


def place(mission: Mission, path: KeyPath) -> str:
    """File, line and column of a value, else of the nearest key above it."""
    line = mission.line(path)
    file = printable(mission.file)
    return file if line is None else f"{file}:{line.region.line}:{line.region.column}"


def stated(mission: Mission, path: KeyPath, declared: float | None, evidence: str | None) -> Iterator[Step]:
    """Where a value stands in the file and what shows it; else that the file is silent."""
    if declared is None:
        yield step(missing(mission, path))
        return
    yield step(f"Declared in {place(mission, path)}", as_written(mission, path))
    if evidence:
        yield step("Evidence", printable(evidence))


def missing(mission: Mission, path: KeyPath) -> str:
    """Say that the file is silent."""
    return f"Not declared: no {dotted(path)} (the nearest key is at {place(mission, path)})"


def as_written(mission: Mission, path: KeyPath) -> str:
    """Key and text of the value, or of the nearest one above it that stands in the file."""
    while path and path not in mission.places:
        path = path[:-1]
    written = getattr(mission.places.get(path), "value", None)
    return f"{dotted(path)}: {printable(written)}" if written is not None else dotted(path)


RATES = ("m", "m/s", "m/s²", "m/s³")  # units of the range error's coefficients
_SLOPE, _QUADRATIC, _CUBIC = 1, 2, 3  # rows of a fit
_ALIKE = 1e-6  # of a phase: by less, rounding decides which sign leaves more
_SHOWN_REST_RAD = 1e-6  # rms beyond the cubic; less is rounding


class Left:
    """The range error that an error of a signed size leaves at the point that it moves the scene centre to."""

    def __init__(self, analysis: Analysis, source: ErrorSource, size: float) -> None:
        full = analysis.full
        self.exact: ExactRanges = analysis.exact
        self.radar, self.size = analysis.mission.radar, size
        self.gain = float(analysis.allocation.autofocus_gain)
        self.place: GroundVector | None = full.displacement(source.full, size)
        self.is_small = not source.is_motion or full.is_small(source, abs(size))
        if self.is_small:
            self.ranges = full.left_over_small(source, size)
            return
        found = full.at(source, size)
        if found is None:
            self.place, self.ranges = None, []
            return
        whole = abs(size) * full.largest_range_error(source) + math.hypot(*found.displacement)
        east, north = _without_rounding(found.displacement, whole)
        self.place = (east, north)
        self.ranges = _without_rounding(full.left_over(source, size, found.displacement), whole)

    @cached_property
    def orders(self) -> list[float]:
        """Mean, and orders 1 to 3 at the aperture edge, signed. [m]"""
        return [
            math.fsum(w * m for w, m in zip(weights, self.ranges, strict=True)) for weights in self.exact.fit.tolist()
        ]

    @cached_property
    def beyond(self) -> list[float]:
        """Range error at the nodes less orders 0 to 3. [m]"""
        of_orders = np.polynomial.legendre.legvander(self.exact.sampling.places, _CUBIC) @ (self.orders / LEADING)
        return _without_rounding((np.array(self.ranges) - of_orders).tolist(), self.rms(self.ranges))

    def rms(self, values: Sequence[float]) -> float:
        """Root of the mean square over the aperture of values at the nodes. [m]"""
        return math.sqrt(math.fsum(w * m * m for w, m in zip(self.exact.fit[0].tolist(), values, strict=True)))

    @property
    def k(self) -> float:
        """2π over the wavelength. [rad/m]"""
        return float(self.exact.k[0])

    @property
    def is_turned(self) -> bool:
        """Whether orders have no meaning: a line of sight turns by more than a radian."""
        return bool(self.exact.is_turned[0])

    def phase(self, which: int) -> float:
        """Quadratic or cubic phase at the aperture edge, signed. [rad]"""
        return self.k * self.orders[which]

    @property
    def rest(self) -> float:
        """Rms beyond the cubic. [rad]"""
        return self.k * self.rms(self.beyond)

    @property
    def hidden(self) -> float:
        """Quadratic phase of as much loss as what band and turn do not resolve. [rad]"""
        square = float(self.exact.band[0]) * self.rms(self.ranges) ** 2 + self.orders[_SLOPE] ** 2 / 3
        if self.is_turned:
            square += 4 * self.orders[_CUBIC] ** 2 / 175 + self.rms(self.beyond) ** 2
        return self.k * math.sqrt(45 / 4 * square)

    @property
    def judged(self) -> float:
        """The phase that is held to a limit with the gain of autofocus in it. [rad]"""
        return math.hypot(self.phase(_QUADRATIC), self.gain * self.hidden)

    def sum(self, symbol: str, which: int) -> Sum:
        """The sum that gives a phase."""
        terms = self._terms(which)
        return Sum(
            f"{symbol} = 2*π/{number(self.radar.wavelength)}*({terms}) = {with_unit(self.phase(which), 'rad')}"
        )

    def steps(self, mark: str = "full") -> Iterator[Step]:
        """From the range error left to the phase that is judged."""
        values = {"B": self.radar.bandwidth, "f_0": self.radar.center_frequency}
        b = math.sqrt(float(self.exact.band[0]))
        orders: list[WorkedEquation | str] = [
            WorkedEquation("b", "B/(sqrt(12)*f_0)", values, b, ""),
            self._squares("ρ_rms", self.ranges),
            Sum(f"ρ_1 = {self._terms(_SLOPE)} = {with_unit(self.orders[_SLOPE], 'm')}"),
        ]
        formula, of_turn = "b^2*ρ_rms^2 + ρ_1^2/3", ""
        values = {"λ": self.radar.wavelength, "b": b, "ρ_rms": self.rms(self.ranges), "ρ_1": self.orders[_SLOPE]}
        if self.is_turned:
            orders += [
                Sum(f"ρ_3 = {self._terms(_CUBIC)} = {with_unit(self.orders[_CUBIC], 'm')}"),
                self._squares("ρ_rest", self.beyond),
            ]
            formula += " + 4*ρ_3^2/175 + ρ_rest^2"
            values |= {"ρ_3": self.orders[_CUBIC], "ρ_rest": self.rms(self.beyond)}
            of_turn = "; a line of sight turns by more than a radian, so that cubic and rest are in it too"
        yield step(
            "Rms of what is left, ρ_1 its slope at the aperture edge (P₁): what the band and the turn leave of them",
            *orders,
        )
        symbol = f"hidden_{mark}"
        hidden = WorkedEquation(symbol, f"2*π/λ*sqrt(45/4*({formula}))", values, self.hidden, "rad")
        yield step(f"Hidden phase: a quadratic one that costs the peak as much{of_turn}", hidden)
        values = {f"QPE_{mark}": self.phase(_QUADRATIC), symbol: self.hidden}
        equal_loss = math.hypot(self.phase(_QUADRATIC), self.hidden)
        yield step(
            "Quadratic phase of equal loss" + ("" if self.gain > 1 else ", which is judged"),
            WorkedEquation(f"equal_{mark}", f"sqrt(QPE_{mark}^2 + {symbol}^2)", values, equal_loss, "rad"),
        )
        if self.gain > 1:
            worked = WorkedEquation(
                f"judged_{mark}",
                f"sqrt(QPE_{mark}^2 + (gain*{symbol})^2)",
                {**values, "gain": self.gain},
                self.judged,
                "rad",
            )
            yield step("Judged, against a limit that holds the gain: autofocus corrects no hidden phase", worked)

    def listed(self, values: Sequence[float]) -> list[str]:
        """Values at the nodes, with their times."""
        times = self.exact.times[:, 0].tolist()
        return [f"{time:+.6g} s: {metres:.6g} m" for time, metres in zip(times, values, strict=True)]

    def rest_steps(self) -> Iterator[Step]:
        """Range error left beyond the cubic, and its rms."""
        yield step("Beyond P₃ there", *self.listed(self.beyond))
        terms = self._products(self.beyond)
        wavelength = number(self.radar.wavelength)
        worked = Sum(f"rest_full = 2*π/{wavelength}*sqrt({terms}) = {with_unit(self.rest, 'rad')}")
        yield step("Rms phase of it, which spreads", worked)

    def _terms(self, which: int) -> str:
        pairs = zip(self.exact.fit[which].tolist(), self.ranges, strict=True)
        return " + ".join(f"{number(w)}*{number(m)}" for w, m in pairs)

    def _products(self, values: Sequence[float]) -> str:
        pairs = zip(self.exact.fit[0].tolist(), values, strict=True)
        return " + ".join(f"{number(w)}*{number(m)}^2" for w, m in pairs)

    def _squares(self, symbol: str, values: Sequence[float]) -> Sum:
        return Sum(f"{symbol} = sqrt({self._products(values)}) = {with_unit(self.rms(values), 'm')}")


def _without_rounding(values: Sequence[float], whole: float) -> list[float]:
    """Values with 0 for what rounding leaves of differences of a size."""
    return [value if abs(value) > ROUNDING * whole else 0.0 for value in values]


def _judged(left: Left) -> float:
    return left.judged


def _of_order(which: int) -> Callable[[Left], float]:
    return lambda left: abs(left.phase(which))


def _rest(left: Left) -> float:
    return left.rest


def worse(analysis: Analysis, source: ErrorSource, size: float, of: Callable[[Left], float] = _judged) -> Left:
    """The range error that is left by the sign that leaves more of a phase."""
    signs = [Left(analysis, source, signed) for signed in (size, -size)]
    if signs[0].is_small or not signs[1].ranges:
        return signs[0]
    stated, other = (of(left) if left.ranges else math.inf for left in signs)
    return signs[other > stated * (1 + _ALIKE)]


def full_chain(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """From the signed size of an error [unit], or one unit of what is not declared, to its phases by the full model.

    `each` is said of what is not declared.
    """
    each = each.replace(" of ", ", for ")
    if not source.is_heard:
        yield step(f"Full model{each}: {analysis.full.no_limit(source)}")
        return
    left = worse(analysis, source, size)
    if not left.ranges:
        yield step(f"Full model{each}: no ground point has the range history that this error leaves")
        return
    sign = "" if left.is_small or left.size == size else ", with the other sign, which leaves more"
    yield step(
        f"Full model{each}{sign}: the ground point at which V = Var(ρ) + b²·⟨ρ²⟩ is least, ρ the range error that is "
        "left, ⟨ ⟩ its mean over the aperture, b² the variance of the frequency over the band in units of f_0²",
        *_placed(left),
    )
    yield step(
        f"ρ there, {_left_of(analysis.exact)}, at the nodes of the fit",
        *left.listed(left.ranges),
    )
    yield step(
        "Quadratic phase at the aperture edge, 3/2 of P₂: weights of the fit times what is left",
        left.sum("QPE_full", _QUADRATIC),
    )
    yield from left.steps()
    by_quadratic = worse(analysis, source, size, _of_order(_QUADRATIC))
    if by_quadratic.size != left.size:
        yield step("Quadratic phase by the other sign, which is larger", by_quadratic.sum("QPE_full", _QUADRATIC))
    if source.is_motion and analysis.mission.requirements.cubic_phase_error is not None:
        by_cubic = worse(analysis, source, size, _of_order(_CUBIC))
        yield step("Cubic phase there, 5/2 of P₃", by_cubic.sum("cubic_full", _CUBIC))
    by_rest = worse(analysis, source, size, _rest)
    if by_rest.rest > max(_SHOWN_REST_RAD, float(by_rest.exact.rounding[0])):
        yield from by_rest.rest_steps()


def _left_of(exact: ExactRanges) -> str:
    if exact.has_direct_path:  # which is the clock
        return "|r_t| + |r_r| − |r_t − r_r| − (|r̂_t − x̂| + |r̂_r − x̂| − |r̂_t − r̂_r|)"
    return "|r_t| + |r_r| + c·t̃ − |r̂_t − x̂| − |r̂_r − x̂|"


def for_comparison(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """The result of the full model for an error that the published one judges."""
    left = worse(analysis, source, size, _of_order(_QUADRATIC))
    if not left.ranges:
        yield step(f"Full model{each}, for comparison: no ground point has the range history")
        return
    yield step(
        f"Full model{each}, for comparison: weights of the fit times the range error left (--model full lists it)",
        left.sum("QPE_full", _QUADRATIC),
    )


def at_the_allowable(
    analysis: Analysis, source: ErrorSource, allowable: float, requirement: str = QUADRATIC
) -> Iterator[Step]:
    """Show that an allowable that was searched for is at its limit."""
    sizes = [Left(analysis, source, signed) for signed in (allowable, -allowable)]
    if not all(left.ranges for left in sizes):
        return
    reached = {LOCATION: _moved, CUBIC: _of_order(_CUBIC), QUADRATIC: _judged}[requirement]
    left = max(sizes, key=reached)
    size = f"{number(left.size)} {source.unit.replace('^2', '²')}"
    title = f"At {size}, the smallest size of either sign that reaches the limit, exact ranges give"
    if requirement == LOCATION:
        x, y = left.place or (0.0, 0.0)
        yield step(title, Sum(f"moved = sqrt({number(x)}^2 + {number(y)}^2) = {with_unit(math.hypot(x, y), 'm')}"))
    elif requirement == CUBIC:
        yield step(title, left.sum("cubic_there", _CUBIC))
    else:
        yield step(title, left.sum("QPE_there", _QUADRATIC))
        yield from left.steps("there")


def _moved(left: Left) -> float:
    return math.hypot(*(left.place or (0.0, 0.0)))


def end_of_the_image(size: float, unit: str) -> Iterator[Step]:
    """Say what it means that an image ends."""
    yield step(
        "End of the image: no ground point has the range history of a larger error, of one sign or the other",
        "The point is followed as the error grows, to where range and Doppler gradients become parallel there",
        f"by_image = {with_unit(size, unit)}, a limit whatever phase or displacement is allowed",
    )


def no_limit(row: Row) -> Step:
    """The step of a row that nothing limits."""
    return step("Allowable: no limit", printable(row.reason or "no requirement limits this error"))


def smallest_size(row: Row, sizes: Mapping[str, float]) -> Iterator[Step]:
    """The allowable of a row: the smallest of the sizes that its requirements allow, each by its symbol."""
    if row.allowable is None or not sizes:
        yield no_limit(row)
        return
    found = list(sizes.values())
    text = f"min({', '.join(map(number, found))})" if len(found) > 1 else number(found[0])
    title = f"Allowable: the smallest, by {', '.join(sizes)}"
    if row.unit != "dB":
        yield step(title, Sum(f"allowable = {text} = {with_unit(row.allowable, row.unit)}"))
        return
    factor = min(found)
    yield step(f"{title}: a factor of the noise's amplitude", Sum(f"factor = {text} = {with_unit(factor, '')}"))
    worked = WorkedEquation("allowable", "20*log(factor)/log(10)", {"factor": factor}, row.allowable, "dB")
    yield step("As a level, against the noise that is declared: it may rise by that much", worked)
    yield step("Utilization", WorkedEquation("utilization", "1/factor", {"factor": factor}, 1 / factor, ""))


def _placed(left: Left) -> Sequence[str]:
    if left.place is None or left.place == (0.0, 0.0):
        return ("the scene centre itself",)
    east, north = left.place
    return (f"x̂ = {with_unit(east, 'm')} east", f"ŷ = {with_unit(north, 'm')} north")


RULES = {"each": "the largest", "sum": "the sum", "rss": "the root-sum-square"}


def limit_steps(allocation: Allocation, owner: str, limit: float) -> Iterator[Step]:
    """Budget times share times gain."""
    total, share, gain = allocation.qpe_total, allocation.qpe.of(owner), allocation.autofocus_gain
    whose = {
        "clock": "the receiver’s share" if allocation.qpe.clock is None else "the clock’s share",
        "mission": "all of it: it belongs to no platform",
    }
    yield from autofocus_gain(allocation)
    values = {"total": total, "share": share, "gain": gain}
    title = f"Budget requirements.quadratic_phase_error, {whose.get(owner, f'the {owner}’s share')}"
    yield step(title, WorkedEquation("limit", "total*share*gain", values, limit, "rad"))


def autofocus_gain(allocation: Allocation) -> Iterator[Step]:
    """The steps to the gain, the factor by which autofocus multiplies limits."""
    if allocation.n_pull is None:
        yield step("No autofocus (autofocus.n_pull): gain = 1")
        return
    if allocation.n_pull_stated != allocation.n_pull:
        title = f"autofocus.n_pull of {allocation.n_pull_stated:g} counts up to half a range cell of range walk, f0/B"
        yield step(title, f"N_pull = {allocation.n_pull:.6g}")
    values = {"N_pull": allocation.n_pull, "q": allocation.qpe_total}
    raw = math.pi * allocation.n_pull / allocation.qpe_total
    worked = WorkedEquation("gain", notation.AUTOFOCUS_GAIN, values, raw, "")
    yield step("Autofocus, Section VI" + (", never below 1" if raw < 1 else ""), worked)


def combined(
    title: str,
    rule: str,
    parts: Sequence[tuple[str, float]],
    total: float | None,
    *,
    symbol: str = "combined",
    unit: str = "rad",
) -> Iterator[Step]:
    """The total of errors by a rule: names and sizes, and the sum written out; `total` None: it has no value."""
    title = f"{title}, {RULES[rule]}"
    # What is left of terms that cancel exactly is rounding.
    largest = max((abs(size) for _, size in parts), default=0.0)
    members = [(name, abs(size) if abs(size) > ROUNDING * largest else 0.0) for name, size in parts]
    width = max((len(name) for name, _ in members), default=0)
    listed = [f"{printable(name):<{width}}  {size:.6g} {unit}" for name, size in members if size] or ["none"]
    if total is None or not members:
        yield step(title, *listed)
        return
    sizes = [number(size) for _, size in members if size] or ["0"]
    if rule == "sum":
        text = " + ".join(sizes)
    elif rule == "rss":
        text = "sqrt(" + " + ".join(f"{size}^2" for size in sizes) + ")"
    else:
        text = f"max(0, {', '.join(sizes)})"
    yield step(title, *listed, Sum(f"{symbol} = {text} = {total:.6g} {unit}"))
