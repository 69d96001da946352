"""At which vertex a vessel joins the circuit around a polygon (behaviors.md C2).

Plain geometry: no state, nothing posted. Vertices are numbered in the order in which they are to be
sailed: clockwise polygons clockwise.
"""

from __future__ import annotations

from pymoos_lite.geometry.angles import angle_diff, bearing
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.segments import segment_angle


def entry_from_outside(polygon: Polygon, clockwise: bool, x: float, y: float) -> int:
    """The visible vertex after which the way around goes on most smoothly; -1 if none is visible.

    Clockwise that is the one with the sharpest turn to the right, counter-clockwise to the left: the
    tangent that leaves the polygon on the inner side.
    """
    best, found = 0.0, -1
    for i in polygon.viewable_vertices(x, y):
        turn = _turn_at(polygon, i, x, y)
        if not clockwise:
            turn = -turn
        if found < 0 or turn > best:
            best, found = turn, i
    return found


def entry_from_inside(polygon: Polygon, x: float, y: float, heading: float, spiral: float) -> int:
    """The vertex after which the vessel has to turn least; `spiral` degrees favour the one ahead of it."""
    ahead = min(range(len(polygon)), key=lambda i: angle_diff(heading, bearing(x, y, *polygon.points[i])))

    def cost(i: int) -> float:
        return abs(_turn_at(polygon, i, x, y)) + (spiral if i == ahead else 0.0)

    return min(range(len(polygon)), key=cost)


def entry(polygon: Polygon, clockwise: bool, x: float, y: float, heading: float, spiral: float) -> int:
    """The vertex to make for, from wherever the vessel is."""
    found = -1 if polygon.contains(x, y) else entry_from_outside(polygon, clockwise, x, y)
    return found if found >= 0 else entry_from_inside(polygon, x, y, heading, spiral)


def better_clockwise(polygon: Polygon, reverse: Polygon, x: float, y: float, heading: float) -> bool:
    """Whether sailing `polygon` (clockwise) needs less of a turn to begin with than sailing `reverse`.

    Both hold the same vertices in opposite orders; (x, y) is outside. A tie is for `reverse`.
    """
    turns = []
    for shape, clockwise in ((polygon, True), (reverse, False)):
        vertex = shape.points[entry(shape, clockwise, x, y, heading, 0.0)]
        turns.append(angle_diff(heading, bearing(x, y, *vertex)))
    return turns[0] < turns[1]


def _turn_at(polygon: Polygon, i: int, x: float, y: float) -> float:
    following = polygon.points[(i + 1) % len(polygon)]
    return segment_angle(x, y, *polygon.points[i], *following)
