"""What the golden cases of AvoidCollision, CutRange, Trail, Shadow and Convoy do not show."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behaviors import _kernels
from ivp_helm.testing import HelmRig
from pymoos_lite.geometry.cpa import CpaEngine, unit_vectors


def rig(kind, turn_model="", domain=("course:0:359:360", "speed:0:4:21"), faulty=False, **parameters):
    lines = [("name", "b"), ("contact", "ben"), *parameters.items()]
    helm = HelmRig([(kind, lines)], turn_model=turn_model, domain=domain, faulty=faulty)
    helm.own(0, 0, 0, 1.5)
    return helm


def meet(helm, x, y, heading=180.0, speed=1.0, times=1):
    helm.contacts([{"name": "ben", "x": x, "y": y, "heading": heading, "speed": speed}])
    helm.iterate(times)


# --- utilities -------------------------------------------------------------------------------------------

positions = st.floats(-300.0, 300.0)


@settings(max_examples=60, deadline=None)
@given(
    positions,
    positions,
    st.floats(0, 360),
    st.floats(0, 4),
    st.floats(0, 200),
    st.floats(0, 40),
    st.floats(0, 60),
)
def test_the_avoidance_kernel_agrees_with_one_course_at_a_time(x, y, heading, speed, horizon, near, more):
    courses, speeds = np.arange(0.0, 360.0, 40.0), np.array([0.0, 0.7, 2.0, 4.0])
    engine = CpaEngine(x, y, heading, speed, 5.0, -3.0)
    far = near + more
    found = np.empty((9, 4))
    velocity = engine.contact_velocity
    _kernels.avoidance(
        5.0 - x, -3.0 - y, *velocity, *unit_vectors(courses), speeds, horizon, near, far, found
    )
    for i, course in enumerate(courses):
        for j, own_speed in enumerate(speeds):
            cpa = engine.eval_cpa(course, own_speed, horizon)
            if min(abs(cpa - near), abs(cpa - far)) < 1e-6:
                continue  # a step lies there
            utility = 0.0 if cpa < near else 100.0 if cpa > far else 25.0 + 75.0 * (cpa - near) / more
            assert found[i, j] == pytest.approx(utility, abs=1e-6)


@settings(max_examples=40, deadline=None)
@given(positions, positions, st.floats(0, 360), st.floats(0, 4), st.floats(0, 200), st.floats(0, 40))
def test_the_scattered_avoidance_kernel_agrees_with_that_of_the_whole_table(
    x, y, heading, speed, horizon, near
):
    courses, speeds = np.arange(0.0, 360.0, 40.0), np.array([0.0, 0.7, 2.0, 4.0])
    engine = CpaEngine(x, y, heading, speed, 5.0, -3.0)
    east, north = unit_vectors(courses)
    table, found = np.empty((9, 4)), np.empty(36)
    place = (5.0 - x, -3.0 - y, *engine.contact_velocity)
    _kernels.avoidance(*place, east, north, speeds, horizon, near, near + 20.0, table)
    vx, vy = np.outer(east, speeds).ravel(), np.outer(north, speeds).ravel()
    _kernels.avoidance_at(*place, vx, vy, horizon, near, near + 20.0, found)
    assert np.array_equal(found, table.ravel())


@settings(max_examples=60, deadline=None)
@given(positions, positions, st.floats(0, 360), st.floats(0, 4), st.floats(0, 100), st.floats(0, 1))
def test_the_pursuit_kernel_agrees_with_one_course_at_a_time(x, y, heading, speed, horizon, patience):
    engine = CpaEngine(x, y, heading, speed, 1.0, 2.0)
    if engine.range < 1.0:
        return
    courses, speeds = np.arange(0.0, 360.0, 40.0), np.array([0.0, 0.7, 4.0])
    slowest, fastest = engine.min_max_roc(4.0)
    found = np.empty((9, 3))
    velocity = engine.contact_velocity
    unit = unit_vectors(courses)
    _kernels.pursuit(1.0 - x, 2.0 - y, *velocity, *unit, speeds, horizon, patience, slowest, fastest, found)
    for i, course in enumerate(courses):
        for j, own_speed in enumerate(speeds):
            closing = (engine.eval_roc(course, own_speed) - slowest) / (fastest - slowest)
            nearing = 1.0 - engine.eval_cpa(course, own_speed, horizon) / engine.range
            wanted = 100.0 * ((1.0 - patience) * closing + patience * nearing)
            assert found[i, j] == pytest.approx(wanted, abs=1e-6)


# --- AvoidCollision --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("parameters", "wanted"),
    [
        ({"pwt_outer_dist": 30}, (30.0, 30.0)),
        ({"pwt_inner_dist": 300}, (300.0, 300.0)),
        ({"pwt_outer_dist": 90, "pwt_inner_dist": 20}, (20.0, 90.0)),
    ],
)
def test_setting_one_distance_drags_the_other_along(parameters, wanted):
    helm = rig("BHV_AvoidCollision", **parameters)
    config = helm.life("b").behavior.config
    assert (config.pwt_inner_dist, config.pwt_outer_dist) == wanted


def test_the_weight_never_exceeds_the_priority():
    helm = rig("BHV_AvoidCollision", pwt=150, pwt_inner_dist=40, pwt_outer_dist=40)
    meet(helm, 0, 15)
    assert helm.outcome("b").function.weight == 150.0


def test_a_vessel_passing_at_a_distance_hinders_no_course():
    helm = rig("BHV_AvoidCollision", pwt_outer_dist=300, max_util_cpa_dist=20, completed_dist=400)
    meet(helm, 200, 0, heading=90.0, speed=4.0)
    function = helm.outcome("b").function
    assert (function.minimum, function.maximum) == (100.0, 100.0)


def test_it_lives_until_the_contact_is_well_beyond_both_ranges():
    helm = rig("BHV_AvoidCollision", pwt_outer_dist=100, completed_dist=50)
    meet(helm, 0, 109)
    assert helm.outcome("b").state == "running"
    meet(helm, 0, 111)
    assert helm.outcome("b").state == "completed"


def test_a_turn_model_makes_courses_across_the_bow_worse():
    def utility(model, use):
        helm = rig("BHV_AvoidCollision", turn_model=model, pwt_outer_dist=100, use_plat_model=use)
        meet(helm, -12, 8, heading=90.0, speed=1.0)
        behavior = helm.life("b").behavior
        return behavior.utilities(behavior.meeting)

    at_once = utility("alg=holo", "true")
    assert (utility("alg=dubins # radius=20 # degs=10", "false") == at_once).all()
    assert (utility("alg=dubins # radius=20 # degs=10", "true") != at_once).any()


def test_below_the_collision_depth_every_course_is_good():
    domain = ("course:0:359:72", "speed:0:4:9", "depth:0:20:21")
    helm = rig(
        "BHV_AvoidCollision", domain=domain, collision_depth=10, pwt_outer_dist=100, max_util_cpa_dist=40
    )
    helm.own(0, 0, 0, 1.5, 3)
    meet(helm, 0, 50)
    function = helm.outcome("b").function
    assert function.value(0, 2, 3) < function.value(0, 2, 10) == function.value(180, 4, 10)
    assert function.value(0, 2, 10) > function.value(0, 2, 15)
    assert helm.posted("AVD_STATUS") == [""]


@pytest.mark.parametrize("depth", [0, 20, 50])
def test_a_collision_depth_that_is_never_exceeded_changes_nothing(depth):
    domain = ("course:0:359:72", "speed:0:4:9", "depth:0:20:21")
    helm = rig("BHV_AvoidCollision", domain=domain, collision_depth=depth, pwt_outer_dist=100)
    meet(helm, 0, 50)
    assert helm.outcome("b").function.domain.names == ("course", "speed")


def test_the_required_type_is_another_name_of_the_matched_one():
    helm = rig("BHV_AvoidCollision", contact_type_required="heron", exit_on_filter_vtype="true")
    meet(helm, 0, 50)
    assert helm.outcome("b").state == "completed"


def test_the_user_may_have_finer_pieces():
    helm = rig(
        "BHV_AvoidCollision", pwt_outer_dist=100, build_info="uniform_piece=discrete @ course:1,speed:1"
    )
    meet(helm, 5, 40)
    behavior = helm.life("b").behavior
    exact = behavior.utilities(behavior.meeting)
    exact = (exact - exact.min()) / (exact.max() - exact.min()) * 100.0
    assert np.abs(helm.outcome("b").function.table() - exact).max() < 1e-6


# --- CutRange --------------------------------------------------------------------------------------------


def test_it_gives_up_and_takes_up_again():
    helm = rig(
        "BHV_CutRange",
        pwt_outer_dist=50,
        pwt_inner_dist=10,
        giveup_range=100,
        pursueflag="PURSUIT=on",
        giveupflag="PURSUIT=off",
    )
    for y in (120, 101.5, 100.5, 60, 100.9, 101.5, 200, 90):
        meet(helm, 0, y)
    assert helm.posted("PURSUIT") == ["on", "off", "on"]


@pytest.mark.parametrize(("y", "weight"), [(5, None), (30, 50.0), (50, 100.0), (500, 100.0)])
def test_the_nearer_the_less_eager(y, weight):
    helm = rig("BHV_CutRange", pwt_outer_dist=50, pwt_inner_dist=10)
    meet(helm, 0, y)
    function = helm.outcome("b").function
    assert weight is None if function is None else function.weight == pytest.approx(weight)


def test_impatience_heads_for_the_contact_and_patience_for_where_it_will_be():
    courses = []
    for patience in (0, 85):
        helm = rig("BHV_CutRange", pwt_outer_dist=50, pwt_inner_dist=10, patience=patience, time_on_leg=60)
        meet(helm, 0, 80, heading=90.0, speed=2.0)
        courses.append(helm.decision["course"])
    assert courses[0] == 0.0
    assert 10.0 < courses[1] < 60.0


def test_distances_in_the_wrong_order_are_a_mistake():
    helm = rig("BHV_CutRange", pwt_outer_dist=5, pwt_inner_dist=10, faulty=True)
    assert "pwt_inner_dist" in str(helm.core.problems[0])


# --- Trail -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("parameters", "wanted"),
    [
        ({}, "x=0,y=150"),
        ({"trail_angle": 90}, "x=-50,y=100"),
        ({"trail_angle": -90, "trail_angle_type": "absolute"}, "x=-50,y=100"),
        ({"trail_range": 20, "mod_trail_range": -15}, "x=0,y=110"),
        ({"trail_range": 40, "mod_trail_range_pct": 150}, "x=0,y=160"),
    ],
)
def test_the_place_to_be_is_where_range_and_angle_put_it(parameters, wanted):
    helm = rig("BHV_Trail", **parameters)
    meet(helm, 0, 100, heading=180.0)
    assert str(helm.posted("VIEW_POINT")[0]).startswith(wanted)


def test_a_percentage_of_nothing_is_refused():
    helm = rig("BHV_Trail", mod_trail_range_pct=0, faulty=True)
    assert "percentage" in str(helm.core.problems[0])


@pytest.mark.parametrize(
    ("y", "region", "course"),
    [(-60, "Outside nm_radius", 0.0), (-12, "Inside nm_radius", 0.0), (2, "Inside radius", 0.0)],
)
def test_the_regions_around_the_place(y, region, course):
    helm = rig("BHV_Trail", trail_range=40)
    helm.own(0, y, 0, 1)
    meet(helm, 0, 40, heading=0.0, speed=1.0)
    assert helm.posted("REGION") == [region]
    assert helm.decision["course"] == course


def test_one_ahead_of_its_place_goes_slower_and_one_behind_faster():
    speeds = []
    for y in (-10, 0, 10):
        helm = rig("BHV_Trail", trail_range=40, radius=1)
        helm.own(3, y, 0, 1)
        meet(helm, 0, 40, heading=0.0, speed=2.0)
        speeds.append(helm.posted("TRAIL_SPEED")[0])
    assert speeds == pytest.approx([2.5, 2.0, 1.5])


def test_contacts_beyond_the_outer_distance_are_not_trailed():
    helm = rig("BHV_Trail", pwt_outer_dist=100)
    meet(helm, 0, 150)
    assert helm.outcome("b").function is None
    assert helm.posted("PURSUIT") == [0.0]


def test_the_distance_is_posted_while_idle_unless_it_shall_not_be():
    for wish, wanted in (("true", [150.0]), ("false", [])):
        helm = rig("BHV_Trail", condition="DEPLOY = true", post_trail_dist_on_idle=wish)
        meet(helm, 0, 100)
        assert helm.posted("TRAIL_DISTANCE") == wanted


# --- Shadow and Convoy -----------------------------------------------------------------------------------


def test_a_shadow_does_as_the_contact_does():
    helm = rig("BHV_Shadow")
    meet(helm, 500, 500, heading=123.0, speed=2.4)
    assert helm.decision == pytest.approx({"course": 123.0, "speed": 2.4})


def test_a_shadow_lets_contacts_beyond_its_range_go():
    helm = rig("BHV_Shadow", pwt_outer_dist=100)
    meet(helm, 500, 500)
    assert helm.posted("SHADOW_RELEVANCE") == [0.0]
    assert helm.outcome("b").function is None


def sail_convoy(helm, steps, speed=1.0):
    """The contact sails north from (0, 30), a metre per iteration; own ship stays."""
    for k in range(steps):
        meet(helm, 0, 30 + k, heading=0.0, speed=speed)


def test_marks_are_dropped_in_the_wake_and_steered_for():
    helm = rig("BHV_Convoy", inter_mark_range=10)
    sail_convoy(helm, 25)
    marks = [str(text) for text in helm.posted("VIEW_POINT")]
    assert [text.split(",label=")[0] for text in marks] == ["x=0,y=30", "x=0,y=41", "x=0,y=52"]
    assert helm.posted("WPTY") == [30.0]
    assert helm.decision["course"] == 0.0


def test_marks_are_taken_up_when_reached_and_numbers_come_round():
    helm = rig("BHV_Convoy", inter_mark_range=10, max_mark_range=20)
    sail_convoy(helm, 60)
    labels = [str(text).partition("label=")[2].partition(",")[0] for text in helm.posted("VIEW_POINT")]
    assert set(labels) == {"alpha_ben_0", "alpha_ben_1", "alpha_ben_2"}
    assert any("active=false" in str(text) for text in helm.posted("VIEW_POINT"))
    helm.own(0, helm.posted("WPTY")[-1], 0, 1)
    before = helm.posted("WPTY")[-1]
    helm.iterate()
    assert helm.posted("WPTY")[-1] > before


@pytest.mark.parametrize(("y", "factor"), [(10, 0.0), (20, 0.5), (50, 1.0), (90, 1.5)])
def test_speed_follows_the_gap(y, factor):
    helm = rig("BHV_Convoy")
    meet(helm, 0, y, heading=0.0, speed=2.0, times=3)
    assert helm.decision["speed"] == pytest.approx(2.0 * factor)


def test_a_cruise_speed_overrides_the_contact_but_not_the_limit():
    helm = rig("BHV_Convoy", cruise_speed=3, spd_max=1.2)
    meet(helm, 0, 50, heading=0.0, speed=2.0)
    assert helm.decision["speed"] == pytest.approx(1.2)
    assert any("cruise_speed" in str(text) for text in helm.posted("BHV_WARNING"))


def test_ranges_are_kept_apart_for_safety():
    helm = rig("BHV_Convoy", rng_estop=2, rng_tgating=8, rng_lagging=9)
    helm.iterate()
    config = helm.life("b").behavior.config
    assert (config.rng_estop, config.rng_tgating, config.rng_lagging) == (5.0, 15.0, 25.0)
    free = rig("BHV_Convoy", rng_estop=2, rng_tgating=8, rng_lagging=9, rng_safety="false")
    config = free.life("b").behavior.config
    assert (config.rng_estop, config.rng_tgating, config.rng_lagging) == (2.0, 8.0, 9.0)


def test_marks_are_erased_when_the_convoy_goes_idle():
    helm = rig("BHV_Convoy", condition="GO = true")
    helm.mail("GO", "true")
    sail_convoy(helm, 3)
    helm.mail("GO", "false")
    sail_convoy(helm, 1)
    assert "active=false" in str(helm.posted("VIEW_POINT")[-1])
