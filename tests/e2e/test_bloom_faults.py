"""The bloom mission under faults: loss and latency, vessels and the shoreside killed and started again."""

import pytest

from pymoos_lite.hosts.fleet import add_fleet, deploy_in_lockstep, find_fleet, load_fleet, plan_fleet
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.hosts.network import Conditions

DEPLOY = {"MOOS_MANUAL_OVERRIDE": "false", "RETURN": "false", "STATION_KEEP": "false", "DEPLOY": "true"}


class Fleet:
    """Three vessels and a shoreside in lockstep, deployed after twenty seconds."""

    def __init__(self, out, **macros):
        path = find_fleet("bloom")
        self.plan = plan_fleet(
            load_fleet(path, 3, 1, ["field", "quiet"], macros), path.resolve().parent, out, warp=1.0
        )
        assert self.plan.problems == ()
        self.host = Lockstep(1, None, stagger=True)
        add_fleet(self.host, self.plan)
        deploy_in_lockstep(self.host, self.plan)
        self.names = self.plan.fleet.vehicle_names()

    def run(self, seconds):
        self.host.run(seconds)
        assert self.host.failures == [], [failure.trace for failure in self.host.failures]

    def value(self, name, variable):
        return self.host.communities[name].database.value(variable)

    def modes(self):
        return {name: self.value(name, "MODE") for name in self.names}

    def hears(self, name):
        """Vessels whose opinions count at this one right now."""
        engine = self.host.communities[name].app("pOpinionManager").engine
        now = self.host.clock.now()
        return {n.name for n in engine.neighbours if now - n.time <= engine.settings.stale}

    def start(self, name):
        (member,) = (m for m in self.plan.members if m.name == name)
        self.host.add_plan(member.plan)

    def deploy(self, *names):
        for name in names:
            for variable, value in DEPLOY.items():
                self.host.poke(self.host.elapsed, f"{variable}_{name.upper()}", value, "shoreside")


CHOOSING = {"ACTIVE:EXPLORING", "ACTIVE:EXPLOITING"}


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["text", "i16"])
def test_with_a_fifth_lost_and_a_second_of_latency_coalitions_still_form(tmp_path, encoding):
    fleet = Fleet(tmp_path, ENCODING=encoding, COMMS_RANGE="1000")
    fleet.host.network.set_conditions(Conditions(latency=1.0, loss=0.2))
    for _ in range(4):  # a command is one datagram: whoever sees no effect gives it again
        fleet.run(20.0)
        fleet.deploy(*fleet.names)
    fleet.run(40.0)
    assert set(fleet.modes().values()) <= CHOOSING
    heard = dict.fromkeys(fleet.names, 0)
    for _ in range(30):
        fleet.run(1.0)
        for name in fleet.names:
            heard[name] += len(fleet.hears(name))
            members = ",".join(str(fleet.value(name, f"{o}_LIST")) for o in ("EXPLORE", "EXPLOIT", "MIGRATE"))
            assert name not in members.split(",")
    assert all(count >= 30 for count in heard.values()), heard
    assert fleet.host.network.total().lost > 100


@pytest.mark.slow
def test_a_vessel_killed_and_started_again_is_dropped_and_taken_back(tmp_path):
    fleet = Fleet(tmp_path, COMMS_RANGE="1000")
    fleet.run(60.0)
    assert "abe" in fleet.hears("ben")
    fleet.host.kill("abe")
    fleet.run(10.0)
    assert "abe" not in fleet.hears("ben")
    assert "abe" not in str(fleet.value("ben", "EXPLORE_LIST"))
    assert {fleet.value(name, "MODE") for name in ("ben", "deb")} <= CHOOSING
    fleet.start("abe")
    fleet.run(15.0)
    assert fleet.value("abe", "DEPLOY") == "false"
    fleet.deploy("abe")
    fleet.run(25.0)
    assert set(fleet.modes().values()) <= CHOOSING
    assert "abe" in fleet.hears("ben")
    assert "abe" in str(fleet.value("ben", "EXPLORE_LIST"))


@pytest.mark.slow
def test_a_short_absence_of_the_shoreside_is_survived(tmp_path):
    fleet = Fleet(tmp_path, COMMS_RANGE="1000")
    fleet.run(60.0)
    fleet.host.kill("shoreside")
    fleet.run(8.0)
    assert all(fleet.hears(name) == set() for name in fleet.names), "the radio is simulated at the shoreside"
    assert set(fleet.modes().values()) <= CHOOSING
    fleet.start("shoreside")
    fleet.run(20.0)
    assert set(fleet.modes().values()) <= CHOOSING
    assert all(len(fleet.hears(name)) == 2 for name in fleet.names)


@pytest.mark.slow
def test_a_long_absence_of_the_shoreside_stops_all_until_they_are_deployed_again(tmp_path):
    fleet = Fleet(tmp_path, COMMS_RANGE="1000")
    fleet.run(60.0)
    fleet.host.kill("shoreside")
    fleet.run(30.0)
    assert set(fleet.modes().values()) == {"INACTIVE"}
    assert all(fleet.value(name, "DESIRED_SPEED") == 0.0 for name in fleet.names)
    fleet.start("shoreside")
    fleet.run(15.0)
    assert set(fleet.modes().values()) == {"INACTIVE"}
    fleet.deploy(*fleet.names)
    fleet.run(20.0)
    assert set(fleet.modes().values()) <= CHOOSING
    assert all(len(fleet.hears(name)) == 2 for name in fleet.names)
