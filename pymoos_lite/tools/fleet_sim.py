"""``pymoos sim FLEET``: a whole fleet in lockstep."""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter

from pymoos_lite.field.share import ShareApp
from pymoos_lite.hosts.fleet import (
    FleetPlan,
    add_fleet,
    deploy_in_lockstep,
    find_fleet,
    load_fleet,
    plan_fleet,
)
from pymoos_lite.hosts.lockstep import Lockstep
from pymoos_lite.tools.mission import (
    MissionError,
    deeper_problems,
    end_condition,
    parse_macros,
    parse_settings,
    report_problems,
)
from pymoos_lite.tools.sim import DEFAULT_DURATION, Progress, parse_poke

REPORT_VARIABLE = "MISSION_REPORT"
"""What a mission posts at the shoreside for people to read at its end."""


def run(args: argparse.Namespace) -> int:
    """Run the fleet that ``args.mission`` means; the exit status."""
    try:
        path = find_fleet(args.mission)
        fleet = load_fleet(path, args.vehicles, args.seed, args.preset, parse_macros(args.macro))
        if args.duration is None:
            args.duration = fleet.duration or DEFAULT_DURATION
        plan = plan_fleet(
            fleet, path.resolve().parent, args.log_dir, warp=1.0, settings=parse_settings(args.set)
        )
        pokes = [parse_fleet_poke(text, plan) for text in args.poke]
        if args.duration <= 0:
            raise MissionError(f"--duration {args.duration:g}: expected mission seconds above 0")
        if report_problems(
            [*plan.problems, *deeper_problems(*(member.plan for member in plan.members))], args.strict
        ):
            return 1
        host = Lockstep(fleet.seed, args.log_dir, stagger=True)
        add_fleet(host, plan)
        _end_when(host, plan, args.until)
    except (MissionError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    deploy_in_lockstep(host, plan)
    for at, name, value, community in pokes:
        host.poke(at, name, value, community)
    began = time.perf_counter()
    progress = None if args.no_progress or not sys.stderr.isatty() else Progress(args.duration, began)
    sent = ""
    try:
        host.run(args.duration, progress)
        sent = bytes_by_variable(host, plan)
    finally:
        took = time.perf_counter() - began
        host.stop()
        if progress is not None:
            progress.clear()
    for failure in host.failures:
        print(failure, file=sys.stderr)
    tell_end(host, plan, took, sent)
    return 1 if host.failures else 0


def parse_fleet_poke(text: str, plan: FleetPlan) -> tuple[float, str, str | float, str]:
    """``T:[COMMUNITY/]VAR=VALUE``: without a community, the shoreside is meant.

    Raises:
        MissionError: another form, or no such community.
    """
    at, name, value = parse_poke(text)
    community, slash, variable = name.rpartition("/")
    if not slash:
        shore = plan.shoreside
        return at, name, value, shore.name if shore is not None else ""
    names = [member.name for member in plan.members]
    if community not in names:
        raise MissionError(
            f"--poke {text}: there is no community '{community}'; there are {', '.join(names)}"
        )
    return at, variable, value, community


def _end_when(host: Lockstep, plan: FleetPlan, until: str | None) -> None:
    """End early on ``--until``, or on ``EndWhen`` of the shoreside's mission."""
    shore = plan.shoreside
    if shore is None:
        return
    finished = end_condition(shore.plan, until)
    if finished is not None:
        database = host.communities[shore.name].database
        names, ended = finished.variables, finished.holds
        host.end_when(lambda: ended({n: v for n in names if (v := database.value(n)) is not None}))


def tell_end(host: Lockstep, plan: FleetPlan, took: float, sent: str = "") -> None:
    """The closing lines: what the mission itself reports, the network, the speed."""
    shore = plan.shoreside
    if shore is not None:
        report = host.communities[shore.name].database.value(REPORT_VARIABLE)
        if isinstance(report, str):
            print(report)
    total = host.network.total()
    print(
        f"network: {total.sent} datagrams, {total.lost} lost, {total.squeezed} squeezed out, "
        f"{total.unreachable} for nobody"
    )
    if sent:
        print(f"each vessel sends, bytes per second: {sent}")
    count = len(plan.fleet.vehicles)
    print(
        f"{plan.fleet.name}: {count} vehicle{'s' if count != 1 else ''}, {host.elapsed:.0f} mission seconds in "
        f"{took:.2f} s ({host.elapsed / max(took, 1e-9):.0f} times real time)"
    )


def bytes_by_variable(host: Lockstep, plan: FleetPlan, most: int = 8) -> str:
    """What the vessels' shares send, in the mean over vessels and the run, the largest first; empty without any."""
    totals: Counter[str] = Counter()
    for name in plan.fleet.vehicle_names():
        for runner in host.communities[name].runners:
            if isinstance(runner.app, ShareApp):
                for output in runner.app.table.outputs():
                    totals[output.name] += output.bytes
    seconds = max(host.elapsed, 1e-9) * max(1, len(plan.fleet.vehicles))
    ordered = sorted(totals.items(), key=lambda f: (-f[1], f[0]))
    shown = [(name, size) for name, size in ordered[:most] if size >= 0.5 * seconds]
    words = [f"{name} {size / seconds:.0f}" for name, size in shown]
    rest = sum(size for _, size in ordered[len(shown) :])
    return ", ".join([*words, f"others {rest / seconds:.0f}"] if shown else [])
