"""Every app, and the database, in a process of its own, talking UDP.

This process only starts them, passes their words on, and starts again what failed if asked for. It
looks at the mission as one more client of the database.
"""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from pymoos_lite.core.clock import RealClock
from pymoos_lite.hosts.failures import Failure
from pymoos_lite.hosts.plan import CommunityPlan
from pymoos_lite.hosts.ports import PortError, RemoteClient
from pymoos_lite.hosts.realtime import RESTART_DELAY, HostOptions
from pymoos_lite.hosts.remote import DATABASE, READY, RemoteConnection

GOODBYE = 3.0
"""Wall seconds that processes are given to end in an orderly way before they are ended."""

DATABASE_START = 20.0
"""Wall seconds within which the database must say that it listens."""


@dataclass
class _Child:
    name: str
    process: subprocess.Popen[str]
    listener: threading.Thread


class ProcessHost:
    """Starts and watches the processes of one community; see the module.

    `mission` and `settings` are what the person typed: each process reads the mission itself.

    Raises:
        PortError: the database could not be started (port in use, for example).
    """

    def __init__(
        self,
        plan: CommunityPlan,
        options: HostOptions,
        mission: str,
        settings: Mapping[str, str],
        tell: Callable[[str], None] = print,
        clock: RealClock | None = None,
    ) -> None:
        self.plan = plan
        self.options = options
        self.clock = clock or RealClock(plan.warp)
        self.tell = tell
        self.failures: list[Failure] = []
        self._mission = mission
        self._settings = dict(settings)
        self._children: dict[str, _Child] = {}
        self._words: queue.SimpleQueue[tuple[str, str]] = queue.SimpleQueue()
        self._restarts: list[tuple[float, str]] = []
        self._connections: list[tuple[RemoteClient, RemoteConnection]] = []
        self.address = (options.bind, options.port)
        self._spawn(DATABASE)
        self.address = self._await_database()

    def pid(self, name: str) -> int:
        """Process id of an app, or of the database (``MOOSDB``).

        Raises:
            KeyError: no such process runs.
        """
        return self._children[name].process.pid

    def connect(self, name: str) -> RemoteConnection:
        """A connection of something in this process, such as a display; served by `turn`."""
        client = RemoteClient(name, *self.address, self.options.key, clock=self.clock)
        connection = RemoteConnection(client)
        self._connections.append((client, connection))
        return connection

    def start_apps(self) -> None:
        for app in self.plan.apps:
            self._spawn(app.name)

    def alive(self) -> bool:
        return bool(self._children.keys() - {DATABASE} or self._restarts)

    def turn(self, longest_wait: float = 0.2) -> None:
        """Serve the connections made here for up to `longest_wait` wall seconds; look after processes."""
        end = self.clock.wall() + longest_wait
        share = longest_wait / max(1, len(self._connections))
        for _, connection in self._connections:
            connection.collect(share)
        if not self._connections:
            self._rest(end - self.clock.wall())
        self._pass_words_on()
        self._look_after_children()

    def close(self) -> None:
        """End every process: apps first, in an orderly way, then the database."""
        self._restarts.clear()
        children = list(self._children.values())
        self._end([c for c in children if c.name != DATABASE])
        for client, _ in self._connections:
            client.close(0.2)
        self._connections.clear()
        self._end([c for c in children if c.name == DATABASE])
        self._pass_words_on()
        self._children.clear()

    # --- inside ------------------------------------------------------------------------------

    def _rest(self, seconds: float) -> None:
        try:
            self._words.put(self._words.get(timeout=max(0.0, seconds)))
        except queue.Empty:
            return

    def _spawn(self, name: str) -> None:
        host, port = self.address
        order = {
            "mission": self._mission,
            "settings": self._settings,
            "app": name,
            "host": host,
            "port": port,
            "warp": self.clock.warp,
            "key": self.options.key,
            "log_dir": str(self.options.log_dir) if self.options.log_dir else None,
            "seed": self.options.seed,
            "share_bind": self.options.share_bind,
        }
        process = subprocess.Popen(
            [sys.executable, "-m", "pymoos_lite.hosts.remote"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
        )
        assert process.stdin is not None
        process.stdin.write(json.dumps(order) + "\n")
        process.stdin.flush()
        listener = threading.Thread(target=self._listen, args=(name, process), daemon=True)
        self._children[name] = _Child(name, process, listener)
        listener.start()

    def _listen(self, name: str, process: subprocess.Popen[str]) -> None:
        # A thread per child: reading a pipe without blocking differs between platforms.
        assert process.stdout is not None
        for line in process.stdout:
            if line.strip():
                self._words.put((name, line.rstrip()))
        process.stdout.close()

    def _await_database(self) -> tuple[str, int]:
        end = self.clock.wall() + DATABASE_START
        said = []
        child = self._children[DATABASE]
        while self.clock.wall() < end:
            try:
                name, line = self._words.get(timeout=0.1)
            except queue.Empty:
                if child.process.poll() is not None and not child.listener.is_alive():
                    break
                continue
            if name == DATABASE and line.startswith(READY):
                return self.address[0], int(line.removeprefix(READY))
            said.append(line)
        self.close()
        raise PortError("; ".join(said) or "the database did not start")

    def _pass_words_on(self) -> None:
        while not self._words.empty():
            name, line = self._words.get()
            if not line.startswith(READY):
                self.tell(line if line.startswith(name) else f"{name}: {line}")

    def _look_after_children(self) -> None:
        for name, child in list(self._children.items()):
            status = child.process.poll()
            if status is None:
                continue
            child.listener.join(1.0)
            self._pass_words_on()
            del self._children[name]
            if status == 0 and name != DATABASE:
                continue
            how = f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
            failure = Failure(self.plan.community, name, "its process", how, f"pid {child.process.pid}", "")
            self.failures.append(failure)
            self.tell(str(failure))
            if self.options.restart:
                self._restarts.append((self.clock.wall() + RESTART_DELAY, name))
        for entry in [e for e in self._restarts if e[0] <= self.clock.wall()]:
            self._restarts.remove(entry)
            self._spawn(entry[1])
            self.tell(f"{entry[1]} was started again")

    def _end(self, children: list[_Child]) -> None:
        for child in children:
            if child.process.stdin is not None:
                child.process.stdin.close()  # the end of its input tells a process to end
        end = self.clock.wall() + GOODBYE
        for child in children:
            try:
                child.process.wait(max(0.05, end - self.clock.wall()))
            except subprocess.TimeoutExpired:
                child.process.kill()
                child.process.wait()
                self.tell(f"{child.name} did not end by itself within {GOODBYE:g} s")
            child.listener.join(1.0)
