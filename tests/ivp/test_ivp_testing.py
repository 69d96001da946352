"""The public checks themselves: they must catch what they are there to catch."""

from __future__ import annotations

import numpy as np
import pytest

from ivp_helm.ivp import Domain, IvPFunction, Peak, solve, zaic_peak
from ivp_helm.ivp.testing import certify, check_builder, check_function

DOMAIN = Domain.parse("x,0,9,10:y,0,9,10")


def peak() -> IvPFunction:
    return zaic_peak(DOMAIN, "x", Peak(4, basewidth=3))


def test_a_right_solution_is_certified_and_a_wrong_one_is_not() -> None:
    functions = [peak()]
    right = solve(DOMAIN, functions)
    certify(right, DOMAIN, functions)
    elsewhere = right._replace(indexes=(5, 9), decision=(5.0, 9.0), value=10 * 200 / 3)
    for wrong, words in (
        (elsewhere, "but 1000"),
        (right._replace(value=999.0), "add up to"),
        (right._replace(bound=900.0), "bound 900"),
        (right._replace(decision=(4.0, 8.0)), "not at indexes"),
    ):
        with pytest.raises(AssertionError, match=words):
            certify(wrong, DOMAIN, functions)


def test_gaps_overlaps_and_limits_are_noticed() -> None:
    x = DOMAIN.subdomain("x")
    check_function(peak())
    with pytest.raises(AssertionError, match="5 of 10 points are not covered"):
        check_function(IvPFunction(x, [[0]], [[4]], [[1.0]]))
    with pytest.raises(AssertionError, match="2 points are covered more than once"):
        check_function(IvPFunction(x, [[0], [3]], [[4], [9]], [[1.0], [1.0]]))
    with pytest.raises(AssertionError, match="above 50"):
        check_function(peak(), 0, 50)


def test_a_builder_that_does_not_repeat_itself_is_noticed() -> None:
    rng = np.random.default_rng(1)
    check_builder(zaic_peak, DOMAIN, "x", Peak(4, basewidth=3))
    with pytest.raises(AssertionError, match="built twice"):
        check_builder(lambda: zaic_peak(DOMAIN, "x", Peak(rng.uniform(0, 9), basewidth=3)))
