"""The real-time host: one community in one process, its database listening on UDP.

Apps run as tasks of one loop, each at its own deadline on the mission clock; clients elsewhere (apps
in processes of their own, scopes, pokes) come in over UDP. An app that raises is reported with its
last words and, if asked for, started again; the others do not notice.
"""

from __future__ import annotations

import heapq
import selectors
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pymoos_lite.app import AppContext, AppRunner, Connection, Network, Quit
from pymoos_lite.core.clock import RealClock
from pymoos_lite.core.database import Database
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.failures import Failure, describe_failure
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.meter import ProcessMeter
from pymoos_lite.hosts.network_report import NetworkReport
from pymoos_lite.hosts.plan import AppPlan, CommunityPlan, warm_up
from pymoos_lite.hosts.ports import LOOPBACK, DatabaseServer
from pymoos_lite.hosts.udp import UdpNetwork, UdpPort

RESTART_DELAY = 1.0
"""Wall seconds before an app that failed is started again."""

LONGEST_WAIT = 0.2
"""Wall seconds after which the loop looks around even if nothing is due."""


@dataclass(frozen=True)
class HostOptions:
    """How a community is hosted.

    `bind` is the address the database listens on (loopback unless told otherwise), `port` 0 means any
    free one; `key` is the community key; `restart` starts failed apps again; `seed` None means
    different random numbers in every run. `share_bind` is where bridges to other communities listen.
    """

    bind: str = LOOPBACK
    port: int = 0
    key: str | None = None
    log_dir: Path | None = None
    restart: bool = False
    seed: int | None = None
    share_bind: str = LOOPBACK


class RealtimeHost:
    """Runs one community in real time; see the module.

    `tell` hears of failures and restarts, one line each. Raises OSError if the port cannot be had.
    """

    def __init__(
        self,
        plan: CommunityPlan,
        options: HostOptions,
        clock: RealClock | None = None,
        tell: Callable[[str], None] = print,
    ) -> None:
        self.plan = plan
        self.options = options
        self.clock = clock or RealClock(plan.warp)
        self.tell = tell
        self.database = Database(plan.community, self.clock.now())
        self.server = DatabaseServer(self.database, self.clock, options.bind, options.port, key=options.key)
        self.failures: list[Failure] = []
        self.runners: dict[str, AppRunner] = {}
        self._queue: list[tuple[float, int, AppRunner]] = []
        self._restarts: list[tuple[float, AppPlan]] = []
        self._order = 0
        self._selector = selectors.DefaultSelector()
        self._selector.register(self.server, selectors.EVENT_READ)
        self._network = UdpNetwork(options.share_bind, self._watch, self._unwatch)
        self._meter = ProcessMeter()
        self._network_report = NetworkReport()

    @property
    def address(self) -> tuple[str, int]:
        """Where the database listens."""
        return self.server.address

    @property
    def port(self) -> int:
        """The UDP port that the database listens on."""
        return self.address[1]

    def connect(self, name: str) -> LocalConnection:
        """A connection of something in this process, such as a display.

        Raises:
            NameClashError: the name is in use.
        """
        return LocalConnection(self.database, name, self.clock)

    # --- apps --------------------------------------------------------------------------------

    def prepare(self) -> None:
        """Compile or load what apps need, before the mission's time begins."""
        warm_up(self.plan)

    def start_apps(self) -> None:
        """Start every app of the plan in this process."""
        for app in self.plan.apps:
            self.start_app(app)

    def start_app(self, app: AppPlan) -> AppRunner | None:
        """Start one app here; None (and an entry in `failures`) if it does not start."""
        try:
            connection = self.connect(app.name)
        except Exception as error:
            self._failed(app.name, error, "connecting")
            return None
        try:
            runner = AppRunner(app.cls(self.context(app, connection)), self._meter)
        except Exception as error:
            connection.close("failed in start-up")
            self._failed(app.name, error, "start-up")
            return None
        try:
            runner.start(self.clock.now())
        except Exception as error:
            runner.app.close_ports()
            connection.close("failed in start-up")
            self._failed(app.name, error, "start-up")
            return None
        self.runners[app.name] = runner
        self._order += 1
        heapq.heappush(self._queue, (runner.next_deadline(), self._order, runner))
        return runner

    def context(self, app: AppPlan, connection: LocalConnection) -> AppContext:
        """What the app is handed."""
        return make_context(self.plan, app, connection, self.clock, self.options, self._network)

    def alive(self) -> bool:
        """Whether any app runs or is about to be started again."""
        return bool(self.runners or self._restarts)

    # --- the loop ----------------------------------------------------------------------------

    def turn(self, longest_wait: float = LONGEST_WAIT) -> None:
        """Wait for whatever comes first (datagram, deadline, `longest_wait` in wall seconds) and serve it."""
        wait = min(longest_wait, self._wall_until_due())
        if self._selector.select(max(0.0, wait)):
            self._serve_network()
        self._serve_apps()
        self._report_network()
        self.server.flush()

    def run(self, until: Callable[[], bool]) -> None:
        """Turn until `until()` is true."""
        while not until():
            self.turn()

    def close(self) -> None:
        """End every app in an orderly way, tell remote clients, free the port."""
        for name in list(self.runners):
            self._finish(self.runners[name])
        self._selector.close()
        self.server.close()

    # --- inside ------------------------------------------------------------------------------

    def _wall_until_due(self) -> float:
        clock = self.clock
        now, wall = clock.now(), clock.wall()
        due = self._queue[0][0] if self._queue else float("inf")
        wait = min((due - now) / clock.warp, self.server.next_deadline() - wall)
        for when, _ in self._restarts:
            wait = min(wait, when - wall)
        return wait

    def _serve_network(self) -> None:
        self.server.take_in()
        self._wake_mail_driven()

    def _report_network(self) -> None:
        variable, news = self._network_report.look(self.server.session.statistics, self.clock.wall())
        if variable is not None:
            now, name = self.clock.now(), self.database.name
            message = Message("DB_NETWORK", variable, now, name, "", self.plan.community)
            self.database.publish(name, message, now)
        if news is not None:
            self.tell(news)

    def _serve_apps(self) -> None:
        wall = self.clock.wall()
        for entry in [e for e in self._restarts if e[0] <= wall]:
            self._restarts.remove(entry)
            if self.start_app(entry[1]) is not None:
                self.tell(f"{entry[1].name} was started again")
        # Every app that is due gets one step, then the network is looked at again.
        due: list[tuple[float, int, AppRunner]] = []
        now = self.clock.now()
        while self._queue and self._queue[0][0] <= now:
            due.append(heapq.heappop(self._queue))
        for _, order, runner in due:
            if self.runners.get(runner.name) is runner and self._step(runner):
                heapq.heappush(self._queue, (runner.next_deadline(), order, runner))
        if due:
            self._wake_mail_driven()

    def _wake_mail_driven(self) -> None:
        for runner in list(self.runners.values()):
            if (runner.wakes_on_mail or runner.app.ports) and runner.has_input(self.clock.now()):
                self._step(runner)

    def _watch(self, port: UdpPort) -> None:
        self._selector.register(port, selectors.EVENT_READ)

    def _unwatch(self, port: UdpPort) -> None:
        self._selector.unregister(port)

    def _step(self, runner: AppRunner) -> bool:
        try:
            runner.step(self.clock.now())
        except Quit:
            self._finish(runner)
            return False
        except Exception as error:
            self.runners.pop(runner.name, None)
            runner.app.close_ports()
            runner.app.connection.close("failed")
            self._failed(runner.name, error, "iteration")
            return False
        return True

    def _finish(self, runner: AppRunner) -> None:
        self.runners.pop(runner.name, None)
        try:
            runner.finish(self.clock.now())
        except Exception as error:
            self._failed(runner.name, error, "quitting")
        runner.app.connection.close("quit")

    def _failed(self, name: str, error: BaseException, during: str) -> None:
        failure = describe_failure(self.plan.community, name, error, during)
        self.failures.append(failure)
        self.tell(str(failure))
        if self.options.restart and during != "quitting":
            for app in self.plan.apps:
                if app.name == name:
                    self._restarts.append((self.clock.wall() + RESTART_DELAY, app))


def make_context(
    plan: CommunityPlan,
    app: AppPlan,
    connection: Connection,
    clock: RealClock,
    options: HostOptions,
    network: Network,
) -> AppContext:
    """The context of `app` in a real-time host, in whichever process it lives."""
    return AppContext(
        name=app.name,
        community=plan.community,
        clock=clock,
        connection=connection,
        lines=app.lines,
        globals=plan.globals,
        mission_file=plan.mission.file,
        mission_dir=plan.mission_dir,
        log_dir=options.log_dir,
        seed=options.seed,
        apps=tuple(plan.app_names),
        has_block=app.has_block,
        network=network,
    )
