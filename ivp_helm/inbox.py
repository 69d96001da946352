"""Mail into the helm: what is believed, what goes to the information buffer, what means something to the
helm itself (helm.md 9.2, 11.1, 12.4)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from ivp_helm.able_filter import AbleFilter
from ivp_helm.authority import OVERRIDE_VARIABLES
from pymoos_lite.core.message import Message
from pymoos_lite.records.csp import RecordError
from pymoos_lite.records.node_report import NodeReport

if TYPE_CHECKING:
    from ivp_helm.helm import HelmCore

FIXED_VARIABLES = (
    "DB_CLIENTS",
    *OVERRIDE_VARIABLES,
    "RESTART_HELM",
    "IVPHELM_REJOURNAL",
    "IVPHELM_STATE",
    "BHV_ABLE_FILTER",
    "HELM_MAP_CLEAR",
    "COMMS_POLICY",
    "NAV_X",
    "NAV_Y",
    "NAV_SPEED",
    "NAV_HEADING",
    "NAV_DEPTH",
    "NODE_REPORT",
    "NODE_REPORT_LOCAL",
    "AIS_REPORT",
    "AIS_REPORT_LOCAL",
)
INITIAL = "HELM_VAR_INIT"


@lru_cache(maxsize=1024)
def _nav_names(vessel: str) -> tuple[str, str]:
    """The variables in which conditions find a vessel's group and type."""
    prefix = vessel.upper()
    return f"{prefix}_NAV_GROUP", f"{prefix}_NAV_TYPE"


class Inbox:
    """The helm's mail handling."""

    def __init__(self, core: HelmCore) -> None:
        self._core = core
        self.clients: set[str] = set()
        self.heard_own_state = False
        self._last_request: dict[str, Message] = {}
        self._handlers: dict[str, Callable[[Message], bool]] = {
            "DB_CLIENTS": self._clients,
            "RESTART_HELM": self._restart,
            "IVPHELM_REJOURNAL": self._rejournal,
            "IVPHELM_STATE": self._state,
            "BHV_ABLE_FILTER": self._able,
            "HELM_MAP_CLEAR": self._map_clear,
            "NODE_REPORT": self._node_report,
            "AIS_REPORT": self._node_report,
            "NODE_REPORT_LOCAL": self._own_report,
            "AIS_REPORT_LOCAL": self._own_report,
            **dict.fromkeys(OVERRIDE_VARIABLES, self._override),
        }
        if core.settings.other_override_var:
            self._handlers[core.settings.other_override_var] = self._override

    def take(self, mail: Sequence[Message], now: float) -> None:
        core = self._core
        if core.authority.disabled:
            return
        buffer = core.buffer
        buffer.now = now
        store = buffer.set
        own = core.name
        limit = core.settings.ok_skew
        handlers = self._handlers
        requests = core.population.request_variables
        for message in mail:
            name, value, stamp, source, aux, _ = message
            if abs(now - stamp) > limit and source != own and not self._believed(message, now):
                continue
            handler = handlers.get(name)
            if handler is not None and not handler(message):
                continue
            if aux == INITIAL and source == own:
                continue
            if name in requests:
                # A database delivers the latest value again on every registration: no new request.
                if self._last_request.get(name) == message:
                    continue
                self._last_request[name] = message
            store(name, value, stamp)

    def _believed(self, message: Message, now: float) -> bool:
        """Whether mail with a strange time stamp is still taken: a latched value delivered on registering is."""
        core = self._core
        if (
            message.name == "HELM_MAP_CLEAR"
            or abs(now - core.registrations.since(message.name)) <= core.settings.ok_skew
        ):
            return True
        what = f"{message.name} Source={message.source} Skew={now - message.time:.2f}"
        text = f"Helm ignores MOOS msg due to skew: {what}"
        core.note("warning", text)
        core.outbox.post("IVPHELM_SKEW", f"{text} curr_time: {now:.3f}")
        return False

    # --- handlers: True lets the value into the buffer ----------------------------------------------------

    def _clients(self, message: Message) -> bool:
        if isinstance(message.value, str):
            self.clients = {name.strip() for name in message.value.split(",") if name.strip()}
        return True

    def _override(self, message: Message) -> bool:
        if self._core.authority.override(message.value):
            driving = self._core.authority.driving
            self._core.note(
                "event", f"{message.source} {'gives control to' if driving else 'parks'} the helm"
            )
        return True

    def _restart(self, message: Message) -> bool:
        if isinstance(message.value, str):
            self._core.request_restart(message.value.strip().lower())
        return False

    def _rejournal(self, message: Message) -> bool:
        self._core.announcer.refresh()
        return False

    def _state(self, message: Message) -> bool:
        core = self._core
        if message.source == core.name:
            self.heard_own_state = True
            return False
        answer = core.authority.hear(str(message.value), core.buffer.now)
        if answer == "takeover":
            core.be_replaced(message.source)
        elif answer == "refresh":
            core.announcer.refresh()
            core.outbox.forget_change("IVPHELM_ALLSTOP")
        return False

    def _map_clear(self, message: Message) -> bool:
        if self._core.outbox.forget_all(self._core.buffer.now):
            self._core.surroundings.retellings += 1
        return False

    def _able(self, message: Message) -> bool:
        core = self._core
        try:
            order = AbleFilter.parse(str(message.value))
        except ValueError as error:
            core.note("warning", str(error))
            return False
        if order.contact and order.action == "disable":
            core.population.disable_contact(order.contact)
        elif order.contact and order.action == "enable":
            core.population.disabled_contacts.pop(order.contact, None)
        for life in core.population:
            if order.matches(life):
                order.apply(life)
        return True

    def _node_report(self, message: Message) -> bool:
        core = self._core
        if not isinstance(message.value, str):
            return False
        try:
            contact = core.contacts.take(message.value, core.buffer.now)
        except ValueError as error:
            core.note("warning", f"Bad NodeReport: {message.value[:200]}")
            core.note("warning", f"The issue: {error}")
            return False
        if contact is not None:
            group, kind = _nav_names(contact.name)
            core.buffer.assign(group, contact.report.group)
            core.buffer.assign(kind, contact.type)
        return True

    def _own_report(self, message: Message) -> bool:
        buffer = self._core.buffer
        try:
            report = NodeReport.parse(str(message.value))
        except RecordError:
            return False
        prefix = report.name.upper()
        for word, value in (("GROUP", report.group), ("TYPE", report.type), ("COLOR", report.color)):
            if value:
                buffer.assign(f"{prefix}_NAV_{word}", value)
        if report.length is not None:
            buffer.assign(f"{prefix}_NAV_LENGTH", report.length)
        return True
