"""Compiled utilities over courses and speeds, for behaviours about another vessel.

Plain arrays in and out. Own ship's position relative to the contact is (px, py), the contact's velocity
(cvx, cvy); unit vectors of the courses come ready-made, (east, north) = (sin, cos).
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

NEAR_UTILITY = 25.0
"""Utility at the smaller distance, from where it rises to 100 at the larger; nearer it is 0."""


@njit(cache=True, error_model="numpy")
def _closest(px: float, py: float, wx: float, wy: float, horizon: float) -> float:
    """Least distance within `horizon` of one that is at (px, py) and moves at (wx, wy)."""
    # No branches, so that several speeds are done at once. Relative rest has k1 = 0: t is 0 then.
    k1 = px * wx + py * wy
    k2 = wx * wx + wy * wy + 1e-300
    t = min(max(-k1 / k2, 0.0), horizon)
    x = px + t * wx
    y = py + t * wy
    return sqrt(x * x + y * y)


@njit(cache=True, error_model="numpy")
def _slope(near: float, far: float) -> float:
    return (100.0 - NEAR_UTILITY) / (far - near) if far > near else 0.0


@njit(cache=True, error_model="numpy")
def _utility(c: float, near: float, far: float, slope: float) -> float:
    """0 below `near`, 100 above `far`, between them 25 to 100."""
    value = NEAR_UTILITY + (c - near) * slope
    value = 100.0 if c > far else value
    return 0.0 if c < near else value


@njit(cache=True, error_model="numpy")
def avoidance(
    px: float,
    py: float,
    cvx: float,
    cvy: float,
    east: Array,
    north: Array,
    speeds: Array,
    horizon: float,
    near: float,
    far: float,
    out: Array,
) -> None:
    """out[i, j] = utility of the closest approach at course i and speed j (behaviors.md C6); see `_utility`."""
    slope = _slope(near, far)
    for i in range(east.size):
        ux = east[i]
        uy = north[i]
        for j in range(speeds.size):
            c = _closest(px, py, speeds[j] * ux - cvx, speeds[j] * uy - cvy, horizon)
            out[i, j] = _utility(c, near, far, slope)


@njit(cache=True, error_model="numpy")
def avoidance_at(
    px: float,
    py: float,
    cvx: float,
    cvy: float,
    vx: Array,
    vy: Array,
    horizon: float,
    near: float,
    far: float,
    out: Array,
) -> None:
    """out[k] = utility, as in `avoidance`, of going at (vx[k], vy[k]): speed times unit vector."""
    slope = _slope(near, far)
    for k in range(out.size):
        c = _closest(px, py, vx[k] - cvx, vy[k] - cvy, horizon)
        out[k] = _utility(c, near, far, slope)


@njit(cache=True, error_model="numpy")
def avoidance_of(cpa: Array, near: float, far: float) -> None:
    """Closest approaches, in place, into the utilities of `avoidance`."""
    slope = _slope(near, far)
    for i in range(cpa.shape[0]):
        for j in range(cpa.shape[1]):
            cpa[i, j] = _utility(cpa[i, j], near, far, slope)


@njit(cache=True, error_model="numpy")
def pursuit(
    px: float,
    py: float,
    cvx: float,
    cvy: float,
    east: Array,
    north: Array,
    speeds: Array,
    horizon: float,
    patience: float,
    slowest: float,
    fastest: float,
    out: Array,
) -> None:
    """out[i, j] = utility of a course and speed for closing in on a contact (behaviors.md C11).

    The share `patience` (0 to 1) rewards a small closest approach, the rest a high rate of closure, which
    counts 0 at `slowest` and 100 at `fastest`. The vessels must be apart.
    """
    reach = sqrt(px * px + py * py)
    closing = 100.0 * (1.0 - patience) / (fastest - slowest) if fastest > slowest else 0.0
    for i in range(east.size):
        ux = east[i]
        uy = north[i]
        for j in range(speeds.size):
            wx = speeds[j] * ux - cvx
            wy = speeds[j] * uy - cvy
            rate = -(px * wx + py * wy) / reach
            c = _closest(px, py, wx, wy, horizon)
            out[i, j] = (rate - slowest) * closing + patience * 100.0 * (1.0 - c / reach)
