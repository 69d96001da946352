"""Vehicles and shoreside find each other, in any order and through restarts, losses and moves."""

from itertools import permutations

import pytest
from fleet_fixture import Fleet

from pymoos_lite.hosts.network import Conditions


def fresh(listener, name, after):
    """Values of `name` posted after mission time `after`."""
    return [m.value for m in listener.heard if m.name == name and m.time > after]


def all_bridged(fleet, shore, vehicles, seconds):
    """Run, post one command of each class, and say what did not arrive where it should."""
    fleet.run(seconds)
    since = fleet.host.clock.now()
    fleet.post("shoreside", "DEPLOY_ALL", f"go{since}")
    for name, _ in vehicles:
        fleet.post("shoreside", f"RETURN_{name.upper()}", f"{name}{since}")
        fleet.post("shoreside", f"LOW_{name}", 7.0)
    fleet.run(3.0)
    missing = []
    for name, listener in vehicles:
        for variable, value in (("DEPLOY", f"go{since}"), ("RETURN", f"{name}{since}"), ("LOW", 7.0)):
            if fresh(listener, variable, since - 1e-6) != [value]:
                missing.append((name, variable, fresh(listener, variable, since - 1e-6)))
        for variable in ("REPORT", "COUNT"):
            heard = [m for m in shore.heard if m.name == variable and m.community == name and m.time > since]
            if len(heard) < 4:
                missing.append((name, variable, len(heard)))
    return missing


@pytest.mark.parametrize("order", list(permutations(["shoreside", "abe", "ben"])))
@pytest.mark.parametrize("gap", [0.0, 7.3])
def test_bridges_come_up_within_seconds_in_any_order_of_starting(order, gap):
    fleet = Fleet()
    ports = {"abe": 9201, "ben": 9202}
    made = {}
    for name in order:
        made[name] = fleet.shore() if name == "shoreside" else fleet.vehicle(name, ports[name])
        fleet.run(gap)
    vehicles = [(name, made[name]) for name in ports]
    assert all_bridged(fleet, made["shoreside"], vehicles, 8.0) == []


def test_a_restarted_shoreside_is_found_again_within_seconds():
    fleet = Fleet()
    fleet.shore()
    abe = fleet.vehicle("abe", 9201)
    fleet.run(20)
    fleet.host.kill("shoreside")
    fleet.run(13)
    shore = fleet.shore()
    assert all_bridged(fleet, shore, [("abe", abe)], 8.0) == []


def test_a_restarted_vehicle_is_bridged_again_within_seconds():
    fleet = Fleet()
    shore = fleet.shore()
    fleet.vehicle("abe", 9201)
    ben = fleet.vehicle("ben", 9202)
    fleet.run(20)
    fleet.host.kill("abe")
    fleet.run(9)
    abe = fleet.vehicle("abe", 9201)
    assert all_bridged(fleet, shore, [("abe", abe), ("ben", ben)], 8.0) == []


def test_a_vehicle_back_at_another_port_is_served_there_and_no_longer_at_the_old_one():
    fleet = Fleet()
    shore = fleet.shore()
    fleet.vehicle("abe", 9201)
    fleet.run(20)
    fleet.host.kill("abe")
    abe = fleet.vehicle("abe", 9231)
    assert all_bridged(fleet, shore, [("abe", abe)], 8.0) == []
    assert "9201" not in fleet.value("shoreside", "PSHARE_OUTPUT_SUMMARY")


def test_a_vehicle_that_changes_its_address_while_sailing_is_followed():
    fleet = Fleet()
    shore = fleet.shore()
    fleet.host.network.move("shoreside", "10.0.0.1")
    fleet.host.network.move("abe", "10.0.0.7")
    abe = fleet.vehicle("abe", 9201, shore="10.0.0.1:9200")
    fleet.run(20)
    assert "10.0.0.7:9201" in fleet.value("shoreside", "PSHARE_OUTPUT_SUMMARY")
    fleet.host.network.move("abe", "10.0.0.8")
    assert all_bridged(fleet, shore, [("abe", abe)], 13.0) == []
    assert "10.0.0.7" not in fleet.value("shoreside", "PSHARE_OUTPUT_SUMMARY")


def test_commands_for_a_vehicle_that_left_do_not_reach_the_one_that_took_its_place():
    fleet = Fleet()
    fleet.shore()
    fleet.vehicle("abe", 9201)
    fleet.run(10)
    fleet.host.kill("abe")
    ben = fleet.vehicle("ben", 9201)
    fleet.run(10)
    fleet.post("shoreside", "RETURN_ABE", "for abe")
    fleet.post("shoreside", "RETURN_BEN", "for ben")
    fleet.run(2)
    assert ben.values("RETURN") == ["for ben"]


@pytest.mark.parametrize("community", ["abe", "shoreside"])
def test_a_share_that_restarts_alone_is_given_its_routes_again(community):
    from pymoos_lite.field.share import ShareApp

    fleet = Fleet()
    shore = fleet.shore()
    abe = fleet.vehicle("abe", 9201)
    fleet.run(20)
    home = fleet.host.communities[community]
    runner = next(r for r in home.runners if r.name == "pShare")
    fleet.host.end_app(community, "pShare")
    assert runner not in home.runners
    fleet.run(5)
    port = 9200 if community == "shoreside" else 9201
    fleet.app(community, ShareApp, "pShare", ("input", f"route=localhost:{port}"))
    assert all_bridged(fleet, shore, [("abe", abe)], 8.0) == []


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("by_reference", [True, False])
def test_with_a_fifth_lost_and_a_second_of_delay_everything_is_bridged(seed, by_reference):
    fleet = Fleet(seed, by_reference)
    fleet.host.network.set_conditions(Conditions(latency=1.0, jitter=0.3, loss=0.2))
    shore = fleet.shore()
    vehicles = [(name, fleet.vehicle(name, 9201 + i)) for i, name in enumerate(("abe", "ben", "cal"))]
    fleet.run(40)
    wanted = fleet.get("shoreside", "uFldShoreBroker")
    assert wanted._routes.missing() == []
    for name, _ in vehicles:
        assert fleet.get(name, "uFldNodeBroker")._routes.missing() == []
    since = fleet.host.clock.now()
    for _ in range(50):
        fleet.post("shoreside", "DEPLOY_ALL", "true")
        fleet.run(1)
    for name, listener in vehicles:
        assert 28 <= len(fresh(listener, "DEPLOY", since - 1e-6)) <= 48
        heard = [m for m in shore.heard if m.name == "COUNT" and m.community == name and m.time > since]
        assert 65 <= len(heard) <= 95
    total = fleet.host.network.total()
    assert total.lost > 100
    assert total.sent == total.delivered + total.lost + len(fleet.host.network.in_flight)
    counted = sum(
        stream.lost
        for name in ("shoreside", "abe", "ben", "cal")
        for stream in fleet.get(name, "pShare").inbox.streams.values()
    )
    # What the receivers miss is what the network lost, but for the first and last of each stream.
    assert 0.9 * total.lost - 20 <= counted <= total.lost


def test_a_vehicle_at_another_time_warp_or_without_the_keyword_is_told_so_and_not_bridged():
    fleet = Fleet()
    fleet.shore(("qbridge", "DEPLOY"), ("keyword", "lobster"))
    abe = fleet.vehicle("abe", 9201)
    broker = (("bridge", "src=COUNT"), ("keyword", "lobster"))
    ben = fleet.vehicle("ben", 9202, *broker)
    fleet.run(10)
    fleet.post("shoreside", "DEPLOY_ALL", "true")
    fleet.run(3)
    assert ben.values("DEPLOY") == ["true"]
    assert abe.values("DEPLOY") == []
    assert "shoreside says: keyword_mismatch" in fleet.get("abe", "uFldNodeBroker").log.run_warnings
    assert "abe: keyword_mismatch" in fleet.get("shoreside", "uFldShoreBroker").log.run_warnings


def test_a_shoreside_that_is_told_where_a_vehicle_listens_introduces_itself():
    fleet = Fleet()
    fleet.shore(("qbridge", "DEPLOY"), ("try_vnode", "route=localhost:9201"))
    abe = fleet.vehicle("abe", 9201, shore="localhost:9777")
    fleet.run(25)
    fleet.post("shoreside", "DEPLOY_ALL", "true")
    fleet.run(2)
    assert abe.values("DEPLOY") == ["true"]
    assert [s.route for s in fleet.get("abe", "uFldNodeBroker").shores] == [
        "localhost:9777",
        "localhost:9200",
    ]


def test_two_shoresides_are_both_served():
    fleet = Fleet()
    shore = fleet.shore()
    second = fleet.app("backup", *_share(9300))
    del second
    from fleet_fixture import Listener

    from pymoos_lite.field.host_info import HostInfo
    from pymoos_lite.field.shore_broker import ShoreBroker

    fleet.app("backup", HostInfo, "pHostInfo")
    fleet.app("backup", ShoreBroker, "uFldShoreBroker", ("qbridge", "DEPLOY"))
    other = fleet.app("backup", Listener, "listener", ("hear", "COUNT"))
    broker = (("bridge", "src=COUNT"), ("try_shore_host", "pshare_route=localhost:9300"))
    abe = fleet.vehicle("abe", 9201, *broker)
    fleet.run(15)
    assert len(shore.values("COUNT")) > 15
    assert len(other.values("COUNT")) > 15
    fleet.post("backup", "DEPLOY_ABE", "from the backup")
    fleet.run(2)
    assert abe.values("DEPLOY") == ["from the backup"]


def _share(port):
    from pymoos_lite.field.share import ShareApp

    return ShareApp, "pShare", ("input", f"route=localhost:{port}")


def test_a_white_list_that_keeps_pings_out_is_warned_of():
    fleet = Fleet()
    share = fleet.app(
        *("shoreside", *_share(9200)[:2]), ("input", "route=localhost:9200, white_list=DEPLOY & COUNT")
    )
    fleet.vehicle("abe", 9201)
    fleet.run(10)
    warning = next(w for w in share.log.run_warnings if "white list" in w)
    assert "NODE_BROKER_PING" in warning
    assert "filtered" in "\n".join(share.report())


def test_hostile_pings_are_counted_and_change_nothing():
    fleet = Fleet()
    shore = fleet.shore()
    abe = fleet.vehicle("abe", 9201)
    fleet.run(10)
    from pymoos_lite.core.message import Message

    database = fleet.host.communities["shoreside"].database
    for text in (
        "",
        "community=",
        "community=x y,hostip=localhost,port_db=1",
        "x" * 100_000,
        "community=bob,hostip=localhost,port_db=9,pshare_iroutes=;rm",
        "community=" + "z" * 500 + ",hostip=1.2.3.4,port_db=9,pshare_iroutes=1.2.3.4:9",
        "community=eve,hostip=1.2.3.4,port_db=9,pshare_iroutes=1.2.3.4:99999",
    ):
        database.publish("x", Message("NODE_BROKER_PING", text, fleet.host.clock.now(), "x", "", "evil"), 0.0)
    fleet.run(2)
    broker = fleet.get("shoreside", "uFldShoreBroker")
    assert list(broker.nodes) == ["abe"]
    assert sum(broker._dropped.values()) == 7
    assert all_bridged(fleet, shore, [("abe", abe)], 1.0) == []
