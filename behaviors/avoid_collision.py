"""BHV_AvoidCollision: keep away from one vessel by the closest approach to it (behaviors.md C6)."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from mypy_extensions import mypyc_attr
from numpy.typing import NDArray

from behaviors import _kernels
from ivp_helm.contact_behavior import GRADES, ContactBehavior, graded
from ivp_helm.ivp import Domain, IvPFunction, Tiling, from_table
from pymoos_lite.config.parameters import Declaration, Parameter
from pymoos_lite.geometry.cpa import unit_vectors
from pymoos_lite.geometry.encounter import RelativeState

Array = NDArray[np.float64]

EXIT_FACTOR = 1.1
"""The behaviour ends beyond so many times its ``completed_dist``, lest it ends and returns at the border."""
PLANE = ("course", "speed")
PIECE = (3, 3)
"""Points of course and speed that a piece of the function spans."""


def distance(name: str, default: float, doc: str) -> Parameter:
    """A distance in metres, at least 0."""
    return Parameter(name, "number", default, "m", doc, low=0.0)


AVOIDANCE_PARAMETERS = Declaration(
    (
        distance("pwt_outer_dist", 200.0, "Range from which on the contact matters."),
        distance("pwt_inner_dist", 50.0, "Range below which it matters with full weight."),
        distance("completed_dist", 500.0, "The behaviour ends beyond 1.1 times this range."),
        distance("min_util_cpa_dist", 10.0, "Closest approaches below this are worth nothing."),
        distance("max_util_cpa_dist", 75.0, "Closest approaches above this are all as good."),
        Parameter(
            "pwt_grade",
            "choice",
            "quasi",
            "",
            "How the weight grows from the outer to the inner range.",
            choices=GRADES,
        ),
        Parameter(
            "match_type",
            "text",
            None,
            "",
            "Act on only contacts of these types.",
            repeated=True,
            aliases=("contact_type_required",),
            example="a,b",
        ),
        Parameter("no_alert_request", "boolean", False, "", "Do not ask the contact manager for alerts."),
        Parameter("can_disable", "boolean", False, "", "Obey BHV_ABLE_FILTER."),
    ),
    # They steer how the reference builds its functions, or do nothing there either.
    ignored=("use_refinery", "check_plateaus", "check_validity", "pcheck_thresh", "verbose"),
)
"""What this behaviour and its rule-following relatives have in common."""


@lru_cache(maxsize=16)
def _lattice(plane: Domain) -> tuple[Tiling, Array, Array]:
    """The tiles of course and speed, and the velocities (east, north) at the points that matter to them."""
    tiling = Tiling.of(plane, PIECE)
    course, speed = tiling.indexes
    east, north = unit_vectors(plane["course"].values())
    speeds = plane["speed"].values()
    return tiling, speeds[speed] * east[course], speeds[speed] * north[course]


@mypyc_attr(allow_interpreted_subclasses=True)
class AvoidanceBehavior(ContactBehavior):
    """Base of behaviours that keep away from one vessel: distances that stay in order, and when to end."""

    VARIABLES = PLANE
    CONSTRAINT = True
    PARAMETERS = AVOIDANCE_PARAMETERS
    DEFAULTS = {"time_on_leg": 120.0}  # noqa: RUF012

    def setup(self) -> None:
        self._plane: Domain | None = None

    def set_pwt_outer_dist(self, value: float) -> None:
        """The outer range; an inner one beyond it comes along."""
        self.set_pair("pwt_inner_dist", "pwt_outer_dist", "pwt_outer_dist", value)

    def set_pwt_inner_dist(self, value: float) -> None:
        """The inner range; an outer one short of it comes along."""
        self.set_pair("pwt_inner_dist", "pwt_outer_dist", "pwt_inner_dist", value)

    def set_min_util_cpa_dist(self, value: float) -> None:
        """The worthless approach; a larger one short of it comes along."""
        self.set_pair("min_util_cpa_dist", "max_util_cpa_dist", "min_util_cpa_dist", value)

    def set_max_util_cpa_dist(self, value: float) -> None:
        """The sufficient approach; a smaller one beyond it comes along."""
        self.set_pair("min_util_cpa_dist", "max_util_cpa_dist", "max_util_cpa_dist", value)

    @property
    def completed_dist(self) -> float:
        """The range at which the encounter counts as over, never short of the outer range."""
        return float(max(self.config.completed_dist, self.config.pwt_outer_dist))

    def alert_ranges(self) -> tuple[float, float]:
        return self.config.pwt_outer_dist, self.completed_dist

    def exit_reason(self, meeting: RelativeState) -> str | None:
        if meeting.range >= EXIT_FACTOR * self.completed_dist:
            return ""
        return super().exit_reason(meeting)

    def near_and_far(self, reach: float) -> tuple[float, float]:
        """Worthless and sufficient approach at this range: half the range where it is within the former."""
        near = self.config.min_util_cpa_dist
        return (near if reach > near else 0.5 * reach), self.config.max_util_cpa_dist

    @property
    def plane(self) -> Domain:
        """Course and speed of the helm's domain."""
        if self._plane is None:
            self._plane = self.domain.subdomain(PLANE)
            self._speeds = self._plane["speed"].values()
            self._east, self._north = unit_vectors(self._plane["course"].values())
        return self._plane

    def approach_utilities(self, meeting: RelativeState, horizon: float, near: float, far: float) -> Array:
        """The utility of the closest approach of every course and speed, 0 to 100: shape (courses, speeds)."""
        plane = self.plane
        if self.turns_at_once:
            engine = meeting.engine
            table = np.empty(plane.points)
            _kernels.avoidance(
                meeting.osx - meeting.cnx,
                meeting.osy - meeting.cny,
                *engine.contact_velocity,
                self._east,
                self._north,
                self._speeds,
                horizon,
                near,
                far,
                table,
            )
            return table
        table = self.cpa_table(meeting, horizon)
        _kernels.avoidance_of(table, near, far)
        return table


@mypyc_attr(allow_interpreted_subclasses=True)
class AvoidCollision(AvoidanceBehavior):
    """Prefers courses and speeds whose closest approach to the contact is far enough."""

    BHV_NAME = "BHV_AvoidCollision"
    DEFAULT_NAME = "bhv_avoid_collision"
    PARAMETERS = AVOIDANCE_PARAMETERS + Declaration(
        (
            Parameter(
                "collision_depth",
                "number",
                0.0,
                "m",
                "Deeper than this there is no collision; 0: no such depth. Needs depth in the helm's domain.",
                low=0.0,
            ),
        ),
        ignored=("roc_max_heighten", "roc_max_dampen"),
    )

    def setup(self) -> None:
        super().setup()
        self._closing = 0.0

    def look(self, meeting: RelativeState) -> None:
        if self.config.post_per_contact_info:
            contact = self.config.contact
            # The speed of closure is that of the last run, as those who read it have always had it.
            self.post(f"CLSG_SPD_AVD_{contact}", round(self._closing, 1))
            if meeting.range > 10.0:
                self.post_int(f"RANGE_AVD_{contact}", meeting.range)
            else:
                self.post(f"RANGE_AVD_{contact}", round(meeting.range, 1))

    def decide(self, meeting: RelativeState) -> IvPFunction | None:
        config = self.config
        self._closing = meeting.roc
        contact, reach = config.contact, meeting.range
        self.relevance = graded(reach, config.pwt_inner_dist, config.pwt_outer_dist, config.pwt_grade)
        if self.relevance <= 0.0:
            outer = config.pwt_outer_dist
            self.explain(lambda: f"{contact} is {reach:.0f} m off, beyond {outer:g} m")
            return None
        self.explain(lambda: f"{contact} is {reach:.0f} m off, closest approach {meeting.cpa:.0f} m as it is")
        if self.collision_depth > 0.0:
            return self._with_depth(meeting)
        if self.config.build_info or not self.turns_at_once:
            return from_table(self.plane, self.utilities(meeting), PIECE, self.config.build_info)
        return self._tiled(meeting)

    def _tiled(self, meeting: RelativeState) -> IvPFunction:
        """The function of `utilities`, which are worked out only where the pieces need them."""
        tiling, vx, vy = _lattice(self.plane)
        values = np.empty(tiling.size)
        engine = meeting.engine
        near, far = self.near_and_far(meeting.range)
        _kernels.avoidance_at(
            meeting.osx - meeting.cnx,
            meeting.osy - meeting.cny,
            *engine.contact_velocity,
            vx,
            vy,
            self.config.time_on_leg,
            near,
            far,
            values,
        )
        return tiling.function(values)

    def utilities(self, meeting: RelativeState) -> Array:
        """The utility of every course and speed, before it is made a function."""
        near, far = self.near_and_far(meeting.range)
        return self.approach_utilities(meeting, self.config.time_on_leg, near, far)

    # --- with depth ---------------------------------------------------------------------------------------

    @property
    def collision_depth(self) -> float:
        """The depth below which there is no collision, 0 where depth is not decided upon or never so great."""
        wanted = float(self.config.collision_depth)
        return wanted if "depth" in self.domain and wanted < self.domain["depth"].high else 0.0

    def _with_depth(self, meeting: RelativeState) -> IvPFunction:
        """Above the collision depth the closest approach counts, below it every course is good.

        Depth itself costs up to 10 points, so that the vessel dives no deeper than it has to.
        """
        self.post("AVD_STATUS", "")
        near, far = self.near_and_far(meeting.range)
        if meeting.roc < 0.0:
            far += meeting.roc
        far = max(far, near + 10.0)
        cpa = self.cpa_table(meeting, self.config.time_on_leg)
        utilities = np.clip((cpa - near) / (far - near), 0.0, 1.0) * 100.0
        above = from_table(self.plane, utilities, PIECE, extent=0.0)
        domain = self.domain.subdomain((*PLANE, "depth"))
        depths = domain["depth"].values()
        first_deep = int(np.searchsorted(depths, self.collision_depth))
        slope = -10.0 * (depths[1] - depths[0]) / depths[-1]
        surface = 10.0 * (1.0 - depths[0] / depths[-1])
        low: list[Any] = []
        high: list[Any] = []
        coefs: list[Any] = []
        if first_deep > 0:
            planes = above.coefficients
            for p in range(above.pieces):
                low.append((*above.low[p], 0))
                high.append((*above.high[p], first_deep - 1))
                coefs.append((planes[p, 0], planes[p, 1], slope, planes[p, 2] + surface))
        last = np.array(domain.points) - 1
        low.append((0, 0, first_deep))
        high.append(tuple(last))
        coefs.append((0.0, 0.0, slope, 90.0 + surface))
        return IvPFunction(domain, low, high, coefs).normalised()
