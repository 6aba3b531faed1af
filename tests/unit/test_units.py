"""Quantities in and out."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bisar_budget import units
from bisar_budget.errors import InvalidValueError
from bisar_budget.units import format_quantity, parse_quantity


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


@given(st.floats(1e-12, 1e9), st.sampled_from(["m", "m/s", "m/s^2", "rad", "1/s", "s"]))
def test_a_limit_is_never_written_larger_than_it_is(value: float, unit: str) -> None:
    text = format_quantity(value, unit, rounding="down")
    number, _, written_unit = text.partition(" ")
    if not written_unit:  # 1e-14/s
        number, _, _ = text.partition("/")
        read = float(number)
    else:
        dimension = {
            "m": units.LENGTH,
            "m/s": units.SPEED,
            "m/s^2": units.ACCELERATION,
            "rad": units.ANGLE,
            "s": units.TIME,
        }[unit]
        read = parse_quantity(text, dimension)
    assert value * 0.98 < read <= value * (1 + 1e-9)
