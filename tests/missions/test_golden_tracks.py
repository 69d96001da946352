"""Whole missions in lockstep sail the tracks that were measured on the reference implementation."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.hosts.mission import load_plan

DATA = Path(__file__).parents[1] / "data" / "tracks"
HIT_TOLERANCE = 5.0
"""Seconds by which the time of reaching a point may differ."""


class Track:
    """A sailed mission: samples at 1 Hz from the moment of deployment, and posts of chosen variables."""

    def __init__(self, name: str, folder: Path, watched: tuple[str, ...], duration: float) -> None:
        self.name = name
        self.setup: dict[str, Any] = json.loads((DATA / f"{name}.json").read_text())
        (folder / "m.moos").write_text(mission_text(self.setup))
        (folder / "m.bhv").write_text(behavior_text(name, self.setup))
        host = Lockstep(seed=1)
        community = host.add_plan(load_plan(str(folder / "m.moos"), {}))
        assert not host.failures
        mailbox = community.database.connect("watch", host.clock.now())
        for variable in (*watched, "NAV_X", "NAV_Y", "NAV_SPEED"):
            community.database.register("watch", variable, host.clock.now())
        host.run(3.0)
        start = host.clock.now()
        for variable, value in (("MOOS_MANUAL_OVERRIDE", "false"), ("DEPLOY", "true"), ("RETURN", "false")):
            host.poke(host.elapsed, variable, value)
        for at, variable, value, *_ in self.setup["events"]:
            if variable == "STATION":
                host.poke(host.elapsed + at, variable, value)
        mailbox.clear()
        host.run(duration)
        assert not host.failures, host.failures
        self.events = [(m.time - start, m.name, m.value) for m in mailbox if m.name in watched]
        self.x, self.y, self.speed = (
            np.array([m.value for m in mailbox if m.name == variable])
            for variable in ("NAV_X", "NAV_Y", "NAV_SPEED")
        )
        self.times = np.array([m.time - start for m in mailbox if m.name == "NAV_X"])

    def reference(self) -> dict[str, np.ndarray]:
        """The measured track, by column; missing values are NaN."""
        with (DATA / f"{self.name}.csv").open() as file:
            rows = list(csv.DictReader(file))
        return {key: np.array([float(row[key]) if row[key] else np.nan for row in rows]) for key in rows[0]}


def mission_text(setup: dict[str, Any]) -> str:
    simulator, pid = setup["simulator"], setup["pid"]
    start = ", ".join(f"{key}={value}" for key, value in simulator["start_pos"].items())
    gains = "\n".join(
        f"  {key} = {str(value).lower()}" for key, value in pid.items() if key not in ("app", "app_tick_hz")
    )
    domain = "\n".join(f"  Domain = {entry}" for entry in setup["helm"]["domain"])
    return f"""
Community = alpha
LatOrigin = 43.8253
LongOrigin = -70.3304
ProcessConfig = ANTLER
{{
  Run = MOOSDB
  Run = uSimMarineV22
  Run = pMarinePIDV22
  Run = pHelmIvP
}}
ProcessConfig = uSimMarineV22
{{
  AppTick = {simulator["app_tick_hz"]}
  start_pos = {start}
  prefix = NAV
  turn_rate = {simulator["turn_rate"]}
  turn_spd_loss = {simulator["turn_spd_loss"]}
  thrust_map = {simulator["thrust_map"]}
}}
ProcessConfig = pMarinePIDV22
{{
  AppTick = {pid["app_tick_hz"]}
{gains}
}}
ProcessConfig = pHelmIvP
{{
  AppTick = {setup["helm"]["app_tick_hz"]}
  Behaviors = m.bhv
{domain}
}}
"""


CONDITIONS = {
    "waypt_survey": ("DEPLOY = true", "RETURN = false"),
    "waypt_return": ("DEPLOY = true", "RETURN = true"),
    "loiter": ("DEPLOY = true", "STATION = false"),
    "station": ("DEPLOY = true", "STATION = true"),
}


def behavior_text(name: str, setup: dict[str, Any]) -> str:
    rows = ["initialize DEPLOY = false, RETURN = false, STATION = false"]
    for behavior in setup["behaviors"]:
        rows += [f"Behavior = {behavior['type']}", "{"]
        rows += [f"  condition = {text}" for text in CONDITIONS[behavior["name"]]]
        for key, value in behavior.items():
            if key == "endflags":
                rows += [f"  endflag = {flag}" for flag in value]
            elif key == "points":
                rows.append("  points = " + ":".join(f"{x},{y}" for x, y in value))
            elif key == "station_pt":
                rows.append(f"  station_pt = {value[0]},{value[1]}")
            elif key not in ("type", "polygon_vertices"):
                rows.append(f"  {key} = {str(value).lower() if isinstance(value, bool) else value}")
        rows.append("}")
    return "\n".join(rows) + "\n"


@pytest.fixture(scope="module")
def alpha(tmp_path_factory) -> Track:
    watched = ("WPT_INDEX", "CYCLE_INDEX", "RETURN", "DEPLOY", "MISSION")
    return Track("alpha", tmp_path_factory.mktemp("alpha"), watched, 480.0)


@pytest.fixture(scope="module")
def loiter(tmp_path_factory) -> Track:
    pytest.importorskip("behaviors.loiter")
    pytest.importorskip("behaviors.station_keep")
    watched = ("LOITER_INDEX", "LOITER_MODE", "DIST_TO_STATION")
    return Track("loiter_station", tmp_path_factory.mktemp("loiter"), watched, 400.0)


def distances_to_path(x: np.ndarray, y: np.ndarray, path_x: np.ndarray, path_y: np.ndarray) -> np.ndarray:
    """Distance of each point to the polyline."""
    ax, ay, bx, by = path_x[:-1], path_y[:-1], path_x[1:], path_y[1:]
    dx, dy = bx - ax, by - ay
    square = np.maximum(dx * dx + dy * dy, 1e-12)
    t = np.clip(((x[:, None] - ax) * dx + (y[:, None] - ay) * dy) / square, 0.0, 1.0)
    return np.hypot(x[:, None] - ax - t * dx, y[:, None] - ay - t * dy).min(axis=1)


def worst_path_distance(track: Track) -> float:
    reference = track.reference()
    measured = track.times <= reference["t"][-1]  # it ends while the vessel coasts down
    there = distances_to_path(track.x[measured], track.y[measured], reference["NAV_X"], reference["NAV_Y"])
    back = distances_to_path(reference["NAV_X"], reference["NAV_Y"], track.x, track.y)
    return float(max(there.max(), back.max()))


def test_alpha_reaches_its_points_in_order_and_in_time(alpha):
    wanted = [(t, name, value) for t, name, value, source in alpha.setup["events"] if source != "uPokeDB"]
    found = [event for event in alpha.events if event[1] != "RETURN" or event[0] > 1.0]
    found = [event for event in found if event[1] != "DEPLOY" or event[0] > 1.0]
    sequence = [(name, float(v) if name.endswith("INDEX") else v) for _, name, v in wanted]
    assert sorted(map(str, [(name, value) for _, name, value in found])) == sorted(map(str, sequence))
    for name in ("WPT_INDEX", "RETURN", "DEPLOY", "MISSION"):
        times = [t for t, n, _ in found if n == name]
        reference = [t for t, n, _ in wanted if n == name]
        assert times == pytest.approx(reference, abs=HIT_TOLERANCE)


def test_alpha_sails_the_measured_path(alpha):
    tolerance = alpha.setup["suggested_tolerance"]
    assert worst_path_distance(alpha) <= tolerance["path_to_path_max_m"]


def test_alpha_sails_at_the_measured_speed(alpha):
    reference = alpha.reference()
    under_way = (reference["t"] > 5) & (reference["t"] < 440)
    ours = alpha.speed[(alpha.times > 5) & (alpha.times < 440)].mean()
    relative = alpha.setup["suggested_tolerance"]["mean_speed_rel"]
    assert ours == pytest.approx(reference["NAV_SPEED"][under_way].mean(), rel=relative)


def test_the_loiter_goes_round_at_the_measured_pace_and_in_order(loiter):
    wanted = [(t, float(v)) for t, name, v, *_ in loiter.setup["events"] if name == "LOITER_INDEX"]
    found = [(t, v) for t, name, v in loiter.events if name == "LOITER_INDEX"]
    assert [v for _, v in found] == [v for _, v in wanted]
    # laps from reaching vertex 1 to reaching it again
    laps, reference = ([t for t, v in events if v == 1.0] for events in (found, wanted))
    rel = loiter.setup["suggested_tolerance"]["lap_time_rel"]
    assert np.diff(laps) == pytest.approx(np.diff(reference), rel=rel)
    assert [t for t, _ in found] == pytest.approx([t for t, _ in wanted], abs=HIT_TOLERANCE)


def test_loiter_and_station_keeping_sail_the_measured_path(loiter):
    tolerance = loiter.setup["suggested_tolerance"]
    assert worst_path_distance(loiter) <= tolerance["path_to_path_max_m"]


def test_the_station_is_kept(loiter):
    final = [v for _, name, v in loiter.events if name == "DIST_TO_STATION"][-1]
    reference = loiter.reference()["DIST_TO_STATION"]
    limit = loiter.setup["suggested_tolerance"]["final_distance_to_station_m"]
    assert abs(final - reference[~np.isnan(reference)][-1]) <= limit
