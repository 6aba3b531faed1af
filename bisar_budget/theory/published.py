"""The limits of Rigling & Moses: Table I, Table II, vibration, pull-in, derived row by row in print order."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from sympy import Abs, Eq, Expr, Function, Integer, Rational, Symbol, diff, pi, solve

from bisar_budget.theory import differential_range as dr
from bisar_budget.theory.symbols import (
    AXES,
    PLATFORMS,
    PlatformSymbols,
    T,
    c,
    center_frequency,
    clock_coefficients,
    islr,
    n_pull,
    positive,
    pslr,
    real,
    share,
    tau,
    total_qpe,
    wavelength,
)

KINDS = ("position", "velocity", "acceleration")
TOTAL_QPE = pi / 4  # monostatic custom, Section V
EQUAL_SHARE_QPE = pi / 8  # per platform, Section V


@dataclass(frozen=True)
class TableRow:
    """One row of a table: its number in print, the error it is about, its cells left to right."""

    number: int | None
    error: Symbol
    label: Expr
    cells: tuple[Expr, ...]
    note: str = ""


@dataclass(frozen=True)
class Table:
    """A table with the paper's number, its column heads and its rows in print order."""

    number: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[TableRow, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Equation:
    """A numbered equation: whether it is `defined` or `derived`, and what the print gets wrong."""

    number: str
    title: str
    left: Expr
    right: Expr
    origin: str = "derived"
    slip: str = ""


def motion_errors(platform: PlatformSymbols) -> tuple[Symbol, ...]:
    """Return the nine error symbols of a platform in the order of Table I: x p v a, y p v a, z p v a."""
    kinds = (platform.position_error, platform.velocity_error, platform.acceleration_error)
    return tuple(kind[axis] for axis in range(3) for kind in kinds)


def single_error(expression: Expr, error: Symbol) -> Expr:
    """Keep what one error alone does: every other error is set to zero."""
    every = [*clock_coefficients, *(e for platform in PLATFORMS for e in motion_errors(platform))]
    return expression.xreplace({other: Integer(0) for other in every if other != error})


def coefficient_rows(beta: Sequence[Expr], *, is_numbered: bool) -> tuple[TableRow, ...]:
    """Rows of a table of coefficients of the range error: the clock alone, then each motion error alone."""
    motion_free = {e: 0 for platform in PLATFORMS for e in motion_errors(platform)}
    clock = Eq(Function("ttilde")(tau), dr.clock_polynomial(), evaluate=False)
    number = 1 if is_numbered else None
    rows = [TableRow(number, real("ttilde"), clock, tuple(cell.subs(motion_free) for cell in beta))]
    for platform in PLATFORMS:
        polynomial = dr.error_polynomial(platform)
        for index, error in enumerate(motion_errors(platform)):
            axis = index // 3
            track = Function(f"{AXES[axis]}tilde_{platform.subscript}")(tau)
            label = Eq(track, single_error(polynomial[axis], error), evaluate=False)
            cells = tuple(single_error(cell, error) for cell in beta)
            rows.append(TableRow(2 + index if is_numbered else None, error, label, cells))
    return tuple(rows)


@cache
def table_1() -> Table:
    """Table I: coefficients β̃₀ … β̃₃ of the range error, for the clock and each motion error alone."""
    return Table(
        number="Table I",
        title="Differential range errors induced by motion measurement errors",
        columns=("Constant β̃₀", "Linear β̃₁", "Quadratic β̃₂", "Cubic β̃₃"),
        rows=coefficient_rows(dr.coefficients(dr.range_error()), is_numbered=True),
        notes=("Rows are numbered as printed; the paper prints the transmitter's and has the receiver's by t to r.",),
    )


def edge_phase(beta: Expr, order: int) -> Expr:
    """Phase of one term of the range error at the aperture edge, (2π/λ)·β·(T/2)ⁿ. Signed like β. [rad]"""
    return 2 * pi / wavelength * beta * (T / 2) ** order


def limit(phase: Expr, error: Symbol, budget: Expr) -> Expr:
    """Magnitude of an error at which a phase proportional to it reaches the budget."""
    size = Symbol("size", positive=True)
    (solution,) = solve(Eq(Abs(phase.subs(error, size)), budget), size)
    return solution


@cache
def table_2() -> Table:
    """Table II: quadratic phase error and largest allowable error, with the bars that the print omits."""
    beta_2, budget = dr.coefficients(dr.range_error())[2], EQUAL_SHARE_QPE
    rows = []
    for platform in PLATFORMS:
        errors = [*platform.velocity_error, *platform.acceleration_error]
        powers = [tau] * 3 + [tau**2 / 2] * 3
        for index, (error, power) in enumerate(zip(errors, powers, strict=True)):
            qpe = edge_phase(single_error(beta_2, error), 2)
            allowable = limit(qpe, error, budget)
            if error in list(platform.acceleration_error):
                allowable = dr.in_angles(allowable)  # x/R is printed as cos φ̄ cos θ̄
            track = Function(f"{AXES[index % 3]}tilde_{platform.subscript}")(tau)
            rows.append(
                TableRow(
                    number=1 + index,
                    error=error,
                    label=Eq(track, error * power, evaluate=False),
                    cells=(Abs(qpe), allowable),
                )
            )
    clock = clock_coefficients[2]
    clock_qpe = edge_phase(single_error(beta_2, clock), 2).subs(wavelength, c / center_frequency)
    rows.append(
        TableRow(
            number=None,
            error=clock,
            label=Eq(Function("ttilde")(tau), clock * tau**2, evaluate=False),
            cells=(Abs(clock_qpe), limit(clock_qpe, clock, budget)),
            note="not in the paper: the same step for the clock's quadratic term",
        )
    )
    return Table(
        number="Table II",
        title="Quadratic phase error and allowable error at π/8 per platform",
        columns=("QPE [rad]", "Allowable, magnitude"),
        rows=tuple(rows),
        notes=("Rows are numbered as printed, the receiver's by t to r. The paper omits the bars.",),
    )


def one_way_phase(motion: Expr) -> Expr:
    """Phase of a motion of one platform along its line of sight, 2πA/λ. [rad]"""
    return 2 * pi * motion / wavelength


@cache
def vibration() -> Table:
    """Vibration limits of Section V, amplitude and rms along the line of sight, with a share of power.

    A phase of peak φ makes paired echoes; the rule of Carrara et al., Table 5.12, that the paper quotes is
    (2πA/λ)² ≤ PSLR and (2πσ/λ)² ≤ ISLR. Powers add, so a platform's share s multiplies the power.
    """
    amplitude, rms = positive("A"), positive("sigma")

    def bound(motion: Symbol, ratio: Symbol) -> TableRow:
        phase = one_way_phase(motion)
        (allowable,) = solve(Eq(phase**2, ratio * share), motion)
        return TableRow(
            number=None,
            error=motion,
            label=motion,
            cells=(phase**2, allowable, allowable.subs(share, Rational(1, 2))),
        )

    return Table(
        number="Vibration",
        title="Allowable sinusoidal amplitude A (0 to peak) and wideband rms σ, line of sight",
        columns=("Power of the phase", "Allowable at share s", "Allowable at s = 1/2"),
        rows=(bound(amplitude, pslr), bound(rms, islr)),
        notes=("PSLR and ISLR are power ratios: -30 dB is 10^-3.",),
    )


def pull_in_factor() -> Expr:
    """Factor by which autofocus that corrects π·N_pull radians raises a limit: π·N_pull over the total QPE.

    4·N_pull for the total of π/4, Section VI.
    """
    return pi * n_pull / total_qpe


def sensitivity(expression: Expr, error: Symbol) -> Expr:
    """Effect of one unit of an error on an expression linear in it."""
    slope = diff(expression, error)
    if slope.has(error):
        raise ValueError(f"not linear in {error}")
    return slope
