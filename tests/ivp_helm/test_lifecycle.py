"""One behaviour through its states: hooks, flags, duration, starvation, updates (helm.md 4, 5, 7.1)."""

from __future__ import annotations

import pytest

from ivp_helm.behavior import Behavior
from ivp_helm.duration import DurationClock
from ivp_helm.ivp import IvPFunction, Peak, zaic_peak
from ivp_helm.testing import HelmRig
from pymoos_lite.config.parameters import Declaration, Parameter, ParameterError

HOOKS = (
    "on_parameters",
    "on_every_state",
    "on_idle",
    "on_run_to_idle",
    "on_idle_to_run",
    "on_inactive",
    "on_disabled",
    "on_complete",
    "on_spawn",
    "on_helm_start",
)


class Diary(Behavior):
    """Writes down which hooks are called."""

    BHV_NAME = "BHV_Diary"
    VARIABLES = ("speed",)
    CAN_DISABLE = True
    PARAMETERS = Declaration(
        (
            Parameter("speed", "number", 2.0, "m/s", "Speed wanted.", low=0.0),
            Parameter("mute", "boolean", False, "", "Return no function."),
            Parameter("finish", "boolean", False, "", "Complete in the next run."),
            Parameter("same", "boolean", False, "", "Return the former function."),
        )
    )

    def setup(self) -> None:
        self.diary: list[str] = []
        self.last: IvPFunction | None = None

    def on_run(self) -> IvPFunction | None:
        self.diary.append("on_run")
        if self.config.finish:
            self.complete("enough")
            return None
        if self.config.mute:
            return None
        if self.config.same and self.last is not None:
            return self.last
        self.last = zaic_peak(self.domain, "speed", Peak(self.config.speed, 0, 1))
        return self.last

    def settings(self) -> str:
        return f"speed={self.config.speed:g}"

    def macro(self, name: str) -> float | str | None:
        return self.config.speed if name == "SPEED" else None


def _writer(name: str):
    def hook(self: Diary) -> None:
        self.diary.append(name)

    return hook


for _name in HOOKS:
    setattr(Diary, _name, _writer(_name))


FLAGS = {
    "runflag": "RUN=1",
    "runxflag": "RUNX=1",
    "activeflag": "ACT=1",
    "inactiveflag": "INACT=1",
    "idleflag": "IDLE=1",
    "endflag": "END=1",
    "spawnxflag": "SPAWNX=1",
    "configflag": "CONFIG=1",
}


def rig(**parameters) -> HelmRig:
    helm = HelmRig(
        [(Diary, {"name": "d", "condition": "GO = true", "updates": "UP", **parameters})],
        initial={"GO": "true"},
        domain=("speed:0:5:21",),
    )
    helm.own()
    return helm


def diary(helm: HelmRig) -> list[str]:
    written = helm.life("d").behavior.diary
    entries = list(written)
    written.clear()
    return entries


def flags_of(helm: HelmRig, iteration: int) -> list[str]:
    return [
        p.variable
        for p in helm.postings
        if p.iteration == iteration and not p.variable.startswith(("BHV_", "VIEW_"))
    ]


def test_hooks_come_in_the_specified_order_through_run_and_idle():
    helm = rig()
    diary(helm)
    helm.iterate()
    assert diary(helm) == ["on_every_state", "on_idle_to_run", "on_run"]
    helm.iterate()
    assert diary(helm) == ["on_every_state", "on_run"]
    helm.mail("GO", "no")
    helm.iterate()
    assert diary(helm) == ["on_every_state", "on_run_to_idle", "on_idle"]
    helm.iterate()
    assert diary(helm) == ["on_every_state", "on_idle"]
    helm.mail("GO", "true")
    helm.iterate()
    assert diary(helm) == ["on_every_state", "on_idle_to_run", "on_run"]


def test_the_start_calls_helm_start_then_parameters():
    assert diary(rig()) == ["on_helm_start", "on_parameters"]


def test_starting_to_run_posts_run_and_active_flags_once_and_runx_always():
    helm = rig(**FLAGS)
    helm.iterate(2)
    assert flags_of(helm, 1) == ["CONFIG", "RUN", "RUNX", "ACT", "SPAWNX"]
    assert flags_of(helm, 2) == ["RUNX"]


def test_starting_idle_posts_idle_and_inactive_flags_even_in_the_first_iteration():
    helm = rig(**FLAGS)
    helm.mail("GO", "no")
    helm.iterate(2)
    assert flags_of(helm, 1) == ["CONFIG", "IDLE", "INACT", "SPAWNX"]
    assert flags_of(helm, 2) == []


def test_going_idle_posts_idle_and_inactive_flags():
    helm = rig(**FLAGS)
    helm.iterate()
    helm.mail("GO", "no")
    helm.iterate()
    assert flags_of(helm, 2) == ["IDLE", "INACT"]


def test_losing_its_function_posts_inactive_flags_and_getting_it_back_active_ones():
    helm = rig(**FLAGS)
    helm.iterate()
    helm.mail("UP", "mute=true")
    helm.iterate(2)
    assert flags_of(helm, 2) == ["RUNX", "INACT"]
    assert flags_of(helm, 3) == ["RUNX"]
    helm.mail("UP", "mute=false")
    helm.iterate()
    assert flags_of(helm, 4) == ["RUNX", "ACT"]
    assert "on_inactive" in diary(helm)


def test_run_flags_come_after_the_run_hook_so_that_macros_are_fresh():
    class Fresh(Diary):
        BHV_NAME = "BHV_Fresh"

        def on_run(self) -> IvPFunction | None:
            self.measured = 7.0
            return super().on_run()

        def macro(self, name: str) -> float | str | None:
            return getattr(self, "measured", 0.0) if name == "M" else None

    helm = HelmRig([(Fresh, {"name": "f", "runflag": "RUN=$[M]"})], domain=("speed:0:5:21",))
    helm.own()
    helm.iterate()
    assert helm.posted("RUN") == [7.0]


def test_completion_posts_end_flags_calls_the_hook_once_and_removes_the_behaviour():
    helm = rig(endflag="END=$[SPEED]", finish="true")
    behavior = helm.life("d").behavior
    helm.iterate()
    assert helm.outcome("d").state == "completed"
    helm.iterate()
    assert behavior.diary.count("on_complete") == 1
    assert helm.posted("END") == [2.0]
    assert "event=death,post_mortem=enough" in str(helm.posted("IVPHELM_LIFE_EVENT")[-1])
    with pytest.raises(KeyError):
        helm.life("d")


def test_a_perpetual_behaviour_posts_end_flags_and_lives_on():
    helm = rig(endflag="END=$[CTR]", finish="true", perpetual="true")
    helm.iterate(2)
    assert helm.posted("END") == [1.0, 2.0]
    assert helm.life("d").state == "running"


def test_the_status_names_the_failed_condition_once_and_is_posted_on_change():
    helm = rig()
    helm.mail("GO", "no")
    helm.iterate(2)
    helm.mail("GO", "true")
    helm.iterate()
    assert helm.posted("BHV_STATUS") == [
        "name=d,pc=GO = true,state=idle,updates=0/0",
        "name=d,pwt=100.00000,pcs=4,state=active,updates=0/0",
    ]


def test_a_reused_function_keeps_the_behaviour_active_and_counts_as_cached():
    helm = rig(**FLAGS, same="true")
    helm.iterate(3)
    assert helm.outcome("d").reused
    assert helm.outcome("d").state == "active"
    assert helm.posted("ACT") == [1.0]
    assert helm.posted("IVPHELM_TOTAL_PCS_CACHED") == [0.0, 4.0, 4.0]
    assert helm.posted("IVPHELM_TOTAL_PCS_FORMED") == [4.0, 0.0, 0.0]


# --- duration ---------------------------------------------------------------------------------------------


def test_a_duration_counts_from_the_first_run_and_ends_the_behaviour():
    helm = rig(duration=1, duration_status="LEFT", endflag="OVER=1")
    helm.mail("GO", "no")
    helm.iterate(4)
    helm.mail("GO", "true")
    helm.iterate(6)
    assert helm.posted("LEFT") == [1.0, 0.75, 0.5, 0.25, 0.0]
    assert helm.posted("OVER") == [1.0]
    assert "pc=completed-byduration,state=completed" in str(helm.posted("BHV_STATUS")[-1])


def test_a_duration_of_nothing_completes_in_the_first_runnable_iteration():
    helm = rig(duration=0, endflag="OVER=1")
    helm.iterate()
    assert helm.posted("OVER") == [1.0]
    assert "on_run" not in [h for life, _ in helm.core.trace.rounds for h in life.behavior.diary]


def test_remaining_seconds_are_whole_above_ten():
    helm = rig(duration=12, duration_status="LEFT")
    helm.iterate(4)
    assert helm.posted("LEFT") == [12.0, 11.0]  # 12, 11.75 and 11.5 (halves go up), then 11.25
    helm.iterate(6)
    assert helm.posted("LEFT")[-2:] == [10.0, 9.75]


@pytest.mark.parametrize(("decay", "left"), [("true", 0), ("false", 1)])
def test_idle_time_counts_unless_it_is_told_not_to(decay, left):
    helm = rig(duration=2, duration_idle_decay=decay, endflag="OVER=1")
    helm.iterate(2)
    helm.mail("GO", "no")
    helm.iterate(10)
    assert helm.posted("OVER") == [], "the end is noticed only when the conditions hold again"
    helm.mail("GO", "true")
    helm.iterate()
    assert len(helm.posted("OVER")) == 1 - left


def test_a_perpetual_behaviour_starts_its_clock_again_at_once():
    helm = rig(duration=0.5, perpetual="true", endflag="OVER=$[CTR]")
    helm.iterate(7)
    assert helm.posted("OVER") == [1.0, 2.0, 3.0]
    assert helm.life("d").state == "active"


def test_a_fresh_reset_post_restarts_the_clock():
    helm = rig(duration=1, duration_reset="AGAIN=true", duration_status="LEFT")
    helm.iterate(3)
    helm.mail("AGAIN", "false")
    helm.iterate()
    assert helm.posted("LEFT")[-1] == 0.25
    helm.mail("AGAIN", "true")
    helm.iterate()
    assert helm.posted("LEFT")[-1] == 1.0
    helm.iterate(2)
    assert helm.posted("LEFT")[-1] == 0.5, "the same post resets only once"


def test_the_duration_clock_alone():
    clock = DurationClock(2.0, idle_decay=False)
    assert not clock.over(100.0)
    clock.run(100.0)
    clock.idle(5.0)
    assert clock.remaining(106.0) == 1.0
    assert clock.over(107.0)
    assert not DurationClock(-1.0).over(1e9)


# --- starvation, domain, disabling ------------------------------------------------------------------------


def test_a_starved_behaviour_is_idle_and_says_of_what():
    helm = rig(nostarve="A,B,1.5")
    helm.mail("A", 1.0)
    helm.iterate()
    assert helm.outcome("d").blocked == "VarStarve: B(stime:1.5) (itime:-1)"
    helm.mail("B", 1.0)
    helm.iterate()
    assert helm.outcome("d").state == "active"
    helm.iterate(6)
    assert helm.outcome("d").blocked == "VarStarve: A(stime:1.5) (itime:1.75)"
    assert helm.reason == "NothingToDo", "starving is no error"


def test_a_domain_without_its_variables_is_an_error_and_idles_it():
    helm = HelmRig([(Diary, {"name": "d"})], domain=("course:0:359:360",))
    helm.own()
    helm.iterate()
    assert helm.reason == "BehaviorError"
    assert helm.outcome("d").blocked == "null-domain"
    assert "the helm's Domain has no speed" in helm.posted("BHV_ERROR")[0]


def test_a_disabled_behaviour_is_inactive_until_it_is_enabled():
    helm = rig(**FLAGS)
    helm.iterate()
    helm.mail("BHV_ABLE_FILTER", "action=disable, bhv_type=BHV_Diary")
    helm.iterate()
    assert helm.outcome("d").state == "disabled"
    assert flags_of(helm, 2) == ["INACT"]
    assert helm.posted("IVPHELM_BHV_DISABLED") == ["d"]
    helm.mail("BHV_ABLE_FILTER", "action=enable, bhv_type=bhv_diary")
    helm.iterate()
    assert helm.outcome("d").state == "active"
    assert flags_of(helm, 3) == ["RUN", "RUNX", "ACT"]


def test_an_expunged_behaviour_completes():
    helm = rig(endflag="END=1")
    helm.iterate()
    helm.mail("BHV_ABLE_FILTER", "action=expunge, bhv_type=BHV_Diary")
    helm.iterate(2)
    assert helm.posted("END") == [1.0]
    assert helm.posted("IVPHELM_BHV_CNT") == [1.0, 0.0]


@pytest.mark.parametrize(
    "text", ["action=disable", "action=foo,contact=x", "contact=x", "action=disable,who=x"]
)
def test_a_faulty_able_filter_is_a_warning(text):
    helm = rig()
    helm.mail("BHV_ABLE_FILTER", text)
    helm.iterate()
    assert any(n.kind == "warning" and "BHV_ABLE_FILTER" in n.text for n in helm.core.take_notes())
    assert helm.outcome("d").state == "active"


# --- flags and macros -------------------------------------------------------------------------------------


def test_a_conditional_flag_is_posted_only_if_its_condition_holds_then():
    helm = rig(endflag=["A=1 [if] N > 3", "B=1 [if] N < 3"], finish="true", perpetual="true")
    helm.mail("N", 5.0)
    helm.iterate()
    assert (helm.posted("A"), helm.posted("B")) == ([1.0], [])


def test_a_flag_for_others_becomes_a_node_message():
    helm = rig(runflag=["#all X=5", "#all+ Y=a,b", "#group Z=1"])
    helm.mail("NODE_REPORT_LOCAL", "NAME=alpha,TYPE=kayak,X=0,Y=0,SPD=0,HDG=0,TIME=1,GROUP=red")
    helm.iterate()
    assert helm.posted("NODE_MESSAGE_LOCAL") == [
        "src_node=alpha,dest_node=all,src_app=pHelmIvP,src_bhv=d,var_name=X,double_val=5",
        'src_node=alpha,dest_node=all,src_app=pHelmIvP,src_bhv=d,var_name=Y,string_val="a,b",string_val_quoted=true',
        "src_node=alpha,dest_node=all,dest_group=red,src_app=pHelmIvP,src_bhv=d,var_name=Z,double_val=1",
    ]
    assert (helm.posted("X"), helm.posted("Y")) == ([], ["a,b"])


def test_base_macros_have_their_values():
    names = "OWNSHIP BHVNAME BHVTYPE PWT UTC OSX OSY OSH OSV DUR_RUN_TIME DUR_IDLE_TIME NOW"
    helm = rig(runflag=[f"M_{name}=$[{name}]" for name in names.split()], pwt=30)
    helm.own(x=1.5, y=-2, heading=370, speed=1)
    helm.iterate()
    found = {name: helm.posted(f"M_{name}")[0] for name in names.split()}
    assert found == {
        "OWNSHIP": "alpha",
        "BHVNAME": "d",
        "BHVTYPE": "BHV_Diary",
        "PWT": 30.0,
        "UTC": helm.now,
        "OSX": 1.5,
        "OSY": -2.0,
        "OSH": 10.0,
        "OSV": 1.0,
        "DUR_RUN_TIME": 0.0,
        "DUR_IDLE_TIME": 0.0,
        "NOW": 0.0,
    }


def test_counters_count_the_postings_that_hold_them():
    helm = rig(runxflag=["A=$[CTR]", "B=$[CTR1]:$[CTR1]", "C=$(CTR)"])
    helm.iterate(3)
    assert helm.posted("A") == [1.0, 2.0, 3.0]
    assert helm.posted("B") == ["1:1", "2:2", "3:3"]
    assert helm.posted("C") == [1.0, 2.0, 3.0], "the round form shows the counter and does not move it"


def test_now_counts_from_its_first_expansion():
    helm = rig(runxflag="T=$[NOW]")
    helm.iterate(3)
    assert helm.posted("T") == [0.0, 0.25, 0.5]


def test_hashes_have_the_length_asked_for_and_no_letter_o():
    helm = rig(runxflag=["A=$[HASH]", "B=$[HASH9]"])
    helm.iterate(20)
    for variable, length in (("A", 6), ("B", 9)):
        texts = helm.posted(variable)
        assert all(isinstance(t, str) and len(t) == length and "o" not in t.lower() for t in texts)
        assert len(set(texts)) > 15


def test_posts_can_be_redirected_and_silenced():
    helm = rig(runflag=["A=1", "B=2"], post_mapping=["A,NEW", "B,silent"])
    helm.iterate()
    assert (helm.posted("A"), helm.posted("B"), helm.posted("NEW")) == ([], [], [1.0])


# --- updates ----------------------------------------------------------------------------------------------


def test_an_update_changes_parameters_counts_and_tells():
    helm = rig(configflag="CONF=$[SPEED]")
    helm.iterate()
    diary(helm)
    helm.mail("UP", "speed=3 # PWT = 50")
    helm.iterate()
    assert diary(helm)[0] == "on_parameters"
    assert helm.outcome("d").function.weight == 50.0
    assert helm.decision == {"speed": 3.0}
    assert helm.life("d").counts == "1/1"
    assert helm.posted("CONF") == [2.0, 3.0]
    assert helm.posted("BHV_SETTINGS") == ["type=BHV_Diary,name=d,speed=2", "type=BHV_Diary,name=d,speed=3"]
    assert helm.posted("IVPHELM_UPDATE_RESULT") == [
        "bhv=d,var=UP,time=0.50,result=success,val=speed=3 # PWT = 50"
    ]


def test_an_update_equal_to_the_last_good_one_is_a_duplicate():
    helm = rig()
    for _ in range(2):
        helm.mail("UP", "speed=3")
        helm.iterate()
    assert helm.life("d").counts == "1/1"
    assert "result=duplicate" in str(helm.posted("IVPHELM_UPDATE_RESULT")[-1])


def test_toggle_is_never_a_duplicate():
    helm = rig()
    states = []
    for _ in range(3):
        helm.mail("UP", "mute=toggle")
        helm.iterate()
        states.append(helm.outcome("d").state)
    assert states == ["running", "active", "running"]


def test_good_pairs_of_a_bad_update_are_applied_and_the_bad_ones_named():
    helm = rig()
    helm.mail("UP", "speed=3 # nope=1 # pwt=-5")
    helm.iterate()
    assert helm.decision == {"speed": 3.0}
    assert helm.life("d").counts == "0/1"
    complaint = "Faulty update for behavior: d. Bad parameter(s): nope,pwt"
    assert helm.posted("BHV_CONFIG_WARNING") == [complaint]
    assert helm.posted("BHV_WARNING") == [f"d: {complaint}"]
    assert any("there is no parameter 'nope'" in str(text) for text in helm.posted("BHV_EVENT"))
    assert "result=param_error" in str(helm.posted("IVPHELM_UPDATE_RESULT")[0])


def test_an_update_for_another_name_is_not_applied():
    helm = rig()
    helm.mail("UP", "name=e # speed=3")
    helm.iterate()
    assert helm.decision == {"speed": 2.0}
    assert "result=name_mismatch" in str(helm.posted("IVPHELM_UPDATE_RESULT")[0])
    helm.mail("UP", "name=d # speed=3")
    helm.iterate()
    assert helm.decision == {"speed": 3.0}


def test_hashes_inside_quotes_and_braces_do_not_split_an_update():
    helm = rig()
    helm.mail("UP", 'speed=3 # endflag = A="x # y"')
    helm.iterate()
    flag = helm.life("d").behavior.config.endflag[0]
    assert (flag.variable, flag.value) == ("A", "x # y")


def test_all_updates_of_a_round_are_applied_in_order():
    helm = rig()
    helm.mail("UP", "speed=3")
    helm.mail("UP", "speed=4")
    helm.iterate()
    assert helm.decision == {"speed": 4.0}
    assert helm.life("d").counts == "2/2"


def test_clearall_empties_a_set_of_flags():
    helm = rig(endflag=["A=1", "B=1"], finish="true", perpetual="true")
    helm.mail("UP", "endflag=clearall # endflag=C=1")
    helm.iterate()
    assert (helm.posted("A"), helm.posted("C")) == ([], [1.0])


def test_the_comms_policy_can_be_tightened_but_not_relaxed_by_mail():
    helm = rig(comms_policy="lean")
    behavior = helm.life("d").behavior
    helm.iterate()
    assert not behavior.visuals
    helm.mail("COMMS_POLICY", "open")
    helm.iterate()
    assert not behavior.visuals
    helm = rig()
    helm.mail("COMMS_POLICY", "dire")
    helm.iterate()
    assert not helm.life("d").behavior.visuals


# --- parameters -------------------------------------------------------------------------------------------


def test_base_parameters_are_known_by_all_their_names_and_with_a_leading_underscore():
    behavior = rig().life("d").behavior
    for name in ("pwt", "PRIORITY", "priwt", "_pwt"):
        behavior.set_parameter(name, "7")
        assert behavior.pwt == 7.0
    with pytest.raises(ParameterError, match="did you mean 'priority'"):
        behavior.set_parameter("prioriti", "7")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("pwt", "-1"),
        ("pwt", "heavy"),
        ("duration", "-2"),
        ("duration", "long"),
        ("condition", "A and B"),
        ("endflag", "X"),
        ("nostarve", "5"),
        ("nostarve", "A,0"),
        ("post_mapping", "A"),
        ("post_mapping", "A B,C"),
        ("comms_policy", "shut"),
        ("perpetual", "maybe"),
        ("name", "two words"),
        ("duration_status", "two words"),
        ("duration_reset", "A="),
    ],
)
def test_bad_values_of_base_parameters_are_refused_and_change_nothing(name, text):
    behavior = rig().life("d").behavior
    before = dict(vars(behavior.config))
    with pytest.raises(ParameterError):
        behavior.set_parameter(name, text)
    assert vars(behavior.config) == before


def test_conditions_add_up_and_a_comma_stands_for_an_equals_sign():
    behavior = rig().life("d").behavior
    behavior.set_parameter("condition", "DEPLOY,true")
    assert [c.text for c in behavior.conditions] == ["GO = true", "DEPLOY=true"]


def test_build_info_keeps_what_the_user_said_last_at_the_end():
    behavior = rig().life("d").behavior
    behavior.set_parameter("build_info", "uniform_piece=discrete@course:3,speed:3")
    behavior.set_parameter("build_info", "uniform_grid=discrete@course:9,speed:6")
    assert behavior.config.build_info == (
        "uniform_piece=discrete@course:3,speed:3 # uniform_grid=discrete@course:9,speed:6"
    )
    behavior.set_parameter("build_info", "clear")
    behavior.set_parameter("build_info", "uniform_amount=500")
    assert behavior.config.build_info == "clear # uniform_amount=500"


def test_integers_are_posted_rounded_to_the_nearest_and_never_for_infinity():
    behavior = rig().life("d").behavior
    behavior.take_posts()
    for value in (1.5, 1.4, -1.2, -1.5, float("inf"), float("nan")):
        behavior.post_int("N", value)
    assert [p.value for p in behavior.take_posts()] == [2.0, 1.0, -1.0, -2.0]


def test_a_warning_is_retracted_only_if_it_was_posted():
    behavior = rig().life("d").behavior
    behavior.take_posts()
    behavior.retract_warning("lost")
    assert behavior.take_posts() == []
    behavior.warn("lost")
    behavior.retract_warning("lost")
    assert [(p.value, p.retracts) for p in behavior.take_posts()] == [("d: lost", False), ("d: lost", True)]


def test_posts_are_dropped_when_they_repeat_and_typed_values_differ():
    class Poster(Diary):
        BHV_NAME = "BHV_Poster"

        def on_run(self) -> IvPFunction | None:
            for value in ("", 0.0, 0.0, "0", ""):
                self.post("V", value)
            self.post("W", 1.0, key="a")
            self.post("W", 1.0, key="b")
            self.post("R", 1.0, repeat=True)
            return None

    helm = HelmRig([(Poster, {"name": "p"})], domain=("speed:0:5:21",))
    helm.own()
    helm.iterate(2)
    assert helm.posted("V") == ["", 0.0, "0", "", 0.0, "0", ""]
    assert helm.posted("W") == [1.0, 1.0]
    assert helm.posted("R") == [1.0, 1.0]


def test_what_a_behaviour_posts_is_seen_by_conditions_in_the_next_iteration():
    helm = HelmRig(
        [
            (Diary, {"name": "first", "runflag": "NEXT=true"}),
            (Diary, {"name": "second", "condition": "NEXT = true"}),
        ],
        domain=("speed:0:5:21",),
    )
    helm.own()
    helm.iterate()
    assert helm.outcome("second").state == "idle"
    helm.iterate()
    assert helm.outcome("second").state == "active"
