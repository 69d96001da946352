"""behaviors.md A7: closest points of approach, passing and crossing, against sailing the encounter."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from pymoos_lite.geometry.angles import is_aft, is_fore, is_port, is_star, project_point
from pymoos_lite.geometry.cpa import CpaEngine, cpa_of, unit_vectors

position = st.integers(-100, 100).map(float)
heading = st.integers(0, 359).map(float)
speed = st.integers(0, 20).map(lambda i: i / 4)
encounters = st.builds(CpaEngine, position, position, heading, speed, position, position)

COURSES = np.arange(0.0, 360.0, 24.0)
SPEEDS = np.array([0.0, 0.5, 1.5, 4.0])


def at(engine: CpaEngine, course: float, v: float, t: float) -> tuple[float, float, float, float]:
    """Where both are after t seconds: own ship, then the contact."""
    own = project_point(course, v * t, engine.osx, engine.osy)
    return (*own, *project_point(engine.cnh, engine.cnv * t, engine.cnx, engine.cny))


def in_contact_frame(engine: CpaEngine, course: float, v: float, t: float) -> tuple[float, float]:
    """(metres ahead of the contact, metres to its starboard) after t seconds."""
    ox, oy, cx, cy = at(engine, course, v, t)
    s, c = math.sin(math.radians(engine.cnh)), math.cos(math.radians(engine.cnh))
    return (ox - cx) * s + (oy - cy) * c, (ox - cx) * c - (oy - cy) * s


@given(encounters)
def test_the_engine_sees_own_ship_on_the_sides_that_the_plain_questions_name(engine: CpaEngine) -> None:
    place = (engine.cnx, engine.cny, engine.cnh, engine.osx, engine.osy)
    sides = (engine.aspect.fore, engine.aspect.aft, engine.aspect.port, engine.aspect.star)
    assert sides == (is_fore(*place), is_aft(*place), is_port(*place), is_star(*place))


@given(encounters, heading, speed, st.sampled_from([0.0, 5.0, 60.0, 1000.0]))
def test_no_moment_within_the_horizon_is_closer_than_the_cpa(
    engine: CpaEngine, course: float, v: float, horizon: float
) -> None:
    cpa = engine.eval_cpa(course, v, horizon)
    times = [horizon * i / 200 for i in range(201)]
    ranges = [math.dist(p[:2], p[2:]) for p in (at(engine, course, v, t) for t in times)]
    assert cpa <= min(ranges) + 1e-7
    assert min(ranges) - cpa <= (v + engine.cnv) * horizon / 400 + 1e-7


@given(encounters, heading, speed)
def test_the_time_of_the_cpa_is_when_the_range_is_least(engine: CpaEngine, course: float, v: float) -> None:
    t = engine.eval_time_cpa(course, v)
    p = at(engine, course, v, t)
    assert math.dist(p[:2], p[2:]) == pytest.approx(engine.eval_cpa(course, v, math.inf), abs=1e-5)


@given(encounters, heading, speed)
def test_the_rate_of_closure_is_the_loss_of_range_per_second(
    engine: CpaEngine, course: float, v: float
) -> None:
    assume(engine.range > 1.0)
    p = at(engine, course, v, 1e-4)
    assert engine.eval_roc(course, v) == pytest.approx(
        (engine.range - math.dist(p[:2], p[2:])) / 1e-4, abs=2e-2
    )


@given(encounters, heading, speed)
def test_the_bearing_rate_is_the_change_of_bearing_per_second(
    engine: CpaEngine, course: float, v: float
) -> None:
    assume(engine.range > 1.0)
    later = CpaEngine(
        *at(engine, course, v, 1e-4)[2:], engine.cnh, engine.cnv, *at(engine, course, v, 1e-4)[:2]
    )
    change = (later.bng_os_cn - engine.bng_os_cn + 180.0) % 360.0 - 180.0
    assert engine.bearing_rate(course, v) == pytest.approx(change / 1e-4, rel=1e-3, abs=2e-2)


@given(encounters)
def test_gamma_and_epsilon_are_the_legs_of_the_range(engine: CpaEngine) -> None:
    ahead, right = in_contact_frame(engine, 0.0, 0.0, 0.0)
    assert engine.aspect.epsilon == pytest.approx(abs(ahead), abs=1e-9)
    assert engine.aspect.gamma == pytest.approx(abs(right), abs=1e-9)
    assert math.hypot(engine.aspect.gamma, engine.aspect.epsilon) == pytest.approx(engine.range)


@given(encounters, heading, speed)
def test_passing_tells_on_which_side_and_how_far_the_beam_line_is_crossed(
    engine: CpaEngine, course: float, v: float
) -> None:
    start, _ = in_contact_frame(engine, course, v, 0.0)
    after, _ = in_contact_frame(engine, course, v, 1.0)
    closing = abs(start) - abs(after) if start * after > 0.0 else abs(start) + abs(after)
    rate = after - start
    assume(engine.range > 1.0 and abs(start) > 0.01 and abs(rate) > 0.01)
    passes = rate * start < 0.0
    assert engine.passes(course, v) == passes
    assert passes == (closing > 0.0)
    if not passes:
        assert not engine.passes_port(course, v)
        assert not engine.passes_star(course, v)
        assert engine.passes_port_dist(course, v) == engine.passes_star_dist(course, v) == -1.0
        return
    t = -start / rate
    ahead, right = in_contact_frame(engine, course, v, t)
    assert ahead == pytest.approx(0.0, abs=1e-6)
    assume(abs(right) > 1e-3 and engine.aspect.gamma > 1e-6)
    assert engine.passes_port(course, v) == (right < 0.0)
    assert engine.passes_star(course, v) == (right > 0.0)
    dists = (engine.passes_port_dist(course, v), engine.passes_star_dist(course, v))
    assert dists == pytest.approx((-right, -1.0) if right < 0.0 else (-1.0, right), abs=1e-5, rel=1e-5)


@given(encounters, heading, speed)
def test_crossing_tells_where_on_the_contacts_line(engine: CpaEngine, course: float, v: float) -> None:
    _, start = in_contact_frame(engine, course, v, 0.0)
    _, after = in_contact_frame(engine, course, v, 1.0)
    rate = after - start
    assume(engine.range > 1.0 and abs(start) > 0.01 and abs(rate) > 0.01)
    crosses = rate * start < 0.0
    assert engine.crosses_bow_or_stern(course, v) == crosses
    if not crosses:
        assert not engine.crosses_bow(course, v)
        assert not engine.crosses_stern(course, v)
        assert engine.crosses_bow_dist(course, v) == engine.crosses_stern_dist(course, v) == -1.0
        return
    ahead, right = in_contact_frame(engine, course, v, -start / rate)
    assert right == pytest.approx(0.0, abs=1e-6)
    assume(abs(ahead) > 1e-3)
    assert engine.crosses_bow(course, v) == (ahead > 0.0)
    assert engine.crosses_stern(course, v) == (ahead < 0.0)
    dists = (engine.crosses_bow_dist(course, v), engine.crosses_stern_dist(course, v))
    assert dists == pytest.approx((ahead, -1.0) if ahead > 0.0 else (-1.0, -ahead), abs=1e-5, rel=1e-5)


def test_on_the_contacts_own_lines_the_answers_are_settled() -> None:
    ahead = CpaEngine(0, 0, 0, 1, 0, 50)
    assert ahead.os_on_bow_line
    assert ahead.crosses_bow(200, 0)
    assert not ahead.crosses_stern(200, 0)
    assert ahead.crosses_bow_dist(0, 0) == 50.0
    astern = CpaEngine(0, 0, 0, 1, 0, -50)
    assert astern.os_on_stern_line
    assert astern.crosses_stern(200, 0)
    assert not astern.crosses_bow(200, 0)
    assert (astern.crosses_bow_dist(0, 0), astern.crosses_stern_dist(0, 0)) == (-1.0, 50.0)
    abeam = CpaEngine(0, 0, 0, 1, -50, 0)
    assert abeam.os_on_beam
    assert abeam.passes_port(123, 0)
    assert not abeam.passes_star(123, 0)
    assert (abeam.passes_port_dist(123, 0), abeam.passes_star_dist(123, 0)) == (50.0, -1.0)


@settings(max_examples=40, deadline=None)
@given(encounters)
def test_every_grid_agrees_with_its_scalar_question(engine: CpaEngine) -> None:
    numeric = {
        "cpa_grid": lambda c, v: engine.eval_cpa(c, v, 60.0),
        "roc_grid": engine.eval_roc,
        "bearing_rate_grid": engine.bearing_rate,
    }
    assert engine.cpa_grid(COURSES, SPEEDS, 60.0) == pytest.approx(
        np.array([[numeric["cpa_grid"](c, v) for v in SPEEDS] for c in COURSES]), abs=1e-9
    )
    for name in ("roc_grid", "bearing_rate_grid"):
        grid = getattr(engine, name)(COURSES, SPEEDS)
        assert grid == pytest.approx(
            np.array([[numeric[name](c, v) for v in SPEEDS] for c in COURSES]), abs=1e-9
        )
    # Courses straight along a line of the contact hang on the last bit of a cosine: leave those out.
    courses = list(COURSES + 0.137)
    rates = np.abs([[engine.bearing_rate(c, v) for v in SPEEDS] for c in courses]) > 1e-9
    for name in (
        "passes",
        "passes_port",
        "passes_star",
        "crosses_bow_or_stern",
        "crosses_bow",
        "crosses_stern",
    ):
        grid = getattr(engine, f"{name}_grid")(courses, SPEEDS)
        slow = np.array([[getattr(engine, name)(c, v) for v in SPEEDS] for c in courses])
        assert grid.dtype == np.bool_
        assert np.array_equal(grid[rates], slow[rates])
    for name in ("passes_port_dist", "passes_star_dist"):
        grid = getattr(engine, f"{name}_grid")(courses, SPEEDS)
        slow = np.array([[getattr(engine, name)(c, v) for v in SPEEDS] for c in courses])
        assert grid == pytest.approx(slow, rel=1e-9, abs=1e-6)


@settings(max_examples=20, deadline=None)
@given(encounters, st.lists(st.tuples(heading, speed), min_size=1, max_size=9))
def test_scattered_points_agree_with_single_ones(engine: CpaEngine, pairs: list[tuple[float, float]]) -> None:
    courses, speeds = zip(*pairs, strict=True)
    found = engine.cpa_points(courses, speeds, 90.0)
    assert found == pytest.approx([engine.eval_cpa(c, v, 90.0) for c, v in pairs], abs=1e-9)


def test_the_least_and_greatest_closure_bracket_all_headings() -> None:
    engine = CpaEngine(30, 40, 123, 1.5, 0, 0)
    low, high = engine.min_max_roc(2.0)
    rates = [engine.eval_roc(h, 2.0) for h in range(360)]
    assert (low, high) == pytest.approx((min(rates), max(rates)))


def test_negative_contact_speeds_count_as_none_and_coinciding_vessels_do_not_crash() -> None:
    assert CpaEngine(0, 0, 0, -3, 10, 0).cnv == 0.0
    same = CpaEngine(5, 5, 90, 1, 5, 5)
    assert same.eval_cpa(90, 1, 60) == 0.0
    assert same.bearing_rate(0, 1) == 0.0
    assert same.bearing_rate_grid(COURSES, SPEEDS).shape == (15, 4)


def test_unit_vectors_are_exact_on_the_axes() -> None:
    east, north = unit_vectors([0.0, 90.0, 180.0, 270.0, 360.0, -90.0])
    assert east.tolist() == [0.0, 1.0, 0.0, -1.0, 0.0, -1.0]
    assert north.tolist() == [1.0, 0.0, -1.0, 0.0, 1.0, 0.0]


def test_two_vessels_head_on_meet() -> None:
    assert cpa_of((0, 0, 0, 1), (0, 100, 180, 1), 120.0) == 0.0
    assert cpa_of((0, 0, 0, 1), (0, 100, 180, 1), 25.0) == 50.0
