"""What a client session has to tell its owner: news of the connection, and refusals.

Frozen values, compared with ``==``; a session hands them out in order by `take_events`.
"""

from __future__ import annotations

from dataclasses import dataclass

from pymoos_lite.core.frames import RefusalCode


@dataclass(frozen=True, slots=True)
class Connected:
    """A connection stands. With `resumed` it is as if it had never been away."""

    community: str
    resumed: bool


@dataclass(frozen=True, slots=True)
class Disconnected:
    """The connection is lost; the session looks for a new one."""

    reason: str


@dataclass(frozen=True, slots=True)
class Refused:
    """The database does not admit this client; the session has stopped trying."""

    code: RefusalCode
    reason: str


@dataclass(frozen=True, slots=True)
class WriteRefused:
    """The database did not accept `count` posts (or a registration) of `name`."""

    name: str
    reason: str
    count: int


@dataclass(frozen=True, slots=True)
class QueueFull:
    """The first of possibly many posts was refused here, because too many are waiting."""

    waiting: int
    bytes: int


@dataclass(frozen=True, slots=True)
class QueueOpen:
    """After `QueueFull`: the queue is half empty again; `refused` posts were refused meanwhile."""

    refused: int


@dataclass(frozen=True, slots=True)
class Warned:
    """Something a person should know."""

    text: str


Event = Connected | Disconnected | Refused | WriteRefused | QueueFull | QueueOpen | Warned
