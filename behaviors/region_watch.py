"""How long a vessel has been inside or outside a region, and when leaving it counts (behaviors.md C5, C23).

Shared by the operation region behaviours; it knows no polygon and posts nothing.
"""

from __future__ import annotations

_SLACK = 1e-9
"""Sums of ticks count as what they mean."""


class RegionWatch:
    """Clocks of the stay inside and outside, told once per iteration where the vessel is.

    The region is `entered` after `entry_time` seconds inside; it is `left` after `exit_time` outside.
    """

    def __init__(self) -> None:
        self.entered = False
        self.seconds_inside = 0.0
        self.seconds_outside = 0.0
        self._since: float | None = None
        self._inside: bool | None = None

    def restart(self) -> None:
        """Forget everything."""
        self.__init__()  # type: ignore[misc]

    def update(self, inside: bool, now: float, entry_time: float) -> None:
        """The vessel is inside, or is not."""
        if self._since is None or inside != self._inside:
            self._since = now
        self._inside = inside
        elapsed = now - self._since
        self.seconds_inside, self.seconds_outside = (elapsed, 0.0) if inside else (0.0, elapsed)
        if inside and elapsed >= entry_time - _SLACK:
            self.entered = True

    def left(self, exit_time: float) -> bool:
        """Whether the vessel is outside, and was for so long."""
        return self._inside is False and self.seconds_outside >= exit_time - _SLACK
