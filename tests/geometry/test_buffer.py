"""behaviors.md A8: buffered polygons, against measured ones and against plain geometry."""

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely import geometry as shp

from pymoos_lite.geometry.buffer import buffered
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.specs import parse_polygon, seglist_text

OBSTACLE = parse_polygon("pts={40,-10:40,10:60,10:60,-10}")


def test_an_obstacles_mid_polygon_is_the_measured_one() -> None:
    assert seglist_text(buffered(OBSTACLE, 8, 30), 5) == (
        "pts={40,-18:36,-16.9282:33.0718,-14:32,-10:32,10:33.0718,14:36,16.9282:40,18:60,18:64,16.9282:"
        "66.9282,14:68,10:68,-10:66.9282,-14:64,-16.9282:60,-18}"
    )


def test_a_regions_save_polygon_is_the_measured_one() -> None:
    core = parse_polygon("pts={-100,-100:-100,100:100,100:100,-100}")
    assert seglist_text(buffered(core, 10, 15), 3).startswith(
        "pts={-100,-110:-102.588,-109.659:-105,-108.66:-107.071,-107.071:-108.66,-105:-109.659,-102.588:"
        "-110,-100:-110,100:-109.659,102.588:"
    )


coordinate = st.integers(-60, 60).map(float)


@given(
    st.lists(st.tuples(coordinate, coordinate), min_size=3, max_size=10),
    st.floats(1.5, 50.0),
    st.sampled_from([5.0, 15.0, 30.0]),
    st.booleans(),
)
def test_a_buffer_lies_between_the_cut_corners_and_the_true_rounding(
    raw: list[tuple[float, float]], d: float, degrees: float, turned: bool
) -> None:
    hull = shp.MultiPoint(raw).convex_hull
    assume(hull.geom_type == "Polygon" and hull.area > 1.0)
    points = list(hull.exterior.coords)[:-1]
    polygon = Polygon.of(points[::-1] if turned else points)
    grown = buffered(polygon, d, degrees)
    assert grown.is_convex
    assert grown.is_clockwise == polygon.is_clockwise or grown == polygon
    body = shp.Polygon(grown.points)
    assert body.buffer(1e-6).contains(hull)
    assert hull.buffer(d, quad_segs=64).buffer(0.01 * d).contains(body)
    # Settling may drop a corner point, never more of the distance than a coarse corner costs.
    assert grown.dist(*points[0]) >= 0.6 * d


def test_no_distance_or_no_convexity_leaves_the_polygon_alone() -> None:
    dented = Polygon.of([(0, 0), (10, 0), (5, 2), (5, 10)])
    assert buffered(dented, 5) is dented
    for d in (0.0, -3.0):
        assert buffered(OBSTACLE, d) is OBSTACLE


def test_the_corner_step_is_held_between_its_limits() -> None:
    assert buffered(OBSTACLE, 8, 90) == buffered(OBSTACLE, 8, 45)
    assert len(buffered(OBSTACLE, 800, 0.0)) == len(buffered(OBSTACLE, 800, 0.2))


@pytest.mark.parametrize("d", [0.3, 0.9])
def test_small_buffers_have_no_vertices_on_top_of_each_other(d: float) -> None:
    grown = buffered(OBSTACLE, d, 30)
    assert grown.is_convex
    assert min(((x2 - x1) ** 2 + (y2 - y1) ** 2) ** 0.5 for x1, y1, x2, y2 in grown.edges) > d / 10
