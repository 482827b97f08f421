"""Numbers and names in sentences: what an operator reads."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchline.core.statements import format_number, format_with_sigma, sentence


@pytest.mark.parametrize(
    "value, text",
    [
        (0.0, "0"),
        (0.26431, "0.26"),
        (1.5, "1.5"),
        (2.0, "2"),
        (9.97, "10"),
        (12.4, "12"),
        (124.4, "124"),
        (1534.0, "1534"),
        (-6.4e-05, "−0.000064"),
        (-3.14e-8, "−3.1 × 10⁻⁸"),
        (4.2e7, "4.2 × 10⁷"),
        (-0.0, "0"),
        (5e-324, "4.9 × 10⁻³²⁴"),
        (float("nan"), "unknown"),
        (float("inf"), "unknown"),
    ],
)
def test_a_number_is_printed_as_people_write_it(value, text):
    assert format_number(value) == text


@pytest.mark.parametrize(
    "value, sigma, text",
    [
        (-6.4e-05, 8e-05, "−0.000064 ± 0.00008"),
        (0.0123, 0.04, "0.012 ± 0.04"),
        (-6.41e-08, 8.02e-08, "(−6.4 ± 8) × 10⁻⁸"),
        (1234.56, 21.0, "1235 ± 21"),
        (0.5, 0.0, "0.5"),
        (0.5, 5e-324, "0.5"),
        (0.00001, 0.4, "0.00 ± 0.4"),
        (-0.00001, 0.4, "0.00 ± 0.4"),
    ],
)
def test_a_value_has_the_digits_that_its_sigma_leaves_it(value, sigma, text):
    assert format_with_sigma(value, sigma) == text


@given(st.floats(-1e12, 1e12), st.integers(1, 6))
def test_it_can_be_read_back(value, digits):
    text = format_number(value, digits)
    assert "e" not in text and "-" not in text
    mantissa, _, power = text.replace("−", "-").partition(" × 10")
    read = float(mantissa) * 10.0 ** int(
        power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")) or 0
    )
    assert math.isclose(read, value, rel_tol=0.6 * 10 ** (1 - digits), abs_tol=1e-300)


@pytest.mark.parametrize(
    "text, said",
    [
        ("picture 14 shows no chessboard.", "Picture 14 shows no chessboard."),
        ("view 2 has 3 corners.", "View 2 has 3 corners."),
        ("img_01.png shows no chessboard.", "img_01.png shows no chessboard."),
        ("pictures.png is damaged.", "pictures.png is damaged."),
        ("The corners of picture 3", "The corners of picture 3"),
    ],
)
def test_a_sentence_begins_large_unless_with_a_files_name(text, said):
    assert sentence(text) == said
