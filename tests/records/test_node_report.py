"""marine_apps.md 3.1: NODE_REPORT in both its forms."""

from contextlib import suppress
from dataclasses import fields, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.records.csp import MAX_TEXT, RecordError
from pymoos_lite.records.node_report import NodeReport

EXAMPLE = (
    "NAME=abe,SPD=1.28,HDG=306.52,DEP=0,LAT=43.82500629,LON=-70.32989629,TYPE=kayak,COLOR=yellow,"
    "MODE=MODE@ACTIVE:RETURNING,ALLSTOP=clear,INDEX=832,YAW=2.5041367,TIME=17953952104,LENGTH=4"
)

word = st.text(alphabet="abcXYZ019_@:.-+ \"'", max_size=12).map(str.strip)
value = st.text(alphabet='ab1,={}:" ', max_size=16).map(str.strip)
two_decimals = st.none() | st.integers(-(10**9), 10**9).map(lambda i: i / 100)
eight_decimals = st.none() | st.integers(-180 * 10**8, 180 * 10**8).map(lambda i: i / 10**8)
seven_decimals = st.none() | st.integers(-4 * 10**7, 4 * 10**7).map(lambda i: i / 10**7)
NUMERIC = {f.name for f in fields(NodeReport) if f.type == "float | None"}
KNOWN = {"NAME", "X", "Y", "SPD", "HDG", "COG", "DEP", "LAT", "LON", "TYPE", "COLOR", "GROUP", "MODE", "ALT"}

reports = st.builds(
    NodeReport,
    **dict.fromkeys(NUMERIC - {"lat", "lon", "yaw"}, two_decimals),
    lat=eight_decimals,
    lon=eight_decimals,
    yaw=seven_decimals,
    index=st.integers(0, 10**6),
    thrust_mode_reverse=st.booleans(),
    **dict.fromkeys(
        ("name", "type", "color", "group", "vsource", "mode", "mode_aux", "allstop", "load_warning"), word
    ),
    trajectory=st.text(alphabet="0123456789.,:-", max_size=20),
    properties=st.dictionaries(
        st.text(alphabet="pqr_", min_size=1, max_size=5), word.filter(bool), max_size=3
    ).map(lambda d: tuple(sorted(d.items()))),
)


def test_the_stock_example_reads_and_prints_back_letter_by_letter() -> None:
    report = NodeReport.parse(EXAMPLE)
    assert (report.name, report.speed, report.heading, report.lat) == ("abe", 1.28, 306.52, 43.82500629)
    assert (report.mode, report.index, report.time, report.length) == (
        "MODE@ACTIVE:RETURNING",
        832,
        17953952104,
        4,
    )
    assert report.x is None
    assert report.is_complete()
    assert report.to_text() == EXAMPLE


def test_fields_are_printed_in_the_stock_order_whatever_the_input_order() -> None:
    text = "LENGTH=4,TIME=10,ZZ=1,HDG=90,NAME=abe,AA=2,SPD=1,Y=2,X=1,INDEX=0"
    assert NodeReport.parse(text).to_text() == "NAME=abe,X=1,Y=2,SPD=1,HDG=90,TIME=10,LENGTH=4,AA=2,ZZ=1"


def test_old_spellings_and_lower_case_keys_are_understood() -> None:
    text = "name=abe, utc_time=5,Speed=1,HEADING=2,DEPTH=3,LEN=4,ALT=5,X=0,Y=0"
    report = NodeReport.parse(text)
    assert (report.time, report.speed, report.heading, report.depth) == (5, 1, 2, 3)
    assert (report.length, report.altitude) == (4, 5)


def test_a_numeric_key_with_words_becomes_a_property() -> None:
    report = NodeReport.parse("NAME=abe,SPD=fast")
    assert report.speed is None
    assert report.property("SPD") == "fast"
    assert report.property("NONE", "?") == "?"


def test_commas_inside_braces_belong_to_the_value() -> None:
    report = NodeReport.parse("NAME=abe,TRAJECTORY={pts={1,2:3,4}},RIDER={a,b},X=1")
    assert report.trajectory == "pts={1,2:3,4}"
    assert report.property("RIDER") == "{a,b}"
    assert report.x == 1.0
    assert report.to_text() == "NAME=abe,X=1,TRAJECTORY={pts={1,2:3,4}},RIDER={a,b}"


def test_riders_come_last_and_are_braced_when_they_have_commas() -> None:
    text = NodeReport(name="abe", properties=(("P", "1"),)).to_text(riders=[("R", "a,b"), ("A", "2")])
    assert text == "NAME=abe,P=1,R={a,b},A=2"


@pytest.mark.parametrize("missing", ["NAME", "SPD", "HDG", "X", "Y"])
def test_a_report_without_a_mandatory_field_is_not_complete(missing: str) -> None:
    given_fields = {"NAME": "abe", "SPD": "1", "HDG": "2", "X": "3", "Y": "4"}
    assert NodeReport.parse(",".join(f"{k}={v}" for k, v in given_fields.items())).is_complete()
    del given_fields[missing]
    assert not NodeReport.parse(",".join(f"{k}={v}" for k, v in given_fields.items())).is_complete()


def test_the_json_form_has_bare_numbers_and_quoted_words() -> None:
    report = NodeReport(name="abe", x=12.3, mode="MODE@A,B", trajectory="1,2:3,4")
    text = report.to_json()
    assert text == '{"NAME":"abe","X":12.3,"MODE":"{MODE@A,B}","TRAJECTORY":"{1,2:3,4}"}'
    assert NodeReport.parse(text).trajectory == "1,2:3,4"


def test_json_with_unquoted_braces_is_read_as_the_reference_writes_it() -> None:
    report = NodeReport.parse('{"NAME":"abe","X":1,"TRAJECTORY":{1,2:3,4},"Y":2}')
    assert (report.name, report.x, report.y, report.trajectory) == ("abe", 1.0, 2.0, "1,2:3,4")


def test_equal_reports_hash_alike_and_replace_works_on_parsed_ones() -> None:
    first = NodeReport.parse(EXAMPLE)
    second = NodeReport.parse(EXAMPLE + ",")
    assert first == second
    assert hash(first) == hash(second)
    assert replace(first, x=1.0).to_text().startswith("NAME=abe,X=1,SPD=1.28")
    assert "heading=306.52" in repr(first)
    with pytest.raises(AttributeError):
        first.x = 3.0  # type: ignore[misc]


def test_numbers_that_are_not_finite_are_left_out() -> None:
    assert NodeReport(name="abe", x=float("nan"), speed=float("inf")).to_text() == "NAME=abe"


@given(reports)
def test_any_report_reads_back_from_its_text(report: NodeReport) -> None:
    assert NodeReport.parse(report.to_text()) == report


@given(reports)
def test_any_report_reads_back_from_its_json(report: NodeReport) -> None:
    if report.to_text():
        assert NodeReport.parse(report.to_json()) == report


@given(st.dictionaries(st.text(alphabet="pqr_", min_size=1, max_size=5), value, max_size=4))
def test_awkward_property_values_never_disturb_their_neighbours(extra: dict[str, str]) -> None:
    report = NodeReport(name="abe", length=4.0, properties=tuple(sorted(extra.items())))
    back = NodeReport.parse(report.to_text(riders=[("LAST", "1")]))
    assert (back.name, back.length, back.property("LAST")) == ("abe", 4.0, "1")
    assert NodeReport.parse(back.to_text()) == back


@given(st.text(alphabet='NAMEXY=,{}[]":1.e-\x00\n ', max_size=80) | st.text(max_size=80))
def test_hostile_text_gives_a_record_or_a_record_error(text: str) -> None:
    for candidate in (text, "{" + text + "}"):
        try:
            report = NodeReport.parse(candidate)
        except RecordError:
            continue
        assert NodeReport.parse(report.to_text()) == report


@pytest.mark.parametrize(
    "text",
    [
        "{" * 200_000,
        "[" * 5000 + "}",
        '{"a":' * 100_000 + "}" * 100_000,
        '{"a":' + "[" * 900 + "]" * 900 + "}",
        "X=" + "9" * 500_000,
        "," * 500_000,
        "{}" * 400_000,
        "INDEX=" + "9" * 400,
        '{"X":' + "1" * 5000 + "}",
    ],
    ids=range(9),
)
def test_deep_nesting_and_endless_numbers_neither_hang_nor_crash(text: str) -> None:
    with suppress(RecordError):
        assert isinstance(NodeReport.parse(text), NodeReport)


def test_a_text_beyond_the_limit_is_refused_unread() -> None:
    with pytest.raises(RecordError, match="longer than"):
        NodeReport.parse("X" * (MAX_TEXT + 1))
