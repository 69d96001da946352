"""uQueryDB against a real database on loopback."""

import argparse

import pytest
from served_database import serve

from pymoos_lite.config.conditions import parse_condition
from pymoos_lite.config.moos_file import parse_mission
from pymoos_lite.hosts.ports import free_port
from pymoos_lite.tools.query_db import Query, main, query_of


def options(**given):
    return argparse.Namespace(**{"passes": [], "fails": [], "check": [], "wait": None, "form": None, **given})


def test_the_block_of_the_mission_and_the_command_line_add_up():
    mission = parse_mission(
        "ProcessConfig = uQueryDB\n{\ncondition = A = 1\npass_condition = B = 2\nfail_condition = C = 3\n"
        "halt_max_time = 7\ncheck_var = X, Y\ncheck_var_format = csv\n}\n"
    )
    query = query_of(mission, options(passes=["D = 4"], check=["Z"]))
    assert [str(c) for c in query.passes] == ["D = 4", "A = 1", "B = 2"]
    assert ([str(c) for c in query.fails], query.wait, query.check, query.form) == (
        ["C = 3"],
        7.0,
        ("Z", "X", "Y"),
        "csv",
    )
    assert query_of(mission, options(wait=3.0, form="vo")).wait == 3.0


@pytest.mark.parametrize(
    ("form", "line"), [("esv", " A=1.5"), ("csv", "A,1.5"), ("wsv", "A 1.5"), ("vo", "1.5")]
)
def test_check_lines_have_the_formats_of_the_reference(form, line):
    assert Query(check=("A", "NONE"), form=form).check_lines({"A": 1.5}) == [line]


@pytest.mark.parametrize(
    ("known", "result"),
    [({}, False), ({"A": 1.0}, True), ({"A": 1.0, "B": "x"}, False), ({"A": 1.0, "B": "y"}, True)],
)
def test_a_query_holds_with_all_pass_and_no_fail_conditions(known, result):
    query = Query((parse_condition("A = 1"),), (parse_condition("B = x"),))
    assert query.holds(known) is result
    assert Query().holds({})


def test_it_waits_for_a_condition_and_writes_the_check_variables(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments = ["--condition=DONE = true", "--check_var=SCORE", "--check_var=NAME", "--csv"]
    assert serve(main, arguments, [("DONE", "true")], before=[("SCORE", 2.5), ("NAME", "abe")]) == 0
    assert (tmp_path / ".checkvars").read_text() == "SCORE,2.5\nNAME,abe\n"


def test_it_gives_up_after_the_wait():
    assert serve(main, ["--condition=DONE = true", "--wait=0.3"], [("DONE", "false")]) == 1


def test_without_conditions_it_ends_at_once():
    assert serve(main, []) == 0


@pytest.mark.parametrize("arguments", [["--condition=A"], [f"--port={free_port()}", "--timeout=0.3"]])
def test_what_cannot_be_done_is_one_line_and_status_one(arguments, capsys):
    assert main(arguments) == 1
    assert capsys.readouterr().err.count("\n") == 1
