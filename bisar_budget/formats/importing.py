"""A collection out of a file: CPHD and CRSD by the parameters of their pulses, SICD by its polynomials."""

import hashlib
import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.faults import printable, shown
from bisar_budget.formats.collected import (
    LONGEST,
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

_SAMPLES = 201  # moments at which a polynomial of the file is taken; enough for one of any order there
_SETTLING = 5  # rounds of a light time; each leaves v/c of what the one before left
_FARTHEST_M = 4.1e8  # from the Earth's centre: what is farther is no place
_COVERED = 0.02  # of the aperture, that pulses may lack at its ends


@dataclass(frozen=True, eq=False)
class _Pulses:
    """Vectors of a channel: times of transmission and of reception [s], places then, Earth-fixed [m]."""

    sent: Floats
    transmitter: Floats
    received: Floats
    receiver: Floats
    reference: int  # index of the reference vector among them
    unused: int = 0  # further vectors, which lack a pulse, a time or a place

    @property
    def unused_words(self) -> str:
        """Words on vectors that are not used, empty where there are none."""
        if not self.unused:
            return ""
        count = self.sent.size + self.unused
        return f"without a pulse, a time or a place, and not used: {self.unused} of {count} vectors"


class _Aperture(NamedTuple):
    """Middle and length of the dwell on the scene point, counted from the file's start. [s]"""

    middle: float
    length: float


def import_collection(file: str, channel: str | None = None) -> Imported:
    """Read the collection of a CPHD, CRSD or SICD file, or of XML of one; its signal is not read.

    `channel` is the identifier of a channel of CPHD or CRSD, the reference channel if none. A `FormatError` says that
    the file cannot be used, a `MissingExtraError` that the extra `formats` is not installed.
    """
    check_extra()
    container = open_container(file)
    read: Callable[[Container, str | None], Imported] = _READERS[container.format.split()[0]]
    with np.errstate(all="ignore"):  # what is no number in the end is refused
        return read(container, channel)


# ---------------------------------------------------------------------- CPHD
def _cphd(container: Container, channel: str | None) -> Imported:
    """CPHD 1.0.1 and 1.1.0 (NGA.STND.0068-1)."""
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


def _dtype(xml: Element, block: str) -> np.dtype[Any]:
    """Form of the parameters of a vector, or of a pulse that was sent, as the XML describes it."""
    module: Any = import_module("sarkit.cphd" if xml.tag == "CPHD" else "sarkit.crsd")
    reads = module.get_ppp_dtype if block == "PPP" else module.get_pvp_dtype
    try:
        dtype: np.dtype[Any] = reads(xml.node.getroottree())
    except (AttributeError, IndexError, KeyError, SyntaxError, TypeError, ValueError) as error:
        raise xml.fault(f"describes no parameters ({shown(str(error))})", block) from None
    return dtype


def _fields(xml: Element, vectors: NDArray[Any], block: str, *names: str) -> list[Floats]:
    found = []
    for name in names:
        if name not in (vectors.dtype.names or ()):
            raise xml.fault("is missing", f"{block}/{name}")
        values = vectors[name]
        if values.dtype.names == ("Int", "Frac"):
            values = values["Int"] + values["Frac"]
        if values.dtype.kind not in "iuf" or values.shape[1:] != ((3,) if name.endswith(("Pos", "Vel")) else ()):
            raise xml.fault("has another form than the standard's", f"{block}/{name}")
        found.append(np.asarray(values, dtype=float))
    return found


def _pulses_of_cphd(container: Container, vectors: NDArray[Any], parameters: Element) -> tuple[_Pulses, Vector]:
    names = ("TxTime", "TxPos", "RcvTime", "RcvPos", "SRPPos")
    sent, transmitter, received, receiver, points = _fields(container.xml, vectors, "PVP", *names)
    reference = parameters.whole("RefVectorIndex")
    if reference >= len(vectors):
        raise parameters.fault(f"is beyond the {len(vectors)} vectors", "RefVectorIndex")
    usable = np.isfinite(sent) & np.isfinite(received)
    for places in (transmitter, receiver, points):
        usable &= (np.abs(places) < _FARTHEST_M).all(axis=1)
    if not usable[reference]:
        raise parameters.fault("is a vector without times or places", "RefVectorIndex")
    x, y, z = (float(value) for value in points[reference])
    kept = _Pulses(
        sent[usable],
        transmitter[usable],
        received[usable],
        receiver[usable],
        int(usable[:reference].sum()),
        int((~usable).sum()),
    )
    return kept, (x, y, z)


def _scene_time(pulses: _Pulses, axes: SceneAxes) -> Floats:
    """When each pulse is at the scene point: reference time of CPHD 1.1.0, section 6.5.1 (5). [s]"""
    out = np.linalg.norm(pulses.transmitter - axes.origin, axis=1)
    back = np.linalg.norm(pulses.receiver - axes.origin, axis=1)
    scene_time: Floats = pulses.sent + out / (out + back) * (pulses.received - pulses.sent)
    return scene_time


def _dwell(xml: Element, dwell: Element | None, used: Element, point: Vector) -> _Aperture:
    """Centre of dwell and dwell time at the scene point, section 6.5.1 (6) of CPHD 1.1.0."""
    if dwell is None:
        raise xml.fault("is missing: nothing says how long the scene point is seen", "Dwell")
    found = []
    x, y = _image_coordinates(xml.one("SceneCoordinates"), point)
    for name, key in (("CODTime", "CODId"), ("DwellTime", "DwellId")):
        polynomial = dwell.with_child(name, "Identifier", used.text(key))
        if polynomial is None:
            raise used.fault(f"names no {name} of {dwell.path}", key)
        coefficients = polynomial.polynomial(f"{name}Poly", 2)
        found.append(float(np.polynomial.polynomial.polyval2d(x, y, coefficients)))
    if not found[1] > 0:
        raise used.fault(f"gives a dwell time of {found[1]:g} s at the scene point")
    return _Aperture(*found)


def _image_coordinates(scene: Element, point: Vector) -> tuple[float, float]:
    """IAX and IAY of a point: image area coordinates of CPHD, on a plane or on a surface of constant height. [m]"""
    planar = scene.maybe("ReferenceSurface/Planar")
    if planar is not None:
        away = np.subtract(point, scene.vector("IARP/ECF"))
        return float(away @ planar.vector("uIAX")), float(away @ planar.vector("uIAY"))
    level = scene.one("ReferenceSurface/HAE")
    place = geodetic(point)
    origin = [math.radians(scene.number(f"IARP/LLH/{name}")) for name in ("Lat", "Lon")]
    axes = np.array([[level.number(f"{axis}/{name}") for name in ("Lat", "Lon")] for axis in ("uIAXLL", "uIAYLL")])
    turned = math.remainder(place.longitude - origin[1], 2 * math.pi)
    try:
        x, y = np.linalg.solve(axes.T, [place.latitude - origin[0], turned])
    except np.linalg.LinAlgError:
        raise level.fault("has axes along one line") from None
    return float(x), float(y)


def _off_reference_point(xml: Element, point: Vector) -> list[str]:
    origin = xml.maybe("SceneCoordinates/IARP/ECF")
    away = 0.0 if origin is None else math.dist(origin.vector(), point)
    if away < 1e-3:
        return []
    return [f"The scene point is {away:.6g} m from the image area's reference point (IARP)."]


def _stated(xml: Element, axes: SceneAxes, is_monostatic: bool) -> Seen:
    """Both platforms of CPHD's `ReferenceGeometry`."""
    geometry = xml.one("ReferenceGeometry")
    paths = (
        ("Monostatic/ARP", "Monostatic/ARP") if is_monostatic else ("Bistatic/TxPlatform/", "Bistatic/RcvPlatform/")
    )
    tracks = []
    for path in paths:
        position, velocity = (geometry.vector(f"{path}{what}") for what in ("Pos", "Vel"))
        state = PlatformState(position=axes.place(position), velocity=axes.turned(velocity))
        tracks.append(Fitted(state, order=1, farthest=0.0, rms=0.0))
    return Seen(tracks[0], tracks[1], axes)


# ---------------------------------------------------------------------- CRSD
def _crsd(container: Container, channel: str | None) -> Imported:
    """CRSD 1.0 of a SAR collection (NGA.STND.0080-2): pulses that were sent, and what each receive window heard."""
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
    heard = xml.with_child("Data/Receive/Channel", "ChId", channel)
    sent = xml.with_child("Data/Transmit/TxSequence", "TxId", sar.text("TxId"))
    if heard is None or sent is None:
        raise xml.fault("lacks the channel or its transmit sequence", "Data")
    vectors = container.vectors(
        "PVP", heard.whole("PVPArrayByteOffset"), heard.whole("NumVectors"), _dtype(xml, "PVP")
    )
    sends = container.vectors("PPP", sent.whole("PPPArrayByteOffset"), sent.whole("NumPulses"), _dtype(xml, "PPP"))
    pulses = _pulses_of_crsd(container, vectors, sends, point, parameters)
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
    container: Container, vectors: NDArray[Any], sends: NDArray[Any], point: Vector, parameters: Element
) -> _Pulses:
    """Pulses with the time at which the echo of the scene point comes back.

    The receiver's place is stated for the start of its window. Its velocity carries it to the echo, less than a
    millisecond later.
    """
    xml = container.xml
    begun, places, velocities, index = _fields(xml, vectors, "PVP", "RcvStart", "RcvPos", "RcvVel", "TxPulseIndex")
    sent, transmitter = _fields(xml, sends, "PPP", "TxTime", "TxPos")
    known = np.isfinite(index) & (index >= 0) & (index < len(sends)) & np.isfinite(begun)
    known &= (np.abs(places) < _FARTHEST_M).all(axis=1) & np.isfinite(velocities).all(axis=1)
    known[known] = (np.isfinite(sent) & np.isfinite(transmitter).all(axis=1))[index[known].astype(int)]
    reference = parameters.whole("RefVectorIndex")
    if reference >= len(vectors) or not known[reference]:
        raise parameters.fault("is no vector with a pulse", "RefVectorIndex")
    which = index[known].astype(int)
    sent, transmitter, begun = sent[which], transmitter[which], begun[known]
    places, velocities = places[known], velocities[known]
    out = np.linalg.norm(transmitter - point, axis=1)
    received, receiver = begun, places
    for _ in range(_SETTLING):
        received = sent + (out + np.linalg.norm(receiver - point, axis=1)) / SPEED_OF_LIGHT
        receiver = places + velocities * (received - begun)[:, None]
    return _Pulses(sent, transmitter, received, receiver, int(known[:reference].sum()), int((~known).sum()))


# ---------------------------------------------------------------------- SICD
def _sicd(container: Container, channel: str | None) -> Imported:
    """SICD (NGA.STND.0024-1): the platforms' polynomials, and the part of them that the image was formed from."""
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
    middle = xml.number("SCPCOA/SCPTime")
    sent_from, heard_at = _polynomials_of_sicd(xml, is_monostatic)

    def pulses_at(times: Floats) -> _Pulses:
        """Pulses that are at the scene point at some times."""
        out, back = times, times
        if not is_monostatic:  # the aperture reference point of one platform is that of the time in between
            for _ in range(_SETTLING):
                out = times - np.linalg.norm(_over(sent_from, out) - point, axis=1) / SPEED_OF_LIGHT
                back = times + np.linalg.norm(_over(heard_at, back) - point, axis=1) / SPEED_OF_LIGHT
        return _Pulses(out, _over(sent_from, out), back, _over(heard_at, back), times.size // 2)

    name, collectors = _names(xml, "CollectionInfo")
    aperture, remarks = _aperture_of_sicd(xml, point, middle, (low + high) / 2, pulses_at)
    times: Floats = middle + np.linspace(-0.5, 0.5, _SAMPLES) * aperture.length
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
    """Places (n, 3) of a path polynomial at times (n,)."""
    places: Floats = np.asarray(np.polynomial.polynomial.polyval(times, polynomial).T, dtype=float)
    return places


def _polynomials_of_sicd(xml: Element, is_monostatic: bool) -> tuple[Floats, Floats]:
    position = xml.one("Position")
    if is_monostatic:
        both = position.path_polynomial("ARPPoly")
        return both, both
    channel = (
        xml.text("ImageFormation/RcvChanProc/ChanIndex") if xml.maybe("ImageFormation/RcvChanProc/ChanIndex") else "1"
    )
    found = next(
        (one for one in xml.all("RadarCollection/RcvChannels/ChanParameters") if one.node.get("index") == channel),
        None,
    )
    wanted = found.text("RcvAPCIndex") if found is not None and found.maybe("RcvAPCIndex") is not None else "1"
    receiver = next((one for one in position.all("RcvAPC/RcvAPCPoly") if one.node.get("index") == wanted), None)
    if receiver is None:
        raise position.fault(
            f"has no phase centre {shown(wanted)} that the processed channel was received by", "RcvAPC"
        )
    holder = Element(xml.file, receiver.node.getparent())
    index = [node is receiver.node for node in holder.node.findall("{*}RcvAPCPoly")].index(True) + 1
    return position.path_polynomial("TxAPCPoly"), holder.path_polynomial(f"RcvAPCPoly[{index}]")


def _aperture_of_sicd(
    xml: Element, point: Vector, middle: float, center: float, pulses_at: Callable[[Floats], _Pulses]
) -> tuple[_Aperture, list[str]]:
    """Aperture of a pixel at the scene point: what the processed time gives, or less where the image's band says so.

    The wave vector of the image moves by |d(u_t + u_r)/dt · col| f/c a second; the band ImpRespBW of a column is what
    it moved in the aperture. A stripmap is processed for longer than a point is seen.
    """
    formation = xml.one("ImageFormation")
    begin, end = formation.number("TStartProc"), formation.number("TEndProc")
    processed = end - begin
    if not processed > 0:
        raise formation.fault("ends before it begins", "TEndProc")
    step = min(0.01, processed / 10)
    near = pulses_at(np.array([middle - step, middle + step]))
    t, r = near.transmitter - point, near.receiver - point
    sights: Floats = t / np.linalg.norm(t, axis=1, keepdims=True) + r / np.linalg.norm(r, axis=1, keepdims=True)
    rate = (
        abs(float((sights[1] - sights[0]) @ xml.vector("Grid/Col/UVectECF"))) / (2 * step) * center / SPEED_OF_LIGHT
    )
    seen = xml.number("Grid/Col/ImpRespBW") / rate if rate else math.inf
    if seen < (1 - _COVERED) * processed:
        return _Aperture(middle, seen), [
            f"The aperture is what the band of an image column takes (Grid/Col/ImpRespBW); the file was processed "
            f"from {processed:.6g} s."
        ]
    if abs((begin + end) / 2 - middle) > _COVERED * processed:
        return _Aperture(middle, processed), [
            f"The aperture is as long as the time processed; its middle is {middle - (begin + end) / 2:+.6g} s from "
            "the middle of that, at the centre of aperture of the scene point (SCPCOA)."
        ]
    return _Aperture(middle, processed), []


# ---------------------------------------------------------------------- all of them
def _chosen(xml: Element, channel: str | None, path: str, key: str) -> tuple[str, Element]:
    """Identifier and parameters of a channel."""
    name = xml.text("Channel/RefChId") if channel is None else channel
    found = xml.with_child(path, key, name)
    if found is None:
        known = ", ".join(shown(one.text(key)) for one in xml.all(path))
        raise xml.fault(f"has no channel {shown(name)!r}; it has {known}", path)
    return name, found


def _flown(container: Container, pulses: _Pulses, point: Vector, aperture: _Aperture, center: float) -> Seen:
    """Both platforms, by the places of the pulses in the aperture."""
    if not center > 0:
        raise FormatError(container.file, f"its centre frequency is {center:g} Hz")
    axes = axes_at(geodetic(point))
    times = _scene_time(pulses, axes) - aperture.middle
    try:
        transmitter, receiver = (
            fitted(times, axes.places(places), aperture.length, SPEED_OF_LIGHT / center)
            for places in (pulses.transmitter, pulses.receiver)
        )
    except NoPathError as error:
        where = f"{container.xml.path}: " if container.has_vectors else ""
        raise FormatError(container.file, f"{where}{error}") from None
    return Seen(transmitter, receiver, axes)


def _coverage(pulses: _Pulses, axes: SceneAxes, aperture: _Aperture) -> list[str]:
    times = _scene_time(pulses, axes) - aperture.middle
    inside = times[np.abs(times) <= aperture.length / 2]
    lacking = [inside.min() + aperture.length / 2, aperture.length / 2 - inside.max()]
    if max(lacking) <= _COVERED * aperture.length:
        return []
    return [
        f"Pulses cover the aperture from {inside.min():.6g} s to {inside.max():.6g} s of slow time; its ends are "
        "the polynomials' own.",
    ]


def _names(xml: Element, path: str) -> tuple[str, list[str]]:
    """Name of the collection, and who collected it."""
    found = {key: xml.maybe(f"{path}/{key}") for key in ("CoreName", "CollectorName", "IlluminatorName")}
    core, collector, illuminator = (one.text() if one is not None else "" for one in found.values())
    by = f"Collected by {shown(collector)}" if collector else ""
    lit = f"{'lit' if by else 'Lit'} by {shown(illuminator)}" if illuminator else ""
    return core, [f"{', '.join(part for part in (by, lit) if part)}."] if by or lit else []


def _at_reference(pulses: _Pulses, seen: Seen, aperture: _Aperture) -> ReferenceGeometry | None:
    at = float(_scene_time(pulses, seen.axes)[pulses.reference]) - aperture.middle
    # Elsewhere the paths are not fitted.
    return reference_of(seen, at) if abs(at) <= aperture.length / 2 * (1 + 1e-9) else None


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
    if not (0 < aperture.length <= LONGEST and abs(aperture.middle) <= LONGEST):
        given = f"an aperture of {aperture.length:g} s at {aperture.middle:g} s"
        raise FormatError(container.file, f"{container.xml.path}: {given}")
    if not 0 < band[1] < 2 * band[0]:
        given = f"a band of {band[1]:g} Hz about {band[0]:g} Hz, which is none"
        raise FormatError(container.file, f"{container.xml.path}: {given}")
    begun = parse_instant(start.text(), needs_zone=False)
    if begun is None:
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
        center_time=begun.after(aperture.middle).as_text(),
        transmitter=seen.transmitter,
        receiver=seen.receiver,
        is_monostatic=is_monostatic,
        reference=reference,
        errors=errors,
        remarks=(*([f"{unused.capitalize()}."] if unused else []), *remarks, *errors.remarks),
        unused=unused,
    )


_READERS: dict[str, Callable[[Container, str | None], Imported]] = {"CPHD": _cphd, "CRSD": _crsd, "SICD": _sicd}
