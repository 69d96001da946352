"""One app alone in a lockstep community, with posts put in and everything it says collected."""

from __future__ import annotations

from pathlib import Path

from pymoos_lite.app import App, AppContext
from pymoos_lite.config.moos_file import parse_mission
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.lockstep import Lockstep


class Harness:
    """`said` holds (mission seconds, name, value) of all posts of the app under test."""

    def __init__(
        self, cls: type[App], block: str | None = "", *, name: str = "app", seed: int = 1,
        mission: str = "", apps: tuple[str, ...] = (), community: str = "abe", log_dir: Path | None = None,
    ) -> None:  # fmt: skip
        self.host = Lockstep(seed)
        self.home = self.host.add_community(community)
        self.watcher = LocalConnection(self.home.database, "watcher", self.host.clock)
        self.watcher.register("*", "*", 0.0, ())
        lines = (
            parse_mission(f"ProcessConfig = x\n{{\n{block}\n}}\n").blocks[0].lines
            if block is not None
            else ()
        )
        read = parse_mission(mission)
        context = AppContext(
            name, community, self.host.clock, LocalConnection(self.home.database, name, self.host.clock), lines,
            {g.name: read.text(g.key) or "" for g in read.globals}, "m.moos", seed=seed, apps=apps,
            has_block=block is not None, deterministic=True, log_dir=log_dir,
        )  # fmt: skip
        runner = self.host.add_app(self.home, cls, context)
        assert runner is not None, self.host.failures
        self.runner = runner
        self.app = runner.app
        self.name = name
        self.said: list[tuple[float, str, object]] = []

    def run(self, seconds: float) -> Harness:
        self.host.run(seconds)
        assert self.host.failures == []
        for message in self.watcher.take_mail():
            if message.source == self.name:
                self.said.append(
                    (round(message.time - self.host.clock.start, 6), message.name, message.value)
                )
        return self

    def post(self, name: str, value: str | float | bytes, source: str = "tester", aux: str = "") -> Harness:
        now = self.host.clock.now()
        typed = float(value) if isinstance(value, int) else value
        refusal = self.home.database.publish(source, Message(name, typed, now, source, aux, "abe"), now)
        assert refusal is None, str(refusal)
        return self

    def values(self, name: str) -> list[object]:
        return [value for _, said, value in self.said if said == name]

    def times(self, name: str) -> list[float]:
        return [time for time, said, _ in self.said if said == name]

    @property
    def alive(self) -> bool:
        return self.runner in self.home.runners
