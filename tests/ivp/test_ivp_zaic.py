"""The one-variable builders: measured curves of the reference, and what must hold for any parameters."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

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
