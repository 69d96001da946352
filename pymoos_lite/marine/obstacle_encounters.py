"""How close vessels came to obstacles: the referee of uFldCollObDetect without its mail (marine_apps.md 7.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.marine.encounters import Fix, Ranks, Totals

_SETTLED = 4.0  # s for which a known obstacle outlives a request to clear it
MAX_OBSTACLES = 10_000


@dataclass(frozen=True, slots=True)
class ObstacleEncounter:
    """One visit of a vessel to an obstacle: its least distance, 0 when it was inside."""

    vname: str
    label: str
    distance: float
    rank: str
    time: float


@dataclass(slots=True)
class _Obstacle:
    polygon: Polygon
    since: float


class ObstacleReferee:
    """All vessels and all known obstacles.

    A visit lasts from coming within the encounter distance to leaving it; distances are those of the straight
    lines between reports. Unlike the ranks between vessels those here are strict: less than, not up to.
    """

    def __init__(self, ranks: Ranks) -> None:
        self.ranks = ranks.ordered()
        self.totals = Totals()
        self.global_min = math.inf
        self._obstacles: dict[str, _Obstacle] = {}
        self._latest: dict[str, Fix] = {}
        self._visits: dict[tuple[str, str], float] = {}

    def add(self, label: str, polygon: Polygon, now: float) -> None:
        """Make an obstacle known, or move a known one.

        Raises:
            ValueError: it has no label, no area, or there are too many.
        """
        if not label or not polygon.is_convex:
            raise ValueError("an obstacle needs a label and a convex polygon")
        known = self._obstacles.get(label)
        if known is None and len(self._obstacles) >= MAX_OBSTACLES:
            raise ValueError(f"there are {MAX_OBSTACLES} obstacles already")
        self._obstacles[label] = _Obstacle(polygon, now if known is None else known.since)

    def clear(self, label: str, now: float) -> None:
        """Forget the obstacle of that label, or `all`; those known for a few seconds only stay."""
        wanted = list(self._obstacles) if label.lower() == "all" else [label]
        for each in wanted:
            obstacle = self._obstacles.get(each)
            if obstacle is not None and now - obstacle.since > _SETTLED:
                del self._obstacles[each]
                for key in [key for key in self._visits if key[1] == each]:
                    del self._visits[key]

    def labels(self) -> list[str]:
        """Labels of the known obstacles, sorted."""
        return sorted(self._obstacles)

    def hear(self, name: str, fix: Fix) -> list[ObstacleEncounter]:
        """Take a vessel's position; returns the visits that it shows to be over."""
        before = self._latest.get(name)
        if before is not None and fix.time < before.time:
            return []
        self._latest[name] = fix
        start = fix if before is None else before
        found = []
        for label, obstacle in sorted(self._obstacles.items()):
            encounter = self._visit(name, label, obstacle.polygon, start, fix)
            if encounter is not None:
                found.append(encounter)
        return found

    def _visit(
        self, name: str, label: str, polygon: Polygon, start: Fix, fix: Fix
    ) -> ObstacleEncounter | None:
        # Cheap test first: nothing within reach of the bounding box cannot be within reach of the polygon.
        reach = self.ranks.encounter
        x0, y0, x1, y1 = polygon.bounds
        away_x = max(x0 - max(start.x, fix.x), min(start.x, fix.x) - x1, 0.0)
        away_y = max(y0 - max(start.y, fix.y), min(start.y, fix.y) - y1, 0.0)
        key = (name, label)
        away = math.hypot(away_x, away_y)
        if away > reach and away > self.global_min and key not in self._visits:
            return None
        least = polygon.dist_to_segment(start.x, start.y, fix.x, fix.y)
        self.global_min = min(self.global_min, least)
        if least <= reach:
            self._visits[key] = min(self._visits.get(key, math.inf), least)
        here = 0.0 if polygon.contains(fix.x, fix.y) else polygon.dist(fix.x, fix.y)
        if here <= reach or key not in self._visits:
            return None
        distance = self._visits.pop(key)
        totals = self.totals
        totals.encounters += 1
        rank = "clear"
        if distance < self.ranks.collision:
            rank = "collision"
            totals.collisions += 1
        elif distance < self.ranks.near_miss:
            rank = "near_miss"
            totals.near_misses += 1
        return ObstacleEncounter(name, label, distance, rank, fix.time)
