"""One party of a community as a process of its own, for the tests with real faults.

``python town_process.py db PORT [mail_bytes]``, ``... pub NAME PORT``, ``... sub NAME PORT VARIABLE``,
``... deaf NAME PORT VARIABLE``. Commands come in on stdin, one line each; reports go to stdout.
"""

from __future__ import annotations

import os
import queue
import sys
import threading

from pymoos_lite.core.client_session import Connected, Disconnected, Refused
from pymoos_lite.core.clock import RealClock
from pymoos_lite.core.database import Database
from pymoos_lite.core.server_session import ServerLimits
from pymoos_lite.hosts.ports import DatabaseServer, RemoteClient

commands: queue.Queue[str] = queue.Queue()


def listen() -> None:
    for line in sys.stdin:
        commands.put(line.strip())
    os._exit(0)  # whoever started this has gone


def report(*words: object) -> None:
    print(*words, flush=True)


def run_database(port: int, mail_bytes: int = 64 << 20) -> None:
    clock = RealClock()
    # Posts wait longer for returning readers than by default: on a machine that is busy with other tests
    # a reader may need more than two seconds to come back.
    limits = ServerLimits(mail_bytes=mail_bytes, gathering=8.0)
    server = DatabaseServer(Database("alpha", clock.now()), clock, port=port, limits=limits)
    report("ready", server.address[1])
    while True:
        server.pump(0.1)
        while not commands.empty():
            word = commands.get()
            if word == "close":
                server.close()
                return
            if word == "statistics":
                statistics = server.session.statistics
                report(statistics.slow, statistics.silent, *server.database.clients())


def tell_events(client: RemoteClient) -> None:
    for event in client.take_events():
        if isinstance(event, Refused):
            report("refused", event.reason)
            sys.exit(1)
        if isinstance(event, Connected | Disconnected):
            report(type(event).__name__.lower())


def run_publisher(name: str, port: int) -> None:
    """``post FROM TO SIZE``: post numbers as text of a size; ``flush``: until all is acknowledged."""
    client = RemoteClient(name, port=port)
    while True:
        client.poll(0.02)
        tell_events(client)
        while not commands.empty():
            word, *rest = commands.get().split()
            if word == "post":
                first, last, size = map(int, rest)
                for n in range(first, last):
                    while not client.notify("X", str(n).ljust(size)):
                        client.flush(0.01)
                report("posted")
            elif word == "flush":
                while not client.flush(0.5):
                    pass
                report("flushed")
            elif word == "close":
                client.close()
                return


def run_subscriber(name: str, port: int, variable: str) -> None:
    """``expect N``: report once N messages have come; ``values``: the numbers received."""
    client = RemoteClient(name, port=port)
    client.register(variable)
    got: list[str] = []
    expected = 0
    while True:
        got += [str(m.value).strip() for m in client.poll(0.02) if m.name == variable]
        tell_events(client)
        while not commands.empty():
            word, *rest = commands.get().split()
            if word == "expect":
                expected = int(rest[0])
            elif word == "values":
                report(*got)
            elif word == "close":
                client.close()
                return
        if expected and len(got) >= expected:
            report("received", len(got))
            expected = 0


def run_deaf(name: str, port: int, variable: str) -> None:
    """Subscribes and then never reads again, until told ``wake``."""
    client = RemoteClient(name, port=port)
    client.register(variable)
    while not (client.connected and client.flush(0.1)):
        client.poll(0.02)
    report("deaf now")
    while commands.get() != "wake":
        pass
    while True:
        client.poll(0.02)
        tell_events(client)


if __name__ == "__main__":
    threading.Thread(target=listen, daemon=True).start()
    role, *arguments = sys.argv[1:]
    if role == "db":
        run_database(*map(int, arguments))
    elif role == "pub":
        run_publisher(arguments[0], int(arguments[1]))
    elif role == "sub":
        run_subscriber(arguments[0], int(arguments[1]), arguments[2])
    else:
        run_deaf(arguments[0], int(arguments[1]), arguments[2])
