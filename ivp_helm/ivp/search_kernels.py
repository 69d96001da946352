"""The compiled solver: dense sweep, and branch and bound over cells and pieces.

A problem is a table with three words per function: the address of its block (kernels.py), the address
of its scope (for each of its variables the position in the decision domain), and its factor-and-weight
as a float. Everything else lives in two workspaces that the caller keeps and reuses, one of integers
and one of floats; a kernel that finds one too small says how much it needs and is called again.

Method. Variables that no function connects are separate problems (components) and solved one by one. A
component with few points is swept: all functions are added up over every point. Otherwise the
component's domain is cut into cells with power-of-two edges; one pass over all pieces gives, per
function and cell, the pieces that reach into the cell and the highest value any of them takes there;
adding these up bounds every cell from above. Cells are visited best bound first, and solved exactly: by
sweeping the cell, or by branch and bound over the pieces in it. Search ends when no bound left beats
the best point found.

Ties. Values closer than TIE (times the sum of the functions' magnitudes) count as equal; among equals
the point with the lexicographically greatest index tuple wins. That is what MOOS-IvP users see: flat
tops come out at their high end.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ivp_helm.ivp.pointers import floats_at, int32s_at, int64s_at

Array: TypeAlias = NDArray[Any]  # of 64-bit integers or floats, whichever the docstring says

TIE = 1e-12
COVERS = 1  # as in kernels.py; repeated so that this module's compile cache depends on nothing else

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

GRIDDED = 4  # at most so many variables of a component are cut into cells


@njit(cache=True)
def _later(a: Array, b: Array, n: int) -> bool:
    """Whether index tuple a comes after b."""
    for v in range(n):
        if a[v] != b[v]:
            return bool(a[v] > b[v])
    return False


@njit(cache=True)
def _sweep(
    table: Array,
    members: Array,
    count: int,
    place: Array,
    n: int,
    points: Array,
    scales: Array,
    shifts: Array,
    tolerance: float,
    floats: Array,
    best: Array,
) -> tuple[float, bool]:
    """Add all member functions up over every point of the component; returns (best value, feasible).

    `place[k * n + d]` is the component variable of function k's variable d; `floats` holds two tables.
    """
    total = 1
    for v in range(n):
        total *= points[v]
    totals = floats[:total]
    scratch = floats[total : 2 * total]
    stride = np.empty(n, np.int64)
    step = 1
    for v in range(n - 1, -1, -1):
        stride[v] = step
        step *= points[v]
    at = np.empty(n, np.int64)
    totals[:] = 0.0
    for m in range(count):
        k = members[m]
        block = int64s_at(table[3 * k], 8)
        pieces = block[0]
        dims = block[1]
        low = int32s_at(block[2], pieces * dims)
        high = int32s_at(block[3], pieces * dims)
        coef = floats_at(block[4], pieces * (dims + 1))
        scale = scales[k]
        whole = dims == n and (block[5] & COVERS) != 0
        # its own table: in the total itself if it spans the component and has no gap, else apart
        if not whole:
            own = 1
            for d in range(dims):
                own *= points[place[k * n + d]]
            scratch[:own] = -np.inf
        last = dims - 1
        inner = place[k * n + last]
        if not whole:
            step = 1
            for d in range(dims - 1, -1, -1):
                at[d] = step
                step *= points[place[k * n + d]]
        for p in range(pieces):
            slope = coef[last * pieces + p] * scale
            first = low[last * pieces + p]
            end = high[last * pieces + p] + 1
            constant = coef[dims * pieces + p] * scale + shifts[k]
            if dims == 1:
                if whole:
                    for j in range(first, end):
                        totals[j] += constant + slope * j
                else:
                    for j in range(first, end):
                        scratch[j] = constant + slope * j
                continue
            if dims == 2:
                s0 = coef[p] * scale
                if whole:
                    jump = stride[place[k * n]]
                    hop = stride[inner]
                    for i in range(low[p], high[p] + 1):
                        value = constant + s0 * i
                        start = i * jump
                        if hop == 1:
                            for j in range(first, end):
                                totals[start + j] += value + slope * j
                        else:
                            for j in range(first, end):
                                totals[start + j * hop] += value + slope * j
                else:
                    jump = at[0]
                    for i in range(low[p], high[p] + 1):
                        value = constant + s0 * i
                        for j in range(first, end):
                            scratch[i * jump + j] = value + slope * j
                continue
            _paint(
                totals if whole else scratch, whole, p, pieces, dims, low, high, coef, scale, constant,
                place[k * n : k * n + dims], stride if whole else at,
            )  # fmt: skip
        if whole:
            continue
        # spread its own table over the variables it lacks
        _spread(totals, scratch, n, points, place[k * n : k * n + dims], at, dims)
    top = -np.inf
    for j in range(total):
        if totals[j] > top:
            top = totals[j]
    if top == -np.inf:
        return top, False
    j = total - 1
    while totals[j] < top - tolerance:
        j -= 1
    for v in range(n):
        best[v] = (j // stride[v]) % points[v]
    return totals[j], True


@njit(cache=True)
def _paint(
    target: Array,
    add: bool,
    p: int,
    pieces: int,
    dims: int,
    low: Array,
    high: Array,
    coef: Array,
    scale: float,
    constant: float,
    place: Array,
    stride: Array,
) -> None:
    """Write (or add) one piece; `stride` counts per component variable if adding, else per own variable."""
    at = np.empty(dims, np.int64)
    for d in range(dims):
        at[d] = low[d * pieces + p]
    last = dims - 1
    slope = coef[last * pieces + p] * scale
    first = low[last * pieces + p]
    end = high[last * pieces + p] + 1
    hop = stride[place[last]] if add else stride[last]
    while True:
        start = 0
        value = constant
        for d in range(last):
            start += at[d] * (stride[place[d]] if add else stride[d])
            value += coef[d * pieces + p] * scale * at[d]
        if add:
            if hop == 1:
                for j in range(first, end):
                    target[start + j] += value + slope * j
            else:
                for j in range(first, end):
                    target[start + j * hop] += value + slope * j
        else:
            for j in range(first, end):
                target[start + j * hop] = value + slope * j
        d = last - 1
        while d >= 0:
            at[d] += 1
            if at[d] <= high[d * pieces + p]:
                break
            at[d] = low[d * pieces + p]
            d -= 1
        if d < 0:
            return


@njit(cache=True)
def _spread(
    totals: Array, part: Array, n: int, points: Array, place: Array, stride: Array, dims: int
) -> None:
    """totals[point] += part[point restricted to the part's variables], for every point."""
    hops = np.zeros(n, np.int64)
    for d in range(dims):
        hops[place[d]] = stride[d]
    at = np.zeros(n, np.int64)
    inner = points[n - 1]
    hop = hops[n - 1]
    start = 0
    source = 0
    while True:
        if hop == 0:
            value = part[source]
            for j in range(inner):
                totals[start + j] += value
        elif hop == 1:
            for j in range(inner):
                totals[start + j] += part[source + j]
        else:
            for j in range(inner):
                totals[start + j] += part[source + j * hop]
        start += inner
        v = n - 2
        while v >= 0:
            at[v] += 1
            source += hops[v]
            if at[v] < points[v]:
                break
            source -= at[v] * hops[v]
            at[v] = 0
            v -= 1
        if v < 0:
            return


@njit(cache=True)
def _highest(slope: float, low: int, high: int, cell: int, shift: int) -> float:
    """The most that slope * index reaches inside both [low, high] and one cell."""
    if slope >= 0.0:
        end = ((cell + 1) << shift) - 1
        return slope * (high if high < end else end)
    start = cell << shift
    return slope * (low if low > start else start)


@njit(cache=True)
def _search(
    table: Array,
    members: Array,
    count: int,
    place: Array,
    n: int,
    points: Array,
    scales: Array,
    shifts: Array,
    tolerance: float,
    ints: Array,
    floats: Array,
    best: Array,
    limit: int,
) -> tuple[int, float, float, int, int]:
    """Branch and bound over the cells of one component.

    Returns (outcome, best value, bound, nodes, size): `size` is what a workspace lacks when the outcome
    is NEED_INTS or NEED_FLOATS.
    """
    # -- cut the component into cells ---------------------------------------------------------------
    weighted = np.zeros(n)  # mean piece edge per variable, functions with many pieces counting most
    mass = np.zeros(n)
    all_pieces = 0
    for m in range(count):
        k = members[m]
        block = int64s_at(table[3 * k], 8)
        pieces = block[0]
        dims = block[1]
        edges = floats_at(table[3 * k] + 64, dims)
        all_pieces += pieces
        for d in range(dims):
            weighted[place[k * n + d]] += pieces * edges[d]
            mass[place[k * n + d]] += pieces
    for v in range(n):
        weighted[v] /= max(mass[v], 1.0)
    shift = np.empty(n, np.int64)
    cells = np.ones(n, np.int64)
    for v in range(n):
        shift[v] = 0
        while (1 << shift[v]) < points[v]:
            shift[v] += 1
    target = min(max(all_pieces, 64), 4096)
    gridded = np.empty(GRIDDED, np.int64)
    grids = 0
    size = 1
    while True:
        pick = -1
        ratio = 1.0
        for v in range(n):
            r = (1 << shift[v]) / weighted[v]
            if shift[v] > 0 and r > ratio:
                fresh = cells[v] == 1
                if not (fresh and grids == GRIDDED):
                    ratio = r
                    pick = v
        if pick < 0:
            break
        now = ((points[pick] - 1) >> (shift[pick] - 1)) + 1
        if size // cells[pick] * now > target:
            break
        if cells[pick] == 1 and now > 1:
            gridded[grids] = pick
            grids += 1
        size = size // cells[pick] * now
        cells[pick] = now
        shift[pick] -= 1
    # order the gridded variables as in the domain, and pad with variables of one cell
    for i in range(grids):
        for j in range(i + 1, grids):
            if gridded[j] < gridded[i]:
                gridded[i], gridded[j] = gridded[j], gridded[i]
    span = np.ones(GRIDDED, np.int64)  # cells along each grid axis; axes are right-aligned
    axis = np.full(n, -1, np.int64)  # grid axis of a component variable
    for i in range(grids):
        span[GRIDDED - grids + i] = cells[gridded[i]]
        axis[gridded[i]] = GRIDDED - grids + i
    axis_shift = np.full(GRIDDED, 40, np.int64)
    for v in range(n):
        if axis[v] >= 0:
            axis_shift[axis[v]] = shift[v]

    # -- room ----------------------------------------------------------------------------------------
    hop = np.zeros((count, GRIDDED), np.int64)  # a function's own cells: step along each axis
    offset = np.empty(count + 1, np.int64)
    offset[0] = 0
    for m in range(count):
        k = members[m]
        dims = int64s_at(table[3 * k], 8)[1]
        present = np.zeros(GRIDDED, np.int64)
        for d in range(dims):
            a = axis[place[k * n + d]]
            if a >= 0:
                present[a] = 1
        step = 1
        for a in range(GRIDDED - 1, -1, -1):
            if present[a]:
                hop[m, a] = step
                step *= span[a]
        offset[m + 1] = offset[m] + step
    own_cells = offset[count]
    if floats.size < size + own_cells + 64:
        return NEED_FLOATS, 0.0, 0.0, 0, size + own_cells + 64
    head = own_cells
    order = head + size  # the candidate cells
    nodes_at = order
    if ints.size < nodes_at + 2 * (all_pieces + 64):
        return NEED_INTS, 0.0, 0.0, 0, nodes_at + 8 * (all_pieces + 64)
    bounds = floats[:size]
    highs = floats[size : size + own_cells]
    highs[:] = -np.inf
    heads = ints[:own_cells]
    heads[:] = -1
    candidates = ints[own_cells : own_cells + size]
    links = ints[nodes_at:]
    capacity = links.size - 1
    used = 0

    # -- one pass over the pieces: who reaches into which cell, and how high ----------------------------
    s0, s1, s2, s3 = axis_shift[0], axis_shift[1], axis_shift[2], axis_shift[3]
    own = np.empty(GRIDDED, np.int64)
    for m in range(count):
        k = members[m]
        block = int64s_at(table[3 * k], 8)
        pieces = block[0]
        dims = block[1]
        low = int32s_at(block[2], pieces * dims)
        high = int32s_at(block[3], pieces * dims)
        coef = floats_at(block[4], pieces * (dims + 1))
        own[:] = -1
        for d in range(dims):
            a = axis[place[k * n + d]]
            if a >= 0:
                own[a] = d
        h0, h1, h2, h3 = hop[m, 0], hop[m, 1], hop[m, 2], hop[m, 3]
        base_cell = offset[m]
        for p in range(pieces):
            base = coef[dims * pieces + p]
            for d in range(dims):
                if axis[place[k * n + d]] < 0:
                    w = coef[d * pieces + p]
                    base += w * (high[d * pieces + p] if w >= 0.0 else low[d * pieces + p])
            l0 = l1 = l2 = l3 = 0
            u0 = u1 = u2 = u3 = 0
            w0 = w1 = w2 = w3 = 0.0
            if own[0] >= 0:
                l0, u0, w0 = low[own[0] * pieces + p], high[own[0] * pieces + p], coef[own[0] * pieces + p]
            if own[1] >= 0:
                l1, u1, w1 = low[own[1] * pieces + p], high[own[1] * pieces + p], coef[own[1] * pieces + p]
            if own[2] >= 0:
                l2, u2, w2 = low[own[2] * pieces + p], high[own[2] * pieces + p], coef[own[2] * pieces + p]
            if own[3] >= 0:
                l3, u3, w3 = low[own[3] * pieces + p], high[own[3] * pieces + p], coef[own[3] * pieces + p]
            for c0 in range(l0 >> s0, (u0 >> s0) + 1):
                v0 = base + _highest(w0, l0, u0, c0, s0)
                for c1 in range(l1 >> s1, (u1 >> s1) + 1):
                    v1 = v0 + _highest(w1, l1, u1, c1, s1)
                    for c2 in range(l2 >> s2, (u2 >> s2) + 1):
                        v2 = v1 + _highest(w2, l2, u2, c2, s2)
                        cell = base_cell + c0 * h0 + c1 * h1 + c2 * h2
                        for c3 in range(l3 >> s3, (u3 >> s3) + 1):
                            v3 = v2 + _highest(w3, l3, u3, c3, s3)
                            j = cell + c3 * h3
                            if v3 > highs[j]:
                                highs[j] = v3
                            if 2 * used >= capacity:
                                return NEED_INTS, 0.0, 0.0, 0, 2 * ints.size + 1024
                            links[2 * used] = p
                            links[2 * used + 1] = heads[j]
                            heads[j] = used
                            used += 1
        # from here on the highs are in the units of the sum
        for j in range(offset[m], offset[m + 1]):
            highs[j] = highs[j] * scales[k] + shifts[k]

    # -- bounds of all cells ---------------------------------------------------------------------------
    row = span[3]
    j = 0
    for c0 in range(span[0]):
        for c1 in range(span[1]):
            for c2 in range(span[2]):
                for c3 in range(row):
                    bounds[j + c3] = 0.0
                for m in range(count):
                    source = offset[m] + c0 * hop[m, 0] + c1 * hop[m, 1] + c2 * hop[m, 2]
                    if hop[m, 3] == 0:
                        value = highs[source]
                        for c3 in range(row):
                            bounds[j + c3] += value
                    else:
                        for c3 in range(row):
                            bounds[j + c3] += highs[source + c3]
                j += row

    # -- visit cells, best bound first ------------------------------------------------------------------
    left = 0
    for j in range(size):
        if bounds[j] > -np.inf:
            candidates[left] = j
            left += 1
    value = -np.inf
    nodes = 0
    # scratch for one cell: lists of pieces, and the branch-and-bound stack
    room = used + 64
    lists = np.empty(room, np.int64)
    start = np.empty(count + 1, np.int64)
    cell_low = np.empty(n, np.int64)
    cell_high = np.empty(n, np.int64)
    rest = np.empty(count + 1)
    sequence = np.empty(count, np.int64)
    cursor = np.empty(count + 1, np.int64)
    box_low = np.empty((count + 1, n), np.int64)
    box_high = np.empty((count + 1, n), np.int64)
    sums = np.empty((count + 1, n + 1))
    corner = np.empty(n, np.int64)
    at_cell = np.empty(GRIDDED, np.int64)
    while left > 0:
        pick = -1
        top = -np.inf
        kept = 0
        for i in range(left):
            j = candidates[i]
            b = bounds[j]
            if b < value - tolerance:
                continue
            candidates[kept] = j
            if b >= top:  # among equals the last, that is the lexicographically greatest cell
                top = b
                pick = kept
            kept += 1
        left = kept
        if pick < 0:
            break
        j = candidates[pick]
        for i in range(pick, left - 1):
            candidates[i] = candidates[i + 1]
        left -= 1
        for a in range(GRIDDED - 1, -1, -1):
            at_cell[a] = j % span[a]
            j //= span[a]
        for v in range(n):
            if axis[v] >= 0:
                cell_low[v] = at_cell[axis[v]] << shift[v]
                cell_high[v] = min(((at_cell[axis[v]] + 1) << shift[v]), points[v]) - 1
            else:
                cell_low[v] = 0
                cell_high[v] = points[v] - 1
        if top <= value + tolerance and not _later(cell_high, best, n):
            continue
        nodes += 1
        # the pieces of each function in this cell
        for m in range(count):
            own_cell = offset[m]
            for a in range(GRIDDED):
                own_cell += at_cell[a] * hop[m, a]
            cursor[m] = own_cell
            sequence[m] = m
        fill = 0
        for m in range(count):
            start[m] = fill
            link = heads[cursor[m]]
            while link >= 0:
                lists[fill] = links[2 * link]
                fill += 1
                link = links[2 * link + 1]
        start[count] = fill
        # fewest pieces first: single pieces only add up, and the box shrinks early
        for i in range(1, count):
            m = sequence[i]
            length = start[m + 1] - start[m]
            h = i - 1
            while h >= 0 and start[sequence[h] + 1] - start[sequence[h]] > length:
                sequence[h + 1] = sequence[h]
                h -= 1
            sequence[h + 1] = m
        rest[count] = 0.0
        for i in range(count - 1, -1, -1):
            rest[i] = rest[i + 1] + highs[cursor[sequence[i]]]
        for v in range(n):
            box_low[0, v] = cell_low[v]
            box_high[0, v] = cell_high[v]
            sums[0, v] = 0.0
        sums[0, n] = 0.0
        level = 0
        cursor[0] = start[sequence[0]]
        while level >= 0:
            m = sequence[level]
            if cursor[level] == start[m + 1]:
                level -= 1
                continue
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
            deeper = level + 1
            for v in range(n):
                box_low[deeper, v] = box_low[level, v]
                box_high[deeper, v] = box_high[level, v]
                sums[deeper, v] = sums[level, v]
            sums[deeper, n] = sums[level, n] + coef[dims * pieces + p] * scale + shifts[k]
            meets = True
            for d in range(dims):
                v = place[k * n + d]
                a = low[d * pieces + p]
                b = high[d * pieces + p]
                if a > box_low[deeper, v]:
                    box_low[deeper, v] = a
                if b < box_high[deeper, v]:
                    box_high[deeper, v] = b
                if box_low[deeper, v] > box_high[deeper, v]:
                    meets = False
                    break
                sums[deeper, v] += coef[d * pieces + p] * scale
            if not meets:
                continue
            most = sums[deeper, n]
            for v in range(n):
                s = sums[deeper, v]
                most += s * (box_high[deeper, v] if s >= 0.0 else box_low[deeper, v])
            reach = most + rest[deeper]
            if reach < value - tolerance:
                continue
            if reach <= value + tolerance and not _later(box_high[deeper], best, n):
                continue
            if deeper < count:
                level = deeper
                cursor[level] = start[sequence[level]]
                continue
            # a whole combination: its best corner, flat directions at the high end
            found = sums[deeper, n]
            for v in range(n):
                s = sums[deeper, v]
                x = box_high[deeper, v]
                if s < 0.0 and -s * (x - box_low[deeper, v]) > 0.25 * tolerance:
                    x = box_low[deeper, v]
                corner[v] = x
                found += s * x
            if found > value + tolerance or (found >= value - tolerance and _later(corner, best, n)):
                value = max(found, value)
                for v in range(n):
                    best[v] = corner[v]
        if nodes > limit > 0:
            bound = value
            for i in range(left):
                if bounds[candidates[i]] > bound:
                    bound = bounds[candidates[i]]
            return STOPPED, value, bound, nodes, 0
    if value == -np.inf:
        return INFEASIBLE, value, value, nodes, 0
    return SOLVED, value, value, nodes, 0


@njit(cache=True)
def solve(
    table: Array, count: int, points: Array, method: int, limit: int, ints: Array, floats: Array
) -> tuple[int, float, float, int, int]:
    """Solve a whole problem; the decision is left in the first words of `ints`.

    Returns (outcome, value, bound, nodes, size): see _search. `points` are those of the decision domain.
    """
    wide = points.size
    weights = table.view(np.float64)
    scales = np.empty(count)
    shifts = np.empty(count)
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
        magnitude += abs(scale) * max(abs(least), abs(most))
    tolerance = TIE * magnitude
    # components: variables connected by functions
    group = np.full(wide, -1, np.int64)
    for k in range(count):
        dims = int64s_at(table[3 * k], 8)[1]
        scope = int64s_at(table[3 * k + 1], dims)
        label = -1
        for d in range(dims):
            g = group[scope[d]]
            if g >= 0 and (label < 0 or g < label):
                label = g
        if label < 0:
            label = scope[0]
        for d in range(dims):
            g = group[scope[d]]
            if g >= 0 and g != label:
                for v in range(wide):
                    if group[v] == g:
                        group[v] = label
            group[scope[d]] = label
    head = ints[:wide]
    value = 0.0
    bound = 0.0
    nodes = 0
    outcome = SOLVED
    members = np.empty(count, np.int64)
    place = np.empty(count * wide, np.int64)
    local = np.empty(wide, np.int64)
    component_points = np.empty(wide, np.int64)
    best = np.empty(wide, np.int64)
    for v in range(wide):
        if group[v] < 0:
            head[v] = points[v] - 1  # nobody cares: the high end
    for label in range(wide):
        n = 0
        size = 1.0
        for v in range(wide):
            if group[v] == label:
                local[v] = n
                component_points[n] = points[v]
                size *= points[v]
                n += 1
        if n == 0:
            continue
        m = 0
        pieces = 0
        for k in range(count):
            block = int64s_at(table[3 * k], 8)
            scope = int64s_at(table[3 * k + 1], block[1])
            if group[scope[0]] == label:
                members[m] = k
                m += 1
                pieces += block[0]
                for d in range(block[1]):
                    place[k * n + d] = local[scope[d]]
        sweep = method == SWEEP
        if method == AUTO:
            sweep = size <= 2000.0
        for v in range(n):
            best[v] = -1
        if sweep:
            if floats.size < 2 * size:
                return NEED_FLOATS, 0.0, 0.0, 0, int(2 * size)
            top, feasible = _sweep(
                table, members, m, place, n, component_points[:n], scales, shifts, tolerance, floats, best
            )  # fmt: skip
            nodes += int(size)
            if not feasible:
                return INFEASIBLE, top, top, nodes, 0
            value += top
            bound += top
        else:
            result, top, above, seen, lacking = _search(
                table, members, m, place, n, component_points[:n], scales, shifts, tolerance,
                ints[wide:], floats, best, limit,
            )  # fmt: skip
            if result in (NEED_INTS, NEED_FLOATS):
                return result, 0.0, 0.0, 0, lacking + wide
            nodes += seen
            if result == INFEASIBLE:
                return INFEASIBLE, top, above, nodes, 0
            if result == STOPPED:
                outcome = STOPPED
            value += top
            bound += above
        for v in range(wide):
            if group[v] == label:
                head[v] = best[local[v]]
    return outcome, value, bound, nodes, 0
