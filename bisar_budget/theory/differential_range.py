"""Derivation of the polynomial in slow time from the exact bistatic ranges: (1) to (31) of Rigling & Moses.

Each function derives one numbered equation from the one before it. For the frame and the units see `symbols`.
"""

from functools import cache

from sympy import (
    Expr,
    Function,
    ImmutableMatrix,
    Matrix,
    Poly,
    Symbol,
    atan2,
    cos,
    diff,
    expand,
    simplify,
    sin,
    sqrt,
    zeros,
)

from bisar_budget.theory.symbols import (
    AXES,
    PLATFORM_SYMBOLS,
    PlatformSymbols,
    baseline,
    c,
    clock_coefficients,
    point,
    real,
    scatterer,
    tau,
)

# Common factor of all errors, for the expansion to first order.
_EPSILON = Symbol("epsilon", real=True)


def distance(one: Matrix, other: Matrix) -> Expr:
    """Distance between two points, d(τ) of (1). [m]"""
    return sqrt(sum((r - x) ** 2 for r, x in zip(one, other, strict=True)))


def observed_differential_range(platforms: tuple[PlatformSymbols, ...] = PLATFORM_SYMBOLS) -> Expr:
    """Observed differential range ΔR̂_m of the scatterer m, by (1). [m]

    It is the sum of the true distances to a scatterer, minus the measured distances to the scene centre, plus the
    clock error c·t̃.
    """
    total = c * Function("ttilde")(tau)
    for platform in platforms:
        measured = platform.position + measured_error(platform)
        total += distance(platform.position, scatterer) - distance(measured, zeros(3, 1))
    return total


def measured_error(platform: PlatformSymbols) -> Matrix:
    """Error of a platform's measured position at one slow time, r̃ of (1), (3,). [m]"""
    return ImmutableMatrix([real(f"{axis}tilde_{platform.subscript}") for axis in AXES])


def direct_path_clock() -> Expr:
    """Clock error c·t̃ of (1) for a receiver that takes the direct path as its clock. [m]

    It is the measured minus the actual distance between the platforms. The receiver's clock is the direct signal,
    which is delayed by the actual distance. The processor subtracts the measured distance.
    """
    transmitter, receiver = (platform.position + measured_error(platform) for platform in PLATFORM_SYMBOLS)
    actual = distance(*(platform.position for platform in PLATFORM_SYMBOLS))
    return distance(transmitter, receiver) - actual


def exact_differential_range() -> Expr:
    """Differential range of a point (x, y, z) without errors: (1) with r̃ = 0 and t̃ = 0. [m]"""
    free = dict.fromkeys((e for platform in PLATFORM_SYMBOLS for e in measured_error(platform)), 0)
    exact = observed_differential_range().subs(Function("ttilde")(tau), 0).subs(free)
    return exact.subs(dict(zip(scatterer, point, strict=True)))


def far_field_differential_range() -> Expr:
    """Return (5): the first-order Taylor expansion of (1) about the scene centre. [m]"""
    exact = exact_differential_range()
    at_origin = dict.fromkeys(point, 0)
    return sum(x * diff(exact, x).subs(at_origin) for x in point)


def in_angles(expression: Expr) -> Expr:
    """Express positions by slant range, azimuth and elevation, as in (6)."""
    for platform in PLATFORM_SYMBOLS:
        R, phi, theta = platform.slant_range, platform.azimuth, platform.elevation
        spherical = (R * cos(phi) * cos(theta), R * sin(phi) * cos(theta), R * sin(theta))
        expression = expression.subs(dict(zip(platform.position, spherical, strict=True)))
    return simplify(expression)


@cache
def far_field_in_angles() -> Expr:
    """Return (6): the differential range (5) in terms of azimuth and elevation. [m]"""
    return in_angles(far_field_differential_range())


def hold_range_constant(expression: Expr) -> Expr:
    """Replace |r_k| by the constant R_k, and r_k by r_k + v_k·τ: the motion model of (17).

    This is the main approximation of the paper: positions in numerators change with time, ranges do not. The full
    model does not use it.
    """
    for platform in PLATFORM_SYMBOLS:
        expression = expression.subs(platform.exact_slant_range(), platform.slant_range)
        moving = platform.position + platform.velocity * tau
        expression = expression.subs(dict(zip(platform.position, moving, strict=True)))
    return expand(expression)


def linear_differential_range() -> tuple[Expr, Expr]:
    """Constant and linear coefficient β₀ and β₁ of the differential range, by (17). [m], [m/s]

    The plus sign between the two brackets is missing in the printed equation.
    """
    beta_0, beta_1 = coefficients(hold_range_constant(far_field_differential_range()))[:2]
    return beta_0, beta_1


def coefficients(expression: Expr) -> tuple[Expr, ...]:
    """Return the four coefficients of a cubic in slow time, the constant first."""
    polynomial = Poly(expand(expression), tau)
    if polynomial.degree() > 3:
        raise ValueError(f"degree {polynomial.degree()} in slow time, at most 3 expected")
    return tuple(expand(polynomial.coeff_monomial(tau**n)) for n in range(4))


def error_polynomial(platform: PlatformSymbols) -> Matrix:
    """Position error r̃(τ) of a platform by (22), (3,): p̃ + ṽτ + ãτ²/2. [m]"""
    return platform.position_error + platform.velocity_error * tau + platform.acceleration_error * tau**2 / 2


def clock_polynomial() -> Expr:
    """Timing error between transmitter and receiver as a polynomial, t̃(τ) of Section IV. [s]"""
    return sum(coefficient * tau**n for n, coefficient in enumerate(clock_coefficients))


def first_order_range_error(platform: PlatformSymbols) -> Expr:
    """Range error |r| − |r + r̃| of one platform, to first order in r̃ of (22): −r·r̃/|r|. [m]"""
    return _first_order(platform).subs(dict(zip(error_track(platform), error_polynomial(platform), strict=True)))


def error_track(platform: PlatformSymbols) -> Matrix:
    """Position error of a platform, (3,); its components are general functions of slow time, such as x̃_t(τ). [m]"""
    return ImmutableMatrix([Function(f"{axis}tilde_{platform.subscript}")(tau) for axis in AXES])


def _first_order(platform: PlatformSymbols) -> Expr:
    """Terms of one platform in (1) for a scatterer at the scene centre, to first order in its error. [m]"""
    return _grown(observed_differential_range((platform,)).subs(dict.fromkeys(scatterer, 0)))


def _grown(expression: Expr) -> Expr:
    """Part of an expression that is of first order in the position errors of both platforms.

    The position errors become general functions of slow time, as in `error_track`.
    """
    for platform in PLATFORM_SYMBOLS:
        grown = zip(measured_error(platform), _EPSILON * error_track(platform), strict=True)
        expression = expression.subs(dict(grown))
    return diff(expression, _EPSILON).subs(_EPSILON, 0)


@cache
def direct_path_range_error() -> Expr:
    """First-order part of (1) for the scene centre if the direct path is the clock. [m]

    The errors may have any form over time. The slant ranges and the distance between the platforms have the symbols
    R_t, R_r and D.
    """
    observed = observed_differential_range().subs(dict.fromkeys(scatterer, 0))
    total = _grown(observed.subs(c * Function("ttilde")(tau), direct_path_clock()))
    total = total.subs(distance(*(platform.position for platform in PLATFORM_SYMBOLS)), baseline)
    for platform in PLATFORM_SYMBOLS:
        total = total.subs(platform.exact_slant_range(), platform.slant_range)
    return expand(total)


@cache
def range_error_of_tracks() -> Expr:
    """Return (23): error of the differential range for errors of any form over time. [m]

    The processor subtracts the measured distance |r + r̃| and the data contain |r|, so (1) leaves |r| − |r + r̃| for
    each platform. The result is of first order in r̃, with the motion model of (17).
    """
    total = c * Function("ttilde")(tau)
    for platform in PLATFORM_SYMBOLS:
        total += hold_range_constant(_first_order(platform))
    return total


@cache
def range_error() -> Expr:
    """Return (23) with the error polynomials of (22) inserted: a cubic in slow time. [m]"""
    total = range_error_of_tracks().subs(Function("ttilde")(tau), clock_polynomial())
    for platform in PLATFORM_SYMBOLS:
        total = total.subs(dict(zip(error_track(platform), error_polynomial(platform), strict=True)))
    return expand(total)


def ground_matrix() -> Matrix:
    """Return Q of (19), (2, 2), the matrix that maps a ground point (x, y) to (β₀, β₁). [-], [1/s]"""
    ground = Matrix(point[:2])
    return Matrix(linear_differential_range()).subs(point[2], 0).jacobian(ground)


def ground_inverse() -> tuple[Matrix, Expr]:
    """Adjugate (2, 2) and determinant of Q. The inverse Q⁻¹ of (30) is their quotient."""
    Q = ground_matrix()
    return Q.adjugate(), Q[0, 0] * Q[1, 1] - Q[0, 1] * Q[1, 0]


@cache
def look_vector() -> Matrix:
    """Horizontal components of the sum of the unit vectors to the platforms, (2,): (8) without the factor f/2. [-]"""
    return ImmutableMatrix([-diff(far_field_in_angles(), x) for x in point[:2]])


def look_azimuth() -> Expr:
    """Bistatic look angle φ_b of (11), with atan2, because the printed arctan loses the quadrant. [rad]"""
    s_x, s_y = look_vector()
    return atan2(s_y, s_x)


@cache
def smear_direction() -> Matrix:
    """Return (31), (2,): direction of the second column of Q⁻¹, along which quadratic errors smear a response. [-]"""
    adjugate, _ = ground_inverse()
    return ImmutableMatrix(in_angles(adjugate[:, 1]))
