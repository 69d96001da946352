"""Polygons grown by a distance, corners rounded: buffer zones around regions and obstacles."""

from __future__ import annotations

import math
from dataclasses import replace

from pymoos_lite.geometry.angles import angle360, project_point
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import XY

# Nearer to the vertex before it than this, the second copy of a corner is left out.
_MIN_GAP = 1.0


def buffered(polygon: Polygon, distance: float, degrees: float = 30.0) -> Polygon:
    """The polygon grown outward by `distance` metres, as behaviors.md A8 has it.

    Every corner becomes its copies on the two shifted edges with arc points every `degrees` (held to
    0.2..45) between them. Returns the
    polygon itself when it is not convex, the distance is not positive, or the result cannot be made convex.
    """
    if not polygon.is_convex or not distance > 0.0:
        return polygon
    step = min(max(degrees, 0.2), 45.0)
    sign = -1.0 if polygon.signed_area > 0.0 else 1.0
    outward = [
        angle360(math.degrees(math.atan2(x2 - x1, y2 - y1)) - 90.0 * sign) for x1, y1, x2, y2 in polygon.edges
    ]
    points: list[XY] = []
    for i, (x, y) in enumerate(polygon.points):
        start = outward[i - 1]
        span = angle360((outward[i] - start) * sign)
        if span > 180.0:
            # Colinear edges: their directions differ by round-off only, to the wrong side.
            span = 0.0
        points.append(project_point(start, distance, x, y))
        for j in range(1, int(span / step + 1e-9)):
            points.append(project_point(start + sign * j * step, distance, x, y))
        last = project_point(outward[i], distance, x, y)
        if math.dist(last, points[-1]) > _MIN_GAP:
            points.append(last)
    grown = replace(polygon, points=tuple(points), zs=(), properties=()).settled()
    return grown if grown.is_convex else polygon
