"""BHV_StationKeep and BHV_RStationKeep beyond the measured cases (behaviors.md C3, C26)."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sailing import Sailor

from behaviors.station import Hibernation, Radii
from ivp_helm.testing import HelmRig


def keep(**parameters):
    return HelmRig([("BHV_StationKeep", {"name": "keep", **parameters})])


def test_distance_and_speed_are_right_in_the_first_iteration():
    rig = keep(station_pt="0,0", inner_radius=5, outer_radius=15, outer_speed=1.2, transit_speed=2.5)
    rig.own(-60.0, 40.0, 10.0, 1.0)
    rig.iterate()
    assert rig.posted("DIST_TO_STATION") == [pytest.approx(72.111, abs=1e-3)]
    assert rig.decision == {"course": 124.0, "speed": 2.5}
    assert rig.posted("PSKEEP_MODE") == ["DISABLED"]


def test_it_comes_back_to_its_station_and_rests_there():
    rig = keep(station_pt="30,-40", inner_radius=4, outer_radius=20, outer_speed=1.2)
    sailor = Sailor(rig, 120.0, 60.0, 0.0, 0.0)
    assert sailor.sail(150, lambda s: s.distance_to(30, -40) < 6.0)
    sailor.sail(30)
    assert sailor.speed == 0.0
    assert sailor.distance_to(30, -40) <= 6.0


def test_a_fast_outer_speed_raises_the_transit_speed():
    rig = keep(station_pt="0,0", outer_speed=3.0)
    rig.own(100.0, 0.0, 0.0, 1.0)
    rig.iterate()
    assert rig.decision["speed"] == 3.0


def test_an_outer_radius_within_the_inner_one_counts_as_the_inner_one():
    rig = keep(station_pt="0,0", inner_radius=20, outer_radius=10, transit_speed=2)
    rig.own(19.0, 0.0, 0.0, 1.0)
    rig.iterate()
    assert rig.decision["speed"] == 0.0
    rig.own(21.0, 0.0, 0.0, 1.0)
    rig.iterate()
    assert rig.decision["speed"] == 2.0
    polygons = rig.posted("VIEW_POLYGON")
    assert len(polygons) == 1
    assert str(polygons[0]).endswith("radius=20.0")


def test_center_activate_takes_the_place_of_each_activation():
    rig = HelmRig([("BHV_StationKeep", {"name": "keep", "center_activate": "true", "condition": "GO=1"})])
    for x in (10.0, 70.0):
        rig.own(x, 5.0, 0.0, 1.0)
        rig.mail("GO", 1)
        rig.iterate()
        assert rig.life("keep").behavior.station == (x, 5.0)
        assert f"x={x:.1f},y=5.0" in str(rig.posted("VIEW_POLYGON")[-1])
        rig.mail("GO", 0)
        rig.iterate()
        assert str(rig.posted("VIEW_POLYGON")[-1]).endswith("active=false")


def test_during_the_swing_the_vessel_keeps_its_heading():
    rig = keep(center_activate="true", swing_time=2)
    for x in (0.0, 1.0, 2.0):
        rig.own(x, 0.0, 77.0, 1.0)
        rig.iterate()
        assert rig.decision == {"course": 77.0, "speed": 0.0}
    rig.own(5.0, 0.0, 77.0, 1.0)
    rig.iterate(8)
    assert rig.life("keep").behavior.station == (5.0, 0.0)
    rig.own(40.0, 0.0, 77.0, 1.0)
    rig.iterate()
    assert rig.decision["course"] == 270.0


def test_an_update_moves_the_station():
    rig = keep(station_pt="0,0", updates="UP")
    rig.own(0.0, 0.0, 0.0, 0.0)
    rig.iterate()
    rig.mail("UP", "station_pt=100,0")
    rig.iterate()
    assert rig.posted("DIST_TO_STATION") == [0.0, 100.0]
    assert rig.decision == {"course": 90.0, "speed": 2.5}


def test_without_a_station_no_distance_is_told():
    rig = keep()
    rig.own(3.0, 4.0, 0.0, 0.0)
    rig.iterate(2)
    assert rig.posted("DIST_TO_STATION") == []
    assert rig.posted("BHV_WARNING") == ["keep: STATION_POINT_NOT_SET"] * 2


@pytest.mark.parametrize("line", ["inner_radius = 0", "outer_speed = -1", "hibernation_radius = 0"])
def test_radii_and_speeds_must_be_above_zero(line):
    key, value = line.split(" = ")
    rig = HelmRig([("BHV_StationKeep", {"name": "k", key: value})], faulty=True)
    assert rig.core.authority.malconfig


@settings(max_examples=200, deadline=None)
@given(
    inner=st.floats(0.1, 100),
    width=st.floats(0, 100),
    outer_speed=st.floats(0.1, 3),
    faster=st.floats(0, 3),
    distances=st.tuples(st.floats(0, 300), st.floats(0, 300)),
)
def test_the_speed_never_falls_with_distance(inner, width, outer_speed, faster, distances):
    radii = Radii(inner, inner + width, outer_speed, outer_speed + faster)
    near, far = sorted(distances)
    assert 0.0 <= radii.speed(near) <= radii.speed(far) <= outer_speed + faster
    assert radii.speed(inner) == 0.0


# --- hibernation ------------------------------------------------------------------------------------------


def states(distances, radius=30.0, inner=5.0):
    """Hibernation states for distances one second apart."""
    rest = Hibernation()
    return [rest.update(float(k), d, radius, inner) for k, d in enumerate(distances)]


def test_it_sleeps_until_the_radius_is_left():
    assert states([0, 29, 30, 30.5]) == ["hibernating"] * 3 + ["seeking_station"]


def test_it_sleeps_again_within_the_inner_radius():
    assert states([40, 20, 4.9])[-1] == "hibernating"


def test_it_sleeps_again_when_it_comes_no_nearer():
    there = [40 - 2 * k for k in range(11)]  # 40 .. 20
    assert states(there)[-1] == "seeking_station"
    stuck = [20.0 + 0.1 * k for k in range(12)]
    assert states(there + stuck)[-1] == "hibernating"


def test_coming_no_nearer_outside_the_radius_does_not_put_it_to_sleep():
    assert states([50.0] * 40)[-1] == "seeking_station"


def test_a_sleeping_vessel_is_asked_for_no_speed():
    rig = keep(station_pt="0,0", inner_radius=5, outer_radius=10, hibernation_radius=30)
    rig.own(20.0, 0.0, 0.0, 0.0)
    rig.iterate()
    assert rig.decision["speed"] == 0.0
    assert rig.posted("PSKEEP_MODE") == ["HIBERNATING"]
    rig.own(31.0, 0.0, 0.0, 0.0)
    rig.iterate()
    assert rig.decision["speed"] == 2.5
    assert rig.posted("PSKEEP_MODE")[-1] == "SEEKING_STATION"


# --- beside another vessel --------------------------------------------------------------------------------


def beside(x=0.0, y=0.0, heading=0.0, **parameters):
    rig = HelmRig([("BHV_RStationKeep", {"name": "r", "contact": "ben", **parameters})])
    move(rig, x, y, heading)
    return rig


def move(rig, x, y, heading):
    for what, value in (("X", x), ("Y", y), ("HEADING", heading), ("SPEED", 1.0)):
        rig.mail(f"BEN_NAV_{what}", value)


def test_the_place_turns_with_the_contact():
    rig = beside(rstation_position="50,90")
    for heading, course in ((0.0, 90.0), (90.0, 180.0), (180.0, 270.0)):
        move(rig, 0.0, 0.0, heading)
        rig.own(0.0, 0.0, 0.0, 1.0)
        rig.iterate()
        assert rig.decision == {"course": course, "speed": 2.0}


def test_close_to_its_place_it_has_no_opinion():
    rig = beside(rstation_position="50,90")
    rig.own(47.0, 0.0, 0.0, 1.0)
    rig.iterate()
    assert rig.reason == "NothingToDo"
    assert rig.posted("DIST_TO_RSTATION") == [3.0]


def test_the_present_position_can_be_kept():
    rig = beside(rstation_position="present_position")
    rig.own(40.0, 0.0, 0.0, 1.0)
    rig.iterate()
    assert rig.posted("DIST_TO_RSTATION") == [0.0]
    move(rig, 0.0, 100.0, 90.0)
    rig.iterate()
    assert rig.decision["course"] == 326.0  # towards (0, 60)


def test_nothing_known_of_the_contact_is_a_warning():
    rig = HelmRig([("BHV_RStationKeep", {"name": "r", "contact": "ben"})])
    rig.own()
    rig.iterate()
    assert any("BEN_NAV_X" in str(w) for w in rig.posted("BHV_WARNING"))
    assert rig.reason == "NothingToDo"
