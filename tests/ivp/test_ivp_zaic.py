"""The one-variable builders: measured curves of the reference, and what must hold for any parameters."""

from __future__ import annotations

import json
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
    zaic_hdg,
    zaic_heq,
    zaic_leq,
    zaic_peak,
    zaic_spd,
    zaic_vector,
)
from ivp_helm.ivp.testing import check_builder, check_function

DATA = Path(__file__).parents[1] / "data" / "ivp"
CASES = json.loads((DATA / "zaic.json").read_text())["cases"]

PEAK_FIELDS = ("summit", "peakwidth", "basewidth", "summitdelta", "minutil", "maxutil")
HDG_FIELDS = ["summit", "ldelta", "hdelta", "ldelta_util", "hdelta_util", "lminutil", "hminutil", "maxutil"]
SPD_FIELDS = [
    "med_spd",
    "low_spd",
    "hgh_spd",
    "low_spd_util",
    "hgh_spd_util",
    "min_spd_util",
    "max_spd_util",
    "max_util",
]
SPD_SETTERS = {"medspeed": "med_spd", "lowspeed": "low_spd", "hghspeed": "hgh_spd"}


def build_peak(domain: Domain, var: str, ops: list[list[Any]], combine: str, notes: list[str]) -> IvPFunction:
    peaks: list[dict[str, float]] = [{}]
    options: dict[str, Any] = {"combine": combine or "max"}
    for op, *args in ops:
        if op == "params":
            target = int(args[6]) if len(args) > 6 else 0
            peaks[target].update(zip(PEAK_FIELDS, args[:6], strict=True))
        elif op == "addcomponent":
            peaks.append({})
        elif op == "minmaxutil":
            peaks[0].update(minutil=args[0], maxutil=args[1])
        elif op in ("wrap", "insist"):
            options[op] = bool(args[0])
        else:
            peaks[0][op] = args[0]
    return zaic_peak(domain, var, *(Peak(**p) for p in peaks), notes=notes, **options)


def build(case: dict[str, Any], notes: list[str]) -> IvPFunction:
    """Replay the reference's setter calls on our builder."""
    kind, var, ops = case["kind"], case["var"], case["ops"]
    domain = Domain.parse(case["domain"])
    if kind == "PEAK":
        return build_peak(domain, var, ops, case["combine"], notes)
    fields: dict[str, Any] = {}
    for op, *args in ops:
        if op == "params":
            fields.update(zip(HDG_FIELDS if kind == "HDG" else SPD_FIELDS, args, strict=False))
        elif kind == "SPD" and op == "minmaxutil":
            fields.update(zip(("min_spd_util", "max_spd_util", "max_util"), args, strict=False))
        elif op == "minmaxutil":
            fields.update(minutil=args[0], maxutil=args[1])
        elif op == "disablelow":
            fields["low_spd"] = None
        elif op == "disablehigh":
            fields["hgh_spd"] = None
        elif op == "domainvals":
            fields["domain_values"] = args
        elif op == "rangevals":
            fields["range_values"] = args
        else:
            fields[SPD_SETTERS.get(op, op)] = args[0]
    if kind == "VECTOR":
        fields = {"domain_values": [], "range_values": []} | fields
    builder = {"LEQ": zaic_leq, "HEQ": zaic_heq, "HDG": zaic_hdg, "SPD": zaic_spd, "VECTOR": zaic_vector}[
        kind
    ]
    return builder(domain, var, notes=notes, **fields)  # type: ignore[operator]


def is_reference_fault(case: dict[str, Any]) -> str | None:
    """Why the reference's curve is not to be reproduced (ivp_math.md 11), or None."""
    kind, domain = case["kind"], Domain.parse(case["domain"])
    flat = {op: args for op, *args in case["ops"]}
    if kind in ("LEQ", "HEQ") and domain[case["var"]].low != 0:
        return "the domain's low end is not subtracted"
    if kind == "PEAK" and flat.get("wrap", [0])[0]:
        summits = [args[0] for op, *args in case["ops"] if op in ("params", "summit")]
        v = domain[case["var"]]
        if any(not v.low <= s < v.high + v.delta for s in summits):
            return "a summit outside the circle is not folded"
    if kind == "HDG" and 0 in flat["params"][1:3]:
        return "a zero delta loses the summit"
    if kind == "HDG" and domain["course"].low < 0:
        return "an unsuitable domain is replaced silently"
    return None


@pytest.mark.parametrize("case", CASES, ids=lambda c: f"{c['kind']}-{c['id']}")
def test_a_builder_gives_the_measured_curve_or_refuses_what_the_reference_refuses(
    case: dict[str, Any],
) -> None:
    result = case["result"]
    notes: list[str] = []
    if not result.get("built"):
        with pytest.raises(IvPError):
            build(case, notes)
        return
    fault = is_reference_fault(case)
    if fault == "an unsuitable domain is replaced silently":
        with pytest.raises(IvPError, match=r"must lie in \[0, 360\)"):
            build(case, notes)
        return
    f = build(case, notes)
    ours = f.table()
    assert f.is_partition
    assert not np.isnan(ours).any()
    theirs = [(i, u) for i, u in enumerate(result["curve"]) if isinstance(u, (int, float))]
    agree = [abs(ours[i] - u) <= 1e-9 * max(1.0, abs(u)) for i, u in theirs]
    if fault:
        assert not all(agree)  # else it would be no fault, and the exception above must go
    else:
        assert all(agree), [(i, ours[i], u) for (i, u), ok in zip(theirs, agree, strict=True) if not ok][:5]
        low, high = result["minmax"]
        if len(theirs) == len(ours):  # else the reference left a point uncovered
            assert f.minimum == pytest.approx(low, abs=1e-9)
            assert f.maximum == pytest.approx(high, abs=1e-9)
    if case["kind"] in ("PEAK", "LEQ", "HEQ") and result["warnings"]:
        assert notes


DOMAINS = [
    Domain.parse(text)
    for text in ("v,0,359,360", "v,0,4,21", "v,-10,10,41", "v,2,7,11", "v,0,1,2", "v,0,359.9,3600", "v,5,5,1")
]
numbers = st.floats(-500, 500) | st.integers(-20, 400).map(float) | st.sampled_from([0.0, 1e-12, 1e12, -1e12])
widths = st.floats(0, 400) | st.sampled_from([0.0, 0.1, 1e-9, 1e12])
peaks = st.builds(
    lambda summit, peakwidth, basewidth, drop, low, extent: Peak(
        summit, peakwidth, basewidth, drop * extent, low, low + extent
    ),
    *(numbers, widths, widths, st.floats(0, 1), st.floats(-100, 100), st.floats(0.1, 200)),
)


@given(st.sampled_from(DOMAINS), st.lists(peaks, min_size=1, max_size=3), st.booleans(), st.booleans())
@settings(max_examples=150, deadline=None)
def test_peaks_stay_between_their_least_and_greatest_utility(
    domain: Domain, given_peaks: list[Peak], wrap: bool, insist: bool
) -> None:
    low, high = min(p.minutil for p in given_peaks), max(p.maxutil for p in given_peaks)
    check_function(zaic_peak(domain, "v", *given_peaks, wrap=wrap, insist=insist), low, high)
    low, high = sum(p.minutil for p in given_peaks), sum(p.maxutil for p in given_peaks)
    if not insist:
        check_function(
            zaic_peak(domain, "v", *given_peaks, wrap=wrap, combine="sum", insist=False), low, high
        )


@given(st.sampled_from(DOMAINS[:-1]), numbers, widths, st.floats(-50, 50), st.floats(1, 100), st.booleans())
@settings(max_examples=150, deadline=None)
def test_limits_cover_everything_and_stay_within_their_utilities_but_for_the_tie_slopes(
    domain: Domain, summit: float, base: float, low: float, extent: float, upper: bool
) -> None:
    builder = zaic_heq if upper else zaic_leq
    f = builder(domain, "v", summit, base, 0.0, low, low + extent)
    slack = 0.00001 * domain.size
    check_function(f, low - slack, low + extent + slack)
    check_builder(builder, domain, "v", summit, base, 0.0, low, low + extent)
    # apart from the tie slopes an upper limit never rises, a lower limit never falls
    steps = np.diff(f.table()) * (1 if upper else -1)
    assert steps.min() >= -0.00002 - slack


@given(
    st.floats(-720, 720),
    widths,
    widths,
    st.floats(0, 100),
    st.floats(0, 100),
    st.floats(0, 40),
    st.floats(0, 40),
)
@settings(max_examples=100, deadline=None)
def test_heading_preferences_fall_from_the_summit_to_their_least(
    summit: float,
    left: float,
    right: float,
    left_util: float,
    right_util: float,
    left_min: float,
    right_min: float,
) -> None:
    domain = DOMAINS[0]
    if not 0 <= summit % 360 <= 359:
        return
    f = zaic_hdg(domain, "v", summit, left, right, left_util, right_util, left_min, right_min, 100)
    check_function(f, min(left_min, right_min), 100)


@given(
    st.sampled_from(DOMAINS), *(st.floats(-5, 400) for _ in range(3)), *(st.floats(0, 120) for _ in range(4))
)
@settings(max_examples=100, deadline=None)
def test_speed_preferences_stay_between_nothing_and_the_most(
    domain: Domain, med: float, low: float, high: float, a: float, b: float, c: float, d: float
) -> None:
    check_function(zaic_spd(domain, "v", med, low, high, a, b, c, d, 100), 0, 100)
    # A summit between two points of the domain may be seen by neither; one on a point is.
    variable = domain.variables[0]
    step = (variable.high - variable.low) / max(1, domain.size - 1) or 1.0
    med = variable.low + step * round((min(max(med, variable.low), variable.high) - variable.low) / step)
    f = zaic_spd(domain, "v", med, low, high, a, b, c, d, 100)
    assert f.value(med) == pytest.approx(100) or domain.size < 60


@given(
    st.sampled_from(DOMAINS),
    st.lists(st.tuples(st.floats(0, 1), st.floats(-50, 150)), min_size=1, max_size=20),
)
@settings(max_examples=100, deadline=None)
def test_vectors_stay_between_the_values_they_are_given(
    domain: Domain, pairs: list[tuple[float, float]]
) -> None:
    v = domain.variables[0]
    xs = [v.low + x * (v.high - v.low) for x, _ in pairs]
    ys = [y for _, y in pairs]
    check_function(zaic_vector(domain, "v", xs, ys), min(ys), max(ys))


def test_a_narrow_peak_is_seen_all_the_same_when_it_insists() -> None:
    domain = Domain.parse("speed,0,4,21")
    assert zaic_peak(domain, "speed", Peak(1.5)).table().tolist() == [
        100.0 if i == 7 else 0.0 for i in range(21)
    ]
    assert zaic_peak(domain, "speed", Peak(1.5), insist=False).maximum == 0.0


def test_a_limit_at_or_above_the_top_leaves_no_speed_infeasible() -> None:
    domain = Domain.parse("speed,0,4,21")
    assert zaic_heq(domain, "speed", 4.0, 1.0).table()[20] == pytest.approx(100, abs=0.001)
    assert zaic_heq(domain, "speed", 4.5, 1.0).table()[20] == pytest.approx(40, abs=0.1)
    assert zaic_heq(domain, "speed", 9.0, 1.0).table()[20] == pytest.approx(0, abs=0.001)
    np.testing.assert_allclose(
        zaic_leq(domain, "speed", 2.0, 0.05).table(), [100.0] * 11 + [0.0] * 10, atol=0.001
    )


def test_a_summit_beyond_the_circle_is_folded_into_it() -> None:
    domain = Domain.parse("course,0,359,360")
    for turns in (-720, -360, 360):
        f = zaic_peak(domain, "course", Peak(40 + turns, 20, 40, 30), wrap=True)
        np.testing.assert_array_equal(
            f.table(), zaic_peak(domain, "course", Peak(40, 20, 40, 30), wrap=True).table()
        )


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda d: zaic_peak(d, "speed"), "at least one peak"),
        (lambda d: zaic_peak(d, "spede", Peak()), "did you mean 'speed'"),
        (lambda d: zaic_peak(d, "speed", Peak(float("nan"))), "summit nan"),
        (lambda d: zaic_peak(d, "speed", Peak(1, float("inf"))), "peakwidth inf"),
        (lambda d: zaic_peak(d, "speed", Peak(), combine="min"), "'max' or 'sum'"),
        (lambda d: zaic_leq(d, "speed", float("inf")), "summit inf"),
        (lambda d: zaic_leq(d, "depth", 2), "variable 'depth' not in domain"),
        (lambda d: zaic_heq(d, "speed", 2, minutil=5, maxutil=5), "minutil 5 must be below maxutil 5"),
        (lambda d: zaic_hdg(d, "speed", 90), "4 points or more|outside"),
        (lambda d: zaic_hdg(d, "course", 90, lminutil=120), "do not fit"),
        (lambda d: zaic_spd(d, "speed", 1, max_spd_util=-1), "must not be negative"),
        (lambda d: zaic_spd(d, "speed", float("nan")), "finite"),
        (lambda d: zaic_vector(d, "speed", [9, 1], [1, 2]), "first value 9 is outside"),
        (lambda d: zaic_vector(d, "speed", [1, 2], [1, float("inf")]), "finite"),
    ],
)
def test_parameters_that_cannot_be_are_refused(build: Any, words: str) -> None:
    with pytest.raises(IvPError, match=words):
        build(Domain.parse("course,0,359,360:speed,0,4,21"))
