"""A community under virtual time in which tests run apps, post to them and read what they post."""

from __future__ import annotations

from typing import Any, TypeVar

from pymoos_lite.app import App, AppContext
from pymoos_lite.config.mission import ConfigLine, key_name
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.lockstep import Lockstep

ORIGIN = {"LatOrigin": "43.825300", "LongOrigin": "-70.330400"}
A = TypeVar("A", bound=App)


class Recorder(App):
    """Hears everything, like a logger."""

    BLOCK_OPTIONAL = True
    DEFAULT_TICK = 200.0

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.heard: list[Message] = []

    def on_connect(self) -> None:
        self.register("*")

    def on_mail(self, mail: list[Message]) -> None:
        self.heard += mail


class Sea:
    """One community named `abe` with a recorder on board."""

    def __init__(self, origin: bool = True) -> None:
        self.host = Lockstep(seed=1)
        self.community = self.host.add_community("abe")
        self.globals = {key_name(key): value for key, value in ORIGIN.items()} if origin else {}
        self.recorder = self.add(Recorder, "recorder")

    def add(self, cls: type[A], name: str, config: str = "", **globals_: str) -> A:
        """Start an app with `config`, lines of `key = value`."""
        lines = []
        for number, row in enumerate(config.strip().splitlines(), 1):
            key, _, value = row.partition("=")
            lines.append(ConfigLine(key.strip(), value.strip(), number))
        context = AppContext(
            name=name,
            community="abe",
            clock=self.host.clock,
            connection=LocalConnection(self.community.database, name, self.host.clock),
            lines=lines,
            globals=self.globals | {key_name(k): v for k, v in globals_.items()},
            mission_file="test.moos",
            seed=1,
            deterministic=True,
        )
        runner = self.host.add_app(self.community, cls, context)
        assert runner is not None, self.host.failures
        assert isinstance(runner.app, cls)
        return runner.app

    @property
    def now(self) -> float:
        return self.host.clock.now()

    def post(self, name: str, value: float | str, time: float | None = None, source: str = "tester") -> None:
        stamp = self.now if time is None else time
        kind: Any = float(value) if isinstance(value, int | float) else value
        self.community.database.publish(source, Message(name, kind, stamp, source, "", "abe"), self.now)

    def run(self, seconds: float) -> None:
        self.host.run(seconds)
        assert not self.host.failures, self.host.failures

    def heard(self, name: str, source: str = "") -> list[Any]:
        """All values of `name` so far, in order."""
        return [m.value for m in self.recorder.heard if m.name == name and source in ("", m.source)]

    def last(self, name: str) -> Any:
        values = self.heard(name)
        assert values, f"nobody posted {name}"
        return values[-1]

    def forget(self) -> None:
        self.recorder.heard.clear()


def warnings_of(app: App) -> list[str]:
    """All run warnings of an app."""
    return list(app.log.run_warnings)
