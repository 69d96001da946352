"""BHV_MemoryTurnLimit: do not turn far from where the vessel was heading lately (behaviors.md C15)."""

from __future__ import annotations

from collections.abc import Iterable

from behaviors import forms
from behaviors.heading_memory import HeadingMemory
from behaviors.steering import course_peak
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration

REFERENCE_SPEED = 1.5
"""Metres per second at which the whole turn_range is allowed; slower vessels get less of it."""
LEAST_SHARE = 0.2


class MemoryTurnLimit(Behavior):
    """Keeps the course near the mean heading of the last seconds, so that a towed array is not fouled."""

    BHV_NAME = "BHV_MemoryTurnLimit"
    DEFAULT_NAME = "bhv_memory_turn_limit"
    VARIABLES = ("course",)
    INFO = ("NAV_HEADING", "NAV_SPEED")
    CONSTRAINT = True
    PARAMETERS = Declaration(
        (
            forms.custom(
                "memory_time",
                forms.read_off_or(lambda value: value >= 0.0, "seconds of at least 0"),
                None,
                "How far back headings are remembered; required.",
                "60",
                unit="s",
            ),
            forms.custom(
                "turn_range",
                forms.read_off_or(lambda value: 0.0 <= value <= 180.0, "degrees from 0 to 180"),
                None,
                "Half width of the courses allowed; required.",
                "45",
                unit="deg",
            ),
        )
    )

    def setup(self) -> None:
        self._memory = HeadingMemory()

    def on_run(self) -> IvPFunction | None:
        config = self.config
        unset = list(self._unset())
        if unset:
            for text in unset:
                self.warn(text)
            self.why = unset[0]
            return None
        heading, speed = self.buffer.number("NAV_HEADING"), self.buffer.number("NAV_SPEED")
        if heading is None or speed is None:
            self.error(f"No ownship {'heading' if heading is None else 'speed'} info in info_buffer.")
            return None
        self._memory.add(self.now, heading, config.memory_time)
        mean = self._memory.mean
        self.post_int("MEM_HDG_AVG", mean)
        width = config.turn_range * min(max(speed / REFERENCE_SPEED, LEAST_SHARE), 1.0)
        self.why = f"within {width:.0f} degrees of the mean heading {mean:.0f}"
        return course_peak(self.domain, mean, width, 0.0, 0.2)

    def _unset(self) -> Iterable[str]:
        for name in ("memory_time", "turn_range"):
            if getattr(self.config, name) is None:
                yield f"{name} is not set"
