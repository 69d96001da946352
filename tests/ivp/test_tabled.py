"""Functions made of tables of utilities: the reflector's, in fewer pieces."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ivp_helm.ivp import Domain, IvPError, IvPFunction, Tiling, from_table, reflect

PLANE = Domain.from_entries(["course:0:359:360", "speed:0:4:21"])


@st.composite
def tables(draw):
    """Smooth, stepped and rough tables of odd sizes, with a size of pieces."""
    m, n = draw(st.integers(2, 40)), draw(st.integers(2, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    i, j = np.mgrid[0:m, 0:n]
    smooth = np.cos(i * rng.uniform(0, 0.5) + j * rng.uniform(0, 0.5)) * 50.0
    kind = draw(st.sampled_from(["smooth", "steps", "rough", "flat", "plane"]))
    if kind == "steps":
        smooth = np.where(smooth > rng.uniform(-50, 50), 100.0, 0.0)
    elif kind == "rough":
        smooth = rng.uniform(0, 100, (m, n))
    elif kind == "flat":
        smooth = np.full((m, n), rng.uniform(-5, 5))
    elif kind == "plane":
        smooth = 3.0 * i - 2.0 * j
    return smooth, (draw(st.integers(1, 7)), draw(st.integers(1, 7)))


def domain_of(table: np.ndarray) -> Domain:
    m, n = table.shape
    return Domain.from_entries([f"a:0:{m - 1}:{m}", f"b:0:{n - 1}:{n}"])


def reflected(table: np.ndarray, pieces: tuple[int, int]) -> IvPFunction:
    def utility(a, b):
        return table[np.rint(a).astype(int), np.rint(b).astype(int)]

    return reflect(domain_of(table), utility, uniform_piece=pieces, normalise=False)


@settings(max_examples=150, deadline=None)
@given(tables())
def test_a_function_has_the_values_the_reflector_would_give_it(case):
    table, pieces = case
    function = from_table(domain_of(table), table, pieces, extent=0.0)
    wanted = reflected(table, pieces)
    assert np.allclose(function.table(), wanted.table(), atol=1e-9)
    assert function.pieces <= wanted.pieces
    anew = IvPFunction(function.domain, function.low, function.high, function.coefficients)
    assert anew.is_partition
    assert (anew.minimum, anew.maximum) == pytest.approx((function.minimum, function.maximum))


def test_flat_tiles_side_by_side_become_one_piece():
    function = from_table(PLANE, np.full(PLANE.points, 7.0), (3, 3))
    assert (function.pieces, function.minimum, function.maximum) == (1, 7.0, 7.0)
    steps = np.where(np.arange(360) < 99, 0.0, 100.0)[:, None] * np.ones(21)
    assert from_table(PLANE, steps, (3, 3)).pieces == 2
    island = np.zeros(PLANE.points)
    island[30:60, 6:12] = 50.0
    assert from_table(PLANE, island, (3, 3)).pieces == 5


def test_functions_run_from_0_to_100_unless_told_otherwise():
    table = np.add.outer(np.arange(360.0), np.arange(21.0)) + 50.0
    function = from_table(PLANE, table, (3, 3))
    assert (function.minimum, function.maximum) == pytest.approx((0.0, 100.0))
    other = from_table(PLANE, table, (3, 3), base=10.0, extent=50.0)
    assert (other.minimum, other.maximum) == pytest.approx((10.0, 60.0))


def test_the_user_may_want_it_built_otherwise():
    table = np.add.outer(np.abs(np.arange(360.0) - 100.0), np.arange(21.0) ** 2)
    finer = from_table(PLANE, table, (3, 3), "uniform_piece = discrete @ course:1,speed:1")
    assert finer.pieces == 360 * 21
    assert np.abs(finer.table() - table / table.max() * 100.0).max() < 1e-6
    assert from_table(PLANE, table, (3, 3), "smart_amount = 50").pieces == 890


def test_one_variable_is_enough():
    domain = Domain.from_entries(["course:0:359:360"])
    table = np.minimum(np.abs(np.arange(360.0) - 100.0), 50.0)
    function = from_table(domain, table, (2,), extent=0.0)
    assert (function.table() == table).all()
    assert function.pieces == 1 + 50 + 1


@pytest.mark.parametrize(
    "table", [np.zeros((21, 360)), np.zeros(360), np.full((360, 21), np.nan), np.full((360, 21), np.inf)]
)
def test_tables_of_other_shapes_or_without_values_are_refused(table):
    with pytest.raises(IvPError, match="table"):
        from_table(PLANE, table, (3, 3))


@pytest.mark.parametrize("pieces", [(3,), (0, 3), (1, 2, 3)])
def test_pieces_of_no_size_are_refused(pieces):
    with pytest.raises(IvPError, match="pieces"):
        from_table(PLANE, np.zeros(PLANE.points), pieces)


def test_three_variables_are_too_many():
    domain = Domain.from_entries(["course:0:359:36", "speed:0:4:5", "depth:0:10:3"])
    with pytest.raises(IvPError, match="shape"):
        from_table(domain, np.zeros(domain.points), (1, 1, 1))


@settings(max_examples=60, deadline=None)
@given(tables())
def test_a_tiling_makes_the_same_function_of_the_few_values_that_count(case):
    table, pieces = case
    domain = domain_of(table)
    tiling = Tiling.of(domain, pieces)
    found = tiling.function(table[tiling.indexes], 0.0, 100.0)
    wanted = from_table(domain, table, pieces)
    assert np.array_equal(found.low, wanted.low)
    assert np.array_equal(found.high, wanted.high)
    assert np.array_equal(found.coefficients, wanted.coefficients)


def test_a_tiling_refuses_values_that_are_not_finite():
    tiling = Tiling.of(PLANE, (3, 3))
    values = np.zeros(tiling.size)
    values[17] = np.inf
    with pytest.raises(IvPError, match="not finite"):
        tiling.function(values)
