"""uTimerScript: the timetable core, then the app in a lockstep community."""

import random

import pytest
from app_harness import Harness
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.apps.timer_core import Script, ScriptPlan
from pymoos_lite.apps.timer_script import TimerScript
from pymoos_lite.apps.timer_values import EventLine, Span


def plan(*times, **settings) -> ScriptPlan:
    events = tuple(
        EventLine(f"E{i}", "x", Span(*t) if isinstance(t, tuple) else Span(t, t)) for i, t in enumerate(times)
    )
    return ScriptPlan(events, **settings)


def play(script: Script, until: float, step: float = 0.25, start: float = 0.0, **state):
    """Names of events by the time they were due."""
    found = []
    now = start
    while now <= until + 1e-9:
        due = script.update(now, **{k: v(now) for k, v in state.items()})
        for event in due:
            script.posted()
            found.append((now, event.event.var))
        script.settle(now)
        now += step
    return found


def test_events_fire_once_each_at_their_time_in_file_order():
    script = Script(plan(3, 1, 1), random.Random(1))
    assert play(script, 10) == [(1.0, "E1"), (1.0, "E2"), (3.0, "E0")]


def test_without_reset_time_a_script_plays_once():
    assert len(play(Script(plan(1), random.Random(1)), 100)) == 1


def test_reset_at_the_end_begins_again_up_to_reset_max():
    script = Script(plan(1, 2, reset_time=-1.0, reset_max=2), random.Random(1))
    assert [t for t, _ in play(script, 20)] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert script.resets == 2
    assert script.total == 6
    assert script.count == 2


def test_a_reset_time_cuts_off_later_events():
    script = Script(plan(1, 5, 9, reset_time=5.0, reset_max=1), random.Random(1))
    assert play(script, 20) == [(1.0, "E0"), (5.0, "E1"), (6.0, "E0"), (10.0, "E1")]


def test_delays_shift_the_first_and_the_later_passes():
    settings = {"delay_start": Span(2, 2), "delay_reset": Span(3, 3), "reset_time": -1.0, "reset_max": 1}
    assert [t for t, _ in play(Script(plan(1, **settings), random.Random(1)), 20)] == [3.0, 7.0]


def test_time_warp_speeds_up_the_script():
    assert [t for t, _ in play(Script(plan(4, time_warp=Span(2, 2)), random.Random(1)), 20)] == [2.0]


def test_while_paused_the_clock_stands_and_nothing_fires():
    script = Script(plan(0, 2, paused=True), random.Random(1))
    assert play(script, 5) == []
    script.paused = False
    assert [t for t, _ in play(script, 20, start=5.25)] == [5.25, 7.25]


def test_while_conditions_fail_or_an_app_is_awaited_the_clock_stands():
    script = Script(plan(1, 4), random.Random(1))
    assert play(script, 20, conditions=lambda t: not 2 <= t < 7) == [(1.0, "E0"), (9.0, "E1")]
    script = Script(plan(1), random.Random(1))
    assert play(script, 20, blocked=lambda t: t < 6) == [(7.0, "E0")]


def test_an_atomic_script_finishes_its_pass():
    script = Script(plan(1, 4, atomic=True), random.Random(1))
    assert play(script, 20, conditions=lambda t: 1 <= t < 3) == [(2.0, "E0"), (5.0, "E1")]


@pytest.mark.parametrize(("awake", "times"), [("n/a", [1.0, 9.0]), ("reset", [1.0, 8.0, 11.0])])
def test_upon_awake(awake, times):
    script = Script(plan(1, 4, upon_awake=awake, reset_max=5), random.Random(1))
    assert [t for t, _ in play(script, 20, conditions=lambda t: not 2 <= t < 7)] == times


def test_restart_upon_awake_forgets_earlier_resets():
    script = Script(plan(1, upon_awake="restart", reset_time=-1.0, reset_max=1), random.Random(1))
    times = [t for t, _ in play(script, 20, conditions=lambda t: not 5 <= t < 6)]
    assert times == [1.0, 2.0, 7.0, 8.0]


def test_forward_skips_seconds_or_jumps_to_the_next_event():
    script = Script(plan(10, 20), random.Random(1))
    play(script, 1)
    script.forward(8, 1)
    assert [t for t, _ in play(script, 3, start=1.25)] == [2.0]
    script.forward(0, 3)
    assert [t for t, _ in play(script, 4, start=3.25)] == [3.25]
    script.forward(0, 4)
    assert play(script, 5, start=4.25) == []


def test_shuffle_redraws_the_times_and_without_it_they_stay():
    drawn = []
    for shuffle in (True, False):
        script = Script(plan((0, 100), reset_time=-1.0, shuffle=shuffle), random.Random(1))
        first = list(script.times)
        script.reset(0.0)
        drawn.append(script.times == first)
    assert drawn == [False, True]


TIMES = st.one_of(st.integers(0, 20), st.tuples(st.integers(0, 10), st.integers(10, 20)))


@given(
    st.lists(TIMES, max_size=6),
    st.sampled_from([0.0, -1.0, 5.0, 12.0]),
    st.integers(-1, 3),
    st.lists(
        st.tuples(
            st.sampled_from(["pause", "unpause", "forward", "jump", "hold", "release"]), st.integers(1, 20)
        )
    ),
    st.integers(0, 5),
)
def test_whatever_happens_no_event_fires_twice_in_a_pass_or_before_its_time(
    times, reset_time, reset_max, moves, seed
):
    script = Script(plan(*times, reset_time=reset_time, reset_max=reset_max), random.Random(seed))
    fired: set[int] = set()
    now, conditions, passes = 0.0, True, 0
    for move, ticks in [*moves, ("release", 30), ("unpause", 200)]:
        if move in ("pause", "unpause"):
            script.paused = move == "pause"
        elif move in ("forward", "jump"):
            script.forward(3 if move == "forward" else 0, now)
        else:
            conditions = move == "release"
        for _ in range(ticks):
            now += 0.5
            if script.resets != passes:
                passes, fired = script.resets, set()
            standing = script.paused or not conditions
            due = script.update(now, conditions=conditions)
            assert not (standing and due)
            for event in due:
                assert event.number not in fired
                assert script.elapsed(now) + 1e-9 >= script.times[event.number] + script.delay
                fired.add(event.number)
                script.posted()
            assert script.count == len(fired)
            script.settle(now)
    assert reset_max < 0 or script.resets <= reset_max
    if not reset_time:
        assert script.pending == []
        assert script.total == len(times)


# --- the app ------------------------------------------------------------------------------------


def test_the_app_posts_numbers_texts_and_counts():
    script = Harness(
        TimerScript,
        'AppTick = 10\nevent = var=A, val=5, time=1\nevent = var=B, val="5", time=2\n'
        'event = var=C, val=$[COUNT], time=3\nevent = var=D, val="at $(VNAME) $[VNAME]", time=3',
    ).run(5)
    assert [(n, v) for _, n, v in script.said if n in "ABCD"] == [
        ("A", 5.0), ("B", "5"), ("C", 2.0), ("D", "at $(VNAME) abe"),
    ]  # fmt: skip
    assert script.times("A") == [pytest.approx(1.0, abs=0.11)]


def test_equal_seeds_give_equal_posts_and_other_seeds_others():
    block = "event = var=A, val=$[R], time=0:10, amt=5\nreset_time=end\nrandvar = varname=R,min=0,max=100,key=at_post"
    first, second, third = (Harness(TimerScript, block, seed=s).run(40) for s in (1, 1, 2))
    assert first.said == second.said
    assert first.values("A") != third.values("A")
    assert len(set(first.values("A"))) > 10


def test_conditions_hold_the_script_until_mail_says_otherwise():
    script = Harness(TimerScript, "condition = DEPLOY = true\nevent = var=A, val=1, time=1").run(5)
    assert script.values("A") == []
    script.post("DEPLOY", "true").run(5)
    assert script.times("A") == [pytest.approx(6.0, abs=0.3)]


def test_mail_pauses_forwards_and_resets():
    script = Harness(TimerScript, "event = var=A, val=1, time=10").run(1)
    script.post("UTS_PAUSE", "true").run(20)
    assert script.values("A") == []
    script.post("UTS_PAUSE", "toggle").post("UTS_FORWARD", 0).run(1)
    assert len(script.values("A")) == 1
    script.post("UTS_RESET", "reset").run(11)
    assert len(script.values("A")) == 2


def test_the_script_waits_for_apps_to_connect():
    script = Harness(TimerScript, "block_on = pHelmIvP\nevent = var=A, val=1, time=0").run(5)
    assert script.values("A") == []
    script.home.database.connect("pHelmIvP", script.host.clock.now())
    script.run(5)
    assert script.values("A") == [1.0]


def test_navigation_fills_values_and_database_time_counts_from_its_start():
    script = Harness(
        TimerScript, 'event = var=A, val="x=$[NAV_X],y=$(NAV_Y)", time=3\nevent=var=B,val=$[DBTIME],time=4'
    )
    script.post("NAV_X", 1.234).post("NAV_Y", -5.0).run(6)
    assert script.values("A") == ["x=1.23,y=-5.00"]
    assert script.values("B") == [pytest.approx(4.0, abs=0.3)]


def test_db_start_counts_from_the_start_of_the_database():
    block = "time_zero = db_start\nevent = var=A, val=1, time=5"
    assert Harness(TimerScript, block).run(10).times("A") == [pytest.approx(5.0, abs=0.3)]


def test_a_quit_event_announces_itself_and_ends_the_app():
    script = Harness(TimerScript, "event = quit, time=2", name="uTimerScript").run(5)
    assert script.values("EXITED_NORMALLY") == ["uTimerScript"]
    assert not script.alive


def test_status_has_the_fields_of_the_reference():
    script = Harness(
        TimerScript, "script_name = ping\nevent = var=A, val=1, time=1\nreset_time=end\nreset_max=3"
    ).run(4)
    assert script.values("UTS_STATUS")[0] == (
        "name=ping, elapsed_time=0.00, posted=0, pending=1, paused=false, conditions_ok=true, time_warp=1, "
        "delay_start=0, delay_reset=0, shuffle=true, upon_awake=n/a, resets=0/3"
    )
    assert "resets=3/3" in script.values("UTS_STATUS")[-1]
    silent = Harness(TimerScript, "status_var = silent\nevent = var=A, val=1, time=1").run(4)
    assert silent.values("silent") == silent.values("UTS_STATUS") == []


@pytest.mark.parametrize(
    "line", ["event = val=3", "randvar = varname=A", "condition = (A", "reset_time = later", "upon_awake = maybe",
             "time_warp = 0", "delay_start = -1", "reset_max = -2", "time_zero = noon"]
)  # fmt: skip
def test_a_bad_parameter_is_a_problem_with_its_line(line):
    (problem,) = Harness(TimerScript, line).app.problems
    assert problem.line == 3
    assert line.split(" ")[0] in problem.text
