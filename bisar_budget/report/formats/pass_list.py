"""Passes of a satellite as text for reading, as `passes/1`, CSV, and as events of a calendar (RFC 5545)."""

import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, date, datetime
from typing import Any

from bisar_budget import __version__
from bisar_budget.design.passes import Passes, SatellitePass
from bisar_budget.faults import printable
from bisar_budget.findings.requirement import NAMES
from bisar_budget.findings.status import STATUS
from bisar_budget.paths.instant import DAY, Instant
from bisar_budget.report import Style
from bisar_budget.report.formats.csv_table import csv_text
from bisar_budget.report.formats.json_document import document_text, outside_item
from bisar_budget.report.words.heading import overrides_words, title_lines
from bisar_budget.report.words.identity import digest
from bisar_budget.report.words.sentences import (
    percent,
    sentence,
    spaced,
    use_words,
    waived_count,
    waiver_names,
    wrapped,
)
from bisar_budget.units import format_quantity


# ---------------------------------------------------------------- for programs
def as_json(passes: Passes, style: Style) -> str:
    """Write the contract; values in SI and radians, null where there is none."""
    content = {
        "file": passes.file,
        "name": passes.name,
        "model": passes.model,
        "platform": passes.platform,
        "from": passes.start.as_text(),
        "until": passes.stop.as_text(),
        "min_elevation_rad": passes.min_elevation,
        "asked_squint_rad": passes.squint,
        **outside_item(passes),
        "without_orbit": [
            {
                "platform": one.platform,
                "from": one.start.as_text(),
                "until": one.stop.as_text(),
                "reason": one.reason,
            }
            for one in passes.unknown
        ],
        "summary": _summarized(passes),
        "passes": [_item(one) for one in passes.found],
    }
    return document_text("bisar-budget/passes/1", content)


def _summarized(passes: Passes) -> dict[str, int]:
    """Number of passes that comply, that are waived, and that do neither."""
    counts = passes.counts
    return {
        "comply": len(passes.complying),
        "waived": counts["waived"],
        "fail": counts["fail"],
        "not_evaluated": counts["not_evaluated"],
        "without_mission": counts["error"],
    }


def _item(one: SatellitePass) -> dict[str, Any]:
    """Values of a pass, by the keys of JSON and CSV."""
    state = one.state
    found: dict[str, Any] = {
        "number": one.number,
        "status": one.status,
        "center_time": None if one.center is None else one.center.as_text(),
        "rise_time": one.start.as_text() if one.rises else None,
        "set_time": one.stop.as_text() if one.sets else None,
        "start_time": one.start.as_text(),
        "stop_time": one.stop.as_text(),
        "culmination_time": one.culmination.as_text(),
        "max_elevation_rad": one.max_elevation,
        "elevation_rad": None if state is None else state.elevation,
        "azimuth_rad": None if state is None else state.azimuth,
        "bearing_rad": one.bearing,
        "slant_range_m": None if state is None else state.slant_range,
        "side": one.side or None,
        "direction": None if state is None else direction(one),
        "squint_rad": None if state is None else state.squint,
        "bistatic_angle_rad": one.bistatic_angle,
        "gradient_angle_rad": one.gradient_angle,
        "range_resolution_m": one.range_resolution,
        "cross_range_resolution_m": one.cross_range_resolution,
        "doubt_m": one.doubt,
        "requirement": one.requirement,
        "row": one.row,
        "utilization": one.utilization,
        "reason": one.reason or None,
        "waived_by": list(one.waived_by),
    }
    return {key: None if isinstance(one, float) and not math.isfinite(one) else one for key, one in found.items()}


def direction(one: SatellitePass) -> str:
    """Direction of the satellite along its orbit, towards north or south."""
    return "ascending" if one.is_ascending else "descending"


def as_csv(passes: Passes, style: Style) -> str:
    """Write a line for each pass, values in SI and radians, empty where there is none."""
    whose = [passes.file, passes.name, passes.platform]
    outside = overrides_words(passes) or None
    lines: list[list[object]] = [["file", "name", "platform", *_item(_NO_PASS), "overrides"]]
    for one in passes.found:
        values = _item(one) | {"waived_by": "; ".join(one.waived_by) or None}
        lines.append([*whose, *values.values(), outside])
    return csv_text(lines)


_NOWHEN = Instant(0, 0.0)
_NO_PASS = SatellitePass(0, _NOWHEN, _NOWHEN, False, False, _NOWHEN, 0.0, ())  # type: ignore[arg-type]


# ---------------------------------------------------------------- for a terminal
_HEADS = (
    ("status", "", "<"),
    ("#", "", ">"),
    ("mid-time [UTC]", "", "<"),
    ("above", "min", ">"),
    ("elev", "deg", ">"),
    ("from", "deg", ">"),
    ("looks", "", "<"),
    ("", "", "<"),
    ("bist", "deg", ">"),
    ("grad", "deg", ">"),
    ("resolution", "m", ">"),
    ("doubt", "", ">"),
    ("use", "", ">"),
)
_WAIVERS = ("waived by", "", "<")  # a column where any pass is waived


def as_text(passes: Passes, style: Style) -> str:
    """Write lines for a person: how many comply, a table of at most 100 columns and waivers, and what decides."""
    return "\n".join(_lines(passes, style)) + "\n"


def verdict(passes: Passes) -> str:
    """How many passes comply, of how many, when and above what; those that are waived are counted apart."""
    count = len(passes.found)
    comply = len(passes.complying)
    if not count:
        said = "no pass"
    elif passes.counts["waived"]:
        said = ", ".join(_counted(passes))
    elif count == 1:
        said = f"one pass, which {'complies' if comply else 'does not comply'}"
    elif comply == count:
        said = f"all {count} passes comply"
    else:
        said = f"{comply or 'none'} of {count} passes {'complies' if comply == 1 else 'comply'}"
    squint = f"squint {math.degrees(passes.squint):.4g} deg" if passes.squint else "broadside"
    return (
        f"{said}: {passes.platform} above {math.degrees(passes.min_elevation):.4g} deg and at {squint}, "
        f"{short_time(passes.start)} to {short_time(passes.stop)}"
    )


def _counted(passes: Passes) -> Iterator[str]:
    """Numbers of passes by how they stand; what occurs nowhere is said of those that fail alone."""
    counts = passes.counts
    count = len(passes.found)
    yield f"{count} pass{'es' if count > 1 else ''}: {len(passes.complying)} comply"
    yield waived_count(counts["waived"], passes.waived_by)
    yield f"{counts['fail']} fail"
    for name, words in (("not_evaluated", "not evaluated"), ("error", "without a mission")):
        if counts[name]:
            yield f"{counts[name]} {words}"


def short_time(instant: Instant) -> str:
    """An instant to a minute, such as 2026-07-01 00:00."""
    return _seconds(Instant(instant.day, instant.seconds - instant.seconds % 60))[:16]


def _seconds(instant: Instant) -> str:
    """An instant to a second, such as 2026-07-01 05:30:12."""
    rounded = Instant(instant.day, 0.0).after(math.floor(instant.seconds + 0.5))
    return rounded.as_text()[:19].replace("T", " ")


def _lines(passes: Passes, style: Style) -> Iterator[str]:
    sgr = "32" if passes.complying else STATUS["waived"].sgr if passes.accepted else "1;31"
    yield from title_lines(passes, verdict(passes), sgr, style, remark=f"; {passes.model} model")
    if passes.found:
        yield from _table(passes.found, style)
        yield ""
    for text in _notes(passes):
        yield from wrapped(text, "  ")


def _table(found: Sequence[SatellitePass], style: Style) -> Iterator[str]:
    columns = (*_HEADS, _WAIVERS) if any(one.waived_by for one in found) else _HEADS
    cells = [_cells(one)[: len(columns)] for one in found]
    heads = [tuple(head[place] for head in columns) for place in (0, 1)]
    widths = [max(len(row[column]) for row in (*heads, *cells)) for column in range(len(columns))]
    widths[0] = 8  # as in every table
    sides = "".join(head[2] for head in columns)
    for head in heads:
        yield spaced(head, widths, sides).rstrip()
    for one, row in zip(found, cells, strict=True):
        line = spaced(row, widths, sides).rstrip()
        yield style.coloured(line[:8], STATUS[one.status].sgr) + line[8:]


def _cells(one: SatellitePass) -> tuple[str, ...]:
    state, minutes = one.state, one.stop.since(one.start) / 60
    sizes = (one.range_resolution, one.cross_range_resolution)
    return (
        STATUS[one.status].text,
        str(one.number),
        _seconds(one.center) if one.center is not None else f"{_seconds(one.culmination)}*",
        f"{minutes:.1f}" if minutes < 1000 else f"{minutes:.0f}",
        f"{_degrees(None if state is None else state.elevation)}/{_degrees(one.max_elevation)}",
        _degrees(one.bearing),
        one.side or "-",
        "-" if state is None else "asc" if one.is_ascending else "desc",
        _degrees(one.bistatic_angle, 1),
        _degrees(one.gradient_angle, 1),
        " x ".join(map(_metres, sizes)) if None not in sizes else "-",
        "-" if one.doubt is None else format_quantity(one.doubt, "m"),
        use_words(one.utilization),
        ", ".join(map(printable, one.waived_by)),
    )


def _metres(size: float | None) -> str:
    """Three digits, without a power of ten."""
    return "-" if size is None else f"{size:.3g}" if size < 999.5 else f"{size:.0f}"


def _degrees(angle: float | None, digits: int = 0) -> str:
    return "-" if angle is None else f"{math.degrees(angle):.{digits}f}"


def _notes(passes: Passes) -> Iterator[str]:
    """Notes below the passes: the deciding rows, once for all that share one, cuts, and unknowns."""
    for text, numbers in _grouped(passes.found, _decided):
        yield f"{sentence(text)}: {numbers}."
    for text, numbers in _grouped(passes.found, lambda one: one.reason and _figureless(one)):
        first = next(one for one in passes.found if one.reason and _figureless(one) == text)
        of_first = f" (numbers of {first.number})" if first.reason != text and not numbers.isdecimal() else ""
        yield f"{STATUS[first.status].text} {numbers}: {printable(first.reason)}{of_first}."
    if any(one.center is None for one in passes.found):
        yield "* of the culmination: there is no mid-time."
    for numbers, where in (
        (_numbers(one.number for one in passes.found if not one.rises), "Began before what was looked at"),
        (_numbers(one.number for one in passes.found if not one.sets), "Goes on after what was looked at"),
    ):
        if numbers:
            yield f"{where}: {numbers}."
    for gap in passes.unknown:
        yield (
            f"No orbit of the {gap.platform} {short_time(gap.start)} to {short_time(gap.stop)}: "
            f"{printable(gap.reason)}."
        )
    if passes.found:
        yield (
            "above: minutes above the least elevation; elev: elevation at the mid-time, and at most; from: bearing "
            "from north, clockwise; bist, grad: bistatic angle, angle between range and Doppler gradients; "
            "resolution: range x cross range, peak to null, on the ground; doubt: how far the satellite may be off; "
            "use: of what the requirement that decides allows."
        )


def _decided(one: SatellitePass) -> str:
    if one.requirement is None:
        return ""
    name = NAMES.get(one.requirement, one.requirement.replace("_", " "))
    waived = f", not met but waived ({waiver_names(one.waived_by)})" if one.waived_by else ""
    return f"{name} decides" + (f", by {printable(one.row)}" if one.row else "") + waived


def _figureless(one: SatellitePass) -> str:
    """The kind of a reason: its words without their numbers."""
    return f"{one.status} {re.sub(r'-?[0-9][0-9.]*', '#', one.reason)}"


def _grouped(found: Sequence[SatellitePass], said: Callable[[SatellitePass], str]) -> Iterator[tuple[str, str]]:
    """Sentences about passes, each with the numbers of its passes."""
    groups: dict[str, list[int]] = {}
    for one in found:
        if text := said(one):
            groups.setdefault(text, []).append(one.number)
    for text, numbers in groups.items():
        yield text, _numbers(numbers)


def _numbers(numbers: Any) -> str:
    """Numbers as 1, 3 to 5; empty where there is none."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    said = (str(run[0]) if len(run) == 1 else f"{run[0]}{', ' if len(run) == 2 else ' to '}{run[-1]}" for run in runs)
    return ", ".join(said)


# ---------------------------------------------------------------- for a calendar
_HALF_HOUR = 1800.0  # s; no satellite passes twice in it, and newer elements move no pass by as much
_OCTETS = 75  # of a line, its end not counted


def as_ics(passes: Passes, stamp: date) -> str:
    """Write an event for each pass (RFC 5545), made on the day `stamp` of UTC.

    Lines end with a line feed, in whose place a calendar has CR and LF. An event keeps its UID with newer elements,
    as long as the pass stays in its half hour.
    """
    lines = ["BEGIN:VCALENDAR", "VERSION:2.0", f"PRODID:-//bisar-budget//passes {__version__}//EN"]
    seen: Counter[str] = Counter()
    made = _stamp(datetime(stamp.year, stamp.month, stamp.day, tzinfo=UTC))
    for one in passes.found:
        half_hours = math.floor((one.culmination.day * DAY + one.culmination.seconds) / _HALF_HOUR)
        uid = digest(passes.name, passes.platform, str(half_hours))[:32]
        seen[uid] += 1
        lines += [
            "BEGIN:VEVENT",
            f"UID:{uid}{f'-{seen[uid]}' if seen[uid] > 1 else ''}@bisar-budget",
            f"DTSTAMP:{made}",
            f"DTSTART:{_stamp(Instant(one.start.day, math.floor(one.start.seconds)).as_datetime())}",
            f"DTEND:{_stamp(Instant(one.stop.day, math.floor(one.stop.seconds) + 1.0).as_datetime())}",
            *_folded(f"SUMMARY:{_escaped(_summary(one, passes))}"),
            *_folded(f"DESCRIPTION:{_escaped(chr(10).join(_description(one, passes)))}"),
            f"CATEGORIES:{_escaped(STATUS[one.status].words)}",
            "TRANSP:TRANSPARENT",
            "END:VEVENT",
        ]
    lines.append("END:VCALENDAR")
    return "".join(f"{line}\n" for line in lines)


def _stamp(moment: datetime) -> str:
    return moment.strftime("%Y%m%dT%H%M%SZ")


def _summary(one: SatellitePass, passes: Passes) -> str:
    return f"{STATUS[one.status].text}: pass {one.number} of {printable(passes.name)}"


def _description(one: SatellitePass, passes: Passes) -> Iterator[str]:
    """Facts about a pass, a line each."""
    yield f"{printable(passes.file)}, {passes.platform}, {passes.model} model"
    state = one.state
    if one.center is not None and state is not None:
        yield f"Mid-time {one.center.as_text()}"
        yield (
            f"Elevation {_degrees(state.elevation, 1)} deg from {_degrees(one.bearing)} deg (north, clockwise), "
            f"{format_quantity(state.slant_range, 'm')} away"
        )
        yield f"{sentence(direction(one))}, looks {one.side}"
    yield f"Highest {_degrees(one.max_elevation, 1)} deg at {one.culmination.as_text()}"
    if one.bistatic_angle is not None:
        yield (
            f"Bistatic angle {_degrees(one.bistatic_angle, 1)} deg, gradients {_degrees(one.gradient_angle, 1)} deg "
            "apart"
        )
        sizes = (format_quantity(size or 0.0, "m") for size in (one.range_resolution, one.cross_range_resolution))
        yield "Resolution {} range, {} cross range".format(*sizes)
    if one.doubt is not None:
        yield f"The satellite may be {format_quantity(one.doubt, 'm')} off"
    if said := _decided(one):
        use = "" if one.utilization is None else f", {percent(one.utilization)} used"
        yield f"{sentence(said)}{use}"
    if one.reason:
        yield sentence(printable(one.reason))
    if outside := overrides_words(passes):
        yield f"Overrides: {outside}"


def _escaped(text: str) -> str:
    """Text of RFC 5545, 3.3.11: a backslash before what separates."""
    text = text.replace("\\", "\\\\").replace(";", "\\;").replace(",", "\\,").replace("\n", "\\n")
    return text.encode("utf-8", "backslashreplace").decode()


def _folded(line: str) -> Iterator[str]:
    """Lines of at most 75 octets, of which all but the first begin with a space; no character is cut.

    None goes on with a colon, and two `#` stand on two lines: a log takes either for a command.
    """
    start, size = 0, 0
    for place, letter in enumerate(line):
        octets = len(letter.encode())
        is_command = letter == line[place - 1 : place] == "#"
        if is_command or size + octets > _OCTETS - 1:
            cut = place
            while line[cut] == ":" and cut > start + 1:
                cut -= 1
            cut = cut if cut > start + 1 else place  # colons alone
            yield f"{' ' if start else ''}{line[start:cut]}"
            start, size = cut, len(line[cut:place].encode())
        size += octets
    yield f"{' ' if start else ''}{line[start:]}"
