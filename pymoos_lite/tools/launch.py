"""``pymoos launch MISSION`` and ``pymoos-launch MISSION``: run one community in real time."""

from __future__ import annotations

import argparse
import signal
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from pymoos_lite.core.message import Message, Value
from pymoos_lite.tools.mission import (
    EndCondition,
    MissionError,
    add_mission_arguments,
    deeper_problems,
    end_condition,
    load_plan,
    parse_settings,
    report_problems,
)

if TYPE_CHECKING:
    from pymoos_lite.hosts.plan import CommunityPlan
    from pymoos_lite.hosts.processes import ProcessHost
    from pymoos_lite.hosts.realtime import RealtimeHost

REFRESH = 0.25
"""Wall seconds between two looks at the display."""

PATIENCE = 2.0
FIRST_START = "the first start compiles the numerics, which takes a while; later ones do not"
"""Said when the apps have not started within `PATIENCE` wall seconds."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_mission_arguments(parser)
    parser.add_argument("--warp", type=float, metavar="N", help="mission seconds per real second, up to 400")
    parser.add_argument("--duration", type=float, metavar="S", help="end after S mission seconds")
    parser.add_argument(
        "--until", metavar="COND", help="end when this condition holds, e.g. 'RETURNED = true'"
    )
    parser.add_argument(
        "--log-dir", type=Path, metavar="DIR", help="where logs go (default: as the mission says)"
    )
    parser.add_argument("--processes", action="store_true", help="run every app in a process of its own")
    parser.add_argument("--restart", action="store_true", help="start an app again when it fails")
    parser.add_argument(
        "--bind",
        default="127.0.0.1",
        metavar="ADDRESS",
        help="address to listen on (default: this machine only)",
    )
    parser.add_argument(
        "--port",
        type=int,
        metavar="N",
        help="UDP port of the database (default: the mission's ServerPort; 0: any)",
    )
    parser.add_argument("--key", metavar="TEXT", help="community key: refuse every client without it")
    parser.add_argument("--seed", type=int, help="seed of random numbers (default: different every time)")
    parser.add_argument("--plain", action="store_true", help="plain lines instead of the live panel")
    parser.add_argument("--quiet", action="store_true", help="show nothing but failures")


def run(args: argparse.Namespace) -> int:
    from pymoos_lite.hosts.fleet import is_fleet

    if is_fleet(args.mission):
        from pymoos_lite.tools import fleet_launch

        return fleet_launch.run(args)
    try:
        plan = load_plan(args.mission, parse_settings(args.set))
        finished = end_condition(plan, args.until)
        if args.warp is not None:
            plan = replace(plan, warp=args.warp)
        if args.duration is not None and args.duration <= 0:
            raise MissionError(f"--duration {args.duration:g}: expected mission seconds above 0")
    except MissionError as error:
        print(error, file=sys.stderr)
        return 1
    if report_problems([*plan.problems, *deeper_problems(plan)], args.strict):
        return 1
    from pymoos_lite.core.clock import check_warp
    from pymoos_lite.hosts.ports import PortError
    from pymoos_lite.hosts.processes import ProcessHost
    from pymoos_lite.hosts.realtime import HostOptions, RealtimeHost

    options = HostOptions(
        bind=args.bind,
        port=plan.port if args.port is None else args.port,
        key=args.key,
        log_dir=args.log_dir,
        restart=args.restart,
        seed=args.seed,
        share_bind=args.bind,
    )
    screen = _Screen(args)
    host: RealtimeHost | ProcessHost
    try:
        check_warp(plan.warp)
        if args.processes:
            host = ProcessHost(plan, options, args.mission, parse_settings(args.set), screen.tell)
        else:
            host = RealtimeHost(plan, options, tell=screen.tell)
    except (PortError, ValueError) as error:
        print(f"{plan.mission.file}: {error}", file=sys.stderr)
        return 1
    return _fly(host, plan, args, screen, finished)


def _fly(
    host: RealtimeHost | ProcessHost,
    plan: CommunityPlan,
    args: argparse.Namespace,
    screen: _Screen,
    finished: EndCondition | None,
) -> int:
    from pymoos_lite.tools.mission_view import WATCHED, MissionView, appcast_request

    screen.open(f"{plan.community}: database on {host.address[0]} port {host.address[1]}, warp {plan.warp:g}")
    stop = StopSignals()
    patience = threading.Timer(PATIENCE, screen.say, [FIRST_START])
    patience.start()
    try:
        host.prepare()
    finally:
        patience.cancel()
    view = MissionView(plan.community, host.clock.now())
    watch = host.connect("pymoos_view")
    for name in WATCHED:
        watch.register(name, "*", 0.5 if name.startswith("NAV_") else 0.0, ())
    for name in finished.variables if finished is not None else ():
        watch.register(name, "*", 0.0, ())
    values: dict[str, Value] = {}
    next_look = next_request = 0.0
    began = host.clock.now()
    status = 0
    try:
        host.start_apps()
        screen.begin()
        while not stop.asked:
            host.turn(REFRESH)
            wall, now = time.monotonic(), host.clock.now()
            if now >= next_request:
                next_request = now + 4.0
                watch.publish(Message("APPCAST_REQ", appcast_request(plan.community), now, "pymoos_view"))
            if wall >= next_look:
                next_look = wall + REFRESH
                mail = watch.take_mail()
                values.update((message.name, message.value) for message in mail)
                view.take(mail, now)
                screen.show(view, plan.warp)
                if args.duration is not None and now - began >= args.duration:
                    break
                if finished is not None and finished.holds(values):
                    view.tell("the mission is over")
                    break
                if not host.alive():
                    view.tell("no app is running any more")
                    status = 1
                    break
    except KeyboardInterrupt:
        pass
    finally:
        # What the mission has to say at its end is posted while its apps quit.
        host.close()
        stop.restore()
        view.take(watch.take_mail(), host.clock.now())
        screen.show(view, plan.warp)
        screen.close(view)
    return 1 if host.failures else status


class _Screen:
    """The display of one launch, and failures told on it."""

    def __init__(self, args: argparse.Namespace) -> None:
        from pymoos_lite.tools.panel import Display, make_display

        self._quiet = args.quiet
        self._plain = args.plain
        self._make = make_display
        self._display: Display | None = None
        self._failures: list[str] = []

    def open(self, headline: str) -> None:
        if not self._quiet:
            print(headline, flush=True)

    def begin(self) -> None:
        """All apps are started: from now on the mission is shown."""
        if not self._quiet:
            self._display = self._make(self._plain)

    def say(self, text: str) -> None:
        """Something to know at once, while nothing is displayed yet."""
        if not self._quiet:
            print(text, flush=True)

    def tell(self, text: str) -> None:
        """A failure or restart of an app, told with the next look at the display."""
        self._failures.append(text)

    def show(self, view: object, warp: float) -> None:
        from pymoos_lite.tools.mission_view import MissionView

        assert isinstance(view, MissionView)
        for text in self._failures:
            view.tell(text)
            if self._quiet:
                print(text, file=sys.stderr, flush=True)
        self._failures.clear()
        if self._display is not None:
            self._display.refresh(view, warp)

    def close(self, view: object) -> None:
        from pymoos_lite.tools.mission_view import MissionView

        assert isinstance(view, MissionView)
        self.show(view, 1.0) if self._failures else None
        if self._display is not None:
            self._display.close()
            print(f"{view.community}: ended after {view.elapsed:.0f} mission seconds", flush=True)


class StopSignals:
    """Turns Ctrl-C and a polite kill into a request to stop."""

    def __init__(self) -> None:
        self.asked = False
        self._former = {}
        for name in ("SIGINT", "SIGTERM", "SIGBREAK"):
            number = getattr(signal, name, None)
            if number is not None:
                self._former[number] = signal.signal(number, self._ask)

    def _ask(self, number: int, frame: FrameType | None) -> None:
        if self.asked:  # a second Ctrl-C does not wait
            raise KeyboardInterrupt
        self.asked = True

    def restore(self) -> None:
        for number, handler in self._former.items():
            signal.signal(number, handler)
