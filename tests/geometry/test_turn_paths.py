"""behaviors.md A9 and C17: turn models and turn-abouts."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoos_lite.geometry.angles import angle_diff, bearing
from pymoos_lite.geometry.cpa import CpaEngine
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import SegList
from pymoos_lite.geometry.specs import SpecError, parse_polygon, seglist_text
from pymoos_lite.geometry.turn_paths import TurnModel, parse_turn_model, williamson

OBSTACLE = parse_polygon("pts={40,-10:40,10:60,10:60,-10}")
DUBINS = TurnModel(0.0, 0.0, 0.0, radius=10.0, spoke_degs=15.0)


def test_a_holonomic_vessel_leaves_on_the_new_heading_at_once() -> None:
    seglr = TurnModel(3.0, 4.0, 20.0).seglr(200.0)
    assert (seglr.points, seglr.ray) == (((3.0, 4.0),), 200.0)


def test_a_dubins_vessel_turns_through_spokes_on_the_shorter_side() -> None:
    star = DUBINS.seglr(90.0)
    assert len(star.points) == 7
    assert star.points[-1] == pytest.approx((10.0, 10.0))
    port = DUBINS.seglr(270.0)
    assert port.points[-1] == pytest.approx((-10.0, 10.0))
    assert len(DUBINS.seglr(7.0).points) == 1
    assert len(DUBINS.seglr(8.0).points) == 2
    assert len(DUBINS.seglr(180.0).points) == 12


@given(st.integers(0, 359), st.integers(0, 359), st.sampled_from([2.0, 7.0, 15.0, 40.0]))
def test_spokes_lie_on_the_circle_and_never_reach_a_half_turn(own: int, wanted: int, spoke: float) -> None:
    model = TurnModel(5.0, -3.0, float(own), 12.0, spoke)
    points = model.seglr(float(wanted)).points
    turned = (len(points) - 1) * spoke
    assert turned < 180.0
    assert abs(turned - angle_diff(own, wanted)) <= spoke + 1e-9
    for i, (x, y) in enumerate(points):
        assert math.dist(points[0], (x, y)) == pytest.approx(24.0 * math.sin(math.radians(i * spoke / 2)))


def slow_dist(model: TurnModel, heading: float, polygon: Polygon) -> float:
    seglr = model.seglr(heading)
    legs = list(zip(seglr.points, seglr.points[1:], strict=False))
    chain = [polygon.dist_to_segment(*a, *b) for a, b in legs]
    return min([*chain, polygon.ray_cpa(*seglr.points[-1], seglr.ray)])


@settings(max_examples=30, deadline=None)
@given(
    st.integers(-80, 120),
    st.integers(-80, 80),
    st.integers(0, 359),
    st.sampled_from([0.0, 5.0, 25.0]),
    st.sampled_from([10.0, 33.0]),
)
def test_distances_of_all_courses_agree_with_the_path_walked_leg_by_leg(
    x: int, y: int, own: int, radius: float, spoke: float
) -> None:
    model = TurnModel(float(x), float(y), float(own), radius, spoke)
    courses = np.arange(0.0, 360.0, 7.0)
    for polygon in (OBSTACLE, OBSTACLE.reversed()):
        fast = model.dists_to_polygon(courses, polygon)
        slow = [slow_dist(model, c, polygon) for c in courses]
        assert fast == pytest.approx(slow, abs=1e-6)


def test_there_is_no_distance_to_what_is_not_convex() -> None:
    dented = Polygon.of([(0, 0), (10, 0), (5, 2), (5, 10)])
    assert DUBINS.dist_to_polygon(90.0, dented) == -1.0


def sailed_cpa(model: TurnModel, engine: CpaEngine, course: float, speed: float, horizon: float) -> float:
    """The path sailed in small steps."""
    seglr = model.seglr(course)
    path = [*seglr.points]
    ux, uy = math.sin(math.radians(course)), math.cos(math.radians(course))
    path.append((path[-1][0] + 1e5 * ux, path[-1][1] + 1e5 * uy))
    track = SegList(tuple(path))
    cvx, cvy = engine.contact_velocity
    return min(
        math.dist(track.point_at(speed * t), (engine.cnx + cvx * t, engine.cny + cvy * t))
        for t in np.linspace(0.0, horizon, 1500)
    )


@settings(max_examples=12, deadline=None)
@given(st.integers(-80, 80), st.integers(-80, 80), st.integers(0, 359), st.sampled_from([0.0, 12.0]))
def test_approaches_along_the_path_agree_with_sailing_it(cnx: int, cny: int, cnh: int, radius: float) -> None:
    engine = CpaEngine(float(cnx), float(cny), float(cnh), 1.5, 2.0, 3.0)
    model = TurnModel(2.0, 3.0, 40.0, radius, 10.0)
    courses, speeds = [10.0, 100.0, 215.0, 300.0], [0.0, 0.7, 2.0]
    grid = model.cpa_grid(engine, courses, speeds, 60.0)
    for i, course in enumerate(courses):
        for j, speed in enumerate(speeds):
            assert grid[i, j] == pytest.approx(sailed_cpa(model, engine, course, speed, 60.0), abs=0.15)


def test_without_a_turning_circle_the_path_is_the_straight_line() -> None:
    engine = CpaEngine(50.0, 50.0, 270.0, 2.0, 0.0, 0.0)
    courses, speeds = np.arange(0.0, 360.0, 5.0), np.linspace(0.0, 4.0, 9)
    straight = engine.cpa_grid(courses, speeds, 90.0)
    assert TurnModel(0, 0, 33.0).cpa_grid(engine, courses, speeds, 90.0) == pytest.approx(straight, abs=1e-9)


def test_turn_models_are_read_from_mission_text() -> None:
    assert parse_turn_model("alg=dubins # radius=5 # degs=2") == TurnModel(radius=5.0, spoke_degs=2.0)
    assert parse_turn_model("alg=dubins#mod_radius=3", DUBINS).radius == 13.0
    assert parse_turn_model("alg=holo", DUBINS).is_holonomic


@pytest.mark.parametrize(
    "text",
    [
        "radius=5",
        "alg=dubins",
        "alg=boat#radius=5",
        "alg=dubins#radius=-1",
        "alg=dubins#radius=5#degs=0",
        "alg=dubins#radius=x",
        "alg=dubins#radius=5#speed=3",
        "",
    ],
)
def test_a_turn_model_without_sense_is_refused(text: str) -> None:
    with pytest.raises(SpecError):
        parse_turn_model(text)


def test_turn_abouts_are_the_measured_ones() -> None:
    assert seglist_text(SegList(tuple(williamson(0, 0, 270, 15)))) == (
        "pts={0,0:-5.1,0.9:-9.6,3.5:-13,7.5:-13,7.5:-16.3,11.5:-20.9,14.1:-26,15:-31.1,14.1:-35.6,11.5:"
        "-39,7.5:-40.8,2.6:-40.8,-2.6:-39,-7.5:-35.6,-11.5:-31.1,-14.1:-26,-15:-20.9,-14.1:-16.3,-11.5:"
        "-13,-7.5:-13,-7.5:-9.6,-3.5:-5.1,-0.9:0,0}"
    )
    assert seglist_text(SegList(tuple(williamson(100, 0, 90, 15, point_gap=30)))) == (
        "pts={100,0:107.5,-2:113,-7.5:113,-7.5:118.5,-13:126,-15:133.5,-13:139,-7.5:141,0:139,7.5:133.5,13:"
        "126,15:118.5,13:113,7.5:113,7.5:107.5,2:100,0}"
    )


@given(
    st.integers(0, 359),
    st.floats(3.0, 40.0),
    st.booleans(),
    st.floats(0.0, 1.9),
    st.floats(0.0, 30.0),
    st.integers(-100, 100),
    st.sampled_from([7.0, 20.0, 33.0]),
)
def test_every_turn_about_is_smooth_and_comes_back_on_the_lane_beside(
    heading: int, radius: float, port: bool, gap: float, extension: float, bias: int, step: float
) -> None:
    path = williamson(
        10.0,
        20.0,
        heading,
        radius,
        port=port,
        lane_gap=gap * radius,
        extension=extension,
        bias=bias,
        point_gap=step,
    )
    assert path[0] == pytest.approx((10.0, 20.0), abs=1e-6)
    back = math.radians(heading - 90.0 if port else heading + 90.0)
    dx, dy = path[-1][0] - 10.0, path[-1][1] - 20.0
    assert dx * math.sin(back) + dy * math.cos(back) == pytest.approx(gap * radius, abs=1e-6)
    legs = [(a, b) for a, b in itertools.pairwise(path) if math.dist(a, b) > 1e-6]
    courses = [bearing(*a, *b) for a, b in legs]
    turns = [angle_diff(p, q) for p, q in itertools.pairwise(courses)]
    assert max(turns) <= step + 1e-6
    assert angle_diff(courses[-1], heading + 180.0) <= step / 2 + 1e-6


def test_a_turn_without_radius_is_refused() -> None:
    with pytest.raises(ValueError, match="no turn of radius 0"):
        williamson(0, 0, 0, 0)
