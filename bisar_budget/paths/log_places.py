"""Places of a flight, whatever log has them: scale, heights, times that rise, a motion that can be flown."""

import re
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.paths.earth import Floats, earth_fixed_places
from bisar_budget.paths.flight import NO_MATRIX, LeftOut, Log, PathFileError
from bisar_budget.paths.instant import SCALES, TAI_LESS, UNIX_EPOCH, Instant, tai_less_utc, utc
from bisar_budget.paths.position_grid import cartesian_grid, geodetic_grid
from bisar_budget.units import format_quantity

# Realisations of both agree to some centimetres, those of WGS-84 from G730 on. EPSG: 4326 and 4979 are WGS-84.
_WGS84 = re.compile(
    r"WGS[-_ /]?(?:19)?84(?:[ (]+G\d+\)?)?|W84|(?:ITRF|IGS|IGb)[- ]?\d*|EPSG:+(?:4326|4979)", re.ASCII | re.IGNORECASE
)
_LEAPS_KNOWN = 61587  # MJD, 2027-07-01: Bulletin C 72 has no leap second before
_CUT_SHARE = 1.5  # fixes with the same stamp, from which on a recorder is said to have cut fractions of seconds
_WHOLE_S = 1e-6
_LARGEST_SIGMA_M = 1e6  # of a place; a receiver without a fix writes more
_LOWEST_M, _HIGHEST_M = -12e3, 100e3  # of what flies; below is the deepest trench


class LogKeys(NamedTuple):
    """Keys of a mission file about a log.

    The GPS week in which it begins, the scale of its times, and the height of the geoid above the ellipsoid [m]. Of a
    file with several logs: the talker of NMEA, the track of GPX by name or number, the instance of a receiver.
    """

    week: int | None = None
    time_scale: str | None = None
    geoid_separation: float | None = None
    talker: str | None = None
    track: str | None = None
    instance: int | None = None


NOTHING_SAID = LogKeys()


_SHARE = 100  # one record of so many may be one that cannot be used
_SHORTEST = 20  # records, of which one may be left out
_LISTED = 3  # records that the words of a log name
_NOTHING_BROKEN: Mapping[int, str] = MappingProxyType({})


def most_left_out(count: int) -> int:
    """How many of a log's records may be left out: 1 % of them, and one of a short log, from 20 records on."""
    return max(count // _SHARE, int(count >= _SHORTEST))


class LogRecords:
    """Records of a log that have a fix: how messages name them, and which of them cannot be used.

    Parameters
    ----------
    name : str
        What messages call the file.
    count : int
        How many records are read.
    lines : (count,) array_like, optional
        Their lines in the file, rising; omitted: they are numbered from 1.
    broken : mapping, optional
        Messages that say why further records cannot be read, by their lines or numbers.
    lost : int
        How many more were damaged on the way, and are nowhere.

    Raises
    ------
    PathFileError
        More than 1 % of the records cannot be used, and more than one of 20 to 200 records; or none can. Methods that
        leave records out raise it, too.
    """

    def __init__(
        self, name: str, count: int, lines: Any = None, broken: Mapping[int, str] = _NOTHING_BROKEN, lost: int = 0
    ) -> None:
        self.name, self._is_in_lines = name, lines is not None
        self._numbers: NDArray[np.int64] = np.arange(1, count + 1) if lines is None else np.asarray(lines)
        self._faults: dict[int, str] = {}
        self._lost, self._total = lost, count + len(broken) + lost
        self.is_usable: NDArray[np.bool_] = np.ones(count, dtype=bool)
        if broken:
            self._add(broken, len(broken))
        elif lost > most_left_out(self._total):
            raise PathFileError(f"{name}: {lost} of {self._total} records are damaged, at most 1 % may be")
        if not count:
            raise PathFileError(f"{name}: has no place")

    @property
    def first(self) -> int:
        """Index of the first record that can be used."""
        return int(self.is_usable.argmax())

    def where(self, index: int) -> str:
        """The beginning of a message about a record."""
        return f"{self.name}{':' if self._is_in_lines else ': record '}{self._numbers[index]}"

    def words(self, index: int) -> str:
        """The record in a sentence."""
        return f"{'line' if self._is_in_lines else 'record'} {self._numbers[index]}"

    def leave_out(self, bad: Any, says: Callable[[int], str]) -> None:
        """Leave out records that are `bad` (count,); `says` gives the reason by their index."""
        indices = np.flatnonzero(bad & self.is_usable)
        if indices.size:
            self.is_usable[indices] = False
            few = indices[: most_left_out(self._total) + 1].tolist()
            self._add(
                {int(self._numbers[index]): f"{self.where(index)}: {says(index)}" for index in few}, len(indices)
            )

    def keep_what_rises(self, times: Floats, start: Instant | None) -> None:
        """Leave out records whose times (count,) are not between those around them; they count from `start`. [s]"""
        indices = np.flatnonzero(self.is_usable)
        at = times[indices]
        steps = np.diff(at)
        if (steps > 0).all():
            return
        late = np.flatnonzero(~(steps > 0)) + 1

        def said(place: int) -> str:
            return start.after(float(at[place])).as_text() if start else f"{at[place]:.12g} s"

        def not_after(place: int) -> str:
            before = place - 1
            while before and is_out[before]:
                before -= 1
            if at[place] > at[before]:
                behind = place + int(np.argmax(~is_out[place:] & (at[place:] <= at[place])))
                return (
                    f"time {said(place)} is not before {said(behind)} of {self.words(int(indices[behind]))}; "
                    "times must rise"
                )
            return (
                f"time {said(place)} is not after {said(before)} of {self.words(int(indices[before]))}; "
                f"times must rise{cut}"
            )

        cut = _whole_seconds(at, start)
        is_out = np.zeros(len(at), dtype=bool)
        if len(late) > 2 * most_left_out(self._total):  # each record that is left out mends two steps at most
            is_out[late] = True
        else:
            is_out = ~_longest_rise(at)
        bad = np.zeros(len(times), dtype=bool)
        bad[indices[is_out]] = True
        places = {int(index): place for place, index in enumerate(indices.tolist()) if is_out[place]}
        self.leave_out(bad, lambda index: not_after(places[index]))

    def left_out(self) -> LeftOut | None:
        """The records that are left out; None where all are used."""
        if not self._faults:
            return None
        numbers = sorted(self._faults)
        before = np.searchsorted(self._numbers[self.is_usable], numbers)
        return LeftOut(before, tuple(self._faults[number] for number in numbers))

    def left_out_words(self) -> str:
        """How many records are left out, and which, for reports; empty where all are used."""
        if not self._faults:
            return ""
        numbers = sorted(self._faults)
        noun = ("line" if self._is_in_lines else "record") + "s" * (len(numbers) > 1)
        listed = ", ".join(map(str, numbers[:_LISTED])) + ", …" * (len(numbers) > _LISTED)
        return f", {counted(len(numbers), 'record')} that cannot be used left out ({noun} {listed})"

    def _add(self, faults: Mapping[int, str], count: int) -> None:
        """Add records that are left out; refuse the log where they become too many."""
        self._faults |= faults
        bad = len(self._faults) - len(faults) + count + self._lost
        if bad > most_left_out(self._total) or bad >= self._total:
            says = self._faults[min(self._faults)]
            if 1 < bad < self._total:
                says += f"; {bad} of {self._total} records cannot be used, at most 1 % may be left out"
            raise PathFileError(says)


def _longest_rise(times: Floats) -> NDArray[np.bool_]:
    """Which of times (n,) are in the longest selection of them that rises; of equal ones it has the first."""
    rises = np.ones(len(times), dtype=bool)
    highest = np.maximum.accumulate(times)
    lowest = np.minimum.accumulate(times[::-1])[::-1]
    is_settled = np.ones(len(times), dtype=bool)
    is_settled[1:] &= times[1:] > highest[:-1]
    is_settled[:-1] &= times[:-1] < lowest[1:]
    # Between settled times, which are after all before them and before all behind, each disorder is one of its own.
    places = np.flatnonzero(~is_settled)
    disorders = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1) if places.size else []
    for disorder in disorders:
        rises[disorder] = False
        ends: list[float] = []  # least last times of selections, by their lengths
        last: list[int] = []
        earlier = [-1] * len(disorder)
        for place, time in enumerate(times[disorder].tolist()):
            length = bisect_left(ends, time)
            earlier[place] = last[length - 1] if length else -1
            if length == len(ends):
                ends.append(time)
                last.append(place)
            elif time < ends[length]:
                ends[length], last[length] = time, place
        place = last[-1]
        while place >= 0:
            rises[disorder[place]] = True
            place = earlier[place]
    return rises


def _whole_seconds(times: Floats, start: Instant | None) -> str:
    """Why times that repeat do so, where a recorder has cut the fractions of seconds off all of them."""
    seconds = times + (start.seconds if start else 0.0)
    in_each = len(times) / max(len(np.unique(times)), 1)
    if len(times) < _SHORTEST or in_each < _CUT_SHARE or not (np.abs(seconds - np.round(seconds)) < _WHOLE_S).all():
        return ""
    return (
        f"; all stamps are whole seconds, and {in_each:.0f} fixes have the same: the recorder has cut the fractions "
        "of seconds"
    )


def hold_to_scale(own: str, keys: LogKeys, name: str) -> None:
    """Refuse a time scale of the mission file that is not the one that the log says itself."""
    if keys.time_scale not in (None, own):
        raise PathFileError(
            f"{name}: counts in {SCALES[own]}, and trajectory.time_scale says {SCALES[keys.time_scale or own]}",
            f"accepted: {own}",
            "Leave trajectory.time_scale out: the log says it",
            key="time_scale",
        )


def one_instance(counts: Mapping[float, int], keys: LogKeys, name: str) -> float:
    """The instance of a receiver that is read, of those with fixes: the only one, or that of the mission file.

    `counts` has fixes of each. A `PathFileError` says that the chosen one has none, or that there are several.
    """
    listed = ", ".join(f"{instance:g} with {count}" for instance, count in sorted(counts.items()))
    if keys.instance is not None and keys.instance not in counts:
        raise PathFileError(f"{name}: has no fix of the instance {keys.instance}; it has {listed}", key="instance")
    if keys.instance is None and len(counts) > 1:
        raise PathFileError(
            f"{name}: has fixes of {len(counts)} receivers: of the instances {listed}",
            "accepted: one receiver",
            f"trajectory.instance: {max(counts, key=counts.__getitem__):g} chooses one",
        )
    return next(iter(counts)) if keys.instance is None else float(keys.instance)


def is_wgs84(datum: str) -> bool:
    """Whether the name of a datum, or of a reference system, is that of WGS-84 or of a frame of the ITRF."""
    return _WGS84.fullmatch(datum.strip()) is not None


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


def level_sigmas(horizontal: Floats | None, vertical: Floats | None) -> Floats | None:
    """Sigmas (n, 3) east, north, up of figures without a direction on the level; None where none is known. [m]

    The error may lie along one axis, which has all of it. Where one of the two figures is known alone, it counts
    along every axis. A figure that is not positive is not known.
    """
    stated = [values for values in (horizontal, vertical) if values is not None]
    if not stated:
        return None
    level, up = (np.where(a > 0, a, b) for a, b in ((stated[0], stated[-1]), (stated[-1], stated[0])))
    return known_sigmas(np.column_stack([level, level, up]))


def known_sigmas(sigmas: Floats) -> Floats | None:
    """Sigmas (n, 3) of a log, NaN for each figure that is not positive; None where no place has any. [m]"""
    found = np.where(sigmas > 0, np.minimum(sigmas, _LARGEST_SIGMA_M), np.nan)
    return None if np.isnan(found).all() else found


def filled_sigmas(sigmas: Floats) -> Floats:
    """Sigmas (…, 3) with the largest known one along the axes of which none is known. [m]

    The error there may be as large: what is left out must not count as 0.
    """
    return np.where(sigmas > 0, sigmas, np.fmax.reduce(sigmas, axis=-1, keepdims=True))


def geodetic_log(
    records: LogRecords,
    words: str,
    times: Floats,
    start: Instant | None,
    scale: str,
    places: tuple[Floats, Floats, Floats],
    sigmas: Floats | None = None,
) -> Log:
    """A log from geodetic places: latitude, longitude [rad] and height above the ellipsoid [m], (n,) each.

    Times (n,) count from `start`, day and seconds in a scale of `SCALES`, or from anywhere [s]. `sigmas` (n, 3) are
    one-sigma errors east, north, up [m]. Records with a place that cannot be, or a time that does not rise, are left
    out; a `PathFileError` says that they are too many.
    """
    latitude, longitude, height = places
    for name, values, most, says in (
        ("latitude", latitude, 90.0, "90 deg"),
        ("longitude", longitude, 360.0, "360 deg"),
    ):
        degrees = np.degrees(values)
        records.leave_out(
            ~(np.abs(degrees) <= most * (1 + 1e-12)),
            lambda i, name=name, degrees=degrees, says=says: (  # type: ignore[misc]
                f"{name} {degrees[i]:.10g} deg is beyond {says}"
            ),
        )
    records.leave_out(
        ~((height >= _LOWEST_M) & (height <= _HIGHEST_M)),
        lambda i: f"height {height[i]:.10g} m is beyond {_LOWEST_M / 1e3:g} … {_HIGHEST_M / 1e3:g} km",
    )
    return usable_log(
        records,
        words,
        times,
        start,
        scale,
        lambda kept: earth_fixed_places(latitude[kept], longitude[kept], height[kept]),
        sigmas=sigmas,
        geodetic=places,
    )


def usable_log(
    records: LogRecords,
    words: str,
    times: Floats,
    start: Instant | None,
    scale: str,
    places: Callable[[NDArray[np.bool_]], Floats],
    *,
    clock_words: str = "",
    is_earth_fixed: bool = True,
    sigmas: Floats | None = None,
    geodetic: Sequence[Floats] | None = None,
) -> Log:
    """The log of the records that can be used, whose times rise.

    `places` gives those of records that are kept (n,), `clock_words` says how well times are known, `geodetic` are
    latitude, longitude and height of each record where the log has them. All else is as in `geodetic_log`.
    """
    start_utc = None if start is None else utc_of(start, scale)
    records.keep_what_rises(times, start_utc)
    kept = records.is_usable
    times = times[kept]
    if start is not None and times[0]:
        # The scale is that of the first record that can be used.
        start, times = start.after(float(times[0])), times - times[0]
        start_utc = utc_of(start, scale)
    words += f", {counted(len(times))} over {times[-1] - times[0]:.6g} s{clock_words}"
    if start_utc is not None:
        words += scale_words(start_utc, scale)
    words += records.left_out_words()
    own = places(kept)
    grid = NO_MATRIX if geodetic is None else geodetic_grid(times, *(values[kept] for values in geodetic))
    return Log(
        times,
        own,
        is_earth_fixed,
        words,
        start_utc,
        None if sigmas is None else sigmas[kept],
        left_out=records.left_out(),
        grid=grid if np.any(grid) else cartesian_grid(times, own),
    )


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
