"""Functions cut from tables of utilities: few pieces, none far from the table."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ivp_helm.ivp import Domain, IvPError, IvPFunction, from_table, solve
from ivp_helm.ivp import tabled_kernels as kernels

PLANE = Domain.from_entries(["course:0:359:360", "speed:0:4:21"])


def whole(function: IvPFunction) -> IvPFunction:
    """The function with everything the builder says of itself found out anew."""
    return IvPFunction(function.domain, function.low, function.high, function.coefficients)


@st.composite
def tables(draw):
    """Smooth, stepped and rough tables of odd sizes."""
    m, n = draw(st.integers(1, 40)), draw(st.integers(1, 12))
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    i, j = np.mgrid[0:m, 0:n]
    smooth = np.cos(i * rng.uniform(0, 0.5) + j * rng.uniform(0, 0.5)) * 50.0
    kind = draw(st.sampled_from(["smooth", "steps", "rough", "flat", "plane"]))
    if kind == "steps":
        return np.where(smooth > rng.uniform(-50, 50), 100.0, smooth)
    if kind == "rough":
        return rng.uniform(0, 100, (m, n))
    if kind == "flat":
        return np.full((m, n), rng.uniform(-5, 5))
    return smooth if kind == "smooth" else 3.0 * i - 2.0 * j


def domain_of(table: np.ndarray) -> Domain:
    m, n = table.shape
    return Domain.from_entries([f"a:0:{max(1, m - 1)}:{m}", f"b:0:{max(1, n - 1)}:{n}"])


@settings(max_examples=150, deadline=None)
@given(tables(), st.sampled_from([0.0, 0.1, 1.0, 20.0]))
def test_a_function_is_nowhere_farther_from_its_table_than_the_tolerance(table, tolerance):
    if table.size == 1 or 1 in table.shape:
        return
    function = from_table(domain_of(table), table, tolerance=tolerance, extent=0.0)
    allowed = 0.01 * tolerance * (table.max() - table.min()) + 1e-9
    assert np.abs(function.table() - table).max() <= allowed
    found = whole(function)
    assert found.is_partition
    assert (found.minimum, found.maximum) == pytest.approx((function.minimum, function.maximum))
    assert function.minimum >= table.min() - 1e-9
    assert function.maximum == pytest.approx(table.max(), abs=1e-9)


@settings(max_examples=100, deadline=None)
@given(tables())
def test_the_best_point_of_the_function_is_the_best_of_the_table(table):
    if 1 in table.shape:
        return
    domain = domain_of(table)
    solution = solve(domain, [from_table(domain, table)])
    assert table[solution.indexes] == pytest.approx(table.max(), abs=1e-9 * max(1.0, abs(table).max()))


def test_a_flat_table_is_one_piece():
    function = from_table(PLANE, np.full(PLANE.points, 7.0))
    assert (function.pieces, function.minimum, function.maximum) == (1, 7.0, 7.0)


def test_a_plane_needs_no_more_pieces_than_a_few():
    i, j = np.mgrid[0:360, 0:21]
    table = 0.2 * i + 0.5 * j
    function = from_table(PLANE, table, tolerance=0.001, extent=0.0)
    assert function.pieces <= 40
    assert np.abs(function.table() - table).max() < 1e-3


def test_steps_between_courses_cost_a_piece_each():
    table = np.where(np.arange(360) < 100, 0.0, 100.0)[:, None] * np.ones(21)
    function = from_table(PLANE, table)
    assert function.pieces <= 8
    assert (function.table() == table).all()


def test_functions_run_from_0_to_100_unless_told_otherwise():
    table = np.add.outer(np.arange(360.0), np.arange(21.0)) + 50.0
    assert (from_table(PLANE, table).minimum, from_table(PLANE, table).maximum) == (0.0, 100.0)
    other = from_table(PLANE, table, base=10.0, extent=50.0)
    assert (other.minimum, other.maximum) == (10.0, 60.0)


def test_one_variable_is_enough():
    domain = Domain.from_entries(["course:0:359:360"])
    table = np.abs(np.arange(360.0) - 100.0)
    function = from_table(domain, table, tolerance=0.01, extent=0.0)
    assert np.abs(function.table() - table).max() <= 0.026
    assert function.pieces < 60


@pytest.mark.parametrize(
    "table", [np.zeros((21, 360)), np.zeros(360), np.full((360, 21), np.nan), np.full((360, 21), np.inf)]
)
def test_tables_of_other_shapes_or_without_values_are_refused(table):
    with pytest.raises(IvPError, match="table"):
        from_table(PLANE, table)


def test_three_variables_are_too_many():
    domain = Domain.from_entries(["course:0:359:36", "speed:0:4:5", "depth:0:10:3"])
    with pytest.raises(IvPError, match="shape"):
        from_table(domain, np.zeros(domain.points))


@settings(max_examples=40, deadline=None)
@given(tables())
def test_the_kernel_does_what_it_does_uncompiled(table):
    table = np.ascontiguousarray(table[:12, :6], dtype=np.float64)
    compiled = np.zeros((table.size, 4), np.int64), np.zeros((table.size, 3))
    plain = np.zeros((table.size, 4), np.int64), np.zeros((table.size, 3))
    count = kernels.cut(table, table.max(), 0.5, 5, *compiled)
    assert count == kernels.cut.py_func(table, table.max(), 0.5, 5, *plain)
    assert (compiled[0] == plain[0]).all()
    assert np.allclose(compiled[1], plain[1])
