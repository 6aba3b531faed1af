"""Orbit files of the Sentinels (EOF, Earth Explorer File): XML with a state vector every ten seconds.

Source: Sentinels POD service file format specification (GMES-GSEG-EOPG-FS-10-0075), and ESA's Earth Observation
mission file format standard (PE-TN-ESA-GS-0001). State vectors are of the axes of ITRF, their velocities those over
the turning ground.
"""

from collections.abc import Iterator
from itertools import pairwise

from bisar_budget.faults import shown
from bisar_budget.paths.accuracy import StatedAccuracy
from bisar_budget.paths.ephemeris import (
    APART,
    OWN_VELOCITY,
    SPARSE_S,
    Interpolation,
    Segment,
    every,
    orbit_through,
    usual_step,
    velocity_off,
)
from bisar_budget.paths.flight import Orbit, PathFileError, Sample
from bisar_budget.paths.instant import FIRST_DAY, Instant, tai
from bisar_budget.paths.messages import (
    LATEST,
    MessageElement,
    coordinate_in,
    epoch_in,
    hold_to_size,
    is_markup,
    object_key,
    parse_markup,
)
from bisar_budget.paths.orientation import UNKNOWN, Orientation

_COORDINATES = (("X", "m"), ("Y", "m"), ("Z", "m"), ("VX", "m/s"), ("VY", "m/s"), ("VZ", "m/s"))
_SYSTEMS = ("UTC", "TAI")
_HERMITE = Interpolation(True, 7)
# Accuracy of position that is required of a type of file: ESA, product news of the Copernicus POD service.
_ACCURACY = {"AUX_POEORB": 0.05, "AUX_RESORB": 0.10}  # m


def read_eof(
    data: bytes, name: str, wanted: str | None, center: Instant, orientation: Orientation = UNKNOWN
) -> Orbit:
    """Orbit from an orbit file of a Sentinel, as every reader of `ORBIT_FORMATS` gives it: after Hermite, degree 7.

    The satellite is `Sentinel-1A` or `S1A`. The orientation is not needed: the axes are those of the Earth.
    """
    hold_to_size(len(data), name, "time")
    if not is_markup(data):
        raise PathFileError(f"{name}:1: is not XML, which orbit files of the Sentinels are")
    top = parse_markup(data, name)
    files = list(top.all("Earth_Explorer_File"))
    if not files:
        raise PathFileError(f"{name}:1: is no Earth Explorer File; accepted: AUX_POEORB, AUX_RESORB and the like")
    (file, *_) = files
    frame = _text(file, "Ref_Frame")
    if frame not in (None, "EARTH_FIXED"):
        raise PathFileError(f"{name}: Ref_Frame must be EARTH_FIXED (got {shown(str(frame))})")
    system = _text(file, "Time_Reference") or "UTC"
    if system not in _SYSTEMS:
        raise PathFileError(f"{name}: Time_Reference must be UTC or TAI (got {shown(system)})")
    samples, lines, flawed, repeated = _samples(file, system, name)
    if len(samples) < _HERMITE.nodes:
        raise PathFileError(f"{name}: has {len(samples)} state vectors, at least {_HERMITE.nodes} are needed")
    off = velocity_off(samples)
    if not off <= OWN_VELOCITY and usual_step(samples) > SPARSE_S:
        raise PathFileError(
            f"{name}:{lines[0]}: has {every(samples)}, too few to interpolate",
            "accepted: a state vector every ten seconds, as in AUX_POEORB and AUX_RESORB",
        )
    if not off <= OWN_VELOCITY:
        raise PathFileError(
            f"{name}:{lines[0]}: velocities are {100 * off:.2g} % off what the places do; they must be those"
            " over the ground"
        )
    kind, satellite = _text(file, "File_Type") or "EOF", shown(_text(file, "Mission") or "?")
    stated = _ACCURACY.get(kind, 0.0)
    kinds = ", ".join(sorted(set(flawed)))
    flaws = f"{name}: {len(flawed)} of {len(samples)} state vectors are not of nominal quality: {kinds}"
    segment = Segment(
        object=satellite,
        names=(_short(satellite), object_key(satellite)),
        samples=samples,
        first=samples[0].time,
        last=samples[-1].time,
        where=f"{name}:{lines[0]}",
        words=f"{shown(kind)} of {satellite}, {_HERMITE.words}{_dropped(repeated)}",
        interpolation=_HERMITE,
        accuracy=lambda _: StatedAccuracy(f"accuracy of {kind}", total=stated) if stated else None,
        remarks=(flaws,) if flawed else (),
    )
    return orbit_through([segment], name, wanted, center, orientation)


def _dropped(repeated: int) -> str:
    """Words on state vectors that a file has twice, as joined files do."""
    return f", {repeated} repeated state vector{'s' * (repeated > 1)} left out" if repeated else ""


def _short(satellite: str) -> str:
    """S1A of Sentinel-1A."""
    return object_key(satellite).replace("sentinel-", "s").replace("sentinel", "s").replace(" ", "")


def _text(file: MessageElement, key: str) -> str | None:
    found = next(file.all(key), None)
    return None if found is None else found.text.strip()


def _samples(file: MessageElement, system: str, name: str) -> tuple[list[Sample], list[int], list[str], int]:
    """State vectors, the line of each, the qualities that are not nominal, and how many were there twice."""
    samples: list[Sample] = []
    lines: list[int] = []
    flawed = []
    repeated = 0
    for vector in file.all("OSV"):
        parts = {one.name: one for one in vector.children}
        x, y, z, u, v, w = _numbers(vector, parts, name)
        sample = Sample(_time(vector, parts, system, name), (x, y, z), (u, v, w))
        if samples and sample == samples[-1]:
            repeated += 1
            continue
        samples.append(sample)
        lines.append(vector.line)
        quality = next(vector.all("Quality"), None)
        if quality is not None and quality.text.strip().upper() != "NOMINAL":
            flawed.append(shown(quality.text.strip()))
    for (before, after), line in zip(pairwise(samples), lines[1:], strict=True):
        step = after.time.since(before.time)
        if abs(step) < APART:
            raise PathFileError(
                f"{name}:{line}: is a state vector of the same time as the one before it, and another"
            )
        if step < 0:
            raise PathFileError(f"{name}:{line}: the time is not after that of the state vector before it")
    return samples, lines, flawed, repeated


def _numbers(vector: MessageElement, parts: dict[str, MessageElement], name: str) -> Iterator[float]:
    for key, unit in _COORDINATES:
        part = parts.get(key)
        if part is None:
            raise PathFileError(f"{name}:{vector.line}: the state vector has no {key}")
        if part.units not in ("", unit):
            raise PathFileError(f"{name}:{part.line}: {key} must be in {unit} (got {shown(part.units)})")
        yield coordinate_in(part.text, f"{name}:{part.line}", f"{key} must be a number of {unit}")


def _time(vector: MessageElement, parts: dict[str, MessageElement], system: str, name: str) -> Instant:
    """Time of a state vector, of TAI, by the system that the file is referred to."""
    if system not in parts:
        raise PathFileError(f"{name}:{vector.line}: the state vector has no {system}")
    written = parts[system].text.strip()
    found = epoch_in(written.removeprefix(f"{system}="))
    if found is None or not FIRST_DAY < found.day < LATEST:
        raise PathFileError(
            f"{name}:{parts[system].line}: {system} must be a time such as {system}=2026-05-31T10:12:13.000000"
            f" (got {shown(written)})"
        )
    return found if system == "TAI" else tai(found)
