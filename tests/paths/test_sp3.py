"""Orbits in SP3: GNSS satellites against epochs that were left out, every part of the format, and what is refused."""

import math
import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from bisar_budget.paths.accuracy import StatedAccuracy
from bisar_budget.paths.flight import Orbit, PathFileError, interpolated
from bisar_budget.paths.instant import Instant
from bisar_budget.paths.sp3 import read_sp3
from tests.conftest import ROOT
from tests.paths.orbit_files import START, instant, on_circle

FILES = Path(__file__).parent / "files"
TEXT = (ROOT / "specs" / "missions" / "paths" / "igs15904_g05_g16.sp3").read_text()
NOON = instant("2010-07-01T11:59:45Z")  # of GPS time, which was 15 s ahead


def read(text: str, wanted: str | None = "G05", at: Instant = NOON) -> Orbit:
    return read_sp3(text.encode(), "g.sp3", wanted, at)


def epochs(text: str) -> list[str]:
    """The lines of each epoch."""
    return ["*" + one for one in text[text.index("\n*") + 1 : text.index("EOF")].split("*")[1:]]


def epoch_of(block: str) -> Instant:
    hour, minute = block.split()[4:6]
    return instant("2010-07-01T00:00:00Z").after(3600 * int(hour) + 60 * int(minute) - 15)


def place_of(block: str, satellite: str) -> list[float]:
    line = next(line for line in block.splitlines() if line.startswith(f"P{satellite}"))
    return [1000 * float(line[first : first + 14]) for first in (4, 18, 32)]


def without(text: str, left_out: set[int]) -> str:
    blocks = epochs(text)
    kept = [block for n, block in enumerate(blocks) if n not in left_out]
    return text[: text.index("\n*") + 1] + "".join(kept) + "EOF\n"


@pytest.mark.parametrize("satellite", ["G05", "G16"])
def test_every_other_epoch_comes_back(satellite: str) -> None:
    """At half an hour between places: to 1 cm two hours and more from an end; places are written to 1 mm.

    Nearer to the end it is to what is doubted and 5 cm.
    """
    blocks = epochs(TEXT)
    half = without(TEXT, set(range(1, 96, 2)))
    for n in range(1, 94, 2):
        at = epoch_of(blocks[n])
        orbit = read(half, satellite, at)
        off = math.dist(orbit.place(at), place_of(blocks[n], satellite))
        assert off < (0.01 if 9 <= n <= 85 else 0.05 + 4 * orbit.doubt(at).size)


def test_the_velocity_is_that_of_an_independent_polynomial() -> None:
    """To 0.1 mm/s: Lagrange's through sixteen places by exact fractions, differenced over 2 s; places have 1 mm."""
    blocks = epochs(TEXT)[40:56]
    times = [Fraction(900 * n) for n in range(16)]
    places = [[Fraction(one) for one in place_of(block, "G05")] for block in blocks]

    def independent(at: Fraction, axis: int) -> Fraction:
        return sum(
            (
                place[axis] * math.prod((at - b) / (a - b) for b in times if b != a)
                for a, place in zip(times, places, strict=True)
            ),
            Fraction(0),
        )

    middle = Fraction(7 * 900 + 300)
    at = epoch_of(blocks[0]).after(float(middle))
    orbit = read(TEXT, "G05", at)
    found = interpolated(lambda some: np.array([orbit.place(at.after(one)) for one in some.tolist()]), 4.0)
    expected = [float(independent(middle + 1, axis) - independent(middle - 1, axis)) / 2 for axis in range(3)]
    assert found.state.velocity == pytest.approx(expected, abs=1e-4)
    place = [float(independent(middle, axis)) for axis in range(3)]
    assert found.state.position == pytest.approx(place, abs=1e-3)


def test_what_is_said_of_it() -> None:
    orbit = read(TEXT)
    assert orbit.words == "SP3 of G05, IGS05, Lagrange degree 15"
    doubt = orbit.doubt(NOON)
    assert doubt.size < 1e-3
    assert doubt.words == "interpolation of the ephemeris"
    assert orbit.doubts(NOON) == ()
    assert orbit.place(epoch_of(epochs(TEXT)[48])) == pytest.approx(place_of(epochs(TEXT)[48], "G05"), abs=1e-6)


class TestAccuracy:
    """Accuracies of the header (2² mm) and of the positions (base 1.25; the exponents stand behind the clock)."""

    DEVIATIONS = re.compile(r"^(PG05.{56}) *\d+ +\d+ +\d+", re.MULTILINE)
    AT = epoch_of(epochs(TEXT)[48]).after(1.0)

    def stated(self, exponents: str, header: str = " 2 ", base: str = "1.2500000") -> StatedAccuracy | None:
        text = self.DEVIATIONS.sub(rf"\g<1> {exponents}", TEXT).replace("%f  1.2500000", f"%f  {base}", 1)
        return read(text.replace("++         2 ", f"++        {header}", 1), at=self.AT).stated(self.AT)

    def test_that_of_the_header(self) -> None:
        """Lines without deviations, and lines whose deviations are less, 1.25³ mm on each axis."""
        for exponents in ("        ", " 0  0  0", " 3  3  3"):
            assert self.stated(exponents) == StatedAccuracy("accuracy of G05", total=0.004)

    @pytest.mark.parametrize("header", [" 0 ", " 2 "])
    def test_deviations_that_are_more_count(self, header: str) -> None:
        """654 m on each axis, where the header says nothing or 4 mm."""
        found = self.stated("60 59 58", header)
        assert found is not None
        assert found.words == "standard deviations of G05"
        assert np.sqrt(np.diag(found.covariance)) == pytest.approx([1.25**60 / 1e3, 1.25**59 / 1e3, 1.25**58 / 1e3])

    def test_an_axis_without_is_as_bad_as_the_worst(self) -> None:
        found = self.stated("60    58", " 0 ")
        assert found is not None
        assert np.sqrt(np.diag(found.covariance))[1] == pytest.approx(1.25**60 / 1e3)

    @pytest.mark.parametrize("base", ["0.0000000", "1.0000000", "   x     "])
    def test_without_a_base_there_are_none(self, base: str) -> None:
        assert self.stated("60 60 60", " 0 ", base) is None

    def test_the_larger_one_of_the_two_places_around_counts(self) -> None:
        blocks = epochs(TEXT)
        line = next(line for line in blocks[49].splitlines() if line.startswith("PG05"))
        text = TEXT.replace(line, self.DEVIATIONS.sub(r"\g<1> 60 60 60", line))
        for index, is_near in ((47, False), (48, True), (49, True), (50, False)):
            at = epoch_of(blocks[index]).after(1.0)
            found = read(text, at=at).stated(at)
            assert found is not None
            assert (found.position_m > 1000) == is_near


def test_one_satellite_has_to_be_named() -> None:
    with pytest.raises(PathFileError, match=r"^g.sp3: has 2 objects: G05, G16; choose one by its name or OBJECT_ID$"):
        read(TEXT, None)
    with pytest.raises(PathFileError, match=r"^g.sp3: has no object G06; it has G05, G16$"):
        read(TEXT, "G06")


@pytest.mark.parametrize(
    ("system", "ahead"),
    [("GPS", 15), ("GAL", 15), ("QZS", 15), ("IRN", 15), ("BDT", 1), ("TAI", 34), ("UTC", 0), ("GLO", 0)],
)
def test_time_systems(system: str, ahead: int) -> None:
    """In 2010 TAI was 34 s ahead of UTC."""
    text = TEXT.replace("%c G  cc GPS", f"%c G  cc {system}", 1)
    at = instant("2010-07-01T12:00:00Z").after(-ahead)
    assert read(text, "G05", at).place(at) == pytest.approx(place_of(epochs(TEXT)[48], "G05"), abs=1e-6)


def test_the_first_version_has_numbers_for_satellites() -> None:
    text = TEXT.replace("#cP", "#aP", 1).replace("PG05", "P  5").replace("G05G16", "  5 16").replace("PG16", "P 16")
    text = text.replace("%c G  cc GPS", "%c cc cc ccc", 1)
    assert read(text).place(NOON) == read(TEXT).place(NOON)


def test_no_polynomial_goes_over_a_place_that_is_missing_or_a_manoeuvre() -> None:
    blocks = epochs(TEXT)
    line = next(line for line in blocks[48].splitlines() if line.startswith("PG05"))
    absent = TEXT.replace(line, "PG05      0.000000      0.000000      0.000000 999999.999999")
    with pytest.raises(
        PathFileError, match=r"^g.sp3: has no position at 2010-07-01T11:59:45.000Z; its useable time is"
    ):
        read(absent)
    moved = TEXT.replace(line, f"{line:<78}M")
    assert read(moved, "G05", NOON.after(60)).span[0] == NOON  # type: ignore[index]
    assert read(moved, "G16", NOON.after(60)).span[0] == epoch_of(blocks[0])  # type: ignore[index]
    gone = TEXT.replace(line + "\n", "")
    with pytest.raises(PathFileError, match=r"^g.sp3: has no position at"):
        read(gone)


def test_a_predicted_place_is_said() -> None:
    blocks = epochs(TEXT)
    line = next(line for line in blocks[40].splitlines() if line.startswith("PG05"))
    text = TEXT.replace(line, f"{line:<79}P")
    assert read(text).doubts(NOON) == ("g.sp3: positions of G05 around the aperture are predicted",)
    early = epoch_of(blocks[20])
    assert read(text, "G05", early).doubts(early) == ()


def low(step: float = 30.0, count: int = 41, *, speed: float = 1.0) -> str:
    """A low satellite with velocities, as those of science missions are written."""
    lines = [
        "#dV2026  6  1  5  0  0.00000000      41 ORBIT IGS20 FIT  TST",
        "## 0 0.0 30.00000000 0 0.0",
        "+    1   L47" + "  0" * 16,
        "++         0" + "  0" * 16,
        "%c L  cc UTC ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc",
    ]
    for n in range(count):
        place, velocity = on_circle(step * n)
        whole, rest = divmod(step * n, 60)
        lines.append(f"*  2026  6  1  5 {int(whole):2d} {rest:11.8f}")
        lines.append("PL47" + "".join(f"{one / 1000:14.6f}" for one in place) + f"{0:14.6f}")
        lines.append("VL47" + "".join(f"{10 * speed * one:14.6f}" for one in velocity) + f"{0:14.6f}")
    return "\n".join([*lines, "EOF", ""])


def test_velocities_of_a_low_satellite_are_used() -> None:
    """Places are written to 1 mm; ITRF is that of the header."""
    at = START.after(615)
    orbit = read(low(), None, at)
    assert orbit.words == "SP3 of L47, IGS20, Hermite degree 7"
    assert math.dist(orbit.place(at), on_circle(615)[0]) < 1e-3
    other = read(low(speed=1.07), None, at)  # velocities against the stars
    assert other.words.startswith("SP3 of L47, IGS20, Lagrange degree ")
    assert math.dist(other.place(at), on_circle(615)[0]) < 2e-3


LINE = TEXT.splitlines().index(epochs(TEXT)[0].splitlines()[0]) + 1


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("#cP", "#eP", "g.sp3:1: must begin like #cP or #dV, as SP3 does (got #eP2010"),
        (
            "GPS ccc",
            "XYZ ccc",
            "g.sp3:13: the time system XYZ is not known; accepted: GPS, GAL, QZS, IRN, BDT, TAI, UTC",
        ),
    ],
)
def test_what_is_refused(before: str, after: str, said: str) -> None:
    with pytest.raises(PathFileError) as error:
        read(TEXT.replace(before, after, 1))
    assert str(error.value).startswith(said)


GARBLED = {
    "epoch-not-after": ("*  2010  7  1  0 15", "*  2010  7  1  0  0", 3, "the epoch is not after the one before it"),
    "epoch": ("*  2010  7  1  0 15", "*  2010  7 41  0 15", 3, "must be an epoch such as *  2026  5 31"),
    "place": ("PG05 -25251.856884", "PG05 -2525x.856884", 1, "must be a number of km in columns 5 to 18"),
    "name-of-another": ("PG16", "PG05", 2, "G05 has two positions at one epoch"),
    "no-record": ("PG16", "XG16", 2, "must be an epoch, a position or a velocity (got XG16"),
}


@pytest.mark.parametrize("kind", GARBLED)
def test_one_garbled_line_of_the_chosen_satellite_does_not_refuse_a_file(kind: str) -> None:
    """Far from the aperture: the orbit is the same, and says how many lines are left out."""
    before, after, line, _ = GARBLED[kind]
    orbit, whole = read(TEXT.replace(before, after, 1)), read(TEXT)
    assert f", 1 record that cannot be used left out (line {LINE + line})" in orbit.words
    assert orbit.place(NOON) == whole.place(NOON)


@pytest.mark.parametrize("kind", GARBLED)
def test_more_than_a_percent_of_garbled_lines_refuse_a_file(kind: str) -> None:
    before, after, line, problem = GARBLED[kind]
    text = TEXT.replace(before, after, 1)
    at = text.rindex("PG05", 0, text.rindex("PG05"))
    with pytest.raises(PathFileError) as error:
        read(text[:at] + "PG05 x" + text[at + 6 :])
    assert str(error.value).startswith(f"g.sp3:{LINE + line}: {problem}")
    assert str(error.value).endswith("; 2 lines cannot be used")


def test_a_garbled_place_of_another_satellite_does_not_refuse_a_file() -> None:
    text = TEXT.replace("PG16", "PG16 x", 1)
    assert read(text).place(NOON) == read(TEXT).place(NOON)
    assert "left out" not in read(text).words  # none of its records


def test_nothing_is_interpolated_over_a_garbled_place() -> None:
    """At the aperture the file is refused, and the message names the line."""
    block = epochs(TEXT)[48]  # of noon
    garbled = block.replace("PG05", "PG05 x")
    text = TEXT.replace(block, garbled)
    line = TEXT[: TEXT.index(block)].count("\n") + 2
    with pytest.raises(PathFileError, match=rf"g\.sp3:{line}: must be a number of km in columns 5 to 18"):
        read(text)


def test_a_file_without_epochs() -> None:
    with pytest.raises(PathFileError, match=r"^g.sp3: has no epoch, a line that begins with \*$"):
        read(TEXT[: TEXT.index("\n*")])


def test_two_places_are_too_few() -> None:
    """One line through two points has no error that could be estimated: that is no small error."""
    with pytest.raises(PathFileError, match=r"the ephemeris is too sparse around"):
        read(low(count=2), None, START.after(15))
