"""What the brokers and host info post, message by message (native_wire.md 4, marine_apps.md 8)."""

import pytest
from fleet_fixture import Fleet, Listener

from pymoos_lite.core.message import Message
from pymoos_lite.field.bridges import RETRY_AFTER, Bridge, WantedRoutes, parse_bridge
from pymoos_lite.field.host_info import HostInfo
from pymoos_lite.field.node_broker import NodeBroker, parse_shore
from pymoos_lite.field.shore_broker import ShoreBroker, expand, parse_vnode
from pymoos_lite.records.host_record import HostRecord

PING = "community=abe,hostip=127.0.0.1,port_db=9001,pshare_iroutes=127.0.0.1:9201,timewarp=1,time=1,key=0"


class Bench:
    """One app alone in its community, with an ear for all it posts."""

    def __init__(self, cls, community, *config, move=""):
        self.fleet = Fleet()
        self.community = community
        if move:
            self.fleet.host.network.move(community, move)
        self.app = self.fleet.app(community, cls, cls.__name__, *config)
        self.ear = self.fleet.app(community, Listener, "ear", ("hear", "*"))
        self.fleet.run(0.1)

    def hear(self, name, value, community=""):
        now = self.fleet.host.clock.now()
        message = Message(name, value, now, "test", "", community or self.community)
        self.fleet.host.communities[self.community].database.publish("test", message, now)

    def run(self, seconds):
        self.fleet.run(seconds)
        return self

    def posted(self, name, after=-1.0):
        start = self.fleet.host.clock.start
        return [m.value for m in self.ear.heard if m.name == name and m.time - start > after]


class TestHostInfo:
    def test_it_tells_at_once_when_the_share_starts_listening(self):
        bench = Bench(HostInfo, "abe").run(3)
        assert "pshare_iroutes" not in bench.posted("PHI_HOST_INFO")[-1]
        bench.hear("PSHARE_INPUT_SUMMARY", "localhost:9201,224.1.1.11:24468:multicast_8")
        record = HostRecord.parse(bench.run(2).posted("PHI_HOST_INFO")[-1])
        assert record == HostRecord(
            "abe", "localhost", "9000", "9201", ("localhost:9201", "multicast_8"), warp=1.0
        )

    def test_a_summary_from_elsewhere_is_not_ours(self):
        bench = Bench(HostInfo, "abe")
        bench.hear("PSHARE_INPUT_SUMMARY", "localhost:9999", "shoreside")
        assert "9999" not in bench.run(2).posted("PHI_HOST_INFO")[-1]

    def test_the_address_found_replaces_localhost_everywhere(self):
        bench = Bench(HostInfo, "abe", move="10.0.0.7")
        bench.hear("PSHARE_INPUT_SUMMARY", "localhost:9201")
        text = bench.run(2).posted("PHI_HOST_INFO")[-1]
        assert "hostip=10.0.0.7," in text
        assert "pshare_iroutes=10.0.0.7:9201" in text
        assert bench.posted("PHI_HOST_IP")[-1] == "10.0.0.7"
        assert bench.posted("PHI_HOST_IP_VERBOSE")[-1] == "SIM0=10.0.0.7"
        assert bench.posted("PHI_HOST_PORT_DB")[-1] == "9000"

    @pytest.mark.parametrize(
        ("config", "host"),
        [
            (("default_hostip_force", "1.2.3.4"), "1.2.3.4"),
            (("default_hostip", "1.2.3.4"), "10.0.0.7"),
            (("prefer_interface", "eth0"), "10.0.0.7"),
            (("default_hostip_force", "nonsense"), "10.0.0.7"),
        ],
    )
    def test_an_address_can_be_forced(self, config, host):
        assert Bench(HostInfo, "abe", config, move="10.0.0.7").run(1).posted("PHI_HOST_IP")[-1] == host

    def test_it_repeats_itself_every_ten_iterations_and_when_asked(self):
        bench = Bench(HostInfo, "abe").run(35)
        assert len(bench.posted("PHI_HOST_INFO")) == 4
        bench.hear("HOST_INFO_REQUEST", "true")
        assert len(bench.run(1.5).posted("PHI_HOST_INFO")) == 5


class TestNodeBroker:
    SHORE = ("try_shore_host", "pshare_route=localhost:9200")

    def bench(self, *config):
        bench = Bench(NodeBroker, "abe", self.SHORE, *config)
        bench.hear(
            "PHI_HOST_INFO",
            "community=abe,hostip=localhost,port_db=9001,pshare_iroutes=localhost:9201,timewarp=1",
        )
        return bench

    def ack(self, bench, **changes):
        fields = {
            "community": "shoreside",
            "hostip": "localhost",
            "port_db": "9000",
            "status": "ok",
            "key": "0",
        }
        text = ",".join(f"{k}={v}" for k, v in {**fields, **changes}.items())
        bench.hear("NODE_BROKER_ACK", text, "shoreside")
        return bench.run(1)

    def test_it_asks_for_the_ping_route_again_until_the_share_has_it(self):
        bench = self.bench().run(10)
        command = "cmd=output,src_name=NODE_BROKER_PING_0,dest_name=NODE_BROKER_PING,route=localhost:9200"
        assert set(bench.posted("PSHARE_CMD")) == {command}
        asked = len(bench.posted("PSHARE_CMD"))
        assert 3 <= asked <= 5
        bench.hear("PSHARE_OUTPUT_SUMMARY", "NODE_BROKER_PING_0->NODE_BROKER_PING:localhost:9200")
        assert len(bench.run(10).posted("PSHARE_CMD")) == asked
        bench.hear("PSHARE_OUTPUT_SUMMARY", "")
        assert len(bench.run(2).posted("PSHARE_CMD")) == asked + 1

    def test_it_pings_every_five_seconds_and_less_often_while_it_is_answered(self):
        bench = self.bench().run(20.5)
        pings = bench.posted("NODE_BROKER_PING_0")
        assert 4 <= len(pings) <= 5
        record = HostRecord.parse(pings[-1])
        assert (record.community, record.key, record.iroutes) == ("abe", "0", ("localhost:9201",))
        assert record.time is not None
        before = len(pings)
        for _ in range(18):
            self.ack(bench)
        assert len(bench.posted("NODE_BROKER_PING_0")) - before <= 1

    def test_an_acknowledgement_makes_the_bridges_once(self):
        bench = self.bench(("bridge", "src=A,alias=B"), ("auto_bridge_realmcast", "false")).run(1)
        self.ack(self.ack(bench))
        assert bench.posted("NODE_PSHARE_VARS") == ["B,APPCAST,NODE_PSHARE_VARS"] * 2
        commands = [c for c in bench.posted("PSHARE_CMD") if "PING" not in c]
        assert commands == [
            f"cmd=output,src_name={s},dest_name={d},route=localhost:9200"
            for s, d in (("A", "B"), ("APPCAST", "APPCAST"), ("NODE_PSHARE_VARS", "NODE_PSHARE_VARS"))
        ]

    @pytest.mark.parametrize(
        "changes", [{"key": "1"}, {"key": "x"}, {"key": ""}, {"community": ""}, {"port_db": "?"}]
    )
    def test_an_acknowledgement_that_fits_no_ping_is_dropped(self, changes):
        bench = self.ack(self.bench(), **changes)
        assert bench.posted("NODE_PSHARE_VARS") == []
        assert bench.app._bad_acks == 1
        assert bench.app.log.run_warnings

    def test_our_own_communitys_acknowledgement_is_not_one(self):
        bench = self.bench()
        bench.hear("NODE_BROKER_ACK", "community=abe,hostip=localhost,port_db=1,status=ok,key=0", "abe")
        assert bench.run(2).posted("NODE_PSHARE_VARS") == []

    def test_a_mismatch_is_warned_of_and_not_bridged_unless_told_to(self):
        for strict, bridged in (("true", False), ("false", True)):
            bench = self.ack(self.bench(("strict", strict)), status="timewarp (5!=1)")
            assert bench.app.shores[0].bridged is bridged
            assert "shoreside says: timewarp (5!=1)" in bench.app.log.run_warnings
            self.ack(bench)
            assert bench.app.shores[0].bridged
            assert not bench.app.log.run_warnings

    def test_two_policies_for_messages_conflict_and_the_later_one_is_refused(self):
        bench = self.bench(
            ("bridge", "src=NODE_MESSAGE_LOCAL,alias=NODE_MESSAGE"),
            ("bridge", "src=MEDIATED_MESSAGE_LOCAL,alias=MEDIATED_MESSAGE"),
        )
        assert Bridge("MEDIATED_MESSAGE_LOCAL", "MEDIATED_MESSAGE") not in bench.app.bridges
        assert any("Conflicted messaging policy" in w for w in bench.app.log.config_warnings)

    def test_every_shoreside_to_try_has_a_timer_of_its_own(self):
        bench = self.bench(("try_shore_host", "pshare_route=10.0.0.1:9200")).run(16)
        assert len(bench.posted("NODE_BROKER_PING_0")) == len(bench.posted("NODE_BROKER_PING_1")) >= 3

    def test_faulty_routes_are_refused(self):
        assert parse_shore("pshare_route = localhost:9200") == "localhost:9200"
        assert parse_shore("pshare_route=multicast_8") == "multicast_8"
        for text in ("", "localhost:9200", "pshare_route=", "pshare_route=localhost", "route=localhost:9200"):
            with pytest.raises(ValueError, match="route"):
                parse_shore(text)


class TestShoreBroker:
    def bench(self, *config):
        bench = Bench(ShoreBroker, "shoreside", *(config or (("qbridge", "DEPLOY"),)))
        bench.hear(
            "PHI_HOST_INFO",
            "community=shoreside,hostip=127.0.0.1,port_db=9000,pshare_iroutes=127.0.0.1:9200,timewarp=1",
        )
        return bench.run(1)

    def test_a_ping_is_answered_at_once_and_once_more(self):
        bench = self.bench()
        bench.hear("NODE_BROKER_PING", PING, "abe")
        bench.run(20)
        acks = [HostRecord.parse(text) for text in bench.posted("NODE_BROKER_ACK_ABE")]
        assert [(a.community, a.status, a.key, a.iroutes) for a in acks] == [
            ("shoreside", "ok", "0", ("127.0.0.1:9200",))
        ] * 2
        assert [a.id for a in acks] == ["1", "2"]
        assert bench.posted("NODE_BROKER_VACK") == ["abe", "abe"]

    def test_bridges_are_made_for_every_vehicle_with_its_name_and_number(self):
        bench = self.bench(
            ("qbridge", "DEPLOY"),
            ("bridge", "src=UP_$N,alias=UP"),
            ("bridge", "src=LOW_$v,alias=LOW"),
            ("auto_bridge_realmcast", "false"),
            ("auto_bridge_appcast", "false"),
            ("auto_bridge_mhash", "false"),
        )
        for i, name in enumerate(("abe", "Ben")):
            bench.hear("NODE_BROKER_PING", PING.replace("abe", name).replace("9201", f"920{i + 1}"), name)
        bench.run(2)
        made = {
            c.partition(",")[2].replace("src_name=", "").replace("dest_name=", "")
            for c in bench.posted("PSHARE_CMD")
        }
        expected = set()
        for upper, name, number in (("ABE", "abe", 1), ("BEN", "Ben", 2)):
            for source, alias in (
                (f"NODE_BROKER_ACK_{upper}", "NODE_BROKER_ACK"),
                ("DEPLOY_ALL", "DEPLOY"),
                (f"DEPLOY_{upper}", "DEPLOY"),
                (f"UP_{number}", "UP"),
                (f"LOW_{name}", "LOW"),
            ):
                expected.add(f"{source},{alias},route=127.0.0.1:920{number}")
        assert made == expected
        assert bench.posted("UFSB_QBRIDGE_VARS") == ["DEPLOY"]
        assert bench.posted("UFSB_BRIDGE_VARS") == ["DEPLOY_$V,DEPLOY_ALL,LOW_$v,UP_$N"]
        assert bench.posted("UFSB_NODE_COUNT") == [0.0, 2.0]

    def test_pairs_of_source_and_alias_are_compared_and_not_each_alone(self):
        bench = self.bench(
            ("bridge", "src=A,alias=B"), ("bridge", "src=D,alias=C"), ("bridge", "src=A,alias=C")
        )
        assert {Bridge("A", "B"), Bridge("D", "C"), Bridge("A", "C")} <= set(bench.app.bridges)

    @pytest.mark.parametrize(
        ("warp", "status"),
        [
            ("timewarp=1", "ok"),
            ("timewarp=1.04", "ok"),
            ("timewarp=5", "timewarp (1!=5)"),
            ("nothing=1", "timewarp (1!=?)"),
        ],
    )
    def test_time_warps_are_compared_as_numbers(self, warp, status):
        bench = self.bench()
        bench.hear("NODE_BROKER_PING", PING.replace("timewarp=1", warp), "abe")
        bench.run(2)
        assert HostRecord.parse(bench.posted("NODE_BROKER_ACK_ABE")[0]).status == status
        assert any("DEPLOY_ABE" in c for c in bench.posted("PSHARE_CMD")) == (status == "ok")

    def test_a_silent_vehicle_is_warned_of_if_asked_for_and_forgiven(self):
        bench = self.bench(("qbridge", "DEPLOY"), ("warning_on_stale", "true"))
        bench.hear("NODE_BROKER_PING", PING, "abe")
        assert "abe is silent" in bench.run(13).app.log.run_warnings
        bench.hear("NODE_BROKER_PING", PING, "abe")
        assert "abe is silent" not in bench.run(2).app.log.run_warnings

    def test_names_that_differ_only_in_case_are_warned_of(self):
        bench = self.bench()
        for name, port in (("abe", "9201"), ("ABE", "9202")):
            bench.hear("NODE_BROKER_PING", PING.replace("abe", name).replace("9201", port), name)
        assert any("differ only in case" in w for w in bench.run(1.5).app.log.run_warnings)

    def test_two_vehicles_of_one_name_are_suspected(self):
        bench = self.bench()
        for port in ("9201", "9202", "9201", "9202"):
            bench.hear("NODE_BROKER_PING", PING.replace("9201", port), "abe")
            bench.run(2)
        assert any("are there two of that name?" in w for w in bench.app.log.run_warnings)

    def test_macros_and_vnodes(self):
        assert expand("UP_$V_$v_$N", "Abe", 3) == "UP_ABE_Abe_3"
        assert parse_vnode("route=10.0.0.1") == "10.0.0.1:9200"
        assert parse_vnode("route = 10.0.0.1:9333") == "10.0.0.1:9333"
        for text in ("10.0.0.1", "route=", "route=a:b"):
            with pytest.raises(ValueError, match="route"):
                parse_vnode(text)


class TestWantedRoutes:
    def test_what_is_missing_is_asked_for_again_but_not_too_often(self):
        wanted = WantedRoutes()
        wanted.want("A", "B", "localhost:9200")
        wanted.want("M", "M", "multicast_8")
        assert len(wanted.commands(0.0)) == 2
        assert wanted.commands(1.0) == []
        wanted.note_summary("A->B:localhost:9200")
        assert wanted.commands(RETRY_AFTER) == ["cmd=output,src_name=M,dest_name=M,route=multicast_8"]
        wanted.note_summary("A->B:localhost:9200, M->M:224.1.1.11:24468:multicast_8")
        assert wanted.commands(100.0) == []
        wanted.note_summary("")
        assert len(wanted.commands(200.0)) == 2

    def test_what_is_dropped_is_withdrawn_unless_wanted_again(self):
        wanted = WantedRoutes()
        for place in ("here:1", "there:1"):
            wanted.want("A", "A", place)
        wanted.commands(0.0)
        wanted.drop("here:1")
        assert wanted.commands(1.0) == ["cmd=remove,src_name=A,dest_name=A,route=here:1"]
        wanted.drop("there:1")
        wanted.want("A", "A", "there:1")
        assert wanted.commands(2.0) == ["cmd=output,src_name=A,dest_name=A,route=there:1"]

    def test_bridges_are_read_strictly(self):
        assert parse_bridge("src = A, alias = B") == Bridge("A", "B")
        assert parse_bridge("alias=B,src=A") == Bridge("A", "B")
        assert parse_bridge("src=A") == Bridge("A", "A")
        for text in ("", "alias=B", "src=", "source=A", "src=A,alias=", "src=A B=C"):
            with pytest.raises(ValueError, match="expected src=VAR"):
                parse_bridge(text)
