"""What the tools that talk to a running community share: where it is, and connecting to it."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from pymoos_lite.core.clock import MAX_WARP
from pymoos_lite.hosts.mission import MissionError, find_mission, read_mission, shipped_missions

if TYPE_CHECKING:
    from pymoos_lite.core.clock import Clock
    from pymoos_lite.hosts.ports import RemoteClient

CONNECT_TIMEOUT = 5.0


class UnreachableError(Exception):
    """No community answers, or it refuses this client; the text says which and where."""


class CommunityClock:
    """Mission time as the community told it at the start, running on at its warp.

    What is posted with a stamp of another warp is years off, and taken for stale by those who read it.
    Mission time is unix seconds times the warp, so the warp need not be told.
    """

    def __init__(self, mission_time: float, system: Clock) -> None:
        self._system = system
        self._mission_time, self._from = mission_time, system.wall()
        warp = mission_time * system.warp / system.now()
        self.warp = warp if 0.0 < warp <= MAX_WARP else system.warp

    def now(self) -> float:
        return self._mission_time + (self._system.wall() - self._from) * self.warp

    def wall(self) -> float:
        return self._system.wall()


def add_client_arguments(parser: argparse.ArgumentParser) -> None:
    """Where the community is: a mission file, or host and port."""
    parser.add_argument("--mission", metavar="FILE", help="take host, port and warp from this mission")
    parser.add_argument("--host", help="host of the database (default 127.0.0.1)")
    parser.add_argument("--port", type=int, help="UDP port of the database (default 9000)")
    parser.add_argument("--key", metavar="TEXT", help="community key")
    parser.add_argument(
        "--timeout", type=float, default=CONNECT_TIMEOUT, metavar="S", help="give up after S wall seconds"
    )


def connect(args: argparse.Namespace, program: str) -> RemoteClient:
    """A connected client with a name of its own.

    Raises:
        UnreachableError: nobody answered in time, or the client was refused.
        MissionError: the mission file cannot be read.
    """
    from pymoos_lite.core.client_session import Refused, Warned
    from pymoos_lite.core.clock import RealClock
    from pymoos_lite.hosts.ports import PortError, RemoteClient

    host, port, warp = "127.0.0.1", 9000, 1.0
    if args.mission:
        mission = read_mission(find_mission(args.mission), {})
        try:
            host = (mission.text("ServerHost") or host).replace("LOCALHOST", "localhost")
            port, warp = mission.port(), mission.time_warp()
        except ValueError as error:
            raise MissionError(str(error)) from None
    host, port = args.host or host, args.port or port
    try:
        client = RemoteClient(f"{program}_{os.getpid()}", host, port, args.key, clock=RealClock(warp))
    except PortError as error:
        raise UnreachableError(str(error)) from None
    end = client.clock.wall() + args.timeout
    hint = ""
    while not client.connected:
        client.poll(0.05)
        for event in client.take_events():
            if isinstance(event, Refused):
                client.close(0.0)
                raise UnreachableError(f"the community at {host} port {port} refused: {event.reason}")
            if isinstance(event, Warned):
                hint = f" ({event.text})"
        if client.clock.wall() > end:
            client.close(0.0)
            raise UnreachableError(
                f"no community answers at {host} port {port} within {args.timeout:g} s{hint}"
            )
    client.clock = CommunityClock(client.session.server_time_offset + client.clock.wall(), client.clock)
    return client


def mission_like(text: str) -> bool:
    """Whether a word on the command line names a mission (file or shipped) rather than a variable."""
    return text.endswith((".moos", ".moos++")) or Path(text).is_file() or text in shipped_missions()
