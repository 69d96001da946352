"""BHV_LegRun beyond the measured cases (behaviors.md C17)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sailing import Sailor

from behaviors.leg_course import LegCourse, TurnShape
from behaviors.speed_schedule import SpeedSchedule, read_leg_speeds
from behaviors.track_line import track_point
from ivp_helm.testing import HelmRig


def run(**parameters):
    given = {"name": "run", "p1": "0,0", "p2": "100,0", "speed": 2, "turn_rad": 12, "capture_radius": 5}
    given.update(parameters)
    return HelmRig([("BHV_LegRun", {k: v for k, v in given.items() if v is not None})])


def behavior(rig):
    return rig.life("run").behavior


def test_legs_and_turns_follow_each_other_for_ever():
    rig = run(repeat="forever", lead=8)
    sailor = Sailor(rig, 50.0, 5.0, 270.0, 2.0)
    assert sailor.sail(900, lambda s: len(rig.posted("LR_MODE")) == 11)
    assert rig.posted("LR_MODE")[1:] == ["leg1", "turn1", "leg2", "turn2"] * 2 + ["leg1", "turn1"]
    on_leg = [y for x, y in sailor.track if 30 < x < 70]
    assert max(abs(y) for y in on_leg) < 6.0  # the legs are sailed along their line


def test_flags_mark_the_ends_and_the_middle_of_legs_and_turns():
    flags = {
        "leg_end_flag": "A=leg",
        "leg1_end_flag": "A=leg1",
        "leg2_end_flag": "A=leg2",
        "turn_end_flag": "A=turn",
        "turn1_end_flag": "A=turn1",
        "turn2_end_flag": "A=turn2",
        "mid_leg_flag": "A=midleg",
        "mid_turn_flag": "A=midturn",
        "mid_leg_pct": 50,
    }
    rig = run(repeat="forever", **flags)
    sailor = Sailor(rig, 90.0, 0.0, 270.0, 2.0)
    assert sailor.sail(600, lambda s: rig.posted("A")[-1:] == ["turn2"])
    assert rig.posted("A") == [
        "midleg",
        *("leg", "leg1", "midturn", "turn", "turn1"),
        *("midleg", "leg", "leg2", "midturn", "turn", "turn2"),
    ]


@pytest.mark.parametrize(("repeat", "legs"), [(0, 2), (1, 4)])
def test_without_perpetual_it_ends_when_its_rounds_are_sailed(repeat, legs):
    rig = run(repeat=repeat, perpetual="false", leg_end_flag="LEG=$[CTR]", endflag="DONE=$[CYCLES]")
    sailor = Sailor(rig, 50.0, 0.0, 270.0, 2.0)
    assert sailor.sail(900, lambda s: not list(rig.core.population))
    assert rig.posted("LEG")[-1] == legs
    assert rig.posted("DONE") == [legs / 2]


def test_being_perpetual_it_tells_the_end_of_each_set_of_rounds_and_sails_on():
    rig = run(repeat=0, endflag="DONE=$[CYCLES]")
    sailor = Sailor(rig, 50.0, 0.0, 270.0, 2.0)
    assert sailor.sail(900, lambda s: len(rig.posted("DONE")) == 2)
    assert rig.posted("DONE") == [1.0, 2.0]
    assert rig.posted("LR_MODE")[1:] == ["leg1", "turn1", "leg2", "turn2", "leg1", "turn1", "leg2", "turn2"]


def test_it_steers_for_the_turn_in_the_iteration_in_which_the_leg_ends():
    rig = run(turn_rad=15)
    rig.own(10.0, 0.0, 270.0, 1.5)
    rig.iterate()
    assert rig.decision["course"] == 270.0
    rig.own(3.0, 0.0, 270.0, 1.5)
    rig.iterate()
    assert rig.posted("LR_MODE")[-1] == "turn1"
    assert 270.0 < rig.decision["course"] < 290.0


@pytest.mark.parametrize(
    ("mode", "x", "first"),
    [
        ("fixed", 90.0, "leg1"),
        ("resume", 90.0, "leg1"),
        ("close_turn", 90.0, "leg2"),
        ("close_turn", 10.0, "leg1"),
        ("far_turn", 90.0, "leg1"),
        ("far_turn", 10.0, "leg2"),
    ],
)
def test_the_first_leg_may_be_chosen_by_distance(mode, x, first):
    rig = run(init_leg_mode=mode)
    rig.own(x, 30.0, 0.0, 1.0)
    rig.iterate()
    assert rig.posted("LR_MODE") == ["init", first]


def test_idling_in_a_turn_goes_on_with_the_next_leg():
    rig = run(condition="GO=1")
    rig.mail("GO", 1)
    rig.own(3.0, 0.0, 270.0, 1.5)
    rig.iterate(2)
    assert rig.posted("LR_MODE")[-1] == "turn1"
    rig.mail("GO", 0)
    rig.iterate()
    assert rig.posted("LR_MODE")[-1] == "leg2"
    rig.mail("GO", 1)
    rig.iterate()
    assert rig.decision["course"] == 90.0


def test_idle_erases_everything_that_was_drawn():
    rig = run(condition="GO=1")
    rig.mail("GO", 1)
    rig.own(50.0, 0.0, 270.0, 1.5)
    rig.iterate()
    shown = [str(view) for name in VIEWS for view in rig.posted(name) if "active=false" not in str(view)]
    drawn = {view.split("label=")[1].split(",")[0] for view in shown}
    before = len(rig.published)
    rig.mail("GO", 0)
    rig.iterate()
    gone = {
        str(value).split("label=")[1].split(",")[0]
        for _, name, value in rig.published[before:]
        if name in VIEWS and "active=false" in str(value)
    }
    assert drawn <= gone


VIEWS = ("VIEW_POINT", "VIEW_SEGLIST")


# --- speeds -----------------------------------------------------------------------------------------------


def leg_speeds(**parameters):
    """The speed of each leg and turn of two rounds."""
    rig = run(repeat="forever", capture_radius=8, **parameters)
    sailor = Sailor(rig, 50.0, 0.0, 270.0, 2.0)
    found = {}
    sailor.sail(
        900,
        lambda s: (
            found.setdefault(len(rig.posted("LR_MODE")), rig.posted("LR_NOW_SPD")[-1]) and len(found) > 7
        ),
    )
    return list(found.values())[:8]


def test_the_schedule_begins_with_the_first_leg_and_turns_are_cruised():
    assert leg_speeds(leg_spds="2:1.5,3") == [1.5, 2.0, 1.5, 2.0, 3.0, 2.0, 2.0, 2.0]


def test_turns_may_keep_the_speed_of_the_leg():
    assert leg_speeds(leg_spds="2:1.5,3", leg_spds_onturn="true") == [1.5, 1.5, 1.5, 1.5, 3.0, 3.0, 2.0, 2.0]


def test_the_schedule_may_repeat():
    assert leg_speeds(leg_spds="1,3", leg_spds_repeat="true") == [1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0, 2.0]


def test_schedules_are_appended_to_replaced_cleared_and_reset():
    schedule = SpeedSchedule()
    for line, speeds in (
        ("2:1.2,1.5", (1.2, 1.2, 1.5)),
        ("2", (1.2, 1.2, 1.5, 2.0)),
        ("replace,3:1", (1.0, 1.0, 1.0)),
        ("reset", (1.0, 1.0, 1.0)),
        ("clear", ()),
    ):
        schedule.change(read_leg_speeds(line))
        assert schedule.speeds == speeds
    assert schedule.take(True) is None


@pytest.mark.parametrize("text", ["fast", "0:2", "1.5:2", "-1", "2:-1", "99999999:1"])
def test_faulty_schedules_are_refused(text):
    with pytest.raises(ValueError, match=r".+"):
        read_leg_speeds(text)


@pytest.mark.parametrize("parameter", ["speed", "leg_spds"])
def test_speeds_beyond_the_domain_are_configuration_errors(parameter):
    rig = HelmRig([("BHV_LegRun", {"name": "r", parameter: "7"})], faulty=True)
    assert "at most 5" in " ".join(str(p) for p in rig.core.problems)


# --- geometry ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("update", "p1", "p2"),
    [
        ("shift_pt=0,50", (-50.0, 50.0), (50.0, 50.0)),
        ("leg_len=40", (30.0, 0.0), (70.0, 0.0)),
        ("leg_len_mod=-60", (30.0, 0.0), (70.0, 0.0)),
        ("leg_ang=180", (50.0, 50.0), (50.0, -50.0)),
        ("leg_ang_mod=90", (50.0, 50.0), (50.0, -50.0)),
        ("leg=x=0,y=0,ang=0,len=20", (0.0, -10.0), (0.0, 10.0)),
        ("p1=-20,0", (-20.0, 0.0), (100.0, 0.0)),
    ],
)
def test_legs_can_be_changed_under_way(update, p1, p2):
    rig = run(updates="UP")
    rig.own(50.0, 0.0, 270.0, 1.5)
    rig.iterate()
    rig.mail("UP", update)
    rig.iterate()
    course = behavior(rig).course
    assert course.p1 == pytest.approx(p1, abs=1e-9)
    assert course.p2 == pytest.approx(p2, abs=1e-9)
    assert behavior(rig).engine.current == pytest.approx(p1, abs=1e-9)


@pytest.mark.parametrize(
    ("update", "number", "quantity", "value"),
    [
        ("turn1_rad=20", 1, "radius", 20.0),
        ("turn_rad_mod=-5", 2, "radius", 7.0),
        ("turn_rad_mod=-50", 1, "radius", 2.0),
        ("turn2_bias=40", 2, "bias", 40.0),
        ("turn_bias_mod=300", 1, "bias", 100.0),
        ("turn_ext=15", 2, "extension", 15.0),
        ("turn1_ext_mod=-3", 1, "extension", 0.0),
        ("turn_dir=toggle", 1, "port", False),
        ("turn2_dir=star", 2, "port", False),
    ],
)
def test_turns_can_be_changed_under_way(update, number, quantity, value):
    rig = run(updates="UP")
    rig.own(50.0, 0.0, 270.0, 1.5)
    rig.mail("UP", update)
    rig.iterate()
    assert getattr(behavior(rig).turns[number], quantity) == value


def test_turns_lie_beyond_their_points_on_the_side_asked_for():
    course = LegCourse((0.0, 0.0), (100.0, 0.0), TurnShape(15.0, port=True), TurnShape(15.0, port=False))
    assert course.path1[0] == (0.0, 0.0) == pytest.approx(course.path1[-1], abs=1e-9)
    assert max(x for x, _ in course.path1) <= 1e-9
    assert min(x for x, _ in course.path2) >= 100.0 - 1e-9
    assert course.path1[1][1] > 0.0  # heading west, a turn to port swings out to the north
    assert course.path2[1][1] > 0.0


def test_without_points_or_radius_it_warns_until_they_are_given():
    rig = run(turn_rad=None, updates="UP")
    rig.own(50.0, 0.0, 0.0, 1.0)
    rig.iterate()
    assert rig.reason == "NothingToDo"
    assert rig.posted("BHV_WARNING")[0] == "run: Invalid or unset legrun"
    rig.mail("UP", "turn_rad=20")
    rig.iterate()
    assert rig.decision["course"] == 270.0


def test_a_change_of_length_needs_legs_first():
    rig = HelmRig([("BHV_LegRun", {"name": "r", "leg_len": 50})], faulty=True)
    assert "not known yet" in " ".join(str(p) for p in rig.core.problems)


def test_macros_tell_where_it_is():
    flags = [
        f"{n}=$[{n}]" for n in ("NX", "NY", "NI", "DIST_NP", "PCT_NP", "MODE", "CYCREM", "LEG_ID", "SPEED")
    ]
    rig = run(runxflag=flags, id="west")
    rig.own(30.0, 0.0, 270.0, 1.0)
    rig.iterate()
    found = {name.split("=")[0]: rig.posted(name.split("=")[0])[-1] for name in flags}
    assert found == {
        "NX": 0.0,
        "NY": 0.0,
        "NI": 0.0,
        "DIST_NP": 30.0,
        "PCT_NP": 70.0,
        "MODE": "leg1",
        "CYCREM": 0.0,
        "LEG_ID": "west",
        "SPEED": 2.0,
    }


# --- track line -------------------------------------------------------------------------------------------

coordinate = st.floats(-200, 200)


@given(
    ax=coordinate, ay=coordinate, x=coordinate, y=coordinate, lead=st.floats(0.1, 50), damper=st.floats(0, 30)
)
def test_the_point_steered_for_lies_on_the_line_and_not_beyond_its_end(ax, ay, x, y, lead, damper):
    tx, ty = track_point((ax, ay), (10.0, 20.0), x, y, lead, damper)
    cross = (10.0 - ax) * (ty - ay) - (20.0 - ay) * (tx - ax)
    assert abs(cross) < 1e-6 * max(1.0, abs(10 - ax) + abs(20 - ay)) ** 2
    assert min(ax, 10.0) - 1e-6 <= tx <= max(ax, 10.0) + 1e-6


def test_the_measured_lead_point_of_alpha_comes_out():
    assert track_point((0.0, -20.0), (60.0, -40.0), 0.0, -20.0, 8.0, 1.0) == pytest.approx(
        (22.77, -27.59), abs=0.01
    )
