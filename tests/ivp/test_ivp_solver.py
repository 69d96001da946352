"""The solver: the reference's problems, certificates by exhaustive search, ties, bounds and refusals."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ivp_helm.ivp import (
    Domain,
    IvPError,
    IvPFunction,
    Peak,
    Solution,
    Status,
    constant,
    decision_domain,
    decode,
    solve,
    solve_exhaustive,
    zaic_peak,
)
from ivp_helm.ivp import testing as ivp

DATA = Path(__file__).parents[1] / "data" / "ivp"
PROBLEMS = json.loads((DATA / "problems.json").read_text())["cases"]
HELM = Domain.parse("course,0,359,360:speed,0,4,21:depth,0,100,26")
Problem = tuple[Domain, list[IvPFunction]]


@pytest.mark.parametrize("case", PROBLEMS, ids=lambda c: c["id"])
def test_the_optimum_of_every_measured_problem_is_found(case: dict[str, Any]) -> None:
    domain = Domain.parse(case["domain"])
    functions = [decode(text) for text in case["functions"]]
    brute = case["brute"]
    for method in ("auto", "search"):
        s = solve(domain, functions, method=method)  # type: ignore[arg-type]
        assert s.optimal
        assert s.value == pytest.approx(brute["value"], rel=1e-6, abs=1e-6)
        if brute["optima_count"] <= 8:
            assert list(s.indexes) in brute["optima_index"]


def brute_force(domain: Domain, functions: list[IvPFunction]) -> float:
    """The slow and obvious twin: every point, every function, one at a time."""
    taken = [f for f in functions if f.weight > 0]
    return max(ivp.value_at(taken, domain, point) for point in np.ndindex(domain.points))


@given(ivp.problems(max_variables=2, max_functions=3, max_pieces=6))
@settings(max_examples=25, deadline=None)
def test_the_exhaustive_solver_agrees_with_adding_up_point_by_point(problem: Problem) -> None:
    domain, functions = problem
    s = solve_exhaustive(domain, functions)
    if s.status is Status.EMPTY:
        assert not any(f.weight > 0 for f in functions)
    else:
        assert s.value == pytest.approx(brute_force(domain, functions), rel=1e-12, abs=1e-9)


@given(ivp.problems(), st.sampled_from(["auto", "sweep", "search"]))
@settings(max_examples=300, deadline=None)
def test_a_solution_holds_against_exhaustive_search_whatever_the_method(
    problem: Problem, method: Any
) -> None:
    domain, functions = problem
    ivp.certify(solve(domain, functions, method=method), domain, functions)


@given(ivp.problems(), st.randoms())
@settings(max_examples=150, deadline=None)
def test_the_order_of_the_functions_does_not_matter(problem: Problem, random: Any) -> None:
    domain, functions = problem
    first = solve(domain, functions, method="search")
    random.shuffle(functions)
    second = solve(domain, functions, method="search")
    assert second.indexes == first.indexes
    assert second.status is first.status
    assert second.value == pytest.approx(first.value, rel=1e-12, abs=1e-9)


@given(ivp.problems(), st.floats(-1e3, 1e3), st.floats(0.1, 200))
@settings(max_examples=100, deadline=None)
def test_adding_a_constant_function_changes_no_decision(
    problem: Problem, level: float, weight: float
) -> None:
    domain, functions = problem
    before = solve(domain, functions)
    if before.status is Status.EMPTY:
        return
    flat = constant(domain, level).weighted(weight)
    after = solve(domain, [*functions, flat])
    assert after.indexes == before.indexes
    if before.found:
        assert after.value == pytest.approx(before.value + weight * level, rel=1e-9, abs=1e-6)


@given(ivp.problems(), st.integers(1, 60))
@settings(max_examples=100, deadline=None)
def test_a_search_cut_short_still_gives_valid_bounds(problem: Problem, budget: int) -> None:
    domain, functions = problem
    ivp.certify(solve(domain, functions, method="search", max_nodes=budget), domain, functions)


def test_a_search_cut_short_says_so() -> None:
    case = next(c for c in PROBLEMS if c["id"] == 2)
    domain = Domain.parse(case["domain"])
    functions = [decode(text) for text in case["functions"]]
    s = solve(domain, functions, max_nodes=10)
    assert s.status is Status.STOPPED
    assert not s.optimal
    assert s.bound >= case["brute"]["value"]


@given(ivp.problems())
@settings(max_examples=50, deadline=None)
def test_solving_changes_no_function_and_repeats_itself(problem: Problem) -> None:
    domain, functions = problem
    before = [(f.low.tolist(), f.high.tolist(), f.coefficients.tolist(), f.weight) for f in functions]
    first = solve(domain, functions)
    assert solve(domain, functions) == first
    after = [(f.low.tolist(), f.high.tolist(), f.coefficients.tolist(), f.weight) for f in functions]
    assert after == before


@given(ivp.problems(max_variables=6, max_functions=4, max_pieces=5))
@settings(max_examples=60, deadline=None)
def test_more_variables_than_the_cells_have_axes_are_searched_too(problem: Problem) -> None:
    domain, functions = problem
    ivp.certify(solve(domain, functions, method="search"), domain, functions)


class TestTies:
    def test_a_flat_function_comes_out_at_the_high_end(self) -> None:
        s = solve(HELM, [constant(HELM, 5.0)])
        assert s.decision == (359.0, 4.0, 100.0)

    def test_a_variable_nobody_is_over_comes_out_at_its_high_end(self) -> None:
        s = solve(HELM, [zaic_peak(HELM, "course", Peak(90, basewidth=20))])
        assert s.decision == (90.0, 4.0, 100.0)
        assert s.as_dict() == {"course": 90.0, "speed": 4.0, "depth": 100.0}

    @pytest.mark.parametrize("method", ["sweep", "search"])
    def test_among_equal_points_the_greatest_indexes_win(self, method: Any) -> None:
        domain = Domain.parse("x,0,9,10:y,0,9,10")
        # two plateaus of the same height; the earlier variable decides
        f = IvPFunction(domain, [[2, 7], [5, 0], [0, 0]], [[3, 9], [6, 1], [9, 9]], [[8.0], [8.0], [1.0]])
        s = solve(domain, [f, f.weighted(3)], method=method)
        assert s.indexes == (6, 1)
        assert s == solve_exhaustive(domain, [f, f.weighted(3)])._replace(nodes=s.nodes)

    def test_a_tie_that_only_rounding_breaks_is_still_a_tie(self) -> None:
        domain = Domain.parse("x,0,359,360")
        third = IvPFunction(domain, [[0]], [[359]], [[1 / 3, 0.1]], weight=0.7)
        back = IvPFunction(domain, [[0]], [[359]], [[-1 / 3, 77.0]], weight=0.7)
        for order in ([third, back], [back, third]):
            for method in ("sweep", "search"):
                assert solve(domain, order, method=method).indexes == (359,)  # type: ignore[arg-type]


class TestDegenerate:
    def test_no_function_or_no_weight_gives_no_decision(self) -> None:
        flat = constant(HELM, 1.0)
        for functions in ([], [flat.weighted(0)], [flat.weighted(-3)]):
            s = solve(HELM, functions)
            assert (s.status, s.decision, s.found) == (Status.EMPTY, (), False)
            assert s.as_dict() == {}

    @pytest.mark.parametrize("method", ["sweep", "search"])
    def test_functions_without_a_common_point_have_no_decision(self, method: Any) -> None:
        domain = Domain.parse("x,0,9,10:y,0,3,4")
        left = IvPFunction(domain, [[0, 0]], [[4, 3]], [[1.0]])
        right = IvPFunction(domain.subdomain("x"), [[5]], [[9]], [[1.0]])
        s = solve(domain, [left, right], method=method)
        assert s.status is Status.INFEASIBLE
        assert not s.found
        assert s.value == -math.inf

    def test_an_exclusive_bound_is_not_reachable(self) -> None:
        domain = Domain.parse("x,0,9,10")
        f = IvPFunction(domain, [[0]], [[9]], [[1.0, 0.0]], high_open=[[True]])
        assert solve(domain, [f]).indexes == (8,)
        assert f.coverage() == (1, 0)

    def test_where_pieces_overlap_the_first_in_stored_order_counts(self) -> None:
        domain = Domain.parse("x,0,9,10")
        f = IvPFunction(domain, [[4], [0]], [[6], [9]], [[1.0], [3.0]])
        g = zaic_peak(domain, "x", Peak(5, basewidth=3))
        s = solve(domain, [f.weighted(100), g.weighted(1)])
        assert s.indexes == (7,)
        ivp.certify(s, domain, [f.weighted(100), g.weighted(1)])

    def test_a_range_above_a_hundred_is_stretched_to_a_hundred_and_a_smaller_one_is_kept(self) -> None:
        domain = Domain.parse("x,0,9,10")
        wide = IvPFunction(domain, [[0]], [[9]], [[100.0, -300.0]], weight=2)
        narrow = IvPFunction(domain, [[0]], [[9]], [[2.0, 40.0]], weight=2)
        assert solve(domain, [wide]).value == pytest.approx(200)
        assert solve(domain, [narrow]).value == pytest.approx(2 * 58)


class TestRefusals:
    def test_an_unknown_variable_is_named_with_its_function(self) -> None:
        f = constant(Domain.parse("pitch,0,1,2"), 1.0, context="7:dive")
        with pytest.raises(IvPError, match=r"'7:dive': variable 'pitch' not in domain course"):
            solve(HELM, [f])

    def test_a_variable_of_another_resolution_is_refused(self) -> None:
        f = constant(Domain.parse("speed,0,4,41"), 1.0)
        with pytest.raises(IvPError, match=r"'speed' is speed,0,4,41, but speed,0,4,21"):
            solve(HELM, [f])

    def test_a_domain_too_large_to_tabulate_is_refused_by_the_exhaustive_solver_only(self) -> None:
        domain = Domain.parse("x,0,9999,10000:y,0,9999,10000")
        with pytest.raises(IvPError, match="too many"):
            solve_exhaustive(domain, [constant(domain, 1.0)])
        assert solve(domain, [constant(domain, 1.0)]).indexes == (9999, 9999)

    def test_an_unknown_method_is_refused(self) -> None:
        with pytest.raises(IvPError, match="no solving method 'magic'"):
            solve(HELM, [constant(HELM, 1.0)], method="magic")  # type: ignore[arg-type]


class TestDecisionDomain:
    def test_it_is_the_whole_domain_when_every_variable_occurs(self) -> None:
        parts = [constant(HELM.subdomain(n), 1.0) for n in ("depth", "speed", "course")]
        assert decision_domain(HELM, parts) is HELM

    def test_otherwise_the_variables_come_in_order_of_first_appearance(self) -> None:
        parts = [constant(HELM.subdomain(n), 1.0) for n in ("speed", "speed", "course")]
        assert decision_domain(HELM, parts).names == ("speed", "course")


def test_many_functions_and_threads_share_no_workspace() -> None:
    from concurrent.futures import ThreadPoolExecutor

    domain = Domain.parse("course,0,359,360:speed,0,4,21")

    def one(i: int) -> Solution:
        functions = [
            zaic_peak(domain, "course", Peak(i, basewidth=90), wrap=True).weighted(1 + j) for j in range(40)
        ]
        return solve(domain, functions, method="search")

    with ThreadPoolExecutor(4) as pool:
        decisions = [s.decision[0] for s in pool.map(one, range(0, 360, 7))]
    assert decisions == [float(i) for i in range(0, 360, 7)]


@given(st.integers(1, 2**31), st.integers(66_000, 150_000))
@settings(max_examples=15, deadline=None)
def test_a_variable_of_many_points_is_searched_exactly(seed: int, points: int) -> None:
    rng = np.random.default_rng(seed)
    domain = Domain.parse(f"x,0,{points - 1},{points}")
    functions = []
    for _ in range(3):
        cuts = np.unique(rng.integers(0, points, rng.integers(1, 40)))
        low, high = np.concatenate(([0], cuts + 1)), np.concatenate((cuts, [points - 1]))
        keep = low <= high
        low, high = low[keep], high[keep]
        slopes = rng.normal(size=len(low)) / points
        coef = np.column_stack((slopes, rng.uniform(0, 50, len(low))))
        functions.append(IvPFunction(domain, low[:, None], high[:, None], coef))
    s = solve(domain, functions, method="search")
    oracle = solve_exhaustive(domain, functions)
    assert s.indexes == oracle.indexes
    assert s.value == pytest.approx(oracle.value, rel=1e-12)
    ivp.certify(s, domain, functions)
