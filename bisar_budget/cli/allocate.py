"""`bisar-budget allocate`: error sizes to specify, so that the mission meets every requirement."""

import math
import os
import sys
from collections.abc import Sequence
from datetime import datetime
from functools import partial
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.options import DATE, FILE, MISSIONS, MODEL, SET, answer_options, ask_each
from bisar_budget.cli.streams import (
    BROKEN_EXIT_CODE,
    MISSION_SUFFIXES,
    complain,
    deliver_answer,
    expand,
    fail,
    load_all,
    spare,
    write_file,
)

if TYPE_CHECKING:
    from bisar_budget.faults import SetValue
    from bisar_budget.findings.specification import SpecificationSheet


@click.command()
@MISSIONS
@click.option(
    "--for",
    "keys",
    multiple=True,
    metavar="KEY",
    help="Path of an error to specify, such as platforms.receiver.motion_error.velocity. Repeatable; omitted: those "
    "of allocation.specify, else position, velocity and acceleration of both platforms and the clocks.",
)
@click.option(
    "--reserve",
    type=click.FloatRange(0, 100, max_open=True),
    metavar="PERCENT",
    help="Fraction of every limit to keep in reserve (default: 100 % less allocation.warn_above, 20 %).",
)
@click.option(
    "--compare",
    "other",
    type=FILE,
    metavar="MISSION",
    help="Compare the figures of another mission file with the specifications.",
)
@MODEL
@SET
@DATE
@answer_options("allocate", "needs and sdoc are requirements for Sphinx-Needs and StrictDoc.")
def allocate(
    missions: Sequence[str],
    keys: Sequence[str],
    reserve: float | None,
    other: str | None,
    model: str | None,
    changes: "tuple[SetValue, ...]",
    today: datetime | None,
    format_name: str | None,
    output: str | None,
) -> None:
    """Find specifications for the errors of a mission that together meet every requirement.

    The sizes are the largest ones: none can grow unless another shrinks. Specifications are rounded down to two
    digits, and the mission is checked with them. All other errors of the file are fixed and use their part of the
    limits first; split, combination, autofocus and model are those of the file. With -o FILE.yaml the mission is
    written with the specifications. Exit code: 0, 1 if there are none, or the mission does not comply with them, or
    with the offer of --compare, 2 for wrong usage or an unusable mission file.
    """
    if reserve is not None and math.isnan(reserve):
        raise click.UsageError("--reserve: nan is no part of a limit; accepted: 0 to 100, in percent.")
    files = expand(missions)
    is_mission = output is not None and output.lower().endswith(MISSION_SUFFIXES)
    if is_mission and len(files) > 1:
        raise click.UsageError("-o FILE.yaml writes one mission.")
    if other is not None and len(files) > 1:
        raise click.UsageError("--compare compares one offer with one mission.")
    spare([*files, *([other] if other else [])], [output])
    loaded = load_all(files, model, changes)
    if (twice := next((key for place, key in enumerate(keys) if key in keys[:place]), None)) is not None:
        raise click.UsageError(f"--for {twice}: is given twice; accepted: each key once.")
    from bisar_budget.questions import allocate as question

    offer = None if other is None else load_all([other], model, changes)[0]
    kept_free = None if reserve is None else reserve / 100
    ask = partial(question.allocate, keys=keys, reserve=kept_free, offer=offer)
    sheets = [(answer.found, answer.offer) for answer in ask_each(loaded, model, today, ask)]
    if is_mission and output is not None:  # before the report, so that a failure leaves no output
        _write_mission(sheets[0][0], output, model)
        output = None
    deliver_answer("allocate", sheets, format_name, output)
    complies = all(sheet.complies and (of_offer is None or of_offer.complies) for sheet, of_offer in sheets)
    sys.exit(0 if complies else BROKEN_EXIT_CODE)


def _write_mission(sheet: "SpecificationSheet", output: str, model: str | None) -> None:
    """Write a mission file in which the errors have the specified sizes, which are repeated under `specifications`.

    Nothing is written if there are no specifications, or if the new text would not be a valid mission file.
    """
    from bisar_budget.faults import MissionError, SetValue
    from bisar_budget.mission.edited import in_folder, with_section, with_values
    from bisar_budget.mission.load import parse_mission

    findings = sheet.findings
    if sheet.broken or findings is None or findings.mission is None:
        complain(f"{output} is not written: there are no specifications.")
        return
    text = (findings.mission.data or b"").decode("utf-8-sig")
    of_model = [SetValue("allocation.model", model)] if model else []
    file_names = in_folder(findings.mission, os.path.dirname(output) or os.curdir)
    text = with_values(text, [*sheet.changes, *of_model, *file_names, *sheet.ordered])
    text = with_section(text, "specifications", {each.key: each.text for each in sheet.specifications if each.text})
    try:
        parse_mission(text, output)
    except MissionError as error:
        fail(f"{output} is not written: {error.faults[0]}")
    write_file(output, text)
