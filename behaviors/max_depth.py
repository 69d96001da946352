"""BHV_MaxDepth: a lower limit in the water (behaviors.md C14)."""

from __future__ import annotations

from behaviors import forms
from behaviors.steering import at_most
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration


class MaxDepth(Behavior):
    """Keeps the vessel from going deeper than a limit; higher is as good."""

    BHV_NAME = "BHV_MaxDepth"
    DEFAULT_NAME = "bhv_max_depth"
    VARIABLES = ("depth",)
    INFO = ("NAV_DEPTH",)
    CONSTRAINT = True
    PARAMETERS = Declaration(
        (
            forms.number("max_depth", 0.0, "m", "Greatest depth wanted."),
            forms.number(
                "basewidth",
                100.0,
                "m",
                "Depth below the limit at which no utility is left.",
                aliases=("tolerance",),
            ),
            forms.variable("depth_slack_var", "", "Variable for the limit less the depth."),
        )
    )

    def on_every_state(self) -> None:
        if self.config.depth_slack_var:
            depth = self.number("NAV_DEPTH")
            if depth is not None:
                self.post(self.config.depth_slack_var, self.config.max_depth - depth)

    def on_run(self) -> IvPFunction | None:
        self.why = f"at most {self.config.max_depth:g} m deep"
        return at_most(self.domain, "depth", self.config.max_depth, self.config.basewidth)
