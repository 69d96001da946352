"""pRealm: requests, tables, histories, watches, channels; and the records they travel in."""

from __future__ import annotations

import pytest
from app_harness import Harness
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.apps.realm import Realm, parse_scope_set
from pymoos_lite.apps.realm_table import TableStyle, shown_value, variable_table
from pymoos_lite.core.message import Message
from pymoos_lite.records.csp import RecordError
from pymoos_lite.records.realmcast import (
    RealmCast,
    RealmCastRequest,
    WatchCast,
    channels_text,
    parse_channels,
)


def realm(block: str | None = "", **options) -> Harness:
    harness = Harness(Realm, block, name="pRealm", **options)
    now = harness.host.clock.now()
    harness.home.database.connect("pA", now)
    harness.home.database.register("pA", "IN", now)
    harness.home.database.register("pA", "NEVER", now)
    return harness.post("OUT", 1.25, source="pA").post("IN", "hello", source="pB", aux="x").run(1)


def casts(harness: Harness) -> list[RealmCast]:
    return [RealmCast.parse(str(text)) for text in harness.values("REALMCAST")]


def rows(cast: RealmCast) -> list[list[str]]:
    return [line.split() for line in cast.lines if line]


def test_an_idle_realm_says_what_can_be_asked_for_and_nothing_else():
    harness = realm("hist_var = MODE\nscope_set = name=nav, vars=NAV_X:NAV_Y").run(30)
    assert harness.values("REALMCAST") == harness.values("WATCHCAST") == []
    assert (
        harness.values("REALMCAST_CHANNELS")[-1] == "node=abe#channels=MOOSDB_abe,pA,pRealm,watcher,MODE,nav"
    )
    assert len(harness.values("REALMCAST_CHANNELS")) < 10
    assert set(harness.app.connection.registered_names()) == {
        "REALMCAST_REQ", "DB_CLIENTS", "MODE", "NAV_X", "NAV_Y", "APPCAST_REQ", "LOADCAST_REQ",
    }  # fmt: skip


def test_a_new_app_is_a_new_channel_at_once_and_tools_are_none():
    harness = realm().run(70)
    for name in ("pNew", "uXMS_1", "pymoos_scope_9"):
        harness.home.database.connect(name, harness.host.clock.now())
    harness.run(3)
    assert harness.values("REALMCAST_CHANNELS")[-1] == "node=abe#channels=MOOSDB_abe,pA,pNew,pRealm,watcher,"


def test_a_channel_is_two_tables_of_what_the_app_hears_and_says():
    harness = realm().post("REALMCAST_REQ", "client=me,channel=pA,duration=10").run(5)
    (cast,) = casts(harness)
    assert (cast.node, cast.proc, cast.count) == ("abe", "pA", 1)
    table = rows(cast)
    assert ["IN", "pB:x", "0", "abe", "hello"] in table
    assert ["NEVER", "-", "never"] in table
    assert ["OUT", "pA", "0", "abe", "1.25"] in table
    assert table.index(["Subscriptions"]) < table.index(["Publications"])


def test_a_cast_is_repeated_when_something_changed_until_the_request_ends():
    harness = realm().post("REALMCAST_REQ", "client=me,channel=pA,duration=10").run(5)
    harness.post("OUT", 2.5, source="pA").run(3)
    assert [cast.count for cast in casts(harness)] == [1, 2]
    harness.run(5).post("OUT", 5.0, source="pA").run(60)
    assert len(casts(harness)) == 2
    assert harness.app.clients == {}
    assert "OUT" not in harness.app.connection.registered_names()


@pytest.mark.parametrize(
    ("words", "present", "absent"),
    [
        ("nosrc", "IN 0 abe hello", "pB:x"),
        ("nocom", "IN pB:x 0 hello", "abe"),
        ("nosubs", "Publications", "Subscriptions"),
        ("mask", "IN pB:x 0 abe hello", "NEVER"),
        ("utc", "IN pB:x 1767225600 abe hello", "IN pB:x 0"),
    ],
)
def test_words_of_the_request_shape_the_table(words, present, absent):
    harness = realm().post("REALMCAST_REQ", f"client=me,channel=pA,duration=10,{words}").run(5)
    text = "\n".join(" ".join(line.split()) for line in casts(harness)[0].lines)
    assert present in text
    assert absent not in text


def test_force_repeats_without_a_change():
    harness = realm().post("REALMCAST_REQ", "client=me,channel=pA,duration=5,force").run(5)
    assert len(casts(harness)) >= 4


def test_the_database_is_a_channel_too():
    harness = realm().post("REALMCAST_REQ", "client=me,channel=MOOSDB_abe,duration=5").run(5)
    assert any(row[0] == "DB_CLIENTS" for row in rows(casts(harness)[-1]))


def test_histories_keep_the_newest_posts_whether_or_not_anybody_asks():
    harness = realm("hist_var = MODE\nmsg_max_hist = 3\nscope_set = name=both, vars=MODE:X")
    for i in range(5):
        harness.post("MODE", f"m{i}").run(1)
    harness.post("X", 1.0).post("REALMCAST_REQ", "client=me,channel=MODE,duration=5").run(2)
    assert [row[-1] for row in rows(casts(harness)[0])[2:]] == ["m2", "m3", "m4"]
    harness.post("REALMCAST_REQ", "client=me,channel=both,duration=5").run(2)
    assert [row[0] for row in rows(casts(harness)[-1])[2:]] == ["MODE", "MODE", "X"]


def test_watched_variables_are_told_one_by_one_when_they_change():
    harness = realm().post("REALMCAST_REQ", "client=me,vars=OUT:IN:NOBODY,duration=20").run(3)
    told = [WatchCast.parse(str(text)) for text in harness.values("WATCHCAST")]
    assert [(t.variable, t.source, t.value) for t in told] == [
        ("OUT", "pA", 1.25), ("IN", "pB", "hello"), ("NOBODY", "n/a", "n/a"),
    ]  # fmt: skip
    assert told[2].local_time == -1.0
    harness.post("OUT", 2.0, source="pA").run(3)
    assert len(harness.values("WATCHCAST")) == 4


@pytest.mark.parametrize(
    "text",
    ["client=me,channel=pA", "channel=pA,duration=5", "client=me,duration=5", "client=me,channel=a,duration=5,loud",
     "client=me,channel=a,duration=0", "", "client=me,channel=a,duration=5,colour=red"],
)  # fmt: skip
def test_a_bad_request_is_a_run_warning_and_nothing_else(text):
    harness = realm().post("REALMCAST_REQ", text).run(3)
    assert list(harness.app.log.run_warnings) == [f"Bad RealmCastReq:{text}"]
    assert harness.values("REALMCAST") == []


def test_many_clients_are_bounded():
    harness = realm()
    for i in range(60):
        harness.post("REALMCAST_REQ", f"client=c{i},channel=pA,duration=10")
    assert len(harness.run(1).app.clients) == 50


def test_values_are_shown_on_one_line_and_long_reports_by_name_only():
    def shown(name, value):
        return shown_value(Message(name, value, 0.0, "x"))

    assert shown("A", 1.5) == "1.5"
    assert shown("A", b"\x00") == "binary"
    assert shown("A", "a\n b!Z!c") == "a b c"
    assert shown("APPCAST", "proc=x!@#") == "formatted report"
    assert shown("PA_STATUS", "Uptime=1,MOOSName=pA,Publishing=...") == "Uptime=1,"


def test_long_values_are_cut_or_wrapped_on_request():
    message = Message("A", "0123456789" * 3, 0.0, "x", "", "abe")
    assert variable_table("T", [("A", message)], TableStyle(trunc=10))[-2].endswith("  0123456789...")
    wrapped = variable_table("T", [("A", message)], TableStyle(wrap=10))
    assert [line.split()[-1] for line in wrapped[-4:-1]] == ["0123456789"] * 3


def test_scope_sets():
    assert parse_scope_set("name=nav, vars=A:B") == ("nav", ("A", "B"))
    for text in ("", "name=nav", "vars=A"):
        with pytest.raises(ValueError, match="expected"):
            parse_scope_set(text)


NAME = st.text(alphabet="ABCxyz_09", min_size=1, max_size=8)
WORDS = st.frozensets(st.sampled_from(["nosrc", "nocom", "nosubs", "mask", "wrap", "trunc", "utc", "force"]))


@given(NAME, NAME, st.integers(1, 100), st.lists(NAME, max_size=3), WORDS)
def test_requests_read_back(client, channel, duration, variables, words):
    request = RealmCastRequest(client, "" if variables else channel, float(duration), tuple(variables), words)
    assert RealmCastRequest.parse(request.to_text()) == request


@given(
    NAME,
    NAME,
    st.lists(st.text(alphabet="ab =,!#", max_size=8).filter(lambda t: "!Z!" not in t + "!"), max_size=4),
)
def test_casts_read_back(node, proc, lines):
    for count in (None, 7):
        cast = RealmCast(node, proc, tuple(lines), count)
        if "!Q!" not in cast.to_text().split("messages=", 1)[1] and not any(
            line.startswith("Z!") for line in lines
        ):
            assert RealmCast.parse(cast.to_text()) == cast


@given(
    NAME,
    NAME,
    st.one_of(st.integers(-100, 100).map(float), NAME.map(lambda t: "v" + t)),
    st.integers(0, 1000),
)
def test_watch_casts_read_back(node, variable, value, time):
    cast = WatchCast(node, variable, "src", "abe", float(time), 2.0 * time, value)
    assert WatchCast.parse(cast.to_text()) == cast


def test_channels_read_back():
    text = channels_text("abe", ["pB", "pA"], [])
    assert text == "node=abe#channels=pA,pB,"
    assert parse_channels(text) == ("abe", ["pA", "pB"])


@given(st.text(max_size=60))
def test_no_text_raises_anything_but_a_record_error(text):
    for parse in (RealmCastRequest.parse, RealmCast.parse, WatchCast.parse, parse_channels):
        try:
            parse(text)
        except RecordError as refusal:
            assert "\n" not in str(refusal)
