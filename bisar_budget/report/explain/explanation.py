"""Explain a row or a requirement: its line in the mission file, the equations with numbers, and its status."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np

from bisar_budget.analysis.allocation import Allocation
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.scene import at, differences_at
from bisar_budget.analysis.spread import mainlobe_energy
from bisar_budget.analysis.together import cubics, quadratics
from bisar_budget.analysis.totals import IsMember, Totals
from bisar_budget.analysis.vibration_limits import amplitude_share, echo_phase, slow_limits, tone_limits
from bisar_budget.arrays import Floats
from bisar_budget.budget.aggregates import effect_parts, untaken_effects
from bisar_budget.budget.declarations import missing_declarations
from bisar_budget.budget.doubts import (
    MOST_GRID_SHARE,
    InputDoubt,
    declared_position_error,
    input_doubts,
    is_in_doubt,
)
from bisar_budget.budget.judged_requirements import (
    MAKER_FRACTION,
    NEGLIGIBLE_FRACTION,
    SMALL_RAD,
    UntakenEffect,
)
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.effects.air_delays import CONTENT, ELECTRON_DELAY_M3_PER_S2, dispersed_legs, leg_factor
from bisar_budget.effects.combined import phase_parts
from bisar_budget.effects.declared import CUBIC, LOCATION, QUADRATIC
from bisar_budget.effects.effect import ErrorSource, plain
from bisar_budget.effects.slow_tones import SlowTone
from bisar_budget.effects.vibration import DeclaredPhase, lines_of, near_lines, seen_of_axes, worst_phases
from bisar_budget.error_kinds.random_kinds import VIBRATION_KIND
from bisar_budget.faults import changes_words, printable
from bisar_budget.findings.mission import MissionFindings
from bisar_budget.findings.requirement import JudgedRequirement
from bisar_budget.findings.row import DECLARE, SPECIFICATION, Row
from bisar_budget.findings.status import STATUS
from bisar_budget.geometry import plain_vector
from bisar_budget.mission.changes import name_of_error
from bisar_budget.mission.model import Mission
from bisar_budget.mission.platforms import Platform
from bisar_budget.mission.readers import SectionValue
from bisar_budget.mission.vibrations import AcceleratedSinusoid
from bisar_budget.phrases import Note
from bisar_budget.report.explain import notation
from bisar_budget.report.explain.explained_confidence import (
    SizeRule,
    biased_use,
    judged_steps,
    rules_of,
    total_steps,
)
from bisar_budget.report.explain.explained_error import (
    RULE_WORDS,
    as_written,
    at_the_allowable,
    combined,
    declaration,
    effect,
    end_of_the_image,
    limit_steps,
    location,
    missing,
    smallest_size,
)
from bisar_budget.report.explain.explained_random import biased_random_use, explained_random
from bisar_budget.report.explain.explained_spreading import (
    explained_islr,
    explained_power,
    explained_pslr,
    explained_spur,
    explained_tone,
    moved_by_tone,
    near_phases,
    smallest_of,
    use_of_amplitudes,
)
from bisar_budget.report.explain.notation import Step, Sum, WorkedEquation, number, step, with_unit
from bisar_budget.report.words.requirements import requirement_finding, requirement_id
from bisar_budget.report.words.sentences import declared_size, own_id, percent, row_limit, row_size, wrapped

_CONTINUATION_COLUMNS = 3  # additional indent of continued lines, at which no equals sign is expected
_MAX_UNIT_CHARACTERS = 16  # of a unit after a number


def explain(mission: Mission, findings: MissionFindings, row_id: str) -> str:
    """Explain one row of a mission as text, with the equations and their numbers."""
    row = next(row for row in findings.rows if row.id == row_id)
    title = f"{STATUS[row.status].text} {printable(f'{row.id}{own_id(row)}')}"
    steps = _lines(_to_utilization(mission, findings, row))
    if row.declared is not None and row.allowable is not None and row.utilization is not None:
        steps.append(f"                = {percent(row.utilization)}")  # under the sum of the last step
    return _text(mission, title, [*steps, *_lines(not_judged(findings, row)), *_verdict(row, findings)])


def explain_requirement(mission: Mission, findings: MissionFindings, requirement: JudgedRequirement) -> str:
    """Explain a requirement of a mission as text.

    The text states its status, its line in the file, and the rows that determine the status.
    """
    title = f"{STATUS[requirement.status].text} {requirement_id(requirement)}{printable(own_id(requirement))}"
    return _text(
        mission,
        title,
        [
            *_lines(finding_of(mission, findings, requirement)),
            "",
            *map(printable, findings.texts_of(requirement)),
            printable(requirement_finding(requirement, findings)),
        ],
    )


def _lines(steps: Iterable[Step]) -> list[str]:
    return [line for each_step in steps for line in each_step.lines]


def _text(mission: Mission, title: str, body: Iterable[str]) -> str:
    lines = [f"{title} of {printable(mission.name)}"]
    lines += [f"Changed from the file: {changes_words(mission.changes)}"] if mission.changes else []
    lines += ["", *body]
    return "\n".join(fitted for line in lines for fitted in _fitted(line)) + "\n"


def _fitted(line: str) -> list[str]:
    """Break a line of an explanation at spaces if it is too long.

    Continuation lines have a larger indentation. An `=` stays on one line with the next word, and a number with its
    unit.
    """
    start = len(line) - len(line.lstrip())
    if not start:
        return wrapped(line, "  ")
    joined = line.replace("= ", "=\u00a0")
    body, _, unit = joined.rpartition(" ")
    if body.strip() and len(unit) < _MAX_UNIT_CHARACTERS:
        joined = f"{body}\u00a0{unit}"
    return [line_part.replace("\u00a0", " ") for line_part in wrapped(joined, " " * (start + _CONTINUATION_COLUMNS))]


def chain(mission: Mission, findings: MissionFindings, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for a row.

    They lead from the line in the mission file to the utilization, or to the reason why the row has no utilization.
    """
    yield from _to_utilization(mission, findings, row)
    yield from not_judged(findings, row)


def _to_utilization(mission: Mission, findings: MissionFindings, row: Row) -> Iterator[Step]:
    analysis, model = findings.analysed(), _model(row)
    source = next((source for source in analysis.sources if source.id == row.id), None)
    random_error = next((error for error in analysis.random if error.id == row.id), None)
    if source is not None:
        yield from declaration(mission, source)
        yield from judged_steps(analysis, source)
        yield from effect(analysis, source, row.model)
        yield from _budget(analysis, source, row)
    elif random_error is not None:
        yield from explained_random(analysis, findings.allocation, random_error, row)
    else:
        yield from row.subject.facts.find_in(ROW_STEPS, row.subject.axis)(analysis, findings, row)
    for tone in analysis.displacing_tones:
        if tone.subject.id == row.id and row.displacement_m is not None:
            yield from moved_by_tone(tone.parts(model), model, row.displacement_m)
    if row.subject.axis == "spur" and row.allowable is not None:
        yield from use_of_amplitudes(row)
    elif row.declared is not None and row.allowable is not None and row.utilization is not None and row.unit != "dB":
        if source is not None and row.bias is not None:
            yield biased_use(analysis, source, row)
            return
        if random_error is not None and random_error.biased is not None:
            yield biased_random_use(analysis, random_error, row)
            return
        values = {"declared": row.declared, "allowable": row.allowable}
        yield step("Utilization", WorkedEquation("utilization", "declared/allowable", values, row.utilization, ""))


def _model(row: Row) -> str:
    """Name of the model whose numbers explain a row: `full` or `published`."""
    return "full" if row.model == "full" else "published"


def collection_chain(findings: MissionFindings) -> Iterator[Step]:
    """Yield the explanation steps for the quantities of a mission that depend only on the geometry.

    These are the look direction of equation (11) in Rigling & Moses, the smear direction of (31), and det Q, the
    determinant of the matrix Q in (30).
    """
    values: dict[str, float] = {}
    for name, state in (("t", findings.geometry.transmitter), ("r", findings.geometry.receiver)):
        (x, y, _), (v_x, v_y, _) = plain_vector(state.position), plain_vector(state.velocity)
        values |= {f"φ̄_{name}": float(state.azimuth), f"θ̄_{name}": float(state.elevation)}
        values[f"R_{name}"] = float(state.slant_range)
        values |= {f"x_{name}": x, f"y_{name}": y, f"v_x{name}": v_x, f"v_y{name}": v_y}
    look, s = float(findings.geometry.look_azimuth), findings.geometry.range_gradient
    yield step("(11), bistatic look direction", WorkedEquation("φ_b", notation.LOOK_AZIMUTH, values, look, "rad"))
    east, north = notation.SMEAR
    yield step(
        "(31), smear direction",
        WorkedEquation("east", east, values, float(s[1]), ""),
        WorkedEquation("north", north, values, float(-s[0]), ""),
    )
    determinant = findings.analysed().published.plane.determinant
    yield step("(30), range held constant", WorkedEquation("det Q", notation.DETERMINANT, values, determinant, "1/s"))


def _budget(analysis: Analysis, source: ErrorSource, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for the allowable of an error.

    The allowable is the smallest of the sizes allowed by the requirements.
    """
    allocation, requirements = analysis.allocation, analysis.mission.requirements
    limit = allocation.qpe_allowed(source.owner)
    yield from limit_steps(allocation, source.owner, limit)
    model = analysis.full if row.model == "full" else analysis.published
    by_quadratic = row.allowable_full if row.model == "full" else row.allowable_published
    sizes: dict[str, float] = {}
    rules = rules_of(analysis, source)
    ends: list[tuple[SizeRule, float, float]] = []
    if by_quadratic is not None:
        rule = rules[QUADRATIC]
        reached = by_quadratic if rule.is_plain else model.allowable(source, QUADRATIC, limit)
        if reached is None:
            sizes["by_image"] = by_quadratic
        elif model.ends_image(source, reached):
            ends.append((rule, reached, by_quadratic))
        else:
            sizes["by_QPE"] = by_quadratic
            yield from _reaching_quadratic(analysis, source, row, limit, reached, rule)
            if not rule.is_plain:
                yield rule.allowable_step(reached, by_quadratic)
    for name, symbol, required, unit in (
        (CUBIC, "by_cubic", requirements.cubic_phase_error, "rad"),
        (LOCATION, "by_location", requirements.location_error, "m"),
    ):
        if required is None or not source.is_motion:
            continue
        reached, rule = model.allowable(source, name, required), rules[name]
        if reached is None:
            continue
        size = rule.allowable(reached)
        if name == row.binding_requirement and row.allowable is not None:
            size = row.allowable  # the search of the check may differ in the last digits
            reached = size if rule.is_plain else reached
        if model.ends_image(source, reached):
            ends.append((rule, reached, size))
            continue
        sizes[symbol] = size
        title = f"Allowable by requirements.{name}, {with_unit(required, unit)}, without share and gain"
        if not rule.is_plain:
            title = title.replace("Allowable by", "Size at the limit of")
            symbol = symbol.replace("by_", "limit_")
        if row.model == "full" and not analysis.full.is_linear_at(source, name, required):
            yield step(title, f"{symbol} = {with_unit(reached, row.unit)}")
            yield from at_the_allowable(analysis, source, reached, name)
        else:
            values = {"limit": required, "effect/unit": required / model.small(source, name, required)}
            yield step(title, WorkedEquation(symbol, "limit/(effect/unit)", values, reached, row.unit))
        if not rule.is_plain:
            yield rule.allowable_step(reached, size)
    yield from _by_image(row, ends, sizes)
    yield from smallest_size(row, sizes)


def _by_image(row: Row, ends: Sequence[tuple[SizeRule, float, float]], sizes: dict[str, float]) -> Iterator[Step]:
    """Yield the explanation steps for the end of the image, and add the declared sizes that it allows to `sizes`.

    `ends` has the rule of each requirement whose limit is not reached before the image ends, the size at the end, and
    the declared size that the rule allows. The sizes differ, because each requirement judges its own quantile.
    """
    for rule, _, size in ends:
        if rule.is_plain:
            sizes["by_image"] = size
    if "by_image" in sizes:
        yield from end_of_the_image(sizes["by_image"], row.unit)
    judged = [each for each in ends if not each[0].is_plain]
    if judged:
        yield from end_of_the_image(judged[0][1], row.unit, "end_of_image")
    for rule, reached, size in judged:
        symbol = f"by_image_for_{rule.symbol}"
        yield rule.allowable_step(reached, size, symbol, "end_of_image")
        sizes[symbol] = size


def _reaching_quadratic(
    analysis: Analysis, source: ErrorSource, row: Row, limit: float, reached: float, rule: SizeRule
) -> Iterator[Step]:
    """Yield the explanation steps for the size `reached` at which the quadratic phase of an error is at its limit."""
    model = analysis.full if row.model == "full" else analysis.published
    title, symbol = "Allowable by the quadratic phase", "by_QPE"
    if not rule.is_plain:
        title, symbol = "Size at the limit of the quadratic phase", "limit_QPE"
    if row.model == "full" and source.is_motion and not analysis.full.is_linear_at(source, QUADRATIC, limit):
        if not rule.is_plain:
            yield step(title, f"{symbol} = {with_unit(reached, row.unit)}")
        yield from at_the_allowable(analysis, source, reached)
        return
    values, formula = {"limit": limit, "QPE/unit": abs(float(model.effect(source).qpe))}, "limit/(QPE/unit)"
    hidden = model.hidden_per_unit(source)
    if hidden:
        values |= {"hidden/unit": hidden, "gain": float(analysis.allocation.autofocus_gain)}
        formula = "limit/sqrt((QPE/unit)^2 + (gain*hidden/unit)^2)"
    yield step(title, WorkedEquation(symbol, formula, values, reached, row.unit))


def _vibration_in_its_unit(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for a vibration, with the results in the unit used in the file.

    If a spectral line is stated as an acceleration, the steps are in metres, and the results are converted back to an
    acceleration.
    """
    mission, allocation, tone = analysis.mission, findings.allocation, analysis.slow_tones.get(row.id)
    lines = lines_of(mission, row.owner)
    entry = row.subject.entry or 0
    if row.unit == "m" or row.declared is None:
        yield from _vibration(mission, allocation, row, tone)
        return
    line = lines[entry]
    sizes = ("declared", "allowable", "allowable_published", "allowable_full")
    metres = {name: getattr(row, name) and getattr(row, name) / line.per_metre for name in sizes}
    yield from _vibration(mission, allocation, row._replace(unit="m", **metres), tone)
    for name in ("declared", "allowable"):
        if (size := getattr(row, name)) is not None:
            values = {"A": metres[name], "f": line.frequency}
            yield step(f"As an acceleration, {name}", WorkedEquation(name, "A*(2*π*f)^2", values, size, row.unit))


def _vibration(mission: Mission, allocation: Allocation, row: Row, tone: SlowTone | None) -> Iterator[Step]:
    """Yield the explanation steps for a vibration: its line in the mission file, and its limits in both models.

    The vibration is a single spectral line, the sum of several neighbouring lines, or noise.
    """
    platform, entry = row.owner, row.subject.entry or 0
    is_sinusoid, is_sum = row.subject.axis != "wideband", row.subject.axis == "sinusoidal.sum"
    path = VIBRATION_KIND.path(platform, "sinusoidal" if is_sinusoid else "wideband", entry)
    if row.declared is None:
        yield step(missing(mission, path[:5]))
    elif is_sum:
        yield from _near_lines(mission, platform, entry, row.declared)
    else:
        yield step(f"Declared in {location(mission, path)}", as_written(mission, path))
        if is_sinusoid:
            yield from _displacement(mission, platform, entry)
        if row.metric != QUADRATIC:
            yield from _line_of_sight(mission, platform, is_sinusoid, entry, row.declared)
    if row.evidence:
        yield step("Evidence", printable(row.evidence))
    wavelength, sizes = mission.radar.wavelength, dict[str, float]()
    if tone is not None and row.qpe_full_rad is not None:
        words = "By exact ranges, each axis in its worst phase, with what the displacement adds"
        yield step(words, _of_axes("QPE_full", [phase.quadratic for phase in tone.declared.axes()]))
        if row.metric == QUADRATIC:
            yield from _slow_vibration(mission, allocation, row, tone)
            return
        axes = tone.declared.axes()
        yield step("By either model", _of_axes("QPE", [phase.quadratic for phase in axes]))
        yield step("Cubic phase likewise", _of_axes("cubic", [phase.cubic for phase in axes]))
        judged = tone.declared.judged(allocation.autofocus_gain).item()
        yield from near_phases(mission, allocation, row, judged, sizes)
    by_echoes = row.metric == "pslr"
    requirement = mission.requirements.pslr if by_echoes else mission.requirements.islr
    if requirement is None or row.allowable_published is None or row.allowable_full is None:
        if sizes:
            yield smallest_of(row, sizes)
        return
    by_models = row.allowable_published, row.allowable_full
    if sizes:  # limits of the echoes alone
        limits = tone_limits(mission, allocation)[1][platform]
        by_models = float(limits.published), float(limits.full)
    name = row.metric.upper()
    ratio = 10 ** (requirement / 10)
    yield step(
        f"requirements.{row.metric} as a power ratio",
        WorkedEquation(name, "10^(dB/10)", {"dB": requirement}, ratio, ""),
    )
    split = allocation.pslr if by_echoes else allocation.islr
    share = split.of(platform)
    values = {name: ratio, "λ": wavelength, "s": share}
    is_power = is_sinusoid and not by_echoes
    published = notation.VIBRATION[row.metric]
    kind = "sinusoidal" if by_echoes else "wideband"
    yield step(
        f"Section V, {kind}, s is the {platform}’s share of power",
        *_limit("published", published, values, by_models[0], is_power=is_power),
    )
    if by_echoes:
        amplitude_part = float(amplitude_share(split, platform))
        shares = {"s_t": split.transmitter, "s_r": split.receiver}
        yield step(
            "Both platforms at one frequency: echoes add in amplitude, its part a",
            WorkedEquation("a", notation.amplitude_share(platform), shares, amplitude_part, ""),
        )
        level = math.sqrt(ratio * (split.transmitter + split.receiver))
        values = {
            "a": amplitude_part,
            "λ": wavelength,
            "φ": float(echo_phase(level)),
        }
        title = "First principles; φ is the phase whose echoes have this level, J₁(φ)/J₀(φ) = l"
        powers = {"PSLR": ratio, "s_t": split.transmitter, "s_r": split.receiver}
        definitions = [
            WorkedEquation("l", "sqrt(PSLR*(s_t + s_r))", powers, level, ""),
            WorkedEquation("φ", "", {}, values["φ"], "rad"),
        ]
    else:
        title = "First principles, independent on both platforms; a phase of σ rad has the ISLR (exp(σ²) − 1)/E"
        values = {**values, "E": mainlobe_energy(mission)}
        definitions = []
    full = notation.FULL_VIBRATION[row.metric]
    yield step(title, *definitions, *_limit("full", full, values, by_models[1], is_power=is_power))
    sizes |= dict(zip(("published", "full"), by_models, strict=True))
    model = mission.gating_model
    chosen = ["published", "full"] if model == "strictest" else [model]
    chosen += ["by_phases"] * ("by_phases" in sizes)
    formula = f"min({', '.join(chosen)})" if len(chosen) > 1 else model
    yield step(
        f"Allowable, allocation.model {model}", WorkedEquation("allowable", formula, sizes, row.allowable or 0.0, "m")
    )


def _limit(
    model: str, formula: str, values: Mapping[str, float], result: float, *, is_power: bool
) -> Iterator[WorkedEquation]:
    """Yield the equations for the largest vibration amplitude that a model allows. [m]

    If `is_power` is true, the formula gives an RMS value, and a second equation multiplies it by √2.
    """
    if not is_power:
        yield WorkedEquation(model, formula, values, result, "m")
        return
    rms = result / math.sqrt(2)
    yield WorkedEquation(f"σ_{model}", formula, values, rms, "m")
    yield WorkedEquation(model, "sqrt(2)*σ", {"σ": rms}, result, "m")


def _slow_vibration(mission: Mission, allocation: Allocation, row: Row, tone: SlowTone) -> Iterator[Step]:
    """Yield the explanation steps for a vibration below one cycle per aperture.

    They derive the allowable amplitude from the phases of the vibration.
    """
    axes, gain = tone.declared.axes(), allocation.autofocus_gain
    yield step("By either model", _of_axes("QPE", [phase.quadratic for phase in axes]))
    yield step("Cubic phase likewise", _of_axes("cubic", [phase.cubic for phase in axes]))
    judged = _of_axes("judged", [phase.judged(gain) for phase in axes])
    yield step("Judged: with gain times the phase of as much loss that band and turn do not resolve, squared", judged)
    limit, required = allocation.qpe_allowed(row.owner), mission.requirements
    yield from limit_steps(allocation, row.owner, limit)
    limits = slow_limits(mission, allocation, tone)
    by_qpe, use = float(limits.quadratic[0]), float(limits.use[0])
    sizes = {"by_QPE": by_qpe}
    values = {"limit": limit, "effect/unit": float(tone.per_metre.judged(gain)[0])}
    worked = WorkedEquation("by_QPE", "limit/(effect/unit)", values, by_qpe, "m")
    yield step("Allowable along the line of sight by the quadratic phase of a metre there", worked)
    if required.cubic_phase_error is not None and limits.cubic is not None:
        sizes["by_cubic"] = float(limits.cubic[0])
        values = {"limit": required.cubic_phase_error, "effect/unit": float(tone.per_metre.cubic[0])}
        worked = WorkedEquation("by_cubic", "limit/(effect/unit)", values, sizes["by_cubic"], "m")
        yield step("Allowable by requirements.cubic_phase_error", worked)
    smallest = min(sizes, key=lambda name: sizes[name])
    yield step("Allowable, the smallest", WorkedEquation("allowable", smallest, sizes, sizes[smallest], "m"))
    if not tone.hears_part:
        return
    values = {"judged": tone.declared.judged(gain).item(), "limit": limit}
    if limits.is_cubic[0]:
        values = {"judged": tone.declared.cubic.item(), "limit": required.cubic_phase_error or 0.0}
    yield step(
        "Part of the limit that the declared vibration uses", WorkedEquation("use", "judged/limit", values, use, "")
    )
    values = {"use": use, "allowable": sizes[smallest]}
    title = "Declared, the amplitude along the line of sight that uses as much"
    yield step(title, WorkedEquation("declared", "use*allowable", values, row.declared or 0.0, "m"))


def _of_axes(symbol: str, phases: Sequence[Floats]) -> Sum:
    """Equation that adds the `phases` [rad] along all axes of a vibration; `symbol` is the symbol of the sum."""
    numbers = [phase.item() for phase in phases]
    return Sum(f"{symbol} = {' + '.join(map(number, numbers))} = {with_unit(math.fsum(numbers), 'rad')}")


def _displacement(mission: Mission, platform: str, entry: int) -> Iterator[Step]:
    """Yield the explanation steps that convert the amplitudes of a spectral line from an acceleration to metres."""
    line = getattr(mission.platforms, platform).motion_error.vibration.sinusoidal[entry]
    if not isinstance(line, AcceleratedSinusoid):
        return
    axes = zip(
        *((size if isinstance(size, tuple) else (size,)) for size in (line.amplitude, line.displacement)), strict=True
    )
    for amplitude, displacement in axes:
        values = {"a": amplitude, "f": line.frequency}
        yield step("As a displacement", WorkedEquation("A", "a/(2*π*f)^2", values, displacement, "m"))


def _line_of_sight(mission: Mission, platform: str, is_sinusoid: bool, entry: int, declared: float) -> Iterator[Step]:
    """Yield the explanation step that projects a vibration onto the line of sight.

    If the receiver uses the direct path as its clock, the step instead shows the effect of the vibration on the
    difference between the range and the direct path.
    """
    vibration = getattr(mission.platforms, platform).motion_error.vibration
    value = vibration.sinusoidal[entry].displacement if is_sinusoid else vibration.wideband.rms
    title, is_vector = "Along the line of sight, as it turns, rms over the aperture", isinstance(value, tuple)
    if mission.has_direct_path:
        title = "In the range less the direct path, as it turns, rms over the aperture"
    seen = seen_of_axes(mission, platform, is_vector=is_vector)
    if not is_vector:
        if mission.has_direct_path:
            text = f"{number(value)}*{number(float(seen[0]))}"
            yield step(title, Sum(f"declared = {text} = {with_unit(declared, 'm')}"))
        return
    products = [f"{number(size)}*{number(float(along))}" for size, along in zip(value, seen, strict=True)]
    if is_sinusoid:
        text, rule = (
            " + ".join(f"|{product}|" for product in products),
            "axes may vibrate in any phase: projections add",
        )
    else:
        text, rule = (
            "sqrt(" + " + ".join(f"({product})^2" for product in products) + ")",
            "independent axes: squares add",
        )
    yield step(f"{title}, {rule}", Sum(f"declared = {text} = {with_unit(declared, 'm')}"))


def _near_lines(mission: Mission, platform: str, index: int, total: float) -> Iterator[Step]:
    """Yield the explanation step that adds the paired echoes of neighbouring spectral lines.

    The echoes are added at the distance from the peak at which their sum is highest.
    """
    lines, T = lines_of(mission, platform), mission.collection.aperture_time
    members = near_lines([line.frequency * T for line in lines])[index]
    near = [lines[member] for member in members]
    worst = worst_phases([line.amplitude for line in near], [line.frequency * T for line in near])
    sizes = " + ".join(
        f"{number(float(line.amplitude))}*{number(abs(np.sinc(worst.cycles - line.frequency * T)))}" for line in near
    )
    entries = ", ".join(map(str, members))
    title = (
        f"Entries {entries} lie near each other: at x = {number(float(worst.cycles))} cells each adds "
        "A·|sinc(x − f·T)|, sinc(x) = sin(πx)/(πx), in the worst phases"
    )
    yield step(title, f"declared = {sizes} = {total:.6g} m")


def _tone(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    yield from explained_tone(analysis.mission, findings.allocation, row)


def _spur(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    yield from explained_spur(analysis.mission, findings.allocation, row)


def _power(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    yield from explained_power(analysis.mission, findings.allocation, row)


def _pslr(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    yield from explained_pslr(analysis.mission, row)


def _islr(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    yield from explained_islr(analysis, findings.allocation, row)


def _specification(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for a specification, which is the largest permitted size of an error.

    They show its line in the file, and the largest declared error, which is compared with it.
    """
    mission = analysis.mission
    key = next(key for key in mission.specifications if name_of_error(key) == row.subject.axis)
    path = ("specifications", key)
    yield step(f"Specified in {location(mission, path)}", as_written(mission, path))
    if row.declared is not None:
        yield step("Declared, of three axes the largest", f"{key} = {row_size(row.declared, row, findings)}")


def _declarations(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    yield from declarations(analysis.mission)


def _pull_in(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for the sum of the quadratic phases, and for the limit on this sum.

    The limit is the pull-in range of autofocus.
    """
    together, allocation = analysis.together(_model(row)), findings.allocation
    members = [*together.owed(allocation.qpe, row.owner), *together.biases]
    sizes_by_name = together.phase_parts(quadratics(members), "sum")
    yield from combined("QPE of the declared errors", "sum", sizes_by_name, row.declared)
    values = {"N_pull": allocation.n_pull or 0.0}
    worked = WorkedEquation("allowable", "π*N_pull", values, row.allowable or 0.0, "rad")
    yield step("Pull-in range of autofocus, Section VI", worked)


def _phase_aggregate(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for the combined quadratic phase of all errors of one owner.

    The owner is a platform, the clock or the mission; all errors belong to the mission. Further steps explain the
    limit on this phase.
    """
    together, owner, allocation = analysis.together(_model(row)), row.owner, findings.allocation
    members = together.owed(allocation.qpe, owner)
    rule, gain = findings.combine, allocation.autofocus_gain
    title = (
        "Quadratic phase of equal peak loss of the declared errors"
        if row.model == "full"
        else "QPE of the declared errors"
    )
    if gain == 1 or rule == "each" or row.model != "full":
        yield from _phases_together(analysis, row, title, members, row.declared, float(gain))
        yield from limit_steps(allocation, owner, row.allowable or 0.0)
        return
    yield from _phases_together(analysis, row, title, members, row.declared, 1.0)
    judged, limit = float(together.judged(members)[0]), allocation.qpe_allowed(owner)
    if rule == "rss":
        judged = _total_of(analysis, row, judged, float(gain))
    title = "Judged, with hidden phases times the gain: autofocus corrects none of them"
    yield from _phases_together(analysis, row, title, members, judged, float(gain), symbol="judged")
    yield from limit_steps(allocation, owner, limit)
    if row.declared and row.allowable is not None:
        values = {"limit": limit, "combined": row.declared, "judged": judged}
        worked = WorkedEquation("allowable", "limit*combined/judged", values, row.allowable, "rad")
        yield step("Allowable, as a phase of equal peak loss", worked)


def _is_member(analysis: Analysis, row: Row) -> IsMember:
    split = analysis.allocation.qpe
    return lambda owner: split.includes(owner, row.owner)


def _total_of(analysis: Analysis, row: Row, root_sum_square: float, gain: float) -> float:
    """Quadratic phase that the requirement judges for the owner of a row, under root-sum-square. [rad]"""
    of_case = np.array([root_sum_square])
    return float(Totals(analysis).reached(_model(row), QUADRATIC, _is_member(analysis, row), of_case, gain)[0])


def _phases_together(
    analysis: Analysis,
    row: Row,
    title: str,
    members: Sequence[DeclaredPhase],
    total: float | None,
    gain: float,
    symbol: str = "combined",
) -> Iterator[Step]:
    """Yield the explanation steps that combine the quadratic phases of errors to the total that is judged. [rad]"""
    together, rule = analysis.together(_model(row)), analysis.mission.allocation.combine
    sizes_by_name = together.phase_parts(together.judged_parts(members, gain=gain), rule)
    if rule != "rss" or not Totals(analysis).is_asked(QUADRATIC):
        yield from combined(title, rule, sizes_by_name, total, symbol=symbol)
        return
    root_sum_square = float(together.judged(members, gain=gain)[0])
    yield from combined(title, rule, sizes_by_name, root_sum_square, symbol="rss")
    yield from total_steps(
        analysis,
        _model(row),
        QUADRATIC,
        _is_member(analysis, row),
        root_sum_square,
        total,
        gain=gain,
        symbol=symbol,
    )


def _cubic_aggregate(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    together = analysis.together(_model(row))
    phases = cubics(together.phases)
    sizes_by_name, title = together.phase_parts(phases), "Cubic phase of the declared errors"
    if findings.combine == "rss" and Totals(analysis).is_asked(CUBIC):
        root_sum_square = float(together.combined(phases)[0])
        yield from combined(title, findings.combine, sizes_by_name, root_sum_square, symbol="rss")
        yield from total_steps(analysis, _model(row), CUBIC, lambda owner: True, root_sum_square, row.declared)
    else:
        yield from combined(title, findings.combine, sizes_by_name, row.declared)
    if row.allowable is not None:
        yield step("Allowable", f"requirements.cubic_phase_error = {row.allowable:.6g} rad")


def _dispersion(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for the quadratic phase over the band that is caused by ionospheric dispersion.

    The phase is shown for the signal path of each platform, and for both paths together.
    """
    mission = analysis.mission
    legs = dispersed_legs(mission, mission.geometry)
    for name, phase in legs.items():
        path, propagation = getattr(mission.geometry, name), mission.propagation
        if propagation is None:
            continue
        content = (propagation.content(name) or 0.0) * findings.coverage_factor
        values = {
            "K": ELECTRON_DELAY_M3_PER_S2 * content * float(leg_factor(CONTENT, path.position, path.position)),
            "c": SPEED_OF_LIGHT_MPS,
            "f_0": mission.radar.center_frequency,
            "B": mission.radar.bandwidth,
        }
        declared_at = location(mission, propagation.path(name, CONTENT))
        yield step(f"Declared in {declared_at}, on the leg of the {name}", f"content = {content:.6g}/m²")
        yield step(
            f"Quadratic phase at the edges of the band, K = 40.308 m³/s² · content along the leg of the {name}",
            WorkedEquation(f"phase_{name[0]}", "2*π*K/(c*f_0)*(B/(2*f_0))^2", values, float(phase), "rad"),
        )
    is_one_air = mission.propagation is not None and mission.propagation.is_one_air
    rule = "sum" if is_one_air else findings.combine  # delays in the same air add
    yield from combined("Both legs", rule, [(name, float(phase)) for name, phase in legs.items()], row.declared)
    yield step("Allowable: all of the requirement, without share and gain", f"allowable = {row.allowable:.6g} rad")


def _spatial_variance(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for the spatial variance of the quadratic phase.

    The spatial variance is the largest difference in quadratic phase between the edge and the centre of the scene.
    """
    scene = findings.scene
    if scene is None or scene.degeneracy or row.declared is None:
        return
    east, north = at(scene.radius, scene.azimuth)
    differences = differences_at(analysis.errors, scene.radius, scene.azimuth, analysis.random)
    named_phases = phase_parts(differences, findings.combine, analysis.groups)
    sizes_by_name = [(row_id, plain(phase)) for row_id, phase in named_phases]
    yield step(
        f"Full model at the scene’s edge, {east:.6g} m east, {north:.6g} m north of the centre, less at the centre"
    )
    yield from combined("Difference of QPE of the declared errors", findings.combine, sizes_by_name, row.declared)
    yield step("Budget of what one autofocus correction leaves", f"total = {findings.allocation.qpe_total:.6g} rad")


def _location_aggregate(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    mission, together = analysis.mission, analysis.together(_model(row))
    rule = (
        "the longest sum over all signs of the vectors" if findings.combine == "sum" else RULE_WORDS[findings.combine]
    )
    moves = together.displacement_parts()
    title = "(25), (30)" if row.model == "published" else "Full model, each by the sign that moves farther"
    if findings.combine == "sum":
        wander = dict(together.undirected_moves)
        vectors = [
            f"{printable(name)}: {with_unit(math.hypot(x, y), 'm')} whichever way"
            if name in wander
            else f"{printable(name)}: {with_unit(x, 'm')} east, {with_unit(y, 'm')} north"
            for name, (x, y) in moves
        ]
        longest = [] if row.declared is None else [f"combined = {row.declared:.6g} m"]
        yield step(f"{title}: displacements, {rule}", *(vectors or ["none"]), *longest)
    else:
        lengths = [(name, math.hypot(*move)) for name, move in moves]
        title = f"{title}: displacement of the declared errors"
        if findings.combine == "rss" and Totals(analysis).is_asked(LOCATION):
            root_sum_square = math.sqrt(math.fsum(length * length for _, length in lengths))
            yield from combined(title, findings.combine, lengths, root_sum_square, unit="m", symbol="rss")
            yield from total_steps(analysis, _model(row), LOCATION, lambda owner: True, root_sum_square, row.declared)
        else:
            yield from combined(title, findings.combine, lengths, row.declared, unit="m")
    if row.allowable is not None:
        key_location = location(mission, ("requirements", "location_error"))
        yield step("Allowable", f"requirements.location_error = {row.allowable:.6g} m, {key_location}")


def _unstated(analysis: Analysis, findings: MissionFindings, row: Row) -> Iterator[Step]:
    """Yield nothing for a flight log whose processing is not stated in the mission file.

    The residual of the log cannot be explained if the processing is not known.
    """
    yield from ()


# Steps of the rows that are neither sources nor random errors, by kind.
ROW_STEPS: Mapping[str, Callable[[Analysis, MissionFindings, Row], Iterator[Step]]] = {
    "oscillator.acceleration": _tone,
    "oscillator.spur": _spur,
    "vibration": _vibration_in_its_unit,
    "other": _power,
    "trajectory.residual": _unstated,
    QUADRATIC: _phase_aggregate,
    CUBIC: _cubic_aggregate,
    LOCATION: _location_aggregate,
    "pslr": _pslr,
    "islr": _islr,
    "autofocus_pull_in": _pull_in,
    "spatial_variance": _spatial_variance,
    "dispersion": _dispersion,
    DECLARE: _declarations,
    SPECIFICATION: _specification,
}


def _verdict(row: Row, findings: MissionFindings) -> Iterator[str]:
    yield ""
    texts = [text for text in (row.reason, *row.notes) if text]
    declared = "" if row.declared is None else f", declared {declared_size(row, findings)}"
    allowable = "" if row.allowable is None else f", allowable {row_limit(row, findings)}"
    yield f"{STATUS[row.status].text}{declared}{allowable}"
    yield from (f"    {printable(text)}" for text in texts)


_EFFECT_TITLES = {"cubic": "Cubic phase", "spread": "Rms phase that spreads", "tone": "Peak phase of the tones"}


def finding_of(mission: Mission, findings: MissionFindings, requirement: JudgedRequirement) -> Iterator[Step]:
    """Yield the explanation steps for a requirement.

    They show its line in the file and the rows that determine its status.
    """
    path = ("requirements", requirement.key)
    if requirement.key == DECLARE:
        yield from _asked_for(mission)
    elif requirement.is_default:
        yield step("The file does not state it: the default")
    else:
        yield step(f"Required in {location(mission, path)}", as_written(mission, path))
    judging = [row for row in findings.rows if row.id in requirement.rows]
    width = max((len(row.id) for row in judging), default=0)
    lines = [
        f"{printable(row.id):<{width}}  {STATUS[row.status].text}"
        + ("" if row.utilization is None else f", {percent(row.utilization)}")
        for row in judging
    ]
    yield step("Rows that judge it", *(lines or ["none"]))


def declarations(mission: Mission) -> Iterator[Step]:
    """Yield the explanation step that lists the errors the file must declare.

    A second step lists the errors that must be declared, but are missing in the file.
    """
    yield from _asked_for(mission)
    missing_keys = [declaration.lacks or declaration.key for declaration in missing_declarations(mission)]
    yield step("Not in the file", *(missing_keys or ["nothing: all of it is declared"]))


def _asked_for(mission: Mission) -> Iterator[Step]:
    asked = ", ".join(mission.requirements.declare)
    yield step(f"Required in {location(mission, ('requirements', 'declare'))}", f"requirements.declare: [{asked}]")


def not_judged(findings: MissionFindings, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for a row that could not be judged.

    The reason may be an effect without a requirement, a platform path that may be wrong, or an unknown displacement.
    """
    analysis = findings.analysed()
    mission, reason = analysis.mission, _reason(findings, row)
    if reason is None:
        return
    code = reason.code
    if code == "not-declared-as-required":
        yield from _asked_for(mission)
    elif code in ("input-in-doubt", "input-states-more", "input-usually-has-more"):
        yield from _path_in_doubt(mission, row)
    elif code == "clocks-are-not-set":
        yield from _displacing(analysis, row)
    elif code == "air-stays":
        yield _air_that_changes(reason)
    else:
        for effect in untaken_effects(analysis):
            if row.id in effect.makers and effect.makers[row.id][0]:
                yield from _untaken(analysis, row, effect)


def _air_that_changes(reason: Note) -> Step:
    """Return the explanation step for atmospheric delays that are declared constant.

    The step states the effect that the delays would have if they changed over time, and this effect as a fraction of
    the allowable.
    """
    values: Sequence[SectionValue] = reason.values
    _, correlation_time, key, size, use, _ = values
    unit = {"islr": "dB", LOCATION: "m"}.get(key, "rad")
    title = f"The declared delays of the air, if their correlation time were {with_unit(correlation_time, 's')}"
    return step(
        title, f"{key} = {with_unit(size, unit)}", f"use = {number(use)}, negligible up to {NEGLIGIBLE_FRACTION:g}"
    )


def _reason(findings: MissionFindings, row: Row) -> Note | None:
    """Reason why a row is not judged or is waived; None if there is no such reason.

    For a row without a declared value, the reason is taken from the requirement with the same id.
    """
    if row.status in ("not_evaluated", "waived"):
        return row.reason
    if row.status == "not_declared":
        for requirement in findings.requirements:
            if requirement.id == row.id and requirement.status in ("not_evaluated", "waived"):
                return requirement.reason
    return None


def _untaken(analysis: Analysis, row: Row, untaken: UntakenEffect) -> Iterator[Step]:
    """Yield the explanation steps for an effect that is not limited by any requirement.

    They show the total size of the effect, the size below which it is negligible, and the contribution of the row.
    """
    effect_name = untaken.effect
    totals = []
    for model in analysis.gates:
        together, sizes_by_name = analysis.together(model), effect_parts(analysis, model)[effect_name]
        rule = together.rule_of_all
        totals.append(
            (float(together.combined(sizes_by_name, rule)[0]), rule, together.phase_parts(sizes_by_name, rule))
        )
    total, rule, sizes_by_name = max(totals, key=lambda candidate: candidate[0])
    yield from combined(
        f"{_EFFECT_TITLES[effect_name]}: no requirement judges it", rule, sizes_by_name, total, symbol="total"
    )
    required = analysis.mission.requirements.quadratic_phase_error
    values = {"required": required}
    level = min(NEGLIGIBLE_FRACTION * required, SMALL_RAD)
    worked = WorkedEquation(
        "negligible", f"min({NEGLIGIBLE_FRACTION:g}*required, {SMALL_RAD:g})", values, level, "rad"
    )
    yield step(
        "Below a tenth of requirements.quadratic_phase_error and below 0.08 rad it would be negligible", worked
    )
    largest, row_size_rad = max(float(size[0]) for size in untaken.parts.values()), float(untaken.parts[row.id][0])
    count = sum(float(size[0]) > 0 for size in untaken.parts.values())
    values = {"largest": largest, "negligible": level}
    worked = WorkedEquation(
        "least", f"min({MAKER_FRACTION:g}*largest, negligible/{count})", values, float(untaken.least[0]), "rad"
    )
    title = "It consists of parts of at least a tenth of the largest, and of smaller ones if together not negligible"
    yield step(f"{title}; this row’s is {with_unit(row_size_rad, 'rad')}", worked)


def _path_in_doubt(mission: Mission, row: Row) -> Iterator[Step]:
    """Yield the explanation steps for a platform path that may be wrong.

    They show the possible error of the path and the declared position errors.
    """
    for doubt in input_doubts(mission):
        if row.owner != "mission" and not is_in_doubt(row.subject, doubt.owner, mission, doubt.state):
            continue
        if doubt.is_stated:
            yield _stated_by_source(doubt)
            continue
        if doubt.is_of_log:
            yield _of_log(doubt)
            continue
        platform: Platform = getattr(mission.platforms, doubt.owner)
        error, path = platform.motion_error, platform.path
        doubt_words = f": {printable(path.doubt_of)}" if path is not None and path.doubt_of else ""
        yield step(
            f"How far the {doubt.owner}’s path may be off{doubt_words}", f"doubt = {with_unit(doubt.doubt, 'm')}"
        )
        declared = declared_position_error(error)
        if declared is None:
            yield step("No position error is declared")
            continue
        sizes = [*(error.stated("position") or ()), *(sigma for process in error.random for sigma in process.sigma)]
        terms = " + ".join(f"{number(size)}^2" for size in sizes)
        line = Sum(f"stated = sqrt({terms}) = {with_unit(declared, 'm')}")
        yield step("Declared position errors, without coverage factor: less than the doubt", line)


def _of_log(doubt: InputDoubt) -> Step:
    """Return the explanation step for a flight log that may be inaccurate.

    The step states the residual of the log or the rounding step of its fixes, and the largest value that is
    negligible.
    """
    if doubt.is_phase:
        title = f"Residual of the {doubt.owner}’s smoothed log along the line of sight, rms phase"
        return step(title, f"left = {with_unit(doubt.doubt, 'rad')}", f"most = {with_unit(doubt.declared, 'rad')}")
    title = f"Quantisation step of the {doubt.owner}’s log, compared with the declared position error"
    largest = MOST_GRID_SHARE * doubt.declared
    return step(title, f"step = {with_unit(doubt.doubt, 'm')}", f"most = a tenth of it = {with_unit(largest, 'm')}")


def _stated_by_source(doubt: InputDoubt) -> Step:
    """Return the explanation step that compares the error stated by the source of a path with the declared error."""
    title = f"The {doubt.kind} error that the source of the {doubt.owner}’s path states exceeds the declared one"
    sizes = {"stated": doubt.doubt, "declared": doubt.declared}
    return step(title, *(f"{name} = {with_unit(size, doubt.unit)}" for name, size in sizes.items()))


def _displacing(analysis: Analysis, row: Row) -> Iterator[Step]:
    """Yield the explanation step that lists the clock errors whose displacement of the image is unknown.

    For each error it gives the quadratic and the cubic phase.
    """
    model, lines = row.model or "published", []
    names = {error.id for error in analysis.random if error.displaces_unknown}
    for contribution in analysis.together(model).own:
        if contribution.row_id in names:
            qpe, cubic = (with_unit(plain(phase), "rad") for phase in (contribution.qpe_rad, contribution.cubic_rad))
            lines.append(f"{printable(contribution.row_id)}: QPE {qpe}, cubic {cubic}")
    yield step("Not included in the displacement, which is not computed for them", *lines)
