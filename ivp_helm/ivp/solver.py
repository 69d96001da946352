"""The problem of a helm: the point of the decision domain where the weighted functions add up highest.

    maximise  sum_k  w_k * f'_k(p)   over all points p of the domain

f'_k is f_k, stretched to 0..100 if its range is above 100. Functions with a weight of 0 or less are
left out, and a point is feasible only if every remaining function covers it. `solve` is exact and quick;
`solve_exhaustive` is the plain version it is measured and tested against. Source: ivp_math.md 8.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Sequence
from enum import Enum
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ivp_helm.ivp import search_kernels as kernels
from ivp_helm.ivp.domain import Domain
from ivp_helm.ivp.errors import IvPError
from ivp_helm.ivp.function import IvPFunction

TIE: Final = kernels.TIE
# solve_exhaustive refuses domains with more points than this (a table takes 8 bytes a point).
MAX_EXHAUSTIVE_POINTS: Final = 50_000_000

Method = Literal["auto", "sweep", "search"]
_METHODS: Final = {"auto": kernels.AUTO, "sweep": kernels.SWEEP, "search": kernels.SEARCH}


class Status(Enum):
    """How a solve ended."""

    OPTIMAL = "optimal"  # no point is better
    STOPPED = "stopped"  # the node budget ran out; the decision, if any, is the best found so far
    INFEASIBLE = "infeasible"  # no point is covered by every function: no decision
    EMPTY = "empty"  # no function with a weight above 0: no decision


class Solution(NamedTuple):
    """The answer to a problem. Without a decision `decision` and `indexes` are empty and `value` is -inf."""

    domain: Domain
    decision: tuple[float, ...]  # one native value per domain variable
    indexes: tuple[int, ...]  # the same as indexes
    value: float  # weighted sum at the decision
    bound: float  # no point scores above this
    nodes: int  # pieces and cells examined, or points swept
    status: Status

    @property
    def optimal(self) -> bool:
        """Whether the decision is known to be the best there is."""
        return self.status is Status.OPTIMAL

    @property
    def found(self) -> bool:
        """Whether there is a decision."""
        return bool(self.decision)

    def as_dict(self) -> dict[str, float]:
        """Variable name to native value; empty without a decision."""
        return dict(zip(self.domain.names, self.decision, strict=False))


# Reading a member of an Enum takes as long as adding up ten pieces.
_OPTIMAL: Final = Status.OPTIMAL
_STOPPED: Final = Status.STOPPED
_INFEASIBLE: Final = Status.INFEASIBLE


class _Workspace:
    """Memory a solve needs, kept from call to call; `memory` is what the kernel wants to know of it."""

    __slots__ = ("address", "bytes", "floats", "ints", "memory", "room", "table")
    room: int  # functions the table holds
    table: NDArray[np.int64]
    address: int  # of the table
    bytes: memoryview  # of the table
    ints: NDArray[np.int64]
    floats: NDArray[np.float64]
    memory: tuple[int, int, int, int]  # addresses and sizes of ints and floats

    def __init__(self) -> None:
        self.make_room(16)
        self.ints = np.zeros(1 << 14, np.int64)
        self.floats = np.zeros(1 << 14, np.float64)
        self._measure()

    def make_room(self, functions: int) -> None:
        self.room = 2 * functions
        self.table = np.zeros(3 * self.room, np.int64)
        self.address = self.table.ctypes.data
        self.bytes = memoryview(self.table)  # type: ignore[arg-type]

    def grow(self, outcome: int, size: int) -> None:
        if outcome == kernels.NEED_INTS:
            self.ints = np.zeros(size + size // 2, np.int64)
        else:
            self.floats = np.zeros(size + size // 2, np.float64)
        self._measure()

    def _measure(self) -> None:
        self.memory = (self.ints.ctypes.data, self.ints.size, self.floats.ctypes.data, self.floats.size)


# A solve of a small problem takes two microseconds, so looking up names shows.
_solve_at: Final = kernels.solve_at
_NEED: Final = kernels.STOPPED
_LOWEST: Final = -math.inf
_new_tuple: Final = tuple.__new__
# Spare workspaces; taking one out of the list is atomic, so two threads never share one.
_spare: list[_Workspace] = []
_packers: Final = [struct.Struct("=" + "qqd" * k) for k in range(33)]


def solve(
    domain: Domain,
    functions: Iterable[IvPFunction],
    *,
    method: Method = "auto",
    max_nodes: int = 0,
) -> Solution:
    """Find the best point of `domain` for the weighted sum of `functions`, exactly.

    method      "auto" chooses by the size of the problem between "sweep" (all points) and "search" (branch
                and bound); the answer is the same
    max_nodes   give up searching after about so many nodes (0: never) with status STOPPED

    Ties: values closer than 1e-12 of the functions' added magnitudes count as equal, and of equal points
    the one with the greatest indexes wins, earlier variables deciding first; a variable no function is
    over comes out at its high end. The functions are never changed.

    Raises `IvPError` for a function over a variable that is not in the domain, or differs from it there.
    Workspaces are reused from call to call. (Land and Doig, Econometrica 28(3), 1960, for the principle.)
    """
    if not isinstance(functions, (list, tuple)):
        functions = list(functions)  # addresses are only good while somebody holds the functions
    how = _METHODS.get(method)
    if how is None:
        raise IvPError(f"no solving method {method!r}; there are {', '.join(_METHODS)}")
    scopes = domain._scopes
    held: list[object] = []
    words: list[Any] = []
    count = 0
    for f in functions:
        weight = f.weight
        if weight > 0:
            scope = scopes.get(f.domain)
            if scope is None:
                scope = _scope(domain, f)
                held.append(scope)
            if not f._address:
                f._without_overlaps()
            words += (f._address, scope[1], weight)
            count += 1
    if not count:
        return Solution(domain, (), (), _LOWEST, _LOWEST, 0, Status.EMPTY)
    workspace = _spare.pop() if _spare else _Workspace()
    if count > workspace.room:
        workspace.make_room(count)
    packer = _packers[count] if count < 33 else struct.Struct("=" + "qqd" * count)
    packer.pack_into(workspace.bytes, 0, *words)
    frame, dims = domain._frame_address, domain._width
    while True:
        answer = _solve_at(workspace.address, count, frame, dims, how, max_nodes, *workspace.memory)
        outcome = answer[0]
        if outcome <= _NEED:
            break
        workspace.grow(outcome, answer[4])
    if dims > 4:
        indexes: tuple[Any, ...] = tuple(workspace.ints[:dims].tolist())
        decision: tuple[Any, ...] = domain.value_of(indexes)
    else:
        indexes = answer[5 : 5 + dims]
        decision = answer[9 : 9 + dims]
    _spare.append(workspace)
    value = answer[1]
    if value == _LOWEST:
        status = _INFEASIBLE if outcome == kernels.INFEASIBLE else _STOPPED
        return Solution(domain, (), (), _LOWEST, answer[2], answer[3], status)
    status = _OPTIMAL if outcome == 0 else _STOPPED
    fields = (domain, decision, indexes, value, answer[2], answer[3], status)
    return _new_tuple(Solution, fields)  # what Solution(...) does, in a third of the time


def _scope(domain: Domain, f: IvPFunction) -> tuple[NDArray[np.int64], int]:
    try:
        domain.scope_of(f.domain)
    except IvPError as error:
        raise IvPError(f"function {f.context!r}: {error}") from None
    return domain._scopes[f.domain]


def solve_exhaustive(domain: Domain, functions: Iterable[IvPFunction]) -> Solution:
    """The same problem and the same tie rule as `solve`, by adding up tables of every function.

    Plain numpy, for checking: at most 50 million points.
    """
    taken = [f for f in functions if f.weight > 0]
    if not taken:
        return Solution(domain, (), (), -np.inf, -np.inf, 0, Status.EMPTY)
    if domain.size > MAX_EXHAUSTIVE_POINTS:
        raise IvPError(f"domain {domain}: {domain.size} points are too many for an exhaustive solve")
    total = np.zeros(domain.points)
    magnitude = 0.0
    for f in taken:
        scope = _scope(domain, f)[0]
        least, most = f.minimum, f.maximum
        values = f.table()
        weight = f.weight
        if most - least > 100.0:
            values = (values - least) * (100.0 / (most - least))
            least, most = 0.0, 100.0
        magnitude += weight * max(abs(least), abs(most))
        # line the function's axes up with the domain's, length 1 where it lacks a variable
        values = np.transpose(values, np.argsort(scope))
        shape = [domain.points[v] if v in scope else 1 for v in range(len(domain))]
        total += weight * values.reshape(shape)
    total[np.isnan(total)] = -np.inf
    best = float(total.max())
    if best == -np.inf:
        return Solution(domain, (), (), -np.inf, -np.inf, domain.size, Status.INFEASIBLE)
    flat = np.flatnonzero(total.ravel() >= best - TIE * magnitude)[-1]
    indexes = tuple(int(i) for i in np.unravel_index(flat, domain.points))
    return Solution(
        domain, domain.value_of(indexes), indexes, float(total[indexes]), best, domain.size, Status.OPTIMAL
    )


def decision_domain(domain: Domain, functions: Sequence[IvPFunction]) -> Domain:
    """The variables a helm decides: all of `domain` if each occurs in some function, else those that do.

    In the latter case they come in the order of first appearance. Raises `IvPError` for a function over
    a variable that is not in `domain`, and when there are no functions. Source: ivp_math.md 8.2.
    """
    if not functions:
        raise IvPError("no functions, so nothing to decide")
    whole = False
    for f in functions:
        if f.domain is domain:
            whole = True
        elif f.domain not in domain._scopes:
            _scope(domain, f)
    if whole:
        return domain
    seen: dict[str, None] = {}
    for f in functions:
        seen.update(dict.fromkeys(f.domain.names))
    if len(seen) == len(domain):
        return domain
    return domain.subdomain(tuple(seen))
