"""Write keys of the mission file and ids of rows in words, for drawings.

Keys already consist of words, and the path of a key contains its owner: `platforms.receiver.azimuth` is the azimuth
of the receiver. The words are therefore derived from the path, and no table of all keys is needed.
"""

from bisar_budget.error_kinds.path_kinds import STATE_KINDS
from bisar_budget.findings.requirement import REQUIREMENT_NAMES

_ERROR_SECTION = "motion_error"
_IMPLIED_SECTIONS = frozenset({"platforms", "collection", "radar", _ERROR_SECTION})
_VECTOR_KEYS = frozenset({"position", "velocity", "acceleration", "jerk", "snap"})  # of a path, along x, y, z
_AXIS_NAMES = dict(zip("012", "xyz", strict=True))
_WORDS = {**REQUIREMENT_NAMES, "requirements": "required", "imu": "IMU", "gnss": "GNSS"}
_STATES = frozenset(kind.name for kind in STATE_KINDS)


def in_words(path: str) -> str:
    """Write a key of the mission file, or the id of a row, in words.

    `platforms.receiver.velocity.1` is `receiver velocity y`. The key `platforms.receiver.motion_error.velocity` is
    `receiver velocity error`.
    """
    words: list[str] = []
    parent, grandparent = "", ""
    for name in path.split("."):
        is_component = parent in _VECTOR_KEYS and grandparent != _ERROR_SECTION
        if name not in _IMPLIED_SECTIONS:
            words.append(_AXIS_NAMES.get(name, name) if is_component else _WORDS.get(name, name.replace("_", " ")))
        if parent == _ERROR_SECTION and name in _STATES:
            words.append("error")
        parent, grandparent = name, parent
    return " ".join(words)


def key_beside(path: str) -> str:
    """Return a key or an id to be written in small print beside its words; empty if the words are the same."""
    return "" if in_words(path) == path else path
