"""`bisar-budget init` and `bisar-budget schema`: to start a mission file from, and to write it with."""

import os

import click

from bisar_budget.cli.streams import FILE, OUTPUT, complain, deliver, fail


@click.command()
@click.argument("file", type=FILE, default="mission.yaml")
@click.option("--name", default="My bistatic mission", show_default=True, help="Name of the mission.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def init(file: str, name: str, force: bool) -> None:
    """Write a commented mission file to start from.

    FILE is mission.yaml by default, - for standard output.
    """
    import json

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
    """Print the JSON Schema of the mission file, for editors.

    The first line of a file names its schema: # yaml-language-server: $schema=mission.schema.json
    """
    import json

    from bisar_budget.mission.model import mission_schema
    from bisar_budget.mission.parts import part_schema

    text = json.dumps(part_schema() if is_of_part else mission_schema(), indent=2) + "\n"
    deliver(text, output, "json")
