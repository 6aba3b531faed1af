"""The subject of an error or a row, and its name."""

from functools import cache
from typing import NamedTuple

MOTION = ("position", "velocity", "acceleration")  # kinds of error that a platform's measured path can have


class Subject(NamedTuple):
    """The thing that a row or an error is about. `subject` makes it, with its id; nobody reads an id to find out.

    `owner` is the one whose share it counts against: transmitter, receiver, clock, or mission for what is nobody's.
    `kind` is position, velocity, acceleration, vibration, timing, terrain, other, or the name of a sum. `axis` is the
    axis of `frame`, the term of the clock, the name of another error, the sort of a vibration, and `entry` the place
    of one in the file.
    """

    id: str
    owner: str
    kind: str
    axis: str = ""
    frame: str = "scene"
    entry: int | None = None


@cache
def subject(owner: str, kind: str, axis: str = "", frame: str = "scene", entry: int | None = None) -> Subject:
    """Name an error or a sum as the contract does."""
    if kind in ("timing", "other"):  # of one owner each
        parts = [kind, axis]
    elif owner == "clock":
        parts = ["timing", kind]
    elif owner == "mission" and kind in MOTION:
        parts = ["common", kind, axis]
    else:
        parts = [owner, kind, axis, "" if entry is None else str(entry)]
    return Subject(".".join(filter(None, parts)), owner, kind, axis, frame, entry)
