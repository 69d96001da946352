"""Obstacles around ownship, given as polygons or made of points, and the alerts about them (marine_apps.md 6).

The core of pObstacleMgr: mail texts and the time go in, posts come out. Metres and seconds.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.specs import erase_seglist_text, parse_polygon, seglist_text
from pymoos_lite.records.csp import clip, field_map, fix, num, parse_number

Post = tuple[str, float | str]
XY = tuple[float, float]
MAX_OBSTACLES = 10_000
_SAME = 0.1  # m; polygons equal at this rounding are the same
_OCTAGON = 8
_LEAST_RADIUS = 0.5  # m of the octagon around points that span no area


@dataclass(frozen=True, slots=True)
class AlertRequest:
    """Whom to tell of obstacles within `alert_range`: behaviours called `name` + key, through `update_var`."""

    name: str
    update_var: str
    alert_range: float

    @classmethod
    def parse(cls, text: str) -> AlertRequest:
        """Read `name=N,update_var=V,alert_range=R`; raises ValueError unless all three are there, R above 0."""
        told = field_map("OBM_ALERT_REQUEST", text)
        name, variable, reach = (
            told.get("name", ""),
            told.get("update_var", ""),
            parse_number(told.get("alert_range", "")),
        )
        if not name or not variable or any(c.isspace() for c in variable) or reach is None or reach <= 0.0:
            raise ValueError(f"expected name=N,update_var=V,alert_range=metres, found '{clip(text)}'")
        return cls(name, variable, reach)


@dataclass(frozen=True, slots=True)
class ObstacleManagerParameters:
    """Configuration; None switches a limit off."""

    alert_range: float = 20.0
    ignore_range: float | None = None
    max_pts_per_cluster: int = 20
    max_age_per_point: float = 20.0
    given_max_duration: float | None = 60.0
    post_dist_to_polys: str = "close"
    post_view_polys: bool = True
    color: str = "blue"
    label_threshold: int = 25
    shade_threshold: int = 100
    vertex_threshold: int = 150
    lasso: bool = False
    lasso_points: int = 6
    lasso_radius: float = 5.0
    general_alert: AlertRequest | None = None


@dataclass(slots=True)
class Obstacle:
    """One obstacle: a given polygon, or the hull of points seen lately."""

    key: str
    polygon: Polygon | None = None
    vsource: str = ""
    given: bool = False
    refreshed: float = 0.0
    duration: float = -1.0
    points: deque[tuple[float, XY]] = field(default_factory=deque)
    range: float = math.inf
    stale_hull: bool = False
    changed: bool = False
    redraw: bool = False


class ObstacleManagerCore:
    """Feed `hear_point`, `hear_given`, `own_x`, `own_y`; call `step(now)` once per iteration for the posts."""

    def __init__(self, parameters: ObstacleManagerParameters) -> None:
        self.parameters = parameters
        self.own_x: float | None = None
        self.own_y: float | None = None
        self.obstacles: dict[str, Obstacle] = {}
        self.request: AlertRequest | None = None
        self.ever = 0
        self.ignored_points = 0
        self.alerts = 0
        self.min_dist_ever = math.inf
        self._new: list[str] = []
        self._said: dict[str, str] = {}

    # --- input --------------------------------------------------------------------------------------------

    def hear_point(self, text: str, now: float) -> None:
        """A tracked point: `x=..,y=..,key=K[,vsource=S]`, or label=K; raises ValueError if it is none."""
        told = field_map("point", text)
        x, y = parse_number(told.get("x", "")), parse_number(told.get("y", ""))
        key = told.get("key") or told.get("label", "")
        if x is None or y is None or not key:
            raise ValueError(f"Invalid point:{clip(text)}")
        p = self.parameters
        if p.ignore_range is not None and self._away(x, y) > p.ignore_range:
            self.ignored_points += 1
            return
        obstacle = self._obstacle(key)
        if obstacle.given:
            raise ValueError(f"'{clip(key)}' is a given obstacle, which has no points")
        obstacle.points.append((now, (x, y)))
        while len(obstacle.points) > p.max_pts_per_cluster:
            obstacle.points.popleft()
        obstacle.vsource = told.get("vsource", obstacle.vsource)
        obstacle.stale_hull = True

    def hear_given(self, text: str, now: float, lasting: bool = False) -> None:
        """A given obstacle: a labelled convex polygon with `duration=s`; `lasting` ones (of the
        configuration) need none. An inactive one ends it. Raises ValueError if it cannot be used."""
        polygon = parse_polygon(text)
        key = polygon.label
        if not key:
            raise ValueError("a given obstacle needs a label")
        known = self.obstacles.get(key)
        if known is not None and not known.given:
            raise ValueError(f"'{clip(key)}' is an obstacle made of points already")
        if not polygon.attributes.active:
            if known is not None:
                known.duration, known.refreshed = 0.0, -math.inf
            return
        if not polygon.is_convex:
            raise ValueError(f"given obstacle '{clip(key)}' is not convex")
        duration, limit = polygon.attributes.duration, self.parameters.given_max_duration
        if not lasting and limit is not None and (duration is None or not 0.0 <= duration <= limit):
            shown = "none" if duration is None else num(duration)
            raise ValueError(
                f"given obstacle '{clip(key)}': duration {shown}, expected at most {num(limit)} s"
            )
        obstacle = self._obstacle(key)
        obstacle.given = True
        obstacle.refreshed = now
        obstacle.duration = -1.0 if duration is None else duration
        obstacle.vsource = polygon.attributes.vsource
        self._take_shape(obstacle, replace(polygon, attributes=Attributes(label=key)))

    def request_alert(self, text: str) -> None:
        """Take an OBM_ALERT_REQUEST; the last one counts. Raises ValueError if it is none."""
        self.request = AlertRequest.parse(text)

    @property
    def alert_range(self) -> float:
        """Metres within which obstacles are told of."""
        return self.request.alert_range if self.request is not None else self.parameters.alert_range

    def take_new(self) -> list[str]:
        """Keys of obstacles that came since the last call."""
        new, self._new = self._new, []
        return new

    # --- one iteration ------------------------------------------------------------------------------------

    def step(self, now: float) -> list[Post]:
        """Drop what is over, renew hulls and ranges, tell; returns what to post, in order."""
        posts: list[Post] = []
        self._age_points(now)
        for obstacle in [o for o in self.obstacles.values() if self._is_over(o, now)]:
            del self.obstacles[obstacle.key]
            self._said.pop(obstacle.key, None)
            if obstacle.polygon is not None:
                posts.append(("VIEW_POLYGON", erase_seglist_text(obstacle.polygon.label)))
            posts.append(("OBM_RESOLVED", obstacle.key))
        for obstacle in self.obstacles.values():
            if obstacle.stale_hull:
                obstacle.stale_hull = False
                self._take_shape(obstacle, self._hull(obstacle))
        if self.own_x is not None and self.own_y is not None:
            self._update_ranges(posts)
            self._tell_ranges(posts)
            self._alert(posts)
        if self.parameters.post_view_polys:
            self._draw(posts)
        return posts

    def _away(self, x: float, y: float) -> float:
        return math.hypot(x - (self.own_x or 0.0), y - (self.own_y or 0.0))

    def _obstacle(self, key: str) -> Obstacle:
        known = self.obstacles.get(key)
        if known is None:
            if len(self.obstacles) >= MAX_OBSTACLES:
                raise ValueError(f"there are {MAX_OBSTACLES} obstacles already")
            known = self.obstacles[key] = Obstacle(key)
            self.ever += 1
            self._new.append(key)
        return known

    def _take_shape(self, obstacle: Obstacle, polygon: Polygon) -> None:
        former = obstacle.polygon
        obstacle.polygon = polygon
        if former is None or _rounded(former) != _rounded(polygon):
            obstacle.changed = obstacle.redraw = True

    def _age_points(self, now: float) -> None:
        oldest = now - self.parameters.max_age_per_point
        for obstacle in self.obstacles.values():
            while obstacle.points and obstacle.points[0][0] < oldest:
                obstacle.points.popleft()
                obstacle.stale_hull = bool(obstacle.points)

    def _is_over(self, obstacle: Obstacle, now: float) -> bool:
        if not obstacle.given:
            return not obstacle.points
        return obstacle.duration >= 0.0 and now - obstacle.refreshed > obstacle.duration

    def _hull(self, obstacle: Obstacle) -> Polygon:
        p = self.parameters
        points = [point for _, point in obstacle.points]
        label = f"obmgr_{obstacle.key}"
        x = sum(px for px, _ in points) / len(points)
        y = sum(py for _, py in points) / len(points)
        if p.lasso:
            shape = Polygon.radial(x, y, p.lasso_radius, p.lasso_points)
        else:
            shape = Polygon(tuple(convex_hull(points)))
            if not shape.is_convex:
                farthest = max(math.hypot(px - x, py - y) for px, py in points)
                shape = Polygon.radial(x, y, max(_LEAST_RADIUS, farthest), _OCTAGON)
        return replace(shape, attributes=Attributes(label=label))

    def _update_ranges(self, posts: list[Post]) -> None:
        x, y = self.own_x or 0.0, self.own_y or 0.0
        reach = self.alert_range
        for obstacle in self.obstacles.values():
            if obstacle.polygon is None:
                continue
            before = obstacle.range
            obstacle.range = max(0.0, obstacle.polygon.signed_dist(x, y))
            if obstacle.range <= reach < before:
                obstacle.changed = True
            if obstacle.range < self.min_dist_ever:
                self.min_dist_ever = obstacle.range
                posts.append(("OBM_MIN_DIST_EVER", obstacle.range))

    def _tell_ranges(self, posts: list[Post]) -> None:
        policy = self.parameters.post_dist_to_polys
        if policy == "false":
            return
        for key, obstacle in self.obstacles.items():
            if math.isfinite(obstacle.range) and (policy == "true" or obstacle.range <= self.alert_range):
                text = f"{key.upper()},{fix(obstacle.range, 1)}"
                if self._said.get(key) != text:
                    self._said[key] = text
                    posts.append(("OBM_DIST_TO_OBJ", text))

    def _alert(self, posts: list[Post]) -> None:
        """Tell of changed obstacles in range; nobody is told before somebody asked."""
        request, general = self.request, self.parameters.general_alert
        for obstacle in self.obstacles.values():
            if not obstacle.changed or obstacle.polygon is None or request is None:
                continue
            obstacle.changed = False
            if obstacle.range <= request.alert_range:
                posts.append((request.update_var, _alert_text(request.name, obstacle)))
                self.alerts += 1
            if general is not None and obstacle.range <= general.alert_range:
                posts.append((general.update_var, _alert_text(f"{general.name}_", obstacle)))

    def _draw(self, posts: list[Post]) -> None:
        p, count = self.parameters, len(self.obstacles)
        for obstacle in self.obstacles.values():
            if not obstacle.redraw or obstacle.polygon is None:
                continue
            obstacle.redraw = False
            looks = Attributes(
                label=obstacle.polygon.label,
                label_color="invisible" if count > p.label_threshold else "",
                edge_color=p.color,
                vertex_color=p.color,
                fill_color="invisible" if count > p.shade_threshold else p.color,
                vertex_size=0.0 if count > p.vertex_threshold else 2.0,
                fill_transparency=0.15,
            )
            posts.append(("VIEW_POLYGON", seglist_text(replace(obstacle.polygon, attributes=looks), 2)))


def _alert_text(name: str, obstacle: Obstacle) -> str:
    """``name=<name><key>#poly=pts={..},label=<key>[,vsource=S]#id=<key>``."""
    assert obstacle.polygon is not None
    key = obstacle.key
    bare = seglist_text(replace(obstacle.polygon, attributes=Attributes(label=key, vsource="")), 5)
    source = f",vsource={obstacle.vsource}" if obstacle.vsource else ""
    return f"name={name}{key}#poly={bare}{source}#id={key}"


def _rounded(polygon: Polygon) -> tuple[tuple[int, int], ...]:
    return tuple((round(x / _SAME), round(y / _SAME)) for x, y in polygon.points)


def convex_hull(points: Iterable[XY]) -> list[XY]:
    """The corners of the smallest convex polygon around points, counter-clockwise, colinear ones left out.

    (Andrew, Information Processing Letters 9(5), 1979.)
    """
    ordered = sorted(set(points))
    if len(ordered) < 3:
        return ordered
    halves = []
    for run in (ordered, ordered[::-1]):
        half: list[XY] = []
        for x, y in run:
            while len(half) > 1 and (half[-1][0] - half[-2][0]) * (y - half[-2][1]) <= (
                half[-1][1] - half[-2][1]
            ) * (x - half[-2][0]):
                half.pop()
            half.append((x, y))
        halves.append(half[:-1])
    return halves[0] + halves[1]
