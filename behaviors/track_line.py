"""Steering along a line instead of straight for its end (behaviors.md C1, lead)."""

from __future__ import annotations

from math import hypot

from pymoos_lite.geometry.angles import bearing, project_point
from pymoos_lite.geometry.segments import nearest_on_segment
from pymoos_lite.geometry.shapes import XY


def track_point(anchor: XY, point: XY, x: float, y: float, lead: float, damper: float = 0.0) -> XY:
    """The point to steer for on the line from `anchor` to `point`: `lead` metres on from the nearest spot.

    Within `damper` metres of the line the lead grows up to three times, which calms the steering. It
    never reaches beyond `point`.
    """
    if anchor == point:
        return point
    foot = nearest_on_segment(*anchor, *point, x, y)
    off = hypot(x - foot[0], y - foot[1])
    if damper > 0.0 and off < damper:
        lead *= 1.0 + 2.0 * (1.0 - off / damper)
    lead = min(lead, hypot(point[0] - foot[0], point[1] - foot[1]))
    return project_point(bearing(*anchor, *point), lead, *foot)
