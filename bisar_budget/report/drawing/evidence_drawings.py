"""Evidence of images about a limit, to be looked at: cuts as SVG, chips as PNG, and the words that go with them."""

import struct
import zlib
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from bisar_budget.findings.images import FLOOR_DB, ImageEvidence, PointImage, Verdict
from bisar_budget.report.drawing import svg
from bisar_budget.units import format_limit, format_quantity

_WIDTH, _HEIGHT = 520.0, 190.0  # px, of the drawing and of one panel
_LEFT, _EDGE, _TITLE = 46.0, 8.0, 22.0  # px beside and above a panel
WITHOUT_ERROR, WITH_ERRORS, FOCUSED = "line dotted", "line receiver dashed", "line transmitter"  # styles


class Curve(NamedTuple):
    """A cut along y′ [m], in dB of the peak without error, and how it is drawn."""

    name: str
    places: Sequence[float]
    levels: Sequence[float]
    style: str


def impulse_response_cuts(evidence: ImageEvidence) -> str:
    """Cross-range cuts of a row at its limit over the error-free one, with autofocus in a second panel, as SVG."""
    verdict = evidence.verdict
    canvas = svg.Canvas()
    at_limit = evidence.at_limit
    curves = [
        _curve("at the limit", at_limit.cut_db, at_limit.step_m, FOCUSED),
        _curve("without error", at_limit.error_free_db, at_limit.step_m, WITHOUT_ERROR),  # last: none covers it
    ]
    bottom = cut_panel(canvas, 0.0, _WIDTH, _HEIGHT, _at_limit(verdict), curves)
    before, after = evidence.before_autofocus, evidence.after_autofocus
    if before and after:
        curves = [
            _curve("before autofocus", before.cut_db, before.step_m, WITH_ERRORS),
            _curve("after", after.cut_db, after.step_m, FOCUSED),
            _curve("without error", before.error_free_db, before.step_m, WITHOUT_ERROR),
        ]
        bottom = cut_panel(canvas, bottom + 8, _WIDTH, _HEIGHT, _with_autofocus(verdict), curves)
    description = (
        "Power along y′, across the bistatic look direction, over the peak of the response without error. "
        + " ".join(numbers_in_words(evidence))
    )
    key = f"cuts {evidence.file} {verdict.id}"
    return canvas.document((_WIDTH, bottom + 4), key, f"Cross-range cuts: {verdict.id}", description)


def _curve(name: str, levels: Sequence[float], step_m: float, style: str) -> Curve:
    middle = len(levels) // 2
    return Curve(name, [(index - middle) * step_m for index in range(len(levels))], levels, style)


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
        f"{svg.axis_number(FLOOR_DB)} dB (black) to 0 dB (white) of the peak without error"
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
    predicted, measured = map(_phase, verdict.judged_phases_rad)
    return (
        f"At the limit, {limit}: predicted {predicted}, measured {measured}{verdict.of_equal_loss}, "
        f"budget {format_limit(verdict.budget_rad or 0.0, 'rad')}"
    )


def _with_autofocus(verdict: Verdict) -> str:
    limit = format_limit(verdict.boundary_autofocus or 0.0, verdict.unit)
    return (
        f"At the limit with autofocus, {limit}: {_phase(verdict.measured_residual_qpe_rad)} left, "
        f"budget {format_limit(verdict.budget_rad or 0.0, 'rad')}"
    )


def _phase(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.3f} rad"


def cut_panel(
    canvas: svg.Canvas, top: float, width: float, height: float, title: str, curves: Sequence[Curve]
) -> float:
    """Draw cuts on one panel, its title above, and return where it ends. [px]"""
    frame = svg.Box(_LEFT, top + _TITLE, width - _EDGE, top + _TITLE + height)
    places = [place for curve in curves for place in curve.places]
    across = svg.Scale(min(places), max(places), frame.left, frame.right)
    up = svg.Scale(FLOOR_DB, max(0.0, *(max(curve.levels) for curve in curves)), frame.bottom, frame.top)
    canvas.text((frame.left, top + 14), [title], "small")
    svg.outline(canvas, frame, "grid")
    svg.grid(canvas, frame, across, up)
    svg.y_axis(canvas, frame, up, "power [dB]")
    bottom = svg.x_axis(canvas, frame, across, "y′ [m]")
    for curve in curves:
        points = [(across.at(place), up.at(level)) for place, level in zip(curve.places, curve.levels, strict=True)]
        canvas.polyline(points, curve.style, frame)
    return svg.legend(canvas, bottom, width, [svg.line_entry(canvas, curve.name, curve.style) for curve in curves])
