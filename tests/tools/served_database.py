"""Runs a command-line program beside a real database on loopback."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence

from pymoos_lite.core.clock import RealClock
from pymoos_lite.core.database import Database
from pymoos_lite.core.message import Message, Value
from pymoos_lite.hosts.ports import DatabaseServer


def serve(
    main: Callable[[Sequence[str]], int],
    arguments: Sequence[str],
    posts: Sequence[tuple[str, Value]] = (),
    *,
    before: Sequence[tuple[str, Value]] = (),
    uptime: float = 0.0,
) -> int:
    """Exit status of `main`. `before` is in the database from the start, `posts` once the program is connected."""
    clock = RealClock()
    database = Database("abe", clock.now() - uptime)
    server = DatabaseServer(database, clock)
    status: list[int] = []
    thread = threading.Thread(target=lambda: status.append(main([f"--port={server.address[1]}", *arguments])))

    def post(all_posts: Sequence[tuple[str, Value]]) -> None:
        for name, value in all_posts:
            database.publish("x", Message(name, value, clock.now(), "x"), clock.now())

    post(before)
    thread.start()
    waiting = list(posts)
    try:
        while thread.is_alive():
            server.pump(0.02)
            if waiting and database.clients():
                post(waiting)
                waiting.clear()
                server.flush()
    finally:
        server.close()
        thread.join()
    return status[0]
