"""Figures 3 to 7 of Rigling & Moses for a mission of one's own: range error, points, images, autofocus."""

from typing import Any

import numpy as np

from bisar_budget.budget.effects import PLATFORMS
from bisar_budget.mission.model import Mission
from bisar_budget.report.layout import wrapped
from bisar_budget.simulate.point import PointImages

_FLOOR_DB = -35.0
_RESTORED_DB = 1.0  # below the error-free peak; a focused response is within a fraction of it
_SHOWN = 0.6  # of the patch; the rest holds sidelobes


def draw(images: PointImages, title: str, path: str) -> None:
    """Draw the five figures on one sheet; the suffix of `path` says PNG, SVG or PDF."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(2, 3, figsize=(12, 7.6), layout="constrained")
    _range_error(panels[0, 0], images)
    _points(panels[0, 1], images)
    scene, turned = images.scene_spacing, images.spacing
    peak = float(np.abs(images.error_free).max())
    _image(panels[0, 2], images.in_scene, scene, peak, "Fig. 5: image in (x, y)", ("x [m]", "y [m]"))
    _image(panels[1, 0], images.rotated, turned, peak, "Fig. 6: rotated to (x′, y′)", ("x′ [m]", "y′ [m]"))
    _image(panels[1, 1], images.focused, turned, peak, "Fig. 7: after autofocus", ("x′ [m]", "y′ [m]"))
    _cuts(panels[1, 2], images)
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
    left = 20 * np.log10(images.focused_response.peak / clean.peak)
    if left < -_RESTORED_DB:
        lines += [
            "",
            f"autofocus does not restore the response: its peak stays {-left:.1f} dB below the error-free one",
        ]
    return "\n".join(lines) + "\n"


def _range_error(panel: Any, images: PointImages) -> None:
    panel.plot(images.slow_time, 1e3 * images.range_error, color="black", label="left at the displaced point")
    third = (images.segment_times[-1] - images.segment_times[0]) / 4
    for time, (value, slope) in zip(images.segment_times, images.segments, strict=True):
        ends = np.array([time - third, time + third])
        panel.plot(ends, 1e3 * (value + slope * (ends - time)), "--", color="#c1502e")
    panel.set(title="Fig. 3: range error, three segments", xlabel="slow time [s]", ylabel="range error [mm]")


def _points(panel: Any, images: PointImages) -> None:
    panel.plot(*images.points.T, "o-", color="#c1502e")
    panel.set(title="Fig. 4: points of the segments, (29)", xlabel="x [m]", ylabel="y [m]")
    shown = _SHOWN * images.in_scene.shape[0] / 2 * images.scene_spacing[0]
    panel.set(xlim=(-shown, shown), ylim=(-shown, shown), aspect="equal")
    panel.grid(color="#dddddd", lw=0.5)


def _image(
    panel: Any, image: np.ndarray, spacing: tuple[float, float], peak: float, title: str, labels: tuple[str, str]
) -> None:
    x, y = (count / 2 * step for count, step in zip(image.shape, spacing, strict=True))
    with np.errstate(divide="ignore"):
        level = 20 * np.log10(np.abs(image) / peak)
    extent = (-x, x, -y, y)
    shown = panel.imshow(level.T, origin="lower", extent=extent, vmin=_FLOOR_DB, vmax=0, cmap="magma")
    half = _SHOWN * max(x, y)
    panel.set(title=title, xlabel=labels[0], ylabel=labels[1], xlim=(-half, half), ylim=(-half, half))
    panel.set_facecolor("black")  # beside a patch that is narrower than the panel
    panel.figure.colorbar(shown, ax=panel, label="dB to the error-free peak", shrink=0.8)


def _cuts(panel: Any, images: PointImages) -> None:
    count = images.error_free.shape[1]
    place = (np.arange(count) - count // 2) * images.spacing[1]
    peak = np.abs(images.error_free).max()
    for image, label, style in (
        (images.error_free, "without error", {"color": "#888888", "lw": 3}),
        (images.rotated, "with the declared errors", {"color": "#c1502e"}),
        (images.focused, "after autofocus", {"color": "#1f5fa8", "ls": "--"}),
    ):
        row = np.unravel_index(np.argmax(np.abs(image)), image.shape)[0]
        panel.plot(place, 20 * np.log10(np.abs(image[row]) / peak + 1e-6), label=label, **style)
    panel.set(title="Cross-range cuts", xlabel="y′ [m]", ylabel="dB", ylim=(-40, 2))
    shown = _SHOWN * count / 2 * images.spacing[1]
    panel.set(xlim=(-shown, shown))
    panel.legend(fontsize=7, loc="upper right")
