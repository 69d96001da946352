"""Checks and random inputs for testing interval programming, ours or yours.

`certify` and `check_function` need nothing but numpy; they raise `AssertionError` with a sentence that
says what does not hold. The strategies need hypothesis, which is imported when the first is called:

    from hypothesis import given
    from ivp_helm.ivp import solve
    from ivp_helm.ivp.testing import certify, problems

    @given(problems())
    def test_my_function_beside_any_others(problem):
        domain, functions = problem
        functions.append(my_function(domain))
        certify(solve(domain, functions), domain, functions)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ivp_helm.ivp.domain import Domain, Variable
from ivp_helm.ivp.errors import IvPError
from ivp_helm.ivp.function import IvPFunction
from ivp_helm.ivp.solver import Solution, Status, solve_exhaustive

if TYPE_CHECKING:
    from hypothesis.strategies import SearchStrategy

RELATIVE: Final = 1e-9  # two values this close, relative to the functions' magnitudes, count as equal


def value_at(functions: Sequence[IvPFunction], domain: Domain, indexes: Sequence[int]) -> float:
    """The objective of ivp_math.md 8.1 at one index point, function by function; -inf if infeasible."""
    total = 0.0
    for f in functions:
        if f.weight <= 0:
            continue
        at = [indexes[domain.position(name)] for name in f.domain.names]
        value = float(f.evaluate([at])[0])
        if math.isnan(value):
            return -math.inf
        if f.maximum - f.minimum > 100.0:
            value = (value - f.minimum) * 100.0 / (f.maximum - f.minimum)
        total += f.weight * value
    return total


def certify(solution: Solution, domain: Domain, functions: Sequence[IvPFunction]) -> None:
    """Assert that a solution is what it says: feasible, of that value, and (if optimal) unbeaten anywhere.

    Compares with `solve_exhaustive`, so the domain must have fewer than 50 million points.
    """
    taken = [f for f in functions if f.weight > 0]
    oracle = solve_exhaustive(domain, functions)
    scale = 1.0 + sum(f.weight * max(abs(f.minimum), abs(f.maximum)) for f in taken)
    if solution.status in (Status.INFEASIBLE, Status.EMPTY):
        assert oracle.status is solution.status, (
            f"{solution.status}, but {oracle.status} by exhaustive search"
        )
        assert not solution.found, f"a decision {solution.decision} in spite of {solution.status}"
        return
    assert solution.bound >= oracle.value - RELATIVE * scale, f"bound {solution.bound} below {oracle.value}"
    if not solution.found:
        assert solution.status is Status.STOPPED, f"no decision, yet {solution.status}"
        return
    assert oracle.found, f"decision {solution.decision}, but exhaustive search finds no feasible point"
    snapped = domain.value_of(solution.indexes)
    assert solution.decision == snapped, f"decision {solution.decision} is not at indexes {solution.indexes}"
    actual = value_at(taken, domain, solution.indexes)
    assert abs(actual - solution.value) <= RELATIVE * scale, (
        f"value {solution.value}, but the functions add up to {actual}"
    )
    assert solution.value <= solution.bound + RELATIVE * scale, f"value above bound: {solution}"
    if solution.optimal:
        assert abs(solution.value - oracle.value) <= RELATIVE * scale, (
            f"value {solution.value} at {solution.indexes}, but {oracle.value} at {oracle.indexes}"
        )


def check_function(f: IvPFunction, low: float = 0.0, high: float = 100.0) -> None:
    """Assert that a built function suits a helm: finite, gap-free, without overlaps, within low..high."""
    table = f.table()
    slack = RELATIVE * (1.0 + max(abs(low), abs(high)))
    gaps, overlaps = f.coverage()
    assert gaps == 0, f"{f!r}: {gaps} of {f.domain.size} points are not covered (infeasible)"
    assert overlaps == 0, f"{f!r}: {overlaps} points are covered more than once"
    assert np.isfinite(table).all(), f"{f!r}: a value is not finite"
    assert low - slack <= table.min(), f"{f!r}: value {table.min()} below {low}"
    assert table.max() <= high + slack, f"{f!r}: value {table.max()} above {high}"
    assert table.min() >= f.minimum - slack, f"{f!r}: value {table.min()} below its stated minimum"
    assert table.max() <= f.maximum + slack, f"{f!r}: value {table.max()} above its stated maximum"


def check_builder(build: Callable[..., IvPFunction], *arguments: Any, **options: Any) -> None:
    """Assert that a builder repeats itself, and that what it builds passes `check_function`."""
    first, second = build(*arguments, **options), build(*arguments, **options)
    check_function(first, first.minimum, first.maximum)
    same = np.array_equal(first.table(), second.table()) and np.array_equal(first.low, second.low)
    assert same, f"{first!r}: built twice from the same arguments, two functions come out"


# -- random inputs -----------------------------------------------------------------------------------


def domains(max_variables: int = 4, max_points: int = 40) -> SearchStrategy[Domain]:
    """Hypothesis strategy: small domains of 1 to `max_variables` variables named a, b, c, ..."""
    from hypothesis import strategies as st

    @st.composite
    def build(draw: Any) -> Domain:
        count = draw(st.integers(1, max_variables))
        most = (max_points, max_points, 14, 8)[min(count, 4) - 1]
        variables = []
        for name in "abcdefgh"[:count]:
            points = draw(st.integers(1, min(most, max_points)))
            low = float(draw(st.integers(-3, 3)))
            step = draw(st.sampled_from([1.0, 0.25, 0.2]))
            variables.append(Variable(name, low, round(low + step * (points - 1), 5), points))
        return Domain(variables)

    return build()


def functions(
    domain: Domain,
    *,
    gaps: bool = True,
    overlaps: bool = True,
    max_pieces: int = 12,
    weights: Sequence[float] = (100.0, 50.0, 1.0, 0.37, 123.4, 0.0, -5.0),
) -> SearchStrategy[IvPFunction]:
    """Hypothesis strategy: functions of degree 0 or 1 over some variables of `domain`, in any order.

    Pieces come from cutting the whole again and again, down to single points; then some may be dropped
    (`gaps`) and some added (`overlaps`). Slopes are small whole numbers, so ties are frequent.
    """
    from hypothesis import strategies as st

    @st.composite
    def build(draw: Any) -> IvPFunction:
        names = draw(st.permutations(domain.names))
        scope = domain.subdomain(tuple(names[: draw(st.integers(1, len(names)))]))
        dims = len(scope)
        boxes = [([0] * dims, [p - 1 for p in scope.points])]
        for _ in range(draw(st.integers(0, max_pieces - 1))):
            i = draw(st.integers(0, len(boxes) - 1))
            d = draw(st.integers(0, dims - 1))
            low, high = boxes[i]
            if low[d] < high[d]:
                cut = draw(st.integers(low[d], high[d] - 1))
                boxes[i] = (low, [*high[:d], cut, *high[d + 1 :]])
                boxes.append(([*low[:d], cut + 1, *low[d + 1 :]], high))
        if gaps and len(boxes) > 1 and draw(st.booleans()):
            boxes.pop(draw(st.integers(0, len(boxes) - 1)))
        if overlaps and draw(st.booleans()):
            low = [draw(st.integers(0, p - 1)) for p in scope.points]
            high = [draw(st.integers(a, p - 1)) for a, p in zip(low, scope.points, strict=True)]
            boxes.insert(draw(st.integers(0, len(boxes))), (low, high))
        degree = draw(st.integers(0, 1))
        number = st.integers(-4, 4) | st.floats(-50, 50, allow_nan=False).map(lambda x: round(x, 2))
        width = degree * dims + 1
        rows = [draw(st.lists(number, min_size=width, max_size=width)) for _ in boxes]
        return IvPFunction(
            scope,
            [b[0] for b in boxes],
            [b[1] for b in boxes],
            rows,
            weight=draw(st.sampled_from(weights)),
        )

    return build()


def problems(
    max_variables: int = 4, max_functions: int = 5, **options: Any
) -> SearchStrategy[tuple[Domain, list[IvPFunction]]]:
    """Hypothesis strategy: a domain and a list of functions over it; `options` as for `functions`."""
    from hypothesis import strategies as st

    def with_functions(domain: Domain) -> SearchStrategy[tuple[Domain, list[IvPFunction]]]:
        lists = st.lists(functions(domain, **options), min_size=1, max_size=max_functions)
        return st.tuples(st.just(domain), lists)

    return domains(max_variables).flatmap(with_functions)


__all__ = [
    "IvPError",
    "certify",
    "check_builder",
    "check_function",
    "domains",
    "functions",
    "problems",
    "value_at",
]
