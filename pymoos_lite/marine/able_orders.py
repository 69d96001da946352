"""Orders to switch behaviours off and on, as contact and obstacle managers pass them to the helm (helm.md 11.4).

A word names one contact or obstacle, ``contact=name``, or all of one source, ``vsource=name``.
"""

from __future__ import annotations

from collections.abc import Callable

from pymoos_lite.app import App
from pymoos_lite.app.mail_values import Handler, on_text


class AbleOrders:
    """Posts BHV_ABLE_FILTER for what is heard, and remembers what is switched off, for macros.

    `key` is what a bare word names, ``contact`` or ``obstacle_id``. `done` is called after each order but an
    expunging one, with ``disable`` or ``enable``. At most `most` names are remembered.
    """

    def __init__(self, app: App, key: str, done: Callable[[str], None], most: int) -> None:
        self._app = app
        self._key = key
        self._done = done
        self._most = most
        self._disabled: list[str] = []
        self._recent = {"disable": "", "enable": ""}
        self._total = 0

    def handlers(self, disable_var: str, enable_var: str, expunge_var: str) -> dict[str, Handler]:
        """Handlers of the three variables, as far as they have a name."""
        named = {expunge_var: "expunge", enable_var: "enable", disable_var: "disable"}
        return {variable: self._handler(action) for variable, action in named.items() if variable}

    def macros(self) -> dict[str, str]:
        """Values of the macros in the managers' flags."""
        return {
            "RECENT_DISABLED": self._recent["disable"],
            "RECENT_ENABLED": self._recent["enable"],
            "TOTAL_DISABLED": str(self._total),
            "ALL_DISABLED": ",".join(self._disabled),
        }

    def _handler(self, action: str) -> Handler:
        return on_text(self._app, lambda told: self._take(action, told))

    def _take(self, action: str, told: str) -> None:
        key, equals, value = (part.strip() for part in told.partition("="))
        if not equals:
            key, value = self._key, key
        if key.lower() not in (self._key, "vsource") or not value or "," in value:
            raise ValueError(f"expected a name, {self._key}=name or vsource=source")
        self._app.notify("BHV_ABLE_FILTER", f"{key.lower()}={value},action={action}")
        if action == "expunge":
            return
        self._recent[action] = value
        if action == "disable":
            self._total += 1
            if value not in self._disabled and len(self._disabled) < self._most:
                self._disabled.append(value)
        elif value in self._disabled:
            self._disabled.remove(value)
        self._done(action)
