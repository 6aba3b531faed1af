"""Names of the columns in a log that state the accuracy of its positions.

Programs use many names for such columns: `sigma_east`, `sde`, `SD-E`, `lat std dev`, `hAcc`, `cov_ee`. A column whose
name looks like an accuracy is read if the name states an axis or direction of the position. It is ignored if the name
states another quantity, such as a velocity. Any other column that looks like an accuracy is refused: if it were
ignored, the error that the log declares could be too small.
"""

import re
from collections.abc import Sequence
from itertools import pairwise

from bisar_budget import units
from bisar_budget.faults import InvalidValueError

UNCLEAR = "unclear"  # meaning of a column that looks like an accuracy of an unknown kind
ACCEPTED_ACCURACIES = (
    "accepted: one sigma as sigma_east, sigma_north, sigma_up [m], or sigma_x, sigma_y, sigma_z [m], or cov_ee, "
    "cov_nn, cov_uu [m^2], or horizontal accuracy, vertical accuracy [m], or position accuracy [m]"
)
CROSS_COVARIANCE = "covariance"  # between two axes; it is not needed, because the sigmas of the axes are used

_AXIS_WORDS = {
    "east": ("e", "east", "easting", "lon", "long", "lng", "longitude"),
    "north": ("n", "north", "northing", "lat", "latitude"),
    "up": ("u", "up", "d", "down", "alt", "altitude", "height", "hgt", "elevation", "ele"),
    "x": ("x",),
    "y": ("y",),
    "z": ("z",),
}
_AXIS_OF = {name: axis for axis, names in _AXIS_WORDS.items() for name in names}
_HORIZONTAL = frozenset(("horizontal", "horiz", "hor", "2d", "planimetric", "level"))
_VERTICAL = frozenset(("vertical", "vert", "ver", "v"))
_SIGMA_WORDS = frozenset(("sigma", "sd", "std", "stdev", "accuracy", "uncertainty", "rms", "rmse"))
_VARIANCES = frozenset(("cov", "covariance", "var", "variance"))
_WEAK = frozenset(("rms", "rmse", "sd"))  # also common in names of other things: residuals, noise, an SD card
_ERROR_WORDS = frozenset(
    ("error", "err", "precision", "confidence")
)  # may mean the error of a position, but of unknown probability
_PLACE = frozenset(("position", "pos", "positional", "location"))
_POSITION_WORDS = _PLACE | {"3d", "spherical", "p"}
_FILLING = frozenset(
    (
        "gps",
        "gnss",
        "ins",
        "estimated",
        "estimate",
        "est",
        "one",
        "1",
        "of",
        "in",
        "the",
        "fix",
        "ellipsoidal",
        "geodetic",
        "msl",
    )
)
# Radii that contain some fraction of the errors; the fraction may depend on the maker of the receiver.
_UNCLEAR_MEASURES = re.compile(
    r"(?:[23]?drms|2?d?cep\d*|sep\d*|mrse|r\d\d|epe|ehpe|evpe|ehe|epx|epy|hpe|vpe|[ce]e\d\d|le\d\d)"
)
_LOOKS_LIKE = re.compile(r"sigma|accura|uncertain|covar|varianc|stdev|(?:^|_)(?:std|sd)(?:_|$)")
_OTHERS = re.compile(  # other quantities that have an accuracy
    r"velocity|vel|speed|spd|airspeed|groundspeed|heading|head|hdg|yaw|roll|pitch|course|cog|"
    r"bearing|attitude|att|azimuth|orientation|quaternion|tilt|angle|angular|time|clock|gyro|"
    r"accel|acceleration|accelerometer|mag|magnetic|magnetometer|compass|baro|barometer|pressure|"
    r"temp|temperature|wind|range|pseudorange|doppler|phase|snr|cn0|signal|noise|dop|bias|"
    r"rate|imu|terrain|ground|distance|dist|lidar|radar|camera|image|gimbal|battery|voltage|"
    r"current|climb|age|ambiguity|ratio|residual|residuals|geoid|undulation"
)
_VELOCITY_PATTERN = re.compile(r"v[enuxyzdh]")
_TAILS = {
    ("m", "s"): "m/s",
    ("mps",): "m/s",
    ("m",): "m",
    ("mm",): "mm",
    ("cm",): "cm",
    ("meters",): "m",
    ("metres",): "m",
    ("m2",): "m^2",
    ("deg",): "deg",
    ("rad",): "rad",
}
_OF_POSITIONS = (units.LENGTH, units.POSITION_VARIANCE)
_OTHER = "other"  # meaning of a column that is the accuracy of another quantity than a position
_CAMELS = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
_COLUMN_SPELLINGS = (
    (re.compile(r"[^a-z0-9σ]+"), "_"),
    (re.compile(r"standard_?dev(?:iations?)?|std_?dev(?:iations?)?|st_?dev|σ"), "_sigma_"),
    (re.compile(r"(?:1|one)_?sigma"), "_sigma_"),
    (re.compile(r"sigma|accuracy|uncertainty|covariance|variance"), r"_\g<0>_"),
    (
        re.compile(r"(?:^|_)(h|v|p|pos|position|horiz|hor|horizontal|vert|vertical|2d|3d)_?acc(?=_|$)"),
        r"_\1_accuracy",
    ),
    (re.compile(r"(?:^|_)(h|v)_?rms(?=_|$)"), r"_\1_accuracy"),
    (re.compile(r"(?:^|_)(sd|std|rms)(v?[enudxyzh]|v|lat|lon|alt|[enu]{2}|[xyz]{2})(?=_|$)"), r"_\1_\2"),
    (re.compile(r"(?:^|_)(lat|lon|alt|east|north|up|height)(sd|std|rms)(?=_|$)"), r"_\1_\2"),
    (re.compile(r"(?:^|_)ep([hv])(?=_|$)"), r"_ep_\1_accuracy"),
    (re.compile(r"_+"), "_"),
)


def meaning_of(name: str, unit: str | None) -> tuple[str | None, str | None]:
    """Find out from the name and unit of a column which accuracy it states; return the standard name and unit.

    Standard names are `sigma_east` and `variance_east`, the corresponding names for other axes,
    `horizontal_accuracy`, `vertical_accuracy`, and `position_accuracy` for an accuracy without a direction. The name
    is `sigma_h` if h may mean height or horizontal, which is decided later from the other columns. It is
    `CROSS_COVARIANCE` for a covariance of two axes, `UNCLEAR` for an unknown accuracy, and None for a column that
    does not state the accuracy of a position.

    The returned unit is `unit`, or else the unit at the end of the column's name, or None.
    """
    split, lower = _tokens(_CAMELS.sub("_", name)), _tokens(name)
    stated_unit = unit
    if not stated_unit:
        for tail, its_unit in _TAILS.items():
            if tuple(split[-len(tail) :]) == tail and len(split) > len(tail):
                stated_unit, split, lower = its_unit, split[: -len(tail)], _without(lower, tail)
                break
    # A capital may begin a word, as in `SDHeight`, or not, as in `SDn`. Both are tried; the clear reading counts.
    meanings = [_of_tokens(tokens) for tokens in (split, lower)]
    meaning = next((candidate for candidate in meanings if candidate not in (None, UNCLEAR, _OTHER)), None)
    if meaning is None and _OTHER not in meanings and UNCLEAR in meanings:
        meaning = UNCLEAR
    if meaning is not None and stated_unit and not _may_be_of_positions(meaning, stated_unit):
        meaning = None
    return meaning, stated_unit


def _tokens(name: str) -> list[str]:
    text = name.strip().lower()
    for pattern, spelling in _COLUMN_SPELLINGS:
        text = pattern.sub(spelling, text)
    return [token for token in text.split("_") if token]


def _without(tokens: list[str], tail: Sequence[str]) -> list[str]:
    return tokens[: -len(tail)] if tuple(tokens[-len(tail) :]) == tuple(tail) else tokens


def _of_tokens(tokens: Sequence[str]) -> str | None:
    """Standard name of an accuracy, as in `meaning_of`, from the words of a column name.

    Returns None if the name does not look like an accuracy.
    """
    words = [token for token in tokens if token in _SIGMA_WORDS | _VARIANCES]
    is_unclear = any(_UNCLEAR_MEASURES.fullmatch(token) for token in tokens) or _LOOKS_LIKE.search("_".join(tokens))
    is_error = not words and not _ERROR_WORDS.isdisjoint(tokens)
    if not words and not is_unclear and not is_error:
        return None
    if any(_OTHERS.fullmatch(token) or _VELOCITY_PATTERN.fullmatch(token) for token in tokens) or _is_velocity(
        tokens
    ):
        return _OTHER if _PLACE.isdisjoint(tokens) else UNCLEAR
    is_position = not _POSITION_WORDS.isdisjoint(tokens)
    axis_tokens = [
        token
        for token in tokens
        if token not in _SIGMA_WORDS | _VARIANCES | _ERROR_WORDS | _POSITION_WORDS | _FILLING | {"ep"}
    ]
    if any(_UNCLEAR_MEASURES.fullmatch(token) for token in axis_tokens):
        return UNCLEAR
    is_of_axis = len(axis_tokens) == 1 and (axis_tokens[0] in _AXIS_OF or axis_tokens[0] in _HORIZONTAL | _VERTICAL)
    if is_error:
        return UNCLEAR if is_of_axis or (not axis_tokens and is_position) else None
    if not _VARIANCES.isdisjoint(words):
        return _of_variance(axis_tokens)
    if is_of_axis and axis_tokens[0] in _AXIS_OF:
        return f"sigma_{_AXIS_OF[axis_tokens[0]]}"
    if is_of_axis:
        return "horizontal_accuracy" if axis_tokens[0] in _HORIZONTAL else "vertical_accuracy"
    if axis_tokens == ["h"]:
        return "horizontal_accuracy" if "accuracy" in words else "sigma_h"
    if len(axis_tokens) == 1 and _is_cross(axis_tokens[0]):
        return CROSS_COVARIANCE
    if not axis_tokens and (is_position or _WEAK.isdisjoint(words)):
        return "position_accuracy" if is_position or "accuracy" not in words else "horizontal_accuracy"
    return None if _WEAK.issuperset(words) else UNCLEAR


def _of_variance(axis_tokens: Sequence[str]) -> str:
    """Standard name of a variance or covariance column, from the words for its axes: `ee`, `e`, `e e` or `east`.

    The result is `UNCLEAR` if the axes are not known.
    """
    pair = (
        list(axis_tokens[0])
        if len(axis_tokens) == 1 and re.fullmatch(r"[enudxyz]{2}", axis_tokens[0])
        else list(axis_tokens)
    )
    axes = {_AXIS_OF.get(axis) for axis in pair}
    if None in axes or len(pair) > 2 or not axes:
        return UNCLEAR
    if len(axes) == 1:
        return f"variance_{axes.pop()}"
    return CROSS_COVARIANCE if axes <= {"east", "north", "up"} else UNCLEAR


def _is_cross(token: str) -> bool:
    """Whether a word consists of the initials of two different directions (east, north, up, down), such as `en`."""
    return re.fullmatch(r"[enud]{2}", token) is not None and token[0] != token[1]


def _is_velocity(tokens: Sequence[str]) -> bool:
    """Whether the words of a column name contain `v` directly before an axis, which indicates a velocity."""
    return any(first == "v" and second in "enudxyz" for first, second in pairwise(tokens))


def _may_be_of_positions(meaning: str, unit: str) -> bool:
    """Whether a column with the unit `unit` may state the accuracy of a position.

    `meaning` is the standard name of the accuracy. The result is true for a unit of length or area, and for an
    unknown unit. It is also true for a unit of angle, except for accuracies that cannot be angles, such as a vertical
    accuracy. The reader of the log later refuses a sigma in a unit of angle.
    """
    dimension = next((candidate for candidate in units.DIMENSIONS if _is_unit_of(unit, candidate)), None)
    if dimension in _OF_POSITIONS or dimension is None:
        return True
    return dimension is units.ANGLE and meaning not in (UNCLEAR, CROSS_COVARIANCE, "sigma_h", "vertical_accuracy")


def _is_unit_of(unit: str, dimension: units.Dimension) -> bool:
    try:
        units.parse_quantity(f"1 {unit}", dimension)
    except InvalidValueError:
        return False
    return True
