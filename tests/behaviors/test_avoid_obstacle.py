"""What the golden cases of AvoidObstacleV24 do not show."""

from __future__ import annotations

import numpy as np
import pytest

from ivp_helm.testing import HelmRig

SQUARE = "pts={40,-10:40,10:60,10:60,-10},label=ob_3"


def rig(kind="BHV_AvoidObstacleV24", x=0.0, y=0.0, heading=90.0, faulty=False, turn_model="", **parameters):
    lines = [
        ("name", "b"),
        ("polygon", SQUARE),
        ("id", "ob_3"),
        ("holonomic_ok", "true"),
        *parameters.items(),
    ]
    helm = HelmRig([(kind, lines)], faulty=faulty, turn_model=turn_model, period=1.0)
    helm.own(x, y, heading, 1.0)
    return helm


def test_a_course_that_hits_the_obstacle_has_its_full_weight():
    helm = rig(x=10, pwt_outer_dist=50)
    helm.iterate()
    assert helm.outcome("b").function.weight == pytest.approx(50.0)


def test_heading_past_it_matters_less_and_away_hardly():
    weights = []
    for heading in (90, 130, 205):
        helm = rig(x=10, heading=heading, pwt_outer_dist=50)
        helm.iterate()
        function = helm.outcome("b").function
        weights.append(function.weight if function is not None else None)
    assert weights[0] > weights[1] > 20.0
    assert weights[2] == pytest.approx(1.0)


@pytest.mark.parametrize(("outer", "weight"), [(10, 1.0), (29.5, 1.0), (30, 100.0)])
def test_an_outer_distance_may_equal_the_inner_one(outer, weight):
    """Full weight up to both, next to none beyond; the obstacle is 30 m off."""
    helm = rig(x=10, pwt_inner_dist=outer, pwt_outer_dist=outer, min_util_cpa_dist=5, max_util_cpa_dist=5)
    helm.iterate()
    assert helm.posted("BHV_ERROR") == []
    assert helm.outcome("b").function.weight == pytest.approx(weight)


def test_an_obstacle_astern_is_none():
    helm = rig(x=10, heading=270)
    helm.iterate()
    assert helm.outcome("b").state == "running"


@pytest.mark.parametrize("away", [0.2, 0.9, 1.0, 3.0, 7.0, 8.5, 20.0])
def test_however_near_there_is_a_way_out(away):
    helm = rig(x=40 - away, heading=0)
    helm.iterate()
    assert helm.reason == "clear"
    function = helm.outcome("b").function
    assert function.value(280, 2) == pytest.approx(100.0)
    assert function.value(90, 2) == pytest.approx(0.0)


@pytest.mark.parametrize(("wish", "reason"), [("true", "BehaviorError"), ("false", "NothingToDo")])
def test_inside_the_obstacle_the_vehicle_stops_unless_it_shall_not(wish, reason):
    helm = rig(x=50, allstop_on_breach=wish)
    helm.iterate()
    assert helm.reason == reason
    errors = helm.posted("BHV_ERROR")
    assert errors == (["b: Allstop: Obstacle Breached"] if wish == "true" else [])


def test_once_settled_the_side_stays():
    helm = rig(x=30, y=2)  # most of the obstacle lies to starboard
    helm.iterate()
    behavior = helm.life("b").behavior
    assert behavior.locked
    table = helm.outcome("b").function.table()[:, 5]
    assert table[330] == pytest.approx(100.0)  # the obstacle stays to starboard
    assert table[230] == 0.0  # it would come to port
    helm.own(-8, 2, 90, 1)
    helm.iterate()
    assert not behavior.locked


def test_a_turn_model_makes_tight_turns_worthless():
    tables = []
    for model in ("alg=holo", "alg=dubins # radius=15 # degs=10"):
        helm = rig(x=24, y=-3, turn_model=model)
        helm.iterate()
        behavior = helm.life("b").behavior
        behavior.locked = False
        tables.append(behavior.utilities(behavior.config.polygon))
    assert tables[1][10] < tables[0][10]
    assert np.all(tables[1] <= tables[0] + 1e-9)


@pytest.mark.parametrize(
    ("parameters", "complaint"),
    [
        ({"pwt_inner_dist": 40, "pwt_outer_dist": 30}, "pwt_inner_dist"),
        ({"pwt_outer_dist": 60, "completed_dist": 50}, "completed_dist"),
        ({"min_util_cpa_dist": 20, "max_util_cpa_dist": 10}, "min_util_cpa_dist"),
        ({"rng_flag": "@cpa NEAR=1"}, "rng_flag"),
        ({"polygon": "pts={0,0:9,0}"}, "polygon"),
        ({"id": "ob_4"}, "ob_3"),
    ],
)
def test_mistakes_are_told(parameters, complaint):
    helm = rig(faulty=True, **parameters)
    assert complaint in str(helm.core.problems[0])


def test_distances_that_nobody_gave_follow_those_that_somebody_did():
    config = rig(pwt_outer_dist=200, min_util_cpa_dist=30).life("b").behavior.config
    assert (config.pwt_inner_dist, config.completed_dist, config.max_util_cpa_dist) == (10.0, 200.0, 30.0)
    config = rig(completed_dist=5).life("b").behavior.config
    assert (config.pwt_inner_dist, config.pwt_outer_dist) == (5.0, 5.0)


@pytest.mark.parametrize("kind", ["BHV_AvoidObstacle", "BHV_AvoidObstacleX", "BHV_AvoidObstacleV21"])
def test_older_names_and_parameters_are_understood(kind):
    helm = rig(kind, buffer_dist=5, i_understand_this_behavior_is_deprecated="true")
    assert helm.life("b").behavior.config.min_util_cpa_dist == 5.0


def test_it_tells_the_closest_point_once_it_is_past():
    helm = rig(y=-40, heading=90, cpa_flag="CPA=$[CPA]", pwt_outer_dist=100, completed_dist=300)
    for x in range(0, 120, 5):
        helm.own(x, -40, 90, 1)
        helm.iterate()
    assert helm.posted("CPA") == [30.0]


@pytest.mark.parametrize(("x", "done"), [(-8, False), (-12, True)])
def test_it_ends_beyond_its_distance(x, done):
    helm = rig(x=x, endflag="DONE=$[OID]")
    helm.iterate()
    assert (helm.outcome("b").state == "completed") == done
    assert helm.posted("DONE") == (["ob_3"] if done else [])


def test_flags_know_range_side_and_name():
    helm = rig(x=10, rng_flag="SEEN=$[RNG] $[BNG] $[RBNG] $[SIDE] $[OIDX] $[SLOCK] $[MINU_CPA] $[MAXU_CPA]")
    helm.iterate()
    assert helm.posted("SEEN") == ["30 90 0 port 3 false 8 16"]


TEMPLATE = {"name": "ob_", "templating": "spawn", "updates": "OBSTACLE_ALERT", "pwt_outer_dist": 40}


def test_a_template_asks_for_alerts_and_is_spawned_by_one():
    helm = HelmRig([("BHV_AvoidObstacleV24", {**TEMPLATE, "holonomic_ok": "true"})], period=1.0)
    helm.own(10, 0, 90, 1)
    helm.iterate()
    assert helm.posted("OBM_ALERT_REQUEST") == ["name=ob_,update_var=OBSTACLE_ALERT,alert_range=40"]
    helm.mail("OBSTACLE_ALERT", f"name=ob_ob_3#poly={SQUARE}#id=ob_3")
    helm.iterate()
    assert helm.outcome("ob_ob_3").state == "active"
    helm.mail("OBM_RESOLVED", "ob_3")
    helm.iterate()
    assert helm.core.population.lives == []


def test_a_vessel_that_turns_on_the_spot_is_worth_a_warning():
    helm = rig(x=10, holonomic_ok="false")
    helm.iterate(2)
    assert helm.posted("BHV_WARNING") == ["b: holo plat_model"]


def test_it_obeys_the_able_filter_of_its_obstacle():
    helm = rig(x=10, can_disable="true")
    helm.iterate()
    helm.mail("BHV_ABLE_FILTER", "action=disable, obstacle_id=ob_3")
    helm.iterate()
    assert helm.outcome("b").state == "disabled"
