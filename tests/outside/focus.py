"""An image former for CPHD files: NumPy over sarkit's reader, after the standard, and nothing of the package.

It knows what a file says: the signal, the places of both platforms at each pulse, the plane of the scene. The signal
of a point is exp(SGN·j2π f ΔTOA), ΔTOA from the reference point's range sum to the point's (CPHD 1.1.0, section 2).
Every point of the plane is compressed in range by a sum over the frequencies and in azimuth by a sum over the pulses,
with exact ranges; the sums are by the trapezoidal rule, so that band and aperture end with the file's vectors.

Points of the plane are (..., 2): along its axes, from its reference point. [m]
"""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import sarkit.cphd as skcphd
from numpy.polynomial import legendre
from scipy.interpolate import CubicSpline

C = 299792458.0  # m/s
_ORDER = 12  # of the polynomial through a phase over the aperture: what is left of the examples' is below 1e-6 rad
_PROFILE = 16  # samples of a range profile per cell; cubics between them are true to -89 dB
_CUT = 8  # samples of a cut per cell
_FINE = 128  # of the spline through them: a minimum is found to a hundredth of a cell
_NEAR = 0.25  # cells from one point to the next in the search for the brightest
_CLIMBS = 8
_SETTLED = 1e-7  # m
_ASIDE, _BEYOND = 3, 4  # cells of range about a cut, and of cross range beyond its ends, that can be read
_STRIDE = 32  # frequencies from one block to the next
_BLOCK = 1 << 18  # contributions of pulses to points formed at once


class Aperture(NamedTuple):
    """Phase of a point's pulses over the aperture, as the data have it.

    `place` (2,) is the point of the plane at which the phase varies least over aperture and band [m], a constant
    phase being free: it loses least of its peak. `quadratic` and `cubic` are what P₂ and P₃ make at the end of the
    aperture, signed like the range error: the signal's phase is −2π/λ times it. `left` is the rms of the phase beyond
    the polynomial. [rad]
    """

    place: np.ndarray
    quadratic: float
    cubic: float
    left: float


class Response(NamedTuple):
    """A cut of a response along the line of equal range through its peak.

    `peak` (2,) is where the image is brightest [m], `level` its magnitude there, 1 for a perfect point of amplitude
    1; `width` is at half power [m]; `pslr_db` and `islr_db` count what is more than `mask` from the peak [m].
    """

    peak: np.ndarray
    level: float
    width: float
    pslr_db: float
    islr_db: float
    mask: float


class Collection:
    """Pulses of one channel, and what the file says of them.

    `transmitter` and `receiver` are their measured places along the `axes` of the scene, (pulses, 3) [m]; `frequency`
    (pulses, samples) [Hz]; `signal` (pulses, samples). `wavelength` and `cell` are λ and c/B of the range sum. [m]
    """

    def __init__(self, path: Path) -> None:
        with path.open("rb") as file, skcphd.Reader(file) as reader:
            xml = reader.metadata.xmltree
            signal, vectors = reader.read_channel(xml.findtext("{*}Channel/{*}RefChId"))
        plane = "{*}SceneCoordinates/{*}ReferenceSurface/{*}Planar/{*}uIA"
        axes = [_vector(xml.find(plane + one)) for one in "XY"]
        self.axes = np.array([*axes, np.cross(*axes)])
        origin = _vector(xml.find("{*}SceneCoordinates/{*}IARP/{*}ECF"))
        self.transmitter, self.receiver, self.reference = (
            (vectors[name] - origin) @ self.axes.T for name in ("TxPos", "RcvPos", "SRPPos")
        )
        # A later echo turns backwards.
        self.signal = signal.astype(complex) if float(xml.findtext("{*}Global/{*}SGN")) < 0 else signal.conj()
        self.frequency = vectors["SC0"][:, None] + vectors["SCSS"][:, None] * np.arange(signal.shape[1])
        assert not np.ptp(self.frequency, axis=0).any()  # one band for all pulses, which `image` takes
        self.centre = float(self.frequency[0].mean())
        self.wavelength, self.cell = C / self.centre, C / float(np.ptp(self.frequency[0]))
        self.over_band, self.over_time = _trapezoid(signal.shape[1]), _trapezoid(signal.shape[0])
        times = (vectors["TxTime"] + vectors["RcvTime"]) / 2
        self.place = 2 * (times - times[0]) / (times[-1] - times[0]) - 1  # of a pulse in the aperture, −1 … 1

    def farther(self, points: np.ndarray) -> np.ndarray:
        """Range sums of points (n, 2), less those of the reference point: (pulses, n). [m]"""
        total = np.zeros((len(self.transmitter), len(points)))
        for platform in (self.transmitter, self.receiver):
            x, y = (platform[:, axis, None] - points[:, axis] for axis in (0, 1))
            total += np.sqrt(x**2 + y**2 + platform[:, 2, None] ** 2)
            total -= np.linalg.norm(platform - self.reference, axis=1)[:, None]
        return total

    def without_error(self, point: np.ndarray) -> "Collection":
        """The same collection of a perfect point: its signal by the places in the file."""
        found = object.__new__(Collection)
        found.__dict__ |= self.__dict__
        found.signal = np.exp(-2j * np.pi / C * self.frequency * self.farther(point[None]))
        return found

    # ------------------------------------------------------------------ phase over the aperture
    def turned(self, signal: np.ndarray, farther: np.ndarray) -> np.ndarray:
        """A signal, as if what is so much farther than the reference point were there: (pulses, 1) [m]."""
        # Frequencies are even: the phase of sample n = 32·i + j is that of 32·i times that of j.
        first, step = self.frequency[0, 0], self.frequency[0, 1] - self.frequency[0, 0]
        coarse = first + step * np.arange(0, signal.shape[1], _STRIDE)
        blocks, within = (np.exp(2j * np.pi / C * of * farther) for of in (coarse, step * np.arange(_STRIDE)))
        turn = (blocks[:, :, None] * within[:, None]).reshape(len(signal), -1)[:, : signal.shape[1]]
        found: np.ndarray = signal * turn
        return found

    def compensated(self, farther: np.ndarray) -> np.ndarray:
        """The signal, as if what is so much farther than the reference point were there: (pulses, 1) [m]."""
        return self.turned(self.signal, farther)

    def range_errors(self, point: np.ndarray) -> np.ndarray:
        """Range sums in the data, less those of a point by the places in the file, (pulses,). [m]

        A single scatterer: the step of phase from one frequency to the next says where its envelope is, to a fraction
        of a wavelength, and the phase at the centre frequency the rest.
        """
        moved = self.compensated(self.farther(point[None]))
        step = np.angle(np.sum(moved[:, 1:] * moved[:, :-1].conj(), axis=1))
        coarse = -step * C / (2 * np.pi * (self.frequency[0, 1] - self.frequency[0, 0]))
        moved = self.turned(moved, coarse[:, None])
        return coarse - np.angle(moved @ self.over_band) * self.wavelength / (2 * np.pi)

    def aperture(self) -> Aperture:
        """Find the point at which the phase varies least, and the phase that is left there.

        The variance of 2πfρ/c over aperture and band is that of the range error ρ over the pulses and, for a band
        that is even, B²/(12 f₀²) of its mean square. It is least by Gauss and Newton.
        """
        band = (float(np.ptp(self.frequency[0])) / self.centre) ** 2 / 12
        point, step = np.zeros(2), 0.1
        for _ in range(40):
            error = self.range_errors(point)
            sums = self.farther(point + np.vstack((np.zeros(2), step * np.eye(2))))
            beside = (sums[:, 1:] - sums[:, :1]) / step
            weighted = self.over_time[:, None] * ((1 + band) * beside - self.over_time @ beside)
            move = np.linalg.solve(weighted.T @ beside, weighted.T @ error)
            point = point + move
            if np.abs(move).max() < _SETTLED:
                break
        # The pulses compressed there, as an image has them: summed over the band, and unwrapped.
        phase = np.unwrap(np.angle(self.compensated(self.farther(point[None])) @ self.over_band))
        fit = legendre.legfit(self.place, phase, _ORDER)
        left = float(np.std(phase - legendre.legval(self.place, fit)))
        return Aperture(point, -1.5 * float(fit[2]), -2.5 * float(fit[3]), left)

    # ------------------------------------------------------------------ images
    def steps(self, about: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Steps of a resolution cell at a point: nearer by equal Doppler, and along its line of equal range. [m]"""
        sums = self.farther(about + np.vstack((np.zeros(2), np.eye(2))))
        slopes = sums[:, 1:] - sums[:, :1]
        middle, turned = slopes[len(slopes) // 2], slopes[-1] - slopes[0]
        nearer = np.linalg.solve([middle, turned], [-self.cell, 0.0])
        along = np.linalg.solve([middle, turned], [0.0, self.wavelength])
        return nearer, along * np.sign(middle[0] * along[1] - middle[1] * along[0]) * -1.0

    def resolution(self, about: np.ndarray) -> float:
        """Resolution cell at a point along its line of equal range. [m]"""
        return float(np.hypot(*self.steps(about)[1]))

    def line(self, about: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Points so many resolution cells from one along its line of equal range at mid-aperture, (n, 2). [m]"""
        nearer, along = self.steps(about)
        points = about + np.multiply.outer(cells, along)
        middle = len(self.transmitter) // 2
        wanted = self.farther(about[None])[middle]
        for _ in range(3):
            off = self.farther(points)[middle] - wanted
            points = points + off[:, None] / self.cell * nearer
        return points

    def response(self, near: np.ndarray, reach: float, mask: float | None = None) -> "Response":
        """Measure the response about a point: the cut goes as many cells to either side as `reach` says.

        `mask` is half the mainlobe's width, as another response has it [m]; None: between the first minima.
        """
        nearer, _ = self.steps(near)
        ends = self.line(near, np.array([-reach - _BEYOND, reach + _BEYOND]))
        corners = np.concatenate([ends + way * _ASIDE * nearer for way in (-1, 1)])
        return _Image(self, near, corners).measured(reach, mask)

    def image(self, points: np.ndarray) -> np.ndarray:
        """Complex image of points (..., 2), the same shape; they lie about their mean."""
        flat = points.reshape(-1, 2)
        found: np.ndarray = _Image(self, flat.mean(axis=0), flat)(flat).reshape(points.shape[:-1])
        return found


class _Image:
    """Backprojection about a point: pulses are compressed in range once, then read at points between `corners`."""

    def __init__(self, of: Collection, about: np.ndarray, corners: np.ndarray) -> None:
        self.of, self.about, self.here = of, about, of.farther(about[None])
        reach = int(np.abs(of.farther(corners) - self.here).max() / of.cell * _PROFILE) + 3
        offsets = np.arange(-reach, reach + 1) * of.cell / _PROFILE
        turn = np.exp(2j * np.pi / C * np.outer(of.frequency[0] - of.centre, offsets))
        weighted = of.compensated(self.here) * of.over_band * of.over_time[:, None]
        self.profile, self.reach, self.width = (weighted @ turn).reshape(-1), reach, offsets.size

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Complex image of points (n, 2), (n,)."""
        found = np.empty(len(points), dtype=complex)
        rows = np.arange(len(self.here))[:, None] * self.width
        size = max(1, _BLOCK // len(rows))
        for some in (slice(start, start + size) for start in range(0, len(points), size)):
            away = self.of.farther(points[some]) - self.here
            at = away * (_PROFILE / self.of.cell) + self.reach
            first = np.floor(at).astype(int)
            u, index = at - first, rows + first
            # Lagrange's cubic through four samples
            read = self.profile[index - 1] * (-u * (u - 1) * (u - 2) / 6)
            read += self.profile[index] * ((u + 1) * (u - 1) * (u - 2) / 2)
            read += self.profile[index + 1] * (-(u + 1) * u * (u - 2) / 2)
            read += self.profile[index + 2] * ((u + 1) * u * (u - 1) / 6)
            found[some] = np.sum(read * np.exp(2j * np.pi / self.of.wavelength * away), axis=0)
        return found

    def brightest(self, reach: float) -> np.ndarray:
        """Brightest point within so many cells along the line of equal range, (2,). [m]"""
        steps = np.stack(self.of.steps(self.about))
        line = self.of.line(self.about, np.arange(-reach, reach + _NEAR / 2, _NEAR))
        best = line[np.argmax(np.abs(self(line)))]
        # Uphill by the paraboloid through nine points, which become finer where it has its top within them.
        nine = np.array([[i, j] for i in (-1, 0, 1) for j in (-1, 0, 1)])
        i, j = nine.T
        terms = np.stack((i**0, i, j, i**2, i * j, j**2), axis=1)
        step = _NEAR
        for _ in range(_CLIMBS):
            level = np.abs(self(best + step * nine @ steps))
            _, x, y, xx, xy, yy = np.linalg.lstsq(terms, level, rcond=None)[0]
            if xx < 0 and 4 * xx * yy > xy**2:
                move = np.linalg.solve([[2 * xx, xy], [xy, 2 * yy]], [-x, -y])
            else:
                move = nine[np.argmax(level)]
            best = best + step * np.clip(move, -1, 1) @ steps
            if np.abs(move).max() < 1:
                step /= 4
        return best

    def measured(self, reach: float, mask: float | None) -> "Response":
        """The cut through the peak, to `reach` cells on either side."""
        peak = self.brightest(reach)
        cells = np.arange(-reach, reach, 1 / _CUT)
        cut = np.abs(self(self.of.line(peak, cells)))
        fine = np.arange(-reach, reach - 1, 1 / _FINE)
        level = CubicSpline(cells, cut)(fine)
        top = int(np.argmax(level))
        metres = self.of.resolution(peak)
        half = [_leaves(level, top, level[top] / np.sqrt(2), way) for way in (-1, 1)]
        if mask is None:
            low, high = (_rises(level, top, way) for way in (-1, 1))
        else:
            low, high = (top + way * mask / metres * _FINE for way in (-1, 1))
        place = np.arange(level.size)
        inside = np.clip(np.minimum(place + 0.5, high) - np.maximum(place - 0.5, low), 0, 1)
        energy = float(level**2 @ inside)
        highest = max(level[(place <= low) | (place >= high)].max(), *np.interp((low, high), place, level))
        return Response(
            peak,
            float(level[top]),
            (half[1] - half[0]) / _FINE * metres,
            20 * np.log10(float(highest / level[top])),
            10 * np.log10((float(level @ level) - energy) / energy),
            (high - low) / 2 / _FINE * metres,
        )


def _vector(node: Any) -> np.ndarray:
    return np.array([float(node.findtext(f"{{*}}{axis}")) for axis in "XYZ"])


def _trapezoid(count: int) -> np.ndarray:
    """Weights of samples that include both ends, of sum 1."""
    weights = np.full(count, 1 / (count - 1))
    weights[[0, -1]] /= 2
    return weights


def _leaves(level: np.ndarray, top: int, value: float, way: int) -> float:
    """Index at which a cut falls below a value on one side of its top."""
    index = top
    while level[index + way] >= value:
        index += way
    return index + way * float((level[index] - value) / (level[index] - level[index + way]))


def _rises(level: np.ndarray, top: int, way: int) -> int:
    """Index of the first minimum on one side of the top."""
    index = top
    while level[index + way] <= level[index]:
        index += way
    return index
