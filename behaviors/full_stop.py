"""BHV_FullStop: come to a stop, and measure how far that takes (behaviors.md C19)."""

from __future__ import annotations

from math import hypot

from behaviors import forms
from behaviors.steering import at_most, coupled, course_peak
from ivp_helm.behavior import Behavior
from ivp_helm.ivp import IvPFunction
from pymoos_lite.config.parameters import Declaration
from pymoos_lite.geometry.attributes import Attributes
from pymoos_lite.geometry.shapes import XY, Point
from pymoos_lite.geometry.specs import erase_point_text, point_text


class FullStop(Behavior):
    """Asks for speed 0 on the heading of the start until the vessel has stopped, then completes."""

    BHV_NAME = "BHV_FullStop"
    DEFAULT_NAME = "bhv_full_stop"
    INFO = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED")
    PARAMETERS = Declaration(
        (
            forms.number("stop_thresh", 0.1, "m/s", "Slower than this is stopped."),
            forms.number("delay_complete", 0.0, "s", "Time from the stop to completion."),
            forms.number(
                "mark_duration", 0.0, "s", "Time from the stop, marked by mark_flag, to unmark_flag."
            ),
            forms.flag("mark_flag", "Posted when the vessel has stopped."),
            forms.flag("unmark_flag", "Posted mark_duration after the stop."),
        )
    )

    def setup(self) -> None:
        self._label = f"fstop_{self.community}"
        self._reset()

    def _reset(self) -> None:
        self._start: XY | None = None
        self._heading = 0.0
        self._began = 0.0
        self._stopped: float | None = None
        self._marked = False
        self._far = 0.0
        self._distance = 0.0
        self._time = 0.0
        self._done = False
        """Completed, being perpetual: nothing more until it is activated again."""

    def on_idle_to_run(self) -> None:
        self._reset()

    def on_run_to_idle(self) -> None:
        self._erase()

    def on_complete(self) -> None:
        self._erase()

    def on_run(self) -> IvPFunction | None:
        own = self.own
        if self._done:
            self.why = "stopped"
            return None
        if self._start is None:
            self._start = own.x, own.y
            self._heading, self._began = own.heading, self.now
        if self.visuals:
            looks = Attributes(
                label=self._label, label_color="invisible", vertex_color="pink", vertex_size=10.0
            )
            self.post("VIEW_POINT", point_text(Point(*self._start, attributes=looks)))
        if self._stopped is None:
            self._measure(own.x, own.y, own.speed)
        if self._stopped is not None and self._waited():
            self._done = True
            self.complete("stopped")
            self._erase()
            return None
        self.why = f"{self._distance:.1f} m from where it began to stop, at {own.speed:.1f} m/s"
        return coupled(course_peak(self.domain, self._heading), at_most(self.domain, "speed", 0.0, 0.0))

    def _measure(self, x: float, y: float, speed: float) -> None:
        assert self._start is not None
        self._distance = hypot(x - self._start[0], y - self._start[1])
        self._time = self.now - self._began
        drifting_back = self._distance < self._far
        self._far = max(self._far, self._distance)
        if speed < self.config.stop_thresh or drifting_back:
            self._distance = self._far
            self._stopped = self.now
            self._marked = True
            self.post_flags(self.config.mark_flag)

    def _waited(self) -> bool:
        assert self._stopped is not None
        config, elapsed = self.config, self.now - self._stopped + 1e-9
        if self._marked and elapsed >= config.mark_duration:
            self._marked = False
            self.post_flags(config.unmark_flag)
        return not self._marked and bool(elapsed >= config.delay_complete)

    def macro(self, name: str) -> float | str | None:
        return {"STOP_DIST": self._distance, "STOP_TIME": self._time}.get(name)

    def _erase(self) -> None:
        if self.visuals:
            self.post("VIEW_POINT", erase_point_text(self._label))
