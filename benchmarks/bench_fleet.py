"""How fast a whole fleet runs in lockstep, and which app the time goes to.

    python benchmarks/bench_fleet.py                    # 8 vessels of berta with a profile per app, and the curve
    python benchmarks/bench_fleet.py --curve 1 2 4 8 --duration 120 --repeat 3

Times are CPU seconds of this process (one core), so that other work on the machine matters less: the mean of
all stretches, with the best beside it. Stretches get shorter and fewer with the fleet, so that the curve takes a minute
or two. The profile times every step of every app, which costs a little itself: its shares are to be read, not
its sum.

The baseline is real time: on the reference stack a vessel-second of this kind of mission costs 24 ms of CPU
with one contact and 45 ms with seven (one core of a server machine of 2023; to be compared on like machines).
Between and below, the straight line through these two is taken; above seven contacts the 45 ms are kept, which
flatters the reference.
"""

from __future__ import annotations

import argparse
import gc
import statistics
import tempfile
import time
from pathlib import Path

from pymoos_lite import compiled
from pymoos_lite.hosts.fleet import add_fleet, deploy_in_lockstep, find_fleet, load_fleet, plan_fleet
from pymoos_lite.hosts.lockstep import Lockstep

REFERENCE_MS = {1: 24.0, 7: 45.0}
"""CPU milliseconds per vessel-second of the reference stack, measured, by number of contacts."""

SETTLE = 60.0
"""Mission seconds before timing begins: compilation, discovery and deployment are then over."""

FULL_STRETCH_UP_TO = 8
"""Vessels; larger fleets are timed once, for as many vessel-seconds as these, and for `SHORTEST` at least."""

SHORTEST = 15.0


def reference_ms(contacts: int) -> float:
    """The baseline for any number of contacts; see the module."""
    slope = (REFERENCE_MS[7] - REFERENCE_MS[1]) / 6.0
    return REFERENCE_MS[1] + slope * (min(contacts, 7) - 1)


def host_of(mission: str, vehicles: int, seed: int, folder: Path) -> Lockstep:
    """A fleet that has been discovered and deployed."""
    gc.collect()  # communities hold each other in circles: let the last fleet go before the next begins
    path = find_fleet(mission)
    plan = plan_fleet(load_fleet(path, vehicles, seed), path.resolve().parent, folder, warp=1.0)
    if plan.errors:
        raise SystemExit("\n".join(map(str, plan.errors)))
    host = Lockstep(seed, folder, stagger=True)
    add_fleet(host, plan)
    deploy_in_lockstep(host, plan)
    host.run(SETTLE)
    return host


def cpu_seconds(host: Lockstep, duration: float) -> float:
    """CPU time of `duration` mission seconds."""
    began = time.process_time()
    host.run(duration)
    return time.process_time() - began


def profile(mission: str, vehicles: int, duration: float, seed: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        host = host_of(mission, vehicles, seed, Path(folder))
        times = host.step_times = {}
        host.run(duration)
        host.stop()
    total = sum(map(sum, times.values()))
    per = 1000.0 / (duration * vehicles)
    print(f"\nper app, {vehicles} vessels, {duration:g} mission seconds")
    print(f"{'app':<22}{'share':>7}{'ms/vessel-s':>13}{'steps/vessel-s':>16}{'median us':>11}")
    for name, found in sorted(times.items(), key=lambda item: -sum(item[1])):
        rate = len(found) / (duration * vehicles)
        middle = statistics.median(found) * 1e6
        print(f"{name:<22}{sum(found) / total:>7.1%}{sum(found) * per:>13.4f}{rate:>16.1f}{middle:>11.1f}")


def curve(mission: str, sizes: list[int], duration: float, repeat: int, seed: int) -> None:
    print(
        f"\nmean of {repeat} stretches (one above {FULL_STRETCH_UP_TO} vessels); "
        "reference: * measured, else by the line through the two measured"
    )
    print(
        f"{'vessels':>8}{'stretch s':>11}{'times real time':>17}{'best':>7}{'ms/vessel-s':>13}"
        f"{'reference ms':>14}{'ratio':>7}{'encounters':>12}{'collisions':>12}"
    )
    for vehicles in sizes:
        stretch = max(SHORTEST, duration * min(1.0, FULL_STRETCH_UP_TO / vehicles))
        with tempfile.TemporaryDirectory() as folder:
            host = host_of(mission, vehicles, seed, Path(folder))
            stretches = repeat if vehicles <= FULL_STRETCH_UP_TO else 1
            times = [cpu_seconds(host, stretch) for _ in range(stretches)]
            encounters, collisions = totals(host)
            failures = host.failures
            host.stop()
        if failures:
            raise SystemExit("\n".join(map(str, failures)))
        mean, best = statistics.fmean(times), min(times)
        each = mean * 1000.0 / (stretch * vehicles)
        known = reference_ms(vehicles - 1)
        mark = "*" if vehicles - 1 in REFERENCE_MS else " "
        print(
            f"{vehicles:>8}{stretch:>11.0f}{stretch / mean:>17.0f}{stretch / best:>7.0f}{each:>13.3f}"
            f"{known:>13.1f}{mark}{known / each:>7.1f}{encounters:>12.0f}{collisions:>12.0f}",
            flush=True,
        )


def totals(host: Lockstep) -> tuple[float, float]:
    """Encounters and collisions so far, as the referee at the shoreside counts them."""
    database = host.communities["shoreside"].database
    found = (database.value(name) for name in ("ENCOUNTER_TOTAL", "COLLISION_TOTAL"))
    encounters, collisions = (value if isinstance(value, float) else 0.0 for value in found)
    return encounters, collisions


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--mission", default="berta", help="a fleet (default berta)")
    parser.add_argument("--vehicles", type=int, default=8, help="vessels of the profile")
    parser.add_argument("--duration", type=float, default=120.0, help="mission seconds of one stretch")
    parser.add_argument("--repeat", type=int, default=2, help="stretches timed")
    parser.add_argument(
        "--curve", type=int, nargs="*", default=[1, 2, 4, 8, 16, 32, 64], help="sizes of fleets"
    )
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    print(f"hot modules: {compiled.state()}")
    profile(args.mission, args.vehicles, args.duration, args.seed)
    if args.curve:
        curve(args.mission, args.curve, args.duration, args.repeat, args.seed)


if __name__ == "__main__":
    main()
