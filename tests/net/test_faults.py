"""Faults among real processes: whoever is left goes on, and nothing is lost that need not be."""

from __future__ import annotations

import contextlib
import os
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from pymoos_lite.hosts.ports import free_port

PROGRAM = Path(__file__).with_name("town_process.py")
PATIENCE = 30.0


class Party:
    """A process that takes commands and gives reports."""

    def __init__(self, *arguments: object) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(PROGRAM), *map(str, arguments)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": str(PROGRAM.parents[2])},
            bufsize=1,
        )
        self.reports: queue.Queue[str] = queue.Queue()
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.reports.put(line.strip())

    def tell(self, command: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()

    def hear(self, start: str = "") -> str:
        """The next report that starts so."""
        end = time.monotonic() + PATIENCE
        while True:
            report = self.reports.get(timeout=max(0.01, end - time.monotonic()))
            if report.startswith(start):
                return report

    def ask(self, command: str) -> str:
        self.tell(command)
        return self.hear()

    @property
    def memory(self) -> int:
        return int(psutil.Process(self.process.pid).memory_info().rss)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()

    def end(self) -> None:
        self.process.kill()
        self.process.wait()
        self.reader.join()
        for stream in (self.process.stdin, self.process.stdout):
            assert stream is not None
            with contextlib.suppress(OSError):
                stream.close()


Start = Callable[..., Party]


@pytest.fixture
def start() -> Iterator[Start]:
    parties: list[Party] = []

    def starter(*arguments: object) -> Party:
        party = Party(*arguments)
        parties.append(party)
        return party

    yield starter
    for party in parties:
        party.end()


@pytest.fixture
def port() -> int:
    return free_port()


def start_database(start: Start, port: int, *rest: object) -> Party:
    database = start("db", port, *rest)
    database.hear("ready")
    return database


def test_a_killed_database_comes_back_and_nothing_posted_meanwhile_is_lost(start: Start, port: int) -> None:
    database = start_database(start, port)
    subs = [start("sub", f"sub{n}", port, "X") for n in range(2)]
    pub = start("pub", "pub", port)
    for party in (*subs, pub):
        party.hear("connected")
    for sub in subs:
        sub.tell("expect 1000")
    pub.tell("post 0 1000 10")
    for sub in subs:
        sub.hear("received 1000")
    # What was not acknowledged before the crash is posted again: the new database cannot know that it arrived.
    assert pub.ask("flush") == "posted"
    pub.hear("flushed")
    database.kill()
    pub.tell("post 1000 3000 10")
    pub.hear("posted")
    for party in (*subs, pub):
        party.hear("disconnected")
    start_database(start, port)
    for party in (*subs, pub):
        party.hear("connected")
    pub.tell("post 3000 4000 10")
    for sub in subs:
        sub.tell("expect 4000")
        sub.hear("received 4000")
        assert sub.ask("values") == " ".join(map(str, range(4000)))


def test_a_killed_app_is_missed_and_its_successor_admitted(start: Start, port: int) -> None:
    database = start_database(start, port)
    sub = start("sub", "sub", port, "DB_EVENT")
    sub.hear("connected")
    victim = start("pub", "victim", port)
    victim.hear("connected")
    victim.kill()
    end = time.monotonic() + PATIENCE
    while "victim" in database.ask("statistics"):
        assert time.monotonic() < end
        time.sleep(0.1)
    start("pub", "victim", port).hear("connected")
    assert database.ask("statistics") == "0 1 victim sub"
    assert "disconnected=victim,reason=silent" in sub.ask("values")
    assert sub.process.poll() is None


def test_the_second_app_of_a_name_is_refused_and_exits_with_an_error(start: Start, port: int) -> None:
    database = start_database(start, port)
    first = start("pub", "app", port)
    first.hear("connected")
    second = start("pub", "app", port)
    assert second.hear("refused") == 'refused A client of this name ("app") already exists'
    assert second.process.wait(PATIENCE) == 1
    first.tell("post 0 10 5")
    first.hear("posted")
    assert database.ask("statistics") == "0 0 app"


def test_a_closed_database_tells_its_clients_at_once(start: Start, port: int) -> None:
    database = start_database(start, port)
    sub = start("sub", "sub", port, "X")
    sub.hear("connected")
    began = time.monotonic()
    database.tell("close")
    sub.hear("disconnected")
    assert database.process.wait(PATIENCE) == 0
    assert time.monotonic() - began < 3.0  # less than the time after which silence is noticed


@pytest.mark.slow
def test_a_subscriber_that_stops_reading_harms_nobody_and_costs_bounded_memory(
    start: Start, port: int
) -> None:
    database = start_database(start, port, 16 << 20)
    deaf = start("deaf", "deaf", port, "X")
    deaf.hear("deaf now")
    fine = start("sub", "fine", port, "X")
    pub = start("pub", "pub", port)
    for party in (fine, pub):
        party.hear("connected")
    before = most = database.memory
    for n in range(0, 100_000, 2000):  # 100 MB, in steps that a reader can follow on a busy machine
        fine.tell(f"expect {n + 2000}")
        pub.tell(f"post {n} {n + 2000} 1000")
        fine.hear("received")
        most = max(most, database.memory)
    assert most - before < 60 << 20
    slow, silent, *others = database.ask("statistics").split()
    assert sorted((slow, silent)) == ["0", "1"]  # too slow, or too long silent
    assert sorted(others) == ["fine", "pub"]
    assert fine.ask("values") == " ".join(map(str, range(100_000)))
    deaf.tell("wake")
    deaf.hear("disconnected")
    deaf.hear("connected")
