"""Shows a running mission: a live panel on a terminal, plain lines anywhere else."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING, Protocol, TextIO

from pymoos_lite.tools.mission_view import MissionView

if TYPE_CHECKING:
    from rich.panel import Panel

PLAIN_PERIOD = 10.0
"""Mission seconds between two position lines when the output is no terminal."""


class Display(Protocol):
    """What `launch` shows the mission on."""

    def refresh(self, view: MissionView, warp: float) -> None: ...

    def close(self) -> None: ...


def make_display(plain: bool) -> Display:
    """A live panel if stdout is a terminal and `plain` is not asked for."""
    if plain or not sys.stdout.isatty():
        return PlainLines(sys.stdout)
    return LivePanel()


class PlainLines:
    """News as they come and the position now and then, one line each."""

    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._next = 0.0

    def refresh(self, view: MissionView, warp: float) -> None:
        for when, text in view.take_news():
            print(f"[{when:7.1f}] {text}", file=self._out)
        if view.elapsed >= self._next and "NAV_X" in view.numbers:
            self._next = view.elapsed - view.elapsed % PLAIN_PERIOD + PLAIN_PERIOD
            print(f"[{view.elapsed:7.1f}] {position_text(view)}", file=self._out)
        self._out.flush()

    def close(self) -> None:
        self._out.flush()


def position_text(view: MissionView) -> str:
    """Position, heading, speed and what the vessel is doing, in one line."""
    n = view.numbers
    text = f"x={n.get('NAV_X', 0.0):.1f} y={n.get('NAV_Y', 0.0):.1f}"
    if "NAV_HEADING" in n:
        text += f" heading={n['NAV_HEADING']:.0f}"
    if "NAV_SPEED" in n:
        text += f" speed={n['NAV_SPEED']:.1f}"
    active = ", ".join(view.active_behaviors) or "none"
    return f"{text}  mode={view.mode}  active={active}"


class LivePanel:
    """A panel that redraws itself in place (rich)."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.live import Live

        self._console = Console()
        self._live = Live(console=self._console, auto_refresh=False, transient=False)
        self._live.start()

    def refresh(self, view: MissionView, warp: float) -> None:
        view.take_news()
        self._live.update(render(view, warp), refresh=True)

    def close(self) -> None:
        self._live.stop()


def render(view: MissionView, warp: float) -> Panel:
    """The panel as a rich renderable."""
    from rich.console import Group
    from rich.panel import Panel
    from rich.table import Table
    from rich.text import Text

    n = view.numbers
    state = Table.grid(padding=(0, 2))
    state.add_column(style="dim", justify="right")
    state.add_column()
    state.add_row("mission time", f"{_clock(view.elapsed)}   warp {warp:g}")
    if "NAV_X" in n:
        state.add_row("position", f"x {n['NAV_X']:8.1f} m   y {n.get('NAV_Y', 0.0):8.1f} m")
    state.add_row("heading", _actual_and_wanted(n, "HEADING", "°", 0))
    state.add_row("speed", _actual_and_wanted(n, "SPEED", "m/s", 2))
    if n.get("NAV_DEPTH", 0.0) > 0.05 or "DESIRED_DEPTH" in n:
        state.add_row("depth", _actual_and_wanted(n, "DEPTH", "m", 1))
    state.add_row("mode", Text(view.mode, style="bold green"))
    helm = view.texts.get("IVPHELM_STATE", "-")
    stop = view.texts.get("IVPHELM_ALLSTOP", "")
    state.add_row("helm", helm if stop in ("", "clear") else f"{helm}, all-stop: {stop}")
    state.add_row("active", Text(", ".join(view.active_behaviors) or "-", style="cyan"))
    warnings = view.warnings
    state.add_row(
        "warnings", Text(str(len(warnings)) if warnings else "none", style="yellow" if warnings else "")
    )
    for warning in warnings[:4]:
        state.add_row("", Text(warning, style="yellow", overflow="ellipsis", no_wrap=True))
    body = Table.grid(padding=(0, 3))
    body.add_column()
    body.add_column()
    body.add_row(state, Text(draw_track(view.track), style="blue"))
    news = Text()
    for when, text in view.news:
        news.append(f"[{when:7.1f}] ", style="dim")
        news.append(text + "\n", style="red" if "error" in text or "all-stop" in text else "")
    title = f"{view.community or 'community'} · {len(view.clients)} apps"
    return Panel(Group(body, Text(), news), title=title, subtitle="Ctrl-C ends the mission")


def _actual_and_wanted(numbers: dict[str, float], name: str, unit: str, digits: int) -> str:
    actual, wanted = numbers.get(f"NAV_{name}"), numbers.get(f"DESIRED_{name}")
    text = "-" if actual is None else f"{actual:.{digits}f} {unit}"
    return text if wanted is None else f"{text:<10}  wanted {wanted:.{digits}f} {unit}"


def _clock(seconds: float) -> str:
    whole = int(seconds)
    return f"{whole // 3600:d}:{whole // 60 % 60:02d}:{whole % 60:02d}"


def draw_track(track: Iterable[tuple[float, float]], columns: int = 30, rows: int = 10) -> str:
    """A small map of where the vessel has been: braille dots, north up, the vessel as ``o``.

    `track` is a sequence of (x, y) in metres, oldest first.
    """
    places = list(track)
    if len(places) < 2:
        return ""
    xs, ys = [p[0] for p in places], [p[1] for p in places]
    # A terminal cell is about twice as high as wide: 2 x 4 braille dots make square dots.
    wide, high = 2 * columns, 4 * rows
    scale = max((max(xs) - min(xs)) / (wide - 1), (max(ys) - min(ys)) / (high - 1), 0.1)
    cells = [[0] * columns for _ in range(rows)]
    column = row = 0
    for x, y in places:
        i = int((x - min(xs)) / scale)
        j = high - 1 - int((y - min(ys)) / scale)
        row, column = j // 4, i // 2
        cells[row][column] |= _DOTS[j % 4][i % 2]
    lines = [[chr(0x2800 + bits) if bits else " " for bits in line] for line in cells]
    lines[row][column] = "o"
    text = "\n".join("".join(line).rstrip() for line in lines)
    return f"{text}\n{scale * wide:.0f} m wide"


_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
