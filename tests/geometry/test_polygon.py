"""behaviors.md A2 and A3: convexity, containment, distances, bearings of polygons."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely import geometry as shp

from pymoos_lite.geometry.polygon import Polygon

SQUARE = Polygon.of([(0, 0), (0, 10), (10, 10), (10, 0)])
coordinate = st.integers(-60, 60).map(float)
headings = st.integers(0, 359).map(float)


@st.composite
def convex_polygons(draw: st.DrawFn) -> Polygon:
    """Hulls of random points, either orientation."""
    raw = draw(st.lists(st.tuples(coordinate, coordinate), min_size=3, max_size=12))
    hull = shp.MultiPoint(raw).convex_hull
    assume(hull.geom_type == "Polygon" and hull.area > 1.0)
    points = list(hull.exterior.coords)[:-1]
    return Polygon.of(points if draw(st.booleans()) else points[::-1])


def is_convex_by_definition(points: list[tuple[float, float]]) -> bool:
    """The rule of behaviors.md A3 word by word: every edge against every other vertex."""
    n = len(points)
    if n < 3:
        return False
    for i in range(n):
        (x1, y1), (x2, y2) = points[i], points[(i + 1) % n]
        sides = [
            (x2 - x1) * (y - y1) - (y2 - y1) * (x - x1)
            for k, (x, y) in enumerate(points)
            if k not in (i, (i + 1) % n)
        ]
        off_line = [s for s in sides if s != 0.0]
        if not off_line or (min(off_line) < 0.0 < max(off_line)):
            return False
    return True


@given(st.lists(st.tuples(st.integers(-4, 4), st.integers(-4, 4)), max_size=7))
def test_convexity_agrees_with_the_rule_for_simple_lists(raw: list[tuple[int, int]]) -> None:
    points = [(float(x), float(y)) for x, y in raw]
    polygon = Polygon.of(points)
    if polygon.is_convex:
        assert is_convex_by_definition(points)
    elif is_convex_by_definition(points):
        # The rule alone also passes lists that run over themselves on one line; those have no outline.
        ring = shp.Polygon(points)
        assert not ring.is_valid or len(set(points)) < len(points)


@given(convex_polygons())
def test_hulls_are_convex(polygon: Polygon) -> None:
    assert polygon.is_convex


def test_round_off_on_a_straight_side_does_not_make_a_polygon_non_convex() -> None:
    points = [(0.0, 0.0), (0.1, 0.3), (0.2, 0.6000000000000001), (0.3, 0.9), (5.0, 0.0)]
    assert not is_convex_by_definition(points)
    assert Polygon.of(points).is_convex


@pytest.mark.parametrize(
    "points",
    [
        [(0, 0), (10, 0), (5, 2), (5, 10)],
        [(0, 0), (10, 0), (20, 0)],
        [(0, 0), (0, 0), (10, 0), (0, 10)],
        [(0, 0), (10, 10), (10, 0), (0, 10)],
        [(0, 10), (6, -8), (-9.5, 3), (9.5, 3), (-6, -8)],
        [(0, 0), (1, 1)],
        [(0, 0), (math.inf, 0), (0, 1)],
    ],
    ids=["dent", "flat", "double vertex", "crossed", "pentagram", "two points", "infinite"],
)
def test_what_is_not_convex(points: list[tuple[float, float]]) -> None:
    assert not Polygon.of(points).is_convex


@given(convex_polygons(), coordinate, coordinate)
def test_containment_and_distance_agree_with_an_independent_library(
    polygon: Polygon, x: float, y: float
) -> None:
    other = shp.Polygon(polygon.points)
    assert polygon.contains(x, y) == (other.distance(shp.Point(x, y)) < 1e-8)
    assert polygon.dist(x, y) == pytest.approx(other.exterior.distance(shp.Point(x, y)), abs=1e-9)
    assert abs(polygon.signed_dist(x, y)) == pytest.approx(polygon.dist(x, y), abs=1e-9)
    assert (polygon.signed_dist(x, y) <= 0.0) == polygon.contains(x, y)
    nearest = polygon.nearest_point(x, y)
    assert math.dist(nearest, (x, y)) == pytest.approx(polygon.dist(x, y), abs=1e-9)


@given(convex_polygons(), convex_polygons())
def test_polygon_to_polygon_distance_agrees_with_an_independent_library(a: Polygon, b: Polygon) -> None:
    one, two = shp.Polygon(a.points), shp.Polygon(b.points)
    assert a.intersects(b) == (one.distance(two) < 1e-9)
    assert a.dist_to_polygon(b) == pytest.approx(one.distance(two), abs=1e-9)
    assert a.contains_shape(b) == (one.buffer(1e-7).contains(two))


@given(convex_polygons(), coordinate, coordinate, coordinate, coordinate)
def test_segment_distance_agrees_with_an_independent_library(
    polygon: Polygon, x1: float, y1: float, x2: float, y2: float
) -> None:
    expected = shp.Polygon(polygon.points).distance(shp.LineString([(x1, y1), (x2, y2)]))
    assert polygon.dist_to_segment(x1, y1, x2, y2) == pytest.approx(expected, abs=1e-9)


@given(convex_polygons(), coordinate, coordinate, headings)
def test_rays_agree_with_an_independent_library(polygon: Polygon, x: float, y: float, h: float) -> None:
    far = (x + 1000.0 * math.sin(math.radians(h)), y + 1000.0 * math.cos(math.radians(h)))
    ray = shp.LineString([(x, y), far])
    body, rim = shp.Polygon(polygon.points), shp.Polygon(polygon.points).exterior
    apart = body.distance(ray)
    assert polygon.ray_cpa(x, y, h) == pytest.approx(apart, abs=1e-6)
    hit = polygon.ray_dist(x, y, h)
    if rim.distance(ray) > 1e-6:
        assert hit == -1.0
    elif rim.crosses(ray):
        assert hit == pytest.approx(rim.intersection(ray).distance(shp.Point(x, y)), abs=1e-6)


def test_a_polygon_of_one_or_two_points_still_has_distances() -> None:
    assert Polygon().dist(0, 0) == -1.0
    assert Polygon.of([(3, 4)]).dist(0, 0) == 5.0
    assert Polygon.of([(3, 4), (3, -4)]).dist(0, 0) == 3.0
    assert Polygon.of([(3, 4)]).dist_to_segment(0, 0, 0, 10) == 3.0
    assert Polygon().dist_to_polygon(SQUARE) == -1.0
    assert Polygon().ray_cpa(0, 0, 0) == -1.0


@given(convex_polygons())
def test_area_and_centre_of_gravity_agree_with_an_independent_library(polygon: Polygon) -> None:
    other = shp.Polygon(polygon.points)
    assert polygon.area == pytest.approx(other.area)
    assert polygon.perimeter == pytest.approx(other.exterior.length)
    assert polygon.area_centroid == pytest.approx((other.centroid.x, other.centroid.y), abs=1e-6)
    assert (polygon.signed_area < 0.0) == (not other.exterior.is_ccw)


def test_the_radial_polygon_of_the_specification() -> None:
    polygon = Polygon.radial(40, -50, 25, 8, snap=1)
    expected = ((50, -27), (63, -40), (63, -60), (50, -73), (30, -73), (17, -60), (17, -40), (30, -27))
    assert polygon.points == expected
    assert polygon.is_clockwise


def test_only_vertices_on_the_near_side_are_seen() -> None:
    seen = [SQUARE.vertex_is_viewable(i, -5.0, 5.0) for i in range(4)]
    assert seen == [True, True, False, False]
    assert not any(SQUARE.vertex_is_viewable(i, 5.0, 5.0) for i in range(4))


@given(convex_polygons(), coordinate, coordinate)
def test_the_vertices_in_view_are_those_whose_line_of_sight_is_free(
    polygon: Polygon, x: float, y: float
) -> None:
    one_by_one = [i for i in range(len(polygon)) if polygon.vertex_is_viewable(i, x, y)]
    assert polygon.viewable_vertices(x, y) == one_by_one


def test_in_line_with_an_edge_and_for_dented_polygons_every_edge_is_tried() -> None:
    dented = Polygon(((0, 0), (0, 10), (5, 2), (10, 10), (10, 0)))
    for polygon in (SQUARE, dented):
        for x, y in ((-5.0, 0.0), (-5.0, 10.0), (0.0, 25.0), (5.0, 9.0), (0.0, 5.0), (-1e-12, -3.0)):
            one_by_one = [i for i in range(len(polygon)) if polygon.vertex_is_viewable(i, x, y)]
            assert polygon.viewable_vertices(x, y) == one_by_one


def test_tangent_bearings_are_ordered_unless_the_polygon_straddles_north() -> None:
    assert SQUARE.bearing_min_max(-10.0, 5.0) == pytest.approx(
        (math.degrees(math.atan2(10, 5)), math.degrees(math.atan2(10, -5)))
    )
    low, high = SQUARE.bearing_min_max(5.0, -10.0) or (0.0, 0.0)
    assert low > high
    assert (low, high) == pytest.approx((360 - math.degrees(math.atan(0.5)), math.degrees(math.atan(0.5))))
    south = SQUARE.bearing_min_max(5.0, 20.0) or (0.0, 0.0)
    assert south == pytest.approx((180 - math.degrees(math.atan(0.5)), 180 + math.degrees(math.atan(0.5))))
    assert SQUARE.bearing_min_max(5.0, 5.0) is None


def test_the_heading_offset_is_zero_inside_the_tangents() -> None:
    assert SQUARE.heading_wedge_offset(5.0, -10.0, 0.0) == 0.0
    assert SQUARE.heading_wedge_offset(5.0, -10.0, 90.0) == pytest.approx(90 - math.degrees(math.atan(0.5)))
    assert SQUARE.heading_wedge_offset(5.0, 5.0, 123.0) == 0.0
    assert Polygon().heading_wedge_offset(0, 0, 0) == 180.0


def test_a_polygon_is_aft_when_all_its_vertices_are() -> None:
    assert SQUARE.is_aft_of(5.0, 20.0, 0.0)
    assert SQUARE.is_aft_of(5.0, 20.0, 0.0, 40.0)
    assert not SQUARE.is_aft_of(5.0, 20.0, 0.0, 70.0)
    assert not SQUARE.is_aft_of(5.0, 5.0, 0.0)
    assert not Polygon().is_aft_of(0.0, 0.0, 0.0)


def test_the_stock_closest_point_lies_toward_the_centre() -> None:
    assert SQUARE.boundary_toward_center(5.0, 20.0) == pytest.approx((5.0, 10.0))
    assert SQUARE.boundary_toward_center(5.0, 7.0) == pytest.approx((5.0, 10.0))
    assert SQUARE.boundary_toward_center(5.0, 5.0) == pytest.approx((5.0, 10.0))


def test_an_exported_list_starts_at_the_nearest_vertex() -> None:
    assert SQUARE.starting_nearest(11.0, 9.0).points == ((10, 10), (10, 0), (0, 0), (0, 10))


def test_snapping_is_refused_where_it_breaks_convexity() -> None:
    blunt = Polygon.of([(0, 0), (5, 0.4), (10, 0.6), (5, 10)])
    assert not blunt.is_convex
    flat = Polygon.of([(0, 0.2), (0.3, 0.1), (0.6, 0.2), (0.3, 0.4)])
    assert flat.is_convex
    assert flat.snapped_convex(1.0) is None
    assert SQUARE.snapped_convex(1.0) == SQUARE


def test_settling_drops_the_flattest_corner_first() -> None:
    dented = Polygon.of([(0, 0), (5, 0.5), (10, 0), (10, 10), (0, 10)])
    assert not dented.is_convex
    assert dented.settled().points == ((0, 0), (10, 0), (10, 10), (0, 10))
    assert len(Polygon.of([(0, 0), (1, 1), (2, 2), (3, 3)]).settled()) == 3


def test_a_ray_that_starts_on_an_edge_meets_it_at_once() -> None:
    sliver = Polygon.of([(0, 0), (0, 1), (20, 0)])
    assert [sliver.ray_dist(4.0, 0.0, h) for h in (2.0, 90.0, 182.0)] == [0.0, 0.0, 0.0]
