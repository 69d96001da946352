"""uSimMarineV22, uSimMarineV23 and uSimMarine: a vessel that sails in the computer (marine_apps.md 1).

Actuator mail in, navigation out; between them the vessel model, and on request a PID controller on board.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import ClassVar

from mypy_extensions import mypyc_attr

from pymoos_lite.app.datum import mission_geodesy
from pymoos_lite.app.mail_values import Handler, HandlerApp, finite_number, on_number, on_text, on_truth
from pymoos_lite.core.message import Message
from pymoos_lite.geometry.angles import angle360
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.marine.buoyancy import BuoyancyJobs
from pymoos_lite.marine.drift import Drift
from pymoos_lite.marine.navigation_output import NavigationOutput
from pymoos_lite.marine.pid import PidEngine
from pymoos_lite.marine.pid_config import pid_parameters, wants_pid, warn_of_missing_gains
from pymoos_lite.marine.pid_inputs import PidInputs
from pymoos_lite.marine.sailing import Wind, parse_wind, sail_speed
from pymoos_lite.marine.simulator_config import (
    LEGACY_DECLARATION,
    V22_DECLARATION,
    V23_DECLARATION,
    configured_thrust_map,
    read_differential,
    read_pose,
    read_reverse,
    start_pose,
    vessel_parameters,
)
from pymoos_lite.marine.vessel_model import TurnLaw, VesselModel
from pymoos_lite.marine.wormholes import Tunnel, merge_wormholes
from pymoos_lite.records.csp import num
from pymoos_lite.records.view import Arrow

_MAX_SKEW = 1360.0  # s; the controller on board disbelieves desired values stamped farther from now
_WIND_SHOWN_EVERY = 50  # iterations


@mypyc_attr(allow_interpreted_subclasses=True)
class Simulator(HandlerApp):
    """uSimMarineV22: one vessel, its navigation published at every second iteration."""

    PARAMETERS = V22_DECLARATION
    DEFAULT_TICK = 4.0
    TURN_LAW: ClassVar[TurnLaw] = TurnLaw.SPEED_MAP
    PUBLISH_EVERY: ClassVar[int] = 2
    KEEPS_FAULTY_MAP: ClassVar[bool] = True
    CAPS_SPEED: ClassVar[bool] = True

    def on_start_up(self) -> None:
        values, lines = self.config, self.context.lines
        thrust_map = configured_thrust_map(values, lines, self.KEEPS_FAULTY_MAP)
        parameters = vessel_parameters(values, self.TURN_LAW, thrust_map)
        start = start_pose(values, lines)
        self.vessel = VesselModel(parameters, **start)
        # With dual_state the vessel believes it does not drift; the ground truth knows better.
        self.truth = VesselModel(parameters, **start) if values.dual_state else self.vessel
        self._vessels = [self.vessel] if self.truth is self.vessel else [self.vessel, self.truth]
        for vessel in self._vessels:
            vessel.differential = values.thrust_mode_diff
            vessel.reverse = values.thrust_mode_reverse
            vessel.rotate_speed = values.rotate_speed
        self._set_drift(values.drift_vector or Drift(values.drift_x, values.drift_y))
        self._water_depth: float = values.default_water_depth
        self._state_time = self.now
        self._paused: bool = values.sim_pause
        self._enabled = True
        self._obstacle_hit = False
        self._drift_news = True
        self._resets = 1 if "start_pos" in self.given else 0
        self._jobs = BuoyancyJobs(values.trim_tolerance, values.max_trim_delay)
        self._start_controller()
        self._wind: Wind | None = vars(values).get("wind_conditions")
        self._polar = vars(values).get("polar_plot")
        self._depth_control: bool = vars(values).get("depth_control", True)
        self._fan = 0.0
        self._wormholes = merge_wormholes(vars(values).get("wormhole", []))
        self._tunnel = Tunnel(self._wormholes) if self._wormholes else None
        self._outputs = self._navigation_outputs()
        self._handlers = self._mail_handlers()

    def iterate(self) -> None:
        now = self.now
        dt = now - self._state_time
        self._state_time = now
        if not self._enabled:
            return
        if not (self._obstacle_hit or self._paused):
            if self.engine is not None:
                self._steer(self.engine)
            if self._polar is not None and self._wind is not None:
                self._set_sail()
            for vessel in self._vessels:
                vessel.step(dt)
            if self._tunnel is not None:
                self._pass_wormholes(self._tunnel)
        if self.iteration % self.PUBLISH_EVERY == 0:
            self._publish()
        if self.iteration == 1 and self._depth_control:
            self.notify("SIMULATION_MODE", "TRUE")
        if self._wind is not None and self._polar is not None and self.iteration % _WIND_SHOWN_EVERY == 1:
            self._show_wind(self._wind)
        if self._drift_news:
            self._drift_news = False
            self.notify("USM_DRIFT_SUMMARY", self.drift.summary())
        if self._jobs.busy:
            for variable, text in self._jobs.step(self.vessel.pitch, now):
                self.notify(variable, text)

    def report(self) -> Iterable[str]:
        pose = self.vessel.pose()
        vessel = self.vessel
        yield (
            f"Position:  x={num(pose.x)}, y={num(pose.y)}"
            f"   heading {num(pose.heading, 1)}   speed {num(pose.speed)}"
        )
        if pose.depth or self._depth_control:
            yield f"Depth:     {num(pose.depth)} m   pitch {num(math.degrees(pose.pitch), 1)} deg"
        yield (
            f"Ground:    course {num(pose.heading_over_ground, 1)}   speed {num(pose.speed_over_ground)}"
            f"   drift {self.drift.summary()}"
        )
        if vessel.differential:
            yield f"Thrust:    left {num(vessel.thrust_left, 1)}   right {num(vessel.thrust_right, 1)}"
        else:
            yield (
                f"Actuators: thrust {num(vessel.thrust, 1)}   rudder {num(vessel.rudder, 1)}"
                f"   elevator {num(vessel.elevator, 1)}"
            )
        if self.truth is not vessel:
            yield f"Truth:     x={num(self.truth.x)}, y={num(self.truth.y)}"
        if self.engine is not None:
            yield f"PID:       on board, {'in control' if self.engine.has_control else 'no control'}"
        if self._wind is not None:
            yield f"Wind:      {num(self._wind.speed)} m/s from {num(self._wind.direction, 1)}"
        states = [
            word
            for word, on in (
                ("paused", self._paused),
                ("disabled", not self._enabled),
                ("obstacle hit", self._obstacle_hit),
                ("reverse", vessel.reverse),
            )
            if on
        ]
        yield f"State:     {', '.join(states) or 'under way'}   resets {self._resets}"

    # --- start-up ----------------------------------------------------------------------------

    def _start_controller(self) -> None:
        self.engine: PidEngine | None = None
        if not wants_pid(self.given):
            return
        values = self.config
        self.engine = PidEngine(pid_parameters(values))
        self._inputs = PidInputs(self, self.engine, _MAX_SKEW, self._report_skew)
        warn_of_missing_gains(values, self.given, self.config_warning)

    def _navigation_outputs(self) -> list[tuple[VesselModel, NavigationOutput]]:
        def output(name: str) -> NavigationOutput:
            summary = bool(vars(self.config).get("post_navpos_summary"))
            most = self.config.max_speed if self.CAPS_SPEED else math.inf
            return NavigationOutput(self, name, geodesy, most, self._depth_control, summary)

        geodesy = mission_geodesy(self)
        prefix = self.config.prefix.removesuffix("_")
        outputs = [(self.vessel, output(prefix))]
        if self.truth is not self.vessel:
            outputs.append((self.truth, output(f"{prefix}_GT")))
        return outputs

    def _mail_handlers(self) -> dict[str, Handler]:
        handlers: dict[str, Handler] = {}

        def number(use: Callable[[float], None], *names: str) -> None:
            for name in names:
                handlers[name] = on_number(self, use)

        def text(name: str, use: Callable[[str], None]) -> None:
            handlers[name] = on_text(self, use)

        if self.engine is not None:
            handlers |= self._inputs.desired_handlers()
        else:
            number(self._set_thrust, "DESIRED_THRUST")
            number(self._set_rudder, "DESIRED_RUDDER")
            number(self._set_elevator, "DESIRED_ELEVATOR")
        number(self._set_left, "DESIRED_THRUST_L")
        number(self._set_right, "DESIRED_THRUST_R")
        number(lambda v: self._set_drift(Drift(v, self.drift.y)), "DRIFT_X", "CURRENT_X")
        number(lambda v: self._set_drift(Drift(self.drift.x, v)), "DRIFT_Y", "CURRENT_Y")
        number(lambda v: self._set_drift(self.drift * v), "DRIFT_VECTOR_MULT")
        text("DRIFT_VECTOR", lambda told: self._set_drift(Drift.parse(told)))
        text("DRIFT_VECTOR_ADD", lambda told: self._set_drift(self.drift + Drift.parse(told)))
        number(self._set_rotation, "ROTATE_SPEED")
        number(lambda v: self._change(turn_rate=min(100.0, max(0.0, v))), "USM_TURN_RATE")
        number(lambda v: self._change(buoyancy_rate=v), "BUOYANCY_RATE")
        number(self._set_water_depth, "WATER_DEPTH")
        text("USM_RESET", self._reset)
        handlers["USM_SIM_PAUSED"] = on_truth(self, self._pause)
        handlers["USM_ENABLED"] = on_truth(self, self._enable)
        handlers["OBSTACLE_HIT"] = on_truth(self, self._hit)
        text("THRUST_MODE_DIFFERENTIAL", lambda told: self._set_mode("differential", read_differential(told)))
        text("THRUST_MODE_REVERSE", lambda told: self._set_mode("reverse", read_reverse(told)))
        if self.CAPS_SPEED:  # what V22 has and the others have not
            number(lambda v: self._change(turn_radius=max(0.0, v)), "USM_TURN_RADIUS")
            handlers["USM_RESET_NAV"] = lambda message: self._trust_truth()
        if "wind_conditions" in vars(self.config):
            text("WIND_CONDITIONS", self._set_wind)
        if self._depth_control:
            handlers["BUOYANCY_CONTROL"] = on_truth(self, self._control_buoyancy)
            handlers["TRIM_CONTROL"] = on_truth(self, self._control_trim)
        return handlers

    # --- moving ------------------------------------------------------------------------------

    def _steer(self, engine: PidEngine) -> None:
        vessel = self.vessel
        engine.hear_heading(vessel.heading)
        engine.hear_speed(vessel.speed)
        engine.hear_depth(vessel.depth)
        engine.hear_pitch(vessel.pitch)
        engine.step(self.now)
        if engine.stale_reports:
            self._inputs.report_stale()
        # Unlike the reference we heed the override: without control the vessel is not driven.
        driven = engine.has_control
        thrust = engine.thrust if driven else 0.0
        rudder = engine.rudder if driven else 0.0
        for each in self._vessels:
            each.thrust = thrust
            each.elevator = engine.elevator if driven else 0.0
            each.ask_rudder(rudder, self.now)
        if self.config.post_des_thrust:
            self.notify(self.config.post_des_thrust, thrust)
        if self.config.post_des_rudder:
            self.notify(self.config.post_des_rudder, rudder)

    def _report_skew(self, skew: float) -> None:
        self.notify("USM_NOGO", skew)

    def _set_sail(self) -> None:
        assert self._polar is not None
        assert self._wind is not None
        for vessel in self._vessels:
            vessel.sail_limit = sail_speed(self._polar, self._wind, vessel.heading)
            vessel.sail_bonus = self._fan_speed()

    def _show_wind(self, wind: Wind) -> None:
        looks = Attributes(label="wind", fill_color="white")
        toward = angle360(wind.direction + 180.0)
        self.notify("VIEW_ARROW", Arrow(self.truth.x, self.truth.y, toward, attributes=looks).to_text())

    def _pass_wormholes(self, tunnel: Tunnel) -> None:
        passage = tunnel.step(self.truth.x, self.truth.y, self.now)
        if passage is not None:
            opacity, target = passage
            self.notify(f"{self._outputs[0][1].prefix}_TRANSP", opacity)
            if target is not None:
                self.event(f"through a wormhole to x={num(target[0])}, y={num(target[1])}")
                for vessel in self._vessels:
                    vessel.place(*target)
        if self.iteration % 10 == 1:
            for hole in self._wormholes:
                for text in hole.views():
                    self.notify("VIEW_POLYGON", text)

    def _fan_speed(self) -> float:
        return 0.0

    def _publish(self) -> None:
        for vessel, output in self._outputs:
            output.publish(vessel.pose(), vessel.reverse, self._obstacle_hit, self._water_depth)
        if self._depth_control:
            self.notify_numbers((("TRUE_X", self.truth.x), ("TRUE_Y", self.truth.y)))

    # --- mail --------------------------------------------------------------------------------

    def _set_thrust(self, thrust: float) -> None:
        if not self.vessel.differential:
            for vessel in self._vessels:
                vessel.thrust = thrust

    def _set_rudder(self, rudder: float) -> None:
        if not self.vessel.differential:
            for vessel in self._vessels:
                vessel.ask_rudder(rudder, self.now)

    def _set_elevator(self, elevator: float) -> None:
        for vessel in self._vessels:
            vessel.elevator = elevator

    def _set_left(self, thrust: float) -> None:
        if self.vessel.differential:
            for vessel in self._vessels:
                vessel.thrust_left = min(100.0, max(-100.0, thrust))

    def _set_right(self, thrust: float) -> None:
        if self.vessel.differential:
            for vessel in self._vessels:
                vessel.thrust_right = min(100.0, max(-100.0, thrust))

    def _set_drift(self, drift: Drift) -> None:
        self.drift = drift
        self.truth.drift_x, self.truth.drift_y = drift.x, drift.y
        self._drift_news = True

    def _set_rotation(self, rate: float) -> None:
        for vessel in self._vessels:
            vessel.rotate_speed = rate

    def _change(self, **parameters: float) -> None:
        for vessel in self._vessels:
            vessel.change(**parameters)

    def _set_water_depth(self, depth: float) -> None:
        if depth < 0.0:
            self.run_warning("WATER_DEPTH must not be negative")
        else:
            self._water_depth = depth

    def _reset(self, told: str) -> None:
        change = read_pose(told)
        for vessel in self._vessels:
            vessel.place(**change.parts)
        self._resets += 1
        self.notify("USM_RESET_COUNT", float(self._resets))
        self.event(f"reset to {told[:60]}")
        if change.problem is not None:
            raise ValueError(change.problem)

    def _trust_truth(self) -> None:
        if self.truth is not self.vessel:
            pose = self.truth.pose()
            self.vessel.place(pose.x, pose.y, pose.heading, pose.speed, pose.depth)
            self.vessel.pitch = pose.pitch

    def _pause(self, paused: bool) -> None:
        if paused != self._paused:
            self._paused = paused
            self.event("paused" if paused else "resumed")

    def _hit(self, hit: bool) -> None:
        if hit != self._obstacle_hit:
            self._obstacle_hit = hit
            self.event("obstacle hit: frozen" if hit else "free of the obstacle")

    def _enable(self, enabled: bool) -> None:
        if enabled == self._enabled:
            return
        self._enabled = enabled
        self.event("enabled" if enabled else "disabled: the vessel follows outside navigation")
        prefix = self._outputs[0][1].prefix
        for coordinate in ("X", "Y", "HEADING"):
            name = f"{prefix}_{coordinate}"
            if enabled:
                self.unregister(name)
            else:
                self._handlers[name] = self._follow
                self.register(name)

    def _follow(self, message: Message) -> None:
        """Navigation from elsewhere while this simulator is disabled."""
        value = finite_number(message)
        if self._enabled or value is None or message.source == self.name:
            return
        coordinate = message.name.rpartition("_")[2].lower()
        for vessel in self._vessels:
            vessel.place(**{coordinate: value})
            vessel.ask_rudder(0.0, self.now)
            vessel.rudder = 0.0

    def _set_mode(self, mode: str, on: bool) -> None:
        for vessel in self._vessels:
            setattr(vessel, mode, on)

    def _set_wind(self, told: str) -> None:
        self._wind = parse_wind(told)

    def _control_buoyancy(self, wanted: bool) -> None:
        if wanted:
            self._change(buoyancy_rate=0.0)
            self.notify(*self._jobs.start_buoyancy(self.now))

    def _control_trim(self, wanted: bool) -> None:
        if wanted:
            self.notify(*self._jobs.start_trim(self.now))


@mypyc_attr(allow_interpreted_subclasses=True)
class SimulatorV23(Simulator):
    """uSimMarineV23: as V22 without turn radius, with a fan that helps under sail."""

    PARAMETERS = V23_DECLARATION
    KEEPS_FAULTY_MAP = False
    CAPS_SPEED = False

    def _mail_handlers(self) -> dict[str, Handler]:
        return super()._mail_handlers() | {"DESIRED_FAN": on_number(self, self._set_fan)}

    def _set_fan(self, fan: float) -> None:
        self._fan = min(100.0, max(-100.0, fan))

    def _fan_speed(self) -> float:
        fan_map = self.config.thrust_map_fan
        return fan_map.speed(self._fan) if fan_map is not None and fan_map.positive else 0.0


@mypyc_attr(allow_interpreted_subclasses=True)
class LegacySimulator(Simulator):
    """uSimMarine of older missions: full turn rate at any speed, navigation at every iteration, no PID."""

    PARAMETERS = LEGACY_DECLARATION
    TURN_LAW = TurnLaw.ANY_SPEED
    PUBLISH_EVERY = 1
    CAPS_SPEED = False

    def on_start_up(self) -> None:
        super().on_start_up()
        values = self.config
        if values.force_vector is not None:
            self._set_drift(values.force_vector)
        elif values.force_x is not None or values.force_y is not None:
            self._set_drift(Drift(values.force_x or 0.0, values.force_y or 0.0))
        if values.force_theta is not None:
            self._set_rotation(values.force_theta)
        if not values.deprecated_ok:
            self.run_warning("uSimMarine is deprecated: uSimMarineV22 is its successor")
