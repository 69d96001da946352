"""Who can hear whom: the rules of communication between vessels (marine_apps.md 9).

Positions in metres, times in mission seconds. Random drops come from one generator per ordered pair,
made from the seed, so that a vessel more in the fleet changes nothing for the others.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from math import hypot, inf

from mypy_extensions import mypyc_attr

from pymoos_lite.records.contact_ledger import Contact
from pymoos_lite.records.node_message import NodeMessage

NO_LIMIT = inf
FORGET_FACTOR = 20.0


def parse_range(text: str) -> float:
    """Metres; `nolimit` or a negative number is infinity, 0 is no communication.

    Raises:
        ValueError: neither.
    """
    word = text.strip().lower()
    if word in ("nolimit", "unlimited", "any"):
        return NO_LIMIT
    try:
        metres = float(word)
    except ValueError:
        raise ValueError("expected metres or nolimit") from None
    if metres != metres:
        raise ValueError("expected metres or nolimit")
    return NO_LIMIT if metres < 0.0 else metres


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class Factor:
    """One vessel's stealth or earange: it shortens, or lengthens, the range."""

    vname: str
    value: float


def parse_factor(text: str, key: str, low: float, high: float) -> Factor:
    """``vname=v,<key>=f``, `f` clipped to [low, high].

    Raises:
        ValueError: it has another form.
    """
    values: dict[str, str] = {}
    for piece in text.split(","):
        name, equals, value = piece.partition("=")
        if equals:
            values[name.strip().lower()] = value.strip()
    try:
        factor = float(values[key])
        vname = values["vname"]
    except (KeyError, ValueError):
        raise ValueError(f"expected vname=NAME,{key}=FACTOR") from None
    if not vname or factor != factor:
        raise ValueError(f"expected vname=NAME,{key}=FACTOR")
    return Factor(vname, min(max(factor, low), high))


@dataclass(slots=True)
class CommsSettings:
    """The adjustable part of the rules; see NodeComms.PARAMETERS for the meanings."""

    comms_range: float = 100.0
    critical_range: float = 30.0
    stale_time: float = 5.0
    min_msg_interval: float = 30.0
    min_rpt_interval: float = -1.0
    max_msg_length: int = 1000
    groups: bool = False
    msg_groups: bool = False
    drop_percentage: float = 0.0
    stealth: dict[str, float] = field(default_factory=dict)
    earange: dict[str, float] = field(default_factory=dict)


class CommsRules:
    """Decides for one report or message and one receiver; remembers when it last let something pass.

    Every method returns the reason for a refusal, empty if there is none: reasons are what is counted.
    """

    def __init__(self, settings: CommsSettings, seed: str | None) -> None:
        self.settings = settings
        self._seed = seed
        self._dice: dict[tuple[str, str], random.Random] = {}
        self._last_report: dict[tuple[str, str], float] = {}
        self._last_message: dict[str, float] = {}

    def report_passes(self, source: str, sender: Contact, name: str, receiver: Contact, now: float) -> str:
        """Whether a report of `source` goes to `name`."""
        settings = self.settings
        distance = hypot(sender.x - receiver.x, sender.y - receiver.y)
        if distance > settings.critical_range:
            if 0.0 <= settings.stale_time <= now - receiver.heard_at:
                return "stale receiver"
            if not self._in_range(source, name, distance):
                return "out of range"
            if settings.groups and not _same_group(sender, receiver):
                return "other group"
            if self._is_dropped(source, name):
                return "dropped by chance"
            if settings.min_rpt_interval > 0.0:
                last = self._last_report.get((source, name), -inf)
                if now - last < settings.min_rpt_interval:
                    return "too soon"
        if settings.min_rpt_interval > 0.0:
            self._last_report[source, name] = now
        return ""

    def message_leaves(self, message: NodeMessage, sender: Contact | None, now: float) -> str:
        """Whether a message is sent at all. The interval starts anew whatever happens later."""
        settings = self.settings
        last = self._last_message.get(message.src_node, -inf)
        if now - last < settings.min_msg_interval:
            return "too quick"
        if sender is None:
            return "unknown source"  # not remembered: strangers' names must not pile up
        self._last_message[message.src_node] = now
        text = message.value
        if isinstance(text, str) and 0 < settings.max_msg_length < len(text):
            return "too long"
        return ""

    def message_passes(self, source: str, sender: Contact, name: str, receiver: Contact, now: float) -> str:
        """Whether a message of `source` reaches `name`."""
        if self.settings.msg_groups and not _same_group(sender, receiver):
            return "other group"
        if self._is_stale(receiver, now):
            return "stale receiver"
        if not self._in_range(source, name, _distance(sender, receiver)):
            return "out of range"
        if self._is_dropped(source, name):
            return "dropped by chance"
        return ""

    def interval_passed(self, source: str, now: float) -> bool:
        """Whether `source` may send again; if so the interval starts anew."""
        if now - self._last_message.get(source, -inf) < self.settings.min_msg_interval:
            return False
        self._last_message[source] = now
        return True

    def forget(self, name: str) -> None:
        """A vessel is gone."""
        self._last_message.pop(name, None)
        for pair in [pair for pair in self._last_report if name in pair]:
            del self._last_report[pair]
        for pair in [pair for pair in self._dice if name in pair]:
            del self._dice[pair]

    def _is_stale(self, receiver: Contact, now: float) -> bool:
        limit = self.settings.stale_time
        return limit >= 0.0 and now - receiver.heard_at >= limit

    def _in_range(self, source: str, name: str, distance: float) -> bool:
        settings = self.settings
        reach = settings.comms_range
        if settings.stealth:
            reach *= settings.stealth.get(source, 1.0)
        if settings.earange:
            reach *= settings.earange.get(name, 1.0)
        return distance <= reach and reach > 0.0

    def _is_dropped(self, source: str, name: str) -> bool:
        percentage = self.settings.drop_percentage
        if percentage <= 0.0:
            return False
        dice = self._dice.get((source, name))
        if dice is None:
            seed = None if self._seed is None else f"{self._seed}:drop:{source}:{name}"
            dice = self._dice[source, name] = random.Random(seed)
        return dice.random() * 100.0 < percentage


def _distance(a: Contact, b: Contact) -> float:
    return hypot(a.x - b.x, a.y - b.y)


def _same_group(a: Contact, b: Contact) -> bool:
    return a.report.group.lower() == b.report.group.lower()
