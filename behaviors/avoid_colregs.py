"""BHV_AvdColregsV17, V19, V22 and V26: keep away from one vessel by the rules of the road (behaviors.md C7).

One behaviour and a table of what its versions do differently. Which rule applies is found out in
`colregs_modes`, what each rule makes of courses and speeds in `colregs_utilities`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from behaviors import colregs_utilities
from behaviors.avoid_collision import AVOIDANCE_PARAMETERS, PIECE, AvoidanceBehavior, distance
from behaviors.colregs_modes import NONE, Limits, RuleWatch
from ivp_helm.contact_behavior import GRADES, graded
from ivp_helm.ivp import IvPFunction, from_table
from pymoos_lite.config.parameters import Declaration, Parameter, ParameterError
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.encounter import RelativeState
from pymoos_lite.geometry.shapes import SegList
from pymoos_lite.geometry.specs import seglist_text
from pymoos_lite.geometry.text import fields, parse_number

Array = NDArray[np.float64]

HORIZON = 120.0
"""Seconds ahead that closest approaches count for where eval_tol has no say."""


@dataclass(frozen=True, slots=True)
class VelocityFilter:
    """Slow encounters need less room: the share of the CPA distances that is needed between two speeds."""

    min_spd: float = 0.0
    max_spd: float = 0.0
    share: float = 1.0

    def factor(self, speed: float) -> float:
        """What the CPA distances are multiplied with when the faster vessel goes at `speed`."""
        if speed >= self.max_spd:
            return 1.0
        if speed <= self.min_spd:
            return self.share
        return self.share + (1.0 - self.share) * (speed - self.min_spd) / (self.max_spd - self.min_spd)


def read_velocity_filter(text: str) -> VelocityFilter:
    """``min_spd=0.5,max_spd=1.5,pct=50``.

    Raises:
        ParameterError: it is none.
    """
    told = {key.lower(): parse_number(value) for key, value in fields(text)}
    low, high, percent = (told.get(key) for key in ("min_spd", "max_spd", "pct"))
    if set(told) != {"min_spd", "max_spd", "pct"} or low is None or high is None or percent is None:
        raise ParameterError(f"velocity_filter = {text!r}: expected min_spd=..,max_spd=..,pct=..")
    if not 0.0 <= low <= high or not 0.0 <= percent <= 100.0:
        raise ParameterError(
            f"velocity_filter = {text!r}: expected 0 <= min_spd <= max_spd and pct in [0, 100]"
        )
    return VelocityFilter(low, high, percent / 100.0)


COLREGS_PARAMETERS = AVOIDANCE_PARAMETERS + Declaration(
    (
        distance("pwt_outer_dist", 100.0, "Range from which on the contact matters."),
        distance("pwt_inner_dist", 90.0, "Range below which it matters with full weight."),
        distance("completed_dist", 100.0, "The behaviour ends beyond 1.1 times this range."),
        Parameter(
            "pwt_grade",
            "choice",
            "linear",
            "",
            "How the weight grows from the outer to the inner range.",
            choices=GRADES,
        ),
        Parameter(
            "giveway_bow_dist",
            "number",
            -1.0,
            "m",
            "Enough room ahead of the contact; negative: by the CPA distances.",
        ),
        Parameter("turn_radius", "number", 0.0, "m", "Own ship's turning radius.", low=0.0),
        Parameter("headon_only", "boolean", False, "", "Know no rule but that of meeting head-on."),
        Parameter(
            "pts_port_turns_ok", "boolean", True, "", "Giving way, a port turn is as good if it leads astern."
        ),
        Parameter(
            "eval_tol",
            "number",
            HORIZON,
            "s",
            "How far ahead a closest approach counts.",
            low=5.0,
            high=300.0,
            clip=True,
        ),
        Parameter(
            "velocity_filter",
            "custom",
            None,
            "",
            "Slow encounters need less room.",
            parse=read_velocity_filter,
            example="min_spd=0.5,max_spd=1.5,pct=50",
        ),
        Parameter("post_status_info_on_idle", "boolean", False, "", "Post the figures while idle as well."),
        Parameter("avoid_mode", "text", "", "", "A mode to have whatever the situation, for trying it out."),
        Parameter("avoid_submode", "text", "", "", "Its submode."),
    )
)


class AvoidColregs(AvoidanceBehavior):
    """Gives way, stands on, overtakes and passes head-on as the rules of the road have it."""

    BHV_NAME = "BHV_AvdColregsV22"
    DEFAULT_NAME = "avdcolregs"
    PARAMETERS = COLREGS_PARAMETERS

    RELEVANCE: ClassVar[str] = "COL22_RELEVANCE"
    """Variable of the relevance."""
    FORMER: ClassVar[bool] = False
    """The older versions post their figures while idle too, and a line to the contact."""
    TOLERANCE_EVERYWHERE: ClassVar[bool] = False
    """eval_tol counts for giving way and mere distance as well."""
    BOW_LIMIT: ClassVar[float] = 2.0
    """giveway_bow_dist is at most so many max_util_cpa_dist."""
    EXIT_FACTOR: ClassVar[float] = 1.1

    def setup(self) -> None:
        super().setup()
        self.rules = RuleWatch()
        self._post_mortem = ""
        self._weight = 0.0
        self._held: tuple[tuple[float, float], IvPFunction] | None = None

    # --- parameters ---------------------------------------------------------------------------------------

    def set_completed_dist(self, value: float) -> None:
        """The range at which the encounter is over; the other ranges are lowered to it."""
        values = vars(self.config)
        values["completed_dist"] = value
        values["pwt_outer_dist"] = min(values["pwt_outer_dist"], value)
        values["pwt_inner_dist"] = min(values["pwt_inner_dist"], value)

    @property
    def limits(self) -> Limits:
        """The distances that the rules depend on."""
        c = self.config
        bow = c.giveway_bow_dist
        if bow >= 0.0:
            bow = max(c.min_util_cpa_dist, min(bow, self.BOW_LIMIT * c.max_util_cpa_dist))
        return Limits(c.pwt_outer_dist, c.min_util_cpa_dist, c.max_util_cpa_dist, bow, c.turn_radius)

    # --- life ---------------------------------------------------------------------------------------------

    def exit_reason(self, meeting: RelativeState) -> str | None:
        stage = self._post_mortem or "c"
        if meeting.range >= self.EXIT_FACTOR * self.completed_dist:
            return f"rng1p1{stage}"
        return None if super(AvoidanceBehavior, self).exit_reason(meeting) is None else f"filter{stage}"

    def on_idle(self) -> None:
        self._post_mortem = "a"
        super().on_idle()
        if self.meeting is not None and (self.FORMER or self.config.post_status_info_on_idle):
            self._weight = 0.0
            if self.FORMER and not self._line_drawn and self.state == "":
                self.post("VIEW_SEGLIST", "active=false", "line")
            self._tell(self.meeting)

    def on_disabled(self) -> None:
        self._post_mortem = "b"
        super().on_disabled()

    def on_run(self) -> IvPFunction | None:
        self._post_mortem = "c"
        return super().on_run()

    def on_run_to_idle(self) -> None:
        super().on_run_to_idle()
        self.rules = RuleWatch()
        if self.FORMER:
            self.post("VIEW_SEGLIST", "active=false", "line")

    def mode(self) -> tuple[str, str]:
        rules = self.rules
        return rules.mode, "" if rules.submode == NONE else rules.submode

    def decide(self, meeting: RelativeState) -> IvPFunction | None:
        config, rules = self.config, self.rules
        if config.avoid_mode:
            rules.force(config.avoid_mode, config.avoid_submode)
        else:
            rules.look(meeting, self.limits, self.now, config.headon_only)
        inner, outer = config.pwt_inner_dist, config.pwt_outer_dist
        self.relevance = graded(meeting.range, inner, outer, config.pwt_grade)
        self._weight = self.relevance * self.pwt
        self._tell_found()
        self._tell(meeting)
        self.why = f"{config.contact} is {meeting.range:.0f} m off: {rules.full_mode}"
        if self.relevance <= 0.0 or rules.mode == NONE:
            return None
        if rules.mode in ("standon", "standon_ot") and rules.submode != "inextremis":
            return self._stand_on()
        return from_table(self.plane, self.utilities(meeting), PIECE, config.build_info)

    def _stand_on(self) -> IvPFunction:
        held = self.rules.held_heading, self.rules.held_speed
        if self._held is None or self._held[0] != held:
            self._held = held, colregs_utilities.stand_on(self.domain, *held)
        return self._held[1]

    def utilities(self, meeting: RelativeState) -> Array:
        """The utility of every course and speed under the rule that applies."""
        plane, rules, config = self.plane, self.rules, self.config
        near, far = self._cpa_distances(meeting)
        courses, speeds = plane["course"].values(), self._speeds
        tolerance = config.eval_tol
        if rules.mode == "overtaking":
            cpa = self.cpa_table(meeting, tolerance)
            port = rules.submode == "port"
            return colregs_utilities.overtaking(meeting, courses, speeds, cpa, near, far, port)
        if rules.mode == "headon":
            base = self.approach_utilities(meeting, tolerance, near, far)
            return colregs_utilities.headon(meeting, courses, speeds, base)
        horizon = tolerance if self.TOLERANCE_EVERYWHERE else HORIZON
        base = self.approach_utilities(meeting, horizon, near, far)
        if rules.mode == "giveway":
            if rules.submode == "bow":
                return colregs_utilities.giveway_bow(meeting, courses, speeds, base)
            return colregs_utilities.giveway_stern(meeting, courses, speeds, base, config.pts_port_turns_ok)
        return base

    def _cpa_distances(self, meeting: RelativeState) -> tuple[float, float]:
        near, far = self.config.min_util_cpa_dist, self.config.max_util_cpa_dist
        slow = self.config.velocity_filter
        if slow is not None:
            factor = slow.factor(max(meeting.osv, meeting.cnv))
            near, far = near * factor, far * factor
        return (near if meeting.range > near else 0.5 * meeting.range), far

    # --- telling ------------------------------------------------------------------------------------------

    def _tell_found(self) -> None:
        """What was found out about the mode, in the order in which it was."""
        config, rules = self.config, self.rules
        if not config.post_per_contact_info:
            return
        who = config.contact.upper()
        for variable, value in rules.notes:
            if variable == "HEADON":
                self.post(f"HEADON_DEBUG_{self.community.upper()}", f"contact={config.contact},{value}")
            else:
                self.post(f"{variable}_{who}", value)
        if self.FORMER:
            version = self.BHV_NAME.removeprefix("BHV_AvdColregs")
            self.post("AVD_INFO", f"{version} CN:{config.contact}  Mode:{rules.full_mode}")
            self.post(self.RELEVANCE, self.relevance)
            m = self.meeting
            if m is not None and self.visuals:
                looks = Attributes(label=f"{self.community}{self.name}", msg=rules.full_mode)
                ends = ((m.osx, m.osy), (m.cnx, m.cny))
                self.post("VIEW_SEGLIST", seglist_text(SegList(ends, attributes=looks)), "line")
        else:
            self.post(f"{self.RELEVANCE}_{who}", self.relevance)
            self.post(f"COL22_AVOID_MODE_{who}", rules.mode)

    def _tell(self, m: RelativeState) -> None:
        if not self.config.post_per_contact_info:
            return
        rules, who = self.rules, self.config.contact.upper()
        self.post(f"CN_FORE_OF_OS_{who}", float(m.cn_fore_of_os))
        self.post(f"CN_PORT_OF_OS__{who}", float(m.cn_port_of_os))
        self.post(f"CN_CROSSED_OS_PORT_STAR_{who}", float(rules.crossed_sides))
        self.post(f"AVDCOL_RANGE_{who}", m.range)
        self.post(f"COLREGS_AVOID_MODE_{who}", rules.full_mode)
        self.post(f"COLREGS_SUMMARY_{who}", f"mode={rules.mode}:{rules.submode}")
        self.post(f"COLREGS_AVOID_IX_{who}", float(rules.mode_id), repeat=True)
        self.post(f"COLREGS_AVOID_PWT_{who}", self._weight, repeat=True)
        self.post(f"COLREGS_CONTACT_HDG_{who}", m.cnh)

    def macro(self, name: str) -> float | str | None:
        rules = self.rules
        values: dict[str, float | str] = {
            "AVD_MODE": rules.mode,
            "AVD_SMODE": rules.submode,
            "APWT": self._weight,
            "MODE_ID": float(rules.mode_id),
            "FULL_MODE": rules.full_mode,
        }
        return values[name] if name in values else super().macro(name)


class AvoidColregsV26(AvoidColregs):
    """As V22, with own ship's turn in closest approaches and eval_tol for every rule."""

    BHV_NAME = "BHV_AvdColregsV26"
    TOLERANCE_EVERYWHERE = True
    DEFAULTS = {**AvoidColregs.DEFAULTS, "use_plat_model": True}  # noqa: RUF012


class AvoidColregsV19(AvoidColregs):
    """As V22; tells its figures while idle too."""

    BHV_NAME = "BHV_AvdColregsV19"
    RELEVANCE = "COL19_RELEVANCE"
    FORMER = True
    BOW_LIMIT = 1.0


class AvoidColregsV17(AvoidColregsV19):
    """As V19; ends at completed_dist itself."""

    BHV_NAME = "BHV_AvdColregsV17"
    RELEVANCE = "COL17_RELEVANCE"
    EXIT_FACTOR = 1.0
