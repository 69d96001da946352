"""BHV_Timer, BHV_TimeOut, BHV_TestFailure, BHV_PeriodicSpeed (behaviors.md C9, C21, C28)."""

from __future__ import annotations

import pytest

from ivp_helm.testing import HelmRig


def test_the_timer_counts_running_and_idle_seconds_apart():
    rig = HelmRig([("BHV_Timer", {"name": "t", "condition": "GO=1", "status_suffix": "x"})])
    rig.own()
    rig.iterate(9)
    rig.mail("GO", 1)
    rig.iterate(5)
    rig.mail("GO", 0)
    rig.iterate(5)
    assert rig.posted("TIMER_IDLE_x")[-1] == 3.0  # the first second of each stay has no second before it
    assert rig.posted("TIMER_RUNNING_x")[-1] == 1.0


def test_the_timer_completes_after_its_duration():
    rig = HelmRig([("BHV_Timer", {"name": "t", "duration": 2, "endflag": "DONE=1"})])
    rig.own()
    rig.iterate(8)
    assert rig.posted("DONE") == []
    rig.iterate(2)
    assert rig.posted("DONE") == [1.0]


def test_the_timer_needs_no_course_and_no_position():
    rig = HelmRig([("BHV_Timer", {"name": "t"})], domain=("depth:0:10:11",))
    rig.own()
    rig.iterate()
    assert rig.reason == "NothingToDo"


def test_a_time_out_stops_the_vessel():
    rig = HelmRig([("BHV_TimeOut", {"name": "t", "max_time": 1})])
    rig.own()
    rig.iterate(5)
    assert rig.reason == "NothingToDo"
    rig.iterate()
    assert rig.reason == "BehaviorError"
    assert rig.posted("BHV_ERROR") == ["t: TimeOut failure: max:1 elapsed:1.2"]


def test_a_deliberate_crash_is_survived_and_told():
    rig = HelmRig([("BHV_TestFailure", {"name": "f", "duration": 0}), ("BHV_Timer", {"name": "t"})])
    rig.own()
    rig.iterate()
    assert rig.reason == "BehaviorError"
    assert "asked to crash" in str(rig.posted("BHV_ERROR")[0])
    rig.iterate()
    assert rig.posted("TIMER_RUNNING")


def test_a_deliberate_hang_keeps_the_helm_waiting(monkeypatch):
    waited = []
    monkeypatch.setattr("time.sleep", waited.append)
    rig = HelmRig([("BHV_TestFailure", {"name": "f", "failure_type": "hang,2.5", "duration": 0})])
    rig.own()
    rig.iterate()
    assert waited == [2.5]


@pytest.mark.parametrize("text", ["explode", "crash,3", "hang,-1", "burn,soon"])
def test_unknown_failures_are_refused(text):
    rig = HelmRig([("BHV_TestFailure", {"name": "f", "failure_type": text})], faulty=True)
    assert rig.core.authority.malconfig


# --- now and then -----------------------------------------------------------------------------------------


def periodic(**parameters):
    given = {"name": "p", "period_lazy": 2, "period_busy": 1, "period_speed": 1.5, **parameters}
    rig = HelmRig([("BHV_PeriodicSpeed", given)], domain=("speed:0:4:17",))
    rig.own()
    return rig


def opinions(rig, count):
    return "".join("x" if rig.iterate().rounds[0][1].function is not None else "." for _ in range(count))


def test_lazy_and_busy_times_take_turns():
    assert opinions(periodic(), 26) == "........xxxx........xxxx.."


def test_it_may_begin_busy():
    assert opinions(periodic(initially_busy="true"), 14) == "xxxx........xx"


@pytest.mark.parametrize(("reset", "expected"), [("true", "........x"), ("false", ".xxxx....")])
def test_it_begins_anew_on_running_again_unless_told_otherwise(reset, expected):
    rig = periodic(reset_upon_running=reset, condition="GO=1")
    rig.mail("GO", 1)
    assert opinions(rig, 6) == "......"
    rig.mail("GO", 0)
    rig.iterate()
    rig.mail("GO", 1)
    assert opinions(rig, 9) == expected


def test_it_tells_when_it_will_be_busy_and_how_often_it_was():
    rig = periodic()
    rig.iterate(30)
    assert rig.posted("PERIODIC_SPEED") == [1.0, 0.0, 1.0, 0.0]
    assert rig.posted("PS_BUSY_COUNT") == [0.0, 1.0, 2.0]
    assert rig.posted("PS_PENDING_ACTIVE")[:6] == [2.0, 1.0, 0.75, 0.5, 0.25, 0.0]


def test_periods_are_required():
    rig = HelmRig([("BHV_PeriodicSpeed", {"name": "p"})], faulty=True)
    assert "period_lazy must be above 0" in " ".join(str(p) for p in rig.core.problems)
