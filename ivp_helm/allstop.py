"""When the vehicle is stopped, and how that is said (helm.md 9.4)."""

from __future__ import annotations

from typing import NamedTuple

CLEAR = "clear"
MANUAL_OVERRIDE = "ManualOverride"
BEHAVIOR_ERROR = "BehaviorError"
NOTHING_TO_DO = "NothingToDo"
NO_GOAL = "NoGoalBehavior"
MISSING = "MissingDecVars"
STANDBY_TOOK_OVER = "DisabledByStandbyHelm"
STALE_NAV = "StaleNav"
"""Our own: own ship's position is older than ``nav_timeout`` allows."""

_SOFT = (NOTHING_TO_DO, NO_GOAL, MISSING)


class Announcement(NamedTuple):
    """What to publish: the reason, and zeros to all decision variables."""

    reason: bool
    zeros: bool


NOTHING_NEW = Announcement(False, False)


class AllStop:
    """The reason in force, with the one iteration of grace that soft reasons get.

    A switch of modes may leave one iteration without a decision; the vehicle is stopped only if the
    next one has none either.
    """

    def __init__(self) -> None:
        self.reason = ""
        self._soft_iterations = 0

    def update(self, reason: str) -> Announcement:
        """The outcome of this iteration; CLEAR for a full decision."""
        changed = reason != self.reason
        self.reason = reason
        if not reason.startswith(_SOFT):
            self._soft_iterations = 0
            return Announcement(changed, changed and reason != CLEAR)
        self._soft_iterations += 1
        if self._soft_iterations == 1:
            return Announcement(changed, False)
        if self._soft_iterations == 2:
            return Announcement(True, True)
        return Announcement(changed, changed)
