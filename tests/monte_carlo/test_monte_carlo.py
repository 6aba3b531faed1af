"""Monte Carlo against probabilities by hand, and what it promises about seeds, blocks and memory."""

import json
import math
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.analysis.analysis import Analysis
from bisar_budget.analysis.variables import Variable
from bisar_budget.constants import MAX_DRAWS
from bisar_budget.findings.monte_carlo import MonteCarlo, Requirement
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.sampling import draws as drawing
from bisar_budget.sampling.probability import _wilson, monte_carlo
from tests import reference
from tests.cli.test_settings import project, table  # noqa: F401
from tests.conftest import examples, findings, mission_text, row

N = 100_000
T, F0 = 6.0, 10e9
WAVELENGTH = 299_792_458.0 / F0
R_T = math.hypot(30e3, 6e3)
ERROR = "platforms__transmitter__motion_error"


def drawn(count: int = N, seed: int | None = None, **changes) -> MonteCarlo:
    return monte_carlo(Analysis(parse_mission(mission_text(**changes))), count, seed)


def small(row_id: str) -> tuple[float, float]:
    """Quadratic phase [rad] and displacement [m] of a unit of a small error of the base mission, by the reference.

    Draws that are sums have the quadratic phase alone: what is hidden here adds a few hundred thousandths to it.
    """
    mission = parse_mission(mission_text(common_motion_error={"position": 0}))
    (error,) = [one for one in reference.errors_of(mission) if one.id == row_id]
    size = 1e-7 * error.cap
    both = reference.at_declared(mission, [error._replace(declared=size)])
    qpe, place = ((of[0, 0] - of[1, 0]) / (2 * size) for of in (both.qpe, both.place))
    return abs(float(qpe)), math.hypot(*place)


BEND, BEND_Z = (small(f"transmitter.acceleration.{axis}")[0] for axis in "xz")  # rad per m/s²


def requirement(found: MonteCarlo, name: str) -> Requirement:
    (match,) = [one for one in found.requirements if one.id == name]
    return match


def holds_like(one: Requirement, probability: float) -> None:
    """Within four standard deviations of a binomial share, and inside the interval widened as much."""
    spread = math.sqrt(probability * (1 - probability) / N)
    assert abs(one.probability - probability) <= 4 * spread + 1e-12
    assert one.probability_low <= one.probability <= one.probability_high


def phi(x: float) -> float:
    """Probability of a normal variable within ±x sigma."""
    return math.erf(x / math.sqrt(2))


class TestProbabilities:
    @pytest.mark.parametrize("sigmas", [0.3, 1, 2, 3])
    def test_one_normal_error_between_two_sides(self, sigmas: float) -> None:
        """t̃₂ gives nearly π f₀ t̃₂ T²/2; alone, without a share, it is held to the receiver's π/8."""
        sigma = math.pi / 8 / sigmas
        per_unit = small("timing.quadratic")[0]
        assert per_unit == pytest.approx(math.pi * F0 * T**2 / 2, rel=1e-3)
        found = drawn(timing_error={"quadratic": sigma / per_unit})
        one = requirement(found, "receiver.quadratic_phase_error")
        holds_like(one, phi(sigmas))
        assert one.probability_normal == pytest.approx(phi(sigmas))
        assert one.sigma_rss == pytest.approx(sigma)
        assert one.sigma == pytest.approx(sigma, rel=4 / math.sqrt(2 * N))
        holds_like(requirement(found, "mission.quadratic_phase_error"), phi(2 * sigmas))
        assert one.warnings == ()

    @pytest.mark.parametrize("share", [0.5, 0.999999, 1.5, 4])
    def test_one_uniform_error(self, share: float) -> None:
        """A half width of `share` limits holds with the probability 1/share."""
        width = share * math.pi / 8 / BEND
        found = drawn(**{ERROR: {"acceleration": [width, 0, 0], "distribution": "uniform"}})
        one = requirement(found, "transmitter.quadratic_phase_error")
        holds_like(one, min(1.0, 1 / share))
        assert one.sigma_rss == pytest.approx(width * BEND / math.sqrt(3))
        assert one.sum == one.rss == pytest.approx(width * BEND, rel=1e-4)  # the band hides a hundredth of it
        assert "not normal, has 100 %" in one.warnings[0]

    def test_two_uniform_errors_are_a_triangle(self) -> None:
        """Of equal half width a: P(|x + y| ≤ L) = 1 − (2a − L)²/(4a²); 99.2 % here, normally 97.4 %."""
        a = 0.55 * math.pi / 8
        found = drawn(**{ERROR: {"acceleration": [a / BEND, 0, a / BEND_Z], "distribution": "uniform"}})
        L = math.pi / 8
        one = requirement(found, "transmitter.quadratic_phase_error")
        holds_like(one, 1 - (2 * a - L) ** 2 / (4 * a**2))
        assert one.dominant_share == pytest.approx(0.5)
        assert "root-sum-square is pessimistic" in one.warnings[-1]

    @pytest.mark.parametrize(("share", "probability"), [(1, 1), (1.0001, 0)])
    def test_one_bound_is_at_its_end(self, share: float, probability: float) -> None:
        width = share * math.pi / 8 / BEND
        found = drawn(**{ERROR: {"acceleration": [width, 0, 0], "distribution": "bound"}})
        one = requirement(found, "transmitter.quadratic_phase_error")
        assert one.probability == probability
        assert one.sigma == pytest.approx(width * BEND)

    def test_two_bounds_add_or_cancel_in_half_of_the_draws_each(self) -> None:
        width = 0.6 * math.pi / 8
        found = drawn(**{ERROR: {"acceleration": [width / BEND, 0, width / BEND_Z], "distribution": "bound"}})
        holds_like(requirement(found, "transmitter.quadratic_phase_error"), 0.5)

    def test_declared_phases_and_terrain_are_drawn_as_bounds(self) -> None:
        found = drawn(
            other_errors=[{"name": "a", "quadratic_phase_error": 0.4}, {"name": "b", "quadratic_phase_error": 0.4}]
        )
        (one,) = found.requirements
        assert one.id == "mission.quadratic_phase_error"
        holds_like(one, 0.5)
        assert any("other.a, other.b" in note for note in found.notes)
        terrain = drawn(scene__height_error="10 m")
        assert requirement(terrain, "mission.quadratic_phase_error").dominant == "mission.terrain"
        assert any("mission.terrain" in note for note in terrain.notes)

    def test_a_common_error_counts_for_the_mission_alone_and_both_legs_add(self) -> None:
        bend = math.pi * T**2 / (4 * WAVELENGTH) * (30e3 / R_T + 6e3 / math.sqrt(2 * 6e3**2 + 2e3**2))
        found = drawn(common_motion_error={"acceleration": [math.pi / 4 / bend, 0, 0]})
        (one,) = found.requirements
        assert one.id == "mission.quadratic_phase_error"
        holds_like(one, phi(1))
        uniform = drawn(common_motion_error={"acceleration": [math.pi / 2 / bend, 0, 0], "distribution": "uniform"})
        holds_like(uniform.requirements[0], 0.5)

    @pytest.mark.parametrize("rho", [-1, -0.7, 0, 0.7, 1])
    def test_a_covariance_is_drawn_with_its_correlations(self, rho: float) -> None:
        """Full model by the check's own √(gᵀCg), which is proved against exact ranges elsewhere.

        Its row is that of a hundredth of the error: so small that it is proportional to the error, as the draws are.
        Sums of draws are of the quadratic phase alone. The size of the row has in it what the band hides too.
        """

        def changes(velocity: str):
            error = {
                "covariance": {"position": 0, "velocity": velocity, "correlation": {"velocity.x-velocity.y": rho}}
            }
            return {"platforms__receiver__motion_error": error}

        one = requirement(drawn(**changes("20 mm/s")), "receiver.quadratic_phase_error")
        found = findings(**changes("0.2 mm/s"), allocation={"combine": "rss", "model": "full"})
        want = 100 * row(found, "receiver.quadratic_phase_error").qpe_full_rad
        assert one.sigma_rss == pytest.approx(want, abs=1e-12)
        assert one.sigma == pytest.approx(want, rel=4 / math.sqrt(2 * N), abs=1e-12)
        holds_like(one, phi(math.pi / 8 / want))

    def test_the_coverage_factor_is_in_the_rules_and_not_in_the_draws(self) -> None:
        changes = {ERROR: {"acceleration": "20 ug"}, "timing_error": {"quadratic": 1e-13}}
        one, three = (drawn(**changes, allocation={"coverage_factor": k}) for k in (1, 3))
        for a, b in zip(one.requirements, three.requirements, strict=True):
            assert b.probability == a.probability
            assert b.sigma == pytest.approx(a.sigma)
            assert (b.rss, b.sum) == pytest.approx((3 * a.rss, 3 * a.sum))
        assert any("coverage factor" in note for note in three.notes)

    def test_shares_gain_and_a_clock_of_its_own(self) -> None:
        found = drawn(
            timing_error={"quadratic": 1e-13},
            platforms__receiver__motion_error={"velocity": "1 mm/s"},
            allocation__split={"transmitter": 0.5, "receiver": 0.3, "clock": 0.2},
            autofocus__n_pull=2,
        )
        limits = {one.id: one.limit for one in found.requirements}
        assert limits == pytest.approx(
            {
                "receiver.quadratic_phase_error": 0.3 * 2 * math.pi,
                "timing.quadratic_phase_error": 0.2 * 2 * math.pi,
                "mission.quadratic_phase_error": 2 * math.pi,
            }
        )

    def test_location_and_cubic_phase_and_all_at_once(self) -> None:
        """Horizontal common errors move the image by themselves: a Rayleigh distribution."""
        found = drawn(
            common_motion_error={"position": ["1 m", "1 m", 0]},
            timing_error={"cubic": 0.1 / (math.pi * F0 * T**3 / 4)},
            requirements={"location_error": "2 m", "cubic_phase_error": 0.2},
        )
        holds_like(requirement(found, "mission.location_error"), 1 - math.exp(-2))
        location = requirement(found, "mission.location_error")
        by_clock = 0.1 / (math.pi * F0 * T**3 / 4) * small("timing.cubic")[1]  # a cubic has a linear part
        assert by_clock < 0.01
        assert location.sigma_rss == pytest.approx(math.hypot(math.sqrt(2), by_clock))
        assert location.probability_normal == pytest.approx(1 - math.exp(-2), abs=by_clock**2)
        assert location.sigma == pytest.approx(math.sqrt(2), rel=0.02)
        holds_like(requirement(found, "mission.cubic_phase_error"), phi(2))
        both = (1 - math.exp(-2)) * phi(2)
        assert found.probability == pytest.approx(both, abs=4 * math.sqrt(both * (1 - both) / N))

    def test_nothing_declared(self) -> None:
        found = drawn()
        assert found.requirements == ()
        assert found.probability is None


class TestStatistics:
    @pytest.mark.parametrize(
        ("successes", "draws", "low", "high"),
        [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0, 0.1611), (1, 29, 0.0061, 0.1718)],
    )
    def test_wilson_as_in_newcombe_1998_table_1(self, successes: int, draws: int, low: float, high: float) -> None:
        assert _wilson(successes, draws, 1.959963984540054) == pytest.approx((low, high), abs=5e-5)
        mirrored = _wilson(draws - successes, draws, 1.959963984540054)
        assert mirrored == pytest.approx((1 - high, 1 - low), abs=5e-5)

    def test_doubt_needs_a_sure_and_a_material_difference(self) -> None:
        """Normal errors raise none, whatever the seed; forty declared phases are a lattice, no normal one."""
        for seed in range(20):
            found = drawn(20_000, seed, **{ERROR: {"velocity": "20 mm/s", "acceleration": "30 ug"}})
            assert all(one.warnings == () for one in found.requirements)
        many = drawn(other_errors=[{"name": str(i), "quadratic_phase_error": 0.05} for i in range(40)])
        lattice = sum(math.comb(40, k) for k in range(41) if abs(2 * k - 40) * 0.05 <= math.pi / 4) / 2**40
        holds_like(many.requirements[0], lattice)
        assert "optimistic" in many.requirements[0].warnings[0]

    def test_root_sum_square_is_optimistic_or_pessimistic(self) -> None:
        """A bound of 0.9 limits never fails, normally in 27 %; one of 1.1 always, normally in 36 %."""
        for share, word in ((0.9, "pessimistic"), (1.1, "optimistic")):
            found = drawn(**{ERROR: {"acceleration": [share * math.pi / 8 / BEND, 0, 0], "distribution": "bound"}})
            assert word in requirement(found, "transmitter.quadratic_phase_error").warnings[1]


def drawings(**changes) -> list[drawing.Drawing]:
    """What is drawn."""
    taken: list[drawing.Drawing] = []

    def share(one: drawing.Drawing):
        taken.append(one)
        return drawing.in_turn(one)

    monte_carlo(Analysis(parse_mission(mission_text(**changes))), 10, 1, share)
    return taken


def stream_of(name: str, chunk: int, count: int) -> np.ndarray:
    """Draws of a bound's variable in a chunk."""
    variable = Variable(name, name, "mission", "uniform", (), (1.0, 0.0, 0.0, 0.0))
    out = np.empty(count)
    drawing._Stream(variable, 1, chunk).fill(out)
    return out


def drawn_by_hand(mission: Mission, count: int, seed: int, owners: set[str]) -> reference.Responses:
    """The draws of some owners, each drawn from its own stream and sent through the reference's exact ranges."""
    paths, clocks = np.zeros((count, 2, 3, 3)), np.zeros((count, 4))
    for error in reference.errors_of(mission):
        if error.declared and error.is_stated and error.owner in owners:
            stream = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *error.id.encode()])))
            is_uniform = error.owner == "transmitter"
            values = (stream.random(count) * 2 - 1) if is_uniform else stream.standard_normal(count)
            sizes = error.declared * values
            paths += sizes[:, None, None, None] * error.paths
            clocks += sizes[:, None] * error.clock
    errors = [
        reference.Error(str(i), "mission", one, clock, 1.0, math.inf)
        for i, (one, clock) in enumerate(zip(paths, clocks, strict=True))
    ]
    return reference.at_declared(mission, errors)


class TestLargeErrors:
    """Every draw goes through exact ranges. The reference of the tests has its own, and follows each from nothing."""

    changes = {
        ERROR: {"velocity": ["1 m/s", 0, "3 m/s"], "acceleration": "1 mm/s^2", "distribution": "uniform"},
        "platforms__receiver__motion_error": {"frame": "look", "position": "5 m", "velocity": "0.7 m/s"},
        "common_motion_error": {"position": "30 m", "velocity": [0, 0, "1 m/s"]},
        "timing_error": {"constant": "50 ns", "quadratic": 2e-12},
        "requirements": {"location_error": "40 m", "cubic_phase_error": 0.03},
    }

    def test_each_draw_is_that_of_exact_ranges(self) -> None:
        """The same 300 draws: phases by each owner and together, displacement. To a millionth, as both are exact."""
        mission = parse_mission(mission_text(**self.changes))
        found = monte_carlo(Analysis(mission), 300, 5)
        assert found.is_exact
        assert any("exact ranges" in note for note in found.notes)
        every = drawn_by_hand(mission, 300, 5, {"transmitter", "receiver", "clock", "mission"})
        transmitter = drawn_by_hand(mission, 300, 5, {"transmitter"})
        receiver = drawn_by_hand(mission, 300, 5, {"receiver", "clock"})
        sizes = {
            "transmitter.quadratic_phase_error": transmitter.judged(1)[0],
            "receiver.quadratic_phase_error": receiver.judged(1)[0],
            "mission.quadratic_phase_error": every.judged(1)[0],
            "mission.cubic_phase_error": np.abs(every.cubic[0]),
            "mission.location_error": every.moved[0],
        }
        assert {one.id for one in found.requirements} == set(sizes)
        together = np.ones(300, dtype=bool)
        for one in found.requirements:
            assert one.sigma == pytest.approx(math.sqrt(np.mean(sizes[one.id] ** 2)), rel=1e-6)
            assert one.probability == np.mean(sizes[one.id] <= one.limit)
            assert 0 < one.probability < 1
            together &= sizes[one.id] <= one.limit
        assert found.probability == np.mean(together)

    def test_a_climb_known_to_2_m_per_s(self) -> None:
        """Sums of effects would hold far more often: the displaced response has a quadratic phase of its own."""
        found = drawn(30_000, platforms__receiver__motion_error={"velocity": [0, 0, "2 m/s"]})
        one = requirement(found, "mission.quadratic_phase_error")
        assert found.is_exact
        assert one.probability_normal > one.probability + 0.15
        assert "root-sum-square is optimistic" in one.warnings[-1]

    def test_small_errors_stay_sums(self) -> None:
        found = drawn(**{ERROR: {"velocity": "5 mm/s"}})
        assert not found.is_exact
        assert not any("exact ranges" in note for note in found.notes)
        one = requirement(found, "transmitter.quadratic_phase_error")
        assert one.sigma == pytest.approx(one.sigma_rss, rel=4 / math.sqrt(2 * N))

    def test_a_phase_as_such_adds_to_exact_ranges(self) -> None:
        """A bound of 0.5 rad with the sign of each draw's own stream."""
        changes = {"platforms__receiver__motion_error": {"velocity": [0, 0, "2 m/s"]}}
        other = [{"name": "a", "quadratic_phase_error": 0.5}]
        mission = parse_mission(mission_text(**changes, other_errors=other))
        stream = np.random.Generator(np.random.PCG64(np.random.SeedSequence([5, *b"other.a"])))
        alone = np.where(stream.random(200) < 0.5, -0.5, 0.5)
        of_receiver = drawn_by_hand(mission, 200, 5, {"receiver"})
        judged = np.hypot(of_receiver.qpe[0] + alone, of_receiver.hidden[0])
        one = requirement(monte_carlo(Analysis(mission), 200, 5), "mission.quadratic_phase_error")
        assert one.sigma == pytest.approx(math.sqrt(np.mean(judged**2)), rel=1e-6)

    def test_a_draw_without_an_image_holds_nothing(self) -> None:
        """A limit that no image reaches: it holds exactly where there is one, and sigma is that of those."""
        mission = parse_mission(
            mission_text(timing_error={"constant": "100 us"}, requirements={"location_error": "1000 km"})
        )
        moved = drawn_by_hand(mission, 80, 5, {"clock"}).moved[0]
        has_image = np.isfinite(moved)
        assert 0.1 < has_image.mean() < 0.9
        found = monte_carlo(Analysis(mission), 80, 5)
        one = requirement(found, "mission.location_error")
        assert one.probability == has_image.mean()
        assert one.sigma == pytest.approx(math.sqrt(np.mean(moved[has_image] ** 2)), rel=1e-6)
        assert (one.sum, one.rss) == (None, None)
        assert found.probability <= one.probability

    def test_no_draw_has_an_image(self, run) -> None:
        """Both platforms 100 km too high or too low. It was written as 0 m, and as no JSON at all."""
        error = {"position": [0, 0, "100 km"], "distribution": "bound"}
        text = mission_text(common_motion_error=error, requirements={"location_error": "1 m"})
        result = run("check", "-", "--monte-carlo", 100, "--format", "json", input=text)
        drawn = json.loads(result.stdout)["missions"][0]["monte_carlo"]
        assert drawn["probability"] == 0
        for one in drawn["requirements"]:
            assert (one["sum"], one["rss"], one["sigma"], one["probability"]) == (None, None, None, 0)
        assert "no image" in run("check", "-", "--monte-carlo", 100, input=text).stdout


class TestReproducible:
    changes = {
        ERROR: {"position": "1 m", "velocity": "20 mm/s", "distribution": "uniform"},
        "platforms__receiver__motion_error": {"frame": "look", "acceleration": "50 ug", "distribution": "bound"},
        "common_motion_error": {"velocity": "5 mm/s"},
        "timing_error": {"quadratic": 3e-13},
        "requirements": {"location_error": "1 m"},
    }

    def test_same_seed_same_result_other_seed_another(self) -> None:
        assert drawn(50_000, 7, **self.changes) == drawn(50_000, 7, **self.changes)
        assert drawn(50_000, 8, **self.changes).probability != drawn(50_000, 7, **self.changes).probability

    def test_the_seed_is_the_file_s_own_if_none_is_given(self) -> None:
        assert drawn(1000, **self.changes).seed == 1
        assert drawn(1000, **self.changes, simulation__seed=5) == drawn(1000, 5, **self.changes)

    @pytest.mark.parametrize("block", [1000, 12_345, 1 << 20])
    def test_blocks_do_not_matter(self, monkeypatch, block: int) -> None:
        want = drawn(40_000, **self.changes)
        monkeypatch.setattr(drawing, "BLOCK_DRAWS", block)
        got = drawn(40_000, **self.changes)
        for a, b in zip(want.requirements, got.requirements, strict=True):
            assert b.probability == a.probability
            assert b.sigma == pytest.approx(a.sigma, rel=1e-8)
        assert got.probability == want.probability

    def test_draws_of_a_chunk_are_those_of_its_stream(self, monkeypatch) -> None:
        """The first is seeded by seed and name, the others are children of it; of two and a half, drawn by hand."""
        monkeypatch.setattr(drawing, "CHUNK_DRAWS", 4000)
        found = drawn(10_000, 7, **{ERROR: {"acceleration": [3e-4, 0, 0]}})
        name = b"transmitter.acceleration.x"
        seeds = (np.random.SeedSequence([7, *name], spawn_key=key) for key in ((), (257,), (258,)))
        chunks = [np.random.Generator(np.random.PCG64(one)).standard_normal(4000) for one in seeds]
        phases = 3e-4 * BEND * np.concatenate(chunks)[:10_000]
        one = requirement(found, "transmitter.quadratic_phase_error")
        assert one.probability == np.mean(np.abs(phases) <= math.pi / 8)
        assert one.sigma == pytest.approx(math.sqrt(np.mean(phases**2)), rel=1e-6)  # as BEND is known

    def test_the_sum_of_many_chunks_has_the_probability_of_one(self, monkeypatch) -> None:
        """Alike streams of two chunks would make the interval too narrow: 400 of them would hold alike."""
        monkeypatch.setattr(drawing, "CHUNK_DRAWS", N // 400)
        found = drawn(timing_error={"quadratic": math.pi / 8 / small("timing.quadratic")[0]})
        holds_like(requirement(found, "receiver.quadratic_phase_error"), phi(1))

    def test_chunks_of_one_error_are_not_those_of_one_with_a_longer_name(self) -> None:
        """A child of `other.a` is none of `other.aa`: what tells a child is no byte of a name."""
        long = stream_of("other.aa", 0, 64)
        assert not any(np.array_equal(long, stream_of("other.a", chunk, 64)) for chunk in range(1, 256))

    @pytest.mark.parametrize("piece", [100, 250])
    def test_pieces_of_a_chunk_do_not_matter(self, monkeypatch, piece: int) -> None:
        """Each made by itself: normal, uniform and two-sided streams go past the draws before it."""
        monkeypatch.setattr(drawing, "CHUNK_DRAWS", 500)
        other = [{"name": "a", "quadratic_phase_error": 0.3}]
        analysis = Analysis(parse_mission(mission_text(**TestLargeErrors.changes, other_errors=other)))
        want = monte_carlo(analysis, 1200, 5)
        assert want.is_exact
        monkeypatch.setattr(drawing, "EXACT_PIECE_DRAWS", piece)

        def apart(one: drawing.Drawing):
            pieces = list(one.pieces())
            assert [piece.stop for piece in pieces][-1] == 1200
            return [(piece, drawing.Drawer(one).tally(piece)) for piece in reversed(pieces)]

        assert monte_carlo(analysis, 1200, 5, apart) == want == monte_carlo(analysis, 1200, 5)

    def test_sums_join_in_any_order(self) -> None:
        """0.1 + 0.2 + 0.3 is another float than 0.3 + 0.2 + 0.1."""
        tallies = [drawing.Tally((1,), (1,), (square,), 1) for square in (0.1, 0.2, 0.3)]
        assert sum(one.squares[0] for one in tallies) != sum(one.squares[0] for one in reversed(tallies))
        assert drawing.joined(tallies, 1) == drawing.joined(reversed(tallies), 1)
        holds, _, all_hold = drawing.joined([], 1)
        assert (holds, all_hold) == ([0], 0)

    def test_compiled_draws_are_the_same(self, monkeypatch) -> None:
        """To the last bit; tails, which one draw in 3700 is in, included."""
        pytest.importorskip("numba", reason="the extra `fast` is not installed")
        want = drawn(100_000, 7, **self.changes)
        monkeypatch.setattr(drawing, "_MIN_COMPILED_DRAWS", 1)
        assert drawn(100_000, 7, **self.changes) == want
        plain, compiled = np.empty(1_000_000), np.empty(1_000_000)
        for fill, out in ((drawing._fill_normal, plain), (drawing._compiled(), compiled)):
            fill(np.random.default_rng(1), out)
        assert np.array_equal(plain, compiled)
        assert np.abs(plain).max() > 3.66  # where the tail of NumPy's method begins

    def test_an_error_of_nothing_is_not_drawn(self) -> None:
        (taken,) = drawings(**{ERROR: {"acceleration": [1e-3, 0, 0]}})
        assert [variable.id for variable in taken.variables] == ["transmitter.acceleration.x"]

    def test_another_error_in_the_file_changes_no_draw_of_this_one(self) -> None:
        alone = drawn(**{ERROR: {"velocity": "20 mm/s"}})
        beside = drawn(**{ERROR: {"velocity": "20 mm/s"}}, platforms__receiver__motion_error={"velocity": "9 mm/s"})
        name = "transmitter.quadratic_phase_error"
        assert requirement(alone, name) == requirement(beside, name)

    def test_memory_does_not_grow_with_the_number(self) -> None:
        mission = parse_mission(mission_text(**self.changes))
        peaks = []
        for count in (100_000, 1_000_000):
            tracemalloc.start()
            monte_carlo(Analysis(mission), count)
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
        assert peaks[1] < 1.1 * peaks[0] < 40e6

    @pytest.mark.parametrize("count", [0, -1, MAX_DRAWS + 1])
    def test_a_number_out_of_range(self, count: int) -> None:
        with pytest.raises(ValueError, match="must be from 1 to"):
            drawn(count)


distributions = st.sampled_from(["normal", "uniform", "bound"])


@examples(40)
@given(st.floats(0, 1e4), st.floats(0, 100), distributions, st.integers(1, 60), st.integers(0, 2**53))
def test_any_error_gives_probabilities_in_order(position, velocity, distribution, count, seed) -> None:
    error = {"position": position, "velocity": velocity, "distribution": distribution}
    found = drawn(count, seed, **{ERROR: error}, requirements={"location_error": 1, "cubic_phase_error": 0.1})
    for one in found.requirements:
        assert 0 <= one.probability_low <= one.probability <= one.probability_high <= 1
        assert 0 <= one.probability_normal <= 1
        assert (one.rss is None) == (one.sum is None)
        assert one.rss is None or 0 <= one.rss <= one.sum * (1 + 1e-9)
    json.dumps([one._asdict() for one in found.requirements], allow_nan=False)
    assert found.probability <= min(one.probability for one in found.requirements)


class TestCommand:
    @pytest.fixture
    def file(self, tmp_path):
        path = tmp_path / "m.yaml"
        path.write_text(mission_text(**TestReproducible.changes), encoding="utf-8")
        return path

    def test_json(self, run, file) -> None:
        document = json.loads(run("check", file, "--format", "json", "--monte-carlo", "1e4", "--seed", 3).stdout)
        found = document["missions"][0]["monte_carlo"]
        assert (found["draws"], found["seed"], found["model"], found["confidence"]) == (10_000, 3, "full", 0.95)
        names = [one["id"] for one in found["requirements"]]
        assert names[0] == "transmitter.quadratic_phase_error"
        assert set(found["requirements"][0]) == set(Requirement._fields)
        plain = json.loads(run("check", file, "--format", "json").stdout)["missions"][0]
        assert plain["monte_carlo"] is None
        assert plain["rows"] == document["missions"][0]["rows"]

    def test_text_says_it_and_fits_80_columns(self, run, file) -> None:
        text = run("check", file, "--monte-carlo", 20_000).stdout
        part = text[text.index("Monte Carlo:") :]
        assert "20,000 draws, seed 1, full model" in part
        assert "holds in" in part
        assert max(len(line) for line in part.splitlines() if str(file) not in line) <= 80

    def test_same_bytes(self, run, file) -> None:
        texts = {run("check", file, "--monte-carlo", 70_000, "--format", "json").stdout for _ in range(2)}
        assert len(texts) == 1

    def test_other_formats_and_the_exit_code_do_not_change(self, run, file) -> None:
        for name in ("csv", "junit", "sarif", "github", "needs"):
            with_draws = run("check", file, "--format", name, "--monte-carlo", 100)
            assert with_draws.stdout == run("check", file, "--format", name).stdout
        assert with_draws.exit_code == run("check", file).exit_code
        assert run("check", "-q", file, "--monte-carlo", 100).stdout == run("check", "-q", file).stdout

    @pytest.mark.parametrize("given", ["0", "-5", "1.5", "nan", "inf", "1e13", "many", ""])
    def test_a_number_that_is_none(self, run, file, given: str) -> None:
        result = run("check", file, "--monte-carlo", given)
        assert result.exit_code == 2
        assert "whole number of draws from 1 to 1,000,000,000" in result.stderr
        assert result.stdout == ""

    def test_a_seed_without_draws(self, run, file) -> None:
        result = run("check", file, "--seed", 3)
        assert result.exit_code == 2
        assert "--monte-carlo" in result.stderr

    def test_nothing_declared(self, run) -> None:
        text = run("check", "-", "--monte-carlo", 100, input=mission_text()).stdout
        assert "no requirement limits a declared error" in text

    def test_defaults_of_a_project_and_the_environment(self, run, project) -> None:  # noqa: F811
        project(table("monte-carlo = 1000\nseed = 9"))
        assert "1,000 draws, seed 9" in run("check", "m.yaml").stdout
        environment = {"BISAR_BUDGET_MONTE_CARLO": "2e3", "BISAR_BUDGET_SEED": "4"}
        assert "2,000 draws, seed 4" in run("check", "m.yaml", env=environment).stdout
        assert "1,000 draws, seed 5" in run("check", "m.yaml", "--seed", "5").stdout
        project(table("monte-carlo = 0"))
        assert "monte-carlo" in run("check", "m.yaml").stderr
        project(table('monte-carlo = "1e6"'))
        assert "must be a whole number" in run("check", "m.yaml").stderr
        # A seed that is always there is no mistake where nothing is drawn.
        project(table("seed = 9"))
        assert run("check", "m.yaml").exit_code == 0
