"""`bisar-budget simulate`: the image of a point with the declared errors."""

import os
from typing import TYPE_CHECKING

import click

from bisar_budget.cli.streams import FILE, SET, complain, deliver, fail, load_all, spare, write_file
from bisar_budget.cli.verify import faster
from bisar_budget.cli.waiting import FORMING, foretell, watched
from bisar_budget.faults import changes_words, printable

if TYPE_CHECKING:
    from bisar_budget.faults import SetValue
    from bisar_budget.mission.model import Mission
    from bisar_budget.simulate.targets import Targets


@click.command()
@click.argument("mission", type=FILE)
@click.option(
    "--plot", type=FILE, metavar="FILE", help="Draw Figures 3 to 7 of the paper for this mission: .png, .svg or .pdf."
)
@click.option(
    "-o",
    "--output",
    type=FILE,
    metavar="FILE",
    help="Save the images and what explains them for NumPy: .npz. Or write the phase history alone: .cphd.",
)
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
    help="What stands in the scene, instead of one point at its centre: EAST, NORTH[, LEVEL]; ...; "
    "grid:NXxNY:SPACING; FILE.csv; clutter LEVEL.",
)
@SET
def simulate(
    mission: str,
    plot: str | None,
    output: str | None,
    image_former: str,
    targets: str | None,
    changes: "tuple[SetValue, ...]",
) -> None:
    """Form the image of a point, or of a scene, with the declared errors.

    All errors of the file together, with its signs, are flown once: they may cancel, and the worst case is that
    of `check`. The data come from exact ranges; the image is formed where the errors move the point, in the scene's
    axes and rotated so that the smear lies in cross range, before and after autofocus, and rotated back.
    With --targets "0, 0; 40 m, -30 m, -6 dB; clutter -25 dB" there are two points in clutter, and one correction for
    both; levels are those of a pixel over a point of 0 dB. grid:5x5:40 is a grid about the scene centre, and a CSV
    file has the columns east [m], north [m], amplitude.

    FILE.cphd is the phase history for an image former of your own, as CPHD 1.1.0: the signal has the true ranges, its
    vectors have the measured places. No image is formed then. It needs the extra `formats`.
    """
    for name, suffixes in ((plot, (".png", ".svg", ".pdf")), (output, (".npz", ".cphd"))):
        if name is not None and os.path.splitext(name)[1].lower() not in suffixes:
            raise click.UsageError(f"{name}: the suffix must be one of {', '.join(suffixes)}")
    is_phase_history = output is not None and output.lower().endswith(".cphd")
    if is_phase_history and plot is not None:
        raise click.UsageError("--plot draws images, and none is formed for a .cphd file.")
    spare([mission], [plot, output])
    from bisar_budget.simulate.targets import Targets, parse_targets

    try:
        standing = Targets() if targets is None else parse_targets(targets)
    except ValueError as error:
        raise click.UsageError(f"--targets: {printable(str(error))}.") from None
    (loaded,) = load_all([mission], changes=changes)
    if is_phase_history:
        _export(mission, loaded, str(output), standing)
        return
    from bisar_budget.report.drawing import point_plot
    from bisar_budget.simulate.point import SimulationError, simulate_point

    try:
        with watched(FORMING) as progress:

            def foreseen(seconds: float) -> None:
                foretell(
                    seconds,
                    f"Forming the images of {printable(loaded.name)}",
                    "smaller errors, targets nearer to each other, no clutter and fewer collection.pulses take less"
                    + faster(),
                )

            images = simulate_point(loaded, progress, image_former=image_former, targets=standing, foreseen=foreseen)
    except (SimulationError, ValueError) as error:
        fail(f"{mission}: {error}")
    if output is not None:
        write_file(output, point_plot.archive(images, changes))
    if plot is not None:
        title = f"{loaded.name} {changes_words(changes)}".rstrip()
        write_file(plot, point_plot.drawn(images, title, os.path.splitext(plot)[1][1:].lower()))
    deliver(point_plot.summary(images, loaded))


def _export(mission: str, loaded: "Mission", output: str, standing: "Targets") -> None:
    """Write the phase history, and say what is in it."""
    from bisar_budget.formats.containers import MissingExtraError
    from bisar_budget.formats.exporting import export_phase_history
    from bisar_budget.simulate.point import SimulationError

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
