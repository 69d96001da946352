"""The timetable of a timer script: its clock, passes, pauses and due events, without any app around it.

Time comes in with every call (community.md 14.2). `Script.update` says what is due; the caller posts it.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

from pymoos_lite.apps.timer_values import EventLine, RandomVariable, Span

UponAwake = Literal["n/a", "reset", "restart"]
NO_DELAY = Span(0.0, 0.0)
TRUE_TIME = Span(1.0, 1.0)


@dataclass(frozen=True, slots=True)
class ScriptPlan:
    """What a configuration says. `reset_time`: 0 never, -1 after the last event, else seconds.

    `reset_max` is -1 for any number of resets.
    """

    events: tuple[EventLine, ...] = ()
    random_variables: tuple[RandomVariable, ...] = ()
    paused: bool = False
    reset_time: float = 0.0
    reset_max: int = -1
    delay_start: Span = NO_DELAY
    delay_reset: Span = NO_DELAY
    time_warp: Span = TRUE_TIME
    shuffle: bool = True
    atomic: bool = False
    upon_awake: UponAwake = "n/a"


class Due(NamedTuple):
    """One event to post; `number` counts the events of the script from 0, copies included."""

    number: int
    event: EventLine


@dataclass(slots=True)
class Script:
    """A running timetable."""

    plan: ScriptPlan
    source: random.Random
    paused: bool = False
    conditions_ok: bool = True
    resets: int = 0
    count: int = 0
    total: int = 0
    skipped: float = 0.0
    stood_still: float = 0.0
    delay: float = 0.0
    warp: float = 1.0
    start: float | None = None
    values: dict[str, str] = field(default_factory=dict)
    events: list[EventLine] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    pending: list[int] = field(default_factory=list)
    _last: float = 0.0
    _standing: bool = False
    _begun: bool = False

    def __post_init__(self) -> None:
        plan = self.plan
        self.paused = plan.paused
        self.events = [event for event in plan.events for _ in range(event.amount)]
        self.draw_variables("at_start")
        self._begin_pass(plan.delay_start, redraw=True)

    def begin(self, now: float, zero: float | None = None) -> None:
        """Set time zero: `zero` (not after `now`), by default `now`."""
        self.start = now if zero is None else min(zero, now)
        self._last = now

    def elapsed(self, now: float) -> float:
        """Script seconds since time zero, without standstills."""
        if self.start is None:
            return 0.0
        return (now - self.start + self.skipped - self.stood_still) * self.warp

    def update(self, now: float, *, conditions: bool = True, blocked: bool = False) -> list[Due]:
        """Advance to `now` and return what is due, in file order; call `settle` when it is posted.

        `conditions` says whether all conditions hold, `blocked` whether an app is still awaited.
        """
        if self.start is None:
            self.begin(now)
        if self._standing:
            self.stood_still += now - self._last
        self._last = now
        if self.plan.atomic and self._begun and self.pending:
            conditions = True  # once begun, a pass is finished whatever the conditions say
        awoke = conditions and not self.conditions_ok
        self.conditions_ok = conditions
        self._standing = self.paused or blocked or not conditions
        if self._standing:
            return []
        if awoke:
            self._wake(now)
        self._begun = True
        return self._fire(now)

    def settle(self, now: float) -> None:
        """Begin the next pass if this one is over."""
        if not self._standing and self._reset_due(now):
            self.reset(now)

    def _wake(self, now: float) -> None:
        if self.plan.upon_awake == "restart":
            self.reset(now)
            self.resets = 0
        elif self.plan.upon_awake == "reset" and self.elapsed(now) > 0:
            self.reset(now)

    def _fire(self, now: float) -> list[Due]:
        age = self.elapsed(now) - self.delay
        limit = self.plan.reset_time if self.plan.reset_time > 0 else float("inf")
        due = [i for i in self.pending if age >= self.times[i] and self.times[i] <= limit]
        if due:
            fired = set(due)
            self.pending = [i for i in self.pending if i not in fired]
        return [Due(i, self.events[i]) for i in due]

    def posted(self) -> None:
        """Count one post; call it for each event before its value is worked out for the next."""
        self.count += 1
        self.total += 1

    def _reset_due(self, now: float) -> bool:
        plan = self.plan
        if 0 <= plan.reset_max <= self.resets or not plan.reset_time:
            return False
        if plan.reset_time < 0:
            return not self.pending and bool(self.events)
        return self.elapsed(now) >= plan.reset_time

    def reset(self, now: float) -> None:
        """Begin the next pass at once; the pause flag stays."""
        self.resets += 1
        self.start = now
        self._last = now
        self.skipped = self.stood_still = 0.0
        self.count = 0
        self._begun = False
        self.draw_variables("at_reset")
        self._begin_pass(self.plan.delay_reset, redraw=self.plan.shuffle)

    def _begin_pass(self, delay: Span, *, redraw: bool) -> None:
        self.delay = delay.draw(self.source)
        self.warp = self.plan.time_warp.draw(self.source)
        if redraw:
            self.times = [event.time.draw(self.source) for event in self.events]
        self.pending = list(range(len(self.events)))

    def forward(self, seconds: float, now: float) -> None:
        """Skip `seconds`; 0 or less jumps to the next event that is not yet posted."""
        if seconds > 0:
            self.skipped += seconds
        elif self.pending:
            ahead = min(self.times[i] for i in self.pending) + self.delay - self.elapsed(now)
            if ahead > 0:
                # A hair more than needed: the sum must not fall short of the event by rounding.
                self.skipped += ahead / self.warp + 1e-6

    def draw_variables(self, occasion: str) -> None:
        """Draw the random variables of an occasion; at the start those of all occasions."""
        for variable in self.plan.random_variables:
            if occasion in (variable.when, "at_start"):
                self.values.update(zip(variable.names, variable.draw(self.source), strict=True))

    def next_time(self, now: float) -> float:
        """Script seconds until the next pending event, infinity without one."""
        if not self.pending:
            return float("inf")
        return min(self.times[i] for i in self.pending) + self.delay - self.elapsed(now)


def joined_events(lines: Sequence[EventLine]) -> tuple[EventLine, ...]:
    """Events with `$[IDX]` and `$$IDX` fixed: the three-digit number of each, copies counted one by one."""
    numbered: list[EventLine] = []
    count = 0
    for line in lines:
        copies = [line] if "IDX" not in line.value else [replace(line, amount=1)] * line.amount
        for event in copies:
            value = event.value
            for macro in ("$[IDX]", "$(IDX)", "$$IDX"):
                value = value.replace(macro, f"{count:03d}")
            numbered.append(replace(event, value=value))
            count += event.amount
    return tuple(numbered)
