"""Polygons: closed vertex lists with the tests and distances behaviours need.

Most questions make sense for convex polygons only; `is_convex` says so once per polygon and the answer is
kept. Rules are behaviors.md A2 and A3. Points on an edge count as inside, within 1e-9 of the polygon's size.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

from mypy_extensions import mypyc_attr

from pymoos_lite.compiled.once import once
from pymoos_lite.geometry.angles import angle360, bearing, rel_bearing, snap_to_step, unit_vector
from pymoos_lite.geometry.segments import (
    MISS,
    dist_to_ray,
    dist_to_segments,
    nearest_on_segment,
    ray_dist_to_segments,
    segment_dist_to_segment,
    segments_cross,
)
from pymoos_lite.geometry.shapes import XY, SegList

# Relative to the polygon's size: what lies this close to a line lies on it.
TOLERANCE = 1e-9

Edge = tuple[float, float, float, float]


@mypyc_attr(native_class=False)
@dataclass(frozen=True)
class Polygon(SegList):
    """A closed seglist; the last vertex joins the first."""

    @classmethod
    def radial(cls, x: float, y: float, radius: float, count: int, *, snap: float = 0.0) -> Self:
        """Regular polygon of `count` vertices, clockwise, the first half a step east of north."""
        step = 360.0 / count
        points = []
        for i in range(count):
            ux, uy = unit_vector(step / 2.0 + i * step)
            points.append((snap_to_step(x + radius * ux, snap), snap_to_step(y + radius * uy, snap)))
        return cls(tuple(points))

    @once
    def edges(self) -> tuple[Edge, ...]:
        """(x1, y1, x2, y2) of every edge, the closing one last; none for fewer than two vertices."""
        n = len(self.points)
        if n < 2:
            return ()
        count = n if n > 2 else 1
        return tuple((*self.points[i], *self.points[(i + 1) % n]) for i in range(count))

    @once
    def area(self) -> float:
        """Enclosed area (shoelace), square metres, never negative."""
        return abs(self.signed_area)

    @once
    def signed_area(self) -> float:
        """Enclosed area, square metres, negative for vertices in clockwise order."""
        # Relative to the first vertex: far from the origin the products would cancel badly.
        if len(self.points) < 3:
            return 0.0
        ox, oy = self.points[0]
        total = 0.0
        for x1, y1, x2, y2 in self.edges:
            total += (x1 - ox) * (y2 - oy) - (x2 - ox) * (y1 - oy)
        return total / 2.0

    @property
    def perimeter(self) -> float:
        """Sum of all edges, the closing one included."""
        return sum(math.hypot(x2 - x1, y2 - y1) for x1, y1, x2, y2 in self.edges)

    @property
    def area_centroid(self) -> XY:
        """Centre of gravity of the enclosed area; the mean vertex when it encloses none."""
        area = self.signed_area
        if abs(area) <= (TOLERANCE * self.size) ** 2 or area == 0.0:
            return self.centroid
        ox, oy = self.points[0]
        sx = sy = 0.0
        for x1, y1, x2, y2 in self.edges:
            cross = (x1 - ox) * (y2 - oy) - (x2 - ox) * (y1 - oy)
            sx += (x1 - ox + x2 - ox) * cross
            sy += (y1 - oy + y2 - oy) * cross
        return ox + sx / (6.0 * area), oy + sy / (6.0 * area)

    @once
    def is_convex(self) -> bool:
        """True for a convex polygon of at least three vertices; colinear vertices between others are allowed.

        Coinciding neighbours, polygons without area and those that wind around more than once are not convex.
        """
        n = len(self.points)
        if n < 3 or not all(map(math.isfinite, self.bounds)):
            return False
        slack = TOLERANCE * self.size
        side = 0.0
        turned = 0.0
        previous = self.edges[-1]
        for edge in self.edges:
            ax, ay = previous[2] - previous[0], previous[3] - previous[1]
            bx, by = edge[2] - edge[0], edge[3] - edge[1]
            length = math.hypot(ax, ay)
            if length == 0.0:
                return False
            # Distance of the next vertex from the previous edge's line decides, not the bare product.
            cross = ax * by - ay * bx
            if abs(cross) > slack * length:
                if side * cross < 0.0:
                    return False
                side = cross
            elif ax * bx + ay * by <= 0.0:
                return False
            turned += math.atan2(cross, ax * bx + ay * by)
            previous = edge
        return side != 0.0 and abs(abs(turned) - 2.0 * math.pi) < 1.0

    @once
    def half_planes(self) -> tuple[tuple[float, float, float], ...]:
        """(nx, ny, c) per edge of a convex polygon: n.p - c is the distance of p outside of that edge."""
        outward = 1.0 if self.signed_area > 0.0 else -1.0
        planes = []
        for x1, y1, x2, y2 in self.edges:
            length = math.hypot(x2 - x1, y2 - y1)
            nx, ny = outward * (y2 - y1) / length, -outward * (x2 - x1) / length
            planes.append((nx, ny, nx * x1 + ny * y1))
        return tuple(planes)

    def contains(self, x: float, y: float) -> bool:
        """True inside and on the boundary of a convex polygon; always False when it is not convex."""
        if not self.is_convex:
            return False
        slack = TOLERANCE * self.size
        for nx, ny, c in self.half_planes:  # noqa: SIM110 - a third of the time of all(...)
            if not nx * x + ny * y - c <= slack:
                return False
        return True

    def contains_shape(self, other: SegList) -> bool:
        """True when every vertex of the other shape is contained (and it has any)."""
        return bool(other.points) and all(self.contains(x, y) for x, y in other.points)

    def intersects(self, other: Polygon) -> bool:
        """True when a vertex of one lies in the other, or edges cross or touch."""
        ax0, ay0, ax1, ay1 = self.bounds
        bx0, by0, bx1, by1 = other.bounds
        if not self.points or not other.points or ax1 < bx0 or bx1 < ax0 or ay1 < by0 or by1 < ay0:
            return False
        return (
            any(self.contains(x, y) for x, y in other.points)
            or any(other.contains(x, y) for x, y in self.points)
            or any(segments_cross(*a, *b) for a in self.edges for b in other.edges)
        )

    def dist(self, x: float, y: float) -> float:
        """Distance from (x, y) to the boundary, positive inside as well; -1 without vertices."""
        if not self.points:
            return MISS
        if len(self.points) == 1:
            return math.dist(self.points[0], (x, y))
        return dist_to_segments(self.edges, x, y)

    def signed_dist(self, x: float, y: float) -> float:
        """Distance to the boundary, negative inside."""
        distance = self.dist(x, y)
        return -distance if self.contains(x, y) else distance

    def ray_dist(self, x: float, y: float, heading: float) -> float:
        """Distance along the ray from (x, y) to the first edge it meets; -1 when it meets none."""
        return ray_dist_to_segments(self.edges, x, y, heading)

    def dist_to_segment(self, x1: float, y1: float, x2: float, y2: float) -> float:
        """Distance between a segment and the polygon, 0 inside as well; -1 without vertices."""
        if not self.points:
            return MISS
        if self.contains(x1, y1) or self.contains(x2, y2):
            return 0.0
        edges = self.edges or ((*self.points[0], *self.points[0]),)
        return min(segment_dist_to_segment(*edge, x1, y1, x2, y2) for edge in edges)

    def dist_to_polygon(self, other: Polygon) -> float:
        """Distance between two polygons, 0 when they intersect; -1 when one has no vertices."""
        if not self.points or not other.points:
            return MISS
        if self.intersects(other):
            return 0.0
        ones = self.edges or ((*self.points[0], *self.points[0]),)
        others = other.edges or ((*other.points[0], *other.points[0]),)
        return min(segment_dist_to_segment(*a, *b) for a in ones for b in others)

    def ray_cpa(self, x: float, y: float, heading: float) -> float:
        """Smallest distance between the ray from (x, y) and a convex polygon, 0 when it hits; else -1."""
        if not self.is_convex:
            return MISS
        if self.contains(x, y) or self.ray_dist(x, y, heading) >= 0.0:
            return 0.0
        corners = [dist_to_ray(x, y, heading, vx, vy) for vx, vy in self.points]
        return min(self.dist(x, y), *corners)

    def nearest_point(self, x: float, y: float) -> XY:
        """Point of the boundary nearest to (x, y); (x, y) itself without edges."""
        best, found = math.inf, (x, y)
        for edge in self.edges:
            foot = nearest_on_segment(*edge, x, y)
            distance = math.dist(foot, (x, y))
            if distance < best:
                best, found = distance, foot
        return found

    def boundary_toward_center(self, x: float, y: float) -> XY:
        """Where the line from (x, y) to the box centre meets the boundary: the stock "closest point".

        A point inside is first pushed out along that line. At the exact centre north is taken.
        """
        cx, cy = self.center
        outward = bearing(cx, cy, x, y)
        ux, uy = unit_vector(outward)
        reach = 2.0 * self.size + math.hypot(x - cx, y - cy) + 1.0
        distance = self.ray_dist(cx + reach * ux, cy + reach * uy, outward + 180.0)
        if distance < 0.0:
            return self.nearest_point(x, y)
        return cx + (reach - distance) * ux, cy + (reach - distance) * uy

    def vertex_is_viewable(self, index: int, x: float, y: float) -> bool:
        """True when the line of sight to the vertex crosses no edge but the two that meet there."""
        if self.contains(x, y):
            return False
        n = len(self.points)
        vx, vy = self.points[index]
        own = {index, (index - 1) % n}
        return not any(segments_cross(*e, x, y, vx, vy) for i, e in enumerate(self.edges) if i not in own)

    def viewable_vertices(self, x: float, y: float) -> list[int]:
        """Indexes of the vertices for which `vertex_is_viewable` holds, in order."""
        points = self.points
        if not self.is_convex or len(points) < 3:
            return [i for i in range(len(points)) if self.vertex_is_viewable(i, x, y)]
        if self.contains(x, y):
            return []
        # From well outside an edge its two ends are seen, and a vertex between two edges that are well behind
        # is not; only where the point is almost in line with an edge every edge has to be tried.
        slack = 1e-6 * (self.size + abs(x) + abs(y))
        sides = [nx * x + ny * y - c for nx, ny, c in self.half_planes]
        found = []
        before = sides[-1]
        for i, after in enumerate(sides):
            nearer = max(before, after)
            if nearer > slack or (nearer > -slack and self.vertex_is_viewable(i, x, y)):
                found.append(i)
            before = after
        return found

    def bearing_min_max(self, x: float, y: float) -> tuple[float, float] | None:
        """The two tangent bearings from (x, y), None from inside or without vertices.

        Plain (least, greatest), unless the polygon straddles north: then the first is the least bearing
        above 180 and the second the greatest up to 180, so that first > second says "straddles north".
        """
        if not self.points or self.contains(x, y):
            return None
        around = [bearing(x, y, vx, vy) for vx, vy in self.points]
        low, high = min(around), max(around)
        if high - low > 180.0:
            return min(b for b in around if b > 180.0), max(b for b in around if b <= 180.0)
        return low, high

    def is_aft_of(self, osx: float, osy: float, osh: float, degrees: float = 0.0) -> bool:
        """True when every vertex is more than `degrees` (held to +-90) abaft the vessel's beam."""
        margin = min(max(degrees, -90.0), 90.0)
        low, high = 90.0 + margin, 270.0 - margin
        return bool(self.points) and all(
            low < rel_bearing(osx, osy, osh, x, y) < high for x, y in self.points
        )

    def starting_nearest(self, x: float, y: float) -> SegList:
        """The vertices as a seglist that starts at the one nearest to (x, y)."""
        n = len(self.points)
        first = max(0, self.nearest_vertex(x, y))
        turned = self.reordered([(first + i) % n for i in range(n)])
        return SegList(turned.points, turned.zs, turned.properties, turned.tags, turned.attributes)

    def snapped_convex(self, step: float) -> Self | None:
        """Snapped to multiples of step; None when that would turn a convex polygon non-convex."""
        result = self.snapped(step)
        return None if self.is_convex and not result.is_convex else result

    def settled(self) -> Self:
        """Vertices dropped, the flattest corner first, until the polygon is convex or a triangle."""
        polygon = self
        while len(polygon) > 3 and not polygon.is_convex:
            drop = _flattest_corner(polygon.points)
            polygon = polygon.reordered([i for i in range(len(polygon)) if i != drop])
        return polygon

    def heading_wedge_offset(self, x: float, y: float, heading: float) -> float:
        """Degrees from a heading to the nearer tangent of the polygon seen from (x, y), 0 when it hits it.

        Inside the polygon every heading points at it: 0. Without vertices 180.
        """
        if not self.points:
            return 180.0
        if self.contains(x, y) or self.ray_dist(x, y, heading) >= 0.0:
            return 0.0
        offsets = [angle360(bearing(x, y, vx, vy) - heading) for vx, vy in self.points]
        return min(min(o, 360.0 - o) for o in offsets)


def _flattest_corner(points: tuple[XY, ...]) -> int:
    """Index of the corner that encloses the smallest area with its neighbours, the first in a tie."""

    def area(i: int) -> float:
        (x0, y0), (x1, y1), (x2, y2) = points[i - 1], points[i], points[(i + 1) % len(points)]
        return abs((x1 - x0) * (y2 - y1) - (y1 - y0) * (x2 - x1))

    return min(range(len(points)), key=area)
