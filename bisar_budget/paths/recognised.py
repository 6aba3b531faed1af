"""Formats of logs of flights: how each is told by its content, what messages call it, and who reads it."""

from collections.abc import Callable
from typing import NamedTuple

from bisar_budget.paths.flight import Log, PathFileError
from bisar_budget.paths.flight_log import is_csv, read_csv
from bisar_budget.paths.gpx import is_gpx, read_gpx
from bisar_budget.paths.log_places import LogKeys
from bisar_budget.paths.nmea import is_nmea, read_nmea
from bisar_budget.paths.rtklib import is_solution, read_solution
from bisar_budget.paths.sbet import is_sbet, read_sbet
from bisar_budget.paths.ulog import is_ulog, read_ulog


class LogFormat(NamedTuple):
    """A format: its words, endings of names of its files, whether bytes are one, and its reader.

    The reader takes the bytes, what messages call the file, and what the mission file says of it.
    """

    words: str
    endings: tuple[str, ...]
    is_one: Callable[[bytes], bool]
    read: Callable[[bytes, str, LogKeys], Log]


# By the word of the mission file, in the order of the schema. What is told by more stands behind.
LOG_FORMATS: dict[str, LogFormat] = {
    "csv": LogFormat("CSV with a header", (".csv",), is_csv, read_csv),
    "sbet": LogFormat("an SBET of records of 136 bytes", (".out", ".sbet"), is_sbet, read_sbet),
    "pos": LogFormat("a solution of RTKLIB", (".pos",), is_solution, read_solution),
    "nmea": LogFormat("sentences of NMEA 0183", (".nmea",), is_nmea, read_nmea),
    "gpx": LogFormat("a GPX track", (".gpx",), is_gpx, read_gpx),
    "ulog": LogFormat("a PX4 ULog", (".ulg",), is_ulog, read_ulog),
}
_WITH_WEEK = ("sbet",)


def log_format(data: bytes) -> str | None:
    """Format of a log by its content; None where it is none of `LOG_FORMATS`."""
    return next((name for name in reversed(LOG_FORMATS) if LOG_FORMATS[name].is_one(data)), None)


def read_log(data: bytes, name: str, stated: str | None, keys: LogKeys) -> Log:
    """Read a log.

    Parameters
    ----------
    data : bytes
        The file.
    name : str
        What messages call it.
    stated : str or None
        Its format by the mission file; None: by its content, or else by the ending of its name.
    keys : LogKeys
        What else the mission file says of it.

    Raises
    ------
    PathFileError
        The content is that of another format, or of none; or what its reader says.
    """
    found = log_format(data)
    if stated is not None and found not in (None, stated):
        raise PathFileError(
            f"{name}: is {LOG_FORMATS[found].words}",
            f"accepted: {LOG_FORMATS[stated].words}",
            f"trajectory.format: {found} reads it",
            key="format",
        )
    by_ending = (one for one, format in LOG_FORMATS.items() if name.lower().endswith(format.endings))
    chosen = stated or found or next(by_ending, None)
    if chosen is None:
        known = ", ".join(f"{format.words} ({one})" for one, format in LOG_FORMATS.items())
        raise PathFileError(
            f"{name}: is no log that is known by its content",
            f"accepted: {known}",
            "trajectory.format: csv says what is wrong with a header" if b"\0" not in data[:10_000] else "",
        )
    if keys.week is not None and chosen not in _WITH_WEEK:
        raise PathFileError(
            f"is for an SBET; {name} is {LOG_FORMATS[chosen].words}",
            hint="Leave trajectory.week out",
            key="week",
        )
    return LOG_FORMATS[chosen].read(data, name, keys)
