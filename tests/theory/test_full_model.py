"""The full model: against direct differentiation, where it reduces to the paper, and where it must not."""

import math

import numpy as np
import pytest
from sympy import Matrix, Rational, diff, simplify, sqrt

from bisar_budget import evaluators
from bisar_budget.theory import differential_range as dr
from bisar_budget.theory import full, published
from bisar_budget.theory.symbols import PLATFORMS, RECEIVER, TRANSMITTER, clock_coefficients, tau

ERRORS = [error for platform in PLATFORMS for error in published.motion_errors(platform)]


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
    emitted = evaluators.look_series(*map(float, (*p, *v, *a)), 25.0)[order]
    assert emitted == pytest.approx([float(x) for x in direct], rel=1e-14)


@pytest.mark.parametrize("order", range(4))
@pytest.mark.parametrize("error", ERRORS, ids=str)
def test_at_constant_range_the_coefficients_are_table_1(error, order: int) -> None:
    """With u for (r + vτ)/R, which is (17), every coefficient of every error is the printed one."""
    ours = full.at_constant_range(published.single_error(full.range_error()[order], error))
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
        for platform in PLATFORMS:
            for symbols, values in zip(platform.look, looks, strict=True):
                expression = expression.subs(dict(zip(symbols, values, strict=True)))
        return expression.subs(same).subs(broadside)

    clockless = dict.fromkeys(clock_coefficients, 0)
    beta = [put_in(term).subs(clockless) for term in full.range_error()]
    Q = full.ground_matrix().applyfunc(put_in)
    moved = Q.inv() * Matrix(beta[:2])
    second = put_in(full.effective_coefficients()[0]).subs(clockless)
    second = second.subs(dict(zip(full.DISPLACEMENT, moved, strict=True)))
    v, R = TRANSMITTER.velocity[1], TRANSMITTER.slant_range
    assert simplify(second + 2 * v * error / R) == 0


@pytest.mark.parametrize(("order", "axis", "factor"), [(2, 0, Rational(1, 2)), (3, 1, Rational(1, 6))])
def test_displacement_phases_are_quadratic_and_cubic_terms_at_the_edge(order, axis, factor) -> None:
    """One metre of displacement, s⁽ⁿ⁾ of 1: a range of τⁿ/n!."""
    phase = {2: full.quadratic_phase, 3: full.cubic_phase}[order](full.displacement_coefficients())
    per_metre = published.sensitivity(phase, full.DISPLACEMENT[axis])
    still = {symbol: 0 for platform in PLATFORMS for look in platform.look for symbol in look}
    one = still | {TRANSMITTER.look[order][axis]: 1}
    assert simplify(per_metre.subs(one) - published.edge_phase(factor, order)) == 0


def test_the_quadratic_phase_is_that_of_a_quadratic_fitted_over_the_aperture() -> None:
    """Of a quartic six sevenths, by least squares on a fine grid with a cubic beside it, which changes nothing."""
    x = np.linspace(-1, 1, 100_001)
    fitted = np.polynomial.polynomial.polyfit(x, x**4, 3)
    assert float(full.quartic_as_quadratic()) == pytest.approx(fitted[2], rel=1e-4)
    quartic = full.quadratic_phase([0, 0, 0, 0, Rational(1)])
    assert quartic == Rational(6, 7) * published.edge_phase(Rational(1), 4)


def test_curved_paths_turn_the_line_of_sight() -> None:
    """A platform on a circle about the scene centre keeps its range: u turns by v/R, ü points back by (v/R)²."""
    R, speed = 5000.0, 50.0
    looks = evaluators.look_series(R, 0.0, 0.0, 0.0, speed, 0.0, -(speed**2) / R, 0.0, 0.0, R)
    rate = speed / R
    assert looks[1] == pytest.approx((0.0, rate, 0.0))
    assert looks[2] == pytest.approx((-(rate**2), 0.0, 0.0))
    # Of constant acceleration, no true circle: the third derivative along y is that of the parabola.
    step = 1e-2
    position = [(R - speed**2 / R * t * t / 2, speed * t) for t in (-2 * step, -step, 0.0, step, 2 * step)]
    along = [y / math.hypot(x, y) for x, y in position]
    third = (along[4] - 2 * along[3] + 2 * along[1] - along[0]) / (2 * step**3)
    assert looks[3][1] == pytest.approx(third, rel=1e-3)
