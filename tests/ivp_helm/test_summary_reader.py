"""Differential summaries give the full picture back (helm.md 10.2)."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from ivp_helm.summary import SummaryReader
from ivp_helm.testing import HelmRig

TEXT = """
set MODE = GO {
  GO = true
} STAY

Behavior = BHV_Waypoint
{
  name = far
  condition = MODE == GO
  points = 500,500
  speed = 2
  updates = UP
}
Behavior = BHV_ConstantSpeed
{
  name = slow
  condition = SLOW = true
  speed = 1
  duration = 2
}
"""


@given(
    st.lists(
        st.sampled_from([("GO", "true"), ("GO", "no"), ("SLOW", "true"), ("UP", "speed=3"), None]),
        max_size=12,
    )
)
@settings(max_examples=25, deadline=None)
def test_a_reader_of_all_summaries_knows_the_state_after_each(mail):
    helm = HelmRig(text=TEXT)
    helm.own(heading=10)
    reader = SummaryReader()
    for k, item in enumerate(mail, 1):
        if item is not None:
            helm.mail(*item)
        trace = helm.iterate()
        reader.take(str(helm.posted("IVPHELM_SUMMARY")[-1]))
        states = {life.name: outcome.state for life, outcome in trace.rounds}
        for state in ("active", "running", "idle"):
            assert reader.names(state) == [name for name, s in states.items() if s == state]
        assert reader.decision == helm.decision
        assert reader.values["iter"] == str(k)
        assert reader.modes() == {"MODE": str(helm.core.buffer.value("MODE"))}
        assert reader.values["ivpdomain"] == str(helm.core.domain)


@given(st.text(max_size=80))
def test_no_text_makes_the_reader_raise(text):
    reader = SummaryReader()
    reader.take(text)
    assert all(name and "," not in name for name in reader.names("active"))
    assert all(isinstance(value, str) for value in reader.modes().values())


def test_a_new_decision_replaces_the_former_one_altogether():
    reader = SummaryReader()
    reader.take("iter=1,var=course:90,var=speed:2")
    reader.take("iter=2,ofnum=1")
    assert reader.decision == {"course": 90.0, "speed": 2.0}
    reader.take("iter=3,var=course:varbalk,var=speed:1.5")
    assert reader.decision == {"speed": 1.5}
