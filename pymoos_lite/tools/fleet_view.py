"""What a person wants to know of a running fleet, gathered from the shoreside's mail, and how it is shown.

`FleetView` takes mail and holds the state; `PlainFleet` tells it line by line, `FleetPanel` draws it in
place on a terminal.
"""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol, TextIO

from pymoos_lite.core.message import Message
from pymoos_lite.records.appcast import AppCast
from pymoos_lite.records.csp import RecordError
from pymoos_lite.records.node_report import NodeReport

if TYPE_CHECKING:
    from rich.panel import Panel

WATCHED = (
    "NODE_REPORT",
    "APPCAST",
    "UFSB_NODE_COUNT",
    "MISSION_RESULT",
    "MISSION_REPORT",
    "COLLISION_TOTAL",
    "NEAR_MISS_TOTAL",
    "ENCOUNTER_TOTAL",
)
NEWS_KEPT = 12
SILENT_AFTER = 5.0
"""Mission seconds without a node report after which a vehicle is called silent."""

PLAIN_PERIOD = 10.0
_TOTALS = {"COLLISION_TOTAL": "collision", "NEAR_MISS_TOTAL": "near miss", "ENCOUNTER_TOTAL": ""}
_COUNTED = {
    "ENCOUNTER_TOTAL": "encounters",
    "NEAR_MISS_TOTAL": "near misses",
    "COLLISION_TOTAL": "collisions",
}


@dataclass
class FleetView:
    """The state of a fleet as far as the shoreside knows; times in mission seconds."""

    names: list[str]
    started: float
    reports: dict[str, NodeReport] = field(default_factory=dict)
    heard: dict[str, float] = field(default_factory=dict)
    totals: dict[str, float] = field(default_factory=dict)
    warnings: dict[tuple[str, str], tuple[str, ...]] = field(default_factory=dict)
    news: deque[tuple[float, str]] = field(default_factory=lambda: deque(maxlen=NEWS_KEPT))
    final: str = ""
    now: float = 0.0
    _fresh: list[tuple[float, str]] = field(default_factory=list)

    @property
    def elapsed(self) -> float:
        return max(0.0, self.now - self.started)

    def tell(self, text: str) -> None:
        """Add a piece of news."""
        self.news.append((self.elapsed, text))
        self._fresh.append((self.elapsed, text))

    def take_news(self) -> list[tuple[float, str]]:
        """News since the last call."""
        fresh, self._fresh = self._fresh, []
        return fresh

    def take(self, mail: Iterable[Message], now: float) -> None:
        self.now = now
        for message in mail:
            if message.name == "NODE_REPORT":
                self._take_report(message)
            elif message.name == "APPCAST":
                self._take_cast(message.text)
            elif message.name == "MISSION_REPORT":
                self.final = message.text
            elif message.name == "MISSION_RESULT":
                self.tell(f"mission result: {message.text}")
            elif isinstance(message.value, float):
                self._take_total(message.name, message.value)

    def state_of(self, name: str) -> str:
        """What a vehicle is doing, in a word or two."""
        if name not in self.reports:
            return "not heard yet"
        if self.now - self.heard[name] > SILENT_AFTER:
            return f"silent for {self.now - self.heard[name]:.0f} s"
        mode = self.reports[name].mode
        return mode.rpartition(":")[2] or mode

    def _take_report(self, message: Message) -> None:
        try:
            report = NodeReport.parse(message.text)
        except RecordError:
            return
        name = report.name
        if name not in self.names:
            return
        former = self.reports.get(name)
        if former is None:
            self.tell(f"{name} reports")
        elif former.mode != report.mode:
            self.tell(f"{name}: {report.mode}")
        self.reports[name] = report
        self.heard[name] = self.now

    def _take_cast(self, text: str) -> None:
        try:
            cast = AppCast.parse(text)
        except RecordError:
            return
        key = (cast.node, cast.proc)
        found = (*cast.config_warnings, *(warning for warning, _ in cast.run_warnings))
        for warning in found:
            if warning not in self.warnings.get(key, ()):
                self.tell(f"{cast.node} {cast.proc}: {warning}")
        self.warnings[key] = found

    def _take_total(self, name: str, value: float) -> None:
        word = _TOTALS.get(name, "")
        if word and value > self.totals.get(name, 0.0):
            self.tell(f"{word} number {value:.0f}")
        self.totals[name] = value


class FleetDisplay(Protocol):
    """What `launch` shows a fleet on."""

    def refresh(self, view: FleetView, warp: float) -> None: ...

    def close(self) -> None: ...


def make_display(plain: bool) -> FleetDisplay:
    """A live panel if stdout is a terminal and `plain` is not asked for."""
    return PlainFleet(sys.stdout) if plain or not sys.stdout.isatty() else FleetPanel()


class PlainFleet:
    """News as they come and everybody's position now and then, one line each."""

    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._next = 0.0

    def refresh(self, view: FleetView, warp: float) -> None:
        for when, text in view.take_news():
            print(f"[{when:7.1f}] {text}", file=self._out)
        if view.elapsed >= self._next and view.reports:
            self._next = view.elapsed - view.elapsed % PLAIN_PERIOD + PLAIN_PERIOD
            places = (f"{n} {r.x or 0.0:.0f},{r.y or 0.0:.0f}" for n, r in view.reports.items())
            print(f"[{view.elapsed:7.1f}] {'  '.join(places)}", file=self._out)
        self._out.flush()

    def close(self) -> None:
        self._out.flush()


class FleetPanel:
    """A table that redraws itself in place (rich)."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.live import Live

        self._live = Live(console=Console(), auto_refresh=False)
        self._live.start()

    def refresh(self, view: FleetView, warp: float) -> None:
        view.take_news()
        self._live.update(render(view, warp), refresh=True)

    def close(self) -> None:
        self._live.stop()


def render(view: FleetView, warp: float) -> Panel:
    """The panel as a rich renderable."""
    from rich.console import Group
    from rich.panel import Panel
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, padding=(0, 2), header_style="dim")
    for title, right in (("vehicle", False), ("x", True), ("y", True), ("heading", True), ("speed", True)):
        table.add_column(title, justify="right" if right else "left")
    table.add_column("doing")
    table.add_column("warnings", justify="right")
    for name in view.names:
        report = view.reports.get(name)
        warnings = sum(len(found) for (node, _), found in view.warnings.items() if node == name)
        numbers = ["-"] * 4
        if report is not None:
            values = (report.x, report.y, report.heading, report.speed)
            numbers = [
                f"{v:.{d}f}" if v is not None else "-" for v, d in zip(values, (1, 1, 0, 2), strict=True)
            ]
        state = view.state_of(name)
        style = "red" if state.startswith(("silent", "not")) else "green"
        table.add_row(name, *numbers, Text(state, style=style), str(warnings or ""))
    totals = "   ".join(f"{word} {view.totals[n]:.0f}" for n, word in _COUNTED.items() if n in view.totals)
    news = Text()
    for when, text in view.news:
        news.append(f"[{when:7.1f}] ", style="dim")
        news.append(text + "\n")
    title = f"fleet of {len(view.names)}   {view.elapsed:.0f} s   warp {warp:g}"
    return Panel(Group(table, Text(totals), news), title=title, subtitle="Ctrl-C ends the mission")
