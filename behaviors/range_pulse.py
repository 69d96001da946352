"""BHV_RangePulse: show that a range report came in (behaviors.md C27)."""

from __future__ import annotations

from ivp_helm.behavior import Behavior
from pymoos_lite.geometry.text import num


class RangePulse(Behavior):
    """Has no opinion; draws a ring around own ship for each report in RANGE_REPORT followed by its name."""

    BHV_NAME = "BHV_RangePulse"
    DEFAULT_NAME = "bhv_range_pulse"
    VARIABLES = ()
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING")

    def on_parameters(self) -> None:
        self.watch(self._variable)

    @property
    def _variable(self) -> str:
        return f"RANGE_REPORT{self.community}"

    def on_run(self) -> None:
        own = self.own
        reports = len(self.buffer.deltas(self._variable))
        if reports and self.visuals:
            text = f"x={num(own.x)},y={num(own.y)},radius=25,duration=20,label=one"
            self.post("VIEW_RANGE_PULSE", f"{text},time={num(self.now, 2)}", repeat=True)
