"""The variables that a database publishes about itself (community.md 6.2).

Only those that somebody subscribes to are worked out: a summary of a hundred variables costs more
than all the mail of a quiet community.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator
from typing import TYPE_CHECKING

from pymoos_lite.core.message import KIND_LETTER, Value

if TYPE_CHECKING:
    from pymoos_lite.core.database import Database


def build_system_variables(
    database: Database, wanted: Collection[str], now: float
) -> Iterator[tuple[str, Value]]:
    """Name and value of each wanted `DB_*` variable at mission time `now`."""
    for name, build in SYSTEM_VARIABLES.items():
        if name in wanted:
            yield name, build(database, now)


def _time(database: Database, now: float) -> Value:
    return now


def _uptime(database: Database, now: float) -> Value:
    return now - database.started


def _clients(database: Database, now: float) -> Value:
    # A comma after every name, the last one too: stock readers expect it.
    return "".join(f"{name}," for name in database.clients())


def _quality(database: Database, now: float) -> Value:
    parts = []
    for client in database.connected():
        ages = [1000.0 * age for age in client.latencies]
        if not ages:
            parts.append(f"{client.name}=0:0:0:0,")
            continue
        recent, mean = (ages[-1], sum(ages) / len(ages)) if len(ages) >= 5 else (0.0, 0.0)
        parts.append(f"{client.name}={recent:.3g}:{max(ages):.3g}:{min(ages):.3g}:{mean:.3g},")
    return "".join(parts)


def _read_write(database: Database, now: float) -> Value:
    parts = []
    for client in database.connected():
        subscribed = [record.name for record in database.records() if client.wishes(record.name)]
        parts.append(f"{client.name}={':'.join(subscribed)}&{':'.join(client.published)}")
    return ",".join(parts)


def _variables(database: Database, now: float) -> Value:
    lines = []
    for record in sorted(database.records(), key=lambda r: r.name):
        record.rate = 0.5 * record.rate + 0.5 * (record.writes - record.last_writes) / 2.0
        record.last_writes = record.writes
        message = record.message
        if message is None:
            lines.append(f"{record.name:<20} {'':<20} {'(write pending)':<20} {record.rate:.1f}Hz")
            continue
        value = message.value
        if isinstance(value, bytes):
            shown = f"*binary* {len(value)} B"
        elif isinstance(value, str):
            shown = value if len(value) <= 25 else value[:22] + "..."
        else:
            shown = f"{value:.6g}"
        stamp = time.strftime("%H:%M:%S", time.gmtime(message.time)) + f".{int(message.time % 1 * 1000):03d}"
        lines.append(
            f"{record.name:<20} {stamp:<20} {message.source:<20} {record.rate:.1f}Hz "
            f"{KIND_LETTER[type(value)]} {shown}"
        )
    return "\n".join(lines)


SYSTEM_VARIABLES: dict[str, Callable[[Database, float], Value]] = {
    "DB_TIME": _time,
    "DB_UPTIME": _uptime,
    "DB_CLIENTS": _clients,
    "DB_QOS": _quality,
    "DB_RWSUMMARY": _read_write,
    "DB_VARSUMMARY": _variables,
}
