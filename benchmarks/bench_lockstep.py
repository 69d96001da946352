"""What the lockstep host itself costs: one app tick, one post, one community.

Baselines, measured in the same run: a loop that calls a function and stores a value in a dict per tick
(what a simulation without any middleware would do), and an interpreter that has imported nothing.

    python benchmarks/bench_lockstep.py
"""

from __future__ import annotations

import argparse
import gc
import statistics
import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable

from pymoos_lite.app import App, AppContext
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.lockstep import Community, Lockstep

STEPS = 50_000


class Idle(App):
    """Does nothing, ten times a second."""

    DEFAULT_TICK = 10.0


class Poster(App):
    """Posts one number a tick."""

    DEFAULT_TICK = 10.0

    def iterate(self) -> None:
        self.notify("NUMBER", float(self.iteration))


class Reader(Poster):
    """Posts one number a tick and hears it again."""

    def on_connect(self) -> None:
        self.register("NUMBER")

    def on_mail(self, mail: list[Message]) -> None:
        self.last = mail[-1].value


def add(host: Lockstep, community: Community, cls: type[App], name: str) -> None:
    connection = LocalConnection(community.database, name, host.clock)
    host.add_app(community, cls, AppContext(name, community.name, host.clock, connection, deterministic=True))


def seconds_per_tick(cls: type[App]) -> float:
    host = Lockstep()
    community = host.add_community("bench")
    add(host, community, cls, "app")
    host.run(100.0)
    began = time.perf_counter()
    host.run(STEPS / 10.0)
    return (time.perf_counter() - began) / STEPS


def seconds_per_bare_tick() -> float:
    store: dict[str, float] = {}

    def tick(now: float) -> None:
        store["NUMBER"] = now

    began = time.perf_counter()
    now = 0.0
    for _ in range(STEPS):
        now += 0.1
        tick(now)
    return (time.perf_counter() - began) / STEPS


def best(measure: Callable[[], float], repeats: int) -> float:
    return min(measure() for _ in range(repeats))


def bytes_per_community(count: int = 200, apps: int = 10) -> float:
    """Python memory of a community with `apps` apps that each post and read one variable."""
    host = Lockstep()
    gc.collect()
    tracemalloc.start()
    for number in range(count):
        community = host.add_community(f"c{number}")
        for app in range(apps):
            add(host, community, Reader, f"app{app}")
    host.run(5.0)
    gc.collect()
    used, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return used / count


def seconds_to_run(*words: str, repeats: int) -> float:
    took = []
    for _ in range(repeats):
        began = time.perf_counter()
        subprocess.run([sys.executable, *words], stdout=subprocess.DEVNULL, check=True)
        took.append(time.perf_counter() - began)
    return statistics.median(took)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    bare = best(seconds_per_bare_tick, repeats)
    print(f"{'per tick':<44}{'microseconds':>14}{'x bare loop':>13}")
    print(f"{'bare loop: call a function, store a value':<44}{1e6 * bare:>14.2f}{1.0:>13.1f}")
    for label, cls in (
        ("an idle app", Idle),
        ("an app that posts", Poster),
        ("... and hears its post", Reader),
    ):
        took = best(lambda cls=cls: seconds_per_tick(cls), repeats)
        print(f"{label:<44}{1e6 * took:>14.2f}{took / bare:>13.1f}")
    print()
    print(f"memory of a community with ten apps: {bytes_per_community() / 1024:.0f} KiB")
    print()
    nothing = seconds_to_run("-c", "pass", repeats=repeats)
    print(f"{'start-up':<44}{'milliseconds':>14}{'x python':>13}")
    print(f"{'python -c pass':<44}{1e3 * nothing:>14.0f}{1.0:>13.1f}")
    for label, words in (
        ("pymoos --help", ("-m", "pymoos_lite.tools.cli", "--help")),
        ("pymoos list", ("-m", "pymoos_lite.tools.cli", "list")),
        ("pymoos sim alpha, 1 s", ("-m", "pymoos_lite.tools.cli", "sim", "alpha", "--duration", "1")),
    ):
        try:
            took = seconds_to_run(*words, repeats=repeats)
        except subprocess.CalledProcessError:
            print(f"{label:<44}{'failed':>14}")
            continue
        print(f"{label:<44}{1e3 * took:>14.0f}{took / nothing:>13.1f}")


if __name__ == "__main__":
    main()
