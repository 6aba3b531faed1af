"""Rigling & Moses as published: equations (1) to (31), Tables I and II, vibration limits, and autofocus pull-in.

An equation is either defined as in the paper, or derived from earlier equations. The rows of the tables are derived
in printed order. Misprints of the paper are noted at the equation, and the equation given here is the correct
version. The indices of sums are as in the paper: i counts frequencies, k counts pulses, m counts scatterers, and k_x
and k_y count the samples of the rectangular grid.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from sympy import (
    Abs,
    Add,
    Eq,
    Expr,
    Function,
    I,
    ImmutableMatrix,
    IndexedBase,
    Integer,
    Inverse,
    MatMul,
    Matrix,
    MatrixBase,
    MatrixSymbol,
    Mul,
    Rational,
    Sum,
    Symbol,
    cos,
    diff,
    exp,
    expand,
    pi,
    simplify,
    sin,
    solve,
)

from bisar_budget.theory import differential_range as dr
from bisar_budget.theory.symbols import (
    AXES,
    PLATFORM_SYMBOLS,
    TRANSMITTER,
    PlatformSymbols,
    T,
    c,
    center_frequency,
    clock_coefficients,
    islr,
    n_pull,
    point,
    positive,
    pslr,
    real,
    share,
    tau,
    total_qpe,
    wavelength,
)

ERROR_KINDS = ("position", "velocity", "acceleration")
EQUAL_SHARE_QPE_RAD = pi / 8  # for each platform: half of the usual monostatic limit, Section V


@dataclass(frozen=True)
class TableRow:
    """Row of a table: its printed number, the symbol of its error, and its cells from left to right.

    `label` is the expression that is displayed for the error, for example the error as a function of slow time.
    """

    number: int | None
    error: Symbol
    label: Expr
    cells: tuple[Expr, ...]
    note: str = ""


@dataclass(frozen=True)
class FormulaTable:
    """Table of formulas: its number in the paper or its name, the column heads, and the rows in printed order."""

    number: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[TableRow, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Equation:
    """Equation with its number in the paper. The number is empty for an equation that is not in the paper.

    `origin` is `defined` for a definition and `derived` for an equation that SymPy derives. `slip` describes the
    mistake in the printed equation, if there is one.
    """

    number: str
    title: str
    left: Expr
    right: Expr
    origin: str = "derived"
    slip: str = ""


def motion_errors(platform: PlatformSymbols) -> tuple[Symbol, ...]:
    """Return the nine error symbols of a platform in the order of Table I.

    For each of the axes x, y and z these are the position, velocity and acceleration error.
    """
    kinds = (platform.position_error, platform.velocity_error, platform.acceleration_error)
    return tuple(kind[axis] for axis in range(3) for kind in kinds)


def single_error(expression: Expr, error: Symbol) -> Expr:
    """Part of an expression that is due to a single error: the expression with all other errors set to zero."""
    every = [*clock_coefficients, *(e for platform in PLATFORM_SYMBOLS for e in motion_errors(platform))]
    return expression.xreplace({other: Integer(0) for other in every if other != error})


def coefficient_rows(beta: Sequence[Expr], *, is_numbered: bool) -> tuple[TableRow, ...]:
    """Rows of a table of range-error coefficients: a row for the clock error, then a row for each motion error.

    `beta` holds the coefficients with all errors. If `is_numbered` is true, the rows have the numbers of Table I.
    """
    motion_free = {e: 0 for platform in PLATFORM_SYMBOLS for e in motion_errors(platform)}
    clock = Eq(Function("ttilde")(tau), dr.clock_polynomial(), evaluate=False)
    number = 1 if is_numbered else None
    rows = [TableRow(number, real("ttilde"), clock, tuple(cell.subs(motion_free) for cell in beta))]
    for platform in PLATFORM_SYMBOLS:
        polynomial = dr.error_polynomial(platform)
        for index, error in enumerate(motion_errors(platform)):
            axis = index // 3
            track = Function(f"{AXES[axis]}tilde_{platform.subscript}")(tau)
            label = Eq(track, single_error(polynomial[axis], error), evaluate=False)
            cells = tuple(single_error(cell, error) for cell in beta)
            rows.append(TableRow(2 + index if is_numbered else None, error, label, cells))
    return tuple(rows)


@cache
def table_1() -> FormulaTable:
    """Table I: coefficients β̃₀ … β̃₃ of the range error, for the clock error and for each motion error."""
    return FormulaTable(
        number="Table I",
        title="Differential range errors induced by motion measurement errors",
        columns=("Constant β̃₀", "Linear β̃₁", "Quadratic β̃₂", "Cubic β̃₃"),
        rows=coefficient_rows(dr.coefficients(dr.range_error()), is_numbered=True),
        notes=("Rows are numbered as printed; the paper prints the transmitter's and has the receiver's by t to r.",),
    )


def edge_phase(beta: Expr, order: int) -> Expr:
    """Phase of one term of the range error at the aperture edge, (2π/λ)·β·(T/2)ⁿ, with the sign of β. [rad]"""
    return 2 * pi / wavelength * beta * (T / 2) ** order


def limit(phase: Expr, error: Symbol, budget: Expr) -> Expr:
    """Largest allowable magnitude of an error: the magnitude at which the phase `phase` reaches `budget`.

    `phase` must be linear in the error.
    """
    size = Symbol("size", positive=True)
    (solution,) = solve(Eq(Abs(phase.subs(error, size)), budget), size)
    return solution


@cache
def table_2() -> FormulaTable:
    """Table II: quadratic phase error and largest allowable error.

    The absolute-value bars that are missing in the printed table are restored.
    """
    beta_2, budget = dr.coefficients(dr.range_error())[2], EQUAL_SHARE_QPE_RAD
    rows = []
    for platform in PLATFORM_SYMBOLS:
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
    return FormulaTable(
        number="Table II",
        title="Quadratic phase error and allowable error at π/8 per platform",
        columns=("QPE [rad]", "Allowable, magnitude"),
        rows=tuple(rows),
        notes=("Rows are numbered as printed, the receiver's by t to r. The paper omits the bars.",),
    )


def one_way_phase(motion: Expr) -> Expr:
    """Phase 2πA/λ that a motion A of a platform along its line of sight causes by changing the one-way path. [rad]"""
    return 2 * pi * motion / wavelength


@cache
def vibration() -> FormulaTable:
    """Table of the vibration limits of Section V: allowable amplitude and rms value along the line of sight.

    A phase with a peak φ causes paired echoes. The paper quotes the rule of Carrara et al., Table 5.12: (2πA/λ)² ≤
    PSLR and (2πσ/λ)² ≤ ISLR. Powers add, so the allowable power of a platform is multiplied by its power share s.
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

    return FormulaTable(
        number="Vibration",
        title="Allowable sinusoidal amplitude A (0 to peak) and wideband rms σ, line of sight",
        columns=("Power of the phase", "Allowable at share s", "Allowable at s = 1/2"),
        rows=(bound(amplitude, pslr), bound(rms, islr)),
        notes=("PSLR and ISLR are power ratios: -30 dB is 10^-3.",),
    )


def pull_in_factor() -> Expr:
    """Factor by which autofocus raises a limit if it corrects up to π·N_pull radians: π·N_pull / total QPE.

    N_pull is defined in Section VI. For a total quadratic phase error (QPE) of π/4 the factor is 4·N_pull.
    """
    return pi * n_pull / total_qpe


def sensitivity(expression: Expr, error: Symbol) -> Expr:
    """Effect of one unit of an error: the derivative of an expression that is linear in the error."""
    slope = diff(expression, error)
    if slope.has(error):
        raise ValueError(f"not linear in {error}")
    return slope


# ---------------------------------------------------------------------- equations
DEFINED = "defined"

i, k, m = (Symbol(name, integer=True) for name in "ikm")
frequency, slow_time, reflectivity = IndexedBase("f"), IndexedBase("tau"), IndexedBase("A")
frequencies, pulses, scatterers = (Symbol(f"N_{name}", integer=True, positive=True) for name in ("f", "tau", "m"))
f_i, tau_k, A_m = frequency[i], slow_time[k], reflectivity[m]

# The rectangular grid (13) of the rotated frame. f₀ is the lower edge of the projected band there.
k_x, k_y = (Symbol(f"k_{axis}", integer=True) for axis in "xy")
N_x, N_y = (Symbol(f"N_{axis}", integer=True, positive=True) for axis in "xy")
B_x, B_y, f_0 = positive("B_x"), positive("B_y"), positive("f_0")
x_turned, y_turned = real("xprime"), real("yprime")
x_of, y_of = IndexedBase("xprime"), IndexedBase("yprime")  # positions of the scatterers

phi_b = real("phi_b")
beta = tuple(real(f"beta_{n}") for n in range(2))
beta_error = tuple(real(f"beta_{n}tilde") for n in range(4))
tau_i = real("tau_i")
piece = tuple(real(f"betatilde_{n}i") for n in range(2))
piece_range = tuple(real(f"beta_{n}i") for n in range(2))


def phase(differential_range: Expr) -> Expr:
    """Return equation (2): the phase of a sample for a scatterer with a given differential range. [rad]"""
    return -2 * pi * f_i * differential_range / c


def in_slow_time(expression: Expr, at: Expr = tau_k) -> Expr:
    """Replace the angles at mid-aperture by the angles at a slow time, for example φ̄_t by φ_t(τ_k)."""
    for platform in PLATFORM_SYMBOLS:
        s = platform.subscript
        expression = expression.subs(
            {platform.azimuth: Function(f"phi_{s}")(at), platform.elevation: Function(f"theta_{s}")(at)}
        )
    return expression


def spatial_frequencies() -> Matrix:
    """Spatial frequencies of equation (8): −f/2 times the gradient of equation (6), with shape (3,). [Hz]"""
    return Matrix([f_i / 2 * expand(-diff(dr.far_field_in_angles(), x)) for x in point])


def rotation(x: Expr, y: Expr) -> Matrix:
    """Components of a vector along the look direction φ_b, and 90° counter-clockwise from it, with shape (2,).

    They follow from equations (9) and (10).
    """
    return Matrix([x * cos(phi_b) + y * sin(phi_b), -x * sin(phi_b) + y * cos(phi_b)])


def unrotated(x: Expr, y: Expr) -> Matrix:
    """Components along x and y of a vector that is given in the rotated coordinates of equations (9) and (10).

    The result is a vector of shape (2,).
    """
    return rotation(x, y).subs(phi_b, -phi_b)


def exponent(products: Expr) -> Expr:
    """Exponent −jΦ of the far-field matched filter, with the phase Φ of equation (2).

    `products` is x·f_x + y·f_y + z·f_z. According to equations (6) and (8), this sum equals −f·ΔR/2.
    """
    together = real("products")
    return (-I * phase(-2 * together / f_i)).subs(together, products)


def turned_products(f_x: Expr, f_y: Expr) -> Expr:
    """Scalar product x·f_x + y·f_y in the rotated coordinates of equations (9) and (10): x′·f′_x + y′·f′_y."""
    return simplify(unrotated(x_turned, y_turned).dot(unrotated(f_x, f_y)))


def summed(over_frequencies_and_pulses: Expr) -> Expr:
    """Mean of an expression over all frequencies and pulses, as in equation (4)."""
    inner = Sum(over_frequencies_and_pulses, (i, 1, frequencies), (k, 1, pulses))
    return inner / (frequencies * pulses)


def received() -> Expr:
    """Symbol S(f_i, τ_k) of the received samples, a function of frequency and slow time."""
    return Function("S")(f_i, tau_k)


def grid() -> tuple[Expr, Expr]:
    """Return equation (13): the rectangular grid of rotated spatial frequencies. [Hz]"""
    return f_0 + B_x * k_x / N_x, -B_y / 2 + B_y * k_y / N_y


def half_angle(theta: Expr) -> Expr:
    """Write 1 − exp(−jθ) as the product of a phasor and a sine: exp(−jθ/2)·2j·sin(θ/2)."""
    angle = real("theta")
    chord = expand(exp(I * angle / 2) - exp(-I * angle / 2), complex=True)
    return (exp(-I * angle / 2) * chord).subs(angle, theta)


def geometric_sum(step: Expr, count: Expr) -> tuple[Expr, Expr]:
    """Sum of exp(−j·step·n) over n = 0 … count − 1, written as a phasor times a quotient of sines.

    Returns the exponent of the phasor, and the quotient.
    """
    total = half_angle(count * step) / half_angle(step)  # Σ qⁿ = (1 − q^N)/(1 − q)
    turns = [factor for factor in total.args if factor.func is exp]
    return Add(*(turn.args[0] for turn in turns)), total / Mul(*turns)


def response() -> Expr:
    """Return equation (16): the filter (14) applied to the samples (15), with two Dirichlet kernels per scatterer."""
    # The sums for one scatterer are separable: exp(−j(4π/c)(x′ − x′_m)(f₀ + B_x k_x/N_x)) times the same in y′.
    whole, kernels = [], []
    for offset, start, band, count in (
        (x_turned - x_of[m], f_0, B_x, N_x),
        (y_turned - y_of[m], -B_y / 2, B_y, N_y),
    ):
        turn, kernel = geometric_sum(4 * pi / c * offset * band / count, count)
        phase_of_it = -4 * I * pi / c * offset * start + turn
        # Factor of the offset: 2f₀ + B_x − B_x/N_x in x′. In y′, −B_y and B_y cancel and −B_y/N_y remains.
        whole.append(offset * expand(simplify(phase_of_it / offset / (-2 * I * pi / c))))
        kernels.append(kernel)
    turned = exp(-2 * I * pi / c * (whole[0] + whole[1]))
    return Sum(A_m * turned * kernels[0] * kernels[1], (m, 1, scatterers)) / (N_x * N_y)


def general_matrix() -> Matrix:
    """Return the 2 × 3 matrix of equation (18), which maps a point in space to (β₀, β₁). [-], [1/s]"""
    return Matrix(dr.linear_differential_range()).jacobian(point)


def observed_polynomial() -> tuple[Expr, ...]:
    """Coefficients β̂₀ … β̂₃ of equation (24): for each order, the sum of the coefficients of (17) and (23)."""
    scatterer = beta[0] + beta[1] * tau
    error = sum(coefficient * tau**n for n, coefficient in enumerate(beta_error))
    return dr.coefficients(scatterer + error)


def tangent() -> tuple[Expr, Expr]:
    """Return equations (27) and (28): the value [m] and the slope [m/s] of the cubic range error at τ_i."""
    error = sum(coefficient * tau**n for n, coefficient in enumerate(beta_error))
    return error.subs(tau, tau_i), diff(error, tau).subs(tau, tau_i)


@cache
def piece_inverse() -> tuple[Matrix, Expr]:
    """Adjugate (2, 2) and determinant of Q_i in equation (30): the matrix Q for the platform positions at τ_i.

    The ranges keep their values at mid-aperture.
    """
    moved = {
        coordinate: coordinate + speed * tau_i
        for platform in PLATFORM_SYMBOLS
        for coordinate, speed in zip(platform.position, platform.velocity, strict=True)
    }
    adjugate, determinant = dr.ground_inverse()
    return adjugate.subs(moved, simultaneous=True), determinant.subs(moved, simultaneous=True)


def column(*names: str) -> Matrix:
    """Column vector of real symbols with the given names."""
    return Matrix([real(name) for name in names])


def product(*factors: Expr) -> Expr:
    """Product of matrices that is displayed without being multiplied out."""
    return MatMul(*(ImmutableMatrix(f) if isinstance(f, MatrixBase) else f for f in factors), evaluate=False)


@cache
def equations() -> tuple[Equation, ...]:
    """Return all numbered equations of the paper in order, followed by the autofocus gain of Section VI."""
    return (*_data(), *_images(), *_point_response(), *_ground_point(), *_errors(), *_effects())


def _data() -> tuple[Equation, ...]:
    observed = Function("DeltaRhat_m")(tau)
    at_k, phi_m = Function("DeltaRhat_m")(tau_k), Function("Phi_m")(f_i, tau_k)
    noise = Function("w")(f_i, tau_k)
    return (
        Equation("(1)", "Delay of a scatterer's echo", Function("t")(tau), observed / c, DEFINED),
        Equation("(1)", "Observed differential range", observed, dr.observed_differential_range(), DEFINED),
        Equation("(2)", "Phase of a sample", phi_m, phase(at_k), DEFINED),
        Equation("(3)", "Phase history", received(), Sum(A_m * exp(I * phi_m), (m, 1, scatterers)) + noise, DEFINED),
    )


def _images() -> tuple[Equation, ...]:
    x, y, z = point
    at_k, image = Function("DeltaR")(tau_k), Function("P")
    tested = Function("Phi_xyz")(f_i, tau_k)
    f_x, f_y, f_z = (Function(f"f_{axis}")(f_i, tau_k) for axis in AXES)
    turned = [Function(f"fprime_{axis}")(f_i, tau_k) for axis in "xy"]
    projected = rotation(real("f_x"), real("f_y"))
    place = rotation(x, y)
    grid_x, grid_y = grid()
    filtered = Function("S")(k_x, k_y) * exp(exponent(x_turned * grid_x + y_turned * grid_y))
    return (
        Equation("(4)", "Matched filter", image(x, y, z), summed(received() * exp(-I * tested)), DEFINED),
        Equation("(5)", "First-order differential range", Function("DeltaR")(tau), dr.far_field_differential_range()),
        Equation("(6)", "The same in angles", at_k, in_slow_time(dr.far_field_in_angles())),
        Equation(
            "(7)",
            "Far-field filter: (4) with the phase (2) of (6)",
            image(x, y, z),
            summed(received() * exp(exponent(x * f_x + y * f_y + z * f_z))),
        ),
        *(
            Equation("(8)", f"Spatial frequency along {axis}", one, in_slow_time(value))
            for axis, one, value in zip(AXES, (f_x, f_y, f_z), spatial_frequencies(), strict=True)
        ),
        *(
            Equation("(9)", f"Spatial frequency along {axis}′", real(f"fprime_{axis}"), value, DEFINED)
            for axis, value in zip("xy", projected, strict=True)
        ),
        *(
            Equation("(10)", f"Coordinate {axis}′", real(f"{axis}prime"), value, DEFINED)
            for axis, value in zip("xy", place, strict=True)
        ),
        Equation(
            "(11)",
            "Bistatic look angle",
            phi_b,
            dr.look_azimuth(),
            slip="an arctangent of a quotient loses the quadrant: atan2. Section VI calls it (10)",
        ),
        Equation(
            "(12)",
            "Far-field filter of the ground in rotated coordinates: (7) with (9) and (10)",
            image(x, y, 0),
            summed(received() * exp(exponent(turned_products(*turned)))),
        ),
        *(
            Equation(
                "(13)",
                f"Rectangular grid along {axis}′",
                real(f"fprime_{axis}"),
                value,
                DEFINED,
                "" if axis == "y" else "f₀ is the lower edge of the projected band, not of the transmitted one",
            )
            for axis, value in zip("xy", (grid_x, grid_y), strict=True)
        ),
        Equation(
            "(14)",
            "Polar format: (12) on the grid (13)",
            image(x_turned, y_turned, 0),
            Sum(filtered, (k_x, 0, N_x - 1), (k_y, 0, N_y - 1)) / (N_x * N_y),
        ),
    )


def _point_response() -> tuple[Equation, ...]:
    samples = A_m * exp(-exponent(x_of[m] * grid()[0] + y_of[m] * grid()[1]))
    return (
        Equation(
            "(15)",
            "Phase history on the grid: (3) with (2), (6), (13)",
            Function("S")(k_x, k_y),
            Sum(samples, (m, 1, scatterers)),
            slip="a bracket is lost; B_x·k_x/N_x stands with f₀ under x′_m",
        ),
        Equation(
            "(16)",
            "Response of scatterers: the sums of (14) over (15)",
            Function("P")(x_turned, y_turned, 0),
            response(),
            slip="1/(N_x·N_y) is lost, and the minus of the phase",
        ),
    )


def _ground_point() -> tuple[Equation, ...]:
    beta_0, beta_1 = dr.linear_differential_range()
    return (
        Equation(
            "(17)",
            "Differential range, linear in slow time",
            Function("DeltaR")(tau),
            real("beta_0") + real("beta_1") * tau,
            slip="the + between its two brackets is lost",
        ),
        Equation("(17)", "Constant coefficient", real("beta_0"), beta_0),
        Equation("(17)", "Linear coefficient", real("beta_1"), beta_1),
        Equation("(18)", "Point to coefficients", column("beta_0", "beta_1"), product(general_matrix(), point)),
        Equation("(19)", "Ground point to coefficients", Symbol("Q"), dr.ground_matrix()),
        Equation(
            "(20)",
            "Coefficients to ground point",
            Matrix(point[:2]),
            product(Inverse(MatrixSymbol("Q", 2, 2)), column("beta_0", "beta_1")),
        ),
    )


def _errors() -> tuple[Equation, ...]:
    s = TRANSMITTER.subscript
    slow, fast = Function(f"gtilde_{s}")(tau), Function(f"htilde_{s}")(tau)
    return (
        Equation("(21)", "Position error: slow and fast part", Function(f"rtilde_{s}")(tau), slow + fast, DEFINED),
        Equation("(22)", "Slow part, a quadratic", slow, dr.error_polynomial(TRANSMITTER), DEFINED),
        Equation("(23)", "Error of the differential range", Function("DeltaRtilde")(tau), dr.range_error_of_tracks()),
        Equation("(23)", "The same with (22)", Function("DeltaRtilde")(tau), dr.range_error()),
        Equation(
            "(24)",
            "Observed differential range: (17) and (23)",
            Function("DeltaRhat")(tau),
            sum(coefficient * tau**n for n, coefficient in enumerate(observed_polynomial())),
        ),
    )


def _effects() -> tuple[Equation, ...]:
    adjugate, determinant = dr.ground_inverse()
    moved = Matrix([real("beta_0tilde"), real("beta_1tilde")])
    value, slope = tangent()
    error = Function("DeltaRtilde")(tau)
    inverse, determinant_i = piece_inverse()
    observed = Matrix([a + b for a, b in zip(piece_range, piece, strict=True)])
    Q_i = MatrixSymbol("Q_i", 2, 2)
    return (
        Equation(
            "(25)",
            "Displacement of the image, times the determinant of Q",
            Symbol("detQ") * Matrix([real("xtilde"), real("ytilde")]),
            adjugate * moved,
        ),
        Equation(
            "(26)",
            "Range error about τ_i, a piece of a line",
            error,
            piece[0] + piece[1] * (tau - tau_i),
            slip="the slope multiplies τ; with (27) and (28) it multiplies τ − τ_i",
        ),
        Equation("(27)", "Value of a piece", piece[0], value),
        Equation("(28)", "Slope of a piece", piece[1], slope),
        Equation("(29)", "Point that a piece indicates", column("xhat_i", "yhat_i"), product(Inverse(Q_i), observed)),
        Equation("(30)", "Determinant of Q", Symbol("detQ"), determinant),
        Equation("(30)", "Inverse of Q, times its determinant", Symbol("adjQ"), adjugate),
        Equation("(30)", "Determinant of Q at τ_i", Symbol("detQ_i"), determinant_i),
        Equation("(30)", "Inverse of Q at τ_i, times its determinant", Symbol("adjQ_i"), inverse),
        Equation("(30)", "The same in angles at τ_i", Symbol("adjQ_i"), in_slow_time(dr.in_angles(adjugate), tau_i)),
        Equation("(31)", "Smear direction", Symbol("v_defocus"), dr.smear_direction()),
        Equation("Section VI", "Gain of the limits by autofocus", real("G"), pull_in_factor()),
    )
