"""The function that steers a vessel back into a region it has left (behaviors.md C5, C24).

Courses that meet the region are the better the sooner they do. When the vessel heads away it first decides
for one side to turn to, and keeps to it: else it would waver between two equally good ways.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from behaviors.ray_kernels import ray_distances as _ray_distances
from ivp_helm.ivp import Domain, IvPFunction, Peak, zaic_peak, zaic_vector
from pymoos_lite.geometry.angles import bearing
from pymoos_lite.geometry.cpa import unit_vectors
from pymoos_lite.geometry.polygon import Polygon

Side = Literal["none", "left", "right"]


class WayBack(NamedTuple):
    """A preference over courses, and the side the vessel is bound to turn to."""

    course: IvPFunction
    side: Side


def ray_distances(polygon: Polygon, x: float, y: float, courses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance along each course to the polygon's first edge, -1 where the ray misses it; shape (courses,)."""
    out = np.full(courses.shape, -1.0)
    if len(polygon) >= 2:
        edges = np.array(polygon.edges)
        _ray_distances(x, y, *unit_vectors(courses), edges, out)
    return out


def way_back(
    domain: Domain, region: Polygon, x: float, y: float, heading: float, bound: Side = "none"
) -> WayBack:
    """Courses back into the region for a vessel outside of it.

    100 for the course that meets the region soonest, down to 0 for the one that does last and for those
    that miss it. A vessel that heads away is bound to turn to the side of the course nearest to its
    heading (or stays `bound`), and loses the courses of the other side.
    """
    courses = domain["course"].values()
    distances = ray_distances(region, x, y, np.append(courses, heading))
    ahead, distances = float(distances[-1]), distances[:-1]
    hits = distances >= 0.0
    if not hits.any():  # a coarse domain, a far or thin region
        toward = bearing(x, y, *region.center)
        return WayBack(zaic_peak(domain, "course", Peak(toward, 0.0, 180.0), wrap=True), "none")
    near, far = float(distances[hits].min()), float(distances[hits].max())
    scale = 100.0 / (far - near) if far > near else 0.0
    values = np.where(hits, 100.0 - (distances - near) * scale, 0.0)
    side: Side = "none"
    if ahead < 0.0:
        side = bound
        turns = np.mod(courses - heading, 360.0)
        port = turns > 180.0
        if side == "none":
            least = np.where(hits, np.minimum(turns, 360.0 - turns), np.inf)
            side = "left" if port[int(np.argmin(least))] else "right"
        values[port if side == "right" else ~port] = 0.0
    return WayBack(zaic_vector(domain, "course", courses, values), side)  # type: ignore[arg-type]
