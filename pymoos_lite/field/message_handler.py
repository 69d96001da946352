"""uFldMessageHandler: posts in this community what other vessels sent to it (marine_apps.md 10)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from mypy_extensions import mypyc_attr

from pymoos_lite.app import App
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.records.csp import Flag, RecordError, clip, num, parse_flag
from pymoos_lite.records.node_message import NodeMessage

SUMMARY_EVERY = 100
_KEPT = 10


@mypyc_attr(allow_interpreted_subclasses=True)
class MessageHandler(App):
    """Delivers NODE_MESSAGE: its variable is posted as if an app here had posted it."""

    DEFAULT_TICK = 4.0
    PARAMETERS = Declaration(
        (
            Parameter(
                "strict_addressing",
                "boolean",
                False,
                doc="Take only messages that name this vessel, none to all or to a group.",
            ),
            Parameter(
                "aux_info",
                "choice",
                "node",
                doc="What the posts say about their origin.",
                choices=("node", "node+app"),
            ),
            Parameter(
                "appcast_trunc_msg",
                "integer",
                75,
                "characters",
                "Length at which the report cuts messages; 0 for never.",
                low=0,
            ),
            Parameter(
                "msg_flag",
                "custom",
                doc="VAR=value to post for each message taken; $[CTR], $[GOOD_CTR], $[BAD_CTR].",
                parse=parse_flag,
                repeated=True,
                example="MESSAGES=$[GOOD_CTR]",
            ),
            Parameter(
                "bad_msg_flag",
                "custom",
                doc="VAR=value to post for each message rejected.",
                parse=parse_flag,
                repeated=True,
                example="REJECTED=$[BAD_CTR]",
            ),
        )
    )

    def on_start_up(self) -> None:
        self.total = self.valid = self.rejected = self.invalid = 0
        self._recent: list[str] = []
        self._sources: Counter[str] = Counter()
        self._last_summary = 0

    def on_connect(self) -> None:
        self.register("NODE_MESSAGE")

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            self._take(message.text)
        self._summarize()

    def iterate(self) -> None:
        if self.iteration - self._last_summary >= SUMMARY_EVERY:
            self._summarize()

    def _summarize(self) -> None:
        self._last_summary = self.iteration
        self.notify("UMH_SUMMARY_MSGS", f"total={self.total},valid={self.valid},rejected={self.rejected}")

    def _take(self, text: str) -> None:
        self.total += 1
        try:
            message = NodeMessage.parse(text)
        except RecordError as error:
            self.invalid += 1
            self.run_warning(f"message not understood: {clip(error.reason, 80)}")
            return
        if not self._is_for_us(message):
            self.rejected += 1
            self._post_flags(self.config.bad_msg_flag)
            return
        value = message.value if message.value is not None else 0.0
        origin = message.src_node
        if self.config.aux_info == "node+app" and message.src_app:
            origin = f"{origin}+{message.src_app}"
        if not self.notify(message.var_name, value, aux=origin):
            # The database says why in a run warning of its own.
            self.rejected += 1
            self._post_flags(self.config.bad_msg_flag)
            return
        self.valid += 1
        self._sources[message.src_node if len(self._sources) < 500 else "others"] += 1
        self._remember(text)
        self._post_flags(self.config.msg_flag)

    def _is_for_us(self, message: NodeMessage) -> bool:
        if not message.dest_node:
            return not self.config.strict_addressing
        if any(name.lower() == "all" for name in message.destinations()):
            return not self.config.strict_addressing
        return message.names(self.community)

    def _post_flags(self, flags: list[Flag]) -> None:
        for flag in flags:
            value = flag.value
            if isinstance(value, str):
                value = self._expand(value)
            self.notify(flag.var, value)

    def _expand(self, text: str) -> float | str:
        counters = {"CTR": self.total, "GOOD_CTR": self.valid, "BAD_CTR": self.rejected}
        for name, count in counters.items():
            for macro in (f"$[{name}]", f"$({name})"):
                if text == macro:
                    return float(count)
                text = text.replace(macro, num(count))
        return text

    def _remember(self, text: str) -> None:
        cut = self.config.appcast_trunc_msg
        self._recent.append(text if not cut or len(text) <= cut else text[:cut] + "...")
        del self._recent[:-_KEPT]

    def report(self) -> Iterable[str]:
        yield f"Messages: {self.total}, taken {self.valid}, rejected {self.rejected}, invalid {self.invalid}"
        for source, count in sorted(self._sources.items()):
            yield f"  from {source}: {count}"
        yield "Last messages:"
        yield from (f"  {text}" for text in reversed(self._recent))
