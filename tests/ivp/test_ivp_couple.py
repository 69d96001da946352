"""Coupled functions: the reference's measured tables, and the refusals."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ivp_helm.ivp import (
    CoupledPeak,
    Domain,
    IvPError,
    IvPFunction,
    Peak,
    couple,
    zaic_leq,
    zaic_peak,
    zaic_spd,
)

DATA = Path(__file__).parents[1] / "data" / "ivp"
CASES = json.loads((DATA / "coupler.json").read_text())["cases"]
DOMAIN = Domain.parse("course,0,359,360:speed,0,4,21")
PEAK_FIELDS = ("summit", "peakwidth", "basewidth", "summitdelta", "minutil", "maxutil")


def part(domain: Domain, var: str, ops: list[Any], wrap: bool) -> IvPFunction:
    kind = "PEAK"
    if isinstance(ops[0], str):
        kind, *ops = ops
    fields: dict[str, float] = {}
    for op, *args in ops:
        numbers = [float(a) for a in args]
        if op == "params" and kind == "SPD":
            return zaic_spd(domain, var, *numbers)
        if op == "params":
            fields.update(zip(PEAK_FIELDS, numbers, strict=True))
        elif op != "wrap":
            fields[op] = numbers[0]
    if kind == "LEQ":
        return zaic_leq(domain, var, **fields)
    return zaic_peak(domain, var, Peak(**fields), wrap=wrap)


@pytest.mark.parametrize("case", [c for c in CASES if "first" in c], ids=lambda c: c["id"])
def test_coupling_gives_the_measured_table(case: dict[str, Any]) -> None:
    domain = Domain.parse(case["domain"])
    f = part(domain, "course", case["first"], wrap=True)
    g = part(domain, "speed", case["second"], wrap=False)
    weights = case["weights"] or (50, 50)
    if not case["result"]["built"]:
        with pytest.raises(IvPError):
            couple(f, g, *weights)
        return
    h = couple(f, g, *weights)
    assert str(h.domain) == case["result"]["domain"]
    expected = np.array(case["result"]["curve"]).reshape(h.domain.points[::-1]).T  # first variable fastest
    np.testing.assert_allclose(h.table(), expected, rtol=1e-9, atol=1e-9)
    assert h.pieces == f.pieces * g.pieces


def test_coupling_is_refused_over_a_shared_variable() -> None:
    f = zaic_peak(DOMAIN, "course", Peak(90, basewidth=60))
    with pytest.raises(IvPError, match="both parts are over 'course'"):
        couple(f, f)


def test_a_flat_part_adds_nothing_once_the_sum_is_stretched() -> None:
    course = zaic_peak(DOMAIN, "course", Peak(90, basewidth=60), wrap=True)
    flat = zaic_peak(DOMAIN, "speed", Peak(2, peakwidth=9))
    h = couple(course, flat).table()
    np.testing.assert_allclose(h, np.repeat(course.table()[:, None], 21, axis=1), atol=1e-9)


def test_limits_set_the_range_of_the_sum_and_none_leaves_it_as_added() -> None:
    course = zaic_peak(DOMAIN, "course", Peak(90, basewidth=60), wrap=True)
    speed = zaic_peak(DOMAIN, "speed", Peak(2, basewidth=1))
    h = couple(course, speed, 30, 70, limits=(-5, 20))
    assert (h.minimum, h.maximum) == (-5, 20)
    assert np.nanmin(h.table()) == pytest.approx(-5)
    assert np.nanmax(h.table()) == pytest.approx(20)
    plain = couple(course, speed, 30, 60, limits=None).table()
    expected = 0.3 * course.table()[:, None] + 0.6 * speed.table()[None, :]
    np.testing.assert_allclose(plain, expected, atol=1e-9)


def test_a_wished_order_of_variables_is_kept() -> None:
    course = zaic_peak(DOMAIN, "course", Peak(90, basewidth=60), wrap=True)
    speed = zaic_peak(DOMAIN, "speed", Peak(2, basewidth=1))
    h = couple(speed, course, domain=DOMAIN)
    assert h.domain is DOMAIN
    np.testing.assert_allclose(h.table(), couple(course, speed).table(), atol=1e-9)


@settings(max_examples=80, deadline=None)
@given(
    summit=st.floats(-800, 800),
    peakwidth=st.sampled_from([0.0, -3.0, 12.5, 90.0]),
    basewidth=st.sampled_from([0.0, 1.0, 60.0, 180.0]),
    summitdelta=st.sampled_from([0.0, 25.0, 300.0]),
    weight=st.floats(1.0, 99.0),
    wrap=st.booleans(),
    speed=st.floats(-1.0, 6.0),
)
def test_a_coupled_peak_is_the_peak_and_the_coupling_in_one(
    summit, peakwidth, basewidth, summitdelta, weight, wrap, speed
):
    second = zaic_peak(DOMAIN, "speed", Peak(speed, 0.0, 0.5))
    peak = Peak(summit, peakwidth, basewidth, summitdelta)
    wanted = couple(zaic_peak(DOMAIN, "course", peak, wrap=wrap), second, weight, 100.0 - weight)
    maker = CoupledPeak(
        DOMAIN,
        "course",
        Peak(0.0, peakwidth, basewidth, summitdelta),
        second,
        weight,
        100.0 - weight,
        wrap=wrap,
    )
    found = maker.at(summit)
    assert found.domain is wanted.domain
    assert np.array_equal(found.low, wanted.low)
    assert np.array_equal(found.high, wanted.high)
    assert np.array_equal(found.coefficients, wanted.coefficients)
    assert (found.minimum, found.maximum, found.grid) == (wanted.minimum, wanted.maximum, wanted.grid)


def test_a_coupled_peak_refuses_a_summit_that_is_no_number() -> None:
    maker = CoupledPeak(DOMAIN, "course", Peak(basewidth=180), zaic_spd(DOMAIN, "speed", 2), wrap=True)
    with pytest.raises(IvPError, match="not a finite number"):
        maker.at(float("nan"))
