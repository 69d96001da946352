"""What the network did to the database, in words: for `DB_NETWORK` and for a person."""

from __future__ import annotations

from pymoos_lite.core.server_session import ServerStatistics

PERIOD = 5.0
"""Wall seconds between two looks at the counters."""


class NetworkReport:
    """Tells what changed in a database's network counters; no more often than `PERIOD`.

    `variable` is the text of `DB_NETWORK`: counters of datagrams, of those dropped by cause, of
    refused, slow and silent clients. `news` is one line when something was dropped or refused.
    """

    def __init__(self) -> None:
        self._next = 0.0
        self._told = ""
        self._bad = self._slow = self._refused = 0

    def look(self, statistics: ServerStatistics, wall: float) -> tuple[str | None, str | None]:
        """The new text of `DB_NETWORK` and news for a person; None where there is nothing new."""
        if wall < self._next:
            return None, None
        self._next = wall + PERIOD
        causes = {fault.name.lower(): n for fault, n in statistics.dropped.items() if n}
        dropped = "".join(f",dropped_{cause}={n}" for cause, n in causes.items())
        # The plain count of datagrams changes all the time and alone is no news.
        text = (
            f"admitted={statistics.admitted},resumed={statistics.resumed},refused={statistics.refused},"
            f"slow={statistics.slow},silent={statistics.silent},violations={statistics.violations},"
            f"dropped={statistics.bad_datagrams}{dropped}"
        )
        variable = text if text != self._told else None
        self._told = text
        news = []
        if statistics.bad_datagrams > self._bad:
            shares = ", ".join(f"{cause.replace('_', ' ')} {n}" for cause, n in causes.items())
            news.append(
                f"{statistics.bad_datagrams - self._bad} unacceptable datagrams dropped (all: {shares})"
            )
        if statistics.slow > self._slow:
            news.append(f"{statistics.slow - self._slow} clients disconnected because they did not read")
        if statistics.refused > self._refused:
            news.append(f"{statistics.refused - self._refused} connections refused (name in use, or full)")
        self._bad, self._slow, self._refused = (
            statistics.bad_datagrams,
            statistics.slow,
            statistics.refused,
        )
        return variable, "network: " + "; ".join(news) if news else None
