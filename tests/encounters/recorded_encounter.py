"""A recorded encounter and the same mission sailed in lockstep, ready to be compared."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.hosts.mission import load_plan

DATA = Path(__file__).parents[1] / "data" / "encounters"
WATCHED = (
    "NAV_X",
    "NAV_Y",
    "IVPHELM_STATE",
    "IVPHELM_LIFE_EVENT",
    "AVOIDING",
    "ENCOUNTER_TOTAL",
    "NEAR_MISS_TOTAL",
    "COLLISION_TOTAL",
)
SETTLE = 30.0
"""Mission seconds before deployment; everybody has found everybody by then."""

Track = np.ndarray  # (n, 3): time, x, y
Pass = tuple[tuple[str, str], float, float]  # who, range, time


class Recorded:
    """What was measured."""

    def __init__(self, name: str) -> None:
        self.folder = DATA / name
        setup: dict[str, Any] = json.loads((self.folder / "expected.json").read_text())
        self.setup = setup
        self.duration: float = setup["duration_s"]
        self.vehicles = sorted(p.stem for p in self.folder.glob("*.bhv"))
        self.events = [tuple(event) for event in setup["events"]]
        with (self.folder / "tracks.csv").open() as file:
            rows = list(csv.DictReader(file))
        self.runs = [
            {
                name: np.array(
                    [
                        [float(r["t"]), float(r[f"{name}_x"]), float(r[f"{name}_y"])]
                        for r in rows
                        if r["run"] == run
                    ]
                )
                for name in self.vehicles
            }
            for run in sorted({row["run"] for row in rows})
        ]


class Sailed:
    """The mission in lockstep: tracks, and every post of the watched variables."""

    def __init__(
        self,
        recorded: Recorded,
        seed: int = 1,
        watched: tuple[str, ...] = WATCHED,
        duration: float | None = None,
    ) -> None:
        self.recorded = recorded
        host = Lockstep(seed, stagger=True)
        self.mail: dict[str, list[Any]] = {}
        for name in ("shoreside", *recorded.vehicles):
            plan = load_plan(str(recorded.folder / f"{name}.moos"))
            # Nobody reads what the loggers would write.
            plan = replace(plan, apps=tuple(app for app in plan.apps if app.name != "pLogger"))
            database = host.add_plan(plan).database
            self.mail[name] = database.connect("watch", host.clock.now())
            for variable in watched:
                database.register("watch", variable, host.clock.now())
        host.run(SETTLE)
        sent = recorded.setup["deployed"]
        for name in ["all"] if sent == recorded.vehicles else sent:
            host.poke(SETTLE, f"MOOS_MANUAL_OVERRIDE_{name.upper()}", "false", "shoreside")
            host.poke(SETTLE, f"DEPLOY_{name.upper()}", "true", "shoreside")
        host.run((duration or recorded.duration) + 5.0)
        assert not host.failures, host.failures
        self.start = min(
            t for name in sent for t, value in self.posts(name, "IVPHELM_STATE") if value == "DRIVE"
        )

    def posts(self, community: str, variable: str) -> list[tuple[float, Any]]:
        """(mission time, value) of all posts."""
        return [(m.time, m.value) for m in self.mail[community] if m.name == variable]

    def since_start(self, community: str, variable: str) -> list[tuple[float, Any]]:
        """(seconds since the first helm drives, value) of the posts since then."""
        return [(t - self.start, v) for t, v in self.posts(community, variable) if t >= self.start]

    def last(self, community: str, variable: str) -> Any:
        return self.posts(community, variable)[-1][1]

    @cached_property
    def tracks(self) -> dict[str, Track]:
        """Every 0.1 s."""
        times = np.arange(0.0, self.recorded.duration, 0.1)
        found = {}
        for name in self.recorded.vehicles:
            columns = [times]
            for variable in ("NAV_X", "NAV_Y"):
                posts = np.array(self.posts(name, variable))
                columns.append(np.interp(times, posts[:, 0] - self.start, posts[:, 1]))
            found[name] = np.stack(columns, axis=1)
        return found

    def ranges(self, pair: tuple[str, str]) -> np.ndarray:
        one, other = (self.tracks[name] for name in pair)
        return np.hypot(*(one[:, 1:] - other[:, 1:]).T)

    def closest(self, pair: tuple[str, str]) -> tuple[float, float]:
        """Least range and its time."""
        ranges = self.ranges(pair)
        least = int(np.argmin(ranges))
        return float(ranges[least]), least * 0.1

    def passes(self) -> list[Pass]:
        """Minima of the range below 60 m that it fell by 5 m to and rose by 5 m from."""
        found: list[Pass] = []
        for pair in combinations(self.recorded.vehicles, 2):
            high, low = 0.0, None
            for k, now in enumerate(self.ranges(pair)):
                if low is None:
                    high = max(high, now)
                    low = (now, k * 0.1) if now < high - 5.0 else None
                elif now < low[0]:
                    low = (now, k * 0.1)
                elif now > low[0] + 5.0:
                    found += [(pair, *low)] if low[0] < 60.0 else []
                    high, low = now, None
        return found


def apart(these: Track, those: Track, window: float = 60.0) -> np.ndarray:
    """Distance of each point of one track to the other curve, looked for within `window` seconds."""
    found = []
    for t, x, y in these:
        near = those[np.abs(those[:, 0] - t) <= window]
        a, b = near[:-1, 1:], near[1:, 1:]
        d = b - a
        square = (d * d).sum(axis=1)
        share = ((x - a[:, 0]) * d[:, 0] + (y - a[:, 1]) * d[:, 1]) / np.where(square > 0.0, square, 1.0)
        foot = a + np.clip(share, 0.0, 1.0)[:, None] * d
        found.append(np.hypot(x - foot[:, 0], y - foot[:, 1]).min())
    return np.array(found)


def track_error(ours: Track, theirs: Track) -> tuple[float, float]:
    """Root mean square and largest distance between two tracks, both ways, at 1 Hz."""
    both = np.concatenate((apart(ours[::10], theirs), apart(theirs, ours[::10])))
    return float(np.sqrt((both**2).mean())), float(both.max())
