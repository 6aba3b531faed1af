"""Rise, culmination and set against Skyfield's events, and against the elevation itself, second by second."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from bisar_budget.mission.load import parse_mission
from bisar_budget.mission.paths import orbits_of
from bisar_budget.mission.platforms import OrbitSource
from bisar_budget.paths.earth import Geodetic, axes_at
from bisar_budget.paths.flight import Orbit, PathFileError
from bisar_budget.paths.instant import Instant
from bisar_budget.paths.visibility import OrbitGap, Stretch, Watched, shared
from tests.conftest import mission_text
from tests.paths.orbit_files import CENTER, LINE_1, LINE_2, TLE, checked, oem

BESANCON = Geodetic(math.radians(47.2512), math.radians(5.9938), 360.0)
LEAST = math.radians(20)
DAY = 86400.0


def elements(inclination: float, eccentricity: float, perigee: float, anomaly: float, turns: float) -> str:
    """An element set of the epoch of `LINE_1`; angles in degrees, the mean motion in turns a day."""
    return (
        f"{LINE_1}\n"
        + checked(
            f"2 39634 {inclination:8.4f} 159.9312 {round(eccentricity * 1e7):07d} {perigee:8.4f} {anomaly:8.4f} "
            f"{turns:11.8f}539990"
        )
        + "\n"
    )


MOLNIYA = elements(63.4, 0.7, 270, 10, 2.00612)
GEOSTATIONARY = elements(0.05, 0.0002, 30, 200, 1.00273791)
TRANSFER = elements(28, 0.725, 10, 5, 2.28)  # perigee 200 km high
LOW = elements(51.6, 0.001, 20, 40, 16.3)  # 190 km high, without drag


MISSION = parse_mission(mission_text(), "m.yaml")


def of_file(form: str, data: bytes) -> Callable[[Instant], Orbit]:
    """The orbit around an instant that a mission flies which names a file of a form."""
    return orbits_of(MISSION, OrbitSource(**{form: f"an.{form}"}), lambda _: data)


def of_elements(text: str) -> Callable[[Instant], Orbit]:
    return of_file("tle", text.encode())


def watched(text: str, days: float, place: Geodetic = BESANCON, start: Instant = CENTER) -> Watched:
    return Watched.over(of_elements(text), axes_at(place), start, days * DAY)


def skyfield_altitudes(text: str, place: Geodetic, start: Instant, times: Sequence[float]) -> np.ndarray:
    """Altitudes at times after an instant, without refraction. [deg]"""
    api = pytest.importorskip("skyfield.api")
    scale = api.load.timescale(builtin=True)
    satellite = api.EarthSatellite(*text.splitlines()[-2:], "", scale)
    site = api.wgs84.latlon(math.degrees(place.latitude), math.degrees(place.longitude), place.height)
    moments = scale.from_datetimes([start.after(time).as_datetime() for time in times])
    altitudes: np.ndarray = (satellite - site).at(moments).altaz()[0].degrees
    return altitudes


def skyfield_events(text: str, days: float, place: Geodetic, start: Instant) -> list[tuple[float, int]]:
    """Times [s] and kinds of events, 0 rise, 1 culmination, 2 set; Skyfield's own UT1 is left as it is."""
    api = pytest.importorskip("skyfield.api")
    scale = api.load.timescale(builtin=True)
    satellite = api.EarthSatellite(*text.splitlines()[-2:], "", scale)
    site = api.wgs84.latlon(math.degrees(place.latitude), math.degrees(place.longitude), place.height)
    first = scale.from_datetime(start.as_datetime())
    last = scale.from_datetime(start.after(days * DAY).as_datetime())
    times, kinds = satellite.find_events(site, first, last, altitude_degrees=math.degrees(LEAST))
    moments = [(time.utc_datetime() - start.as_datetime()).total_seconds() for time in times]
    return list(zip(moments, map(int, kinds), strict=True))


@pytest.mark.parametrize(
    ("text", "days", "place", "fewest"),
    [
        (TLE, 3, BESANCON, 7),
        (TLE, 1, Geodetic(math.radians(78.23), math.radians(15.4), 450.0), 9),  # Svalbard sees two of three turns
        (TLE, 3, Geodetic(math.radians(-0.2), math.radians(-78.5), 2850.0), 2),
        (MOLNIYA, 3, BESANCON, 3),
        (LOW, 3, BESANCON, 3),
    ],
    ids=["besancon", "svalbard", "quito", "molniya", "low"],
)
def test_events_are_those_of_skyfield(text: str, days: float, place: Geodetic, fewest: int) -> None:
    """To a second of `find_events`, which looks for them to half a second, and by its altitudes.

    Skyfield turns the Earth by UT1, which is up to 0.9 s from UTC, here it is UTC: that moves a place by 0.4 km,
    which is 0.02 deg at the distance of the nearest orbit.
    """
    seen = watched(text, days, place)
    found: list[tuple[float, int]] = []
    for stretch in seen.above(LEAST):
        found += [(stretch.start, 0)] * stretch.rises + [(seen.culmination(stretch), 1)]
        found += [(stretch.stop, 2)] * stretch.sets
    events = skyfield_events(text, days, place, CENTER)
    # Of a pass that is cut Skyfield says a culmination only where it is within the span.
    assert sum(kind == 0 for _, kind in events) >= fewest
    assert [kind for _, kind in found if kind != 1] == [kind for _, kind in events if kind != 1]
    for kind in (0, 2):
        ours = [time for time, one in found if one == kind]
        theirs = [time for time, one in events if one == kind]
        assert ours == pytest.approx(theirs, abs=1.0)
    edges = [time for time, kind in found if kind != 1]
    assert skyfield_altitudes(text, place, CENTER, edges) == pytest.approx(math.degrees(LEAST), abs=0.02)
    whole = [seen.culmination(one) for one in seen.above(LEAST) if one.rises and one.sets]
    highest = np.array([time for time, kind in events if kind == 1])
    for one in whole:
        # The elevation of a high orbit turns slowly at its top: a second earlier or later nobody sees it.
        assert abs(highest - one).min() < (1.0 if text is not MOLNIYA else 5.0)


def test_a_satellite_that_does_not_set_has_one_stretch_and_where_it_never_rises_none() -> None:
    """Seen from three places around the equator: as Skyfield, which has no rise and no set of it."""
    counts = []
    for longitude in np.arange(0, 2 * math.pi, 2 * math.pi / 3):
        site = Geodetic(math.radians(10), longitude, 0.0)
        there = watched(GEOSTATIONARY, 2, site)
        is_above = there.sine_of_elevation(np.linspace(0, 2 * DAY, 500)) > math.sin(LEAST)
        assert is_above.all() or not is_above.any()
        assert there.above(LEAST) == [Stretch(0.0, 2 * DAY, False, False)] * int(is_above.all())
        assert {kind for _, kind in skyfield_events(GEOSTATIONARY, 2, site, CENTER)} <= {1}
        counts.append(is_above.all())
    assert 0 < sum(counts) < 3


@pytest.mark.parametrize(
    ("text", "metres"),
    [(TLE, 0.02), (LOW, 0.02), (MOLNIYA, 0.2), (TRANSFER, 1.0)],
    ids=["sentinel", "low", "molniya", "gto"],
)
def test_what_is_read_between_samples_is_the_orbit(text: str, metres: float) -> None:
    """To what the remainder of Lagrange's polynomial leaves, and a tenth of that in a second of the velocity."""
    seen, axes, orbit = watched(text, 1.5), axes_at(BESANCON), of_elements(text)(CENTER)
    times = np.random.default_rng(5).uniform(0.05, 1.5 * DAY - 0.05, 300)

    def direct(at: np.ndarray) -> np.ndarray:
        return axes.places(np.array([orbit.place(CENTER.after(time)) for time in at.tolist()]))

    place, velocity = seen.at(times)
    assert np.abs(place - direct(times)).max() < metres
    central = (direct(times + 0.05) - direct(times - 0.05)) / 0.1
    assert np.abs(velocity - central).max() < metres / 10


def test_no_pass_is_missed_and_none_is_there_twice() -> None:
    """Over ten days and random places against the elevation each 10 s, down to passes of a minute."""
    rng = np.random.default_rng(11)
    orbit, days = of_elements(TLE)(CENTER), 10
    orbit = replace(orbit, place=cache(orbit.place))
    times = np.arange(0.0, days * DAY, 10.0)
    greenwich = axes_at(Geodetic(0.0, 0.0, 0.0))
    over_it = Watched.over(lambda _: orbit, greenwich, CENTER, days * DAY)
    earth_fixed = over_it.at(times)[0] @ np.array(greenwich.axes) + greenwich.origin
    count = shortest = 0
    for _ in range(4):
        site = Geodetic(math.asin(rng.uniform(-1, 1)), rng.uniform(-math.pi, math.pi), 0.0)
        axes = axes_at(site)
        seen = Watched.over(lambda _: orbit, axes, CENTER, days * DAY)
        found = seen.above(LEAST)
        assert all(a.stop < b.start for a, b in pairwise(found))
        place = axes.places(earth_fixed)
        is_above = place[:, 2] > np.linalg.norm(place, axis=1) * math.sin(LEAST)
        is_inside = np.zeros(times.size, dtype=bool)
        for one in found:
            is_inside |= (times >= one.start) & (times <= one.stop)
            shortest += one.stop - one.start < 60
        assert (is_above == is_inside).all()
        count += len(found)
    assert count > 60
    assert shortest >= 1


class TestSeveral:
    """Several element sets, segments, and parts of the span that have neither."""

    def test_each_set_is_flown_where_it_is_nearest(self) -> None:
        """As a check at that time flies it: places are those of the orbit that is read for the instant."""
        sets = [
            checked(f"1 39634U 14016A   {day:014.8f}  .00000355  00000+0  84975-4 0  9990")
            for day in (26152.42515188, 26153.7, 26154.3, 26156.1)
        ]
        text = "".join(f"{line}\n{LINE_2}\n" for line in sets)
        seen = Watched.over(of_elements(text), axes_at(BESANCON), CENTER, 4 * DAY)
        assert len(seen.pieces) == 4
        assert not seen.gaps
        epochs = [piece.orbit.epoch for piece in seen.pieces]
        for (a, b), (one, other) in zip(pairwise(epochs), pairwise(seen.pieces), strict=True):
            assert a is not None
            assert b is not None
            assert one.stop == pytest.approx((a.since(CENTER) + b.since(CENTER)) / 2, abs=2e-3)
            assert 0 <= other.start - one.stop < 2e-3
        axes = axes_at(BESANCON)
        for time in np.random.default_rng(3).uniform(0, 4 * DAY, 20).tolist():
            moment = CENTER.after(time)
            direct = axes.place(of_elements(text)(moment).place(moment))
            assert seen.state(time).position == pytest.approx(direct, abs=1e-3)

    def test_an_ephemeris_that_ends_within_the_span_is_said(self) -> None:
        text = ephemeris(CENTER.after(3600.0), 5 * 3600.0)
        seen = Watched.over(of_file("oem", text), axes_at(BESANCON), CENTER, DAY)
        (piece,) = seen.pieces
        assert (piece.start, piece.stop) == (pytest.approx(3600, abs=0.01), pytest.approx(6 * 3600, abs=0.01))
        before, after = seen.gaps
        assert (before.start, before.stop) == (0.0, pytest.approx(3600, abs=0.01))
        assert (after.start, after.stop) == (pytest.approx(6 * 3600, abs=0.01), DAY)
        assert "its useable time is 2026-06-01T06:20:31.250Z to 2026-06-01T11:20:31.250Z" in after.reason

    def test_short_segments_of_a_long_span_are_found(self) -> None:
        """Two of 40 and 30 minutes within 20 days, between which there is nothing."""
        starts = (CENTER.after(7.2 * DAY), CENTER.after(12.7 * DAY))
        one, other = (ephemeris(start, seconds) for start, seconds in zip(starts, (2400.0, 1800.0), strict=True))
        text = one + other[other.index(b"META_START") :]
        seen = Watched.over(of_file("oem", text), axes_at(BESANCON), CENTER, 20 * DAY)
        assert [piece.start for piece in seen.pieces] == pytest.approx([7.2 * DAY, 12.7 * DAY], abs=0.01)
        assert [piece.stop - piece.start for piece in seen.pieces] == pytest.approx([2400, 1800], abs=0.01)
        assert [gap.stop for gap in seen.gaps] == pytest.approx([7.2 * DAY, 12.7 * DAY, 20 * DAY], abs=0.01)

    def test_an_ephemeris_sees_what_its_elements_see(self) -> None:
        text = ephemeris(CENTER, DAY / 2)
        seen = Watched.over(of_file("oem", text), axes_at(BESANCON), CENTER, DAY / 2)
        of_message, of_set = seen.above(LEAST), watched(TLE, 0.5).above(LEAST)
        assert len(of_message) == len(of_set) >= 2
        for one, other in zip(of_message, of_set, strict=True):
            assert (one.start, one.stop) == pytest.approx((other.start, other.stop), abs=0.01)

    def test_a_satellite_that_decays_is_followed_until_then(self) -> None:
        """With so much drag SGP4 has no position from some day on."""
        line = checked("1 39634U 14016A   26151.42515188  .00000355  00000+0  20000-2 0  9990")
        text = f"{line}\n{LOW.splitlines()[1]}\n"
        seen = Watched.over(of_elements(text), axes_at(BESANCON), CENTER, 10 * DAY)
        (piece,), (gap,) = seen.pieces, seen.gaps
        assert 0 < piece.stop == gap.start < gap.stop == 10 * DAY
        assert "SGP4 has no position" in gap.reason

    def test_without_any_orbit_there_is_a_reason(self) -> None:
        def none(_: Instant) -> Orbit:
            raise PathFileError("o.oem: is empty")

        seen = Watched.over(none, axes_at(BESANCON), CENTER, DAY)
        assert (seen.pieces, seen.gaps) == ([], [OrbitGap(0.0, DAY, "o.oem: is empty")])
        assert seen.above(LEAST) == []


def ephemeris(start: Instant, duration_s: float) -> bytes:
    """An OEM in ITRF of the orbit of `TLE`, each minute."""
    orbit = of_elements(TLE)(start)

    def path(seconds: float) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        before, place, after = (orbit.place(start.after(seconds + d)) for d in (-0.5, 0.0, 0.5))
        x, y, z = (b - a for a, b in zip(before, after, strict=True))
        return place, (x, y, z)

    return oem(path=path, times=start.after, count=round(duration_s / 60) + 1).encode()


def test_stretches_that_two_satellites_share() -> None:
    some = [Stretch(0, 10, rises=False), Stretch(20, 30), Stretch(40, 50)]
    others = [Stretch(5, 25), Stretch(28, 29), Stretch(45, 60, sets=False)]
    assert shared(some, others) == [
        Stretch(5, 10),
        Stretch(20, 25),
        Stretch(28, 29),
        Stretch(45, 50),
    ]


def test_the_squint_is_that_of_a_check() -> None:
    seen = watched(TLE, 1)
    for stretch in seen.above(LEAST):
        time = seen.with_squint(stretch, math.radians(2))
        assert time is not None
        assert seen.state(time).squint == pytest.approx(math.radians(2), abs=1e-12)
        assert seen.with_squint(stretch, math.radians(80)) is None
