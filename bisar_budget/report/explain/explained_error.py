"""Explanation steps for an error: from its line in the file to its phase, displacement and allowable."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.constants import SPEED_OF_LIGHT_MPS, VECTOR_ROUNDING_FRACTION
from bisar_budget.effects.declared import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.effect import PLATFORMS, ErrorSource, subject
from bisar_budget.error_kinds.clock_kinds import TIMING_KIND, ClockKind
from bisar_budget.error_kinds.path_kinds import StateKind
from bisar_budget.faults import KeyPath, printable
from bisar_budget.findings.row import Row
from bisar_budget.geometry import FRAME_AXES, GroundVector, PlatformState, plain_vector
from bisar_budget.image_plane import LEGENDRE_LEADING
from bisar_budget.mission.model import Mission
from bisar_budget.ranges.exact_ranges import ExactRanges
from bisar_budget.report.explain import notation
from bisar_budget.report.explain.notation import Step, Sum, WorkedEquation, number, step, with_unit
from bisar_budget.report.words.sentences import dotted


def declaration(mission: Mission, source: ErrorSource) -> Iterator[Step]:
    """Yield the explanation steps that derive the value `declared` from the line in the mission file.

    They show the value in the file, its frame and the coverage factor.
    """
    yield from stated(mission, source.path, source.declared, source.evidence)
    if source.declared is None or not source.is_covered:
        return
    if not source.is_independent:
        yield from _rotated_declaration(mission, source, source.subject.axis)
        return
    if source.kind.has_covariance and source.owner in PLATFORMS:
        covariance = getattr(mission.platforms, source.owner).motion_error.covariance
        if covariance is not None and covariance.is_matrix:
            yield step("One sigma is the root of the variance")
    k = mission.allocation.coverage_factor
    values = {"k": k, "value": source.declared / k}
    worked = WorkedEquation("declared", "k*|value|", values, abs(source.declared), source.unit)
    yield step("Coverage factor allocation.coverage_factor", worked)


def _rotated_declaration(mission: Mission, source: ErrorSource, axis: str) -> Iterator[Step]:
    """Yield the explanation step that converts errors from the frame in which they are stated to the scene axes.

    The result of the step is the declared error along `axis`.
    """
    platform, kind = source.owner, source.subject.kind
    error = getattr(mission.platforms, platform).motion_error
    axes = getattr(mission.platforms, platform).state.frame(error.frame)
    covariance = error.covariance if source.kind.has_covariance else None
    k = mission.allocation.coverage_factor
    products = [
        f"{number(k * value)}*{number(direction[notation.AXIS_LETTERS.index(axis)])}"
        for value, direction in zip(error.stated(kind), axes, strict=True)
    ]
    if covariance is not None:
        text = _quadratic_form(products, covariance.block(kind))
        rule = "a covariance turns as AᵀCA"
    elif error.distribution_of(kind) == "normal":
        text = "sqrt(" + " + ".join(f"({product})^2" for product in products) + ")"
        rule = "one-sigma values turn like a covariance"
    else:
        text = " + ".join(f"|{product}|" for product in products)
        rule = "bounds add as magnitudes"
    title = f"Along {axis} from the {error.frame} frame ({', '.join(FRAME_AXES[error.frame])}): {rule}"
    size = Sum(f"declared = {text} = {with_unit(abs(source.declared or 0.0), source.unit)}")
    sign = ("from here on with the sign of the parts’ sum",) if (source.declared or 0.0) < 0 else ()
    yield step(title, size, *sign)


def _quadratic_form(products: Sequence[str], correlation: Sequence[Sequence[float]]) -> str:
    """Write √(Σ ρᵢⱼ pᵢ pⱼ) as text, with the correlation coefficients ρᵢⱼ and the `products` pᵢ."""
    terms = [f"({product})^2" for product in products]
    terms += [
        f"2*{number(rho)}*{products[i]}*{products[j]}"
        for i, row in enumerate(correlation)
        for j, rho in enumerate(row[:i])
        if rho
    ]
    return "sqrt(" + " + ".join(terms) + ")"


def effect(analysis: Analysis, source: ErrorSource, model: str | None) -> Iterator[Step]:
    """Yield the explanation steps that derive the quadratic phase error from the value `declared`.

    If the error is not declared, the steps are for an error of one unit.
    """
    size = 1.0 if source.declared is None else abs(source.declared)
    each = " of one unit" if source.declared is None else ""
    signed = math.copysign(size, source.declared or 1.0)
    gates_by_full = model == "full"
    if gates_by_full and source.is_motion and (source.owner != "mission" or source.is_time_tag):
        unaware = ", which ignores the direct path" if analysis.mission.has_direct_path else ""
        yield step(f"The published model, for comparison{unaware}; the full model, which decides, follows")
    if source.is_registered:
        yield from _registered_effect(analysis, source, signed, each)
    else:
        yield from source.kind.find_in(SOURCE_STEPS)(analysis, source, signed, each)
    if not source.is_motion:
        return
    if gates_by_full:
        yield from full_chain(analysis, source, signed, each)
    else:
        yield from for_comparison(analysis, source, signed, each)
        yield from _displacement(analysis, source)


def _coefficient(mission: Mission, source: ErrorSource, order: int) -> float:
    """Coefficient β̃ₙ of the range error that one unit of an error causes, with n = `order`. [m/sⁿ per unit]

    β̃₂ and β̃₃ are computed from the phases at the aperture edge, which are (2π/λ)·β̃ₙ·(T/2)ⁿ.
    """
    if order < 2:
        return float(source.effect[order])
    phase = float(source.effect.qpe if order == 2 else source.effect.cubic)
    return phase * mission.radar.wavelength / (2 * math.pi * (mission.collection.aperture_time / 2) ** order)


def _motion_values(analysis: Analysis, platform: str, kind: StateKind, axis: str, size: float) -> dict[str, float]:
    state: PlatformState = getattr(analysis.geometry, platform)
    index, s = notation.AXIS_LETTERS.index(axis), platform[0]
    return {
        "T": analysis.mission.collection.aperture_time,
        "λ": analysis.mission.radar.wavelength,
        f"R_{s}": float(state.slant_range),
        f"{axis}_{s}": float(state.position[index]),
        f"v_{axis}{s}": float(state.velocity[index]),
        notation.motion_symbol(kind, axis, platform): size,
    }


_TERM_UNITS = tuple(size.unit for size in TIMING_KIND.sizes.values())


def _clock_effect(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    mission, kind = analysis.mission, source.kind
    assert isinstance(kind, ClockKind)
    sync, clock = mission.synchronization, kind.clock_size(source.subject.axis)
    values = {
        "c": SPEED_OF_LIGHT_MPS,
        "T": mission.collection.aperture_time,
        "f_0": mission.radar.center_frequency,
    }
    if not clock.symbol:
        terms = {clock.order: size}
    else:
        terms = {order: size * float(term) for order, term in enumerate(source.clock or ()) if term}
        title = "Terms of the clock error t̃ at mid-aperture"
        lines: list[str | WorkedEquation] = []
        if mission.has_direct_path and clock.direct_title:
            title = clock.direct_title
            lines = [f"t̃_{order} = {with_unit(term, _TERM_UNITS[order])}" for order, term in terms.items()]
        else:
            age = 0.0 if sync is None or sync.age is None else sync.age
            if age:
                title += f", H = {with_unit(age, 's')} after the clocks were set"
            values_of_terms = {clock.symbol: size, "H": age}
            for order, term in terms.items():
                formula = clock.formulas[order]
                lines.append(WorkedEquation(f"t̃_{order}", formula, values_of_terms, term, _TERM_UNITS[order]))
        yield step(f"{title}{each}", *lines)
    for order, term in terms.items():
        known_values, result = {**values, f"t̃_{order}": term}, SPEED_OF_LIGHT_MPS * term
        formula = notation.clock_coefficient(order)
        yield step(f"Table I row 1{each}", WorkedEquation(f"β̃_{order}", formula, known_values, result, RATES[order]))
        if order == 2:
            qpe = abs(float(source.effect.qpe) * size)
            title = "Table I row 1, step of Table II"
            yield step(f"{title}{each}", WorkedEquation("QPE", notation.CLOCK_PHASE, known_values, qpe, "rad"))


def _stated_effect(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    yield step("Quadratic phase error, as declared", f"QPE = {abs(size):.6g} rad")


def _height_effect(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    yield step("Published model: a height error moves the image, no quadratic term")


def _state_effect(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """Yield the explanation steps for an error of position, velocity or acceleration, in any frame."""
    axis, platform, kind = source.subject.axis, source.owner, source.kind
    assert isinstance(kind, StateKind)
    if source.is_common and source.subject.frame != "scene":
        yield from _common_projected_effect(analysis, source, abs(size), each)
    elif source.is_common:
        yield from _common_effect(analysis, source, kind, size, each)
    elif axis not in notation.AXIS_LETTERS:
        yield from _projected_effect(analysis, source, abs(size), each)
    else:
        values = _motion_values(analysis, platform, kind, axis, size)
        for order, formula in notation.motion_coefficients(kind, axis, platform).items():
            result = size * _coefficient(analysis.mission, source, order)
            title = f"{_table_i(kind, axis)}{each}"
            yield step(title, WorkedEquation(f"β̃_{order}", formula, values, result, RATES[order]))
        phase = notation.motion_phase(kind, axis, platform)
        if phase is not None:
            qpe = abs(float(source.effect.qpe)) * abs(size)
            yield step(f"{source.equation}{each}", WorkedEquation("QPE", phase, values, qpe, "rad"))


def _table_i(kind: StateKind, axis: str) -> str:
    """Label of the row in Table I of Rigling & Moses for a position, velocity or acceleration error along an axis."""
    return f"Table I row {2 + 3 * notation.AXIS_LETTERS.index(axis) + kind.order}"


def _source_of(analysis: Analysis, platform: str, kind: str, axis: str) -> ErrorSource:
    error_subject = subject(platform, kind, axis)
    return next(source for source in analysis.sources if source.subject == error_subject)


def _common_effect(
    analysis: Analysis, source: ErrorSource, kind: StateKind, size: float, each: str
) -> Iterator[Step]:
    """Yield the explanation steps for an error that both platforms have in common.

    The error causes a phase through each platform, and the two phases are added with their signs.
    """
    axis, values = source.subject.axis, dict[str, float]()
    for platform in PLATFORMS:
        leg, phase = _source_of(analysis, platform, kind.name, axis), f"φ_{platform[0]}"
        values[phase] = float(leg.effect.qpe) * size
        leg_values = _motion_values(analysis, platform, kind, axis, size)
        for order, formula in notation.motion_coefficients(kind, axis, platform).items():
            leg_values[f"β̃_{order}"] = result = size * _coefficient(analysis.mission, leg, order)
            title = f"{_table_i(kind, axis)}, {platform}{each}"
            yield step(title, WorkedEquation(f"β̃_{order}", formula, leg_values, result, RATES[order]))
        if kind.order > 0:
            title = f"Its phase at the aperture edge, {platform}"
            yield step(title, WorkedEquation(phase, notation.EDGE_PHASE, leg_values, values[phase], "rad"))
    if kind.order == 0:
        yield step(f"Table I: a position error moves the image, no quadratic term{each}")
        return
    qpe = abs(float(source.effect.qpe) * size)
    yield step(f"{source.equation}{each}, signed", WorkedEquation("QPE", "|φ_t + φ_r|", values, qpe, "rad"))


def _time_tag_effect(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """Yield the explanation steps for a time-tag error.

    They show the position and velocity errors that it causes, and its phase according to the published model.
    """
    size = abs(size)
    for name in (PLATFORMS[index] for index in source.platforms):
        state: PlatformState = getattr(analysis.geometry, name)
        values = {"δt": size}
        lines: list[str | WorkedEquation | Sum] = []
        for symbol, vector, unit in (
            ("v", plain_vector(state.velocity), "m/s"),
            ("a", plain_vector(state.acceleration), "m/s^2"),
        ):
            components = ", ".join(with_unit(component + 0.0, unit) for component in vector)
            lines.append(f"{symbol} = [{components}] of the {name}")
            speed = math.sqrt(math.fsum(component * component for component in vector))
            if speed:
                per = {"v": "m", "a": "m/s"}[symbol]
                lines.append(
                    WorkedEquation(f"|{symbol}|*δt", f"{symbol}*δt", {symbol: speed, **values}, speed * size, per)
                )
        yield step(f"p(τ + δt) − p(τ): a position error v·δt at mid-aperture, a velocity error a·δt{each}", *lines)
    unit = f"rad per {source.unit}"
    yield step(
        f"{source.equation}: Table II times v, a and the jerk, added",
        f"QPE/unit = {with_unit(float(source.effect.qpe), unit)}",
    )
    yield _times_declared(source, size, each)


def _registered_effect(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """Yield the explanation steps for an error of a registered kind, which is defined by an installed package.

    They show the description of the kind, and the phase of the error according to the published model.
    """
    yield step(f"{source.kind.name}, a registered kind of error ({source.equation}): {source.kind.description}")
    unit = f"rad per {source.unit}"
    yield step(
        "Its motion along the line of sight of mid-aperture, its quadratic part",
        f"QPE/unit = {with_unit(float(source.effect.qpe), unit)}",
    )
    yield _times_declared(source, abs(size), each)


# Steps of the published model for a signed size, by kind of error.
SOURCE_STEPS: Mapping[str, Callable[[Analysis, ErrorSource, float, str], Iterator[Step]]] = {
    "position": _state_effect,
    "velocity": _state_effect,
    "acceleration": _state_effect,
    "time_tag": _time_tag_effect,
    "terrain": _height_effect,
    "timing": _clock_effect,
    "time": _clock_effect,
    "frequency": _clock_effect,
    "oscillator": _clock_effect,
    "other": _stated_effect,
}


def _times_declared(source: ErrorSource, size: float, each: str) -> Step:
    """Return the explanation step that multiplies the effect of one unit by the declared size."""
    values = {"QPE/unit": abs(float(source.effect.qpe)), "declared": size}
    qpe = abs(float(source.effect.qpe)) * size
    return step(f"Quadratic phase error{each}", WorkedEquation("QPE", "QPE/unit*declared", values, qpe, "rad"))


def _projected(analysis: Analysis, source: ErrorSource, platform: str) -> tuple[str, float]:
    """Quadratic phase per unit of an error along any axis, as a sum over the axes of the scene.

    The phase due to an error along a scene axis is multiplied by the cosine of the angle between this axis and the
    axis of the error. The sum is returned as text and as a number [rad/unit].
    """
    _, _, kind, axis, frame, _ = source.subject
    state: PlatformState = getattr(analysis.geometry, platform)
    direction = plain_vector(state.frame(frame)[FRAME_AXES[frame].index(axis)])
    effects = [float(_source_of(analysis, platform, kind, letter).effect.qpe) for letter in notation.AXIS_LETTERS]
    pairs = list(zip(effects, direction, strict=True))
    return " + ".join(f"{number(q)}*{number(d)}" for q, d in pairs), math.fsum(q * d for q, d in pairs)


def _common_projected_effect(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """Yield the explanation steps for an error with equal components in the frames of both platforms.

    The effects through both platforms are projected on the axis of the error, and added with their signs.
    """
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
    qpe = abs(float(source.effect.qpe)) * size
    worked = WorkedEquation("QPE", "|φ_t/unit + φ_r/unit|*declared", values, qpe, "rad")
    yield step(f"{source.equation}{each}, signed", worked)


def _projected_effect(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """Yield the explanation steps for an error along an axis of a frame other than the scene.

    The effects of errors along the scene axes are projected on this axis and added.
    """
    terms, _ = _projected(analysis, source, source.owner)
    unit = f"rad per {source.unit}"
    yield step(
        f"{source.equation}, {unit.replace('^2', '²')} along x, y, z times the {source.subject.axis} axis",
        Sum(f"QPE/unit = |{terms}| = {with_unit(abs(float(source.effect.qpe)), unit)}"),
    )
    yield _times_declared(source, size, each)


def _displacement(analysis: Analysis, source: ErrorSource) -> Iterator[Step]:
    """Yield the explanation step for the displacement of the image by equation (25) of Rigling & Moses."""
    published, by_table = analysis.published, source.effect
    if published.degeneracy or source.declared is None:
        return
    displacement = published.displacement(by_table, source.declared)
    if displacement is None or displacement == (0.0, 0.0):
        return
    values = {
        "β̃_0": by_table.constant * source.declared,
        "β̃_1": by_table.linear * source.declared,
        "det Q": published.plane.determinant,
    }
    lines: list[WorkedEquation] = []
    for symbol, (first, second), result in zip(("x̃", "ỹ"), published.plane.adjugate, displacement, strict=True):
        entries = {"adj_0": first, "adj_1": second}
        lines.append(WorkedEquation(symbol, "(adj_0*β̃_0 + adj_1*β̃_1)/(det Q)", values | entries, result, "m"))
    yield step("(25), (30): the image moves east, north by", *lines)


def location(mission: Mission, path: KeyPath) -> str:
    """Location of a value as `file:line:column`; if its key is missing, the location of the nearest parent."""
    line = mission.line(path)
    file = printable(mission.file)
    return file if line is None else f"{file}:{line.region.line}:{line.region.column}"


def stated(mission: Mission, path: KeyPath, declared: float | None, evidence: str | None) -> Iterator[Step]:
    """Yield the explanation steps that show the line of a declared value in the file, and its evidence.

    If the value is missing, there is a single step, which names the missing key.
    """
    if declared is None:
        yield step(missing(mission, path))
        return
    yield step(f"Declared in {location(mission, path)}", as_written(mission, path))
    if evidence:
        yield step("Evidence", printable(evidence))


def missing(mission: Mission, path: KeyPath) -> str:
    """Sentence about a key that is missing in the file, with the location of the nearest parent key."""
    return f"Not declared: no {dotted(path)} (the nearest key is at {location(mission, path)})"


def as_written(mission: Mission, path: KeyPath) -> str:
    """A value of the mission file as `key: value`; if the file lacks its key, the nearest parent key is used."""
    path = mission.written_path(path)
    while path and path not in mission.places:
        path = path[:-1]
    text = getattr(mission.places.get(path), "value", None)
    return f"{dotted(path)}: {printable(text)}" if text is not None else dotted(path)


RATES = ("m", "m/s", "m/s²", "m/s³")  # units of the range error's coefficients
_SLOPE_ORDER, _QUADRATIC_ORDER, _CUBIC_ORDER = 1, 2, 3  # rows of a fit
_SAME_PHASE_FRACTION = 1e-6  # difference between the phases of both signs that may be rounding
_MIN_SHOWN_BEYOND_RAD = 1e-6  # rms phase beyond the cubic that may be rounding


class Residual:
    """Residual range error at the displaced image of the scene centre, for one error of given size and sign.

    `image_point` is the displacement of the image, east and north [m], or None if there is no image. `ranges` has the
    residual range errors at the nodes of the polynomial fit [m], and is empty if there is no image.
    """

    def __init__(self, analysis: Analysis, source: ErrorSource, size: float) -> None:
        full = analysis.full
        self.exact: ExactRanges = analysis.exact
        self.radar, self.size = analysis.mission.radar, size
        self.gain = float(analysis.allocation.autofocus_gain)
        self.image_point: GroundVector | None = full.displacement(source.full, size)
        self.is_small = not source.is_motion or full.is_small(source, abs(size))
        if self.is_small:
            self.ranges = full.left_over_small(source, size)
            return
        fitted = full.at(source, size)
        if fitted is None:
            self.image_point, self.ranges = None, []
            return
        full_size = abs(size) * full.largest_range_error(source) + math.hypot(*fitted.displacement)
        east, north = _without_rounding(fitted.displacement, full_size)
        self.image_point = (east, north)
        self.ranges = _without_rounding(full.left_over(source, size, fitted.displacement), full_size)

    @cached_property
    def orders(self) -> list[float]:
        """Parts of polynomial orders 0 to 3 of the residual range error. [m]

        The part of order 0 is the mean. The parts of orders 1 to 3 are given by their signed values at the aperture
        edge.
        """
        return [
            math.fsum(w * m for w, m in zip(weights, self.ranges, strict=True)) for weights in self.exact.fit.tolist()
        ]

    @cached_property
    def beyond(self) -> list[float]:
        """Residual range error at the nodes of the fit, without its parts of polynomial orders 0 to 3. [m]"""
        fitted_orders = np.polynomial.legendre.legvander(self.exact.sampling.places, _CUBIC_ORDER) @ (
            self.orders / LEGENDRE_LEADING
        )
        return _without_rounding((np.array(self.ranges) - fitted_orders).tolist(), self.rms(self.ranges))

    def rms(self, values: Sequence[float]) -> float:
        """RMS over the aperture of a range error, which is given by its `values` at the nodes. [m]"""
        return math.sqrt(math.fsum(w * m * m for w, m in zip(self.exact.fit[0].tolist(), values, strict=True)))

    @property
    def k(self) -> float:
        """Wavenumber 2π/λ. [rad/m]"""
        return float(self.exact.k[0])

    @property
    def is_turned(self) -> bool:
        """Whether a line of sight turns by more than one radian, so that polynomial orders are meaningless."""
        return bool(self.exact.is_turned[0])

    def phase(self, order: int) -> float:
        """Signed phase at the aperture edge due to the part of order `order` of the residual range error. [rad]"""
        return self.k * self.orders[order]

    @property
    def beyond_phase(self) -> float:
        """RMS phase due to the part of the residual range error beyond the cubic order. [rad]"""
        return self.k * self.rms(self.beyond)

    @property
    def hidden(self) -> float:
        """Hidden phase: the quadratic phase that would cause the same peak loss as several residual phases. [rad]

        The residual phases are the phase that changes over the band, and the linear phase over the aperture. If
        `is_turned`, they also include the cubic phase and the phases of higher orders.
        """
        square = float(self.exact.band[0]) * self.rms(self.ranges) ** 2 + self.orders[_SLOPE_ORDER] ** 2 / 3
        if self.is_turned:
            square += 4 * self.orders[_CUBIC_ORDER] ** 2 / 175 + self.rms(self.beyond) ** 2
        return self.k * math.sqrt(45 / 4 * square)

    @property
    def judged(self) -> float:
        """Phase that is compared with the limit of the quadratic phase. [rad]

        The limit includes the gain of autofocus, but autofocus does not correct the hidden phase. Therefore the
        hidden phase is multiplied by this gain. The result is the root-sum-square of this product and the quadratic
        phase.
        """
        return math.hypot(self.phase(_QUADRATIC_ORDER), self.gain * self.hidden)

    def sum(self, symbol: str, order: int) -> Sum:
        """Equation for the phase of a polynomial order: a weighted sum of the range errors at the nodes, as text."""
        terms = self._terms(order)
        return Sum(
            f"{symbol} = 2*π/{number(self.radar.wavelength)}*({terms}) = {with_unit(self.phase(order), 'rad')}"
        )

    def steps(self, mark: str = "full") -> Iterator[Step]:
        """Yield the explanation steps that derive the judged phase from the residual range error.

        The judged phase is the quadratic phase with the same peak loss as all residual phases together. `mark` is
        appended to the symbols of the phases.
        """
        values = {"B": self.radar.bandwidth, "f_0": self.radar.center_frequency}
        b = math.sqrt(float(self.exact.band[0]))
        orders: list[WorkedEquation | str] = [
            WorkedEquation("b", "B/(sqrt(12)*f_0)", values, b, ""),
            self._squares("ρ_rms", self.ranges),
            Sum(f"ρ_1 = {self._terms(_SLOPE_ORDER)} = {with_unit(self.orders[_SLOPE_ORDER], 'm')}"),
        ]
        formula, turn_words = "b^2*ρ_rms^2 + ρ_1^2/3", ""
        values = {
            "λ": self.radar.wavelength,
            "b": b,
            "ρ_rms": self.rms(self.ranges),
            "ρ_1": self.orders[_SLOPE_ORDER],
        }
        if self.is_turned:
            orders += [
                Sum(f"ρ_3 = {self._terms(_CUBIC_ORDER)} = {with_unit(self.orders[_CUBIC_ORDER], 'm')}"),
                self._squares("ρ_rest", self.beyond),
            ]
            formula += " + 4*ρ_3^2/175 + ρ_rest^2"
            values |= {"ρ_3": self.orders[_CUBIC_ORDER], "ρ_rest": self.rms(self.beyond)}
            turn_words = "; a line of sight turns by more than a radian, so that it includes cubic and rest"
        yield step(
            "Residual range error: its rms ρ_rms and its slope ρ_1 at the aperture edge (P₁), for the hidden phase",
            *orders,
        )
        symbol = f"hidden_{mark}"
        hidden = WorkedEquation(symbol, f"2*π/λ*sqrt(45/4*({formula}))", values, self.hidden, "rad")
        yield step(f"Hidden phase: a quadratic phase with the same peak loss{turn_words}", hidden)
        values = {f"QPE_{mark}": self.phase(_QUADRATIC_ORDER), symbol: self.hidden}
        equal_loss = math.hypot(self.phase(_QUADRATIC_ORDER), self.hidden)
        yield step(
            "Quadratic phase of equal peak loss" + ("" if self.gain > 1 else ", which is judged"),
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
            yield step("Judged against a limit that includes the gain: autofocus corrects no hidden phase", worked)

    def listed(self, values: Sequence[float]) -> list[str]:
        """Write a line of text for each node of the fit: the time of the node [s] and its value in `values` [m]."""
        times = self.exact.times[:, 0].tolist()
        return [f"{time:+.6g} s: {metres:.6g} m" for time, metres in zip(times, values, strict=True)]

    def rest_steps(self) -> Iterator[Step]:
        """Yield the explanation steps for the part of the residual range error beyond the cubic order.

        They list this part at the nodes and compute its RMS phase.
        """
        yield step("Beyond P₃ there", *self.listed(self.beyond))
        terms = self._products(self.beyond)
        wavelength = number(self.radar.wavelength)
        worked = Sum(f"rest_full = 2*π/{wavelength}*sqrt({terms}) = {with_unit(self.beyond_phase, 'rad')}")
        yield step("Its rms phase, which adds to the ISLR", worked)

    def _terms(self, order: int) -> str:
        pairs = zip(self.exact.fit[order].tolist(), self.ranges, strict=True)
        return " + ".join(f"{number(w)}*{number(m)}" for w, m in pairs)

    def _products(self, values: Sequence[float]) -> str:
        pairs = zip(self.exact.fit[0].tolist(), values, strict=True)
        return " + ".join(f"{number(w)}*{number(m)}^2" for w, m in pairs)

    def _squares(self, symbol: str, values: Sequence[float]) -> Sum:
        return Sum(f"{symbol} = sqrt({self._products(values)}) = {with_unit(self.rms(values), 'm')}")


def _without_rounding(values: Sequence[float], full_size: float) -> list[float]:
    """Replace values by 0 if they may be only rounding errors.

    The values are differences of larger numbers, and `full_size` is the size of these numbers.
    """
    return [value if abs(value) > VECTOR_ROUNDING_FRACTION * full_size else 0.0 for value in values]


def _judged(residual: Residual) -> float:
    return residual.judged


def _of_order(order: int) -> Callable[[Residual], float]:
    return lambda residual: abs(residual.phase(order))


def _beyond_phase(residual: Residual) -> float:
    return residual.beyond_phase


def worse_sign(
    analysis: Analysis, source: ErrorSource, size: float, measure: Callable[[Residual], float] = _judged
) -> Residual:
    """Residual range error for an error of `+size` or of `-size`, whichever gives the larger value of `measure`."""
    signs = [Residual(analysis, source, signed) for signed in (size, -size)]
    if signs[0].is_small or not signs[1].ranges:
        return signs[0]
    first_value, second_value = (measure(residual) if residual.ranges else math.inf for residual in signs)
    return signs[second_value > first_value * (1 + _SAME_PHASE_FRACTION)]


def full_chain(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """Yield the explanation steps that derive the phases of an error from its signed size with the full model.

    `size` is in the unit of the error. If the error is not declared, `size` is one unit. The text `each` then states
    this; it is inserted into the titles of the steps.
    """
    each = each.replace(" of ", ", for ")
    if not source.is_heard:
        yield step(f"Full model{each}: {analysis.full.no_limit(source)}")
        return
    residual = worse_sign(analysis, source, size)
    if not residual.ranges:
        yield step(f"Full model{each}: no ground point has the range history of this error")
        return
    yield from _orbit_motion(analysis, source, residual.size)
    sign = "" if residual.is_small or residual.size == size else ", with the other sign, whose residual is larger"
    yield step(
        f"Full model{each}{sign}: ground point with the smallest V = Var(ρ) + b²·⟨ρ²⟩; ρ: residual range error, ⟨ ⟩: "
        "mean over the aperture, b²: variance of the frequency over the band in units of f_0²",
        *_image_point_lines(residual),
    )
    yield step(
        f"ρ there, {_residual_formula(analysis.exact)}, at the nodes of the fit",
        *residual.listed(residual.ranges),
    )
    yield step(
        "Quadratic phase at the aperture edge, 3/2 of P₂: weights of the fit times residual",
        residual.sum("QPE_full", _QUADRATIC_ORDER),
    )
    yield from residual.steps()
    by_quadratic = worse_sign(analysis, source, size, _of_order(_QUADRATIC_ORDER))
    if by_quadratic.size != residual.size:
        yield step(
            "Quadratic phase by the other sign, which is larger", by_quadratic.sum("QPE_full", _QUADRATIC_ORDER)
        )
    if source.is_motion and analysis.mission.requirements.cubic_phase_error is not None:
        by_cubic = worse_sign(analysis, source, size, _of_order(_CUBIC_ORDER))
        yield step("Cubic phase there, 5/2 of P₃", by_cubic.sum("cubic_full", _CUBIC_ORDER))
    by_rest = worse_sign(analysis, source, size, _beyond_phase)
    if by_rest.beyond_phase > max(_MIN_SHOWN_BEYOND_RAD, float(by_rest.exact.rounding[0])):
        yield from by_rest.rest_steps()


def _orbit_motion(analysis: Analysis, source: ErrorSource, size: float) -> Iterator[Step]:
    """Yield an explanation step for each platform in free fall on which the error acts.

    The step states the position error of this platform at the first and at the last node of the fit.
    """
    if source.shifts is None:
        return
    times = analysis.exact.times[:, 0].tolist()
    against = " against the stars" if source.subject.frame == "ric" else " in Earth-fixed axes"
    for platform in source.platforms:
        if analysis.geometry.both[platform].fall is None:
            continue
        lines = []
        for node in (0, -1):
            x, y, z = (number(size * float(component[node, 0])) for component in source.shifts[platform])
            lines.append(f"{times[node]:+.6g} s: {x} m east, {y} m north, {z} m up")
        yield step(
            f"The {PLATFORMS[platform]} is in free fall: its error at mid-aperture (velocity{against}) follows "
            "d²δr/dt² = μ/r³*(3(r̂·δr)r̂ − δr), written in Earth-fixed axes",
            *lines,
        )


def _residual_formula(exact: ExactRanges) -> str:
    if exact.has_direct_path:  # the direct path is the clock
        return "|r_t| + |r_r| − |r_t − r_r| − (|r̂_t − x̂| + |r̂_r − x̂| − |r̂_t − r̂_r|)"
    return "|r_t| + |r_r| + c·t̃ − |r̂_t − x̂| − |r̂_r − x̂|"


def for_comparison(analysis: Analysis, source: ErrorSource, size: float, each: str) -> Iterator[Step]:
    """Yield the explanation step that shows the quadratic phase according to the full model, for comparison.

    The status is decided by the published model.
    """
    residual = worse_sign(analysis, source, size, _of_order(_QUADRATIC_ORDER))
    if not residual.ranges:
        yield step(f"Full model{each}, for comparison: no ground point has the range history")
        return
    yield step(
        f"Full model{each}, for comparison: weights of the fit times residual (--model full lists it)",
        residual.sum("QPE_full", _QUADRATIC_ORDER),
    )


def at_the_allowable(
    analysis: Analysis, source: ErrorSource, allowable: float, requirement: str = QUADRATIC
) -> Iterator[Step]:
    """Yield the explanation steps that confirm an allowable found by a numerical search.

    They show that an error of this size just reaches the limit.
    """
    sizes = [Residual(analysis, source, signed) for signed in (allowable, -allowable)]
    if not all(residual.ranges for residual in sizes):
        return
    measure = {LOCATION: _displacement_of, CUBIC: _of_order(_CUBIC_ORDER), QUADRATIC: _judged}[requirement]
    residual = max(sizes, key=measure)
    size = f"{number(residual.size)} {source.unit.replace('^2', '²')}"
    title = f"At {size}, the smallest size of either sign that reaches the limit, exact ranges give"
    if requirement == LOCATION:
        x, y = residual.image_point or (0.0, 0.0)
        yield step(title, Sum(f"moved = sqrt({number(x)}^2 + {number(y)}^2) = {with_unit(math.hypot(x, y), 'm')}"))
    elif requirement == CUBIC:
        yield step(title, residual.sum("cubic_there", _CUBIC_ORDER))
    else:
        yield step(title, residual.sum("QPE_there", _QUADRATIC_ORDER))
        yield from residual.steps("there")


def _displacement_of(residual: Residual) -> float:
    return math.hypot(*(residual.image_point or (0.0, 0.0)))


def end_of_the_image(size: float, unit: str, symbol: str = "by_image") -> Iterator[Step]:
    """Yield the explanation step for the largest error at which an image point exists: `size` in `unit`.

    For a larger error, no ground point has the recorded range history.
    """
    yield step(
        "End of the image: no ground point has the range history of a larger error of either sign",
        "The point is followed as the error grows, to where range and Doppler gradients become parallel there",
        f"{symbol} = {with_unit(size, unit)}, a limit for any allowed phase or displacement",
    )


def no_limit(row: Row) -> Step:
    """Return the explanation step that states why a row has no limit."""
    return step("Allowable: no limit", printable(row.reason or "no requirement limits this error"))


def smallest_size(row: Row, sizes: Mapping[str, float]) -> Iterator[Step]:
    """Yield the explanation steps for the allowable of a row, which is the smallest of `sizes`.

    `sizes` has the size that each requirement allows. The keys are the symbols of these sizes in the explanation,
    such as `by_QPE`.
    """
    if row.allowable is None or not sizes:
        yield no_limit(row)
        return
    allowed_sizes = list(sizes.values())
    text = f"min({', '.join(map(number, allowed_sizes))})" if len(allowed_sizes) > 1 else number(allowed_sizes[0])
    title = f"Allowable: the smallest, by {', '.join(sizes)}"
    if row.unit != "dB":
        yield step(title, Sum(f"allowable = {text} = {with_unit(row.allowable, row.unit)}"))
        return
    factor = min(allowed_sizes)
    yield step(f"{title}: a factor of the noise's amplitude", Sum(f"factor = {text} = {with_unit(factor, '')}"))
    worked = WorkedEquation("allowable", "20*log(factor)/log(10)", {"factor": factor}, row.allowable, "dB")
    yield step("As a level relative to the declared noise", worked)
    yield step("Utilization", WorkedEquation("utilization", "1/factor", {"factor": factor}, 1 / factor, ""))


def _image_point_lines(residual: Residual) -> Sequence[str]:
    if residual.image_point is None or residual.image_point == (0.0, 0.0):
        return ("the scene centre itself",)
    east, north = residual.image_point
    return (f"x̂ = {with_unit(east, 'm')} east", f"ŷ = {with_unit(north, 'm')} north")


RULE_WORDS = {"each": "the largest", "sum": "the sum", "rss": "the root-sum-square"}


def limit_steps(allocation: Allocation, owner: str, limit: float) -> Iterator[Step]:
    """Yield the explanation steps for the limit on the quadratic phase that applies to `owner`, such as a platform.

    The limit is the product of the budget, the share of `owner`, and the autofocus gain.
    """
    total, share, gain = allocation.qpe_total, allocation.qpe.of(owner), allocation.autofocus_gain
    owner_words = {
        "clock": "the receiver’s share" if allocation.qpe.clock is None else "the clock’s share",
        "mission": "all of it: it belongs to no platform",
    }
    yield from autofocus_gain(allocation)
    values = {"total": total, "share": share, "gain": gain}
    title = f"Budget requirements.quadratic_phase_error, {owner_words.get(owner, f'the {owner}’s share')}"
    yield step(title, WorkedEquation("limit", "total*share*gain", values, limit, "rad"))


def autofocus_gain(allocation: Allocation) -> Iterator[Step]:
    """Yield the explanation steps for the autofocus gain.

    Autofocus raises limits on the quadratic phase by this factor.
    """
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
    sizes_by_name: Sequence[tuple[str, float]],
    total: float | None,
    *,
    symbol: str = "combined",
    unit: str = "rad",
) -> Iterator[Step]:
    """Yield the explanation step that combines the sizes of several errors into a total.

    `rule` selects the maximum, the sum or the root-sum-square. If `total` is None, the step only lists names and
    sizes.
    """
    title = f"{title}, {RULE_WORDS[rule]}"
    # The remainder of terms that cancel exactly is rounding.
    largest = max((abs(size) for _, size in sizes_by_name), default=0.0)
    members = [
        (name, abs(size) if abs(size) > VECTOR_ROUNDING_FRACTION * largest else 0.0) for name, size in sizes_by_name
    ]
    width = max((len(name) for name, _ in members), default=0)
    lines = [f"{printable(name):<{width}}  {size:.6g} {unit}" for name, size in members if size] or ["none"]
    if total is None or not members:
        yield step(title, *lines)
        return
    sizes = [number(size) for _, size in members if size] or ["0"]
    if rule == "sum":
        text = " + ".join(sizes)
    elif rule == "rss":
        text = "sqrt(" + " + ".join(f"{size}^2" for size in sizes) + ")"
    else:
        text = f"max(0, {', '.join(sizes)})"
    yield step(title, *lines, Sum(f"{symbol} = {text} = {total:.6g} {unit}"))
