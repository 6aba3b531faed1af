"""Field types of the mission model: quantities, vectors, text, dates, and keys whose feature is still to come."""

import math
import re
from dataclasses import dataclass
from datetime import date
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BeforeValidator,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    WithJsonSchema,
)
from pydantic_core import CoreSchema, core_schema

from bisar_budget.errors import InvalidValueError, Problem
from bisar_budget.units import (
    ACCELERATION,
    ANGLE,
    FREQUENCY,
    LENGTH,
    MEMORY,
    POWER_RATIO,
    RATE,
    RATE_SQUARED,
    RATIO,
    SPEED,
    TIME,
    Dimension,
    format_quantity,
    parse_quantity,
)

_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufeff\u202a-\u202e\u2066-\u2069]")
_MAX_TEXT = 500  # characters


@dataclass(frozen=True, kw_only=True, eq=False)
class Quantity:
    """A number with a unit, within bounds; in the model it is a float in SI (decibels stay decibels).

    The far bounds keep every later square and quotient finite; nothing real comes near them.
    """

    dimension: Dimension
    gt: float = -math.inf
    ge: float = -math.inf
    lt: float = math.inf
    le: float = math.inf

    def read(self, value: object) -> float:
        """Parse and hold to the bounds; raises `InvalidValueError`."""
        number = parse_quantity(value, self.dimension)
        for holds, words, bound in (
            (number > self.gt, "greater than", self.gt),
            (number >= self.ge, "at least", self.ge),
            (number < self.lt, "less than", self.lt),
            (number <= self.le, "at most", self.le),
        ):
            if not holds:
                limit = format_quantity(bound, self.dimension.si)
                raise InvalidValueError(Problem(problem=f"must be {words} {limit}"))
        return number

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Hand `read` to pydantic."""
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Text with a unit, or a bare number."""
        return {"type": ["string", "number"]}


_COORDINATE = Quantity(dimension=LENGTH, ge=-1e9, le=1e9)
_VELOCITY = Quantity(dimension=SPEED, ge=-1e6, le=1e6)
_ACCELERATION = Quantity(dimension=ACCELERATION, ge=-1e6, le=1e6)

Frequency = Annotated[float, Quantity(dimension=FREQUENCY, gt=0, ge=1e3, le=1e13)]
VibrationFrequency = Annotated[float, Quantity(dimension=FREQUENCY, gt=0, le=1e9)]
Duration = Annotated[float, Quantity(dimension=TIME, gt=0, ge=1e-6, le=1e6)]
Coordinate = Annotated[float, _COORDINATE]
Range = Annotated[float, Quantity(dimension=LENGTH, gt=0, le=1e9)]
Size = Annotated[float, Quantity(dimension=LENGTH, ge=0, le=1e9)]
Requirement = Annotated[float, Quantity(dimension=LENGTH, gt=0, ge=1e-9, le=1e9)]
Velocity = Annotated[float, _VELOCITY]
Speed = Annotated[float, Quantity(dimension=SPEED, ge=0, le=1e6)]
Acceleration = Annotated[float, _ACCELERATION]
Direction = Annotated[float, Quantity(dimension=ANGLE, ge=-1e3, le=1e3)]
Elevation = Annotated[float, Quantity(dimension=ANGLE, ge=0, le=math.pi / 2)]
Phase = Annotated[float, Quantity(dimension=ANGLE, ge=-1e6, le=1e6)]
PhaseRequirement = Annotated[float, Quantity(dimension=ANGLE, gt=0, ge=1e-6, le=1e6)]
SidelobeRequirement = Annotated[float, Quantity(dimension=POWER_RATIO, lt=0, ge=-200)]
Level = Annotated[float, Quantity(dimension=POWER_RATIO, ge=-400, le=400)]
ClockConstant = Annotated[float, Quantity(dimension=TIME, ge=-1e6, le=1e6)]
ClockLinear = Annotated[float, Quantity(dimension=RATIO, ge=-1e6, le=1e6)]
ClockQuadratic = Annotated[float, Quantity(dimension=RATE, ge=-1e6, le=1e6)]
ClockCubic = Annotated[float, Quantity(dimension=RATE_SQUARED, ge=-1e6, le=1e6)]
Share = Annotated[float, Quantity(dimension=RATIO, gt=0, ge=1e-6, le=1)]
Reserve = Annotated[float, Quantity(dimension=RATIO, ge=0, lt=1)]
Factor = Annotated[float, Quantity(dimension=RATIO, gt=0, ge=1e-3, le=1e3)]
Fraction = Annotated[float, Quantity(dimension=RATIO, gt=0, le=1)]
PullIn = Annotated[float, Quantity(dimension=RATIO, gt=0, ge=1e-3, le=1e4)]
Memory = Annotated[float, Quantity(dimension=MEMORY, gt=0, ge=1e6, le=1e15)]


def _three(value: object) -> list[Any] | tuple[Any, ...]:
    if isinstance(value, list | tuple) and len(value) == 3:
        return value
    count = f", {len(value)} given" if isinstance(value, list | tuple) else ""
    raise InvalidValueError(Problem(problem=f"must be three components{count}", accepted="accepted: [a, b, c]"))


def _each(quantity: Quantity) -> BeforeValidator:
    def spread(value: object) -> object:
        if isinstance(value, list | tuple):
            return _three(value)
        return (quantity.read(value),) * 3  # a scalar means each axis

    return BeforeValidator(spread)


_TRIPLE_SCHEMA = {"type": "array", "items": {"type": ["string", "number"]}, "minItems": 3, "maxItems": 3}
_TRIPLE = WithJsonSchema(_TRIPLE_SCHEMA)
_ONE_OR_TRIPLE = WithJsonSchema({"anyOf": [{"type": ["string", "number"]}, _TRIPLE_SCHEMA]})

Vector = tuple[float, float, float]
PositionVector = Annotated[tuple[Coordinate, Coordinate, Coordinate], BeforeValidator(_three), _TRIPLE]
VelocityVector = Annotated[tuple[Velocity, Velocity, Velocity], BeforeValidator(_three), _TRIPLE]
PositionError = Annotated[tuple[Coordinate, Coordinate, Coordinate], _each(_COORDINATE), _ONE_OR_TRIPLE]
VelocityError = Annotated[tuple[Velocity, Velocity, Velocity], _each(_VELOCITY), _ONE_OR_TRIPLE]
AccelerationError = Annotated[tuple[Acceleration, Acceleration, Acceleration], _each(_ACCELERATION), _ONE_OR_TRIPLE]


def _printable(text: str) -> str:
    if not text.strip():
        raise InvalidValueError(Problem(problem="must not be empty"))
    if len(text) > _MAX_TEXT:
        raise InvalidValueError(Problem(problem=f"must be at most {_MAX_TEXT} characters, has {len(text)}"))
    if _CONTROL.search(text):
        raise InvalidValueError(Problem(problem="must be one line of printable text, without control characters"))
    return text


Text = Annotated[str, AfterValidator(_printable), WithJsonSchema({"type": "string", "minLength": 1})]


def _whole(low: int, high: int) -> BeforeValidator:
    def read(value: object) -> int:
        if isinstance(value, str) and re.fullmatch(r"0|-?[1-9]\d{0,17}", value.strip()):
            value = int(value)
        if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            raise InvalidValueError(Problem(problem=f"must be a whole number from {low} to {high}"))
        return value

    return BeforeValidator(read)


PulseCount = Annotated[int, _whole(2, 10_000_000), WithJsonSchema({"type": "integer", "minimum": 2})]
Seed = Annotated[int, _whole(0, 2**53), WithJsonSchema({"type": "integer", "minimum": 0})]


def _version(value: object) -> int:
    if value not in ("1", 1) or isinstance(value, bool):
        raise InvalidValueError(Problem(problem="is not a schema version this tool reads", accepted="accepted: 1"))
    return 1


SchemaVersion = Annotated[int, BeforeValidator(_version), WithJsonSchema({"const": 1})]


def _date(value: object) -> date:
    if isinstance(value, date):
        return value
    try:
        if not isinstance(value, str) or len(value) != len("2027-03-31"):
            raise ValueError
        return date.fromisoformat(value)
    except ValueError:
        raise InvalidValueError(
            Problem(problem="must be a calendar date", accepted="accepted: 2027-03-31 and the like")
        ) from None


Date = Annotated[date, BeforeValidator(_date), WithJsonSchema({"type": "string", "format": "date"})]


@dataclass(frozen=True)
class Later:
    """Marks a key that the schema knows and this version cannot honour: an error, never silence."""

    feature: str

    def read(self, value: object) -> object:
        """Refuse any value."""
        raise InvalidValueError(
            Problem(
                problem=f"is not supported by this version of bisar-budget: {self.feature}",
                hint="Remove it: no result takes it into account",
            )
        )

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Hand `read` to pydantic."""
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Nothing is accepted."""
        return {"not": {}, "description": f"Not supported yet: {self.feature}"}
