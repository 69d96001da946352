"""community.md 19: numbers, truth values and field lists in text."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.geometry.text import (
    fields,
    fix,
    is_number,
    num,
    parse_bool,
    parse_number,
    split_protected,
    unbrace,
    unquote,
)

awkward_text = st.text(alphabet='ab ,={}"!@#\n', max_size=40) | st.text(max_size=40)


@pytest.mark.parametrize(
    ("value", "decimals", "text"),
    [
        (60, 2, "60"),
        (22.770, 2, "22.77"),
        (2.5, 2, "2.5"),
        (-0.001, 2, "0"),
        (-0.0, 0, "0"),
        (100, 0, "100"),
        (1e21, 2, "1000000000000000000000"),
        (-12.3456, 3, "-12.346"),
        (math.inf, 2, "inf"),
        (math.nan, 2, "nan"),
    ],
)
def test_numbers_are_printed_trimmed_and_never_as_minus_zero(value: float, decimals: int, text: str) -> None:
    assert num(value, decimals) == text


def test_fixed_numbers_keep_their_zeros() -> None:
    assert [fix(3.0, 2), fix(-0.0001, 2), fix(2.345, 1)] == ["3.00", "0.00", "2.3"]


@given(st.floats(allow_nan=False, allow_infinity=False, min_value=-1e15, max_value=1e15), st.integers(0, 8))
def test_printed_numbers_pass_the_numeric_test_and_read_back_rounded(value: float, decimals: int) -> None:
    back = parse_number(num(value, decimals))
    assert back is not None
    assert abs(back - value) <= 0.5 * 10.0**-decimals + abs(value) * 1e-15


@pytest.mark.parametrize("text", ["5", "-5", "+5.", ".5", " 7 ", "007", "-0.0"])
def test_signs_digits_and_one_point_make_a_number(text: str) -> None:
    assert is_number(text)
    assert parse_number(text) == float(text)


@pytest.mark.parametrize("text", ["", "-", ".", "1e3", "--5", "1.2.3", "nan", "inf", "1_0", "0x1", "5m", "٣"])
def test_exponents_words_and_repeated_signs_make_no_number(text: str) -> None:
    assert not is_number(text)
    assert parse_number(text) is None


def test_digits_beyond_any_float_make_no_number() -> None:
    assert parse_number("9" * 400) is None


@given(st.text(alphabet="+-.0123456789eExXinfa_ \t\u0663", max_size=8))
def test_a_number_is_what_passes_the_numeric_test(text):
    value = parse_number(text)
    assert (value is not None) == is_number(text)
    if value is not None:
        assert value == float(text)


def test_booleans_come_in_three_spellings_and_toggle_needs_a_state() -> None:
    assert [parse_bool(t) for t in ("TRUE", "on", " Yes ")] == [True] * 3
    assert [parse_bool(t) for t in ("false", "OFF", "no")] == [False] * 3
    assert parse_bool("toggle") is None
    assert parse_bool("toggle", True) is False
    assert parse_bool("1") is None


def test_separators_inside_braces_and_quotes_do_not_separate() -> None:
    assert split_protected('a={1,2}, b="x,y" ,c={{1,2},3},d') == ["a={1,2}", 'b="x,y"', "c={{1,2},3}", "d"]
    assert split_protected('a="{",b="}"') == ['a="{"', 'b="}"']


def test_an_unclosed_brace_or_quote_protects_nothing() -> None:
    assert split_protected("a={1,2,b=3") == ["a={1", "2", "b=3"]
    assert split_protected('a="1,b=3') == ['a="1', "b=3"]


def test_quotes_are_letters_where_the_format_says_so() -> None:
    assert split_protected('a="1,b="', quotes=False) == ['a="1', 'b="']


def test_the_first_equals_sign_splits_a_field() -> None:
    assert fields(" a = b=c , d ,, e=") == [("a", "b=c"), ("d", ""), ("e", "")]


def test_one_pair_of_quotes_or_braces_comes_off() -> None:
    assert (unquote(' "a" '), unquote('"'), unquote("a")) == ("a", '"', "a")
    assert (unbrace("{ a }"), unbrace("{"), unbrace("{{1}}")) == ("a", "{", "{1}")


@given(awkward_text)
def test_splitting_loses_nothing_but_blanks_and_separators(text: str) -> None:
    joined = "".join(split_protected(text))
    squeezed = [c for c in joined if not c.isspace() and c != ","]
    assert squeezed == [c for c in text if not c.isspace() and c != ","]
