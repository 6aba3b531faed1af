"""What images say of a limit, to be looked at: cuts as SVG, chips as PNG, and the words that go with them."""

import struct
import zlib
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from bisar_budget.findings.images import FLOOR_DB, ImageEvidence, PointImage, Verdict
from bisar_budget.report.drawing.axes import axis_number, round_step, ticks
from bisar_budget.report.drawing.svg import Box, Canvas, Point
from bisar_budget.units import format_limit, format_quantity

_WIDTH, _HEIGHT = 520.0, 190.0  # px, of the drawing and of one panel
_AXIS, _EDGE = (46.0, 34.0), 8.0  # px, beside and below a panel for its axes; elsewhere
_KEY = 40.0  # px above a panel, for its title and its curves' names
_TOP_DB, _STEP_DB = 0.0, 10.0


class _DrawnCurve(NamedTuple):
    name: str
    levels: tuple[float, ...]
    style: str


def impulse_response_cuts(evidence: ImageEvidence) -> str:
    """Draw the cross-range cuts of a row at its limit over the error-free one, with autofocus in a second panel.

    Parameters
    ----------
    evidence : ImageEvidence
        Of one row.

    Returns
    -------
    str
        An SVG document, to be inlined or to be a file of its own.
    """
    verdict = evidence.verdict
    canvas = Canvas()
    at_limit = evidence.at_limit
    curves = [
        _DrawnCurve("at the limit", at_limit.cut_db, "line transmitter"),
        _DrawnCurve("without error", at_limit.error_free_db, "line dotted"),  # last, so that none covers it
    ]
    bottom = _panel(canvas, 0.0, at_limit.step_m, _at_limit(verdict), curves)
    before, after = evidence.before_autofocus, evidence.after_autofocus
    if before and after:
        curves = [
            _DrawnCurve("before autofocus", before.cut_db, "line receiver dashed"),
            _DrawnCurve("after", after.cut_db, "line transmitter"),
            _DrawnCurve("without error", before.error_free_db, "line dotted"),
        ]
        bottom = _panel(canvas, bottom + 12, before.step_m, _with_autofocus(verdict), curves)
    description = (
        "Power along y′, across the bistatic look direction, over the peak of the response without error. "
        + " ".join(numbers_in_words(evidence))
    )
    key = f"cuts {evidence.file} {verdict.id}"
    return canvas.document((_WIDTH, bottom + 4), key, f"Cross-range cuts: {verdict.id}", description)


def numbers_in_words(evidence: ImageEvidence) -> Iterator[str]:
    """Say what was predicted and what the images show, a sentence for each limit."""
    verdict = evidence.verdict
    yield f"{_at_limit(verdict)}."
    measures = (
        ("peak {} dB", None if verdict.peak_loss_db is None else f"{-verdict.peak_loss_db:+.2f}"),
        ("width {} times that without error", None if verdict.irw_ratio is None else f"{verdict.irw_ratio:.3f}"),
        ("PSLR {} dB", None if verdict.pslr_db is None else f"{verdict.pslr_db:.1f}"),
        ("ISLR {} dB", None if verdict.islr_db is None else f"{verdict.islr_db:.1f}"),
    )
    known = [words.format(value.replace("-", "−")) for words, value in measures if value is not None]
    if known:
        yield f"Measured: {', '.join(known)}."
    if evidence.after_autofocus:
        yield f"{_with_autofocus(verdict)}."


def chip_png(image: PointImage) -> bytes:
    """Write a chip as an 8-bit grey PNG, x′ to the right and y′ up, black at −40 dB of the error-free peak.

    The bytes do not depend on a compression library: the data is stored as it is.
    """
    lines = (image.chip[row * image.columns : (row + 1) * image.columns] for row in range(image.rows))
    header = struct.pack(">IIBBBBB", image.columns, image.rows, 8, 0, 0, 0, 0)
    data = b"".join(b"\0" + line for line in lines)  # filter 0: none
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        _chunk(kind, content)
        for kind, content in ((b"IHDR", header), (b"IDAT", zlib.compress(data, 0)), (b"IEND", b""))
    )


def chip_caption(image: PointImage) -> str:
    """Say size, orientation and grey scale of a chip."""
    along, across = (format_quantity(side, "m") for side in image.extent_m)
    return (
        f"{along} along x′ (look, to the right) by {across} along y′ (cross-range, up); "
        f"{axis_number(FLOOR_DB)} dB (black) to 0 dB (white) of the peak without error"
    )


def chip_size(image: PointImage, pixels_per_sample: int = 3) -> tuple[int, int]:
    """Width and height on a page that show resolution cells as squares. [px]

    In metres a cell may be ten times as long as it is wide, and a chip to scale a mere strip.
    """
    return image.columns * pixels_per_sample, image.rows * image.thinned * pixels_per_sample


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def _at_limit(verdict: Verdict) -> str:
    limit = format_limit(verdict.boundary_error, verdict.unit)
    return (
        f"At the limit, {limit}: predicted {_phase(verdict.predicted_qpe_rad)}, measured "
        f"{_phase(verdict.measured_qpe_rad)}, budget {format_limit(verdict.budget_rad or 0.0, 'rad')}"
    )


def _with_autofocus(verdict: Verdict) -> str:
    limit = format_limit(verdict.boundary_autofocus or 0.0, verdict.unit)
    return (
        f"At the limit with autofocus, {limit}: {_phase(verdict.measured_residual_qpe_rad)} left, "
        f"budget {format_limit(verdict.budget_rad or 0.0, 'rad')}"
    )


def _phase(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.3f} rad"


def _panel(canvas: Canvas, top: float, step_m: float, title: str, curves: Sequence[_DrawnCurve]) -> float:
    """Draw one panel, its title and key above, and return where it ends. [px]"""
    frame = Box(_AXIS[0], top + _KEY, _WIDTH - _EDGE, top + _KEY + _HEIGHT)
    half = (len(curves[0].levels) // 2) * step_m
    width, height = frame.right - frame.left, frame.bottom - frame.top

    def pixel(place: float, level: float) -> Point:
        return (
            frame.left + (place + half) / (2 * half) * width,
            frame.top + (_TOP_DB - level) / (_TOP_DB - FLOOR_DB) * height,
        )

    canvas.text((frame.left, top + 14), [title], "small")
    _key(canvas, (frame.left, top + 30), curves)
    for value in ticks(-half, half, round_step(2 * half * 64 / width)):
        x, _ = pixel(value, 0.0)
        canvas.polyline([(x, frame.top), (x, frame.bottom)], "grid")
        canvas.text((x, frame.bottom + 13), [axis_number(value)], "axis", "middle")
    for level in ticks(FLOOR_DB, _TOP_DB, _STEP_DB):
        _, y = pixel(0.0, level)
        canvas.polyline([(frame.left, y), (frame.right, y)], "grid")
        canvas.text((frame.left - 5, y + 3.5), [axis_number(level)], "axis", "end")
    canvas.text(((frame.left + frame.right) / 2, frame.bottom + 28), ["y′ [m]"], "axis", "middle")
    canvas.upright_text((11, (frame.top + frame.bottom) / 2), "power [dB]", "axis")
    for curve in curves:
        middle = len(curve.levels) // 2
        points = [pixel((index - middle) * step_m, level) for index, level in enumerate(curve.levels)]
        canvas.polyline(points, curve.style, frame)
    return frame.bottom + _AXIS[1]


def _key(canvas: Canvas, at: Point, curves: Sequence[_DrawnCurve]) -> None:
    x, y = at
    for curve in curves:
        canvas.polyline([(x, y - 4), (x + 28, y - 4)], curve.style)
        canvas.text((x + 33, y), [curve.name], "small")
        x += 150
