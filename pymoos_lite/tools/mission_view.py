"""What a person wants to know of a running mission, gathered from its mail.

No I/O: mail in, a state out, which `panel` draws on a terminal and `PlainLines` tells line by line.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

from pymoos_lite.core.message import Message
from pymoos_lite.records.appcast import AppCast, AppCastRequest
from pymoos_lite.records.csp import RecordError

WATCHED = (
    "NAV_X",
    "NAV_Y",
    "NAV_HEADING",
    "NAV_SPEED",
    "NAV_DEPTH",
    "DESIRED_HEADING",
    "DESIRED_SPEED",
    "DESIRED_DEPTH",
    "MODE",
    "IVPHELM_STATE",
    "IVPHELM_SUMMARY",
    "IVPHELM_ALLSTOP",
    "BHV_WARNING",
    "BHV_ERROR",
    "PROC_WATCH_SUMMARY",
    "APPCAST",
    "DB_EVENT",
    "WPT_STAT",
    "MISSION_RESULT",
)
"""Variables the view registers for."""

REQUEST_PERIOD = 5.0
"""Mission seconds between two requests for app casts, which is how warnings come to be seen."""

NEWS_KEPT = 8


@dataclass
class AppLine:
    """How one app does: iterations and warnings."""

    name: str
    iteration: int = 0
    config_warnings: tuple[str, ...] = ()
    run_warnings: tuple[tuple[str, int], ...] = ()


@dataclass
class MissionView:
    """The state of one community as far as a person is concerned."""

    community: str
    started: float
    numbers: dict[str, float] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    summary: dict[str, str] = field(default_factory=dict)
    apps: dict[str, AppLine] = field(default_factory=dict)
    clients: dict[str, None] = field(default_factory=dict)
    news: deque[tuple[float, str]] = field(default_factory=lambda: deque(maxlen=NEWS_KEPT))
    track: deque[tuple[float, float]] = field(default_factory=lambda: deque(maxlen=2000))
    now: float = 0.0
    _fresh_news: list[tuple[float, str]] = field(default_factory=list)

    @property
    def elapsed(self) -> float:
        """Mission seconds since the start."""
        return max(0.0, self.now - self.started)

    @property
    def mode(self) -> str:
        """The helm's mode, or its state while it has none."""
        return self.texts.get("MODE") or self.texts.get("IVPHELM_STATE", "no helm yet")

    @property
    def active_behaviors(self) -> list[str]:
        """Names of the behaviours that took part in the last decision."""
        text = self.summary.get("active_bhvs", "none")
        return [] if text == "none" else [part.split("$")[0] for part in text.split(":")]

    @property
    def warnings(self) -> list[str]:
        """Every app's warnings, configuration first."""
        found = []
        for app in self.apps.values():
            found += [f"{app.name}: {text}" for text in app.config_warnings]
        for app in self.apps.values():
            found += [
                f"{app.name}: {text}" + (f" ({count} times)" if count > 1 else "")
                for text, count in app.run_warnings
            ]
        return found

    def take(self, mail: Iterable[Message], now: float) -> None:
        """Take in mail; `now` is mission time."""
        self.now = now
        for message in mail:
            self._take_one(message)

    def take_news(self) -> list[tuple[float, str]]:
        """News since the last call, as mission seconds and text."""
        news, self._fresh_news = self._fresh_news, []
        return news

    def tell(self, text: str) -> None:
        """Add a piece of news."""
        item = (self.elapsed, text)
        self.news.append(item)
        self._fresh_news.append(item)

    def _take_one(self, message: Message) -> None:
        name, value = message.name, message.value
        if isinstance(value, float):
            self.numbers[name] = value
            if name == "NAV_Y" and "NAV_X" in self.numbers:
                self._note_position()
            return
        text = message.text
        former = self.texts.get(name)
        if name == "IVPHELM_SUMMARY":
            self._take_summary(text)
        elif name == "APPCAST":
            self._take_cast(text)
        elif name == "DB_EVENT":
            self._take_event(text)
        else:
            self.texts[name] = text
            if name in ("BHV_WARNING", "BHV_ERROR"):
                self.tell(f"{name.lower().replace('_', ' ')}: {text}")
            elif text != former and name in ("MODE", "IVPHELM_STATE", "IVPHELM_ALLSTOP", "MISSION_RESULT"):
                self.tell(_NEWS[name].format(text))
            elif name == "PROC_WATCH_SUMMARY" and text != former and (former or text != "All Present"):
                self.tell(f"apps: {text}")

    def _note_position(self) -> None:
        place = (self.numbers["NAV_X"], self.numbers["NAV_Y"])
        last = self.track[-1] if self.track else None
        if last is None or (place[0] - last[0]) ** 2 + (place[1] - last[1]) ** 2 >= 1.0:
            self.track.append(place)

    def _take_summary(self, text: str) -> None:
        before = set(self.active_behaviors)
        for part in _split_outside_quotes(text):
            key, equals, value = part.partition("=")
            if equals:
                self.summary[key] = value.strip('"')
        after = set(self.active_behaviors)
        if after != before and (after or before):
            self.tell("active: " + (", ".join(sorted(after)) or "no behaviour"))

    def _take_cast(self, text: str) -> None:
        try:
            cast = AppCast.parse(text)
        except RecordError:
            return
        line = self.apps.setdefault(cast.proc, AppLine(cast.proc))
        for warning in cast.config_warnings:
            if warning not in line.config_warnings:
                self.tell(f"{cast.proc} configuration warning: {warning}")
        known = {warning for warning, _ in line.run_warnings}
        for warning, _ in cast.run_warnings:
            if warning not in known:
                self.tell(f"{cast.proc} warning: {warning}")
        line.iteration = cast.iteration
        line.config_warnings = cast.config_warnings
        line.run_warnings = cast.run_warnings

    def _take_event(self, text: str) -> None:
        what, _, rest = text.partition("=")
        name = rest.split(",")[0]
        if what == "connected":
            self.clients[name] = None
        elif what == "disconnected":
            self.clients.pop(name, None)
        elif what == "refused":
            self.tell(f"a wrong-typed write was refused: {rest}")


_NEWS = {
    "MODE": "mode {}",
    "IVPHELM_STATE": "helm state {}",
    "IVPHELM_ALLSTOP": "all-stop: {}",
    "MISSION_RESULT": "mission result: {}",
}


def appcast_request(community: str) -> str:
    """The request that makes apps tell their warnings."""
    return AppCastRequest(community or "all", "all", 2.0 * REQUEST_PERIOD, "pymoos:view", "any").to_text()


def _split_outside_quotes(text: str) -> list[str]:
    parts, depth, start, quoted = [], 0, 0, False
    for index, char in enumerate(text):
        if char == '"':
            quoted = not quoted
        elif char in "{}" and not quoted:
            depth += 1 if char == "{" else -1
        elif char == "," and not quoted and depth <= 0:
            parts.append(text[start:index])
            start = index + 1
    parts.append(text[start:])
    return parts
