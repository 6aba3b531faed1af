"""Angles, frames and degenerate geometries, against figures written down by hand."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bisar_budget import geometry as g
from bisar_budget.effects.declared import published_planes
from bisar_budget.image_plane import MIN_SINE, degeneracy, nodes_for, spans_ground
from bisar_budget.mission.model import Radar


def state(position, velocity=(0.0, 100.0, 0.0)) -> g.PlatformState:
    return g.PlatformState(position=position, velocity=velocity)


def both(transmitter, receiver) -> g.BistaticGeometry:
    return g.BistaticGeometry(transmitter=transmitter, receiver=receiver)


def test_angles_of_a_platform() -> None:
    platform = state((-3e3, 3e3, 3e3 * math.sqrt(2)))
    assert platform.slant_range == pytest.approx(6e3)
    assert math.degrees(platform.azimuth) == pytest.approx(135)
    assert math.degrees(platform.elevation) == pytest.approx(45)


@pytest.mark.parametrize(
    ("velocity", "degrees"),
    [((0, 90, 0), 0), ((-90, 0, 0), 90), ((90, 0, 0), -90), ((-50, 50, 0), 45), ((0, 0, 9), 0)],
)
def test_squint_is_positive_looking_forward(velocity, degrees: float) -> None:
    assert math.degrees(state((5e3, 0, 0), velocity).squint) == pytest.approx(degrees, abs=1e-9)


def test_a_still_platform_has_no_squint() -> None:
    assert state((5e3, 0, 0), (0, 0, 0)).squint is None


def test_cardinal_directions_have_no_rounding_left() -> None:
    platform = g.state_from_angles(
        slant_range=8e3, azimuth=math.pi / 2, elevation=0, speed=60, motion_azimuth=math.pi, climb=0
    )
    assert platform.position == (0, 8e3, 0)
    assert platform.velocity == (-60, 0, 0)


def test_speed_is_over_ground_and_climb_its_vertical_part() -> None:
    platform = g.state_from_angles(
        slant_range=8e3, azimuth=0, elevation=0.1, speed=60, motion_azimuth=math.pi / 2, climb=5
    )
    assert platform.velocity == (0, 60, 5)


@pytest.mark.parametrize("climb", [-40.0, 0.0, 25.0])
@pytest.mark.parametrize("position", [(5e3, -2e3, 3e3), (-1e3, 4e3, 6e3)])
def test_a_line_of_sight_turns_as_the_platform_flies(position, climb: float) -> None:
    """Unit vectors a millisecond before and after, along the path: sinking and climbing turn it differently."""
    velocity = (70.0, 110.0, climb)
    step = 1e-3

    def sight(tau: float) -> np.ndarray:
        place = np.array(position) + tau * np.array(velocity)
        return place / np.linalg.norm(place)

    turned = (sight(step) - sight(-step)) / (2 * step)
    assert state(position, velocity).look_rate == pytest.approx(turned, abs=1e-10)


def test_bistatic_angle_and_look_azimuth() -> None:
    pair = both(state((5e3, 0, 0)), state((0, 7e3, 0), (-90, 0, 0)))
    assert math.degrees(pair.bistatic_angle) == pytest.approx(90)
    assert math.degrees(pair.look_azimuth) == pytest.approx(45)


def test_look_azimuth_keeps_its_quadrant() -> None:
    pair = both(state((-5e3, -1e3, 0)), state((-5e3, -2e3, 0)))
    assert math.degrees(pair.look_azimuth) < -90


def test_resolution_of_a_monostatic_pair_is_the_textbook_one() -> None:
    """c/2B over cos(grazing) and λR/2vT at broadside, for Tx = Rx."""
    platform = state((8e3, 0, 6e3))
    pair = both(platform, platform)
    assert pair.range_resolution(300e6, 3e8) == pytest.approx(0.5 / 0.8)
    assert pair.cross_range_resolution(0.03, 5) == pytest.approx(0.03 * 10e3 / (2 * 100 * 5))


def test_track_frame_follows_the_velocity() -> None:
    along, cross, up = state((5e3, 0, 0), (0, 100, 0)).frame("track")
    assert (along, cross, up) == ((0, 1, 0), (-1, 0, 0), (0, 0, 1))


def test_look_frame_points_from_the_scene_to_the_platform() -> None:
    sight, cross, up = state((3e3, 0, 4e3)).frame("look")
    assert sight == pytest.approx((0.6, 0, 0.8))
    assert cross == pytest.approx((0, 1, 0))
    assert up == pytest.approx((-0.8, 0, 0.6))


coordinate = st.floats(-1e4, 1e4)


@given(st.tuples(coordinate, coordinate, st.floats(10, 1e4)), st.tuples(coordinate, coordinate, coordinate))
@example(position=(0.0, 0.0, 10.0), velocity=(0.0, 5e-324, 5e-324))  # the smallest numbers have no direction
def test_every_frame_is_right_handed_and_orthonormal(position, velocity) -> None:
    platform = state(position, velocity)
    for name in ("scene", "track", "look"):
        try:
            a, b, c = platform.frame(name)
        except g.UndefinedFrameError:
            continue
        assert g.cross(a, b) == pytest.approx(c, abs=1e-9)
        for first, second, value in ((a, a, 1), (b, b, 1), (a, b, 0), (a, c, 0), (b, c, 0)):
            assert g.dot(first, second) == pytest.approx(value, abs=1e-9)


@pytest.mark.parametrize(
    ("platform", "frame"),
    [
        (state((5e3, 0, 1), (0, 0, 0)), "track"),
        (state((5e3, 0, 1), (0, 0, 5)), "track"),
        (state((0, 0, 5e3)), "look"),
    ],
)
def test_frames_that_do_not_exist(platform: g.PlatformState, frame: str) -> None:
    with pytest.raises(g.UndefinedFrameError):
        platform.frame(frame)


X_BAND = Radar(center_frequency=10e9, bandwidth=300e6)


@pytest.mark.parametrize(("degrees", "is_degenerate"), [(0.9, True), (1.1, False), (30, False)])
def test_gradients_within_a_degree_of_parallel_are_refused(degrees: float, is_degenerate: bool) -> None:
    """A receiver overhead leaves s = u_t; a transmitter at azimuth 0 turns s by its own cross motion only.

    Range gradient along x from the transmitter; the Doppler gradient from a receiver straight above, whose
    look vector turns along its velocity.
    """
    turn = math.radians(degrees)
    receiver = state((0, 0, 4e3), (100 * math.cos(turn), 100 * math.sin(turn), 0))
    pair = both(state((9e3, 0, 0), (0, 0, 0)), receiver)
    assert math.degrees(pair.gradient_angle) == pytest.approx(degrees)
    reason = degeneracy(pair, X_BAND, 1.0)
    assert bool(reason) == is_degenerate
    assert not is_degenerate or f"{degrees:.2g} deg from parallel" in reason


@pytest.mark.parametrize(("ground", "is_singular"), [(0.019, True), (0.021, False)])
def test_a_short_range_gradient_is_no_plane_for_the_published_model_alone(ground: float, is_singular: bool) -> None:
    """Range along x, Doppler along y: the band tells points along x apart, with a cell of c/(B|s|)."""
    up = math.sqrt(1 - ground**2)
    pair = both(state((1e4 * ground, 0, 1e4 * up), (0, 100, 0)), state((0, 0, 5e3), (0, 80, 0)))
    assert bool(published_planes(pair)[0].is_singular) == is_singular
    assert degeneracy(pair, X_BAND, 1.0) == ""


@pytest.mark.parametrize(
    "pair",
    [
        both(state((5e3, 0, 2e3), (0, 100, 0)), state((-5e3, 0, 2e3), (0, -100, 0))),  # opposite: the sum is 0
        both(state((9e3, 0, 4e3), (0, 0, 0)), state((3e3, 3e3, 4e3), (-30, -30, -40))),  # towards the scene
    ],
    ids=["opposite", "head on"],
)
def test_lines_of_sight_whose_sum_does_not_turn_are_refused(pair: g.BistaticGeometry) -> None:
    assert "Doppler does not change" in degeneracy(pair, X_BAND, 1.0)


def test_doppler_gradients_that_cancel_leave_range_alone() -> None:
    """Both look vectors stay along x but for the square of the turn, which changes them along x."""
    pair = both(state((5e3, 0, 0), (0, 100, 0)), state((5e3, 1e-9, 0), (0, -100, 0)))
    assert "from parallel" in degeneracy(pair, X_BAND, 1.0)


@given(st.lists(st.tuples(*[st.tuples(coordinate, coordinate, st.floats(10, 1e4))] * 5), min_size=1, max_size=4))
def test_many_cases_are_those_of_each(cases) -> None:
    """Numbers of one case make plain floats, and arrays hold the same of each case."""

    def pair(p, v, q, w, bend):
        return g.BistaticGeometry(
            transmitter=g.PlatformState(position=p, velocity=v, acceleration=bend, bends=(bend,)),
            receiver=g.PlatformState(position=q, velocity=w),
        )

    many = pair(*(tuple(np.array(part).T) for part in zip(*cases, strict=True)))
    for index, case in enumerate(cases):
        one = pair(*case)
        for of_one, of_many in zip(numbers(one), numbers(many), strict=True):
            assert type(of_one) in (float, bool, int)
            assert np.broadcast_to(of_many, (len(cases),))[index] == pytest.approx(of_one, rel=1e-9, abs=1e-9)


def test_how_far_a_path_gets_within_a_delay() -> None:
    """p(τ + δ) − p(τ) by hand: 10·2 + 3·(3² − 1²)/2 + 0.5·(3³ − 1³) along x, from 1 s on within 2 s."""
    bent = {"acceleration": (3.0, 0, -9.0), "bends": ((0.5, 0, 0),)}
    path = g.PlatformState(position=(7e6, 0, 5.0), velocity=(10.0, -1.0, 0), **bent)
    assert path.later(1.0, 2.0) == pytest.approx((45.0, -2.0, -36.0))


def test_paths_of_some_cases() -> None:
    many = g.PlatformState(position=(np.arange(3.0), 0, 5.0), velocity=(1.0, np.array([4.0, 5, 6]), 0))
    some = many.of(np.array([2, 0, 2]))
    assert (some.position[0].tolist(), some.position[2]) == ([2, 0, 2], 5.0)
    assert some.velocity[1].tolist() == [6, 4, 6]


def numbers(pair: g.BistaticGeometry):
    """What a geometry says, where platforms are apart."""
    for path in (*pair.both, pair.apart):
        yield from (*path.at(1.5)[0], *path.at(1.5)[1], path.travelled(2.0), path.sinks(2.0), path.is_still)
    for path in pair.both:
        yield from (*path.look, *path.look_rate, path.azimuth, path.elevation)
        yield from (path.has_frame("track"), path.has_frame("look"), path.has_frame("ric"))
    yield from (*pair.range_gradient, *pair.doppler_gradient, pair.bistatic_angle, pair.look_azimuth)
    yield from (nodes_for(pair, 5.0), *pair.sights(has_direct_path=False)[0])


def test_frames_of_many_cases_hold_no_number_where_there_is_none() -> None:
    north, up, still = (0.0, 9.0, 0.0), (0.0, 0.0, 9.0), (0.0, 0.0, 0.0)
    platform = state((5e3, 1e3, 2e3), tuple(np.array([north, up, still]).T))
    assert platform.has_frame("track").tolist() == [True, False, False]
    along, across, _ = np.array(platform.frame("track")).transpose(0, 2, 1)
    assert along[0].tolist() == [0, 1, 0]
    assert across[0].tolist() == [-1, 0, 0]
    assert np.isnan(across[1:]).any(axis=1).all()
    with pytest.raises(g.UndefinedFrameError, match="latitude"):
        platform.frame("ric")


@pytest.mark.parametrize("margin", [1.0, 1.1])
def test_a_case_spans_the_ground_as_said_of_it_alone(margin: float) -> None:
    """Both sides of each border, with and without a margin."""
    turns = np.array([0.99, 1.01, 1.09, 1.11, 30.0])
    angles = np.radians(turns)
    receiver = state((0.0, 0.0, 4e3), (100 * np.cos(angles), 100 * np.sin(angles), 0.0))
    pair = both(state((9e3, 0.0, 0.0), (0.0, 0.0, 0.0)), receiver)
    does_turn, sine = spans_ground(pair, X_BAND, 1.0, len(turns))
    assert does_turn.all()
    assert np.all((sine >= margin * MIN_SINE) == (turns > margin))
    # The receiver flies 12.5 mrad in the half aperture, of which the square is what no angle at its middle knows.
    assert sine == pytest.approx(np.sin(angles), rel=0.0125**2)
    gradients = np.array([0.0199, 0.0201])
    overhead = state((gradients * 9e3, 0.0, np.sqrt(1 - gradients**2) * 9e3))
    assert published_planes(both(overhead, state((0.0, 0.0, 4e3))))[0].is_singular.tolist() == [True, False]
