"""The base class of every app.

An app declares its parameters, then fills in some of five hooks:

    on_start_up   once, with its configuration bound: build what it needs
    on_connect    each time the community is reached: register for mail
    on_mail       all mail since the last time, as one list
    iterate       AppTick times per mission second
    report        lines for a person, when somebody is looking

It talks only through `notify`, `register` and `unregister`, reads time only from `now`, and cannot
tell which host it runs in.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar, Final, Protocol

from mypy_extensions import mypyc_attr

from pymoos_lite.app.network import DatagramPort, Datagrams, Network
from pymoos_lite.app.reporting import ReportLog
from pymoos_lite.app.standard import STANDARD_PARAMETERS
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.config.parameters import Declaration, Values
from pymoos_lite.config.problems import Problem
from pymoos_lite.core.clock import Clock
from pymoos_lite.core.message import Message, as_value

_new_tuple: Final = tuple.__new__  # what Message(...) does, in a third of the time


class Quit(Exception):
    """Raised by an app that is done; its host ends it without calling that a failure."""


class Connection(Protocol):
    """An app's way to its community, given by the host."""

    @property
    def connected(self) -> bool: ...

    @property
    def mail(self) -> list[Message]:
        """Mail that waits, in order of arrival; whoever takes it clears the list."""
        ...

    @property
    def notices(self) -> list[str]:
        """Notices that wait, to look at: `take_notices` takes them."""
        ...

    def publish(self, message: Message, /) -> bool:
        """Post; False when it was refused (the app is told of the reason in `take_notices`)."""
        ...

    def publish_numbers(self, posts: Iterable[tuple[str, float]], now: float, source: str, /) -> None:
        """Post several (name, number) of time `now` by `source`; refusals as in `publish`."""
        ...

    def register(self, pattern: str, source: str, interval: float, omit: tuple[str, ...]) -> None: ...

    def unregister(self, pattern: str) -> None: ...

    def take_mail(self) -> list[Message]:
        """All mail since the last call, in order of arrival."""
        ...

    def published_names(self) -> tuple[str, ...]:
        """Variables this client has posted so far."""
        ...

    def registered_names(self) -> tuple[str, ...]:
        """Names and patterns this client is registered for."""
        ...

    def wanted(self, name: str) -> bool:
        """Whether anybody hears posts of `name`; True where that cannot be known."""
        ...

    def close(self, reason: str = "") -> None:
        """Leave the community."""
        ...

    def take_notices(self) -> list[str]:
        """Refused writes and other things the community had to say to this client."""
        ...


@dataclass
class AppContext:
    """What a host hands to an app.

    `lines` is the app's own block, `globals` the lines outside blocks (keys in lower case). `seed`
    feeds the app's random numbers; equal seeds give equal runs. `mission_dir` is where relative
    file names in the configuration are looked up; `log_dir` is where logs go by default.
    """

    name: str
    community: str
    clock: Clock
    connection: Connection
    lines: Sequence[ConfigLine] = ()
    globals: Mapping[str, str] = field(default_factory=dict)
    mission_file: str = ""
    mission_dir: Path = field(default_factory=Path)
    log_dir: Path | None = None
    seed: int | None = None
    apps: Sequence[str] = ()
    has_block: bool = True
    deterministic: bool = False
    """True in lockstep: nothing that differs between two equal runs may be posted."""
    network: Network | None = None
    """The way to other communities; None where a host offers none."""


@mypyc_attr(allow_interpreted_subclasses=True)
class App:
    """Base of all apps; see the module for the life cycle."""

    PARAMETERS: ClassVar[Declaration] = Declaration()
    DEFAULT_TICK: ClassVar[float] = 4.0
    BLOCK_OPTIONAL: ClassVar[bool] = False
    """True for apps that need no ProcessConfig block; others get a configuration warning."""
    MAIL_DRIVEN: ClassVar[bool] = False
    """True for apps that must not let mail wait for the next tick: iterate mode 2, unless configured."""

    def __init__(self, context: AppContext) -> None:
        self.context = context
        self.name = context.name
        self.community = context.community
        self.clock = context.clock
        self.connection = context.connection
        self.log = ReportLog()
        self.iteration = 0
        self.ports: list[DatagramPort] = []
        self.random = random.Random(
            None if context.seed is None else f"{context.seed}:{context.community}:{context.name}"
        )
        bound = (STANDARD_PARAMETERS + type(self).PARAMETERS).bind(
            context.lines, context.name, context.mission_file
        )
        self.config: Values = bound.values
        self.given = bound.given
        self.extra_lines = bound.extra
        self.problems = bound.problems
        for problem in bound.problems:
            self.log.config_warning(str(problem))
        self.tick_rate: float = (
            bound.values.apptick if bound.values.apptick is not None else type(self).DEFAULT_TICK
        )
        self.log.max_events = bound.values.max_appcast_events
        self.log.max_run_warnings = bound.values.max_appcast_run_warnings
        self.started = self.clock.now()
        self.now = self.started
        """Mission time of the current step (start-up, mail or iteration)."""

    # --- hooks -------------------------------------------------------------------------------

    @classmethod
    def warm_up(cls) -> None:
        """Called once per process before the mission's time begins: compile or load numerics here."""

    def on_start_up(self) -> None:
        """Called once, before anything else; `config` is bound. Raise to refuse to start."""

    def on_connect(self) -> None:
        """Called when the community is reached, again after every reconnection: register here.

        Registrations survive a reconnection by themselves; repeating them is harmless.
        """

    def on_mail(self, mail: list[Message]) -> None:
        """Called with all mail since the last time, before `iterate`, if there is any."""

    def on_command(self, message: Message) -> None:
        """Called for mail of `<APP>_CMD` before `on_mail`, with `CatchCommandMessages = true`."""

    def on_datagrams(self, port: DatagramPort, datagrams: Datagrams) -> None:
        """Called when datagrams have come in at a port that `open_port` opened."""

    def iterate(self) -> None:
        """Called `AppTick` times per mission second."""

    def report(self) -> Iterable[str]:
        """Lines of the app's report; called only when somebody wants it."""
        return ()

    def status_suffix(self) -> str:
        """More fields at the end of `<APP>_STATUS`, with a leading comma."""
        return ""

    def on_quit(self) -> None:
        """Called once when the app ends in an orderly way: close files here."""

    @classmethod
    def check_block(cls, lines: Sequence[ConfigLine], mission_dir: Path, file: str) -> list[Problem]:
        """Problems beyond single parameters, found without running: e.g. in files the block names."""
        return []

    @classmethod
    def explain_block(
        cls,
        lines: Sequence[ConfigLine],
        mission_dir: Path,
        blocks: Mapping[str, Sequence[ConfigLine]],
    ) -> str:
        """What the block will do, for ``pymoos check`` to print; empty for nothing worth telling.

        `blocks` are the lines of all apps of the mission by program name in lower case. Never raises: what
        is wrong is said by `check_block`.
        """
        return ""

    # --- talking -----------------------------------------------------------------------------

    def notify(self, name: str, value: object, time: float | None = None, aux: str = "") -> bool:
        """Post `value` (number, text, bytes; booleans become ``true``/``false``) to `name`.

        `time` is mission time, by default that of this step. Returns False when the post could
        not be taken; the reason then stands among the app's run warnings.
        """
        kind = type(value)
        if kind is not float and kind is not str:
            value = as_value(value)
        stamp = self.now if time is None else float(time)
        return self.connection.publish(
            _new_tuple(Message, (name, value, stamp, self.name, aux, self.community))
        )

    def notify_numbers(self, posts: Iterable[tuple[str, float]]) -> None:
        """Post several (name, float) of this step at once: `notify` for those who post many, often."""
        self.connection.publish_numbers(posts, self.now, self.name)

    def post(self, message: Message) -> bool:
        """Post a message as it is (bridges keep source and community)."""
        return self.connection.publish(message)

    def register(self, name: str, interval: float = 0.0, source: str = "*", omit: Sequence[str] = ()) -> None:
        """Ask for mail of `name`, or of all that match if it holds ``*`` or ``?``.

        `interval` is the least mission time in seconds between two deliveries of one variable; the
        last value of a burst always arrives. `source` is a pattern over the posting app's name,
        `omit` patterns of variables to leave out. The current value is delivered at once.
        """
        self.connection.register(name, source, interval, tuple(omit))

    def unregister(self, name: str) -> None:
        """Withdraw a registration; withdrawing an unknown one does nothing."""
        self.connection.unregister(name)

    def open_port(self, port: int = 0, group: str = "") -> DatagramPort:
        """Open a port for datagrams; what arrives there is handed to `on_datagrams`.

        Raises:
            OSError: the host has no network, the port is in use, or the group cannot be joined.
        """
        if self.context.network is None:
            raise OSError("this host has no network for its apps")
        opened = self.context.network.open(port, group)
        self.ports.append(opened)
        return opened

    def close_ports(self) -> None:
        """Close all ports of this app; hosts do so when it ends."""
        for port in self.ports:
            port.close()
        self.ports.clear()

    # --- saying how it goes ------------------------------------------------------------------

    def config_warning(self, text: str) -> None:
        """Something is wrong with the configuration; shown until the app ends."""
        self.log.config_warning(text)

    def run_warning(self, text: str) -> None:
        """Something went wrong just now; equal texts are counted."""
        self.log.run_warning(text)

    def retract_run_warning(self, text: str) -> None:
        """The matter of an earlier `run_warning` is settled."""
        self.log.retract_run_warning(text)

    def event(self, text: str) -> None:
        """Something worth telling happened; the newest few are shown."""
        self.log.event(self.now - self.started, text)

    def quit(self) -> None:
        """End this app in an orderly way."""
        raise Quit(self.name)

    # --- looking up --------------------------------------------------------------------------

    @property
    def uptime(self) -> float:
        """Mission seconds since this app started."""
        return self.now - self.started

    def mission_global(self, name: str, default: str = "") -> str:
        """A line outside all blocks, e.g. ``LatOrigin``; keys compare in any case."""
        return self.context.globals.get(name.lower(), default)

    def mission_path(self, text: str) -> Path:
        """A file named in the configuration, relative to the mission's folder."""
        path = Path(text).expanduser()
        return path if path.is_absolute() else self.context.mission_dir / path
