"""Draw the passes of a satellite: their tracks in the sky over the scene, and the resolution of each pass.

The sky is oriented like a map, with north up, east to the right and the zenith in the middle. A track has the colour
of the status of its pass, an arrow head where the satellite sets, and a dot at the middle of the aperture.
"""

import math
from collections.abc import Iterator, Sequence
from datetime import timedelta

from bisar_budget.faults import printable
from bisar_budget.findings.satellite_passes import Passes, SatellitePass, bearing
from bisar_budget.findings.status import RANK
from bisar_budget.paths.instant import DAY_S, Instant
from bisar_budget.report.drawing import svg

_SKY_WIDTH_PX = 900.0
_HORIZON_PX = 178.0  # from the zenith to the horizon
_DIRECTION_NAMES_PX = 34.0  # margin for the names of directions
_SKY_GAP_PX = 78.0  # between the sky and the axes of the resolution
_SKY_RIGHT_PX = 24.0  # margin beside the axes, for half a date
_ARROW_HEAD_PX = 7.0
_MIN_THIN_COUNT, _THIN_PX, _BROAD_PX = 20, 1.3, 2.0  # number of tracks from which lines are thin, and widths of lines
_MAX_NUMBERED_COUNT = 40  # passes with numbers
_HOUR_S = 3600.0
_DATE_STEPS_HOURS = (1, 2, 3, 6, 12, 24, 48, 120, 240, 480, 1200, 2400)
_DATE_PX = 58.0  # width for a date
_STATUS_DASHES = ("", "6 3", "2 2.5")  # of statuses with the same colour


def sky_plot(passes: Passes, title: str, verdict: str) -> str:
    """Draw passes as SVG.

    `verdict` is a sentence with the number of complying passes. It is written below the name of the mission, and also
    serves as the description for readers who cannot see the drawing.
    """
    canvas = svg.Canvas()
    top = svg.head(canvas, [svg.short(passes.name, _SKY_WIDTH_PX), printable(verdict)])
    middle = (_DIRECTION_NAMES_PX + _HORIZON_PX + 8, top + _DIRECTION_NAMES_PX + _HORIZON_PX)
    statuses = sorted({overpass.status for overpass in passes.found}, key=RANK.__getitem__)
    _sky(canvas, middle, passes)
    frame = svg.Box(
        2 * (_DIRECTION_NAMES_PX + _HORIZON_PX) + _SKY_GAP_PX,
        middle[1] - _HORIZON_PX,
        _SKY_WIDTH_PX - _SKY_RIGHT_PX,
        middle[1] + _HORIZON_PX,
    )
    _resolutions(canvas, frame, passes)
    entries = [svg.line_entry(canvas, svg.status_words(name), f"track is-{name}") for name in statuses]
    entries += [
        svg.circle_entry(canvas, "mid-time", 4, "dot"),
        svg.line_entry(canvas, f"{math.degrees(passes.min_elevation):.4g} deg above the horizon", "thin dashed"),
        svg.circle_entry(canvas, "range resolution", 3.6, "open"),
        svg.LegendLine("cross-range resolution", lambda at: _square(canvas, (at[0] + 13, at[1]), "solid")),
    ]
    bottom = svg.legend(canvas, middle[1] + _HORIZON_PX + _DIRECTION_NAMES_PX, _SKY_WIDTH_PX, entries)
    width = _THIN_PX if len(passes.found) > _MIN_THIN_COUNT else _BROAD_PX
    return canvas.document(
        (_SKY_WIDTH_PX, bottom + 4), f"{passes.file} passes", title, verdict, _style(statuses, width)
    )


def _style(statuses: Sequence[str], width: float) -> str:
    """CSS rules for a drawing of passes; `width` is the line width of a track [px]."""
    light, _ = svg.colours()
    rules = [
        f".track{{fill:none;stroke-width:{width};stroke-linecap:round}}",
        ".dot{fill:var(--ink,#222);stroke:var(--paper,#fff);stroke-width:1.2}",
        ".solid{fill:var(--ink,#222)}",
        ".open{fill:var(--paper,#fff);stroke:var(--ink,#222);stroke-width:1.6}",
        ".between{fill:none;stroke-width:1;stroke-opacity:.55}",
        ".frame{fill:none;stroke:var(--muted,#595f66);stroke-width:1}",
    ]
    for name, dashes in svg.marks_within_colours(statuses, _STATUS_DASHES).items():
        colour = f"var(--{svg.tone_of(name)},{light[svg.tone_of(name)]})"
        rules.append(f".track.is-{name}{{stroke:{colour}{f';stroke-dasharray:{dashes}' if dashes else ''}}}")
        rules.append(f".between.is-{name}{{stroke:{colour}}}")
        rules.append(f".open.is-{name}{{stroke:{colour}}}")
        rules += [f".{kind}.is-{name}{{fill:{colour}}}" for kind in ("dot", "solid", "head")]
    return svg.style_sheet(rules, map(svg.tone_of, statuses))


# ---------------------------------------------------------------- the sky
def _at(middle: svg.Point, azimuth: float, elevation: float) -> svg.Point:
    """Point on the page for a direction in the sky.

    The direction is given by azimuth [rad], counter-clockwise from east, and elevation [rad].
    """
    radius, angle = _HORIZON_PX * (1 - 2 * elevation / math.pi), bearing(azimuth)
    return middle[0] + radius * math.sin(angle), middle[1] - radius * math.cos(angle)


def _ring(middle: svg.Point, elevation: float) -> list[svg.Point]:
    return [_at(middle, math.radians(angle), elevation) for angle in range(0, 363, 3)]


def _sky(canvas: svg.Canvas, middle: svg.Point, passes: Passes) -> None:
    """Draw the sky with the tracks of the passes and their numbers."""
    for degrees in range(0, 360, 30):
        azimuth = math.radians(90 - degrees)
        canvas.lines([(_at(middle, azimuth, math.pi / 2), _at(middle, azimuth, 0.0))], "grid")
        x, y = _at(middle, azimuth, -0.125)
        name = {0: "N", 90: "E", 180: "S", 270: "W"}.get(degrees)
        canvas.text((x, y + 4), [name or f"{degrees}°"], "name" if name else "axis", "middle")
    for degrees in (30, 60):
        canvas.polyline(_ring(middle, math.radians(degrees)), "grid", is_obstacle=False)
        canvas.text(_at(middle, math.radians(75), math.radians(degrees)), [f"{degrees}°"], "axis", "middle")
    canvas.polyline(_ring(middle, 0.0), "frame", is_obstacle=False)
    if passes.min_elevation > 0:
        canvas.polyline(_ring(middle, passes.min_elevation), "thin dashed", is_obstacle=False)
    tracks = [[_at(middle, *direction) for direction in overpass.track.tolist()] for overpass in passes.found]
    worst_first = sorted(zip(passes.found, tracks, strict=True), key=lambda drawn: RANK[drawn[0].status])
    for overpass, track in worst_first:  # complying passes are drawn last, above the others
        canvas.polyline(track, f"track is-{overpass.status}", is_obstacle=False)
        if overpass.sets:
            canvas.polygon(_arrow(track), f"head is-{overpass.status}", is_obstacle=False)
    marks = []
    for overpass, track in zip(passes.found, tracks, strict=True):
        if overpass.state is None:
            marks.append(track[len(track) // 2])
            continue
        marks.append(_at(middle, float(overpass.state.azimuth), float(overpass.state.elevation)))
        canvas.circle(marks[-1], 4, f"dot is-{overpass.status}")
    _numbers(
        canvas,
        passes.found,
        marks,
        svg.Box(8, middle[1] - _HORIZON_PX, middle[0] + _HORIZON_PX, middle[1] + _HORIZON_PX),
    )


def _arrow(track: Sequence[svg.Point]) -> list[svg.Point]:
    """Points of the arrow head at the end of a track, along the last segment of the track."""
    (x, y), (u, v) = track[-1], track[-2]
    length = math.dist((x, y), (u, v)) or 1.0
    along = ((x - u) / length, (y - v) / length)
    back = (x - _ARROW_HEAD_PX * along[0], y - _ARROW_HEAD_PX * along[1])
    side = (-0.45 * _ARROW_HEAD_PX * along[1], 0.45 * _ARROW_HEAD_PX * along[0])
    return [(x, y), (back[0] + side[0], back[1] + side[1]), (back[0] - side[0], back[1] - side[1])]


def _numbers(
    canvas: svg.Canvas, overpasses: Sequence[SatellitePass], marks: Sequence[svg.Point], within: svg.Box
) -> None:
    """Write the number of each pass beside its mark.

    If there are very many passes, only the complying passes are numbered. If there are also very many complying
    passes, no numbers are written.
    """
    numbered_marks = list(zip(overpasses, marks, strict=True))
    if len(numbered_marks) > _MAX_NUMBERED_COUNT:
        numbered_marks = [(overpass, at) for overpass, at in numbered_marks if overpass.complies]
    if len(numbered_marks) <= _MAX_NUMBERED_COUNT:
        canvas.labels([svg.DrawnLabel(at, (str(overpass.number),), within) for overpass, at in numbered_marks])


# ---------------------------------------------------------------- resolution over time
def _resolutions(canvas: svg.Canvas, frame: svg.Box, passes: Passes) -> None:
    """Draw the resolution of each pass over time, on a logarithmic scale.

    Each pass has a mark for the range resolution and a mark for the cross-range resolution.
    """
    span = passes.stop.since(passes.start)
    across = svg.Scale(0.0, span, frame.left, frame.right)
    shown = [(overpass, resolutions) for overpass in passes.found if (resolutions := _sizes(overpass))]
    sizes = [size for _, resolutions in shown for size in resolutions]
    low, high = (min(sizes), max(sizes)) if sizes else (1.0, 10.0)
    up = svg.Scale(low / 1.3, high * 1.3, frame.bottom, frame.top, is_log=True)
    svg.grid(canvas, frame, None, up)
    for time, words in _dates(passes.start, span, frame.right - frame.left):
        x = across.at(time)
        canvas.lines([frame.upright(x)], "grid")
        canvas.lines([((x, frame.bottom), (x, frame.bottom + 4))], "thin")
        canvas.text((x, frame.bottom + 15), [words], "axis", "middle")
    canvas.text((frame.middle[0], frame.bottom + 31), ["mid-time, UTC"], "small", "middle")
    for gap in passes.unknown:
        ends = (across.at(instant.since(passes.start)) for instant in (gap.start, gap.stop))
        canvas.lines(map(frame.upright, ends), "thin dotted")
    svg.outline(canvas, frame, "frame")
    svg.y_axis(canvas, frame, up, "")
    canvas.upright_text((frame.left - 46, frame.middle[1]), "resolution on the ground [m]", "small")
    if not shown:
        canvas.text(frame.middle, ["no pass has an image"], "small", "middle")
    for overpass, (first, second) in shown:
        x = across.at(overpass.center.since(passes.start)) if overpass.center is not None else frame.left
        range_point, cross_point = (x, up.at(first)), (x, up.at(second))
        canvas.lines([(range_point, cross_point)], f"between is-{overpass.status}")
        canvas.circle(range_point, 3.6, f"open is-{overpass.status}")
        _square(canvas, cross_point, f"solid is-{overpass.status}")
    labelled_passes = [overpass for overpass, _ in shown]
    tops = [
        (across.at((overpass.center or passes.start).since(passes.start)), up.at(max(resolutions)))
        for overpass, resolutions in shown
    ]
    _numbers(canvas, labelled_passes, tops, frame)


def _sizes(overpass: SatellitePass) -> tuple[float, float] | None:
    """Range and cross-range resolution of a pass [m]; None if no image can be formed."""
    range_resolution, cross_range_resolution = overpass.range_resolution, overpass.cross_range_resolution
    if (
        range_resolution is None
        or cross_range_resolution is None
        or not (math.isfinite(range_resolution) and math.isfinite(cross_range_resolution))
    ):
        return None
    return range_resolution, cross_range_resolution


def _square(canvas: svg.Canvas, at: svg.Point, style: str) -> None:
    x, y = at
    canvas.polygon([(x - 3.2, y - 3.2), (x + 3.2, y - 3.2), (x + 3.2, y + 3.2), (x - 3.2, y + 3.2)], style)


def _dates(start: Instant, span: float, width: float) -> Iterator[tuple[float, str]]:
    """Yield the tick times of the date axis, counted from the start [s], each with its date or hour as text."""
    hours = next(
        (step for step in _DATE_STEPS_HOURS if step * _HOUR_S * width >= span * _DATE_PX), _DATE_STEPS_HOURS[-1]
    )
    step = hours * _HOUR_S
    first = math.ceil(start.seconds / step - 1e-9) if hours <= 24 else int(start.seconds > 0) * 24 / hours
    time = first * step - start.seconds
    while time <= span * (1 + 1e-9):
        moment = start.after(time).as_datetime() + timedelta(milliseconds=1)
        is_midnight = abs((start.seconds + time) % DAY_S) < 1e-3 or hours >= 24
        yield time, moment.strftime("%m-%d") if is_midnight else moment.strftime("%H:%M")
        time += step
