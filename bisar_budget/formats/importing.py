"""Import of collections from CPHD, CRSD and SICD files.

The paths of the platforms are fitted to the positions that CPHD and CRSD state for each pulse. SICD states the paths
as polynomials of time.
"""

import hashlib
import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import NamedTuple

import numpy as np

from bisar_budget.arrays import Records
from bisar_budget.constants import SPEED_OF_LIGHT_MPS
from bisar_budget.faults import printable, shown
from bisar_budget.formats.collected import (
    MAX_APERTURE_S,
    FileErrors,
    Imported,
    NoPathError,
    ReferenceGeometry,
    Seen,
    fitted,
    of_matrices,
    of_sigmas,
    reference_of,
)
from bisar_budget.formats.containers import Container, Element, FormatError, check_extra, open_container
from bisar_budget.geometry import PlatformState, Vector
from bisar_budget.paths.earth import Floats, SceneAxes, axes_at, geodetic
from bisar_budget.paths.flight import Fitted
from bisar_budget.paths.instant import parse_instant

_POLYNOMIAL_SAMPLES = 201  # times at which a polynomial of the file is sampled; enough for the orders in files
_LIGHT_TIME_STEPS = 5  # each round reduces the error by v/c
_MAX_RADIUS_M = 4.1e8  # from the Earth's centre; a position farther away is invalid
_MAX_GAP_FRACTION = 0.02  # of the aperture that may be without pulses at its ends


@dataclass(frozen=True, eq=False)
class _Pulses:
    """Times of transmission and reception of pulses [s], and Earth-fixed platform positions at these times [m]."""

    sent: Floats
    transmitter: Floats
    received: Floats
    receiver: Floats
    reference: int  # index of the reference vector among them
    unused: int = 0  # number of other vectors, which lack a pulse, a time or a position

    @property
    def unused_words(self) -> str:
        """Text that states how many vectors of the file are not used, and why; empty if all vectors are used."""
        if not self.unused:
            return ""
        count = self.sent.size + self.unused
        return f"without a pulse, a time or a position, and not used: {self.unused} of {count} vectors"


class _Aperture(NamedTuple):
    """Time interval in which the radar illuminates the scene point.

    `middle` is the middle of the interval, in seconds after the start of the collection, and `length` is its
    duration [s].
    """

    middle: float
    length: float


def import_collection(file: str, channel: str | None = None) -> Imported:
    """Read scene, band, aperture, paths and errors from a CPHD, CRSD or SICD file, or from the XML of CPHD or SICD.

    The signal is not read. `channel` is the identifier of a channel of CPHD or CRSD; None selects the reference
    channel.

    Raises
    ------
    FormatError
        The file cannot be used.
    MissingExtraError
        The extra `formats` is not installed.
    """
    check_extra()
    container = open_container(file)
    read: Callable[[Container, str | None], Imported] = _FORMAT_READERS[container.format.split()[0]]
    with np.errstate(all="ignore"):  # results that are not finite are refused later
        return read(container, channel)


# ---------------------------------------------------------------------- CPHD
def _cphd(container: Container, channel: str | None) -> Imported:
    """Import CPHD 1.0.1 or 1.1.0 (NGA.STND.0068-1).

    The collection is read from the vectors of the file, or from `ReferenceGeometry` if the file has no vectors.
    """
    xml = container.xml
    channel, parameters = _chosen(xml, channel, "Channel/Parameters", "Identifier")
    center, bandwidth = parameters.number("FxC"), parameters.number("FxBW")
    is_monostatic = xml.text("CollectionID/CollectType") == "MONOSTATIC"
    start = xml.one("Global/Timeline/CollectionStart")
    name, remarks = _names(xml, "CollectionID")
    unused = ""
    if container.has_vectors:
        data = xml.with_child("Data/Channel", "Identifier", channel)
        if data is None:
            raise xml.fault(f"has no channel {shown(channel)!r}", "Data")
        vectors = container.vectors(
            "PVP", data.whole("PVPArrayByteOffset"), data.whole("NumVectors"), _dtype(xml, "PVP")
        )
        pulses, point = _pulses_of_cphd(container, vectors, parameters)
        aperture = _dwell(xml, xml.maybe("Dwell"), parameters.one("DwellTimes"), point)
        seen = _flown(container, pulses, point, aperture, center)
        remarks += _coverage(pulses, seen.axes, aperture)
        reference, unused = _at_reference(pulses, seen, aperture), pulses.unused_words
    else:
        point = xml.vector("ReferenceGeometry/SRP/ECF")
        dwell = xml.number("ReferenceGeometry/SRPDwellTime")
        aperture = _Aperture(xml.number("ReferenceGeometry/ReferenceTime"), dwell)
        seen = _stated(xml, axes_at(geodetic(point)), is_monostatic)
        reference = reference_of(seen, 0.0)
        remarks.append(
            "The file is XML without parameters of pulses: both platforms are taken from its ReferenceGeometry, and "
            "fly straight on. Slow time counts from its ReferenceTime, not from the centre of the dwell "
            f"({xml.number('ReferenceGeometry/SRPCODTime') - aperture.middle:+.6g} s)."
        )
    remarks += _off_reference_point(xml, point)
    errors = of_sigmas(xml.maybe("ErrorParameters"), seen, is_monostatic=is_monostatic)
    return _imported(
        container, channel, name, point, (center, bandwidth), aperture, start, seen, is_monostatic, reference, errors,
        remarks, unused,
    )  # fmt: skip


def _dtype(xml: Element, block: str) -> np.dtype[np.void]:
    """Make the NumPy data type of one record of the block PVP or PPP from its description in the XML."""
    module = import_module("sarkit.cphd" if xml.tag == "CPHD" else "sarkit.crsd")
    reads = module.get_ppp_dtype if block == "PPP" else module.get_pvp_dtype
    try:
        dtype: np.dtype[np.void] = reads(xml.node.getroottree())
    except (AttributeError, IndexError, KeyError, SyntaxError, TypeError, ValueError) as error:
        raise xml.fault(f"describes no parameters ({shown(str(error))})", block) from None
    return dtype


def _fields(xml: Element, vectors: Records, block: str, *names: str) -> list[Floats]:
    columns = []
    for name in names:
        if name not in (vectors.dtype.names or ()):
            raise xml.fault("is missing", f"{block}/{name}")
        values = vectors[name]
        if values.dtype.names == ("Int", "Frac"):
            values = values["Int"] + values["Frac"]
        if values.dtype.kind not in "iuf" or values.shape[1:] != ((3,) if name.endswith(("Pos", "Vel")) else ()):
            raise xml.fault("has another form than the standard's", f"{block}/{name}")
        columns.append(np.asarray(values, dtype=float))
    return columns


def _pulses_of_cphd(container: Container, vectors: Records, parameters: Element) -> tuple[_Pulses, Vector]:
    names = ("TxTime", "TxPos", "RcvTime", "RcvPos", "SRPPos")
    sent, transmitter, received, receiver, points = _fields(container.xml, vectors, "PVP", *names)
    reference = parameters.whole("RefVectorIndex")
    if reference >= len(vectors):
        raise parameters.fault(f"is beyond the {len(vectors)} vectors", "RefVectorIndex")
    usable = np.isfinite(sent) & np.isfinite(received)
    for positions in (transmitter, receiver, points):
        usable &= (np.abs(positions) < _MAX_RADIUS_M).all(axis=1)
    if not usable[reference]:
        raise parameters.fault("is a vector without times or positions", "RefVectorIndex")
    x, y, z = (float(value) for value in points[reference])
    pulses = _Pulses(
        sent[usable],
        transmitter[usable],
        received[usable],
        receiver[usable],
        int(usable[:reference].sum()),
        int((~usable).sum()),
    )
    return pulses, (x, y, z)


def _scene_time(pulses: _Pulses, axes: SceneAxes) -> Floats:
    """Compute the time at which each pulse reaches the scene point, (pulses,). [s]

    This is the reference time of CPHD 1.1.0, section 6.5.1 (5).
    """
    transmit_range = np.linalg.norm(pulses.transmitter - axes.origin, axis=1)
    receive_range = np.linalg.norm(pulses.receiver - axes.origin, axis=1)
    scene_time: Floats = pulses.sent + transmit_range / (transmit_range + receive_range) * (
        pulses.received - pulses.sent
    )
    return scene_time


def _dwell(xml: Element, dwell: Element | None, identifiers: Element, point: Vector) -> _Aperture:
    """Compute the aperture at the scene point from the dwell polynomials (CPHD 1.1.0, section 6.5.1 (6))."""
    if dwell is None:
        raise xml.fault("is missing: nothing says how long the scene point is seen", "Dwell")
    times = []
    x, y = _image_coordinates(xml.one("SceneCoordinates"), point)
    for name, key in (("CODTime", "CODId"), ("DwellTime", "DwellId")):
        polynomial = dwell.with_child(name, "Identifier", identifiers.text(key))
        if polynomial is None:
            raise identifiers.fault(f"names no {name} of {dwell.path}", key)
        coefficients = polynomial.polynomial(f"{name}Poly", 2)
        times.append(float(np.polynomial.polynomial.polyval2d(x, y, coefficients)))
    if not times[1] > 0:
        raise identifiers.fault(f"gives a dwell time of {times[1]:g} s at the scene point")
    return _Aperture(*times)


def _image_coordinates(scene: Element, point: Vector) -> tuple[float, float]:
    """Compute the image area coordinates IAX and IAY of a point on the reference surface of a CPHD file. [m]

    The surface is a plane, or a surface of constant height.
    """
    planar = scene.maybe("ReferenceSurface/Planar")
    if planar is not None:
        offset = np.subtract(point, scene.vector("IARP/ECF"))
        return float(offset @ planar.vector("uIAX")), float(offset @ planar.vector("uIAY"))
    level = scene.one("ReferenceSurface/HAE")
    geodetic_point = geodetic(point)
    origin = [math.radians(scene.number(f"IARP/LLH/{name}")) for name in ("Lat", "Lon")]
    axes = np.array([[level.number(f"{axis}/{name}") for name in ("Lat", "Lon")] for axis in ("uIAXLL", "uIAYLL")])
    longitude_offset = math.remainder(geodetic_point.longitude - origin[1], 2 * math.pi)
    try:
        x, y = np.linalg.solve(axes.T, [geodetic_point.latitude - origin[0], longitude_offset])
    except np.linalg.LinAlgError:
        raise level.fault("has axes along one line") from None
    return float(x), float(y)


def _off_reference_point(xml: Element, point: Vector) -> list[str]:
    origin = xml.maybe("SceneCoordinates/IARP/ECF")
    distance = 0.0 if origin is None else math.dist(origin.vector(), point)
    if distance < 1e-3:
        return []
    return [f"The scene point is {distance:.6g} m from the image area's reference point (IARP)."]


def _stated(xml: Element, axes: SceneAxes, is_monostatic: bool) -> Seen:
    """Make straight paths from the position and velocity of each platform in `ReferenceGeometry` of CPHD."""
    geometry = xml.one("ReferenceGeometry")
    paths = (
        ("Monostatic/ARP", "Monostatic/ARP") if is_monostatic else ("Bistatic/TxPlatform/", "Bistatic/RcvPlatform/")
    )
    tracks = []
    for path in paths:
        position, velocity = (geometry.vector(f"{path}{quantity}") for quantity in ("Pos", "Vel"))
        state = PlatformState(position=axes.place(position), velocity=axes.turned(velocity))
        tracks.append(Fitted(state, order=1, farthest=0.0, rms=0.0))
    return Seen(tracks[0], tracks[1], axes)


# ---------------------------------------------------------------------- CRSD
def _crsd(container: Container, channel: str | None) -> Imported:
    """Import a SAR collection in CRSD 1.0 (NGA.STND.0080-2) from its transmitted pulses and receive windows."""
    xml = container.xml
    if xml.tag != "CRSDsar":
        raise FormatError(container.file, f"/{xml.tag} is one way of a collection; accepted: CRSDsar, which has both")
    channel, parameters = _chosen(xml, channel, "Channel/Parameters", "Identifier")
    sar = parameters.one("SARImage")
    sequence = xml.with_child("TxSequence/Parameters", "Identifier", sar.text("TxId"))
    if sequence is None:
        raise sar.fault("names no transmit sequence of the file", "TxId")
    is_monostatic = xml.text("SARInfo/CollectType") == "MONOSTATIC"
    point = xml.vector("ReferenceGeometry/RefPoint/ECF")
    aperture = _dwell(xml, xml.maybe("DwellPolynomials"), sar.one("DwellTimes/Polynomials"), point)
    if "PVP" not in container.blocks or "PPP" not in container.blocks:
        raise FormatError(container.file, "byte 0: has no parameters of pulses (PPP) and of receive windows (PVP)")
    receive_channel = xml.with_child("Data/Receive/Channel", "ChId", channel)
    transmit_sequence = xml.with_child("Data/Transmit/TxSequence", "TxId", sar.text("TxId"))
    if receive_channel is None or transmit_sequence is None:
        raise xml.fault("lacks the channel or its transmit sequence", "Data")
    vectors = container.vectors(
        "PVP", receive_channel.whole("PVPArrayByteOffset"), receive_channel.whole("NumVectors"), _dtype(xml, "PVP")
    )
    transmit_vectors = container.vectors(
        "PPP", transmit_sequence.whole("PPPArrayByteOffset"), transmit_sequence.whole("NumPulses"), _dtype(xml, "PPP")
    )
    pulses = _pulses_of_crsd(container, vectors, transmit_vectors, point, parameters)
    center, bandwidth = sequence.number("FxC"), sequence.number("FxBW")
    seen = _flown(container, pulses, point, aperture, center)
    errors = of_matrices(xml.maybe("ErrorParameters/SARImage"), seen, ("PosVelError", "TimeFreqCov"), (2, 3))
    remarks = [*_coverage(pulses, seen.axes, aperture), *_off_reference_point(xml, point)]
    name = xml.maybe("ProductInfo/ProductName")
    return _imported(
        container, channel, name.text() if name is not None else "", point, (center, bandwidth), aperture,
        xml.one("Global/CollectionRefTime"), seen, is_monostatic, _at_reference(pulses, seen, aperture), errors,
        remarks, pulses.unused_words,
    )  # fmt: skip


def _pulses_of_crsd(
    container: Container, vectors: Records, transmit_vectors: Records, point: Vector, parameters: Element
) -> _Pulses:
    """Read the pulses, and compute when and where the echo of the scene point is received for each pulse.

    The file states position and velocity of the receiver at the start of the receive window. With this velocity the
    position is extrapolated to the time of the echo, less than a millisecond later.
    """
    xml = container.xml
    window_start, positions, velocities, index = _fields(
        xml, vectors, "PVP", "RcvStart", "RcvPos", "RcvVel", "TxPulseIndex"
    )
    sent, transmitter = _fields(xml, transmit_vectors, "PPP", "TxTime", "TxPos")
    usable = np.isfinite(index) & (index >= 0) & (index < len(transmit_vectors)) & np.isfinite(window_start)
    usable &= (np.abs(positions) < _MAX_RADIUS_M).all(axis=1) & np.isfinite(velocities).all(axis=1)
    usable[usable] = (np.isfinite(sent) & np.isfinite(transmitter).all(axis=1))[index[usable].astype(int)]
    reference = parameters.whole("RefVectorIndex")
    if reference >= len(vectors) or not usable[reference]:
        raise parameters.fault("is no vector with a pulse", "RefVectorIndex")
    pulse_index = index[usable].astype(int)
    sent, transmitter, window_start = sent[pulse_index], transmitter[pulse_index], window_start[usable]
    positions, velocities = positions[usable], velocities[usable]
    transmit_range = np.linalg.norm(transmitter - point, axis=1)
    received, receiver = window_start, positions
    for _ in range(_LIGHT_TIME_STEPS):
        received = sent + (transmit_range + np.linalg.norm(receiver - point, axis=1)) / SPEED_OF_LIGHT_MPS
        receiver = positions + velocities * (received - window_start)[:, None]
    return _Pulses(sent, transmitter, received, receiver, int(usable[:reference].sum()), int((~usable).sum()))


# ---------------------------------------------------------------------- SICD
def _sicd(container: Container, channel: str | None) -> Imported:
    """Import SICD (NGA.STND.0024-1); the paths are its position polynomials, sampled in the aperture of the image."""
    xml = container.xml
    if channel is not None:
        raise FormatError(container.file, f"a SICD is one image and has no channel {shown(channel)!r}")
    index = xml.maybe("RadarCollection/RefFreqIndex")
    if index is not None and index.whole():
        raise index.fault("counts frequencies from one that the file keeps to itself")
    band = xml.one("ImageFormation/TxFrequencyProc")
    low, high = band.number("MinProc"), band.number("MaxProc")
    is_monostatic = xml.text("CollectionInfo/CollectType") == "MONOSTATIC"
    point = xml.vector("GeoData/SCP/ECF")
    scene_time = xml.number("SCPCOA/SCPTime")
    transmitter_path, receiver_path = _polynomials_of_sicd(xml, is_monostatic)

    def pulses_at(times: Floats) -> _Pulses:
        """Compute times and platform positions for the pulses that reach the scene point at `times`."""
        sent, received = times, times
        if not is_monostatic:  # a monostatic aperture reference point is at the time in between
            for _ in range(_LIGHT_TIME_STEPS):
                sent = times - np.linalg.norm(_over(transmitter_path, sent) - point, axis=1) / SPEED_OF_LIGHT_MPS
                received = times + np.linalg.norm(_over(receiver_path, received) - point, axis=1) / SPEED_OF_LIGHT_MPS
        return _Pulses(sent, _over(transmitter_path, sent), received, _over(receiver_path, received), times.size // 2)

    name, collectors = _names(xml, "CollectionInfo")
    aperture, remarks = _aperture_of_sicd(xml, point, scene_time, (low + high) / 2, pulses_at)
    times: Floats = scene_time + np.linspace(-0.5, 0.5, _POLYNOMIAL_SAMPLES) * aperture.length
    seen = _flown(container, pulses_at(times), point, aperture, (low + high) / 2)
    statistics = xml.maybe("ErrorStatistics")
    components = statistics.maybe("BistaticComponents") if statistics is not None else None
    errors = (
        of_matrices(components, seen, ("PosVelErr", "TxRcvTimeFreq"), (1, 3))
        if components is not None
        else of_sigmas(statistics, seen, is_monostatic=is_monostatic)
    )
    return _imported(
        container, "", name, point, ((low + high) / 2, high - low), aperture, xml.one("Timeline/CollectStart"), seen,
        is_monostatic, reference_of(seen, 0.0), errors, [*collectors, *remarks],
    )  # fmt: skip


def _over(polynomial: Floats, times: Floats) -> Floats:
    """Evaluate a path polynomial at times (n,); returns the positions (n, 3)."""
    positions: Floats = np.asarray(np.polynomial.polynomial.polyval(times, polynomial).T, dtype=float)
    return positions


def _polynomials_of_sicd(xml: Element, is_monostatic: bool) -> tuple[Floats, Floats]:
    position = xml.one("Position")
    if is_monostatic:
        both = position.path_polynomial("ARPPoly")
        return both, both
    channel = (
        xml.text("ImageFormation/RcvChanProc/ChanIndex") if xml.maybe("ImageFormation/RcvChanProc/ChanIndex") else "1"
    )
    channel_parameters = next(
        (
            element
            for element in xml.all("RadarCollection/RcvChannels/ChanParameters")
            if element.node.get("index") == channel
        ),
        None,
    )
    phase_centre = (
        channel_parameters.text("RcvAPCIndex")
        if channel_parameters is not None and channel_parameters.maybe("RcvAPCIndex") is not None
        else "1"
    )
    receiver = next(
        (element for element in position.all("RcvAPC/RcvAPCPoly") if element.node.get("index") == phase_centre), None
    )
    if receiver is None:
        raise position.fault(
            f"has no phase centre {shown(phase_centre)} that the processed channel was received by", "RcvAPC"
        )
    holder = Element(xml.file, receiver.node.getparent())
    index = [node is receiver.node for node in holder.node.findall("{*}RcvAPCPoly")].index(True) + 1
    return position.path_polynomial("TxAPCPoly"), holder.path_polynomial(f"RcvAPCPoly[{index}]")


def _aperture_of_sicd(
    xml: Element, point: Vector, middle: float, center: float, pulses_at: Callable[[Floats], _Pulses]
) -> tuple[_Aperture, list[str]]:
    """Compute the aperture of a pixel at the scene point, and make remarks that explain it.

    The aperture is the processed time interval of the file, or a shorter interval computed from the bandwidth of the
    image. In a stripmap, for example, a point is illuminated during only part of the processed interval. The spatial
    frequency of the image along its column direction `col` changes by |d(u_t + u_r)/dt · col| f/c per second, where
    u_t and u_r are unit vectors along the lines of sight. Its total change during the aperture is the bandwidth
    ImpRespBW of a column. `middle` is the middle of the aperture [s], and `center` is the centre frequency f [Hz].
    `pulses_at` returns the pulses that reach the scene point at given times.
    """
    formation = xml.one("ImageFormation")
    begin, end = formation.number("TStartProc"), formation.number("TEndProc")
    processed = end - begin
    if not processed > 0:
        raise formation.fault("ends before it begins", "TEndProc")
    step = min(0.01, processed / 10)
    neighbours = pulses_at(np.array([middle - step, middle + step]))
    t, r = neighbours.transmitter - point, neighbours.receiver - point
    sights: Floats = t / np.linalg.norm(t, axis=1, keepdims=True) + r / np.linalg.norm(r, axis=1, keepdims=True)
    rate = (
        abs(float((sights[1] - sights[0]) @ xml.vector("Grid/Col/UVectECF")))
        / (2 * step)
        * center
        / SPEED_OF_LIGHT_MPS
    )
    band_time = xml.number("Grid/Col/ImpRespBW") / rate if rate else math.inf
    if band_time < (1 - _MAX_GAP_FRACTION) * processed:
        return _Aperture(middle, band_time), [
            f"The aperture is what the band of an image column takes (Grid/Col/ImpRespBW); the file was processed "
            f"from {processed:.6g} s."
        ]
    if abs((begin + end) / 2 - middle) > _MAX_GAP_FRACTION * processed:
        return _Aperture(middle, processed), [
            f"The aperture is as long as the time processed; its middle is {middle - (begin + end) / 2:+.6g} s from "
            "the middle of that, at the centre of aperture of the scene point (SCPCOA)."
        ]
    return _Aperture(middle, processed), []


# ---------------------------------------------------------------------- all formats
def _chosen(xml: Element, channel: str | None, path: str, key: str) -> tuple[str, Element]:
    """Find the identifier and the XML element of a channel; None selects the reference channel of the file."""
    name = xml.text("Channel/RefChId") if channel is None else channel
    parameters = xml.with_child(path, key, name)
    if parameters is None:
        identifiers = ", ".join(shown(element.text(key)) for element in xml.all(path))
        raise xml.fault(f"has no channel {shown(name)!r}; it has {identifiers}", path)
    return name, parameters


def _flown(container: Container, pulses: _Pulses, point: Vector, aperture: _Aperture, center: float) -> Seen:
    """Fit the paths of both platforms to the positions of the pulses in the aperture.

    `point` is the scene point, and `center` is the centre frequency [Hz].
    """
    if not center > 0:
        raise FormatError(container.file, f"its centre frequency is {center:g} Hz")
    axes = axes_at(geodetic(point))
    times = _scene_time(pulses, axes) - aperture.middle
    try:
        transmitter, receiver = (
            fitted(times, axes.places(positions), aperture.length, SPEED_OF_LIGHT_MPS / center)
            for positions in (pulses.transmitter, pulses.receiver)
        )
    except NoPathError as error:
        prefix = f"{container.xml.path}: " if container.has_vectors else ""
        raise FormatError(container.file, f"{prefix}{error}") from None
    return Seen(transmitter, receiver, axes)


def _coverage(pulses: _Pulses, axes: SceneAxes, aperture: _Aperture) -> list[str]:
    times = _scene_time(pulses, axes) - aperture.middle
    inside = times[np.abs(times) <= aperture.length / 2]
    gaps = [inside.min() + aperture.length / 2, aperture.length / 2 - inside.max()]
    if max(gaps) <= _MAX_GAP_FRACTION * aperture.length:
        return []
    return [
        f"Pulses cover the aperture from {inside.min():.6g} s to {inside.max():.6g} s of slow time; its ends are "
        "the polynomials' own.",
    ]


def _names(xml: Element, path: str) -> tuple[str, list[str]]:
    """Read the name of the collection, and make a remark that names the stated collector and illuminator."""
    elements = {key: xml.maybe(f"{path}/{key}") for key in ("CoreName", "CollectorName", "IlluminatorName")}
    core, collector, illuminator = (element.text() if element is not None else "" for element in elements.values())
    collected = f"Collected by {shown(collector)}" if collector else ""
    illuminated = f"{'illuminated' if collected else 'Lit'} by {shown(illuminator)}" if illuminator else ""
    return core, [
        f"{', '.join(phrase for phrase in (collected, illuminated) if phrase)}."
    ] if collected or illuminated else []


def _at_reference(pulses: _Pulses, seen: Seen, aperture: _Aperture) -> ReferenceGeometry | None:
    slow_time = float(_scene_time(pulses, seen.axes)[pulses.reference]) - aperture.middle
    # Outside the aperture the paths are not fitted.
    return reference_of(seen, slow_time) if abs(slow_time) <= aperture.length / 2 * (1 + 1e-9) else None


def _imported(
    container: Container,
    channel: str,
    name: str,
    point: Vector,
    band: tuple[float, float],
    aperture: _Aperture,
    start: Element,
    seen: Seen,
    is_monostatic: bool,
    reference: ReferenceGeometry | None,
    errors: FileErrors,
    remarks: list[str],
    unused: str = "",
) -> Imported:
    if not (0 < aperture.length <= MAX_APERTURE_S and abs(aperture.middle) <= MAX_APERTURE_S):
        problem = f"an aperture of {aperture.length:g} s at {aperture.middle:g} s"
        raise FormatError(container.file, f"{container.xml.path}: {problem}")
    if not 0 < band[1] < 2 * band[0]:
        problem = f"a band of {band[1]:g} Hz about {band[0]:g} Hz, which is none"
        raise FormatError(container.file, f"{container.xml.path}: {problem}")
    start_instant = parse_instant(start.text(), needs_zone=False)
    if start_instant is None:
        raise start.fault(f"is no instant of UTC (got {shown(start.text())!r})")
    return Imported(
        file=os.path.basename(container.file),
        format=container.format,
        xml_sha256=hashlib.sha256(container.xml_data).hexdigest(),
        channel=channel,
        name=printable(name) or os.path.basename(container.file),
        scene=geodetic(point),
        center_frequency=band[0],
        bandwidth=band[1],
        aperture_time=aperture.length,
        center_time=start_instant.after(aperture.middle).as_text(),
        transmitter=seen.transmitter,
        receiver=seen.receiver,
        is_monostatic=is_monostatic,
        reference=reference,
        errors=errors,
        remarks=(*([f"{unused.capitalize()}."] if unused else []), *remarks, *errors.remarks),
        unused=unused,
    )


_FORMAT_READERS: dict[str, Callable[[Container, str | None], Imported]] = {
    "CPHD": _cphd,
    "CRSD": _crsd,
    "SICD": _sicd,
}
