"""Logs of NMEA 0183: fixes from sentences GGA or GNS, the date from RMC or ZDA, in UTC.

    $GNRMC,052001.25,A,4805.196000,N,01116.782000,E,116.6,045.0,010626,,,R*43
    $GNGGA,052001.25,4805.196000,N,01116.782000,E,4,12,0.7,2953.100,M,46.900,M,1.0,0000*7C
    $GNGST,052001.25,0.012,0.011,0.008,45.0,0.010,0.008,0.020*7C

A height of a sentence is above mean sea level. The geoid separation of the same sentence gives the height above the
ellipsoid. Lines may hold further text, before a sentence or instead of one. All fixes of a log come from one talker.
A sentence with a wrong or missing checksum is left out and counted. A DTM counts all the same if no sound DTM exists.
GST states one-sigma errors of latitude, longitude and height. DTM states a datum, which has to be W84. Without a
date, fixes have times of day.

Source: NMEA 0183 4.10 as RTKLIB 2.4.3 reads it (src/solution.c, decode_nmeagga, decode_nmearmc, decode_nmeazda: a
time of day is within half a day of the date before it). The fields of GNS, GST and DTM are those of pynmea2, which
parses them.
"""

import math
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, reduce
from operator import xor
from typing import NamedTuple, NoReturn

import numpy as np

from bisar_budget.extras import install_command
from bisar_budget.faults import shown
from bisar_budget.paths.earth import EQUATORIAL_RADIUS_M, Floats
from bisar_budget.paths.flight import Log, PathFileError, hold_to_bytes
from bisar_budget.paths.instant import DAY, Instant, parse_instant
from bisar_budget.paths.log_places import (
    LogKeys,
    LogRecords,
    counted,
    from_sea_level,
    geodetic_log,
    hold_to_scale,
    most_left_out,
)
from bisar_budget.paths.messages import number_in
from bisar_budget.units import format_quantity

MAX_NMEA_BYTES = 200_000_000  # bytes; ten hours at 10 Hz of eight sentences
_MAX_SENTENCE_CHARACTERS = 256  # the standard has 82
_SENTENCE = re.compile(r"\$[A-Z]{2}(?:GGA|GNS|RMC|ZDA|GST|DTM),", re.ASCII)
_ANY_SENTENCE = re.compile(rb"\$[A-Z]{2}(?:GGA|GNS|RMC|ZDA),[^\r\n$]{0,250}\*[0-9A-Fa-f]{2}")
_CLOCK = re.compile(r"([01]\d|2[0-3])([0-5]\d)([0-5]\d(?:\.\d{1,9})?|60(?:\.0{1,9})?)", re.ASCII)
_ANGLE = re.compile(r"(\d{1,3})([0-5]\d(?:\.\d{1,12})?)", re.ASCII)
_NUMBER = re.compile(r"[+-]?\d{1,9}(?:\.\d{0,12})?", re.ASCII)
_TIME_STEP_S = 1e-4  # less than the time between two fixes, more than the rounding of days
_MAX_SAME_FIX_M = 0.5  # between GGA and GNS of a fix; four decimals of a minute are 0.2 m on each axis
_FIX_SENTENCES = ("GGA", "GNS")
_DATE_SENTENCES = ("RMC", "ZDA")
_CHECKED_SENTENCES = ("GST", "DTM")  # read without pynmea2, for speed: a log may have one for each fix
_WITH_CHECKSUM = re.compile(r"\$([^*]+)\*([0-9A-Fa-f]{2})", re.ASCII)
_MAX_GST_DISTANCE_S = 5.0  # between a fix and the GST with its errors; receivers write at most one GST a second


class _Quality(NamedTuple):
    """The quality that a receiver states for a fix: its words, and the usual one-sigma error of such a fix [m].

    The words begin with the sentence that states the quality.
    """

    words: str
    typical_sigma_m: float


# GGA: 0 is no fix, 7 is manual input, 8 is a simulator. Dead reckoning is no better than an autonomous fix, a precise
# fix no better than a differential fix.
_QUALITIES = {
    "1": _Quality("GGA quality 1, autonomous", 3.0),
    "2": _Quality("GGA quality 2, differential", 1.0),
    "3": _Quality("GGA quality 3, precise", 1.0),
    "4": _Quality("GGA quality 4, RTK fixed", 0.01),
    "5": _Quality("GGA quality 5, RTK float", 0.3),
    "6": _Quality("GGA quality 6, dead reckoning", 3.0),
}
# GNS, with a mode for each system: N is no fix, M is manual input, S is a simulator.
_QUALITIES_OF_MODES = {
    "A": _Quality("GNS mode A, autonomous", 3.0),
    "D": _Quality("GNS mode D, differential", 1.0),
    "P": _Quality("GNS mode P, precise", 1.0),
    "R": _Quality("GNS mode R, RTK fixed", 0.01),
    "F": _Quality("GNS mode F, RTK float", 0.3),
    "E": _Quality("GNS mode E, dead reckoning", 3.0),
}


class _Fix(NamedTuple):
    """Line of a sentence, seconds of its day, latitude and longitude [rad], height and geoid separation [m].

    The separation is NaN if the sentence has no separation.
    """

    line: int
    seconds: float
    latitude: float
    longitude: float
    height: float
    separation: float
    quality: _Quality

    def distance(self, other: "_Fix") -> float:
        """Distance to another fix close by. [m]"""
        north = EQUATORIAL_RADIUS_M * (self.latitude - other.latitude)
        turned = math.remainder(self.longitude - other.longitude, 2 * math.pi)
        return math.hypot(north, EQUATORIAL_RADIUS_M * math.cos(self.latitude) * turned, self.height - other.height)


class _Accuracy(NamedTuple):
    """Line of a GST, seconds of its day, and one-sigma errors east, north and up [m]."""

    line: int
    seconds: float
    east: float
    north: float
    up: float


class _Datum(NamedTuple):
    """The datum of a DTM: its code, its offsets from the reference datum, and the code of the reference datum."""

    code: str
    offsets: tuple[str, str, str]
    reference: str
    is_wgs84: bool

    @property
    def words(self) -> str:
        """The datum in a sentence."""
        north, east, up = (shown(offset) for offset in self.offsets)
        datum_words = {"W84": "WGS-84 with offsets", "999": "a user datum (999)"}
        return (
            f"{datum_words.get(self.code, f'the datum {shown(self.code)}')}, {north}, {east} and {up} off "
            f"{shown(self.reference or 'its reference')}"
        )


def is_nmea(data: bytes) -> bool:
    """Whether the first megabyte of a file has a sentence with a fix or a date, and with a checksum."""
    return bool(_ANY_SENTENCE.search(data[:1_000_000]))


def read_nmea(data: bytes, name: str, keys: LogKeys) -> Log:
    """Read a log of NMEA 0183 of at most `MAX_NMEA_BYTES` bytes, as every reader of `LOG_FORMATS` does.

    Needs pynmea2. The more frequent of GGA and GNS counts. Both must have the same positions, and the worse quality
    counts.
    """
    hold_to_scale("utc", keys, name)
    hold_to_bytes(data, MAX_NMEA_BYTES, name)
    sentences = _sentences(data, name)
    talker = sentences.talker_of_fixes(keys, name)
    sentences.hold_to_datum(talker, name)
    kind = max(_FIX_SENTENCES, key=lambda kind: len(sentences.fixes[talker, kind]))
    sentences.hold_to_one_solution(talker, kind, name)
    return _log(talker, kind, sentences, name, keys)


@dataclass(eq=False)
class _Sentences:
    """Contents of the sentences of a log.

    Attributes
    ----------
    fixes : dict
        Fixes by talker and kind of sentence.
    broken : dict
        Messages about fixes that cannot be used by their lines, by talker and kind of sentence.
    dates : dict
        Lines and dates by talker.
    accuracies : dict
        Errors from GST by talker.
    datums, doubtful_datums : dict
        Lines and datums by talker: of sound sentences, and of sentences with a wrong checksum.
    undated : list of str
        Messages about impossible dates.
    lost : Counter
        Number of sentences with a wrong checksum by talker and kind.
    """

    fixes: defaultdict[tuple[str, str], list[_Fix]]
    broken: defaultdict[tuple[str, str], dict[int, str]]
    dates: defaultdict[str, list[tuple[int, Instant]]]
    accuracies: defaultdict[str, list[_Accuracy]]
    datums: defaultdict[str, list[tuple[int, _Datum]]]
    doubtful_datums: defaultdict[str, list[tuple[int, _Datum]]]
    undated: list[str]
    lost: Counter[tuple[str, str]]

    def talker_of_fixes(self, keys: LogKeys, name: str) -> str:
        """The talker whose fixes are read: the choice of the mission file, or the only talker."""
        counts = Counter[str]()
        for (talker, _), fixes in self.fixes.items():
            counts[talker] += len(fixes)
        listed = " and ".join(f"{talker} ({self._words(talker)})" for talker in sorted(+counts))
        if keys.talker is not None:
            if not counts[keys.talker]:
                hint = f"; it has fixes of {listed}" if listed else ""
                raise PathFileError(f"{name}: has no fix of the talker {keys.talker}{hint}", key="talker")
            return keys.talker
        if len(+counts) > 1:
            raise PathFileError(
                f"{name}: has fixes of {len(+counts)} talkers: {listed}; they may be those of several receivers",
                "accepted: one talker",
                f"trajectory.talker: {' or '.join(sorted(+counts))} chooses one",
            )
        if not +counts:
            broken = {line: fault for faults in self.broken.values() for line, fault in faults.items()}
            if broken or self.undated:
                raise PathFileError(broken[min(broken)] if broken else self.undated[0])
            raise PathFileError(f"{name}: has no sentence GGA or GNS with a fix{self.lost_words()}")
        return next(iter(+counts))

    def _words(self, talker: str) -> str:
        """Number of fixes of each quality of a talker, in words, the most frequent first."""
        qualities = (fix.quality.words for kind in _FIX_SENTENCES for fix in self.fixes.get((talker, kind), ()))
        return ", ".join(f"{count} of {words}" for words, count in Counter(qualities).most_common(2))

    def other_receivers(self, talker: str) -> set[str]:
        """All further talkers with fixes. Their datum and accuracy belong to their own fixes."""
        return {speaker for (speaker, _), fixes in self.fixes.items() if fixes} - {talker}

    def hold_to_datum(self, talker: str, name: str) -> None:
        """Refuse another datum than WGS-84, stated by the talker of the fixes or by a talker without fixes."""
        # A datum with a wrong checksum counts if no sound sentence states one: otherwise its fixes would pass for
        # fixes in WGS-84.
        datums = {**self.doubtful_datums, **self.datums}
        for speaker in datums.keys() - self.other_receivers(talker):
            is_sound = speaker in self.datums
            for line, datum in datums[speaker]:
                if not datum.is_wgs84:
                    verb = "says" if is_sound else "with a wrong checksum or none says"
                    raise PathFileError(
                        f"{name}:{line}: DTM {verb} that the places are of {datum.words}",
                        "accepted: WGS-84, W84 without offsets",
                        "Let the receiver, or its converter, write WGS-84",
                    )

    def hold_to_one_solution(self, talker: str, kind: str, name: str) -> None:
        """Refuse GGA and GNS of two solutions; give each fix of a kind the worse quality of both at its time."""
        other_kind = next(candidate for candidate in _FIX_SENTENCES if candidate != kind)
        fixes, other_fixes = self.fixes[talker, kind], self.fixes[talker, other_kind]
        if not other_fixes:
            return
        indices_at: defaultdict[int, list[int]] = defaultdict(list)
        for index, fix in enumerate(fixes):
            indices_at[round(fix.seconds / _TIME_STEP_S)].append(index)
        span = (fixes[0].seconds, fixes[-1].seconds)
        unmatched, distant_pairs, matched_count = [], [], 0
        worse: dict[int, _Quality] = {}
        for other_fix in other_fixes:
            indices = indices_at.get(round(other_fix.seconds / _TIME_STEP_S))
            if indices is None:
                unmatched += [other_fix] if span[0] < other_fix.seconds < span[1] else []
                continue
            # A log may have several days, so the fix nearest in the file counts.
            index = min(indices, key=lambda candidate: abs(fixes[candidate].line - other_fix.line))
            fix = fixes[index]
            matched_count += 1
            if fix.distance(other_fix) > _MAX_SAME_FIX_M:
                distant_pairs.append((fix, other_fix))
            if other_fix.quality.typical_sigma_m > fix.quality.typical_sigma_m:
                worse[index] = other_fix.quality
        if len(distant_pairs) > most_left_out(matched_count):
            fix, other_fix = max(distant_pairs, key=lambda pair: pair[0].distance(pair[1]))
            difference = f"up to {format_quantity(fix.distance(other_fix), 'm')} apart at the same time"
            line = other_fix.line
        elif len(unmatched) > matched_count:
            difference, line = "at times of their own", unmatched[0].line
        else:
            for index, quality in worse.items():
                fixes[index] = fixes[index]._replace(quality=quality)
            return
        raise PathFileError(
            f"{name}:{line}: GGA and GNS of the talker {talker} are {difference}: places of two solutions",
            f"accepted: GGA and GNS of the same places, to {format_quantity(_MAX_SAME_FIX_M, 'm')}",
            f"Leave out the sentences of one solution: {self._words(talker)}",
        )

    def dates_for(self, talker: str) -> Sequence[tuple[int, Instant]]:
        """Lines and dates of a talker, or of all talkers if the talker states no date."""
        return self.dates.get(talker) or sorted(date for dates in self.dates.values() for date in dates)

    def accuracies_for(self, talker: str) -> Sequence[_Accuracy]:
        """Errors that a talker states, or else errors from talkers without fixes, which are the same receiver."""
        speakers = self.accuracies.keys() - self.other_receivers(talker)
        return self.accuracies.get(talker) or sorted(gst for speaker in speakers for gst in self.accuracies[speaker])

    def lost_words(self) -> str:
        """Numbers of sentences that are left out for a wrong checksum or an impossible date, in words for reports."""
        lost, undated = self.lost.total(), len(self.undated)
        words = f", {counted(lost, 'sentence')} with a wrong checksum left out" if lost else ""
        return words + (f", {counted(undated, 'sentence')} without a date that there is left out" if undated else "")


def _sentences(data: bytes, name: str) -> _Sentences:
    """Read every sentence."""
    try:
        from pynmea2 import ParseError
        from pynmea2 import parse as parse_sentence
    except ImportError:
        raise PathFileError(f"{name}: needs the package pynmea2: {install_command('logs')}") from None
    sentences = _Sentences(
        fixes=defaultdict(list),
        broken=defaultdict(dict),
        dates=defaultdict(list),
        accuracies=defaultdict(list),
        datums=defaultdict(list),
        doubtful_datums=defaultdict(list),
        undated=[],
        lost=Counter(),
    )
    # Bytes of another protocol may lie between sentences: Latin-1 decodes them all.
    for number, text in enumerate(data.decode("latin-1").split("\n"), 1):
        begin = _SENTENCE.search(text)
        if begin is None:
            continue
        sentence = text[begin.start() :].rstrip()
        talker, kind = sentence[1:3], sentence[3:6]
        try:
            if len(sentence) > _MAX_SENTENCE_CHARACTERS or not sentence.isascii():
                raise ParseError("no sentence of the standard", sentence)
            is_parsed = kind not in _CHECKED_SENTENCES
            data_fields = parse_sentence(sentence, check=True).data if is_parsed else _checked_fields(sentence)
            fields = [field.strip() for field in data_fields] + [""] * 14
        except (ParseError, ValueError):
            sentences.lost[talker, kind] += 1
            if kind == "DTM":
                datum = _dtm(_unchecked_fields(sentence), name, number)
                sentences.doubtful_datums[talker] += [] if datum is None else [(number, datum)]
            continue
        try:
            value = _READERS[kind](fields, f"{name}:{number}: {kind}", number)
        except PathFileError as fault:
            if kind in _FIX_SENTENCES:
                sentences.broken[talker, kind][number] = str(fault)
            elif kind in _DATE_SENTENCES:
                sentences.undated.append(str(fault))
            continue
        if isinstance(value, _Fix):
            sentences.fixes[talker, kind].append(value)
        elif isinstance(value, Instant):
            sentences.dates[talker].append((number, value))
        elif isinstance(value, _Accuracy):
            sentences.accuracies[talker].append(value)
        elif isinstance(value, _Datum):
            sentences.datums[talker].append((number, value))
    return sentences


def _log(talker: str, kind: str, sentences: _Sentences, name: str, keys: LogKeys) -> Log:
    """The log from the sentences of a talker and a kind."""
    fixes, dates = sentences.fixes[talker, kind], sentences.dates_for(talker)
    broken, lost = sentences.broken.get((talker, kind), {}), sentences.lost[talker, kind]
    records = LogRecords(name, len(fixes), [fix.line for fix in fixes], broken, lost)
    latitude, longitude, height, separation = np.array([fix[2:6] for fix in fixes], dtype=float).T
    lacks_separation = np.isnan(separation)
    if not lacks_separation.all():
        records.leave_out(lacks_separation, lambda _: f"{kind} has no geoid separation, others have one")
    separations = None if lacks_separation.all() else separation
    heights = from_sea_level(height, separations, keys, name)
    days, seconds = _dated(fixes, dates, fixes[len(fixes) // 2].seconds)
    times, start = days * DAY + seconds, None
    if dates:
        start = Instant(int(days[0]), float(seconds[0]))
        times = (days - days[0]) * DAY + (seconds - seconds[0])
    words = f"NMEA 0183 {kind}" + (f" of the talker {talker}" if keys.talker else "") + sentences.lost_words()
    log = geodetic_log(records, words, times, start, "utc", (latitude, longitude, heights))
    qualities = [fix.quality for fix, is_usable in zip(fixes, records.is_usable.tolist(), strict=True) if is_usable]
    # Without dates, times of day are those of day 0 or of its neighbours.
    times_of_usable = (days * DAY + seconds)[records.is_usable]
    return replace(
        log,
        clock="" if dates else "day",
        sigmas=_sigmas(times_of_usable, sentences.accuracies_for(talker), dates, fixes[len(fixes) // 2].seconds),
        typical_sigmas=np.array([quality.typical_sigma_m for quality in qualities]),
        quality_words=lambda i: qualities[i].words,
    )


def _sigmas(
    times: Floats, stated: Sequence[_Accuracy], dates: Sequence[tuple[int, Instant]], middle: float
) -> Floats | None:
    """One-sigma errors (n, 3) of fixes at rising times. [m]

    The larger error of the GST before a fix and the GST after it. NaN at a fix without a GST within 5 s; None if no
    fix has a GST.
    """
    if not stated:
        return None
    days, seconds = _dated(stated, dates, middle)
    gst_times = days * DAY + seconds
    order = np.argsort(gst_times, kind="stable")
    gst_times, gst_sigmas = gst_times[order], np.array([gst[2:] for gst in stated])[order]
    sigmas = np.full((len(times), 3), np.nan)
    after = np.searchsorted(gst_times, times - _TIME_STEP_S, "left")
    for index in (after, np.searchsorted(gst_times, times + _TIME_STEP_S, "right") - 1):
        index = np.clip(index, 0, len(gst_times) - 1)
        is_near = np.abs(gst_times[index] - times) <= _MAX_GST_DISTANCE_S
        sigmas = np.where(is_near[:, None], np.fmax(sigmas, gst_sigmas[index]), sigmas)
    return None if np.isnan(sigmas).all() else sigmas


def _dated(
    fixes: Sequence[_Fix | _Accuracy], dates: Sequence[tuple[int, Instant]], middle: float
) -> tuple[Floats, Floats]:
    """Modified Julian days and seconds of the day of fixes.

    A fix lies within half a day of the latest date before it, or of the first date. Without dates, days count from
    the day of the fix in the middle of the log, at `middle` seconds of the day.
    """
    seconds = np.array([fix.seconds for fix in fixes])
    if not dates:
        return np.round((middle - seconds) / DAY), seconds
    before = np.searchsorted([line for line, _ in dates], [fix.line for fix in fixes], "right") - 1
    latest_dates = np.array([[date.day, date.seconds] for _, date in dates])[np.maximum(before, 0)]
    return latest_dates[:, 0] + np.round((latest_dates[:, 1] - seconds) / DAY), seconds


# ---------------------------------------------------------------------- sentences
def _checked_fields(sentence: str) -> list[str]:
    """Fields of a sentence with a right checksum, as pynmea2 splits them, in a tenth of its time."""
    match = _WITH_CHECKSUM.fullmatch(sentence)
    if match is None or reduce(xor, match[1].encode()) != int(match[2], 16):
        raise ValueError("wrong checksum")
    return match[1].split(",")[1:]


def _unchecked_fields(sentence: str) -> list[str]:
    """Fields of a sentence with any checksum, followed by empty fields."""
    return [field.strip() for field in sentence.partition("*")[0].split(",")[1:]] + [""] * 14


def _refused(location: str, problem: str, text: str) -> NoReturn:
    raise PathFileError(f"{location} {problem} (got {shown(text)!r})")


def _clock(text: str, location: str) -> float:
    match = _CLOCK.fullmatch(text)
    if match is None:
        _refused(location, "must have a time like 052001.25", text)
    return int(match[1]) * 3600.0 + int(match[2]) * 60.0 + float(match[3])  # 59.996 is rounded to 60.00


def _angle(text: str, side: str, sides: str, location: str) -> float:
    match = _ANGLE.fullmatch(text)
    if match is None or side not in (sides[0], sides[1]):
        _refused(
            location, f"must have degrees and minutes like 4805.196, and {sides[0]} or {sides[1]}", f"{text},{side}"
        )
    return float(np.radians((int(match[1]) + float(match[2]) / 60) * (1 if side == sides[0] else -1)))


def _metres(text: str, unit: str, location: str) -> float:
    if not _NUMBER.fullmatch(text) or unit != "M":
        _refused(location, "must have a height and a geoid separation in M", f"{text},{unit}")
    return float(text)


def _fix(
    fields: Sequence[str], location: str, line: int, quality: _Quality | None, height: Sequence[str]
) -> _Fix | None:
    """A fix; None without a quality. `height` has the fields height and unit, separation and unit."""
    if quality is None:
        return None
    altitude, unit, separation, separation_unit = height
    return _Fix(
        line,
        _clock(fields[0], location),
        _angle(fields[1], fields[2], "NS", location),
        _angle(fields[3], fields[4], "EW", location),
        _metres(altitude, unit, location),
        _metres(separation, separation_unit, location) if separation else math.nan,
        quality,
    )


def _gga(fields: Sequence[str], location: str, line: int) -> _Fix | None:
    return _fix(fields, location, line, _QUALITIES.get(fields[5]), fields[8:12])


def _gns(fields: Sequence[str], location: str, line: int) -> _Fix | None:
    modes = (_QUALITIES_OF_MODES[mode] for mode in fields[5] if mode in _QUALITIES_OF_MODES)
    worst = max(modes, key=lambda mode: mode.typical_sigma_m, default=None)
    return _fix(fields, location, line, worst, (fields[8], "M", fields[9], "M"))


def _gst(fields: Sequence[str], location: str, line: int) -> _Accuracy | None:
    north, east, up = (float(field) if _NUMBER.fullmatch(field) else math.nan for field in fields[5:8])
    is_stated = all(sigma > 0 for sigma in (north, east, up))  # a receiver without a fix writes zeros, or nothing
    return _Accuracy(line, _clock(fields[0], location), east, north, up) if is_stated and fields[0] else None


def _dtm(fields: Sequence[str], location: str, line: int) -> _Datum | None:
    """A datum; None if the receiver leaves its code empty."""
    code, subdivision, north, north_side, east, east_side, up, reference = fields[:8]
    offsets = (f"{north}' {north_side}", f"{east}' {east_side}", f"{up} m")
    is_zero = all(number_in(offset or "0") == 0 for offset in (north, east, up))
    name = f"{code}-{subdivision}" if subdivision else code
    return _Datum(name, offsets, reference, is_wgs84=code == "W84" and is_zero) if code else None


def _rmc(fields: Sequence[str], location: str, line: int) -> Instant | None:
    if fields[1] != "A" or not fields[8]:
        return None
    date = fields[8]
    if not re.fullmatch(r"\d{6}", date, re.ASCII):
        _refused(location, "must have a date like 010626", date)
    century = "19" if int(date[4:]) >= 80 else "20"  # as RTKLIB has it; GPS began in 1980
    return _dated_at(f"{century}{date[4:]}-{date[2:4]}-{date[:2]}", fields[0], date, location)


def _zda(fields: Sequence[str], location: str, line: int) -> Instant | None:
    day, month, year = fields[1:4]
    if not (fields[0] and day and month and year):
        return None
    return _dated_at(f"{year:>04}-{month:>02}-{day:>02}", fields[0], f"{day},{month},{year}", location)


def _dated_at(date: str, clock: str, text: str, location: str) -> Instant:
    day = _day(date)
    if day is None:
        _refused(location, "must have a date that there is", text)
    return Instant(day, _clock(clock, location))


@lru_cache(maxsize=64)
def _day(date: str) -> int | None:
    """Modified Julian day of a date like 2026-06-01; None for an impossible date."""
    midnight = parse_instant(f"{date}T00:00:00Z")
    return None if midnight is None else midnight.day


_READERS: dict[str, Callable[[Sequence[str], str, int], _Fix | _Accuracy | _Datum | Instant | None]] = {
    "GGA": _gga,
    "GNS": _gns,
    "RMC": _rmc,
    "ZDA": _zda,
    "GST": _gst,
    "DTM": _dtm,
}
