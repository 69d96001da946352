"""The operation regions beyond the measured cases (behaviors.md C5, C23, C24)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sailing import Sailor

from behaviors.region_watch import RegionWatch
from behaviors.way_back import ray_distances, way_back
from ivp_helm.ivp import Domain
from ivp_helm.testing import HelmRig
from pymoos_lite.geometry.polygon import Polygon

BOX = "pts={-50,-50:-50,50:50,50:50,-50}"
SQUARE = Polygon(((-50.0, -50.0), (-50.0, 50.0), (50.0, 50.0), (50.0, -50.0)))
DOMAIN = Domain.from_entries(["course:0:359:360", "speed:0:4:9"])


def region(kind="BHV_OpRegionV24", **parameters):
    key = "core_poly" if kind == "BHV_OpRegionV24" else "polygon"
    given = {"name": "op", key: BOX, **parameters}
    return HelmRig([(kind, {k: v for k, v in given.items() if v is not None})])


def at(rig, x, y=0.0, heading=90.0, times=1, **mail):
    rig.own(x, y, heading, 1.5)
    for variable, value in mail.items():
        rig.mail(variable, value)
    rig.iterate(times)


# --- the way back -----------------------------------------------------------------------------------------

places = st.tuples(st.floats(-200, 200), st.floats(-200, 200)).filter(lambda p: SQUARE.signed_dist(*p) > 1.0)


@settings(max_examples=60, deadline=None)
@given(place=places)
def test_rays_meet_the_region_where_the_slow_geometry_says(place):
    courses = np.arange(0.0, 360.0, 3.0)
    fast = ray_distances(SQUARE, *place, courses)
    slow = [SQUARE.ray_dist(*place, course) for course in courses]
    # Rays that graze a corner may be taken for either.
    differing = [abs(a - b) > 1e-6 * max(1.0, b) for a, b in zip(fast, slow, strict=True)]
    assert sum(differing) <= 2


@settings(max_examples=60, deadline=None)
@given(place=places, heading=st.floats(0, 360))
def test_the_best_way_back_leads_into_the_region(place, heading):
    back = way_back(DOMAIN, SQUARE, *place, heading)
    utility = back.course.table()
    best = int(np.argmax(utility))
    assert SQUARE.ray_dist(*place, best) >= 0.0
    assert utility.min() >= -1e-9
    assert utility.max() <= 100.0 + 1e-9
    missed = [h for h in range(360) if SQUARE.ray_dist(*place, h) < 0.0]
    assert utility[missed].max(initial=0.0) <= 1e-9


@settings(max_examples=60, deadline=None)
@given(place=places, heading=st.floats(0, 359))
def test_a_vessel_that_heads_away_is_bound_to_one_side(place, heading):
    back = way_back(DOMAIN, SQUARE, *place, heading)
    if SQUARE.ray_dist(*place, heading) >= 0.0:
        assert back.side == "none"
        return
    assert back.side in ("left", "right")
    for course, utility in enumerate(back.course.table()):
        turn = (course - heading) % 360.0
        if utility > 1e-6:
            assert (turn > 180.0) == (back.side == "left")
    other = "right" if back.side == "left" else "left"
    assert way_back(DOMAIN, SQUARE, *place, heading, other).side == other  # once bound it stays so


# --- V24 --------------------------------------------------------------------------------------------------


def test_it_comes_back_when_the_vessel_has_left_and_says_nothing_inside():
    rig = HelmRig(
        [
            (
                "BHV_OpRegionV24",
                {"name": "op", "core_poly": BOX, "save_dist": 0, "halt_dist": 200, "pwt": 300},
            ),
            ("BHV_ConstantHeading", {"name": "away", "heading": 90, "duration": "no-time-limit"}),
            ("BHV_ConstantSpeed", {"name": "fast", "speed": 2, "duration": "no-time-limit"}),
        ]
    )
    sailor = Sailor(rig, 0.0, 0.0, 90.0, 2.0)
    assert sailor.sail(60, lambda s: s.x > 52.0)
    assert sailor.sail(60, lambda s: s.x < 49.0)
    assert max(x for x, _ in sailor.track) < 62.0


def test_save_flags_go_out_once_for_each_time_it_leaves():
    rig = region(save_dist=5, save_flag="OUT=true", savex_flag="FAR=$[DIST_TO_SAVE]")
    at(rig, 0.0, times=6)
    at(rig, 60.0)
    at(rig, 61.0)
    at(rig, 0.0)
    at(rig, 60.0)
    assert rig.posted("OUT") == ["true"] * 2
    assert rig.posted("FAR") == [5.0, 6.0, 5.0]


def test_a_region_that_was_never_entered_is_not_defended():
    rig = region(save_dist=5, halt_dist=10)
    at(rig, 300.0, times=20)
    assert rig.reason == "NothingToDo"
    assert rig.posted("BHV_ERROR") == []


def test_leaving_the_halt_region_stops_the_vessel_with_flags():
    rig = region(halt_dist=20, breached_poly_flag="BREACH=$[SECS_OUT_HALT_POLY]")
    at(rig, 0.0, times=6)
    at(rig, 100.0, times=2)
    assert rig.posted("BHV_ERROR") == []
    at(rig, 100.0, times=2)
    assert rig.reason == "BehaviorError"
    assert rig.posted("BREACH") == [0.5, 0.75]


def test_without_entry_trigger_an_undefined_halt_region_stops_nobody():
    rig = region(trigger_on_poly_entry="false")
    at(rig, 0.0, times=8)
    assert rig.posted("BHV_ERROR") == []


def test_without_entry_trigger_being_outside_is_enough():
    rig = region(halt_dist=0, trigger_on_poly_entry="false")
    at(rig, 200.0, times=4)
    assert rig.posted("BHV_ERROR") == ["op: OpRegion HaltPoly Failure"] * 2


@pytest.mark.parametrize(
    ("limit", "mail", "error", "flag"),
    [
        ({"max_depth": 20}, {"NAV_DEPTH": 21}, "OpRegion Depth failure", "breached_depth_flag"),
        ({"max_depth": 20}, {"NAV_DEPTH": 19}, None, "breached_depth_flag"),
        ({"min_altitude": 5}, {"NAV_ALTITUDE": 4}, "OpRegion Altitude failure", "breached_altitude_flag"),
        ({"min_altitude": 5}, {"NAV_ALTITUDE": 6}, None, "breached_altitude_flag"),
        ({"min_altitude": 5}, {}, "No ownship altitude in info_buffer.", None),
    ],
)
def test_depth_and_altitude_are_limited(limit, mail, error, flag):
    rig = region(**limit, **({flag: "HIT=1"} if flag else {}))
    rig.own(0.0, 0.0, 0.0, 1.0, mail.get("NAV_DEPTH", 0.0))
    for variable, value in mail.items():
        rig.mail(variable, value)
    rig.iterate()
    assert rig.posted("BHV_ERROR") == ([f"op: {error}"] if error else [])
    assert rig.posted("HIT") == ([1.0] if error and flag else [])


def test_time_is_limited():
    rig = region(max_time=1, breached_time_flag="LATE=1")
    at(rig, 0.0, times=5)
    assert rig.posted("BHV_ERROR") == []
    at(rig, 0.0)
    assert rig.posted("BHV_ERROR") == ["op: OpRegion timeout failure"]
    assert rig.posted("LATE") == [1.0]


def test_a_reset_forgets_that_the_region_was_entered():
    rig = region(halt_dist=0, updates="UP")
    at(rig, 0.0, times=6)
    at(rig, 200.0, UP="reset=true")
    at(rig, 200.0, times=6)
    assert rig.posted("BHV_ERROR") == []


def test_a_new_core_region_arrives_by_its_variable():
    rig = region(save_dist=5, dynamic_region_var="AREA")
    at(rig, 0.0, times=2)
    at(rig, 0.0, AREA="pts={100,0:100,50:150,50:150,0}")
    assert rig.posted("COMMITTED")
    assert 45 < rig.decision["course"] < 100
    at(rig, 0.0, AREA="nonsense")
    assert "AREA" in str(rig.posted("BHV_WARNING")[-1])


def test_a_distance_without_a_core_is_a_configuration_error():
    rig = HelmRig([("BHV_OpRegionV24", {"name": "op", "save_dist": 5})], faulty=True)
    assert "save_dist needs a core_poly" in " ".join(str(p) for p in rig.core.problems)


def test_macros_tell_distances_and_times():
    flags = [
        f"{name}=$[{name}]"
        for name in ("DIST_TO_CORE", "TRAJ_DIST_TO_CORE", "ETA_TO_SAVE", "TRAJ_ETA_TO_HALT")
    ]
    rig = region(
        save_dist=10, halt_dist=30, runflag=[*flags, "POLY=$[CORE_POLY]", "T=$[TIME_LEFT]"], max_time=60
    )
    at(rig, 10.0, 0.0, 0.0)
    assert rig.posted("DIST_TO_CORE") == [40.0]
    assert rig.posted("TRAJ_DIST_TO_CORE") == [50.0]  # straight north
    assert rig.posted("ETA_TO_SAVE") == [10.0]  # 50 m at 5 m/s
    assert rig.posted("TRAJ_ETA_TO_HALT") == [16.0]
    assert rig.posted("POLY") == [BOX]
    assert rig.posted("T") == [60.0]


def test_regions_are_drawn_in_the_colours_asked_for():
    rig = region(save_dist=10, visual_hints="core_edge_color=green,save_vertex_size=4")
    at(rig, 0.0)
    core, save = (str(p) for p in rig.posted("VIEW_POLYGON")[:2])
    assert "edge_color=green" in core
    assert "vertex_size=0" in core
    assert "edge_color=gray50" in save
    assert "vertex_size=4" in save


# --- the older ones ---------------------------------------------------------------------------------------


def test_the_old_region_is_enforced_at_once_unless_an_entry_time_is_given():
    strict = region("BHV_OpRegion")
    at(strict, 200.0, times=3)
    assert strict.reason == "BehaviorError"
    lenient = region("BHV_OpRegion", trigger_entry_time=1)
    at(lenient, 200.0, times=9)
    assert lenient.posted("BHV_ERROR") == []


def test_a_soft_breach_takes_manual_control_instead_of_stopping():
    rig = region("BHV_OpRegion", soft_poly_breach="true", breached_poly_flag="OUT=1")
    at(rig, 200.0, times=4)
    assert rig.posted("MOOS_MANUAL_OVERRIDE") == ["true"]
    assert rig.posted("BHV_ERROR") == []
    assert rig.posted("OUT") == [1.0]
    assert "containment failure" in str(rig.posted("BHV_WARNING")[0])


@pytest.mark.parametrize(("word", "forgiven"), [("depth", True), ("altitude", False), ("true", True)])
def test_breaches_can_be_forgotten_one_by_one(word, forgiven):
    rig = region("BHV_OpRegion", max_depth=5, breached_depth_flag="DEEP=1", reset_var="RESET")
    rig.own(0.0, 0.0, 0.0, 1.0, 9.0)
    rig.iterate(2)
    assert rig.posted("DEEP") == [1.0]
    assert rig.posted("BHV_ERROR") == ["op: OpRegion Depth failure: max:5 detected:9"] * 2
    rig.mail("RESET", word)
    rig.iterate()
    assert rig.posted("DEEP") == [1.0] * (1 + forgiven)


def test_the_time_left_is_told_where_asked_for():
    rig = region("BHV_OpRegion", max_time=10, time_remaining_var="LEFT")
    at(rig, 0.0, times=3)
    assert rig.posted("LEFT") == [10.0, 9.75, 9.5] == rig.posted("OPREG_TIME_REMAINING")


def test_the_old_recovery_steers_back_after_entry_and_exit_times():
    rig = region("BHV_OpRegionRecover", buffer_dist=5, trigger_entry_time=0.5)
    at(rig, 0.0, times=3)
    at(rig, 70.0, heading=90.0, times=2)
    assert rig.reason == "NothingToDo"
    assert rig.posted("OPR_DEBUG")[-1] == "not in poly"
    at(rig, 70.0, heading=90.0)
    assert rig.decision["course"] == 270.0
    assert rig.decision["speed"] == pytest.approx(0.25)
    assert rig.posted("OPR_TURN") == ["right"]


def test_the_old_recovery_takes_new_regions_and_resets():
    rig = region("BHV_OpRegionRecover", dynamic_region_var="AREA", reset_var="RESET", trigger_entry_time=0)
    at(rig, 0.0)
    at(rig, 0.0, AREA="pts={100,-50:100,50:150,50:150,-50}")
    at(rig, 0.0, times=2)
    assert rig.decision["course"] == 90.0
    at(rig, 0.0, RESET="true")
    at(rig, 0.0, times=4)
    assert rig.reason == "NothingToDo"


# --- clocks -----------------------------------------------------------------------------------------------


@given(st.lists(st.booleans(), min_size=1, max_size=40), st.integers(0, 5), st.integers(0, 5))
def test_the_watch_agrees_with_counting_by_hand(inside, entry, leave):
    watch = RegionWatch()
    for k, now_inside in enumerate(inside):
        watch.update(now_inside, float(k), float(entry))
        same = 0
        while same < k and inside[k - same - 1] == now_inside:
            same += 1
        assert (watch.seconds_inside, watch.seconds_outside) == ((same, 0) if now_inside else (0, same))
        assert watch.left(float(leave)) == (not now_inside and same >= leave)
    runs = [len(run) for run in "".join("x" if i else "." for i in inside).split(".")]
    assert watch.entered == (max(runs) - 1 >= entry)


def test_region_distances_are_metres():
    assert ray_distances(SQUARE, 0.0, 0.0, np.array([0.0, 45.0])) == pytest.approx(
        [50.0, 50.0 * math.sqrt(2)]
    )
