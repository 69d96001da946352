"""uFldNodeComms: passes node reports and messages between vessels that can hear each other (marine_apps.md 9)."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable
from math import hypot, inf

from mypy_extensions import mypyc_attr

from pymoos_lite.app import App
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.field.comms_rules import (
    FORGET_FACTOR,
    CommsRules,
    CommsSettings,
    parse_factor,
    parse_range,
)
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.colors import INVISIBLE, color_text
from pymoos_lite.geometry.geodesy import Geodesy, GeodesyError
from pymoos_lite.records.contact_ledger import Contact, ContactLedger
from pymoos_lite.records.csp import RecordError, clip, num, parse_bool, parse_number
from pymoos_lite.records.node_message import AckMessage, NodeMessage
from pymoos_lite.records.node_report import NodeReport
from pymoos_lite.records.view import CommsPulse

MAX_WAITING = 1000
REMEMBERED_ACKS = 100
REPORT_PULSE_COLOR = "orange"
DEFAULT_SHARING = 0.1
_DROP_LINES = 12


def _color(text: str) -> str:
    color = color_text(text)
    if color is None:
        raise ValueError("expected a colour, or off")
    return color


def parse_sharing(text: str) -> float:
    """Wall seconds between two shared reports of a vessel: `true` 0.1, `false`/`off` -1, or a number.

    Raises:
        ValueError: none of these.
    """
    switch = parse_bool(text)
    if switch is not None:
        return DEFAULT_SHARING if switch else -1.0
    seconds = parse_number(text.strip())
    if seconds is None or seconds < 0.0:
        raise ValueError("expected true, false or seconds")
    return seconds


def _stealth(text: str) -> object:
    return parse_factor(text, "stealth", 0.1, 1.0)


def _earange(text: str) -> object:
    return parse_factor(text, "earange", 1.0, 10.0)


@mypyc_attr(allow_interpreted_subclasses=True)
class NodeComms(App):
    """The radio between vessels, as the shoreside simulates it."""

    DEFAULT_TICK = 4.0
    PARAMETERS = Declaration(
        (
            Parameter(
                "comms_range", "custom", 100.0, "m", "Reach of reports and messages; nolimit, or 0 for none.",
                parse=parse_range,
            ),
            Parameter(
                "critical_range", "number", 30.0, "m", "Within this range reports always pass.", low=0.0
            ),
            Parameter(
                "stale_time", "number", 5.0, "s",
                "A vessel that has not reported for so long hears nothing; negative: never stale.",
            ),
            Parameter(
                "min_msg_interval", "number", 30.0, "s", "Least time between two messages of a vessel.", low=0.0
            ),
            Parameter(
                "min_rpt_interval", "number", -1.0, "s",
                "Least time between two reports from one vessel to another; -1 for none.",
            ),
            Parameter(
                "max_msg_length", "integer", 1000, "characters", "Longest text of a message; 0 for no limit.",
                low=0,
            ),
            Parameter("groups", "boolean", False, doc="Reports pass only within a group."),
            Parameter("msg_groups", "boolean", False, doc="Messages pass only within a group."),
            Parameter(
                "pass_binary", "variable", None, doc="A variable that vessels send as it is to all in reach (compact "
                "opinions): VAR from vessel X goes on as VAR_<NAME>, under X's community.", repeated=True,
                example="OPINION_MESSAGE",
            ),
            Parameter(
                "stealth", "custom", doc="Shortens the reach of a vessel's reports: vname=NAME,stealth=FACTOR.",
                parse=_stealth, repeated=True, example="vname=abe, stealth=0.5",
            ),
            Parameter(
                "earange", "custom", doc="Lengthens what a vessel hears: vname=NAME,earange=FACTOR.",
                parse=_earange, repeated=True, example="vname=ben, earange=2",
            ),
            Parameter(
                "drop_percentage", "number", 0.0, "%", "Chance that a report or message is lost.", low=0.0, high=100.0
            ),
            Parameter("pulse_duration", "number", 10.0, "s", "How long a pulse is shown; 0 for no pulses."),
            Parameter("view_node_rpt_pulses", "boolean", True, doc="Show a pulse for every report."),
            Parameter(
                "shared_node_reports", "custom", -1.0, "wall s",
                "Post every vessel's reports as NODE_REPORT_UNC too: true, false or least time between two.",
                parse=parse_sharing, example="false",
            ),
            Parameter("msg_color", "custom", "white", doc="Colour of message pulses; off for none.", parse=_color),
            Parameter(
                "msg_repeat_color", "custom", "light_green",
                doc="Colour of pulses of messages sent again; off for none.", parse=_color,
            ),
        ),
        ignored=("verbose", "ground_truth"),
    )  # fmt: skip

    def on_start_up(self) -> None:
        config = self.config
        self.settings = CommsSettings(
            comms_range=config.comms_range,
            critical_range=config.critical_range,
            stale_time=config.stale_time,
            min_msg_interval=config.min_msg_interval,
            min_rpt_interval=config.min_rpt_interval,
            max_msg_length=config.max_msg_length,
            groups=config.groups,
            msg_groups=config.msg_groups,
            drop_percentage=config.drop_percentage,
            stealth={f.vname: f.value for f in config.stealth},
            earange={f.vname: f.value for f in config.earange},
        )
        seed = None if self.context.seed is None else f"{self.context.seed}:{self.community}:{self.name}"
        self.rules = CommsRules(self.settings, seed)
        self.ledger = ContactLedger(self._datum())
        self.dropped: Counter[str] = Counter()
        self.passed: Counter[str] = Counter()
        self._fresh: dict[str, None] = {}
        self._variables: dict[str, str] = {}
        self._reports: Counter[str] = Counter()
        self._waiting: deque[tuple[str, str]] = deque()
        self._binaries: deque[Message] = deque(maxlen=MAX_WAITING)
        self._binary_names = frozenset(config.pass_binary)
        self._acks_seen: deque[str] = deque(maxlen=REMEMBERED_ACKS)
        self._shared_at: dict[str, float] = {}
        self._sharing: float = config.shared_node_reports
        self._report_pulses: bool = config.view_node_rpt_pulses
        self._handlers: dict[str, Callable[[str], None]] = {
            "UNC_COMMS_RANGE": self._set_range,
            "UNC_STEALTH": lambda text: self._set_factor(self.settings.stealth, _stealth(text)),
            "UNC_EARANGE": lambda text: self._set_factor(self.settings.earange, _earange(text)),
            "UNC_DROP_PCT": self._set_drops,
            "UNC_SHARED_NODE_REPORTS": self._set_sharing,
            "UNC_VIEW_NODE_RPT_PULSES": self._set_pulses,
        }

    def _datum(self) -> Geodesy | None:
        lat, lon = (
            parse_number(self.mission_global("LatOrigin")),
            parse_number(self.mission_global("LongOrigin")),
        )
        if lat is None or lon is None:
            self.config_warning("LatOrigin and LongOrigin are not both given: reports need x and y")
            return None
        try:
            return Geodesy(lat, lon, self.mission_global("geodesy", "utm").lower() or "utm")
        except GeodesyError as error:
            self.config_warning(str(error))
            return None

    def on_connect(self) -> None:
        for name in ("NODE_REPORT", "NODE_REPORT_LOCAL", "NODE_MESSAGE", "MEDIATED_MESSAGE", "ACK_MESSAGE"):
            self.register(name)
        for name in (*self._handlers, *sorted(self._binary_names)):
            self.register(name)

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            name = message.name
            if name in ("NODE_REPORT", "NODE_REPORT_LOCAL"):
                self._take_report(message)
            elif name in ("NODE_MESSAGE", "MEDIATED_MESSAGE", "ACK_MESSAGE"):
                if len(self._waiting) >= MAX_WAITING:
                    self._drop("message", "flood")
                else:
                    self._waiting.append((name, message.text))
            elif name in self._binary_names:
                self._binaries.append(message)
            elif name in self._handlers:
                try:
                    self._handlers[name](message.text)
                except ValueError as error:
                    self.run_warning(f"{name} '{clip(message.text, 40)}': {error}")

    def iterate(self) -> None:
        for name in self._fresh:
            contact = self.ledger.get(name)
            if contact is not None:
                self._spread(name, contact)
        self._fresh.clear()
        while self._waiting:
            kind, text = self._waiting.popleft()
            if kind == "ACK_MESSAGE":
                self._pass_ack(text)
            else:
                self._pass_message(text)
        while self._binaries:
            self._pass_binary(self._binaries.popleft())
        if self.settings.stale_time > 0.0:
            for name in self.ledger.drop_older_than(FORGET_FACTOR * self.settings.stale_time, self.now):
                self.rules.forget(name)
                self._variables.pop(name, None)
                del self._reports[name]
                self.event(f"{name} has been silent for long: forgotten")

    # --- reports -----------------------------------------------------------------------------

    def _take_report(self, message: Message) -> None:
        try:
            contact = self.ledger.receive(NodeReport.parse(message.text), self.now)
        except RecordError as error:
            self._drop("report", "malformed")
            self.run_warning(f"{message.name} from {clip(message.community, 20)}: {error.reason}")
            return
        except ValueError as fault:
            self._drop("report", "incomplete")
            self.run_warning(f"{message.name} from {clip(message.community, 20)}: {fault}")
            return
        self._fresh[contact.name] = None
        self._reports[contact.name] += 1

    def _spread(self, name: str, contact: Contact) -> None:
        now = self.now
        passes = self.rules.report_passes
        variables = self._variables
        passed = 0
        text = ""
        for receiver in self.ledger:
            other = receiver.name
            if other == name:
                continue
            reason = passes(name, contact, other, receiver, now)
            if reason:
                self.dropped["report: " + reason] += 1
                continue
            if not text:
                text = self.ledger.complete(contact).to_text()
            variable = variables.get(other)
            if variable is None:
                variable = variables[other] = f"NODE_REPORT_{other.upper()}"
            self.notify(variable, text)
            passed += 1
            if self._report_pulses:
                self._pulse(name, contact, other, receiver, "", "")
        if passed:
            self.passed["report"] += passed
        if self._sharing >= 0.0:
            due = self._shared_at.get(name, -inf) + self._sharing * self.clock.warp
            if now >= due:
                self._shared_at[name] = now
                self.notify("NODE_REPORT_UNC", text or self.ledger.complete(contact).to_text())

    # --- messages ----------------------------------------------------------------------------

    def _pass_message(self, text: str) -> None:
        try:
            message = NodeMessage.parse(text)
        except RecordError as error:
            self._drop("message", "malformed")
            self.run_warning(str(error))
            return
        source = message.src_node
        sender = self.ledger.get(source)
        reason = self.rules.message_leaves(message, sender, self.now)
        if reason or sender is None:
            self._drop("message", reason)
            return
        kind = "MEDIATED_MESSAGE" if message.ack else "NODE_MESSAGE"
        color = self._message_color(message)
        targets = self._targets(message)
        if not targets:
            self._drop("message", "no such destination")
        for name in targets:
            receiver = self.ledger.get(name)
            assert receiver is not None
            reason = self.rules.message_passes(source, sender, name, receiver, self.now)
            if reason:
                self._drop("message", reason)
                continue
            self.notify(f"{kind}_{name.upper()}", text)
            self.passed["message"] += 1
            if color != INVISIBLE:
                self._pulse(source, sender, name, receiver, color, "msg")

    def _targets(self, message: NodeMessage) -> list[str]:
        names = [name for name in self.ledger.names() if name != message.src_node]
        if message.is_for_all():
            return names
        wanted = {name.lower() for name in message.destinations()}
        group = message.dest_group.lower()
        return [n for n in names if n.lower() in wanted or (group and self._group_of(n) == group)]

    def _group_of(self, name: str) -> str:
        contact = self.ledger.get(name)
        return contact.report.group.lower() if contact is not None else ""

    def _message_color(self, message: NodeMessage) -> str:
        if not message.ack_id:
            color = color_text(message.color) if message.color else None
            return color or str(self.config.msg_color)
        again = message.ack_id in self._acks_seen
        self._acks_seen.append(message.ack_id)
        return str(self.config.msg_repeat_color if again else self.config.msg_color)

    def _pass_binary(self, message: Message) -> None:
        source = message.community
        sender = self.ledger.get(source)
        if sender is None:
            self._drop("binary", "unknown source")
            return
        for receiver in self.ledger:
            if receiver.name == source:
                continue
            reason = self.rules.message_passes(source, sender, receiver.name, receiver, self.now)
            if reason:
                self._drop("binary", reason)
                continue
            self.post(message._replace(name=f"{message.name}_{receiver.name.upper()}"))
            self.passed["compact message"] += 1

    def _pass_ack(self, text: str) -> None:
        try:
            ack = AckMessage.parse(text)
        except RecordError as error:
            self._drop("ack", "malformed")
            self.run_warning(str(error))
            return
        sender, receiver = self.ledger.get(ack.src), self.ledger.get(ack.dest)
        if sender is None or receiver is None:
            self._drop("ack", "unknown vessel")
            return
        if not self.rules.interval_passed(f"ack:{ack.src}", self.now):
            self._drop("ack", "too quick")
            return
        reason = self.rules.message_passes(ack.src, sender, ack.dest, receiver, self.now)
        if reason:
            self._drop("ack", reason)
            return
        self.notify(f"ACK_MESSAGE_{ack.dest.upper()}", text)
        self.passed["ack"] += 1

    # --- pulses ------------------------------------------------------------------------------

    def _pulse(
        self, source: str, sender: Contact, name: str, receiver: Contact, color: str, kind: str
    ) -> None:
        duration = self.config.pulse_duration
        if duration <= 0.0:
            return
        length = hypot(receiver.x - sender.x, receiver.y - sender.y)
        pulse = CommsPulse(
            sx=sender.x,
            sy=sender.y,
            tx=receiver.x,
            ty=receiver.y,
            beam_width=max(5.0, 0.1 * length),
            fill=0.6 if kind else None,
            pulse_type=kind,
            attributes=Attributes(
                label=f"{source}2{name}{color}",
                fill_color=color or REPORT_PULSE_COLOR,
                time=self.now,
                duration=duration,
            ),
        )
        self.notify("VIEW_COMMS_PULSE", pulse.to_text())

    # --- changes while running ---------------------------------------------------------------

    def _set_range(self, text: str) -> None:
        self.settings.comms_range = parse_range(text)
        self.event(f"comms_range is now {text}")

    def _set_factor(self, table: dict[str, float], factor: object) -> None:
        vname, value = factor.vname, factor.value  # type: ignore[attr-defined]
        if vname not in self.ledger and vname not in table:
            raise ValueError(f"no vessel '{clip(vname, 20)}' has reported")
        table[vname] = value

    def _set_drops(self, text: str) -> None:
        percentage = parse_number(text)
        if percentage is None or not 0.0 <= percentage <= 100.0:
            raise ValueError("expected a percentage from 0 to 100")
        self.settings.drop_percentage = percentage

    def _set_sharing(self, text: str) -> None:
        self._sharing = parse_sharing(text)

    def _set_pulses(self, text: str) -> None:
        switch = parse_bool(text)
        if switch is None:
            raise ValueError("expected true or false")
        self._report_pulses = switch

    # --- report ------------------------------------------------------------------------------

    def _drop(self, what: str, reason: str) -> None:
        self.dropped[f"{what}: {reason}"] += 1

    def report(self) -> Iterable[str]:
        settings = self.settings
        reach = "no limit" if settings.comms_range == inf else f"{num(settings.comms_range)} m"
        yield f"Range: {reach}, always within {num(settings.critical_range)} m"
        yield f"Drops: {num(settings.drop_percentage)} %, groups: {settings.groups}/{settings.msg_groups}"
        yield "Vessel        reports  age (s)       x       y  group"
        for contact in self.ledger:
            yield (
                f"  {contact.name:<12} {self._reports[contact.name]:>6} {contact.age(self.now):>8.1f} "
                f"{contact.x:>7.1f} {contact.y:>7.1f}  {contact.report.group}"
            )
        yield "Passed on: " + (", ".join(f"{n} {what}s" for what, n in self.passed.items()) or "nothing")
        yield "Not passed on:"
        for reason, count in self.dropped.most_common(_DROP_LINES):
            yield f"  {count:>6}  {reason}"
