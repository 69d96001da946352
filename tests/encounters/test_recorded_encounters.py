"""Whole missions of several vessels come out in lockstep as they did in the reference implementation."""

from __future__ import annotations

import re

import pytest
from recorded_encounter import DATA, Recorded, Sailed, track_error

from pymoos_lite.geometry.specs import parse_polygon

LONG = {"ob_field", "ac_threeway", "trail", "convoy", "swap_loiter"}
NAMES = [
    pytest.param(path.name, marks=[pytest.mark.slow] if path.name in LONG else [])
    for path in sorted(DATA.iterdir())
    if path.is_dir()
]
BEHAVIOR_LIFE = re.compile(r"bname=(ac_\w+),.*event=(\w+)")
RANGE_AT_DEATH = re.compile(r"rng=([\d.]+)")


@pytest.fixture(scope="module")
def sailed():
    """Each mission, sailed once."""
    found: dict[str, Sailed] = {}

    def sail(name: str) -> Sailed:
        if name not in found:
            found[name] = Sailed(Recorded(name))
        return found[name]

    return sail


@pytest.mark.parametrize("name", NAMES)
def test_the_vessels_come_as_near_to_each_other_at_the_same_time(name, sailed):
    run = sailed(name)
    setup = run.recorded.setup
    for wanted, tolerance in zip(setup["expected"]["cpa"], setup["tolerance"]["cpa"], strict=True):
        least, time = run.closest(tuple(wanted["pair"]))
        # Where the reference itself ends in different ways, any of them will do.
        outcomes = wanted.get("alternatives", [[wanted["range_m"], wanted["t_s"]]])
        range_m, t_s = min(outcomes, key=lambda outcome: abs(outcome[0] - least))
        assert least == pytest.approx(range_m, abs=tolerance["range_m"])
        if tolerance["t_s"] is not None:  # without one several minima are nearly equal
            assert time == pytest.approx(t_s, abs=tolerance["t_s"])


@pytest.mark.parametrize("name", [n for n in NAMES if n.values[0] != "ob_two"])
def test_every_pass_is_as_recorded(name, sailed):
    run = sailed(name)
    wanted = sorted((tuple(p["pair"]), p["t_s"], p) for p in run.recorded.setup["expected"]["passes"])
    found = sorted((pair, time, least) for pair, least, time in run.passes())
    assert [pair for pair, *_ in found] == [pair for pair, *_ in wanted]
    for (_, time, least), (_, _, measured) in zip(found, wanted, strict=True):
        assert least == pytest.approx(measured["range_m"], abs=max(1.0, 2.0 * measured["range_spread_m"]))
        assert time == pytest.approx(measured["t_s"], abs=max(2.0, 2.0 * measured["t_spread_s"]))


@pytest.mark.parametrize("name", NAMES)
def test_every_vessel_sails_the_recorded_track(name, sailed):
    run = sailed(name)
    tolerance = run.recorded.setup["tolerance"]
    for vehicle in run.recorded.vehicles:
        if vehicle in tolerance["track_not_binding"]:
            continue  # no two recorded runs have it alike
        rms, most = min(track_error(run.tracks[vehicle], other[vehicle]) for other in run.recorded.runs)
        assert rms <= tolerance["track_curve_rms_m"][vehicle]
        assert most <= tolerance["track_curve_max_m"][vehicle]


@pytest.mark.parametrize("name", ["ob_two", "ob_field"])
def test_every_vessel_keeps_the_recorded_distance_from_obstacles(name, sailed):
    run = sailed(name)
    setup = run.recorded.setup
    shapes = {shape.label: shape for shape in map(parse_polygon, setup["obstacles"])}
    for wanted, tolerance in zip(
        setup["expected"]["obstacle_closest"], setup["tolerance"]["obstacle"], strict=True
    ):
        shape = shapes[wanted["obstacle"]]
        least = min(shape.signed_dist(x, y) for _, x, y in run.tracks[wanted["vehicle"]][::2])
        assert least == pytest.approx(wanted["range_m"], abs=tolerance["range_m"])


def lives(posts):
    """(time, behaviour, event) of avoidance behaviours."""
    found = []
    for time, text in posts:
        match = BEHAVIOR_LIFE.search(str(text))
        if match:
            found.append((time, match[1], match[2]))
    return found


@pytest.mark.parametrize("name", [n for n in NAMES if n.values[0].startswith("ac_")])
def test_behaviours_are_spawned_by_alerts_and_die_with_the_encounter(name, sailed):
    run = sailed(name)
    for vehicle in run.recorded.setup["deployed"]:
        events = [(t, v) for t, c, n, v in run.recorded.events if (c, n) == (vehicle, "IVPHELM_LIFE_EVENT")]
        wanted = lives(events)
        found = lives(run.since_start(vehicle, "IVPHELM_LIFE_EVENT"))
        for key in sorted({e[1:] for e in wanted}):
            ours = [t for t, *rest in found if tuple(rest) == key]
            theirs = [t for t, *rest in wanted if tuple(rest) == key]
            # Twice alerted at the border of the range, in the one or the other, is no difference.
            assert ours[0] == pytest.approx(theirs[0], abs=4.0)
            assert ours[-1] == pytest.approx(theirs[-1], abs=4.0)
        for _, text in run.since_start(vehicle, "IVPHELM_LIFE_EVENT"):
            if "event=death" in str(text) and "bname=ac_" in str(text):
                assert 82.5 <= float(RANGE_AT_DEATH.search(str(text))[1]) < 84.5  # 1.1 times completed_dist


@pytest.mark.parametrize("name", ["ac_headon", "ac_stationary"])
def test_behaviours_become_active_and_inactive_in_the_recorded_order(name, sailed):
    run = sailed(name)
    for vehicle in run.recorded.setup["deployed"]:
        wanted = [(t, v) for t, c, n, v in run.recorded.events if (c, n) == (vehicle, "AVOIDING")]
        found = run.since_start(vehicle, "AVOIDING")
        changes = [e for k, e in enumerate(found) if k == 0 or e[1] != found[k - 1][1]]
        assert [v for _, v in changes] == [v for _, v in wanted]
        assert [t for t, _ in changes] == pytest.approx([t for t, _ in wanted], abs=2.0)


@pytest.mark.parametrize("name", NAMES)
def test_the_referee_counts_what_happened(name, sailed):
    run = sailed(name)
    totals = run.recorded.setup["totals"]
    if name != "ob_field":  # there nobody avoids anybody, and how near they come is chance
        # The reference overlooks the near miss of `referee`: it comes late, with too large a range.
        assert run.last("shoreside", "NEAR_MISS_TOTAL") == (1.0 if name == "referee" else 0.0)
        assert run.last("shoreside", "COLLISION_TOTAL") == totals["COLLISION_TOTAL"]
    if name not in (
        "trail",
        "convoy",
    ):  # vessels that keep together: what is one encounter is a matter of a metre
        assert run.last("shoreside", "ENCOUNTER_TOTAL") == totals["ENCOUNTER_TOTAL"]


def test_the_same_seed_gives_the_same_encounter_message_by_message():
    first, second = (Sailed(Recorded("ac_headon"), 7, ("*",), 90.0) for _ in range(2))
    assert first.last("abe", "AVOIDING") == "active"
    assert first.mail == second.mail
