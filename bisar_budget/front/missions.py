"""Missions from files and texts, and the values that a sweep gives them."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bisar_budget.design.cases import Cases, grid, table_file
from bisar_budget.design.cases import grid_of as grid_of_arrays
from bisar_budget.design.cases import sample as sample_of
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import (
    QuestionError,
    is_quantity,
    magnitude,
    number_of,
    text_of,
    tree_of,
)


def load(path: str | os.PathLike[str]) -> Mission:
    """Read a mission file.

    Parameters
    ----------
    path : path
        Of a YAML file; files that it names are looked for beside it.

    Raises
    ------
    MissionError
        The file cannot be used; `faults` has what is wrong, and where.
    """
    return load_mission(os.fspath(path))


def loads(text: str | bytes, file: str = "mission.yaml") -> Mission:
    """Read a mission from a text.

    Parameters
    ----------
    text : str or bytes
        What a mission file would have.
    file : str
        What messages call it; files that it names are looked for beside it.

    Raises
    ------
    MissionError
        The text cannot be used; `faults` has what is wrong, and where.
    """
    return parse_mission(text, file)


@dataclass(frozen=True)
class Spaced:
    """Values of a key from one to another, as `linspace` and `geomspace` give them, in the unit of the texts."""

    start: str
    stop: str
    count: int
    is_log: bool = False

    def of(self, key: str) -> str:
        """The same as `sweep --vary` has it."""
        return f"{key}={self.start}:{self.stop}:{self.count}" + (":log" if self.is_log else "")


def linspace(start: Any, stop: Any, count: int) -> Spaced:
    """So many values from one to another at even distances, both included, for `sweep`.

    Parameters
    ----------
    start, stop : str, float or quantity
        Texts with a unit, `"1 s"`, or numbers in SI.
    count : int
        At least 2.
    """
    return Spaced(text_of("", start), text_of("", stop), count)


def geomspace(start: Any, stop: Any, count: int) -> Spaced:
    """So many values from one to another in equal ratios; arguments are those of `linspace`, above zero."""
    return Spaced(text_of("", start), text_of("", stop), count, is_log=True)


def cases_of(mission: Mission, values: Mapping[str, Any] | str | os.PathLike[str], paired: bool = False) -> Cases:
    """The cases of a sweep: every combination of the values of each key, the last key the fastest; or of a file.

    Parameters
    ----------
    mission : Mission
        As loaded.
    values : mapping or path
        Of each key a range of `linspace`, an array of numbers in SI, a quantity that holds an array, or a list of
        texts: values with units, or words. Or a CSV file, whose header has a `KEY [unit]` for each column.
    paired : bool
        Each case takes one value of every key, instead of every combination.

    Raises
    ------
    QuestionError
        No such key, no number or word for it, no value, pairs of different length; of a file a `TableError`, which
        has a line for each fault.
    """
    if not isinstance(values, Mapping):
        return table_file(tree_of(mission), os.fspath(values))
    if not values:
        raise QuestionError("no key varies; accepted: values of one key or more")
    found = grid_of(mission, values)
    if not paired:
        return found
    if len(set(found.shape)) > 1:
        raise QuestionError(f"{', '.join(values)}: differ in length; accepted: one value of each for every case")
    return replace(found, is_grid=False)


def grid_of(mission: Mission, values: Mapping[str, Any]) -> Cases:
    """Every combination of values of keys, as `cases_of` takes them."""
    tree = tree_of(mission)
    each = [_axis(tree, key, given) for key, given in values.items()]
    return Cases(tuple(one.varied[0] for one in each), tuple(one.columns[0] for one in each), is_grid=True)


def cases_of_texts(mission: Mission, texts: Sequence[str], sample: str | None = None) -> Cases:
    """The cases of texts such as `collection.aperture_time=1:5s:101`; every combination, or a sample of them."""
    tree = tree_of(mission)
    return grid(tree, texts) if sample is None else sample_of(tree, texts, sample)


def _axis(tree: dict[str, Any], key: str, given: Any) -> Cases:
    """The values of one key."""
    if isinstance(given, Spaced):
        return grid(tree, [given.of(key)], "sweep")
    if isinstance(given, str):
        return grid(tree, [f"{key}={given}"], "sweep")
    if isinstance(given, Sequence) and any(isinstance(one, str) or is_quantity(one) for one in given):
        return grid(tree, [f"{key}={','.join(text_of('', one) for one in given)}"], "sweep")
    if is_quantity(given):
        given = np.atleast_1d(magnitude(given, number_of(tree, key).dimension.si))
    return grid_of_arrays(tree, {key: given})
