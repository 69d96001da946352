"""``pymoos launch FLEET``: a whole fleet in real time, every community in a process of its own."""

from __future__ import annotations

import argparse
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

from pymoos_lite.core.clock import RealClock, check_warp
from pymoos_lite.core.message import Message, Value
from pymoos_lite.hosts.fleet import FleetPlan, find_fleet, load_fleet, plan_fleet
from pymoos_lite.hosts.fleet_host import FleetHost, free_ports
from pymoos_lite.hosts.ports import PortError
from pymoos_lite.hosts.realtime import HostOptions
from pymoos_lite.records.appcast import AppCastRequest
from pymoos_lite.tools.fleet_view import WATCHED, FleetDisplay, FleetView, make_display
from pymoos_lite.tools.launch import FIRST_START, StopSignals
from pymoos_lite.tools.mission import (
    EndCondition,
    MissionError,
    deeper_problems,
    end_condition,
    parse_macros,
    parse_settings,
    report_problems,
)

REFRESH = 0.25
REQUEST_PERIOD = 4.0
PATIENCE = 15.0
"""Wall seconds; many processes starting together on few cores take some even when nothing is compiled."""


def run(args: argparse.Namespace) -> int:
    """Run the fleet that ``args.mission`` means; the exit status."""
    log_dir: Path = args.log_dir or Path("logs")
    try:
        path = find_fleet(args.mission)
        fleet = load_fleet(path, args.vehicles, args.seed, args.preset, parse_macros(args.macro))
        if args.warp is not None:
            fleet = replace(fleet, warp=args.warp)
        check_warp(fleet.warp)
        plan = plan_fleet(
            fleet,
            path.resolve().parent,
            log_dir,
            ports=free_ports(fleet, args.bind),
            settings=parse_settings(args.set),
        )
        if report_problems(
            [*plan.problems, *deeper_problems(*(member.plan for member in plan.members))], args.strict
        ):
            return 1
        finished = end_condition(plan.shoreside.plan, args.until) if plan.shoreside is not None else None
    except (MissionError, PortError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    options = HostOptions(
        bind=args.bind,
        key=args.key,
        log_dir=log_dir.resolve(),
        restart=args.restart,
        seed=args.seed,
        share_bind=args.bind,
    )
    said: list[str] = []
    settings = parse_settings(args.set)
    host = FleetHost(plan, path.resolve().parent, options, settings, RealClock(fleet.warp), said.append)
    stop = StopSignals()
    patience = threading.Timer(PATIENCE, _say_first_start, [args.quiet])
    patience.start()
    try:
        host.start()
    except PortError as error:
        stop.restore()
        print(error, file=sys.stderr)
        return 1
    finally:
        patience.cancel()
    return _sail(host, plan, args, said, finished, stop)


def _say_first_start(quiet: bool) -> None:
    if not quiet:
        print(FIRST_START, flush=True)


def _sail(
    host: FleetHost,
    plan: FleetPlan,
    args: argparse.Namespace,
    said: list[str],
    finished: EndCondition | None,
    stop: StopSignals,
) -> int:
    began = host.clock.now()
    view = FleetView(plan.fleet.vehicle_names(), began)
    watch = host.connect("pymoos_view")
    for name in (*WATCHED, *(finished.variables if finished is not None else ())):
        watch.register(name, "*", 0.0, ())
    display = _open_display(plan, args)
    values: dict[str, Value] = {}
    deploy_at = plan.fleet.deploy_after
    next_look = next_request = 0.0
    status = 0
    try:
        while not stop.asked:
            host.turn(REFRESH)
            now, wall = host.clock.now(), time.monotonic()
            if deploy_at is not None and now - began >= deploy_at:
                deploy_at = None
                for name, value in plan.posts("deploy"):
                    host.post(name, value)
            if wall >= next_request:
                next_request = wall + REQUEST_PERIOD
                _ask_for_warnings(host, plan)
            if wall < next_look:
                continue
            next_look = wall + REFRESH
            mail = watch.take_mail()
            values.update((message.name, message.value) for message in mail)
            _show(view, display, said, mail, host, args)
            if args.duration is not None and now - began >= args.duration:
                break
            if finished is not None and finished.holds(values):
                view.tell("the mission is over")
                break
            if not host.alive():
                view.tell("no community is running any more")
                status = 1
                break
    except KeyboardInterrupt:
        pass
    finally:
        # What the mission has to say at its end is posted while its apps quit.
        host.close()
        stop.restore()
        _show(view, display, said, watch.take_mail(), host, args)
        if display is not None:
            display.close()
            if view.final:
                print(view.final)
            print(f"{plan.fleet.name}: ended after {view.elapsed:.0f} mission seconds", flush=True)
    return 1 if host.failures else status


def _open_display(plan: FleetPlan, args: argparse.Namespace) -> FleetDisplay | None:
    if args.quiet:
        return None
    shore = plan.shoreside
    where = f"{shore.name} on {args.bind} port {shore.plan.port}, " if shore is not None else ""
    print(
        f"{plan.fleet.name}: {where}{len(plan.fleet.vehicles)} vehicles, warp {plan.fleet.warp:g}", flush=True
    )
    return make_display(args.plain)


def _ask_for_warnings(host: FleetHost, plan: FleetPlan) -> None:
    """Ask every app of every community to tell its warnings, and nothing else."""
    duration = min(30.0, 2.0 * REQUEST_PERIOD * plan.fleet.warp)
    request = AppCastRequest("all", "all", duration, "pymoos:view", "run_warning").to_text()
    host.post("APPCAST_REQ", request)
    host.post("APPCAST_REQ_ALL", request)


def _show(
    view: FleetView,
    display: FleetDisplay | None,
    said: list[str],
    mail: list[Message],
    host: FleetHost,
    args: argparse.Namespace,
) -> None:
    view.take(mail, host.clock.now())
    for text in said:
        view.tell(text)
        if args.quiet:
            print(text, file=sys.stderr, flush=True)
    said.clear()
    if display is not None:
        display.refresh(view, host.plan.fleet.warp)
