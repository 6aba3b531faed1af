"""The cases of a sweep as files: a module for each format, found here by the suffix of the file."""

from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple, Protocol

from bisar_budget.memory import OF_TABLES, hold_room

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bisar_budget.design.table import Part
    from bisar_budget.report.tables.described import Described


class Writer(Protocol):
    """A module that writes one format."""

    def write(self, described: "Described", parts: "Iterable[Part]", path: str) -> None:
        """Write the parts as they come; memory holds a few of them.

        Raises
        ------
        OSError
            The file cannot be written.
        """


class TableFormat(NamedTuple):
    """One format: its module here, and the library of the extra `tables` that it needs, if any."""

    name: str
    module: str
    library: str = ""


TABLES = {
    ".csv": TableFormat("CSV", "cases_csv"),
    ".parquet": TableFormat("Parquet", "parquet", "pyarrow"),
    ".nc": TableFormat("NetCDF", "netcdf", "netCDF4"),
}


class MissingTablesError(Exception):
    """The extra `tables` is not installed."""


def writer_of(suffix: str) -> Writer:
    """Find what writes the files of a suffix, one of `TABLES`.

    Raises
    ------
    MissingTablesError
        Its library is not installed; says how to have it.
    """
    name, module, library = TABLES[suffix]
    if library:
        hold_room(OF_TABLES, name)
        try:
            import_module(library)
        except ImportError:
            raise MissingTablesError(
                f"{name} needs {library}, which is not installed; pip install 'bisar-budget[tables]' brings it"
            ) from None
    writer: Writer = import_module(f"{__name__}.{module}")
    return writer
