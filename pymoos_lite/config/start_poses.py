"""Where vessels start: given, or drawn at random with a least distance between any two.

Metres and degrees (x east, y north, heading from north). Draws use the generator handed in and nothing
else, so the same seed gives the same fleet.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

from pymoos_lite.geometry.text import num

ATTEMPTS = 200
"""Tries per vessel before the area is thought too small for the separation asked for."""

RESTARTS = 20


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a vessel starts, and how fast (m/s)."""

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0
    speed: float = 0.0

    def to_text(self) -> str:
        """As `start_pos` of the simulator wants it."""
        return f"x={num(self.x)},y={num(self.y)},heading={num(self.heading)},speed={num(self.speed)}"


@dataclass(frozen=True, slots=True)
class Area:
    """A convex or other simple polygon to draw from, corners as (x, y)."""

    corners: tuple[tuple[float, float], ...]

    @classmethod
    def box(cls, low_x: float, high_x: float, low_y: float, high_y: float) -> Area:
        return cls(((low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y)))

    def grown(self, factor: float) -> Area:
        """The same shape `factor` times as long and as wide, about the middle of its bounding box."""
        xs, ys = [c[0] for c in self.corners], [c[1] for c in self.corners]
        x, y = (min(xs) + max(xs)) / 2.0, (min(ys) + max(ys)) / 2.0
        return Area(tuple((x + factor * (cx - x), y + factor * (cy - y)) for cx, cy in self.corners))

    def contains(self, x: float, y: float) -> bool:
        """Whether a point lies inside, by counting the edges to its east."""
        inside = False
        corners = self.corners
        for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
            if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
                inside = not inside
        return inside


class NoRoom(ValueError):
    """The area does not hold so many vessels at such a distance."""


def draw_poses(
    count: int,
    area: Area,
    separation: float,
    headings: tuple[float, float],
    speed: float,
    taken: Sequence[Pose],
    dice: random.Random,
) -> list[Pose]:
    """`count` poses in `area`, each at least `separation` metres from all others and those `taken`.

    Positions are rounded to 0.01 m and headings, drawn from `headings`, to whole degrees.

    Raises:
        NoRoom: not found in many attempts.
    """
    xs, ys = [c[0] for c in area.corners], [c[1] for c in area.corners]
    for _ in range(RESTARTS):
        found: list[Pose] = []
        for _ in range(count):
            for _ in range(ATTEMPTS):
                x = round(dice.uniform(min(xs), max(xs)), 2)
                y = round(dice.uniform(min(ys), max(ys)), 2)
                if area.contains(x, y) and all(
                    hypot(p.x - x, p.y - y) >= separation for p in (*taken, *found)
                ):
                    heading = float(round(dice.uniform(*headings))) % 360.0
                    found.append(Pose(x, y, heading, speed))
                    break
            else:
                break
        if len(found) == count:
            return found
    raise NoRoom(
        f"no room for {count} vessels at {num(separation)} m from each other: "
        "enlarge the area or lower the separation"
    )
