"""Conditions against the information buffer: which one of several is the first not to hold.

The language itself is `pymoos_lite.config.conditions` (helm.md 2); this module only knows where a
helm's values come from and what time it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from ivp_helm.info_buffer import InfoBuffer
from pymoos_lite.config.conditions import (
    Condition,
    ConditionError,
    Lookup,
    delta_base,
    parse_condition,
    with_deltas,
)

__all__ = ["Condition", "ConditionError", "ConditionSet", "holds", "parse_condition", "variables_of"]


class ConditionSet:
    """Conditions that must all hold, ready to be asked in every iteration.

    The answer is remembered with the values it was made of: modes and orders stand for minutes, so most
    iterations find the very same objects in the buffer.
    """

    __slots__ = ("_answer", "_deltas", "_names", "_seen", "items")

    def __init__(self, items: Iterable[Condition] = ()) -> None:
        self.items = tuple(items)
        self._deltas = any(_reads_delta(condition) for condition in self.items)
        self._names = tuple(dict.fromkeys(n for condition in self.items for n in condition.variables()))
        self._seen: list[tuple[str, object]] = [(name, _NEVER) for name in self._names]
        self._answer: Condition | None = None

    def first_false(self, buffer: InfoBuffer) -> Condition | None:
        """The first condition that does not hold, None if all do."""
        get = buffer.values.get
        for name, former in self._seen:
            if get(name) is not former:
                break
        else:
            return self._answer
        lookup: Lookup = get
        if self._deltas:
            lookup = with_deltas(lookup, buffer.now)  # ages differ in every iteration: nothing to remember
        else:
            self._seen = [(name, get(name)) for name in self._names]
        self._answer = None
        for condition in self.items:
            if not condition.test(lookup):
                self._answer = condition
                break
        return self._answer

    def __iter__(self) -> Iterator[Condition]:
        return iter(self.items)


_NEVER = object()
"""Stands for the value of a variable that was not looked at yet."""


def holds(condition: Condition, buffer: InfoBuffer) -> bool:
    """Whether one condition is true for the buffer's values."""
    lookup: Lookup = buffer.values.get
    return condition.holds(with_deltas(lookup, buffer.now) if _reads_delta(condition) else lookup)


def variables_of(conditions: Iterable[Condition]) -> list[str]:
    """What to register for, in order, each name once."""
    return list(dict.fromkeys(name for condition in conditions for name in condition.registrations()))


def _reads_delta(condition: Condition) -> bool:
    return any(delta_base(name) for name in condition.variables())
