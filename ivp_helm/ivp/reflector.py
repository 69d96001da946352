"""Approximating any function over a domain by pieces.

The author of a behaviour writes the mathematics once, in native units and over arrays:

    def range_rate(course, speed):            # one array per variable, all of the same length
        return speed * np.cos(np.radians(course - bearing))

    f = reflect(domain.subdomain("course,speed"), range_rate, uniform_amount=1000)

A numba-compiled function over arrays, or a numpy ufunc made by `numba.vectorize`, serves as well and is
quicker. Everything around the evaluation is compiled. Source: ivp_math.md 6.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ivp_helm.ivp import fit_kernels as kernels
from ivp_helm.ivp.boxes import Region, checked_region, uniform_piece
from ivp_helm.ivp.build_info import Build, parse_build_info
from ivp_helm.ivp.domain import Domain
from ivp_helm.ivp.errors import IvPError
from ivp_helm.ivp.function import IvPFunction

Underlying = Callable[..., ArrayLike]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Up to so many points queue refinement evaluates the whole domain once and looks samples up.
TABLE_POINTS: Final = 100_000
# Beyond that it evaluates the splits of so many pieces at a time, the most promising first.
BATCH: Final = 64
MAX_PIECES: Final = 5_000_000
KEPT_PIECES: Final = 20_000  # tilings of up to so many pieces are remembered


class Rating(NamedTuple):
    """How far a piecewise function is from what it approximates, over all domain points."""

    mean: float  # of |F - f|
    worst: float
    rms: float


class _Tiling(NamedTuple):
    low: Ints
    high: Ints
    marks: Ints  # 1 plateau, -1 basin, 0 neither
    samples: Floats  # native coordinates, one row per variable


def reflect(
    domain: Domain,
    function: Underlying,
    build_info: str = "",
    *,
    build: Build | None = None,
    degree: int = 1,
    known_min: float | None = None,
    known_max: float | None = None,
    normalise: bool = True,
    notes: list[str] | None = None,
    **options: Any,
) -> IvPFunction:
    """Build a piecewise function over `domain` from `function`, called with one array per variable.

    build_info   the text form, read on top of `build`, itself on top of the defaults
    options      fields of `Build` by name, which win over both: reflect(d, f, uniform_amount=600)
    degree       1 for linear pieces, 0 for constant ones
    known_min, known_max   values of the function in its basins and on its plateaus; without them those
                 regions are fitted like others
    normalise    stretch the result to 0..100
    notes        collects remarks on what the text holds without effect

    The result covers the domain exactly once, and the same arguments give the same pieces: the queue
    holds every piece and nothing is random. Raises `IvPError` for bad options, and for a function that
    returns the wrong number of values or one that is not finite.
    """
    if degree not in (0, 1):
        raise IvPError(f"reflector: degree {degree}; only 0 and 1 can be built")
    plan = parse_build_info(domain, build_info, build, notes) if build_info else build or Build()
    if options:
        try:
            plan = replace(plan, **options)
        except TypeError:
            known = ", ".join(Build.__dataclass_fields__)
            raise IvPError(
                f"reflector: unknown option among {', '.join(options)}; there are {known}"
            ) from None
    tiling = _tiling(domain, plan)
    low, high = tiling.low, tiling.high
    coef, errors = kernels.fit_all(
        low,
        high,
        tiling.marks,
        _sampled(function, domain, tiling.samples),
        degree,
        plan.strict_range,
        math.nan if known_min is None else float(known_min),
        math.nan if known_max is None else float(known_max),
    )
    extra = max(plan.smart_amount, len(low) * plan.smart_percent // 100)
    if extra > 0:
        extra = min(extra, domain.size - len(low))
        _check_size(len(low) + extra)
        if domain.size <= TABLE_POINTS:
            table = tabulate(domain, function).ravel()
            low, high, coef, errors = kernels.refine_by_table(
                low, high, coef, errors, extra, plan.smart_thresh,
                table, domain._points_array, degree, plan.strict_range,
            )  # fmt: skip
        else:
            low, high, coef = _refine_in_batches(
                domain, function, low, high, coef, errors, extra, degree, plan
            )
    if plan.auto_peak:
        low, high, coef = _isolate_peak(domain, function, low, high, coef, degree, plan)
    block, bad = kernels.block_of_boxes(low, high, coef, 0.0, 100.0 if normalise else 0.0)
    if bad >= 0:
        raise IvPError(f"reflector: piece {bad} has a value that is not finite")
    return IvPFunction._of_block(domain, block, _grid(domain, plan), degree)


def tabulate(domain: Domain, function: Underlying) -> Floats:
    """The underlying function at every domain point, shape `domain.points`."""
    axes = np.meshgrid(*(v.values() for v in domain.variables), indexing="ij")
    return _values(function, [axis.ravel() for axis in axes], domain).reshape(domain.points)


def rate(function: Underlying, f: IvPFunction) -> Rating:
    """Compare a (not normalised) piecewise function with its original at every domain point."""
    error = np.abs(tabulate(f.domain, function) - f.table())
    return Rating(float(error.mean()), float(error.max()), float(np.sqrt((error**2).mean())))


# -- evaluation ------------------------------------------------------------------------------------------


def _values(function: Underlying, columns: list[Floats], domain: Domain) -> Floats:
    count = columns[0].size
    values = np.asarray(function(*columns), dtype=np.float64)
    if values.shape != (count,):
        if values.shape != ():
            raise IvPError(
                f"reflector: the function over {domain} gave values of shape {values.shape}"
                f" for {count} points; expected ({count},)"
            )
        values = np.full(count, float(values))
    return np.ascontiguousarray(values)


def _sampled(function: Underlying, domain: Domain, samples: Floats) -> Floats:
    # copies, so that a function which changes its arguments does not change the remembered samples
    return _values(function, list(samples.copy()), domain)


# -- pieces ------------------------------------------------------------------------------------------------


def _grid(domain: Domain, plan: Build) -> tuple[int, ...]:
    return (
        _lengths(domain, plan.uniform_grid, "uniform_grid") if plan.uniform_grid else _uniform(domain, plan)
    )


def _uniform(domain: Domain, plan: Build) -> tuple[int, ...]:
    if plan.uniform_piece is not None:
        return _lengths(domain, plan.uniform_piece, "uniform_piece")
    return _uniform_amount(domain, plan.uniform_amount)


@lru_cache(maxsize=256)
def _uniform_amount(domain: Domain, amount: int) -> tuple[int, ...]:
    return uniform_piece(domain, amount)


def _lengths(domain: Domain, lengths: tuple[int, ...], what: str) -> tuple[int, ...]:
    if len(lengths) != len(domain) or min(lengths) < 1:
        raise IvPError(
            f"reflector: {what} {lengths} does not fit domain {domain}; one length >= 1 per variable"
        )
    return tuple(min(int(a), b) for a, b in zip(lengths, domain.points, strict=True))


def _check_size(pieces: int) -> None:
    if pieces > MAX_PIECES:
        raise IvPError(f"reflector: {pieces} pieces are more than {MAX_PIECES}")


def _tiling(domain: Domain, plan: Build) -> _Tiling:
    edges = _uniform(domain, plan)
    pieces = math.prod([-(-p // e) for p, e in zip(domain.points, edges, strict=True)])
    _check_size(pieces)
    uniform = _known_tiling(domain, edges) if pieces <= KEPT_PIECES else _uniform_tiling(domain, edges)
    if not (plan.plateaus or plan.basins or plan.refine_regions):
        return uniform
    low, high, marks = uniform.low, uniform.high, uniform.marks
    marked = [(checked_region(domain, r), 1) for r in plan.plateaus]
    marked += [(checked_region(domain, r), -1) for r in plan.basins]
    parts: list[tuple[Ints, Ints, Ints]] = []
    # the regions furthest up are kept whole, later ones lose what they share with them
    for i, (region, mark) in enumerate(sorted(marked, key=lambda m: -sum(m[0].high))):
        first, last = _corners(region)
        part = first[None, :], last[None, :], np.array([mark])
        for earlier, _ in sorted(marked, key=lambda m: -sum(m[0].high))[:i]:
            part = kernels.cut_out(*part, *_corners(earlier))
        parts.append(part)
        low, high, marks = kernels.cut_out(low, high, marks, first, last)
    for wanted in (1, -1):  # plateaus are stored before basins
        for part in parts:
            if part[2].size and part[2][0] == wanted:
                low, high, marks = (
                    np.concatenate(pair) for pair in zip((low, high, marks), part, strict=True)
                )
    for region, lengths in zip(plan.refine_regions, plan.refine_pieces, strict=False):
        first, last = _corners(checked_region(domain, region))
        low, high, marks = kernels.cut_out(low, high, marks, first, last)
        tiles = kernels.tile(first, last, np.array(_lengths(domain, lengths, "refine_piece")))
        low, high = np.concatenate((low, tiles[0])), np.concatenate((high, tiles[1]))
        marks = np.concatenate((marks, np.zeros(len(tiles[0]), np.int64)))
        _check_size(len(low))
    return _Tiling(low, high, marks, _sample_points(domain, low, high))


@lru_cache(maxsize=64)
def _known_tiling(domain: Domain, edges: tuple[int, ...]) -> _Tiling:
    """Tiles and samples depend on nothing but sizes, so iteration after iteration they are the same."""
    return _uniform_tiling(domain, edges)


def _uniform_tiling(domain: Domain, edges: tuple[int, ...]) -> _Tiling:
    first = np.zeros(len(domain), np.int64)
    last = np.array(domain.points, dtype=np.int64) - 1
    low, high = kernels.tile(first, last, np.array(edges, dtype=np.int64))
    return _Tiling(low, high, np.zeros(len(low), np.int64), _sample_points(domain, low, high))


def _sample_points(domain: Domain, low: Ints, high: Ints) -> Floats:
    samples: Floats = kernels.sample_points(low, high, np.array(domain.low), np.array(domain.delta))
    return samples


def _corners(region: Region) -> tuple[Ints, Ints]:
    return np.array(region.low, dtype=np.int64), np.array(region.high, dtype=np.int64)


# -- refinement ----------------------------------------------------------------------------------------------


def _fitted(
    domain: Domain, function: Underlying, low: Ints, high: Ints, degree: int, plan: Build
) -> tuple[Floats, Floats]:
    values = _sampled(function, domain, _sample_points(domain, low, high))
    marks = np.zeros(len(low), np.int64)
    coef, errors = kernels.fit_all(low, high, marks, values, degree, plan.strict_range, math.nan, math.nan)
    return coef, errors


def _refine_in_batches(
    domain: Domain,
    function: Underlying,
    low: Ints,
    high: Ints,
    coef: Floats,
    errors: Floats,
    extra: int,
    degree: int,
    plan: Build,
) -> tuple[Ints, Ints, Floats]:
    """What refine_by_table does, for domains too large to tabulate: the same splits in the same order.

    Each piece's two halves are fitted ahead, for many pieces in one call of the function.
    """
    n = len(low)
    dims = len(domain)
    low = np.concatenate((low, np.empty((extra, dims), np.int64)))
    high = np.concatenate((high, np.empty((extra, dims), np.int64)))
    coef = np.concatenate((coef, np.empty((extra, dims + 1))))
    heap = [(-float(e), p) for p, e in enumerate(errors) if (high[p] > low[p]).any()]
    heapq.heapify(heap)
    ahead: dict[int, tuple[Any, ...]] = {}  # piece -> low, high, coef, errors of its halves
    total = n + extra
    while n < total and heap and -heap[0][0] > plan.smart_thresh:
        p = heap[0][1]
        if p not in ahead:
            wanted = [q for _, q in heapq.nsmallest(BATCH, heap) if q not in ahead]
            lows = np.repeat(low[wanted], 2, axis=0)
            highs = np.repeat(high[wanted], 2, axis=0)
            left, right = np.empty(dims, np.int64), np.empty(dims, np.int64)
            for i, q in enumerate(wanted):
                kernels.halves(low[q], high[q], left, right)
                highs[2 * i] = left
                lows[2 * i + 1] = right
            coefs, keys = _fitted(domain, function, lows, highs, degree, plan)
            for i, q in enumerate(wanted):
                both = slice(2 * i, 2 * i + 2)
                ahead[q] = lows[both], highs[both], coefs[both], keys[both]
        heapq.heappop(heap)
        lows, highs, coefs, keys = ahead.pop(p)
        for i, q in enumerate((p, n)):
            low[q], high[q], coef[q] = lows[i], highs[i], coefs[i]
            if (high[q] > low[q]).any():
                heapq.heappush(heap, (-float(keys[i]), q))
        n += 1
    return low[:n], high[:n], coef[:n]


def _isolate_peak(
    domain: Domain, function: Underlying, low: Ints, high: Ints, coef: Floats, degree: int, plan: Build
) -> tuple[Ints, Ints, Floats]:
    """Split around the highest piece, a quarter at a time, until that piece is a single point.

    Of equally high pieces the one made last goes first, so that a flat top costs few pieces.
    """
    budget = domain.size if plan.auto_peak_max is None else plan.auto_peak_max
    tops = _tops(low, high, coef)
    for _ in range(budget):
        p = len(tops) - 1 - int(np.argmax(tops[::-1]))
        lengths = high[p] - low[p] + 1
        d = int(np.argmax(lengths))
        n = int(lengths[d])
        if n == 1:
            break
        # the smaller part goes to the side where the piece is higher
        part = n // 2 if degree == 0 else min(n - 1, n // 4 + 1)
        cut = int(high[p, d]) - part if degree == 0 or coef[p, d] >= 0 else int(low[p, d]) + part - 1
        lows, highs = np.repeat(low[p : p + 1], 2, axis=0), np.repeat(high[p : p + 1], 2, axis=0)
        highs[0, d] = cut
        lows[1, d] = cut + 1
        coefs, _ = _fitted(domain, function, lows, highs, degree, plan)
        low = np.concatenate((low, lows[1:]))
        high = np.concatenate((high, highs[1:]))
        coef = np.concatenate((coef, coefs[1:]))
        low[p], high[p], coef[p] = lows[0], highs[0], coefs[0]
        top = _tops(lows, highs, coefs)
        tops = np.concatenate((tops, top[1:]))
        tops[p] = top[0]
    if degree == 1 and domain.size <= TABLE_POINTS:
        # a plane through all points of a piece often lies closer than one through corners and centre
        table = tabulate(domain, function).ravel()
        kernels.improve_by_table(
            low, high, coef, table, domain._points_array, plan.strict_range, float(tops.max())
        )
    return low, high, coef


def _tops(low: Ints, high: Ints, coef: Floats) -> Floats:
    slopes = coef[:, :-1]
    tops: Floats = coef[:, -1] + np.maximum(slopes * low, slopes * high).sum(axis=1)
    return tops
