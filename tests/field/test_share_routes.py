"""The grammar of routes, wildcards, aliases and limits (native_wire.md 3)."""

import contextlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoos_lite.core.message import Message
from pymoos_lite.field.routes import (
    Channels,
    Endpoint,
    OutputTable,
    RouteError,
    Share,
    parse_command,
    parse_endpoint,
    parse_input,
    parse_input_summary,
    parse_output,
    parse_output_fields,
    parse_output_summary,
    renamed,
)

CHANNELS = Channels()
SHORE = Endpoint("localhost", 9200)
EIGHT = Endpoint("224.1.1.11", 24468, 8)


def note(name, now=0.0, source="app", value=1.0):
    return Message(name, value, now, source, "", "abe")


@pytest.mark.parametrize(
    ("text", "shares"),
    [
        ("src_name=X, dest_name=Y, route=localhost:9200", [Share("X", "Y", SHORE)]),
        ("src_name = X, route = localhost:9200", [Share("X", None, SHORE)]),
        ("route=localhost:9200&multicast_8,src_name=X", [Share("X", None, SHORE), Share("X", None, EIGHT)]),
        ("src_name=X,route=localhost:9200,frequency=2,duration=30,max_shares=5",
            [Share("X", None, SHORE, 2.0, 30.0, 5)]),
        ("src_name=X,route=localhost:9200,duration=0", [Share("X", None, SHORE, 0.0, 0.0)]),
        ("src_name=X,route=localhost:9200,duration=-1,max_shares=-1", [Share("X", None, SHORE)]),
        ("X -> localhost:9200", [Share("X", None, SHORE)]),
        ("X->Y:localhost:9200", [Share("X", "Y", SHORE)]),
        ("X->Y:localhost:9200@2.5 & multicast_8", [Share("X", "Y", SHORE, 2.5), Share("X", None, EIGHT)]),
        ("X->Y:multicast_0@1", [Share("X", "Y", Endpoint("224.1.1.11", 24460, 0), 1.0)]),
        ("src_name=VAR_*:pHelm*,route=localhost:9200", [Share("VAR_*:pHelm*", None, SHORE)]),
    ],
)  # fmt: skip
def test_an_output_line_is_read_in_its_long_and_its_short_form(text, shares):
    assert parse_output(text, CHANNELS) == shares


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("route=localhost:9200", "src_name is missing"),
        ("src_name=X", "expected src_name"),
        ("src_name=X,route=", "route is missing"),
        ("src_name=X,route=localhost", "no route"),
        ("src_name=X,route=localhost:99999", "1..65535"),
        ("src_name=X,route=localhost:0", "1..65535"),
        ("src_name=X,route=localhost:9200,frequency=fast", "frequency=fast"),
        ("src_name=X,route=loc al;host:9200", "no route"),
        ("X->localhost", "expected"),
        ("->localhost:9200", "expected"),
        ("X", "expected"),
    ],
)
def test_a_faulty_output_line_says_what_is_wrong(text, part):
    with pytest.raises(RouteError, match=part):
        parse_output(text, CHANNELS)


def test_multicast_channels_follow_the_configured_group():
    assert parse_endpoint("multicast_3", Channels("239.0.0.1", 30000)) == Endpoint("239.0.0.1", 30003, 3)


def test_an_input_line_has_routes_and_a_white_list():
    found = parse_input("route = localhost:9200 & multicast_8, white_list = DEPLOY & NODE_*", CHANNELS)
    assert [str(at) for at in found.at] == ["localhost:9200", "224.1.1.11:24468:multicast_8"]
    assert found.white_list == ("DEPLOY", "NODE_*")


def test_commands_are_read_in_any_order_and_case():
    verb, values = parse_command("route=localhost:9200, CMD=Output, src_name=X")
    assert verb == "output"
    assert parse_output_fields(values, CHANNELS) == [Share("X", None, SHORE)]
    for text in ("cmd=destroy,src_name=X", "src_name=X", "", "cmd=output,junk"):
        with pytest.raises(RouteError):
            parse_command(text)


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=60))
def test_any_text_is_a_command_or_a_route_error(text):
    with contextlib.suppress(RouteError):
        verb, values = parse_command(text)
        assert verb in ("input", "output", "remove")
        assert all(isinstance(share, Share) for share in parse_output_fields(values, CHANNELS))
    with contextlib.suppress(RouteError):
        assert all(share.source for share in parse_output(text, CHANNELS))


@pytest.mark.parametrize(
    ("pattern", "alias", "name", "sent"),
    [
        ("FX_*", None, "FX_1", "FX_1"),
        ("FX_*", "*", "FX_1", "FX_1"),
        ("FX_*", "pre_", "FX_1", "pre_FX_1"),
        ("CAR_*", "^", "CAR_SPEED", "SPEED"),
        ("*_X", "^", "A_X", "A"),
        ("CAR_*", "^", "CAR_", "CAR_"),
        ("A?_*", "^", "AB_C", "AB_C"),
    ],
)
def test_wildcard_shares_are_renamed_as_the_reference_does(pattern, alias, name, sent):
    assert renamed(Share(pattern, alias, SHORE), name) == sent
    table = OutputTable()
    table.add(Share(pattern, alias, SHORE), 0.0)
    if name != "CAR_":
        assert [o.name for o in table.find(note(name), 0.0)] == [sent]


def sent_times(share, posts):
    table = OutputTable()
    table.add(share, 0.0)
    sent = []
    for now in posts:
        for output in table.find(note("X", now), now):
            if output.wants(now):
                output.sent(now)
                sent.append(now)
    return sent


def test_frequency_duration_and_count_limit_a_route():
    posts = [i * 0.05 for i in range(30)]
    assert len(sent_times(Share("X", None, SHORE, frequency=2.0), posts)) == 3
    assert len(sent_times(Share("X", None, SHORE, max_shares=4), posts)) == 4
    assert sent_times(Share("X", None, SHORE, duration=0.5), posts)[-1] == pytest.approx(0.5)
    assert sent_times(Share("X", None, SHORE, duration=0.0), posts) == [0.0]


def test_a_source_at_exactly_the_allowed_rate_loses_nothing():
    start = 1767225600.0
    assert (
        len(sent_times(Share("X", None, SHORE, frequency=10.0), [start + i / 10 for i in range(100)])) == 100
    )


def test_restating_a_route_replaces_it_and_restarts_its_limits():
    table = OutputTable()
    table.add(Share("X", "Y", SHORE, max_shares=1), 0.0)
    (output,) = table.find(note("X"), 0.0)
    output.sent(0.0)
    assert not output.wants(1.0)
    table.add(Share("X", "Y", SHORE, max_shares=1), 1.0)
    (output,) = table.find(note("X"), 1.0)
    assert output.wants(1.0)
    assert table.summary() == "X->Y:localhost:9200"


def test_localhost_and_its_number_are_two_routes():
    table = OutputTable()
    for host in ("localhost", "127.0.0.1"):
        table.add(Share("X", None, Endpoint(host, 9200)), 0.0)
    assert len(table.find(note("X"), 0.0)) == 2


def test_a_variable_with_its_own_route_is_not_tested_against_wildcards():
    table = OutputTable()
    table.add(Share("NAV_*", None, SHORE), 0.0)
    table.add(Share("NAV_X", "EAST", SHORE), 0.0)
    assert [o.name for o in table.find(note("NAV_X"), 0.0)] == ["EAST"]
    assert [o.name for o in table.find(note("NAV_Y"), 0.0)] == ["NAV_Y"]


def test_two_wildcards_are_both_tested_with_the_original_name():
    table = OutputTable()
    table.add(Share("NAV_*", "A_", SHORE), 0.0)
    table.add(Share("*_X", "B_", Endpoint("localhost", 9300)), 0.0)
    assert [o.name for o in table.find(note("NAV_X"), 0.0)] == ["A_NAV_X", "B_NAV_X"]


def test_a_pattern_over_the_app_is_honoured():
    table = OutputTable()
    table.add(Share("*:pHelm*", None, SHORE), 0.0)
    assert table.find(note("X", source="pNode"), 0.0) == []
    assert len(table.find(note("X", source="pHelmIvP"), 0.0)) == 1


def test_summaries_are_written_and_read_as_the_reference_does():
    table = OutputTable()
    table.add(Share("MC", None, CHANNELS.endpoint(8)), 0.0)
    table.add(Share("DEPLOY_ALL", "DEPLOY", Endpoint("localhost", 9201)), 0.0)
    table.add(Share("DEPLOY_ALL", "DEPLOY", Endpoint("localhost", 9202)), 0.0)
    table.add(Share("W*", None, SHORE), 0.0)
    text = table.summary()
    assert text == (
        "DEPLOY_ALL->DEPLOY:localhost:9201 & DEPLOY:localhost:9202, MC->MC:224.1.1.11:24468:multicast_8"
    )
    assert parse_output_summary(text) == {
        ("DEPLOY_ALL", "DEPLOY", "localhost:9201"),
        ("DEPLOY_ALL", "DEPLOY", "localhost:9202"),
        ("MC", "MC", "224.1.1.11:24468:multicast_8"),
    }
    table.find(note("WX"), 0.0)
    assert "WX->WX:localhost:9200" in table.summary()
    assert parse_input_summary("localhost:9313,224.1.1.11:24468:multicast_8,junk") == [
        "localhost:9313",
        "multicast_8",
    ]


def test_removing_a_route_ends_it_and_its_loop_guard():
    table = OutputTable()
    table.add(Share("X", None, SHORE), 0.0)
    table.add(Share("X", "Y", SHORE), 0.0)
    assert table.is_plain("X")
    assert table.remove(Share("X", "X", SHORE)) == 1
    assert [o.name for o in table.find(note("X"), 0.0)] == ["Y"]
    assert table.remove(Share("X", "Y", SHORE)) == 1
    assert not table.is_plain("X")
    assert table.summary() == ""
