"""A_c and W derived from behaviour files."""

from pathlib import Path

import numpy as np
import pytest

from ivp_helm.behavior_file import read_behavior_file
from opinion_engine import activation
from opinion_engine.model import weighted_decision
from opinion_engine.option_file import parse_options

OPTIONS = "".join(
    f"social_option\n{{\n name = {name}\n active_condition = DEPLOY=true\n option_output = OPTION={name.upper()}\n"
    f" social_mode = custom\n input = X\n input_function_type = none\n}}\n"
    for name in ("explore", "exploit", "migrate")
)
BEHAVIORS = """
initialize DEPLOY = false
initialize RETURN = false

set MODE = ACTIVE {
  DEPLOY = true
} INACTIVE

set MODE = EXPLORING {
  MODE = ACTIVE
  OPTION = EXPLORE
  RETURN = false
}

set MODE = EXPLOITING {
  MODE = ACTIVE
  OPTION = EXPLOIT
  RETURN = false
} DEFAULT

Behavior = BHV_Voronoi
{
  name      = cover
  condition = MODE == EXPLORING
}

Behavior = BHV_Waypoint
{
  name      = travel
  pwt       = 50
  condition = MODE == EXPLOITING
  condition = (WAIT = false) or (SAMPLES > 0)
}

Behavior = BHV_AvoidCollision
{
  name      = avoid
  pwt       = 350
  condition = MODE == ACTIVE
  condition = not_known = 1
}

Behavior = BHV_StationKeep
{
  name      = hold
  condition = MODE == INACTIVE
}
"""


def derive(behaviors=BEHAVIORS, options=OPTIONS, **assume):
    file = read_behavior_file(behaviors, "m.bhv")
    assert not file.errors
    return activation.derive(file, parse_options([(options, "m.opt")]), assume)


def test_modes_and_conditions_give_the_matrix():
    found = derive()
    assert found.options == ("explore", "exploit", "migrate")
    assert found.behaviors == ("cover", "travel", "avoid", "hold")
    assert found.weights.tolist() == [100, 50, 350, 100]
    assert found.a_c.tolist() == [[1, 0, 1, 0], [0, 1, 1, 0], [0, 0, 1, 0]]
    assert found.modes == ("MODE = ACTIVE:EXPLORING", "MODE = ACTIVE:EXPLOITING", "MODE = ACTIVE:DEFAULT")
    assert found.provided[1][1] == "(WAIT = false) or (SAMPLES > 0)"
    assert found.provided[0][0] == ""


def test_what_is_assumed_is_known():
    assert derive(WAIT="false").provided[1][1] == ""
    assert derive(WAIT="true", SAMPLES="0").a_c[1].tolist() == [0, 0, 1, 0]
    assert derive(RETURN="true").modes[0] == "MODE = ACTIVE:DEFAULT"


def test_an_option_that_activates_nothing_is_a_warning_with_its_line():
    behaviors = BEHAVIORS.replace("condition = MODE == ACTIVE\n", "condition = MODE == EXPLORING\n")
    found = derive(behaviors)
    assert len(found.warnings) == 1
    assert found.warnings[0] == "m.opt:19: option 'migrate' activates no behaviour of m.bhv"
    assert "warning: m.opt:19" in found.table()


def test_conditions_and_weights_that_cannot_be_read_are_warnings():
    bad = "\nBehavior = BHV_Waypoint\n{\n name = odd\n pwt = heavy\n condition = A ~ B\n}\n"
    warnings = derive(BEHAVIORS + bad).warnings
    assert any("pwt of 'odd' is not a number" in w for w in warnings)
    assert any(w.startswith("m.bhv:") and "behaviour 'odd'" in w for w in warnings)


def test_the_table_is_for_reading():
    text = derive().table()
    rows = {row.split()[0]: row.split()[1:] for row in text.splitlines() if row.strip()}
    assert "[1] when (WAIT = false) or (SAMPLES > 0)" in text
    assert rows["behaviour"] == ["pwt", "explore", "exploit", "migrate"]
    assert rows["cover"] == ["100", "1", "0", "0"]
    assert rows["avoid"] == ["350", "1[2]", "1[2]", "1[2]"]
    assert "[2] when not_known = 1" in text


def test_the_matrix_decides_like_the_paper():
    found = derive()
    f = np.array([[3.0, 1.0], [1.0, 3.0], [0.0, 0.5], [9.0, 0.0]])
    best, total = weighted_decision([0, 1, 0], found.a_c, found.weights, f)
    assert best == (1,)
    assert total.tolist() == [50.0, 150.0 + 175.0]


def test_the_bloom_mission_activates_what_its_options_say():
    folder = Path(__file__).parents[2] / "missions" / "bloom"
    if not (folder / "bloom.opt").is_file():
        pytest.skip("this source tree has no bloom mission")
    from opinion_engine.option_file import read_options

    file = read_behavior_file((folder / "meta_vehicle.bhv").read_text(encoding="utf-8"), "meta_vehicle.bhv")
    found = activation.derive(file, read_options([folder / "bloom.opt"]))
    column = {name: found.a_c[:, q].tolist() for q, name in enumerate(found.behaviors)}
    assert column["voronoi_cover"] == [1, 0, 0]
    assert column["travel_to_sample"] == [0, 1, 0]
    assert column["sample_timer"] == [0, 1, 0]
    assert column["migrating"] == [0, 0, 1]
    assert column["recover"] == [1, 1, 1]
    assert column["waypt_return"] == [0, 0, 0]
    assert not any("activates no behaviour" in w for w in found.warnings)
