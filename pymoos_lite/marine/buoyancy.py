"""The handshake about buoyancy and trim of some underwater missions (marine_apps.md 1.7)."""

from __future__ import annotations

import math

from pymoos_lite.records.csp import fix

_REPEAT = 5.0  # s between two progress reports, and the least time either job takes


class BuoyancyJobs:
    """Buoyancy control and trimming, each at most one at a time; `step` returns the reports to post."""

    def __init__(self, trim_tolerance: float, max_trim_delay: float) -> None:
        self._trim_tolerance = math.radians(trim_tolerance)
        self._max_trim_delay = max_trim_delay
        self._buoyancy_since: float | None = None
        self._trim_since: float | None = None
        self._trim_reported = 0.0

    @property
    def busy(self) -> bool:
        """Whether a job is going on, so that `step` may have something to say."""
        return self._buoyancy_since is not None or self._trim_since is not None

    def start_buoyancy(self, now: float) -> tuple[str, str]:
        """Begin buoyancy control at `now`; returns the (variable, text) to post."""
        self._buoyancy_since = now
        return "BUOYANCY_REPORT", "status=1,error=0,progressing,buoyancy=0.0"

    def start_trim(self, now: float) -> tuple[str, str]:
        """Begin trimming at `now`; returns the (variable, text) to post."""
        self._trim_since = self._trim_reported = now
        return "TRIM_REPORT", "status=1,error=0,progressing,trim_pitch=0.0,trim_roll=0.0"

    def step(self, pitch: float, now: float) -> list[tuple[str, str]]:
        """Reports due at `now`, with `pitch` in radians."""
        posts: list[tuple[str, str]] = []
        if self._buoyancy_since is not None and now - self._buoyancy_since >= _REPEAT:
            self._buoyancy_since = None
            posts.append(("BUOYANCY_REPORT", "status=2,error=0,completed,buoyancy=0.0"))
        if self._trim_since is not None:
            taken = now - self._trim_since
            level = abs(pitch) <= self._trim_tolerance and taken >= _REPEAT
            if level or taken >= self._max_trim_delay:
                self._trim_since = None
                degrees = fix(math.degrees(pitch), 5)
                posts.append(
                    ("TRIM_REPORT", f"status=2,error=0,completed,trim_pitch={degrees},trim_roll=0.0")
                )
            elif now - self._trim_reported >= _REPEAT:
                self._trim_reported = now
                posts.append(("TRIM_REPORT", "status=1,error=0,progressing,trim_pitch=0.0,trim_roll=0.0"))
        return posts
