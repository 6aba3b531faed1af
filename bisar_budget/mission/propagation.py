"""Section of a mission file with the propagation delays that remain after correction.

A leg is the signal path between one platform and the scene. Stated delays are zenith delays; a leg at a low elevation
has a longer delay. Values are in SI units, 1 sigma.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, NamedTuple

import numpy as np

from bisar_budget import units
from bisar_budget.arrays import Floats, PerCase
from bisar_budget.constants import EARTH_RADIUS_M
from bisar_budget.error_kinds.random_kinds import PROPAGATION_KIND
from bisar_budget.faults import KeyPath, Problem
from bisar_budget.geometry import PlatformState, Vectors
from bisar_budget.mission.platforms import Platforms
from bisar_budget.mission.readers import Key, Quantity, Section, SectionValues, Source, WithBias

DELAYS = tuple(PROPAGATION_KIND.sizes)
_CORRELATION_TIME_KEY = "correlation_time"
LEAST_ELEVATION_DEG = 3.0  # at lower elevations, the zenith delay does not determine the slant delay
AIR_TOP_M = 80e3  # few free electrons are below this height, and little air is above it

_ZENITH_DELAY = Quantity(units.LENGTH, ge=0, le=1e3)
_CONTENT_QUANTITY = Quantity(units.ELECTRON_CONTENT, ge=0, le=1e20)
_CORRELATION_TIME = Quantity(units.TIME, gt=0, ge=1e-6, le=1e9)  # the same bounds as for other Gauss-Markov errors
_DELAY_ERROR = WithBias(_ZENITH_DELAY, "ZenithDelayError", Quantity(units.LENGTH, ge=-1e3, le=1e3))
_CONTENT_ERROR = WithBias(
    _CONTENT_QUANTITY, "ElectronContentError", Quantity(units.ELECTRON_CONTENT, ge=-1e20, le=1e20)
)
_COARSE_APERTURE_TIMES = np.linspace(-1.0, 1.0, 9)[:, None]  # in units of half the aperture time


class LegDelay(NamedTuple):
    """Residual delays on one leg after correction, 1 sigma."""

    zenith_delay: Annotated[float | None, Key(_DELAY_ERROR, "Delay of the troposphere.")] = None
    zenith_electron_content: Annotated[
        float | None, Key(_CONTENT_ERROR, "Electron content of the ionosphere; 1 TECU is 1e16/m².")
    ] = None
    correlation_time: Annotated[
        float | None,
        Key(_CORRELATION_TIME, "Time in which the delays of this leg change; omitted: they are constant."),
    ] = None
    source: Source = None
    bias: Mapping[str, float | None] = {}

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Yield a problem for a leg that states no delay."""
        if not values.keys() >= {*DELAYS, _CORRELATION_TIME_KEY} or any(
            values[delay] is not None for delay in DELAYS
        ):
            return
        if values[_CORRELATION_TIME_KEY] is None:
            yield Problem("states no delay", f"accepted: {' or '.join(DELAYS)}")
            return
        yield Problem(
            f"states a {_CORRELATION_TIME_KEY} and no delay of this leg that changes in it",
            f"accepted: {' or '.join(DELAYS)} of this leg beside it. One air over both legs changes in one time, "
            f"propagation.{_CORRELATION_TIME_KEY}",
        )


_LEG = Section(LegDelay)


class Propagation(NamedTuple):
    """Residual delays in the air after correction, 1 sigma: one air for both legs, or separate delays of each leg.

    The legs have "one air" if the signals on both legs cross the same atmosphere and have the same zenith delays.
    """

    zenith_delay: Annotated[
        float | None, Key(_DELAY_ERROR, "Delay of the troposphere, of one air over both legs.")
    ] = None
    zenith_electron_content: Annotated[
        float | None,
        Key(_CONTENT_ERROR, "Electron content of the ionosphere, of one air over both legs; 1 TECU is 1e16/m²."),
    ] = None
    correlation_time: Annotated[
        float | None,
        Key(
            _CORRELATION_TIME,
            "Time in which the delays change, as a Gauss-Markov process, of one air or of each leg that states no "
            "time; omitted: they are constant within the aperture.",
        ),
    ] = None
    transmitter: Annotated[LegDelay | None, Key(_LEG, "From the transmitter to the scene, alone.")] = None
    receiver: Annotated[LegDelay | None, Key(_LEG, "From the scene to the receiver, alone.")] = None
    source: Source = None
    bias: Mapping[str, float | None] = {}

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Refuse delays that are stated both jointly for the two legs and separately for one leg.

        A section without delays, and a correlation time that applies to no leg, are refused too.
        """
        if not values.keys() >= {*DELAYS, _CORRELATION_TIME_KEY, *Platforms._fields}:
            return
        of_both = [delay for delay in DELAYS if values[delay] is not None]
        of_one = [name for name in Platforms._fields if values[name] is not None]
        accepted = f"accepted: {' and '.join(DELAYS)} of both legs, or transmitter and receiver with their own"
        if of_both and of_one:
            yield Problem(f"mixes {of_both[0]} of both legs with {of_one[0]}", accepted, at=(of_one[0],))
        elif not (of_both or of_one):
            problem = (
                "states no delay"
                if values[_CORRELATION_TIME_KEY] is None
                else f"states a {_CORRELATION_TIME_KEY} and no delay that changes in it"
            )
            yield Problem(problem, accepted)
        elif (
            not of_both
            and values[_CORRELATION_TIME_KEY] is not None
            and all(values[name].correlation_time is not None for name in of_one)
        ):
            yield Problem(
                "is of no leg: each that states a delay has its own",
                f"accepted: {_CORRELATION_TIME_KEY} here, or of each leg its own",
                at=(_CORRELATION_TIME_KEY,),
                is_of_key=True,
            )

    @property
    def is_one_air(self) -> bool:
        """Whether the file states the delays once for both legs, so that both signals cross the same air."""
        return self.transmitter is None and self.receiver is None

    def content(self, platform: str) -> float | None:
        """Zenith electron content [1/m²] on the leg of a platform; None if the file does not state it."""
        leg = self.leg(platform)
        return None if leg is None else leg.zenith_electron_content

    def source_of(self, platform: str) -> str | None:
        """Source that the file states for the delays on the leg of a platform; None if no source is stated."""
        leg = self.leg(platform)
        return None if leg is None else leg.source

    def leg(self, platform: str) -> LegDelay | None:
        """Delays on the leg of a platform, with the correlation time and source that apply to it.

        None if the file states delays only for the leg of the other platform.
        """
        if self.is_one_air:
            return LegDelay(
                self.zenith_delay, self.zenith_electron_content, self.correlation_time, self.source, self.bias
            )
        platform_leg: LegDelay | None = getattr(self, platform)
        if platform_leg is None:
            return None
        time = self.correlation_time if platform_leg.correlation_time is None else platform_leg.correlation_time
        return platform_leg._replace(correlation_time=time, source=platform_leg.source or self.source)

    def path(self, platform: str, delay: str) -> KeyPath:
        """Path of the key that states a `delay`, such as `zenith_delay`, for the leg of a platform."""
        return PROPAGATION_KIND.path("mission" if self.is_one_air else platform, delay)


PROPAGATION = Section(Propagation)


def height_of(position: Vectors) -> PerCase:
    """Height above a sphere of the Earth's mean radius, which passes through the scene centre. [m]

    The components of `position` may have any shape (…); the result has the same shape.
    """
    x, y, z = position
    distance: PerCase = np.sqrt(x * x + y * y + (z + EARTH_RADIUS_M) ** 2)
    return distance - EARTH_RADIUS_M


def elevation_deg(position: Vectors) -> Floats:
    """Elevation of a position as seen from the scene centre. [deg]

    The components of `position` may have any shape (…); the result has the same shape.
    """
    x, y, z = position
    elevation: Floats = np.degrees(np.arctan2(z, np.hypot(x, y)))
    return elevation


def least_elevation_deg(path: PlatformState, aperture_time_s: PerCase) -> Floats:
    """Smallest elevation of a platform during the aperture, as seen from the scene centre. [deg]"""
    half = np.asarray(aperture_time_s, dtype=float) / 2
    least: Floats = elevation_deg(path.place(_COARSE_APERTURE_TIMES * half)).min(axis=0)
    return least


def least_elevations(
    propagation: Propagation, paths: Mapping[str, PlatformState], aperture_time_s: PerCase
) -> Iterator[tuple[str, str, Floats]]:
    """Yield the smallest elevation during the aperture for each delay that is stated for a leg. [deg]

    Each item consists of the name of the platform, the key of the delay, and the elevation. For the electron content,
    the elevation is set to 90° if the platform is below the ionosphere.
    """
    for name, path in paths.items():
        leg = propagation.leg(name)
        if leg is None:
            continue
        least = least_elevation_deg(path, aperture_time_s)
        if leg.zenith_delay is not None:
            yield name, DELAYS[0], least
        if leg.zenith_electron_content is not None:
            is_below = np.asarray(height_of(path.position)) < AIR_TOP_M
            yield name, DELAYS[1], np.where(is_below, 90.0, least)  # the leg does not reach the ionosphere


def too_low(propagation: Propagation, platforms: Platforms, aperture_time_s: float) -> Iterator[Problem]:
    """Yield a problem for each delay on a leg whose elevation falls below `LEAST_ELEVATION_DEG`.

    The smallest elevation during the aperture is used.
    """
    paths = dict(zip(Platforms._fields, platforms.geometry.both, strict=True))
    for name, delay, least in least_elevations(propagation, paths, aperture_time_s):
        (degrees,) = least.tolist()
        if degrees < LEAST_ELEVATION_DEG:
            yield Problem(
                f"the {name} is seen at an elevation of {degrees:.3g} deg within the aperture: a delay along the "
                "ground does not follow from that of the zenith",
                f"accepted: elevations of at least {LEAST_ELEVATION_DEG:g} deg, or the delays of the other leg alone",
                at=propagation.path(name, delay),
            )
