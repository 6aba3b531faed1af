"""`bisar-budget sensors`: the catalogue of parts (sensors and oscillators) whose error figures a mission can use."""

import json
import os
import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.options import FILE, format_option
from bisar_budget.cli.streams import USAGE_EXIT_CODE, complain, deliver, expand, say_faults, spare
from bisar_budget.faults import file_fault, printable, sentences
from bisar_budget.json_types import JsonObject

if TYPE_CHECKING:
    from bisar_budget.mission.parts import Entry, PartError

_KIND_TITLES = {
    "imu": "Inertial sensors (motion_error.sensor), 1 sigma, each axis",
    "gnss": "GNSS receivers, each in one mode (motion_error.sensor), 1 sigma east, north, up",
    "oscillator": "Oscillators (oscillator.sensor)",
}
_PART_KIND_WORDS = {"imu": "inertial sensor", "gnss": "GNSS receiver", "oscillator": "oscillator"}
_IN_A_FOLDER = "accepted: a folder with files that end in .yaml or .yml"


@click.command()
@click.argument("patterns", nargs=-1, type=FILE, metavar="[PATTERN|FILE]...")
@click.option("--kind", type=click.Choice(list(_KIND_TITLES)), help="Only parts of this kind.")
@click.option("--check", "checking", is_flag=True, help="Check files of parts of your own, instead of a list.")
@format_option(("text", "json"), "Format of the output.")
def sensors(patterns: Sequence[str], kind: str | None, checking: bool, format_name: str) -> None:
    """List parts of the catalogue, their figures and the sources.

    PATTERN is a name, or a glob of names. A mission takes a part's figures by its name: `motion_error: {sensor:
    stim300}`, `oscillator: {sensor: sit5358}`. You can define your own parts in YAML files of the same form as the
    files of the catalogue. A mission can give the name of such a file in place of the name of a part. Alternatively,
    list folders of such files under `sensors` in `[tool.bisar-budget]` of pyproject.toml.

    With --check, FILE is the YAML file of a part, a folder of such files, a glob pattern, or - for standard input.
    Each file is read as a mission reads it, and every fault is reported. Exit code: 0 if missions can use all parts;
    otherwise 2.
    """
    if checking:
        if kind is not None:
            raise click.UsageError("--kind is for the list of parts; it cannot be combined with --check.")
        if not patterns:
            raise click.UsageError("--check needs FILE: files of parts, folders of them, or - for standard input.")
        _check(patterns, format_name)
        return
    chosen = _listed(patterns or ("*",), kind)
    if format_name == "json":
        text = _document({"format": "bisar-budget/sensors/1", "parts": [_item(entry) for entry in chosen]})
    else:
        text = _as_text(chosen)
    deliver(text, None, format_name)


def _listed(patterns: Sequence[str], kind: str | None) -> "list[Entry]":
    """List the parts of the catalogue whose ids match a pattern, restricted to one kind of part if `kind` is given.

    If a pattern matches no part, the command ends with an error.
    """
    from fnmatch import fnmatchcase

    from bisar_budget.mission.parts import PartError, entries, folders

    try:
        catalogued = list(entries(folders("")))
    except PartError as error:
        for reason in error.args:
            complain(f"error: {printable(reason)}")
        sys.exit(USAGE_EXIT_CODE)
    matching = {
        pattern: [each for each in catalogued if fnmatchcase(each.id, pattern) and kind in (None, each.part.kind)]
        for pattern in patterns
    }
    for pattern, matches in matching.items():
        if not matches:
            from bisar_budget.mission.readers import did_you_mean

            hint = did_you_mean(pattern, tuple(each.id for each in catalogued))
            if os.path.exists(pattern):
                hint = "It is a file: --check checks it"
            listed = "`bisar-budget sensors` lists them"
            complain(f"error: {sentences(f'no part of the catalogue matches {printable(pattern)}; {listed}', hint)}")
    if not all(matching.values()):
        sys.exit(USAGE_EXIT_CODE)
    return [each for each in catalogued if any(each in matches for matches in matching.values())]


def _check(names: Sequence[str], format_name: str) -> None:
    """Report, for each part file, whether missions can use it, and exit with code 2 if a file is unusable.

    `names` are files, folders of files, glob patterns, or `-` for standard input.
    """
    from bisar_budget.mission.parts import PartError, part_files, read_entry

    files: list[str] = []
    checked: dict[str, Entry | PartError] = {}
    for name in expand(names):
        try:
            inside = part_files(name) if os.path.isdir(name) else [name]
            if not inside:
                raise PartError.of(name, [file_fault("has no file of a part")._replace(accepted=_IN_A_FOLDER)])
            if any(char in name for char in "*?[") and not os.path.exists(name):
                raise PartError.of(name, [file_fault("not found, and no file matches the pattern")])
            files += inside
        except PartError as error:
            checked[name] = error
    spare(files, [])
    for file in files:
        try:
            checked[file] = read_entry(file)
        except PartError as error:
            checked[file] = error
    lines = []
    for file, result in checked.items():
        if isinstance(result, PartError):
            say_faults(file, result.faults)
        else:
            count = len(result.figures)
            figures = f"{count} figures, each with a source" if count > 1 else "1 figure, with a source"
            description = f"{printable(result.part.name)}, {_PART_KIND_WORDS[result.part.kind]}, {figures}"
            lines.append(f"{printable(file)}: fine: {description}\n")
    deliver(_checked_as_json(checked) if format_name == "json" else "".join(lines), None, format_name)
    if len(lines) < len(checked):
        sys.exit(USAGE_EXIT_CODE)


def _checked_as_json(checked: "Mapping[str, Entry | PartError]") -> str:
    """Make a JSON document with the status of each checked part file, and with its figures or its faults."""
    from bisar_budget.mission.parts import PartError
    from bisar_budget.report.answers.check_content import fault_item

    parts: list[JsonObject] = []
    for file, result in checked.items():
        if isinstance(result, PartError):
            faults = [fault_item(fault) for fault in result.faults]
            parts.append({"file": file, "status": "error", "errors": faults})
        else:
            parts.append({"file": file, "status": "pass", "errors": []} | _item(result))
    status = "error" if any(part["status"] == "error" for part in parts) else "pass"
    return _document({"format": "bisar-budget/sensors-check/1", "status": status, "parts": parts})


def _document(content: JsonObject) -> str:
    """Format a dictionary as indented JSON text."""
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def _as_text(chosen: "list[Entry]") -> str:
    """Text that lists parts of the catalogue by kind, with their error figures and the sources of the figures."""
    from bisar_budget.mission.parts import evidence
    from bisar_budget.report.words.sentences import wrapped

    lines: list[str] = []
    for kind, title in _KIND_TITLES.items():
        of_kind = [each for each in chosen if each.part.kind == kind]
        if of_kind:
            lines += [title, ""]
        for entry in of_kind:
            lines += wrapped(f"{entry.id}  {printable(entry.part.name)}", "    ")
            for figure, written in entry.figures.items():
                lines += wrapped(f"    {figure}: {printable(written)}", "        ")
            if entry.part.says:
                lines += wrapped(f"    {printable(entry.part.says)}", "    ")
            texts = dict.fromkeys(evidence(entry.part, figure) for figure in entry.figures)
            for text in texts:
                source = text.removeprefix(f"{entry.part.name}: ")
                lines += wrapped(f"    source: {printable(source)}", "        ")
            lines.append("")
    return "\n".join(lines)


def _item(entry: "Entry") -> JsonObject:
    """Describe a part of the catalogue as a JSON object, with its figures and their sources."""
    from bisar_budget.mission.parts import evidence

    return {
        "id": entry.id,
        "kind": entry.part.kind,
        "name": entry.part.name,
        "figures": {
            figure: {"value": written, "source": evidence(entry.part, figure).removeprefix(f"{entry.part.name}: ")}
            for figure, written in entry.figures.items()
        },
        "says": entry.part.says,
        "file": entry.file,
    }
