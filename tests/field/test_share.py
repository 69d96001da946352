"""pShare between communities in lockstep: routes at run time, guards, and what is counted."""

import pytest
from fleet_fixture import Fleet, Listener, Talker

from pymoos_lite.core.message import Message
from pymoos_lite.field.datagrams import message_size
from pymoos_lite.field.share import ShareApp
from pymoos_lite.hosts.network import Conditions


@pytest.fixture(params=[True, False], ids=["by reference", "as bytes"])
def fleet(request):
    return Fleet(by_reference=request.param)


def pair(fleet, abe=(), ben=(), hear=("*",)):
    one = fleet.app("abe", ShareApp, "pShare", ("input", "route=localhost:9201"), *abe)
    other = fleet.app("ben", ShareApp, "pShare", ("input", "route=localhost:9202"), *ben)
    listener = fleet.app("ben", Listener, "listener", *(("hear", name) for name in hear))
    return one, other, listener


def test_a_message_keeps_its_source_community_time_and_aux(fleet):
    _, _, ben = pair(fleet, abe=[("output", "src_name=X,dest_name=Y,route=localhost:9202")])
    fleet.run(1)
    original = Message("X", "text", fleet.host.clock.now() - 5.0, "pSomething", "12:bhv", "abe")
    fleet.host.communities["abe"].database.publish("x", original, fleet.host.clock.now())
    fleet.run(1)
    assert [m for m in ben.heard if m.name == "Y"] == [original._replace(name="Y")]


def test_numbers_text_and_bytes_arrive_as_what_they_were(fleet):
    _, _, ben = pair(fleet, abe=[("output", "src_name=V*,route=localhost:9202")])
    for name, value in (("V1", 2.5), ("V2", "2.5"), ("V3", b"\x00\xff")):
        fleet.get("abe", "pShare").notify(name, value)
    fleet.run(1)
    assert {m.name: m.value for m in ben.heard if m.name[0] == "V"} == {
        "V1": 2.5,
        "V2": "2.5",
        "V3": b"\x00\xff",
    }


def test_mail_is_shared_at_once_and_not_at_the_next_tick(fleet):
    _, _, ben = pair(fleet, abe=[("output", "src_name=X,route=localhost:9202"), ("AppTick", "0.1")])
    fleet.run(3.3)
    fleet.post("abe", "X", 1.0)
    fleet.run(0.1)
    fleet.app("ben", Listener, "second", ("hear", "X"))
    fleet.run(0.3)
    assert [m.value for m in ben.heard if m.name == "X"] == [1.0]


def test_routes_come_and_go_by_command(fleet):
    one, _, ben = pair(fleet)
    fleet.run(1)
    fleet.post("abe", "PSHARE_CMD", "cmd=output,src_name=X,dest_name=Y,route=localhost:9202")
    fleet.run(1)
    fleet.post("abe", "X", 1.0)
    fleet.run(1)
    assert ben.values("Y") == [1.0]
    assert fleet.value("abe", "PSHARE_OUTPUT_SUMMARY") == "X->Y:localhost:9202"
    fleet.post("abe", "PSHARE_CMD", "cmd=remove,src_name=X,dest_name=Y,route=localhost:9202")
    fleet.run(2)
    fleet.post("abe", "X", 2.0)
    fleet.run(1)
    assert ben.values("Y") == [1.0]
    assert fleet.value("abe", "PSHARE_OUTPUT_SUMMARY") == ""
    assert one.destinations == {}
    fleet.post("abe", "PSHARE_CMD", "cmd=input,route=localhost:9333")
    fleet.run(2)
    assert fleet.value("abe", "PSHARE_INPUT_SUMMARY") == "localhost:9201,localhost:9333"


def test_a_command_that_makes_no_sense_is_warned_of_and_counted(fleet):
    one, _, _ = pair(fleet)
    fleet.run(1)
    bad = (
        "",
        "cmd=output",
        "cmd=output,src_name=X,route=nowhere:1",
        "cmd=input,route=localhost:9201",
        "x" * 5000,
    )
    for text in bad:
        fleet.post("abe", "PSHARE_CMD", text)
    fleet.run(1)
    assert one.drops.commands == len(bad)
    assert len(one.log.run_warnings) == len(bad)
    assert f"{len(bad)}  commands not understood" in "\n".join(one.report())


def test_a_command_older_than_the_share_is_left_to_those_who_repeat_it(fleet):
    fleet.app("abe", Listener, "listener")
    fleet.post("abe", "PSHARE_CMD", "cmd=output,src_name=X,route=localhost:9202")
    fleet.run(5)
    one, _, _ = pair(fleet)
    fleet.run(2)
    assert fleet.value("abe", "PSHARE_OUTPUT_SUMMARY") == ""
    assert one.drops.commands == 0


def test_duration_zero_sends_the_current_value_once_each_time_it_is_asked_for(fleet):
    _, _, ben = pair(fleet)
    fleet.post("abe", "X", 1.0)
    fleet.run(1)
    command = "cmd=output,src_name=X,route=localhost:9202,duration=0"
    for _ in range(2):
        fleet.post("abe", "PSHARE_CMD", command)
        fleet.run(1)
    fleet.post("abe", "X", 2.0)
    fleet.run(1)
    assert ben.values("X") == [1.0, 1.0]
    fleet.post("abe", "PSHARE_CMD", command)
    fleet.run(1)
    assert ben.values("X") == [1.0, 1.0, 2.0]


def test_a_variable_shared_out_under_its_own_name_is_not_taken_in(fleet):
    one, _, _ = pair(
        fleet,
        abe=[("output", "src_name=X,route=localhost:9202")],
        ben=[("output", "src_name=X,route=localhost:9201")],
    )
    fleet.run(1)
    fleet.post("abe", "X", 1.0)
    fleet.run(5)
    assert fleet.value("ben", "X") is None
    assert fleet.get("ben", "pShare").drops.looped == 1
    assert one.drops.looped == 0


def test_two_communities_that_share_everything_do_not_play_ball(fleet):
    one, other, ben = pair(
        fleet,
        abe=[("output", "src_name=*,route=localhost:9202")],
        ben=[("output", "src_name=*,route=localhost:9201")],
    )
    fleet.run(5)
    fleet.post("abe", "X", 1.0)
    fleet.run(10)
    assert ben.values("X") == [1.0]
    assert fleet.host.communities["abe"].database.get("X").community == "abe"
    assert one.table.find(Message("X", 1.0, 0.0, "a", "", "abe"), 0.0)[0].shares == 1
    assert other.drops.echoed > 0
    sent = fleet.host.network.total().sent
    fleet.run(10)
    assert fleet.host.network.total().sent - sent < 200


def test_a_white_list_lets_in_what_it_names(fleet):
    fleet.app("abe", ShareApp, "pShare", ("output", "src_name=*,route=localhost:9202"))
    other = fleet.app("ben", ShareApp, "pShare", ("input", "route=localhost:9202,white_list=A&B_*"))
    for name in ("A", "B_1", "C", "AB"):
        fleet.post("abe", name, 1.0)
    fleet.run(2)
    known = fleet.host.communities["ben"].database
    assert [known.get(n) is not None for n in ("A", "B_1", "C", "AB")] == [True, True, False, False]
    assert other.inputs[0].filtered >= 2


def test_only_addresses_that_are_allowed_are_heard(fleet):
    fleet.host.network.move("eve", "10.0.0.66")
    fleet.host.network.move("abe", "10.0.0.1")
    other = fleet.app(
        "ben", ShareApp, "pShare", ("input", "route=localhost:9202"), ("allow_from", "10.0.0.1 & 10.1.*")
    )
    fleet.host.network.move("ben", "10.0.0.2")
    for name in ("abe", "eve"):
        fleet.app(
            name, ShareApp, "pShare", ("output", f"src_name=X,dest_name=FROM_{name},route=10.0.0.2:9202")
        )
        fleet.post(name, "X", 1.0)
    fleet.run(1)
    assert fleet.value("ben", "FROM_abe") == 1.0
    assert fleet.value("ben", "FROM_eve") is None
    assert other.drops.strangers == 1


def test_with_a_key_only_those_who_know_it_are_heard():
    fleet = Fleet()
    for name, phrase in (("abe", "lobster"), ("eve", "crab"), ("bob", "")):
        route = f"src_name=X,dest_name=FROM_{name},route=localhost:9202"
        fleet.app(name, ShareApp, "pShare", ("output", route), ("share_key", phrase))
        fleet.post(name, "X", 1.0)
    ben = fleet.app("ben", ShareApp, "pShare", ("input", "route=localhost:9202"), ("share_key", "lobster"))
    fleet.run(1)
    found = {name: fleet.value("ben", f"FROM_{name}") for name in ("abe", "eve", "bob")}
    assert found == {"abe": 1.0, "eve": None, "bob": None}
    assert {fault.name: n for fault, n in ben.inbox.faults.items()} == {"BAD_SEAL": 1, "UNSEALED": 1}


def test_long_lists_arrive_whole_and_too_long_ones_are_counted(fleet):
    one, _, ben = pair(
        fleet,
        abe=[("output", "src_name=VIEW_*,route=localhost:9202"), ("max_message_bytes", "60000")],
        hear=["VIEW_*"],
    )
    grid = "psg@" + ":".join(f"{i},0,{i}" for i in range(4000))
    assert 30_000 < len(grid) < 60_000
    one.notify("VIEW_GRID", grid)
    one.notify("VIEW_BIG", "x" * 60_001)
    fleet.run(1)
    assert [m.value for m in ben.heard] == [grid]
    assert one.drops.oversized == 1
    assert any("VIEW_BIG" in w for w in one.log.run_warnings)
    assert fleet.host.network.total().sent > 25


def test_a_long_message_is_lost_with_any_of_its_fragments(fleet):
    pair(fleet, abe=[("output", "src_name=*,route=localhost:9202")], hear=["LONG", "SHORT"])
    fleet.host.network.set_conditions(Conditions(loss=0.1))
    share = fleet.get("abe", "pShare")
    for _ in range(300):
        share.notify("LONG", "x" * 10_000)
        share.notify("SHORT", 1.0)
        fleet.run(0.25)
    ben = fleet.get("ben", "listener")
    assert 0.84 < len(ben.values("SHORT")) / 300 < 0.95
    assert 0.3 < len(ben.values("LONG")) / 300 < 0.56  # 0.9 to the power of 8


def test_a_port_that_is_taken_is_tried_again_until_it_is_free(fleet):
    first = fleet.app("abe", ShareApp, "pShare", ("input", "route=localhost:9201"))
    second = fleet.app("ben", ShareApp, "pShare", ("input", "route=localhost:9201"))
    assert second.log.run_warnings
    assert first.inputs[0].port is not None
    fleet.run(7)
    assert second.inputs[0].port is None
    fleet.host.end_app("abe", "pShare")
    fleet.run(6)
    assert second.inputs[0].port is not None
    assert not second.log.run_warnings
    assert fleet.value("ben", "PSHARE_INPUT_SUMMARY") == "localhost:9201"


def test_multicast_reaches_everybody_who_listens_but_the_sender(fleet):
    for name in ("abe", "ben", "cal"):
        pairs = [("input", "route=multicast_8")] if name != "cal" else []
        fleet.app(name, ShareApp, "pShare", ("output", "src_name=X,dest_name=Y,route=multicast_8"), *pairs)
    fleet.app("dan", ShareApp, "pShare", ("input", "route=multicast_8"))
    fleet.run(1)
    fleet.post("abe", "X", 4.0)
    fleet.run(1)
    assert [fleet.value(name, "Y") for name in ("abe", "ben", "cal", "dan")] == [None, 4.0, None, 4.0]
    assert fleet.value("ben", "PSHARE_INPUT_SUMMARY") == "224.1.1.11:24468:multicast_8"


def test_faulty_lines_are_configuration_warnings_with_their_line():
    fleet = Fleet()
    one = fleet.app(
        "abe", ShareApp, "pShare", ("input", "localhost"), ("output", "src_name=X"), ("outptu", "X")
    )
    assert [w.split(":")[1] for w in one.log.config_warnings] == ["1", "2", "3"]


def test_the_report_shows_traffic_in_both_directions(fleet):
    one, other, _ = pair(fleet, abe=[("output", "src_name=COUNT,route=localhost:9202,frequency=1")])
    fleet.app("abe", Talker, "talker")
    fleet.run(10)
    sent, heard = "\n".join(one.report()), "\n".join(other.report())
    each = message_size(Message("COUNT", 1.0, 0.0, "talker", "", "abe"))
    assert f"COUNT -> COUNT:localhost:9202  10 sent, {10 * each} bytes, 10 held back" in sent
    assert "abe 127.0.0.1:9201" in heard
