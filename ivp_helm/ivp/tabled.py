"""A function from a table: the utility of every point, cut into few linear pieces.

Where a utility can be had at all points at once, as that of a closest point of approach can, this beats
sampling it on a fixed pattern: flat parts become one piece however large, and edges are found exactly.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ivp_helm.ivp import tabled_kernels as kernels
from ivp_helm.ivp.domain import Domain
from ivp_helm.ivp.errors import IvPError
from ivp_helm.ivp.function import IvPFunction

TOLERANCE: Final = 1.0
_FIRST_CUT: Final = 12
"""Rows of the parts to begin with; larger ones would mostly be cut anyway."""

_spare: list[tuple[NDArray[Any], NDArray[Any]]] = []


def from_table(
    domain: Domain,
    table: ArrayLike,
    *,
    tolerance: float = TOLERANCE,
    base: float = 0.0,
    extent: float = 100.0,
) -> IvPFunction:
    """A function that is nowhere farther from the table than `tolerance` percent of its range.

    domain      one or two variables
    table       utilities of all points, shape `domain.points`
    base, extent   the result is stretched to base..base + extent, a flat one excepted; extent 0: not at all

    The highest point of the table is the highest of the function, of equal ones the last included. Raises
    `IvPError` for another shape, values that are not finite, and domains of more variables.
    """
    u = np.ascontiguousarray(table, dtype=np.float64)
    dims = len(domain)
    if u.shape != domain.points or dims not in (1, 2):
        raise IvPError(f"function over {domain}: the table has shape {u.shape}; expected {domain.points}")
    least, most = float(u.min()), float(u.max())
    if not (math.isfinite(least) and math.isfinite(most)):
        raise IvPError(f"function over {domain}: the table holds values that are not finite")
    if not (0.0 <= tolerance < math.inf and 0.0 <= extent < math.inf and math.isfinite(base)):
        raise IvPError(
            f"function over {domain}: tolerance {tolerance}, base {base} or extent {extent} is wrong"
        )
    if dims == 1:
        u = u.reshape(-1, 1)
    # Taking the arrays out of the list is atomic, so two threads never share them.
    bounds, planes = _spare.pop() if _spare else (np.empty((0, 4), np.int64), np.empty((0, 3)))
    if len(bounds) < u.size:
        bounds, planes = np.empty((u.size, 4), np.int64), np.empty((u.size, 3))
    allowed = 0.01 * tolerance * (most - least)
    count = kernels.cut(u, most, allowed, _FIRST_CUT, bounds, planes)
    block = kernels.block_of_cuts(bounds, planes, count, dims, float(base), float(extent))
    _spare.append((bounds, planes))
    return IvPFunction._of_block(domain, block)
