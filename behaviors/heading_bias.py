"""BHV_HeadingBias: rather to one side (behaviors.md C25)."""

from __future__ import annotations

from behaviors.steering import course_peak
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter


class HeadingBias(Behavior):
    """Prefers every course on one side of the present heading to those on the other."""

    BHV_NAME = "BHV_HeadingBias"
    DEFAULT_NAME = "bhv_heading_bias"
    VARIABLES = ("course",)
    INFO = ("NAV_HEADING",)
    PARAMETERS = Declaration(
        (
            Parameter(
                "bias",
                "choice",
                "right",
                "",
                "The side preferred.",
                choices=("right", "left"),
                example="right",
            ),
        )
    )

    def on_run(self) -> IvPFunction | None:
        side = self.config.bias
        heading = self.own.heading
        self.why = f"rather to the {side} of heading {heading:.0f}"
        return course_peak(self.domain, heading + (90.0 if side == "right" else -90.0), 90.0, 0.0)
