"""Grouping of the missions of a run by their settings. Each mission uses the nearest `pyproject.toml`."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.options import settings_here

if TYPE_CHECKING:
    from bisar_budget.settings import Settings


@dataclass(frozen=True, eq=False)
class Project:
    """Mission files that use the same settings, and a Click context whose option defaults are these settings."""

    settings: "Settings | None"
    files: tuple[str, ...]
    context: click.Context

    @property
    def settings_file(self) -> str | None:
        """Path of the settings file, relative to the current folder; None if there are no settings."""
        return None if self.settings is None else os.path.relpath(self.settings.file)

    @contextmanager
    def options(self) -> Iterator[click.Context]:
        """Context manager that makes the Click context of this project the current context."""
        with self.context.scope(cleanup=False):
            yield self.context


def folder_of_file(file: str) -> str | None:
    """Absolute path of the folder of a mission file; None if the folder does not exist. The file need not exist."""
    folder = os.path.dirname(file) or os.curdir
    return os.path.abspath(folder) if "\0" not in file and os.path.isdir(folder) else None


def by_settings(files: Sequence[str]) -> "list[tuple[Settings | None, tuple[str, ...]]]":
    """Group mission files by the settings nearest to each of them, keeping the order of the files.

    Each item of the list is a pair of the settings and the files of a group. The settings are None if no settings
    apply to the files. A mission from standard input uses the settings of the current folder.
    """
    groups: dict[str, tuple[Settings | None, list[str]]] = {}
    for file in files:
        settings = settings_here(folder=None if file == "-" else folder_of_file(file))
        groups.setdefault(settings.file if settings else "", (settings, []))[1].append(file)
    return [(settings, tuple(of_settings)) for settings, of_settings in groups.values()]
