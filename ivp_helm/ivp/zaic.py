"""Builders of functions over one variable: peaks, limits, headings, speeds, vectors.

Each takes a domain and the name of one variable in it, and returns a function over that variable
alone. Utilities usually run from 0 to 100 but need not. What a builder has to adjust (a negative
width taken as zero, say) it notes in the list handed in as `notes`; what it cannot use it refuses
with `IvPError`. Source: ivp_math.md 4.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from mypy_extensions import mypyc_attr

from ivp_helm.ivp import zaic_kernels as kernels
from ivp_helm.ivp.domain import Domain, Variable
from ivp_helm.ivp.errors import IvPError
from ivp_helm.ivp.function import IvPFunction

# The slope, per index, by which limit builders break ties towards the summit.
TIE_SLOPE: Final = 0.00001

Notes = list[str] | None


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Peak:
    """One peak: highest at `summit`, flat or falling over `peakwidth`, down to the least over `basewidth`.

    Widths are native units on each side; over the peak width the utility falls by `summitdelta`
    (which is inert when `peakwidth` is 0, as in MOOS-IvP).
    """

    summit: float = 0.0
    peakwidth: float = 0.0
    basewidth: float = 0.0
    summitdelta: float = 0.0
    minutil: float = 0.0
    maxutil: float = 100.0


def zaic_peak(
    domain: Domain,
    variable: str,
    *peaks: Peak,
    wrap: bool = False,
    combine: Literal["max", "sum"] = "max",
    insist: bool = True,
    notes: Notes = None,
) -> IvPFunction:
    """One or several peaks over a variable.

    wrap      the variable is a circle, e.g. course 0..359 closes at 360; summits are folded into it
    combine   several peaks take the larger utility ("max") or add up ("sum")
    insist    where a peak is too narrow to be seen, the domain point nearest its summit gets `maxutil`

    Negative widths and deltas count as 0, a delta beyond max - min as that; `IvPError` for minutil >=
    maxutil, numbers not finite, or no peak.
    """
    v = domain[variable]
    if not peaks:
        raise IvPError(f"peak over {variable!r}: at least one peak is needed")
    if combine not in ("max", "sum"):
        raise IvPError(f"peak over {variable!r}: combine is 'max' or 'sum', not {combine!r}")
    circle = v.high - v.low + v.delta
    rows = np.empty((len(peaks), 6))
    for row, peak in zip(rows, peaks, strict=True):
        _check_range("peak", variable, peak.minutil, peak.maxutil)
        summit = _finite("peak", variable, "summit", peak.summit)
        if wrap and circle > 0 and not v.low <= summit < v.low + circle:
            summit = v.low + (summit - v.low) % circle
        peakwidth = _not_negative("peak", variable, "peakwidth", peak.peakwidth, notes)
        basewidth = _not_negative("peak", variable, "basewidth", peak.basewidth, notes)
        drop = _not_negative("peak", variable, "summitdelta", peak.summitdelta, notes)
        if drop > peak.maxutil - peak.minutil:
            drop = peak.maxutil - peak.minutil
            _note(notes, f"peak over {variable!r}: summitdelta {peak.summitdelta:g} taken as {drop:g}")
        row[:] = summit, peakwidth, basewidth, drop, peak.minutil, peak.maxutil
    block = kernels.peak_block(
        rows, v.low, v.high, v.delta, v.points, bool(wrap), combine == "sum", bool(insist)
    )
    return IvPFunction._of_block(domain.subdomain((variable,)), block)


def zaic_leq(
    domain: Domain,
    variable: str,
    summit: float,
    basewidth: float = 0.0,
    summitdelta: float = 0.0,
    minutil: float = 0.0,
    maxutil: float = 100.0,
    *,
    notes: Notes = None,
) -> IvPFunction:
    """ "At most": `maxutil` up to `summit`, falling to `minutil` over `basewidth` beyond it.

    With `summitdelta` > 0 the summit itself scores that much more. Slopes of 0.00001 per index break
    ties: upwards below the summit, towards it beyond the base.
    """
    v, shape = _limit("leq", domain, variable, summit, basewidth, summitdelta, minutil, maxutil, notes)
    n, top = shape.steps, v.points - 1
    first = math.trunc(shape.summit_steps + 0.5)
    last = math.trunc(shape.summit_steps + shape.base_steps + 0.5)
    i1, i2 = _clip(first, top), _clip(last, top)
    i1 = min(i1, i2)
    if n == 0:
        i2 = i1
    rows: list[tuple[float, float, float, float]] = []
    peaked = summitdelta > 0 and i1 > 1
    rows.append((0, i1 - 1 if peaked else i1, TIE_SLOPE, maxutil))
    if peaked:
        rows.append((i1, i1, 0.0, maxutil + summitdelta))
    if i1 < i2:
        if i1 > 0:
            slope = -(maxutil - minutil) / n
            rows.append((i1 + 1, i2, slope, maxutil - slope * i1))
        elif last <= top:
            slope = -(maxutil - minutil) / n
            rows.append((1, i2, slope, minutil - slope * i2))
        else:  # both ends of the ramp lie outside: anchored where the summit really is
            slope = -(maxutil - minutil) / shape.base_steps
            rows.append((1, i2, slope, maxutil - slope * math.floor(shape.summit_steps + 0.5)))
    if i2 < top:
        rows.append((i2 + 1, top, -TIE_SLOPE, minutil))
    return _of_lines(domain, v, rows)


def zaic_heq(
    domain: Domain,
    variable: str,
    summit: float,
    basewidth: float = 0.0,
    summitdelta: float = 0.0,
    minutil: float = 0.0,
    maxutil: float = 100.0,
    *,
    notes: Notes = None,
) -> IvPFunction:
    """ "At least": `maxutil` from `summit` up, rising from `minutil` over `basewidth` below it.

    With `summitdelta` > 0 the summit itself scores that much more. Slopes of 0.00001 per index break
    ties towards the summit. Every index is covered, whatever the summit.
    """
    v, shape = _limit("heq", domain, variable, summit, basewidth, summitdelta, minutil, maxutil, notes)
    n, top = shape.steps, v.points - 1
    first = math.trunc(shape.summit_steps - shape.base_steps + 0.5)
    last = math.trunc(shape.summit_steps + 0.5)
    i1, i2 = _clip(first, top + 1), _clip(last, top + 1)  # top + 1: nothing of that part is inside
    i1 = min(i1, i2)
    if n == 0:
        i1 = i2
    rows: list[tuple[float, float, float, float]] = []
    peaked = summitdelta > 0 and i2 < top - 1
    if i2 <= top:
        rows.append((i2 + 1 if peaked else i2, top, -TIE_SLOPE, maxutil))
    if peaked:
        rows.append((i2, i2, 0.0, maxutil + summitdelta))
    if i1 < i2:
        slope = (maxutil - minutil) / n
        if i1 > 0:
            rows.append((i1, i2 - 1, slope, minutil - slope * i1))
        elif last <= top:
            rows.append((0, i2 - 1, slope, maxutil - slope * i2))
        else:  # both ends of the ramp lie outside: anchored where the summit really is
            slope = (maxutil - minutil) / shape.base_steps
            rows.append((0, top, slope, maxutil - slope * math.floor(shape.summit_steps + 0.5)))
    if i1 > 0:
        rows.append((0, i1 - 1, TIE_SLOPE, minutil))
    return _of_lines(domain, v, rows)


def zaic_hdg(
    domain: Domain,
    variable: str,
    summit: float,
    ldelta: float = 0.0,
    hdelta: float = 0.0,
    ldelta_util: float = 50.0,
    hdelta_util: float = 50.0,
    lminutil: float = 0.0,
    hminutil: float = 0.0,
    maxutil: float = 100.0,
    *,
    notes: Notes = None,
) -> IvPFunction:
    """A heading preference that may fall faster to one side, in degrees.

    From `maxutil` at `summit` the utility falls to `ldelta_util` at `ldelta` degrees to port (low
    side) and `hdelta_util` at `hdelta` degrees to starboard, and on to the side's least utility
    abeam-to-astern at 180 degrees. Deltas are held to 0..180, side utilities to the side's least utility
    and maxutil, negative least utilities count as 0. The domain variable must lie in [0, 360) and have at
    least 4 points.
    """
    v = domain[variable]
    if v.low < 0 or v.high >= 360 or v.points < 4:
        raise IvPError(f"heading over {variable!r}: it must lie in [0, 360) with 4 points or more, not {v}")
    folded = _finite("heading", variable, "summit", summit) % 360.0
    if not v.low <= folded <= v.high:
        raise IvPError(f"heading over {variable!r}: summit {summit:g} is outside {v.low:g} to {v.high:g}")
    _finite("heading", variable, "maxutil", maxutil)
    leasts = np.array(
        [
            _not_negative("heading", variable, "lminutil", lminutil, notes),
            _not_negative("heading", variable, "hminutil", hminutil, notes),
        ]
    )
    if leasts.max() > maxutil or leasts.min() >= maxutil:
        raise IvPError(
            f"heading over {variable!r}: least utilities {leasts[0]:g} and {leasts[1]:g}"
            f" do not fit maxutil {maxutil:g}"
        )
    deltas = np.array([ldelta, hdelta], dtype=np.float64)
    utils = np.array([ldelta_util, hdelta_util], dtype=np.float64)
    if not (np.isfinite(deltas).all() and np.isfinite(utils).all()):
        raise IvPError(f"heading over {variable!r}: deltas and utilities must be finite")
    for side, i in (("l", 0), ("h", 1)):
        held_to = (("delta", deltas, 0.0, 180.0), ("delta_util", utils, leasts[i], maxutil))
        for name, given, floor, limit in held_to:
            if not floor <= given[i] <= limit:
                text = f"{side}{name} {given[i]:g} held to {floor:g}..{limit:g}"
                _note(notes, f"heading over {variable!r}: {text}")
                given[i] = min(max(given[i], floor), limit)
    block = kernels.heading_block(v.low, v.delta, v.points, folded, deltas, utils, leasts, float(maxutil))
    return IvPFunction._of_block(domain.subdomain((variable,)), block)


def zaic_spd(
    domain: Domain,
    variable: str,
    med_spd: float,
    low_spd: float | None = None,
    hgh_spd: float | None = None,
    low_spd_util: float = 0.0,
    hgh_spd_util: float = 0.0,
    min_spd_util: float = 0.0,
    max_spd_util: float = 0.0,
    max_util: float = 100.0,
    *,
    notes: Notes = None,
) -> IvPFunction:
    """A speed preference through five points: lowest, low, medium, high and highest speed.

    The points (domain low, min_spd_util), (low_spd, low_spd_util), (med_spd, max_util), (hgh_spd,
    hgh_spd_util), (domain high, max_spd_util) are joined by straight lines. Without `low_spd` (or
    `hgh_spd`) the line runs from the end of the domain. Speeds are held to the domain and to their
    order, utilities to at most `max_util`.
    """
    v = domain[variable]
    numbers = (med_spd, low_spd_util, hgh_spd_util, min_spd_util, max_spd_util, max_util)
    if not all(map(math.isfinite, numbers)):
        raise IvPError(f"speed over {variable!r}: every number must be finite, not {numbers}")
    if max_util <= 0:
        raise IvPError(f"speed over {variable!r}: max_util {max_util:g} must be above 0")
    if min_spd_util < 0 or max_spd_util < 0:
        raise IvPError(f"speed over {variable!r}: utilities at the ends must not be negative")
    med = _held(v, "med_spd", med_spd, notes)
    low = min(_held(v, "low_spd", v.low if low_spd is None else low_spd, notes), med)
    high = max(_held(v, "hgh_spd", v.high if hgh_spd is None else hgh_spd, notes), med)
    at_low, at_high = min(min_spd_util, max_util), min(max_spd_util, max_util)
    low_util = at_low if low == v.low else min(max(low_spd_util, 0.0), max_util)
    high_util = at_high if high == v.high else min(max(hgh_spd_util, 0.0), max_util)
    top = v.points - 1
    i_low, i_med, i_high = (_half_up(v, x) for x in (low, med, high))
    knots: dict[int, float] = {}
    if i_med != 0:
        knots[0] = at_low
        if i_low not in (0, i_med):
            knots[i_low] = low_util
    knots[i_med] = max_util
    if i_high != i_med:
        knots[i_high] = high_util
    if i_high != top:
        knots[top] = at_high
    return _of_knots(domain, v, knots)


def zaic_vector(
    domain: Domain,
    variable: str,
    domain_values: Sequence[float],
    range_values: Sequence[float],
    *,
    notes: Notes = None,
) -> IvPFunction:
    """Straight lines through given (value, utility) pairs.

    Values go to the nearest domain value, several on one are averaged, and the first and last utility
    reach on to the ends of the variable. `IvPError` when the lowest value lies outside the variable, the
    lists differ in length or are empty. (MOOS-IvP's tolerance has no effect and is left out.)
    """
    v = domain[variable]
    xs = np.asarray(domain_values, dtype=np.float64)
    ys = np.asarray(range_values, dtype=np.float64)
    if xs.ndim != 1 or xs.shape != ys.shape:
        raise IvPError(f"vector over {variable!r}: {xs.size} domain values, but {ys.size} range values")
    if xs.size == 0:
        raise IvPError(f"vector over {variable!r}: no pairs given")
    if not (np.isfinite(xs).all() and np.isfinite(ys).all()):
        raise IvPError(f"vector over {variable!r}: every number must be finite")
    if not v.low <= xs[0] <= v.high:
        raise IvPError(f"vector over {variable!r}: first value {xs[0]:g} is outside {v.low:g} to {v.high:g}")
    if xs.min() < v.low or xs.max() > v.high:
        _note(notes, f"vector over {variable!r}: some values lie outside {v.low:g} to {v.high:g}")
    if v.points == 1:
        return _of_knots(domain, v, {0: float(ys.mean())})
    at = np.clip(np.ceil((xs - v.delta / 2 - v.low) / v.delta), 0, v.points - 1).astype(np.int64)
    counts = np.bincount(at, minlength=v.points)
    if counts.max() > 1:
        _note(notes, f"vector over {variable!r}: several values fall on one index and are averaged")
    where = np.flatnonzero(counts)
    means = np.bincount(at, weights=ys, minlength=v.points)[where] / counts[where]
    knots = dict(zip(where.tolist(), means.tolist(), strict=True))
    if 0 not in knots:
        _note(notes, f"vector over {variable!r}: no value at the lower end; the first utility reaches on")
        knots[0] = float(means[0])
    if v.points - 1 not in knots:
        _note(notes, f"vector over {variable!r}: no value at the upper end; the last utility reaches on")
        knots[v.points - 1] = float(means[-1])
    return _of_knots(domain, v, knots)


# -- beside the builders ------------------------------------------------------------------------------


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class _Limit:
    summit_steps: float  # from the domain low to the summit, in index steps, not rounded
    base_steps: float
    steps: int  # whole steps of the ramp; 0 means no ramp


def _limit(
    kind: str,
    domain: Domain,
    variable: str,
    summit: float,
    basewidth: float,
    summitdelta: float,
    minutil: float,
    maxutil: float,
    notes: Notes,
) -> tuple[Variable, _Limit]:
    v = domain[variable]
    _check_range(kind, variable, minutil, maxutil)
    _finite(kind, variable, "summit", summit)
    _finite(kind, variable, "summitdelta", summitdelta)
    if not (math.isfinite(basewidth) and basewidth >= 0):
        raise IvPError(f"{kind} over {variable!r}: basewidth {basewidth:g} must not be negative")
    if v.points == 1:
        raise IvPError(f"{kind} over {variable!r}: a variable with one point has no limit to prefer")
    if summitdelta < 0:
        _note(notes, f"{kind} over {variable!r}: summitdelta {summitdelta:g} taken as 0")
    if not v.low <= summit <= v.high:
        _note(notes, f"{kind} over {variable!r}: summit {summit:g} is outside {v.low:g} to {v.high:g}")
    far = 1e15  # steps; keeps extreme numbers convertible to integers
    base_steps = min(basewidth / v.delta, far)
    steps = math.trunc(min((basewidth + v.delta / 2) / v.delta, far))
    return v, _Limit(min(max((summit - v.low) / v.delta, -far), far), base_steps, steps)


def _of_lines(domain: Domain, v: Variable, rows: list[tuple[float, float, float, float]]) -> IvPFunction:
    block = kernels.block_of_lines(np.array(rows, dtype=np.float64), len(rows), v.points)
    return IvPFunction._of_block(domain.subdomain((v.name,)), block)


def _of_knots(domain: Domain, v: Variable, knots: dict[int, float]) -> IvPFunction:
    at = np.array(sorted(knots), dtype=np.int64)
    values = np.array([knots[i] for i in at.tolist()], dtype=np.float64)
    return IvPFunction._of_block(domain.subdomain((v.name,)), kernels.knots_block(at, values, v.points))


def _clip(index: int, top: int) -> int:
    return 0 if index < 0 else min(index, top)


def _half_up(v: Variable, value: float) -> int:
    return 0 if v.points == 1 else _clip(math.floor((value - v.low) / v.delta + 0.5), v.points - 1)


def _held(v: Variable, what: str, value: float, notes: Notes) -> float:
    held = min(max(_finite("speed", v.name, what, value), v.low), v.high)
    if held != value:
        _note(notes, f"speed over {v.name!r}: {what} {value:g} held to {held:g}")
    return held


def _finite(kind: str, variable: str, what: str, value: float) -> float:
    if not math.isfinite(value):
        raise IvPError(f"{kind} over {variable!r}: {what} {value} is not a finite number")
    return float(value)


def _not_negative(kind: str, variable: str, what: str, value: float, notes: Notes) -> float:
    if value >= 0 and math.isfinite(value):
        return value
    _finite(kind, variable, what, value)
    _note(notes, f"{kind} over {variable!r}: {what} {value:g} is below zero, taken as 0")
    return 0.0


def _check_range(kind: str, variable: str, minutil: float, maxutil: float) -> None:
    if not (math.isfinite(minutil) and math.isfinite(maxutil) and minutil < maxutil):
        raise IvPError(f"{kind} over {variable!r}: minutil {minutil:g} must be below maxutil {maxutil:g}")


def _note(notes: Notes, text: str) -> None:
    if notes is not None:
        notes.append(text)
