"""A list of speeds for legs to come (behaviors.md C17, leg_spds)."""

from __future__ import annotations

from typing import Literal, NamedTuple

from pymoos_lite.config.parameters import parse_number

MOST_LEGS = 10_000


class ScheduleChange(NamedTuple):
    """What a line asks for: to append speeds, replace all, empty the list, or begin with the first again."""

    action: Literal["append", "replace", "clear", "reset"]
    speeds: tuple[float, ...] = ()


def read_leg_speeds(text: str) -> ScheduleChange:
    """``2:1.2,1.5`` (two legs at 1.2, one at 1.5), ``replace,...``, ``clear`` or ``reset``."""
    word, _, rest = text.strip().partition(",")
    word = word.strip().lower()
    if word == "clear" and not rest.strip():
        return ScheduleChange("clear")
    if word == "reset" and not rest.strip():
        return ScheduleChange("reset")
    if word == "replace":
        return ScheduleChange("replace", _speeds(rest))
    return ScheduleChange("append", _speeds(text))


def _speeds(text: str) -> tuple[float, ...]:
    found: list[float] = []
    for piece in text.split(","):
        count_text, colon, speed_text = piece.rpartition(":")
        count = parse_number(count_text.strip()) if colon else 1.0
        speed = parse_number(speed_text.strip())
        if count != int(count) or not 1 <= count <= MOST_LEGS or speed < 0.0:
            raise ValueError(f"'{piece.strip()}': expected SPEED or COUNT:SPEED, with a whole count from 1")
        found += [speed] * int(count)
    return tuple(found)


class SpeedSchedule:
    """The speed of each leg; None where there is none any more."""

    def __init__(self) -> None:
        self.speeds: tuple[float, ...] = ()
        self.wraps = 0
        """How often it began with the first speed again."""
        self._next = 0

    def change(self, change: ScheduleChange) -> None:
        """Take in a line."""
        if change.action == "append":
            self.speeds += change.speeds
            return
        self._next = 0
        if change.action != "reset":
            self.speeds = change.speeds

    def take(self, repeat: bool) -> float | None:
        """The speed of the leg that begins now."""
        if repeat and self.speeds and self._next >= len(self.speeds):
            self._next = 0
            self.wraps += 1
        if self._next >= len(self.speeds):
            return None
        self._next += 1
        return self.speeds[self._next - 1]
