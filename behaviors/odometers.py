"""Several odometers that run together and are set back one by one."""

from __future__ import annotations

from math import hypot


class Odometers:
    """Metres sailed, counted under several names."""

    def __init__(self, *names: str) -> None:
        self._metres = dict.fromkeys(names, 0.0)
        self._at: tuple[float, float] | None = None

    def restart(self, x: float, y: float) -> None:
        """All back to 0, here."""
        self._metres = dict.fromkeys(self._metres, 0.0)
        self._at = x, y

    def reset(self, name: str) -> None:
        """One back to 0."""
        self._metres[name] = 0.0

    def move(self, x: float, y: float) -> None:
        """The vessel is at (x, y) now."""
        if self._at is not None:
            step = hypot(x - self._at[0], y - self._at[1])
            for name in self._metres:
                self._metres[name] += step
        self._at = x, y

    def __getitem__(self, name: str) -> float:
        return self._metres[name]
