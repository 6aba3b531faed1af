"""How the full model comes to a quadratic phase error, step by step: every number with its equation.

The formulas are those of `bisar-budget derive --table full`, letter for letter in the cells of its table; what a
platform's line of sight adds to s = u_t + u_r stands in the numbers of s.
"""

import math
from collections.abc import Iterator
from unicodedata import normalize

from bisar_budget.budget.effects import PLATFORMS, ErrorSource, full_ground
from bisar_budget.budget.findings import MissionFindings
from bisar_budget.constants import ROUNDING, SPEED_OF_LIGHT
from bisar_budget.mission.model import Mission
from bisar_budget.report import formulas
from bisar_budget.report.formulas import Equation, Step, equation, step

RATES = ("m", "m/s", "m/s²", "m/s³", "m/s⁴")  # units of the range error's coefficients
_LOOK_RATES = ("", "1/s", "1/s²", "1/s³", "1/s⁴")
_DOTS = ("", "\u0307", "\u0308", "\u20db", "\u20dc")  # of derivatives, over a letter
_DERIVED = "derive --table full has their equations"
QUADRATIC = "β̃_2 + (s\u0308_x*x\u0302 + s\u0308_y*y\u0302)/2"
QUARTIC = "β̃_4 + (s\u20dc_x*x\u0302 + s\u20dc_y*y\u0302)/24"
PHASE = "3*π*T^4*β_4/(28*λ) + π*T^2*β_2/(2*λ)"
DISPLACEMENT = (
    "(-β̃_0*\u1e61_y + β̃_1*s_y)/(det Q)",
    "(β̃_0*\u1e61_x - β̃_1*s_x)/(det Q)",
)
DETERMINANT = "s_x*\u1e61_y - s_y*\u1e61_x"


def motion_cells(kind: str, axis: str, platform: str) -> dict[int, tuple[int, str]]:
    """Cells of the full model's table by order in slow time, without the cubic: derivative of u, and formula."""
    u = [f"{_dotted('u', n)}_{axis}{platform[0]}" for n in range(5)]
    error = formulas.motion_symbol(kind, axis, platform)
    if kind == "position":
        divisor = {2: "/2", 4: "/24"}
        return {n: (n, f"-{error}*{u[n]}{divisor.get(n, '')}") for n in (0, 1, 2, 4)}
    if kind == "velocity":
        return {1: (0, f"-{u[0]}*{error}"), 2: (1, f"-{u[1]}*{error}"), 4: (3, f"-{u[3]}*{error}/6")}
    return {2: (0, f"-{error}*{u[0]}/2"), 4: (2, f"-{error}*{u[2]}/4")}


_FRACTIONS = {  # what a cell of an order has beside u and the error
    "position": {0: 1.0, 1: 1.0, 2: 1 / 2, 4: 1 / 24},
    "velocity": {1: 1.0, 2: 1.0, 4: 1 / 6},
    "acceleration": {2: 1 / 2, 4: 1 / 4},
}


def full_chain(
    mission: Mission, found: MissionFindings, source: ErrorSource, size: float, each: str
) -> Iterator[Step]:
    """From a signed error to its quadratic phase by the full model, what the displaced response adds included."""
    ground = full_ground(mission, found.geometry)
    each = each.replace(" of ", ", for ")
    beta = [0.0] * 5
    if source.owner == "clock":
        order = ("constant", "linear", "quadratic", "cubic").index(source.id.split(".")[1])
        beta[order] = SPEED_OF_LIGHT * size
        values = {"c": SPEED_OF_LIGHT, f"t̃_{order}": size}
        cell = equation(f"β̃_{order}", formulas.clock_coefficient(order), values, beta[order], RATES[order])
        yield from step(f"Full model, clock{each}", *cell)
    elif source.owner == "mission":
        yield from _of_both(source, ground.looks, beta, size, each)
    else:
        yield from _motion(source, ground.looks, beta, size, each)
    s = [tuple(t + r for t, r in zip(*of_order, strict=True)) for of_order in zip(*ground.looks, strict=True)]
    moved: tuple[float, ...] = (0.0, 0.0)
    if beta[0] or beta[1]:
        determinant = s[0][0] * s[1][1] - s[0][1] * s[1][0]
        moved = (
            (-beta[0] * s[1][1] + beta[1] * s[0][1]) / determinant,
            (beta[0] * s[1][0] - beta[1] * s[0][0]) / determinant,
        )
        # Likewise here: no image moves by less than rounding.
        moved = tuple(way if abs(way) > ROUNDING * math.hypot(*moved) else 0.0 for way in moved)
        known = {f"{_dotted('s', n)}_{axis}": s[n][i] for n in (0, 1) for i, axis in enumerate("xy")}
        yield from step(
            "Lines of sight of both platforms on the ground, s = u_t + u_r, and their rate", *_numbers(known)
        )
        yield from step("Determinant of Q", *equation("det Q", DETERMINANT, known, determinant, "1/s"))
        known |= {"β̃_0": beta[0], "β̃_1": beta[1], "det Q": determinant}
        lines = [
            line
            for symbol, formula, result in zip(("x\u0302", "y\u0302"), DISPLACEMENT, moved, strict=True)
            for line in equation(symbol, formula, known, result, "m")
        ]
        yield from step(f"Constant and linear term move the response east, north{each}", *lines)
    left = list(beta)
    for n, formula in ((2, QUADRATIC), (4, QUARTIC)):
        names = (f"{_dotted('s', n)}_x", f"{_dotted('s', n)}_y")
        added = (s[n][0] * moved[0] + s[n][1] * moved[1]) / math.factorial(n)
        # What is left of terms that cancel exactly is rounding.
        left[n] = beta[n] + added if abs(beta[n] + added) > ROUNDING * abs(beta[n]) else 0.0
        known = dict(zip(names, s[n][:2], strict=True)) | {"x\u0302": moved[0], "y\u0302": moved[1]}
        if not any(moved):
            continue
        what = "second" if n == 2 else "fourth"
        lines = list(equation(f"β_{n}", formula, known | {f"β̃_{n}": beta[n]}, left[n], RATES[n]))
        yield from step(f"With what the displaced response bends by itself, the {what} derivative of s{each}", *lines)
    if not any(moved):
        own = (Equation(f"β_{n}", "", {}, left[n], RATES[n]) for n in (2, 4))
        yield from step(f"The response is not moved: what bends are the error’s own terms{each}", *own)
    values = {"T": mission.collection.aperture_time, "λ": mission.radar.wavelength, "β_2": left[2], "β_4": left[4]}
    title = f"Full model{each}: the quadratic that fits both best over the aperture, at its edge"
    yield from step(title, *equation("QPE_full", PHASE, values, source.full.qpe * size, "rad"))


def _dotted(letter: str, order: int) -> str:
    """Symbol of a derivative, as the derivation prints it."""
    return normalize("NFC", letter + _DOTS[order])


def _unit(name: str) -> str:
    """Unit of u, s or a derivative of them, from its dots."""
    apart = normalize("NFD", name)
    return next(unit for dots, unit in zip(_DOTS[::-1], _LOOK_RATES[::-1], strict=True) if dots in apart)


def _numbers(known: dict[str, float]) -> list[Equation]:
    return [Equation(name, "", {}, value, _unit(name)) for name, value in known.items()]


def _motion(
    source: ErrorSource, looks: tuple[tuple[tuple[float, ...], ...], ...], beta: list[float], size: float, each: str
) -> Iterator[Step]:
    """β̃ of one error of one platform; along an axis of another frame, u is projected on it."""
    platform, kind, axis = source.id.split(".")
    letter = axis if axis in formulas.AXES else "d"
    look = looks[PLATFORMS.index(platform)]
    along = []
    for of_order in look:
        parts = [u * d for u, d in zip(of_order, source.direction, strict=True)]
        # What is left of terms that cancel exactly is rounding.
        along.append(sum(parts) if abs(sum(parts)) > ROUNDING * sum(map(abs, parts)) else 0.0)
    cells = motion_cells(kind, letter, platform)
    known = {f"{_dotted('u', n)}_{letter}{platform[0]}": along[n] for n, _ in cells.values()}
    which = axis if letter == axis else f"d, the {axis} axis"
    yield from step(
        f"Full model: line of sight of the {platform} along {which}, with its derivatives ({_DERIVED})",
        *_numbers(known),
    )
    lines: list[Equation] = []
    for order, (derivative, formula) in cells.items():
        beta[order] = -size * along[derivative] * _FRACTIONS[kind][order]
        values = known | {formulas.motion_symbol(kind, letter, platform): size}
        lines += equation(f"β̃_{order}", formula, values, beta[order], RATES[order])
    yield from step(f"Full model, terms of the range error by powers of slow time{each}", *lines)


def _of_both(
    source: ErrorSource, looks: tuple[tuple[tuple[float, ...], ...], ...], beta: list[float], size: float, each: str
) -> Iterator[Step]:
    """β̃ of one error of both platforms: a common one, or a scene h higher, as if both were measured too high."""
    is_terrain = source.id == "mission.terrain"
    kind, axis = ("position", "z") if is_terrain else source.id.split(".")[1:]
    letter = axis if axis in formulas.AXES else "d"
    error = "h" if is_terrain else formulas.motion_symbol(kind, letter, "t")[:-1]  # of neither alone
    known: dict[str, float] = {}
    lines: list[Equation] = []
    for order, (n, _) in motion_cells(kind, letter, "t").items():
        names = [f"{_dotted('u', n)}_{letter}{platform[0]}" for platform in PLATFORMS]
        along = [sum(u * d for u, d in zip(look[n], source.direction, strict=True)) for look in looks]
        known |= dict(zip(names, along, strict=True))
        beta[order] = -size * sum(along) * _FRACTIONS[kind][order]
        divisor = 1 / _FRACTIONS[kind][order]
        formula = f"-{error}*({names[0]} + {names[1]})" + (f"/{divisor:g}" if divisor > 1 else "")
        lines += equation(f"β̃_{order}", formula, known | {error: size}, beta[order], RATES[order])
    yield from step(
        f"Full model: lines of sight of both platforms along {axis}, with their derivatives ({_DERIVED})",
        *_numbers(known),
    )
    why = ": a scene higher by h is as both measured too high by h" if is_terrain else ""
    yield from step(f"Terms of the range error, the same error on both platforms{why}{each}", *lines)
