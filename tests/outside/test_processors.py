"""Processors of others on exported data: FastSAR forms the image, perseo-quality measures it.

FastSAR has two entry points. Its `backproject` takes the positions of transmitter and receiver. It is bistatic, and
shows a point at the position that bisar-budget gives. Its reader of files, `form_cphd`, assumes a single antenna in
the middle of both platforms. It is monostatic: sufficient for platforms near each other, while it misplaces and blurs
a wide bistatic scene. The image formers of bisar-budget and of these tests always use both positions.
"""

import math
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

pytest.importorskip("fastsar")
pytest.importorskip("sarpy")  # FastSAR's reader of files
pytest.importorskip("perseo_quality")

import fastsar

import bisar_budget as bb
from bisar_budget.formats.exporting import export_phase_history
from bisar_budget.simulator.impulse_response import impulse_response, line_at
from bisar_budget.simulator.point import PointImages
from bisar_budget.simulator.targets import Targets
from tests.conftest import ROOT
from tests.outside.focus import Collection
from tests.outside.record import compare
from tests.simulate.conftest import only_rotated_images

pytestmark = [
    pytest.mark.extras,
    pytest.mark.filterwarnings("ignore"),  # theirs
]

FASTSAR, PERSEO = "FastSAR", "perseo-quality"
VERSIONS = {FASTSAR: version("fastsar"), PERSEO: version("perseo-quality")}
BISTATIC = ("rigling_moses_section_v", "drones_same_gnss", "tandem_l", "holdover_roof_receiver", "uav_stim300")
FINE = 24  # pixels of a resolution cell: perseo-quality takes samples as they are
HALF = 12  # cells on either side of the peak: its ISLR counts to ten widths


class Formed(NamedTuple):
    """What `simulate` shows of an example, and what its exported file holds."""

    images: PointImages
    file: Collection
    path: Path


@pytest.fixture(scope="module")
def formed(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("cphd")

    @cache
    def of(name: str) -> Formed:
        mission = bb.load(ROOT / "specs" / "missions" / f"{name}.yaml")
        path = folder / f"{name}.cphd"
        path.write_bytes(export_phase_history(mission, Targets()).data)
        with only_rotated_images():
            return Formed(bb.simulate(mission).images, Collection(path), path)

    return of


def backprojected(file: Collection, points: np.ndarray) -> np.ndarray:
    """FastSAR's bistatic image of points (..., 2) of the scene, 1 for a perfect point."""
    first, second = file.frequency[0, :2]
    weighted = file.signal * file.over_band * file.over_time[:, None]
    image = fastsar.backproject(
        weighted.astype(np.complex64),
        file.transmitter,
        float(first),
        float(second - first),
        np.concatenate((points, np.zeros((*points.shape[:-1], 1))), axis=-1),
        rcv=file.receiver,
        upsample=16,
        window=False,
        backend="cpu",
    )
    return np.asarray(image)


def chip(formed: Formed) -> tuple[np.ndarray, np.ndarray]:
    """FastSAR's image about the point, fine enough to be measured, and where it is brightest, (2,) [m]."""
    place = np.array(formed.images.effect.displacement)
    nearer, along = formed.file.steps(place)
    cells = np.arange(-HALF * FINE, HALF * FINE + 1) / FINE
    # Rows follow the line of equal range: over a dozen cells of 14 m it bends by a range cell.
    points = formed.file.line(place, cells) + np.multiply.outer(cells, nearer)[:, None]
    image = backprojected(formed.file, points)
    power = np.abs(image) ** 2
    i, j = np.unravel_index(np.argmax(power), power.shape)
    across = [power[i - 1 : i + 2, j], power[i, j - 1 : j + 2]]
    tops = [(a - c) / (2 * (a - 2 * b + c)) for a, b, c in across]  # of the parabola through three pixels
    return image, points[i, j] + np.array(tops) / FINE @ np.stack((nearer, along))


@pytest.fixture(scope="module")
def chips(formed: Any) -> Any:
    return cache(lambda name: chip(formed(name)))


@pytest.mark.parametrize("name", BISTATIC)
def test_images_are_those_of_fastsar(formed: Any, name: str) -> None:
    """Pixel by pixel: FastSAR reads range profiles by straight lines, at 16 samples per cell, to 0.5 %."""
    one = formed(name)
    points = one.images.grid[..., :2]
    here = np.abs(one.images.rotated)
    theirs = np.abs(backprojected(one.file, points))
    what = f"{name}, image: largest difference of {here.size} pixels to its own brightest"
    compare(what, 0, np.abs(theirs - here).max() / here.max(), "", 5e-3, FASTSAR, VERSIONS[FASTSAR])


@pytest.mark.parametrize("name", BISTATIC)
def test_fastsar_shows_the_point_where_check_puts_it(formed: Any, chips: Any, name: str) -> None:
    """To 0.5 % of a cell; the loss of the brightest to 0.1 dB."""
    one = formed(name)
    image, place = chips(name)
    effect = one.images.effect
    loss = -20 * math.log10(np.abs(image).max())
    here = -20 * math.log10(one.images.response.peak)
    compare(f"{name}: loss of the peak", loss, here, "dB", 0.1, FASTSAR, VERSIONS[FASTSAR])
    if abs(effect.quadratic) < 1:  # more has no peak in its middle
        moved, off = math.hypot(*effect.displacement), float(np.hypot(*(place - effect.displacement)))
        tolerance = max(1e-3, 5e-3 * one.file.resolution(place))
        compare(f"{name}: displacement", moved + off, moved, "m", tolerance, FASTSAR, VERSIONS[FASTSAR])


@pytest.mark.parametrize("name", BISTATIC[1:])
def test_perseo_measures_what_simulate_does(formed: Any, chips: Any, name: str) -> None:
    """In FastSAR's image: it counts sidelobes to 5 widths (PSLR) and 10 (ISLR), beyond the minima that it finds."""
    from perseo_quality.core.generic_dataclasses import MaskingMethod
    from perseo_quality.core.signal_processing import evaluate_irf_resolution
    from perseo_quality.point_targets_analysis.core import irf

    one = formed(name)
    image, _ = chips(name)
    row, column = np.unravel_index(np.argmax(np.abs(image)), image.shape)
    widths = evaluate_irf_resolution(image[:, column]), evaluate_irf_resolution(image[row])
    _, pslr, _ = irf.compute_pslr_2d(image, widths, MaskingMethod.PEAK)
    _, islr, _ = irf.compute_islr_2d(image, widths, MaskingMethod.PEAK)
    line = line_at(one.images.rotated, one.images.rows[1])
    line = np.roll(line, line.size // 2 - int(np.argmax(np.abs(line))))
    spacing = one.images.spacing[1]
    here = impulse_response(line, spacing)
    near, far = (impulse_response(line, spacing, reach_m=n * here.irw_m) for n in (5, 10))
    cell = one.file.resolution(np.array(one.images.effect.displacement))
    width = float(widths[1]) / FINE * cell
    source = f"{PERSEO}, on FastSAR's image"
    compare(f"{name}: width", width, here.irw_m, "m", 5e-3 * here.irw_m, source, VERSIONS[PERSEO])
    compare(f"{name}: PSLR within 5 widths", pslr, near.pslr_db, "dB", 0.1, source, VERSIONS[PERSEO])
    compare(f"{name}: ISLR within 10 widths", islr, far.islr_db, "dB", 0.1, source, VERSIONS[PERSEO])


MONOSTATIC = "FastSAR's reader of files puts one antenna at the middle of both platforms, {:.3g} km apart"


@pytest.mark.parametrize(
    ("name", "is_near"), [("tandem_x_synchronized", True), ("tandem_l", False), ("rigling_moses_section_v", False)]
)
def test_files_read_by_fastsar(formed: Any, name: str, is_near: bool) -> None:
    """`form_cphd`: satellites 300 m apart it takes for one; of a wide scene it misplaces and blurs the point.

    It weighs band and aperture by Taylor's window, by whose mean squares its peak is divided.
    """
    one = formed(name)
    cell = one.file.resolution(np.zeros(2))
    found = fastsar.form_cphd(
        str(one.path), backend="cpu", mode="spotlight", spacing=(cell / 8, cell / 8), extent=(140 * cell, 140 * cell)
    )
    image = np.abs(found["image"])
    i, j = np.unravel_index(np.argmax(image), image.shape)
    local = found["origin"] + i * found["spx"] * found["e1"] + j * found["spy"] * found["e2"]
    place = (local @ np.array(found["meta"]["R"])) @ one.file.axes.T
    apart = float(np.linalg.norm(one.file.transmitter - one.file.receiver, axis=1).mean())
    reason = "" if is_near else MONOSTATIC.format(apart / 1e3)
    effect = one.images.effect
    moved, off = math.hypot(*effect.displacement), float(np.hypot(*(place[:2] - effect.displacement)))
    compare(
        f"{name}, `form_cphd`: displacement", moved + off, moved, "m", cell / 8, FASTSAR, VERSIONS[FASTSAR], reason
    )
    loss = -20 * math.log10(float(image.max()) / one.file.signal.size)
    here = -20 * math.log10(one.images.response.peak)
    compare(f"{name}, `form_cphd`: loss of the peak", loss, here, "dB", 0.1, FASTSAR, VERSIONS[FASTSAR], reason)
