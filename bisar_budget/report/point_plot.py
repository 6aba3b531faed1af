"""Figures 3 to 7 of Rigling & Moses for a mission of one's own: range error, points, images, autofocus."""

from typing import Any

import numpy as np

from bisar_budget.budget.effects import PLATFORMS
from bisar_budget.mission.model import Mission
from bisar_budget.report.layout import wrapped
from bisar_budget.simulate.impulse_response import upsampled
from bisar_budget.simulate.phase_history import Complexes, Floats
from bisar_budget.simulate.point import PointImages

_FLOOR_DB = -35.0
_RESTORED_DB = 1.0  # below the error-free peak; a focused response is within a fraction of it
_FINE, _FINE_CUT = 4, 8  # interpolation, so that a mainlobe has a shape
_DRAWN_DB = -20.0  # what is above lies within the panels
_BESIDE = 6  # samples around it, two cells
_EQUAL = 8.0  # an image that is not longer for its width than this has equal scales


def draw(images: PointImages, title: str, path: str) -> None:
    """Draw the five figures on one sheet; the suffix of `path` says PNG, SVG or PDF."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(2, 3, figsize=(13, 8), layout="constrained")
    peak = float(np.abs(images.error_free).max())
    scene, turned = _places(images)
    shown = _levels(images.rotated, peak), _levels(images.focused, peak)
    along, across = _extent([*shown, _levels(images.error_free, peak)])
    _range_error(panels[0, 0], images)
    _points(panels[0, 1], images, scene[along, across])
    _image(panels[0, 2], shown[0][along, across], scene[along, across], "Fig. 5: image in (x, y)", ("x [m]", "y [m]"))
    for panel, level, name in (
        (panels[1, 0], shown[0], "Fig. 6: rotated to (x′, y′)"),
        (panels[1, 1], shown[1], "Fig. 7: after autofocus"),
    ):
        mesh = _image(panel, level[along, across], turned[along, across], name, ("x′ [m]", "y′ [m]"))
    bar = figure.colorbar(mesh, ax=[panels[0, 2], panels[1, 1]], shrink=0.6, pad=0.01)
    bar.set_label("dB to the error-free peak")
    _cuts(panels[1, 2], images, across)
    figure.suptitle(title)
    figure.savefig(path, dpi=110, metadata={"Software": None} if path.lower().endswith("png") else None)
    plt.close(figure)


def save(images: PointImages, path: str) -> None:
    """Save the images, complex, and what explains them, as an NPZ archive."""
    np.savez_compressed(
        path,
        in_scene=images.in_scene,
        rotated=images.rotated,
        focused=images.focused,
        error_free=images.error_free,
        spacing_m=images.spacing,
        scene_spacing_m=images.scene_spacing,
        look_azimuth_rad=images.look_azimuth,
        displacement_m=images.effect.displacement,
        slow_time_s=images.slow_time,
        range_error_m=images.range_error,
        points_m=images.points,
        grid_m=images.grid,
    )


def _flown(mission: Mission) -> str:
    factor = mission.allocation.coverage_factor
    times = f", {factor:g} times the file's values" if factor != 1 else ""
    errors = (getattr(mission.platforms, name).motion_error for name in PLATFORMS)
    likely = "; of a covariance its most probable one" if any(error.covariance for error in errors) else ""
    return (
        f"the declared ones together, with the signs of the file{times}{likely}. Some may cancel: the worst case is "
        "that of check"
    )


def summary(images: PointImages, mission: Mission) -> str:
    """Say in a few lines what the errors do to the point and what autofocus brings back."""
    clean = images.clean_response
    east, north = (round(float(moved), 3) for moved in images.effect.displacement)
    lines = [
        mission.name,
        "",
        *wrapped(f"errors         {_flown(mission)}", " " * 15),
        f"displacement   {east + 0.0:.3f} m east, {north + 0.0:.3f} m north",
        f"phase          quadratic {abs(images.effect.quadratic):.2f} rad, cubic {abs(images.effect.cubic):.2f} rad",
        "",
        f"{'':<14} {'peak':>9} {'width':>8} {'PSLR':>9} {'ISLR':>9}",
    ]
    for label, response in (
        ("without error", clean),
        ("with errors", images.response),
        ("autofocused", images.focused_response),
    ):
        peak = 20 * np.log10(response.peak / clean.peak)
        ratios = f"{response.pslr_db:>6.1f} dB {response.islr_db:>6.1f} dB"
        lines.append(f"{label:<14} {peak:>+6.2f} dB {response.irw_m:>6.3f} m {ratios}")
    if images.outside:
        lines += ["", *wrapped(images.outside, "")]
    left = 20 * np.log10(images.focused_response.peak / clean.peak)
    if left < -_RESTORED_DB:
        lines += [
            "",
            f"autofocus does not restore the response: its peak stays {-left:.1f} dB below the error-free one",
        ]
    return "\n".join(lines) + "\n"


def _places(images: PointImages) -> tuple[Floats, Floats]:
    """Ground places of the interpolated pixels, from the displaced point, (nx, ny, 2): in (x, y) and (x′, y′). [m]"""
    nx, ny = images.grid.shape[:2]
    ground = images.grid[..., :2] - np.asarray(images.effect.displacement)
    for axis, count in ((0, nx), (1, ny)):
        fine = np.arange(count * _FINE) / _FINE
        before = np.minimum(fine.astype(int), count - 2)
        weight = (fine - before).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        ground = np.take(ground, before, axis) * (1 - weight) + np.take(ground, before + 1, axis) * weight
    cosine, sine = np.cos(images.look_azimuth), np.sin(images.look_azimuth)
    turned = ground @ np.array([[cosine, -sine], [sine, cosine]])
    return ground, turned


def _levels(image: Complexes, peak: float) -> Floats:
    """Interpolated image over the error-free peak. [dB]"""
    fine = np.abs(upsampled(upsampled(image, _FINE).T, _FINE).T)
    level: Floats = 20 * np.log10(np.maximum(fine / peak, 1e-6))
    return level


def _extent(levels: list[Floats]) -> tuple[slice, slice]:
    """Part of the patch to draw: what any of the images has above a level, and its nearest sidelobes."""
    bright = np.maximum.reduce(levels) > _DRAWN_DB
    slices = []
    for axis in (0, 1):
        used = np.nonzero(bright.any(axis=1 - axis))[0]
        size, beside = bright.shape[axis], _BESIDE * _FINE
        slices.append(slice(max(0, int(used[0]) - beside), min(size, int(used[-1]) + beside + 1)))
    return slices[0], slices[1]


def _range_error(panel: Any, images: PointImages) -> None:
    panel.plot(images.slow_time, 1e3 * images.range_error, color="black", label="left at the displaced point")
    third = (images.segment_times[-1] - images.segment_times[0]) / 4
    for time, (value, slope) in zip(images.segment_times, images.segments, strict=True):
        ends = np.array([time - third, time + third])
        panel.plot(ends, 1e3 * (value + slope * (ends - time)), "--", color="#c1502e")
    panel.set(title="Fig. 3: range error, three segments", xlabel="slow time [s]", ylabel="range error [mm]")
    panel.grid(color="#dddddd", lw=0.5)


def _points(panel: Any, images: PointImages, places: Floats) -> None:
    panel.plot(*images.points.T, "o-", color="#c1502e")
    panel.set(title=f"Fig. 4: points of the segments, (29)\nby {images.points_by}", xlabel="x [m]", ylabel="y [m]")
    half = max(
        float(np.abs(images.points).max()) * 1.3, float(np.ptp(places[places.shape[0] // 2], axis=0).max()) / 2
    )
    panel.set(xlim=(-half, half), ylim=(-half, half), aspect="equal")
    panel.grid(color="#dddddd", lw=0.5)


def _image(panel: Any, level: Floats, places: Floats, title: str, labels: tuple[str, str]) -> Any:
    """Draw levels where their pixels lie, which follow lines of equal range."""
    mesh = panel.pcolormesh(
        places[..., 0],
        places[..., 1],
        level,
        vmin=_FLOOR_DB,
        vmax=0,
        cmap="magma",
        shading="gouraud",
        rasterized=True,
    )
    panel.set(title=title, xlabel=labels[0], ylabel=labels[1])
    low, high = places.min(axis=(0, 1)), places.max(axis=(0, 1))
    if 1 / _EQUAL < (high - low)[0] / (high - low)[1] < _EQUAL:
        middle, half = (low + high) / 2, (high - low).max() / 2
        panel.set(
            xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half), aspect="equal"
        )
    panel.set_facecolor("black")  # beside a patch that is narrower than the panel
    return mesh


def _cuts(panel: Any, images: PointImages, across: slice) -> None:
    peak = np.abs(images.error_free).max()
    count = images.error_free.shape[1]
    place = (np.arange(count * _FINE_CUT) / _FINE_CUT - count // 2) * images.spacing[1]
    for image, label, style in (
        (images.error_free, "without error", {"color": "#888888", "lw": 3}),
        (images.rotated, "with the declared errors", {"color": "#c1502e"}),
        (images.focused, "after autofocus", {"color": "#1f5fa8", "ls": "--"}),
    ):
        row = np.unravel_index(np.argmax(np.abs(image)), image.shape)[0]
        level = 20 * np.log10(np.maximum(np.abs(upsampled(image[row], _FINE_CUT)) / peak, 1e-6))
        panel.plot(place, level, label=label, **style)
    panel.set(xlabel="y′ [m]", ylabel="dB to the error-free peak", ylim=(-40, 2))
    first, last = across.start / _FINE - count // 2, (across.stop - 1) / _FINE - count // 2
    panel.set(xlim=(first * images.spacing[1], last * images.spacing[1]))
    panel.grid(color="#dddddd", lw=0.5)
    panel.set_title("Cross-range cuts", pad=46)
    panel.legend(fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)  # above the data
