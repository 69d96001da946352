"""BHV_Waypoint where the recorded cases say nothing: cycles, order, ends, updates, efficiency (behaviors.md C1)."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from behaviors.arrival import ArrivalEngine
from ivp_helm.testing import HelmRig


def rig(**parameters: object) -> HelmRig:
    pairs = {"name": "w", "points": "0,50:0,100", "speed": 2, **parameters}
    helm = HelmRig([("BHV_Waypoint", pairs)], initial={"GO": "true"})
    helm.own(speed=1)
    return helm


def visit(helm: HelmRig, *points: tuple[float, float]) -> None:
    for x, y in points:
        helm.own(x=x, y=y, speed=1)
        helm.iterate()


def posts_of(helm: HelmRig, iteration: int) -> list[str]:
    """Names posted in an iteration, drawings and statuses left out."""
    return [
        p.variable
        for p in helm.postings
        if p.iteration == iteration and not p.variable.startswith(("VIEW_", "BHV_", "WPT_ODO"))
    ]


# --- the arrival engine -----------------------------------------------------------------------------------


def engine(*points: tuple[float, float], **settings: object) -> ArrivalEngine:
    made = ArrivalEngine()
    for name, value in settings.items():
        setattr(made, name, value)
    made.set_points(points)
    return made


def test_a_point_is_captured_inside_the_radius_and_not_on_it():
    e = engine((10.0, 0.0), (20.0, 0.0), capture_radius=5.0, slip_radius=0.0)
    assert e.arrive(5.0, 0.0) == "none"
    assert e.arrive(5.1, 0.0) == "advanced"
    assert (e.capture_hits, e.hits, e.index) == (1, 1, 1)


def test_a_point_is_passed_when_the_distance_opens_inside_the_slip_radius():
    e = engine((10.0, 0.0), (20.0, 0.0), capture_radius=2.0, slip_radius=8.0)
    assert [e.arrive(x, 6.0) for x in (0.0, 5.0, 9.0, 10.0)] == ["none"] * 4
    assert e.arrive(10.5, 6.0) == "advanced"
    assert (e.capture_hits, e.hits) == (0, 1)


def test_opening_outside_the_slip_radius_is_no_arrival():
    e = engine((10.0, 0.0), (20.0, 0.0), capture_radius=2.0, slip_radius=5.0)
    assert [e.arrive(x, 6.0) for x in (0.0, 10.0, 20.0)] == ["none"] * 3


def test_the_capture_line_is_crossed_beyond_the_point():
    e = engine((10.0, 0.0), (20.0, 0.0), capture_radius=1.0, slip_radius=0.0, capture_line=True)
    e.previous = (0.0, 0.0)
    assert e.arrive(9.9, 40.0) == "none"
    assert e.arrive(10.1, 40.0) == "advanced"


def test_only_one_point_is_reached_per_call():
    e = engine((0.0, 0.0), (0.0, 0.0), (0.0, 0.0), capture_radius=5.0)
    assert [e.arrive(0.0, 0.0) for _ in range(3)] == ["advanced", "advanced", "completed"]


@pytest.mark.parametrize(("repeats", "events"), [(0, ["completed"]), (2, ["cycled", "cycled", "completed"])])
def test_rounds_are_repeated_as_often_as_asked(repeats, events):
    e = engine((0.0, 0.0), capture_radius=5.0, perpetual=True, repeats=repeats)
    assert [e.arrive(0.0, 0.0) for _ in events] == events


@given(st.lists(st.tuples(st.floats(-100, 100), st.floats(-100, 100)), min_size=1, max_size=6))
def test_sailing_straight_from_point_to_point_reaches_each_once_and_in_order(points):
    e = engine(*points, capture_radius=2.0, slip_radius=15.0)
    reached = []
    path = [(0.0, 0.0), *points]
    for (ax, ay), (bx, by) in pairwise(path):
        steps = max(1, int(math.hypot(bx - ax, by - ay)))
        for k in range(1, steps + 1):
            index = e.index
            event = e.arrive(ax + (bx - ax) * k / steps, ay + (by - ay) * k / steps)
            if event != "none":
                reached.append(index)
            if event == "completed":
                assert reached == list(range(len(points)))
                return
    # Standing on the last point, what is left (points closer together than the radius) falls one by one.
    for _ in points:
        index = e.index
        if e.arrive(*points[-1]) == "completed":
            reached.append(index)
            break
        reached.append(index)
    assert reached == sorted(reached)


# --- the behaviour ----------------------------------------------------------------------------------------


def test_a_cycle_posts_status_flags_count_and_the_new_leg_in_order():
    helm = rig(repeat=1, cycleflag="CYC=$[CYCREM]", wptflag="HIT=$[PI]")
    visit(helm, (0, 0), (0, 50), (0, 100), (0, 60))
    assert posts_of(helm, 3) == ["WPT_STAT", "CYC", "HIT", "CYCLE_INDEX", "WPT_STAT", "WPT_INDEX"]
    assert helm.posted("CYC") == [0.0]
    assert helm.posted("HIT") == [0.0, 1.0]
    assert "behavior-name=w,cycled" in helm.posted("WPT_STAT")
    visit(helm, (0, 50), (0, 100))
    assert helm.posted("CYCLE_INDEX") == [1.0, 2.0]
    assert helm.outcome("w").state == "running", "repeat makes it perpetual"


def test_reversed_order_begins_at_the_end_and_toggle_turns_round():
    helm = rig(order="reverse", updates="UP")
    helm.iterate()
    assert "x=0,y=100" in str(helm.posted("VIEW_POINT")[0])
    helm.mail("UP", "order=toggle")
    helm.iterate()
    assert "x=0,y=50" in str(helm.posted("VIEW_POINT")[-1])


def test_it_slows_down_toward_the_end_of_all_rounds_and_stops():
    helm = rig(points="0,100", end_spd="slow_dist=50,stop_dist=10", capture_radius=1, slip_radius=0)
    speeds = []
    for y in (0, 49, 70, 80, 90, 95):
        visit(helm, (0, y))
        speeds.append(helm.decision["speed"])
    assert speeds == [2.0, 2.0, 1.0, 0.5, 0.0, 0.0]


def test_with_endless_rounds_it_does_not_slow_down():
    helm = rig(repeat="forever", end_spd="slow_dist=50,stop_dist=10")
    visit(helm, (0, 90))
    assert helm.decision["speed"] == 2.0


def test_new_points_at_run_time_begin_a_new_list():
    helm = rig(updates="UP")
    visit(helm, (0, 0), (0, 50))
    assert helm.posted("WPT_INDEX")[-1] == 1.0
    helm.mail("UP", "points=70,50:90,50")
    helm.iterate()
    assert helm.posted("WPT_INDEX")[-1] == 0.0
    assert helm.decision["course"] == 90.0


def test_xpoints_keep_the_index_and_need_the_same_number():
    helm = rig(updates="UP")
    visit(helm, (0, 0), (0, 50))
    helm.mail("UP", "xpoints=0,50:60,50")
    helm.iterate()
    assert (helm.posted("WPT_INDEX")[-1], helm.decision["course"]) == (1.0, 90.0)
    helm.mail("UP", "xpoints=0,0")
    helm.iterate()
    assert helm.life("w").counts == "1/2"


def test_a_point_can_be_added_and_one_be_chosen():
    helm = rig(updates="UP", points="0,50")
    helm.mail("UP", "newpt=60,0 # currix=1")
    helm.iterate()
    assert helm.decision["course"] == 90.0
    helm.mail("UP", "currix=9")
    helm.iterate()
    assert helm.decision["course"] == 90.0, "a number too high is ignored"


def test_the_point_it_starts_at_can_be_the_point():
    helm = rig(points="start", endflag="DONE=1")
    helm.own(x=7, y=8)
    helm.iterate()
    assert helm.posted("DONE") == [1.0]


def test_no_points_are_a_warning_unless_they_are_meant():
    helm = rig(points="empty")
    helm.iterate()
    assert (helm.posted("BHV_WARNING"), helm.reason) == ([], "NothingToDo")
    helm = HelmRig([("BHV_Waypoint", {"name": "w", "updates": "UP"})])
    helm.own()
    helm.iterate()
    assert set(helm.posted("BHV_WARNING")) == {"w: No waypts given. Set val to empty if intentional"}
    helm.mail("UP", "points=0,50 # speed=1")
    helm.iterate()
    assert ("retract", "w: No waypts given. Set val to empty if intentional") in helm.core.take_notes()
    assert helm.decision["course"] == 0.0


def test_going_idle_erases_the_drawings_and_the_distances():
    helm = rig(condition="GO = true", wpt_dist_to_prev="DP", wpt_dist_to_next="DN")
    helm.iterate()
    helm.mail("GO", "no")
    helm.iterate()
    assert helm.posted("DP")[-1] == helm.posted("DN")[-1] == -1.0
    assert all("active=false" in str(text) for text in helm.posted("VIEW_POINT")[-1:])
    assert "active=false" in str(helm.posted("VIEW_SEGLIST")[-1])


def test_resetting_on_idle_begins_at_the_first_point_again():
    for reset, course in (("true", 180.0), ("false", 0.0)):
        helm = rig(condition="GO = true", reset_on_idle=reset)
        visit(helm, (0, 0), (0, 50))
        helm.mail("GO", "no")
        visit(helm, (0, 70))
        helm.mail("GO", "true")
        visit(helm, (0, 70))
        assert helm.decision["course"] == course


def test_absolute_capture_lines_do_away_with_radii():
    helm = rig(capture_line="absolute", capture_radius=30)
    visit(helm, (0, 0), (0, 49))
    assert helm.posted("WPT_INDEX") == [0.0]
    visit(helm, (5, 50.5))
    assert helm.posted("WPT_INDEX") == [0.0, 1.0]


def test_the_lead_keeps_to_the_track_and_the_damper_lengthens_it_near_the_track():
    helm = rig(points="0,0:0,100", lead=10, capture_radius=3)
    visit(helm, (0, 0), (10, 40))
    assert helm.decision["course"] == 315.0
    helm = rig(points="0,0:0,100", lead=10, lead_damper=20, capture_radius=3)
    visit(helm, (0, 0), (10, 40))
    assert helm.decision["course"] == pytest.approx(360 - math.degrees(math.atan2(10, 20)), abs=0.6)


def test_efficiency_is_told_from_the_second_hit_on():
    helm = rig(points="0,50:0,100:0,150", efficiency_measure="all", post_suffix="X")
    visit(helm, (0, 0), (0, 50), (10, 75), (0, 100))
    summary = str(helm.posted("WPT_EFF_SUMM_LEG_X")[0])
    sailed = 2 * math.hypot(10, 25)
    assert summary == (
        f"vname=alpha,bhv_name=w,linear_dist=50,odo_dist={sailed:.1f},efficiency_dist={50 / sailed:.3f},"
        "linear_time=25,odo_time=0.5,efficiency_time=50"
    )
    assert helm.posted("WPT_EFF_DIST_LEG_X")[0] == pytest.approx(50 / sailed)
    assert len(helm.posted("WPT_EFF_DIST_ALL_X")) == 1


def test_a_change_of_speed_disqualifies_the_running_leg():
    helm = rig(points="0,50:0,100:0,150", efficiency_measure="all", updates="UP")
    visit(helm, (0, 0), (0, 50))
    helm.mail("UP", "speed=1")
    visit(helm, (0, 75), (0, 100))
    assert helm.posted("WPT_EFF_SUMM_LEG") == []
    visit(helm, (0, 150))
    assert len(helm.posted("WPT_EFF_SUMM_LEG")) == 1


def test_flags_can_be_posted_on_start_and_know_all_macros():
    names = "WPTS WPTS_HIT WPTS_REM CYCLES CYC_DIST_TOGO ALL_DIST_TOGO SPEED ORDER NX NY X Y NI IX"
    helm = rig(wptflag_on_start="true", wptflag=[f"M_{name}=$[{name}]" for name in names.split()])
    helm.iterate()
    found = {name: helm.posted(f"M_{name}")[0] for name in names.split()}
    assert found == {
        "WPTS": 2.0,
        "WPTS_HIT": 0.0,
        "WPTS_REM": 2.0,
        "CYCLES": 0.0,
        "CYC_DIST_TOGO": 100.0,
        "ALL_DIST_TOGO": 100.0,
        "SPEED": 2.0,
        "ORDER": "normal",
        "NX": 0.0,
        "NY": 50.0,
        "X": 0.0,
        "Y": 50.0,
        "NI": 0.0,
        "IX": 0.0,
    }


def test_lean_communication_draws_nothing():
    helm = rig(comms_policy="lean")
    helm.iterate()
    assert helm.posted("VIEW_SEGLIST") == helm.posted("VIEW_POINT") == []
    for hidden in ("off", "inactive"):
        helm = rig(visual_hints=f"edge_color = {hidden}")
        helm.iterate()
        assert helm.posted("VIEW_SEGLIST") == []


# --- the closing-rate function ----------------------------------------------------------------------------


def slow_closing_rate(course: float, speed: float, bearing: float, wanted: float, top: float) -> float:
    """The twin, written out for one course and speed."""
    off = abs((course - bearing + 180.0) % 360.0 - 180.0)
    short = wanted - math.cos(math.radians(off)) * speed
    if short < 0.0:
        short = -short / 2.0
    short = min(short, 2.0 * top)
    return 0.8 * 100.0 * (1.0 - short / (2.0 * top)) + 0.2 * 100.0 * (1.0 - off * speed / (180.0 * top))


@pytest.mark.parametrize(
    ("x", "heading", "speed"), [(0.0, 0.0, 2.0), (80.0, 300.0, 4.0), (-300.0, 77.0, 1.0)]
)
def test_the_closing_rate_function_is_near_its_formula_everywhere(x, heading, speed):
    helm = rig(points="0,500", ipf_type="roc", speed=speed)
    helm.own(x=x, heading=heading, speed=1)
    helm.iterate()
    function = helm.outcome("w").function
    bearing = math.degrees(math.atan2(-x, 500.0)) % 360.0
    exact = [
        [slow_closing_rate(c, v, bearing, speed, 5.0) for v in function.domain["speed"].values()]
        for c in function.domain["course"].values()
    ]
    least, most = min(map(min, exact)), max(map(max, exact))
    table = function.table()
    errors = [
        abs(table[i][j] - (value - least) * 100.0 / (most - least))
        for i, row in enumerate(exact)
        for j, value in enumerate(row)
    ]
    assert (
        max(errors) <= 0.5 + 0.5
    )  # half a point of the build, half of stretching to the pieces' own extremes
    assert sum(errors) / len(errors) <= 0.15


def test_build_info_of_the_user_wins_over_the_defaults():
    few = rig(points="0,500", ipf_type="roc", build_info="uniform_amount=20 # smart_amount=0")
    few.iterate()
    assert few.outcome("w").function.pieces <= 20
