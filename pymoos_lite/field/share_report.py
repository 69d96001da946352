"""What a share counts, and how it shows it to a person."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol

from pymoos_lite.app import Address, DatagramPort
from pymoos_lite.core.subscriptions import matches
from pymoos_lite.field.letterbox import Inbox, Outbox
from pymoos_lite.field.routes import Endpoint, OutputTable


@dataclass(slots=True, eq=False)
class Input:
    """A place we listen at; `port` is None while it cannot be opened."""

    at: Endpoint
    white_list: tuple[str, ...]
    port: DatagramPort | None = None
    taken: int = 0
    filtered: int = 0
    retry_at: float = 0.0

    def lets_in(self, name: str) -> bool:
        return not self.white_list or any(matches(p, name) for p in self.white_list)


@dataclass(slots=True, eq=False)
class Destination:
    """An address we send to."""

    endpoint: Endpoint
    address: Address
    outbox: Outbox
    datagrams: int = 0
    bytes: int = 0
    failed: int = 0


@dataclass(slots=True)
class Drops:
    """Messages that went no further, by reason."""

    looped: int = 0
    echoed: int = 0
    oversized: int = 0
    refused: int = 0
    commands: int = 0
    strangers: int = 0
    silenced: int = 0


class Shown(Protocol):
    """What a share keeps that a person wants to see."""

    inputs: list[Input]
    destinations: dict[Endpoint, Destination]
    table: OutputTable
    inbox: Inbox
    drops: Drops


def share_report(share: Shown) -> Iterator[str]:
    """The lines of a share's report."""
    yield "Listening at"
    for entry in share.inputs:
        state = "" if entry.port is not None else "  (not open)"
        allowed = f"  white list {' & '.join(entry.white_list)}" if entry.white_list else ""
        yield f"  {entry.at}: {entry.taken} messages, {entry.filtered} filtered{allowed}{state}"
    yield "Heard from                     messages  letters  lost  delay (s)"
    for stream in share.inbox.streams.values():
        who = f"{stream.community or '?'} {stream.sender[0]}:{stream.sender[1]}"
        counts = f"{stream.messages:>8} {stream.received:>8} {stream.lost:>5}"
        yield f"  {who:<28} {counts}  {stream.delay:.2f}"
    yield "Sending to                     datagrams      bytes  not sent"
    for target in share.destinations.values():
        yield f"  {target.endpoint!s:<28} {target.datagrams:>9} {target.bytes:>10} {target.failed:>9}"
    yield "Routes"
    for output in share.table.outputs():
        held = f", {output.skipped} held back" if output.skipped else ""
        yield f"  {output.source} -> {output.name}:{output.share.to}  {output.shares} sent, {output.bytes} bytes{held}"
    yield "Thrown away"
    yield from _drop_lines(share.inbox, share.drops) or ["  nothing"]


def _drop_lines(inbox: Inbox, drops: Drops) -> list[str]:
    rows: Iterable[tuple[str, int]] = (
        *((fault.value, n) for fault, n in sorted(inbox.faults.items(), key=lambda f: f[0].name)),
        ("from addresses not allowed", drops.strangers),
        ("shared out under the same name", drops.looped),
        ("would have gone back where they came from", drops.echoed),
        ("too long to share", drops.oversized),
        ("refused by the database", drops.refused),
        ("during an outage", drops.silenced),
        ("commands not understood", drops.commands),
    )
    return [f"  {count:>6}  {text}" for text, count in rows if count]
