"""Compiled loops over courses and speeds: closest points of approach and distances to polygons.

Plain arrays in and out, no objects; each kernel's slow twin is in the tests. Unit vectors of headings come
in ready-made, (east, north) = (sin, cos), so that the quarter turns stay exact.
"""

from __future__ import annotations

from math import hypot, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@njit(cache=True, inline="always")
def cpa_square(px: float, py: float, wx: float, wy: float, horizon: float) -> float:
    """Least squared distance within the horizon; p = own ship minus contact now, w its rate of change."""
    k0 = px * px + py * py
    k1 = px * wx + py * wy
    if k1 >= 0.0:
        return k0
    k2 = wx * wx + wy * wy
    t = -k1 / k2
    if t > horizon:
        t = horizon
    # From the position then, not from the quadratic: a near collision would lose its digits there.
    x = px + t * wx
    y = py + t * wy
    return x * x + y * y


@njit(cache=True)
def cpa_grid(
    px: float,
    py: float,
    cvx: float,
    cvy: float,
    east: Array,
    north: Array,
    speeds: Array,
    horizon: float,
    out: Array,
) -> None:
    """out[i, j] = CPA distance at course i (unit vector east[i], north[i]) and speed j."""
    for i in range(east.size):
        ux = east[i]
        uy = north[i]
        for j in range(speeds.size):
            v = speeds[j]
            out[i, j] = sqrt(cpa_square(px, py, v * ux - cvx, v * uy - cvy, horizon))


@njit(cache=True)
def cpa_points(
    px: float,
    py: float,
    cvx: float,
    cvy: float,
    east: Array,
    north: Array,
    speeds: Array,
    horizon: float,
    out: Array,
) -> None:
    """out[k] = CPA distance at course k and speed k: the grid's rule at scattered points."""
    for k in range(east.size):
        v = speeds[k]
        out[k] = sqrt(cpa_square(px, py, v * east[k] - cvx, v * north[k] - cvy, horizon))


@njit(cache=True)
def _ray_to_polygon(x: float, y: float, ux: float, uy: float, xs: Array, ys: Array) -> float:
    """Least distance from a ray along the unit vector (ux, uy) to a convex polygon it starts outside of."""
    n = xs.size
    best = np.inf
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        x1 = xs[i] - x
        y1 = ys[i] - y
        x2 = xs[j] - x
        y2 = ys[j] - y
        a1 = x1 * ux + y1 * uy
        r1 = x1 * uy - y1 * ux
        a2 = x2 * ux + y2 * uy
        r2 = x2 * uy - y2 * ux
        if (r1 >= 0.0 >= r2) or (r1 <= 0.0 <= r2):
            if r1 == r2:
                if max(a1, a2) >= 0.0:
                    return 0.0
            elif a1 + (a2 - a1) * r1 / (r1 - r2) >= 0.0:
                return 0.0
        # The nearest pair of a missing ray and an edge includes the edge's vertex or the ray's start.
        d = abs(r1) if a1 > 0.0 else hypot(x1, y1)
        best = min(best, d)
        best = min(best, _origin_to_segment(x1, y1, x2, y2))
    return best


@njit(cache=True, inline="always")
def _origin_to_segment(x1: float, y1: float, x2: float, y2: float) -> float:
    dx = x2 - x1
    dy = y2 - y1
    square = dx * dx + dy * dy
    if square == 0.0:
        return hypot(x1, y1)
    t = -(x1 * dx + y1 * dy) / square
    t = min(max(t, 0.0), 1.0)
    return hypot(x1 + t * dx, y1 + t * dy)


@njit(cache=True)
def _inside(x: float, y: float, xs: Array, ys: Array) -> bool:
    """True inside a convex polygon or on its boundary, either orientation."""
    n = xs.size
    left = True
    right = True
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        side = (xs[j] - xs[i]) * (y - ys[i]) - (ys[j] - ys[i]) * (x - xs[i])
        if side < 0.0:
            left = False
        elif side > 0.0:
            right = False
    return left or right


@njit(cache=True)
def _segment_to_polygon(ax: float, ay: float, bx: float, by: float, xs: Array, ys: Array) -> float:
    """Least distance between a segment and a convex polygon, 0 when they touch."""
    if _inside(ax, ay, xs, ys) or _inside(bx, by, xs, ys):
        return 0.0
    n = xs.size
    best = np.inf
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        d1 = (bx - ax) * (ys[i] - ay) - (by - ay) * (xs[i] - ax)
        d2 = (bx - ax) * (ys[j] - ay) - (by - ay) * (xs[j] - ax)
        d3 = (xs[j] - xs[i]) * (ay - ys[i]) - (ys[j] - ys[i]) * (ax - xs[i])
        d4 = (xs[j] - xs[i]) * (by - ys[i]) - (ys[j] - ys[i]) * (bx - xs[i])
        if ((d1 > 0.0 > d2) or (d1 < 0.0 < d2)) and ((d3 > 0.0 > d4) or (d3 < 0.0 < d4)):
            return 0.0
        best = min(best, _origin_to_segment(xs[i] - ax, ys[i] - ay, xs[j] - ax, ys[j] - ay))
        best = min(best, _origin_to_segment(xs[i] - bx, ys[i] - by, xs[j] - bx, ys[j] - by))
        best = min(best, _origin_to_segment(ax - xs[i], ay - ys[i], bx - xs[i], by - ys[i]))
    return best


@njit(cache=True)
def seglr_to_polygon(
    port_x: Array,
    port_y: Array,
    star_x: Array,
    star_y: Array,
    counts: NDArray[np.int64],
    east: Array,
    north: Array,
    xs: Array,
    ys: Array,
    out: Array,
) -> None:
    """out[i] = least distance to a convex polygon of the turn path of course i.

    port_* and star_* are the spokes of the two turning circles, own position first. counts[i] says how
    many spokes course i uses, negative for a port turn; then a ray leaves along (east[i], north[i]).
    The distance of the chain up to each spoke is accumulated once per side.
    """
    port = _chain_to_polygon(port_x, port_y, xs, ys)
    star = _chain_to_polygon(star_x, star_y, xs, ys)
    for i in range(counts.size):
        k = counts[i]
        if k < 0:
            chain = port[-k]
            ray = _ray_or_inside(port_x[-k], port_y[-k], east[i], north[i], xs, ys)
        else:
            chain = star[k]
            ray = _ray_or_inside(star_x[k], star_y[k], east[i], north[i], xs, ys)
        out[i] = min(chain, ray)


@njit(cache=True)
def _ray_or_inside(x: float, y: float, ux: float, uy: float, xs: Array, ys: Array) -> float:
    if _inside(x, y, xs, ys):
        return 0.0
    return _ray_to_polygon(x, y, ux, uy, xs, ys)


@njit(cache=True)
def _chain_to_polygon(px: Array, py: Array, xs: Array, ys: Array) -> Array:
    """Running least distance of the legs up to each vertex; the first entry is that of the first vertex."""
    least = np.empty(px.size)
    least[0] = _segment_to_polygon(px[0], py[0], px[0], py[0], xs, ys)
    for i in range(1, px.size):
        leg = _segment_to_polygon(px[i - 1], py[i - 1], px[i], py[i], xs, ys)
        least[i] = min(least[i - 1], leg)
    return least


@njit(cache=True)
def path_cpa_grid(
    port_x: Array,
    port_y: Array,
    star_x: Array,
    star_y: Array,
    counts: NDArray[np.int64],
    east: Array,
    north: Array,
    speeds: Array,
    cx: float,
    cy: float,
    cvx: float,
    cvy: float,
    horizon: float,
    out: Array,
) -> None:
    """out[i, j] = CPA distance when own ship follows the turn path of course i at speed j (see above)."""
    for i in range(counts.size):
        k = counts[i]
        px = port_x if k < 0 else star_x
        py = port_y if k < 0 else star_y
        last = abs(k)
        for j in range(speeds.size):
            v = speeds[j]
            if v <= 0.0:
                out[i, j] = sqrt(cpa_square(px[0] - cx, py[0] - cy, -cvx, -cvy, horizon))
                continue
            best = np.inf
            t = 0.0
            for m in range(last):
                left = horizon - t
                if left <= 0.0:
                    break
                dx = px[m + 1] - px[m]
                dy = py[m + 1] - py[m]
                leg = hypot(dx, dy)
                if leg == 0.0:
                    continue
                took = leg / v
                wx = v * dx / leg - cvx
                wy = v * dy / leg - cvy
                rx = px[m] - (cx + t * cvx)
                ry = py[m] - (cy + t * cvy)
                best = min(best, cpa_square(rx, ry, wx, wy, min(took, left)))
                t += took
            left = horizon - t
            if left >= 0.0:
                rx = px[last] - (cx + t * cvx)
                ry = py[last] - (cy + t * cvy)
                best = min(best, cpa_square(rx, ry, v * east[i] - cvx, v * north[i] - cvy, left))
            out[i, j] = sqrt(best)
