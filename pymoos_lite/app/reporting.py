"""What an app has to say to a person: configuration warnings, run warnings, events (community.md 10.4)."""

from __future__ import annotations

from collections import deque

MAX_CONFIG_WARNINGS = 101
OTHER_WARNINGS = "Other Run Warnings"


class ReportLog:
    """Counts and keeps warnings and events within bounds."""

    def __init__(self, max_events: int = 8, max_run_warnings: int = 10) -> None:
        self.max_events = max_events
        self.max_run_warnings = max_run_warnings
        self.config_warnings: list[str] = []
        self.run_warnings: dict[str, int] = {}
        self.run_warnings_total = 0
        self.events: deque[tuple[float, str]] = deque()
        self.events_total = 0
        self.fresh_run_warning = False
        self.fresh_config_warning = False

    def config_warning(self, text: str) -> None:
        if text not in self.config_warnings and len(self.config_warnings) < MAX_CONFIG_WARNINGS:
            self.config_warnings.append(text)
            self.fresh_config_warning = True

    def run_warning(self, text: str) -> None:
        self.run_warnings_total += 1
        self.fresh_run_warning = True
        if text not in self.run_warnings and len(self.run_warnings) >= self.max_run_warnings:
            text = OTHER_WARNINGS
        self.run_warnings[text] = self.run_warnings.get(text, 0) + 1

    def retract_run_warning(self, text: str) -> None:
        count = self.run_warnings.pop(text, 0)
        if count:
            self.run_warnings_total -= count
            self.fresh_run_warning = True

    def event(self, age: float, text: str) -> None:
        """`age` is mission seconds since the app started."""
        self.events_total += 1
        self.events.append((age, text))
        while len(self.events) > self.max_events:
            self.events.popleft()
