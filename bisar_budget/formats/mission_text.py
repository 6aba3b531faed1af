"""The mission file of an imported collection: a tree of keys, and that tree with comments."""

import json
import math
from typing import Any

from bisar_budget.faults import printable
from bisar_budget.formats.collected import DeclaredMotionError, Imported, Track
from bisar_budget.geometry import FRAME_AXES, STRAIGHT, Vector

_WIDTH = 110
_KINDS = ("position", "velocity")


def mission_tree(imported: Imported) -> dict[str, Any]:
    """Return the keys of a mission with their values as a person writes them, and no comment."""
    tree: dict[str, Any] = {
        "schema_version": 1,
        "name": imported.name,
        "radar": {
            "center_frequency": _quantity(imported.center_frequency / 1e9, "GHz"),
            "bandwidth": _quantity(imported.bandwidth / 1e6, "MHz"),
        },
        "collection": {"aperture_time": _quantity(imported.aperture_time, "s")},
        "scene": {
            "latitude": _quantity(math.degrees(imported.scene.latitude), "deg", 12),
            "longitude": _quantity(math.degrees(imported.scene.longitude), "deg", 12),
            "height": _quantity(round(imported.scene.height, 6) + 0.0, "m"),
        },
        "platforms": {
            "transmitter": _platform(imported, imported.transmitter, imported.transmitter_error),
            "receiver": _platform(imported, imported.receiver, imported.receiver_error),
        },
    }
    if imported.center_time is not None:
        tree["collection"]["center_time"] = imported.center_time
    if imported.common_error is not None:
        tree["common_motion_error"] = _error(imported, imported.common_error)
        del tree["common_motion_error"]["frame"]
    timing = {"constant": imported.timing_constant, "linear": imported.timing_linear}
    declared = {
        key: _quantity(value, "s" if key == "constant" else "").strip()
        for key, value in timing.items()
        if value is not None
    }
    if declared:
        tree["timing_error"] = declared
    return tree


def mission_text(imported: Imported) -> str:
    """Return a mission file, with what the reader has to know in comments."""
    tree = mission_tree(imported)
    lines = [line for paragraph in _head(imported) for line in _comment(paragraph)]
    lines += [f"schema_version: {tree.pop('schema_version')}", f"name: {_text(tree.pop('name'))}"]
    notes = {
        ("scene",): "the scene's axes are east, north and up here, WGS-84",
        ("platforms", "transmitter"): _fit(imported.transmitter),
        ("platforms", "receiver"): _fit(imported.receiver),
    }
    _write(lines, tree, (), notes)
    return "\n".join(lines) + "\n"


def _head(imported: Imported) -> list[str]:
    channel = f", channel {printable(imported.channel)}" if imported.channel else ""
    head = [
        f"Imported by bisar-budget from {printable(imported.file)} ({imported.format}{channel}), whose XML has the "
        f"SHA-256 {imported.xml_sha256}.",
        "",
        "Slow time counts when a pulse is at the scene point, from the middle of the aperture there. A pulse leaves "
        "the transmitter before that by its light time, and reaches the receiver after it by its own: each path has "
        "the places of its platform at its own time, over that slow time. Velocities differ from those over the "
        "platform's own time by about 1 part in 100 000.",
        "Lengths are in metres of the scene's axes: x east, y north, z up of the scene point.",
    ]
    if imported.reference is not None:
        one = imported.reference
        head.append(
            f"At the file's reference vector (slow time {one.slow_time:.6f} s) the bistatic angle is "
            f"{math.degrees(one.bistatic_angle):.6f} deg, and the slant ranges are {one.transmitter_range:.1f} m "
            f"(transmitter) and {one.receiver_range:.1f} m (receiver)."
        )
    if imported.remarks:
        head += ["", *imported.remarks]
    return head


def _fit(track: Track) -> str:
    if not track.samples:
        return "as the file states it, a straight path"
    words = f"order {track.order} through {track.samples} places, at most {_small(track.farthest)} from them"
    return (
        words
        if track.order < 4 or track.farthest < 1e-3
        else f"{words}: what is left is faster than a mission states"
    )


def _small(length: float) -> str:
    return f"{length * 1e3:.3g} mm" if length < 1 else f"{length:.4g} m"


def _platform(imported: Imported, track: Track, error: DeclaredMotionError | None) -> dict[str, Any]:
    state = track.state
    platform: dict[str, Any] = {
        "position": _triple(state.position, "m", 6),
        "velocity": _triple(state.velocity, "m/s", 9),
    }
    if state.acceleration != STRAIGHT:
        platform["acceleration"] = _triple(state.acceleration, "m/s^2")
    for key, bend, factor in zip(("jerk", "snap"), state.bends, (6.0, 24.0), strict=False):
        unit = "m/s^3" if key == "jerk" else "m/s^4"
        platform[key] = _triple((bend[0] * factor, bend[1] * factor, bend[2] * factor), unit)
    if error is not None:
        platform["motion_error"] = _error(imported, error)
    return platform


def _error(imported: Imported, error: DeclaredMotionError) -> dict[str, Any]:
    units = {"position": "m", "velocity": "m/s"}
    stated: dict[str, Any] = {"frame": error.frame}
    sigmas = {kind: _triple(value, units[kind]) for kind in _KINDS if (value := getattr(error, kind)) is not None}
    if error.correlation:
        axes = [f"{kind}.{axis}" for kind in _KINDS for axis in FRAME_AXES[error.frame]]
        pairs = {
            f"{axes[i]}-{axes[j]}": f"{error.correlation[i][j]:.9f}".rstrip("0")
            for i in range(6)
            for j in range(i + 1, 6)
            if abs(error.correlation[i][j]) > 5e-10
        }
        stated["covariance"] = {**sigmas, "correlation": pairs}
    else:
        stated |= sigmas
    if error.acceleration is not None:
        stated["acceleration"] = _triple(error.acceleration, "m/s^2")
    if error.distribution != "normal":
        stated["distribution"] = error.distribution
    stated["source"] = f"{printable(imported.file)}, {imported.errors_at}, one sigma"
    return stated


def _quantity(value: float, unit: str, digits: int = 12) -> str:
    return f"{value:.{digits}g} {unit}"


def _triple(vector: Vector, unit: str, decimals: int | None = None) -> list[str]:
    if decimals is None:
        return [f"{value:.12g} {unit}" for value in vector]
    return [f"{_trimmed(f'{value:.{decimals}f}')} {unit}" for value in vector]


def _trimmed(text: str) -> str:
    text = text.rstrip("0").rstrip(".")
    return "0" if text in ("", "-0") else text


def _comment(paragraph: str) -> list[str]:
    """Lines of a comment; what a file says stays on them."""
    from textwrap import wrap

    return [f"# {line}".rstrip() for line in wrap(printable(paragraph), _WIDTH - 2) or [""]]


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _write(lines: list[str], tree: dict[str, Any], path: tuple[str, ...], notes: dict[tuple[str, ...], str]) -> None:
    indent = "  " * len(path)
    for key, value in tree.items():
        here = (*path, key)
        note = f" # {notes[here]}" if here in notes else ""
        if isinstance(value, dict):
            lines.append(f"{indent}{key}:{note}")
            _write(lines, value, here, notes)
        elif isinstance(value, list):
            lines.append(f"{indent}{key}: [{', '.join(value)}]{note}")
        elif key in ("source", "center_time"):
            lines.append(f"{indent}{key}: {_text(value)}{note}")
        else:
            lines.append(f"{indent}{key}: {value}{note}")
