"""Behaviours about another vessel do what the reference implementation was measured to do."""

from __future__ import annotations

import json
import re
from math import cos, radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_golden_behaviors import Run, assert_same_posting, worst_error

from ivp_helm.testing import Posting

DATA = Path(__file__).parents[1] / "data" / "contact_behaviors"
PIECES = re.compile(r",pcs=\d+")


OBSTACLE_WEIGHTS = {142: 62.5, 144: 100.0 * cos(radians(25.0)), 150: 50.0}
"""A course that hits the obstacle has its full weight (C8); the heading of case 144 misses it by 25 degrees."""


def obstacle_corrected(case: dict[str, Any], wanted: list[Any], weight: float) -> list[Any]:
    """What the case would have been with that weight, and with courses that lead away from near by (C8)."""
    for entry in case["trace"][1:]:
        if "bhv" in entry["weights"] or entry["allstop"] == "BehaviorError":
            entry.update(states={"bhv": "active"}, weights={"bhv": weight}, allstop="clear")
    errors = [k for k, p in enumerate(wanted) if p[2] == "BHV_ERROR"]
    if errors:  # neither error nor erasing, nor drawing again
        status = next(p for p in wanted if p[0] == 2 and p[2] == "BHV_STATUS")
        wanted = [*wanted[: errors[0]], status]
    for posting in wanted:
        if posting[2] == "BHV_STATUS" and posting[0] == 2:
            posting[3] = f"name=bhv,pwt={weight:.5f},state=active,updates=n/a"
    return wanted


def corrected(case: dict[str, Any]) -> dict[str, Any]:
    """The case without the reference's faults and without its number of pieces, which we need not match."""
    parameters = dict(case["behaviours"][0]["params"])
    kind = case["behaviour"]
    wanted = [list(p) for p in case["postings"] if len(p) < 5 and p[2] != "AVD_DEBUG"]
    if kind == "BHV_CutRange" and "giveup_range" not in parameters:
        # Without a range at which to give up it never gives up, instead of never beginning (C11).
        for entry in case["trace"][1:]:
            entry.update(states={"bhv": "active"}, weights={"bhv": 65.13878189}, allstop="clear")
            entry["decision"] = {"course": 56, "speed": 5}
        wanted[-1][3] = "name=bhv,pwt=65.13878,state=active,updates=n/a"
    if case["id"] in OBSTACLE_WEIGHTS:
        wanted = obstacle_corrected(case, wanted, OBSTACLE_WEIGHTS[case["id"]])
    pwt = float(parameters["pwt"])
    for entry in case["trace"]:
        for name, weight in entry["weights"].items():
            # AvoidCollision weighs no more than pwt (C6), and Convoy weighs pwt instead of 10 (C13).
            entry["weights"][name] = pwt if kind == "BHV_Convoy" else min(weight, pwt)
    for posting in wanted:
        if posting[2] == "BHV_STATUS":
            text = PIECES.sub("", posting[3])
            posting[3] = re.sub(r"pwt=[0-9.]+", lambda m: status_weight(m[0], kind, pwt), text)
    case["postings"] = wanted
    return case


def news(postings: list[Any]) -> list[Any]:
    """Postings without statuses that differ from the last one in nothing but the pieces."""
    told = ""
    kept = []
    for posting in postings:
        _, _, variable, value = posting
        if variable != "BHV_STATUS" or value != told:
            kept.append(posting)
        if variable == "BHV_STATUS":
            told = value
    return kept


def status_weight(text: str, kind: str, pwt: float) -> str:
    weight = pwt if kind == "BHV_Convoy" else min(float(text[4:]), pwt)
    return f"pwt={weight:.5f}"


def _cases() -> list[Any]:
    found = []
    for path in sorted(DATA.glob("*.json")):
        for case in json.loads(path.read_text())["cases"]:
            found.append(
                pytest.param(corrected(case), id=f"{case['id']}-{case['behaviour']}-{case['title'][:40]}")
            )
    return found


CASES = _cases()
SAMPLED = [c for c in CASES if any("exact" in f for f in c.values[0]["functions"].values())]
BUILT = [c for c in CASES if c.values[0]["functions"] and "collision_depth" not in c.values[0]["title"]]


@pytest.fixture(scope="module")
def runs() -> dict[int, Run]:
    return {}


def sail(case: dict[str, Any], runs: dict[int, Run]) -> Run:
    if case["id"] not in runs:
        runs[case["id"]] = Run(case)
    return runs[case["id"]]


def bare(posting: Posting) -> list[Any]:
    value = posting.value
    if posting.variable == "BHV_STATUS":
        value = PIECES.sub("", str(value))
    return [posting.iteration, posting.behavior, posting.variable, value]


@pytest.mark.parametrize("case", CASES)
def test_states_weights_and_all_stops_are_those_measured(case, runs):
    run = sail(case, runs)
    for trace, wanted in zip(run.traces, case["trace"], strict=True):
        assert {life.name: outcome.state for life, outcome in trace.rounds} == wanted["states"]
        weights = {life.name: o.function.weight for life, o in trace.rounds if o.function is not None}
        assert weights == pytest.approx(wanted["weights"], rel=1e-4)
        assert trace.reason == wanted["allstop"]


@pytest.mark.parametrize("case", CASES)
def test_postings_are_those_measured_in_the_measured_order(case, runs):
    found = news([bare(posting) for posting in sail(case, runs).rig.postings])
    wanted = news(case["postings"])
    for ours, theirs in zip(found, wanted, strict=False):
        assert_same_posting(Posting(*ours), theirs)
    assert len(found) == len(wanted)


@pytest.mark.parametrize("case", BUILT)
def test_functions_have_the_measured_utilities(case, runs):
    run = sail(case, runs)
    for name, wanted in case["functions"].items():
        function = run.function(name)
        assert function is not None
        assert worst_error(function, wanted) <= 0.01


@pytest.mark.parametrize("case", BUILT)
def test_decisions_are_as_good_as_those_measured(case, runs):
    run = sail(case, runs)
    functions = [run.function(name) for name in case["functions"]]
    ours, theirs = run.traces[-1].decision, case["trace"][-1]["decision"]
    if len(functions) == 1 and case["functions"]["bhv"]["argmax_count"] == 1:
        assert ours == pytest.approx(theirs)
    assert sum(f.weight * f.value(*ours.values()) for f in functions) >= sum(
        f.weight * (f.value(*theirs.values()) - 0.01) for f in functions
    )


def exact_table(run: Run) -> np.ndarray:
    """The behaviour's utilities before they became a function, stretched to 0..100."""
    behavior = run.rig.life("bhv").behavior
    table = behavior.utilities(behavior.meeting)
    least, most = table.min(), table.max()
    return (table - least) / (most - least) * 100.0


@pytest.mark.parametrize("case", [c for c in SAMPLED if c.values[0]["behaviour"] == "BHV_AvoidCollision"])
def test_the_exact_utility_is_the_one_measured(case, runs):
    run = sail(case, runs)
    wanted = case["functions"]["bhv"]
    table = exact_table(run)
    domain = run.rig.core.domain
    wrong = points = 0
    for course, row in zip(wanted["axes"][0], wanted["exact"]["utility"], strict=True):
        for speed, utility in zip(wanted["axes"][1], row, strict=True):
            points += 1
            wrong += abs(table[domain.index_of((course, speed))] - utility) > 0.05
    assert wrong <= 0.002 * points


@pytest.mark.parametrize("case", [c for c in CASES if "collision_depth" in c.values[0]["title"]])
def test_the_depth_variant_is_near_the_reference_and_as_good_at_its_decision(case, runs):
    run = sail(case, runs)
    wanted = case["functions"]["bhv"]
    function = run.function("bhv")
    order = [wanted["variables"].index(name) for name in function.domain.names]
    points = np.array([sample[:-1] for sample in wanted["sample"]])[:, order]
    found = function.evaluate([function.domain.index_of(point) for point in points])
    # The reference has 180 pieces above the collision depth, so it is coarse at edges.
    assert np.median(np.abs(found - [sample[-1] for sample in wanted["sample"]])) < 0.5
    theirs = case["trace"][-1]["decision"]
    ours = run.traces[-1].decision
    assert function.value(*ours.values()) >= function.value(*theirs.values()) - 1e-9
