"""`pymoos log scan`: who posted what, how often and how much (community.md 13)."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from pymoos_lite.records.alog import AlogEntry, AlogHeader, read_entries
from pymoos_lite.tools.log_reading import LogError, read_log, split_words

ORDERS = ("vars", "start", "stop", "proc", "chars", "lines")


@dataclass(slots=True)
class VariableUse:
    """What a log says about one variable; times in seconds since LOGSTART."""

    name: str
    lines: int = 0
    chars: int = 0
    start: float = float("inf")
    stop: float = float("-inf")
    sources: dict[str, int] = field(default_factory=dict)


@dataclass(slots=True)
class LogSummary:
    """All variables of a log."""

    uses: dict[str, VariableUse] = field(default_factory=dict)

    def add(self, entry: AlogEntry, *, aux: bool) -> None:
        use = self.uses.get(entry.name)
        if use is None:
            use = self.uses[entry.name] = VariableUse(entry.name)
        use.lines += 1
        use.chars += len(entry.value)
        use.start = min(use.start, entry.time)
        use.stop = max(use.stop, entry.time)
        source = entry.source if aux else entry.app
        use.sources[source] = use.sources.get(source, 0) + 1

    @property
    def lines(self) -> int:
        return sum(use.lines for use in self.uses.values())

    @property
    def chars(self) -> int:
        return sum(use.chars for use in self.uses.values())

    @property
    def span(self) -> tuple[float, float]:
        if not self.uses:
            return 0.0, 0.0
        return min(u.start for u in self.uses.values()), max(u.stop for u in self.uses.values())

    def rate(self) -> float:
        """Characters of values per second."""
        start, stop = self.span
        return self.chars / (stop - start) if stop > start else 0.0


def summarise(entries: Iterable[AlogEntry], *, aux: bool = True) -> LogSummary:
    """Count everything; `aux` keeps `app:aux` sources apart."""
    summary = LogSummary()
    for entry in entries:
        summary.add(entry, aux=aux)
    return summary


def add_scan(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("words", nargs="+", metavar="LOG.alog", help="the log, or its folder")
    parser.add_argument("--sort", choices=ORDERS, default="vars", help="order of the rows (default vars)")
    parser.add_argument("-r", "--reverse", action="store_true", help="the other way round")
    parser.add_argument("--appstat", action="store_true", help="also a table by app")
    parser.add_argument("-l", "--loglist", action="store_true", help="only the names of the variables")
    parser.add_argument("-n", "--nocolors", action="store_true", help="accepted: the table has no colours")
    parser.add_argument("--noaux", action="store_true", help="sources without their :aux")
    parser.add_argument("--rate_only", action="store_true", help="only the data rate")


def run_scan(args: argparse.Namespace) -> int:
    logs, others = split_words(args.words)
    if others or not logs:
        raise LogError(f"expected log files ending in .alog, found '{others[0] if others else ''}'")
    for log in logs:
        header = AlogHeader()
        summary = summarise(read_entries(read_log(log), header), aux=not args.noaux)
        if len(logs) > 1:
            print(f"\n{log}")
        if args.rate_only:
            print(f"{summary.rate():.2f}")
        elif args.loglist:
            for use in ordered(summary, args.sort, args.reverse):
                print(use.name)
        else:
            print("\n".join(table(summary, header.start, args.sort, args.reverse)))
            if args.appstat:
                print("\n".join(app_table(summary)))
    return 0


def ordered(summary: LogSummary, order: str, reverse: bool = False) -> list[VariableUse]:
    """Variables in one of ORDERS; big numbers come last, as in the reference, unless reversed."""
    keys: dict[str, Callable[[VariableUse], object]] = {
        "vars": lambda use: use.name,
        "start": lambda use: use.start,
        "stop": lambda use: use.stop,
        "proc": lambda use: sorted(use.sources),
        "chars": lambda use: use.chars,
        "lines": lambda use: use.lines,
    }
    rows = sorted(summary.uses.values(), key=lambda use: use.name)
    rows.sort(key=keys[order], reverse=reverse)  # type: ignore[arg-type]
    return rows


def table(summary: LogSummary, log_start: float, order: str = "vars", reverse: bool = False) -> list[str]:
    """Lines of the report."""
    uses = ordered(summary, order, reverse)
    width = max([len(use.name) for use in uses] + [13])
    head = f"{'Variable Name':<{width}}  {'Lines':>7}  {'Chars':>9}  {'Start':>9}  {'Stop':>9}  Sources"
    rule = "-" * width + "  -------  ---------  ---------  ---------  " + "-" * 28
    rows = [
        f"{use.name:<{width}}  {use.lines:>7}  {use.chars:>9}  {use.start:>9.2f}  {use.stop:>9.2f}  "
        f"{','.join(sorted(use.sources))}"
        for use in uses
    ]
    start, stop = summary.span
    totals = [
        f"Total variables: {len(uses)}",
        f"Total lines:     {summary.lines}",
        f"Total chars:     {summary.chars}",
        f"LOGSTART:        {log_start:.5f}",
        f"Start/Stop time: {start:.2f} / {stop:.2f}",
        f"Data rate:       {summary.rate():.2f} chars/sec",
    ]
    return [head, rule, *rows, rule, *totals]


def app_table(summary: LogSummary) -> list[str]:
    """Lines of posts by app, with their share."""
    counts: dict[str, int] = {}
    for use in summary.uses.values():
        for source, lines in use.sources.items():
            app = source.partition(":")[0]
            counts[app] = counts.get(app, 0) + lines
    total = max(summary.lines, 1)
    width = max([len(app) for app in counts] + [3])
    rows = [
        f"{app:<{width}}  {lines:>7}  {100 * lines / total:>6.2f}" for app, lines in sorted(counts.items())
    ]
    return ["", f"{'App':<{width}}  {'Lines':>7}  {'%':>6}", "-" * (width + 17), *rows]
