"""Every number that a mission file states, and what a small change of it is."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from bisar_budget import units
from bisar_budget.design.quantities import FACTOR, Number, as_number, form_of
from bisar_budget.mission.bounds import DIRECTION, ELEVATION, LATITUDE
from bisar_budget.mission.model import MISSION, SHARES
from bisar_budget.mission.readers import INVALID, Choice, ListOf, Quantity, Reader, Triple, Version, Whole

# Half of a difference. A power law of exponent p is wrong by (p - 1)(p - 2)/6 of its square, 2e-4 for the inverse
# square; allowables by exact ranges end their search within 1e-5 of a limit, which is 1e-3 of a hundredth.
RELATIVE_STEP = 0.01
# Sines and decibels bend faster than powers: 3e-6 of a slope, and 1.4e-4.
DIRECTION_STEP = math.radians(0.25)
LEVEL_STEP = 0.25  # dB
_EARTH = 6.371e6  # m, mean radius

_LEVELS = (units.POWER_RATIO, units.PHASE_NOISE, units.TONE)


class Stated(NamedTuple):
    """A number that the file states as `text`.

    `step` is half of the difference that is taken, `per` the change that an effect is said for, in SI, and `per_text`
    the same in words. `part` is how much of a change that is, by one measure for all: a part of the number, of a
    radian, of a power, or of the smaller slant range. `others` are numbers that change with it: shares sum to 1.
    `is_scale` marks the elements of a covariance, of which the value is a factor on all sigmas.
    """

    number: Number
    text: str
    value: float
    step: float
    per: float
    per_text: str
    part: float = 0.01
    others: tuple[Number, ...] = ()
    is_scale: bool = False

    def at(self, value: float) -> Mapping[Number, float]:
        """Give the numbers of the mission where this one has another value."""
        left = 1 - self.value
        rest = {one: (one.value or 0.0) * (1 - value) / left for one in self.others}
        return {self.number: value, **rest}


class Skipped(NamedTuple):
    """A key that is left out, what the file says there, and why."""

    key: str
    text: str
    reason: str


def stated_numbers(tree: dict[str, Any], nearest_m: float) -> tuple[list[Stated], list[Skipped]]:
    """Find every number of a mission file, in the order of the file, and what is none.

    Parameters
    ----------
    tree : dict
        What the file says, as text.
    nearest_m : float
        Slant range of the nearer platform: a place on the Earth changes by a part of it. [m]
    """
    numbers: list[Stated] = []
    skipped: list[Skipped] = []
    for key, reader, value, above in _leaves(MISSION, tree, (), None):
        if key.endswith(".covariance"):  # a matrix
            numbers.append(_of_sigmas(key))
            continue
        if isinstance(reader, Quantity) and isinstance(value, str):
            found = _stated(as_number(key, reader, value), value, nearest_m, above)
            (numbers if isinstance(found, Stated) else skipped).append(found)  # type: ignore[arg-type]
        elif reason := _no_number(key, reader, value):
            skipped.append(Skipped(key, ", ".join(map(str, value if isinstance(value, list) else [value])), reason))
    return numbers, skipped


Leaf = tuple[str, Reader, Any, Mapping[str, Any] | None]


def _leaves(reader: Reader, value: Any, path: tuple[str, ...], above: Mapping[str, Any] | None) -> Iterator[Leaf]:
    """Go through all that a file says: key, reader and value; of shares all of them."""
    reader = form_of(reader, value)
    parts: Sequence[tuple[str, Any]] = ()
    if isinstance(value, dict):
        parts = list(value.items())
    elif isinstance(value, list) and isinstance(reader, ListOf | Triple):
        parts = [(str(index), item) for index, item in enumerate(value)]
    below = [(name, reader.below(name), item) for name, item in parts]
    if not any(inner for _, inner, _ in below):
        if value is not INVALID:
            yield ".".join(path), _component(reader), value, above
        return
    for name, inner, item in below:
        if inner is not None:
            yield from _leaves(inner, item, (*path, name), value if reader is SHARES else None)


def _component(reader: Reader) -> Reader:
    """One reader of a scalar that stands for each axis."""
    return reader.component if isinstance(reader, Triple) else reader


def _stated(number: Number, text: str, nearest_m: float, shares: Mapping[str, Any] | None) -> Stated | Skipped:
    value = number.value or 0.0
    if number.reader is LATITUDE or number.key.endswith("longitude"):
        step = RELATIVE_STEP * nearest_m / _EARTH
        return Stated(number, text, value, step, step, f"{math.degrees(step):.2g} deg")
    if number.reader in (DIRECTION, ELEVATION):
        return Stated(number, text, value, DIRECTION_STEP, math.radians(1), "1 deg", part=math.radians(1))
    if number.dimension in _LEVELS:
        return Stated(number, text, value, LEVEL_STEP, 1.0, "1 dB", part=math.log(10) / 10)
    if value == 0:
        return Skipped(number.key, text, "is 0: there is no part of it")
    step = RELATIVE_STEP * value
    others: tuple[Number, ...] = ()
    if shares is not None:
        place, _, own = number.key.rpartition(".")
        others = tuple(
            as_number(f"{place}.{name}", number.reader, share) for name, share in shares.items() if name != own
        )
        if value == 1:
            return Skipped(number.key, text, "is the whole: no other share could give what it takes")
    return Stated(number, text, value, step, 0.01 * value, "1 %", others=others)


def _of_sigmas(key: str) -> Stated:
    """All sigmas of a covariance matrix: its elements do not change alone."""
    return Stated(Number(key, FACTOR, 1.0, ""), "its sigmas", 1.0, RELATIVE_STEP, 0.01, "1 %", is_scale=True)


def _no_number(key: str, reader: Reader, value: Any) -> str:
    """Say what a key holds instead of a number; empty for names and remarks, which change nothing."""
    if isinstance(reader, Whole | Version):
        return "is a whole number"
    if isinstance(reader, Choice):
        return "is a choice"
    if key.rpartition(".")[2] == "sensor" or ".sensor." in key:
        return "is a part of the catalogue; solve --for compares parts"
    if key == "collection.center_time":
        return "is an instant"
    if key.endswith(".correlation"):
        return "is a matrix: its elements do not change alone"
    return ""
