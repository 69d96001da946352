"""Points and seglists: the open shapes, immutable, with the operations behaviours ask of them.

A shape knows its vertices and its drawing attributes; how it is written is `specs`' subject. Definitions
that differ from the textbook (centre, centroid, clockwise) follow behaviors.md A3.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Self

from mypy_extensions import mypyc_attr

from pymoos_lite.compiled.once import once
from pymoos_lite.geometry.angles import bearing, project_point, snap_to_step
from pymoos_lite.geometry.attributes import PLAIN, Attributes

XY = tuple[float, float]


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Point:
    """A point with an optional depth z and transparency (0..1), and its drawing attributes."""

    x: float = 0.0
    y: float = 0.0
    z: float | None = None
    transparency: float | None = None
    attributes: Attributes = PLAIN

    @property
    def label(self) -> str:
        """The label among the attributes."""
        return self.attributes.label

    def with_attributes(self, **changes: Any) -> Point:
        """The same point with some drawing attributes changed."""
        return replace(self, attributes=replace(self.attributes, **changes))


@mypyc_attr(native_class=False)
@dataclass(frozen=True)
class SegList:
    """An ordered list of vertices.

    `points` are (x, y); `zs` and `properties` are empty, or hold one entry per vertex (None and ""
    where a vertex has none). `tags` is kept as it was written.
    """

    points: tuple[XY, ...] = ()
    zs: tuple[float | None, ...] = ()
    properties: tuple[str, ...] = ()
    tags: str = ""
    attributes: Attributes = PLAIN

    @classmethod
    def of(cls, points: Iterable[Sequence[float]], **attributes: Any) -> Self:
        """Shape from any (x, y) pairs and drawing attributes by name."""
        pairs = tuple((float(p[0]), float(p[1])) for p in points)
        return cls(pairs, attributes=Attributes(**attributes) if attributes else PLAIN)

    def __len__(self) -> int:
        return len(self.points)

    @property
    def label(self) -> str:
        """The label among the attributes."""
        return self.attributes.label

    def with_attributes(self, **changes: Any) -> Self:
        """The same shape with some drawing attributes changed."""
        return replace(self, attributes=replace(self.attributes, **changes))

    def with_points(self, points: Iterable[XY]) -> Self:
        """As many vertices at other places; everything else stays with its vertex."""
        return replace(self, points=tuple(points))

    def reordered(self, order: Sequence[int]) -> Self:
        """Vertices picked by index, each with its z and property."""
        return replace(
            self,
            points=tuple(self.points[i] for i in order),
            zs=tuple(self.zs[i] for i in order) if self.zs else (),
            properties=tuple(self.properties[i] for i in order) if self.properties else (),
        )

    @once
    def bounds(self) -> tuple[float, float, float, float]:
        """(least x, least y, greatest x, greatest y); zeros without vertices."""
        if not self.points:
            return 0.0, 0.0, 0.0, 0.0
        xs = [p[0] for p in self.points]
        ys = [p[1] for p in self.points]
        return min(xs), min(ys), max(xs), max(ys)

    @property
    def center(self) -> XY:
        """Middle of the bounding box."""
        x0, y0, x1, y1 = self.bounds
        return (x0 + x1) / 2.0, (y0 + y1) / 2.0

    @property
    def centroid(self) -> XY:
        """Mean of the vertices; (0, 0) without any."""
        n = len(self.points)
        if not n:
            return 0.0, 0.0
        return sum(p[0] for p in self.points) / n, sum(p[1] for p in self.points) / n

    @once
    def size(self) -> float:
        """Diagonal of the bounding box."""
        x0, y0, x1, y1 = self.bounds
        return math.hypot(x1 - x0, y1 - y0)

    @property
    def max_radius(self) -> float:
        """Greatest distance of a vertex from the centre of the bounding box."""
        cx, cy = self.center
        return max((math.hypot(x - cx, y - cy) for x, y in self.points), default=0.0)

    @property
    def length(self) -> float:
        """Sum of the legs from first to last vertex; a polygon's closing edge is not among them."""
        return sum(math.dist(a, b) for a, b in pairwise(self.points))

    def point_at(self, distance: float) -> XY:
        """Point at this arc length from the first vertex, held between the ends; (0, 0) without vertices."""
        if not self.points:
            return 0.0, 0.0
        left = max(0.0, distance)
        for (ax, ay), (bx, by) in pairwise(self.points):
            leg = math.hypot(bx - ax, by - ay)
            if left <= leg and leg > 0.0:
                t = left / leg
                return ax + t * (bx - ax), ay + t * (by - ay)
            left -= leg
        return self.points[-1]

    @once
    def is_clockwise(self) -> bool:
        """True when bearings from the centre mostly increase from vertex to vertex around the closed list."""
        n = len(self.points)
        if n < 3:
            return False
        cx, cy = self.center
        around = [bearing(cx, cy, x, y) for x, y in self.points]
        turns = 0
        for i in range(n):
            step = (around[(i + 1) % n] - around[i]) % 360.0
            if step != 0.0:
                turns += 1 if step < 180.0 else -1
        return turns > 0

    def reversed(self) -> Self:
        """The same vertices in the opposite order."""
        return self.reordered(range(len(self.points) - 1, -1, -1))

    def grown_by(self, amount: float) -> Self:
        """Every vertex moved `amount` metres away from the centroid (toward it when negative)."""
        cx, cy = self.centroid
        return self.with_points(project_point(bearing(cx, cy, x, y), amount, x, y) for x, y in self.points)

    def grown_by_factor(self, fraction: float) -> Self:
        """Every vertex moved away from the centroid by this fraction of its distance from it."""
        cx, cy = self.centroid
        return self.with_points((x + fraction * (x - cx), y + fraction * (y - cy)) for x, y in self.points)

    def rotated(self, degrees: float, about: XY | None = None) -> Self:
        """Turned clockwise about the centroid or the given point."""
        cx, cy = self.centroid if about is None else about
        angle = math.radians(degrees)
        c, s = math.cos(angle), math.sin(angle)
        return self.with_points(
            (cx + c * (x - cx) + s * (y - cy), cy - s * (x - cx) + c * (y - cy)) for x, y in self.points
        )

    def shifted(self, dx: float, dy: float) -> Self:
        """Moved by (dx, dy)."""
        return self.with_points((x + dx, y + dy) for x, y in self.points)

    def centered_at(self, x: float, y: float) -> Self:
        """Moved so that the middle of the bounding box comes to (x, y)."""
        cx, cy = self.center
        return self.shifted(x - cx, y - cy)

    def snapped(self, step: float) -> Self:
        """Every coordinate rounded to a multiple of step (unchanged when step <= 0)."""
        return self.with_points((snap_to_step(x, step), snap_to_step(y, step)) for x, y in self.points)

    def nearest_vertex(self, x: float, y: float) -> int:
        """Index of the vertex nearest to (x, y), the earlier one in a tie; -1 without vertices."""
        best, found = math.inf, -1
        for i, (vx, vy) in enumerate(self.points):
            square = (vx - x) ** 2 + (vy - y) ** 2
            if square < best:
                best, found = square, i
        return found

    def greedy_path(self, x: float, y: float) -> Self:
        """The vertices in the order of a tour that always goes to the nearest one left, from (x, y).

        Properties stay with their vertices; depths become 0.
        """
        left = list(range(len(self.points)))
        order: list[int] = []
        while left:
            squares = [(self.points[i][0] - x) ** 2 + (self.points[i][1] - y) ** 2 for i in left]
            nearest = left[squares.index(min(squares))]
            left.remove(nearest)
            order.append(nearest)
            x, y = self.points[nearest]
        path = self.reordered(order)
        return replace(path, zs=(0.0,) * len(order)) if path.zs else path


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Circle:
    """A circle; radius in metres, 0 or more."""

    x: float = 0.0
    y: float = 0.0
    radius: float = 0.0
    attributes: Attributes = PLAIN

    @property
    def label(self) -> str:
        """The label among the attributes."""
        return self.attributes.label

    def contains(self, x: float, y: float) -> bool:
        """True inside and on the rim."""
        return math.hypot(x - self.x, y - self.y) <= self.radius


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Seglr:
    """Vertices followed by an endless ray: the track of a vessel that turns and then holds its heading.

    `ray` is the heading of the ray from the last vertex; ray_len and head_size only say how to draw it.
    `cpa`, `cpax`, `cpay` mark a closest point of approach along it, when somebody computed one.
    """

    points: tuple[XY, ...] = ()
    ray: float = 0.0
    ray_len: float = 20.0
    head_size: float = 1.0
    cpa: float | None = None
    cpax: float | None = None
    cpay: float | None = None
    attributes: Attributes = PLAIN

    @property
    def label(self) -> str:
        """The label among the attributes."""
        return self.attributes.label
