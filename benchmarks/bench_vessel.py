"""What one simulated vessel costs: model and PID per step, the marine apps and the contacts per mission second.

Baselines, measured in the same run: the same vessel and controller equations written down directly over numpy
scalars, as a first version of a simulator often is; and a second of real time.

    python benchmarks/bench_vessel.py
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from pymoos_lite.app import App, AppContext
from pymoos_lite.config.mission import ConfigLine
from pymoos_lite.core.message import Message
from pymoos_lite.hosts.local import LocalConnection
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.marine.contact_manager import ContactManager
from pymoos_lite.marine.node_reporter import NodeReporter
from pymoos_lite.marine.pid import PidEngine, PidGains, PidParameters
from pymoos_lite.marine.pid_app import PidController
from pymoos_lite.marine.simulator import Simulator
from pymoos_lite.marine.thrust_map import parse_thrust_map
from pymoos_lite.marine.vessel_model import VesselModel, VesselParameters

STEPS = 20_000
MISSION_SECONDS = 300.0
CONTACTS = 7
MAP = "0:0, 20:1, 40:2, 60:3, 80:4, 100:5"
APPS: dict[str, tuple[type[App], str]] = {
    "uSimMarineV22": (Simulator, f"AppTick = 10\nprefix = NAV\nthrust_map = {MAP}\nturn_rate = 95"),
    "pMarinePIDV22": (
        PidController,
        "AppTick = 10\nyaw_pid_kp = 1.2\nyaw_pid_kd = 0.1\nyaw_pid_ki = 0.3\nyaw_pid_integral_limit = 0.07\n"
        "speed_factor = 20\ndepth_control = false\nsimulation = true",
    ),
    "pNodeReporter": (NodeReporter, "AppTick = 2\nplatform_type = kayak"),
    "pContactMgrV20": (
        ContactManager,
        "AppTick = 2\nalert = id=a, on_flag=SEEN=$[VNAME], alert_range=60, cpa_range=80",
    ),
}


def best_of(run: Callable[[], None], repeats: int = 5) -> float:
    best = float("inf")
    for _ in range(repeats):
        began = time.perf_counter()
        run()
        best = min(best, time.perf_counter() - began)
    return best


def ours() -> None:
    gains = PidGains(1.2, 0.1, 0.3, 0.07)
    engine = PidEngine(PidParameters(yaw=gains, speed_factor=20.0, depth_control=False))
    engine.set_override(False)
    vessel = VesselModel(VesselParameters(thrust_map=parse_thrust_map(MAP)[0]))
    for step in range(STEPS):
        engine.hear_heading(vessel.heading)
        engine.hear_speed(vessel.speed)
        engine.hear_desired_heading(90.0 + step % 400 * 0.1)
        engine.hear_desired_speed(2.0)
        engine.step(step * 0.05)
        vessel.thrust = engine.thrust
        vessel.ask_rudder(engine.rudder, step * 0.05)
        vessel.step(0.05)


def numpy_scalars() -> None:
    """The same step written directly, with numpy's scalar functions."""
    thrusts, speeds = np.array([0.0, 20, 40, 60, 80, 100]), np.array([0.0, 1, 2, 3, 4, 5])
    x = y = heading = speed = integral = old_error = np.float64(0.0)
    slopes = np.zeros(9)
    dt = 0.05
    for step in range(STEPS):
        desired = 90.0 + step % 400 * 0.1
        error = np.mod(heading - desired + 180.0, 360.0) - 180.0
        slopes = np.roll(slopes, 1)
        slopes[0] = (error - old_error) / dt
        old_error = error
        integral = np.clip(integral + 0.3 * error * dt, -0.07, 0.07)
        rudder = -np.clip(1.2 * error + 0.1 * np.mean(slopes) + integral, -100.0, 100.0)
        thrust = 40.0
        target = np.interp(thrust, thrusts, speeds) * (1.0 - 0.85 * np.abs(rudder) / 100.0)
        after = np.maximum(target, speed - 0.5 * dt) if target < speed else target
        rate = 70.0 * np.clip(after / 5.0, 0.0, 1.0)
        turned = rudder * rate / 100.0 * dt * thrust / 50.0
        along = np.deg2rad(heading + turned / 2.0)
        mean = (speed + after) / 2.0
        x = x + mean * np.sin(along) * dt
        y = y + mean * np.cos(along) * dt
        heading = np.mod(heading + turned, 360.0)
        speed = mean


def vessel_second(names: list[str], contacts: int = 0) -> float:
    """Seconds of processor time per mission second of a community with these apps."""
    host = Lockstep(seed=1)
    community = host.add_community("abe")
    origin = {"latorigin": "43.8253", "longorigin": "-70.3304"}
    for name in names:
        cls, config = APPS[name]
        rows = [row.split("=", 1) for row in config.splitlines()]
        lines = [
            ConfigLine(key.strip(), value.strip(), number) for number, (key, value) in enumerate(rows, 1)
        ]
        connection = LocalConnection(community.database, name, host.clock)
        context = AppContext(name, "abe", host.clock, connection, lines, origin, deterministic=True)
        host.add_app(community, cls, context)

    def post(name: str, value: float | str) -> None:
        community.database.publish(
            "bench", Message(name, value, host.clock.now(), "bench", "", "abe"), host.clock.now()
        )

    post("MOOS_MANUAL_OVERRIDE", "false")
    host.run(1.0)
    post("DESIRED_HEADING", 90.0)
    post("DESIRED_SPEED", 2.0)
    for name in ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED"):
        post(name, 0.0)
    began = time.perf_counter()
    spent_posting = 0.0
    for tick in range(int(2 * MISSION_SECONDS)):
        for number in range(contacts):
            start = time.perf_counter()
            post(
                "NODE_REPORT",
                f"NAME=v{number},X={tick * 0.7:.2f},Y={number * 30},SPD=1.4,HDG=90,TIME={host.clock.now():.2f}",
            )
            spent_posting += time.perf_counter() - start
        host.run(0.5)
    assert not host.failures, host.failures
    return (time.perf_counter() - began - spent_posting) / MISSION_SECONDS


def main() -> None:
    fast, slow = best_of(ours) / STEPS, best_of(numpy_scalars, 2) / STEPS
    print(f"{'one step of vessel and PID':<44}{'us':>9}{'ratio':>9}")
    print(f"{'numpy scalars (baseline)':<44}{slow * 1e6:>9.2f}{1.0:>9.2f}")
    print(f"{'pymoos_lite.marine':<44}{fast * 1e6:>9.2f}{slow / fast:>9.2f}")
    print()
    print(f"{'one mission second in lockstep':<44}{'us':>9}{'x real time':>13}")
    marine = ["uSimMarineV22", "pMarinePIDV22", "pNodeReporter"]
    for label, names, contacts in (
        ("simulator 10 Hz", marine[:1], 0),
        ("simulator, PID 10 Hz, node reporter 2 Hz", marine, 0),
        (f"contact manager 2 Hz, {CONTACTS} contacts at 2 Hz", ["pContactMgrV20"], CONTACTS),
    ):
        cost = min(vessel_second(names, contacts) for _ in range(3))
        print(f"{label:<44}{cost * 1e6:>9.0f}{1.0 / cost:>13.0f}")


if __name__ == "__main__":
    main()
