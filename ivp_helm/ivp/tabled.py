"""A function from a table: the utility of every point, made into pieces as the reflector makes them.

Where a utility is to be had at all points at once, as that of a closest point of approach is, this is
the quick way to the reflector's function: the same values everywhere, in fewer pieces, since flat tiles
that lie side by side are joined.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ivp_helm.ivp import tabled_kernels as kernels
from ivp_helm.ivp.build_info import Build
from ivp_helm.ivp.domain import Domain
from ivp_helm.ivp.errors import IvPError
from ivp_helm.ivp.function import IvPFunction
from ivp_helm.ivp.reflector import reflect

_spare: list[tuple[NDArray[Any], NDArray[Any], NDArray[Any]]] = []


def from_table(
    domain: Domain,
    table: ArrayLike,
    pieces: tuple[int, ...],
    build_info: str = "",
    *,
    base: float = 0.0,
    extent: float = 100.0,
) -> IvPFunction:
    """The function of a table of utilities.

    domain      one or two variables
    table       utilities of all points, shape `domain.points`
    pieces      edge lengths of a piece in points, one per variable
    build_info  what a user wants otherwise, as `reflect` takes it
    base, extent   the result is stretched to base..base + extent, a flat one excepted; extent 0: not at all

    Raises `IvPError` for another shape, values that are not finite, and domains of more variables.
    """
    u = np.ascontiguousarray(table, dtype=np.float64)
    dims = len(domain)
    if u.shape != domain.points or dims not in (1, 2):
        raise IvPError(f"function over {domain}: the table has shape {u.shape}; expected {domain.points}")
    if not math.isfinite(u.sum()):
        raise IvPError(f"function over {domain}: the table holds values that are not finite")
    if not (0.0 <= extent < math.inf and math.isfinite(base)):
        raise IvPError(f"function over {domain}: base {base} or extent {extent} is wrong")
    if len(pieces) != dims or min(pieces) < 1:
        raise IvPError(f"function over {domain}: pieces {pieces}; expected a length of at least 1 for each")
    if build_info:
        built = reflect(
            domain, _lookup(domain, u), build_info, build=Build(uniform_piece=pieces), normalise=False
        )
        return built.normalised(base, extent) if extent > 0.0 else built
    width, height = pieces if dims == 2 else (pieces[0], 1)
    if dims == 1:
        u = u.reshape(-1, 1)
    across = -(-u.shape[1] // height)
    tiles = -(-u.shape[0] // width) * across
    # Taking the arrays out of the list is atomic, so two threads never share them.
    bounds, planes, owner = _spare.pop() if _spare else _room(0, 0)
    if len(bounds) < tiles or len(owner) < across:
        bounds, planes, owner = _room(tiles, across)
    count = kernels.tile(u, width, height, bounds, planes, owner)
    block = kernels.block_of_tiles(bounds, planes, count, dims, float(base), float(extent))
    _spare.append((bounds, planes, owner))
    return IvPFunction._of_block(domain, block)


def _room(tiles: int, across: int) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    return np.empty((tiles, 4), np.int64), np.empty((tiles, 3)), np.empty(across, np.int64)


def _lookup(domain: Domain, u: NDArray[np.float64]) -> Any:
    """The table as a function of native values."""
    lows, deltas = np.array(domain.low), np.array(domain.delta)

    def utility(*columns: NDArray[np.float64]) -> NDArray[np.float64]:
        indexes = tuple(
            np.rint((column - low) / delta).astype(np.int64)
            for column, low, delta in zip(columns, lows, deltas, strict=True)
        )
        return np.asarray(u[indexes])

    return utility
