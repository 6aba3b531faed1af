"""`bisar-budget sensors`: parts whose figures a mission can take."""

import sys
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.streams import EXIT_USAGE, TEXT_OR_JSON, complain, deliver
from bisar_budget.faults import printable

if TYPE_CHECKING:
    from bisar_budget.mission.parts import Entry

_TITLES = {
    "imu": "Inertial sensors (motion_error.sensor), 1 sigma, each axis",
    "gnss": "GNSS receivers, each in one mode (motion_error.sensor), 1 sigma east, north, up",
    "oscillator": "Oscillators (oscillator.sensor)",
}


@click.command()
@click.argument("pattern", default="*")
@click.option("--kind", type=click.Choice(list(_TITLES)), help="Only parts of this kind.")
@TEXT_OR_JSON
def sensors(pattern: str, kind: str | None, format_name: str) -> None:
    """List parts of the catalogue, their figures and where these stand.

    PATTERN is a name, or a glob of names. A mission takes a part's figures by its name: `motion_error: {sensor:
    stim300}`, `oscillator: {sensor: sit5358}`. Parts of your own are YAML files of the same form: name the file, or
    folders of files in `[tool.bisar-budget] sensors` of pyproject.toml.
    """
    from fnmatch import fnmatchcase

    from bisar_budget.mission.parts import PartError, entries, folders

    try:
        known = list(entries(folders("")))
    except PartError as error:
        complain(f"error: {printable(str(error))}")
        sys.exit(EXIT_USAGE)
    chosen = [one for one in known if fnmatchcase(one.id, pattern) and kind in (None, one.part.kind)]
    if not chosen:
        from bisar_budget.mission.readers import did_you_mean

        hint = did_you_mean(pattern, tuple(one.id for one in known))
        complain(f"error: no part of the catalogue matches {printable(pattern)}. {hint}".rstrip())
        sys.exit(EXIT_USAGE)
    deliver(_as_json(chosen) if format_name == "json" else _as_text(chosen), None, format_name)


def _as_text(chosen: "list[Entry]") -> str:
    from bisar_budget.mission.parts import evidence
    from bisar_budget.report.words.layout import wrapped

    lines: list[str] = []
    for kind, title in _TITLES.items():
        of_kind = [one for one in chosen if one.part.kind == kind]
        if of_kind:
            lines += [title, ""]
        for one in of_kind:
            lines += wrapped(f"{one.id}  {printable(one.part.name)}", "    ")
            for figure, written in one.figures.items():
                lines += wrapped(f"    {figure}: {printable(written)}", "        ")
            if one.part.says:
                lines += wrapped(f"    {printable(one.part.says)}", "    ")
            texts = dict.fromkeys(evidence(one.part, figure) for figure in one.figures)
            for text in texts:
                said = text.removeprefix(f"{one.part.name}: ")
                lines += wrapped(f"    source: {printable(said)}", "        ")
            lines.append("")
    return "\n".join(lines)


def _as_json(chosen: "list[Entry]") -> str:
    import json

    from bisar_budget.mission.parts import evidence

    parts = [
        {
            "id": one.id,
            "kind": one.part.kind,
            "name": one.part.name,
            "figures": {
                figure: {"value": written, "source": evidence(one.part, figure).removeprefix(f"{one.part.name}: ")}
                for figure, written in one.figures.items()
            },
            "says": one.part.says,
            "file": one.file,
        }
        for one in chosen
    ]
    return json.dumps({"format": "bisar-budget/sensors/1", "parts": parts}, indent=2, ensure_ascii=False) + "\n"
