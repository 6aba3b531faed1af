"""Draw images with an error at its limit: cross-range cuts as SVG, chips (small images) as PNG, and captions."""

import struct
import zlib
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from bisar_budget.findings.images import CHIP_FLOOR_DB, ImageEvidence, PointImage, Verdict
from bisar_budget.report.drawing import svg
from bisar_budget.units import format_limit, format_quantity

_CUTS_WIDTH_PX, _CUTS_HEIGHT_PX = 520.0, 190.0  # of the drawing and of one panel
_CUTS_LEFT_PX, _CUTS_EDGE_PX, _CUTS_TITLE_PX = 46.0, 8.0, 22.0  # beside and above a panel
WITHOUT_ERROR, WITH_ERRORS, FOCUSED = "line dotted", "line receiver dashed", "line transmitter"  # styles


class Curve(NamedTuple):
    """A cross-range cut along y′: positions [m], levels relative to the error-free peak [dB], and the line style."""

    name: str
    positions: Sequence[float]
    levels_db: Sequence[float]
    style: str


def impulse_response_cuts(evidence: ImageEvidence) -> str:
    """Draw cross-range cuts as SVG: with an error at its limit, and without the error.

    Cuts after autofocus are in a second panel.
    """
    verdict = evidence.verdict
    canvas = svg.Canvas()
    at_limit = evidence.at_limit
    curves = [
        _curve("at the limit", at_limit.cut_db, at_limit.step_m, FOCUSED),
        _curve(
            "without error", at_limit.error_free_db, at_limit.step_m, WITHOUT_ERROR
        ),  # last, so that no line covers it
    ]
    bottom = cut_panel(canvas, 0.0, _CUTS_WIDTH_PX, _CUTS_HEIGHT_PX, _at_limit(verdict), curves)
    before, after = evidence.before_autofocus, evidence.after_autofocus
    if before and after:
        curves = [
            _curve("before autofocus", before.cut_db, before.step_m, WITH_ERRORS),
            _curve("after", after.cut_db, after.step_m, FOCUSED),
            _curve("without error", before.error_free_db, before.step_m, WITHOUT_ERROR),
        ]
        bottom = cut_panel(canvas, bottom + 8, _CUTS_WIDTH_PX, _CUTS_HEIGHT_PX, _with_autofocus(verdict), curves)
    description = (
        "Power along y′, across the bistatic look direction, over the peak of the response without error. "
        + " ".join(numbers_in_words(evidence))
    )
    key = f"cuts {evidence.file} {verdict.id}"
    return canvas.document((_CUTS_WIDTH_PX, bottom + 4), key, f"Cross-range cuts: {verdict.id}", description)


def _curve(name: str, levels: Sequence[float], step_m: float, style: str) -> Curve:
    middle = len(levels) // 2
    return Curve(name, [(index - middle) * step_m for index in range(len(levels))], levels, style)


def numbers_in_words(evidence: ImageEvidence) -> Iterator[str]:
    """Yield sentences with the predicted and the measured values at a limit, and the values after autofocus."""
    verdict = evidence.verdict
    yield f"{_at_limit(verdict)}."
    measures = (
        ("peak {} dB", None if verdict.peak_loss_db is None else f"{-verdict.peak_loss_db:+.2f}"),
        ("width {} times that without error", None if verdict.irw_ratio is None else f"{verdict.irw_ratio:.3f}"),
        ("PSLR {} dB", None if verdict.pslr_db is None else f"{verdict.pslr_db:.1f}"),
        ("ISLR {} dB", None if verdict.islr_db is None else f"{verdict.islr_db:.1f}"),
    )
    measured = [words.format(value.replace("-", "−")) for words, value in measures if value is not None]
    if measured:
        yield f"Measured: {', '.join(measured)}."
    if evidence.after_autofocus:
        yield f"{_with_autofocus(verdict)}."


def chip_png(image: PointImage) -> bytes:
    """Write a chip (small image) as an 8-bit grey PNG with x′ to the right and y′ up.

    Black is 40 dB below the error-free peak. The data are stored without compression, so that the bytes do not depend
    on a compression library.
    """
    lines = (image.chip[row * image.columns : (row + 1) * image.columns] for row in range(image.rows))
    header = struct.pack(">IIBBBBB", image.columns, image.rows, 8, 0, 0, 0, 0)
    data = b"".join(b"\0" + line for line in lines)  # filter 0: none
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        _chunk(kind, content)
        for kind, content in ((b"IHDR", header), (b"IDAT", zlib.compress(data, 0)), (b"IEND", b""))
    )


def chip_caption(image: PointImage) -> str:
    """Text about the size, orientation and grey scale of a chip (small image)."""
    along, across = (format_quantity(side, "m") for side in image.extent_m)
    return (
        f"{along} along x′ (look, to the right) by {across} along y′ (cross-range, up); "
        f"{svg.axis_number(CHIP_FLOOR_DB)} dB (black) to 0 dB (white) of the peak without error"
    )


def chip_size(image: PointImage, pixels_per_sample: int = 3) -> tuple[int, int]:
    """Width and height at which a chip (small image) is shown, so that its resolution cells are square. [px]

    A chip drawn to scale would be a narrow strip, because a cell may be ten times as long as it is wide.
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
    """Draw cross-range cuts on a panel with a title; return the y coordinate of the bottom of the panel. [px]"""
    frame = svg.Box(_CUTS_LEFT_PX, top + _CUTS_TITLE_PX, width - _CUTS_EDGE_PX, top + _CUTS_TITLE_PX + height)
    positions = [position for curve in curves for position in curve.positions]
    across = svg.Scale(min(positions), max(positions), frame.left, frame.right)
    up = svg.Scale(CHIP_FLOOR_DB, max(0.0, *(max(curve.levels_db) for curve in curves)), frame.bottom, frame.top)
    canvas.text((frame.left, top + 14), [title], "small")
    svg.outline(canvas, frame, "grid")
    svg.grid(canvas, frame, across, up)
    svg.y_axis(canvas, frame, up, "power [dB]")
    bottom = svg.x_axis(canvas, frame, across, "cross-range position y′ [m]")
    for curve in curves:
        points = [
            (across.at(position), up.at(level))
            for position, level in zip(curve.positions, curve.levels_db, strict=True)
        ]
        canvas.polyline(points, curve.style, frame)
    return svg.legend(canvas, bottom, width, [svg.line_entry(canvas, curve.name, curve.style) for curve in curves])
