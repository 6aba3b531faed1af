"""Logs of NMEA 0183: places from sentences GGA or GNS, the date from RMC or ZDA, in UTC.

    $GNRMC,052001.25,A,4805.196000,N,01116.782000,E,116.6,045.0,010626,,,R*43
    $GNGGA,052001.25,4805.196000,N,01116.782000,E,4,12,0.7,2953.100,M,46.900,M,1.0,0000*7C
    $GNGST,052001.25,0.012,0.011,0.008,45.0,0.010,0.008,0.020*7C

A height of a sentence is above mean sea level, and the geoid separation beside it makes one above the ellipsoid.
Sentences may come from several talkers, and stand among other lines or behind something on their line. One whose
checksum is wrong or missing is left out, and counted. GST states one-sigma errors of latitude, longitude and height.

Source: NMEA 0183 4.10 as RTKLIB 2.4.3 reads it (src/solution.c, decode_nmeagga, decode_nmearmc, decode_nmeazda: a
time of day is within half a day of the date before it). The fields of GNS are those of pynmea2, which parses them.
"""

import math
import re
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple, NoReturn

import numpy as np

from bisar_budget.extras import install_command
from bisar_budget.faults import shown
from bisar_budget.paths.earth import Floats
from bisar_budget.paths.flight import Log, PathFileError, hold_to_bytes
from bisar_budget.paths.instant import DAY, Instant, parse_instant
from bisar_budget.paths.log_places import LogKeys, LogRows, counted, from_sea_level, geodetic_log, hold_to_scale

LARGEST = 200_000_000  # bytes; ten hours at 10 Hz of eight sentences
_LONGEST = 256  # characters of a sentence; the standard has 82
_SENTENCE = re.compile(r"\$[A-Z]{2}(?:GGA|GNS|RMC|ZDA|GST),", re.ASCII)
_ANYWHERE = re.compile(rb"\$[A-Z]{2}(?:GGA|GNS|RMC|ZDA),[^\r\n$]{0,250}\*[0-9A-Fa-f]{2}")
_CLOCK = re.compile(r"([01]\d|2[0-3])([0-5]\d)([0-5]\d(?:\.\d{1,9})?)", re.ASCII)
_ANGLE = re.compile(r"(\d{1,3})([0-5]\d(?:\.\d{1,12})?)", re.ASCII)
_NUMBER = re.compile(r"[+-]?\d{1,9}(?:\.\d{0,12})?", re.ASCII)
_TIME_STEP_S = 1e-4  # less than between two fixes, more than a rounding of days
_GST_REACH_S = 5.0  # from a fix to a GST that speaks for it; receivers write one a second, or fewer than fixes


class _Quality(NamedTuple):
    """The quality that a receiver states of a fix: its words, and the one-sigma error that is usual then [m]."""

    words: str
    typical_sigma_m: float


# GGA: 0 is none, 7 is put in by hand, 8 is a simulator's. Dead reckoning is no better than an autonomous fix, a
# precise fix no better than a differential one.
_QUALITIES = {
    "1": _Quality("quality 1, autonomous", 3.0),
    "2": _Quality("quality 2, differential", 1.0),
    "3": _Quality("quality 3, precise", 1.0),
    "4": _Quality("quality 4, RTK fixed", 0.01),
    "5": _Quality("quality 5, RTK float", 0.3),
    "6": _Quality("quality 6, dead reckoning", 3.0),
}
# GNS, one of each system: N is none, M is put in by hand, S is a simulator's.
_MODES = {
    "A": _Quality("mode A, autonomous", 3.0),
    "D": _Quality("mode D, differential", 1.0),
    "P": _Quality("mode P, precise", 1.0),
    "R": _Quality("mode R, RTK fixed", 0.01),
    "F": _Quality("mode F, RTK float", 0.3),
    "E": _Quality("mode E, dead reckoning", 3.0),
}


class _Fix(NamedTuple):
    """Line of a sentence, seconds of its day, latitude and longitude [rad], height and geoid separation [m].

    The separation is NaN where the sentence has none.
    """

    line: int
    seconds: float
    latitude: float
    longitude: float
    height: float
    separation: float
    quality: _Quality


class _Accuracy(NamedTuple):
    """Line of a GST, seconds of its day, and one-sigma errors east, north and up [m]."""

    line: int
    seconds: float
    east: float
    north: float
    up: float


def is_nmea(data: bytes) -> bool:
    """Whether a file has a sentence with a place or a date, with a checksum, in its first megabyte."""
    return bool(_ANYWHERE.search(data[:1_000_000]))


def read_nmea(data: bytes, name: str, keys: LogKeys) -> Log:
    """Read a log of NMEA 0183 of at most `LARGEST` bytes, as every reader of `LOG_FORMATS` does; needs pynmea2.

    Of GGA and GNS those count of which there are more. Where several talkers have a place at one time, those of the
    talker with most count.
    """
    hold_to_scale("utc", keys, name)
    hold_to_bytes(data, LARGEST, name)
    try:
        from pynmea2 import ParseError
        from pynmea2 import parse as parse_sentence
    except ImportError:
        raise PathFileError(f"{name}: needs the package pynmea2: {install_command('logs')}") from None
    fixes: defaultdict[str, defaultdict[str, list[_Fix]]] = defaultdict(lambda: defaultdict(list))
    accuracies: defaultdict[str, list[_Accuracy]] = defaultdict(list)
    dates: list[tuple[int, Instant]] = []
    wrong = 0
    # Bytes of another protocol between sentences are no text.
    for number, text in enumerate(data.decode("latin-1").split("\n"), 1):
        begin = _SENTENCE.search(text)
        if begin is None:
            continue
        sentence = text[begin.start() :].rstrip()
        try:
            if len(sentence) > _LONGEST or not sentence.isascii():
                raise ParseError("no sentence of the standard", sentence)
            found = parse_sentence(sentence, check=True)
        except ParseError:
            wrong += 1
            continue
        kind, fields = sentence[3:6], [field.strip() for field in found.data]
        read = _READERS[kind]
        read_one = read(fields + [""] * 14, f"{name}:{number}: {kind}", number)
        if isinstance(read_one, Instant):
            dates.append((number, read_one))
        elif isinstance(read_one, _Accuracy):
            accuracies[sentence[1:3]].append(read_one)
        elif read_one is not None:
            fixes[kind][sentence[1:3]].append(read_one)
    said = f", {counted(wrong, 'sentence')} with a wrong checksum left out" if wrong else ""
    if not fixes:
        raise PathFileError(f"{name}: has no sentence GGA or GNS with a fix{said}")
    if not dates:
        raise PathFileError(
            f"{name}: has no date",
            "accepted: a sentence RMC or ZDA beside those with places",
            "Let the receiver write RMC or ZDA too",
        )
    kind = max(fixes, key=lambda one: sum(map(len, fixes[one].values())))
    return _log(kind, fixes[kind], dates, accuracies, said, name, keys)


def _log(
    kind: str,
    of_talkers: dict[str, list[_Fix]],
    dates: Sequence[tuple[int, Instant]],
    accuracies: dict[str, list[_Accuracy]],
    said: str,
    name: str,
    keys: LogKeys,
) -> Log:
    """The log of sentences of one kind."""
    talker = max(of_talkers, key=lambda one: len(of_talkers[one]))
    fixes = sorted(fix for one in of_talkers.values() for fix in one)
    days, seconds = _dated(fixes, dates)
    if len(of_talkers) > 1 and not (np.diff(days * DAY + seconds) > 0).all():
        fixes = of_talkers[talker]
        days, seconds = _dated(fixes, dates)
    rows = LogRows(name, np.array([fix.line for fix in fixes]))
    latitude, longitude, height, separation = np.array([fix[2:6] for fix in fixes], dtype=float).T
    has_none = np.isnan(separation)
    if has_none.any() and not has_none.all():
        rows.refuse(has_none, lambda _: f"{kind} has no geoid separation, others have one")
    separations = None if has_none.any() else separation
    heights = from_sea_level(height, separations, keys, name)
    start = Instant(int(days[0]), float(seconds[0]))
    times = (days - days[0]) * DAY + (seconds - seconds[0])
    words = f"NMEA 0183 {kind}{said}"
    qualities = [fix.quality for fix in fixes]
    log = geodetic_log(rows, words, times, start, "utc", (latitude, longitude, heights))
    # Without a GST of its own talker, those of others speak for a receiver.
    stated = accuracies.get(talker) or sorted(gst for of_talker in accuracies.values() for gst in of_talker)
    return replace(
        log,
        sigmas=_sigmas(days * DAY + seconds, stated, dates),
        typical_sigmas=np.array([quality.typical_sigma_m for quality in qualities]),
        quality_words=lambda i: f"{kind} {qualities[i].words}",
    )


def _sigmas(times: Floats, stated: Sequence[_Accuracy], dates: Sequence[tuple[int, Instant]]) -> Floats | None:
    """One-sigma errors (n, 3) of fixes at rising times: the larger one of the GST before a fix and of that behind it.

    NaN where both are farther than 5 s; None where no fix has any. [m]
    """
    if not stated:
        return None
    days, seconds = _dated(stated, dates)
    at = days * DAY + seconds
    order = np.argsort(at, kind="stable")
    at, figures = at[order], np.array([gst[2:] for gst in stated])[order]
    sigmas = np.full((len(times), 3), np.nan)
    behind = np.searchsorted(at, times - _TIME_STEP_S, "left")
    for index in (behind, np.searchsorted(at, times + _TIME_STEP_S, "right") - 1):
        index = np.clip(index, 0, len(at) - 1)
        is_near = np.abs(at[index] - times) <= _GST_REACH_S
        sigmas = np.where(is_near[:, None], np.fmax(sigmas, figures[index]), sigmas)
    return None if np.isnan(sigmas).all() else sigmas


def _dated(fixes: Sequence[_Fix | _Accuracy], dates: Sequence[tuple[int, Instant]]) -> tuple[Floats, Floats]:
    """Modified Julian days of fixes and seconds of them: within half a day of the date before, or the first."""
    lines = [line for line, _ in dates]
    days = np.empty(len(fixes))
    for n, fix in enumerate(fixes):
        dated = dates[max(bisect_right(lines, fix.line) - 1, 0)][1]
        days[n] = dated.day + round((dated.seconds - fix.seconds) / DAY)
    return days, np.array([fix.seconds for fix in fixes])


# ---------------------------------------------------------------------- sentences
def _refused(where: str, says: str, given: str) -> NoReturn:
    raise PathFileError(f"{where} {says} (got {shown(given)!r})")


def _clock(text: str, where: str) -> float:
    match = _CLOCK.fullmatch(text)
    if match is None:
        _refused(where, "must have a time like 052001.25", text)
    return int(match[1]) * 3600.0 + int(match[2]) * 60.0 + float(match[3])


def _angle(text: str, side: str, sides: str, where: str) -> float:
    match = _ANGLE.fullmatch(text)
    if match is None or side not in (sides[0], sides[1]):
        _refused(
            where, f"must have degrees and minutes like 4805.196, and {sides[0]} or {sides[1]}", f"{text},{side}"
        )
    return float(np.radians((int(match[1]) + float(match[2]) / 60) * (1 if side == sides[0] else -1)))


def _metres(text: str, unit: str, where: str) -> float:
    if not _NUMBER.fullmatch(text) or unit != "M":
        _refused(where, "must have a height and a geoid separation in M", f"{text},{unit}")
    return float(text)


def _fix(
    fields: Sequence[str], where: str, line: int, quality: _Quality | None, height: Sequence[str]
) -> _Fix | None:
    """A place, where there is a quality; `height` has the fields height, its unit, the separation and its unit."""
    if quality is None:
        return None
    altitude, unit, separation, its_unit = height
    return _Fix(
        line,
        _clock(fields[0], where),
        _angle(fields[1], fields[2], "NS", where),
        _angle(fields[3], fields[4], "EW", where),
        _metres(altitude, unit, where),
        _metres(separation, its_unit, where) if separation else math.nan,
        quality,
    )


def _gga(fields: Sequence[str], where: str, line: int) -> _Fix | None:
    return _fix(fields, where, line, _QUALITIES.get(fields[5]), fields[8:12])


def _gns(fields: Sequence[str], where: str, line: int) -> _Fix | None:
    modes = (_MODES[mode] for mode in fields[5] if mode in _MODES)
    worst = max(modes, key=lambda mode: mode.typical_sigma_m, default=None)
    return _fix(fields, where, line, worst, (fields[8], "M", fields[9], "M"))


def _gst(fields: Sequence[str], where: str, line: int) -> _Accuracy | None:
    north, east, up = (float(field) if _NUMBER.fullmatch(field) else math.nan for field in fields[5:8])
    is_stated = all(sigma > 0 for sigma in (north, east, up))  # a receiver without a fix writes zeros, or nothing
    return _Accuracy(line, _clock(fields[0], where), east, north, up) if is_stated and fields[0] else None


def _rmc(fields: Sequence[str], where: str, line: int) -> Instant | None:
    if fields[1] != "A" or not fields[8]:
        return None
    date = fields[8]
    if not re.fullmatch(r"\d{6}", date, re.ASCII):
        _refused(where, "must have a date like 010626", date)
    century = "19" if int(date[4:]) >= 80 else "20"  # as RTKLIB has it; GPS began in 1980
    return _dated_at(f"{century}{date[4:]}-{date[2:4]}-{date[:2]}", fields[0], date, where)


def _zda(fields: Sequence[str], where: str, line: int) -> Instant | None:
    day, month, year = fields[1:4]
    if not (fields[0] and day and month and year):
        return None
    return _dated_at(f"{year:>04}-{month:>02}-{day:>02}", fields[0], f"{day},{month},{year}", where)


def _dated_at(date: str, clock: str, given: str, where: str) -> Instant:
    midnight = parse_instant(f"{date}T00:00:00Z")
    if midnight is None:
        _refused(where, "must have a date that there is", given)
    return Instant(midnight.day, _clock(clock, where))


_READERS: dict[str, Callable[[Sequence[str], str, int], _Fix | _Accuracy | Instant | None]] = {
    "GGA": _gga,
    "GNS": _gns,
    "RMC": _rmc,
    "ZDA": _zda,
    "GST": _gst,
}
