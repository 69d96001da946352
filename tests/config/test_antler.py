"""The launch list of a mission (community.md 9)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoos_lite.config.antler import Antler, AppRun, read_antler
from pymoos_lite.config.moos_file import parse_mission


def antler(*body: str) -> Antler:
    launch = read_antler(parse_mission("\n".join(["ProcessConfig = ANTLER", "{", *body, "}"]), "m.moos"))
    assert launch is not None
    return launch


def test_runs_come_in_file_order_with_their_program_name_as_default_alias():
    launch = antler(
        "MSBetweenLaunches = 200",
        "Run = MOOSDB @ NewConsole = false",
        "Run = ./bin/pHelmIvP @ NewConsole=false",
        "Run = uTimerScript @ NewConsole = true ~ uTimerScript_PING",
    )
    assert launch.problems == ()
    assert launch.pause == 0.2
    assert launch.runs == (
        AppRun("MOOSDB", "MOOSDB", {"newconsole": "false"}, (), 4),
        AppRun("./bin/pHelmIvP", "pHelmIvP", {"newconsole": "false"}, (), 5),
        AppRun("uTimerScript", "uTimerScript_PING", {"newconsole": "true"}, (), 6),
    )


@pytest.mark.parametrize(
    ("text", "alias", "options"),
    [
        ("pA ~ one", "one", {}),
        ("pA~one, Path=SYSTEM", "one", {"path": "SYSTEM"}),
        ("pA ~ one @ NewConsole = false", "one", {"newconsole": "false"}),
        ("pA @ NewConsole=false ~ one, AntlerID=x", "one", {"newconsole": "false", "antlerid": "x"}),
        ("~/bin/pA", "pA", {}),
        ("~/bin/pA ~ one", "one", {}),
        ("pA @ Path=~/bin", "pA", {"path": "~/bin"}),
        ('pA @ "NewConsole=false"', "pA", {"newconsole": "false"}),
        ("C:\\moos\\pA.exe", "pA.exe", {}),
    ],
)
def test_alias_and_options_may_stand_in_either_order(text, alias, options):
    launch = antler(f"Run = {text}")
    assert launch.problems == ()
    assert (launch.runs[0].alias, launch.runs[0].options) == (alias, options)


def test_named_strings_become_extra_arguments_split_at_commas():
    launch = antler("Run = pA @ ExtraProcessParams=MORE", "MORE = --verbose, -x , 5")
    assert launch.problems == ()
    assert launch.runs[0].extra == ("--verbose", "-x", "5")


@pytest.mark.parametrize(
    ("body", "where", "words"),
    [
        (["Run = pA @ NewConsle=false"], "m.moos:3", "did you mean 'NewConsole'"),
        (["Run = pA @ NewConsole"], "m.moos:3", "no value"),
        (["Run = pA", "Run = pA"], "m.moos:4", "line 3"),
        (["Run = pA @ ExtraProcessParams=MORE"], "m.moos:3", "MORE"),
        (["MSBetweenLaunches = soon"], "m.moos:3", "a number"),
        (["MSBetweenLaunch = 5"], "m.moos:3", "did you mean 'MSBetweenLaunches'"),
        (["Run = @ NewConsole=false"], "m.moos:3", "names no app"),
    ],
)
def test_a_mistake_in_the_launch_list_is_one_problem_with_its_place(body, where, words):
    (problem,) = antler(*body).problems
    assert problem.where == where
    assert words in problem.text


def test_of_two_runs_with_one_name_the_first_is_kept():
    launch = antler("Run = pA ~ x", "Run = pB ~ x")
    assert [(r.app, r.alias) for r in launch.runs] == [("pA", "x")]


def test_a_mission_without_antler_block_has_no_launch_list():
    assert read_antler(parse_mission("ServerPort = 9000\n")) is None


@given(st.text(alphabet='pA ~@,=/\\"x.:', max_size=30))
def test_no_run_line_makes_the_reader_raise_and_runs_are_named(text):
    for run in antler(f"Run = {text}").runs:
        assert run.app
        assert run.alias
