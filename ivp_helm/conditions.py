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
    """Conditions that must all hold, ready to be asked in every iteration."""

    __slots__ = ("_deltas", "_tests", "items")

    def __init__(self, items: Iterable[Condition] = ()) -> None:
        self.items = tuple(items)
        self._deltas = any(_reads_delta(condition) for condition in self.items)
        self._tests = [(condition.test, condition) for condition in self.items]

    def first_false(self, buffer: InfoBuffer) -> Condition | None:
        """The first condition that does not hold, None if all do."""
        lookup: Lookup = buffer.values.get
        if self._deltas:
            lookup = with_deltas(lookup, buffer.now)
        for test, condition in self._tests:
            if not test(lookup):
                return condition
        return None

    def __iter__(self) -> Iterator[Condition]:
        return iter(self.items)


def holds(condition: Condition, buffer: InfoBuffer) -> bool:
    """Whether one condition is true for the buffer's values."""
    lookup: Lookup = buffer.values.get
    return condition.holds(with_deltas(lookup, buffer.now) if _reads_delta(condition) else lookup)


def variables_of(conditions: Iterable[Condition]) -> list[str]:
    """What to register for, in order, each name once."""
    return list(dict.fromkeys(name for condition in conditions for name in condition.registrations()))


def _reads_delta(condition: Condition) -> bool:
    return any(delta_base(name) for name in condition.variables())
