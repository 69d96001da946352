"""From desired heading, speed and depth to rudder, thrust and elevator: the controller of pMarinePIDV22.

`ScalarPid` is one loop; `PidEngine` is the four of them with the rules about staleness and manual
override around them. Neither reads a clock or mail: values and `now` are handed in. Source:
marine_apps.md 2.3 and 2.4. Headings in degrees, pitch in radians inside, maxpitch and elevator in degrees.
"""

from __future__ import annotations

import math
from collections import deque
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any

from mypy_extensions import mypyc_attr

_DEGREES = 180.0 / math.pi
_NEVER = -math.inf  # stamp of a quantity that has not been received
_DERIVATIVE_SAMPLES = 9
_LEAST_THRUST = 0.01  # below this the speed loop rests
_INSTABILITY_PERIOD = 10.0  # s for one ramp of the artificial rudder bias


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class PidGains:
    """Gains of one loop. `integral_limit` bounds the integral term after ki, in output units."""

    kp: float = 0.0
    kd: float = 0.0
    ki: float = 0.0
    integral_limit: float = 0.0


@mypyc_attr(native_class=False)
@dataclass(frozen=True, slots=True)
class PidParameters:
    """All that configures a controller: rudder and thrust in per cent, angles in degrees, times in s."""

    yaw: PidGains = field(default_factory=PidGains)
    speed: PidGains = field(default_factory=PidGains)
    z_to_pitch: PidGains = field(default_factory=PidGains)
    pitch: PidGains = field(default_factory=PidGains)
    max_rudder: float = 100.0
    max_thrust: float = 100.0
    max_pitch: float = 15.0
    max_elevator: float = 13.0
    speed_factor: float = 0.0
    depth_control: bool = True
    simulation: bool = False
    tardy_helm: float = 2.0
    tardy_nav: float = 2.0
    sim_instability: float = 0.0
    legacy: bool = False  # pMarinePID of old: reversing thrust loop, freshness by group
    thrust_cap: float = 100.0


LEAST_STEP = 1e-9
"""Seconds below which no time has passed: a slope over less is rounding, or overflows."""


# What a copy consists of: a compiled class has no slots to be copied by.
_LOOP_STATE = (
    "_differences",
    "_error",
    "_integral",
    "_kd",
    "_ki",
    "_kp",
    "_limit",
    "_output",
    "_time",
    "output_limit",
)


class ScalarPid:
    """One proportional-integral-derivative loop with a clamped output.

    The derivative is the mean of the last nine difference quotients. State is never reset: not by a new
    set-point, not by a pause.
    """

    __slots__ = _LOOP_STATE

    def __init__(self, gains: PidGains, output_limit: float) -> None:
        self._kp = gains.kp
        self._kd = gains.kd
        self._ki = gains.ki
        self._limit = abs(gains.integral_limit)
        self.output_limit = abs(output_limit)
        self._integral = 0.0
        self._output = 0.0
        self._error = 0.0
        self._time: float | None = None
        self._differences: deque[float] = deque(maxlen=_DERIVATIVE_SAMPLES)

    def __deepcopy__(self, memo: dict[int, Any]) -> ScalarPid:
        twin = ScalarPid(PidGains(), 0.0)
        for name in _LOOP_STATE:
            setattr(twin, name, deepcopy(getattr(self, name), memo))
        return twin

    def step(self, error: float, now: float) -> float | None:
        """The output for `error` at time `now` (s), within +-output_limit.

        Returns the previous output if no time (less than LEAST_STEP) has passed, None if time ran backwards
        (the caller keeps what it had).
        """
        dt = 0.0
        slope = 0.0
        if self._time is not None:
            dt = now - self._time
            if dt < 0.0:
                return None
            if dt < LEAST_STEP:
                return self._output
            differences = self._differences
            differences.append((error - self._error) / dt)
            slope = sum(differences) / len(differences)
        self._time = now
        self._error = error
        if self._ki > 0.0:
            integral = self._integral + self._ki * error * dt
            limit = self._limit
            self._integral = limit if integral > limit else -limit if integral < -limit else integral
        else:
            self._integral = 0.0
        output = self._kp * error + self._kd * slope + self._integral
        limit = self.output_limit
        self._output = limit if output > limit else -limit if output < -limit else output
        return self._output


_ENGINE_STATE = (
    "_depth_loop",
    "_instability_start",
    "_max_pitch",
    "_parameters",
    "_pitch_loop",
    "_speed_loop",
    "_thrust_before",
    "_time",
    "_yaw_loop",
    "desired_depth",
    "desired_depth_at",
    "desired_heading",
    "desired_heading_at",
    "desired_speed",
    "desired_speed_at",
    "elevator",
    "nav_depth",
    "nav_depth_at",
    "nav_heading",
    "nav_heading_at",
    "nav_pitch",
    "nav_pitch_at",
    "nav_speed",
    "nav_speed_at",
    "override",
    "rudder",
    "speed_factor",
    "stale",
    "stale_reports",
    "thrust",
    "thrust_cap",
)


class PidEngine:
    """Steers a vessel toward desired heading, speed and depth.

    Feed it with the `hear_*` methods, call `step(now)` once per iteration, then read `rudder`, `thrust`,
    `elevator`, `has_control` and `stale_reports`. A value counts as received at the time of the step before
    it, as in the reference, so a value heard before the first step does not count.
    """

    __slots__ = _ENGINE_STATE

    def __init__(self, parameters: PidParameters) -> None:
        self._parameters = parameters
        self._yaw_loop = ScalarPid(parameters.yaw, parameters.max_rudder)
        self._speed_loop = ScalarPid(parameters.speed, parameters.max_thrust)
        self._max_pitch = math.radians(parameters.max_pitch)
        self._depth_loop = ScalarPid(parameters.z_to_pitch, self._max_pitch)
        # The reference limits radians by a number of degrees here, so only the clip below ever binds.
        self._pitch_loop = ScalarPid(parameters.pitch, parameters.max_elevator)
        self.speed_factor = parameters.speed_factor
        self.thrust_cap = parameters.thrust_cap
        self.override = True
        self.stale = True
        self.stale_reports: list[tuple[str, float]] = []
        self.rudder = self.thrust = self.elevator = 0.0
        self._thrust_before = 0.0
        self._time = _NEVER
        self._instability_start: float | None = None
        self.desired_heading = self.desired_speed = self.desired_depth = 0.0
        self.nav_heading = self.nav_speed = self.nav_depth = self.nav_pitch = 0.0
        self._forget()

    def __deepcopy__(self, memo: dict[int, Any]) -> PidEngine:
        twin = PidEngine(self._parameters)
        for name in _ENGINE_STATE:
            setattr(twin, name, deepcopy(getattr(self, name), memo))
        return twin

    @property
    def parameters(self) -> PidParameters:
        """The configuration that this controller was built with."""
        return self._parameters

    @property
    def has_control(self) -> bool:
        """True while neither overridden nor stale: only then may the outputs drive the vessel."""
        return not (self.override or self.stale)

    def hear_desired_heading(self, degrees: float) -> None:
        """Take a new course to steer, any turn of the circle."""
        self.desired_heading = degrees
        self.desired_heading_at = self._time

    def hear_desired_speed(self, speed: float) -> None:
        """Take a new speed to make, m/s."""
        self.desired_speed = speed
        self.desired_speed_at = self._time

    def hear_desired_depth(self, depth: float) -> None:
        """Take a new depth to hold, m."""
        self.desired_depth = depth
        self.desired_depth_at = self._time

    def hear_heading(self, degrees: float) -> None:
        """Take the present heading."""
        self.nav_heading = degrees
        self.nav_heading_at = self._time

    def hear_speed(self, speed: float) -> None:
        """Take the present speed, m/s."""
        self.nav_speed = speed
        self.nav_speed_at = self._time

    def hear_depth(self, depth: float) -> None:
        """Take the present depth, m."""
        self.nav_depth = depth
        self.nav_depth_at = self._time

    def hear_pitch(self, radians: float) -> None:
        """Take the present pitch, radians, nose up positive."""
        self.nav_pitch = radians
        self.nav_pitch_at = self._time

    def set_override(self, override: bool) -> bool:
        """Take or give back manual control; True if that changed anything.

        When control comes back every quantity must arrive anew before the vessel is driven again."""
        if override == self.override:
            return False
        self.override = override
        if not override:
            self._forget()
        return True

    def step(self, now: float) -> None:
        """Compute the outputs for time `now` (s) and note which quantities are stale.

        Outputs are zero while anything was never received or is stale. Rudder and elevator are zero
        whenever thrust is.
        """
        p = self._parameters
        self._time = now
        self.rudder = self.thrust = self.elevator = 0.0
        if self.stale_reports:
            self.stale_reports = []
        if _NEVER in (self.desired_heading_at, self.desired_speed_at, self.nav_heading_at, self.nav_speed_at):
            return
        if p.depth_control and _NEVER in (self.desired_depth_at, self.nav_depth_at, self.nav_pitch_at):
            return
        if not p.simulation:
            self._check_age(now)
            if self.stale:
                return
        self.stale = False
        self.thrust = self._step_thrust(now)
        if self.thrust == 0.0 or (self.thrust < 0.0 and not p.legacy):
            return
        self.rudder = self._step_rudder(now)
        if p.depth_control:
            self.elevator = self._step_elevator(now)

    def _forget(self) -> None:
        self.desired_heading_at = self.desired_speed_at = self.desired_depth_at = _NEVER
        self.nav_heading_at = self.nav_speed_at = self.nav_depth_at = self.nav_pitch_at = _NEVER

    def _check_age(self, now: float) -> None:
        p = self._parameters
        helm, nav = now - p.tardy_helm, now - p.tardy_nav
        if p.legacy:
            latest = max(self.nav_heading_at, self.nav_speed_at, self.nav_depth_at, self.nav_pitch_at)
            self.nav_heading_at = self.nav_speed_at = self.nav_depth_at = self.nav_pitch_at = latest
            latest = max(self.desired_heading_at, self.desired_speed_at)
            self.desired_heading_at = self.desired_speed_at = self.desired_depth_at = latest
        fresh = (
            self.desired_heading_at >= helm
            and self.desired_speed_at >= helm
            and self.nav_heading_at >= nav
            and self.nav_speed_at >= nav
        )
        if fresh and p.depth_control:
            fresh = self.desired_depth_at >= helm and self.nav_depth_at >= nav and self.nav_pitch_at >= nav
        self.stale = not fresh
        if fresh:
            return
        checks = [
            ("DesHdg", self.desired_heading_at, p.tardy_helm),
            ("DesSpd", self.desired_speed_at, p.tardy_helm),
            ("NavHdg", self.nav_heading_at, p.tardy_nav),
            ("NavSpd", self.nav_speed_at, p.tardy_nav),
        ]
        if p.depth_control:
            checks += [
                ("DesDepth", self.desired_depth_at, p.tardy_helm),
                ("NavDep", self.nav_depth_at, p.tardy_nav),
                ("NavPitch", self.nav_pitch_at, p.tardy_nav),
            ]
        self.stale_reports = [(name, now - at) for name, at, limit in checks if now - at > limit]

    def _step_thrust(self, now: float) -> float:
        p = self._parameters
        if self.speed_factor != 0.0:
            thrust = self.desired_speed * self.speed_factor
        else:
            change = self._speed_loop.step(self.desired_speed - self.nav_speed, now)
            thrust = self._thrust_before + (change or 0.0)
        if p.legacy:
            if abs(self.desired_speed) <= 0.001:
                thrust = 0.0
            thrust = max(thrust, -p.max_thrust)
        elif thrust < _LEAST_THRUST:
            thrust = 0.0
        thrust = min(thrust, p.max_thrust, self.thrust_cap)
        self._thrust_before = thrust
        return thrust

    def _step_rudder(self, now: float) -> float:
        p = self._parameters
        error = _wrap180(self.nav_heading - _wrap180(self.desired_heading))
        output = self._yaw_loop.step(error, now)
        rudder = 0.0 if output is None else -output
        if p.sim_instability:
            if self._instability_start is None:
                self._instability_start = now
            ramps, part = divmod((now - self._instability_start) / _INSTABILITY_PERIOD, 1.0)
            rudder += p.sim_instability * part * (-1.0 if ramps % 2.0 else 1.0)
        return min(p.max_rudder, max(-p.max_rudder, rudder))

    def _step_elevator(self, now: float) -> float:
        p = self._parameters
        pitch = self._depth_loop.step(self.nav_depth - self.desired_depth, now)
        desired_pitch = min(self._max_pitch, max(-self._max_pitch, pitch or 0.0))
        output = self._pitch_loop.step(self.nav_pitch - desired_pitch, now)
        elevator = (output or 0.0) * _DEGREES
        return min(p.max_elevator, max(-p.max_elevator, elevator))


def _wrap180(degrees: float) -> float:
    """The same angle in (-180, 180]."""
    if -180.0 < degrees <= 180.0:
        return degrees
    return 180.0 - (180.0 - degrees) % 360.0
