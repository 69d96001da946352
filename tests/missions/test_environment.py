"""Blooms and storms: drawn from the seed alone, counted once, whoever looks."""

import itertools
import random
from dataclasses import replace
from math import hypot

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.bloom.environment import (
    Environment,
    EnvironmentSettings,
    StormTrack,
    draw_point,
    exploring_share,
    shrunk,
)
from missions.bloom.zones import STORM_REGION, XRAY, YANKEE
from pymoos_lite.geometry.specs import parse_polygon

ZONES = (parse_polygon(XRAY), parse_polygon(YANKEE))
PAPER = EnvironmentSettings(zones=ZONES, storm_region=parse_polygon(STORM_REGION))


def history(environment, until, step, visit=lambda environment: None):
    """Every bloom and storm there was, as plain numbers."""
    seen = {}
    t = 0.0
    while t < until:
        t += step
        environment.advance(t)
        for bloom in environment.blooms:
            seen[bloom.label] = (bloom.x, bloom.y, bloom.full_radius, bloom.start, bloom.duration)
        if environment.storm is not None:
            storm = environment.storm
            seen[f"storm {storm.number}"] = (storm.x0, storm.y0, storm.course, storm.start, storm.end)
        visit(environment)
    return seen


def test_equal_seeds_bring_equal_blooms_and_storms_and_others_do_not():
    runs = [history(Environment(PAPER, seed), 4000.0, 1.0) for seed in (3, 3, 4)]
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


def test_how_often_it_is_advanced_does_not_change_what_comes():
    assert history(Environment(PAPER, 5), 3000.0, 0.5) == history(Environment(PAPER, 5), 3000.0, 1.0)
    assert (
        history(Environment(PAPER, 5), 3000.0, 7.0).keys()
        == history(Environment(PAPER, 5), 3000.0, 1.0).keys()
    )


def test_vessels_that_detect_and_sample_change_nothing_about_what_comes():
    dice = random.Random(1)

    def visit(environment):
        x, y = draw_point(ZONES[0], dice)
        environment.detect(x, y)
        environment.sample(x, y)

    assert history(Environment(PAPER, 6), 3000.0, 1.0, visit) == history(Environment(PAPER, 6), 3000.0, 1.0)


def test_another_storm_interval_leaves_the_blooms_as_they_were():
    other = replace(PAPER, time_between_storms=600.0)
    blooms = [
        {k: v for k, v in history(Environment(s, 7), 4000.0, 1.0).items() if k.startswith("Bloom")}
        for s in (PAPER, other)
    ]
    assert blooms[0] == blooms[1]
    assert blooms[0]


def test_blooms_lie_inside_their_zone_and_apart_from_each_other():
    zones = [shrunk(zone, PAPER.bloom_radius[1]) for zone in ZONES]

    def visit(environment):
        for bloom in environment.blooms:
            assert any(zone.contains(bloom.x, bloom.y) for zone in zones)
            assert 25.0 <= bloom.full_radius <= 50.0
            assert 0.0 <= bloom.radius <= bloom.full_radius
            for other in environment.blooms:
                apart = hypot(bloom.x - other.x, bloom.y - other.y)
                assert other is bloom or apart >= bloom.full_radius + other.full_radius

    assert len(history(Environment(PAPER, 8), 6000.0, 5.0, visit)) > 30


def test_the_wait_and_the_chance_per_second_set_the_pace_of_blooms():
    # After 90 s of waiting the mean wait for a chance of 0.1 a second is 9 to 10 s: some 100 s for each bloom.
    counts = [
        len([k for k in history(Environment(PAPER, seed), 7200.0, 60.0) if k.startswith("Bloom")])
        for seed in range(20)
    ]
    assert 66 <= sum(counts) / len(counts) <= 74


def test_about_half_of_the_blooms_are_in_the_first_zone_or_all_of_them():
    places = [
        (x, y)
        for seed in range(20)
        for label, (x, y, *_) in history(Environment(PAPER, seed), 7200.0, 60.0).items()
        if label.startswith("Bloom")
    ]
    share = sum(ZONES[0].contains(*p) for p in places) / len(places)
    assert 0.44 <= share <= 0.54
    only = history(Environment(replace(PAPER, first_zone_only=True), 1), 7200.0, 60.0)
    assert all(ZONES[0].contains(x, y) for label, (x, y, *_) in only.items() if label.startswith("Bloom"))


def test_a_growing_bloom_is_half_as_wide_at_half_its_life_and_a_fixed_one_is_full_at_once():
    for growth, half in (("linear", 0.5), ("fixed", 1.0)):
        environment = Environment(replace(PAPER, bloom_growth=growth), 2)
        while not environment.blooms:
            environment.advance(environment.now + 1.0)
        bloom = environment.blooms[0]
        environment.advance(bloom.start + bloom.duration / 2.0)
        assert bloom.radius == pytest.approx(half * bloom.full_radius)


def test_every_bloom_is_counted_once_as_sampled_detected_or_missed():
    environment = Environment(PAPER, 9)
    sampled, detected, over = set(), set(), []
    for second in range(1, 4001):
        environment.advance(float(second))
        over += environment.expired
        for bloom in environment.blooms:
            if bloom.number % 3 == 0 and environment.sample(bloom.x, bloom.y) is not None:
                sampled.add(bloom.number)
            elif bloom.number % 3 == 1 and environment.detect(bloom.x, bloom.y):
                detected.add(bloom.number)
    numbers = [bloom.number for bloom in over]
    assert len(numbers) == len(set(numbers)) > 20
    tally = environment.tally
    assert tally.sampled == len(sampled & set(numbers))
    assert tally.detected == len(detected & set(numbers))
    assert tally.sampled + tally.detected + tally.missed == len(numbers)


def test_a_sample_takes_the_first_bloom_there_that_was_not_sampled():
    environment = Environment(PAPER, 2)
    while not environment.blooms:
        environment.advance(environment.now + 1.0)
    bloom = environment.blooms[0]
    environment.advance(environment.now + 100.0)
    assert environment.sample(bloom.x, bloom.y) is bloom
    assert environment.sample(bloom.x, bloom.y) is None
    assert environment.sample(9999.0, 0.0) is None


def test_the_sensor_reads_one_inside_and_falls_with_the_distance():
    environment = Environment(PAPER, 2)
    assert environment.measure(0.0, 0.0) == 0.0
    while not environment.blooms:
        environment.advance(environment.now + 1.0)
    environment.advance(environment.now + 50.0)
    bloom = environment.blooms[0]
    assert environment.measure(bloom.x, bloom.y) == 1.0
    assert environment.measure(bloom.x + bloom.radius + 9.0, bloom.y) == pytest.approx(0.1)
    assert environment.measure(bloom.x + bloom.radius + 9.0, bloom.y, 2.0) == pytest.approx(0.05)


def test_a_storm_crosses_a_zone_at_its_speed_and_leaves_the_storm_region():
    environment = Environment(PAPER, 11)
    track = []
    while environment.storm is None:
        environment.advance(environment.now + 1.0)
    storm = environment.storm
    assert storm.start == 1800.0
    while environment.storm is storm:
        track.append((storm.x, storm.y))
        environment.advance(environment.now + 1.0)
    steps = [hypot(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(track)]
    assert steps == pytest.approx([0.75] * len(steps), rel=1e-6)
    assert min(abs(PAPER.storm_region.signed_dist(*track[i])) for i in (0, -1)) < 1.0
    assert any(zone.contains(x, y) for zone in ZONES for x, y in track)
    assert min(abs((storm.course - h + 180.0) % 360.0 - 180.0) for h in (334.0, 154.0)) <= 2.0
    ended = environment.now
    while environment.storm is None:
        environment.advance(environment.now + 1.0)
    assert environment.storm.start - ended == pytest.approx(1800.0, abs=1.0)


def test_a_storm_by_timetable_comes_when_and_where_it_should():
    track = StormTrack(300.0, -114.9, -300.1, 154.0)
    environment = Environment(replace(PAPER, storm_tracks=(track,)), 1)
    environment.advance(299.0)
    assert environment.storm is None
    environment.advance(300.0)
    near = []
    while environment.storm is not None:
        near.append(hypot(environment.storm.x + 114.9, environment.storm.y + 300.1))
        assert environment.in_storm(environment.storm.x + 179.0, environment.storm.y)
        assert not environment.in_storm(environment.storm.x + 181.0, environment.storm.y)
        environment.advance(environment.now + 1.0)
    assert min(near) < 0.75
    environment.advance(20000.0)
    assert environment.storm is None


@settings(max_examples=30, deadline=None)
@given(st.floats(1.0, 120.0))
def test_a_shrunk_zone_keeps_its_distance_from_the_edges(distance):
    inner = shrunk(ZONES[0], distance)
    assert inner is not None
    for x, y in inner.points:
        assert ZONES[0].contains(x, y)
        assert ZONES[0].dist(x, y) >= distance - 1e-6


def test_blooms_too_large_for_a_zone_are_refused():
    with pytest.raises(ValueError, match="too small for blooms of 200 m"):
        EnvironmentSettings(zones=ZONES, storm_region=ZONES[0], bloom_radius=(100.0, 200.0))


def test_limits_out_of_order_are_refused():
    with pytest.raises(ValueError, match="bloom_duration from 5 to 4"):
        replace(PAPER, bloom_duration=(5.0, 4.0))


def test_the_share_of_explorers_folds_case():
    assert exploring_share(["EXPLORE", "explore", "EXPLOIT", "MIGRATE"]) == 0.5
    assert exploring_share([]) is None
