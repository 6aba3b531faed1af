"""Images of a simulated mission and the errors in them: numbers, drawings, files and a summary in words.

The panels are Figures 3 to 7 of Rigling & Moses, drawn for any mission. Titles and legends are written for readers
who do not know the paper. With an option, they have the numbers of the paper's figures and equations instead. All
coordinates are in the axes of the scene, (x, y) east and north of its centre, or in the axes (x′, y′) of equation
(10), rotated about the same centre. A response is drawn at its displaced position, not in the middle of its patch.
"""

import math
from collections.abc import Callable, Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from bisar_budget.effects.effect import PLATFORMS
from bisar_budget.effects.oscillator_tones import spurs_of
from bisar_budget.error_kinds.random_kinds import OTHER_KIND
from bisar_budget.faults import SetValue, changes_words, printable
from bisar_budget.findings.images import CHIP_FLOOR_DB
from bisar_budget.mission.model import OTHER_EFFECTS, Mission, Simulation, has_instruments
from bisar_budget.report.drawing.evidence_drawings import FOCUSED, WITH_ERRORS, WITHOUT_ERROR, Curve, cut_panel
from bisar_budget.report.drawing.figure import drawing_file, figure_file, new_figure, paint
from bisar_budget.report.drawing.svg import Canvas
from bisar_budget.report.words.sentences import wrapped
from bisar_budget.simulator.impulse_response import ImpulseResponse, between, line_at, resampled, upsampled
from bisar_budget.simulator.phase_history import Complexes, Floats
from bisar_budget.simulator.point import PointImages
from bisar_budget.simulator.realisations import has_unset_clocks

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure


PICTURE_FLOOR_DB = -35.0
_FINE_FACTOR, _CUT_FACTOR = 4, 8  # largest interpolation of a picture, and that of a cut, to resolve a mainlobe
_MAX_PICTURE_PIXELS = 3e5
_DRAWN_DB = -20.0  # level above which pixels are within the pictures
_MARGIN_PIXELS = 6  # around these pixels, two resolution cells
_NEAR_RATIO = 1.0  # largest distance of a target that is shown, relative to the longer side of the image
_MAX_READING_ERROR_DB = 0.05  # larger errors of the error-free peak get a remark; a regular grid gives 1e-4 dB
_MAX_RESTORED_LOSS_DB = 1.0  # a larger peak loss after autofocus gets a remark; it is usually much smaller
_MAX_EQUAL_SCALE_RATIO = 8.0  # ratio of the sides up to which an image has equal scales on both axes
_MARK_COLOR, _GRID_COLOR = "#c1502e", "#dddddd"
_NOT_FORMED_COLOR = "#3a3a3a"  # of a panel beside a narrow patch
_TARGET_COLOR, _PREDICTION_COLOR, _PEAK_COLOR = "#5fd3f3", "#7CFC9A", "#f5f0a0"
_PEAK_APART_PIXELS = 2  # cross-range distance from which the position by (25) counts as apart from the peak
# Width of the drawing of the cuts, and height of its frame: on a sheet, and by itself.
_SHEET_CUT_SIZE_PX, _CUT_SIZE_PX = (440.0, 190.0), (300.0, 170.0)
_LEVEL_LABEL = "level relative to the peak without errors [dB]"
_PAGE_INCHES = (16.5, 9.2)
_KEY_HEIGHT_RATIO = 0.22  # of the legend and the colour scale, relative to a row of panels
_MAP_AXES = ("east [m]", "north [m]")
_LOOK_AXES = ("along the look direction x′ [m]", "cross range y′ [m]")

Limits = tuple[float, float, float, float]


class _PanelText(NamedTuple):
    """A title or legend entry: `plain` for readers without the paper, `paper` with the numbers used in the paper."""

    plain: str
    paper: str

    def of(self, *, is_paper: bool) -> str:
        """The version with the paper's numbers if `is_paper`, otherwise the plain version."""
        return self.paper if is_paper else self.plain


_RANGE_ERROR_TITLE = _PanelText(
    "Range error over the aperture,\nand three straight lines", "Fig. 3: range error, three segments"
)
_INDICATED_TITLE = _PanelText(
    "Ground points that the three lines indicate:\nthe image smears along them",
    "Fig. 4: points of the segments, (29)\nby {points_by}",
)
_BEFORE_TITLE = _PanelText(
    "Image with the declared errors,\nbefore autofocus{former}", "Fig. 5: in (x, y), {paper_former}"
)
_TURNED_TITLE = _PanelText(
    "The same image, rotated:\nany smear is upright{former}", "Fig. 6: in (x′, y′), {paper_former}"
)
_FOCUSED_TITLE = _PanelText("Rotated image, after autofocus", "Fig. 7: after autofocus")
_TURNED_BACK_TITLE = _PanelText("Image after autofocus,\nrotated back", "Fig. 7 rotated back to (x, y)")
_CUTS_TITLE = _PanelText("Levels along the line through the peak, in cross range", "Cross-range cuts")
_TARGET = _PanelText("true position of the target", "position of the target")
_PREDICTION = _PanelText("predicted position of its image", "position by (25)")
_POINTS = _PanelText("points that the three lines indicate", "points of (29)")
_PEAK = _PanelText("peak of the image", "peak of the image")
_NOT_FORMED = _PanelText("no image formed", "no image formed")


class ImagePanel(NamedTuple):
    """An image in dB relative to the error-free peak, with the corners of its pixels.

    `level_db` (nx, ny) has x or x′ along its first axis, and NaN for pixels without an image. `corners` (nx + 1, ny +
    1, 2) are the corners of the pixels. `true_places` (n, 2) are the positions of the targets, and `shown_places` (n,
    2) their image points by equation (25) of Rigling & Moses. `image_points` (n, 2) are the peaks of the targets in
    the image; the array is empty if the peaks agree with (25). `points` (n, 3, 2) are the image points of each target
    by equation (29), for each third of the aperture. All coordinates are in metres along `axes`.
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
        """Left, right, bottom and top edge of the image. [m]"""
        low, high = self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))
        return float(low[0]), float(high[0]), float(low[1]), float(high[1])

    @property
    def limits(self) -> Limits:
        """Left, right, bottom and top limit of the axes, which include the image and targets near it. [m]"""
        left, right, bottom, top = self.extent
        near = _NEAR_RATIO * max(right - left, top - bottom)
        x, y = self.true_places.T
        is_near = (x > left - near) & (x < right + near) & (y > bottom - near) & (y < top + near)
        margin = 0.05 * near
        for east, north in self.true_places[is_near]:
            left, right = min(left, float(east) - margin), max(right, float(east) + margin)
            bottom, top = min(bottom, float(north) - margin), max(top, float(north) + margin)
        return left, right, bottom, top


class Sheet(NamedTuple):
    """Data of all panels.

    The range error is approximated by a straight line over each third of the aperture. `segments` (3, 2, 2) has the
    two end points of each line: time [s] and range error [mm]. `points` (3, 2) [m] are the image points of a target
    at the scene centre for these thirds, by equation (29) of Rigling & Moses. `points_by` names the gradients that
    are used in (29). If `is_paper` is True, titles and legends have the numbers of the paper's figures and equations.
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
    is_paper: bool = False

    def words(self, words: _PanelText) -> str:
        """Title or legend entry, in the plain version or in the version with the paper's numbers."""
        return words.of(is_paper=self.is_paper)


def sheet(images: PointImages, *, is_paper: bool = False) -> Sheet:
    """Compute the numbers of all panels from the images of a mission.

    If `is_paper` is True, titles and legends have the numbers of the paper's figures and equations.
    """
    peak = float(np.abs(images.error_free).max())
    cosine, sine = math.cos(images.look_azimuth), math.sin(images.look_azimuth)
    turn = np.array([[cosine, -sine], [sine, cosine]])  # rotation (10), applied from the right
    true = np.array([[target.east, target.north] for target in images.targets.points])
    middle = len(images.points) // 2
    predicted = images.points[middle] - np.asarray(images.effect.displacement)  # against exact ranges
    is_elsewhere = float(np.hypot(*predicted)) > _PEAK_APART_PIXELS * images.spacing[1]
    shown = np.array([response.shown for response in images.responses])
    shown_in_scene = np.array([response.shown_in_scene for response in images.responses])
    back = rotated_back(images)
    image_former = images.image_former.replace("_", " ")
    scene_former = "backprojection" if images.image_former == "polar_format" else image_former
    scene_crop = _bright([images.in_scene, back], peak, images.scene_spacing)
    crop = _bright([images.rotated, images.focused, images.error_free], peak, images.spacing)

    def title_of(words: _PanelText, name: str = "backprojection") -> str:
        former = "" if name == "backprojection" else f" ({name})"
        return words.of(is_paper=is_paper).format(former=former, paper_former=name)

    def image_panel(
        title: str, image: Complexes, grid: Floats, region: tuple[slice, slice], shown_points: Floats
    ) -> ImagePanel:
        level, corners = _interpolated(image, grid[..., :2], region, peak)
        points = (shown_points + predicted)[:, None] + images.points - images.points[middle]
        peaks = shown_points if is_elsewhere else shown_points[:0]
        axes = ("x [m]", "y [m]") if is_paper else _MAP_AXES
        return ImagePanel(title, axes, level, corners, true, shown_points + predicted, peaks, points)

    def turned(title: str, image: Complexes) -> ImagePanel:
        flat = image_panel(title, image, images.grid, crop, shown)
        axes = ("x′ [m]", "y′ [m]") if is_paper else _LOOK_AXES
        return ImagePanel(title, axes, flat.level_db, *(points @ turn for points in flat[3:]))

    return Sheet(
        slow_time=images.slow_time,
        range_error_mm=1e3 * images.range_error,
        segments=_segments_of(images),
        points=images.points,
        points_by=images.points_by,
        in_scene=image_panel(
            title_of(_BEFORE_TITLE, scene_former), images.in_scene, images.scene_grid, scene_crop, shown_in_scene
        ),
        rotated=turned(title_of(_TURNED_TITLE, image_former), images.rotated),
        focused=turned(title_of(_FOCUSED_TITLE), images.focused),
        rotated_back=image_panel(title_of(_TURNED_BACK_TITLE), back, images.scene_grid, scene_crop, shown),
        cuts=_cuts_of(images, images.grid[..., :2] @ turn, crop, peak),
        is_paper=is_paper,
    )


def rotated_back(images: PointImages) -> Complexes:
    """Resample the focused image to the pixels of the image along (x, y), the last step in Rigling & Moses."""
    return resampled(images.focused, images.grid, images.scene_grid)


def _segments_of(images: PointImages) -> Floats:
    times = images.segment_times
    half = (times[1] - times[0]) / 2
    ends = np.stack((times - half, times + half), axis=1)
    value, slope = images.segments[:, :1], images.segments[:, 1:]
    return np.stack((ends, 1e3 * (value + slope * (ends - times[:, None]))), axis=-1)


def _bright(images: list[Complexes], peak: float, spacing: tuple[float, float]) -> tuple[slice, slice]:
    """Slices that select the part of a patch to be drawn; its length in metres is the same along both axes.

    The part contains all pixels that exceed -20 dB relative to `peak` in any image, and a margin for the nearest
    sidelobes. `peak` is the peak of the error-free image, and `spacing` [m] the pixel spacing along both axes.
    """
    bright = np.maximum.reduce([np.abs(image) for image in images]) > peak * 10 ** (_DRAWN_DB / 20)
    used_indices = [np.nonzero(bright.any(axis=1 - axis))[0] for axis in (0, 1)]
    ends = [
        (int(used[0]) - _MARGIN_PIXELS, int(used[-1]) + _MARGIN_PIXELS + 1) if used.size else (0, 1 << 30)
        for used in used_indices
    ]
    longest = max((last - first) * step for (first, last), step in zip(ends, spacing, strict=True))
    slices = []
    for (first, last), step, size in zip(ends, spacing, bright.shape, strict=True):
        padding = max(0, round((longest / step - (last - first)) / 2))
        slices.append(slice(max(0, first - padding), min(size, last + padding)))
    return slices[0], slices[1]


def _interpolated(image: Complexes, grid: Floats, region: tuple[slice, slice], peak: float) -> tuple[Floats, Floats]:
    """Interpolate a region of an image; return its levels [dB] and the corners of its pixels [m]."""
    rows, columns = region
    shape = (rows.stop - rows.start, columns.stop - columns.start)
    factor = max(1, min(_FINE_FACTOR, math.isqrt(int(_MAX_PICTURE_PIXELS / (shape[0] * shape[1])))))
    fine = upsampled(image.T, factor).T[rows.start * factor : rows.stop * factor]
    fine = upsampled(fine, factor)[:, columns.start * factor : columns.stop * factor]
    # Sample k of the interpolation lies at k/factor, its edges half a step on either side.
    row, column = (
        side.start + (np.arange(count * factor + 1) - 0.5) / factor for side, count in zip(region, shape, strict=True)
    )
    i, j = (index.ravel() for index in np.meshgrid(row, column, indexing="ij"))
    corners = between(grid, i, j).reshape(row.size, column.size, 2)
    is_missing = np.repeat(np.repeat(image[region] == 0, factor, axis=0), factor, axis=1)
    return np.where(is_missing, math.nan, _decibels(fine, peak)), corners


def _decibels(samples: Complexes, peak: float) -> Floats:
    level: Floats = 20 * np.log10(np.maximum(np.abs(samples) / peak, 1e-6))
    return level


def _cuts_of(images: PointImages, turned: Floats, region: tuple[slice, slice], peak: float) -> tuple[Curve, ...]:
    """Cross-range cuts through the peaks: levels [dB] at positions along y′ [m]."""
    columns = np.arange(region[1].start * _CUT_FACTOR, (region[1].stop - 1) * _CUT_FACTOR + 1)
    cuts = []
    shown = (
        (images.error_free, "without error", WITHOUT_ERROR),
        (images.rotated, "with the declared errors", WITH_ERRORS),
        (images.focused, "after autofocus", FOCUSED),
    )
    for row, (image, name, style) in zip(images.rows, shown, strict=True):
        line = line_at(image, row)
        position = between(turned, np.full(columns.size, row), columns / _CUT_FACTOR)[:, 1]
        level = _decibels(upsampled(line, _CUT_FACTOR)[columns], peak)
        cuts.append(Curve(name, position.tolist(), level.tolist(), style))
    return tuple(cuts)


# ---------------------------------------------------------------------- drawn
def drawn(images: PointImages, title: str, kind: str, *, is_paper: bool = False) -> bytes:
    """Draw all panels on one sheet; return the content of a `png`, `svg` or `pdf` file.

    See `sheet` for `is_paper`.
    """
    return figure_file(figure(sheet(images, is_paper=is_paper), title), kind)


MarkStyle = dict[str, Any]
"""Arguments of Matplotlib for a mark."""


def figure(drawn: Sheet, title: str) -> "Figure":
    """Arrange all panels on one Matplotlib figure.

    Range errors and cuts are at the top, images below them, and the legend and colours at the bottom.
    """
    page = new_figure(figsize=_PAGE_INCHES)
    rows = page.add_gridspec(3, 1, height_ratios=(1, 1.12, _KEY_HEIGHT_RATIO), hspace=0.08)
    above, images, key_row = (page.add_subfigure(rows[index]) for index in range(3))
    panels = [*above.subplots(1, 3), *images.subplots(1, 4)]
    for name, panel in zip(("fig3", "fig4", "cuts", "fig5", "fig6", "fig7", "fig7_back"), panels, strict=True):
        artist = PANELS[name](panel, drawn)
    key, bar = key_row.subplots(1, 2, width_ratios=(2.4, 1))
    key.axis("off")
    page.colorbar(artist, cax=bar, orientation="horizontal").set_label(_LEVEL_LABEL)
    _legend(key, drawn)
    page.suptitle(printable(title), parse_math=False)  # a $ in a name begins no formula
    return page


def _legend(key: "Axes", drawn: Sheet) -> None:
    """Draw a legend that explains the marks in the images; `key` are the Matplotlib axes of the legend."""
    styles: list[tuple[MarkStyle, _PanelText]] = [
        (_target_mark(_TARGET_COLOR), _TARGET),
        (_prediction_mark(_PREDICTION_COLOR), _PREDICTION),
        ({"ls": "none", "marker": "o", "color": _MARK_COLOR, "ms": 5}, _POINTS),
        ({"ls": "none", "marker": "s", "mfc": _NOT_FORMED_COLOR, "mec": "white", "ms": 13}, _NOT_FORMED),
    ]
    if drawn.in_scene.image_points.size:
        styles.append((_peak_mark(_PEAK_COLOR), _PEAK))
    marks = [key.plot([], [], label=drawn.words(words), **style)[0] for style, words in styles]
    key.legend(
        handles=marks,
        loc="upper left",
        borderaxespad=0.0,
        ncols=len(marks),
        facecolor="black",
        labelcolor="white",
        fontsize=10,
        framealpha=1.0,
        borderpad=0.9,
    )


def drawn_panel(name: str, drawn: Sheet) -> bytes:
    """Draw a single small panel for a page; return the content of a PNG file. `name` is a key of `PANELS`."""
    if name == "cuts":
        return drawing_file(_cuts_drawing(drawn, _CUT_SIZE_PX), "png", dpi=112)
    page = new_figure(figsize=(4.4, 3.6))
    panel = page.subplots()
    artist = PANELS[name](panel, drawn)
    if artist is not None:
        page.colorbar(artist, ax=panel, pad=0.02).set_label(_LEVEL_LABEL)
    return figure_file(page, "png", dpi=80)


def archive(images: PointImages, changes: Sequence[SetValue] = ()) -> bytes:
    """Return the bytes of an NPZ file with the complex images, their grids and the errors.

    `changes` are the options that changed the mission. They are stored as an array (n,) of strings `KEY=VALUE`.
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
        targets_m=[[target.east, target.north] for target in images.targets.points],
        targets_db=[target.level_db for target in images.targets.points],
        shown_m=[response.shown for response in images.responses],
        set=np.array([f"{change.key}={change.text}" for change in changes], dtype=str),
    )
    return file.getvalue()


def flown_words(mission: Mission) -> str:
    """Describe the errors with which the images of a mission are formed, and the errors that are not simulated."""
    factor = mission.allocation.coverage_factor
    times = f", {factor:g} times the file's values" if factor != 1 else ""
    errors = (getattr(mission.platforms, name).motion_error for name in PLATFORMS)
    covariance_words = (
        "; the most probable error of a covariance" if any(error.covariance for error in errors) else ""
    )
    seed = (mission.simulation or Simulation()).seed
    realisation_words = f"; one time series of each sensor and clock, seed {seed}" if has_instruments(mission) else ""
    if mission.propagation is not None:
        realisation_words += f"; one draw of each delay in the air, seed {seed}, a time series of those that change"
    spur_ids = ", ".join(spur.subject.id for spur in spurs_of(mission))
    if spur_ids:
        realisation_words += (
            f"; without spurs ({spur_ids}), except those that exchanges fold below one cycle per aperture"
        )
    if mission.other_errors:
        realisation_words += f"; {_stated_effect_words(mission)}"
    if has_instruments(mission) and has_unset_clocks(mission):
        realisation_words += "; oscillators without mean and slope, since the file does not state how they were set"
    return (
        f"all declared errors, with the signs of the file{times}{covariance_words}{realisation_words}. "
        "They may cancel: check gives the worst case"
    )


def _stated_effect_words(mission: Mission) -> str:
    """Describe the errors of which the file states only the effects.

    An effect can have many causes. The text therefore states the cause that is simulated in the images.
    """
    ways = {
        "as a phase of the receiver": ("quadratic_phase_error", "cubic_phase_error"),
        "as a displacement to the east": ("location_error",),
        "as white noise of the receiver": ("islr",),
    }
    row_ids = {effect: list[str]() for effect in OTHER_EFFECTS}
    for stated in mission.other_errors:
        for row_id in stated.stated:
            effect = row_id.removeprefix(OTHER_KIND.row_id("mission", stated.name)).lstrip(".")
            row_ids[effect or OTHER_EFFECTS[0]].append(row_id)
    flown = []
    for way, effects in ways.items():
        if flown_ids := [row_id for effect in effects for row_id in row_ids[effect]]:
            flown.append(f"{', '.join(flown_ids)} {way}")
    return "; ".join(flown)


def summary(images: PointImages, mission: Mission) -> str:
    """Write a text about the effects of the errors on the targets, and about the responses after autofocus."""
    clean = images.clean_response
    east, north = (round(float(moved), 3) for moved in images.effect.displacement)
    is_point = len(images.responses) == 1 and images.targets.clutter_db is None
    lines = [
        mission.name,
        *(wrapped(f"  {changes_words(mission.changes)}", "    ") if mission.changes else ()),
        "",
        *wrapped(f"errors         {flown_words(mission)}", " " * 15),
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
    error_db = images.misread_db
    if abs(error_db) > _MAX_READING_ERROR_DB:
        text = (
            f"peaks, widths and sidelobes are in doubt: the error-free response is read {abs(error_db):.1g} dB too "
            f"{'high' if error_db > 0 else 'low'}, since lines of equal range and of equal Doppler are nearly "
            "parallel there"
        )
        lines += ["", *wrapped(text, "")]
    restored_db = 20 * np.log10(images.focused_response.peak / clean.peak)
    if restored_db < -_MAX_RESTORED_LOSS_DB:
        text = (
            f"autofocus does not restore the response: its peak stays {-restored_db:.1f} dB below the error-free one"
        )
        lines += ["", *wrapped(text, "")]
    return "\n".join(lines) + "\n"


def _formed_by(images: PointImages) -> str:
    words = {
        "polar_format": "polar format (14) in (x′, y′), backprojection in (x, y)",
        "matched_filter": "matched filter (4)",
        "far_field": "far-field filter (12)",
    }[images.image_former]
    response = images.responses[0]
    exact = np.array([response.target.east, response.target.north]) + response.effect.displacement
    distance_m = float(np.hypot(*(np.asarray(response.shown) - exact)))
    plane = f"; plane waves put the response {distance_m:.2g} m from where exact ranges do" if distance_m else ""
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
    """Write a line for each target, below two header lines.

    A line has the position, level, displacement and quadratic phase of the target. For the image with errors and the
    image after autofocus, it also has the peak relative to the error-free peak, and the width of the cut.
    """
    lines = [
        f"{'target [m]':>17} {'level':>7} {'moved by [m]':>15} {'phase':>8} {'with errors':>14} {'autofocused':>14}",
        f"{'east':>8} {'north':>8} {'[dB]':>7} {'east':>7} {'north':>7} {'[rad]':>8} "
        f"{'[dB]':>7} {'[m]':>6} {'[dB]':>7} {'[m]':>6}",
    ]
    for response in images.responses:
        moved = np.round(response.effect.displacement, 3) + 0.0
        lines.append(
            f"{response.target.east:>8.6g} {response.target.north:>8.6g} {response.target.level_db:>7.4g} "
            f"{moved[0]:>7.3f} {moved[1]:>7.3f} {response.effect.quadratic:>+8.3f} "
            f"{_peak_and_width(response.smeared, response.clean)} {_peak_and_width(response.focused, response.clean)}"
        )
    return lines


def _peak_and_width(response: ImpulseResponse | None, clean: ImpulseResponse | None) -> str:
    if response is None or clean is None:
        return f"{'-':>7} {'-':>6}"
    return f"{20 * math.log10(response.peak / clean.peak):>+7.2f} {response.irw_m:>6.3f}"


def _range_error(panel: "Axes", drawn: Sheet) -> None:
    panel.plot(drawn.slow_time, drawn.range_error_mm, color="black")
    for segment in drawn.segments:
        panel.plot(*segment.T, "--", color=_MARK_COLOR)
    time_label = "slow time [s]" if drawn.is_paper else "time from mid-aperture [s]"
    panel.set(title=drawn.words(_RANGE_ERROR_TITLE), xlabel=time_label, ylabel="range error [mm]")
    panel.grid(color=_GRID_COLOR, lw=0.5)


def _points(panel: "Axes", drawn: Sheet) -> None:
    panel.plot(*drawn.points.T, "o-", color=_MARK_COLOR, zorder=3)
    panel.plot(0, 0, **_target_mark("#1b7fa3"))
    panel.plot(*drawn.points[1], **_prediction_mark("#2a8f4f"))
    x_label, y_label = drawn.in_scene.axes
    panel.set(title=drawn.words(_INDICATED_TITLE).format(points_by=drawn.points_by), xlabel=x_label, ylabel=y_label)
    span = float(np.ptp(drawn.points, axis=0).max()) or 1.0
    low, high = drawn.points.min(axis=0), drawn.points.max(axis=0)
    if float(np.hypot(*drawn.points[1])) < 10 * span:  # farther away the three points would coincide in the panel
        low, high = np.minimum(low, 0), np.maximum(high, 0)
    else:
        _point_to(panel, np.zeros(2), (low + high) / 2, "black")
    half = 0.65 * max(float((high - low).max()), span)
    (x, y) = (low + high) / 2
    panel.set(xlim=(x - half, x + half), ylim=(y - half, y + half))
    panel.update_datalim([(x - half, y - half), (x + half, y + half)])
    panel.set_aspect("equal", adjustable="datalim")  # a wide panel shows more than these limits
    panel.grid(color=_GRID_COLOR, lw=0.5)


def _image(panel: "Axes", picture: ImagePanel, *, with_points: bool = False) -> "QuadMesh":
    """Draw an image.

    Each pixel is drawn as the quadrilateral between its corners, because pixel rows follow curves of equal range.
    """
    mesh = panel.pcolormesh(
        picture.corners[..., 0],
        picture.corners[..., 1],
        picture.level_db,
        vmin=PICTURE_FLOOR_DB,
        vmax=0,
        cmap="magma",
        shading="flat",
        rasterized=True,
    )
    panel.set(title=picture.title, xlabel=picture.axes[0], ylabel=picture.axes[1])
    left, right, bottom, top = limits = picture.limits
    if 1 / _MAX_EQUAL_SCALE_RATIO < (right - left) / (top - bottom) < _MAX_EQUAL_SCALE_RATIO:
        x, y, half = (left + right) / 2, (bottom + top) / 2, max(right - left, top - bottom) / 2
        left, right, bottom, top = limits = (x - half, x + half, y - half, y + half)
        panel.set_aspect("equal")
    panel.set(xlim=(left, right), ylim=(bottom, top), facecolor=_NOT_FORMED_COLOR)
    if with_points:
        for three in picture.points:
            panel.plot(*three.T, "o-", color=_MARK_COLOR, ms=4, lw=0.8)
    if picture.image_points.size:
        panel.plot(*picture.image_points.T, **_peak_mark(_PEAK_COLOR))
    panel.plot(*picture.shown_places.T, **_prediction_mark(_PREDICTION_COLOR))
    panel.plot(*picture.true_places.T, **_target_mark(_TARGET_COLOR))
    for true in picture.true_places:
        if not _is_within(true, limits):
            _point_to(panel, true, np.array([(left + right) / 2, (bottom + top) / 2]), _TARGET_COLOR)
            break
    return mesh


def _target_mark(color: str) -> MarkStyle:
    """Style of the mark at the position of a target: a cross with an open middle."""
    from matplotlib.path import Path

    arms = [(x * r, y * r) for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1)) for r in (0.5, 1.0)]
    cross = Path(arms, [Path.MOVETO, Path.LINETO] * 4)
    return {"ls": "none", "marker": cross, "color": color, "ms": 17, "mew": 1.5, "mfc": "none"}


def _prediction_mark(color: str) -> MarkStyle:
    """Style of the mark at the image point of a target by equation (25) of Rigling & Moses: a circle."""
    return {"ls": "none", "marker": "o", "color": color, "ms": 12, "mfc": "none", "mew": 1.2}


def _peak_mark(color: str) -> MarkStyle:
    """Style of the mark at a peak of an image: a square."""
    return {"ls": "none", "marker": "s", "color": color, "ms": 12, "mfc": "none", "mew": 1.2}


def _is_within(point: Floats, limits: Limits) -> bool:
    return bool(limits[0] <= point[0] <= limits[1] and limits[2] <= point[1] <= limits[3])


def _point_to(panel: "Axes", point: Floats, middle: Floats, color: str) -> None:
    """Write the distance to a target that lies outside the panel, with an arrow towards the target."""
    away = point - middle
    distance = float(np.hypot(*away))
    panel.text(0.04, 0.04, f"the target is {distance:.3g} m away", color=color, fontsize=8, transform=panel.transAxes)
    start, tip = (0.5 + fraction * away / distance for fraction in (0.36, 0.47))
    arrow = {"arrowstyle": "-|>", "color": color, "lw": 1.5}
    panel.annotate("", tuple(tip), tuple(start), "axes fraction", "axes fraction", arrowprops=arrow)


def _cuts_drawing(drawn: Sheet, size: tuple[float, float]) -> str:
    """Draw the cross-range cuts as SVG in the style of a report.

    The cuts are drawn only over the range of positions in which at least one cut exceeds the lowest level of the
    panel. `size` [px] is the width of the drawing and the height of its frame.
    """
    canvas = Canvas()
    curves = [*drawn.cuts[1:], drawn.cuts[0]]  # the cut without error is last, so that no line covers it
    visible = [
        position
        for curve in curves
        for position, level in zip(curve.positions, curve.levels_db, strict=True)
        if level > CHIP_FLOOR_DB
    ]
    if visible:
        curves = [_within(curve, min(visible), max(visible)) for curve in curves]
    title = drawn.words(_CUTS_TITLE)
    bottom = cut_panel(canvas, 0.0, *size, title, curves)
    return canvas.document((size[0], bottom + 4), "cuts", title, "Power along y′.")


def _within(curve: Curve, low: float, high: float) -> Curve:
    """Part of a cut between the positions `low` and `high` [m]."""
    pairs = zip(curve.positions, curve.levels_db, strict=True)
    visible = [(position, level) for position, level in pairs if low <= position <= high]
    return curve._replace(positions=[position for position, _ in visible], levels_db=[level for _, level in visible])


def _cuts(panel: "Axes", drawn: Sheet) -> None:
    paint(panel, ElementTree.fromstring(_cuts_drawing(drawn, _SHEET_CUT_SIZE_PX)))


PANELS: dict[str, Callable[["Axes", Sheet], Any]] = {
    "fig3": _range_error,
    "fig4": _points,
    "fig5": lambda panel, drawn: _image(panel, drawn.in_scene, with_points=True),
    "fig6": lambda panel, drawn: _image(panel, drawn.rotated),
    "fig7": lambda panel, drawn: _image(panel, drawn.focused),
    "fig7_back": lambda panel, drawn: _image(panel, drawn.rotated_back),
    "cuts": _cuts,
}
