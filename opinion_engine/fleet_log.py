"""The history of a fleet's opinions from its vessels' logs, in the form the figures want.

Log entries in, arrays out; opening the files is the caller's business.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Protocol

import numpy as np

from opinion_engine.messages import MessageError, parse_text
from opinion_engine.model import Floats, OpinionError
from opinion_engine.scenario import FleetHistory


class LogEntry(Protocol):
    """One logged post: seconds since the log began, variable, value as text."""

    @property
    def time(self) -> float: ...
    @property
    def name(self) -> str: ...
    @property
    def value(self) -> str: ...


def fleet_history(logs: Mapping[str, Iterable[LogEntry]], step: float = 1.0) -> FleetHistory:
    """Opinions, attention and degree of every vessel, every `step` seconds, from entries by vessel name.

    Reads OWN_OPINION_STATE, OWN_ATTENTION and CONTACTS_LIST; the last value holds until the next. Options are
    those of the messages, in their order; an option that is not active at a time is 0 then. Attention is NaN
    before its first value. Raises OpinionError if no log holds an opinion.
    """
    opinions: dict[str, list[tuple[float, dict[str, float]]]] = {name: [] for name in logs}
    attention: dict[str, list[tuple[float, float]]] = {name: [] for name in logs}
    contacts: dict[str, list[tuple[float, float]]] = {name: [] for name in logs}
    options: dict[str, None] = {}
    for vessel, entries in logs.items():
        for entry in entries:
            if entry.name == "OWN_OPINION_STATE":
                try:
                    said = parse_text(entry.value).opinions
                except MessageError:
                    continue
                options.update(dict.fromkeys(said))
                opinions[vessel].append((entry.time, dict(said)))
            elif entry.name == "OWN_ATTENTION":
                try:
                    attention[vessel].append((entry.time, float(entry.value)))
                except ValueError:
                    continue
            elif entry.name == "CONTACTS_LIST":
                names = [part for part in entry.value.split(",") if part.strip()]
                contacts[vessel].append((entry.time, float(len(names))))
    last = max((rows[-1][0] for rows in opinions.values() if rows), default=None)
    if last is None or not options:
        raise OpinionError(f"no OWN_OPINION_STATE in the logs of {', '.join(logs) or 'nobody'}")
    times = np.arange(0.0, last + step, step)
    z = np.zeros((times.size, len(logs), len(options)))
    u, degree = np.zeros((times.size, len(logs))), np.zeros((times.size, len(logs)))
    for k, vessel in enumerate(logs):
        for j, option in enumerate(options):
            z[:, k, j] = _held(times, [(t, said.get(option, 0.0)) for t, said in opinions[vessel]])
        u[:, k] = _held(times, attention[vessel], np.nan)
        degree[:, k] = _held(times, contacts[vessel])
    return FleetHistory(times, z, u, degree, tuple(logs), tuple(options))


def _held(times: Floats, rows: list[tuple[float, float]], before: float = 0.0) -> Floats:
    """The last value at each time, `before` the first what that says."""
    if not rows:
        return np.full(times.size, before)
    rows = sorted(rows, key=lambda row: row[0])
    at = np.searchsorted([t for t, _ in rows], times, side="right")
    return np.concatenate([[before], [value for _, value in rows]])[at]
