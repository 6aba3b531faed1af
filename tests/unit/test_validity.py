"""Beyond first order: exact ranges without NumPy, against NumPy; which rows carry them, both sides of each bound."""

import csv
import io
import math
import subprocess
import sys

import numpy as np
import pytest
from bisar_budget.budget.validity import FirstOrder
from hypothesis import given, settings
from hypothesis import strategies as st

from bisar_budget.budget.effects import full_ground
from bisar_budget.budget.exact_ranges import ExactRanges
from bisar_budget.budget.findings import Report
from bisar_budget.budget.sources import error_sources
from bisar_budget.geometry import norm
from bisar_budget.mission.load import parse_mission
from bisar_budget.report import Style, render
from bisar_budget.units import SPEED, parse_quantity
from tests.conftest import ROOT, findings, mission_text, row

C = 299_792_458.0
LAMBDA = C / 10e9
T = 6.0
TX_ERROR = "platforms__transmitter__motion_error"


def brute_force(mission, r_tilde, clock=0.0, aperture_time: float = T):
    """Displaced point and phases by exact ranges: 2 000 pulses, a sextic fit, SciPy-free Gauss-Newton in NumPy.

    `r_tilde` gives both platforms' position errors over slow time; phases are of a cubic fitted to what remains.
    """
    tau = (np.arange(2000) + 0.5) / 2000 * aperture_time - aperture_time / 2
    x = 2 * tau / aperture_time
    tracks = []
    for state in (mission.geometry.transmitter, mission.geometry.receiver):
        p, v, a = (np.array(part) for part in (state.position, state.velocity, state.acceleration))
        tracks.append(p + v * tau[:, None] + a * tau[:, None] ** 2 / 2)
    recorded = sum(np.linalg.norm(track, axis=1) for track in tracks) + C * clock * tau**0
    measured = [track + error(tau[:, None]) for track, error in zip(tracks, r_tilde, strict=True)]
    fit = np.polynomial.polynomial.polyfit

    def left(point):
        return recorded - sum(np.linalg.norm(m - [*point, 0.0], axis=1) for m in measured)

    point = np.zeros(2)
    for _ in range(12):
        at = fit(x, left(point), 6)[:2]
        slope = [(fit(x, left(point + d), 6)[:2] - fit(x, left(point - d), 6)[:2]) / 2 for d in np.eye(2)]
        point = point - np.linalg.solve(np.transpose(slope), at)
    cubic = fit(x, 2 * math.pi / LAMBDA * left(point), 3)
    return point, cubic[2], cubic[3]


@settings(max_examples=25, deadline=None)
@given(st.tuples(*[st.floats(-3, 3)] * 3), st.tuples(*[st.floats(-0.5, 0.5)] * 3), st.sampled_from(["one", "both"]))
def test_the_plain_fit_is_that_of_arrays(velocity, offset, who: str) -> None:
    """Velocity errors of the transmitter together with position errors of the receiver, or one alone."""
    mission = parse_mission(
        mission_text(
            **{f"{TX_ERROR}__velocity": list(velocity)},
            platforms__receiver__motion_error={"position": list(offset)},
        )
    )
    sources = [s for s in error_sources(mission, mission.geometry) if s.declared is not None]
    sources = sources if who == "both" else [s for s in sources if s.owner == "transmitter"]
    found = ExactRanges(mission.geometry, LAMBDA, T).phases([(s, s.declared) for s in sources])
    fixed = np.array(offset) if who == "both" else np.zeros(3)
    point, quadratic, cubic = brute_force(mission, (lambda t: t * np.array(velocity), lambda t: fixed + 0 * t))
    assert found.displacement == pytest.approx(point, abs=1e-4)
    assert found.quadratic == pytest.approx(quadratic, rel=1e-4, abs=1e-4)
    assert found.cubic == pytest.approx(cubic, rel=1e-3, abs=1e-3)


def test_clock_and_terrain_in_exact_ranges() -> None:
    mission = parse_mission(mission_text(timing_error={"constant": "20 ns"}, scene={"height_error": 5}))
    sources = {s.id: s for s in error_sources(mission, mission.geometry)}
    exact = ExactRanges(mission.geometry, LAMBDA, T)
    still = (lambda t: 0 * t * np.ones(3),) * 2
    point, quadratic, _ = brute_force(mission, still, clock=20e-9)
    found = exact.phases([(sources["timing.constant"], 20e-9)])
    assert found.displacement == pytest.approx(point, abs=1e-4)
    assert found.quadratic == pytest.approx(quadratic, abs=1e-4)
    up = (lambda t: 0 * t + np.array([0, 0, 5.0]),) * 2
    point, quadratic, _ = brute_force(mission, up)
    found = exact.phases([(sources["mission.terrain"], 5.0)])
    assert found.displacement == pytest.approx(point, abs=1e-4)
    assert found.quadratic == pytest.approx(quadratic, abs=1e-4)


def test_a_point_that_the_centre_s_slopes_do_not_find_is_found_with_its_own() -> None:
    """Gradients 3.4° apart, 190 m away: with fixed slopes the search ran off, and no point was said to have it."""
    transmitter = {
        "position": [788.131, -4136.845, 4464.006],
        "velocity": [-21.67, 2.61710, 1.54785],
        "acceleration": [-1.21552, -2.93011, 2.80680],
    }
    receiver = {
        "position": [6394.313, 24708.333, 29239.446],
        "velocity": [-175.65024, 74.57597, 10.98991],
        "motion_error": {"position": [0, -7.66, 0.063]},
    }
    duration = 1.77122
    mission = parse_mission(
        mission_text(
            platforms={"transmitter": transmitter, "receiver": receiver}, collection={"aperture_time": duration}
        )
    )
    source = next(s for s in error_sources(mission, mission.geometry) if s.id == "receiver.position.y")
    found = ExactRanges(mission.geometry, LAMBDA, duration).phases([(source, -7.66)])
    moved = (lambda t: 0 * t * np.ones(3), lambda t: 0 * t + np.array([0, -7.66, 0]))
    point, quadratic, _ = brute_force(mission, moved, aperture_time=duration)
    assert math.hypot(*point) > 100
    assert found is not None
    assert found.displacement == pytest.approx(point, abs=1e-2)
    assert found.quadratic == pytest.approx(quadratic, rel=1e-3)


def test_no_ground_point_has_the_history_of_an_absurd_error() -> None:
    found = row(findings(**{f"{TX_ERROR}__position": [0, 0, "100 km"]}), "transmitter.position.z")
    assert found.qpe_exact_rad is None
    assert any("no ground point has this range history" in note for note in found.notes)
    assert found.status == "warn"


class TestRows:
    @pytest.mark.parametrize(("moved", "is_beyond"), [(9.99, False), (10.01, True)])
    def test_a_displacement_of_10_m(self, moved: float, is_beyond: bool) -> None:
        """Of a clock error, which has no second order of its own."""
        per_second = (
            math.hypot(*row(findings(timing_error={"constant": 1e-9}), "timing.constant").displacement_m) * 1e9
        )
        found = row(
            findings(timing_error={"constant": moved / per_second}, allocation__model="full"), "timing.constant"
        )
        assert math.hypot(*found.displacement_m) == pytest.approx(moved, rel=0.05)
        assert (found.qpe_exact_rad is not None) == is_beyond
        assert any("moves the image by 10 m" in note for note in found.notes) == is_beyond

    def test_the_phase_is_that_of_exact_ranges(self) -> None:
        mission = parse_mission(mission_text(**{f"{TX_ERROR}__velocity": [0, 0, 3]}))
        _, quadratic, _ = brute_force(mission, (lambda t: t * np.array([0, 0, 3.0]), lambda t: 0 * t * np.ones(3)))
        found = row(findings(**{f"{TX_ERROR}__velocity": [0, 0, 3]}), "transmitter.velocity.z")
        assert found.qpe_exact_rad == pytest.approx(quadratic, rel=1e-3)
        assert abs(found.qpe_exact_rad - found.qpe_full_rad) > 0.1
        assert any(f"{found.qpe_exact_rad:.3g} rad by exact ranges" in note for note in found.notes)

    @pytest.mark.parametrize(("turn", "is_beyond"), [(0.299, False), (0.301, True)])
    def test_a_line_of_sight_that_turns_by_0_3_rad(self, turn: float, is_beyond: bool) -> None:
        receiver = parse_mission(mission_text()).geometry.receiver
        aperture_time = 2 * turn / norm(receiver.look_rate)
        changes = {"collection": {"aperture_time": aperture_time}, f"{TX_ERROR}__acceleration": [1e-6, 0, 0]}
        found = findings(**changes)
        assert (row(found, "transmitter.acceleration.x").qpe_exact_rad is not None) == is_beyond
        assert any("beyond ±0.3" in note for note in found.notes) == is_beyond
        assert any("quartic term, about" in n for n in found.notes if "receiver" in n) != is_beyond

    @pytest.mark.parametrize(("degrees", "is_beyond"), [(11.6, False), (11.4, True)])
    def test_gradients_whose_sine_is_below_0_2(self, degrees: float, is_beyond: bool) -> None:
        """arcsin 0.2 is 11.54°. One platform is still and overhead, so that gradients are the other's own."""
        still = {"position": [0, 0, "20 km"], "velocity": [0, 0, 0]}
        angle = math.radians(degrees)
        # u̇ = (v - u(u·v))/R along the ground at that angle to u: v in the ground plane, u 10° up.
        up = math.radians(10)
        across, along = math.sin(angle), math.cos(angle) / math.sin(up) ** 2
        moving = {
            "slant_range": 20e3, "azimuth": 0.0, "elevation": up, "speed": 100.0,
            "motion_azimuth": math.atan2(across, along),
        }  # fmt: skip
        moving["motion_error"] = {"acceleration": [1e-6, 0, 0]}
        found = findings(platforms={"transmitter": moving, "receiver": still})
        assert math.degrees(found.geometry.gradient_angle) == pytest.approx(degrees, abs=1e-6)
        assert (row(found, "transmitter.acceleration.x").qpe_exact_rad is not None) == is_beyond

    def test_an_allowable_beyond_first_order_says_so(self) -> None:
        """Where it says first order holds, exact ranges agree; at the allowable they do not."""
        found = row(findings(allocation__model="full"), "receiver.velocity.z")
        (note,) = [note for note in found.notes if "speaks of the first order alone" in note]
        held = parse_quantity(note.rsplit("about ", 1)[1], SPEED)
        mission = parse_mission(mission_text())
        source = next(s for s in error_sources(mission, mission.geometry) if s.id == "receiver.velocity.z")
        exact = ExactRanges(mission.geometry, LAMBDA, T)
        off = [abs(exact.phases([(source, v)]).quadratic - source.full.qpe * v) for v in (held, found.allowable)]
        assert off[0] == pytest.approx(0.02, rel=0.2)  # the size is said with two digits, and squared
        assert off[1] > 0.05

    def test_a_tight_allowable_says_nothing(self) -> None:
        assert not row(findings(), "transmitter.acceleration.x").notes


class TestAggregates:
    ERRORS = {f"{TX_ERROR}__velocity": [0, 0, 3]}

    @pytest.mark.parametrize("rule", ["sum", "rss"])
    def test_sums_say_what_exact_ranges_make_of_them_and_warn(self, rule: str) -> None:
        found = findings(allocation={"combine": rule, "model": "full"}, **self.ERRORS)
        exact = abs(row(found, "transmitter.velocity.z").qpe_exact_rad)
        aggregate = row(found, "transmitter.quadratic_phase_error")
        assert any("transmitter.velocity.z" in note and "beyond first order" in note for note in aggregate.notes)
        assert exact > aggregate.allowable
        assert aggregate.status == "warn" or aggregate.utilization > 1
        assert not row(found, "receiver.quadratic_phase_error").notes

    @pytest.mark.parametrize(("requirement", "status"), [("1 km", "pass"), (None, "info")])
    def test_location(self, requirement, status: str) -> None:
        changes = {} if requirement is None else {"requirements": {"location_error": requirement}}
        location = row(findings(**changes, **self.ERRORS), "mission.location_error")
        assert location.status == status
        mission = parse_mission(mission_text())
        point, *_ = brute_force(mission, (lambda t: t * np.array([0, 0, 3.0]), lambda t: 0 * t * np.ones(3)))
        (note,) = location.notes
        assert f"{np.hypot(*point):.3g} m" in note

    def test_a_location_that_only_exact_ranges_fail_is_a_warning(self) -> None:
        """Vertical velocity, downwards: between what exact ranges and first order give."""
        errors = {f"{TX_ERROR}__velocity": [0, 0, -8]}
        location = row(findings(allocation__model="full", **errors), "mission.location_error")
        exact = float(location.notes[0].split("it is ")[1].split(" ")[0])
        assert exact > location.declared
        between = {"requirements": {"location_error": (exact + location.declared) / 2}}
        location = row(findings(allocation__model="full", **between, **errors), "mission.location_error")
        assert (location.utilization < 1, location.status) == (True, "warn")

    def test_pull_in(self) -> None:
        pull_in = row(findings(autofocus={"n_pull": 2}, **self.ERRORS), "mission.autofocus_pull_in")
        assert any("beyond first order" in note for note in pull_in.notes)


@pytest.mark.parametrize(("bandwidth", "is_said"), [("1 MHz", True), ("300 MHz", False)])
def test_coarse_range_cells_are_said(bandwidth: str, is_said: bool) -> None:
    """q_cell = (2π/λ)(T/2)²·½|s̈·Q⁻¹[1, 0]ᵀ|·c/B from finite differences of the lines of sight."""
    receiver = {"position": ["6 km", "6 km", "2 km"], "velocity": ["-10 m/s", "60 m/s", 0]}
    mission = parse_mission(mission_text(platforms__receiver=receiver, radar__bandwidth=bandwidth))

    def s(tau: float):
        states = (mission.geometry.transmitter, mission.geometry.receiver)
        return sum(np.array(p.at(tau)[0]) / norm(p.at(tau)[0]) for p in states)[:2]

    h = 0.5
    rate, bend = (s(h) - s(-h)) / (2 * h), (s(h) - 2 * s(0) + s(-h)) / h**2
    moved = np.linalg.solve(-np.array([s(0), rate]), [1.0, 0.0])
    cell = 2 * math.pi / LAMBDA * (T / 2) ** 2 / 2 * abs(bend @ moved) * C / mission.radar.bandwidth
    assert (cell > 1) == is_said
    notes = [n for n in findings(platforms__receiver=receiver, radar__bandwidth=bandwidth).notes if "range cell" in n]
    assert bool(notes) == is_said
    if is_said:
        assert float(notes[0].split("differ by ")[1].split(" ")[0]) == pytest.approx(cell, rel=0.01)


def test_exact_ranges_load_no_numpy() -> None:
    """A mission all of whose rows ask for them."""
    code = (
        "import sys; from datetime import date; from bisar_budget.budget.check import check_mission;"
        "from bisar_budget.mission.load import load_mission;"
        f"m = check_mission(load_mission({str(ROOT / 'specs/missions/uav_pair_l_band.yaml')!r}), date.today());"
        "assert any(r.qpe_exact_rad is not None for r in m.rows); assert 'numpy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_bound_of_nothing_is_no_division() -> None:
    """No error declared, none asked about."""
    mission = parse_mission(mission_text())
    first_order = FirstOrder(mission, mission.geometry, full_ground(mission, mission.geometry))
    assert all(first_order.beyond(s) is None for s in error_sources(mission, mission.geometry))
    assert not first_order.found


@pytest.mark.parametrize(("metres", "is_beyond"), [(0.9, False), (1.8, True)])
def test_a_displacement_that_first_order_has_wrong_is_beyond_it(metres: float, is_beyond: bool) -> None:
    """Gradients 13° apart: the phase is right to 0.02 rad, the image is 3.5 % of 9 m elsewhere."""
    platforms = {
        "transmitter": {"position": [7336, -14770, 10e3], "velocity": [43, 127, 5], "acceleration": [0.8, 0.7, -0.2]},
        "receiver": {"position": [-5045, 8599, 2988], "velocity": [-86, 34, 0], "acceleration": [0.2, 0.6, 0.1]},
    }  # fmt: skip
    changes = {"platforms": platforms, "collection__aperture_time": 2, "allocation__model": "full"}
    errors = {f"{TX_ERROR}__position": [metres, 0, 0]}
    found = row(findings(**changes, **errors), "transmitter.position.x")
    mission = parse_mission(mission_text(**changes, **errors))
    error = (lambda t: np.array([metres, 0, 0]) + 0 * t, lambda t: 0 * t * np.ones(3))
    point, quadratic, _ = brute_force(mission, error, aperture_time=2.0)
    assert found.qpe_full_rad == pytest.approx(quadratic, abs=0.02)
    off = math.dist(found.displacement_m, point)
    assert (off > max(0.1, 0.02 * math.hypot(*point))) == is_beyond
    assert (found.qpe_exact_rad is not None) == is_beyond
    assert any("the second order moves the image by" in note for note in found.notes) == is_beyond


@pytest.mark.parametrize(("model", "whose"), [("published", "the full model's allowable"), ("full", "the allowable")])
def test_an_allowable_that_the_gating_model_does_not_have_is_said_to_be_the_other_ones(
    model: str, whose: str
) -> None:
    """The row says no limit; a note that spoke of "the allowable" contradicted it."""
    found = row(findings(allocation__model=model), "transmitter.velocity.z")
    (note,) = [note for note in found.notes if "speaks of the first order alone" in note]
    assert note.startswith(f"{whose} of ")
    assert (found.allowable is None) == (model == "published")


def test_csv_carries_the_phase_by_exact_ranges_and_the_margin_of_the_published_rule() -> None:
    report = Report("1", (findings(**{f"{TX_ERROR}__velocity": [0, 0, 3]}, requirements={"pslr": "-30 dB"}),))
    rows = {line["id"]: line for line in csv.DictReader(io.StringIO(render("csv", report, Style())))}
    beyond = row(report.missions[0], "transmitter.velocity.z")
    assert beyond.qpe_exact_rad is not None
    assert float(rows[beyond.id]["qpe_exact_rad"]) == beyond.qpe_exact_rad
    assert rows["receiver.velocity.x"]["qpe_exact_rad"] == ""
    # Half of the power against half of the amplitude: 3 dB, but for J₁/J₀ that is above φ/2.
    margin = float(rows["receiver.vibration.sinusoidal.0"]["published_margin_db"])
    assert margin == pytest.approx(10 * math.log10(2), abs=0.01)
