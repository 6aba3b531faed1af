"""Output of the `passes` command: the passes of a satellite as a report or as a calendar (RFC 5545)."""

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from datetime import UTC, datetime

from bisar_budget import __version__
from bisar_budget.faults import printable
from bisar_budget.findings.requirement import REQUIREMENT_NAMES
from bisar_budget.findings.satellite_passes import Passes, SatellitePass
from bisar_budget.findings.status import STATUS
from bisar_budget.paths.instant import DAY_S, Instant
from bisar_budget.report import Style
from bisar_budget.report import document as doc
from bisar_budget.report.answers import Records
from bisar_budget.report.answers.check_content import outside_item
from bisar_budget.report.answers.shared_blocks import mission_chapter, mission_document, opening
from bisar_budget.report.drawing.sky_plot import sky_plot
from bisar_budget.report.words.heading import overrides_words
from bisar_budget.report.words.identity import digest
from bisar_budget.report.words.sentences import (
    percent,
    sentence,
    use_words,
    waived_count,
    waiver_names,
)
from bisar_budget.units import format_quantity


# ---------------------------------------------------------------- for programs
def content(answers: Sequence[Passes]) -> dict[str, object]:
    """Content of the JSON document `passes/1`, in SI units and radians; a missing value is null."""
    (passes,) = answers
    return {
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
                "platform": gap.platform,
                "from": gap.start.as_text(),
                "until": gap.stop.as_text(),
                "reason": gap.reason,
            }
            for gap in passes.unknown
        ],
        "summary": _summarized(passes),
        "passes": [_item(overpass) for overpass in passes.found],
    }


def _summarized(passes: Passes) -> dict[str, int]:
    """Number of passes with each outcome: compliant, waived, failed, not evaluated, or without a valid mission."""
    counts = passes.counts
    return {
        "comply": len(passes.complying),
        "waived": counts["waived"],
        "fail": counts["fail"],
        "not_evaluated": counts["not_evaluated"],
        "without_mission": counts["error"],
    }


def _item(overpass: SatellitePass) -> dict[str, object]:
    """Values that describe a pass, by the keys of the JSON document, which are also the names of the CSV columns."""
    state = overpass.state
    values: dict[str, object] = {
        "number": overpass.number,
        "status": overpass.status,
        "center_time": None if overpass.center is None else overpass.center.as_text(),
        "rise_time": overpass.start.as_text() if overpass.rises else None,
        "set_time": overpass.stop.as_text() if overpass.sets else None,
        "start_time": overpass.start.as_text(),
        "stop_time": overpass.stop.as_text(),
        "culmination_time": overpass.culmination.as_text(),
        "max_elevation_rad": overpass.max_elevation,
        "elevation_rad": None if state is None else state.elevation,
        "azimuth_rad": None if state is None else state.azimuth,
        "bearing_rad": overpass.bearing,
        "slant_range_m": None if state is None else state.slant_range,
        "side": overpass.side or None,
        "direction": None if state is None else direction(overpass),
        "squint_rad": None if state is None else state.squint,
        "bistatic_angle_rad": overpass.bistatic_angle,
        "gradient_angle_rad": overpass.gradient_angle,
        "range_resolution_m": overpass.range_resolution,
        "cross_range_resolution_m": overpass.cross_range_resolution,
        "doubt_m": overpass.doubt,
        "requirement": overpass.requirement,
        "row": overpass.row,
        "utilization": overpass.utilization,
        "reason": overpass.reason or None,
        "waived_by": list(overpass.waived_by),
    }
    return {
        key: None if isinstance(value, float) and not math.isfinite(value) else value for key, value in values.items()
    }


def direction(overpass: SatellitePass) -> str:
    """`ascending` if the satellite flies towards the north during a pass, `descending` if towards the south."""
    return "ascending" if overpass.is_ascending else "descending"


def records(answers: Sequence[Passes]) -> Records:
    """Table of the answers: one line for each pass, in SI units and radians."""
    lines = [
        {
            "file": passes.file,
            "name": passes.name,
            "platform": passes.platform,
            **_item(overpass),
            "waived_by": "; ".join(overpass.waived_by) or None,
            "overrides": overrides_words(passes) or None,
        }
        for passes in answers
        for overpass in passes.found
    ]
    return Records(("file", "name", "platform", *_item(_NO_PASS), "overrides"), lines)


_NOWHEN = Instant(0, 0.0)
_NO_PASS = SatellitePass(0, _NOWHEN, _NOWHEN, False, False, _NOWHEN, 0.0, ())  # type: ignore[arg-type]


# ---------------------------------------------------------------- for people
_HEADS = [
    doc.Head("status"),
    doc.Head("#", "number"),
    doc.Head("mid-time [UTC]"),
    doc.Head("above", "number", "min"),
    doc.Head("elev", "number", "deg"),
    doc.Head("from", "number", "deg"),
    doc.Head("looks"),
    doc.Head("flies"),
    doc.Head("bist", "number", "deg"),
    doc.Head("grad", "number", "deg"),
    doc.Head("resolution", "number", "m"),
    doc.Head("doubt", "number"),
    doc.Head("use", "number"),
]
_WAIVERS = doc.Head("waived by")  # column that is shown only if a pass is waived


def document(answers: Sequence[Passes], style: Style) -> doc.AnswerDocument:
    """Text of each answer: verdict, table of passes, sky plot, and notes that name the deciding rows.

    In a terminal, the table is at most 100 characters wide, not counting the column of waivers.
    """
    chapters = [mission_chapter(answer, number, _blocks(answer, number)) for number, answer in enumerate(answers, 1)]
    return mission_document("Passes", answers, chapters)


def verdict(passes: Passes) -> str:
    """Sentence with the number of passes that comply, the minimum elevation, the squint and the period.

    Waived passes are counted separately.
    """
    count = len(passes.found)
    comply = len(passes.complying)
    if not count:
        compliance = "no pass"
    elif passes.counts["waived"]:
        compliance = ", ".join(_counted(passes))
    elif count == 1:
        compliance = f"one pass, which {'complies' if comply else 'does not comply'}"
    elif comply == count:
        compliance = f"all {count} passes comply"
    else:
        compliance = f"{comply or 'none'} of {count} passes {'complies' if comply == 1 else 'comply'}"
    squint = f"squint {math.degrees(passes.squint):.4g} deg" if passes.squint else "broadside"
    return (
        f"{compliance}: {passes.platform} above {math.degrees(passes.min_elevation):.4g} deg and at {squint}, "
        f"{short_time(passes.start)} to {short_time(passes.stop)}"
    )


def _counted(passes: Passes) -> Iterator[str]:
    """Yield texts with the number of passes for each status.

    The numbers of passes that are not evaluated, or have no valid mission, are left out if they are zero.
    """
    counts = passes.counts
    count = len(passes.found)
    yield f"{count} pass{'es' if count > 1 else ''}: {len(passes.complying)} comply"
    yield waived_count(counts["waived"], passes.waived_by)
    yield f"{counts['fail']} fail"
    for name, words in (("not_evaluated", "not evaluated"), ("error", "without a mission")):
        if counts[name]:
            yield f"{counts[name]} {words}"


def short_time(instant: Instant) -> str:
    """Write an instant as text, rounded down to the minute, such as 2026-07-01 00:00."""
    return _seconds(Instant(instant.day, instant.seconds - instant.seconds % 60))[:16]


def _seconds(instant: Instant) -> str:
    """Write an instant as text, rounded to the nearest second, such as 2026-07-01 05:30:12."""
    rounded = Instant(instant.day, 0.0).after(math.floor(instant.seconds + 0.5))
    return rounded.as_text()[:19].replace("T", " ")


def _blocks(passes: Passes, number: int) -> Iterator[doc.Block]:
    status = "pass" if passes.complying else "waived" if passes.accepted else "fail"
    yield opening(passes, verdict(passes), status, f"{passes.model} model")
    if passes.found:
        is_waived = any(overpass.waived_by for overpass in passes.found)
        heads = [*_HEADS, _WAIVERS] if is_waived else _HEADS
        rows = [_cells(overpass)[: len(heads)] for overpass in passes.found]
        yield doc.TextTable("Passes", "Passes over the scene", heads, rows)
        title = f"Passes over the scene of {passes.name}"
        drawing = sky_plot(passes, title, verdict(passes))
        yield doc.Figure(f"{number}-sky.svg", f"mission-{number}", title, "Sky of the scene", drawing)
    if notes := list(_notes(passes)):
        yield doc.Items([[note] for note in notes])


def _cells(overpass: SatellitePass) -> doc.Line:
    state, minutes = overpass.state, overpass.stop.since(overpass.start) / 60
    sizes = (overpass.range_resolution, overpass.cross_range_resolution)
    return (
        doc.Badge(overpass.status),
        str(overpass.number),
        _seconds(overpass.center) if overpass.center is not None else f"{_seconds(overpass.culmination)}*",
        f"{minutes:.1f}" if minutes < 1000 else f"{minutes:.0f}",
        f"{_degrees(None if state is None else float(state.elevation))}/{_degrees(overpass.max_elevation)}",
        _degrees(overpass.bearing),
        overpass.side or "-",
        "-" if state is None else "asc" if overpass.is_ascending else "desc",
        _degrees(overpass.bistatic_angle, 1),
        _degrees(overpass.gradient_angle, 1),
        " x ".join(map(_metres, sizes)) if None not in sizes else "-",
        "-" if overpass.doubt is None else format_quantity(overpass.doubt, "m"),
        use_words(overpass.utilization),
        ", ".join(map(printable, overpass.waived_by)),
    )


def _metres(size: float | None) -> str:
    """Write a length [m] with three digits and without a power of ten; a dash for None."""
    return "-" if size is None else f"{size:.3g}" if size < 999.5 else f"{size:.0f}"


def _degrees(angle: float | None, digits: int = 0) -> str:
    return "-" if angle is None else f"{math.degrees(angle):.{digits}f}"


def _notes(passes: Passes) -> Iterator[str]:
    """Yield the notes below the table of passes.

    They state the deciding rows, the reasons, the passes that begin before or end after the period, and the times
    without an orbit. Passes with the same deciding row or reason share one note.
    """
    for text, numbers in _grouped(passes.found, _decided):
        yield f"{sentence(text)}: {numbers}."
    for text, numbers in _grouped(passes.found, lambda overpass: overpass.reason and _figureless(overpass)):
        first = next(overpass for overpass in passes.found if overpass.reason and _figureless(overpass) == text)
        of_first = f" (values of pass {first.number})" if first.reason != text and not numbers.isdecimal() else ""
        yield f"{STATUS[first.status].text} {numbers}: {printable(first.reason)}{of_first}."
    if any(overpass.center is None for overpass in passes.found):
        yield "* time of the culmination: no mid-time is known."
    for numbers, event in (
        (
            _numbers(overpass.number for overpass in passes.found if not overpass.rises),
            "Began before the period",
        ),
        (
            _numbers(overpass.number for overpass in passes.found if not overpass.sets),
            "Continues after the period",
        ),
    ):
        if numbers:
            yield f"{event}: {numbers}."
    for gap in passes.unknown:
        yield (
            f"No orbit of the {gap.platform} {short_time(gap.start)} to {short_time(gap.stop)}: "
            f"{printable(gap.reason)}."
        )
    if passes.found:
        yield (
            "above: minutes above the least elevation; elev: elevation at mid-time and maximum; from: bearing from "
            "north, clockwise; bist, grad: bistatic angle, angle between range and Doppler gradients; resolution: "
            "range x cross range, peak to null, on the ground; doubt: position uncertainty of the satellite; use: "
            "share of the limit of the deciding requirement."
        )


def _decided(overpass: SatellitePass) -> str:
    if overpass.requirement is None:
        return ""
    name = REQUIREMENT_NAMES.get(overpass.requirement, overpass.requirement.replace("_", " "))
    waived = f", not met but waived ({waiver_names(overpass.waived_by)})" if overpass.waived_by else ""
    return f"{name} decides" + (f", by {printable(overpass.row)}" if overpass.row else "") + waived


def _figureless(overpass: SatellitePass) -> str:
    """Text with the status and the reason of a pass, with every number in the reason replaced by `#`."""
    return f"{overpass.status} {re.sub(r'-?[0-9][0-9.]*', '#', overpass.reason)}"


def _grouped(
    overpasses: Sequence[SatellitePass], text_of: Callable[[SatellitePass], str]
) -> Iterator[tuple[str, str]]:
    """Yield each distinct text that `text_of` returns for passes, and the numbers of the passes with this text."""
    groups: dict[str, list[int]] = {}
    for overpass in overpasses:
        if text := text_of(overpass):
            groups.setdefault(text, []).append(overpass.number)
    for text, numbers in groups.items():
        yield text, _numbers(numbers)


def _numbers(numbers: Iterable[int]) -> str:
    """Write ascending numbers as text, such as "1, 3 to 5"; empty if there are no numbers."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    run_words = (
        str(run[0]) if len(run) == 1 else f"{run[0]}{', ' if len(run) == 2 else ' to '}{run[-1]}" for run in runs
    )
    return ", ".join(run_words)


# ---------------------------------------------------------------- for a calendar
_UID_PERIOD_S = 1800.0  # a satellite passes at most once within it, and newer elements move a pass by less
_MAX_LINE_BYTES = 75  # without the end of the line


def as_ics(answers: Sequence[Passes], style: Style) -> str:
    """Write a calendar (RFC 5545) with an event for each pass. The events are dated with the day of the check (UTC).

    Lines end with LF, which must be converted to CR LF in the file. If the culmination with newer orbital elements is
    still within the same half hour, the event keeps its UID.
    """
    lines = ["BEGIN:VCALENDAR", "VERSION:2.0", f"PRODID:-//bisar-budget//passes {__version__}//EN"]
    for passes in answers:
        lines += _events(passes)
    lines.append("END:VCALENDAR")
    return "".join(f"{line}\n" for line in lines)


def _events(passes: Passes) -> Iterator[str]:
    """Yield the lines of the calendar events, with one event for each pass."""
    seen: Counter[str] = Counter()
    timestamp = _stamp(datetime(passes.day.year, passes.day.month, passes.day.day, tzinfo=UTC))
    for overpass in passes.found:
        half_hours = math.floor((overpass.culmination.day * DAY_S + overpass.culmination.seconds) / _UID_PERIOD_S)
        start, stop = overpass.start, overpass.stop
        uid = digest(passes.name, passes.platform, str(half_hours))[:32]
        seen[uid] += 1
        yield "BEGIN:VEVENT"
        yield f"UID:{uid}{f'-{seen[uid]}' if seen[uid] > 1 else ''}@bisar-budget"
        yield f"DTSTAMP:{timestamp}"
        yield f"DTSTART:{_stamp(Instant(start.day, math.floor(start.seconds)).as_datetime())}"
        yield f"DTEND:{_stamp(Instant(stop.day, math.floor(stop.seconds) + 1.0).as_datetime())}"
        yield from _folded(f"SUMMARY:{_escaped(_summary(overpass, passes))}")
        yield from _folded(f"DESCRIPTION:{_escaped(chr(10).join(_description(overpass, passes)))}")
        yield f"CATEGORIES:{_escaped(STATUS[overpass.status].words)}"
        yield "TRANSP:TRANSPARENT"
        yield "END:VEVENT"


def _stamp(moment: datetime) -> str:
    return moment.strftime("%Y%m%dT%H%M%SZ")


def _summary(overpass: SatellitePass, passes: Passes) -> str:
    return f"{STATUS[overpass.status].text}: pass {overpass.number} of {printable(passes.name)}"


def _description(overpass: SatellitePass, passes: Passes) -> Iterator[str]:
    """Yield the lines that describe a pass in its calendar event, one fact per line."""
    yield f"{printable(passes.file)}, {passes.platform}, {passes.model} model"
    state = overpass.state
    if overpass.center is not None and state is not None:
        yield f"Mid-time {overpass.center.as_text()}"
        yield (
            f"Elevation {_degrees(float(state.elevation), 1)} deg from {_degrees(overpass.bearing)} deg "
            f"(north, clockwise), {format_quantity(float(state.slant_range), 'm')} away"
        )
        yield f"{sentence(direction(overpass))}, looks {overpass.side}"
    yield f"Highest {_degrees(overpass.max_elevation, 1)} deg at {overpass.culmination.as_text()}"
    if overpass.bistatic_angle is not None:
        yield (
            f"Bistatic angle {_degrees(overpass.bistatic_angle, 1)} deg, "
            f"gradients {_degrees(overpass.gradient_angle, 1)} deg apart"
        )
        sizes = (
            format_quantity(size or 0.0, "m") for size in (overpass.range_resolution, overpass.cross_range_resolution)
        )
        yield "Resolution {} range, {} cross range".format(*sizes)
    if overpass.doubt is not None:
        yield f"The satellite may be {format_quantity(overpass.doubt, 'm')} off"
    if decision := _decided(overpass):
        use = "" if overpass.utilization is None else f", {percent(overpass.utilization)} used"
        yield f"{sentence(decision)}{use}"
    if overpass.reason:
        yield sentence(printable(overpass.reason))
    if outside := overrides_words(passes):
        yield f"Overrides: {outside}"


def _escaped(text: str) -> str:
    """Escape text as required by RFC 5545, section 3.3.11, with a backslash before each separator."""
    text = text.replace("\\", "\\\\").replace(";", "\\;").replace(",", "\\,").replace("\n", "\\n")
    return text.encode("utf-8", "backslashreplace").decode()


def _folded(line: str) -> Iterator[str]:
    """Fold a line into lines of at most 75 bytes (RFC 5545). Every line after the first begins with a space.

    The bytes of a character stay on one line. A continued line never begins with a colon, and two adjacent `#` are
    put on different lines, so that CI logs do not mistake the text for a command.
    """
    start, size = 0, 0
    for index, letter in enumerate(line):
        octets = len(letter.encode())
        is_command = letter == line[index - 1 : index] == "#"
        if is_command or size + octets > _MAX_LINE_BYTES - 1:
            cut = index
            while line[cut] == ":" and cut > start + 1:
                cut -= 1
            cut = cut if cut > start + 1 else index  # the line consists of colons
            yield f"{' ' if start else ''}{line[start:cut]}"
            start, size = cut, len(line[cut:index].encode())
        size += octets
    yield f"{' ' if start else ''}{line[start:]}"
