"""BHV_ABLE_FILTER: switching behaviours off and on again, or ending them (helm.md 11.4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pymoos_lite.geometry.text import fields

if TYPE_CHECKING:
    from ivp_helm.lifecycle import Life

ACTIONS = ("disable", "enable", "expunge")
SELECTORS = ("contact", "bhv_type", "vsource", "obstacle", "obstacle_id")


@dataclass(frozen=True, slots=True)
class AbleFilter:
    """An action and the selectors that must all match, values in lower case."""

    action: str
    selectors: tuple[tuple[str, str], ...]

    @classmethod
    def parse(cls, text: str) -> AbleFilter:
        """Read ``action=disable, contact=ben``.

        Raises:
            ValueError: unknown key or action, or no selector.
        """
        action = ""
        selectors = []
        for key, value in fields(text):
            key = key.lower()
            if key == "action":
                action = "enable" if value.lower() == "able" else value.lower()
            elif key in SELECTORS and value:
                selectors.append((key, value.lower()))
            else:
                raise ValueError(
                    f"BHV_ABLE_FILTER: '{key}={value}' is none of action, {', '.join(SELECTORS)}"
                )
        if action not in ACTIONS:
            raise ValueError(f"BHV_ABLE_FILTER: action={action or '?'} is none of {', '.join(ACTIONS)}")
        if not selectors:
            raise ValueError(f"BHV_ABLE_FILTER: no selector; give one of {', '.join(SELECTORS)}")
        return cls(action, tuple(selectors))

    @property
    def contact(self) -> str:
        """The contact it names, in lower case, or an empty text."""
        return dict(self.selectors).get("contact", "")

    def matches(self, life: Life) -> bool:
        """Whether it speaks of this behaviour, and the behaviour obeys such filters."""
        behavior = life.behavior
        config = vars(behavior.config)
        if not config.get("can_disable", type(behavior).CAN_DISABLE):
            return False
        known = behavior.able_fields()
        known["bhv_type"] = life.origin.kind
        return all(known.get(key, "").lower() == value for key, value in self.selectors)

    def apply(self, life: Life) -> None:
        if self.action == "expunge":
            life.behavior.complete("expunged")
        else:
            life.disabled = self.action == "disable"
