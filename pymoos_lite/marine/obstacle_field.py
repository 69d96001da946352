"""The field of obstacles that a simulated shore knows: reading, drawing anew, telling (marine_apps.md 7.1).

The core of uFldObstacleSim. Random numbers come from a generator that is handed in.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterable
from dataclasses import dataclass, replace

from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.specs import parse_polygon, seglist_text
from pymoos_lite.records.csp import clip, num, parse_number

MAX_TRIES = 25_000
MAX_OBSTACLES = 10_000
_CORNERS = 8


@dataclass(frozen=True, slots=True)
class ObstacleField:
    """Obstacles with their labels, and how to draw new ones inside `region`.

    `min_range` is the least distance between obstacles, `min_size` and `max_size` bound their radius, metres.
    """

    region: Polygon
    min_range: float
    min_size: float
    max_size: float
    obstacles: tuple[Polygon, ...]

    def redrawn(self, rng: random.Random, first_number: int = 0) -> tuple[ObstacleField, bool]:
        """As many new obstacles, and whether all found a place; labels count up from `first_number`."""
        wanted = len(self.obstacles)
        placed: list[Polygon] = []
        x0, y0, x1, y1 = self.region.bounds
        for _ in range(MAX_TRIES):
            if len(placed) == wanted:
                break
            radius = rng.uniform(self.min_size, self.max_size)
            x, y = rng.uniform(x0, x1), rng.uniform(y0, y1)
            if not self._has_room(x, y, radius, placed):
                continue
            shape = Polygon(_corners(rng, x, y, radius))
            if not (shape.is_convex and self.region.contains_shape(shape)):
                continue
            if all(shape.dist_to_polygon(other) >= self.min_range for other in placed):
                label = f"ob_{first_number + len(placed)}"
                placed.append(replace(shape, attributes=Attributes(label=label)))
        return replace(self, obstacles=tuple(placed)), len(placed) == wanted

    def _has_room(self, x: float, y: float, radius: float, placed: list[Polygon]) -> bool:
        """A quick look before a shape is drawn: is the centre in the region and outside every other obstacle?"""
        return self.region.contains(x, y) and not any(
            max(b[0] - x, x - b[2], 0.0) + max(b[1] - y, y - b[3], 0.0) < 1e-9
            for b in (other.bounds for other in placed)
        )


def _corners(rng: random.Random, x: float, y: float, radius: float) -> tuple[tuple[float, float], ...]:
    """Corners on a circle, unevenly spaced: always convex, each obstacle a little different."""
    step = 2.0 * math.pi / _CORNERS
    turn = rng.uniform(0.0, step)
    angles = [turn + step * (i + rng.uniform(-0.3, 0.3)) for i in range(_CORNERS)]
    return tuple((round(x + radius * math.sin(a), 2), round(y + radius * math.cos(a), 2)) for a in angles)


def parse_obstacle_file(lines: Iterable[str], name: str = "obstacle file") -> ObstacleField:
    """Read `region=pts={..}`, `min_range=`, `min_size=`, `max_size=`, `poly=pts={..},label=L` lines.

    Raises:
        ValueError: with `name:line` and what is wrong.
    """
    region: Polygon | None = None
    sizes: dict[str, float] = {}
    obstacles: dict[str, Polygon] = {}
    for number, line in enumerate(lines, 1):
        text = line.partition("//")[0].strip()
        if not text:
            continue
        key, equals, value = (part.strip() for part in text.partition("="))
        key = key.lower()
        try:
            if not equals:
                raise ValueError(f"expected key = value, found '{clip(text)}'")
            if key == "region":
                region = parse_polygon(value)
            elif key in ("min_range", "min_size", "max_size"):
                size = parse_number(value)
                if size is None or size <= 0.0:
                    raise ValueError(f"{key} = {clip(value)}: expected metres above 0")
                sizes[key] = size
            elif key == "poly":
                obstacle = parse_polygon(value)
                if not obstacle.label or obstacle.label in obstacles:
                    raise ValueError("each obstacle needs a label of its own")
                obstacles[obstacle.label] = obstacle
                if len(obstacles) > MAX_OBSTACLES:
                    raise ValueError(f"there are more than {MAX_OBSTACLES} obstacles")
            else:
                raise ValueError(f"'{clip(key)}' is none of region, min_range, min_size, max_size, poly")
        except ValueError as error:
            raise ValueError(f"{name}:{number}: {error}") from None
    if region is None or not region.points:
        raise ValueError(f"{name}: there is no region = pts={{..}}")
    missing = [key for key in ("min_range", "min_size", "max_size") if key not in sizes]
    if missing:
        raise ValueError(f"{name}: {', '.join(missing)} not given")
    if sizes["min_size"] > sizes["max_size"]:
        raise ValueError(f"{name}: min_size is greater than max_size")
    return ObstacleField(
        region, sizes["min_range"], sizes["min_size"], sizes["max_size"], tuple(obstacles.values())
    )


def known_obstacle_text(obstacle: Polygon, vsource: str = "", duration: float | None = None) -> str:
    """KNOWN_OBSTACLE and GIVEN_OBSTACLE: `pts={..},label=ob_0[,vsource=S][,duration=d]`."""
    bare = seglist_text(replace(obstacle, attributes=Attributes(label=obstacle.label)), 2)
    if vsource:
        bare += f",vsource={vsource}"
    return bare if duration is None or duration < 0.0 else f"{bare},duration={num(duration)}"


def visible_point(obstacle: Polygon, x: float, y: float, rng: random.Random) -> tuple[float, float]:
    """A random point of the side of an obstacle that can be seen from (x, y); of any side from inside."""
    facing = []
    for x1, y1, x2, y2 in obstacle.edges:
        mid_x, mid_y = (x1 + x2) / 2.0, (y1 + y2) / 2.0
        outward = (y2 - y1) * (x - mid_x) - (x2 - x1) * (y - mid_y)
        if outward * (1.0 if obstacle.signed_area > 0.0 else -1.0) > 0.0:
            facing.append((x1, y1, x2, y2))
    edges = facing or list(obstacle.edges)
    lengths = [math.hypot(x2 - x1, y2 - y1) for x1, y1, x2, y2 in edges]
    x1, y1, x2, y2 = rng.choices(edges, weights=lengths)[0]
    share = rng.random()
    return x1 + share * (x2 - x1), y1 + share * (y2 - y1)
