"""Equations (1) to (31) in numbers, each against a computation of its own that knows nothing of the derivation."""

import math
from functools import cache

import numpy as np
import pytest
from sympy import Expr, Function, Matrix, Symbol
from sympy.core.function import AppliedUndef

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.geometry import BistaticGeometry, PlatformState
from bisar_budget.simulator.far_field import far_field_filter
from bisar_budget.simulator.image_formation import matched_filter
from bisar_budget.simulator.phase_history import PathError, PhaseHistory, path, phase_history
from bisar_budget.theory import differential_range as dr
from bisar_budget.theory import published as paper
from bisar_budget.theory.symbols import PLATFORM_SYMBOLS, c, clock_coefficients, point, scatterer, tau

# Neither broadside nor level, azimuths in different quadrants, so that no term is zero by chance.
GEOMETRY = BistaticGeometry(
    transmitter=PlatformState(position=(24e3, -9e3, 5e3), velocity=(60.0, 130.0, 4.0)),
    receiver=PlatformState(position=(-2e3, 7e3, 2e3), velocity=(-50.0, 20.0, -3.0)),
)
STATES = (GEOMETRY.transmitter, GEOMETRY.receiver)
ERRORS = (
    PathError(position=(1.0, -2.0, 0.5), velocity=(0.02, 0.03, -0.01), acceleration=(0.004, -0.003, 0.002)),
    PathError(position=(-0.4, 0.7, 1.1), velocity=(-0.01, 0.04, 0.02), acceleration=(0.001, 0.005, -0.002)),
)
CLOCK = (2e-9, 1e-11, 3e-12, -4e-13)  # s, 1, 1/s, 1/s²
FREQUENCY = 9.7e9 + np.array([0.0, 1e8, 2e8, 3e8])
SLOW_TIME = np.array([-2.0, 0.5, 1.0])
SCATTERERS = np.array([[30.0, -20.0, 0.0], [-5.0, 12.0, 0.0]])
REFLECTIVITY = np.array([1.0 + 0.5j, -0.3j])


@cache
def right(number: int, part: int = 0) -> Expr:
    """Right side of an equation, or of one of its parts."""
    return [e.right for e in paper.equations() if e.number == f"({number})"][part]


def platforms_in_numbers(time: float = 0.0) -> dict[Expr, float]:
    """Symbols of both platforms: where they are then, speeds and mid-aperture ranges."""
    values = {}
    for symbols, state in zip(PLATFORM_SYMBOLS, STATES, strict=True):
        position, velocity = state.at(time)
        values |= dict(zip((*symbols.position, *symbols.velocity), (*position, *velocity), strict=True))
        values[symbols.slant_range] = state.slant_range
        values[symbols.azimuth], values[symbols.elevation] = state.azimuth, state.elevation
    return values


def errors_in_numbers() -> dict[Expr, float]:
    values = dict(zip(clock_coefficients, CLOCK, strict=True))
    for symbols, error in zip(PLATFORM_SYMBOLS, ERRORS, strict=True):
        for names, numbers in (
            (symbols.position_error, error.position),
            (symbols.velocity_error, error.velocity),
            (symbols.acceleration_error, error.acceleration),
        ):
            values |= dict(zip(names, numbers, strict=True))
    return values


def value(expression: Expr, numbers: dict[Expr, float]) -> complex:
    """Put numbers into an expression and leave nothing without one."""
    got = expression.subs(numbers)
    assert not got.free_symbols, got.free_symbols
    return complex(got.evalf())


def flown(time: float, index: int) -> tuple[np.ndarray, np.ndarray]:
    """True position of a platform at a time, and the error of the measured one."""
    p, error = STATES[index], ERRORS[index]
    r = np.array(p.position) + np.array(p.velocity) * time
    return r, np.array(error.position) + np.array(error.velocity) * time + np.array(error.acceleration) * time**2 / 2


def clock(time: float) -> float:
    return sum(t * time**n for n, t in enumerate(CLOCK))


def exact_observed_range(place: np.ndarray, time: float) -> float:
    """True ranges to a point less measured ones to the scene centre. [m]"""
    total = SPEED_OF_LIGHT_MPS * clock(time)
    for index in range(2):
        r, error = flown(time, index)
        total += np.linalg.norm(r - place) - np.linalg.norm(r + error)
    return float(total)


def history() -> PhaseHistory:
    """Record the scatterers with the simulator, without any error."""
    paths = [path(state, SLOW_TIME) for state in STATES]
    return phase_history(
        SCATTERERS, REFLECTIVITY, slow_time=SLOW_TIME, frequency=FREQUENCY, transmitter=paths[0], receiver=paths[1]
    )


def summed(expression: Expr, functions: dict[str, object]) -> complex:
    """Do the sums over frequencies and pulses, calling Python for each named function of them."""
    counts = {paper.frequencies: FREQUENCY.size, paper.pulses: SLOW_TIME.size}
    samples = {paper.frequency[n + 1]: f for n, f in enumerate(FREQUENCY)}
    samples |= {paper.slow_time[n + 1]: t for n, t in enumerate(SLOW_TIME)}
    done = expression.subs(counts).doit().subs(samples)
    calls = done.atoms(AppliedUndef)
    assert len(calls) >= FREQUENCY.size * SLOW_TIME.size
    known = {call: functions[call.func.__name__](*map(float, call.args)) for call in calls}
    return complex(done.subs(known).subs(c, SPEED_OF_LIGHT_MPS).evalf())


def sample(f: float, time: float) -> complex:
    recorded = history().samples
    return complex(recorded[np.argmin(abs(SLOW_TIME - time)), np.argmin(abs(FREQUENCY - f))])


def looks(time: float) -> np.ndarray:
    """Sum of the unit vectors to both platforms. (3,)"""
    return sum(r / np.linalg.norm(r) for r in (flown(time, index)[0] for index in range(2)))


def test_every_number_from_1_to_31_is_there_in_order_and_says_where_it_comes_from() -> None:
    numbered = [e for e in paper.equations() if e.number.startswith("(")]
    numbers = [int(e.number.strip("()")) for e in numbered]
    assert numbers == sorted(numbers)
    assert set(numbers) == set(range(1, 32))
    assert {e.origin for e in numbered} == {"defined", "derived"}
    assert {e.number for e in numbered if e.slip} == {"(11)", "(13)", "(15)", "(16)", "(17)", "(26)"}


def test_1_is_the_exact_differential_range_that_is_observed() -> None:
    time, place = 1.5, SCATTERERS[0]
    numbers = dict(zip(scatterer, place, strict=True)) | {c: SPEED_OF_LIGHT_MPS}
    for index, symbols in enumerate(PLATFORM_SYMBOLS):
        r, error = flown(time, index)
        numbers |= dict(zip((*symbols.position, *dr.measured_error(symbols)), (*r, *error), strict=True))
    observed = right(1, 1).subs(Function("ttilde")(tau), clock(time))
    # Rounding of ranges of 30 km.
    assert value(observed, numbers).real == pytest.approx(exact_observed_range(place, time), abs=1e-10)
    assert right(1, 0) == Function("DeltaRhat_m")(tau) / c


def test_2_and_3_are_the_samples_that_the_simulator_records() -> None:
    """With errors and a clock: the exponent of (3) is (2), its range (1)."""
    paths = [path(state, SLOW_TIME, error) for state, error in zip(STATES, ERRORS, strict=True)]
    recorded = phase_history(
        SCATTERERS,
        REFLECTIVITY,
        slow_time=SLOW_TIME,
        frequency=FREQUENCY,
        transmitter=paths[0],
        receiver=paths[1],
        clock_error=np.array([clock(t) for t in SLOW_TIME]),
    )
    for k, time in enumerate(SLOW_TIME):
        for i, f in enumerate(FREQUENCY):
            put_in = {paper.f_i: f, c: SPEED_OF_LIGHT_MPS}
            phases = [
                value(right(2).subs(Function("DeltaRhat_m")(paper.tau_k), exact_observed_range(place, time)), put_in)
                for place in SCATTERERS
            ]
            received = 0j
            for phase, reflectivity in zip(phases, REFLECTIVITY, strict=True):  # the sum over m, done by hand
                term = right(3).subs(Function("w")(paper.f_i, paper.tau_k), 0).subs(paper.scatterers, 1).doit()
                term = term.subs(Function("Phi_m")(paper.f_i, paper.tau_k), phase)
                received += value(term, {paper.reflectivity[1]: reflectivity})
            # 2πf/c times the rounding of a range of 30 km.
            assert recorded.samples[k, i] == pytest.approx(received, abs=1e-8)


def test_4_is_the_mean_over_samples_turned_back_by_the_phase_of_a_pixel() -> None:
    place = np.array([28.0, -19.0, 0.0])

    def tested(f: float, time: float) -> float:
        exact = sum(np.linalg.norm(r - place) - np.linalg.norm(r) for r in (flown(time, n)[0] for n in range(2)))
        return -2 * math.pi * f * exact / SPEED_OF_LIGHT_MPS

    image = summed(right(4), {"S": sample, "Phi_xyz": tested})
    assert image == pytest.approx(complex(matched_filter(history(), place)), abs=1e-7)


def test_5_and_6_are_the_exact_range_up_to_the_curvature_of_the_wave() -> None:
    place = np.array([3.0, -2.0, 1.0])
    numbers = platforms_in_numbers() | dict(zip(point, place, strict=True))
    exact = sum(math.dist(s.position, place) - s.slant_range for s in STATES)
    first_order = value(right(5), numbers).real
    curved = sum(place @ place / (2 * s.slant_range) for s in STATES)
    assert first_order == pytest.approx(exact, abs=curved)
    angles = {}
    for symbols, state in zip(PLATFORM_SYMBOLS, STATES, strict=True):
        angles[Function(f"phi_{symbols.subscript}")(paper.tau_k)] = state.azimuth
        angles[Function(f"theta_{symbols.subscript}")(paper.tau_k)] = state.elevation
    assert value(right(6).subs(angles), numbers).real == pytest.approx(first_order, rel=1e-12)


def test_8_is_half_the_frequency_along_the_sum_of_the_looks() -> None:
    time, f = float(SLOW_TIME[0]), 9.8e9
    angles = {}
    for index, symbols in enumerate(PLATFORM_SYMBOLS):
        x, y, z = flown(time, index)[0]
        angles[Function(f"phi_{symbols.subscript}")(paper.tau_k)] = math.atan2(y, x)
        angles[Function(f"theta_{symbols.subscript}")(paper.tau_k)] = math.atan2(z, math.hypot(x, y))
    for axis in range(3):
        got = value(right(8, axis).subs(angles), {paper.f_i: f}).real
        assert got == pytest.approx(f / 2 * looks(time)[axis], rel=1e-12)


@pytest.mark.parametrize("number", [7, 12])
def test_7_and_12_are_the_image_of_the_far_field_filter(number: int) -> None:
    """(12) turns coordinates and frequencies by (9), (10) and must give the same pixel as (7)."""
    place, turn = np.array([28.0, -19.0, 0.0]), GEOMETRY.look_azimuth

    def along(axis: int):
        return lambda f, time: f / 2 * looks(time)[axis]

    turned = {Symbol("phi_b", real=True): turn}
    f_x, f_y = Symbol("f_x", real=True), Symbol("f_y", real=True)

    def projected(part: int):
        return lambda f, time: (
            value(right(9, part).subs(turned), {f_x: f / 2 * looks(time)[0], f_y: f / 2 * looks(time)[1]}).real
        )

    functions = {"S": sample, "f_x": along(0), "f_y": along(1), "f_z": along(2)}
    functions |= {"fprime_x": projected(0), "fprime_y": projected(1)}
    pixel = dict(zip(point, place, strict=True))
    pixel |= {
        symbol: value(right(10, part).subs(turned), pixel).real
        for part, symbol in enumerate((paper.x_turned, paper.y_turned))
    }
    image = summed(right(number).subs(pixel), functions)
    want = complex(far_field_filter(history(), place, "direct"))
    assert image == pytest.approx(want, abs=1e-9)  # 4π/c·x·f of 1e4 rad, rounded


def test_9_and_10_turn_the_look_direction_onto_the_first_axis_and_keep_products() -> None:
    symbols = [Symbol(name, real=True) for name in ("x", "y", "f_x", "f_y")]
    numbers = dict(zip(symbols, (3.0, -4.0, 2.0, 7.0), strict=True)) | {Symbol("phi_b", real=True): 0.7}
    place, band = ([value(right(n, part), numbers).real for part in range(2)] for n in (10, 9))
    assert np.dot(place, band) == pytest.approx(3 * 2 - 4 * 7)
    ahead = dict(zip(symbols[:2], (math.cos(0.7), math.sin(0.7)), strict=True)) | {Symbol("phi_b", real=True): 0.7}
    assert [value(right(10, part), ahead).real for part in range(2)] == pytest.approx([1, 0])


def test_11_is_the_azimuth_of_the_sum_of_the_looks() -> None:
    s_x, s_y, _ = looks(0.0)
    assert value(right(11), platforms_in_numbers()).real == pytest.approx(math.atan2(s_y, s_x))


GRID = {paper.f_0: 1.8e10, paper.B_x: 5e8, paper.B_y: 3e8, paper.N_x: 5, paper.N_y: 4, c: SPEED_OF_LIGHT_MPS}
TURNED = np.array([[0.11, -0.2], [0.5, 0.37]])  # x′, y′ of two scatterers [m]


def band(axis: int) -> np.ndarray:
    """The samples of one axis of the grid, by NumPy."""
    first, width, count = ((1.8e10, 5e8, 5), (-1.5e8, 3e8, 4))[axis]
    return first + width / count * np.arange(count)


def test_13_is_an_even_grid_from_the_lower_edge() -> None:
    for axis, (index, count) in enumerate(((paper.k_x, 5), (paper.k_y, 4))):
        got = [value(right(13, axis), GRID | {index: n}).real for n in range(count)]
        assert got == pytest.approx(band(axis))


def samples_on_grid() -> np.ndarray:
    """Phase history (3) of plane waves on the grid: exp(−2πj·f·ΔR/c), ΔR of (6) in rotated coordinates."""
    total = np.zeros((5, 4), dtype=complex)
    for (x, y), reflectivity in zip(TURNED, REFLECTIVITY, strict=True):
        far = -2 * (x * band(0)[:, None] + y * band(1))  # f·ΔR: two legs
        total += reflectivity * np.exp(-2j * math.pi * far / SPEED_OF_LIGHT_MPS)
    return total


def of_scatterers(expression: Expr) -> Expr:
    names = {paper.reflectivity[n + 1]: a for n, a in enumerate(REFLECTIVITY)}
    names |= {paper.x_of[n + 1]: x for n, (x, _) in enumerate(TURNED)}
    names |= {paper.y_of[n + 1]: y for n, (_, y) in enumerate(TURNED)}
    return expression.subs(paper.scatterers, len(TURNED)).doit().subs(names)


def test_15_is_the_phase_history_of_plane_waves_and_its_print_is_not() -> None:
    want, got = samples_on_grid(), of_scatterers(right(15)).subs(GRID)
    for k_x, k_y in np.ndindex(5, 4):
        assert value(got, {paper.k_x: int(k_x), paper.k_y: int(k_y)}) == pytest.approx(want[k_x, k_y], abs=1e-9)
    # The print has x′_m·f₀ + B_x·k_x/N_x, whose second part is no phase: 1e8 Hz without metres.
    printed = sum(
        a * np.exp(4j * math.pi / SPEED_OF_LIGHT_MPS * (x * 1.8e10 + 5e8 / 5 + y * -1.5e8))
        for a, (x, y) in zip(REFLECTIVITY, TURNED, strict=True)
    )
    assert abs(printed - want[1, 0]) > 0.1


def polar_image(x: float, y: float) -> complex:
    """The double sum of (14) by NumPy, of the samples above."""
    turn = 4j * math.pi / SPEED_OF_LIGHT_MPS
    return complex(np.mean(samples_on_grid() * np.exp(-turn * x * band(0))[:, None] * np.exp(-turn * y * band(1))))


PIXEL = {paper.x_turned: 0.32, paper.y_turned: -0.06}


def test_14_is_the_mean_over_the_grid() -> None:
    done = right(14).subs({paper.N_x: 5, paper.N_y: 4}).doit().subs(GRID).subs(PIXEL)
    samples = samples_on_grid()
    known = {call: complex(samples[tuple(map(int, call.args))]) for call in done.atoms(AppliedUndef)}
    assert len(known) == 20
    assert complex(done.subs(known).evalf()) == pytest.approx(polar_image(0.32, -0.06), abs=1e-9)


def test_16_is_14_of_15_and_its_print_has_neither_the_scale_nor_the_sign() -> None:
    got = of_scatterers(right(16)).subs(GRID).subs(PIXEL)
    want = polar_image(0.32, -0.06)
    assert complex(got.evalf()) == pytest.approx(want, abs=1e-9)
    printed = 0j  # as printed: +j in the phase, no 1/(N_x·N_y)
    for (x, y), reflectivity in zip(TURNED, REFLECTIVITY, strict=True):
        dx, dy, k = 0.32 - x, -0.06 - y, 2 * math.pi / SPEED_OF_LIGHT_MPS
        turn = np.exp(1j * k * (dx * (2 * 1.8e10 + 5e8 - 1e8) - dy * 3e8 / 4))
        kernels = [math.sin(k * d * b) / math.sin(k * d * b / n) for d, b, n in ((dx, 5e8, 5), (dy, 3e8, 4))]
        printed += reflectivity * turn * kernels[0] * kernels[1]
    assert abs(printed / 20 - want) > 0.1
    assert abs(printed - want) > 0.1


def test_16_peaks_at_the_scatterer_with_its_reflectivity() -> None:
    """The factor 1/(N_x·N_y) makes the response of one scatterer A_m at its place."""
    alone = right(16).subs(paper.scatterers, 1).doit().subs(GRID)
    alone = alone.subs({paper.x_of[1]: 0, paper.y_of[1]: 0, paper.reflectivity[1]: 0.8})
    near = complex(alone.subs({paper.x_turned: 1e-6, paper.y_turned: 1e-6}).evalf())
    assert abs(near) == pytest.approx(0.8, abs=1e-6)


def held_range(place: np.ndarray, time: float) -> float:
    """Differential range of plane waves whose sources move past at constant range: what (17) says. [m]"""
    return -sum(place @ flown(time, index)[0] / STATES[index].slant_range for index in range(2))


def test_17_and_18_are_the_range_of_a_point_while_ranges_are_held() -> None:
    place = np.array([40.0, -70.0, 8.0])
    numbers = platforms_in_numbers() | dict(zip(point, place, strict=True))
    beta = [value(right(17, part), numbers).real for part in (1, 2)]
    for time in (-3.0, 0.0, 2.0):
        assert beta[0] + beta[1] * time == pytest.approx(held_range(place, time), rel=1e-12)
    by_matrix = Matrix(right(18).doit()).subs(numbers)
    assert [float(one) for one in by_matrix] == pytest.approx(beta, rel=1e-12)


def test_19_and_20_find_a_ground_point_from_its_range_and_rate() -> None:
    place = np.array([40.0, -70.0, 0.0])
    Q = right(19).subs(platforms_in_numbers())
    rate = (held_range(place, 1.0) - held_range(place, -1.0)) / 2
    beta = {Symbol("beta_0", real=True): held_range(place, 0.0), Symbol("beta_1", real=True): rate}
    found = right(20).subs(beta).subs(dict.fromkeys(right(20).atoms(type(paper.MatrixSymbol("Q", 2, 2))), Q)).doit()
    assert [float(one) for one in found] == pytest.approx([40.0, -70.0], rel=1e-9)


def test_21_and_22_are_the_error_that_the_simulator_flies() -> None:
    """The slow part is (22); what (21) adds to it is what is faster."""
    slow, fast = (Function(f"{letter}tilde_t")(tau) for letter in "gh")
    assert right(21) == slow + fast
    one = path(STATES[0], SLOW_TIME, ERRORS[0])
    for k, time in enumerate(SLOW_TIME):
        got = [float(e) for e in right(22).subs(errors_in_numbers()).subs(tau, time)]
        assert got == pytest.approx(one.measured[k] - one.actual[k], abs=1e-11)  # positions of 24 km, rounded


def test_23_is_the_error_to_first_order_while_ranges_are_held() -> None:
    """−Σ r̃·r(τ)/R + c·t̃ in numbers, and at mid-aperture, where nothing is held, the exact one."""
    numbers = platforms_in_numbers() | errors_in_numbers() | {c: SPEED_OF_LIGHT_MPS}
    for time in (-3.0, 0.0, 2.5):
        want = SPEED_OF_LIGHT_MPS * clock(time)
        for index in range(2):
            r, error = flown(time, index)
            want -= error @ r / STATES[index].slant_range
        assert value(right(23, 1), numbers | {tau: time}).real == pytest.approx(want, rel=1e-12)
        tracks = {Function("ttilde")(tau): clock(time)}
        for index, symbols in enumerate(PLATFORM_SYMBOLS):
            tracks |= dict(zip(dr.error_track(symbols), flown(time, index)[1], strict=True))
        assert value(right(23).subs(tracks), numbers | {tau: time}).real == pytest.approx(want, rel=1e-12)
    at_middle = value(right(23, 1), numbers | {tau: 0.0}).real
    second = sum(np.dot(e.position, e.position) / s.slant_range for e, s in zip(ERRORS, STATES, strict=True))
    assert at_middle == pytest.approx(exact_observed_range(np.zeros(3), 0.0), abs=second)


def polynomial(numbers: dict[Expr, float]) -> dict[Expr, float]:
    """β̃₀ … β̃₃ of (23), in numbers."""
    put_in = platforms_in_numbers() | errors_in_numbers() | {c: SPEED_OF_LIGHT_MPS}
    terms = dr.coefficients(right(23, 1))
    return {Symbol(f"beta_{n}tilde", real=True): value(t, put_in).real for n, t in enumerate(terms)} | numbers


def test_24_is_the_range_of_a_point_and_the_error_together() -> None:
    place, time = np.array([40.0, -70.0, 0.0]), 2.5
    at_point = platforms_in_numbers() | dict(zip(point, place, strict=True))
    beta = {Symbol(f"beta_{n}", real=True): value(right(17, n + 1), at_point).real for n in range(2)}
    error = value(
        right(23, 1), platforms_in_numbers() | errors_in_numbers() | {c: SPEED_OF_LIGHT_MPS, tau: time}
    ).real
    got = value(right(24), polynomial(beta) | {tau: time}).real
    assert got == pytest.approx(held_range(place, time) + error, rel=1e-12)


def test_25_moves_a_response_to_the_point_that_has_its_range_and_rate() -> None:
    numbers = polynomial(platforms_in_numbers())
    scaled, determinant = right(25).subs(numbers), value(right(30), platforms_in_numbers()).real
    moved = np.array([float(one) / determinant for one in scaled])
    place = np.array([*moved, 0.0])
    assert held_range(place, 0.0) == pytest.approx(numbers[Symbol("beta_0tilde", real=True)], rel=1e-9)
    rate = (held_range(place, 1.0) - held_range(place, -1.0)) / 2
    assert rate == pytest.approx(numbers[Symbol("beta_1tilde", real=True)], rel=1e-9)


def test_26_to_28_touch_the_range_error_at_the_middle_of_a_piece_and_the_print_does_not() -> None:
    """A tangent leaves |β̃₂|(δ/2)² at the ends of a piece, and the cubic's part; with τ for τ − τ_i metres remain."""
    numbers, centre, width = polynomial({}), 2.0, 2.0
    numbers[paper.tau_i] = centre
    piece = {symbol: value(right(n), numbers).real for n, symbol in zip((27, 28), paper.piece, strict=True)}
    put_in = platforms_in_numbers() | errors_in_numbers() | {c: SPEED_OF_LIGHT_MPS}
    bend = [abs(numbers[Symbol(f"beta_{n}tilde", real=True)]) for n in (2, 3)]
    bound = bend[0] * (width / 2) ** 2 + bend[1] * (width / 2) ** 2 * (3 * centre + width / 2)
    for time in (centre - width / 2, centre, centre + width / 2):
        error = value(right(23, 1), put_in | {tau: time}).real
        line = value(right(26), piece | {tau: time, paper.tau_i: centre}).real
        assert line == pytest.approx(error, abs=bound * (time != centre) + 1e-12)
        printed = piece[paper.piece[0]] + piece[paper.piece[1]] * time
        assert abs(printed - error) > 10 * bound


def test_29_indicates_the_point_itself_where_there_is_no_error() -> None:
    """And with one, the point moved by Q_i⁻¹ of its value and slope: every piece sees its own Q."""
    place, time = np.array([40.0, -70.0, 0.0]), 2.0
    rate = (held_range(place, time + 1) - held_range(place, time - 1)) / 2
    history_of_point = dict(zip(paper.piece_range, (held_range(place, time), rate), strict=True))
    Q_i = right(19).subs(platforms_in_numbers(time))
    symbol = next(iter(right(29).atoms(paper.MatrixSymbol)))
    for error in ((0.0, 0.0), (0.3, -0.02)):
        values = history_of_point | dict(zip(paper.piece, error, strict=True))
        found = right(29).subs(values).subs(symbol, Q_i).doit()
        moved = Q_i.inv() * Matrix(error)
        assert [float(one) for one in found] == pytest.approx([40 + float(moved[0]), -70 + float(moved[1])], rel=1e-9)


def test_30_inverts_q_at_the_middle_of_the_aperture_and_of_a_piece() -> None:
    for time, parts in ((0.0, (0, 1)), (2.0, (2, 3))):
        Q = np.array(right(19).subs(platforms_in_numbers(time)), dtype=float)
        determinant = value(right(30, parts[0]), platforms_in_numbers() | {paper.tau_i: time}).real
        adjugate = np.array(right(30, parts[1]).subs(platforms_in_numbers() | {paper.tau_i: time}), dtype=float)
        assert adjugate / determinant == pytest.approx(np.linalg.inv(Q), rel=1e-9)
    angles = {}
    for symbols, state in zip(PLATFORM_SYMBOLS, STATES, strict=True):
        angles[Function(f"phi_{symbols.subscript}")(paper.tau_i)] = state.azimuth
        angles[Function(f"theta_{symbols.subscript}")(paper.tau_i)] = state.elevation
    by_angles = np.array(right(30, 4).subs(angles).subs(platforms_in_numbers()), dtype=float)
    at_middle = np.array(right(30, 1).subs(platforms_in_numbers()), dtype=float)
    assert by_angles == pytest.approx(at_middle, rel=1e-9)


def test_31_is_the_second_column_of_the_inverse_times_its_determinant() -> None:
    """Along it a rate error moves a response: Q·v has no range and the determinant as its rate."""
    direction = np.array(right(31).subs(platforms_in_numbers()), dtype=float).ravel()
    Q = np.array(right(19).subs(platforms_in_numbers()), dtype=float)
    assert Q @ direction == pytest.approx([0.0, np.linalg.det(Q)], abs=1e-12)
