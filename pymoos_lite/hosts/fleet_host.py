"""A fleet in real time: every community in a process of its own, on this machine.

This process starts them, passes their words on and looks at the fleet as one more client of the
shoreside's database.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from pymoos_lite.config.fleet_file import FleetFile
from pymoos_lite.core.clock import RealClock
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.children import GOODBYE, Children, Exit, NotReadyError
from pymoos_lite.hosts.failures import Failure
from pymoos_lite.hosts.fleet import FleetPlan, Member, customary_ports
from pymoos_lite.hosts.plan import warm_up
from pymoos_lite.hosts.ports import PortError, RemoteClient, UdpEndpoint
from pymoos_lite.hosts.realtime import RESTART_DELAY, HostOptions
from pymoos_lite.hosts.remote import RemoteConnection

START_TIMEOUT = 60.0
"""Wall seconds within which a community must be up: many starting together on few cores take their time."""

GOODBYE_PER_MEMBER = 1.0
"""Wall seconds more for each community that has to end: they all do so at once, on few cores."""

START_PER_MEMBER = 5.0
"""Wall seconds more for each community that has to start."""

STEP_BETWEEN_TRIES = 10
TRIES = 50
_MODULE = "pymoos_lite.hosts.member"


def free_ports(fleet: FleetFile, bind: str) -> dict[str, tuple[int, int]]:
    """Database and share ports, by community, that are all free now: the customary ones if they are.

    Raises:
        PortError: the fleet file asks for ports that are in use, or no free range was found.
    """
    chosen = customary_ports(fleet)
    fixed = fleet.database_port is not None or fleet.share_port is not None
    for step in range(1 if fixed else TRIES):
        shift = step * max(STEP_BETWEEN_TRIES, len(chosen))
        ports = {name: (database + shift, share + shift) for name, (database, share) in chosen.items()}
        taken = [port for pair in ports.values() for port in pair if not _is_free(bind, port)]
        if not taken:
            return ports
    raise PortError(
        f"port {taken[0]} is in use" if fixed else f"no free range of {2 * len(chosen)} ports was found"
    )


def _is_free(bind: str, port: int) -> bool:
    try:
        UdpEndpoint(bind, port).close()
    except PortError:
        return False
    return True


class FleetHost:
    """Runs a planned fleet; see the module. `tell` hears of failures, restarts and what processes print.

    `seed` of the options feeds each community's random numbers, together with its name.
    """

    def __init__(
        self,
        plan: FleetPlan,
        folder: Path,
        options: HostOptions,
        settings: Mapping[str, str],
        clock: RealClock,
        tell: Callable[[str], None] = print,
    ) -> None:
        self.plan = plan
        self.options = options
        self.clock = clock
        self.tell = tell
        self.failures: list[Failure] = []
        self._folder = folder
        self._settings = dict(settings)
        self._children = Children(clock, tell, GOODBYE + GOODBYE_PER_MEMBER * len(plan.members))
        self._restarts: list[tuple[float, str]] = []
        self._members = {member.name: member for member in plan.members}
        self._client: RemoteClient | None = None
        self._connection: RemoteConnection | None = None

    def start(self, names: Sequence[str] | None = None) -> None:
        """Start every community, or those named in that order, and wait until they are up.

        Raises:
            PortError: a community could not be started; none is left running.
        """
        wanted = list(self._members) if names is None else names
        # Compiled once here, the numerics are only loaded there: not by all at the same time.
        for name in wanted:
            warm_up(self._members[name].plan)
        timeout = START_TIMEOUT + START_PER_MEMBER * len(wanted)
        try:
            for name in wanted:
                self._spawn(self._members[name])
            for name in wanted:
                self._children.await_ready(name, timeout)
        except NotReadyError as error:
            self.close()
            raise PortError(str(error)) from None

    def pid(self, name: str) -> int:
        """Process id of a community; raises KeyError if it does not run."""
        return self._children.pid(name)

    def running(self) -> list[str]:
        """Names of the communities that run."""
        return self._children.names()

    def address_of(self, name: str) -> tuple[str, int]:
        """Where the database of a community listens."""
        return self.options.bind, self._children.port(name) or self._members[name].plan.port

    def connect(self, name: str) -> RemoteConnection:
        """A connection to the shoreside's database (or the only community's); served by `turn`."""
        member = self.plan.shoreside or self.plan.members[0]
        host, port = self.address_of(member.name)
        self._client = RemoteClient(name, host, port, self.options.key, clock=self.clock)
        self._connection = RemoteConnection(self._client)
        return self._connection

    def post(self, name: str, value: str | float) -> None:
        """Post to the database that `connect` connected to."""
        if self._connection is not None:
            self._connection.publish(Message(name, value, self.clock.now(), self._client_name()))

    def turn(self, longest_wait: float = 0.2) -> None:
        """Serve the connection for up to `longest_wait` wall seconds; look after processes."""
        if self._connection is not None:
            self._connection.collect(longest_wait)
        else:
            self._children.rest(longest_wait)
        for exit in self._children.exits():
            self._note(exit)
        for entry in [e for e in self._restarts if e[0] <= self.clock.wall()]:
            self._restarts.remove(entry)
            self._spawn(self._members[entry[1]])
            self.tell(f"{entry[1]} was started again")

    def alive(self) -> bool:
        return bool(self._children.names() or self._restarts)

    def kill(self, name: str) -> None:
        """End a community at once, as a power cut would; raises KeyError if it does not run."""
        self._children.kill(name)

    def stop(self, name: str) -> None:
        """End one community in an orderly way."""
        self._children.end([name])

    def replace(self, member: Member) -> None:
        """Use another plan for the community of that name when it is started next."""
        self._members[member.name] = member

    def close(self) -> None:
        """End every community in an orderly way: vehicles first.

        What is posted meanwhile at the shoreside, to its very end, still reaches the connection.
        """
        self._restarts.clear()
        shore = self.plan.shoreside
        names = self._children.names()
        self._children.end([name for name in names if shore is None or name != shore.name], self._collect)
        self._children.end(
            [name for name in names if shore is not None and name == shore.name], self._collect
        )
        self._collect()
        if self._client is not None:
            with contextlib.suppress(OSError):
                self._client.close(0.0)

    # --- inside ------------------------------------------------------------------------------

    def _collect(self) -> None:
        if self._connection is not None:
            self._connection.collect(0.0)

    def _client_name(self) -> str:
        assert self._client is not None
        return self._client.session.name

    def _spawn(self, member: Member) -> None:
        options = self.options
        order = {
            "files": {kind: str(path) for kind, path in member.files.items()},
            "folder": str(self._folder),
            "settings": self._settings,
            "bind": options.bind,
            "port": member.plan.port,
            "key": options.key,
            "log_dir": str(options.log_dir) if options.log_dir else None,
            "restart": options.restart,
            "seed": options.seed,
            "share_bind": options.share_bind,
            "warp": self.clock.warp,
        }
        self._children.spawn(member.name, _MODULE, order)

    def _note(self, exit: Exit) -> None:
        failure = Failure(self.plan.fleet.name, exit.name, "its process", str(exit), f"pid {exit.pid}", "")
        self.failures.append(failure)
        self.tell(str(failure))
        if self.options.restart:
            self._restarts.append((self.clock.wall() + RESTART_DELAY, exit.name))
