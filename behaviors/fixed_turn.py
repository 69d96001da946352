"""BHV_FixedTurn: turn by a fixed angle with a fixed lead of the heading (behaviors.md C18)."""

from __future__ import annotations

from typing import Literal

from behaviors import forms
from behaviors.steering import speed_band, toward
from behaviors.turn_meter import TurnMeter
from behaviors.turn_spec import ClearTurns, Schedule, TurnSpec, read_side, read_turn_spec
from ivp_helm.behavior import Behavior, BehaviorError
from ivp_helm.flags import Flag
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration, Parameter, parse_number
from pymoos_lite.geometry.angles import angle360
from pymoos_lite.geometry.text import num

NAVIGATION = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED")


def _speed(text: str) -> float | None:
    """None for ``auto``."""
    if text.strip().lower() == "auto":
        return None
    value = parse_number(text.strip())
    if value < 0.0:
        raise ValueError("give a speed of at least 0, or auto")
    return value


class FixedTurn(Behavior):
    """Turns by an angle at a constant rate, measures the turning circle and reports it.

    With a schedule of turns each run sails the next one.
    """

    BHV_NAME = "BHV_FixedTurn"
    DEFAULT_NAME = "bhv_fixed_turn"
    INFO = (*NAVIGATION, "DESIRED_RUDDER")
    PARAMETERS = Declaration(
        (
            forms.number("fix_turn", 0.0, "deg", "How far to turn in all."),
            forms.number(
                "mod_hdg", 20.0, "deg", "Ask for a heading so far ahead of the present one.", high=180.0
            ),
            forms.custom(
                "turn_dir", read_side, "port", "Side of the turn; auto: not that of the last one.", "port"
            ),
            forms.custom(
                "speed", _speed, 1.0, "Speed of the turn; auto: that at the start.", "1", unit="m/s"
            ),
            forms.custom(
                "timeout",
                forms.read_off_or(lambda value: value >= 0.0, "seconds of at least 0"),
                None,
                "End the turn after this time.",
                "off",
                unit="s",
            ),
            forms.custom(
                "turn_delay",
                forms.read_off_or(lambda value: value >= 0.0, "seconds of at least 0"),
                None,
                "Go straight on for this time before.",
                "off",
                unit="s",
            ),
            forms.number("stale_nav_thresh", 5.0, "s", "Navigation older than this is an error."),
            forms.variable("radius_rep_var", "", "Variable for the radius of each turn."),
            Parameter("schedule_repeat", "boolean", False, "", "After the last turn begin with the first."),
            forms.custom(
                "turn_spec",
                read_turn_spec,
                None,
                "A turn of the schedule; clear: forget them.",
                "spd=2,mhdg=30,fix=360,turn=port,timeout=90,key=a,flag=DONE=true",
                repeated=True,
                aliases=("schedule",),
            ),
        ),
        ignored=("i_understand_this_behavior_is_deprecated",),
    )

    def setup(self) -> None:
        self.schedule = Schedule()
        self._meter: TurnMeter | None = None
        self._since: float | None = None
        """When this run began; None on the stem."""
        self._auto_speed = 0.0
        self._last_side = "star"
        self._spec = TurnSpec()

    def set_turn_spec(self, spec: TurnSpec | ClearTurns) -> None:
        self.schedule.take(spec)

    def all_flags(self) -> list[Flag]:
        return [*super().all_flags(), *(flag for spec in self.schedule.turns for flag in spec.flags)]

    # --- running ------------------------------------------------------------------------------------------

    def on_idle_to_run(self) -> None:
        self._since = self._meter = None

    def on_run(self) -> IvPFunction | None:
        self._require_fresh()
        spec = self.schedule.current()
        if spec is None:
            self.why = "all turns of the schedule are done"
            return None
        own, now = self.own, self.now
        if self._since is None:
            self._since, self._auto_speed = now, own.speed
        delay = self.config.turn_delay
        if self._meter is None:
            if delay is not None and now - self._since < delay - 1e-9:
                self.why = f"{delay - (now - self._since):.1f} s to the turn"
                return self._function(own.heading, self._number("speed", spec))
            self._begin(spec)
        else:
            self._meter.add(own.x, own.y, own.heading, self._rudder())
        if self._done():
            self._finish()
            return None
        meter, limit = self._meter, self._number("turn", spec)
        assert meter is not None
        ahead = self._number("mod_heading", spec)
        self.why = f"{meter.progress:.0f} of {limit:.0f} degrees turned to {meter.side}"
        asked = own.heading + (-ahead if meter.side == "port" else ahead)
        return self._function(angle360(asked), self._number("speed", spec))

    def _require_fresh(self) -> None:
        for variable in NAVIGATION:
            age = self.buffer.age(variable)
            if age is None or age > self.config.stale_nav_thresh:
                raise BehaviorError(f"{variable} not found or stale.")

    def _begin(self, spec: TurnSpec) -> None:
        own, side = self.own, spec.side or self.config.turn_dir
        if side == "auto":
            side = "port" if self._last_side == "star" else "star"
        way: Literal["port", "star"] = "port" if side == "port" else "star"
        self._last_side = way
        self._spec = spec
        self._meter = TurnMeter(way, self.now, own.x, own.y, own.heading)

    def _done(self) -> bool:
        meter = self._meter
        assert meter is not None
        timeout = self._spec.timeout
        if timeout is None or timeout < 0.0:
            timeout = self.config.timeout
        late = timeout is not None and self.now - meter.began >= timeout - 1e-9
        return bool(meter.progress >= self._number("turn", self._spec) > 0.0) or late

    def _finish(self) -> None:
        meter, spec = self._meter, self._spec
        assert meter is not None
        report = (
            f"spd={num(self._number('speed', spec), 2)},mod_hdg={num(self._number('mod_heading', spec), 2)},"
            f"rudder_avg={num(meter.mean_rudder, 2)}"
        )
        if meter.radii:
            report += (
                f",avg_rad={num(meter.radius, 2)},min_rad={num(min(meter.radii), 2)},"
                f"max_rad={num(max(meter.radii), 2)}"
            )
            self.post(self.config.radius_rep_var, meter.radius, repeat=True)
        self.post("FT_REPORT", report, repeat=True)
        self.post_flags(spec.flags)
        self.schedule.advance(self.config.schedule_repeat)
        self.complete(f"turned {meter.progress:.0f} degrees")
        self.why = f"turned {meter.progress:.0f} degrees"
        self._since = self._meter = None

    def _number(self, what: str, spec: TurnSpec) -> float:
        own = {"speed": self.config.speed, "mod_heading": self.config.mod_hdg, "turn": self.config.fix_turn}
        value = getattr(spec, what)
        if value is None:
            value = own[what]
        return float(self._auto_speed if value is None else value)

    def _rudder(self) -> float | None:
        return self.buffer.number("DESIRED_RUDDER")

    def _function(self, course: float, speed: float) -> IvPFunction:
        return toward(self.domain, course, speed_band(self.domain, speed, 85.0, 20.0))

    def macro(self, name: str) -> float | str | None:
        meter = self._meter
        if meter is None or name not in ("TURN_DIST", "TURN_TIME", "TURN_RAD"):
            return 0.0 if name in ("TURN_DIST", "TURN_TIME", "TURN_RAD") else None
        if name == "TURN_DIST":
            return meter.distance
        return self.now - meter.began if name == "TURN_TIME" else meter.radius
