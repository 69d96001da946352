"""BHV_Hysteresis and BHV_HeadingHysteresis: steadiness of the heading (behaviors.md C25)."""

from __future__ import annotations

from math import sqrt

from behaviors import forms
from behaviors.heading_memory import HeadingMemory
from behaviors.steering import course_peak
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter

LARGE_DEVIATION = 30.0
"""Degrees of deviation at which the window has shrunk to its least width."""
NO_MEMORY = "memory_time is not set"

MEMORY_TIME = forms.custom(
    "memory_time",
    forms.read_off_or(lambda value: value >= 0.0, "seconds of at least 0"),
    None,
    "How far back headings are remembered; required.",
    "60",
    unit="s",
)


class Hysteresis(Behavior):
    """Prefers courses near the present heading: a wide window after steady sailing, a narrow one after turns."""

    BHV_NAME = "BHV_Hysteresis"
    DEFAULT_NAME = "bhv_hysteresis"
    VARIABLES = ("course",)
    INFO = ("NAV_HEADING",)
    PARAMETERS = Declaration(
        (
            MEMORY_TIME,
            forms.number(
                "min_heading_window", 10.0, "deg", "Width of the window after hard turns.", high=360.0
            ),
            forms.number(
                "max_heading_window", 280.0, "deg", "Width of the window after a steady course.", high=360.0
            ),
            Parameter(
                "max_window_utility",
                "number",
                90.0,
                "",
                "Utility at the edge of the window.",
                low=0.0,
                high=100.0,
            ),
        )
    )

    def setup(self) -> None:
        self._memory = HeadingMemory()

    def on_run(self) -> IvPFunction | None:
        config = self.config
        if config.memory_time is None:
            self.warn(NO_MEMORY)
            return None
        heading = self.own.heading
        memory = self._memory
        memory.add(self.now, heading, config.memory_time)
        self.post("HYSTER_HDG_AVG", memory.mean)
        variance = memory.variance
        self.post("HYSTER_HDG_VAR", variance)
        narrow, wide = sorted((config.min_heading_window, config.max_heading_window))
        steadiness = max(0.0, 1.0 - sqrt(variance) / LARGE_DEVIATION)
        half = 0.5 * (narrow + steadiness * (wide - narrow))
        self.why = f"within {half:.0f} degrees of heading {heading:.0f}"
        return course_peak(self.domain, heading, half, 180.0 - half, 100.0 - config.max_window_utility)


class HeadingHysteresis(Behavior):
    """Watches the helm's unfiltered decision of course and tells its mean and variance; has no opinion."""

    BHV_NAME = "BHV_HeadingHysteresis"
    DEFAULT_NAME = "bhv_heading_hysteresis"
    VARIABLES = ()
    FILTER_LEVEL = 1
    PARAMETERS = Declaration(
        (
            MEMORY_TIME,
            forms.variable("filter_var", "DESIRED_HEADING_UNFILTERED", "Variable that holds the course."),
        )
    )

    def setup(self) -> None:
        self._memory = HeadingMemory()

    def on_parameters(self) -> None:
        self.watch(self.config.filter_var)

    def on_run(self) -> None:
        if self.config.memory_time is None:
            self.warn(NO_MEMORY)
            return
        heading = self.buffer.number(self.config.filter_var)
        if heading is None:
            return
        self._memory.add(self.now, heading, self.config.memory_time)
        self.post("HIST_HEADING_AVERAGE", self._memory.mean)
        self.post("HIST_HEADING_VARIANCE", self._memory.variance)
