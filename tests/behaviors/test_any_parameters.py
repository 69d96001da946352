"""Whatever legal parameters a mission gives: no behaviour raises, and every function is sound."""

from __future__ import annotations

from math import isfinite

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from test_contract import PARAMETERS

from ivp_helm.base_parameters import BASE_PARAMETERS
from ivp_helm.testing import HelmRig
from pymoos_lite.config.catalogue import BEHAVIORS
from pymoos_lite.config.parameters import Parameter, ParameterError
from pymoos_lite.config.registry import load_target

DOMAIN = ("course:0:359:72", "speed:0:4:9", "depth:0:50:26")
OWN = {"perpetual", "duration"}
BASE = {p.key for p in BASE_PARAMETERS} - OWN
WORDS = {
    "polygon": ("pts={-20,-20:20,-20:20,20:-20,20}", "format=radial,x=5,y=5,radius=12,pts=5"),
    "points": ("0,0:20,5:-30,4", "3,4", "empty", "start"),
    "point": ("x=5,y=-6", "0,0"),
}
"""Legal texts for parameters whose declaration cannot tell them, by a word in their name."""


def value_of(parameter: Parameter) -> st.SearchStrategy[str]:
    """Legal texts of a parameter, extremes among them."""
    low = parameter.low if parameter.low is not None else -1e4
    high = parameter.high if parameter.high is not None else 1e4
    if parameter.kind == "integer":
        return st.integers(int(low), int(min(high, 50))).map(str)
    if parameter.kind == "number":
        numbers = st.one_of(st.sampled_from([low, high, 0.0, 1.0]), st.floats(low, high))
        return numbers.map(lambda number: f"{number:.4f}")
    if parameter.kind == "boolean":
        return st.sampled_from(["true", "false"])
    if parameter.kind == "choice":
        return st.sampled_from(parameter.choices)
    for word, texts in WORDS.items():
        if word in parameter.name or word.removesuffix("gon") in parameter.name:
            return st.sampled_from(texts)
    texts = [text.strip() for text in parameter.example.split(" or ")]
    return st.sampled_from([*texts, "5", "20,5", "true", "off"])


def is_legal(parameter: Parameter, text: str) -> bool:
    try:
        parameter.read(text)
    except ParameterError:
        return False
    return bool(text)


own_ship = st.builds(
    lambda x, y, heading, speed, depth: {"x": x, "y": y, "heading": heading, "speed": speed, "depth": depth},
    st.floats(-60, 60),
    st.floats(-60, 60),
    st.floats(0, 360),
    st.sampled_from([0.0, 0.3, 2.0]),
    st.floats(0, 50),
)


@pytest.mark.parametrize("entry", BEHAVIORS, ids=lambda entry: entry.name)
@settings(max_examples=10, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_any_legal_parameters_are_survived(entry, data):
    kind = load_target(entry.target)
    declared = [p for p in kind.declaration() if p.key not in BASE]
    chosen = data.draw(st.lists(st.sampled_from(declared), max_size=12, unique_by=lambda p: p.name))
    pairs = [(p.name, data.draw(value_of(p), label=p.name)) for p in chosen]
    pairs = [(name, text) for name, text in pairs if is_legal(kind.declaration().find(name), text)]
    taken = {kind.declaration().find(name).key for name, _ in pairs}
    usual = {"duration": "no-time-limit", **PARAMETERS.get(entry.name, {})}
    pairs += [(n, str(v)) for n, v in usual.items() if kind.declaration().find(n).key not in taken]
    rig = HelmRig([(entry.name, [("name", "b"), ("updates", "UP"), *pairs])], domain=DOMAIN, faulty=True)
    assume(not rig.core.authority.malconfig)  # parameters may contradict each other
    rig.mail("DESIRED_SPEED", 1.0)
    rig.mail("NAV_ALTITUDE", 20.0)
    for k, own in enumerate(data.draw(st.lists(own_ship, min_size=4, max_size=8))):
        rig.own(**own)
        if k == 2 and chosen:
            update = data.draw(st.sampled_from(chosen))
            rig.mail("UP", f"{update.name} = {data.draw(value_of(update), label='update')}")
        trace = rig.iterate()
        for _, outcome in trace.rounds:
            function = outcome.function
            if function is not None:
                assert isfinite(function.minimum)
                assert isfinite(function.maximum)
                assert function.coverage()[0] == 0
                assert function.weight > 0.0
    raised = [text for text in rig.posted("BHV_ERROR") if "raised" in str(text)]
    if entry.name != "BHV_TestFailure":
        assert raised == []
