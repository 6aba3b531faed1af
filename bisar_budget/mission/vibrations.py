"""Sections of a mission file for vibrations: sinusoids, noise and spectra, as displacements or accelerations."""

import math
from collections.abc import Iterator
from typing import Annotated, NamedTuple

from bisar_budget import units
from bisar_budget.arrays import PerCase
from bisar_budget.faults import InvalidValueError, KeyPath, Problem, sentences
from bisar_budget.geometry import Vector
from bisar_budget.mission.readers import (
    INVALID,
    VIBRATION_FREQUENCY,
    Invalid,
    Key,
    ListOf,
    OneOf,
    Points,
    PointsReader,
    Quantity,
    Reader,
    Report,
    Section,
    SectionValue,
    SectionValues,
    Triple,
    either,
)
from bisar_budget.units import Dimension, given_unit

_OF_SPEED = "A velocity divided by 2πf is a displacement"


class _Displacement(Quantity):
    """A displacement; its faults tell how to write a vibration that is known by its velocity or acceleration.

    The class reads a displacement from a mission file. Faults are the messages about values that it refuses.
    """

    def __init__(self, of_acceleration: str, also: str = "") -> None:
        super().__init__(units.LENGTH, ge=0, le=1e9)
        self.of_acceleration, self.also = of_acceleration, also

    def leaf(self, value: object) -> float:
        """Read a displacement, and check its bounds; a velocity or an acceleration is refused with a hint."""
        try:
            return super().leaf(value)
        except InvalidValueError as error:
            from bisar_budget.other_units import is_of

            unit = units.unit_behind(value) if isinstance(value, str) else ""
            hints = {units.SPEED: _OF_SPEED, units.ACCELERATION: self.of_acceleration}
            hint = next((hint for dimension, hint in hints.items() if unit and is_of(unit, dimension)), "")
            problem = error.problem
            accepted = f"{problem.accepted}{self.also}" if problem.accepted else ""
            raise InvalidValueError(problem.problem, accepted, sentences(problem.hint, hint)) from None


_ACCELERATION_SIZE = Quantity(units.ACCELERATION, ge=0, le=1e6)
_AMPLITUDE = _Displacement("Write it in g or m/s^2", "; or its acceleration in g, mg, ug, m/s^2")
_RMS = _Displacement("Noise of acceleration is a spectrum, in g^2/Hz")
_DISPLACEMENT_BY_AXIS = either(list, Triple(_AMPLITUDE), _AMPLITUDE)
_NOISE_BY_AXIS = either(list, Triple(_RMS), _RMS)
_ACCELERATION_BY_AXIS = either(list, Triple(_ACCELERATION_SIZE), _ACCELERATION_SIZE)
_ALONG = "along the line of sight; a vector: along each axis"


def _of_all(value: float | Vector, number: float) -> float | Vector:
    """Multiply an amplitude by a number; the amplitude is a value along the line of sight, or one value per axis."""
    if isinstance(value, tuple):
        a, b, c = value
        return a * number, b * number, c * number
    return value * number


class Sinusoid(NamedTuple):
    """One sinusoidal vibration."""

    amplitude: Annotated[
        float | Vector,
        Key(
            _DISPLACEMENT_BY_AXIS,
            "0 to peak, along the line of sight; a vector: along each axis of the frame. In g it is an acceleration.",
        ),
    ]
    frequency: Annotated[float, Key(VIBRATION_FREQUENCY)]

    @property
    def scale(self) -> float:
        """Displacement per unit of amplitude: 1, because the amplitude is a displacement. [m/m]"""
        return 1.0

    @property
    def displacement(self) -> float | Vector:
        """Amplitude of the displacement: a value along the line of sight, or one value per axis. [m]"""
        return self.amplitude

    @property
    def acceleration(self) -> float | Vector:
        """Amplitude of the acceleration: a value along the line of sight, or one value per axis. [m/s²]"""
        return _of_all(self.amplitude, (2 * math.pi * self.frequency) ** 2)


class AcceleratedSinusoid(NamedTuple):
    """One sinusoidal vibration by its acceleration, which is constant if the frequency changes.

    The file states the amplitude of the acceleration. If a sweep or a search changes the frequency, this amplitude
    stays the same, so the displacement changes.
    """

    amplitude: Annotated[
        float | Vector, Key(_ACCELERATION_BY_AXIS, f"Amplitude of the acceleration, 0 to peak, {_ALONG}.")
    ]
    frequency: Annotated[float, Key(VIBRATION_FREQUENCY)]

    @property
    def scale(self) -> float:
        """Displacement per unit of amplitude: 1/(2πf)², because the amplitude is an acceleration. [s²]"""
        return 1 / (2 * math.pi * self.frequency) ** 2

    @property
    def displacement(self) -> float | Vector:
        """Amplitude of the displacement: a value along the line of sight, or one value per axis. [m]"""
        return _of_all(self.amplitude, self.scale)

    @property
    def acceleration(self) -> float | Vector:
        """Amplitude of the acceleration: a value along the line of sight, or one value per axis. [m/s²]"""
        return self.amplitude


_SINUSOID, _ACCELERATED = Section(Sinusoid), Section(AcceleratedSinusoid)


def _form_of_sinusoid(value: object) -> Reader[Sinusoid | AcceleratedSinusoid]:
    """Return the reader for a sinusoid.

    If the amplitude has a unit of acceleration, the reader makes an `AcceleratedSinusoid`, otherwise a `Sinusoid`.
    """
    amplitude = value.get("amplitude") if isinstance(value, dict) else None
    components = amplitude if isinstance(amplitude, list) else [amplitude]
    is_accelerated = any(isinstance(text, str) and given_unit(text, units.ACCELERATION.si) for text in components)
    return _ACCELERATED if is_accelerated else _SINUSOID


SINUSOIDS = ListOf(OneOf(_form_of_sinusoid, (_SINUSOID, _ACCELERATED)))


class Wideband(NamedTuple):
    """Noise-like vibration."""

    rms: Annotated[float | Vector, Key(_NOISE_BY_AXIS, f"Root mean square, {_ALONG}.")]


class Spectrum(NamedTuple):
    """One-sided spectral density of a vibration: straight over logarithms between its points, zero outside of them.

    `points` are pairs of frequency [Hz] and density. If `is_accelerated`, the densities are of acceleration
    [(m/s²)²/Hz], otherwise of displacement [m²/Hz].
    """

    points: Points
    is_accelerated: bool

    def times(self, power: PerCase) -> "Spectrum":
        """Copy of the spectrum in which each density is multiplied by the power ratio `power`."""
        points: SectionValue = tuple((f, density * power) for f, density in self.points)
        return self._replace(points=points)


class _SpectrumReader(PointsReader[Spectrum]):
    """A mapping of frequencies to densities, all of acceleration or all of displacement.

    The class reads such a mapping from a mission file, and makes a `Spectrum` from it.
    """

    def __init__(self, dimension: Dimension, example: str) -> None:
        frequency = Quantity(units.FREQUENCY, gt=0, ge=1e-6, le=1e9)
        super().__init__(frequency, Quantity(dimension, gt=0, ge=1e-60, le=1e15), f"{example} and the like", 2)
        self.is_accelerated = dimension is units.ACCELERATION_DENSITY

    def read(self, value: object, path: KeyPath, report: Report) -> Spectrum | Invalid:
        """Read the points, and return them as a spectrum of acceleration or displacement."""
        points = self.points(value, path, report)
        return INVALID if points is INVALID else Spectrum(points, self.is_accelerated)


_SPECTRA = (
    _SpectrumReader(units.ACCELERATION_DENSITY, "{20 Hz: 0.04 g^2/Hz, 1 kHz: 0.04 g^2/Hz}"),
    _SpectrumReader(units.DISPLACEMENT_DENSITY, "{20 Hz: 0.01 mm^2/Hz, 1 kHz: 1e-8 mm^2/Hz}"),
)


def _form_of_spectrum(value: object) -> Reader[Spectrum]:
    """Return the reader for a spectrum, chosen by the units of its points.

    If more points have units of displacement than of acceleration, the reader makes a displacement spectrum,
    otherwise an acceleration spectrum.
    """
    texts = [item for item in value.values() if isinstance(item, str)] if isinstance(value, dict) else []
    accelerations, displacements = (
        sum(bool(given_unit(text, reader.ordinate.dimension.si)) for text in texts) for reader in _SPECTRA
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
            "One-sided, of acceleration (g^2/Hz) or of displacement (m^2/Hz), along the line of sight; "
            "interpolated over logarithms, zero outside its points.",
        ),
    ] = None
    spectrum_level: Annotated[float | None, Key(LEVEL, "Shifts the spectrum.")] = None

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Refuse a `spectrum_level` without a `spectrum`."""
        if values.get("spectrum_level") is not None and "spectrum" in values and values["spectrum"] is None:
            problem = "shifts a spectrum, and there is none"
            yield Problem(problem, "accepted: spectrum beside it", at=("spectrum_level",))

    @property
    def is_stated(self) -> bool:
        """Whether the file states a vibration; an amplitude of zero counts as stated."""
        return bool(self.sinusoidal) or self.wideband is not None or self.spectrum is not None


class FeltVibration(NamedTuple):
    """Vibration at the mount of an oscillator, including the vibration that navigation senses."""

    sinusoidal: Annotated[tuple[Sinusoid | AcceleratedSinusoid, ...], Key(SINUSOIDS, "One entry per line.")] = ()
    spectrum: Annotated[
        Spectrum | None, Key(SPECTRUM, "One-sided, of acceleration (g^2/Hz) or of displacement (m^2/Hz).")
    ] = None
    spectrum_level: Annotated[float | None, Key(LEVEL, "Shifts the spectrum.")] = None

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Refuse a `spectrum_level` without a `spectrum`."""
        yield from Vibration.problems(values)

    @property
    def is_stated(self) -> bool:
        """Whether the file states a vibration; an amplitude of zero counts as stated."""
        return bool(self.sinusoidal) or self.spectrum is not None


FELT_VIBRATION = Section(FeltVibration)
