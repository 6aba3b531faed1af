"""What a chip of the image says about phase, displacement and smear, against exact ranges and brute force."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.image_plane import nodes
from bisar_budget.mission.load import parse_mission
from bisar_budget.ranges.exact_ranges import ExactEffect
from bisar_budget.simulator.collection import PointCollection
from bisar_budget.simulator.phase_history import Errors, PathError, cell_centres, superposed
from bisar_budget.verifier.aperture_reading import _distance, _squares, measured_shift, read_aperture
from bisar_budget.verifier.limits import verify_mission
from tests.conftest import examples, mission_text
from tests.simulate.conftest import collection

pytestmark = pytest.mark.extras


def point_collection(squint_deg: float, receiver_squint_deg: float | None = None, **changes) -> PointCollection:
    """Section V, each platform turned by a squint."""
    turned = {
        "transmitter": collection(squint_deg).geometry.transmitter,
        "receiver": collection(squint_deg if receiver_squint_deg is None else receiver_squint_deg).geometry.receiver,
    }
    platforms = {
        name: {"position": list(state.position), "velocity": list(state.velocity)} for name, state in turned.items()
    }
    mission = parse_mission(mission_text(platforms=platforms, **changes))
    return PointCollection(mission, mission.geometry)


def chips(c: PointCollection, errors: Errors, **size):
    effect = c.effect(errors)
    return effect, *c.pair(errors, effect.displacement, **size)


def phases(c: PointCollection, errors: Errors):
    effect, chip, reference = chips(c, errors)
    return effect, read_aperture(c, errors, effect.displacement, chip, reference)[:2]


@pytest.mark.parametrize(
    ("squint", "platform", "axis", "image"),
    [(0, "receiver", 1, 1.69), (30, "receiver", 1, 2.11), (30, "transmitter", 0, 1.73), (45, "transmitter", 0, 1.82)],
)
def test_image_of_four_times_the_published_limit(squint: float, platform: str, axis: int, image: float) -> None:
    """Independent brute force measured these, by (4), for limits that promise π/2; images and ranges must agree."""
    c = point_collection(squint)
    state = getattr(c.geometry, platform)
    limit = c.wavelength * state.slant_range / (4 * abs(state.velocity[axis]) * 36)
    velocity = [0.0, 0.0, 0.0]
    velocity[axis] = 4 * limit
    effect, (quadratic, _) = phases(c, Errors().of(platform, PathError(velocity=tuple(velocity))))
    assert abs(quadratic) == pytest.approx(image, rel=0.02)  # two digits behind the point, another fit
    assert quadratic == pytest.approx(effect.quadratic, rel=0.01)


component = st.floats(-1, 1)
triple = st.tuples(component, component, component)


@given(
    squint=st.floats(-45, 45),
    receiver_squint=st.floats(-45, 45),
    velocity=triple,
    acceleration=triple,
    clock=component,
    who=st.sampled_from(["transmitter", "receiver"]),
)
@examples(15)
def test_measured_phases_are_those_of_exact_ranges(
    squint, receiver_squint, velocity, acceleration, clock, who
) -> None:
    c = point_collection(squint, receiver_squint)
    assume(math.degrees(c.geometry.gradient_angle) > 15)
    error = PathError(velocity=tuple(0.03 * v for v in velocity), acceleration=tuple(5e-4 * a for a in acceleration))
    errors = Errors(clock=(0.0, 0.0, 1e-12 * clock, 0.0)).of(who, error)
    effect, (quadratic, cubic) = phases(c, errors)
    assert quadratic == pytest.approx(effect.quadratic, rel=0.01, abs=0.005)
    assert cubic == pytest.approx(effect.cubic, rel=0.02, abs=0.005)


def test_a_long_aperture_bends_frequency_over_time() -> None:
    """±0.3 rad of turn: read over spatial frequency, 0.257 rad look like more and grow a cubic."""
    platforms = {
        "transmitter": {"position": [180, 0, 87], "velocity": [0, 5, 0]},
        "receiver": {"position": [130, 60, 45], "velocity": [0, 5, 0]},
    }
    radar = {"center_frequency": "1.65 GHz", "bandwidth": "80 MHz"}
    mission = parse_mission(mission_text(platforms=platforms, radar=radar, collection={"aperture_time": 20}))
    c = PointCollection(mission, mission.geometry)
    # 2π f₀ t̃₂ (T/2)² = π/8, of which the image takes up a part: 80 MHz do not resolve what the turn does.
    clock = Errors(clock=(0.0, 0.0, 1 / (16 * 1.65e9 * 100), 0.0))
    effect, (quadratic, cubic) = phases(c, clock)
    assert effect.quadratic == pytest.approx(brute_force_phase(c, clock, 2), rel=1e-4)
    assert effect.quadratic < 0.7 * math.pi / 8
    assert quadratic == pytest.approx(effect.quadratic, abs=read_to(c, effect))
    assert cubic == pytest.approx(effect.cubic, abs=1e-3)


def read_to(c: PointCollection, effect: ExactEffect) -> float:
    """Accuracy of a phase in an image: 1e-3 of it, and the change of a hidden one over half the band. [rad]"""
    return 1e-3 * abs(effect.quadratic) + effect.hidden * c.radar.bandwidth / (2 * c.radar.center_frequency)


LONG = {
    "radar": {"center_frequency": "430 MHz", "bandwidth": "30 MHz"},
    "platforms": {
        "transmitter": {"position": [9e3, 0, 3e3], "velocity": [0, 80, 0]},
        "receiver": {"position": [6e3, 6e3, 3e3], "velocity": [-50, 50, 0]},
    },
}


def brute_force_phase(c: PointCollection, errors: Errors, order: int) -> float:
    """Quadratic of the polynomial nearest to what exact ranges leave, sample by sample, at the displaced point.

    The point is that of the least variance of the phase over aperture and band, by Gauss and Newton on differences.
    """
    half = c.aperture_time / 2
    band = (c.radar.bandwidth / c.radar.center_frequency) ** 2 / 12

    def left(point, times):
        flown = c.flight(errors, times).paths
        legs = [np.linalg.norm(p.actual, axis=1) - np.linalg.norm(p.measured - [*point, 0.0], axis=1) for p in flown]
        return sum(legs) + SPEED_OF_LIGHT_MPS * c.flight(errors, times).clock

    place = cell_centres(2.0, 4001)
    times, point = half * place, np.zeros(2)
    for _ in range(10):
        columns = np.stack(
            [(left(point + step, times) - left(point - step, times)) / 2 for step in np.eye(2)], axis=1
        )
        weighted = (1 + band) * columns - columns.mean(axis=0)
        point -= np.linalg.solve(weighted.T @ columns, weighted.T @ left(point, times))
    phase = 2 * math.pi / c.wavelength * left(point, times)
    return float(np.polyfit(place, phase, order)[order - 2])


class TestLongAperture:
    """430 MHz, lines of sight turning by ±0.5 rad: 30 MHz do not resolve all that the turn does."""

    ERRORS = {
        "transmitter acceleration": Errors(transmitter=PathError(acceleration=(2.55e-5, 0, 0))),
        "receiver acceleration": Errors(receiver=PathError(acceleration=(3.6e-5, 0, 0))),
        "receiver velocity": Errors(receiver=PathError(velocity=(0, 2.2e-3, 0))),
    }

    @pytest.mark.parametrize("errors", ERRORS.values(), ids=ERRORS)
    @pytest.mark.parametrize("aperture_time", [1.0, 24.0, 120.0, 160.0])
    def test_exact_ranges_give_the_best_fit_over_the_aperture(self, aperture_time: float, errors: Errors) -> None:
        mission = parse_mission(mission_text(**LONG, collection={"aperture_time": aperture_time}))
        c = PointCollection(mission, mission.geometry)
        effect = c.effect(errors)
        room = 1e-4 * (abs(effect.quadratic) + effect.hidden) + 1e-6  # 4001 samples, and the nodes, for an integral
        for order in (2, 3):  # the cubic is free or not: it is odd
            assert effect.quadratic == pytest.approx(brute_force_phase(c, errors, order), abs=room)

    @pytest.mark.parametrize("errors", ERRORS.values(), ids=ERRORS)
    def test_images_show_it(self, errors: Errors) -> None:
        mission = parse_mission(mission_text(**LONG, collection={"aperture_time": 120}))
        c = PointCollection(mission, mission.geometry)
        effect, (quadratic, _) = phases(c, errors)
        assert quadratic == pytest.approx(effect.quadratic, abs=read_to(c, effect))

    def test_published_limits_are_conservative(self) -> None:
        """Table II promises 0.393 rad: true at the midpoint; over the aperture the image loses as by 0.196 rad."""
        mission = parse_mission(mission_text(**LONG, collection={"aperture_time": 120}))
        (row,) = verify_mission(mission, "transmitter.acceleration.x").rows
        assert row.budget_rad == pytest.approx(0.3927, abs=1e-4)
        c = PointCollection(mission, mission.geometry)
        errors = Errors(transmitter=PathError(acceleration=(row.boundary_error, 0, 0)))
        assert row.predicted_qpe_rad == pytest.approx(abs(brute_force_phase(c, errors, 2)), rel=1e-4)
        assert row.measured_qpe_rad == pytest.approx(row.predicted_qpe_rad, abs=read_to(c, c.effect(errors)))
        assert row.measured_equal_loss_qpe_rad == pytest.approx(row.equal_loss_qpe_rad, rel=0.01)
        assert row.verdict == "conservative"


def test_the_best_quadratic_takes_up_its_share_of_higher_powers() -> None:
    """6/7 of a fourth and 5/7 of a sixth power; a fit of second and of third order give the same."""
    place = np.linspace(-1, 1, 20001)
    coefficients = np.array([0.3, -1.0, 0.4, 0.7, -0.2, 0.5, 0.1])
    quadratic, cubic = 0.4 - 0.2 * 6 / 7 + 0.1 * 5 / 7, 0.7 + 0.5 * 10 / 9
    for sampling in map(nodes, (6, 10, 16, 32, 64)):
        places, fit = sampling.places, sampling.fit
        there = np.polynomial.polynomial.polyval(places, coefficients)
        assert there @ fit[2] == pytest.approx(quadratic, rel=1e-12)
        assert there @ fit[3] == pytest.approx(cubic, rel=1e-12)
        assert np.ones(len(places)) @ fit[2] == pytest.approx(0, abs=1e-12)  # a constant alone
    phase = np.polynomial.polynomial.polyval(place, coefficients)
    for order in (2, 3):
        fit = np.polynomial.polynomial.polyfit(place, phase, order)
        assert fit[2] == pytest.approx(quadratic, abs=1e-3)  # samples to the very edge


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_clock_terms_have_the_sign_of_the_range_error(order: int) -> None:
    """Each scaled to 1 rad at the aperture edge; constant and linear ones only displace."""
    c = point_collection(20)
    size = 1 / (2 * math.pi * c.radar.center_frequency * (c.aperture_time / 2) ** order)
    clock = tuple(size if index == order else 0.0 for index in range(4))
    _, (quadratic, cubic) = phases(c, Errors(clock=clock))
    assert quadratic == pytest.approx(1.0 if order == 2 else 0.0, abs=0.005)
    assert cubic == pytest.approx(1.0 if order == 3 else 0.0, abs=0.01)


class TestShift:
    def test_displacement_is_that_of_exact_ranges(self) -> None:
        """The chip is put elsewhere on purpose: what it shows plus where it lies is where the point went."""
        c = point_collection(15)
        errors = Errors().of("receiver", PathError(position=(1.0, -2.0, 0.5), velocity=(0.02, 0.01, 0.0)))
        effect = c.effect(errors)
        beside = (effect.displacement[0] + 0.6, effect.displacement[1] - 0.4)
        chip, reference = c.pair(errors, beside, range_cells=12)
        shift = measured_shift(chip, reference)
        assert shift.displacement == pytest.approx((-0.6, 0.4), abs=0.01)  # 2 % of a cell

    @pytest.mark.parametrize(("squint", "receiver_squint"), [(0, 0), (30, 30), (-20, 40)])
    def test_smear_lies_along_31(self, squint: float, receiver_squint: float) -> None:
        c = point_collection(squint, receiver_squint)
        errors = Errors().of("receiver", PathError(acceleration=(0.0, 6e-4, 0.0)))
        _, chip, reference = chips(c, errors, range_cells=12)
        want = (c.geometry.look_azimuth + math.pi / 2) % math.pi
        assert math.degrees(measured_shift(chip, reference).smear_azimuth - want) == pytest.approx(0, abs=0.5)

    def test_smear_is_where_the_outline_of_a_large_one_lies(self) -> None:
        """At 3π the -6 dB outline shows the line itself: second moments of a magnitude image, no spectrum."""
        c = point_collection(0)
        errors = Errors().of("receiver", PathError(acceleration=(0.0145, 0.0, 0.0)))
        effect, chip, reference = chips(c, errors, range_cells=12, cells=80)
        assert abs(effect.quadratic) > 2.9 * math.pi
        magnitude = np.abs(chip.image)
        places = chip.grid[magnitude > magnitude.max() / 2][:, :2]
        east, north = np.linalg.eigh(np.cov(places.T))[1][:, -1]
        outline = math.degrees(math.atan2(north, east)) % 180
        assert math.degrees(measured_shift(chip, reference).smear_azimuth) == pytest.approx(outline, abs=1)

    def test_an_image_without_the_response_is_refused(self) -> None:
        c = point_collection(0)
        chip = c.chip((0.0, 0.0), Errors(), range_cells=12)
        empty = chip._replace(image=np.zeros_like(chip.image))
        with pytest.raises(ValueError, match="not in the image"):
            measured_shift(chip, empty)


def test_superposed_errors_add_along_the_whole_path() -> None:
    tau = cell_centres(6.0, 16)
    c = point_collection(10)
    a = Errors(clock=(1e-9, 0.0, 0.0, 0.0)).of("receiver", PathError(position=(1.0, 2.0, 3.0)))
    b = Errors(clock=(0.0, 1e-12, 0.0, 0.0)).of("receiver", PathError(velocity=(0.1, 0.2, 0.3)))
    both = superposed([a, b])
    errors = [path.measured - path.actual for one in (a, b, both) for path in c.flight(one, tau).paths]
    assert np.allclose(errors[5], errors[1] + errors[3])
    assert np.allclose(c.flight(both, tau).clock, 1e-9 + 1e-12 * tau)


def test_a_taylor_window_is_honoured() -> None:
    """-35 dB sidelobes, mainlobe wider by the window's own factor, and the same quadratic phase."""
    from bisar_budget.simulator.impulse_response import impulse_response

    tapered = point_collection(0, simulation={"window": "taylor"})
    uniform = point_collection(0)
    widths = {}
    for name, c in (("taylor", tapered), ("uniform", uniform)):
        chip = c.chip((0.0, 0.0), Errors())
        widths[name] = impulse_response(chip.cut, chip.spacing[1])
    assert widths["taylor"].pslr_db == pytest.approx(-35.2, abs=0.5)
    assert widths["taylor"].irw_m / widths["uniform"].irw_m == pytest.approx(1.19 / 0.886, rel=0.02)
    errors = Errors().of("receiver", PathError(acceleration=(6e-4, 0.0, 0.0)))
    effect, (quadratic, _) = phases(tapered, errors)
    assert quadratic == pytest.approx(effect.quadratic, rel=0.01)


class TestRoom:
    def test_too_few_pulses_alias(self) -> None:
        c = point_collection(0, collection__pulses=95)
        with pytest.raises(ValueError, match="aliases below 96 pulses"):
            c.chip((0.0, 0.0), Errors())
        point_collection(0, collection__pulses=96).chip((0.0, 0.0), Errors())

    def test_memory_limit_names_what_is_needed(self) -> None:
        c = point_collection(0, simulation={"memory_limit": "1 MB"})
        with pytest.raises(ValueError, match=r"needs about [\d.]+ MB, simulation.memory_limit is 1 MB"):
            c.chip((0.0, 0.0), Errors())

    def test_a_patch_of_a_thousand_cells_is_the_largest(self) -> None:
        with pytest.raises(ValueError, match="at most 1024 are formed"):
            point_collection(0).chip((0.0, 0.0), Errors(), cells=1025)


def test_the_middle_of_a_chip_keeps_its_centre() -> None:
    """Refocused responses are read from the middle of a large patch alone."""
    mission = parse_mission(mission_text())
    whole = PointCollection(mission, mission.geometry).chip(
        (3.0, -2.0), Errors(), scatterer=(3.0, -2.0), cells=96, range_cells=4
    )
    part = whole.within(48)
    assert part.image.shape == (whole.image.shape[0], 120)
    for chip in (whole, part):
        place = (chip.image.shape[0] // 2, chip.image.shape[1] // 2)
        assert chip.grid[place][:2] == pytest.approx((3.0, -2.0), abs=1e-9)
        assert np.unravel_index(np.argmax(np.abs(chip.image)), chip.image.shape) == place
        assert chip.cut[place[1]] == chip.image[place]
    assert whole.within(200) is whole


@pytest.mark.parametrize("slant_range", [3e2, 7e5, 3.7e7])
def test_distances_are_right_to_a_hundredth_of_a_degree_of_phase(slant_range: float) -> None:
    """They come from a product of matrices, whose squares cancel; 1e-8 m are 0.004° at Ku-band."""
    random = np.random.default_rng(1)
    positions = random.normal(size=(20, 3))
    positions *= slant_range / np.linalg.norm(positions, axis=1)[:, None]
    points = np.column_stack((random.uniform(-100, 100, (30, 2)), np.zeros(30)))
    exact = np.linalg.norm(positions[:, None] - points, axis=2)
    assert np.abs(_distance(positions, points, _squares(points)) - exact).max() < 2e-8
