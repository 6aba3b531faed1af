"""Numbers of Figures 3 to 7 of Rigling & Moses for a mission of one's own: what a plot draws, no more.

All places are in the axes of the scene, (x, y) east and north of its centre, or in the axes (x′, y′) of (10), turned
about the same centre: a response stands where the errors put it, not at the middle of a patch.
"""

import math
from typing import NamedTuple

import numpy as np

from bisar_budget.simulate.impulse_response import between, resampled, upsampled
from bisar_budget.simulate.phase_history import Complexes, Floats
from bisar_budget.simulate.point import PointImages

FLOOR_DB = -35.0
_FINE, _FINE_CUT = 4, 8  # interpolation, at most, so that a mainlobe has a shape
_PIXELS = 3e5  # of a picture, about
_DRAWN_DB = -20.0  # what is above lies within the pictures
_BESIDE = 6  # pixels around it, two cells
_NEAR = 1.0  # times a picture's larger side: a true place that far away is still shown

Limits = tuple[float, float, float, float]


class ImagePanel(NamedTuple):
    """An image in dB over the error-free peak, on pixels given by their corners.

    `level_db` is (nx, ny), x or x′ along its first axis, NaN where no image was formed; `corners`
    (nx + 1, ny + 1, 2) are the corners of those pixels. `true_places` (n, 2) is where the targets stand,
    `shown_places` (n, 2) where (25) puts them, `points` (n, 3, 2) where (29) puts the pieces of the aperture. All
    places are in `axes`. [m]
    """

    title: str
    axes: tuple[str, str]
    level_db: Floats
    corners: Floats
    true_places: Floats
    shown_places: Floats
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


class Cut(NamedTuple):
    """A cross-range cut: where along y′ [m], and its power over the error-free peak. [dB]"""

    label: str
    place: Floats
    level_db: Floats


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
    cuts: tuple[Cut, ...]


def sheet(images: PointImages) -> Sheet:
    """Lay out what is drawn of some images."""
    peak = float(np.abs(images.error_free).max())
    cosine, sine = math.cos(images.look_azimuth), math.sin(images.look_azimuth)
    turn = np.array([[cosine, -sine], [sine, cosine]])  # (10), from the right
    true = np.array([[one.east, one.north] for one in images.targets.points])
    middle = len(images.points) // 2
    by_25 = images.points[middle] - np.asarray(images.effect.displacement)  # against exact ranges
    shown = np.array([one.shown for one in images.responses]) + by_25
    shown_in_scene = np.array([one.shown_in_scene for one in images.responses]) + by_25
    back = rotated_back(images)
    how = images.image_former.replace("_", " ")
    in_scene_how = "backprojection" if images.image_former == "polar_format" else how
    scene_crop = _bright([images.in_scene, back], peak, images.scene_spacing)
    crop = _bright([images.rotated, images.focused, images.error_free], peak, images.spacing)

    def picture(title: str, image: Complexes, grid: Floats, part: tuple[slice, slice], at: Floats) -> ImagePanel:
        level, corners = _drawn(image, grid[..., :2], part, peak)
        points = at[:, None] + images.points - images.points[middle]
        return ImagePanel(title, ("x [m]", "y [m]"), level, corners, true, at, points)

    def turned(title: str, image: Complexes) -> ImagePanel:
        flat = picture(title, image, images.grid, crop, shown)
        axes = ("x′ [m]", "y′ [m]")
        return ImagePanel(title, axes, flat.level_db, *(one @ turn for one in flat[3:]))

    return Sheet(
        slow_time=images.slow_time,
        range_error_mm=1e3 * images.range_error,
        segments=_segments(images),
        points=images.points,
        points_by=images.points_by,
        in_scene=picture(
            f"Fig. 5: in (x, y), {in_scene_how}", images.in_scene, images.scene_grid, scene_crop, shown_in_scene
        ),
        rotated=turned(f"Fig. 6: in (x′, y′), {how}", images.rotated),
        focused=turned("Fig. 7: after autofocus", images.focused),
        rotated_back=picture("Fig. 7 rotated back to (x, y)", back, images.scene_grid, scene_crop, shown),
        cuts=_cuts(images, images.grid[..., :2] @ turn, crop, peak),
    )


def rotated_back(images: PointImages) -> Complexes:
    """Focused image on the pixels of the one along (x, y): what completes image formation in the paper."""
    return resampled(images.focused, images.grid, images.scene_grid)


def _segments(images: PointImages) -> Floats:
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


def _drawn(image: Complexes, grid: Floats, part: tuple[slice, slice], peak: float) -> tuple[Floats, Floats]:
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


def _cuts(images: PointImages, turned: Floats, part: tuple[slice, slice], peak: float) -> tuple[Cut, ...]:
    """Lines through the brightest pixels, over y′."""
    columns = np.arange(part[1].start * _FINE_CUT, (part[1].stop - 1) * _FINE_CUT + 1)
    cuts = []
    for image, label in (
        (images.error_free, "without error"),
        (images.rotated, "with the declared errors"),
        (images.focused, "after autofocus"),
    ):
        row = int(np.unravel_index(np.argmax(np.abs(image)), image.shape)[0])
        place = between(turned, np.full(columns.size, float(row)), columns / _FINE_CUT)[:, 1]
        cuts.append(Cut(label, place, _decibels(upsampled(image[row], _FINE_CUT)[columns], peak)))
    return tuple(cuts)
