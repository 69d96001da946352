"""Standing questions to the contact manager: who is within so many metres? (marine_apps.md 5.2)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pymoos_lite.records.csp import clip, field_map, parse_number

Within = Callable[[float, str, str], str]
"""(range, group, type) to the comma-separated names of the contacts there."""


@dataclass(slots=True)
class _Request:
    variable: str
    reach: float
    group: str
    kind: str
    asked_at: float
    answer: str | None = None


class RangeRequests:
    """At most `maxsize` questions, each answered in its own variable whenever the answer changes.

    When there are too many, those not asked again for `timeout` seconds go, the oldest first.
    """

    def __init__(self, timeout: float, maxsize: int) -> None:
        self._timeout = timeout
        self._maxsize = max(1, maxsize)
        self._requests: dict[str, _Request] = {}

    def __len__(self) -> int:
        return len(self._requests)

    def ask(self, text: str, now: float) -> None:
        """Take `var=V, range=R [,group=G] [,type=T] [,refresh=true] [,reason=...]`.

        Raises:
            ValueError: it is none, or there are too many that are still fresh.
        """
        told = field_map("BCM_REPORT_REQUEST", text)
        variable, reach = told.get("var", ""), parse_number(told.get("range", ""))
        if not variable or any(c.isspace() for c in variable) or reach is None or reach < 0.0:
            raise ValueError(f"expected var=V, range=metres, found '{clip(text)}'")
        known = self._requests.get(variable)
        refresh = told.get("refresh", "").lower() == "true"
        request = _Request(variable, reach, told.get("group", ""), told.get("type", ""), now)
        if known is not None:
            if not refresh:
                request.answer = known.answer
        elif len(self._requests) >= self._maxsize:
            oldest = min(self._requests.values(), key=lambda each: (each.asked_at, each.variable))
            if now - oldest.asked_at <= self._timeout:
                raise ValueError(f"there are {self._maxsize} range requests already")
            del self._requests[oldest.variable]
        self._requests[variable] = request

    def step(self, within: Within, now: float) -> list[tuple[str, str]]:
        """(variable, names) of the answers that changed."""
        posts = []
        for request in self._requests.values():
            answer = within(request.reach, request.group, request.kind)
            if answer != request.answer:
                request.answer = answer
                posts.append((request.variable, answer))
        return posts
