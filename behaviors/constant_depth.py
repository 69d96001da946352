"""BHV_ConstantDepth: stay at one depth (behaviors.md C4)."""

from __future__ import annotations

from behaviors import forms
from behaviors.steering import depth_peak
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter


class ConstantDepth(Behavior):
    """Keeps a depth. Completes at once unless `duration` says otherwise."""

    BHV_NAME = "BHV_ConstantDepth"
    DEFAULT_NAME = "bhv_constant_depth"
    VARIABLES = ("depth",)
    INFO = ("NAV_DEPTH",)
    DEFAULTS = {"duration": 0.0}  # noqa: RUF012
    PARAMETERS = Declaration(
        (
            forms.number("depth", 0.0, "m", "Depth to keep.", clip=True),
            forms.number("peakwidth", 3.0, "m", "Half width of the summit.", clip=True),
            forms.number("basewidth", 100.0, "m", "Width of each flank.", clip=True),
            Parameter(
                "summitdelta", "number", 50.0, "", "Fall over the summit.", low=0.0, high=100.0, clip=True
            ),
            forms.variable("depth_mismatch_var", "", "Variable for the difference to the depth kept."),
        )
    )

    def on_every_state(self) -> None:
        if self.config.depth_mismatch_var:
            actual = self.number("NAV_DEPTH")
            if actual is not None:
                self.post(self.config.depth_mismatch_var, abs(actual - self.config.depth))

    def on_run(self) -> IvPFunction | None:
        config = self.config
        self.why = f"keeps {config.depth:g} m"
        return depth_peak(self.domain, config.depth, config.peakwidth, config.basewidth, config.summitdelta)
