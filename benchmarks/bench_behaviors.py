"""What each behaviour costs in one helm iteration: with own ship under way, and with nothing changed.

    python benchmarks/bench_behaviors.py [--rounds 200]

The baseline is the first behaviour of every mission, a Waypoint under way (`x Waypoint` is the ratio to it).
Times are CPU microseconds of `on_run`, the median over the rounds, in a domain of 360 courses, 41 speeds and
101 depths.
"""

from __future__ import annotations

import argparse
import math
import statistics
import time
from typing import Any

from ivp_helm.testing import HelmRig

DOMAIN = ("course:0:359:360", "speed:0:5:41", "depth:0:100:101")
BASELINE = "BHV_Waypoint"
BOX = "pts={-20,-20:20,-20:20,20:-20,20}"
CASES: dict[str, dict[str, Any]] = {
    BASELINE: {"points": "0,900:900,900", "speed": 2, "lead": 8},
    "BHV_Loiter": {"polygon": "format=radial,x=0,y=0,radius=80,pts=8", "speed": 2},
    "BHV_StationKeep": {"station_pt": "5,5"},
    "BHV_LegRun": {"leg": "0:0:45:200", "turn_rad": 12, "speed": 2, "lead": 8},
    "BHV_ZigZag": {"speed": 2, "zig_angle": 30, "max_zig_legs": 100000},
    "BHV_FixedTurn": {"fix_turn": 100000},
    "BHV_ConstantHeading": {"heading": 80},
    "BHV_ConstantSpeed": {"speed": 2},
    "BHV_ConstantDepth": {"depth": 10},
    "BHV_MaxSpeed": {"max_speed": 2},
    "BHV_OpRegion": {"polygon": "pts={-500,-500:500,-500:500,500:-500,500}"},
    "BHV_OpRegionV24": {"core_poly": BOX, "save_dist": 5},
    "BHV_MemoryTurnLimit": {"memory_time": 30, "turn_range": 60},
    "BHV_Hysteresis": {"memory_time": 30},
    "BHV_Timer": {},
}


def cost(kind: str, parameters: dict[str, Any], moving: bool, rounds: int) -> float:
    """Median microseconds of `on_run`."""
    given = {"name": "b", "duration": "no-time-limit", "perpetual": "true", **parameters}
    rig = HelmRig([(kind, given)], domain=DOMAIN)
    behavior = next(life.behavior for life in rig.core.population)
    times: list[float] = []
    run = behavior.on_run

    def timed() -> Any:
        begun = time.perf_counter()
        function = run()
        times.append(time.perf_counter() - begun)
        return function

    behavior.on_run = timed  # type: ignore[method-assign]
    for k in range(rounds):
        turn = k if moving and k > 8 else 0
        # Inside the small region for a while, so that leaving it means something.
        x, y = (0.0, 0.0) if k < 8 else (60.0 * math.cos(turn / 40.0), 60.0 * math.sin(turn / 40.0))
        rig.own(x, y, 7.3 * turn % 360.0, 1.5, 3.0 + math.sin(turn / 5.0))
        rig.iterate()
    return statistics.median(times[rounds // 4 :]) * 1e6


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=200, help="helm iterations per figure")
    rounds = parser.parse_args().rounds
    figures = {
        kind: (cost(kind, parameters, True, rounds), cost(kind, parameters, False, rounds))
        for kind, parameters in CASES.items()
    }
    reference = figures[BASELINE][0]
    print(f"{'on_run of':<22}{'under way, us':>14}{'unchanged, us':>15}{'x Waypoint':>12}")
    for kind, (moving, still) in figures.items():
        print(f"{kind:<22}{moving:>14.1f}{still:>15.1f}{moving / reference:>12.2f}")


if __name__ == "__main__":
    main()
