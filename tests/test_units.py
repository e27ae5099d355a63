import math

import pytest
from hypothesis import given, strategies as st

from elastocal.errors import UnitError
from elastocal.units import (
    dimension_of,
    factor,
    impossible,
    parse_number,
    parse_quantity,
    split_column,
)


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("175 mm", "length", 0.175),
        ("175mm", "length", 0.175),
        ("  -2.5e-1  m ", "length", -0.25),
        ("+3 um", "length", 3e-6),
        (".5 µm", "length", 0.5e-6),
        ("5. m", "length", 5.0),
        ("180 deg", "angle", math.pi),
        ("1.1 kN", "force", 1100.0),
        ("2 N·m", "moment", 2.0),
        ("2 Nm", "moment", 2.0),
        ("3 N*mm", "moment", 3e-3),
        ("3 kN*m", "moment", 3e3),
        ("1.1 t", "mass", 1100.0),
        ("2 min", "time", 120.0),
        ("20 mm/s", "speed", 0.02),
        ("180 deg/s", "angular speed", math.pi),
        ("1e-6 rad/(N*m)", "rotational compliance", 1e-6),
        ("2 um/N", "translational compliance", 2e-6),
    ],
)
def test_a_quantity_is_read_in_si(text, dimension, value):
    assert parse_quantity(text, dimension) == pytest.approx(value, rel=1e-15)


@given(st.one_of(st.just(0.0), st.floats(1e-12, 1e3), st.floats(-1e3, -1e-12)))
def test_a_quantity_written_in_si_is_read_back_exactly(value):
    assert parse_quantity(f"{value!r} m", "length") == value


@pytest.mark.parametrize(
    "text", [175, 0.175, True, None, "175", "mm", "", "nan mm", "inf mm", "1,5 mm", "0x10 mm", []]
)
def test_a_number_without_its_unit_is_refused_with_the_units_allowed(text):
    with pytest.raises(UnitError, match="mm"):
        parse_quantity(text, "length")


@pytest.mark.parametrize("text", ["1 N", "1 mm mm", "1 MM", "1 m/s", "1 inch"])
def test_a_unit_of_another_dimension_is_refused(text):
    with pytest.raises(UnitError, match=r"is not a length: allowed are m, mm"):
        parse_quantity(text, "length")


def test_an_overflowing_quantity_is_refused():
    with pytest.raises(UnitError, match="1e999 m"):
        parse_quantity("1e999 m", "length")


@pytest.mark.parametrize(
    ("text", "dimension", "words"),
    [
        ("1000.1 m", "length", "'1000.1 m' is too large: the largest length is 1 km"),
        ("-1e300 mm", "length", "the largest length is 1 km"),
        ("1e300 deg", "angle", "the largest angle is 100 turns"),
        ("1e300 N", "force", "10 MN"),
        ("1e300 s", "time", "1e6 s"),
        ("1e-300 m/s", "speed", "'1e-300 m/s' is too small: write 0, or at least 1e-12"),
    ],
)
def test_what_no_robot_cell_holds_is_refused(text, dimension, words):
    with pytest.raises(UnitError) as caught:
        parse_quantity(text, dimension)
    assert words in str(caught.value)


def test_a_near_miss_is_named():
    with pytest.raises(UnitError, match="did you mean 'mm'"):
        factor("mmm", "length")


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("force_x[N]", ("force_x", "N")),
        (" force_x [ N ] ", ("force_x", "N")),
        ("pose", ("pose", None)),
        ("empty[]", ("empty", "")),
        ("two words[mm]", ("two words", "mm")),
    ],
)
def test_a_header_is_a_name_and_a_unit(header, expected):
    assert split_column(header) == expected


@pytest.mark.parametrize("header", ["", "[N]", "force_x[N", "force_xN]", "a[N][m]", "a[N]b", "  "])
def test_a_header_of_another_form_is_refused(header):
    with pytest.raises(UnitError, match=r"is not of the form name\[unit\]"):
        split_column(header)


@pytest.mark.parametrize(
    ("dimension", "values", "words"),
    [
        ("length", (0.0, 1e160), "1e+160 m: the largest length is 1 km"),
        ("length", (math.nan,), "nan m: it must be finite"),
        ("mass", (-1.0,), "-1 kg: it must not be negative"),
        ("mass", (1e300,), "1e+300 kg: the largest mass is 1000 t"),
        ("rotational compliance", (1e9,), "1e+09 rad/(N*m): the largest rotational compliance"),
        ("rotational compliance", (-1e-6, 1.0), None),
        ("length", (-1e3, 1e3), None),
    ],
)
def test_a_number_that_is_none_of_a_robot_cell_is_named(dimension, values, words):
    problem = impossible(dimension, *values)
    assert problem is None if words is None else problem.startswith(words)


@pytest.mark.parametrize(
    ("text", "dimension"), [("3 mm", "length"), ("1 Nm/arcmin", "rotational stiffness"), (3, None)]
)
def test_the_unit_says_the_dimension(text, dimension):
    assert dimension_of(text) == dimension


@pytest.mark.parametrize(
    "text", ["1_100", "-1_100", "\u0661\u0662", "\uff11", "1e", "0x10", "", "1 0", "one"]
)
def test_what_only_python_takes_for_a_number_is_none(text):
    with pytest.raises(ValueError):  # noqa: PT011 - a builtin on purpose
        parse_number(text)
    with pytest.raises(UnitError):
        parse_quantity(f"{text} mm", "length")


def test_a_number_may_stand_between_spaces_of_any_kind():
    assert parse_number("\u00a0-1.5e3 ") == -1500.0


@pytest.mark.parametrize(
    ("unit", "dimension", "si"),
    [
        ("kgf", "force", 9.80665),
        ("kgf*m", "moment", 9.80665),
        ("kgf*cm", "moment", 0.0980665),
        ("lbf", "force", 4.4482216),
        ("lbf*in", "moment", 0.11298483),
        ("lbf*ft", "moment", 1.3558179),
    ],
)
def test_kilograms_and_pounds_of_force_are_read_as_newtons(unit, dimension, si):
    assert parse_quantity(f"1 {unit}", dimension) == pytest.approx(si)


@pytest.mark.parametrize("unit", ["Grad", "grad", "°"])
def test_degrees_in_german_are_no_radians(unit):
    with pytest.raises(UnitError, match="did you mean 'deg'"):
        factor(unit, "angle")


@pytest.mark.parametrize(
    ("unit", "dimension", "meant"),
    [
        ("Grad", "angle", "deg"),
        ("degrees", "angle", "deg"),
        ("sec", "time", "s"),
        ("inch", "length", "in"),
    ],
)
def test_another_word_for_a_unit_is_refused_with_the_unit_that_is_meant(unit, dimension, meant):
    with pytest.raises(UnitError) as refused:
        factor(unit, dimension)
    assert str(refused.value).endswith(f"did you mean {meant!r}?")
