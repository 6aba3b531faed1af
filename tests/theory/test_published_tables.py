"""The derivation gives what the paper prints, cell by cell, and the monostatic rules for one platform."""

import csv
import math
from pathlib import Path

import pytest
from sympy import Abs, Expr, Matrix, Rational, Symbol, atan2, cos, parse_expr, pi, simplify, sin, sqrt, symbols

from bisar_budget.resources import resource
from bisar_budget.theory import differential_range as dr
from bisar_budget.theory import published
from bisar_budget.theory.symbols import (
    PLATFORM_SYMBOLS,
    RECEIVER,
    TRANSMITTER,
    T,
    c,
    center_frequency,
    islr,
    n_pull,
    point,
    pslr,
    share,
    tau,
    total_qpe,
    wavelength,
)


def printed(name: str) -> list[dict[str, str]]:
    with Path(resource("specs", "published", f"{name}.csv")).open(encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def as_printed(cell: dict[str, str], subscript: str) -> Expr:
    """Read a transcribed cell; all symbols positive, since the paper omits the bars."""
    names = sorted({str(s) for s in parse_expr(cell["expression"].replace("lambda", "lambda_")).free_symbols})
    plain = {name: Symbol(name, positive=True) for name in names}
    expression = parse_expr(cell["expression"].replace("lambda", "lambda_"), local_dict=plain)
    renamed = {
        symbol: Symbol(name.replace("lambda_", "lambda")[:-1] + subscript, positive=True)
        if name.endswith("t") and "_" in name
        else Symbol(name.replace("lambda_", "lambda"), positive=True)
        for name, symbol in plain.items()
    }
    return expression.subs(renamed)


def positive(expression: Expr) -> Expr:
    return expression.subs({s: Symbol(s.name, positive=True) for s in expression.free_symbols})


COLUMNS = {"constant": 0, "linear": 1, "quadratic": 2, "cubic": 3, "QPE": 0, "allowable": 1}


@pytest.mark.parametrize("platform", PLATFORM_SYMBOLS, ids=lambda p: p.name)
@pytest.mark.parametrize("table", ["table_1", "table_2"])
def test_every_printed_cell_is_the_derived_one(table: str, platform) -> None:
    derived = {"table_1": published.table_1, "table_2": published.table_2}[table]()
    subscript = platform.subscript
    cells = printed(table)
    assert len(cells) == {"table_1": 40, "table_2": 12}[table]
    for cell in cells:
        rows = [
            row
            for row in derived.rows
            if row.number == int(cell["row"])
            and ((row.number == 1 and table == "table_1") or str(row.error)[-1] == subscript)
        ]
        assert len(rows) == 1, cell
        got = rows[0].cells[COLUMNS[cell["column"]]]
        want = as_printed(cell, subscript)
        # Bars drop where every symbol, and the sine or cosine of a printed angle, is taken positive.
        got = positive(got).replace(Abs, lambda inner: inner)
        assert simplify(got - want) == 0, cell


def test_table_1_has_the_clock_and_nine_rows_per_platform() -> None:
    numbers = [row.number for row in published.table_1().rows]
    assert numbers == [1, *range(2, 11), *range(2, 11)]


def test_printed_vibration_limits_are_the_derived_ones() -> None:
    lambda_ = Symbol("lambda", positive=True)
    for cell, row in zip(printed("vibration"), published.vibration().rows, strict=True):
        names = {"PSLR": pslr, "ISLR": islr, "lambda_": lambda_}
        want = parse_expr(cell["expression"].replace("lambda", "lambda_"), local_dict=names)
        assert simplify(row.cells[2].subs(wavelength, lambda_) - want) == 0


def test_vibration_limit_with_a_share_puts_the_share_under_the_root() -> None:
    (sinusoid, wideband) = published.vibration().rows
    assert simplify(sinusoid.cells[1] - wavelength / (2 * pi) * sqrt(pslr * share)) == 0
    assert simplify(wideband.cells[1] - wavelength / (2 * pi) * sqrt(islr * share)) == 0


def test_pull_in_factor_is_four_n_pull_for_the_total_of_pi_over_4() -> None:
    assert published.pull_in_factor().subs(total_qpe, pi / 4) == 4 * n_pull


def test_clock_quadratic_limit() -> None:
    clock = published.table_2().rows[-1]
    t2 = clock.error
    assert simplify(clock.cells[0] - pi * center_frequency * Abs(t2) * T**2 / 2) == 0
    # 2q/(π f₀ T²) at q = π/8
    assert simplify(clock.cells[1] - 2 * (pi / 8) / (pi * center_frequency * T**2)) == 0


def test_17_has_the_plus_that_the_print_lost() -> None:
    beta_0, beta_1 = dr.linear_differential_range()
    for index, x in enumerate(point):
        assert beta_0.coeff(x) == -sum(p.position[index] / p.slant_range for p in PLATFORM_SYMBOLS)
        assert beta_1.coeff(x) == -sum(p.velocity[index] / p.slant_range for p in PLATFORM_SYMBOLS)


def test_19_and_30_are_q_and_its_inverse() -> None:
    Q = dr.ground_matrix()
    adjugate, determinant = dr.ground_inverse()
    assert simplify(Q * adjugate / determinant - Matrix.eye(2)) == Matrix.zeros(2)
    v, r = [p.velocity for p in PLATFORM_SYMBOLS], [p.position for p in PLATFORM_SYMBOLS]
    R = [p.slant_range for p in PLATFORM_SYMBOLS]
    assert adjugate[0, 0] == -v[0][1] / R[0] - v[1][1] / R[1]
    assert adjugate[1, 1] == -r[0][0] / R[0] - r[1][0] / R[1]


def test_25_displaces_a_response_by_the_point_that_has_the_same_linear_history() -> None:
    x, y = symbols("x y", real=True)
    Q = dr.ground_matrix()
    adjugate, determinant = dr.ground_inverse()
    assert simplify(adjugate * Q * Matrix([x, y]) / determinant - Matrix([x, y])) == Matrix.zeros(2, 1)


def test_31_is_perpendicular_to_11() -> None:
    look, smear = dr.look_vector(), dr.smear_direction()
    assert simplify(look.dot(smear)) == 0


def test_11_keeps_the_quadrant_behind_the_scene() -> None:
    west = {p.azimuth: pi for p in PLATFORM_SYMBOLS} | {p.elevation: 0 for p in PLATFORM_SYMBOLS}
    azimuth = dr.look_azimuth()
    assert isinstance(azimuth, atan2)
    assert azimuth.subs(west) == pi  # the printed arctan gives 0


def test_6_is_5_in_angles() -> None:
    in_angles = dr.in_angles(dr.far_field_differential_range())
    p = TRANSMITTER
    assert simplify(in_angles.coeff(point[0]).coeff(cos(p.azimuth)) + cos(p.elevation)) == 0
    assert simplify(in_angles.coeff(point[2]) + sum(sin(p.elevation) for p in PLATFORM_SYMBOLS)) == 0


def test_transmitter_as_receiver_gives_the_two_way_monostatic_rules() -> None:
    """Same platform, same error: Carrara's two-way phase, 4π/λ times one leg's range error."""
    same = {}
    for mine, other in (
        (TRANSMITTER.position, RECEIVER.position),
        (TRANSMITTER.velocity, RECEIVER.velocity),
        (TRANSMITTER.position_error, RECEIVER.position_error),
        (TRANSMITTER.velocity_error, RECEIVER.velocity_error),
        (TRANSMITTER.acceleration_error, RECEIVER.acceleration_error),
    ):
        same |= dict(zip(other, mine, strict=True))
    for measure in ("slant_range", "azimuth", "elevation"):
        same[getattr(RECEIVER, measure)] = getattr(TRANSMITTER, measure)
    error = dr.range_error().subs(same)
    beta = dr.coefficients(error)
    x, v_x, R = TRANSMITTER.position[0], TRANSMITTER.velocity[0], TRANSMITTER.slant_range
    v, a = TRANSMITTER.velocity_error[0], TRANSMITTER.acceleration_error[0]
    from_velocity = published.edge_phase(published.single_error(beta[2], v), 2)
    from_acceleration = published.edge_phase(published.single_error(beta[2], a), 2)
    # Two-way: (4π/λ)·(ṽ v/R)·(T/2)² and (4π/λ)·(ã x/2R)·(T/2)², one-way limits halved.
    assert simplify(from_velocity + 4 * pi / wavelength * v * v_x / R * (T / 2) ** 2) == 0
    assert simplify(from_acceleration + 4 * pi / wavelength * a * x / (2 * R) * (T / 2) ** 2) == 0
    limit = published.limit(from_velocity, v, pi / 4)
    assert simplify(limit - wavelength * R / (4 * Abs(v_x) * T**2)) == 0  # π/4 two-way is π/8 a leg
    # The look vector is twice the platform's own.
    look = dr.look_vector().subs(same)
    assert simplify(look[0] - 2 * cos(TRANSMITTER.azimuth) * cos(TRANSMITTER.elevation)) == 0


def test_range_error_is_first_order_in_the_exact_ranges() -> None:
    """(23) against |r| - |r + e| at a point, with the ranges of print held at the midpoint."""
    p = TRANSMITTER
    numbers = dict(zip(p.position, (3.0e4, 2.0e3, 6.0e3), strict=True))
    numbers |= dict(zip(p.velocity, (0.0, 0.0, 0.0), strict=True))
    numbers[p.slant_range] = math.dist((3.0e4, 2.0e3, 6.0e3), (0, 0, 0))
    error = (0.3, -0.2, 0.1)
    numbers |= dict(zip(p.position_error, error, strict=True))
    numbers |= dict.fromkeys((*p.velocity_error, *p.acceleration_error, *published.motion_errors(RECEIVER)), 0.0)
    value = dr.range_error().subs(numbers).subs(c, 0)
    exact = math.dist((3.0e4, 2.0e3, 6.0e3), (0, 0, 0)) - math.dist(
        (3.0e4 + 0.3, 2.0e3 - 0.2, 6.0e3 + 0.1), (0, 0, 0)
    )
    assert float(value.subs(tau, 0)) == pytest.approx(exact, abs=0.3**2 / 3e4)  # second order: e²/R


def test_equal_share_is_half_the_total() -> None:
    assert Rational(1, 2) * (pi / 4) == published.EQUAL_SHARE_QPE_RAD
