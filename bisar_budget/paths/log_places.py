"""What every log of a flight is held to: its time scale, what its heights count from, and times that rise."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.paths.earth import Floats, earth_fixed_places
from bisar_budget.paths.flight import Log, PathFileError
from bisar_budget.paths.instant import TAI_LESS, UNIX_EPOCH, Instant, tai_less_utc, utc

SCALES = {"utc": "UTC", "gps": "GPST", "tai": "TAI"}  # as the mission file has them, and as logs do
_LEAPS_KNOWN = 61587  # MJD, 2027-07-01: Bulletin C 72 has no leap second before
_LOWEST_M, _HIGHEST_M = -12e3, 100e3  # of what flies; below is the deepest trench


class LogKeys(NamedTuple):
    """What a mission file says of a log.

    The GPS week in which it begins, the scale of its times, and the height of the geoid above the ellipsoid [m].
    """

    week: int | None = None
    time_scale: str | None = None
    geoid_separation: float | None = None


NOTHING_SAID = LogKeys()


class LogRows(NamedTuple):
    """What messages call the places of a log: by the line of the file, or by the number of the record."""

    name: str
    lines: NDArray[np.int64] | None = None

    def where(self, index: int) -> str:
        """The beginning of a message about a place."""
        separator = ": record " if self.lines is None else ":"
        return f"{self.name}{separator}{self._number(index)}"

    def words(self, index: int) -> str:
        """The place in a sentence."""
        return f"{'record' if self.lines is None else 'line'} {self._number(index)}"

    def refuse(self, bad: Any, says: Callable[[int], str]) -> None:
        """Refuse the first place that is `bad` (n,), and say why by its index."""
        if bad.any():
            index = int(bad.argmax())
            raise PathFileError(f"{self.where(index)}: {says(index)}")

    def _number(self, index: int) -> int:
        return index + 1 if self.lines is None else int(self.lines[index])


def hold_to_scale(own: str, keys: LogKeys, name: str) -> None:
    """Refuse a time scale of the mission file that is not the one that the log says itself."""
    if keys.time_scale not in (None, own):
        raise PathFileError(
            f"{name}: counts in {SCALES[own]}, and trajectory.time_scale says {SCALES[keys.time_scale or own]}",
            f"accepted: {own}",
            "Leave trajectory.time_scale out: the log says it",
            key="time_scale",
        )


def utc_of(instant: Instant, scale: str) -> Instant:
    """Instant of UTC of a day and seconds of a scale."""
    return instant if scale == "utc" else utc(instant.after(TAI_LESS["GPS" if scale == "gps" else "TAI"]))


def unix_instant(micro: int) -> Instant:
    """Instant of UTC so many microseconds after 1970-01-01."""
    days, rest = divmod(micro, 86_400_000_000)
    return Instant(UNIX_EPOCH + days, rest * 1e-6)


def scale_words(start: Instant, scale: str) -> str:
    """How UTC follows from the scale of a log that starts then; empty of one in UTC."""
    if scale == "utc":
        return ""
    system = "GPS" if scale == "gps" else "TAI"
    doubt = " if there was no leap second since" if start.day >= _LEAPS_KNOWN else ""
    return f", UTC is {system} less {tai_less_utc(start.day) - TAI_LESS[system]:g} s{doubt}"


def hold_to_rise(times: Floats, rows: LogRows, start: Instant | None) -> None:
    """Refuse times that do not rise; they count from `start`, or from anywhere. [s]"""

    def said(index: int) -> str:
        return start.after(times[index]).as_text() if start else f"{times[index]:.12g} s"

    rows.refuse(
        np.concatenate([[False], np.diff(times) <= 0]),
        lambda i: f"time {said(i)} is not after {said(i - 1)} of {rows.words(i - 1)}; times must rise",
    )


def hold_to_ellipsoid(keys: LogKeys, name: str, own: str = "has heights above the ellipsoid") -> None:
    """Refuse a separation of the mission file for a log that needs none."""
    if keys.geoid_separation is not None:
        raise PathFileError(
            f"{name}: {own}, and trajectory.geoid_separation is given beside it",
            hint="Leave trajectory.geoid_separation out",
            key="geoid_separation",
        )


def from_sea_level(heights: Floats, separations: Floats | None, keys: LogKeys, name: str) -> Floats:
    """Heights above the ellipsoid of WGS-84 from those above mean sea level, which is the geoid. [m]

    Parameters
    ----------
    heights : (n,) ndarray
        As the log has them. [m]
    separations : (n,) ndarray or None
        Height of the geoid above the ellipsoid, where the log gives it. [m]
    keys : LogKeys
        What the mission file says; its separation stands in where the log gives none.
    name : str
        What messages call the log.

    Raises
    ------
    PathFileError
        Nobody gives the separation, or both do.
    """
    if separations is not None:
        hold_to_ellipsoid(keys, name, "gives the geoid separation itself")
        with np.errstate(over="ignore", invalid="ignore"):  # a height that cannot be is refused later
            return heights + separations
    if keys.geoid_separation is None:
        raise needs_separation(f"{name}: has heights above mean sea level, and no geoid separation")
    return heights + keys.geoid_separation


def needs_separation(problem: str) -> PathFileError:
    """The error of a log whose heights above the ellipsoid are not known, with the key that gives them."""
    return PathFileError(
        problem,
        "accepted: trajectory.geoid_separation: 47 m and the like, the height of the geoid above the ellipsoid there",
        "0 m where the heights are above the ellipsoid",
    )


def geodetic_log(
    rows: LogRows,
    words: str,
    times: Floats,
    start: Instant | None,
    scale: str,
    places: tuple[Floats, Floats, Floats],
    sigmas: Floats | None = None,
) -> Log:
    """A log from geodetic places.

    Parameters
    ----------
    rows : LogRows
        What messages call the places.
    words : str
        What the log is, for reports.
    times : (n,) ndarray
        Since `start`, or since anywhere. [s]
    start : Instant or None
        Day and seconds of the first place in the scale.
    scale : str
        A key of `SCALES`.
    places : 3 × (n,) ndarray
        Latitude, longitude [rad], height above the ellipsoid [m].
    sigmas : (n, 3) ndarray or None
        One-sigma errors east, north, up. [m]

    Raises
    ------
    PathFileError
        There is no place, one cannot be, or times do not rise.
    """
    latitude, longitude, height = places
    if not times.size:
        raise PathFileError(f"{rows.name}: has no place")
    for name, values, most, says in (
        ("latitude", latitude, 90.0, "90 deg"),
        ("longitude", longitude, 360.0, "360 deg"),
    ):
        degrees = np.degrees(values)
        rows.refuse(
            ~(np.abs(degrees) <= most * (1 + 1e-12)),
            lambda i, name=name, degrees=degrees, says=says: (  # type: ignore[misc]
                f"{name} {degrees[i]:.10g} deg is beyond {says}"
            ),
        )
    rows.refuse(
        ~((height >= _LOWEST_M) & (height <= _HIGHEST_M)),
        lambda i: f"height {height[i]:.10g} m is beyond {_LOWEST_M / 1e3:g} … {_HIGHEST_M / 1e3:g} km",
    )
    in_utc = None if start is None else utc_of(start, scale)
    hold_to_rise(times, rows, in_utc)
    words += f", {counted(len(times))} over {times[-1] - times[0]:.6g} s"
    if in_utc is not None:
        words += scale_words(in_utc, scale)
    return Log(times, earth_fixed_places(latitude, longitude, height), True, words, in_utc, sigmas)


def around_aperture(times: Floats, aperture_time_s: float) -> slice:
    """Which places are in the aperture or next to it, of slow times (n,) [s].

    The largest sigma of them counts: a mean would declare less error than the log has at some time of the aperture.
    """
    half = aperture_time_s / 2
    first = max(int(np.searchsorted(times, -half, "right")) - 1, 0)
    return slice(first, int(np.searchsorted(times, half, "left")) + 1)


def counted(number: int, noun: str = "place") -> str:
    """A number with its noun."""
    return f"{number} {noun}" + "s" * (number != 1)
