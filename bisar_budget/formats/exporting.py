"""Export of a simulated phase history as CPHD 1.1.0 (NGA.STND.0068-1).

The signal is computed from the true paths of the platforms, whereas the file states the measured positions. The two
differ by the declared errors, as in recorded data, so that an image formed with the stated positions is displaced and
defocused. The signal is in the frequency domain, and SGN is −1. A point whose echo arrives ΔTOA later than the echo
of the reference point has the signal exp(−j2π fx ΔTOA), as in the signal model of the standard. The reference point
(SRP) is the scene centre.
"""

import hashlib
import io
import math
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bisar_budget import __version__
from bisar_budget.arrays import Records
from bisar_budget.budget.check import check_mission
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.effects.effect import PLATFORMS, plain, subject
from bisar_budget.effects.sources import exact_ranges
from bisar_budget.error_kinds.clock_kinds import TIMING_KIND
from bisar_budget.error_kinds.path_kinds import MEASURED_KINDS, STATE_KINDS, TIME_TAG_KIND, StateKind
from bisar_budget.faults import printable
from bisar_budget.formats.collected import ADDED, SIGMA_NAMES, correlated, is_read_back
from bisar_budget.formats.containers import check_extra
from bisar_budget.geometry import Axes, PlatformState, Vector, plain_vector
from bisar_budget.mission.model import Mission, Simulation, has_instruments
from bisar_budget.paths.accuracy import block_turned, with_rate
from bisar_budget.paths.earth import Floats, Geodetic, SceneAxes, axes_at, geodetic
from bisar_budget.paths.instant import Instant, parse_instant
from bisar_budget.ranges.resolution import resolution
from bisar_budget.simulator.collection import PointCollection
from bisar_budget.simulator.phase_history import Errors, Flight, ReceiverNoise
from bisar_budget.simulator.point import SimulationError, declared_errors, pulses_for
from bisar_budget.simulator.realisations import has_unset_clocks
from bisar_budget.simulator.targets import Targets

if TYPE_CHECKING:
    from lxml.etree import _Element, _ElementTree


NAMESPACE = "http://api.nsgreg.nga.mil/schema/cphd/1.1.0"
DEFAULT_SCENE = Geodetic(0.0, 0.0, 0.0)  # position of a scene without coordinates in its mission
UNDATED = "2000-01-01T12:00:00Z"
_CLOCK_ELEMENTS = {"DelayBias": "constant", "ClockFreqSF": "linear"}  # terms of the clock error, by CPHD element
_AREA_MARGIN_CELLS = 24  # of the image area beyond the targets, on each side
_EXTENT_SAMPLES = 2049  # slow times at which the extent of the signal is computed
_SWATH_OVERSAMPLING_FACTOR = 1.5  # ratio of frequencies to those that the swath needs; cphdcheck requires 1.2
_MIN_EXPORT_SAMPLES = 64
_BYTES_PER_EXPORTED_SAMPLE = 16 * 5 + 8 * 3  # of the phase history as it is formed, and as it is written
_MAX_SCATTERERS_COUNT = 1 << 20
_EXPORT_CLUTTER_STREAM_INDEX = 2  # beside the file's seed
_CHANNEL = "1"
# Kinds of rows that are no errors: sums, requirements, and effects of other rows.

# Per vector parameters of the standard, each with its number of words of 8 bytes.
_VECTOR_WORDS = (
    ("TxTime", 1), ("TxPos", 3), ("TxVel", 3), ("RcvTime", 1), ("RcvPos", 3), ("RcvVel", 3), ("SRPPos", 3),
    ("aFDOP", 1), ("aFRR1", 1), ("aFRR2", 1), ("FX1", 1), ("FX2", 1), ("TOA1", 1), ("TOA2", 1), ("TDTropoSRP", 1),
    ("SC0", 1), ("SCSS", 1), ("SIGNAL", 1),
)  # fmt: skip


@dataclass(frozen=True)
class Exported:
    """Bytes of an exported CPHD file, and the numbers of its vectors, samples per vector and scatterers.

    `half` is half the side length of the image area [m]. `remarks` state which values were assumed because the
    mission does not state them.
    """

    data: bytes
    vectors: int
    samples: int
    half: float
    scatterers: int
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class _Plan:
    """Numbers of pulses and samples of the phase history to simulate, and size of the image area.

    `pulses` and `samples` are the numbers of pulses and of frequencies. `delay` is the largest magnitude of the delay
    relative to the reference point [s]. `half` is half the side length of the image area [m]. `cell` contains the
    resolutions in range and cross-range [m].
    """

    pulses: int
    samples: int
    delay: float
    half: float
    cell: tuple[float, float]


def export_phase_history(mission: Mission, targets: Targets) -> Exported:
    """Simulate the phase history of targets with the declared errors of a mission, and return it as CPHD.

    If `targets` contains clutter, it is simulated by one random scatterer per resolution cell of the image area.

    Raises
    ------
    SimulationError
        The mission has too few pulses for the scene, or the phase history needs more memory than
        `simulation.memory_limit`. Both are checked before the signal is computed.
    MissingExtraError
        The extra `formats` is not installed.
    """
    check_extra()
    settings = mission.simulation or Simulation()
    collection, errors = PointCollection(mission, mission.geometry), declared_errors(mission)
    plan = _plan(mission, targets, collection, errors)
    needed = plan.pulses * plan.samples * _BYTES_PER_EXPORTED_SAMPLE
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
    scatterers, amplitudes = _scene(mission, targets, plan)
    rng = np.random.default_rng(settings.seed)
    noise: ReceiverNoise = {
        "noise_power": 10 ** (settings.noise / 10) if settings.noise is not None else 0.0,
        "rng": rng,
    }
    history = flown.record(scatterers, amplitudes, slow_time, frequency, **noise)
    remarks = []
    axes = mission.scene.axes
    if axes is None:
        axes = axes_at(DEFAULT_SCENE)
        remarks.append("the mission does not say where its scene is (scene.latitude): it is put at 0 deg N, 0 deg E")
    center_time = mission.collection.center_time
    if center_time is None:
        remarks.append(f"the mission has no collection.center_time: the collection is put at {UNDATED}")
        center_time = parse_instant(UNDATED)
        assert center_time is not None
    if has_instruments(mission) and has_unset_clocks(mission):
        remarks.append(
            "the mission does not say how its oscillators are set (timing_error.constant and linear, or "
            "synchronization): they are flown without mean and slope"
        )
    vectors, offset = _vectors(mission, slow_time, flown, collection.flight(errors.smooth(), slow_time), axes, plan)
    tree = _document(mission, targets, plan, axes, vectors, center_time.after(-offset), offset, remarks)
    data = _file(tree, vectors, history.samples.astype(np.complex64))
    return Exported(data, plan.pulses, plan.samples, plan.half, len(amplitudes), tuple(remarks))


def _plan(mission: Mission, targets: Targets, collection: PointCollection, errors: Errors) -> _Plan:
    """Choose the size of the image area, and numbers of samples and pulses that avoid ambiguities in it."""
    T, radar = mission.collection.aperture_time, mission.radar
    try:
        effect = collection.effect(errors.still())
    except ValueError as fault:
        raise SimulationError(f"the declared errors leave no image of a point: {fault}") from None
    shift = max(abs(component) for component in effect.displacement)
    reach = max(max(abs(target.east), abs(target.north)) for target in targets.points)
    exact, T = exact_ranges(mission, mission.geometry), mission.collection.aperture_time
    widths = resolution(exact, mission.geometry, mission.radar, T)
    cell = plain(widths.range), plain(widths.cross_range)
    half = float(math.ceil(reach + shift + _AREA_MARGIN_CELLS * max(cell)))
    times: Floats = np.linspace(-T / 2, T / 2, _EXTENT_SAMPLES)
    flown = collection.flight(errors.smooth(), times)
    measured = sum(np.linalg.norm(path.measured, axis=1) for path in flown.paths)
    actual = sum(np.linalg.norm(path.actual, axis=1) for path in flown.paths)
    error = actual - measured + SPEED_OF_LIGHT_MPS * flown.seen
    delays, turns = [], []
    for corner in ((half, half), (half, -half), (-half, half), (-half, -half)):
        excess_range = sum(np.linalg.norm(path.measured - (*corner, 0.0), axis=1) for path in flown.paths) - measured
        delays.append(float(np.abs(excess_range).max()))
        turns.append(float(np.abs(np.gradient(excess_range, times)).max()))
    delay = (max(delays) + float(np.abs(error).max())) / SPEED_OF_LIGHT_MPS
    turn = (max(turns) + float(np.abs(np.gradient(error, times)).max())) / radar.wavelength
    pulses = pulses_for(mission, math.ceil(2 * turn * T))
    if mission.collection.pulses is None:
        pulses += 1  # so that one is at the middle
    samples = max(_MIN_EXPORT_SAMPLES, math.ceil(2 * _SWATH_OVERSAMPLING_FACTOR * delay * radar.bandwidth)) + 1
    return _Plan(pulses, samples, delay, half, cell)


def _scene(mission: Mission, targets: Targets, plan: _Plan) -> tuple[Floats, NDArray[np.complex128]]:
    """Positions (n, 3) [m] and complex amplitudes (n,) of all targets and clutter scatterers."""
    positions = [(target.east, target.north, 0.0) for target in targets.points]
    amplitudes = [10 ** (target.level_db / 20) for target in targets.points]
    if targets.clutter_db is None:
        return np.array(positions), np.array(amplitudes, dtype=complex)
    half = plan.half
    count = math.ceil((2 * half) ** 2 / math.prod(plan.cell))
    if count > _MAX_SCATTERERS_COUNT:
        raise SimulationError(
            f"clutter of {count} scatterers, at most {_MAX_SCATTERERS_COUNT} are simulated: put the targets nearer "
            "to each other"
        )
    rng = np.random.default_rng([(mission.simulation or Simulation()).seed, _EXPORT_CLUTTER_STREAM_INDEX])
    ground = np.pad(rng.uniform(-half, half, (count, 2)), ((0, 0), (0, 1)))
    random = (rng.normal(size=count) + 1j * rng.normal(size=count)) * 10 ** (targets.clutter_db / 20) / math.sqrt(2)
    return np.concatenate((positions, ground)), np.concatenate((amplitudes, random))


def _vectors(
    mission: Mission, slow_time: Floats, flown: Flight, smooth: Flight, axes: SceneAxes, plan: _Plan
) -> tuple[Records, float]:
    """Compute the per-vector parameters of the CPHD file, one record for each pulse.

    Also returns the time from the start of the collection to the middle of the aperture [s]. `smooth` is the flight
    `flown` without vibration and fast errors. The slow time of a pulse is the time at which it reaches the scene
    centre. The pulse leaves the transmitter R_t/c earlier and is received R_r/c later, where both ranges follow from
    the measured positions. The reference time in section 6.5.1 (5) of the standard is thus the slow time. While slow
    time advances by 1 s, the time of transmission advances by 1 − Ṙ_t/c and the time of reception by 1 + Ṙ_r/c.
    Velocities with respect to slow time are therefore divided by these factors.
    """
    dtype = np.dtype(
        [(name, "i8" if name == "SIGNAL" else "f8", (size,) if size > 1 else ()) for name, size in _VECTOR_WORDS]
    )
    vectors: Records = np.zeros(slow_time.size, dtype)
    ranges = []
    doppler = np.zeros(slow_time.size)
    sides = (
        ("Tx", flown.transmitter, smooth.transmitter, mission.geometry.transmitter, -1.0),
        ("Rcv", flown.receiver, smooth.receiver, mission.geometry.receiver, 1.0),
    )
    turn: Floats = np.array(axes.axes)
    for side, path, smooth_path, state, sign in sides:
        position = path.measured
        velocity = np.stack(np.broadcast_arrays(*state.at(slow_time)[1]), axis=1)
        velocity = velocity + np.gradient(smooth_path.measured - smooth_path.actual, slow_time, axis=0, edge_order=2)
        length = np.linalg.norm(position, axis=1)
        closing = np.sum(position * velocity, axis=1) / length
        own_velocity = velocity / (1 + sign * closing / SPEED_OF_LIGHT_MPS)[:, None]
        vectors[f"{side}Pos"] = position @ turn + np.array(axes.origin)
        vectors[f"{side}Vel"] = own_velocity @ turn
        vectors[f"{side}Time"] = slow_time + sign * length / SPEED_OF_LIGHT_MPS
        ranges.append(length)
        doppler += np.sum(position * own_velocity, axis=1) / length
    # Whole milliseconds, so that a file states the start of the collection exactly.
    offset = (
        math.ceil((mission.collection.aperture_time / 2 + float(ranges[0].max()) / SPEED_OF_LIGHT_MPS) * 1e3) / 1e3
    )
    vectors["TxTime"] += offset
    vectors["RcvTime"] += offset
    vectors["SRPPos"] = axes.origin
    vectors["aFDOP"] = -doppler / SPEED_OF_LIGHT_MPS  # −2/c times the mean range rate of both legs
    radar = mission.radar
    vectors["FX1"] = vectors["SC0"] = radar.center_frequency - radar.bandwidth / 2
    vectors["FX2"] = radar.center_frequency + radar.bandwidth / 2
    vectors["SCSS"] = radar.bandwidth / (plan.samples - 1)
    vectors["TOA1"], vectors["TOA2"] = -plan.delay, plan.delay
    vectors["SIGNAL"] = 1
    return vectors, offset


# ---------------------------------------------------------------------- XML
_Leaves = dict[str, object]  # text or number by the path of its element, in the order of the file


def _document(
    mission: Mission,
    targets: Targets,
    plan: _Plan,
    axes: SceneAxes,
    vectors: Records,
    start: Instant,
    offset: float,
    remarks: list[str],
) -> "_ElementTree":
    """Make the XML document of the CPHD file; sarkit computes its `ReferenceGeometry` from the vectors."""
    etree = import_module("lxml.etree")
    skcphd = import_module("sarkit.cphd")
    low, high = float(vectors["FX1"][0]), float(vectors["FX2"][0])
    leaves: _Leaves = {
        "CollectionID/CollectorName": "receiver, simulated",
        "CollectionID/IlluminatorName": "transmitter, simulated",
        "CollectionID/CoreName": printable(mission.name),
        "CollectionID/CollectType": "BISTATIC",
        "CollectionID/RadarMode/ModeType": "SPOTLIGHT",
        "CollectionID/Classification": "UNCLASSIFIED",
        "CollectionID/ReleaseInfo": "UNRESTRICTED",
        "Global/DomainType": "FX",
        "Global/SGN": -1,
        "Global/Timeline/CollectionStart": start.as_datetime().strftime("%Y-%m-%dT%H:%M:%S.%fZ"),
        "Global/Timeline/TxTime1": float(vectors["TxTime"][0]),
        "Global/Timeline/TxTime2": float(vectors["TxTime"][-1]),
        "Global/FxBand/FxMin": low,
        "Global/FxBand/FxMax": high,
        "Global/TOASwath/TOAMin": -plan.delay,
        "Global/TOASwath/TOAMax": plan.delay,
        **_scene_coordinates(plan, axes),
        "Data/SignalArrayFormat": "CF8",
        "Data/NumBytesPVP": vectors.dtype.itemsize,
        "Data/NumCPHDChannels": 1,
        "Data/Channel/Identifier": _CHANNEL,
        "Data/Channel/NumVectors": plan.pulses,
        "Data/Channel/NumSamples": plan.samples,
        "Data/Channel/SignalArrayByteOffset": 0,
        "Data/Channel/PVPArrayByteOffset": 0,
        "Data/NumSupportArrays": 0,
        "Channel/RefChId": _CHANNEL,
        "Channel/FXFixedCPHD": True,
        "Channel/TOAFixedCPHD": True,
        "Channel/SRPFixedCPHD": True,
        "Channel/Parameters/Identifier": _CHANNEL,
        "Channel/Parameters/RefVectorIndex": plan.pulses // 2,
        "Channel/Parameters/FXFixed": True,
        "Channel/Parameters/TOAFixed": True,
        "Channel/Parameters/SRPFixed": True,
        "Channel/Parameters/SignalNormal": True,
        "Channel/Parameters/Polarization/TxPol": "UNSPECIFIED",
        "Channel/Parameters/Polarization/RcvPol": "UNSPECIFIED",
        "Channel/Parameters/FxC": (low + high) / 2,
        "Channel/Parameters/FxBW": high - low,
        "Channel/Parameters/TOASaved": 2 * plan.delay,
        "Channel/Parameters/DwellTimes/CODId": "1",
        "Channel/Parameters/DwellTimes/DwellId": "1",
        **_layout(vectors),
        "Dwell/NumCODTimes": 1,
        "Dwell/CODTime/Identifier": "1",
        "Dwell/CODTime/CODTimePoly": offset,
        "Dwell/NumDwellTimes": 1,
        "Dwell/DwellTime/Identifier": "1",
        "Dwell/DwellTime/DwellTimePoly": mission.collection.aperture_time,
        **_error_parameters(mission, axes, remarks),
        **_product(mission, targets, remarks),
    }
    root = etree.Element(f"{{{NAMESPACE}}}CPHD", nsmap={None: NAMESPACE})
    _grow(etree, root, leaves)
    tree = root.getroottree()
    with np.errstate(all="ignore"):  # the standard has rules for a fixed platform, without a direction of motion
        geometry = skcphd.compute_reference_geometry(tree, vectors)
    root.find("{*}Dwell").addnext(geometry)
    return tree


def _grow(etree: ModuleType, root: "_Element", leaves: _Leaves) -> None:
    """Add an element below the root for each path in `leaves`, with the value as its text.

    A name in a path may have an attribute, such as `IACP@index=1`. The value of an element whose name ends with
    `Poly` becomes the constant term of a polynomial of order 0.
    """
    elements = {"": root}
    for path, value in leaves.items():
        element_path = ""
        for step in path.split("/"):
            parent, element_path = element_path, f"{element_path}/{step}"
            if element_path not in elements:
                tag, _, attribute = step.partition("@")
                elements[element_path] = etree.SubElement(elements[parent], f"{{{NAMESPACE}}}{tag}")
                if attribute:
                    elements[element_path].set(*attribute.split("=", 1))
        node = elements[element_path]
        if path.endswith("Poly"):
            node.set("order1", "0")
            node.set("order2", "0")
            node = etree.SubElement(node, f"{{{NAMESPACE}}}Coef", exponent1="0", exponent2="0")
        is_bool = isinstance(value, bool)
        node.text = str(value).lower() if is_bool else repr(value) if isinstance(value, float) else str(value)


def _xyz(path: str, vector: Vector) -> _Leaves:
    return {f"{path}/{axis}": float(component) for axis, component in zip("XYZ", vector, strict=True)}


def _degrees(path: str, point: Geodetic) -> _Leaves:
    return {f"{path}/Lat": math.degrees(point.latitude), f"{path}/Lon": math.degrees(point.longitude)}


def _scene_coordinates(plan: _Plan, axes: SceneAxes) -> _Leaves:
    """Make the elements of `SceneCoordinates`: the ground plane (x east, y north), the image area and the image grid.

    The corners of the image area are listed clockwise as seen from above.
    """
    half = plan.half
    corners = [(-half, -half), (-half, half), (half, half), (half, -half)]
    reference_point = geodetic(axes.origin)
    pixels = math.ceil(2 * half / (min(plan.cell) / 2))
    step = 2 * half / pixels
    leaves: _Leaves = {
        "EarthModel": "WGS_84",
        **_xyz("IARP/ECF", axes.origin),
        **_degrees("IARP/LLH", reference_point),
        "IARP/LLH/HAE": reference_point.height,
        **_xyz("ReferenceSurface/Planar/uIAX", plain_vector(axes.axes[0])),
        **_xyz("ReferenceSurface/Planar/uIAY", plain_vector(axes.axes[1])),
        **{f"ImageArea/X1Y1/{axis}": -half for axis in "XY"},
        **{f"ImageArea/X2Y2/{axis}": half for axis in "XY"},
    }
    for index, (x, y) in enumerate(corners, 1):
        leaves |= _degrees(f"ImageAreaCornerPoints/IACP@index={index}", geodetic(axes.earth_fixed((x, y, 0.0))))
    for key in ("Line", "Sample"):
        leaves[f"ImageGrid/IARPLocation/{key}"] = (pixels - 1) / 2
    for extent, key in (("IAXExtent", "Line"), ("IAYExtent", "Sample")):
        sizes = {f"{key}Spacing": step, f"First{key}": 0, f"Num{key}s": pixels}
        leaves |= {f"ImageGrid/{extent}/{name}": size for name, size in sizes.items()}
    return {f"SceneCoordinates/{path}": value for path, value in leaves.items()}


def _layout(vectors: Records) -> _Leaves:
    fields: Mapping[str, Any] = vectors.dtype.fields or {}
    leaves: _Leaves = {}
    for name, size in _VECTOR_WORDS:
        form = "X=F8;Y=F8;Z=F8;" if size == 3 else "I8" if name == "SIGNAL" else "F8"
        attributes = {"Offset": int(fields[name][1]) // 8, "Size": size, "Format": form}
        leaves |= {f"PVP/{name}/{key}": value for key, value in attributes.items()}
    return leaves


def _product(mission: Mission, targets: Targets, remarks: list[str]) -> _Leaves:
    parameters = {
        "version": __version__,
        "mission": os.path.basename(printable(mission.file)),
        "mission SHA-256": hashlib.sha256(mission.data).hexdigest(),
        "signal": "exact ranges of the paths as flown",
        "vectors": "positions as measured: as flown, plus the declared errors",
        "points": "; ".join(
            f"{target.east:.9g}, {target.north:.9g}, {target.level_db:.6g}" for target in targets.points
        ),
        "points are": "east [m], north [m], level [dB]",
    }
    if targets.clutter_db is not None:
        parameters["clutter [dB]"] = f"{targets.clutter_db:g}"
    for index, remark in enumerate(remarks, 1):
        parameters[f"remark {index}"] = remark
    return {f"ProductInfo/Parameter@name={ADDED} {key}": value for key, value in parameters.items()}


# ---------------------------------------------------------------------- declared errors
def _error_parameters(mission: Mission, axes: SceneAxes, remarks: list[str]) -> _Leaves:
    """Make the elements of `ErrorParameters` from the declared errors of both platforms.

    The result is empty if no errors are declared. The elements state declared sizes as one sigma, without the
    coverage factor. The sigmas of each platform include the errors that both platforms share. Errors for which the
    standard has no element are in `AddedParameters`. What `import` cannot make keys of a mission from is named in
    sentences that are added to `remarks`.
    """
    added: dict[str, str] = {}
    leaves: _Leaves = {}
    timing = mission.timing_error  # of the receiver's clock, counted against the transmitter's
    clock_sigmas = {
        element: abs(value)
        for element, term in _CLOCK_ELEMENTS.items()
        if (value := getattr(timing, term)) is not None
    }
    for owner, side in (("transmitter", "TxPlatform"), ("receiver", "RcvPlatform")):
        leaves |= _pos_vel_err(f"{side}/PosVelErr", *_covariance(mission, owner, axes, added, remarks))
        # The schema requires CollectionStartTime.
        sensor = {**(clock_sigmas if owner == "receiver" else {}), "CollectionStartTime": 0.0}
        leaves |= {f"{side}/RadarSensor/{key}": value for key, value in sensor.items()}
    for term in TIMING_KIND.sizes:
        bias = timing.bias.get(term)
        if bias is not None:
            added[f"timing.{term}.bias"] = f"{bias:.12g} {TIMING_KIND.clock_size(term).dimension.si}".rstrip()
    added |= _rows_without_element(mission, added)
    if mission.common_motion_error is not None:
        remarks.append(
            "a CPHD file has no error that both platforms share: the sigmas and biases of each platform hold "
            "common_motion_error, and import takes them for errors of its own"
        )
    unread = [key for key in added if not is_read_back(key) and not key.endswith(".common")]
    if unread:
        remarks.append(f"of these errors import makes comments, and no keys of a mission: {', '.join(unread)}")
    has_no_sigmas = all(
        added.get(f"{owner}.{kind.name}") for owner in ("transmitter", "receiver") for kind in MEASURED_KINDS
    )
    if has_no_sigmas and not clock_sigmas and len(added) == 4:
        return {}
    leaves |= {f"AddedParameters/Parameter@name={ADDED} {key}": value for key, value in added.items()}
    return {f"ErrorParameters/Bistatic/{path}": value for path, value in leaves.items()}


def _rows_without_element(mission: Mission, added: Mapping[str, str]) -> dict[str, str]:
    """Map row ids to declared sizes, as strings, for the errors that have no element in the CPHD standard.

    The sizes do not include the coverage factor. Errors that are already in `added` are left out.
    """
    alone = mission._replace(allocation=mission.allocation._replace(coverage_factor=1.0))
    clock_subjects = [subject("clock", TIMING_KIND.name, term) for term in _CLOCK_ELEMENTS.values()]
    sizes: dict[str, str] = {}
    for row in check_mission(alone, date.min).rows:
        kind = row.subject.facts
        has_element = row.id in added or row.subject in clock_subjects
        has_element |= isinstance(kind, StateKind) and (row.owner in PLATFORMS or kind.has_covariance)
        if row.declared is not None and not has_element and kind.is_source:
            sizes[row.id] = f"{row.declared:.12g} {row.unit}".rstrip()
            # Biases of clocks and motion are in `added` already, the latter along the axes of the file.
            if row.bias is not None and not isinstance(kind, StateKind) and row.subject.facts is not TIMING_KIND:
                sizes[f"{row.id}.bias"] = f"{row.bias:.12g} {row.unit}".rstrip()
    return sizes


def _covariance(
    mission: Mission, owner: str, axes: SceneAxes, added: dict[str, str], remarks: list[str]
) -> tuple[Floats, str]:
    """Compute the error covariance (6, 6) of position and velocity of one platform, and name its frame.

    Units are m², m²/s and m²/s². The frame is `ECF` or `RIC_ECI` of the standard. Declared errors that a covariance
    cannot express, such as an acceleration, are added to `added` as strings. What is lost is added to `remarks`.
    """
    error = getattr(mission.platforms, owner).motion_error
    state: PlatformState = getattr(mission.geometry, owner)
    common = mission.common_motion_error
    is_radial = error.frame == "ric" and common is None
    source: Axes = state.frame(error.frame)
    covariance = np.zeros((6, 6))
    if error.covariance is not None:
        sigmas = np.array(error.covariance.sigmas)
        covariance = np.outer(sigmas, sigmas) * np.array(error.covariance.correlation)
    for kind in MEASURED_KINDS:
        block = slice(3 * kind.order, 3 * kind.order + 3)
        stated_sigmas = getattr(error, kind.name)
        if stated_sigmas is not None:
            covariance[block, block] = np.diag(np.square(stated_sigmas))
        elif error.covariance is None and (common is None or getattr(common, kind.name) is None):
            added[f"{owner}.{kind.name}"] = "not declared"
    is_turned = not is_radial and error.frame != "scene"
    if error.acceleration is not None:
        sizes = np.array(error.acceleration)
        if is_turned:  # the axes have independent errors: their variances add, and not the signed sizes
            sizes = np.sqrt(np.square(np.array(source).T) @ np.square(sizes))
            if np.ptp(np.abs(error.acceleration)) > 0:
                remarks.append(f"{owner}.acceleration: its sizes along the scene's axes are stated as uncorrelated")
        added[f"{owner}.acceleration"] = _numbers(sizes, "m/s^2")
    along_file = _biases(mission, owner, is_radial=is_radial)
    for kind in STATE_KINDS:
        if kind.name in along_file:
            added[f"{owner}.{kind.name}.bias"] = _numbers(along_file[kind.name], kind.unit)
    if error.time_tag is not None:
        added[f"{owner}.time_tag"] = f"{error.time_tag:.12g} s"
    for name, biases in ((owner, error.bias), ("common", {} if common is None else common.bias)):
        if (bias := biases.get(TIME_TAG_KIND.name)) is not None:
            added[f"{name}.time_tag.bias"] = f"{bias:.12g} s"
    if error.lever_arm is not None and error.lever_arm.uncertainty is not None:
        added[f"{owner}.lever_arm.uncertainty"] = _numbers(np.array(error.lever_arm.uncertainty), "m")
    if common is not None and common.time_tag is not None:
        added["common.time_tag"] = f"{common.time_tag:.12g} s"
    distributions = []
    for kind in STATE_KINDS:
        names = [error.distribution_of(kind.name)] if any(error.stated(kind.name) or ()) else []
        is_along_others = is_turned
        if common is not None and kind in MEASURED_KINDS and any(getattr(common, kind.name) or ()):
            names.append(common.distribution_of(kind.name))
            is_along_others |= common.frame != "scene"
        # A sum of errors, or a component along other axes, is neither uniform nor at a bound.
        is_lost = bool(set(names) - {"normal"}) and (is_along_others or len(names) > 1)
        if is_lost:
            remarks.append(
                f"{owner}.{kind.name}: the file has the sum of errors, or other axes than the mission, so that no "
                f"distribution ({', '.join(names)}) fits: the sizes are stated as if normal"
            )
        default = "normal" if is_turned else error.distribution_of(kind.name)
        distributions.append("normal" if is_lost else names[0] if names else default)
    if set(distributions) != {"normal"}:
        added[f"{owner}.distribution"] = distributions[0] if len(set(distributions)) == 1 else " ".join(distributions)
    if is_radial:
        return covariance, "RIC_ECI"
    # Columns are the axes of the error's frame in the scene's axes. Rows are the scene's axes in Earth-fixed axes.
    covariance = _along_scene(covariance, state, error.frame)
    if common is not None:
        shared = np.zeros((6, 6))
        for kind in MEASURED_KINDS:
            shared_sigmas = getattr(common, kind.name)
            if shared_sigmas is not None:
                block = slice(3 * kind.order, 3 * kind.order + 3)
                shared[block, block] = np.diag(np.square(shared_sigmas))
        covariance = covariance + _along_scene(shared, state, common.frame)
        added[f"{owner}.common"] = "the sigmas hold an error that both platforms share"
    turn_of_both = np.kron(np.eye(2), np.array(axes.axes).T)
    return turn_of_both @ covariance @ turn_of_both.T, "ECF"


def _biases(mission: Mission, owner: str, *, is_radial: bool) -> dict[str, Floats]:
    """Biases of one platform by the kind of error, along the axes of the scene, or of `ric` if `is_radial`.

    They include the biases that both platforms share: constants add, so that nothing is lost by this.
    """
    state: PlatformState = getattr(mission.geometry, owner)
    biases: dict[str, Floats] = {}
    for error in (getattr(mission.platforms, owner).motion_error, mission.common_motion_error):
        if error is None:
            continue
        axes = np.array(state.frame(error.frame), dtype=float)
        turn = np.eye(3) if is_radial else axes.T
        for kind in STATE_KINDS:
            bias = error.bias_of(kind.name)
            if bias is None:
                continue
            biases[kind.name] = biases.get(kind.name, np.zeros(3)) + turn @ bias
            if kind.order == 0 and error.frame == "ric" and not is_radial and state.fall is not None:
                # As in `_along_scene`: `ric` has inertial velocities, the scene those relative to the Earth.
                rate = np.cross(-axes @ np.array(state.fall.rotation), bias)
                biases["velocity"] = biases.get("velocity", np.zeros(3)) + turn @ rate
    return biases


def _numbers(vector: Floats, unit: str) -> str:
    """Components of a vector and their unit as text, for an added parameter."""
    return f"{' '.join(f'{x:.12g}' for x in vector)} {unit}"


def _along_scene(covariance: Floats, state: PlatformState, frame: str) -> Floats:
    """Rotate a covariance (6, 6) from a motion-error frame to the scene axes.

    The velocity errors in the result are errors of the velocity relative to the rotating Earth, not of the inertial
    velocity.
    """
    axes = np.array(state.frame(frame), dtype=float)
    if frame == "ric" and state.fall is not None:
        covariance = with_rate(covariance, -axes @ np.array(state.fall.rotation))
    return block_turned(covariance, axes.T)


def _pos_vel_err(path: str, covariance: Floats, frame: str) -> _Leaves:
    sigmas, correlation = correlated(covariance)
    leaves: _Leaves = {f"{path}/Frame": frame}
    leaves |= {f"{path}/{kind}": float(sigma) for kind, sigma in zip(SIGMA_NAMES, sigmas, strict=True)}
    for row in range(6):
        for column in range(row + 1, 6):
            leaves[f"{path}/CorrCoefs/{SIGMA_NAMES[row]}{SIGMA_NAMES[column]}"] = float(correlation[row, column])
    return leaves


def _file(tree: "_ElementTree", vectors: Records, signal: NDArray[np.generic]) -> bytes:
    """Combine XML, vectors and signal into a CPHD file with sarkit, and return the bytes of the file."""
    skcphd = import_module("sarkit.cphd")
    with tempfile.TemporaryFile() as stream:  # the writer needs a real file
        with skcphd.Writer(stream, skcphd.Metadata(xmltree=tree)) as writer:
            writer.write_pvp(_CHANNEL, vectors)
            writer.write_signal(_CHANNEL, signal)
        stream.flush()
        stream.seek(0, io.SEEK_SET)
        return stream.read()
