"""Derivation of the polynomial in slow time from the exact bistatic ranges: (1) to (31) of Rigling & Moses.

Each function derives a numbered equation from an earlier equation. The frame and the units are described in
`symbols`.
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
    """Distance between two points, d(τ) of equation (1). [m]"""
    return sqrt(sum((r - x) ** 2 for r, x in zip(one, other, strict=True)))


def observed_differential_range(platforms: tuple[PlatformSymbols, ...] = PLATFORM_SYMBOLS) -> Expr:
    """Observed differential range ΔR̂_m of the scatterer m, as in equation (1). [m]

    It is the sum of the true distances from the platforms to the scatterer, minus the sum of the measured distances
    to the scene centre, plus the clock error c·t̃.
    """
    total = c * Function("ttilde")(tau)
    for platform in platforms:
        measured = platform.position + measured_error(platform)
        total += distance(platform.position, scatterer) - distance(measured, zeros(3, 1))
    return total


def measured_error(platform: PlatformSymbols) -> Matrix:
    """Error of the measured position of a platform at a slow time, r̃ of equation (1), with shape (3,). [m]"""
    return ImmutableMatrix([real(f"{axis}tilde_{platform.subscript}") for axis in AXES])


def direct_path_clock() -> Expr:
    """Clock error c·t̃ of equation (1) for a receiver that uses the direct path as its clock. [m]

    It is the measured minus the actual distance between the platforms: the clock of the receiver is the direct
    signal, which is delayed by the actual distance, and the processor corrects for the measured distance.
    """
    transmitter, receiver = (platform.position + measured_error(platform) for platform in PLATFORM_SYMBOLS)
    actual = distance(*(platform.position for platform in PLATFORM_SYMBOLS))
    return distance(transmitter, receiver) - actual


def exact_differential_range() -> Expr:
    """Differential range of a point (x, y, z) without errors: equation (1) with r̃ = 0 and t̃ = 0. [m]"""
    free = dict.fromkeys((e for platform in PLATFORM_SYMBOLS for e in measured_error(platform)), 0)
    exact = observed_differential_range().subs(Function("ttilde")(tau), 0).subs(free)
    return exact.subs(dict(zip(scatterer, point, strict=True)))


def far_field_differential_range() -> Expr:
    """Return equation (5): the first-order Taylor expansion of equation (1) about the scene centre. [m]"""
    exact = exact_differential_range()
    at_origin = dict.fromkeys(point, 0)
    return sum(x * diff(exact, x).subs(at_origin) for x in point)


def in_angles(expression: Expr) -> Expr:
    """Express positions by slant range, azimuth and elevation, as in equation (6)."""
    for platform in PLATFORM_SYMBOLS:
        R, phi, theta = platform.slant_range, platform.azimuth, platform.elevation
        spherical = (R * cos(phi) * cos(theta), R * sin(phi) * cos(theta), R * sin(theta))
        expression = expression.subs(dict(zip(platform.position, spherical, strict=True)))
    return simplify(expression)


@cache
def far_field_in_angles() -> Expr:
    """Return equation (6): the differential range of equation (5) in terms of azimuth and elevation. [m]"""
    return in_angles(far_field_differential_range())


def hold_range_constant(expression: Expr) -> Expr:
    """Apply the motion model of equation (17): replace |r_k| by the constant R_k, and r_k by r_k + v_k·τ.

    This is the main approximation of the paper: positions in numerators change with time, but ranges do not. The full
    model does not use it.
    """
    for platform in PLATFORM_SYMBOLS:
        expression = expression.subs(platform.exact_slant_range(), platform.slant_range)
        moving = platform.position + platform.velocity * tau
        expression = expression.subs(dict(zip(platform.position, moving, strict=True)))
    return expand(expression)


def linear_differential_range() -> tuple[Expr, Expr]:
    """Constant and linear coefficients β₀ [m] and β₁ [m/s] of the differential range, from equation (17).

    In the printed equation, the plus sign between the two brackets is missing.
    """
    beta_0, beta_1 = coefficients(hold_range_constant(far_field_differential_range()))[:2]
    return beta_0, beta_1


def coefficients(expression: Expr) -> tuple[Expr, ...]:
    """Return the four coefficients of a cubic polynomial in slow time, beginning with the constant."""
    polynomial = Poly(expand(expression), tau)
    if polynomial.degree() > 3:
        raise ValueError(f"degree {polynomial.degree()} in slow time, at most 3 expected")
    return tuple(expand(polynomial.coeff_monomial(tau**n)) for n in range(4))


def error_polynomial(platform: PlatformSymbols) -> Matrix:
    """Position error r̃(τ) = p̃ + ṽτ + ãτ²/2 of a platform, from equation (22), as a vector of shape (3,). [m]"""
    return platform.position_error + platform.velocity_error * tau + platform.acceleration_error * tau**2 / 2


def clock_polynomial() -> Expr:
    """Timing error between transmitter and receiver as a polynomial, t̃(τ) of Section IV. [s]"""
    return sum(coefficient * tau**n for n, coefficient in enumerate(clock_coefficients))


def first_order_range_error(platform: PlatformSymbols) -> Expr:
    """Range error |r| − |r + r̃| of one platform to first order in the error r̃ of equation (22): −r·r̃/|r|. [m]"""
    return _first_order(platform).subs(dict(zip(error_track(platform), error_polynomial(platform), strict=True)))


def error_track(platform: PlatformSymbols) -> Matrix:
    """Position error of a platform as a vector (3,) of general functions of slow time, such as x̃_t(τ). [m]"""
    return ImmutableMatrix([Function(f"{axis}tilde_{platform.subscript}")(tau) for axis in AXES])


def _first_order(platform: PlatformSymbols) -> Expr:
    """First-order effect of a platform's position error on equation (1), for a scatterer at the scene centre. [m]"""
    return _grown(observed_differential_range((platform,)).subs(dict.fromkeys(scatterer, 0)))


def _grown(expression: Expr) -> Expr:
    """Part of an expression that is of first order in the position errors of the platforms.

    In the result, the position errors are general functions of slow time, as in `error_track`.
    """
    for platform in PLATFORM_SYMBOLS:
        grown = zip(measured_error(platform), _EPSILON * error_track(platform), strict=True)
        expression = expression.subs(dict(grown))
    return diff(expression, _EPSILON).subs(_EPSILON, 0)


@cache
def direct_path_range_error() -> Expr:
    """First-order part of equation (1) for the scene centre if the receiver uses the direct path as its clock. [m]

    The errors may be arbitrary functions of time. The symbols R_t, R_r and D are the slant ranges and the distance
    between the platforms.
    """
    observed = observed_differential_range().subs(dict.fromkeys(scatterer, 0))
    total = _grown(observed.subs(c * Function("ttilde")(tau), direct_path_clock()))
    total = total.subs(distance(*(platform.position for platform in PLATFORM_SYMBOLS)), baseline)
    for platform in PLATFORM_SYMBOLS:
        total = total.subs(platform.exact_slant_range(), platform.slant_range)
    return expand(total)


@cache
def range_error_of_tracks() -> Expr:
    """Return equation (23): the error of the differential range for errors that are arbitrary functions of time. [m]

    The processor subtracts the measured distance |r + r̃|, but the data contain |r|, so equation (1) leaves |r| − |r
    + r̃| for each platform. The result is of first order in r̃, with the motion model of equation (17).
    """
    total = c * Function("ttilde")(tau)
    for platform in PLATFORM_SYMBOLS:
        total += hold_range_constant(_first_order(platform))
    return total


@cache
def range_error() -> Expr:
    """Return equation (23) with the error polynomials of equation (22) inserted: a cubic in slow time. [m]"""
    total = range_error_of_tracks().subs(Function("ttilde")(tau), clock_polynomial())
    for platform in PLATFORM_SYMBOLS:
        total = total.subs(dict(zip(error_track(platform), error_polynomial(platform), strict=True)))
    return expand(total)


def ground_matrix() -> Matrix:
    """Return the 2 × 2 matrix Q of equation (19), which maps a ground point (x, y) to (β₀, β₁). [-], [1/s]"""
    ground = Matrix(point[:2])
    return Matrix(linear_differential_range()).subs(point[2], 0).jacobian(ground)


def ground_inverse() -> tuple[Matrix, Expr]:
    """Adjugate (2, 2) and determinant of the matrix Q of equation (19); their quotient is Q⁻¹ of equation (30)."""
    Q = ground_matrix()
    return Q.adjugate(), Q[0, 0] * Q[1, 1] - Q[0, 1] * Q[1, 0]


@cache
def look_vector() -> Matrix:
    """Horizontal components of the sum of the unit vectors to the platforms, as a vector of shape (2,). [-]

    This is equation (8) without the factor f/2.
    """
    return ImmutableMatrix([-diff(far_field_in_angles(), x) for x in point[:2]])


def look_azimuth() -> Expr:
    """Bistatic look angle φ_b of equation (11). [rad]

    It is computed with atan2, because the arctan in the printed equation loses the quadrant.
    """
    s_x, s_y = look_vector()
    return atan2(s_y, s_x)


@cache
def smear_direction() -> Matrix:
    """Return equation (31): the direction along which quadratic errors smear a response, with shape (2,). [-]

    It is the direction of the second column of the inverse of the matrix Q of equation (19).
    """
    adjugate, _ = ground_inverse()
    return ImmutableMatrix(in_angles(adjugate[:, 1]))
