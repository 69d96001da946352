"""``pymoos fleet COMMAND [VEHICLE ...]``: deploy, return, station or pause a running fleet, or some of it."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from pymoos_lite.config.fleet_file import DEFAULT_COMMANDS
from pymoos_lite.config.problems import did_you_mean
from pymoos_lite.hosts.fleet import find_fleet, load_fleet, posts_for
from pymoos_lite.hosts.mission import MissionError
from pymoos_lite.tools.client import UnreachableError, add_client_arguments, connect

if TYPE_CHECKING:
    from pymoos_lite.hosts.ports import RemoteClient

SUMMARY_TIME = 1.0
"""Wall seconds to wait for the shoreside's list of what it shares; without one names are not checked."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "command", metavar="COMMAND", help="deploy, return, station, pause, or one of the fleet's own"
    )
    parser.add_argument("vehicles", nargs="*", metavar="VEHICLE", help="for whom (default: all)")
    parser.add_argument("--fleet", metavar="FLEET", help="fleet file whose own commands to use")
    add_client_arguments(parser)


def run(args: argparse.Namespace) -> int:
    try:
        commands = DEFAULT_COMMANDS
        known: list[str] = []
        if args.fleet:
            fleet = load_fleet(find_fleet(args.fleet))
            commands, known = fleet.commands, fleet.vehicle_names()
        posts = posts_for(commands, args.command, args.vehicles, known)
        client = connect(args, "pymoos_fleet")
    except (MissionError, UnreachableError) as error:
        print(f"pymoos fleet: {error}", file=sys.stderr)
        return 1
    stranger = "" if args.fleet else _stranger(client, args.vehicles, [name for name, _ in posts])
    if stranger:
        client.close(0.0)
        print(f"pymoos fleet: {stranger}", file=sys.stderr)
        return 1
    for name, value in posts:
        client.notify(name, value)
    delivered = client.close(args.timeout)
    if not delivered:
        print("pymoos fleet: the database did not confirm the posts in time", file=sys.stderr)
        return 1
    print(f"{args.command}: {', '.join(args.vehicles) or 'all vehicles'}")
    return 0


def _stranger(client: RemoteClient, vehicles: list[str], variables: list[str]) -> str:
    """What is wrong with the vehicles named, empty if nothing: the shoreside sends none of it to one of them."""
    from pymoos_lite.field.routes import parse_output_summary

    if not vehicles:
        return ""
    client.register("PSHARE_OUTPUT_SUMMARY")
    until = client.clock.wall() + SUMMARY_TIME
    shared: set[str] = set()
    while not shared and client.clock.wall() < until:
        for message in client.poll(0.05):
            if message.name == "PSHARE_OUTPUT_SUMMARY":
                shared |= {source for source, _, _ in parse_output_summary(message.text)}
    stems = {name.removesuffix(end) for end in (f"_{v.upper()}" for v in vehicles) for name in variables}
    known = {
        name.removeprefix(f"{stem}_").lower()
        for stem in stems
        for name in shared
        if name.startswith(f"{stem}_")
    }
    known.discard("all")
    for vehicle in vehicles:
        if known and vehicle.lower() not in known:
            hint = did_you_mean(vehicle, known) or f"; there are {', '.join(sorted(known))}"
            return f"no vehicle '{vehicle}' is connected{hint}"
    return ""
