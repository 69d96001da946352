"""BHV_HeadingChange: turn by an angle, then be done (behaviors.md C25)."""

from __future__ import annotations

from behaviors import forms
from behaviors.steering import coupled, course_peak, speed_peak
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter, parse_number
from pymoos_lite.geometry.angles import angle180, angle360

CLOSE_ENOUGH = 1.0
NO_SPEED = "Problem retrieving info from info_buffer."


def _turn_speed(text: str) -> float | None:
    """None for ``current``."""
    if text.strip().lower() == "current":
        return None
    value = parse_number(text.strip())
    if value <= 0.0:
        raise ValueError("give a speed above 0, or current")
    return value


class HeadingChange(Behavior):
    """Turns to one side by so many degrees of the heading it began with, and completes on getting there."""

    BHV_NAME = "BHV_HeadingChange"
    DEFAULT_NAME = "bhv_heading_change"
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED", "DESIRED_SPEED")
    PARAMETERS = Declaration(
        (
            forms.number(
                "heading_delta", 20.0, "deg", "How far to turn.", low=1.0, high=360.0, open_high=True
            ),
            Parameter(
                "turn_type",
                "choice",
                "starboard",
                "",
                "To which side.",
                choices=("starboard", "port", "star"),
            ),
            forms.custom(
                "turn_speed", _turn_speed, None, "Speed of the turn; current: as asked for before.", "current"
            ),
        )
    )

    def setup(self) -> None:
        self._goal: float | None = None
        self._speed = 0.0
        self._left = 0.0
        """Degrees still to turn, signed to starboard, counted on past half a turn."""
        self._last = 0.0
        self._steps: tuple[float, ...] = ()
        """What it turned in the last two iterations."""
        self._from_above = False
        """Whether the heading began with is the greater number than the goal."""
        self._turns = 0

    def on_run_to_idle(self) -> None:
        self._goal = None

    def on_run(self) -> IvPFunction | None:
        heading = self.own.heading
        if self._goal is None:
            if not self._begin(heading):
                return None
        elif self._arrived(heading):
            self._goal = None
            self.complete("heading reached")
            return None
        goal = self._goal
        assert goal is not None
        self.why = f"{abs(self._left):.0f} degrees to turn to heading {goal:.0f}"
        return coupled(
            course_peak(self.domain, goal, 20.0, 160.0, 50.0),
            speed_peak(self.domain, self._speed, 0.4, 0.6, 50.0),
        )

    def _begin(self, heading: float) -> bool:
        desired = self.number("DESIRED_SPEED")
        if desired is None:
            self.warn(NO_SPEED)
            self.why = "DESIRED_SPEED is unknown"
            return False
        self.retract_warning("DESIRED_SPEED dbl info not found in helm info_buffer")
        self.retract_warning(NO_SPEED)
        self._speed = desired if self.config.turn_speed is None else self.config.turn_speed
        turn = self.config.heading_delta * (-1.0 if self.config.turn_type == "port" else 1.0)
        self._goal = angle360(heading + turn)
        self._left, self._last = turn, heading
        self._steps = ()
        self._from_above = heading > self._goal
        self.post("HEADING_GOAL", self._goal)
        return True

    def _arrived(self, heading: float) -> bool:
        """Whether the goal is reached or passed; the way is counted, so a turn may be longer than 180."""
        step = angle180(heading - self._last)
        self._left -= step
        self._last = heading
        self._steps = (*self._steps[-1:], step)
        self.post("CURR_HDG_DELTA", abs(self._left))
        self.post("M_SIGN_POS", self._from_above)
        self.post("CURR_SIGN_POS", self._from_above)
        if len(self._steps) == 2:
            self.post("HEADING_TREND_1", self._steps[1])
            self.post("HEADING_TREND_2", self._steps[0])
            self.post("POS_TREND", sum(self._steps) > 0.0)
        passed = self._left <= 0.0 if self.config.turn_type != "port" else self._left >= 0.0
        if abs(self._left) <= CLOSE_ENOUGH or passed:
            self._turns += 1
            self.post("TURNS", float(self._turns))
            return True
        return False
