"""Whatever arrives as mail, the helm goes on: nothing raises, nothing grows without bound."""

from __future__ import annotations

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from ivp_helm.inbox import FIXED_VARIABLES
from ivp_helm.testing import HelmRig
from pymoos_lite.core.message import Message

TEXT = """
initialize GO = true
set MODE = ON {
  GO = true
} OFF
Behavior = BHV_Waypoint
{
  name = w
  condition = MODE == ON
  condition = X_DELTA < 5
  condition = !(K = $(L))
  points = 0,50:50,50
  speed = 2
  updates = UP
  nostarve = Y,100
  duration_reset = AGAIN
  lead_condition = L = 1
}
Behavior = BHV_ConstantSpeed
{
  name = s_
  templating = spawn
  updates = CALL
  speed = 1
  max_spawnings = 20
  duration = no-time-limit
}
"""

NAMES = st.sampled_from(
    [*FIXED_VARIABLES, "GO", "MODE", "X", "X_DELTA", "K", "L", "Y", "UP", "CALL", "AGAIN"]
)
PAIRS = st.sampled_from(
    [
        "name=a",
        "name=",
        "name=s_b",
        "speed=3",
        "speed=-1",
        "points=0,0:1,1",
        "points=pts={0,0:5",
        "currix=7",
        "endflag=A=$[CTR]$[",
        "condition=((A",
        "condition=A=1",
        "duration=0",
        "pwt=1e400",
        "pwt=0",
        "repeat=forever",
        "lead=nan",
        "perpetual=toggle",
        "visual_hints=a=b",
        "build_info=clear",
        "order=toggle",
        "name=a#name=b",
    ]
)
TEXTS = st.one_of(
    st.text(max_size=40),
    st.lists(PAIRS, max_size=4).map(" # ".join),
    st.sampled_from(
        [
            "true",
            "false",
            "DRIVE",
            "STANDBY",
            "type1",
            "action=disable,contact=x",
            "NAME=ben,X=1,Y=2,SPD=1,HDG=0,TIME=1700000000,TYPE=kayak",
            "NAME=alpha,X=nan,Y=2,TIME=1",
            '{"NAME":"ben"}',
        ]
    ),
)
VALUES = st.one_of(TEXTS, st.floats(), st.binary(max_size=8))
MAIL = st.lists(
    st.tuples(NAMES, VALUES, st.sampled_from(["a", "pHelmIvP"]), st.floats(-100, 100)), max_size=8
)


@given(st.lists(MAIL, max_size=6))
@settings(max_examples=150, deadline=None)
def test_no_mail_makes_the_helm_raise_or_post_anything_that_is_no_number(rounds):
    helm = HelmRig(text=TEXT)
    helm.own(x=1, y=2, heading=3, speed=1)
    helm.mail("Y", 1.0)
    for mail in rounds:
        helm._mail += [Message(n, v, helm.now + t, source) for n, v, source, t in mail]
        helm.iterate()
    for name in ("DESIRED_HEADING", "DESIRED_SPEED"):
        for value in helm.posted(name):
            assert isinstance(value, float)
            assert math.isfinite(value)
    assert len(helm.core.population.lives) <= 21
    assert len(helm.core.notes) < 10_000


def test_endless_spawn_requests_are_bounded_by_the_limit_of_the_template():
    helm = HelmRig(text=TEXT)
    helm.own()
    helm.mail("Y", 1.0)
    for k in range(100):
        helm.mail("CALL", f"name={k}")
    helm.iterate(2)
    assert len(helm.core.population.lives) == 21


def test_a_flood_of_reports_keeps_a_bounded_number_of_contacts():
    helm = HelmRig(text=TEXT)
    helm.own()
    now = helm.now + 0.25
    helm._mail = [
        Message("NODE_REPORT", f"NAME=v{k},X=1,Y=2,SPD=1,HDG=0,TIME={now},TYPE=kayak", now, "x")
        for k in range(3000)
    ]
    helm.iterate()
    assert len(helm.core.contacts.snapshot) == 1000
