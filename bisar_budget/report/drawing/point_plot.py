"""Figures 3 to 7 of Rigling & Moses for a mission of one's own: their numbers, drawn, saved, and said in a few lines.

All places are in the axes of the scene, (x, y) east and north of its centre, or in the axes (x′, y′) of (10), turned
about the same centre: a response stands where the errors put it, not at the middle of a patch.
"""

import math
from collections.abc import Callable, Sequence
from io import BytesIO
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.faults import SetValue, changes_words, printable
from bisar_budget.mission.model import Mission, Simulation, has_instruments
from bisar_budget.report.drawing.evidence_drawings import FOCUSED, WITH_ERRORS, WITHOUT_ERROR, Curve, cut_panel
from bisar_budget.report.drawing.figure import drawing_file, figure_file, new_figure, paint
from bisar_budget.report.drawing.svg import Canvas
from bisar_budget.report.words.sentences import wrapped
from bisar_budget.simulator.impulse_response import ImpulseResponse, between, line_at, resampled, upsampled
from bisar_budget.simulator.phase_history import Complexes, Floats
from bisar_budget.simulator.point import PointImages
from bisar_budget.simulator.realisations import has_unset_clocks

FLOOR_DB = -35.0
_FINE, _FINE_CUT = 4, 8  # interpolation, at most, so that a mainlobe has a shape
_PIXELS = 3e5  # of a picture, about
_DRAWN_DB = -20.0  # what is above lies within the pictures
_BESIDE = 6  # pixels around it, two cells
_NEAR = 1.0  # times a picture's larger side: a true place that far away is still shown
_READ_DB = 0.05  # of an error-free peak; where pixels sample it, it is read to 1e-4 dB
_RESTORED_DB = 1.0  # below the error-free peak; a focused response is within a fraction of it
_EQUAL = 8.0  # an image that is not longer for its width than this has equal scales
_MARKED, _GRID = "#c1502e", "#dddddd"  # of lines that approximate or mark, of a grid
_NOT_FORMED = "#3a3a3a"  # beside a patch that is narrower than the panel
_TRUE, _AT, _PEAK = "#5fd3f3", "#7CFC9A", "#f5f0a0"
_APART = 2  # pixels across: (25) is then beside the peak
_CUT_SIZE = (300.0, 170.0)  # px of the drawing of the cuts, of its frame

Limits = tuple[float, float, float, float]


class ImagePanel(NamedTuple):
    """An image in dB over the error-free peak, on pixels given by their corners.

    `level_db` is (nx, ny), x or x′ along its first axis, NaN where no image was formed; `corners`
    (nx + 1, ny + 1, 2) are the corners of those pixels. `true_places` (n, 2) is where the targets stand,
    `shown_places` (n, 2) where (25) puts them, `image_points` (n, 2) where they peak, none where (25) says the same;
    `points` (n, 3, 2) where (29) puts the pieces of the aperture. All places are in `axes`. [m]
    """

    title: str
    axes: tuple[str, str]
    level_db: Floats
    corners: Floats
    true_places: Floats
    shown_places: Floats
    image_points: Floats
    points: Floats

    @property
    def extent(self) -> Limits:
        """Left, right, bottom and top of the outermost pixel edges. [m]"""
        low, high = self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))
        return float(low[0]), float(high[0]), float(low[1]), float(high[1])

    @property
    def limits(self) -> Limits:
        """Limits of the axes: they hold the picture, and the true places where they are near. [m]"""
        left, right, bottom, top = self.extent
        near = _NEAR * max(right - left, top - bottom)
        x, y = self.true_places.T
        is_near = (x > left - near) & (x < right + near) & (y > bottom - near) & (y < top + near)
        margin = 0.05 * near
        for east, north in self.true_places[is_near]:
            left, right = min(left, float(east) - margin), max(right, float(east) + margin)
            bottom, top = min(bottom, float(north) - margin), max(top, float(north) + margin)
        return left, right, bottom, top


class Sheet(NamedTuple):
    """All that is drawn.

    `segments` (3, 2, 2) are the ends of the three pieces of the range error, time [s] and range error [mm], each as
    long as a third of the aperture; `points` (3, 2) what (29) makes of them for a point at the scene centre [m],
    `points_by` by which gradients.
    """

    slow_time: Floats
    range_error_mm: Floats
    segments: Floats
    points: Floats
    points_by: str
    in_scene: ImagePanel
    rotated: ImagePanel
    focused: ImagePanel
    rotated_back: ImagePanel
    cuts: tuple[Curve, ...]


def sheet(images: PointImages) -> Sheet:
    """Lay out what is drawn of some images."""
    peak = float(np.abs(images.error_free).max())
    cosine, sine = math.cos(images.look_azimuth), math.sin(images.look_azimuth)
    turn = np.array([[cosine, -sine], [sine, cosine]])  # (10), from the right
    true = np.array([[one.east, one.north] for one in images.targets.points])
    middle = len(images.points) // 2
    by_25 = images.points[middle] - np.asarray(images.effect.displacement)  # against exact ranges
    is_elsewhere = float(np.hypot(*by_25)) > _APART * images.spacing[1]
    shown = np.array([one.shown for one in images.responses])
    shown_in_scene = np.array([one.shown_in_scene for one in images.responses])
    back = rotated_back(images)
    how = images.image_former.replace("_", " ")
    in_scene_how = "backprojection" if images.image_former == "polar_format" else how
    scene_crop = _bright([images.in_scene, back], peak, images.scene_spacing)
    crop = _bright([images.rotated, images.focused, images.error_free], peak, images.spacing)

    def picture(title: str, image: Complexes, grid: Floats, part: tuple[slice, slice], at: Floats) -> ImagePanel:
        level, corners = _interpolated(image, grid[..., :2], part, peak)
        points = (at + by_25)[:, None] + images.points - images.points[middle]
        peaks = at if is_elsewhere else at[:0]
        return ImagePanel(title, ("x [m]", "y [m]"), level, corners, true, at + by_25, peaks, points)

    def turned(title: str, image: Complexes) -> ImagePanel:
        flat = picture(title, image, images.grid, crop, shown)
        axes = ("x′ [m]", "y′ [m]")
        return ImagePanel(title, axes, flat.level_db, *(one @ turn for one in flat[3:]))

    return Sheet(
        slow_time=images.slow_time,
        range_error_mm=1e3 * images.range_error,
        segments=_segments_of(images),
        points=images.points,
        points_by=images.points_by,
        in_scene=picture(
            f"Fig. 5: in (x, y), {in_scene_how}", images.in_scene, images.scene_grid, scene_crop, shown_in_scene
        ),
        rotated=turned(f"Fig. 6: in (x′, y′), {how}", images.rotated),
        focused=turned("Fig. 7: after autofocus", images.focused),
        rotated_back=picture("Fig. 7 rotated back to (x, y)", back, images.scene_grid, scene_crop, shown),
        cuts=_cuts_of(images, images.grid[..., :2] @ turn, crop, peak),
    )


def rotated_back(images: PointImages) -> Complexes:
    """Focused image on the pixels of the one along (x, y): what completes image formation in the paper."""
    return resampled(images.focused, images.grid, images.scene_grid)


def _segments_of(images: PointImages) -> Floats:
    times = images.segment_times
    half = (times[1] - times[0]) / 2
    ends = np.stack((times - half, times + half), axis=1)
    value, slope = images.segments[:, :1], images.segments[:, 1:]
    return np.stack((ends, 1e3 * (value + slope * (ends - times[:, None]))), axis=-1)


def _bright(images: list[Complexes], peak: float, spacing: tuple[float, float]) -> tuple[slice, slice]:
    """Part of a patch to draw: what any image has above a level, its nearest sidelobes, and as far the other way."""
    bright = np.maximum.reduce([np.abs(image) for image in images]) > peak * 10 ** (_DRAWN_DB / 20)
    used = [np.nonzero(bright.any(axis=1 - axis))[0] for axis in (0, 1)]
    ends = [(int(one[0]) - _BESIDE, int(one[-1]) + _BESIDE + 1) if one.size else (0, 1 << 30) for one in used]
    longest = max((last - first) * step for (first, last), step in zip(ends, spacing, strict=True))
    slices = []
    for (first, last), step, size in zip(ends, spacing, bright.shape, strict=True):
        more = max(0, round((longest / step - (last - first)) / 2))
        slices.append(slice(max(0, first - more), min(size, last + more)))
    return slices[0], slices[1]


def _interpolated(image: Complexes, grid: Floats, part: tuple[slice, slice], peak: float) -> tuple[Floats, Floats]:
    """Interpolated part of an image [dB], and the corners of its pixels [m]."""
    rows, columns = part
    shape = (rows.stop - rows.start, columns.stop - columns.start)
    factor = max(1, min(_FINE, math.isqrt(int(_PIXELS / (shape[0] * shape[1])))))
    fine = upsampled(image.T, factor).T[rows.start * factor : rows.stop * factor]
    fine = upsampled(fine, factor)[:, columns.start * factor : columns.stop * factor]
    # Sample k of the interpolation lies at k/factor, its edges half a step on either side.
    row, column = (
        one.start + (np.arange(count * factor + 1) - 0.5) / factor for one, count in zip(part, shape, strict=True)
    )
    i, j = (one.ravel() for one in np.meshgrid(row, column, indexing="ij"))
    corners = between(grid, i, j).reshape(row.size, column.size, 2)
    is_missing = np.repeat(np.repeat(image[part] == 0, factor, axis=0), factor, axis=1)
    return np.where(is_missing, math.nan, _decibels(fine, peak)), corners


def _decibels(samples: Complexes, peak: float) -> Floats:
    level: Floats = 20 * np.log10(np.maximum(np.abs(samples) / peak, 1e-6))
    return level


def _cuts_of(images: PointImages, turned: Floats, part: tuple[slice, slice], peak: float) -> tuple[Curve, ...]:
    """Lines through the peaks, over y′."""
    columns = np.arange(part[1].start * _FINE_CUT, (part[1].stop - 1) * _FINE_CUT + 1)
    cuts = []
    shown = (
        (images.error_free, "without error", WITHOUT_ERROR),
        (images.rotated, "with the declared errors", WITH_ERRORS),
        (images.focused, "after autofocus", FOCUSED),
    )
    for row, (image, name, style) in zip(images.rows, shown, strict=True):
        line = line_at(image, row)
        place = between(turned, np.full(columns.size, row), columns / _FINE_CUT)[:, 1]
        level = _decibels(upsampled(line, _FINE_CUT)[columns], peak)
        cuts.append(Curve(name, place.tolist(), level.tolist(), style))
    return tuple(cuts)


# ---------------------------------------------------------------------- drawn
def drawn(images: PointImages, title: str, kind: str) -> bytes:
    """Draw the figures on one sheet, as a `png`, `svg` or `pdf` file."""
    return figure_file(figure(sheet(images), title), kind)


def figure(drawn: Sheet, title: str) -> Any:
    """Lay all panels on one Matplotlib figure."""
    page = new_figure(figsize=(16.5, 8))
    panels = page.subplots(2, 4)
    for name, panel in zip(("fig3", "fig4", "fig5", "cuts", "fig6", "fig7", "fig7_back"), panels.flat, strict=False):
        artist = PANELS[name](panel, drawn)
    key = panels[1, 3]
    key.axis("off")
    bar = page.colorbar(artist, ax=key, orientation="horizontal", location="bottom", fraction=0.5, pad=0.02)
    bar.set_label("dB to the error-free peak")
    styles = [
        (_stands(_TRUE), "where the target stands"),
        (_put(_AT), "where (25) puts it"),
        ({"ls": "none", "marker": "o", "color": _MARKED, "ms": 5}, "points of (29)"),
    ]
    if drawn.in_scene.image_points.size:
        styles.append((_peaks(_PEAK), "where the image peaks"))
    marks = [key.plot([], [], label=label, **style)[0] for style, label in styles]
    key.legend(handles=marks, loc="lower center", facecolor=_NOT_FORMED, labelcolor="white", fontsize=10)
    page.suptitle(printable(title), parse_math=False)  # a name is no formula
    return page


def drawn_panel(name: str, drawn: Sheet) -> bytes:
    """Draw a single panel, small, for a page, as a PNG file; `name` is one of `PANELS`."""
    if name == "cuts":
        return drawing_file(_cuts_drawing(drawn), "png", dpi=112)
    page = new_figure(figsize=(4.4, 3.6))
    panel = page.subplots()
    artist = PANELS[name](panel, drawn)
    if artist is not None:
        page.colorbar(artist, ax=panel, pad=0.02).set_label("dB to the error-free peak")
    return figure_file(page, "png", dpi=80)


def archive(images: PointImages, changes: Sequence[SetValue] = ()) -> bytes:
    """Give the images, complex, and what explains them, as an NPZ file.

    `changes` are the options that changed the mission; the file has them as texts `KEY=VALUE` (n,).
    """
    file = BytesIO()
    np.savez_compressed(
        file,
        in_scene=images.in_scene,
        rotated=images.rotated,
        focused=images.focused,
        rotated_back=rotated_back(images),
        error_free=images.error_free,
        spacing_m=images.spacing,
        scene_spacing_m=images.scene_spacing,
        look_azimuth_rad=images.look_azimuth,
        displacement_m=images.effect.displacement,
        slow_time_s=images.slow_time,
        range_error_m=images.range_error,
        points_m=images.points,
        grid_m=images.grid,
        scene_grid_m=images.scene_grid,
        image_former=images.image_former,
        targets_m=[[one.east, one.north] for one in images.targets.points],
        targets_db=[one.level_db for one in images.targets.points],
        shown_m=[one.shown for one in images.responses],
        set=np.array([f"{change.key}={change.text}" for change in changes], dtype=str),
    )
    return file.getvalue()


def _flown(mission: Mission) -> str:
    factor = mission.allocation.coverage_factor
    times = f", {factor:g} times the file's values" if factor != 1 else ""
    errors = (getattr(mission.platforms, name).motion_error for name in PLATFORMS)
    likely = "; of a covariance its most probable one" if any(error.covariance for error in errors) else ""
    seed = (mission.simulation or Simulation()).seed
    drawn = f"; of sensors and clocks one time series each, seed {seed}" if has_instruments(mission) else ""
    if mission.propagation is not None:
        drawn += f"; of delays in the air one draw each, seed {seed}, of those that change a time series"
    if any(platform.oscillator and platform.oscillator.spurs for platform in mission.platforms):
        drawn += "; spurs are left out, but for what exchanges fold below one cycle per aperture"
    if has_instruments(mission) and has_unset_clocks(mission):
        drawn += "; of oscillators without mean and slope, since the file does not say how they are set"
    return (
        f"the declared ones together, with the signs of the file{times}{likely}{drawn}. Some may cancel: the worst "
        "case is that of check"
    )


def summary(images: PointImages, mission: Mission) -> str:
    """Say in a few lines what the errors do to the targets and what autofocus brings back."""
    clean = images.clean_response
    east, north = (round(float(moved), 3) for moved in images.effect.displacement)
    is_point = len(images.responses) == 1 and images.targets.clutter_db is None
    lines = [
        mission.name,
        *(wrapped(f"  {changes_words(mission.changes)}", "    ") if mission.changes else ()),
        "",
        *wrapped(f"errors         {_flown(mission)}", " " * 15),
        f"displacement   {east + 0.0:.3f} m east, {north + 0.0:.3f} m north",
        f"phase          quadratic {abs(images.effect.quadratic):.2f} rad, cubic {abs(images.effect.cubic):.2f} rad",
    ]
    if images.image_former != "backprojection":
        lines += wrapped(f"image former   {_formed_by(images)}", " " * 15)
    if images.targets.clutter_db is not None:
        lines.append(f"clutter        {images.targets.clutter_db:g} dB per pixel")
    lines += ["", *(_of_the_point(images) if is_point else _of_targets(images))]
    if images.outside:
        lines += ["", *wrapped(images.outside, "")]
    off = images.misread_db
    if abs(off) > _READ_DB:
        said = (
            f"peaks, widths and sidelobes are in doubt: the error-free response is read {abs(off):.1g} dB too "
            f"{'high' if off > 0 else 'low'}, since lines of equal range and of equal Doppler run together beside it"
        )
        lines += ["", *wrapped(said, "")]
    left = 20 * np.log10(images.focused_response.peak / clean.peak)
    if left < -_RESTORED_DB:
        said = f"autofocus does not restore the response: its peak stays {-left:.1f} dB below the error-free one"
        lines += ["", *wrapped(said, "")]
    return "\n".join(lines) + "\n"


def _formed_by(images: PointImages) -> str:
    words = {
        "polar_format": "polar format (14) in (x′, y′), backprojection in (x, y)",
        "matched_filter": "matched filter (4)",
        "far_field": "far-field filter (12)",
    }[images.image_former]
    response = images.responses[0]
    exact = np.array([response.target.east, response.target.north]) + response.effect.displacement
    off = float(np.hypot(*(np.asarray(response.shown) - exact)))
    plane = f"; plane waves put the response {off:.2g} m from where exact ranges do" if off else ""
    return words + plane


def _of_the_point(images: PointImages) -> list[str]:
    lines = [f"{'':<14} {'peak':>9} {'width':>8} {'PSLR':>9} {'ISLR':>9}"]
    for label, response in (
        ("without error", images.clean_response),
        ("with errors", images.response),
        ("autofocused", images.focused_response),
    ):
        peak = 20 * math.log10(response.peak / images.clean_response.peak)
        ratios = f"{response.pslr_db:>6.1f} dB {response.islr_db:>6.1f} dB"
        lines.append(f"{label:<14} {peak:>+6.2f} dB {response.irw_m:>6.3f} m {ratios}")
    return lines


def _of_targets(images: PointImages) -> list[str]:
    """One line for each target; peaks are over its own without error, and widths in its own cut."""
    lines = [
        f"{'target [m]':>17} {'level':>7} {'moved by [m]':>15} {'phase':>8} {'with errors':>14} {'autofocused':>14}",
        f"{'east':>8} {'north':>8} {'[dB]':>7} {'east':>7} {'north':>7} {'[rad]':>8} "
        f"{'[dB]':>7} {'[m]':>6} {'[dB]':>7} {'[m]':>6}",
    ]
    for one in images.responses:
        moved = np.round(one.effect.displacement, 3) + 0.0
        lines.append(
            f"{one.target.east:>8.6g} {one.target.north:>8.6g} {one.target.level_db:>7.4g} "
            f"{moved[0]:>7.3f} {moved[1]:>7.3f} {one.effect.quadratic:>+8.3f} "
            f"{_peak_and_width(one.smeared, one.clean)} {_peak_and_width(one.focused, one.clean)}"
        )
    return lines


def _peak_and_width(response: ImpulseResponse | None, clean: ImpulseResponse | None) -> str:
    if response is None or clean is None:
        return f"{'-':>7} {'-':>6}"
    return f"{20 * math.log10(response.peak / clean.peak):>+7.2f} {response.irw_m:>6.3f}"


def _range_error(panel: Any, drawn: Sheet) -> None:
    panel.plot(drawn.slow_time, drawn.range_error_mm, color="black")
    for segment in drawn.segments:
        panel.plot(*segment.T, "--", color=_MARKED)
    panel.set(title="Fig. 3: range error, three segments", xlabel="slow time [s]", ylabel="range error [mm]")
    panel.grid(color=_GRID, lw=0.5)


def _points(panel: Any, drawn: Sheet) -> None:
    panel.plot(*drawn.points.T, "o-", color=_MARKED, zorder=3)
    panel.plot(0, 0, **_stands("#1b7fa3"))
    panel.plot(*drawn.points[1], **_put("#2a8f4f"))
    panel.set(title=f"Fig. 4: points of the segments, (29)\nby {drawn.points_by}", xlabel="x [m]", ylabel="y [m]")
    span = float(np.ptp(drawn.points, axis=0).max()) or 1.0
    low, high = drawn.points.min(axis=0), drawn.points.max(axis=0)
    if float(np.hypot(*drawn.points[1])) < 10 * span:  # else the three would be one
        low, high = np.minimum(low, 0), np.maximum(high, 0)
    else:
        _point_to(panel, np.zeros(2), (low + high) / 2, "black")
    half = 0.65 * max(float((high - low).max()), span)
    (x, y) = (low + high) / 2
    panel.set(xlim=(x - half, x + half), ylim=(y - half, y + half), aspect="equal")
    panel.grid(color=_GRID, lw=0.5)


def _image(panel: Any, picture: ImagePanel, *, with_points: bool = False) -> Any:
    """Draw each pixel between its own corners, which follow lines of equal range."""
    mesh = panel.pcolormesh(
        picture.corners[..., 0],
        picture.corners[..., 1],
        picture.level_db,
        vmin=FLOOR_DB,
        vmax=0,
        cmap="magma",
        shading="flat",
        rasterized=True,
    )
    panel.set(title=picture.title, xlabel=picture.axes[0], ylabel=picture.axes[1])
    left, right, bottom, top = limits = picture.limits
    if 1 / _EQUAL < (right - left) / (top - bottom) < _EQUAL:
        x, y, half = (left + right) / 2, (bottom + top) / 2, max(right - left, top - bottom) / 2
        left, right, bottom, top = limits = (x - half, x + half, y - half, y + half)
        panel.set_aspect("equal")
    panel.set(xlim=(left, right), ylim=(bottom, top), facecolor=_NOT_FORMED)
    if with_points:
        for three in picture.points:
            panel.plot(*three.T, "o-", color=_MARKED, ms=4, lw=0.8)
    if picture.image_points.size:
        panel.plot(*picture.image_points.T, **_peaks(_PEAK))
    panel.plot(*picture.shown_places.T, **_put(_AT))
    panel.plot(*picture.true_places.T, **_stands(_TRUE))
    for true in picture.true_places:
        if not _is_within(true, limits):
            _point_to(panel, true, np.array([(left + right) / 2, (bottom + top) / 2]), _TRUE)
            break
    return mesh


def _stands(color: str) -> dict[str, Any]:
    """Mark of a target's own place: a cross that leaves the middle free."""
    from matplotlib.path import Path

    arms = [(x * r, y * r) for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1)) for r in (0.5, 1.0)]
    cross = Path(arms, [Path.MOVETO, Path.LINETO] * 4)
    return {"ls": "none", "marker": cross, "color": color, "ms": 17, "mew": 1.5, "mfc": "none"}


def _put(color: str) -> dict[str, Any]:
    """Mark of where a response is."""
    return {"ls": "none", "marker": "o", "color": color, "ms": 12, "mfc": "none", "mew": 1.2}


def _peaks(color: str) -> dict[str, Any]:
    """Mark of where an image peaks: a square, so that it can be told from a circle."""
    return {"ls": "none", "marker": "s", "color": color, "ms": 12, "mfc": "none", "mew": 1.2}


def _is_within(place: Floats, limits: Limits) -> bool:
    return bool(limits[0] <= place[0] <= limits[1] and limits[2] <= place[1] <= limits[3])


def _point_to(panel: Any, place: Floats, middle: Floats, color: str) -> None:
    """Say how far away a true place is, and where, that the panel does not show."""
    away = place - middle
    distance = float(np.hypot(*away))
    panel.text(
        0.04, 0.04, f"the target stands {distance:.3g} m away", color=color, fontsize=8, transform=panel.transAxes
    )
    start, tip = (0.5 + part * away / distance for part in (0.36, 0.47))
    arrow = {"arrowstyle": "-|>", "color": color, "lw": 1.5}
    panel.annotate("", tuple(tip), tuple(start), "axes fraction", "axes fraction", arrowprops=arrow)


def _cuts_drawing(drawn: Sheet) -> str:
    """The cross-range cuts, as a report draws them."""
    canvas = Canvas()
    curves = [*drawn.cuts[1:], drawn.cuts[0]]  # none covers the one without error
    bottom = cut_panel(canvas, 0.0, *_CUT_SIZE, "Cross-range cuts", curves)
    return canvas.document((_CUT_SIZE[0], bottom + 4), "cuts", "Cross-range cuts", "Power along y′.")


def _cuts(panel: Any, drawn: Sheet) -> None:
    paint(panel, ElementTree.fromstring(_cuts_drawing(drawn)))


PANELS: dict[str, Callable[[Any, Sheet], Any]] = {
    "fig3": _range_error,
    "fig4": _points,
    "fig5": lambda panel, drawn: _image(panel, drawn.in_scene, with_points=True),
    "fig6": lambda panel, drawn: _image(panel, drawn.rotated),
    "fig7": lambda panel, drawn: _image(panel, drawn.focused),
    "fig7_back": lambda panel, drawn: _image(panel, drawn.rotated_back),
    "cuts": _cuts,
}
