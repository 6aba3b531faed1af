"""Images of exported data by three processors, side by side: bisar-budget, NumPy over sarkit, FastSAR.

python -m tests.outside.side_by_side images.png
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib as mpl
import numpy as np

mpl.use("agg")

from matplotlib import pyplot as plt

import bisar_budget as bb
from bisar_budget.formats.exporting import export_phase_history
from bisar_budget.simulator.targets import Targets
from tests.conftest import ROOT
from tests.outside.focus import Collection
from tests.outside.test_processors import backprojected

SHOWN = {
    "rigling_moses_section_v": "Section V of the paper: 4.6 rad of quadratic phase",
    "uav_pair_l_band": "Two drones over an aperture of half a radian: 13.7 rad",
}
FLOOR_DB = -40.0
CELLS = (6, 14)  # shown about the middle, half of the picture along range and cross range


def draw(path: str | Path) -> None:
    """Draw the examples: three images, and their lines through the middle of the patch in one panel."""
    page = plt.figure(figsize=(13, 7), layout="constrained")
    for band, (name, title) in zip(page.subfigures(len(SHOWN)), SHOWN.items(), strict=True):
        band.suptitle(title, fontsize=11)
        row = band.subplots(1, 4)
        mission = bb.load(ROOT / "specs" / "missions" / f"{name}.yaml")
        images = bb.simulate(mission).images
        with TemporaryDirectory() as folder:
            file = Path(folder, "data.cphd")
            file.write_bytes(export_phase_history(mission, Targets()).data)
            collection = Collection(file)
        middle = tuple(count // 2 for count in images.rotated.shape)
        part = tuple(slice(at - 3 * cells, at + 3 * cells + 1) for at, cells in zip(middle, CELLS, strict=True))
        points = images.grid[part][..., :2]
        found = {
            "bisar-budget": images.rotated[part],
            "NumPy over sarkit": collection.image(points),
            "FastSAR, bistatic": backprojected(collection, points),
        }
        across = np.arange(-3 * CELLS[1], 3 * CELLS[1] + 1) * images.spacing[1]
        nearer = np.arange(-3 * CELLS[0], 3 * CELLS[0] + 1) * images.spacing[0]
        line, styles = int(np.argmax(np.abs(images.rotated[part]).max(axis=1))), ("-", "--", ":")
        for panel, (who, image), style in zip(row, found.items(), styles, strict=False):
            level = 20 * np.log10(np.maximum(np.abs(image), 1e-9))
            shown = panel.pcolormesh(across, nearer, level, cmap="gray", vmin=FLOOR_DB, vmax=0, shading="nearest")
            panel.set_title(who, fontsize=10)
            panel.set_xlabel("along equal range [m]")
            row[3].plot(across, level[line], style, label=who, lw=1.2 + (style != "-"))
        row[0].set_ylabel("nearer [m]")
        band.colorbar(shown, ax=row[2], label="dB to a perfect point")
        row[3].set(ylim=(FLOOR_DB, 0), xlabel="along equal range [m]", ylabel="dB", title="brightest line")
        row[3].title.set_fontsize(10)
        row[3].legend(fontsize=7, loc="lower center")
    page.savefig(path, dpi=110)
    plt.close(page)


if __name__ == "__main__":
    draw(sys.argv[1])
