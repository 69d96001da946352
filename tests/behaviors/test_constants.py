"""BHV_ConstantHeading, BHV_ConstantDepth, BHV_MaxSpeed, BHV_MaxDepth, BHV_MinAltitudeX (behaviors.md C4, C14)."""

from __future__ import annotations

import pytest

from behaviors.steering import on_grid
from ivp_helm.ivp import Domain
from ivp_helm.testing import HelmRig

DEPTH = ("depth:0:100:101",)
COURSE = ("course:0:359:360",)


def one(kind, domain=COURSE, **parameters):
    given = {"name": "b", **parameters}
    rig = HelmRig([(kind, given)], domain=domain)
    rig.own(0.0, 0.0, 20.0, 1.0, 10.0)
    return rig


def table(rig):
    return rig.outcome("b").function.table()


@pytest.mark.parametrize("kind", ["BHV_ConstantHeading", "BHV_MaintainHeading"])
def test_without_a_duration_a_constant_course_completes_at_once(kind):
    rig = one(kind, endflag="DONE=1")
    rig.iterate()
    assert rig.posted("DONE") == [1.0]
    assert list(rig.core.population) == []


def test_without_a_duration_a_constant_depth_completes_at_once():
    rig = one("BHV_ConstantDepth", DEPTH, endflag="DONE=1")
    rig.iterate()
    assert rig.posted("DONE") == [1.0]


@pytest.mark.parametrize(("asked", "kept"), [("-10", 350.0), ("725", 5.0), ("359.7", 0.0), ("90.4", 90.0)])
def test_a_heading_is_wrapped_and_rounded_to_the_domain(asked, kept):
    rig = one("BHV_ConstantHeading", heading=asked, duration="no-time-limit")
    rig.iterate()
    assert rig.core.trace.decision == {"course": kept}


@pytest.mark.parametrize(
    ("entry", "course", "nearest"),
    [
        ("course:0:359:360", 359.6, 0.0),
        ("course:0:359:360", 359.4, 359.0),
        ("course:0:350:36", 356.0, 0.0),
        ("course:0:350:36", 354.0, 350.0),
        ("course:-180:179:360", 200.0, -160.0),
    ],
)
def test_the_nearest_course_may_lie_across_north(entry, course, nearest):
    assert on_grid(Domain.from_entries([entry]), course) == nearest


def test_the_heading_falls_by_the_delta_over_the_peak_and_to_zero_over_the_base():
    rig = one(
        "BHV_ConstantHeading",
        heading=350,
        duration="no-time-limit",
        peakwidth=20,
        basewidth=60,
        summitdelta=40,
    )
    rig.iterate()
    utility = table(rig)
    assert [utility[h] for h in (350, 0, 10, 40, 70, 180)] == pytest.approx([100, 80, 60, 30, 0, 0])


def test_a_heading_completes_within_its_threshold():
    rig = one(
        "BHV_ConstantHeading", heading=10, duration="no-time-limit", complete_thresh=5, endflag="DONE=1"
    )
    rig.iterate()
    assert rig.posted("DONE") == []
    rig.own(0.0, 0.0, 14.0, 1.0)
    rig.iterate()
    assert rig.posted("DONE") == [1.0]


def test_mismatches_are_told_in_every_state_across_north_too():
    rig = one("BHV_ConstantHeading", heading=350, heading_mismatch_var="OFF", duration="no-time-limit")
    rig.iterate()
    assert rig.posted("OFF") == [30.0]
    rig = one("BHV_ConstantDepth", DEPTH, depth=30, depth_mismatch_var="OFF", condition="GO=1")
    rig.iterate()
    assert rig.posted("OFF") == [20.0]


def test_widths_below_zero_count_as_zero_and_deltas_are_held_to_a_hundred():
    rig = one(
        "BHV_ConstantDepth",
        DEPTH,
        depth=30,
        duration="no-time-limit",
        peakwidth=-3,
        basewidth=10,
        summitdelta=300,
    )
    rig.iterate()
    assert rig.life("b").behavior.config.summitdelta == 100.0
    assert table(rig)[[29, 30, 31, 41]] == pytest.approx([90, 100, 90, 0])


def test_a_domain_without_the_variable_is_an_error():
    rig = one("BHV_ConstantDepth", COURSE, duration="no-time-limit")
    rig.iterate()
    assert rig.reason == "BehaviorError"


# --- limits -----------------------------------------------------------------------------------------------


def test_speeds_up_to_the_limit_are_as_good_and_fall_beyond_it():
    rig = one("BHV_MaxSpeed", ("speed:0:4:41",), max_speed=2, tolerance=1, speed_slack_var="SLACK")
    rig.iterate()
    assert table(rig)[[0, 10, 20, 25, 30, 40]] == pytest.approx([100, 100, 100, 50, 0, 0], abs=0.01)
    assert rig.posted("SLACK") == [1.0]
    assert rig.core.trace.decision == {"speed": 2.0}


def test_a_maximum_depth_leaves_shallower_water_alone():
    rig = one("BHV_MaxDepth", DEPTH, max_depth=30, basewidth=20, depth_slack_var="SLACK")
    rig.iterate()
    assert table(rig)[[0, 30, 40, 50, 90]] == pytest.approx([100, 100, 50, 0, 0], abs=0.01)
    assert rig.posted("SLACK") == [20.0]


@pytest.mark.parametrize(("altitude", "limit"), [(25.0, 20), (5.0, 0), (200.0, 100)])
def test_so_much_water_is_kept_below_the_vessel(altitude, limit):
    rig = one("BHV_MinAltitudeX", DEPTH, min_altitude=15)
    rig.mail("NAV_ALTITUDE", altitude)
    rig.iterate()
    utility = table(rig)
    assert utility[: limit + 1] == pytest.approx(100.0, abs=0.01)
    assert utility[limit + 1 :] == pytest.approx(0.0, abs=0.01)


def test_no_bottom_in_sight_is_no_limit():
    rig = one("BHV_MinAltitudeX", DEPTH, min_altitude=15)
    rig.mail("NAV_ALTITUDE", 0)
    rig.iterate()
    assert rig.reason == "NothingToDo"


@pytest.mark.parametrize(("critical", "reason"), [("true", "BehaviorError"), ("false", "NothingToDo")])
def test_an_unknown_altitude_stops_the_vessel_only_if_it_is_critical(critical, reason):
    rig = one("BHV_MinAltitudeX", DEPTH, min_altitude=15, missing_altitude_critical=critical)
    rig.iterate()
    assert rig.reason == reason
    assert rig.posted("MIN_ALT_STATUS") == ["Missing NAV_ALTITUDE info"]
    assert bool(rig.posted("BHV_WARNING")) == (critical == "false")
