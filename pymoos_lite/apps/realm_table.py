"""The tables of realm casts: rows of variables with source, time, community and value (community.md 11)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from pymoos_lite.core.message import Message
from pymoos_lite.records.csp import num

_LONG_REPORTS = frozenset({"APPCAST", "REALMCAST", "BHV_IPF", "DB_RWSUMMARY", "DB_VARSUMMARY"})


@dataclass(frozen=True, slots=True)
class TableStyle:
    """What is shown. `start` is the mission time that counts as 0, None for times in UTC.

    `wrap` and `trunc` are lengths in characters, 0 for none; `mask` hides variables without value.
    """

    start: float | None = 0.0
    source: bool = True
    community: bool = True
    wrap: int = 0
    trunc: int = 0
    mask: bool = False


def shown_value(message: Message) -> str:
    """A value as one line of text, without what no person reads."""
    value = message.value
    if isinstance(value, float):
        return num(value, 6)
    if isinstance(value, bytes):
        return "binary"
    if message.name in _LONG_REPORTS:
        return "formatted report"
    if message.name.endswith("_STATUS"):
        value = value.partition("MOOSName")[0]
    # What separates the lines of a cast may not stand in one.
    return " ".join(value.split()).replace("!Z!", " ").replace("!Q!", " ")


def variable_table(title: str, rows: Iterable[tuple[str, Message | None]], style: TableStyle) -> list[str]:
    """A headed table of variables; those never posted show `-  never`."""
    cells: list[list[str]] = []
    for name, message in rows:
        if message is None:
            if not style.mask:
                cells.append(_picked([name, "-", "never", "", ""], style))
            continue
        place = [name, message.origin, _time(message, style), message.community, shown_value(message)]
        cells.append(_picked(place, style))
    heading = _picked(["Variable", "Source", "Time", "Comm", "Value"], style)
    return [title, "=" * len(title), *_aligned(heading, cells, style), ""]


def history_table(messages: Sequence[Message], style: TableStyle, *, named: bool) -> list[str]:
    """A headed table of posts, oldest first; `named` for histories of several variables."""
    cells = []
    for message in messages:
        place = [message.name, message.origin, _time(message, style), message.community, shown_value(message)]
        cells.append(_picked(place, style, named=named))
    heading = _picked(["Variable", "Source", "Time", "Comm", "Value"], style, named=named)
    return _aligned(heading, cells, style)


def _time(message: Message, style: TableStyle) -> str:
    return num(message.time - (style.start or 0.0), 2)


def _picked(cells: list[str], style: TableStyle, *, named: bool = True) -> list[str]:
    shown = (named, style.source, True, style.community, True)
    return [cell for cell, keep in zip(cells, shown, strict=True) if keep]


def _aligned(heading: list[str], rows: list[list[str]], style: TableStyle) -> list[str]:
    """Columns padded to their widest cell; the last one cut or wrapped."""
    widths = [max(len(row[i]) for row in (heading, *rows)) for i in range(len(heading) - 1)]
    rule = ["-" * width for width in widths] + ["-" * 20]
    lines: list[str] = []
    for row in (heading, rule, *rows):
        head = "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=False))
        value = row[-1]
        if style.trunc and len(value) > style.trunc:
            value = value[: style.trunc] + "..."
        pieces = (
            [value[i : i + style.wrap] for i in range(0, len(value), style.wrap)] if style.wrap else [value]
        )
        for number, piece in enumerate(pieces or [""]):
            lines.append(f"{head if number == 0 else ' ' * len(head)}  {piece}".rstrip())
    return lines
