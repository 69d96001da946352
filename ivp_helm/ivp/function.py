"""Piecewise functions over a domain: what a behaviour wants, written as pieces.

A function is immutable: every operation gives a new one, so a function can be kept, weighted and
solved any number of times without changing. Its pieces live in arrays (one block, see kernels.py),
never in one object per piece. It knows nothing of how it was built or how it will be solved.
Source: ivp_math.md 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from mypy_extensions import mypyc_attr
from numpy.typing import ArrayLike, NDArray

from ivp_helm.ivp import kernels
from ivp_helm.ivp.domain import Domain
from ivp_helm.ivp.errors import IvPError

DEFAULT_WEIGHT: Final = 10.0
# Up to so many domain points coverage is counted point by point, beyond it piece by piece.
COUNTED_POINTS: Final = 2_000_000


@mypyc_attr(native_class=False)
class IvPFunction:
    """A piecewise constant or linear function over a domain, with a priority weight and a context.

    low, high      (n, d) integer indexes, inclusive bounds of n boxes over d variables
    coefficients   (n, d+1): d slopes **per index** and the intercept, or (n, 1) constants
    low_open, high_open   (n, d) booleans marking exclusive bounds; they become inclusive ones
    grid           edge lengths, in points, of the search cells other tools may use; whole domain if None
    weight         priority weight; any finite number. Solvers leave functions with weight <= 0 out
    context        free text, in a helm "<iteration>:<behaviour name>"

    A point covered by no piece is infeasible. Where pieces overlap, the first in stored order counts.
    Raises `IvPError` for no pieces, bounds reversed or outside the domain, and numbers not finite.
    """

    __slots__ = ("_address", "_block", "_disjoint", "context", "degree", "domain", "grid", "pieces", "weight")
    domain: Domain
    pieces: int
    """Number of pieces."""
    degree: int
    grid: tuple[int, ...]
    weight: float
    context: str
    _block: NDArray[np.int64]
    _disjoint: NDArray[np.int64] | None  # the same without overlaps: mostly the same block, else made late
    _address: int  # of _disjoint; 0 while that is not made

    def __init__(
        self,
        domain: Domain,
        low: ArrayLike,
        high: ArrayLike,
        coefficients: ArrayLike,
        *,
        low_open: ArrayLike | None = None,
        high_open: ArrayLike | None = None,
        grid: Sequence[int] | None = None,
        weight: float = DEFAULT_WEIGHT,
        context: str = "",
    ) -> None:
        dims = len(domain)
        lows = _bounds(low, dims, "low")
        highs = _bounds(high, dims, "high")
        coefs = np.ascontiguousarray(coefficients, dtype=np.float64)
        n = len(lows)
        if n == 0:
            raise IvPError(f"function over {domain}: it has no pieces")
        if coefs.ndim != 2 or coefs.shape[1] not in (1, dims + 1):
            raise IvPError(
                f"function over {domain}: coefficients have shape {coefs.shape};"
                f" expected ({n}, {dims + 1}) for linear or ({n}, 1) for constant pieces"
            )
        if len(highs) != n or len(coefs) != n:
            raise IvPError(
                f"function over {domain}: {n} lower, {len(highs)} upper bounds, {len(coefs)} coefficient rows"
            )
        limit = np.array(domain.points)
        wrong = (lows < 0) | (highs < lows) | (highs >= limit)
        if wrong.any():
            p, d = np.argwhere(wrong)[0]
            raise IvPError(
                f"function over {domain}: piece {p} has bounds {lows[p, d]} to {highs[p, d]} in"
                f" {domain.names[d]!r}; expected 0 <= low <= high <= {limit[d] - 1}"
            )
        open_low = np.zeros((n, dims), np.bool_) if low_open is None else _marks(low_open, n, dims)
        open_high = np.zeros((n, dims), np.bool_) if high_open is None else _marks(high_open, n, dims)
        block = kernels.block_from_arrays(lows, highs, open_low, open_high, coefs)
        if block[0] == 0:
            raise IvPError(f"function over {domain}: exclusive bounds leave every piece empty")
        _seal(block, domain, disjoint=False)
        if domain.size <= COUNTED_POINTS:
            gaps, overlaps = kernels.find_cover(block, domain._points_array)
            block[5] = (kernels.OVERLAPS if overlaps else 0) | (kernels.COVERS if not gaps + overlaps else 0)
        elif kernels.any_overlap(block):
            block[5] = kernels.OVERLAPS
        self._set(domain, block, 0 if coefs.shape[1] == 1 and dims > 0 else 1, _edges(grid, domain))
        self.weight = _finite(weight, domain, context)
        self.context = context

    @classmethod
    def _of_block(
        cls, domain: Domain, block: NDArray[np.int64], grid: tuple[int, ...] | None = None, degree: int = 1
    ) -> IvPFunction:
        """Wrap a sealed block whose pieces are known to be sound (builders only)."""
        self = cls.__new__(cls)
        self._set(domain, block, degree, domain.points if grid is None else grid)
        self.weight = DEFAULT_WEIGHT
        self.context = ""
        return self

    def _set(self, domain: Domain, block: NDArray[np.int64], degree: int, grid: tuple[int, ...]) -> None:
        self.domain = domain
        self.degree = degree
        self.grid = grid
        self._block = block
        item = block.item
        self.pieces = item(0)
        if item(5) & kernels.OVERLAPS:
            self._disjoint = None
            self._address = 0
        else:
            self._disjoint = block
            self._address = item(2) - 8 * (8 + domain._width)

    def _without_overlaps(self) -> NDArray[np.int64]:
        """The block of the same function as disjoint pieces, worked out when first asked for."""
        if self._disjoint is None:
            low, high, coef = kernels.without_overlaps(self._block)
            marks = np.zeros(low.shape, np.bool_)
            block: NDArray[np.int64] = kernels.block_from_arrays(low, high, marks, marks, coef)
            _seal(block, self.domain, disjoint=True)
            block[6:8] = self._block[6:8]  # the range stays that of all pieces, hidden ones included
            self._disjoint = block
            self._address = int(block[2]) - 8 * (8 + len(self.domain))
        return self._disjoint

    def _copy(self, block: NDArray[np.int64] | None = None) -> IvPFunction:
        new = IvPFunction.__new__(IvPFunction)
        if block is None:
            new.domain, new.degree, new.grid = self.domain, self.degree, self.grid
            new._block, new._disjoint, new._address = self._block, self._disjoint, self._address
            new.pieces = self.pieces
        else:
            new._set(self.domain, block, self.degree, self.grid)
        new.weight = self.weight
        new.context = self.context
        return new

    # -- what it holds -------------------------------------------------------------------------------

    @property
    def low(self) -> NDArray[np.int32]:
        """Lower bounds, inclusive indexes, shape (n, d), read-only."""
        n, dims = self.pieces, len(self.domain)
        head = 8 + dims
        return _frozen(self._block[head : head + (n * dims + 1) // 2].view(np.int32)[: n * dims], dims)

    @property
    def high(self) -> NDArray[np.int32]:
        """Upper bounds, inclusive indexes, shape (n, d), read-only."""
        n, dims = self.pieces, len(self.domain)
        half = (n * dims + 1) // 2
        head = 8 + dims + half
        return _frozen(self._block[head : head + half].view(np.int32)[: n * dims], dims)

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """Slopes per index and intercept, shape (n, d+1), read-only; zero slopes if degree is 0."""
        n, dims = self.pieces, len(self.domain)
        start = 8 + dims + 2 * ((n * dims + 1) // 2)
        return _frozen(self._block[start:].view(np.float64)[: n * (dims + 1)], dims + 1)

    @property
    def minimum(self) -> float:
        """The lowest value any piece takes."""
        return float(self._block.view(np.float64)[6])

    @property
    def maximum(self) -> float:
        """The highest value any piece takes."""
        return float(self._block.view(np.float64)[7])

    @property
    def is_partition(self) -> bool:
        """Whether every point is known to be covered by exactly one piece."""
        return bool(int(self._block[5]) & kernels.COVERS)

    @property
    def has_overlaps(self) -> bool:
        """Whether some point is covered by more than one piece (the first in stored order counts)."""
        return bool(int(self._block[5]) & kernels.OVERLAPS)

    def __len__(self) -> int:
        return self.pieces

    def __repr__(self) -> str:
        return (
            f"<IvPFunction {self.context!r} over {':'.join(self.domain.names)}: {self.pieces} pieces,"
            f" {self.minimum:g} to {self.maximum:g}, weight {self.weight:g}>"
        )

    # -- values -----------------------------------------------------------------------------------------

    def evaluate(self, indexes: ArrayLike) -> NDArray[np.float64]:
        """Values (without priority weight) at index points shaped (m, d) -> (m,); NaN where infeasible."""
        points = np.ascontiguousarray(np.atleast_2d(np.asarray(indexes)), dtype=np.int64)
        if points.ndim != 2 or points.shape[1] != len(self.domain):
            raise IvPError(f"function over {self.domain}: points have shape (m, {len(self.domain)})")
        values: NDArray[np.float64] = kernels.evaluate(self._block, points)
        return values

    def value(self, *point: float) -> float:
        """The value at one native point (snapped to the nearest domain values); NaN where infeasible."""
        return float(self.evaluate([self.domain.index_of(point)])[0])

    def table(self) -> NDArray[np.float64]:
        """The value at every domain point, shape `domain.points`; NaN where infeasible."""
        flat: NDArray[np.float64] = kernels.table(self._block, self.domain._points_array)
        return flat.reshape(self.domain.points)

    def coverage(self) -> tuple[int, int]:
        """How many domain points no piece covers, and how many more than one piece covers."""
        gaps, overlaps = kernels.find_cover(self._block, self.domain._points_array)
        return int(gaps), int(overlaps)

    # -- new functions from this one ------------------------------------------------------------------

    def weighted(self, weight: float, context: str | None = None) -> IvPFunction:
        """The same function with another priority weight, and context if given. Shares the pieces."""
        new = self._copy()
        new.weight = _finite(weight, self.domain, self.context)
        if context is not None:
            new.context = context
        return new

    def labelled(self, context: str) -> IvPFunction:
        """The same function with another context string. Shares the pieces."""
        new = self._copy()
        new.context = context
        return new

    def gridded(self, edges: Sequence[int]) -> IvPFunction:
        """The same function with other search-cell edges (points per variable). Shares the pieces."""
        new = self._copy()
        new.grid = _edges(edges, self.domain)
        return new

    def normalised(self, base: float = 0.0, extent: float = 100.0) -> IvPFunction:
        """Stretched so that values run from `base` to `base + extent`; a flat function stays as it is."""
        least, most = self.minimum, self.maximum
        if not (math.isfinite(base) and math.isfinite(extent) and extent > 0):
            raise IvPError(f"function over {self.domain}: cannot normalise to {base} + {extent}")
        if most - least <= 0:
            return self
        scale = extent / (most - least)
        return self._copy(kernels.transformed(self._block, scale, base - least * scale))

    def scaled(self, factor: float) -> IvPFunction:
        """Every value times `factor` > 0."""
        if not (math.isfinite(factor) and factor > 0):
            raise IvPError(f"function over {self.domain}: scale factor {factor} is not a positive number")
        return self._copy(kernels.transformed(self._block, float(factor), 0.0))

    def shifted(self, amount: float) -> IvPFunction:
        """Every value plus `amount`."""
        return self._copy(kernels.transformed(self._block, 1.0, _finite(amount, self.domain, "shift")))

    def expanded(self, domain: Domain) -> IvPFunction:
        """The same function over a larger domain, flat in the variables it lacked.

        Variables are matched by name; `IvPError` when one is missing there or has other limits or counts.
        """
        if domain is self.domain:
            return self
        scope = domain.scope_of(self.domain)
        new = IvPFunction.__new__(IvPFunction)
        grid = list(domain.points)
        for d, v in enumerate(scope):
            grid[v] = self.grid[d]
        block = kernels.expanded(self._block, scope, domain._points_array)
        new._set(domain, block, self.degree, tuple(grid))
        new.weight = self.weight
        new.context = self.context
        return new

    def __reduce__(self) -> tuple[Any, ...]:
        coefs = self.coefficients if self.degree else self.coefficients[:, -1:]
        return _rebuilt, (
            self.domain,
            np.array(self.low),
            np.array(self.high),
            np.array(coefs),
            self.grid,
            self.weight,
            self.context,
        )


def constant(domain: Domain, value: float, *, context: str = "") -> IvPFunction:
    """One piece with the same value everywhere."""
    low = np.zeros((1, len(domain)), np.int64)
    high = np.array([domain.points]) - 1
    return IvPFunction(domain, low, high, [[value]], context=context)


def _rebuilt(
    domain: Domain, low: Any, high: Any, coefs: Any, grid: Any, weight: float, context: str
) -> IvPFunction:
    return IvPFunction(domain, low, high, coefs, grid=grid, weight=weight, context=context)


def _frozen(flat: NDArray[Any], rows: int) -> NDArray[Any]:
    view = flat.reshape(rows, -1).T
    view.setflags(write=False)
    return view


def _seal(block: NDArray[np.int64], domain: Domain, *, disjoint: bool) -> None:
    outcome, p = kernels.seal(block, domain._points_array, disjoint)
    if outcome == kernels.BAD_COEFFICIENT:
        raise IvPError(f"function over {domain}: piece {p} has a value that is not finite")
    if outcome == kernels.BAD_BOUNDS:
        raise IvPError(f"function over {domain}: piece {p} leaves the domain")


def _bounds(values: ArrayLike, dims: int, which: str) -> NDArray[np.int64]:
    array = np.asarray(values)
    if array.size == 0:
        return np.zeros((0, dims), np.int64)
    if array.ndim != 2 or array.shape[1] != dims:
        raise IvPError(f"{which} bounds have shape {array.shape}; expected (pieces, {dims})")
    if not np.issubdtype(array.dtype, np.integer):
        if not np.issubdtype(array.dtype, np.floating) or not (np.floor(array) == array).all():
            raise IvPError(f"{which} bounds must be whole numbers (indexes)")
        if np.abs(array).max() > 2**40:
            raise IvPError(f"{which} bounds are out of all range")
    return np.ascontiguousarray(array, dtype=np.int64)


def _marks(values: ArrayLike, n: int, dims: int) -> NDArray[np.bool_]:
    array = np.ascontiguousarray(values, dtype=np.bool_)
    if array.shape != (n, dims):
        raise IvPError(f"exclusive-bound marks have shape {array.shape}; expected ({n}, {dims})")
    return array


def _edges(grid: Sequence[int] | None, domain: Domain) -> tuple[int, ...]:
    if grid is None:
        return domain.points
    if len(grid) != len(domain):
        raise IvPError(f"grid of {len(grid)} edge(s) over {domain}; expected {len(domain)}")
    for edge, points, name in zip(grid, domain.points, domain.names, strict=True):
        if not 1 <= edge <= points:
            raise IvPError(f"grid edge {edge} of {name!r} must be 1 to {points} points")
    return tuple(int(edge) for edge in grid)


def _finite(weight: float, domain: Domain, context: str) -> float:
    number = float(weight)
    if not math.isfinite(number):
        raise IvPError(f"function {context!r} over {domain}: {number} is not a finite number")
    return number
