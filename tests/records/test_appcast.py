"""community.md 10: APPCAST lines and the requests for them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.records.appcast import AppCast, AppCastRequest, LoadCastRequest
from pymoos_lite.records.csp import RecordError

line = st.text(alphabet="ab 1:=!@#-", max_size=20)
clean = line.filter(lambda s: "!@" not in s and not s.startswith("#"))
word = st.text(alphabet="abcXYZ_0", min_size=1, max_size=8)

casts = st.builds(
    AppCast,
    proc=word,
    iteration=st.integers(0, 10**9),
    node=word | st.just(""),
    messages=st.lists(clean, max_size=5).map(tuple),
    config_warnings=st.lists(clean.filter(bool), max_size=3).map(tuple),
    events=st.lists(clean.filter(bool), max_size=3).map(tuple),
    events_total=st.integers(0, 999),
    run_warnings=st.lists(st.tuples(clean, st.integers(0, 99)), max_size=3).map(tuple),
    run_warning_total=st.integers(0, 999),
)


def test_the_line_has_the_stock_layout_with_iter_twice_and_empty_lists_as_bare_separators() -> None:
    cast = AppCast("pHelmIvP", 12, "alpha", ("one", "  two"), events=("[1.00]: go",), events_total=1)
    assert cast.to_text() == (
        "proc=pHelmIvP!@#iter=12!@#node=alpha!@#iter=12!@#messages=one!@  two!@!@#!@#events_total=1!@#"
        "events=[1.00]: go!@#run_warning_total=0!@#"
    )
    full = AppCast("p", 1, "", (), ("w1", "w2"), (), 0, (("bad", 3), ("worse", 1)), 4)
    assert full.to_text() == (
        "proc=p!@#iter=1!@#iter=1!@#messages=!@#config_warnings=w1!@w2!@#events_total=0!@#!@#"
        "run_warning_total=4!@#run_warnings=3:bad!@1:worse"
    )


@given(casts)
def test_any_appcast_reads_back_from_its_line(cast: AppCast) -> None:
    text = cast.to_text()
    assert "\n" not in text
    assert AppCast.parse(text) == cast


@given(st.lists(line, max_size=5))
def test_separators_inside_lines_change_the_line_but_never_the_number_of_lines(lines: list[str]) -> None:
    cast = AppCast("p", 1, "n", tuple(lines), events=("e",), events_total=1)
    back = AppCast.parse(cast.to_text())
    assert len(back.messages) == len(lines)
    assert (back.node, back.events, back.events_total) == ("n", ("e",), 1)


def test_line_breaks_become_lines_of_the_body() -> None:
    assert AppCast.parse(AppCast("p", messages=("a\nb",)).to_text()).messages == ("a", "b")


@given(st.text(alphabet="proc=iter!@#19x: ", max_size=80) | st.text(max_size=60))
def test_hostile_text_gives_an_appcast_or_a_record_error(text: str) -> None:
    for candidate in (text, "proc=x!@#" + text):
        try:
            cast = AppCast.parse(candidate)
        except RecordError:
            continue
        assert AppCast.parse(cast.to_text()).proc


def test_the_page_is_62_columns_wide_with_events_newest_first() -> None:
    cast = AppCast("pHelm", 7, "abe", ("body",), ("cw",), ("[1.00]: a", "[2.00]: b"), 2, (("rw", 3),), 3)
    page = cast.to_terminal().split("\n")
    assert page[0] == page[2] == "=" * 62
    assert page[1].startswith("pHelm abe ")
    assert page[1].endswith("1/3(7)")
    assert len(page[1]) == 62
    assert page[3:5] == ["Configuration Warnings: 1", " [1 of 1]: cw"]
    assert " [3]: rw" in page
    assert page[-4:] == ["Most Recent Events (2):", "=" * 67, "[2.00]: b", "[1.00]: a"]


def test_a_request_prints_as_the_stock_tools_send_it() -> None:
    text = "node=abe,app=pHelmIvP,duration=3.0,key=pMarineViewer:shoresideapp,thresh=any"
    request = AppCastRequest.parse(text)
    assert request.to_text() == text
    assert request.asks("abe", "pHelmIvP")
    assert not request.asks("ben", "pHelmIvP")
    assert AppCastRequest("all", "all", 1.0, "k").asks("ben", "x")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("node=a,app=b,duration=3", "no key"),
        ("key=k,duration=x", "duration"),
        ("key=k,thresh=often", "thresh"),
    ],
)
def test_a_request_without_key_or_with_bad_values_is_refused(text: str, reason: str) -> None:
    with pytest.raises(RecordError, match=reason):
        AppCastRequest.parse(text)


def test_durations_are_clamped_to_half_a_minute() -> None:
    assert AppCastRequest.parse("node=a,app=b,duration=99,key=k").duration == 30.0
    assert LoadCastRequest.parse("app=b,duration=-1").duration == 0.0


@given(word, word, st.integers(0, 30000), word, st.sampled_from(["any", "run_warning"]))
def test_requests_read_back_from_their_text(node: str, app: str, ms: int, key: str, thresh: str) -> None:
    request = AppCastRequest(node, app, ms / 1000, key, thresh)
    assert AppCastRequest.parse(request.to_text()) == request
    load = LoadCastRequest(app, ms / 1000, thresh)
    assert LoadCastRequest.parse(load.to_text()) == load
    assert load.asks(app)
    assert LoadCastRequest("any", 1.0).asks("whatever")
