"""The berta mission in lockstep: vessels swap places, keep clear of each other, and every run is repeatable."""

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest

from pymoos_lite.config.registry import import_file
from pymoos_lite.hosts.fleet import add_fleet, deploy_in_lockstep, find_fleet, load_fleet, plan_fleet
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.hosts.network import Conditions

FLEET = find_fleet("berta")
swap_stations = import_file(FLEET.parent / "swap_stations.py")


def sailed(out: Path, vehicles, duration, seed=1, settings=None, conditions=None):
    plan = plan_fleet(load_fleet(FLEET, vehicles, seed), FLEET.parent, out, settings=settings)
    assert plan.problems == ()
    host = Lockstep(seed, out)
    if conditions is not None:
        host.network.set_conditions(conditions)
    add_fleet(host, plan)
    deploy_in_lockstep(host, plan)
    host.run(duration)
    assert host.failures == []
    return host


def totals(host):
    database = host.communities["shoreside"].database
    names = ("ENCOUNTER_TOTAL", "NEAR_MISS_TOTAL", "COLLISION_TOTAL")
    return [database.value(name) for name in names]


def test_every_shipped_file_of_the_mission_is_without_problems_for_any_number_of_vehicles(tmp_path):
    for vehicles in range(2, 9):
        plan = plan_fleet(load_fleet(FLEET, vehicles), FLEET.parent, tmp_path)
        assert plan.problems == ()
        for member in plan.members:
            for app in member.plan.apps:
                assert app.cls.check_block(app.lines, member.plan.mission_dir, member.plan.mission.file) == []


@pytest.mark.slow
def test_vessels_swap_places_and_nobody_comes_too_close(tmp_path):
    host = sailed(tmp_path, 3, 400.0)
    app = host.communities["shoreside"].app("pSwapStations")
    assert app.swaps >= 4
    encounters, near_misses, collisions = totals(host)
    assert encounters >= 3
    assert (near_misses, collisions) == (0.0, 0.0)
    for name in ("abe", "ben", "cal"):
        database = host.communities[name].database
        assert database.value("MODE") == "ACTIVE:LOITERING"
        assert database.get("BHV_ERROR") is None
        helm = host.communities[name].app("pHelmIvP")
        assert not helm.log.run_warnings
    host.stop()
    report = host.communities["shoreside"].database.value("MISSION_REPORT").splitlines()
    assert report[0] == f"swaps {app.swaps}, encounters {encounters:.0f}, near misses 0, collisions 0"
    assert report[1].startswith("closest points of approach: least ")


def test_many_vessels_have_room_to_start_and_the_interval_of_swaps_can_change_while_they_sail(tmp_path):
    plan = plan_fleet(load_fleet(FLEET, 64), FLEET.parent, tmp_path)
    assert plan.problems == ()
    host = Lockstep(1)
    shore = plan.shoreside
    only = next(a for a in shore.plan.apps if a.name == "pSwapStations")
    host.add_plan(replace(shore.plan, apps=(only,)))
    app = host.communities["shoreside"].app("pSwapStations")
    host.poke(1.0, "DEPLOY_ALL", "true")
    host.poke(5.0, "SWAP_INTERVAL", 7.0)
    host.poke(20.0, "SWAP_INTERVAL", 0.2)
    host.run(10.5)
    assert app.next_swap - host.clock.start == pytest.approx(12.0, abs=1.1)
    host.run(20.0)
    assert app.interval == 7.0
    assert any("SWAP_INTERVAL" in warning for warning in app.log.run_warnings)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_logs_and_another_does_not(tmp_path):
    def digests(folder, seed):
        sailed(folder, 2, 90.0, seed).stop()
        return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(folder.rglob("*.alog"))}

    first, again, other = (digests(tmp_path / str(i), seed) for i, seed in enumerate((4, 4, 5)))
    assert len(first) == 3
    assert first == again
    assert all(first[name] != other[name] for name in first)


@pytest.mark.slow
def test_with_a_fifth_of_everything_lost_and_a_second_of_delay_the_fleet_goes_on(tmp_path):
    host = sailed(tmp_path, 3, 300.0, conditions=Conditions(latency=1.0, jitter=0.2, loss=0.2))
    assert host.communities["shoreside"].app("pSwapStations").swaps >= 2
    assert totals(host)[2] == 0.0
    traffic = host.network.total()
    assert traffic.lost / traffic.sent == pytest.approx(0.2, abs=0.03)
    assert traffic.sent == traffic.delivered + traffic.lost + len(host.network.in_flight)


@pytest.mark.slow
def test_a_vessel_killed_in_the_middle_is_left_behind_and_the_fleet_goes_on(tmp_path):
    host = sailed(tmp_path, 4, 100.0)
    host.kill("ben")
    host.run(200.0)
    assert host.failures == []
    app = host.communities["shoreside"].app("pSwapStations")
    others = [app.vessels[name] for name in ("abe", "cal", "deb")]
    assert sum(vessel.swaps for vessel in others) >= 4
    for name in ("abe", "cal", "deb"):
        contacts = host.communities[name].database.value("CONTACTS_LIST")
        assert "ben" not in contacts.split(",")
    assert "ben" not in host.communities["shoreside"].app("uFldNodeComms").ledger
    assert host.network.total().unreachable > 0


class TestStations:
    """The ring of stations."""

    @pytest.mark.parametrize("count", [1, 2, 3, 8, 64])
    def test_neighbours_are_a_spacing_apart(self, count, tmp_path):
        from math import dist

        plan = plan_fleet(load_fleet(FLEET, count), FLEET.parent, tmp_path)
        host = Lockstep(1)
        shore = plan.shoreside
        only = next(a for a in shore.plan.apps if a.name == "pSwapStations")
        host.add_plan(replace(shore.plan, apps=(only,)))
        app = host.communities["shoreside"].app("pSwapStations")
        places = [app.station(i) for i in range(count)]
        gaps = [dist(places[i], places[i - 1]) for i in range(count)] if count > 1 else []
        assert gaps == pytest.approx([60.0] * len(gaps))
