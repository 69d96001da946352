"""Which variables the helm hears: each asked for once, never again (helm.md 6, 7.3).

A database delivers the latest value on every registration, so registering twice would bring old mail anew.
"""

from __future__ import annotations

from ivp_helm.info_buffer import InfoBuffer


class Registrations:
    """Names with the time they were asked for, and those not yet handed to the community."""

    def __init__(self, buffer: InfoBuffer) -> None:
        self._buffer = buffer
        self._since: dict[str, float] = {}
        self._new: list[str] = []

    def want(self, name: str) -> None:
        """Have mail of `name` from now on; wanting it again does nothing."""
        if name and name not in self._since:
            self._since[name] = self._buffer.now
            self._new.append(name)

    def since(self, name: str) -> float:
        """When the variable was asked for, minus infinity if it never was."""
        return self._since.get(name, float("-inf"))

    def take(self) -> list[str]:
        """Names asked for since the last call."""
        names = self._new
        self._new = []
        return names
