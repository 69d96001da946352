"""pDeadManPost: posts flags when a heartbeat stops (community.md 16)."""

from __future__ import annotations

from collections.abc import Iterable

from pymoos_lite.app import App, AppContext
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.records.csp import num, parse_flag


class DeadManPost(App):
    """Any post of the heartbeat variable is a beat, whatever its value."""

    PARAMETERS = Declaration(
        (
            Parameter(
                "heartbeat_var", "variable", "", "", "The variable that must keep coming.", example="ALIVE"
            ),
            Parameter(
                "max_noheart", "number", 10.0, "s", "Silence after which the flags are posted.", low=0.0
            ),
            Parameter(
                "deadflag",
                "custom",
                None,
                "",
                "VAR=value to post.",
                repeated=True,
                parse=parse_flag,
                example="RETURN=true",
            ),
            Parameter(
                "post_policy",
                "choice",
                "once",
                "",
                "Post once, each iteration, or once per silence.",
                choices=("once", "repeat", "reset"),
            ),
            Parameter(
                "active_at_start", "boolean", True, "", "Count from the start, not from the first beat."
            ),
        )
    )

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.last_beat: float | None = None
        self.posted = False
        self.posts = 0

    def on_start_up(self) -> None:
        if not self.config.heartbeat_var:
            self.config_warning("heartbeat_var is not given: nothing is watched")
        if self.config.active_at_start:
            self.last_beat = self.now

    def on_connect(self) -> None:
        if self.config.heartbeat_var:
            self.register(self.config.heartbeat_var)

    def on_mail(self, mail: list[Message]) -> None:
        if any(message.name == self.config.heartbeat_var for message in mail):
            self.last_beat = self.now
            if self.config.post_policy == "reset":
                self.posted = False

    def iterate(self) -> None:
        if self.last_beat is None or not self.config.heartbeat_var:
            return
        if self.now - self.last_beat <= self.config.max_noheart:
            return
        if self.posted and self.config.post_policy != "repeat":
            return
        if not self.posted:
            self.event(f"no {self.config.heartbeat_var} for {num(self.now - self.last_beat)} s")
        self.posted = True
        self.posts += 1
        for flag in self.config.deadflag:
            self.notify(flag.var, flag.value)

    def report(self) -> Iterable[str]:
        silence = "not yet heard" if self.last_beat is None else f"{num(self.now - self.last_beat, 1)} s ago"
        yield f"heartbeat {self.config.heartbeat_var}: {silence}, limit {num(self.config.max_noheart)} s"
        yield f"policy {self.config.post_policy}, flags posted {self.posts} times"
        yield from (f"  {flag}" for flag in self.config.deadflag)
