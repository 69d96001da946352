"""A function from a table: the utility of every point, made into pieces as the reflector makes them.

Where a utility is to be had at all points at once, as that of a closest point of approach is, this is
the quick way to the reflector's function: the same values everywhere, in fewer pieces, since flat tiles
that lie side by side are joined.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ivp_helm.ivp import tabled_kernels as kernels
from ivp_helm.ivp.build_info import Build
from ivp_helm.ivp.domain import Domain
from ivp_helm.ivp.errors import IvPError
from ivp_helm.ivp.function import IvPFunction
from ivp_helm.ivp.reflector import reflect


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
    tiling = Tiling.of(domain, pieces)
    samples = np.empty(tiling.size)
    kernels.sample(u if dims == 2 else u.reshape(-1, 1), *tiling.edges, samples)
    return tiling.function(samples, base, extent)


class Tiling:
    """Equal tiles over a domain of one or two variables, and the few points of it that their planes are made of.

    A utility that is computed point by point need not be computed elsewhere: with tiles of 3 by 3 points,
    the corners and the centre are five of nine. Get one by `Tiling.of`, which remembers them.

    indexes    where the utility is wanted, as an index array per variable, each shaped (size,)
    """

    __slots__ = ("_shape", "domain", "edges", "indexes", "size")

    def __init__(self, domain: Domain, pieces: tuple[int, ...]) -> None:
        dims = len(domain)
        if len(pieces) != dims or min(pieces) < 1 or dims not in (1, 2):
            raise IvPError(
                f"function over {domain}: pieces {pieces}; expected a length of at least 1 for each"
            )
        self.domain = domain
        m, n = domain.points if dims == 2 else (domain.points[0], 1)
        self.edges = width, height = pieces if dims == 2 else (pieces[0], 1)
        self.size = 5 * -(-m // width) * -(-n // height)
        self._shape = (m, n, dims)
        at = np.empty((2, self.size))
        for k, grid in enumerate(np.indices((m, n))):
            kernels.sample(grid.astype(np.float64), width, height, at[k])
        self.indexes: tuple[NDArray[np.int64], ...] = tuple(at[:dims].astype(np.int64))

    @staticmethod
    @lru_cache(maxsize=64)
    def of(domain: Domain, pieces: tuple[int, ...]) -> Tiling:
        """The tiling with pieces of these edge lengths in points; raises `IvPError` when they do not fit."""
        return Tiling(domain, pieces)

    def function(self, samples: NDArray[np.float64], base: float = 0.0, extent: float = 100.0) -> IvPFunction:
        """The function that `from_table` makes of a table with these values at `indexes`, shape (size,).

        Raises `IvPError` for values that are not finite.
        """
        m, n, dims = self._shape
        block = kernels.block_of_samples(samples, m, n, dims, *self.edges, base, extent)
        if not block[0]:
            raise IvPError(f"function over {self.domain}: the table holds values that are not finite")
        return IvPFunction._of_block(self.domain, block)


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
