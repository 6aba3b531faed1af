"""`bisar-budget import`: a mission file out of a file of radar data."""

import os

import click

from bisar_budget.cli.streams import FILE, complain, deliver, fail


@click.command("import")
@click.argument("file", type=FILE)
@click.option("-o", "--output", type=FILE, metavar="FILE", help="Write to FILE instead of standard output.")
@click.option("--channel", metavar="ID", help="Channel of CPHD or CRSD; without it the file's reference channel.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def import_file(file: str, output: str | None, channel: str | None, force: bool) -> None:
    """Write a mission file from CPHD, CRSD or SICD.

    FILE is read as far as its header, its XML and the parameters of its pulses; XML alone is read too. The mission
    has the scene point, the band, the aperture by the dwell on that point, both platforms' paths, and the errors that
    the file declares. What a mission has no key for stands in its comments. Needs the extra `formats`.
    """
    from bisar_budget.formats.document import FormatError, MissingExtraError
    from bisar_budget.formats.importing import import_collection
    from bisar_budget.formats.mission_text import mission_text

    if output is not None and output != "-" and os.path.exists(output):
        if not force:
            fail(f"{output} exists; --force replaces it")
        if os.path.exists(file) and os.path.samefile(file, output):
            fail(f"{output} is the file to read")
    try:
        text = mission_text(import_collection(file, channel))
    except (FormatError, MissingExtraError) as error:
        fail(str(error))
    deliver(text, output, "yaml")
    if output not in (None, "-"):
        complain(f"Wrote {output}. Next: bisar-budget check {output}")
