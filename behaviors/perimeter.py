"""Distances and times to the edge of a region, as the operation region behaviours report them (C23, C24)."""

from __future__ import annotations

from typing import NamedTuple

from ivp_helm.surroundings import Ownship
from pymoos_lite.geometry.polygon import Polygon


class Perimeter(NamedTuple):
    """Along the present heading and at the present speed; and straight, at the highest speed there is.

    Metres, -1 where the heading never meets the edge; seconds, 0 where there is no sensible number.
    """

    trajectory_dist: float
    trajectory_eta: float
    absolute_dist: float
    absolute_eta: float

    @classmethod
    def measure(cls, polygon: Polygon, own: Ownship, max_speed: float) -> Perimeter:
        """What own ship is away from the polygon's edge, from inside or outside."""
        ahead = polygon.ray_dist(own.x, own.y, own.heading)
        away = polygon.dist(own.x, own.y)
        return cls(ahead, _seconds(ahead, own.speed), away, _seconds(away, max_speed))


def _seconds(distance: float, speed: float) -> float:
    return distance / speed if distance > 0.0 and speed > 0.0 else 0.0
