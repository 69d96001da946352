"""The helm core: states, decisions, all-stops and what it publishes (helm.md 8 to 12)."""

from __future__ import annotations

import pytest

from ivp_helm.authority import Authority
from ivp_helm.behavior import Behavior, BehaviorError
from ivp_helm.ivp import Domain, IvPFunction, Peak, zaic_peak
from ivp_helm.testing import HelmRig
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message


class Steer(Behavior):
    """Wants a course and a speed, or whatever a test tells it to."""

    BHV_NAME = "BHV_Steer"
    VARIABLES = ()
    PARAMETERS = Declaration(
        (
            Parameter("course", "number", 90.0, "deg", "Course wanted; negative: none."),
            Parameter("speed", "number", 2.0, "m/s", "Speed wanted; negative: none."),
            Parameter("what", "text", "", "", "What to do instead."),
        )
    )

    def on_run(self) -> IvPFunction | None:
        what = self.config.what
        if what == "error":
            self.error("cannot go on")
        if what == "fault":
            raise BehaviorError("no way")
        if what == "raise":
            raise ZeroDivisionError("oops")
        if what == "nothing":
            return None
        if what == "foreign":
            return zaic_peak(Domain.parse("tilt,0,9,10"), "tilt", Peak(3))
        if what == "junk":
            return "a function"  # type: ignore[return-value]
        if self.config.course < 0:
            return zaic_peak(self.domain, "speed", Peak(self.config.speed, 0, 1))
        course = zaic_peak(self.domain, "course", Peak(self.config.course, 0, 180), wrap=True)
        if self.config.speed < 0:
            return course
        from ivp_helm.ivp import couple

        return couple(course, zaic_peak(self.domain, "speed", Peak(self.config.speed, 0, 2)))


class Limit(Steer):
    """The same, but no goal."""

    BHV_NAME = "BHV_Limit"
    CONSTRAINT = True


def rig(*parameters: dict, **options) -> HelmRig:
    behaviors = [(Steer, {"name": f"steer_{chr(97 + k)}", **p}) for k, p in enumerate(parameters)]
    options.setdefault("initial", {"GO": "true"})
    made = HelmRig(behaviors, **options)
    made.own(x=1, y=2, heading=30, speed=1)
    return made


# --- decisions and all-stops ------------------------------------------------------------------------------


def test_a_full_decision_is_posted_every_iteration_as_desired_heading_and_speed():
    helm = rig({})
    helm.iterate(3)
    assert helm.decision == {"course": 90.0, "speed": 2.0}
    assert helm.posted("DESIRED_HEADING") == [90.0] * 3
    assert helm.posted("DESIRED_SPEED") == [2.0] * 3
    assert helm.posted("IVPHELM_ALLSTOP") == ["clear"]


def test_the_first_empty_iteration_after_clear_is_one_of_grace():
    helm = rig({"condition": "GO = true"})
    helm.iterate()
    helm.mail("GO", "false")
    helm.iterate()
    assert helm.posted("DESIRED_SPEED") == [2.0]
    assert helm.posted("IVPHELM_ALLSTOP") == ["clear", "NothingToDo"]
    helm.iterate(3)
    assert helm.posted("IVPHELM_ALLSTOP") == ["clear", "NothingToDo", "NothingToDo"]
    assert helm.posted("DESIRED_SPEED") == [2.0, 0.0]
    assert helm.posted("DESIRED_HEADING") == [90.0, 0.0]


def test_one_empty_iteration_between_two_decisions_does_not_stop_the_vehicle():
    helm = rig({"condition": "GO = true"})
    helm.iterate()
    helm.mail("GO", "false")
    helm.iterate()
    helm.mail("GO", "true")
    helm.iterate()
    assert helm.posted("DESIRED_SPEED") == [2.0, 2.0]
    assert helm.posted("IVPHELM_ALLSTOP") == ["clear", "NothingToDo", "clear"]


def test_a_missing_mandatory_variable_is_an_all_stop_with_an_error_every_iteration():
    helm = rig({"course": -1})
    helm.iterate(4)
    assert helm.posted("IVPHELM_ALLSTOP") == ["MissingDecVars:course", "MissingDecVars:course"]
    assert helm.posted("BHV_ERROR") == ["MissingDecVars:course"] * 4
    assert helm.posted("DESIRED_HEADING") == [0.0]
    assert helm.posted("DESIRED_SPEED") == [0.0]


def test_an_optional_variable_without_decision_is_simply_not_posted():
    helm = rig({}, domain=("course:0:359:360", "speed:0:5:21", "depth:0:100:101:optional"))
    helm.iterate(2)
    assert helm.reason == "clear"
    assert helm.posted("DESIRED_DEPTH") == []
    assert helm.posted("DESIRED_SPEED") == [2.0, 2.0]


def test_goals_can_be_mandatory():
    helm = HelmRig([(Limit, {"name": "limit"})], settings={"goals_mandatory": True})
    helm.own()
    helm.iterate(2)
    assert helm.posted("IVPHELM_ALLSTOP") == ["NoGoalBehavior", "NoGoalBehavior"]
    assert HelmRig([(Limit, {"name": "limit"})]).core.settings.goals_mandatory is False


def test_the_prefix_goes_in_front_of_decisions_and_of_zeros():
    helm = rig({"condition": "GO = true"}, settings={"helm_prefix": "ALT_"})
    helm.iterate()
    helm.mail("GO", "false")
    helm.iterate(2)
    assert helm.posted("ALT_DESIRED_SPEED") == [2.0, 0.0]
    assert helm.posted("DESIRED_SPEED") == []


def test_a_function_of_no_weight_is_no_function():
    helm = rig({"pwt": 0})
    helm.iterate()
    assert helm.outcome("steer_a").state == "running"
    assert helm.reason == "NothingToDo"


def test_the_weighted_sum_decides_between_behaviours():
    helm = rig({"course": 100, "pwt": 100}, {"course": 120, "pwt": 101})
    helm.iterate()
    assert helm.decision["course"] == 120.0
    helm = rig({"course": 100, "pwt": 101}, {"course": 120, "pwt": 100})
    helm.iterate()
    assert helm.decision["course"] == 100.0


# --- safety -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("error", "steer_a: cannot go on"),
        ("fault", "steer_a: no way"),
        ("raise", "on_run raised ZeroDivisionError: oops"),
        ("junk", "on_run returned str; expected an IvPFunction or None"),
    ],
)
def test_a_behaviour_in_trouble_stops_the_vehicle_at_once_and_says_so(what, words):
    helm = rig({"updates": "UP"})
    helm.iterate()
    helm.mail("UP", f"what={what}")
    helm.iterate()
    assert helm.reason == "BehaviorError"
    assert helm.posted("DESIRED_SPEED")[-1] == 0.0
    assert words in helm.posted("BHV_ERROR")[-1]
    assert words in str(helm.posted("IVPHELM_SUMMARY")[-1])
    assert "halted=true" in str(helm.posted("IVPHELM_SUMMARY")[-1])
    assert any(words in note.text for note in helm.core.take_notes())


def test_after_an_error_the_helm_recovers_as_soon_as_none_is_posted():
    helm = rig({"updates": "UP", "what": "raise"})
    helm.iterate(2)
    assert helm.reason == "BehaviorError"
    helm.mail("UP", "what=fine")
    helm.iterate()
    assert helm.reason == "clear"
    assert helm.posted("DESIRED_SPEED") == [0.0, 2.0]


def test_an_error_of_one_behaviour_does_not_keep_the_others_from_their_turn():
    helm = rig({"what": "raise"}, {"runflag": "B_RAN=true"})
    helm.iterate()
    assert helm.posted("B_RAN") == ["true"]
    assert helm.outcome("steer_b").state == "active"


def test_a_function_over_a_foreign_variable_is_a_behaviour_error():
    helm = rig({"what": "foreign"})
    helm.iterate()
    assert helm.reason == "BehaviorError"
    assert "halt_msg=DomainVar tilt not recognized" in str(helm.posted("IVPHELM_SUMMARY")[-1])


def test_missing_position_or_heading_is_an_error_of_whoever_needs_it():
    helm = HelmRig([("BHV_Waypoint", {"name": "w", "points": "0,0:9,9", "speed": 1})])
    for name in ("NAV_X", "NAV_Y", "NAV_SPEED"):
        helm.mail(name, 1.0)
    helm.core._nav_missing = False  # as after a good start that went wrong later
    helm.iterate()
    assert helm.reason == "BehaviorError"
    assert "No ownship heading info in info_buffer." in helm.posted("BHV_ERROR")[0]


def test_old_navigation_stops_the_vehicle_only_if_that_was_asked_for():
    for timeout, reason in ((0.0, "clear"), (2.0, "StaleNav")):
        helm = rig({}, settings={"nav_timeout": timeout})
        helm.iterate()
        helm._own = {}
        helm.iterate(12)
        assert helm.reason == reason
        assert (helm.posted("DESIRED_SPEED")[-1] == 0.0) is (reason == "StaleNav")


def test_override_parks_and_gives_control_in_both_spellings_and_any_case():
    helm = rig({})
    helm.iterate()
    helm.mail("MOOS_MANUAL_OVERIDE", "TRUE")
    helm.iterate()
    assert helm.posted("IVPHELM_STATE")[-1] == "PARK"
    assert helm.reason == "ManualOverride"
    assert helm.posted("DESIRED_SPEED")[-1] == 0.0
    helm.mail("MOOS_MANUAL_OVERRIDE", "False")
    helm.iterate()
    assert helm.posted("IVPHELM_STATE")[-1] == "DRIVE"
    assert helm.reason == "clear"


def test_other_override_values_and_numbers_are_ignored():
    helm = rig({})
    for value in ("maybe", 1.0, ""):
        helm.mail("MOOS_MANUAL_OVERRIDE", value)
        helm.iterate()
        assert helm.reason == "clear"


def test_allow_park_false_ignores_a_request_to_park():
    helm = rig({}, settings={"allow_park": False})
    helm.mail("MOOS_MANUAL_OVERRIDE", "true")
    helm.iterate()
    assert helm.reason == "clear"


def test_park_on_allstop_parks():
    helm = rig({"what": "raise"}, settings={"park_on_allstop": True})
    helm.iterate(2)
    assert helm.posted("IVPHELM_STATE")[-1] == "PARK"


def test_one_more_override_variable_can_be_named():
    helm = rig({}, settings={"other_override_var": "KILL"})
    helm.mail("KILL", "true")
    helm.iterate()
    assert helm.reason == "ManualOverride"


# --- start ------------------------------------------------------------------------------------------------


def test_a_helm_starts_parked_with_zeros():
    helm = rig({}, settings={"start_in_drive": False})
    helm.iterate()
    assert helm.posted("IVPHELM_STATE") == ["PARK"]
    assert helm.posted("IVPHELM_ALLSTOP") == ["ManualOverride"]
    assert helm.posted("DESIRED_SPEED") == [0.0]
    assert helm.posted("DESIRED_HEADING") == [0.0]


def test_until_navigation_is_complete_only_the_state_is_posted():
    helm = HelmRig([(Steer, {"name": "s"})])
    helm.mail("NAV_X", 1.0)
    helm.iterate(21)
    assert set(helm.posted("IVPHELM_STATE")) == {"DRIVE"}
    assert helm.posted("IVPHELM_ALLSTOP") == []
    assert ("warning", "Waiting for Helm Nav Solution") in helm.core.take_notes()
    helm.own()
    helm.iterate()
    assert ("retract", "Waiting for Helm Nav Solution") in helm.core.take_notes()
    assert helm.reason == "clear"


def test_depth_in_the_domain_makes_the_helm_wait_for_depth():
    helm = HelmRig(
        [(Steer, {"name": "s"})], domain=("course:0:359:360", "speed:0:4:21", "depth:0:9:10:optional")
    )
    for name in ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED"):
        helm.mail(name, 1.0)
    helm.iterate()
    assert helm.core.iteration == 0
    helm.mail("NAV_DEPTH", 1.0)
    helm.iterate()
    assert helm.core.iteration == 1


def test_nothing_is_decided_in_the_first_second():
    helm = rig({}, settings={"settle": 1.0})
    helm.iterate(3)
    assert helm.core.iteration == 0
    helm.iterate()
    assert helm.core.iteration == 1


def test_initial_values_are_posted_at_start_whatever_the_database_holds():
    helm = HelmRig(text="initialize A = 1, B = x\n")
    assert [(v, x) for _, v, x in helm.published if v in "AB"] == [("A", 1.0), ("B", "x")]
    assert helm.core.buffer.value("A") == 1.0


def test_a_deferred_initial_value_yields_to_one_that_arrived():
    text = "initialize_ A = 1\ninitialize_ B = 2\n"
    helm = HelmRig(text=text)
    helm.own()
    helm.mail("A", 7.0)
    helm.mail("IVPHELM_STATE", "DRIVE", source="pHelmIvP")
    helm.iterate()
    assert helm.posted("A") == []
    assert helm.posted("B") == [2.0]


def test_a_deferred_initial_value_waits_for_the_round_trip_through_the_database():
    helm = HelmRig(text="initialize_ B = 2\n")
    helm.own()
    helm.iterate(3)
    assert helm.posted("B") == []
    helm.mail("IVPHELM_STATE", "DRIVE", source="pHelmIvP")
    helm.iterate()
    assert helm.posted("B") == [2.0]


def test_own_initial_values_coming_back_do_not_undo_what_another_app_said():
    helm = HelmRig(text="initialize GO = false\n")
    helm.own()
    now = helm.now + 0.25
    helm._mail = [
        Message("GO", "true", now, "shore"),
        Message("GO", "false", now, "pHelmIvP", "HELM_VAR_INIT"),
    ]
    helm.iterate()
    assert helm.core.buffer.value("GO") == "true"


def test_initializing_the_override_makes_the_helm_drive():
    helm = HelmRig(
        [(Steer, {"name": "s"})],
        text="initialize MOOS_MANUAL_OVERRIDE = false\n",
        settings={"start_in_drive": False},
    )
    helm.own()
    helm._mail = [Message("MOOS_MANUAL_OVERRIDE", "false", helm.now, "pHelmIvP", "HELM_VAR_INIT")]
    helm.iterate()
    assert helm.posted("IVPHELM_STATE") == ["DRIVE"]


def test_helm_start_messages_wait_for_the_apps_they_are_for():
    class Caller(Steer):
        BHV_NAME = "BHV_Caller"

        def on_helm_start(self) -> None:
            self.post("ALERT_REQUEST", "id=1")

    helm = HelmRig([(Caller, {"name": "c"})], settings={"hold_on_apps": ("pContactMgrV20",)})
    helm.own()
    helm.iterate()
    assert helm.posted("ALERT_REQUEST") == []
    helm.mail("DB_CLIENTS", "pHelmIvP,pContactMgrV20,")
    helm.iterate()
    assert helm.posted("ALERT_REQUEST") == ["id=1"]
    assert helm.reason == "clear"


# --- mail -------------------------------------------------------------------------------------------------


def test_mail_with_a_strange_time_is_ignored_and_that_is_said():
    helm = rig({"condition": "GO = true"})
    helm.iterate(300)
    helm._mail = [Message("GO", "false", helm.now - 100.0, "shore")]
    helm.iterate()
    assert helm.core.buffer.value("GO") == "true"
    texts = [note.text for note in helm.core.take_notes()]
    assert any(t.startswith("Helm ignores MOOS msg due to skew: GO Source=shore Skew=100") for t in texts)
    assert "curr_time:" in str(helm.posted("IVPHELM_SKEW")[0])


def test_old_values_delivered_on_registering_are_believed():
    helm = rig({"condition": "GO = true"})
    helm._mail = [Message("GO", "false", helm.now - 10_000.0, "shore")]
    helm.iterate()
    assert helm.core.buffer.value("GO") == "false"


def test_any_skew_can_be_allowed():
    helm = rig({"condition": "GO = true"}, settings={"ok_skew": float("inf")})
    helm.iterate(300)
    helm._mail = [Message("GO", "false", 0.0, "shore")]
    helm.iterate()
    assert helm.core.buffer.value("GO") == "false"


def test_a_request_for_all_geometry_makes_filtered_posts_go_out_again():
    helm = HelmRig([("BHV_Waypoint", {"name": "w", "points": "100,100", "speed": 1})])
    helm.own()
    helm.iterate(3)
    before = len(helm.posted("VIEW_SEGLIST"))
    helm.mail("HELM_MAP_CLEAR", 1.0)
    helm.iterate()
    assert len(helm.posted("VIEW_SEGLIST")) == before + 1
    helm.mail("HELM_MAP_CLEAR", 1.0)
    helm.iterate()
    assert len(helm.posted("VIEW_SEGLIST")) == before + 1, "at most every two seconds"


def test_a_status_that_does_not_change_is_told_once_and_again_to_who_asks_for_everything():
    helm = rig({})
    helm.iterate()
    told = len(helm.posted("BHV_STATUS"))
    for _ in range(3):
        helm.iterate()
    assert len(helm.posted("BHV_STATUS")) == told > 0
    helm.mail("HELM_MAP_CLEAR", 1.0)
    helm.iterate()
    assert len(helm.posted("BHV_STATUS")) == told + 1
    helm.core.reintroduce()
    helm.iterate()
    assert len(helm.posted("BHV_STATUS")) == told + 2
    assert len(set(helm.posted("BHV_STATUS")[-3:])) == 1


def test_every_variable_is_registered_for_once_and_said_to_be():
    helm = rig(
        {
            "condition": "(A = 1) and (B_DELTA > 2)",
            "endflag": "X=1 [if] C = 1",
            "nostarve": "D,5",
            "updates": "UP",
        }
    )
    names = helm.posted("IVPHELM_REGISTER")
    assert len(names) == len(set(names))
    assert {"A", "B_DELTA", "B", "C", "D", "UP", "NAV_X", "DB_CLIENTS"} <= set(names)


# --- publications -----------------------------------------------------------------------------------------


def test_the_first_summary_is_complete_and_later_ones_hold_what_changed():
    helm = rig({"updates": "UP"}, text="set MODE = ON {\n GO = true\n} OFF\n")
    helm.iterate(2)
    first, second = map(str, helm.posted("IVPHELM_SUMMARY"))
    pieces = helm.outcome("steer_a").function.pieces
    assert first == (
        f"iter=1,utc_time=1700000000.25,ofnum=1,total_pcs_formed={pieces},total_pcs_cached=0,warnings=0,solve_time=0.00,"
        "create_time=0.00,max_create_time=0.00,max_solve_time=0.00,max_loop_time=0.00,loop_time=0.00,"
        "var=course:90,var=speed:2,halted=false,active_goal=true,modes=MODE@ON,running_bhvs=none,"
        f"active_bhvs=steer_a$1700000000.25$100.00000${pieces}$0.00000$0/0$1$$,disabled_bhvs=none,idle_bhvs=none,"
        'completed_bhvs=none,ivpdomain="course,0,359,360:speed,0,5,21",halt_msg=none'
    )
    assert second == "iter=2,utc_time=1700000000.50"


def test_a_rejournal_request_makes_the_next_summary_complete():
    helm = rig({})
    helm.iterate(2)
    helm.mail("IVPHELM_REJOURNAL", "true")
    helm.iterate()
    assert "ivpdomain=" in str(helm.posted("IVPHELM_SUMMARY")[-1])


def test_lists_of_behaviours_are_posted_when_they_change_with_their_counts():
    helm = rig({"condition": "GO = true"}, {})
    helm.iterate(2)
    helm.mail("GO", "no")
    helm.iterate(2)
    assert helm.posted("IVPHELM_BHV_ACTIVE") == ["steer_a,steer_b", "steer_b"]
    assert helm.posted("IVPHELM_BHV_IDLE") == ["steer_a"]
    assert helm.posted("IVPHELM_BHV_ACTIVE_CNT") == [0.0, 2.0, 1.0]
    assert helm.posted("IVPHELM_BHV_CNT") == [2.0]


def test_domain_modes_and_variables_are_introduced():
    helm = rig({"condition": "GO = true", "endflag": "DONE=1"}, text="set MODE = ON {\n GO = true\n} OFF\n")
    helm.iterate()
    assert helm.posted("IVPHELM_DOMAIN") == ["course,0,359,360:speed,0,5,21"]
    assert helm.posted("IVPHELM_MODESET") == ["MODE#---,ON#---,OFF"]
    assert helm.posted("IVPHELM_STATEVARS") == ["DONE,GO"]
    assert helm.posted("MODE") == ["ON"]


def test_mode_variables_are_posted_on_change_only_even_if_there_are_several():
    helm = rig({}, text="set MODE = ON {\n GO = true\n} OFF\nset M2 = X {\n GO = true\n}\n")
    helm.iterate(3)
    assert (helm.posted("MODE"), helm.posted("M2")) == (["ON"], ["X"])


def test_the_state_is_the_heartbeat_and_iterations_count_from_one():
    helm = rig({})
    helm.iterate(3)
    assert helm.posted("IVPHELM_STATE") == ["DRIVE"] * 3
    assert helm.posted("IVPHELM_ITER") == [1.0, 2.0, 3.0]


def test_one_birth_is_announced_per_behaviour_of_the_file():
    helm = rig({}, {})
    helm.iterate(2)
    assert helm.posted("IVPHELM_LIFE_EVENT") == [
        "iter=0,bname=steer_a,btype=BHV_Steer,event=spawn,seed=helm_startup",
        "iter=0,bname=steer_b,btype=BHV_Steer,event=spawn,seed=helm_startup",
    ]


def test_the_turn_rate_is_that_of_the_recent_headings():
    helm = rig({})
    for heading in (350.0, 355.0, 0.0, 5.0, 10.0):
        helm.own(heading=heading)
        helm.iterate()
    assert helm.posted("TURN_RATE")[-1] == pytest.approx(20.0)


# --- misconfiguration, stand-by, restart ------------------------------------------------------------------


def test_a_helm_with_a_faulty_file_posts_malconfig_and_nothing_else_and_no_override_helps():
    helm = HelmRig(text="nonsense\n", faulty=True)
    helm.own()
    helm.mail("MOOS_MANUAL_OVERRIDE", "false")
    helm.iterate(3)
    assert set(helm.posted("IVPHELM_STATE")) == {"MALCONFIG"}
    assert {name for _, name, _ in helm.published} <= {"IVPHELM_STATE", "IVPHELM_CPU", "IVPHELM_REGISTER"}


def test_a_helm_without_behaviours_runs_and_has_nothing_to_do():
    helm = HelmRig()
    helm.own()
    helm.iterate(2)
    assert helm.reason == "NothingToDo"


def test_a_helm_without_domain_is_malconfigured():
    helm = HelmRig([(Steer, {"name": "s"})], domain=(), faulty=True)
    assert helm.core.authority.state == "MALCONFIG"


def test_a_stand_by_helm_takes_over_when_the_primary_falls_silent():
    helm = rig({}, settings={"standby": 2.0})
    helm.iterate(20)
    assert set(helm.posted("IVPHELM_STATE")) == {"STANDBY"}
    helm.mail("IVPHELM_STATE", "DRIVE", source="primary")
    helm.iterate(8)
    assert helm.posted("DESIRED_SPEED") == []
    helm.iterate(2)
    assert helm.posted("IVPHELM_STATE")[-1] == "DRIVE+"
    assert helm.posted("DESIRED_SPEED")[-1] == 2.0


def test_a_primary_helm_gives_way_to_one_that_took_over():
    helm = rig({})
    helm.iterate()
    helm.mail("IVPHELM_STATE", "STANDBY", source="other")
    helm.iterate()
    assert helm.reason == "clear"
    helm.mail("IVPHELM_STATE", "DRIVE+", source="other")
    helm.iterate(3)
    assert helm.reason == "DisabledByStandbyHelm"
    assert helm.posted("IVPHELM_STATE")[-1] == "DISABLED"
    assert helm.posted("IVPHELM_STATE").count("DISABLED") == 1
    assert helm.posted("DESIRED_SPEED")[-1] == 0.0


def test_authority_without_a_heartbeat_never_takes_over():
    authority = Authority(in_drive=True, standby=1.0)
    assert not authority.watch(1e9)
    assert authority.state == "STANDBY"


@pytest.mark.parametrize(("kind", "initials"), [("type1", 1), ("type2", 2)])
def test_a_restart_makes_new_behaviours_and_says_so(kind, initials):
    helm = rig({"duration": 0.5, "endflag": "OVER=1"}, text="initialize A = 1\n")
    helm.iterate(4)
    assert helm.posted("OVER") == [1.0]
    assert helm.reason == "NothingToDo"
    helm.mail("RESTART_HELM", kind)
    helm.iterate()
    assert helm.reason == "clear"
    assert helm.posted("IVPHELM_RESTARTED") == ["true"]
    assert len(helm.posted("A")) == initials


def test_after_the_database_was_lost_everything_is_told_again():
    helm = rig({}, text="set MODE = ON {\n GO = true\n} OFF\n")
    helm.iterate(3)
    helm.core.reintroduce()
    before = len(helm.published)
    helm.iterate()
    told = {name for _, name, _ in helm.published[before:]}
    assert {
        "IVPHELM_DOMAIN",
        "IVPHELM_MODESET",
        "IVPHELM_ALLSTOP",
        "MODE",
        "IVPHELM_BHV_ACTIVE",
        "BHV_STATUS",
    } <= told
    assert "ivpdomain=" in str(helm.posted("IVPHELM_SUMMARY")[-1])


# --- filter levels, functions and reasons as posts --------------------------------------------------------


class Echo(Steer):
    """Sees what the others decided, and wants it five degrees to the right."""

    BHV_NAME = "BHV_Echo"
    FILTER_LEVEL = 1

    def on_run(self) -> IvPFunction | None:
        seen = self.buffer.number("DESIRED_HEADING_UNFILTERED")
        assert seen is not None
        return zaic_peak(self.domain, "course", Peak(seen + 5.0, 0, 10), wrap=True)


def test_a_behaviour_of_filter_level_one_sees_the_decision_of_the_others_first():
    helm = HelmRig([(Echo, {"name": "echo", "pwt": 500}), (Steer, {"name": "steer", "course": 40})])
    helm.own()
    helm.iterate()
    assert helm.core.buffer.value("DESIRED_HEADING_UNFILTERED") == 40.0
    assert helm.decision["course"] == 45.0


def test_functions_are_posted_in_packets_only_while_somebody_listens():
    helm = rig({})
    helm.iterate()
    assert helm.posted("BHV_IPF") == []
    helm.core.listens = lambda variable: variable == "BHV_IPF"
    helm.iterate()
    packet = str(helm.posted("BHV_IPF")[0])
    assert packet.startswith("P,steer_a^2,1,1,H,9,2:steer_a,2,")
    assert ",100,D,course;0;359;360:speed;0;5;21,G," in packet
    names = [name for _, name, _ in helm.published]
    assert names.index("BHV_IPF") > len(names) - 1 - names[::-1].index("IVPHELM_ITER"), (
        "after the iteration's number"
    )


def test_reasons_are_posted_when_they_change_while_somebody_listens():
    helm = rig({"condition": "GO = true"})
    helm.core.listens = lambda variable: variable == "BHV_WHY"
    helm.mail("GO", "no")
    helm.iterate(3)
    assert helm.posted("BHV_WHY") == ["name=steer_a,why=GO = true"]
