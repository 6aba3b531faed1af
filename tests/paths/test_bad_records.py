"""Records of a log that cannot be used: far away they are left out and counted, where the path is fitted refused."""

import re
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget.paths.flight import Log, PathFileError, hold_to_usable_records
from bisar_budget.paths.log_places import LogKeys, _longest_rise
from bisar_budget.paths.path_formats import read_log
from tests.conftest import examples
from tests.paths.flown import flight, geodetic_csv, sbet
from tests.paths.log_files import gpx, nmea, sentence, solution

FLOWN = flight(301)
HALF_S = 1.0  # around the middle; what is broken lies outside


def _texts(data: bytes, first: int, step: int = 1) -> tuple[list[str], list[int]]:
    """Lines of a file, and which of them has the record of each place."""
    lines = data.decode().splitlines()
    return lines, [first + step * n for n in range(301)]


def _broken(lines: list[str], at: int, change: Callable[[str], str]) -> None:
    lines[at] = change(lines[at])


def _again(line: str) -> str:
    body = line.strip().strip("$").partition("*")[0].split(",")
    return sentence(",".join(body))


def _field(line: str, index: int, text: str) -> str:
    cells = line.strip().strip("$").partition("*")[0].split(",")
    cells[index] = text
    return sentence(",".join(cells))


def _cell(line: str, index: int, text: str, separator: str = ",") -> str:
    cells = line.split(separator) if separator != " " else line.split()
    cells[index] = text
    return separator.join(cells)


# Of each format: the file, where records begin and how far apart they are, and ways to break a line.
TEXTS: dict[str, tuple[bytes, int, int, list[Callable[[str], str]]]] = {
    "csv": (
        geodetic_csv(FLOWN),
        1,
        1,
        [
            partial(_cell, index=1, text=""),
            partial(_cell, index=2, text="nan"),
            partial(_cell, index=1, text="97.5"),
            partial(_cell, index=3, text="3000 m"),
            partial(_cell, index=3, text="1e10"),
            partial(_cell, index=0, text="2026-06-01T05:20:61.0Z"),
            partial(_cell, index=0, text="2026-06-01T05:19:00.000Z"),
            partial(_cell, index=0, text="2026-06-01T05:59:00.000Z"),
            lambda line: line[: len(line) // 2],
        ],
    ),
    "pos": (
        solution(FLOWN),
        3,
        1,
        [
            partial(_cell, index=4, text="nan", separator=" "),
            partial(_cell, index=2, text="148.0", separator=" "),
            partial(_cell, index=3, text="*****", separator=" "),
            partial(_cell, index=1, text="25:20:19.250", separator=" "),
            partial(_cell, index=1, text="05:00:00.000", separator=" "),
            lambda line: line[:60],
        ],
    ),
    "nmea": (
        nmea(FLOWN),
        0,
        3,
        [
            partial(_field, index=9, text=""),
            partial(_field, index=11, text=""),
            partial(_field, index=2, text="9805.196000"),
            partial(_field, index=4, text=""),
            partial(_field, index=1, text="052060.50"),
            partial(_field, index=1, text="051900.00"),
            partial(_field, index=9, text="99999999"),
        ],
    ),
    "gpx": (
        gpx(FLOWN),
        4,
        1,
        [
            lambda line: re.sub("<ele>.*</ele>", "", line),
            lambda line: re.sub("<ele>.*</ele>", "<ele>NaN</ele>", line),
            lambda line: re.sub("<time>.*</time>", "<time>2026-06-01</time>", line),
            lambda line: re.sub("<time>.*</time>", "<time>2026-06-01T04:00:00Z</time>", line),
            lambda line: line.replace('lat="4', 'lat="94'),
            lambda line: re.sub("<geoidheight>.*</geoidheight>", "", line),
        ],
    ),
}
CLEAN = {kind: read_log(data, "a", kind, LogKeys()) for kind, (data, *_) in TEXTS.items() if kind != "nmea"}


def clean(kind: str) -> Log:
    if kind == "nmea":
        pytest.importorskip("pynmea2")
        CLEAN.setdefault(kind, read_log(TEXTS[kind][0], "a", kind, LogKeys()))
    return CLEAN[kind]


def middle(log: Log) -> tuple[np.ndarray, np.ndarray]:
    """Times from the start of the flight, and places, around the middle of a log."""
    begin = clean_start(log)
    at = log.times + begin
    near = np.abs(at - 3.0) <= HALF_S + 1e-9
    return at[near], log.places[near]


def clean_start(log: Log) -> float:
    whole = CLEAN["csv"].start
    assert log.start is not None
    assert whole is not None
    return log.start.since(whole)


@examples(60)
@given(st.sampled_from(sorted(TEXTS)), st.data())
def test_up_to_one_percent_far_away_leaves_the_path_as_it_is(kind: str, data: st.DataObject) -> None:
    whole = clean(kind)
    content, first, step, ways = TEXTS[kind]
    lines, at = _texts(content, first, step)
    far = [n for n in range(1, 300) if abs(FLOWN.times[n] - 3.0) > HALF_S + 0.1]
    chosen = data.draw(st.lists(st.sampled_from(far), min_size=1, max_size=3, unique=True))
    for place in chosen:
        _broken(lines, at[place], data.draw(st.sampled_from(ways)))
    log = read_log("\n".join(lines).encode(), "a", kind, LogKeys())
    times, places = middle(log)
    expected_times, expected = middle(whole)
    assert times == pytest.approx(expected_times, abs=1e-6)
    assert np.array_equal(places, expected)
    noun = "1 record" if len(chosen) == 1 else f"{len(chosen)} records"
    numbers = ", ".join(str(at[place] + 1) for place in sorted(chosen))
    assert f", {noun} that cannot be used left out (line{'s' * (len(chosen) > 1)} {numbers})" in log.words
    hold_to_usable_records(log, log.times + clean_start(log) - 3.0, 2 * HALF_S)


@pytest.mark.parametrize("kind", sorted(TEXTS))
def test_within_the_stretch_or_beyond_one_percent_it_is_refused(kind: str) -> None:
    clean(kind)
    content, first, step, ways = TEXTS[kind]
    for way in ways:
        lines, at = _texts(content, first, step)
        _broken(lines, at[151], way)
        log = read_log("\n".join(lines).encode(), "a", kind, LogKeys())
        says = rf"^a:{at[151] + 1}: .*; the record lies within the 2 s around mid-aperture that are used$"
        with pytest.raises(PathFileError, match=says):
            hold_to_usable_records(log, log.times + clean_start(log) - 3.0, 2 * HALF_S)
        for place in (5, 9, 20, 40):
            _broken(lines, at[place], way)
        with pytest.raises(PathFileError, match=rf"^a:{at[5] + 1}: "):
            read_log("\n".join(lines).encode(), "a", kind, LogKeys())


def test_records_of_an_sbet_are_left_out_too() -> None:
    data = bytearray(sbet(FLOWN))
    whole = read_log(bytes(data), "a", "sbet", LogKeys(week=2421))
    for record, field, value in ((3, 3, np.nan), (280, 1, 7.0), (290, 0, 0.0)):
        at = 136 * record + 8 * field
        data[at : at + 8] = np.array([value], "<f8").tobytes()
    log = read_log(bytes(data), "a", "sbet", LogKeys(week=2421))
    assert np.array_equal(log.places, np.delete(whole.places, [3, 280, 290], axis=0))
    assert ", 3 records that cannot be used left out (records 4, 281, 291)" in log.words


def test_the_first_record_may_be_the_bad_one() -> None:
    """It dates nothing: GPS time was ahead by less in 1999."""
    lines = solution(FLOWN).decode().splitlines()
    lines[3] = lines[3].replace("2026/06/01 05:20:19", "1999/01/01 00:00:00").replace("3000.", "nan #")
    lines[3] = _cell(lines[3].replace(" #", ""), 4, "nan", " ")
    log = read_log("\n".join(lines).encode(), "a", "pos", LogKeys())
    assert log.start is not None
    assert log.start.as_text() == "2026-06-01T05:20:01.270Z"
    assert "UTC is GPS less 18 s" in log.words


@given(st.lists(st.integers(0, 12), min_size=1, max_size=9))
def test_what_rises_is_the_longest_selection(times: list[int]) -> None:
    kept = _longest_rise(np.array(times, dtype=float))
    chosen = np.array(times)[kept]
    assert (np.diff(chosen) > 0).all()
    best = [1] * len(times)
    for n, time in enumerate(times):
        best[n] = 1 + max((best[m] for m in range(n) if times[m] < time), default=0)
    assert len(chosen) == max(best)


def test_of_records_that_repeat_a_time_the_first_is_kept() -> None:
    assert _longest_rise(np.array([0.0, 1, 1, 2, 9, 3, 4])).tolist() == [True, True, False, True, False, True, True]
