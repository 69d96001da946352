"""``pymoos poke VAR=VALUE ...``: post values to a running community."""

from __future__ import annotations

import argparse
import sys

from pymoos_lite.core.message import Message
from pymoos_lite.hosts.mission import MissionError
from pymoos_lite.tools.client import UnreachableError, add_client_arguments, connect
from pymoos_lite.tools.values import typed_value


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "words",
        nargs="+",
        metavar="VAR=VALUE",
        help="VAR=VALUE posts a number if VALUE is one, else text; VAR:=VALUE always posts text. "
        "A mission (file or name) may stand among them: its port is used then.",
    )
    parser.add_argument("-q", "--quiet", action="store_true", help="do not print what was posted")
    add_client_arguments(parser)


def run(args: argparse.Namespace) -> int:
    from pymoos_lite.core.client_session import WriteRefused

    pokes = []
    for word in args.words:
        if "=" not in word:
            args.mission = word
            continue
        name, _, value = word.partition("=")
        forced = name.endswith(":")
        name = name.rstrip(":").strip()
        if not name:
            print(f"pymoos poke: '{word}': expected VAR=VALUE or VAR:=VALUE", file=sys.stderr)
            return 2
        pokes.append((name, value if forced else typed_value(value)))
    if not pokes:
        print("pymoos poke: nothing to post: give VAR=VALUE", file=sys.stderr)
        return 2
    try:
        client = connect(args, "pymoos_poke")
    except (UnreachableError, MissionError) as error:
        print(f"pymoos poke: {error}", file=sys.stderr)
        return 1
    # Hearing the variable afterwards shows that the database took the value, and of what type it is.
    for name, value in pokes:
        client.notify(name, value)
    delivered = client.flush(args.timeout)
    for name, _ in pokes:
        client.register(name)
    refused: dict[str, str] = {}
    seen: dict[str, Message] = {}
    wanted = {name for name, _ in pokes}
    end = client.clock.wall() + args.timeout
    while wanted - seen.keys() - refused.keys() and client.clock.wall() < end:
        for message in client.poll(0.05):
            seen[message.name] = message
        for event in client.take_events():
            if isinstance(event, WriteRefused):
                refused[event.name] = event.reason
    client.close()
    for reason in refused.values():
        print(f"pymoos poke: {reason}", file=sys.stderr)
    if not delivered:
        print("pymoos poke: the database did not confirm the posts in time", file=sys.stderr)
    if not args.quiet:
        for name, message in seen.items():
            if name not in refused:
                shown = f'"{message.value}"' if isinstance(message.value, str) else message.text
                print(f"{name} = {shown}")
    return 0 if delivered and not refused else 1
