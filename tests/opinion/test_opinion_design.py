"""The design report and the command line of `pymoos opinion`."""

import argparse

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opinion_engine import design, opinion_tool, reach
from opinion_engine.model import Attention, Couplings, OpinionError
from opinion_engine.option_file import Option, OptionSet
from opinion_engine.reach import Setting
from opinion_engine.scenario import bloom_options
from opinion_engine.theory import critical_attention

MISSION = Attention(tau_u=4.0, u_min=0.5, u_max=2.0, y_th=2000.0, n=2.0)
EXPLORING = Setting(attention=MISSION, biases=(("explore", 90.0),))


def test_the_patterns_of_the_bloom_mission_have_the_known_thresholds():
    found = reach.patterns(bloom_options(0.05).couplings(), Setting().graph())
    assert found[0].u_star == pytest.approx(0.00659, abs=5e-6)
    assert found[0].alike
    split = [p for p in found if abs(p.options[2]) < 1e-6]
    assert split[0].u_star == pytest.approx(2.0833, abs=5e-5)
    assert not split[0].alike
    split = [
        p
        for p in reach.patterns(bloom_options(1.0).couplings(), Setting().graph())
        if abs(p.options[2]) < 1e-6
    ]
    assert split[0].u_star == pytest.approx(0.23364, abs=5e-6)
    on_a_line = reach.patterns(bloom_options(0.05).couplings(), Setting(topology="line").graph())
    assert on_a_line[0].u_star == pytest.approx(0.0234, abs=5e-5)


@settings(max_examples=30, deadline=None)
@given(
    st.fixed_dictionaries({k: st.floats(-1, 1) for k in ("alpha", "beta", "gamma", "delta")}),
    st.integers(2, 4),
    st.sampled_from(["all", "line", "star"]),
)
def test_the_first_pattern_is_the_theory_s_threshold(values, n_options, topology):
    graph = Setting(agents=5, topology=topology).graph()
    found = reach.patterns(Couplings.homogeneous(n_options, **values), graph)
    expected = critical_attention(graph.adjacency(), **values)
    if expected.u_star is None or expected.u_star > 1e9:
        assert all(p.u_star > 1e8 for p in found)
    else:
        assert found[0].u_star == pytest.approx(expected.u_star, rel=1e-9)


def test_a_storm_at_one_vessel_takes_the_fleet_but_not_a_line():
    options = bloom_options(0.05)
    one, every = reach.reaches(options, EXPLORING, 2)
    assert one.raw is not None
    assert every.raw is not None
    assert one.raw < every.raw < 100.0
    assert 5.0 < every.seconds < 40.0
    line = Setting(attention=MISSION, biases=(("explore", 90.0),), topology="line")
    assert reach.reaches(options, line, 2)[1].raw is None
    text = design.report(options, EXPLORING)
    assert "migrate spreads through the fleet when all hear all, but not along a line of 8" in text
    assert "the reference ignores alpha of explore, exploit" in text
    assert "explore and exploit: competitive" in text
    assert "above u_max: never" in text


def option(name, **values):
    return Option(
        name=name,
        outputs=values.pop("outputs", (("OPTION", name.upper()),)),
        input_variable="X",
        function_type="none",
        social_mode="custom",
        **values,
    )


def test_traps_are_named():
    options = OptionSet(
        (
            option("a", resistance=25.0, alpha=0.0, delta=(("b", 0.5),)),
            option("b", outputs=(("OTHER", "B"),), input_gain=50.0, input_min=-100.0),
        )
    )
    text = design.report(options, Setting(agents=3))
    for expected in (
        "raw input 0 is not neutral for a",
        "a does not set OTHER",
        "a can never reach opinion_thresh",
        "gains from 1 to 50",
        "the reference drops a delta without a beta for the same option: a for b",
    ):
        assert expected in text, expected
    fast = OptionSet((option("a", resistance=3.0), option("b", resistance=3.0)))
    assert "one Euler step per update is unstable" in design.report(fast, Setting(agents=3), "reference")


def test_options_that_only_follow_inputs_are_said_to():
    greedy = OptionSet(tuple(option(n, alpha=0.0, resistance=0.25, input_min=-100.0) for n in "ab"))
    text = design.report(greedy, Setting(agents=3))
    assert "nothing, at any attention" in text
    assert "the fleet never follows" in text


@pytest.mark.parametrize(
    ("setting", "reason"),
    [(Setting(agents=1), "at least 2 agents"), (Setting(biases=(("x", 1.0),)), "no option 'x'")],
)
def test_a_report_that_makes_no_sense_is_refused(setting, reason):
    with pytest.raises(OpinionError, match=reason):
        design.report(bloom_options(), setting)


# --- the command line ---------------------------------------------------------------------------


def command(*words):
    parser = argparse.ArgumentParser()
    opinion_tool.add_arguments(parser)
    return opinion_tool.run(parser.parse_args([str(w) for w in words]))


OPTION_TEXT = "".join(
    f"social_option\n{{\n name = {n}\n option_output = OPTION={n.upper()}\n social_mode = custom\n input = {n}\n"
    f" input_function_type = none\n input_min = -100\n resistance_weight = 0.5\n}}\n"
    for n in ("stay", "go")
)


def test_design_reads_option_file_and_mission(tmp_path, capsys):
    (tmp_path / "a.opt").write_text(OPTION_TEXT)
    (tmp_path / "m.moos").write_text(
        "Community = abe\nProcessConfig = pOpinionManager\n{\n  option_file = a.opt\n  tau_u = 3\n"
        "  min_attention = 0.25\n  u_th = $(U_TH)\n}\n"
    )
    status = command(
        "design", tmp_path / "a.opt", "--mission", tmp_path / "m.moos", "--agents", 3, "--u-th", 5
    )
    out = capsys.readouterr()
    assert status == 0
    assert "3 agents, all hear all; model paper; attention 0.25 to 1.5, half aroused at y = 5" in out.out
    assert "time constant 3 s" in out.out
    assert "u_th left open by the template" in out.err


def test_behaviors_prints_the_table(tmp_path, capsys):
    (tmp_path / "a.opt").write_text(OPTION_TEXT)
    (tmp_path / "m.bhv").write_text(
        "Behavior = BHV_StationKeep\n{\n name = hold\n condition = OPTION = STAY\n}\n"
    )
    assert command("behaviors", tmp_path / "a.opt", tmp_path / "m.bhv") == 0
    out = capsys.readouterr().out
    assert [row.split() for row in out.splitlines() if row.startswith("hold")] == [["hold", "100", "1", "0"]]
    assert "option 'go' activates no behaviour" in out


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("design", "none.opt"), "none.opt: cannot open"),
        (("design", "a.opt", "--bias", "stay"), "expected NAME=VALUE"),
        (("design", "a.opt", "--bias", "stay=much"), "is not a number"),
        (("design", "a.opt", "--mission", "a.opt"), "no ProcessConfig = pOpinionManager"),
        (("behaviors", "a.opt", "none.bhv"), "none.bhv"),
        (("simplex", "none.alog"), "no such log file"),
    ],
)
def test_refusals_are_one_line_and_status_1(tmp_path, capsys, monkeypatch, words, reason):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.opt").write_text(OPTION_TEXT)
    assert command(*words) == 1
    err = capsys.readouterr().err
    assert reason in err
    assert err.count("\n") == 1


def test_help_needs_no_heavy_imports():
    import subprocess
    import sys

    code = (
        "import sys, argparse; from opinion_engine import opinion_tool as t; p = argparse.ArgumentParser(); "
        "t.add_arguments(p); p.format_help(); "
        "print([m for m in ('numpy', 'numba', 'scipy', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_fleet_story_has_the_features_of_the_mission():
    from opinion_engine.scenario import fleet_story

    story = fleet_story(seed=2, minutes=25.0, vessels=4)
    choice = story.z.argmax(axis=2)
    assert np.abs(story.z.sum(axis=2)).max() < 1e-9
    assert np.all(choice[60] == story.options.index("explore"))
    assert {0, 1, 2} <= set(choice.ravel().tolist())
    migrating = (choice == story.options.index("migrate")).all(axis=1)
    assert migrating.any()
    assert story.u[migrating].max() > 1.5
    assert story.u[~migrating][:300].max() < 0.6
    again = fleet_story(seed=2, minutes=5.0, vessels=4)
    assert np.array_equal(again.z[:60], fleet_story(seed=2, minutes=5.0, vessels=4).z[:60])
