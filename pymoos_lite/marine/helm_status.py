"""What the helm last said of itself: MODE and ALLSTOP of a node report (marine_apps.md 3.4)."""

from __future__ import annotations

import re

_MODES = re.compile(r"(?:^|,)\s*modes=([^,]*)")


class HelmStatus:
    """Follows IVPHELM_STATE, IVPHELM_SUMMARY and IVPHELM_ALLSTOP."""

    def __init__(self, silent_after: float) -> None:
        self._silent_after = silent_after
        self._heard_at: float | None = None
        self._state = ""
        self._modes = ""
        self.allstop = "unknown"

    def hear_state(self, text: str, now: float) -> None:
        """Take a heartbeat of the helm."""
        self._heard_at = now
        self._state = text.strip()
        if self._state.upper() == "MALCONFIG":
            self.allstop = "n/a"

    def hear_summary(self, text: str, now: float) -> None:
        """Take a summary; most leave out `modes`, because it has not changed."""
        self._heard_at = now
        found = _MODES.search(text) if "modes=" in text else None
        if found is not None:
            self._modes = found.group(1).strip()

    def mode(self, now: float) -> str:
        """The MODE field at `now`."""
        if self._heard_at is None:
            return "NOHELM-EVER"
        silence = now - self._heard_at
        if silence > self._silent_after:
            return f"NOHELM-{int(silence)}"
        if self._state.upper().startswith("DRIVE") and self._modes and self._modes.lower() != "none":
            return self._modes
        return self._state or "unknown"
