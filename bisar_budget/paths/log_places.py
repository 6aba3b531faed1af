"""Places of a flight, whatever log has them: scale, heights, times that rise, a motion that can be flown."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.paths.earth import Floats, earth_fixed_places
from bisar_budget.paths.flight import Log, PathFileError
from bisar_budget.paths.instant import SCALES, TAI_LESS, UNIX_EPOCH, Instant, tai_less_utc, utc
from bisar_budget.units import format_quantity

_LEAPS_KNOWN = 61587  # MJD, 2027-07-01: Bulletin C 72 has no leap second before
_LOWEST_M, _HIGHEST_M = -12e3, 100e3  # of what flies; below is the deepest trench


class LogKeys(NamedTuple):
    """Keys of a mission file about a log.

    The GPS week in which it begins, the scale of its times, and the height of the geoid above the ellipsoid [m].
    """

    week: int | None = None
    time_scale: str | None = None
    geoid_separation: float | None = None


NOTHING_SAID = LogKeys()


class LogRows(NamedTuple):
    """Names of a log's places in messages: by the line of the file, or by the number of the record."""

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
    return instant if scale == "utc" else utc(instant.after(TAI_LESS[scale.upper()]))


def unix_instant(micro: int) -> Instant:
    """Instant of UTC so many microseconds after 1970-01-01."""
    days, rest = divmod(micro, 86_400_000_000)
    return Instant(UNIX_EPOCH + days, rest * 1e-6)


def scale_words(start: Instant, scale: str) -> str:
    """How UTC follows from the scale of a log that starts then; empty of one in UTC."""
    if scale == "utc":
        return ""
    system = scale.upper()
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
    """Heights (n,) above the ellipsoid of WGS-84 from those above mean sea level, which is the geoid. [m]

    The separation, height of the geoid above the ellipsoid, is the log's (n,), or else what the mission file says. A
    `PathFileError` says that nobody gives it, or both do.
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
    """A log from geodetic places: latitude, longitude [rad] and height above the ellipsoid [m], (n,) each.

    Times (n,) count from `start`, day and seconds of the first place in a scale of `SCALES`, or from anywhere [s].
    `sigmas` (n, 3) are one-sigma errors east, north, up [m]. A `PathFileError` says that there is no place, that one
    cannot be, or that times do not rise.
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


def counted(number: int, noun: str = "place") -> str:
    """A number with its noun."""
    return f"{number} {noun}" + "s" * (number != 1)


# ---------------------------------------------------------------------- logs that no platform can have flown
# A receiver that has frozen goes on writing its last place; one that is slower than its log writes each place several
# times; a filter that is set anew, or a cell that is wrong, makes a step that no platform takes. A polynomial through
# such places is smooth all the same, and wrong. What is below the limits here is noise, and counts as the residual.
_STILL_M = 1e-3  # over a whole aperture; the noise of any receiver is more
_SAME_M = 1e-6  # between two places; the same numbers, turned to the scene's axes, are rounded to 1e-9 m
_LEAST_M = 0.1  # of what is missed or jumped: six decimals of a degree are rounded by as much
_HARDEST = 30.0  # m/s², 3 g; and no platform takes that back within three samples
_USUAL = 20  # times the median; the largest of thousands of normal numbers is 4 times it, that of rough noise 10
_BESIDE = 3  # steps on each side that a step is compared with
_BEYOND = 10  # samples beyond each end of the aperture that say what is usual


def hold_to_motion(times: Floats, places: Floats, stretch_s: float, name: str) -> None:
    """Refuse a log that no platform can have flown.

    Parameters
    ----------
    times : (n,) ndarray
        Slow time, rising; what is far outside the stretch is not looked at. [s]
    places : (n, 3) ndarray
        In any axes. [m]
    stretch_s : float
        Time around the middle of the aperture whose places are used. [s]
    name : str
        What messages call the log.

    Raises
    ------
    PathFileError
        The places in the stretch are one place to 1 mm. Or places are those before them while the platform moves by
        more than 0.1 m, at its mean speed in the aperture. Or a step is off the median of seven around it by more
        than 0.1 m, by more than 3 g would make it, and by more than 20 times what is usual.
    """
    half = stretch_s / 2 * (1 + 1e-9)
    first, last = int(np.searchsorted(times, -half, "left")), int(np.searchsorted(times, half, "right"))
    at, flown = times[first:last], places[first:last]
    if at.size < 2 * _BESIDE - 1:  # too few for a path, too
        return
    extent = float(np.linalg.norm(flown - flown[0], axis=1).max())
    if extent <= _STILL_M:
        raise PathFileError(
            f"{name}: stands still: its {at.size} places around the aperture are the same to {1e3 * _STILL_M:g} mm",
            "accepted: the log of a platform that moves",
            "A fixed platform needs no log: give its place, and speed 0",
        )
    _hold_to_new_places(at, flown, extent, name)
    near = slice(max(first - _BEYOND, 0), last + _BEYOND)
    _hold_to_small_steps(times[near], places[near], half, name)


def _hold_to_new_places(at: Floats, flown: Floats, extent: float, name: str) -> None:
    """Refuse places that are the same as those before them, while the platform moves."""
    is_held = np.linalg.norm(np.diff(flown, axis=0), axis=1) <= _SAME_M
    if not is_held.any():
        return
    edges = np.diff(np.concatenate([[0], is_held.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    durations = at[ends] - at[begins]
    longest = int(durations.argmax())
    missed = extent * float(durations[longest] / (at[-1] - at[0]))
    if missed > _LEAST_M:
        raise PathFileError(
            f"{name}: repeats places: {int(is_held.sum())} of {at.size} around the aperture are the place before;"
            f" from {at[begins[longest]]:+.4g} s of mid-aperture on for {durations[longest]:.3g} s, in which the"
            f" platform moves {format_quantity(missed, 'm')}",
            f"accepted: repeats in which it moves at most {_LEAST_M:g} m",
            "Leave out places that were not measured anew, or write more digits",
        )


def _hold_to_small_steps(times: Floats, places: Floats, half: float, name: str) -> None:
    """Refuse steps between neighbouring places that those around them do not allow."""
    steps = np.diff(times)
    velocities = np.diff(places, axis=0) / steps[:, None]
    around = np.pad(velocities, ((_BESIDE, _BESIDE), (0, 0)), mode="reflect")
    usual = np.median(np.lib.stride_tricks.sliding_window_view(around, 2 * _BESIDE + 1, axis=0), axis=-1)
    off = np.linalg.norm(velocities - usual, axis=1) * steps
    allowed = np.maximum(np.maximum(_LEAST_M, _HARDEST * steps**2), _USUAL * np.median(off))
    is_jump = (off > allowed) & (times[1:] >= -half) & (times[:-1] <= half)
    if is_jump.any():
        worst = int(np.where(is_jump, off / allowed, 0.0).argmax())
        jump, least = format_quantity(float(off[worst]), "m"), format_quantity(float(allowed[worst]), "m", 2)
        raise PathFileError(
            f"{name}: jumps by {jump} within {steps[worst]:.3g} s, {times[worst]:+.4g} s from mid-aperture; the "
            f"steps beside it allow {least}",
            "accepted: the log of a flight without steps",
            "Take out the places that are wrong, or smooth the log before",
        )
