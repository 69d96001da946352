"""What one helm iteration costs, where it goes, and how it grows with the number of behaviours.

Run as a script. The helm runs on the bench (`ivp_helm.testing.HelmRig`), over course 360 x speed 41, own ship
turning so that nothing can be reused from iteration to iteration. The split is measured by wrapping the
helm's parts: mail (delivering five NAV values), conditions (modes and conditions of behaviours), build
(`on_run`), solve, post (everything else: states, posts, summary).

Baseline, in the same run: the plain way to decide, which adds up a table of every function over the whole
domain with numpy and takes the best point (`solve_exhaustive`), in place of the solver.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

import ivp_helm.decision as decision_module
from ivp_helm.behavior import Behavior
from ivp_helm.conditions import ConditionSet
from ivp_helm.ivp import IvPFunction, reflect, solve_exhaustive
from ivp_helm.modes import ModeSet
from ivp_helm.testing import HelmRig
from pymoos_lite.core.message import Message

Array = NDArray[np.float64]
DOMAIN = ("course:0:359:360", "speed:0:4:41")
MODES = """
set MODE = ACTIVE {
  DEPLOY = true
} INACTIVE
set MODE = SURVEYING {
  MODE = ACTIVE
  RETURN != true
} HOME
"""
PARTS = ("mail", "conditions", "build", "solve", "post")


class Split:
    """Seconds spent in each part of the present iteration."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(PARTS, 0.0)
        self._inside = False

    def wrap(self, owner: Any, name: str, part: str) -> Callable[[], None]:
        """Measure a function or method under `part`; returns what undoes it."""
        former = getattr(owner, name)

        def timed(*arguments: Any, **more: Any) -> Any:
            if self._inside:
                return former(*arguments, **more)
            self._inside = True
            began = perf_counter()
            try:
                return former(*arguments, **more)
            finally:
                self.seconds[part] += perf_counter() - began
                self._inside = False

        setattr(owner, name, timed)
        return lambda: setattr(owner, name, former)


def run(
    behaviors: Sequence[tuple[str | type[Behavior], dict[str, Any]]], iterations: int, split: bool
) -> list[dict[str, float]]:
    """Seconds per part (and ``all``) of each iteration."""
    kinds = [(kind, {"condition": "MODE == ACTIVE", **parameters}) for kind, parameters in behaviors]
    rig = HelmRig(kinds, text=MODES, domain=DOMAIN, initial={"DEPLOY": "true"})
    core = rig.core
    meter = Split()
    undo: list[Callable[[], None]] = []
    if split:
        undo.append(meter.wrap(ConditionSet, "first_false", "conditions"))
        undo.append(meter.wrap(ModeSet, "evaluate", "conditions"))
        undo.append(meter.wrap(decision_module, "solve", "solve"))
        for cls in {type(life.behavior) for life in core.population}:
            undo.append(meter.wrap(cls, "on_run", "build"))
    found = []
    x, y, heading, now = 0.0, 0.0, 40.0, rig.now
    try:
        for k in range(iterations):
            now += 0.25
            heading = (heading + 1.7) % 360.0
            x += 0.5 * math.sin(math.radians(heading))
            y += 0.5 * math.cos(math.radians(heading))
            values = {"NAV_X": x, "NAV_Y": y, "NAV_HEADING": heading, "NAV_SPEED": 2.0, "NAV_DEPTH": 0.0}
            mail = [Message(name, value, now, "nav") for name, value in values.items()]
            meter.seconds = dict.fromkeys(PARTS, 0.0)
            began = perf_counter()
            core.deliver(mail, now)
            delivered = perf_counter()
            core.iterate(now)
            core.take_posts()
            core.take_notes()
            ended = perf_counter()
            seconds = dict(meter.seconds)
            seconds["mail"] = delivered - began
            seconds["all"] = ended - began
            seconds["post"] = seconds["all"] - sum(seconds[part] for part in PARTS if part != "post")
            if k >= 20:  # the first ones compile, load and cache
                found.append(seconds)
    finally:
        for restore in undo:
            restore()
    assert core.trace is not None
    assert core.trace.reason == "clear", core.trace
    return found


def median_us(rows: list[dict[str, float]], part: str) -> float:
    return statistics.median(row[part] for row in rows) * 1e6


def best_median_us(behaviors: Any, iterations: int = 400, rounds: int = 5) -> float:
    """The least of several medians: the machine may be busy with other things."""
    return min(median_us(run(behaviors, iterations, split=False), "all") for _ in range(rounds))


WAYPOINT = (
    "BHV_Waypoint",
    {"name": "survey", "points": "900,900:-900,900", "speed": 2, "lead": 8, "lead_to_start": "true"},
)


@njit(cache=True)  # type: ignore[untyped-decorator]
def clearance(
    course: Array, speed: Array, east: Array, north: Array, dx: float, dy: float, cx: float, cy: float
) -> Array:
    """Utility of each course and speed by the closest point of approach within two minutes to a vessel that is
    (dx, dy) away and moves at (cx, cy): 0 up to 8 m, 100 from 28 m on."""
    out = np.empty(course.size)
    for k in range(course.size):
        degree = int(course[k])
        vx, vy = speed[k] * east[degree] - cx, speed[k] * north[degree] - cy
        square = vx * vx + vy * vy
        time = min(max(0.0, (dx * vx + dy * vy) / square), 120.0) if square > 0.0 else 0.0
        distance = math.hypot(dx - vx * time, dy - vy * time)
        out[k] = min(max(0.0, (distance - 8.0) * 5.0), 100.0)
    return out


class Avoid(Behavior):
    """Keeps clear of a vessel that crosses ahead, as an avoidance behaviour does: about 800 pieces, built anew
    in every iteration from the closest point of approach of every course and speed."""

    BHV_NAME = "BHV_BenchAvoid"

    def on_run(self) -> IvPFunction | None:
        dx, dy = 60.0 + self.now % 5.0, 60.0

        def utility(course: Array, speed: Array) -> Array:
            return clearance(course, speed, EAST, NORTH, dx, dy, -1.4, -0.3)

        return reflect(self.domain, utility, uniform_amount=900)


EAST, NORTH = np.sin(np.radians(np.arange(360.0))), np.cos(np.radians(np.arange(360.0)))
AVOID: tuple[type[Behavior], dict[str, Any]] = (Avoid, {"name": "avoid", "pwt": 200})
LOITER = (
    "BHV_Loiter",
    {"name": "loiter", "polygon": "format=radial,x=0,y=-50,radius=60,pts=8", "speed": 1.8, "pwt": 30},
)
LIMIT = ("BHV_MaxSpeed", {"name": "limit", "max_speed": 2.5, "pwt": 200})


def exhaustive(domain: Any, functions: Sequence[IvPFunction]) -> Any:
    return solve_exhaustive(domain, functions)


def with_baseline(behaviors: Any) -> tuple[float, float]:
    """Microseconds per iteration of ours and of the baseline."""
    ours = best_median_us(behaviors)
    former = decision_module.solve
    decision_module.solve = exhaustive  # type: ignore[assignment]
    try:
        plain = best_median_us(behaviors, 60, 3)
    finally:
        decision_module.solve = former
    return ours, plain


def main() -> None:
    print(f"{'behaviours':<44} {'us':>8} {'exhaustive us':>14} {'ratio':>7}")
    for title, behaviors in CASES:
        ours, plain = with_baseline(behaviors)
        print(f"{title:<44} {ours:>8.0f} {plain:>14.0f} {plain / ours:>7.1f}")
    print()
    print(
        f"{'split (median us, with the cost of measuring)':<44} " + " ".join(f"{part:>10}" for part in PARTS)
    )
    for title, behaviors in CASES:
        rows = run(behaviors, 400, split=True)
        print(f"{title:<44} " + " ".join(f"{median_us(rows, part):>10.1f}" for part in PARTS))
    print()
    print("waypoint behaviours at once: us per iteration")
    for count in (1, 2, 4, 8, 16):
        many = [
            (WAYPOINT[0], {**WAYPOINT[1], "name": f"w{chr(97 + k)}", "points": f"{900 - 90 * k},{50 * k}"})
            for k in range(count)
        ]
        print(f"  {count:>2}: {best_median_us(many, 200, 3):>8.0f}")


CASES: list[tuple[str, Any]] = [
    ("Waypoint", [WAYPOINT]),
    ("Waypoint, avoidance of 800 pieces", [WAYPOINT, AVOID]),
    ("Waypoint, Loiter, avoidance, MaxSpeed", [WAYPOINT, LOITER, AVOID, LIMIT]),
]

if __name__ == "__main__":
    main()
