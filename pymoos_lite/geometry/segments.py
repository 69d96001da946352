"""Points against segments and rays, on plain floats: the small helpers of behaviors.md A2.

A segment is (x1, y1, x2, y2); a ray starts at a point and runs along a heading without end.
Metres and degrees as everywhere (0 = north, clockwise).
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from pymoos_lite.geometry.angles import angle180, bearing, project_point, unit_vector

MISS = -1.0
_TOUCH = 1e-12


def nearest_on_segment(
    x1: float, y1: float, x2: float, y2: float, px: float, py: float
) -> tuple[float, float]:
    """Point of the segment nearest to (px, py): the perpendicular foot, held between the ends."""
    dx = x2 - x1
    dy = y2 - y1
    square = dx * dx + dy * dy
    if square == 0.0:
        return x1, y1
    t = ((px - x1) * dx + (py - y1) * dy) / square
    if t <= 0.0:
        return x1, y1
    if t >= 1.0:
        return x2, y2
    return x1 + t * dx, y1 + t * dy


def dist_to_segment(x1: float, y1: float, x2: float, y2: float, px: float, py: float) -> float:
    """Distance from (px, py) to the segment."""
    nx, ny = nearest_on_segment(x1, y1, x2, y2, px, py)
    return math.hypot(px - nx, py - ny)


def dist_to_segments(segments: Iterable[tuple[float, float, float, float]], px: float, py: float) -> float:
    """Distance from (px, py) to the nearest of several segments; infinite when there are none."""
    best = math.inf
    # `dist_to_segment` written out: loiterers ask this of every edge in every iteration.
    for x1, y1, x2, y2 in segments:
        dx = x2 - x1
        dy = y2 - y1
        square = dx * dx + dy * dy
        t = ((px - x1) * dx + (py - y1) * dy) / square if square != 0.0 else 0.0
        if t <= 0.0:
            far = math.hypot(px - x1, py - y1)
        elif t >= 1.0:
            far = math.hypot(px - x2, py - y2)
        else:
            far = math.hypot(px - (x1 + t * dx), py - (y1 + t * dy))
        if far < best:
            best = far
    return best


def ray_dist_to_segment(
    x1: float, y1: float, x2: float, y2: float, px: float, py: float, heading: float
) -> float:
    """Distance along the ray from (px, py) to where it first meets the segment; -1 when it misses."""
    ux, uy = unit_vector(heading)
    # Along the ray and to its right: the ray is the positive first axis of these coordinates.
    a1 = (x1 - px) * ux + (y1 - py) * uy
    r1 = (x1 - px) * uy - (y1 - py) * ux
    a2 = (x2 - px) * ux + (y2 - py) * uy
    r2 = (x2 - px) * uy - (y2 - py) * ux
    if (r1 > 0.0 and r2 > 0.0) or (r1 < 0.0 and r2 < 0.0):
        return MISS
    if r1 == r2:
        # The segment lies on the ray's line.
        if max(a1, a2) < 0.0:
            return MISS
        return max(0.0, min(a1, a2))
    along = a1 + (a2 - a1) * r1 / (r1 - r2)
    if along >= 0.0:
        return along
    # A ray that starts on the segment meets it there, whatever the last bit says.
    return 0.0 if along >= -_TOUCH * (abs(a1) + abs(a2)) else MISS


def ray_dist_to_segments(
    segments: Iterable[tuple[float, float, float, float]], px: float, py: float, heading: float
) -> float:
    """Distance along the ray from (px, py) to the first of several segments it meets; -1 when it meets none."""
    ux, uy = unit_vector(heading)
    best = math.inf
    # `ray_dist_to_segment` written out: behaviours ask this of every edge in every iteration.
    for x1, y1, x2, y2 in segments:
        r1 = (x1 - px) * uy - (y1 - py) * ux
        r2 = (x2 - px) * uy - (y2 - py) * ux
        if (r1 > 0.0 and r2 > 0.0) or (r1 < 0.0 and r2 < 0.0):
            continue
        a1 = (x1 - px) * ux + (y1 - py) * uy
        a2 = (x2 - px) * ux + (y2 - py) * uy
        if r1 == r2:
            if max(a1, a2) < 0.0:
                continue
            along = max(0.0, min(a1, a2))
        else:
            along = a1 + (a2 - a1) * r1 / (r1 - r2)
            if along < 0.0:
                if along < -_TOUCH * (abs(a1) + abs(a2)):
                    continue
                along = 0.0
        if along < best:
            best = along
    return best if best < math.inf else MISS


def dist_to_ray(rx: float, ry: float, heading: float, px: float, py: float) -> float:
    """Distance from (px, py) to the ray that starts at (rx, ry)."""
    ux, uy = unit_vector(heading)
    along = (px - rx) * ux + (py - ry) * uy
    if along <= 0.0:
        return math.hypot(px - rx, py - ry)
    return abs((px - rx) * uy - (py - ry) * ux)


def segments_cross(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> bool:
    """True when segments a-b and c-d have a point in common, touching ends included."""
    d1 = _side(cx, cy, dx, dy, ax, ay)
    d2 = _side(cx, cy, dx, dy, bx, by)
    d3 = _side(ax, ay, bx, by, cx, cy)
    d4 = _side(ax, ay, bx, by, dx, dy)
    if ((d1 > 0.0 > d2) or (d1 < 0.0 < d2)) and ((d3 > 0.0 > d4) or (d3 < 0.0 < d4)):
        return True
    return (
        (d1 == 0.0 and _between(cx, cy, dx, dy, ax, ay))
        or (d2 == 0.0 and _between(cx, cy, dx, dy, bx, by))
        or (d3 == 0.0 and _between(ax, ay, bx, by, cx, cy))
        or (d4 == 0.0 and _between(ax, ay, bx, by, dx, dy))
    )


def segment_dist_to_segment(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> float:
    """Smallest distance between two segments, 0 when they cross or touch."""
    if segments_cross(ax, ay, bx, by, cx, cy, dx, dy):
        return 0.0
    return min(
        dist_to_segment(ax, ay, bx, by, cx, cy),
        dist_to_segment(ax, ay, bx, by, dx, dy),
        dist_to_segment(cx, cy, dx, dy, ax, ay),
        dist_to_segment(cx, cy, dx, dy, bx, by),
    )


def _side(x1: float, y1: float, x2: float, y2: float, px: float, py: float) -> float:
    return (x2 - x1) * (py - y1) - (y2 - y1) * (px - x1)


def _between(x1: float, y1: float, x2: float, y2: float, px: float, py: float) -> bool:
    return min(x1, x2) <= px <= max(x1, x2) and min(y1, y2) <= py <= max(y1, y2)


def segment_angle(x1: float, y1: float, x2: float, y2: float, x3: float, y3: float) -> float:
    """Turn at the middle point, (-180, 180], positive to the right; 0 when a leg has no length."""
    if (x1 == x2 and y1 == y2) or (x2 == x3 and y2 == y3):
        return 0.0
    return angle180(bearing(x2, y2, x3, y3) - bearing(x1, y1, x2, y2))


def angle_from_three_points(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> float:
    """Interior angle at a of the triangle a, b, c, [0, 180]; 0 when a coincides with b or c."""
    ux, uy = bx - ax, by - ay
    vx, vy = cx - ax, cy - ay
    if (ux == 0.0 and uy == 0.0) or (vx == 0.0 and vy == 0.0):
        return 0.0
    return math.degrees(math.atan2(abs(ux * vy - uy * vx), ux * vx + uy * vy))


def three_point_cross(x0: float, y0: float, x1: float, y1: float, x2: float, y2: float) -> float:
    """Cross product of three successive points: above 0.01 a right turn, below -0.01 a left turn."""
    return (x2 - x0) * (y1 - y0) - (x1 - x0) * (y2 - y0)


def dist_to_line(x1: float, y1: float, x2: float, y2: float, px: float, py: float) -> float:
    """Distance from (px, py) to the endless line through two points (to the point when they coincide)."""
    length = math.hypot(x2 - x1, y2 - y1)
    if length == 0.0:
        return math.hypot(px - x1, py - y1)
    return abs(_side(x1, y1, x2, y2, px, py)) / length


def turn_gap(
    osx: float,
    osy: float,
    osh: float,
    radius: float,
    x1: float,
    y1: float,
    x2: float,
    y2: float,
    *,
    right: bool,
) -> float:
    """Gap between a vessel's turning circle on one side and the line through two points; 0 if they meet."""
    cx, cy = project_point(osh + (90.0 if right else -90.0), radius, osx, osy)
    return max(0.0, dist_to_line(x1, y1, x2, y2, cx, cy) - radius)
