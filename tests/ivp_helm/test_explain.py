"""Explanations: from the helm in memory and from its posts, and the command that tells them."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ivp_helm import helm_tool
from ivp_helm.explain import VARIABLES, Entry, Explanation, History, explain, explanations, plain_reason
from ivp_helm.testing import HelmRig

TEXT = """
set MODE = GO {
  GO = true
} STAY

Behavior = BHV_Waypoint
{
  name = north
  pwt = 100
  condition = MODE == GO
  points = 0,500
  speed = 2
}
Behavior = BHV_Waypoint
{
  name = east
  pwt = 60
  condition = MODE == GO
  points = 500,0
  speed = 1
}
Behavior = BHV_ConstantSpeed
{
  name = slow
  condition = SLOW = true
  duration = no-time-limit
  speed = 1
}
"""


def rig(text: str = TEXT) -> HelmRig:
    helm = HelmRig(text=text)
    helm.core.listens = lambda variable: True
    helm.own(heading=10, speed=1)
    helm.mail("GO", "true")
    return helm


def entries(helm: HelmRig) -> list[Entry]:
    return [
        Entry(float(k), name, str(value))
        for k, (_, name, value) in enumerate(helm.published)
        if name in VARIABLES
    ]


def spoken(explanation: Explanation | None) -> str:
    assert explanation is not None
    return "\n".join(explanation.lines())


def test_it_tells_who_had_a_say_with_what_weight_and_what_each_gave_up():
    helm = rig()
    helm.iterate()
    explanation = explain(helm.core)
    assert explanation is not None
    assert explanation.part("north").best() == {"course": 0.0, "speed": 2.0}
    assert explanation.part("east").best() == {"course": 90.0, "speed": 1.0}
    text = spoken(explanation)
    assert "Modes: MODE = GO" in text
    assert "north  weight 100 of 160, wants course 0, speed 2" in text
    assert "slow  idle: not true: SLOW = true" in text
    assert "gives up" in text
    assert "point 1 of 1, 500 m to go at 2 m/s" in text


def test_what_each_gave_up_is_the_difference_to_its_own_best():
    helm = rig()
    helm.iterate()
    explanation = explain(helm.core)
    assert explanation is not None
    for part in explanation.parts:
        if part.function is None:
            continue
        table = part.function.table()
        assert part.utility(part.best()) == pytest.approx(table.max())
        point = [part.function.domain[n].index(explanation.decision[n]) for n in part.function.domain.names]
        assert part.utility(explanation.decision) == pytest.approx(table[tuple(point)])


def test_an_all_stop_is_explained_in_plain_words():
    helm = rig()
    helm.mail("GO", "no")
    helm.iterate(2)
    assert "All-stop, because no behaviour wants anything" in spoken(explain(helm.core))
    assert plain_reason("MissingDecVars:course,depth") == "no behaviour decides course or depth"
    assert plain_reason("SomethingNew") == "SomethingNew"


def test_before_the_first_iteration_there_is_nothing_to_explain():
    assert explain(HelmRig().core) is None


def test_a_log_gives_the_same_explanation_as_the_helm_itself():
    helm = rig()
    live = []
    for k in range(6):
        if k == 3:
            helm.mail("SLOW", "true")
        helm.iterate()
        live.append(explain(helm.core))
    logged = list(explanations(entries(helm)))
    assert [e.iteration for e in logged] == [1, 2, 3, 4, 5, 6]
    for told, direct in zip(logged, live, strict=True):
        assert direct is not None
        assert told.decision == direct.decision
        assert told.modes == direct.modes
        assert told.reason == direct.reason
        assert {(p.name, p.state, p.reason) for p in told.parts} == {
            (p.name, p.state, p.reason) for p in direct.parts
        }
        assert {p.name: p.weight for p in told.parts} == {p.name: p.weight for p in direct.parts}
        for part in direct.parts:
            assert told.part(part.name).best() == part.best()


def test_a_log_without_functions_still_tells_states_and_reasons():
    helm = rig()
    helm.iterate(2)
    kept = [entry for entry in entries(helm) if entry.variable != "BHV_IPF"]
    told = list(explanations(kept))[-1]
    assert told.functions == []
    assert "not true: SLOW = true" in spoken(told)


def test_the_error_that_halted_the_helm_is_told():
    text = "Behavior = BHV_ConstantDepth\n{\n name = deep\n depth = 5\n duration = no-time-limit\n}\n"
    helm = rig(text)
    helm.iterate(2)
    for explanation in (explain(helm.core), list(explanations(entries(helm)))[-1]):
        assert "a behaviour reported an error (deep: the helm's Domain has no depth)" in spoken(explanation)


@given(
    st.lists(
        st.tuples(
            st.sampled_from(VARIABLES),
            st.one_of(st.text(max_size=30), st.sampled_from(["P,a^1,1,1,H,1", "iter=2"])),
        ),
        max_size=20,
    )
)
def test_no_posts_make_the_history_raise(posts):
    history = History()
    for k, (name, value) in enumerate(posts):
        history.take(Entry(float(k), name, value))
    assert all(isinstance(line, str) for line in history.explanation().lines())


# --- the command ------------------------------------------------------------------------------------------


@pytest.fixture
def log(tmp_path: Path) -> Path:
    helm = rig()
    rows = ["%% LOG FILE: x.alog\n", "%% LOGSTART 1700000000\n"]
    for k in range(4):
        if k == 2:
            helm.mail("GO", "no")
        count = len(helm.published)
        helm.iterate()
        rows += [f"{k * 0.25:.3f} {n} pHelmIvP {v}\n" for _, n, v in helm.published[count:]]
    path = tmp_path / "x.alog"
    path.write_text("".join(rows))
    return path


def tool(*words: str) -> int:
    parser = argparse.ArgumentParser()
    helm_tool.add_arguments(parser)
    return helm_tool.run(parser.parse_args(list(words)))


def test_the_command_explains_an_iteration_of_a_log(log, capsys):
    assert tool(str(log), "--iter", "2") == 0
    out = capsys.readouterr().out
    assert out.startswith("Iteration 2 at 0.25 s, helm in DRIVE")
    assert "Who had a say:" in out


def test_the_command_finds_the_iteration_at_a_time_or_the_last_one(log, capsys):
    assert tool(str(log), "--time", "0.6") == 0
    assert capsys.readouterr().out.startswith("Iteration 4 ")
    assert tool(str(log)) == 0
    assert capsys.readouterr().out.startswith("Iteration 4 ")


def test_the_command_lists_the_iterations_in_which_something_changed(log, capsys):
    assert tool(str(log), "--changes") == 0
    out = capsys.readouterr().out
    assert [line.split()[1] for line in out.splitlines() if line.startswith("Iteration")] == ["1", "3"]


def test_the_command_draws_functions_and_their_sum(log, tmp_path, capsys):
    file = tmp_path / "decision.png"
    assert tool(str(log), "--iter", "1", "--plot", str(file)) == 0
    assert file.read_bytes()[:4] == b"\x89PNG"
    assert tool(str(log), "--iter", "4", "--plot", str(file)) == 1
    assert "no functions to draw" in capsys.readouterr().err


def test_the_command_says_what_is_missing(log, tmp_path, capsys):
    assert tool(str(tmp_path / "none.alog")) == 1
    assert tool(str(log), "--iter", "99") == 1
    (tmp_path / "empty.alog").write_text("%% LOGSTART 0\n")
    assert tool(str(tmp_path / "empty.alog")) == 1
    err = capsys.readouterr().err
    assert "no such log file" in err
    assert "no helm iteration 99" in err
    assert "it holds no IVPHELM_SUMMARY" in err


def test_a_live_helm_that_cannot_be_reached_is_said_to_be_so(capsys):
    assert tool("--port", "1", "--timeout", "0.2") == 1
    assert "no community answers" in capsys.readouterr().err
