"""Functions that read missions from files and texts, and that make the cases of sweeps."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bisar_budget.design.cases import Cases, grid, table_file
from bisar_budget.design.cases import grid_of as grid_of_arrays
from bisar_budget.design.cases import sample as sample_of
from bisar_budget.json_types import JsonObject
from bisar_budget.mission.load import load_mission, parse_mission
from bisar_budget.mission.model import Mission
from bisar_budget.mission.quantities import (
    Measured,
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
        Path of a YAML file; names of files in it are relative to its folder.

    Raises
    ------
    MissionError
        The file cannot be used; `faults` lists every fault with its line.
    """
    return load_mission(os.fspath(path))


def loads(text: str | bytes, file: str = "mission.yaml") -> Mission:
    """Read a mission from a text.

    Parameters
    ----------
    text : str or bytes
        Content of a mission file.
    file : str
        Name for messages; names of files in the text are relative to its folder.

    Raises
    ------
    MissionError
        The text cannot be used; `faults` has every fault with its line.
    """
    return parse_mission(text, file)


@dataclass(frozen=True)
class Spaced:
    """Evenly spaced values of a key, made by `linspace` or `geomspace`.

    `start` and `stop` are texts with a unit. If `is_log`, the values have equal ratios.
    """

    start: str
    stop: str
    count: int
    is_log: bool = False

    def of(self, key: str) -> str:
        """Write the values of `key` as the text of an option `sweep --vary`."""
        return f"{key}={self.start}:{self.stop}:{self.count}" + (":log" if self.is_log else "")


def linspace(start: object, stop: object, count: int) -> Spaced:
    """Make `count` evenly spaced values from `start` to `stop`, both included, for `sweep`.

    Parameters
    ----------
    start, stop : str, float or quantity
        Texts with a unit, such as `"1 s"`, or numbers in SI.
    count : int
        Number of values, at least 2.
    """
    return Spaced(text_of("", start), text_of("", stop), count)


def geomspace(start: object, stop: object, count: int) -> Spaced:
    """Make `count` values from `start` to `stop` with equal ratios; arguments are as in `linspace`, but positive."""
    return Spaced(text_of("", start), text_of("", stop), count, is_log=True)


def cases_of(mission: Mission, values: Mapping[str, object] | str | os.PathLike[str], paired: bool = False) -> Cases:
    """Make the cases of a sweep over the values of keys, or read the cases of a file.

    A sweep has every combination of the values, and the last key varies fastest.

    Parameters
    ----------
    mission : Mission
        The loaded mission.
    values : mapping or path
        Values by key: a range of `linspace`, an array of numbers in SI, a quantity with an array, or a list of texts,
        which are values with units or words. Alternatively `values` is the path of a CSV file, whose header has
        `KEY [unit]` for each column.
    paired : bool
        Whether each case takes one value of every key, instead of every combination.

    Raises
    ------
    QuestionError
        A key is unknown or takes neither a number nor a word, a key has no values, or paired keys have different
        numbers of values. A faulty file raises the subclass `TableError`, which has a line for each fault.
    """
    if not isinstance(values, Mapping):
        return table_file(tree_of(mission), os.fspath(values))
    if not values:
        raise QuestionError("no key varies; accepted: values of one key or more")
    cases = grid_of(mission, values)
    if not paired:
        return cases
    if len(set(cases.shape)) > 1:
        raise QuestionError(f"{', '.join(values)}: differ in length; accepted: one value of each for every case")
    return replace(cases, is_grid=False)


def grid_of(mission: Mission, values: Mapping[str, object]) -> Cases:
    """Make the cases with every combination of values of keys; `values` is as in `cases_of`."""
    tree = tree_of(mission)
    axes = [_axis(tree, key, axis_values) for key, axis_values in values.items()]
    return Cases(tuple(axis.varied[0] for axis in axes), tuple(axis.columns[0] for axis in axes), is_grid=True)


def cases_of_texts(mission: Mission, texts: Sequence[str], sample: str | None = None) -> Cases:
    """Make the cases of texts such as `collection.aperture_time=1:5s:101`.

    They are every combination of the values, or with `sample` a random sample of the ranges.
    """
    tree = tree_of(mission)
    return grid(tree, texts) if sample is None else sample_of(tree, texts, sample)


def _axis(tree: JsonObject, key: str, values: Measured) -> Cases:
    """Make the cases of one key from its values."""
    if isinstance(values, Spaced):
        return grid(tree, [values.of(key)], "sweep")
    if isinstance(values, str):
        return grid(tree, [f"{key}={values}"], "sweep")
    if isinstance(values, Sequence) and any(isinstance(value, str) or is_quantity(value) for value in values):
        return grid(tree, [f"{key}={','.join(text_of('', value) for value in values)}"], "sweep")
    if is_quantity(values):
        values = np.atleast_1d(magnitude(values, number_of(tree, key).dimension.si))
    return grid_of_arrays(tree, {key: values})
