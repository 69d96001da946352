"""``pymoos sim MISSION``: a mission in lockstep under virtual time, repeatable from its seed."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from pymoos_lite.tools.mission import (
    MissionError,
    add_mission_arguments,
    deeper_problems,
    end_condition,
    load_plan,
    parse_settings,
    report_problems,
)
from pymoos_lite.tools.values import typed_value

DEFAULT_DURATION = 600.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_mission_arguments(parser)
    parser.add_argument(
        "--duration",
        type=float,
        metavar="S",
        help=f"mission seconds to run (default {DEFAULT_DURATION:.0f}, or the fleet file's)",
    )
    parser.add_argument(
        "--until", metavar="COND", help="end earlier when this condition holds, e.g. 'RETURNED = true'"
    )
    parser.add_argument(
        "--seed", type=int, help="seed of every random number (default 0, or the fleet file's)"
    )
    parser.add_argument(
        "--poke",
        action="append",
        default=[],
        metavar="T:VAR=VALUE",
        help="post VAR=VALUE at T mission seconds (repeatable; VAR:=VALUE posts text; in a fleet at the "
        "shoreside, or at COMMUNITY with T:COMMUNITY/VAR=VALUE)",
    )
    parser.add_argument("--log-dir", type=Path, default=Path("logs"), metavar="DIR", help="where logs go")
    parser.add_argument("--no-progress", action="store_true", help="print only the closing lines")


def run(args: argparse.Namespace) -> int:
    from pymoos_lite.hosts.fleet import is_fleet

    if is_fleet(args.mission):
        from pymoos_lite.tools import fleet_sim

        return fleet_sim.run(args)
    if args.duration is None:
        args.duration = DEFAULT_DURATION
    from pymoos_lite.hosts.lockstep import Lockstep

    try:
        plan = load_plan(args.mission, parse_settings(args.set))
        finished = end_condition(plan, args.until)
        pokes = [parse_poke(text) for text in args.poke]
    except MissionError as error:
        print(error, file=sys.stderr)
        return 1
    if args.duration <= 0:
        print(f"--duration {args.duration:g}: expected mission seconds above 0", file=sys.stderr)
        return 2
    if report_problems([*plan.problems, *deeper_problems(plan)], args.strict):
        return 1
    host = Lockstep(args.seed or 0, args.log_dir)
    community = host.add_plan(plan)
    if finished is not None:
        ended = finished.holds
        database = community.database
        host.end_when(
            lambda: ended({n: v for n in finished.variables if (v := database.value(n)) is not None})
        )
    for at, name, value in pokes:
        host.poke(at, name, value)
    began = time.perf_counter()
    progress = None if args.no_progress or not sys.stderr.isatty() else Progress(args.duration, began)
    try:
        host.run(args.duration, progress)
    finally:
        host.stop()
        if progress is not None:
            progress.clear()
    for failure in host.failures:
        print(failure, file=sys.stderr)
    took = time.perf_counter() - began
    print(
        f"{plan.community}: {host.elapsed:.0f} mission seconds in {took:.2f} s "
        f"({host.elapsed / max(took, 1e-9):.0f} times real time)"
    )
    if finished is not None and host.elapsed < args.duration - 1.0 and not host.failures:
        print(f"{plan.community}: ended because {finished} holds")
    if any(app.program == "pLogger" for app in plan.apps):
        print(f"{plan.community}: logs in {args.log_dir}")
    return 1 if host.failures else 0


def parse_poke(text: str) -> tuple[float, str, str | float]:
    """``T:VAR=VALUE`` as time, name and value: a number if it reads as one, ``:=`` always text.

    Raises:
        MissionError: the text has another form.
    """
    at, colon, rest = text.partition(":")
    name, equals, value = rest.partition("=")
    try:
        seconds = float(at)
    except ValueError:
        seconds = -1.0
    forced = name.endswith(":")
    name = name.rstrip(":").strip()
    if not colon or not equals or not name or not 0.0 <= seconds < float("inf"):
        raise MissionError(
            f"--poke {text}: expected T:VAR=VALUE with T in mission seconds, e.g. 10:DEPLOY=true"
        )
    return seconds, name, value if forced else typed_value(value)


class Progress:
    """One line on a terminal with mission time and the speed reached."""

    def __init__(self, duration: float, began: float) -> None:
        self.duration = duration
        self.began = began
        self._next = 0.0

    def __call__(self, elapsed: float) -> None:
        now = time.perf_counter()
        if now < self._next:
            return
        self._next = now + 0.2
        speed = elapsed / max(now - self.began, 1e-9)
        left = (self.duration - elapsed) / max(speed, 1e-9)
        text = f"{elapsed:8.0f} of {self.duration:.0f} s   {speed:6.0f} x real time   {left:5.0f} s left"
        print(f"\r{text}", end="", file=sys.stderr, flush=True)

    def clear(self) -> None:
        print("\r" + " " * 78 + "\r", end="", file=sys.stderr, flush=True)
