"""pMarinePIDV22 and pMarinePID: the PID controller as an app of its own (marine_apps.md 2)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

from mypy_extensions import mypyc_attr

from pymoos_lite.app.mail_values import Handler, HandlerApp, on_number
from pymoos_lite.marine.pid import PidEngine
from pymoos_lite.marine.pid_config import PID_DECLARATION, pid_parameters, warn_of_missing_gains
from pymoos_lite.marine.pid_inputs import PidInputs
from pymoos_lite.records.csp import num

_MAX_SKEW = 360.0  # s; older or newer stamps come from another clock


@mypyc_attr(allow_interpreted_subclasses=True)
class PidController(HandlerApp):
    """Drives rudder, thrust and elevator from DESIRED_* and NAV_*.

    Publishes each iteration while it has control. When control is lost it posts zeros once, then stays
    silent until control returns.
    """

    PARAMETERS = PID_DECLARATION
    DEFAULT_TICK = 20.0
    LEGACY: ClassVar[bool] = False

    def on_start_up(self) -> None:
        values = self.config
        self.engine = PidEngine(pid_parameters(values, self.LEGACY))
        self._inputs = PidInputs(self, self.engine, _MAX_SKEW)
        handlers = self._inputs.desired_handlers() | self._inputs.nav_handlers(values.ignore_nav_yaw)
        handlers["PID_VERBOSE"] = lambda message: None  # our report shows all of it anyway
        if values.enable_thrust_cap:
            handlers["PID_THRUST_CAP"] = on_number(self, self._cap_thrust)
        self._handlers: dict[str, Handler] = handlers
        suffix = values.output_suffix.upper()
        self._rudder_name = f"DESIRED_RUDDER{suffix}"
        self._thrust_name = f"DESIRED_THRUST{suffix}"
        self._elevator_name = f"DESIRED_ELEVATOR{suffix}"
        self._stopped = False
        self._debug = values.heading_debug or values.speed_debug or values.depth_debug
        warn_of_missing_gains(values, self.given, self.config_warning)

    def iterate(self) -> None:
        engine = self.engine
        engine.step(self.now)
        if engine.stale_reports:
            self._inputs.report_stale()
        if engine.has_control:
            self._stopped = False
            self._post(engine.rudder, engine.thrust, engine.elevator)
            if self._debug:
                self._post_debug()
        elif self.LEGACY and engine.stale and not engine.override:
            self.notify(self._thrust_name, 0.0)  # the old app repeats this as long as it is tardy
            self._stopped = False
        elif not self._stopped:
            self._stopped = True
            self._post(0.0, 0.0, 0.0)

    def report(self) -> Iterable[str]:
        engine = self.engine
        if engine.has_control:
            state = "in control"
        else:
            state = "no control: " + ("manual override" if engine.override else "stale or missing inputs")
        yield f"State:    {state}"
        yield ""
        rows = [
            ("Heading", engine.desired_heading, engine.nav_heading, "rudder", engine.rudder),
            ("Speed", engine.desired_speed, engine.nav_speed, "thrust", engine.thrust),
        ]
        if engine.parameters.depth_control:
            rows.append(("Depth", engine.desired_depth, engine.nav_depth, "elevator", engine.elevator))
        yield "           desired    present   output"
        for quantity, desired, present, actuator, output in rows:
            yield f"{quantity:<8}{desired:10.2f} {present:10.2f}   {actuator} {output:.1f}"
        if engine.stale_reports:
            yield "Stale:    " + ", ".join(f"{name} {age:.1f} s" for name, age in engine.stale_reports)

    def _post(self, rudder: float, thrust: float, elevator: float) -> None:
        posts = ((self._rudder_name, rudder), (self._thrust_name, thrust), (self._elevator_name, elevator))
        self.notify_numbers(posts if self.engine.parameters.depth_control else posts[:2])

    def _post_debug(self) -> None:
        engine, values = self.engine, self.config
        rows = (
            (
                values.heading_debug,
                "HDG",
                engine.desired_heading,
                engine.nav_heading,
                engine.rudder,
                values.maxrudder,
            ),
            (
                values.speed_debug,
                "SPD",
                engine.desired_speed,
                engine.nav_speed,
                engine.thrust,
                values.maxthrust,
            ),
            (
                values.depth_debug,
                "DEP",
                engine.desired_depth,
                engine.nav_depth,
                engine.elevator,
                values.maxelevator,
            ),
        )
        for wanted, name, desired, present, output, most in rows:
            if wanted:
                text = (
                    f"want={num(desired)},curr={num(present)},diff={num(desired - present)},out={num(output)}"
                )
                self.notify(f"PID_{name}_DEBUG", text)
                if abs(output) >= most > 0.0:
                    self.notify(f"PID_MAX_SAT_{name}_DEBUG", text)

    def _cap_thrust(self, cap: float) -> None:
        self.engine.thrust_cap = min(100.0, max(20.0, cap))


@mypyc_attr(allow_interpreted_subclasses=True)
class LegacyPidController(PidController):
    """pMarinePID of older missions: the same engine, thrust may reverse, tardiness is judged by groups."""

    LEGACY = True
