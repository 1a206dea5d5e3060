"""Numbers with units: the float that the SI number would be, and a clear word on the wrong dimension."""

import re
from math import radians

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from primitives.errors import InputError, UnknownNameError
from primitives.files import quantities
from primitives.files.quantities import UNITS, quantity


@pytest.mark.parametrize(
    ("dimension", "text", "expected"),
    [
        ("a length", "5 mm", 0.005),
        ("a length", "1.2mm", 0.0012),
        ("a length", " -8 cm ", -0.08),
        ("a length", "2.5e2 um", 0.00025),
        ("a length", ".5 m", 0.5),
        ("an angle", "30 deg", radians(30.0)),
        ("an angle", "180 deg", 3.141592653589793),
        ("a time", "4 ms", 0.004),
        ("a period", "250 Hz", 0.004),
        ("a period", "1 kHz", 0.001),
        ("a period", "4 ms", 0.004),
        ("a rate", "50 1/s", 50.0),
        ("a rate", "2 Hz", 2.0),
        ("a speed", "3 mm/s", 0.003),
        ("a turning speed", "90 deg/s", radians(90.0)),
        ("a force", "20 N", 20.0),
        ("a torque", "7 mNm", 0.007),
        ("a stiffness", "0.3 N/mm", 300.0),
        ("a damping", "20 N  s/m", 20.0),
        ("an energy", "10 mJ", 0.01),
    ],
)
def test_a_text_is_the_float_of_its_si_number(dimension, text, expected):
    assert quantity(text, dimension) == expected


@given(st.integers(-(10**9), 10**9), st.integers(0, 6))
def test_decimals_lose_nothing(whole, places):
    text = f"{whole}e-{places}"
    assert quantity(f"{text} mm", "a length") == float(f"{whole}e-{places + 3}")


@pytest.mark.parametrize("value", [5, 0.1, True, None, [1], {}])
def test_what_is_no_text_passes(value):
    assert quantity(value, "a length") is value


@pytest.mark.parametrize(
    ("text", "dimension", "words"),
    [
        ("5 deg", "a length", 'a text with m, cm, mm, um, got the text "5 deg", an angle'),
        ("5 mm", "an angle", 'expected an angle: a number in rad, or a text with rad, mrad, deg, got the text "5 mm"'),
        ("5", "a length", 'got the text "5"'),
        ("1e-3", "a length", 'got the text "1e-3"'),
        ("mm", "a length", 'got the text "mm"'),
        ("5,2 mm", "a length", "unknown unit"),
        ("0 Hz", "a period", "expected a period"),
        ("1e9999 m", "a length", "expected a length"),
        ("5 mm" + " " * 60, "a length", "expected a length"),
        ("9" * 400 + " m", "a length", "expected a length"),
    ],
)
def test_what_is_no_such_quantity_is_refused(text, dimension, words):
    with pytest.raises(InputError) as caught:
        quantity(text, dimension)
    assert words in str(caught.value) or (words == "unknown unit" and "expected" in str(caught.value))


def test_an_unknown_unit_is_told_with_the_known_ones():
    with pytest.raises(UnknownNameError, match='unknown unit "Mm"'):
        quantity("5 Mm", "a length")


def test_infinities_do_not_pass_the_fields():
    adapter = TypeAdapter(quantities.PositiveLength)
    assert adapter.validate_python("5 mm", strict=True) == 0.005
    for text in ("-1 mm", "0 m"):
        with pytest.raises(ValidationError):
            adapter.validate_python(text, strict=True)


@pytest.mark.parametrize("dimension", UNITS)
def test_the_pattern_for_editors_takes_what_is_read(dimension):
    schema = TypeAdapter(quantities.Annotated[float, quantities.of(dimension)]).json_schema()
    pattern = schema["pattern"]
    assert schema["type"] == ["number", "string"]
    for unit in UNITS[dimension]:
        for text in (f"5 {unit}", f"-.5e-1 {unit}", f"  1.25  {unit} "):
            assert re.search(pattern, text), "as editors do, who search"
            quantity(text, dimension)
    assert not re.search(pattern, "5 parsec")
