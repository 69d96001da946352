"""How a vessel gets onto a new heading: turn models, and the turn-about path of a race track.

`TurnModel` is the helm's platform model (behaviors.md A9): for a desired heading it gives the seglr the
vessel will sweep, at once (holonomic) or along a turning circle (dubins). `williamson` is the path with
which a leg run reverses its direction (behaviors.md C17).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoos_lite.geometry.angles import angle360, angle_diff, is_port_turn, project_point
from pymoos_lite.geometry.cpa import CpaEngine, unit_vectors
from pymoos_lite.geometry.formats import SpecError, key_values, number_field, shown
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.shapes import XY, Seglr

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TurnModel:
    """A vessel's pose and the way it turns.

    radius is that of the turning circle in metres, 0 for a holonomic vessel; spoke_degs is the turn
    between two vertices of the path (0 < spoke_degs < 180).
    """

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0
    radius: float = 0.0
    spoke_degs: float = 15.0

    @property
    def is_holonomic(self) -> bool:
        """True when the vessel takes any heading at once."""
        return self.radius <= 0.0

    def at(self, x: float, y: float, heading: float) -> TurnModel:
        """The same vessel in another pose."""
        return replace(self, x=x, y=y, heading=heading)

    @cached_property
    def _port(self) -> tuple[XY, ...]:
        return self._spokes(-1.0)

    @cached_property
    def _star(self) -> tuple[XY, ...]:
        return self._spokes(1.0)

    def _spokes(self, side: float) -> tuple[XY, ...]:
        """Own position, then the points of the turning circle on one side every spoke, below 180 degrees."""
        points = [(self.x, self.y)]
        if not self.is_holonomic:
            cx, cy = project_point(self.heading + side * 90.0, self.radius, self.x, self.y)
            turn = self.spoke_degs
            while turn < 180.0:
                points.append(project_point(self.heading - side * 90.0 + side * turn, self.radius, cx, cy))
                turn += self.spoke_degs
        return tuple(points)

    def seglr(self, heading: float) -> Seglr:
        """The path onto `heading`: own position, the spokes turned through, and the ray along it."""
        spokes = self._port if is_port_turn(self.heading, heading) else self._star
        used = int(angle_diff(self.heading, heading) / self.spoke_degs + 0.5)
        return Seglr(spokes[: min(used, len(spokes) - 1) + 1], angle360(heading))

    def dist_to_polygon(self, heading: float, polygon: Polygon) -> float:
        """Least distance between the path onto `heading` and a convex polygon; -1 when it is not convex."""
        return float(self.dists_to_polygon([heading], polygon)[0])

    def dists_to_polygon(self, headings: ArrayLike, polygon: Polygon) -> Array:
        """`dist_to_polygon` for many headings at once."""
        from pymoos_lite.geometry import _kernels

        out = np.full(np.size(headings), -1.0)
        if polygon.is_convex:
            east, north = unit_vectors(headings)
            xs, ys = _columns(polygon.points)
            _kernels.seglr_to_polygon(*self._circles(), self._counts(headings), east, north, xs, ys, out)
        return out

    def cpa_grid(self, engine: CpaEngine, courses: ArrayLike, speeds: ArrayLike, horizon: float) -> Array:
        """Closest point of approach along the path for every course and speed: shape (courses, speeds).

        The contact is the engine's; own ship starts in this model's pose.
        """
        from pymoos_lite.geometry import _kernels

        east, north = unit_vectors(courses)
        v = np.ascontiguousarray(speeds, dtype=np.float64)
        out = np.empty((east.size, v.size))
        contact = (engine.cnx, engine.cny, *engine.contact_velocity)
        turn = self._counts(courses)
        _kernels.path_cpa_grid(*self._circles(), turn, east, north, v, *contact, float(horizon), out)
        return out

    def _circles(self) -> tuple[Array, Array, Array, Array]:
        return (*_columns(self._port), *_columns(self._star))

    def _counts(self, headings: ArrayLike) -> NDArray[np.int64]:
        """Spokes used per heading, negative for port turns."""
        turn = np.mod(np.asarray(headings, dtype=np.float64) - self.heading, 360.0)
        gap = np.minimum(turn, 360.0 - turn)
        used = np.minimum(np.floor(gap / self.spoke_degs + 0.5).astype(np.int64), len(self._star) - 1)
        return np.where(turn > 180.0, -used, used)


def _columns(points: tuple[XY, ...]) -> tuple[Array, Array]:
    table = np.array(points, dtype=np.float64).reshape(-1, 2)
    return np.ascontiguousarray(table[:, 0]), np.ascontiguousarray(table[:, 1])


def parse_turn_model(text: str, current: TurnModel | None = None) -> TurnModel:
    """Turn model from `alg=holo|dubins # radius=R # spoke_degs=D`; rad, degs, mod_radius, mod_spoke_degs.

    `alg` is mandatory; the mod_ fields add to what `current` has, whose pose is kept. All or nothing:
    raises SpecError for an unknown field or algorithm, or values that leave no sensible circle.
    """
    base = current if current is not None else TurnModel()
    values = key_values(text.replace("#", ","), "turn model")
    values = {_SYNONYMS.get(key, key): value for key, value in values.items()}
    for key in values:
        if key not in ("alg", "radius", "spoke_degs", "mod_radius", "mod_spoke_degs"):
            raise SpecError(f"turn model has no field '{shown(key)}', it has alg, radius, spoke_degs")
    alg = values.get("alg", "").lower()
    if alg not in _ALGORITHMS:
        raise SpecError(f"turn model needs alg=holo or alg=dubins, found '{shown(text)}'")
    radius = number_field(values, "radius", base.radius) + number_field(values, "mod_radius", 0.0)
    spoke = number_field(values, "spoke_degs", base.spoke_degs) + number_field(values, "mod_spoke_degs", 0.0)
    if not _ALGORITHMS[alg]:
        return replace(base, radius=0.0)
    if radius <= 0.0:
        raise SpecError(f"a dubins turn model needs a radius greater than 0, found {radius:g}")
    if not 1.0 <= spoke < 180.0:
        raise SpecError(f"spoke_degs must be from 1 to less than 180, found {spoke:g}")
    return replace(base, radius=radius, spoke_degs=spoke)


_SYNONYMS = {"rad": "radius", "degs": "spoke_degs"}
_ALGORITHMS = {"holo": False, "holonomic": False, "dubins": True}


def williamson(
    x: float,
    y: float,
    heading: float,
    radius: float,
    *,
    port: bool = True,
    lane_gap: float = 0.0,
    extension: float = 0.0,
    bias: float = 0.0,
    point_gap: float = 20.0,
) -> list[XY]:
    """Path of a turn-about that begins at (x, y) on `heading` and ends on the reversed heading.

    It swings out to the side away from the turn, around the main circle, and back in: on its own track,
    or `lane_gap` metres beside it on the turn side. `extension` metres are first run straight on. `bias`
    in percent (-100..100) shifts the main circle toward the turn side by that share of radius - lane_gap/2.
    Vertices stand every `point_gap` degrees; where two arcs meet the vertex stands twice.
    """
    if not (radius > 0.0 and 0.0 <= lane_gap <= 2.0 * radius and point_gap >= 0.5):
        raise ValueError(f"no turn of radius {radius}, lane gap {lane_gap} and point gap {point_gap}")
    turn = -1.0 if port else 1.0
    away = heading - 90.0 * turn
    half = radius + lane_gap / 2.0
    shift = min(max(bias, -100.0), 100.0) / 100.0 * (radius - lane_gap / 2.0)
    out = math.degrees(math.acos(min(1.0, (half + shift) / (2.0 * radius))))
    back = math.degrees(math.acos(min(1.0, (half - shift) / (2.0 * radius))))
    start = project_point(heading, max(0.0, extension), x, y)

    points = [(x, y)] if extension > 0.0 else []
    # Out: a circle on the away side, turned against the main turn.
    cx, cy = project_point(away, radius, *start)
    points += _arc(cx, cy, radius, away + 180.0, -turn * out, point_gap)
    # Around: its centre lies two radii from the first circle's, on the line through the point just reached.
    mx, my = project_point(away + 180.0 - turn * out, 2.0 * radius, cx, cy)
    points += _arc(mx, my, radius, away - turn * out, turn * (180.0 + out + back), point_gap)
    # In: the mirror image of the first arc, from the main circle's last heading to the reversed one.
    leaving = away - turn * out + turn * (180.0 + out + back)
    ex, ey = project_point(leaving, 2.0 * radius, mx, my)
    points += _arc(ex, ey, radius, leaving + 180.0, -turn * back, point_gap)
    return points


def _arc(cx: float, cy: float, radius: float, start: float, sweep: float, gap: float) -> list[XY]:
    """Points of a circle from bearing `start` through `sweep` degrees (negative: leftward), ends included."""
    if sweep == 0.0:
        return [project_point(start, radius, cx, cy)]
    step = math.copysign(gap, sweep)
    count = int(abs(sweep) / gap + 1e-9)
    points = [project_point(start + i * step, radius, cx, cy) for i in range(count + 1)]
    if abs(sweep) - count * gap > 1e-6:
        points.append(project_point(start + sweep, radius, cx, cy))
    return points
