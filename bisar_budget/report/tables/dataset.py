"""The cases of a sweep as an xarray dataset, in memory: a grid keeps its axes, a table has the dimension `case`."""

from typing import TYPE_CHECKING

import numpy as np

from bisar_budget import __version__
from bisar_budget.design.cases import Cases, Grid
from bisar_budget.design.table import Swept
from bisar_budget.mission.model import Mission
from bisar_budget.report.tables import MissingTablesError
from bisar_budget.report.tables.described import Described

if TYPE_CHECKING:
    from xarray import Dataset


def dataset(swept: Swept, cases: Cases, mission: Mission) -> "Dataset":
    """Check all cases of a sweep, and lay them out.

    Parameters
    ----------
    swept : Swept
        What `sweep` gave, its parts not yet taken.
    cases : Cases
        Those that it was given.
    mission : Mission
        Likewise.

    Returns
    -------
    xarray.Dataset
        A variable for each column, with `units` and `long_name`; numbers are NaN where there is none, texts empty.
        Keys that vary stand in the unit that they were said in, as coordinates. Attributes are those of a table.

    Raises
    ------
    MissingTablesError
        xarray is not installed.
    """
    try:
        from xarray import Dataset
    except ImportError:
        raise MissingTablesError(
            "a dataset needs xarray, which is not installed; pip install 'bisar-budget[tables]' brings it"
        ) from None
    described = Described(swept, cases, mission, __version__)
    parts = [described.values(part) for part in swept.parts]
    whole = {column.name: np.concatenate([part[column.name] for part in parts]) for column in described.columns}
    columns = {column.name: column for column in described.columns}
    attributes = {
        name: {"long_name": column.words, **({} if column.is_text else {"units": column.unit or "1"})}
        for name, column in columns.items()
    }
    if isinstance(cases, Grid):
        dimensions = tuple(swept.varied)
        axes = zip(cases.varied, cases.axes, strict=True)
        coordinates = {one.key: (one.key, described.said(one.key, axis), attributes[one.key]) for one, axis in axes}
    else:
        dimensions = ("case",)
        coordinates = {key: ("case", whole[key], attributes[key]) for key in swept.varied}
    variables = {
        name: (dimensions, values.reshape(cases.shape or values.shape), attributes[name])
        for name, values in whole.items()
        if name not in coordinates
    }
    return Dataset(variables, coordinates, described.facts)
