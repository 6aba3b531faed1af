"""A project's defaults for `check`: the table `[tool.bisar-budget]` of the nearest `pyproject.toml` that has one."""

import os
import re
from collections.abc import Mapping
from typing import Any, NamedTuple

TABLE = "tool.bisar-budget"
KEYS = {
    "format": str,
    "report": list,
    "strict": bool,
    "exit-zero": bool,
    "model": str,
    "monte-carlo": int,
    "seed": int,
    "color": str,
}
_KINDS = {str: "text", bool: "true or false", int: "a whole number", list: "a list of file names"}
# Only a file in which the table can be is parsed: tomllib costs a fifth of a check's start.
_CANDIDATE = re.compile(rb"""[.\s\["']bisar-budget["']?\s*[\].=]""")


class SettingsError(Exception):
    """A table that cannot be used; the message names file and key."""


class Settings(NamedTuple):
    """What the table says; `file` is where it stands, for messages."""

    file: str
    values: Mapping[str, Any]


def project_settings(folder: str) -> Settings | None:
    """Read the table for a folder; None if no `pyproject.toml` in it or above has one.

    Names of reports are relative to the file that says them.

    Raises
    ------
    SettingsError
        No TOML, an unknown key, or a value of the wrong type.
    """
    folder = os.path.abspath(folder)
    while True:
        settings = _read(os.path.join(folder, "pyproject.toml"))
        above = os.path.dirname(folder)
        if settings is not None or above == folder:
            return settings
        folder = above


def _read(file: str) -> Settings | None:
    try:
        with open(file, "rb") as stream:
            data = stream.read()
    except OSError:
        return None
    if not _CANDIDATE.search(data):
        return None
    import tomllib

    try:
        document = tomllib.loads(data.decode("utf-8"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise SettingsError(f"{file}: is not valid TOML: {error}") from None
    tools = document.get("tool")
    table = tools.get("bisar-budget") if isinstance(tools, dict) else None
    if table is None:
        return None
    if not isinstance(table, dict):
        raise SettingsError(f"{file}: {TABLE}: must be a table")
    for key, value in table.items():
        _hold_to_type(file, key, value)
    values = dict(table)
    if "report" in values:
        values["report"] = [os.path.join(os.path.dirname(file), name) for name in values["report"]]
    return Settings(file, values)


def _hold_to_type(file: str, key: str, value: object) -> None:
    kind = KEYS.get(key)
    if kind is None:
        from difflib import get_close_matches

        near = get_close_matches(key, KEYS, 1)
        hint = f" Did you mean {near[0]!r}?" if near else ""
        raise SettingsError(f"{file}: {TABLE}.{key}: is not a known key; accepted: {', '.join(KEYS)}.{hint}")
    is_right = type(value) is kind and (kind is not list or all(type(name) is str for name in value))  # type: ignore[attr-defined]
    if not is_right:
        raise SettingsError(f"{file}: {TABLE}.{key}: must be {_KINDS[kind]} (got {value!r})")
