"""Who hears whom: sparse communication graphs for populations, and the small named ones of the theory.

A `Graph` is compressed sparse rows: agent i hears indices[indptr[i] : indptr[i + 1]], never itself. Random
graphs are drawn from a generator that is handed in.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from opinion_engine.model import Floats, OpinionError, array_of, finite_array, finite_number

Indices = NDArray[np.uint32]


@dataclass(frozen=True, eq=False)
class Graph:
    """N agents and E directed links. indptr (N + 1,), indices (E,), both uint32; positions (N, 2) if there
    are any.

    Raises OpinionError unless the rows are well formed and free of self-loops.
    """

    indptr: Indices
    indices: Indices
    positions: Floats | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        indptr, indices = np.asarray(self.indptr), np.asarray(self.indices)
        if indptr.ndim != 1 or indptr.size < 2 or indices.ndim != 1:
            raise OpinionError("a graph needs indptr of shape (N + 1,) with N > 0, and indices of shape (E,)")
        for name, array in (("indptr", indptr), ("indices", indices)):
            if array.size and (not np.issubdtype(array.dtype, np.integer) or int(array.min()) < 0):
                raise OpinionError(f"{name} of a graph must be whole numbers of at least 0")
        if indptr[0] != 0 or indptr[-1] != indices.size or np.any(indptr[1:] < indptr[:-1]):
            raise OpinionError(f"indptr must rise from 0 to the number of links, {indices.size}")
        if indices.size >= 2**32:
            raise OpinionError("a graph can have at most 2**32 - 1 links")
        n = indptr.size - 1
        if indices.size and int(indices.max()) >= n:
            raise OpinionError(f"a link leads to agent {int(indices.max())}, the last one is {n - 1}")
        object.__setattr__(self, "indptr", np.ascontiguousarray(indptr, dtype=np.uint32))
        object.__setattr__(self, "indices", np.ascontiguousarray(indices, dtype=np.uint32))
        if np.any(self.indices == self.hearers()):
            raise OpinionError("a graph must not contain self-loops: own opinions are always included")

    @property
    def n_agents(self) -> int:
        """N."""
        return int(self.indptr.size - 1)

    @property
    def n_links(self) -> int:
        """E, directed: a link both ways counts twice."""
        return int(self.indices.size)

    @property
    def degrees(self) -> NDArray[np.int64]:
        """How many each agent hears, (N,)."""
        return np.asarray(np.diff(self.indptr.astype(np.int64)), dtype=np.int64)

    def hearers(self) -> Indices:
        """The hearing agent of every link, (E,)."""
        return np.repeat(np.arange(self.n_agents, dtype=np.uint32), self.degrees)

    def adjacency(self) -> Floats:
        """The dense matrix (N, N), 1 where row hears column; for small graphs."""
        if self.n_agents > 5000:
            raise OpinionError(f"{self.n_agents} agents are too many for a dense matrix")
        dense = np.zeros((self.n_agents, self.n_agents))
        dense[self.hearers(), self.indices] = 1.0
        return dense

    def relabelled(self, order: ArrayLike) -> Graph:
        """The same graph with agent order[i] called i."""
        order = np.asarray(order, dtype=np.int64)
        if order.shape != (self.n_agents,) or np.any(np.sort(order) != np.arange(self.n_agents)):
            raise OpinionError("order must name every agent once")
        rank = np.empty(self.n_agents, dtype=np.int64)
        rank[order] = np.arange(self.n_agents)
        positions = None if self.positions is None else self.positions[order]
        return from_links(self.n_agents, rank[self.hearers()], rank[self.indices], positions)

    def local_order(self) -> NDArray[np.int64]:
        """An order of the agents in which neighbours lie close in memory, which makes large steps faster.

        Along a space-filling curve when positions are known, else reverse Cuthill-McKee (needs scipy).
        """
        if self.positions is not None:
            return _curve_order(self.positions)
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import reverse_cuthill_mckee

        matrix = csr_array(
            (np.ones(self.n_links, np.int8), self.indices.astype(np.int64), self.indptr.astype(np.int64)),
            shape=(self.n_agents, self.n_agents),
        )
        return np.asarray(reverse_cuthill_mckee(matrix), dtype=np.int64)


def from_links(n: int, hearers: ArrayLike, heard: ArrayLike, positions: Floats | None = None) -> Graph:
    """A graph of n agents from directed links (hearer, heard); repeated links count once."""
    _require_agents(n)
    hearer = np.asarray(hearers, dtype=np.int64)
    other = np.asarray(heard, dtype=np.int64)
    if hearer.shape != other.shape or hearer.ndim != 1:
        raise OpinionError("hearers and heard must be lists of the same length")
    if hearer.size and (min(hearer.min(), other.min()) < 0 or max(hearer.max(), other.max()) >= n):
        raise OpinionError(f"a link names an agent outside 0..{n - 1}")
    key = np.unique(hearer * n + other)
    indptr = np.zeros(n + 1, dtype=np.int64)
    np.cumsum(np.bincount(key // n, minlength=n), out=indptr[1:])
    return Graph(indptr.astype(np.uint32), (key % n).astype(np.uint32), positions)


def undirected(n: int, first: ArrayLike, second: ArrayLike, positions: Floats | None = None) -> Graph:
    """A graph in which the agents of each pair hear each other."""
    a, b = np.asarray(first, dtype=np.int64), np.asarray(second, dtype=np.int64)
    return from_links(n, np.concatenate([a, b]), np.concatenate([b, a]), positions)


def from_dense(adjacency: ArrayLike) -> Graph:
    """The graph of a dense matrix: row hears column where the entry is not 0."""
    matrix = array_of("adjacency", adjacency, "(N, N)")
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise OpinionError(f"adjacency has shape {matrix.shape}, expected (N, N)")
    rows, columns = np.nonzero(finite_array("adjacency", matrix, matrix.shape))
    return from_links(matrix.shape[0], rows, columns)


def _require_agents(n: int) -> None:
    if n < 1:
        raise OpinionError(f"a graph needs at least 1 agent, not {n}")


def line(n: int) -> Graph:
    """Each agent hears the one before and the one after."""
    _require_agents(n)
    x = np.arange(n, dtype=np.float64)
    i = np.arange(n - 1)
    return undirected(n, i, i + 1, np.column_stack([x, np.zeros(n)]))


def ring(n: int) -> Graph:
    """A closed line; at least 3 agents."""
    if n < 3:
        raise OpinionError(f"a ring needs at least 3 agents, not {n}")
    i = np.arange(n)
    angle = 2.0 * np.pi * i / n
    return undirected(n, i, (i + 1) % n, np.column_stack([np.sin(angle), np.cos(angle)]))


def star(n: int) -> Graph:
    """Agent 0 hears and is heard by all others, who hear nobody else."""
    _require_agents(n)
    leaves = np.arange(1, n)
    return undirected(n, np.zeros(n - 1, dtype=np.int64), leaves)


def all_to_all(n: int) -> Graph:
    """Everybody hears everybody else."""
    _require_agents(n)
    return from_dense(1.0 - np.eye(n))


def _degree(n: int, mean_degree: float) -> float:
    _require_agents(n)
    value = finite_number("mean_degree", mean_degree)
    if value < 0.0:
        raise OpinionError(f"mean_degree is {value:g}, expected at least 0")
    return value


def random_pairs(n: int, mean_degree: float, rng: np.random.Generator) -> Graph:
    """An Erdos-Renyi graph: n * mean_degree / 2 pairs drawn at random (repeats dropped)."""
    mean_degree = _degree(n, mean_degree)
    wanted = round(n * mean_degree / 2.0)
    first = rng.integers(0, n, wanted)
    second = rng.integers(0, n - 1, wanted) if n > 1 else first[:0]
    second = second + (second >= first[: second.size])  # any other agent
    return undirected(n, first[: second.size], second)


def random_geometric(n: int, mean_degree: float, rng: np.random.Generator) -> Graph:
    """Agents scattered over the unit square; those within radio range hear each other.

    The range gives the mean degree in the middle of the square (a little less at the edges). Agents are
    numbered along a space-filling curve. Needs scipy.
    """
    mean_degree = _degree(n, mean_degree)
    from scipy.spatial import cKDTree

    points = rng.random((n, 2))
    points = points[_curve_order(points)]
    radius = np.sqrt(mean_degree / (np.pi * max(n, 1)))
    pairs = cKDTree(points).query_pairs(radius, output_type="ndarray")
    return undirected(n, pairs[:, 0], pairs[:, 1], points)


def _curve_order(points: Floats) -> NDArray[np.int64]:
    """The order of points (N, 2) along a Z-shaped curve: the bits of x and y interleaved."""
    span = np.ptp(points, axis=0)
    scaled = (points - points.min(axis=0)) / np.where(span > 0.0, span, 1.0)
    cells = np.minimum((scaled * 65536.0).astype(np.uint64), 65535)
    key = np.zeros(len(points), dtype=np.uint64)
    for axis in range(2):
        bits = cells[:, axis]
        for shift, mask in ((8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
            bits = (bits | (bits << np.uint64(shift))) & np.uint64(mask)
        key |= bits << np.uint64(axis)
    return np.argsort(key, kind="stable").astype(np.int64)
