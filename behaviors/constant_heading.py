"""BHV_ConstantHeading: go one way (behaviors.md C4)."""

from __future__ import annotations

from behaviors import forms
from behaviors.steering import course_peak, on_grid
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.angles import angle360, angle_diff


class ConstantHeading(Behavior):
    """Keeps a heading. Completes at once unless `duration` says otherwise."""

    BHV_NAME = "BHV_ConstantHeading"
    DEFAULT_NAME = "bhv_constant_heading"
    VARIABLES = ("course",)
    INFO = ("NAV_HEADING",)
    DEFAULTS = {"duration": 0.0}  # noqa: RUF012
    PARAMETERS = Declaration(
        (
            forms.number("heading", 0.0, "deg", "Heading to keep; any number of turns.", low=None),
            forms.number("peakwidth", 10.0, "deg", "Half width of the summit.", clip=True),
            forms.number("basewidth", 170.0, "deg", "Width of each flank.", clip=True),
            Parameter(
                "summitdelta", "number", 25.0, "", "Fall over the summit.", low=0.0, high=100.0, clip=True
            ),
            forms.custom(
                "complete_thresh",
                forms.read_off_or(lambda value: value >= 0.0, "degrees of at least 0"),
                None,
                "Complete when the heading is this near; off: never.",
                "off",
                unit="deg",
            ),
            forms.variable("heading_mismatch_var", "", "Variable for the difference to the heading kept."),
        )
    )

    def set_heading(self, heading: float) -> None:
        vars(self.config)["heading"] = angle360(heading)

    def on_every_state(self) -> None:
        if self.config.heading_mismatch_var:
            actual = self.number("NAV_HEADING")
            if actual is not None:
                self.post(self.config.heading_mismatch_var, angle_diff(actual, self.config.heading))

    def on_run(self) -> IvPFunction | None:
        config = self.config
        actual = self.number("NAV_HEADING")
        if actual is not None:
            error = angle_diff(actual, config.heading)
            self.why = f"{error:.0f} degrees from heading {config.heading:g}"
            if config.complete_thresh is not None and error < config.complete_thresh:
                self.complete("heading reached")
                return None
        heading = on_grid(self.domain, config.heading)
        return course_peak(self.domain, heading, config.peakwidth, config.basewidth, config.summitdelta)
