"""pMissionHash: gives a mission a name that people can say (community.md 17)."""

from __future__ import annotations

from collections.abc import Iterable

from pymoos_lite.app import App, AppContext
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message
from pymoos_lite.records.mission_hash import MissionHash, make_hash

PERIOD = 30.0
RESET = "RESET_MHASH"


class MissionHashApp(App):
    """Posts the hash every 30 s; RESET_MHASH makes a new one."""

    BLOCK_OPTIONAL = True
    PARAMETERS = Declaration(
        (
            Parameter(
                "mission_hash_var", "variable", "MISSION_HASH", "", "Carries hash and time; off for none."
            ),
            Parameter("mhash_short_var", "variable", "MHASH", "", "Carries the two words; off for none."),
        )
    )

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.hash: MissionHash | None = None
        self._next_post = 0.0

    def on_connect(self) -> None:
        self.register(RESET)

    def on_mail(self, mail: list[Message]) -> None:
        # What lies in the database from before the start has named another mission.
        if any(message.name == RESET and message.time >= self.started for message in mail):
            self.hash = None

    def iterate(self) -> None:
        if self.hash is None:
            self.hash = make_hash(self.now / self.clock.warp, self.random, utc=self.context.deterministic)
            self._next_post = self.now
        if self.now < self._next_post:
            return
        self._next_post = self.now + PERIOD
        for name, value in (
            (self.config.mission_hash_var, self.hash.to_text()),
            (self.config.mhash_short_var, self.hash.short),
        ):
            if name.lower() != "off":
                self.notify(name, value)

    def report(self) -> Iterable[str]:
        yield f"mission hash: {self.hash.full if self.hash is not None else '(none yet)'}"
