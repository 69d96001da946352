"""BHV_ZigZag, BHV_FixedTurn, BHV_FullStop beyond the measured cases (behaviors.md C16, C18, C19)."""

from __future__ import annotations

import pytest
from sailing import Sailor

from behaviors.turn_meter import TurnMeter
from behaviors.turn_spec import ClearTurns, Schedule, TurnSpec, read_turn_spec
from ivp_helm.testing import HelmRig
from pymoos_lite.geometry.angles import project_point


def one(kind, **parameters):
    rig = HelmRig([(kind, {"name": "b", **parameters})])
    rig.own(0.0, 0.0, 90.0, 1.5)
    return rig


def behavior(rig):
    return rig.life("b").behavior


def over(rig):
    return not list(rig.core.population)


# --- zigzag -----------------------------------------------------------------------------------------------


def test_it_swings_to_both_sides_of_the_stem_and_completes():
    flags = {
        "zigflag": "ZIG=$[ZIGS]",
        "zagflag": "ZAG=$[ZAGS]",
        "portflag": "SIDE=port",
        "starflag": "SIDE=star",
        "portflagx": "ENDED=port",
        "starflagx": "ENDED=star",
        "endflag": "DONE=1",
    }
    rig = one("BHV_ZigZag", speed=2, stem_hdg=90, zig_angle=30, max_zig_zags=2, **flags)
    sailor = Sailor(rig, 0.0, 0.0, 90.0, 2.0, turn_rate=20.0)
    assert sailor.sail(60, lambda s: over(rig))
    assert rig.posted("ZIG") == [1.0, 2.0, 3.0, 4.0]
    assert rig.posted("ZAG") == [1.0, 2.0]
    assert rig.posted("SIDE") == ["port", "star", "port", "star", "port"]
    assert rig.posted("ENDED") == ["port", "star", "port", "star"]
    assert rig.posted("DONE") == [1.0]


@pytest.mark.parametrize(("first", "course"), [("left", 60.0), ("starboard", 120.0)])
def test_it_begins_with_the_side_asked_for(first, course):
    rig = one("BHV_ZigZag", speed=2, stem_hdg=90, zig_angle=30, zig_first=first)
    rig.iterate()
    assert rig.decision == {"course": course, "speed": 2.0}


def test_a_threshold_ends_legs_early():
    early = one("BHV_ZigZag", speed=2, stem_hdg=90, zig_angle=30, hdg_thresh=10, zigflag="ZIG=$[OSH]")
    for heading in (90.0, 75.0, 69.0):
        early.own(0.0, 0.0, heading, 2.0)
        early.iterate()
    assert early.posted("ZIG") == [69.0]


def test_fierce_zigging_keeps_asking_ahead_of_the_bow():
    rig = one("BHV_ZigZag", speed=2, stem_hdg=0, zig_angle=20, zig_angle_fierce=50, fierce_zigging="true")
    for heading in (10.0, 0.0, 345.0):
        rig.own(0.0, 0.0, heading, 2.0)
        rig.iterate()
        assert rig.decision["course"] == (heading - 50.0) % 360.0


def test_it_takes_heading_and_speed_of_the_moment_if_told():
    rig = one("BHV_ZigZag", stem_on_active="true", spd_on_active="true", zig_angle=30)
    rig.own(0.0, 0.0, 200.0, 1.5)
    rig.iterate()
    assert rig.decision == {"course": 170.0, "speed": 1.5}


def test_speed_can_be_changed_and_reset_within_the_domain():
    rig = one("BHV_ZigZag", speed=2, zig_angle=30, updates="UP", max_zig_legs=100)
    for update, speed in (("mod_speed=1", 3.0), ("mod_speed=9", 5.0), ("mod_speed=reset", 2.0)):
        rig.mail("UP", update)
        rig.iterate()
        assert rig.decision["speed"] == speed


def test_it_completes_after_its_way_along_the_stem():
    rig = one("BHV_ZigZag", speed=2, stem_hdg=90, zig_angle=30, max_stem_odo=40, max_zig_legs=100)
    sailor = Sailor(rig, 0.0, 0.0, 90.0, 2.0, turn_rate=20.0)
    assert sailor.sail(60, lambda s: over(rig))
    assert 39.0 < sailor.x < 42.0


def test_old_navigation_is_an_error():
    rig = HelmRig([("BHV_ZigZag", {"name": "b", "zig_angle": 30, "speed": 1})])
    rig.own(0.0, 0.0, 0.0, 1.0)
    rig.iterate()
    rig._own = {}
    rig.iterate(20)
    assert rig.posted("BHV_ERROR") == []
    rig.iterate()
    assert rig.posted("BHV_ERROR") == ["b: NAV_X not found or stale."]


def test_macros_follow_the_legs():
    names = (
        "STEM_HDG",
        "STEM_SPD",
        "ZIG_START_SPD",
        "ZIG_MIN_SPD",
        "ZIG_SPD_DELTA",
        "ZIGS_EVER",
        "ZIGS_TOGO",
    )
    flags = [f"{name}=$[{name}]" for name in (*names, "ZIG_SIDE", "ZIG_PORT", "STEM_ODO", "STEM_DIST", "ODO")]
    rig = one("BHV_ZigZag", speed=2, stem_hdg=0, zig_angle=30, max_zig_legs=4, runxflag=flags)
    rig.own(0.0, 0.0, 0.0, 2.0)
    rig.iterate()
    rig.own(-3.0, 4.0, 350.0, 1.4)
    rig.iterate()
    last = {
        name: rig.posted(name)[-1]
        for name in (*names, "ZIG_SIDE", "ZIG_PORT", "STEM_ODO", "STEM_DIST", "ODO")
    }
    assert last == {
        "STEM_HDG": 0.0,
        "STEM_SPD": 2.0,
        "ZIG_START_SPD": 2.0,
        "ZIG_MIN_SPD": 1.4,
        "ZIG_SPD_DELTA": 0.6,
        "ZIGS_EVER": 0.0,
        "ZIGS_TOGO": 4.0,
        "ZIG_SIDE": "port",
        "ZIG_PORT": "true",
        "STEM_ODO": 4.0,
        "STEM_DIST": 3.0,
        "ODO": 5.0,
    }


def test_hints_switch_drawings_off_and_colour_them():
    rig = one("BHV_ZigZag", speed=2, zig_angle=30, visual_hints="draw_req_hdg=false,set_hdg_color=green")
    rig.iterate()
    assert len(rig.posted("VIEW_SEGLIST")) == 1
    assert "edge_color=green" in str(rig.posted("VIEW_SEGLIST")[0])


@pytest.mark.parametrize("angle", ["0.5", "80", "wide"])
def test_zig_angles_are_held_to_75_degrees(angle):
    rig = HelmRig([("BHV_ZigZag", {"name": "b", "zig_angle": angle})], faulty=True)
    assert rig.core.authority.malconfig


# --- fixed turn -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("side", "sign"), [("port", -1), ("star", 1)])
def test_a_turn_ends_after_its_angle_and_is_reported(side, sign):
    rig = one("BHV_FixedTurn", fix_turn=360, mod_hdg=30, turn_dir=side, speed=2, radius_rep_var="RADIUS")
    sailor = Sailor(rig, 0.0, 0.0, 0.0, 2.0, turn_rate=20.0)
    assert sailor.sail(30, lambda s: over(rig))
    report = str(rig.posted("FT_REPORT")[0])
    assert report.startswith("spd=2,mod_hdg=30,rudder_avg=0,avg_rad=")
    # 2 m/s at 20 degrees per second: a circle of 36 m around, 5.73 m radius.
    assert rig.posted("RADIUS")[0] == pytest.approx(5.73, abs=0.05)
    assert sailor.track[20][0] * sign > 0.0


def test_a_turn_can_be_delayed_and_timed_out():
    rig = one("BHV_FixedTurn", fix_turn=360, turn_delay=1, timeout=2, endflag="DONE=1")
    courses = []
    while not over(rig):
        rig.iterate()
        courses.append(rig.decision.get("course"))
    assert courses == [90.0] * 4 + [70.0] * 8 + [None]
    assert rig.posted("DONE") == [1.0]


def test_the_speed_may_be_that_of_the_start():
    rig = one("BHV_FixedTurn", fix_turn=90, speed="auto")
    rig.iterate()
    rig.own(0.0, 0.0, 80.0, 0.5)
    rig.iterate()
    assert rig.decision["speed"] == 1.5


def test_a_schedule_is_sailed_turn_by_turn():
    rig = one(
        "BHV_FixedTurn",
        perpetual="true",
        fix_turn=90,
        turn_spec=["spd=1,mhdg=40,turn=port,key=a,flag=TURNED=a", "fix=45,turn=star,key=b,flag=TURNED=b"],
        endflag="DONE=$[CTR]",
    )
    sailor = Sailor(rig, 0.0, 0.0, 180.0, 1.0, turn_rate=20.0)
    assert sailor.sail(30, lambda s: len(rig.posted("DONE")) == 2)
    assert rig.posted("TURNED") == ["a", "b"]
    assert [str(r).split(",rudder")[0] for r in rig.posted("FT_REPORT")] == [
        "spd=1,mod_hdg=40",
        "spd=1,mod_hdg=20",
    ]
    sailor.sail(1)
    assert behavior(rig).why == "all turns of the schedule are done"


def test_a_repeated_schedule_begins_again_and_auto_alternates():
    rig = one(
        "BHV_FixedTurn",
        perpetual="true",
        turn_spec="fix=20,turn=auto",
        schedule_repeat="true",
        endflag="DONE=$[OSH]",
    )
    sailor = Sailor(rig, 0.0, 0.0, 180.0, 1.0, turn_rate=20.0)
    assert sailor.sail(30, lambda s: len(rig.posted("DONE")) == 4)
    first, second, third, _ = rig.posted("DONE")
    assert first < 180.0 < second + 25.0
    assert first < second > third


@pytest.mark.parametrize(
    ("lines", "keys"),
    [
        (["key=a", "key=b"], ["a", "b"]),
        (["key=a", "key=b", "key=a,spd=3"], ["a", "b"]),
        (["key=a", "clear", "key=c"], ["c"]),
        (["key=a", "clearall,key=c"], ["c"]),
    ],
)
def test_schedules_are_added_to_changed_and_cleared(lines, keys):
    schedule = Schedule()
    for line in lines:
        schedule.take(read_turn_spec(line))
    assert [turn.key for turn in schedule.turns] == keys


def test_a_turn_spec_is_read_with_all_its_parts():
    spec = read_turn_spec(
        "spd=2,mhdg=30,fhdg=270,tdir=starboard,timeout=60,key=x,flag=A=1,flag=B=$[TURN_RAD]"
    )
    assert isinstance(spec, TurnSpec)
    assert (spec.speed, spec.mod_heading, spec.turn, spec.side, spec.timeout) == (2, 30, 270, "star", 60)
    assert [flag.variable for flag in spec.flags] == ["A", "B"]
    assert read_turn_spec("clear") == ClearTurns()


@pytest.mark.parametrize("text", ["spd=-1", "side=up", "turn=up", "spd", "fix="])
def test_faulty_turn_specs_are_refused(text):
    with pytest.raises(ValueError, match=r".+"):
        read_turn_spec(text)


@pytest.mark.parametrize("side", ["port", "star"])
def test_the_meter_measures_a_circle(side):
    sign = -1.0 if side == "port" else 1.0
    meter = TurnMeter(side, 0.0, *project_point(-90.0 * sign, 20.0, 0.0, 0.0), 0.0)
    for k in range(1, 41):
        around = sign * (10.0 * k - 90.0)
        x, y = project_point(around, 20.0, 0.0, 0.0)
        meter.add(x, y, (sign * 10.0 * k) % 360.0, 15.0 * (-1) ** k)
    assert meter.progress == pytest.approx(400.0)
    assert meter.radius == pytest.approx(20.0, abs=1e-6)
    assert meter.mean_rudder == 15.0
    assert meter.distance == pytest.approx(40 * 2 * 20 * 0.08715574, rel=1e-5)


# --- full stop --------------------------------------------------------------------------------------------


def test_a_vessel_that_drifts_back_has_stopped():
    rig = one("BHV_FullStop", endflag=["DIST=$[STOP_DIST]", "TIME=$[STOP_TIME]"])
    for x in (0.0, 2.0, 3.0, 3.2, 3.1):
        rig.own(x, 0.0, 90.0, 0.4)
        rig.iterate()
    assert rig.posted("DIST") == [3.2]
    assert rig.posted("TIME") == [1.0]
    assert over(rig)


def test_completion_waits_for_the_delay_and_the_mark():
    rig = one(
        "BHV_FullStop",
        delay_complete=1,
        mark_duration=2,
        mark_flag="MARK=on",
        unmark_flag="MARK=off",
        endflag="END=1",
    )
    rig.own(0.0, 0.0, 90.0, 0.0)
    times = [bool(rig.posted("END")) for _ in range(12) if rig.iterate()]
    assert times.index(True) == 8
    assert rig.posted("MARK") == ["on", "off"]


def test_until_it_stops_it_asks_for_no_speed_on_the_first_heading():
    rig = one("BHV_FullStop")
    for heading in (90.0, 130.0):
        rig.own(heading / 10.0, 0.0, heading, 1.0)
        rig.iterate()
        assert rig.decision == {"course": 90.0, "speed": 0.0}


def test_a_perpetual_stop_tells_its_end_once_per_activation():
    rig = one("BHV_FullStop", perpetual="true", endflag="DONE=1", condition="GO=1")
    rig.own(0.0, 0.0, 90.0, 0.0)
    for activation in (1, 2):
        rig.mail("GO", 1)
        rig.iterate(4)
        assert rig.posted("DONE") == [1.0] * activation
        rig.mail("GO", 0)
        rig.iterate()
