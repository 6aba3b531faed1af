"""Missions of a run by the settings that hold for them: those of the folder nearest to each mission."""

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
    """Missions that the same settings hold for, and the options of the command with these as defaults."""

    settings: "Settings | None"
    files: tuple[str, ...]
    context: click.Context

    @property
    def settings_file(self) -> str | None:
        """Where the settings stand, from the current folder; None without any."""
        return None if self.settings is None else os.path.relpath(self.settings.file)

    @contextmanager
    def options(self) -> Iterator[click.Context]:
        """Take the options of this project for those of the command."""
        with self.context.scope(cleanup=False):
            yield self.context


def folder_of_file(file: str) -> str | None:
    """Folder of a mission file, whether or not the file is there; None for a name that no folder has."""
    folder = os.path.dirname(file) or os.curdir
    return os.path.abspath(folder) if "\0" not in file and os.path.isdir(folder) else None


def by_settings(files: Sequence[str]) -> "list[tuple[Settings | None, tuple[str, ...]]]":
    """Group mission files by the settings nearest to each, in the order of the files.

    Standard input has those of the current folder.
    """
    found: dict[str, tuple[Settings | None, list[str]]] = {}
    for file in files:
        settings = settings_here(folder=None if file == "-" else folder_of_file(file))
        found.setdefault(settings.file if settings else "", (settings, []))[1].append(file)
    return [(settings, tuple(of_settings)) for settings, of_settings in found.values()]
