"""Obstacles on shore: the referee, the field and the odometer."""

from __future__ import annotations

import math
import random

import pytest

from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.specs import parse_polygon
from pymoos_lite.marine.encounters import Fix, Ranks
from pymoos_lite.marine.obstacle_encounters import ObstacleReferee
from pymoos_lite.marine.obstacle_field import known_obstacle_text, parse_obstacle_file, visible_point
from pymoos_lite.marine.odometry import Odometer

SQUARE = parse_polygon("pts={0,0:10,0:10,10:0,10},label=ob_0")
FIELD = """
region = pts={30,-20:30,-120:160,-120:160,-20}   // where they may be
min_range = 10
min_size = 6
max_size = 10
poly = pts={48,-40:56,-40:60,-48:56,-56:48,-56:44,-48},label=ob_0
poly = pts={92,-66:104,-66:104,-54:92,-54},label=ob_1
poly = pts={136,-42:144,-50:136,-58:128,-50},label=ob_3
"""


def sail_past(referee: ObstacleReferee, x: float, step: float = 4.0) -> list[tuple[str, float, str]]:
    found = []
    for number in range(30):
        y = -40.0 + step * number
        found += [(e.label, e.distance, e.rank) for e in referee.hear("abe", Fix(float(number), x, y, 0.0))]
    return found


def referee_with_square() -> ObstacleReferee:
    referee = ObstacleReferee(Ranks(encounter=15.0, near_miss=5.0, collision=1.0))
    referee.add("ob_0", SQUARE, 0.0)
    return referee


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        (-20.0, []),
        (-10.0, [("ob_0", 10.0, "clear")]),
        (-5.0, [("ob_0", 5.0, "clear")]),
        (-3.0, [("ob_0", 3.0, "near_miss")]),
        (-0.5, [("ob_0", 0.5, "collision")]),
        (5.0, [("ob_0", 0.0, "collision")]),
    ],
)
def test_each_visit_is_ranked_by_its_least_distance(x: float, expected: list[tuple[str, float, str]]) -> None:
    referee = referee_with_square()
    found = sail_past(referee, x)
    assert [(label, round(dist, 9), rank) for label, dist, rank in found] == expected
    assert referee.totals.encounters == len(expected)


def test_a_small_obstacle_between_two_reports_is_not_missed() -> None:
    referee = referee_with_square()
    assert [rank for _, _, rank in sail_past(referee, 5.0, step=60.0)] == ["collision"]
    assert referee.global_min == 0.0


def test_the_global_minimum_counts_beyond_the_encounter_distance_too() -> None:
    referee = referee_with_square()
    sail_past(referee, -50.0)
    assert referee.global_min == pytest.approx(50.0)
    sail_past(referee, -60.0)
    assert referee.global_min == pytest.approx(50.0)


def test_obstacles_are_cleared_by_label_or_all_once_they_have_settled() -> None:
    referee = referee_with_square()
    referee.add("ob_1", SQUARE, 3.0)
    referee.clear("all", 5.0)
    assert referee.labels() == ["ob_1"]
    referee.clear("nothing", 50.0)
    referee.clear("ob_1", 50.0)
    assert referee.labels() == []
    assert sail_past(referee, 5.0) == []
    with pytest.raises(ValueError):
        referee.add("", SQUARE, 0.0)
    with pytest.raises(ValueError):
        referee.add("line", Polygon(((0.0, 0.0), (1.0, 1.0))), 0.0)


def test_a_field_is_read_and_told_as_it_was_written() -> None:
    field = parse_obstacle_file(FIELD.splitlines())
    assert [obstacle.label for obstacle in field.obstacles] == ["ob_0", "ob_1", "ob_3"]
    assert (field.min_range, field.min_size, field.max_size) == (10.0, 6.0, 10.0)
    text = known_obstacle_text(field.obstacles[1], vsource="radar", duration=30.0)
    assert text == "pts={92,-66:104,-66:104,-54:92,-54},label=ob_1,vsource=radar,duration=30"
    assert parse_polygon(known_obstacle_text(field.obstacles[0])).points == field.obstacles[0].points


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("colour = red", "field.txt:12: 'colour' is none of"),
        ("min_size = 0", "above 0"),
        ("min_size = 11", "greater than max_size"),
        ("poly = pts={0,0:1,0:1,1},label=ob_0", "label of its own"),
        ("poly = pts={0,0:1,0:1,1}", "label of its own"),
        ("poly = pts={0,0:banana}", "field.txt:12"),
        ("nonsense", "key = value"),
    ],
)
def test_a_faulty_field_file_is_refused_with_its_line(line: str, complaint: str) -> None:
    lines = ["// a field", *FIELD.splitlines(), "", "", line]
    with pytest.raises(ValueError, match=complaint):
        parse_obstacle_file(lines, "field.txt")


def test_a_field_without_region_or_sizes_is_refused() -> None:
    with pytest.raises(ValueError, match="no region"):
        parse_obstacle_file([])
    with pytest.raises(ValueError, match="min_size, max_size not given"):
        parse_obstacle_file(["region = pts={0,0:9,0:9,9}", "min_range = 3"])


def test_redrawn_obstacles_keep_their_number_region_size_and_distance_and_repeat_with_the_seed() -> None:
    field = parse_obstacle_file(FIELD.splitlines())
    new, complete = field.redrawn(random.Random(4), first_number=7)
    assert complete
    assert [obstacle.label for obstacle in new.obstacles] == ["ob_7", "ob_8", "ob_9"]
    for number, obstacle in enumerate(new.obstacles):
        assert obstacle.is_convex
        assert field.region.contains_shape(obstacle)
        assert (
            2 * 0.8 * 6.0
            < max(obstacle.bounds[2] - obstacle.bounds[0], obstacle.bounds[3] - obstacle.bounds[1])
            <= 20.01
        )
        for other in new.obstacles[:number]:
            assert obstacle.dist_to_polygon(other) >= 10.0
    again, _ = field.redrawn(random.Random(4), first_number=7)
    assert again == new
    assert field.redrawn(random.Random(5), first_number=7)[0] != new


def test_a_field_too_crowded_says_so_and_ends() -> None:
    text = "region = pts={0,0:20,0:20,20:0,20}\nmin_range = 50\nmin_size = 3\nmax_size = 3\n"
    text += "\n".join(f"poly = pts={{{i},0:{i + 1},0:{i},1}},label=o{i}" for i in range(3))
    new, complete = parse_obstacle_file(text.splitlines()).redrawn(random.Random(1))
    assert not complete
    assert len(new.obstacles) == 1


def test_sensed_points_lie_on_the_side_that_can_be_seen() -> None:
    rng = random.Random(2)
    for _ in range(50):
        x, y = visible_point(SQUARE, -30.0, 5.0, rng)
        assert x == pytest.approx(0.0)
        assert 0.0 <= y <= 10.0
        x, y = visible_point(SQUARE, 5.0, 5.0, rng)
        assert SQUARE.dist(x, y) < 1e-9


def test_an_odometer_adds_legs_and_averages_their_speeds() -> None:
    odometer = Odometer(history=3)
    assert odometer.mean_speed == 0.0
    for time, x in ((0.0, 0.0), (1.0, 2.0), (1.0, 99.0), (3.0, 8.0), (5.0, 10.0)):
        odometer.hear(Fix(time, x, 0.0, 0.0))
    assert odometer.total == odometer.trip == 10.0
    assert odometer.mean_speed == pytest.approx((3.0 + 1.0) / 2)
    odometer.reset_trip()
    odometer.hear(Fix(6.0, 10.0, 4.0, 0.0))
    assert odometer.odometry_report("abe") == "vname=abe,total_dist=14.0,trip_dist=4.0"
    assert odometer.speed_report("abe") == "vname=abe,avg_spd=2.50"
    assert math.isfinite(odometer.mean_speed)
