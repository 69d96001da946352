"""``pymoos fleet COMMAND [VEHICLE ...]``: deploy, return, station or pause a running fleet, or some of it."""

from __future__ import annotations

import argparse
import sys

from pymoos_lite.config.fleet_file import DEFAULT_COMMANDS
from pymoos_lite.hosts.fleet import find_fleet, load_fleet, posts_for
from pymoos_lite.hosts.mission import MissionError
from pymoos_lite.tools.client import UnreachableError, add_client_arguments, connect


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
    for name, value in posts:
        client.notify(name, value)
    delivered = client.close(args.timeout)
    if not delivered:
        print("pymoos fleet: the database did not confirm the posts in time", file=sys.stderr)
        return 1
    print(f"{args.command}: {', '.join(args.vehicles) or 'all vehicles'}")
    return 0
