"""behaviors.md A3: seglists and what can be asked of them."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.shapes import Circle, Point, SegList

ELL = SegList.of([(0, 0), (0, 10), (20, 10)], label="ell")
points = st.lists(
    st.tuples(st.integers(-100, 100).map(float), st.integers(-100, 100).map(float)), min_size=1, max_size=12
)


def test_centre_is_that_of_the_box_and_centroid_the_mean_vertex() -> None:
    assert ELL.center == (10.0, 5.0)
    assert ELL.centroid == pytest.approx((20 / 3, 20 / 3))
    assert ELL.label == "ell"
    assert (len(SegList()), SegList().center, SegList().centroid) == (0, (0.0, 0.0), (0.0, 0.0))


def test_length_and_points_along_the_way() -> None:
    assert ELL.length == 30.0
    assert ELL.point_at(5) == (0.0, 5.0)
    assert ELL.point_at(15) == (5.0, 10.0)
    assert ELL.point_at(-1) == (0.0, 0.0)
    assert ELL.point_at(99) == (20.0, 10.0)


@given(points, st.floats(0, 300))
def test_a_point_along_the_way_is_that_far_along_it(pts: list[tuple[float, float]], d: float) -> None:
    shape = SegList(tuple(pts))
    x, y = shape.point_at(d)
    walked = 0.0
    for (ax, ay), (bx, by) in pairwise(pts):
        leg = math.hypot(bx - ax, by - ay)
        if math.hypot(x - ax, y - ay) + math.hypot(x - bx, y - by) - leg < 1e-7 and walked + leg >= d - 1e-7:
            assert walked + math.hypot(x - ax, y - ay) == pytest.approx(min(d, shape.length), abs=1e-6)
            return
        walked += leg
    assert (x, y) == pts[-1]


def test_orientation_counts_the_bearings_around_the_centre() -> None:
    square = SegList.of([(0, 0), (0, 10), (10, 10), (10, 0)])
    assert square.is_clockwise
    assert not square.reversed().is_clockwise
    assert not SegList.of([(0, 0), (1, 1)]).is_clockwise


def test_growing_moves_vertices_away_from_the_mean() -> None:
    square = SegList.of([(0, 0), (0, 10), (10, 10), (10, 0)])
    grown = square.grown_by(math.sqrt(2.0))
    assert [tuple(round(v, 9) for v in p) for p in grown.points] == [(-1, -1), (-1, 11), (11, 11), (11, -1)]
    assert square.grown_by_factor(0.2).points[2] == (11.0, 11.0)
    assert square.grown_by(-math.sqrt(2.0)).points[0] == pytest.approx((1.0, 1.0))


def test_rotation_is_clockwise() -> None:
    turned = SegList.of([(0, 10)]).rotated(90.0, (0.0, 0.0))
    assert turned.points[0] == pytest.approx((10.0, 0.0))
    assert ELL.rotated(360.0).points[2] == pytest.approx((20.0, 10.0))


def test_moving_goes_by_the_centre_of_the_box() -> None:
    assert ELL.centered_at(0, 0).points == ((-10.0, -5.0), (-10.0, 5.0), (10.0, 5.0))
    assert ELL.shifted(1, 2).points[0] == (1.0, 2.0)


def test_snapping_and_the_greatest_radius() -> None:
    assert SegList.of([(1.26, -1.25)]).snapped(0.5).points == ((1.5, -1.5),)
    assert ELL.max_radius == pytest.approx(math.hypot(10, 5))


def test_properties_and_depths_stay_with_their_vertices() -> None:
    shape = SegList(((0.0, 0.0), (9.0, 0.0), (1.0, 0.0)), (1.0, None, 3.0), ("a", "", "c"))
    back = shape.reversed()
    assert (back.points[0], back.zs[0], back.properties[0]) == ((1.0, 0.0), 3.0, "c")
    tour = shape.greedy_path(0.4, 0.0)
    assert [p[0] for p in tour.points] == [0.0, 1.0, 9.0]
    assert tour.properties == ("a", "c", "")
    assert tour.zs == (0.0, 0.0, 0.0)


@given(points, st.integers(-100, 100), st.integers(-100, 100))
def test_a_greedy_path_visits_all_and_always_the_nearest_next(
    pts: list[tuple[float, float]], x: int, y: int
) -> None:
    tour = SegList(tuple(pts)).greedy_path(float(x), float(y))
    assert sorted(tour.points) == sorted(pts)
    here = (float(x), float(y))
    for i, point in enumerate(tour.points):
        assert math.dist(here, point) == min(math.dist(here, p) for p in tour.points[i:])
        here = point


def test_drawables_expire_after_their_duration_and_never_without_one() -> None:
    assert Attributes(time=100.0, duration=5.0).expired(105.5)
    assert not Attributes(time=100.0, duration=5.0).expired(105.0)
    assert not Attributes(time=100.0, duration=-1.0).expired(1e9)
    assert not Attributes(time=100.0).expired(1e9)
    assert not Attributes(duration=1.0).expired(1e9)
    assert not Attributes(time=0.0, duration=1.0).expired(1e9)


def test_changing_attributes_leaves_the_shape_alone() -> None:
    assert ELL.with_attributes(active=False).points == ELL.points
    assert not ELL.with_attributes(active=False).attributes.active
    assert Point(1.0, 2.0).with_attributes(label="p").label == "p"
    assert Circle(0, 0, 5).contains(3, 4)
    assert not Circle(0, 0, 5).contains(3, 4.01)
