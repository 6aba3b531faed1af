"""Vibration of a mission file: sinusoids, wideband noise and spectra, of displacement or of acceleration."""

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, NamedTuple

from bisar_budget import units
from bisar_budget.faults import KeyPath, Problem
from bisar_budget.geometry import Vector
from bisar_budget.mission.readers import (
    INVALID,
    SIZE,
    VIBRATION_FREQUENCY,
    CurveReader,
    Key,
    ListOf,
    OneOf,
    Points,
    Quantity,
    Reader,
    Report,
    Section,
    Triple,
    either,
)
from bisar_budget.units import Dimension, given_unit

_ACCELERATION_SIZE = Quantity(units.ACCELERATION, ge=0, le=1e6)
_DISPLACEMENT = either(list, Triple(SIZE), SIZE)
_ACCELERATION = either(list, Triple(_ACCELERATION_SIZE), _ACCELERATION_SIZE)
_ALONG = "along the line of sight; a vector: along each axis"


def _of_all(value: Any, number: Any) -> Any:
    """A single number, or each of three, with a factor of an amplitude."""
    return tuple(part * number for part in value) if isinstance(value, tuple) else value * number


class Sinusoid(NamedTuple):
    """One sinusoidal vibration."""

    amplitude: Annotated[
        float | Vector,
        Key(
            _DISPLACEMENT,
            "0 to peak, along the line of sight; a vector: along each axis of the frame. In g it is an acceleration.",
        ),
    ]
    frequency: Annotated[float, Key(VIBRATION_FREQUENCY)]

    @property
    def scale(self) -> Any:
        """Displacement by a unit of the amplitude. [m/m]"""
        return 1.0

    @property
    def displacement(self) -> Any:
        """Amplitude of the displacement, or along each axis. [m]"""
        return self.amplitude

    @property
    def acceleration(self) -> Any:
        """Amplitude of the acceleration, or along each axis. [m/s²]"""
        return _of_all(self.amplitude, (2 * math.pi * self.frequency) ** 2)


class AcceleratedSinusoid(NamedTuple):
    """One sinusoidal vibration by its acceleration, which it keeps when its frequency changes."""

    amplitude: Annotated[float | Vector, Key(_ACCELERATION, f"Of its acceleration, 0 to peak, {_ALONG}.")]
    frequency: Annotated[float, Key(VIBRATION_FREQUENCY)]

    @property
    def scale(self) -> Any:
        """Displacement by a unit of the amplitude: 1/(2πf)². [s²]"""
        return 1 / (2 * math.pi * self.frequency) ** 2

    @property
    def displacement(self) -> Any:
        """Amplitude of the displacement, or along each axis. [m]"""
        return _of_all(self.amplitude, self.scale)

    @property
    def acceleration(self) -> Any:
        """Amplitude of the acceleration, or along each axis. [m/s²]"""
        return self.amplitude


_SINUSOID, _ACCELERATED = Section(Sinusoid), Section(AcceleratedSinusoid)


def _form_of_sinusoid(value: Any) -> Reader:
    """A sinusoid in g, or in metres, by the first unit of its amplitude."""
    amplitude = value.get("amplitude") if isinstance(value, dict) else None
    parts = amplitude if isinstance(amplitude, list) else [amplitude]
    is_accelerated = any(isinstance(part, str) and given_unit(part, units.ACCELERATION.si) for part in parts)
    return _ACCELERATED if is_accelerated else _SINUSOID


SINUSOIDS = ListOf(OneOf(_form_of_sinusoid, (_SINUSOID, _ACCELERATED)))


class Wideband(NamedTuple):
    """Noise-like vibration."""

    rms: Annotated[float | Vector, Key(_DISPLACEMENT, f"Root mean square, {_ALONG}.")]


class Spectrum(NamedTuple):
    """One-sided spectral density of a vibration, straight over logarithms between its points, nothing beside them.

    `points` are frequencies [Hz] with densities of acceleration [(m/s²)²/Hz], or of displacement [m²/Hz].
    """

    points: Points
    is_accelerated: bool

    def times(self, power: Any) -> "Spectrum":
        """The same with each density times a factor of power."""
        return self._replace(points=tuple((f, density * power) for f, density in self.points))


class _SpectrumReader(CurveReader):
    """A mapping of frequencies to densities that all are of acceleration, or all of displacement."""

    def __init__(self, dimension: Dimension, example: str) -> None:
        frequency = Quantity(units.FREQUENCY, gt=0, ge=1e-6, le=1e9)
        super().__init__(frequency, Quantity(dimension, gt=0, ge=1e-60, le=1e15), f"{example} and the like", 2)
        self.is_accelerated = dimension is units.ACCELERATION_DENSITY

    def read(self, value: Any, path: KeyPath, report: Report) -> Any:
        """Read the points, and say which they are."""
        points = super().read(value, path, report)
        return INVALID if points is INVALID else Spectrum(points, self.is_accelerated)


_SPECTRA = (
    _SpectrumReader(units.ACCELERATION_DENSITY, "{20 Hz: 0.04 g^2/Hz, 1 kHz: 0.04 g^2/Hz}"),
    _SpectrumReader(units.DISPLACEMENT_DENSITY, "{20 Hz: 0.01 mm^2/Hz, 1 kHz: 1e-8 mm^2/Hz}"),
)


def _form_of_spectrum(value: Any) -> Reader:
    """The reader of the dimension that most points have; acceleration where it is not clear."""
    texts = [item for item in value.values() if isinstance(item, str)] if isinstance(value, dict) else []
    accelerations, displacements = (
        sum(bool(given_unit(text, one.ordinate.dimension.si)) for text in texts) for one in _SPECTRA
    )
    return _SPECTRA[accelerations < displacements]


SPECTRUM = OneOf(_form_of_spectrum, _SPECTRA)
LEVEL = Quantity(units.POWER_RATIO, ge=-200, le=200)


class Vibration(NamedTuple):
    """High-frequency motion that the navigation does not measure."""

    sinusoidal: Annotated[tuple[Sinusoid | AcceleratedSinusoid, ...], Key(SINUSOIDS, "One entry per line.")] = ()
    wideband: Annotated[Wideband | None, Key(Section(Wideband))] = None
    spectrum: Annotated[
        Spectrum | None,
        Key(
            SPECTRUM,
            "One-sided, of acceleration (g^2/Hz) or of displacement (m^2/Hz), along the line of sight; interpolated "
            "over logarithms, nothing beside its points.",
        ),
    ] = None
    spectrum_level: Annotated[float | None, Key(LEVEL, "Shifts the spectrum.")] = None

    @staticmethod
    def problems(values: Mapping[str, Any]) -> Iterator[Problem]:
        """Hold a level to a spectrum."""
        if values.get("spectrum_level") is not None and "spectrum" in values and values["spectrum"] is None:
            said = "shifts a spectrum, and there is none"
            yield Problem(said, "accepted: spectrum beside it", at=("spectrum_level",))

    @property
    def is_stated(self) -> bool:
        """Whether the file says anything of it; a zero does."""
        return bool(self.sinusoidal) or self.wideband is not None or self.spectrum is not None


class FeltVibration(NamedTuple):
    """Vibration that an oscillator feels where it is mounted, whatever navigation senses of it."""

    sinusoidal: Annotated[tuple[Sinusoid | AcceleratedSinusoid, ...], Key(SINUSOIDS, "One entry per line.")] = ()
    spectrum: Annotated[
        Spectrum | None, Key(SPECTRUM, "One-sided, of acceleration (g^2/Hz) or of displacement (m^2/Hz).")
    ] = None
    spectrum_level: Annotated[float | None, Key(LEVEL, "Shifts the spectrum.")] = None

    @staticmethod
    def problems(values: Mapping[str, Any]) -> Iterator[Problem]:
        """Hold a level to a spectrum."""
        yield from Vibration.problems(values)

    @property
    def is_stated(self) -> bool:
        """Whether the file says anything of it; a zero does."""
        return bool(self.sinusoidal) or self.spectrum is not None


FELT_VIBRATION = Section(FeltVibration)
