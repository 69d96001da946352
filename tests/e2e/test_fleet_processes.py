"""Discovery and faults of a fleet with real processes and sockets on this machine."""

import time
from pathlib import Path

import pytest

from pymoos_lite.core.clock import RealClock
from pymoos_lite.hosts.fleet import load_fleet, plan_fleet
from pymoos_lite.hosts.fleet_host import FleetHost, free_ports
from pymoos_lite.hosts.ports import LOOPBACK, RemoteClient
from pymoos_lite.hosts.realtime import HostOptions

pytestmark = pytest.mark.slow
DATA = Path(__file__).parent.parent / "data" / "fleet"
WARP = 10.0
PATIENCE = 60.0
"""Wall seconds; what is waited for takes one or two."""


class RealFleet:
    """Two drifting vehicles and a shoreside, each a process, and a client in each that are up."""

    def __init__(self, folder):
        self.folder = folder
        self.fleet = load_fleet(DATA / "fleet.yaml", vehicles=2)
        self.said = []
        self.clock = RealClock(WARP)
        self.ports = free_ports(self.fleet, LOOPBACK)
        plan = self.plan("first", self.ports)
        options = HostOptions(log_dir=folder, share_bind=LOOPBACK)
        self.host = FleetHost(plan, DATA, options, {}, self.clock, self.said.append)
        self.clients = {}
        self.mail = {}

    def plan(self, name, ports):
        plan = plan_fleet(self.fleet, DATA, self.folder / name, warp=WARP, ports=ports)
        assert plan.problems == ()
        return plan

    def start(self, *names):
        self.host.start(names)
        for name in names:
            if name in self.clients:
                self.clients.pop(name).close(0.1)
            client = RemoteClient("watcher", *self.host.address_of(name), clock=self.clock)
            for variable in ("DEPLOY", "RETURN", "NODE_REPORT"):
                client.register(variable)
            self.clients[name] = client
            self.mail[name] = []

    def wait_for(self, happened, what):
        end = time.monotonic() + PATIENCE
        while not happened():
            assert time.monotonic() < end, f"{what} did not happen; said: {self.said}"
            self.host.turn(0.01)
            for name, client in self.clients.items():
                self.mail[name] += client.poll(0.005)

    def expect_all_bridged(self, *vehicles):
        """Commands to all and to one arrive, and so do reports in both directions."""
        since = self.clock.now()
        last = -1.0

        def arrived():
            nonlocal last
            # Said again now and then: the bridges may not be up yet, and UDP may lose something.
            if self.clock.now() - last > 10.0:
                last = self.clock.now()
                self.clients["shoreside"].notify("DEPLOY_ALL", f"at {since}")
                for name in vehicles:
                    self.clients["shoreside"].notify(f"RETURN_{name.upper()}", f"{name} at {since}")
            reports = [m for m in self.mail["shoreside"] if m.name == "NODE_REPORT" and m.time > since]
            return all(
                self.values(name, "DEPLOY")[-1:] == [f"at {since}"]
                and self.values(name, "RETURN")[-1:] == [f"{name} at {since}"]
                and any(m.community == name for m in reports)
                and (
                    len(vehicles) < 2
                    or any(m.name == "NODE_REPORT" and m.time > since for m in self.mail[name])
                )
                for name in vehicles
            )

        self.wait_for(arrived, "bridging")

    def values(self, name, variable):
        return [m.value for m in self.mail[name] if m.name == variable]

    def close(self):
        for client in self.clients.values():
            client.close(0.1)
        self.host.close()


@pytest.fixture
def fleet(tmp_path):
    fleet = RealFleet(tmp_path)
    yield fleet
    fleet.close()


@pytest.mark.parametrize("order", ["shoreside abe ben", "abe ben shoreside", "abe shoreside ben"])
def test_bridges_come_up_in_any_order_of_starting(fleet, order):
    for name in order.split():
        fleet.start(name)
    fleet.expect_all_bridged("abe", "ben")


def test_a_shoreside_that_dies_and_comes_back_is_found_again(fleet):
    fleet.start("shoreside", "abe", "ben")
    fleet.expect_all_bridged("abe", "ben")
    fleet.host.kill("shoreside")
    fleet.wait_for(lambda: "shoreside" not in fleet.host.running(), "the death of the shoreside")
    assert any("shoreside" in text for text in fleet.said)
    fleet.start("shoreside")
    fleet.expect_all_bridged("abe", "ben")


def test_a_vehicle_that_dies_comes_back_at_another_port_while_the_others_go_on(fleet):
    fleet.start("shoreside", "abe", "ben")
    fleet.expect_all_bridged("abe", "ben")
    fleet.host.kill("abe")
    fleet.wait_for(lambda: "abe" not in fleet.host.running(), "the death of abe")
    fleet.clients.pop("abe").close(0.1)
    fleet.expect_all_bridged("ben")
    moved = {**fleet.ports, "abe": tuple(port + 60 for port in fleet.ports["abe"])}
    fleet.host.replace(next(m for m in fleet.plan("second", moved).members if m.name == "abe"))
    fleet.start("abe")
    fleet.expect_all_bridged("abe", "ben")
