"""The helm's view of other vessels: a snapshot per iteration of what the ledger knows (helm.md 11.2).

Behaviours see positions as last reported; nothing is extrapolated unless the helm is told to. The ledger
itself is `pymoos_lite.records.contact_ledger`, shared with the contact manager.
"""

from __future__ import annotations

from collections.abc import Collection

from pymoos_lite.geometry.geodesy import Geodesy
from pymoos_lite.records.contact_ledger import Contact, ContactLedger, Extrapolation, ExtrapolationMode
from pymoos_lite.records.node_report import NodeReport

__all__ = ["Contact", "HelmContacts"]

MAX_CONTACTS = 1000
MAX_NAMES_SHOWN = 20


class HelmContacts:
    """All contacts by their exact names.

    `max_age` is in seconds since a report's own time stamp, and doubled for contacts that a behaviour
    refers to. `extrapolate` is for how many seconds contacts are moved on along their courses, 0 for never.
    """

    def __init__(
        self, own: str, max_age: float = 45.0, geodesy: Geodesy | None = None, extrapolate: float = 0.0
    ) -> None:
        self.own = own
        self.max_age = max_age
        self.reports = 0
        self._names: list[str] = []
        self._text = ", who:"
        self.snapshot: dict[str, Contact] = {}
        """The contacts of this iteration; the same object for the whole life of the helm."""
        self._ledger = ContactLedger(geodesy, capacity=MAX_CONTACTS)
        self._policy = Extrapolation(
            ExtrapolationMode.HEADING if extrapolate > 0.0 else ExtrapolationMode.OFF,
            0.0,
            extrapolate,
            extrapolate,
        )

    def take(self, text: str, now: float) -> Contact | None:
        """Note a report; None if it is about own ship.

        Raises:
            ValueError: it cannot be used, or is no report; one line says why.
        """
        report = NodeReport.parse(text)
        if report.name == self.own:
            return None
        contact = self._ledger.receive(report, now)
        self.reports += 1
        return contact

    def refresh(self, now: float, referred: Collection[str] = ()) -> None:
        """Drop contacts whose reports are too old, and make the snapshot of this iteration."""
        snapshot = self.snapshot
        snapshot.clear()
        if not len(self._ledger):
            return
        max_age, still = self.max_age, self._policy.mode is ExtrapolationMode.OFF
        for contact in self._ledger:
            name = contact.name
            age = now - contact.time
            if age > max_age and (age > 2.0 * max_age or name not in referred):
                self._ledger.drop(name)
                continue
            if not still:
                contact = contact.at(*contact.position(now, self._policy))
            snapshot[name] = contact

    def summary(self) -> str:
        """The value of IVPHELM_LEDGER_SUMMARY: ``now:2, reps:40, who:ben,cal``."""
        names = self._ledger.names()
        if names != self._names:
            self._names = names
            self._text = f", who:{','.join(names[:MAX_NAMES_SHOWN])}"
        return f"now:{len(names)}, reps:{self.reports}{self._text}"
