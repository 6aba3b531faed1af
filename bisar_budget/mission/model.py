"""Mission file, schema_version 1: every key, its type and its meaning. Values are SI and radians."""

import math
from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PrivateAttr,
    Tag,
    model_validator,
)

from bisar_budget.constants import SPEED_OF_LIGHT
from bisar_budget.errors import InvalidValueError, KeyPath, Problem
from bisar_budget.geometry import BistaticGeometry, PlatformState, UndefinedFrameError, state_from_angles
from bisar_budget.mission import fields as f

FULL_MODEL = "it comes with the full model"


class Section(BaseModel):
    """A mapping of the mission file; a key it does not know is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def _choice(*names: str) -> Any:
    def read(value: object) -> object:
        if value not in names:
            from difflib import get_close_matches

            near = get_close_matches(str(value), names, 1)
            raise InvalidValueError(
                Problem(
                    problem="is not a known choice",
                    accepted=f"accepted: {', '.join(names)}",
                    hint=f"Did you mean {near[0]!r}?" if near else "",
                )
            )
        return value

    return BeforeValidator(read)


class Radar(Section):
    """The waveform."""

    center_frequency: f.Frequency = Field(description="Centre of the band; every phase uses it.")
    bandwidth: f.Frequency = Field(description="Width of the band, for the resolution.")

    @model_validator(mode="after")
    def _band_is_positive(self) -> "Radar":
        if self.bandwidth >= 2 * self.center_frequency:
            raise InvalidValueError(
                Problem(problem="must be less than twice the centre frequency", at=("bandwidth",))
            )
        return self

    @property
    def wavelength(self) -> float:
        """At the centre frequency. [m]"""
        return SPEED_OF_LIGHT / self.center_frequency


class Collection(Section):
    """The data collection."""

    aperture_time: f.Duration = Field(description="T; the aperture is -T/2 to T/2.")
    pulses: f.PulseCount | None = Field(None, description="For the simulator; omitted: what the patch needs.")


class Scene(Section):
    """The imaged ground."""

    radius: f.Range | None = Field(None, description="Radius of the scene about its centre.")
    height_error: Annotated[Any, f.Later(FULL_MODEL)] = None


class Sinusoid(Section):
    """One sinusoidal vibration along the line of sight."""

    amplitude: Annotated[f.Size, BeforeValidator(lambda value: _scalar_amplitude(value))] = Field(
        description="0 to peak, along the line of sight."
    )
    frequency: f.VibrationFrequency


def _scalar_amplitude(value: object) -> object:
    if isinstance(value, list):
        raise InvalidValueError(
            Problem(
                problem=f"is not supported as a vector by this version of bisar-budget: {FULL_MODEL}",
                accepted="accepted: one amplitude along the line of sight",
            )
        )
    return value


class Wideband(Section):
    """Noise-like vibration along the line of sight."""

    rms: f.Size = Field(description="Root mean square, along the line of sight.")


class Vibration(Section):
    """High-frequency motion that the navigation does not measure."""

    sinusoidal: tuple[Sinusoid, ...] = Field((), max_length=1000)
    wideband: Wideband | None = None


class MotionError(Section):
    """How wrong the measured motion of one platform may be. A scalar means each axis."""

    frame: Annotated[Literal["scene", "track", "look"], _choice("scene", "track", "look")] = Field(
        "scene",
        description="scene: east, north, up; track: along, cross, up; look: line of sight, cross, up.",
    )
    position: f.PositionError | None = None
    velocity: f.VelocityError | None = None
    acceleration: f.AccelerationError | None = None
    covariance: Annotated[Any, f.Later(FULL_MODEL)] = None
    distribution: Annotated[Literal["normal", "uniform", "bound"], _choice("normal", "uniform", "bound")] = Field(
        "normal", description="normal: the values are one sigma; uniform, bound: they are not exceeded."
    )
    vibration: Vibration = Vibration()
    source: f.Text | None = Field(None, description="Where the values come from; shown as evidence.")


CARTESIAN_KEYS = ("position", "velocity")
POLAR_KEYS = ("slant_range", "azimuth", "elevation", "speed", "motion_azimuth", "climb")


class Platform(Section):
    """Position and velocity at the aperture midpoint, in one of two ways, and the motion error."""

    position: f.PositionVector | None = Field(None, description="East, north, up of the scene centre.")
    velocity: f.VelocityVector | None = Field(None, description="East, north, up.")
    acceleration: Annotated[Any, f.Later(FULL_MODEL)] = None
    slant_range: f.Range | None = Field(None, description="Distance to the scene centre.")
    azimuth: f.Direction | None = Field(None, description="From east, counter-clockwise.")
    elevation: f.Elevation | None = Field(None, description="Seen from the scene centre, above the ground.")
    speed: f.Speed | None = Field(None, description="Over ground; 0 is a fixed platform.")
    motion_azimuth: f.Direction | None = Field(
        None, description="Direction of motion, counted like azimuth (not a compass heading)."
    )
    climb: f.Velocity | None = Field(None, description="Vertical speed, up positive.")
    motion_error: MotionError = MotionError()

    @model_validator(mode="after")
    def _one_complete_geometry(self) -> "Platform":
        given = [key for key in (*CARTESIAN_KEYS, *POLAR_KEYS) if getattr(self, key) is not None]
        cartesian = [key for key in given if key in CARTESIAN_KEYS]
        polar = [key for key in given if key in POLAR_KEYS]
        ways = (
            "accepted: position and velocity, or slant_range, azimuth, elevation, speed, motion_azimuth "
            "(and climb); a fixed platform has speed 0 and no motion_azimuth"
        )
        if cartesian and polar:
            raise InvalidValueError(
                Problem(problem=f"mixes {cartesian[0]} with {polar[0]}", accepted=ways, at=(polar[0],))
            )
        if cartesian:
            missing = [key for key in CARTESIAN_KEYS if key not in given]
        else:
            fixed = self.speed == 0
            if fixed and self.motion_azimuth is not None:
                raise InvalidValueError(
                    Problem(problem="a platform with speed 0 has none", accepted=ways, at=("motion_azimuth",))
                )
            optional = {"climb", "motion_azimuth"} if fixed else {"climb"}
            missing = [key for key in POLAR_KEYS if key not in given and key not in optional]
        if missing:
            raise InvalidValueError(Problem(problem=f"lacks {', '.join(missing)}", accepted=ways))
        return self

    @model_validator(mode="after")
    def _above_ground_and_off_centre(self) -> "Platform":
        # An incomplete geometry has been reported; after that error this one is not reached.
        if self.state.position[2] < 0:
            raise InvalidValueError(
                Problem(problem="puts the platform below the ground, z < 0", at=self._place_key(2))
            )
        if self.state.slant_range < 1:
            raise InvalidValueError(
                Problem(problem="puts the platform within 1 m of the scene centre", at=self._place_key())
            )
        return self

    @model_validator(mode="after")
    def _frame_exists(self) -> "Platform":
        try:
            self.state.frame(self.motion_error.frame)
        except UndefinedFrameError as error:
            raise InvalidValueError(
                Problem(problem=str(error), accepted="accepted: scene", at=("motion_error", "frame"))
            ) from None
        return self

    def _place_key(self, axis: int | None = None) -> KeyPath:
        if self.position is None:
            return ("slant_range",) if axis is None else ("elevation",)
        return ("position",) if axis is None else ("position", axis)

    @cached_property
    def state(self) -> PlatformState:
        """Position and velocity in the frame of the scene."""
        if self.position is not None and self.velocity is not None:
            return PlatformState(position=self.position, velocity=self.velocity)
        return state_from_angles(
            slant_range=self.slant_range or 0.0,
            azimuth=self.azimuth or 0.0,
            elevation=self.elevation or 0.0,
            speed=self.speed or 0.0,
            motion_azimuth=self.motion_azimuth or 0.0,
            climb=self.climb or 0.0,
        )


class Platforms(Section):
    """The two of them."""

    transmitter: Platform
    receiver: Platform


class TimingError(Section):
    """Clock error between the platforms, t̃(τ) = t̃₀ + t̃₁τ + t̃₂τ² + t̃₃τ³."""

    constant: f.ClockConstant | None = None
    linear: f.ClockLinear | None = None
    quadratic: f.ClockQuadratic | None = None
    cubic: f.ClockCubic | None = None


class OtherError(Section):
    """A quadratic phase error from elsewhere, at the aperture edge."""

    name: f.Text
    quadratic_phase_error: f.Phase
    source: f.Text | None = None


class Requirements(Section):
    """What the image has to hold."""

    quadratic_phase_error: f.PhaseRequirement = Field(
        math.pi / 4, description="Total for any one error, at the aperture edge; default π/4."
    )
    cubic_phase_error: f.PhaseRequirement | None = Field(None, description="At the aperture edge.")
    pslr: f.SidelobeRequirement | None = Field(None, description="Bounds the echoes that vibration adds. [dB]")
    islr: f.SidelobeRequirement | None = Field(None, description="Bounds the power that vibration adds. [dB]")
    location_error: f.Requirement | None = Field(None, description="Displacement of the image on the ground.")


class Shares(Section):
    """Parts of one budget; they sum to 1."""

    transmitter: f.Share
    receiver: f.Share
    clock: f.Share | None = Field(None, description="Omitted: the clock is held to the receiver's share.")
    reserve: f.Reserve = 0.0

    @model_validator(mode="after")
    def _sum_to_one(self) -> "Shares":
        total = self.transmitter + self.receiver + (self.clock or 0.0) + self.reserve
        if abs(total - 1) > 1e-6:
            raise InvalidValueError(Problem(problem=f"shares must sum to 1, these sum to {total:.6g}"))
        return self


def _split_form(value: object) -> str:
    if not isinstance(value, dict):
        return "<rule>"
    return "<metrics>" if not value.keys().isdisjoint(MetricSplits.model_fields) else "<shares>"


Rule = Annotated[Literal["equal", "balanced"], _choice("equal", "balanced"), Tag("<rule>")]
Split = Annotated[Rule | Annotated[Shares, Tag("<shares>")], Discriminator(_split_form)]


class MetricSplits(Section):
    """A split of its own for each metric."""

    quadratic_phase_error: Split = "equal"
    pslr: Split = "equal"
    islr: Split = "equal"


AnySplit = Annotated[
    Rule | Annotated[Shares, Tag("<shares>")] | Annotated[MetricSplits, Tag("<metrics>")],
    Discriminator(_split_form),
]


def _available_model(value: object) -> object:
    if value in ("full", "strictest"):
        raise InvalidValueError(
            Problem(
                problem=f"is not supported by this version of bisar-budget: {FULL_MODEL}",
                accepted="accepted: published",
            )
        )
    return value


class Allocation(Section):
    """How the budget is divided and which model gates."""

    split: AnySplit = Field("equal", description="equal, balanced, shares that sum to 1, or one of these per metric.")
    combine: Annotated[Literal["each", "sum", "rss"], _choice("each", "sum", "rss")] = Field(
        "each", description="each: every error alone; sum: worst case; rss: independent errors."
    )
    model: Annotated[Literal["published"], _choice("published"), BeforeValidator(_available_model)] = "published"
    coverage_factor: f.Factor = Field(
        1.0, description="Multiplies position, velocity, acceleration and clock errors."
    )
    warn_above: f.Fraction = Field(0.8, description="Utilization above which a pass becomes a warning.")


class Autofocus(Section):
    """What autofocus can correct."""

    algorithm: Annotated[Literal["pga", "map_drift"], _choice("pga", "map_drift")] = "pga"
    n_pull: f.PullIn | None = Field(None, description="Corrects n_pull·π radians; omitted: none.")


class Simulation(Section):
    """Settings of the simulator."""

    window: Annotated[Literal["uniform", "taylor"], _choice("uniform", "taylor")] = "uniform"
    noise: f.Level | None = None
    seed: f.Seed = 1
    memory_limit: f.Memory = 500e6


class Waiver(Section):
    """A row that may fail until a date, for a reason."""

    id: f.Text = Field(description="A row id or a glob of ids, such as receiver.*")
    until: f.Date = Field(description="Last day on which it holds, UTC.")
    reason: f.Text


class Mission(Section):
    """A mission file that can be used."""

    schema_version: f.SchemaVersion
    name: f.Text
    radar: Radar
    collection: Collection
    scene: Scene = Scene()
    platforms: Platforms
    common_motion_error: Annotated[Any, f.Later(FULL_MODEL)] = None
    timing_error: TimingError = TimingError()
    other_errors: tuple[OtherError, ...] = Field((), max_length=1000)
    requirements: Requirements = Requirements()
    requirement_ids: dict[str, f.Text] = Field({}, description="Row id to the project's own requirement id.")
    allocation: Allocation = Allocation()
    autofocus: Autofocus = Autofocus()
    simulation: Simulation = Simulation()
    waivers: tuple[Waiver, ...] = Field((), max_length=1000)

    _file: str = PrivateAttr("")
    _lines: dict[KeyPath, int] = PrivateAttr(default_factory=dict)

    @model_validator(mode="after")
    def _forms_an_image(self) -> "Mission":
        if not any(any(p.velocity) for p in (self.geometry.transmitter, self.geometry.receiver)):
            raise InvalidValueError(Problem(problem="both platforms are still: no aperture", at=("platforms",)))
        degeneracy = self.geometry.degeneracy()
        if degeneracy:
            raise InvalidValueError(Problem(problem=degeneracy, at=("platforms",)))
        return self

    @model_validator(mode="after")
    def _stays_above_ground(self) -> "Mission":
        half = self.collection.aperture_time / 2
        problems = []
        for name in ("transmitter", "receiver"):
            platform: Platform = getattr(self.platforms, name)
            lowest = platform.state.position[2] - abs(platform.state.velocity[2]) * half
            if lowest < 0:
                key: KeyPath = ("climb",) if platform.velocity is None else ("velocity", 2)
                problems.append(
                    Problem(
                        problem=f"takes the platform below the ground within the aperture, to z = {lowest:.4g} m",
                        at=("platforms", name, *key),
                    )
                )
        if problems:
            raise InvalidValueError(*problems)
        return self

    @model_validator(mode="after")
    def _names_are_unique(self) -> "Mission":
        seen: set[str] = set()
        for index, other in enumerate(self.other_errors):
            if other.name in seen:
                raise InvalidValueError(
                    Problem(problem="is the name of an earlier error", at=("other_errors", index, "name"))
                )
            seen.add(other.name)
        return self

    @cached_property
    def geometry(self) -> BistaticGeometry:
        """Both platforms in the frame of the scene."""
        return BistaticGeometry(transmitter=self.platforms.transmitter.state, receiver=self.platforms.receiver.state)

    @property
    def file(self) -> str:
        """Name of the file as the user gave it."""
        return self._file

    def line(self, *path: str | int) -> int | None:
        """Line of a value in the mission file, else of the nearest key above it that exists."""
        for length in range(len(path), 0, -1):
            line = self._lines.get(path[:length])
            if line is not None:
                return line
        return None
