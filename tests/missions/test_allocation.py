"""Who goes to which sample point: the stored cases, and properties of both methods."""

import itertools
import json
from math import hypot
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.bloom.allocation import METHODS, greedy_target, optimal_target

CASES = [json.loads(p.read_text()) for p in sorted((Path(__file__).parents[1] / "data/bloom").glob("*.json"))]
GREEDY = [case for case in CASES if case["kind"] == "greedy_allocation"]

coordinate = st.integers(-300, 300).map(float)
place = st.tuples(coordinate, coordinate)
teams = st.dictionaries(
    st.sampled_from(["abe", "ben", "cal", "deb", "eve", "fin"]), place, min_size=1, max_size=6
)


@pytest.mark.parametrize("case", GREEDY, ids=[c["id"] for c in GREEDY])
def test_the_greedy_rule_gives_the_stored_allocations(case):
    agents = {name: tuple(map(float, at)) for name, at in case["agents"].items()}
    points = [tuple(map(float, p)) for p in case["points"]]
    busy = case["remaining_sample_time"]
    found = {name: greedy_target(name, agents, points, busy) for name in agents}
    assert found == case["expected"]


def test_a_vessel_that_still_samples_leaves_the_only_point_to_an_idle_one():
    agents = {"abe": (0.0, 0.0), "ben": (10.0, 0.0)}
    assert greedy_target("abe", agents, [(8.0, 0.0)], {"ben": 15.0}) == 0
    assert greedy_target("ben", agents, [(8.0, 0.0)], {"ben": 15.0}) is None


def slow_greedy(own, places, points, busy):
    """The rule as gcid.md 13 words it, one round after the other."""
    omitted = set()

    def dist(name, i):
        return hypot(points[i][0] - places[name][0], points[i][1] - places[name][1])

    while len(omitted) < len(points):
        left = [i for i in range(len(points)) if i not in omitted]
        p = min(left, key=lambda i: (dist(own, i), i))
        cost = dist(own, p) + busy.get(own, 0.0)
        beaten = False
        for w in places:
            if w == own or dist(w, p) + busy.get(w, 0.0) >= cost:
                continue
            beaten = beaten or not any(dist(w, i) < dist(w, p) for i in range(len(points)))
        if not beaten:
            return p
        omitted.add(p)
    return None


@settings(deadline=None)
@given(teams, st.lists(place, max_size=6), st.data())
def test_the_greedy_rule_equals_its_slow_twin(team, points, data):
    busy = data.draw(
        st.dictionaries(st.sampled_from(sorted(team)), st.integers(0, 20).map(float), max_size=3)
    )
    for own in team:
        assert greedy_target(own, team, points, busy) == slow_greedy(own, team, points, busy)


@settings(max_examples=60, deadline=None)
@given(teams, st.lists(place, min_size=1, max_size=5, unique=True))
def test_the_optimal_assignment_has_the_least_total_of_all(team, points):
    names = sorted(team)
    chosen = {name: optimal_target(name, team, points) for name in names}
    taken = [i for i in chosen.values() if i is not None]
    assert len(set(taken)) == len(taken) == min(len(names), len(points))

    def cost(name, i):
        return hypot(points[i][0] - team[name][0], points[i][1] - team[name][1])

    total = sum(cost(name, i) for name, i in chosen.items() if i is not None)
    slots = [*range(len(points)), *[None] * max(0, len(names) - len(points))]
    best = min(
        sum(cost(n, i) for n, i in zip(names, order, strict=True) if i is not None)
        for order in itertools.permutations(slots, len(names))
    )
    assert total == pytest.approx(best, abs=1e-6)


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_without_points_nobody_gets_one(method):
    assert method("abe", {"abe": (0.0, 0.0)}, [], {}) is None


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_a_vessel_without_a_place_is_refused(method):
    with pytest.raises(KeyError, match="abe"):
        method("abe", {"ben": (0.0, 0.0)}, [(1.0, 1.0)], {})
