"""Orbit files of the Sentinels: a real one by an independent interpolation and geodesy, and what is refused."""

import math
import re
from fractions import Fraction
from pathlib import Path

import pytest

from bisar_budget.geometry import Vector
from bisar_budget.paths.accuracy import StatedAccuracy
from bisar_budget.paths.eof import read_eof
from bisar_budget.paths.flight import PathFileError
from bisar_budget.paths.instant import Instant
from tests.paths.orbit_files import instant

DATA = (Path(__file__).parent / "files" / "S1A_RESORB_20230823_excerpt.EOF").read_bytes()
TEXT = DATA.decode()
FIRST, LAST = re.findall(r"<UTC>UTC=(.*)</UTC>", TEXT)[::23]
MIDDLE = instant(f"{FIRST}Z").after(115.0)  # between two state vectors
STEP = 10  # s


def vectors() -> list[tuple[list[Fraction], list[Fraction]]]:
    """Places and velocities as they stand in the file."""
    found = []
    for block in TEXT.split("<OSV>")[1:]:
        numbers = [Fraction(one) for one in re.findall(r'unit="m(?:/s)?">([^<]+)<', block)]
        found.append((numbers[:3], numbers[3:]))
    return found


def krogh(seconds: Fraction) -> Vector:
    """Place so long after the first state vector, by Newton's divided differences with double nodes, exactly. [m]"""
    middle = int(seconds // STEP)
    near = range(middle - 5, middle + 7)  # twelve vectors: of degree 23, where the reader has 7
    nodes = [Fraction(STEP * n) for n in near for _ in range(2)]
    place = []
    for axis in range(3):
        state = vectors()
        table = [state[n][0][axis] for n in near for _ in range(2)]
        slopes = {Fraction(STEP * n): state[n][1][axis] for n in near}
        newton = [table[0]]
        for order in range(1, len(nodes)):
            table = [
                slopes[nodes[i]]
                if order == 1 and nodes[i] == nodes[i + 1]
                else (table[i + 1] - table[i]) / (nodes[i + order] - nodes[i])
                for i in range(len(table) - 1)
            ]
            newton.append(table[0])
        value = Fraction(0)
        for node, one in zip(reversed(nodes), reversed(newton), strict=True):
            value = value * (seconds - node) + one
        place.append(float(value))
    return (place[0], place[1], place[2])


@pytest.mark.parametrize("seconds", ["60", "113.7", "115", "119.999", "160.25"])
def test_places_are_those_of_an_interpolation_of_three_times_the_degree(seconds: str) -> None:
    """To 10 um: the file has micrometres, and velocities to a micrometre a second."""
    at = instant(f"{FIRST}Z").after(float(seconds))
    assert math.dist(read_eof(DATA, "s.EOF", None, MIDDLE).place(at), krogh(Fraction(seconds))) < 1e-5


def test_what_is_said_of_it() -> None:
    orbit = read_eof(DATA, "s.EOF", None, MIDDLE)
    assert orbit.words == "AUX_RESORB of Sentinel-1A, Hermite degree 7"
    assert orbit.span is not None
    assert [one.as_text() for one in orbit.span] == [f"{one[:23]}Z" for one in (FIRST, LAST)]
    assert not orbit.is_turned
    doubt, stated = orbit.doubt(MIDDLE), orbit.stated(MIDDLE)
    assert doubt.size < 1e-4
    assert doubt.words == "interpolation of the ephemeris"
    assert stated == StatedAccuracy("accuracy of AUX_RESORB", total=0.1)  # what is required of restituted orbits
    assert orbit.largest_doubt_m(MIDDLE) == 0.1
    assert orbit.doubts(MIDDLE) == ()


@pytest.mark.parametrize("wanted", ["S1A", "Sentinel-1A", "sentinel-1a", "s1a"])
def test_the_satellite_may_be_named(wanted: str) -> None:
    assert read_eof(DATA, "s.EOF", wanted, MIDDLE).words.startswith("AUX_RESORB of Sentinel-1A")


def test_another_satellite_is_not_there() -> None:
    with pytest.raises(PathFileError, match=r"^s.EOF: has no object S1B; it has Sentinel-1A$"):
        read_eof(DATA, "s.EOF", "S1B", MIDDLE)


def test_a_file_in_tai_is_the_same() -> None:
    orbit = read_eof(TEXT.replace("<Time_Reference>UTC", "<Time_Reference>TAI").encode(), "s.EOF", None, MIDDLE)
    assert orbit.place(MIDDLE) == read_eof(DATA, "s.EOF", None, MIDDLE).place(MIDDLE)


def test_a_quality_that_is_not_nominal_is_a_warning() -> None:
    data = TEXT.replace("NOMINAL", "DEGRADED", 2).encode()
    said = "s.EOF: 2 of 24 state vectors are not of nominal quality: DEGRADED"
    assert read_eof(data, "s.EOF", None, MIDDLE).doubts(MIDDLE) == (said,)


LINE = TEXT[: TEXT.index("<OSV>")].count("\n") + 1  # of the first state vector


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        (
            "EARTH_FIXED",
            "BARYCENTRIC_MEAN_OF_DATE",
            "s.EOF: Ref_Frame must be EARTH_FIXED (got BARY",
        ),
        ("<Time_Reference>UTC", "<Time_Reference>UT1", "s.EOF: Time_Reference must be UTC or TAI (got UT1)"),
        ('<X unit="m">', '<X unit="km">', f"s.EOF:{LINE + 5}: X must be in m (got km)"),
        ('<X unit="m">', '<X unit="m">x', f"s.EOF:{LINE + 5}: X must be a number of m (got x"),
        (
            "<UTC>UTC=2023-08-23T",
            "<UTC>UTC=2023-13-23T",
            f"s.EOF:{LINE + 2}: UTC must be a time such as UTC=2026",
        ),
        ("<UTC>UTC=", "<UTX>UTC=", "s.EOF:"),
        ("Earth_Explorer_File", "Earth_File", "s.EOF:1: is no Earth Explorer File; accepted: AUX_POEORB, AUX_RESORB"),
        ('<VX unit="m/s">', '<VX unit="m/s">9', f"s.EOF:{LINE}: velocities are "),
    ],
)
def test_what_is_refused(before: str, after: str, said: str) -> None:
    count = -1 if before == "Earth_Explorer_File" or before.startswith("<VX") else 1
    with pytest.raises(PathFileError) as error:
        read_eof(TEXT.replace(before, after, count).encode(), "s.EOF", None, MIDDLE)
    assert str(error.value).startswith(said)


def test_times_must_rise_and_hold_the_aperture() -> None:
    second = re.findall(r"<UTC>UTC=(.*)</UTC>", TEXT)[1]
    with pytest.raises(PathFileError, match=r"^s.EOF:\d+: is a state vector of the same time as the one before"):
        read_eof(TEXT.replace(f"UTC={second}", f"UTC={FIRST}").encode(), "s.EOF", None, MIDDLE)
    with pytest.raises(PathFileError, match=r"^s.EOF: has no position at 2023-08-24T.*; its useable time is 2023-08"):
        read_eof(DATA, "s.EOF", None, Instant(MIDDLE.day + 1, MIDDLE.seconds))
    with pytest.raises(PathFileError, match=r"^s.EOF:1: is not XML, which orbit files of the Sentinels are$"):
        read_eof(b"CCSDS_OEM_VERS = 2.0\n", "s.EOF", None, MIDDLE)


def with_block(number: int, copies: int, change: str = "") -> bytes:
    """The file with copies of a state vector behind it, whose first digit of X may be another."""
    head, *blocks = TEXT.split("<OSV>")
    block = blocks[number]
    other = re.sub(r"(<X[^>]*>[+-]?)\d", rf"\g<1>{change}", block) if change else block
    return "<OSV>".join([head, *blocks[: number + 1], *[other] * copies, *blocks[number + 1 :]]).encode()


def test_a_repeated_state_vector_is_left_out_and_said() -> None:
    whole = read_eof(DATA, "s.EOF", None, MIDDLE)
    joined = read_eof(with_block(5, 2), "s.EOF", None, MIDDLE)
    assert joined.place(MIDDLE) == whole.place(MIDDLE)
    assert joined.words == f"{whole.words}, 2 repeated state vectors left out"


def test_two_state_vectors_of_one_time_are_refused() -> None:
    with pytest.raises(PathFileError, match=r"^s.EOF:\d+: is a state vector of the same time as the one before it"):
        read_eof(with_block(5, 1, "1"), "s.EOF", None, MIDDLE)


def test_one_state_each_orbit_says_the_cause() -> None:
    """Ten places of one orbit each, 98.6 min apart, as an ephemeris of nodes has them."""
    head, *blocks = TEXT.split("<OSV>")
    written = re.compile(r"<UTC>UTC=.*</UTC>")
    times = [instant(f"{FIRST}Z").after(5916.0 * n).as_text().removesuffix("Z") for n in range(10)]
    rows = [written.sub(f"<UTC>UTC={time}</UTC>", blocks[n]) for n, time in enumerate(times)]
    tail = "</OSV>" + blocks[-1].partition("</OSV>")[2]
    data = "<OSV>".join([head, *rows[:-1], rows[-1].partition("</OSV>")[0] + tail]).encode()
    with pytest.raises(PathFileError, match=r"^s.EOF:\d+: has one state every 98.6 min, too few to interpolate"):
        read_eof(data, "s.EOF", None, instant(f"{FIRST}Z").after(5916.0 * 5))
