"""Instants in UTC with an error below a nanosecond, and conversions to and from other time systems."""

import re
from bisect import bisect_right
from calendar import isleap
from datetime import UTC, date, datetime, timedelta
from typing import NamedTuple

DAY_S = 86400.0
WEEK_S = 604800.0  # s
GPS_EPOCH_DAY = 44244  # MJD of 1980-01-06
UNIX_EPOCH_DAY = 40587  # MJD of 1970-01-01
_MJD_EPOCH_DAY = 678576  # `date.toordinal` of 1858-11-17, the day 0 of MJD
_ROUNDED_MINUTE = re.compile(r"(.*:)60((?:[.,]0{1,12})?(?:Z|[+-]\d\d:?\d\d)?)", re.ASCII)
_ISO_8601 = re.compile(
    r"(\d{4})-(\d\d)-(\d\d)[T ](\d\d):(\d\d):(\d\d)(?:[.,](\d{1,12}))?(Z|[+-]\d\d:?\d\d)?", re.ASCII
)
_MAX_OFFSET_HOURS = 18  # of a local time from UTC, the limit in common readers of ISO 8601


class Instant(NamedTuple):
    """Instant in UTC: modified Julian day, and seconds of the day.

    Two numbers are needed for precision: at 7.5 km/s an error of 10 ns is 0.1 mm.
    """

    day: int
    seconds: float

    def after(self, seconds: float) -> "Instant":
        """Add a number of seconds to the instant, ignoring leap seconds."""
        days, remainder = divmod(self.seconds + seconds, DAY_S)
        return Instant(self.day + int(days), remainder)

    def since(self, other: "Instant") -> float:
        """Time from the instant `other` to this instant, ignoring leap seconds. [s]"""
        return (self.day - other.day) * DAY_S + (self.seconds - other.seconds)

    def as_text(self) -> str:
        """Format the instant as text such as 2026-06-01T05:20:31.250Z, rounded to a millisecond.

        For an instant outside the years 1 to 9999, the text is the modified Julian day, such as `MJD -700000.50000`.
        """
        try:
            moment = Instant(self.day, round(self.seconds, 3)).as_datetime()
        except OverflowError:
            return f"MJD {self.day + self.seconds / DAY_S:.5f}"
        return moment.strftime("%Y-%m-%dT%H:%M:%S.") + f"{moment.microsecond // 1000:03d}Z"

    def as_datetime(self) -> datetime:
        """Convert to a datetime, rounded to a microsecond; raises `OverflowError` outside the years 1 to 9999."""
        return datetime(1858, 11, 17, tzinfo=UTC) + timedelta(days=self.day, seconds=self.seconds)


def day_of_year(year: int, day: int) -> int | None:
    """Convert a year and a day of the year (from 1) to a modified Julian day; None if there is no such day."""
    return date(year, 1, 1).toordinal() - _MJD_EPOCH_DAY + day - 1 if 1 <= day <= 365 + isleap(year) else None


def parse_instant(text: str, *, needs_zone: bool = True) -> Instant | None:
    """Read an instant such as 2026-06-01T05:20:31.250Z; None if the text is not an instant.

    The Z may be replaced by an offset from UTC such as +01:00. If `needs_zone`, the result is None for a text without
    Z or an offset; otherwise such a text is read as UTC.
    """
    match = _ISO_8601.fullmatch(text.strip())
    if match is None or (needs_zone and not match[8]):
        return None
    year, month, day, hour, minute, second = (int(field) for field in match.groups()[:6])
    if hour > 23 or minute > 59 or second > 59:
        return None
    try:
        ordinal = date(year, month, day).toordinal()
    except ValueError:
        return None
    local = Instant(ordinal - _MJD_EPOCH_DAY, hour * 3600 + minute * 60 + second + float(f"0.{match[7] or 0}"))
    if match[8] in (None, "Z"):
        return local
    hours, minutes = int(match[8][1:3]), int(match[8][-2:])
    if hours > _MAX_OFFSET_HOURS or minutes > 59:
        return None
    ahead = 3600 * hours + 60 * minutes
    return local.after(ahead if match[8][0] == "-" else -ahead)


def parse_stamp(text: str, *, needs_zone: bool = True) -> Instant | None:
    """Read the time stamp of a record in the same way as `parse_instant`, but accept 60 as its seconds.

    Receivers round 59.996 s to 60.00 s. Seconds of 60 are read as the start of the next minute.
    """
    rounded = _ROUNDED_MINUTE.fullmatch(text.strip())
    if rounded is None:
        return parse_instant(text, needs_zone=needs_zone)
    instant = parse_instant(f"{rounded[1]}59{rounded[2]}", needs_zone=needs_zone)
    return None if instant is None else instant.after(1.0)


# ---------------------------------------------------------------------- other time systems
# TAI - UTC: table of the Earth orientation centre of the IERS, Bulletin C 52 (2016-07-06) and before. No leap second
# came after that of 2016-12-31; one that is announced later needs a line here.
# Months from which on a new difference is valid. It was 10 s at first, and grew by 1 s each time.
_LEAP_MONTHS = (
    "1972-01 1972-07 1973-01 1974-01 1975-01 1976-01 1977-01 1978-01 1979-01 1980-01 1981-07 1982-07 1983-07 1985-07 "
    "1988-01 1990-01 1991-01 1992-07 1993-07 1994-07 1996-01 1997-07 1999-01 2006-01 2009-01 2012-07 2015-07 2017-01"
)
_LEAP_DAYS = tuple(date.fromisoformat(f"{month}-01").toordinal() - _MJD_EPOCH_DAY for month in _LEAP_MONTHS.split())
FIRST_UTC_DAY = _LEAP_DAYS[0]  # before it UTC ran at another rate than TAI

SCALES = {"utc": "UTC", "gps": "GPST", "tai": "TAI"}  # from names in the mission file to names in logs
# TAI less a system [s]. GPS: IS-GPS-200, 20.3.3.5.2.4, 19 leap seconds at its epoch. TT: IAU 1991, Recommendation IV.
TAI_LESS = {"TAI": 0.0, "GPS": 19.0, "TT": -32.184}


def tai_less_utc(day: int) -> int:
    """TAI - UTC on a UTC day, given as a modified Julian day, from 1972 on. [s]"""
    return 9 + max(bisect_right(_LEAP_DAYS, day), 1)


def has_leap_second(day: int) -> bool:
    """Whether a UTC day, given as a modified Julian day, ends with the leap second 23:59:60."""
    return day + 1 in _LEAP_DAYS[1:]


def gps_week(instant: Instant) -> int:
    """GPS week number of an instant in UTC, counted from 1980 without rollover."""
    return (tai(instant).after(-TAI_LESS["GPS"]).day - GPS_EPOCH_DAY) // 7


def tai(instant: Instant) -> Instant:
    """Convert an instant from UTC to TAI."""
    return instant.after(tai_less_utc(instant.day))


def later(instant: Instant, seconds: float) -> Instant:
    """Add a number of elapsed seconds to an instant in UTC; leap seconds count as elapsed."""
    without_leaps = instant.after(seconds)
    if tai_less_utc(without_leaps.day) == tai_less_utc(instant.day):
        return without_leaps  # a conversion to TAI and back would round twice
    return utc(tai(instant).after(seconds))


def utc(tai_instant: Instant) -> Instant:
    """Convert an instant from TAI to UTC. During a leap second, the seconds of the day are 86400 s or more."""
    instant = tai_instant.after(-tai_less_utc(tai_instant.day))
    earlier = tai_instant.after(-tai_less_utc(instant.day))
    if earlier.day > instant.day:
        return Instant(instant.day, earlier.seconds + DAY_S)
    return earlier
