"""pDeadManPost: posts flags when a heartbeat stays away (marine_apps.md 13, community.md 16)."""

from __future__ import annotations

from collections.abc import Iterable

from mypy_extensions import mypyc_attr

from pymoos_lite.app import App
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.records.csp import parse_flag


@mypyc_attr(allow_interpreted_subclasses=True)
class DeadMan(App):
    """Watches one variable; any post of it is a beat."""

    DEFAULT_TICK = 4.0
    PARAMETERS = Declaration(
        (
            Parameter("heartbeat_var", "variable", "", doc="The variable whose posts are the heartbeat."),
            Parameter("max_noheart", "number", 10.0, "s", "Longest silence.", low=0.0, open_low=True),
            Parameter(
                "post_policy",
                "choice",
                "once",
                doc="once: a single time ever; repeat: in every iteration of the silence; "
                "reset: once for each silence.",
                choices=("once", "repeat", "reset"),
            ),
            Parameter(
                "active_at_start",
                "boolean",
                True,
                doc="The silence counts from the start; false: from the first beat on.",
            ),
            Parameter(
                "deadflag",
                "custom",
                doc="VAR=value to post.",
                parse=parse_flag,
                repeated=True,
                aliases=("dead_flag",),
                example="RETURN=true",
            ),
        )
    )

    def on_start_up(self) -> None:
        self._active: bool = self.config.active_at_start
        self._last_beat = self.now
        self._beats = 0
        self._posted = 0
        self._posted_in_silence = False
        if not self.config.heartbeat_var:
            self.config_warning("heartbeat_var is not given: nothing is watched")
        if not self.config.deadflag:
            self.config_warning("no deadflag is given: nothing would be posted")

    def on_connect(self) -> None:
        if self.config.heartbeat_var:
            self.register(self.config.heartbeat_var)

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            if message.name == self.config.heartbeat_var:
                if self._posted_in_silence:
                    self.event(f"the heartbeat is back after {self.now - self._last_beat:.1f} s")
                self._active = True
                self._beats += 1
                self._last_beat = self.now
                self._posted_in_silence = False

    def iterate(self) -> None:
        config = self.config
        if not config.heartbeat_var or not self._active or self._silence() <= config.max_noheart:
            return
        if config.post_policy == "once" and self._posted:
            return
        if config.post_policy == "reset" and self._posted_in_silence:
            return
        if not self._posted_in_silence:
            self.event(f"no heartbeat for {self._silence():.1f} s")
        self._posted += 1
        self._posted_in_silence = True
        for flag in config.deadflag:
            self.notify(flag.var, flag.value)

    def _silence(self) -> float:
        return self.now - self._last_beat

    def report(self) -> Iterable[str]:
        yield f"Heartbeat: {self.config.heartbeat_var or '(none)'}, {self._beats} beats"
        state = "watching" if self._active else "waiting for the first beat"
        yield f"Silence: {self._silence():.1f} of {self.config.max_noheart:g} s ({state})"
        yield f"Flags posted: {self._posted} times"
