"""Headings, bearings and turns on plain floats.

Degrees, 0 = north, clockwise; x east, y north, metres; a heading h points along (sin h, cos h).
Scalar on purpose: these run inside every behaviour tick, where a numpy call costs more than the sum.
The rules, including what happens at the boundaries, are behaviors.md A1 and A2.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

_RAD = math.pi / 180.0


def angle360(degrees: float) -> float:
    """The same direction in [0, 360)."""
    wrapped = degrees % 360.0
    # A tiny negative angle rounds up to exactly 360.0 in floating point.
    return wrapped if wrapped < 360.0 else 0.0


def angle180(degrees: float) -> float:
    """The same direction in (-180, 180]."""
    wrapped = degrees % 360.0
    return wrapped - 360.0 if wrapped > 180.0 else wrapped


def angle_diff(a: float, b: float) -> float:
    """Smallest absolute difference of two directions, [0, 180]."""
    gap = (a - b) % 360.0
    return 360.0 - gap if gap > 180.0 else gap


def heading_to_radians(heading: float) -> float:
    """Heading to the mathematical angle (radians from east, counter-clockwise) in [-pi, pi]."""
    return angle180(90.0 - heading) * _RAD


def radians_to_heading(radians: float) -> float:
    """Mathematical angle (radians from east, counter-clockwise) to a heading in [0, 360)."""
    return angle360(90.0 - radians / _RAD)


def unit_vector(heading: float) -> tuple[float, float]:
    """(sin h, cos h): east and north parts of a unit step; exact for 0, 90, 180 and 270."""
    h = heading % 360.0
    if h == 0.0 or h == 360.0:
        return 0.0, 1.0
    if h == 90.0:
        return 1.0, 0.0
    if h == 180.0:
        return 0.0, -1.0
    if h == 270.0:
        return -1.0, 0.0
    r = h * _RAD
    return math.sin(r), math.cos(r)


def bearing(from_x: float, from_y: float, to_x: float, to_y: float) -> float:
    """Absolute bearing of the second point from the first, [0, 360); 0 when they coincide.

    On an axis the answer is exactly 0, 90, 180 or 270.
    """
    dx = to_x - from_x
    dy = to_y - from_y
    if dx == 0.0 and dy == 0.0:
        return 0.0
    degrees = math.atan2(dx, dy) / _RAD % 360.0
    return degrees if degrees < 360.0 else 0.0


def distance(ax: float, ay: float, bx: float, by: float) -> float:
    """Euclidean distance, metres."""
    return math.hypot(bx - ax, by - ay)


def rel_bearing(osx: float, osy: float, osh: float, x: float, y: float) -> float:
    """Bearing of (x, y) relative to a vessel's bow, [0, 360): 90 is the starboard beam."""
    return angle360(bearing(osx, osy, x, y) - osh)


def abs_rel_bearing(osx: float, osy: float, osh: float, x: float, y: float) -> float:
    """Angle off the bow, [0, 180], whichever side."""
    return angle_diff(bearing(osx, osy, x, y), osh)


def is_port_turn(osh: float, heading: float) -> bool:
    """True when the shorter turn from osh to heading is to port (a half turn is neither side)."""
    return angle360(heading - osh) > 180.0


def is_star_turn(osh: float, heading: float) -> bool:
    """True when the shorter turn from osh to heading is to starboard (a half turn is neither side)."""
    return 0.0 < angle360(heading - osh) < 180.0


def speed_in_heading(osh: float, osv: float, heading: float) -> float:
    """Part of the velocity (osh, osv) along heading, m/s; exact at 0, 90 and 180 degrees off."""
    gap = angle_diff(osh, heading)
    if gap == 0.0:
        return osv
    if gap == 90.0:
        return 0.0
    if gap == 180.0:
        return -osv
    return osv * math.cos(gap * _RAD)


def contains_angle(a: float, b: float, query: float) -> bool:
    """True when query lies inside the smaller arc between a and b; a 180 degree arc contains everything."""
    span = angle180(b - a)
    if abs(span) == 180.0:
        return True
    offset = angle180(query - a)
    return 0.0 <= offset <= span if span >= 0.0 else span <= offset <= 0.0


def is_fore(osx: float, osy: float, osh: float, x: float, y: float) -> bool:
    """True when the point is on or ahead of the vessel's beam line; False for the vessel's own position."""
    if x == osx and y == osy:
        return False
    off_bow = rel_bearing(osx, osy, osh, x, y)
    return off_bow <= 90.0 or off_bow >= 270.0


def is_aft(osx: float, osy: float, osh: float, x: float, y: float) -> bool:
    """True when the point is on or behind the vessel's beam line; False for the vessel's own position."""
    if x == osx and y == osy:
        return False
    return 90.0 <= rel_bearing(osx, osy, osh, x, y) <= 270.0


def is_star(osx: float, osy: float, osh: float, x: float, y: float) -> bool:
    """True to starboard, dead ahead and dead astern; False for the vessel's own position."""
    if x == osx and y == osy:
        return False
    return rel_bearing(osx, osy, osh, x, y) <= 180.0


def is_port(osx: float, osy: float, osh: float, x: float, y: float) -> bool:
    """True to port and dead astern, not dead ahead; False for the vessel's own position."""
    if x == osx and y == osy:
        return False
    return rel_bearing(osx, osy, osh, x, y) >= 180.0


def project_point(heading: float, dist: float, x: float, y: float) -> tuple[float, float]:
    """The point dist metres from (x, y) along heading; exactly axis-aligned for 0, 90, 180, 270."""
    ux, uy = unit_vector(heading)
    return x + dist * ux, y + dist * uy


def heading_average(headings: Iterable[float]) -> float:
    """Direction of the vector sum of unit headings, [0, 360); 0 for none or for a perfect balance."""
    sx = sy = 0.0
    for heading in headings:
        ux, uy = unit_vector(heading)
        sx += ux
        sy += uy
    return angle360(math.atan2(sx, sy) / _RAD)


def snap_to_step(value: float, step: float) -> float:
    """Nearest multiple of step, halves away from zero; step <= 0 returns value unchanged."""
    if step <= 0.0:
        return value
    return math.copysign(math.floor(abs(value) / step + 0.5) * step, value) + 0.0
