"""Orbit files of the Sentinels (EOF, Earth Explorer File): XML with a state vector every ten seconds.

Source: Sentinels POD service file format specification (GMES-GSEG-EOPG-FS-10-0075), and ESA's Earth Observation
mission file format standard (PE-TN-ESA-GS-0001). State vectors are in ITRF axes, and their velocities are relative to
the rotating Earth.
"""

from collections.abc import Iterator
from itertools import pairwise

from bisar_budget.faults import shown
from bisar_budget.paths.accuracy import StatedAccuracy
from bisar_budget.paths.ephemeris import (
    MAX_DENSE_STEP_S,
    MAX_VELOCITY_ERROR_RATIO,
    MIN_SAMPLE_STEP_S,
    Interpolation,
    Segment,
    every,
    orbit_through,
    usual_step,
    velocity_error,
)
from bisar_budget.paths.flight import Orbit, PathFileError, Sample
from bisar_budget.paths.instant import FIRST_UTC_DAY, Instant, tai
from bisar_budget.paths.messages import (
    LAST_ORBIT_DAY,
    MessageElement,
    coordinate_in,
    epoch_in,
    hold_to_size,
    is_markup,
    object_key,
    parse_markup,
)
from bisar_budget.paths.orientation import UNKNOWN, Orientation

_COORDINATE_UNITS = (("X", "m"), ("Y", "m"), ("Z", "m"), ("VX", "m/s"), ("VY", "m/s"), ("VZ", "m/s"))
_SYSTEMS = ("UTC", "TAI")
_HERMITE = Interpolation(True, 7)
# Required accuracy of position by type of file: ESA, product news of the Copernicus POD service.
_ACCURACIES_M = {"AUX_POEORB": 0.05, "AUX_RESORB": 0.10}  # m


def read_eof(
    data: bytes, name: str, object_name: str | None, center: Instant, orientation: Orientation = UNKNOWN
) -> Orbit:
    """Read an orbit file of a Sentinel, and return the orbit.

    The arguments and errors are the same for all readers; see `OrbitFormat.read`. State vectors are interpolated
    with Hermite's polynomial of degree 7. `object_name` is a name such as `Sentinel-1A` or `S1A`. `orientation` is
    ignored, because the axes are fixed to the Earth.
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
    error_ratio = velocity_error(samples)
    if not error_ratio <= MAX_VELOCITY_ERROR_RATIO and usual_step(samples) > MAX_DENSE_STEP_S:
        raise PathFileError(
            f"{name}:{lines[0]}: has {every(samples)}, too few to interpolate",
            "accepted: a state vector every ten seconds, as in AUX_POEORB and AUX_RESORB",
        )
    if not error_ratio <= MAX_VELOCITY_ERROR_RATIO:
        raise PathFileError(
            f"{name}:{lines[0]}: velocities are {100 * error_ratio:.2g} % off the motion of the positions; they must "
            "be those over the ground"
        )
    kind, satellite = _text(file, "File_Type") or "EOF", shown(_text(file, "Mission") or "?")
    accuracy_m = _ACCURACIES_M.get(kind, 0.0)
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
        accuracy=lambda _: StatedAccuracy(f"accuracy of {kind}", total=accuracy_m) if accuracy_m else None,
        remarks=(flaws,) if flawed else (),
    )
    return orbit_through([segment], name, object_name, center, orientation)


def _dropped(repeated: int) -> str:
    """Phrase with the number of repeated state vectors that were left out; empty if no state vector was repeated.

    Files that were joined have repeated state vectors.
    """
    return f", {repeated} repeated state vector{'s' * (repeated > 1)} left out" if repeated else ""


def _short(satellite: str) -> str:
    """Short name of a Sentinel satellite for comparisons, such as `s1a` for `Sentinel-1A`."""
    return object_key(satellite).replace("sentinel-", "s").replace("sentinel", "s").replace(" ", "")


def _text(file: MessageElement, key: str) -> str | None:
    element = next(file.all(key), None)
    return None if element is None else element.text.strip()


def _samples(file: MessageElement, system: str, name: str) -> tuple[list[Sample], list[int], list[str], int]:
    """Read the state vectors of a file; repeated state vectors are left out.

    Returns the state vectors, their line numbers, all stated qualities other than nominal, and the number of repeated
    state vectors.
    """
    samples: list[Sample] = []
    lines: list[int] = []
    flawed = []
    repeated = 0
    for vector in file.all("OSV"):
        elements = {element.name: element for element in vector.children}
        x, y, z, u, v, w = _numbers(vector, elements, name)
        sample = Sample(_time(vector, elements, system, name), (x, y, z), (u, v, w))
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
        if abs(step) < MIN_SAMPLE_STEP_S:
            raise PathFileError(
                f"{name}:{line}: is a state vector of the same time as the one before it, and another"
            )
        if step < 0:
            raise PathFileError(f"{name}:{line}: the time is not after that of the state vector before it")
    return samples, lines, flawed, repeated


def _numbers(vector: MessageElement, elements: dict[str, MessageElement], name: str) -> Iterator[float]:
    for key, unit in _COORDINATE_UNITS:
        element = elements.get(key)
        if element is None:
            raise PathFileError(f"{name}:{vector.line}: the state vector has no {key}")
        if element.units not in ("", unit):
            raise PathFileError(f"{name}:{element.line}: {key} must be in {unit} (got {shown(element.units)})")
        yield coordinate_in(element.text, f"{name}:{element.line}", f"{key} must be a number of {unit}")


def _time(vector: MessageElement, elements: dict[str, MessageElement], system: str, name: str) -> Instant:
    """Time of a state vector in TAI; `system` is the time system of the file."""
    if system not in elements:
        raise PathFileError(f"{name}:{vector.line}: the state vector has no {system}")
    text = elements[system].text.strip()
    time = epoch_in(text.removeprefix(f"{system}="))
    if time is None or not FIRST_UTC_DAY < time.day < LAST_ORBIT_DAY:
        raise PathFileError(
            f"{name}:{elements[system].line}: {system} must be a time such as {system}=2026-05-31T10:12:13.000000"
            f" (got {shown(text)})"
        )
    return time if system == "TAI" else tai(time)
