"""Reader of NMEA 0183 logs: positions from GGA or GNS sentences and dates from RMC or ZDA sentences, in UTC.

    $GNRMC,052001.25,A,4805.196000,N,01116.782000,E,116.6,045.0,010626,,,R*43
    $GNGGA,052001.25,4805.196000,N,01116.782000,E,4,12,0.7,2953.100,M,46.900,M,1.0,0000*7C
    $GNGST,052001.25,0.012,0.011,0.008,45.0,0.010,0.008,0.020*7C

The height in a sentence is above mean sea level. The geoid separation in the same sentence converts it to a height
above the ellipsoid. The log may have other lines between the sentences, and other text before a sentence on its line.
All fixes come from a single talker, which is named by the first two letters of a sentence.

A sentence with a wrong or missing checksum is left out and counted. For a DTM sentence, this applies only if the
talker has another DTM sentence with a correct checksum. GST states 1-sigma errors of latitude, longitude and
height. Some receivers state only the semi-major axis of the horizontal error ellipse. DTM states the datum, which
must be W84. Without a date, the times of fixes are times of day.

Source: NMEA 0183 4.10 as RTKLIB 2.4.3 reads it (src/solution.c, decode_nmeagga, decode_nmearmc, decode_nmeazda: a
time of day is within half a day of the date that precedes it). The fields of GNS, GST and DTM have the same meanings
as in the package pynmea2.
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
from bisar_budget.paths.instant import DAY_S, Instant, parse_instant
from bisar_budget.paths.log_places import (
    LogKeys,
    LogRecords,
    counted,
    from_sea_level,
    geodetic_log,
    hold_to_scale,
    known_sigmas,
    most_left_out,
)
from bisar_budget.paths.messages import number_in
from bisar_budget.units import format_quantity

MAX_NMEA_BYTES = 200_000_000  # ten hours at 10 Hz of eight sentences
_MAX_SENTENCE_CHARACTERS = 256  # the standard has 82
_SENTENCE = re.compile(r"\$[A-Z]{2}(?:GGA|GNS|RMC|ZDA|GST|DTM),", re.ASCII)
_ANYWHERE = re.compile(rb"\$[A-Z]{2}(?:GGA|GNS|RMC|ZDA),[^\r\n$]{0,250}\*[0-9A-Fa-f]{2}")
_UTC_TIME_PATTERN = re.compile(r"([01]\d|2[0-3])([0-5]\d)([0-5]\d(?:\.\d{1,9})?|60(?:\.0{1,9})?)", re.ASCII)
_ANGLE_PATTERN = re.compile(r"(\d{1,3})([0-5]\d(?:\.\d{1,12})?)", re.ASCII)
_HEIGHT_PATTERN = re.compile(r"[+-]?\d{1,9}(?:\.\d{0,12})?", re.ASCII)
_TIME_STEP_S = 1e-4  # smaller than the interval of fixes, and larger than the rounding of days
_SAME_PLACE_M = 0.5  # largest distance of equal positions in two sentences; 1e-4 minute of arc is 0.2 m
_FIX_SENTENCES = ("GGA", "GNS")  # kinds with a position
_DATES = ("RMC", "ZDA")
_COMPANION_SENTENCES = ("GST", "DTM")  # kinds that come with a fix, at most one each
_CHECKED = re.compile(r"\$([^*]+)\*([0-9A-Fa-f]{2})", re.ASCII)
_REFERENCES = ("W84", "")  # of DTM; other reference datums are refused, because their offsets are not from WGS-84
_GST_REACH_S = 5.0  # largest time from a fix to a GST that applies to it; receivers write GST less often than fixes


class _Quality(NamedTuple):
    """Quality of a fix as stated by the receiver: a description for reports, and the typical 1-sigma error. [m]

    The description begins with the kind of sentence that states the quality.
    """

    words: str
    typical_sigma_m: float


# Qualities of GGA. Not listed: 0 is no fix, 7 is manual input, 8 is a simulator. Dead reckoning counts as an
# autonomous fix, and a precise fix as a differential fix.
_QUALITIES = {
    "1": _Quality("GGA quality 1, autonomous", 3.0),
    "2": _Quality("GGA quality 2, differential", 1.0),
    "3": _Quality("GGA quality 3, precise", 1.0),
    "4": _Quality("GGA quality 4, RTK fixed", 0.01),
    "5": _Quality("GGA quality 5, RTK float", 0.3),
    "6": _Quality("GGA quality 6, dead reckoning", 3.0),
}
# Modes of GNS, a letter for each system. Not listed: N is no fix, M is manual input, S is a simulator.
_MODES = {
    "A": _Quality("GNS mode A, autonomous", 3.0),
    "D": _Quality("GNS mode D, differential", 1.0),
    "P": _Quality("GNS mode P, precise", 1.0),
    "R": _Quality("GNS mode R, RTK fixed", 0.01),
    "F": _Quality("GNS mode F, RTK float", 0.3),
    "E": _Quality("GNS mode E, dead reckoning", 3.0),
}


class _Fix(NamedTuple):
    """A fix: line of the sentence, second of the day, latitude and longitude [rad], height and geoid separation [m].

    The separation is NaN if the sentence does not state it.
    """

    line: int
    seconds: float
    latitude: float
    longitude: float
    height: float
    separation: float
    quality: _Quality

    def distance(self, other: "_Fix") -> float:
        """Approximate distance to a fix that is close to this fix. [m]"""
        north = EQUATORIAL_RADIUS_M * (self.latitude - other.latitude)
        turned = math.remainder(self.longitude - other.longitude, 2 * math.pi)
        return math.hypot(north, EQUATORIAL_RADIUS_M * math.cos(self.latitude) * turned, self.height - other.height)


class _Accuracy(NamedTuple):
    """A GST sentence: line, second of the day, and 1-sigma errors east, north and up [m].

    An unknown error is NaN. `unusable` is the number of values in the sentence that are not valid errors.
    """

    line: int
    seconds: float
    east: float
    north: float
    up: float
    unusable: int = 0

    @property
    def sigmas(self) -> tuple[float, float, float]:
        return (self.east, self.north, self.up)


class _Datum(NamedTuple):
    """Datum stated by a DTM sentence: its code, its offsets from a reference datum, and the reference's code."""

    code: str
    offsets: tuple[str, str, str]
    reference: str
    is_wgs84: bool

    @property
    def words(self) -> str:
        """Description of the datum and its offsets, for a message."""
        north, east, up = (shown(offset) for offset in self.offsets)
        code_words = {"999": "a user datum (999)", "": "a datum without a code"}
        if self.reference in _REFERENCES:
            code_words["W84"] = "WGS-84 with offsets"
        return (
            f"{code_words.get(self.code, f'the datum {shown(self.code)}')}, {north}, {east} and {up} off "
            f"{shown(self.reference or 'its reference')}"
        )


def is_nmea(data: bytes) -> bool:
    """Whether a sentence in the first megabyte of a file has a checksum, and states a position or a date."""
    return bool(_ANYWHERE.search(data[:1_000_000]))


def read_nmea(data: bytes, name: str, keys: LogKeys) -> Log:
    """Read an NMEA 0183 log of at most `MAX_NMEA_BYTES` bytes.

    The arguments and errors are the same for all readers; see `LogFormat.read`. The fixes come from GGA or GNS
    sentences, whichever are more numerous. If a log has both, their positions must agree, and the worse quality is
    used. The package pynmea2 is required.
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
    """Content of all sentences of a log that are used.

    A talker is named by the first two letters of a sentence. Fixes are grouped by talker and kind of sentence; dates,
    accuracies and datums are grouped by talker. Dates and datums are stored with their lines. `broken` contains
    messages about unusable fixes, by line. `undated` contains messages about invalid dates. `lost` counts sentences
    with a wrong checksum. `doubtful_datums` are the datums of DTM sentences with a wrong checksum. `unusable` counts
    invalid values in GST sentences by talker.
    """

    fixes: defaultdict[tuple[str, str], list[_Fix]]
    broken: defaultdict[tuple[str, str], dict[int, str]]
    dates: defaultdict[str, list[tuple[int, Instant]]]
    accuracies: defaultdict[str, list[_Accuracy]]
    datums: defaultdict[str, list[tuple[int, _Datum]]]
    doubtful_datums: defaultdict[str, list[tuple[int, _Datum]]]
    undated: list[str]
    lost: Counter[tuple[str, str]]
    unusable: Counter[str]

    def talker_of_fixes(self, keys: LogKeys, name: str) -> str:
        """Talker whose fixes are read: the talker that the mission file chooses, or the only talker with fixes."""
        counts = Counter[str]()
        for (talker, _), fixes in self.fixes.items():
            counts[talker] += len(fixes)
        listed = " and ".join(f"{talker} ({self._words(talker)})" for talker in sorted(+counts))
        if keys.talker is not None:
            if not counts[keys.talker]:
                alternatives = f"; it has fixes of {listed}" if listed else ""
                raise PathFileError(f"{name}: has no fix of the talker {keys.talker}{alternatives}", key="talker")
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
        """Phrase with the two most frequent qualities of a talker's fixes, and the number of fixes of each."""
        of_talker = (fix.quality.words for kind in _FIX_SENTENCES for fix in self.fixes.get((talker, kind), ()))
        return ", ".join(f"{count} of {words}" for words, count in Counter(of_talker).most_common(2))

    def other_receivers(self, talker: str) -> set[str]:
        """All talkers with fixes other than `talker`.

        They are separate receivers, so the datums and accuracies that they state do not apply to `talker`.
        """
        return {speaker for (speaker, _), fixes in self.fixes.items() if fixes} - {talker}

    def hold_to_datum(self, talker: str, name: str) -> None:
        """Refuse a log whose datum is not WGS-84.

        The datums stated by `talker` are checked. The datums stated by talkers without fixes are also checked,
        because such talkers are further names of the same receiver.
        """
        # DTM sentences with a wrong checksum count if a talker has no others: without them, WGS-84 would be assumed.
        datums = {**self.doubtful_datums, **self.datums}
        for speaker in datums.keys() - self.other_receivers(talker):
            is_sound = speaker in self.datums
            for line, datum in datums[speaker]:
                if not datum.is_wgs84:
                    says = "says" if is_sound else "with a wrong checksum or none says"
                    raise PathFileError(
                        f"{name}:{line}: DTM {says} that the positions are of {datum.words}",
                        "accepted: WGS-84, W84 without offsets",
                        "Let the receiver, or its converter, write WGS-84",
                    )

    def hold_to_one_solution(self, talker: str, kind: str, name: str) -> None:
        """Refuse a log in which GGA and GNS sentences have positions from two different solutions.

        If the positions agree, each fix of `kind` gets the worse quality of the two sentences for the same time.
        """
        other_kind = next(candidate for candidate in _FIX_SENTENCES if candidate != kind)
        fixes, counterparts = self.fixes[talker, kind], self.fixes[talker, other_kind]
        if not counterparts:
            return
        at: defaultdict[int, list[int]] = defaultdict(list)
        for index, fix in enumerate(fixes):
            at[round(fix.seconds / _TIME_STEP_S)].append(index)
        between = (fixes[0].seconds, fixes[-1].seconds)
        alone, apart, alike = [], [], 0
        worse: dict[int, _Quality] = {}
        for counterpart in counterparts:
            candidates = at.get(round(counterpart.seconds / _TIME_STEP_S))
            if candidates is None:
                alone += [counterpart] if between[0] < counterpart.seconds < between[1] else []
                continue
            index = min(
                candidates, key=lambda candidate: abs(fixes[candidate].line - counterpart.line)
            )  # if the log covers several days, the time occurs on each of them
            fix = fixes[index]
            alike += 1
            if fix.distance(counterpart) > _SAME_PLACE_M:
                apart.append((fix, counterpart))
            if counterpart.quality.typical_sigma_m > fix.quality.typical_sigma_m:
                worse[index] = counterpart.quality
        if len(apart) > most_left_out(alike):
            fix, counterpart = max(apart, key=lambda pair: pair[0].distance(pair[1]))
            says = f"up to {format_quantity(fix.distance(counterpart), 'm')} apart at the same time"
            at_line = counterpart.line
        elif len(alone) > alike:
            says, at_line = "at times of their own", alone[0].line
        else:
            for index, quality in worse.items():
                fixes[index] = fixes[index]._replace(quality=quality)
            return
        raise PathFileError(
            f"{name}:{at_line}: GGA and GNS of the talker {talker} are {says}: positions of two solutions",
            f"accepted: GGA and GNS of the same positions, to {format_quantity(_SAME_PLACE_M, 'm')}",
            f"Leave out the sentences of one solution: {self._words(talker)}",
        )

    def dates_for(self, talker: str) -> Sequence[tuple[int, Instant]]:
        """Dates that a talker states, each with its line; if it states no date, the dates of all talkers."""
        return self.dates.get(talker) or sorted(date for dates in self.dates.values() for date in dates)

    def accuracies_for(self, talker: str) -> Sequence[_Accuracy]:
        """GST sentences of a talker; if there are no such sentences, the GST sentences of all talkers without fixes.

        A talker without fixes is another name of the same receiver.
        """
        speakers = self.accuracies.keys() - self.other_receivers(talker)
        return self.accuracies.get(talker) or sorted(gst for speaker in speakers for gst in self.accuracies[speaker])

    def unusable_words(self, talker: str) -> str:
        """Phrase with the number of invalid values in GST sentences; empty if all values are valid.

        Sentences of `talker` and of talkers without fixes are counted.
        """
        count = sum(self.unusable[speaker] for speaker in self.unusable.keys() - self.other_receivers(talker))
        return f", {counted(count, 'figure')} of accuracy that cannot be used left out" if count else ""

    def lost_words(self) -> str:
        """Phrase with the number of sentences with a wrong checksum or an invalid date; empty if all are valid."""
        lost, undated = self.lost.total(), len(self.undated)
        words = f", {counted(lost, 'sentence')} with a wrong checksum left out" if lost else ""
        return words + (f", {counted(undated, 'sentence')} without a date that there is left out" if undated else "")


def _sentences(data: bytes, name: str) -> _Sentences:
    """Read all sentences of a log; raises `PathFileError` if the package pynmea2 is not installed."""
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
        unusable=Counter(),
    )
    # Bytes of another protocol between sentences are no text.
    for number, text in enumerate(data.decode("latin-1").split("\n"), 1):
        begin = _SENTENCE.search(text)
        if begin is None:
            continue
        sentence = text[begin.start() :].rstrip()
        talker, kind = sentence[1:3], sentence[3:6]
        try:
            if len(sentence) > _MAX_SENTENCE_CHARACTERS or not sentence.isascii():
                raise ParseError("no sentence of the standard", sentence)
            data_fields = (
                _checked_fields(sentence)
                if kind in _COMPANION_SENTENCES
                else parse_sentence(sentence, check=True).data
            )
            fields = [field.strip() for field in data_fields] + [""] * 14
        except (ParseError, ValueError):
            sentences.lost[talker, kind] += 1
            if kind == "DTM":
                datum = _dtm(_unchecked_fields(sentence), name, number)
                sentences.doubtful_datums[talker] += [] if datum is None else [(number, datum)]
            continue
        try:
            read_one = _READERS[kind](fields, f"{name}:{number}: {kind}", number)
        except PathFileError as fault:
            if kind in _FIX_SENTENCES:
                sentences.broken[talker, kind][number] = str(fault)
            elif kind in _DATES:
                sentences.undated.append(str(fault))
            elif kind == "GST":
                sentences.unusable[talker] += 1
            continue
        if isinstance(read_one, _Fix):
            sentences.fixes[talker, kind].append(read_one)
        elif isinstance(read_one, Instant):
            sentences.dates[talker].append((number, read_one))
        elif isinstance(read_one, _Accuracy):
            sentences.unusable[talker] += read_one.unusable
            if not all(map(math.isnan, read_one.sigmas)):
                sentences.accuracies[talker].append(read_one)
        elif isinstance(read_one, _Datum):
            sentences.datums[talker].append((number, read_one))
    return sentences


def _log(talker: str, kind: str, sentences: _Sentences, name: str, keys: LogKeys) -> Log:
    """Make a log from the fixes of a talker in sentences of the given kind, GGA or GNS."""
    fixes, dates = sentences.fixes[talker, kind], sentences.dates_for(talker)
    records = LogRecords(
        name,
        len(fixes),
        [fix.line for fix in fixes],
        sentences.broken.get((talker, kind), {}),
        sentences.lost[talker, kind],
    )
    latitude, longitude, height, separation = np.array([fix[2:6] for fix in fixes], dtype=float).T
    has_none = np.isnan(separation)
    if not has_none.all():
        records.leave_out(has_none, lambda _: f"{kind} has no geoid separation, others have one")
    separations = None if has_none.all() else separation
    heights = from_sea_level(height, separations, keys, name)
    days, seconds = _dated(fixes, dates, fixes[len(fixes) // 2].seconds)
    times, start = days * DAY_S + seconds, None
    if dates:
        start = Instant(int(days[0]), float(seconds[0]))
        times = (days - days[0]) * DAY_S + (seconds - seconds[0])
    words = f"NMEA 0183 {kind}" + (f" of the talker {talker}" if keys.talker else "") + sentences.lost_words()
    words += sentences.unusable_words(talker)
    log = geodetic_log(records, words, times, start, "utc", (latitude, longitude, heights))
    qualities = [fix.quality for fix, is_usable in zip(fixes, records.is_usable.tolist(), strict=True) if is_usable]
    # Without dates, times are counted from day 0, and may lie on the days next to it.
    at = (days * DAY_S + seconds)[records.is_usable]
    return replace(
        log,
        clock="" if dates else "day",
        sigmas=_sigmas(at, sentences.accuracies_for(talker), dates, fixes[len(fixes) // 2].seconds),
        typical_sigmas=np.array([quality.typical_sigma_m for quality in qualities]),
        quality_words=lambda i: qualities[i].words,
    )


def _sigmas(
    times: Floats, stated: Sequence[_Accuracy], dates: Sequence[tuple[int, Instant]], middle: float
) -> Floats | None:
    """1-sigma errors (n, 3) east, north, up of fixes, taken from GST sentences. [m]

    `times` [s] are the ascending times of the fixes. Each error of a fix is the larger of the errors in the GST
    sentences before and after the fix. Sentences more than 5 s from the fix are ignored. An error is NaN if no
    sentence states it. Returns None if no fix has an error.
    """
    if not stated:
        return None
    days, seconds = _dated(stated, dates, middle)
    at = days * DAY_S + seconds
    order = np.argsort(at, kind="stable")
    at, figures = at[order], np.array([gst.sigmas for gst in stated])[order]
    sigmas = np.full((len(times), 3), np.nan)
    behind = np.searchsorted(at, times - _TIME_STEP_S, "left")
    for index in (behind, np.searchsorted(at, times + _TIME_STEP_S, "right") - 1):
        index = np.clip(index, 0, len(at) - 1)
        is_near = np.abs(at[index] - times) <= _GST_REACH_S
        sigmas = np.where(is_near[:, None], np.fmax(sigmas, figures[index]), sigmas)
    return known_sigmas(sigmas)


def _dated(
    fixes: Sequence[_Fix | _Accuracy], dates: Sequence[tuple[int, Instant]], middle: float
) -> tuple[Floats, Floats]:
    """Modified Julian days of fixes, and their seconds of the day.

    A fix is assumed to be within half a day of the last date that precedes it, or of the first date if no date
    precedes it. If there are no dates, days are counted from the day of the fix in the middle of the log. `middle` is
    the second of the day of this fix.
    """
    seconds = np.array([fix.seconds for fix in fixes])
    if not dates:
        return np.round((middle - seconds) / DAY_S), seconds
    before = np.searchsorted([line for line, _ in dates], [fix.line for fix in fixes], "right") - 1
    dated = np.array([[date.day, date.seconds] for _, date in dates])[np.maximum(before, 0)]
    return dated[:, 0] + np.round((dated[:, 1] - seconds) / DAY_S), seconds


# ---------------------------------------------------------------------- sentences
def _checked_fields(sentence: str) -> list[str]:
    """Split a sentence into its fields; raises `ValueError` if the checksum is missing or wrong.

    The result is the same as from pynmea2, which takes ten times as long.
    """
    match = _CHECKED.fullmatch(sentence)
    if match is None or reduce(xor, match[1].encode()) != int(match[2], 16):
        raise ValueError("wrong checksum")
    return match[1].split(",")[1:]


def _unchecked_fields(sentence: str) -> list[str]:
    """Split a sentence into its fields without verifying the checksum, and append 14 empty fields."""
    return [field.strip() for field in sentence.partition("*")[0].split(",")[1:]] + [""] * 14


def _refused(where: str, says: str, value: str) -> NoReturn:
    raise PathFileError(f"{where} {says} (got {shown(value)!r})")


def _clock(text: str, where: str) -> float:
    match = _UTC_TIME_PATTERN.fullmatch(text)
    if match is None:
        _refused(where, "must have a time like 052001.25", text)
    return int(match[1]) * 3600.0 + int(match[2]) * 60.0 + float(match[3])  # receivers round 59.996 to 60.00


def _angle(text: str, side: str, sides: str, where: str) -> float:
    match = _ANGLE_PATTERN.fullmatch(text)
    if match is None or side not in (sides[0], sides[1]):
        _refused(
            where, f"must have degrees and minutes like 4805.196, and {sides[0]} or {sides[1]}", f"{text},{side}"
        )
    return float(np.radians((int(match[1]) + float(match[2]) / 60) * (1 if side == sides[0] else -1)))


def _metres(text: str, unit: str, where: str) -> float:
    if not _HEIGHT_PATTERN.fullmatch(text) or unit != "M":
        _refused(where, "must have a height and a geoid separation in M", f"{text},{unit}")
    return float(text)


def _fix(
    fields: Sequence[str], where: str, line: int, quality: _Quality | None, height: Sequence[str]
) -> _Fix | None:
    """Make a fix from the fields of a sentence; None if `quality` is None, because there is then no position.

    `height` has four fields: height, unit of the height, geoid separation, and unit of the separation.
    """
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
    cells = (fields[2], *fields[5:8])
    numbers = [number_in(field) for field in cells]
    unusable = sum(
        field != "" and (number is None or number < 0) for field, number in zip(cells, numbers, strict=True)
    )
    # A receiver without a fix writes zeros, or nothing.
    semi_major, north, east, up = (number if number is not None and number > 0 else math.nan for number in numbers)
    if all(map(math.isnan, (semi_major, north, east, up))) and not unusable:
        return None
    if semi_major > math.hypot(north, east) or math.isnan(north + east):
        # The semi-major axis is the upper bound for each axis. It is used if axes are missing or contradict it.
        north, east = (float(np.fmax(sigma, semi_major)) for sigma in (north, east))
    return _Accuracy(line, _clock(fields[0], where), east, north, up, unusable)


def _dtm(fields: Sequence[str], where: str, line: int) -> _Datum | None:
    """Read the datum from the fields of a DTM sentence; None if the sentence states no datum."""
    code, subdivision, north, north_side, east, east_side, up, reference = fields[:8]
    offsets = (f"{north or 0}' {north_side}".strip(), f"{east or 0}' {east_side}".strip(), f"{up or 0} m")
    is_zero = all(number_in(offset or "0") == 0 for offset in (north, east, up))
    name = f"{code}-{subdivision}" if subdivision else code
    if not code and is_zero and reference in _REFERENCES:
        return None
    is_wgs84 = code == "W84" and is_zero and reference in _REFERENCES
    return _Datum(name, offsets, reference, is_wgs84=is_wgs84)


def _rmc(fields: Sequence[str], where: str, line: int) -> Instant | None:
    if fields[1] != "A" or not fields[8]:
        return None
    date = fields[8]
    if not re.fullmatch(r"\d{6}", date, re.ASCII):
        _refused(where, "must have a date like 010626", date)
    century = "19" if int(date[4:]) >= 80 else "20"  # as in RTKLIB; GPS began in 1980
    return _dated_at(f"{century}{date[4:]}-{date[2:4]}-{date[:2]}", fields[0], date, where)


def _zda(fields: Sequence[str], where: str, line: int) -> Instant | None:
    day, month, year = fields[1:4]
    if not (fields[0] and day and month and year):
        return None
    return _dated_at(f"{year:>04}-{month:>02}-{day:>02}", fields[0], f"{day},{month},{year}", where)


def _dated_at(date: str, clock: str, text: str, where: str) -> Instant:
    day = _day(date)
    if day is None:
        _refused(where, "must have a date that there is", text)
    return Instant(day, _clock(clock, where))


@lru_cache(maxsize=64)
def _day(date: str) -> int | None:
    """Modified Julian day of a date such as 2026-06-01; None if there is no such date."""
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
