"""Ground pixels along lines of equal range: a patch in the coordinates in which a response is a product.

A straight grid leaves a response where a platform is near: its ridge follows an ellipse, and its sidelobes in range
follow lines of equal Doppler. Here the pixels of a line have one range sum at the aperture midpoint, those of a
column one change of the range sum over the aperture. Lines are followed from the middle outwards, so a patch may bend
around a platform.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.geometry import GroundVector
from bisar_budget.simulate.phase_history import Floats

_STRIDE = 4  # pixels from one step along a line to the next; between them a cubic is drawn
_STRETCH = 4.0  # of a pixel, at most: where Doppler hardly changes along a line
_SLANT = 60.0  # of the way from line to line, at most: where equal Doppler runs along equal range
_CORRECTIONS = 3  # of each pixel's range sum
_BLOCK = 1 << 14  # pixels corrected at once


class Flown(NamedTuple):
    """Positions of both platforms at the beginning, the middle and the end of an aperture, each (3, 3). [m]"""

    transmitter: Floats
    receiver: Floats

    def gradients(self, points: Floats) -> tuple[Floats, Floats]:
        """Gradients of the midpoint's range sum and of its change over the aperture, at points (..., 2): (..., 2)."""
        platforms = np.concatenate((self.transmitter, self.receiver))
        ground = points[..., None, :] - platforms[:, :2]
        square = ground[..., 0] ** 2 + ground[..., 1] ** 2 + platforms[:, 2] ** 2
        directions = ground / np.sqrt(square)[..., None]
        sums = directions[..., :3, :] + directions[..., 3:, :]
        return sums[..., 1, :], sums[..., 2, :] - sums[..., 0, :]

    def range_sum(self, points: Floats) -> Floats:
        """At the midpoint, of ground points (..., 2 or 3), (...). [m]"""
        total: Floats = np.zeros(points.shape[:-1])
        for one in (self.transmitter, self.receiver):
            east, north = points[..., 0] - one[1, 0], points[..., 1] - one[1, 1]
            total += np.sqrt(east**2 + north**2 + one[1, 2] ** 2)
        return total

    def turns_left(self, centre: GroundVector) -> bool:
        """Whether the range sum grows over the aperture for points counter-clockwise of a ground point."""
        by_range, by_doppler = self.gradients(np.asarray(centre, dtype=float))
        return float(by_doppler @ _left(by_range)) < 0

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
            square, slope = _dot(g, g), _dot(g, slant)
            # Along equal range instead where that would lead too far: |slant/slope| against |g|/square.
            keeps = _dot(slant, slant) * square <= _SLANT**2 * slope**2
            return range_step * np.where(keeps, slant / np.where(keeps, slope, 1.0), g / square)

        def along(points: Floats) -> Floats:
            """To the next pixel of a line, by an equal step of Doppler; as long as may be where there is none."""
            g, d = self.gradients(points)
            tangent = -_left(g) / np.sqrt(_dot(g, g))
            slope, longest = _dot(d, tangent), _STRETCH * spacing[1]
            keeps = slope * longest / doppler_step > 1
            return np.where(keeps, doppler_step / np.where(keeps, slope, 1.0), longest) * tangent

        start = _followed(across, middle, nx)
        followed = np.moveaxis(_followed(along, start, ny), 0, 1)
        wanted = self.range_sum(middle) + range_step * (np.arange(nx) - nx // 2)
        grid = np.zeros((nx, ny, 3))
        lines = max(1, _BLOCK // ny)
        for top in range(0, nx, lines):
            part = slice(top, top + lines)
            points = followed[part]
            for _ in range(_CORRECTIONS):
                g = self.gradients(points)[0]
                off = (wanted[part, None] - self.range_sum(points)) / np.sum(g**2, axis=-1)
                points = points + off[..., None] * g
            grid[part, :, :2] = points
        return grid


def _followed(step: Callable[[Floats], Floats], start: Floats, count: int) -> Floats:
    """Follow a field of steps both ways from points (..., 2), (count, ..., 2), the start at count // 2."""
    back = count // 2
    way = np.array([-1.0, 1.0]).reshape(2, *[1] * start.ndim)
    place = np.stack((start, start))
    velocity = way * step(place)
    pixels = [place[:1]]
    within = (np.arange(1, _STRIDE + 1) / _STRIDE).reshape(-1, *[1] * place.ndim)
    for _ in range(-(-back // _STRIDE)):
        half = place + _STRIDE / 2 * velocity
        ahead = place + _STRIDE * way * step(half)
        slope = way * step(ahead)
        pixels.append(_between(place, velocity, ahead, slope, within))
        place, velocity = ahead, slope
    out = np.concatenate(pixels[1:]) if back else np.empty((0, *place.shape))
    return np.concatenate((out[:back, 0][::-1], pixels[0], out[: count - 1 - back, 1]))


def _between(a: Floats, slope_a: Floats, b: Floats, slope_b: Floats, t: Floats) -> Floats:
    """Cubic through two points with their slopes per pixel."""
    slope_a, slope_b = _STRIDE * slope_a, _STRIDE * slope_b
    s = 1 - t
    cubic: Floats = s * s * (1 + 2 * t) * a + t * t * (1 + 2 * s) * b + s * t * (s * slope_a - t * slope_b)
    return cubic


def _dot(a: Floats, b: Floats) -> Floats:
    """Scalar products of plane vectors, (..., 1)."""
    return a[..., :1] * b[..., :1] + a[..., 1:] * b[..., 1:]


def _left(vectors: Floats) -> Floats:
    """Turned by a quarter, counter-clockwise."""
    turned: Floats = vectors[..., ::-1] * np.array([-1.0, 1.0])
    return turned
