"""uMayFinish against a real database on loopback."""

from __future__ import annotations

import pytest
from served_database import serve

from pymoos_lite.config.moos_file import parse_mission
from pymoos_lite.hosts.ports import free_port
from pymoos_lite.tools.may_finish import FinishRule, main, rule_of

BLOCK = "ProcessConfig = uMayFinish\n{\nfinish_var = DONE\nfinish_val = 2\nmax_db_uptime = 100\n}\n"


def test_the_block_of_the_mission_is_read_and_the_command_line_goes_first():
    mission = parse_mission(BLOCK)
    assert rule_of(mission, None) == FinishRule("DONE", "2", 100.0)
    assert rule_of(mission, 5.0).max_uptime == 5.0
    assert rule_of(parse_mission(""), None) == FinishRule("MISSION_EVALUATED", "true", float("inf"))


@pytest.mark.parametrize(
    ("name", "value", "verdict"),
    [
        ("MISSION_EVALUATED", "true", 0),
        ("MISSION_EVALUATED", "false", None),
        ("DB_UPTIME", 10.0, None),
        ("DB_UPTIME", 10.5, 1),
        ("OTHER", "true", None),
    ],
)
def test_verdicts(name, value, verdict):
    assert FinishRule(max_uptime=10.0).verdict(name, value) == verdict
    assert FinishRule("DONE", "2").verdict("DONE", 2.0) == 0


def test_it_ends_well_when_the_mission_has_been_evaluated(capsys):
    assert serve(main, [], [("MISSION_EVALUATED", "true")]) == 0
    assert capsys.readouterr().out == "finished: MISSION_EVALUATED = true\n"


def test_it_ends_badly_when_the_database_is_older_than_allowed(capsys):
    assert serve(main, ["--max_time=50"], uptime=60.0) == 1
    assert capsys.readouterr().out.startswith("not finished after 50 s: DB_UPTIME = 6")


def test_a_community_that_is_not_there_is_one_line_and_status_one(capsys):
    assert main([f"--port={free_port()}", "--timeout=0.3"]) == 1
    assert capsys.readouterr().err.count("\n") == 1
