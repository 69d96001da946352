"""Every app, and the database, in a process of its own, talking UDP.

This process only starts them, passes their words on, and starts again what failed if asked for. It
looks at the mission as one more client of the database.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from pymoos_lite.core.clock import RealClock
from pymoos_lite.hosts.children import Children, Exit, NotReadyError
from pymoos_lite.hosts.failures import Failure
from pymoos_lite.hosts.plan import CommunityPlan
from pymoos_lite.hosts.ports import PortError, RemoteClient
from pymoos_lite.hosts.realtime import RESTART_DELAY, HostOptions
from pymoos_lite.hosts.remote import DATABASE, RemoteConnection

PREDECESSOR = 8.0
"""Wall seconds that an app started again bears its name being in use: a killed one holds it for a while."""

DATABASE_START = 20.0
"""Wall seconds within which the database must say that it listens."""

_MODULE = "pymoos_lite.hosts.remote"


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
        self._children = Children(self.clock, tell)
        self._restarts: list[tuple[float, str]] = []
        self._connections: list[tuple[RemoteClient, RemoteConnection]] = []
        self.address = (options.bind, options.port)
        self._spawn(DATABASE)
        try:
            self.address = (options.bind, self._children.await_ready(DATABASE, DATABASE_START))
        except NotReadyError as error:
            self.close()
            raise PortError(str(error)) from None

    def pid(self, name: str) -> int:
        """Process id of an app, or of the database (``MOOSDB``).

        Raises:
            KeyError: no such process runs.
        """
        return self._children.pid(name)

    def connect(self, name: str) -> RemoteConnection:
        """A connection of something in this process, such as a display; served by `turn`."""
        client = RemoteClient(name, *self.address, self.options.key, clock=self.clock)
        connection = RemoteConnection(client)
        self._connections.append((client, connection))
        return connection

    def prepare(self) -> None:
        """Nothing: every process prepares itself."""

    def start_apps(self) -> None:
        for app in self.plan.apps:
            self._spawn(app.name)

    def alive(self) -> bool:
        return bool(set(self._children.names()) - {DATABASE} or self._restarts)

    def turn(self, longest_wait: float = 0.2) -> None:
        """Serve the connections made here for up to `longest_wait` wall seconds; look after processes."""
        end = self.clock.wall() + longest_wait
        share = longest_wait / max(1, len(self._connections))
        for _, connection in self._connections:
            connection.collect(share)
        if not self._connections:
            self._children.rest(end - self.clock.wall())
        for exit in self._children.exits():
            self._note(exit)
        for entry in [e for e in self._restarts if e[0] <= self.clock.wall()]:
            self._restarts.remove(entry)
            self._spawn(entry[1], patience=PREDECESSOR)
            self.tell(f"{entry[1]} was started again")

    def close(self) -> None:
        """End every process: apps first, in an orderly way, then the database.

        What the apps post while they quit still reaches the connections made here.
        """
        self._restarts.clear()
        self._children.end([name for name in self._children.names() if name != DATABASE], self._collect)
        self._collect()
        for client, _ in self._connections:
            client.close(0.2)
        self._connections.clear()
        self._children.end([DATABASE])

    # --- inside ------------------------------------------------------------------------------

    def _collect(self) -> None:
        for _, connection in self._connections:
            connection.collect(0.0)

    def _spawn(self, name: str, patience: float = 0.0) -> None:
        host, port = self.address
        order = {
            "mission": self._mission,
            "settings": self._settings,
            "app": name,
            "patience": patience,
            "host": host,
            "port": port,
            "warp": self.clock.warp,
            "key": self.options.key,
            "log_dir": str(self.options.log_dir) if self.options.log_dir else None,
            "seed": self.options.seed,
            "share_bind": self.options.share_bind,
        }
        self._children.spawn(name, _MODULE, order)

    def _note(self, exit: Exit) -> None:
        if exit.status == 0 and exit.name != DATABASE:
            return
        failure = Failure(self.plan.community, exit.name, "its process", str(exit), f"pid {exit.pid}", "")
        self.failures.append(failure)
        self.tell(str(failure))
        if self.options.restart:
            self._restarts.append((self.clock.wall() + RESTART_DELAY, exit.name))
