"""From mail to the PID engine, and from the engine to what it has to say about control.

The same for the stand-alone app and for the controller on board the simulator: marine_apps.md 2.2 and 2.4.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from pymoos_lite.app import App
from pymoos_lite.app.mail_values import Handler, number_or_warning, on_number, on_truth
from pymoos_lite.core.message import Message
from pymoos_lite.geometry.angles import angle360
from pymoos_lite.marine.pid import PidEngine
from pymoos_lite.records.csp import num

OVERRIDE_NAMES = ("MOOS_MANUAL_OVERRIDE", "MOOS_MANUAL_OVERIDE")
DESIRED_NAMES = ("DESIRED_HEADING", "DESIRED_SPEED")
DEPTH_NAMES = ("NAV_DEPTH", "NAV_PITCH", "DESIRED_DEPTH")


class PidInputs:
    """Handlers that feed one engine from an app's mail.

    Mail whose stamp is `max_skew` seconds or more away from now is not believed; `on_skew` hears by how
    many seconds.
    """

    def __init__(
        self,
        app: App,
        engine: PidEngine,
        max_skew: float,
        on_skew: Callable[[float], None] | None = None,
    ) -> None:
        self._app = app
        self._engine = engine
        self._max_skew = max_skew
        self._on_skew = on_skew

    def desired_handlers(self) -> dict[str, Handler]:
        """What the helm and the person in charge say."""
        engine = self._engine
        handlers = {
            "DESIRED_HEADING": self._believed(engine.hear_desired_heading),
            "DESIRED_SPEED": self._believed(engine.hear_desired_speed),
            "SPEED_FACTOR": on_number(self._app, self._set_speed_factor),
        }
        if engine.parameters.depth_control:
            handlers["DESIRED_DEPTH"] = self._believed(engine.hear_desired_depth)
        for name in OVERRIDE_NAMES:
            handlers[name] = on_truth(self._app, self._set_override)
        return handlers

    def nav_handlers(self, ignore_yaw: bool) -> dict[str, Handler]:
        """What the sensors say."""
        engine = self._engine
        handlers = {
            "NAV_HEADING": self._believed(lambda degrees: engine.hear_heading(angle360(degrees))),
            "NAV_SPEED": self._believed(engine.hear_speed),
        }
        if not ignore_yaw:
            handlers["NAV_YAW"] = self._believed(
                lambda rad: engine.hear_heading(angle360(-math.degrees(rad)))
            )
        if engine.parameters.depth_control:
            handlers["NAV_DEPTH"] = self._believed(engine.hear_depth)
            handlers["NAV_PITCH"] = self._believed(engine.hear_pitch)
        return handlers

    def report_stale(self) -> None:
        """Post one PID_STALE per quantity that the last step found stale."""
        for name, age in self._engine.stale_reports:
            self._app.notify("PID_STALE", f"Stale {name}:{num(age, 3)}")

    def _believed(self, use: Callable[[float], None]) -> Handler:
        app = self._app
        max_skew = self._max_skew

        def handle(message: Message) -> None:
            number = number_or_warning(app, message)
            if number is None:
                return
            skew = app.now - message[2]
            if -max_skew < skew < max_skew:
                use(number)
                return
            app.run_warning(f"{message.name} is not believed: its time stamp is far from now")
            if self._on_skew is not None:
                self._on_skew(skew)

        return handle

    def _set_speed_factor(self, factor: float) -> None:
        if factor < 0.0:
            self._app.run_warning("SPEED_FACTOR must not be negative")
        else:
            self._engine.speed_factor = factor

    def _set_override(self, override: bool) -> None:
        changed = self._engine.set_override(override)
        if not override:
            self._app.notify("PID_HAS_CONTROL", "true")
        elif changed:
            self._app.notify("PID_HAS_CONTROL", "false")
        if changed:
            self._app.event("manual override on" if override else "manual override off")
