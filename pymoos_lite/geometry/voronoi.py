"""Voronoi cells inside a convex region: what is nearer to one point than to any other.

A cell is cut out of the region by one straight line per neighbour, the perpendicular bisector; the part on
the own side stays. No diagram of all points is needed, since a vessel wants only its own cell.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import XY

MERGE_DISTANCE = 1.0
"""Metres; vertices of a cell nearer to each other than this become one."""


def cut(points: list[XY], nx: float, ny: float, c: float) -> list[XY]:
    """The part of a convex polygon where nx * x + ny * y <= c; may be empty."""
    kept: list[XY] = []
    n = len(points)
    sides = [nx * x + ny * y - c for x, y in points]
    for i in range(n):
        j = (i + 1) % n
        a, b = sides[i], sides[j]
        if a <= 0.0:
            kept.append(points[i])
        if (a < 0.0 < b) or (b < 0.0 < a):
            t = a / (a - b)
            (x1, y1), (x2, y2) = points[i], points[j]
            kept.append((x1 + t * (x2 - x1), y1 + t * (y2 - y1)))
    return kept


def voronoi_cell(
    region: Polygon, own: XY, others: Iterable[XY], merge: float = MERGE_DISTANCE
) -> Polygon | None:
    """The part of a convex region that is nearer to `own` than to any of `others`.

    None when `own` is not in the region. Another exactly at `own` cuts nothing off. Vertices nearer than
    `merge` metres to the one before become one, unless too few would be left; 0 keeps all, and then the
    cells of all points inside a region tile it.
    """
    if not region.contains(*own):
        return None
    points = list(region.points)
    ox, oy = own
    for x, y in others:
        dx, dy = x - ox, y - oy
        if dx == 0.0 and dy == 0.0:
            continue
        # |p - own| <= |p - other|, relative to own so that far datums lose no digits.
        c = (dx * dx + dy * dy) / 2.0 + dx * ox + dy * oy
        points = cut(points, dx, dy, c)
        if len(points) < 3:
            return None
    return Polygon(tuple(merged(points, merge)))


def merged(points: list[XY], distance: float) -> list[XY]:
    """Vertices without those nearer than `distance` to the one kept before; all if fewer than 3 would stay."""
    kept: list[XY] = []
    for point in points:
        if not kept or math.dist(point, kept[-1]) >= distance:
            kept.append(point)
    while len(kept) > 1 and math.dist(kept[0], kept[-1]) < distance:
        kept.pop()
    return kept if len(kept) >= 3 else points
