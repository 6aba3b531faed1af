"""Lever arms, time tags and common errors against brute force: drawn or flown here, sent through exact ranges.

Nothing of the tool's own courses is used: paths are polynomials written out, axes of the body are made of the
velocity, what turns turns by a cross product. Histories go through `followed`, which tests of exact ranges hold.
"""

import math

import numpy as np
import pytest

from bisar_budget.analysis.analysis import Analysis, Case
from bisar_budget.analysis.scene import differences_at
from bisar_budget.analysis.variables import Variable
from bisar_budget.effects.random_effect import RandomError, SensorCases
from bisar_budget.effects.random_errors import random_errors
from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.ranges.exact_ranges import (
    FINE_NODE_COUNT,
    NO_SHIFTS,
    ExactRanges,
    ImagePoints,
    aperture_nodes,
    followed,
)
from bisar_budget.sampling.draws import HeldSum, Sums, drawing_of
from bisar_budget.verifier.study import Study
from tests.image_point import Collection, Path, Response, flight, no_error

DRAWS = 40_000  # know a sigma to 0.35 %
SIGMA = 0.01
EXACT = 0.005

# The level turn of 4 m/s² at 50 m/s, the transmitter that of Section V.
TURN = """
schema_version: 1
name: a turn
radar: {center_frequency: 10 GHz, bandwidth: 300 MHz}
collection: {aperture_time: 4 s}
platforms:
  transmitter: {position: [30.41 km, 0 m, 6 km], velocity: [0 m/s, 150 m/s, 0 m/s]}
  receiver:
    position: [5 km, 0 km, 1.5 km]
    velocity: [30 m/s, 40 m/s, 0 m/s]
    acceleration: [-3.2 m/s^2, 2.4 m/s^2, 0 m/s^2]
    motion_error: ERROR
COMMON
requirements: {location_error: 10 m, islr: -20 dB}
"""
P, V, A = np.array([5e3, 0, 1.5e3]), np.array([30.0, 40, 0]), np.array([-3.2, 2.4, 0])
PT, VT = np.array([30.41e3, 0, 6e3]), np.array([0.0, 150, 0])
FROM_CENTRE = P + np.array([0, 0, 6371e3])
FORCE = A + 3.986004418e14 * FROM_CENTRE / np.linalg.norm(FROM_CENTRE) ** 3
ARM = np.array([2.0, 0.3, -0.5])
T = 4.0
TIMES = aperture_nodes(T)


def mission_of(error: str = "{}", common: str = "") -> Mission:
    return parse_mission(TURN.replace("ERROR", error).replace("COMMON", common))


def found_of(mission: Mission, row_id: str) -> RandomError:
    return next(one for one in Analysis(mission).random if one.id == row_id)


def body(times: np.ndarray) -> np.ndarray:
    """Along, cross and up of the velocity of the turn, (times, 3 axes, 3)."""
    along = V + A * times[:, None]
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    cross = np.cross([0.0, 0, 1], along)
    cross = cross / np.linalg.norm(cross, axis=1, keepdims=True)
    return np.stack((along, cross, np.cross(along, cross)), axis=1)


def arm(times: np.ndarray) -> np.ndarray:
    """The arm along the axes of the scene, (times, 3)."""
    return np.einsum("a,tad->td", ARM, body(times))


def through(mission: Mission, receiver: np.ndarray | None, transmitter: np.ndarray | None = None) -> ImagePoints:
    """Effects of histories of position errors, (draws, nodes, 3) each."""
    exact = ExactRanges.of(mission.geometry.both, mission.radar, T, FINE_NODE_COUNT)
    draws = len(receiver if receiver is not None else transmitter)
    shifts = [NO_SHIFTS if one is None else np.ascontiguousarray(one.T) for one in (transmitter, receiver)]
    return followed(exact, np.zeros((FINE_NODE_COUNT, draws)), shifts, np.zeros(draws, dtype=int))


def agrees(error: RandomError, found: ImagePoints, rel: float = SIGMA) -> None:
    drawn = np.array((found.quadratic, found.cubic, found.east, found.north))
    computed = np.array(error.full[:2] + error.full[3:5]) * error.declared
    sigmas = np.sqrt(np.square(drawn).mean(axis=1))
    assert sigmas[:2] == pytest.approx(computed[:2], rel=rel, abs=1e-6)
    assert sigmas[2:] == pytest.approx(computed[2:], rel=rel, abs=1e-7)
    away = np.abs(drawn @ drawn.T / drawn.shape[1] - error.full.covariance[:4, :4] * error.declared**2)
    assert np.all(away <= 3 * rel * np.multiply.outer(sigmas, sigmas) + 1e-12)


class TestLeverArm:
    """ψ × R(τ)·l and R(τ)·δl, with all that the same ψ does."""

    @staticmethod
    def swings(psi: np.ndarray) -> np.ndarray:
        """ψ × R(τ)·l of tilts (draws, 1 or nodes, 3)."""
        return np.cross(psi, arm(TIMES))

    def test_attitude_through_the_arm_alone(self) -> None:
        """Each axis by itself, so that nothing is drawn: 0.5 % of exact ranges."""
        arm_text = f"lever_arm: {{arm: [{ARM[0]} m, {ARM[1]} m, {ARM[2]} m]}}"
        for axis in range(3):
            sizes = ["0 rad"] * 3
            sizes[axis] = "2 mrad"
            mission = mission_of(f"{{imu: {{attitude: [{', '.join(sizes)}]}}, {arm_text}}}")
            error = found_of(mission, "receiver.lever_arm.attitude")
            assert (error.unit, error.declared) == ("rad", 2e-3)
            agrees(error, through(mission, self.swings(2e-3 * np.eye(3)[axis][None, None])), EXACT)

    @pytest.mark.parametrize("figure", ["attitude", "gyro_bias", "angle_random_walk"])
    def test_the_row_of_a_figure_has_both_that_it_does(self, figure: str) -> None:
        """One ψ turns the specific force and swings the arm: drawn as one, not as two powers."""
        size = {"attitude": "0.3 mrad", "gyro_bias": "20 deg/h", "angle_random_walk": "0.05 deg/sqrt(h)"}[figure]
        text = f"{{frame: track, imu: {{{figure}: {size}}}, lever_arm: {{arm: [{ARM[0]}, {ARM[1]}, {ARM[2]}]}}}}"
        mission = mission_of(text)
        error = found_of(mission, f"receiver.imu.{figure}")
        rng = np.random.default_rng(5)
        if figure == "angle_random_walk":
            tilt, twice = walks(rng)
        else:
            order = 0 if figure == "attitude" else 1
            drawn = rng.standard_normal((DRAWS, 1, 3))
            tilt = drawn * (TIMES**order)[:, None]
            twice = drawn * (TIMES ** (order + 2) / math.factorial(order + 2))[:, None]
        axes = body(np.zeros(1))[0]
        tilt, twice = tilt @ axes * error.declared, twice @ axes * error.declared
        moved = np.cross(twice, FORCE) + self.swings(tilt)
        agrees(error, through(mission, moved))

    def test_powers_of_both_ways_would_be_wrong(self) -> None:
        """Heading of the turn: through specific force and a cross arm the displacements go together."""
        text = "{imu: {attitude: [0 rad, 0 rad, 5 mrad]}, lever_arm: {arm: [0 m, 2 m, 0 m]}}"
        mission = mission_of(text)
        whole = found_of(mission, "receiver.imu.attitude")
        part = found_of(mission, "receiver.lever_arm.attitude")
        bare = found_of(mission_of("{imu: {attitude: [0 rad, 0 rad, 5 mrad]}}"), "receiver.imu.attitude")
        powers = math.hypot(part.full.displacement, bare.full.displacement)
        assert abs(whole.full.displacement / powers - 1) > 0.1
        assert part.counted_in == whole.id

    def test_the_tilt_that_walks_spreads_through_the_arm(self) -> None:
        """What is left after the cubic, the line of sight held, against 4000 walks of 1025 moments."""
        mission = mission_of("{imu: {angle_random_walk: 1 deg/sqrt(h)}, lever_arm: {arm: [0 m, 0 m, 20 m]}}")
        error = found_of(mission, "receiver.imu.angle_random_walk")
        rng, count = np.random.default_rng(8), 512
        step = T / 2 / count
        sides = rng.standard_normal((2, 4000, count, 3)) * math.sqrt(step)
        after, before = (np.concatenate([np.zeros((4000, 1, 3)), one.cumsum(axis=1)], axis=1) for one in sides)
        tilt = np.concatenate([before[:, :0:-1], after], axis=1)
        t = np.linspace(-T / 2, T / 2, 2 * count + 1)
        twice = []
        for side in (before, after):
            area = side
            for _ in range(2):
                steps = (area[:, 1:] + area[:, :-1]) * step / 2
                area = np.concatenate([np.zeros((4000, 1, 3)), steps.cumsum(axis=1)], axis=1)
            twice.append(area)
        moved = np.concatenate([twice[0][:, :0:-1], twice[1]], axis=1)
        look = P / np.linalg.norm(P)
        at_middle = np.array([0.0, 0, 20])
        x = (np.cross(moved, FORCE) + np.cross(tilt, at_middle)) @ look * error.declared
        legendre = np.polynomial.legendre.legvander(2 * t / T, 3)
        left = x - x @ np.linalg.pinv(legendre).T @ legendre.T
        k = 2 * math.pi / mission.radar.wavelength
        rms = k * math.sqrt(np.square(left).mean())
        assert error.full.spread * error.declared == pytest.approx(rms, rel=0.01)

    def test_uncertainty(self) -> None:
        """Each axis of the body by itself."""
        for axis in range(3):
            sizes = ["0 m"] * 3
            sizes[axis] = "5 mm"
            mission = mission_of(f"{{lever_arm: {{uncertainty: [{', '.join(sizes)}]}}}}")
            error = found_of(mission, "receiver.lever_arm.uncertainty")
            assert (error.unit, error.declared) == ("m", 5e-3)
            agrees(error, through(mission, 5e-3 * body(TIMES)[:, axis][None]), EXACT)

    def test_uncertainty_of_three_axes_adds_as_squares(self) -> None:
        mission = mission_of("{lever_arm: {uncertainty: [5 mm, 2 mm, 8 mm]}}")
        error = found_of(mission, "receiver.lever_arm.uncertainty")
        assert error.declared == 8e-3
        drawn = np.random.default_rng(3).standard_normal((DRAWS, 3)) * [5e-3, 2e-3, 8e-3]
        agrees(error, through(mission, np.einsum("na,tad->ntd", drawn, body(TIMES))))

    def test_without_a_turn_it_is_a_position_error(self) -> None:
        text = TURN.replace("[-3.2 m/s^2, 2.4 m/s^2, 0 m/s^2]", "[0, 0, 0]").replace("COMMON", "")
        mission = parse_mission(
            text.replace("ERROR", "{frame: track, position: 5 mm, lever_arm: {uncertainty: 5 mm}}")
        )
        analysis = Analysis(mission)
        (error,) = analysis.random
        sources = [one for one in analysis.stated if one.subject.kind == "position"]
        qpe = math.sqrt(sum((one.full.qpe * one.declared) ** 2 for one in sources))
        assert error.full.quadratic * error.declared == pytest.approx(qpe, rel=1e-6)
        assert error.published.quadratic == 0.0  # and no limit out of rounding

    def test_a_still_platform_has_the_axes_of_the_scene(self) -> None:
        text = TURN.replace(
            "[30 m/s, 40 m/s, 0 m/s]\n    acceleration: [-3.2 m/s^2, 2.4 m/s^2, 0 m/s^2]", "[0, 0, 0]"
        )
        text = text.replace("ERROR", "{imu: {attitude: 1 mrad}, lever_arm: {arm: [0 m, 0 m, 2 m]}}")
        mission = parse_mission(text.replace("COMMON", ""))
        error = found_of(mission, "receiver.lever_arm.attitude")
        drawn = np.random.default_rng(4).standard_normal((DRAWS, 1, 3)) * 1e-3
        moved = np.broadcast_to(np.cross(drawn, [0.0, 0, 2]), (DRAWS, FINE_NODE_COUNT, 3))
        agrees(error, through(mission, moved))

    def test_an_arm_of_nothing_changes_nothing(self) -> None:
        with_arm = mission_of("{imu: {attitude: 1 mrad, gyro_bias: 1 deg/h}, lever_arm: {arm: [0, 0, 0]}}")
        bare = mission_of("{imu: {attitude: 1 mrad, gyro_bias: 1 deg/h}}")
        for kind in ("attitude", "gyro_bias"):
            one, other = (found_of(mission, f"receiver.imu.{kind}") for mission in (with_arm, bare))
            for model in ("published", "full"):
                assert one.effect(model)[:5] == pytest.approx(other.effect(model)[:5], rel=1e-6, abs=1e-9)
        assert found_of(with_arm, "receiver.lever_arm.attitude").full[:5] == (0, 0, 0, 0, 0)


def walks(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """White noise of density 1 summed up from mid-aperture on, and twice integrated, at the nodes, (draws, nodes, 3).

    What of it is smooth, up to order 12: between the nodes a walk is not. A walk is the sum of what each step of the
    noise does alone.
    """
    count = 200
    step = T / 2 / count
    fine = np.linspace(-T / 2, T / 2, 2 * count + 1)
    basis = np.polynomial.legendre.legvander(2 * fine / T, 12)
    at_nodes = np.polynomial.legendre.legvander(2 * TIMES / T, 12) @ np.linalg.pinv(basis)
    area = np.zeros((count, count + 1))  # by each step
    np.cumsum(np.eye(count) * math.sqrt(step), axis=1, out=area[:, 1:])
    walk = area
    for _ in range(2):
        steps = (area[:, 1:] + area[:, :-1]) * step / 2
        area = np.concatenate([np.zeros((count, 1)), steps.cumsum(axis=1)], axis=1)
    noise = rng.standard_normal((3, DRAWS, 2 * count))
    none = np.zeros((count, count))
    tilt, twice = (
        noise @ (np.block([[one[:, :0:-1], np.zeros((count, 1)), none], [none, one]]) @ at_nodes.T)
        for one in (walk, area)
    )
    return np.moveaxis(tilt, 0, 2), np.moveaxis(twice, 0, 2)


class TestTimeTag:
    """p(τ + δt) − p(τ)."""

    @pytest.mark.parametrize(
        ("name", "moved"),
        [("transmitter", 6.6e-2), ("receiver", 3.9e-2)],  # a millisecond, as the theory quotes it of Section V
    )
    def test_section_v(self, name: str, moved: float) -> None:
        text = """
schema_version: 1
name: Section V
radar: {center_frequency: 10 GHz, bandwidth: 300 MHz}
collection: {aperture_time: 6 s}
platforms:
  transmitter: {position: [30.41 km, 0 m, 6 km], velocity: [0 m/s, 150 m/s, 0 m/s]TX}
  receiver:
    {slant_range: 8.5 km, azimuth: 45 deg, elevation: 13.6 deg, speed: 60 m/s, motion_azimuth: 135 deg RX}
"""
        said = ", motion_error: {time_tag: 1 ms}"
        text = text.replace("TX" if name == "transmitter" else "RX", said).replace("TX", "").replace("RX", "")
        analysis = Analysis(parse_mission(text))
        source = next(one for one in analysis.stated if one.id == f"{name}.time_tag")
        east, north = Case(analysis).does(analysis.full, source).displacement
        assert math.hypot(east, north) == pytest.approx(moved, abs=0.05e-2)

    def test_a_turn(self) -> None:
        """22 cm and −0.055 rad for a millisecond."""
        analysis = Analysis(mission_of("{time_tag: 1 ms}"))
        source = next(one for one in analysis.stated if one.id == "receiver.time_tag")
        does = Case(analysis).does(analysis.full, source)
        assert math.hypot(*does.displacement) == pytest.approx(0.22, abs=0.005)
        assert does.qpe == pytest.approx(-0.055, abs=0.001)
        exact = through(analysis.mission, flown(1e-3)[None])
        assert does.qpe == pytest.approx(exact.quadratic[0], rel=EXACT)
        assert does.cubic == pytest.approx(exact.cubic[0], rel=EXACT)
        assert does.displacement == pytest.approx((exact.east[0], exact.north[0]), rel=EXACT)

    @pytest.mark.parametrize("sign", ["", "-"])
    def test_it_has_a_sign(self, sign: str) -> None:
        analysis = Analysis(mission_of(f"{{time_tag: {sign}1 ms}}"))
        (source,) = analysis.stated
        does, size = Case(analysis).does(analysis.full, source), float(f"{sign}1e-3")
        exact = through(analysis.mission, flown(size)[None])
        assert does.displacement == pytest.approx((exact.east[0], exact.north[0]), rel=EXACT)

    def test_an_allowable_is_true_of_exact_ranges(self) -> None:
        """First order is off by 4 % there."""
        analysis = Analysis(mission_of("{time_tag: 1 ms}"))
        (source,) = analysis.stated
        size, binding = analysis.full.allowed(source, (math.pi / 8, None, None))
        assert binding == "quadratic_phase_error"
        phases = [abs(through(analysis.mission, flown(signed)[None]).quadratic[0]) for signed in (size, -size)]
        assert max(phases) == pytest.approx(math.pi / 8, rel=EXACT)

    def test_a_low_orbit_moves_by_seven_to_eight_metres(self) -> None:
        text = """
schema_version: 1
name: low orbit
radar: {center_frequency: 9.65 GHz, bandwidth: 150 MHz}
collection: {aperture_time: 0.5 s}
platforms:
  transmitter:
    slant_range: 650 km
    azimuth: 0 deg
    elevation: 50 deg
    speed: 7.6 km/s
    motion_azimuth: 90 deg
    acceleration: [-0.511 m/s^2, 0, -8.401 m/s^2]
    motion_error: {time_tag: 1 ms}
  receiver: {position: [1.5 km, 0.5 km, 400 m], velocity: [0, 0, 0]}
"""
        analysis = Analysis(parse_mission(text))
        (source,) = analysis.stated
        assert 7 < math.hypot(*Case(analysis).does(analysis.full, source).displacement) < 8

    def test_the_published_model_has_its_tables_along_velocity_and_acceleration(self) -> None:
        """Table II by hand: a velocity error of a·δt, k·(T/2)²·(a·v)/R, which in a level turn is nothing."""
        text = TURN.replace("[-3.2 m/s^2, 2.4 m/s^2, 0 m/s^2]", "[1 m/s^2, 2 m/s^2, 0 m/s^2]").replace("COMMON", "")
        (source,) = Analysis(parse_mission(text.replace("ERROR", "{time_tag: 1 ms}"))).stated
        k = 2 * math.pi / (299_792_458 / 10e9)
        assert abs(source.effect.qpe) == pytest.approx(k * 4 * (30 * 1 + 40 * 2) / np.linalg.norm(P), rel=1e-9)
        assert source.effect.constant == pytest.approx(-(P @ V) / np.linalg.norm(P), rel=1e-9)

    def test_one_clock_tags_both(self) -> None:
        mission = mission_of(common="common_motion_error: {time_tag: 1 ms}")
        analysis = Analysis(mission)
        (source,) = analysis.stated
        assert source.id == "common.time_tag"
        does = Case(analysis).does(analysis.full, source)
        late = np.broadcast_to(VT * 1e-3, (1, FINE_NODE_COUNT, 3))
        exact = through(mission, flown(1e-3)[None], late)
        assert does.displacement == pytest.approx((exact.east[0], exact.north[0]), rel=EXACT)
        assert does.qpe == pytest.approx(exact.quadratic[0], rel=EXACT)


class TestLargeTimeTags:
    """Tags of any size take the path itself: an independent reference flies the turn, without expansion."""

    SIZES = (0.1, 0.3, 1.0)

    @pytest.mark.parametrize("size", SIZES)
    @pytest.mark.parametrize("sign", [1, -1])
    def test_of_one_platform(self, size: float, sign: int) -> None:
        """v·δt alone is off by 1.5 m of 52 m, by 1 s."""
        does = self.does(f"{{time_tag: {sign * size} s}}")
        found = [late(receiver=one) for one in (sign * size, -sign * size)]
        assert does.displacement == pytest.approx(found[0].point, rel=1e-6)
        assert does.opposite == pytest.approx(found[1].point, rel=1e-6)
        assert does.equal_loss == pytest.approx(max(one.equal_loss_rad for one in found), rel=1e-6)
        assert abs(does.qpe) == pytest.approx(max(abs(one.quadratic_rad) for one in found), rel=1e-6)
        assert abs(does.cubic) == pytest.approx(max(abs(one.cubic_rad) for one in found), rel=1e-6)

    @pytest.mark.parametrize("size", SIZES)
    def test_of_both_platforms(self, size: float) -> None:
        does = self.does("{}", f"common_motion_error: {{time_tag: {size} s}}")
        assert does.displacement == pytest.approx(late(size, size).point, rel=1e-6)
        assert does.opposite == pytest.approx(late(-size, -size).point, rel=1e-6)

    @pytest.mark.parametrize("binds", ["location_error: 5 m", "quadratic_phase_error: 170 deg"])
    def test_an_allowable_is_the_size_that_reaches_the_limit(self, binds: str) -> None:
        needs = ", ".join({binds, "quadratic_phase_error: 170 deg"})
        mission = parse_mission(of_turn("{time_tag: 1 ms}", needs=f"{{{needs}}}"))
        (source,) = (analysis := Analysis(mission)).stated
        total, location = analysis.allocation.qpe_allowed("receiver"), mission.requirements.location_error
        size, binding = analysis.full.allowed(source, (total, None, location))
        found = [late(receiver=one) for one in (size, -size)]
        reached = {
            "location_error": max(np.linalg.norm(one.point) for one in found) / (location or math.inf),
            "quadratic_phase_error": max(one.equal_loss_rad for one in found) / total,
        }
        assert binding == binds.split(":")[0]
        assert reached.pop(binding) == pytest.approx(1, rel=1e-4)
        assert max(reached.values()) < 1

    def test_where_the_direct_path_is_the_clock(self) -> None:
        common = "common_motion_error: {time_tag: 0.3 s}\nsynchronization: {method: direct_path, error: 1 deg}"
        analysis = Analysis(mission_of(common=common))
        exact = ExactRanges.of(
            analysis.geometry.both, analysis.mission.radar, T, FINE_NODE_COUNT, has_direct_path=True
        )
        shifts = [list((path(TIMES + 0.3) - path(TIMES)).T[..., None]) for path in (flight(PT, VT), flight(P, V, A))]
        found = followed(exact, np.zeros((FINE_NODE_COUNT, 1)), shifts, np.zeros(1, dtype=int))
        (does,) = (Case(analysis).does(analysis.full, one) for one in analysis.stated)
        assert does.displacement == pytest.approx((found.east[0], found.north[0]), rel=1e-6)

    def test_at_the_edge_of_a_scene(self) -> None:
        """It takes the path itself there too."""
        (difference,) = differences(parse_mission(of_turn("{time_tag: 0.3 s}", "scene: {radius: 800 m}")))
        edge = [late(receiver=one, scatterer=(0.0, 800.0)).quadratic_rad for one in (0.3, -0.3)]
        centre = [late(receiver=one).quadratic_rad for one in (0.3, -0.3)]
        assert abs(difference) == pytest.approx(np.abs(np.subtract(edge, centre)).max(), rel=1e-5)

    def test_drawn_tags_of_a_platform_and_of_both_add(self) -> None:
        analysis = Analysis(mission_of("{time_tag: 0.6 s}", "common_motion_error: {time_tag: 0.3 s}"))
        variables = [
            Variable(one.id, one.id, "mission", "bound", ((one, float(one.declared)),), (1.0,) * 4)
            for one in analysis.stated
        ]
        held = HeldSum("mission.location_error", "m", 1.0, ("mission",), (2, 3))
        sums = Sums(drawing_of(analysis, variables, [held], 4, 1), 4, adds=False, keeps_motion=True)
        for variable, drawn in zip(variables, ([1.0, 1, -1, -1], [1.0, -1, 1, -1]), strict=True):
            sums.add(variable, np.array(drawn))
        wanted = [late(tx, rx).point for tx, rx in ((0.3, 0.9), (-0.3, 0.3), (0.3, -0.3), (-0.3, -0.9))]
        assert np.sqrt(sums.exact_square(held)) == pytest.approx(np.linalg.norm(wanted, axis=1), rel=1e-6)

    def test_images_are_of_the_same_motion(self) -> None:
        """An image flies the path itself, as before; `check` says the same now."""
        study = Study(mission_of("{time_tag: 1 s}"))
        (source,) = (one for one in study.sources if one.id == "receiver.time_tag")
        assert study.effect([(source, 1.0)]).displacement == pytest.approx(late(receiver=1.0).point, rel=1e-6)
        assert self.does("{time_tag: 1 s}").displacement == pytest.approx(late(receiver=1.0).point, rel=1e-6)

    @staticmethod
    def does(error: str, common: str = ""):
        analysis = Analysis(parse_mission(of_turn(error, common)))
        (source,) = analysis.stated
        return Case(analysis).does(analysis.full, source)


def of_turn(error: str, common: str = "", needs: str = "{location_error: 10 m, islr: -20 dB}") -> str:
    text = TURN.replace("ERROR", error).replace("COMMON", common)
    return text.replace("{location_error: 10 m, islr: -20 dB}", needs)


def late(transmitter: float = 0.0, receiver: float = 0.0, scatterer: tuple[float, float] = (0.0, 0.0)) -> Response:
    """Where the image of the turn peaks if paths are taken for what they are later by so much, and what is left."""

    def from_there(path: Path) -> Path:
        return lambda times: path(times) - np.array([*scatterer, 0.0])

    paths = from_there(flight(PT, VT)), from_there(flight(P, V, A))
    tags = (transmitter, receiver)
    errors = tuple(
        (lambda times, path=path, tag=tag: path(times + tag) - path(times)) if tag else no_error
        for path, tag in zip(paths, tags, strict=True)
    )
    return Collection(10e9, 300e6, T, paths, errors).least_variance_point()


def flown(late: float) -> np.ndarray:
    """p(τ + δt) − p(τ) of the turn at the nodes, (nodes, 3)."""

    def place(tau: np.ndarray) -> np.ndarray:
        return P + V * tau[:, None] + A * tau[:, None] ** 2 / 2

    return place(TIMES + late) - place(TIMES)


class TestCommonFrames:
    """The same components in each platform's own axes."""

    @staticmethod
    def axes(frame: str) -> tuple[np.ndarray, np.ndarray]:
        """Axes of transmitter and receiver, (3 axes, 3) each."""
        found = []
        for first in (VT, V) if frame == "track" else (PT, P):
            one = first / np.linalg.norm(first)
            two = np.cross([0.0, 0, 1], one)
            two = two / np.linalg.norm(two)
            found.append(np.array((one, two, np.cross(one, two))))
        return found[0], found[1]

    @pytest.mark.parametrize("frame", ["track", "look"])
    @pytest.mark.parametrize(("kind", "size", "power"), [("position", 2.0, 0), ("velocity", 2e-2, 1)])
    def test_each_axis(self, frame: str, kind: str, size: float, power: int) -> None:
        unit = "m" if kind == "position" else "m/s"
        mission = mission_of(common=f"common_motion_error: {{frame: {frame}, {kind}: {size} {unit}}}")
        analysis = Analysis(mission)
        names = {"track": ("along", "cross", "up"), "look": ("line_of_sight", "cross", "up")}[frame]
        assert [one.id for one in analysis.stated] == [f"common.{kind}.{name}" for name in names]
        course = size * TIMES**power
        for source, of_tx, of_rx in zip(analysis.stated, *self.axes(frame), strict=True):
            exact = through(mission, (course[:, None] * of_rx)[None], (course[:, None] * of_tx)[None])
            does = Case(analysis).does(analysis.full, source)
            assert does.displacement == pytest.approx((exact.east[0], exact.north[0]), rel=EXACT, abs=1e-4)
            # Linear where the second order does not matter, which is off by less than 1 %.
            assert does.qpe == pytest.approx(exact.quadratic[0], rel=0.01, abs=2e-3)

    def test_an_allowable_is_true_of_exact_ranges(self) -> None:
        mission = mission_of(common="common_motion_error: {frame: track, position: 1 m}")
        analysis = Analysis(mission)
        source = next(one for one in analysis.stated if one.id == "common.position.along")
        size, _ = analysis.full.allowed(source, (math.pi / 8, None, None))
        of_tx, of_rx = (axes[0] for axes in self.axes("track"))
        course = np.ones((1, FINE_NODE_COUNT, 1))
        phases = [
            abs(through(mission, signed * course * of_rx, signed * course * of_tx).quadratic[0])
            for signed in (size, -size)
        ]
        assert max(phases) == pytest.approx(math.pi / 8, rel=EXACT)

    def test_the_scene_is_one_vector(self) -> None:
        (x, *_) = Analysis(mission_of(common="common_motion_error: {position: [1 m, 0, 0]}")).stated
        assert x.id == "common.position.x"
        assert (x.full.qpe, x.full.cubic) == (0, 0)

    @pytest.mark.parametrize("frame", ["scene", "track"])
    def test_noise_of_both(self, frame: str) -> None:
        """Gauss-Markov noise by its recursion: the same of both platforms, along the axes of each."""
        sigma, time = [0.01, 0.005, 0.02], 1.5
        said = f"random: [{{name: GNSS, sigma: [1 cm, 5 mm, 2 cm], correlation_time: {time} s}}]"
        mission = mission_of(common=f"common_motion_error: {{frame: {frame}, {said}}}")
        error = found_of(mission, "common.random.GNSS")
        fine, rng = np.linspace(-T / 2, T / 2, 401), np.random.default_rng(6)
        decay = math.exp(-(fine[1] - fine[0]) / time)
        draws = 20_000
        drawn = rng.standard_normal((fine.size, draws, 3))
        for index in range(1, fine.size):
            drawn[index] = decay * drawn[index - 1] + math.sqrt(1 - decay**2) * drawn[index]
        # Up to order 12: between the nodes noise is not smooth.
        basis = np.polynomial.legendre.legvander(2 * fine / T, 12)
        at_nodes = np.polynomial.legendre.legvander(2 * TIMES / T, 12) @ np.linalg.pinv(basis)
        noise = np.tensordot(at_nodes, drawn, axes=1).swapaxes(0, 1) * sigma
        of_tx, of_rx = (np.eye(3), np.eye(3)) if frame == "scene" else self.axes("track")
        found = through(mission, noise @ of_rx, noise @ of_tx)
        # 20 000 draws know a sigma to 0.5 %.
        agrees(error, found, 0.015)


class TestCourses:
    """`SensorCases.of_courses` against sums written out."""

    def test_both_models(self) -> None:
        mission = mission_of("{position: 1 m}")
        seen = SensorCases(mission, mission.geometry, 1)
        t = seen.exact.times
        held = np.array([1 + 0 * t, t, t**2 - t**3 / 5])
        courses = held * (1 + 0.05 * t)
        published, full = seen.of_courses(courses, held)
        k = 2 * math.pi / mission.radar.wavelength
        # Of t² − t³/5 over ±2 s: P₂ of t² has 4·2/3, at the edge 3/2 of it; P₃ of t³/5 has 8/5·2/5, 5/2 of it.
        assert published.quadratic == pytest.approx(4 * k)
        assert published.cubic == pytest.approx(8 / 5 * k)
        fine = ExactRanges.of(mission.geometry.both, mission.radar, T, FINE_NODE_COUNT)
        x = TIMES[:, None]
        every = np.stack([1 + 0 * x, x, x**2 - x**3 / 5], axis=1)[..., 0] * 1e-4 * (1 + 0.05 * x)
        found = followed(fine, every, (NO_SHIFTS, NO_SHIFTS), np.zeros(3, dtype=int))
        for one, drawn in zip((*full[:2], *full[3:5]), found[3:5] + found[1:3], strict=True):
            assert 1e-4 * one == pytest.approx(math.sqrt(np.square(drawn).sum()), rel=2e-3)

    def test_what_cancels_is_nothing(self) -> None:
        mission = mission_of("{position: 1 m}")
        seen = SensorCases(mission, mission.geometry, 1)
        constant = np.ones((1, *seen.exact.times.shape))
        published, full = seen.of_courses(constant, constant)
        assert (published.quadratic, published.cubic) == (0, 0)
        assert full.quadratic > 0  # it displaces, which defocuses

    def test_many_cases_are_each_as_one(self) -> None:
        text = "{time_tag: 1 ms, imu: {attitude: 1 mrad}, lever_arm: {arm: [1, 2, 3], uncertainty: 5 mm}}"
        from bisar_budget.mission.quantities import with_number

        mission, values = mission_of(text), np.array([-2.0, 0.0, 0.5, 4.0])
        key = "platforms.receiver.motion_error.lever_arm.arm.0"
        many = with_number(mission, key, values)
        together = random_errors(many, many.geometry, values.size)
        for case, value in enumerate(values.tolist()):
            alone = random_errors(with_number(mission, key, value))
            for one, other in zip(together, alone, strict=True):
                assert one.id == other.id
                for model in ("published", "full"):
                    of_case = [np.broadcast_to(part, values.shape)[case] for part in one.effect(model)[:5]]
                    assert of_case == pytest.approx(other.effect(model)[:5], rel=1e-9, abs=1e-12)


class TestOtherPlaces:
    """Where else errors that turn, or have two directions, are looked at."""

    def test_at_the_edge_of_a_scene_a_time_tag_of_a_straight_path_is_a_position_error(self) -> None:
        level = TURN.replace("[-3.2 m/s^2, 2.4 m/s^2, 0 m/s^2]", "[0, 0, 0]").replace(
            "COMMON", "scene: {radius: 800 m}"
        )
        texts = ("{time_tag: 0.1 ms}", "{position: [3 mm, 4 mm, 0]}")
        edges = [differences(parse_mission(level.replace("ERROR", one))) for one in texts]
        assert sum(edges[0]) == pytest.approx(sum(edges[1]), rel=1e-6)
        assert abs(sum(edges[0])) > 1e-6

    def test_at_the_edge_of_a_scene_that_of_a_turn_is_position_and_velocity(self) -> None:
        """v·δt and a·δt, signed: to first order the differences add."""
        turn = TURN.replace("COMMON", "scene: {radius: 800 m}")
        (tag,) = differences(parse_mission(turn.replace("ERROR", "{time_tag: 10 us}")))
        both = "{position: [0.3 mm, 0.4 mm, 0 m], velocity: [-32 um/s, 24 um/s, 0 m/s]}"
        assert tag == pytest.approx(sum(differences(parse_mission(turn.replace("ERROR", both)))), rel=1e-5)

    @pytest.mark.parametrize("said", ["frame: track, position: 2 m", "frame: look, position: 2 m", "time_tag: 1 ms"])
    def test_with_a_direct_path(self, said: str) -> None:
        """Other vectors for both platforms change their distance, which then is the clock."""
        link = "synchronization: {method: direct_path, error: 1 deg}"
        mission = mission_of(common=f"common_motion_error: {{{said}}}\n{link}")
        analysis = Analysis(mission)
        exact = ExactRanges.of(mission.geometry.both, mission.radar, T, FINE_NODE_COUNT, has_direct_path=True)
        frame = said.split(",")[0].removeprefix("frame: ")
        for index, source in enumerate(analysis.stated):
            if "time_tag" in said:
                of_tx, of_rx = np.broadcast_to(VT * 1e-3, (FINE_NODE_COUNT, 3)), flown(1e-3)
            else:
                of_tx, of_rx = (
                    2.0 * np.tile(one[index], (FINE_NODE_COUNT, 1)) for one in TestCommonFrames.axes(frame)
                )
            shifts = [np.ascontiguousarray(one[None].T) for one in (of_tx, of_rx)]
            found = followed(exact, np.zeros((FINE_NODE_COUNT, 1)), shifts, np.zeros(1, dtype=int))
            does = Case(analysis).does(analysis.full, source)
            assert does.displacement == pytest.approx((found.east[0], found.north[0]), rel=EXACT, abs=1e-4)
            assert does.qpe == pytest.approx(found.quadratic[0], rel=0.01, abs=2e-3)


def differences(mission: Mission) -> list[float]:
    """Phase of each declared error 800 m north of the centre, less that there. [rad]"""
    return [phase for _, phase in differences_at(Analysis(mission).errors, 800.0, math.pi / 2)]
