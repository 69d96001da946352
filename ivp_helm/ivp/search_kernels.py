"""The compiled solver: dense sweep, and branch and bound over cells and pieces.

A problem is a table with three words per function: the address of its block (kernels.py), the address
of its scope (for each of its variables the position in the decision domain), and its factor-and-weight
as a float. Everything else lives in two workspaces that the caller keeps and reuses, one of integers
and one of floats; a kernel that finds one too small says how much it needs and is called again.

Method. Variables that no function connects are separate problems (components) and solved one by one. A
component with few points is swept: all functions are added up over every point. Otherwise the
component's domain is cut into cells; one pass over all pieces gives, per function and cell, the pieces
that reach into the cell and the highest value any of them takes there; adding these up bounds every cell
from above. Cells are visited best bound first and solved by branch and bound over the pieces in them.
Search ends when no bound left beats the best point found.

Ties. Values closer than TIE (times the sum of the functions' magnitudes) count as equal; among equals
the point with the lexicographically greatest index tuple wins. That is what MOOS-IvP users see: flat
tops come out at their high end.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ivp_helm.ivp.cell_kernels import AXES, cut, scatter, scatter_flat
from ivp_helm.ivp.pointers import floats_at, int32s_at, int64s_at
from ivp_helm.ivp.sweep_kernels import sweep

Array: TypeAlias = NDArray[Any]  # of 64-bit integers or floats, whichever the docstring says

TIE = 1e-12

# Outcomes
SOLVED = 0
INFEASIBLE = 1
STOPPED = 2
NEED_INTS = 3
NEED_FLOATS = 4

# Methods
AUTO = 0
SWEEP = 1
SEARCH = 2

# Below so many points times functions adding everything up beats the search (measured, see benchmarks).
SWEPT = 1600
SWEPT_LINE = 20000  # ... of one variable, where pieces are long runs
NEVER = 1 << 62  # a limit no search reaches


@njit(cache=True, error_model="numpy")
def _later(a: Array, b: Array, n: int) -> bool:
    """Whether index tuple a comes after b."""
    for v in range(n):
        if a[v] != b[v]:
            return bool(a[v] > b[v])
    return False


@njit(cache=True, error_model="numpy")
def _visit(
    table: Array, members: Array, count: int, place: Array, n: int, scales: Array, shifts: Array,
    lists: Array, start: Array, sequence: Array, rest: Array, cursor: Array,
    box_low: Array, box_high: Array, sums: Array, tolerance: float, value: float,
    best: Array, corner: Array, limit: int,
) -> tuple[float, int]:  # fmt: skip
    """Branch and bound over the pieces within one cell, whose box is level 0 of the stack.

    Level i has fixed a piece of the first i functions of `sequence`: its box is the intersection, its
    sums the added slopes and constants. `rest[i]` bounds what the functions from i on can add. Gives up
    after `limit` pieces.
    """
    nodes = 0
    level = 0
    cursor[0] = start[sequence[0]]
    while level >= 0:
        m = sequence[level]
        if cursor[level] == start[m + 1]:
            level -= 1
            continue
        if nodes >= limit:
            break
        p = lists[cursor[level]]
        cursor[level] += 1
        nodes += 1
        k = members[m]
        block = int64s_at(table[3 * k], 8)
        pieces = block[0]
        dims = block[1]
        low = int32s_at(block[2], pieces * dims)
        high = int32s_at(block[3], pieces * dims)
        coef = floats_at(block[4], pieces * (dims + 1))
        scale = scales[k]
        here = level * n
        deeper = here + n
        meets = True
        for d in range(dims):
            v = here + place[k * n + d]
            if low[d * pieces + p] > box_high[v] or high[d * pieces + p] < box_low[v]:
                meets = False
                break
        if not meets:
            continue
        for v in range(n):
            box_low[deeper + v] = box_low[here + v]
            box_high[deeper + v] = box_high[here + v]
            sums[deeper + level + 1 + v] = sums[here + level + v]
        most = sums[here + level + n] + coef[dims * pieces + p] * scale + shifts[k]
        slopes = deeper + level + 1  # a row of sums is one longer than a row of bounds
        sums[slopes + n] = most
        for d in range(dims):
            v = place[k * n + d]
            box_low[deeper + v] = max(box_low[deeper + v], low[d * pieces + p])
            box_high[deeper + v] = min(box_high[deeper + v], high[d * pieces + p])
            sums[slopes + v] += coef[d * pieces + p] * scale
        for v in range(n):
            s = sums[slopes + v]
            most += s * (box_high[deeper + v] if s >= 0.0 else box_low[deeper + v])
        reach = most + rest[level + 1]
        if reach < value - tolerance:
            continue
        if reach <= value + tolerance and not _later(box_high[deeper : deeper + n], best, n):
            continue
        if level + 1 < count:
            level += 1
            cursor[level] = start[sequence[level]]
            continue
        # a whole combination: its best corner, flat directions at the high end
        found = sums[slopes + n]
        for v in range(n):
            s = sums[slopes + v]
            x = box_high[deeper + v]
            if s < 0.0 and -s * (x - box_low[deeper + v]) > 0.25 * tolerance:
                x = box_low[deeper + v]
            corner[v] = x
            found += s * x
        if found > value + tolerance or (found >= value - tolerance and _later(corner, best, n)):
            value = max(found, value)
            for v in range(n):
                best[v] = corner[v]
    return value, nodes


@njit(cache=True, error_model="numpy")
def _search(
    table: Array, members: Array, count: int, place: Array, n: int, points: Array,
    scales: Array, shifts: Array, tolerance: float, ints: Array, floats: Array, best: Array, limit: int,
) -> tuple[int, float, float, int, int]:  # fmt: skip
    """Branch and bound over the cells of one component.

    Returns (outcome, best value, bound, nodes, size): `size` is what a workspace lacks when the outcome
    is NEED_INTS or NEED_FLOATS.
    """
    # -- room for what is small -----------------------------------------------------------------------------
    small = 5 * n + 2 * AXES + (AXES + 4) * (count + 1) + 2 * n * (count + 1)
    if ints.size < small:
        return NEED_INTS, 0.0, 0.0, 0, small
    edge = ints[:n]
    axis = ints[n : 2 * n]
    corner = ints[2 * n : 3 * n]
    tiles = ints[3 * n : 4 * n]
    magic = ints[4 * n : 5 * n]
    at = 5 * n
    span = ints[at : at + AXES]
    at_cell = ints[at + AXES : at + 2 * AXES]
    at += 2 * AXES
    hop = ints[at : at + AXES * count]
    at += AXES * count
    offset = ints[at : at + count + 1]
    start = ints[at + count + 1 : at + 2 * count + 2]
    sequence = ints[at + 2 * count + 2 : at + 3 * count + 3]
    cursor = ints[at + 3 * count + 3 : at + 4 * count + 4]
    at += 4 * count + 4
    box_low = ints[at : at + n * (count + 1)]
    box_high = ints[at + n * (count + 1) : at + 2 * n * (count + 1)]
    at += 2 * n * (count + 1)
    few = 2 * n + (count + n + 1) + (n + 1) * (count + 1)
    if floats.size < few:
        return NEED_FLOATS, 0.0, 0.0, 0, few
    edges = floats[:n]
    mass = floats[n : 2 * n]
    rest = floats[2 * n : 3 * n + count + 1]
    sums = floats[3 * n + count + 1 : few]

    # -- cells: mean piece edges, functions with many pieces counting most ----------------------------------
    all_pieces: Any = np.int64(0)
    for v in range(n):
        edges[v] = 0.0
        mass[v] = 0.0
        tiles[v] = 0  # for now the largest number of pieces
    for m in range(count):
        k = members[m]
        block = int64s_at(table[3 * k], 8)
        own_edges = floats_at(table[3 * k] + 64, block[1])
        all_pieces += block[0]
        for d in range(block[1]):
            v = place[k * n + d]
            edges[v] += block[0] * own_edges[d]
            mass[v] += block[0]
            if block[0] > tiles[v]:
                tiles[v] = block[0]
                rest[v] = own_edges[d]
    for v in range(n):
        edges[v] /= mass[v]
        tiles[v] = max(1, int(rest[v] + 0.5))
    size = cut(n, points, edges, tiles, all_pieces, edge, magic, axis, span)
    offset[0] = 0
    for m in range(count):
        k = members[m]
        for a in range(AXES):
            hop[AXES * m + a] = 0
        for d in range(int64s_at(table[3 * k], 8)[1]):
            a = axis[place[k * n + d]]
            if a >= 0:
                hop[AXES * m + a] = 1
        step = 1
        for a in range(AXES - 1, -1, -1):
            if hop[AXES * m + a]:
                hop[AXES * m + a] = step
                step *= span[a]
        offset[m + 1] = offset[m] + step
    own_cells = offset[count]
    if floats.size < few + size + own_cells:
        return NEED_FLOATS, 0.0, 0.0, 0, few + size + own_cells
    if ints.size < at + size + own_cells + 2 * all_pieces:
        return NEED_INTS, 0.0, 0.0, 0, at + size + own_cells + 4 * all_pieces
    bounds = floats[few : few + size]
    highs = floats[few + size : few + size + own_cells]
    candidates = ints[at : at + size]
    heads = ints[at + size : at + size + own_cells]
    links = ints[at + size + own_cells :].view(np.int32)

    # -- one pass over the pieces: who reaches into which cell, and how high --------------------------------
    used: Any = np.int64(0)
    highs[:] = -np.inf
    heads[:] = -1
    for m in range(count):
        k = members[m]
        block = int64s_at(table[3 * k], 8)
        own_highs = highs[offset[m] : offset[m + 1]]
        own_heads = heads[offset[m] : offset[m + 1]]
        p0 = place[k * n]
        p1 = place[k * n + 1] if block[1] == 2 else -1
        if p1 >= 0 and axis[p0] == 2 and axis[p1] == 3:
            used = scatter_flat(
                block, edge[p0], edge[p1], magic[p0], magic[p1], hop[AXES * m + 2],
                own_highs, own_heads, links, used,
            )  # fmt: skip
        else:
            used = scatter(
                block, place[k * n : k * n + block[1]], axis, edge, magic, hop[AXES * m : AXES * m + AXES],
                own_highs, own_heads, links, used,
            )  # fmt: skip
        if used < 0:
            return NEED_INTS, 0.0, 0.0, 0, 2 * ints.size + 4 * all_pieces
        for j in range(own_highs.size):  # from here on in the units of the sum
            own_highs[j] = own_highs[j] * scales[k] + shifts[k]

    # -- bounds of all cells --------------------------------------------------------------------------------
    row = span[3]
    j = 0
    for c0 in range(span[0]):
        for c1 in range(span[1]):
            for c2 in range(span[2]):
                for c3 in range(row):
                    bounds[j + c3] = 0.0
                for m in range(count):
                    source = offset[m] + c0 * hop[AXES * m] + c1 * hop[AXES * m + 1] + c2 * hop[AXES * m + 2]
                    if hop[AXES * m + 3] == 0:
                        high = highs[source]
                        for c3 in range(row):
                            bounds[j + c3] += high
                    else:
                        for c3 in range(row):
                            bounds[j + c3] += highs[source + c3]
                j += row

    # -- visit cells, best bound first ----------------------------------------------------------------------
    left = 0
    for j in range(size):
        if bounds[j] > -np.inf:
            candidates[left] = j
            left += 1
    value = -np.inf
    nodes: Any = np.int64(0)
    lists = links[2 * used :]
    if lists.size < used:
        return NEED_INTS, 0.0, 0.0, 0, ints.size + 2 * used
    while left > 0:
        pick = -1
        top = -np.inf
        kept = 0
        for i in range(left):
            j = candidates[i]
            bound = bounds[j]
            if bound < value - tolerance:
                continue
            candidates[kept] = j
            if bound >= top:  # among equals the last, that is the lexicographically greatest cell
                top = bound
                pick = kept
            kept += 1
        left = kept
        if pick < 0:
            break
        j = candidates[pick]
        for i in range(pick, left - 1):
            candidates[i] = candidates[i + 1]
        left -= 1
        for a in range(AXES - 1, -1, -1):
            at_cell[a] = j % span[a]
            j //= span[a]
        for v in range(n):
            box_low[v] = 0
            box_high[v] = points[v] - 1
            if axis[v] >= 0:
                box_low[v] = at_cell[axis[v]] * edge[v]
                box_high[v] = min((at_cell[axis[v]] + 1) * edge[v], points[v]) - 1
            sums[v] = 0.0
        sums[n] = 0.0
        nodes += 1
        if top <= value + tolerance and not _later(box_high, best, n):
            continue
        # the pieces of each function in this cell; fewest first, for single pieces only add up
        fill = 0
        for m in range(count):
            own_cell = offset[m]
            for a in range(AXES):
                own_cell += at_cell[a] * hop[AXES * m + a]
            start[m] = fill
            link = heads[own_cell]
            while link >= 0:
                lists[fill] = links[2 * link]
                fill += 1
                link = links[2 * link + 1]
            cursor[m] = own_cell
            i = m - 1
            while i >= 0 and start[sequence[i] + 1] - start[sequence[i]] > fill - start[m]:
                sequence[i + 1] = sequence[i]
                i -= 1
            sequence[i + 1] = m
            start[m + 1] = fill
        rest[count] = 0.0
        for i in range(count - 1, -1, -1):
            rest[i] = rest[i + 1] + highs[cursor[sequence[i]]]
        value, seen = _visit(
            table, members, count, place, n, scales, shifts, lists, start, sequence, rest, cursor,
            box_low, box_high, sums, tolerance, value, best, corner, limit - nodes if limit > 0 else NEVER,
        )  # fmt: skip
        nodes += seen
        if nodes >= limit > 0:
            bound = max(value, top)
            for i in range(left):
                bound = max(bound, bounds[candidates[i]])
            if bound > value + tolerance:
                return STOPPED, value, bound, nodes, 0
    if value == -np.inf:
        return INFEASIBLE, value, value, nodes, 0
    return SOLVED, value, value, nodes, 0


@njit(cache=True, error_model="numpy")
def solve(
    table: Array, count: int, frame: Array, method: int, limit: int, ints: Array, floats: Array
) -> tuple[int, float, float, int, int, int, int, int, int, float, float, float, float]:
    """Solve a whole problem; the decision is left in the first words of `ints`.

    `frame` tells of the decision domain's variables the numbers of points and, as floats, the low ends and
    the steps. Returns (outcome, value, bound, nodes, size) as _search does, then indexes and native values
    of the first four variables, which spares most callers a look into `ints`.
    """
    wide = frame.size // 3
    points = frame[:wide]
    lows = frame.view(np.float64)[wide : 2 * wide]
    steps = frame.view(np.float64)[2 * wide :]
    small = wide * (count + 6) + count
    if ints.size < small:
        return NEED_INTS, 0.0, 0.0, 0, small, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0
    if floats.size < 2 * count:
        return NEED_FLOATS, 0.0, 0.0, 0, 2 * count, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0
    decision = ints[:wide]
    group = ints[wide : 2 * wide]
    local = ints[2 * wide : 3 * wide]
    own_points = ints[3 * wide : 4 * wide]
    best = ints[4 * wide : 5 * wide]
    spare = ints[5 * wide : 6 * wide]
    members = ints[6 * wide : 6 * wide + count]
    place = ints[6 * wide + count : small]
    scales = floats[:count]
    shifts = floats[count : 2 * count]
    more_ints = ints[small:]
    more_floats = floats[2 * count :]

    weights = table.view(np.float64)
    magnitude = 0.0
    for k in range(count):
        extremes = floats_at(table[3 * k] + 48, 2)
        least = extremes[0]
        most = extremes[1]
        scale = weights[3 * k + 2]
        shift = 0.0
        if most - least > 100.0:  # such a function is stretched to 0..100, others keep level and range
            scale *= 100.0 / (most - least)
            shift = -least * scale
            most -= least
            least = 0.0
        scales[k] = scale
        shifts[k] = shift
        magnitude += scale * max(abs(least), abs(most))
    tolerance = TIE * magnitude

    # -- components: variables connected by functions get the same label ------------------------------------
    for v in range(wide):
        group[v] = -1
        decision[v] = points[v] - 1  # where nobody cares: the high end
    for k in range(count):
        dims = int64s_at(table[3 * k], 8)[1]
        scope = int64s_at(table[3 * k + 1], dims)
        label = scope[0]
        for d in range(dims):
            g = group[scope[d]]
            if g >= 0 and g < label:
                label = g
            elif g < 0 and scope[d] < label:
                label = scope[d]
        for d in range(dims):
            g = group[scope[d]]
            if g >= 0 and g != label:
                for v in range(wide):
                    if group[v] == g:
                        group[v] = label
            group[scope[d]] = label

    # -- one after the other --------------------------------------------------------------------------------
    value = 0.0
    bound = 0.0
    nodes = 0
    outcome = SOLVED
    for label in range(wide):
        if group[label] != label:
            continue
        n: Any = np.int64(0)  # not plain 0, whose type would make numba compile everything below twice
        size = 1.0
        for v in range(label, wide):
            if group[v] == label:
                local[v] = n
                own_points[n] = points[v]
                best[n] = -1
                size *= points[v]
                n += 1
        m: Any = np.int64(0)
        for k in range(count):
            block = int64s_at(table[3 * k], 8)
            scope = int64s_at(table[3 * k + 1], block[1])
            if group[scope[0]] == label:
                members[m] = k
                m += 1
                for d in range(block[1]):
                    place[k * n + d] = local[scope[d]]
        if method == SWEEP or (method == AUTO and size * m <= (SWEPT_LINE if n == 1 else SWEPT)):
            if more_floats.size < 2 * size:
                need = int(2 * size) + 2 * count
                return NEED_FLOATS, 0.0, 0.0, 0, need, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0
            top = sweep(
                table, members, m, place, n, own_points, scales, shifts, tolerance, more_floats, best,
                spare, more_ints,
            )  # fmt: skip
            nodes += int(size)
            above = top
            if top == -np.inf:
                return INFEASIBLE, top, top, nodes, 0, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0
        else:
            result, top, above, seen, lacking = _search(
                table, members, m, place, n, own_points[:n], scales, shifts, tolerance,
                more_ints, more_floats, best, limit,
            )  # fmt: skip
            if result in (NEED_INTS, NEED_FLOATS):
                return result, 0.0, 0.0, 0, lacking + small + 2 * count, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0
            nodes += seen
            if result == INFEASIBLE:
                return INFEASIBLE, top, above, nodes, 0, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0
            if result == STOPPED:
                outcome = STOPPED
        value += top
        bound += above
        for v in range(label, wide):
            if group[v] == label:
                decision[v] = best[local[v]]
    v1 = min(1, wide - 1)
    v2 = min(2, wide - 1)
    v3 = min(3, wide - 1)
    return (
        outcome, value, bound, nodes, 0, decision[0], decision[v1], decision[v2], decision[v3],
        lows[0] + steps[0] * decision[0], lows[v1] + steps[v1] * decision[v1],
        lows[v2] + steps[v2] * decision[v2], lows[v3] + steps[v3] * decision[v3],
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def solve_at(
    table: int, count: int, frame: int, wide: int, method: int, limit: int,
    ints: int, ints_size: int, floats: int, floats_size: int,
) -> tuple[int, float, float, int, int, int, int, int, int, float, float, float, float]:  # fmt: skip
    """`solve` with addresses and sizes for arrays: passing a number costs half of passing an array."""
    return solve(
        int64s_at(table, 3 * count), count, int64s_at(frame, 3 * wide), method, limit,
        int64s_at(ints, ints_size), floats_at(floats, floats_size),
    )  # fmt: skip
