"""Community over UDP: messages per second and one-way latency, against a pyzmq broker in the same run.

Three processes each way: publisher, broker, subscriber. Ours is a `RemoteClient`, a `DatabaseServer` with
its database, and a `RemoteClient`. The baseline is a PUB socket, an XSUB/XPUB broker (`zmq.proxy`, C) and
a SUB socket over TCP on loopback, without limits on its queues; each message is the same msgpack array,
packed singly in the publisher and unpacked to the same `Message` in the subscriber. The broker of the
baseline forwards bytes; our database decodes, stores the last value, checks types and counts.

    python benchmarks/bench_community.py [--quick] [--repeat N] [--json FILE]

Throughput is taken at the subscriber, from first to last message, publisher at full speed. Latency is
taken message by message at 1000 a second, from before the post to after the decoded receipt. Both are
medians over the repeats, ours and the baseline's alternating.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing as mp
import os
import platform
import statistics
import sys
import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import msgpack

from pymoos_lite.core.clock import RealClock
from pymoos_lite.core.database import Database
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.ports import DatabaseServer, RemoteClient, free_port

PATIENCE = 60.0
RATE = 1000.0
TAIL = "x" * 1000


class Case(NamedTuple):
    """What is sent: numbers, or text of 1024 characters that begins with a number."""

    label: str
    text: bool

    def value(self, number: float) -> float | str:
        return f"{number:<24.9f}{TAIL}" if self.text else number

    def number(self, value: Any) -> float:
        return float(value[:24]) if self.text else value


CASES = (Case("8-byte double", False), Case("1 KB string", True))


class Job(NamedTuple):
    """One measurement: `count` messages as fast as possible, or paced for latency."""

    case: Case
    count: int
    paced: bool
    port: int


# --- ours -------------------------------------------------------------------------------------


def our_broker(job: Job, ready: Any, done: Any, result: Any) -> None:
    clock = RealClock()
    server = DatabaseServer(Database("bench", clock.now()), clock, port=job.port)
    ready.set()
    while not done.is_set():
        for _ in range(200):
            server.pump(0.05)
    result.put(("broker", time.process_time(), 0))


def our_subscriber(job: Job, ready: Any, done: Any, result: Any) -> None:
    client = RemoteClient("subscriber", port=job.port)
    client.register("BENCH")
    while not (client.connected and client.flush(0.1)):
        client.poll(0.05)
    ready.set()
    result.put(("subscriber", *collect(job, client.poll)))
    client.close()


def our_publisher(job: Job, ready: Any, done: Any, result: Any) -> None:
    client = RemoteClient("publisher", port=job.port)
    while not client.connected:
        client.poll(0.05)
    value_of, notify = job.case.value, client.notify
    begun = time.process_time()
    if job.paced:
        for due in paces(job.count):
            while time.monotonic() < due:
                client.poll(max(0.0, due - time.monotonic()))
            notify("BENCH", value_of(time.monotonic()))
            client.poll(0.0)
    else:
        for n in range(job.count):
            while not notify("BENCH", value_of(float(n))):
                client.flush(0.001)  # the queue is full: back-pressure
    client.flush(PATIENCE)
    result.put(("publisher", time.process_time() - begun, 0))
    done.wait(PATIENCE)
    client.close()


# --- the baseline -----------------------------------------------------------------------------


def zmq_broker(job: Job, ready: Any, done: Any, result: Any) -> None:
    import zmq

    context = zmq.Context()
    front, back = context.socket(zmq.XSUB), context.socket(zmq.XPUB)
    for sock in (front, back):
        sock.set_hwm(0)
    front.bind(f"tcp://127.0.0.1:{job.port}")
    back.bind(f"tcp://127.0.0.1:{job.port + 1}")
    # The proxy never returns; the process ends with it as a daemon.
    threading.Thread(target=zmq.proxy, args=(front, back), daemon=True).start()
    ready.set()
    done.wait()
    result.put(("broker", time.process_time(), 0))
    result.close()
    result.join_thread()
    os._exit(0)


def zmq_subscriber(job: Job, ready: Any, done: Any, result: Any) -> None:
    import zmq

    context = zmq.Context()
    sock = context.socket(zmq.SUB)
    sock.set_hwm(0)
    sock.connect(f"tcp://127.0.0.1:{job.port + 1}")
    sock.subscribe(b"BENCH")
    make, unpack = Message._make, msgpack.unpackb

    def poll(timeout: float) -> list[Message]:
        batch: list[Message] = []
        if not sock.poll(timeout * 1000):
            return batch
        try:
            while len(batch) < 512:
                _, packed = sock.recv_multipart(zmq.NOBLOCK)
                batch.append(make(unpack(packed, use_list=False)))
        except zmq.Again:
            pass
        return batch

    ready.set()
    result.put(("subscriber", *collect(job, poll)))
    context.destroy(0)


def zmq_publisher(job: Job, ready: Any, done: Any, result: Any) -> None:
    import zmq

    context = zmq.Context()
    sock = context.socket(zmq.PUB)
    sock.set_hwm(0)
    sock.connect(f"tcp://127.0.0.1:{job.port}")
    time.sleep(1.0)  # PUB has no way to know that the subscription has arrived
    clock = RealClock()
    value_of, pack, send = job.case.value, msgpack.Packer().pack, sock.send_multipart
    begun = time.process_time()
    if job.paced:
        for due in paces(job.count):
            while time.monotonic() < due:
                time.sleep(max(0.0, due - time.monotonic()))
            value = value_of(time.monotonic())
            send((b"BENCH", pack(Message("BENCH", value, clock.now(), "publisher", "", "bench"))))
    else:
        for n in range(job.count):
            value = value_of(float(n))
            send((b"BENCH", pack(Message("BENCH", value, clock.now(), "publisher", "", "bench"))))
    result.put(("publisher", time.process_time() - begun, 0))
    done.wait(PATIENCE)
    context.destroy(0)


# --- common -----------------------------------------------------------------------------------


def paces(count: int) -> list[float]:
    start = time.monotonic() + 0.05
    return [start + n / RATE for n in range(count)]


def collect(job: Job, poll: Callable[[float], list[Message]]) -> tuple[Any, int]:
    """Receive all; latencies in seconds if paced, else messages per second. And how many were lost."""
    number_of = job.case.number
    got = 0
    first = last = 0.0
    latencies: list[float] = []
    in_order, previous = True, -1.0
    while got < job.count:
        batch = poll(5.0)
        now = time.monotonic()
        if not batch:
            break
        if job.paced:
            latencies += [now - number_of(message.value) for message in batch]
        else:
            for message in batch:
                number = number_of(message.value)
                if number <= previous:
                    in_order = False
                previous = number
        if not got:
            first = now
            start = len(batch)
        last = now
        got += len(batch)
    assert in_order, "messages out of order"
    if job.paced:
        return latencies, job.count - got
    return (got - start) / (last - first) if last > first else 0.0, job.count - got


def measure(system: str, case: Case, count: int, paced: bool) -> dict[str, Any]:
    """Run the three processes once."""
    context = mp.get_context("spawn")
    job = Job(case, count, paced, free_port())
    done, result = context.Event(), context.Queue()
    roles = {"ours": (our_broker, our_subscriber, our_publisher)}.get(
        system, (zmq_broker, zmq_subscriber, zmq_publisher)
    )
    processes = []
    for role in roles:
        ready = context.Event()
        processes.append(context.Process(target=role, args=(job, ready, done, result), daemon=True))
        processes[-1].start()
        if role is not roles[2]:
            assert ready.wait(PATIENCE), f"{role.__name__} did not start"
    found: dict[str, Any] = {}
    for _ in range(2):
        who, what, lost = result.get(timeout=2 * PATIENCE)
        found[who] = what
        if who == "subscriber":
            found["lost"] = lost
    done.set()
    who, what, _ = result.get(timeout=PATIENCE)
    found[who] = what
    for process in processes:
        process.join(PATIENCE)
    return found


def percentile(sorted_values: list[float], fraction: float) -> float:
    return sorted_values[min(len(sorted_values) - 1, int(fraction * len(sorted_values)))]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a tenth of the messages, one repeat")
    parser.add_argument("--repeat", type=int, default=3, help="measurements of each kind (default 3)")
    parser.add_argument("--json", metavar="FILE", help="write the figures there as well")
    options = parser.parse_args()
    repeat = 1 if options.quick else options.repeat
    try:
        import zmq

        baseline = f"pyzmq {zmq.__version__}"
    except ImportError:
        sys.exit("the baseline needs pyzmq: pip install 'pymoos-lite[bench]'")
    print(f"Python {platform.python_version()}, {mp.cpu_count()} cores, {baseline}, median of {repeat}\n")
    print(f"{'':30}{'ours':>14}{'zmq broker':>14}{'ratio':>9}")
    figures: dict[str, dict[str, float]] = {}

    def line(label: str, ours: float, theirs: float, form: str) -> None:
        ratio = ours / theirs if theirs else float("nan")
        figures[label] = {"ours": ours, "baseline": theirs, "ratio": ratio}
        print(f"{label:30}{ours:14{form}}{theirs:14{form}}{ratio:9.2f}", flush=True)

    lost = {"ours": 0, "zmq": 0}
    for case in CASES:
        count = (100_000 if case.text else 500_000) // (10 if options.quick else 1)
        runs: dict[str, list[dict[str, Any]]] = {"ours": [], "zmq": []}
        for _ in range(repeat):
            for system, results in runs.items():
                results.append(measure(system, case, count, paced=False))
                lost[system] += results[-1]["lost"]
        rates = [statistics.median(r["subscriber"] for r in results) for results in runs.values()]
        line(f"{case.label}, messages/s", rates[0], rates[1], ",.0f")
        cost = [1e6 / count * statistics.median(r["publisher"] for r in results) for results in runs.values()]
        line(f"{case.label}, CPU us/post", cost[0], cost[1], ".2f")
        count = 500 if options.quick else 3000
        p50: dict[str, list[float]] = {"ours": [], "zmq": []}
        p99: dict[str, list[float]] = {"ours": [], "zmq": []}
        for _ in range(repeat):
            for system in runs:
                found = measure(system, case, count, paced=True)
                lost[system] += found["lost"]
                latencies = sorted(found["subscriber"])
                p50[system].append(1000 * percentile(latencies, 0.5))
                p99[system].append(1000 * percentile(latencies, 0.99))
        line(f"{case.label}, p50 ms", *(statistics.median(p50[s]) for s in runs), ".3f")
        line(f"{case.label}, p99 ms", *(statistics.median(p99[s]) for s in runs), ".3f")
    print(f"{'messages lost':30}{lost['ours']:14,}{lost['zmq']:14,}")
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump(figures, file, indent=2)


if __name__ == "__main__":
    main()
