"""The lockstep host: any number of communities in one process under virtual time.

Apps run as fast as the processor allows, one step at a time, in an order that depends on nothing
but their deadlines and the order in which they were added. Two runs with equal missions and seeds
are equal in every message.
"""

from __future__ import annotations

from bisect import insort
from collections.abc import Callable
from dataclasses import dataclass, field
from heapq import heappop, heappush
from pathlib import Path
from time import perf_counter
from zlib import crc32

from pymoos_lite.app import App, AppContext, AppRunner, Quit
from pymoos_lite.core.clock import VirtualClock
from pymoos_lite.core.database import Database
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.failures import Failure, describe_failure
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.network import SimulatedNetwork
from pymoos_lite.hosts.plan import CommunityPlan, warm_up


def launch_delay(community: str, app: str) -> float:
    """Seconds, less than one, after which an app of a fleet begins to tick.

    On the water no two apps tick in the same instant. If they all did, whatever takes several hops would
    just miss the next tick at each of them, and contacts would be half a second staler than they are. The
    names decide, so that nobody else in the fleet changes when an app ticks.
    """
    return crc32(f"{community} {app}".encode()) / 2.0**32


@dataclass
class Community:
    """A database and the apps around it."""

    name: str
    database: Database
    runners: list[AppRunner] = field(default_factory=list)
    mail_driven: list[AppRunner] = field(default_factory=list)
    mailboxes: list[list[Message]] = field(default_factory=list)
    """Those of the `mail_driven`, to see at a glance whether any of them has to be served."""

    def app(self, name: str) -> App:
        """The running app of that name.

        Raises:
            KeyError: there is none.
        """
        for runner in self.runners:
            if runner.name == name:
                return runner.app
        raise KeyError(name)


class Lockstep:
    """Runs communities in lockstep; see the module.

    `log_dir` is where loggers write; `seed` feeds every app's random numbers. `network` carries
    datagrams between communities, by default with little delay and no loss. With `stagger` the apps
    do not all tick in the same instant (see `launch_delay`), as those of a fleet never do.
    """

    def __init__(
        self,
        seed: int = 0,
        log_dir: Path | None = None,
        clock: VirtualClock | None = None,
        network: SimulatedNetwork | None = None,
        stagger: bool = False,
    ) -> None:
        self.stagger = stagger
        self.clock = clock or VirtualClock()
        self.network = network or SimulatedNetwork(self.clock, seed)
        self.seed = seed
        self.log_dir = log_dir
        self.communities: dict[str, Community] = {}
        self.failures: list[Failure] = []
        self.finished = False
        self.step_times: dict[str, list[float]] | None = None
        """For profiles: given a dictionary, seconds of every step by name of the app are put there."""
        # Sorted by deadline and order, both negative, so that the next is the last: taking it off costs nothing
        # and putting it back half the comparisons of a heap. There are some hundred apps, not millions.
        self._queue: list[tuple[float, int, Community, AppRunner]] = []
        self._order = 0
        self._over: Callable[[], bool] | None = None
        self._pokes: list[tuple[float, int, str, str, str | float]] = []
        self._running: dict[tuple[str, str], tuple[Community, AppRunner]] = {}

    # --- building ----------------------------------------------------------------------------

    def add_plan(self, plan: CommunityPlan) -> Community:
        """Add a community and all its apps, and start them.

        Raises:
            ValueError: a community of that name was added before.
        """
        warm_up(plan)
        community = self.add_community(plan.community or "community")
        names = tuple(plan.app_names)
        for app_plan in plan.apps:
            self.add_app(
                community,
                app_plan.cls,
                AppContext(
                    name=app_plan.name,
                    community=plan.community,
                    clock=self.clock,
                    connection=LocalConnection(community.database, app_plan.name, self.clock),
                    lines=app_plan.lines,
                    globals=plan.globals,
                    mission_file=plan.mission.file,
                    mission_dir=plan.mission_dir,
                    log_dir=self.log_dir,
                    seed=self.seed,
                    apps=names,
                    has_block=app_plan.has_block,
                    deterministic=True,
                    network=self.network.member(plan.community, app_plan.name),
                ),
            )
        return community

    def add_community(self, name: str) -> Community:
        """Add an empty community.

        Raises:
            ValueError: the name is taken.
        """
        if name in self.communities:
            raise ValueError(f"there are two communities named '{name}': give each its own Community line")
        community = Community(name, Database(name, self.clock.now()))
        self.communities[name] = community
        return community

    def add_app(self, community: Community, cls: type[App], context: AppContext) -> AppRunner | None:
        """Make and start an app; None (and an entry in `failures`) if it does not start."""
        try:
            runner = AppRunner(cls(context))
            delay = launch_delay(community.name, context.name) if self.stagger else 0.0
            runner.start(self.clock.now(), delay)
        except Exception as error:
            self._failed(community, context.name, error, "start-up")
            context.connection.close("failed")
            return None
        community.runners.append(runner)
        self._running[community.name, runner.name] = (community, runner)
        self._order += 1
        if runner.wakes_on_mail:
            community.mail_driven.append(runner)
            community.mailboxes.append(context.connection.mail)
        insort(self._queue, (-runner.next_deadline(), -self._order, community, runner))
        return runner

    def poke(self, at: float, name: str, value: str | float, community: str = "") -> None:
        """Post `name` = `value` at `at` mission seconds from the start, to one or all communities."""
        self._order += 1
        heappush(self._pokes, (self.clock.start + at, self._order, community, name, value))

    def end_when(self, over: Callable[[], bool]) -> None:
        """Make `run` stop early once `over()` is true; asked once per mission second."""
        self._over = over

    # --- running -----------------------------------------------------------------------------

    @property
    def elapsed(self) -> float:
        """Mission seconds since the start."""
        return self.clock.now() - self.clock.start

    def run(self, duration: float, progress: Callable[[float], None] | None = None) -> None:
        """Advance by `duration` mission seconds; `progress` hears of each whole second reached."""
        self.run_until(self.clock.now() + duration, progress)

    def run_until(self, end: float, progress: Callable[[float], None] | None = None) -> None:
        """Advance to mission time `end`; steps due exactly then are left for the next call."""
        queue = self._queue
        clock = self.clock
        next_progress = clock.now()
        pokes = self._pokes
        in_flight = self.network.in_flight
        time, advance_to = clock.now, clock.advance_to
        while not self.finished:
            when = -queue[-1][0] if queue else end
            if pokes and pokes[0][0] <= when and pokes[0][0] < end:
                self._release_pokes(max(when, clock.now()))
                continue
            if in_flight and in_flight[0][0] <= when and in_flight[0][0] < end:
                self._deliver()
                continue
            if when >= end or not queue:
                break
            now = time()
            if when > now:
                advance_to(when)
                now = when
            _, order, community, runner = queue.pop()
            # A mail-driven app may have moved its own deadline since it was queued.
            if runner.wakes_on_mail and runner.next_deadline() > when and not runner.app.connection.mail:
                insort(queue, (-runner.next_deadline(), order, community, runner))
                continue
            community.database.tick(now)
            try:
                self._run_step(runner, now)
            except Exception as error:
                self._ended(community, runner, error, now)
            else:
                due = runner.next_deadline() if runner.wakes_on_mail else runner.next_iteration
                insort(queue, (-due, order, community, runner))
            if any(community.mailboxes):
                self._serve_mail_driven(community, now)
            if now >= next_progress:
                next_progress = now + 1.0
                if progress is not None:
                    progress(now - clock.start)
                if self._over is not None and self._over():
                    return
        if not self.finished and clock.now() < end < float("inf"):
            clock.advance_to(end)

    def end_app(self, community: str, app: str) -> None:
        """End one app in an orderly way.

        Raises:
            KeyError: there is none of that name.
        """
        home, runner = self._running[community, app]
        self._unqueue(runner)
        self._finish(home, runner, self.clock.now())

    def kill(self, name: str) -> None:
        """End a community at once, as a power cut would: no app gets to say goodbye.

        A community of that name may be added again.

        Raises:
            KeyError: there is none.
        """
        community = self.communities.pop(name)
        gone = set(map(id, community.runners))
        self._queue[:] = [entry for entry in self._queue if id(entry[3]) not in gone]
        for runner in community.runners:
            self._running.pop((name, runner.name), None)
        self.network.close_community(name)

    def stop(self) -> None:
        """End every app in an orderly way."""
        now = self.clock.now()
        for community in self.communities.values():
            for runner in list(community.runners):
                self._finish(community, runner, now)
        self.finished = True

    # --- inside ------------------------------------------------------------------------------

    def _run_step(self, runner: AppRunner, now: float) -> None:
        if self.step_times is None:
            runner.step(now)
            return
        began = perf_counter()
        try:
            runner.step(now)
        finally:
            self.step_times.setdefault(runner.name, []).append(perf_counter() - began)

    def _step(self, community: Community, runner: AppRunner, now: float) -> bool:
        try:
            self._run_step(runner, now)
        except Exception as error:
            self._ended(community, runner, error, now)
            return False
        return True

    def _ended(self, community: Community, runner: AppRunner, error: Exception, now: float) -> None:
        """An app's step raised `error`: it is done, or has failed."""
        if isinstance(error, Quit):
            self._finish(community, runner, now)
        else:
            self._failed(community, runner.name, error, "iteration")
            self._remove(community, runner)

    def _serve_mail_driven(self, community: Community, now: float) -> None:
        # Bounded, so that two apps that answer each other's mail cannot stop time.
        for _ in range(100):
            idle = True
            for runner in community.mail_driven:
                if runner.app.connection.mail and runner.mail_due(now):
                    idle = False
                    if not self._step(community, runner, now):
                        self._unqueue(runner)
            if idle:
                return

    def _unqueue(self, runner: AppRunner) -> None:
        self._queue[:] = [entry for entry in self._queue if entry[3] is not runner]

    def _deliver(self) -> None:
        """Hand over the next datagram, and let the app it is for take it at once."""
        network, clock = self.network, self.clock
        now = max(network.in_flight[0][0], clock.now())
        clock.advance_to(now)
        found = self._running.get(network.deliver_next() or ("", ""))
        if found is None:
            return
        community, runner = found
        if not self._step(community, runner, now):
            self._unqueue(runner)
        if any(community.mailboxes):
            self._serve_mail_driven(community, now)

    def _release_pokes(self, now: float) -> None:
        when, _, target, name, value = heappop(self._pokes)
        when = max(when, self.clock.now())
        self.clock.advance_to(when)
        for community in self.communities.values():
            if target in ("", community.name):
                message = Message(name, value, when, "pymoos_poke", "", community.name)
                community.database.publish("pymoos_poke", message, when)
                if any(community.mailboxes):
                    self._serve_mail_driven(community, when)

    def _finish(self, community: Community, runner: AppRunner, now: float) -> None:
        try:
            runner.finish(now)
        except Exception as error:
            self._failed(community, runner.name, error, "quitting")
        self._remove(community, runner)

    def _remove(self, community: Community, runner: AppRunner) -> None:
        if runner in community.runners:
            community.runners.remove(runner)
        community.mail_driven = [r for r in community.mail_driven if r is not runner]
        community.mailboxes = [r.app.connection.mail for r in community.mail_driven]
        self._running.pop((community.name, runner.name), None)
        runner.app.close_ports()
        runner.app.connection.close("quit")

    def _failed(self, community: Community, name: str, error: BaseException, during: str) -> None:
        self.failures.append(describe_failure(community.name, name, error, during))
