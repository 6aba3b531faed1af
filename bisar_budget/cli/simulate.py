"""`bisar-budget simulate`: the image of a point with the declared errors."""

import os

import click

from bisar_budget.cli.streams import FILE, fail, load_all, print_text, spare
from bisar_budget.cli.verify import progress_bar


@click.command()
@click.argument("mission", type=FILE)
@click.option(
    "--plot", type=FILE, metavar="FILE", help="Draw Figures 3 to 7 of the paper for this mission: .png, .svg or .pdf."
)
@click.option(
    "-o", "--output", type=FILE, metavar="FILE.npz", help="Save the images and what explains them for NumPy."
)
def simulate(mission: str, plot: str | None, output: str | None) -> None:
    """Form the image of a point with the declared errors.

    All errors of the file together, with its signs, are flown once: they may cancel, and the worst case is that
    of `check`. The data come from exact ranges; the image is formed where the errors move the point, in the scene's
    axes and rotated so that the smear lies in cross range, before and after phase gradient autofocus.
    """
    for name, suffixes in ((plot, (".png", ".svg", ".pdf")), (output, (".npz",))):
        if name is not None and os.path.splitext(name)[1].lower() not in suffixes:
            raise click.UsageError(f"{name}: the suffix must be one of {', '.join(suffixes)}")
    spare([mission], [plot, output])
    (loaded,) = load_all([mission])
    from bisar_budget.report import point_plot
    from bisar_budget.simulate.point import SimulationError, simulate_point

    try:
        with progress_bar() as bar:

            def progress(done: int, work: int) -> None:
                bar.length = work
                bar.update(done)

            images = simulate_point(loaded, progress)
    except (SimulationError, ValueError) as error:
        fail(f"{mission}: {error}")
    try:
        if output is not None:
            point_plot.save(images, output)
        if plot is not None:
            point_plot.draw(images, loaded.name, plot)
    except OSError as error:
        fail(f"cannot write {error.filename}: {error.strerror}")
    print_text(point_plot.summary(images, loaded))
