"""The information buffer: the latest value of every variable the helm has heard of (helm.md 6).

One table shared by modes, behaviours and the helm. A variable holds one value with its type, the newest
one: a number does not linger behind a later text. Within an iteration time stands still, so a variable
updated in this round has age 0. Nothing here knows where values come from.
"""

from __future__ import annotations

from collections.abc import Mapping

from pymoos_lite.core.message import Value
from pymoos_lite.geometry.text import num, parse_number


class InfoBuffer:
    """Latest values, their times, and every value received since the last clearing.

    `values` is the table itself; conditions are evaluated against it directly. Treat it as read-only and
    write through `set`.
    """

    __slots__ = ("_arrived", "_deltas", "_stamps", "now", "values")

    def __init__(self, now: float = 0.0) -> None:
        self.now = now
        """Mission time of the current round, in seconds."""
        self.values: dict[str, Value] = {}
        self._arrived: dict[str, float] = {}
        self._stamps: dict[str, float] = {}
        self._deltas: dict[str, list[Value]] = {}

    # --- writing (the helm's side) -------------------------------------------------------------------

    def set(self, name: str, value: Value, stamp: float | None = None) -> None:
        """Store a value that arrived now; `stamp` is the time of the message that brought it."""
        self.values[name] = value
        self._arrived[name] = self.now
        self._stamps[name] = self.now if stamp is None else stamp
        deltas = self._deltas.get(name)
        if deltas is None:
            self._deltas[name] = [value]
        else:
            deltas.append(value)

    def assign(self, name: str, value: Value) -> None:
        """Store a value of the helm's own making (a mode, a behaviour's post): it is no news to anybody."""
        self.values[name] = value
        self._arrived[name] = self._stamps[name] = self.now

    def clear_deltas(self) -> None:
        """Start a new round of `deltas`."""
        self._deltas.clear()

    # --- reading ---------------------------------------------------------------------------------------

    def __contains__(self, name: object) -> bool:
        return name in self.values

    def value(self, name: str) -> Value | None:
        """The latest value with its type, None if the variable was never received."""
        return self.values.get(name)

    def number(self, name: str) -> float | None:
        """The latest value as a number (numeric text counts), else None."""
        value = self.values.get(name)
        if type(value) is float:
            return value
        return parse_number(value) if isinstance(value, str) else None

    def text(self, name: str) -> str | None:
        """The latest value as text (a number with up to 6 decimals), None if never received."""
        value = self.values.get(name)
        if isinstance(value, str):
            return value
        if isinstance(value, float):
            return num(value, 6)
        return None if value is None else value.decode("utf-8", "replace")

    def age(self, name: str) -> float | None:
        """Seconds since the variable was last received: exactly 0 in the round that brought it."""
        arrived = self._arrived.get(name)
        return None if arrived is None else self.now - arrived

    def stamp(self, name: str) -> float | None:
        """The time stamp of the message that brought the latest value."""
        return self._stamps.get(name)

    def updated(self, name: str) -> bool:
        """Whether the variable was received in this round."""
        return self._arrived.get(name) == self.now

    def has_deltas(self, name: str) -> bool:
        """Whether any value was received in this round."""
        return name in self._deltas

    def deltas(self, name: str) -> list[Value]:
        """All values received in this round, in order of arrival."""
        return self._deltas.get(name, [])

    def delta_texts(self, name: str) -> list[str]:
        """All texts received in this round, in order of arrival."""
        found = self._deltas.get(name)
        return [value for value in found if isinstance(value, str)] if found else []

    def update(self, values: Mapping[str, Value]) -> None:
        """Store several values at once (tests and tools)."""
        for name, value in values.items():
            self.set(name, value)
