"""BHV_MaxSpeed: an upper limit of speed (behaviors.md C14)."""

from __future__ import annotations

from behaviors import forms
from behaviors.steering import at_most
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration


class MaxSpeed(Behavior):
    """Keeps the vessel from going faster than a limit; slower is as good."""

    BHV_NAME = "BHV_MaxSpeed"
    DEFAULT_NAME = "bhv_max_speed"
    VARIABLES = ("speed",)
    INFO = ("NAV_SPEED",)
    CONSTRAINT = True
    PARAMETERS = Declaration(
        (
            forms.number("max_speed", 1.0, "m/s", "Highest speed wanted."),
            forms.number(
                "basewidth",
                0.5,
                "m/s",
                "Speed above the limit at which no utility is left.",
                aliases=("tolerance",),
            ),
            forms.variable("speed_slack_var", "", "Variable for the limit less the speed."),
        )
    )

    def on_every_state(self) -> None:
        if self.config.speed_slack_var:
            speed = self.number("NAV_SPEED")
            if speed is not None:
                self.post(self.config.speed_slack_var, self.config.max_speed - speed)

    def on_run(self) -> IvPFunction | None:
        self.why = f"at most {self.config.max_speed:g} m/s"
        return at_most(self.domain, "speed", self.config.max_speed, self.config.basewidth)
