"""Checks and conversions of fixes, for all log formats: time scale, heights, order of times, plausible motion."""

import re
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bisar_budget.arrays import Booleans
from bisar_budget.paths.earth import Floats, earth_fixed_places
from bisar_budget.paths.flight import NO_MATRIX, LeftOut, Log, PathFileError
from bisar_budget.paths.instant import SCALES, TAI_LESS, UNIX_EPOCH_DAY, Instant, tai_less_utc, utc
from bisar_budget.paths.position_grid import cartesian_grid, geodetic_grid
from bisar_budget.units import format_quantity

# WGS-84 from G730 on agrees with the ITRF to some centimetres. EPSG: 4326 and 4979 are WGS-84.
_WGS84 = re.compile(
    r"WGS[-_ /]?(?:19)?84(?:[ (]+G\d+\)?)?|W84|(?:ITRF|IGS|IGb)[- ]?\d*|EPSG:+(?:4326|4979)", re.ASCII | re.IGNORECASE
)
_FIRST_UNKNOWN_LEAP_DAY = 61587  # MJD, 2027-07-01: Bulletin C 72 has no leap second before
_MIN_FIXES_PER_STAMP = 1.5  # with fewer, the recorder has not truncated times to whole seconds
_WHOLE_SECOND_ERROR_S = 1e-6
_MAX_LOG_SIGMA_M = 1e6  # a receiver without a fix writes more
_MIN_HEIGHT_M, _MAX_HEIGHT_M = -12e3, 100e3  # from the deepest trench to the border of space


class LogKeys(NamedTuple):
    """Keys of a mission file that describe a log.

    `week` is the GPS week in which the log begins. `time_scale` is the time scale of its time stamps.
    `geoid_separation` [m] is the height of the geoid above the ellipsoid. If a file contains several logs, a
    key chooses one of them: `talker` for NMEA, `track` for GPX (name or number), or `instance`, the number of a
    receiver. None means that the mission file does not state the key.
    """

    week: int | None = None
    time_scale: str | None = None
    geoid_separation: float | None = None
    talker: str | None = None
    track: str | None = None
    instance: int | None = None


NO_KEYS = LogKeys()


_RECORDS_PER_FAULT = 100  # one record in a hundred may be unusable
_ONE_FAULT_RECORD_COUNT = 20  # length of a log from which one record may be left out
_NAMED_RECORD_COUNT = 3  # in the words of a log
_NO_FAULTS: Mapping[int, str] = MappingProxyType({})


def most_left_out(count: int) -> int:
    """Largest number of records that may be left out of a log with `count` records.

    This is 1 % of the records, rounded down, but at least one record if the log has 20 records or more.
    """
    return max(count // _RECORDS_PER_FAULT, int(count >= _ONE_FAULT_RECORD_COUNT))


class LogRecords:
    """Records of a log that have a fix, divided into usable and unusable records.

    A record is identified in messages by its line, or by its number.

    Parameters
    ----------
    name : str
        Name of the file in messages.
    count : int
        Number of records that could be read.
    lines : (count,) array_like, optional
        Lines of the records in the file, in ascending order. If omitted, records are numbered from 1.
    broken : mapping, optional
        Messages about records that cannot be read, by line or number. Such records are not included in `count`.
    lost : int
        Number of records that are missing, because they were damaged during recording or transfer.

    Raises
    ------
    PathFileError
        More records than `most_left_out` allows are unusable, or no record is usable. The methods `leave_out` and
        `keep_what_rises` raise it too.
    """

    def __init__(
        self,
        name: str,
        count: int,
        lines: ArrayLike | None = None,
        broken: Mapping[int, str] = _NO_FAULTS,
        lost: int = 0,
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
            raise PathFileError(f"{name}: has no fix")

    @property
    def first(self) -> int:
        """Index of the first usable record."""
        return int(self.is_usable.argmax())

    def where(self, index: int) -> str:
        """Start of a message about a record: the name of the file, and the line or number of the record."""
        return f"{self.name}{':' if self._is_in_lines else ': record '}{self._numbers[index]}"

    def words(self, index: int) -> str:
        """Phrase that refers to a record in a message, such as `line 12` or `record 12`."""
        return f"{'line' if self._is_in_lines else 'record'} {self._numbers[index]}"

    def leave_out(self, is_unusable: Booleans | np.bool_, reason: Callable[[int], str]) -> None:
        """Mark records as unusable; `is_unusable` (count,) selects them.

        `reason` takes the index of a record, and returns the reason why it is unusable.
        """
        indices = np.flatnonzero(is_unusable & self.is_usable)
        if indices.size:
            self.is_usable[indices] = False
            listed = indices[: most_left_out(self._total) + 1].tolist()
            self._add(
                {int(self._numbers[index]): f"{self.where(index)}: {reason(index)}" for index in listed}, len(indices)
            )

    def keep_what_rises(self, times: Floats, start: Instant | None) -> None:
        """Mark records as unusable so that the times of the remaining records are strictly ascending.

        `times` (count,) [s] are counted from `start`.
        """
        indices = np.flatnonzero(self.is_usable)
        usable_times = times[indices]
        steps = np.diff(usable_times)
        if (steps > 0).all():
            return
        late_rows = np.flatnonzero(~(steps > 0)) + 1

        def time_text(row: int) -> str:
            return start.after(float(usable_times[row])).as_text() if start else f"{usable_times[row]:.12g} s"

        def not_after(row: int) -> str:
            before = row - 1
            while before and is_out[before]:
                before -= 1
            if usable_times[row] > usable_times[before]:
                after = row + int(np.argmax(~is_out[row:] & (usable_times[row:] <= usable_times[row])))
                return (
                    f"time {time_text(row)} is not before {time_text(after)} of {self.words(int(indices[after]))}; "
                    "times must rise"
                )
            return (
                f"time {time_text(row)} is not after {time_text(before)} of {self.words(int(indices[before]))}; "
                f"times must rise{cut}"
            )

        cut = _whole_seconds(usable_times, start)
        is_out = np.zeros(len(usable_times), dtype=bool)
        if len(late_rows) > 2 * most_left_out(self._total):  # each record that is left out mends two steps at most
            is_out[late_rows] = True
        else:
            is_out = ~_longest_rise(usable_times)
        is_unusable = np.zeros(len(times), dtype=bool)
        is_unusable[indices[is_out]] = True
        row_of_index = {int(index): row for row, index in enumerate(indices.tolist()) if is_out[row]}
        self.leave_out(is_unusable, lambda index: not_after(row_of_index[index]))

    def left_out(self) -> LeftOut | None:
        """Records that are left out, and messages about them; None if all records are used."""
        if not self._faults:
            return None
        numbers = sorted(self._faults)
        before = np.searchsorted(self._numbers[self.is_usable], numbers)
        return LeftOut(before, tuple(self._faults[number] for number in numbers))

    def left_out_words(self) -> str:
        """Phrase with the number of records that are left out, and their lines or numbers; empty if all are used."""
        if not self._faults:
            return ""
        numbers = sorted(self._faults)
        noun = ("line" if self._is_in_lines else "record") + "s" * (len(numbers) > 1)
        listed = ", ".join(map(str, numbers[:_NAMED_RECORD_COUNT])) + ", …" * (len(numbers) > _NAMED_RECORD_COUNT)
        return f", {counted(len(numbers), 'record')} that cannot be used left out ({noun} {listed})"

    def _add(self, faults: Mapping[int, str], count: int) -> None:
        """Count `count` more records as left out; raises `PathFileError` if there are now too many.

        `faults` are messages about these records, by line or number; if there are very many, only the first records
        have a message.
        """
        self._faults |= faults
        unusable = len(self._faults) - len(faults) + count + self._lost
        if unusable > most_left_out(self._total) or unusable >= self._total:
            message = self._faults[min(self._faults)]
            if 1 < unusable < self._total:
                message += f"; {unusable} of {self._total} records cannot be used, at most 1 % may be left out"
            raise PathFileError(message)


def _longest_rise(times: Floats) -> NDArray[np.bool_]:
    """Mask (n,) that selects the longest strictly increasing subsequence of `times` (n,).

    Of several equal times, only the first can be selected.
    """
    rises = np.ones(len(times), dtype=bool)
    highest = np.maximum.accumulate(times)
    lowest = np.minimum.accumulate(times[::-1])[::-1]
    is_settled = np.ones(len(times), dtype=bool)
    is_settled[1:] &= times[1:] > highest[:-1]
    is_settled[:-1] &= times[:-1] < lowest[1:]
    # A settled time is later than all times before it and earlier than all times after it. So each disorder between
    # settled times is solved separately.
    unsettled = np.flatnonzero(~is_settled)
    disorders = np.split(unsettled, np.flatnonzero(np.diff(unsettled) > 1) + 1) if unsettled.size else []
    for disorder in disorders:
        rises[disorder] = False
        ends: list[float] = []  # smallest last time of a selection, by the length of the selection
        last_rows: list[int] = []
        previous_row = [-1] * len(disorder)
        for row, time in enumerate(times[disorder].tolist()):
            length = bisect_left(ends, time)
            previous_row[row] = last_rows[length - 1] if length else -1
            if length == len(ends):
                ends.append(time)
                last_rows.append(row)
            elif time < ends[length]:
                ends[length], last_rows[length] = time, row
        row = last_rows[-1]
        while row >= 0:
            rises[disorder[row]] = True
            row = previous_row[row]
    return rises


def _whole_seconds(times: Floats, start: Instant | None) -> str:
    """Explanation for a message about repeated times: the recorder truncates times to whole seconds.

    The explanation is empty if the times do not indicate such a truncation.
    """
    seconds = times + (start.seconds if start else 0.0)
    fixes_per_stamp = len(times) / max(len(np.unique(times)), 1)
    if (
        len(times) < _ONE_FAULT_RECORD_COUNT
        or fixes_per_stamp < _MIN_FIXES_PER_STAMP
        or not (np.abs(seconds - np.round(seconds)) < _WHOLE_SECOND_ERROR_S).all()
    ):
        return ""
    return (
        f"; all stamps are whole seconds, and {fixes_per_stamp:.0f} fixes have the same: the recorder has cut the "
        "fractions of seconds"
    )


def hold_to_scale(log_scale: str, keys: LogKeys, name: str) -> None:
    """Raise `PathFileError` if the mission file states a time scale that differs from the time scale of the log."""
    if keys.time_scale not in (None, log_scale):
        raise PathFileError(
            f"{name}: counts in {SCALES[log_scale]}, and trajectory.time_scale says "
            f"{SCALES[keys.time_scale or log_scale]}",
            f"accepted: {log_scale}",
            "Leave trajectory.time_scale out: the log says it",
            key="time_scale",
        )


def one_instance(counts: Mapping[float, int], keys: LogKeys, name: str) -> float:
    """Number of the receiver whose fixes are read: the receiver that the mission file chooses, or the only receiver.

    `counts` maps the number of each receiver, which is called its instance, to its number of fixes. Raises
    `PathFileError` if the chosen receiver has no fix, or if there are several receivers and the mission file does not
    choose one.
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
    """Whether the datum or reference system with the name `datum` is WGS-84 or an ITRF frame."""
    return _WGS84.fullmatch(datum.strip()) is not None


def utc_of(instant: Instant, scale: str) -> Instant:
    """Convert an instant from the time scale `scale`, which is a key of `SCALES`, to UTC."""
    return instant if scale == "utc" else utc(instant.after(TAI_LESS[scale.upper()]))


def unix_instant(unix_us: int) -> Instant:
    """Convert microseconds since 1970-01-01 to an instant in UTC."""
    days, microseconds = divmod(unix_us, 86_400_000_000)
    return Instant(UNIX_EPOCH_DAY + days, microseconds * 1e-6)


def scale_words(start: Instant, scale: str) -> str:
    """Phrase with the difference between UTC and the time scale of a log, at its start; empty for a log in UTC."""
    if scale == "utc":
        return ""
    system = scale.upper()
    doubt = " if there was no leap second since" if start.day >= _FIRST_UNKNOWN_LEAP_DAY else ""
    return f", UTC is {system} less {tai_less_utc(start.day) - TAI_LESS[system]:g} s{doubt}"


def hold_to_ellipsoid(keys: LogKeys, name: str, log_words: str = "has heights above the ellipsoid") -> None:
    """Raise `PathFileError` if the mission file states a geoid separation although the log does not need it.

    `log_words` states the reason why the log does not need it, for the error message.
    """
    if keys.geoid_separation is not None:
        raise PathFileError(
            f"{name}: {log_words}, and trajectory.geoid_separation is given beside it",
            hint="Leave trajectory.geoid_separation out",
            key="geoid_separation",
        )


def from_sea_level(heights: Floats, separations: Floats | None, keys: LogKeys, name: str) -> Floats:
    """Convert heights (n,) above mean sea level, that is, above the geoid, to heights above the WGS-84 ellipsoid. [m]

    The geoid separation is the height of the geoid above the ellipsoid. It comes from the log (n,) or from the
    mission file. Raises `PathFileError` if both state a separation, or if neither does.
    """
    if separations is not None:
        hold_to_ellipsoid(keys, name, "gives the geoid separation itself")
        with np.errstate(over="ignore", invalid="ignore"):  # impossible heights are refused later
            return heights + separations
    if keys.geoid_separation is None:
        raise needs_separation(f"{name}: has heights above mean sea level, and no geoid separation")
    return heights + keys.geoid_separation


def needs_separation(problem: str) -> PathFileError:
    """Make the error for a log that has neither heights above the ellipsoid nor a geoid separation.

    The error names the key of the mission file that states the geoid separation.
    """
    return PathFileError(
        problem,
        "accepted: trajectory.geoid_separation: 47 m and the like, the height of the geoid above the ellipsoid there",
        "0 m where the heights are above the ellipsoid",
    )


def level_sigmas(horizontal: Floats | None, vertical: Floats | None) -> Floats | None:
    """1-sigma errors (n, 3) east, north, up from a horizontal and a vertical accuracy. [m]

    A horizontal accuracy (n,) has no direction. The whole error may lie along a single axis, so the accuracy is used
    for both the east and the north axis. If only one of the two accuracies is known, it is used for all axes. Numbers
    that are not positive count as unknown. Returns None if no number is positive.
    """
    if horizontal is None:
        horizontal = vertical
    if vertical is None:
        vertical = horizontal
    if horizontal is None or vertical is None:
        return None
    level, up = np.where(horizontal > 0, horizontal, vertical), np.where(vertical > 0, vertical, horizontal)
    return known_sigmas(np.column_stack([level, level, up]))


def known_sigmas(sigmas: Floats) -> Floats | None:
    """Replace 1-sigma errors (n, 3) that are not positive by NaN; returns None if no error is positive. [m]

    Errors above 1000 km, which receivers write if they have no fix, are reduced to 1000 km.
    """
    found = np.where(sigmas > 0, np.minimum(sigmas, _MAX_LOG_SIGMA_M), np.nan)
    return None if np.isnan(found).all() else found


def filled_sigmas(sigmas: Floats) -> Floats:
    """Replace unknown 1-sigma errors (…, 3) by the largest known error of the same position. [m]

    An unknown error may be as large as the known error, and must not count as 0.
    """
    return np.where(sigmas > 0, sigmas, np.fmax.reduce(sigmas, axis=-1, keepdims=True))


def geodetic_log(
    records: LogRecords,
    words: str,
    times: Floats,
    start: Instant | None,
    scale: str,
    coordinates: tuple[Floats, Floats, Floats],
    sigmas: Floats | None = None,
) -> Log:
    """Make a log from geodetic coordinates.

    `coordinates` are latitude and longitude [rad], and height above the ellipsoid [m], each with the shape (n,).
    `words` describes the log for reports. `times` (n,) are counted in seconds from `start`, an instant in the time
    scale `scale`, which is a key of `SCALES`. Without `start`, they are counted from an unknown instant. `sigmas` (n,
    3) [m] are 1-sigma errors east, north, up. Records with impossible coordinates, or with times out of order, are
    left out. Raises `PathFileError` if too many records are left out.
    """
    latitude, longitude, height = coordinates
    for name, values, limit_deg, limit_words in (
        ("latitude", latitude, 90.0, "90 deg"),
        ("longitude", longitude, 360.0, "360 deg"),
    ):
        degrees = np.degrees(values)
        records.leave_out(
            ~(np.abs(degrees) <= limit_deg * (1 + 1e-12)),
            lambda i, name=name, degrees=degrees, limit_words=limit_words: (  # type: ignore[misc]
                f"{name} {degrees[i]:.10g} deg is beyond {limit_words}"
            ),
        )
    records.leave_out(
        ~((height >= _MIN_HEIGHT_M) & (height <= _MAX_HEIGHT_M)),
        lambda i: f"height {height[i]:.10g} m is beyond {_MIN_HEIGHT_M / 1e3:g} … {_MAX_HEIGHT_M / 1e3:g} km",
    )
    return usable_log(
        records,
        words,
        times,
        start,
        scale,
        lambda kept: earth_fixed_places(latitude[kept], longitude[kept], height[kept]),
        sigmas=sigmas,
        geodetic=coordinates,
    )


def usable_log(
    records: LogRecords,
    words: str,
    times: Floats,
    start: Instant | None,
    scale: str,
    positions_of: Callable[[NDArray[np.bool_]], Floats],
    *,
    clock_words: str = "",
    is_earth_fixed: bool = True,
    sigmas: Floats | None = None,
    geodetic: Sequence[Floats] | None = None,
) -> Log:
    """Make a log from the usable records; records whose times are out of order are left out.

    The function `positions_of` takes a mask (n,) that selects m records, and returns their positions (m, 3) [m].
    `clock_words` is a note on the accuracy of the times. `geodetic` are latitude, longitude and height of each
    record, if the log states them. The other parameters are the same as in `geodetic_log`.
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
    positions = positions_of(kept)
    grid = NO_MATRIX if geodetic is None else geodetic_grid(times, *(values[kept] for values in geodetic))
    return Log(
        times,
        positions,
        is_earth_fixed,
        words,
        start_utc,
        None if sigmas is None else sigmas[kept],
        left_out=records.left_out(),
        grid=grid if np.any(grid) else cartesian_grid(times, positions),
    )


def counted(number: int, noun: str = "fix") -> str:
    """Format a number followed by a noun, which is put into the plural if needed."""
    return f"{number} {noun}" + ("" if number == 1 else "es" if noun.endswith("x") else "s")


# ---------------------------------------------------------------------- logs that no platform can have flown
# A frozen receiver repeats its last fix. A receiver that is slower than its log writes each fix several times. A
# filter that is reset, or a wrong cell, makes a step that no platform takes. A polynomial through such fixes is
# smooth all the same, and wrong. Deviations below the limits here are noise, and count as the residual.
_MAX_STILL_EXTENT_M = 1e-3  # over a whole aperture; the noise of any receiver is more
_SAME_FIX_M = 1e-6  # equal positions differ by 1e-9 m after conversion to the scene's axes
_MIN_FAULT_M = 0.1  # smallest motion during repeated fixes, and smallest jump; six decimals of a degree are 0.1 m
_MAX_ACCELERATION_MPS2 = 30.0  # 3 g; no platform reverses it within three samples
_MEDIAN_FACTOR = 20  # the largest of thousands of normal numbers is 4 medians, the largest of rough noise 10
_NEIGHBOUR_STEPS = 3  # steps on each side with which a step is compared
_MEDIAN_MARGIN_SAMPLES = 10  # samples beyond each end of the aperture that count in the median


def hold_to_motion(times: Floats, positions: Floats, stretch_s: float, name: str) -> None:
    """Refuse a log whose fixes near the aperture cannot result from the motion of a platform.

    Parameters
    ----------
    times : (n,) ndarray
        Slow times of the fixes, in ascending order; fixes far outside the time span of `stretch_s` are ignored. [s]
    positions : (n, 3) ndarray
        Positions of the fixes in any axes. [m]
    stretch_s : float
        Length of the time span around mid-aperture whose fixes are used. [s]
    name : str
        Name of the log in messages.

    Raises
    ------
    PathFileError
        The log has one of three faults. First, all fixes in the time span are equal to within 1 mm. Second, a fix is
        repeated for so long that the platform, at its mean speed, moves by more than 0.1 m in this time. Third, a
        step between two fixes differs too much from the median of the seven steps around it: by more than 0.1 m, by
        more than an acceleration of 3 g can cause, and by more than 20 times the median of such differences.
    """
    half = stretch_s / 2 * (1 + 1e-9)
    first, last = int(np.searchsorted(times, -half, "left")), int(np.searchsorted(times, half, "right"))
    flown_times, flown_positions = times[first:last], positions[first:last]
    if flown_times.size < 2 * _NEIGHBOUR_STEPS - 1:  # too few fixes, which are also too few for a path
        return
    extent = float(np.linalg.norm(flown_positions - flown_positions[0], axis=1).max())
    if extent <= _MAX_STILL_EXTENT_M:
        raise PathFileError(
            f"{name}: stands still: its {flown_times.size} fixes around the aperture are the same to "
            f"{1e3 * _MAX_STILL_EXTENT_M:g} mm",
            "accepted: the log of a platform that moves",
            "A fixed platform needs no log: give its position, and speed 0",
        )
    _hold_to_new_fixes(flown_times, flown_positions, extent, name)
    neighbourhood = slice(max(first - _MEDIAN_MARGIN_SAMPLES, 0), last + _MEDIAN_MARGIN_SAMPLES)
    _hold_to_small_steps(times[neighbourhood], positions[neighbourhood], half, name)


def _hold_to_new_fixes(times: Floats, positions: Floats, extent: float, name: str) -> None:
    """Refuse a log that repeats a fix while the platform moves.

    `extent` [m] is the distance that the platform moves during the whole time span of the fixes.
    """
    is_repeated = np.linalg.norm(np.diff(positions, axis=0), axis=1) <= _SAME_FIX_M
    if not is_repeated.any():
        return
    edges = np.diff(np.concatenate([[0], is_repeated.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    durations = times[ends] - times[begins]
    longest = int(durations.argmax())
    missed = extent * float(durations[longest] / (times[-1] - times[0]))
    if missed > _MIN_FAULT_M:
        raise PathFileError(
            f"{name}: repeats fixes: {int(is_repeated.sum())} of {times.size} around the aperture equal the fix "
            f"before; from {times[begins[longest]]:+.4g} s of mid-aperture on for {durations[longest]:.3g} s, in "
            f"which the platform moves {format_quantity(missed, 'm')}",
            f"accepted: repeats in which it moves at most {_MIN_FAULT_M:g} m",
            "Leave out repeated fixes, or write more digits",
        )


def _hold_to_small_steps(times: Floats, positions: Floats, half: float, name: str) -> None:
    """Refuse a log in which a step between neighbouring fixes is too large compared with the steps around it.

    `half` [s] is half the length of the time span around mid-aperture that is checked.
    """
    steps = np.diff(times)
    velocities = np.diff(positions, axis=0) / steps[:, None]
    padded = np.pad(velocities, ((_NEIGHBOUR_STEPS, _NEIGHBOUR_STEPS), (0, 0)), mode="reflect")
    median = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * _NEIGHBOUR_STEPS + 1, axis=0), axis=-1)
    deviations = np.linalg.norm(velocities - median, axis=1) * steps
    allowed = np.maximum(
        np.maximum(_MIN_FAULT_M, _MAX_ACCELERATION_MPS2 * steps**2), _MEDIAN_FACTOR * np.median(deviations)
    )
    is_jump = (deviations > allowed) & (times[1:] >= -half) & (times[:-1] <= half)
    if is_jump.any():
        worst = int(np.where(is_jump, deviations / allowed, 0.0).argmax())
        jump, limit = format_quantity(float(deviations[worst]), "m"), format_quantity(float(allowed[worst]), "m", 2)
        raise PathFileError(
            f"{name}: jumps by {jump} within {steps[worst]:.3g} s, {times[worst]:+.4g} s from mid-aperture; the "
            f"steps beside it allow {limit}",
            "accepted: the log of a flight without steps",
            "Remove the wrong fixes, or smooth the log before",
        )
