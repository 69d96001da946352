"""Time as an object that is handed in.

*Mission time* (`now`) may be warped or virtual; every message carries it. *Wall time* (`wall`) says
whether a process is alive and is never scaled. Nothing else in the project reads the system's clock.
"""

from __future__ import annotations

import time
from typing import Protocol

from mypy_extensions import mypyc_attr

MAX_WARP = 400.0
VIRTUAL_EPOCH = 1_767_225_600.0
"""Where virtual mission time starts (1 January 2026, 00:00 UTC), so that equal runs have equal stamps."""


class Clock(Protocol):
    """What apps, hosts and sessions may ask about time."""

    warp: float

    def now(self) -> float:
        """Mission time in seconds."""
        ...

    def wall(self) -> float:
        """Wall time in seconds from an arbitrary origin; never warped, never runs backwards."""
        ...


def check_warp(warp: float) -> float:
    """Return `warp` if it lies in (0, 400] (community.md 4.1).

    Raises:
        ValueError: it does not.
    """
    if not 0.0 < warp <= MAX_WARP:
        raise ValueError(f"time warp must be above 0 and at most {MAX_WARP:g}, not {warp:g}")
    return float(warp)


@mypyc_attr(allow_interpreted_subclasses=True)
class RealClock:
    """The system's clock, with a warp.

    Mission time is unix seconds times the warp, so that processes on one machine agree without
    talking. It advances with the monotonic clock: a clock set back while a mission runs does not
    turn mission time around.
    """

    def __init__(self, warp: float = 1.0) -> None:
        self.warp = check_warp(warp)
        self._offset = time.time() - time.monotonic()

    def now(self) -> float:
        return (self._offset + time.monotonic()) * self.warp

    def wall(self) -> float:
        return time.monotonic()

    def wall_of(self, mission_time: float) -> float:
        """The wall time at which mission time reaches `mission_time`."""
        return mission_time / self.warp - self._offset


@mypyc_attr(allow_interpreted_subclasses=True)
class VirtualClock:
    """A clock that moves only when told to; one second of it is one second of a mission."""

    warp = 1.0

    def __init__(self, start: float = VIRTUAL_EPOCH) -> None:
        self.start = start
        self._now = start

    def now(self) -> float:
        return self._now

    def wall(self) -> float:
        return self._now - self.start

    def advance_to(self, moment: float) -> None:
        """Move to `moment` (mission seconds).

        Raises:
            ValueError: `moment` lies in the past.
        """
        if moment < self._now:
            raise ValueError(f"virtual time cannot run backwards: {moment} < {self._now}")
        self._now = moment
