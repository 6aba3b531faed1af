"""Sections of a mission file with data-sheet figures: inertial sensors, position noise, oscillators, synchronisation.

A figure is a value that a data sheet states, such as a bias or a phase-noise mask. Values are in SI units, 1 sigma.
"""

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Annotated, NamedTuple

from bisar_budget import units
from bisar_budget.error_kinds.clock_kinds import FREQUENCY_KIND, TIME_KIND
from bisar_budget.faults import KeyPath, Problem
from bisar_budget.geometry import Vector
from bisar_budget.json_types import Definitions, JsonObject
from bisar_budget.mission.readers import (
    INVALID,
    Choice,
    CurveReader,
    Invalid,
    Key,
    ListOf,
    Points,
    Quantity,
    Reader,
    Reference,
    Report,
    Section,
    SectionValues,
    Source,
    Text,
    Triple,
    has_valid_values,
    read_part,
)
from bisar_budget.mission.vibrations import FELT_VIBRATION, LEVEL, FeltVibration

_BIAS = Triple(Quantity(units.ACCELERATION, ge=0, le=1e3), or_scalar=True)
_SCALE = Triple(Quantity(units.RATIO, ge=0, le=0.1), or_scalar=True)
_TILT = Triple(Quantity(units.ANGLE, ge=0, le=math.pi / 4), or_scalar=True)
_DRIFT = Triple(Quantity(units.ANGULAR_RATE, ge=0, le=1e3), or_scalar=True)
_VELOCITY_WALK = Triple(Quantity(units.VELOCITY_RANDOM_WALK, ge=0, le=1e3), or_scalar=True)
_ANGLE_WALK = Triple(Quantity(units.ANGLE_RANDOM_WALK, ge=0, le=1e2), or_scalar=True)


# Figures that a mission file may state itself or take from a part of the catalogue.
AccelerometerBias = Annotated[Vector | None, Key(_BIAS, "Residual bias in flight.")]
AccelerometerScaleFactor = Annotated[
    Vector | None,
    Key(_SCALE, "Scale factor error of each axis: excess of the measured specific force, as a fraction."),
]
Attitude = Annotated[Vector | None, Key(_TILT, "Tilt and heading at mid-aperture, about each axis.")]
GyroBias = Annotated[Vector | None, Key(_DRIFT, "Residual bias in flight.")]
VelocityRandomWalk = Annotated[Vector | None, Key(_VELOCITY_WALK, "Noise of the accelerometers.")]
AngleRandomWalk = Annotated[Vector | None, Key(_ANGLE_WALK, "Noise of the gyros.")]


class Overridden(NamedTuple):
    """A figure of a part, or of the accuracy of a log, that a key of the file replaces.

    Attributes
    ----------
    figure : str
        Key of the replaced figure.
    key : str
        Key that replaces the figure, relative to the platform.
    part : str
        Name of the part or log that states the replaced figure.
    text : str
        The replaced figure as written in the file of the part.
    frequency : str
        Frequency of the part, if the mission states a phase-noise mask without a frequency. The mask then applies at
        this frequency. Empty in all other cases.
    """

    figure: str
    key: str
    part: str
    text: str
    frequency: str = ""


class TakenFigure(NamedTuple):
    """A figure that a mission takes from a part.

    Attributes
    ----------
    key : str
        Path of the key under which the mission could state the figure itself.
    value : str, list or mapping
        The figure as written in the file of the part.
    part : str
        Name of the part.
    """

    key: str
    value: object
    part: str


class Imu(NamedTuple):
    """Figures of an inertial sensor, 1 sigma. A scalar means each axis; three values follow the error's frame.

    Three values are given along the axes of `motion_error.frame`.
    """

    accelerometer_bias: AccelerometerBias = None
    accelerometer_scale_factor: AccelerometerScaleFactor = None
    attitude: Attitude = None
    gyro_bias: GyroBias = None
    velocity_random_walk: VelocityRandomWalk = None
    angle_random_walk: AngleRandomWalk = None
    source: Source = None

    @property
    def is_stated(self) -> bool:
        """Whether the file states at least one figure of the sensor; a value of zero counts as stated."""
        return any(getattr(self, kind) is not None for kind in IMU_KINDS)


IMU_KINDS = Imu._fields[:-1]  # keys of the figures, without the source


class GaussMarkov(NamedTuple):
    """A first-order Gauss-Markov position error, such as residual GNSS noise."""

    name: Annotated[str, Key(Text(), "Becomes the row id PLATFORM.random.NAME.")]
    sigma: Annotated[Vector, Key(Triple(Quantity(units.LENGTH, ge=0, le=1e6), or_scalar=True), "1 sigma, each axis.")]
    correlation_time: Annotated[float, Key(Quantity(units.TIME, gt=0, ge=1e-6, le=1e9))]
    source: Annotated[str | None, Key(Text())] = None


class LeverArm(NamedTuple):
    """From the navigation's reference to the antenna's phase centre, in the platform's own axes.

    A lever arm has components along the velocity, horizontally across it, and up. These axes turn with the velocity.
    The axes of a fixed platform are the axes of the scene.
    """

    arm: Annotated[
        Vector | None,
        Key(
            Triple(Quantity(units.LENGTH, ge=-1e3, le=1e3)),
            "Along, cross (to the left) and up: errors of imu.attitude, gyro_bias and angle_random_walk swing it.",
        ),
    ] = None
    uncertainty: Annotated[
        Vector | None,
        Key(
            Triple(Quantity(units.LENGTH, ge=0, le=1e3), or_scalar=True),
            "1 sigma, each axis; it turns with the body.",
        ),
    ] = None
    source: Source = None

    @staticmethod
    def any_of() -> tuple[str, ...]:
        """Keys of a lever arm; at least one of them is required."""
        return ("arm", "uncertainty")

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Yield a problem for a lever arm with neither `arm` nor `uncertainty`."""
        if values.keys() >= {"arm", "uncertainty"} and values["arm"] is None and values["uncertainty"] is None:
            yield Problem("is empty", "accepted: arm, uncertainty or both")


class PowerLaw(NamedTuple):
    """One-sided spectrum of the fractional frequency, S_y = h₋₂/f² + h₋₁/f + h₀ + h₁·f + h₂·f². SI.

    The fields are the coefficients h₋₂ to h₂, in this order.
    """

    random_walk: float = 0.0
    flicker: float = 0.0
    white: float = 0.0
    flicker_phase: float = 0.0
    white_phase: float = 0.0


POWERS = dict(zip(("h-2", "h-1", "h0", "h1", "h2"), PowerLaw._fields, strict=True))  # keys of the file to fields
_COEFFICIENT = Quantity(units.RATIO, ge=0, le=1)


class _PowerLawReader(Reader[PowerLaw]):
    """A mapping of h-2 … h2 to coefficients.

    The class reads such a mapping from a mission file, and makes a `PowerLaw` from it.
    """

    accepted = "{h-2: 4e-23, h-1: 2e-21, h0: 8e-20} and the like"

    def read(self, value: object, path: KeyPath, report: Report) -> PowerLaw | Invalid:
        """Read the coefficient of each power; an invalid coefficient is reported at its own path."""
        accepted = f"accepted: {', '.join(POWERS)}"
        if not isinstance(value, dict) or not value:
            report(path, Problem("must be a mapping of coefficients", accepted))
            return INVALID
        coefficients: dict[str, float | Invalid] = dict.fromkeys(POWERS, 0.0)
        is_valid = True
        for key, item in value.items():
            if key not in coefficients:
                report((*path, key), Problem("is not a known key", accepted, is_of_key=True))
                is_valid = False
                continue
            coefficients[key] = read_part(_COEFFICIENT, item, (*path, key), report)
        return PowerLaw(*coefficients.values()) if is_valid and has_valid_values(coefficients) else INVALID

    def below(self, part: str) -> Reader[object] | None:
        """Reader of the coefficient of a power such as `h-2`; None for an unknown key."""
        return _COEFFICIENT if part in POWERS else None

    def schema(self, definitions: Definitions) -> JsonObject:
        """JSON Schema: an object with at least one of the keys `h-2` to `h2`, and their coefficients."""
        coefficient = _COEFFICIENT.schema(definitions)
        properties = dict.fromkeys(POWERS, coefficient)
        return {"type": "object", "properties": properties, "additionalProperties": False, "minProperties": 1}


OSCILLATOR_NOISE_FORMS = ("phase_noise", "allan_deviation", "power_law")
MAX_FALL_DB_PER_DECADE = 60.0  # of a mask; noise of an oscillator falls by 40 at most
MAX_RISE_DB_PER_DECADE = 20.0  # of a mask; a steeper rise is a tone or a mistake
_OR_SENSOR = ", or sensor: a part of the catalogue"
NOT_SENSITIVE = Problem(
    "does nothing to an oscillator without acceleration_sensitivity",
    "accepted: acceleration_sensitivity beside it, such as 1e-9 /g",
    at=("vibration",),
)


Frequency = Annotated[
    float | None, Key(Quantity(units.FREQUENCY, gt=0, ge=1, le=1e15), "Frequency at which a mask is stated.")
]
PhaseNoise = Annotated[
    Points | None,
    Key(
        CurveReader(
            Quantity(units.FREQUENCY, gt=0, ge=1e-6, le=1e12),
            Quantity(units.PHASE_NOISE, ge=-250, le=60),
            "{1 Hz: -95 dBc/Hz, 10 Hz: -125 dBc/Hz} and the like",
            2,
        ),
        "L(f), single sideband; interpolated over logarithms.",
    ),
]
AllanDeviation = Annotated[
    Points | None,
    Key(
        CurveReader(
            Quantity(units.TIME, gt=0, ge=1e-6, le=1e9),
            Quantity(units.RATIO, gt=0, ge=1e-20, le=1e-3),
            "{1 s: 6e-12, 10 s: 2e-11} and the like",
            1,
        ),
        "σ_y(τ); a power law is fitted.",
    ),
]
Aging = Annotated[
    float | None,
    Key(Quantity(units.AGING, ge=0, le=1e-3), "Drift of the fractional frequency since the clock was set."),
]
PowerLawFigures = Annotated[
    PowerLaw | None, Key(_PowerLawReader(), "h-2 … h2 of the one-sided spectrum of fractional frequency.")
]
AccelerationSensitivity = Annotated[
    float | None,
    Key(
        Quantity(units.ACCELERATION_SENSITIVITY, ge=0, le=1e-3),
        "Γ: change of the fractional frequency per acceleration, in the direction of the largest change.",
    ),
]


class Oscillator(NamedTuple):
    """An oscillator and its noise, in one of three forms or as a part of the catalogue.

    `overridden` lists the figures of the part that are replaced by keys of the file. If aging and acceleration
    sensitivity come from the part, `of_parts` contains their sources.
    """

    frequency: Frequency = None
    phase_noise: PhaseNoise = None
    allan_deviation: AllanDeviation = None
    power_law: PowerLawFigures = None
    bandwidth: Annotated[
        float | None,
        Key(
            Quantity(units.FREQUENCY, gt=0, ge=1e-3, le=1e12),
            "Phase noise counts up to this offset; omitted: a mask to its last point, another form to 1 kHz.",
        ),
    ] = None
    spurs: Annotated[
        Points,
        Key(
            CurveReader(
                Quantity(units.FREQUENCY, gt=0, ge=1e-3, le=1e12),
                Quantity(units.TONE, ge=-250, le=0),
                "{50 Hz: -90 dBc} and the like",
                1,
            ),
            "Tones of the oscillator, single sideband at its frequency: each makes paired echoes.",
        ),
    ] = ()
    aging: Aging = None
    level: Annotated[float, Key(LEVEL, "Shifts the whole spectrum of the noise, but not the spurs.")] = 0.0
    acceleration_sensitivity: AccelerationSensitivity = None
    vibration: Annotated[
        FeltVibration | None,
        Key(
            FELT_VIBRATION,
            "Vibration at its mount; omitted: motion_error.vibration of its platform, the vibration that "
            "navigation does not sense.",
        ),
    ] = None
    sensor: Annotated[
        str | None,
        Key(Reference(), "A part of the catalogue, or a file; other keys of the section override its figures."),
    ] = None
    source: Source = None
    overridden: tuple[Overridden, ...] = ()
    of_parts: tuple[tuple[str, str], ...] = ()

    @property
    def needs_frequency(self) -> bool:
        """Whether the noise is stated at a carrier frequency, that is, as a mask or as spurs.

        A power law describes the fractional frequency, and needs no carrier frequency.
        """
        return self.phase_noise is not None or bool(self.spurs)

    @property
    def states_sensitivity(self) -> bool:
        """Whether the file itself states the acceleration sensitivity, instead of taking it from a part."""
        comes_from_part = "acceleration_sensitivity" in dict(self.of_parts)
        return self.acceleration_sensitivity is not None and not comes_from_part

    @property
    def mask_at_frequency_of_part(self) -> Overridden | None:
        """The phase noise of a part, if the mission overrides it by a mask without a frequency; otherwise None.

        The mask then applies at the frequency of the part.
        """
        return next((figure for figure in self.overridden if figure.frequency), None)

    @property
    def noise_alone(self) -> "Oscillator":
        """Copy of the oscillator without level, aging, acceleration sensitivity and vibration.

        Only the noise and the spurs remain.
        """
        return self._replace(level=0.0, aging=None, acceleration_sensitivity=None, vibration=None)

    @staticmethod
    def problems(values: SectionValues, or_else: str = _OR_SENSOR) -> Iterator[Problem]:
        """Require exactly one form of noise, and refuse masks with slopes that no oscillator can have.

        A mask or spurs also need a frequency, and a vibration needs an acceleration sensitivity. A part of the
        catalogue may supply these values. `or_else` names further accepted keys; it is added to the error message
        about missing noise.
        """
        forms = [form for form in OSCILLATOR_NOISE_FORMS if values.get(form) is not None]
        accepted = f"accepted: one of {', '.join(OSCILLATOR_NOISE_FORMS)}"
        for form in forms[1:]:
            yield Problem(f"stands beside {forms[0]}", accepted, at=(form,))
        if values.get("sensor") is None and values.keys() >= set(OSCILLATOR_NOISE_FORMS):
            if not forms:
                yield Problem("says nothing of its noise", f"{accepted}{or_else}")
            if values["phase_noise"] is not None and values.get("frequency", 0.0) is None:
                yield Problem("is missing", "accepted: the frequency at which the mask is stated", at=("frequency",))
        if values.get("spurs") and values.get("sensor") is None and values.get("frequency", 0.0) is None:
            yield Problem("is missing", "accepted: the frequency at which the tones are stated", at=("frequency",))
        is_insensitive = "acceleration_sensitivity" in values and values["acceleration_sensitivity"] is None
        if values.get("vibration") is not None and values.get("sensor") is None and is_insensitive:
            yield NOT_SENSITIVE
        for (f, level), (g, next_level) in pairwise(values.get("phase_noise") or ()):
            slope = (next_level - level) / math.log10(g / f)
            if slope < -MAX_FALL_DB_PER_DECADE or slope > MAX_RISE_DB_PER_DECADE:
                verb = "rises" if slope > 0 else "falls"
                yield Problem(
                    f"{verb} by {abs(slope):.3g} dB a decade between {f:g} Hz and {g:g} Hz",
                    f"accepted: a rise of at most {MAX_RISE_DB_PER_DECADE:g} and a fall of at most "
                    f"{MAX_FALL_DB_PER_DECADE:g} dB a decade",
                    at=("phase_noise",),
                )


# Keys that each method needs.
METHODS: Mapping[str, tuple[str, ...]] = {
    "linear": ("interval", "error"),
    "direct_path": ("error",),
    "holdover": ("age", "averaging"),
}


class Synchronization(NamedTuple):
    """How the receiver follows the transmitter's oscillator, or how both clocks were set.

    The method is an exchange of pulses, the direct path as the receiver's clock, or holdover, in which the clocks
    were set once and then run free.
    """

    error: Annotated[
        float | None,
        Key(
            Quantity(units.ANGLE, ge=0, lt=math.pi / 2),
            "Phase error of the link, 1 sigma, at each exchange or pulse; not with holdover.",
        ),
    ] = None
    interval: Annotated[
        float | None, Key(Quantity(units.TIME, gt=0, ge=1e-9, le=1e6), "Time between exchanged pulses; linear.")
    ] = None
    method: Annotated[
        str,
        Key(
            Choice(*METHODS),
            "linear: pulses are exchanged, between them the phase is interpolated; "
            "direct_path: the receiver hears the transmitter and takes it as its clock; "
            "holdover: the clocks were set once, and have run free since.",
        ),
    ] = "linear"
    age: Annotated[
        float | None,
        Key(
            Quantity(units.TIME, gt=0, ge=1e-6, le=1e8),
            "Time from the middle of the averaging to mid-aperture; holdover.",
        ),
    ] = None
    averaging: Annotated[
        float | None,
        Key(
            Quantity(units.TIME, gt=0, ge=1e-6, le=1e8),
            "Duration over which a line was fitted to the time, to set the clock; holdover.",
        ),
    ] = None
    time_error: Annotated[
        float | None,
        Key(
            Quantity(units.TIME, ge=-1e6, le=1e6),
            TIME_KIND.description,
        ),
    ] = None
    frequency_error: Annotated[
        float | None,
        Key(Quantity(units.RATIO, ge=-1e-2, le=1e-2), FREQUENCY_KIND.description),
    ] = None
    source: Source = None

    @property
    def is_direct_path(self) -> bool:
        """Whether the receiver receives the transmitter's signal directly, without an exchange of pulses."""
        return self.method == "direct_path"

    @property
    def is_holdover(self) -> bool:
        """Whether both clocks are set before the aperture and then run free."""
        return self.method == "holdover"

    @staticmethod
    def problems(values: SectionValues) -> Iterator[Problem]:
        """Require the keys that the method of synchronisation needs, and refuse keys that belong to other methods."""
        method = values.get("method")
        if method is None:
            return
        needed = METHODS[method]
        for key in _MEANS:
            if key in values and values[key] is None and key in needed:
                yield Problem("is missing", f"accepted: {_MEANS[key]}", at=(key,))
            elif values.get(key) is not None and key not in needed:
                problem = _REFUSED.get((method, key), f"has no part in {method}")
                yield Problem(problem, f"accepted: {', '.join(needed)}; no {key}", at=(key,))


_MEANS = {
    "interval": "the time between exchanged pulses",
    "error": "the phase error of the link",
    "age": "the time from the middle of the averaging to mid-aperture",
    "averaging": "the time over which a line was fitted to set the clock",
}
_REFUSED = {
    ("direct_path", "interval"): "a direct path is heard with every pulse",
    ("holdover", "error"): "a clock in holdover has no link; time_error and frequency_error say how well it was set",
}


IMU = Section(Imu)
LEVER_ARM = Section(LeverArm)
RANDOM = ListOf(GaussMarkov)
OSCILLATOR = Section(Oscillator)
SYNCHRONIZATION = Section(Synchronization)
