"""What one agent remembers of its neighbours: the last opinion of each, in arrays that the kernels read.

Bounded: when `MAX_NEIGHBOURS` are known and all are fresh, no more are taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from opinion_engine.messages import OpinionMessage

MAX_NEIGHBOURS = 1024


@dataclass(slots=True)
class Neighbour:
    """What is held of one neighbour: the last record, when it came and was sent, and how often it was heard."""

    name: str
    group: str
    time: float
    text: str
    dominant: str | None = None  # '' undecided, None never said
    count: int = 0
    sent: float = float("-inf")


class Neighbours:
    """The last records of the neighbours' opinions about `options`; stale after `stale` seconds.

    times (K,), z (K, N_O) and squares (K,) are for `kernels.agent_update`, which counts the first len(self)
    rows that are fresh.
    """

    def __init__(self, options: Sequence[str], stale: float, opinion_thresh: float) -> None:
        self._names = tuple(options)
        self._index = {option: j for j, option in enumerate(self._names)}
        self._stale, self._threshold = stale, opinion_thresh
        self.times = np.zeros(8)
        self.z = np.zeros((8, len(self._names)))
        self.squares = np.zeros(8)
        self._known: list[Neighbour] = []
        self._row_of: dict[str, int] = {}

    def __len__(self) -> int:
        return len(self._known)

    def all(self) -> tuple[Neighbour, ...]:
        """All on record, stale ones included, by name."""
        return tuple(sorted(self._known, key=lambda n: n.name))

    def sent(self, name: str) -> float:
        """When the record held of `name` was sent; -inf if there is none."""
        row = self._row_of.get(name)
        return -np.inf if row is None else self._known[row].sent

    def store(self, record: OpinionMessage, sent: float, now: float, text: str) -> bool:
        """Keep a record that came at `now`, instead of the sender's last one; False if there is no room."""
        row = self._row_of.get(record.vname)
        if row is None:
            row = self._free_row(now)
            if row is None:
                return False
            self._known[row] = Neighbour(record.vname, record.group, now, "")
            self._row_of[record.vname] = row
        neighbour = self._known[row]
        neighbour.sent = sent
        neighbour.time = now
        neighbour.group = record.group or neighbour.group
        neighbour.count += 1
        neighbour.text = text
        dominant = record.dominant(self._threshold)
        if dominant is not None:
            neighbour.dominant = dominant
        self.times[row] = now
        self.z[row] = 0.0
        square = 0.0
        for option, value in record.opinions.items():
            square += value * value
            j = self._index.get(option)
            if j is not None:
                self.z[row, j] = value
        self.squares[row] = square / len(record.opinions) if record.opinions else 0.0
        return True

    def _free_row(self, now: float) -> int | None:
        """A row for a new neighbour: a fresh one, or that of the stalest; None when it is full of fresh ones."""
        count = len(self._known)
        if count < MAX_NEIGHBOURS:
            if count == self.times.size:
                self.times = np.resize(self.times, 2 * count)
                self.squares = np.resize(self.squares, 2 * count)
                self.z = np.vstack([self.z, np.zeros_like(self.z)])
            self._known.append(Neighbour("", "", now, ""))
            return count
        row = int(np.argmin(self.times[:count]))
        if now - self.times[row] <= self._stale:
            return None
        del self._row_of[self._known[row].name]
        return row

    def forget(self) -> None:
        """Start over."""
        self._row_of.clear()
        self._known.clear()

    def by_choice(self, now: float) -> dict[str, tuple[str, ...]]:
        """The fresh ones by dominant option: option name, or '' for the undecided, to sorted names."""
        groups: dict[str, list[str]] = {name: [] for name in (*self._names, "")}
        for row, neighbour in enumerate(self._known):
            if now - self.times[row] < self._stale and neighbour.dominant in groups:
                groups[neighbour.dominant].append(neighbour.name)
        return {option: tuple(sorted(names)) for option, names in groups.items()}
