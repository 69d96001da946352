"""A vessel on the water: thrust, rudder and elevator in, position, heading, speed and depth out.

The equations are those of uSimMarineV22 (marine_apps.md 1.3-1.6), with the differences of uSimMarineV23
and of the older uSimMarine (1.9) as parameters, because missions are tuned to them, oddities included.
No clock, no mail: the caller says how much time has passed. x is east, y north, in metres; headings in
degrees clockwise from north; depth in metres, positive down; pitch in radians, nose up positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any, NamedTuple

from mypy_extensions import mypyc_attr

from pymoos_lite.marine.thrust_map import ThrustMap

_RADIANS = math.pi / 180.0
_DEGREES = 180.0 / math.pi
_FULL_DIFFERENTIAL_TURN = 36.0  # deg/s at full opposite thrust, whatever turn_rate says
_PITCH_LAG_S = 1.0  # how quickly pitch follows the elevator in the tick-independent depth model


class TurnLaw(Enum):
    """How the turn rate depends on speed."""

    SPEED_MAP = "speed_map"  # V22, V23: grows linearly with speed up to 5 m/s
    ANY_SPEED = "any_speed"  # uSimMarine: full turn rate as soon as the vessel moves


class DepthModel(Enum):
    """How pitch, and with it the depth rate, follows the elevator."""

    COMPAT = "compat"  # the reference: pitch changes per step, so the dive depends on the tick
    STEADY = "steady"  # pitch relaxes to its balance in seconds, whatever the tick


class RudderSlew(Enum):
    """When a rudder limited by `max_rudder_rate` moves."""

    MAIL = "mail"  # the reference: only when a request arrives, by the time since the last one
    STEADY = "steady"  # every step, as a steering engine does


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class VesselParameters:
    """What a vessel can do. Speeds in m/s, accelerations in m/s^2, rates as named; 0 = no limit where a
    limit can be off."""

    thrust_map: ThrustMap = field(default_factory=ThrustMap)
    turn_rate: float = 70.0
    turn_spd_loss: float = 0.85
    turn_law: TurnLaw = TurnLaw.SPEED_MAP
    turn_full_speed: float = 5.0
    turn_full_rate: float | None = None  # None: turn_rate
    turn_null_speed: float = 0.0
    turn_null_rate: float = 0.0
    max_acceleration: float = 0.0
    max_deceleration: float = 0.5
    max_speed: float = 5.0
    turn_radius: float = 0.0
    max_rudder_rate: float = 0.0
    rudder_slew: RudderSlew = RudderSlew.MAIL
    buoyancy_rate: float = 0.025
    max_depth_rate: float = 0.5
    max_depth_rate_speed: float = 2.0
    depth_model: DepthModel = DepthModel.COMPAT


class Pose(NamedTuple):
    """Where a vessel is and how it moves; headings in [0, 360)."""

    x: float
    y: float
    heading: float
    speed: float
    depth: float
    pitch: float
    heading_over_ground: float
    speed_over_ground: float


class VesselModel:
    """One vessel, advanced by `step(dt)`.

    Actuators are the plain attributes `thrust`, `rudder`, `elevator` (-100..100; positive rudder turns to
    starboard, positive elevator dives), or `thrust_left` and `thrust_right` while `differential` is set. They
    are held until changed. Drift (`drift_x`, `drift_y`, m/s) and `rotate_speed` (deg/s) act from outside.
    `sail_limit` caps the speed that thrust can reach (0 = no sail), `sail_bonus` is added on top of it.
    """

    __slots__ = (
        "_full_rate",
        "_full_speed",
        "_mapped_speed",
        "_mapped_thrust",
        "_moved",
        "_parameters",
        "_rudder_asked",
        "_rudder_asked_at",
        "_vx",
        "_vy",
        "depth",
        "differential",
        "drift_x",
        "drift_y",
        "elevator",
        "heading",
        "pitch",
        "reverse",
        "rotate_speed",
        "rudder",
        "sail_bonus",
        "sail_limit",
        "speed",
        "thrust",
        "thrust_left",
        "thrust_right",
        "x",
        "y",
    )

    def __init__(
        self,
        parameters: VesselParameters | None = None,
        *,
        x: float = 0.0,
        y: float = 0.0,
        heading: float = 0.0,
        speed: float = 0.0,
        depth: float = 0.0,
    ) -> None:
        self.x = x
        self.y = y
        self.heading = _wrap360(heading)
        self.speed = speed
        self.depth = max(0.0, depth)
        self.pitch = 0.0
        self.thrust = self.rudder = self.elevator = 0.0
        self.thrust_left = self.thrust_right = 0.0
        self.drift_x = self.drift_y = self.rotate_speed = 0.0
        self.sail_limit = self.sail_bonus = 0.0
        self.differential = False
        self.reverse = False
        self._rudder_asked = 0.0
        self._rudder_asked_at: float | None = None
        self._vx = self._vy = 0.0
        self._moved = False
        self.parameters = parameters or VesselParameters()

    @property
    def parameters(self) -> VesselParameters:
        """The vessel's abilities; assign a new set to change them under way."""
        return self._parameters

    @parameters.setter
    def parameters(self, value: VesselParameters) -> None:
        self._parameters = value
        # The full rate may not fall below the null rate's place on the map: a flat map is still a map.
        self._full_speed = max(value.turn_full_speed, value.turn_null_speed)
        self._full_rate = value.turn_rate if value.turn_full_rate is None else value.turn_full_rate
        self._mapped_thrust = self._mapped_speed = 0.0

    def change(self, **parameters: Any) -> None:
        """Replace single parameters, by the names of `VesselParameters`."""
        self.parameters = replace(self._parameters, **parameters)

    def pose(self) -> Pose:
        """The present state, over-ground values from the last step."""
        vx, vy = self._vx, self._vy
        over_ground = _wrap360(math.atan2(vx, vy) * _DEGREES) if self._moved else 0.0
        return Pose(
            self.x,
            self.y,
            self.heading,
            self.speed,
            self.depth,
            self.pitch,
            over_ground,
            math.hypot(vx, vy),
        )

    def place(
        self,
        x: float | None = None,
        y: float | None = None,
        heading: float | None = None,
        speed: float | None = None,
        depth: float | None = None,
    ) -> None:
        """Put the vessel somewhere else; whatever is not named stays, the actuators too."""
        if x is not None:
            self.x = x
        if y is not None:
            self.y = y
        if heading is not None:
            self.heading = _wrap360(heading)
        if speed is not None:
            self.speed = speed
        if depth is not None:
            self.depth = max(0.0, depth)

    def ask_rudder(self, rudder: float, now: float) -> None:
        """Take a rudder request made at time `now` (s), subject to `max_rudder_rate`."""
        rate = self._parameters.max_rudder_rate
        asked_at = self._rudder_asked_at
        self._rudder_asked = rudder
        self._rudder_asked_at = now
        if rate <= 0.0 or (self._parameters.rudder_slew is RudderSlew.MAIL and asked_at is None):
            self.rudder = rudder
        elif self._parameters.rudder_slew is RudderSlew.MAIL and asked_at is not None:
            self.rudder = _toward(self.rudder, rudder, rate * max(0.0, now - asked_at))

    def step(self, dt: float) -> None:
        """Advance by `dt` seconds in one step of the reference's scheme; nothing happens for dt <= 0."""
        if dt <= 0.0:
            return
        p = self._parameters
        before = self.speed
        heading = self.heading
        if p.max_rudder_rate > 0.0 and p.rudder_slew is RudderSlew.STEADY:
            self.rudder = _toward(self.rudder, self._rudder_asked, p.max_rudder_rate * dt)

        # --- actuators
        differential = self.differential
        if differential:
            left, right = self.thrust_left, self.thrust_right
            thrust = (left + right) * 0.5
            rudder = (left - right) * 0.5
        else:
            thrust, rudder = self.thrust, self.rudder
        if self.reverse:
            thrust, rudder = -thrust, -rudder
        if rudder > 100.0:
            rudder = 100.0
        elif rudder < -100.0:
            rudder = -100.0

        # --- speed
        if thrust != self._mapped_thrust:
            self._mapped_thrust = thrust
            self._mapped_speed = p.thrust_map.speed(thrust)
        target = self._mapped_speed
        if self.sail_limit > 0.0:
            target = min(target, self.sail_limit)
        target = (target + self.sail_bonus) * (1.0 - p.turn_spd_loss * abs(rudder) * 0.01)
        after = target
        if target > before:
            limit = p.max_acceleration * dt
            if limit > 0.0 and target - before > limit:
                after = before + limit
        else:
            limit = p.max_deceleration * dt
            if limit > 0.0 and before - target > limit:
                after = before - limit
        # The reference stores the mean of old and new speed, so real acceleration is half the limit.
        mean_speed = (before + after) * 0.5

        # --- heading
        turn = self.rotate_speed
        if differential:
            turn += _FULL_DIFFERENTIAL_TURN * (self.thrust_left - self.thrust_right) / 200.0
        elif after != 0.0 and rudder:
            turn += rudder * self._turn_rate_at(after) * 0.01 * (thrust * 0.02)
        change = turn * dt
        new_heading = _wrap360(heading + change)

        # --- depth
        if self.depth or self.elevator or self.pitch or p.buoyancy_rate < 0.0:
            self._step_depth(after, dt)

        # --- position: along the circular mean of old and new heading
        bend = change if -180.0 < change <= 180.0 else (change + 180.0) % 360.0 - 180.0
        along = (heading + bend * 0.5) * _RADIANS
        vx = mean_speed * math.sin(along) + self.drift_x
        vy = mean_speed * math.cos(along) + self.drift_y
        if p.turn_radius > 0.0 and bend:
            vx, vy, new_heading = self._widen_turn(vx, vy, new_heading, (before + mean_speed) * 0.5, dt)
        x = self.x + vx * dt
        y = self.y + vy * dt
        self._moved = x != self.x or y != self.y
        self.x = x
        self.y = y
        self._vx = vx
        self._vy = vy
        self.heading = new_heading
        self.speed = mean_speed

    def _turn_rate_at(self, speed: float) -> float:
        """Effective turn rate, 0..100, at `speed`."""
        p = self._parameters
        if p.turn_law is TurnLaw.ANY_SPEED:
            rate = p.turn_rate
        elif p.turn_rate == 0.0:
            return 0.0  # the reference turns fastest here; we take the word at its meaning
        elif speed >= self._full_speed:
            rate = self._full_rate
        elif speed <= p.turn_null_speed:
            rate = p.turn_null_rate
        else:
            share = (speed - p.turn_null_speed) / (self._full_speed - p.turn_null_speed)
            rate = p.turn_null_rate + share * (self._full_rate - p.turn_null_rate)
        return min(100.0, max(0.0, rate))

    def _widen_turn(
        self, vx: float, vy: float, new_heading: float, speed: float, dt: float
    ) -> tuple[float, float, float]:
        """Hold the step to the smallest circle the vessel can sail at `speed` (marine_apps.md 1.5)."""
        p = self._parameters
        if speed <= 0.0 or p.max_speed <= 0.0:
            return vx, vy, new_heading
        radius = p.turn_radius * min(1.0, speed / p.max_speed)
        over_ground = math.hypot(vx, vy)
        half_chord = over_ground * dt / (2.0 * radius)
        if half_chord >= 1.0:
            return vx, vy, new_heading
        widest = math.asin(half_chord) * _DEGREES
        turned = (math.atan2(vx, vy) * _DEGREES - self.heading + 180.0) % 360.0 - 180.0
        if widest >= abs(turned):
            return vx, vy, new_heading
        side = math.copysign(widest, turned)
        along = (self.heading + side) * _RADIANS
        return (
            over_ground * math.sin(along),
            over_ground * math.cos(along),
            _wrap360(self.heading + 2.0 * side),
        )

    def _step_depth(self, speed: float, dt: float) -> None:
        p = self._parameters
        if speed <= 0.0:
            self.depth = max(0.0, self.depth - p.buoyancy_rate * dt)
            self.pitch = 0.0
            return
        share = 1.0
        if p.max_depth_rate_speed > 0.0:
            share = math.sqrt(min(1.0, speed / p.max_depth_rate_speed))
        elevator = min(100.0, max(-100.0, self.elevator))
        push = elevator * 0.01 * share * p.max_depth_rate
        if p.depth_model is DepthModel.COMPAT:
            sink = push - math.sin(self.pitch) * speed
            self.depth = max(0.0, self.depth + (sink - p.buoyancy_rate) * dt)
            self.pitch = -math.asin(sink / speed) if abs(sink) <= speed else 0.0
            return
        balance = -math.asin(min(1.0, max(-1.0, push / speed)))
        settled = balance + (self.pitch - balance) * math.exp(-dt / _PITCH_LAG_S)
        mean_pitch = (self.pitch + settled) * 0.5
        self.pitch = settled
        self.depth = max(0.0, self.depth - (math.sin(mean_pitch) * speed + p.buoyancy_rate) * dt)


def _wrap360(degrees: float) -> float:
    """The same angle in [0, 360); the remainder of a tiny negative number rounds to 360 itself."""
    wrapped = degrees % 360.0
    return wrapped if wrapped < 360.0 else 0.0


def _toward(value: float, goal: float, most: float) -> float:
    """`value` moved toward `goal` by at most `most`."""
    if goal > value:
        return min(goal, value + most)
    return max(goal, value - most)
