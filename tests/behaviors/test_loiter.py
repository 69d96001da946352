"""BHV_Loiter beyond the measured cases (behaviors.md C2)."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sailing import Sailor

from behaviors.loiter_entry import better_clockwise, entry, entry_from_outside
from ivp_helm.testing import HelmRig
from pymoos_lite.geometry.angles import angle_diff, bearing
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.segments import segments_cross

OCTAGON = "format=radial,x=0,y=-75,radius=40,pts=8,snap=1"
SQUARE = Polygon(((-20.0, 20.0), (20.0, 20.0), (20.0, -20.0), (-20.0, -20.0)))
"""Clockwise."""


def loiter(**parameters):
    given = {"name": "loiter", "polygon": OCTAGON, "speed": 2, "capture_radius": 5, **parameters}
    return HelmRig([("BHV_Loiter", {k: v for k, v in given.items() if v is not None})])


def behavior(rig):
    return rig.life("loiter").behavior


@pytest.mark.parametrize("clockwise", ["true", "false"])
def test_it_goes_around_its_polygon_in_the_direction_asked_for(clockwise):
    rig = loiter(clockwise=clockwise)
    sailor = Sailor(rig, 100.0, 0.0, 200.0, 2.0)
    sailor.sail(400)
    visited = [int(v) for v in rig.posted("LOITER_INDEX")]
    visited = visited[1:]
    steps = {(b - a) % 8 for a, b in itertools.pairwise(visited)}
    assert len(visited) > 12
    assert steps == {1}
    around = [bearing(0.0, -75.0, x, y) for x, y in sailor.track[400:]]
    turned = sum((b - a + 180.0) % 360.0 - 180.0 for a, b in itertools.pairwise(around))
    assert turned > 500.0 if clockwise == "true" else turned < -500.0


def test_it_stays_near_the_polygon_once_it_is_there():
    rig = loiter()
    sailor = Sailor(rig, 0.0, 60.0, 180.0, 2.0)
    assert sailor.sail(100, lambda s: abs(behavior(rig)._distance) < 5.0)
    sailor.sail(20)
    for _ in range(20):
        sailor.sail(5)
        assert abs(behavior(rig)._distance) < 10.0
        assert rig.posted("LOITER_MODE")[-1] == "stable"


def test_modes_tell_arrivals_from_outside_and_recoveries_apart():
    rig = loiter(acquire_dist=10)
    told = []
    for x in (200.0, 40.0, 60.0, 0.0):
        rig.own(x, -75.0, 270.0, 1.0)
        rig.iterate()
        told.append(rig.posted("LOITER_MODE")[-1])
    assert told == ["acquiring_external", "stable", "recovering_external", "acquiring_internal"]


def test_at_zero_speed_no_arrival_is_promised():
    rig = loiter()
    rig.own(200.0, -75.0, 270.0, 0.0)
    rig.iterate()
    assert rig.posted("LOITER_ETA_TO_POLY") == []
    rig.own(200.0, -75.0, 270.0, 2.0)
    rig.iterate()
    assert rig.posted("LOITER_ETA_TO_POLY") == [82.0]


def test_the_polygon_is_rounded_to_a_tenth_of_a_metre():
    rig = loiter(polygon="pts={0.04,0.06:50.01,0:50,50:0,50}")
    assert behavior(rig).polygon.points[-1] != (0.04, 0.06)
    assert set(behavior(rig).polygon.points) == {(0.0, 0.1), (50.0, 0.0), (50.0, 50.0), (0.0, 50.0)}


def test_a_polygon_that_is_not_convex_is_refused():
    rig = HelmRig([("BHV_Loiter", {"name": "l", "polygon": "0,0:10,0:2,2:0,10"})], faulty=True)
    assert rig.core.authority.malconfig
    assert "convex" in str(rig.core.problems[0])


def test_without_a_polygon_it_warns_and_has_no_opinion():
    rig = loiter(polygon=None)
    rig.own()
    rig.iterate()
    assert rig.posted("BHV_WARNING") == ["loiter: Empty/NULL Loiter Specification."]
    assert rig.reason == "NothingToDo"


@pytest.mark.parametrize(
    ("assignment", "center"),
    [
        ({"center_assign": "10,20"}, (10.0, 20.0)),
        ({"center_assign": "x=10,y=20"}, (10.0, 20.0)),
        ({"center_assign": "x=10"}, (10.0, -75.0)),
        ({"xcenter_assign": 10, "ycenter_assign": 20}, (10.0, 20.0)),
        ({"ycenter_assign": 20}, (0.0, 20.0)),
        ({"center_assign": "present_position"}, (7.0, 8.0)),
    ],
)
def test_the_polygon_can_be_moved(assignment, center):
    rig = loiter(**assignment)
    rig.own(7.0, 8.0, 0.0, 1.0)
    rig.iterate(2)
    assert behavior(rig).polygon.center == pytest.approx(center)
    assert behavior(rig).polygon.max_radius == pytest.approx(39.9, abs=0.1)


def test_a_new_polygon_is_acquired_at_once():
    rig = loiter(updates="UP")
    rig.own(0.0, -30.0, 90.0, 1.0)
    rig.iterate(3)
    rig.mail("UP", "polygon = radial:: x=0,y=300,radius=20,pts=6")
    rig.iterate()
    assert rig.posted("LOITER_MODE")[-1] == "recovering_external"
    assert rig.decision["course"] < 20 or rig.decision["course"] > 340
    assert behavior(rig).polygon.center[1] == pytest.approx(300)


@pytest.mark.parametrize(("amount", "radius"), [(10.0, 50.0), (-10.0, 30.0), (-300.0, 5.0)])
def test_its_polygon_can_be_grown_and_shrunk_down_to_five_metres(amount, radius):
    rig = loiter(updates="UP")
    before = behavior(rig).polygon.max_radius
    rig.own(0.0, -30.0, 90.0, 1.0)
    rig.mail("UP", f"mod_poly_rad = {amount}")
    rig.iterate()
    assert behavior(rig).polygon.max_radius == pytest.approx(radius + before - 40.0, abs=0.2)


def test_the_other_speed_is_used_when_it_is_not_negative():
    rig = loiter(speed_alt=1, use_alt_speed="true", updates="UP")
    rig.own(0.0, -30.0, 90.0, 1.0)
    rig.iterate()
    assert rig.decision["speed"] == 1.0
    rig.mail("UP", "speed_alt=-1")
    rig.iterate()
    assert rig.decision["speed"] == 2.0


def test_names_of_posts_can_have_a_suffix():
    rig = loiter(post_suffix="north")
    rig.own(0.0, -30.0, 90.0, 1.0)
    rig.iterate()
    assert rig.posted("LOITER_MODE_NORTH")
    assert rig.posted("LOITER_REPORT_NORTH")
    assert not rig.posted("LOITER_MODE")
    assert rig.posted("LOITER_DIST_TO_VERT")


def test_a_slingshot_counts_only_what_is_turned_in_the_right_direction():
    rig = loiter(slingshot=90, clockwise="false", endflag="SLUNG=true")
    sailor = Sailor(rig, 50.0, -75.0, 0.0, 2.0)
    assert sailor.sail(200, lambda s: rig.posted("SLUNG"))
    assert 60.0 < (bearing(0.0, -75.0, 50.0, -75.0) - bearing(0.0, -75.0, sailor.x, sailor.y)) % 360.0 < 110.0
    assert rig.posted("LOITER_COMPLETE") == ["true"]
    assert list(rig.core.population) == []


def test_hints_are_read_leniently_and_unknown_ones_told():
    rig = loiter(
        visual_hints="vertex_color=green, nextpt_lcolor=red, edge_size=nonsense, glow=3, label=patrol"
    )
    rig.own(0.0, -30.0, 90.0, 1.0)
    rig.iterate()
    polygon = str(rig.posted("VIEW_POLYGON")[-1])
    assert "vertex_color=green" in polygon
    assert "label=patrol" in polygon
    assert "edge_size=1" in polygon
    assert "label_color=red" in str(rig.posted("VIEW_POINT")[-1])
    events = " ".join(str(e) for e in rig.posted("BHV_EVENT"))
    assert "glow" in events
    assert "edge_size" in events


def test_lean_policy_draws_nothing():
    rig = loiter(comms_policy="lean")
    rig.own(0.0, -30.0, 90.0, 1.0)
    rig.iterate(3)
    assert not rig.posted("VIEW_POLYGON")
    assert not rig.posted("VIEW_POINT")


def test_macros_name_the_polygon():
    rig = loiter(runflag=["C=$[CX],$[CY]", "R=$[RAD]", "W=$[CWISE]", "P=$[PTS]", "CC=$[CENTER]"])
    rig.own(0.0, -30.0, 90.0, 1.0)
    rig.iterate()
    assert rig.posted("C") == ["0,-75"]
    assert rig.posted("CC") == ["0,-75"]
    assert rig.posted("W") == ["true"]
    assert str(rig.posted("P")[0]).startswith("pts={15,-38:")
    assert rig.posted("R")[0] == pytest.approx(39.925, abs=0.01)


def test_the_spd_shape_prefers_the_speed_asked_for():
    rig = loiter(ipf_type="zaic_spd")
    rig.own(0.0, -30.0, 90.0, 1.0)
    rig.iterate()
    assert rig.decision["speed"] == 2.0
    table = rig.outcome("loiter").function.table()
    best = int(rig.decision["course"])
    assert table[best, -1] < table[best, 8] == pytest.approx(100.0)


# --- entries ----------------------------------------------------------------------------------------------

outside = st.tuples(st.floats(-90, 90), st.floats(-90, 90)).filter(lambda p: not SQUARE.contains(*p))


@settings(max_examples=150, deadline=None)
@given(place=outside, clockwise=st.booleans())
def test_the_line_to_the_entry_does_not_cross_the_polygon(place, clockwise):
    shape = SQUARE if clockwise else SQUARE.reversed()
    vertex = shape.points[entry_from_outside(shape, clockwise, *place)]
    inner = [(0.999 * a, 0.999 * b, 0.999 * c, 0.999 * d) for a, b, c, d in shape.edges]
    assert not any(segments_cross(*place, *vertex, *edge) for edge in inner)


@settings(max_examples=100, deadline=None)
@given(place=outside, heading=st.floats(0, 360))
def test_the_better_direction_needs_the_smaller_turn(place, heading):
    other = SQUARE.reversed()
    clockwise = better_clockwise(SQUARE, other, *place, heading)

    def turn(shape, way):
        return angle_diff(heading, bearing(*place, *shape.points[entry(shape, way, *place, heading, 0.0)]))

    assert clockwise == (turn(SQUARE, True) < turn(other, False))


def test_best_direction_is_chosen_again_on_each_activation():
    rig = HelmRig(
        [
            (
                "BHV_Loiter",
                {"name": "l", "polygon": OCTAGON, "clockwise": "best", "speed": 1, "condition": "GO=1"},
            )
        ]
    )
    ways = []
    for heading in (250.0, 220.0):
        rig.own(100.0, -20.0, heading, 1.0)
        rig.mail("GO", 1)
        rig.iterate()
        ways.append(rig.life("l").behavior.clockwise)
        rig.mail("GO", 0)
        rig.iterate()
    assert ways == [False, True]
