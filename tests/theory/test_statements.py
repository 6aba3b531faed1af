"""What the text of Rigling & Moses says in words, in numbers: those of docs/paper.md, on Section V's geometry."""

import math
import re

import numpy as np
import pytest

from bisar_budget import evaluators
from bisar_budget.analysis.analysis import Analysis
from bisar_budget.effects.effect import PRINTED, TRUE, LinePiece, gradients_of, indicated_point
from bisar_budget.geometry import BistaticGeometry, PlatformState
from bisar_budget.mission.load import load_mission
from bisar_budget.ranges.exact_ranges import aperture_nodes
from bisar_budget.simulator.phase_history import Path, PathError, exact_effect, path
from bisar_budget.theory import full, published
from bisar_budget.theory.symbols import TRANSMITTER, T, islr, positive, pslr, share, total_qpe, wavelength
from tests.conftest import ROOT, findings, row

SECTION_V = load_mission(str(ROOT / "specs" / "missions" / "rigling_moses_section_v.yaml"))
PAGE = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")


def stated(text: str) -> tuple[float, ...]:
    """Numbers that the page gives where `{}` stands in a sentence of it."""
    pattern = re.escape(text).replace(r"\{\}", r"(−?[\d.]+)").replace(r"\ ", r"\s+")
    found = re.search(pattern, PAGE)
    assert found, text
    return tuple(float(number.replace("−", "-")) for number in found.groups())


def monostatic(geometry: BistaticGeometry) -> BistaticGeometry:
    return BistaticGeometry(transmitter=geometry.receiver, receiver=geometry.receiver)


def test_the_first_column_of_the_inverse_is_small_beside_the_second() -> None:
    plane = Analysis(SECTION_V).published.plane
    first, second = np.linalg.norm(np.array(plane.adjugate).reshape(2, 2) / plane.determinant, axis=0)
    by_value, by_rate = stated("{} m per metre and {} m per metre a second")
    assert first == pytest.approx(by_value, abs=0.005)  # as many digits as are printed
    assert second == pytest.approx(by_rate, abs=0.5)


def test_the_second_column_hardly_turns_over_the_aperture() -> None:
    directions = []
    for tau in (-3.0, 3.0):
        x, y = indicated_point(SECTION_V.geometry, LinePiece(tau, 0.0, 1.0), "full")
        directions.append(math.atan2(y, x))
    turned = math.degrees(abs(directions[1] - directions[0]))
    assert turned == pytest.approx(stated("turns by {}° over the aperture")[0], abs=0.05)


def test_the_bistatic_aspect_bisects_the_solid_angle() -> None:
    """Fig. 2: in space. Its azimuth on the ground is not half of that between the platforms."""
    geometry = SECTION_V.geometry
    t, r = np.array(geometry.transmitter.look), np.array(geometry.receiver.look)
    aspect = (t + r) / np.linalg.norm(t + r)
    halves = [math.degrees(math.acos(aspect @ one)) for one in (t, r)]
    assert halves == pytest.approx([math.degrees(geometry.bistatic_angle) / 2] * 2, abs=1e-9)
    half, azimuth, between = stated("{}° from each, at an azimuth of {}°; half of the azimuths' difference is {}°")
    assert halves[0] == pytest.approx(half, abs=0.005)
    assert math.degrees(geometry.look_azimuth) == pytest.approx(azimuth, abs=0.005)
    assert (geometry.receiver.azimuth - geometry.transmitter.azimuth) / 2 == pytest.approx(math.radians(between))


def test_the_limits_of_one_platform_at_both_ends_are_the_monostatic_rules_with_a_broadening_of_one() -> None:
    """QPE of π/4 two ways at the resolution ρ = λR/(2vT): a ≤ 2ρ²v²/(λR²) and ṽ ≤ ρ²v/(λR), each leg with π/8."""
    place, speed = {"position": ["8 km", 0, 0]}, {"velocity": [0, "60 m/s", 0]}
    found = findings(platforms__transmitter=place | speed, platforms__receiver=place | speed)
    R, v, lam = 8e3, 60.0, 0.0299792458
    rho = found.geometry.cross_range_resolution(lam, 6.0)
    assert rho == pytest.approx(lam * R / (2 * v * 6.0), rel=1e-12)
    rules = {"acceleration.x": 2 * rho**2 * v**2 / (lam * R**2), "velocity.y": rho**2 * v / (lam * R)}
    for name, rule in rules.items():
        for platform in ("transmitter", "receiver"):
            # Two legs with one error have twice the phase of one, against π/4 for the one radar.
            assert row(found, f"{platform}.{name}").allowable_published == pytest.approx(rule, rel=1e-9)


def seen_from(place: tuple[float, float], errors: tuple[PathError | None, ...]) -> tuple[float, float, float]:
    """Displacement and QPE of a scatterer somewhere, by exact ranges, the origin moved onto it. [m], [rad]"""
    nodes, offset = aperture_nodes(6.0), np.array([*place, 0.0])
    paths = []
    for state, error in zip((SECTION_V.geometry.transmitter, SECTION_V.geometry.receiver), errors, strict=True):
        one = path(state, nodes, error)
        paths.append(Path(actual=one.actual - offset, measured=one.measured - offset))
    effect = exact_effect(nodes, *paths, 0.0, SECTION_V.radar, 6.0)
    return (*effect.displacement, effect.quadratic)


@pytest.mark.parametrize(
    ("sentence", "errors"),
    [
        ("the acceleration of Section V", (PathError(acceleration=(0.005, 0.0, 0.0)), None)),
        ("a velocity error of the receiver of 4 cm/s along x", (None, PathError(velocity=(0.04, 0.0, 0.0)))),
    ],
)
def test_defocus_and_displacement_are_spatially_invariant_up_to_an_end(sentence: str, errors) -> None:
    """Scatterers on a rim against the one at the centre, ranges exact."""
    centre = np.array(seen_from((0.0, 0.0), errors))
    numbers = stated(f"| {sentence} | {{}} | {{}} | {{}} | {{}} | {{}} | {{}} |")
    assert abs(centre[2]) == pytest.approx(numbers[0], abs=0.005)
    assert math.hypot(centre[0], centre[1]) == pytest.approx(numbers[1], abs=0.005)
    for radius, (phase, moved) in zip((250.0, 1000.0), (numbers[2:4], numbers[4:6]), strict=True):
        places = [(radius * math.cos(a), radius * math.sin(a)) for a in np.linspace(0, 2 * math.pi, 8, False)]
        apart = np.abs(np.array([seen_from(place, errors) for place in places]) - centre)
        assert apart[:, 2].max() == pytest.approx(phase, abs=0.0005)
        assert np.hypot(apart[:, 0], apart[:, 1]).max() == pytest.approx(moved, abs=0.005)


def inverse_of_q(tau: float, model: str) -> np.ndarray:
    """Q_i⁻¹ from differences of r/R, R held at its mid-aperture value or not. (2, 2)"""

    def gradient(time: float) -> np.ndarray:
        total = np.zeros(2)
        for state in (SECTION_V.geometry.transmitter, SECTION_V.geometry.receiver):
            place = np.array(state.position) + np.array(state.velocity) * time
            total += place[:2] / (state.slant_range if model == "published" else np.linalg.norm(place))
        return total

    return np.linalg.inv(-np.array([gradient(tau), (gradient(tau + 0.5) - gradient(tau - 0.5))]))


@pytest.mark.parametrize(("model", "column"), [("published", 0), ("full", 1)])
def test_29_has_the_printed_gradients_by_the_published_model_and_the_true_ones_by_the_full(
    model: str, column: int
) -> None:
    """Fig. 4, on the quadratic of Fig. 3: scale, sign and place of its three points."""
    state = SECTION_V.geometry.transmitter
    beta_2 = -0.005 * state.position[0] / (2 * state.slant_range)  # Table I
    for tau, name in ((-2.0, "−2 s"), (2.0, "2 s")):
        point = indicated_point(SECTION_V.geometry, LinePiece(tau, beta_2 * tau**2, 2 * beta_2 * tau), model)
        # Of the difference over a second the third order remains: (vT/R)² of 1e-4.
        by_differences = inverse_of_q(tau, model) @ [beta_2 * tau**2, 2 * beta_2 * tau]
        assert point == pytest.approx(by_differences, abs=2e-4)
        numbers = stated(f"| {name} | ({{}}, {{}}) m | ({{}}, {{}}) m |")
        assert point == pytest.approx(numbers[2 * column : 2 * column + 2], abs=0.0005)
    assert indicated_point(SECTION_V.geometry, LinePiece(0.0, 0.0, 0.0), model) == (0.0, 0.0)
    assert gradients_of(model) == (TRUE if column else PRINTED)


def test_29_by_the_full_model_is_the_point_whose_range_changes_so() -> None:
    """Squinted, where v/R is not v⊥/R: the point of the full model has value and slope of the piece."""
    geometry = BistaticGeometry(
        transmitter=PlatformState(position=(24e3, -9e3, 5e3), velocity=(-90.0, 130.0, 4.0)),
        receiver=PlatformState(position=(6e3, 6e3, 2e3), velocity=(-60.0, 0.0, 0.0)),
    )
    tau, value, slope = 2.0, -1.0, -0.02

    def change(point: tuple[float, float], time: float) -> float:
        total = 0.0
        for state in (geometry.transmitter, geometry.receiver):
            place, _ = state.at(time)
            total += math.dist(place, (*point, 0.0)) - math.hypot(*place)
        return total

    for model in ("published", "full"):
        point = indicated_point(geometry, LinePiece(tau, value, slope), model)
        got = (change(point, tau), (change(point, tau + 0.01) - change(point, tau - 0.01)) / 0.02)
        if model == "full":
            # What is left is the curvature of the wave, |x|²/2R for each leg.
            assert got == pytest.approx((value, slope), abs=math.hypot(*point) ** 2 / 8e3)
        else:
            assert abs(got[1] - slope) > 1e-3


def test_29_seen_from_a_place_is_29_with_the_origin_there() -> None:
    geometry, piece = SECTION_V.geometry, LinePiece(1.0, -0.01, -0.02)
    east, north = 300.0, -200.0
    moved = [
        PlatformState(position=(s.position[0] - east, s.position[1] - north, s.position[2]), velocity=s.velocity)
        for s in (geometry.transmitter, geometry.receiver)
    ]
    there = BistaticGeometry(transmitter=moved[0], receiver=moved[1])
    for model in ("published", "full"):
        want = indicated_point(there, piece, model)
        assert indicated_point(geometry, piece, model, (east, north)) == pytest.approx(want, rel=1e-12)


def test_the_emitted_steps_are_the_derived_ones() -> None:
    """Gain, limit, vibration and shares as numbers, against the expressions and against a hand's sum."""
    assert evaluators.autofocus_gain(2.0, math.pi / 4) == pytest.approx(8.0)  # 4·N_pull
    assert float(published.pull_in_factor().subs({published.n_pull: 2, total_qpe: 0.3})) == pytest.approx(
        evaluators.autofocus_gain(2.0, 0.3)
    )
    error = TRANSMITTER.acceleration_error[0]
    (cells,) = [r.cells for r in published.table_2().rows if r.error == error]
    numbers = {TRANSMITTER.azimuth: 0.4, TRANSMITTER.elevation: 0.2, T: 6.0, wavelength: 0.03}
    x = math.cos(0.4) * math.cos(0.2) * 3e4
    unit = evaluators.published_motion(x, 0, 0, 0, 0, 0, 3e4, 0.03, 6.0)[6][2]
    assert math.pi / 8 / abs(unit) == pytest.approx(float(cells[1].subs(numbers)))
    sinusoid, noise = published.vibration().rows
    for cell, ratio in ((sinusoid, pslr), (noise, islr)):
        want = float(cell.cells[1].subs({ratio: 1e-3, share: 0.3, wavelength: 0.03}))
        assert evaluators.vibration_limit(0.03, 1e-3, 0.3) == pytest.approx(want)
        assert want == pytest.approx(0.03 * math.sqrt(3e-4) / (2 * math.pi))
    assert evaluators.motion_of_phase(0.03, 2 * math.pi) == pytest.approx(0.03)
    assert evaluators.amplitude_share(0.9, 0.1) == pytest.approx(0.75)  # 3 to 1


def test_noise_of_first_principles_is_the_derived_root() -> None:
    """`spread_phase` needs a logarithm, which no emitted function has: its root is that of the derived row."""
    from bisar_budget.analysis.spread import spread_phase

    noise = full.vibration().rows[2].cells[1]
    want = float(noise.subs({islr: 0.2, share: 0.3, wavelength: 0.03, positive("E"): 0.9}))
    assert evaluators.motion_of_phase(0.03, math.sqrt(0.3) * spread_phase(0.2, "full", 0.9)) == pytest.approx(want)
