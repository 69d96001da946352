"""A faulty `.bhv` file: every problem at once, each with its place, and no half-built helm (helm.md 1.5)."""

from __future__ import annotations

import pytest

from ivp_helm.behavior import Behavior
from ivp_helm.testing import HelmRig

BAD = """\
initialize DEPLOY

Behavior = BHV_Waypoint
{
  name     = one two
  pwt      = heavy
  condtion = DEPLOY = true
  points   = 0,0:a,b
  speed    = -1
}

Behavior = BHV_Waypiont
{
  name = b
}

Behavior = BHV_ConstantSpeed
{
  name = cs
  condition = A = 1 and B = 2
}
Behavior = BHV_ConstantSpeed
{
  name = cs2
}
Behavior = BHV_ConstantSpeed
{
  name = cs3
  templating = Spawned
}
"""


def problems(text: str) -> list[str]:
    return [str(p) for p in HelmRig(text=text, faulty=True).core.problems]


def test_every_problem_of_the_file_is_reported_with_its_line():
    found = problems(BAD)
    lines = sorted(int(text.split(":")[1]) for text in found)
    assert lines == [1, 5, 6, 7, 8, 9, 12, 20, 29]
    assert all(text.startswith("test.bhv:") for text in found)


def test_unknown_names_come_with_the_nearest_spelling():
    text = "\n".join(problems(BAD))
    assert "there is no parameter 'condtion'; did you mean 'condition'?" in text
    assert "there is no behavior 'BHV_Waypiont'; did you mean 'BHV_Waypoint'?" in text


def test_no_name_may_begin_another_one_and_both_are_named():
    found = problems(
        "Behavior = BHV_ConstantSpeed\n{\n name = cs\n}\nBehavior = BHV_ConstantSpeed\n{\n name = cs2\n}\n"
    )
    assert found == [
        "test.bhv:5: error: Duplicate behavior name found: cs2: no name may begin another one, and line 1 has 'cs'"
    ]


def test_names_of_templates_may_begin_others():
    text = """
Behavior = BHV_ConstantSpeed
{
  name = cs
  templating = spawn
  updates = U
}
Behavior = BHV_ConstantSpeed
{
  name = cs2
}
"""
    assert problems(text) == []


def test_behaviours_without_a_name_get_the_one_of_their_class():
    helm = HelmRig([("BHV_Waypoint", {"points": "0,0"})])
    assert [life.name for life in helm.core.population] == ["bhv_waypoint"]


def test_two_behaviours_without_names_clash():
    assert (
        "Duplicate behavior name"
        in problems("Behavior = BHV_Waypoint\n{\n}\nBehavior = BHV_Waypoint\n{\n}\n")[0]
    )


def test_one_bad_line_keeps_the_whole_helm_from_driving():
    helm = HelmRig(text="Behavior = BHV_ConstantSpeed\n{\n name = a\n nope = 1\n}\n", faulty=True)
    helm.own()
    helm.iterate(3)
    assert set(helm.posted("IVPHELM_STATE")) == {"MALCONFIG"}
    assert helm.posted("DESIRED_SPEED") == []


@pytest.mark.parametrize(
    "line",
    [
        "points = 1,2:nope",
        "lead = far",
        "order = backwards",
        "repeat = -1",
        "capture_radius = 0",
        "patience = 100",
        "end_spd = slow_dist=5",
        "end_spd = slow_dist=5,stop_dist=9",
        "ipf_type = round",
        "post_suffix = a b",
        "capture_line = maybe",
        "lead_damper = -1",
        "currix = -1",
        "visual_hints = vertex_color=notacolor",
    ],
)
def test_bad_waypoint_parameters_are_refused_with_a_reason(line):
    found = problems(f"Behavior = BHV_Waypoint\n{{\n  name = w\n  {line}\n}}\n")
    assert len(found) == 1
    assert found[0].startswith("test.bhv:4: error: BHV_Waypoint 'w': ")


class Old(Behavior):
    """Nobody should use it."""

    BHV_NAME = "BHV_Old"
    VARIABLES = ()
    DEPRECATED = "deprecated, use BHV_New"


class Changed(Behavior):
    """Has lost a parameter."""

    BHV_NAME = "BHV_Changed"
    VARIABLES = ()
    RETIRED = {"buffer_dist": "use min_util_cpa_dist"}  # noqa: RUF012


@pytest.mark.parametrize(
    ("cls", "parameters", "words"),
    [
        (
            Old,
            {"name": "o"},
            "deprecated, use BHV_New; or add i_understand_this_behavior_is_deprecated = true",
        ),
        (
            Changed,
            {"name": "c", "buffer_dist": 5},
            "parameter 'buffer_dist' is retired; use min_util_cpa_dist",
        ),
    ],
)
def test_what_is_retired_is_an_error_and_only_a_warning_if_that_was_asked_for(cls, parameters, words):
    strict = HelmRig([(cls, parameters)], faulty=True)
    assert strict.core.authority.malconfig
    assert words in str(strict.core.problems[0])
    lenient = HelmRig([(cls, parameters)], settings={"accept_retired": True})
    assert words in str(lenient.core.problems[0])
    assert not lenient.core.authority.malconfig


def test_a_deprecated_behaviour_runs_if_the_block_says_that_this_is_understood():
    helm = HelmRig([(Old, {"name": "o", "i_understand_this_behavior_is_deprecated": True})])
    assert helm.core.problems == ()
