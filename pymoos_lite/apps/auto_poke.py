"""pAutoPoke: posts flags once, when enough vessels have reported to the shore (community.md 17)."""

from __future__ import annotations

from collections.abc import Iterable

from pymoos_lite.app import App, AppContext
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.records.csp import parse_flag

NODE_COUNT = "UFSB_NODE_COUNT"


class AutoPoke(App):
    """Flags go out in the order of the file."""

    PARAMETERS = Declaration(
        (
            Parameter(
                "flag",
                "custom",
                None,
                "",
                "VAR=value to post.",
                repeated=True,
                parse=parse_flag,
                example="DEPLOY_ALL=true",
            ),
            Parameter("required_nodes", "integer", 0, "", "Vessels that must have reported.", low=0),
        )
    )

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.nodes = 0.0
        self.done = False

    def on_connect(self) -> None:
        self.register(NODE_COUNT)

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            if message.name == NODE_COUNT and message.number is not None:
                self.nodes = message.number

    def iterate(self) -> None:
        if self.done or self.nodes < self.config.required_nodes:
            return
        self.done = True
        for flag in self.config.flag:
            self.notify(flag.var, flag.value)
            self.event(f"posted {flag}")

    def report(self) -> Iterable[str]:
        yield f"nodes {self.nodes:.0f} of {self.config.required_nodes}, flags {'posted' if self.done else 'waiting'}"
        yield from (f"  {flag}" for flag in self.config.flag)
