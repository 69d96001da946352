"""Compiled: rays from one point against the edges of a polygon. Plain arrays in and out."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

PARALLEL = 1e-12
SLACK = 1e-9


@njit(cache=True, error_model="numpy")
def ray_distances(x: float, y: float, east: Array, north: Array, edges: Array, out: Array) -> None:
    """out[i] = distance from (x, y) along (east[i], north[i]) to the first edge it meets, -1 for none.

    edges has one row x1, y1, x2, y2 per edge. An edge that lies on a ray is met at its neighbours' ends.
    """
    for i in range(east.size):
        ux, uy = east[i], north[i]
        best = np.inf
        for k in range(edges.shape[0]):
            dx, dy = edges[k, 2] - edges[k, 0], edges[k, 3] - edges[k, 1]
            turn = ux * dy - uy * dx
            if abs(turn) <= PARALLEL:
                continue
            ox, oy = edges[k, 0] - x, edges[k, 1] - y
            along = (ox * dy - oy * dx) / turn
            part = (ox * uy - oy * ux) / turn
            if along >= -SLACK and -SLACK <= part <= 1.0 + SLACK and along < best:
                best = max(along, 0.0)
        out[i] = best if best < np.inf else -1.0
