"""Quantities in and out."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget import units
from bisar_budget.budget.check import check_mission
from bisar_budget.faults import InvalidValueError
from bisar_budget.mission.load import parse_mission
from bisar_budget.other_units import value_of_unit
from bisar_budget.units import format_limit, format_quantity, parse_quantity
from tests.conftest import ROOT, TODAY, examples


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("31 km", units.LENGTH, 31e3),
        ("9.6GHz", units.FREQUENCY, 9.6e9),
        ("9.6e9", units.FREQUENCY, 9.6e9),  # YAML 1.1 calls this a string
        ("1e-12", units.RATIO, 1e-12),
        ("2 µrad", units.ANGLE, 2e-6),
        ("2 μrad", units.ANGLE, 2e-6),  # Greek mu, not the micro sign
        ("45 deg", units.ANGLE, math.pi / 4),
        ("5 mm/s", units.SPEED, 5e-3),
        ("5 mm / s", units.SPEED, 5e-3),
        ("36 km/h", units.SPEED, 10.0),
        ("0.1 mm/s^2", units.ACCELERATION, 1e-4),
        ("0.1 mm/s²", units.ACCELERATION, 1e-4),
        ("0.1 mm/s2", units.ACCELERATION, 1e-4),
        ("100 ug", units.ACCELERATION, 100e-6 * 9.80665),
        ("1e-14 1/s", units.RATE, 1e-14),
        ("0 1/s^2", units.RATE_SQUARED, 0.0),
        ("1e-14/s", units.RATE, 1e-14),
        ("1e-14 /s", units.RATE, 1e-14),
        ("2e-16/s²", units.RATE_SQUARED, 2e-16),
        ("2e-16 / s^2", units.RATE_SQUARED, 2e-16),
        ("90 kn", units.SPEED, 46.3),
        ("90 kt", units.SPEED, 46.3),
        ("2 NM", units.LENGTH, 3704.0),
        ("2 nm", units.LENGTH, 2e-9),
        ("3 ppm", units.RATIO, 3e-6),
        ("3 ppb", units.RATIO, 3e-9),
        ("0", units.ANGLE, 0.0),
        (0, units.ANGLE, 0.0),
        ("10 ns", units.TIME, 1e-8),
        ("-30 dB", units.POWER_RATIO, -30.0),
        ("-30", units.POWER_RATIO, -30.0),
        ("30 %", units.RATIO, 0.3),
        ("500 MB", units.MEMORY, 5e8),
        (" 7 ", units.LENGTH, 7.0),
        (7, units.LENGTH, 7.0),
        (".5 m", units.LENGTH, 0.5),
        ("+5. m", units.LENGTH, 5.0),
    ],
)
def test_reads(text: object, dimension: units.Dimension, value: float) -> None:
    assert parse_quantity(text, dimension) == pytest.approx(value, rel=1e-15)


# One of each, in SI, from the definitions: a degree is π/180, an hour 3600 s, a gal 0.01 m/s², g 9.80665 m/s².
DATA_SHEETS = (
    (units.ANGULAR_RATE, 4.848136811e-6, "°/hr", "°/h", "deg/hr", "deg/h", "deg / hr", "º/h", "˚/hr"),
    (units.ANGULAR_RATE, 1.745329252e-2, "°/s", "deg/s", "dps"),
    (units.ANGULAR_RATE, 1.745329252e-5, "mdps", "m°/s"),
    (units.ANGULAR_RATE, 4.848136811e-6, "dph"),
    (units.ANGLE_RANDOM_WALK, 1.745329252e-2, "dps/√Hz", "dps/sqrt(Hz)", "(dps)/√Hz", "dps/rtHz"),
    (units.ANGLE_RANDOM_WALK, 1.745329252e-5, "mdps/√Hz", "mdps/sqrt(Hz)", "m°/s/√Hz"),
    (units.ANGLE_RANDOM_WALK, 4.848136811e-6, "dph/√Hz", "dph/rt-Hz"),
    (units.VELOCITY_RANDOM_WALK, 9.80665e-6, "micro-g/√Hz", "micro-g/rtHz", "µ-g/√Hz"),
    (units.ACCELERATION, 9.80665e-6, "micro-g", "microg", "µ-g"),
    (units.ACCELERATION, 9.80665e-3, "milli-g"),
    (units.ANGLE_RANDOM_WALK, 2.908882087e-4, "°/√h", "°/√hr", "deg/√hr", "deg/sqrt(hr)", "deg/sqrt(h)", "deg/rt-hr"),
    (units.ANGLE_RANDOM_WALK, 2.908882087e-4, "°/root-hr", "deg/rt(hr)", "deg/rthr", "deg/hr^0.5"),
    (units.ANGLE_RANDOM_WALK, 2.908882087e-4, "°/h^(1/2)", "°/h^½"),
    (units.ANGLE_RANDOM_WALK, 4.848136811e-6, "°/h/√Hz", "°/hr/√Hz", "(°/hr)/√Hz", "deg/h/rt-Hz"),
    (units.ANGLE_RANDOM_WALK, 1.745329252e-2, "°/s/√Hz", "(deg/s)/√Hz"),
    (units.VELOCITY_RANDOM_WALK, 9.80665e-6, "µg/√Hz", "μg/√Hz", "ug/√Hz", "µg/√(Hz)", "µg/rt-Hz", "ug/sqrt(Hz)"),
    (units.VELOCITY_RANDOM_WALK, 1 / 60, "m/s/√h", "m/s/√hr", "m/s/sqrt(hr)"),
    (units.ACCELERATION, 1e-5, "mGal"),
    (units.ACCELERATION, 1e-2, "Gal"),
    (units.ACCELERATION, 1e-8, "µGal", "μGal", "uGal"),
    (units.ACCELERATION, 9.80665e-6, "µg", "μg", "ug"),
    (units.ANGLE, 4.848136811e-6, "arcsec"),
    (units.ANGLE, 2.908882087e-4, "arcmin"),
    (units.ANGLE, 1e-3, "mrad"),
    (units.TONE, 1.0, "dBc"),
    (units.PHASE_NOISE, 1.0, "dBc/Hz"),
)


@pytest.mark.parametrize(
    ("dimension", "value", "unit"), [(d, v, unit) for d, v, *texts in DATA_SHEETS for unit in texts]
)
def test_reads_units_as_data_sheets_write_them(dimension: units.Dimension, value: float, unit: str) -> None:
    assert parse_quantity(f"1 {unit}", dimension) == pytest.approx(value, rel=1e-9)
    assert parse_quantity(f"250{unit}", dimension) == pytest.approx(250 * value, rel=1e-9)


@pytest.mark.parametrize("dimension", units.DIMENSIONS, ids=lambda one: one.name)
def test_every_unit_is_read_back_as_a_report_writes_it(dimension: units.Dimension) -> None:
    """Reports speak in the unit of the file: `format_in` writes it, the next file may copy it."""
    for unit in filter(None, dimension.units):
        written = units.format_in(0.5 * parse_quantity(f"1 {unit}", dimension), dimension.si or "s/s", unit, 6)
        expected = 0.5 * parse_quantity(f"1 {unit}", dimension)
        assert parse_quantity(written, dimension) == pytest.approx(expected, rel=1e-5), written


@pytest.mark.parametrize(
    ("text", "dimension", "hint"),
    [
        ("-30 dBc", units.POWER_RATIO, "Did you mean 'dB'?"),
        ("-95 dBc", units.PHASE_NOISE, "Did you mean 'dBc/Hz'?"),
        ("-95 dB", units.PHASE_NOISE, "Did you mean 'dBc/Hz'?"),
        ("-95 dBc/hz", units.PHASE_NOISE, "Did you mean 'dBc/Hz'?"),
        ("-90 dB", units.TONE, "Did you mean 'dBc'?"),
        ("-90 dBc/Hz", units.TONE, ""),  # a density is no level
        ("3 as", units.ANGLE, "Did you mean 'arcsec'?"),
        ("3 arcseconds", units.ANGLE, "Did you mean 'arcsec'?"),
        ("3 Degrees", units.ANGLE, "Did you mean 'deg'?"),
        ("3 mgal", units.ACCELERATION, "Did you mean 'mGal'?"),
        ("3 deg/hour", units.ANGULAR_RATE, "Did you mean 'deg/h'?"),
        ("3 DEG/HR", units.ANGULAR_RATE, "Did you mean 'deg/h'?"),
        ("3 deg/√HR", units.ANGLE_RANDOM_WALK, "Did you mean 'deg/sqrt(h)'?"),
        ("3 µg/√hz", units.VELOCITY_RANDOM_WALK, "Did you mean 'ug/sqrt(Hz)'?"),
        ("3 sec", units.TIME, "Did you mean 's'?"),
        ("3 meters", units.LENGTH, "Did you mean 'm'?"),
        ("3 °/√h", units.ANGULAR_RATE, ""),
        ("6 parsec", units.TIME, ""),  # nothing near: not 'ps'
        ("5 kilometers", units.LENGTH, "Did you mean 'km'?"),
        ("3 degrees/second", units.ANGULAR_RATE, "Did you mean 'deg/s'?"),
        ("5 Nm", units.LENGTH, ""),  # nautical miles or nanometres
        ("5 mhz", units.FREQUENCY, ""),  # megahertz or millihertz
        ("5 MHZ", units.FREQUENCY, "Did you mean 'MHz'?"),
        ("3 mdge", units.ANGLE, ""),  # not 'deg', which is a thousand times as much
        ("5 in", units.LENGTH, "5 in is 127 mm"),
        ("5 mils", units.LENGTH, "5 mils is 127 \N{MICRO SIGN}m"),
        ("5 in/s", units.SPEED, "5 in/s is 127 mm/s"),
        ("5 in/s", units.LENGTH, "5 in/s is 127 mm/s, a speed"),
        ("5 mil", units.ANGLE, "A mil is 1/6400 of a turn, a milliradian, or a thousandth of an inch: write mrad"),
        ("1 fs", units.TIME, "1 fs is 1e-15 s"),
        ("3 deg/sqrt(Hz)", units.ANGLE_RANDOM_WALK, ""),  # not 'deg/sqrt(h)': another quantity
        ("-95 dBm/Hz", units.PHASE_NOISE, "Subtract the carrier's power in dBm"),
        ("-95 dBV/Hz", units.PHASE_NOISE, ""),
    ],
)
def test_a_unit_of_data_sheets_that_is_not_read_gets_a_hint(text: str, dimension: units.Dimension, hint: str) -> None:
    with pytest.raises(InvalidValueError) as error:
        parse_quantity(text, dimension)
    assert error.value.problem.hint == hint


@pytest.mark.parametrize(
    "unit", ["dBrad^2/Hz", "dBrad²/Hz", "dB rad²/Hz", "dB(rad²/Hz)", "dB re 1 rad^2/Hz", "dBrad2/Hz"]
)
def test_a_density_of_phase_is_read_as_twice_the_phase_noise(unit: str) -> None:
    """IEEE Std 1139: L(f) is half of the one-sided density of phase."""
    density = 10 ** (parse_quantity(f"-95 {unit}", units.PHASE_NOISE) / 10)
    assert density == pytest.approx(10**-9.5 / 2, rel=1e-12)


def test_a_power_is_no_phase_noise() -> None:
    with pytest.raises(InvalidValueError) as error:
        parse_quantity("-95 dBm/Hz", units.PHASE_NOISE)
    problem = error.value.problem
    assert problem.problem == "must be a phase noise L(f), but 'dBm/Hz' makes it a power in each hertz"
    assert "Did you mean" not in problem.hint


OF_LETTERS = st.sampled_from("abcdefghijklmnopqrstuvwxyzDGHKMNTµ²/^()√°")


@st.composite
def misspelt_units(draw: st.DrawFn) -> tuple[units.Dimension, str, str]:
    """A dimension, one of its units, and the same with one slip of letters or of case."""
    dimension = draw(st.sampled_from(units.DIMENSIONS))
    unit = draw(st.sampled_from([unit for unit in dimension.units if unit]))
    at = draw(st.integers(0, len(unit) - 1))
    letter = draw(OF_LETTERS)
    slips = [
        unit[:at] + unit[at + 1 :],
        unit[:at] + letter + unit[at:],
        unit[:at] + letter + unit[at + 1 :],
        unit[:at] + unit[at : at + 2][::-1] + unit[at + 2 :],
        unit[:at] + unit[at].swapcase() + unit[at + 1 :],
        unit.upper(),
        unit.lower(),
        unit + "s",
    ]
    return dimension, unit, draw(st.sampled_from([slip for slip in slips if slip]))


@examples(2000)
@given(misspelt_units())
def test_following_a_hint_never_changes_a_figure_by_a_factor(found: tuple[units.Dimension, str, str]) -> None:
    """A slip may give another unit, which is read or understood as what it is; a hint never gives another size."""
    dimension, unit, misspelt = found
    try:
        parse_quantity(f"3 {misspelt}", dimension)
    except InvalidValueError as error:
        meant = re.fullmatch(r"Did you mean '(.*)'\?", error.problem.hint)
    else:
        return
    if meant:
        understood = value_of_unit(units.normal_unit(misspelt))
        typed = parse_quantity(f"3 {unit}", dimension)
        if understood is not None:  # a word or a prefix: what is typed has a size of its own
            typed = 3 * understood.factor / value_of_si(dimension)
        assert parse_quantity(f"3 {meant[1]}", dimension) == pytest.approx(typed, rel=1e-9), misspelt


def test_what_is_understood_beside_the_tables_agrees_with_them() -> None:
    for dimension in units.DIMENSIONS:
        for unit, factor in dimension.units.items():
            understood = value_of_unit(unit)
            if understood is not None and unit:
                assert understood.factor == pytest.approx(factor * value_of_si(dimension), rel=1e-12), unit


def value_of_si(dimension: units.Dimension) -> float:
    understood = value_of_unit(dimension.si or "1")
    assert understood is not None, dimension.si
    return understood.factor


def test_an_unknown_unit_is_named_as_it_was_written() -> None:
    with pytest.raises(InvalidValueError) as error:
        parse_quantity("3 µparsec", units.LENGTH)
    assert error.value.problem.problem == "has the unknown unit 'µparsec'"


def test_decimal_prefixes_add_no_rounding() -> None:
    assert parse_quantity("5 mm/s^2", units.ACCELERATION) == 0.005
    assert parse_quantity("20 um", units.LENGTH) == 20e-6


@pytest.mark.parametrize(
    ("text", "dimension", "says"),
    [
        ("3 dBi", units.POWER_RATIO, "unknown unit 'dBi'"),
        ("3 GHz", units.LENGTH, "must be a length, but 'GHz' makes it a frequency"),
        ("10 ghz", units.FREQUENCY, "unknown unit 'ghz'"),
        ("1,5 m", units.LENGTH, "decimal comma"),
        ("1_000 m", units.LENGTH, "unknown unit"),
        ("1:30", units.TIME, "unknown unit"),
        ("0x10", units.LENGTH, "unknown unit"),
        ("010", units.LENGTH, "leading zero"),
        ("-05 m", units.LENGTH, "leading zero"),
        (".nan", units.LENGTH, "finite"),
        ("nan", units.LENGTH, "finite"),
        ("-inf", units.LENGTH, "finite"),
        ("1e999", units.LENGTH, "finite"),
        ("", units.LENGTH, "must be a length"),
        ("m", units.LENGTH, "must be a length"),
        ("9**9**9 m", units.LENGTH, "unknown unit"),
        ("1" * 100, units.LENGTH, "must be a length"),
        (True, units.LENGTH, "must be a length"),
        (None, units.LENGTH, "must be a length"),
        ([1], units.LENGTH, "must be a length"),
        (math.nan, units.LENGTH, "finite"),
        ("45", units.ANGLE, "has no unit"),
        (0.7, units.ANGLE, "has no unit"),
        ("1e-300", units.ANGLE, "has no unit"),
        ("nan", units.ANGLE, "finite"),
        ("45 m", units.ANGLE, "must be an angle, but 'm' makes it a length"),
    ],
)
def test_refuses(text: object, dimension: units.Dimension, says: str) -> None:
    with pytest.raises(InvalidValueError) as error:
        parse_quantity(text, dimension)
    assert says in error.value.problem.problem


def test_a_wrong_case_gets_a_hint() -> None:
    with pytest.raises(InvalidValueError) as error:
        parse_quantity("10 ghz", units.FREQUENCY)
    assert error.value.problem.hint == "Did you mean 'GHz'?"


@given(st.text(max_size=20), st.sampled_from(units.DIMENSIONS))
def test_any_text_is_a_finite_number_or_an_invalid_value(text: str, dimension: units.Dimension) -> None:
    try:
        assert math.isfinite(parse_quantity(text, dimension))
    except InvalidValueError as error:
        assert error.problem.problem


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.005, "m/s^2", "5 mm/s²"),
        (31000.0, "m", "31 km"),
        (4.2441e-4, "m/s^2", "424 µm/s²"),
        (0.0, "m", "0 m"),
        (1e-14, "1/s", "1e-14/s"),
        (1e-12, "s/s", "1e-12 s/s"),
        (7500.0, "m/s", "7500 m/s"),
        (1e-8, "s", "10 ns"),
        (10e9, "Hz", "10 GHz"),
        (0.9996, "m", "1 m"),
        (1e13, "m/s", "1e+13 m/s"),
    ],
)
def test_writes(value: float, unit: str, text: str) -> None:
    assert format_quantity(value, unit) == text


# Every unit that a report prints behind a number, as rows and sentences name it.
PRINTED = {
    "m": units.LENGTH,
    "m/s": units.SPEED,
    "m/s^2": units.ACCELERATION,
    "rad": units.ANGLE,
    "s": units.TIME,
    "s/s": units.RATIO,
    "1/s": units.RATE,
    "1/s^2": units.RATE_SQUARED,
    "Hz": units.FREQUENCY,
    "dB": units.POWER_RATIO,
}


@given(st.floats(1e-30, 1e15), st.sampled_from([1, -1]), st.sampled_from(sorted(PRINTED)), st.integers(3, 6))
def test_what_a_report_prints_is_read_back(size: float, sign: int, unit: str, digits: int) -> None:
    """Half of the last printed digit is the most that is lost."""
    value = sign * size
    read = parse_quantity(format_quantity(value, unit, digits), PRINTED[unit])
    assert read == pytest.approx(value, rel=0.5001 * 10.0 ** (1 - digits))


@given(st.floats(1e-12, 1e9), st.sampled_from(sorted(PRINTED)))
def test_a_limit_is_never_written_larger_than_it_is(value: float, unit: str) -> None:
    for text in (format_quantity(value, unit, rounding="down"), format_limit(value, unit)):
        assert value * 0.98 < parse_quantity(text, PRINTED[unit]) <= value * (1 + 1e-9)


def test_no_row_has_a_unit_that_is_not_read_back() -> None:
    text = (ROOT / "tests/acceptance/good/every_key.yaml").read_text(encoding="utf-8")
    found = check_mission(parse_mission(text), TODAY)
    assert {row.unit for row in found.rows} <= PRINTED.keys()
    assert len({row.unit for row in found.rows}) >= 8


# Each from its definition, not from the package: SI brochure, the international foot and mile, ISO 80000.
_ATOMS = {
    "": 1.0,
    "1": 1.0,
    "m": 1.0,
    "s": 1.0,
    "rad": 1.0,
    "Hz": 1.0,
    "B": 1.0,
    "dB": 1.0,
    "dBc": 1.0,
    "km": 1e3,
    "cm": 1e-2,
    "mm": 1e-3,
    "um": 1e-6,
    "nm": 1e-9,
    "ft": 0.3048,
    "nmi": 1852.0,
    "NM": 1852.0,
    "ms": 1e-3,
    "us": 1e-6,
    "ns": 1e-9,
    "ps": 1e-12,
    "min": 60.0,
    "h": 3600.0,
    "day": 86400.0,
    "month": 30 * 86400.0,
    "year": 365.25 * 86400.0,
    "kHz": 1e3,
    "MHz": 1e6,
    "GHz": 1e9,
    "THz": 1e12,
    "kt": 1852 / 3600,
    "kn": 1852 / 3600,
    "mrad": 1e-3,
    "urad": 1e-6,
    "nrad": 1e-9,
    "deg": math.pi / 180,
    "mdeg": math.pi / 180e3,
    "\N{DEGREE SIGN}": math.pi / 180,
    "arcmin": math.pi / 10800,
    "arcsec": math.pi / 648000,
    "g": 9.80665,
    "mg": 9.80665e-3,
    "ug": 9.80665e-6,
    "Gal": 1e-2,
    "mGal": 1e-5,
    "uGal": 1e-8,
    "%": 1e-2,
    "ppm": 1e-6,
    "ppb": 1e-9,
    "TECU": 1e16,
    "kB": 1e3,
    "KB": 1e3,
    "MB": 1e6,
    "GB": 1e9,
    "TB": 1e12,
    "MiB": 2.0**20,
    "GiB": 2.0**30,
}


def worked_out(unit: str) -> float:
    """The factor to SI of a unit as it is written: parts between slashes, powers, square roots."""
    whole = 1.0
    for place, part in enumerate(re.split(r"/(?![^(]*\))", unit)):
        match = re.fullmatch(r"(?:(sqrt)?\((.*)\)|([^()^]*))(?:\^(-?\d))?", part)
        assert match is not None, part
        inner = worked_out(match[2]) if match[2] is not None else _ATOMS[match[3]]
        if match[1]:
            inner = math.sqrt(inner)
        inner **= int(match[4] or 1)
        whole = whole / inner if place else inner
    return whole


def test_every_unit_has_the_factor_of_its_parts() -> None:
    kinds = [one for one in vars(units).values() if isinstance(one, units.Dimension)]
    assert len(kinds) > 25
    for kind in kinds:
        for unit, factor in kind.units.items():
            assert factor == pytest.approx(worked_out(unit) / worked_out(kind.si), rel=1e-14), (kind.name, unit)
