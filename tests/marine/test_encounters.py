"""The encounter referee: true closest points, the reference's rule, ranks and counts."""

from __future__ import annotations

import csv
import math
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.marine.encounters import ApproachMonitor, Encounter, EncounterReferee, Fix, Ranks

DATA = Path(__file__).parent.parent / "data" / "contacts"


def straight(x: float, y: float, heading: float, speed: float, time: float) -> Fix:
    rad = math.radians(heading)
    return Fix(time, x + speed * time * math.sin(rad), y + speed * time * math.cos(rad), heading)


def recorded_events(compat: bool) -> list[Encounter]:
    """Events of the recorded run, with 2 Hz reports that come in turn, 0.17 s apart."""
    with open(DATA / "referee.csv", newline="") as file:
        rows = [{key: float(value) for key, value in row.items() if value} for row in csv.DictReader(file)]
    referee = EncounterReferee(Ranks(), compat)
    events: list[Encounter] = []
    for before, row in pairwise(rows):
        for number, name in enumerate(("abe", "ben", "cal")):
            share = number / 3.0
            x = before[f"{name}_x"] + share * (row[f"{name}_x"] - before[f"{name}_x"])
            y = before[f"{name}_y"] + share * (row[f"{name}_y"] - before[f"{name}_y"])
            events += referee.hear(name, Fix(before["t"] + share * 0.5, x, y, before[f"{name}_heading"]))
    return events


def test_the_recorded_passes_have_their_true_ranges_and_ranks() -> None:
    miss, hit = recorded_events(compat=False)
    assert (miss.vname1, miss.vname2, miss.rank) == ("abe", "cal", "near_miss")
    assert miss.cpa == pytest.approx(4.83, abs=0.05)
    assert miss.time == pytest.approx(41.5, abs=2.0)
    assert (hit.vname1, hit.vname2, hit.rank) == ("abe", "ben", "collision")
    assert hit.cpa == pytest.approx(2.0, abs=0.05)
    assert hit.time == pytest.approx(72.4, abs=1.0)
    assert hit.report().startswith("cpa=2,vname1=abe,vname2=ben,rank=collision, alpha=")
    assert hit.report().endswith("ptype=port:port, xtype=aft:aft")


def test_the_sampled_rule_reports_the_slow_pass_late_and_too_large_as_the_reference_did() -> None:
    miss, hit = recorded_events(compat=True)
    assert miss.rank == "clear"
    assert 5.5 < miss.cpa < 8.0
    assert 42.5 < miss.time < 46.0
    assert miss.report().endswith("ptype=port:star, xtype=aft:aft")
    assert miss.alpha == pytest.approx(173.3, abs=6.0)
    assert miss.beta == pytest.approx(263.3, abs=6.0)
    assert hit.rank == "collision"
    assert hit.cpa == pytest.approx(2.0, abs=0.3)


@given(
    own=st.tuples(st.floats(-40, 40), st.floats(-40, 40), st.floats(0, 360), st.floats(0.5, 3)),
    other=st.tuples(st.floats(-40, 40), st.floats(-40, 40), st.floats(0, 360), st.floats(0.5, 3)),
    gaps=st.tuples(st.floats(0.2, 3.0), st.floats(0.2, 3.0), st.floats(0.0, 1.0)),
)
def test_straight_tracks_give_the_exact_closest_point_whatever_the_report_times(
    own: tuple[float, float, float, float],
    other: tuple[float, float, float, float],
    gaps: tuple[float, float, float],
) -> None:
    reports = [(gaps[0] * i, 0) for i in range(int(80 / gaps[0]))]
    reports += [(gaps[2] + gaps[1] * i, 1) for i in range(int(80 / gaps[1]))]
    monitor = ApproachMonitor()
    found: list[float] = []
    for time, which in sorted(reports):
        fix = straight(*(own if which == 0 else other), time)
        found += [cpa for cpa, _, _ in monitor.hear(which, fix)]

    def apart(time: float) -> float:
        a, b = straight(*own, time), straight(*other, time)
        return math.hypot(a.x - b.x, a.y - b.y)

    begin = gaps[2]
    end = min(max(t for t, w in reports if w == which) for which in (0, 1))
    a, b, c, d = straight(*own, 0.0), straight(*other, 0.0), straight(*own, 1.0), straight(*other, 1.0)
    px, py = b.x - a.x, b.y - a.y
    vx, vy = d.x - b.x - (c.x - a.x), d.y - b.y - (c.y - a.y)
    square = vx * vx + vy * vy
    closest = min(end, max(begin, -(px * vx + py * vy) / square)) if square > 1e-12 else begin
    least = apart(closest)
    closed, opened = apart(begin) - least, apart(end) - least
    if closed > 1.001 and opened > 1.001:
        assert found == [pytest.approx(least, abs=1e-6)]
    elif closed < 0.999 or opened < 0.999:
        assert found == []


def test_reports_out_of_order_or_repeated_change_nothing() -> None:
    monitor, again = ApproachMonitor(), ApproachMonitor()
    found: list[float] = []
    for step in range(60):
        for which, track in ((0, (0.0, 0.0, 90.0, 1.0)), (1, (30.0, 3.0, 270.0, 1.0))):
            fix = straight(*track, step * 0.5)
            found += [cpa for cpa, _, _ in monitor.hear(which, fix)]
            for copy in (fix, fix, straight(*track, max(0.0, step * 0.5 - 3.0))):
                list(again.hear(which, copy))
    assert found == [pytest.approx(3.0)]
    assert again.range == pytest.approx(monitor.range)


def test_a_wobble_of_less_than_a_metre_is_no_encounter() -> None:
    referee = EncounterReferee(Ranks())
    for step in range(200):
        referee.hear("a", Fix(step * 0.5, 0.0, 0.0, 0.0))
        assert referee.hear("b", Fix(step * 0.5, 10.0 + 0.45 * math.sin(step), 0.0, 0.0)) == []
    assert referee.totals.encounters == 0
    assert referee.closest_range() == pytest.approx(10.0, abs=0.5)


def test_each_pass_of_a_circling_vessel_counts_once() -> None:
    referee = EncounterReferee(Ranks(encounter=20.0, near_miss=6.0, collision=3.0))
    events = []
    for step in range(1200):
        time = step * 0.5
        events += referee.hear("buoy", Fix(time, 0.0, 0.0, 0.0))
        angle = 2 * math.pi * time / 100.0
        events += referee.hear("boat", Fix(time, 15.0 + 10.0 * math.cos(angle), 10.0 * math.sin(angle), 0.0))
    assert [event.rank for event in events] == ["near_miss"] * 6
    assert all(event.cpa == pytest.approx(5.0, abs=0.05) for event in events)
    assert referee.totals.near_misses == 6
    assert referee.closest_ever == pytest.approx(5.0, abs=0.05)


def test_far_pairs_are_forgotten_and_start_anew() -> None:
    referee = EncounterReferee(Ranks())
    referee.hear("a", Fix(0.0, 0.0, 0.0, 0.0))
    referee.hear("b", Fix(0.0, 25.0, 0.0, 0.0))
    assert referee.ranges() == {("a", "b"): 25.0}
    referee.hear("b", Fix(1.0, 31.0, 0.0, 0.0))
    assert referee.ranges() == {}
    assert referee.within("a", 40.0) == 1
    assert referee.within("a", 30.0) == 0
    assert referee.within("nobody", 30.0) == 0
    referee.forget("b")
    assert referee.within("a", 40.0) == 0


def test_ranks_keep_their_order() -> None:
    ranks = Ranks(encounter=2.0, near_miss=1.0, collision=5.0).ordered()
    assert (ranks.encounter, ranks.near_miss, ranks.collision) == (5.0, 5.0, 5.0)
    assert [Ranks().rank(cpa) for cpa in (3.0, 3.1, 6.0, 6.1)] == [
        "collision",
        "near_miss",
        "near_miss",
        "clear",
    ]


def test_a_silent_partner_costs_bounded_memory() -> None:
    monitor = ApproachMonitor()
    for step in range(10_000):
        list(monitor.hear(0, Fix(float(step), 0.0, 0.0, 0.0)))
    assert len(monitor._tracks[0]) <= 64
