"""Command-line settings over a mission."""

from pymoos_lite.config.moos_file import parse_mission
from pymoos_lite.config.overrides import override

MISSION = parse_mission(
    "MOOSTimeWarp = 1\nServerPort = 9000\nProcessConfig = pA\n{\nAppTick = 4\nserverport = 1\n}\n"
    "ProcessConfig = pB\n{\nAppTick = 5\n}\n",
    "m.moos",
)


def values(mission, app):
    block = mission.block(app)
    assert block is not None
    return {line.key: line.value for line in block.lines}


def test_a_plain_name_changes_every_line_of_that_key():
    changed, unmatched = override(MISSION, {"serverport": "9001", "APPTICK": "10"})
    assert unmatched == ()
    assert changed.port() == 9001
    assert values(changed, "pA") == {"AppTick": "10", "serverport": "9001"}
    assert values(changed, "pB") == {"AppTick": "10"}


def test_an_app_and_a_name_change_one_block_and_may_add_a_line():
    changed, unmatched = override(MISSION, {"pB.AppTick": "10", "pb.new": "x"})
    assert unmatched == ()
    assert values(changed, "pA")["AppTick"] == "4"
    assert values(changed, "pB") == {"AppTick": "10", "new": "x"}


def test_a_known_global_is_added_and_an_unknown_name_is_handed_back():
    changed, unmatched = override(MISSION, {"Community": "abe", "nothing": "1", "pC.x": "1"})
    assert changed.text("Community") == "abe"
    assert unmatched == ("nothing", "pC.x")
    assert changed.blocks == MISSION.blocks


def test_a_bad_value_is_found_and_the_former_error_disappears_with_a_good_one():
    changed, _ = override(MISSION, {"MOOSTimeWarp": "1000"})
    (problem,) = changed.errors
    assert "at most 400" in problem.text
    repaired, _ = override(changed, {"MOOSTimeWarp": "10"})
    assert repaired.errors == ()


def test_the_original_is_left_alone():
    override(MISSION, {"ServerPort": "1"})
    assert MISSION.port() == 9000
