"""Functions that read missions from files or strings, and functions that make the cases of sweeps."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bisar_budget.findings.case_table import Cases
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
from bisar_budget.questions.cases import grid, table_file
from bisar_budget.questions.cases import grid_of as grid_of_arrays
from bisar_budget.questions.cases import sample as sample_of


def load(path: str | os.PathLike[str]) -> Mission:
    """Read a mission file.

    Parameters
    ----------
    path : path
        Path of a YAML file; names of files in it are relative to its folder.

    Raises
    ------
    MissionError
        The file cannot be used; the attribute `faults` of the exception lists every fault with its line.
    """
    return load_mission(os.fspath(path))


def loads(text: str | bytes, file: str = "mission.yaml") -> Mission:
    """Read a mission from a string.

    Parameters
    ----------
    text : str or bytes
        Content of a mission file.
    file : str
        File name to use in messages. Relative file names in the mission refer to the folder of this file.

    Raises
    ------
    MissionError
        The mission cannot be used; the attribute `faults` of the exception lists every fault with its line.
    """
    return parse_mission(text, file)


@dataclass(frozen=True)
class Spaced:
    """Range of values for a key of a sweep, made by `linspace` or `geomspace`.

    `start` and `stop` are strings with a unit. Successive values have equal differences, or equal ratios if `is_log`.
    """

    start: str
    stop: str
    count: int
    is_log: bool = False

    def of(self, key: str) -> str:
        """Write the range as a value of the option `--vary`, such as `collection.aperture_time=1 s:5 s:101`."""
        return f"{key}={self.start}:{self.stop}:{self.count}" + (":log" if self.is_log else "")


def linspace(start: object, stop: object, count: int) -> Spaced:
    """Make `count` evenly spaced values from `start` to `stop`, both included, for `sweep`.

    Parameters
    ----------
    start, stop : str, float or quantity
        Strings with a unit, such as `"1 s"`, or numbers in SI.
    count : int
        Number of values, at least 2.
    """
    return Spaced(text_of("", start), text_of("", stop), count)


def geomspace(start: object, stop: object, count: int) -> Spaced:
    """Make `count` values from `start` to `stop` with equal ratios, for `sweep`.

    The arguments are the same as for `linspace`, but `start` and `stop` must be positive.
    """
    return Spaced(text_of("", start), text_of("", stop), count, is_log=True)


def cases_of(mission: Mission, values: Mapping[str, object] | str | os.PathLike[str], paired: bool = False) -> Cases:
    """Make the cases of a sweep from the values of its keys, or read the cases from a CSV file.

    By default there is a case for every combination of the values, and the last key varies fastest.

    Parameters
    ----------
    mission : Mission
        The loaded mission.
    values : mapping or path
        Values by key. The values of a key are a range made by `linspace` or `geomspace`, an array of numbers in SI, a
        quantity with an array, or a list of strings. Each string is a number with its unit, or a name. Alternatively
        `values` is the path of a CSV file, whose header has `KEY [unit]` for each column.
    paired : bool
        If true, the n-th case takes the n-th value of every key. By default every combination of the values is a
        case.

    Raises
    ------
    QuestionError
        A key is unknown or accepts neither a number nor a name, a key has no values, or paired keys have different
        numbers of values. A faulty CSV file raises the subclass `TableError`, whose `lines` describe one fault each.
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
    """Make a case for every combination of the values of the keys; `values` is a mapping as in `cases_of`."""
    tree = tree_of(mission)
    axes = [_axis(tree, key, axis_values) for key, axis_values in values.items()]
    return Cases(tuple(axis.varied[0] for axis in axes), tuple(axis.columns[0] for axis in axes), is_grid=True)


def cases_of_texts(mission: Mission, texts: Sequence[str], sample: str | None = None) -> Cases:
    """Make the cases of a sweep from strings such as `collection.aperture_time=1:5s:101`.

    There is a case for every combination of the values. If `sample`, the value of the option `--sample`, is given,
    the cases are a random sample of the ranges instead.
    """
    tree = tree_of(mission)
    return grid(tree, texts) if sample is None else sample_of(tree, texts, sample)


def _axis(tree: JsonObject, key: str, values: Measured) -> Cases:
    """Make the cases of a sweep over a single key from its values, in any form that `cases_of` accepts."""
    if isinstance(values, Spaced):
        return grid(tree, [values.of(key)], "sweep")
    if isinstance(values, str):
        return grid(tree, [f"{key}={values}"], "sweep")
    if isinstance(values, Sequence) and any(isinstance(value, str) or is_quantity(value) for value in values):
        return grid(tree, [f"{key}={','.join(text_of('', value) for value in values)}"], "sweep")
    if is_quantity(values):
        values = np.atleast_1d(magnitude(values, number_of(tree, key).dimension.si))
    return grid_of_arrays(tree, {key: values})
