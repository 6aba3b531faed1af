"""The full model: all first-order terms of the range error, and the terms added by the displacement of the image.

Rigling & Moses assume a constant range and use only the quadratic term. Here the line of sight turns: to first order,
a position error r̃(τ) changes the range by −u(τ)·r̃(τ), where u(τ) is the unit vector to the platform. The constant
and linear terms displace the response to a point x̂ whose range history has the same terms. The range error minus the
range history of this point defocuses the response. The model is derived here; it is not in the paper.

Numerical results are computed from `range_error_at` at the nodes of Gauss-Legendre quadrature, as in `ranges`, and
are valid for any length of the aperture. The series about mid-aperture is used for comparison with Table I. For a
short aperture both agree.
"""

from collections.abc import Sequence
from functools import cache

from sympy import (
    Add,
    Eq,
    Expr,
    ImmutableMatrix,
    Matrix,
    Poly,
    Rational,
    Symbol,
    besselj,
    diff,
    exp,
    expand,
    factorial,
    legendre,
    series,
    solve,
    sqrt,
)

from bisar_budget.theory import differential_range as dr
from bisar_budget.theory import published
from bisar_budget.theory.published import Equation, FormulaTable, TableRow
from bisar_budget.theory.symbols import (
    AXES,
    PLATFORM_SYMBOLS,
    RECEIVER,
    TRANSMITTER,
    PlatformSymbols,
    baseline,
    c,
    islr,
    positive,
    pslr,
    real,
    share,
    tau,
)

SLOW_TIME_ORDER = 4  # highest power of slow time; the quartic term of a long aperture is partly a quadratic phase

DIRECT_PATH = ImmutableMatrix([real(f"b_{axis}") for axis in AXES])  # unit vector from receiver to transmitter
DISPLACEMENT = ImmutableMatrix([real("xhat"), real("yhat")])


def growth(platform: PlatformSymbols) -> dict[Symbol, Expr]:
    """Growth of the squared range under constant acceleration: |r|² = R²(1 + d₁τ + d₂τ² + d₃τ³ + d₄τ⁴).

    The result maps the symbol of each coefficient d₁ … d₄ to its expression. [1/sⁿ]
    """
    track = platform.position + platform.velocity * tau + platform.acceleration * tau**2 / 2
    square = Poly(expand(track.dot(track)), tau)
    return {
        real(f"d_{n}{platform.subscript}"): square.coeff_monomial(tau**n) / platform.slant_range**2
        for n in range(1, SLOW_TIME_ORDER + 1)
    }


@cache
def look_series(platform: PlatformSymbols) -> tuple[Matrix, ...]:
    """Derivatives of orders 0 to 4 of the line of sight u = r/|r| at τ = 0, each a vector of shape (3,). [1/sⁿ]

    They are expressed in terms of the coefficients of `growth`.
    """
    growth_sum = 1 + sum(d * tau**n for n, d in enumerate(growth(platform), start=1))
    inverse = [diff(1 / sqrt(growth_sum), tau, n).subs(tau, 0) / factorial(n) for n in range(SLOW_TIME_ORDER + 1)]
    track = (platform.position, platform.velocity, platform.acceleration / 2)
    series = []
    for n in range(SLOW_TIME_ORDER + 1):
        terms = (term * inverse[n - k] for k, term in enumerate(track) if k <= n)
        series.append(sum(terms, start=Matrix([0, 0, 0])) * factorial(n) / platform.slant_range)
    return tuple(series)


def range_error_at(platform: PlatformSymbols) -> Expr:
    """Range error −u·r̃(τ) of one platform at a slow time τ, to first order; u is the line of sight at τ. [m]"""
    first_order = dr.first_order_range_error(platform)
    return first_order.subs(platform.exact_slant_range(), platform.slant_range)


@cache
def range_error() -> tuple[Expr, ...]:
    """Coefficients β̃₀ … β̃₄ of the range error −Σ u(τ)·r̃(τ) + c·t̃(τ) as a polynomial in slow time. [m/sⁿ]

    They are expressed in terms of the derivatives of u at τ = 0.
    """
    total = c * dr.clock_polynomial()
    for platform in PLATFORM_SYMBOLS:
        look = sum(
            (derivative * tau**n / factorial(n) for n, derivative in enumerate(platform.look)),
            start=Matrix([0, 0, 0]),
        )
        total += range_error_at(platform).subs(dict(zip(platform.position, platform.slant_range * look, strict=True)))
    polynomial = Poly(expand(total), tau)
    return tuple(polynomial.coeff_monomial(tau**n) for n in range(SLOW_TIME_ORDER + 1))


def direct_range_error(platform: PlatformSymbols) -> Expr:
    """Range error of one platform if the direct path is used as the clock: −(u_t − b)·r̃_t or −(u_r + b)·r̃_r. [m]

    The error may be an arbitrary function of time; b is the unit vector from receiver to transmitter at that time.
    """
    (other_platform,) = (
        platform_symbols for platform_symbols in PLATFORM_SYMBOLS if platform_symbols is not platform
    )
    b = DIRECT_PATH if platform is TRANSMITTER else -DIRECT_PATH
    total = dr.direct_path_range_error().subs(dict.fromkeys(dr.error_track(other_platform), 0))
    return expand(total.subs(dict(zip(other_platform.position, platform.position - baseline * b, strict=True))))


def direct_sight(platform: PlatformSymbols) -> Matrix:
    """Vector that replaces the line of sight of a platform if the direct path is the clock: u_t − b or u_r + b.

    It has the shape (3,). Each component is the decrease of the range error per metre of the platform's position
    error along the respective axis. [-]
    """
    unit_sight = dict(zip(platform.position, platform.slant_range * platform.look[0], strict=True))
    return Matrix([-direct_range_error(platform).coeff(e).subs(unit_sight) for e in dr.error_track(platform)])


def ground_history() -> tuple[Matrix, ...]:
    """Derivatives of orders 0 to 4 at τ = 0 of the vector s (2,), the horizontal part of u_t + u_r. [1/sⁿ]

    The range of a ground point x relative to the scene centre is −s(τ)·x.
    """
    looks = zip(*(platform.look for platform in PLATFORM_SYMBOLS), strict=True)
    return tuple(Matrix([sum(u[axis] for u in looks_of_both) for axis in range(2)]) for looks_of_both in looks)


def gradient_inverse() -> tuple[tuple[Symbol, ...], Matrix, Expr]:
    """Symbols of the ground gradients, and the adjugate (2, 2) and determinant of Q = −[s; ṡ]. [-], [1/s]

    The symbols are s_x, s_y, ṡ_x and ṡ_y. Q maps a ground point to the constant and linear terms of its range.
    """
    s, rate = Matrix([real("s_x"), real("s_y")]), Matrix([real("sdot_x"), real("sdot_y")])
    Q = -Matrix([list(s), list(rate)])
    return (*s, *rate), Q.adjugate(), Q.det()


def amplitude_share(own: Expr, other: Expr) -> Expr:
    """Fraction of an allowable amplitude that is allotted to a platform if both platforms share the amplitude.

    `own` is the power share of this platform, and `other` is the power share of the second platform. The amplitudes
    are proportional to the square roots of the power shares.
    """
    platform_part = positive("a")
    (solution,) = solve(Eq(platform_part * sqrt(other), (1 - platform_part) * sqrt(own)), platform_part)
    return solution


def motion_of_phase(phase: Expr) -> Expr:
    """Motion of one platform along its line of sight that causes a given phase by changing the one-way path. [m]"""
    motion = positive("A")
    (solution,) = solve(Eq(published.one_way_phase(motion), phase), motion)
    return solution


def quartic_as_quadratic() -> Expr:
    """Coefficient of x² in the cubic polynomial that is fitted to x⁴ over −1 … 1: 6/7.

    It follows from the projection of x⁴ on the Legendre polynomial of order 2, because no other Legendre polynomial
    up to order 3 contains x².
    """
    x = real("x")
    second = legendre(2, x)
    return Poly(x**4 * second, x).integrate().eval((1,)) / Poly(second**2, x).integrate().eval((1,)) * Rational(3, 2)


def quadratic_phase(coefficients: Sequence[Expr]) -> Expr:
    """Quadratic phase at the aperture edge for a range error with the coefficients β₀ … β₄ in slow time. [rad]

    It is the quadratic phase of a cubic polynomial that is fitted to the range error over the aperture. The quartic
    term, with coefficient β₄, therefore also contributes.
    """
    quadratic, quartic = (published.edge_phase(coefficients[n], n) for n in (2, 4))
    return quadratic + quartic_as_quadratic() * quartic


def cubic_phase(coefficients: Sequence[Expr]) -> Expr:
    """Phase of the cubic term, with coefficient β₃, at the aperture edge. [rad]"""
    return published.edge_phase(coefficients[3], 3)


def displacement_coefficients() -> tuple[Expr, ...]:
    """Terms s⁽ⁿ⁾·x̂/n! [m/sⁿ] that a displacement x̂ of the image adds to the range-error coefficients β₀ … β₄.

    x̂ is the horizontal vector `DISPLACEMENT`. The vector s is the horizontal part of u_t + u_r, the sum of the unit
    vectors to both platforms, and s⁽ⁿ⁾ is its derivative of order n at mid-aperture.
    """
    return tuple(s.dot(DISPLACEMENT) / factorial(n) for n, s in enumerate(ground_history()))


def effective_coefficients() -> tuple[Expr, Expr, Expr]:
    """Coefficients β₂, β₃, β₄ of the range error at the displaced point: β̃ₙ + s⁽ⁿ⁾·x̂/n!. [m/sⁿ]"""
    beta, added = range_error(), displacement_coefficients()
    second, third, fourth = (beta[n] + added[n] for n in (2, 3, 4))
    return second, third, fourth


@cache
def table() -> FormulaTable:
    """Table of the first-order coefficients β̃₀ … β̃₄ of the range error, for the clock error and each motion error.

    The terms that result from the displacement of the image are not included.
    """
    return FormulaTable(
        number="Full model",
        title="Differential range errors with the line of sight turning as it does",
        columns=("Constant β̃₀", "Linear β̃₁", "Quadratic β̃₂", "Cubic β̃₃", "Quartic β̃₄"),
        rows=published.coefficient_rows(range_error(), is_numbered=False),
        notes=(
            "Derived here. u and its derivatives are those of the unit vector to the platform at τ = 0.",
            "With synchronization.method direct_path w_t, w_r stand for u_t, u_r, and there is no clock.",
            "A check does not stop at a power of τ: it fits exact ranges over the aperture (docs/full-model.md).",
        ),
    )


@cache
def equations() -> tuple[Equation, ...]:
    """Equations for the turn of the line of sight, the displacement, and the coefficients that defocus a response."""
    platform = PLATFORM_SYMBOLS[0]
    second, third, fourth = effective_coefficients()
    history = ground_history()
    determinant = history[0][0] * history[1][1] - history[0][1] * history[1][0]
    remaining = [real(f"beta_{n}") for n in range(SLOW_TIME_ORDER + 1)]
    fitted = quadratic_phase(remaining)
    constant, linear = real("beta_0tilde"), real("beta_1tilde")
    displacement = -Matrix(
        [history[1][1] * constant - history[0][1] * linear, history[0][0] * linear - history[1][0] * constant]
    )
    growth_equations = (
        Equation("", "Growth of the squared range", d, value) for d, value in growth(platform).items()
    )
    names = ("u", "udot", "uddot", "udddot", "uddddot")
    orders = ("first", "second", "third", "fourth")
    titles = ("Line of sight", *(f"Line of sight, {order} derivative" for order in orders))
    looks = zip(names, titles, look_series(platform), strict=True)
    return (
        *growth_equations,
        *(Equation("", title, Symbol(f"{name}_{platform.subscript}"), look) for name, title, look in looks),
        Equation("", "Displacement of the image, times the determinant", Symbol("detQ") * DISPLACEMENT, displacement),
        Equation("", "Determinant of Q", Symbol("detQ"), determinant),
        Equation("", "Quadratic coefficient at the displaced point", real("beta_2"), _collected(second)),
        Equation("", "Cubic coefficient at the displaced point", real("beta_3"), _collected(third)),
        Equation("", "Quartic coefficient at the displaced point", real("beta_4"), _collected(fourth)),
        Equation("", "Quadratic phase error, of the quadratic fitted over the aperture", real("phi_2"), fitted),
        Equation("", "Cubic phase at the aperture edge", real("phi_3"), cubic_phase(remaining)),
        *_of_the_direct_path(),
    )


def _of_the_direct_path() -> tuple[Equation, ...]:
    """Equations for the terms that replace u_t, u_r and t̃ if the receiver uses the direct path as its clock."""
    direction = (TRANSMITTER.position - RECEIVER.position) / baseline
    return (
        Equation("", "Direct path, from receiver to transmitter", Symbol("b"), direction),
        *(
            Equation(
                "",
                f"Direct path: in place of the {platform.name}'s line of sight",
                Symbol(f"w_{platform.subscript}"),
                direct_sight(platform),
            )
            for platform in PLATFORM_SYMBOLS
        ),
    )


def _collected(coefficient: Expr) -> Expr:
    """Write a coefficient as β̃ₙ plus the terms that result from the displacement; the function `table` gives β̃ₙ."""
    order = 2 + effective_coefficients().index(coefficient)
    return Add(real(f"beta_{order}tilde"), expand(coefficient - range_error()[order]), evaluate=False)


@cache
def vibration() -> FormulaTable:
    """Table of vibration limits from first principles: power beside the response, and allowable motion.

    The phase has a peak φ or an rms value σ. The paired echoes of a sinusoid have the amplitude J₁(φ)/J₀(φ) relative
    to the response, which is φ/2 to first order. With Gaussian noise, a fraction exp(-σ²) of the power stays in the
    response. A fraction E of this remaining power is between the first nulls of the response. The ISLR is therefore
    (exp(σ²) - 1)/E. If both platforms vibrate at the same frequency, they share the amplitude. If their noise is
    independent, they share the power.
    """
    amplitude, rms, phase, platform_part, energy = (positive(name) for name in ("A", "sigma", "phi", "a", "E"))
    first_order, zeroth_order = (series(besselj(n, phase), phase, 0, 2).removeO() for n in (1, 0))
    echo = first_order / zeroth_order
    (largest,) = solve(Eq(echo, sqrt(pslr)), phase)
    spread = (exp(phase**2) - 1) / energy
    (noise,) = (root for root in solve(Eq(spread, islr), phase) if root.is_nonnegative is not False)
    rows = (
        (amplitude, echo**2, motion_of_phase(largest), "one platform alone"),
        (amplitude, echo**2, platform_part * motion_of_phase(largest), "a part a of the amplitude of both, in phase"),
        (rms, spread, sqrt(share) * motion_of_phase(noise), "share s of the power of both, independent"),
    )
    return FormulaTable(
        number="Vibration, first principles",
        title="Amplitude A (0 to peak) and rms σ along the line of sight, φ = 2πA/λ",
        columns=("Power beside the response", "Allowable"),
        rows=tuple(
            TableRow(number=None, error=e, label=e, cells=(p, limit), note=note) for e, p, limit, note in rows
        ),
        notes=(
            "Derived here. The tool takes J₁(φ)/J₀(φ) as it is; a = √s_k/(√s_t + √s_r) of PSLR·(s_t + s_r).",
            "E: share of the error-free response's energy within its first nulls, 0.903 uniform, 0.998 Taylor.",
        ),
    )
