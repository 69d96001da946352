"""Behaviours do what the reference implementation was measured to do: functions, decisions and postings."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from golden_corrections import comparable_function, corrected

from ivp_helm.helm import Trace
from ivp_helm.ivp import IvPFunction
from ivp_helm.testing import HelmRig, Posting

DATA = Path(__file__).parents[1] / "data" / "behaviors"
REPEATED_REASON = re.compile(r"(,pc=[^,]*)\1")
"""The reference lists a failed condition twice; once is enough (behaviors.md B1)."""


def _cases() -> list[Any]:
    found = []
    for path in sorted(DATA.glob("*.json")):
        for case in json.loads(path.read_text())["cases"]:
            case = corrected(case)
            found.append(pytest.param(case, id=f"{case['id']}-{case['behaviour']}-{case['title'][:40]}"))
    return found


CASES = _cases()


class Run:
    """A case, sailed on the bench."""

    def __init__(self, case: dict[str, Any]) -> None:
        helm = case["helm"]
        self.case = case
        self.rig = HelmRig(
            [(b["type"], [(key, value) for key, value in b["params"]]) for b in case["behaviours"]],
            domain=helm["domain"],
            community=helm["ownship"],
            start=helm["start_time"],
            period=helm["period"],
            turn_model=helm["pmgen"] or "",
            initial=dict(helm["initialize"]),
        )
        self.traces: list[Trace] = []
        for step in case["steps"]:
            self._step(step)

    def _step(self, step: dict[str, Any]) -> None:
        if "own" in step:
            self.rig.own(**step["own"])
        if "contacts" in step:
            self.rig.contacts(step["contacts"])
        for variable, value in step.get("mail", []):
            self.rig.mail(variable, value)
        for _ in range(step["iterations"]):
            trace = self.rig.iterate()
            assert trace is not None
            self.traces.append(trace)

    def function(self, name: str) -> IvPFunction | None:
        return next((o.function for life, o in self.traces[-1].rounds if life.name == name), None)


@pytest.fixture(scope="module")
def runs() -> dict[int, Run]:
    return {}


def sail(case: dict[str, Any], runs: dict[int, Run]) -> Run:
    if case["id"] not in runs:
        runs[case["id"]] = Run(case)
    return runs[case["id"]]


def same(found: object, wanted: object) -> bool:
    if isinstance(found, int | float) and isinstance(wanted, int | float):
        return abs(found - wanted) <= 1e-6 * max(1.0, abs(wanted))
    return found == wanted


@pytest.mark.parametrize("case", CASES)
def test_states_weights_and_all_stops_are_those_measured(case: dict[str, Any], runs: dict[int, Run]) -> None:
    run = sail(case, runs)
    for trace, wanted in zip(run.traces, case["trace"], strict=True):
        assert {life.name: outcome.state for life, outcome in trace.rounds} == wanted["states"]
        weights = {life.name: o.function.weight for life, o in trace.rounds if o.function is not None}
        assert weights == pytest.approx(wanted["weights"], rel=1e-4)
        assert trace.reason == wanted["allstop"]


@pytest.mark.parametrize("case", CASES)
def test_the_decision_is_as_good_as_the_measured_one(case: dict[str, Any], runs: dict[int, Run]) -> None:
    run = sail(case, runs)
    for trace, wanted in zip(run.traces, case["trace"], strict=True):
        functions = [o.function for _, o in trace.rounds if o.function is not None]
        if not functions or trace.decision == pytest.approx(wanted["decision"]):
            continue
        assert set(trace.decision) == set(wanted["decision"])
        ours = sum(f.weight * f.value(*(trace.decision[n] for n in f.domain.names)) for f in functions)
        theirs = sum(f.weight * f.value(*(wanted["decision"][n] for n in f.domain.names)) for f in functions)
        assert ours >= theirs - 0.01


@pytest.mark.parametrize("case", [c for c in CASES if c.values[0]["functions"]])
def test_functions_have_the_measured_utilities(case: dict[str, Any], runs: dict[int, Run]) -> None:
    run = sail(case, runs)
    for name, wanted in case["functions"].items():
        function = run.function(name)
        assert function is not None
        function = comparable_function(run.rig.life(name).behavior, function, len(run.traces))
        assert worst_error(function, wanted) <= 0.01


def worst_error(function: IvPFunction, wanted: dict[str, Any]) -> float:
    """Largest difference to the measured utilities."""
    if len(wanted["variables"]) == 1:
        return float(np.max(np.abs(function.table() - np.array(wanted["utility"]))))
    order = [wanted["variables"].index(name) for name in function.domain.names]
    points = np.array([sample[:-1] for sample in wanted["sample"]])
    utilities = np.array([sample[-1] for sample in wanted["sample"]])
    grids = np.meshgrid(*wanted["axes"], indexing="ij")
    points = np.vstack([points, np.stack([g.ravel() for g in grids], axis=1)])
    utilities = np.concatenate([utilities, np.array(wanted["utility"]).ravel()])
    indexes = [function.domain.index_of(point) for point in points[:, order]]
    return float(np.max(np.abs(function.evaluate(indexes) - utilities)))


@pytest.mark.parametrize("case", CASES)
def test_postings_are_those_measured_in_the_measured_order(
    case: dict[str, Any], runs: dict[int, Run]
) -> None:
    run = sail(case, runs)
    wanted, found = case["postings"], run.rig.postings
    for ours, theirs in zip(found, wanted, strict=False):
        assert_same_posting(ours, theirs)
    assert len(found) == len(wanted)


def assert_same_posting(ours: Posting, theirs: list[Any]) -> None:
    iteration, behavior, variable, value = theirs
    if variable == "BHV_STATUS":
        value = REPEATED_REASON.sub(r"\1", value)
    assert (ours.iteration, ours.behavior, ours.variable) == (iteration, behavior, variable)
    assert same(ours.value, value), f"{variable}: {ours.value!r} is not {value!r}"
