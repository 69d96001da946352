"""One app in a process of its own, talking UDP to its community's database.

Started by `launch --processes` as ``python -m pymoos_lite.hosts.remote``; the description of what to
run comes in on stdin, and the end of stdin means that the launcher is gone or wants the app to end.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from pymoos_lite.app import AppContext, AppRunner, Quit
from pymoos_lite.core.client_session import (
    ClientLimits,
    Disconnected,
    QueueFull,
    Refused,
    Warned,
    WriteRefused,
)
from pymoos_lite.core.clock import RealClock
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.children import ENDING, READY
from pymoos_lite.hosts.failures import describe_failure
from pymoos_lite.hosts.meter import ProcessMeter
from pymoos_lite.hosts.mission import load_plan
from pymoos_lite.hosts.plan import AppPlan, CommunityPlan
from pymoos_lite.hosts.ports import RemoteClient
from pymoos_lite.hosts.realtime import HostOptions, RealtimeHost, make_context
from pymoos_lite.hosts.udp import UdpNetwork

DATABASE = "MOOSDB"
"""The name under which the database is one of the processes."""

REFUSED_STATUS = 3
FAILED_STATUS = 1
LONGEST_WAIT = 0.2
SIGN_PERIOD = 0.5
"""Wall seconds between two looks at whether a process that is ending does anything."""

SIGN_OF_WORK = 0.005
"""Processor seconds between two signs of life: this watch alone uses far less."""


class RefusedError(Exception):
    """The database does not take this client; the text says why."""


class RemoteConnection:
    """An app's connection to a database in another process.

    Posts made while disconnected are kept, up to the session's stated bound, and delivered afterwards.
    """

    def __init__(self, client: RemoteClient) -> None:
        self._client = client
        self._name = client.session.name
        self.mail: list[Message] = []
        self.notices: list[str] = []
        self._published: dict[str, None] = {}
        self._registered: dict[str, None] = {}
        self.refused: str | None = None

    @property
    def connected(self) -> bool:
        return self._client.connected

    def publish(self, message: Message) -> bool:
        if message.source == self._name and message.community in ("", self._client.community):
            taken = self._client.notify(message.name, message.value, message.time, message.aux)
        else:
            taken = self._client.relay(message)
        if taken:
            self._published[message.name] = None
        return taken

    def publish_numbers(self, posts: Iterable[tuple[str, float]], now: float, source: str) -> None:
        for name, value in posts:
            self.publish(Message(name, float(value), now, source))

    def register(self, pattern: str, source: str, interval: float, omit: tuple[str, ...]) -> None:
        self._registered[pattern] = None
        self._client.register(pattern, interval, source, omit)

    def unregister(self, pattern: str) -> None:
        self._registered.pop(pattern, None)
        self._client.unregister(pattern)

    def collect(self, timeout: float) -> None:
        """Move datagrams and fetch mail and news; waits up to `timeout` wall seconds for mail."""
        self.mail += self._client.poll(timeout)
        for event in self._client.take_events():
            if isinstance(event, Refused):
                self.refused = event.reason
            elif isinstance(event, WriteRefused):
                times = f" ({event.count} times)" if event.count > 1 else ""
                self.notices.append(f"{event.reason}{times}")
            elif isinstance(event, QueueFull):
                self.notices.append(
                    f"{event.waiting} posts wait for the database: further ones are refused until it answers"
                )
            elif isinstance(event, Warned):
                self.notices.append(event.text)
            elif isinstance(event, Disconnected):
                self.notices.append(f"connection to the database lost: {event.reason}")

    def take_mail(self) -> list[Message]:
        mail, self.mail = self.mail, []
        return mail

    def published_names(self) -> tuple[str, ...]:
        return tuple(self._published)

    def registered_names(self) -> tuple[str, ...]:
        return tuple(self._registered)

    def wanted(self, name: str) -> bool:
        return True  # only the database knows

    def take_notices(self) -> list[str]:
        notices, self.notices = self.notices, []
        return notices

    def close(self, reason: str = "") -> None:
        """Deliver what waits, then leave the community."""
        self._client.close()


class RemoteHost:
    """Runs one app against a database at `address` until it quits, fails, is refused or is told to end."""

    def __init__(
        self,
        app: AppPlan,
        make: Callable[[RemoteConnection], AppContext],
        address: tuple[str, int],
        clock: RealClock,
        key: str | None = None,
        patience: float = 0.0,
    ) -> None:
        self.clock = clock
        limits = ClientLimits(clash_patience=patience)
        self.client = RemoteClient(app.name, *address, key, clock=clock, limits=limits)
        self.connection = RemoteConnection(self.client)
        self.stopping = False
        self._make = make
        self._app = app

    def stop(self) -> None:
        """Ask `run` to end the app in an orderly way; may be called from another thread."""
        self.stopping = True

    def run(self) -> None:
        """Raises RefusedError, or whatever the app raised."""
        self._app.cls.warm_up()
        context = self._make(self.connection)
        runner = AppRunner(self._app.cls(context), ProcessMeter())
        runner.start(self.clock.now())
        try:
            while not self.stopping:
                self._turn(runner)
        except Quit:
            pass
        finally:
            runner.finish(self.clock.now())
            # What was posted last should still arrive: closing waits for it, briefly.
            self.client.close()

    def _turn(self, runner: AppRunner) -> None:
        clock = self.clock
        wait = max(0.0, min((runner.next_deadline() - clock.now()) / clock.warp, LONGEST_WAIT))
        if runner.app.ports:
            self._wait_for_any(runner, wait)
            wait = 0.0
        self.connection.collect(wait)
        if self.connection.refused is not None:
            raise RefusedError(self.connection.refused)
        now = clock.now()
        if runner.next_deadline() <= now or runner.has_input(now):
            runner.step(now)
            self.client.flush()

    def _wait_for_any(self, runner: AppRunner, wait: float) -> None:
        """Wait for mail or for a datagram at one of the app's own ports."""
        waited_for: list[Any] = [self.client, *runner.app.ports]
        until = min(wait, self.client.next_deadline() - self.clock.wall())
        select.select(waited_for, [], [], max(0.0, until))


def run_app(
    plan: CommunityPlan,
    app: AppPlan,
    options: HostOptions,
    address: tuple[str, int],
    clock: RealClock,
    patience: float = 0.0,
) -> RemoteHost:
    """A host for one app of `plan` against the database at `address`.

    For `patience` wall seconds a name in use is no refusal: a killed predecessor may still hold it.

    Raises:
        PortError: the host is unknown.
    """
    return RemoteHost(
        app,
        lambda connection: make_context(
            plan, app, connection, clock, options, UdpNetwork(options.share_bind)
        ),
        address,
        clock,
        options.key,
        patience,
    )


def main() -> int:
    """Entry point of the child process; returns its exit status."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C is the launcher's business
    order = json.loads(sys.stdin.readline())
    name = order["app"]
    plan = load_plan(order["mission"], order["settings"])
    clock = RealClock(order["warp"])
    options = HostOptions(
        bind=order["host"],
        port=order["port"],
        key=order["key"],
        log_dir=Path(order["log_dir"]) if order["log_dir"] else None,
        seed=order["seed"],
        share_bind=order["share_bind"],
    )
    try:
        if name == DATABASE:
            return _serve_database(RealtimeHost(plan, options, clock, _say))
        app = next(a for a in plan.apps if a.name == name)
        host = run_app(plan, app, options, (order["host"], order["port"]), clock, order["patience"])
        stop_with_stdin(host.stop)
        host.run()
    except RefusedError as refusal:
        print(f"{name}: refused by the database: {refusal}", file=sys.stderr, flush=True)
        return REFUSED_STATUS
    except Exception as error:
        print(describe_failure(plan.community, name, error, "its process"), file=sys.stderr, flush=True)
        return FAILED_STATUS
    return 0


def _say(text: str) -> None:
    print(text, flush=True)


def _serve_database(host: RealtimeHost) -> int:
    print(f"{READY}{host.port}", flush=True)
    ended = threading.Event()
    stop_with_stdin(ended.set)
    host.run(ended.is_set)
    host.close()
    return 0


def stop_with_stdin(stop: Callable[[], None]) -> None:
    """Call `stop`, in a thread of its own, when stdin ends: the launcher wants us to end, or is gone.

    From then on the launcher is told, as long as this process uses the processor, that it is still ending.
    """

    def wait() -> None:
        while sys.stdin.readline():
            pass
        stop()
        used = -1.0
        while True:
            now = time.process_time()
            if now - used >= SIGN_OF_WORK:
                used = now
                _say_past_buffers(ENDING)
            time.sleep(SIGN_PERIOD)

    # A thread, because no other way of waiting for a pipe works on every platform.
    threading.Thread(target=wait, name="launcher-watch", daemon=True).start()


def _say_past_buffers(text: str) -> None:
    """Print a line without the lock of stdout, which a thread must not hold while the program exits."""
    with contextlib.suppress(OSError):  # nobody listens any more
        os.write(1, f"{text}\n".encode())


if __name__ == "__main__":
    sys.exit(main())
