"""A run of the bloom mission as its logs tell it: where everybody was, what they wanted, what the sea did.

Reads a folder of logs (one of each vessel, one of the shoreside) into arrays over a common clock of one second.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from missions.bloom.environment import STORM_LABEL
from opinion_engine.fleet_log import fleet_history
from opinion_engine.scenario import FleetHistory
from pymoos_lite.geometry.shapes import Circle
from pymoos_lite.records.alog import AlogEntry, read_entries
from pymoos_lite.records.csp import RecordError
from pymoos_lite.records.view import parse_circle
from pymoos_lite.tools.log_reading import LogError, read_log

Floats = NDArray[np.float64]
KEPT = frozenset(
    [
        "NAV_X",
        "NAV_Y",
        "NAV_HEADING",
        "OPTION",
        "OWN_OPINION_STATE",
        "OWN_ATTENTION",
        "CONTACTS_LIST",
        "MODE",
        "NUMBER_OF_SAMPLED_BLOOMS",
    ]
)
RULED = ("RETURNING", "STATION-KEEPING")
"""Modes in which rules have the say, whatever the opinion."""


@dataclass(frozen=True)
class CircleEvent:
    """A circle appears, changes or (None) goes, seconds from the start."""

    time: float
    label: str
    circle: Circle | None


@dataclass(frozen=True)
class RunLog:
    """t (T,) s; x, y, heading (T, N); option (T, N) as index into `options`, -1 while none is followed
    (before the first choice, out of action, on the way home); opinions as in `FleetHistory`; circles in order
    of time. samples (T, N) is the number each vessel has taken."""

    names: tuple[str, ...]
    t: Floats
    x: Floats
    y: Floats
    heading: Floats
    option: NDArray[np.int64]
    opinions: FleetHistory
    circles: tuple[CircleEvent, ...]
    samples: NDArray[np.int64]

    def index(self, seconds: float) -> int:
        """The row of a time, held to the run."""
        return int(np.clip(np.searchsorted(self.t, seconds), 0, self.t.size - 1))

    def circles_at(self, seconds: float) -> dict[str, Circle]:
        """Blooms and storms as they stood at a time, by label."""
        found: dict[str, Circle] = {}
        for event in self.circles:
            if event.time > seconds:
                break
            if event.circle is None:
                found.pop(event.label, None)
            else:
                found[event.label] = event.circle
        return found


def read_run(folder: Path) -> RunLog:
    """Read all logs of a run.

    Raises:
        LogError: there is no vessel's log in the folder, or one cannot be read.
        OpinionError: no log holds an opinion.
    """
    vessels = newest_logs(folder, "LOG_*")
    if not vessels:
        raise LogError(f"{folder}: no vessel's log (a folder LOG_NAME_...) in it")
    logs = {name: _entries(path) for name, path in vessels.items()}
    opinions = fleet_history(logs)
    t, names = opinions.t, tuple(logs)
    columns = {
        variable: np.column_stack([_held(t, _numbers(logs[name], variable)) for name in names])
        for variable in ("NAV_X", "NAV_Y", "NAV_HEADING")
    }
    words = {word: float(i) for i, word in enumerate(opinions.options)}
    chosen = [
        [(e.time, words.get(e.value.strip().lower(), -1.0)) for e in logs[name] if e.name == "OPTION"]
        for name in names
    ]
    option = np.column_stack([_held(t, rows, -1.0) for rows in chosen]).astype(np.int64)
    for i, name in enumerate(names):
        option[~_follows(t, logs[name]), i] = -1
    return RunLog(
        names,
        t,
        columns["NAV_X"],
        columns["NAV_Y"],
        columns["NAV_HEADING"],
        option,
        opinions,
        _circles(folder),
        _samples(t, [logs[name] for name in names]),
    )


def newest_logs(folder: Path, pattern: str) -> dict[str, Path]:
    """The latest log folder of each name: a folder may hold several runs."""
    found: dict[str, Path] = {}
    for path in sorted(folder.glob(pattern), key=lambda p: (p.stat().st_mtime, p.name)):
        if path.is_dir() and len(path.name.split("_")) > 1:
            found[path.name.split("_")[1].lower()] = path
    return dict(sorted(found.items()))


def _entries(path: Path) -> list[AlogEntry]:
    return [entry for entry in read_entries(read_log(str(path))) if entry.name in KEPT]


def _follows(t: Floats, entries: Iterable[AlogEntry]) -> NDArray[np.bool_]:
    """When the vessel does what it chose: always, as far as a log without modes tells."""
    rows = [
        (e.time, float(e.value.startswith("ACTIVE") and not e.value.strip().endswith(RULED)))
        for e in entries
        if e.name == "MODE"
    ]
    return _held(t, rows, 0.0 if rows else 1.0) > 0.0


def _samples(t: Floats, logs: Iterable[list[AlogEntry]]) -> NDArray[np.int64]:
    """What each vessel has counted; the count is posted as text."""
    columns = []
    for entries in logs:
        counts = [(e.time, e.value.strip()) for e in entries if e.name == "NUMBER_OF_SAMPLED_BLOOMS"]
        columns.append(_held(t, [(time, float(text)) for time, text in counts if text.isdigit()], 0.0))
    return np.column_stack(columns).astype(np.int64)


def _numbers(entries: Iterable[AlogEntry], variable: str) -> list[tuple[float, float]]:
    return [(e.time, e.number) for e in entries if e.name == variable and e.number is not None]


def _held(t: Floats, rows: list[tuple[float, float]], before: float | None = None) -> Floats:
    """The last value at each time; before the first `before`, or the first value itself."""
    if not rows:
        return np.full(t.size, 0.0 if before is None else before)
    rows = sorted(rows, key=lambda row: row[0])
    first = rows[0][1] if before is None else before
    at = np.searchsorted([time for time, _ in rows], t, side="right")
    return np.concatenate([[first], [value for _, value in rows]])[at]


def _circles(folder: Path) -> tuple[CircleEvent, ...]:
    found = []
    for path in newest_logs(folder, "XLOG_*").values():
        for entry in read_entries(read_log(str(path))):
            if entry.name != "VIEW_CIRCLE":
                continue
            try:
                circle = parse_circle(entry.value)
            except RecordError:
                continue
            if not circle.label.startswith(("Bloom_", STORM_LABEL)):
                continue  # somebody else's circle, such as those of the option markers
            found.append(CircleEvent(entry.time, circle.label, circle if circle.attributes.active else None))
    return tuple(sorted(found, key=lambda event: event.time))
