"""Quantities as text: read `9.6 GHz` as a number in SI units, and write an SI number as `9.60 GHz`.

The module has its own small table of units, because general unit libraries read `3 dBi` as three amperes.
"""

import math
import re
from functools import cache, lru_cache

from bisar_budget.constants import STANDARD_GRAVITY_MPS2
from bisar_budget.faults import InvalidValueError

_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
# The form of nearly every quantity; `_parse_closely` reads the remaining forms.
_plain_quantity = re.compile(
    r"([+-]?(?:0|[1-9]\d{0,20})(?:\.\d{0,20})?(?:[eE][+-]?\d{1,3})?) ?([^\s\d]\S{0,20})?", re.ASCII
).fullmatch
_MAX_QUANTITY_CHARACTERS = 64  # longer text is not a quantity
UNCERTAINTY_MARKS = ("±", "+/-")  # between a figure and its standard uncertainty; see `mission.uncertain`
DB_PER_NEPER = 20 / math.log(10)  # level of an amplitude ratio of e


class Dimension:
    """Kind of quantity: its name with an article, the unit of a plain number, and all accepted units.

    `scales` maps each accepted unit to a factor and a divisor, one of which is 1. Division by a whole number keeps
    decimals exact: 5 mm is exactly the same number as 0.005 m. If every number needs a unit, `usual` names the usual
    units; it is empty if a number without a unit is taken as SI. `offsets` maps additional decibel units to the
    number of decibels that must be added to convert a value from this unit.
    """

    def __init__(
        self,
        name: str,
        si: str,
        units: dict[str, float],
        usual: tuple[str, ...] = (),
        offsets: dict[str, float] | None = None,
    ) -> None:
        self.name, self.si, self.units, self.usual = name, si, units, usual
        self.offsets = offsets or {}
        self.scales = {unit: _scale(factor) for unit, factor in units.items()} | ({} if usual else {"": (1.0, 1.0)})

    @property
    def unit_names(self) -> tuple[str, ...]:
        """Accepted units, as listed in messages and documents."""
        return (*filter(None, self.units), *self.offsets)

    @property
    def accepted(self) -> str:
        """Text that lists the accepted units."""
        units = ", ".join(self.unit_names)
        if self.usual:
            return f"accepted: {self.name} in {units}; only zero needs no unit"
        return f"accepted: {self.name} in {units}; a bare number is {'in ' + self.si if self.si else 'a ratio'}"


def _scale(factor: float) -> tuple[float, float]:
    """Factor and divisor, one of which is 1, that together convert a unit with the given factor to SI."""
    inverse = float(round(1 / factor))
    return (1.0, inverse) if inverse and abs(inverse * factor - 1) < 1e-12 else (factor, 1.0)


def _scaled(base: str, prefixes: str, power: int = 1) -> dict[str, float]:
    factors = {
        "k": 1e3,
        "M": 1e6,
        "G": 1e9,
        "T": 1e12,
        "c": 1e-2,
        "m": 1e-3,
        "u": 1e-6,
        "n": 1e-9,
        "p": 1e-12,
    }
    return {base: 1.0} | {prefix + base: factors[prefix] ** power for prefix in prefixes}


_LENGTHS = _scaled("m", "kcmun") | {"ft": 0.3048, "nmi": 1852.0}
_G = STANDARD_GRAVITY_MPS2
_DEGREE_RAD = math.pi / 180

FREQUENCY = Dimension("a frequency", "Hz", _scaled("Hz", "kMGT"))
TIME = Dimension("a time", "s", _scaled("s", "munp") | {"min": 60.0, "h": 3600.0})
LENGTH = Dimension("a length", "m", _LENGTHS | {"NM": 1852.0})
SPEED = Dimension(
    "a speed",
    "m/s",
    {f"{unit}/s": factor for unit, factor in _LENGTHS.items()}
    | {"km/h": 1 / 3.6, "kt": 1852 / 3600, "kn": 1852 / 3600},
)
ACCELERATION = Dimension(
    "an acceleration",
    "m/s^2",
    {f"{unit}/s^2": factor for unit, factor in _LENGTHS.items()}
    | {"g": _G, "mg": 1e-3 * _G, "ug": 1e-6 * _G}
    | {"Gal": 1e-2, "mGal": 1e-5, "uGal": 1e-8},
)
JERK = Dimension("a jerk", "m/s^3", {f"{unit}/s^3": factor for unit, factor in _LENGTHS.items()})
SNAP = Dimension("a snap", "m/s^4", {f"{unit}/s^4": factor for unit, factor in _LENGTHS.items()})
# Readers think in degrees, formulas in radians: 45 without its unit is degrees in one file and radians in the next.
ANGLE = Dimension(
    "an angle",
    "rad",
    _scaled("rad", "mun")
    | {"deg": _DEGREE_RAD, "°": _DEGREE_RAD, "arcmin": _DEGREE_RAD / 60, "arcsec": _DEGREE_RAD / 3600},
    usual=("deg", "rad"),
)
RATIO = Dimension("a number", "", {"": 1.0, "%": 1e-2, "ppm": 1e-6, "ppb": 1e-9, "s/s": 1.0})
_DAY_S = 86400.0
_AGING_UNITS = {"/day": 1 / _DAY_S, "1/day": 1 / _DAY_S, "/month": 1 / (30 * _DAY_S), "/year": 1 / (365.25 * _DAY_S)}
_AGING_UNITS |= {"ppm/day": 1e-6 / _DAY_S, "ppb/day": 1e-9 / _DAY_S}
RATE = Dimension("a rate", "1/s", {"1/s": 1.0, "/s": 1.0, "s^-1": 1.0, "Hz": 1.0, "s/s^2": 1.0} | _AGING_UNITS)
# A bare 1e-10 per second would be the aging of a whole day in one second.
AGING = Dimension("an aging rate", "1/s", _AGING_UNITS | {"/s": 1.0, "1/s": 1.0}, usual=("/day",))
RATE_SQUARED = Dimension("a rate per second", "1/s^2", {"1/s^2": 1.0, "/s^2": 1.0, "s^-2": 1.0, "s/s^3": 1.0})
POWER_RATIO = Dimension("a power ratio in decibel", "dB", {"dB": 1.0})
POSITION_VARIANCE = Dimension("a position variance", "m^2", _scaled("m^2", "kcmu", 2))
POSITION_VELOCITY = Dimension("a covariance of position and velocity", "m^2/s", _scaled("m^2/s", "kcmu", 2))
VELOCITY_VARIANCE = Dimension("a velocity variance", "m^2/s^2", _scaled("m^2/s^2", "kcmu", 2))
ANGULAR_RATE = Dimension(
    "an angular rate",
    "rad/s",
    {f"{unit}/s": factor for unit, factor in _scaled("rad", "mun").items()}
    | {"deg/s": _DEGREE_RAD, "mdeg/s": 1e-3 * _DEGREE_RAD, "deg/min": _DEGREE_RAD / 60, "deg/h": _DEGREE_RAD / 3600},
    usual=("deg/h", "deg/s"),
)
_PER_ROOT_HOUR = 1 / 60  # 1/√h in 1/√s
VELOCITY_RANDOM_WALK = Dimension(
    "a velocity random walk",
    "m/s/sqrt(s)",
    {
        "m/s/sqrt(s)": 1.0,
        "m/s/sqrt(h)": _PER_ROOT_HOUR,
        "mm/s/sqrt(s)": 1e-3,
        "ft/s/sqrt(h)": 0.3048 * _PER_ROOT_HOUR,
        "m/s^2/sqrt(Hz)": 1.0,
        "ug/sqrt(Hz)": 1e-6 * _G,
        "mg/sqrt(Hz)": 1e-3 * _G,
    },
    usual=("m/s/sqrt(h)", "ug/sqrt(Hz)"),
)
ANGLE_RANDOM_WALK = Dimension(
    "an angle random walk",
    "rad/sqrt(s)",
    {
        "rad/sqrt(s)": 1.0,
        "deg/sqrt(h)": _DEGREE_RAD * _PER_ROOT_HOUR,
        "deg/sqrt(s)": _DEGREE_RAD,
        "rad/s/sqrt(Hz)": 1.0,
        "deg/s/sqrt(Hz)": _DEGREE_RAD,
        "mdeg/s/sqrt(Hz)": 1e-3 * _DEGREE_RAD,
        "deg/h/sqrt(Hz)": _DEGREE_RAD / 3600,
    },
    usual=("deg/sqrt(h)", "rad/sqrt(s)"),
)
ELECTRON_CONTENT = Dimension(
    "an electron content",
    "1/m^2",
    {"TECU": 1e16, "1/m^2": 1.0, "/m^2": 1.0, "m^-2": 1.0},
    usual=("TECU",),
)
# L(f) is half of the one-sided density of phase, by IEEE Std 1139.
PHASE_NOISE = Dimension(
    "a phase noise L(f)",
    "dBc/Hz",
    {"dBc/Hz": 1.0},
    usual=("dBc/Hz",),
    offsets={"dBrad^2/Hz": -10 * math.log10(2)},
)
_G_DENSITIES = {"g^2/Hz": _G**2, "mg^2/Hz": (1e-3 * _G) ** 2, "ug^2/Hz": (1e-6 * _G) ** 2}
ACCELERATION_DENSITY = Dimension(
    "a spectral density of acceleration",
    "(m/s^2)^2/Hz",
    {**_G_DENSITIES, "(m/s^2)^2/Hz": 1.0, "m^2/s^4/Hz": 1.0, "m^2/s^3": 1.0},
    usual=("g^2/Hz", "(m/s^2)^2/Hz"),
)
DISPLACEMENT_DENSITY = Dimension(
    "a spectral density of displacement",
    "m^2/Hz",
    _scaled("m^2/Hz", "cmun", 2),
    usual=("m^2/Hz", "mm^2/Hz"),
)
ACCELERATION_SENSITIVITY = Dimension(
    "an acceleration sensitivity",
    "s^2/m",
    {
        "/g": 1 / _G,
        "1/g": 1 / _G,
        "ppm/g": 1e-6 / _G,
        "ppb/g": 1e-9 / _G,
        "s^2/m": 1.0,
        "/(m/s^2)": 1.0,
        "1/(m/s^2)": 1.0,
    },
    usual=("/g",),
)
TONE = Dimension("the level of a tone", "dBc", {"dBc": 1.0}, usual=("dBc",))
LEVELS = (POWER_RATIO, PHASE_NOISE, TONE)  # in decibel
MEMORY = Dimension("an amount of memory", "B", _scaled("B", "kMGT") | {"KB": 1e3, "MiB": 2.0**20, "GiB": 2.0**30})

DIMENSIONS = tuple(found for found in globals().values() if isinstance(found, Dimension))

# Spellings of data sheets, replaced in this order by the spellings of the unit tables: °/√hr is deg/sqrt(h).
_SPELLINGS = (
    ("[µμ]", "u"),  # the micro sign and the Greek letter
    ("[º˚]", "°"),  # the ordinal sign and the ring, written in place of the degree sign
    (r"\*\*", "^"),
    (r"\s*([/^])\s*", r"\1"),
    ("²", "^2"),
    ("³", "^3"),
    ("⁴", "^4"),
    ("s([23])", r"s^\1"),
    ("rad2", "rad^2"),
    (r"^dB\s*(?:re\s*1?\s*)?[(\[]?rad\^2/Hz[)\]]?$", "dBrad^2/Hz"),
    (r"\b(?:micro-?|u-)g\b", "ug"),
    (r"\bmilli-?g\b", "mg"),
    (r"^\(([^()]*)\)/", r"\1/"),  # (deg/h)/√Hz
    ("^(m?)°/", r"\1deg/"),
    (r"^(m?)dps\b(?!\^)", r"\1deg/s"),
    (r"^dph\b(?!\^)", "deg/h"),
    (r"\bhr\b", "h"),
    (r"(?:√|\b(?:sqrt|root|rt))[\s-]*\(?(s|h|hr|Hz)\b\)?", r"sqrt(\1)"),
    (r"/(s|h|Hz)\^(?:0?\.5|\(?1/2\)?|½)$", r"/sqrt(\1)"),
    (r"\(hr\)", "(h)"),
)
# Decibel units: in place of a different decibel unit, each can only mean the unit of the dimension.
_DECIBELS = ("dB", "dBc")

# Keys are the units of rows; a clock's linear term is a ratio of times, a scale factor a ratio of accelerations.
_OF_SI = {dimension.si: dimension for dimension in reversed(DIMENSIONS) if dimension.si} | {"s/s": RATIO, "1": RATIO}


def parse_quantity(value: object, dimension: Dimension) -> float:
    """Read a quantity such as `31 km`, `9.6GHz`, `2 µrad` or `1e-12`.

    A number without a unit is in SI units, or in decibels if the dimension is measured in decibels. An angle without
    a unit is rejected unless it is zero.

    Parameters
    ----------
    value : str, int or float
        Value as given in the mission file.
    dimension : Dimension
        Required dimension of the value.

    Returns
    -------
    float
        Finite number in SI units; decibels remain decibels.

    Raises
    ------
    InvalidValueError
        The value is not a finite number, its unit is unknown or of another dimension, or a required unit is missing.
    """
    plain = _plain_quantity(value) if type(value) is str else None
    if plain is not None:
        digits, unit = plain.groups("")
        scale = dimension.scales.get(unit)
        if scale is not None:
            number = float(digits) * scale[0] / scale[1]
            if -math.inf < number < math.inf:
                return number
    return _parse_closely(value, dimension)


def _parse_closely(value: object, dimension: Dimension) -> float:
    """Read a quantity in any accepted form. If it cannot be read, an error that explains the reason is raised."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise _invalid(f"must be {dimension.name}", dimension)
    if not isinstance(value, str):
        return _bare(_finite(float(value), dimension), str(value), dimension)
    text = value.strip()
    match = _NUMBER.match(text) if len(text) <= _MAX_QUANTITY_CHARACTERS else None
    if match is None:
        is_nan_or_inf = text.lower().lstrip("+-.") in ("nan", "inf", "infinity")
        raise _invalid("must be a finite number" if is_nan_or_inf else f"must be {dimension.name}", dimension)
    digits = match[0].lstrip("+-")
    if digits[0] == "0" and digits[1:2].isdigit():
        raise InvalidValueError(
            "has a leading zero, which some YAML readers take for octal", "write it without the zero"
        )
    number, unit = float(match[0]), text[match.end() :].lstrip()
    scale = dimension.scales.get(unit)
    if not unit:
        return _bare(_finite(number, dimension), text, dimension)
    if scale is None:
        scale = dimension.scales.get(normal_unit(unit))
    if scale is None and (offset := dimension.offsets.get(normal_unit(unit))) is not None:
        return _finite(number + offset, dimension)
    if scale is None:
        raise _wrong_unit(match[0], unit, dimension)
    return _finite(number * scale[0] / scale[1], dimension)


def format_quantity(value: float, unit: str, digits: int = 3, rounding: str = "nearest") -> str:
    """Write an SI value with a readable prefix: 0.005 m/s^2 becomes `5 mm/s²`.

    `rounding` is `nearest` or `down`. Limits are rounded down, so that the printed value is within the limit.
    """
    size, suffix = abs(value), ""
    for scale, smallest, largest, its_suffix in _steps(unit):
        suffix = its_suffix
        if smallest <= size < largest:
            value /= scale
            break
    text = "%.*g" % (digits, value)  # noqa: UP031 -- a table has thirty numbers, and format() takes twice as long
    if unit == "dB" and rounding == "down" and value < 0:  # a lower level is stricter
        return _stricter(value, digits) + suffix
    if "e" in text or (rounding == "down" and abs(float(text)) > abs(value)):
        text = _rounded(value, digits, rounding)
    return text + suffix


def unit_behind(text: str) -> str:
    """Return the unit after the number in a string, as written; the whole string if it contains no number."""
    text = text.strip()
    match = _NUMBER.match(text)
    return text[match.end() :].strip() if match else text


def given_unit(text: str, unit: str) -> str:
    """Return the unit that follows the number in a string, spelt as in the tables of units.

    `unit` is an SI unit. The result is empty if the string contains no unit, or if it is not a quantity of the same
    dimension as `unit`.
    """
    match = _NUMBER.match(text.strip()) if len(text) <= _MAX_QUANTITY_CHARACTERS else None
    dimension = _OF_SI.get(unit)
    if match is None or dimension is None:
        return ""
    stated_unit = text.strip()[match.end() :].lstrip()
    stated_unit = stated_unit if stated_unit in dimension.scales else normal_unit(stated_unit)
    return stated_unit if stated_unit in dimension.scales else ""


def format_in(value: float, unit: str, written_unit: str, digits: int = 3, rounding: str = "nearest") -> str:
    """Write an SI value in `written_unit`, a unit of the same dimension as `unit`: 349 µrad becomes `0.02 deg`.

    If `written_unit` is empty, or if the value is a level in dB, the text is the result of `format_quantity`. Numbers
    of at least 1e6 or below 1e-4 are written with an exponent, such as `2e6`.
    """
    if not written_unit or unit == "dB" or not math.isfinite(value):
        return format_quantity(value, unit, digits, rounding)
    factor, divisor = _OF_SI[unit].scales[written_unit]
    number = value * divisor / factor
    text = _rounded(number, digits, rounding) if number else "0"
    mantissa, _, power = text.partition("e")
    text = f"{mantissa}e{int(power)}" if power else text
    return text + _pretty(written_unit)


@cache
def _pretty(written_unit: str) -> str:
    """Write a unit of the tables for display: `um` as µm, `m/s^2` as m/s², `deg/sqrt(h)` as deg/√h, `1/s` as /s."""
    text = written_unit.replace("^2", "²").replace("^3", "³").replace("^4", "⁴").replace("°", "deg")
    text = re.sub(r"sqrt\((\w+)\)", r"√\1", text)
    text = re.sub(r"^u(?=m|g|s|rad|Gal)", "µ", text)
    return text.removeprefix("1") if text.startswith(("1/", "/")) else f" {text}"


def format_limit(limit: float, unit: str) -> str:
    """Write a limit, rounded down. Radians are written without a prefix, so that readers recognise π/4."""
    return f"{_rounded(limit, 3, 'down')} rad" if unit == "rad" else format_quantity(limit, unit, 3, "down")


_SMALL = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
# Kilometres per second squared and megametres are not in use.
_PREFIX_SCALES = {
    "Hz": ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, "")),
    "m": ((1e3, "k"), *_SMALL),
    "s": _SMALL,
    "rad": _SMALL,
    "m/s": _SMALL,
    "m/s^2": _SMALL,
}
# Units of data sheets: factor to SI, and the text after the number.
_SHEETS = {
    "rad/s": (_DEGREE_RAD / 3600, " deg/h"),
    "m/s/sqrt(s)": (_PER_ROOT_HOUR, " m/s/√h"),
    "rad/sqrt(s)": (_DEGREE_RAD * _PER_ROOT_HOUR, " deg/√h"),
    "s^2/m": (1 / _G, " /g"),
    "(m/s^2)^2/Hz": (_G**2, " g²/Hz"),
    "1": (1e-6, " ppm"),
    "1/m^2": (1e16, " TECU"),
}


@cache
def _steps(unit: str) -> tuple[tuple[float, float, float, str], ...]:
    """List the forms in which a unit can be printed: with each usual prefix, and finally without a prefix.

    A form has four entries: the factor that converts to SI, the smallest SI value for which the form is used, the SI
    value from which the form is no longer used, and the text after the number.
    """
    if unit in _SHEETS:
        scale, suffix = _SHEETS[unit]
        return ((scale, 0.0, math.inf, suffix),)
    suffix = _pretty(unit).rstrip()
    steps = (
        (scale, scale * 0.9995, scale * 1e6, f" {prefix}{suffix[1:]}")
        for scale, prefix in _PREFIX_SCALES.get(unit, ())
    )
    return (*steps, (1.0, 0.0, math.inf, suffix))


def _stricter(level: float, digits: int) -> str:
    """Write a negative level in dB, rounded down to a lower level, which is a stricter limit."""
    step = 10.0 ** (math.floor(math.log10(-level)) - digits + 1)
    return f"{math.floor(level / step * (1 - 1e-12)) * step:.{digits}g}"


def _rounded(value: float, digits: int, rounding: str) -> str:
    text = f"{value:.{digits}g}"
    if rounding == "down" and ("e" in text or abs(float(text)) > abs(value)):
        exponent = math.floor(math.log10(abs(value)))
        step = digits - 1 - exponent
        # One part in 10¹² keeps an exact 0.3 from becoming 0.299.
        mantissa = math.floor(abs(value) * 10.0 ** (step) * (1 + 1e-12))
        value = math.copysign(mantissa / 10.0**step if step <= 300 else abs(value), value)
        text = f"{value:.{digits}g}"
    return f"{value:.0f}" if "e+0" in text and abs(value) < 1e6 else text


def _bare(number: float, text: str, dimension: Dimension) -> float:
    if number and dimension.usual:
        choices = " or ".join(f"'{text} {unit}'" for unit in dimension.usual)
        raise _invalid("has no unit", dimension, f"Did you mean {choices}?")
    return number


def _finite(number: float, dimension: Dimension) -> float:
    if not math.isfinite(number):
        raise _invalid("must be a finite number", dimension)
    return number


@lru_cache(256)
def normal_unit(unit: str) -> str:
    """Spell a unit as in the tables of units: `µrad` as `urad`, `m/s²` as `m/s^2`, `°/√hr` as `deg/sqrt(h)`."""
    unit = unit.strip()
    for pattern, meant in _SPELLINGS:
        unit = re.sub(pattern, meant, unit)
    return unit


def _invalid(problem: str, dimension: Dimension, hint: str = "") -> InvalidValueError:
    return InvalidValueError(problem, dimension.accepted, hint)


def _wrong_unit(digits: str, written: str, dimension: Dimension) -> InvalidValueError:
    """Error for a unit that is unknown or of another dimension; its message suggests the intended unit."""
    unit = normal_unit(written)
    if any(mark in written for mark in UNCERTAINTY_MARKS):
        hint = "Only the sizes of errors in a mission file have one"
        return InvalidValueError("has an uncertainty", "accepted: the figure alone", hint)
    if unit.startswith(","):
        return _invalid("has a decimal comma", dimension, "Write a point")
    matches = [match for match in DIMENSIONS if unit in match.units]
    if matches:
        meant = dimension.si if unit in _DECIBELS and dimension.si.startswith("dB") else ""
        problem = f"must be {dimension.name}, but {written!r} makes it {matches[0].name}"
        return _invalid(problem, dimension, f"Did you mean {meant!r}?" if meant else "")
    from bisar_budget.other_units import about_unit

    problem, hint = about_unit(digits, written, dimension)
    return _invalid(problem, dimension, hint)
