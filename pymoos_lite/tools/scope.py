"""``pymoos scope [VAR ...]``: a live table of a running community's variables."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING

from pymoos_lite.core.message import Message
from pymoos_lite.hosts.mission import MissionError
from pymoos_lite.tools.client import UnreachableError, add_client_arguments, connect, mission_like

if TYPE_CHECKING:
    from rich.table import Table

    from pymoos_lite.hosts.ports import RemoteClient

ONCE_WAIT = 1.0
"""Wall seconds that `--once` listens for variables that have no value yet."""

HEADINGS = ("Variable", "Source", "Time", "Community", "Value")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "words", nargs="*", metavar="VAR", help="variables; * and ? are wildcards; default: all of them"
    )
    parser.add_argument("--once", action="store_true", help="print the table once and end (for scripts)")
    parser.add_argument("--csv", action="store_true", help="with --once: comma-separated, values in full")
    parser.add_argument(
        "--source", default="*", metavar="APP", help="only posts of this app (wildcards allowed)"
    )
    parser.add_argument("--width", type=int, default=0, metavar="N", help="cut values to N characters")
    parser.add_argument(
        "--events", action="store_true", help="print every post as it comes instead of a table"
    )
    add_client_arguments(parser)


def run(args: argparse.Namespace) -> int:
    names = []
    for word in args.words:
        if mission_like(word):
            args.mission = word
        else:
            names.append(word)
    try:
        client = connect(args, "pymoos_scope")
    except (UnreachableError, MissionError) as error:
        print(f"pymoos scope: {error}", file=sys.stderr)
        return 1
    for name in names or ["*"]:
        client.register(name, source=args.source)
    scope = Scope(names)
    try:
        if args.once:
            return _once(client, scope, args)
        return _events(client, args) if args.events else _live(client, scope, args)
    except KeyboardInterrupt:
        return 0
    finally:
        client.close()


class Scope:
    """The last message of each variable; those asked for by exact name are listed even unseen."""

    def __init__(self, names: Iterable[str]) -> None:
        self.exact = [name for name in names if not any(c in name for c in "*?")]
        self.last: dict[str, Message] = {}
        self.counts: dict[str, int] = {}

    def take(self, mail: Iterable[Message]) -> None:
        for message in mail:
            self.last[message.name] = message
            self.counts[message.name] = self.counts.get(message.name, 0) + 1

    @property
    def complete(self) -> bool:
        """Whether every variable asked for by name has been seen."""
        return bool(self.exact) and all(name in self.last for name in self.exact)

    def rows(self, now: float, width: int = 0) -> list[tuple[str, str, str, str, str]]:
        """Name, source, age in mission seconds, community and value of every variable, by name."""
        rows = []
        for name in sorted({*self.last, *self.exact}):
            message = self.last.get(name)
            if message is None:
                rows.append((name, "n/a", "n/a", "n/a", "n/a"))
                continue
            value = f'"{message.value}"' if isinstance(message.value, str) else message.text
            value = value.replace("\n", " ")
            if width > 0 and len(value) > width:
                value = value[: max(1, width - 1)] + "…"
            age = now - message.time
            rows.append((name, message.origin, f"{age:.2f}", message.community, value))
        return rows


def _once(client: RemoteClient, scope: Scope, args: argparse.Namespace) -> int:
    end = client.clock.wall() + ONCE_WAIT
    client.flush(args.timeout)
    while not scope.complete and client.clock.wall() < end:
        scope.take(client.poll(0.05))
    rows = scope.rows(client.clock.now(), args.width)
    if args.csv:
        import csv

        writer = csv.writer(sys.stdout)
        writer.writerow(HEADINGS)
        writer.writerows(rows)
    else:
        widths = [max(len(row[i]) for row in [HEADINGS, *rows]) for i in range(4)]
        for row in [HEADINGS, *rows]:
            print("  ".join(f"{row[i]:<{widths[i]}}" for i in range(4)) + "  " + row[4])
    unseen = [name for name in scope.exact if name not in scope.last]
    return 1 if unseen else 0


def _events(client: RemoteClient, args: argparse.Namespace) -> int:
    while True:
        for message in client.poll(0.2):
            value = f'"{message.value}"' if isinstance(message.value, str) else message.text
            print(f"{message.time:.2f}  {message.name:<20}  {message.origin:<20}  {value}", flush=True)


def _live(client: RemoteClient, scope: Scope, args: argparse.Namespace) -> int:
    from rich.live import Live

    with Live(auto_refresh=False) as live:
        next_draw = 0.0
        while True:
            scope.take(client.poll(0.1))
            wall = client.clock.wall()
            if wall >= next_draw:
                next_draw = wall + 0.25
                live.update(_table(scope, client, args), refresh=True)


def _table(scope: Scope, client: RemoteClient, args: argparse.Namespace) -> Table:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    state = "" if client.connected else "  (not connected, trying again)"
    table = Table(title=f"{client.community}{state}", box=box.SIMPLE_HEAD)
    for heading in HEADINGS:
        table.add_column(heading, overflow="ellipsis", no_wrap=True)
    for row in scope.rows(client.clock.now(), args.width):
        fresh = row[2] != "n/a" and float(row[2]) < 1.0
        table.add_row(*(Text(cell, style="bold" if fresh else "") for cell in row))
    return table
