"""`bisar-budget verify` and `simulate`: simulated images with errors at their limits, or with the declared errors."""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.options import (
    FILE,
    MISSIONS,
    SET,
    answer_options,
    output_option,
    plot_option,
    scheduler_options,
    wrong_usage,
)
from bisar_budget.cli.streams import (
    BROKEN_EXIT_CODE,
    USAGE_EXIT_CODE,
    complain,
    deliver,
    deliver_answer,
    expand,
    fail,
    load_all,
    spare,
    suffix_of,
    write_file,
)
from bisar_budget.faults import changes_words, printable

if TYPE_CHECKING:
    from bisar_budget.faults import SetValue
    from bisar_budget.mission.model import Mission
    from bisar_budget.simulator.targets import Targets


@click.command()
@MISSIONS
@click.option("--only", default="*", metavar="GLOB", help="Verify only the rows whose id matches.")
@answer_options("verify")
@SET
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes to use; default: the number of cores, or 1 with the extra `fast`, which uses all cores itself.",
)
@scheduler_options("Form them")
def verify(
    missions: Sequence[str],
    only: str,
    format_name: str | None,
    output: str | None,
    changes: "tuple[SetValue, ...]",
    jobs: int | None,
    scheduler: str | None,
    patience: int,
) -> None:
    """Form images at the limits and measure whether the limits hold.

    The data come from exact ranges, and the phase is measured in the image. A limit is confirmed if the
    image shows its budget within 5 %, optimistic if it shows more, conservative if less. With autofocus
    each limit is formed again with its gain and refocused. Exit code: 0, or 1 if a limit is optimistic, 2
    for wrong usage, an unusable file, or a mission on whose limits no image gave a verdict.
    """
    from bisar_budget.questions.progress import workers_of
    from bisar_budget.questions.verify import verify_all

    files = expand(missions)
    spare(files, [output])
    loaded = load_all(files, changes=changes)
    with wrong_usage(), workers_of(scheduler, patience) as workers:
        verified = verify_all(loaded, only, jobs, workers)
    deliver_answer("verify", verified, format_name, output)
    doubts = [mission for mission in verified if mission.doubt]
    for mission in doubts:
        complain(f"{printable(mission.file)}: {mission.doubt}")
    if doubts:
        sys.exit(USAGE_EXIT_CODE)
    sys.exit(BROKEN_EXIT_CODE if any(mission.status == "fail" for mission in verified) else 0)


@click.command()
@click.argument("mission", type=FILE)
@plot_option("Draw the range error, the images and their cuts on one sheet: .png, .svg or .pdf.")
@click.option(
    "--paper", "is_paper", is_flag=True, help="With --plot: number figures and equations as Rigling & Moses do."
)
@output_option("Save the images and their data for NumPy: .npz. Or write the phase history alone: .cphd.")
@click.option(
    "--image-former",
    type=click.Choice(["backprojection", "polar_format", "matched_filter", "far_field"]),
    default="backprojection",
    show_default=True,
    help="Equation that forms the images: (4) fast or as it is printed, (14), or (12).",
)
@click.option(
    "--targets",
    metavar="LIST",
    help="Targets in the scene, instead of one point at its centre: EAST, NORTH[, LEVEL]; ...; "
    "grid:NXxNY:SPACING; FILE.csv; clutter LEVEL.",
)
@SET
def simulate(
    mission: str,
    plot: str | None,
    is_paper: bool,
    output: str | None,
    image_former: str,
    targets: str | None,
    changes: "tuple[SetValue, ...]",
) -> None:
    """Form the image of a point, or of a scene, with the declared errors.

    Simulates one flight with all errors of the file, with their signs: they may cancel, and `check` gives the worst
    case. The data come from exact ranges; the image is formed where the errors move the point, in the scene's
    axes and rotated so that the smear lies in cross range, before and after autofocus, and rotated back.
    With --targets "0, 0; 40 m, -30 m, -6 dB; clutter -25 dB" there are two points in clutter, and one correction for
    both; levels are those of a pixel over a point of 0 dB. grid:5x5:40 is a grid about the scene centre, and a CSV
    file has the columns east [m], north [m], amplitude.

    FILE.cphd is the phase history for an image former of your own, as CPHD 1.1.0: the signal has the true ranges, its
    vectors have the measured positions. No image is formed then. Needs the extra `formats`.
    """
    kind = suffix_of(plot, (".png", ".svg", ".pdf"))[1:]
    is_phase_history = suffix_of(output, (".npz", ".cphd")) == ".cphd"
    if is_phase_history and plot is not None:
        raise click.UsageError("--plot draws images, and none is formed for a .cphd file.")
    if is_paper and plot is None:
        raise click.UsageError("--paper changes the titles of --plot, which is missing.")
    spare([mission], [plot, output])
    from bisar_budget.questions import simulate as question

    with wrong_usage():
        standing = question.standing(targets)
    (loaded,) = load_all([mission], changes=changes)
    if is_phase_history:
        _export(mission, loaded, str(output), standing)
        return
    from bisar_budget.report.drawing import point_plot

    try:
        images = question.simulate(loaded, standing, image_former=image_former).images
    except (question.SimulationError, ValueError) as error:
        fail(f"{mission}: {error}")
    if output is not None:
        write_file(output, point_plot.archive(images, changes))
    if plot is not None:
        title = f"{loaded.name} {changes_words(changes)}".rstrip()
        write_file(plot, point_plot.drawn(images, title, kind, is_paper=is_paper))
    deliver(point_plot.summary(images, loaded))


def _export(mission: str, loaded: "Mission", output: str, standing: "Targets") -> None:
    """Write the simulated phase history to the CPHD file `output`, and a summary of it to standard output."""
    from bisar_budget.extras import MissingExtraError
    from bisar_budget.formats.exporting import export_phase_history
    from bisar_budget.questions.simulate import SimulationError

    try:
        written = export_phase_history(loaded, standing)
    except (SimulationError, MissingExtraError, ValueError) as error:
        fail(f"{mission}: {error}")
    for remark in written.remarks:
        complain(f"{mission}: {remark}")
    write_file(output, written.data)
    scatterers = f"{written.scatterers} scatterer{'' if written.scatterers == 1 else 's'}"
    deliver(
        f"{printable(output)}: CPHD 1.1.0, {written.vectors} vectors of {written.samples} samples, {scatterers}, "
        f"image area {2 * written.half:g} m x {2 * written.half:g} m\n"
        "signal by the paths as flown, vectors by the paths as measured\n"
    )
