"""The connection of an app that lives in the same process as its database."""

from __future__ import annotations

from pymoos_lite.core.clock import Clock
from pymoos_lite.core.database import Database
from pymoos_lite.core.message import Message


class LocalConnection:
    """Hands messages to the database by reference: no encoding, no copying, no queue between.

    Raises:
        NameClashError: the name is in use.
    """

    def __init__(self, database: Database, name: str, clock: Clock) -> None:
        self.name = name
        self._database = database
        self._now = clock.now
        self.mail: list[Message] = database.connect(name, clock.now())
        self.notices: list[str] = []
        self.connected = True
        self.publish = database.door(name, self._publish)
        self.publish_numbers = database.numbers_door(name, self._publish)

    def _publish(self, message: Message) -> bool:
        if not self.connected:
            return False
        refusal = self._database.publish(self.name, message, self._now())
        if refusal is None:
            return True
        self.notices.append(str(refusal))
        return False

    def register(self, pattern: str, source: str, interval: float, omit: tuple[str, ...]) -> None:
        if self.connected:
            self._database.register(self.name, pattern, self._now(), source, interval, omit)

    def unregister(self, pattern: str) -> None:
        if self.connected:
            self._database.unregister(self.name, pattern)

    def take_mail(self) -> list[Message]:
        mailbox = self.mail  # the database appends to this very list, for good
        if not mailbox:
            return []
        mail = mailbox.copy()
        mailbox.clear()
        return mail

    def published_names(self) -> tuple[str, ...]:
        return self._database.published_by(self.name)

    def registered_names(self) -> tuple[str, ...]:
        return self._database.registered_by(self.name)

    def wanted(self, name: str) -> bool:
        return self._database.has_subscriber(name)

    def take_notices(self) -> list[str]:
        notices, self.notices = self.notices, []
        return notices

    def close(self, reason: str = "") -> None:
        """Leave the community; values posted remain."""
        if self.connected:
            self.connected = False
            self._database.disconnect(self.name, self._now(), reason)
