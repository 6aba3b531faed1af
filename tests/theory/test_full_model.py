"""The full model: against direct differentiation, where it reduces to the paper, and where it must not."""

import numpy as np
import pytest
from sympy import Matrix, Rational, diff, simplify, sqrt

from bisar_budget.effects.sources import exact_ranges
from bisar_budget.image_plane import nodes
from bisar_budget.mission.load import parse_mission
from bisar_budget.theory import differential_range as dr
from bisar_budget.theory import full, published
from bisar_budget.theory.symbols import PLATFORM_SYMBOLS, RECEIVER, TRANSMITTER, clock_coefficients, tau
from tests.conftest import mission_text

ERRORS = [error for platform in PLATFORM_SYMBOLS for error in published.motion_errors(platform)]


@pytest.mark.parametrize("order", range(5))
def test_the_series_of_the_line_of_sight_is_its_derivative(order: int) -> None:
    """u = r/|r| differentiated as it stands, on a climbing, turning path of whole numbers: exact rationals."""
    p, v, a = Matrix([12, -9, 20]), Matrix([3, 5, -2]), Matrix([1, -1, 4])  # |p| = 25
    track = p + v * tau + a * tau**2 / 2
    u = track / sqrt(track.dot(track))
    direct = u.applyfunc(lambda component: diff(component, tau, order).subs(tau, 0))
    growth = full.growth(TRANSMITTER)
    values = dict(
        zip(
            (*TRANSMITTER.position, *TRANSMITTER.velocity, *TRANSMITTER.acceleration, TRANSMITTER.slant_range),
            (*p, *v, *a, 25),
            strict=True,
        )
    )
    series = full.look_series(TRANSMITTER)[order].subs(growth).subs(values)
    assert simplify(series - direct) == Matrix([0, 0, 0])


@pytest.mark.parametrize("order", range(4))
@pytest.mark.parametrize("error", ERRORS, ids=str)
def test_at_constant_range_the_coefficients_are_table_1(error, order: int) -> None:
    """With u for (r + vτ)/R, which is (17), every coefficient of every error is the printed one."""
    ours = published.single_error(full.range_error()[order], error)
    for platform in PLATFORM_SYMBOLS:
        held = (platform.position / platform.slant_range, platform.velocity / platform.slant_range)
        for derivative, value in zip(
            platform.look, (*held, *[Matrix([0, 0, 0])] * (full.SLOW_TIME_ORDER - 1)), strict=True
        ):
            ours = ours.subs(dict(zip(derivative, value, strict=True)))
    printed = published.single_error(dr.coefficients(dr.range_error())[order], error)
    assert simplify(ours - printed) == 0


def test_without_squint_velocity_and_acceleration_rows_are_those_of_table_2() -> None:
    """v ⊥ r and no acceleration: u̇ = v/R, so β̃₂ of Table II, before the displacement; position rows are not zero."""
    growth = full.growth(TRANSMITTER)
    broadside = {TRANSMITTER.position[1]: 0, TRANSMITTER.velocity[0]: 0, TRANSMITTER.velocity[2]: 0}
    broadside |= dict.fromkeys(TRANSMITTER.acceleration, 0)
    looks = [u.subs(growth).subs(broadside) for u in full.look_series(TRANSMITTER)]
    beta = full.range_error()[2]
    for symbols, values in zip(TRANSMITTER.look, looks, strict=True):
        beta = beta.subs(dict(zip(symbols, values, strict=True)))
    printed = dr.coefficients(dr.range_error())[2]
    for kind in (TRANSMITTER.velocity_error, TRANSMITTER.acceleration_error):
        for error in kind:
            difference = published.single_error(beta, error) - published.single_error(printed, error).subs(broadside)
            assert simplify(difference) == 0
    assert published.single_error(beta, TRANSMITTER.position_error[0]) != 0


def test_an_error_that_moves_nothing_keeps_its_quadratic_term() -> None:
    """x̂ = 0: the effective coefficient is β̃₂ itself."""
    second, third, _ = full.effective_coefficients()
    nowhere = dict.fromkeys(full.DISPLACEMENT, 0)
    assert second.subs(nowhere) == full.range_error()[2]
    assert third.subs(nowhere) == full.range_error()[3]


def test_a_monostatic_radar_at_broadside_loses_no_phase_to_the_displacement_of_a_velocity_error() -> None:
    """Tx = Rx, v ⊥ r, level: what an error along the track adds by displacement is nothing, so Table II twice."""
    growth = full.growth(TRANSMITTER)
    same = dict(
        zip(
            (*RECEIVER.position, *RECEIVER.velocity, *RECEIVER.acceleration, RECEIVER.slant_range),
            (*TRANSMITTER.position, *TRANSMITTER.velocity, *TRANSMITTER.acceleration, TRANSMITTER.slant_range),
            strict=True,
        )
    )
    broadside = {TRANSMITTER.position[1]: 0, TRANSMITTER.velocity[0]: 0, TRANSMITTER.velocity[2]: 0}
    broadside |= dict.fromkeys(TRANSMITTER.acceleration, 0)
    looks = [u.subs(growth).subs(broadside) for u in full.look_series(TRANSMITTER)]
    error = TRANSMITTER.velocity_error[1]
    both = {RECEIVER.velocity_error[1]: error}
    alone = {e: 0 for e in ERRORS if e not in (error, RECEIVER.velocity_error[1])}

    def put_in(expression):
        expression = expression.subs(alone).subs(both)
        for platform in PLATFORM_SYMBOLS:
            for symbols, values in zip(platform.look, looks, strict=True):
                expression = expression.subs(dict(zip(symbols, values, strict=True)))
        return expression.subs(same).subs(broadside)

    clockless = dict.fromkeys(clock_coefficients, 0)
    beta = [put_in(term).subs(clockless) for term in full.range_error()]
    gradients, adjugate, determinant = full.gradient_inverse()
    s, rate, *_ = full.ground_history()
    known = dict(zip(gradients, map(put_in, (*s, *rate)), strict=True))
    moved = (adjugate * Matrix(beta[:2]) / determinant).subs(known)
    second = put_in(full.effective_coefficients()[0]).subs(clockless)
    second = second.subs(dict(zip(full.DISPLACEMENT, moved, strict=True)))
    v, R = TRANSMITTER.velocity[1], TRANSMITTER.slant_range
    assert simplify(second + 2 * v * error / R) == 0


@pytest.mark.parametrize(("order", "axis", "factor"), [(2, 0, Rational(1, 2)), (3, 1, Rational(1, 6))])
def test_displacement_phases_are_quadratic_and_cubic_terms_at_the_edge(order, axis, factor) -> None:
    """One metre of displacement, s⁽ⁿ⁾ of 1: a range of τⁿ/n!."""
    phase = {2: full.quadratic_phase, 3: full.cubic_phase}[order](full.displacement_coefficients())
    per_metre = published.sensitivity(phase, full.DISPLACEMENT[axis])
    still = {symbol: 0 for platform in PLATFORM_SYMBOLS for look in platform.look for symbol in look}
    one = still | {TRANSMITTER.look[order][axis]: 1}
    assert simplify(per_metre.subs(one) - published.edge_phase(factor, order)) == 0


def test_the_quadratic_phase_is_that_of_a_quadratic_fitted_over_the_aperture() -> None:
    """Of a quartic six sevenths, by least squares on a fine grid with a cubic beside it, which changes nothing."""
    x = np.linspace(-1, 1, 100_001)
    fitted = np.polynomial.polynomial.polyfit(x, x**4, 3)
    assert float(full.quartic_as_quadratic()) == pytest.approx(fitted[2], rel=1e-4)
    quartic = full.quadratic_phase([0, 0, 0, 0, Rational(1)])
    assert quartic == Rational(6, 7) * published.edge_phase(Rational(1), 4)


@pytest.mark.parametrize("count", [6, 10, 16, 32, 64])
def test_the_weights_fit_legendre_polynomials(count: int) -> None:
    """A polynomial of 2·count − 4 is fitted exactly: its value, slope, and edges by NumPy's own conversion."""
    places, rows = nodes(count).places, nodes(count).fit
    series = np.random.default_rng(count).normal(size=2 * count - 3)
    legendre = np.polynomial.legendre.poly2leg(series)[:4]
    fitted = [row @ np.polynomial.polynomial.polyval(places, series) for row in rows]
    assert fitted == pytest.approx(legendre * [1, 1, 1.5, 2.5], abs=1e-12)


def test_the_range_error_at_one_time_is_the_derivative_of_the_range() -> None:
    """−u·r̃(τ) as derived, against differences of |r + εe|."""
    place, time, step = np.array([1200.0, -900.0, 2000.0]), 0.7, 1e-3
    R = float(np.linalg.norm(place))
    there = dict(zip((*TRANSMITTER.position, TRANSMITTER.slant_range, tau), (*place, R, time), strict=True))
    found = full.range_error_at(TRANSMITTER).subs(there)
    kinds = (TRANSMITTER.position_error, TRANSMITTER.velocity_error, TRANSMITTER.acceleration_error)
    for power, of_kind in zip((1.0, time, time**2 / 2), kinds, strict=True):
        for axis, error in enumerate(of_kind):
            e = np.eye(3)[axis] * step
            slope = (np.linalg.norm(place - e) - np.linalg.norm(place + e)) / (2 * step)
            assert float(published.sensitivity(found, error)) == pytest.approx(power * slope, rel=1e-7)


def test_the_series_of_the_table_is_what_the_nodes_give_over_a_short_aperture() -> None:
    """β̃₀ … β̃₃ of the derived table, put into numbers by SymPy, against the fit over an aperture of 0.2 s."""
    mission = parse_mission(mission_text(collection__aperture_time="0.2 s"))
    exact = exact_ranges(mission, mission.geometry)
    times = exact.times[:, 0]
    state = mission.geometry.transmitter
    values = dict(
        zip(
            (*TRANSMITTER.position, *TRANSMITTER.velocity, *TRANSMITTER.acceleration, TRANSMITTER.slant_range),
            (*state.position, *state.velocity, *state.acceleration, state.slant_range),
            strict=True,
        )
    )
    growth = full.growth(TRANSMITTER)
    looks = [u.subs(growth).subs(values) for u in full.look_series(TRANSMITTER)]
    for number, error in enumerate(published.motion_errors(TRANSMITTER)):
        axis, kind = divmod(number, 3)
        beta = [published.single_error(term, error).subs(error, 1) for term in full.range_error()]
        for symbols, numbers in zip(TRANSMITTER.look, looks, strict=True):
            beta = [term.subs(dict(zip(symbols, numbers, strict=True))) for term in beta]
        east, north, up = np.eye(3)[axis]
        at_nodes = (exact.along(0, (east, north, up)) * exact.powers[kind])[:, 0]
        series = np.polynomial.polynomial.polyval(times, [float(b) for b in beta])
        assert at_nodes == pytest.approx(series, abs=1e-9 * max(1.0, np.abs(series).max()))
