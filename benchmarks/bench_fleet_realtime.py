"""The highest warp at which a fleet in real time keeps its rates, on this machine's cores.

    python benchmarks/bench_fleet_realtime.py                       # 8 vessels of berta, warps 2 to 24
    python benchmarks/bench_fleet_realtime.py --warps 4 8 --wall 20

Every community is a process. At each warp the rates of the simulator, the helm and the node reporter are counted
in every vessel's database, in mission time, over a stretch of wall time that begins once all of them sail. A warp
counts as kept if the slowest rate of the slowest vessel is within 5 % of nominal.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

from pymoos_lite.core.clock import RealClock
from pymoos_lite.hosts.fleet import find_fleet, load_fleet, plan_fleet
from pymoos_lite.hosts.fleet_host import FleetHost, free_ports
from pymoos_lite.hosts.ports import LOOPBACK, RemoteClient
from pymoos_lite.hosts.realtime import HostOptions

NOMINAL = {"NAV_X": 5.0, "IVPHELM_SUMMARY": 4.0, "NODE_REPORT_LOCAL": 2.0}
"""Posts per mission second: the simulator publishes every second tick of ten."""

TOLERANCE = 0.05
START_TIMEOUT = 120.0


class Watch:
    """A client in one vessel's database that counts posts."""

    def __init__(self, name: str, address: tuple[str, int], clock: RealClock) -> None:
        self.name = name
        self.client = RemoteClient("bench", *address, clock=clock)
        for variable in NOMINAL:
            self.client.register(variable)
        self.counts: Counter[str] = Counter()

    def poll(self) -> None:
        for message in self.client.poll(0.0):
            self.counts[message.name] += 1


def measure(mission: str, vehicles: int, warp: float, wall: float, seed: int) -> tuple[float, str]:
    """The lowest rate as a fraction of nominal, and whose it is."""
    path = find_fleet(mission)
    fleet = replace(load_fleet(path, vehicles, seed), warp=warp)
    clock = RealClock(warp)
    with tempfile.TemporaryDirectory() as out:
        plan = plan_fleet(fleet, path.resolve().parent, Path(out), ports=free_ports(fleet, LOOPBACK))
        options = HostOptions(log_dir=Path(out), seed=seed, share_bind=LOOPBACK)
        host = FleetHost(plan, path.resolve().parent, options, {}, clock, lambda text: print(f"  {text}"))
        host.start()
        watches = [Watch(name, host.address_of(name), clock) for name in fleet.vehicle_names()]
        try:
            host.connect("bench_shore")
            _wait_until_all_sail(host, plan.posts("deploy"), watches)
            for watch in watches:
                watch.counts.clear()
            began, end = clock.now(), time.monotonic() + wall
            while time.monotonic() < end:
                host.turn(0.02)
                for watch in watches:
                    watch.poll()
            elapsed = clock.now() - began
        finally:
            for watch in watches:
                watch.client.close(0.1)
            host.close()
    rates = [
        (watch.counts[variable] / elapsed / nominal, f"{variable} of {watch.name}")
        for watch in watches
        for variable, nominal in NOMINAL.items()
    ]
    return min(rates)


def _wait_until_all_sail(host: FleetHost, posts: list[tuple[str, str | float]], watches: list[Watch]) -> None:
    end = time.monotonic() + START_TIMEOUT
    next_post = 0.0
    while any(watch.counts["IVPHELM_SUMMARY"] < 20 for watch in watches):
        if time.monotonic() > end:
            raise SystemExit("not every vessel was sailing in time")
        if time.monotonic() > next_post:
            next_post = time.monotonic() + 2.0
            for name, value in posts:
                host.post(name, value)
        host.turn(0.02)
        for watch in watches:
            watch.poll()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--mission", default="berta")
    parser.add_argument("--vehicles", type=int, default=8)
    parser.add_argument("--warps", type=float, nargs="*", default=[2.0, 4.0, 8.0, 12.0, 16.0, 24.0])
    parser.add_argument("--wall", type=float, default=15.0, help="wall seconds counted at each warp")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    print(
        "baseline: the reference stack keeps eight vessels' rates on two cores up to warp 3 "
        "(all manoeuvring) to 10 (calm)"
    )
    print(f"{'warp':>6}{'lowest rate':>13}  {'':<28}kept")
    kept = 0.0
    for warp in args.warps:
        lowest, whose = measure(args.mission, args.vehicles, warp, args.wall, args.seed)
        fine = lowest >= 1.0 - TOLERANCE
        kept = max(kept, warp) if fine else kept
        print(f"{warp:>6g}{lowest:>13.1%}  {whose:<28}{'yes' if fine else 'no'}", flush=True)
        if not fine:
            break
    print(f"highest warp kept: {kept:g}")


if __name__ == "__main__":
    main()
