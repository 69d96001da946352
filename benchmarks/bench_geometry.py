"""Closest points of approach and obstacle distances over a whole decision domain, and geodesy.

Baseline of each grid: the same values from a plain Python loop over the scalar question, which is also the
oracle: the largest difference is printed beside the times. Run as a script; best of several rounds.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from timeit import repeat

import numpy as np

from pymoos_lite.geometry.cpa import CpaEngine
from pymoos_lite.geometry.geodesy import Geodesy
from pymoos_lite.geometry.polygon import Polygon
from pymoos_lite.geometry.specs import parse_polygon
from pymoos_lite.geometry.turn_paths import TurnModel

COURSES = np.arange(360.0)
SPEEDS = np.linspace(0.0, 5.0, 41)


def milliseconds(run: Callable[[], object], number: int, rounds: int = 5) -> float:
    return min(repeat(run, number=number, repeat=rounds)) / number * 1e3


def walked(model: TurnModel, course: float, polygon: Polygon) -> float:
    """The turn path measured leg by leg."""
    path = model.seglr(course)
    legs = [polygon.dist_to_segment(*a, *b) for a, b in pairwise(path.points)]
    return min([*legs, polygon.ray_cpa(*path.points[-1], path.ray)])


def main() -> None:
    engine = CpaEngine(50.0, 50.0, 270.0, 2.0, 0.0, 0.0)
    model = TurnModel(0.0, 0.0, 20.0, 8.0, 10.0)
    obstacle = parse_polygon("format=radial,x=30,y=25,radius=10,pts=12")
    rows: list[tuple[str, Callable[[], object], Callable[[], object]]] = [
        (
            "CPA, 360 courses x 41 speeds",
            lambda: engine.cpa_grid(COURSES, SPEEDS, 120.0),
            lambda: np.array([[engine.eval_cpa(c, v, 120.0) for v in SPEEDS] for c in COURSES]),
        ),
        (
            "rate of closure, 360 x 41",
            lambda: engine.roc_grid(COURSES, SPEEDS),
            lambda: np.array([[engine.eval_roc(c, v) for v in SPEEDS] for c in COURSES]),
        ),
        (
            "passing distance, 360 x 41",
            lambda: engine.passes_port_dist_grid(COURSES, SPEEDS),
            lambda: np.array([[engine.passes_port_dist(c, v) for v in SPEEDS] for c in COURSES]),
        ),
        (
            "turn path to a 12-gon, 360 courses",
            lambda: model.dists_to_polygon(COURSES, obstacle),
            lambda: np.array([walked(model, c, obstacle) for c in COURSES]),
        ),
    ]
    print(f"{'what':<38}{'fast ms':>10}{'loop ms':>10}{'ratio':>8}{'max diff':>12}")
    for name, fast, slow in rows:
        difference = float(np.max(np.abs(np.asarray(fast()) - np.asarray(slow()))))
        quick, plain = milliseconds(fast, 50), milliseconds(slow, 1, 3)
        print(f"{name:<38}{quick:>10.3f}{plain:>10.2f}{plain / quick:>8.0f}{difference:>12.1e}")

    geo = Geodesy(43.8253, -70.3304)
    x, y = geo.to_local(43.83, -70.32)
    print(f"\nlat/lon to x/y  {milliseconds(lambda: geo.to_local(43.83, -70.32), 5000) * 1e3:6.2f} us")
    print(f"x/y to lat/lon  {milliseconds(lambda: geo.to_latlon(x, y), 5000) * 1e3:6.2f} us")


if __name__ == "__main__":
    main()
