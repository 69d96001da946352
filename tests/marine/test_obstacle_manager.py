"""pObstacleMgr: obstacles given and made of points, and the alerts about them (marine_apps.md 6)."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from marine_harness import Sea, warnings_of

from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.specs import parse_polygon
from pymoos_lite.marine.obstacle_manager import ObstacleManager
from pymoos_lite.marine.obstacle_manager_core import convex_hull

ROCK = "pts={20,-5:30,-5:30,5:20,5},label=rock"
ASK = "name=avd_,update_var=OB_ALERT,alert_range=15"


def sea(config="", ask=True):
    there = Sea()
    there.manager = there.add(ObstacleManager, "pObstacleMgr", config)
    there.run(1.0)
    there.post("NAV_X", 0.0)
    there.post("NAV_Y", 0.0)
    if ask:
        there.post("OBM_ALERT_REQUEST", ASK)
    there.run(1.0)
    return there


def test_a_given_obstacle_is_alerted_when_it_comes_within_range():
    there = sea(f"given_obstacle = {ROCK}")
    assert there.heard("OB_ALERT") == []
    there.post("NAV_X", 6.0)
    there.run(1.0)
    assert there.heard("OB_ALERT") == [f"name=avd_rock#poly={ROCK}#id=rock"]
    there.run(5.0)
    assert len(there.heard("OB_ALERT")) == 1
    there.post("NAV_X", 0.0)
    there.run(1.0)
    there.post("NAV_X", 10.0)
    there.run(1.0)
    assert len(there.heard("OB_ALERT")) == 2


def test_nobody_is_alerted_before_somebody_asked():
    there = sea(
        f"given_obstacle = {ROCK}\ngeneral_alert = name=g,update_var=G_ALERT,alert_range=50", ask=False
    )
    there.post("NAV_X", 10.0)
    there.run(2.0)
    assert there.heard("OB_ALERT") == there.heard("G_ALERT") == []
    there.post("OBM_ALERT_REQUEST", ASK)
    there.run(1.0)
    assert len(there.heard("OB_ALERT")) == 1
    assert there.heard("G_ALERT") == [f"name=g_rock#poly={ROCK}#id=rock"]


def test_an_obstacle_by_mail_lasts_as_long_as_it_says():
    there = sea()
    there.post("NAV_X", 10.0)
    there.post("GIVEN_OBSTACLE", f"{ROCK},duration=5")
    there.run(4.0)
    assert there.heard("OBM_RESOLVED") == []
    there.post("GIVEN_OBSTACLE", f"{ROCK},duration=5")
    there.run(4.0)
    assert there.heard("OBM_RESOLVED") == []
    there.run(3.0)
    assert there.heard("OBM_RESOLVED") == ["rock"]
    assert "active=false" in there.last("VIEW_POLYGON")


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (ROCK, "duration"),
        (f"{ROCK},duration=100", "duration"),
        ("pts={0,0:9,0:9,9},duration=5", "label"),
        ("pts={0,0:9,0:1,1:0,9},label=a,duration=5", "convex"),
        ("nonsense", "polygon"),
    ],
)
def test_obstacles_that_cannot_be_used_are_refused(text, complaint):
    there = sea()
    there.post("GIVEN_OBSTACLE", text)
    there.run(1.0)
    assert there.manager.core.obstacles == {}
    assert any(complaint in warning for warning in warnings_of(there.manager))


def test_without_a_limit_any_duration_will_do():
    there = sea("given_max_duration = off")
    there.post("GIVEN_OBSTACLE", ROCK)
    there.run(100.0)
    assert list(there.manager.core.obstacles) == ["rock"]
    there.post("GIVEN_OBSTACLE", "label=rock,active=false")
    there.run(1.0)
    assert there.heard("OBM_RESOLVED") == ["rock"]


def test_points_make_an_obstacle_and_it_goes_with_them():
    there = sea("max_age_per_point = 5")
    for x, y in ((10, 0), (14, 0), (14, 4), (10, 4), (12, 2)):
        there.post("TRACKED_FEATURE", f"x={x},y={y},key=7,vsource=radar")
    there.run(1.0)
    alert = there.last("OB_ALERT")
    assert alert.startswith("name=avd_7#poly=pts={")
    assert alert.endswith(",label=7,vsource=radar#id=7")
    hull = parse_polygon(alert.partition("poly=")[2].partition("#")[0])
    assert sorted(hull.points) == [(10, 0), (10, 4), (14, 0), (14, 4)]
    there.run(6.0)
    assert there.heard("OBM_RESOLVED") == ["7"]


def test_points_in_a_row_become_an_octagon_around_them():
    there = sea()
    for x in (10, 11, 12):
        there.post("TRACKED_FEATURE", f"x={x},y=0,label=7")
    there.run(1.0)
    (obstacle,) = there.manager.core.obstacles.values()
    assert len(obstacle.polygon) == 8
    assert obstacle.polygon.centroid == pytest.approx((11, 0))
    assert obstacle.polygon.max_radius == pytest.approx(1.0)


def test_a_lasso_is_thrown_where_wanted():
    there = sea("lasso = true\nlasso_points = 5\nlasso_radius = 3")
    there.post("TRACKED_FEATURE", "x=10,y=0,key=7")
    there.run(1.0)
    (obstacle,) = there.manager.core.obstacles.values()
    assert len(obstacle.polygon) == 5
    assert obstacle.polygon.area == pytest.approx(2.5 * 9 * math.sin(math.radians(72)), rel=1e-6)


def test_a_point_that_is_the_same_to_a_decimetre_is_no_news():
    there = sea("max_pts_per_cluster = 3")
    for k in range(10):
        for x, y in ((10, 0), (14, 0), (12, 4)):
            there.post("TRACKED_FEATURE", f"x={x + 0.004 * (k % 2)},y={y},key=7")
        there.run(0.5)
    assert len(there.heard("OB_ALERT")) == 1


def test_far_points_are_counted_and_dropped():
    there = sea("ignore_range = 50")
    there.post("TRACKED_FEATURE", "x=60,y=0,key=7")
    there.run(1.0)
    assert there.manager.core.obstacles == {}
    assert there.manager.core.ignored_points == 1


@pytest.mark.parametrize("text", ["x=1,y=2", "x=1,key=3", "x=a,y=2,key=3", ""])
def test_a_point_without_place_or_key_is_none(text):
    there = sea()
    there.post("TRACKED_FEATURE", text)
    there.run(1.0)
    assert any("nvalid point" in warning or "point" in warning for warning in warnings_of(there.manager))


@pytest.mark.parametrize(("policy", "count"), [("true", 2), ("close", 1), ("false", 0)])
def test_ranges_are_told_by_policy(policy, count):
    far = "pts={200,0:210,0:210,9},label=far"
    there = sea(f"given_obstacle = {ROCK}\ngiven_obstacle = {far}\npost_dist_to_polys = {policy}")
    there.forget()
    there.post("NAV_X", 10.0)
    there.run(1.0)
    told = there.heard("OBM_DIST_TO_OBJ")
    assert len(told) == count
    assert count == 0 or told[0] == "ROCK,10.0"
    assert there.last("OBM_MIN_DIST_EVER") == pytest.approx(10.0)


def test_inside_an_obstacle_the_range_is_zero():
    there = sea(f"given_obstacle = {ROCK}")
    there.post("NAV_X", 25.0)
    there.run(1.0)
    assert there.last("OBM_DIST_TO_OBJ") == "ROCK,0.0"


def test_wishes_about_obstacles_go_to_the_helm():
    there = sea("disable_var = OFF\nable_flag = NOW=$[ALL_DISABLED]\nnew_obs_flag = N=$[OBS_EVER]")
    there.post("OFF", "rock")
    there.post("GIVEN_OBSTACLE", f"{ROCK},duration=5")
    there.run(1.0)
    assert there.heard("BHV_ABLE_FILTER") == ["obstacle_id=rock,action=disable"]
    assert there.heard("NOW") == ["rock"]
    assert there.heard("N") == [1.0]


def test_a_flood_of_obstacles_is_bounded(monkeypatch):
    monkeypatch.setattr("pymoos_lite.marine.obstacle_manager_core.MAX_OBSTACLES", 5)
    there = sea()
    for k in range(9):
        there.post("TRACKED_FEATURE", f"x={k},y=0,key=k{k}")
    there.run(1.0)
    assert len(there.manager.core.obstacles) == 5
    assert any("already" in warning for warning in warnings_of(there.manager))


numbers = st.integers(-50, 50).map(float)


@given(st.lists(st.tuples(numbers, numbers), min_size=1, max_size=30))
def test_a_hull_is_convex_and_holds_every_point(points):
    corners = convex_hull(points)
    assert set(corners) <= set(points)
    hull = Polygon(tuple(corners))
    if len(corners) > 2:
        assert hull.is_convex
        assert all(hull.contains(x, y) for x, y in points)
