"""The highest warp at which a fleet in real time keeps its rates, on this machine's cores.

    python benchmarks/bench_fleet_realtime.py                       # 8 vessels of berta, the warps of LADDER
    python benchmarks/bench_fleet_realtime.py --warps 8 15 --wall 20

Every community is a process, and they talk UDP as `pymoos launch` has it. In every vessel's database posts of the
simulator, the PID, the helm and the node reporter are counted by a client, over a stretch of wall time and in
mission time, in two phases of one run: calm (all loiter at their stations) and manoeuvring (stations are
swapped all the time, so that nearly everybody is under way and avoids others; how many avoidance
behaviours are at work is shown). A warp is kept if the slowest rate of the slowest vessel is within 5 % of nominal.
The highest one is found by bisection. The clients that count take some processor time themselves, which is shown
and not taken off.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from pymoos_lite.core.clock import RealClock
from pymoos_lite.hosts.fleet import find_fleet, load_fleet, plan_fleet
from pymoos_lite.hosts.fleet_host import FleetHost, free_ports
from pymoos_lite.hosts.ports import LOOPBACK, RemoteClient
from pymoos_lite.hosts.realtime import HostOptions

NOMINAL = {"NAV_X": 5.0, "DESIRED_RUDDER": 10.0, "IVPHELM_SUMMARY": 4.0, "NODE_REPORT_LOCAL": 2.0}
"""Posts per mission second: the simulator publishes every second tick of ten."""

TOLERANCE = 0.05
START_TIMEOUT = 120.0
LADDER = (4.0, 6.0, 8.0, 10.0, 12.0, 15.0, 18.0, 21.0, 25.0, 30.0, 35.0, 40.0)
BASELINE = {"calm": 10.0, "manoeuvring": 3.0}
"""Warps that the reference stack keeps with eight vessels on two cores."""

SWAPS = {"calm": 1e6, "manoeuvring": 5.0}
"""Mission seconds between two swaps."""

ARRIVAL = 90.0
"""Mission seconds that vessels are given to reach their stations, and again to be all under way."""


class Watch:
    """A client in one vessel's database that counts posts, and behaviours that avoid somebody."""

    def __init__(self, name: str, address: tuple[str, int], clock: RealClock) -> None:
        self.name = name
        self.client = RemoteClient("bench", *address, clock=clock)
        for variable in NOMINAL:
            self.client.register(variable)
        self.counts: Counter[str] = Counter()
        self.avoiding = 0

    def poll(self) -> None:
        for message in self.client.poll(0.0):
            self.counts[message.name] += 1
            if message.name == "IVPHELM_SUMMARY":
                active = message.text.partition("active_bhvs=")[2].partition(",")[0]
                self.avoiding += active.count("avoid_")

    def clear(self) -> None:
        self.counts.clear()
        self.avoiding = 0


@dataclass(frozen=True)
class Kept:
    """What was counted in one phase: the lowest rate as a fraction of nominal and whose it is; avoidance
    behaviours at work per vessel; load of all communities and of this program, in cores."""

    lowest: float
    whose: str
    avoiding: float
    load: float
    own_load: float

    @property
    def fine(self) -> bool:
        return self.lowest >= 1.0 - TOLERANCE


def measure(
    mission: str, vehicles: int, warp: float, wall: float, seed: int, phases: list[str]
) -> dict[str, Kept]:
    """One run of the fleet at one warp, with the phases asked for."""
    path = find_fleet(mission)
    fleet = replace(load_fleet(path, vehicles, seed, macros={"SWAP_INTERVAL": "1e6"}), warp=warp)
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
            return {phase: _count(host, watches, phase, wall) for phase in phases}
        finally:
            for watch in watches:
                watch.client.close(0.1)
            host.close()


def _count(host: FleetHost, watches: list[Watch], phase: str, wall: float) -> Kept:
    clock = host.clock
    host.post("SWAP_INTERVAL", SWAPS[phase])
    ready = clock.now() + ARRIVAL
    _serve(host, watches, lambda: clock.now() >= ready)
    for watch in watches:
        watch.clear()
    pids = [host.pid(name) for name in host.running()]
    used, own = _processor_seconds(pids), time.process_time()
    began, end = clock.now(), time.monotonic() + wall
    _serve(host, watches, lambda: time.monotonic() >= end)
    elapsed = clock.now() - began
    real = elapsed / clock.warp
    lowest, whose = min(
        (watch.counts[variable] / elapsed / nominal, f"{variable} of {watch.name}")
        for watch in watches
        for variable, nominal in NOMINAL.items()
    )
    decisions = sum(watch.counts["IVPHELM_SUMMARY"] for watch in watches)
    avoiding = sum(watch.avoiding for watch in watches) / max(1, decisions)
    load = (_processor_seconds(pids) - used) / real
    return Kept(lowest, whose, avoiding, load, (time.process_time() - own) / real)


def _serve(host: FleetHost, watches: list[Watch], over: Callable[[], bool]) -> None:
    while not over():
        host.turn(0.02)
        for watch in watches:
            watch.poll()


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


def _processor_seconds(pids: list[int]) -> float:
    """Processor time of other processes so far; nan where the system does not say."""
    total = 0.0
    for pid in pids:
        try:
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return float("nan")
        total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return total


class Search:
    """The highest warp of the ladder that each phase keeps, by bisection, one run serving both phases."""

    def __init__(self, warps: list[float]) -> None:
        self.warps = warps
        self.kept = dict.fromkeys(SWAPS, -1)
        self.failed = dict.fromkeys(SWAPS, len(warps))

    def open_phases(self, index: int) -> list[str]:
        """Phases for which a run at this warp would tell something new."""
        return [phase for phase in SWAPS if self.kept[phase] < index < self.failed[phase]]

    def next(self) -> int | None:
        """Which warp to try: the middle of the wider gap; None when all is known."""
        gaps = {phase: self.failed[phase] - self.kept[phase] for phase in SWAPS}
        phase = max(gaps, key=lambda name: gaps[name])
        return None if gaps[phase] < 2 else (self.failed[phase] + self.kept[phase]) // 2

    def note(self, index: int, phase: str, fine: bool) -> None:
        if fine:
            self.kept[phase] = max(self.kept[phase], index)
        else:
            self.failed[phase] = min(self.failed[phase], index)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--mission", default="berta")
    parser.add_argument("--vehicles", type=int, default=8)
    parser.add_argument("--warps", type=float, nargs="*", default=list(LADDER), help="warps to search among")
    parser.add_argument("--wall", type=float, default=8.0, help="wall seconds counted in each phase")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    print(
        f"{args.vehicles} vessels, {os.cpu_count()} processors; baseline: on two cores the reference stack "
        f"keeps the rates of eight up to warp {BASELINE['calm']:g} calm, {BASELINE['manoeuvring']:g} manoeuvring"
    )
    print(
        f"{'warp':>6}  {'phase':<13}{'lowest rate':>12}  {'':<28}{'avoiding':>9}{'cores':>7}{'bench':>7}  kept"
    )
    search = Search(sorted(args.warps))
    while (index := search.next()) is not None:
        warp = search.warps[index]
        phases = search.open_phases(index)
        for phase, found in measure(args.mission, args.vehicles, warp, args.wall, args.seed, phases).items():
            search.note(index, phase, found.fine)
            print(
                f"{warp:>6g}  {phase:<13}{found.lowest:>12.1%}  {found.whose:<28}{found.avoiding:>9.2f}"
                f"{found.load:>7.2f}{found.own_load:>7.2f}  {'yes' if found.fine else 'no'}",
                flush=True,
            )
    for phase, base in BASELINE.items():
        kept = search.warps[search.kept[phase]] if search.kept[phase] >= 0 else 0.0
        print(f"highest warp kept, {phase}: {kept:g}, {kept / base:.1f} times the baseline's")


if __name__ == "__main__":
    main()
