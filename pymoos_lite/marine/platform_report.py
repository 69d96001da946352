"""The platform report: variables of the platform's own, sent when they changed (marine_apps.md 3.4)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mypy_extensions import mypyc_attr

from pymoos_lite.records.csp import fields, fix, num, parse_number, printable


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class PlatformInput:
    """One variable to report under `alias`, at most every `gap` seconds."""

    variable: str
    alias: str
    gap: float = 0.0


def parse_platform_input(text: str) -> PlatformInput:
    """`VAR[,gap=s][,alias=A]`; raises ValueError saying what is wrong."""
    variable, _, rest = (part.strip() for part in text.partition(","))
    if not variable or any(c.isspace() for c in variable):
        raise ValueError("expected VAR[,gap=seconds][,alias=NAME]")
    gap, alias = 0.0, variable
    for key, value in fields(rest):
        if key.lower() == "gap":
            number = parse_number(value)
            if number is None or number < 0.0:
                raise ValueError(f"gap = {value}: expected seconds")
            gap = number
        elif key.lower() == "alias" and value:
            alias = value
        else:
            raise ValueError(f"'{key}' is neither gap nor alias")
    return PlatformInput(variable, alias, gap)


class PlatformReport:
    """Values of the platform variables and which of them are due."""

    def __init__(self, inputs: list[PlatformInput]) -> None:
        self._inputs = {entry.variable: entry for entry in inputs}
        self._values: dict[str, str] = {}
        self._changed: set[str] = set()
        self._posted_at: dict[str, float] = {}

    @property
    def variables(self) -> list[str]:
        """Variables to register for."""
        return list(self._inputs)

    def hear(self, variable: str, value: float | str) -> None:
        """Take a value; only one that differs from the last counts as a change."""
        text = num(value, 5) if isinstance(value, float) else value
        if self._values.get(variable) != text:
            self._values[variable] = text
            self._changed.add(variable)

    def take(self, platform: str, now: float) -> str:
        """The report of everything due at `now`, empty if nothing is."""
        due = [
            entry
            for name, entry in self._inputs.items()
            if name in self._changed and now - self._posted_at.get(name, -math.inf) >= entry.gap
        ]
        if not due:
            return ""
        parts = [f"platform={platform}", f"utc_time={fix(now, 5)}"]
        for entry in due:
            self._changed.discard(entry.variable)
            self._posted_at[entry.variable] = now
            parts.append(f"{entry.alias}={printable(self._values[entry.variable])}")
        return ",".join(parts)
