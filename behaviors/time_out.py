"""BHV_TimeOut: stop the vehicle after some time (behaviors.md C28)."""

from __future__ import annotations

from behaviors import forms
from ivp_helm.behavior import Behavior
from pymoos_lite.config.parameters import Declaration


class TimeOut(Behavior):
    """Is an error, and so stops the vehicle, once it has run for so long."""

    BHV_NAME = "BHV_TimeOut"
    DEFAULT_NAME = "bhv_timeout"
    VARIABLES = ()
    CONSTRAINT = True
    PARAMETERS = Declaration((forms.number("max_time", 0.0, "s", "Longest time of running; 0: no limit."),))

    def setup(self) -> None:
        self._began: float | None = None

    def on_run(self) -> None:
        if self._began is None:
            self._began = self.now
        limit, elapsed = self.config.max_time, self.now - self._began
        self.why = f"{elapsed:.0f} s of {limit:g} s"
        if limit > 0.0 and elapsed > limit:
            self.error(f"TimeOut failure: max:{limit:g} elapsed:{elapsed:.1f}")
