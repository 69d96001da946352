"""Who came too close to whom, and why: read from the logs of a run.

A vessel that samples lies still, or drifts to a stop, with its collision avoidance off (gcid.md 15), so nobody but
the other one keeps clear; and two that both sample may come to lie so close that setting out again is a collision.
Hence what counts is not only the moment of the closest approach but all the time for which they had been within
`CONTENT` of each other. Avoidance weighs courses as if a vessel were on them at once (behaviors.md C6); one that has
to turn round for its new aim first sweeps through what it wanted to keep clear of. Distances are metres, angles
degrees, times seconds from the start of the logs.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import hypot, inf
from pathlib import Path
from typing import TypeVar

from missions.bloom.run_log import newest_logs
from pymoos_lite.geometry.angles import angle180
from pymoos_lite.records.alog import AlogEntry, read_entries
from pymoos_lite.records.csp import RecordError, field_map
from pymoos_lite.tools.log_reading import LogError, read_log

T = TypeVar("T")

CLOSE = ("collision", "near_miss")
LOOK_BACK = 120.0
"""Seconds before a report within which its closest approach is looked for: it comes when both have parted."""
CONTENT = 10.0
"""From here on avoidance has nothing to wish for (``max_util_cpa_dist`` in meta_vehicle.bhv)."""
TURN = 90.0
"""A vessel that has turned by more than this while another was near was turning round."""

CAUSES = {
    "sampling": "one of them sampled, its avoidance off, after they had come within 10 m",
    "start": "they were placed within 10 m of each other",
    "turning": "with avoidance at work on both, one turned by more than 90 degrees after they had come within 10 m",
    "avoidance": "with avoidance at work on both, and neither turned round",
}
"""Why two vessels came too close, in the order in which it is asked."""


@dataclass(frozen=True)
class Vessel:
    """What of a vessel's log matters here: (time, x, y), (time, mode), (time, whether sampling), (time, heading)."""

    track: Sequence[tuple[float, float, float]]
    modes: Sequence[tuple[float, str]]
    sampling: Sequence[tuple[float, bool]]
    headings: Sequence[tuple[float, float]]


@dataclass(frozen=True)
class Encounter:
    """One closest approach: `cpa` as the referee measured it, `time` and `doing` of both when it was."""

    time: float
    rank: str
    cpa: float
    names: tuple[str, str]
    doing: tuple[str, str]
    cause: str
    """One of `CAUSES`."""

    def __str__(self) -> str:
        both = " and ".join(f"{name} ({doing})" for name, doing in zip(self.names, self.doing, strict=True))
        return f"{self.time:7.0f} s  {self.rank.replace('_', ' '):9}  {self.cpa:5.2f} m  {both}: {self.cause}"


def read_encounters(folder: Path) -> list[Encounter]:
    """Every collision and near miss of a run, in order of time.

    Raises:
        LogError: there is no vessel's or no shoreside's log in the folder, one cannot be read, or not all
            that was counted is told of.
    """
    vessels = {
        name: _vessel(read_entries(read_log(str(p)))) for name, p in newest_logs(folder, "LOG_*").items()
    }
    shores = newest_logs(folder, "XLOG_*")
    if not vessels or not shores:
        raise LogError(
            f"{folder}: it takes the logs of the vessels (LOG_NAME_...) and of the shoreside (XLOG_...)"
        )
    found, counted = [], 0.0
    for path in shores.values():
        totals = {"COLLISION_TOTAL": 0.0, "NEAR_MISS_TOTAL": 0.0}
        for entry in read_entries(read_log(str(path))):
            if entry.name in totals:
                totals[entry.name] = entry.number or 0.0
            elif entry.name == "UCD_REPORT":
                met = _encounter(entry, vessels)
                if met is not None:
                    found.append(met)
        counted += sum(totals.values())
    if counted > len(found):
        raise LogError(
            f"{folder}: {counted:.0f} were counted, but the logs tell of {len(found)}: a run with LOGGING=full tells"
        )
    return sorted(found, key=lambda met: met.time)


def encounter_lines(runs: Mapping[str, Sequence[Encounter]]) -> list[str]:
    """One line for each, behind the name of its run where there are several, and how many of each cause."""
    lines = [f"{name}: {met}" if len(runs) > 1 else str(met) for name, found in runs.items() for met in found]
    for rank, words in zip(CLOSE, ("collisions", "near misses"), strict=True):
        of_rank = [met for found in runs.values() for met in found if met.rank == rank]
        lines.append(f"{len(of_rank)} {words}")
        for cause, meaning in CAUSES.items():
            count = sum(met.cause == cause for met in of_rank)
            if count:
                lines.append(f"  {count} {cause}: {meaning}")
    return lines


def _encounter(entry: AlogEntry, vessels: Mapping[str, Vessel]) -> Encounter | None:
    try:
        fields = field_map("UCD_REPORT", entry.value)
        rank, cpa = fields["rank"], float(fields["cpa"])
        names = (fields["vname1"].lower(), fields["vname2"].lower())
    except (RecordError, KeyError, ValueError):
        return None
    if rank not in CLOSE or any(name not in vessels for name in names):
        return None
    one, other = (vessels[name] for name in names)
    time = closest_time(one.track, other.track, entry.time - LOOK_BACK, entry.time)
    doing = tuple(
        "sampling"
        if _at(v.sampling, time, False)
        else _at(v.modes, time, "").rpartition(":")[2].lower() or "unknown"
        for v in (one, other)
    )
    return Encounter(time, rank, cpa, names, (doing[0], doing[1]), _cause(one, other, time))


def _cause(one: Vessel, other: Vessel, time: float) -> str:
    """Why the two came too close at a time."""
    since = close_since(one.track, other.track, time)
    begin = -inf if since is None else since
    for vessel in (one, other):
        if _at(vessel.sampling, begin, False) or any(
            begin <= at <= time and busy for at, busy in vessel.sampling
        ):
            return "sampling"
    if since is None:  # not even the first positions were farther apart
        return "start"
    turned = any(widest_turn(vessel.headings, since, time) > TURN for vessel in (one, other))
    return "turning" if turned else "avoidance"


def widest_turn(headings: Sequence[tuple[float, float]], begin: float, end: float) -> float:
    """By how much (time, heading) has turned between two times: from the leftmost to the rightmost, degrees."""
    angle = low = high = 0.0
    within = headings[max(0, bisect_right(headings, (begin, inf)) - 1) : bisect_right(headings, (end, inf))]
    for (_, former), (_, heading) in pairwise(within):
        angle += angle180(heading - former)
        low, high = min(low, angle), max(high, angle)
    return high - low


def close_since(
    one: Sequence[tuple[float, float, float]], other: Sequence[tuple[float, float, float]], time: float
) -> float | None:
    """When two tracks of (time, x, y), closer than `CONTENT` at a time, last came so close; None: always were."""
    since = time
    for at, x, y in reversed(one[: bisect_right(one, (time, inf, inf))]):
        i = bisect_right(other, (at, inf, inf)) - 1
        if i >= 0 and hypot(other[i][1] - x, other[i][2] - y) >= CONTENT:
            return since
        since = at
    return None


def closest_time(
    one: Sequence[tuple[float, float, float]],
    other: Sequence[tuple[float, float, float]],
    begin: float,
    end: float,
) -> float:
    """When two tracks of (time, x, y) were closest between two times; `end` if they say nothing of it."""
    best, at = inf, end
    for time, x, y in one[bisect_right(one, (begin, -inf, -inf)) : bisect_right(one, (end, inf, inf))]:
        i = bisect_right(other, (time, inf, inf)) - 1
        if i >= 0 and (away := hypot(other[i][1] - x, other[i][2] - y)) <= best:
            best, at = away, time
    return at


def _at(rows: Sequence[tuple[float, T]], time: float, before: T) -> T:
    """The last value at a time."""
    i = bisect_right(rows, time, key=lambda row: row[0]) - 1
    return rows[i][1] if i >= 0 else before


def _vessel(entries: Iterable[AlogEntry]) -> Vessel:
    track: list[tuple[float, float, float]] = []
    modes: list[tuple[float, str]] = []
    sampling: list[tuple[float, bool]] = []
    headings: list[tuple[float, float]] = []
    x: float | None = None
    for entry in entries:
        if entry.name == "NAV_X":
            x = entry.number
        elif entry.name == "NAV_Y" and x is not None and entry.number is not None:
            track.append((entry.time, x, entry.number))
        elif entry.name == "NAV_HEADING" and entry.number is not None:
            headings.append((entry.time, entry.number))
        elif entry.name == "MODE":
            modes.append((entry.time, entry.value.strip()))
        elif entry.name == "WAIT_TO_SAMPLE":
            sampling.append((entry.time, entry.value.strip() == "true"))
    return Vessel(sorted(track), modes, sampling, sorted(headings))
