"""MemoryTurnLimit and the heading behaviours of behaviors.md C15 and C25, AbortToPoint of C26."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sailing import Sailor

from behaviors.heading_memory import HeadingMemory
from ivp_helm.testing import HelmRig
from pymoos_lite.geometry.angles import angle_diff


def one(kind, at=90.0, sailing=1.5, **parameters):
    rig = HelmRig([(kind, {"name": "b", **parameters})])
    rig.own(0.0, 0.0, at, sailing)
    return rig


def table(rig):
    return rig.outcome("b").function.table()


@given(st.lists(st.tuples(st.floats(0, 2), st.floats(0, 360)), min_size=1, max_size=30), st.floats(0, 10))
def test_the_memory_agrees_with_averaging_by_hand(steps, window):
    memory, now, history = HeadingMemory(), 0.0, []
    for pause, heading in steps:
        now += pause
        history.append((now, heading))
        memory.add(now, heading, window)
    kept = [h for t, h in history if now - t <= window + 1e-9]
    east, north = sum(math.sin(math.radians(h)) for h in kept), sum(math.cos(math.radians(h)) for h in kept)
    if math.hypot(east, north) > 1e-3:
        mean = math.degrees(math.atan2(east, north)) % 360.0
        assert angle_diff(memory.mean, mean) < 1e-6
        wanted = sum(angle_diff(h, mean) ** 2 for h in kept) / len(kept)
        assert memory.deviation == pytest.approx(math.sqrt(wanted), abs=1e-3)


@pytest.mark.parametrize(("speed", "width"), [(3.0, 60), (1.5, 60), (0.75, 30), (0.0, 12)])
def test_a_slow_vessel_may_turn_less(speed, width):
    rig = one("BHV_MemoryTurnLimit", 90.0, speed, memory_time=5, turn_range=60)
    rig.iterate()
    allowed = np.flatnonzero(table(rig) > 50.0)
    assert (allowed[0], allowed[-1]) == (90 - width, 90 + width)


def test_the_window_is_about_the_mean_of_the_last_headings():
    rig = one("BHV_MemoryTurnLimit", memory_time=1, turn_range=40)
    for heading in (0.0, 0.0, 340.0, 350.0, 10.0, 20.0, 30.0):
        rig.own(0.0, 0.0, heading, 1.5)
        rig.iterate()
    assert rig.posted("MEM_HDG_AVG")[-1] == 6.0  # 340, 350, 10, 20, 30


def test_both_of_its_parameters_are_needed():
    rig = one("BHV_MemoryTurnLimit", memory_time=1)
    rig.iterate()
    assert rig.posted("BHV_WARNING") == ["b: turn_range is not set"]
    assert rig.reason == "NothingToDo"


def test_a_given_heading_is_maintained_instead_of_the_first_one():
    rig = one("BHV_MaintainHeading", 45.0, heading=200, duration="no-time-limit")
    rig.iterate()
    assert rig.core.trace.decision == {"course": 200.0}


def test_the_heading_maintained_is_that_of_the_latest_activation():
    rig = one("BHV_MaintainHeading", duration="no-time-limit", condition="GO=1")
    for heading in (45.0, 120.0):
        rig.own(0.0, 0.0, heading, 1.0)
        rig.mail("GO", 1)
        rig.iterate()
        assert rig.core.trace.decision == {"course": heading}
        rig.mail("GO", 0)
        rig.iterate()


@pytest.mark.parametrize(("bias", "liked", "disliked"), [("right", 130, 50), ("left", 50, 130)])
def test_a_bias_is_to_one_side(bias, liked, disliked):
    rig = one("BHV_HeadingBias", 90.0, bias=bias)
    rig.iterate()
    assert table(rig)[[liked, disliked]] == pytest.approx([100.0, 0.0])


@pytest.mark.parametrize(
    ("side", "delta", "start"),
    [("starboard", 40, 340), ("port", 40, 20), ("port", 250, 0), ("starboard", 359, 10)],
)
def test_a_change_of_heading_completes_at_its_goal_across_north_too(side, delta, start):
    rig = one("BHV_HeadingChange", heading_delta=delta, turn_type=side, turn_speed=1, endflag="DONE=$[OSH]")
    rig.mail("DESIRED_SPEED", 1.5)
    sailor = Sailor(rig, 0.0, 0.0, start, 1.0, turn_rate=20.0)
    # The vessel turns the short way; help it around the long way for turns beyond 180.
    sign = 1.0 if side == "starboard" else -1.0
    for _ in range(200):
        sailor.sail(0.25)
        if rig.posted("DONE"):
            break
        sailor.heading = (start + sign * min(delta, 5.0 * (len(sailor.track)))) % 360.0
    goal = (start + sign * delta) % 360.0
    assert angle_diff(rig.posted("DONE")[0], goal) <= 5.0
    assert rig.posted("HEADING_GOAL") == [goal]


def test_a_change_of_heading_needs_to_know_the_speed_asked_for():
    rig = one("BHV_HeadingChange", heading_delta=40)
    rig.iterate()
    assert rig.posted("BHV_WARNING") == [
        "b: DESIRED_SPEED dbl info not found in helm info_buffer",
        "b: Problem retrieving info from info_buffer.",
    ]
    assert rig.reason == "NothingToDo"
    rig.mail("DESIRED_SPEED", 2)
    rig.iterate()
    assert rig.decision == {"course": 130.0, "speed": 2.0}


def test_its_weight_is_its_priority():
    rig = one("BHV_HeadingChange", pwt=70)
    rig.mail("DESIRED_SPEED", 2)
    rig.iterate()
    assert rig.outcome("b").function.weight == 70.0


def test_steady_sailing_widens_the_window_of_hysteresis():
    rig = one("BHV_Hysteresis", 90.0, memory_time=10)
    rig.iterate(8)
    steady = np.count_nonzero(table(rig) >= 89.9)
    for heading in (20.0, 160.0, 20.0, 160.0, 90.0):
        rig.own(0.0, 0.0, heading, 1.0)
        rig.iterate()
    wild = np.count_nonzero(table(rig) >= 89.9)
    assert steady == 281
    assert 10 <= wild < 60
    assert rig.posted("HYSTER_HDG_AVG")[0] == 90.0


def test_the_course_asked_for_can_be_watched():
    rig = one("BHV_HeadingHysteresis", memory_time=10, filter_var="WANTED")
    rig.iterate()
    for heading in (350.0, 10.0):
        rig.mail("WANTED", heading)
        rig.iterate()
    assert rig.posted("HIST_HEADING_AVERAGE")[-1] == pytest.approx(0.0, abs=1e-9)
    assert rig.posted("HIST_HEADING_VARIANCE")[-1] == pytest.approx(100.0)
    assert rig.reason == "NothingToDo"


def test_an_abort_steers_for_its_point_and_never_completes():
    rig = one("BHV_AbortToPoint", point="30,0", speed=2)
    sailor = Sailor(rig, 0.0, 0.0, 0.0, 0.0)
    assert sailor.sail(60, lambda s: s.distance_to(30, 0) < 2.0)
    sailor.sail(5)
    assert list(rig.core.population)


@pytest.mark.parametrize("missing", ["point", "speed"])
def test_an_abort_needs_point_and_speed(missing):
    parameters = {"name": "b", "point": "30,0", "speed": 2}
    del parameters[missing]
    rig = HelmRig([("BHV_AbortToPoint", parameters)], faulty=True)
    assert rig.core.authority.malconfig
