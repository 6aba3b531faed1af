"""`bisar-budget init`, `schema` and `import`: mission files to start from, and their schema for editors."""

import json
import os

import click

from bisar_budget.cli.options import FILE, OUTPUT
from bisar_budget.cli.streams import complain, deliver, fail

_WAVELENGTH_PER_VISIBLE_OFFSET = 20  # an offset of λ/20 from the path turns the phase by 0.3 rad
_FORCE = click.option("--force", is_flag=True, help="Replace an existing file.")


@click.command()
@click.argument("file", type=FILE, default="mission.yaml")
@click.option("--name", default="My bistatic mission", show_default=True, help="Name of the mission.")
@_FORCE
def init(file: str, name: str, force: bool) -> None:
    """Write a commented mission file to start from.

    FILE is mission.yaml by default, - for standard output.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    from bisar_budget.faults import InvalidValueError
    from bisar_budget.mission.readers import Text
    from bisar_budget.resources import resource

    try:
        Text().leaf(name)
    except InvalidValueError as error:
        raise click.UsageError(f"--name {error}") from None
    environment = Environment(
        loader=FileSystemLoader(resource("templates")), undefined=StrictUndefined, keep_trailing_newline=True
    )
    text = environment.get_template("mission.yaml.j2").render(name=json.dumps(name, ensure_ascii=False))
    if file != "-" and os.path.exists(file) and not force:
        fail(f"{file} exists; --force replaces it")
    deliver(text, file, "yaml")
    if file == "-":
        return
    complain(f"Wrote {file}. Next: bisar-budget check {file}")
    complain("For completion and checks in an editor: bisar-budget schema -o mission.schema.json beside it.")


@click.command()
@click.option("--part", "is_of_part", is_flag=True, help="Of the file of a part: a sensor, or an oscillator.")
@OUTPUT
def schema(is_of_part: bool, output: str | None) -> None:
    """Print the JSON Schema of mission files, for use in an editor.

    With --part, it is the schema of the YAML file of a catalogue part. To let an editor find the schema, make this
    the first line of a mission file: # yaml-language-server: $schema=mission.schema.json
    """
    from bisar_budget.error_kinds.registry import entry_point_faults
    from bisar_budget.mission.model import mission_schema
    from bisar_budget.mission.parts import part_schema

    text = json.dumps(part_schema() if is_of_part else mission_schema(), indent=2) + "\n"
    for fault in () if is_of_part else entry_point_faults():
        complain(f"Warning: {fault}.")
    deliver(text, output, "json")


@click.command("import")
@click.argument("file", type=FILE)
@OUTPUT
@click.option("--channel", metavar="ID", help="Channel of CPHD or CRSD; without it the file's reference channel.")
@_FORCE
def import_file(file: str, output: str | None, channel: str | None, force: bool) -> None:
    """Write a mission file from CPHD, CRSD or SICD.

    FILE is read as far as its header, its XML and the parameters of its pulses; XML alone is read too. The mission
    has the scene point, the band, the aperture by the dwell on that point, both platforms' paths, and the errors that
    the file declares. Data without a key in the mission are written as comments. Needs the extra `formats`.
    """
    from bisar_budget.constants import SPEED_OF_LIGHT_MPS
    from bisar_budget.extras import MissingExtraError
    from bisar_budget.faults import MissionError
    from bisar_budget.formats.collected import mission_text
    from bisar_budget.formats.containers import FormatError
    from bisar_budget.formats.importing import import_collection
    from bisar_budget.mission.load import parse_mission
    from bisar_budget.units import format_quantity

    if output is not None and output != "-" and os.path.exists(output):
        if not force:
            fail(f"{output} exists; --force replaces it")
        if os.path.exists(file) and os.path.samefile(file, output):
            fail(f"{output} is the file to read")
    try:
        collection = import_collection(file, channel)
        text = mission_text(collection)
        parse_mission(text, "the mission")
    except (FormatError, MissingExtraError) as error:
        fail(str(error))
    except MissionError as error:
        fail(f"{file}: no mission can be made of it: {error.faults[0]}")
    tracks = {"transmitter": collection.transmitter, "receiver": collection.receiver}
    away = {name: format_quantity(track.farthest, "m") for name, track in tracks.items()}
    for name, track in tracks.items():
        if track.farthest > track.state.slant_range / 100:
            fail(f"{file}: a {name} position is {away[name]} from its path, more than a hundredth of its range")
    farthest = max(track.farthest for track in tracks.values())
    if (
        collection.unused
        or farthest > SPEED_OF_LIGHT_MPS / collection.center_frequency / _WAVELENGTH_PER_VISIBLE_OFFSET
    ):
        doubts = [collection.unused] if collection.unused else []
        doubts += [f"positions of the {name} are up to {length} from its path" for name, length in away.items()]
        complain(f"warning: {'; '.join(doubts)}; the comments say more")
    deliver(text, output, "yaml")
    if output not in (None, "-"):
        complain(f"Wrote {output}. Next: bisar-budget check {output}")
