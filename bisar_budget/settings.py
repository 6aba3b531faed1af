"""Defaults of a project for `check`: the table `[tool.bisar-budget]` of the nearest `pyproject.toml` that has it."""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from bisar_budget.faults import fault_words, shown
from bisar_budget.resources import DISK, Files, UnreadableError

TABLE = "tool.bisar-budget"
SETTING_TYPES = {
    "format": str,
    "report": list,
    "strict": bool,
    "exit-zero": bool,
    "model": str,
    "monte-carlo": int,
    "seed": int,
    "color": str,
    "sensors": list,
}
_TYPE_WORDS = {str: "text", bool: "true or false", int: "a whole number", list: "a list of file names"}
# Only a file that mentions the tool is parsed: tomllib costs a fifth of a check's start. Escapes may hide the name.
_CANDIDATE = re.compile(rb"bisar-budget|\\[uUx]")
_MAX_SETTINGS_BYTES = 1 << 20
_MAX_LINE_DOT_COUNT = 1000  # on a line: tomllib's time grows with the square of the parts of a key


SettingValues = Mapping[str, Any]
"""Values of the table by key, each of the type that `KEYS` states."""


class SettingsError(Exception):
    """The table `[tool.bisar-budget]` cannot be used; the message names the file and the key."""


@dataclass(frozen=True)
class Settings:
    """Keys and values of the table `[tool.bisar-budget]`.

    `file` is the path of the file that contains the table; it is used in messages.
    """

    file: str
    values: SettingValues


def project_settings(folder: str, files: Files = DISK) -> Settings | None:
    """Read the table `[tool.bisar-budget]` that applies to a folder; None if there is no such table.

    The table is read from the nearest `pyproject.toml` that contains it, in the folder or above. `files` is the
    source of the `pyproject.toml` files: the disk, or a git revision. In the file, names of reports and folders of
    sensors are relative to the folder of the `pyproject.toml`.

    Raises
    ------
    SettingsError
        The file is not a regular file, or is not TOML in UTF-8; or a key is unknown, or a value has the wrong type.
    """
    folder = os.path.abspath(folder)
    while True:
        file = os.path.join(folder, "pyproject.toml")
        data = _bytes_of(file, files)
        settings = None if data is None else _parsed(file, data)
        above = os.path.dirname(folder)
        if settings is not None or above == folder:
            return settings
        folder = above


@lru_cache(maxsize=4)
def _parsed(file: str, data: bytes) -> Settings | None:
    """Read the table `[tool.bisar-budget]` from the content of a `pyproject.toml`; None if there is no such table.

    The last results are cached, because the same table may be read for many missions.
    """
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SettingsError(f"{file}: is not UTF-8: {error.reason} at byte {error.start}") from None
    if not _CANDIDATE.search(data) and "\0" not in text:  # UTF-16 has zeros
        return None
    if max(line.count(".") for line in text.splitlines()) > _MAX_LINE_DOT_COUNT:
        raise SettingsError(f"{file}: has a line with more than {_MAX_LINE_DOT_COUNT} dots")
    import tomllib

    try:
        document = tomllib.loads(text)
    except ValueError as error:  # also for an integer with thousands of digits
        raise SettingsError(f"{file}: is not valid TOML: {error}") from None
    except RecursionError:
        raise SettingsError(f"{file}: is nested too deep to be read") from None
    tools = document.get("tool")
    table = tools.get("bisar-budget") if isinstance(tools, dict) else None
    if table is None:
        return None
    if not isinstance(table, dict):
        raise SettingsError(f"{file}: {TABLE}: must be a table")
    for key, value in table.items():
        _hold_to_type(file, key, value)
    values = dict(table)
    for key in ("report", "sensors"):
        if key in values:
            values[key] = [os.path.join(os.path.dirname(file), name) for name in values[key]]
    return Settings(file, values)


def _bytes_of(file: str, files: Files) -> bytes | None:
    """Content of a `pyproject.toml`; None if the file does not exist."""
    try:
        data = files.content(file, _MAX_SETTINGS_BYTES, f"{file}:")
    except UnreadableError as error:
        if error.is_missing:
            return None
        raise SettingsError(str(error)) from None
    if len(data) > _MAX_SETTINGS_BYTES:
        raise SettingsError(f"{file}: is larger than {_MAX_SETTINGS_BYTES >> 20} MiB")
    return data


def _hold_to_type(file: str, key: str, value: object) -> None:
    kind = SETTING_TYPES.get(key)
    if kind is None:
        from difflib import get_close_matches

        near = get_close_matches(key[:100], SETTING_TYPES, 1)
        hint = f"Did you mean {near[0]!r}?" if near else ""
        problem = fault_words("is not a known key", "", f"accepted: {', '.join(SETTING_TYPES)}", hint)
        raise SettingsError(f"{file}: {TABLE}.{shown(key)}: {problem}")
    is_right = type(value) is kind and (kind is not list or all(type(name) is str for name in value))  # type: ignore[attr-defined]
    if type(value) is int:
        is_right = is_right and abs(value) < 1 << 64  # a message cannot print a larger integer
    if not is_right:
        raise SettingsError(f"{file}: {TABLE}.{key}: must be {_TYPE_WORDS[kind]} (got {_said(value)})")


def _said(value: object) -> str:
    try:
        return shown(repr(value))
    except (ValueError, RecursionError):  # an endless number of digits, nested lists
        return "one too large to be shown"
