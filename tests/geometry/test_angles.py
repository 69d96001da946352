"""behaviors.md A1 and A2: wrapping, bearings, sides and turns, boundaries included."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.geometry import angles as ang

any_angle = st.floats(-1e6, 1e6)
coordinate = st.floats(-1e4, 1e4)


@given(any_angle)
def test_wrapped_angles_stay_in_their_half_open_ranges(a: float) -> None:
    assert 0.0 <= ang.angle360(a) < 360.0
    assert -180.0 < ang.angle180(a) <= 180.0


def test_a_tiny_negative_angle_wraps_to_zero_and_not_to_360() -> None:
    assert ang.angle360(-1e-18) == 0.0


def test_half_turns_wrap_to_plus_180() -> None:
    assert ang.angle180(180.0) == 180.0
    assert ang.angle180(-180.0) == 180.0
    assert ang.angle180(540.0) == 180.0


@given(any_angle, any_angle)
def test_the_difference_is_symmetric_and_at_most_a_half_turn(a: float, b: float) -> None:
    gap = ang.angle_diff(a, b)
    assert 0.0 <= gap <= 180.0
    assert gap == pytest.approx(ang.angle_diff(b, a), abs=1e-9)


@given(st.floats(0, 359.99))
def test_heading_to_radians_and_back_is_the_same_heading(h: float) -> None:
    r = ang.heading_to_radians(h)
    assert -math.pi <= r <= math.pi
    assert math.cos(r) == pytest.approx(math.sin(math.radians(h)), abs=1e-12)
    assert ang.angle_diff(ang.radians_to_heading(r), h) < 1e-9


@pytest.mark.parametrize(
    ("dx", "dy", "expected"), [(0, 5, 0.0), (5, 0, 90.0), (0, -5, 180.0), (-5, 0, 270.0), (0, 0, 0.0)]
)
def test_bearings_along_the_axes_are_exact(dx: float, dy: float, expected: float) -> None:
    assert ang.bearing(3.0, 4.0, 3.0 + dx, 4.0 + dy) == expected


@given(coordinate, coordinate, st.floats(0, 359.999), st.floats(0.1, 1e4))
def test_projecting_along_a_heading_gives_that_bearing_and_distance(
    x: float, y: float, heading: float, d: float
) -> None:
    px, py = ang.project_point(heading, d, x, y)
    assert ang.distance(x, y, px, py) == pytest.approx(d, rel=1e-6)
    assert ang.angle_diff(ang.bearing(x, y, px, py), heading) < 1e-6


@pytest.mark.parametrize(
    ("heading", "expected"), [(0, (1, 12)), (90, (11, 2)), (180, (1, -8)), (270, (-9, 2)), (-90, (-9, 2))]
)
def test_projecting_along_an_axis_leaves_the_other_coordinate_alone(
    heading: float, expected: tuple[float, float]
) -> None:
    assert ang.project_point(heading, 10.0, 1.0, 2.0) == expected


def test_neither_straight_on_nor_a_half_turn_has_a_side() -> None:
    for gap in (0.0, 180.0):
        assert not ang.is_port_turn(40.0, 40.0 + gap)
        assert not ang.is_star_turn(40.0, 40.0 + gap)
    assert ang.is_star_turn(350.0, 10.0)
    assert ang.is_port_turn(10.0, 350.0)


def test_speed_in_a_heading_is_exact_at_the_quarter_turns() -> None:
    assert [ang.speed_in_heading(30.0, 2.0, 30.0 + t) for t in (0, 90, 180, 270)] == [2.0, 0.0, -2.0, 0.0]
    assert ang.speed_in_heading(0.0, 2.0, 60.0) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("a", "b", "q", "inside"),
    [
        (10, 50, 30, True),
        (50, 10, 30, True),
        (10, 50, 60, False),
        (350, 10, 0, True),
        (10, 350, 180, False),
        (10, 50, 10, True),
        (0, 180, 275, True),
    ],
)
def test_an_arc_contains_what_lies_on_its_short_side(a: float, b: float, q: float, inside: bool) -> None:
    assert ang.contains_angle(a, b, q) is inside


@pytest.mark.parametrize(
    ("relative", "fore", "aft", "star", "port"),
    [
        (0, True, False, True, False),
        (45, True, False, True, False),
        (90, True, True, True, False),
        (135, False, True, True, False),
        (180, False, True, True, True),
        (225, False, True, False, True),
        (270, True, True, False, True),
        (315, True, False, False, True),
    ],
)
def test_sides_of_a_vessel_include_their_boundaries(
    relative: float, fore: bool, aft: bool, star: bool, port: bool
) -> None:
    x, y = ang.project_point(relative, 10.0, 7.0, -3.0)
    vessel = (7.0, -3.0, 0.0)
    found = tuple(side(*vessel, x, y) for side in (ang.is_fore, ang.is_aft, ang.is_star, ang.is_port))
    assert found == (fore, aft, star, port)


def test_a_vessels_own_position_is_on_no_side_of_it() -> None:
    for side in (ang.is_fore, ang.is_aft, ang.is_star, ang.is_port):
        assert not side(1.0, 2.0, 30.0, 1.0, 2.0)


def test_the_average_of_headings_about_north_is_north() -> None:
    assert ang.angle_diff(ang.heading_average([350.0, 10.0]), 0.0) < 1e-9
    assert ang.heading_average([]) == 0.0


@pytest.mark.parametrize(
    ("value", "step", "snapped"), [(2.5, 1, 3), (-2.5, 1, -3), (0.26, 0.1, 0.3), (7.1, 0, 7.1)]
)
def test_snapping_rounds_halves_away_from_zero(value: float, step: float, snapped: float) -> None:
    assert ang.snap_to_step(value, step) == pytest.approx(snapped, abs=1e-12)
