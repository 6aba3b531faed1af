"""Ground pixels along lines of equal range: a patch in the coordinates in which a response is a product.

A straight grid leaves a response where a platform is near: its ridge follows an ellipse, and its sidelobes in range
follow lines of equal Doppler. Here the pixels of a line have one range sum at the aperture midpoint, those of a column
one change of the range sum over the aperture. Lines are followed from the middle outwards, so a patch may bend around
a platform.
"""

from typing import NamedTuple

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.geometry import GroundVector
from bisar_budget.simulate.phase_history import Floats

_STRIDE = 4  # pixels from one step along a line to the next; between them a cubic is drawn
_STRETCH = 4.0  # of a pixel, at most: where Doppler hardly changes along a line
_SLANT = 60.0  # of the way from line to line, at most: where equal Doppler runs along equal range
_CORRECTIONS = 3  # of each pixel's range sum


class Flown(NamedTuple):
    """Positions of both platforms at the beginning, the middle and the end of an aperture, each (3, 3). [m]"""

    transmitter: Floats
    receiver: Floats

    def gradients(self, points: Floats) -> tuple[Floats, Floats]:
        """Of the range sum at the midpoint, and of its change over the aperture, at points (..., 2): (..., 2)."""
        begin, middle, end = (
            sum(_direction(points, one[index]) for one in (self.transmitter, self.receiver)) for index in range(3)
        )
        return np.asarray(middle), np.asarray(end - begin)

    def range_sum(self, points: Floats) -> Floats:
        """At the midpoint, of ground points (..., 2 or 3), (...). [m]"""
        total: Floats = np.zeros(points.shape[:-1])
        for one in (self.transmitter, self.receiver):
            ground = points[..., :2] - one[1, :2]
            total += np.sqrt(np.sum(ground**2, axis=-1) + one[1, 2] ** 2)
        return total

    def cells(self, centre: GroundVector, bandwidth_hz: float, wavelength_m: float) -> tuple[float, float]:
        """Resolution at a ground point: peak to first null across the lines of equal range, and along them. [m]"""
        by_range, by_doppler = self.gradients(np.asarray(centre, dtype=float))
        steepness = float(np.hypot(*by_range))
        along = abs(float(by_doppler @ _left(by_range))) / steepness
        if not steepness or not along:
            raise ValueError("range or Doppler does not change over the ground there: no image plane")
        return SPEED_OF_LIGHT / (bandwidth_hz * steepness), wavelength_m / along

    def grid(self, centre: GroundVector, spacing: tuple[float, float], shape: tuple[int, int]) -> Floats:
        """Pixels around a ground point.

        Parameters
        ----------
        centre : (2,) float
            East, north; the pixel (nx // 2, ny // 2). [m]
        spacing : (2,) float
            At the centre, across the lines and along them. [m]
        shape : (2,) int
            Lines, towards the platforms, and pixels of a line, counter-clockwise.

        Returns
        -------
        (nx, ny, 3) ndarray
            East, north, up. [m]
        """
        nx, ny = shape
        middle = np.asarray(centre, dtype=float)
        by_range, by_doppler = self.gradients(middle)
        range_step = -spacing[0] * float(np.hypot(*by_range))
        doppler_step = -spacing[1] * float(by_doppler @ _left(by_range)) / float(np.hypot(*by_range))

        def across(points: Floats) -> Floats:
            """To the next line, along equal Doppler."""
            g, d = self.gradients(points)
            slant = _left(d)
            slope = np.sum(g * slant, axis=-1, keepdims=True)
            straight = g / np.sum(g**2, axis=-1, keepdims=True)
            with np.errstate(divide="ignore", invalid="ignore"):
                step = slant / slope
            longest = _SLANT**2 * np.sum(straight**2, axis=-1, keepdims=True)
            keeps = np.sum(step**2, axis=-1, keepdims=True) <= longest
            return range_step * np.where(keeps, step, straight)

        def along(points: Floats) -> Floats:
            """To the next pixel of a line, by an equal step of Doppler; as long as the centre's where it must be."""
            g, d = self.gradients(points)
            tangent = -_left(g) / np.linalg.norm(g, axis=-1, keepdims=True)
            slope = np.sum(d * tangent, axis=-1, keepdims=True)
            with np.errstate(divide="ignore"):
                length = doppler_step / slope
            length = np.where(length > 0, np.minimum(length, _STRETCH * spacing[1]), _STRETCH * spacing[1])
            return length * tangent

        start = _followed(across, middle, nx)
        points = np.moveaxis(_followed(along, start, ny), 0, 1)
        wanted = self.range_sum(middle) + range_step * (np.arange(nx) - nx // 2)
        for _ in range(_CORRECTIONS):
            g = self.gradients(points)[0]
            off = (wanted[:, None] - self.range_sum(points)) / np.sum(g**2, axis=-1)
            points = points + off[..., None] * g
        return np.concatenate((points, np.zeros((nx, ny, 1))), axis=-1)


def _followed(step, start: Floats, count: int) -> Floats:  # type: ignore[no-untyped-def]
    """Follow a field of steps both ways from points (..., 2), (count, ..., 2), the start at count // 2."""
    back, forth = count // 2, count - 1 - count // 2
    sides = []
    for sign, needed in ((-1, back), (1, forth)):
        place, nodes = start, []
        velocity = sign * step(place)
        for _ in range(-(-needed // _STRIDE)):
            half = place + _STRIDE / 2 * velocity
            ahead = place + _STRIDE * sign * step(half)
            slope = sign * step(ahead)
            nodes.append((place, velocity, ahead, slope))
            place, velocity = ahead, slope
        pixels = [_between(*node, t / _STRIDE) for node in nodes for t in range(1, _STRIDE + 1)][:needed]
        sides.append(pixels)
    return np.stack([*sides[0][::-1], start, *sides[1]])


def _between(a: Floats, slope_a: Floats, b: Floats, slope_b: Floats, t: float) -> Floats:
    """Cubic through two points with their slopes per pixel."""
    slope_a, slope_b = _STRIDE * slope_a, _STRIDE * slope_b
    s = 1 - t
    cubic: Floats = s * s * (1 + 2 * t) * a + t * t * (1 + 2 * s) * b + s * t * (s * slope_a - t * slope_b)
    return cubic


def _direction(points: Floats, platform: Floats) -> Floats:
    ground = points - platform[:2]
    direction: Floats = ground / np.sqrt(np.sum(ground**2, axis=-1, keepdims=True) + platform[2] ** 2)
    return direction


def _left(vectors: Floats) -> Floats:
    """Turned by a quarter, counter-clockwise."""
    return np.stack((-vectors[..., 1], vectors[..., 0]), axis=-1)
