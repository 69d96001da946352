"""BHV_MaintainHeading: go on the way one was going (behaviors.md C25)."""

from __future__ import annotations

from behaviors import forms
from behaviors.steering import course_peak
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter, parse_number
from pymoos_lite.geometry.angles import angle360


def _heading(text: str) -> float | None:
    """None for ``on_active``."""
    return None if text.strip().lower() == "on_active" else angle360(parse_number(text.strip()))


class MaintainHeading(Behavior):
    """Keeps the heading of the moment it began to run, or a given one. Completes at once without `duration`."""

    BHV_NAME = "BHV_MaintainHeading"
    DEFAULT_NAME = "bhv_maintain_heading"
    VARIABLES = ("course",)
    INFO = ("NAV_HEADING",)
    DEFAULTS = {"duration": 0.0}  # noqa: RUF012
    PARAMETERS = Declaration(
        (
            forms.custom(
                "heading", _heading, None, "Heading to keep, or on_active: the one at the start.", "on_active"
            ),
            forms.number("peakwidth", 30.0, "deg", "Half width of the summit.", clip=True),
            forms.number("basewidth", 150.0, "deg", "Width of each flank.", clip=True),
            Parameter(
                "summitdelta", "number", 80.0, "", "Fall over the summit.", low=0.0, high=100.0, clip=True
            ),
        )
    )

    def setup(self) -> None:
        self._kept: float | None = None

    def on_idle_to_run(self) -> None:
        self._kept = None

    def on_run(self) -> IvPFunction | None:
        config = self.config
        heading = config.heading
        if heading is None:
            if self._kept is None:
                self._kept = self.own.heading
            heading = self._kept
        self.why = f"keeps heading {heading:.0f}"
        return course_peak(self.domain, heading, config.peakwidth, config.basewidth, config.summitdelta)
