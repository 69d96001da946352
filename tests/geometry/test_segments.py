"""behaviors.md A2: points, segments and rays, against brute force."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.geometry import segments as seg
from pymoos_lite.geometry.angles import project_point

c = st.integers(-50, 50).map(float)
heading = st.integers(0, 359).map(float)


def sampled_distance(x1: float, y1: float, x2: float, y2: float, px: float, py: float) -> float:
    return min(
        math.hypot(x1 + t / 1000 * (x2 - x1) - px, y1 + t / 1000 * (y2 - y1) - py) for t in range(1001)
    )


@given(c, c, c, c, c, c)
def test_the_nearest_point_is_on_the_segment_and_nearest(
    x1: float, y1: float, x2: float, y2: float, px: float, py: float
) -> None:
    exact = seg.dist_to_segment(x1, y1, x2, y2, px, py)
    assert exact <= sampled_distance(x1, y1, x2, y2, px, py) + 1e-9
    nx, ny = seg.nearest_on_segment(x1, y1, x2, y2, px, py)
    assert seg.dist_to_segment(x1, y1, x2, y2, nx, ny) < 1e-9


@given(c, c, c, c, c, c, heading)
def test_a_ray_meets_a_segment_at_the_distance_told_or_passes_it_by(
    x1: float, y1: float, x2: float, y2: float, px: float, py: float, h: float
) -> None:
    d = seg.ray_dist_to_segment(x1, y1, x2, y2, px, py, h)
    nearest = min(
        seg.dist_to_segment(x1, y1, x2, y2, *project_point(h, step / 4, px, py)) for step in range(1200)
    )
    if d >= 0.0:
        assert seg.dist_to_segment(x1, y1, x2, y2, *project_point(h, d, px, py)) < 1e-6
        assert nearest <= 0.25
    else:
        assert d == -1.0
        assert min(seg.dist_to_ray(px, py, h, x1, y1), seg.dist_to_ray(px, py, h, x2, y2)) > 0.0


def test_a_ray_along_its_own_segment_meets_the_nearer_end() -> None:
    assert seg.ray_dist_to_segment(0, 5, 0, 9, 0, 0, 0) == 5.0
    assert seg.ray_dist_to_segment(0, -5, 0, 9, 0, 0, 0) == 0.0
    assert seg.ray_dist_to_segment(0, -5, 0, -9, 0, 0, 0) == -1.0


@given(c, c, c, c, c, c, c, c)
def test_segments_that_cross_are_zero_apart_and_others_are_not(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> None:
    a_to_b = (ax, ay, bx, by)
    apart = seg.segment_dist_to_segment(*a_to_b, cx, cy, dx, dy)
    ends = min(
        seg.dist_to_segment(*a_to_b, cx + t / 200 * (dx - cx), cy + t / 200 * (dy - cy)) for t in range(201)
    )
    assert apart <= ends + 1e-9
    assert ends - apart <= math.hypot(dx - cx, dy - cy) / 200 + 1e-9
    assert (apart == 0.0) == seg.segments_cross(*a_to_b, cx, cy, dx, dy)


def test_turns_are_positive_to_the_right() -> None:
    assert seg.segment_angle(0, 0, 0, 10, 10, 10) == 90.0
    assert seg.segment_angle(0, 0, 0, 10, -10, 10) == -90.0
    assert seg.segment_angle(0, 0, 0, 10, 0, 0) == 180.0
    assert seg.segment_angle(0, 0, 0, 0, 5, 5) == 0.0


def test_interior_angles_come_from_the_triangle() -> None:
    assert seg.angle_from_three_points(0, 0, 10, 0, 0, 10) == pytest.approx(90.0)
    assert seg.angle_from_three_points(0, 0, 10, 0, 20, 0) == 0.0
    assert seg.angle_from_three_points(0, 0, 10, 0, -20, 0) == 180.0
    assert seg.angle_from_three_points(0, 0, 0, 0, 1, 1) == 0.0


def test_a_right_turn_has_a_positive_cross_product() -> None:
    assert seg.three_point_cross(0, 0, 0, 10, 10, 10) > 0.01
    assert seg.three_point_cross(0, 0, 0, 10, -10, 10) < -0.01


def test_the_turn_gap_is_measured_from_the_circle_on_the_chosen_side() -> None:
    line = (30.0, 0.0, 30.0, 10.0)
    assert seg.turn_gap(0, 0, 0, 10, *line, right=True) == 10.0
    assert seg.turn_gap(0, 0, 0, 10, *line, right=False) == 30.0
    assert seg.turn_gap(15, 0, 0, 10, *line, right=True) == 0.0


@given(
    st.lists(st.tuples(*[st.integers(-9, 9).map(float)] * 4), max_size=6),
    st.integers(-9, 9),
    st.integers(-9, 9),
    st.sampled_from([0.0, 30.0, 45.0, 90.0, 180.0, 271.5]),
)
def test_the_first_of_several_segments_is_the_nearest_that_the_ray_meets(segments, x, y, heading):
    hits = [d for d in (seg.ray_dist_to_segment(*s, x, y, heading) for s in segments) if d >= 0.0]
    assert seg.ray_dist_to_segments(segments, x, y, heading) == min(hits, default=-1.0)
