"""The function that steers a vessel back into a region it has left (behaviors.md C5, C24).

Courses that meet the region are the better the sooner they do. When the vessel heads away it first decides
for one side to turn to, and keeps to it: else it would waver between two equally good ways.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ivp_helm.ivp import Domain, IvPFunction, Peak, zaic_peak, zaic_vector
from pymoos_lite.geometry.angles import angle360, angle_diff, bearing, is_port_turn
from pymoos_lite.geometry.polygon import Polygon

Side = Literal["none", "left", "right"]


class WayBack(NamedTuple):
    """A preference over courses, and the side the vessel is bound to turn to."""

    course: IvPFunction
    side: Side


def ray_distances(polygon: Polygon, x: float, y: float, courses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance along each course to the polygon's first edge, -1 where the ray misses it; shape (courses,).

    All rays against all edges at once: the behaviours ask for some 360 of them in every iteration.
    """
    if len(polygon) < 2:
        return np.full(courses.shape, -1.0)
    edges = np.array(polygon.edges)
    dx, dy = edges[:, 2] - edges[:, 0], edges[:, 3] - edges[:, 1]
    ox, oy = edges[:, 0] - x, edges[:, 1] - y
    angles = np.radians(courses)[:, None]
    ux, uy = np.sin(angles), np.cos(angles)
    turn = ux * dy - uy * dx
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (ox * dy - oy * dx) / turn
        part = (ox * uy - oy * ux) / turn
    slack = 1e-9
    hit = (np.abs(turn) > 1e-12) & (along >= -slack) & (part >= -slack) & (part <= 1.0 + slack)
    nearest = np.where(hit, np.maximum(along, 0.0), np.inf).min(axis=1)
    return np.where(np.isfinite(nearest), nearest, -1.0)


def way_back(
    domain: Domain, region: Polygon, x: float, y: float, heading: float, bound: Side = "none"
) -> WayBack:
    """Courses back into the region for a vessel outside of it.

    100 for the course that meets the region soonest, down to 0 for the one that does last and for those
    that miss it. A vessel that heads away is bound to turn to the side of the course nearest to its
    heading (or stays `bound`), and loses the courses of the other side.
    """
    courses = domain["course"].values()
    distances = ray_distances(region, x, y, courses)
    hits = distances >= 0.0
    if not hits.any():  # a coarse domain, a far or thin region
        toward = bearing(x, y, *region.center)
        return WayBack(zaic_peak(domain, "course", Peak(toward, 0.0, 180.0), wrap=True), "none")
    near, far = float(distances[hits].min()), float(distances[hits].max())
    scale = 100.0 / (far - near) if far > near else 0.0
    values = np.where(hits, 100.0 - (distances - near) * scale, 0.0)
    side: Side = "none"
    if region.ray_dist(x, y, heading) < 0.0:
        side = bound
        if side == "none":
            nearest = min(courses[hits].tolist(), key=lambda course: angle_diff(course, heading))
            side = "left" if is_port_turn(heading, nearest) else "right"
        port = np.array([angle360(course - heading) > 180.0 for course in courses.tolist()])
        values[port if side == "right" else ~port] = 0.0
    return WayBack(zaic_vector(domain, "course", courses.tolist(), values.tolist()), side)
