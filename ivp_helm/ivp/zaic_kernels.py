"""Compiled arithmetic of the one-variable builders.

Curves are computed at every index of one variable, then cut into straight pieces. Source:
ivp_math.md 4.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ivp_helm.ivp.kernels import COVERS, coupled, new_block
from ivp_helm.ivp.pointers import floats_at, int32s_at

Array: TypeAlias = NDArray[Any]  # of 64-bit integers or floats, whichever the docstring says

# A point further than this from the trend of its piece starts a new piece.
TREND_TOLERANCE = 0.001

# Columns of a row of peak parameters
SUMMIT, PEAKWIDTH, BASEWIDTH, SUMMITDELTA, MINUTIL, MAXUTIL = range(6)


@njit(cache=True)
def block_of_lines(rows: Array, count: int, points: int) -> Array:
    """The block of `count` pieces given as rows (low, high, slope, intercept) over one variable."""
    block = new_block(count, 1)
    low = int32s_at(block[2], count)
    high = int32s_at(block[3], count)
    coef = floats_at(block[4], 2 * count)
    least = np.inf
    most = -np.inf
    covered = 0
    finite = True
    for p in range(count):
        a = rows[p, 0]
        b = rows[p, 1]
        slope = rows[p, 2]
        intercept = rows[p, 3]
        low[p] = int(a)
        high[p] = int(b)
        coef[p] = slope
        coef[count + p] = intercept
        first = slope * a + intercept
        last = slope * b + intercept
        least = min(least, first, last)
        most = max(most, first, last)
        covered += int(b) - int(a) + 1
        if not np.isfinite(first + last):
            finite = False
    floats = block.view(np.float64)
    block[5] = COVERS if covered == points else 0
    floats[6] = least if finite else np.nan
    floats[7] = most if finite else np.nan
    floats[8] = covered / count
    return block


@njit(cache=True)
def pieces_of_curve(curve: Array) -> tuple[Array, int]:
    """Cut a curve (one value per index) into straight pieces; rows (low, high, slope, intercept).

    A piece runs until a point leaves the trend set by its first two points, or the slope changes sign.
    """
    points = curve.size
    rows = np.empty((points, 4))
    count = 0
    if points == 1:
        rows[0, 0] = 0
        rows[0, 1] = 0
        rows[0, 2] = 0.0
        rows[0, 3] = curve[0]
        return rows, 1
    a = 0
    trend = curve[1] - curve[0]
    for i in range(2, points):
        if i == a + 1:
            trend = curve[i] - curve[a]
            continue
        step = curve[i] - curve[i - 1]
        leaves = abs(curve[a] + trend * (i - a) - curve[i]) > TREND_TOLERANCE
        turns = (step > 0.0 and trend < 0.0) or (step < 0.0 and trend > 0.0)
        if not (leaves or turns):
            continue
        if i == points - 1:  # the last point stands alone, stored before the piece it follows
            rows[count, 0] = i
            rows[count, 1] = i
            rows[count, 2] = 0.0
            rows[count, 3] = curve[i]
            count += 1
        slope = (curve[i - 1] - curve[a]) / (i - 1 - a)
        rows[count, 0] = a
        rows[count, 1] = i - 1
        rows[count, 2] = slope
        rows[count, 3] = curve[a] - slope * a
        count += 1
        a = i
    if a < points - 1:
        slope = (curve[points - 1] - curve[a]) / (points - 1 - a)
        rows[count, 0] = a
        rows[count, 1] = points - 1
        rows[count, 2] = slope
        rows[count, 3] = curve[a] - slope * a
        count += 1
    return rows, count


@njit(cache=True)
def peak_curve(
    peaks: Array, low: float, high: float, delta: float, points: int, wrap: bool, add: bool, insist: bool
) -> Array:
    """The combined peaks at every index; columns of `peaks` are SUMMIT to MAXUTIL."""
    curve = np.empty(points)
    circle = high - low + delta
    for c in range(peaks.shape[0]):
        summit = peaks[c, SUMMIT]
        width = peaks[c, PEAKWIDTH]
        base = peaks[c, BASEWIDTH]
        least = peaks[c, MINUTIL]
        most = peaks[c, MAXUTIL]
        drop = peaks[c, SUMMITDELTA] if width > 0.0 else 0.0
        for i in range(points):
            v = low + delta * i
            x = abs(v - summit)
            if wrap:
                x = min(x, circle - x)
            if x <= width:
                value = most - drop * x / width if width > 0.0 else most
            elif x <= width + base:
                value = (most - drop) - (most - drop - least) * (x - width) / base
            else:
                value = least
            value = min(value, most)
            if c == 0:
                curve[i] = value
            elif add:
                curve[i] += value
            else:
                curve[i] = max(curve[i], value)
    if not insist:
        return curve
    for c in range(peaks.shape[0]):
        least = peaks[c, MINUTIL]
        flat = True
        for i in range(points):
            if curve[i] != least:
                flat = False
                break
        if flat:
            summit = peaks[c, SUMMIT]
            best = 0
            if summit > high:
                best = points - 1
            elif summit >= low:
                for i in range(1, points):
                    if abs(low + delta * i - summit) < abs(low + delta * best - summit):
                        best = i
            curve[best] = peaks[c, MAXUTIL]
    return curve


@njit(cache=True)
def peak_block(
    peaks: Array, low: float, high: float, delta: float, points: int, wrap: bool, add: bool, insist: bool
) -> Array:
    """The block of `peak_curve`."""
    rows, count = pieces_of_curve(peak_curve(peaks, low, high, delta, points, wrap, add, insist))
    return block_of_lines(rows, count, points)


@njit(cache=True)
def coupled_peak(summit: float, shape: Array, second: Array) -> Array:
    """`kernels.coupled` of one peak and the block `second`.

    `shape` holds what stays the same from summit to summit: peak width, base width, summit delta, least and
    highest utility; low, high, delta and points of the variable; 1 if it wraps; the two weights; the limits.
    """
    peak = np.empty((1, 6))
    peak[0, SUMMIT] = summit
    peak[0, PEAKWIDTH] = shape[0]
    peak[0, BASEWIDTH] = shape[1]
    peak[0, SUMMITDELTA] = shape[2]
    peak[0, MINUTIL] = shape[3]
    peak[0, MAXUTIL] = shape[4]
    first = peak_block(peak, shape[5], shape[6], shape[7], int(shape[8]), shape[9] > 0.0, False, True)
    return coupled(first, second, shape[10], shape[11], shape[12], shape[13])


@njit(cache=True)
def heading_curve(
    low: float,
    delta: float,
    points: int,
    summit: float,
    deltas: Array,
    utils: Array,
    leasts: Array,
    most: float,
) -> Array:
    """A preference falling at different rates to port (column 0) and to starboard (column 1), degrees."""
    curve = np.empty(points)
    for i in range(points):
        v = low + delta * i
        if summit < 180.0:
            port = v < summit or summit + 360.0 - v < 180.0
        else:
            port = 0.0 < summit - v < 180.0
        side = 0 if port else 1
        x = summit - v if port else v - summit
        if x < 0.0:
            x += 360.0
        near = deltas[side]
        knee = utils[side]
        if x == 0.0:
            curve[i] = most
        elif x == near:
            curve[i] = knee
        elif x < near:
            curve[i] = most - (most - knee) * x / near
        else:
            curve[i] = knee - (knee - leasts[side]) * (x - near) / (180.0 - near)
    return curve


@njit(cache=True)
def heading_block(
    low: float,
    delta: float,
    points: int,
    summit: float,
    deltas: Array,
    utils: Array,
    leasts: Array,
    most: float,
) -> Array:
    """The block of `heading_curve`."""
    rows, count = pieces_of_curve(heading_curve(low, delta, points, summit, deltas, utils, leasts, most))
    return block_of_lines(rows, count, points)


@njit(cache=True)
def knots_block(at: Array, values: Array, points: int) -> Array:
    """Straight pieces through knots at increasing indexes; the first knot is index 0, the last the top."""
    count = at.size - 1
    rows = np.empty((max(count, 1), 4))
    if count == 0:
        rows[0, 0] = 0
        rows[0, 1] = 0
        rows[0, 2] = 0.0
        rows[0, 3] = values[0]
        return block_of_lines(rows, 1, points)
    for p in range(count):
        slope = (values[p + 1] - values[p]) / (at[p + 1] - at[p])
        rows[p, 0] = at[p] if p == 0 else at[p] + 1
        rows[p, 1] = at[p + 1]
        rows[p, 2] = slope
        rows[p, 3] = values[p] - slope * at[p]
    return block_of_lines(rows, count, points)
