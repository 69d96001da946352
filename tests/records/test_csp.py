"""The text layer of the records: flags, field maps, protection of values."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.records.csp import (
    MAX_TEXT,
    Flag,
    RecordError,
    clip,
    field_map,
    parse_flag,
    printable,
    split_protected,
)

awkward_text = st.text(alphabet='ab1. ,={}"', max_size=30) | st.text(max_size=30)


@pytest.mark.parametrize(
    ("text", "flag"),
    [
        ("DEPLOY=true", Flag("DEPLOY", "true")),
        ("X = 3.5", Flag("X", 3.5)),
        ('X = "3.5"', Flag("X", "3.5")),
        ("UPDATES=points=1,2:3,4", Flag("UPDATES", "points=1,2:3,4")),
        ("E=1e3", Flag("E", "1e3")),
        ("EMPTY=", Flag("EMPTY", "")),
    ],
)
def test_a_flag_is_a_number_only_when_numeric_and_unquoted(text: str, flag: Flag) -> None:
    assert parse_flag(text) == flag


@pytest.mark.parametrize("text", ["", "DEPLOY", "=3", "A B=3", "  =x"])
def test_a_flag_without_variable_or_equals_is_refused_with_its_text(text: str) -> None:
    with pytest.raises(RecordError, match="expected VAR=value"):
        parse_flag(text)


@given(awkward_text)
def test_a_text_flag_reads_back_as_the_same_text(value: str) -> None:
    assert parse_flag(Flag("VAR", value).to_text()) == Flag("VAR", value)


@given(st.floats(-1e9, 1e9))
def test_a_number_flag_reads_back_as_a_number(value: float) -> None:
    back = parse_flag(Flag("VAR", value).to_text())
    assert back.value == pytest.approx(value, abs=1e-8)


def test_keys_are_lower_cased_and_the_last_value_wins() -> None:
    assert field_map("T", "Name=abe, X = {1,2} ,x=3") == {"name": "abe", "x": "3"}


def test_a_piece_without_equals_and_an_endless_text_are_refused() -> None:
    with pytest.raises(RecordError, match="T: expected key=value, found 'oops'"):
        field_map("T", "a=1,oops")
    with pytest.raises(RecordError, match="longer than"):
        field_map("T", "a" * (MAX_TEXT + 1))


@given(awkward_text)
def test_a_protected_value_stays_one_piece_between_commas(value: str) -> None:
    pieces = split_protected(f"a={printable(value)},b=1", quotes=False)
    assert len(pieces) == 2
    assert pieces[1] == "b=1"


def test_clipped_text_is_one_printable_line() -> None:
    assert clip("a\nb\x00" + "c" * 100, 10) == "a b cccccc..."
