"""Vertices of the shapes that missions describe by a few numbers: lawnmower, zigzag, ellipse, wedge, ...

Algorithms and vertex orders are behaviors.md A4. Every function returns (x, y) pairs, and none returns more
than MAX_VERTICES: a slip in a mission file (swath 0.001) must not eat the memory of a vehicle.
"""

from __future__ import annotations

import math

from pymoos_lite.geometry.angles import angle360, bearing, project_point, snap_to_step
from pymoos_lite.geometry.shapes import XY

MAX_VERTICES = 20_000


class PatternError(ValueError):
    """Numbers that describe no shape: out of range, or asking for more than MAX_VERTICES vertices."""


def lawnmower(
    x: float,
    y: float,
    width: float,
    height: float,
    swath: float,
    *,
    degs: float = 0.0,
    east_west: bool = True,
    start: XY = (0.0, 0.0),
    snap: float = 0.00001,
) -> list[XY]:
    """Parallel lanes `swath` apart over a width x height box centred at (x, y) and turned by degs.

    Two vertices per lane, alternating direction; it begins at the outer lane end nearest to `start`.
    """
    _positive(width=width, height=height, swath=swath)
    if east_west:
        width, height, degs = height, width, degs + 90.0
    ratio = width / swath + 1.99999
    if 2.0 * ratio > MAX_VERTICES:
        raise PatternError(f"a lawnmower of {ratio:.0f} lanes has more than {MAX_VERTICES} vertices")
    degs = angle360(degs)
    lanes: list[tuple[XY, XY]] = []
    for i in range(int(ratio)):
        cx, cy = project_point(degs - 90.0, width / 2.0 - i * swath, x, y)
        lanes.append(
            (
                project_point(degs, height / 2.0, cx, cy),
                project_point(degs, -height / 2.0, cx, cy),
            )
        )
    ends = (lanes[0][0], lanes[0][1], lanes[-1][0], lanes[-1][1])
    entry = min(range(4), key=lambda i: math.dist(ends[i], start))
    if entry >= 2:
        lanes.reverse()
    swap = entry % 2 == 1
    points: list[XY] = []
    for first, second in lanes:
        points += (second, first) if swap else (first, second)
        swap = not swap
    return _snapped(points, snap)


def zigzag(
    x: float,
    y: float,
    angle: float,
    length: float,
    period: float,
    amplitude: float,
    *,
    snap: float = 0.0001,
) -> list[XY]:
    """Zigzag of the given length along `angle`, from (x, y), first to the angle-90 side."""
    _positive(length=length, period=period)
    if 2.0 * length / period > MAX_VERTICES:
        raise PatternError(
            f"a zigzag of length {length} and period {period} has more than {MAX_VERTICES} vertices"
        )
    points = [(x, y)]
    side = -1.0
    i = 0
    while (along := period / 4.0 + i * period / 2.0) < length:
        ax, ay = project_point(angle, along, x, y)
        points.append(project_point(angle + 90.0, side * amplitude, ax, ay))
        side = -side
        i += 1
    return _snapped(points, snap)


def bowtie(
    x: float,
    y: float,
    height: float,
    wid1: float,
    wid2: float,
    wid3: float,
    *,
    start: XY | None = None,
    snap: float = 0.0,
) -> list[XY]:
    """Outline of a bow tie about (x, y): widths at the top, the waist and the bottom, clockwise.

    It starts at the corner of the quadrant that `start` lies in; without one at the upper left.
    """
    _positive(height=height)
    top, bottom = y + height / 2.0, y - height / 2.0
    points = [
        (x - wid1 / 2.0, top),
        (x + wid1 / 2.0, top),
        (x + wid2 / 2.0, y),
        (x + wid3 / 2.0, bottom),
        (x - wid3 / 2.0, bottom),
        (x - wid2 / 2.0, y),
    ]
    if start is not None:
        right, upper = start[0] > x, start[1] >= y
        first = (1 if right else 0) if upper else (3 if right else 4)
        points = points[first:] + points[:first]
    return _snapped(points, snap)


def ellipse(
    x: float, y: float, major: float, minor: float, count: int, *, rads: float = 0.0, snap: float = 0.0
) -> list[XY]:
    """Ellipse of full axes major and minor, counter-clockwise; rads turns it counter-clockwise from east."""
    _positive(major=major, minor=minor)
    _count(count, 4)
    c, s = math.cos(rads), math.sin(rads)
    points = []
    for i in range(count):
        phi = -math.pi + 2.0 * math.pi * i / count
        along, across = major / 2.0 * math.cos(phi), minor / 2.0 * math.sin(phi)
        points.append((x + along * c - across * s, y + across * c + along * s))
    return _snapped(points, snap)


def wedge(
    x: float, y: float, lang: float, rang: float, radius: float, steps: int, *, snap: float = 0.0
) -> list[XY]:
    """A piece of pie: the apex (x, y), then the arc clockwise from heading lang to rang in `steps` steps."""
    _positive(range=radius)
    _count(steps, 1)
    return _snapped([(x, y), *_arc(x, y, lang, rang, radius, steps)], snap)


def range_wedge(
    x: float,
    y: float,
    lang: float,
    rang: float,
    range_min: float,
    range_max: float,
    steps: int,
    *,
    snap: float = 0.0,
) -> list[XY]:
    """A piece of ring: the outer arc clockwise from lang to rang, then the inner arc back."""
    _positive(range_max=range_max)
    _count(steps, 1)
    if not 0.0 <= range_min < range_max:
        raise PatternError(f"range_min {range_min} must be at least 0 and less than range_max {range_max}")
    outer = _arc(x, y, lang, rang, range_max, steps)
    inner = _arc(x, y, lang, rang, range_min, steps) if range_min > 0.0 else [(x, y)]
    return _snapped(outer + inner[::-1], snap)


def pylon(
    x1: float, y1: float, x2: float, y2: float, axis_pad: float, perp_pad: float, *, snap: float = 0.0
) -> list[XY]:
    """Rectangle around a segment, axis_pad beyond its ends and perp_pad to both sides, from end 1's left."""
    _positive(perp_pad=perp_pad)
    if axis_pad < 0.0:
        raise PatternError(f"axis_pad must be at least 0, found {axis_pad}")
    along = bearing(x1, y1, x2, y2)
    ax, ay = project_point(along, -axis_pad, x1, y1)
    bx, by = project_point(along, axis_pad, x2, y2)
    left, right = along - 90.0, along + 90.0
    corners = [
        project_point(left, perp_pad, ax, ay),
        project_point(right, perp_pad, ax, ay),
        project_point(right, perp_pad, bx, by),
        project_point(left, perp_pad, bx, by),
    ]
    return _snapped(corners, snap)


def oval(
    x1: float, y1: float, x2: float, y2: float, radius: float, *, step_degs: float = 10.0, snap: float = 0.0
) -> list[XY]:
    """Everything within `radius` of a segment, clockwise, an arc vertex every step_degs."""
    _positive(rad=radius, draw_degs=step_degs)
    steps = max(1, math.ceil(180.0 / max(step_degs, 0.1)))
    along = bearing(x1, y1, x2, y2)
    points = _arc(x2, y2, along - 90.0, along + 90.0, radius, steps)
    points += _arc(x1, y1, along + 90.0, along + 270.0, radius, steps)
    if x1 == x2 and y1 == y2:
        points = points[:steps] + points[steps + 1 : -1]
    return _snapped(points, snap)


def _arc(x: float, y: float, start: float, end: float, radius: float, steps: int) -> list[XY]:
    span = angle360(end - start)
    return [project_point(start + span * i / steps, radius, x, y) for i in range(steps + 1)]


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not value > 0.0:
            raise PatternError(f"{name} must be greater than 0, found {value:g}")


def _count(count: int, least: int) -> None:
    if not least <= count <= MAX_VERTICES:
        raise PatternError(f"pts must be from {least} to {MAX_VERTICES}, found {count}")


def _snapped(points: list[XY], step: float) -> list[XY]:
    return [(snap_to_step(x, step), snap_to_step(y, step)) for x, y in points]
