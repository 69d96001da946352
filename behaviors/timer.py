"""BHV_Timer: a stopwatch that runs while its conditions hold (behaviors.md C9)."""

from __future__ import annotations

from mypy_extensions import mypyc_attr

from behaviors import forms
from ivp_helm.behavior import Behavior
from pymoos_lite.config.parameters import Declaration


@mypyc_attr(allow_interpreted_subclasses=True)
class Timer(Behavior):
    """Has no opinion; tells how long it ran and idled, and completes after its `duration`."""

    BHV_NAME = "BHV_Timer"
    DEFAULT_NAME = "bhv_timer"
    VARIABLES = ()
    PARAMETERS = Declaration(
        (
            forms.variable("var_status_idle", "TIMER_IDLE", "Variable for the seconds spent idle."),
            forms.variable("var_status_running", "TIMER_RUNNING", "Variable for the seconds spent running."),
            forms.custom("status_suffix", forms.read_suffix, "", "Put behind the names of both variables."),
        )
    )

    def setup(self) -> None:
        self._seconds = {"idle": 0.0, "run": 0.0}
        self._since: tuple[str, float] | None = None
        """What it was doing at what time."""

    def on_idle(self) -> None:
        self._count("idle")

    def on_run(self) -> None:
        self._count("run")
        self.why = f"has run for {self._seconds['run']:.1f} s"

    def on_disabled(self) -> None:
        self._since = None

    def _count(self, doing: str) -> None:
        if self._since is not None and self._since[0] == doing:
            self._seconds[doing] += self.now - self._since[1]
        self._since = doing, self.now
        suffix = self.config.status_suffix
        self.post(f"{self.config.var_status_idle}{suffix}", self._seconds["idle"])
        self.post(f"{self.config.var_status_running}{suffix}", self._seconds["run"])
