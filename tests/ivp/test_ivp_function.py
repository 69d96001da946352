"""Piecewise functions: evaluation against the obvious, immutability, ranges, and refusals."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ivp_helm.ivp import Domain, IvPError, IvPFunction, Peak, constant, couple, zaic_peak
from ivp_helm.ivp import testing as ivp

HELM = Domain.parse("course,0,359,360:speed,0,4,21")
SMALL = Domain.parse("x,0,9,10:y,0,4,5")
Problem = tuple[Domain, list[IvPFunction]]


def slow_value(f: IvPFunction, point: tuple[int, ...]) -> float:
    """The first piece that covers the point, looked for one after the other."""
    for low, high, coef in zip(f.low, f.high, f.coefficients, strict=True):
        if all(a <= x <= b for a, x, b in zip(low, point, high, strict=True)):
            return float(coef[-1] + sum(c * x for c, x in zip(coef, point, strict=False)))
    return math.nan


@given(ivp.problems(max_variables=3, max_functions=1, max_pieces=8))
@settings(max_examples=60, deadline=None)
def test_the_table_holds_what_the_first_covering_piece_says(problem: Problem) -> None:
    f = problem[1][0]
    points = list(np.ndindex(f.domain.points))
    expected = [slow_value(f, p) for p in points]
    np.testing.assert_allclose(f.table().ravel(), expected, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(f.evaluate(points), expected, rtol=1e-12, atol=1e-12)
    gaps, overlaps = f.coverage()
    assert gaps == sum(math.isnan(v) for v in expected)
    covers = [sum(all(a <= x <= b for a, x, b in zip(*z, strict=True)) for z in boxes(f, p)) for p in points]
    assert overlaps == sum(c > 1 for c in covers)
    assert f.is_partition == (set(covers) == {1})
    assert f.has_overlaps == (max(covers) > 1)


def boxes(f: IvPFunction, point: tuple[int, ...]) -> list[tuple[Any, ...]]:
    return [(low, point, high) for low, high in zip(f.low, f.high, strict=True)]


@given(ivp.problems(max_variables=3, max_functions=1), st.floats(-50, 50), st.floats(0.1, 300))
@settings(max_examples=60, deadline=None)
def test_stretching_and_shifting_act_on_every_value(problem: Problem, base: float, extent: float) -> None:
    f = problem[1][0]
    table = f.table()
    np.testing.assert_allclose(f.shifted(base).table(), table + base, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(f.scaled(extent).table(), table * extent, rtol=1e-9, atol=1e-9)
    g = f.normalised(base, extent)
    if f.maximum > f.minimum:
        expected = base + (table - f.minimum) * extent / (f.maximum - f.minimum)
        np.testing.assert_allclose(g.table(), expected, rtol=1e-9, atol=1e-6)
        assert (g.minimum, g.maximum) == (pytest.approx(base, abs=1e-9), pytest.approx(base + extent))
    else:
        np.testing.assert_array_equal(g.table(), table)


@given(ivp.problems(max_variables=3, max_functions=1))
@settings(max_examples=60, deadline=None)
def test_a_function_on_a_larger_domain_is_flat_in_what_it_lacked(problem: Problem) -> None:
    domain, (f,) = problem
    wide = f.expanded(domain)
    assert wide.domain is domain
    order = [f.domain.names.index(n) for n in domain.names if n in f.domain]
    shape = [p if n in f.domain else 1 for n, p in zip(domain.names, domain.points, strict=True)]
    expected = np.broadcast_to(f.table().transpose(order).reshape(shape), domain.points)
    np.testing.assert_allclose(wide.table(), expected, rtol=1e-12, atol=1e-12)
    assert (wide.minimum, wide.maximum, wide.weight) == (f.minimum, f.maximum, f.weight)


def test_a_function_cannot_be_changed_from_outside() -> None:
    low, high, coef = np.array([[0, 0]]), np.array([[9, 4]]), np.array([[1.0, 2.0, 3.0]])
    f = IvPFunction(SMALL, low, high, coef)
    low[0, 0], coef[0, 0] = 5, 99.0
    assert f.value(1, 1) == 1 + 2 + 3
    for array in (f.low, f.high, f.coefficients):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1


def test_weights_and_contexts_make_new_functions_that_share_their_pieces() -> None:
    f = constant(SMALL, 1.0)
    g = f.weighted(100, "7:waypt").gridded((5, 5))
    assert (f.weight, f.context, f.grid) == (10.0, "", (10, 5))
    assert (g.weight, g.context, g.grid) == (100.0, "7:waypt", (5, 5))
    assert g.labelled("8:waypt").weight == 100.0
    assert np.shares_memory(f.low, g.low)


def test_the_docs_example_has_the_stated_value() -> None:
    f = IvPFunction(
        SMALL, [[6, 3], [0, 3], [6, 0], [0, 0]], [[9, 4], [5, 4], [9, 2], [5, 2]], [[0.5, -0.25, 40.0]] * 4
    )
    assert f.evaluate([7, 4]).tolist() == [42.5]
    assert f.value(7, 4) == 42.5
    assert f.is_partition


def test_exclusive_bounds_move_inwards_and_empty_pieces_vanish() -> None:
    x = SMALL.subdomain("x")
    f = IvPFunction(
        x,
        [[0], [4], [6]],
        [[4], [4], [9]],
        [[1.0], [2.0], [3.0]],
        low_open=[[False], [True], [True]],
        high_open=[[True], [False], [False]],
    )
    assert f.low.tolist() == [[0], [7]]
    assert f.high.tolist() == [[3], [9]]


def test_copies_survive_pickling_and_deep_copying() -> None:
    f = couple(
        zaic_peak(HELM, "course", Peak(90, basewidth=60), wrap=True), zaic_peak(HELM, "speed", Peak(2))
    ).weighted(33.5, "1:a")
    for g in (pickle.loads(pickle.dumps(f)), copy.deepcopy(f)):
        np.testing.assert_array_equal(g.table(), f.table())
        assert (g.domain, g.weight, g.context, g.grid, g.degree) == (f.domain, 33.5, "1:a", f.grid, f.degree)


@pytest.mark.parametrize(
    ("low", "high", "coef", "options", "words"),
    [
        ([], [], [], {}, "no pieces"),
        ([[0, 0]], [[10, 4]], [[1.0]], {}, "bounds 0 to 10 in 'x'; expected 0 <= low <= high <= 9"),
        ([[0, 3]], [[9, 2]], [[1.0]], {}, "bounds 3 to 2 in 'y'"),
        ([[-1, 0]], [[9, 4]], [[1.0]], {}, "bounds -1 to 9"),
        ([[0, 0]], [[9, 4]], [[math.nan]], {}, "not finite"),
        ([[0, 0]], [[9, 4]], [[math.inf, 0, 0]], {}, "not finite"),
        ([[0, 0]], [[9, 4]], [[1e308, 1e308, 0]], {}, "not finite"),
        ([[0, 0]], [[9, 4]], [[1.0, 2.0]], {}, "coefficients have shape"),
        ([[0, 0]], [[9, 4], [9, 4]], [[1.0]], {}, "1 lower, 2 upper"),
        ([[0.5, 0]], [[9, 4]], [[1.0]], {}, "whole numbers"),
        ([[0]], [[9]], [[1.0]], {}, "shape"),
        ([[0, 0]], [[9, 4]], [[1.0]], {"weight": math.nan}, "not a finite number"),
        ([[0, 0]], [[9, 4]], [[1.0]], {"weight": math.inf}, "not a finite number"),
        ([[0, 0]], [[9, 4]], [[1.0]], {"grid": (11, 5)}, "grid edge 11"),
        ([[0, 0]], [[0, 4]], [[1.0]], {"low_open": [[True, False]]}, "every piece empty"),
    ],
)
def test_unsound_pieces_are_refused(low: Any, high: Any, coef: Any, options: Any, words: str) -> None:
    with pytest.raises(IvPError, match=words):
        IvPFunction(SMALL, low, high, coef, **options)


def test_wrong_uses_are_refused() -> None:
    f = constant(SMALL, 1.0)
    for call, words in (
        (lambda: f.weighted(math.inf), "not a finite number"),
        (lambda: f.scaled(0), "positive"),
        (lambda: f.normalised(0, -1), "normalise"),
        (lambda: f.evaluate([1, 2, 3]), "shape"),
        (lambda: f.value(1), "2 values"),
        (lambda: f.expanded(SMALL.subdomain("x")), "'y' not in domain"),
        (lambda: f.expanded(Domain.parse("x,0,9,19:y,0,4,5")), "'x' is x,0,9,10, but x,0,9,19"),
    ):
        with pytest.raises(IvPError, match=words):
            call()


def test_overlaps_in_a_domain_too_large_to_count_are_found_piece_by_piece() -> None:
    domain = Domain.parse("x,0,9999,10000:y,0,9999,10000")
    apart = IvPFunction(domain, [[0, 0], [50, 0]], [[49, 99], [99, 99]], [[1.0], [2.0]])
    crossed = IvPFunction(domain, [[0, 0], [49, 99]], [[49, 99], [99, 200]], [[1.0], [2.0]])
    assert not apart.has_overlaps
    assert crossed.has_overlaps
