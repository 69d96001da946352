"""pOpinionFixer: passes a choice on, but for explore and exploit, which are fixed for each vessel (gcid.md 17)."""

from __future__ import annotations

from collections.abc import Iterable

from missions.bloom.coalitions import SET_PARAMETERS, given_sets
from pymoos_lite.app import App
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.core.message import Message

FIXED = ("explore", "exploit")


def fixed_choice(name: str, choice: str, exploit: frozenset[str], explore: frozenset[str]) -> str:
    """What the vessel `name` does when it chose `choice`; capitals stay capitals."""
    if choice.lower() not in FIXED:
        return choice
    word = "exploit" if name.lower() in exploit else "explore" if name.lower() in explore else choice.lower()
    return word.upper() if choice.isupper() else word


class OpinionFixer(App):
    """Static coalitions: the comparison for choosing ones."""

    MOOS_NAME = "pOpinionFixer"
    DEFAULT_TICK = 4.0
    PARAMETERS = Declaration(
        (
            Parameter("input_var_name", "variable", "OPTION2", doc="Variable with the choice."),
            Parameter("output_var_name", "variable", "OPTION", doc="Variable for what is done."),
            *SET_PARAMETERS,
        )
    )

    def on_start_up(self) -> None:
        self.exploit, self.explore = given_sets(self.config)
        self.heard = self.said = ""
        if not self.exploit and not self.explore:
            self.config_warning("no set is given: every choice passes unchanged")

    def on_connect(self) -> None:
        self.register(self.config.input_var_name)

    def on_mail(self, mail: list[Message]) -> None:
        for message in mail:
            self.heard = message.text
            self.said = fixed_choice(self.community, self.heard, self.exploit, self.explore)
            self.notify(self.config.output_var_name, self.said)

    def report(self) -> Iterable[str]:
        yield f"Chosen: {self.heard or '-'}   done: {self.said or '-'}"
