"""Passes of a satellite as a drawing: their tracks in the sky over the scene, and the resolution that each gives.

The sky is seen as a map is: north up, east to the right, the zenith in the middle. A track is in the colour of the
status, with a head where it sets and a dot at the mid-time.
"""

import math
from collections.abc import Iterator, Sequence
from datetime import timedelta

from bisar_budget.design.passes import Passes, SatellitePass, bearing
from bisar_budget.faults import printable
from bisar_budget.findings.status import RANK
from bisar_budget.paths.instant import DAY, Instant
from bisar_budget.report.drawing import svg

_WIDTH = 900.0  # px
_RIM = 178.0  # px from the zenith to the horizon
_BESIDE = 34.0  # px for the names of directions
_APART = 78.0  # px between the sky and the axes of the resolution
_RIGHT = 24.0  # px beside them, for half a date
_HEAD = 7.0  # px, of an arrow
_MANY, _THIN, _BROAD = 20, 1.3, 2.0  # tracks, from which on they are thin; px
_NUMBERED = 40  # passes, at most
_HOUR = 3600.0
_STEPS = (1, 2, 3, 6, 12, 24, 48, 120, 240, 480, 1200, 2400)  # h
_ROOM = 58.0  # px for a date
_DASHES = ("", "6 3", "2 2.5")  # of statuses that share a colour


def sky_plot(passes: Passes, title: str, verdict: str) -> str:
    """Draw passes as SVG.

    `verdict` says how many comply: it stands below the name of the mission, and is read to who cannot see the rest.
    """
    canvas = svg.Canvas()
    top = svg.head(canvas, [svg.short(passes.name, _WIDTH), printable(verdict)])
    middle = (_BESIDE + _RIM + 8, top + _BESIDE + _RIM)
    statuses = sorted({one.status for one in passes.found}, key=RANK.__getitem__)
    _sky(canvas, middle, passes)
    frame = svg.Box(2 * (_BESIDE + _RIM) + _APART, middle[1] - _RIM, _WIDTH - _RIGHT, middle[1] + _RIM)
    _resolutions(canvas, frame, passes)
    entries = [svg.line_entry(canvas, svg.status_words(name), f"track is-{name}") for name in statuses]
    entries += [
        svg.circle_entry(canvas, "mid-time", 4, "dot"),
        svg.line_entry(canvas, f"{math.degrees(passes.min_elevation):.4g} deg above the horizon", "thin dashed"),
        svg.circle_entry(canvas, "range resolution", 3.6, "open"),
        svg.LegendLine("cross-range resolution", lambda at: _square(canvas, (at[0] + 13, at[1]), "solid")),
    ]
    bottom = svg.legend(canvas, middle[1] + _RIM + _BESIDE, _WIDTH, entries)
    width = _THIN if len(passes.found) > _MANY else _BROAD
    return canvas.document((_WIDTH, bottom + 4), f"{passes.file} passes", title, verdict, _style(statuses, width))


def _style(statuses: Sequence[str], width: float) -> str:
    """Rules for what only these drawings have."""
    light, _ = svg.colours()
    rules = [
        f".track{{fill:none;stroke-width:{width};stroke-linecap:round}}",
        ".dot{fill:var(--ink,#222);stroke:var(--paper,#fff);stroke-width:1.2}",
        ".solid{fill:var(--ink,#222)}",
        ".open{fill:var(--paper,#fff);stroke:var(--ink,#222);stroke-width:1.6}",
        ".between{fill:none;stroke-width:1;stroke-opacity:.55}",
        ".frame{fill:none;stroke:var(--muted,#595f66);stroke-width:1}",
    ]
    for name, dashes in svg.marks_within_colours(statuses, _DASHES).items():
        colour = f"var(--{svg.tone_of(name)},{light[svg.tone_of(name)]})"
        rules.append(f".track.is-{name}{{stroke:{colour}{f';stroke-dasharray:{dashes}' if dashes else ''}}}")
        rules.append(f".between.is-{name}{{stroke:{colour}}}")
        rules.append(f".open.is-{name}{{stroke:{colour}}}")
        rules += [f".{kind}.is-{name}{{fill:{colour}}}" for kind in ("dot", "solid", "head")]
    return svg.style_sheet(rules, map(svg.tone_of, statuses))


# ---------------------------------------------------------------- the sky
def _at(middle: svg.Point, azimuth: float, elevation: float) -> svg.Point:
    """Place on the page of a direction; azimuth from east, counter-clockwise. [rad]"""
    radius, turned = _RIM * (1 - 2 * elevation / math.pi), bearing(azimuth)
    return middle[0] + radius * math.sin(turned), middle[1] - radius * math.cos(turned)


def _ring(middle: svg.Point, elevation: float) -> list[svg.Point]:
    return [_at(middle, math.radians(angle), elevation) for angle in range(0, 363, 3)]


def _sky(canvas: svg.Canvas, middle: svg.Point, passes: Passes) -> None:
    """The sky with its tracks, and their numbers."""
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
    tracks = [[_at(middle, *place) for place in one.track.tolist()] for one in passes.found]
    worst_first = sorted(zip(passes.found, tracks, strict=True), key=lambda drawn: RANK[drawn[0].status])
    for one, track in worst_first:  # those that comply lie above the others
        canvas.polyline(track, f"track is-{one.status}", is_obstacle=False)
        if one.sets:
            canvas.polygon(_arrow(track), f"head is-{one.status}", is_obstacle=False)
    marks = []
    for one, track in zip(passes.found, tracks, strict=True):
        if one.state is None:
            marks.append(track[len(track) // 2])
            continue
        marks.append(_at(middle, one.state.azimuth, one.state.elevation))
        canvas.circle(marks[-1], 4, f"dot is-{one.status}")
    _numbers(canvas, passes.found, marks, svg.Box(8, middle[1] - _RIM, middle[0] + _RIM, middle[1] + _RIM))


def _arrow(track: Sequence[svg.Point]) -> list[svg.Point]:
    """Head at the end of a track, along its last part."""
    (x, y), (u, v) = track[-1], track[-2]
    length = math.dist((x, y), (u, v)) or 1.0
    along = ((x - u) / length, (y - v) / length)
    back = (x - _HEAD * along[0], y - _HEAD * along[1])
    side = (-0.45 * _HEAD * along[1], 0.45 * _HEAD * along[0])
    return [(x, y), (back[0] + side[0], back[1] + side[1]), (back[0] - side[0], back[1] - side[1])]


def _numbers(canvas: svg.Canvas, found: Sequence[SatellitePass], marks: Sequence[svg.Point], within: svg.Box) -> None:
    """Numbers of passes beside their marks; of very many those of the passes that comply, if they are few."""
    numbered = list(zip(found, marks, strict=True))
    if len(numbered) > _NUMBERED:
        numbered = [(one, at) for one, at in numbered if one.complies]
    if len(numbered) <= _NUMBERED:
        canvas.labels([svg.DrawnLabel(at, (str(one.number),), within) for one, at in numbered])


# ---------------------------------------------------------------- resolution over time
def _resolutions(canvas: svg.Canvas, frame: svg.Box, passes: Passes) -> None:
    """Both resolutions of each pass over its mid-time, in equal ratios."""
    span = passes.stop.since(passes.start)
    across = svg.Scale(0.0, span, frame.left, frame.right)
    shown = [(one, both) for one in passes.found if (both := _sizes(one))]
    sizes = [size for _, both in shown for size in both]
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
    for one, (first, second) in shown:
        x = across.at(one.center.since(passes.start)) if one.center is not None else frame.left
        range_at, cross_at = (x, up.at(first)), (x, up.at(second))
        canvas.lines([(range_at, cross_at)], f"between is-{one.status}")
        canvas.circle(range_at, 3.6, f"open is-{one.status}")
        _square(canvas, cross_at, f"solid is-{one.status}")
    labelled = [one for one, _ in shown]
    tops = [(across.at((one.center or passes.start).since(passes.start)), up.at(max(both))) for one, both in shown]
    _numbers(canvas, labelled, tops, frame)


def _sizes(one: SatellitePass) -> tuple[float, float] | None:
    """Range and cross-range resolution; None where there is no image."""
    first, second = one.range_resolution, one.cross_range_resolution
    if first is None or second is None or not (math.isfinite(first) and math.isfinite(second)):
        return None
    return first, second


def _square(canvas: svg.Canvas, at: svg.Point, style: str) -> None:
    x, y = at
    canvas.polygon([(x - 3.2, y - 3.2), (x + 3.2, y - 3.2), (x + 3.2, y + 3.2), (x - 3.2, y + 3.2)], style)


def _dates(start: Instant, span: float, width: float) -> Iterator[tuple[float, str]]:
    """Times after the start that have room for a date, or an hour, and that."""
    hours = next((step for step in _STEPS if step * _HOUR * width >= span * _ROOM), _STEPS[-1])
    step = hours * _HOUR
    first = math.ceil(start.seconds / step - 1e-9) if hours <= 24 else int(start.seconds > 0) * 24 / hours
    time = first * step - start.seconds
    while time <= span * (1 + 1e-9):
        moment = start.after(time).as_datetime() + timedelta(milliseconds=1)
        is_midnight = abs((start.seconds + time) % DAY) < 1e-3 or hours >= 24
        yield time, moment.strftime("%m-%d") if is_midnight else moment.strftime("%H:%M")
        time += step
