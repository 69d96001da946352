"""Who goes to which sample point (gcid.md 13): the paper's greedy rule, and an optimal assignment.

Every vessel decides for itself from what it knows of the others; nothing is negotiated. One metre of way
counts as much as one second of sampling that is still to be done.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot

XY = tuple[float, float]


def greedy_target(
    own: str, places: Mapping[str, XY], points: Sequence[XY], busy: Mapping[str, float] | None = None
) -> int | None:
    """Index of the point that is `own`'s, or None: the nearest one that nobody else is nearer to.

    `places` are the sampling vessels' positions in metres and must hold `own`; `busy` the seconds each still
    has to sample. A nearer vessel only counts if that point is also the one nearest to itself. Of equally
    near points the first wins.

    Raises:
        KeyError: `own` has no place.
    """
    waits = busy or {}
    x, y = places[own]
    order = sorted(range(len(points)), key=lambda i: (hypot(points[i][0] - x, points[i][1] - y), i))
    rivals = [
        (wx, wy, waits.get(name, 0.0), min((hypot(px - wx, py - wy) for px, py in points), default=0.0))
        for name, (wx, wy) in places.items()
        if name != own
    ]
    for i in order:
        px, py = points[i]
        cost = hypot(px - x, py - y) + waits.get(own, 0.0)
        for wx, wy, wait, nearest in rivals:
            way = hypot(px - wx, py - wy)
            if way <= nearest and way + wait < cost:
                break
        else:
            return i
    return None


def optimal_target(
    own: str, places: Mapping[str, XY], points: Sequence[XY], busy: Mapping[str, float] | None = None
) -> int | None:
    """Index of the point that is `own`'s when the sum of all costs is least, or None.

    Arguments as in `greedy_target`. One point per vessel; with fewer points than vessels some get none.
    Vessels are taken in order of their names, so that all who know the same decide the same.

    Raises:
        KeyError: `own` has no place.
    """
    import numpy as np
    from scipy.optimize import linear_sum_assignment

    if own not in places:
        raise KeyError(own)
    if not points:
        return None
    waits = busy or {}
    names = sorted(places)
    at = np.array([places[name] for name in names])
    to = np.array(points)
    cost = np.hypot(at[:, :1] - to[:, 0], at[:, 1:] - to[:, 1])
    cost += np.array([waits.get(name, 0.0) for name in names])[:, None]
    rows, columns = linear_sum_assignment(cost)
    found = dict(zip(rows.tolist(), columns.tolist(), strict=True))
    return found.get(names.index(own))


METHODS = {"greedy": greedy_target, "optimal": optimal_target}
