"""The .alog format: what is written is what stock tools read, and stock oddities are readable."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.core.message import Message
from pymoos_lite.records.alog import (
    AlogEntry,
    AlogHeader,
    AlogStyle,
    entry_printer,
    parse_entry,
    print_header,
    read_entries,
    read_lines,
)


def shown(message: Message, start: float = 1000.0, **style) -> str:
    return entry_printer(start, AlogStyle(**style))(message)


def test_the_header_has_the_layout_of_stock_logs():
    text = print_header("./L/L.alog", "Thu Jan  1 00:00:00 1970", 7181576505.784324)
    assert text.split("\n") == [
        "%" * 59,
        "%% LOG FILE:       ./L/L.alog",
        "%% FILE OPENED ON  Thu Jan  1 00:00:00 1970",
        "%% LOGSTART           7181576505.784324",
        "%" * 59,
        "",
    ]
    assert "%% DATATYPE MARKING ON\n" in print_header("x", "y", 0.0, marked=True)


@pytest.mark.parametrize(
    ("message", "style", "line"),
    [
        (
            Message("NAV_X", 12.5, 1001.25, "uSimMarine", "", "abe"),
            {},
            "1.25000         NAV_X                uSimMarine      12.50000     \n",
        ),
        (
            Message("DEPLOY", "true", 999.0, "pHelmIvP", "3:HELM", "abe"),
            {},
            "-1.00000        DEPLOY               pHelmIvP        true \n",
        ),
        (
            Message("DEPLOY", "true", 1000.0, "pHelmIvP", "3:HELM", "abe"),
            {"aux": True},
            "0.00000         DEPLOY               pHelmIvP:3:HELM true \n",
        ),
        (
            Message("A_NAME_LONGER_THAN_TWENTY", 1.0, 1000.0, "app", "", "ben"),
            {"precision": 2, "community": "abe"},
            "0.00000         A_NAME_LONGER_THAN_TWENTY app@ben         1.00         \n",
        ),
        (
            Message("A", 1.0, 1000.0, "app", "", "abe"),
            {"marked": True, "community": "abe"},
            "0.00000         A                    app             D:1.00000 \n",
        ),
        (Message("A", "b", 1000.0, "app"), {"marked": True}, f"{'0.00000':<15} {'A':<20} {'app':<15} S:b \n"),
        (
            Message("A B", "x\ny\r\nz", 1000.0, "my app"),
            {},
            f"{'0.00000':<15} {'A_B':<20} {'my_app':<15} x y z \n",
        ),
    ],
)
def test_an_entry_has_left_justified_columns_on_one_line(message, style, line):
    assert shown(message, **style) == line


TEXT = st.text(max_size=30)
NAME = st.text(alphabet="ABCXYZ_09", min_size=1, max_size=30)


@given(
    st.floats(-1e6, 1e10), NAME, NAME, st.one_of(st.floats(allow_nan=False, allow_infinity=False, width=32), TEXT),
    st.booleans(),
)  # fmt: skip
def test_what_is_printed_reads_back(time, name, source, value, marked):
    line = shown(Message(name, value, time, source), 0.0, marked=marked)
    assert line.count("\n") == 1
    entry = parse_entry(line.rstrip("\n"), marked=marked)
    assert entry is not None
    assert (entry.name, entry.source) == (name, source)
    assert entry.time == pytest.approx(time, abs=1e-5)
    if isinstance(value, float):
        assert entry.number == pytest.approx(value, abs=1e-5)
    elif marked:
        assert entry.number is None


@pytest.mark.parametrize(
    "line", ["", "text", "x NAV_X app 1", "1.5", "1.5 NAV_X", "- A b c", "1.2.3 A b c", "nan_x A b c"]
)
def test_what_is_no_entry_is_none(line):
    assert parse_entry(line) is None


def test_an_entry_without_value_has_an_empty_one():
    assert parse_entry("1.5   A   app   ") == AlogEntry(1.5, "A", "app", "", None)


def test_words_that_python_would_take_for_numbers_are_text():
    entry = parse_entry("1.5 A app 1_000")
    assert entry is not None
    assert entry.number is None


def test_reading_fills_the_header_and_joins_values_of_several_lines():
    lines = [
        "%%%%",
        "%% LOGSTART           7181576505.784324",
        "%% DATATYPE MARKING ON",
        "0.5  DB_VARSUMMARY MOOSDB_a S:first",
        "  NAV_X  second",
        "third  ",
        "",
        "0.4  A  b:1:c  S:5",
        "0.4  A  b:1:c  D:5.0",
    ]
    header = AlogHeader()
    entries = list(read_entries(lines, header))
    assert entries == [
        AlogEntry(0.5, "DB_VARSUMMARY", "MOOSDB_a", "first\n  NAV_X  second\nthird", None),
        AlogEntry(0.4, "A", "b:1:c", "5", None),
        AlogEntry(0.4, "A", "b:1:c", "5.0", 5.0),
    ]
    assert entries[1].app == "b"
    assert (header.start, header.marked, len(header.lines)) == (7181576505.784324, True, 3)


@given(st.lists(st.text(alphabet="%0 1.-ANx:\t\r", max_size=20), max_size=20))
def test_no_text_makes_the_reader_raise_and_no_line_is_lost(lines):
    read = list(read_lines(lines))
    assert len(read) == len(lines)
    assert sum(line.entry is not None for line in read) == len(list(read_entries(lines)))
