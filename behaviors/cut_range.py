"""BHV_CutRange: pursue a vessel (behaviors.md C11)."""

from __future__ import annotations

from collections.abc import Iterable

from behaviors.pursuit import pursuit_function
from ivp_helm.base_parameters import flag_parameter
from ivp_helm.contact_behavior import ContactBehavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.encounter import RelativeState

GIVE_UP_MARGIN = 1.0  # m


class CutRange(ContactBehavior):
    """Closes in on the contact, the more eagerly the farther it is, until it is too far."""

    BHV_NAME = "BHV_CutRange"
    DEFAULT_NAME = "bhv_cut_range"
    DEFAULTS = {"time_on_leg": 15.0}  # noqa: RUF012
    PARAMETERS = Declaration(
        (
            Parameter("pwt_outer_dist", "number", 0.0, "m", "Full weight from this range on.", low=0.0),
            Parameter("pwt_inner_dist", "number", 0.0, "m", "No weight below this range.", low=0.0),
            Parameter(
                "giveup_range",
                "number",
                0.0,
                "m",
                "No pursuit beyond this range; 0: pursue however far.",
                low=0.0,
                aliases=("giveup_dist",),
            ),
            Parameter(
                "patience",
                "number",
                0.0,
                "%",
                "0: close as fast as can be now; 100: aim at the closest approach.",
                low=0.0,
                high=100.0,
            ),
            Parameter(
                "max_patience", "number", 85.0, "%", "Patience never exceeds this.", low=0.0, high=100.0
            ),
            flag_parameter("pursueflag", "Posted on beginning to pursue.", "pursue_flag"),
            flag_parameter("giveupflag", "Posted on giving up.", "giveup_flag"),
            Parameter("no_alert_request", "boolean", False, "", "Do not ask the contact manager for alerts."),
            Parameter("can_disable", "boolean", False, "", "Obey BHV_ABLE_FILTER."),
        ),
        ignored=("use_refinery",),
    )

    def setup(self) -> None:
        self.pursuing: bool | None = None

    def check(self) -> Iterable[str]:
        inner, outer = self.config.pwt_inner_dist, self.config.pwt_outer_dist
        if inner > outer:
            yield f"pwt_inner_dist = {inner:g} is beyond pwt_outer_dist = {outer:g}"

    def alert_ranges(self) -> tuple[float, float]:
        outer = self.config.pwt_outer_dist
        return outer, max(outer, self.config.giveup_range)

    def decide(self, meeting: RelativeState) -> IvPFunction | None:
        config = self.config
        self._pursue_or_not(meeting.range)
        self.relevance = self._relevance(meeting.range)
        if self.relevance <= 0.0:
            return None
        self.why = f"{config.contact} is {meeting.range:.0f} m off, closing at {meeting.roc:.1f} m/s"
        plane = self.domain.subdomain(("course", "speed"))
        return pursuit_function(plane, meeting.engine, config.time_on_leg, self.patience)

    @property
    def patience(self) -> float:
        """The share of the closest approach, 0 to 1."""
        return float(min(self.config.patience, self.config.max_patience)) / 100.0

    def _pursue_or_not(self, reach: float) -> None:
        limit = self.config.giveup_range
        pursuing = limit <= 0.0 or reach <= limit + GIVE_UP_MARGIN
        if pursuing == self.pursuing:
            return
        # One that never pursued has nothing to give up.
        if pursuing or self.pursuing:
            self.post_flags(self.config.pursueflag if pursuing else self.config.giveupflag)
        self.pursuing = pursuing

    def _relevance(self, reach: float) -> float:
        inner, outer = self.config.pwt_inner_dist, self.config.pwt_outer_dist
        if inner == outer:
            self.why = "pwt_inner_dist and pwt_outer_dist are equal: nothing to do"
            return 0.0
        if not self.pursuing:
            self.why = f"{self.config.contact} is {reach:.0f} m off: given up"
            return 0.0
        return min(1.0, max(0.0, float((reach - inner) / (outer - inner))))
