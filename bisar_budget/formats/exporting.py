"""A simulated phase history as CPHD 1.1.0 (NGA.STND.0068-1): true ranges in the signal, measured places beside it.

The domain is frequency, and SGN is −1: a point whose echo comes ΔTOA after that of the reference point gives
exp(−j2π fx ΔTOA), the standard's signal model. The reference point (SRP) is the scene centre. Declared errors are in
the difference between the signal and the places, as in data that a sensor records: who forms an image by the places
finds it displaced and defocused.
"""

import hashlib
import io
import math
import os
import tempfile
from datetime import UTC, datetime, timedelta
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from bisar_budget import __version__
from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.faults import printable
from bisar_budget.formats.document import MissingExtraError
from bisar_budget.formats.file_errors import ADDED, KINDS
from bisar_budget.geometry import Axes, PlatformState, Vector
from bisar_budget.mission.model import Mission, Simulation
from bisar_budget.paths.earth import Geodetic, SceneAxes, axes_at, geodetic
from bisar_budget.paths.instant import Instant, parse_instant
from bisar_budget.simulate.collection import PointCollection
from bisar_budget.simulate.phase_history import Errors, Flight, phase_history
from bisar_budget.simulate.point import SimulationError, declared_errors, pulses_for
from bisar_budget.simulate.targets import Targets

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

NAMESPACE = "http://api.nsgreg.nga.mil/schema/cphd/1.1.0"
NOWHERE = Geodetic(0.0, 0.0, 0.0)  # of a scene whose mission does not say where it is
UNDATED = "2000-01-01T12:00:00Z"
_MARGIN_CELLS = 24  # of the image area beyond the targets, each way
_FINE = 2049  # slow times at which the extent of the signal is foreseen
_OVERSAMPLED = 1.5  # frequencies over what the saved swath takes; cphdcheck asks for 1.2
_LEAST_SAMPLES = 64
_BYTES_PER_SAMPLE = 16 * 5 + 8 * 3  # of the phase history as it is formed, and as it is written
_MOST_SCATTERERS = 1 << 20
_CLUTTER_STREAM = 2  # of the file's seed
_CHANNEL = "1"

# Words of 8 bytes of a vector, the standard's per vector parameters
_VECTOR = (
    ("TxTime", 1), ("TxPos", 3), ("TxVel", 3), ("RcvTime", 1), ("RcvPos", 3), ("RcvVel", 3), ("SRPPos", 3),
    ("aFDOP", 1), ("aFRR1", 1), ("aFRR2", 1), ("FX1", 1), ("FX2", 1), ("TOA1", 1), ("TOA2", 1), ("TDTropoSRP", 1),
    ("SC0", 1), ("SCSS", 1), ("SIGNAL", 1),
)  # fmt: skip


class Exported(NamedTuple):
    """A CPHD file, byte for byte, and what a person wants to know of it.

    `half` is half the side of its image area [m]; `remarks` say what the mission leaves open.
    """

    data: bytes
    vectors: int
    samples: int
    half: float
    place: Geodetic
    scatterers: int
    remarks: tuple[str, ...]


class _Plan(NamedTuple):
    """How much is recorded: pulses, frequencies, swath of delay to each side [s], half the side of the area [m]."""

    pulses: int
    samples: int
    delay: float
    half: float


def export_phase_history(mission: Mission, targets: Targets) -> Exported:
    """Record targets with the declared errors of a mission, and write what was recorded as CPHD.

    Parameters
    ----------
    mission : Mission
        As loaded.
    targets : Targets
        What stands in the scene. Clutter is one random scatterer for each resolution cell of the image area.

    Returns
    -------
    Exported

    Raises
    ------
    SimulationError
        Too few pulses for the scene, or more than `simulation.memory_limit` holds. Nothing is formed before that is
        known.
    MissingExtraError
        The extra `formats` is not installed.
    """
    try:
        import_module("lxml.etree")
        import_module("sarkit.cphd")
    except ImportError:
        raise MissingExtraError from None
    import numpy as np

    settings = mission.simulation or Simulation()
    collection, errors = PointCollection(mission, mission.geometry), declared_errors(mission)
    plan = _plan(mission, targets, collection, errors)
    needed = plan.pulses * plan.samples * _BYTES_PER_SAMPLE
    if needed > settings.memory_limit:
        raise SimulationError(
            f"a phase history of {plan.pulses} pulses and {plan.samples} frequencies needs about {needed / 1e6:.4g} "
            f"MB, simulation.memory_limit is {settings.memory_limit / 1e6:.4g} MB: raise it, or put the targets "
            "nearer to each other"
        )
    T, radar = mission.collection.aperture_time, mission.radar
    slow_time: Floats = np.linspace(-T / 2, T / 2, plan.pulses)
    frequency: Floats = radar.center_frequency + np.linspace(-0.5, 0.5, plan.samples) * radar.bandwidth
    flown = collection.flight(errors, slow_time, np.random.default_rng(settings.seed))
    scatterers, amplitudes = _scene(mission, targets, plan.half)
    rng = np.random.default_rng(settings.seed)
    history = phase_history(
        scatterers,
        amplitudes,
        slow_time=slow_time,
        frequency=frequency,
        transmitter=flown.transmitter,
        receiver=flown.receiver,
        clock_error=flown.clock,
        noise_power=10 ** (settings.noise / 10) if settings.noise is not None else 0.0,
        rng=rng,
    )
    remarks = []
    scene = mission.scene
    if scene.latitude is None or scene.longitude is None or scene.height is None:
        place = NOWHERE
        remarks.append("the mission does not say where its scene is (scene.latitude): it is put at 0 deg N, 0 deg E")
    else:
        place = Geodetic(scene.latitude, scene.longitude, scene.height)
    middle = mission.collection.center_time
    if middle is None:
        remarks.append(f"the mission has no collection.center_time: the collection is put at {UNDATED}")
        middle = parse_instant(UNDATED)
        assert middle is not None
    axes = axes_at(place)
    vectors, offset = _vectors(mission, slow_time, flown, collection.flight(errors.smooth(), slow_time), axes, plan)
    tree = _document(mission, targets, plan, axes, vectors, middle.after(-offset), offset, remarks)
    data = _file(tree, vectors, history.samples.astype(np.complex64))
    return Exported(data, plan.pulses, plan.samples, plan.half, place, len(amplitudes), tuple(remarks))


def _plan(mission: Mission, targets: Targets, collection: PointCollection, errors: Errors) -> _Plan:
    """Choose the image area, and the samples that keep it from repeating in range and in Doppler."""
    import numpy as np

    T, radar, geometry = mission.collection.aperture_time, mission.radar, mission.geometry
    try:
        effect = collection.effect(errors.still())
    except ValueError as fault:
        raise SimulationError(f"the declared errors leave no image of a point: {fault}") from None
    moved = max(abs(part) for part in effect.displacement)
    cell = max(
        geometry.range_resolution(radar.bandwidth, SPEED_OF_LIGHT),
        geometry.cross_range_resolution(radar.wavelength, T),
    )
    reach = max(max(abs(one.east), abs(one.north)) for one in targets.points)
    half = float(math.ceil(reach + moved + _MARGIN_CELLS * cell))
    fine: Floats = np.linspace(-T / 2, T / 2, _FINE)
    flown = collection.flight(errors.smooth(), fine)
    measured = sum(np.linalg.norm(path.measured, axis=1) for path in flown.paths)
    actual = sum(np.linalg.norm(path.actual, axis=1) for path in flown.paths)
    error = actual - measured + SPEED_OF_LIGHT * flown.clock
    delays, turns = [], []
    for corner in ((half, half), (half, -half), (-half, half), (-half, -half)):
        away = sum(np.linalg.norm(path.measured - (*corner, 0.0), axis=1) for path in flown.paths) - measured
        delays.append(float(np.abs(away).max()))
        turns.append(float(np.abs(np.gradient(away, fine)).max()))
    delay = (max(delays) + float(np.abs(error).max())) / SPEED_OF_LIGHT
    turn = (max(turns) + float(np.abs(np.gradient(error, fine)).max())) / radar.wavelength
    pulses = pulses_for(mission, math.ceil(2 * turn * T))
    if mission.collection.pulses is None:
        pulses += 1  # so that one is at the middle
    samples = max(_LEAST_SAMPLES, math.ceil(2 * _OVERSAMPLED * delay * radar.bandwidth)) + 1
    return _Plan(pulses, samples, delay, half)


def _scene(mission: Mission, targets: Targets, half: float) -> tuple["Floats", "NDArray[np.complex128]"]:
    """Places (n, 3) [m] and amplitudes (n,) of targets and clutter."""
    import numpy as np

    places = [(one.east, one.north, 0.0) for one in targets.points]
    amplitudes = [10 ** (one.level_db / 20) for one in targets.points]
    if targets.clutter_db is None:
        return np.array(places), np.array(amplitudes, dtype=complex)
    geometry, radar = mission.geometry, mission.radar
    cell = geometry.range_resolution(radar.bandwidth, SPEED_OF_LIGHT) * geometry.cross_range_resolution(
        radar.wavelength, mission.collection.aperture_time
    )
    count = math.ceil((2 * half) ** 2 / cell)
    if count > _MOST_SCATTERERS:
        raise SimulationError(
            f"clutter of {count} scatterers, at most {_MOST_SCATTERERS} are simulated: put the targets nearer to "
            "each other"
        )
    rng = np.random.default_rng([mission.simulation.seed if mission.simulation else 1, _CLUTTER_STREAM])
    ground = np.pad(rng.uniform(-half, half, (count, 2)), ((0, 0), (0, 1)))
    random = (rng.normal(size=count) + 1j * rng.normal(size=count)) * 10 ** (targets.clutter_db / 20) / math.sqrt(2)
    return np.concatenate((places, ground)), np.concatenate((amplitudes, random))


def _vectors(
    mission: Mission, slow_time: "Floats", flown: Flight, smooth: Flight, axes: SceneAxes, plan: _Plan
) -> tuple["NDArray[Any]", float]:
    """Parameters of each vector, and the time of the file at the middle of the aperture. [s]

    A pulse is at the scene centre at its slow time. It left the transmitter R_t/c before, and is received R_r/c
    later, by the measured places; so the reference time of section 6.5.1 (5) is that slow time again. A platform's
    own time therefore runs by 1 ∓ Ṙ/c of slow time, which is what its velocity is divided by.
    """
    import numpy as np

    dtype = np.dtype(
        [(name, "i8" if name == "SIGNAL" else "f8", (size,) if size > 1 else ()) for name, size in _VECTOR]
    )
    vectors: NDArray[Any] = np.zeros(slow_time.size, dtype)
    ranges = []
    doppler = np.zeros(slow_time.size)
    sides = (
        ("Tx", flown.transmitter, smooth.transmitter, mission.geometry.transmitter, -1.0),
        ("Rcv", flown.receiver, smooth.receiver, mission.geometry.receiver, 1.0),
    )
    turn: Floats = np.array(axes.axes)
    for side, path, slow, state, sign in sides:
        place = path.measured
        velocity = np.array([state.at(tau)[1] for tau in slow_time.tolist()])
        velocity = velocity + np.gradient(slow.measured - slow.actual, slow_time, axis=0, edge_order=2)
        length = np.linalg.norm(place, axis=1)
        closing = np.sum(place * velocity, axis=1) / length
        own = velocity / (1 + sign * closing / SPEED_OF_LIGHT)[:, None]
        vectors[f"{side}Pos"] = place @ turn + np.array(axes.origin)
        vectors[f"{side}Vel"] = own @ turn
        vectors[f"{side}Time"] = slow_time + sign * length / SPEED_OF_LIGHT
        ranges.append(length)
        doppler += np.sum(place * own, axis=1) / length
    # Whole milliseconds, so that the start of the collection is one that a file states exactly.
    offset = math.ceil((mission.collection.aperture_time / 2 + float(ranges[0].max()) / SPEED_OF_LIGHT) * 1e3) / 1e3
    vectors["TxTime"] += offset
    vectors["RcvTime"] += offset
    vectors["SRPPos"] = axes.origin
    vectors["aFDOP"] = -doppler / SPEED_OF_LIGHT  # −2/c of the mean range rate of both legs
    radar = mission.radar
    vectors["FX1"] = vectors["SC0"] = radar.center_frequency - radar.bandwidth / 2
    vectors["FX2"] = radar.center_frequency + radar.bandwidth / 2
    vectors["SCSS"] = radar.bandwidth / (plan.samples - 1)
    vectors["TOA1"], vectors["TOA2"] = -plan.delay, plan.delay
    vectors["SIGNAL"] = 1
    return vectors, offset


# ---------------------------------------------------------------------- XML
_Branch = list[tuple[str, Any]]


def _document(
    mission: Mission,
    targets: Targets,
    plan: _Plan,
    axes: SceneAxes,
    vectors: "NDArray[Any]",
    start: Instant,
    offset: float,
    remarks: list[str],
) -> Any:
    """XML of the file, an lxml tree, with the reference geometry that sarkit computes from the vectors."""
    import numpy as np

    etree: Any = import_module("lxml.etree")
    skcphd: Any = import_module("sarkit.cphd")
    band = [float(vectors["FX1"][0]), float(vectors["FX2"][0])]
    area: _Branch = [("X1Y1", _xy(-plan.half, -plan.half)), ("X2Y2", _xy(plan.half, plan.half))]
    name = printable(mission.name)
    branches: _Branch = [
        (
            "CollectionID",
            [
                ("CollectorName", "receiver, simulated"),
                ("IlluminatorName", "transmitter, simulated"),
                ("CoreName", name),
                ("CollectType", "BISTATIC"),
                ("RadarMode", [("ModeType", "SPOTLIGHT")]),
                ("Classification", "UNCLASSIFIED"),
                ("ReleaseInfo", "UNRESTRICTED"),
            ],
        ),
        (
            "Global",
            [
                ("DomainType", "FX"),
                ("SGN", -1),
                (
                    "Timeline",
                    [
                        ("CollectionStart", _moment(start)),
                        ("TxTime1", float(vectors["TxTime"][0])),
                        ("TxTime2", float(vectors["TxTime"][-1])),
                    ],
                ),
                ("FxBand", [("FxMin", band[0]), ("FxMax", band[1])]),
                ("TOASwath", [("TOAMin", -plan.delay), ("TOAMax", plan.delay)]),
            ],
        ),
        ("SceneCoordinates", _scene_coordinates(mission, plan, axes, area)),
        (
            "Data",
            [
                ("SignalArrayFormat", "CF8"),
                ("NumBytesPVP", vectors.dtype.itemsize),
                ("NumCPHDChannels", 1),
                (
                    "Channel",
                    [
                        ("Identifier", _CHANNEL),
                        ("NumVectors", plan.pulses),
                        ("NumSamples", plan.samples),
                        ("SignalArrayByteOffset", 0),
                        ("PVPArrayByteOffset", 0),
                    ],
                ),
                ("NumSupportArrays", 0),
            ],
        ),
        (
            "Channel",
            [
                ("RefChId", _CHANNEL),
                ("FXFixedCPHD", True),
                ("TOAFixedCPHD", True),
                ("SRPFixedCPHD", True),
                (
                    "Parameters",
                    [
                        ("Identifier", _CHANNEL),
                        ("RefVectorIndex", plan.pulses // 2),
                        ("FXFixed", True),
                        ("TOAFixed", True),
                        ("SRPFixed", True),
                        ("SignalNormal", True),
                        ("Polarization", [("TxPol", "UNSPECIFIED"), ("RcvPol", "UNSPECIFIED")]),
                        ("FxC", (band[0] + band[1]) / 2),
                        ("FxBW", band[1] - band[0]),
                        ("TOASaved", 2 * plan.delay),
                        ("DwellTimes", [("CODId", "1"), ("DwellId", "1")]),
                    ],
                ),
            ],
        ),
        ("PVP", _layout(vectors)),
        (
            "Dwell",
            [
                ("NumCODTimes", 1),
                ("CODTime", [("Identifier", "1"), ("CODTimePoly", offset)]),
                ("NumDwellTimes", 1),
                ("DwellTime", [("Identifier", "1"), ("DwellTimePoly", mission.collection.aperture_time)]),
            ],
        ),
        *_error_parameters(mission, axes),
        ("ProductInfo", _product(mission, targets, remarks)),
    ]
    root = etree.Element(f"{{{NAMESPACE}}}CPHD", nsmap={None: NAMESPACE})
    _grow(etree, root, branches)
    tree = root.getroottree()
    with np.errstate(all="ignore"):  # a fixed platform has no direction of motion, which the standard has rules for
        geometry = skcphd.compute_reference_geometry(tree, vectors)
    root.find("{*}Dwell").addnext(geometry)
    return tree


def _grow(etree: Any, above: Any, branches: _Branch) -> None:
    """Put elements below one: text, or a list of elements again. A polynomial is written as its constant."""
    for name, value in branches:
        tag, _, attribute = name.partition("@")
        node = etree.SubElement(above, f"{{{NAMESPACE}}}{tag}")
        if attribute:
            key, _, text = attribute.partition("=")
            node.set(key, text)
        if tag.endswith("Poly"):
            node.set("order1", "0")
            node.set("order2", "0")
            coefficient = etree.SubElement(node, f"{{{NAMESPACE}}}Coef", exponent1="0", exponent2="0")
            coefficient.text = repr(float(value))
        elif isinstance(value, list):
            _grow(etree, node, value)
        elif isinstance(value, bool):
            node.text = str(value).lower()
        else:
            node.text = repr(value) if isinstance(value, float) else str(value)


def _xyz(vector: Vector) -> _Branch:
    return list(zip("XYZ", map(float, vector), strict=True))


def _xy(x: float, y: float) -> _Branch:
    return [("X", x), ("Y", y)]


def _degrees(place: Geodetic) -> _Branch:
    return [("Lat", math.degrees(place.latitude)), ("Lon", math.degrees(place.longitude))]


def _scene_coordinates(mission: Mission, plan: _Plan, axes: SceneAxes, area: _Branch) -> _Branch:
    """Plane of the scene: x east, y north; its corners clockwise as seen from above."""
    half = plan.half
    corners = [(-half, -half), (-half, half), (half, half), (half, -half)]
    place = geodetic(axes.origin)
    spacing = mission.geometry.range_resolution(mission.radar.bandwidth, SPEED_OF_LIGHT) / 2
    across = mission.geometry.cross_range_resolution(mission.radar.wavelength, mission.collection.aperture_time) / 2
    pixels = math.ceil(2 * half / min(spacing, across))
    step = 2 * half / pixels
    return [
        ("EarthModel", "WGS_84"),
        ("IARP", [("ECF", _xyz(axes.origin)), ("LLH", [*_degrees(place), ("HAE", place.height)])]),
        ("ReferenceSurface", [("Planar", [("uIAX", _xyz(axes.axes[0])), ("uIAY", _xyz(axes.axes[1]))])]),
        ("ImageArea", area),
        (
            "ImageAreaCornerPoints",
            [
                (f"IACP@index={index}", _degrees(geodetic(axes.earth_fixed((x, y, 0.0)))))
                for index, (x, y) in enumerate(corners, 1)
            ],
        ),
        (
            "ImageGrid",
            [
                ("IARPLocation", [("Line", (pixels - 1) / 2), ("Sample", (pixels - 1) / 2)]),
                ("IAXExtent", [("LineSpacing", step), ("FirstLine", 0), ("NumLines", pixels)]),
                ("IAYExtent", [("SampleSpacing", step), ("FirstSample", 0), ("NumSamples", pixels)]),
            ],
        ),
    ]


def _layout(vectors: "NDArray[Any]") -> _Branch:
    fields: Any = vectors.dtype.fields
    return [
        (
            name,
            [
                ("Offset", int(fields[name][1]) // 8),
                ("Size", size),
                ("Format", "X=F8;Y=F8;Z=F8;" if size == 3 else "I8" if name == "SIGNAL" else "F8"),
            ],
        )
        for name, size in _VECTOR
    ]


def _moment(instant: Instant) -> str:
    """An instant of UTC, to a microsecond."""
    moment = datetime(1858, 11, 17, tzinfo=UTC) + timedelta(days=instant.day, seconds=instant.seconds)
    return moment.strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def _product(mission: Mission, targets: Targets, remarks: list[str]) -> _Branch:
    parameters = {
        "version": __version__,
        "mission": os.path.basename(printable(mission.file)),
        "mission SHA-256": hashlib.sha256(mission.data).hexdigest(),
        "signal": "exact ranges of the paths as flown",
        "vectors": "places as measured: as flown, plus the declared errors",
        "points": "; ".join(f"{one.east:.9g}, {one.north:.9g}, {one.level_db:.6g}" for one in targets.points),
        "points are": "east [m], north [m], level [dB]",
    }
    if targets.clutter_db is not None:
        parameters["clutter [dB]"] = f"{targets.clutter_db:g}"
    for index, remark in enumerate(remarks, 1):
        parameters[f"remark {index}"] = remark
    return [(f"Parameter@name={ADDED} {key}", value) for key, value in parameters.items()]


# ---------------------------------------------------------------------- declared errors
def _error_parameters(mission: Mission, axes: SceneAxes) -> _Branch:
    """`ErrorParameters` of both platforms: one sigma as declared, without the coverage factor.

    Errors that both platforms share are in the sigmas of each. What has no place there stands in `AddedParameters`.
    """
    added: dict[str, str] = {}
    sides = []
    for whose, side in (("transmitter", "TxPlatform"), ("receiver", "RcvPlatform")):
        covariance, frame = _covariance(mission, whose, axes, added)
        sensor: _Branch = []
        timing = mission.timing_error
        if whose == "receiver":  # whose clock is counted against the transmitter's
            sensor = [("DelayBias", abs(timing.constant))] if timing.constant is not None else []
            sensor += [("ClockFreqSF", abs(timing.linear))] if timing.linear is not None else []
        sensor.append(("CollectionStartTime", 0.0))  # which the schema asks for
        sides.append((side, [("PosVelErr", _pos_vel_err(covariance, frame)), ("RadarSensor", sensor)]))
    nothing = all(
        added.get(f"{whose}.{kind}") for whose in ("transmitter", "receiver") for kind in ("position", "velocity")
    )
    if nothing and len(sides[1][1][1][1]) == 1 and len(added) == 4:
        return []
    parameters: _Branch = [(f"Parameter@name={ADDED} {key}", value) for key, value in added.items()]
    rest: _Branch = [("AddedParameters", parameters)] if parameters else []
    return [("ErrorParameters", [("Bistatic", [*sides, *rest])])]


def _covariance(mission: Mission, whose: str, axes: SceneAxes, added: dict[str, str]) -> tuple["Floats", str]:
    """Covariance (6, 6) of one platform in a frame of the standard, and that frame. [m², m²/s, m²/s²]"""
    import numpy as np

    error = getattr(mission.platforms, whose).motion_error
    state: PlatformState = getattr(mission.geometry, whose)
    common = mission.common_motion_error
    is_radial = error.frame == "ric" and common is None
    source: Axes = state.frame(error.frame)
    found = np.zeros((6, 6))
    if error.covariance is not None:
        sigmas = np.array(error.covariance.sigmas)
        found = np.outer(sigmas, sigmas) * np.array(error.covariance.correlation)
    for index, kind in enumerate(("position", "velocity")):
        block = slice(3 * index, 3 * index + 3)
        own = getattr(error, kind)
        if own is not None:
            found[block, block] = np.diag(np.square(own))
        elif error.covariance is None and (common is None or getattr(common, kind) is None):
            added[f"{whose}.{kind}"] = "not declared"
    if error.acceleration is not None:
        turn = np.eye(3) if is_radial or error.frame == "scene" else np.array(source).T
        added[f"{whose}.acceleration"] = " ".join(f"{x:.12g}" for x in turn @ error.acceleration) + " m/s^2"
    if error.distribution != "normal":
        added[f"{whose}.distribution"] = error.distribution
    if is_radial:
        return found, "RIC_ECI"
    # Columns are the frame's axes in the scene's; the scene's axes in Earth-fixed ones are rows.
    both = np.kron(np.eye(2), np.array(source).T)
    found = both @ found @ both.T
    if common is not None:
        for index, kind in enumerate(("position", "velocity")):
            if getattr(common, kind) is not None:
                block = slice(3 * index, 3 * index + 3)
                found[block, block] += np.diag(np.square(getattr(common, kind)))
        added[f"{whose}.common"] = "the sigmas hold an error that both platforms share"
    both = np.kron(np.eye(2), np.array(axes.axes).T)
    return both @ found @ both.T, "ECF"


def _pos_vel_err(covariance: "Floats", frame: str) -> _Branch:
    import numpy as np

    sigmas = np.sqrt(np.diag(covariance))
    scale = np.where(np.outer(sigmas, sigmas) > 0, np.outer(sigmas, sigmas), 1.0)
    correlation = np.clip(covariance / scale, -1, 1)
    pairs = [
        (KINDS[row] + KINDS[column], float(correlation[row, column]))
        for row in range(6)
        for column in range(row + 1, 6)
    ]
    return [
        ("Frame", frame),
        *((kind, float(sigma)) for kind, sigma in zip(KINDS, sigmas, strict=True)),
        ("CorrCoefs", pairs),
    ]


def _file(tree: Any, vectors: "NDArray[Any]", signal: "NDArray[Any]") -> bytes:
    """A CPHD file by sarkit's writer."""
    skcphd: Any = import_module("sarkit.cphd")
    with tempfile.TemporaryFile() as stream:  # the writer needs a file of the system
        with skcphd.Writer(stream, skcphd.Metadata(xmltree=tree)) as writer:
            writer.write_pvp(_CHANNEL, vectors)
            writer.write_signal(_CHANNEL, signal)
        stream.flush()
        stream.seek(0, io.SEEK_SET)
        return stream.read()
